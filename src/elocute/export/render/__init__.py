"""Pictures of heads: one interface, two engines, the same shading."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.export.render.backends_and_views import BACKENDS, VIEWS
    from elocute.export.render.camera import Camera, portrait
    from elocute.export.render.engine import (
        Renderer,
        available_backends,
        open_renderer,
        picture_size,
    )
    from elocute.export.render.stage import Stage

__all__ = [
    "BACKENDS",
    "VIEWS",
    "Camera",
    "Renderer",
    "Stage",
    "available_backends",
    "open_renderer",
    "picture_size",
    "portrait",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "camera": ("Camera", "portrait"),
        "backends_and_views": ("BACKENDS", "VIEWS"),
        "stage": ("Stage",),
        "engine": ("Renderer", "available_backends", "open_renderer", "picture_size"),
    },
)
