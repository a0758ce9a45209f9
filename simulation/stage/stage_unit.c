/* The planetary stage in its modes: q'' + D q' + OMEGA_2 q = P^T a(u, theta) + B^T f(delta, delta', theta).
 *
 * A step of length h is the implicit midpoint rule with discrete gradients of the contact laws, as in
 * simulation/stage/response.py, whose names stand here: delta = B q - FREE is the motion of the channels, s its rate
 * over the step, f their forces beyond the linear part. Channels: carrier angle, flanks, turning supports, bearings
 * with clearance (2 each), roller bearings (4), splines of the sun (3). */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "model_data.h"
#include "unit.h"

enum {
    FLANKS = 1,
    TURNING = FLANKS + N_FLANKS,
    LOOSE = TURNING + N_TURNING,
    ROLLING = LOOSE + 2 * N_LOOSE,
    SPLINE = ROLLING + 4 * N_ROLLING,
    HOUSING_CHANNELS = 6,
    MOST_ITERATIONS = 60,
    HALVED_FROM = 16
};
#define MOST_STEPS 1e6
#define STILL 1e-13 /* Motions over a step [m] below this count as none. */
#define CONVERGED 1e-12 /* Error of the channels' motion over a step [m]. */
#define CONVERGED_NEWTON 1e-9
#define ROUNDING 1e-11
#define RUN_AWAY 1e3
#define SLOW_TURN 1e-5 /* Turn of a step [rad] below which rollers give no energy back. */
#define GENTLE 1e-3    /* Work of the rollers in a step over their energy up to which none is missing. */

struct Work { double h, A_inverse[N_M][N_M], answer[N_CH][N_M], W[N_CH][N_CH]; };
/* Memory of the solver: channel forces of the last two steps, length of the last, energy [J] that the rollers have taken
 * too little. States are q, then v = q'. */
typedef struct { double force[N_CH], before[N_CH], h, missing; } Memory;

Work *model_work(void) { return calloc(1, sizeof(Work)); }
void model_free(Work *work) { free(work); }

/* Inverse of 2/h + D + h/2 OMEGA_2; rows grow with OMEGA_2 and are scaled first. */
static int prepare(Work *work, double h) {
    double *a = malloc(sizeof(double) * N_M * N_M), scale[N_M];
    int i, j, k, done;
    if (!a) return 0;
    for (i = 0; i < N_M; ++i) scale[i] = 1.0 / sqrt(2.0 / h + 0.5 * h * OMEGA_2[i] + D[i][i]);
    for (i = 0; i < N_M; ++i)
        for (j = 0; j < N_M; ++j) {
            a[i * N_M + j] = (D[i][j] + (i == j ? 2.0 / h + 0.5 * h * OMEGA_2[i] : 0.0)) * scale[i] * scale[j];
            work->A_inverse[i][j] = i == j;
        }
    done = solved(N_M, a, &work->A_inverse[0][0], N_M);
    free(a);
    for (i = 0; i < N_M; ++i)
        for (j = 0; j < N_M; ++j) work->A_inverse[i][j] *= scale[i] * scale[j];
    for (i = 0; i < N_CH; ++i)
        for (j = 0; j < N_M; ++j)
            for (work->answer[i][j] = 0.0, k = 0; k < N_M; ++k) work->answer[i][j] += work->A_inverse[j][k] * B[i][k];
    for (i = 0; i < N_CH; ++i)
        for (j = 0; j < N_CH; ++j)
            for (work->W[i][j] = 0.0, k = 0; k < N_M; ++k) work->W[i][j] += B[i][k] * work->answer[j][k];
    work->h = done ? h : 0.0;
    return done;
}

static double dot(const double a[], const double b[], int n) {
    double sum = 0.0;
    int i;
    for (i = 0; i < n; ++i) sum += a[i] * b[i];
    return sum;
}

/* Stiffness of the meshes at a mesh angle, or its derivative of an order. */
static void mesh_stiffness_at(double angle, int order, double k[N_MESHES]) {
    int j, h;
    for (j = 0; j < N_MESHES; ++j) k[j] = order ? 0.0 : REAL[j][0];
    for (h = 1; h < N_HARMONICS; ++h) {
        double phase = h * angle + order * acos(0.0), size = pow(h, order);
        double c = size * cos(phase), s = size * sin(phase);
        for (j = 0; j < N_MESHES; ++j) k[j] += REAL[j][h] * c - IMAG[j][h] * s;
    }
}

