/* A compiled model that runs without Python: steps, events, modes. No allocation; one pt_model is one run. */
#ifndef POWERTRAIN_RUN_H
#define POWERTRAIN_RUN_H
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

enum {
    PT_OK = 0,
    PT_FULL = 1,        /* the record is full: empty it and call again */
    PT_UNDERFLOW = -1,  /* the step size became too small */
    PT_MODES = -2,      /* neither Newton's method nor one law at a time found modes that fit together */
    PT_ALGEBRA = -3,    /* the implicit equations have no solution near the last one */
    PT_RATES = -4,      /* a rate is not finite */
    PT_GUARD = -5,      /* a quantity left its range */
    PT_RESETS = -6,     /* resets follow one another without end */
    PT_EVENTS = -7,     /* too many events at one instant or in one fixed step */
    PT_CONFLICT = -8,   /* two laws reset one variable to different values at one instant */
    PT_IMPACT = -9,     /* a jump throws a one-way law backward: impacts are for the host */
    PT_REFUSED = -10    /* limits of friction in the wrong order, so that it would drive, or rest where nothing determines its torque */
};

typedef struct pt_model pt_model;

/* Piecewise linear signals of time: breakpoints in order with their owners; segments (t0, y0, slope) of all signals. */
typedef struct {
    int points;
    const double *times;
    const int *owners;
    const int *jumps;
    const int *first; /* of each signal in starts; one more for the end */
    const double *starts;
    const double *rows; /* three numbers; each signal has one row more than starts */
} pt_signals;

/* One run in static memory; more in memory of pt_size() bytes. Call pt_start or pt_load first, and do not move or copy a model: it points into
   itself. */
pt_model *pt_instance(void);
size_t pt_size(void);
void pt_sizes(int *out); /* states, algebraic unknowns, held values, parameters, laws that reset, inputs */
void pt_start(pt_model *model);
void pt_load(pt_model *model, double t, const double *x, const double *z, const double *m, const double *p);
void pt_tolerance(pt_model *model, double rtol, double atol, double max_step);
void pt_use_signals(pt_model *model, const pt_signals *signals);
/* An input keeps the value from now on, also where the export or pt_use_signals gave it over time. */
void pt_set_input(pt_model *model, int k, double value);
void pt_set_parameter(pt_model *model, int k, double value);
double pt_time(const pt_model *model);
const double *pt_unknowns(const pt_model *model); /* x, then z */
const double *pt_held(const pt_model *model);
/* With error control up to ``stop``; in one step of ``dt`` besides events, for real-time targets. */
int pt_run(pt_model *model, double stop);
int pt_step(pt_model *model, double dt);
/* Where steps (place of held values, t, h, dense output), held values and instants are kept; NULL keeps nothing. */
void pt_record(pt_model *model, double *rows, long most_rows, double *held, long most_held, double *instants, long most_instants);
/* States and unknowns at ascending times, written while the run passes them; NULL for none. */
void pt_sample(pt_model *model, const double *times, long count, double *out);
/* Steps, rejected steps, events, and how many rows, held values and instants were kept since the last pt_record. */
void pt_counts(const pt_model *model, long *out);
const char *pt_message(int status);

#ifdef __cplusplus
}
#endif
#endif
