"""No module needs itself: the imports of the package have no circle, type checkers' included."""

from __future__ import annotations

from graphlib import CycleError, TopologicalSorter

import grimp
import pytest


def test_imports_have_no_circle() -> None:
    graph = grimp.build_graph("elocute", cache_dir=None)
    # A package re-exports names of its modules for type checkers alone.
    packages = {module for module in graph.modules if graph.find_children(module)}
    imports = {
        module: graph.find_modules_directly_imported_by(module)
        for module in graph.modules - packages
    }
    assert len(imports) > 400
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        pytest.fail(" → ".join(error.args[1]))
