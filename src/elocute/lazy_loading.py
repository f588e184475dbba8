"""Names of a package that are imported when they are first asked for.

    if TYPE_CHECKING:
        from elocute.corpus.corpus_store import Corpus, open_corpus

    __all__ = ["Corpus", "open_corpus"]
    __getattr__, __dir__ = lazy(__name__, {"corpus_store": ("Corpus", "open_corpus")})

Type checkers read the imports, Python the names' homes.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterable, Mapping
from typing import Any


def lazy(
    package: str, homes: Mapping[str, Iterable[str]], packages: Iterable[str] = ()
) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Make `__getattr__` and `__dir__` of a package that loads its names when first asked for.

    Parameters
    ----------
    package : str
        Its `__name__`.
    homes : mapping of str to iterable of str
        Modules of the package, and the names that each defines.
    packages : iterable of str
        Packages inside it that are reached as attributes.

    Returns
    -------
    __getattr__, __dir__ : callable
    """
    module_of = {name: module for module, names in homes.items() for name in names}
    inner = frozenset(packages)

    def find(name: str) -> Any:
        if name in inner:
            return importlib.import_module(f"{package}.{name}")
        if name not in module_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        found = getattr(importlib.import_module(f"{package}.{module_of[name]}"), name)
        setattr(sys.modules[package], name, found)
        return found

    def names() -> list[str]:
        return sorted({*module_of, *inner})

    return find, names
