"""Pictures of heads: one interface, two engines, the same shading."""

from elocute.export.render.camera import VIEWS, Camera, portrait
from elocute.export.render.engine import (
    BACKENDS,
    Renderer,
    available_backends,
    open_renderer,
    picture_size,
)

__all__ = [
    "BACKENDS",
    "VIEWS",
    "Camera",
    "Renderer",
    "available_backends",
    "open_renderer",
    "picture_size",
    "portrait",
]
