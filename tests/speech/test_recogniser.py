"""Words that nobody wrote down: recognised, then aligned as a known text is."""

from __future__ import annotations

import sys
from dataclasses import replace
from difflib import SequenceMatcher
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import elocute
from elocute.audio.read import read_audio
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.phones_and_visemes import PHONES
from elocute.errors import InputError, MachineError, ModelError
from elocute.speech.text import recogniser
from elocute.speech.text.heard_phones import heard_phones
from elocute.speech.text.known_phones import posteriors_from_phones
from elocute.speech.text.phone_alignment import PronouncedWord
from elocute.speech.text.recogniser import recognise
from elocute.speech.text.text_words import words_of_text
from elocute.speech.text.transcript import Transcript, transcribe
from elocute.speech.timed_phones import find_words
from tests.support.espeak import has_espeak

TEXT = (
    "Hello. Give me any voice and I will give it a face. My mouth closes on P, B and M. "
    "Five wolves move through the blue fog. Now I rest."
)
WORDS = [word.text for word in words_of_text(TEXT)]
SMALL = {"fps": 25, "life": 0, "look": "none"}


def alike(words: list[str]) -> float:
    """How much of the text was recognised: letters and marks differ from machine to machine."""
    heard, said = ([word.casefold() for word in each] for each in (words, WORDS))
    return SequenceMatcher(None, heard, said).ratio()


@pytest.fixture(autouse=True)
def _spoken(need):
    need(has_espeak(), "espeak-ng")


@pytest.fixture(scope="module")
def heard(speech_wav):
    return builtin_encoder().encode(read_audio(speech_wav).resample(16000).samples)


def certain(transcript: Transcript) -> Transcript:
    words = tuple(replace(word, sure=True) for word in transcript.words)
    return replace(transcript, words=words)


@pytest.fixture(scope="module")
def recognised(speech_wav, whisper) -> Transcript:
    return recognise(speech_wav, whisper)


def test_a_recording_says_its_own_text(recognised):
    assert alike([word.text for word in recognised.words]) > 0.9
    assert recognised.text.endswith("Now I rest.") and recognised.notes == ()
    assert recognised.recognised and sum(word.sure for word in recognised.words) > 25
    spans = [word.span_s for word in recognised.words if word.span_s]
    assert len(spans) == len(recognised.words)
    assert all(first[0] <= second[0] for first, second in pairwise(spans))


def test_times_and_phones_are_those_of_the_known_text(recognised, heard):
    known = transcribe(Transcript.of_text(recognised.text), heard, len(heard) / 50)
    found = transcribe(certain(recognised), heard, len(heard) / 50)
    assert [word.text for word in found.words] == [word.text for word in known.words]
    assert [phone for *_, phone in found.phones] == [phone for *_, phone in known.phones]
    apart = np.subtract([p[:2] for p in found.phones], [p[:2] for p in known.phones])
    assert np.abs(apart).max() < 0.03
    assert found.notes == ()


def test_lips_close_as_they_do_for_the_known_text(speech_wav, whisper, recognised):
    known = elocute.animate(speech_wav, text=recognised.text, **SMALL)
    found = elocute.animate(speech_wav, transcribe=whisper, **SMALL)
    assert [word for *_, word in found.words] == [word for *_, word in known.words]
    assert {"face.", "rest."} <= {word for *_, word in found.words}
    assert np.abs(found.curves.values - known.curves.values).mean() < 0.01


def test_what_is_unsure_is_as_it_is_heard(recognised, heard):
    guesses = ("voice", "wolves")
    words = [replace(word, sure=word.text not in guesses) for word in certain(recognised).words]
    found = transcribe(replace(recognised, words=tuple(words)), heard, len(heard) / 50)
    ear = heard_phones(heard, len(heard) / 50)
    for word in found.words:
        if word.text in guesses:
            middle = [(a, b, p) for a, b, p in ear if a >= word.start_s and b <= word.end_s]
            assert set(middle) <= set(found.phones), word.text
            rows = slice(round(word.start_s * 50) + 1, round(word.end_s * 50) - 1)
            assert np.allclose(np.exp(found.posteriors[rows]), np.exp(heard[rows]), atol=2e-6)
        else:
            assert set(word.phones) <= set(found.phones)
    assert found.notes[0].startswith("unsure, left to the encoder: 'voice' at 2.")
    assert len(found.words) == len(recognised.words)