/* Mean of max(d, 0) from old to new, and its derivative by new. */
static double penetration_gradient(double before, double after, double *slope) {
    double a = fmax(before, 0.0), b = fmax(after, 0.0), mean;
    if ((before >= 0.0 && after >= 0.0) || (before <= 0.0 && after <= 0.0)) {
        *slope = before >= 0.0 && after >= 0.0 ? 0.5 : 0.0;
        return 0.5 * (a + b);
    }
    mean = 0.5 * (b * b - a * a) / (after - before);
    *slope = (b - mean) / (after - before);
    return mean;
}

static double play_force(double y, double z, double clearance, double *fy, double *fz) {
    double r = sqrt(y * y + z * z), share;
    *fy = *fz = 0.0;
    if (r <= clearance) return 0.0;
    share = 1.0 - clearance / r;
    *fy = share * y;
    *fz = share * z;
    return 0.5 * (r - clearance) * (r - clearance);
}

/* Discrete gradient of a radial contact per stiffness: f along y and z, then yy, yz, zy, zz by the new place. */
static void play_gradient(double oy, double oz, double ny, double nz, double clearance, double out[6]) {
    double y = 0.5 * (oy + ny), z = 0.5 * (oz + nz), r = sqrt(y * y + z * z), share = r > clearance ? clearance / r : 0.0;
    double my, mz, ey, ez, ignored_y, ignored_z, old_energy, new_energy, yy = 0.0, yz = 0.0, zz = 0.0;
    double dy = ny - oy, dz = nz - oz, square = dy * dy + dz * dz, rest, by_y, by_z;
    play_force(y, z, clearance, &my, &mz);
    if (r > clearance) {
        yy = 0.5 * (1.0 - share * z * z / (r * r));
        yz = 0.5 * share * y * z / (r * r);
        zz = 0.5 * (1.0 - share * y * y / (r * r));
    }
    old_energy = play_force(oy, oz, clearance, &ignored_y, &ignored_z);
    new_energy = play_force(ny, nz, clearance, &ey, &ez);
    if (square < STILL * STILL) {
        out[0] = my; out[1] = mz; out[2] = yy; out[3] = yz; out[4] = yz; out[5] = zz;
        return;
    }
    rest = (new_energy - old_energy - my * dy - mz * dz) / square;
    by_y = (ey - my - yy * dy - yz * dz - 2.0 * rest * dy) / square;
    by_z = (ez - mz - yz * dy - zz * dz - 2.0 * rest * dz) / square;
    out[0] = my + rest * dy;
    out[1] = mz + rest * dz;
    out[2] = yy + rest + dy * by_y;
    out[3] = yz + dy * by_z;
    out[4] = yz + dz * by_y;
    out[5] = zz + rest + dz * by_z;
}

/* Force that resists the offset of a turning sun: fy, fz, yy, yz, zy, zz, and both by the friction's limit. */
static void spline_force(double y, double z, double k, double clearance, double limit, double out[8]) {
    double r = sqrt(y * y + z * z), E = 0.0, P_ = 1.0, E_r = 0.0, P_r = 0.0, by_limit = 0.0;
    double along, across, along_r, across_r, along_L, across_L, gy, gz;
    if (r < STILL) {
        double still[8] = {k * y, k * z, k, 0.0, 0.0, k, 0.0, 0.0};
        memcpy(out, still, sizeof still);
        return;
    }
    if (limit > STILL * k) {
        double rho = r * k / limit, w = sqrt(1.0 + 4.0 * rho * rho * rho * rho);
        E = sqrt(2.0 / (1.0 + w));
        P_ = rho * rho * E * E;
        E_r = -4.0 * rho * rho * rho * E / (w * (1.0 + w)) * k / limit;
        P_r = 2.0 * P_ / r + 2.0 * rho * rho * E * E_r;
        by_limit = -r / limit;
    }
    if (P_ * r <= clearance) {
        along = 1.0 - P_ * P_, across = -P_ * E;
        along_r = -2.0 * P_ * P_r, across_r = -P_r * E - P_ * E_r;
        along_L = along_r * by_limit, across_L = across_r * by_limit;
    } else {
        double share = clearance / r;
        along = 1.0 - share * P_, across = -share * E;
        along_L = -share * P_r * by_limit, across_L = -share * E_r * by_limit;
        along_r = share * (P_ / r - P_r), across_r = share * (E / r - E_r);
    }
    gy = k * (along_r * y - across_r * z) / r, gz = k * (along_r * z + across_r * y) / r;
    out[0] = k * (along * y - across * z);
    out[1] = k * (along * z + across * y);
    out[2] = k * along + gy * y;
    out[3] = -k * across + gy * z;
    out[4] = k * across + gz * y;
    out[5] = k * along + gz * z;
    out[6] = k * (along_L * y - across_L * z);
    out[7] = k * (along_L * z + across_L * y);
}

