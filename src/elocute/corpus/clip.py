"""Clip: one sentence of one subject, sound and motion together."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.audio.waveform import Waveform
from elocute.errors import CorpusError
from elocute.files.array_file import ArrayFile
from elocute.one_line_repr import one_line

# Names become file names: nothing else may stand in them.
NAME_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,119}")


def check_name(name: str, what: str) -> str:
    """`name` itself; CorpusError where it could not be a file name anywhere."""
    if not NAME_PATTERN.fullmatch(name):
        raise CorpusError.about(
            f"{what} {name[:60]!r}",
            found="no plain name",
            allowed="letters, digits, _ . - up to 120, a letter or digit first",
        )
    return name


@dataclass(frozen=True, eq=False)
class Clip:
    """One recording with its motion.

    subject   who moves; one template each
    sentence  an identifier that all recordings of the same text share
    text      the words, or ""
    sound     the recording
    frames    (frame, component) weights on the corpus's basis, or (frame, vertex, 3) m in zero
              pose; frame f is at time f / fps of the corpus; in memory, or left on disk

    Raises CorpusError for unusable names or no frame at all.
    """

    subject: str
    sentence: str
    text: str
    sound: Waveform
    frames: NDArray[np.float32] | ArrayFile

    __repr__ = one_line

    def __post_init__(self) -> None:
        check_name(self.subject, "subject")
        check_name(self.sentence, "sentence")
        frames = self.frames
        if not isinstance(frames, ArrayFile):
            frames = np.ascontiguousarray(frames, np.float32)
        if frames.ndim not in (2, 3) or not len(frames):
            raise CorpusError.about(
                f"clip {self.name}",
                found=f"motion of shape {frames.shape}",
                allowed="(frames, components) or (frames, vertices, 3), one frame or more",
            )
        object.__setattr__(self, "frames", frames)

    @property
    def name(self) -> str:
        """`SUBJECT.SENTENCE`, unique in a corpus."""
        return f"{self.subject}.{self.sentence}"
