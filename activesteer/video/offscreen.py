"""Offscreen rendering of a scene."""

from __future__ import annotations

import functools
import importlib
import os
import subprocess
import sys
from ctypes.util import find_library
from typing import Any, Final

import mujoco
import numpy as np
from numpy.typing import NDArray

from activesteer.errors import PlaybackError

BACKENDS: Final = {
    "egl": "libegl1 libegl-mesa0 libgl1-mesa-dri",
    "osmesa": "libosmesa6",
}
"""Offscreen backends and the apt packages that they need. The backend that can use a graphics card comes first."""

_LIBRARIES: Final = {"egl": "EGL", "osmesa": "OSMesa"}
_MAX_GEOMS: Final = 20000
_TRY: Final = "import sys, importlib as i; i.import_module('mujoco.' + sys.argv[1]).GLContext(16, 16).make_current()"
_TRY_TIMEOUT_S: Final = 60.0


@functools.cache
def backend() -> str:
    """Return the backend of MUJOCO_GL, or the first backend that works."""
    # Each backend is tried in a separate process: a broken driver may end the process, and PyOpenGL cannot change its
    # backend once it has loaded one.
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    # `glfw` draws to hidden windows of a display; a user who names it has a display.
    names = [wanted] if wanted in (*BACKENDS, "glfw") else list(BACKENDS)
    problems = {}
    for name in names:
        problem = _problem_with(name)
        if problem is None:
            return name
        problems[name] = problem
    install = " or ".join(f"apt-get install {BACKENDS[name]}" for name in names if name in BACKENDS)
    chosen = f" (MUJOCO_GL={wanted})" if len(names) == 1 else ""
    msg = f"no images can be rendered here{chosen}: {'; '.join(f'{name}: {why}' for name, why in problems.items())}"
    raise PlaybackError(f"{msg}. The libraries come with: {install}" if install else msg, value=problems)


def _problem_with(name: str) -> str | None:
    """Return the reason why a backend does not work, or None if it works."""
    environment = {key: value for key, value in os.environ.items() if key != "PYOPENGL_PLATFORM"} | {"MUJOCO_GL": name}
    try:
        tried = subprocess.run(
            [sys.executable, "-c", _TRY, name],
            env=environment, capture_output=True, text=True, timeout=_TRY_TIMEOUT_S, check=False,
        )  # fmt: skip
    except (OSError, subprocess.TimeoutExpired) as reason:
        return str(reason)
    if tried.returncode < 0:
        return f"ended by signal {-tried.returncode}"
    if tried.returncode == 0:
        return None
    # PyOpenGL's own message about a missing library does not help: "'NoneType' object has no attribute ...".
    if name in _LIBRARIES and find_library(_LIBRARIES[name]) is None:
        return f"lib{_LIBRARIES[name]}.so is missing"
    lines = [line for line in tried.stderr.splitlines() if "Error" in line and not line.startswith(" ")]
    return lines[0].rstrip(".") if lines else f"ended with status {tried.returncode}"


class Offscreen:
    """A canvas for offscreen rendering."""

    def __init__(self, model: mujoco.MjModel, size: tuple[int, int]) -> None:
        """Open the canvas."""
        name = backend()
        self._rect = mujoco.MjrRect(0, 0, *size)
        self._pixels = np.empty((size[1], size[0], 3), np.uint8)
        self._scene = mujoco.MjvScene(model, _MAX_GEOMS)
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            self._scene.flags[flag] = 0
        self._look = mujoco.MjvOption()
        self._model = model
        before = os.environ.get("MUJOCO_GL")
        os.environ["MUJOCO_GL"] = name  # MuJoCo reads it when it looks up its OpenGL functions
        try:
            self._context: Any = importlib.import_module(f"mujoco.{name}").GLContext(*size)
            self._context.make_current()
            self._drawer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        except (ImportError, RuntimeError, mujoco.FatalError) as reason:
            msg = f"no images of {size[0]} x {size[1]} can be rendered here with {name}: {reason}"
            raise PlaybackError(msg) from reason
        finally:
            del os.environ["MUJOCO_GL"]
            if before is not None:
                os.environ["MUJOCO_GL"] = before  # for a viewer that may be started later
        if self._drawer.offWidth < size[0] or self._drawer.offHeight < size[1]:
            maximum = f"{self._drawer.offWidth} x {self._drawer.offHeight}"
            self.close()
            raise PlaybackError(f"images of {size[0]} x {size[1]} exceed the size that can be rendered here: {maximum}")
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawer)

    def prepare(self, data: mujoco.MjData, camera: mujoco.MjvCamera) -> mujoco.MjvScene:
        """Prepare the scene of the next frame. You may then add geometry."""
        every = int(mujoco.mjtCatBit.mjCAT_ALL)
        mujoco.mjv_updateScene(self._model, data, self._look, None, camera, every, self._scene)
        return self._scene

    def draw(self) -> NDArray[np.uint8]:
        """Render the prepared scene into an image, top row first. The next frame overwrites it."""
        self._context.make_current()
        mujoco.mjr_render(self._rect, self._scene, self._drawer)
        mujoco.mjr_readPixels(self._pixels, None, self._rect, self._drawer)
        return self._pixels[::-1]

    def close(self) -> None:
        """Free the graphics memory of the canvas."""
        self._context.make_current()
        self._drawer.free()
        self._context.free()
