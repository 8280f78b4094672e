"""Plots: a model of curves, panels and figures, drawn by matplotlib without a display.

In: numbers with names and units.
Out: figures as PNG, PDF or SVG, and models of figures for pages.
"""

from activesteer.plotting.drawing import draw, new_figure, plain_axis, save, save_all
from activesteer.plotting.model import Area, Curve, Heat, Panel, Picture

__all__ = [
    "Area",
    "Curve",
    "Heat",
    "Panel",
    "Picture",
    "draw",
    "new_figure",
    "plain_axis",
    "save",
    "save_all",
]
