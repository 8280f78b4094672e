/* Steer a running simulation from another process, as examples/udp_client.py does: cc -O2 udp_client.c -o udp_client -lm */
#include <arpa/inet.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/time.h>
struct command { char magic[4]; uint32_t sequence, flags, zero; double driver[5], controller[7]; };
struct state { char magic[4]; uint32_t sequence, flags, step; double measurement[16], motion[6], spare[2]; };
int main(void) {
    struct sockaddr_in run = {.sin_family = AF_INET, .sin_port = htons(5005)};
    struct timeval patience = {.tv_sec = 1};
    struct command command = {.magic = {'A', 'S', 'C', '1'}};
    struct state state = {0};
    int answered = 0, link = socket(AF_INET, SOCK_DGRAM, 0);
    inet_pton(AF_INET, "127.0.0.1", &run.sin_addr);
    setsockopt(link, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    for (; answered || command.sequence < 60; command.sequence++) {                /* for a minute, while the run gets ready */
        command.flags = 1 | 2 | (answered ? 0 : 4);                                /* driver, controller, numbering anew */
        command.driver[0] = 0.35 * sin(2.0 * M_PI * 0.5 * state.measurement[0]);   /* steering wheel [rad] */
        command.driver[1] = 100.0;                                                 /* drive torque [N m] */
        command.driver[4] = 1.0;                                                   /* gear */
        command.controller[0] = 0.05 * state.measurement[2];                       /* rear angle [rad] from the yaw rate */
        sendto(link, &command, sizeof command, 0, (struct sockaddr *)&run, sizeof run);
        if (recv(link, &state, sizeof state, 0) == sizeof state) answered = 1;
        else if (answered) break;                                                  /* the run has ended */
    }
    printf("%u commands sent; the last state is of %.3f s\n", command.sequence + answered, state.measurement[0]);
    return 0;
}
