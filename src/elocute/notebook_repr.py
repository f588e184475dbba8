"""What an object shows of itself in a notebook.

What draws lies above most of what is drawn. So a class asks here for its view, and the package
itself, which stands above all, says who draws it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_views: dict[str, Callable[[Any], str]] = {}


def register_view(kind: str, view: Callable[[Any], str]) -> None:
    """Say what makes the HTML of objects of the class named `kind`."""
    _views[kind] = view


def html_of(item: object) -> str:
    """The HTML that shows an object in a notebook."""
    return _views[type(item).__name__](item)
