/* Active front steering of the paper (Dorsch 2012, section V.B): the built-in controller `afs`, written in C.

   The same operations in the same order as activesteer/controllers/front_superposition.py, so that a run equals the
   run with the built-in controller to the last bit. The start values are those of the compact. */
#include <math.h>

#define VARIABLES(V) \
    V(FRONT_STEER, "front_steer_demand_rad", input, Real, 0.0, "rad", "driver's steering demand at the road wheels, left positive") \
    V(SPEED, "speed_mps", input, Real, 0.0, "m/s", "longitudinal speed") \
    V(YAW_RATE, "yaw_rate_radps", input, Real, 0.0, "rad/s", "yaw rate, left positive") \
    V(ANGLE, "superposition_demand_rad", output, Real, 0.0, "rad", "angle to add at the front road wheels, left positive") \
    V(DESIRED, "yaw_rate_desired_radps", output, Real, 0.0, "rad/s", "yaw rate that the controller aims for") \
    V(CORRECTION, "correction_rad", output, Real, 0.0, "rad", "angle before the limit") \
    V(SATURATED, "saturated", output, Boolean, 0.0, "", "whether the limit is active") \
    V(WHEELBASE, "wheelbase_m", parameter, Real, 2.6375, "m", "wheelbase") \
    V(CHARACTERISTIC_SPEED, "characteristic_speed_mps", parameter, Real, 23.894444444444446, "m/s", "characteristic speed, eq. 4") \
    V(MAX_AY, "max_lateral_acceleration_mps2", parameter, Real, 7.74, "m/s2", "limit of the desired yaw rate times the speed") \
    V(DELAY, "delay_s", parameter, Real, 0.07, "s", "time constant of the desired yaw rate") \
    V(DEADBAND_START, "deadband_start_radps", parameter, Real, 0.008726646259971648, "rad/s", "error below which there is no action") \
    V(DEADBAND_END, "deadband_end_radps", parameter, Real, 0.03490658503988659, "rad/s", "error above which there is full action") \
    V(GAIN, "proportional_gain_s", parameter, Real, 0.42, "s", "steer angle per yaw rate error") \
    V(LIMIT, "limit_rad", parameter, Real, 0.05235987755982989, "rad", "largest angle added at the road wheels")
#define MEMORY 1
#include "fmu.h"

static const double MIN_SPEED_MPS = 3.0;

/* Eqs. 3 and 6: steady state of the single-track model, friction limit, first-order lag. */
static double desired_yaw_rate(Instance *c, double step_s) {
    double speed = c->v[SPEED], ratio = speed / c->v[CHARACTERISTIC_SPEED];
    double target = speed / c->v[WHEELBASE] / (1.0 + ratio * ratio) * c->v[FRONT_STEER];
    double limit = c->v[MAX_AY] / (speed > MIN_SPEED_MPS ? speed : MIN_SPEED_MPS);
    double desired = c->memory[0];
    target = target > limit ? limit : target < -limit ? -limit : target;
    c->memory[0] += (1.0 - exp(-step_s / c->v[DELAY])) * (target - desired);
    return desired;
}

/* Fig. 9: activity of the corrector over the error. */
static double tolerance(double error, double start, double end) {
    double size = fabs(error), x = (size - start) / (end - start);
    return size <= start ? 0.0 : size >= end ? 1.0 : x * x * (3.0 - 2.0 * x);
}

static int law(Instance *c, double step_s) {
    double desired = desired_yaw_rate(c, step_s), error = desired - c->v[YAW_RATE], angle = 0.0, limit = c->v[LIMIT];
    if (c->v[SPEED] >= MIN_SPEED_MPS)
        angle = tolerance(error, c->v[DEADBAND_START], c->v[DEADBAND_END]) * (c->v[GAIN] * error);
    c->v[DESIRED] = desired;
    c->v[CORRECTION] = angle + 0.0;
    c->v[SATURATED] = fabs(angle) > limit;
    c->v[ANGLE] = angle > limit ? limit : angle < -limit ? -limit : angle + 0.0;
    return OK;
}
