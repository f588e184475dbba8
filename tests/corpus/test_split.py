"""Parts share neither subjects nor sentences."""

from __future__ import annotations

import pytest

from elocute.corpus.split import ClipEntry, Split, find_leaks, split_by_subject
from elocute.errors import CorpusError


def entry(subject: str, sentence: str) -> ClipEntry:
    return ClipEntry(f"{subject}.{sentence}", subject, sentence, f"text of {sentence}", 0, 1)


ENTRIES = [
    entry("ada", "shared"),
    entry("ada", "a1"),
    entry("ben", "shared"),
    entry("ben", "b1"),
    entry("dana", "shared"),
    entry("dana", "d1"),
    entry("dana", "a1"),
]


def test_validation_and_test_keep_only_sentences_of_their_own() -> None:
    split = split_by_subject(ENTRIES, validation=["ben"], test=["dana"])
    assert split.train == ("ada.shared", "ada.a1")
    assert split.validation == ("ben.b1",)
    assert split.test == ("dana.d1",)
    assert not find_leaks(ENTRIES, split)


def test_leaks_name_what_is_shared() -> None:
    split = Split(("ada.shared",), ("ben.shared",), ("ada.a1",))
    found = find_leaks(ENTRIES, split)
    assert "subject 'ada' is in test and train" in found
    assert "sentence 'shared' is in train and validation" in found


def test_one_text_under_two_names_leaks() -> None:
    entries = [
        ClipEntry("a.1", "a", "1", "Hello there", 0, 1),
        ClipEntry("b.2", "b", "2", "hello  THERE", 0, 1),
    ]
    assert find_leaks(entries, Split(("a.1",), (), ("b.2",))) == [
        "text 'hello there' is in test and train"
    ]


@pytest.mark.parametrize(
    ("validation", "test"), [(["nobody"], []), (["ben"], ["ben"]), (["ada", "ben", "dana"], [])]
)
def test_impossible_splits_are_refused(validation: list[str], test: list[str]) -> None:
    with pytest.raises(CorpusError, match="split"):
        split_by_subject(ENTRIES, validation, test)
