"""Train a rear-steering policy by augmented random search, and compare it with the package's controllers.

    python examples/train_rear_steer.py train     about 8 minutes on two cores: policy.npz, learning_curve.png
    python examples/train_rear_steer.py train --resume    the same again, from the policy that is stored
    python examples/train_rear_steer.py evaluate  the table of docs/learning.md, for the evaluation and the final set
    activesteer run sine_with_dwell -c "examples/train_rear_steer.py:Policy?weights=policy.npz"

Objective, declared before training: the geometric mean over the manoeuvres of the policy's mean cost over the mean cost
of the same cars without control. A manoeuvre in which cars are lost therefore counts no more than another one. The
search minimises the objective on the training cars; the best policy on the evaluation cars is stored; the final cars
are used for neither.

Each direction of the search is one car of a batch (H. Mania, A. Guy, B. Recht, Simple random search of static linear
policies is competitive for reinforcement learning, NeurIPS 2018). Only numpy is needed.
"""

from __future__ import annotations

import argparse
import math
import time
from types import SimpleNamespace
from typing import Any

import numpy as np

from activesteer import ActuatorCommand, Batch
from activesteer.learning.tasks import TASKS, sampled_overrides  # with the extra [gym]

MANEUVERS = {"sine_with_dwell": 4.5, "double_lane_change": 7.5}
"""Manoeuvre -> time after which nothing happens any more [s]."""
INTERVAL, INTERVAL_S = 10, 0.01
LIMIT_RAD = math.radians(3.0)
LOST_COST = 60.0
"""Cost of each second after a car has been lost."""
DIRECTIONS, BEST, STEP, NOISE, CARS = 8, 4, 0.1, 0.1, 2
TRAINING, EVALUATION, FINAL = 1, 1001, 2001
"""Seeds of the cars: the last set is used neither for training nor for selection."""


def features(front_rad: Any, measurement: Any, memory: Any) -> Any:
    """Return what the policy sees, in units in which each number is about one; arrays or numbers.

    Args:
        front_rad: The driver's angle at the road wheels [rad].
        measurement: A `Measurement`.
        memory: Lagged driver's angle, changed here: attribute `front_rad`.
    """
    speed = np.maximum(measurement.speed_mps, 3.0)
    memory.front_rad = memory.front_rad + INTERVAL_S / 0.06 * (front_rad - memory.front_rad)
    gain = speed / 2.6 / (1.0 + (speed / 25.0) ** 2)
    wanted = np.clip(gain * memory.front_rad, -8.0 / speed, 8.0 / speed)
    error = measurement.yaw_rate_radps - wanted
    slide = measurement.ay_mps2 / speed - measurement.yaw_rate_radps  # rate of the sideslip angle
    memory.sideslip_rad = 0.98 * memory.sideslip_rad + INTERVAL_S * slide
    fast = speed / 25.0
    return np.stack(
        [
            memory.front_rad / 0.05, memory.front_rad / 0.05 * fast, measurement.yaw_rate_radps / 0.3, error / 0.2,
            np.clip(error / 0.2, -1.0, 1.0) * np.abs(error / 0.2), slide / 0.2, memory.sideslip_rad / 0.1,
            measurement.ay_mps2 / 8.0,
        ],
        axis=-1,
    )  # fmt: skip


def angle(weights: Any, seen: Any) -> Any:
    """Return the rear angle [rad], limited to 3 deg."""
    return LIMIT_RAD * np.tanh(np.sum(weights * seen, axis=-1))


class Policy:
    """The trained policy as a controller of the package."""

    interval_s = INTERVAL_S

    def __init__(self, weights: str = "policy.npz") -> None:
        """Load the weights."""
        with np.load(weights) as file:
            self._weights = file["weights"]
        self._memory = SimpleNamespace(front_rad=0.0, sideslip_rad=0.0)

    def step(self, command: Any, measurement: Any) -> ActuatorCommand:
        """Return the demanded rear angle."""
        seen = features(command.front_steer_demand_rad, measurement, self._memory)
        return ActuatorCommand(rear_steer_demand_rad=float(angle(self._weights, seen)))


