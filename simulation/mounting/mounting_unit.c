/* The mounting on its bushings: x' = A x + B u + N (phi + F), y = C x + Y_0.
 *
 * phi_e = K3 d^3 + K5 d^5 + C3 d^2 d' with the element's deflection d = PRELOAD + D x, d' = R x;
 * F' = Kp d', at most +-Fy. States of the unit are x, then F where the elements have friction.
 *
 * A step of length h is exact for the linear rest, with u linear and phi + F quadratic in time
 * through their values at 0, h/2 and h (an exponential Lobatto method of order four). */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "model_data.h"
#include "unit.h"

enum { N_V = 2 * N_E, CHANNELS = N_U + N_E, SIZE = N_S + 3 * CHANNELS, N_KNOWN = N_S + 2 * N_U + N_E };
#define MOST_STEPS 1e6       /* More are a wrong unit of time, and would keep the tool waiting. */
#define LARGEST_MOTION 0.3   /* Beyond it [rad, m] the model, linear in its kinematics, is left. */
#define TOLERANCE 1e-12      /* Of the forces within a step, over the largest. */
enum { MOST_ITERATIONS = 40 };

struct Work {
    double h;                                             /* Step of the matrices; 0: none yet. */
    double end[N_S][N_KNOWN], end_force[N_S][N_V];        /* State after a step, over state, inputs at both */
    double probe[2 * N_V][N_KNOWN], probe_force[2 * N_V][N_V]; /* ends, first forces; over later forces. */
};

/* Memory of the solver: forces phi + F where the step begins, F of every element, length of the last step. */
typedef struct { double phi[N_E], F[N_E], h; } Memory;

Work *model_work(void) { return calloc(1, sizeof(Work)); }
void model_free(Work *work) { free(work); }

static double clipped(double F) { return F > Fy ? Fy : F < -Fy ? -Fy : F; }
static double elastic(double d, double rate) { return d * d * (d * (K3 + K5 * d * d) + C3 * rate); }
static double over_d(double d, double rate) { return d * (3.0 * K3 * d + 5.0 * K5 * d * d * d + 2.0 * C3 * rate); }
static double deflection(const double x[], int e) {
    double d = PRELOAD[e];
    int i;
    for (i = 0; i < N_S; ++i) d += D[e][i] * x[i];
    return d;
}
static double rate_of(const double x[], int e) {
    double rate = 0.0;
    int i;
    for (i = 0; i < N_S; ++i) rate += R[e][i] * x[i];
    return rate;
}

/* C = A B, square matrices of SIZE. */
static void product(double (*a)[SIZE], double (*b)[SIZE], double (*c)[SIZE]) {
    int i, j, k;
    for (i = 0; i < SIZE; ++i) {
        memset(c[i], 0, sizeof c[i]);
        for (k = 0; k < SIZE; ++k)
            for (j = 0; a[i][k] != 0.0 && j < SIZE; ++j) c[i][j] += a[i][k] * b[k][j];
    }
}

/* Exponential by scaling, Taylor's series and squaring; `a` is destroyed. */
static void exponential(double (*a)[SIZE], double (*e)[SIZE], double (*t)[SIZE], double (*s)[SIZE]) {
    double norm = 0.0;
    int i, j, k, squarings = 0;
    for (i = 0; i < SIZE; ++i) {
        double sum = 0.0;
        for (j = 0; j < SIZE; ++j) sum += fabs(a[i][j]);
        if (sum > norm) norm = sum;
    }
    for (; norm > 0.25; norm *= 0.5) ++squarings;
    for (i = 0; i < SIZE; ++i)
        for (j = 0; j < SIZE; ++j) {
            a[i][j] = ldexp(a[i][j], -squarings);
            e[i][j] = t[i][j] = i == j;
        }
    for (k = 1; k <= 12; ++k) { /* 0.25^13 / 13! is below rounding. */
        product(t, a, s);
        for (i = 0; i < SIZE; ++i)
            for (j = 0; j < SIZE; ++j) e[i][j] += t[i][j] = s[i][j] / k;
    }
    for (; squarings > 0; --squarings) {
        product(e, e, s);
        memcpy(e, s, sizeof(double) * SIZE * SIZE);
    }
}

/* From the state beside every channel's value and two derivatives (time in steps) to values at both ends and, of
 * forces, in the middle. */
