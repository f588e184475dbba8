"""Speech blendshapes: a linear basis learned from registered speech (in the wild 2019, 3.3)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy import lazy

if TYPE_CHECKING:
    from elocute.capture.blendshapes.basis_comparison import (
        Basis,
        Projection,
        project,
        strongest_shapes,
    )
    from elocute.capture.blendshapes.basis_motion import sweep
    from elocute.capture.blendshapes.blendshape_learning import Blendshapes, learn_blendshapes
    from elocute.capture.blendshapes.settings import BlendshapeConfig

__all__ = [
    "Basis",
    "BlendshapeConfig",
    "Blendshapes",
    "Projection",
    "learn_blendshapes",
    "project",
    "strongest_shapes",
    "sweep",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "basis_comparison": ("Basis", "Projection", "project", "strongest_shapes"),
        "basis_motion": ("sweep",),
        "blendshape_learning": ("Blendshapes", "learn_blendshapes"),
        "settings": ("BlendshapeConfig",),
    },
)
