"""Reads times of phones or words from a file of any program.

Known are TextGrid (Praat, MFA, WebMAUS, SPPAS), ELAN's .eaf, tables and lines (CTM, CSV, MBROLA,
labels, mouth cues), captions (.srt, .vtt, .ass, .lrc), and JSON of speech engines, recognisers and
aligners.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

from elocute.errors import InputError
from elocute.files.reading import FileKind, decoded_text, read_bytes
from elocute.speech.phone_symbols import (
    ALPHABETS,
    PROLONGS,
    REST,
    RESTS,
    SPOKEN_NOISE,
    UNSAID,
    VISEMES,
    alphabet_of,
    is_word,
    nearest_symbols,
    phone_of,
)
from elocute.speech.text.script_text import left_out_note, speakers_of, spoken_script
from elocute.speech.times.captions import is_captions, words_of_captions
from elocute.speech.times.csv_and_ctm import has_columns, parse_csv, parse_ctm
from elocute.speech.times.engine_json import parse_json_times
from elocute.speech.times.label_lines import parse_lines, parse_xml, phones_or_words
from elocute.speech.times.labels import BYTES_MAX, Label, Labels
from elocute.speech.times.textgrid import TextGridInterval, parse_tiers
from elocute.speech.times.tier_choice import TierChoice

ALLOWED = "times of phones or words: TextGrid, CTM, CSV, captions, or JSON of a speech engine"
TIMES_FILE = FileKind(ALLOWED, BYTES_MAX)
AUTO = "auto"
OVERLAP_MAX_S = 0.05
"""Phones that overlap by no more meet in the middle."""
GAP_MAX_S = 0.02
"""A shorter gap is a matter of rounding, and belongs to the phone before."""
ROUNDING_S = 0.05
"""Seconds by which labels may begin before the sound."""
BEYOND_MAX_S = 0.25
"""Past the end of the sound, phones are cut; further than this they belong to another sound."""
UNKNOWN_SHARE = 0.5
"""An alphabet that lacks a greater share of a file's symbols is not that of the file."""
PHONE_MAX_S, PHRASE_MAX_S = 5.0, 40.0
"""Times are not in seconds where the median phone, or the median word or phrase, lasts longer."""
FASTEST = 60.0
"""More phones in a second than this mean that the times are in another unit."""
NAMED_MAX = 5
_VARIANT = re.compile(r"(?<=\w)\(\d\)$")
"""Behind a word of which a dictionary of CMU's knows several pronunciations."""


@dataclass(frozen=True)
class SpeechTimes:
    """Phones of a speech with their times, and its words; one of the two may be missing.

    Parameters
    ----------
    phones : tuple of (float, float, str)
        Start in s, end in s and ARPAbet phone, in order and without overlap; pauses are left out.
    unknown : tuple of (float, float)
        Start and end in s of stretches in which something is spoken, nobody says what.
    words : tuple of (float, float, str)
        Start in s, end in s and word, where known.
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


def read_speech_times(
    path: str | Path,
    alphabet: str = AUTO,
    stem: str = "",
    *,
    tier: str = "",
    speaker: str = "",
) -> SpeechTimes:
    """Read times of phones, or of words, from a file.

    Parameters
    ----------
    path : str or Path
        The file; what it holds says which format it has.
    alphabet : str
        How its phones are written: arpabet, ipa, x-sampa, espeak, pinyin, romaji, or as visemes
        of azure, polly, oculus, rhubarb or blair; "auto" takes the one that knows them.
    stem : str
        The recording, where a CTM file holds several: the name of its sound without suffix.
    tier : str
        The tier to take, by its name or its number from 1.
    speaker : str
        Whose tiers to take, where a file has those of several.

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
    data = read_bytes(path, TIMES_FILE)
    try:
        labels = _in_seconds(_labels(data, stem, TierChoice(tier, speaker)))
        return _phones_of(labels, alphabet) if labels.phones else _words_of(labels)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def _labels(data: bytes, stem: str, choice: TierChoice) -> Labels:
    """What a file holds, by what it begins with."""
    if data.startswith(b"ooBinaryFile"):
        raise InputError.about(
            "TextGrid",
            found="a binary one",
            allowed="text",
            remedy="save it as a text file in Praat",
        )
    text = decoded_text(data, "text", replace(TIMES_FILE, remedy="save it in UTF-8"))
    start = text.lstrip()[:1]
    if not start:
        raise InputError(f"an empty file; allowed: {ALLOWED}")
    if "ooTextFile" in text[:200]:
        tiers, _ = parse_tiers(data)
        named = [(name, _rows(rows or ())) for name, rows in tiers]  # points are no stretches
        return choice.labels(named, phones_or_words)
    if start == "<":
        return parse_xml(text, choice)
    lines = parse_lines(text)
    shows_captions = lines is None and is_captions(text)
    if lines is None and not shows_captions:
        if start in "[{":
            return parse_json_times(text, choice)
        if has_columns(text):
            return parse_csv(text, choice, phones_or_words)
    choice.check_unused()
    if shows_captions:
        return words_of_captions(text)
    return lines or phones_or_words(parse_ctm(text, stem))


