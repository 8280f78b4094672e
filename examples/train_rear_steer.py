"""Train a rear-steering policy by augmented random search, and compare it with the package's controllers.

    python examples/train_rear_steer.py train     about 3 minutes on two idle cores: policy.npz, learning_curve.png
    python examples/train_rear_steer.py evaluate  the table of docs/learning.md, for the evaluation and the final set
    activesteer run sine_with_dwell -c "examples/train_rear_steer.py:Policy?weights=policy.npz"

Objective, declared before training: the mean over manoeuvres and cars of

    x + h max(x, 0),  x = ln(cost with the policy / cost of the same car without control)

so that a manoeuvre in which cars are lost counts no more than another one, and harm costs more than a gain elsewhere
brings: with h = ln 2 / ln 1.05, a car whose cost grows by 5 % outweighs one whose cost halves. The search minimises the
objective on the training cars; the best policy on the evaluation cars is stored; the final cars are used for neither.
The number of rounds and the seed determine the result, whatever the machine does besides.

Each direction of the search is some cars of a batch (H. Mania, A. Guy, B. Recht, Simple random search of static linear
policies is competitive for reinforcement learning, NeurIPS 2018); steps and noise fall with the rounds. Only numpy is
needed.
"""

from __future__ import annotations

import argparse
import math
import time
from types import SimpleNamespace
from typing import Any

import numpy as np

from activesteer import ActuatorCommand, Batch
from activesteer.learning.episodes import TASKS, sampled_overrides  # with the extra [gym]

MANEUVERS = {"sine_with_dwell": 4.5, "double_lane_change": 7.5}
"""Manoeuvre -> time after which nothing happens any more [s]."""
INTERVAL, INTERVAL_S = 10, 0.01
LIMIT_RAD = math.radians(3.0)
LOST_COST = 60.0
"""Cost of each second after a car has been lost."""
DIRECTIONS, BEST, STEP, NOISE, CARS = 8, 4, 0.1, 0.1, 3
HALVING = 10
"""Rounds after which steps and noise are half as large as at the start; after twice as many, a third."""
HARM = 1.05
"""Cost over that of the same car without control from which the car is harmed."""
N_FEATURES = 8
TRAINING, EVALUATION, FINAL = 1, 1001, 2001
"""Seeds of the cars: the last set is used neither for training nor for selection."""


