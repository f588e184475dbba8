"""Writes phones and words with their times as files that aligners and Praat read.

TextGrid, CTM, CSV and JSON; `speech_times` reads all of them back.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from elocute.errors import OutputError
from elocute.files.atomic import write_atomically
from elocute.speech.times.labels import Label
from elocute.speech.times.textgrid import TextGridInterval, format_textgrid


@dataclass(frozen=True)
class TimedSpeech:
    """What was said when: phones (ARPAbet) and, where known, words, as start in s, end in s and
    label.

    Both are in order and without overlap; pauses are left out. `notes` say what to know about them;
    `text` is what is said with its marks, where it is known.
    """

    phones: tuple[Label, ...]
    words: tuple[Label, ...]
    duration_s: float
    notes: tuple[str, ...] = ()
    text: str = ""

    def phones_of(self, word: Label) -> list[Label]:
        """The phones whose middle lies in a word."""
        start, end, _ = word
        return [phone for phone in self.phones if start <= (phone[0] + phone[1]) / 2 < end]


def write_speech_times(speech: TimedSpeech, path: str | Path) -> None:
    """Write phones and words as the suffix says.

    .TextGrid (tiers `phones` and `words`), .ctm, .csv (start_s,end_s,phone) and .json (words with
    the phones in each, or phones alone) are known. Raises OutputError for another suffix, and a
    place that cannot be written.
    """
    path = Path(path)
    write = WRITERS.get(path.suffix.lower())
    if write is None:
        allowed = ".TextGrid .ctm .csv .json"
        raise OutputError.about(path, found=f"suffix {path.suffix!r}", allowed=allowed)
    with write_atomically(path) as draft:
        draft.write_text(write(speech, path.stem), encoding="utf-8", newline="\n")


def _textgrid(speech: TimedSpeech, stem: str) -> str:
    tiers = {"phones": speech.phones} | ({"words": speech.words} if speech.words else {})
    shown = {name: [TextGridInterval(*label) for label in labels] for name, labels in tiers.items()}
    return format_textgrid(shown, speech.duration_s)


def _ctm(speech: TimedSpeech, stem: str) -> str:
    """One recording, channel 1; names hold no spaces, which part the fields."""
    name = "_".join(stem.split()) or "speech"
    return "".join(
        f"{name} 1 {start:.3f} {end - start:.3f} {phone}\n" for start, end, phone in speech.phones
    )


def _csv(speech: TimedSpeech, stem: str) -> str:
    rows = [f"{start:.3f},{end:.3f},{phone}\n" for start, end, phone in speech.phones]
    return "".join(["start_s,end_s,phone\n", *rows])


def _json(speech: TimedSpeech, stem: str) -> str:
    """As Gentle has them, whose phones have durations."""
    record: dict[str, object] = {"duration": round(speech.duration_s, 4)}
    if not speech.words:
        record["phones"] = [_timed(label, "phone") for label in speech.phones]
        return json.dumps(record, indent=1) + "\n"
    record["words"] = [
        {
            **_timed(word, "word"),
            "phones": [_timed(each, "phone") for each in speech.phones_of(word)],
        }
        for word in speech.words
    ]
    return json.dumps(record, indent=1, ensure_ascii=False) + "\n"


def _timed(label: Label, kind: str) -> dict[str, object]:
    start, end, text = label
    return {
        "start": round(start, 4),
        "end": round(end, 4),
        "duration": round(end - start, 4),
        kind: text,
    }


WRITERS: dict[str, Callable[[TimedSpeech, str], str]] = {
    ".textgrid": _textgrid,
    ".ctm": _ctm,
    ".csv": _csv,
    ".json": _json,
}
