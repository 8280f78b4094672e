"""Mutation testing: change one line of the program and see whether a quick test fails.

`make mutants` draws changes among all that cosmic-ray can make in the rooms below, runs the tests of the room on each
change, and prints the score. The draw depends on the seed and on the text of the lines, so that it stays the same while
other lines change. `build/mutants` holds the results, and an interrupted run resumes there. `tools/mutants.md` gives a
reason for each survivor.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import itertools
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.ast.ast_query import ASTQuery
from cosmic_ray.mutating import use_mutation
from cosmic_ray.plugins import get_operator
from cosmic_ray.testing import run_tests
from cosmic_ray.work_item import TestOutcome

ROOT: Final = Path(__file__).resolve().parents[1]
PLACE: Final = ROOT / "build" / "mutants"
TREE: Final = PLACE / "tree"
REASONS: Final = ROOT / "tools" / "mutants.md"
LEAST_PER_ROOM: Final = 15
CACHES: Final = PLACE / "caches"
TIME_LIMIT_S: Final = 400
"""Longest time of the tests of a mutant. Beyond it the mutant is caught [s]."""


class Room(NamedTuple):
    """A room, and the tests that must notice a change in it, as patterns of paths.

    Attributes:
        files: Files of the room in the package.
        near: Quick tests of the room. The test file with the name of the changed file runs before them.
        wide: Tests that run if the near tests notice nothing.
        plain: Tests that run first, without the compiler, which needs half a minute after a change of a kernel.
    """

    files: str
    near: str
    wide: str = ""
    plain: str = ""


_STUDIES: Final = "design factor_values factors plan run_identity dependence report workers study_file"
_METRICS: Final = (
    "braking frequency_response handling lanes metrics path_following series sine_with_dwell step_response"
)
ROOMS: Final = {
    "controllers": Room(
        "controllers/*.py",
        "unit/controllers",
        "physics/test_chassis_controllers.py physics/test_step_steer.py unit/scenario "
        "unit/studies/linear/test_margins.py",
    ),
    "estimation": Room("estimation/*.py", "unit/estimation", "physics/test_sensors.py"),
    "brakes": Room(
        "vehicle/brakes/*.py",
        "unit/vehicle/brakes physics/test_chassis_hardware.py",
        "physics/test_braking.py physics/test_standstill.py",
        plain="unit/vehicle/brakes",
    ),
    "driver": Room(
        "driver/*.py", "unit/driver physics/test_step_steer.py", "unit/scenario physics/test_driver_loop.py"
    ),
    "sensors": Room("sensors/*.py", "unit/sensors physics/test_sensors.py"),
    "faults": Room("config/faults.py vehicle/faults.py", "unit/faults physics/test_faults.py"),
    "tyre/kernels": Room(
        "tyre/kernels/*.py",
        "unit/tyre/kernels reference/test_tyre_against_mfeval.py",
        "physics/test_step_steer.py unit/tyre/test_*.py",
        plain="unit/tyre/kernels/test_[rtv]*.py reference/test_tyre_against_mfeval.py",
    ),
    "vehicle/native": Room(
        "vehicle/native_*.py",
        "unit/vehicle/test_native_*.py unit/vehicle physics/test_toe_link_screw.py physics/test_step_steer.py",
        "physics/test_signs.py physics/test_braking.py physics/test_superposition_actuator.py "
        "physics/test_uneven_road.py physics/test_faults.py unit/coupling/car/test_export.py",
    ),
    "analysis/claims": Room(
        "analysis/claims/*.py",
        "unit/analysis/test_claims*.py unit/analysis/test_scorecard.py",
        "reproduction/test_fakes.py",
    ),
    "studies/engine": Room(
        "studies/engine/*.py",
        " ".join(f"unit/studies/engine/test_{name}.py" for name in _STUDIES.split()),
        "unit/studies/engine/test_study.py unit/studies/engine/test_tuning.py",
    ),
    "simulation": Room(
        "simulation/*.py",
        "unit/simulation",
        "physics/test_determinism.py physics/test_step_steer.py physics/test_own_cars.py unit/scenario",
    ),
    "road": Room("road/*.py", "unit/road", "unit/driver physics/test_road.py physics/test_uneven_road.py"),
    "analysis/harm": Room("analysis/harm.py", "unit/analysis/test_harm.py", "physics/test_harm.py"),
    "analysis": Room(
        " ".join(f"analysis/{name}.py" for name in _METRICS.split()),
        " ".join(f"unit/analysis/test_{name}.py" for name in _METRICS.split()),
        "unit/analysis/test_report.py unit/analysis/test_figures.py unit/maneuver/test_path_speed.py unit/standards "
        "physics/test_electric_power.py physics/test_uneven_road.py",
    ),
    "maneuver": Room(
        "maneuver/*.py",
        "unit/maneuver",
        "unit/scenario unit/road physics/test_step_steer.py physics/test_standstill.py physics/test_parking.py",
    ),
    "theory": Room("theory/*.py", "unit/theory", "physics/test_single_track.py unit/controllers"),
    "standards": Room("standards/*.py", "unit/standards"),
    "rigs": Room("rigs/kc/*.py", "unit/rigs/test_kc.py", "physics/test_kinematics_compliance.py unit/vehicle_builder"),
    "vehicle": Room(
        "vehicle/[!fn]*.py vehicle/force_block.py vehicle/channels/*.py",
        "unit/vehicle physics/test_toe_link_screw.py physics/test_step_steer.py",
        "physics/test_symmetry.py physics/test_balance.py physics/test_signs.py physics/test_electric_power.py "
        "physics/test_superposition_actuator.py physics/test_static_ride.py physics/test_loaded_car.py "
        "unit/vehicle_builder unit/scenario unit/recording",
    ),
    "measured": Room("measured/*.py", "unit/measured", "cli/test_measured.py cli/test_measured_folder.py"),
    "studies/linear": Room(
        "studies/linear/*.py",
        "unit/studies/linear",
        "physics/test_linearisation.py physics/test_identification.py physics/test_driver_loop.py",
    ),
    "learning": Room("learning/*.py", "unit/learning"),
    "recording": Room(
        "recording/*.py", "unit/recording", "unit/simulation/test_recorder.py unit/playback/test_file.py"
    ),
    "scenario": Room(
        "scenario/*.py config/__init__.py core/units.py core/limits.py core/metric_table.py",
        "unit/test_config.py unit/test_units.py unit/test_metric_table.py unit/scenario",
        "unit/faults unit/controllers unit/maneuver cli/test_errors.py unit/recording unit/simulation/test_changes.py "
        "unit/vehicle/test_motors.py",
    ),
    "coupling": Room("coupling/*.py coupling/*/*.py", "unit/coupling unit/simulation/test_by_the_clock.py"),
    "vehicle_builder": Room(
        "vehicle_builder/*.py",
        "unit/vehicle_builder",
        "unit/vehicle/test_curve_axle.py physics/test_own_cars.py cli/test_vehicle.py",
    ),
    "commands": Room("commands/*.py", "cli", "tools docs"),
    "explore": Room("explore/*.py", "unit/explore cli/test_explore.py"),
    "playback": Room("playback/*.py", "unit/playback", "render/test_viewer_pictures.py"),
    "video": Room("video/*.py", "unit/video", "render/test_film.py"),
    "drawing": Room("drawing/*.py", "unit/drawing", "unit/playback unit/video unit/analysis/test_report.py"),
    "plugins": Room("plugins/*.py", "unit/plugins", "unit/simulation unit/coupling/fmu cli/test_user_code.py"),
}

OTHER_NAMES: Final = {
    "native_curve_axle": "curve_axle",
    "native_screws": "toe_link_screw",
    "find": "plugins",
    "retuned": "changes",
    "run_context": "recorder",
    "advance": "filter_parts",
    "two_track_model": "filter_parts",
    "crg": "uneven",
    "surface": "uneven",
    "obstacles": "uneven",
    "native_path": "path_coordinates",
    "closed_loop": "simulation",
    "native_loop": "batch",
    "pacing": "by_the_clock",
    "preparation": "amplitude_search",
    "two_track_search": "amplitude_search",
}
"""File -> name of its tests, if the name differs."""

_ARITHMETIC: Final = ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul", "Pow_Mul", "Mod_Mul", "FloorDiv_Mul", "Sub_Mul")
_COMPARISONS: Final = (
    "Eq_NotEq", "NotEq_Eq", "Lt_LtE", "Lt_GtE", "LtE_Lt", "LtE_Gt", "Gt_GtE", "Gt_LtE", "GtE_Gt", "GtE_Lt",
    "Is_IsNot", "IsNot_Is",
)  # fmt: skip
OPERATORS: Final = (
    *(f"ReplaceBinaryOperator_{name}" for name in _ARITHMETIC),
    *(f"ReplaceComparisonOperator_{name}" for name in _COMPARISONS),
    *("ReplaceUnaryOperator_Delete_USub", "ReplaceUnaryOperator_Delete_Not"),
    *("AddNot", "ReplaceTrueWithFalse", "ReplaceFalseWithTrue", "ReplaceAndWithOr", "ReplaceOrWithAnd"),
    *("ReplaceBreakWithContinue", "ReplaceContinueWithBreak", "ZeroIterationForLoop"),
    *("ExceptionReplacer", "NumberReplacer"),
)
"""Operators of cosmic-ray that make plausible mistakes. Any test would catch `<<` in place of `*`."""
_NO_CODE: Final = {"decorator", "raise_stmt", "fstring", "import_from", "import_name"}


class Mutant(NamedTuple):
    """One change of one line.

    Attributes:
        identity: Name that stays the same while other lines change.
        room: Room of the file.
        file: Path in the project.
        operator: Name of the operator of cosmic-ray.
        occurrence: Index of the place among all places in the file that the operator can change.
    """

    identity: str
    room: str
    file: str
    operator: str
    occurrence: int


def _is_code(node: Any) -> bool:
    """Return whether a node belongs to code, not to a type, a decorator, an import or an error message."""
    child = node
    while (parent := child.parent) is not None:
        typed = parent.type in {"annassign", "tfpdef"} and child is parent.children[1]
        returned = parent.type == "funcdef" and child is getattr(parent, "annotation", None)
        checking = parent.type == "if_stmt" and "TYPE_CHECKING" in parent.children[1].get_code()
        hinted = parent.type == "atom_expr" and parent.children[0].get_code().strip() == "Annotated"
        if typed or returned or checking or hinted or child.type in _NO_CODE:
            return False
        child = parent
    return True


def _is_weak(node: Any, operator: str) -> bool:
    """Return whether a number would change by less than 1 %, which no test should pin."""
    return operator == "NumberReplacer" and abs(ast.literal_eval(node.value)) >= 100


def mutants_of(room: str, path: Path) -> Iterator[Mutant]:
    """Find all possible changes of a file."""
    source = path.read_text()
    lines, tree = source.splitlines(), get_ast(source)
    same = Counter[str]()
    for name in OPERATORS:
        operator = get_operator(f"core/{name}")()
        places = ((node, *place) for node in ast_nodes(tree) for place in operator.mutation_positions(node))
        for occurrence, (node, start, _) in enumerate(places):
            if not _is_code(node) or _is_weak(node, name):
                continue
            definition = ASTQuery(node).get_definition_name() or "module"
            text = f"{path.stem}.{definition}: `{lines[start[0] - 1].strip()}` {name}"
            same[text] += 1
            yield Mutant(f"{text} {same[text]}", room, str(path.relative_to(ROOT)), f"core/{name}", occurrence)


def draw(count: int, seed: int, only: list[str]) -> dict[str, list[Mutant]]:
    """Draw mutants in proportion to the possible changes of each room, and a least number in each room.

    `only` lists patterns of files, such as `road/*.py`. An empty list draws among the files of all rooms.
    """
    chosen = {file for one in only for file in (ROOT / "activesteer").glob(one)}
    possible: dict[str, list[Mutant]] = {}
    for room, about in ROOMS.items():
        files = sorted(file for one in about.files.split() for file in (ROOT / "activesteer").glob(one))
        found = [mutant for file in files if not only or file in chosen for mutant in mutants_of(room, file)]
        if found:
            found.sort(key=lambda mutant: hashlib.sha256(f"{seed} {mutant.identity}".encode()).digest())
            possible[room] = found
    if not possible:
        sys.exit(f"no room of mutants.py has a file that matches {' '.join(only)}")
    share, least = count / sum(map(len, possible.values())), min(LEAST_PER_ROOM, count // (2 * len(possible)))
    sizes = {room: max(least, round(share * len(of_room))) for room, of_room in possible.items()}
    while sum(sizes.values()) > count:
        sizes[max(sizes, key=lambda room: sizes[room])] -= 1
    return {room: of_room[: sizes[room]] for room, of_room in possible.items()}


def copy_tree(tree: Path) -> None:
    """Update a private copy of the project: all files that git knows or would add."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT, check=True, stdout=-1
    ).stdout.decode()
    files = {name for name in listed.split("\0") if name and (ROOT / name).is_file()}
    for old in [path for path in tree.rglob("*") if path.is_file() and str(path.relative_to(tree)) not in files]:
        if "__pycache__" not in old.parts:
            old.unlink()
    for name in files:
        copy = tree / name
        if not copy.exists() or copy.read_bytes() != (ROOT / name).read_bytes():
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, copy)
    # By hash, not by time: a mutant may be written in the same second as its original.
    options = ["-q", "--invalidation-mode", "checked-hash"]
    subprocess.run([sys.executable, "-m", "compileall", *options, "activesteer", "tests"], cwd=tree, check=False)


