"""Films of recordings: cameras behind the car, above it or beside a wheel, and files as MP4 or GIF."""

from __future__ import annotations

import importlib
import math
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple, Self

import mujoco
import numpy as np
from numpy.typing import NDArray
from PIL import Image

from activesteer.core.conventions import CORNERS, run_looks
from activesteer.core.files import atomic_write
from activesteer.errors import ParameterError, PlaybackError, nearest_names, not_installed
from activesteer.recording import Recording
from activesteer.road.course import Footprint, course_of, footprint_of
from activesteer.road.drawn import surface_in
from activesteer.road.road import road_of
from activesteer.video.gauges import Dials, Gauges, LargeSideslip, used
from activesteer.video.offscreen import Offscreen
from activesteer.video.render_scene import FilmedCar, RenderScene
from activesteer.video.road import edges_beside
from activesteer.video.track import Markings, Traces, Track

CAMERAS: Final = ("chase", "top", "wheel")
"""Names of the cameras."""
CUTAWAY: Final = 0.12
"""Opacity of a shell that lets the suspension be seen."""

_WHEELS_SEEN: Final = 0.25
"""Opacity of a shell that lets the wheels be seen from above."""


_SHELL_OPACITY: Final = {"top": _WHEELS_SEEN, "wheel": CUTAWAY}
"""Camera -> opacity of the shell of a car, if it is not opaque."""


def aim(camera: mujoco.MjvCamera, name: str, track: Track, time_s: float, corner: str = CORNERS[0]) -> None:
    """Aim a camera at an instant [s].

    `chase` is behind and above the car, in its direction of motion, so that a car that slides turns in the picture.
    `top` is above the car, x to the right and y up as in the plots. `wheel` is inboard of a wheel, where its links are,
    and follows the chassis without roll and heave.
    """
    if name == "chase":
        direction = track.direction(time_s)
        camera.lookat = track.middle(time_s) + np.array([0.9 * math.cos(direction), 0.9 * math.sin(direction), 0.15])
        camera.distance, camera.elevation, camera.azimuth = 8.3, -20.0, math.degrees(direction)
    elif name == "top":
        camera.lookat = track.middle(time_s)
        camera.distance, camera.elevation, camera.azimuth = 15.0, -90.0, 90.0
    else:
        side, end = (1.0 if corner[1] == "l" else -1.0), (1.0 if corner[0] == "f" else -1.0)
        camera.lookat = track.wheel_centre(corner, time_s) + np.array([0.0, 0.0, 0.05])
        # Look from the end of the car towards its middle, and outwards by 28 degrees.
        azimuth = math.degrees(track.heading(time_s)) + side * (90.0 + 62.0 * end)
        camera.distance, camera.elevation, camera.azimuth = 1.9, -10.0, azimuth


LAYOUTS: Final = ("overlay", "side-by-side")
"""Layouts of several cars: one view with all but the first car transparent, or a pane for each car."""
GAUGES: Final = ("full", "sideslip")
"""Kinds of gauges over the frames."""
_TAIL_OPENS_RAD: Final = tuple(np.radians((0.3, 0.8)))
"""Rear steer angles from which the tail of a body lets the rear wheels be seen, and at which it is open [rad]."""
_SAMPLES: Final = 6


