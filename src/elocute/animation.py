"""Speech to motion in one call: read, listen, answer, move.

The path of the data: blocks of sound → the model's ears → rows of features → curves → Motion.
Sound is decoded once, in blocks, so an hour of it needs bounded memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.style import Style
from elocute.audio.inputs import Speech, sound_of
from elocute.audio.waveform import Waveform
from elocute.errors import HeadError, InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.head.model import HeadModel
from elocute.head.registry import open_head
from elocute.models.ears import Phones
from elocute.models.hearing import Progress, SoundBlocks, blocks_of, hear
from elocute.models.protocol import Span
from elocute.models.registry import DEFAULT, open_model
from elocute.models.streaming import FPS_RANGE, STRENGTH_RANGE, check_range
from elocute.models.styles import checked_style
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.motion import Motion
from elocute.numerics.given import check_kind
from elocute.numerics.resampling import frames_in
from elocute.one_line_repr import brief


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

        write(self.motion, path, sound=self.sound, **options)
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
    model: str | Path = DEFAULT,
    channel: int | None = None,
    phones: Phones | None = None,
    progress: Progress | None = None,
) -> Animation:
    """Animate a head with speech.

    speech    a sound or video file, or a Waveform; or the bytes of such a file, a binary file
              object, or an array of samples (see `elocute.audio.inputs`)
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
    check_range("fps", fps, FPS_RANGE)
    check_range("strength", strength, STRENGTH_RANGE)
    sound = sound_of(speech, rate, channel)
    chosen = open_model(model)
    resolved, rig = chosen.style(checked_style(style)), chosen.rig(_rig(head, identity))
    with _opened(sound, channel) as blocks:
        heard, duration_s = hear(chosen, blocks, phones=phones, progress=progress)
    span = Span.whole(frames_in(duration_s, fps), fps)
    curves = chosen.curves(heard, resolved, span, strength)
    motion = motion_from_curves(rig, curves)
    return Animation(motion, curves, sound)


def _rig(head: str | Path, identity: str | int | Path) -> HeadModel:
    """The head that moves. Raises HeadError."""
    check_kind("head", head, str | os.PathLike, "builtin, or a path", HeadError)
    if str(head) == "builtin":
        return identity_head(identity)
    if str(identity) != "mean":
        raise InputError.about(
            f"identity {identity}",
            found="a face of the built-in head for another head",
            allowed="one of head and identity",
        )
    return open_head(head)


def identity_head(identity: str | int | Path) -> HeadModel:
    """The built-in head with somebody's face. Raises HeadError."""
    choice = brief(identity) if isinstance(identity, int) else str(identity)
    return _face(resolve_identity(choice).tobytes())


@lru_cache(maxsize=4)
def _face(coefficients: bytes) -> HeadModel:
    """Making a face takes as long as hearing a second of speech."""
    return load_builtin_head().with_identity(np.frombuffer(coefficients, np.float32))


@contextmanager
def _opened(sound: Path | Waveform, channel: int | None) -> Iterator[SoundBlocks]:
    """Blocks of sound, each with the share of the whole it completes."""
    if isinstance(sound, Waveform):
        yield blocks_of(sound)
        return
    from elocute.audio.read import open_audio

    with open_audio(sound, channel=channel) as stream:
        promised = (stream.duration_s or math.inf) * stream.sample_rate
        yield SoundBlocks(stream.sample_rate, _shared(stream.blocks(), promised))


def _shared(
    blocks: Iterator[NDArray[np.float32]], promised: float
) -> Iterator[tuple[NDArray[np.float32], float]]:
    done = 0
    for block in blocks:
        done += len(block)
        yield block, min(1.0, done / promised)
