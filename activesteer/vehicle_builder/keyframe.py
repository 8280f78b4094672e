"""The keyframe `static_ride`: the car standing on its tyres, for viewers and other users of the model."""

from __future__ import annotations

from pathlib import Path

from activesteer.scenario import FileOrTable, load_car


def keyframe_xml(vehicle: FileOrTable) -> tuple[str, Path]:
    """Return the text of keyframes.xml, and the path of this file."""
    car = load_car(vehicle)
    qpos = " ".join(f"{value:.15g}" for value in car.on().data.qpos)
    text = f"""<mujocoinclude>
  <!-- Written by tools/make_keyframe.py: static equilibrium on the tyres. -->
  <keyframe>
    <key name="static_ride"
      qpos="{qpos}"/>
  </keyframe>
</mujocoinclude>
"""
    return text, car.mjcf.parent / "keyframes.xml"
