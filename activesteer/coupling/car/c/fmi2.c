/* FMI 2.0 co-simulation. */
#include "car.h"
#include "fmi.h"

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static void say2(Instance *c, const char *message) {
    const Callbacks *callbacks = c->callbacks;
    if (callbacks && callbacks->logger) callbacks->logger(callbacks->environment, c->name, ERROR, "error", "%s", message);
}

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }
API int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const *categories) { return OK; }
API void *fmi2Instantiate(const char *name, int kind, const char *guid, const char *resources, const Callbacks *callbacks, int visible, int logging) {
    Instance *c = new_instance(name, say2, callbacks);
    if (!c || kind != 1) return discarded(c, "only co-simulation is possible");
    return made(c, guid);
}
API void fmi2FreeInstance(void *c) { free_instance(c); }
API int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop, double stop) { return is_in(c, INSTANTIATED, "SetupExperiment") ? OK : ERROR; }
API int fmi2EnterInitializationMode(void *c) { return enter_initialization(c); }
API int fmi2ExitInitializationMode(void *c) { return exit_initialization(c); }
API int fmi2Terminate(void *c) { return terminate(c); }
API int fmi2Reset(void *c) { return reset(c); }
API int fmi2GetReal(void *c, const uint32_t *r, size_t n, double *y) { return get_reals(c, r, n, y); }
API int fmi2SetReal(void *c, const uint32_t *r, size_t n, const double *u) { return set_reals(c, r, n, u); }
API int fmi2DoStep(void *c, double time_s, double step_s, int no_set_state) { return do_step(c, step_s); }
API int fmi2GetFMUstate(void *c, void **s) { return get_state(c, s); }
API int fmi2SetFMUstate(void *c, void *s) { return set_state(c, s); }
API int fmi2FreeFMUstate(void *c, void **s) { return free_state(s); }
API int fmi2SerializedFMUstateSize(void *c, void *s, size_t *size) { return *size = as_state_size(car_of(c)), OK; }
API int fmi2SerializeFMUstate(void *c, void *s, char *bytes, size_t size) { return to_bytes(c, s, bytes, size); }
API int fmi2DeSerializeFMUstate(void *c, const char *bytes, size_t size, void **s) { return from_bytes(c, bytes, size, s); }
API int fmi2GetStatus(void *c, int kind, int *value) { return DISCARD; }
API int fmi2GetRealStatus(void *c, int kind, double *value) { return DISCARD; }
API int fmi2GetIntegerStatus(void *c, int kind, int *value) { return DISCARD; }
API int fmi2GetBooleanStatus(void *c, int kind, int *value) { return DISCARD; }
API int fmi2GetStringStatus(void *c, int kind, const char **value) { return DISCARD; }
NONE(fmi2GetInteger) NONE(fmi2GetBoolean) NONE(fmi2GetString) NONE(fmi2SetInteger) NONE(fmi2SetBoolean) NONE(fmi2SetString)
MISSING(fmi2GetDirectionalDerivative) MISSING(fmi2SetRealInputDerivatives) MISSING(fmi2GetRealOutputDerivatives) MISSING(fmi2CancelStep)