def test_what_was_not_recognised_is_as_it_is_heard(recognised, heard):
    words = [w for w in recognised.words if not (w.span_s and 3.5 < sum(w.span_s) / 2 < 6.8)]
    found = transcribe(replace(recognised, words=tuple(words)), heard, len(heard) / 50)
    missed = [phone for start, _, phone in found.phones if 4.3 < start < 6.3]
    assert len(missed) > 12
    assert {"M", "B"} & set(missed)


def test_a_pause_stays_a_pause():
    """Less than 0.3 s of what may be breath between words is no speech that was missed."""
    phones = [(0.2, 0.4, "M"), (0.4, 0.6, "IY"), (0.9, 1.1, "B"), (1.3, 1.5, "M"), (1.5, 1.7, "IY")]
    word = PronouncedWord("me", ("M", "IY"))
    words = (replace(word, span_s=(0.1, 0.7)), replace(word, span_s=(1.2, 1.8)))
    rows = posteriors_from_phones(phones, 2.0)
    found = transcribe(Transcript(words, recognised=True), rows, 2.0)
    assert [phone for *_, phone in found.phones] == ["M", "IY", "M", "IY"]
    longer = posteriors_from_phones([*phones[:2], (0.65, 1.15, "B"), *phones[3:]], 2.0)
    found = transcribe(Transcript(words, recognised=True), longer, 2.0)
    assert [phone for *_, phone in found.phones] == ["M", "IY", "B", "M", "IY"]


def test_more_words_than_fit_are_left_out():
    word = PronouncedWord("me", ("M", "IY") * 10, (0.0, 0.3))
    rows = posteriors_from_phones([(0.1, 0.2, "M")], 0.3)
    found = transcribe(Transcript((word,), recognised=True), rows, 0.3)
    assert found.words == () and found.notes == ()


def test_a_long_recording_is_heard_in_pieces_parted_in_pauses(
    speech_wav, whisper, recognised, heard, monkeypatch
):
    monkeypatch.setattr(recogniser, "PIECE_S", 9.2)
    monkeypatch.setattr(recogniser, "SEAM_S", 1.5)
    parted = recognise(speech_wav, whisper)
    (seam,) = parted.seams_s
    assert 8.8 < seam < 9.15, "between `fog` and `Now`"
    assert alike([word.text for word in parted.words]) > 0.9
    found = {word.text: word.start_s for word in transcribe(parted, heard, len(heard) / 50).words}
    assert abs(found["fog"] - 8.37) < 0.05 and 9.1 < found["Now"] < 9.3


def test_blocks_of_any_length_are_the_same_sound():
    sound = np.random.default_rng(0).normal(0, 0.1, 16000 * 600).astype(np.float32)
    sound[16000 * 225 : 16000 * 226] = 0
    whole = list(recogniser._pieces([sound]))
    cut = list(recogniser._pieces(np.array_split(sound, 97)))
    assert [start for start, _ in whole] == [start for start, _ in cut]
    assert 225 < whole[1][0] < 226
    assert np.array_equal(np.concatenate([piece for _, piece in cut]), sound)
    assert max(len(piece) for _, piece in cut) <= recogniser.PIECE_S * 16000


@pytest.mark.parametrize("level", [0.0, 0.05], ids=["silence", "noise"])
def test_nothing_is_invented_where_nobody_speaks(whisper, level):
    sound = np.random.default_rng(0).normal(0, level, 32000).astype(np.float32)
    found = elocute.find_phones(sound, rate=16000, transcribe=whisper)
    assert found.words == () and found.notes == (
        "no words recognised: phones are as they are heard",
    )
    alone = elocute.find_phones(sound, rate=16000)
    assert found.phones == alone.phones


def test_words_of_the_text_have_the_times_of_its_parts():
    """As Whisper parts a text: marks at their words, a price in two."""
    parts = [
        recogniser._Part(" That's", 0.1, 0.5, 0.9),
        recogniser._Part(" $9", 0.5, 0.9, 0.8),
        recogniser._Part(".99,", 0.9, 1.4, 0.05),
        recogniser._Part(" please.", 1.4, 2.0, 0.9),
    ]
    words = [PronouncedWord(text, ("AH",)) for text in ("That's", "$9.99", "please")]
    timed = list(recogniser._timed(words, " That's $9.99, please.", parts))
    slack = recogniser.CAPTION_SLACK_S
    spans = [(word.span_s[0] + slack, word.span_s[1] - slack) for word in timed if word.span_s]
    assert np.allclose(spans, [(0.1, 0.5), (0.5, 1.4), (1.4, 2.0)])
    assert [word.sure for word in timed] == [True, False, True]


