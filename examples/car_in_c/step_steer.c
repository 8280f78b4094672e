/* A step steer with the exported car: prints time, yaw rate and lateral acceleration, then repeats the end from a state.

       activesteer export compact --header -o car
       cc -Icar step_steer.c -o step_steer car/libactivesteer_car.so -Wl,-rpath,car -Wl,-rpath-link,car -lm
       ./step_steer

   Guide: docs/fmu_car.md. */
#include "activesteer_car.h"
#include <stdio.h>
#include <stdlib.h>

static int failed(const as_car *car) {
    fprintf(stderr, "%s\n", as_message(car));
    return 1;
}

int main(void) {
    as_car *car = as_create();
    if (!car) return failed(NULL);
    int wheel = as_find("steering_wheel_demand_rad"), yaw_rate = as_find("yaw_rate_radps"), ay = as_find("ay_mps2");

    void *state = NULL;
    size_t size = as_state_size(car);
    for (int step = 0; step < 3000; step++) {
        /* 0.5 rad to the left within 0.1 s, beginning after 0.5 s. */
        double fraction = (step - 500) / 100.0;
        if (as_set(car, wheel, 0.5 * (fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction))) return failed(car);
        if (as_step(car, 1)) return failed(car);
        if (step % 250 == 249)
            printf("%5.2f s  %8.5f rad/s  %7.4f m/s2\n", (step + 1) * as_timestep_s(), as_get(car, yaw_rate), as_get(car, ay));
        if (step == 1999) {
            state = malloc(size);
            if (!state || as_save(car, state, size)) return failed(car);
        }
    }
    double end = as_get(car, yaw_rate);
    if (as_restore(car, state, size) || as_step(car, 1000)) return failed(car);
    printf("from the saved state: %s\n", as_get(car, yaw_rate) == end ? "equal" : "different");
    free(state);
    as_free(car);
    return 0;
}
