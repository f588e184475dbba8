"""Speech blendshapes: a linear basis learned from registered speech (in the wild 2019, 3.3).

blendshape_learning    a corpus to a head whose shapes are the basis; a Motion that shows them
components             principal directions, and shapes that each move a part of the face
settings               how many shapes, and how sparse
basis_comparison       how well a basis represents faces it was not learned from
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.capture.blendshapes.basis_comparison import (
        BasisProjection as BasisProjection,
        ReconstructionErrors as ReconstructionErrors,
        reconstruction_errors as reconstruction_errors,
        strongest_shapes as strongest_shapes,
    )
    from elocute.capture.blendshapes.blendshape_learning import (
        Blendshapes as Blendshapes,
        learn_blendshapes as learn_blendshapes,
        sweep_shapes as sweep_shapes,
    )
    from elocute.capture.blendshapes.settings import BlendshapeConfig as BlendshapeConfig

__getattr__, __dir__ = lazy(__name__, __file__)