@dataclass(frozen=True)
class Settings:
    """Settings of a film."""

    camera: str = "chase"
    """`chase`, `top` or `wheel`."""
    corner: str = CORNERS[0]
    """Wheel in the view of the camera `wheel`."""
    size: tuple[int, int] = (1280, 720)
    """Width and height [pixels]."""
    rate_hz: float = 30.0
    """Frame rate [1/s]."""
    speed: float = 1.0
    """Simulated seconds per second of film."""
    layout: str = "overlay"
    """`overlay` or `side-by-side`."""
    gauges: str = "full"
    """`full`, or `sideslip` for one large number for each car and no markings."""
    cutaway: bool = False
    """Whether the shells of the cars are transparent. The camera `wheel` always shows them so."""

    def __post_init__(self) -> None:
        """Check the settings."""
        for kind, name, names in (
            ("camera", self.camera, CAMERAS),
            ("corner", self.corner, CORNERS),
            ("layout", self.layout, LAYOUTS),
            ("kind of gauges", self.gauges, GAUGES),
        ):
            if name not in names:
                raise ParameterError(f"there is no {kind} {name!r}; {nearest_names(name, names)}", value=name)
        for name, value, low, high in (
            ("pictures a second", self.rate_hz, 1.0, 240.0),
            ("speed", self.speed, 0.01, 100.0),
        ):
            if not low <= value <= high:
                raise ParameterError(f"is {value:g}, must be {low:g} to {high:g}", key=name, value=value)


class Film:
    """Scenes and cameras for some recordings. Use it in a `with` block."""

    def __init__(self, recordings: Mapping[str, Recording], settings: Settings) -> None:
        """Build the scenes."""
        if not recordings:
            raise ParameterError("there is no recording to make a film of, at least one is needed")
        self.settings = settings
        looks = run_looks(recordings)
        runs = [
            _Run(Track(recording, name), Dials(recording, looks[name].label, looks[name].on_dark))
            for name, recording in recordings.items()
        ]
        self._tracks = [run.track for run in runs]
        maneuver = runs[0].dials.recording.metadata.get("maneuver", {})
        title = str(maneuver.get("title") or maneuver.get("name") or "")
        groups = [[run] for run in runs] if settings.layout == "side-by-side" else [runs]
        edges = np.linspace(0, settings.size[0], len(groups) + 1).astype(int)
        self._panes = [
            _Pane(group, runs, settings, (int(width), settings.size[1]), title, headed=number == 0)
            for number, (group, width) in enumerate(zip(groups, np.diff(edges), strict=True))
        ]
        self._canvases: list[Offscreen] = []

    def __enter__(self) -> Self:
        """Open the canvases."""
        self._canvases = [Offscreen(pane.scene.model, pane.size) for pane in self._panes]
        return self

    def __exit__(self, *_: object) -> None:
        """Close the canvases."""
        for canvas in self._canvases:
            canvas.close()

    def times(self, rate_hz: float) -> NDArray[np.float64]:
        """Return the instants of the frames [s], from the first pose of any car to the last."""
        start = min(track.start_s for track in self._tracks)
        end = max(track.end_s for track in self._tracks)
        step = self.settings.speed / rate_hz
        count = int((end - start) / step + 1e-9) + 1
        return np.asarray(start + step * np.arange(count), np.float64)

    def picture(self, time_s: float) -> NDArray[np.uint8]:
        """Return the frame of an instant, shape (height, width, 3)."""
        drawn = [pane.picture(canvas, time_s) for pane, canvas in zip(self._panes, self._canvases, strict=True)]
        return drawn[0] if len(drawn) == 1 else np.hstack(drawn)


class _Run(NamedTuple):
    """A run in a film."""

    track: Track
    dials: Dials


