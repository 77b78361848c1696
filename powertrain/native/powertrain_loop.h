/* What the loop works on: sizes, tables, functions and arrays of one model, and the state of one run. */
#ifndef POWERTRAIN_LOOP_H
#define POWERTRAIN_LOOP_H
#include "powertrain_limits.h"
#include "powertrain_run.h"

/* As CasADi generates it. */
typedef int (*pt_function)(const double **, double **, long long *, double *, int);

/* y is (x, z), at least one number long. */
typedef struct {
    int x, z, y, m, indicators, whens, timed, rests, laws, frictions, counted, constants;
} pt_dimensions;

/* Places in the held values, and what belongs to each indicator and reset. */
typedef struct {
    const int *places, *when_place, *when_first, *when_initially, *reset_place, *reset_discrete, *rests, *rest_laws, *laws, *frictions, *quiet, *bends, *guards;
} pt_tables;

/* NULL for what the model does not need. A step is one function, or in parts: constants, advance, samples, survey, verdict. */
typedef struct {
    pt_function method, constants, advance, samples, survey, verdict, fresh, rest, locate, corner, update, newton, instants, longest, resets, mobility;
} pt_functions;

struct pt_model {
    const pt_dimensions *n;
    const pt_tables *of;
    const pt_functions *f;
    const pt_signals *signals;
    /* work vectors, long enough for each function */
    const double **arg;
    double **res;
    long long *iw;
    double *w;
    /* arguments and results of the functions; a step reads one side of y and reached and writes the other */
    double *y[2], *reached[2], *m, *p, *time, *tolerance, *info, *dense, *outside, *fraction, *above, *at, *g, *worst;
    double *held, *flags, *edges, *closing, *fire, *jumped, *first, *corners, *instants, *nearer, *resets, *open, *points, *found, *least, *stiffness;
    double **constants;
    /* of each law of friction: its row of the mobility, rate, sum of terms, size of its mobility; of each that may rest: whether it is calm */
    double *mobility, *rate, *terms, *size, *calm;
    /* kept by the loop: PT_PASSES held values, held values of the last record and before an event, unknowns before it */
    double *seen, *held_left, *before, *left, *lows, *prepared, *counts;
    int *which, *holds, *overridden;
    /* records and outputs; NULL for none */
    double *row, *held_row, *instant_row, *out;
    const double *sample_times;
    double t, start, stop, h, longest, crossed, max_step, instant, corner, target, stiff;
    int side, begun, changed, fixed, idle, reset, located;
    int prepared_once;   /* the constants are those of the held values in prepared */
    int hosted;          /* a host resolves events that are not routine, */
    int every_event;     /* or every event, */
    int every_mode;      /* or every one but kinks and corners, */
    int every_idle;      /* or every one that is located and changes no mode */
    int explicit_method; /* stop with PT_TOO_STIFF where stability limits the steps */
    long steps, rejected, events, rows, helds, kept, sampled, most_rows, most_held, most_instants, samples;
};

/* Said to hosts only. */
enum {
    PT_TOO_STIFF = 2, /* stability limits the steps of the explicit method */
    PT_ASK = -11      /* the host resolves this event */
};

int pt_begin(pt_model *model);
/* The longest step, which the modes and the stop limit. */
void pt_choose(pt_model *model);
/* Continue a run that has begun up to its stop. */
int pt_continue(pt_model *model);
void pt_keep_held(pt_model *model);
#endif
