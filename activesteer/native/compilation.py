"""Native code with a disk cache: numba's decorators, keyed by the content of the sources.

numba keeps compiled functions on disk and compiles again if the file of a function changes. It does not notice a change
in another file whose functions or constants were compiled in, nor another version of the engine. Here the key is the
content of the file and of every file of the package that it imports, directly or not, with the tables (`.txt`) next to
them and the versions of numba, llvmlite, numpy and mujoco. numba chooses the folder: `NUMBA_CACHE_DIR`, `__pycache__`
next to the source, or the user's cache. If none of them can be written, every start compiles anew.

The logger `activesteer` reports the start of compilation (INFO) and a missing cache folder (WARNING), each once.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import inspect
import logging
import os
import re
from collections.abc import Callable, Iterator
from importlib import import_module, metadata
from pathlib import Path
from typing import Any, Final

from llvmlite.binding import get_host_cpu_name
from numba import config, njit, types
from numba.core.caching import FunctionCache, IndexDataCacheFile, NullCache
from numba.core.ccallback import CFunc
from numba.extending import intrinsic, register_jitable
from numba.np import linalg

from activesteer.native.shared_laws import MARKED

_VERSIONS: Final = ("numba", "llvmlite", "numpy", "mujoco")
_KEPT: Final = 4
"""Compiled states kept per function: enough for some branches and versions used in turn."""
_IMPORT: Final = re.compile(r"^\s*(?:from\s+([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+([\w.]+))", re.MULTILINE)
_LOGGER: Final = logging.getLogger("activesteer")
_PACKAGE: Final = Path(__file__).parents[1]


def _import_array_functions() -> None:
    """Let numba import its array functions without scipy.linalg, whose import is slow."""
    # numba only checks here whether it exists, and checks again when it compiles something that needs it.
    look = getattr(linalg, "ensure_blas", None)
    linalg.ensure_blas = lambda: None
    try:
        import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = look


_import_array_functions()


def compiled(function: Callable[..., Any]) -> Any:
    """Return a decorator that compiles and stores a function, with division by zero by IEEE 754, as in numpy."""
    _know_shared()
    dispatcher: Any = njit(error_model="numpy")(function)
    if hasattr(dispatcher, "enable_caching"):  # a plain function where numba is switched off
        dispatcher._cache = _cache_of(function)
    return dispatcher


def inlined(function: Callable[..., Any]) -> Any:
    """Decorate a function that is inlined into each compiled function that calls it."""
    _know_shared()
    return njit(inline="always", error_model="numpy")(function)


def inlined_by_llvm(function: Callable[..., Any]) -> Any:
    """Decorate a long function that LLVM inlines into its caller.

    It compiles faster than with `inlined`, because numba does not copy its code into the caller.
    """
    _know_shared()
    return njit(forceinline=True, error_model="numpy")(function)


def _know_shared() -> None:
    """Register the functions that are marked as shared with compiled code."""
    while MARKED:
        register_jitable(error_model="numpy")(MARKED.pop())


def compiled_callback(result: types.Type, *arguments: types.Type) -> Callable[[Callable[..., Any]], CFunc]:
    """Return a decorator that compiles a function to a C callback for the engine, and keeps it on disk."""

    def decorate(function: Callable[..., Any]) -> CFunc:
        _know_shared()
        callback: Any = CFunc(function, (arguments, result), locals={}, options={"error_model": "numpy"})
        callback._cache = _cache_of(function)
        callback.compile()
        return callback

    return decorate


def compiled_call(
    result: types.Type, *arguments: types.Type, others_run: bool = True, about: tuple[str, Path] | None = None
) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles one signature, to call from Python with positional arguments of these types."""

    def decorate(function: Callable[..., Any]) -> Any:
        _know_shared()
        dispatcher: Any = njit(error_model="numpy", nogil=others_run)(function)
        if not hasattr(dispatcher, "enable_caching"):
            return dispatcher
        dispatcher._cache = _cache_of(function, about)
        entry = dispatcher.compile(result(*arguments))
        (code,) = dispatcher.overloads.values()
        _ADDRESSES[entry] = code.library.get_pointer_to_function(code.fndesc.llvm_func_name)
        return entry

    return decorate


_ADDRESSES: Final[dict[Any, int]] = {}


def address_of(call: Any) -> int:
    """Return the address of a `compiled_call` for `call_at`, or 0 if numba is switched off."""
    return _ADDRESSES.get(call, 0)


def call_at(result: types.Type, *arguments: types.Type) -> Any:
    """Return an intrinsic that calls a `compiled_call` at an address, so that caller and callee compile separately."""

    @intrinsic
    def call(_typing_context, address, given):
        def generate(context, builder, _signature, values):
            convention = context.call_conv
            pointer = convention.get_function_type(result, arguments).as_pointer()
            unpacked = [builder.extract_value(values[1], index) for index in range(len(arguments))]
            _, answer = convention.call_function(
                builder, builder.inttoptr(values[0], pointer), result, arguments, unpacked
            )
            return answer

        return result(types.intp, types.Tuple(arguments)), generate

    return call


