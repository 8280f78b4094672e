"""The code of README and docs: what stands between fences, by its language.

The convention, which a reader of the source sees:

- `python` is executed, all of a page in one namespace and one folder.
- `python` and `toml` that begin with a comment naming a file, as `# mine.py`, become that file and are not executed.
- `sh` are command lines, all run. In `console` they follow a `$`, and what they print stands below; a line `...` leaves
  lines out, numbers may differ by 2 % or by two units of their last digit.
- `text` is neither.
- A command with a comment that begins with `slow` is run by the slow tests only, one with `window` (it opens one) or
  `long` (it takes more than two minutes) by none. All are checked as far as the command line's own parser goes.
- A comment with `exit status 1` announces a negative verdict.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

LANGUAGES = frozenset({"python", "toml", "sh", "console", "text", "py", "pycon"})

_FENCE = re.compile(r"\s*(`{3,})(.*)")
_FILE = re.compile(r"# ([\w./-]+\.(?:py|toml))\s*\n")
_NUMBER = re.compile(r"[-+]?\d+(?:\.(\d+))?")
_COMMAND_OUTSIDE = re.compile(r"\s+(?:\$ )?(?:activesteer|python|pip|make) \S")


@dataclass(frozen=True)
class Block:
    """A fenced block."""

    line: int
    language: str
    text: str

    @property
    def file(self) -> str | None:
        """Name of the file that the block defines."""
        found = _FILE.match(self.text) if self.language in {"python", "toml"} else None
        return found[1] if found else None

    def commands(self) -> Iterator[Command]:
        """The command lines, with their shown output."""
        shown = self.language == "console"
        lines = self.text.replace("\\\n", " ").splitlines()
        starts = [i for i, line in enumerate(lines) if line.startswith("$ ")] if shown else list(range(len(lines)))
        for start, end in zip(starts, [*starts[1:], len(lines)], strict=True):
            words, _, comment = lines[start].removeprefix("$ ").partition(" # ")
            if words.strip() and not words.startswith("#"):
                output = tuple(lines[start + 1 : end]) if shown else ()
                yield Command(words.strip(), comment.strip(), output)


@dataclass(frozen=True)
class Command:
    """A command line."""

    words: str
    comment: str
    output: tuple[str, ...]

    @property
    def slow(self) -> bool:
        return self.comment.startswith("slow")

    @property
    def exit_status(self) -> int:
        return 1 if "exit status 1" in self.comment else 0

    @property
    def never(self) -> bool:
        return self.comment.startswith(("window", "long"))


def blocks(page: Path) -> list[Block]:
    """Return all blocks of a page; fail on a block without a known language, or on a command outside of a block."""
    found: list[Block] = []
    lines = page.read_text(encoding="utf-8").splitlines()
    start, fence, language = 0, "", ""
    for number, line in enumerate(lines, 1):
        match = _FENCE.match(line)
        if fence and match and match[1] == fence and not match[2].strip():
            text = textwrap.dedent("\n".join(lines[start : number - 1])) + "\n"
            found.append(Block(start + 1, language, text))
            fence = ""
        elif not fence and match:
            start, fence, language = number, match[1], match[2].strip()
            assert language in LANGUAGES, f"{page.name}, line {number}: {language!r} is none of {sorted(LANGUAGES)}"
        elif not fence and _COMMAND_OUTSIDE.match(line):
            raise AssertionError(f"{page.name}, line {number}: a command outside of a block is not run: {line.strip()}")
    assert not fence, f"{page.name}, line {start}: this block does not end"
    return found


def same_output(shown: tuple[str, ...], printed: str) -> bool:
    """Return True if a program printed the output that a page shows."""
    lines = [line for line in printed.splitlines() if line.strip()]
    parts: list[list[str]] = [[]]
    for line in (line for line in shown if line.strip()):
        if line.strip() == "...":
            parts.append([])
        else:
            parts[-1].append(line)
    place = 0
    for index, part in enumerate(parts):
        last = index == len(parts) - 1
        places = range(place, len(lines) - len(part) + 1)
        if index == 0:
            places = places[:1]
        elif last and part:
            places = places[-1:]
        fitting = [i for i in places if all(map(_same_line, part, lines[i : i + len(part)]))]
        if not fitting or (last and len(parts) == 1 and len(lines) != len(part)):
            return False
        place = fitting[0] + len(part)
    return True


def _same_line(shown: str, printed: str) -> bool:
    ours, theirs = shown.split(), printed.split()
    return len(ours) == len(theirs) and all(map(_same_word, ours, theirs))


def _same_word(shown: str, printed: str) -> bool:
    if shown == printed:
        return True
    ours, theirs = (_NUMBER.fullmatch(word.strip(",;:()%")) for word in (shown, printed))
    if ours is None or theirs is None:
        return False
    digit = 10.0 ** -len(ours[1] or "")
    return abs(float(ours[0]) - float(theirs[0])) <= max(0.02 * abs(float(ours[0])), 2.001 * digit)
