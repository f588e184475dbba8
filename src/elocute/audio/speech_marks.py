"""Times of phones, visemes and words as speech engines and aligners give them, in JSON.

One value, or one on each line. Keys are compared without case and underscores, since every language
of an SDK spells them in its own way.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from statistics import median
from typing import Any

from elocute.audio.timed_labels import LABELS_MAX, Label, Labels, seconds_of, until_next
from elocute.errors import InputError
from elocute.files.json_records import parse_json

TICK_S, MILLISECOND_S = 1e-7, 1e-3
TICKS_LEAST = 5000.0
"""A word of Azure lasts longer in ticks, and shorter in milliseconds."""
ALLOWED = (
    "visemes of Azure or Polly, or phones and words of MFA, Whisper, Gentle, ElevenLabs, Azure or "
    "Elocute"
)
Record = Mapping[str, Any]


def parse_json_times(text: str) -> Labels:
    """Labels of a JSON text, whoever wrote it. Raises InputError."""
    value = _value(text)
    if isinstance(value, list):
        return _from_events([_plain(each) for each in value])
    record = _plain(value)
    for key, parse in PARSERS.items():
        if key in record:
            return parse(record)
    return _from_events([record])


def _value(text: str) -> Any:
    """The one value of a text, or the list of those on its lines."""
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) > LABELS_MAX:
        raise InputError(f"{len(lines)} lines; allowed: up to {LABELS_MAX}")
    if len(lines) > 1 and lines[0].rstrip().endswith("}") and lines[1].lstrip().startswith("{"):
        return [
            parse_json(line, f"line {number}", allowed=ALLOWED)
            for number, line in enumerate(lines, 1)
        ]
    return parse_json(text, "JSON", allowed=ALLOWED)


def _plain(value: Any) -> Record:
    """A record with plain keys. Raises InputError for anything else."""
    if not isinstance(value, dict):
        raise InputError(f"JSON of a {type(value).__name__}; allowed: {ALLOWED}")
    return {str(key).lower().replace("_", ""): inner for key, inner in value.items()}


def _from_events(events: Sequence[Record]) -> Labels:
    """Events, each a record of its own."""
    if not events or len(events) > LABELS_MAX:
        raise InputError(f"{len(events)} events; allowed: 1 to {LABELS_MAX}")
    if any("visemeid" in event for event in events):
        return _azure_visemes(events)
    if all("time" in event and "type" in event for event in events):
        return _polly(events)
    if all("audiooffset" in event and ("text" in event or "word" in event) for event in events):
        return _azure_words(events)
    if all("start" in event and "end" in event for event in events):
        return Labels(words=[_word(event) for event in events])
    shown = ", ".join(list(events[0])[:6])
    raise InputError(f"records of {shown[:60]}; allowed: {ALLOWED}")


def _azure_visemes(events: Sequence[Record]) -> Labels:
    """Azure: the ids of visemes at offsets in ticks of 100 ns.

    Blend shapes come as further events of id 0 at offset 0, after the visemes: these are no rests.
    """
    found = []
    for event in events:
        if "visemeid" not in event:
            continue
        key = next((key for key in ("audiooffset", "offset", "audiooffsetms") if key in event), "")
        unit = MILLISECOND_S if key.endswith("ms") else TICK_S
        start = seconds_of(event.get(key), "offset of a viseme", unit)
        viseme = event["visemeid"]
        if found and start == 0 and viseme in (0, "0"):
            continue
        found.append((start, str(viseme)))
    return Labels(phones=until_next(found), alphabet="azure")


def _polly(events: Sequence[Record]) -> Labels:
    """Amazon Polly's speech marks: visemes and words at times in ms."""
    kinds: dict[str, list[tuple[float, str]]] = {"viseme": [], "word": []}
    for event in events:
        if event["type"] in kinds:
            start = seconds_of(event["time"], "time of a speech mark", MILLISECOND_S)
            kinds[event["type"]].append((start, _text(event.get("value"))))
    words = until_next(kinds["word"])
    return Labels(phones=until_next(kinds["viseme"]), words=words, alphabet="polly")


def _azure_words(events: Sequence[Record]) -> Labels:
    """Azure's word boundaries: in ticks from the SDK, in ms from batch synthesis."""
    lengths = [seconds_of(event.get("duration", 0), "duration of a word") for event in events]
    unit = TICK_S if median(lengths) > TICKS_LEAST else MILLISECOND_S
    words = []
    for event, length in zip(events, lengths, strict=True):
        start = seconds_of(event["audiooffset"], "offset of a word", unit)
        words.append((start, start + length * unit, _text(event.get("text", event.get("word")))))
    return Labels(words=words)


def _azure_assessment(record: Record) -> Labels:
    """Azure's recognition and pronunciation assessment: NBest, Words, Phonemes, in ticks."""
    best = _records(record["nbest"])
    found = Labels()
    for word in _records(best[0].get("words", []) if best else []):
        found.words.append(_ticks(word, "word"))
        found.phones.extend(_ticks(each, "phoneme") for each in _records(word.get("phonemes", [])))
    return found


