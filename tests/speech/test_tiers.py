"""Tiers of TextGrids by the names that aligners and people give them."""

from __future__ import annotations

import re

import pytest

from elocute.errors import ElocuteWarning, InputError
from elocute.speech.times.read import SpeechTimes, read_speech_times
from elocute.speech.times.textgrid import TextGridInterval, format_textgrid, parse_tiers

PHONES = [(0.3, 0.4, "m"), (0.4, 0.6, "a"), (0.6, 0.7, "p"), (0.7, 0.9, "a")]
MAPA = [(0.3, 0.4, "M"), (0.4, 0.6, "AA"), (0.6, 0.7, "P"), (0.7, 0.9, "AA")]
WORD = [(0.3, 0.9, "mapa")]
OTHER = [(1.0, 1.2, "b"), (1.2, 1.4, "o")]


def grid(folder, *tiers, **options) -> SpeechTimes:
    """Tiers of one name can be there twice, so each is formatted alone."""
    parts = [
        format_textgrid({name: [TextGridInterval(*row) for row in rows]}, 3.0)
        for name, rows in tiers
    ]
    head = parts[0].split("    item [1]:")[0].replace("size = 1", f"size = {len(tiers)}")
    text = head + "".join("    item [1]:" + part.split("    item [1]:")[1] for part in parts)
    path = folder / "a.TextGrid"
    path.write_text(text, encoding="utf-8")
    return read_speech_times(path, **options)


@pytest.mark.parametrize(
    "tiers",
    [
        pytest.param(
            [
                ("ORT-MAU", WORD),
                ("KAN-MAU", WORD),
                ("KAS-MAU", WORD),
                ("MAU", PHONES),
                ("MAS", WORD),
                ("TRN", WORD),
            ],
            id="WebMAUS",
        ),
        pytest.param(
            [
                ("PhonAlign", PHONES),
                ("TokensAlign", WORD),
                ("PhnTokAlign", WORD),
                ("SyllAlign", WORD),
            ],
            id="SPPAS",
        ),
        pytest.param([("participant", WORD), ("phones", PHONES)], id="ipa in participant"),
        pytest.param([("phones", PHONES), ("phones corrected by ann", OTHER)], id="the exact name"),
        pytest.param([("word", WORD), ("phone", PHONES)], id="P2FA"),
        pytest.param([("ann - words", WORD), ("ann - phones", PHONES)], id="MFA, one speaker"),
        pytest.param(
            [("ann - words", WORD), ("ann - phones", PHONES), ("bob - phones", [])],
            id="MFA, one speaks",
        ),
        pytest.param([("Utterance", WORD), ("IPA", PHONES)], id="by hand"),
    ],
)
def test_the_tier_of_phones_is_found(tmp_path, tiers):
    times = grid(tmp_path, *tiers)
    assert [(round(a, 3), round(b, 3), p) for a, b, p in times.phones] == MAPA


def test_the_words_of_the_same_speaker_come_with_the_phones(tmp_path):
    assert grid(tmp_path, ("MAU", PHONES), ("KAN-MAU", OTHER), ("ORT-MAU", WORD)).words == (
        tuple(WORD)
    )
    both = [("ann - words", WORD), ("ann - phones", PHONES), ("bob - phones", OTHER)]
    assert grid(tmp_path, *both, speaker="ann").words == tuple(WORD)
    assert grid(tmp_path, *both, tier="bob - phones").words == ()


def test_words_where_there_are_no_phones(tmp_path):
    assert grid(tmp_path, ("participant", WORD), ("ORT-MAU", WORD)).words == tuple(WORD)
    assert grid(tmp_path, ("KAN-MAU", [(0.3, 0.9, "m a p a")]), ("ORT-MAU", WORD)).words == (
        tuple(WORD)
    )


