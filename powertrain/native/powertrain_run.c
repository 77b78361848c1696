/* The loop over steps and events: the same method, tolerances and order of decisions as powertrain's simulator in Python. */
#include "powertrain_run.h"

#include <math.h>
#include <string.h>

#include "model.h"

#define PLACES 5 /* 0, the checks inside a step, 1 */
#define INFO 5
#define ROUNDS 1000
#define MOST_EVENTS 1000
#define MOST_EXCHANGES 1000

struct pt_model {
    double t, start, stop, h, longest, crossed, max_step, instant, corner, target;
    double y[2][PT_Y], slope[2][PT_Y], m[PT_M], p[PT_P];
    double time[2], tolerance[2], info[INFO + 4], dense[5 * PT_Y], outside[PT_O];
    double fraction, above[PT_G], at[PT_Y], g[PT_G], worst;
    double held[PT_M], flags[6], edges[PT_W], closing[PT_B], fire[PT_T], jumped[2];
    double first[2], corners[2], instants[PT_T], resets[PT_R], nearer[PT_Y], open;
    double left[PT_Y], held_left[PT_M], seen[PT_PASSES][PT_M], mobility[PT_F][PT_F], size[PT_F], rate[PT_F], terms[PT_F], rate_known, calm[PT_RESTS + 1];
    int side, begun, changed, fixed, idle, reset, which[PT_W], holds[PT_F];
    long steps, rejected, events, rows, helds, kept, sampled;
    long most_rows, most_held, most_instants, samples;
    double *row, *held_row, *instant_row, *out;
    const double *sample_times;
    const pt_signals *signals;
    long long iw[PT_IW];
    double w[PT_WORK];
};

typedef int (*Function)(const double **, double **, long long *, double *, int);

static void call(pt_model *a, Function f, const double *const *given, int n, double *const *wanted, int k)
{
    const double *arg[PT_ARG];
    double *res[PT_RES];
    for (int i = 0; i < n; i++) arg[i] = given[i];
    for (int i = 0; i < k; i++) res[i] = wanted[i];
    f(arg, res, a->iw, a->w, 0);
}

#define CALL(a, f, given, wanted) \
    call(a, f, given, (int)(sizeof(given) / sizeof *(given)), wanted, (int)(sizeof(wanted) / sizeof *(wanted)))

static int same(const double *a, const double *b)
{
    return memcmp(a, b, PT_M * sizeof *a) == 0;
}

/* Signals of time */

static int after(const double *times, int n, double t)
{
    int low = 0, high = n;
    while (low < high) {
        int middle = (low + high) / 2;
        if (times[middle] <= t) low = middle + 1;
        else high = middle;
    }
    return low;
}

static void enter_segment(pt_model *a, int k, double t)
{
    const pt_signals *s = a->signals;
    int first = s->first[k], n = s->first[k + 1] - first;
    int row = first + k + after(s->starts + first, n, t);
    memcpy(a->m + pt_places[k], s->rows + 3 * row, 3 * sizeof(double));
}

static double following(const pt_model *a, double t)
{
    int i = after(a->signals->times, a->signals->points, t);
    return i < a->signals->points ? a->signals->times[i] : INFINITY;
}

static int cross(pt_model *a, double before, double t)
{
    const pt_signals *s = a->signals;
    int jumps = 0;
    for (int i = after(s->times, s->points, before); i < after(s->times, s->points, t); i++) {
        enter_segment(a, s->owners[i], t);
        jumps |= s->jumps[i];
    }
    return jumps;
}

/* Instants that are known */

static void know_instants(pt_model *a)
{
    const double *given[] = {a->m, a->p};
    double *wanted[] = {a->instants};
    if (PT_TIMED) CALL(a, pt_instants, given, wanted);
}

static double next_instant(pt_model *a)
{
    double least = INFINITY, later = a->t + PT_NOW * fmax(1, fabs(a->t));
    know_instants(a);
    for (int k = 0; k < PT_TIMED; k++)
        if (a->instants[k] > later && a->instants[k] < least) least = a->instants[k];
    return least;
}

static void fire(pt_model *a)
{
    know_instants(a);
    for (int k = 0; k < PT_TIMED; k++)
        if (fabs(a->instants[k] - a->t) <= PT_NOW * fmax(1, fabs(a->t))) a->fire[k] = 1;
}

/* Modes */

