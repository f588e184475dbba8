"""Texts as people have them: scripts, subtitles, SSML, documents of an office."""

from __future__ import annotations

import pytest

from elocute.errors import InputError
from elocute.speech.text.script_text import read_transcript, spoken_script
from elocute.speech.times.captions import captions_of, is_captions, said_text, words_of_captions
from elocute.speech.times.read import read_speech_times

SRT = """1
00:00:00,050 --> 00:00:01,000
<i>Hello</i> there.

2
00:00:01,000 --> 00:00:04,900
- BOB: I live here.
[music]
"""
VTT = """WEBVTT

NOTE made by hand

intro
00:00.050 --> 00:01.000 align:start
<v Bob>Hello there.

01:00:01.000 --> 01:00:02.000
Tom &amp; Ann.
"""


def test_subtitles_are_what_is_said_and_when():
    assert is_captions(SRT) and is_captions(VTT) and not is_captions("1\nHello --> there\n")
    assert captions_of(SRT.replace("\n", "\r\n")) == [
        (0.05, 1.0, "Hello there."),
        (1.0, 4.9, "I live here."),
    ]
    assert captions_of(VTT) == [(0.05, 1.0, "Hello there."), (3601.0, 3602.0, "Tom & Ann.")]
    words = [(0.05, 1.0, "Hello"), (0.05, 1.0, "there"), (1.0, 4.9, "I")]
    assert words_of_captions(SRT).words[:3] == words
    told = ["not taken for speech: '- BOB:', '[music]'"]
    assert said_text(SRT) == ("Hello there.\nI live here.", told)
    assert words_of_captions(SRT).notes == told


def test_subtitles_by_hand_and_of_youtube():
    crowded = "1\n00:00:01,000 --> 00:00:02,000\nTen\n2\n00:00:02,000 --> 00:00:03,000\nTwo\n\n7\n"
    assert captions_of(crowded) == [(1, 2, "Ten"), (2, 3, "Two\n7")]
    youtube = "0:00:01.000,0:00:02.500\nHello.\n\n0:00:02.500,0:00:03.000\nYou.\n"
    assert captions_of(youtube) == [(1, 2.5, "Hello."), (2.5, 3, "You.")]


@pytest.mark.parametrize(
    ("text", "said", "left_out"),
    [
        ("BOB: (sighs) Hello there. [laughs] I live.", "Hello there. I live.", 3),
        ("BOB: Hi.\nMARY ANN (whispers): Hush!", "Hi.\nHush!", 2),
        ("Speaker 1: Hi.\nSpeaker 2: Ho.", "Hi.\nHo.", 2),
        ("Ann: Hi.\nTom: Ho.\nAnn: He.\nTom: Ha.", "Hi.\nHo.\nHe.\nHa.", 4),
        ("Ann: Hi.\nTom: Ho.", "Hi.\nHo.", 2),
        ("Bob: so I went\nAnn: where\nBob: home", "so I went\nwhere\nhome", 3),
        ("BOB: NO.\nANN: YES.\nBOB: OH.", "NO.\nYES.\nOH.", 3),
        (">> BOB: NO.\n>> REMEMBER ONE THING: RUN.", "NO.\n>> REMEMBER ONE THING: RUN.", 1),
        ("Remember one thing: go.\nMy advice: stop.", None, 0),
        ("First: Open the map.\nSecond: Go home.", None, 0),
        ("Step 1: Open it.\nStep 2: Close it.", None, 0),
        ("REMEMBER: RUN.\nMY ADVICE TO YOU: STOP.\nBy Bob", None, 0),
        ("Remember: it is hot.\nDrink.\nRemember: it is late.", None, 0),
        ("记住一件事：呼吸。\n我的建议：停。", None, 0),
        ("小明：你好。\n小红：你好！", "你好。\n你好！", 2),
        ("BOB\nHi.\n\nMARY ANN (V.O.)\n(softly)\nHush!\n", "Hi.\nHush!", 3),
        ("CHAPTER ONE\n\nIt was late. It rained.", "CHAPTER ONE\nIt was late. It rained.", 0),
        ("He said: go home (or stay) at 10:30.", "He said: go home (or stay) at 10:30.", 0),
        ("Go. (It was late.) Then (laughing softly) I ran.", "Go. (It was late.) Then I ran.", 1),
        ("A plain text.", "A plain text.", 0),
        ("0:00\nHello.\n0:03\nMy map.", "Hello.\nMy map.", 2),
        ("[00:00] ANN: Hello.\n[00:03] BOB: My map.", "Hello.\nMy map.", 4),
        ("Ann Li  0:00  \nHello.\n\nBob  0:03\nMy map.", "Hello.\nMy map.", 2),
        ("Ann (00:00):\nHello.\n\nBob (00:03):\nMy map.", "Hello.\nMy map.", 2),
        ("*sighs* My *map* is *clears throat* here.", "My *map* is here.", 2),
        ("7:30 is late.\nCome.", "7:30 is late.\nCome.", 0),
        ("INT. HALL - DAY\n\nBOB\n(softly)\nHush!\n\nANN\nHi.\n", "Hush!\nHi.", 4),
        ("# Maps\nSee [my map](https://a.b/c).", "Maps\nSee my map.", 0),
    ],
)
def test_names_and_stage_directions_are_not_said(text, said, left_out):
    found, dropped = spoken_script(text)
    assert found == (said or text) and len(dropped) == left_out


