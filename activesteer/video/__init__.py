"""Films of recordings, drawn with MuJoCo."""

from activesteer.video.film import Film, FilmInfo, Settings, make_film
from activesteer.video.render_scene import Car, RenderScene

__all__ = ["Car", "Film", "FilmInfo", "RenderScene", "Settings", "make_film"]
