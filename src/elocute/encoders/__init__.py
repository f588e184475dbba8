"""Speech encoders, from sound to Features: the trunk, filterbanks, DeepSpeech, transformers."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.encoders.phone_encoder import PhoneEncoder as PhoneEncoder
    from elocute.encoders.protocol import Encoder as Encoder
    from elocute.encoders.registry import (
        encoder_names as encoder_names,
        resolve_encoder as resolve_encoder,
    )

__getattr__, __dir__ = lazy(__name__, __file__)
