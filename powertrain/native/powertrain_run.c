/* One model as C: its memory, and what users call. */
#include "powertrain_run.h"

#include <math.h>
#include <string.h>

#include "model.h"
#include "powertrain_loop.h"

/* A run with all its memory; C has no arrays without a number. */
typedef struct {
    pt_model model;
    double y[2][PT_Y], reached[2][PT_Y + PT_INDICATORS], m[PT_HELD + 1], p[PT_PARAMETERS + 1], time[2], tolerance[2], info[PT_INFO + 4], dense[5 * PT_Y];
    double outside[PT_GUARDS + 1], fraction, above[PT_INDICATORS + 1], at[PT_Y], g[PT_INDICATORS + 1], worst;
    double held[PT_HELD + 1], flags[PT_FLAGS], edges[PT_WHENS + 1], closing[PT_BARRIERS + 1], fire[PT_TIMED + 1], jumped[2], first[2];
    double corners[2], instants[PT_TIMED + 1], nearer[PT_Y], resets[PT_RESET_VALUES + 1], open, mobility[PT_FRICTIONS * PT_FRICTIONS + 1];
    double rate[PT_FRICTIONS + 1], terms[PT_FRICTIONS + 1], size[PT_FRICTIONS + 1], calm[PT_RESTS + 1];
    double seen[PT_PASSES * PT_HELD + 1], held_left[PT_HELD + 1], before[PT_HELD + 1], left[PT_Y], lows[PT_INDICATORS + 1];
    const double *arg[PT_ARG];
    double *res[PT_RES], w[PT_WORK + 1];
    long long iw[PT_IW + 1];
    int which[PT_WHENS + 1], holds[PT_FRICTIONS + 1], overridden[PT_SIGNALS + 1];
} Instance;

static const pt_dimensions dimensions = {PT_X, PT_Z, PT_Y, PT_HELD, PT_INDICATORS, PT_WHENS, PT_TIMED, PT_RESTS, PT_LAWS, PT_FRICTIONS, 0, 0};
static const pt_tables tables = {pt_places, pt_when_place, pt_when_first, pt_when_initially, pt_reset_place, pt_reset_discrete, pt_rests, pt_rest_laws, pt_laws,
                                 pt_frictions, pt_quiet, pt_bends, pt_guards};
static const pt_functions functions = {pt_method, 0, 0, 0, 0, 0, pt_fresh, pt_rest, pt_locate, pt_corner, pt_update, pt_newton, pt_instants,
                                       pt_longest, pt_resets, pt_mobility};

static void connect(Instance *i)
{
    pt_model *a = &i->model;
    a->n = &dimensions, a->of = &tables, a->f = &functions, a->signals = &pt_default_signals;
    a->arg = i->arg, a->res = i->res, a->iw = i->iw, a->w = i->w;
    for (int k = 0; k < 2; k++) a->y[k] = i->y[k], a->reached[k] = i->reached[k];
    a->m = i->m, a->p = i->p, a->time = i->time, a->tolerance = i->tolerance, a->info = i->info, a->dense = i->dense;
    a->outside = i->outside, a->fraction = &i->fraction, a->above = i->above, a->at = i->at, a->g = i->g, a->worst = &i->worst;
    a->held = i->held, a->flags = i->flags, a->edges = i->edges, a->closing = i->closing, a->fire = i->fire, a->jumped = i->jumped;
    a->first = i->first, a->corners = i->corners, a->instants = i->instants, a->nearer = i->nearer, a->resets = i->resets;
    a->open = &i->open, a->mobility = i->mobility, a->rate = i->rate, a->terms = i->terms, a->size = i->size, a->calm = i->calm;
    a->seen = i->seen, a->held_left = i->held_left, a->before = i->before, a->left = i->left, a->lows = i->lows;
    a->which = i->which, a->holds = i->holds, a->overridden = i->overridden;
}

