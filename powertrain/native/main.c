/* Runs the model and prints its unknowns: ./model STOP [ROWS [STEP]]. With a STEP (s) it is advanced in fixed steps. */
#include <stdio.h>
#include <stdlib.h>

#include "model.h"

int main(int count, char **words)
{
    double stop = count > 1 ? atof(words[1]) : 1, step = count > 3 ? atof(words[3]) : 0;
    long rows = count > 2 ? atol(words[2]) : 10;
    pt_model *model = pt_instance();
    int status = PT_OK;
    pt_start(model);
    printf("time");
    for (int k = 0; pt_unknown_names[k]; k++) printf(",%s", pt_unknown_names[k]);
    double start = pt_time(model);
    for (long i = 0; i <= rows; i++) {
        double t = start + (stop - start) * (double)i / (double)rows;
        while (!status && step > 0 && pt_time(model) < t - 1e-9 * step) status = pt_step(model, step);
        if (!status && step <= 0) status = pt_run(model, t);
        if (status) {
            fprintf(stderr, "at %.9g s: %s\n", pt_time(model), pt_message(status));
            break;
        }
        printf("\n%.17g", pt_time(model));
        for (int k = 0; pt_unknown_names[k]; k++) printf(",%.17g", pt_unknowns(model)[k]);
    }
    printf("\n");
    return status != PT_OK;
}
