"""Videos as clips of a corpus, so that they can train a decoder or give a style."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.capture.video.video_to_motion import VideoCapture, resampled
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.importers.common import even_split
from elocute.errors import CaptureError
from elocute.head.builtin import load_builtin_head

FPS = 60.0
NOTE = "Captured from video by Elocute: weights of the built-in head, in zero pose."


def write_corpus(
    folder: str | Path,
    captures: Iterable[tuple[Path, VideoCapture]],
    *,
    subject: str,
    fps: float = FPS,
    texts: dict[str, str] | None = None,
) -> list[str]:
    """Write a corpus of one subject: each video a clip, its sentence the file's name.

    The template is the face of the first video; weights are those of each video's own rest.
    texts  file name without suffix to the words said

    Returns notes for a person. Raises CaptureError for a video without sound (a corpus pairs
    sound with motion) and what `corpus_writer` raises; nothing is left behind then.
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
            writer.add(clip_of(path, captured, subject, fps, (texts or {}).get(path.stem, "")))
            notes += [f"{path.name}: {note}" for note in captured.notes]
            following = next(done, None)
            if following is None:
                break
            path, captured = following
        writer.splits["default"] = even_split(writer.entries, notes)
    return notes


def clip_of(path: Path, captured: VideoCapture, subject: str, fps: float, text: str) -> Clip:
    """One video as a Clip at `fps`, as long as its motion and its sound both last."""
    if not captured.track.has_sound:
        raise CaptureError.about(
            path,
            found="no sound",
            allowed="for a corpus, videos with sound",
            remedy="write -o take.npz instead, which takes motion alone",
        )
    sound = read_audio(path, sample_rate=SPEECH_RATE)
    frames = resampled(captured.motion, fps).weights[: max(1, round(sound.duration_s * fps))]
    sentence = re.sub(r"[^A-Za-z0-9_.-]+", "_", path.stem).strip("_.-") or "clip"
    return Clip(subject, sentence, text, sound, frames)
