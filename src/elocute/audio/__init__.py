"""Sound: waveforms, reading files, and the features that are plain signal processing.

Names are loaded when first used; numpy is all that loading one needs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.audio.espeak import SpokenText, SpokenWord, speak
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
    from elocute.audio.speech_times import SpeechTimes, read_speech_times
    from elocute.audio.voice_settings import VoiceSettings
    from elocute.audio.waveform import Waveform

__all__ = [
    "AudioInfo",
    "AudioStream",
    "Features",
    "MelDeltas",
    "SpeechTimes",
    "SpokenText",
    "SpokenWord",
    "VoiceSettings",
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
    "read_speech_times",
    "resampled_blocks",
    "speak",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "espeak": (
            "SpokenText",
            "SpokenWord",
            "speak",
        ),
        "features": ("Features",),
        "mel_with_deltas": (
            "MelDeltas",
            "mel_delta_windows",
        ),
        "read": (
            "AudioInfo",
            "AudioStream",
            "open_audio",
            "probe_audio",
            "read_audio",
            "resampled_blocks",
        ),
        "spectral": (
            "fbank",
            "log_mel",
            "mel_filterbank",
            "mfcc",
            "power_spectrum",
        ),
        "speech_times": (
            "SpeechTimes",
            "read_speech_times",
        ),
        "voice_settings": ("VoiceSettings",),
        "waveform": ("Waveform",),
    },
)
