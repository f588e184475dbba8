"""Times of phones or words from a file, whatever program wrote it.

Known are TextGrid (Praat, MFA, WebMAUS), CTM (Kaldi, NeMo), CSV (start_s,end_s,phone, and MFA's),
visemes of Azure and Amazon Polly, and JSON of MFA, Whisper, Gentle, ElevenLabs, Azure and Elocute.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from elocute.audio.phone_symbols import (
    ALPHABETS,
    PROLONGS,
    REST,
    SPOKEN_NOISE,
    alphabet_of,
    nearest_symbols,
    phone_of,
)
from elocute.audio.speech_marks import parse_json_times
from elocute.audio.speech_time_tables import parse_csv, parse_ctm
from elocute.audio.textgrid import parse_tiers
from elocute.audio.timed_labels import BYTES_MAX, Label, Labels
from elocute.errors import InputError
from elocute.files.reading import read_bytes

ALLOWED = "times of phones or words: TextGrid, CTM, CSV, or JSON of a speech engine"
AUTO = "auto"
OVERLAP_MAX_S = 0.05
"""Phones that overlap by no more meet in the middle."""
GAP_MAX_S = 0.02
"""A shorter gap is a matter of rounding, and belongs to the phone before."""
BEYOND_MAX_S = 0.25
"""Past the end of the sound, phones are cut; further than this they belong to another sound."""
STRANGE_SHARE = 0.2
"""Of the labels of a tier, beyond which they are taken for words."""
FASTEST = 60.0
"""Phones in a second, beyond which times are in another unit."""
PHONE_TIERS = ("phone", "segment", "mau", "sampa", "ipa", "kan")
WORD_TIERS = ("word", "ort", "token")
NAMED_MAX = 5


@dataclass(frozen=True)
class SpeechTimes:
    """Phones of a speech with their times; or, where a file has no phones, its words.

    Parameters
    ----------
    phones : tuple of (float, float, str)
        Start in s, end in s and ARPAbet phone, in order and without overlap; pauses are left out.
    unknown : tuple of (float, float)
        Start and end in s of stretches in which something is spoken, nobody says what.
    words : tuple of (float, float, str)
        Start in s, end in s and word, where there are no phones.
    alphabet : str
        How the phones were written; "" for words.
    notes : tuple of str
        What was done to them.
    """

    phones: tuple[Label, ...] = ()
    unknown: tuple[tuple[float, float], ...] = ()
    words: tuple[Label, ...] = ()
    alphabet: str = ""
    notes: tuple[str, ...] = ()

    @property
    def end_s(self) -> float:
        """When the last of them ends, s."""
        spans = [*self.phones, *self.words, *self.unknown]
        return max((span[1] for span in spans), default=0.0)

    def check(self, duration_s: float) -> list[str]:
        """Check that they fit a sound.

        Parameters
        ----------
        duration_s : float
            Of the sound.

        Returns
        -------
        list of str
            What to know: phones that are cut.

        Raises
        ------
        InputError
            For times beyond the sound.
        """
        what = "phones" if self.phones else "words"
        if self.end_s > duration_s + BEYOND_MAX_S:
            raise InputError.about(
                what,
                found=f"until {self.end_s:.2f} s, in a sound of {duration_s:.2f} s",
                allowed="times of this sound",
                remedy="give the file that belongs to it",
            )
        late = sum(span[1] > duration_s + 0.001 for span in (*self.phones, *self.words))
        return [f"{late} {what} end after the sound, and are cut"] if late > 1 else []


def read_speech_times(path: str | Path, alphabet: str = AUTO, stem: str = "") -> SpeechTimes:
    """Read times of phones, or of words, from a file.

    Parameters
    ----------
    path : str or Path
        The file; what it holds says which format it has.
    alphabet : str
        How its phones are written: arpabet, ipa, x-sampa or espeak; "auto" takes the one that knows
        them.
    stem : str
        The recording, where a CTM file holds several: the name of its sound without suffix.

    Returns
    -------
    SpeechTimes

    Raises
    ------
    InputError
        For any other file, symbols that no alphabet has, and times that cannot be.
    """
    path = Path(path)
    if alphabet not in (AUTO, *ALPHABETS):
        raise InputError.about(
            "phone set", found=repr(alphabet[:40]), allowed=", ".join((AUTO, *ALPHABETS))
        )
    data = read_bytes(path, max_bytes=BYTES_MAX, allowed=ALLOWED)
    try:
        labels = _labels(data, stem)
        return _phones_of(labels, alphabet) if labels.phones else _words_of(labels)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _labels(data: bytes, stem: str) -> Labels:
    """What a file holds, by what it begins with."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff") or b"ooTextFile" in data[:200]:
        return _tiers(data)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"byte {error.start} is not UTF-8; allowed: {ALLOWED}") from None
    start = text.lstrip()[:1]
    if not start:
        raise InputError(f"an empty file; allowed: {ALLOWED}")
    if start in "[{":
        return parse_json_times(text)
    first = next(line for line in text.splitlines() if line.strip())
    if "," in first and not first.startswith(";;"):
        return parse_csv(text)
    return _sorted_out(parse_ctm(text, stem))


