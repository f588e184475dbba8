"""The sound that goes with a motion: from a file or from memory, for every writer."""

from __future__ import annotations

import hashlib
import io
import wave
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import Waveform

Sound = str | Path | Waveform
RATE = 48000
WAV_LONGEST_S = 60.0  # longer sound is packed as MP3


def sound_source(sound: Sound) -> str | Path:
    """What says which sound it is: its file, or a digest of what is in memory."""
    if isinstance(sound, Waveform):
        inside = hashlib.sha256(np.ascontiguousarray(sound.samples).data)
        return f"sound {inside.hexdigest()} at {sound.sample_rate} Hz"
    return Path(sound)


def sound_blocks(sound: Sound, rate: int = RATE) -> Iterator[NDArray[np.float32]]:
    """Mono float32 blocks at `rate` Hz, so that long sound needs little memory."""
    if isinstance(sound, Waveform):
        yield sound.resample(rate).samples
        return
    from elocute.audio.read import resampled_blocks

    yield from resampled_blocks(sound, rate)


def sound_duration_s(sound: Sound) -> float | None:
    """Length in seconds, as far as it is known beforehand."""
    if isinstance(sound, Waveform):
        return sound.duration_s
    from elocute.audio.read import probe_audio

    return probe_audio(sound).duration_s


def write_wav(sound: Sound, path: Path, rate: int = RATE) -> None:
    """Mono 16-bit .wav, block by block. Raises OSError: libsndfile would not say why."""
    with path.open("wb") as opened, wave.open(opened, "wb") as file:
        file.setparams((1, 2, rate, 0, "NONE", "not compressed"))
        for block in sound_blocks(sound, rate):
            file.writeframes(np.rint(np.clip(block, -1, 1) * 32767).astype("<i2").tobytes())


def pack_sound(sound: Sound, *, small: bool = False) -> tuple[bytes, str]:
    """The sound as bytes that every browser plays, and their media type.

    Short sound stays exact, unless it is to be small; long sound becomes MP3, whose header lets
    players skip its delay.
    """
    import soundfile

    short = not small and (sound_duration_s(sound) or WAV_LONGEST_S + 1) <= WAV_LONGEST_S
    kind, subtype = ("WAV", "PCM_16") if short else ("MP3", "MPEG_LAYER_III")
    packed, rate = io.BytesIO(), 32000
    with soundfile.SoundFile(packed, "w", rate, 1, subtype, format=kind) as file:
        for block in sound_blocks(sound, rate):
            file.write(np.clip(block, -1, 1))
    return packed.getvalue(), "audio/wav" if short else "audio/mpeg"
