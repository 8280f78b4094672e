"""Steer a running simulation from another process by the messages of docs/udp.md.

Start first: activesteer run straight_line --set duration_s=20 --realtime --udp 5005
"""

import math
import socket
import struct

COMMAND = struct.Struct("<4sIII12d")
STATE = struct.Struct("<4sIII24d")
DRIVES, CONTROLS, RESTARTS = 1, 2, 4

link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
link.settimeout(1.0)
rear_rad, time_s, speed_mps, sequence, answered = 0.0, 0.0, 0.0, 0, False
while answered or sequence < 60:  # for a minute, while the run gets ready
    wheel_rad = math.radians(20.0) * math.sin(2.0 * math.pi * 0.5 * time_s)
    driver = wheel_rad, 100.0, 0.0, 0.0, 1.0  # steering wheel, drive torque, brake pedal, parking brake, gear
    controller = rear_rad, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0  # rear angle, superposition, brake torques, drive torque change
    flags = DRIVES | CONTROLS | (0 if answered else RESTARTS)
    link.sendto(COMMAND.pack(b"ASC1", sequence, flags, 0, *driver, *controller), ("127.0.0.1", 5005))
    sequence += 1
    try:
        magic, used, state_flags, step, time_s, speed_mps, yaw_rate_radps, *_ = STATE.unpack(link.recv(STATE.size))
    except TimeoutError:
        if answered:
            break  # the run has ended
        continue
    answered, rear_rad = True, 0.05 * yaw_rate_radps
print(f"{sequence} commands sent; the last state is of {time_s:.3f} s, {3.6 * speed_mps:.1f} km/h")