def test_what_is_left_out_is_told(tmp_path):
    _, notes = said_text("BOB: (sighs) Hello.")
    assert notes == ["not taken for speech: 'BOB:', '(sighs)'"]
    path = tmp_path / "a.srt"
    path.write_text("00:00:01,000 --> 00:00:02,000\n[the king] said no\n")
    times = read_speech_times(path)
    assert [word for _, _, word in times.words] == ["said", "no"]
    assert times.notes == ("not taken for speech: '[the king]'",)


CUES = """
00:00:00.000 --> 00:00:01.000
NOTE THE MAP.

NOTE
the editor's

00:00:01.000 --> 00:00:02.000
STYLE
matters
"""


def test_notes_stand_between_captions_of_webvtt_alone():
    shown = [(0, 1, "NOTE THE MAP."), (1, 2, "STYLE\nmatters")]
    assert captions_of(f"WEBVTT\n{CUES}") == shown
    edited = CUES.replace("NOTE THE MAP.", "").replace("the editor's", "NOTE THE MAP.")
    assert captions_of(f"WEBVTT\n{edited}") == shown[1:]
    assert captions_of(edited)[0] == (0, 1, "NOTE\nNOTE THE MAP."), "SubRip has no notes"


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("if a < b and c > d then", "if a < b and c > d then"),
        ("in &lt;out&gt; &lt;b&gt;bold&lt;/b&gt;", "in <out> <b>bold</b>"),
        ("<v Bob><c.red>We</c> <00:00:00.500>are</v>", "We are"),
    ],
)
def test_a_tag_of_subtitles_begins_behind_its_bracket(written, said):
    text = f"00:00:00.000 --> 00:00:01.000\n{written}\n"
    assert captions_of(text) == [(0, 1, said)]
    spoken = said.replace("<", " ").replace(">", " ").replace("/", " ").split()
    assert [word for _, _, word in words_of_captions(text).words] == spoken


def test_ssml_is_read_without_its_tags():
    ssml = (
        '<?xml version="1.0"?><speak version="1.0" xml:lang="en-US"><p>Hello, <emphasis>Bob'
        '</emphasis>!<break time="200ms"/> The <sub alias="World Wide Web">WWW</sub> &amp; I<mark '
        'name="here"/>.</p><!-- no --></speak>'
    )
    assert said_text(ssml)[0] == "Hello, Bob! The World Wide Web & I."
    for broken in ("<speak>a & b</speak>", "<speak><p>a</speak>", "<!DOCTYPE a><speak>b</speak>"):
        with pytest.raises(InputError, match="SSML: ") as caught:
            said_text(broken)
        assert "\n" not in str(caught.value)
    assert said_text("<speak><mstts:express-as>Hi</mstts:express-as></speak>")[0] == "Hi"
    assert said_text("if a < b > c")[0] == "if a < b > c", "no SSML"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be", "utf-16-le"])
