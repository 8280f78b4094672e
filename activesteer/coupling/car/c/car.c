/* The car: the engine, its model, the native step, and the memory of the step, whose addresses are filled in here. */
#include "car.h"
#include <math.h>
#include <mujoco/mujoco.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(list) ((int)(sizeof(list) / sizeof *(list)))
#define HIDDEN __attribute__((visibility("hidden")))

/* A table of numbers or bytes, as the assembler puts it into the library. */
#define BINARY(name, file) \
    __asm__(".section .rodata\n.balign 64\n.globl " #name "\n.hidden " #name "\n" #name ":\n.incbin \"" file "\"\n" \
            ".globl " #name "_end\n.hidden " #name "_end\n" #name "_end:\n.byte 0\n.previous\n"); \
    extern const char name[], name##_end[];
BINARY(as_model, "model.mjb")
BINARY(as_memory, "memory.bin")
BINARY(as_state, "state.bin")
BINARY(as_seeds, "seeds.bin")

/* What the generated tables below are made of. */
enum { SEGMENT, FUNCTION, MODEL, MODEL_ARRAY, DATA, DATA_ARRAY };
typedef struct { int64_t place, kind, base, added; } Relocation;
typedef struct { int64_t kind, base, added, size; } Target;
typedef struct { int64_t tendon; double first, second, third, damping, low, high; } Force;
typedef struct { int64_t control, activation; double lag, rate, low, high, low_torque, high_torque; } Limit;
typedef struct { int64_t variable, actuator, record, has_torque, act, qpos, seized, backlash; double ratio, free_m; } Part; /* native_faults.PART */
enum { WORKS, STICKS, RUNS_LEFT, RUNS_RIGHT, FLOATS }; /* native_faults.WORKS and others */
enum { INPUT, OUTPUT, PARAMETER };
enum { FROM_ROW = 16, FROM_RESULT, FROM_FORCE, FROM_LIMIT, FROM_MOTION, FROM_INPUT };
typedef struct { const char *name; int causality, from, column; double start, low, high; } Variable;
#include "data.h" /* generated: the tables and the constants of one car */

extern void activesteer_step(intptr_t, intptr_t, intptr_t, intptr_t);
extern void activesteer_derive(intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, intptr_t);
extern void activesteer_fault(intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, double, double);
extern void activesteer_change(intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, intptr_t, double, double, intptr_t, intptr_t, intptr_t);
extern void activesteer_passive(const mjModel *, mjData *);
extern double activesteer_act_dyn(const mjModel *, const mjData *, int);
extern void activesteer_sensor(const mjModel *, mjData *, int);

/* Functions of Python's and numba's that the kernels name and never call. */
static _Thread_local jmp_buf *recovery;
static _Thread_local char reason[256];
static void fail(const char *message) {
    snprintf(reason, sizeof reason, "%s", message);
    if (recovery) longjmp(*recovery, 1);
}
#define UNUSED(name) HIDDEN void name(void) { fail("the car called " #name); }
UNUSED(PyBytes_FromStringAndSize) UNUSED(PyErr_Clear) UNUSED(PyErr_SetNone) UNUSED(PyErr_SetString) UNUSED(PyErr_WriteUnraisable)
UNUSED(PyUnicode_FromString) UNUSED(Py_DecRef) UNUSED(Py_IncRef) UNUSED(numba_do_raise) UNUSED(numba_gil_ensure)
UNUSED(numba_gil_release) UNUSED(numba_runtime_build_excinfo_struct) UNUSED(numba_unpickle) UNUSED(PyObject_Hash)
UNUSED(PyTuple_Pack) UNUSED(PyUnicode_FromKindAndData) UNUSED(NRT_Free) UNUSED(NRT_MemInfo_call_dtor) UNUSED(NRT_Allocate)
UNUSED(NRT_MemInfo_alloc) UNUSED(NRT_MemInfo_alloc_aligned) UNUSED(PyErr_Format) UNUSED(PyErr_Occurred) UNUSED(NRT_decref)
UNUSED(NRT_incref) UNUSED(PyEval_RestoreThread) UNUSED(PyEval_SaveThread) UNUSED(PyGILState_Ensure) UNUSED(PyGILState_Release)
HIDDEN void *PyExc_RuntimeError, *PyExc_StopIteration, *PyExc_SystemError, *PyExc_ValueError, *PyExc_IndexError,
    *PyExc_TypeError, *PyExc_OverflowError, *PyExc_ZeroDivisionError, *PyExc_NameError;

static double no_clock(void) { return 0.0; }
static void no_warning(const char *message) { (void)message; }

struct as_car {
    mjModel *model;
    mjData *data;
    char *memory;                        /* the records of the native step */
    double *row[N_TARGETS];              /* the arrays that a recorded row is copied from */
    double values[N_VARIABLES];          /* inputs and parameters */
    double result[1 + N_RESULT];         /* of the last step: sane, measurement, motion */
    double computed[N_FORCES + N_LIMITS + 1], motion[N_MOTION];
    double *at[N_VARIABLES];             /* where each variable is read */
    double *block;                       /* parameters of the native forces, in the model */
    double fault[N_PARTS][3];            /* kind and offset that act, and the demand at which a brake sticks */
    double healthy[N_PARTS][N_HEALTH];
    int64_t steps;
    int changed, modified, failed;       /* parameters wait for the start; the model is changed; the state is not sane */
    char message[256];
};

static _Thread_local char create_message[256];

static int refuse(as_car *c, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(c->message, sizeof c->message, format, arguments);
    va_end(arguments);
    return 1;
}

static char *address(as_car *c, int64_t kind, int64_t base, int64_t added) {
    char *model = (char *)c->model, *data = (char *)c->data;
    switch (kind) {
    case SEGMENT: return c->memory + added;
    case FUNCTION: return (char *)FUNCTIONS[base] + added;
    case MODEL: return model + added;
    case MODEL_ARRAY: return *(char **)(model + base) + added;
    case DATA: return data + added;
    default: return *(char **)(data + base) + added;
    }
}

/* Forces of springs and links, flags of the actuators, and motion, from the arrays of the last step. */
static void derive(as_car *c) {
    activesteer_derive((intptr_t)c->row, (intptr_t)SENSOR_PLACES, (intptr_t)DESIGN, (intptr_t)c->model->opt.gravity,
                       (intptr_t)FORCES, N_FORCES, (intptr_t)LIMITS, N_LIMITS, (intptr_t)c->computed, (intptr_t)c->motion);
}

static void set_friction(as_car *c, double mu) {
    for (int wheel = 0; wheel < 4; wheel++) c->block[WHEEL_MU[wheel]] = mu;
}

static double *copy(double *state, double *mine, size_t size, int save) {
    if (size) memcpy(save ? state : mine, save ? mine : state, 8 * size);
    return state + size;
}

/* Write the fault of an actuator into the model, or save its healthy numbers. */
enum { SAVE = -1 };
static void apply_fault(as_car *c, int part, int save) {
    const double *fault = c->fault[part];
    activesteer_fault((intptr_t)(PARTS + part), (intptr_t)c->block, (intptr_t)c->model->actuator_gainprm,
                      (intptr_t)c->model->actuator_biasprm, (intptr_t)c->healthy[part], save ? SAVE : (intptr_t)fault[0], fault[1], fault[2]);
}

/* Let the faults begin and end that the inputs have changed. */
static void follow_faults(as_car *c) {
    int active = 0;
    for (int part = 0; part < N_PARTS; part++) {
        const double *wanted = c->values + PARTS[part].variable, *acting = c->fault[part];
        active += wanted[0] != WORKS || wanted[1] != 0.0;
        if (wanted[0] == acting[0] && wanted[1] == acting[1]) continue;
        activesteer_change((intptr_t)(PARTS + part), (intptr_t)c->block, (intptr_t)c->model->actuator_gainprm,
                           (intptr_t)c->model->actuator_biasprm, (intptr_t)c->healthy[part], (intptr_t)acting, wanted[0], wanted[1],
                           (intptr_t)c->data->ctrl, (intptr_t)c->data->act, (intptr_t)c->data->qpos);
    }
    c->data->userdata[c->model->nuserdata - 1] = active;
}

/* What the engine prepared for its own solution is forgotten, as in drop_metric. */
static void forward(as_car *c) {
    mj_forward(c->model, c->data);
    int integrator = c->model->opt.integrator;
    c->model->opt.integrator = mjINT_EULER;
    mj_fwdPosition(c->model, c->data);
    c->model->opt.integrator = integrator;
}

static size_t state_numbers(void) {
    size_t size = STATE_SIZE + N_VARIABLES + 1 + N_RESULT + 2 + 3 * N_PARTS;
    for (int i = 0; i < N_TARGETS; i++) size += TARGETS[i].size;
    for (int i = 0; i < COUNT(KEPT); i++) size += KEPT[i].size;
    return size;
}

/* Copy the state of the car to numbers, or back. */
static void exchange(as_car *c, double *state, int save) {
    if (save) mj_getState(c->model, c->data, state, mjSTATE_INTEGRATION);
    else mj_setState(c->model, c->data, state, mjSTATE_INTEGRATION);
    state += STATE_SIZE;
    state = copy(state, c->values, N_VARIABLES, save);
    state = copy(state, c->result, 1 + N_RESULT, save);
    state = copy(state, c->fault[0], 3 * N_PARTS, save);
    for (int i = 0; i < N_TARGETS; i++) state = copy(state, c->row[i], TARGETS[i].size, save);
    for (int i = 0; i < COUNT(KEPT); i++) state = copy(state, (double *)(c->memory + KEPT[i].added), KEPT[i].size, save);
    if (save) {
        state[0] = (double)c->steps;
        state[1] = c->failed;
        return;
    }
    c->steps = (int64_t)state[0];
    c->failed = state[1] != 0.0;
    for (int w = 0; w < mjNWARNING; w++) c->data->warning[w].number = c->data->warning[w].lastinfo = 0;
    c->block[HEADER_GEAR] = NAN; /* no gear of a command: the next step engages its own */
    set_friction(c, c->values[IN_ROAD_MU]);
    for (int part = 0; part < N_PARTS; part++) apply_fault(c, part, 0);
    derive(c);
}

/* Begin a protected call: 0 at first, 1 after an error of the engine. */
#define PROTECTED(car) \
    jmp_buf here, *outer = recovery; \
    recovery = &here; \
    if (setjmp(here)) { recovery = outer; (car)->failed = 1; return refuse(car, "the engine failed: %s", reason); }
#define DONE (recovery = outer)

/* Put the memory of the native step in its place: its addresses, and where each variable is read. */
static void place_memory(as_car *c) {
    memcpy(c->memory, as_memory, as_memory_end - as_memory);
    for (int i = 0; i < N_RELOCATIONS; i++) {
        const Relocation *r = RELOCATIONS + i;
        *(char **)(c->memory + r->place) = address(c, r->kind, r->base, r->added);
    }
    for (int i = 0; i < N_TARGETS; i++) c->row[i] = (double *)address(c, TARGETS[i].kind, TARGETS[i].base, TARGETS[i].added);
    for (int i = 0; i < N_VARIABLES; i++) {
        const Variable *v = VARIABLES + i;
        switch (v->from) {
        case FROM_RESULT: c->at[i] = c->result + v->column; break;
        case FROM_FORCE: c->at[i] = c->computed + v->column; break;
        case FROM_LIMIT: c->at[i] = c->computed + N_FORCES + v->column; break;
        case FROM_MOTION: c->at[i] = c->motion + v->column; break;
        case FROM_INPUT: c->at[i] = c->values + i; break;
        default: c->at[i] = c->row[v->from] + v->column;
        }
    }
}

/* Load the model as exported, unless it is there unchanged. */
static int load(as_car *c) {
    if (c->data && !c->modified) return 0;
    if (c->data) mj_deleteData(c->data);
    if (c->model) mj_deleteModel(c->model);
    c->data = NULL;
    c->model = mj_loadModelBuffer(as_model, as_model_end - as_model);
    c->data = c->model ? mj_makeData(c->model) : NULL;
    c->modified = 0;
    if (!c->data) return refuse(c, "the model cannot be loaded");
    c->block = c->model->numeric_data + BLOCK_START;
    for (int part = 0; part < N_PARTS; part++) apply_fault(c, part, 1);
    return mj_stateSize(c->model, mjSTATE_INTEGRATION) != STATE_SIZE ? refuse(c, "the model cannot be loaded") : 0;
}

/* Go to the exported start. */
static int start(as_car *c) {
    PROTECTED(c)
    if (load(c)) return DONE, 1;
    mj_resetData(c->model, c->data);
    place_memory(c);
    mj_setState(c->model, c->data, (const double *)as_state, mjSTATE_INTEGRATION);
    forward(c);
    exchange(c, (double *)as_state, 0);
    DONE;
    c->changed = 0;
    c->message[0] = 0;
    return 0;
}

as_car *as_create(void) {
    create_message[0] = 0;
    if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
        snprintf(create_message, sizeof create_message, "the car needs a processor with AVX2 and FMA (x86-64-v3)");
        return NULL;
    }
    if (mj_version() != ENGINE_VERSION) {
        snprintf(create_message, sizeof create_message, "the car needs MuJoCo %d, not %d", ENGINE_VERSION, mj_version());
        return NULL;
    }
    mju_user_error = fail;
    mju_user_warning = no_warning;
    mjcb_passive = (mjfGeneric)activesteer_passive;
    mjcb_act_dyn = (mjfAct)activesteer_act_dyn;
    mjcb_sensor = (mjfSensor)activesteer_sensor;
    mjcb_time = no_clock;
    as_car *c = calloc(1, sizeof *c);
    if (c) c->memory = aligned_alloc(64, (as_memory_end - as_memory + 63) / 64 * 64);
    if (!c || !c->memory || start(c)) {
        snprintf(create_message, sizeof create_message, "%s", c && c->message[0] ? c->message : "there is no memory");
        as_free(c);
        return NULL;
    }
    return c;
}

