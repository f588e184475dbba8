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

# Names become file names: they hold nothing else.
NAME_PATTERN = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,119}")


def check_name(name: str, what: str) -> str:
    """Check a name that becomes part of a file name, and return it.

    Raises CorpusError, about `what` it names, where it could not be a file name on every system.
    """
    if not NAME_PATTERN.fullmatch(name):
        raise CorpusError.about(
            f"{what} {name[:60]!r}",
            found="no plain name",
            allowed="letters, digits, _ . - up to 120, a letter or digit first",
        )
    return name


@dataclass(frozen=True, eq=False)
class Clip:
    """One recording of a sentence with its motion.

    Parameters
    ----------
    subject : str
        Who moves; each subject has one template.
    sentence : str
        An identifier that all recordings of the same text share.
    text : str
        The words, or "".
    sound : Waveform
        The recording.
    frames : (frame, component) or (frame, vertex, 3) float32, or ArrayFile
        Weights of the corpus's basis, or vertices in m in zero pose; frame f is at time f / fps of
        the corpus. In memory, or left on disk.

    Raises
    ------
    CorpusError
        For unusable names, or without a frame.
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