def commands(mutant: Mutant, *, wide: bool) -> list[str]:
    """Return the pytest commands for a mutant, in their order."""
    stem, room = OTHER_NAMES.get(stem := Path(mutant.file).stem, stem), ROOMS[mutant.room]
    pytest = f"{sys.executable} -m pytest -x -q -p no:cacheprovider -m 'not slow'"
    plain = f"env NUMBA_DISABLE_JIT=1 {pytest} -W ignore::RuntimeWarning"
    own = f"**/test_{stem}.py {room.near}"
    wanted = [(plain, room.plain), (pytest, own), (pytest, room.wide if wide else "")]
    return [f"{start} {' '.join(found)}" for start, patterns in wanted if (found := tests_of(patterns))]


def tests_of(patterns: str) -> list[str]:
    """Return the paths that match some patterns in the tests of the copy, in the order of the patterns."""
    found = (path for pattern in patterns.split() for path in sorted((TREE / "tests").glob(pattern)))
    return [str(path.relative_to(TREE)) for path in dict.fromkeys(found)]


def run_on(mutant: Mutant, warm: Path, *, wide: bool) -> tuple[TestOutcome, str]:
    """Run the tests of a mutant with its own copy of the caches, so that it leaves nothing in them."""
    shutil.rmtree(CACHES, ignore_errors=True)
    shutil.copytree(warm, CACHES)
    outcome, output = TestOutcome.SURVIVED, ""
    for tests in commands(mutant, wide=wide):
        if outcome is TestOutcome.SURVIVED:
            outcome, output = run_tests(tests, TIME_LIMIT_S)
    return outcome, output


