"""Renew stored results, and the tables and pictures of the documentation: `python tools/renew.py WHAT --help`.

Long runs keep their results in build/ and are resumed there.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

Options = argparse.Namespace


def _population(options: Options) -> int:
    """Drive the population behind the claims, store its results with the package, and write docs/population.md.

    250 samples take a quarter of an hour. `-o` accepts a folder that `activesteer study population -o DIR` has
    finished. Call `renew.py claims` afterwards.
    """
    from tools.population_store import PAGE, driven, page, store_population

    found, output = driven(options, None, "population")
    print(found.to_text())
    for path in store_population(found, output):
        print(f"{path}: {path.stat().st_size / 1e3:.0f} kB")
    PAGE.write_text(page(found), encoding="utf-8")
    return 0


def _judge(options: Options) -> int:
    """Judge the stored population again after a criterion has changed, and write docs/population.md.

    S2=S1 drives only the samples in which S1 held, because S2 can hold only there.
    """
    from tools.population_store import PAGE, judge_again, page

    found = judge_again(dict(pair.split("=") for pair in options.claims), options.jobs)
    PAGE.write_text(page(found), encoding="utf-8")
    return 0


def _around(options: Options) -> int:
    """Drive the two populations around the paper's setting, whose shares stand in docs/claims_other_cars.md."""
    from tools.population_store import renew_around

    renew_around(options.output or Path("build", "around"), options.samples, options.jobs)
    return 0


def _comparison(options: Options) -> int:
    """Drive the population behind the comparison of controllers, and write its table into docs/controller_results.md.

    Call `renew.py pictures comparison_population` afterwards.
    """
    from tools.comparison import comparison_text
    from tools.population_store import COMPARED, COMPARISON_PAGE, comparison_page, driven, store_summary

    controllers = options.controllers.split(",") if options.controllers else COMPARED
    found, _ = driven(options, controllers, "comparison")
    print(comparison_text(found))
    print(store_summary(found, "comparison"))
    text = COMPARISON_PAGE.read_text(encoding="utf-8")
    COMPARISON_PAGE.write_text(comparison_page(text, found), encoding="utf-8")
    return 0


def _controllers(options: Options) -> int:
    """Drive five scenarios of the paper and five harder ones, and print the table of docs/controller_design.md."""
    from tools.comparison import COMPARED, compare

    controllers = options.controllers.split(",") if options.controllers else COMPARED
    output = options.output or Path("build", "compare_controllers")
    made = compare(controllers, output, options.vehicle, jobs=options.jobs)
    print(made.to_text())
    for (scenario, name), problem in made.failures.items():
        print(f"{scenario} {name} failed: {problem}")
    return 1 if made.failures else 0


def _claims(_: Options) -> int:
    """Write the tables of docs/claims.md and docs/claims_other_cars.md from the stored populations."""
    from tools.tables import CLAIMS_PARTS, claims_page

    for page in CLAIMS_PARTS:
        page.write_text(claims_page(page), encoding="utf-8")
    return 0


def _estimation(_: Options) -> int:
    """Drive the runs of docs/estimation.md and write their table."""
    from tools.tables import ESTIMATION_PAGE, estimation_page

    ESTIMATION_PAGE.write_text(estimation_page(ESTIMATION_PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    return 0


def _keys(_: Options) -> int:
    """Write docs/manoeuvre_keys.md from the classes that read manoeuvres."""
    from tools.tables import KEYS_PAGE, keys_page

    KEYS_PAGE.write_text(keys_page(), encoding="utf-8")
    return 0


def _pictures(options: Options) -> int:
    """Draw the pictures of the documentation that come from runs: those with these names, or all."""
    from tools.pictures import draw_pictures

    draw_pictures(options.names)
    return 0


def _films(options: Options) -> int:
    """Draw the still and the animations, all or those with these names, by offscreen OpenGL."""
    from tools.film_pictures import draw_films

    draw_films(options.names)
    return 0


def _drawings(_: Options) -> int:
    """Draw axes and signs."""
    from tools.drawings import write_drawings

    write_drawings()
    return 0


def _pages(_: Options) -> int:
    """Draw the tops of HTML pages in Chromium, which takes five minutes."""
    from tools.page_pictures import draw_pages

    draw_pages()
    return 0


COMMANDS: dict[str, tuple[Callable[[Options], int], str]] = {
    "population": (_population, "samples jobs output"),
    "judge": (_judge, "claims jobs"),
    "around": (_around, "samples jobs output"),
    "comparison": (_comparison, "controllers samples jobs output"),
    "controllers": (_controllers, "controllers vehicle jobs output"),
    "claims": (_claims, ""),
    "estimation": (_estimation, ""),
    "keys": (_keys, ""),
    "pictures": (_pictures, "names"),
    "films": (_films, "names"),
    "drawings": (_drawings, ""),
    "pages": (_pages, ""),
}
"""Name -> what it does, and the names of its options."""


def parser() -> argparse.ArgumentParser:
    """Return the parser of the command line."""
    whole = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    added = whole.add_subparsers(required=True, metavar="WHAT")
    for name, (action, options) in COMMANDS.items():
        text = action.__doc__ or ""
        one = added.add_parser(name, help=text.splitlines()[0], description=text)
        one.set_defaults(action=action)
        arguments = {
            "samples": lambda one: one.add_argument("--samples", type=int, metavar="N", help="default: of the study"),
            "jobs": lambda one: one.add_argument("--jobs", type=int, metavar="N"),
            "output": lambda one: one.add_argument("-o", "--output", type=Path, metavar="DIR", help="default: build/"),
            "controllers": lambda one: one.add_argument("--controllers", metavar="C,C..."),
            "vehicle": lambda one: one.add_argument("--vehicle", default="compact", metavar="NAME"),
            "claims": lambda one: one.add_argument("claims", nargs="+", metavar="CLAIM=CLAIM"),
            "names": lambda one: one.add_argument("names", nargs="*", metavar="NAME"),
        }
        for option in options.split():
            arguments[option](one)
    return whole


if __name__ == "__main__":
    chosen = parser().parse_args()
    raise SystemExit(chosen.action(chosen))