class _Pane:
    """A pane of the frame with a scene and a camera of its own."""

    def __init__(
        self,
        runs: Sequence[_Run],
        every: Sequence[_Run],
        settings: Settings,
        size: tuple[int, int],
        title: str,
        *,
        headed: bool,
    ) -> None:
        self.size = size
        self._settings = settings
        self._tracks, self._dials = [run.track for run in runs], [run.dials for run in runs]
        first = self._dials[0].recording
        course, drawn = course_of(first.metadata), surface_in(first.metadata)
        edges = edges_beside([run.track.path()[1] for run in every]) if course is None and drawn is None else None
        opacity = CUTAWAY if settings.cutaway else _SHELL_OPACITY.get(settings.camera, 1.0)
        cars, self._marks = [], []
        for number, (track, dials) in enumerate(runs):
            recording, footprint = dials.recording, footprint_of(dials.recording.metadata)
            opens = number == 0 and opacity == 1.0 and used(recording, "rear_steer_rad")
            cars.append(
                FilmedCar(recording.scene, track.bodies, dials.colour, opacity, number > 0, footprint, tail_opens=opens)
            )
            trace = Traces(recording, track, footprint or Footprint(), dials.colour, number, uneven=drawn is not None)
            self._marks.append(trace.add)
        self.scene = RenderScene(cars, course, road_of(first.metadata), size, drawn, edges)
        notes = [f"speed x {settings.speed:g}"] if settings.speed != 1.0 else []
        notes += ["road heights to scale"] if drawn is not None else []
        if settings.camera != "wheel" and settings.gauges == "full":
            recordings = [run.dials.recording for run in every]
            markings = Markings(first, self._tracks[0], self._dials[0].colour, recordings)
            self._marks.append(markings.add)
            notes += [markings.note] if markings.note else []
        if settings.gauges == "sideslip":
            self._gauges = LargeSideslip(self._dials, size)
        else:
            shown_with = [run.dials for run in every]
            self._gauges = Gauges(self._dials, title, size, ", ".join(notes), shown_with, headed=headed)
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE

    def picture(self, canvas: Offscreen, time_s: float) -> NDArray[np.uint8]:
        for number, track in enumerate(self._tracks):
            self.scene.place(number, *track.poses(time_s))
        rear_steer = abs(self._dials[0].value("rear_steer_rad", time_s))
        self.scene.open_tail(0, float(np.interp(rear_steer, _TAIL_OPENS_RAD, (0.0, 1.0))))
        self.scene.update()
        aim(self._camera, self._settings.camera, self._tracks[0], time_s, self._settings.corner)
        scene = canvas.prepare(self.scene.data, self._camera)
        for add in self._marks:
            add(scene, time_s)
        return self._gauges.draw(canvas.draw(), time_s)


Pixels = NDArray[np.uint8]

FORMATS: Final = (".mp4", ".gif")
"""Suffixes of the files that can be written."""

_GIF_TICKS_HZ: Final = 100.0
_COLOURS: Final = 128
_SIDE_LIMIT: Final = 8192


def frame_rate(path: Path, wanted_hz: float) -> float:
    """Return the nearest frame rate that a format can have: a GIF shows each frame for whole hundredths of a second."""
    if path.suffix.lower() != ".gif":
        return wanted_hz
    return _GIF_TICKS_HZ / max(2, round(_GIF_TICKS_HZ / wanted_hz))  # browsers show less than two hundredths as ten


def check(path: Path, size: tuple[int, int]) -> None:
    """Check the conditions for writing before anything is drawn."""
    if path.suffix.lower() not in FORMATS:
        raise ParameterError(f"a video's name must end in {' or '.join(FORMATS)}", file=str(path), allowed=FORMATS)
    if min(size) < 16 or max(size) > _SIDE_LIMIT:
        raise ParameterError(
            f"a picture of {size[0]} x {size[1]} pixels cannot be made; each side must be 16 to {_SIDE_LIMIT}",
            value=size,
            allowed=(16, _SIDE_LIMIT),
        )
    if not path.parent.is_dir():
        raise PlaybackError(f"cannot write {path}: there is no folder {path.parent}", value=path.parent)
    if path.suffix.lower() == ".mp4":
        if size[0] % 2 or size[1] % 2:
            raise ParameterError(f"{size[0]} x {size[1]} pixels: an MP4 needs an even width and height", value=size)
        ffmpeg()


def encoder(
    path: Path, size: tuple[int, int], rate_hz: float, samples: Iterable[Pixels]
) -> AbstractContextManager[Callable[[Pixels], None]]:
    """Context that yields a function to append a frame of shape (height, width, 3).

    The file appears when the context ends without an error. Otherwise nothing is left.
    """
    if path.suffix.lower() == ".gif":
        return _gif(path, rate_hz, samples)
    return _mp4(path, size, rate_hz)


