/* The loop over steps and events: the same method, tolerances and order of decisions as powertrain's simulator in Python. */
#include <math.h>
#include <string.h>

#include "powertrain_loop.h"

#define PLACES 5 /* 0, the checks inside a step, 1 */
#define ROUNDS 1000
#define MOST_EXCHANGES 1000

static void call(pt_model *a, pt_function f, const double *const *given, int n, double *const *wanted, int k)
{
    for (int i = 0; i < n; i++) a->arg[i] = given[i];
    for (int i = 0; i < k; i++) a->res[i] = wanted[i];
    f(a->arg, a->res, a->iw, a->w, 0);
}

#define CALL(a, f, given, wanted) \
    call(a, f, given, (int)(sizeof(given) / sizeof *(given)), wanted, (int)(sizeof(wanted) / sizeof *(wanted)))

static void copy(double *to, const double *from, int n)
{
    memcpy(to, from, (size_t)n * sizeof *to);
}

static void clear(double *values, int n)
{
    for (int i = 0; i < n; i++) values[i] = 0;
}

static int same(const double *a, const double *b, int n)
{
    return memcmp(a, b, (size_t)n * sizeof *a) == 0;
}

static int differ(const double *a, const double *b, int n)
{
    for (int i = 0; i < n; i++)
        if (a[i] != b[i]) return 1;
    return 0;
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
    copy(a->m + a->of->places[k], s->rows + 3 * row, 3);
}

/* Whether an input was set since the start: its signal of time no longer runs. */
static int overridden(const pt_model *a, int k)
{
    return a->overridden && a->overridden[k];
}

static double following(const pt_model *a, double t)
{
    const pt_signals *s = a->signals;
    int i = after(s->times, s->points, t);
    while (i < s->points && overridden(a, s->owners[i])) i++;
    return i < s->points ? s->times[i] : INFINITY;
}

static int cross(pt_model *a, double before, double t)
{
    const pt_signals *s = a->signals;
    int jumps = 0;
    for (int i = after(s->times, s->points, before); i < after(s->times, s->points, t); i++) {
        if (overridden(a, s->owners[i])) continue;
        enter_segment(a, s->owners[i], t);
        jumps |= s->jumps[i];
    }
    return jumps;
}

/* Instants that are known */

static double just_after(double t)
{
    return t + PT_NOW * fmax(1, fabs(t));
}

static void know_instants(pt_model *a)
{
    const double *given[] = {a->m, a->p};
    double *wanted[] = {a->instants};
    if (a->n->timed) CALL(a, a->f->instants, given, wanted);
}

static double next_instant(pt_model *a)
{
    double least = INFINITY, later = just_after(a->t);
    know_instants(a);
    for (int k = 0; k < a->n->timed; k++)
        if (a->instants[k] > later && a->instants[k] < least) least = a->instants[k];
    return least;
}

static void fire(pt_model *a)
{
    know_instants(a);
    for (int k = 0; k < a->n->timed; k++)
        if (fabs(a->instants[k] - a->t) <= PT_NOW * fmax(1, fabs(a->t))) a->fire[k] = 1;
}

/* Modes */

/* Solves for the implicit unknowns in the present modes. Where they have no solution it gives 0, and they are as they were: the other side,
   which is free at an event, keeps them. */
static int solvable(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p};
    double *wanted[] = {a->nearer, a->open}, *z = a->y[a->side] + a->n->x, *guess = a->y[1 - a->side] + a->n->x;
    int finite = 1;
    if (!a->n->z) return 1;
    copy(guess, z, a->n->z);
    for (int tries = 0; finite && tries < (a->hosted ? 1 : 5); tries++) { /* each is a few full steps of Newton's method */
        CALL(a, a->f->newton, given, wanted);
        for (int i = 0; i < a->n->z; i++) finite &= isfinite(a->nearer[i]) != 0;
        if (finite) copy(z, a->nearer, a->n->z);
        if (finite && *a->open == 0) return 1;
    }
    copy(z, guess, a->n->z);
    return 0;
}

