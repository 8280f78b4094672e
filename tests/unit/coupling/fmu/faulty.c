/* A controller that fails in the way that its parameter names, one second after its initialisation. */
#include <math.h>
#define VARIABLES(V) \
    V(YAW_RATE, "yaw_rate", input, Real, 0.0, "deg/s", "without the ending of its unit, in degrees") \
    V(ANGLE, "rear_steer_demand", output, Real, 0.0, "deg", "twice the yaw rate") \
    V(FAULT, "fault", parameter, Real, 0.0, "", "0 none, 1 not finite, 2 discard, 3 error, 4 fatal, 5 crash, 6 hang, 7 too large")
#define MEMORY 1
#include "fmu.h"

static int law(Instance *c, double step_s) {
    int fault = (c->memory[0] += step_s) > 1.0 ? (int)c->v[FAULT] : 0;
    c->v[ANGLE] = fault == 1 ? NAN : fault == 7 ? 100.0 : 0.002 * c->v[YAW_RATE];
    if (fault == 5) *(volatile int *)8 = 1;
    while (fault == 6) {}
    return fault >= DISCARD && fault <= FATAL ? fault : OK;
}
