"""Reads times of phones, visemes and words from the JSON of speech engines and aligners.

One value, or one on each line. Keys are compared without case and underscores, since every language
of an SDK spells them in its own way.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from statistics import median
from typing import Any

from elocute.errors import InputError
from elocute.files.json_records import finite_number, parse_json
from elocute.speech.phone_symbols import VISEMES, visemes_of
from elocute.speech.times.json_speakers import of_one_speaker
from elocute.speech.times.labels import (
    LABELS_MAX,
    OPEN_S,
    Label,
    Labels,
    clock_seconds,
    seconds_of,
    until_next,
)
from elocute.speech.times.tier_choice import TierChoice

TICK_S, MILLISECOND_S = 1e-7, 1e-3
TICKS_LEAST = 5000.0
"""A word of Azure lasts longer in ticks, and shorter in milliseconds."""
MILLISECONDS_LEAST = 20.0
"""A word lasts longer in milliseconds, and shorter in seconds."""
DEPTH_MAX = 12
PIECES_S = 0.1
"""How far apart the pieces of a word may be."""
IDEOGRAPHS = "\u2e80"
"""The first letter of the scripts that are written without spaces."""
ALLOWED = (
    "visemes of Azure, Polly or TalkingHead, mouth cues of Rhubarb, or phones and words of "
    "aligners, speech engines and recognisers, or of Elocute"
)
STARTS = ("starttime", "start", "starts", "startts", "startoffset", "begin", "ts", "startms")
STARTS += ("offsetmilliseconds", "offsetinticks", "starttimeseconds")
"""`start_time` first: beside it, Speechify's `start` counts letters."""
ENDS = ("endtime", "end", "ends", "endts", "endoffset", "endms")
LENGTHS = ("duration", "durations", "durationms")
LENGTHS += ("durationmilliseconds", "durationinticks", "durationseconds")
PHONE_KEYS = ("phone", "phoneme", "phonesymbol", "viseme")
LABEL_KEYS = ("word", "text", "label", "value", "content", "punctuatedword")
OFFSETS = frozenset(["audiooffset", "offset"])
FIRST_ONLY = ("alternatives", "nbest", "channels", "transcripts")
NOT_SAID = frozenset(
    ["audioevent", "audio_event", "spacing", "punctuation", "punct", "silence", "pause", "noise"]
)
TAGS = re.compile(r"\[[^\[\]]{1,80}\]|<[^<>]{1,80}>")
"""Among letters that are spoken: [laughs] and <break time="1s" /> are not."""
_NEXT_VALUE = re.compile(r"(?<=\})[ \t\r]{0,20}\n\s{0,20}(?=\{)")
"""Between values of which each begins a line, as in JSON Lines and what Vosk prints."""
_OFFSET = re.compile(r"(start|end)_?offset", re.IGNORECASE)
_SECONDS = re.compile(r"(?:PT(?:(\d{1,4})H)?(?:(\d{1,6})M)?)?(\d{1,9}(?:\.\d{1,12})?)[sS]?")
"""1.25, 1.25s, or PT1M1.25S."""
Record = Mapping[str, Any]


def parse_json_times(text: str, choice: TierChoice | None = None) -> Labels:
    """Labels of a JSON text, whoever wrote it; `choice` says which tier. Raises InputError."""
    labels = _parsed(_value(text), choice or TierChoice())
    phones = [(start, end, phone.strip()) for start, end, phone in labels.phones]
    return replace(labels, phones=phones, words=_whole_words(labels.words))