def test_of_several_tiers_one_is_named(tmp_path):
    same = [("phones", PHONES), ("phones", OTHER)]
    with pytest.raises(InputError, match="1 'phones', 2 'phones'; allowed: one of them; name it"):
        grid(tmp_path, *same)
    with pytest.raises(
        InputError, match=r"2 tiers of the name; allowed: .* 1 'phones', 2 'phones'"
    ):
        grid(tmp_path, *same, tier="phones")
    assert [p for *_, p in grid(tmp_path, *same, tier="2").phones] == ["B", "OW"]
    both = [("ann - phones", PHONES), ("bob - phones", OTHER)]
    with pytest.raises(InputError, match="1 'ann - phones', 2 'bob - phones'"):
        grid(tmp_path, *both)
    assert [p for *_, p in grid(tmp_path, *both, speaker="Bob").phones] == ["B", "OW"]
    assert [p for *_, p in grid(tmp_path, *both, tier="ann - phones").phones] == [
        "M",
        "AA",
        "P",
        "AA",
    ]
    with pytest.raises(InputError, match="`speaker` 'eve'"):
        grid(tmp_path, *both, speaker="eve")


def test_a_speaker_of_a_table(tmp_path):
    path = tmp_path / "mfa.csv"
    rows = "0.3,0.4,m,phones,ann\n0.4,0.5,p,phones,bob\n"
    path.write_text("Begin,End,Label,Type,Speaker\n" + rows)
    with pytest.raises(InputError, match="speakers: ann, bob"):
        read_speech_times(path)
    assert read_speech_times(path, speaker="bob").phones == ((0.4, 0.5, "P"),)


def test_tiers_without_labels_are_said_to_be_empty(tmp_path):
    with pytest.raises(InputError, match="tiers: all empty: 1 'words', 2 'phones'"):
        grid(tmp_path, ("words", []), ("phones", []))


def test_a_file_without_tiers_has_none_to_name(tmp_path):
    path = tmp_path / "a.ctm"
    path.write_text("talk 1 0.1 0.2 M\n")
    with pytest.raises(InputError, match="`tier`: 'phones'; allowed: none"):
        read_speech_times(path, tier="phones")


def test_times_that_round_below_zero(tmp_path):
    grid(tmp_path, ("phones", PHONES))
    path = tmp_path / "a.TextGrid"
    path.write_text(path.read_text().replace("xmin = 0\n", "xmin = -0.01\n"))
    assert [p for *_, p in read_speech_times(path).phones] == ["M", "AA", "P", "AA"]


@pytest.mark.parametrize("told", [0, 2])
def test_intervals_that_mfa_did_not_count_are_read(tmp_path, told):
    tiers = {"words": WORD, "phones": PHONES}
    rows = {name: [TextGridInterval(*row) for row in each] for name, each in tiers.items()}
    text = format_textgrid(rows, 3.0)
    (tmp_path / "a.TextGrid").write_text(re.sub("intervals: size = .*", f"size = {told}", text))
    assert read_speech_times(tmp_path / "a.TextGrid").phones == tuple(MAPA)


def test_times_of_a_part_of_a_longer_sound_are_told():
    text = format_textgrid({"phones": [TextGridInterval(*row) for row in PHONES]}, 3.0)
    with pytest.warns(ElocuteWarning, match="begin at 0.2 s, not at 0"):
        tiers, _ = parse_tiers(text.replace("xmin = 0\n", "xmin = 0.2\n").encode())
    assert [row.start_s for row in tiers[0][1] or () if row.text] == [row[0] for row in PHONES]


def test_hairlines_are_closed_where_a_textgrid_is_written():
    """Sums of times differ in their last digits, and rests of a microsecond came of it."""
    rows = [(0.00001, 0.1 + 0.2, "a"), (0.3, 0.39995, "b"), (0.4, 0.7, "c"), (0.9, 0.9999, "d")]
    text = format_textgrid({"phones": [TextGridInterval(*row) for row in rows]}, 1.0)
    [(_, found)], _ = parse_tiers(text.encode())
    assert found is not None
    assert [(row.start_s, row.end_s, row.text) for row in found] == [
        (0.0, 0.1 + 0.2, "a"),
        (0.1 + 0.2, 0.4, "b"),
        (0.4, 0.7, "c"),
        (0.7, 0.9, ""),
        (0.9, 1.0, "d"),
    ]


