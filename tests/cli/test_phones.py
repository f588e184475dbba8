"""`elocute phones` and `elocute cues` on the command line."""

import json

from elocute.speech.times.read import read_speech_times
from tests.support.commands import refused, succeeds


def test_phones_in_several_formats(speech_wav, tmp_path):
    outputs = ("-o", tmp_path / "a.TextGrid", "-o", tmp_path / "a.csv")
    record = json.loads(succeeds("phones", speech_wav, *outputs, "--json").stdout)
    for name in ("a.TextGrid", "a.csv"):
        assert len(read_speech_times(tmp_path / name).phones) == record["phones"] > 60


def test_a_file_of_times_becomes_cues(speech_wav, tmp_path):
    succeeds("phones", speech_wav, "-o", tmp_path / "a.ctm")
    succeeds("cues", speech_wav, "--phones", tmp_path / "a.ctm", "-o", tmp_path / "a.tsv")
    succeeds("cues", speech_wav, "-o", tmp_path / "b.tsv")
    assert (tmp_path / "a.tsv").read_text() == (tmp_path / "b.tsv").read_text()


def test_words_of_a_textgrid_become_captions(speech_wav, tmp_path):
    words, phones = ([[0.7, 1.0, "Hello"]], [[0.7, 0.8, "HH"], [0.8, 1.0, "OW"]])
    tiers = {"words": {"entries": words}, "phones": {"entries": phones}}
    (tmp_path / "a.json").write_text(json.dumps({"tiers": tiers}))
    succeeds("phones", speech_wav, "--phones", tmp_path / "a.json", "-o", tmp_path / "a.TextGrid")
    succeeds("cues", speech_wav, "--phones", tmp_path / "a.TextGrid", "-o", tmp_path / "a.srt")
    assert (tmp_path / "a.srt").read_text() == "1\n00:00:00,700 --> 00:00:01,000\nHello\n"


def test_a_simple_character_and_another_frame_rate(speech_wav, tmp_path):
    succeeds("cues", speech_wav, "--basic", "-o", tmp_path / "a.tsv")
    assert set(shapes(tmp_path / "a.tsv")) <= set("ABCDEF")
    succeeds("cues", speech_wav, "--fps", "12", "-o", tmp_path / "a.dat")
    last = (tmp_path / "a.dat").read_text().splitlines()[-1]
    assert int(last.split()[0]) <= 12 * 10.7 + 1


def shapes(path):
    return [line.split("\t")[1] for line in path.read_text().splitlines()]


def test_what_is_refused_leaves_nothing(speech_wav, tmp_path):
    refused("cues", speech_wav, "-o", tmp_path / "a.srt", says="no words")
    refused("cues", speech_wav, "-o", tmp_path / "a.png", says="suffix '.png'")
    refused("phones", tmp_path / "no.wav", "-o", tmp_path / "a.csv", says="no such file")
    refused("phones", speech_wav, "-o", speech_wav.with_suffix(".lab"), says="allowed: .textgrid")
    assert not list(tmp_path.iterdir())


def test_tiers_and_texts_of_other_programs(speech_wav, tmp_path):
    (tmp_path / "a.csv").write_text(
        "Begin,End,Label,Type,Speaker\n0.3,0.4,m,phones,ann\n0.4,0.5,p,phones,bob\n"
    )
    given = ("phones", speech_wav, "--phones", tmp_path / "a.csv", "-o", tmp_path / "b.csv")
    refused(*given, says="name one with --speaker")
    succeeds(*given, "--speaker", "bob")
    assert (tmp_path / "b.csv").read_text().splitlines()[1:] == ["0.400,0.500,P"]
    refused(*given[:2], *given[4:], "--tier", "phones", says="--tier: no --phones")
    (tmp_path / "a.docx").write_bytes(b"PK\x03\x04")
    text = ("--text-file", tmp_path / "a.docx", "-o", tmp_path / "c.csv")
    refused("phones", speech_wav, *text, says="a Word document or another ZIP file")
