"""The published splits of VOCASET and BIWI."""

from __future__ import annotations

import re
from collections.abc import Sequence

from elocute.corpus.split import ClipEntry, Split

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
