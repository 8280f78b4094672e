"""Speed of many cars in one native call, by their number."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any, Final

from activesteer.simulation.batch import Batch

SIZES: Final = (1, 16, 256, 1024)
"""Numbers of cars."""
_MEASURED: Final = 256
"""Number of cars of the figures without a number of cars in their names."""
_CAR_STEPS: Final = 51_200
"""Car-steps of one measurement."""
_INTERVAL: Final = 10
"""Steps between two calls of the vectorised controller."""


def bench_batch(rounds: int = 5) -> dict[str, float]:
    """Measure batches of cars in the sine with dwell, with ideal sensors, and keep the best of some interleaved rounds.

    Returns:
        `batch_cpu_us_per_car_step` (processor time, native code alone, one thread), `batch_cpu_us_two_threads` (the
        same with two threads), `batch_threads_2_speedup` (by the clock), `batch_car_steps_per_s` (all processors, with
        measurements and the vectorised `ars` every 10 ms); these four for 256 cars, and with the number of cars in the
        name for all `SIZES`; `batch_MB_per_car`.
    """
    found: dict[str, float] = {}
    for size in SIZES:
        before, threads = _memory_MB(), os.cpu_count() or 1
        batch = Batch("sine_with_dwell", size, threads=threads)
        held = _memory_MB() - before
        start, controller = batch.save_state(), batch.vectorised("ars", _INTERVAL * 1e-3)
        steps = max(_INTERVAL, _CAR_STEPS // size // _INTERVAL * _INTERVAL)
        steps = min(steps, int(batch.steps[0]) // _INTERVAL * _INTERVAL)
        best: dict[str, tuple[float, float]] = {}
        for _ in range(rounds):
            for name, count, controlled in (("one", 1, False), ("two", 2, False), ("controlled", threads, True)):
                batch.restore_state(start)
                batch.threads = count
                wall, cpu = time.perf_counter(), time.process_time()
                if controlled:
                    measurement = batch.measurement
                    for _ in range(steps // _INTERVAL):
                        command = controller.step(batch.driver_command, measurement)
                        measurement = batch.advance(_INTERVAL, actuator_command=command)
                else:
                    batch.advance(steps)
                spent = time.perf_counter() - wall, time.process_time() - cpu
                known = best.get(name, spent)
                best[name] = min(known[0], spent[0]), min(known[1], spent[1])
        total = size * steps
        figures = {
            "batch_car_steps_per_s": total / best["controlled"][0],
            "batch_cpu_us_per_car_step": best["one"][1] / total * 1e6,
            "batch_cpu_us_two_threads": best["two"][1] / total * 1e6,
            "batch_threads_2_speedup": best["one"][0] / best["two"][0],
        }
        found |= {f"{name}_{size}": value for name, value in figures.items()}
        if size == _MEASURED:
            found = figures | found
        if size == SIZES[-1]:
            found["batch_MB_per_car"] = held / size
    return found


def _memory_MB() -> float:
    """Return the memory that this process holds [MB]; 0 where the system does not tell."""
    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
    except (OSError, ValueError, AttributeError):
        return 0.0


def table_of(found: dict[str, Any]) -> str:
    """Return the results as a table, a line for each number of cars."""
    head = f"{'cars':>6} {'us/car-step':>12} {'2 threads':>10} {'speed-up':>9} {'car-steps/s':>12}"
    lines = [head]
    for size in SIZES:
        us, two, speedup, rate = (
            found[f"batch_{name}_{size}"]
            for name in ("cpu_us_per_car_step", "cpu_us_two_threads", "threads_2_speedup", "car_steps_per_s")
        )
        lines.append(f"{size:6d} {us:12.2f} {two:10.2f} {speedup:9.2f} {rate:12.0f}")
    return "\n".join([*lines, f"memory {found['batch_MB_per_car']:.2f} MB per car"])
