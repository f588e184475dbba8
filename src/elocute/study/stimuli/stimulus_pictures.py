"""The pictures of one clip: drawn from a model or stored motion, or taken from another's video."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.errors import InputError, StudyError
from elocute.files.reading import FileKind
from elocute.study.design.design import Condition, Stimuli, StimulusSound
from elocute.study.stimuli.sources import (
    CORPUS,
    clip_name,
    inside,
    motion_file,
    named_file,
    video_file,
)

if TYPE_CHECKING:
    from elocute.motion.motion import Motion

NPY_FRAMES_MAX = 6_000
SHORT_S = 0.25
"""How much shorter than its sound a video may be; its last picture is then held."""


@dataclass(frozen=True)
class PictureSource:
    """What one clip is made from."""

    condition: Condition  # what moves it
    stimuli: Stimuli  # size, rate, light and look
    sound: StimulusSound  # the sound that it moves to
    voice: Waveform  # that sound
    # Identity and camera.
    face: str
    view: str
    folder: Path  # where names begin


def clip_pictures(
    source: PictureSource, times_s: Float64Array, *, around: bool = False
) -> Iterator[NDArray[np.uint8]]:
    """The pictures of a clip.

    Parameters
    ----------
    source : PictureSource
        What it is made from.
    times_s : (frame,)
        The moment of the motion that each picture shows; beyond its ends it rests there.
    around : bool
        Begin again where the motion ends, for a sound that is longer than it.

    Yields
    ------
    (height, width, 3) uint8
        sRGB.

    Raises
    ------
    StudyError
        For files that are missing or do not fit; the errors of what reads them.
    """
    if source.condition.videos:
        yield from _video_pictures(source, times_s, around)
    else:
        yield from _drawn(source, shown_motion(source, times_s, around=around))


def source_files(source: PictureSource) -> list[Path]:
    """The files that a clip is made from beside its sound. Raises StudyError.

    source: what it is made from.
    """
    condition, files = source.condition, []
    if condition.videos:
        files.append(video_file(source.folder, condition, source.sound, source.face, source.view))
    elif condition.motion:
        source_file = motion_file(source.folder, condition, source.sound, source.face)
        files.append(source_file / CORPUS if source_file.is_dir() else source_file)
    named = [_file(source, field) for field in NAMES_OR_FILES]
    return [*files, *filter(None, named)]


NAMES_OR_FILES = ("model", "style", "mesh", "mood", "life", "background", "light", "look")
"""Fields of a condition or of [stimuli] that hold a name, or a file inside the study's folder."""


def _file(source: PictureSource, field: str) -> Path | None:
    """The file that a field names, None where it holds a plain name. Raises StudyError."""
    owner, about = source.condition, f"condition {source.condition.name} `{field}`"
    if not hasattr(owner, field):
        owner, about = source.stimuli, f"[stimuli] `{field}`"
    return named_file(source.folder, getattr(owner, field), about)


def _named(source: PictureSource, field: str) -> str:
    """What a field says: a name, or a file inside the folder. Raises StudyError."""
    owner = source.condition if hasattr(source.condition, field) else source.stimuli
    return str(_file(source, field) or getattr(owner, field))


def _motion(source: PictureSource) -> Motion:
    if source.condition.model:
        return _animated(source)
    path = motion_file(source.folder, source.condition, source.sound, source.face)
    if path.is_dir():
        return _of_corpus(source, path)
    return _stored(source, path) if path.suffix.lower() == ".npz" else _of_vertices(source, path)


def _animated(source: PictureSource) -> Motion:
    from elocute.animation import animate

    condition = source.condition
    named: dict[str, Any] = {"style": _named(source, "style")} if condition.style else {}
    animation = animate(
        source.voice,
        fps=source.stimuli.fps,
        identity=source.face,
        model=_named(source, "model"),
        strength=condition.strength,
        contacts=condition.contacts,
        life=_named(source, "life"),
        mood=_named(source, "mood"),
        look=_named(source, "look"),
        **named,
    )
    return animation.motion


