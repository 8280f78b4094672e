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
    for name in ("asking", "number", "socket"):
        (tmp_path / f"{name}.mjs").write_text((PAGE / f"{name}.js").read_text("utf-8"))
    imports = 'import { Asking, untickBeyond } from "./asking.mjs";\nimport { number } from "./number.mjs";\n'
    (tmp_path / "test.mjs").write_text(f"{imports}{text}")
    done = subprocess.run([node, tmp_path / "test.mjs"], capture_output=True, text=True, timeout=60, check=True)
    return json.loads(done.stdout)


def used(tmp_path: Path, events: str, address: str = "") -> Any:
    """Return what the page has after events, with a fake document and a fake program."""
    explore = (PAGE / "explore.js").read_text("utf-8")
    for name in ("curves", "drive", "look", "scene", "socket"):
        explore = explore.replace(f"./{name}.js", "./fake.mjs")
    (tmp_path / "explore.mjs").write_text(explore.replace("./asking.js", "./asking.mjs"))
    (tmp_path / "fake.mjs").write_text(Path(__file__).with_name("fake_page.js").read_text("utf-8"))
    return script(
        tmp_path,
        f"""import {{ $, describe, disconnect, drag, finish, hear, sent, slider, start, tick, type }} from "./fake.mjs";
        location.hash = {json.dumps(address)};
        await import("./explore.mjs");
        start();
        const before = sent.splice(0);
        {events}
        const runs = sent.filter((one) => one.kind === "run").map((one) => [one.values.speed_kmh, one.dragging]);
        const {{ title, message, state, saved }} = Object.fromEntries(
          ["title", "message", "state", "saved"].map((id) => [id, $(id).textContent]));
        console.log(JSON.stringify({{ before, sent, runs, title, message, state, saved, address: location.hash }}));""",
    )


def driven(tmp_path: Path, events: str) -> Any:
    """Return the messages of a drive after events, with a fake document and a fake program."""
    drive = (
        (PAGE / "drive.js").read_text("utf-8").replace("./look.js", "./fake.mjs").replace("./scene.js", "./fake.mjs")
    )
    (tmp_path / "drive.mjs").write_text(drive)
    (tmp_path / "fake.mjs").write_text(Path(__file__).with_name("fake_page.js").read_text("utf-8"))
    return script(
        tmp_path,
        f"""import {{ $ }} from "./fake.mjs";
        import {{ Drive, nextSide, wayBack }} from "./drive.mjs";
        const sent = [], unhint = () => {{ sent.unhinted = (sent.unhinted ?? 0) + 1; }};
        const drive = new Drive({{ send: (message) => sent.push(message) }}, () => {{}}, unhint);
        const key = (name, down = true) => $("window").fire(down ? "keydown" : "keyup", {{ key: name }});
        const ready = () => drive.begin({{ id: drive.asked, cones: [], lanes: [], line: [], radius_m: 0 }}, []);
        const frame = (more) => drive.frame({{ time_s: 1, speed_kmh: 60, sideslip_deg: 0, friction_use: 1.02,
          ay_mps2: 0, yaw_rate_degps: 0, steering_wheel_deg: 0, cones: [], controller: "none", hold_kmh: 55,
          penalty_s: 0, ...more }}, [[0, 0, 0]]);
        const gauge = (name) => {{
          const box = $("gauges").children.find((one) => one.children[0].words === name);
          return box.hidden ? null : box.lastElementChild.textContent;
        }};
        $("drive-mu").max = $("drive-speed").max = 200;
        $("course").value = "slalom";
        $("drive-vehicle").value = "compact";
        $("drive-controller").value = "none";
        $("hold").checked = true;
        drive.startAt(60, 0.9);
        drive.show(true);
        {events}
        const starts = sent.filter((one) => one.kind === "start");
        const steered = sent.filter((one) => one.steer != null).map((one) => one.steer);
        const go = sent.filter((one) => one.go).length, result = globalThis.seen;
        console.log(JSON.stringify({{
          sent, starts: starts.map((one) => [one.speed_kmh, one.mu, one.controllers[0]]), steered, go, result }}));""",
    )


GO = "ready(); $('start').fire('click'); drive.going();"
ENDED = "drive.ended({ time_s: 3, behind_s: 0, file: 'drive.mcap', folder: '/f', error: '' });"


