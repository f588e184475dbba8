"""WordClip: one recording of one word with the motion parameters that belong to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import PurePosixPath

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.clip import check_name
from elocute.errors import CorpusError
from elocute.motion.motion import FPS_MAX
from elocute.one_line_repr import one_line
from elocute.speech.text.text_words import is_printable

SENTENCE = "sentence"  # the word of a clip that holds several
SPLITS = ("train", "validation", "test")
FRAMES_MAX = 100_000
COMPONENTS_MAX = 400
AUDIO_MAX = 1000  # characters of a sound's name


@dataclass(frozen=True, eq=False)
class WordClip:
    """A row of a shard: one recording of one word (Tzirakis et al. 2019, section 4.2).

    Parameters
    ----------
    clip : str
        A name, unique among all shards of a folder.
    word : str
        What is said.
    speaker : str
        Who is heard.
    source : str
        The captured speaker whose motion was carried over; the speaker where it is captured.
    split : str
        "train", "validation" or "test".
    audio : str
        A sound file, relative to the folder of sounds, with / between folders.
    start_s, end_s : float
        Where in that file frame 0 is, and where the clip ends, s.
    fps : float
        Frames per second.
    parameters : (frame, component) float32
        Weights of the shards' basis; 28 components in the paper.
    confidence : float
        How well the alignment explains the pair, 0 to 1; 1 for what was captured.

    Raises
    ------
    CorpusError
        Naming the clip, for anything else.
    """

    clip: str
    word: str
    speaker: str
    source: str
    split: str
    audio: str
    start_s: float
    end_s: float
    fps: float
    parameters: NDArray[np.float32]
    confidence: float = 1.0

    __repr__ = one_line

    def __post_init__(self) -> None:
        for what in ("clip", "speaker", "source"):
            check_name(getattr(self, what), what)
        if not (self.word and is_printable(self.word) and len(self.word) <= 120):
            self._refuse(f"word {self.word[:60]!r}", "1 to 120 letters")
        if self.split not in SPLITS:
            self._refuse(f"split {self.split[:40]!r}", ", ".join(SPLITS))
        if not is_inside(self.audio):
            self._refuse(f"sound {self.audio[:80]!r}", "a path below the folder of sounds")
        if not (math.isfinite(self.end_s) and 0 <= self.start_s < self.end_s):
            self._refuse(f"times {self.start_s} to {self.end_s} s", "0 <= start < end")
        if not 0 < self.fps <= FPS_MAX:
            self._refuse(f"fps {self.fps}", f"above 0, at most {FPS_MAX:g}")
        if not 0 <= self.confidence <= 1:
            self._refuse(f"confidence {self.confidence}", "0 to 1")
        object.__setattr__(self, "parameters", self._checked())

    def _checked(self) -> NDArray[np.float32]:
        """The parameters as float32, checked."""
        values = np.ascontiguousarray(self.parameters, np.float32)
        if values.ndim != 2 or not (
            1 <= len(values) <= FRAMES_MAX and 1 <= values.shape[1] <= COMPONENTS_MAX
        ):
            self._refuse(
                f"parameters of shape {values.shape}",
                f"(frame, component), 1 to {FRAMES_MAX} frames, 1 to {COMPONENTS_MAX} components",
            )
        if not np.isfinite(values).all():
            frame = int(np.argwhere(~np.isfinite(values))[0, 0])
            self._refuse(f"NaN or infinity at frame {frame}", "finite parameters")
        return values

    def _refuse(self, found: str, allowed: str) -> None:
        """Raise CorpusError about this clip."""
        raise CorpusError.about(f"clip {self.clip[:120]}", found=found, allowed=allowed)

    def __len__(self) -> int:
        return len(self.parameters)


def is_inside(audio: str) -> bool:
    """Whether a name with / between folders stays below the folder it is looked up in, anywhere."""
    if not audio or len(audio) > AUDIO_MAX or "\\" in audio or ":" in audio:
        return False
    path = PurePosixPath(audio)
    return audio.isprintable() and not path.is_absolute() and ".." not in path.parts
