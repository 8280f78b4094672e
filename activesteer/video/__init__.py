"""Films of recordings, drawn with MuJoCo.

In: recordings.
Out: MP4 files, and frames as arrays.
"""

from activesteer.video.film import Film, Settings, make_film
from activesteer.video.render_scene import FilmedCar, RenderScene

__all__ = ["Film", "FilmedCar", "RenderScene", "Settings", "make_film"]