def _whole_words(words: Iterable[Label]) -> list[Label]:
    """Words of the pieces that models know, of which those begin with a space that begin a word."""
    pieces = [*words]
    in_pieces = any(text.startswith(" ") for _, _, text in pieces)
    whole: list[Label] = []
    for start, end, text in pieces:
        plain = text.strip()
        begun, until, before = whole[-1] if whole else (0.0, 0.0, "")
        follows = before and not text.startswith(" ") and 0 <= start - until <= PIECES_S
        begins = plain[:1] in "([<"  # [Music] or (laughs), which no word is a part of
        if (
            in_pieces
            and follows
            and not begins
            and " " not in before + plain
            and (before[-1] < IDEOGRAPHS)
        ):
            is_said = any(map(str.isalnum, plain))
            whole[-1] = begun, end if is_said else until, before + plain
        else:
            whole.append((start, end, plain))
    return whole


def _parsed(value: Any, choice: TierChoice) -> Labels:
    record = None if isinstance(value, list) else _plain(value)
    if record is not None and "tiers" in record:
        return _mfa(record, choice)
    value = of_one_speaker(value, choice)
    if isinstance(value, list):
        return _from_list(value)
    record = _plain(value)
    for key, parse in PARSERS.items():
        if record.get(key) is not None:
            return parse(record)
    return _from_events([record], value)


def _value(text: str) -> Any:
    """The one value of a text, or the list of those that follow each other in it."""
    parts = _NEXT_VALUE.split(text)
    if len(parts) > LABELS_MAX:
        raise InputError(f"{len(parts)} values; allowed: up to {LABELS_MAX}")
    if len(parts) > 1:
        return [
            parse_json(part, f"value {number}", allowed=ALLOWED)
            for number, part in enumerate(parts, 1)
        ]
    return parse_json(text, "JSON", allowed=ALLOWED)


def _plain(value: Any) -> Record:
    """A record with plain keys. Raises InputError for anything else."""
    if not isinstance(value, dict):
        raise InputError(f"JSON of a {type(value).__name__}; allowed: {ALLOWED}")
    return {
        str(key).lower().replace("_", "").removeprefix("priv"): inner
        for key, inner in value.items()
        # In text: those of Google. In numbers: frames of NeMo and letters of Gentle, no seconds.
        if not (_OFFSET.fullmatch(str(key)) and isinstance(inner, int | float))
    }


def _from_list(values: list[Any]) -> Labels:
    """A list of events, or of the parts of a stream."""
    if values and all(_is_pair(value) for value in values):
        pairs = [(number * MILLISECOND_S, str(viseme)) for number, viseme in values]
        return Labels(phones=until_next(pairs), alphabet="azure")
    if values and all(isinstance(value, list) for value in values):
        labels = _anywhere(values)
        if labels.words:
            return labels
    events = [_plain(each) for each in values]
    if any("timestampinfo" in _inner(event) for event in events):
        return _inworld(events)
    if any("alignment" in event or "normalizedalignment" in event for event in events):
        return _letters(events)
    if any("wordtimestamps" in event or "phonemetimestamps" in event for event in events):
        return _cartesia(events)
    return _from_events(events, values)


def _is_pair(value: Any) -> bool:
    """Whether a value is a time in ms and the id of one of Azure's visemes."""
    if not isinstance(value, list) or len(value) != 2:
        return False
    at = finite_number(value[0])
    return at is not None and at >= 0 and type(value[1]) is int


def _from_events(events: Sequence[Record], values: Any) -> Labels:
    """Events, each a record of its own; `values` are the same as they stand in the file."""
    if not events or len(events) > LABELS_MAX:
        raise InputError(f"{len(events)} events; allowed: 1 to {LABELS_MAX}")
    if any("visemeid" in event for event in events):
        return _azure_visemes(events)
    if any("nbest" in event or ("word" in event and "offset" in event) for event in events):
        return _azure_assessment(events)
    if any("timestampinfo" in _inner(event) for event in events):
        return _inworld(events)
    if any("blendshapes" in event or "facsnames" in event for event in events):
        raise InputError(f"blend shapes, which are curves of a face; allowed: {ALLOWED}")
    if all("time" in event and "type" in event for event in events):
        return _polly(events)
    if _are_cues(events):
        return _mouth_cues({"mouthcues": [*events]})
    if all(OFFSETS & event.keys() and {"text", "word"} & event.keys() for event in events):
        return _azure_words(events)
    labels = _anywhere(values)
    if labels.phones or labels.words:
        is_set = all("viseme" in event for event in events)
        kind = visemes_of(text for _, _, text in labels.phones) if is_set else ""
        return replace(labels, alphabet=kind)
    shown = ", ".join(list(events[0])[:6])
    raise InputError(f"records of {shown[:60]}; allowed: {ALLOWED}")


