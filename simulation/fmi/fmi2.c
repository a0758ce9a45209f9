/* FMI 2.0 for co-simulation. With -DSTANDARD_HEADERS the standard's headers take the place of the types below. */
#include <stdarg.h>
#include <stddef.h>
#include "unit.h"

#if defined(STANDARD_HEADERS)
#include "fmi2Functions.h"
#else
typedef void *fmi2Component, *fmi2ComponentEnvironment, *fmi2FMUstate;
typedef unsigned int fmi2ValueReference;
typedef double fmi2Real;
typedef int fmi2Integer, fmi2Boolean;
typedef char fmi2Byte;
typedef const char *fmi2String;
typedef enum { fmi2OK, fmi2Warning, fmi2Discard, fmi2Error, fmi2Fatal, fmi2Pending } fmi2Status;
typedef enum { fmi2ModelExchange, fmi2CoSimulation } fmi2Type;
typedef enum { fmi2DoStepStatus, fmi2PendingStatus, fmi2LastSuccessfulTime, fmi2Terminated } fmi2StatusKind;
typedef void (*fmi2CallbackLogger)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);
typedef struct {
    fmi2CallbackLogger logger;
    void *(*allocateMemory)(size_t, size_t);
    void (*freeMemory)(void *);
    void (*stepFinished)(fmi2ComponentEnvironment, fmi2Status);
    fmi2ComponentEnvironment componentEnvironment;
} fmi2CallbackFunctions;
typedef struct {
    fmi2Boolean newDiscreteStatesNeeded, terminateSimulation, nominalsOfContinuousStatesChanged;
    fmi2Boolean valuesOfContinuousStatesChanged, nextEventTimeDefined;
    fmi2Real nextEventTime;
} fmi2EventInfo;
#endif

#define REFERENCES const fmi2ValueReference

static void report(const Unit *unit, const char *message) {
    fmi2CallbackLogger logger = (fmi2CallbackLogger)unit->logger;
    if (logger) logger(unit->environment, unit->name, fmi2Error, "logStatusError", message); /* No % in it. */
}

/* A call to no instance is an error too. */
#define CALL(c, done) ((c) ? (fmi2Status)(done) : fmi2Error)

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }

API fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                  const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Unit *unit = type == fmi2CoSimulation ? unit_made(name, guid) : NULL;
    (void)resources; (void)visible; (void)logging;
    if (!unit) {
        if (callbacks && callbacks->logger)
            callbacks->logger(callbacks->componentEnvironment, name ? name : "", fmi2Error, "logStatusError",
                              "not instantiated: expected co-simulation and the guid of modelDescription.xml");
        return NULL;
    }
    if (callbacks) {
        unit->logger = (void (*)(void))callbacks->logger;
        unit->environment = callbacks->componentEnvironment;
    }
    unit->report = report;
    return unit;
}

API void fmi2FreeInstance(fmi2Component c) { unit_freed(c); }

API fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)on; (void)n; (void)categories;
    return CALL(c, OK);
}

API fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                                   fmi2Boolean has_stop, fmi2Real stop) {
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    return CALL(c, unit_started_at(c, start));
}
API fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return CALL(c, unit_initialising(c)); }
API fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return CALL(c, unit_initialised(c)); }
API fmi2Status fmi2Terminate(fmi2Component c) { return CALL(c, unit_terminated(c)); }
API fmi2Status fmi2Reset(fmi2Component c) { return CALL(c, unit_reset(c)); }