/* Energy of bearing b; with `force` also its gradient and tangent by the motion and, fifth, the carrier angle. */
static double roller_load(int b, const double motion[4], double angle, double force[5], double tangent[5][5]) {
    double y = motion[0], z = motion[1], ry = motion[2], rz = motion[3], energy = 0.0;
    double turn_c = cos(CAGE * angle), turn_s = sin(CAGE * angle);
    int roller, i, j;
    if (force) {
        memset(force, 0, 5 * sizeof *force);
        memset(tangent, 0, 5 * sizeof *tangent);
    }
    for (roller = 0; roller < N_ROLLERS; ++roller) {
        double c0 = DIRECTIONS[b][roller][0], s0 = DIRECTIONS[b][roller][1];
        double s = s0 * turn_c + c0 * turn_s, c = c0 * turn_c - s0 * turn_s;
        double middle = s * y - c * z, slope = s * rz + c * ry, Q = 0.0, M = 0.0, k = 0.0, kx = 0.0, kxx = 0.0;
        for (j = 0; j < N_SLICES; ++j) {
            double x = SLICE_X[j], delta = middle + slope * x - SLICE_GAP[j], secant;
            if (!(delta > 0.0)) continue;
            secant = SLICE_STIFFNESS[b][j] * pow(delta, 1.0 / 9.0);
            energy += secant * delta * delta;
            Q += secant * delta;
            M += secant * delta * x;
            k += secant;
            kx += secant * x;
            kxx += secant * x * x;
        }
        if (!force || Q == 0.0) continue;
        {
            double by[4] = {Q * c, Q * s, -M * s, M * c}; /* Of the force, by the turn of the cage. */
            double d[5] = {s, -c, 0.0, 0.0, CAGE * (c * y + s * z)}; /* d delta = d + x t */
            double t[5] = {0.0, 0.0, c, s, CAGE * (c * rz - s * ry)};
            for (i = 0; i < 5; ++i) {
                force[i] += Q * d[i] + M * t[i];
                for (j = 0; j < 5; ++j)
                    tangent[i][j] += (k * d[i] * d[j] + kx * (d[i] * t[j] + t[i] * d[j]) + kxx * t[i] * t[j]) * (10.0 / 9.0);
            }
            for (i = 0; i < 4; ++i) {
                tangent[i][4] += CAGE * by[i];
                tangent[4][i] += CAGE * by[i];
            }
            tangent[4][4] -= CAGE * CAGE * (Q * middle + M * slope);
        }
    }
    return 9.0 / 19.0 * energy;
}

/* Pairs of y and z among the turning channels: housing's translation and rotation, then each bearing. */
static int y_of_pair(int pair) { return pair == 0 ? 1 : pair == 1 ? 4 : HOUSING_CHANNELS + 2 * (pair - 2); }

/* R^T fixed R with R from the carrier's frame into the fixed one. */
static void turned(const double fixed[N_TURNING][N_TURNING], double angle, double out[N_TURNING][N_TURNING]) {
    double c = cos(angle), s = sin(angle);
    int pair, i;
    memcpy(out, fixed, sizeof(double) * N_TURNING * N_TURNING);
    for (pair = 0; pair < N_TURNING / 2 - 1; ++pair) {
        int y = y_of_pair(pair), z = y + 1;
        for (i = 0; i < N_TURNING; ++i) {
            double a = out[y][i], b = out[z][i];
            out[y][i] = c * a + s * b, out[z][i] = c * b - s * a;
        }
        for (i = 0; i < N_TURNING; ++i) {
            double a = out[i][y], b = out[i][z];
            out[i][y] = c * a + s * b, out[i][z] = c * b - s * a;
        }
    }
}

/* Rates s of the channels over a step and their forces, by Newton's method; 0 where there is no balance. The rollers
 * take given_back [N m] from the drive more. */