static int solvable(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p};
    double *wanted[] = {a->nearer, &a->open};
    if (!PT_Z) return 1;
    for (int tries = 0; tries < 5; tries++) { /* each is three full steps of Newton's method */
        CALL(a, pt_newton, given, wanted);
        for (int i = 0; i < PT_Z; i++)
            if (!isfinite(a->nearer[i])) return 0;
        memcpy(a->y[a->side] + PT_X, a->nearer, PT_Z * sizeof(double));
        if (a->open == 0) return 1;
    }
    return 0;
}

static void apply_rules(pt_model *a, double slack)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p, a->fire, a->jumped};
    double *wanted[] = {a->held, a->flags, a->edges, a->closing};
    a->jumped[1] = slack;
    CALL(a, pt_update, given, wanted);
    a->jumped[1] = 0;
}

static void apply_resets(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->y[a->side] + PT_X, a->m, a->p};
    double *wanted[] = {a->resets};
    CALL(a, pt_resets, given, wanted);
    for (int k = 0; k < PT_WHENS; k++) {
        if (!a->edges[k]) continue;
        a->m[pt_when_place[k]] = 1;
        for (int i = pt_when_first[k]; i < pt_when_first[k + 1]; i++) {
            double *target = pt_reset_discrete[i] ? a->m : a->y[a->side];
            target[pt_reset_place[i]] = a->resets[i];
            if (!pt_reset_discrete[i]) a->reset = a->which[k] = 1;
        }
    }
    a->jumped[0] = 1;
}

/* All laws by their rules from the same torques, until none changes: 1, or 0 after a reset, or an error. With ``slack`` a law at rest may
   slide with a rate of zero, within what is known of it. */
static int newton(pt_model *a, double slack)
{
    for (int pass = 0; pass < PT_PASSES; pass++) {
        if (!solvable(a)) return PT_ALGEBRA;
        apply_rules(a, slack);
        if (a->flags[1]) {
            apply_resets(a);
            return 0;
        }
        memset(a->fire, 0, sizeof a->fire);
        a->jumped[0] = 0;
        if (!a->flags[0]) return 1;
        memcpy(a->seen[pass], a->m, sizeof a->m);
        for (int i = 0; i < pass; i++)
            if (same(a->seen[i], a->m)) return PT_MODES;
        memcpy(a->m, a->held, sizeof a->m);
    }
    return PT_MODES;
}

/* Whether the present modes are consistent. */
static int consistent(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p, a->tolerance};
    double *wanted[] = {a->y[1 - a->side], a->slope[1 - a->side], a->first};
    if (!solvable(a)) return 0;
    CALL(a, pt_fresh, given, wanted);
    if (!isfinite(a->first[1])) return 0;
    apply_rules(a, 1);
    return a->flags[0] == 0;
}

/* One law at a time, the first that its rule would change: K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem,
   Opsearch 11 (1974) 123. It ends where the torques of every law have their way with its own speed, which Newton's method need not. */
static int one_by_one(pt_model *a)
{
    for (int tries = 0; tries < MOST_EXCHANGES; tries++) {
        if (consistent(a)) return 1;
        int k = 0;
        while (k < PT_LAWS && a->m[pt_laws[k]] == a->held[pt_laws[k]]) k++;
        if (k == PT_LAWS) return PT_MODES;
        a->m[pt_laws[k]] = a->held[pt_laws[k]];
        for (int i = 0; i < PT_RESTS; i++)
            if (pt_rest_laws[i] == pt_laws[k]) a->m[pt_rests[i]] = a->held[pt_rests[i]];
    }
    return PT_MODES;
}

/* Eliminates the laws that hold from the mobility (rates by torques, scaled to a diagonal of one) and from the rates without torques:
   what others hold has nothing left. */
static void eliminate_what_holds(pt_model *a)
{
    double (*G)[PT_F] = a->mobility;
    for (int i = 0; i < PT_F; i++) {  /* where the terms of G_ii cancel, their size */
        double own = fabs(G[i][i]), terms = a->size[i];
        a->size[i] = sqrt(own > PT_SINGULAR * terms ? own : terms > 0 ? terms : 1);
    }
    for (int i = 0; i < PT_F; i++)
        for (int j = 0; j < PT_F; j++) G[i][j] /= a->size[i] * a->size[j];
    a->rate_known = 0;
    for (int i = 0; i < PT_F; i++) {
        a->holds[i] = a->m[pt_frictions[i]] == 0;
        a->rate[i] /= a->size[i];
        a->terms[i] = fabs(a->rate[i]);
        if (a->holds[i]) a->rate_known += PT_SINGULAR * a->terms[i];
    }
    for (;;) {
        int k = -1;
        for (int i = 0; i < PT_F; i++)
            if (a->holds[i] && G[i][i] > PT_SINGULAR && (k < 0 || G[i][i] > G[k][k])) k = i;
        if (k < 0) return;
        a->holds[k] = 0;
        for (int i = 0; i < PT_F; i++) {
            double share = i == k ? 0 : G[i][k] / G[k][k];
            if (share == 0) continue;
            for (int j = 0; j < PT_F; j++) G[i][j] -= share * G[k][j];
            a->rate[i] -= share * a->rate[k];
            a->terms[i] += fabs(share) * a->terms[k];
        }
    }
}

