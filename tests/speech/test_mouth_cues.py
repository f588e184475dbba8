"""Pictures of a mouth for drawn characters, and captions, as other programs read them."""

import json
import re
import xml.etree.ElementTree as ElementTree

import pytest
import webvtt

from elocute.encoders.phones_and_visemes import PHONES
from elocute.errors import InputError, OutputError
from elocute.speech.cues.files import CueSheet, as_written, write_cues
from elocute.speech.cues.mouth_cues import SHAPE_OF, SHAPES, MouthCue, mouth_cues
from elocute.speech.times.write import TimedSpeech

MAP = ((0.5, 0.6, "M"), (0.6, 0.8, "AE"), (0.8, 0.9, "P"))


def cues(*phones, duration_s=1.2, basic=False):
    found = mouth_cues(TimedSpeech(phones, (), duration_s), basic=basic)
    return [(cue.start_s, cue.end_s, cue.shape) for cue in found]


def test_a_word_between_rests():
    assert cues(*MAP) == [
        (0.0, 0.5, "X"),
        (0.5, 0.6, "A"),
        (0.6, 0.8, "C"),
        (0.8, 0.9, "A"),
        (0.9, 1.2, "X"),
    ]


def test_every_phone_has_a_picture():
    assert set(SHAPE_OF) == set(PHONES) - {"SIL"}
    assert set(SHAPE_OF.values()) == set(SHAPES) - {"X"}


def test_a_short_pause_does_not_close_the_mouth():
    assert [shape for *_, shape in cues(*MAP[:2], (0.9, 1.0, "OW"))] == ["X", "A", "C", "F", "X"]


def test_a_long_diphthong_shows_both_its_halves():
    assert [shape for *_, shape in cues((0.2, 0.5, "AY"))] == ["X", "D", "B", "X"]
    assert [shape for *_, shape in cues((0.2, 0.3, "AY"))] == ["X", "D", "X"]


def test_nothing_flashes_but_lips_that_touch_are_seen():
    flash = cues((0.3, 0.5, "AA"), (0.5, 0.53, "S"), (0.53, 0.8, "OW"))
    assert [shape for *_, shape in flash] == ["X", "D", "F", "X"]
    touch = cues((0.3, 0.5, "AA"), (0.5, 0.52, "B"), (0.52, 0.8, "AA"))
    assert (0.48, 0.52, "A") in touch


def test_six_pictures_are_enough_for_a_simple_character():
    plain = cues((0.3, 0.4, "F"), (0.4, 0.5, "L"), (0.5, 0.6, "AA"), basic=True)
    assert [shape for *_, shape in plain] == ["A", "C", "D", "A"]


@pytest.mark.parametrize("duration_s", [0.001, 0.4])
def test_a_sound_without_speech_rests(duration_s):
    assert [shape for *_, shape in cues(duration_s=duration_s)] == ["X"]


@pytest.fixture
def sheet():
    words = [(0.5, 0.9, "Map"), (1.0, 1.4, "it"), (2.6, 3.0, "Now")]
    speech = TimedSpeech(MAP, tuple(words), 3.2)
    return CueSheet(mouth_cues(speech), words, "“Map it.” Now?", "a & b.wav")


def test_rhubarb_s_three_formats_say_the_same(sheet, tmp_path):
    for suffix in (".tsv", ".xml", ".json"):
        write_cues(sheet, tmp_path / f"mouth{suffix}")
    lines = (tmp_path / "mouth.tsv").read_text().splitlines()
    assert all(re.fullmatch(r"\d+\.\d\d\t[A-HX]", line) for line in lines)
    assert lines[0] == "0.00\tX" and lines[-1] == "3.20\tX"
    record = json.loads((tmp_path / "mouth.json").read_text())
    assert record["metadata"] == {"soundFile": "a & b.wav", "duration": 3.2}
    given = [
        (f"{cue['start']:.2f}", f"{cue['end']:.2f}", cue["value"]) for cue in record["mouthCues"]
    ]
    tree = ElementTree.parse(tmp_path / "mouth.xml")
    assert tree.findtext("metadata/soundFile") == "a & b.wav"
    assert [(c.get("start"), c.get("end"), c.text) for c in tree.iter("mouthCue")] == given
    assert [f"{start}\t{shape}" for start, _, shape in given] == lines[:-1]


