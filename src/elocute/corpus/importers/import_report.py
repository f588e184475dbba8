"""What an importer says of its work: how far it is, and which clips it left out and why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from elocute.corpus.corpus_writing import CorpusWriter
from elocute.errors import CorpusError

Progress = Callable[[float], None] | None
"""Called with the share that is done, 0 to 1."""
NAMED_MAX = 3


def count_of(number: int, what: str) -> str:
    """A number of things: `1 frame`, `2 frames`."""
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


class SkippedClips:
    """Clips left out, by reason: named one by one while they are few, counted where many."""

    def __init__(self) -> None:
        self._clips: dict[str, list[str]] = {}

    def add(self, reason: str, clip: str) -> None:
        """Note a clip that is left out for `reason`."""
        self._clips.setdefault(reason, []).append(clip)

    def notes(self) -> list[str]:
        """What was left out: `CLIP: REASON`, or `REASON: N clips (…)` where many share a reason."""
        lines = []
        for reason, clips in self._clips.items():
            if len(clips) <= NAMED_MAX:
                lines += [f"{clip}: {reason}" for clip in clips]
                continue
            first = ", ".join(clips[:NAMED_MAX])
            lines.append(
                f"{reason}: {len(clips)} clips ({first} and {len(clips) - NAMED_MAX} more)"
            )
        return lines


def require_clips(
    writer: CorpusWriter, source: Path, skipped: Sequence[str], remedy: str = ""
) -> None:
    """Raise CorpusError where nothing was written of a folder, with the first reason for it."""
    if not writer.entries:
        why = f" ({skipped[0]})" if skipped else ""
        raise CorpusError.about(source, found=f"no clip that can be used{why}", remedy=remedy)