def _in_seconds(labels: Labels) -> Labels:
    """Labels whose times are taken for milliseconds where they can be no seconds."""
    spans = [end - start for start, end, text in labels.phones or labels.words if text]
    if not spans or median(spans) <= (PHONE_MAX_S if labels.phones else PHRASE_MAX_S):
        return labels
    phones, words = (
        [(start / 1000, end / 1000, text) for start, end, text in kind]
        for kind in (labels.phones, labels.words)
    )
    notes = [*labels.notes, "times were taken for milliseconds"]
    return Labels(phones=phones, words=words, alphabet=labels.alphabet, notes=notes)


def _rows(rows: Iterable[TextGridInterval]) -> list[Label]:
    return [(row.start_s, row.end_s, row.text) for row in rows]


def _said(labels: Labels) -> Labels:
    """Labels whose phrases are without speakers and directions, and a note on these."""
    phrases = "\n".join(text for _, _, text in labels.words if " " in text.strip())
    if not phrases:
        return labels
    speakers, left_out, words = speakers_of(phrases), list[str](), list[Label]()
    for start, end, text in labels.words:
        said, aside = spoken_script(text, speakers) if " " in text.strip() else (text, [])
        words.append((start, end, said))
        left_out += aside
    return replace(labels, words=words, notes=[*labels.notes, *left_out_note(left_out)])


def _words_of(labels: Labels) -> SpeechTimes:
    labels = _said(labels)
    spoken = _spoken_words(labels)
    momentary = [text for start, end, text in labels.words if start == end and is_word(text)]
    if not spoken and momentary:
        raise InputError.about(
            "words", found="no length", allowed="words that end after they begin"
        )
    if not spoken:
        raise InputError(f"no phones and no words; allowed: {ALLOWED}")
    notes = list(labels.notes)
    if momentary:
        named = ", ".join(repr(each[:20]) for each in momentary[:NAMED_MAX])
        notes.append(f"words without length, {len(momentary)} ({named}), are left out")
    doubtful = dict.fromkeys(word for _, _, word in spoken if word in (*RESTS, *UNSAID))
    if doubtful:
        named = ", ".join([*map(repr, doubtful)][:NAMED_MAX])
        notes.append(f"{named}: taken for words that are said; for a sound, write [laughter]")
    return SpeechTimes(words=tuple(spoken), notes=tuple(notes))


def _spoken_words(labels: Labels) -> list[Label]:
    """The words that are said. Raises InputError for those that cannot be shown."""
    from elocute.speech.text.text_words import is_printable, shown_letters, words_of_text

    labelled = _in_order(labels.words, "word")
    spoken = [
        (start, end, _VARIANT.sub("", part))
        for start, end, label in ((a, b, shown_letters(label)) for a, b, label in labelled)
        for part in ([word.text for word in words_of_text(label)] if " " in label else [label])
        if is_word(part)
    ]
    for _, _, word in spoken:
        if not is_printable(word) or len(word) > 120:
            raise InputError.about("word", found=repr(word[:40]), allowed="printable words")
    return spoken


