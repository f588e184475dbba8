"""Words of a reading: found from the text, checked by eye, taken back from Praat."""

from __future__ import annotations

import json
import re
import resource
from pathlib import Path

import numpy as np
import pytest

from elocute.audio.waveform import Waveform
from elocute.errors import AlignmentError
from elocute.speech.text.word_times import (
    TimedWord,
    TimedWords,
    merge_edits,
    read_words,
    write_words,
)
from tests.support.commands import refused, succeeds

TEXT = (
    "Hello. Give me any voice, and I will give it a face. My mouth closes on p, b and m. "
    "Five wolves move through the blue fog. Now I rest."
)
# Where Festival spoke them: first and last phone of `speak` in recipes/example.py.
TRUE_S = {
    "hello": (0.665, 1.015),
    "voice": (2.155, 2.62),
    "face": (3.47, 3.94),
    "mouth": (4.42, 4.705),
    "wolves": (7.215, 7.565),
    "fog": (8.37, 8.765),
    "rest": (9.51, 9.9),
}


@pytest.fixture(scope="module")
def segmented(speech_wav: Path) -> TimedWords:
    pytest.importorskip("pocketsphinx", reason="needs the extra `wild`")
    from elocute.audio.read import read_audio
    from elocute.speech.text.forced_alignment import segment_words

    return segment_words(read_audio(speech_wav), TEXT)


def test_words_are_found_where_they_are_said(segmented: TimedWords):
    assert segmented.text == "hello " + " ".join(re.findall(r"[a-z]+", TEXT.lower())[1:])
    by_text = {word.text: word for word in segmented.words}
    for text, (start, end) in TRUE_S.items():
        assert abs(by_text[text].start_s - start) < 0.05, by_text[text]
        assert abs(by_text[text].end_s - end) < 0.05, by_text[text]
    assert np.mean([word.confidence for word in segmented.words]) > 0.4


def test_what_cannot_be_aligned_is_refused(speech_wav: Path):
    pytest.importorskip("pocketsphinx", reason="needs the extra `wild`")
    from elocute.audio.read import read_audio
    from elocute.speech.text.forced_alignment import segment_words

    speech = read_audio(speech_wav)
    for text, missing in (("Call 911 at noon", "911"), ("the café", "café")):
        with pytest.raises(AlignmentError, match=f"no pronunciation of {missing}"):
            segment_words(speech, text)
    with pytest.raises(AlignmentError, match="no pronunciation of blorfit"):
        segment_words(speech, "hello blorfit")
    strange = "seven elephants crossed an angry river because tomorrow nobody will remember"
    with pytest.raises(AlignmentError, match="words that do not match the sound"):
        segment_words(speech, strange)
    with pytest.raises(AlignmentError, match="silence"):
        segment_words(Waveform(np.zeros(16000, np.float32), 16000), "hello")
    with pytest.raises(AlignmentError, match="do not fit into"):
        segment_words(Waveform(speech.samples[16000:20000], speech.sample_rate), TEXT)
    with pytest.raises(AlignmentError, match="0 words"):
        segment_words(speech, "... !")


ODD = TimedWords((TimedWord('say "ah"', 0.1, 0.5, 0.25), TimedWord("Zoë", 0.5, 0.75)), 1.0)
SHORT = '''File type = "ooTextFile"
Object class = "TextGrid"

0
1.0
<exists>
2
"TextTier"
"marks"
0
1.0
1
0.3
"!"
"IntervalTier"
"words"
0
1.0
4
0
0.1
""
0.1
0.5
"say ""ah"""
0.5
0.75
"Zoë"
0.75
1.0
" "
'''


@pytest.mark.parametrize("name", ["w.json", "w.TextGrid"])
def test_files_come_back_as_they_were(tmp_path: Path, name: str):
    write_words(ODD, tmp_path / name)
    again = read_words(tmp_path / name)
    assert [(w.text, w.start_s, w.end_s) for w in again.words] == [
        (w.text, w.start_s, w.end_s) for w in ODD.words
    ]
    assert again.duration_s == 1.0
    assert merge_edits(again, ODD) == ODD


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be"])
def test_praats_short_form_in_every_encoding(tmp_path: Path, encoding: str):
    mark = "\ufeff" if encoding == "utf-16-be" else ""
    path = tmp_path / "p.TextGrid"
    path.write_bytes((mark + SHORT.replace("\n", "\r\n")).encode(encoding))
    assert merge_edits(read_words(path), ODD) == ODD