def ffmpeg() -> str:
    """Return the ffmpeg program of the package imageio-ffmpeg, or else of the system."""
    with suppress(ImportError, RuntimeError):
        return importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    if found := shutil.which("ffmpeg"):
        return found
    what = "no program ffmpeg is found (apt-get install ffmpeg; a .gif needs none): an MP4"
    raise not_installed(PlaybackError, what, "imageio-ffmpeg", "video")


@contextmanager
def _mp4(path: Path, size: tuple[int, int], rate_hz: float) -> Iterator[Callable[[Pixels], None]]:
    with atomic_write(path, PlaybackError) as part, tempfile.TemporaryFile() as log:
        part.open("wb").close()  # a folder that cannot be written is an error before anything is drawn
        command = [
            ffmpeg(), "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}",
            "-r", f"{rate_hz:.6g}", "-i", "-", "-an", "-c:v", "libx264", "-preset", "veryfast", "-crf", "20",
            # Every player and browser supports this, and can start before the whole file has arrived.
            "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(part),
        ]  # fmt: skip
        try:
            process: Any = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=log)
        except OSError as reason:
            raise PlaybackError(f"{command[0]} does not start: {reason.strerror or reason}") from None

        def failure() -> PlaybackError:
            log.seek(0)
            said = (log.read().decode(errors="replace").strip().splitlines() or ["nothing"])[-1]
            return PlaybackError(f"cannot write {path}: ffmpeg says: {said}", value=said)

        def write(pixels: Pixels) -> None:
            try:
                process.stdin.write(np.ascontiguousarray(pixels).data)
            except OSError:
                process.wait()
                raise failure() from None

        try:
            yield write
        except BaseException:
            process.kill()
            raise
        finally:
            with suppress(OSError):
                process.stdin.close()
            status = process.wait()
        if status != 0:
            raise failure()


@contextmanager
def _gif(path: Path, rate_hz: float, samples: Iterable[Pixels]) -> Iterator[Callable[[Pixels], None]]:
    # All frames share one palette; with a palette for each frame, the colours of still objects would flicker.
    palette = Image.fromarray(np.concatenate(list(samples))).quantize(_COLOURS, method=Image.Quantize.MEDIANCUT)
    pictures: list[Image.Image] = []
    with atomic_write(path, PlaybackError) as part:
        part.open("wb").close()  # a folder that cannot be written is an error before anything is drawn
        yield lambda pixels: pictures.append(
            Image.fromarray(np.ascontiguousarray(pixels)).quantize(palette=palette, dither=Image.Dither.NONE)
        )
        first, *others = pictures
        duration_ms = round(1000.0 / rate_hz)
        first.save(part, "GIF", save_all=True, append_images=others, duration=duration_ms, loop=0, optimize=False)


class FilmInfo(NamedTuple):
    """Number of frames and frame rate of a film that was written."""

    pictures: int
    rate_hz: float


def make_film(
    recordings: Mapping[str, Recording],
    path: Path,
    settings: Settings | None = None,
    progress: Callable[[float], Any] | None = None,
) -> FilmInfo:
    """Draw a film of recordings and write it to a file."""
    settings = settings or Settings()
    check(path, settings.size)
    rate = frame_rate(path, settings.rate_hz)
    with Film(recordings, settings) as film:
        times = film.times(rate)
        samples = (film.picture(time_s) for time_s in times[:: max(1, len(times) // _SAMPLES)])
        with encoder(path, settings.size, rate, samples) as write:
            for number, time_s in enumerate(times, start=1):
                write(film.picture(time_s))
                if progress is not None:
                    progress(number / len(times))
    return FilmInfo(len(times), rate)
