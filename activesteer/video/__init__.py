"""Films of recordings, drawn with MuJoCo.

In: recordings.
Out: MP4, WebP or PNG files.
"""

from activesteer.video.film import Film, FilmInfo, Settings, make_film
from activesteer.video.render_scene import FilmedCar, RenderScene

__all__ = ["Film", "FilmInfo", "FilmedCar", "RenderScene", "Settings", "make_film"]