def test_a_restart_drives_at_once_with_the_friction_and_the_controller_chosen_while_driving(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""{GO} frame();
        $("drive-mu").value = "0.35"; $("drive-mu").fire("input");
        key("4"); key("r"); {ENDED} ready(); drive.going();""",
    )
    assert page["starts"] == [[60, 0.9, "none"], [60, 0.35, "lqr"]]  # the speed is that of the start
    assert page["go"] == 2  # without a second press of the button
    assert driven(tmp_path, f"{GO} frame(); $('end').fire('click'); {ENDED} ready();")["go"] == 1


def test_a_key_held_before_the_start_steers_from_the_start(tmp_path: Path) -> None:
    held = driven(tmp_path, f"key('ArrowLeft'); {GO} drive.hands();")
    assert held["steered"] == [1]
    let_go = driven(tmp_path, f"key('ArrowLeft'); key('ArrowLeft', false); {GO} drive.hands();")
    assert let_go["steered"] == [0]
    after = driven(tmp_path, f"{GO} frame(); key('a'); key('r'); {ENDED} ready(); drive.going(); drive.hands();")
    assert after["steered"] == [1, 1]  # still held after a restart


def test_a_drive_that_has_ended_can_be_opened_as_a_report(tmp_path: Path) -> None:
    shown = "$('drive-report').hidden"
    page = driven(
        tmp_path,
        f"""const seen = [{shown}]; {GO} frame(); {ENDED} seen.push({shown}); $("drive-report").fire("click");
        {GO} seen.push({shown}); globalThis.seen = seen;""",
    )
    assert page["result"][1:] == [False, True]
    assert {"kind": "report", "drive": True} in page["sent"]


def test_gauges_show_at_most_all_grip_and_only_angles_that_the_controller_adds(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""{GO} globalThis.seen = [];
        const see = () => seen.push(["grip used", "rear steer", "front steer added"].map(gauge));
        frame({{ rear_deg: null, superposition_deg: null }}); see();
        frame({{ controller: "ars", rear_deg: 1.25, superposition_deg: null }}); see();
        frame({{ controller: "ars", rear_deg: null, superposition_deg: null }}); see();
        frame({{ controller: "none", rear_deg: null, superposition_deg: null }}); see();""",
    )
    assert page["result"] == [
        ["100 %", "\N{EN DASH}", "\N{EN DASH}"],
        ["100 %", "1.3°", "\N{EN DASH}"],
        ["100 %", "0.0°", "\N{EN DASH}"],  # straight ahead, still a controller with rear steering
        ["100 %", "\N{EN DASH}", "\N{EN DASH}"],
    ]


def test_the_last_lap_on_a_circle_stands_behind_the_stroke(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""{GO} globalThis.seen = [];
        const labels = [], label = (box) => box.children[0].textContent.startsWith("time");
        const see = (more) => {{
          frame(more); seen.push(gauge("time"));
          labels.push($("gauges").children.find(label).children[0].textContent); }};
        drive.rounds = drive.timed = true;
        see({{ lap_s: 5.2, last_lap_s: null }}); see({{ lap_s: 0.4, last_lap_s: 18.7 }});
        drive.ghost = {{ lap_s: 20, frames: [{{ time_s: 0, poses: [0, 0, 0] }}] }};
        see({{ lap_s: 0.4, last_lap_s: null }}); see({{ lap_s: 0.4, last_lap_s: 18.7 }});
        seen.push(...labels);""",
    )
    assert page["result"][:4] == ["5.2 s", "0.4 / 18.7 s", "0.4 / 20.0 s", "0.4 / 18.7 s"]
    assert page["result"][4:] == ["time", "time / last lap", "time / ghost", "time / last lap"]


def test_a_drive_that_ends_early_says_how_far_it_came(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""{GO} drive.timed = true; drive.struck = 1; drive.scene.cones = [1]; frame({{ last_lap_s: null }});
        drive.ended({{ time_s: 3, behind_s: 0, file: "a", folder: "/", error: "", early: "ended after 1 of 6 cones" }});
        globalThis.seen = [$("driven").children[0].words];""",
    )
    assert page["result"] == ["No time: ended after 1 of 6 cones, 1\N{NO-BREAK SPACE}cone hit."]


