from __future__ import annotations

import os
from pathlib import Path

import pytest

from activesteer.core.files import (
    atomic_write,
    delete_temporary_files,
    make_folder,
    reading,
    shown_path,
    write_text,
    writing,
)
from activesteer.core.limits import number_in
from activesteer.errors import ParameterError, PlaybackError
from tests.raising import raises


@pytest.mark.parametrize("there", [None, "before"])
def test_text_is_written_and_nothing_else_is_left(tmp_path: Path, there: str | None) -> None:
    path = tmp_path / "page.html"
    if there is not None:
        path.write_text(there)
        path.chmod(0o640)
    assert write_text(path, "später", ParameterError) == path
    assert path.read_text(encoding="utf-8") == "später"
    assert os.listdir(tmp_path) == ["page.html"]
    if there is not None:
        assert path.stat().st_mode & 0o777 == 0o640


def test_what_fails_halfway_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text("before")

    def fail(reason: BaseException) -> None:
        with atomic_write(path, PlaybackError) as part:
            part.write_text("half")
            raise reason

    with raises(PlaybackError, cause=OSError, value=path):
        fail(OSError(28, "No space left on device"))
    with pytest.raises(KeyboardInterrupt):
        fail(KeyboardInterrupt())
    assert path.read_text() == "before"
    assert os.listdir(tmp_path) == ["page.html"]


def test_half_files_can_be_deleted_from_elsewhere(tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    path.write_text("before")
    with raises(ParameterError, cause=FileNotFoundError, value=path), atomic_write(path, ParameterError) as part:
        part.write_text("half")
        delete_temporary_files()
        assert os.listdir(tmp_path) == ["page.html"]
    delete_temporary_files()
    assert path.read_text() == "before"


def test_a_half_file_that_cannot_be_deleted_does_not_hide_the_reason(tmp_path: Path, monkeypatch) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise OSError(30, "Read-only file system")

    monkeypatch.setattr(Path, "unlink", refuse)
    with raises(PlaybackError, problem="no picture"), atomic_write(tmp_path / "a.mp4", PlaybackError):
        raise PlaybackError("no picture")


def test_link_stays_a_link_and_its_file_is_replaced(tmp_path: Path) -> None:
    real, link = tmp_path / "real.txt", tmp_path / "link.txt"
    real.write_text("before")
    link.symlink_to(real)
    write_text(link, "after", ParameterError)
    assert link.is_symlink()
    assert real.read_text() == "after"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full, which is Linux's")
def test_full_disk_is_an_error_of_ours() -> None:
    with raises(ParameterError, cause=OSError, value="/dev/full"):
        write_text("/dev/full", "text", ParameterError)


@pytest.mark.parametrize("name", ["missing/page.html", ".", "a" * 300, "zero\0byte"])
def test_what_cannot_be_written_is_named_in_one_short_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ParameterError) as raised:
        write_text(name, "text", ParameterError)
    assert str(raised.value).startswith(f"cannot write {name[:8]}" if "\0" not in name else "cannot write zero")
    assert len(str(raised.value)) < 300
    assert str(raised.value).isprintable()


def test_folder_is_made_and_a_file_in_its_place_is_an_error(tmp_path: Path) -> None:
    assert make_folder(tmp_path / "a" / "b", ParameterError).is_dir()
    (tmp_path / "file").touch()
    with raises(ParameterError, cause=NotADirectoryError, value=tmp_path / "file" / "in"):
        make_folder(tmp_path / "file" / "in", ParameterError)
    with raises(ParameterError, cause=FileExistsError, value=tmp_path / "file"):
        make_folder(tmp_path / "file", ParameterError)


def test_only_what_the_system_refuses_becomes_an_error_of_ours(tmp_path: Path) -> None:
    with raises(PlaybackError, cause=FileNotFoundError, value="missing"), reading("missing", PlaybackError):
        (tmp_path / "missing").read_bytes()
    with pytest.raises(ZeroDivisionError), writing("any", PlaybackError):
        raise ZeroDivisionError


def test_path_is_shown_without_what_a_terminal_would_obey() -> None:
    assert shown_path("a\x1b[2Jb\nc") == "a\\x1b[2Jb\\nc"
    assert shown_path(os.fsdecode(b"a\xffb")) == "a\\udcffb"
    assert len(shown_path("x" * 5000)) == 200


@pytest.mark.parametrize("cell", ["", "x", "nan", "-inf", "1e308", "-1e308", "1.1e12"])
def test_a_cell_without_a_plausible_number_is_refused(cell: str) -> None:
    place = {"file": "a.csv", "line": 2, "key": "x_m"}
    assert number_in("-1e12", ParameterError, **place) == -1e12
    with raises(ParameterError, value=cell, **place) as refused:
        number_in(cell, ParameterError, **place)
    assert ("1e+12" in str(refused.value)) is ("e" in cell)