def _are_cues(events: Sequence[Record]) -> bool:
    """Whether events are mouth cues of Rhubarb without the record around them: words are more than
    letters from A to H."""
    letters = {str(event.get("value")) for event in events}
    is_value = all(_key(event, PHONE_KEYS + LABEL_KEYS) == "value" for event in events)
    return is_value and len(letters) > 1 and letters <= VISEMES["rhubarb"].keys()


def _anywhere(value: Any, depth: int = 0) -> Labels:
    """Records of a start, an end and a label, wherever they stand; the innermost ones."""
    labels = Labels()
    if depth > DEPTH_MAX:
        return labels
    if isinstance(value, list):
        if label := _triple(value):
            labels.words.append(label)
            return labels
        parts = [_anywhere(each, depth + 1) for each in value]
    elif isinstance(value, dict):
        record = _plain(value)
        if record.get("type") in NOT_SAID:
            return labels
        parts = [_anywhere(_first(key, inner), depth + 1) for key, inner in record.items()]
        if not any(part.phones or part.words for part in parts):
            return _timed(record)
    else:
        return labels
    for part in _each_once(parts, in_record=isinstance(value, dict)):
        labels.phones.extend(part.phones)
        labels.words.extend(part.words)
        labels.notes.extend(note for note in part.notes if note not in labels.notes)
    if isinstance(value, dict) and len(_plain(value).get("channels") or ()) > 1:
        labels.notes.append("of several channels the first is taken")
    return labels


def _each_once(parts: Iterable[Labels], in_record: bool) -> Iterator[Labels]:
    """Parts without what was there before.

    A record may have the same speech as words, sentences and utterances: of those that begin at
    the same times the finest is taken. A list may end with all of its words again.
    """
    seen: dict[str, set[object]] = {"phones": set(), "words": set()}
    for part in sorted(parts, key=lambda part: -len(part.words)) if in_record else parts:
        kept = Labels(notes=part.notes)
        for kind, before in seen.items():
            labels: list[Label] = getattr(part, kind)
            marks = [round(label[0], 3) if in_record else label for label in labels]
            again = sum(mark in before for mark in marks)
            if 2 * again < len(marks) or (again < len(marks) and not in_record):
                getattr(kept, kind).extend(labels)
                before.update(marks)
        yield kept


def _triple(value: list[Any]) -> Label | None:
    """[word, start, end] or [start, end, word]; None for any other list."""
    texts = [each for each in value if isinstance(each, str)]
    numbers = [number for each in value if (number := finite_number(each)) is not None]
    if len(value) != 3 or len(texts) != 1 or len(numbers) != 2 or min(numbers) < 0:
        return None
    return numbers[0], numbers[1], texts[0].strip()


def _first(key: str, inner: Any) -> Any:
    """What is read of a value: of guesses and channels the first, of tokens none."""
    if key == "tokens":
        return None
    return inner[:1] if key in FIRST_ONLY and isinstance(inner, list) else inner