class Cars:
    """Cars of one manoeuvre, driven with one policy each, or by a controller of the package."""

    def __init__(self, maneuver: str, overrides: list[dict[str, Any]], controller: str = "none") -> None:
        """Build the cars, and keep their start."""
        self.batch = Batch(maneuver, len(overrides), controller, overrides=overrides)
        self._end_s = MANEUVERS[maneuver]

    def drive(self, weights: Any = None) -> dict[str, Any]:
        """Drive once, and return cost and results of each car.

        Args:
            weights: Weights of each car's policy, shape (n, features); None for the controller of the package.
        """
        batch, count = self.batch, len(self.batch)
        batch.reset()
        memory = SimpleNamespace(front_rad=np.zeros(count), sideslip_rad=np.zeros(count))
        cost, peak, measured = np.zeros(count), np.zeros(count), batch.measurement
        lost = np.zeros(count, dtype=bool)
        while (going := ~(batch.done | lost | (batch.time_s > self._end_s))).any():
            command = None
            if weights is not None:
                rear = angle(weights, features(batch.driver_command.front_steer_demand_rad, measured, memory))
                command = ActuatorCommand(rear_steer_demand_rad=rear)
            measured = batch.advance(INTERVAL, actuator_command=command, cars=going)
            motion = batch.motion
            sideslip = np.abs(np.arctan2(motion.lateral_speed_mps, np.maximum(motion.speed_mps, 1.0)))
            sideslip = np.where(np.isfinite(sideslip), sideslip, 1.5)
            front = batch.driver_command.front_steer_demand_rad
            gain = motion.speed_mps / 2.6 / (1.0 + (motion.speed_mps / 25.0) ** 2)
            most = 8.0 / np.maximum(motion.speed_mps, 3.0)
            wanted = np.clip(gain * front, -most, most)
            error = np.nan_to_num(measured.yaw_rate_radps - wanted, nan=1.0)
            rear = np.nan_to_num(batch.actuator_command.rear_steer_demand_rad)
            slid, missed = np.minimum(sideslip, 0.6) / 0.1, np.clip(error, -1.0, 1.0) / 0.2
            cost += going * INTERVAL_S * (slid**2 + missed**2 + 0.02 * (rear / LIMIT_RAD) ** 2)
            now_lost = going & (sideslip > 0.5)
            cost += now_lost * LOST_COST * (self._end_s - batch.time_s)
            lost |= now_lost
            peak = np.maximum(peak, sideslip)
        return {"cost": cost, "peak_rad": peak, "lost": lost}


def cars_of(maneuver: str, count: int, seed: int) -> list[dict[str, Any]]:
    """Draw cars, frictions and drivers from the ranges of the package's population, half of them on a worse road."""
    task = next(task for task in TASKS.values() if task.maneuver == maneuver)
    drawn = sampled_overrides(task, "compact", count, seed)
    rng = np.random.default_rng(seed)
    for car in drawn:
        car["road.mu"] = float(rng.uniform(0.7, 0.95))
    return drawn


