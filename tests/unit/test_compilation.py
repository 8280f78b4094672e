"""Compiled code on disk belongs to the present sources, in any folder."""

from __future__ import annotations

import os
import pickle
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import activesteer
from activesteer import resources
from activesteer.native import compilation
from activesteer.tyre import load_tir

_PACKAGE = Path(activesteer.__file__).parent

_CALL = """
import logging
logging.basicConfig(format="%(levelname)s", level=logging.INFO)
from {package}.outer import outer
print(outer(2.0))
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return a package whose compiled function calls a second file's function and uses a third file's constant."""
    folder = tmp_path / "sources" / "gearbox"
    (folder / "inner").mkdir(parents=True)
    (folder / "__init__.py").write_text("")
    (folder / "inner" / "__init__.py").write_text("")
    (folder / "numbers.py").write_text("FACTOR = 3.0\n")
    (folder / "inner" / "function.py").write_text(
        "from activesteer.native.compilation import compiled\n@compiled\ndef inner(x):\n    return x + 1.0\n"
    )
    (folder / "outer.py").write_text(
        "from activesteer.native.compilation import compiled\n"
        "from gearbox import numbers as n\n"
        "from gearbox.inner.function import (\n    inner,\n)\n"
        "@compiled\ndef outer(x):\n    return n.FACTOR * inner(x)\n"
    )
    return folder


def _run(code: str, sources: Path, **environment: str) -> tuple[str, str]:
    """Return the output and log of a new interpreter that finds the sources first."""
    found = {"PYTHONPATH": os.pathsep.join((str(sources), str(_PACKAGE.parent))), **environment}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=sources,
        env={**os.environ, **found},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip(), done.stderr.strip()


