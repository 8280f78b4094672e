"""What the page asks for, and when: its scripts without a browser."""

from __future__ import annotations

import json
import shutil
import subprocess
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(str(resources.files("activesteer.explore"))) / "page"


def script(tmp_path: Path, text: str) -> Any:
    """Return what a script that imports modules of the page prints as JSON."""
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed: apt-get install nodejs")
    for name in ("asking", "number"):
        (tmp_path / f"{name}.mjs").write_text((PAGE / f"{name}.js").read_text("utf-8"))
    imports = 'import { Asking, untickBeyond } from "./asking.mjs";\nimport { number } from "./number.mjs";\n'
    (tmp_path / "test.mjs").write_text(f"{imports}{text}")
    done = subprocess.run([node, tmp_path / "test.mjs"], capture_output=True, text=True, timeout=60, check=True)
    return json.loads(done.stdout)


def asked(tmp_path: Path, events: str) -> list[Any]:
    """Return the values of the slider that are sent, each with whether it was dragged."""
    return script(
        tmp_path,
        f"""let value = 0;
        const sent = [], asking = new Asking((dragging) => sent.push([value, dragging]));
        const drag = (to) => {{ value = to; asking.ask(true); }}, rest = () => asking.ask(false);
        {events}
        console.log(JSON.stringify(sent));""",
    )


def test_a_moving_slider_lets_the_runs_in_progress_end_and_then_takes_the_newest_value(tmp_path: Path) -> None:
    assert asked(tmp_path, "drag(1); drag(2); drag(3);") == [[1, True]]
    assert asked(tmp_path, "drag(1); drag(2); drag(3); asking.finished();") == [[1, True], [3, True]]
    assert asked(tmp_path, "drag(1); asking.finished(); asking.finished(); drag(2);") == [[1, True], [2, True]]


def test_a_slider_that_is_let_go_does_not_wait(tmp_path: Path) -> None:
    assert asked(tmp_path, "drag(1); drag(2); rest(); asking.finished();") == [[1, True], [2, False]]


def test_another_manoeuvre_does_not_wait_for_runs_that_are_dropped(tmp_path: Path) -> None:
    assert asked(tmp_path, "drag(1); drag(2); asking.stop(); drag(3);") == [[1, True], [3, True]]


@pytest.mark.parametrize(
    ("own", "ticked", "unticked"),
    [("", "e", ["e"]), ("", "a", ["a"]), ("", None, ["e"]), ("my.py:C", None, ["d", "e"])],
)
def test_a_controller_beyond_the_limit_is_unticked_and_named(
    tmp_path: Path, own: str, ticked: str | None, unticked: list[str]
) -> None:
    result = script(
        tmp_path,
        f"""const boxes = [..."abcde"].map((value) => ({{ value, checked: true }}));
        const ticked = boxes.find((box) => box.value === {json.dumps(ticked)});
        const names = untickBeyond(4, boxes, {json.dumps(own)}, ticked);
        console.log(JSON.stringify([names, boxes.filter((box) => !box.checked).map((box) => box.value)]));""",
    )
    assert result == [unticked, unticked]


def test_four_controllers_stay_ticked(tmp_path: Path) -> None:
    text = (
        'console.log(JSON.stringify(untickBeyond(4, [..."abc"].map((value) => ({ value, checked: true })), "x.py:C")));'
    )
    assert script(tmp_path, text) == []


def test_enter_in_a_field_cannot_submit_the_page() -> None:
    assert "<form" not in (PAGE / "index.html").read_text("utf-8")


def test_numbers_are_whole_where_they_count_and_zero_has_no_sign(tmp_path: Path) -> None:
    values = "[[0, 0], [-0.04, 1], [-0.06, 1], [2.5], [-123.45], [null]]"
    texts = script(tmp_path, f"console.log(JSON.stringify({values}.map(([value, digits]) => number(value, digits))));")
    assert texts == ["0", "0.0", "\N{MINUS SIGN}0.1", "2.50", "\N{MINUS SIGN}123.5", "\N{EN DASH}"]
