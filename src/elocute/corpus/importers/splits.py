"""Training, validation and test clips of an imported corpus: as published, even, or as chosen."""

from __future__ import annotations

import re
from collections.abc import Sequence

from elocute.corpus.importers.common import (
    even_split,
    split_by_sentence,
    split_by_subject_and_sentence,
)
from elocute.corpus.split import ClipEntry, Split, split_by_subject
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

SPLIT_CHOICES = ("published", "even", "sentences")
ALLOWED = "published, even, sentences, or subjects VALIDATION/TEST, as ann,bob/cy"


def check_split_choice(wanted: str | None) -> None:
    """Raise CorpusError for a choice of `chosen_splits` that is none."""
    if wanted is None or wanted in SPLIT_CHOICES:
        return
    if wanted.count("/") != 1 or not wanted.partition("/")[2].strip(", "):
        raise CorpusError.about(f"`split` {wanted}", found="no split", allowed=ALLOWED)


def choose_splits(
    entries: Sequence[ClipEntry], numbers: dict[str, str], wanted: str | None, notes: list[str]
) -> dict[str, Split]:
    """Splits by name, `default` among them; says in `notes` what was done.

    numbers  clip name to the sentence's name in the distribution
    wanted   None for the published split, or an even one where none is known; `published`;
             `even`: by subjects where their sentences allow it; `sentences`: subjects in all
             parts; `VALIDATION/TEST`: subjects, with commas between

    Raises CorpusError for a choice that the corpus does not allow.
    """
    check_split_choice(wanted)
    if wanted in (None, "published"):
        found = vocaset_splits(entries, numbers, notes) or biwi_splits(entries, numbers, notes)
        if found:
            return found
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
    validation, test = (
        [name.strip() for name in part.split(",") if name.strip()] for part in wanted.split("/")
    )
    strange = sorted({*validation, *test} - {entry.subject for entry in entries})
    if strange or set(validation) & set(test):
        return split_by_subject(entries, validation, test)  # which says what is wrong
    told = f"validation {', '.join(validation) or 'none'}, test {', '.join(test)}"
    try:
        split = split_by_subject(entries, validation, test)
        notes.append(f"split: {told}")
        return split
    except CorpusError:
        split = split_by_subject_and_sentence(entries, set(validation), set(test))
    if not split.test or (validation and not split.validation):
        raise CorpusError.about(
            f"`split` {wanted}",
            found="no sentence left that others do not train with",
            allowed=ALLOWED,
        )
    notes.append(f"split: {told}; sentences are divided too, clips between are unused")
    return split


def vocaset_splits(
    entries: Sequence[ClipEntry], numbers: dict[str, str], notes: list[str]
) -> dict[str, Split]:
    """The published 8/2/2 split, or {}."""
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
    """BIWI-Test-A as `default`, BIWI-Test-B as `test-b`; {} without a clip in every part."""
    if not {entry.subject for entry in entries} <= {*BIWI_SEEN, *BIWI_UNSEEN}:
        return {}
    # The papers take the emotional half, e01 to e40; some number it 01 to 40 alone.
    emotional = any(number.startswith("e") for number in numbers.values())
    pattern = re.compile(r"e(\d+)" if emotional else r"(\d+)")
    told = {name: pattern.fullmatch(number) for name, number in numbers.items()}
    number_of = {name: int(match[1]) for name, match in told.items() if match}

    def part(subjects: tuple[str, ...], allowed: range) -> tuple[str, ...]:
        return tuple(
            e.name for e in entries if e.subject in subjects and number_of.get(e.name) in allowed
        )

    seen = [part(BIWI_SEEN, allowed) for allowed in BIWI_PARTS]
    if not all(seen):
        return {}
    splits = {"default": Split(*seen)}
    said = (
        f"split: BIWI's as published: {' '.join(BIWI_SEEN)} train on e01 to e32, validation "
        "e33 to e36, test e37 to e40 (Test-A)"
    )
    if unseen := part(BIWI_UNSEEN, BIWI_PARTS[2]):
        splits["test-b"] = Split(seen[0], seen[1], unseen)
        said += "; in the split test-b the other subjects are the test (Test-B)"
    notes.append(f"{said}; `split` sets another")
    return splits
