"""Films of recordings: camera behind, above or next to the car, and MP4 files."""

from __future__ import annotations

import importlib
import math
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.core.conventions import CORNERS, run_looks
from activesteer.core.files import atomic_write
from activesteer.errors import ParameterError, PlaybackError, nearest_names, not_installed
from activesteer.recording import Recording
from activesteer.road.course import Footprint, course_of, footprint_of
from activesteer.road.drawn import surface_in
from activesteer.road.road import road_of
from activesteer.video.gauges import Dials, Gauges, LargeSideslip
from activesteer.video.offscreen import Offscreen
from activesteer.video.render_scene import FilmedCar, RenderScene
from activesteer.video.track import Markings, Traces, Track

CUTAWAY: Final = 0.12
"""Opacity of a shell that lets the suspension be seen."""
_SHELL_OPACITY: Final = {"chase": 1.0, "top": 0.25, "wheel": CUTAWAY}
"""Opacity of the shell of a car, by camera."""
_NEAR_M, _MOST_ASIDE_M, _BACK_PER_ASIDE = 1.5, 25.0, 2.2
"""Half distance of cars up to which the camera stays with the first one [m], largest distance that its target moves
away from that car [m], and distance that the camera moves back for each metre of this."""
_SIDE_LIMIT: Final = 8192
"""Largest number of pixels of a side of a film."""


def aim(camera: mujoco.MjvCamera, name: str, tracks: Sequence[Track], time_s: float, corner: str = CORNERS[0]) -> None:
    """Aim a camera at the cars at a time [s], without the roll and heave of the followed car."""
    track = tracks[0]
    places = np.array([each.middle(time_s) for each in tracks])
    # All cars stay in the picture, unless they are so far apart that the first one could hardly be seen.
    aside = 0.5 * (places.min(axis=0) + places.max(axis=0)) - places[0]
    half_m = float(np.linalg.norm(aside))
    aside_m = min(max(half_m - _NEAR_M, 0.0), _MOST_ASIDE_M)
    aside *= aside_m / max(half_m, _NEAR_M)
    back_m = _BACK_PER_ASIDE * aside_m
    if name == "chase":  # in the direction of motion, so that a car that slides turns in the picture
        direction = track.direction(time_s)
        camera.lookat = places[0] + aside + (0.9 * math.cos(direction), 0.9 * math.sin(direction), 0.15)
        camera.distance, camera.elevation, camera.azimuth = 8.3 + back_m, -20.0, math.degrees(direction)
    elif name == "top":  # x to the right and y up, as in the plots
        camera.lookat = places[0] + aside
        camera.distance, camera.elevation, camera.azimuth = 15.0 + back_m, -90.0, 90.0
    else:  # inboard of the wheel, where its links are
        side, end = (1.0 if corner[1] == "l" else -1.0), (1.0 if corner[0] == "f" else -1.0)
        camera.lookat = track.wheel_centre(corner, time_s) + np.array([0.0, 0.0, 0.05])
        # Look from the end of the car towards its middle, and outwards by 28 degrees.
        azimuth = math.degrees(track.heading(time_s)) + side * (90.0 + 62.0 * end)
        camera.distance, camera.elevation, camera.azimuth = 1.9, -10.0, azimuth


