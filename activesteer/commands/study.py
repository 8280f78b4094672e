"""`activesteer study`: many runs from one file, on this machine or a cluster, which can be resumed."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from activesteer.commands.arguments import (
    add_controller,
    add_json,
    add_output,
    add_overrides,
    add_workers,
    overrides_of,
)
from activesteer.commands.output import print_json
from activesteer.commands.progress import RunCounter
from activesteer.errors import StudyError


def add_to(commands: Any) -> None:
    """Add the command to the command line."""
    parser = commands.add_parser("study", help="drive many runs over varied parameters")
    parser.add_argument("study", metavar="STUDY_OR_DIR", help="a study file or its name, or the folder of a study")
    add_output(parser, "DIR", "folder for the results, needed for a new study; a study found there is resumed")
    add_controller(parser, several=True, default="those of the study")
    parser.add_argument(
        "--vehicle", action="append", metavar="NAME_OR_PATH", help="a car instead of the study's; may be repeated"
    )
    parser.add_argument("--driver", metavar="DRIVER", help="a driver instead of the study's")
    parser.add_argument("--samples", type=int, metavar="N", help="number of samples instead of the study's")
    add_overrides(parser)
    add_workers(parser)
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--limit", type=int, metavar="N", help="drive at most N runs now")
    what.add_argument("--status", action="store_true", help="only print the progress of the study in DIR")
    what.add_argument("--report", action="store_true", help="only write DIR/report.html for the finished runs")
    add_json(parser)
    parser.set_defaults(action=_study)


def _study(options: argparse.Namespace) -> int:
    if options.limit is not None and options.limit < 1:
        raise StudyError(f"--limit {options.limit}: at least 1 is needed")
    from activesteer.studies.engine.study_file import changed_study, read_study

    given = Path(options.study)
    changes = {
        "controllers": options.controller, "vehicles": options.vehicle, "driver": options.driver,
        "overrides": overrides_of(options), "samples": options.samples,
    }  # fmt: skip
    changes = {key: value for key, value in changes.items() if value not in (None, {})}
    if changes and given.is_dir():
        raise StudyError(f"{given} holds a study, which keeps its {' and '.join(changes)}; give a study file instead")
    if changes and (options.status or options.report):
        raise StudyError(f"--status and --report drive nothing, so they take no {' and '.join(changes)}")
    folder = options.output or (given if given.is_dir() else None)
    if folder is None:
        read_study(options.study)
        raise StudyError(f"-o DIR is needed: the folder for the results of {options.study}")
    if options.status:
        return _status(folder, as_json=options.json)
    if options.report:
        return _report(folder, as_json=options.json)
    from activesteer.studies.engine.store import RESULTS, read_environment
    from activesteer.studies.engine.study import study

    if given.is_dir():
        read_environment(given)  # refuses a folder without a study
    options.output = folder
    options.how_to_resume = f"; resume with `activesteer study {folder}`"
    with RunCounter("study", quiet=options.json) as counter:
        study(
            given / "study.toml" if given.is_dir() else changed_study(options.study, changes),
            output=folder,
            jobs=options.jobs,
            scheduler=options.scheduler,
            limit=options.limit,
            progress=counter,
        )
    result = folder / RESULTS
    made = _progress_of(folder)
    status = 1 if made["by_status"] and set(made["by_status"]) <= {"failed", "crashed"} else 0
    if options.json:
        print_json(made | {"results": str(result) if result.exists() else None})
        return status
    _status(folder, as_json=False)
    print(f"results: {result}" if result.exists() else f"not finished; resume with `activesteer study {folder}`")
    return status


def _progress_of(folder: Path) -> dict[str, Any]:
    from activesteer.studies.engine.store import Store

    return {"folder": str(folder), **Store(folder, ()).progress().to_json()}


def _status(folder: Path, *, as_json: bool) -> int:
    progress = _progress_of(folder)
    if as_json:
        print_json(progress)
        return 0
    counts = ", ".join(f"{number} {status}" for status, number in progress["by_status"].items()) or "none"
    at_work = "; a process is at work" if progress["running"] else ""
    print(f"{progress['done']} of {progress['total']} runs are done: {counts}{at_work}")
    for error, number in progress["errors"].items():
        print(f"{number:6}  {error}")
    for key in progress["without_effect"]:
        print(f"without effect: {key} changes no metric of any run")
    return 0


def _report(folder: Path, *, as_json: bool) -> int:
    from activesteer.studies.engine.report import write_report

    path = write_report(folder)
    if as_json:
        print_json({"report": str(path)})
    else:
        print(f"report: {path}")
    return 0
