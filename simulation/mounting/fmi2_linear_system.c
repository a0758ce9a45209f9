/* Co-simulation slave of a linear system, FMI 2.0: exact steps for inputs linear in time.
 *
 * linear_system.h, written for each model, holds its sizes, identifier and matrices:
 *     x(t + h) = E x + B_0 u(t) + B_1 u(t + h),   y = C x + y_0,   x(t_0) = S u(t_0).
 * A communication step is a whole number of steps h; inputs are constant over it unless their derivative is set.
 * Value references: inputs 0 .. N_U - 1, outputs N_U .. N_U + N_Y - 1. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "linear_system.h"

/* Interface of the standard: types, status codes and callbacks. */
typedef void *Component;
typedef unsigned int Reference;
typedef int Boolean;
typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL, STATUS_PENDING } Status;
typedef struct {
    void (*logger)(void *, const char *, Status, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, Status);
    void *environment;
} Callbacks;

#if defined(_WIN32)
#define API __declspec(dllexport)
#else
#define API __attribute__((visibility("default")))
#endif

/* More steps at once are a wrong unit of time, and would keep the tool waiting. */
#define MOST_STEPS 1e6

typedef struct {
    double x[N_X], u[N_U], rate[N_U], time;
    int initialised;
    const Callbacks *callbacks;
    char *name;
} Slave;

static Status refused(const Slave *s, const char *message) {
    if (s->callbacks && s->callbacks->logger)
        s->callbacks->logger(s->callbacks->environment, s->name, STATUS_ERROR, "logStatusError", "%s", message);
    return STATUS_ERROR;
}

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }

API Component fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                              const Callbacks *callbacks, Boolean visible, Boolean logging) {
    Slave *s;
    (void)resources; (void)visible; (void)logging;
    if (type != 1 || !guid || strcmp(guid, MODEL_GUID) != 0) return NULL;
    s = calloc(1, sizeof *s);
    if (!s) return NULL;
    if (!name) name = "";
    s->name = calloc(strlen(name) + 1, 1);
    if (!s->name) { free(s); return NULL; }
    strcpy(s->name, name);
    s->callbacks = callbacks;
    return s;
}

API void fmi2FreeInstance(Component c) {
    if (c) { free(((Slave *)c)->name); free(c); }
}

API Status fmi2SetDebugLogging(Component c, Boolean on, size_t n, const char *const categories[]) {
    (void)c; (void)on; (void)n; (void)categories;
    return STATUS_OK;
}

API Status fmi2SetupExperiment(Component c, Boolean has_tolerance, double tolerance, double start, Boolean has_stop,
                               double stop) {
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    ((Slave *)c)->time = start;
    return STATUS_OK;
}

API Status fmi2EnterInitializationMode(Component c) { (void)c; return STATUS_OK; }

static void settle(Slave *s) {
    int i, j;
    for (i = 0; i < N_X; ++i)
        for (s->x[i] = 0.0, j = 0; j < N_U; ++j) s->x[i] += S[i][j] * s->u[j];
}

API Status fmi2ExitInitializationMode(Component c) {
    settle(c);
    ((Slave *)c)->initialised = 1;
    return STATUS_OK;
}

API Status fmi2Terminate(Component c) { (void)c; return STATUS_OK; }

API Status fmi2Reset(Component c) {
    Slave *s = c;
    memset(s->x, 0, sizeof s->x); memset(s->u, 0, sizeof s->u); memset(s->rate, 0, sizeof s->rate);
    s->time = 0.0;
    s->initialised = 0;
    return STATUS_OK;
}

API Status fmi2GetReal(Component c, const Reference references[], size_t n, double values[]) {
    Slave *s = c;
    size_t k;
    int j;
    if (!s->initialised) settle(s);
    for (k = 0; k < n; ++k) {
        Reference r = references[k];
        if (r < N_U) values[k] = s->u[r];
        else if (r < N_U + N_Y)
            for (values[k] = Y_0[r - N_U], j = 0; j < N_X; ++j) values[k] += C[r - N_U][j] * s->x[j];
        else return refused(s, "a value reference is unknown; expected an input or an output");
    }
    return STATUS_OK;
}