static void apply_rules(pt_model *a, double slack)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p, a->fire, a->jumped};
    double *wanted[] = {a->held, a->flags, a->edges, a->closing};
    a->jumped[1] = slack;
    CALL(a, a->f->update, given, wanted);
    a->jumped[1] = 0;
}

/* Whether reset i gives another value to a variable that an earlier one at this instant has set. */
static int conflicts(const pt_model *a, int i)
{
    const pt_tables *of = a->of;
    for (int k = 0; of->when_first[k] < i; k++)
        for (int j = of->when_first[k]; a->edges[k] && j < i && j < of->when_first[k + 1]; j++)
            if (of->reset_place[j] == of->reset_place[i] && of->reset_discrete[j] == of->reset_discrete[i] &&
                fabs(a->resets[j] - a->resets[i]) > PT_JUMP * (1 + fabs(a->resets[j])))
                return 1;
    return 0;
}

/* The resets of all laws whose edges rise, with values from before: 1, or 0 if there are none, or an error. What is true as a run ``begins``
   has not become true, unless its law says so. */
static int apply_resets(pt_model *a, int begins)
{
    int some = 0;
    for (int k = 0; k < a->n->whens; k++) {
        if (!a->edges[k]) continue;
        a->m[a->of->when_place[k]] = 1;
        if (begins && !a->of->when_initially[k]) a->edges[k] = 0;
        else some = 1;
    }
    if (!some) return 0;
    const double *given[] = {a->time, a->y[a->side], a->y[a->side] + a->n->x, a->m, a->p};
    double *wanted[] = {a->resets};
    CALL(a, a->f->resets, given, wanted);
    for (int k = 0; k < a->n->whens; k++) {
        if (!a->edges[k]) continue;
        for (int i = a->of->when_first[k]; i < a->of->when_first[k + 1]; i++) {
            double *target = a->of->reset_discrete[i] ? a->m : a->y[a->side];
            if (conflicts(a, i)) return PT_CONFLICT;
            target[a->of->reset_place[i]] = a->resets[i];
            if (!a->of->reset_discrete[i]) a->reset = a->which[k] = 1;
        }
    }
    a->jumped[0] = PT_JUMPED;
    return 1;
}

/* Eliminates the laws that hold from the mobility (rates by torques, scaled to a diagonal of one) and from the rates without torques:
   what others hold has nothing left. Gives what is not known of the rates. */
static double eliminate_what_holds(pt_model *a)
{
    int n = a->n->frictions;
    double *G = a->mobility, unknown = 0;
    for (int i = 0; i < n; i++) { /* where the terms of G_ii cancel, their size */
        double own = fabs(G[i * n + i]), terms = a->size[i];
        a->size[i] = sqrt(own > PT_SINGULAR * terms ? own : terms > 0 ? terms : 1);
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) G[i * n + j] /= a->size[i] * a->size[j];
    for (int i = 0; i < n; i++) {
        a->holds[i] = a->m[a->of->frictions[i]] == 0;
        a->rate[i] /= a->size[i];
        a->terms[i] = fabs(a->rate[i]);
        if (a->holds[i]) unknown += PT_SINGULAR * a->terms[i];
    }
    for (;;) {
        int k = -1;
        for (int i = 0; i < n; i++)
            if (a->holds[i] && G[i * n + i] > PT_SINGULAR && (k < 0 || G[i * n + i] > G[k * n + k])) k = i;
        if (k < 0) return unknown;
        a->holds[k] = 0;
        for (int i = 0; i < n; i++) {
            double share = i == k ? 0 : G[i * n + k] / G[k * n + k];
            if (share == 0) continue;
            for (int j = 0; j < n; j++) G[i * n + j] -= share * G[k * n + j];
            a->rate[i] -= share * a->rate[k];
            a->terms[i] += fabs(share) * a->terms[k];
        }
    }
}