@pytest.mark.parametrize(
    "kept_in",
    ["source", *(pytest.param(name, marks=pytest.mark.slow) for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"))],
)
def test_an_edit_in_a_file_that_was_compiled_in_counts(package: Path, tmp_path: Path, kept_in: str) -> None:
    if kept_in == "XDG_CACHE_HOME":
        # No folder can be made where a file stands, whoever one is: numba goes on to the user's cache.
        for folder in (package, package / "inner"):
            (folder / "__pycache__").write_text("")
    environment = {"NUMBA_CACHE_DIR": "", "PYTHONDONTWRITEBYTECODE": "1"}
    if kept_in != "source":
        environment[kept_in] = str(tmp_path / "kept")
    call = _CALL.format(package=package.name)
    assert _run(call, package.parent, **environment) == ("9.0", "INFO")
    assert _run(call, package.parent, **environment) == ("9.0", "")
    assert list(tmp_path.rglob("outer.outer-*.nbi"))
    if kept_in != "source":
        return  # the key, which the edits below change, is the same in all folders
    (package / "numbers.py").write_text("FACTOR = 4.0\n")
    assert _run(call, package.parent, **environment)[0] == "12.0"
    function = package / "inner" / "function.py"
    function.write_text(function.read_text().replace("1.0", "2.0"))
    assert _run(call, package.parent, **environment)[0] == "16.0"


@pytest.mark.slow
def test_an_edit_in_the_formula_of_a_tyre_counts(tmp_path: Path) -> None:
    shutil.copytree(_PACKAGE, tmp_path / _PACKAGE.name, ignore=shutil.ignore_patterns("__pycache__"))
    # Reading a tyre there would compile everything else that its check needs.
    tyre = load_tir(next((resources.models_dir() / "tyres").glob("*.tir")))
    (tmp_path / "record").write_bytes(pickle.dumps(tyre.record))
    call = (
        "import pickle\n"
        "from activesteer.tyre.kernels.magic_formula import slip_stiffnesses\n"
        f"record = pickle.load(open({str(tmp_path / 'record')!r}, 'rb'))\n"
        "print(slip_stiffnesses(record, 4000.0, 0.0, 2.2e5)[1])"
    )
    before, _ = _run(call, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    edited = tmp_path / _PACKAGE.name / "tyre" / "kernels" / "slip.py"
    text = edited.read_text()
    head, name, body = text.partition("def cornering_stiffness(")
    assert name
    edited.write_text(head + name + body.replace("return ", "return 2.0 * ", 1))
    after, _ = _run(call, tmp_path, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    assert float(after) == pytest.approx(2.0 * float(before))


def test_another_version_of_the_engine_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    source = _PACKAGE / "vehicle" / "native_forces.py"
    before = compilation.content_key(source)
    assert compilation.content_key(source) == before
    assert "mujoco" in compilation._versions()
    assert "numba" in compilation._versions()
    monkeypatch.setattr(compilation, "_versions", lambda: "others")
    assert compilation.content_key(source) != before


def test_a_table_beside_a_source_counts(tmp_path: Path) -> None:
    source, table = tmp_path / "coefficients.py", tmp_path / "coefficients.txt"
    source.write_text("")
    keys = []
    for content in (None, "A 1", "A 2"):
        if content is not None:
            table.write_text(content)
        for cached in (compilation._sources_key, compilation._content, compilation._imported):
            cached.cache_clear()
        keys.append(compilation.content_key(source))
    assert len({*keys}) == 3


def test_what_a_users_code_imports_from_the_package_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its compiled functions contain the package's own; old ones read the memory of new ones at wrong places."""
    source, edited = tmp_path / "own.py", _PACKAGE / "tyre" / "kernels" / "slip.py"
    source.write_text("from activesteer.tyre.kernels.slip import cornering_stiffness\n")
    before, content = compilation.content_key(source), compilation._content
    compilation._sources_key.cache_clear()
    monkeypatch.setattr(compilation, "_content", lambda file: content(file) + b"#" * (file == edited))
    assert compilation.content_key(source) != before
    compilation._sources_key.cache_clear()


def test_without_a_folder_that_can_be_written_it_runs_and_says_so_once(package: Path, tmp_path: Path) -> None:
    for folder in (package, package / "inner"):
        (folder / "__pycache__").write_text("")
    (tmp_path / "file").write_text("")
    nowhere = str(tmp_path / "file" / "folder")
    printed, logged = _run(
        _CALL.format(package=package.name),
        package.parent,
        NUMBA_CACHE_DIR=nowhere,
        XDG_CACHE_HOME=nowhere,
        HOME=nowhere,
    )
    assert printed == "9.0"
    assert logged.split() == ["WARNING"]


@pytest.mark.slow
def test_only_some_states_of_a_function_are_kept(package: Path, tmp_path: Path) -> None:
    call = "from activesteer.native import compilation\ncompilation._KEPT = 2\n" + _CALL.format(package=package.name)
    kept = []
    for factor in range(3):
        (package / "numbers.py").write_text(f"FACTOR = {factor}.0\n")
        _run(call, package.parent, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
        kept.append({file.name for file in tmp_path.rglob("outer.outer-*.nbi")})
    assert [len(states) for states in kept] == [1, 2, 2]
    assert kept[0] < kept[1]
    assert not kept[0] & kept[2], "the oldest goes"
    assert len(list(tmp_path.rglob("outer.outer-*.nbc"))) == 2
    for file in tmp_path.rglob("outer.outer-*.nbi"):  # the clock is set back
        os.utime(file, (2e9, 2e9))
    (package / "numbers.py").write_text("FACTOR = 3.0\n")
    _run(call, package.parent, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    last = {file.name for file in tmp_path.rglob("outer.outer-*.nbi")}
    assert len(last) == 2
    assert last - kept[2], "the newest stays"


@pytest.mark.slow
def test_compiling_needs_no_linear_algebra_and_leaves_it_to_those_who_do() -> None:
    code = (
        "import sys\n"
        "import activesteer.simulation.runner\n"
        "assert not {'scipy.linalg', 'scipy.optimize', 'scipy.interpolate'} & set(sys.modules)\n"
        "import numba, numpy\n"
        "a = numpy.arange(9.0).reshape(3, 3)\n"
        "product = numba.njit(lambda x: numpy.dot(x, x))(a)\n"
        "assert (product == a @ a).all()\n"
        "print('scipy.linalg.cython_blas' in sys.modules)"
    )
    assert _run(code, _PACKAGE.parent) == ("True", "")


@pytest.mark.slow
def test_a_run_without_compiled_code_ends_with_one_error() -> None:
    result = subprocess.run(
        [sys.executable, "-c", "from activesteer.commands.cli import main; exit(main(['run', 'straight_line']))"],
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
    assert "NUMBA_DISABLE_JIT is set" in result.stderr.splitlines()[-1]


def test_all_native_code_of_the_package_is_made_in_one_place() -> None:
    words = re.compile(r"\b(njit|jit|cfunc|guvectorize|vectorize)\b")
    found = [file for file in _PACKAGE.rglob("*.py") if words.search(file.read_text())]
    assert found == [_PACKAGE / "native" / "compilation.py"]
