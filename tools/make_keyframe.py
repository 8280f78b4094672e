"""Writes the keyframe `static_ride` of a vehicle's model: the static equilibrium on its tyres.

Usage: python tools/make_keyframe.py [VEHICLE]

To be run again whenever a spring, a mass, a hardpoint or the tyre changes; a test holds the stored one to the car.
"""

from __future__ import annotations

import sys

from activesteer.scenario import resolve
from activesteer.vehicle import Vehicle


def keyframe_xml(vehicle_name: str) -> tuple[str, str]:
    """The text of keyframes.xml, and the path of the file that it belongs into."""
    scenario = resolve("standstill", vehicle_name)
    vehicle = Vehicle(scenario.mjcf, scenario.car, scenario.tyres, scenario.maneuver.road)
    qpos = " ".join(f"{value:.15g}" for value in vehicle.data.qpos)
    text = f"""<mujocoinclude>
  <!-- Written by tools/make_keyframe.py: static equilibrium on the tyres. -->
  <keyframe>
    <key name="static_ride"
      qpos="{qpos}"/>
  </keyframe>
</mujocoinclude>
"""
    return text, str(scenario.mjcf.parent / "keyframes.xml")


def main() -> None:
    """Writes the file."""
    text, path = keyframe_xml(sys.argv[1] if len(sys.argv) > 1 else "compact")
    with open(path, "w", encoding="utf-8") as file:
        file.write(text)
    print(path)


if __name__ == "__main__":
    main()
