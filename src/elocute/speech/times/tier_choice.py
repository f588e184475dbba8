"""Chooses the tier of labels to read: by name, by number, or by speaker."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from elocute.errors import InputError
from elocute.speech.times.labels import Label, Labels

Tier = tuple[str, list[Label]]
TOLD_MAX = 6
# Names as MFA, WebMAUS, SPPAS, Praat's users and corpora write them, the best first; all of them
# before any that only has such a part.
PHONES = ("phones", "phone", "mau", "phonalign", "phonemes", "phoneme", "segments", "segment")
PHONES += ("phn", "sampa", "ipa", "phonetic", "visemes", "viseme")
WORDS = ("words", "word", "ort-mau", "tokensalign", "tokens", "token", "orthography", "ort")
# Parts of names of tiers that hold a whole word or syllable in one label.
OTHERS = frozenset(["kan", "kas", "mas", "trn", "tok", "syll", "syllable", "syllables"])
_PARTS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+|[^\W\d_]+")


@dataclass(frozen=True)
class TierChoice:
    """Which tier a caller wants: its name, or its number from 1; "" where any will do.

    `speaker` says whose tiers they are: the rest of their names.
    """

    tier: str = ""
    speaker: str = ""

    def check_unused(self) -> None:
        """Raise InputError where a tier or a speaker is wanted of a file that tells none."""
        for name in ("tier", "speaker"):
            if getattr(self, name):
                raise InputError.about(
                    f"`{name}`",
                    found=repr(getattr(self, name)[:40]),
                    allowed=f"none: this file tells no {name}s",
                )

    def labels(self, tiers: Sequence[Tier], sorted_out: Callable[[list[Label]], Labels]) -> Labels:
        """The labels of the tier of phones, and those of its speaker's words; else those of words,
        else those of the only tier.

        `tiers` are all tiers of intervals, in the order of the file; `sorted_out` says whether
        labels are phones or words where the name of their tier does not. Raises InputError for a
        tier that is not there, several that could be meant, and none that is known.
        """
        if self.tier:
            chosen = self._named(tiers)
            labels = _made(_kind(chosen[0]), chosen[1], sorted_out)
            return replace(labels, words=labels.words or _words_beside(chosen, tiers))
        filled = [tier for tier in tiers if any(text.strip() for _, _, text in tier[1])]
        if tiers and not filled:
            raise _fault(tiers, tiers, "one with labels", kind="all empty: ")
        if self.speaker:
            filled = self._spoken_by(filled, tiers)
        for names in (PHONES, WORDS):
            best = _best(filled, names)
            if len(best) > 1:
                remedy = "name it, or its number, with `tier`, or whose it is with `speaker`"
                raise _fault(best, tiers, "one of them", remedy)
            if best:
                labels = _made(names, best[0][1], sorted_out)
                return replace(labels, words=labels.words or _words_beside(best[0], filled))
        if len(filled) == 1:
            return sorted_out(filled[0][1])
        allowed = "one called phones or words"
        raise _fault(tiers, tiers, allowed, "name the one to read with `tier`")

    def _named(self, tiers: Sequence[Tier]) -> Tier:
        wanted = self.tier.strip()
        same = [tier for tier in tiers if tier[0].strip() == wanted]
        same = same or [tier for tier in tiers if tier[0].strip().lower() == wanted.lower()]
        if not same and wanted.isascii() and wanted.isdigit() and 0 < int(wanted[:9]) <= len(tiers):
            return tiers[int(wanted[:9]) - 1]
        if len(same) == 1:
            return same[0]
        what = f"{len(same)} tiers of the name" if same else "not there"
        allowed = f"a name or number of {_listed(tiers, tiers)}"
        raise InputError.about(f"`tier` {self.tier[:40]!r}", found=what, allowed=allowed)

    def _spoken_by(self, tiers: list[Tier], every: Sequence[Tier]) -> list[Tier]:
        wanted = self.speaker.strip().lower()
        of_speaker = [tier for tier in tiers if _speaker(tier[0]) == wanted]
        if not of_speaker:
            raise _fault(tiers, every, f"a tier of `speaker` {self.speaker[:40]!r}")
        return of_speaker


def check_one_speaker(names: Sequence[str]) -> None:
    """Raise InputError for a file of several speakers, of whom none was chosen."""
    if len(names) > 1:
        raise InputError.about(
            "speakers",
            found=", ".join(names[:5]),
            allowed="one in a file",
            remedy="name one with `speaker`",
        )


def _made(
    names: Sequence[str], labels: list[Label], sorted_out: Callable[[list[Label]], Labels]
) -> Labels:
    if not names:
        return sorted_out(labels)
    return Labels(phones=labels) if names is PHONES else Labels(words=labels)


def _words_beside(chosen: Tier, tiers: Sequence[Tier]) -> list[Label]:
    """The words of whoever says the phones of a tier; none where several tiers could be meant."""
    same = [tier for tier in tiers if _speaker(tier[0]) == _speaker(chosen[0])]
    best = _best(same, WORDS)
    return best[0][1] if len(best) == 1 and best[0] is not chosen else []


def _best(tiers: Sequence[Tier], names: Sequence[str]) -> list[Tier]:
    """The tiers whose name is the best of these, speakers' names aside."""
    ranked = [(_rank(tier[0], names), tier) for tier in tiers]
    best = min((rank for rank, _ in ranked if rank is not None), default=None)
    return [tier for rank, tier in ranked if rank is not None and rank == best]


def _kind(name: str) -> Sequence[str]:
    return next((names for names in (PHONES, WORDS) if _rank(name, names) is not None), ())


def _rank(name: str, names: Sequence[str]) -> int | None:
    """How good a tier's name is, 0 the best: one of these, one beside a speaker's, one that has it
    as a part; None for others."""
    plain = name.strip().lower()
    if plain in names:
        return names.index(plain)
    beside = [names.index(part) for part in map(str.strip, plain.split(" - ")) if part in names]
    if beside:
        return len(names) + beside[0]
    parts = _parts(name)
    others = {*OTHERS, *WORDS} if names is PHONES else {*PHONES, "phon"}
    known = parts & {*names, *(["phon"] if names is PHONES else [])} and not parts & others
    return 2 * len(names) if known else None


def _parts(name: str) -> set[str]:
    return {part.lower() for part in _PARTS.findall(name)}


def _speaker(name: str) -> str:
    """What stands beside phones or words in a name: ann of `ann - phones` and of `phones_ann`."""
    kept = [
        part
        for part in re.split(r"[\s_\-:/.]+", name.strip().lower())
        if part not in PHONES and part not in WORDS
    ]
    return " ".join(kept) if " " in name else "_".join(kept)


def _fault(
    tiers: Sequence[Tier], every: Sequence[Tier], allowed: str, remedy: str = "", kind: str = ""
) -> InputError:
    """An error that lists tiers with their numbers among all of the file."""
    found = kind + _listed(tiers, every)
    return InputError.about("tiers", found=found, allowed=allowed, remedy=remedy)


def _listed(tiers: Sequence[Tier], every: Sequence[Tier]) -> str:
    numbers = [
        number for number, tier in enumerate(every, 1) if any(tier is each for each in tiers)
    ]
    listed = ", ".join(f"{number} {every[number - 1][0][:40]!r}" for number in numbers[:TOLD_MAX])
    return (listed or "none") + (", …" if len(numbers) > TOLD_MAX else "")
