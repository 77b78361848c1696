/* The loop around generated Rodas5P steps: floor_step(time[2], x, p, tolerance[2]) -> x, error norm, dense output. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define casadi_int long long int
extern int floor_step(const double **, double **, casadi_int *, double *, int);
extern int floor_step_work(casadi_int *, casadi_int *, casadi_int *, casadi_int *);

/* Returns the number of steps, or a negative number. out gets a row per time of grid. */
int run(int n, const double *x0, const double *p, const double *grid, double *out, int points, double stop, double rtol,
        double atol)
{
    casadi_int arguments, results, integers, reals;
    floor_step_work(&arguments, &results, &integers, &reals);
    const double **arg = malloc(sizeof(double *) * arguments);
    double **res = malloc(sizeof(double *) * results);
    casadi_int *iw = malloc(sizeof(casadi_int) * (integers + 1));
    double *w = malloc(sizeof(double) * (reals + 1));
    double *x = malloc(sizeof(double) * n), *y = malloc(sizeof(double) * n), *c = malloc(sizeof(double) * 5 * n);
    double time[2] = {0, 1e-6}, tolerance[2] = {rtol, atol}, e;
    int steps = 0, rejected = 0, row = 0;
    memcpy(x, x0, sizeof(double) * n);
    while (time[0] < stop) {
        int last = time[0] + 1.01 * time[1] >= stop;
        if (last) time[1] = stop - time[0];
        arg[0] = time, arg[1] = x, arg[2] = p, arg[3] = tolerance;
        res[0] = y, res[1] = &e, res[2] = c;
        floor_step(arg, res, iw, w, 0);
        if (!(e <= 1)) {
            time[1] *= e == e ? fmax(0.2, 0.9 * pow(e, -0.2)) : 0.1;
            rejected = 1;
            if (time[1] < 1e-14) return -1;
            continue;
        }
        steps++;
        if (e < 1e-10) e = 1e-10;
        double factor = fmin(5, fmax(0.2, 0.9 * pow(e, -0.2)));
        if (rejected) factor = fmin(factor, 1);
        rejected = 0;
        double end = last ? stop : time[0] + time[1];
        for (; row < points && grid[row] <= end; row++) {
            double q = (grid[row] - time[0]) / time[1], *o = out + (long)row * n;
            for (int i = 0; i < n; i++)
                o[i] = c[i] + q * (c[n + i] + q * (c[2 * n + i] + q * (c[3 * n + i] + q * c[4 * n + i])));
        }
        memcpy(x, y, sizeof(double) * n);
        time[0] = end;
        time[1] *= factor;
    }
    free(arg), free(res), free(iw), free(w), free(x), free(y), free(c);
    return steps;
}