def _phones_of(labels: Labels, alphabet: str) -> SpeechTimes:
    symbols = list(dict.fromkeys(text for _, _, text in labels.phones))
    chosen = labels.alphabet or alphabet
    if chosen == AUTO:
        chosen, _ = alphabet_of(symbols)
    strange = [each for each in symbols if phone_of(each, chosen) is None]
    if len(strange) > UNKNOWN_SHARE * len(symbols):
        raise _all_strange(strange, chosen, guessed=chosen not in (labels.alphabet, alphabet))
    phones: list[Label] = []
    for start, end, text in _in_order(labels.phones, "phone"):
        names = phone_of(text, chosen)
        if names == PROLONGS and phones:
            phones[-1] = (phones[-1][0], end, phones[-1][2])
        elif names != PROLONGS:
            several = (names or SPOKEN_NOISE).split()
            part = (end - start) / len(several)
            phones += [
                (
                    start + place * part,
                    end if place + 1 == len(several) else start + (place + 1) * part,
                    name,
                )
                for place, name in enumerate(several)
            ]
    times = SpeechTimes(words=tuple(_spoken_words(labels)), alphabet=chosen)
    met, overlaps = _met(phones)
    spoken = tuple(each for each in met if each[2] not in (REST, SPOKEN_NOISE))
    unknown = tuple((start, end) for start, end, phone in met if phone == SPOKEN_NOISE)
    if not spoken:
        raise InputError(f"no phones among {len(met)} labels; allowed: {ALLOWED}")
    _check_rate(spoken)
    notes = [*labels.notes]
    if chosen in VISEMES and chosen not in (labels.alphabet, alphabet):
        notes.append(f"symbols were taken for visemes: {chosen}; `phone set` takes others")
    elif {*symbols} <= {"", *VISEMES["rhubarb"]} and "x-sampa" == chosen != alphabet:
        notes.append("symbols were taken for x-sampa; `phone set` rhubarb takes mouth cues")
    if overlaps:
        notes.append(f"phones that overlap, {overlaps} times, meet in the middle")
    if unknown:
        notes.append(f"unknown phones, {len(unknown)} times, are left to the encoder")
    if strange:
        named = ", ".join(repr(each[:20]) for each in strange[:NAMED_MAX])
        near = ", ".join(nearest_symbols(strange[0], chosen))
        notes.append(f"unknown in {chosen}: {named} (nearest to {strange[0][:20]!r}: {near})")
    return replace(times, phones=spoken, unknown=unknown, notes=tuple(notes))


def _all_strange(strange: list[str], alphabet: str, guessed: bool) -> InputError:
    """Why symbols cannot be read."""
    return InputError.about(
        f"symbol {strange[0][:40]!r}",
        found=f"unknown in {alphabet}" + ", the alphabet that fits best" * guessed,
        allowed="nearest are " + ", ".join(nearest_symbols(strange[0], alphabet)),
        remedy=f"{len(strange)} symbols are unknown: "
        + ", ".join(repr(each[:20]) for each in strange[:NAMED_MAX])
        if len(strange) > 1
        else "",
    )


def _in_order(labels: Iterable[Label], what: str) -> list[Label]:
    """Labels by time; those without length are left out. Raises InputError for impossible times."""
    kept = []
    for start, end, text in labels:
        if -ROUNDING_S <= start < 0:
            start = 0.0
        if not 0 <= start <= end < 1e6:
            raise InputError.about(
                f"{what} {text[:40]!r}",
                found=f"{start:g} to {end:g} s",
                allowed="0 <= start <= end",
            )
        if end > start:
            kept.append((start, end, text))
    return sorted(kept, key=lambda label: label[:2])


def _met(phones: list[Label]) -> tuple[list[Label], int]:
    """Phones without small overlaps and gaps, and how many overlapped. Raises InputError."""
    met: list[Label] = []
    overlaps = 0
    for start, end, phone in phones:
        if met:
            first, last, before = met[-1]
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
                met[-1] = (first, max(start, first), before)
            elif start - last <= GAP_MAX_S:
                met[-1] = (first, start, before)
        met.append((start, end, phone))
    return [each for each in met if each[1] > each[0]], overlaps


def _check_rate(phones: tuple[Label, ...]) -> None:
    """Raise InputError where there are more phones in a second than a mouth can make."""
    seconds = phones[-1][1] - phones[0][0]
    if len(phones) > 20 and len(phones) > FASTEST * seconds:
        raise InputError.about(
            "times",
            found=f"{len(phones)} phones in {seconds:.4g} s",
            allowed="times in the unit of their format",
        )