/* Marks the laws at a limit that others hold at rest; 0 if one is held no longer, so that it slides and modes are to be found again. */
static int marked(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p};
    double *wanted[] = {a->mobility[0], a->rate, a->size, a->calm};
    int some = a->flags[4] > 0, all = 1;
    for (int k = 0; k < PT_RESTS; k++) some |= a->m[pt_rests[k]] != 0;
    if (!some) return 1;
    CALL(a, pt_mobility, given, wanted);
    eliminate_what_holds(a);
    for (int k = 0, i = 0; k < PT_RESTS; k++) {
        double left = 0, before = a->m[pt_rests[k]], mode = fabs(a->m[pt_rest_laws[k]]);
        while (pt_frictions[i] != pt_rest_laws[k]) i++;
        for (int j = 0; j < PT_F; j++) left = fmax(left, fabs(a->mobility[i][j]));
        int held = mode == 1 && a->calm[k] && left <= PT_NOTHING && fabs(a->rate[i]) <= PT_NOTHING * a->terms[i] + a->rate_known;
        a->m[pt_rests[k]] = held;
        all &= a->m[pt_rests[k]] >= before;
    }
    return all;
}

static int resolve(pt_model *a)
{
    a->reset = 0;
    memset(a->which, 0, sizeof a->which);
    for (int round = 0; round < ROUNDS; round++) {
        int found = newton(a, 0);
        if (found == PT_MODES) found = one_by_one(a);
        if (found < 0) return found;
        if (found && marked(a)) return PT_OK;
    }
    return PT_RESETS;
}

/* Restart after a discontinuity: stuck speeds are zero, the slope, a first step size. */

static int refresh(pt_model *a, double *h)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p, a->tolerance};
    double *wanted[] = {a->y[1 - a->side], a->slope[1 - a->side], a->first};
    a->time[0] = a->t;
    CALL(a, pt_fresh, given, wanted);
    a->side = 1 - a->side;
    *h = a->first[0];
    return isfinite(a->first[1]) ? PT_OK : PT_RATES;
}

/* What has been stuck is at rest, but for what a long step leaves. */
static void hold(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p};
    double *wanted[] = {a->y[1 - a->side]};
    CALL(a, pt_rest, given, wanted);
    a->side = 1 - a->side;
}

static int restart(pt_model *a)
{
    double h;
    int status = refresh(a, &h);
    a->h = fmin(h, a->max_step);
    return status;
}

static void keep_held(pt_model *a)
{
    memcpy(a->held_left, a->m, sizeof a->m);
    if (a->held_row) memcpy(a->held_row + PT_M * a->helds, a->m, sizeof a->m);
    a->helds++;
}

static void choose(pt_model *a)
{
    const double *given[] = {&a->t, &a->stop, a->m, a->p};
    double *wanted[] = {&a->longest};
    CALL(a, pt_longest, given, wanted);
    a->longest = fmin(a->longest, a->max_step);
}

static int turns(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p};
    double *wanted[] = {a->y[1 - a->side], a->slope[1 - a->side], a->corners};
    if (!PT_TURNING) return 0;
    CALL(a, pt_corner, given, wanted);
    if (a->corners[0] != 0 || !isfinite(a->corners[1])) return 0;
    a->side = 1 - a->side;
    a->idle = 0;
    keep_held(a);
    return 1;
}

/* Go on past the point where expressions bend; 0 where more than their modes has to be resolved. */
static int bends(pt_model *a)
{
    int found = 0;
    for (int k = 0; k < PT_INDICATORS; k++) {
        if (a->g[k] > 0) continue;
        if (pt_bends[k] < 0) return 0;
        found++;
    }
    if (!found) return 0;
    for (int turn = 0; turn < 2; turn++) {
        for (int k = 0; k < PT_INDICATORS; k++)
            if (a->g[k] <= 0) a->m[pt_bends[k]] = 1 - a->m[pt_bends[k]];
        if (!turn && turns(a)) {
            choose(a);
            return 1;
        }
    }
    return 0;
}

