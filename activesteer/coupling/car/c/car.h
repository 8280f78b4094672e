/* Shared by the car and its FMI interfaces. */
#ifndef CAR_H
#define CAR_H
#define API __attribute__((visibility("default")))
#pragma GCC visibility push(default)
#include "activesteer_car.h"
#pragma GCC visibility pop
int as_settle(as_car *car); /* Apply changed parameters. */
#endif
