/* CoupledClutches written by hand: Dormand-Prince 5(4) with dense output, all modes resolved together at events.
   CHECKS=1 looks at the event indicators at 1/4, 1/2 and 3/4 of every step besides its end. */
#include <math.h>
#include <string.h>

#define N 8 /* phi1, w1, then relative angle and speed of each clutch */
#define K 3 /* clutches */
#define G (3 * K)
#define EPS 1e-10
#define ZONE 2e-10

typedef struct {
    double J[4], amplitude, frequency, press, slow, phase, t2, t3, fn_max[K], mue, peak;
} Parameters;

typedef struct {
    int clutch[K];
    double pressed[K]; /* 1 once the step of clutch 2 or 3 has come */
} Modes;

static void limits(double t, const Modes *m, const Parameters *p, double *limit)
{
    limit[0] = p->mue * p->fn_max[0] * p->press * sin(2 * M_PI * p->slow * t + p->phase);
    limit[1] = p->mue * p->fn_max[1] * m->pressed[1];
    limit[2] = p->mue * p->fn_max[2] * m->pressed[2];
}

/* Torques of the clutches and accelerations: the torques of stuck clutches solve a tridiagonal system. */
static void motion(double t, const Modes *m, const Parameters *p, double *tau, double *a, double *limit)
{
    double drive = p->amplitude * sin(2 * M_PI * p->frequency * t);
    double diagonal[K], right[K], upper[K];
    limits(t, m, p, limit);
    for (int k = 0; k < K; k++)
        tau[k] = m->clutch[k] == 1 ? limit[k] : m->clutch[k] == -1 ? -limit[k] : 0;
    for (int k = 0; k < K; k++) {
        int stuck = m->clutch[k] == 0;
        double lower = 0;
        diagonal[k] = 1;
        right[k] = tau[k];
        upper[k] = 0;
        if (stuck) {
            diagonal[k] = 1 / p->J[k] + 1 / p->J[k + 1];
            right[k] = k == 0 ? -drive / p->J[0] : 0;
            lower = k > 0 ? -1 / p->J[k] : 0;
            upper[k] = k < K - 1 ? -1 / p->J[k + 1] : 0;
        }
        if (k > 0 && lower != 0) {
            double w = lower / diagonal[k - 1];
            diagonal[k] -= w * upper[k - 1];
            right[k] -= w * right[k - 1];
        }
    }
    for (int k = K - 1; k >= 0; k--)
        tau[k] = (right[k] - (k < K - 1 ? upper[k] * tau[k + 1] : 0)) / diagonal[k];
    a[0] = (drive + tau[0]) / p->J[0];
    a[1] = (tau[1] - tau[0]) / p->J[1];
    a[2] = (tau[2] - tau[1]) / p->J[2];
    a[3] = -tau[2] / p->J[3];
}

static void rates(double t, const double *x, const Modes *m, const Parameters *p, double *f)
{
    double tau[K], a[4], limit[K];
    motion(t, m, p, tau, a, limit);
    f[0] = x[1];
    f[1] = a[0];
    for (int k = 0; k < K; k++) {
        f[2 + 2 * k] = x[3 + 2 * k];
        f[3 + 2 * k] = a[k + 1] - a[k];
    }
}

/* Positive while the mode stays valid. */
static double indicators(double t, const double *x, const Modes *m, const Parameters *p, double *g)
{
    double tau[K], a[4], limit[K], least = 1e300;
    motion(t, m, p, tau, a, limit);
    for (int k = 0; k < K; k++) {
        int mode = m->clutch[k];
        double w = x[3 + 2 * k];
        g[3 * k] = mode == 0 ? p->peak * limit[k] - tau[k] + EPS : mode == 2 ? 1 : mode * w + EPS;
        g[3 * k + 1] = mode == 0 ? p->peak * limit[k] + tau[k] + EPS : 1;
        g[3 * k + 2] = mode == 2 ? EPS - limit[k] : limit[k] + EPS;
    }
    for (int i = 0; i < G; i++)
        if (g[i] < least) least = g[i];
    return least;
}