static int solve_channels(const Work *work, const double s_free[], const double delta[], double given_back,
                          double force[], double s[]) {
    double K[N_TURNING][N_TURNING], C[N_TURNING][N_TURNING], K_0[N_TURNING][N_TURNING];
    double old_k[N_MESHES], mid_k[N_MESHES], new_k[N_MESHES];
    static const int blocks[5][2] = {{1, N_FLANKS}, {N_TURNING, 1}, {2, N_LOOSE}, {4, N_ROLLING}, {3, N_SPLINES}};
    double h = work->h, angle = delta[0], largest = 0.0, rounding;
    int i, j, k, iteration;
    turned(K_FIXED, angle + 0.5 * h * s_free[0], K);
    turned(C_FIXED, angle + 0.5 * h * s_free[0], C);
    for (i = 0; i < N_TURNING; ++i) {
        double seen[N_TURNING] = {0};
        for (k = 0; k < N_TURNING / 2 - 1; ++k) { /* The fixed frame's velocity from the carrier's: x' + Omega J x. */
            int y = y_of_pair(k);
            seen[y] += SPEED * C[i][y + 1];
            seen[y + 1] -= SPEED * C[i][y];
        }
        for (j = 0; j < N_TURNING; ++j) {
            K[i][j] += seen[j] - K_MEAN[i][j];
            K_0[i][j] = 0.5 * h * K[i][j] + C[i][j] - C_MEAN[i][j]; /* Of the rates. */
        }
    }
    mesh_stiffness_at(MESH_TEETH * angle, 0, old_k);
    for (i = 0; i < N_CH; ++i) {
        s[i] = s_free[i] + dot(work->W[i], force, N_CH);
        largest = fmax(largest, fabs(s[i]));
    }
    rounding = ROUNDING * h * largest;
    for (iteration = 0; iteration < MOST_ITERATIONS; ++iteration) {
        double tangent[N_CH][N_CH], matrix[N_CH][N_CH], change[N_CH], power = 0.0, by_twist;
        int first = FLANKS, kind, block;
        memset(tangent, 0, sizeof tangent);
        mesh_stiffness_at(MESH_TEETH * (angle + 0.5 * h * s[0]), 0, mid_k);
        mesh_stiffness_at(MESH_TEETH * (angle + h * s[0]), 0, new_k);
        for (j = 0; j < N_FLANKS; ++j) {
            int mesh = j % N_MESHES, at = FLANKS + j;
            double stiffness = SHARES[j] * mid_k[mesh], before = delta[at] - GAPS[j], after = before + h * s[at];
            double slope, mean = penetration_gradient(before, after, &slope);
            force[at] = REFERENCE[at] * (delta[at] + 0.5 * h * s[at]) - stiffness * mean;
            tangent[at][at] = h * (0.5 * REFERENCE[at] - stiffness * slope);
            before = fmax(before, 0.0), after = fmax(after, 0.0);
            power += 0.5 * SHARES[j] * ((new_k[mesh] - mid_k[mesh]) * after * after + (mid_k[mesh] - old_k[mesh]) * before * before);
        }
        force[0] = (fabs(h * s[0]) > 1e-12 ? -power / (h * s[0]) : 0.0) - given_back;
        for (i = 0; i < N_TURNING; ++i)
            for (force[TURNING + i] = 0.0, j = 0; j < N_TURNING; ++j) {
                force[TURNING + i] -= K_0[i][j] * s[TURNING + j] + K[i][j] * delta[TURNING + j];
                tangent[TURNING + i][TURNING + j] = -K_0[i][j];
            }
        for (k = 0; k < N_LOOSE; ++k) {
            int y = LOOSE + 2 * k, z = y + 1;
            double stiffness = REFERENCE[y], new_y = delta[y] + h * s[y], new_z = delta[z] + h * s[z], g[6];
            play_gradient(delta[y], delta[z], new_y, new_z, CLEARANCE[k], g);
            force[y] = stiffness * (0.5 * (delta[y] + new_y) - g[0]);
            force[z] = stiffness * (0.5 * (delta[z] + new_z) - g[1]);
            tangent[y][y] = h * stiffness * (0.5 - g[2]), tangent[y][z] = -h * stiffness * g[3];
            tangent[z][y] = -h * stiffness * g[4], tangent[z][z] = h * stiffness * (0.5 - g[5]);
        }
        for (k = 0; k < N_ROLLING; ++k) {
            int at = ROLLING + 4 * k;
            double middle[4], load[5], stiffness[5][5];
            for (i = 0; i < 4; ++i) middle[i] = delta[at + i] + 0.5 * h * s[at + i];
            roller_load(k, middle, angle + 0.5 * h * s[0], load, stiffness);
            force[0] -= load[4];
            for (i = 0; i < 4; ++i) {
                force[at + i] = REFERENCE[at + i] * middle[i] - load[i];
                for (j = 0; j < 4; ++j)
                    tangent[at + i][at + j] = 0.5 * h * ((i == j) * REFERENCE[at + i] - stiffness[i][j]);
            }
        }
        for (k = 0; k < N_SPLINES; ++k) {
            int twist = SPLINE + 3 * k;
            double stiffness = SPLINES[k][0], friction = SPLINES[k][2], middle[3], g[8], scale = 0.5 * h;
            for (i = 0; i < 3; ++i) middle[i] = delta[twist + i] + 0.5 * h * s[twist + i];
            spline_force(middle[1], middle[2], stiffness, SPLINES[k][1], friction * fabs(middle[0]), g);
            by_twist = scale * friction * ((middle[0] > 0.0) - (middle[0] < 0.0));
            for (i = 0; i < 2; ++i) {
                force[twist + 1 + i] = stiffness * middle[1 + i] - g[i];
                tangent[twist + 1 + i][twist] = -g[6 + i] * by_twist;
                for (j = 0; j < 2; ++j)
                    tangent[twist + 1 + i][twist + 1 + j] = scale * ((i == j) * stiffness - g[2 + 2 * i + j]);
            }
        }
        memset(matrix, 0, sizeof matrix);
        for (i = 0; i < N_CH; ++i) {
            matrix[i][i] = 1.0;
            change[i] = s[i] - s_free[i] - dot(work->W[i], force, N_CH);
        }
        for (kind = 0; kind < 5; ++kind) /* 1 - W tangent */
            for (block = 0; block < blocks[kind][1]; ++block, first += blocks[kind][0])
                for (i = first; i < first + blocks[kind][0]; ++i)
                    for (j = first; j < first + blocks[kind][0]; ++j)
                        for (k = 0; tangent[i][j] != 0.0 && k < N_CH; ++k) matrix[k][j] -= tangent[i][j] * work->W[k][i];
        if (!solved(N_CH, &matrix[0][0], change, 1)) return 0;
        for (largest = 0.0, i = 0; i < N_CH; ++i) {
            if (!isfinite(change[i])) return 0;
            largest = fmax(largest, fabs(change[i]));
        }
        if (iteration >= HALVED_FROM && largest * h > CONVERGED_NEWTON) {
            for (i = 0; i < N_CH; ++i) change[i] *= 0.5;
            largest *= 0.5;
        }
        for (i = 0; i < N_CH; ++i) {
            force[i] -= dot(tangent[i], change, N_CH);
            s[i] -= change[i];
        }
        if (largest * h <= CONVERGED + rounding) return 1;
    }
    return 0;
}

