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


class View(NamedTuple):
    """A camera on a car."""

    aim: Callable[[mujoco.MjvCamera, float], None]  # function that aims a MuJoCo camera for an instant [s]
    shell_opacity: float  # opacity of the car's shell, 0 to 1; low for a view of the suspension
    marked: bool = True  # whether the view shows the wedges and arrows beside the car


def view(name: str, track: Track, corner: str = CORNERS[0]) -> View:
    """Return the camera of a name."""
    if name == "chase":
        return View(_chase(track), 1.0)
    if name == "top":
        return View(_top(track), _WHEELS_SEEN)
    if name == "wheel":
        return View(_wheel(track, corner), CUTAWAY, marked=False)
    raise ParameterError(f"there is no camera {name!r}; {nearest_names(name, CAMERAS)}", value=name)


def _chase(track: Track) -> Callable[[mujoco.MjvCamera, float], None]:
    """Place the camera behind and above the car, seen in its direction of motion, looking over the roof at the road.

    A car that slides turns in the picture.
    """

    def aim(camera: mujoco.MjvCamera, time_s: float) -> None:
        direction = track.direction(time_s)
        ahead = np.array([math.cos(direction), math.sin(direction), 0.0])
        camera.lookat = track.middle(time_s) + 0.9 * ahead + np.array([0.0, 0.0, 0.15])
        camera.distance, camera.elevation, camera.azimuth = 8.3, -20.0, math.degrees(direction)

    return aim


def _top(track: Track) -> Callable[[mujoco.MjvCamera, float], None]:
    """Place the camera above the car, x to the right and y up as in the plots. It does not rotate with the car."""

    def aim(camera: mujoco.MjvCamera, time_s: float) -> None:
        camera.lookat = track.middle(time_s)
        camera.distance, camera.elevation, camera.azimuth = 15.0, -90.0, 90.0

    return aim


def _wheel(track: Track, corner: str) -> Callable[[mujoco.MjvCamera, float], None]:
    """Place the camera inboard of a wheel, where its links are. It follows the chassis without roll and heave."""
    if corner not in CORNERS:
        raise ParameterError(f"there is no corner {corner!r}; {nearest_names(corner, CORNERS)}", value=corner)
    place = track.wheel_place(corner)
    side, end = (1.0 if corner[1] == "l" else -1.0), (1.0 if corner[0] == "f" else -1.0)
    # Look from the end of the car towards its middle, and outwards by 28 degrees.
    azimuth = side * (90.0 + 62.0 * end)

    def aim(camera: mujoco.MjvCamera, time_s: float) -> None:
        heading = track.heading(time_s)
        cos, sin = math.cos(heading), math.sin(heading)
        x, y, z = place
        camera.lookat = track.chassis(time_s) + np.array([cos * x - sin * y, sin * x + cos * y, z + 0.05])
        camera.distance, camera.elevation, camera.azimuth = 1.9, -10.0, math.degrees(heading) + azimuth

    return aim


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
        for kind, name, names in (("layout", self.layout, LAYOUTS), ("kind of gauges", self.gauges, GAUGES)):
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
        actors = [
            _Actor(recording, Track(recording, name), looks[name].label, looks[name].on_dark)
            for name, recording in recordings.items()
        ]
        self._tracks = [actor.track for actor in actors]
        maneuver = actors[0].recording.metadata.get("maneuver", {})
        title = str(maneuver.get("title") or maneuver.get("name") or "")
        groups = [[actor] for actor in actors] if settings.layout == "side-by-side" else [actors]
        edges = np.linspace(0, settings.size[0], len(groups) + 1).astype(int)
        self._panes = [
            _Pane(group, actors, settings, (int(width), settings.size[1]), "" if number else title)
            for number, (group, width) in enumerate(zip(groups, np.diff(edges), strict=True))
        ]

    def __enter__(self) -> Self:
        """Open the canvases."""
        for pane in self._panes:
            pane.open()
        return self

    def __exit__(self, *_: object) -> None:
        """Close the canvases."""
        for pane in self._panes:
            pane.close()

    def times(self, rate_hz: float) -> NDArray[np.float64]:
        """Return the instants of the frames [s], from the first pose of any car to the last."""
        start = min(track.start_s for track in self._tracks)
        end = max(track.end_s for track in self._tracks)
        step = self.settings.speed / rate_hz
        count = int((end - start) / step + 1e-9) + 1
        return np.asarray(start + step * np.arange(count), np.float64)

    def picture(self, time_s: float) -> NDArray[np.uint8]:
        """Return the frame of an instant, shape (height, width, 3)."""
        drawn = [pane.picture(time_s) for pane in self._panes]
        return drawn[0] if len(drawn) == 1 else np.hstack(drawn)

    def pictures(self, times_s: Sequence[float] | NDArray[np.float64]) -> Iterator[NDArray[np.uint8]]:
        """Yield the frames of several instants."""
        for time_s in times_s:
            yield self.picture(float(time_s))