/* The modes of all clutches, updated together until none changes. */
static int resolve(double t, double *x, Modes *m, const Parameters *p)
{
    for (int pass = 0; pass < 20; pass++) {
        double tau[K], a[4], limit[K];
        int changed = 0;
        motion(t, m, p, tau, a, limit);
        for (int k = 0; k < K; k++) {
            int old = m->clutch[k], now;
            double w = x[3 + 2 * k], rate = a[k + 1] - a[k], slack = 0.5 * EPS;
            if (old == 2 ? limit[k] <= 0.5 * EPS : limit[k] <= -0.5 * EPS)
                now = 2;
            else if (fabs(w) > ZONE && old != 0)
                now = w > 0 ? 1 : -1;
            else if (old == 0)
                now = tau[k] > p->peak * limit[k] + slack ? 1 : tau[k] < -p->peak * limit[k] - slack ? -1 : 0;
            else
                now = old == 1 && rate > 0 ? 1 : old == -1 && rate < 0 ? -1 : 0;
            if (now != old) {
                m->clutch[k] = now;
                changed = 1;
            }
        }
        if (!changed) {
            for (int k = 0; k < K; k++)
                if (m->clutch[k] == 0) x[3 + 2 * k] = 0;
            return 0;
        }
    }
    return -1;
}

static void dense_at(double q, double c[5][N], double *y)
{
    for (int i = 0; i < N; i++)
        y[i] = c[0][i] + q * (c[1][i] + (1 - q) * (c[2][i] + q * (c[3][i] + (1 - q) * c[4][i])));
}

static double first_step(double t, const double *x, const double *k1, const Modes *m, const Parameters *p, double rtol,
                         double atol)
{
    double size = 0, speed = 0, bend = 0, ahead[N], f[N];
    for (int i = 0; i < N; i++) {
        double s = atol + rtol * fabs(x[i]);
        size += x[i] / s * x[i] / s;
        speed += k1[i] / s * k1[i] / s;
    }
    size = sqrt(size / N);
    speed = sqrt(speed / N);
    double h = size < 1e-5 || speed < 1e-5 ? 1e-6 : 0.01 * size / speed;
    for (int i = 0; i < N; i++) ahead[i] = x[i] + h * k1[i];
    rates(t + h, ahead, m, p, f);
    for (int i = 0; i < N; i++) {
        double e = (f[i] - k1[i]) / (atol + rtol * fabs(x[i]));
        bend += e * e;
    }
    double most = fmax(speed, sqrt(bend / N) / h);
    return fmin(100 * h, most <= 1e-15 ? fmax(1e-6, h * 1e-3) : pow(0.01 / most, 0.2));
}

/* One step from x with slope k1: end, its slope, dense output; returns the error norm. */
static double step(double t, double h, const double *x, const double *k1, const Modes *m, const Parameters *p, double rtol,
                   double atol, double *end, double *k7, double c[5][N])
{
    static const double A[6][6] = {
        {1. / 5},
        {3. / 40, 9. / 40},
        {44. / 45, -56. / 15, 32. / 9},
        {19372. / 6561, -25360. / 2187, 64448. / 6561, -212. / 729},
        {9017. / 3168, -355. / 33, 46732. / 5247, 49. / 176, -5103. / 18656},
        {35. / 384, 0, 500. / 1113, 125. / 192, -2187. / 6784, 11. / 84}};
    static const double node[6] = {0.2, 0.3, 0.8, 8. / 9, 1, 1};
    static const double E[7] = {71. / 57600, 0, -71. / 16695, 71. / 1920, -17253. / 339200, 22. / 525, -1. / 40};
    static const double D[7] = {-12715105075. / 11282082432., 0, 87487479700. / 32700410799., -10690763975. / 1880347072.,
                                701980252875. / 199316789632., -1453857185. / 822651844., 69997945. / 29380423.};
    double k[7][N], error = 0;
    memcpy(k[0], k1, sizeof k[0]);
    for (int s = 0; s < 6; s++) {
        for (int i = 0; i < N; i++) {
            double sum = 0;
            for (int j = 0; j <= s; j++) sum += A[s][j] * k[j][i];
            end[i] = x[i] + h * sum;
        }
        rates(t + node[s] * h, end, m, p, k[s + 1]);
    }
    memcpy(k7, k[6], sizeof k[6]);
    for (int i = 0; i < N; i++) {
        double e = 0, d = 0, rise = end[i] - x[i], scale = atol + rtol * fmax(fabs(x[i]), fabs(end[i]));
        for (int j = 0; j < 7; j++) {
            e += E[j] * k[j][i];
            d += D[j] * k[j][i];
        }
        error += (h * e / scale) * (h * e / scale);
        c[0][i] = x[i];
        c[1][i] = rise;
        c[2][i] = h * k1[i] - rise;
        c[3][i] = rise - h * k7[i] - c[2][i];
        c[4][i] = h * d;
    }
    return sqrt(error / N);
}