/* Loads a at a carrier angle. */
static void loads(double angle, const double u[], double a[7]) {
    double c = cos(angle), s = sin(angle);
    a[0] = u[0], a[1] = GENERATOR * u[1];
    a[2] = -GRAVITY * s, a[3] = -GRAVITY * c;
    a[4] = c * u[2] + s * u[3], a[5] = c * u[3] - s * u[2];
    a[6] = 1.0;
}

/* What the rollers store over a step beyond the work that their forces at its middle take [J]; zero where that is
 * small. */
static double roller_rest(const double delta[], const double s[], double h) {
    double rest = 0.0, absorbed = 0.0, energy = 0.0, angle = delta[0];
    int i, k;
    for (k = 0; k < N_ROLLING; ++k) {
        const double *old = delta + ROLLING + 4 * k, *rate = s + ROLLING + 4 * k;
        double middle[4], load[5], stiffness[5][5];
        for (i = 0; i < 4; ++i) middle[i] = old[i] + 0.5 * h * rate[i];
        energy += roller_load(k, middle, angle + 0.5 * h * s[0], load, stiffness);
        absorbed += h * load[4] * s[0];
        for (i = 0; i < 4; ++i) absorbed += h * load[i] * rate[i];
    }
    if (!(fabs(absorbed) > GENTLE * energy)) return 0.0;
    for (k = 0; k < N_ROLLING; ++k) {
        const double *old = delta + ROLLING + 4 * k, *rate = s + ROLLING + 4 * k;
        double new[4];
        for (i = 0; i < 4; ++i) new[i] = old[i] + h * rate[i];
        rest += roller_load(k, new, angle + h * s[0], NULL, NULL) - roller_load(k, old, angle, NULL, NULL);
    }
    return rest - absorbed;
}

