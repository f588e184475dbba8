"""The split of an imported corpus as the user chooses it: published, even, or by name."""

from __future__ import annotations

from collections.abc import Sequence

from elocute.corpus.importers.even_splits import (
    even_split,
    split_by_sentence,
    split_by_subject_and_sentence,
)
from elocute.corpus.importers.published_splits import biwi_splits, vocaset_splits
from elocute.corpus.split import ClipEntry, Split, split_by_subject
from elocute.errors import CorpusError

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
        found = vocaset_splits(entries, numbers) or biwi_splits(entries, numbers, notes)
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