def catcher(outcome: TestOutcome, output: str) -> str:
    """Return the name of the test that caught a mutant, or an empty text."""
    if outcome is TestOutcome.SURVIVED:
        return ""
    assert "no tests ran" not in output, output
    found = re.search(r"^(?:FAILED|ERROR) (\S+)", output, re.MULTILINE)
    return found[1] if found else output.strip().rpartition("\n")[2] or "error"


def report(drawn: dict[str, list[Mutant]], results: dict[str, dict[str, Any]]) -> None:
    """Print the score of each room, and the survivors that `tools/mutants.md` does not explain."""
    reasons = REASONS.read_text() if REASONS.exists() else ""
    print("\n| room | drawn | caught | survived | not yet run |\n|---|---:|---:|---:|---:|")
    total = Counter[str]()
    for room, mutants in drawn.items():
        found = [results.get(mutant.identity) for mutant in mutants]
        row = Counter("left" if result is None else "caught" if result["by"] else "survived" for result in found)
        total += row
        print(f"| {room} | {len(found)} | {row['caught']} | {row['survived']} | {row['left']} |")
    print(f"| all | {total.total()} | {total['caught']} | {total['survived']} | {total['left']} |")
    for mutant in itertools.chain.from_iterable(drawn.values()):
        result = results.get(mutant.identity)
        if result is not None and not result["by"] and mutant.identity not in reasons:
            print(f"\nsurvivor without a reason: {mutant.file}\n{mutant.identity}\n{result['diff']}")


