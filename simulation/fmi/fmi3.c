/* FMI 3.0 for co-simulation. With -DSTANDARD_HEADERS the standard's headers take the place of the types below. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "unit.h"

#if defined(STANDARD_HEADERS)
#include "fmi3Functions.h"
#else
typedef void *fmi3Instance, *fmi3InstanceEnvironment, *fmi3FMUState;
typedef uint32_t fmi3ValueReference;
typedef float fmi3Float32;
typedef double fmi3Float64;
typedef int8_t fmi3Int8;
typedef uint8_t fmi3UInt8, fmi3Byte;
typedef int16_t fmi3Int16;
typedef uint16_t fmi3UInt16;
typedef int32_t fmi3Int32;
typedef uint32_t fmi3UInt32;
typedef int64_t fmi3Int64;
typedef uint64_t fmi3UInt64;
typedef bool fmi3Boolean, fmi3Clock;
typedef const char *fmi3String;
typedef const fmi3Byte *fmi3Binary;
typedef enum { fmi3OK, fmi3Warning, fmi3Discard, fmi3Error, fmi3Fatal } fmi3Status;
typedef enum {
    fmi3Independent, fmi3Constant, fmi3Fixed, fmi3Tunable, fmi3Discrete, fmi3Dependent
} fmi3DependencyKind;
typedef enum { fmi3IntervalNotYetKnown, fmi3IntervalUnchanged, fmi3IntervalChanged } fmi3IntervalQualifier;
typedef void (*fmi3LogMessageCallback)(fmi3InstanceEnvironment, fmi3Status, fmi3String, fmi3String);
typedef void (*fmi3ClockUpdateCallback)(fmi3InstanceEnvironment);
typedef void (*fmi3IntermediateUpdateCallback)(fmi3InstanceEnvironment, fmi3Float64, fmi3Boolean, fmi3Boolean,
                                               fmi3Boolean, fmi3Boolean, fmi3Boolean *, fmi3Float64 *);
typedef void (*fmi3LockPreemptionCallback)();
typedef void (*fmi3UnlockPreemptionCallback)();
#endif

#define REFERENCES const fmi3ValueReference

static void report(const Unit *unit, const char *message) {
    fmi3LogMessageCallback logger = (fmi3LogMessageCallback)unit->logger;
    if (logger) logger(unit->environment, fmi3Error, "logStatusError", message);
}

/* A call to no instance is an error too, and arrays of another length than the variables'. */
#define CALL(c, done) ((c) ? (fmi3Status)(done) : fmi3Error)
#define SIZED(c, n, m, done) CALL(c, (n) == (m) ? (done) : unit_failed(c, "a scalar has one value; lengths differ"))

API const char *fmi3GetVersion(void) { return "3.0"; }

API fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                             fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
                                             fmi3Boolean early, REFERENCES intermediate[], size_t n_intermediate,
                                             fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                             fmi3IntermediateUpdateCallback update) {
    Unit *unit = events ? NULL : unit_made(name, token);
    (void)resources; (void)visible; (void)logging; (void)early; (void)intermediate; (void)n_intermediate;
    (void)update;
    if (!unit) {
        if (logger)
            logger(environment, fmi3Error, "logStatusError",
                   "not instantiated: expected the instantiationToken of modelDescription.xml and no event mode");
        return NULL;
    }
    unit->logger = (void (*)(void))logger;
    unit->environment = environment;
    unit->report = report;
    return unit;
}
API fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                              fmi3Boolean visible, fmi3Boolean logging,
                                              fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger) {
    (void)name; (void)token; (void)resources; (void)visible; (void)logging;
    if (logger) logger(environment, fmi3Error, "logStatusError", "the unit is for co-simulation only");
    return NULL;
}
API fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                   fmi3Boolean visible, fmi3Boolean logging,
                                                   fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                                   fmi3ClockUpdateCallback update, fmi3LockPreemptionCallback lock,
                                                   fmi3UnlockPreemptionCallback unlock) {
    (void)update; (void)lock; (void)unlock;
    return fmi3InstantiateModelExchange(name, token, resources, visible, logging, environment, logger);
}
API void fmi3FreeInstance(fmi3Instance c) { unit_freed(c); }

API fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    (void)on; (void)n; (void)categories;
    return CALL(c, OK);
}
API fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                           fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
    (void)has_tolerance; (void)tolerance; (void)has_stop; (void)stop;
    return CALL(c, unit_started_at(c, start) == OK ? unit_initialising(c) : FAILED);
}
API fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return CALL(c, unit_initialised(c)); }
API fmi3Status fmi3Terminate(fmi3Instance c) { return CALL(c, unit_terminated(c)); }
API fmi3Status fmi3Reset(fmi3Instance c) { return CALL(c, unit_reset(c)); }

API fmi3Status fmi3GetFloat64(fmi3Instance c, REFERENCES r[], size_t n, fmi3Float64 values[], size_t m) {
    return SIZED(c, n, m, unit_get(c, r, n, values));
}
API fmi3Status fmi3SetFloat64(fmi3Instance c, REFERENCES r[], size_t n, const fmi3Float64 values[], size_t m) {
    return SIZED(c, n, m, unit_set(c, r, n, values));
}
API fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, REFERENCES r[], size_t n, const fmi3Int32 orders[],
                                        fmi3Float64 values[], size_t m) {
    return SIZED(c, n, m, unit_output_derivatives(c, r, n, orders, values));
}
API fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, REFERENCES unknowns[], size_t n_unknowns,
                                            REFERENCES knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                            size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    return SIZED(c, n_knowns + n_unknowns, n_seed + n_sensitivity,
                 unit_directional(c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity));
}
API fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, REFERENCES unknowns[], size_t n_unknowns,
                                        REFERENCES knowns[], size_t n_knowns, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {
    return SIZED(c, n_knowns + n_unknowns, n_seed + n_sensitivity,
                 unit_adjoint(c, unknowns, n_unknowns, knowns, n_knowns, seed, sensitivity));
}

API fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean final,
                          fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *reached) {
    fmi3Status status = CALL(c, unit_step(c, time, size));
    (void)final;
    if (event) *event = false;
    if (terminate) *terminate = false;
    if (early) *early = false;
    if (reached && c) *reached = ((Unit *)c)->state.time;
    return status;
}

API fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) { return CALL(c, unit_get_state(c, state)); }
API fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return CALL(c, unit_set_state(c, state)); }
API fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) { return CALL(c, unit_free_state(c, state)); }
API fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    return CALL(c, unit_stored_size(c, state, size));
}
API fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    return CALL(c, unit_stored(c, state, (char *)bytes, size));
}
API fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    return CALL(c, unit_restored(c, (const char *)bytes, size, state));
}

/* What the unit does not offer: other types, clocks, events, model exchange, scheduled execution. */
#define NO_VALUES(type) \
    API fmi3Status fmi3Get##type(fmi3Instance c, REFERENCES r[], size_t n, fmi3##type values[], size_t m) { \
        (void)r; (void)values; \
        return n || m ? unit_failed(c, "fmi3Get" #type ": the unit has no variable of this type") : OK; \
    } \
    API fmi3Status fmi3Set##type(fmi3Instance c, REFERENCES r[], size_t n, const fmi3##type values[], size_t m) { \
        (void)r; (void)values; \
        return n || m ? unit_failed(c, "fmi3Set" #type ": the unit has no variable of this type") : OK; \
    }
NO_VALUES(Float32)
NO_VALUES(Int8)
NO_VALUES(UInt8)
NO_VALUES(Int16)
NO_VALUES(UInt16)
NO_VALUES(Int32)
NO_VALUES(UInt32)
NO_VALUES(Int64)
NO_VALUES(UInt64)
NO_VALUES(Boolean)
NO_VALUES(String)

#define REFUSES(name, ...) \
    API fmi3Status name(fmi3Instance c, __VA_ARGS__) { return unit_failed(c, #name " is not offered"); }
#define REFUSES_ALONE(name) \
    API fmi3Status name(fmi3Instance c) { return unit_failed(c, #name " is not offered"); }
REFUSES(fmi3GetBinary, REFERENCES a[], size_t b, size_t d[], fmi3Binary e[], size_t f)
REFUSES(fmi3SetBinary, REFERENCES a[], size_t b, const size_t d[], const fmi3Binary e[], size_t f)
REFUSES(fmi3GetClock, REFERENCES a[], size_t b, fmi3Clock d[])
REFUSES(fmi3SetClock, REFERENCES a[], size_t b, const fmi3Clock d[])
REFUSES(fmi3GetNumberOfVariableDependencies, fmi3ValueReference a, size_t *b)
REFUSES(fmi3GetVariableDependencies, fmi3ValueReference a, size_t b[], fmi3ValueReference d[], size_t e[],
        fmi3DependencyKind f[], size_t g)
REFUSES(fmi3GetIntervalDecimal, REFERENCES a[], size_t b, fmi3Float64 d[], fmi3IntervalQualifier e[])
REFUSES(fmi3GetIntervalFraction, REFERENCES a[], size_t b, fmi3UInt64 d[], fmi3UInt64 e[],
        fmi3IntervalQualifier f[])
REFUSES(fmi3GetShiftDecimal, REFERENCES a[], size_t b, fmi3Float64 d[])
REFUSES(fmi3GetShiftFraction, REFERENCES a[], size_t b, fmi3UInt64 d[], fmi3UInt64 e[])
REFUSES(fmi3SetIntervalDecimal, REFERENCES a[], size_t b, const fmi3Float64 d[])
REFUSES(fmi3SetIntervalFraction, REFERENCES a[], size_t b, const fmi3UInt64 d[], const fmi3UInt64 e[])
REFUSES(fmi3SetShiftDecimal, REFERENCES a[], size_t b, const fmi3Float64 d[])
REFUSES(fmi3SetShiftFraction, REFERENCES a[], size_t b, const fmi3UInt64 d[], const fmi3UInt64 e[])
REFUSES(fmi3UpdateDiscreteStates, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *d, fmi3Boolean *e, fmi3Boolean *f,
        fmi3Float64 *g)
REFUSES(fmi3CompletedIntegratorStep, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *d)
REFUSES(fmi3SetTime, fmi3Float64 a)
REFUSES(fmi3SetContinuousStates, const fmi3Float64 a[], size_t b)
REFUSES(fmi3GetContinuousStateDerivatives, fmi3Float64 a[], size_t b)
REFUSES(fmi3GetEventIndicators, fmi3Float64 a[], size_t b)
REFUSES(fmi3GetContinuousStates, fmi3Float64 a[], size_t b)
REFUSES(fmi3GetNominalsOfContinuousStates, fmi3Float64 a[], size_t b)
REFUSES(fmi3GetNumberOfEventIndicators, size_t *a)
REFUSES(fmi3GetNumberOfContinuousStates, size_t *a)
REFUSES(fmi3ActivateModelPartition, fmi3ValueReference a, fmi3Float64 b)
REFUSES_ALONE(fmi3EnterEventMode)
REFUSES_ALONE(fmi3EnterConfigurationMode)
REFUSES_ALONE(fmi3ExitConfigurationMode)
REFUSES_ALONE(fmi3EvaluateDiscreteStates)
REFUSES_ALONE(fmi3EnterContinuousTimeMode)
REFUSES_ALONE(fmi3EnterStepMode)