/* One step of work->h with inputs u of its middle. */
static const char *advance(const Work *work, State *state, Memory *m, double delta[], const double u[]) {
    double h = work->h, *q = state->x, *v = q + N_M, a[7], rhs[N_M], free_w[N_M], s_free[N_CH], rate[N_CH];
    double turn = h * dot(B[0], v, N_M), given_back = m->missing * turn / (turn * turn + SLOW_TURN * SLOW_TURN);
    int i, j;
    loads(delta[0] + 0.5 * turn, u, a);
    for (i = 0; i < N_M; ++i) {
        rhs[i] = 2.0 / h * v[i] - OMEGA_2[i] * q[i];
        for (j = 0; j < 7; ++j) rhs[i] += a[j] * P[j][i];
    }
    for (i = 0; i < N_M; ++i) free_w[i] = dot(work->A_inverse[i], rhs, N_M);
    for (i = 0; i < N_CH; ++i) {
        double force = m->force[i];
        s_free[i] = dot(B[i], free_w, N_M);
        m->force[i] = 2.0 * force - m->before[i];
        m->before[i] = force;
    }
    if (!solve_channels(work, s_free, delta, given_back, m->force, rate))
        return "the contact forces of a step found no balance; export the unit with a smaller --time-step";
    for (j = 0; j < N_CH; ++j)
        for (i = 0; m->force[j] != 0.0 && i < N_M; ++i) free_w[i] += m->force[j] * work->answer[j][i];
    m->missing += roller_rest(delta, rate, h) - given_back * h * rate[0];
    for (i = 0; i < N_M; ++i) {
        q[i] += h * free_w[i];
        v[i] = 2.0 * free_w[i] - v[i];
    }
    for (i = 0; i < N_CH; ++i) {
        delta[i] += h * rate[i];
        if (i > 0 && !(fabs(delta[i]) < RUN_AWAY)) return "the stage left the range of small motions; check the loads";
    }
    return NULL;
}

const char *model_step(Work *work, State *state, double size) {
    double count = ceil(size / LARGEST_STEP * (1.0 - 1e-9)), k, u[N_U], delta[N_CH];
    Memory memory;
    int i;
    if (!(count <= MOST_STEPS)) return "the communication step holds more than a million steps of the model";
    if (count < 1.0) count = 1.0;
    memcpy(&memory, state->memory, sizeof memory);
    /* Communication steps that differ by rounding share their matrices. */
    if (!(fabs(memory.h * count - size) <= 1e-11 * size)) memory.h = size / count;
    if (work->h != memory.h && !prepare(work, memory.h)) return "no matrices of a step of this length";
    for (i = 0; i < N_CH; ++i) delta[i] = dot(B[i], state->x, N_M) - FREE[i];
    for (k = 0.0; k < count; ++k) {
        const char *message;
        for (i = 0; i < N_U; ++i) u[i] = state->u[i] + (k + 0.5) / count * size * state->rate[i];
        message = advance(work, state, &memory, delta, u);
        if (message) return message;
    }
    memcpy(state->memory, &memory, sizeof memory);
    return NULL;
}

/* The answer to the loads of the run at the carrier angle 0, whatever the inputs. */
const char *model_start(Work *work, State *state) {
    (void)work;
    memset(state->memory, 0, sizeof state->memory);
    memcpy(state->x, Q_0, sizeof Q_0);
    memcpy(state->x + N_M, V_0, sizeof V_0);
    return NULL;
}

/* S w with S = (R^T)' R, a quarter turn back in every pair; with sign -1 S^T w. */
static void quarter_turned(const double w[], double sign, double out[N_TURNING]) {
    int pair;
    memset(out, 0, sizeof(double) * N_TURNING);
    for (pair = 0; pair < N_TURNING / 2 - 1; ++pair) {
        int y = y_of_pair(pair), z = y + 1;
        out[y] = sign * w[z], out[z] = -sign * w[y];
    }
}

/* Forces f of the channels at an instant, to which the forces of a step converge, and their changes df with changes
 * of delta and s. */
