"""Playback of recordings in the rerun viewer."""

from activesteer.playback.runs import Run, runs_of
from activesteer.playback.showing import Showing
from activesteer.playback.viewer import save, serve, show

__all__ = ["Run", "Showing", "runs_of", "save", "serve", "show"]