static int advance(pt_model *a, double stop, int fixed)
{
    a->stop = stop;
    a->fixed = fixed;
    int status = a->begun && !a->changed ? PT_OK : pt_begin(a);
    if (status) return status;
    pt_choose(a);
    return pt_continue(a);
}

int pt_run(pt_model *a, double stop)
{
    return advance(a, stop, 0);
}

int pt_step(pt_model *a, double dt)
{
    return advance(a, a->t + dt, 1);
}

pt_model *pt_instance(void)
{
    static Instance instance;
    return &instance.model;
}

size_t pt_size(void)
{
    return sizeof(Instance);
}

void pt_sizes(int *out)
{
    const int sizes[] = {PT_X, PT_Z, PT_HELD, PT_PARAMETERS, PT_WHENS, PT_INPUTS};
    memcpy(out, sizes, sizeof sizes);
}

void pt_load(pt_model *a, double t, const double *x, const double *z, const double *m, const double *p)
{
    memset(a, 0, sizeof(Instance));
    connect((Instance *)a);
    a->t = a->start = a->crossed = t;
    memcpy(a->y[0], x, PT_X * sizeof(double));
    memcpy(a->y[0] + PT_X, z, PT_Z * sizeof(double));
    memcpy(a->m, m, PT_HELD * sizeof(double));
    memcpy(a->p, p, PT_PARAMETERS * sizeof(double));
    pt_tolerance(a, 1e-6, 1e-6, INFINITY);
}

void pt_start(pt_model *a)
{
    pt_load(a, pt_t0, pt_x0, pt_z0, pt_m0, pt_p0);
}

void pt_tolerance(pt_model *a, double rtol, double atol, double max_step)
{
    a->tolerance[0] = rtol;
    a->tolerance[1] = atol;
    a->max_step = max_step;
}

void pt_use_signals(pt_model *a, const pt_signals *signals)
{
    a->signals = signals;
}

void pt_set_input(pt_model *a, int k, double value)
{
    double *segment = a->m + pt_places[pt_inputs[k]];
    segment[0] = a->t;
    segment[1] = value;
    segment[2] = 0;
    a->overridden[pt_inputs[k]] = 1;
    a->changed = 1;
}

void pt_set_parameter(pt_model *a, int k, double value)
{
    a->p[k] = value;
    a->changed = 1;
}

double pt_time(const pt_model *a)
{
    return a->t;
}

const double *pt_unknowns(const pt_model *a)
{
    return a->y[a->side];
}

const double *pt_held(const pt_model *a)
{
    return a->m;
}

void pt_record(pt_model *a, double *rows, long most_rows, double *held, long most_held, double *instants, long most_instants)
{
    a->row = rows, a->most_rows = most_rows, a->rows = 0;
    a->held_row = held, a->most_held = most_held, a->helds = 0;
    a->instant_row = instants, a->most_instants = most_instants, a->kept = 0;
    if (a->begun) pt_keep_held(a);
}

void pt_sample(pt_model *a, const double *times, long count, double *out)
{
    a->sample_times = times;
    a->samples = times ? count : 0;
    a->sampled = 0;
    a->out = out;
}

void pt_counts(const pt_model *a, long *out)
{
    const long counts[] = {a->steps, a->rejected, a->events, a->rows, a->helds, a->kept};
    memcpy(out, counts, sizeof counts);
}

const char *pt_message(int status)
{
    static const char *const said[] = {
        "done", "the step size became too small", "no modes were found that fit together",
        "the implicit equations have no solution near the last one", "a rate is not finite", "a quantity left its range",
        "resets follow one another without end", "too many events at one instant or in one fixed step",
        "two laws reset one variable to different values",
        "a jump throws a one-way law backward, and impacts are not available in C",
        "a friction law has a lower limit above its upper limit, or rests where nothing determines its torque"};
    return status == PT_FULL ? "the record is full" : said[-status];
}
