"""Playback of recordings in the rerun viewer.

In: recordings.
Out: rerun recordings and the viewer.
"""

from activesteer.playback.runs import ReplayedRun, Showing, runs_of
from activesteer.playback.viewer import save, serve, show

__all__ = ["ReplayedRun", "Showing", "runs_of", "save", "serve", "show"]
