"""Drives the population anew, or what is missing of it, and keeps what came of it with the package.

    python tools/renew_population.py [-o DIR] [--samples N] [--jobs N]

It takes three quarters of an hour on two processors, and can be interrupted and called again.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from activesteer.commands.progress import RunCounter
from activesteer.studies.population import population
from activesteer.studies.population_store import store_population


def main() -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, default=Path("build/population"), metavar="DIR")
    parser.add_argument("--samples", type=int, metavar="N", help="default: that of studies/population.toml")
    parser.add_argument("--jobs", type=int, metavar="N")
    options = parser.parse_args()
    with RunCounter("population", quiet=False) as counter:
        found = population(options.samples, output=options.output, jobs=options.jobs, progress=counter)
    print(found.to_text())
    for path in store_population(found, options.output):
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