@dataclass(frozen=True)
class Settings:
    """Settings of a film, such as camera, size and frame rate."""

    camera: str = "chase"
    """Camera: `chase`, `top` or `wheel`."""
    corner: str = CORNERS[0]
    """Wheel in the view of the camera `wheel`."""
    size: tuple[int, int] = (1280, 720)
    """Width and height [pixels]."""
    rate_hz: float = 30.0
    """Frame rate [1/s]."""
    speed: float = 1.0
    """Simulated seconds per second of film."""
    layout: str = "overlay"
    """Layout of several cars: `overlay` or `side-by-side`."""
    gauges: str = "full"
    """Gauges: `full`, or `sideslip` for one large number for each car and no markings."""
    cutaway: bool = False
    """True if the shells of the cars are transparent. The camera `wheel` always shows them so."""

    def __post_init__(self) -> None:
        """Check that the settings can be drawn."""
        for kind, name, names in (
            ("camera", self.camera, tuple(_SHELL_OPACITY)),
            ("corner", self.corner, CORNERS),
            ("layout", self.layout, ("overlay", "side-by-side")),
            ("kind of gauges", self.gauges, ("full", "sideslip")),
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
    """Scenes and cameras of a film, as a context manager."""

    def __init__(self, recordings: Mapping[str, Recording], settings: Settings) -> None:
        """Build the scenes."""
        if not recordings:
            raise ParameterError("there is no recording to film; at least one is needed")
        self.settings = settings
        looks = run_looks(recordings)
        self._tracks = [Track(recording, name) for name, recording in recordings.items()]
        dials = [Dials(run, looks[name].label, looks[name].on_dark) for name, run in recordings.items()]
        runs = list(zip(self._tracks, dials, strict=True))
        panes = [[run] for run in runs] if settings.layout == "side-by-side" else [runs]
        edges = np.linspace(0, settings.size[0], len(panes) + 1).astype(int)
        paths = [track.path()[1] for track in self._tracks]
        self._panes = [
            _Pane(pane, settings, (int(width), settings.size[1]), paths, list(recordings.values()))
            for pane, width in zip(panes, np.diff(edges), strict=True)
        ]
        shown = [[dial for _, dial in pane] for pane in panes]
        if settings.gauges == "sideslip":
            self._gauges = LargeSideslip(shown, settings.size)
        else:
            maneuver = dials[0].recording.metadata.get("maneuver", {})
            title = str(maneuver.get("title") or maneuver.get("name") or "")
            pace = [f"speed x {settings.speed:g}"] if settings.speed != 1.0 else []
            self._gauges = Gauges(shown, title, settings.size, ", ".join(pace + self._panes[0].notes))
        self._canvases: list[Offscreen] = []

    def __enter__(self) -> Self:
        """Open the canvases of all panes."""
        self._canvases = [Offscreen(pane.scene.model, pane.size) for pane in self._panes]
        return self

    def __exit__(self, *_: object) -> None:
        """Close the canvases of all panes."""
        for canvas in self._canvases:
            canvas.close()

    def times(self) -> NDArray[np.float64]:
        """Return the times of the frames [s], from the first pose of any car to the last."""
        start = min(track.start_s for track in self._tracks)
        end = max(track.end_s for track in self._tracks)
        step = self.settings.speed / self.settings.rate_hz
        return np.asarray(start + step * np.arange(int((end - start) / step + 1e-9) + 1), np.float64)

    def picture(self, time_s: float) -> NDArray[np.uint8]:
        """Return the frame at a time, shape (height, width, 3)."""
        drawn = [pane.picture(canvas, time_s) for pane, canvas in zip(self._panes, self._canvases, strict=True)]
        return self._gauges.draw(np.hstack(drawn), time_s)


class _Pane:
    """Pane of the frame, with its own scene and camera."""

    def __init__(
        self,
        runs: Sequence[tuple[Track, Dials]],
        settings: Settings,
        size: tuple[int, int],
        paths: Sequence[NDArray[np.float64]],
        recordings: Sequence[Recording],
    ) -> None:
        """Build the scene of some runs with the edges and scales of the whole film."""
        self.size, self._settings = size, settings
        self._tracks = [track for track, _ in runs]
        first = runs[0][1].recording
        course, drawn = course_of(first.metadata), surface_in(first.metadata)
        opacity = CUTAWAY if settings.cutaway else _SHELL_OPACITY[settings.camera]
        cars, self._marks = [], []
        for number, (track, (recording, _, colour)) in enumerate(runs):
            footprint = footprint_of(recording.metadata) or Footprint()
            cars.append(FilmedCar(recording.scene, track.bodies, colour, opacity, number > 0, footprint))
            trace = Traces(recording, track, footprint, colour, number, uneven=drawn is not None)
            self._marks.append(trace.add)
        straight = paths if course is None and drawn is None else ()
        self.scene = RenderScene(cars, course, road_of(first.metadata), size, drawn, straight)
        self.notes = ["road heights to scale"] if drawn is not None else []
        if settings.camera != "wheel" and settings.gauges == "full":
            markings = Markings(first, self._tracks[0], runs[0][1].colour, recordings)
            self._marks.append(markings.add)
            self.notes += markings.notes
        self._camera = mujoco.MjvCamera()
        self._camera.type = mujoco.mjtCamera.mjCAMERA_FREE

    def picture(self, canvas: Offscreen, time_s: float) -> NDArray[np.uint8]:
        """Return the frame at a time, without gauges."""
        for number, track in enumerate(self._tracks):
            self.scene.place(number, *track.poses(time_s))
        self.scene.update()
        aim(self._camera, self._settings.camera, self._tracks, time_s, self._settings.corner)
        scene = canvas.prepare(self.scene.data, self._camera)
        for add in self._marks:
            add(scene, time_s)
        return canvas.draw()


def check(path: Path, size: tuple[int, int]) -> None:
    """Check the output file and ffmpeg before anything is drawn."""
    if path.suffix.lower() != ".mp4":
        hint = "; `ffmpeg -i FILM.mp4 FILM.gif` converts it" if path.suffix.lower() == ".gif" else ""
        raise ParameterError(f"the name of a film must end in .mp4{hint}", file=str(path), allowed=(".mp4",))
    if min(size) < 16 or max(size) > _SIDE_LIMIT or size[0] % 2 or size[1] % 2:
        raise ParameterError(
            f"a film of {size[0]} x {size[1]} pixels cannot be made; each side must be even and 16 to {_SIDE_LIMIT}",
            value=size,
            allowed=(16, _SIDE_LIMIT),
        )
    if not path.parent.is_dir():
        raise PlaybackError(f"cannot write {path}: there is no folder {path.parent}", value=path.parent)
    ffmpeg()


def ffmpeg() -> str:
    """Return the ffmpeg program of the package imageio-ffmpeg, or the ffmpeg of the system."""
    with suppress(ImportError, RuntimeError):
        return importlib.import_module("imageio_ffmpeg").get_ffmpeg_exe()
    if found := shutil.which("ffmpeg"):
        return found
    what = "no program ffmpeg is found (apt-get install ffmpeg): a film"
    raise not_installed(PlaybackError, what, "imageio-ffmpeg", "video")


@contextmanager
def encoder(path: Path, size: tuple[int, int], rate_hz: float) -> Iterator[Callable[[NDArray[np.uint8]], None]]:
    """Yield a function that appends a frame. The file appears if the context ends without an error."""
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
            return PlaybackError(f"cannot write {path}: ffmpeg reports: {said}", value=said)

        def write(pixels: NDArray[np.uint8]) -> None:
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


def make_film(
    recordings: Mapping[str, Recording],
    path: Path,
    settings: Settings | None = None,
    progress: Callable[[float], Any] | None = None,
) -> int:
    """Draw a film of recordings to a file, and return the number of frames."""
    settings = settings or Settings()
    check(path, settings.size)
    with Film(recordings, settings) as film, encoder(path, settings.size, settings.rate_hz) as write:
        times = film.times()
        for number, time_s in enumerate(times, start=1):
            write(film.picture(time_s))
            if progress is not None:
                progress(number / len(times))
    return len(times)