static void channel_forces(const double delta[], const double s[], const double d_delta[], const double d_s[],
                           double f[], double df[]) {
    double K[N_TURNING][N_TURNING], C[N_TURNING][N_TURNING], mesh[3][N_MESHES], angle = delta[0], turn = d_delta[0];
    double back[N_TURNING], d_back[N_TURNING], back_rate[N_TURNING], load[N_TURNING], by_load[N_TURNING];
    const double *x = delta + TURNING, *x_s = s + TURNING, *dx = d_delta + TURNING, *dx_s = d_s + TURNING;
    int i, j, k;
    memset(f, 0, sizeof(double) * N_CH);
    memset(df, 0, sizeof(double) * N_CH);
    for (k = 0; k < 3; ++k) mesh_stiffness_at(MESH_TEETH * angle, k, mesh[k]);
    for (j = 0; j < N_FLANKS; ++j) {
        int m = j % N_MESHES, at = FLANKS + j;
        double into = fmax(delta[at] - GAPS[j], 0.0), d_into = into > 0.0 ? d_delta[at] : 0.0;
        double stiffness = SHARES[j] * mesh[0][m], slope = SHARES[j] * MESH_TEETH * mesh[1][m];
        double curvature = SHARES[j] * MESH_TEETH * MESH_TEETH * mesh[2][m];
        f[at] = REFERENCE[at] * delta[at] - stiffness * into;
        df[at] = REFERENCE[at] * d_delta[at] - stiffness * d_into - slope * turn * into;
        f[0] -= 0.5 * slope * into * into;
        df[0] -= 0.5 * curvature * turn * into * into + slope * into * d_into;
    }
    turned(K_FIXED, angle, K);
    turned(C_FIXED, angle, C);
    quarter_turned(x, -1.0, back);
    quarter_turned(dx, -1.0, d_back);
    for (i = 0; i < N_TURNING; ++i) back_rate[i] = x_s[i] + SPEED * back[i]; /* Velocity in the fixed frame. */
    for (i = 0; i < N_TURNING; ++i) load[i] = dot(K[i], x, N_TURNING) + dot(C[i], back_rate, N_TURNING);
    quarter_turned(load, 1.0, by_load);
    for (i = 0; i < N_TURNING; ++i) {
        f[TURNING + i] = dot(K_MEAN[i], x, N_TURNING) + dot(C_MEAN[i], x_s, N_TURNING) - load[i];
        df[TURNING + i] = dot(K_MEAN[i], dx, N_TURNING) + dot(C_MEAN[i], dx_s, N_TURNING) - turn * by_load[i];
    }
    quarter_turned(back_rate, -1.0, load);
    for (i = 0; i < N_TURNING; ++i)
        for (j = 0; j < N_TURNING; ++j) {
            df[TURNING + i] -= K[i][j] * (dx[j] + turn * back[j]);
            df[TURNING + i] -= C[i][j] * (dx_s[j] + SPEED * d_back[j] + turn * load[j]);
        }
    for (k = 0; k < N_LOOSE; ++k) {
        int y = LOOSE + 2 * k, z = y + 1;
        double g[6]; /* Over a step of nothing: half the tangent. */
        play_gradient(delta[y], delta[z], delta[y], delta[z], CLEARANCE[k], g);
        for (i = 0; i < 2; ++i) {
            f[y + i] = REFERENCE[y] * (delta[y + i] - g[i]);
            df[y + i] = REFERENCE[y] * (d_delta[y + i] - 2.0 * (g[2 + 2 * i] * d_delta[y] + g[3 + 2 * i] * d_delta[z]));
        }
    }
    for (k = 0; k < N_ROLLING; ++k) {
        int at = ROLLING + 4 * k;
        double force[5], tangent[5][5];
        roller_load(k, delta + at, angle, force, tangent);
        for (i = 0; i < 5; ++i) {
            int row = i < 4 ? at + i : 0;
            double reference = i < 4 ? REFERENCE[row] : 0.0;
            f[row] += reference * delta[row] - force[i];
            df[row] += reference * d_delta[row] - tangent[i][4] * turn - dot(tangent[i], d_delta + at, 4);
        }
    }
    for (k = 0; k < N_SPLINES; ++k) {
        int twist = SPLINE + 3 * k, y = twist + 1;
        double stiffness = SPLINES[k][0], friction = SPLINES[k][2], g[8];
        double d_limit = friction * ((delta[twist] > 0.0) - (delta[twist] < 0.0)) * d_delta[twist];
        spline_force(delta[y], delta[y + 1], stiffness, SPLINES[k][1], friction * fabs(delta[twist]), g);
        for (i = 0; i < 2; ++i) {
            f[y + i] = stiffness * delta[y + i] - g[i];
            df[y + i] = stiffness * d_delta[y + i] - dot(g + 2 + 2 * i, d_delta + y, 2) - g[6 + i] * d_limit;
        }
    }
}

