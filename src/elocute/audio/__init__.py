"""Sound: waveforms, reading files, and the features that are plain signal processing.

Names are loaded when first used; numpy is all that importing this needs.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from elocute.audio.features import Features
    from elocute.audio.mel_with_deltas import MelDeltas, mel_delta_windows
    from elocute.audio.read import (
        AudioInfo,
        AudioStream,
        open_audio,
        probe_audio,
        read_audio,
        resampled_blocks,
    )
    from elocute.audio.spectral import fbank, log_mel, mel_filterbank, mfcc, power_spectrum
    from elocute.audio.waveform import Waveform

_HOMES = {
    "AudioInfo": "read",
    "AudioStream": "read",
    "Features": "features",
    "MelDeltas": "mel_with_deltas",
    "Waveform": "waveform",
    "fbank": "spectral",
    "log_mel": "spectral",
    "mel_delta_windows": "mel_with_deltas",
    "mel_filterbank": "spectral",
    "mfcc": "spectral",
    "open_audio": "read",
    "power_spectrum": "spectral",
    "probe_audio": "read",
    "read_audio": "read",
    "resampled_blocks": "read",
}

__all__ = [
    "AudioInfo",
    "AudioStream",
    "Features",
    "MelDeltas",
    "Waveform",
    "fbank",
    "log_mel",
    "mel_delta_windows",
    "mel_filterbank",
    "mfcc",
    "open_audio",
    "power_spectrum",
    "probe_audio",
    "read_audio",
    "resampled_blocks",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'elocute.audio' has no attribute {name!r}")
    return getattr(importlib.import_module(f"elocute.audio.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