EAF = """<?xml version="1.0"?><ANNOTATION_DOCUMENT><HEADER TIME_UNITS="milliseconds">
<MEDIA_DESCRIPTOR MEDIA_URL="file:///a.wav" TIME_ORIGIN="0"/></HEADER>
<TIME_ORDER><TIME_SLOT TIME_SLOT_ID="a" TIME_VALUE="100"/><TIME_SLOT TIME_SLOT_ID="b"/>
<TIME_SLOT TIME_SLOT_ID="c" TIME_VALUE="900"/></TIME_ORDER><TIER TIER_ID="words">
<ANNOTATION><ALIGNABLE_ANNOTATION TIME_SLOT_REF1="a" TIME_SLOT_REF2="b"><ANNOTATION_VALUE>hello
</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION>
<ANNOTATION><ALIGNABLE_ANNOTATION TIME_SLOT_REF1="b" TIME_SLOT_REF2="c"><ANNOTATION_VALUE>bob
</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION></TIER><TIER TIER_ID="gloss"><ANNOTATION>
<ALIGNABLE_ANNOTATION TIME_SLOT_REF1="a" TIME_SLOT_REF2="c"><ANNOTATION_VALUE>a greeting
</ANNOTATION_VALUE></ALIGNABLE_ANNOTATION></ANNOTATION></TIER></ANNOTATION_DOCUMENT>"""


def test_tiers_of_elan(tmp_path):
    path = tmp_path / "a.eaf"
    path.write_text(EAF)
    assert read_speech_times(path).words == ((0.1, 0.5, "hello"), (0.5, 0.9, "bob"))
    gloss = read_speech_times(path, tier="gloss")
    assert gloss.words == ((0.1, 0.9, "a"), (0.1, 0.9, "greeting"))
    path.write_text(EAF.replace('ORIGIN="0"', 'ORIGIN="2000"'))
    late = read_speech_times(path)
    assert late.words[0] == (2.1, 2.5, "hello")
    assert late.notes == ("the sound begins 2 s before ELAN's times",)
    for broken, says in (
        (EAF.replace('"100"', '"soon"'), "time of ELAN, ms: 'soon'"),
        (EAF.replace("TIME_VALUE", "VALUE"), "annotations of ELAN: no times"),
        (EAF.replace("ALIGNABLE", "REF"), "tiers: none"),
    ):
        path.write_text(broken)
        with pytest.raises(InputError, match=says):
            read_speech_times(path)


@pytest.mark.parametrize(
    "text",
    [
        "words\tann\t00:00:00.100\t0.1\t00:00:00.500\t0.5\t00:00:00.400\t0.4\thello\n"
        "words\tann\t00:00:00.500\t0.5\t00:00:00.900\t0.9\t00:00:00.400\t0.4\tbob\n",
        "words\t\t100\t500\t400\thello\nwords\t\t500\t900\t400\tbob\n",
        "Begin Time - msec\tEnd Time - msec\tDuration - msec\twords\tgloss\n"
        "100\t500\t400\thello\t\n100\t900\t800\t\ta greeting\n500\t900\t400\tbob\t\n",
        "Tier\tBegin Time - ss.msec\tEnd Time - ss.msec\tAnnotation\n"
        "words\t0.1\t0.5\thello\nwords\t0.5\t0.9\tbob\n",
    ],
    ids=["no names, two formats", "no names, ms", "a column for each tier", "a column of tiers"],
)
def test_tables_that_elan_exports(tmp_path, text):
    path = tmp_path / "a.txt"
    path.write_text(text)
    assert read_speech_times(path).words == ((0.1, 0.5, "hello"), (0.5, 0.9, "bob"))
