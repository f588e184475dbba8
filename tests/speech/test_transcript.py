"""Phones of a known text in a recording."""

from __future__ import annotations

import numpy as np
import pytest

from elocute.audio.read import read_audio
from elocute.encoders.phones_and_visemes import PHONES
from elocute.encoders.registry import resolve_encoder
from elocute.errors import AlignmentError
from elocute.speech.text.known_phones import RELEASE_S, known_posteriors, posteriors_from_phones
from elocute.speech.text.phone_alignment import PronouncedWord, align_phones
from elocute.speech.text.transcript import Transcript, transcribe
from elocute.speech.voices import espeak
from tests.support.espeak import has_espeak

TIMES = [
    (0.31, 0.42, "M"),
    (0.42, 0.655, "AE"),
    (0.655, 0.8, "P"),
    (1.1, 1.25, "B"),
    (1.25, 1.5, "IY"),
]
WORDS = [PronouncedWord("map", ("M", "AE", "P")), PronouncedWord("bee", ("B", "IY"))]
# Where Festival spoke them: the phones of `speak` in recipes/example.py.
TRUE_S = {
    "voice": (2.155, 2.62),
    "face": (3.47, 3.94),
    "mouth": (4.42, 4.705),
    "fog": (8.37, 8.765),
}
SPOKEN = (
    "Hello. Give me any voice, and I will give it a face. My mouth closes on p, b and m. "
    "Five wolves move through the blue fog. Now I rest."
)


def test_exact_posteriors_give_the_times_back_between_rows():
    found = align_phones(posteriors_from_phones(TIMES, 1.8), WORDS)
    phones = [phone for word in found for phone in word.phones]
    assert [p for _, _, p in phones] == [p for _, _, p in TIMES]
    for (start, end, _), (true_start, true_end, _) in zip(phones, TIMES, strict=True):
        assert abs(start - true_start) < 0.006 and abs(end - true_end) < 0.006
    assert all(word.confidence > 0.9 for word in found)


def test_times_of_words_hold_their_phones():
    """Two words that sound alike: only the given times say which stretch is whose."""
    heard = posteriors_from_phones(
        [(0.2, 0.4, "M"), (0.4, 0.6, "IY"), (1.2, 1.4, "M"), (1.4, 1.6, "IY")], 2
    )
    late = [PronouncedWord("me", ("M", "IY"), (1.2, 1.6))]
    assert abs(align_phones(heard, late)[0].start_s - 1.2) < 0.02
    early = [PronouncedWord("me", ("M", "IY"), (0.2, 0.6))]
    assert abs(align_phones(heard, early)[0].end_s - 0.6) < 0.02


def test_more_phones_than_rows_are_refused():
    with pytest.raises(AlignmentError, match=r"2 words of 5 phones for 0.08 s"):
        align_phones(posteriors_from_phones([], 0.08), WORDS)
    with pytest.raises(AlignmentError, match="phone 'XX'"):
        align_phones(posteriors_from_phones([], 1.0), [PronouncedWord("x", ("XX",))])


def test_a_wider_beam_is_taken_where_the_path_is_lost(monkeypatch):
    from elocute.speech.text import phone_alignment

    monkeypatch.setattr(phone_alignment, "BEAM", 1e-9)
    found = align_phones(posteriors_from_phones(TIMES, 1.8), WORDS)
    assert abs(found[0].start_s - 0.31) < 0.01


def test_lips_part_at_the_burst():
    posteriors = np.exp(known_posteriors([(0.2, 0.4, "P")], 0.6))
    p = posteriors[:, PHONES.index("P")]
    assert p[round((0.4 - RELEASE_S) * 50) - 2] > 0.9 and p[round((0.4 - RELEASE_S) * 50) + 1] < 0.1


@pytest.fixture(scope="module")
def heard(speech_wav):
    return resolve_encoder("phones")(read_audio(speech_wav)).values, read_audio(
        speech_wav
    ).duration_s


def test_words_are_found_where_they_are_said(heard, need):
    need(has_espeak(), "espeak-ng")
    found = transcribe(Transcript.of_text(SPOKEN), *heard)
    by_text = {word.text: word for word in found.words}
    for text, (start, end) in TRUE_S.items():
        assert abs(by_text[text].start_s - start) < 0.04, by_text[text]
        assert abs(by_text[text].end_s - end) < 0.05, by_text[text]
    contacts = [PHONES.index(phone) for phone in ("P", "B", "M")]
    said = np.exp(found.posteriors[:, contacts]).sum(axis=1)
    assert said[: round(1.9 * 50)][round(1.5 * 50) :].max() > 0.9, "the m of `give me`"
    assert found.notes == ()


def test_silence_is_not_aligned(need):
    need(has_espeak(), "espeak-ng")
    with pytest.raises(AlignmentError, match="silence"):
        transcribe(Transcript.of_text("hello"), posteriors_from_phones([], 2.0), 2.0)


def test_without_espeak_english_comes_from_a_dictionary(monkeypatch, heard):
    pytest.importorskip("pocketsphinx", reason="needs the extra `wild`")
    import sys

    monkeypatch.setattr(espeak, "LIBRARIES", ())
    monkeypatch.setitem(sys.modules, "espeakng_loader", None)
    found = transcribe(Transcript.of_text(SPOKEN), *heard)
    by_text = {word.text: word for word in found.words}
    assert abs(by_text["voice"].start_s - TRUE_S["voice"][0]) < 0.05
    with pytest.raises(AlignmentError, match="no pronunciation of blorfit"):
        Transcript.of_text("hello blorfit")
    from elocute.errors import MachineError

    with pytest.raises(MachineError, match="espeak-ng"):
        Transcript.of_text("guten Tag", "de")