def _timed(record: Record) -> Labels:
    """The one label of a record; none where it lacks a time or a label."""
    span, offsets, notes = record.get("timestamp"), record.get("offsets"), list[str]()
    if isinstance(span, list) and len(span) == 2:  # transformers, which leave the last end open
        begin, end = finite_number(span[0]), span[1]
        if begin is not None and end is None:
            end = begin + OPEN_S * max(1, len(str(record.get("text", "")).split()))
            notes.append(f"the end of the last word is open: taken as {end - begin:g} s later")
        record = {**record, "start": span[0], "end": end}
    elif isinstance(offsets, dict):  # whisper.cpp
        record = {**record, "startms": offsets.get("from"), "endms": offsets.get("to")}
    elif isinstance(record.get("time"), dict):  # Hume
        record = {**record, **_plain(record["time"])}
    if not isinstance(record.get(_key(record, PHONE_KEYS + LABEL_KEYS)), str):
        guesses = record.get("alternatives")
        first = guesses[0] if isinstance(guesses, list) and guesses else None
        record = {**record, **(_plain(first) if isinstance(first, dict) else {})}
    label = record.get(_key(record, PHONE_KEYS + LABEL_KEYS))
    if label is None and _is_texts(record.get("lines")):  # aeneas
        label = " ".join(record["lines"])
        record = {**record, "text": label}
    until = record.get(_key(record, ENDS))
    if not _key(record, STARTS) and isinstance(until, str) and until.endswith("s"):
        record = {**record, "start": "0s"}  # which Google leaves out
    if any(record.get(_key(record, keys)) is None for keys in (STARTS, (*ENDS, *LENGTHS))):
        return Labels()
    if not isinstance(label, str):
        return Labels()
    labels = [_word(record)]
    if _key(record, PHONE_KEYS):
        return Labels(phones=labels, notes=notes)
    return Labels(words=labels, notes=notes)


def _azure_visemes(events: Sequence[Record]) -> Labels:
    """Azure: the ids of visemes at offsets in ticks of 100 ns.

    Blend shapes come as further events of id 0 at offset 0, after the visemes: these are no rests.
    """
    starts: list[tuple[float, str]] = []
    in_ms = False
    for event in events:
        if "visemeid" not in event:
            continue
        key = next((key for key in ("audiooffset", "offset", "audiooffsetms") if key in event), "")
        in_ms = in_ms or key.endswith("ms")
        start = seconds_of(event.get(key), "offset of a viseme")
        viseme = event["visemeid"]
        if starts and start == 0 and viseme in (0, "0"):
            continue
        starts.append((start, str(viseme)))
    unit, notes = MILLISECOND_S if in_ms else TICK_S, []
    steps = [b - a for (a, _), (b, _) in pairwise(starts) if b > a]
    if not in_ms and steps and median(steps) < TICKS_LEAST:  # divided already, as in its examples
        unit, name = (MILLISECOND_S, "milliseconds") if median(steps) > 2 else (1.0, "seconds")
        notes = [f"offsets were taken for {name}: too small for ticks of 100 ns"]
    visemes = [(start * unit, viseme) for start, viseme in starts]
    return Labels(phones=until_next(visemes), alphabet="azure", notes=notes)


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
    """Azure's word boundaries: in ticks from the SDK and edge-tts, in ms from batch synthesis."""
    lengths = [seconds_of(event.get("duration", 0), "duration of a word") for event in events]
    unit = TICK_S if median(lengths) > TICKS_LEAST else MILLISECOND_S
    if 0 < median(lengths) < MILLISECONDS_LEAST:
        unit = 1.0
    words = []
    for event, length in zip(events, lengths, strict=True):
        offset = event.get("audiooffset", event.get("offset"))
        start = seconds_of(offset, "offset of a word", unit)
        words.append((start, start + length * unit, _text(event.get("text", event.get("word")))))
    return Labels(words=words)


