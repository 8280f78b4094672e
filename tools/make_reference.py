"""Write the API reference, `docs/reference/*.md`, from the docstrings: `python tools/make_reference.py [--check]`.

The sources are parsed, not imported, so the tool takes a second. `PAGES` says which modules, classes and functions each
page describes. `tests/docs/test_reference.py` compares the committed pages with the text that this tool makes.
"""

from __future__ import annotations

import ast
import re
import sys
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import griffe

from activesteer.maneuver.kinds import KINDS

ROOT: Final = Path(__file__).resolve().parents[1]
FOLDER: Final = ROOT / "docs" / "reference"
NOTE: Final = "<!-- Written by tools/make_reference.py from the docstrings; do not edit. -->\n"
METRICS: Final = (
    "step_response",
    "sine_with_dwell",
    "path_following",
    "handling",
    "frequency_response",
    "brake_in_turn",
    "straight_braking",
    "general",
)

_RANGED: Final = re.compile(r"Annotated\[(.*), Range\(([-\w.()]+), ([-\w.()]+)\)\]")
_ANNOTATED: Final = re.compile(r"Annotated\[(.*?), \w+\(.*\)\]")


@dataclass(frozen=True)
class Section:
    """One section of a page.

    Attributes:
        title: Heading, or "" to continue the section before.
        module: Module that defines the objects.
        names: Names in the module, in the order of the page; empty for all public names.
        text: Markdown below the heading.
    """

    title: str
    module: str
    names: tuple[str, ...] = ()
    text: str = ""


@dataclass(frozen=True)
class Page:
    """One page: its title, an introduction in Markdown, and its sections."""

    title: str
    introduction: str
    sections: tuple[Section, ...]