def main() -> None:
    """Run the mutants that have no result yet, and report."""
    parser = argparse.ArgumentParser(description="Change lines at random, and see which changes quick tests notice.")
    parser.add_argument("--count", type=int, default=300, help="mutants to draw")
    parser.add_argument("--seed", type=int, default=26, help="seed of the draw")
    parser.add_argument("--room", choices=ROOMS, action="append", help="only this room (may be repeated)")
    parser.add_argument(
        "--file", action="append", help="draw only in these files, such as 'road/*.py' (may be repeated)"
    )
    parser.add_argument("--near", action="store_true", help="leave out the wide tests")
    parser.add_argument("--again", action="store_true", help="run the survivors of earlier runs again")
    parser.add_argument("--list", action="store_true", help="run nothing, only report")
    options = parser.parse_args()
    drawn = {
        room: found
        for room, found in draw(options.count, options.seed, options.file or []).items()
        if room in (options.room or ROOMS)
    }
    kept = PLACE / "results.json"
    results = json.loads(kept.read_text()) if kept.exists() else {}
    if options.again:
        chosen = {mutant.identity for mutants in drawn.values() for mutant in mutants}
        results = {name: result for name, result in results.items() if result["by"] or name not in chosen}
    if not options.list:
        run(drawn, results, kept, wide=not options.near)
    report(drawn, results)