void as_free(as_car *c) {
    if (!c) return;
    if (c->data) mj_deleteData(c->data);
    if (c->model) mj_deleteModel(c->model);
    free(c->memory);
    free(c);
}

const char *as_message(const as_car *c) { return c ? c->message : create_message; }
int as_count(void) { return N_VARIABLES; }
const char *as_name(int variable) { return variable >= 0 && variable < N_VARIABLES ? VARIABLES[variable].name : NULL; }
double as_timestep_s(void) { return TIMESTEP_S; }
double as_get(const as_car *c, int variable) { return c && variable >= 0 && variable < N_VARIABLES ? *c->at[variable] : NAN; }

int as_find(const char *name) {
    for (int i = 0; name && i < N_VARIABLES; i++)
        if (!strcmp(name, VARIABLES[i].name)) return i;
    return -1;
}

int as_set(as_car *c, int variable, double value) {
    if (!c) return 1;
    if (variable < 0 || variable >= N_VARIABLES) return refuse(c, "there is no variable %d; the last one is %d", variable, N_VARIABLES - 1);
    const Variable *v = VARIABLES + variable;
    if (v->causality == OUTPUT) return refuse(c, "%s is an output and cannot be set", v->name);
    if (!(v->low <= value && value <= v->high)) return refuse(c, "%s = %g; a number from %g to %g is needed", v->name, value, v->low, v->high);
    if (variable == IN_GEAR && value != rint(value)) return refuse(c, "%s = %g; -1, 0 or 1 is needed", v->name, value);
    for (int part = 0; part < N_PARTS; part++)
        if (variable == PARTS[part].variable && (value != rint(value) || (PARTS[part].has_torque && (value == RUNS_RIGHT || value == FLOATS))))
            return refuse(c, "%s = %g; %s is needed", v->name, value, PARTS[part].has_torque ? "0, 1, 2, 5 or 6" : "a whole number");
    if (v->causality == PARAMETER) {
        if (c->steps) return refuse(c, "%s is a parameter and must be set before the first step", v->name);
        c->changed |= value != c->values[variable];
    }
    c->values[variable] = value;
    if (variable == IN_ROAD_MU) set_friction(c, value);
    return 0;
}

