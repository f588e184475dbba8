"""Splits of an imported corpus: as published, evenly, or as the user chooses."""

from __future__ import annotations

import re
from collections.abc import Sequence

from elocute.corpus.split import PARTS, ClipEntry, Split, split_by_subject
from elocute.errors import CorpusError

# In the order of the released code, which is the order of its model's styles.
VOCASET_TRAIN = (
    "FaceTalk_170728_03272_TA",
    "FaceTalk_170904_00128_TA",
    "FaceTalk_170725_00137_TA",
    "FaceTalk_170915_00223_TA",
    "FaceTalk_170811_03274_TA",
    "FaceTalk_170913_03279_TA",
    "FaceTalk_170904_03276_TA",
    "FaceTalk_170912_03278_TA",
)
VOCASET_VALIDATION = ("FaceTalk_170811_03275_TA", "FaceTalk_170908_03277_TA")
VOCASET_TEST = ("FaceTalk_170809_00138_TA", "FaceTalk_170731_00024_TA")
VOCASET_SUBJECTS = (*VOCASET_TRAIN, *VOCASET_VALIDATION, *VOCASET_TEST)
VOCASET_OWN_SENTENCES = frozenset(f"sentence{number}" for number in range(21, 41))
"""Of validation and test, the sentences that nobody of another part speaks (VOCA, section 5)."""

BIWI_SEEN = ("F2", "F3", "F4", "M3", "M4", "M5")
BIWI_UNSEEN = ("F1", "F5", "F6", "F7", "F8", "M1", "M2", "M6")
BIWI_PARTS = (range(1, 33), range(33, 37), range(37, 41))
"""Training, validation and test sentences (FaceFormer 2022, section 4.1, and work after it)."""


def vocaset_splits(entries: Sequence[ClipEntry], numbers: dict[str, str]) -> dict[str, Split]:
    """VOCASET's split of 8, 2 and 2 subjects (VOCA 2019, section 5) as `default`.

    Empty where other subjects are among the clips.
    """
    if not {entry.subject for entry in entries} <= set(VOCASET_SUBJECTS):
        return {}

    def part(subjects: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(
            entry.name
            for entry in entries
            if entry.subject in subjects
            and (subjects is VOCASET_TRAIN or numbers[entry.name] in VOCASET_OWN_SENTENCES)
        )

    return {"default": Split(part(VOCASET_TRAIN), part(VOCASET_VALIDATION), part(VOCASET_TEST))}


def biwi_splits(
    entries: Sequence[ClipEntry], numbers: dict[str, str], notes: list[str]
) -> dict[str, Split]:
    """BIWI-Test-A as `default` and, where its subjects are there, BIWI-Test-B as `test-b`.

    Source: FaceFormer 2022, section 4.1. `numbers` has each clip's sentence as the distribution
    names it; `notes` gets a line that says what was done. Empty where other subjects are among the
    clips or a part has no clip.
    """
    if not {entry.subject for entry in entries} <= {*BIWI_SEEN, *BIWI_UNSEEN}:
        return {}
    # The papers take the emotional half, e01 to e40; some number it 01 to 40 alone.
    emotional = any(number.startswith("e") for number in numbers.values())
    pattern = re.compile(r"e(\d+)" if emotional else r"(\d+)")
    matches = {name: pattern.fullmatch(number) for name, number in numbers.items()}
    number_of = {name: int(match[1]) for name, match in matches.items() if match}

    def part(subjects: tuple[str, ...], allowed: range) -> tuple[str, ...]:
        return tuple(
            e.name for e in entries if e.subject in subjects and number_of.get(e.name) in allowed
        )

    seen = [part(BIWI_SEEN, allowed) for allowed in BIWI_PARTS]
    if not all(seen):
        return {}
    splits = {"default": Split(*seen)}
    note = (
        f"split: BIWI's as published: {' '.join(BIWI_SEEN)} train on e01 to e32, validation "
        "e33 to e36, test e37 to e40 (Test-A)"
    )
    if unseen := part(BIWI_UNSEEN, BIWI_PARTS[2]):
        splits["test-b"] = Split(seen[0], seen[1], unseen)
        note += "; in the split test-b the other subjects are the test (Test-B)"
    notes.append(f"{note}; `split` sets another")
    return splits


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


SPLIT_CHOICES = ("published", "even", "sentences")
ALLOWED = "published, even, sentences, or subjects VALIDATION/TEST, as ann,bob/cy"


def check_split_choice(wanted: str | None) -> None:
    """Raise CorpusError for what `choose_splits` does not know, before any clip is read."""
    if wanted is None or wanted in SPLIT_CHOICES:
        return
    if wanted.count("/") != 1 or not wanted.partition("/")[2].strip(", "):
        raise CorpusError.about(f"`split` {wanted}", found="no split", allowed=ALLOWED)


def choose_splits(
    entries: Sequence[ClipEntry], numbers: dict[str, str], wanted: str | None, notes: list[str]
) -> dict[str, Split]:
    """Split an imported corpus: splits by name, `default` among them.

    `wanted` is `published`; `even`: by subjects, where their sentences allow it; `sentences`: every
    subject in all parts; `VALIDATION/TEST`: subjects, with commas between. None takes the published
    split, or an even one where none is known. `numbers` has each clip's sentence as the
    distribution names it; `notes` gets a line that says what was done. Raises CorpusError for a
    choice that the corpus does not allow.
    """
    check_split_choice(wanted)
    if wanted in (None, "published"):
        published = vocaset_splits(entries, numbers) or biwi_splits(entries, numbers, notes)
        if published:
            return published
        if wanted:
            raise CorpusError.about(
                "`split` published",
                found="other subjects, or a part without clips",
                allowed="VOCASET's twelve subjects, or BIWI's with sentences e01 to e40",
            )
    if wanted == "sentences":
        notes.append("split: by sentences; every subject may be in all parts")
        return {"default": split_by_sentence(entries)}
    if wanted in (None, "even"):
        split = even_split(entries, notes)
        notes[-1] += "; `split` sets another" if wanted is None else ""
        return {"default": split}
    return {"default": _by_names(entries, wanted or "", notes)}


def _by_names(entries: Sequence[ClipEntry], wanted: str, notes: list[str]) -> Split:
    """The split of `VALIDATION/TEST`; sentences are divided too where subjects share them."""
    validation, test = (
        [name.strip() for name in part.split(",") if name.strip()] for part in wanted.split("/")
    )
    unknown = {*validation, *test} - {entry.subject for entry in entries}
    if unknown or set(validation) & set(test):
        return split_by_subject(entries, validation, test)  # raises what is wrong
    parts = f"validation {', '.join(validation) or 'none'}, test {', '.join(test)}"
    try:
        split = split_by_subject(entries, validation, test)
        notes.append(f"split: {parts}")
        return split
    except CorpusError:
        split = split_by_subject_and_sentence(entries, set(validation), set(test))
    if not split.test or (validation and not split.validation):
        raise CorpusError.about(
            f"`split` {wanted}",
            found="no sentence left that others do not train with",
            allowed=ALLOWED,
        )
    notes.append(f"split: {parts}; sentences are divided too, clips between are unused")
    return split
