/* A car of activesteer as a C library. Units are SI and radians, axes and signs those of ISO 8855 (x forward, y left,
   z up; left positive). The variables, with units and meanings, stand in variables.csv beside this file.

   Cars are independent of each other and may be driven in different threads, each by one thread at a time. Functions
   that return an int return 0 for success; `as_message` then says why not. No function ends the process, not even for
   NULL instead of a car, name or state. */
#ifndef ACTIVESTEER_CAR_H
#define ACTIVESTEER_CAR_H
#include <stddef.h>
#ifdef __cplusplus
extern "C" {
#endif

typedef struct as_car as_car;

as_car *as_create(void);                                 /* A car at its start; NULL on failure. */
void as_free(as_car *car);
const char *as_message(const as_car *car);               /* The last failure; for NULL that of `as_create` in this thread. */

int as_count(void);                                      /* Number of variables. */
const char *as_name(int variable);                       /* Name of a variable, NULL if there is none. */
int as_find(const char *name);                           /* Variable of a name; -1 if there is none. */

int as_set(as_car *car, int variable, double value);     /* Set an input, or a parameter before the first step. */
double as_get(const as_car *car, int variable);          /* Value of any variable; NaN if there is none. */
int as_step(as_car *car, int steps);                     /* Advance by a number of steps of as_timestep_s(). */
double as_timestep_s(void);                              /* Length of a step [s]. */
int as_reset(as_car *car);                               /* Back to the start, inputs and parameters too. */

size_t as_state_size(const as_car *car);                 /* Bytes of a state. */
int as_save(as_car *car, void *state, size_t size);
int as_restore(as_car *car, const void *state, size_t size);

#ifdef __cplusplus
}
#endif
#endif
