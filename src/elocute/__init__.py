"""Elocute: speech in, 3D facial animation out.

    import elocute
    elocute.animate("speech.wav").write("talk.glb")

Names and packages (`elocute.corpus.open_corpus`) are loaded when first used, so that importing this
costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute._version import __version__ as __version__
from elocute.lazy_loading import lazy
from elocute.notebook_repr import register_view

if TYPE_CHECKING:
    from elocute import (
        adoption as adoption,
        alignment as alignment,
        articulation as articulation,
        audio as audio,
        capture as capture,
        corpus as corpus,
        encoders as encoders,
        evaluation as evaluation,
        export as export,
        head as head,
        life as life,
        models as models,
        motion as motion,
        propagation as propagation,
        speech as speech,
        training as training,
    )
    from elocute.animation import Animation as Animation, animate as animate
    from elocute.articulation.style import Style as Style
    from elocute.audio.read import read_audio as read_audio
    from elocute.audio.waveform import Waveform as Waveform
    from elocute.errors import ElocuteError as ElocuteError, InputError as InputError
    from elocute.head.builtin import load_builtin_head as load_builtin_head
    from elocute.head.model import HeadModel as HeadModel
    from elocute.models.streaming import stream as stream
    from elocute.motion.curves import Curves as Curves
    from elocute.motion.motion import Motion as Motion
    from elocute.motion.mouth_measures import measure_mouth as measure_mouth
    from elocute.motion.store import load_motion as load_motion, save_motion as save_motion
    from elocute.speaking import say as say
    from elocute.speech.timed_phones import find_phones as find_phones


__getattr__, __dir__ = lazy(__name__, __file__)


def _motion_view(motion: Motion) -> str:
    from elocute.export.html import viewer_frame

    return viewer_frame(motion, None, repr(motion))


register_view("Motion", _motion_view)
