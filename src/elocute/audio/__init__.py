"""Sound: waveforms, reading files, and the features that are plain signal processing.

Names are loaded when first used; numpy is all that loading one needs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.audio.features import Features as Features
    from elocute.audio.mel_with_deltas import (
        MelDeltas as MelDeltas,
        mel_delta_windows as mel_delta_windows,
    )
    from elocute.audio.read import (
        AudioInfo as AudioInfo,
        AudioStream as AudioStream,
        open_audio as open_audio,
        probe_audio as probe_audio,
        read_audio as read_audio,
        resampled_blocks as resampled_blocks,
    )
    from elocute.audio.spectral import (
        fbank as fbank,
        log_mel as log_mel,
        mel_filterbank as mel_filterbank,
        mfcc as mfcc,
        power_spectrum as power_spectrum,
    )
    from elocute.audio.waveform import Waveform as Waveform

__getattr__, __dir__ = lazy(__name__, __file__)