static void over_values(double (*m)[SIZE], int row, double known[], double forces[]) {
    const double *value = m[row] + N_S, *first = value + CHANNELS, *second = first + CHANNELS;
    int i;
    for (i = 0; i < N_S; ++i) known[i] = m[row][i];
    for (i = 0; i < N_U; ++i) {
        known[N_S + i] = value[i] - first[i];
        known[N_S + N_U + i] = first[i];
    }
    for (i = 0; i < N_E; ++i) {
        double v = value[N_U + i], f = first[N_U + i], s = second[N_U + i];
        known[N_S + 2 * N_U + i] = v - 3.0 * f + 4.0 * s;
        forces[i] = 4.0 * f - 8.0 * s;
        forces[N_E + i] = 4.0 * s - f;
    }
}

/* Matrices of a step of length h. */
static int prepare(Work *work, double h) {
    double(*buffer)[SIZE] = malloc(sizeof(double) * 4 * SIZE * SIZE);
    double(*a)[SIZE] = buffer, (*half)[SIZE] = buffer + SIZE, (*whole)[SIZE] = buffer + 2 * SIZE;
    double known[N_KNOWN], forces[N_V];
    int i, j, e, t;
    if (!buffer) return 0;
    memset(buffer, 0, sizeof(double) * 4 * SIZE * SIZE);
    for (i = 0; i < N_S; ++i) {
        for (j = 0; j < N_S; ++j) a[i][j] = 0.5 * h * A[i][j];
        for (j = 0; j < N_U; ++j) a[i][N_S + j] = 0.5 * h * B[i][j];
        for (j = 0; j < N_E; ++j) a[i][N_S + N_U + j] = 0.5 * h * N[i][j];
    }
    for (i = N_S; i < SIZE - CHANNELS; ++i) a[i][i + CHANNELS] = 0.5;
    exponential(a, half, whole, buffer + 3 * SIZE);
    product(half, half, whole);
    memset(work, 0, sizeof *work);
    for (t = 0; t < 2; ++t) /* Middle, end; deflections, then rates. */
        for (i = 0; i < N_S; ++i) {
            over_values(t ? whole : half, i, known, forces);
            if (t) {
                memcpy(work->end[i], known, sizeof known);
                memcpy(work->end_force[i], forces, sizeof forces);
            }
            for (e = 0; e < N_E; ++e) {
                int d = t * N_E + e, r = N_V + d;
                for (j = 0; j < N_KNOWN; ++j) {
                    work->probe[d][j] += D[e][i] * known[j];
                    work->probe[r][j] += R[e][i] * known[j];
                }
                for (j = 0; j < N_V; ++j) {
                    work->probe_force[d][j] += D[e][i] * forces[j];
                    work->probe_force[r][j] += R[e][i] * forces[j];
                }
            }
        }
    work->h = h;
    free(buffer);
    return 1;
}

