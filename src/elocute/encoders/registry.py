"""Opens a speech encoder by its name."""

from __future__ import annotations

import importlib
from pathlib import Path

from elocute.encoders.protocol import Encoder
from elocute.errors import InputError

DEFAULT_ENCODER = "phones"

# kind: (module beside this one, class, what must follow a colon), imported when first needed.
ENCODERS: dict[str, tuple[str, str, str]] = {
    "phones": ("phone_encoder", "PhonePosteriors", ""),
    "trunk": ("phone_encoder", "TrunkMiddle", ""),
    "fbank": ("filterbank_encoder", "FilterbankEnergies", ""),
    "deepspeech": ("deepspeech", "DeepSpeech", "PATH.pb"),
    "wav2vec2": ("speech_transformer", "Wav2Vec2", "FOLDER"),
    "hubert": ("speech_transformer", "Hubert", "FOLDER"),
    "wavlm": ("speech_transformer", "WavLM", "FOLDER"),
}


def encoder_names() -> tuple[str, ...]:
    """The names as a user writes them: `phones`, `deepspeech:PATH.pb`."""
    return tuple(f"{kind}:{what}" if what else kind for kind, (_, _, what) in ENCODERS.items())


def resolve_encoder(name: str = DEFAULT_ENCODER) -> Encoder:
    """The speech encoder of that name; its network is loaded when it is first called.

    Parameters
    ----------
    name : str
        "phones", "trunk", "fbank", "deepspeech:PATH.pb", "wav2vec2:FOLDER", "hubert:FOLDER" or
        "wavlm:FOLDER".

    Returns
    -------
    Encoder
        A callable from Waveform to Features at 50 Hz.

    Raises
    ------
    InputError
        For an unknown name, a path that is missing or not expected, and files that are plainly not
        what the name says.
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