def test_a_car_that_stands_is_drawn_with_all_pixels_again(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""globalThis.seen = []; drive.scene.moving = (is) => seen.push(is);
        {GO} frame(); key("r"); {ENDED} ready(); drive.going(); frame(); $("end").fire("click"); {ENDED}""",
    )
    assert page["result"] == [True, True, False]


def test_the_lap_before_a_restart_is_told_at_the_end(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""const saved = (file) => drive.ended({{ time_s: 3, behind_s: 0, file, folder: "/f", error: "" }});
        const told = () => $("driven").children.map((one) => one.words ?? one).join("").trim();
        {GO} drive.way = "Last lap"; frame({{ lap_s: 1, last_lap_s: 18.57 }});
        key("r"); saved("first.mcap"); ready(); drive.going();
        frame({{ last_lap_s: null }}); key("r"); saved("second.mcap"); ready(); drive.going();
        frame({{ last_lap_s: null }}); $("end").fire("click"); saved("third.mcap");
        globalThis.seen = [told()]; {GO} frame({{ last_lap_s: null }}); saved("fourth.mcap"); seen.push(told());""",
    )
    told = [text.replace("\N{NO-BREAK SPACE}", " ") for text in page["result"]]
    assert told[0].startswith("Before the restart: last lap 18.57 s, saved as first.mcap. 3.0 s driven")
    assert told[1].startswith("3.0 s driven")