API Status fmi2SetReal(Component c, const Reference references[], size_t n, const double values[]) {
    Slave *s = c;
    size_t k;
    for (k = 0; k < n; ++k) {
        if (references[k] >= N_U) return refused(s, "a value that is no input was set");
        if (!isfinite(values[k])) return refused(s, "an input is not finite");
        s->u[references[k]] = values[k];
    }
    return STATUS_OK;
}

API Status fmi2SetRealInputDerivatives(Component c, const Reference references[], size_t n, const int orders[],
                                       const double values[]) {
    Slave *s = c;
    size_t k;
    for (k = 0; k < n; ++k) {
        if (references[k] >= N_U || orders[k] != 1 || !isfinite(values[k]))
            return refused(s, "an input derivative is refused; expected finite first derivatives of inputs");
        s->rate[references[k]] = values[k];
    }
    return STATUS_OK;
}

static void step_once(Slave *s) {
    double next[N_X];
    int i, j;
    for (i = 0; i < N_X; ++i) {
        next[i] = 0.0;
        for (j = 0; j < N_X; ++j) next[i] += E[i][j] * s->x[j];
        for (j = 0; j < N_U; ++j) next[i] += B_0[i][j] * s->u[j] + B_1[i][j] * (s->u[j] + STEP * s->rate[j]);
    }
    memcpy(s->x, next, sizeof next);
    for (j = 0; j < N_U; ++j) s->u[j] += STEP * s->rate[j];
}

API Status fmi2DoStep(Component c, double time, double size, Boolean final) {
    Slave *s = c;
    double count = floor(size / STEP + 0.5), k;
    (void)final;
    if (!(count <= MOST_STEPS))
        return refused(s, "the communication step is too long; expected at most a million of the model's own steps");
    /* Times are sums of rounded steps: a millionth of a step is rounding, more is another step size. */
    if (!(size > 0.0) || fabs(size / STEP - count) > 1e-6 * (1.0 + count))
        return refused(s, "the communication step is no whole number of the model's own step");
    for (k = 0.0; k < count; ++k) step_once(s);
    /* A derivative holds for one communication step. */
    memset(s->rate, 0, sizeof s->rate);
    s->time = time + size;
    return STATUS_OK;
}

API Status fmi2CancelStep(Component c) { return refused(c, "steps are never pending"); }

API Status fmi2GetRealOutputDerivatives(Component c, const Reference r[], size_t n, const int o[], double v[]) {
    (void)r; (void)n; (void)o; (void)v;
    return refused(c, "output derivatives are not offered");
}

/* What the model does not have: other types, saved states, directional derivatives. */
#define REFUSES(name, ...) API Status name(Component c, __VA_ARGS__) { return refused(c, #name " is not offered"); }
REFUSES(fmi2GetFMUstate, void **a)
REFUSES(fmi2SetFMUstate, void *a)
REFUSES(fmi2FreeFMUstate, void **a)
REFUSES(fmi2SerializedFMUstateSize, void *a, size_t *b)
REFUSES(fmi2SerializeFMUstate, void *a, char b[], size_t d)
REFUSES(fmi2DeSerializeFMUstate, const char a[], size_t b, void **d)
REFUSES(fmi2GetDirectionalDerivative, const Reference a[], size_t b, const Reference d[], size_t e, const double f[],
        double g[])
REFUSES(fmi2GetStatus, int a, Status *b)
REFUSES(fmi2GetRealStatus, int a, double *b)
REFUSES(fmi2GetIntegerStatus, int a, int *b)
REFUSES(fmi2GetBooleanStatus, int a, Boolean *b)
REFUSES(fmi2GetStringStatus, int a, const char **b)

#define NO_VALUES(name, type) \
    API Status name(Component c, const Reference r[], size_t n, type v) { \
        (void)r; (void)v; \
        return n ? refused(c, #name ": the model has no variable of this type") : STATUS_OK; \
    }
NO_VALUES(fmi2GetInteger, int *)
NO_VALUES(fmi2GetBoolean, Boolean *)
NO_VALUES(fmi2GetString, const char **)
NO_VALUES(fmi2SetInteger, const int *)
NO_VALUES(fmi2SetBoolean, const Boolean *)
NO_VALUES(fmi2SetString, const char *const *)
