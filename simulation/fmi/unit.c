/* The interface that FMI 2 and FMI 3 share: modes, values, steps, derivatives, states. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "unit.h"

Unit *unit_made(const char *name, const char *token) {
    Unit *unit;
    if (!token || strcmp(token, TOKEN) != 0) return NULL;
    unit = calloc(1, sizeof *unit);
    if (!unit) return NULL;
    if (!name) name = "";
    unit->name = calloc(strlen(name) + 1, 1);
    unit->work = model_work();
    if (!unit->name || !unit->work) {
        unit_freed(unit);
        return NULL;
    }
    strcpy(unit->name, name);
    unit_reset(unit);
    return unit;
}

void unit_freed(Unit *unit) {
    if (!unit) return;
    model_free(unit->work);
    free(unit->name);
    free(unit);
}

int unit_failed(const Unit *unit, const char *message) {
    if (unit && unit->report) unit->report(unit, message);
    return FAILED;
}

int unit_started_at(Unit *unit, double start) {
    if (unit->state.mode != INSTANTIATED)
        return unit_failed(unit, "the initialization has begun before; expected a new or reset instance");
    if (!isfinite(start)) return unit_failed(unit, "the start time is not finite");
    unit->state.time = start;
    return OK;
}

int unit_initialising(Unit *unit) {
    if (unit->state.mode != INSTANTIATED)
        return unit_failed(unit, "the initialization has begun before; expected a new or reset instance");
    unit->state.mode = INITIALISING;
    return OK;
}

/* Before the first step the states follow the inputs. */
static int settled(Unit *unit) {
    const char *message;
    if (unit->state.at_rest || unit->state.mode == STEPPING || unit->state.mode == TERMINATED) return OK;
    message = model_start(unit->work, &unit->state);
    if (message) return unit_failed(unit, message);
    unit->state.at_rest = 1;
    return OK;
}

int unit_initialised(Unit *unit) {
    if (unit->state.mode != INITIALISING)
        return unit_failed(unit, "initialization has not begun; enter the initialization mode first");
    if (settled(unit) != OK) return FAILED;
    unit->state.mode = STEPPING;
    return OK;
}

int unit_terminated(Unit *unit) {
    if (unit->state.mode != STEPPING) return unit_failed(unit, "terminated before the initialization ended");
    unit->state.mode = TERMINATED;
    return OK;
}

int unit_reset(Unit *unit) {
    static const double start[N_U] = START_VALUES;
    memset(&unit->state, 0, sizeof unit->state);
    memcpy(unit->state.u, start, sizeof start);
    unit->state.mode = INSTANTIATED;
    return OK;
}

int unit_get(Unit *unit, const unsigned references[], size_t n, double values[]) {
    const State *state = &unit->state;
    double y[N_Y], dx[N_X];
    size_t k;
    int derived = 0;
    if (settled(unit) != OK) return FAILED;
    model_outputs(unit->work, state, y);
    for (k = 0; k < n; ++k) {
        unsigned r = references[k];
        if (r == TIME) values[k] = state->time;
        else if (r < RATES) values[k] = state->u[r - INPUTS];
        else if (r < OUTPUTS) values[k] = state->rate[r - RATES];
        else if (r < STATES) values[k] = y[r - OUTPUTS];
        else if (r < DERIVATIVES) values[k] = state->x[r - STATES];
        else if (r < N_VARIABLES) {
            if (!derived++) model_derivatives(unit->work, state, dx);
            values[k] = dx[r - DERIVATIVES];
        } else return unit_failed(unit, "a value reference is unknown; expected one of modelDescription.xml");
    }
    return OK;
}

