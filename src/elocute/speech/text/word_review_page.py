"""Writes a page for reviewing words: waveform, spectrogram, boundaries and sound in one file."""

from __future__ import annotations

import base64
import html
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.audio.spectral import log_mel
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.errors import AlignmentError
from elocute.files.atomic import write_atomically
from elocute.files.html_page import filled_page, script_json
from elocute.speech.text.word_times import TimedWord, TimedWords

DOUBTFUL = 0.2  # confidence below which a word is marked
SHORTEST_S, LONGEST_S = 0.06, 1.5
PIXELS_PER_S = 160
ROW_S = 8.0
LONGEST_PAGE_S = 1800.0
WAVE_PIXELS, BANDS_PIXELS = 64, 128
DURATION_SLACK_S = 0.25
DB_PER_NEPER = 10 / np.log(10)  # of powers
PAGE = Path(__file__).with_name("word_page.html")


def review_reason(word: TimedWord) -> str:
    """Why a person should review a word, or ""."""
    seconds = word.end_s - word.start_s
    if word.confidence < DOUBTFUL:
        return f"confidence {word.confidence:.2f}"
    if not SHORTEST_S <= seconds <= LONGEST_S:
        return f"{seconds:.2f} s long"
    return ""


def write_word_page(words: TimedWords, sound: Waveform, path: str | Path, title: str = "") -> int:
    """Write the page and return how many words are marked for review.

    Raises AlignmentError where words and sound differ in length, OutputError where the page cannot
    be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".html":
        raise AlignmentError.about(path, found=f"suffix {path.suffix!r}", allowed=".html")
    check_length(words, sound)
    speech = sound.resample(SPEECH_RATE)
    marked = [review_reason(word) for word in words.words]
    rows = [
        _row(speech, words, marked, start)
        for start in np.arange(0, speech.duration_s, ROW_S).tolist()
    ]
    parts = {
        "@TITLE@": html.escape(title or path.stem),
        "@COUNT@": f"{len(words.words)} words, {sum(map(bool, marked))} marked",
        "@SOUND@": base64.b64encode(_wav(speech)).decode(),
        "@ROWS@": "\n".join(rows),
        "@WORDS@": _as_script(words, marked),
    }
    page = PAGE.read_text(encoding="utf-8")
    with write_atomically(path) as draft:
        draft.write_text("".join(filled_page(page, parts)), encoding="utf-8")
    return sum(map(bool, marked))


def check_length(words: TimedWords, sound: Waveform) -> None:
    """Raise AlignmentError where words and sound differ in length, or are too long for a page."""
    if abs(words.duration_s - sound.duration_s) > DURATION_SLACK_S:
        raise AlignmentError.about(
            "sound",
            found=f"{sound.duration_s:.2f} s",
            allowed=f"{words.duration_s:.2f} s, as the words say",
        )
    if sound.duration_s > LONGEST_PAGE_S:
        raise AlignmentError.about(
            "sound", found=f"{sound.duration_s:.0f} s", allowed=f"up to {LONGEST_PAGE_S:g} s"
        )


def _as_script(words: TimedWords, marked: list[str]) -> str:
    rows = [
        [w.text, w.start_s, w.end_s, w.confidence, why]
        for w, why in zip(words.words, marked, strict=True)
    ]
    return script_json(rows)


def _row(speech: Waveform, words: TimedWords, marked: list[str], start_s: float) -> str:
    first = round(start_s * SPEECH_RATE)
    samples = speech.samples[first : first + round(ROW_S * SPEECH_RATE)]
    seconds = len(samples) / SPEECH_RATE
    width = max(2, round(seconds * PIXELS_PER_S))
    inside = [
        (number, word, why)
        for number, (word, why) in enumerate(zip(words.words, marked, strict=True))
        if word.start_s < start_s + seconds and word.end_s > start_s
    ]
    boxes = "".join(_box(number, word, why, start_s, width) for number, word, why in inside)
    return (
        f'<div class="row" data-start="{start_s:g}" style="width:{width}px">'
        f'<img alt="sound from {start_s:g} s" width="{width}" height="{WAVE_PIXELS + BANDS_PIXELS}"'
        f' src="data:image/png;base64,{_picture(samples, width)}">{boxes}'
        f'<span class="time">{start_s:g} s</span></div>'
    )


def _box(number: int, word: TimedWord, why: str, start_s: float, width: int) -> str:
    left = max((word.start_s - start_s) * PIXELS_PER_S, 0.0)
    right = min((word.end_s - start_s) * PIXELS_PER_S, float(width))
    tooltip = html.escape(f"{word.start_s:.3f} to {word.end_s:.3f} s, {why or 'sure'}", quote=True)
    return (
        f'<button class="word{" doubtful" if why else ""}" data-word="{number}" title="{tooltip}"'
        f' style="left:{left:.1f}px;width:{max(right - left, 1):.1f}px">'
        f"{html.escape(word.text)}</button>"
    )


def _picture(samples: NDArray[np.float32], width: int) -> str:
    """A PNG, base64: the waveform above, the spectrogram below."""
    from PIL import Image

    canvas = np.full((WAVE_PIXELS + BANDS_PIXELS, width), 255, np.uint8)
    edges = np.linspace(0, len(samples), width + 1).astype(int)
    for x in range(width):
        part = samples[edges[x] : max(edges[x + 1], edges[x] + 1)]
        high, low = (1 - float(np.clip(end, -1, 1)) for end in (part.max(), part.min()))
        canvas[int(high * WAVE_PIXELS / 2) : int(low * (WAVE_PIXELS - 1) / 2) + 1, x] = 60
    canvas[WAVE_PIXELS:] = _spectrogram(samples, width)
    packed = io.BytesIO()
    Image.fromarray(canvas).save(packed, "PNG", optimize=True)
    return base64.b64encode(packed.getvalue()).decode()


def _spectrogram(samples: NDArray[np.float32], width: int) -> NDArray[np.uint8]:
    """(BANDS_PIXELS, width) grey: dark is loud, 60 dB below the loudest is white."""
    from PIL import Image

    bands = log_mel(np.pad(samples, (0, max(0, 800 - len(samples)))), SPEECH_RATE)
    shade = np.clip((bands.max() - bands) / (60 / DB_PER_NEPER), 0, 1) * 255
    picture = Image.fromarray(shade.T[::-1].astype(np.uint8))
    return np.asarray(picture.resize((width, BANDS_PIXELS)))


def _wav(speech: Waveform) -> bytes:
    import soundfile

    packed = io.BytesIO()
    samples = np.clip(speech.samples, -1, 1)
    soundfile.write(packed, samples, speech.sample_rate, "PCM_16", format="WAV")
    return packed.getvalue()