def _tiers(data: bytes) -> Labels:
    """The tier of phones, else that of words, else the only one."""
    tiers, _ = parse_tiers(data)
    filled = {
        name: [(row.start_s, row.end_s, row.text) for row in rows]
        for name, rows in tiers
        if rows and any(row.text.strip() for row in rows)
    }
    for kinds, make in ((PHONE_TIERS, _of_phones), (WORD_TIERS, _of_words)):
        named = [name for name in filled if any(kind in name.lower() for kind in kinds)]
        if len(named) == 1:
            return make(filled[named[0]])
        if named:
            raise InputError.about(
                "tiers", found=", ".join(map(repr, named[:NAMED_MAX])), allowed="one speaker's"
            )
    if len(filled) == 1:
        return _sorted_out(next(iter(filled.values())))
    told = ", ".join(repr(name[:40]) for name, _ in tiers[:NAMED_MAX]) or "none"
    raise InputError.about("tiers", found=told, allowed="one called phones or words")


def _of_phones(labels: list[Label]) -> Labels:
    return Labels(phones=labels)


def _of_words(labels: list[Label]) -> Labels:
    return Labels(words=labels)


def _sorted_out(labels: list[Label]) -> Labels:
    """Labels of which nobody says whether they are phones or words."""
    _, strange = alphabet_of(text for _, _, text in labels)
    known = {text for _, _, text in labels}
    return _of_words(labels) if len(strange) > STRANGE_SHARE * len(known) else _of_phones(labels)


def _words_of(labels: Labels) -> SpeechTimes:
    words = [label for label in _in_order(labels.words, "word") if any(map(str.isalnum, label[2]))]
    spoken = [
        label for label in words if phone_of(label[2].lower(), "polly") not in (REST, SPOKEN_NOISE)
    ]
    if not spoken:
        raise InputError(f"no phones and no words; allowed: {ALLOWED}")
    for _, _, word in spoken:
        if not word.isprintable() or len(word) > 120:
            raise InputError.about("word", found=repr(word[:40]), allowed="printable words")
    return SpeechTimes(words=tuple(spoken))


def _phones_of(labels: Labels, alphabet: str) -> SpeechTimes:
    symbols = [text for _, _, text in labels.phones]
    chosen = labels.alphabet or alphabet
    strange: list[str] = []
    if chosen == AUTO:
        chosen, strange = alphabet_of(symbols)
    else:
        strange = [each for each in dict.fromkeys(symbols) if phone_of(each, chosen) is None]
    if strange:
        raise InputError.about(
            f"symbol {strange[0][:40]!r}",
            found=f"unknown in {chosen}, the alphabet that fits best"
            if not labels.alphabet and alphabet == AUTO
            else f"unknown in {chosen}",
            allowed="nearest are " + ", ".join(nearest_symbols(strange[0], chosen)),
            remedy=f"{len(strange)} symbols are unknown: "
            + ", ".join(repr(each[:20]) for each in strange[:NAMED_MAX])
            if len(strange) > 1
            else "",
        )
    phones: list[Label] = []
    for start, end, text in _in_order(labels.phones, "phone"):
        phone = phone_of(text, chosen)
        if phone == PROLONGS and phones:
            phones[-1] = (phones[-1][0], end, phones[-1][2])
        elif phone and phone != PROLONGS:
            phones.append((start, end, phone))
    times = SpeechTimes(alphabet=chosen)
    met, overlaps = _met(phones)
    spoken = tuple(each for each in met if each[2] not in (REST, SPOKEN_NOISE))
    unknown = tuple((start, end) for start, end, phone in met if phone == SPOKEN_NOISE)
    if not spoken:
        raise InputError(f"no phones among {len(met)} labels; allowed: {ALLOWED}")
    _check_rate(spoken)
    notes = []
    if overlaps:
        notes.append(f"phones that overlap, {overlaps} times, meet in the middle")
    if unknown:
        notes.append(f"unknown phones, {len(unknown)} times, are left to the encoder")
    return replace(times, phones=spoken, unknown=unknown, notes=tuple(notes))


def _in_order(labels: Iterable[Label], what: str) -> list[Label]:
    """Labels by time; those without length are left out. Raises InputError for impossible times."""
    found = []
    for start, end, text in labels:
        if not 0 <= start <= end < 1e6:
            raise InputError.about(
                f"{what} {text[:40]!r}",
                found=f"{start:g} to {end:g} s",
                allowed="0 <= start <= end",
            )
        if end > start:
            found.append((start, end, text))
    return sorted(found, key=lambda label: label[:2])


def _met(phones: list[Label]) -> tuple[list[Label], int]:
    """Phones without small overlaps and gaps, and how many overlapped. Raises InputError."""
    found: list[Label] = []
    overlaps = 0
    for start, end, phone in phones:
        if found:
            first, last, before = found[-1]
            if start < last - 1e-6:
                if last - start > OVERLAP_MAX_S:
                    raise InputError.about(
                        f"phone {phone} at {start:.3f} s",
                        found=f"in {before}, which lasts until {last:.3f} s",
                        allowed="phones one after another",
                        remedy="give the tier of one speaker",
                    )
                overlaps += 1
                start = min((start + last) / 2, end)
                found[-1] = (first, max(start, first), before)
            elif start - last <= GAP_MAX_S:
                found[-1] = (first, start, before)
        found.append((start, end, phone))
    return [each for each in found if each[1] > each[0]], overlaps


def _check_rate(phones: tuple[Label, ...]) -> None:
    """Raise InputError where there are more phones in a second than a mouth can make."""
    seconds = phones[-1][1] - phones[0][0]
    if len(phones) > 20 and len(phones) > FASTEST * seconds:
        raise InputError.about(
            "times",
            found=f"{len(phones)} phones in {seconds:.4g} s",
            allowed="times in the unit of their format",
        )
