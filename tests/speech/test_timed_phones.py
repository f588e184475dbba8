"""When each phone of a speech is said, and how other programs read it."""

import json

import numpy as np
import pytest
from praatio import textgrid

import elocute
from elocute.encoders.phones_and_visemes import PHONE_TO_VISEME, PHONES
from elocute.errors import AlignmentError, InputError, OutputError
from elocute.speech.text.heard_phones import heard_phones
from elocute.speech.times.read import read_speech_times
from elocute.speech.times.write import TimedSpeech, write_speech_times
from tests.support.espeak import has_espeak

TEXT = (
    "Hello. Give me any voice, and I will give it a face. My mouth closes on p, b and m. "
    "Five wolves move through the blue fog. Now I rest."
)
FORMATS = (".TextGrid", ".ctm", ".csv", ".json")


@pytest.fixture(scope="module")
def heard(speech_wav):
    return elocute.find_phones(speech_wav)


@pytest.fixture(scope="module")
def aligned(speech_wav, need):
    need(has_espeak(), "espeak-ng")
    return elocute.find_phones(speech_wav, text=TEXT)


def test_phones_are_in_order_within_the_sound(heard):
    times = np.array([phone[:2] for phone in heard.phones])
    assert (np.diff(times.ravel()) >= -1e-9).all()
    assert times[0, 0] > 0.5 and times[-1, 1] <= heard.duration_s
    assert not heard.words and {label for *_, label in heard.phones} < set(PHONES)


def test_what_is_heard_agrees_with_the_text(heard, aligned):
    """By viseme, over time: an ear that heard nothing of it would agree by a tenth."""
    grid = np.arange(0, heard.duration_s, 0.01)
    one, other = visemes(heard, grid), visemes(aligned, grid)
    spoken = other != "sil"
    assert (one == other)[spoken].mean() > 0.6
    assert (one == other)[~spoken].mean() > 0.8


def visemes(speech: TimedSpeech, grid: np.ndarray) -> np.ndarray:
    found = np.full(len(grid), "sil", dtype=object)
    for start, end, phone in speech.phones:
        found[(grid >= start) & (grid < end)] = PHONE_TO_VISEME[phone]
    return found


def test_words_of_a_text(aligned):
    assert [word for *_, word in aligned.words][:4] == ["Hello", "Give", "me", "any"]
    assert [phone for *_, phone in aligned.phones_of(aligned.words[1])] == ["G", "IH", "V"]


def test_praat_s_tiers_as_another_program_reads_them(aligned, tmp_path):
    write_speech_times(aligned, tmp_path / "a.TextGrid")
    grid = textgrid.openTextgrid(str(tmp_path / "a.TextGrid"), includeEmptyIntervals=False)
    assert grid.tierNames == ("phones", "words")
    assert grid.maxTimestamp == pytest.approx(aligned.duration_s)
    for name, labels in (("phones", aligned.phones), ("words", aligned.words)):
        entries = grid.getTier(name).entries
        assert [entry.label for entry in entries] == [label for *_, label in labels]
        assert [float(entry[0]) for entry in entries] == pytest.approx(
            [start for start, *_ in labels]
        )


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("which", ["heard", "aligned"])
def test_each_format_is_read_back(request, which, suffix, tmp_path):
    speech = request.getfixturevalue(which)
    write_speech_times(speech, tmp_path / f"two words{suffix}")
    found = read_speech_times(tmp_path / f"two words{suffix}", "arpabet")
    assert [label for *_, label in found.phones] == [label for *_, label in speech.phones]
    apart = np.abs(np.subtract([p[:2] for p in found.phones], [p[:2] for p in speech.phones]))
    assert apart[:, 0].max() < 0.0021
    assert apart[:, 1].max() < 0.0221  # short gaps are closed where they are read


def test_known_times_are_kept(speech_wav, heard, tmp_path):
    write_speech_times(heard, tmp_path / "a.json")
    times = read_speech_times(tmp_path / "a.json")
    assert elocute.find_phones(speech_wav, times=times).phones == times.phones


def test_silence_has_no_phones(tmp_path):
    silent = elocute.find_phones(np.zeros(16000, np.float32), rate=16000)
    assert silent.phones == () and silent.duration_s == 1.0
    write_speech_times(silent, tmp_path / "a.json")
    assert json.loads((tmp_path / "a.json").read_text()) == {"duration": 1.0, "phones": []}


def test_a_phone_is_never_a_single_row():
    rows = np.full((30, 40), -6.0, np.float32)
    rows[:, 0] = -0.01
    rows[10, 5] = 0.0
    rows[20:23, 7] = 0.0
    rows[20:23, 0] = -8.0
    assert heard_phones(rows, 0.6) == [(0.4, 0.46, PHONES[7])]


def test_what_is_refused(speech_wav, heard, tmp_path):
    with pytest.raises(InputError, match="`text` too"):
        elocute.find_phones(speech_wav, text=TEXT, times=read_speech_times_of(heard, tmp_path))
    with pytest.raises(OutputError, match=r"allowed: \.TextGrid"):
        write_speech_times(heard, tmp_path / "a.lab")
    if has_espeak():
        with pytest.raises(AlignmentError, match="do not match"):
            elocute.find_phones(speech_wav, text="Quite another sentence stands here, says she.")


def read_speech_times_of(speech, folder):
    write_speech_times(speech, folder / "b.csv")
    return read_speech_times(folder / "b.csv")


SUBTITLES = """1
00:00:00,400 --> 00:00:01,400
HOST: Hello.

2
00:00:01,400 --> 00:00:04,000
Give me any voice, and I will give it a face.

3
00:00:04,000 --> 00:00:07,400
(smiles) My mouth closes on p, b and m.

4
00:00:07,400 --> 00:00:10,600
Five wolves move through the blue fog. Now I rest.
"""


def test_subtitles_are_a_text_with_times(speech_wav, aligned):
    found = elocute.find_phones(speech_wav, text=SUBTITLES)
    assert [word for *_, word in found.words] == [word for *_, word in aligned.words]
    for one, other in zip(found.words, aligned.words, strict=True):
        assert abs(one[0] - other[0]) < 0.1
    late = SUBTITLES.replace("00:00:07,400 --> 00:00:10,600", "00:01:07,400 --> 00:01:10,600")
    with pytest.raises(AlignmentError, match=r"word 'Five': after the end of the sound, 10\.\d+ s"):
        elocute.find_phones(speech_wav, text=late)


def test_a_script_is_heard_without_its_directions(speech_wav, aligned):
    script = "HOST: " + TEXT.replace("My mouth", "(sighs) My mouth") + " [applause]"
    found = elocute.find_phones(speech_wav, text=script)
    assert found.words == aligned.words
    assert found.notes[0] == "not taken for speech: 'HOST:', '[applause]', '(sighs)'"
