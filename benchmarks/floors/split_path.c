/* The split-path transmission "bHa" (output on a, variable unit at the carrier) by Yu & Beachley's formulas, point by point. */

void split_path(long rows, long columns, const double *ratio, const double *load, double R_o, double eta, double eta_v,
                double *V, double *efficiency, double *K, double *torque) {
    const double R = R_o, in = 1 / eta, in_v = 1 / eta_v;
    for (long i = 0; i < rows; i++) {
        const double r = ratio[i];
        for (long j = 0; j < columns; j++) {
            const double T_a = load[j];
            const double v = (r - R) / (1 - R);
            const double c = T_a * (r - v) > 0 ? eta : in;
            const double T_b = -R_o * c * T_a;
            const double P_2 = (-T_a - T_b) * v;
            const double unit = P_2 > 0 ? P_2 * in_v : P_2 * eta_v;
            const double T_1 = T_b + unit;
            const long k = i * columns + j;
            V[k] = v;
            efficiency[k] = T_1 >= 0 ? -T_a * r / T_1 : -T_1 / (T_a * r);
            K[k] = (P_2 > 0 ? unit : P_2) / T_1;
            torque[k] = T_1;
        }
    }
}
