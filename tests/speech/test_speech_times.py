"""Times of phones and words from files as other programs write them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from elocute.cli.known_speech_options import KnownSpeechOptions
from elocute.errors import InputError
from elocute.settings import KEY
from elocute.speech.phone_symbols import ALPHABETS
from elocute.speech.times.read import SpeechTimes, read_speech_times

# Laid out as MFA 3 writes them: two tiers, gaps as empty intervals, ARPAbet with stress.
MFA_GRID = """File type = "ooTextFile"
Object class = "TextGrid"

xmin = 0
xmax = 1.2
tiers? <exists>
size = 2
item []:
    item [1]:
        class = "IntervalTier"
        name = "words"
        xmin = 0
        xmax = 1.2
        intervals: size = 3
        intervals [1]:
            xmin = 0
            xmax = 0.31
            text = ""
        intervals [2]:
            xmin = 0.31
            xmax = 0.8
            text = "map"
        intervals [3]:
            xmin = 0.8
            xmax = 1.2
            text = ""
    item [2]:
        class = "IntervalTier"
        name = "phones"
        xmin = 0
        xmax = 1.2
        intervals: size = 5
        intervals [1]:
            xmin = 0
            xmax = 0.31
            text = "sil"
        intervals [2]:
            xmin = 0.31
            xmax = 0.42
            text = "M"
        intervals [3]:
            xmin = 0.42
            xmax = 0.66
            text = "AE1"
        intervals [4]:
            xmin = 0.66
            xmax = 0.8
            text = "P"
        intervals [5]:
            xmin = 0.8
            xmax = 1.2
            text = "spn"