def features(front_rad: Any, measurement: Any, memory: Any) -> Any:
    """Return what the policy sees, arrays or numbers, in units in which each number is about one.

    All of them are errors of the car. A part of the driver's angle, of the yaw rate or of the lateral acceleration
    would fit the cars of the training, and harm others: a rear angle of 0.05 times the driver's angle changes the cost
    of the lane change by -3 to 62 %, from car to car.

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
    # An ordinary manoeuvre stays within the bands, a sliding car does not.
    wrong, sliding = _beyond(error, 0.1), _beyond(memory.sideslip_rad, 0.035)
    return np.stack(
        [
            error / 0.2, error / 0.2 * fast, np.clip(error / 0.2, -1.0, 1.0) * np.abs(error / 0.2), slide / 0.2,
            memory.sideslip_rad / 0.1, memory.sideslip_rad / 0.1 * fast, wrong / 0.2, sliding / 0.1,
        ],
        axis=-1,
    )  # fmt: skip


def _beyond(value: Any, band: float) -> Any:
    """Return the part of a value outside a band about zero."""
    return value - np.clip(value, -band, band)


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


def objective(found: list[Any], plain: list[Any]) -> Any:
    """Return the objective of each policy.

    Args:
        found: For each manoeuvre the costs, shape (policies, cars).
        plain: For each manoeuvre the costs of the cars without control, shape (cars,).
    """
    worse = math.log(2.0) / math.log(HARM)
    changes = [np.log(costs / bare) for costs, bare in zip(found, plain, strict=True)]
    return np.mean([(change + worse * np.maximum(change, 0.0)).mean(axis=-1) for change in changes], axis=0)


def train(rounds: int, seed: int, path: str) -> None:
    """Train, store the policy that is best on the evaluation cars, and the learning curve."""
    rng, start = np.random.default_rng(seed), (time.perf_counter(), time.process_time())
    fleets = [Cars(name, cars_of(name, CARS, TRAINING) * (2 * DIRECTIONS)) for name in MANEUVERS]
    check = [Cars(name, cars_of(name, 8, EVALUATION)) for name in MANEUVERS]
    trained_bare = [fleet.drive()["cost"][:CARS] for fleet in fleets]
    bare = [fleet.drive()["cost"] for fleet in check]
    weights, curve, best, best_cost = np.zeros(N_FEATURES), [], np.zeros(N_FEATURES), math.inf
    for round_ in range(rounds + 1):
        if round_ % 5 == 0:
            costs = [fleet.drive(np.tile(weights, (len(fleet.batch), 1)))["cost"] for fleet in check]
            cost = float(objective(costs, bare))
            curve.append((round_, cost))
            if cost < best_cost:
                best, best_cost = weights.copy(), cost
            np.savez(path, weights=best, curve=np.array(curve))
            told = ", ".join(
                f"{name} {np.mean(one):.3f}, {int((one > HARM * other).sum())} harmed"
                for name, one, other in zip(MANEUVERS, costs, bare, strict=True)
            )
            wall, processor = time.perf_counter() - start[0], time.process_time() - start[1]
            print(
                f"{wall:4.0f} s ({processor:4.0f} s of processors) round {round_:3d}: {cost:7.3f} ({told})", flush=True
            )
        if round_ == rounds:
            break
        smaller = 1.0 / (1.0 + round_ / HALVING)
        directions = rng.standard_normal((DIRECTIONS, N_FEATURES))
        change = smaller * NOISE * directions
        tried = np.repeat(np.concatenate([weights + change, weights - change]), CARS, axis=0)
        costs = [fleet.drive(tried)["cost"].reshape(2, DIRECTIONS, CARS) for fleet in fleets]
        plus, minus = objective(costs, trained_bare)
        chosen = np.argsort(np.minimum(plus, minus))[:BEST]
        spread = np.std(np.concatenate([plus[chosen], minus[chosen]])) + 1e-9
        weights = weights - smaller * STEP / (BEST * spread) * ((plus - minus)[chosen] @ directions[chosen])
    print(f"{path}: objective {best_cost:.3f}, weights {np.round(best, 3).tolist()}")


def evaluate(path: str, count: int) -> None:
    """Print the table: controllers and policy on cars that were not trained with."""
    with np.load(path) as file:
        weights = np.tile(file["weights"], (count, 1))
    print("| set | manoeuvre | controller | mean cost | worst cost | mean sideslip peak | lost | harm | largest harm |")
    print("|---|---|---|---|---|---|---|---|---|")
    for label, seed in (("evaluation", EVALUATION), ("final", FINAL)):
        for name in MANEUVERS:
            overrides = cars_of(name, count, seed)
            plain = Cars(name, overrides)
            bare = plain.drive()
            results = {"none": bare, **{one: Cars(name, overrides, one).drive() for one in ("ars", "lqr")}}
            for controller, found in (results | {"learned": plain.drive(weights)}).items():
                cost, more = found["cost"], found["cost"] - bare["cost"]
                worst = int(np.argmax(cost / bare["cost"]))
                harm = f"{more[worst]:.3f} ({100.0 * more[worst] / bare['cost'][worst]:.0f} %)"
                print(
                    f"| {label} | {name} | {controller} | {cost.mean():.3f} | {cost.max():.3f} | "
                    f"{math.degrees(found['peak_rad'].mean()):.1f} deg | {int(found['lost'].sum())} of {count} | "
                    f"{int((cost > HARM * bare['cost']).sum())} of {count} | {harm if more[worst] > 0.0 else 'none'} |",
                    flush=True,
                )


def picture(path: str, output: str) -> None:
    """Draw the learning curve."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - only for the picture

    with np.load(path) as file:
        rounds, objectives = file["curve"].T
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(rounds, objectives, marker="o")
    best = np.argmin(objectives)
    axes.plot(rounds[best], objectives[best], "o", color="tab:red", label="stored policy")
    axes.legend()
    axes.set(
        xlabel="round", ylabel="objective, evaluation set (smaller is better)", title="Learned rear steering, seed 0"
    )
    axes.grid(visible=True, alpha=0.3)
    figure.savefig(output, dpi=130)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["train", "evaluate"])
    parser.add_argument("--rounds", type=int, default=25)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cars", type=int, default=32)
    parser.add_argument("--weights", default="policy.npz")
    options = parser.parse_args()
    if options.what == "train":
        train(options.rounds, options.seed, options.weights)
        picture(options.weights, "learning_curve.png")
    else:
        evaluate(options.weights, options.cars)
