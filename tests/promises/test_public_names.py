"""What is public: the names that packages list in `__all__`, and nothing else."""

from __future__ import annotations

import ast
import importlib
import pkgutil
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import elocute

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "elocute"
INSIDES = ("cli", "files", "jobs", "networks", "numerics")
"""Packages in which nothing is public."""
LISTED = re.compile(r"^__all__ = ", re.M)
HOMES = {
    ".".join(["elocute", *home.parent.relative_to(SOURCE).parts]): home
    for home in sorted(SOURCE.rglob("__init__.py"))
    if LISTED.search(home.read_text(encoding="utf-8"))
}
"""Every package with an `__all__`, and its source."""
PUBLIC = [(package, name) for package in HOMES for name in importlib.import_module(package).__all__]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
EXAMPLES = sorted((ROOT / "examples").rglob("*.py"))


def typed_imports(tree: ast.Module) -> dict[str, str]:
    """Names that type checkers see, and the modules they take them from."""
    return {
        (each.asname or each.name): node.module
        for block in tree.body
        if isinstance(block, ast.If) and ast.unparse(block.test) == "TYPE_CHECKING"
        for node in block.body
        if isinstance(node, ast.ImportFrom) and node.module
        for each in node.names
    }


def lazy_homes(tree: ast.Module, package: str) -> tuple[dict[str, str], set[str]]:
    """Names that are loaded when asked for by their modules, and packages."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "lazy":
            homes = ast.literal_eval(node.args[1])
            packages = [ast.literal_eval(each.value) for each in node.keywords]
            names = {n: f"{package}.{module}" for module, ns in homes.items() for n in ns}
            return names, {each for given in packages for each in given}
    return {}, set()


def test_every_package_says_what_is_public_or_is_an_inside() -> None:
    packages = {
        module.name
        for module in pkgutil.iter_modules(elocute.__path__)
        if module.ispkg and module.name not in INSIDES
    }
    assert {f"elocute.{name}" for name in packages} <= set(HOMES)
    assert not [home for home in HOMES if home.split(".")[1:2] and home.split(".")[1] in INSIDES]


@pytest.mark.parametrize("package", HOMES)
def test_type_checkers_python_and_all_name_the_same(package: str) -> None:
    tree = ast.parse(HOMES[package].read_text(encoding="utf-8"))
    names, packages = lazy_homes(tree, package)
    if not names:  # loaded at once: what is imported is what is there
        return
    typed = typed_imports(tree)
    assert {name: typed[name] for name in names} == names
    assert set(typed) == set(names) | packages
    listed = importlib.import_module(package).__all__
    assert set(listed) - {"__version__"} == set(names)
    assert len(listed) == len(set(listed))


@pytest.mark.parametrize("package", HOMES)
def test_no_public_name_is_that_of_a_module_beside_it(package: str) -> None:
    """The module would take its place as soon as somebody imported it."""
    names, _ = lazy_homes(ast.parse(HOMES[package].read_text(encoding="utf-8")), package)
    assert not set(names) & {m.name for m in pkgutil.iter_modules([str(HOMES[package].parent)])}


@pytest.mark.parametrize(("package", "name"), PUBLIC, ids=lambda text: text)
def test_a_public_name_loads_and_says_what_it_is(package: str, name: str) -> None:
    try:
        found = getattr(importlib.import_module(package), name)
    except ModuleNotFoundError as error:
        pytest.skip(f"needs {error.name}")
    assert name in dir(importlib.import_module(package)) or name == "__version__"
    if isinstance(found, type) or callable(found):
        assert (found.__doc__ or "").strip(), f"{package}.{name} has no docstring"
        assert not (found.__doc__ or "").startswith(f"{name}(")  # what dataclasses make up


def test_a_name_that_there_is_not_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match=r"'elocute\.corpus' has no attribute 'open_crypt'"):
        _ = elocute.corpus.open_crypt  # type: ignore[attr-defined]
    assert isinstance(elocute.corpus, ModuleType)


def test_importing_a_package_loads_nothing_heavy() -> None:
    names = sorted(package for package in HOMES if package != "elocute.motion.edits")
    code = f"import importlib, sys; [importlib.import_module(n) for n in {names}];" + (
        "print([m for m in ('numpy', 'scipy', 'torch', 'av', 'onnxruntime', 'numba', 'pyarrow')"
        " if m in sys.modules])"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"


def python_of(page: Path) -> Iterator[ast.Module]:
    """The Python of a page or an example."""
    text = page.read_text(encoding="utf-8")
    blocks = [text] if page.suffix == ".py" else re.findall(r"```python\n(.*?)```", text, re.S)
    for block in blocks:
        yield ast.parse(block)


@pytest.mark.parametrize(
    "page", [*PAGES, *EXAMPLES], ids=lambda path: path.relative_to(ROOT).as_posix()
)
def test_pages_and_examples_use_public_names_alone(page: Path) -> None:
    private = []
    for tree in python_of(page):
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("elocute"):
                used = [(node.module or "", each.name) for each in node.names]
            elif isinstance(node, ast.Attribute) and ast.unparse(node.value) in HOMES:
                used = [(ast.unparse(node.value), node.attr)]
            else:
                continue
            private += [f"{home}.{name}" for home, name in used if not is_public(home, name)]
    assert private == []


def is_public(home: str, name: str) -> bool:
    """Whether a package lists the name, it is a package that lists names, or Python's own."""
    listed = importlib.import_module(home).__all__ if home in HOMES else ()
    return name in listed or f"{home}.{name}" in HOMES or name.startswith("__")
