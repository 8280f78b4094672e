"""Writes the keyframe `static_ride` of a vehicle's model: the static equilibrium on its tyres.

Usage: python tools/make_keyframe.py [VEHICLE]

To be run again whenever a spring, a mass, a hardpoint or the tyre changes; a test holds the stored one to the car.
`activesteer vehicle keyframe VEHICLE` does the same in an installed package.
"""

from __future__ import annotations

import sys

from activesteer.vehicle_builder.build import keyframe_xml


def main() -> None:
    """Writes the file."""
    text, path = keyframe_xml(sys.argv[1] if len(sys.argv) > 1 else "compact")
    path.write_text(text, encoding="utf-8")
    print(path)


if __name__ == "__main__":
    main()
