"""`activesteer explore`: its address, and what it refuses."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import psutil
import pytest

from tests.cli.conftest import Call

pytest.importorskip("uvicorn", reason="needs the extra `explore`")
websockets = pytest.importorskip("websockets.sync.client", reason="needs the extra `explore`")
websockets_exceptions = pytest.importorskip("websockets.exceptions", reason="needs the extra `explore`")

SERVER: list[int] = []
"""Process number of the running server."""
COMMAND = [sys.executable, "-c", "from activesteer.commands.cli import main; raise SystemExit(main())", "explore"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the page, which is missing before."""
    return tmp_path_factory.mktemp("explore") / "new" / "folder"


@pytest.fixture(scope="module")
def url(folder: Path) -> Iterator[str]:
    """Address of a running page, which Ctrl-C ends at last."""
    command = [*COMMAND, "--json", "-o", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        assert server.stderr is not None
        url = json.loads(server.stdout.readline())["url"]
        SERVER[:] = [server.pid]
        assert folder.is_dir()
        yield url
        (folder / "of_another_program.mcap").write_bytes(b"")
        server.send_signal(signal.SIGINT)
        assert server.wait(20) == 130
        (line,) = server.stderr.read().splitlines()
        drives = [str(path) for path in folder.glob("drive_*.mcap")]
        assert line.startswith(f"activesteer: stopped by Ctrl-C; {'saved: ' if drives else 'nothing was saved'}")
        assert all(drive in line for drive in drives)
        assert "another" not in line  # a file that this process did not save


def status(url: str, path: str, host: str | None = None) -> tuple[int, bytes]:
    parts = urlsplit(url)
    with closing(HTTPConnection(parts.hostname or "", parts.port, timeout=20)) as connection:
        connection.request("GET", path, headers={} if host is None else {"Host": host})
        answer = connection.getresponse()
        return answer.status, answer.read()


def test_the_page_is_served_under_its_token_alone(url: str) -> None:
    home = urlsplit(url).path
    assert status(url, home)[0] == 200
    assert status(url, "/")[0] == 404
    assert status(url, "/wrong-token/")[0] == 404
    assert status(url, home, host="evil.example")[0] == 400
    assert b"renderer" in status(url, home + "scene.js")[1]


@pytest.mark.parametrize("name", ["../server.py", "..%2fserver.py", "__init__.py", "three.LICENSE", "/etc/passwd"])
def test_only_files_of_the_page_are_served(url: str, name: str) -> None:
    assert status(url, urlsplit(url).path + name)[0] == 404


def test_a_page_from_elsewhere_gets_no_connection(url: str) -> None:
    address = url.replace("http:", "ws:") + "socket"
    with pytest.raises(websockets.InvalidStatus), websockets.connect(address, origin="http://evil.example"):
        pass


class Page:
    """A page without a browser."""

    def __init__(self, url: str) -> None:
        address, origin = url.replace("http:", "ws:") + "socket", url[:-1].rpartition("/")[0]
        self.socket = websockets.connect(address, origin=origin, max_size=None)

    def __enter__(self) -> Page:
        self.socket.__enter__()
        return self

    def __exit__(self, *about: object) -> None:
        self.socket.__exit__(*about)

    def say(self, kind: str, **values: object) -> None:
        self.socket.send(json.dumps({"kind": kind, **values}))

    def hear(self, kind: str) -> dict[str, Any]:
        """Return the next message of a kind."""
        while True:
            data = self.socket.recv(timeout=60)
            header = json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])
            if header["kind"] == kind:
                return header


def test_hundreds_of_connections_leave_neither_memory_nor_files_open(url: str) -> None:
    address, origin = url.replace("http:", "ws:") + "socket", url.rpartition("/")[0].rpartition("/")[0]
    server = psutil.Process(SERVER[0])

    def connect(number: int) -> None:
        if number % 2:
            with pytest.raises(websockets.InvalidStatus), websockets.connect(address, origin="http://evil.example"):
                pass
        else:
            with websockets.connect(address, origin=origin):
                assert status(url, urlsplit(url).path, host="evil.example")[0] == 400

    with ThreadPoolExecutor(50) as pool:
        list(pool.map(connect, range(100)))
        before_bytes, before = server.memory_info().rss, server.num_fds()
        list(pool.map(connect, range(200)))
    assert status(url, urlsplit(url).path)[0] == 200
    assert server.num_fds() < before + 20
    assert server.memory_info().rss < before_bytes + 50e6


def test_wrong_messages_get_an_answer_and_the_page_goes_on(url: str) -> None:
    with Page(url) as page:
        assert "slalom" in str(page.hear("ready")["maneuvers"])
        page.say("save")
        assert "no run to save" in page.hear("error")["text"]
        page.say("run", maneuver="/etc/passwd")
        assert "named without a folder" in page.hear("error")["text"]
        page.say("run", maneuver=300 * "a")
        assert "length <= 200" in page.hear("error")["text"]
        page.say("describe", id=1, maneuver="step_steer")
        assert page.hear("description")["title"]


def test_any_error_of_an_own_controller_is_an_answer(url: str, folder: Path) -> None:
    (folder / "ends.py").write_text("raise SystemExit(0)\nclass C: ...\n")
    with Page(url) as page:
        page.say("start", maneuver="plane", controllers=["ends.py:C"])
        assert page.hear("error")["text"]
        page.say("describe", maneuver="step_steer")
        assert page.hear("description")


def test_a_flood_of_messages_stops_neither_server_nor_worker(url: str) -> None:
    with Page(url) as page:
        page.say("start", maneuver="plane")
        page.hear("drive")
        page.say("act", go=True)
        page.hear("going")
        for number in range(1500):
            page.say("act", steer=0.1, number=number)
            page.say("act", speed_kmh=60.0)
        assert status(url, urlsplit(url).path)[0] == 200
        page.say("end")
        assert page.hear("driven")["error"] == ""


def test_a_second_page_takes_the_place_of_the_first_and_of_its_drive(url: str) -> None:
    with Page(url) as first:
        first.say("start", maneuver="plane")
        first.hear("drive")
        with Page(url) as second:
            with pytest.raises(websockets_exceptions.ConnectionClosed) as ended:
                first.hear("nothing")
            assert ended.value.rcvd is not None
            assert "opened in another window" in ended.value.rcvd.reason  # the page says so
            second.say("run", id=5, maneuver="step_steer")
            assert second.hear("finished")["id"] == 5


def test_a_dead_worker_is_replaced(url: str) -> None:
    with Page(url) as page:
        page.hear("ready")
        (worker,) = [
            child for child in psutil.Process(SERVER[0]).children() if "spawn_main" in " ".join(child.cmdline())
        ]
        worker.kill()
        assert "a new one has started" in page.hear("error")["text"]
        page.say("describe", maneuver="step_steer")
        assert page.hear("description")


@pytest.mark.parametrize(
    ("options", "said"), [(["--port", "70000"], "0 to 65535"), (["-o", "file"], "cannot make the folder file")]
)
def test_wrong_options_are_refused_in_one_line(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, options: list[str], said: str
) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: pytest.fail("the page is served"))
    done = call("explore", "--no-browser", *options)
    assert done.status == 1
    assert said in done.err
    assert len(done.err.splitlines()) == 1
