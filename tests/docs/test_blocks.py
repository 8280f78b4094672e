"""The runner of the documents notices errors in them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.docs import shell
from tests.docs.blocks import Command, blocks, same_output
from tests.docs.test_documents import read

PRINTED = "                 none    ars\npeak   deg/s  11.173  10.318\nS1 passed: lower.\nfigure: runs/x.png\n"


def page(folder: Path, *blocks: str) -> Path:
    path = folder / "page.md"
    path.write_text("\n\n".join(f"```{block}\n```" for block in blocks))
    return path


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("tests.docs.test_documents.ROOT", tmp_path)


@pytest.mark.parametrize(
    "shown",
    [
        ("none ars", "peak deg/s 11.17 10.32", "...", "figure: runs/x.png"),
        ("...", "S1 passed: lower.", "..."),
        ("...", "peak deg/s 11.3 10.4", "..."),
    ],
)
def test_output_is_the_same(shown: tuple[str, ...]) -> None:
    assert same_output(shown, PRINTED)


@pytest.mark.parametrize(
    "shown",
    [
        ("...", "peak deg/s 11.9 10.3", "..."),  # another number
        ("...", "S1 FAILED: lower.", "..."),
        ("S1 passed: lower.", "..."),  # not at the beginning
        ("...", "S1 passed: lower."),  # not at the end
        ("...", "S1 passed: lower.", "...", "peak deg/s 11.17 10.32", "..."),  # the wrong order
        ("none ars",),  # more is printed
    ],
)
def test_output_is_another(shown: tuple[str, ...]) -> None:
    assert not same_output(shown, PRINTED)


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ("python\nimport activesteer\nactivesteer.simulate('step_ster')", "did you mean"),
        ("python\nimport sys\nassert sys is None, 'sys'", "sys"),
        ("toml\nkind = ", "Invalid value"),
        ("sh\nactivesteer run step_ster", "did you mean"),
        ("sh\nactivesteer run step_steer --speed 3", "unrecognized arguments"),
        ("sh\nactivesteer reproduce --job 3 --now   # slow: minutes", "unrecognized arguments"),
        ("sh\nactivesteer reply x.mcap   # window: the viewer", "there is no command"),
        ("sh\nmake cake", "targets"),
        ("sh\npip install '.[cake]'", "no such extra"),
        ("sh\nrm -r x", "not run"),
        ("console\n$ activesteer list\nvehicles:", "printed"),
    ],
)
def test_a_wrong_block_fails(block: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(Exception, match=message):
        read(page(tmp_path, block), slow=False)


@pytest.mark.parametrize(
    "text", ["```bash\nls\n```\n", "```\nls\n```\n", "```sh\nls\n", "text\n\n    activesteer list\n"]
)
def test_what_would_not_be_run_fails(text: str, tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text(text)
    with pytest.raises(AssertionError):
        blocks(tmp_path / "page.md")


def test_a_named_block_becomes_a_file_and_the_next_one_finds_it(tmp_path: Path) -> None:
    read(
        page(
            tmp_path, "python\n# mine.py\nraise OSError", "sh\nmkdir new && cd new\npython -c 'print(1)'\nls ../mine.py"
        ),
        slow=True,
    )
    assert (tmp_path / "mine.py").read_text() == "# mine.py\nraise OSError\n"


def test_slow_commands_and_windows_are_told_from_others() -> None:
    assert Command("activesteer list", "slow: a minute", ()).slow
    assert not Command("activesteer list", "the slow ones", ()).slow
    shell.check(Command("activesteer replay x.mcap", "window", ()))
