"""Elocute: speech in, 3D facial animation out.

    import elocute
    elocute.animate("speech.wav").write("talk.glb")

Names are loaded when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from elocute._version import __version__
from elocute.notebook_repr import register_view

if TYPE_CHECKING:
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


_HOMES = {
    "Animation": "elocute.animation",
    "Curves": "elocute.motion.curves",
    "ElocuteError": "elocute.errors",
    "HeadModel": "elocute.head.model",
    "InputError": "elocute.errors",
    "Motion": "elocute.motion.motion",
    "Style": "elocute.articulation.style",
    "Waveform": "elocute.audio.waveform",
    "animate": "elocute.animation",
    "load_builtin_head": "elocute.head.builtin",
    "load_motion": "elocute.motion.store",
    "measure_mouth": "elocute.motion.mouth_measures",
    "read_audio": "elocute.audio.read",
    "save_motion": "elocute.motion.store",
    "stream": "elocute.models.streaming",
}

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
    "load_builtin_head",
    "load_motion",
    "measure_mouth",
    "read_audio",
    "save_motion",
    "stream",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'elocute' has no attribute {name!r}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted(__all__)


def _motion_view(motion: Motion) -> str:
    from elocute.export.notebook import viewer_frame

    return viewer_frame(motion, None, repr(motion))


register_view("Motion", _motion_view)