/* The fraction of the step at which the least indicator falls below zero, between low (positive) and high. */
static double locate(double t, double h, double c[5][N], double low, double high, const Modes *m, const Parameters *p)
{
    double y[N], g[G], at_low, at_high;
    int side = 0;
    dense_at(high, c, y);
    at_high = indicators(t + high * h, y, m, p, g);
    dense_at(low, c, y);
    at_low = indicators(t + low * h, y, m, p, g);
    for (int n = 0; n < 150 && at_high < -2e-11; n++) {
        double q = low + (high - low) * at_low / (at_low - at_high);
        if (!(q > low && q < high) || (n > 8 && n % 2)) q = 0.5 * (low + high);
        if (!(q > low && q < high)) break;
        dense_at(q, c, y);
        double value = indicators(t + q * h, y, m, p, g);
        if (value > 0) {
            low = q;
            at_low = value;
            if (side == 1) at_high *= 0.5;
            side = 1;
        } else {
            high = q;
            at_high = value;
            if (value >= -2e-11) break;
            if (side == 2) at_low *= 0.5;
            side = 2;
        }
    }
    return high;
}

/* Runs to stop; out gets a row per time of grid. Returns the number of events, or a negative number. */
int run(const Parameters *p, const double *x0, const int *modes, double stop, double rtol, double atol, const double *grid,
        int points, double *out, double *when, long *steps)
{
    static const double check[4] = {0.25, 0.5, 0.75, 1};
    double x[N], y[N], k1[N], k7[N], c[5][N], g[G], t = 0, h = 0;
    Modes m = {{modes[0], modes[1], modes[2]}, {1, 0, 0}};
    int fresh = 1, rejected = 0, events = 0, row = 0;
    memcpy(x, x0, sizeof x);
    steps[0] = steps[1] = 0;
    if (resolve(0, x, &m, p)) return -1;
    while (t < stop) {
        double target = t < p->t2 ? p->t2 : t < p->t3 ? p->t3 : stop;
        if (fresh) {
            rates(t, x, &m, p, k1);
            h = first_step(t, x, k1, &m, p, rtol, atol);
            fresh = 0;
        }
        int last = t + 1.01 * h >= target;
        if (last) h = target - t;
        double e = step(t, h, x, k1, &m, p, rtol, atol, y, k7, c);
        if (!(e <= 1)) {
            h *= e == e ? fmax(0.2, 0.9 * pow(e, -0.2)) : 0.1;
            rejected = 1;
            steps[1]++;
            if (h < 1e-15) return -2;
            continue;
        }
        steps[0]++;
        if (e < 1e-10) e = 1e-10;
        double factor = fmin(5, fmax(0.2, 0.9 * pow(e, -0.2)));
        if (rejected) factor = fmin(factor, 1);
        rejected = 0;
        double end = last ? target : t + h, fraction = 1;
        int event = 0, first = CHECKS ? 0 : 3;
        for (int j = first; j < 4 && !event; j++) {
            double inside[N];
            dense_at(check[j], c, inside);
            if (indicators(t + check[j] * h, check[j] == 1 ? y : inside, &m, p, g) <= 0) {
                event = 1;
                fraction = locate(t, h, c, j > first ? check[j - 1] : 0, check[j], &m, p);
                end = t + fraction * h;
                dense_at(fraction, c, y);
            }
        }
        while (row < points && grid[row] <= end) {
            dense_at((grid[row] - t) / h, c, out + (long)row * N);
            row++;
        }
        memcpy(x, y, sizeof x);
        t = end;
        h *= factor;
        memcpy(k1, k7, sizeof k1);
        if (!event && t == p->t2) m.pressed[1] = event = 1;
        if (!event && t == p->t3) m.pressed[2] = event = 1;
        if (event) {
            if (resolve(t, x, &m, p)) return -1;
            if (events < 100) when[events] = t;
            events++;
            fresh = 1;
        }
    }
    return events;
}