PAGES: Final[dict[str, Page]] = {
    "runs": Page(
        "Runs and signals",
        "Run a manoeuvre with `simulate`, or drive it step by step with `Simulation`. The second part "
        "lists every field of the messages that controllers and drivers receive and return. Guides: "
        "[the first run](../index.md), [a loop of your own](../stepping.md).",
        (
            Section("Run a manoeuvre", "activesteer.simulation.runner", ("simulate", "run_scenario")),
            Section("", "activesteer.simulation.preparation", ("prepared",)),
            Section("", "activesteer.scenario.scenario", ("resolve", "Scenario")),
            Section("Drive step by step", "activesteer.simulation.simulation", ("Simulation",)),
            Section("", "activesteer.simulation.closed_loop", ("ClosedLoop",)),
            Section("Signals", "activesteer.signals"),
        ),
    ),
    "recordings": Page(
        "Recordings",
        "Open, read, save and export a recording. Guide: [recordings](../recordings.md).",
        (
            Section("Recording", "activesteer.recording.recording", ("Recording",)),
            Section("", "activesteer.recording.channels", ("ChannelTable",)),
            Section("", "activesteer.recording.reader", ("Poses",)),
            Section("", "activesteer.recording.writer", ("McapWriter",)),
            Section("Export", "activesteer.recording.export", ("to_dataframe", "to_csv", "to_parquet", "to_mat")),
        ),
    ),
    "manoeuvres": Page(
        "Manoeuvres and road",
        "The classes that read manoeuvre files. Their fields are the keys of the TOML files; [keys of "
        "a manoeuvre file](../manoeuvre_keys.md) lists every key with its default and its range. A "
        "key with an SI unit may carry an edge unit instead: `speed_kmh` fills `speed_mps`, "
        "`steering_wheel_deg` fills `steering_wheel_rad`, `rate_degps` fills `rate_radps`, and "
        "`lateral_acceleration_g` fills `lateral_acceleration_mps2`. Guide: "
        "[manoeuvres](../manoeuvres.md).",
        (
            Section("All manoeuvres", "activesteer.maneuver.base", ("Maneuver",)),
            Section("Road", "activesteer.road.road", ("Road", "RoadPatch")),
            *(Section(kind, f"activesteer.maneuver.{kind}") for kind in KINDS),
            Section(
                "",
                "activesteer.maneuver.open_loop_tables",
                ("SteeringTable", "SpeedTable", "BrakeTable", "WheelTorqueTable"),
            ),
        ),
    ),
    "controllers": Page(
        "Controllers and drivers",
        "The interfaces of a controller and a driver, the parameters that they receive, and parts "
        "that you can reuse. Their messages are on the page [runs and signals](runs.md#signals). "
        "Guides: [a controller](../controller.md), [the driver](../driver.md).",
        (
            Section(
                "Controller interface",
                "activesteer.controllers.find",
                ("Controller", "find_controller", "load_controller"),
            ),
            Section(
                "Controller parameters",
                "activesteer.controllers.parameters",
                text="The keys of the table `[controllers]` of a vehicle file, and the `setup` that a controller of "
                "your own receives.",
            ),
            Section("Reusable parts", "activesteer.theory.single_track"),
            Section("", "activesteer.controllers.desired_yaw_rate", ("DesiredYawRate",)),
            Section("", "activesteer.controllers.corrector", ("Corrector",)),
            Section("", "activesteer.controllers.rear_steer", ("RearPrediction",)),
            Section("The paper's controllers", "activesteer.controllers.rear_steer", ("RearSteer",)),
            Section("", "activesteer.controllers.front_superposition", ("FrontSuperposition",)),
            Section("Forms of your own code", "activesteer.plugins.plugin", ("find", "Plugin")),
            Section("Driver interface", "activesteer.driver.base"),
            Section("", "activesteer.driver.find", ("find_driver",)),
            Section("Built-in drivers", "activesteer.driver.human", ("HumanDriver",)),
            Section("", "activesteer.driver.parameters", ("DriverParameters",)),
            Section("", "activesteer.driver.path_preview", ("PathPreviewDriver",)),
            Section("", "activesteer.driver.open_loop", ("OpenLoopDriver",)),
        ),
    ),
    "tyres": Page(
        "Tyres",
        "Read and write Magic Formula tyre files, evaluate the formula, and measure a tyre on the "
        "rig. Guide: [a tyre](../tyre.md).",
        (
            Section("Tyre files", "activesteer.tyre.file.tir", ("load_tir",)),
            Section("", "activesteer.tyre.file.writer", ("write_tir",)),
            Section("", "activesteer.tyre.tyre_parameters", ("TyreParameters",)),
            Section("Evaluation", "activesteer.tyre.evaluation", ("MagicFormula", "TyreForces")),
            Section("", "activesteer.tyre.kernels.limits", ("Limit",)),
            Section("Tyre rig", "activesteer.rigs.tyre_rig", ("TyreRig",)),
        ),
    ),
    "vehicle": Page(
        "Vehicle and rigs",
        "The keys of a vehicle file, the car in the engine, the kinematics and compliance rig, "
        "identification and linearisation. Guides: [the car](../car.md), [the "
        "suspension](../suspension.md).",
        (
            Section("Keys of a vehicle file", "activesteer.vehicle.parameters"),
            Section("The car in the engine", "activesteer.vehicle.car", ("Vehicle",)),
            Section("Kinematics and compliance", "activesteer.rigs.kc.rig", ("kinematics_compliance",)),
            Section("", "activesteer.rigs.kc.result", ("KcResult",)),
            Section("Identification", "activesteer.studies.linear.identification"),
            Section("Linearisation", "activesteer.studies.linear.linearisation"),
        ),
    ),
    "analysis": Page(
        "Analysis",
        "Metrics by kind of manoeuvre, the paper's claims, figures and the report. All of them read "
        "recordings only. Guides: [recordings](../recordings.md), [claims](../claims.md).",
        (
            Section("Metrics", "activesteer.analysis.metrics", ("metrics",)),
            *(Section(kind, f"activesteer.analysis.{kind}") for kind in METRICS),
            Section("Claims", "activesteer.analysis.claims.claim", ("Claim",)),
            Section("Figures", "activesteer.analysis.figures", ("draw_all", "figure_for")),
            Section("Report", "activesteer.analysis.report.run_page", ("write_report",)),
        ),
    ),
    "playback": Page(
        "Playback",
        "Recordings in the rerun viewer. Guide: [recordings](../recordings.md).",
        (
            Section("Runs", "activesteer.playback.runs", ("runs_of", "Run")),
            Section("Viewer", "activesteer.playback.viewer", ("save", "serve", "show")),
        ),
    ),
    "errors": Page(
        "Errors and conventions",
        "Every error derives from `ActiveSteerError`; each kind of input has one class.",
        (
            Section("Errors", "activesteer.errors"),
            Section("Axes, signs and constants", "activesteer.conventions"),
            Section("Names and files", "activesteer.resources"),
        ),
    ),
}


def text_of(page: Page) -> str:
    """Return the Markdown of a page."""
    parts = [f"# {page.title}\n", NOTE, textwrap.fill(page.introduction, 120, break_on_hyphens=False) + "\n"]
    for section in page.sections:
        parts += _section(section)
    return "\n".join(parts)


def _section(section: Section) -> Iterator[str]:
    module = _module(section.module)
    if section.title:
        yield f"## {section.title}\n"
    if section.text:
        yield f"{section.text}\n"
    if not section.names:
        yield f"Module `{section.module}`.\n"
        yield from _docstring(module, 3)
    names = section.names or tuple(name for name, member in module.members.items() if _public(module, member))
    constants = [name for name in names if _member(module, name).is_attribute]
    if constants:
        yield from _table(
            ("name", "value", "meaning"), (_constant_row(module, _member(module, name)) for name in constants)
        )
    for name in names:
        member = _member(module, name)
        if member.is_class:
            yield from _class(section.module, member)
        elif member.is_function:
            yield from _function(section.module, member)