/* Events inside a step: the Illinois method on the dense polynomial */

static double value_at(pt_model *a, double q)
{
    const double *given[] = {a->time, &a->fraction, a->above, a->dense, a->m, a->p};
    double *wanted[] = {a->at, a->g, &a->worst};
    a->fraction = q;
    CALL(a, pt_locate, given, wanted);
    return a->worst;
}

static double between(pt_model *a, double low, double high, double at_low, double at_high, double aim)
{
    double before = low, at_before = at_low, beyond = high, at_beyond = at_high, weight_low = at_low, weight_high = at_high;
    double enough = PT_AIM;
    int side = 0, flat_above = 0, flat_below = 0;
    for (int i = 0; i < 150; i++) {
        double q;
        if (high - low < PT_CLOSE) enough = fmin(2 * enough, PT_LARGEST);
        if (at_high >= -enough) break;
        if (flat_above) q = at_beyond < at_high ? high - (beyond - high) * at_high / (at_beyond - at_high) : high;
        else if (flat_below) q = at_before > at_low ? low + (low - before) * at_low / (at_before - at_low) : low;
        else q = low + (high - low) * weight_low / (weight_low - weight_high);
        if (!(low < q && q < high)) {
            q = 0.5 * (low + high);
            if (!(low < q && q < high)) break;
        }
        double value = value_at(a, q) + aim;
        if (-enough <= value && value <= PT_AIM) return q;
        if (value > 0) {
            flat_above = value > 0.5 * at_low;
            weight_high = side == 1 ? 0.5 * weight_high : at_high;
            before = low, at_before = at_low, low = q, at_low = weight_low = value, side = 1;
        } else {
            flat_below = value < 0.5 * at_high;
            weight_low = side == 2 ? 0.5 * weight_low : at_low;
            beyond = high, at_beyond = at_high, high = q, at_high = weight_high = value, side = 2;
        }
    }
    value_at(a, high);
    return high;
}

/* As between, and what is above zero at high counts where it is below at the place that is found: it fell before. */
static double first_of(pt_model *a, double low, double high, double at_low, double at_high, double depth)
{
    double start[PT_G];
    for (int k = 0; k < PT_INDICATORS; k++) start[k] = a->g[k] + depth;
    for (;;) {
        int earlier = 0;
        high = between(a, low, high, at_low + PT_AIM, at_high + PT_AIM, depth + PT_AIM);
        at_low = at_high = HUGE_VAL;
        for (int k = 0; k < PT_INDICATORS; k++) {
            double there = a->g[k] + depth;
            if (a->above[k] > 0 && start[k] > 0 && there < -2 * PT_AIM) {
                a->above[k] = there;
                earlier = 1;
            }
            if (a->above[k] > 0) continue;
            at_low = fmin(at_low, start[k]);
            at_high = fmin(at_high, there);
        }
        if (!earlier) return high;
    }
}

/* The fraction of the last step at which the first indicator is below zero; -1 for none on closer look. */
static double find(pt_model *a, double depth)
{
    static const double places[PLACES] = {0, 0.25, 0.5, 0.75, 1};
    int first = 1;
    while (a->info[INFO + first - 1] + depth > 0)
        if (++first == PLACES) return -1;
    double low = places[first - 1], high = places[first];
    memset(a->above, 0, sizeof a->above);
    double at_high = value_at(a, high) + depth;
    if (at_high > 0) return -1;
    if (at_high >= -2 * PT_AIM) return high;
    for (int k = 0; k < PT_INDICATORS; k++) a->above[k] = a->g[k] + depth;
    double at_low = value_at(a, low) + depth;
    return at_low <= 0 ? low : first_of(a, low, high, at_low, at_high, depth);
}

/* Steps */

static void sample(pt_model *a, double t, double h, double end, int last)
{
    while (a->sampled < a->samples && (a->sample_times[a->sampled] < end || (last && a->sample_times[a->sampled] <= end))) {
        double q = (a->sample_times[a->sampled] - t) / h, *out = a->out + PT_Y * a->sampled++;
        for (int i = 0; i < PT_Y; i++) {
            const double *c = a->dense + i;
            out[i] = c[0] + q * (c[PT_Y] + q * (c[2 * PT_Y] + q * (c[3 * PT_Y] + q * c[4 * PT_Y])));
        }
    }
}

