"""Split: which clips are for training, validation and test, and what leaks between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from elocute.errors import CorpusError
from elocute.one_line_repr import one_line

PARTS = ("train", "validation", "test")


@dataclass(frozen=True)
class ClipEntry:
    """A clip as the manifest of a corpus lists it.

    Attributes
    ----------
    name : str
        `SUBJECT.SENTENCE`.
    subject, sentence, text : str
        As in `Clip`.
    start, frames : int
        The first of its frames in the corpus's motion, and their number.
    """

    name: str
    subject: str
    sentence: str
    text: str
    start: int
    frames: int


@dataclass(frozen=True)
class Split:
    """Names of the clips for training, validation and test."""

    train: tuple[str, ...]
    validation: tuple[str, ...]
    test: tuple[str, ...]

    __repr__ = one_line

    def parts(self) -> dict[str, tuple[str, ...]]:
        """Names of clips by part: train, validation, test."""
        return {"train": self.train, "validation": self.validation, "test": self.test}


def split_by_subject(
    entries: Sequence[ClipEntry], validation: Iterable[str], test: Iterable[str]
) -> Split:
    """Split a corpus with whole subjects apart and no sentence in two parts (VOCA 2019, section 5).

    All sentences of the other subjects are for training. Of the subjects for validation and test,
    only sentences that no subject of another part speaks are kept.

    Parameters
    ----------
    entries : sequence of ClipEntry
        Clips of the corpus.
    validation, test : iterable of str
        Subjects of these parts; all others are for training.

    Returns
    -------
    Split
        Names of the clips of each part.

    Raises
    ------
    CorpusError
        For a subject that is unknown or in both, or a part that is left empty.
    """
    validation, test = set(validation), set(test)
    known = {entry.subject for entry in entries}
    strange = sorted((validation | test) - known)
    if strange or validation & test:
        found = f"no subject {strange[0]}" if strange else f"{min(validation & test)} in two parts"
        raise CorpusError.about("split", found=found, allowed=", ".join(sorted(known)))
    part_of = {
        name: "validation" if name in validation else "test" if name in test else "train"
        for name in known
    }
    parts_with: dict[str, set[str]] = {}
    for entry in entries:
        parts_with.setdefault(entry.sentence, set()).add(part_of[entry.subject])
    parts: dict[str, list[str]] = {part: [] for part in PARTS}
    for entry in entries:
        part = part_of[entry.subject]
        if part == "train" or parts_with[entry.sentence] == {part}:
            parts[part].append(entry.name)
    for part, names in parts.items():
        wanted = {"train": True, "validation": validation, "test": test}[part]
        if wanted and not names:
            raise CorpusError.about(
                "split",
                found=f"no clip left for {part}",
                allowed="subjects that speak sentences of their own",
            )
    return Split(*(tuple(parts[name]) for name in PARTS))


def find_leaks(entries: Sequence[ClipEntry], split: Split) -> list[str]:
    """What the parts of a split share, a line each: subjects, sentences, texts under two names."""
    by_name = {entry.name: entry for entry in entries}
    where: dict[tuple[str, str], set[str]] = {}
    for part, names in split.parts().items():
        for name in names:
            entry = by_name[name]
            where.setdefault(("subject", entry.subject), set()).add(part)
            where.setdefault(("sentence", entry.sentence), set()).add(part)
            words = " ".join(entry.text.casefold().split())
            if words:
                where.setdefault(("text", words), set()).add(part)
    return [
        f"{kind} {what!r} is in {' and '.join(sorted(parts))}"
        for (kind, what), parts in sorted(where.items())
        if len(parts) > 1
    ]