def _azure_assessment(events: Iterable[Record]) -> Labels:
    """Azure's recognition and pronunciation assessment: NBest, Words, Phonemes, in ticks; or words
    alone. Those that were not said have no time."""
    labels, missed = Labels(), 0
    for event in events:
        best = _records(event["nbest"])[:1] if "nbest" in event else [event]
        for word in (w for each in best for w in _records(each.get("words") or [event])):
            if "offset" not in word:
                missed += "word" in word
                continue
            labels.words.append(_ticks(word, "word"))
            phones = _records(word.get("phonemes") or [])
            labels.phones.extend(_ticks(each, "phoneme") for each in phones)
    if missed:
        labels.notes.append(f"{missed} words without times are left out")
    return labels


def _ticks(record: Record, name: str) -> Label:
    start, length = (
        seconds_of(record.get(f"{key}inticks", record.get(key)), f"{key} of a {name}", TICK_S)
        for key in ("offset", "duration")
    )
    return start, start + length, _text(record.get(name))


def _google_marks(record: Record) -> Labels:
    """Google: when the marks of an SSML are reached; called as the words behind them."""
    marks = _records(record["timepoints"])
    named = [
        (seconds_of(mark.get("timeseconds", 0), "time of a mark"), _text(mark.get("markname")))
        for mark in marks
    ]
    numbered = [name for _, name in named if any(map(str.isdecimal, name))]
    if len(numbered) > len(named) / 2:
        raise InputError.about(
            "marks",
            found=", ".join(numbered[:3])[:60],
            allowed="marks called as the words that follow them",
            remedy='write <mark name="hello"/>hello',
        )
    return Labels(words=until_next(named), notes=["names of marks were taken for words"])


def _inner(record: Record) -> Record:
    inner = record.get("result")
    return _plain(inner) if isinstance(inner, dict) else record


def _inworld(events: Iterable[Record]) -> Labels:
    """Inworld: words or letters as columns, and phones, of one answer or of a stream's parts."""
    infos = [_plain(_inner(event).get("timestampinfo") or {}) for event in events]
    if any(info.get("characteralignment") for info in infos):
        return _letters([{"alignment": info.get("characteralignment")} for info in infos])
    labels = Labels()
    for info in infos:
        words = _plain(info.get("wordalignment") or {"words": []})
        if words.get("words"):
            times = ("wordstarttimeseconds", "wordendtimeseconds")
            labels.words.extend(_columns(words, "words", times))
            labels.phones.extend(_anywhere(words.get("phoneticdetails")).phones)
    return labels


def _mfa(record: Record, choice: TierChoice) -> Labels:
    """MFA's JSON: tiers of entries [begin, end, label]."""
    tiers = record["tiers"]
    if isinstance(tiers, list):  # of praatIO, each with its name
        pairs = [(tier.get("name", ""), tier) for tier in _records(tiers)]
    elif isinstance(tiers, dict):
        pairs = [(name, _plain(tier)) for name, tier in tiers.items()]
    else:
        raise InputError(f"tiers of a {type(tiers).__name__}; allowed: {ALLOWED}")
    named = [
        (str(name), [_entry(each) for each in _list(tier.get("entries"))]) for name, tier in pairs
    ]
    return choice.labels(named, lambda labels: Labels(words=labels))


def _entry(entry: Any) -> Label:
    if isinstance(entry, dict):
        return _word(_plain(entry))
    if not isinstance(entry, list) or len(entry) != 3:
        raise InputError(f"entry {str(entry)[:40]}; allowed: [begin, end, label]")
    return seconds_of(entry[0], "begin"), seconds_of(entry[1], "end"), _text(entry[2])


def _segments(record: Record) -> Labels:
    """Whisper and WhisperX: words within segments."""
    words, phrases, untimed = Labels(), list[Label](), _Untimed()
    for segment in _records(record["segments"]):
        labels = untimed.between(segment)
        phrase = [] if labels else _timed(segment).words
        words.words.extend([*labels, *phrase])
        phrases += phrase
    words.notes.extend(untimed.notes())
    if phrases:
        words.notes.append("words are looked for within the times of their segments")
    if len(words.words) > len(phrases):
        return words
    for key in ("words", "wordsegments"):
        if record.get(key):
            return _words({"words": record[key]})
    if not phrases:
        raise InputError(
            "segments without words; allowed: word timestamps; make them with the words"
        )
    return words


