"""Motion of a head and its curves: measured, stored, solved; edits lie in `motion.edits`."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.motion.blendshape_solver import solve_weights as solve_weights
    from elocute.motion.curves import (
        ARKIT_NAMES as ARKIT_NAMES,
        Curves as Curves,
        curves_from_motion as curves_from_motion,
        motion_from_curves as motion_from_curves,
    )
    from elocute.motion.motion import Motion as Motion
    from elocute.motion.mouth_measures import (
        PhoneMeasures as PhoneMeasures,
        measure_mouth as measure_mouth,
        measure_phones as measure_phones,
        write_measures as write_measures,
        write_phone_measures as write_phone_measures,
    )
    from elocute.motion.store import load_motion as load_motion, save_motion as save_motion
    from elocute.motion.vertex_motion import VertexMotion as VertexMotion

__getattr__, __dir__ = lazy(__name__, __file__)