def _ticks(record: Record, name: str) -> Label:
    start = seconds_of(record.get("offset"), f"offset of a {name}", TICK_S)
    length = seconds_of(record.get("duration"), f"duration of a {name}", TICK_S)
    return start, start + length, _text(record.get(name))


def _mfa(record: Record) -> Labels:
    """MFA's JSON: tiers of entries [begin, end, label]."""
    tiers = record["tiers"]
    if not isinstance(tiers, dict):
        raise InputError(f"tiers of a {type(tiers).__name__}; allowed: {ALLOWED}")
    found = Labels()
    for kind, labels in (("phone", found.phones), ("word", found.words)):
        named = [name for name in tiers if kind in str(name).lower()]
        if len(named) > 1:
            raise InputError.about("tiers", found=", ".join(named[:5]), allowed="one speaker's")
        for name in named:
            tier = _plain(tiers[name])
            for entry in _list(tier.get("entries")):
                labels.append(_entry(entry))
    return found


def _entry(entry: Any) -> Label:
    if isinstance(entry, dict):
        return _word(_plain(entry))
    if not isinstance(entry, list) or len(entry) != 3:
        raise InputError(f"entry {str(entry)[:40]}; allowed: [begin, end, label]")
    return seconds_of(entry[0], "begin"), seconds_of(entry[1], "end"), _text(entry[2])


def _segments(record: Record) -> Labels:
    """Whisper and WhisperX: words within segments."""
    words = [
        _word(word)
        for segment in _records(record["segments"])
        for word in _records(segment.get("words", []))
        if "start" in word
    ]
    if not words:
        raise InputError(
            "segments without words; allowed: word timestamps; make them with the words"
        )
    return Labels(words=words)


def _words(record: Record) -> Labels:
    """Elocute, Whisper and Gentle: a list of words; Gentle's with phones and their durations."""
    found = Labels()
    for word in _records(record["words"]):
        start = word.get("starts", word.get("start"))
        if start is None:  # Gentle did not find it
            continue
        found.words.append(_word(word))
        at = seconds_of(start, "start of a word")
        for phone in _records(word.get("phones", [])):
            length = seconds_of(phone.get("duration"), "duration of a phone")
            if "start" in phone:
                at = seconds_of(phone["start"], "start of a phone")
            found.phones.append((at, at + length, _text(phone.get("phone"))))
            at += length
    return found


def _phones(record: Record) -> Labels:
    """Elocute: a list of phones, where words are not known."""
    return Labels(phones=[_phone(each) for each in _records(record["phones"])])


def _phone(record: Record) -> Label:
    start = seconds_of(record.get("start"), "start of a phone")
    return start, seconds_of(record.get("end"), "end of a phone"), _text(record.get("phone"))


def _characters(record: Record) -> Labels:
    """ElevenLabs: letters with start and end; spaces part words."""
    inner = _plain(record["alignment"]) if "alignment" in record else record
    letters = [_text(each) for each in _list(inner.get("characters"))]
    starts = _list(inner.get("characterstarttimesseconds"))
    ends = _list(inner.get("characterendtimesseconds"))
    if not len(letters) == len(starts) == len(ends):
        raise InputError(
            f"{len(letters)} letters, {len(starts)} starts and {len(ends)} ends; allowed: as many"
        )
    words: list[Label] = []
    word, begin, end = "", 0.0, 0.0
    for letter, start_s, end_s in zip([*letters, " "], [*starts, 0], [*ends, 0], strict=True):
        if not letter.strip():
            if word:
                words.append((begin, end, word))
            word = ""
            continue
        begin = begin if word else seconds_of(start_s, "start of a letter")
        word, end = word + letter, seconds_of(end_s, "end of a letter")
    return Labels(words=words)


def _word(record: Record) -> Label:
    start = seconds_of(record.get("starts", record.get("start")), "start of a word")
    end = seconds_of(record.get("ends", record.get("end")), "end of a word")
    named = next((key for key in ("word", "text", "label", "value") if key in record), "")
    return start, end, _text(record.get(named))


def _list(value: Any) -> list[Any]:
    if not isinstance(value, list) or len(value) > LABELS_MAX:
        found = f"{len(value)} entries" if isinstance(value, list) else type(value).__name__
        raise InputError(f"{found}; allowed: a list of up to {LABELS_MAX}")
    return value


def _records(value: Any) -> list[Record]:
    return [_plain(each) for each in _list(value)]


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(f"label {str(value)[:40]}; allowed: text")
    return value.strip()


PARSERS: dict[str, Callable[[Record], Labels]] = {
    "tiers": _mfa,
    "nbest": _azure_assessment,
    "segments": _segments,
    "words": _words,
    "phones": _phones,
    "alignment": _characters,
    "characters": _characters,
}
"""Records of one value, by the key that only they have."""
