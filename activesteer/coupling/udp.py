"""UDP link: commands from another process, and the state of the car back to it (see docs/udp.md)."""

from __future__ import annotations

import ipaddress
import socket
import struct
import time
from collections.abc import Callable
from typing import Any, Final, NamedTuple

from activesteer.core.signals import ActuatorCommand, DriverCommand, Measurement, Motion
from activesteer.errors import ManeuverError, ParameterError

COMMAND: Final = struct.Struct("<4sIII12d")
"""Magic `ASC1`, sequence number, flags, 0. Then steering wheel, drive torque, brake pedal, parking brake, gear, rear
angle, superposition, four brake torques, and change of the drive torque."""
STATE: Final = struct.Struct("<4sIII24d")
"""Magic `ASS1`, sequence number of the command in use, flags, step; then `Measurement` and `Motion`, number by number,
and two spare numbers."""
COMMAND_MAGIC: Final = b"ASC1"
STATE_MAGIC: Final = b"ASS1"
DRIVES, CONTROLS, RESTARTS = 1, 2, 4
"""Flags of a command: use the driver's numbers, use the controller's numbers, restart the numbering."""
TIMED_OUT: Final = 1
"""Flag of a state: no command is in use."""
REACTIONS: Final = ("release", "hold", "stop")
_MOST_WAITING: Final = 1000
"""Largest number of messages read in one step."""


class UdpPort(NamedTuple):
    """Address that receives commands.

    Attributes:
        port: Port of the run.
        host: Address that the run listens on; only programs on this machine reach the default.
        timeout_s: Time without a command after which the reaction follows [s].
        reaction: `release`: the driver and the controller of the run take over; `hold`: the last command stays; `stop`:
            the run ends with an error.
    """

    port: int
    host: str = "127.0.0.1"
    timeout_s: float = 0.1
    reaction: str = "release"

    @classmethod
    def read(cls, text: str, timeout_s: float, reaction: str) -> UdpPort:
        """Parse `PORT` or `HOST:PORT`."""
        host, _, port = text.rpartition(":")
        try:
            return cls(int(port), str(ipaddress.IPv4Address(host or cls._field_defaults["host"])), timeout_s, reaction)
        except ValueError:
            raise ParameterError(
                f"{text!r}: a port such as 5005, or an IPv4 address and a port such as 127.0.0.1:5005, is needed",
                key="--udp", value=text,
            ) from None  # fmt: skip


Commands = tuple[DriverCommand | None, ActuatorCommand | None]
"""Commands in use, or None where the run's own block decides."""
_NOTHING: Final[Commands] = (None, None)


class UdpLink:
    """An open port, the `link` of a `Simulation`, with `report` for the recording."""

    name = "udp"

    def __init__(self, port: UdpPort | int) -> None:
        """Open the port.

        Args:
            port: Address and reaction; a number is a port of this machine.

        Raises:
            ParameterError: the port cannot be opened, or a value is wrong.
        """
        port = UdpPort(port) if isinstance(port, int) else port
        if not 0 <= port.port < 2**16 or not 0.001 <= port.timeout_s <= 60.0 or port.reaction not in REACTIONS:
            problem = (
                f"a port from 0 to 65535, a timeout from 0.001 to 60 s and one of {', '.join(REACTIONS)} is needed"
            )
            raise ParameterError(f"is {tuple(port)}; {problem}", key="udp", value=port)
        self.port, self._check = port, _refuse
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((port.host, port.port))
        except OSError as reason:
            self._socket.close()
            raise ParameterError(f"{port.host}:{port.port}: {reason.strerror}", key="udp", value=port) from reason
        self._socket.setblocking(False)
        self._sender: Any = None
        self._sequence: int | None = None
        self._received_s = -float("inf")
        self._now = _NOTHING
        self.report = {"received": 0, "used": 0, "lost": 0, "late": 0, "refused": 0, "timeouts": 0}
        self._timed_out = True

    @property
    def address(self) -> tuple[str, int]:
        """Address and port on which the run listens."""
        return self._socket.getsockname()

    def connect(self, check: Callable[[Commands, str], Commands]) -> None:
        """Register a function that checks commands."""
        self._check = check

    def close(self) -> None:
        """Close the port."""
        self._socket.close()

    def commands(self) -> Commands:
        """Read all waiting messages, and return the commands for the next step.

        Raises:
            ManeuverError: there was no command for too long, and the reaction is `stop`.
        """
        for _ in range(_MOST_WAITING):
            try:
                data, sender = self._socket.recvfrom(COMMAND.size + 1)
            except BlockingIOError:
                break
            except OSError:  # the other side has closed its port
                continue
            self._take(data, sender)
        if time.perf_counter() - self._received_s > self.port.timeout_s and not self._timed_out:
            self._timed_out = True
            self.report["timeouts"] += 1
            if self.port.reaction == "stop":
                problem = f"no command for {self.port.timeout_s:g} s on port {self.address[1]}"
                raise ManeuverError(f"{problem}; the run ends, because the reaction is 'stop'", key="udp")
            if self.port.reaction == "release":
                self._now = _NOTHING
        return self._now

    def _take(self, data: bytes, sender: Any) -> None:
        report = self.report
        report["received"] += 1
        if len(data) != COMMAND.size:
            report["refused"] += 1
            return
        magic, sequence, flags, _, *numbers = COMMAND.unpack(data)
        # While commands arrive, those of another sender are refused.
        foreign = not self._timed_out and sender != self._sender
        if magic != COMMAND_MAGIC or foreign or not 0 <= flags <= DRIVES | CONTROLS | RESTARTS:
            report["refused"] += 1
            return
        ahead = 1 if self._sequence is None or flags & RESTARTS or sender != self._sender else sequence - self._sequence
        ahead = (ahead + 2**31) % 2**32 - 2**31  # the number begins anew after 2^32
        if ahead <= 0:
            report["late"] += 1
            return
        try:
            wheel, drive, pedal, parking, gear, rear, front, fl, fr, rl, rr, change = numbers
            driver = controller = None
            if flags & DRIVES:
                driver = DriverCommand(wheel, drive, pedal, gear=int(gear), parking_brake=parking)
            if flags & CONTROLS:
                controller = ActuatorCommand(
                    rear, front, brake_torque_demand_Nm=(fl, fr, rl, rr), drive_torque_change_Nm=change
                )
            self._now = self._check((driver, controller), f"{self.name} gave")
        except Exception:  # not finite, or beyond the range of a car
            report["refused"] += 1
            return
        report["lost"] += ahead - 1
        report["used"] += 1
        self._sender, self._sequence, self._received_s = sender, sequence, time.perf_counter()
        self._timed_out = False

    def tell(self, step: int, measurement: Measurement, motion: Motion) -> None:
        """Send the state after a step to the sender of the commands."""
        if self._sender is None:
            return
        numbers = (*measurement[:8], *measurement.wheel_speed_radps, *measurement.brake_pressure_Pa, *motion[:6])
        flags = TIMED_OUT if self._timed_out else 0
        head = STATE_MAGIC, self._sequence or 0, flags, step % 2**32
        try:
            self._socket.sendto(STATE.pack(*head, *numbers, 0.0, 0.0), self._sender)
        except OSError:  # a full buffer, or nobody there: the next state is sent again
            return


def _refuse(commands: Commands, _: str) -> Commands:
    raise ParameterError("no run is connected", key="udp", value=commands)