def test_texts_of_windows_are_read(tmp_path, encoding):
    mark = "\ufeff" if encoding == "utf-16-be" else ""
    path = tmp_path / "a.txt"
    path.write_bytes((mark + "Grüße an Bob").encode(encoding))
    assert read_transcript(path, max_bytes=1000) == "Grüße an Bob"


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"PK\x03\x04word/document.xml", "a Word document or another ZIP file; .*plain text"),
        (rb"{\rtf1\ansi Hello}", "Rich Text Format"),
        (b"%PDF-1.7", "a PDF"),
        (
            b"[Script Info]\nTitle: x\n",
            "subtitles of another kind; .*save it as text, .srt or .vtt",
        ),
        (b"{0}{25}Hello", "subtitles of another kind"),
        (b'<?xml version="1.0"?><tt></tt>', "markup or subtitles of another kind"),
        (b"@UTF8\n@Begin\n*CHI:\thello . \x150_900\x15", "a CHAT transcript"),
        (b'File type = "ooTextFile"\n', "TextGrid or JSON; .*`phones`"),
        (b'{"text": "hello", "segments": []}', "TextGrid or JSON; .*`phones`"),
        ("Grüße".encode("latin-1"), "byte 2 is not UTF-8; .*; save it in UTF-8"),
    ],
)
def test_documents_are_named_in_one_line(tmp_path, data, says):
    path = tmp_path / "a.docx"
    path.write_bytes(data)
    with pytest.raises(InputError, match=says) as caught:
        read_transcript(path, max_bytes=1000)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "rest", ["", "\n\nWORD START END ASDSCORE\nWE 0.2 0.5 7.2", "\nRef:  0Fi8"]
)
def test_transcripts_of_lrs_hold_what_is_said(tmp_path, rest):
    path = tmp_path / "00001.txt"
    path.write_text(f"Text:  WE ARE HERE\nConf:  4{rest}\n")
    assert read_transcript(path, max_bytes=1000) == "WE ARE HERE"
    path.write_text("Text: a message\nto all\n")
    assert read_transcript(path, max_bytes=1000) == "Text: a message\nto all\n"


YOUTUBE = """WEBVTT
Kind: captions
Language: en

00:00:00.080 --> 00:00:02.310 align:start position:0%
~
hello<00:00:00.480><c> there</c><00:00:00.719><c> Tom &amp; Ann</c>

00:00:02.310 --> 00:00:02.320 align:start position:0%
hello there Tom &amp; Ann
~

00:00:02.320 --> 00:00:04.789 align:start position:0%
hello there Tom &amp; Ann
no

00:00:04.789 --> 00:00:04.799 align:start position:0%
no
~

00:00:04.799 --> 00:00:06.000 align:start position:0%
no
no<00:00:05.200><c> no</c>
""".replace("~", " ")


def test_captions_that_roll_up_say_each_word_once_at_its_time():
    hello = [(0.08, 0.48, "hello"), (0.48, 0.719, "there")]
    names = [(0.719, 2.31, "Tom"), (0.719, 2.31, "Ann")]
    denied = [(2.32, 4.789, "no"), (4.799, 5.2, "no"), (5.2, 6.0, "no")]
    assert words_of_captions(YOUTUBE).words == [*hello, *names, *denied]
    assert said_text(YOUTUBE)[0] == "hello there Tom & Ann\nno\nno no"


