/* A co-simulation FMU around a control law, for FMI 2.0 (-DFMI=2) and FMI 3.0 (-DFMI=3). Needs no header of the standard.

   A law defines VARIABLES before it includes this file, and the function law() after it:

       #define VARIABLES(V) \
           V(SPEED, "speed_mps", input, Real, 0.0, "m/s", "longitudinal speed") ...
       #define MEMORY 1
       #include "fmu.h"
       static int law(Instance *c, double step_s) { ...; return OK; }

   The value reference of a variable is its place in the list. build.py reads the same list and writes the description. */
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define PLACE(name, ...) name,
enum { VARIABLES(PLACE) N_VARIABLES };
#define START(name, text, causality, type, start, ...) start,
static const double STARTS[] = {VARIABLES(START)};

/* All that changes during a run, so that a copy of it is the state. */
typedef struct {
    double v[N_VARIABLES];
    double memory[MEMORY];
} Instance;

enum { OK = 0, DISCARD = 2, ERROR = 3, FATAL = 4 };
static int law(Instance *c, double step_s);

#define API __attribute__((visibility("default")))

static int reset(Instance *c) {
    memcpy(c->v, STARTS, sizeof STARTS);
    memset(c->memory, 0, sizeof c->memory);
    return OK;
}

static Instance *make(const char *token) {
    Instance *c = strcmp(token, TOKEN) ? NULL : malloc(sizeof *c);
    if (c) reset(c);
    return c;
}

static int known(const uint32_t *references, size_t n) {
    for (size_t i = 0; i < n; i++)
        if (references[i] >= N_VARIABLES) return 0;
    return 1;
}

static int get_reals(Instance *c, const uint32_t *references, size_t n, double *values) {
    if (!known(references, n)) return ERROR;
    for (size_t i = 0; i < n; i++) values[i] = c->v[references[i]];
    return OK;
}

static int set_reals(Instance *c, const uint32_t *references, size_t n, const double *values) {
    if (!known(references, n)) return ERROR;
    for (size_t i = 0; i < n; i++) c->v[references[i]] = values[i];
    return OK;
}

static int get_state(Instance *c, void **state) {
    if (!*state) *state = malloc(sizeof *c);
    if (!*state) return ERROR;
    memcpy(*state, c, sizeof *c);
    return OK;
}

static int set_state(Instance *c, void *state) {
    memcpy(c, state, sizeof *c);
    return OK;
}

static int free_state(void **state) {
    free(*state);
    *state = NULL;
    return OK;
}

static int to_bytes(void *state, char *bytes, size_t size) {
    if (size < sizeof(Instance)) return ERROR;
    memcpy(bytes, state, sizeof(Instance));
    return OK;
}

static int from_bytes(const char *bytes, size_t size, void **state) {
    if (size != sizeof(Instance)) return ERROR;
    return get_state((Instance *)bytes, state);
}

/* Functions that the standard demands and these FMUs do not need. */
#define MISSING(name) API int name(void) { return ERROR; }

#if FMI == 2
API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }
API int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *categories) { return OK; }
API void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources, const void *callbacks,
                          int visible, int logging) { return kind == 1 ? make(guid) : NULL; }
API void fmi2FreeInstance(void *c) { free(c); }
API int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop) { return OK; }
API int fmi2EnterInitializationMode(void *c) { return OK; }
API int fmi2ExitInitializationMode(void *c) { return OK; }
API int fmi2Terminate(void *c) { return OK; }
API int fmi2Reset(void *c) { return reset(c); }
API int fmi2GetReal(void *c, const uint32_t *r, size_t n, double *y) { return get_reals(c, r, n, y); }
API int fmi2SetReal(void *c, const uint32_t *r, size_t n, const double *u) { return set_reals(c, r, n, u); }
API int fmi2GetBoolean(void *c, const uint32_t *r, size_t n, int *y) {
    if (!known(r, n)) return ERROR;
    for (size_t i = 0; i < n; i++) y[i] = ((Instance *)c)->v[r[i]] != 0.0;
    return OK;
}
API int fmi2DoStep(void *c, double time_s, double step_s, int no_return) { return law(c, step_s); }
API int fmi2GetFMUstate(void *c, void **s) { return get_state(c, s); }
API int fmi2SetFMUstate(void *c, void *s) { return set_state(c, s); }
API int fmi2FreeFMUstate(void *c, void **s) { return free_state(s); }
API int fmi2SerializedFMUstateSize(void *c, void *s, size_t *size) { *size = sizeof(Instance); return OK; }
API int fmi2SerializeFMUstate(void *c, void *s, char *bytes, size_t size) { return to_bytes(s, bytes, size); }
API int fmi2DeSerializeFMUstate(void *c, const char *bytes, size_t size, void **s) { return from_bytes(bytes, size, s); }
MISSING(fmi2GetInteger) MISSING(fmi2GetString) MISSING(fmi2SetInteger) MISSING(fmi2SetBoolean) MISSING(fmi2SetString)
MISSING(fmi2GetDirectionalDerivative) MISSING(fmi2SetRealInputDerivatives) MISSING(fmi2GetRealOutputDerivatives)
MISSING(fmi2CancelStep) MISSING(fmi2GetStatus) MISSING(fmi2GetRealStatus) MISSING(fmi2GetIntegerStatus)
MISSING(fmi2GetBooleanStatus) MISSING(fmi2GetStringStatus)
#else
API const char *fmi3GetVersion(void) { return "3.0"; }
API int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const *categories) { return OK; }
API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                      bool logging, bool events, bool early, const uint32_t *intermediate, size_t n,
                                      void *environment, const void *log, const void *update) { return make(token); }
