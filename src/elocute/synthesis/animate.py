"""Speech to motion in one call: read, listen, articulate, move.

The path of the data: `resampled_blocks → PhoneEncoder.stream → log-posteriors → articulate →
Curves → Motion`. Sound is read in blocks, so an hour of it needs bounded memory, and a file
gives the same result whole or in chunks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.driver import articulate, posteriors_from_phones
from elocute.articulation.style import Style, resolve_style
from elocute.audio.waveform import Waveform
from elocute.encoders.phone_encoder import PHONE_RATE, SAMPLE_RATE, builtin_encoder
from elocute.errors import InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.motion import Motion

FPS_RANGE = (1.0, 240.0)
MODELS = ("articulation",)

Progress = Callable[[float], None]
"""Called with the share of the work done, 0…1."""
Phones = list[tuple[float, float, str]]
"""(start s, end s, ARPAbet phone)"""


@dataclass(frozen=True)
class Animation:
    """What `animate` gives: the motion, the curves behind it, and the sound it belongs to."""

    motion: Motion
    curves: Curves
    sound: Path | Waveform

    def write(self, path: str | Path, **options: Any) -> Animation:
        """Write to the format that the suffix names; returns itself, so that calls chain.

        Raises OutputError for an unknown suffix or a place that cannot be written.
        """
        from elocute.export.registry import write

        write(self.motion, Path(path), sound=self.sound, **options)
        return self


def animate(
    speech: str | Path | Waveform,
    *,
    fps: float = 60.0,
    identity: str | int | Path = "mean",
    style: str | Style = "plain",
    strength: float = 1.0,
    model: str = "articulation",
    channel: int | None = None,
    phones: Phones | None = None,
    progress: Progress | None = None,
) -> Animation:
    """Animate the built-in head with speech.

    speech    a sound or video file, or a Waveform
    fps       frames per second of the motion, 1…240
    identity  a name, a seed, or a JSON file of 50 coefficients
    style     a name, a JSON file, or a Style
    strength  how far the mouth moves, 0…2
    phones    their times, where they are known; the encoder is not asked then

    Raises InputError (AudioError, HeadError) for anything that cannot be used.
    """
    _check(fps, model)
    resolved = resolve_style(style)
    head = identity_head(identity)
    log_posteriors, duration_s = listen(speech, channel=channel, phones=phones, progress=progress)
    curves = articulate(
        log_posteriors,
        PHONE_RATE,
        frame_count=max(1, math.ceil(duration_s * fps - 1e-6)),
        fps=fps,
        style=resolved,
        strength=strength,
    )
    sound = speech if isinstance(speech, Waveform) else Path(speech)
    return Animation(motion_from_curves(head, curves), curves, sound)


def identity_head(identity: str | int | Path) -> HeadModel:
    """The built-in head with somebody's face. Raises HeadError."""
    return load_builtin_head().with_identity(resolve_identity(str(identity)))


def listen(
    speech: str | Path | Waveform,
    *,
    channel: int | None = None,
    phones: Phones | None = None,
    progress: Progress | None = None,
) -> tuple[NDArray[np.float32], float]:
    """Log-posteriors (frame, 40) at 50 Hz, and the length of the sound in seconds."""
    encoder = None if phones is not None else builtin_encoder().stream()
    frames, samples = [], 0
    for block, share in _blocks(speech, channel):
        samples += len(block)
        if encoder:
            frames.append(encoder.push(block))
        if progress:
            progress(share)
    duration_s = samples / SAMPLE_RATE
    if encoder is None:
        return posteriors_from_phones(phones or [], duration_s, PHONE_RATE), duration_s
    frames.append(encoder.flush())
    return np.concatenate(frames), duration_s


def _blocks(
    speech: str | Path | Waveform, channel: int | None
) -> Iterable[tuple[NDArray[np.float32], float]]:
    """Blocks of sound at the encoder's rate, each with the share of the whole it completes."""
    if isinstance(speech, Waveform):
        yield speech.resample(SAMPLE_RATE).samples, 1.0
        return
    from elocute.audio.read import open_audio, resampled_blocks

    with open_audio(speech, channel=channel) as stream:
        promised_s = stream.duration_s or math.inf
    done = 0
    for block in resampled_blocks(speech, SAMPLE_RATE, channel=channel):
        done += len(block)
        yield block, min(1.0, done / SAMPLE_RATE / promised_s)


def _check(fps: float, model: str) -> None:
    if not (isinstance(fps, int | float) and FPS_RANGE[0] <= fps <= FPS_RANGE[1]):
        raise InputError.about(
            "fps", found=f"{fps}", allowed=f"{FPS_RANGE[0]:g} to {FPS_RANGE[1]:g}"
        )
    if model not in MODELS:
        raise InputError.about(f"model {model!r}", found="unknown", allowed=", ".join(MODELS))
