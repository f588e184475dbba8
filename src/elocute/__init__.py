"""Elocute: speech in, 3D facial animation out.

    import elocute
    elocute.animate("speech.wav").write("talk.glb")

Names and packages (`elocute.corpus.open_corpus`) are loaded when first used, so that importing this
costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute._version import __version__
from elocute.lazy_loading import lazy
from elocute.notebook_repr import register_view

if TYPE_CHECKING:
    from elocute import (
        adoption as adoption,
    )
    from elocute import (
        alignment as alignment,
    )
    from elocute import (
        articulation as articulation,
    )
    from elocute import (
        audio as audio,
    )
    from elocute import (
        capture as capture,
    )
    from elocute import (
        corpus as corpus,
    )
    from elocute import (
        encoders as encoders,
    )
    from elocute import (
        evaluation as evaluation,
    )
    from elocute import (
        export as export,
    )
    from elocute import (
        head as head,
    )
    from elocute import (
        life as life,
    )
    from elocute import (
        models as models,
    )
    from elocute import (
        motion as motion,
    )
    from elocute import (
        propagation as propagation,
    )
    from elocute import (
        training as training,
    )
    from elocute.animation import Animation, animate
    from elocute.articulation.style import Style
    from elocute.audio.read import read_audio
    from elocute.audio.waveform import Waveform
    from elocute.errors import ElocuteError, InputError
    from elocute.head.builtin import load_builtin_head
    from elocute.head.model import HeadModel
    from elocute.models.streaming import stream
    from elocute.motion.curves import Curves
    from elocute.motion.motion import Motion
    from elocute.motion.mouth_measures import measure_mouth
    from elocute.motion.store import load_motion, save_motion
    from elocute.speaking import say
    from elocute.timed_speech import find_phones


__all__ = [
    "Animation",
    "Curves",
    "ElocuteError",
    "HeadModel",
    "InputError",
    "Motion",
    "Style",
    "Waveform",
    "__version__",
    "animate",
    "find_phones",
    "load_builtin_head",
    "load_motion",
    "measure_mouth",
    "read_audio",
    "save_motion",
    "say",
    "stream",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "animation": (
            "Animation",
            "animate",
        ),
        "articulation.style": ("Style",),
        "audio.read": ("read_audio",),
        "audio.waveform": ("Waveform",),
        "errors": (
            "ElocuteError",
            "InputError",
        ),
        "head.builtin": ("load_builtin_head",),
        "head.model": ("HeadModel",),
        "models.streaming": ("stream",),
        "motion.curves": ("Curves",),
        "motion.motion": ("Motion",),
        "motion.mouth_measures": ("measure_mouth",),
        "motion.store": (
            "load_motion",
            "save_motion",
        ),
        "speaking": ("say",),
        "timed_speech": ("find_phones",),
    },
    packages=(
        "adoption",
        "alignment",
        "articulation",
        "audio",
        "capture",
        "corpus",
        "encoders",
        "evaluation",
        "export",
        "head",
        "life",
        "models",
        "motion",
        "propagation",
        "training",
    ),
)


def _motion_view(motion: Motion) -> str:
    from elocute.export.notebook import viewer_frame

    return viewer_frame(motion, None, repr(motion))


register_view("Motion", _motion_view)