def test_what_a_person_moved_is_sure(tmp_path: Path):
    moved = TimedWords((TimedWord('say "ah"', 0.12, 0.5), TimedWord("Zoë", 0.5, 0.75)), 1.0)
    assert [w.confidence for w in merge_edits(moved, ODD).words] == [1.0, 1.0]


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (("0.5\n0.75", "0.4\n0.75"), "in 'say"),
        (("0.5\n0.75", "0.75\n0.5"), "start < end"),
        (('"words"', '"phones"'), None),  # the only interval tier: taken
        (("<exists>", "<absent>"), "no tiers"),
        (("\n4\n", "\n9\n"), "an early end"),
        (("\n4\n", "\n1e300\n"), "items"),
        (('0.75\n"Zoë"', '1.5\n"Zoë"'), "length of the sound"),
        (("ooTextFile", "ooBinaryFile"), "another kind of file"),
    ],
)
def test_damaged_textgrids(tmp_path: Path, damage: tuple[str, str], says: str | None):
    path = tmp_path / "p.TextGrid"
    assert damage[0] in SHORT
    path.write_text(SHORT.replace(*damage), encoding="utf-8")
    if says is None:
        assert len(read_words(path).words) == 2
        return
    with pytest.raises(AlignmentError, match=says):
        read_words(path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        '{"format": "elocute-words", "version": 2}',
        "[" * 100_000,
        '{"format": "elocute-words", "version": 1, "duration_s": 1, "words": [{"word": "a", '
        '"start_s": NaN, "end_s": 1, "confidence": 1}]}',
    ],
)
def test_damaged_json(tmp_path: Path, text: str):
    path = tmp_path / "w.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(AlignmentError, match=r"w\.json"):
        read_words(path)


def test_commands(tmp_path: Path, speech_wav: Path, segmented: TimedWords):
    def call(*arguments: object) -> dict[str, object]:
        return json.loads(succeeds("words", *arguments, "--json").stdout)

    words, page, grid = (tmp_path / name for name in ("w.json", "p.html", "w.TextGrid"))
    told = call("segment", speech_wav, "--text", TEXT, "-o", words)
    assert told["words"] == len(segmented.words) and read_words(words) == segmented
    told = call("check", words, speech_wav, "-o", page, "--textgrid", grid)
    text = page.read_text(encoding="utf-8")
    assert text.count('<button class="word') >= len(segmented.words)
    assert text.count("doubtful") and told["marked"] == len(
        set(re.findall(r'class="word doubtful" data-word="(\d+)"', text))
    )
    assert "@" not in re.sub(r"data:[^\"]*", "", text) and "http" not in text
    edited = grid.read_text(encoding="utf-8").replace('"hello"', '"Hello"')
    grid.write_text(edited, encoding="utf-8")
    call("take", grid, "-o", tmp_path / "edited.json", "--before", words)
    assert read_words(tmp_path / "edited.json").words[0] == TimedWord(
        "Hello", segmented.words[0].start_s, segmented.words[0].end_s, 1.0
    )
    other = tmp_path / "short.wav"
    import soundfile

    soundfile.write(other, np.zeros(16000), 16000)
    refused("words", "check", words, other, "-o", tmp_path / "q.html", says="as the words say")


@pytest.mark.parametrize(
    "number", ["1e999", "NaN", "-Infinity", "9" * 400, "9" * 9000, "true", '"1"']
)
@pytest.mark.parametrize("field", ["start_s", "end_s", "confidence", "duration_s"])
def test_times_that_are_no_numbers(tmp_path: Path, field: str, number: str):
    path = tmp_path / "a.json"
    write_words(TimedWords((TimedWord("one", 0.1, 0.2),), 1.0), path)
    path.write_text(re.sub(rf'"{field}": [0-9.]+', f'"{field}": {number}', path.read_text()))
    with pytest.raises(AlignmentError) as caught:
        read_words(path)
    assert str(path) in str(caught.value)
    assert len(str(caught.value)) < 600


BEGINNING = 'File type = "ooTextFile"\nObject class = "TextGrid"\n0\n9\n<exists>\n'


@pytest.mark.parametrize(
    ("rest", "says"),
    [
        ('1\n"IntervalTier"\n"words"\n0\n9\n1\n0\n9\n"' + "a" * 3_000_000, "an early end"),
        ('1\n"IntervalTier"\n"words"\n0\n9\n1\n0\n9\n"' + '"' * 3_000_001, "letters"),
        ("2000\n", "2000 tiers"),
        ('2\n"TextTier"\n"a"\n0\n9\n0\n"IntervalTier"\n"words"\n0\n9\n1000001\n', "all together"),
        ("20\n" + '"TextTier"\n"a"\n0\n9\n0\n' * 20, "'a', …; allowed"),
    ],
)
def test_textgrids_that_ask_for_much(tmp_path: Path, rest: str, says: str):
    """Refused in a line, without a hundred times the memory of the text."""
    (tmp_path / "a.TextGrid").write_text(BEGINNING + rest)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(AlignmentError, match=says) as caught:
        read_words(tmp_path / "a.TextGrid")
    assert len(str(caught.value)) < 400
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 60_000
