"""No module imports itself through others inside a floor; import-linter checks only the order of the floors."""

from __future__ import annotations

from collections.abc import Mapping

import grimp


def test_no_module_imports_itself_by_way_of_others():
    graph, at_import = (
        grimp.build_graph("activesteer", exclude_type_checking_imports=exclude, cache_dir=None)
        for exclude in (False, True)
    )
    imports = {module: set(graph.find_modules_directly_imported_by(module)) for module in graph.modules}
    # The names that the package itself hands on are known to type checkers, and imported at first use.
    imports["activesteer"] = set(at_import.find_modules_directly_imported_by("activesteer"))

    assert len(imports) > 200
    assert _in_circles(imports) == set()
    assert _in_circles({"a": {"b"}, "b": {"c"}, "c": {"b", "d"}, "d": set()}) == {"b", "c"}


def _in_circles(imports: Mapping[str, set[str]]) -> set[str]:
    """Remove modules without further imports or importers, and return the rest."""
    left = {module: set(names) for module, names in imports.items()}
    while True:
        imported = set().union(*left.values())
        ends = {module for module, names in left.items() if not names or module not in imported}
        if not ends:
            return set(left)
        left = {module: names - ends for module, names in left.items() if module not in ends}