def _stored(source: PictureSource, path: Path) -> Motion:
    """A motion on the stimulus's face and in its look, where it is one of the built-in head.

    A file that is named by a face that the head does not know, SOUND.IDENTITY.npz, has it.
    """
    from elocute.head.identity import identity_names
    from elocute.motion.store import load_motion

    motion, face = load_motion(path), source.face
    own = path.stem.endswith(f".{face}") and face not in identity_names() and not face.isdigit()
    return motion if own else _on_face(source, motion)


def _on_face(source: PictureSource, motion: Motion) -> Motion:
    from elocute.head.builtin import load_builtin_head
    from elocute.head.identity import resolve_identity
    from elocute.head.looks.people import identity_look
    from elocute.motion.edits.identity import with_identity

    builtin = load_builtin_head()
    if motion.head.vertex_count != builtin.vertex_count or motion.head.character is not None:
        return motion
    if source.face != "mean" or not np.array_equal(motion.head.template, builtin.template):
        motion = with_identity(motion, resolve_identity(source.face), space=builtin)
    look = identity_look(source.stimuli.look, source.face)
    return replace(motion, head=replace(motion.head, look=look))


def _of_corpus(source: PictureSource, folder: Path) -> Motion:
    """A recorded clip: its displacements on the stimulus's face."""
    from elocute.corpus.corpus_store import open_corpus
    from elocute.evaluation.model_predictions import recorded_motion
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.motion import Motion

    corpus = open_corpus(folder)
    name = clip_name(source.condition, source.sound)
    subject = corpus.entry(name).subject
    track, head = recorded_motion(corpus, name), load_builtin_head()
    if track.vertex_count != head.vertex_count:
        raise StudyError.about(
            folder,
            found=f"{track.vertex_count} vertices",
            allowed=f"{head.vertex_count}, those of the built-in head",
            remedy="write its clips as .npy, and give their mesh",
        )
    values = np.asarray(track.values[:], np.float32)
    if track.basis is None:
        return _on_face(
            source, _motion_of_displacements(head, values - corpus.template(subject), track.fps)
        )
    names = tuple(f"component{place:03d}" for place in range(len(track.basis)))
    basis = np.ascontiguousarray(track.basis, np.float32)
    moved = replace(head, expression_names=names, expression_basis=basis)
    return _on_face(source, Motion(moved, values, track.fps))


def _motion_of_displacements(head: Any, moves: NDArray[np.float32], fps: float) -> Motion:
    """Each frame a shape of its own, so that what is between them is linear."""
    from elocute.motion.motion import Motion

    names = tuple(f"frame{place:05d}" for place in range(len(moves)))
    moved = replace(
        head,
        expression_names=names,
        expression_basis=np.ascontiguousarray(moves, np.float32),
    )
    return Motion(moved, np.eye(len(moves), dtype=np.float32), fps)


def _of_vertices(source: PictureSource, path: Path) -> Motion:
    """(frame, vertex, 3) in metres, of the built-in head or of the condition's mesh."""
    from elocute.files.array_reading import read_npy
    from elocute.head.builtin import load_builtin_head
    from elocute.head.mesh import head_from_mesh

    condition = source.condition
    if condition.fps is None:
        raise StudyError.about(
            f"condition {condition.name}", found="no `fps`", allowed="one, as .npy files have none"
        )
    head = load_builtin_head()
    if condition.mesh:
        mesh = inside(source.folder, condition.mesh, f"condition {condition.name} `mesh`")
        head = head_from_mesh(mesh)
    allowed = f"(frame, {head.vertex_count}, 3) of floats, metres, up to {NPY_FRAMES_MAX} frames"
    limit = NPY_FRAMES_MAX * head.vertex_count * 24 + 1_000
    values = read_npy(path, FileKind(allowed, limit, StudyError))
    fits = values.dtype.kind == "f" and values.ndim == 3 and len(values)
    if not fits or values.shape[1:] != head.template.shape or not np.isfinite(values).all():
        raise StudyError.about(path, found=f"{values.dtype} {values.shape}", allowed=allowed)
    moves = values.astype(np.float32) - head.template
    return _on_face(source, _motion_of_displacements(head, moves, condition.fps))