def _class(module: str, cls: Any) -> Iterator[str]:
    yield f"### {cls.name}\n"
    bases = ", ".join(f"`{base}`" for base in cls.bases if str(base) not in {"NamedTuple", "Protocol"})
    yield f"`from {_home(module, cls.name)} import {cls.name}`{f'; extends {bases}' if bases else ''}\n"
    init = cls.members.get("__init__")
    if init is not None and init.is_function:
        yield _signature(init, cls.name, bound=True)
    fields = _fields(cls)
    described = _described(cls)
    yield from _docstring(cls, 4, without_attributes=True)
    rows = []
    for field in fields:
        meaning = described.pop(field.name, "") or (field.docstring.value if field.docstring else "")
        rows.append((_code(field.name), _type(field.annotation, cls.module), _code(field.value), meaning))
    if any(row[2] for row in rows):
        yield from _table(("field", "type", "default", "meaning"), rows)
    elif rows:
        yield from _table(("field", "type", "meaning"), ((name, kind, meaning) for name, kind, _, meaning in rows))
    if described:
        yield from _table(("attribute", "meaning"), ((_code(name), meaning) for name, meaning in described.items()))
    properties = [member for member in cls.members.values() if _shown(member) and "property" in member.labels]
    if properties:
        rows = [(_code(item.name), _code(item.annotation), item.docstring.value) for item in properties]
        yield from _table(("property", "type", "meaning"), rows)
    for member in cls.members.values():
        if _shown(member) and member.is_function:
            yield from _function(module, member, owner=cls.name)


def _function(module: str, function: Any, owner: str = "") -> Iterator[str]:
    if owner:
        yield f"#### {owner}.{function.name}\n"
    else:
        yield f"### {function.name}\n"
        yield f"`from {_home(module, function.name)} import {function.name}`\n"
    yield _signature(function, function.name, bound=bool(owner) and "staticmethod" not in function.labels)
    yield from _docstring(function, 5)


def _signature(function: Any, name: str, *, bound: bool) -> str:
    """Return a block with the signature, one parameter a line where it is long."""
    parameters: list[str] = []
    starred = False
    for index, parameter in enumerate(function.parameters):
        if bound and index == 0:
            continue
        kind = parameter.kind.value
        if kind == "keyword-only" and not starred:
            parameters.append("*")
            starred = True
        star = {"variadic positional": "*", "variadic keyword": "**"}.get(kind, "")
        starred = starred or star == "*"
        shown = f"{star}{parameter.name}"
        if parameter.annotation is not None:
            shown += f": {parameter.annotation}"
        if parameter.default is not None and not star:
            shown += f" = {parameter.default}" if parameter.annotation is not None else f"={parameter.default}"
        parameters.append(shown)
    returned = f" -> {function.returns}" if function.returns is not None else ""
    line = f"{name}({', '.join(parameters)}){returned}"
    if len(line) > 100:
        line = "\n".join([f"{name}(", *(f"    {parameter}," for parameter in parameters), f"){returned}"])
    return f"```py\n{line}\n```\n"


def _docstring(item: Any, level: int, *, without_attributes: bool = False) -> Iterator[str]:  # noqa: PLR0912 - one case a kind
    if item.docstring is None:
        return
    for section in griffe.parse(item.docstring, "google", warnings=False):
        kind = section.kind.value
        match kind:
            case "text":
                yield f"{_markdown(section.value)}\n"
            case "parameters" | "other parameters":
                rows = ((_code(entry.name), entry.description) for entry in section.value)
                yield from _table(("argument", "meaning"), rows)
            case "attributes":
                if not without_attributes:
                    rows = ((_code(entry.name), entry.description) for entry in section.value)
                    yield from _table(("name", "meaning"), rows)
            case "returns" | "yields":
                text = " ".join(_returned(entry) for entry in section.value)
                yield f"**{kind.capitalize()}:** {_line(text)}\n"
            case "raises":
                rows = ((_code(entry.annotation), entry.description) for entry in section.value)
                yield from _table(("raises", "when"), rows)
            case "examples":
                for form, value in section.value:
                    shown = f"```pycon\n{value}\n```" if form.value == "examples" else _markdown(value)
                    yield f"{shown}\n"
            case "admonition" if section.title == "Example":
                yield f"```pycon\n{section.value.contents}\n```\n"
            case "admonition":
                yield f"**{section.title}:** {_markdown(section.value.contents)}\n"
            case _:
                raise ValueError(f"{item.path}: a docstring section of the kind {kind!r} is not written")


