"""`--transcribe` on the command line: words that nobody wrote down."""

from __future__ import annotations

import json

import numpy as np
import pytest
import soundfile

from elocute.speech.times.read import read_speech_times
from tests.support.commands import one_line, refused, run_here, succeeds
from tests.support.espeak import has_espeak

HEARD = ["give", "me", "any", "voice", "and", "i", "will", "give", "it", "a", "face"]
FEW = ("--fps", 25, "--life", 0, "--look", "none")


@pytest.fixture(scope="module")
def sentence(speech_wav, tmp_path_factory, need):
    """3 s of the example."""
    need(has_espeak(), "espeak-ng")
    path = tmp_path_factory.mktemp("said") / "say.wav"
    samples, rate = soundfile.read(speech_wav, start=32000 * 6 // 5, frames=32000 * 29 // 10)
    soundfile.write(path, samples, rate)
    return path


@pytest.fixture(scope="module")
def listen(whisper):
    return ("--transcribe", "--recogniser", whisper)


def test_phones_and_words(sentence, listen, tmp_path):
    made = succeeds("phones", sentence, *listen, "-o", tmp_path / "a.TextGrid", "--json")
    record = json.loads(made.stdout)
    found = read_speech_times(tmp_path / "a.TextGrid")
    assert [word.lower() for *_, word in found.words] == HEARD
    assert record["words"] == len(HEARD) and record["phones"] == len(found.phones) > 25


def test_captions_have_real_words(sentence, listen, tmp_path):
    succeeds("cues", sentence, *listen, "-o", tmp_path / "a.srt")
    text = " ".join((tmp_path / "a.srt").read_text().split("\n")[2:]).strip()
    assert text.replace(",", "") == "Give me any voice and I will give it a face."


def test_words_with_their_times(sentence, listen, tmp_path):
    succeeds("words", "segment", sentence, *listen, "-o", tmp_path / "a.json")
    words = json.loads((tmp_path / "a.json").read_text())["words"]
    assert [word["word"].lower() for word in words] == HEARD
    assert abs(words[3]["start_s"] - (2.155 - 1.2)) < 0.05, "where Festival says `voice`"


def test_a_table_recognises_what_has_no_text(sentence, listen, tmp_path):
    soundfile.write(tmp_path / "hush.wav", np.zeros(16000, np.float32), 16000)
    (tmp_path / "say.wav").write_bytes(sentence.read_bytes())
    text = "Give me any voice, and I will give it a face."
    (tmp_path / "lines.csv").write_text(
        f'id,audio,text\none,say.wav,\ntwo,say.wav,"{text}"\nthree,hush.wav,\n'
    )
    out = ("-o", tmp_path / "takes", "--format", "npz", "--json")
    made = run_here("animate", "--table", tmp_path / "lines.csv", *listen, *FEW, *out)
    assert made.returncode == 0
    one, two, three = (json.loads(line) for line in made.stdout.splitlines())
    assert "notes" not in one and "notes" not in two
    assert three["notes"][0] == "no words recognised: phones are as they are heard"
    weights = [np.load(tmp_path / "takes" / f"{name}.npz")["weights"] for name in ("one", "two")]
    assert np.abs(weights[0] - weights[1]).mean() < 0.01


def test_several_recordings(sentence, listen, tmp_path):
    outputs = ("-o", tmp_path / "out", "--format", "csv", "--json")
    again = tmp_path / "again.wav"
    again.write_bytes(sentence.read_bytes())
    made = succeeds("animate", sentence, again, *listen, *FEW, *outputs)
    assert len(made.stdout.splitlines()) == 2
    rows = [(tmp_path / "out" / f"{name}.csv").read_text() for name in ("say", "again")]
    assert rows[0] == rows[1], "no dice"


def test_what_is_refused_leaves_nothing(sentence, listen, tmp_path):
    out = ("-o", tmp_path / "a.csv")
    for command in ("animate", "phones"):
        refused(command, sentence, *listen, "--text", "Hello", *out, says="--transcribe too")
        refused(command, sentence, *listen[1:], *out, says="--recogniser: no --transcribe")
        refused(command, sentence, *listen, "--language", "de", *out, says="--language: 'de'")
        missing = ("--transcribe", "--recogniser", "nobody/none")
        one_line(
            run_here(command, sentence, *missing, *out), "download_model('nobody/none')", code=1
        )
    words = ("words", "segment", sentence, "-o", tmp_path / "a.json")
    refused(*words, *listen, "--text", "Hello", says="--transcribe too")
    refused(*words, says="neither --text nor --text-file")
    refused(*words, "--text", "Hallo", "--language", "de", says="--language: no --transcribe")
    assert not list(tmp_path.iterdir())