int unit_set(Unit *unit, const unsigned references[], size_t n, const double values[]) {
    size_t k;
    if (unit->state.mode == TERMINATED) return unit_failed(unit, "an input was set after the end; reset the unit first");
    for (k = 0; k < n; ++k) {
        if (references[k] < INPUTS || references[k] >= OUTPUTS)
            return unit_failed(unit, "a variable that is no input was set");
        if (!isfinite(values[k])) return unit_failed(unit, "an input is not finite");
    }
    for (k = 0; k < n; ++k) {
        unsigned r = references[k];
        if (r < RATES) unit->state.u[r - INPUTS] = values[k];
        else unit->state.rate[r - RATES] = values[k];
    }
    unit->state.at_rest = 0;
    return OK;
}

int unit_step(Unit *unit, double time, double size) {
    State next = unit->state;
    const char *message;
    int i;
    if (unit->state.mode != STEPPING) return unit_failed(unit, "a step before the initialization or after the end");
    if (!(size > 0.0) || !isfinite(size))
        return unit_failed(unit, "the communication step is not positive; expected seconds above zero");
    /* Times are sums of rounded steps: a millionth of a step is rounding. */
    if (!(fabs(time - unit->state.time) <= 1e-6 * size + 1e-9 * fabs(time)))
        return unit_failed(unit, "the step begins at another time than the last one ended");
    message = model_step(unit->work, &next, size);
    if (message) return unit_failed(unit, message); /* The unit stays where it was. */
    for (i = 0; i < N_U; ++i) next.u[i] += size * next.rate[i];
    next.time = time + size;
    unit->state = next;
    return OK;
}

int unit_output_derivatives(Unit *unit, const unsigned references[], size_t n, const int orders[], double values[]) {
    double dx[N_X], rate[N_X], dy[N_Y];
    size_t k;
    const char *message;
    if (unit->state.mode != STEPPING) return unit_failed(unit, "output derivatives are known after the initialization");
    model_derivatives(unit->work, &unit->state, dx);
    message = model_changes(unit->work, &unit->state, unit->state.rate, dx, rate, dy);
    if (message) return unit_failed(unit, message);
    for (k = 0; k < n; ++k) {
        if (references[k] < OUTPUTS || references[k] >= STATES || orders[k] != 1)
            return unit_failed(unit, "an output derivative is refused; expected first derivatives of outputs");
        values[k] = dy[references[k] - OUTPUTS];
    }
    return OK;
}

int unit_directional(Unit *unit, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[], size_t n_knowns,
                     const double seed[], double sensitivity[]) {
    double du[N_U] = {0}, dx[N_X] = {0}, rate[N_X], dy[N_Y];
    const char *message;
    size_t k;
    if (unit->state.mode != INITIALISING && unit->state.mode != STEPPING)
        return unit_failed(unit, "derivatives are known in initialization and step mode");
    for (k = 0; k < n_knowns; ++k) {
        unsigned r = knowns[k];
        if (r >= INPUTS && r < RATES) du[r - INPUTS] += seed[k];
        else if (r >= RATES && r < OUTPUTS) continue; /* Felt at the end of the next step only. */
        else if (r >= STATES && r < DERIVATIVES && unit->state.mode == STEPPING) dx[r - STATES] += seed[k];
        else return unit_failed(unit, "a known is refused; expected inputs, and in step mode states");
    }
    if (settled(unit) != OK) return FAILED;
    message = model_changes(unit->work, &unit->state, du, dx, rate, dy);
    if (message) return unit_failed(unit, message);
    for (k = 0; k < n_unknowns; ++k) {
        unsigned r = unknowns[k];
        if (r >= OUTPUTS && r < STATES) sensitivity[k] = dy[r - OUTPUTS];
        else if (r >= STATES && r < DERIVATIVES) sensitivity[k] = dx[r - STATES]; /* A velocity is a derivative. */
        else if (r >= DERIVATIVES && r < N_VARIABLES) sensitivity[k] = rate[r - DERIVATIVES];
        else return unit_failed(unit, "an unknown is refused; expected outputs, states or their derivatives");
    }
    return OK;
}
/* Row by row of what the directional derivatives give column by column. */
int unit_adjoint(Unit *unit, const unsigned unknowns[], size_t n_unknowns, const unsigned knowns[], size_t n_knowns,
                 const double seed[], double sensitivity[]) {
    double column[N_VARIABLES], one = 1.0;
    size_t i, k;
    if (n_unknowns > N_VARIABLES) return unit_failed(unit, "more unknowns than variables");
    for (k = 0; k < n_knowns; ++k) {
        if (unit_directional(unit, unknowns, n_unknowns, &knowns[k], 1, &one, column) != OK) return FAILED;
        for (sensitivity[k] = 0.0, i = 0; i < n_unknowns; ++i) sensitivity[k] += seed[i] * column[i];
    }
    return OK;
}

