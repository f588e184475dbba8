"""Sound to Features: the built-in phone encoder, filterbanks, DeepSpeech, speech transformers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.encoders.phone_encoder import PhoneEncoder
    from elocute.encoders.protocol import Encoder
    from elocute.encoders.registry import encoder_names, resolve_encoder

__all__ = [
    "Encoder",
    "PhoneEncoder",
    "encoder_names",
    "resolve_encoder",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "phone_encoder": ("PhoneEncoder",),
        "protocol": ("Encoder",),
        "registry": ("encoder_names", "resolve_encoder"),
    },
)
