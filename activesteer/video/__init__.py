"""Films of recordings, drawn with MuJoCo.

In: recordings.
Out: MP4, WebP or PNG files.
"""

from activesteer.video.film import Film, FilmInfo, Settings, make_film
from activesteer.video.render_scene import Car, RenderScene

__all__ = ["Car", "Film", "FilmInfo", "RenderScene", "Settings", "make_film"]
