"""Speech to motion in one call: read, listen, articulate, move.

The path of the data: `resampled_blocks → PhoneEncoder.stream → log-posteriors → articulate →
Curves → Motion`. Sound is read in blocks, so an hour of it needs bounded memory, and a file
gives the same result whole or in chunks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.driver import articulate, posteriors_from_phones
from elocute.articulation.style import Style, resolve_style
from elocute.audio.features import Features
from elocute.audio.given import Speech, sound_of
from elocute.audio.waveform import Waveform
from elocute.encoders.phone_encoder import PHONE_RATE, SAMPLE_RATE, builtin_encoder
from elocute.encoders.registry import resolve_encoder
from elocute.errors import InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.choice import open_head
from elocute.head.identity import resolve_identity
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves, curves_from_motion, motion_from_curves
from elocute.motion.motion import Motion
from elocute.synthesis.crnn import CrnnModel
from elocute.synthesis.learned import (
    crnn_curves,
    crnn_motion,
    learned_curves,
    learned_motion,
    style_of,
)
from elocute.synthesis.trained import NAMES, is_trained, open_trained
from elocute.synthesis.voca import VocaModel

FPS_RANGE = (1.0, 240.0)
ARTICULATION = "articulation"
DEFAULT_MODEL = ARTICULATION

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

    def __repr__(self) -> str:
        sound = self.sound if isinstance(self.sound, Waveform) else self.sound.name
        return (
            f"Animation({self.motion.frame_count} frames at {self.motion.fps:g} fps, "
            f"{self.motion.duration_s:.2f} s, sound {sound!r})"
        )

    def _repr_html_(self) -> str:
        """The viewer with its sound, for notebooks."""
        from elocute.export.notebook import viewer_frame

        return viewer_frame(self.motion, self.sound, repr(self))

    def write(self, path: str | Path, **options: Any) -> Animation:
        """Write to the format that the suffix names; returns itself, so that calls chain.

        A file of that name is replaced. A side file (NAME.wav beside NAME.glb) is replaced only
        where it was made of this very sound, and a folder of meshes never, but for
        `overwrite=True`. Raises OutputError for an unknown suffix or a place that cannot be
        written.
        """
        from elocute.export.registry import write

        write(self.motion, Path(path), sound=self.sound, **options)
        return self


def animate(
    speech: Speech,
    *,
    rate: int | None = None,
    fps: float = 60.0,
    identity: str | int | Path = "mean",
    head: str | Path = "builtin",
    style: str | Style = "plain",
    strength: float = 1.0,
    model: str | Path = DEFAULT_MODEL,
    channel: int | None = None,
    phones: Phones | None = None,
    progress: Progress | None = None,
) -> Animation:
    """Animate a head with speech.

    speech    a sound or video file, or a Waveform; or the bytes of such a file, a binary file
              object, or an array of samples (see `elocute.audio.given`)
    rate      Hz, of an array
    fps       frames per second of the motion, 1…240
    identity  a face of the built-in head: a name, a seed, or a JSON file of 50 coefficients
    head      "builtin", or a head or mesh file in the topology that the model moves
    style     a name, a mix (`calm:0.7,broad:0.3`), for "articulation" also a JSON file or a Style
    strength  how far the mouth moves, 0…2
    model     "articulation", "voca", "crnn", or a trained model (.onnx)
    phones    their times, where they are known; the encoder is not asked then

    Raises InputError (AudioError, HeadError, ModelError) for anything that cannot be used.
    """
    _check(fps, strength)
    speech = sound = sound_of(speech, rate, channel)
    if str(model) == ARTICULATION:
        resolved, rig = resolve_style(style), _rig(head, identity)
        heard, duration_s = listen(speech, channel=channel, phones=phones, progress=progress)
        count = max(1, math.ceil(duration_s * fps - 1e-6))
        curves = articulate(
            heard, PHONE_RATE, frame_count=count, fps=fps, style=resolved, strength=strength
        )
        return Animation(motion_from_curves(rig, curves), curves, sound)
    if not is_trained(model):
        raise InputError.about(
            f"model {str(model)!r}", found="unknown",
            allowed=f"{ARTICULATION}, {', '.join(NAMES)}, or a trained model (.onnx)",
        )  # fmt: skip
    learned = open_trained(model)
    if isinstance(learned, CrnnModel):
        given = {"channel": channel, "phones": phones, "progress": progress}
        rates = {"fps": fps, "strength": strength}
        return _recurrent(learned, speech, _rig(head, identity), style, given, rates)
    shares, rig = style_of(learned, style), _rig(head, identity)
    heard, duration_s = listen(speech, channel=channel, phones=phones, progress=progress)
    features = _features(learned, speech, channel, heard)
    settings = {"duration_s": duration_s, "fps": fps, "strength": strength}
    if learned.record.components:
        curves = learned_curves(learned, features, heard, shares, **settings)
        return Animation(motion_from_curves(rig, curves), curves, sound)
    motion = learned_motion(learned, rig, features, shares, **settings)
    return Animation(motion, curves_from_motion(motion), sound)


def _recurrent(
    model: CrnnModel, speech: str | Path | Waveform, rig: HeadModel, style: str | Style,
    given: dict[str, Any], rates: dict[str, float],
) -> Animation:  # fmt: skip
    """The recurrent model hears the sound itself; phones say where lips meet."""
    if style != "plain":
        raise InputError.about(
            f"style {style}", found=f"{model.path.name} has no styles", allowed="plain"
        )
    heard, duration_s = listen(speech, **given)
    source = speech if isinstance(speech, Waveform) else Path(speech)
    sound = _whole(speech, given["channel"])
    if model.record.topology == load_builtin_head().name:
        curves = crnn_curves(model, sound, heard, PHONE_RATE, duration_s=duration_s, **rates)
        return Animation(motion_from_curves(rig, curves), curves, source)
    motion = crnn_motion(model, rig, sound, duration_s=duration_s, **rates)
    return Animation(motion, curves_from_motion(motion), source)


def _whole(speech: str | Path | Waveform, channel: int | None) -> Waveform:
    if isinstance(speech, Waveform):
        return speech
    from elocute.audio.read import read_audio

    return read_audio(speech, channel=channel)


def _rig(head: str | Path, identity: str | int | Path) -> HeadModel:
    """The head that moves. Raises HeadError."""
    if str(head) == "builtin":
        return identity_head(identity)
    if str(identity) != "mean":
        raise InputError.about(
            f"identity {identity}", found="a face of the built-in head for another head",
            allowed="one of --head and --identity",
        )  # fmt: skip
    return open_head(head)


def _features(
    model: VocaModel, speech: str | Path | Waveform, channel: int | None,
    log_posteriors: NDArray[np.float32],
) -> Features:  # fmt: skip
    """What the model's own encoder hears; phones were heard already."""
    if model.record.encoder == "phones":
        return Features(log_posteriors, PHONE_RATE, "phones")
    return resolve_encoder(model.record.encoder)(_whole(speech, channel))


def identity_head(identity: str | int | Path) -> HeadModel:
    """The built-in head with somebody's face. Raises HeadError."""
    return _face(resolve_identity(str(identity)).tobytes())


@lru_cache(maxsize=4)
def _face(coefficients: bytes) -> HeadModel:
    """Making a face takes as long as hearing a second of speech."""
    return load_builtin_head().with_identity(np.frombuffer(coefficients, np.float32))


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


def _check(fps: float, strength: float) -> None:
    for name, value, (low, high) in (("fps", fps, FPS_RANGE), ("strength", strength, (0.0, 2.0))):
        if not (isinstance(value, int | float) and low <= value <= high):
            raise InputError.about(name, found=f"{value}", allowed=f"{low:g} to {high:g}")
