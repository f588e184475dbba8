"""What an object shows of itself in a notebook.

The code that draws lies in a layer above most of what is drawn. So a class asks here for its view,
and `elocute` itself, which is above all layers, registers what draws it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

_views: dict[str, Callable[[Any], str]] = {}


def register_view(kind: str, view: Callable[[Any], str]) -> None:
    """Register what makes the HTML of objects.

    Parameters
    ----------
    kind : str
        The name of their class.
    view : callable
        Takes the object and returns its HTML.
    """
    _views[kind] = view


def html_of(item: object) -> str:
    """The HTML that shows an object in a notebook.

    Parameters
    ----------
    item
        Of a class that was registered.

    Returns
    -------
    str
    """
    return _views[type(item).__name__](item)