def test_captions_that_roll_up_without_times_of_words():
    """As downloaders make .srt of YouTube's."""
    lines = ["", "hello there", "hello there\nhow are", "how are", "how are\nyou", "you"]
    srt = "".join(
        f"{at}\n00:00:0{at},000 --> 00:00:0{at + 1},000\n{line}\n\n"
        for at, line in enumerate(lines)
    )
    assert captions_of(srt) == [(1, 2, "hello there"), (2, 3, "how are"), (4, 5, "you")]
    chorus = "".join(f"{n}\n00:00:0{n},000 --> 00:00:0{n + 1},000\nNo.\n\n" for n in range(4))
    assert [said for _, _, said in captions_of(chorus)] == ["No."] * 4


def test_captions_that_light_up_word_after_word():
    """As Whisper and its kin write them where they are asked for highlighted words."""
    shown = ["I am here", "<u>I</u> am here", "I <u>am</u> here", "I am here", "I am <u>here</u>"]
    srt = "".join(
        f"{at}\n00:00:0{at},000 --> 00:00:0{at + 1},000\n{line}\n\n"
        for at, line in enumerate(shown)
    )
    words = [(1.0, 2.0, "I"), (2.0, 3.0, "am"), (4.0, 5.0, "here")]
    assert words_of_captions(srt).words == words
    assert words_of_captions(
        srt.replace("<u>", '<font color="#00ff00">').replace("/u", "/font")
    ).words == (words)
    assert captions_of(srt) == [(0.0, 5.0, "I am here")]
    twice = "".join(f"00:0{n}.000 --> 00:0{n + 1}.000\nI <i>am</i>.\n\n" for n in range(2))
    assert captions_of(twice) == [(0.0, 1.0, "I am."), (1.0, 2.0, "I am.")]


def test_line_ends_of_old_machines():
    assert captions_of(SRT.replace("\n", "\r")) == captions_of(SRT)
    assert is_captions(SRT.replace("\n", "\r"))


ASS = r"""[Script Info]
Title: Hello

[V4+ Styles]
Format: Name, Fontname, Fontsize
Style: Default,Arial,20

[Events]
Format: Layer, Start, End, Style, Name, MarginL, MarginR, MarginV, Effect, Text
Comment: 0,0:00:00.00,0:00:09.00,Default,,0,0,0,,not said
Dialogue: 0,0:00:03.00,0:00:04.00,Default,Bob,0,0,0,,{\k20}ka{\k30}ra {\k50}oke
Dialogue: 0,0:00:01.00,0:00:02.50,Default,Bob,0,0,0,,{\pos(1,2)}Hello, {\i1}there{\i0}\NAnn.
Dialogue: 0,0:00:05.00,0:00:06.00,Default,,0,0,0,,{\p1}m 0 0 l 9 0{\p0}
"""


def test_subtitles_of_substation_alpha(tmp_path):
    assert captions_of(ASS) == [(1.0, 2.5, "Hello, there\nAnn."), (3.0, 4.0, "kara oke")]
    assert words_of_captions(ASS).words[3:] == [(3.0, 3.5, "kara"), (3.5, 4.0, "oke")]
    path = tmp_path / "a.ass"
    path.write_text(ASS)
    assert read_transcript(path, max_bytes=5000) == ASS
    with pytest.raises(InputError, match=r"event: 'Dialogue: 0,never"):
        captions_of(ASS.replace("0:00:03.00", "never"))


def test_subtitles_of_substation_alpha_that_light_up_word_after_word():
    lines = [
        r"{\1c&H00FF00&}I{\r} am\Nhere",
        r"I {\c&HFF00&\b1}am{\c&HFFFFFF&\b0}\Nhere",
        r"I am\N{\1c&H00FF00&}here",
    ]
    events = "".join(
        f"Dialogue: {layer},0:00:0{at}.00,0:00:0{at + 1}.00,Default,,0,0,0,,{{\\an8}}{line}\n"
        for layer in range(2)
        for at, line in enumerate(lines)
    )
    words = words_of_captions(events).words
    assert words == [(0.0, 1.0, "I"), (1.0, 2.0, "am"), (2.0, 3.0, "here")]