@dataclass
class _Untimed:
    """Words without times: they share what their neighbours leave, if that is known.

    WhisperX has none for numbers, since its letters have none; Gentle for what it did not find.
    """

    placed: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    def between(self, segment: Record) -> list[Label]:
        """The words of a segment."""
        words = [each for each in _records(segment.get("words") or []) if _is_said(each)]
        at = finite_number(segment.get("start"))
        until = finite_number(segment.get("end"))
        labels: list[Label] = []
        waiting: list[str] = []
        for word in [*words, None] if any(map(_has_start, words)) else []:
            if word is not None and not _has_start(word):
                label = str(word.get(_key(word, LABEL_KEYS), ""))
                waiting += [label.rstrip()] if any(map(str.isalnum, label)) else []
                continue
            timed = [] if word is None else [_word(word)]
            end = timed[0][0] if timed else until
            if waiting and at is not None and end is not None and at < end:
                part = (end - at) / len(waiting)
                labels += [(at + i * part, at + (i + 1) * part, w) for i, w in enumerate(waiting)]
                self.placed += waiting
            else:
                self.lost += waiting
            labels, waiting, at = [*labels, *timed], [], timed[0][1] if timed else at
        return labels

    def notes(self) -> list[str]:
        """What to know about them."""
        dealt = ((self.placed, "looked for in between"), (self.lost, "left out"))
        named = ((len(words), ", ".join(map(str.strip, words))[:60], how) for words, how in dealt)
        return [f"words without times, {n} ({names}), are {how}" for n, names, how in named if n]


def _is_said(word: Record) -> bool:
    return word.get("type") not in NOT_SAID


def _has_start(word: Record) -> bool:
    return word.get(_key(word, STARTS)) is not None


def _words(record: Record) -> Labels:
    """A list of words of an engine or recogniser; Gentle's with phones and their durations."""
    if _is_texts(record["words"]):
        return Labels(words=_columns(record, "words", ("wtimes", "wdurations")))
    entries = _records(record["words"])
    if any("offset" in word for word in entries):
        return _azure_assessment(entries)
    untimed = _Untimed()
    words, phones = untimed.between({"start": 0.0, **record}), list[Label]()
    silent = dict.fromkeys(words)
    for word in filter(_has_start, entries):
        inner = _records(word.get("phones") or word.get("phonemes") or [])
        if inner and _is_said(word):
            silent.pop(_word(word), None)
            at = seconds_of(_number(word.get(_key(word, STARTS))), "start of a word")
            for phone in inner:  # Gentle's have lengths alone
                begun = phone if _key(phone, STARTS) else {**phone, "start": at}
                phones.append(_word(begun))
                at = phones[-1][1]
    if phones:  # nobody says which those of the others are
        phones += [(start, end, "spn") for start, end, _ in silent]
    return Labels(phones, words, notes=untimed.notes())


def _phones(key: str) -> Callable[[Record], Labels]:
    """A list of phones: Elocute's where words are not known, Piper's."""

    def parse(record: Record) -> Labels:
        if _is_texts(record[key]):
            return Labels(phones=_columns(record, key, ("start", "end")))
        return Labels(phones=[_word(each) for each in _records(record[key])])

    return parse


def _visemes(record: Record) -> Labels:
    """TalkingHead: names of Oculus's visemes, with times and durations in ms; or events."""
    entries = _list(record["visemes"])
    rows = [row for each in entries if isinstance(each, list) and (row := _triple(each))]
    if _is_texts(entries):
        rows = _columns(record, "visemes", ("vtimes", "vdurations"))
    elif len(rows) < len(entries):
        if all(isinstance(each, dict) or _is_pair(each) for each in entries):
            return _from_list(entries)
        allowed = '["PP", 0.1, 0.2] in s, [100, 21] of Azure, or records'
        raise InputError.about("visemes", found=str(entries[0])[:40], allowed=allowed)
    return Labels(phones=rows, alphabet="oculus")