static void keep_step(pt_model *a, double t, double h)
{
    if (a->row) {
        double *row = a->row + (3 + 5 * PT_Y) * a->rows;
        row[0] = (double)(a->helds - 1);
        row[1] = t;
        row[2] = h;
        memcpy(row + 3, a->dense, 5 * PT_Y * sizeof(double));
    }
    a->rows++;
    a->steps++;
}

static int full(const pt_model *a)
{
    return (a->row && a->rows >= a->most_rows) || (a->held_row && a->helds + 2 >= a->most_held) ||
           (a->instant_row && a->kept + 1 >= a->most_instants);
}

/* Move to the event inside the step just taken: 1, or 0 for none after all, or an error. */
static int located(pt_model *a, double t, double h)
{
    int n = a->idle < 20 ? a->idle : 20;
    double fraction = find(a, a->idle ? PT_EPS * ldexp(1, n) : 0);
    if (fraction < 0) return 0;
    a->side = 1 - a->side;
    memcpy(a->y[a->side], a->at, sizeof a->at);
    a->t = fraction == 1 && t + 1.01 * h >= a->target ? a->target : t + fraction * h;
    a->h = h;
    for (int k = 0; k < PT_INDICATORS; k++)
        if (pt_guards[k] && a->g[k] <= 0) return PT_GUARD;
    return 1;
}

/* Ratio of the next attempt to a rejected step, with the order that this attempt and the one rejected before it show. */
static double reduction(double h, double error, double refused_h, double refused_error)
{
    double order = PT_ORDER;
    if (!(error < INFINITY)) return PT_FAILED;
    if (refused_h > 0 && refused_error < INFINITY)
        order = fmin(fmax(log(refused_error / error) / log(refused_h / h), PT_LEAST_ORDER), order);
    return fmax(PT_SAFETY * pow(error, -1 / order), 1 / PT_GROWTH);
}

/* Step until an indicator falls below zero (1) or until the target (0); or PT_FULL as 2, or an error. */
static int smooth(pt_model *a)
{
    double h = fmin(a->h, a->longest), wanted = 0, finest = PT_FINEST * fmin(a->stop - a->start, a->longest);
    double refused_h = 0, refused_error = 0;
    int rejected = 0, halved = 0;
    for (;;) {
        double t = a->t;
        int last = a->fixed || t + 1.01 * h >= a->target;
        if (last) {
            wanted = a->fixed ? 0 : h;
            h = a->target - t;
        }
        if (full(a)) {
            a->h = last && wanted > 0 ? wanted : h;
            return 2;
        }
        a->time[0] = t;
        a->time[1] = h;
        const double *given[] = {a->time, a->y[a->side], a->m, a->p, a->slope[a->side], a->tolerance};
        double *results[] = {a->y[1 - a->side], a->slope[1 - a->side], a->info, a->dense, a->outside};
        CALL(a, pt_method, given, results);
        double error = a->info[0];
        if (a->fixed && !isfinite(error)) return PT_RATES;
        if (!a->fixed && !(error <= 1)) {
            a->rejected++;
            rejected = 1;
            double size = h;
            h *= reduction(h, error, refused_h, refused_error);
            refused_h = size;
            refused_error = error;
            if (h < PT_SHORTEST * fmax(1, fabs(t))) return PT_UNDERFLOW;
            continue;
        }
        if (!a->fixed && a->info[1] && halved < PT_HALVINGS && h > finest) {
            halved++;
            a->rejected++;
            rejected = 1;
            h *= 0.5;
            continue;
        }
        keep_step(a, t, h);
        if (a->info[3] <= 0) {
            int found = located(a, t, h);
            if (found) {
                sample(a, t, h, a->t, 0);
                return found;
            }
        }
        double factor = rejected ? fmin(a->info[2], 1) : a->info[2];
        a->t = last ? a->target : t + h;
        sample(a, t, h, a->t, a->t >= a->stop);
        h = last ? fmax(h * factor, wanted) : h * factor;
        h = fmin(h, a->longest);
        rejected = halved = 0;
        refused_h = 0;
        a->side = 1 - a->side;
        a->h = h;
        if (last) return 0;
    }
}

