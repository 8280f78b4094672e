/* FMI 3.0 co-simulation. */
#include "car.h"
#include "fmi.h"
#include <stdbool.h>

static void say3(Instance *c, const char *message) {
    void (*logger)(void *, int, const char *, const char *) = c->callbacks;
    if (logger) logger(c->environment, ERROR, "error", message);
}

API const char *fmi3GetVersion(void) { return "3.0"; }
API int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const *categories) { return OK; }
API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging, bool events,
                                      bool early, const uint32_t *intermediate, size_t n, void *environment, void *logger, const void *update) {
    Instance *c = new_instance(name, say3, logger);
    if (c) c->environment = environment;
    return made(c, token);
}
API void *fmi3InstantiateModelExchange(void) { return NULL; }
API void *fmi3InstantiateScheduledExecution(void) { return NULL; }
API void fmi3FreeInstance(void *c) { free_instance(c); }
API int fmi3EnterInitializationMode(void *c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop) { return enter_initialization(c); }
API int fmi3ExitInitializationMode(void *c) { return exit_initialization(c); }
API int fmi3Terminate(void *c) { return terminate(c); }
API int fmi3Reset(void *c) { return reset(c); }
API int fmi3GetFloat64(void *c, const uint32_t *r, size_t n, double *y, size_t values) { return n == values ? get_reals(c, r, n, y) : ERROR; }
API int fmi3SetFloat64(void *c, const uint32_t *r, size_t n, const double *u, size_t values) { return n == values ? set_reals(c, r, n, u) : ERROR; }
API int fmi3DoStep(void *c, double time_s, double step_s, bool no_set_state, bool *event, bool *terminate, bool *early, double *last) {
    *event = *terminate = *early = false;
    int result = do_step(c, step_s);
    *last = result == OK ? time_s + step_s : time_s;
    return result;
}
API int fmi3GetFMUState(void *c, void **s) { return get_state(c, s); }
API int fmi3SetFMUState(void *c, void *s) { return set_state(c, s); }
API int fmi3FreeFMUState(void *c, void **s) { return free_state(s); }
API int fmi3SerializedFMUStateSize(void *c, void *s, size_t *size) { return *size = as_state_size(car_of(c)), OK; }
API int fmi3SerializeFMUState(void *c, void *s, char *bytes, size_t size) { return to_bytes(c, s, bytes, size); }
API int fmi3DeserializeFMUState(void *c, const char *bytes, size_t size, void **s) { return from_bytes(c, bytes, size, s); }
NONE(fmi3GetFloat32) NONE(fmi3GetInt8) NONE(fmi3GetUInt8) NONE(fmi3GetInt16) NONE(fmi3GetUInt16) NONE(fmi3GetInt32) NONE(fmi3GetUInt32)
NONE(fmi3GetInt64) NONE(fmi3GetUInt64) NONE(fmi3GetBoolean) NONE(fmi3GetString) NONE(fmi3GetBinary) NONE(fmi3GetClock) NONE(fmi3SetFloat32)
NONE(fmi3SetInt8) NONE(fmi3SetUInt8) NONE(fmi3SetInt16) NONE(fmi3SetUInt16) NONE(fmi3SetInt32) NONE(fmi3SetUInt32) NONE(fmi3SetInt64)
NONE(fmi3SetUInt64) NONE(fmi3SetBoolean) NONE(fmi3SetString) NONE(fmi3SetBinary) NONE(fmi3SetClock)
MISSING(fmi3EnterEventMode) MISSING(fmi3EnterConfigurationMode) MISSING(fmi3ExitConfigurationMode) MISSING(fmi3EnterStepMode)
MISSING(fmi3GetNumberOfVariableDependencies) MISSING(fmi3GetVariableDependencies) MISSING(fmi3GetDirectionalDerivative)
MISSING(fmi3GetAdjointDerivative) MISSING(fmi3GetIntervalDecimal) MISSING(fmi3GetIntervalFraction) MISSING(fmi3GetShiftDecimal)
MISSING(fmi3GetShiftFraction) MISSING(fmi3SetIntervalDecimal) MISSING(fmi3SetIntervalFraction) MISSING(fmi3SetShiftDecimal)
MISSING(fmi3SetShiftFraction) MISSING(fmi3EvaluateDiscreteStates) MISSING(fmi3UpdateDiscreteStates) MISSING(fmi3EnterContinuousTimeMode)
MISSING(fmi3CompletedIntegratorStep) MISSING(fmi3SetTime) MISSING(fmi3SetContinuousStates) MISSING(fmi3GetContinuousStateDerivatives)
MISSING(fmi3GetEventIndicators) MISSING(fmi3GetContinuousStates) MISSING(fmi3GetNominalsOfContinuousStates)
MISSING(fmi3GetNumberOfEventIndicators) MISSING(fmi3GetNumberOfContinuousStates) MISSING(fmi3GetOutputDerivatives) MISSING(fmi3ActivateModelPartition)
