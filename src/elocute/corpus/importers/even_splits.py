"""Splits of a corpus without a published one: by subjects, by sentences, or by both."""

from __future__ import annotations

from collections.abc import Sequence

from elocute.corpus.split import PARTS, ClipEntry, Split, split_by_subject
from elocute.errors import CorpusError


def even_split(entries: Sequence[ClipEntry], notes: list[str]) -> Split:
    """Split a corpus so that no subject and no sentence is in two parts, where it can be.

    Validation and test have about a sixth of the subjects each. Where these have no sentences of
    their own, sentences are divided too, and clips that belong to no part are left out; fewer than
    three subjects are divided by sentences alone. `notes` gets a line that says what was done.
    """
    subjects = list(dict.fromkeys(entry.subject for entry in entries))
    if len(subjects) >= 3:
        share = max(1, len(subjects) // 6)
        test, validation = subjects[-share:], subjects[-2 * share : -share]
        try:
            split = split_by_subject(entries, validation, test)
            notes.append(f"split: even, validation {', '.join(validation)}, test {', '.join(test)}")
            return split
        except CorpusError:
            notes.append("split: even, by subjects and sentences; clips between them are unused")
            return split_by_subject_and_sentence(entries, set(validation), set(test))
    notes.append("split: by sentences only, since subjects are fewer than three")
    return split_by_sentence(entries)


def split_by_sentence(entries: Sequence[ClipEntry]) -> Split:
    """Divide the sentences 80:10:10, whoever speaks them; every subject may be in all parts."""
    part_of = _parts_of_sentences(entries, held_percent=10)
    return _split_of([(entry.name, part_of[entry.sentence]) for entry in entries])


def split_by_subject_and_sentence(
    entries: Sequence[ClipEntry], validation: set[str], test: set[str]
) -> Split:
    """Divide the subjects as given, all others for training, and the sentences 70:15:15.

    Clips whose subject and sentence belong to different parts are in none.
    """
    part_of = _parts_of_sentences(entries, held_percent=15)

    def part(entry: ClipEntry) -> str:
        who = "test" if entry.subject in test else ""
        who = who or ("validation" if entry.subject in validation else "train")
        return who if part_of[entry.sentence] == who else ""

    return _split_of([(entry.name, part(entry)) for entry in entries])


def _parts_of_sentences(entries: Sequence[ClipEntry], held_percent: int) -> dict[str, str]:
    """The part of each sentence; validation and test take the last in order of their names."""
    sentences = sorted({entry.sentence for entry in entries})
    held = len(sentences) * held_percent // 100 or int(len(sentences) > 2)
    first_test = len(sentences) - held
    first_validation = first_test - held
    return {
        sentence: PARTS[(place >= first_validation) + (place >= first_test)]
        for place, sentence in enumerate(sentences)
    }


def _split_of(pairs: Sequence[tuple[str, str]]) -> Split:
    """A Split of (clip, part), clips in the order given."""
    return Split(*(tuple(name for name, part in pairs if part == wanted) for wanted in PARTS))