def _mouth_cues(record: Record) -> Labels:
    """Rhubarb: start, end and the letter of a picture."""
    return Labels(phones=[_word(cue) for cue in _records(record["mouthcues"])], alphabet="rhubarb")


def _voicevox(record: Record) -> Labels:
    """VOICEVOX: lengths of consonants and vowels in s, at a speed of 1."""
    speed = finite_number(record.get("speedscale", 1.0)) or 1.0
    at = seconds_of(record.get("prephonemelength", 0.0), "silence before", 1 / speed)
    labels = Labels(alphabet="romaji")
    for phrase in _records(record["accentphrases"]):
        moras = _list(phrase.get("moras"))
        for mora in map(_plain, [*moras, *filter(None, [phrase.get("pausemora")])]):
            for kind in ("consonant", "vowel"):
                if mora.get(kind) is None:
                    continue
                end = at + seconds_of(mora.get(f"{kind}length"), f"length of a {kind}", 1 / speed)
                labels.phones.append((at, end, _text(mora[kind])))
                at = end
    return labels


def _cartesia(events: Iterable[Record]) -> Labels:
    """Cartesia: words and phones as columns of labels, starts and ends."""
    result = Labels()
    for event in events:
        for key, kind, labels in (
            ("phonemetimestamps", "phonemes", result.phones),
            ("wordtimestamps", "words", result.words),
        ):
            if event.get(key) is not None:
                labels.extend(_columns(_plain(event[key]), kind, ("start", "end")))
    return result


def _columns(record: Record, kind: str, times: tuple[str, str]) -> list[Label]:
    """Labels, starts, and ends or durations, each a list of its own."""
    labels, starts, lasts = (_list(record.get(key, [])) for key in (kind, *times))
    if not len(labels) == len(starts) == len(lasts):
        raise InputError(
            f"{len(labels)} {kind}, {len(starts)} {times[0]} and {len(lasts)} {times[1]}; "
            "allowed: as many"
        )
    in_ms = times[1].endswith("durations")
    unit = MILLISECOND_S if in_ms else 1.0
    timed = []
    for label, begin, last in zip(labels, starts, lasts, strict=True):
        start, end = (
            seconds_of(each, f"time of one of the {kind}", unit) for each in (begin, last)
        )
        timed.append((start, start + end if in_ms else end, _text(label)))
    return timed


def _letters(records: Sequence[Record]) -> Labels:
    """ElevenLabs: letters with their times, as they were spoken where that is told; spaces part
    words. Of a stream each part may count from its own begin."""
    letters: list[Label] = []
    notes = []
    for record in records:
        inner = _spoken_letters(record)
        after = letters[-1][1] if letters else 0.0
        shift = after if inner and inner[0][0] < after - MILLISECOND_S else 0.0
        if shift and not notes:
            notes.append("times of a stream's parts were taken to begin where the part before ends")
        letters += [(start + shift, end + shift, letter) for start, end, letter in inner]
    written = "".join(letter if len(letter) == 1 else "\0" for _, _, letter in letters)
    unsaid = {at for match in TAGS.finditer(written) for at in range(*match.span())}
    letters = [(a, b, " " if at in unsaid else c) for at, (a, b, c) in enumerate(letters)]
    words: list[Label] = []
    word, begin, until = "", 0.0, 0.0
    for start, end, letter in [*letters, (0.0, 0.0, " ")]:
        if not letter.strip():
            if word:
                words.append((begin, until, word))
            word = ""
            continue
        begin = begin if word else start
        word, until = word + letter, end
    return Labels(words=words, notes=notes)


