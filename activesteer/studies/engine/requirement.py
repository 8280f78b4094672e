"""Requirements on runs as text: `max(0, lane_overstep_m(lqr)) - max(0, lane_overstep_m(none)) <= 0.05`.

A requirement compares two sums of metrics. `METRIC(CONTROLLER)` is the metric of the run with that controller [SI];
`harm(CONTROLLER)` is the largest growth of a measure of harm against `none`, in multiples of its size
(`analysis.harm`). `+ - * /`, `min`, `max` and `abs` are allowed. The *robustness* of a run is the margin to the limit:
below zero the requirement is violated.

Source: Y. Annpureddy et al., S-TaLiRo, TACAS 2011; A. Donze, Breach, CAV 2010, on robustness as an objective.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any, Final

from activesteer.analysis.harm import changes, severity
from activesteer.config import Source
from activesteer.errors import nearest_names, shown
from activesteer.metric_table import METRICS, Better

HARM: Final = "harm"
NONE: Final = "none"
ANY: Final = "controller"
"""Name in a requirement for the controller that is examined."""
_LONGEST: Final = 1000
"""Largest number of characters of a requirement."""
_FUNCTIONS: Final[dict[str, Callable[..., Any]]] = {"min": min, "max": max, "abs": abs}
_OPERATORS: Final[dict[type, Callable[[float, float], float]]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip
Rows = Mapping[str, Mapping[str, float | None]]
"""Controller -> metrics of its run; empty for a run that failed."""


class Requirement:
    """A requirement."""

    def __init__(self, text: str, source: Source, where: tuple[str, ...]) -> None:
        self.text, self.controllers, self.metrics = text, list[str](), list[str]()
        self._fail = lambda problem: source.fail(where, f"{problem} in {shown(text)}", text)
        if len(text) > _LONGEST:
            raise source.fail(where, f"has {len(text)} characters; at most {_LONGEST} are allowed")
        try:
            tree = ast.parse(text, mode="eval").body
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            raise self._fail(
                "cannot be read: a comparison such as stopping_distance_m(controller) <= 45 is needed"
            ) from None
        if not isinstance(tree, ast.Compare) or len(tree.ops) != 1 or not isinstance(tree.ops[0], (ast.LtE, ast.GtE)):
            raise self._fail("one <= or >= is needed")
        left, right = self._compiled(tree.left), self._compiled(tree.comparators[0])
        self._sides = (right, left) if isinstance(tree.ops[0], ast.LtE) else (left, right)
        if not self.metrics:
            raise self._fail("there is no metric of a run, such as lane_overstep_m(controller),")

    def robustness(self, rows: Rows, examined: str) -> float:
        """Return the margin to the limit; nan if neither side is defined.

        A metric that a run does not define counts as infinitely bad. `controller` stands for the examined one.
        """
        more, less = (side(rows, examined) for side in self._sides)
        try:
            return more - less
        except (ArithmeticError, ValueError):
            return math.nan

    def _compiled(self, node: ast.expr) -> Callable[[Rows, str], float]:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float) and not isinstance(node.value, bool):
            number = float(node.value)
            return lambda _rows, _examined: number
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            inner = self._compiled(node.operand)
            return lambda rows, examined: -inner(rows, examined)
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            act, parts = _OPERATORS[type(node.op)], [self._compiled(node.left), self._compiled(node.right)]
            return lambda rows, examined: _safe(act, *(part(rows, examined) for part in parts))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.keywords:
            name = node.func.id
            if name in _FUNCTIONS:
                function, parts = _FUNCTIONS[name], [self._compiled(part) for part in node.args]
                if len(parts) != 1 if name == "abs" else len(parts) < 2:
                    raise self._fail(f"{name} has {len(parts)} arguments")
                return lambda rows, examined: function(*(part(rows, examined) for part in parts))
            if len(node.args) == 1 and isinstance(node.args[0], ast.Name):
                return self._metric(name, node.args[0].id)
        raise self._fail(f"{ast.unparse(node)} is no number, metric(controller), sum, product, min, max or abs")

    def _metric(self, name: str, controller: str) -> Callable[[Rows, str], float]:
        if name != HARM and name not in METRICS:
            raise self._fail(f"{name}: {nearest_names(name, [HARM, *METRICS])};")
        self.metrics.append(name)
        for needed in (controller, NONE) if name == HARM else (controller,):
            if needed not in (ANY, *self.controllers):
                self.controllers.append(needed)

        def value(rows: Rows, examined: str) -> float:
            own = rows[examined if controller == ANY else controller]
            if name == HARM:
                return severity(changes(rows[NONE], own))
            found = own.get(name)
            worst = -math.inf if METRICS[name].better is Better.HIGHER else math.inf
            return worst if found is None or math.isnan(found) else found

        return value


def _safe(act: Callable[[float, float], float], *values: Any) -> float:
    try:
        return act(*values)
    except (ZeroDivisionError, OverflowError):
        return math.nan