int unit_get_state(Unit *unit, void **state) {
    if (!state) return unit_failed(unit, "no place for the state was given");
    if (!*state) *state = malloc(sizeof(State));
    if (!*state) return unit_failed(unit, "no memory for the state");
    memcpy(*state, &unit->state, sizeof(State));
    return OK;
}

int unit_set_state(Unit *unit, const void *state) {
    if (!state) return unit_failed(unit, "the state to set is NULL; get one first");
    memcpy(&unit->state, state, sizeof(State));
    return OK;
}

int unit_free_state(Unit *unit, void **state) {
    (void)unit;
    if (state) {
        free(*state);
        *state = NULL;
    }
    return OK;
}

int unit_stored_size(Unit *unit, const void *state, size_t *size) {
    if (!state || !size) return unit_failed(unit, "the state is NULL; get one first");
    *size = sizeof TOKEN + sizeof(State);
    return OK;
}

int unit_stored(Unit *unit, const void *state, char bytes[], size_t size) {
    if (!state || !bytes || size != sizeof TOKEN + sizeof(State))
        return unit_failed(unit, "a state is stored in as many bytes as its size says");
    memcpy(bytes, TOKEN, sizeof TOKEN);
    memcpy(bytes + sizeof TOKEN, state, sizeof(State));
    return OK;
}

int unit_restored(Unit *unit, const char bytes[], size_t size, void **state) {
    if (!bytes || !state || size != sizeof TOKEN + sizeof(State) || memcmp(bytes, TOKEN, sizeof TOKEN) != 0)
        return unit_failed(unit, "the stored state is of another unit");
    if (!*state) *state = malloc(sizeof(State));
    if (!*state) return unit_failed(unit, "no memory for the state");
    memcpy(*state, bytes + sizeof TOKEN, sizeof(State));
    return OK;
}

int solved(int n, double *a, double *b, int columns) {
    int i, j, p;
    for (p = 0; p < n; ++p) {
        int best = p;
        for (i = p + 1; i < n; ++i)
            if (fabs(a[i * n + p]) > fabs(a[best * n + p])) best = i;
        if (!(fabs(a[best * n + p]) > 0.0)) return 0;
        for (j = 0; best != p && j < n; ++j) {
            double t = a[p * n + j]; a[p * n + j] = a[best * n + j]; a[best * n + j] = t;
        }
        for (j = 0; best != p && j < columns; ++j) {
            double t = b[p * columns + j]; b[p * columns + j] = b[best * columns + j]; b[best * columns + j] = t;
        }
        for (i = p + 1; i < n; ++i) {
            double f = a[i * n + p] / a[p * n + p];
            if (f == 0.0) continue;
            for (j = p; j < n; ++j) a[i * n + j] -= f * a[p * n + j];
            for (j = 0; j < columns; ++j) b[i * columns + j] -= f * b[p * columns + j];
        }
    }
    for (i = n - 1; i >= 0; --i)
        for (j = 0; j < columns; ++j) {
            for (p = i + 1; p < n; ++p) b[i * columns + j] -= a[i * n + p] * b[p * columns + j];
            b[i * columns + j] /= a[i * n + i];
        }
    return 1;
}
