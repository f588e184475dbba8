"""Speech from text: what espeak-ng says, and when."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from elocute.errors import InputError, MachineError
from elocute.speech.voices import espeak, registry
from elocute.speech.voices.espeak import LEAD_S, speak, spell
from elocute.speech.voices.settings import VoiceSettings
from tests.support.espeak import has_espeak

SAID = "A happy puppy; my paper map."


@pytest.fixture(scope="module", autouse=True)
def _needs_espeak(need):
    need(has_espeak(), "espeak-ng")


def test_phones_and_words_come_with_their_times():
    spoken = speak(SAID)
    assert [word.text for word in spoken.words] == ["A", "happy", "puppy", "my", "paper", "map"]
    phones = [phone for _, _, phone in spoken.words[2].phones]
    assert phones == ["P", "AH", "P", "IY"]
    ends = [end for _, end, _ in spoken.phones]
    starts = [start for start, _, _ in spoken.phones]
    assert (
        starts[0] >= LEAD_S and np.all(np.diff(starts) >= 0) and ends[-1] < spoken.sound.duration_s
    )
    assert all(abs(end - start) < 1e-6 for end, start in zip(ends, starts[1:], strict=False))


def test_a_stop_begins_where_the_mouth_is_silent():
    """The sound tells: in the first 30 ms of each inner p there is nothing to hear."""
    spoken = speak(SAID)
    rate, samples = spoken.sound.sample_rate, spoken.sound.samples
    inner = [p for word in spoken.words for p in word.phones[1:] if p[2] == "P"]
    assert len(inner) == 4
    for start, _, _ in inner:
        closure = samples[round((start + 0.002) * rate) : round((start + 0.03) * rate)]
        before = samples[round((start - 0.03) * rate) : round((start - 0.005) * rate)]
        assert np.abs(closure).max() < 1e-3 < np.abs(before).max()


def test_voice_language_rate_and_pitch_are_heard():
    plain = speak("Guten Morgen", VoiceSettings("de"))
    assert [w.text for w in plain.words] == ["Guten", "Morgen"]
    slow = speak("Guten Morgen", VoiceSettings("de", words_per_minute=90))
    assert slow.sound.duration_s > 1.2 * plain.sound.duration_s
    other = speak("Guten Morgen", VoiceSettings("de", voice="f2", pitch=80))
    assert not np.array_equal(other.sound.samples[:9000], plain.sound.samples[:9000])


def test_the_same_text_sounds_the_same_whatever_was_said_before():
    first = speak("Hello there.").sound.samples
    speak("¡Hola!", VoiceSettings("es"))
    assert np.array_equal(speak("Hello there.").sound.samples, first)


@pytest.mark.parametrize(
    ("text", "voice", "says"),
    [
        ("hi", VoiceSettings("xx"), "`language` xx: unknown to espeak-ng; allowed: af, am"),
        ("hi", VoiceSettings(voice="zz"), "`voice` zz: unknown to espeak-ng; allowed: .*f2"),
        ("hi\x01there", None, r"'\\x01' at letter 3"),
        ("\ud800", None, "at letter 1"),
        (" \n ", None, "text: nothing"),
        ("... !", None, "allowed: words"),
        ("x" * 30_000, None, "30000 letters; allowed: up to 20000"),
        (7, None, "text: int"),
    ],
)
def test_what_cannot_be_spoken_is_refused(text, voice, says):
    with pytest.raises(InputError, match=says) as caught:
        speak(text, voice)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["../../etc", "en us", "", "en;ls", "x" * 99, "/abs"])
def test_a_language_is_no_path(name):
    with pytest.raises(InputError, match="`language`"):
        VoiceSettings(name)


@pytest.mark.parametrize(
    ("language", "name"),
    [
        ("de-DE", "de"),
        ("en_US.UTF-8", "en-us"),
        ("zh-CN", "cmn"),
        ("pt_PT", "pt"),
        ("es-MX", "es-419"),
    ],
)
def test_a_language_may_be_called_as_others_call_it(language, name):
    assert speak("la 2", VoiceSettings(language)).phones == (
        speak("la 2", VoiceSettings(name)).phones
    )


def test_words_are_spelled_alone():
    assert spell(["four", "castle", "the"], VoiceSettings("en_US")) == {
        "four": ("F", "AO", "R"),
        "castle": ("K", "AE", "S", "AH", "L"),
        "the": ("DH", "AH"),
    }


def test_what_a_shell_would_run_is_only_said(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    spoken = speak("--help; $(touch here) `touch there` | tee x > y && <speak/> [[h@'loU]] -x")
    assert spoken.words[0].text and not list(tmp_path.iterdir())


def test_a_missing_library_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(espeak, "LIBRARIES", ("libnothing-of-that-name.so",))
    monkeypatch.setitem(sys.modules, "espeakng_loader", None)
    with pytest.raises(MachineError, match=r"needs espeak-ng .*pip install 'elocute\[tts\]'"):
        speak("hello")


def test_a_library_that_crashes_ends_its_own_process_alone(monkeypatch, tmp_path):
    crash = tmp_path / "crash.py"
    crash.write_text("import os\nos.abort()\n")
    monkeypatch.setattr(espeak.espeak_library, "__file__", str(crash))
    with pytest.raises(MachineError, match="it ended with code"):
        speak("hello")
    assert Path.cwd().exists()


@pytest.mark.parametrize("language", ["en-gb", "fr-fr", "es-419", "cmn"])
def test_a_language_is_spoken_whose_file_is_called_otherwise(language):
    assert len(speak("7", VoiceSettings(language, voice="f2")).phones) > 2


@pytest.mark.parametrize(
    "text", ["<speak>Hi <break time='2s'/>Bob</speak>", 'Hi <break time="2s"/> Bob']
)
def test_tags_are_no_words(text):
    """Of lines of dialogue that were written for another engine."""
    assert [word.text for word in registry.speak(text).words] == ["Hi", "Bob"]