/* One step of work->h with inputs u0 at its start and u1 at its end. */
static const char *advance(const Work *work, State *state, Memory *memory, const double u0[], const double u1[]) {
    double known[N_KNOWN], fixed[2 * N_V], probe[2 * N_V], f[N_V], F[N_V], wanted[N_V], x[N_S];
    double before[N_E], error = HUGE_VAL, last, scale;
    int i, j, e, half, iteration, newton = 0;
    for (i = 0; i < N_S; ++i) known[i] = state->x[i];
    for (i = 0; i < N_U; ++i) {
        known[N_S + i] = u0[i];
        known[N_S + N_U + i] = u1[i];
    }
    for (e = 0; e < N_E; ++e) {
        known[N_S + 2 * N_U + e] = f[e] = f[N_E + e] = memory->phi[e];
        before[e] = deflection(state->x, e);
    }
    for (i = 0; i < 2 * N_V; ++i)
        for (fixed[i] = 0.0, j = 0; j < N_KNOWN; ++j) fixed[i] += work->probe[i][j] * known[j];
    for (iteration = 0;; ++iteration) {
        double jacobian[N_V * N_V], slopes[N_V], rate_slopes[N_V], sticks[N_V];
        for (i = 0; i < 2 * N_V; ++i)
            for (probe[i] = fixed[i], j = 0; j < N_V; ++j) probe[i] += work->probe_force[i][j] * f[j];
        last = error, error = 0.0, scale = 1.0;
        for (e = 0; e < N_E; ++e) {
            double F_before = memory->F[e], d_before = before[e];
            for (half = 0; half < 2; ++half) {
                int row = half * N_E + e;
                double d = PRELOAD[e] + probe[row], rate = probe[N_V + row];
                double tried = F_before + Kp * (d - d_before);
                F[row] = F_before = clipped(tried);
                sticks[row] = fabs(tried) < Fy ? Kp : 0.0;
                d_before = d;
                wanted[row] = elastic(d, rate) + F[row];
                slopes[row] = over_d(d, rate);
                rate_slopes[row] = C3 * d * d;
                error = fmax(error, fabs(f[row] - wanted[row]));
                scale = fmax(scale, fabs(wanted[row]));
            }
        }
        if (error <= TOLERANCE * scale) break;
        if (iteration == MOST_ITERATIONS || !isfinite(error))
            return "the bushing forces of a step did not converge; export the unit with a smaller --time-step";
        newton = newton || error > 0.1 * last;
        if (!newton) {
            memcpy(f, wanted, sizeof f);
            continue;
        }
        for (i = 0; i < N_V; ++i) {
            /* An elastic second half remembers the middle, unless the first half was elastic too. */
            double middle = i >= N_E && sticks[i] > 0.0 ? sticks[i - N_E] - Kp : 0.0;
            for (j = 0; j < N_V; ++j) {
                double by = (slopes[i] + sticks[i]) * work->probe_force[i][j];
                by += rate_slopes[i] * work->probe_force[N_V + i][j];
                by += middle * work->probe_force[i % N_E][j];
                jacobian[i * N_V + j] = (i == j) - by;
            }
            wanted[i] = f[i] - wanted[i];
        }
        if (!solved(N_V, jacobian, wanted, 1)) return "the bushing forces of a step have no single solution";
        for (i = 0; i < N_V; ++i) f[i] -= wanted[i];
    }
    memcpy(f, wanted, sizeof f);
    for (i = 0; i < N_S; ++i) {
        for (x[i] = 0.0, j = 0; j < N_KNOWN; ++j) x[i] += work->end[i][j] * known[j];
        for (j = 0; j < N_V; ++j) x[i] += work->end_force[i][j] * f[j];
    }
    for (i = 0; i < N_Q; ++i)
        if (!(fabs(x[COORDINATES[i]]) < LARGEST_MOTION))
            return "a motion exceeds 0.3 rad or m, where the small-angle model ends; check the loads' units";
    memcpy(state->x, x, sizeof x);
    for (e = 0; e < N_E; ++e) {
        memory->phi[e] = f[N_E + e];
        memory->F[e] = F[N_E + e];
    }
    return NULL;
}

static void store(State *state, const Memory *memory) {
    int e;
    memcpy(state->memory, memory, sizeof *memory);
    for (e = 0; e < N_X - N_S; ++e) state->x[N_S + e] = memory->F[e];
}

static void load(const State *state, Memory *memory) {
    int e;
    memcpy(memory, state->memory, sizeof *memory);
    for (e = 0; e < N_X - N_S; ++e) memory->F[e] = state->x[N_S + e];
}

const char *model_step(Work *work, State *state, double size) {
    double count = ceil(size / LARGEST_STEP * (1.0 - 1e-9)), k, u0[N_U], u1[N_U];
    Memory memory;
    int i;
    if (!(count <= MOST_STEPS)) return "the communication step holds more than a million steps of the model";
    if (count < 1.0) count = 1.0;
    load(state, &memory);
    /* Communication steps that differ by rounding share their matrices. */
    if (!(fabs(memory.h * count - size) <= 1e-11 * size)) memory.h = size / count;
    if (work->h != memory.h && !prepare(work, memory.h)) return "no memory for the matrices of a step";
    for (k = 0.0; k < count; ++k) {
        const char *message;
        for (i = 0; i < N_U; ++i) {
            u0[i] = state->u[i] + k / count * size * state->rate[i];
            u1[i] = state->u[i] + (k + 1.0) / count * size * state->rate[i];
        }
        message = advance(work, state, &memory, u0, u1);
        if (message) return message;
    }
    store(state, &memory);
    return NULL;
}

/* Jacobian A + N (phi' D + ...): at_rest with friction that follows the deflection from nothing. */
static void tangent(const State *state, double J[N_S * N_S], int at_rest) {
    int i, j, e;
    for (i = 0; i < N_S; ++i)
        for (j = 0; j < N_S; ++j) J[i * N_S + j] = A[i][j];
    for (e = 0; e < N_E; ++e) {
        double d = deflection(state->x, e), rate = rate_of(state->x, e);
        double slope = over_d(d, rate) + (at_rest && fabs(Kp * d) < Fy ? Kp : 0.0);
        for (i = 0; i < N_S; ++i)
            for (j = 0; j < N_S; ++j) J[i * N_S + j] += N[i][e] * (slope * D[e][j] + C3 * d * d * R[e][j]);
    }
}