static void keep_instant(pt_model *a)
{
    if (a->instant_row) {
        double *row = a->instant_row + (1 + 2 * PT_Y + 2 * PT_M + PT_W) * a->kept;
        *row++ = a->t;
        memcpy(row, a->left, sizeof a->left);
        memcpy(row + PT_Y, a->y[a->side], sizeof a->left);
        memcpy(row + 2 * PT_Y, a->seen[0], sizeof a->m);
        memcpy(row + 2 * PT_Y + PT_M, a->m, sizeof a->m);
        for (int k = 0; k < PT_W; k++) row[2 * PT_Y + 2 * PT_M + k] = a->which[k];
    }
    a->kept++;
    a->events++;
}

/* Whether only held values changed whose changes are no events. */
static int quiet(const double *before, const double *now)
{
    for (int i = 0; i < PT_M; i++)
        if (before[i] != now[i] && !pt_quiet[i]) return 0;
    return 1;
}

static int resume_after_event(pt_model *a, const double *before, int jumps, int changed)
{
    double h;
    if (!jumps && !a->reset && quiet(before, a->m)) {
        a->idle = changed ? 0 : a->idle + 1;
        return a->idle > MOST_EVENTS ? PT_EVENTS : refresh(a, &h);
    }
    a->idle = 0;
    int status = restart(a);
    memcpy(a->seen[0], before, sizeof a->m);
    keep_instant(a);
    return status;
}

static int event(pt_model *a, int found)
{
    double near = a->t + PT_NOW * fmax(1, fabs(a->t)), before[PT_M];
    int known = a->instant <= near, timed = known || a->corner <= near;
    if (!found && !timed) return PT_OK;
    a->time[0] = a->t;
    a->time[1] = 0;
    if (!timed && bends(a)) return PT_OK;
    memcpy(before, a->held_left, sizeof before);
    int jumps = a->corner <= near && cross(a, a->crossed, near);
    a->crossed = near;
    if (known) fire(a);
    else if (!found && !jumps && turns(a)) return PT_OK;
    memcpy(a->left, a->y[a->side], sizeof a->left);
    hold(a);
    int status = resolve(a);
    if (status) return status;
    int changed = !same(before, a->m);
    if (changed) {
        keep_held(a);
        choose(a);
    }
    return resume_after_event(a, before, jumps, changed);
}

static int begin(pt_model *a)
{
    int status = PT_OK;
    a->time[0] = a->t;
    if (a->changed) {
        a->jumped[0] = 0;
        memset(a->fire, 0, sizeof a->fire);
        status = resolve(a);
    }
    if (!status) status = restart(a);
    keep_held(a);
    a->begun = 1;
    a->changed = 0;
    a->crossed = a->t;
    return status;
}

static int advance(pt_model *a, double stop, int fixed)
{
    int status = PT_OK, events = 0;
    a->stop = stop;
    a->fixed = fixed;
    if (!a->begun || a->changed) status = begin(a);
    if (status) return status;
    choose(a);
    while (a->t < stop) {
        if (full(a)) return PT_FULL;
        a->instant = next_instant(a);
        a->corner = following(a, a->t);
        a->target = fmin(fmin(a->instant, a->corner), stop);
        int found = smooth(a);
        if (found == 2) return PT_FULL;
        status = found < 0 ? found : event(a, found);
        if (status) return status;
        if (fixed && found && ++events > MOST_EVENTS) return PT_EVENTS;
    }
    return PT_OK;
}

int pt_run(pt_model *a, double stop)
{
    return advance(a, stop, 0);
}

int pt_step(pt_model *a, double dt)
{
    return advance(a, a->t + dt, 1);
}

/* What users ask for */

pt_model *pt_instance(void)
{
    static pt_model instance;
    return &instance;
}

size_t pt_size(void)
{
    return sizeof(pt_model);
}

void pt_sizes(int *out)
{
    const int sizes[] = {PT_X, PT_Z, PT_M, PT_P, PT_W, PT_INPUTS};
    memcpy(out, sizes, sizeof sizes);
}

void pt_load(pt_model *a, double t, const double *x, const double *z, const double *m, const double *p)
{
    memset(a, 0, sizeof *a);
    a->t = a->start = a->crossed = t;
    memcpy(a->y[0], x, PT_X * sizeof(double));
    memcpy(a->y[0] + PT_X, z, PT_Z * sizeof(double));
    memcpy(a->m, m, sizeof a->m);
    memcpy(a->p, p, sizeof a->p);
    a->signals = &pt_default_signals;
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
    if (a->begun) keep_held(a);
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
        "resets follow one another without end", "too many events at one instant or in one fixed step"};
    return status == PT_FULL ? "the record is full" : said[-status];
}