/* Marks the laws at a limit that others hold at rest in the present modes: whether this changes any mark, or an error. */
static int marked(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p};
    double *wanted[] = {a->mobility, a->rate, a->size, a->calm};
    int some = a->flags[PT_IDLE] > 0, changed = 0, n = a->n->frictions;
    for (int k = 0; k < a->n->rests; k++) some |= a->m[a->of->rests[k]] != 0;
    if (!some) return 0;
    if (!a->f->mobility) return PT_ASK;
    CALL(a, a->f->mobility, given, wanted);
    double unknown = eliminate_what_holds(a);
    for (int k = 0, i = 0; k < a->n->rests; k++) {
        int place = a->of->rests[k], law = a->of->rest_laws[k];
        double left = 0, mode = fabs(a->m[law]);
        while (a->of->frictions[i] != law) i++;
        for (int j = 0; j < n; j++) left = fmax(left, fabs(a->mobility[i * n + j]));
        double known = PT_LEAST_TORQUE * a->size[i] + PT_NOTHING * a->terms[i] + unknown;
        int held = mode == 1 && a->calm[k] && left <= PT_NOTHING && fabs(a->rate[i]) <= known;
        changed |= a->m[place] != held;
        a->m[place] = held;
    }
    return changed;
}

/* The mode rules at the solution for the present modes, in which the laws that others hold are marked: whether there is one, or an error. */
static int judged(pt_model *a, double slack)
{
    int solved = solvable(a);
    apply_rules(a, slack);
    int changed = marked(a);
    if (changed <= 0) return changed ? changed : solved;
    solved = solvable(a);
    apply_rules(a, slack);
    return solved;
}

/* All laws by their rules from the same torques, until none changes: 1, or an error. Modes without a solution on the way are judged by the
   last one. With ``slack`` a law at rest may slide with a rate of zero, within what is known of it. */
static int newton(pt_model *a, double slack)
{
    int m = a->n->m;
    for (int pass = 0; pass < PT_PASSES; pass++) {
        int solved = judged(a, slack);
        if (solved < 0) return solved;
        if (!solved && (a->hosted || !a->flags[PT_CHANGES])) return PT_ALGEBRA;
        if (a->hosted && (a->flags[PT_EDGES] || a->flags[PT_CLOSING])) return PT_ASK;
        if (solved && a->flags[PT_CLOSING] && !a->flags[PT_JUMPS]) return PT_IMPACT;
        a->jumped[0] = 0;
        if (!a->flags[PT_CHANGES]) return 1;
        copy(a->seen + pass * m, a->m, m);
        for (int i = 0; i < pass; i++)
            if (same(a->seen + i * m, a->m, m)) return solved ? PT_MODES : PT_ALGEBRA;
        copy(a->m, a->held, m);
        a->jumped[0] = PT_JUMPED * a->flags[PT_JUMPS];
    }
    return PT_MODES;
}

/* Whether the present modes are consistent, or an error. */
static int consistent(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p, a->tolerance};
    double *wanted[] = {a->y[1 - a->side], a->reached[1 - a->side], a->first};
    int solved = judged(a, 1);
    if (solved <= 0 || a->flags[PT_CHANGES]) return fmin(solved, 0);
    CALL(a, a->f->fresh, given, wanted);
    return isfinite(a->first[1]) != 0;
}

/* One law at a time, the first that its rule would change: K. G. Murty, Note on a Bard-type scheme for solving the complementarity problem,
   Opsearch 11 (1974) 123. It ends where the torques of every law have their way with its own speed, which Newton's method need not. */
static int one_by_one(pt_model *a)
{
    const int *laws = a->of->laws;
    for (int tries = 0; tries < MOST_EXCHANGES; tries++) {
        int found = consistent(a), k = 0;
        if (found) return found;
        while (k < a->n->laws && a->m[laws[k]] == a->held[laws[k]]) k++;
        if (k == a->n->laws) return PT_MODES;
        a->m[laws[k]] = a->held[laws[k]];
        for (int i = 0; i < a->n->rests; i++)
            if (a->of->rest_laws[i] == laws[k]) a->m[a->of->rests[i]] = a->held[a->of->rests[i]];
    }
    return PT_MODES;
}