MISSING(fmi3InstantiateScheduledExecution)
API void *fmi3InstantiateModelExchange(void) { return NULL; }
API void fmi3FreeInstance(void *c) { free(c); }
API int fmi3EnterInitializationMode(void *c, bool has_tolerance, double tolerance, double start, bool has_stop, double stop) { return OK; }
API int fmi3ExitInitializationMode(void *c) { return OK; }
API int fmi3Terminate(void *c) { return OK; }
API int fmi3Reset(void *c) { return reset(c); }
API int fmi3GetFloat64(void *c, const uint32_t *r, size_t n, double *y, size_t values) { return n == values ? get_reals(c, r, n, y) : ERROR; }
API int fmi3SetFloat64(void *c, const uint32_t *r, size_t n, const double *u, size_t values) { return n == values ? set_reals(c, r, n, u) : ERROR; }
API int fmi3GetBoolean(void *c, const uint32_t *r, size_t n, bool *y, size_t values) {
    if (n != values || !known(r, n)) return ERROR;
    for (size_t i = 0; i < n; i++) y[i] = ((Instance *)c)->v[r[i]] != 0.0;
    return OK;
}
API int fmi3DoStep(void *c, double time_s, double step_s, bool no_set_state, bool *event, bool *terminate, bool *early, double *last) {
    *event = *terminate = *early = false;
    *last = time_s + step_s;
    return law(c, step_s);
}
API int fmi3GetFMUState(void *c, void **s) { return get_state(c, s); }
API int fmi3SetFMUState(void *c, void *s) { return set_state(c, s); }
API int fmi3FreeFMUState(void *c, void **s) { return free_state(s); }
API int fmi3SerializedFMUStateSize(void *c, void *s, size_t *size) { *size = sizeof(Instance); return OK; }
API int fmi3SerializeFMUState(void *c, void *s, char *bytes, size_t size) { return to_bytes(s, bytes, size); }
API int fmi3DeserializeFMUState(void *c, const char *bytes, size_t size, void **s) { return from_bytes(bytes, size, s); }
MISSING(fmi3EnterEventMode) MISSING(fmi3EnterConfigurationMode) MISSING(fmi3ExitConfigurationMode) MISSING(fmi3EnterStepMode)
MISSING(fmi3GetFloat32) MISSING(fmi3GetInt8) MISSING(fmi3GetUInt8) MISSING(fmi3GetInt16) MISSING(fmi3GetUInt16)
MISSING(fmi3GetInt32) MISSING(fmi3GetUInt32) MISSING(fmi3GetInt64) MISSING(fmi3GetUInt64) MISSING(fmi3GetString)
MISSING(fmi3GetBinary) MISSING(fmi3GetClock) MISSING(fmi3SetFloat32) MISSING(fmi3SetInt8) MISSING(fmi3SetUInt8)
MISSING(fmi3SetInt16) MISSING(fmi3SetUInt16) MISSING(fmi3SetInt32) MISSING(fmi3SetUInt32) MISSING(fmi3SetInt64)
MISSING(fmi3SetUInt64) MISSING(fmi3SetBoolean) MISSING(fmi3SetString) MISSING(fmi3SetBinary) MISSING(fmi3SetClock)
MISSING(fmi3GetNumberOfVariableDependencies) MISSING(fmi3GetVariableDependencies) MISSING(fmi3GetDirectionalDerivative)
MISSING(fmi3GetAdjointDerivative) MISSING(fmi3GetIntervalDecimal) MISSING(fmi3GetIntervalFraction)
MISSING(fmi3GetShiftDecimal) MISSING(fmi3GetShiftFraction) MISSING(fmi3SetIntervalDecimal) MISSING(fmi3SetIntervalFraction)
MISSING(fmi3SetShiftDecimal) MISSING(fmi3SetShiftFraction) MISSING(fmi3EvaluateDiscreteStates) MISSING(fmi3UpdateDiscreteStates)
MISSING(fmi3EnterContinuousTimeMode) MISSING(fmi3CompletedIntegratorStep) MISSING(fmi3SetTime) MISSING(fmi3SetContinuousStates)
MISSING(fmi3GetContinuousStateDerivatives) MISSING(fmi3GetEventIndicators) MISSING(fmi3GetContinuousStates)
MISSING(fmi3GetNominalsOfContinuousStates) MISSING(fmi3GetNumberOfEventIndicators) MISSING(fmi3GetNumberOfContinuousStates)
MISSING(fmi3GetOutputDerivatives) MISSING(fmi3ActivateModelPartition)
#endif