def run(drawn: dict[str, list[Mutant]], results: dict[str, dict[str, Any]], kept: Path, *, wide: bool) -> None:
    """Run the tests on each mutant that has no result yet, and keep each result at once."""
    warm = PLACE / "warm"
    copy_tree(TREE)
    os.chdir(TREE)
    os.environ |= {"PYTHONPATH": str(TREE), "NUMBA_CACHE_DIR": str(CACHES / "kernels"), "XDG_CACHE_HOME": str(CACHES)}
    for room, mutants in drawn.items():
        left = [mutant for mutant in mutants if mutant.identity not in results]
        if not left:
            continue
        warm.mkdir(parents=True, exist_ok=True)
        outcome, output = run_on(Mutant("", room, "-", "", 0), warm, wide=wide)
        if outcome is not TestOutcome.SURVIVED:
            print(f"{room}: skipped, its tests fail without a mutant\n{output[-2000:]}", flush=True)
            continue
        shutil.rmtree(warm)
        CACHES.rename(warm)
        for mutant in left:
            started = time.monotonic()
            operator = get_operator(mutant.operator)()
            with use_mutation(TREE / mutant.file, operator, mutant.occurrence) as (before, after):
                outcome, output = run_on(mutant, warm, wide=wide)
            lines = zip(before.split("\n"), str(after).split("\n"), strict=False)
            diff = "\n".join(f"- {old}\n+ {new}" for old, new in lines if old != new)
            took_s, by = round(time.monotonic() - started, 1), catcher(outcome, output)
            results[mutant.identity] = {"by": by, "took_s": took_s, "diff": diff}
            kept.write_text(json.dumps(results, indent=1))
            print(f"{room} {took_s} s {mutant.identity} -> {by or 'SURVIVED'}", flush=True)


if __name__ == "__main__":
    main()