static int resolve(pt_model *a)
{
    int begins = a->jumped[0] == PT_START;
    a->reset = 0;
    for (int k = 0; k < a->n->whens; k++) a->which[k] = 0;
    for (int round = 0; round < ROUNDS; round++) {
        int found = newton(a, 0);
        if (found == PT_MODES && !a->hosted) found = one_by_one(a);
        if (found < 0) return found;
        int some = a->flags[PT_EDGES] ? apply_resets(a, begins) : 0; /* conditions are judged with consistent modes */
        if (some < 0) return some;
        if (some) {
            begins = 0;
            continue;
        }
        clear(a->fire, a->n->timed);
        return a->flags[PT_FORBIDDEN] > 0 ? PT_REFUSED : PT_OK;
    }
    return PT_RESETS;
}

/* Restart after a discontinuity: stuck speeds are zero, rates and indicators, a first step size. */

static int refresh(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p, a->tolerance};
    double *wanted[] = {a->y[1 - a->side], a->reached[1 - a->side], a->first};
    a->time[0] = a->t;
    CALL(a, a->f->fresh, given, wanted);
    a->side = 1 - a->side;
    return isfinite(a->first[1]) ? PT_OK : PT_RATES;
}

/* What has been stuck, with the held values before the event, is at rest, but for what a long step leaves. */
static void hold(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->before, a->p};
    double *wanted[] = {a->y[1 - a->side]};
    CALL(a, a->f->rest, given, wanted);
    a->side = 1 - a->side;
}

static int restart(pt_model *a)
{
    int status = refresh(a);
    a->h = fmin(a->first[0], a->max_step);
    return status;
}

void pt_keep_held(pt_model *a)
{
    copy(a->held_left, a->m, a->n->m);
    if (a->held_row) copy(a->held_row + a->n->m * a->helds, a->m, a->n->m);
    a->helds++;
}

void pt_choose(pt_model *a)
{
    const double *given[] = {&a->t, &a->stop, a->m, a->p};
    double *wanted[] = {&a->longest};
    a->longest = INFINITY;
    if (a->f->longest) CALL(a, a->f->longest, given, wanted);
    a->longest = fmin(a->longest, a->max_step);
}

static int turns(pt_model *a)
{
    const double *given[] = {a->time, a->y[a->side], a->m, a->p};
    double *wanted[] = {a->y[1 - a->side], a->reached[1 - a->side], a->corners};
    if (!a->f->corner) return 0;
    CALL(a, a->f->corner, given, wanted);
    if (a->corners[0] != 0 || !isfinite(a->corners[1])) return 0;
    a->side = 1 - a->side;
    a->idle = 0;
    pt_keep_held(a);
    return 1;
}

static void turn_over(pt_model *a)
{
    for (int k = 0; k < a->n->indicators; k++)
        if (a->g[k] <= 0) a->m[a->of->bends[k]] = 1 - a->m[a->of->bends[k]];
}

/* Go on past the point where expressions bend; 0 where more than their modes has to be resolved. */
static int bends(pt_model *a)
{
    int found = 0;
    for (int k = 0; k < a->n->indicators; k++) {
        if (a->g[k] > 0) continue;
        if (a->of->bends[k] < 0) return 0;
        found++;
    }
    if (!found) return 0;
    turn_over(a);
    if (turns(a)) {
        pt_choose(a);
        return 1;
    }
    turn_over(a);
    return 0;
}

/* Events inside a step: the Illinois method on the dense polynomial */

static double value_at(pt_model *a, double q)
{
    const double *given[] = {a->time, a->fraction, a->above, a->dense, a->m, a->p};
    double *wanted[] = {a->at, a->g, a->worst};
    *a->fraction = q;
    CALL(a, a->f->locate, given, wanted);
    return *a->worst;
}