def test_what_subtitles_show_twice_is_said_once():
    cue = "00:00:01.000 --> 00:00:02.000\n{}\n\n"
    shadow = cue.format("<b>Hello</b>") + cue.format("Hello")
    ruby = cue.format(r"<ruby>山<rp>(</rp><rt>やま</rt><rp>)</rp></ruby>\Nmap")
    assert captions_of(shadow) == [(1.0, 2.0, "Hello")]
    assert captions_of(ruby) == [(1.0, 2.0, "山\nmap")]


LRC = """[ar:Bob]
[offset:+500]
[00:01.50][00:05.50]Hello there
[00:03.50]<00:03.50> I <00:04.00> live <00:05.00>
"""


def test_lyrics_begin_with_their_times():
    hello = [(1.0, 3.0, "Hello"), (1.0, 3.0, "there")]
    again = [(5.0, 5.6, "Hello"), (5.0, 5.6, "there")]
    assert words_of_captions(LRC).words == [*hello, (3.0, 3.5, "I"), (3.5, 4.5, "live"), *again]


def test_a_transcript_with_times_keeps_the_lines_between_them():
    text = "[00:00] BOB: Hello.\nHow are you?\n\n[00:05.5] ANN: Fine.\n"
    assert captions_of(text) == [(0.0, 5.5, "Hello.\nHow are you?"), (5.5, 6.1, "Fine.")]
    assert is_captions(text) and not is_captions("Hello.\n[00:05] Fine.\n")


def test_subtitles_of_other_kinds_are_refused_in_one_line(tmp_path):
    for text, says in (
        ("{0}{25}Hello\n{25}{50}You\n", "subtitles: frames alone; .*save them as .srt or .vtt"),
        ("<tt><p begin='1s'>Hello</p></tt>", "<tt>; .*save subtitles as .srt or .vtt"),
    ):
        path = tmp_path / "a.sub"
        path.write_text(text)
        with pytest.raises(InputError, match=says):
            read_speech_times(path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('Hi <break time="1.0s" /> Bob, I am here &amp; there.', "Hi Bob, I am here & there."),
        ("<p>Hi <b>Bob</b></p>", "Hi Bob"),
        ('The <sub alias="consortium">W3C</sub>.', "The consortium."),
        ("a < b and AT&amp;T", "a < b and AT&amp;T"),
    ],
)
def test_tags_in_a_plain_text_are_not_said(text, said):
    assert said_text(text)[0] == said


@pytest.mark.parametrize(
    "times",
    [
        "00:00:01:500 --> 00:00:02:000",
        "00: 00: 01, 500 -> 00: 00: 02, 000",
        "00:00:1,500 --> 00:00:2,00",
        "0:01.5 --> 0:02.0 line:1",
    ],
)
def test_times_of_subtitles_as_less_strict_programs_write_them(times):
    text = f"1\n-00:00:00,500 --> 00:00:01,000\nHello.\n\n2\n{times}\nMy map.\n"
    assert captions_of(text) == [(0, 1, "Hello."), (1.5, 2, "My map.")]


def test_subtitles_in_frames_are_refused():
    with pytest.raises(InputError, match=r"time 00:00:01:12: frames; .*milliseconds"):
        said_text("1\n00:00:01:12 --> 00:00:02:00\nHello.\n")


def test_names_of_a_meeting_are_not_said():
    cues = "\n\n".join(
        f"{n}\n00:00:0{n}.000 --> 00:00:0{n}.900\n{who}: {said}"
        for n, (who, said) in enumerate([("Ann Li", "Hello."), ("Bob", "My map."), ("Bob", "Yes.")])
    )
    assert [said for _, _, said in captions_of(f"WEBVTT\n\n{cues}")] == [
        "Hello.",
        "My map.",
        "Yes.",
    ]