def test_the_gauges_of_the_end_stay_until_the_next_start_and_a_waiting_car_uses_no_grip(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""globalThis.seen = [];
        ready(); frame(); seen.push(gauge("grip used"));
        {GO} frame({{ speed_kmh: 42 }}); seen.push(gauge("grip used"), gauge("speed"));
        {ENDED} ready(); frame({{ time_s: 0, speed_kmh: 60 }}); seen.push(gauge("speed"));
        $("start").fire("click"); drive.going(); frame({{ speed_kmh: 60 }}); seen.push(gauge("speed"));
        {ENDED} drive.control("ars"); ready(); frame({{ speed_kmh: 55 }}); seen.push(gauge("speed"));""",
    )
    assert page["result"] == ["\N{EN DASH}", "100 %", "42 km/h", "42 km/h", "60 km/h", "55 km/h"]


def test_an_arrow_points_back_to_a_course_that_was_left(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        """const plane = { radius_m: 0, lanes: [], cones: [], line: [] }, pad = { ...plane, radius_m: 40 };
        const course = { ...plane, cones: [[80, 0], [50, 0]], line: [[0, 0], [50, 2], [80, -2], [90, 0]] };
        globalThis.seen = [wayBack(course, 49, 3), wayBack(course, 40, 30), wayBack(course, 60, 30),
          wayBack(course, 200, 0), wayBack(pad, 100, 40), wayBack(pad, 0, 1), wayBack(plane, 900, 900)];""",
    )
    next_one, second, start, circle = {"x": 50, "y": 0}, {"x": 80, "y": 0}, {"x": 0, "y": 0}, {"x": 40, "y": 40}
    assert page["result"] == [None, next_one, second, start, circle, None, None]


def test_the_next_cone_of_a_slalom_has_the_side_on_which_the_line_passes_it(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        """const line = [[0, 0], [50, 2], [80, -2], [110, 0]];
        const course = { lanes: [], cones: [[50, 0], [80, 0], [110, -2], [110, 2]], line };
        globalThis.seen = [0, 55, 90].map((x) => nextSide(course, x)?.side ?? null);""",
    )
    assert page["result"] == [1, -1, None]  # a pair of cones is a gate


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


@pytest.mark.parametrize(("ticked", "unticked"), [("e", ["e"]), ("a", ["a"]), (None, ["e"])])
def test_a_controller_beyond_the_limit_is_unticked_and_named(
    tmp_path: Path, ticked: str | None, unticked: list[str]
) -> None:
    result = script(
        tmp_path,
        f"""const boxes = [..."abcde"].map((value) => ({{ value, checked: true }}));
        const ticked = boxes.find((box) => box.value === {json.dumps(ticked)});
        const names = untickBeyond(4, boxes, ticked);
        console.log(JSON.stringify([names, boxes.filter((box) => !box.checked).map((box) => box.value)]));""",
    )
    assert result == [unticked, unticked]


def test_a_jump_between_two_neighbouring_values_is_a_gap_that_can_be_seen(tmp_path: Path) -> None:
    shared = (Path(str(resources.files("activesteer.pages"))) / "templates" / "touch.js").read_text("utf-8")
    gaps = "wideGaps(null, 1, 0, 9, [[10, 10], [40, 60]])"
    wide = script(tmp_path, f"globalThis.devicePixelRatio = 1;\n{shared}\nconsole.log(JSON.stringify({gaps}));")
    assert wide == [[8, 12], [38, 62]]


def test_numbers_are_whole_where_they_count_and_zero_has_no_sign(tmp_path: Path) -> None:
    values = "[[0, 0], [-0.04, 1], [-0.06, 1], [2.5], [-123.45], [null], [7000000, 0], [1234.5, 1]]"
    texts = script(tmp_path, f"console.log(JSON.stringify({values}.map(([value, digits]) => number(value, digits))));")
    assert texts == ["0", "0.0", "\N{MINUS SIGN}0.1", "2.50", "\N{MINUS SIGN}123.5", "\N{EN DASH}",
                     "7\N{NARROW NO-BREAK SPACE}000\N{NARROW NO-BREAK SPACE}000", "1234.5"]  # fmt: skip


def test_the_page_drives_the_newest_value_once_the_runs_in_progress_are_shown(tmp_path: Path) -> None:
    page = used(tmp_path, "drag(90); drag(100); drag(110); finish(); slider().fire('change');")
    assert page["runs"] == [[90, True], [110, True], [110, False]]


@pytest.mark.parametrize(("text", "value", "shown", "words"), [
    ("83.7", 83.7, "83.7", ""),
    ("83,7", 83.7, "83.7", ""),
    ("900", 160, "160", "speed 900 is outside 20 to 160 km/h"),
    ("abc", None, "80", "speed: abc is not a number. The value stays."),
    ("", None, "80", ""),
])  # fmt: skip
def test_a_typed_value_is_driven_as_it_is(
    text: str, value: float | None, shown: str, words: str, tmp_path: Path
) -> None:
    page = used(tmp_path, f"$('saved').textContent = type({json.dumps(text)}).value;")
    assert page["runs"] == ([] if value is None else [[value, False]])
    assert page["saved"] == shown
    assert (words in page["message"]) if words else page["message"] == ""


def test_sliders_of_the_choice_before_cannot_be_moved(tmp_path: Path) -> None:
    page = used(
        tmp_path,
        """const shown = () => [$("sliders").inert, $("reset").disabled], steps = [shown()];
        drag(90); steps.push(shown()); tick("lqr", true); steps.push(shown()); describe(); steps.push(shown());
        $("saved").textContent = JSON.stringify(steps);""",
    )
    assert json.loads(page["saved"]) == [[False, True], [False, False], [True, True], [False, False]]


def test_runs_of_two_values_are_never_shown_together(tmp_path: Path) -> None:
    page = used(
        tmp_path,
        """const steps = [], shown = () => [...window.activesteer.runs.values()];
        const seen = () => steps.push([$("title").textContent, ...shown().map(({ title }) => title)]);
        const run = (name, title) => {
          hear({ kind: "run", id: sent.at(-1).id, name, title, figures: [], losses: [] }, [undefined]); seen(); };
        const finished = () => { hear({ kind: "finished", id: sent.at(-1).id, command: "", python: "" }, []); seen(); };
        tick("lqr", true); describe(); run("none", "80"); run("lqr", "80"); finished();
        drag(83); run("none", "83"); run("lqr", "83"); finished();
        $("saved").textContent = JSON.stringify(steps);""",
    )
    one, both, next_value = ["80", "80"], ["80", "80", "80"], ["83", "83", "83"]
    assert json.loads(page["saved"]) == [one, both, both, both, both, next_value]


def test_a_failed_run_does_not_stop_the_next_value(tmp_path: Path) -> None:
    page = used(
        tmp_path, "drag(90); drag(100); hear({ kind: 'error', text: 'no', about: 'run', id: sent.at(-1).id }, []);"
    )
    assert page["runs"] == [[90, True], [100, True]]


def test_results_of_a_choice_that_failed_cannot_be_saved_and_the_error_goes_with_its_cause(tmp_path: Path) -> None:
    shown = """const shown = () => [$("save").disabled, $("command").textContent, $("message").textContent];
        const fail = () => hear({ kind: "error", text: "too slippery", about: "run", id: sent.at(-1).id }, []);"""
    page = used(
        tmp_path,
        shown
        + """const steps = [shown()];
        drag(90); fail(); steps.push(shown());
        drag(80);
        hear({ kind: "error", text: "of an older choice", about: "run", id: sent.at(-1).id - 1 }, []);
        steps.push(shown());
        hear({ kind: "run", id: sent.at(-1).id, name: "none", title: "", figures: [], losses: [] }, [undefined]);
        hear({ kind: "finished", id: sent.at(-1).id, command: "activesteer run", python: "" }, []); steps.push(shown());
        $("saved").textContent = JSON.stringify(steps);""",
    )
    before, failed, driving, driven = json.loads(page["saved"])
    assert before[0]  # its only run has failed
    assert failed == [True, "", "too slippery"]
    assert driving == [True, "", "too slippery"]
    assert driven == [False, "activesteer run", ""]


def test_a_held_key_drives_on_the_way_and_once_more_at_the_end(tmp_path: Path) -> None:
    press = 'slider().fire("keydown", { key: "PageUp" });'
    page = used(tmp_path, f'{press} {press} finish(); slider().fire("keyup", {{ key: "PageUp" }});')
    assert page["runs"] == [[90, True], [100, True], [100, False]]


def test_four_controllers_are_asked_for_and_a_fifth_is_unticked_with_a_message(tmp_path: Path) -> None:
    page = used(tmp_path, 'tick("lqr", true); tick("esc", true);')
    assert [message["controllers"] for message in page["sent"]] == [["none", "ars", "afs", "lqr"]]  # not driven again
    assert page["message"].startswith("esc is not driven")


def test_without_a_controller_nothing_is_driven_and_the_page_says_why(tmp_path: Path) -> None:
    untick = " ".join(f"tick('{name}', false);" for name in ("ars", "afs", "none"))
    page = used(tmp_path, f"{untick} sent.length = 0; drag(90); slider().fire('change');")
    assert page["sent"] == []
    assert page["message"] == "Choose at least one controller."


def test_another_controller_leaves_the_sliders_where_they_are(tmp_path: Path) -> None:
    page = used(tmp_path, "drag(120); finish(); tick('lqr', true); describe();")
    assert page["runs"] == [[120, True], [120, False]]


def test_an_address_names_own_files_and_values_of_sliders(tmp_path: Path) -> None:
    address = "#maneuver=mine.toml&controllers=none,my.py:C%3Fgain=2&speed_kmh=95"
    page = used(tmp_path, "", address)
    first, run = page["before"]
    assert (first["maneuver"], first["vehicle"], first["controllers"]) == (
        "mine.toml",
        "compact",
        ["none", "my.py:C?gain=2"],
    )
    assert run["values"] == {"speed_kmh": 95}
    assert "maneuver=mine.toml" in page["address"]
    assert "speed_kmh=95" in page["address"]


@pytest.mark.parametrize(("address", "value", "words"), [
    ("speed_kmh=abc", None, "speed_kmh=abc is not a number"),
    ("speed_kmh=999", 160, "speed 999 is outside 20 to 160 km/h"),
    ("speed_kmh=90&sped=3", 90, "a key without a slider here: sped."),
    ("speed_kmh=90", 90, ""),
])  # fmt: skip
def test_what_is_wrong_in_an_address_is_told(address: str, value: float | None, words: str, tmp_path: Path) -> None:
    page = used(tmp_path, "", f"#maneuver=step_steer&controllers=none&{address}")
    assert page["before"][-1]["values"] == ({} if value is None else {"speed_kmh": value})
    assert (words in page["message"]) if words else page["message"] == ""


def test_an_address_without_a_controller_asks_for_one(tmp_path: Path) -> None:
    page = used(tmp_path, "", "#maneuver=step_steer&controllers=")
    assert page["before"] == []
    assert page["message"] == "Choose at least one controller."


def test_the_address_of_a_drive_is_checked(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        """$("drive-speed").min = 20;
        globalThis.seen = [{ drive: "slalom", speed_kmh: "abc" }, { drive: "slalm" }, { drive: "slalom", sped: "3" },
          { drive: "slalom", speed_kmh: "900" }, { drive: "slalom", speed_kmh: "50" }].map((one) => drive.choose(one));
        seen.push(drive.start_kmh);""",
    )
    number, course, key, outside, right, speed_kmh = page["result"]
    assert number.startswith("speed_kmh=abc is not a number")
    assert "There is no course slalm" in course
    assert "unknown key: sped" in key
    assert "outside 20 to 200" in outside
    assert right == ""
    assert speed_kmh == 50


def test_a_hint_goes_with_the_next_action(tmp_path: Path) -> None:
    fifth = 'tick("lqr", true); describe(); tick("esc", true);'
    assert used(tmp_path, fifth)["message"].startswith("esc is not driven")
    for action in ("$('save').fire('click');", "drag(90);"):
        assert used(tmp_path, fifth + action)["message"] == ""
    error = "hear({ kind: 'error', text: 'no such file', about: null }, []);"
    assert used(tmp_path, error + "$('save').fire('click');")["message"] == "no such file"  # an error stays


@pytest.mark.parametrize("action", [
    "$('vehicle').fire('change');", "tick('lqr', true);", "drag(90);", "$('reset').fire('click');",
    "location.hash = '#drive=slalom'; $('window').fire('hashchange');",
])  # fmt: skip
def test_after_the_connection_is_lost_every_choice_says_so(action: str, tmp_path: Path) -> None:
    page = used(tmp_path, f"disconnect('opened in another window'); $('close').fire('click'); {action}")
    assert page["sent"] == []
    assert page["message"] == "opened in another window"
    assert page["state"] == ""


def test_without_a_connection_no_car_is_prepared(tmp_path: Path) -> None:
    page = driven(
        tmp_path,
        f"""{GO} frame(); drive.socket.send = () => drive.lost(); drive.lost();
        const seen = [$("start").textContent, $("start").disabled, $("end").hidden, drive.running];
        $("course").fire("change"); globalThis.seen = [...seen, $("start").textContent];""",
    )
    told = "Cannot drive: no connection"
    assert page["result"] == [told, True, True, False, told]


def test_runs_with_the_same_remark_are_named_together(tmp_path: Path) -> None:
    page = used(
        tmp_path,
        """const id = before.at(-1).id, figures = [], losses = [];
        for (const [name, remark] of [["none", "slides."], ["ars", ""], ["my.py:Own", "slides."]])
          hear({ kind: "run", id, name, title: "", note: "The search fails.", remark, figures, losses }, [undefined]);
        $("saved").textContent = $("note").textContent;""",
    )
    assert page["saved"] == "The search fails. none, Own: slides."


def test_a_failure_has_the_whole_row_of_the_table(tmp_path: Path) -> None:
    page = used(
        tmp_path,
        """const id = before.at(-1).id, losses = ["misses 2 cones", "hits 1 cone"];
        hear({ kind: "run", id, name: "none", title: "", figures: [], losses }, [undefined]);
        hear({ kind: "run", id, name: "ars", title: "", figures: [], losses: [] }, [undefined]);
        $("saved").textContent = JSON.stringify($("figures").querySelectorAll("td")
          .map(({ words, attributes }) => [words, attributes.colspan]));""",
    )
    assert json.loads(page["saved"]) == [["none fails: misses 2 cones; hits 1 cone", 3]]


def test_two_lost_cars_have_no_change_between_them(tmp_path: Path) -> None:
    page = used(
        tmp_path,
        """const of = (lost, value) => [{ title: "Largest sideslip angle", unit: "deg", value, digits: null, lost }];
        const id = sent.at(-1)?.id ?? before.at(-1).id;
        hear({ kind: "run", id, name: "none", title: "", figures: of(true, null), losses: [] }, [undefined]);
        hear({ kind: "run", id, name: "ars", title: "", figures: of(true, null), losses: [] }, [undefined]);
        hear({ kind: "run", id, name: "afs", title: "", figures: of(false, 3), losses: [] }, [undefined]);
        $("saved").textContent = JSON.stringify($("figures").querySelectorAll("td").map(({ words }) => words));""",
    )
    assert json.loads(page["saved"]) == ["lost", "lost", "3.00"]


def test_a_car_that_fails_is_named_next_to_the_sliders(tmp_path: Path) -> None:
    page = used(
        tmp_path,
        """const run = (name, losses) =>
          hear({ kind: "run", id: before.at(-1).id, name, title: "", figures: [], losses }, [undefined]);
        run("none", ["lost"]); run("ars", []);
        hear({ kind: "run", id: before.at(-1).id, name: "afs", title: "", error: "no such file" }, []);
        const bold = (one) => one.querySelectorAll("b").map(({ words }) => words);
        $("saved").textContent = JSON.stringify($("legend").children.map((one) => [one.words, ...bold(one)]));""",
    )
    assert json.loads(page["saved"]) == [["none", " fails"], ["ars"], ["afs"]]


def test_a_front_axle_that_slides_without_the_rear_one_is_told(tmp_path: Path) -> None:
    curves = (PAGE / "curves.js").read_text("utf-8").replace("./look.js", "./fake.mjs")
    (tmp_path / "curves.mjs").write_text(curves)
    (tmp_path / "fake.mjs").write_text(Path(__file__).with_name("fake_page.js").read_text("utf-8"))
    told = script(
        tmp_path,
        """import { Curves } from "./curves.mjs";
        import { element } from "./fake.mjs";
        const title = "Slip angle of the axles", figure = element("figure");
        figure.appendChild = (child) => child;
        const run = (front, rear) => ({ plots: { start_s: 0, step_s: 0.5, panels: [{ title, series: [
          { dotted: false, values: rear }, { dotted: true, values: front }] }] } });
        const of = (...runs) => {
          const one = { plots: new Map([[title, { figure }]]), runs: new Map(runs), limit: () => 7.5 };
          Curves.prototype.tellSlip.call(one);
          return one.plots.get(title).told.textContent;
        };
        const spins = ["none", run([0, -9, -9], [0, 2, 8])], pushes = ["afs", run([0, 2, -9], [null, 1, 1])];
        const grips = ["ars", run([0, 2, 2], [0, 1, 1])];
        console.log(JSON.stringify([of(spins, pushes, grips), of(pushes), of(grips, ["lqr", { error: "no" }])]));""",
    )
    slides = "more slip gives the rear tyres less side force."
    assert [text.replace(slides, "...") for text in told] == [
        "Shaded, beyond 7.5 deg: ... Rear axle beyond it: none from 1.00 s. "
        "Only the front axle beyond it: afs from 1.00 s.",
        "Shaded, beyond 7.5 deg: ... Only the front axle beyond it: afs from 1.00 s.",
        "Beyond 7.5 deg, ... All axles stay below.",
    ]


def test_saved_files_are_named_next_to_the_button(tmp_path: Path) -> None:
    reply = "{ kind: 'saved', files: ['a.mcap'], folder: '/f' }"
    assert used(tmp_path, f"$('save').fire('click'); hear({reply}, []);")["saved"] == "saved a.mcap in /f"
    again = "{ kind: 'saved', files: [], exist: ['a.mcap'], folder: '/f' }"
    shown = used(tmp_path, f"$('save').fire('click'); hear({again}, []);")["saved"]
    assert shown == "these runs are already saved: a.mcap in /f"
    refused = "{ kind: 'error', text: 'there is no run', about: 'save' }"
    assert used(tmp_path, f"$('save').fire('click'); hear({refused}, []);")["saved"] == "there is no run"


def test_the_name_of_an_own_controller_breaks_after_its_file(tmp_path: Path) -> None:
    ready = """{ kind: "ready", maneuvers: ["step_steer"], vehicles: ["compact"], drivers: ["typical"],
      controllers: ["none", "my_file.py:YawDamper"], titles: {} }"""
    page = used(
        tmp_path,
        f"""hear({ready}, []);
        const labels = $("controllers").querySelectorAll("label");
        $("saved").textContent = JSON.stringify(labels.map((one) => one.querySelectorAll("wbr").length));""",
    )
    assert json.loads(page["saved"])[-2:] == [0, 1]


def test_a_hint_goes_when_the_drive_starts(tmp_path: Path) -> None:
    assert driven(tmp_path, f"const before = sent.unhinted; {GO} globalThis.seen = [before ?? 0, sent.unhinted];")[
        "result"
    ] == [0, 1]
