"""Requirements on runs: comparisons of metrics, with the distance from passing.

An example is `max(0, lane_overstep_m(lqr)) - max(0, lane_overstep_m(none)) <= 0.05`. `METRIC(CONTROLLER, MANEUVER)` is
the metric of that run; the manoeuvre may be left out if there is only one. The ending of the name gives the unit: SI
units, or the units of keys in files, such as `sideslip_peak_abs_deg`. `harm(CONTROLLER)` is the largest growth of a
measure of harm against `none`, in multiples of its size (`analysis.harm`). `+ - * /`, `min`, `max` and `abs` are
allowed; comparisons may be joined by `and` and `or`. `claim(S1)` is a statement of the paper.

The *margin* of a comparison is its distance to the limit, in multiples of the limit, or in its own unit for a limit of
0. It is negative if the comparison is violated, and not defined (nan) if a metric is not. `and` takes the smallest
margin, `or` the largest.

Sources: G. Fainekos, G. Pappas, Robustness of temporal logic specifications for continuous-time signals, Theoretical
Computer Science 410 (2009); Y. Annpureddy et al., S-TaLiRo, TACAS 2011; A. Donze, Breach, CAV 2010.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

import numpy as np

from activesteer.analysis.harm import changes, severity
from activesteer.config import Source, field_in_unit
from activesteer.core.metric_table import METRICS, RENAMED
from activesteer.errors import nearest_names, shown

HARM: Final = "harm"
CLAIM: Final = "claim"
CLAIMS_FAILED: Final = "claims_failed"
"""Number of the paper's statements that fail in a manoeuvre."""
NONE: Final = "none"
ANY: Final = "controller"
"""Name in a requirement for the controller that is examined."""
_SIGNS: Final[dict[type, str]] = {ast.LtE: "<=", ast.GtE: ">=", ast.Lt: "<", ast.Gt: ">"}
_TINY: Final = 1e-12
"""Margin of violation of `<` or `>` for a value exactly at the limit."""
_LONGEST: Final = 1000
"""Largest number of characters of an expression."""


def distance(margin: float) -> float:
    """Return the distance from passing: 0 for a pass, 0.5 at one scale beyond the limit, towards 1 far beyond."""
    if margin >= 0.0:
        return 0.0
    return max(1e-6, margin / (margin - 1.0)) if math.isfinite(margin) else 1.0


def _margin(room: float, limit: float) -> float:
    return room / max(abs(limit), 1e-9) if limit and math.isfinite(room) else room


class EvaluatedRun(NamedTuple):
    """Run of a set, given by controller and manoeuvre."""

    controller: str
    maneuver: str


Runs = Mapping[EvaluatedRun, Mapping[str, float | None]]
"""Metrics of each run. A metric that the run does not define is None or nan."""


class Names(NamedTuple):
    """Names that an expression may use."""

    controllers: Sequence[str] | None  # controllers of the runs; None for any
    maneuvers: Sequence[str]  # manoeuvres of the runs
    examined: str = ""  # controller for which `controller` stands; empty if it stands for none
    claims: Mapping[str, tuple[str, str]] = {}  # statement of the paper -> metric of its distance, and its manoeuvre


_Number = Callable[[Runs], float]


class Expression:
    """Numerical expression over `metrics` with their runs, and left side, sign and right side of its `comparisons`."""

    wanted = "a sum of metrics such as yaw_rate_overshoot(ars) is needed"

    def __init__(self, text: str, names: Names, source: Source, where: tuple[str, ...]) -> None:
        """Parse an expression."""
        self.text, self._names = text, names
        self.metrics: dict[tuple[str, EvaluatedRun], None] = {}
        self.comparisons: list[tuple[_Number, str, _Number]] = []
        self._fail = lambda problem: source.fail(where, f"{problem} in {shown(self.text)}", text)
        if len(text) > _LONGEST:
            raise source.fail(where, f"has {len(text)} characters; at most {_LONGEST} are allowed")
        try:
            tree = ast.parse(text, mode="eval").body
            self._value = self._whole(tree)
        except (SyntaxError, ValueError, OverflowError, RecursionError, MemoryError):
            raise self._fail(f"cannot be read: {self.wanted}") from None
        if not self.metrics:
            raise self._fail("there is no metric of a run, such as lane_overstep_m(none),")

    def __call__(self, runs: Runs) -> float:
        """Return the value, or nan if it is not defined."""
        return self._value(runs)

    def undefined(self, runs: Runs) -> set[str]:
        """Return the controllers whose runs do not define a metric of the expression."""
        found = ((run.controller, runs[run].get(name)) for name, run in self.metrics if name != HARM)
        return {controller for controller, value in found if value is None or math.isnan(value)}

    def _whole(self, node: ast.expr) -> _Number:
        return self._number(node)

    def _number(self, node: ast.expr) -> _Number:
        if isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool):
            constant = float(node.value)
            return lambda _: constant
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            inner = self._number(node.operand)
            return lambda runs: -inner(runs)
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            act, one, other = _OPERATORS[type(node.op)], self._number(node.left), self._number(node.right)
            return lambda runs: act(one(runs), other(runs))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            name = node.func.id
            if name in _FUNCTIONS:
                function, parts = _FUNCTIONS[name], [self._number(part) for part in node.args]
                if len(parts) != 1 if name == "abs" else len(parts) < 2:
                    raise self._fail(f"{name} has {len(parts)} arguments")
                return lambda runs: function([part(runs) for part in parts])
            words = [word.id if isinstance(word, ast.Name) else getattr(word, "value", None) for word in node.args]
            if len(words) in (1, 2) and all(isinstance(word, str) for word in words):
                return self._metric(name, *map(str, words))
        raise self._fail(f"{ast.unparse(node)} is not a number, metric(controller), sum, product, min, max or abs")

    def _metric(self, name: str, controller: str, maneuver: str = "") -> _Number:
        names = self._names
        known = [HARM, CLAIMS_FAILED, *METRICS]
        if name in RENAMED:
            raise self._fail(f"{name} is now {RENAMED[name]};")
        metric, factor = field_in_unit(name, known)
        if metric is None:
            raise self._fail(f"{name}: {nearest_names(name, known)};")
        if controller == ANY and names.examined:
            controller = names.examined
        if names.controllers is not None and controller not in names.controllers:
            raise self._fail(
                f"{controller} is not a controller of the runs; {nearest_names(controller, names.controllers)};"
            )
        if not maneuver and len(names.maneuvers) == 1:
            maneuver = names.maneuvers[0]
        if maneuver not in names.maneuvers:
            problem = (
                f"{maneuver} is no manoeuvre of the runs" if maneuver else f"{name}({controller}, MANEUVER) is needed"
            )
            raise self._fail(f"{problem}; {nearest_names(maneuver, names.maneuvers)};")
        run, base = EvaluatedRun(controller, maneuver), EvaluatedRun(NONE, maneuver)
        self.metrics[metric, run] = None
        if metric == HARM:
            self.metrics[metric, base] = None
            return lambda runs: severity(changes(runs[base], runs[run]))
        value = _value_of(metric, run)
        return value if factor == 1.0 else lambda runs: value(runs) / factor