/* Carry the inputs to the native step, and make one step. */
static int step(as_car *c) {
    double commands[N_COMMANDS];
    const double *u = c->values;
    memcpy(commands, COMMANDS, sizeof commands);
    for (int i = 0; i < N_COMMAND_INPUTS; i++) commands[COMMAND_INPUTS[i]] = u[i];
    commands[COMMAND_FRONT_STEER] = commands[COMMAND_STEERING_WHEEL] / STEERING_RATIO;
    for (int wheel = 0; wheel < 4; wheel++)
        commands[COMMAND_BRAKES + wheel] += u[IN_PRESSURES + wheel] * TORQUE_PER_PRESSURE[wheel];
    follow_faults(c);
    int torques_set = u[IN_TORQUES_SET] != 0.0;
    for (int wheel = 0; torques_set && wheel < 4; wheel++) {
        c->data->ctrl[DRIVE_CONTROLS[wheel]] = u[IN_DRIVES + wheel];
        c->data->ctrl[BRAKE_CONTROLS[wheel]] = u[IN_BRAKES + wheel];
    }
    activesteer_step((intptr_t)(c->memory + PLACE_BINDINGS), (intptr_t)commands, torques_set, (intptr_t)c->result);
    c->steps++;
    return c->result[0] == 0.0;
}

