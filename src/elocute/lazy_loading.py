"""Names of a package that are imported when they are first asked for.

    if TYPE_CHECKING:
        from elocute.corpus.corpus_store import Corpus as Corpus
        from elocute.corpus.corpus_store import open_corpus as open_corpus

    __getattr__, __dir__ = lazy(__name__, __file__)

Type checkers read the imports as they are, `lazy` reads the names and their homes from them.
"""

from __future__ import annotations

import ast
import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any


def lazy(package: str, file: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Make `__getattr__` and `__dir__` of a package that loads its names when first asked for.

    The package gets an `__all__` of the names that its `if TYPE_CHECKING:` imports as themselves;
    packages inside it are reached, and are not among them.

    Parameters
    ----------
    package : str
        Its `__name__`.
    file : str
        Its `__file__`.

    Returns
    -------
    __getattr__, __dir__ : callable
    """
    homes = dict(_reexported(Path(file).read_text("utf-8")))
    module = sys.modules[package]
    own = [name for name, home in homes.items() if home != package]
    version = [name for name in ("__version__",) if name in vars(module)]
    vars(module)["__all__"] = sorted([*own, *version])

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        home = homes[name]
        if home == package:
            return importlib.import_module(f"{package}.{name}")
        value = getattr(importlib.import_module(home), name)
        setattr(module, name, value)
        return value

    return find, lambda: sorted([*homes, *version])


def _reexported(source: str) -> Iterator[tuple[str, str]]:
    """Names that a source imports as themselves for type checkers, and from which module."""
    for block in ast.parse(source).body:
        if isinstance(block, ast.If):
            for line in block.body:
                if isinstance(line, ast.ImportFrom) and line.module:
                    yield from ((name.name, line.module) for name in line.names if name.asname)
