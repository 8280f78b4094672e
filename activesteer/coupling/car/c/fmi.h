/* What both versions of FMI have in common. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OK = 0, WARNING = 1, DISCARD = 2, ERROR = 3, FATAL = 4 };
/* Functions for types that no variable has, and for what this FMU cannot do. */
#define NONE(name) API int name(void *c, const uint32_t *r, size_t n) { return n ? ERROR : OK; }
#define MISSING(name) API int name(void) { return ERROR; }

/* Modes of an instance; a call in a wrong mode is an error. */
enum { INSTANTIATED = 1, INITIALIZING = 2, STEPPING = 4, TERMINATED = 8 };

typedef struct Instance Instance;
struct Instance {
    as_car *car;
    int mode;
    char *name;
    void (*say)(Instance *, const char *);
    const void *callbacks;
    void *environment;
};

static as_car *car_of(void *c) { return c ? ((Instance *)c)->car : NULL; }

static void free_instance(void *instance) {
    Instance *c = instance;
    if (!c) return;
    as_free(c->car);
    free(c->name);
    free(c);
}

static Instance *new_instance(const char *name, void (*say)(Instance *, const char *), const void *callbacks) {
    Instance *c = calloc(1, sizeof *c);
    if (!c) return NULL;
    c->name = strdup(name ? name : "car");
    c->say = say;
    c->callbacks = callbacks;
    return c;
}

static void *discarded(Instance *c, const char *why) {
    if (c) c->say(c, why);
    free_instance(c);
    return NULL;
}

static void *made(Instance *c, const char *token) {
    if (!c) return NULL;
    if (!token || strcmp(token, TOKEN)) return discarded(c, "the token of the description is not that of this library");
    c->mode = INSTANTIATED;
    c->car = as_create();
    return c->car ? c : discarded(c, as_message(NULL));
}

static int status(void *c, int failure) {
    if (failure && c) ((Instance *)c)->say(c, as_message(car_of(c)));
    return failure ? ERROR : OK;
}

static int is_in(Instance *c, int modes, const char *call) {
    if (!c) return 0;
    if (c->mode & modes) return 1;
    char message[128];
    snprintf(message, sizeof message, "%s in a wrong order of calls", call);
    c->say(c, message);
    return 0;
}

static int enter_initialization(Instance *c) {
    if (!is_in(c, INSTANTIATED, "EnterInitializationMode")) return ERROR;
    c->mode = INITIALIZING;
    return OK;
}

static int exit_initialization(Instance *c) {
    if (!is_in(c, INITIALIZING, "ExitInitializationMode")) return ERROR;
    if (status(c, as_settle(c->car))) return ERROR;
    c->mode = STEPPING;
    return OK;
}

static int terminate(Instance *c) {
    if (!is_in(c, STEPPING, "Terminate")) return ERROR;
    c->mode = TERMINATED;
    return OK;
}

static int reset(Instance *c) {
    if (!c) return ERROR;
    c->mode = INSTANTIATED;
    return status(c, as_reset(c->car));
}

static int get_reals(void *c, const uint32_t *references, size_t n, double *values) {
    if (!c) return ERROR;
    for (size_t i = 0; i < n; i++) {
        if (references[i] >= (uint32_t)as_count()) return ERROR;
        values[i] = as_get(car_of(c), (int)references[i]);
    }
    return OK;
}

static int set_reals(void *c, const uint32_t *references, size_t n, const double *values) {
    for (size_t i = 0; i < n; i++) {
        int reference = references[i] < (uint32_t)as_count() ? (int)references[i] : -1;
        if (status(c, as_set(car_of(c), reference, values[i]))) return ERROR;
    }
    return OK;
}

static int do_step(void *c, double step_s) {
    if (!is_in(c, STEPPING, "DoStep")) return ERROR;
    double steps = step_s / as_timestep_s();
    if (!(steps > 0.5 && steps < 1e6) || fabs(steps - rint(steps)) > 1e-6) {
        char message[128];
        snprintf(message, sizeof message, "a step of %g s; a multiple of %g s is needed", step_s, as_timestep_s());
        ((Instance *)c)->say(c, message);
        return ERROR;
    }
    return status(c, as_step(car_of(c), (int)rint(steps)));
}

static int get_state(void *c, void **state) {
    if (!c) return ERROR;
    size_t size = as_state_size(car_of(c));
    if (!*state && !(*state = malloc(size))) return ERROR;
    return status(c, as_save(car_of(c), *state, size));
}

static int set_state(void *c, void *state) { return status(c, as_restore(car_of(c), state, as_state_size(car_of(c)))); }

static int free_state(void **state) {
    free(*state);
    *state = NULL;
    return OK;
}

static int to_bytes(void *c, void *state, char *bytes, size_t size) {
    if (size < as_state_size(car_of(c))) return ERROR;
    memcpy(bytes, state, as_state_size(car_of(c)));
    return OK;
}

static int from_bytes(void *c, const char *bytes, size_t size, void **state) {
    if (size != as_state_size(car_of(c)) || (!*state && !(*state = malloc(size)))) return ERROR;
    memcpy(*state, bytes, size);
    return OK;
}
