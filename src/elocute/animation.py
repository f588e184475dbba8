"""Speech to motion in one call.

The path of the data: blocks of sound → rows of features → curves → Motion.
Sound is decoded once, in blocks, so an hour of it needs bounded memory.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Unpack

import numpy as np
from numpy.typing import NDArray

from elocute.adoption.registry import open_speaking_head
from elocute.articulation.settings import lays_contacts, mixes_outputs
from elocute.audio.speech_input import SpeechInput, resolve_speech
from elocute.audio.waveform import Waveform
from elocute.errors import HeadError, InputError, OutputError
from elocute.files.reading import path_of
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import identity_choice, resolve_identity
from elocute.head.looks.look import Look
from elocute.head.looks.people import identity_look
from elocute.head.model import HeadModel
from elocute.head.registry import open_head
from elocute.life.face import LivingFace, rows_of_frames
from elocute.life.moods import resolve_mood
from elocute.life.people import AVERAGE, Person, person_of
from elocute.life.settings import resolve_life
from elocute.life.stream import LifeStream
from elocute.models.feature_extraction import (
    Progress,
    SoundBlocks,
    blocks_of,
    extract_features,
)
from elocute.models.protocol import FrameSpan
from elocute.models.registry import open_model
from elocute.models.streaming import strength_in_mood
from elocute.models.style_mixes import checked_style
from elocute.models.take_settings import TakeOptions, TakeSettings
from elocute.motion.curves import Curves, curves_from_motion, motion_from_curves
from elocute.motion.edits.applying import shaped
from elocute.motion.edits.edit_list import edits_of
from elocute.motion.motion import Motion
from elocute.numerics.frame_rates import frame_rate
from elocute.numerics.input_checks import check_alone, check_kind
from elocute.numerics.resampling import frames_in
from elocute.one_line_repr import brief
from elocute.settings import taking
from elocute.speech.known_speech import known_speech, transcribed_speech
from elocute.speech.text.recogniser import Transcribe, recognise
from elocute.speech.times.labels import Label, PhoneRefiner
from elocute.speech.times.read import SpeechTimes
from elocute.styles_over_time import StyleAndMood, StylesOverTime, mixed_takes


@dataclass(frozen=True)
class Animation:
    """An animated head: the motion, the curves that drive it, and the sound that it belongs to.

    Parameters
    ----------
    motion : Motion
        Weights on the head's shapes, frame by frame.
    curves : Curves
        The named curves: what the model gave, with life and mood laid over.
    sound : Path or Waveform
        The sound that was animated.
    notes : tuple of str
        What to know about it: words of its text that were not found, for example.
    words : tuple of (float, float, str)
        Start in s, end in s and word, where a text or its words are known.
    """

    motion: Motion
    curves: Curves
    sound: Path | Waveform
    notes: tuple[str, ...] = ()
    words: tuple[tuple[float, float, str], ...] = ()

    def __repr__(self) -> str:
        sound = self.sound if isinstance(self.sound, Waveform) else self.sound.name
        return (
            f"Animation({self.motion.frame_count} frames at {self.motion.fps:g} fps, "
            f"{self.motion.duration_s:.2f} s, sound {sound!r})"
        )

    def _repr_html_(self) -> str:
        """The viewer with its sound, for notebooks."""
        from elocute.export.html import viewer_frame

        return viewer_frame(self.motion, self.sound, repr(self), self.words)

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

        for name in ("motion", "sound", "words"):
            if name in options:
                raise OutputError.about(
                    f"`{name}`",
                    found=brief(options[name]),
                    allowed="the animation's own, which is written anyway",
                    remedy="leave it out, or make an Animation with another",
                )
        write(self.motion, path, sound=self.sound, words=self.words, **options)
        return self


@taking(TakeSettings)
def animate(
    speech: SpeechInput,
    *,
    rate: int | None = None,
    channel: int | None = None,
    track: int | None = None,
    partial: bool = False,
    phones: list[Label] | SpeechTimes | PhoneRefiner | None = None,
    text: str | None = None,
    transcribe: Transcribe = False,
    language: str = "auto",
    listen: bool = False,
    progress: Progress | None = None,
    **settings: Unpack[TakeOptions],
) -> Animation:
    """Animate a head with speech.

    Parameters
    ----------
    speech : str, Path, Waveform, bytes, binary file or array
        A sound or video file, a Waveform, the bytes of such a file, an open binary file, or an
        array of samples (sample,) or (sample, channel): floats within ±1, or integers.
    rate : int, optional
        Sample rate of an array, Hz.
    channel : int, optional
        The channel to take, from 0; all of them are averaged otherwise, but for channels that
        cancel each other, of which the loudest is taken.
    track : int, optional
        The audio track to take of a file with several, from 0; the first otherwise.
    partial : bool
        Whether a file that was cut off is taken as far as it goes.
    phones : list of (float, float, str), SpeechTimes or callable, optional
        Start in s, end in s and ARPAbet phone, where these are known; they replace the phones
        that the encoder recognises. Or what `elocute.speech.read_speech_times` read; times of words
        alone are aligned with the sound. Or a function that takes the encoder's log-posteriors
        (row, 40), 50 rows a second, and the duration in s, and gives better ones.
    text : str, optional
        What is said, where it is known: it is aligned with the sound, and lips close where its p, b
        and m are.
    transcribe : bool, str or Path
        Whether the words are recognised, and taken as a known text is: True, or the name or the
        folder of a Whisper model, which the extra `transcribe` listens with. Words of which it is
        unsure are left to the encoder. Nothing is fetched: the model has to be there.
    language : str
        Language of the text, as espeak-ng names it; "auto" is the one that is recognised, for a
        text English.
    listen : bool
        Whether the sound is a partner's, whom the face listens to: it looks at them, nods where
        their phrases end, and its lips rest.
    progress : callable, optional
        Called with the share of the sound that is done, 0 to 1.

    Returns
    -------
    Animation
        The motion, its curves and the sound.

    Raises
    ------
    InputError
        For anything that cannot be used; MotionError for edits; AlignmentError for a text that is
        not what is said; AudioError for sound, HeadError for heads and identities,
        ModelError for models and styles.
    """
    take = TakeSettings(**settings)
    fps = frame_rate(take.fps)
    check_kind("listen", listen, bool, "True or False")
    check_kind("progress", progress, (Callable, type(None)), "a function or None")
    alive, feeling = resolve_life(take.life), resolve_mood(take.mood)
    check_alone(phones=phones, text=text, transcribe=transcribe or None, listen=listen or None)
    known = known_speech(phones, text, language)
    sound = resolve_speech(speech, rate, channel, track=track, partial=partial, notes=known.notes)
    chosen = open_model(take.model)
    finished, outputs = lays_contacts(take.contacts), mixes_outputs(take.mix)
    resolved = chosen.style(checked_style(take.style), outputs=outputs)
    wanted = None if take.edits is None else edits_of(take.edits)
    styles = StylesOverTime(chosen, resolved, feeling, outputs, wanted)
    rig, person = _rig(take, own_shapes=not chosen.makes_contacts)
    worn = _look(take, rig)
    rig = chosen.rig(rig if rig.look == worn else _wearing(rig, worn))
    face = LivingFace(rig, alive, feeling, person.drawn(take.seed))
    if transcribe:
        listened, progress = _parted(progress, sound)
        words = recognise(sound, transcribe, language, channel, listened)
        known = transcribed_speech(words, tuple(known.notes))
    with _sound_blocks(sound, channel, known.notes) as blocks:
        listener = _Listener(face.stream(blocks.sample_rate), listen)
        features, duration_s = extract_features(
            chosen,
            listener.heard(blocks),
            contacts=finished,
            phones=known.phones,
            progress=progress,
        )
    span = FrameSpan.whole(frames_in(duration_s, fps), fps)
    rows = rows_of_frames(listener.rows(), 0, 0, span.count, fps)

    stirred: list[float] = []

    def animated(each: StyleAndMood) -> tuple[Curves, NDArray[np.float32] | None]:
        moved = strength_in_mood(take.strength, each.mood)
        mouth = chosen.curves(features, each.style, span, moved, contacts=finished)
        stirred.append(float(np.ptp(mouth.values, axis=0).max(initial=0)))
        living = replace(face, mood=each.mood)
        return living.curves(mouth, rows), living.rotations(rows)

    curves, rotations = mixed_takes(styles.shares(span.count, fps), animated)
    motion = replace(motion_from_curves(rig, curves), rotations=rotations)
    if wanted is not None:
        motion = shaped(motion, wanted)
        curves = curves_from_motion(motion).select(curves.names)
    if known.phones is not None and chosen.encoder != "phones":
        known.tell(f"{chosen.name} takes {chosen.encoder}: phones move its contacts alone")
    if max(stirred, default=0.0) < STIRRED and not listen:
        known.tell(UNHEARD)
    if rig.character is not None:
        known.notes.extend(rig.character.notes)
    return Animation(motion, curves, sound, tuple(known.notes), tuple(known.words))


RECOGNISED = 0.9
"""How much of the work on a sound it is to recognise its words."""


def _parted(
    progress: Progress | None, sound: Path | Waveform
) -> tuple[Progress | None, Progress | None]:
    """The progress of a recogniser, in seconds of the sound, and that of all that comes after."""
    if progress is None:
        return None, None
    from elocute.audio.read import probe_audio

    seconds = sound.duration_s if isinstance(sound, Waveform) else probe_audio(sound).duration_s
    return (
        lambda done: progress(RECOGNISED * min(1.0, done / (seconds or math.inf))),
        lambda share: progress(RECOGNISED + (1 - RECOGNISED) * share),
    )


UNHEARD = "no speech heard: the mouth stays as it is"
STIRRED = 0.02
"""A mouth whose curves change less rests throughout."""


class _Listener:
    """A stream of life that hears a sound as it passes; the mouth of who listens does not."""

    def __init__(self, stream: LifeStream, listening: bool) -> None:
        self._stream, self._listening = stream, listening
        self._rows: list[NDArray[np.float32]] = []

    def heard(self, sound: SoundBlocks) -> SoundBlocks:
        """The same blocks, which are heard where they are taken."""
        return SoundBlocks(sound.sample_rate, self._passing(sound.blocks))

    def _passing(
        self, blocks: Iterable[tuple[NDArray[np.float32], float]]
    ) -> Iterator[tuple[NDArray[np.float32], float]]:
        for block, share in blocks:
            self._rows.append(self._stream.push(block, self._listening))
            yield np.zeros_like(block) if self._listening else block, share

    def rows(self) -> NDArray[np.float32]:
        """(row, channel) of all that was heard; one still row where it was nothing."""
        return np.concatenate([*self._rows, self._stream.flush()])


def _rig(take: TakeSettings, *, own_shapes: bool) -> tuple[HeadModel, Person]:
    """The head to animate and who it is; for a model with shapes of its own as its file has it.

    Raises HeadError.
    """
    head = take.head
    check_kind("head", head, str | os.PathLike, "builtin, or a path", HeadError)
    if not isinstance(head, str):
        head = path_of(head, HeadError)
    choice = identity_choice(take.identity)
    if str(head) == "builtin" and take.mesh is None:
        return identity_head(take.identity), person_of(resolve_identity(choice))
    opened = open_head(head) if own_shapes else open_speaking_head(head, take.mesh)
    if own_shapes and opened.character is not None:
        raise HeadError.about(
            f"head {opened.name!r}",
            found="a model that moves shapes of its own",
            allowed="for a character: a model of the built-in head's curves",
        )
    if choice == "mean":
        return opened, AVERAGE
    if not len(opened.identity_basis):
        raise InputError.about(
            f"identity {take.identity}",
            found=f"an identity for head {opened.name!r}, which has none",
            allowed="one of `head` and `identity`",
        )
    coefficients = resolve_identity(choice, opened)
    return opened.with_identity(coefficients), person_of(coefficients)


def _look(take: TakeSettings, rig: HeadModel) -> Look | None:
    """What the built-in head wears; another head keeps its own. Raises HeadError."""
    if str(take.head) == "builtin":
        return identity_look(take.look, identity_choice(take.identity))
    if take.look in (None, "none"):
        return None
    if take.look == "auto":
        return rig.look
    raise HeadError.about(
        "look", found=f"one for head {rig.name!r}", allowed="a look of the built-in head"
    )


@lru_cache(maxsize=4)
def _wearing(rig: HeadModel, look: Look | None) -> HeadModel:
    """One head for all takes of a person: what is made of it when it is drawn is made once."""
    return replace(rig, look=look)


def identity_head(identity: str | int | Path) -> HeadModel:
    """The built-in head with another face.

    Parameters
    ----------
    identity : str, int or Path
        A name, a seed, or a JSON file of 50 to 77 coefficients.

    Returns
    -------
    HeadModel

    Raises
    ------
    HeadError
        For an unknown name or a file that holds no coefficients.
    """
    return _face(resolve_identity(identity_choice(identity)).tobytes())


@lru_cache(maxsize=4)
def _face(coefficients: bytes) -> HeadModel:
    """Making a face takes as long as encoding a second of speech."""
    return load_builtin_head().with_identity(np.frombuffer(coefficients, np.float32))


@contextmanager
def _sound_blocks(
    sound: Path | Waveform, channel: int | None, notes: list[str]
) -> Iterator[SoundBlocks]:
    """Blocks of sound, each with the share of the whole it completes; notes on it are added."""
    if isinstance(sound, Waveform):
        yield blocks_of(sound)
        return
    from elocute.audio.read import open_audio

    with open_audio(sound, channel=channel) as stream:
        promised = (stream.duration_s or math.inf) * stream.sample_rate
        yield SoundBlocks(stream.sample_rate, _with_progress(stream.blocks(), promised))
        notes += stream.notes


def _with_progress(
    blocks: Iterator[NDArray[np.float32]], promised: float
) -> Iterator[tuple[NDArray[np.float32], float]]:
    done = 0
    for block in blocks:
        done += len(block)
        yield block, min(1.0, done / promised)
