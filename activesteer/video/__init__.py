"""Films of recordings, drawn with MuJoCo from recordings alone, and the stage that they are played on."""

from activesteer.video.film import Film, Made, Settings, make_film
from activesteer.video.stage import Car, Stage

__all__ = ["Car", "Film", "Made", "Settings", "Stage", "make_film"]
