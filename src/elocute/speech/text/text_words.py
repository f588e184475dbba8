"""Splits a text into words by Unicode's rules (UAX #29), each with its spoken phones."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from regex import Pattern

_JOINERS = re.compile("[\u200c\u200d]")
"""Letters that show how others are joined, in Persian and Hindi: parts of words."""
_UNSHOWN = re.compile("[\u00ad\u061c\u200b\u200e\u200f\u202a-\u202e\u2060\u2066-\u2069\ufeff]")
"""Hyphens of line ends and marks of direction."""
_SAID_SIGNS = frozenset("%‰&@#§°")


@dataclass(frozen=True)
class TextWord:
    """A word and its place, `text[start:end]`, without the marks round it.

    `is_sign` says that it is a sign alone, as & or +, which some voices say.
    """

    start: int
    end: int
    text: str
    is_sign: bool = False


def is_printable(word: str) -> bool:
    """Whether a word can be shown: it has letters that are seen, and perhaps joiners."""
    return _JOINERS.sub("", word).isprintable()


def shown_letters(text: str) -> str:
    """A text in one line, without letters that nobody sees and that are no part of words."""
    return " ".join(_UNSHOWN.sub("", text).split())


def words_of_text(text: str) -> list[TextWord]:
    """The words of a text in their order, and signs that may be spoken.

    A sign that touches a word belongs to it: $9.99, 50%; but < and > stand around words, too.
    """
    cuts = sorted({0, *(match.start() for match in _boundary().finditer(text)), len(text)})
    words: list[TextWord] = []
    for start, end in pairwise(cuts):
        part = text[start:end]
        if any(map(str.isalnum, part)):
            before = words[-1] if words else None
            if before and before.is_sign and before.end == start and before.text.strip("<>"):
                words.pop()
                start = before.start
            words.append(TextWord(start, end, text[start:end]))
        elif part and all(map(_is_said, part)):
            before = words[-1] if words else None
            if before and before.end == start and part.strip("<>"):
                words[-1] = replace(before, end=end, text=text[before.start : end])
            else:
                words.append(TextWord(start, end, part, is_sign=True))
    return words


def share_phones(
    text: str,
    words: Sequence[TextWord],
    places: Sequence[int],
    lengths: Sequence[int],
) -> list[tuple[TextWord, range]]:
    """Give every word of a text the numbers of its phones, one or more.

    Engines join words ("of the") and part others ("lived" at a suffix): what lies between the
    places that they tell is shared out by how many phones each word has when it stands alone. Where
    there are fewer phones than words, words are joined; a sign that is not spoken is left out.

    Parameters
    ----------
    text, words
        The text and its words, from `words_of_text`.
    places : sequence of int
        Of each phone, the place in the text at which the engine was.
    lengths : sequence of int
        Of each word, its phones where it stands alone.
    """
    owners = _owners(words, places)
    said = set(owners)
    kept = [at for at, word in enumerate(words) if not word.is_sign or at in said]
    firsts = [at for at, word in enumerate(owners) if at == 0 or word != owners[at - 1]]
    shares: list[tuple[TextWord, range]] = []
    for number, first in enumerate(firsts):
        begin = 0 if number == 0 else owners[first]
        last = number + 1 == len(firsts)
        stop = len(words) if last else owners[firsts[number + 1]]
        group = [at for at in kept if begin <= at < stop]
        phones = range(first, len(owners) if last else firsts[number + 1])
        shares += _shared(text, [(words[at], max(lengths[at], 1)) for at in group], phones)
    return shares


def _owners(words: Sequence[TextWord], places: Sequence[int]) -> list[int]:
    """Of each phone the number of its word: the one at its place or behind it, never going back."""
    owners, at, far = [], 0, -1
    for place in places:
        far = max(far, place)
        while at + 1 < len(words) and words[at].end <= far:
            at += 1
        owners.append(at)
    return owners


def _shared(
    text: str, group: list[tuple[TextWord, int]], phones: range
) -> list[tuple[TextWord, range]]:
    """The phones of words that the engine spoke as one."""
    joined = [word for word, _ in group]
    if len(phones) < len(joined):
        first, end = joined[len(phones) - 1], joined[-1].end
        whole = TextWord(first.start, end, text[first.start : end])
        joined = [*joined[: len(phones) - 1], whole]
    weights = [weight for _, weight in group][: len(joined)]
    shares, at, done = [], 0, 0
    for number, (word, weight) in enumerate(zip(joined, weights, strict=True), 1):
        done += weight
        left = len(joined) - number
        stop = round(len(phones) * done / sum(weights)) if left else len(phones)
        stop = min(max(stop, at + 1), len(phones) - left)
        shares.append((word, phones[at:stop]))
        at = stop
    return shares


def _is_said(letter: str) -> bool:
    return letter in _SAID_SIGNS or unicodedata.category(letter) in ("Sc", "Sm")


@cache
def _boundary() -> Pattern[str]:
    import regex

    return regex.compile(r"\b", regex.V1 | regex.WORD)