int as_step(as_car *c, int steps) {
    if (!c) return 1;
    if (c->failed) return refuse(c, "the car has failed; reset it, or restore a state");
    if (steps < 0) return refuse(c, "%d steps; 0 or more are needed", steps);
    if (c->changed && as_settle(c)) return 1;
    PROTECTED(c)
    for (int i = 0; i < steps; i++) {
        if (step(c)) {
            DONE;
            c->failed = 1;
            return refuse(c, "the state became non-finite or the engine raised a warning, %g s after the start", c->steps * TIMESTEP_S);
        }
    }
    DONE;
    derive(c);
    return 0;
}

/* Add a mass to the chassis and shift its centre of gravity; the site `cg` follows the car's, as in vehicle/load.py. */
static void load_car(as_car *c, const double *p) {
    mjModel *m = c->model;
    mjData *d = c->data;
    int b = CHASSIS;
    double before[3], axes[9], inertia[9], turned[9], quat[4], vectors[9], principal[3];
    mj_resetData(m, d);
    mj_kinematics(m, d);
    mj_comPos(m, d);
    mju_copy3(before, d->subtree_com + 3 * b);
    double own = m->body_mass[b], mass = own + p[0], *middle = m->body_ipos + 3 * b, place[3] = {p[1], p[2], p[3]};
    double whole = m->body_subtreemass[b];
    middle[0] += p[4] * whole / own;
    middle[2] += p[5] * whole / own;
    mju_quat2Mat(axes, m->body_iquat + 4 * b);
    for (int i = 0; i < 9; i++) turned[i] = axes[i] * m->body_inertia[3 * b + i % 3];
    mju_mulMatMatT(inertia, turned, axes, 3, 3, 3);
    double weights[2] = {own, p[0]}, centre[3];
    for (int i = 0; i < 3; i++) centre[i] = (own * middle[i] + p[0] * place[i]) / mass;
    for (int k = 0; k < 2; k++) {
        double o[3], square;
        mju_sub3(o, k ? place : middle, centre);
        square = mju_dot3(o, o);
        for (int i = 0; i < 9; i++) inertia[i] += weights[k] * ((i % 4 == 0 ? square : 0.0) - o[i / 3] * o[i % 3]);
    }
    mju_eig3(principal, vectors, quat, inertia);
    m->body_mass[b] = mass;
    mju_copy3(middle, centre);
    mju_copy4(m->body_iquat + 4 * b, quat);
    mju_copy3(m->body_inertia + 3 * b, principal);
    m->body_sameframe[b] = 0;
    mj_setConst(m, d);
    mj_resetData(m, d);
    mj_kinematics(m, d);
    mj_comPos(m, d);
    for (int i = 0; i < 3; i++) m->site_pos[3 * CG_SITE + i] += d->subtree_com[3 * b + i] - before[i];
    m->site_sameframe[CG_SITE] = 0;
}

