"""The shapes that docstrings give are checked at every call that a test makes.

    points : (vertex, 3) float32

in the section Parameters or Returns of a public function, method or dataclass says that the array
has two axes, the second of length 3; an axis of the same name has one length throughout a call.
`...` stands for any axes before or after the rest. What is returned has the dtype given as well.
Calls that raise are left alone: what is refused may have any shape. See docs/decisions/010.
"""

from __future__ import annotations

import functools
import importlib.abc
import importlib.machinery
import inspect
import re
import sys
from collections.abc import Callable, Container
from dataclasses import is_dataclass
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

SECTION = re.compile(r"^(\w+)\n-+\n(.*?)(?=^\w+\n-+\n|\Z)", re.M | re.S)
PARAMETER = re.compile(r"^(\w[\w, ]*) : (\([^()]*\))(?: (\w+))?(?:, optional)?$", re.M)
RETURNED = re.compile(r"\A(\([^()]*\))(?: (\w+))?$", re.M)
PACKAGE = "elocute"
# In processes of their own, and in torch's, arrays are tensors.
LEFT_OUT = ("elocute.cli", "elocute.networks", "elocute.training", "elocute.__main__")
Shape = tuple[str, ...]


class ShapeError(AssertionError):
    """An array is not what a docstring says."""


def parse(text: str) -> Shape:
    """Names, numbers and `...` of a shape in brackets."""
    inner = text.strip("()").replace("…", "...")
    return tuple(part.strip() for part in inner.split(",") if part.strip())


def documented(text: str) -> tuple[dict[str, Shape], tuple[Shape, str] | None]:
    """The shapes of parameters, and shape and dtype of what is returned."""
    sections = dict(SECTION.findall(text))
    parameters = {
        name.strip(): parse(shape)
        for names, shape, _ in PARAMETER.findall(sections.get("Parameters", ""))
        for name in names.split(",")
    }
    returned = RETURNED.search(sections.get("Returns", ""))
    return parameters, (parse(returned[1]), returned[2] or "") if returned else None


def check(where: str, array: Any, shape: Shape, lengths: dict[str, int], dtype: str = "") -> None:
    """Compare one array with its shape; lengths by name are kept for the rest of the call."""
    if not isinstance(array, np.ndarray):
        return

    def said(more: str = "") -> ShapeError:
        found = f"{array.shape} {array.dtype}, documented as ({', '.join(shape)}) {dtype}"
        return ShapeError(f"{where}: {found}{more}")

    axes, found = shape, array.shape
    if "..." in axes:
        first, last = axes[0] == "...", axes[-1] == "..."
        axes = axes[first : len(axes) - last]
        found = found[max(len(found) - len(axes), 0) :] if first else found[: len(axes)]
    if len(axes) != len(found):
        raise said()
    for axis, length in zip(axes, found, strict=True):
        sizes = _sizes(axis)
        right = lengths.setdefault(axis, length) == length if sizes is None else length in sizes
        if not right:
            raise said(f"; {axis} = {lengths.get(axis, axis)}")
    if dtype and not _of(array, dtype):
        raise said()


@functools.cache
def _sizes(axis: str) -> Container[int] | None:
    """What an axis may measure: numbers, any for a formula, or None for one that has a name."""
    if re.fullmatch(r"\d+( or \d+)*", axis):
        return frozenset(map(int, axis.split(" or ")))
    return None if re.fullmatch(r"[A-Za-z_][\w ]*", axis) else range(sys.maxsize)


def _of(array: np.ndarray, dtype: str) -> bool:
    """Whether the array has the dtype of that name; any word that names none is let pass."""
    kinds = {"int": np.integer, "float": np.floating}
    if dtype in kinds:
        return bool(np.issubdtype(array.dtype, kinds[dtype]))
    try:
        return array.dtype == np.dtype(dtype)
    except TypeError:
        return True


def checked(function: Callable[..., Any], text: str, where: str) -> Callable[..., Any]:
    """`function`, its arrays compared with the docstring after every call that succeeds."""
    parameters, returned = documented(text)
    if not parameters and returned is None:
        return function
    signature = inspect.signature(function)

    @functools.wraps(function)
    def call(*args: Any, **options: Any) -> Any:
        result = function(*args, **options)
        given = signature.bind(*args, **options).arguments
        lengths: dict[str, int] = {}
        for name, shape in parameters.items():
            check(f"{where}, `{name}`", given.get(name), shape, lengths)
        if returned:
            check(f"{where} returns", result, returned[0], lengths, returned[1])
        return result

    return call


def check_module(module: ModuleType) -> None:
    """Put the checked in the place of functions, methods and dataclasses of a module."""
    for name, found in list(vars(module).items()):
        if getattr(found, "__module__", None) != module.__name__ or name.startswith("_"):
            continue
        where = f"{module.__name__}.{name}"
        if isinstance(found, FunctionType):
            setattr(module, name, checked(found, inspect.getdoc(found) or "", where))
        elif inspect.isclass(found):
            for key, method in list(vars(found).items()):
                if isinstance(method, FunctionType) and not key.startswith("_"):
                    text = inspect.getdoc(method) or ""
                    setattr(found, key, checked(method, text, f"{where}.{key}"))
            if is_dataclass(found):
                text = inspect.cleandoc(found.__doc__ or "")
                text = "".join(f"{n}\n---\n{t}" for n, t in SECTION.findall(text) if n != "Returns")
                found.__init__ = checked(found.__init__, text, where)  # type: ignore[method-assign]


class _Loader(importlib.abc.Loader):
    def __init__(self, loader: Any) -> None:
        self._loader = loader

    def create_module(self, spec: Any) -> ModuleType | None:
        return self._loader.create_module(spec)

    def exec_module(self, module: ModuleType) -> None:
        self._loader.exec_module(module)
        check_module(module)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._loader, name)


class _Finder(importlib.abc.MetaPathFinder):
    def find_spec(self, fullname: str, path: Any, target: Any = None) -> Any:
        if not fullname.startswith(PACKAGE + ".") or fullname.startswith(LEFT_OUT):
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path, target)
        if spec is not None and isinstance(spec.loader, importlib.machinery.SourceFileLoader):
            spec.loader = _Loader(spec.loader)  # type: ignore[assignment]
        return spec


def install() -> None:
    """Check every module of the package that is not yet imported, from its first import on.

    The fuzzer's processes import the conftest late, for its writers of files: there it is too late.
    In pytest it is not, which tests/promises/test_documented_shapes.py makes sure of.
    """
    sys.meta_path.insert(0, _Finder())