def train(minutes: float, seed: int, path: str, *, resume: bool) -> None:
    """Train, store the policy that is best on the evaluation cars, and the learning curve."""
    rng, start = np.random.default_rng(seed), time.perf_counter()
    fleets = [Cars(name, cars_of(name, CARS, TRAINING) * (2 * DIRECTIONS)) for name in MANEUVERS]
    check = [Cars(name, cars_of(name, 8, EVALUATION)) for name in MANEUVERS]
    plain = [fleet.drive()["cost"].mean() for fleet in check]
    weights, curve, round_ = np.zeros(8), [], 0
    if resume:
        with np.load(path) as file:
            weights, curve, round_ = file["weights"], file["curve"].tolist(), int(file["rounds"])
        start -= curve[-1][0]
        minutes += curve[-1][0] / 60.0
    best, best_cost = weights, min((cost for _, cost in curve), default=math.inf)
    while (passed := time.perf_counter() - start) < 60.0 * minutes:
        if round_ % 5 == 0:
            costs = [fleet.drive(np.tile(weights, (len(fleet.batch), 1)))["cost"].mean() for fleet in check]
            ratios = np.divide(costs, plain)
            cost = float(np.exp(np.log(ratios).mean()))
            curve.append((passed, cost))
            if cost < best_cost:
                best, best_cost = weights.copy(), cost
            told = ", ".join(f"{name} {ratio:.4f}" for name, ratio in zip(MANEUVERS, ratios, strict=True))
            print(f"{passed:5.0f} s  round {round_:3d}  objective {cost:7.4f} ({told})", flush=True)
        directions = rng.standard_normal((DIRECTIONS, len(weights)))
        tried = np.repeat(np.concatenate([weights + NOISE * directions, weights - NOISE * directions]), CARS, axis=0)
        means = [fleet.drive(tried)["cost"].reshape(2, DIRECTIONS, CARS).mean(axis=2) for fleet in fleets]
        plus, minus = np.log(means).mean(axis=0)
        chosen = np.argsort(np.minimum(plus, minus))[:BEST]
        spread = np.std(np.concatenate([plus[chosen], minus[chosen]])) + 1e-9
        weights = weights - STEP / (BEST * spread) * ((plus - minus)[chosen] @ directions[chosen])
        round_ += 1
    np.savez(path, weights=best, curve=np.array(curve), rounds=round_)
    print(f"{path}: objective {best_cost:.4f} after {passed:.0f} s, weights {np.round(best, 3).tolist()}")


def evaluate(path: str, count: int) -> None:
    """Print the table: controllers and policy on cars that were not trained with."""
    with np.load(path) as file:
        weights = file["weights"]
    print("| set | manoeuvre | controller | mean cost | worst cost | mean sideslip peak | lost | harm |")
    print("|---|---|---|---|---|---|---|---|")
    for label, seed in (("evaluation", EVALUATION), ("final", FINAL)):
        for name in MANEUVERS:
            overrides, plain = cars_of(name, count, seed), None
            for controller in ("none", "ars", "lqr", "learned"):
                fleet = Cars(name, overrides, "none" if controller == "learned" else controller)
                found = fleet.drive(np.tile(weights, (count, 1)) if controller == "learned" else None)
                cost = found["cost"]
                plain = cost if plain is None else plain
                print(
                    f"| {label} | {name} | {controller} | {cost.mean():.2f} | {cost.max():.2f} | "
                    f"{math.degrees(found['peak_rad'].mean()):.1f} deg | {int(found['lost'].sum())} of {count} | "
                    f"{int((cost > 1.05 * plain).sum())} of {count} |",
                    flush=True,
                )


def picture(path: str, output: str) -> None:
    """Draw the learning curve."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - only for the picture

    with np.load(path) as file:
        seconds, cost = file["curve"].T
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(seconds / 60.0, cost)
    axes.set(
        xlabel="training time [min]",
        ylabel="mean cost over that without control",
        title="Learned rear steering",
        yscale="log",
    )
    axes.grid(visible=True, alpha=0.3)
    figure.savefig(output, dpi=130)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["train", "evaluate"])
    parser.add_argument("--minutes", type=float, default=8.0)
    parser.add_argument("--resume", action="store_true")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cars", type=int, default=32)
    parser.add_argument("--weights", default="policy.npz")
    options = parser.parse_args()
    if options.what == "train":
        train(options.minutes, options.seed, options.weights, resume=options.resume)
        picture(options.weights, "learning_curve.png")
    else:
        evaluate(options.weights, options.cars)