def shown_motion(source: PictureSource, times_s: Float64Array, *, around: bool = False) -> Motion:
    """The motion of a clip of a model or of stored motion, frame by frame as it is shown.

    Parameters
    ----------
    source : PictureSource
        What it is made from; no video.
    times_s : (frame,)
        As in `clip_pictures`.
    around : bool
        As there.

    Returns
    -------
    Motion
        At the study's frame rate.

    Raises
    ------
    StudyError
        For files that are missing or do not fit; the errors of what reads them.
    """
    from elocute.motion.motion import read_frames

    motion = _motion(source)
    if source.condition.still:
        motion = replace(motion, weights=np.zeros_like(motion.weights), rotations=None)
    times = times_s % motion.duration_s if around else times_s
    return read_frames(motion, times * motion.fps, source.stimuli.fps)


def _drawn(source: PictureSource, motion: Motion) -> Iterator[NDArray[np.uint8]]:
    from elocute.export.drawn_character import drawn
    from elocute.export.options import PictureOptions
    from elocute.export.pictures import open_pictures

    stimuli = source.stimuli
    motion = drawn(motion, stimuli.size[0] / stimuli.size[1])
    options = PictureOptions(
        size=stimuli.size,
        view=source.view,
        light=_named(source, "light"),
        background=_named(source, "background"),
    )
    with open_pictures(motion.head, stimuli.size, options) as renderer:
        for picture in renderer.frames(motion.faces()):
            yield picture[..., :3]


def _video_pictures(
    source: PictureSource, times_s: Float64Array, around: bool
) -> Iterator[NDArray[np.uint8]]:
    """Another's video at these moments: the last picture that began by then."""
    from elocute.capture.video.video_frames import Video

    path = video_file(source.folder, source.condition, source.sound, source.face, source.view)
    try:
        with Video(path) as video:
            shown = [(at, fitted(picture, source.stimuli)) for at, picture in _limited(video, path)]
            rate = video.rate or 25.0
    except StudyError:
        raise
    except InputError as error:
        raise StudyError(str(error)) from None
    if not shown:
        raise StudyError.about(path, found="no picture", allowed="a video")
    begins = np.array([at for at, _ in shown])
    begins -= begins[0]
    length = float(begins[-1]) + 1 / rate
    if not around and length < min(source.voice.duration_s, float(times_s.max())) - SHORT_S:
        raise StudyError.about(
            path,
            found=f"{length:.2f} s of pictures",
            allowed=f"{source.voice.duration_s:.2f} s, as its sound has",
        )
    times = np.zeros_like(times_s) if source.condition.still else times_s
    times = times % length if around else times
    # Half a picture's time forgives times that were rounded.
    places = np.searchsorted(begins, times + 0.5 / max(rate, source.stimuli.fps), "right") - 1
    for place in np.clip(places, 0, len(shown) - 1):
        yield shown[place][1]


def _limited(video: Any, path: Path) -> Iterator[tuple[float, NDArray[np.uint8]]]:
    for count, shown in enumerate(video.pictures()):
        if count >= NPY_FRAMES_MAX:
            raise StudyError.about(
                path, found="a long video", allowed=f"up to {NPY_FRAMES_MAX} pictures"
            )
        yield shown


def fitted(picture: NDArray[np.uint8], stimuli: Stimuli) -> NDArray[np.uint8]:
    """A picture in the study's size: whole, on the study's ground where its shape differs.

    Parameters
    ----------
    picture : (height, width, 3) uint8
        Of any size.
    stimuli : Stimuli
        The size and the ground.

    Returns
    -------
    (high, wide, 3) uint8
        Of the study's size.
    """
    from PIL import Image, ImageColor

    wide, high = stimuli.size
    share = min(wide / picture.shape[1], high / picture.shape[0])
    size = (max(1, round(picture.shape[1] * share)), max(1, round(picture.shape[0] * share)))
    resized = Image.fromarray(picture).resize(size, Image.Resampling.LANCZOS)
    if size == (wide, high):
        return np.asarray(resized)
    try:
        ground = ImageColor.getrgb(stimuli.background)[:3]
    except ValueError:
        ground = (138, 143, 152)
    whole = Image.new("RGB", (wide, high), ground)
    whole.paste(resized, ((wide - size[0]) // 2, (high - size[1]) // 2))
    return np.asarray(whole)
