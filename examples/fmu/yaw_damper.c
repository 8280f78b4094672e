/* A yaw damper for the rear wheels: the controller of ../own_controller.py, written in C. */
#define VARIABLES(V) \
    V(YAW_RATE, "yaw_rate_radps", input, Real, 0.0, "rad/s", "yaw rate, left positive") \
    V(ANGLE, "rear_steer_demand_rad", output, Real, 0.0, "rad", "rear wheel angle, left positive") \
    V(SATURATED, "saturated", output, Boolean, 0.0, "", "whether the limit is active") \
    V(GAIN, "gain_s", parameter, Real, 0.05, "s", "rear angle per fast change of the yaw rate") \
    V(WASHOUT, "washout_s", parameter, Real, 0.3, "s", "time constant of the filter") \
    V(LIMIT, "limit_rad", parameter, Real, 0.05235987755982989, "rad", "largest angle")
#define MEMORY 1
#include "fmu.h"

static int law(Instance *c, double step_s) {
    double quick = c->v[YAW_RATE] - c->memory[0], limit = c->v[LIMIT];
    c->memory[0] += step_s / c->v[WASHOUT] * quick;
    double angle = c->v[GAIN] * quick;
    c->v[SATURATED] = angle > limit || angle < -limit;
    c->v[ANGLE] = angle > limit ? limit : angle < -limit ? -limit : angle;
    return OK;
}