"""
MAP = ((0.31, 0.42, "M"), (0.42, 0.66, "AE"), (0.66, 0.8, "P"))


def read(folder: Path, name: str, text: str | bytes, **options: str) -> SpeechTimes:
    path = folder / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_speech_times(path, **options)


def rounded(times: SpeechTimes) -> list[tuple[float, float, str]]:
    return [(round(start, 4), round(end, 4), phone) for start, end, phone in times.phones]


def test_mfa_writes_a_textgrid_of_words_and_phones(tmp_path):
    times = read(tmp_path, "speech.TextGrid", MFA_GRID)
    assert times.phones == MAP and times.alphabet == "arpabet"
    assert times.unknown == ((0.8, 1.2),), "spoken noise is nobody's phone"
    assert times.notes == ("unknown phones, 1 times, are left to the encoder",)


def test_mfa_writes_ipa_json_and_csv_too(tmp_path):
    entries = [[0.31, 0.42, "m"], [0.42, 0.66, "æ"], [0.66, 0.8, "pʰ"]]
    tiers = {
        "words": {"type": "interval", "entries": [[0.31, 0.8, "map"]]},
        "phones": {"type": "interval", "entries": entries},
    }
    record = json.dumps({"start": 0, "end": 1.2, "tiers": tiers})
    assert read(tmp_path, "speech.json", record).phones == MAP
    rows = "".join(f"{a},{b},{c},phones,ann\n" for a, b, c in entries)
    table = f"Begin,End,Label,Type,Speaker\n0.31,0.8,map,words,ann\n{rows}"
    assert read(tmp_path, "speech.csv", table).phones == MAP


@pytest.mark.parametrize(
    ("symbols", "alphabet"),
    [("M AE1 P", "arpabet"), ("m æ p", "ipa"), ("m { p_h", "x-sampa"), ("m_B ae_I p_E", "arpabet")],
)
def test_a_ctm_in_any_alphabet(tmp_path, symbols, alphabet):
    spans = [(0.31, 0.11), (0.42, 0.24), (0.66, 0.14)]
    lines = [f"talk 1 {a} {b} {p}" for (a, b), p in zip(spans, symbols.split(), strict=True)]
    times = read(tmp_path, "talk.ctm", ";; a comment\n" + "\n".join(lines))
    assert rounded(times) == list(MAP) and times.alphabet == alphabet


def test_of_several_recordings_in_a_ctm_the_one_of_the_sound(tmp_path):
    text = "one 1 0.1 0.2 M\none 1 0.3 0.1 IY\ntwo 1 0.5 0.2 P\n"
    assert rounded(read(tmp_path, "all.ctm", text, stem="two")) == [(0.5, 0.7, "P")]
    with pytest.raises(InputError, match=r"one 1, two 1; allowed: one"):
        read(tmp_path, "all.ctm", text)


def test_words_alone_are_words(tmp_path):
    times = read(tmp_path, "w.ctm", "talk 1 0.31 0.4 my\ntalk 1 0.8 0.3 map\ntalk 1 1.2 0.3 fell\n")
    assert not times.phones and [word for _, _, word in times.words] == ["my", "map", "fell"]


def test_azure_gives_visemes_in_ticks_and_blend_shapes_after_them(tmp_path):
    events = [
        (500_000, 0),
        (1_000_000, 21),
        (2_100_000, 1),
        (4_000_000, 21),
        (5_000_000, 0),
        (0, 0),
    ]
    python = [{"audio_offset": at, "viseme_id": viseme} for at, viseme in events]
    expected = [(0.1, 0.21, "P"), (0.21, 0.4, "AH"), (0.4, 0.5, "P")]
    assert rounded(read(tmp_path, "a.json", json.dumps(python))) == expected
    sharp = [json.dumps({"AudioOffset": at, "VisemeId": v, "Animation": ""}) for at, v in events]
    assert rounded(read(tmp_path, "a.jsonl", "\n".join(sharp))) == expected


@pytest.mark.parametrize(("unit", "name"), [(1e-7, "SDK, ticks"), (1e-3, "batch synthesis, ms")])
def test_azure_gives_words_in_two_units(tmp_path, unit, name):
    words = [("my", 0.3, 0.2), ("map", 0.5, 0.4)]
    events = [
        {"Text": word, "AudioOffset": round(at / unit), "Duration": round(long / unit)}
        for word, at, long in words
    ]
    times = read(tmp_path, "w.json", json.dumps(events))
    assert [(round(a, 3), round(b, 3), w) for a, b, w in times.words] == [
        (0.3, 0.5, "my"),
        (0.5, 0.9, "map"),
    ], name


def test_azure_assesses_pronunciation_phone_by_phone(tmp_path):
    phones = [("m", 0.31, 0.11), ("ae", 0.42, 0.24), ("p", 0.66, 0.14)]
    inner = [
        {"Phoneme": p, "Offset": round(a * 1e7), "Duration": round(b * 1e7)} for p, a, b in phones
    ]
    word = {"Word": "map", "Offset": 3_100_000, "Duration": 4_900_000, "Phonemes": inner}
    times = read(tmp_path, "n.json", json.dumps({"NBest": [{"Words": [word]}]}))
    assert rounded(times) == list(MAP)


def test_polly_gives_speech_marks_a_line_each(tmp_path):
    marks = [
        {"time": 0, "type": "sentence", "start": 0, "end": 7, "value": "My map."},
        {"time": 6, "type": "word", "start": 0, "end": 2, "value": "My"},
        {"time": 6, "type": "viseme", "value": "p"},
        {"time": 90, "type": "viseme", "value": "a"},
        {"time": 250, "type": "viseme", "value": "p"},
        {"time": 400, "type": "viseme", "value": "sil"},
    ]
    times = read(tmp_path, "speech.marks", "\n".join(map(json.dumps, marks)))
    assert times.phones == ((0.006, 0.09, "P"), (0.09, 0.25, "AA"), (0.25, 0.4, "P"))


@pytest.mark.parametrize(
    "record",
    [
        {"segments": [{"words": [{"word": " my", "start": 0.3, "end": 0.5}]}]},
        {"words": [{"word": "my", "start": 0.3, "end": 0.5}]},
        {"format": "elocute-words", "words": [{"word": "my", "start_s": 0.3, "end_s": 0.5}]},
        {
            "characters": ["m", "y", " "],
            "character_start_times_seconds": [0.3, 0.4, 0.5],
            "character_end_times_seconds": [0.4, 0.5, 0.6],
        },
    ],
)
def test_words_of_recognisers_and_voices(tmp_path, record):
    assert read(tmp_path, "w.json", json.dumps(record)).words == ((0.3, 0.5, "my"),)


def test_gentle_gives_the_phones_of_the_words_that_it_found(tmp_path):
    phones = [("m_B", 0.11), ("ae_I", 0.24), ("p_E", 0.14)]
    found = {"word": "map", "start": 0.31, "end": 0.8, "case": "success"}
    found["phones"] = [{"phone": phone, "duration": long} for phone, long in phones]
    missed = {"word": "blorfit", "case": "not-found-in-audio"}
    record = {"words": [found, missed, {**found, "start": 1.1, "end": 1.59}]}
    times = read(tmp_path, "g.json", json.dumps(record))
    assert rounded(times)[:3] == list(MAP) and len(times.phones) == 6
    assert times.words[1] == (0.8, 1.1, "blorfit") and times.unknown == ((0.8, 1.1),)
    assert times.notes[0] == "words without times, 1 (blorfit), are looked for in between"


def test_small_overlaps_meet_and_small_gaps_close(tmp_path):
    text = "start_s,end_s,phone\n0.1,0.22,M\n0.2,0.3,AA1\n0.31,0.4,p\n0.6,0.7,T\n"
    times = read(tmp_path, "p.csv", text)
    assert rounded(times) == [
        (0.1, 0.21, "M"),
        (0.21, 0.31, "AA"),
        (0.31, 0.4, "P"),
        (0.6, 0.7, "T"),
    ]
    assert times.notes == ("phones that overlap, 1 times, meet in the middle",)


def test_times_beyond_the_sound(tmp_path):
    times = read(tmp_path, "p.csv", "start_s,end_s,phone\n0.1,0.5,M\n0.5,1.1,AA\n1.1,1.2,P\n")
    assert times.check(1.3) == []
    assert times.check(1.0) == ["2 phones end after the sound, and are cut"]
    with pytest.raises(InputError, match=r"until 1.20 s, in a sound of 0.80 s"):
        times.check(0.8)


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("a.csv", "start_s,end_s,phone\n0.3,0.2,AA\n", "row 2: 0.3,0.2,AA"),
        ("a.csv", "a,b\n", "first row a,b"),
        ("a.csv", "start_s,end_s,phone\n0,nan,AA\n", "row 2"),
        (
            "a.csv",
            "start_s,end_s,phone\n0,1,XQ\n1,2,QX\n2,3,AA\n",
            r"symbol 'XQ': unknown in arpabet.*nearest",
        ),
        ("a.csv", "start_s,end_s,phone\n0,1,AA\n0.5,2,P\n", "in AA, which lasts until 1.000 s"),
        ("a.ctm", "talk 1 0.1 x P\n", "line 1"),
        ("a.ctm", "talk 1 0.1 -1 P\n", "line 1"),
        ("a.json", "{}", "allowed: visemes of Azure"),
        ("a.json", '[{"viseme_id": 3}]', "offset of a viseme"),
        ("a.json", '[{"viseme_id": 77, "audio_offset": 1}]', "symbol '77': unknown in azure"),
        ("a.json", '{"words": 7}', "int; allowed: a list"),
        ("a.json", '{"words": [{"word": 7, "start": 0, "end": 1}]}', "label 7"),
        ("a.json", '{"segments": [{"text": "hi"}]}', "segments without words"),
        ("a.json", '{"words": [{"word": "a", "start": 1e999, "end": 1}]}', "no JSON"),
        ("a.jsonl", '{"time": 1, "type": "viseme", "value": "zz"}\n{"time": 2}\n', "records of"),
        ("a.bin", b"\x80\x81\x82\x83", "byte 0 is not UTF-8; .*; save it in UTF-8"),
        ("a.txt", "", "an empty file"),
        ("a.TextGrid", 'File type = "ooTextFile"\nObject class = "TextGrid"\n', "an early end"),
    ],
)
def test_what_cannot_be_used_is_refused_in_one_line(tmp_path, name, text, says):
    with pytest.raises(InputError, match=says) as caught:
        read(tmp_path, name, text)
    assert "\n" not in str(caught.value) and str(tmp_path / name) in str(caught.value)
    assert len(str(caught.value)) < 700


def test_symbols_that_nobody_knows_are_left_to_the_encoder(tmp_path):
    times = read(tmp_path, "a.csv", "start_s,end_s,phone\n0,1,M\n1,2,XQ\n2,3,AA\n")
    assert times.phones == ((0.0, 1.0, "M"), (2.0, 3.0, "AA")) and times.unknown == ((1.0, 2.0),)
    assert times.notes[1].startswith("unknown in arpabet: 'XQ' (nearest to 'XQ': ")


@pytest.mark.parametrize(
    "text",
    [
        "start_s;end_s;phone\n0,31;0,42;M\n0,42;0,66;AE1\n0,66;0,8;P\n",
        "sep=;\nid;phone;start;end\n1;M;0.31;0.42\n2;AE1;0.42;0.66\n3;P;0.66;0.8\n",
        "Start\tEnd\tPhone\tNotes\n0.31\t0.42\tM\t\n0.42\t0.66\tAE1\tloud\n0.66\t0.8\tP\t\n",
        "phone,start_ms,duration_ms\nM,310,110\nAE1,420,240\nP,660,140\n",
        "tmin,tier,text,tmax\n0.31,phones,M,0.42\n0.42,phones,AE1,0.66\n0.66,phones,P,0.8\n",
    ],
)
def test_tables_of_excel_praat_and_people(tmp_path, text):
    assert rounded(read(tmp_path, "a.csv", text)) == list(MAP)
    assert rounded(read(tmp_path, "b.csv", text.encode("utf-16"))) == list(MAP)


def test_a_fault_in_a_table_names_its_row_and_column(tmp_path):
    with pytest.raises(InputError, match="row 3, column end_s: 'x'; allowed: a time from 0"):
        read(tmp_path, "a.csv", "start_s,end_s,phone\n0,1,M\n1,x,AA\n")


def test_subtitles_are_words_with_the_time_of_their_line(tmp_path):
    text = "1\n00:00:00,300 --> 00:00:00,800\nMy map.\n"
    assert read(tmp_path, "a.srt", text).words == ((0.3, 0.8, "My"), (0.3, 0.8, "map"))


def test_times_in_the_wrong_unit_are_noticed(tmp_path):
    events = [{"audio_offset": 80 * at, "viseme_id": 1 + at % 20} for at in range(60)]
    times = read(tmp_path, "ms.json", json.dumps(events))
    assert times.end_s == pytest.approx(59 * 0.08 + 0.15) and "milliseconds" in times.notes[0]
    rows = "".join(f"{at / 1e4},{(at + 1) / 1e4},M\n" for at in range(60))
    with pytest.raises(InputError, match="60 phones in"):
        read(tmp_path, "fast.csv", f"start_s,end_s,phone\n{rows}")


def test_a_named_alphabet_is_taken_at_its_word(tmp_path):
    text = "start_s,end_s,phone\n0,1,S\n1,2,T\n"
    assert [p for _, _, p in read(tmp_path, "a.csv", text).phones] == ["S", "T"]
    said = read(tmp_path, "a.csv", text, alphabet="x-sampa")
    assert [p for _, _, p in said.phones] == ["SH", "TH"]
    with pytest.raises(InputError, match=r"phone set: 'klingon'; allowed: auto, arpabet"):
        read(tmp_path, "a.csv", text, alphabet="klingon")


def test_every_alphabet_is_named_where_one_is_chosen():
    option = KnownSpeechOptions.__dataclass_fields__["phone_set"].metadata[KEY]
    for told in (option.help, read_speech_times.__doc__ or ""):
        assert [each for each in ALPHABETS if each not in told] == []


def test_phone_times_are_read_and_checked(tmp_path):
    path = tmp_path / "phones.csv"
    path.write_text("start_s,end_s,phone\n0.1,0.2,AA1\n0.2,0.3,p\n")
    assert read_speech_times(path).phones == ((0.1, 0.2, "AA"), (0.2, 0.3, "P"))
    path.write_text("start_s,end_s,phone\n0.3,0.2,AA\n")
    with pytest.raises(InputError, match="row 2"):
        read_speech_times(path)
    path.write_text("a,b\n")
    with pytest.raises(InputError, match="first row"):
        read_speech_times(path)
    with pytest.raises(InputError, match="no such file"):
        read_speech_times(tmp_path / "none.csv")


def test_the_short_form_of_old_versions_of_praat_which_p2fa_writes(tmp_path):
    rows = '"IntervalTier"\n"phone"\n0\n1\n2\n0\n0.4\n"P"\n0.4\n1\n"AE1"\n'
    grid = f'File type = "ooTextFile short"\n"TextGrid"\n\n0\n1\n<exists>\n1\n{rows}'
    assert read(tmp_path, "a.TextGrid", grid).phones == ((0.0, 0.4, "P"), (0.4, 1.0, "AE"))
