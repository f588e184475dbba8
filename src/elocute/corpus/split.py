"""Split: which clips are for training, validation and test; and what leaks between them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from elocute.errors import CorpusError
from elocute.one_line_repr import one_line


@dataclass(frozen=True)
class ClipEntry:
    """A clip as the manifest lists it; its frames are start … start + frames of the motion."""

    name: str
    subject: str
    sentence: str
    text: str
    start: int
    frames: int


@dataclass(frozen=True)
class Split:
    """Names of clips."""

    train: tuple[str, ...]
    validation: tuple[str, ...]
    test: tuple[str, ...]

    __repr__ = one_line

    def parts(self) -> dict[str, tuple[str, ...]]:
        return {"train": self.train, "validation": self.validation, "test": self.test}


def split_by_subject(
    entries: Sequence[ClipEntry], validation: Iterable[str], test: Iterable[str]
) -> Split:
    """Whole subjects apart, and no sentence in two parts (VOCA 2019, section 5).

    All sentences of the other subjects are for training. Of the subjects named for validation and
    test, only sentences that nobody of another part speaks are kept. Raises CorpusError for a
    subject that is not there or named twice, or for a part left empty.
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
    heard: dict[str, set[str]] = {}
    for entry in entries:
        heard.setdefault(entry.sentence, set()).add(part_of[entry.subject])
    parts: dict[str, list[str]] = {"train": [], "validation": [], "test": []}
    for entry in entries:
        part = part_of[entry.subject]
        if part == "train" or heard[entry.sentence] == {part}:
            parts[part].append(entry.name)
    for part, names in parts.items():
        wanted = {"train": True, "validation": validation, "test": test}[part]
        if wanted and not names:
            raise CorpusError.about(
                "split",
                found=f"no clip left for {part}",
                allowed="subjects that speak sentences of their own",
            )
    return Split(*(tuple(parts[name]) for name in ("train", "validation", "test")))


def find_leaks(entries: Sequence[ClipEntry], split: Split) -> list[str]:
    """What two parts share, a line each: subjects, sentences, or one text under two names."""
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