def _spoken_letters(record: Record) -> list[Label]:
    """The letters of one part, in s of it; none for a part without them."""
    inner = record.get("normalizedalignment") or record.get("alignment")
    if inner is None:
        inner = record if "characters" in record else {}
    inner = _plain(inner)
    in_ms = "chars" in inner
    keys = ("chars", "charstarttimesms", "chardurationsms")
    if not in_ms:
        ends = "s" if "characterstarttimesseconds" in inner else ""  # Inworld's have none
        keys = ("characters", f"characterstarttime{ends}seconds", f"characterendtime{ends}seconds")
    if keys[0] not in inner:
        return []
    letters, starts, lasts = (_list(inner.get(key)) for key in keys)
    if not len(letters) == len(starts) == len(lasts):
        raise InputError(
            f"{len(letters)} letters, {len(starts)} starts and {len(lasts)} ends; allowed: as many"
        )
    unit = MILLISECOND_S if in_ms else 1.0
    timed = []
    for letter, begin, last in zip(letters, starts, lasts, strict=True):
        start, end = (seconds_of(each, "time of a letter", unit) for each in (begin, last))
        if not isinstance(letter, str):
            raise InputError(f"label {str(letter)[:40]}; allowed: text")
        timed.append((start, start + end if in_ms else end, letter))
    return timed


def _word(record: Record) -> Label:
    """A record's label with its times."""
    kind = "phone" if _key(record, PHONE_KEYS) else "word"
    lengths = LENGTHS if not _key(record, ENDS) else ()
    times = []
    for keys, what in ((STARTS, "start"), ((*ENDS, *lengths), "end")):
        key = _key(record, keys)
        unit = MILLISECOND_S if key.endswith(("ms", "milliseconds")) else 1.0
        unit = TICK_S if key.endswith("ticks") else unit
        times.append(seconds_of(_number(record.get(key)), f"{what} of a {kind}", unit))
    end = times[0] + times[1] if _key(record, lengths) else times[1]
    return times[0], end, _text(record.get(_key(record, (*PHONE_KEYS, *LABEL_KEYS))))


def _key(record: Record, keys: Iterable[str]) -> str:
    """The first of some keys that a record has; "" where it has none."""
    return next((key for key in keys if key in record), "")


def _number(value: Any) -> Any:
    """A time in text, as 1.25, 1.25s, 0:01.25 or PT1.25S, or in Google's parts, as a number."""
    if isinstance(value, dict) and value.keys() <= {"seconds", "nanos"}:
        seconds, nanos = _number(value.get("seconds", 0)), value.get("nanos", 0)
        if finite_number(seconds) is not None and finite_number(nanos) is not None:
            return seconds + nanos * 1e-9
    if isinstance(value, str) and (clock := clock_seconds(value)) is not None:
        return clock
    if isinstance(value, str) and (parts := _SECONDS.fullmatch(value)):
        hours, minutes, seconds = (float(part or 0) for part in parts.groups())
        return 3600 * hours + 60 * minutes + seconds
    return value


def _is_texts(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(each, str) for each in value)


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
    return value.rstrip()


PARSERS: dict[str, Callable[[Record], Labels]] = {
    "nbest": lambda record: _azure_assessment([record]),
    "timepoints": _google_marks,
    "timestampinfo": lambda record: _inworld([record]),
    "segments": _segments,
    "visemes": _visemes,
    "mouthcues": _mouth_cues,
    "accentphrases": _voicevox,
    "phonemetimestamps": lambda record: _cartesia([record]),
    "wordtimestamps": lambda record: _cartesia([record]),
    "normalizedalignment": lambda record: _letters([record]),
    "alignment": lambda record: _letters([record]),
    "words": _words,
    "phones": _phones("phones"),
    "phonemes": _phones("phonemes"),
    "characters": lambda record: _letters([record]),
}
"""Records of one value, by the key that only they have; the first that is there."""
