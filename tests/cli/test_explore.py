"""`activesteer explore`: its address, and what it refuses."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import closing
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest

from tests.cli.conftest import Call

pytest.importorskip("uvicorn", reason="needs the extra `explore`")
websockets = pytest.importorskip("websockets.sync.client", reason="needs the extra `explore`")

COMMAND = [sys.executable, "-c", "from activesteer.cli import main; raise SystemExit(main())", "explore"]


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Address of a running page, which Ctrl-C ends at last."""
    folder = tmp_path_factory.mktemp("explore")
    command = [*COMMAND, "--json", "-o", str(folder)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        assert server.stderr is not None
        yield json.loads(server.stdout.readline())["url"]
        server.send_signal(signal.SIGINT)
        assert server.wait(20) == 130
        assert "Traceback" not in server.stderr.read()


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


def test_wrong_messages_get_an_answer_and_the_page_goes_on(url: str) -> None:
    address, origin = url.replace("http:", "ws:") + "socket", url[:-1].rpartition("/")[0]
    with websockets.connect(address, origin=origin, max_size=None) as socket:

        def heard(kind: str) -> dict[str, object]:
            while True:
                data = socket.recv(timeout=60)
                header = json.loads(data[4 : 4 + int.from_bytes(data[:4], "little")])
                if header["kind"] == kind:
                    return header

        assert "slalom" in str(heard("ready")["maneuvers"])
        for wrong in (
            "{",
            "[]",
            '{"kind": "nothing"}',
            '{"kind": "run", "maneuver": "/etc/passwd"}',
            '{"kind": "save"}',
        ):
            socket.send(wrong)
            assert heard("error")["text"]
        socket.send(json.dumps({"kind": "describe", "id": 1, "maneuver": "step_steer"}))
        assert heard("description")["title"]


@pytest.mark.parametrize(("options", "said"), [(["--port", "70000"], "0 to 65535"), (["-o", "missing"], "no folder")])
def test_wrong_options_are_refused_in_one_line(
    call: Call, monkeypatch: pytest.MonkeyPatch, options: list[str], said: str
) -> None:
    monkeypatch.setattr("uvicorn.Server.run", lambda *_, **__: pytest.fail("the page is served"))
    done = call("explore", "--no-browser", *options)
    assert done.status == 1
    assert said in done.err
    assert len(done.err.splitlines()) == 1
