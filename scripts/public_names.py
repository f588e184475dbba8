#!/usr/bin/env python3
"""What is public is in the `__all__` of packages; it loads, says what it is, and is all that
documents use. Functions of the first packages have an example there, which the tests run.

    python scripts/public_names.py    names what is wrong; exit code 1 where there is something
"""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from elocute.errors import MachineError

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "elocute"
LISTED = re.compile(r"^(__all__ = |__getattr__, __dir__ = lazy)", re.M)
HOMES = {
    ".".join(["elocute", *home.parent.relative_to(SOURCE).parts]): home
    for home in sorted(SOURCE.rglob("__init__.py"))
    if LISTED.search(home.read_text(encoding="utf-8"))
}
"""Every package with public names, and its source."""
SHOWN = ("elocute", "elocute.encoders", "elocute.life", "elocute.motion")
"""Packages each of whose functions has an example."""
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))


def names_of(package: str) -> Iterator[str]:
    """Public names that a module beside them hides as soon as somebody imports it."""
    beside = {module.name for module in pkgutil.iter_modules([str(HOMES[package].parent)])}
    loaded = importlib.import_module(package)
    yield from (
        f"{package}.{name}: a module beside it has that name"
        for name in set(loaded.__all__) & beside
        if not isinstance(getattr(loaded, name), ModuleType)
    )


def meaning_of(package: str, name: str) -> Iterator[str]:
    """What is wrong with a public name: it does not load, or does not say what it is."""
    module = importlib.import_module(package)
    try:
        found = getattr(module, name)
    except (ModuleNotFoundError, MachineError) as error:
        print(f"{package}.{name} is left out: {error}", file=sys.stderr)
        return
    if name not in dir(module) and name != "__version__":
        yield f"{package}.{name}: not in dir()"
    told = (getattr(found, "__doc__", None) or "").strip()
    if callable(found) and (not told or told.startswith(f"{name}(")):  # dataclasses make that up
        yield f"{package}.{name}: no docstring"


def python_of(page: Path) -> Iterator[ast.Module]:
    """The Python of a page or an example."""
    text = page.read_text(encoding="utf-8")
    blocks = [text] if page.suffix == ".py" else re.findall(r"```python\n(.*?)```", text, re.S)
    for block in blocks:
        yield ast.parse(block)


def private_names(page: Path) -> Iterator[str]:
    """What a page or an example uses that is not public."""
    for tree in python_of(page):
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("elocute"):
                used = [(node.module or "", each.name) for each in node.names]
            elif isinstance(node, ast.Attribute) and ast.unparse(node.value) in HOMES:
                used = [(ast.unparse(node.value), node.attr)]
            else:
                continue
            for home, name in used:
                if not is_public(home, name):
                    yield f"{page.relative_to(ROOT)}: {home}.{name} is not public"


def is_public(home: str, name: str) -> bool:
    """Whether a package lists the name, it is a package that lists names, or Python's own."""
    listed = importlib.import_module(home).__all__ if home in HOMES else ()
    return name in listed or f"{home}.{name}" in HOMES or name.startswith("__")


def without_example(package: str) -> Iterator[str]:
    """Functions of a package that no page and no example uses."""
    trees = [tree for page in (*PAGES, *EXAMPLES) for tree in python_of(page)]
    nodes = [node for tree in trees for node in ast.walk(tree)]
    used = {node.id for node in nodes if isinstance(node, ast.Name)}
    used |= {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    module = importlib.import_module(package)
    for name in module.__all__:
        if inspect.isfunction(getattr(module, name)) and name not in used:
            yield f"{package}.{name}: no example in a page or in examples/"


def main() -> int:
    told = [line for package in HOMES for line in names_of(package)]
    told += [line for package in SHOWN for line in without_example(package)]
    for package in HOMES:
        for name in importlib.import_module(package).__all__:
            told += meaning_of(package, name)
    told += [line for page in (*PAGES, *EXAMPLES) for line in private_names(page)]
    print("\n".join(told), end="\n" if told else "")
    return bool(told)


if __name__ == "__main__":
    sys.exit(main())