static double between(pt_model *a, double low, double high, double at_low, double at_high, double aim)
{
    double before = low, at_before = at_low, beyond = high, at_beyond = at_high, weight_low = at_low, weight_high = at_high;
    double enough = PT_AIM;
    int side = 0, flat_above = 0, flat_below = 0;
    for (int i = 0; i < PT_ITERATIONS; i++) {
        double q;
        if (high - low < PT_CLOSE) enough = fmin(2 * enough, PT_LARGEST);
        if (high - low < PT_CLOSE && at_high >= -enough) break;
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

/* Take what is above zero at high into the search where it is below zero at the present place; how many these are. */
static int fallen(pt_model *a, double depth)
{
    int found = 0;
    for (int k = 0; k < a->n->indicators; k++)
        if (a->above[k] > 0 && a->lows[k] > 0 && a->g[k] + depth < -2 * PT_AIM) {
            a->above[k] = a->g[k] + depth;
            found++;
        }
    return found;
}

/* As between, and what is above zero at high counts where it is below at the place that is found, or midway: it fell before. */
static double first_of(pt_model *a, double low, double high, double at_low, double at_high, double depth)
{
    for (int k = 0; k < a->n->indicators; k++) a->lows[k] = a->g[k] + depth;
    for (;;) {
        high = between(a, low, high, at_low + PT_AIM, at_high + PT_AIM, depth + PT_AIM);
        if (!fallen(a, depth)) {
            double middle = 0.5 * (low + high);
            value_at(a, middle);
            if (!fallen(a, depth)) {
                value_at(a, high);
                return high;
            }
            high = middle;
        }
        at_low = at_high = HUGE_VAL;
        for (int k = 0; k < a->n->indicators; k++) {
            if (a->above[k] > 0) continue;
            at_low = fmin(at_low, a->lows[k]);
            at_high = fmin(at_high, a->g[k] + depth);
        }
    }
}

/* The fraction of the last step at which the first indicator is below zero; -1 for none on closer look. */
static double find(pt_model *a, double depth)
{
    static const double places[PLACES] = {0, 0.25, 0.5, 0.75, 1};
    int first = 1;
    while (a->info[PT_INFO + first - 1] + depth > 0)
        if (++first == PLACES) return -1;
    double low = places[first - 1], high = places[first];
    clear(a->above, a->n->indicators);
    double at_high = value_at(a, high) + depth;
    if (at_high > 0) return -1;
    if (at_high >= -2 * PT_AIM) return high;
    for (int k = 0; k < a->n->indicators; k++) a->above[k] = a->g[k] + depth;
    double at_low = value_at(a, low) + depth;
    return at_low <= 0 ? low : first_of(a, low, high, at_low, at_high, depth);
}

/* Steps */

static void sample(pt_model *a, double t, double h, double end, int last)
{
    int n = a->n->y;
    while (a->sampled < a->samples && (a->sample_times[a->sampled] < end || (last && a->sample_times[a->sampled] <= end))) {
        double q = (a->sample_times[a->sampled] - t) / h, *out = a->out + n * a->sampled++;
        for (int i = 0; i < n; i++) {
            const double *c = a->dense + i;
            out[i] = c[0] + q * (c[n] + q * (c[2 * n] + q * (c[3 * n] + q * c[4 * n])));
        }
    }
}

static void keep_step(pt_model *a, double t, double h)
{
    int n = a->n->y;
    if (a->row) {
        double *row = a->row + (3 + 5 * n) * a->rows;
        row[0] = (double)(a->helds - 1);
        row[1] = t;
        row[2] = h;
        copy(row + 3, a->dense, 5 * n);
    }
    a->rows++;
    a->steps++;
}

static int full(const pt_model *a)
{
    return (a->row && a->rows >= a->most_rows) || (a->held_row && a->helds + 2 >= a->most_held) ||
           (a->instant_row && a->kept + 1 >= a->most_instants);
}

/* A step in parts: what depends on held values and parameters alone when these change; the rest of a step only if its error is small. */
static void step_in_parts(pt_model *a)
{
    int from = a->side, to = 1 - from, n = a->n->m;
    if (!a->prepared_once || !same(a->prepared, a->m, n)) {
        const double *given[] = {a->m, a->p};
        call(a, a->f->constants, given, 2, a->constants, a->n->constants);
        copy(a->prepared, a->m, n);
        a->prepared_once = 1;
    }
    const double *given[] = {a->time, a->y[from], a->m, a->p, a->reached[from], a->tolerance};
    double *wanted[] = {a->y[to], a->dense, a->info, a->stiffness, a->points, a->outside};
    for (int i = 0; i < a->n->constants; i++) a->arg[6 + i] = a->constants[i];
    CALL(a, a->f->advance, given, wanted);
    if (!(a->info[0] <= 1)) return;
    const double *at[] = {a->points, a->m, a->p}, *surveyed[] = {a->reached[from], a->found}, *judged[] = {a->info, a->stiffness, a->least, a->found};
    double *sampled[] = {a->found}, *least[] = {a->least}, *verdict[] = {a->info, a->reached[to]};
    CALL(a, a->f->samples, at, sampled);
    CALL(a, a->f->survey, surveyed, least);
    CALL(a, a->f->verdict, judged, verdict);
}

static void take_step(pt_model *a)
{
    int from = a->side, to = 1 - from;
    const double *given[] = {a->time, a->y[from], a->m, a->p, a->reached[from], a->tolerance};
    double *wanted[] = {a->y[to], a->reached[to], a->info, a->dense, a->outside};
    if (a->f->method) CALL(a, a->f->method, given, wanted);
    else step_in_parts(a);
}

/* Move to the event inside the step just taken: 1, or 0 for none after all, or an error. */
static int located(pt_model *a, double t, double h)
{
    int n = a->idle < 20 ? a->idle : 20;
    double fraction = find(a, a->idle ? PT_EPS * ldexp(1, n) : 0);
    if (fraction < 0) return 0;
    a->side = 1 - a->side;
    copy(a->y[a->side], a->at, a->n->y);
    a->t = fraction == 1 && t + 1.01 * h >= a->target ? a->target : t + fraction * h;
    a->h = h;
    for (int k = 0; k < a->n->indicators; k++)
        if (a->of->guards[k] && a->g[k] <= 0) return PT_GUARD;
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

/* Whether enough steps were at the stability limit of the explicit method. */
static int too_stiff(pt_model *a)
{
    double ratio = a->info[4];
    if (a->explicit_method && (ratio > PT_STIFF || a->stiff > 0)) a->stiff += ratio > PT_STIFF ? 1 : -0.4;
    return a->explicit_method && a->stiff >= PT_STIFF_STEPS;
}

/* Step until an indicator falls below zero (1) or until the target (0), or as far as the records go or the method is good (2), or an error. */
static int smooth(pt_model *a)
{
    double h = fmin(a->h, a->longest), wanted = 0, finest = PT_FINEST * fmin(a->stop - a->start, a->longest);
    double refused_h = 0, refused_error = 0;
    int rejected = 0, halved = 0;
    for (;;) {
        double t = a->t;
        int last = a->fixed || t + 1.01 * h >= a->target;
        if (last) {
            wanted = h;
            h = a->target - t;
        }
        a->time[0] = t;
        a->time[1] = h;
        take_step(a);
        double error = a->info[0];
        if (a->fixed && !isfinite(error)) return PT_RATES;
        if (!a->fixed && !(error <= 1)) {
            a->rejected++;
            rejected = 1;
            double size = h;
            h *= reduction(h, error, refused_h, refused_error);
            refused_h = size;
            refused_error = error;
            a->h = h;
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
        int stiff = too_stiff(a);
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
        for (int k = 0; k < a->n->counted; k++) a->counts[k] += a->outside[k];
        if (last) return 0;
        if (stiff || full(a)) return 2;
    }
}

static void keep_instant(pt_model *a)
{
    int n = a->n->y, m = a->n->m;
    if (a->instant_row) {
        double *row = a->instant_row + (1 + 2 * n + 2 * m + a->n->whens) * a->kept;
        *row++ = a->t;
        copy(row, a->left, n);
        copy(row + n, a->y[a->side], n);
        copy(row + 2 * n, a->before, m);
        copy(row + 2 * n + m, a->m, m);
        for (int k = 0; k < a->n->whens; k++) row[2 * n + 2 * m + k] = a->which[k];
    }
    a->kept++;
    a->events++;
}

/* Whether only held values changed whose changes are no events. */
static int quiet(const pt_model *a)
{
    for (int i = 0; i < a->n->m; i++)
        if (a->before[i] != a->m[i] && !a->of->quiet[i]) return 0;
    return 1;
}

static int resume_after_event(pt_model *a, int found, int jumps, int changed)
{
    if (!jumps && !a->reset && quiet(a)) {
        a->idle = found && !changed ? a->idle + 1 : 0;
        return a->idle > PT_MOST_IDLE ? PT_EVENTS : refresh(a);
    }
    a->idle = 0;
    int status = restart(a);
    if (!status) keep_instant(a);
    return status;
}

/* Leave the event as it was found. */
static int ask(pt_model *a, double crossed)
{
    copy(a->m, a->before, a->n->m);
    copy(a->y[a->side], a->left, a->n->y);
    a->crossed = crossed;
    return PT_ASK;
}

static int event(pt_model *a, int found)
{
    double near = just_after(a->t), crossed = a->crossed;
    int known = a->instant <= near, timed = known || a->corner <= near;
    if (!found && !timed) return PT_OK;
    if (a->every_event) return PT_ASK;
    a->time[0] = a->t;
    a->time[1] = 0;
    if (!timed && bends(a)) return PT_OK;
    copy(a->before, a->held_left, a->n->m);
    copy(a->left, a->y[a->side], a->n->y);
    int jumps = a->corner <= near && cross(a, a->crossed, near);
    a->crossed = near;
    if (known) fire(a);
    else if (!found && !jumps && turns(a)) return PT_OK;
    if (a->every_mode) return ask(a, crossed);
    hold(a);
    a->jumped[0] = jumps ? PT_JUMPED : 0;
    int status = resolve(a);
    if (a->hosted && status) return ask(a, crossed);
    if (status) return status;
    int changed = differ(a->before, a->m, a->n->m);
    if (a->every_idle && found && !changed) return ask(a, crossed);
    if (changed) {
        pt_keep_held(a);
        pt_choose(a);
    }
    return resume_after_event(a, found, jumps, changed);
}

int pt_begin(pt_model *a)
{
    int status = PT_OK;
    a->time[0] = a->t;
    if (a->changed) {
        if (a->begun) {
            copy(a->before, a->held_left, a->n->m);
            hold(a);
        }
        a->jumped[0] = a->begun ? PT_JUMPED : PT_START;
        clear(a->fire, a->n->timed);
        status = resolve(a);
    }
    if (!status) status = restart(a);
    pt_keep_held(a);
    a->begun = 1;
    a->changed = 0;
    a->crossed = a->t;
    return status;
}

int pt_continue(pt_model *a)
{
    int events = 0;
    a->prepared_once = 0;
    while (a->t < a->stop) {
        if (full(a)) return PT_FULL;
        if (a->explicit_method && a->stiff >= PT_STIFF_STEPS) return PT_TOO_STIFF;
        a->instant = next_instant(a);
        a->corner = following(a, a->t);
        a->target = fmin(fmin(a->instant, a->corner), a->stop);
        a->located = smooth(a);
        if (a->located == 2) continue;
        int status = a->located < 0 ? a->located : event(a, a->located);
        if (status) return status;
        if (a->fixed && a->located && ++events > PT_MOST_IDLE) return PT_EVENTS;
    }
    return PT_OK;
}