def test_moho_s_frames_are_counted_from_one(sheet, tmp_path):
    write_cues(sheet, tmp_path / "mouth.dat")
    lines = (tmp_path / "mouth.dat").read_text().splitlines()
    assert lines == ["MohoSwitch1", "1 rest", "13 MBP", "15 E", "20 MBP", "23 rest"]


def test_captions_as_another_program_reads_them(sheet, tmp_path):
    for suffix, read in ((".srt", webvtt.from_srt), (".vtt", webvtt.read)):
        write_cues(sheet, tmp_path / f"captions{suffix}")
        found = [(c.start, c.end, c.text) for c in read(str(tmp_path / f"captions{suffix}"))]
        assert found == [
            ("00:00:00.500", "00:00:01.400", "“Map it.”"),
            ("00:00:02.600", "00:00:03.000", "Now?"),
        ]


def test_a_long_sentence_takes_two_lines(tmp_path):
    words = [(k * 0.3, k * 0.3 + 0.3, word) for k, word in enumerate(("fog", "wolves") * 6)]
    write_cues(CueSheet([MouthCue(0, 4, "X")], words), tmp_path / "long.vtt")
    (caption,) = webvtt.read(str(tmp_path / "long.vtt"))
    assert [len(line) for line in caption.lines] == [32, 32]


def test_letters_of_chinese_are_wide_and_have_no_spaces(tmp_path):
    text = "今日はとても良い天気ですね、明日もきっと晴れるでしょう。"
    words = [
        (k * 0.1, k * 0.1 + 0.1, letter) for k, letter in enumerate(text) if letter not in "、。"
    ]
    write_cues(CueSheet([MouthCue(0, 4, "X")], words, text), tmp_path / "a.vtt")
    (caption,) = webvtt.read(str(tmp_path / "a.vtt"))
    assert caption.lines == ["今日はとても良い天気ですね、", "明日もきっと晴れるでしょう。"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("今日", "は。", "明日"), "今日は。明日"),
        (("你好", "世界"), "你好世界"),
        (("สวัสดี", "ครับ"), "สวัสดีครับ"),
        (("안녕", "세상"), "안녕 세상"),
        (("Guten", "Tag,", "世界"), "Guten Tag, 世界"),
    ],
)
def test_words_without_their_text_stand_as_their_script_is_written(tmp_path, words, said):
    timed = [(k * 0.1, k * 0.1 + 0.1, word) for k, word in enumerate(words)]
    write_cues(CueSheet([MouthCue(0, 1, "X")], timed), tmp_path / "a.vtt")
    (caption,) = webvtt.read(str(tmp_path / "a.vtt"))
    assert caption.text == said


def test_a_word_that_the_text_lacks_stands_as_it_is():
    assert as_written([(0, 1, "two"), (1, 2, "wolves")], "2 wolves!") == [
        (0, 1, "two"),
        (1, 2, "wolves"),
    ]


def test_markup_in_a_text_is_text(tmp_path):
    words = [(0.0, 0.5, "<b>"), (0.5, 1.0, "-->")]
    write_cues(CueSheet([MouthCue(0, 1, "X")], words), tmp_path / "a.vtt")
    assert "&lt;b&gt; →" in (tmp_path / "a.vtt").read_text()


def test_what_cannot_be_written_is_said(sheet, tmp_path):
    with pytest.raises(OutputError, match=r"suffix '\.doc'; allowed: \.tsv"):
        write_cues(sheet, tmp_path / "a.doc")
    with pytest.raises(InputError, match="no words; allowed: a speech whose `text` is known"):
        write_cues(CueSheet([MouthCue(0, 1, "X")]), tmp_path / "a.srt")
    assert not list(tmp_path.iterdir())