const char *model_start(Work *work, State *state) {
    double J[N_S * N_S], residual[N_S], size = 0.0, change;
    Memory memory = {{0}, {0}, 0.0};
    int i, j, e, iteration;
    (void)work;
    memset(state->x, 0, sizeof state->x);
    for (iteration = 0; iteration < 100; ++iteration) {
        for (e = 0; e < N_E; ++e) {
            double d = deflection(state->x, e);
            memory.F[e] = clipped(Kp * d);
            memory.phi[e] = elastic(d, 0.0) + memory.F[e];
        }
        for (i = 0; i < N_S; ++i) {
            for (residual[i] = 0.0, j = 0; j < N_S; ++j) residual[i] -= A[i][j] * state->x[j];
            for (j = 0; j < N_U; ++j) residual[i] -= B[i][j] * state->u[j];
            for (e = 0; e < N_E; ++e) residual[i] -= N[i][e] * memory.phi[e];
        }
        tangent(state, J, 1);
        if (!solved(N_S, J, residual, 1)) break;
        for (change = size = 0.0, i = 0; i < N_S; ++i) {
            state->x[i] += residual[i];
            change = fmax(change, fabs(residual[i]));
            size = fmax(size, fabs(state->x[i]));
        }
        if (change <= 1e-12 * size) {
            store(state, &memory);
            return size < LARGEST_MOTION ? NULL : "the loads at the start move the housing by more than 0.3 rad or m";
        }
    }
    return "no static equilibrium under the inputs at the start; check the loads' units";
}

void model_outputs(Work *work, const State *state, double y[]) {
    int i, j;
    (void)work;
    for (i = 0; i < N_Y; ++i)
        for (y[i] = Y_0[i], j = 0; j < N_S; ++j) y[i] += C[i][j] * state->x[j];
}

void model_derivatives(Work *work, const State *state, double dx[]) {
    Memory memory;
    int i, j, e;
    (void)work;
    load(state, &memory);
    for (i = 0; i < N_S; ++i) {
        for (dx[i] = 0.0, j = 0; j < N_S; ++j) dx[i] += A[i][j] * state->x[j];
        for (j = 0; j < N_U; ++j) dx[i] += B[i][j] * state->u[j];
        for (e = 0; e < N_E; ++e)
            dx[i] += N[i][e] * (elastic(deflection(state->x, e), rate_of(state->x, e)) + memory.F[e]);
    }
    for (e = 0; e < N_X - N_S; ++e) {
        double rate = rate_of(state->x, e);
        dx[N_S + e] = memory.F[e] * rate > 0.0 && fabs(memory.F[e]) >= Fy ? 0.0 : Kp * rate;
    }
}

const char *model_changes(Work *work, const State *state, const double du[], double dx[], double rate[], double dy[]) {
    double J[N_S * N_S];
    int i, j, e, starts = state->mode != STEPPING;
    (void)work;
    tangent(state, J, starts);
    memset(rate, 0, sizeof(double) * N_X);
    if (starts) {
        for (i = 0; i < N_S; ++i)
            for (dx[i] = 0.0, j = 0; j < N_U; ++j) dx[i] -= B[i][j] * du[j];
        if (!solved(N_S, J, dx, 1)) return "the mounting has no stiffness against the inputs";
        for (e = 0; e < N_X - N_S; ++e) {
            double d = deflection(dx, e) - PRELOAD[e];
            dx[N_S + e] = fabs(Kp * deflection(state->x, e)) < Fy ? Kp * d : 0.0;
        }
    } else {
        for (i = 0; i < N_S; ++i) {
            for (j = 0; j < N_S; ++j) rate[i] += J[i * N_S + j] * dx[j];
            for (j = 0; j < N_U; ++j) rate[i] += B[i][j] * du[j];
            for (e = 0; e < N_X - N_S; ++e) rate[i] += N[i][e] * dx[N_S + e];
        }
        for (e = 0; e < N_X - N_S; ++e) {
            double F = state->x[N_S + e];
            rate[N_S + e] = F * rate_of(state->x, e) > 0.0 && fabs(F) >= Fy ? 0.0 : Kp * rate_of(dx, e);
        }
    }
    for (i = 0; i < N_Y; ++i)
        for (dy[i] = 0.0, j = 0; j < N_S; ++j) dy[i] += C[i][j] * dx[j];
    return NULL;
}
