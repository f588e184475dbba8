"""Speech to motion in one call.

The path of the data: blocks of sound → rows of features → curves → Motion.
Sound is decoded once, in blocks, so an hour of it needs bounded memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.style import Style
from elocute.audio.speech_input import SpeechInput, resolve_speech
from elocute.audio.waveform import Waveform
from elocute.errors import HeadError, InputError, OutputError
from elocute.files.reading import path_of
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.head.model import HeadModel
from elocute.head.registry import open_head
from elocute.models.feature_extraction import (
    PhoneTimes,
    Progress,
    SoundBlocks,
    blocks_of,
    extract_features,
)
from elocute.models.protocol import FrameSpan
from elocute.models.registry import DEFAULT_MODEL, open_model
from elocute.models.streaming import check_animation_settings
from elocute.models.style_mixes import checked_style
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.motion import Motion
from elocute.numerics.input_checks import check_kind
from elocute.numerics.resampling import frames_in
from elocute.one_line_repr import brief


@dataclass(frozen=True)
class Animation:
    """An animated head: the motion, the curves that drive it, and the sound that it belongs to.

    Parameters
    ----------
    motion : Motion
        Weights on the head's shapes, frame by frame.
    curves : Curves
        The named curves that the model gave.
    sound : Path or Waveform
        The sound that was animated.
    """

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
        """Write to the format that the suffix names.

        A file of that name is replaced. A side file (NAME.wav beside NAME.glb) is replaced only
        where it was made from this very sound, and a folder of meshes never, unless with
        `overwrite=True`.

        Parameters
        ----------
        path : str or Path
            The file; its suffix chooses the format: .glb, .npz, .csv, .json, .mp4, .html, …
        **options
            Options of that format.

        Returns
        -------
        Animation
            Itself, so that calls can be chained.

        Raises
        ------
        OutputError
            For an unknown suffix or option, another sound or motion, or a place that cannot be
            written.
        """
        from elocute.export.registry import write

        for name in ("motion", "sound"):
            if name in options:
                raise OutputError.about(
                    f"`{name}`",
                    found=brief(options[name]),
                    allowed="the animation's own, which is written anyway",
                    remedy="leave it out, or make an Animation with another",
                )
        write(self.motion, path, sound=self.sound, **options)
        return self


def animate(
    speech: SpeechInput,
    *,
    rate: int | None = None,
    fps: float = 60.0,
    identity: str | int | Path = "mean",
    head: str | Path = "builtin",
    style: str | Style = "plain",
    strength: float = 1.0,
    model: str | Path = DEFAULT_MODEL,
    channel: int | None = None,
    phones: PhoneTimes | None = None,
    progress: Progress | None = None,
) -> Animation:
    """Animate a head with speech.

    Parameters
    ----------
    speech : str, Path, Waveform, bytes, binary file or array
        A sound or video file, a Waveform, the bytes of such a file, an open binary file, or an
        array of samples (sample,) or (sample, channel): floats within ±1, or integers.
    rate : int, optional
        Sample rate of an array, Hz.
    fps : float
        Frames per second of the motion, 1 to 240.
    identity : str, int or Path
        A face of the built-in head: a name, a seed, or a JSON file of 50 coefficients.
    head : str or Path
        "builtin", or a head or mesh file in the topology that the model moves.
    style : str or Style
        A name, a mix ("calm:0.7,broad:0.3") or a JSON file; for "articulation" also a Style.
    strength : float
        How far the mouth moves, 0 to 2; 1 is as the model has it.
    model : str or Path
        "articulation", "voca", "crnn", or a trained model (.onnx).
    channel : int, optional
        The channel to take, from 0; all of them are averaged otherwise.
    phones : list of (float, float, str), optional
        Start in s, end in s and ARPAbet phone, where these are known; they replace the phones
        that the encoder recognises.
    progress : callable, optional
        Called with the share of the sound that is done, 0 to 1.

    Returns
    -------
    Animation
        The motion, its curves and the sound.

    Raises
    ------
    InputError
        For anything that cannot be used; AudioError for sound, HeadError for heads and identities,
        ModelError for models and styles.
    """
    check_animation_settings(fps, strength)
    check_kind("progress", progress, (Callable, type(None)), "a function or None")
    sound = resolve_speech(speech, rate, channel)
    chosen = open_model(model)
    resolved, rig = chosen.style(checked_style(style)), chosen.rig(_rig(head, identity))
    with _sound_blocks(sound, channel) as blocks:
        features, duration_s = extract_features(chosen, blocks, phones=phones, progress=progress)
    span = FrameSpan.whole(frames_in(duration_s, fps), fps)
    curves = chosen.curves(features, resolved, span, strength)
    motion = motion_from_curves(rig, curves)
    return Animation(motion, curves, sound)


def _rig(head: str | Path, identity: str | int | Path) -> HeadModel:
    """The head to animate. Raises HeadError."""
    check_kind("head", head, str | os.PathLike, "builtin, or a path", HeadError)
    if not isinstance(head, str):
        head = path_of(head, HeadError)
    if str(head) == "builtin":
        return identity_head(identity)
    if str(identity) != "mean":
        raise InputError.about(
            f"identity {identity}",
            found="an identity of the built-in head for another head",
            allowed="one of `head` and `identity`",
        )
    return open_head(head)


def identity_head(identity: str | int | Path) -> HeadModel:
    """The built-in head with another face.

    Parameters
    ----------
    identity : str, int or Path
        A name, a seed, or a JSON file of 50 coefficients.

    Returns
    -------
    HeadModel

    Raises
    ------
    HeadError
        For an unknown name or a file that holds no coefficients.
    """
    if isinstance(identity, os.PathLike):
        identity = path_of(identity, HeadError)
    choice = brief(identity) if isinstance(identity, int) else str(identity)
    return _face(resolve_identity(choice).tobytes())


@lru_cache(maxsize=4)
def _face(coefficients: bytes) -> HeadModel:
    """Making a face takes as long as encoding a second of speech."""
    return load_builtin_head().with_identity(np.frombuffer(coefficients, np.float32))


@contextmanager
def _sound_blocks(sound: Path | Waveform, channel: int | None) -> Iterator[SoundBlocks]:
    """Blocks of sound, each with the share of the whole it completes."""
    if isinstance(sound, Waveform):
        yield blocks_of(sound)
        return
    from elocute.audio.read import open_audio

    with open_audio(sound, channel=channel) as stream:
        promised = (stream.duration_s or math.inf) * stream.sample_rate
        yield SoundBlocks(stream.sample_rate, _with_progress(stream.blocks(), promised))


def _with_progress(
    blocks: Iterator[NDArray[np.float32]], promised: float
) -> Iterator[tuple[NDArray[np.float32], float]]:
    done = 0
    for block in blocks:
        done += len(block)
        yield block, min(1.0, done / promised)