class Requirement(Expression):
    """Comparison, or comparisons joined by `and` and `or`, with a margin that is negative if violated."""

    wanted = "a comparison such as stopping_distance_m(none) <= 45 is needed"

    def _whole(self, node: ast.expr) -> _Number:
        if isinstance(node, ast.BoolOp):
            sign = 1.0 if isinstance(node.op, ast.And) else -1.0
            parts = [self._whole(part) for part in node.values]
            return lambda runs: sign * _all([sign * part(runs) for part in parts])
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == CLAIM:
            return self._claim(node)
        if not isinstance(node, ast.Compare) or not all(type(one) in _SIGNS for one in node.ops):
            raise self._fail(f"one of {', '.join(_SIGNS.values())} is needed: {self.wanted}")
        margins = [
            self._comparison(left, one, right)
            for left, one, right in zip((node.left, *node.comparators), node.ops, node.comparators, strict=False)
        ]
        return lambda runs: _all([margin(runs) for margin in margins])

    def _comparison(self, left: ast.expr, sign: ast.cmpop, right: ast.expr) -> _Number:
        """Return the margin to the limit, which is the side without a metric, or else the right side."""
        one, other = self._number(left), self._number(right)
        self.comparisons.append((one, _SIGNS[type(sign)], other))
        less, more = (one, other) if isinstance(sign, (ast.Lt, ast.LtE)) else (other, one)
        limit = other if any(isinstance(part, ast.Call) for part in ast.walk(left)) else one
        at_limit = -_TINY if isinstance(sign, (ast.Lt, ast.Gt)) else 0.0
        return lambda runs: _margin(more(runs) - less(runs), limit(runs)) or at_limit

    def _claim(self, node: ast.Call) -> _Number:
        claims = self._names.claims
        word = node.args[0].id if len(node.args) == 1 and isinstance(node.args[0], ast.Name) else ""
        if word not in claims:
            raise self._fail(
                f"{ast.unparse(node)} needs claims = true and a claim about the runs; {nearest_names(word, claims)};"
            )
        metric, maneuver = claims[word]
        run = EvaluatedRun(NONE, maneuver)
        self.metrics[metric, run] = None

        distance = _value_of(metric, run)
        return lambda runs: -distance(runs)


def _value_of(name: str, run: EvaluatedRun) -> _Number:
    return lambda runs: math.nan if (value := runs[run].get(name)) is None else value


def _ratio(one: float, other: float) -> float:
    """Divide, with an infinite quotient for a division by 0."""
    if other:
        return one / other
    return math.copysign(math.inf, one) if one else math.nan


def _all(margins: Sequence[float]) -> float:
    """Return the smallest margin, or nan if it is not known."""
    known = [margin for margin in margins if not math.isnan(margin)]
    return min(known) if len(known) == len(margins) or min(known, default=0.0) < 0.0 else math.nan


_FUNCTIONS: Final[dict[str, Callable[[Sequence[float]], float]]] = {
    "min": lambda values: float(np.min(values)), "max": lambda values: float(np.max(values)),
    "abs": lambda values: abs(values[0]),
}  # fmt: skip
"""Functions of an expression. `min` and `max` are nan if one of their values is nan."""
_OPERATORS: Final[dict[type, Callable[[float, float], float]]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: _ratio,
}  # fmt: skip
