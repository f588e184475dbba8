"""Which name is which speech encoder."""

from __future__ import annotations

import importlib
from pathlib import Path

from elocute.encoders.encoder import Encoder
from elocute.errors import InputError

DEFAULT = "phones"

# kind: (module beside this one, class, what must follow a colon), imported when first needed.
ENCODERS: dict[str, tuple[str, str, str]] = {
    "phones": ("builtin_encoders", "Phones", ""),
    "fbank": ("builtin_encoders", "Fbank", ""),
    "deepspeech": ("deepspeech", "DeepSpeech", "PATH.pb"),
    "wav2vec2": ("speech_transformer", "Wav2Vec2", "FOLDER"),
    "hubert": ("speech_transformer", "Hubert", "FOLDER"),
    "wavlm": ("speech_transformer", "WavLM", "FOLDER"),
}


def encoder_names() -> tuple[str, ...]:
    """The names as a user writes them: `phones`, `deepspeech:PATH.pb`."""
    return tuple(f"{kind}:{what}" if what else kind for kind, (_, _, what) in ENCODERS.items())


def resolve_encoder(name: str = DEFAULT) -> Encoder:
    """The encoder of that name. Its network is loaded when it is first called.

    Raises InputError for a name that nothing has, a path that is missing or uncalled for, and
    files that are plainly not what the name says.
    """
    kind, colon, path = name.partition(":")
    if kind not in ENCODERS:
        raise InputError.about(
            "encoder",
            found=f"{name!r}",
            allowed=", ".join(encoder_names()),
            remedy="choose one of these",
        )
    module, class_name, what = ENCODERS[kind]
    if bool(path) != bool(what) or bool(colon) != bool(what):
        wanted = f"{kind}:{what}" if what else kind
        raise InputError.about("encoder", found=f"{name!r}", allowed=wanted)
    encoder_class = getattr(importlib.import_module(f"elocute.encoders.{module}"), class_name)
    return encoder_class(Path(path)) if what else encoder_class()