/* Make the present place and heading the origin of the road, and the present instant the origin of time. */
static void rebase(as_car *c) {
    mjData *d = c->data;
    mj_kinematics(c->model, d);
    double half = atan2(d->qpos[6], d->qpos[3]), cosine = cos(2 * half), sine = sin(2 * half), turned[4];
    const double *cg = d->site_xpos + 3 * CG_SITE, back[4] = {cos(half), 0.0, 0.0, -sin(half)};
    double x = d->qpos[0] - cg[0], y = d->qpos[1] - cg[1], vx = d->qvel[0], vy = d->qvel[1];
    d->qpos[0] = cosine * x + sine * y, d->qpos[1] = -sine * x + cosine * y;
    mju_mulQuat(turned, back, d->qpos + 3);
    mju_copy4(d->qpos + 3, turned);
    d->qvel[0] = cosine * vx + sine * vy, d->qvel[1] = cosine * vy - sine * vx;
    d->time = 0.0;
    c->block[HEADER_AREAS_FELT] = 1.0;
    forward(c);
    c->result[1] = c->result[RESULT_X] = c->result[RESULT_X + 1] = c->result[RESULT_X + 2] = 0.0;
    c->steps = 0;
    derive(c);
}

/* Build the car with the changed parameters and let it settle at its speed, straight ahead. */
int as_settle(as_car *c) {
    if (!c) return 1;
    if (!c->changed) return 0;
    double values[N_VARIABLES], *u = c->values, sum = 0.0;
    const double *p = values + IN_PARAMETERS;
    memcpy(values, c->values, sizeof values);
    c->modified = 1;
    PROTECTED(c)
    if (load(c)) return DONE, 1;
    c->modified = 1;
    mj_resetData(c->model, c->data);
    place_memory(c);
    for (int axle = 0; axle < 2; axle++)
        for (int side = 0; side < 2; side++) {
            double *tyre = c->block + TYRES[2 * axle + side];
            const double *factor = p + PARAMETER_FACTORS;
            tyre[TYRE_LMUX] *= factor[0];
            tyre[TYRE_LMUY] *= factor[0];
            tyre[TYRE_LKY] *= factor[1] * factor[2 + axle];
            tyre[TYRE_LKX] *= factor[4];
        }
    if (p[1] != 0.0 || p[5] != 0.0 || p[6] != 0.0) load_car(c, p + 1);
    exchange(c, (double *)as_state, 0);
    memcpy(c->values, values, sizeof values);
    int seed = (int)p[PARAMETER_SEED];
    for (int i = 0; i < N_SENSORS; i++) {
        const double *draw = (const double *)as_seeds + 2 * (N_SENSORS * seed + i);
        *(double *)(c->memory + PLACE_SENSORS + i * SENSOR_BYTES + SENSOR_BIAS) = BIAS_RMS[i] * draw[0];
        memcpy(c->memory + PLACE_SENSORS + i * SENSOR_BYTES + SENSOR_KEY, draw + 1, 8);
    }
    mju_zero(c->data->qvel, c->model->nv);
    c->data->qvel[0] = p[0];
    for (int wheel = 0; wheel < 4; wheel++) c->data->qvel[SPIN_DOFS[wheel]] = p[0] / RADIUS_M[wheel];
    for (int i = 0; i < N_COMMAND_INPUTS; i++) u[i] = 0.0;
    u[IN_GEAR] = 1.0;
    u[IN_TORQUES_SET] = 0.0;
    for (int i = IN_PRESSURES; i < IN_TORQUES_SET; i++) u[i] = 0.0;
    for (int part = 0; part < N_PARTS; part++) u[PARTS[part].variable] = u[PARTS[part].variable + 1] = 0.0;
    set_friction(c, u[IN_ROAD_MU]);
    c->block[HEADER_AREAS_FELT] = 0.0;
    double mass = c->model->body_subtreemass[CHASSIS];
    for (int i = 0; i < SETTLING_STEPS; i++) {
        double error = p[0] - c->result[MOTION_SPEED];
        sum += error * TIMESTEP_S;
        u[IN_DRIVE] = mass * RADIUS_M[0] * (2.0 * error + sum);
        if (step(c)) {
            DONE;
            c->failed = 1;
            return refuse(c, "the car with these parameters does not settle at its start speed");
        }
    }
    double drive = u[IN_DRIVE];
    memcpy(u, values, sizeof values);
    u[IN_DRIVE] = drive;
    rebase(c);
    DONE;
    c->changed = 0;
    return 0;
}

int as_reset(as_car *c) {
    if (!c) return 1;
    c->failed = 0;
    return start(c);
}

size_t as_state_size(const as_car *c) { (void)c; return 8 * (1 + state_numbers()); }

int as_save(as_car *c, void *state, size_t size) {
    if (!c) return 1;
    if (!state || size < as_state_size(c)) return refuse(c, "a state has %zu bytes, not %zu", as_state_size(c), size);
    memcpy(state, &FINGERPRINT, 8);
    exchange(c, (double *)state + 1, 1);
    return 0;
}

int as_restore(as_car *c, const void *state, size_t size) {
    if (!c) return 1;
    if (!state || size != as_state_size(c) || memcmp(state, &FINGERPRINT, 8)) return refuse(c, "this is no state of this car");
    const double *values = (const double *)state + 1 + STATE_SIZE;
    for (int i = 0; i < N_VARIABLES; i++)
        if (VARIABLES[i].causality == PARAMETER && values[i] != c->values[i])
            return refuse(c, "the state is of a car with %s = %g, not %g", VARIABLES[i].name, values[i], c->values[i]);
    PROTECTED(c)
    exchange(c, (double *)state + 1, 0);
    DONE;
    return 0;
}