def _returned(entry: Any) -> str:
    """Return the text of a "Returns" section; the parser takes what stands before its first colon for a type."""
    annotation = entry.annotation
    own = isinstance(annotation, str) and annotation
    return (
        f"{annotation}: {entry.description}" if own else f"{entry.name + ': ' if entry.name else ''}{entry.description}"
    )


def _described(cls: Any) -> dict[str, str]:
    if cls.docstring is None:
        return {}
    return {
        entry.name: entry.description
        for section in griffe.parse(cls.docstring, "google", warnings=False)
        if section.kind.value == "attributes"
        for entry in section.value
    }


def _fields(cls: Any) -> list[Any]:
    """Return the annotated names in the body of a class, which make a dataclass or a message."""
    return [
        member
        for member in cls.members.values()
        if member.is_attribute
        and not member.name.startswith("_")
        and member.annotation is not None
        and "property" not in member.labels
        and not str(member.annotation).startswith("ClassVar")
    ]


def _constant_row(module: Any, constant: Any) -> tuple[str, str, str]:
    value = str(constant.value) if constant.value is not None else ""
    meaning = constant.docstring.value if constant.docstring is not None else ""
    return _code(constant.name), _code(value if len(value) <= 60 else "..."), meaning


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[str]:
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(_line(cell).replace("|", "\\|") for cell in row) + " |" for row in rows]
    yield "\n".join(lines) + "\n"


def _code(value: Any) -> str:
    text = "" if value is None else str(value)
    return f"`{text}`" if text else ""


def _type(annotation: Any, module: Any) -> str:
    """Return the type of a field, with its range in words where it has one; private aliases are resolved."""
    alias = module.members.get(str(annotation)) if str(annotation).startswith("_") else None
    if alias is not None and alias.is_attribute:
        annotation = alias.value
    ranged = _RANGED.fullmatch(str(annotation))
    if ranged:
        return f"{_code(ranged[1])}, {ranged[2]} to {ranged[3]}"
    annotated = _ANNOTATED.fullmatch(str(annotation))
    return _code(annotated[1] if annotated else annotation)


def _line(text: str) -> str:
    return " ".join(text.split())


def _markdown(text: str) -> str:
    """Return docstring text as Markdown: indented blocks become fenced ones, which phones can scroll."""
    lines, fenced = [], False
    for line in text.splitlines():
        if line.startswith("    ") and not fenced and (not lines or not lines[-1].strip()):
            lines.append("```text")
            fenced = True
        elif fenced and line.strip() and not line.startswith("    "):
            while not lines[-1].strip():
                lines.pop()
            lines += ["```", ""]
            fenced = False
        lines.append(line[4:] if fenced else line)
    return "\n".join([*lines, "```"] if fenced else lines)


def _home(module: str, name: str) -> str:
    """Return where a user imports a name from: the package itself where it offers the name."""
    return "activesteer" if name in _offered() else module


@cache
def _offered() -> frozenset[str]:
    text = (ROOT / "activesteer" / "__init__.py").read_text(encoding="utf-8")
    found = re.search(r"^__all__ = (\[.*?\])", text, re.MULTILINE | re.DOTALL)
    return frozenset(ast.literal_eval(found[1])) if found else frozenset()


def _public(module: Any, member: Any) -> bool:
    """Return whether a page on a whole module describes a member: it is defined there and has a docstring."""
    return not member.is_alias and not member.name.startswith("_") and member.docstring is not None


def _shown(member: Any) -> bool:
    return not member.is_alias and not member.name.startswith("_") and member.docstring is not None


def _member(module: Any, name: str) -> Any:
    """Return a member of a module, from the module that defines it."""
    member = module.members.get(name)
    if member is None:
        raise LookupError(f"tools/make_reference.py: {module.path} has no {name}")
    if member.is_alias:
        home, _, name = member.target_path.rpartition(".")
        return _member(_module(home), name)
    return member


@cache
def _module(name: str) -> Any:
    path = ROOT.joinpath(*name.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    if not file.is_file():
        raise LookupError(f"tools/make_reference.py: there is no module {name}")
    return griffe.visit(name, filepath=file, code=file.read_text(encoding="utf-8"))


def main() -> None:
    """Write the pages; with `--check`, name those that would change and exit with 1."""
    outdated = []
    for name, page in PAGES.items():
        file, text = FOLDER / f"{name}.md", text_of(page)
        if not file.is_file() or file.read_text(encoding="utf-8") != text:
            outdated.append(file.relative_to(ROOT).as_posix())
            if "--check" not in sys.argv:
                file.write_text(text, encoding="utf-8")
    print("\n".join(outdated) or "up to date")
    if outdated and "--check" in sys.argv:
        sys.exit(1)


if __name__ == "__main__":
    main()