/* x' = (v, q'') and its change with du and dx. */
static void equations(const State *state, const double du[], const double dx[], double rate[], double change[]) {
    const double *q = state->x, *v = q + N_M, *dq = dx, *dv = dx + N_M;
    double delta[N_CH], s[N_CH], d_delta[N_CH], d_s[N_CH], f[N_CH], df[N_CH], a[7], da[7];
    int i, j;
    for (i = 0; i < N_CH; ++i) {
        delta[i] = dot(B[i], q, N_M) - FREE[i], s[i] = dot(B[i], v, N_M);
        d_delta[i] = dot(B[i], dq, N_M), d_s[i] = dot(B[i], dv, N_M);
    }
    channel_forces(delta, s, d_delta, d_s, f, df);
    loads(delta[0], state->u, a);
    loads(delta[0], du, da);
    da[2] = a[3] * d_delta[0], da[3] = -a[2] * d_delta[0];
    da[4] += a[5] * d_delta[0], da[5] -= a[4] * d_delta[0];
    da[6] = 0.0;
    memcpy(rate, v, sizeof(double) * N_M);
    memcpy(change, dv, sizeof(double) * N_M);
    for (i = 0; i < N_M; ++i) {
        double sum = -OMEGA_2[i] * q[i] - dot(D[i], v, N_M), d_sum = -OMEGA_2[i] * dq[i] - dot(D[i], dv, N_M);
        for (j = 0; j < 7; ++j) sum += a[j] * P[j][i], d_sum += da[j] * P[j][i];
        for (j = 0; j < N_CH; ++j) sum += f[j] * B[j][i], d_sum += df[j] * B[j][i];
        rate[N_M + i] = sum, change[N_M + i] = d_sum;
    }
}

void model_derivatives(Work *work, const State *state, double dx[]) {
    double none[N_X] = {0}, no_inputs[N_U] = {0}, change[N_X];
    (void)work;
    equations(state, no_inputs, none, dx, change);
}

/* Motion at sensor i and the angle phi on the rim, linear in q and the constant tilt; and its derivative by phi. Rim:
 * Re of the sum over orders of (rows q + tilt) exp(j order phi). */
static double sensed(int i, const double q[], double tilt, double phi, double *by_phi) {
    double r = SENSOR_RADIUS[i], s = sin(phi), c = cos(phi), sum = 0.0, move[6];
    int k, axial = SENSOR_AXIAL[i];
    *by_phi = 0.0;
    for (k = 0; k < N_ORDERS; ++k) {
        double re = dot(RIM_RE[axial][k], q, N_M) + tilt * TILT_RE[axial][k];
        double im = dot(RIM_IM[axial][k], q, N_M) + tilt * TILT_IM[axial][k];
        double turn_c = cos(ORDERS[k] * phi), turn_s = sin(ORDERS[k] * phi);
        sum += re * turn_c - im * turn_s;
        *by_phi -= ORDERS[k] * (re * turn_s + im * turn_c);
    }
    for (k = 0; k < 6; ++k) move[k] = ON_HOUSING * dot(HOUSING[k], q, N_M);
    if (axial) {
        *by_phi -= r * (move[5] * c - move[4] * s);
        return sum - move[0] - r * (move[4] * c + move[5] * s);
    } else {
        double y = move[1] - move[5] * HOUSING_X, z = move[2] + move[4] * HOUSING_X;
        *by_phi += c * y + s * z;
        return sum + s * y - c * z;
    }
}

void model_outputs(Work *work, const State *state, double y[]) {
    const double *q = state->x, *v = q + N_M;
    double ignored;
    int i;
    (void)work;
    y[0] = dot(ANGLE, q, N_M);
    y[1] = dot(ANGLE, v, N_M);
    y[2] = dot(P[1], v, N_M);
    y[3] = GENERATOR * (state->u[1] - y[2]);
    for (i = 0; i < N_SENSORS; ++i)
        y[4 + i] = SENSOR_GAIN[i] * sensed(i, q, 1.0, SENSOR_ANGLE[i] - y[0], &ignored) + SENSOR_ZERO[i];
}

const char *model_changes(Work *work, const State *state, const double du[], double dx[], double rate[], double dy[]) {
    double ignored[N_X], theta = dot(ANGLE, state->x, N_M), by_phi, none;
    int i;
    (void)work;
    equations(state, du, dx, ignored, rate);
    dy[0] = dot(ANGLE, dx, N_M);
    dy[1] = dot(ANGLE, dx + N_M, N_M);
    dy[2] = dot(P[1], dx + N_M, N_M);
    dy[3] = GENERATOR * (du[1] - dy[2]);
    for (i = 0; i < N_SENSORS; ++i) {
        double phi = SENSOR_ANGLE[i] - theta;
        sensed(i, state->x, 1.0, phi, &by_phi);
        dy[4 + i] = SENSOR_GAIN[i] * (sensed(i, dx, 0.0, phi, &none) - by_phi * dy[0]);
    }
    return NULL;
}