API fmi2Status fmi2GetReal(fmi2Component c, REFERENCES r[], size_t n, fmi2Real values[]) {
    return CALL(c, unit_get(c, r, n, values));
}
API fmi2Status fmi2SetReal(fmi2Component c, REFERENCES r[], size_t n, const fmi2Real values[]) {
    return CALL(c, unit_set(c, r, n, values));
}
API fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, REFERENCES r[], size_t n, const fmi2Integer orders[],
                                           const fmi2Real values[]) {
    size_t k;
    for (k = 0; c && k < n; ++k) {
        unsigned rate = r[k] + RATES - INPUTS;
        if (r[k] < INPUTS || r[k] >= RATES || orders[k] != 1)
            return unit_failed(c, "an input derivative is refused; expected first derivatives of inputs");
        if (unit_set(c, &rate, 1, &values[k]) != OK) return fmi2Error;
    }
    return CALL(c, OK);
}
API fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, REFERENCES r[], size_t n, const fmi2Integer orders[],
                                            fmi2Real values[]) {
    return CALL(c, unit_output_derivatives(c, r, n, orders, values));
}
API fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, REFERENCES unknowns[], size_t n_unknowns,
                                            REFERENCES knowns[], size_t n_knowns, const fmi2Real seed[],
                                            fmi2Real sensitivity[]) {
    return CALL(c, unit_directional(c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity));
}

API fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean final) {
    fmi2Status status = CALL(c, unit_step(c, time, size));
    int i;
    (void)final;
    /* An input derivative holds for one communication step. */
    for (i = 0; status == fmi2OK && i < N_U; ++i) ((Unit *)c)->state.rate[i] = 0.0;
    return status;
}
API fmi2Status fmi2CancelStep(fmi2Component c) { return unit_failed(c, "steps are never pending"); }

API fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return CALL(c, unit_get_state(c, state)); }
API fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return CALL(c, unit_set_state(c, state)); }
API fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) { return CALL(c, unit_free_state(c, state)); }
API fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    return CALL(c, unit_stored_size(c, state, size));
}
API fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    return CALL(c, unit_stored(c, state, bytes, size));
}
API fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    return CALL(c, unit_restored(c, bytes, size, state));
}

/* Steps end before they return: there is no status to ask for but the time reached. */
API fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (!c || kind != fmi2LastSuccessfulTime) return unit_failed(c, "expected fmi2LastSuccessfulTime");
    *value = ((Unit *)c)->state.time;
    return fmi2OK;
}
#define NO_STATUS(name, type) \
    API fmi2Status name(fmi2Component c, const fmi2StatusKind kind, type *value) { \
        (void)kind; (void)value; \
        return unit_failed(c, #name ": steps are never pending"); \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)

#define NO_VALUES(name, type) \
    API fmi2Status name(fmi2Component c, REFERENCES r[], size_t n, type values[]) { \
        (void)r; (void)values; \
        return n ? unit_failed(c, #name ": the unit has no variable of this type") : OK; \
    }
NO_VALUES(fmi2GetInteger, fmi2Integer)
NO_VALUES(fmi2GetBoolean, fmi2Boolean)
NO_VALUES(fmi2GetString, fmi2String)
NO_VALUES(fmi2SetInteger, const fmi2Integer)
NO_VALUES(fmi2SetBoolean, const fmi2Boolean)
NO_VALUES(fmi2SetString, const fmi2String)

/* Model exchange is not offered; some importers want its functions all the same. */
#define REFUSES(name, ...) \
    API fmi2Status name(fmi2Component c, __VA_ARGS__) { return unit_failed(c, #name ": co-simulation only"); }
#define REFUSES_ALONE(name) \
    API fmi2Status name(fmi2Component c) { return unit_failed(c, #name ": co-simulation only"); }
REFUSES_ALONE(fmi2EnterEventMode)
REFUSES_ALONE(fmi2EnterContinuousTimeMode)
REFUSES(fmi2NewDiscreteStates, fmi2EventInfo *info)
REFUSES(fmi2CompletedIntegratorStep, fmi2Boolean final, fmi2Boolean *event, fmi2Boolean *terminate)
REFUSES(fmi2SetTime, fmi2Real time)
REFUSES(fmi2SetContinuousStates, const fmi2Real x[], size_t n)
REFUSES(fmi2GetDerivatives, fmi2Real dx[], size_t n)
REFUSES(fmi2GetEventIndicators, fmi2Real z[], size_t n)
REFUSES(fmi2GetContinuousStates, fmi2Real x[], size_t n)
REFUSES(fmi2GetNominalsOfContinuousStates, fmi2Real x[], size_t n)
