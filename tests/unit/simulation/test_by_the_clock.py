"""Runs by the clock, and commands of another process; nothing here depends on how fast the machine is."""

from __future__ import annotations

import gc
import math
import shutil
import socket
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from activesteer import Simulation
from activesteer.coupling.udp import COMMAND, STATE, UdpLink, UdpPort
from activesteer.errors import ManeuverError, ParameterError

SHORT = {"duration_s": 0.2, "settle_s": 0.1}
EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture
def client() -> Iterator[socket.socket]:
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.settimeout(5.0)
    yield link
    link.close()


def command(sequence: int, flags: int = 3, wheel_rad: float = 0.1, rear_rad: float = 0.01, gear: float = 1.0) -> bytes:
    return COMMAND.pack(b"ASC1", sequence, flags, 0, wheel_rad, 0.0, 0.0, 0.0, gear, rear_rad, *[0.0] * 6)


def linked(reaction: str = "release", timeout_s: float = 60.0) -> Simulation:
    return Simulation(
        "straight_line", overrides=SHORT, link=UdpLink(UdpPort(0, timeout_s=timeout_s, reaction=reaction))
    )


def address_of(simulation: Simulation) -> tuple[str, int]:
    link: Any = simulation._link
    return link.address


def test_a_paced_run_is_the_same_and_reports_its_clock() -> None:
    paced, free = (Simulation("straight_line", overrides=SHORT, realtime=factor) for factor in (20.0, False))
    for simulation in (paced, free):
        simulation.run()
    found = paced.recording()
    assert np.array_equal(found.values, free.recording().values)
    told = found.metadata["realtime"]
    assert told["steps"] == 200
    assert 0.0 <= told["jitter_p50_s"] <= told["jitter_p99_s"] <= told["jitter_max_s"]
    with pytest.raises(ParameterError, match="realtime"):
        Simulation("straight_line", overrides=SHORT, realtime=1e9)


def test_commands_act_and_the_state_comes_back(client: socket.socket) -> None:
    simulation = linked()
    assert address_of(simulation)[0] == "127.0.0.1"
    client.sendto(command(7), address_of(simulation))
    simulation.advance(100)
    states = [STATE.unpack(client.recv(STATE.size)) for _ in range(100)]
    assert [state[:4] for state in states[::99]] == [(b"ASS1", 7, 0, 1), (b"ASS1", 7, 0, 100)]
    assert states[-1][4] == simulation.measurement.time_s
    assert states[-1][-8:-6] == simulation.motion[:2]
    recording = simulation.recording()
    assert recording["steering_wheel_demand_rad"][-1] == 0.1
    assert recording["rear_steer_demand_rad"][-1] == 0.01
    assert recording.metadata["commands_given"] == {"driver": 100, "controller": 100}


def test_only_newer_sound_messages_of_one_sender_count(client: socket.socket) -> None:
    simulation = linked()
    address = address_of(simulation)
    messages = [
        command(5), command(5, rear_rad=0.02), command(4, rear_rad=0.02), b"ASC1", command(6, rear_rad=math.nan),
        command(6, rear_rad=3.0), command(6, flags=64), command(9, flags=2, rear_rad=0.015), b"x" * COMMAND.size,
    ]  # fmt: skip
    for message in messages:
        client.sendto(message, address)
    simulation.step()
    other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    other.sendto(command(50, rear_rad=0.02), address)
    simulation.step()
    other.close()
    recording = simulation.recording()
    assert recording["rear_steer_demand_rad"].tolist() == [0.015, 0.015]
    assert recording["steering_wheel_demand_rad"][-1] == 0.0  # the flag of the driver is not set: the run's own drives
    assert recording.metadata["udp"] == {"received": 10, "used": 2, "lost": 3, "late": 2, "refused": 6, "timeouts": 0}


@pytest.mark.parametrize(("reaction", "rear_rad"), [("release", 0.0), ("hold", 0.01)])
def test_after_the_timeout_the_reaction_follows(client: socket.socket, reaction: str, rear_rad: float) -> None:
    simulation = linked(reaction, 0.001)
    client.sendto(command(1), address_of(simulation))
    simulation.step()
    assert simulation.recording()["rear_steer_demand_rad"][0] == 0.01
    simulation._link._received_s = -math.inf  # type: ignore[union-attr]
    simulation.step()
    recording = simulation.recording()
    assert recording["rear_steer_demand_rad"][-1] == rear_rad
    assert recording.metadata["udp"]["timeouts"] == 1


def test_the_reaction_stop_ends_the_run_and_keeps_its_rows(client: socket.socket) -> None:
    simulation = linked("stop", 0.5)
    client.sendto(command(1), address_of(simulation))
    simulation.step()
    simulation._link._received_s = -math.inf  # type: ignore[union-attr]
    with pytest.raises(ManeuverError, match=r"no command for 0\.5 s"):
        simulation.step()
    assert len(simulation.recording()) == 1


def test_the_port_is_closed_once_the_run_is_gone() -> None:
    simulation = linked()
    link: Any = simulation._link
    assert link._socket.fileno() >= 0
    del simulation
    gc.collect()
    assert link._socket.fileno() == -1


@pytest.mark.parametrize("text", ["no", "1.2.3:5", "host:5005"])
def test_what_is_no_port_is_refused(text: str) -> None:
    with pytest.raises(ParameterError, match="port"):
        UdpPort.read(text, 0.1, "hold")
    with pytest.raises(ParameterError, match="65535"):
        Simulation("straight_line", overrides=SHORT, link=UdpLink(70000))


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_the_structs_of_the_c_client_have_the_sizes_of_the_messages(tmp_path: Path) -> None:
    text = (EXAMPLES / "udp_client.c").read_text()
    check = f'_Static_assert(sizeof(struct command) == {COMMAND.size} && sizeof(struct state) == {STATE.size}, "");\n'
    (tmp_path / "client.c").write_text(text.replace("int main", check + "int main"))
    subprocess.run(["cc", "-Wall", "-Werror", "client.c", "-o", "client", "-lm"], cwd=tmp_path, check=True, timeout=60)
    assert struct.calcsize("<4sIII") == 16
