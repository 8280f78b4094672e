"""A recording as a film: every picture of it, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.conventions import CORNERS, RUN_COLOURS, run_looks
from activesteer.errors import ParameterError
from activesteer.recording import Recording
from activesteer.road.course import course_of
from activesteer.road.footprint import footprint_of
from activesteer.road.road import road_of
from activesteer.video.cameras import CUTAWAY, view
from activesteer.video.encoder import check, encoder, frame_rate
from activesteer.video.gauges import Dials, Gauges
from activesteer.video.offscreen import Offscreen
from activesteer.video.render_scene import Car, RenderScene
from activesteer.video.track import Track

COLOURS: Final = ("#c9ccd1", *RUN_COLOURS[1:])
"""Those of the plots, but for the first: a near-black car could hardly be distinguished from its tyres and the road."""
_SAMPLES: Final = 6


@dataclass(frozen=True)
class Settings:
    """How a film is made."""

    camera: str = "chase"
    """`chase`, `top` or `wheel`."""
    corner: str = CORNERS[0]
    """The wheel that the camera `wheel` looks at."""
    size: tuple[int, int] = (1280, 720)
    """Width and height [pixels]."""
    rate_hz: float = 30.0
    """Pictures a second [1/s]."""
    speed: float = 1.0
    """Simulated seconds that a second of film shows."""
    cutaway: bool = False
    """Whether the bodies of the cars are to be seen through; for the camera `wheel` they always are."""

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            ParameterError: one is out of its range.
        """
        for name, value, low, high in (
            ("pictures a second", self.rate_hz, 1.0, 240.0),
            ("speed", self.speed, 0.01, 100.0),
        ):
            if not low <= value <= high:
                raise ParameterError(f"is {value:g}, must be {low:g} to {high:g}", key=name, value=value)


class Film:
    """The scene with the cars of some recordings, and a camera; to be used in a `with` block."""

    def __init__(self, recordings: Mapping[str, Recording], settings: Settings) -> None:
        """Builds the scene.

        Args:
            recordings: By what they are called. The camera follows the car of the first; those of the others are
                transparent.
            settings: Camera, size, speed.

        Raises:
            ParameterError: there is no recording, or no such camera or wheel.
            PlaybackError: a recording has no poses, or nothing can be drawn here.
        """
        if not recordings:
            raise ParameterError("there is no recording to make a film of, at least one is needed")
        self.settings = settings
        self._tracks = [Track(recording, name) for name, recording in recordings.items()]
        self._view = view(settings.camera, self._tracks[0], settings.corner)
        looks = run_looks(recordings)
        colours = [COLOURS[looks[name].place] for name in recordings]
        opacity = CUTAWAY if settings.cutaway else self._view.shell_opacity
        cars = [
            Car(
                recording.scene, track.bodies, colour, opacity,
                ghost=number > 0, size=footprint_of(recording.metadata),
            )
            for number, (recording, track, colour) in enumerate(
                zip(recordings.values(), self._tracks, colours, strict=True)
            )
        ]  # fmt: skip
        first = next(iter(recordings.values()))
        maneuver = first.metadata.get("maneuver", {})
        self._scene = RenderScene(cars, course_of(first.metadata), road_of(first.metadata), settings.size)
        dials = [
            Dials(recording, looks[name].label, colour)
            for (name, recording), colour in zip(recordings.items(), colours, strict=True)
        ]
        self._gauges = Gauges(dials, str(maneuver.get("title") or maneuver.get("name") or ""), settings.size)
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        self._note = f"x {settings.speed:g}" if settings.speed != 1.0 else ""
        self._canvas: Offscreen | None = None

    def __enter__(self) -> Self:
        """Opens the canvas.

        Raises:
            PlaybackError: nothing can be drawn here.
        """
        self._canvas = Offscreen(self._scene.model, self.settings.size)
        return self

    def __exit__(self, *_: object) -> None:
        """Closes the canvas."""
        if self._canvas is not None:
            self._canvas.close()
            self._canvas = None

    def times(self, rate_hz: float) -> NDArray[np.float64]:
        """Instants of the pictures [s]: from the first pose of any car to the last.

        Args:
            rate_hz: Pictures a second of film [1/s].
        """
        start = min(track.start_s for track in self._tracks)
        end = max(track.end_s for track in self._tracks)
        step = self.settings.speed / rate_hz
        count = int((end - start) / step + 1e-9) + 1
        return np.asarray(start + step * np.arange(count), np.float64)

    def picture(self, time_s: float) -> NDArray[np.uint8]:
        """The picture of an instant, shape (height, width, 3).

        Args:
            time_s: The instant [s]; a car whose recording has ended stands where it was last.
        """
        if self._canvas is None:
            raise RuntimeError("a film is drawn in a `with` block")
        for number, track in enumerate(self._tracks):
            self._scene.place(number, *track.poses(time_s))
        self._scene.update()
        self._view.aim(self._camera, time_s)
        return self._gauges.draw(self._canvas.draw(self._scene.data, self._camera), time_s, self._note)

    def pictures(self, times_s: Sequence[float] | NDArray[np.float64]) -> Iterator[NDArray[np.uint8]]:
        """Pictures of several instants."""
        for time_s in times_s:
            yield self.picture(float(time_s))


class FilmInfo(NamedTuple):
    """What a film has become: pictures, and how many of them are shown in a second."""

    pictures: int
    rate_hz: float


def make_film(
    recordings: Mapping[str, Recording],
    path: Path,
    settings: Settings | None = None,
    progress: Callable[[float], Any] | None = None,
) -> FilmInfo:
    """Draws a film of recordings and writes it to a file.

    Args:
        recordings: See `Film`.
        path: The file, ending in .mp4 or .gif; one that exists is replaced when the new one is whole.
        settings: Camera, size, speed.
        progress: Called after each picture with the fraction that is done, 0 to 1.

    Raises:
        ParameterError: a setting or the file's ending is wrong.
        PlaybackError: nothing can be drawn here, there is no ffmpeg, or the file cannot be written; the message says
            what is missing.
    """
    settings = settings or Settings()
    check(path, settings.size)
    rate = frame_rate(path, settings.rate_hz)
    with Film(recordings, settings) as film:
        times = film.times(rate)
        samples = [film.picture(float(time)) for time in times[:: max(1, len(times) // _SAMPLES)]]
        with encoder(path, settings.size, rate, samples) as file:
            for number, pixels in enumerate(film.pictures(times), start=1):
                file.write(pixels)
                if progress is not None:
                    progress(number / len(times))
    return FilmInfo(len(times), rate)
