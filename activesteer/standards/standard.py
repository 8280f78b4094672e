"""What a standard is here, and what comes out of a test by it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Protocol

import numpy as np

from activesteer.conventions import CURVE_STEP_S, Array
from activesteer.errors import ManeuverError, RecordingError
from activesteer.pages import Table
from activesteer.plotting import Curve, Picture
from activesteer.quantities import quantity_of
from activesteer.resources import DEFAULT_DRIVER

if TYPE_CHECKING:
    from activesteer.scenario import FileOrTable, Scenario


_LEAD_S: Final = 0.2
"""So long before what time is counted from a curve over time begins [s]."""
SIDES: Final = {"left": 1.0, "right": -1.0}
"""Side to which a car is steered -> sign of the steering wheel angle, ISO 8855."""


class NoResult(ManeuverError):  # noqa: N818 - what came out of a test, named as one
    """A car cannot be tested with a controller: a run failed without which the others make no sense."""


@dataclass(frozen=True)
class Run:
    """A run that was driven; the analysis reads it as it reads a recording.

    Attributes:
        case: What it was driven with beside the others of its series.
        metrics: Its metrics; empty where it failed or could not be evaluated.
        channels: Channels over time that are kept, every `CURVE_STEP_S`.
        error: Why it has no metrics; empty where it has.
    """

    case: Mapping[str, Any]
    metrics: Mapping[str, float]
    channels: Mapping[str, Array]
    error: str

    @property
    def time_s(self) -> Array:
        """Time of the values of channels [s]."""
        return np.asarray(CURVE_STEP_S * np.arange(len(next(iter(self.channels.values()), ()))), dtype=np.float64)

    @property
    def metadata(self) -> Mapping[str, Any]:
        """Nothing; the car is the proving ground's."""
        return {}

    def __getitem__(self, channel: str) -> Array:
        """A channel over `time_s`.

        Raises:
            RecordingError: the run failed, or the channel was not kept.
        """
        if channel not in self.channels:
            raise RecordingError(self.error or f"{channel} was not kept", value=channel, allowed=tuple(self.channels))
        return self.channels[channel]

    def at(self, channel: str, time_s: float) -> float:
        """A channel at a time, interpolated; nan where the run has not got so far."""
        values = self.channels.get(channel, np.empty(0))
        return float(np.interp(time_s, self.time_s, values)) if len(values) and time_s <= self.time_s[-1] else math.nan

    @property
    def values(self) -> dict[str, Any]:
        """Case and metrics, or why there are none, as JSON values."""
        return {**self.case, **(dict(self.metrics) if not self.error else {"error": self.error})}

    def metric(self, name: str) -> float:
        """A metric; nan where the run has none."""
        return self.metrics.get(name, math.nan)

    def over_time(self, channel: str, *, begin_s: float = 0.0, **words: Any) -> Curve:
        """A channel in the unit that it is shown in, from shortly before what time is counted from.

        Args:
            channel: One of those that were kept.
            begin_s: What time is counted from [s].
            **words: Of `Curve`.
        """
        values = self.channels.get(channel, np.empty(0))
        time_s = self.time_s[: len(values)] - begin_s
        shown = time_s >= -_LEAD_S
        return Curve(time_s[shown], quantity_of(channel).factor * values[shown], **words)


class Ground(Protocol):
    """Where a car with a controller is driven; `proving_ground.ProvingGround` is the one there is."""

    def scenario(self, maneuver: FileOrTable, overrides: Mapping[str, Any] | None = None) -> Scenario:
        """The car and a manoeuvre, resolved."""
        ...

    def drive(
        self,
        series: str,
        maneuver: FileOrTable,
        cases: Sequence[Mapping[str, Any]],
        overrides: Mapping[str, Any] | None = None,
        curves: Sequence[str] = (),
    ) -> list[Run]:
        """Drives a series of runs.

        Args:
            series: Its name, one for each series of a test.
            maneuver: Name, path or table.
            cases: Dotted key -> value of each run, the same keys in all of them.
            overrides: The same for what all runs share.
            curves: Channels that are kept over time.

        Returns:
            The runs, in the order of the cases.

        Raises:
            ActiveSteerError: an input is wrong.
        """
        ...

    def fault_map(self, preset: str) -> list[dict[str, Any]]:
        """Drives the faults of the controller's actuators and sensors.

        Args:
            preset: Name of speeds and situations, one of `studies.paper.fault_situations.PRESETS`.

        Returns:
            The rows of the map.

        Raises:
            ActiveSteerError: an input is wrong, or the car in order cannot be driven so.
        """
        ...


@dataclass(frozen=True)
class Findings:
    """What came out of a test of one car with one controller.

    Attributes:
        values: What `--json` prints. With `pass` where the standard has limits, and else without it.
        summary: The verdict, or what was found, in a sentence.
        tables: For the page.
        pictures: For the page.
    """

    values: dict[str, Any]
    summary: str
    tables: Sequence[Table] = field(default_factory=tuple)
    pictures: Sequence[Picture] = field(default_factory=tuple)

    @classmethod
    def without_result(cls, reason: NoResult) -> Findings:
        """What is said of a car that cannot be tested."""
        return cls({"error": str(reason)}, f"no result: {reason}")

    @property
    def error(self) -> str:
        """Why nothing can be said; empty where something can."""
        return self.values.get("error", "")

    @property
    def passed(self) -> bool | None:
        """Whether the limits are kept; None for a test method without limits."""
        return self.values.get("pass")


@dataclass(frozen=True)
class Standard:
    """A standard.

    Attributes:
        name: How it is called on the command line.
        title: What it is.
        edition: Which edition, and from where the text is known.
        implemented: What of it is done here, a sentence each.
        left_out: What is not, or not as it says.
        examine: Drives the runs of one car with one controller, and evaluates them; a run that fails is a row, and
            `NoResult` is raised where nothing can be said.
        driver: Who drives where nobody else is asked for.
    """

    name: str
    title: str
    edition: str
    implemented: Sequence[str]
    left_out: Sequence[str]
    examine: Callable[[Ground], Findings]
    driver: str = DEFAULT_DRIVER
