"""Writes videos as clips of a corpus, for training a decoder or fitting a style."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.capture.video.video_to_motion import VideoCapture, resample_motion
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.importers.split_choice import even_split
from elocute.errors import CaptureError
from elocute.head.builtin import load_builtin_head

FPS = 60.0
NOTE = "Captured from video by Elocute: weights of the built-in head, in zero pose."


def write_video_corpus(
    folder: str | Path,
    captures: Iterable[tuple[Path, VideoCapture]],
    *,
    subject: str,
    fps: float = FPS,
    texts: dict[str, str] | None = None,
) -> list[str]:
    """Write a corpus of one subject: each video a clip, its sentence the file's name.

    The template is the face of the first video; weights are relative to each video's own rest.

    Parameters
    ----------
    folder
        Where the corpus goes.
    captures
        Video files and what they became, one after another.
    subject
        The subject's name.
    fps
        Frames per second of the corpus.
    texts
        File name without suffix to the words said.

    Returns
    -------
    Notes for the user.

    Raises
    ------
    CaptureError
        For a video without sound: a corpus pairs sound with motion.
    CorpusError, OutputError
        As `corpus_writer`. Nothing is left behind then.
    """
    head = load_builtin_head()
    notes: list[str] = []
    done = iter(captures)
    path, captured = next(done)
    with corpus_writer(
        folder,
        {subject: captured.person.head.template},
        fps=fps,
        basis=head.expression_basis,
        components=head.expression_names,
        faces=head.quads,
        topology=head.name,
        note=NOTE,
    ) as writer:
        while True:
            writer.add(_video_clip(path, captured, subject, fps, (texts or {}).get(path.stem, "")))
            notes += [f"{path.name}: {note}" for note in captured.notes]
            following = next(done, None)
            if following is None:
                break
            path, captured = following
        writer.splits["default"] = even_split(writer.entries, notes)
    return notes


def _video_clip(path: Path, captured: VideoCapture, subject: str, fps: float, text: str) -> Clip:
    """One video as a Clip at `fps`, as long as its motion and its sound both last."""
    if not captured.track.has_sound:
        raise CaptureError.about(
            path,
            found="no sound",
            allowed="for a corpus, videos with sound",
            remedy="write -o take.npz instead, which takes motion alone",
        )
    sound = read_audio(path, sample_rate=SPEECH_RATE)
    frames = resample_motion(captured.motion, fps).weights[: max(1, round(sound.duration_s * fps))]
    sentence = re.sub(r"[^A-Za-z0-9_.-]+", "_", path.stem).strip("_.-") or "clip"
    return Clip(subject, sentence, text, sound, frames)