class _Actor(NamedTuple):
    """A run in a film."""

    recording: Recording
    track: Track
    label: str
    colour: str

    @property
    def dials(self) -> Dials:
        return Dials(self.recording, self.label, self.colour)

    @property
    def size(self) -> Footprint | None:
        return footprint_of(self.recording.metadata)


class _Pane:
    """A pane of the frame with a scene and a camera of its own."""

    def __init__(
        self,
        actors: Sequence[_Actor],
        every: Sequence[_Actor],
        settings: Settings,
        size: tuple[int, int],
        title: str,
    ) -> None:
        first = actors[0]
        self._tracks = [actor.track for actor in actors]
        self._view = view(settings.camera, first.track, settings.corner)
        opacity = CUTAWAY if settings.cutaway else self._view.shell_opacity
        cars = [
            FilmedCar(
                actor.recording.scene,
                actor.track.bodies,
                actor.colour,
                opacity,
                ghost=number > 0,
                size=actor.size,
                tail_opens=number == 0 and opacity == 1.0 and used(actor.recording, "rear_steer_rad"),
            )
            for number, actor in enumerate(actors)
        ]
        metadata = first.recording.metadata
        self._size = size
        drawn = surface_in(metadata)
        course = course_of(metadata)
        edges = None
        if course is None and drawn is None:
            edges = edges_beside([actor.track.path()[1] for actor in every])
        self._scene = RenderScene(cars, course, road_of(metadata), size, drawn, edges)
        notes = [f"speed x {settings.speed:g}"] if settings.speed != 1.0 else []
        notes += ["road heights to scale"] if drawn is not None else []
        footprint = first.size or Footprint()
        self._traces = [
            Traces(actor.recording, actor.track, footprint, actor.colour, number, uneven=drawn is not None)
            for number, actor in enumerate(actors)
        ]
        self._markings = None
        if self._view.marked and settings.gauges == "full":
            recordings = [actor.recording for actor in every]
            self._markings = Markings(first.recording, first.track, footprint, first.colour, recordings)
            notes += [self._markings.note] if self._markings.note else []
        self._dials = [actor.dials for actor in actors]
        if settings.gauges == "sideslip":
            self._gauges = LargeSideslip(self._dials, size)
        else:
            self._gauges = Gauges(self._dials, title, size, ", ".join(notes), [actor.dials for actor in every])
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE
        self._canvas: Offscreen | None = None

    def open(self) -> None:
        self._canvas = Offscreen(self._scene.model, self._size)

    def close(self) -> None:
        if self._canvas is not None:
            self._canvas.close()
            self._canvas = None

    def picture(self, time_s: float) -> NDArray[np.uint8]:
        if self._canvas is None:
            raise RuntimeError("a film is drawn in a `with` block")
        for number, track in enumerate(self._tracks):
            self._scene.place(number, *track.poses(time_s))
        rear_steer = abs(self._dials[0].value("rear_steer_rad", time_s))
        self._scene.open_tail(0, float(np.interp(rear_steer, _TAIL_OPENS_RAD, (0.0, 1.0))))
        self._scene.update()
        self._view.aim(self._camera, time_s)
        scene = self._canvas.prepare(self._scene.data, self._camera)
        for traces in self._traces:
            traces.add(scene, time_s)
        if self._markings is not None:
            self._markings.add(scene, time_s)
        return self._gauges.draw(self._canvas.draw(), time_s)


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
        samples = film.pictures(times[:: max(1, len(times) // _SAMPLES)])
        with encoder(path, settings.size, rate, samples) as write:
            for number, pixels in enumerate(film.pictures(times), start=1):
                write(pixels)
                if progress is not None:
                    progress(number / len(times))
    return FilmInfo(len(times), rate)
