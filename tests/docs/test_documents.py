"""README and docs are correct: every block of code and every command is run; see `blocks.py`."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.docs import shell
from tests.docs.blocks import Block, blocks

ROOT = Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
QUICK = {"README.md"}
"""Pages whose commands and code the quick tests run; the slow tests run all."""
PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def with_blocks() -> list[Path]:
    return [page for page in PAGES if re.search(r"^\s*```(?:python|toml|sh|console)$", page.read_text(), re.MULTILINE)]


@pytest.fixture(autouse=True)
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An empty folder with the examples and tools of a checkout."""
    monkeypatch.chdir(tmp_path)
    for name in ("examples", "tools"):
        (tmp_path / name).symlink_to(ROOT / name)


def with_slow_commands() -> list[Path]:
    return [page for page in with_blocks() if re.search(r" # slow", page.read_text())]


def read(page: Path, *, slow: bool) -> None:
    """Follow a page from top to bottom in the current folder."""
    namespace: dict[str, object] = {"__name__": "__main__"}
    for block in blocks(page):
        try:
            _do(block, namespace, slow=slow)
        except Exception as error:
            error.add_note(f"{name(page)}, line {block.line}")
            raise


def _do(block: Block, namespace: dict[str, object], *, slow: bool) -> None:
    if block.file is not None:
        Path(block.file).write_text(block.text, encoding="utf-8")
    match block.language:
        case "toml":
            tomllib.loads(block.text)
        case "python":
            code = compile(block.text, f"line {block.line}", "exec")
            if block.file is None:
                exec(code, namespace)
        case "sh" | "console":
            for command in block.commands():
                leave_out = command.never or (command.slow and not slow)
                act: Callable[..., None] = shell.check if leave_out else shell.run
                act(command)


@pytest.mark.usefixtures("figures")
@pytest.mark.parametrize(
    "page",
    [pytest.param(page, marks=[] if name(page) in QUICK else pytest.mark.slow) for page in with_blocks()],
    ids=name,
)
def test_page_does_what_it_says(page: Path) -> None:
    read(page, slow=False)


@pytest.mark.parametrize("page", [page for page in with_blocks() if name(page) not in QUICK], ids=name)
def test_page_can_be_read_by_the_program(page: Path) -> None:
    """The commands exist with their options, and the code compiles; the slow tests run them."""
    for block in blocks(page):
        if block.language == "toml":
            tomllib.loads(block.text)
        elif block.language == "python":
            compile(block.text, f"{name(page)}, line {block.line}", "exec")
        elif block.language in {"sh", "console"}:
            for command in block.commands():
                shell.check(command)


@pytest.mark.slow
@pytest.mark.parametrize("page", with_slow_commands(), ids=name)
def test_page_does_what_it_says_slowly(page: Path) -> None:
    read(page, slow=True)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_no_command_stands_outside_of_a_block_that_is_run(page: Path) -> None:
    blocks(page)


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\((?!https?://|#|mailto:)([^)#\s]+)", page.read_text(encoding="utf-8")):
        assert (page.parent / target).exists(), f"{name(page)}: {target}"