class _ContentCache(FunctionCache):
    """Cache of numba for one function, keyed by the content of all its sources."""

    def __init__(self, function: Callable[..., Any], about: tuple[str, Path] | None = None) -> None:
        super().__init__(function)
        self._stem = self._impl.filename_base
        key = content_key(Path(inspect.getfile(function)))
        self._is_named = about is not None
        if about is not None:
            self._stem += f"-{about[0]}"
            key = hashlib.sha256((key + content_key(about[1])).encode()).hexdigest()
        self._cache_file = IndexDataCacheFile(self._cache_path, f"{self._stem}-{key[:16]}", key)

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        # What a function with a name of its own refers to differs between processes; name and content stand for it.
        return (sig, codegen.magic_tuple()) if self._is_named else super()._index_key(sig, codegen)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        found = super().load_overload(sig, target_context)
        if found is None:
            _say_compiling()
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        # Code that is already compiled runs even if the disk is full.
        with contextlib.suppress(OSError):
            super().save_overload(sig, data)
            own = Path(self._cache_file._index_path)  # kept also where a clock that was set back dates it before others
            others = {index for index in Path(self._cache_path).glob(f"{self._stem}-*.nbi") if index != own}
            for index in sorted(others, key=lambda index: index.stat().st_mtime)[: 1 - _KEPT]:
                for file in index.parent.glob(f"{index.stem}.*"):
                    file.unlink(missing_ok=True)


def _cache_of(function: Callable[..., Any], about: tuple[str, Path] | None = None) -> Any:
    try:
        return _ContentCache(function, about)
    except (RuntimeError, OSError):
        # numba found no folder that can be written, or there are no sources.
        _say_uncached()
        return NullCache()


@functools.cache
def _say_compiling() -> None:
    _LOGGER.info("compiling native code, up to a minute; later starts reuse it")


@functools.cache
def _say_uncached() -> None:
    _LOGGER.warning(
        "there is no writable folder for compiled code, so every start compiles again (up to a minute): "
        "set NUMBA_CACHE_DIR to a writable folder"
    )


def content_key(source: Path) -> str:
    """Return a key of compiled code: all its sources, and the versions of the compilers."""
    return hashlib.sha256(f"{_versions()}\n{_sources_key(source)}".encode()).hexdigest()


@functools.cache
def _sources_key(source: Path) -> str:
    """Return the digest of all sources that a file depends on, including the file."""
    package = source.parent
    while (package.parent / "__init__.py").is_file():
        package = package.parent
    found: set[Path] = set()
    left = [source]
    while left:
        file = left.pop()
        if file not in found:
            found.add(file)
            left.extend(_imported(file, package))
    digest = hashlib.sha256()
    for file in sorted(found):
        digest.update(f"\n{file.relative_to(package if file.is_relative_to(package) else _PACKAGE)}\n".encode())
        digest.update(_content(file))
    return digest.hexdigest()


def processor() -> str:
    """Return a description of the processor, which decides the last digits of results."""
    compiler = [getattr(config, "CPU_NAME", None) or get_host_cpu_name(), getattr(config, "CPU_FEATURES", None)]
    libraries = [os.environ.get(name, "") for name in ("NPY_DISABLE_CPU_FEATURES", "OPENBLAS_CORETYPE")]
    return repr(compiler + libraries)


@functools.cache
def _versions() -> str:
    installed = {}
    for package in _VERSIONS:
        with contextlib.suppress(metadata.PackageNotFoundError):
            installed[package] = metadata.version(package)
    return repr(installed)


@functools.cache
def _content(file: Path) -> bytes:
    return file.read_bytes()


@functools.cache
def _imported(file: Path, package: Path) -> tuple[Path, ...]:
    """Return the files of the package that a file imports, and the table of the same name."""
    if file.suffix != ".py":
        return ()
    table = file.with_suffix(".txt")
    return (*_imports(_content(file).decode(), package), *([table] if table.is_file() else []))


def _imports(text: str, package: Path) -> Iterator[Path]:
    for origin, names, whole in _IMPORT.findall(text):
        parts = (origin or whole).split(".")
        # Code outside this package, such as a user's, contains the functions that it imports from it.
        root = next((root for root in (package, _PACKAGE) if root.name == parts[0]), None)
        if root is None:
            continue
        place = root.joinpath(*parts[1:])
        for name in re.findall(r"(\w+)(?:\s+as\s+\w+)?", names) or [""]:
            # A name is a module of its own, or something in the module that it is imported from.
            module = (place / f"{name}.py", place / name / "__init__.py")
            files = (*module, place.with_suffix(".py"), place / "__init__.py")
            yield from [file for file in files if file.is_file()][:1]