def test_words_with_confidence(speech_wav, whisper):
    found = find_words(speech_wav, transcribe=whisper)
    assert alike([word.text for word in found.words]) > 0.9
    (voice,) = [word for word in found.words if word.text == "voice"]
    assert abs(voice.start_s - 2.155) < 0.05 and voice.confidence > 0.2


def test_languages_are_called_as_whisper_calls_them():
    many = ("en", "de", "zh", "no", "yue", "pt", *"abcdefgh")
    names = {"zh-CN": "zh", "cmn": "zh", "nb": "no", "pt_BR": "pt", "yue": "yue", "auto": None}
    assert {name: recogniser._code_of(name, "base", many) for name in names} == names
    assert recogniser._code_of("auto", "tiny.en", ["en"]) == "en"
    with pytest.raises(InputError, match=r"`language`: 'de', which tiny\.en does not recognise"):
        recogniser._code_of("de", "tiny.en", ["en"])


def test_a_language_that_espeak_lacks_is_left_to_the_ear(speech_wav, monkeypatch):
    """Whisper hears a hundred languages, of which espeak-ng has not all."""

    word = SimpleNamespace(word=" Kamusta", start=0.5, end=1.0, probability=0.9)
    segment = SimpleNamespace(words=[word], compression_ratio=1.0)
    tagalog = SimpleNamespace(
        supported_languages=("en", "tl"),
        transcribe=lambda *_, **__: ([segment], SimpleNamespace(language="tl")),
    )
    monkeypatch.setattr(recogniser, "_opened", lambda _: tagalog)
    found = recognise(speech_wav, "base")
    assert found.words == () and found.notes == (
        "language heard: tl",
        "words left to the encoder: espeak-ng does not speak those from 0 s on in tl",
        "no words recognised: phones are as they are heard",
    )
    with pytest.raises(InputError, match="`language` tl: unknown to espeak-ng"):
        recognise(speech_wav, "base", "tl")


def test_models_that_are_not_there(speech_wav, tmp_path):
    pytest.importorskip("faster_whisper", reason="needs the extra `transcribe`")
    with pytest.raises(MachineError, match=r"'nobody/none' is not in this .*download_model\('nob"):
        recognise(speech_wav, "nobody/none")
    with pytest.raises(InputError, match=r"'models/big/x': no folder; allowed: a model"):
        recognise(speech_wav, "models/big/x")
    with pytest.raises(InputError, match="`transcribe`: 3; allowed: True, the name"):
        elocute.animate(speech_wav, transcribe=3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(InputError, match="`text`: `transcribe` too; allowed: one of them"):
        elocute.animate(speech_wav, text="Hello.", transcribe=True)
    with pytest.raises(InputError, match="`text`: `transcribe` too"):
        elocute.find_phones(speech_wav, text="Hello.", transcribe="base")
    with pytest.raises(ModelError, match=r"no model.bin; allowed: a folder of faster-whisper"):
        recognise(speech_wav, tmp_path)


def test_a_model_is_never_completed_from_elsewhere(speech_wav, whisper, tmp_path):
    """faster-whisper would fetch a tokenizer that is missing; one that is broken is told."""
    for name in ("config.json", "model.bin"):
        (tmp_path / name).write_bytes((whisper / name).read_bytes()[:2000])
    with pytest.raises(ModelError, match=r"no tokenizer.json; allowed"):
        recognise(speech_wav, tmp_path)
    (tmp_path / "tokenizer.json").write_bytes((whisper / "tokenizer.json").read_bytes())
    with pytest.raises(ModelError, match="no model that can be loaded"):
        recognise(speech_wav, tmp_path)


def test_without_the_extra(speech_wav, monkeypatch):
    monkeypatch.setitem(sys.modules, "faster_whisper", None)
    with pytest.raises(MachineError, match=r"needs faster_whisper.*'elocute\[transcribe\]'"):
        recognise(speech_wav, "tiny")


def test_every_phone_is_one_of_ours(recognised):
    assert {phone for word in recognised.words for phone in word.phones} <= set(PHONES)
