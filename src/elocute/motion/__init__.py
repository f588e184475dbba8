"""Motion of a head and its curves: measured, stored, solved; edits lie in `motion.edits`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.motion.blendshape_solver import solve_weights
    from elocute.motion.curves import ARKIT_NAMES, Curves, curves_from_motion, motion_from_curves
    from elocute.motion.motion import Motion
    from elocute.motion.mouth_measures import measure_mouth, write_measures
    from elocute.motion.store import load_motion, save_motion
    from elocute.motion.vertex_motion import VertexMotion

__all__ = [
    "ARKIT_NAMES",
    "Curves",
    "Motion",
    "VertexMotion",
    "curves_from_motion",
    "load_motion",
    "measure_mouth",
    "motion_from_curves",
    "save_motion",
    "solve_weights",
    "write_measures",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "curves": ("ARKIT_NAMES", "Curves", "curves_from_motion", "motion_from_curves"),
        "motion": ("Motion",),
        "mouth_measures": ("measure_mouth", "write_measures"),
        "blendshape_solver": ("solve_weights",),
        "store": ("load_motion", "save_motion"),
        "vertex_motion": ("VertexMotion",),
    },
)
