"""Times as speech engines, recognisers and animators give them, each in its own way."""

from __future__ import annotations

import json

import pytest

from elocute.errors import InputError
from elocute.speech.times.read import SpeechTimes, read_speech_times

HELLO_BOB = [(0.05, 0.4, "hello"), (0.4, 0.8, "bob")]


def read(folder, text, name="times.json", **options) -> SpeechTimes:
    path = folder / name
    path.write_text(text if isinstance(text, str) else json.dumps(text), encoding="utf-8")
    return read_speech_times(path, **options)


def shown(labels) -> list[tuple[float, float, str]]:
    return [(round(start, 3), round(end, 3), text) for start, end, text in labels]


def timed(start: str, end: str, label: str, scale: float = 1, **more: object) -> list[dict]:
    return [{start: a * scale, end: b * scale, label: text, **more} for a, b, text in HELLO_BOB]


DEEPGRAM = {"results": {"channels": [{"alternatives": [{"words": timed("start", "end", "word")}]}]}}
GOOGLE = [
    {"startTime": f"{a}s", "endTime": f"{b}s", "word": text, "confidence": 0.9}
    for a, b, text in HELLO_BOB
]
AWS = [
    {"start_time": str(a), "end_time": str(b), "alternatives": [{"content": text}], "type": kind}
    for (a, b, text), kind in zip(HELLO_BOB, ["pronunciation", "pronunciation"], strict=True)
]
AWS.insert(1, {"alternatives": [{"content": ","}], "type": "punctuation"})
WHISPER_CPP = [
    {
        "timestamps": {"from": "00:00:00,050", "to": "00:00:00,400"},
        "offsets": {"from": 1000 * a, "to": 1000 * b},
        "text": f" {text}",
        "tokens": [{"text": "x", "offsets": {"from": 0, "to": 9}}],
    }
    for a, b, text in HELLO_BOB
]


@pytest.mark.parametrize(
    "record",
    [
        pytest.param({"words": timed("start", "end", "text", 1000)}, id="AssemblyAI, ms"),
        pytest.param(DEEPGRAM, id="Deepgram"),
        pytest.param(timed("start_ts", "end_ts", "text", phonemes="həlˈO"), id="Kokoro"),
        pytest.param({"results": [{"alternatives": [{"words": GOOGLE}]}]}, id="Google"),
        pytest.param({"results": {"items": AWS, "transcripts": []}}, id="AWS Transcribe"),
        pytest.param(
            {
                "results": [
                    {"alternatives": [{"timestamps": [["hello", 0.05, 0.4], ["bob", 0.4, 0.8]]}]}
                ]
            },
            id="Watson",
        ),
        pytest.param(
            {"monologues": [{"elements": timed("ts", "end_ts", "value", type="text")}]}, id="Rev"
        ),
        pytest.param(
            {"result": timed("start", "end", "word", conf=1.0), "text": "hello bob"}, id="Vosk"
        ),
        pytest.param({"transcription": WHISPER_CPP}, id="whisper.cpp"),
        pytest.param(
            {
                "text": "hello bob",
                "chunks": [{"timestamp": [a, b], "text": f" {t}"} for a, b, t in HELLO_BOB],
            },
            id="transformers",
        ),
        pytest.param(
            {
                "type": "timestamps",
                "word_timestamps": {
                    "words": ["hello", "bob"],
                    "start": [0.05, 0.4],
                    "end": [0.4, 0.8],
                },
            },
            id="Cartesia",
        ),
        pytest.param(
            {"words": ["hello", "bob"], "wtimes": [50, 400], "wdurations": [350, 400]},
            id="TalkingHead",
        ),
        pytest.param(
            {
                "words": [
                    *timed("start", "end", "text", type="word"),
                    {"text": "(laughs)", "start": 0.9, "end": 1.1, "type": "audio_event"},
                ]
            },
            id="ElevenLabs Scribe",
        ),
    ],
)
def test_words_of_engines_and_recognisers(tmp_path, record):
    assert shown(read(tmp_path, record).words) == HELLO_BOB


def test_lists_and_durations(tmp_path):
    assert shown(read(tmp_path, [[text, a, b] for a, b, text in HELLO_BOB]).words) == HELLO_BOB
    assert shown(read(tmp_path, [[a, b, text] for a, b, text in HELLO_BOB]).words) == HELLO_BOB
    lmnt = {"durations": [{"text": t, "start": a, "duration": b - a} for a, b, t in HELLO_BOB]}
    assert shown(read(tmp_path, lmnt).words) == HELLO_BOB
    hume = [{"text": t, "time": {"begin": 1000 * a, "end": 1000 * b}} for a, b, t in HELLO_BOB]
    assert shown(read(tmp_path, hume).words) == HELLO_BOB


def test_whisper_s_segments_hold_words_or_are_phrases(tmp_path):
    phrase = {"id": 0, "start": 0.05, "end": 0.8, "text": " Hello, Bob."}
    both = {"segments": [phrase], "words": timed("start", "end", "word")}
    assert shown(read(tmp_path, both).words) == HELLO_BOB
    times = read(tmp_path, {"segments": [phrase]})
    assert times.words == ((0.05, 0.8, "Hello"), (0.05, 0.8, "Bob"))
    assert times.notes == ("words are looked for within the times of their segments",)


def test_guessed_milliseconds_are_told(tmp_path):
    record = {"words": timed("start", "end", "text", 1000)}
    assert read(tmp_path, record).notes == ("times were taken for milliseconds",)
    assert read(tmp_path, {"words": timed("start", "end", "text")}).notes == ()


def test_whisper_s_table_of_phrases_in_milliseconds(tmp_path):
    text = "start\tend\ttext\n50\t800\tHello, Bob.\n800\t2400\tHow are you?\n"
    words = read(tmp_path, text, "a.tsv").words
    assert words[:2] == ((0.05, 0.8, "Hello"), (0.05, 0.8, "Bob")) and len(words) == 5
    phones = "start,end,phone\n100,200,M\n200,300,AA\n"
    assert shown(read(tmp_path, phones, "a.csv").phones) == [(0.1, 0.2, "M"), (0.2, 0.3, "AA")]


def letters(text: str, keys: tuple[str, str, str], in_ms: bool) -> dict[str, list]:
    step = 100 if in_ms else 0.1
    starts = [at * step for at in range(len(text))]
    lasts = [step] * len(text) if in_ms else [start + step for start in starts]
    return dict(zip(keys, (list(text), starts, lasts), strict=True))


SECONDS = ("characters", "character_start_times_seconds", "character_end_times_seconds")
STREAM = ("chars", "charStartTimesMs", "charDurationsMs")


def test_elevenlabs_says_what_was_spoken_beside_what_was_written(tmp_path):
    record = {
        "alignment": letters("$5", SECONDS, in_ms=False),
        "normalized_alignment": letters("five dollars", SECONDS, in_ms=False),
    }
    assert shown(read(tmp_path, record).words) == [(0, 0.4, "five"), (0.5, 1.2, "dollars")]
    tagged = '[clears throat] Hi <break time="1s" />you'
    words = read(tmp_path, {"alignment": letters(tagged, SECONDS, in_ms=False)}).words
    assert [word for *_, word in words] == ["Hi", "you"]
    del record["normalized_alignment"]
    assert shown(read(tmp_path, record).words) == [(0, 0.2, "$5")]


def test_elevenlabs_streams_parts_that_count_from_their_own_begin(tmp_path):
    parts = [
        {"audio": "", "normalizedAlignment": letters(text, STREAM, in_ms=True), "alignment": None}
        for text in ("Hello B", "ob ", "you")
    ]
    lines = "\n".join(json.dumps(part) for part in [*parts, {"audio": None, "isFinal": True}])
    times = read(tmp_path, lines, "times.jsonl")
    assert shown(times.words) == [(0, 0.5, "Hello"), (0.6, 0.9, "Bob"), (1.0, 1.3, "you")]
    assert "begin where the part before ends" in times.notes[0]


AZURE = [(0.05, 0), (0.15, 21), (0.25, 1), (0.4, 0)]
MAP = [(0.15, 0.25, "P"), (0.25, 0.4, "AH")]


@pytest.mark.parametrize(
    "record",
    [
        pytest.param([[round(1000 * at), viseme] for at, viseme in AZURE], id="pairs, ms"),
        pytest.param(
            [{"privAudioOffset": round(at * 1e7), "privVisemeId": viseme} for at, viseme in AZURE],
            id="JavaScript",
        ),
    ],
)
def test_azure_in_a_browser(tmp_path, record):
    assert shown(read(tmp_path, record).phones) == MAP


def test_visemes_and_cues_of_animators(tmp_path):
    head = {"visemes": ["sil", "PP", "aa"], "vtimes": [0, 100, 180], "vdurations": [100, 80, 120]}
    assert shown(read(tmp_path, head).phones) == [(0.1, 0.18, "P"), (0.18, 0.3, "AA")]
    cues = [(0.0, 0.1, "X"), (0.1, 0.18, "A"), (0.18, 0.3, "D")]
    rhubarb = {"mouthCues": [{"start": a, "end": b, "value": c} for a, b, c in cues]}
    wanted = [(0.1, 0.18, "P"), (0.18, 0.3, "AA")]
    assert shown(read(tmp_path, rhubarb).phones) == wanted
    lines = "".join(f"{a:.2f}\t{c}\n" for a, _, c in cues) + "0.30\tX\n"
    assert shown(read(tmp_path, lines, "cues.tsv").phones) == wanted
    inner = "".join(f'<mouthCue start="{a}" end="{b}">{c}</mouthCue>' for a, b, c in cues)
    xml = f'<?xml version="1.0"?><rhubarbResult><mouthCues>{inner}</mouthCues></rhubarbResult>'
    assert shown(read(tmp_path, xml, "cues.xml").phones) == wanted
    moho = "MohoSwitch1\n1 rest\n4 MBP\n7 AI\n13 rest\n"
    assert shown(read(tmp_path, moho, "cues.dat").phones) == [(0.125, 0.25, "P"), (0.25, 0.5, "AA")]


OCULUS = [(0.1, 0.2, "PP"), (0.2, 0.3, "aa"), (0.3, 0.4, "FF"), (0.4, 0.5, "TH")]
ROWS = "\n".join("{} {} {}".format(*each) for each in OCULUS)
GRID = "\n".join('{} {} "{}"'.format(*each) for each in OCULUS)
GRID = (
    f'"ooTextFile"\n"TextGrid"\n0 1 <exists> 2\n"IntervalTier" "words" 0 1 1\n0 1 "path"\n'
    f'"IntervalTier" "visemes" 0 1 4\n{GRID}'
)


@pytest.mark.parametrize(
    "written",
    [
        pytest.param(f"start,end,phone\n{ROWS.replace(' ', ',')}", id="phones of a table"),
        pytest.param(f"start,end,viseme\n{ROWS.replace(' ', ',')}", id="a table"),
        pytest.param(ROWS, id="labels"),
        pytest.param(GRID, id="TextGrid"),
        pytest.param([{"start": a, "end": b, "viseme": name} for a, b, name in OCULUS], id="JSON"),
    ],
)
def test_visemes_of_oculus_in_any_file(tmp_path, written):
    times = read(tmp_path, written)
    assert [phone for _, _, phone in times.phones] == ["P", "AA", "F", "TH"]
    assert times.alphabet == "oculus"


def test_a_column_of_visemes_says_that_they_are_no_phones(tmp_path):
    azure = read(tmp_path, "start,end,viseme_id\n0,0.1,21\n0.1,0.3,2\n", "a.csv")
    assert shown(azure.phones) == [(0, 0.1, "P"), (0.1, 0.3, "AA")]
    pair = [{"start": 0, "end": 1, "viseme": "E"}, {"start": 1, "end": 2, "viseme": "O"}]
    assert [phone for _, _, phone in read(tmp_path, pair).phones] == ["EH", "OW"]


def test_mouth_cues_in_lines_and_lists_of_their_own(tmp_path):
    cues = [(0.0, 0.1, "X"), (0.1, 0.2, "A"), (0.2, 0.35, "D"), (0.35, 0.5, "X")]
    lines = "\n".join("{} {} {}".format(*each) for each in cues)
    open_lips = [(0.1, 0.2, "P"), (0.2, 0.35, "AA")]
    times = read(tmp_path, lines)
    assert shown(times.phones) == open_lips
    told = ("symbols were taken for visemes: rhubarb; `phone set` takes others",)
    assert times.notes == told
    bare = [{"start": a, "end": b, "value": letter} for a, b, letter in cues]
    assert shown(read(tmp_path, bare).phones) == open_lips
    assert shown(read(tmp_path, bare[1:3]).phones) == open_lips
    vowels = read(tmp_path, "0.1 0.2 A\n0.2 0.3 E\n")
    assert vowels.alphabet == "x-sampa"
    assert vowels.notes == ("symbols were taken for x-sampa; `phone set` rhubarb takes mouth cues",)
    assert read(tmp_path, "0.1 0.2 A\n0.2 0.3 E\n", alphabet="x-sampa").notes == ()


def test_phones_of_synthesisers(tmp_path):
    piper = {
        "phonemes": [
            {"phoneme": p, "start": a, "end": a + 0.1} for p, a in [("ch", 0.1), ("i", 0.2)]
        ]
    }
    assert shown(read(tmp_path, piper).phones) == [(0.1, 0.2, "CH"), (0.2, 0.3, "IY")]
    mora = {"consonant": "ky", "consonant_length": 0.2, "vowel": "o", "vowel_length": 0.2}
    pause = {"vowel": "pau", "vowel_length": 0.4, "consonant": None, "consonant_length": None}
    last = {"consonant": None, "vowel": "N", "vowel_length": 0.2}
    phrases = [{"moras": [mora], "pause_mora": pause}, {"moras": [last], "pause_mora": None}]
    voicevox = {"accent_phrases": phrases, "speedScale": 2.0, "prePhonemeLength": 0.2}
    assert shown(read(tmp_path, voicevox).phones) == [
        (0.1, 0.15, "K"),
        (0.15, 0.2, "Y"),
        (0.2, 0.3, "OW"),
        (0.5, 0.6, "NG"),
    ]
    mbrola = "; hello\n_ 51\nh 74\n@ 51 0 100\nl 64 (50, 110)\n@U 192 0 105 80 90\n_ 51\n"
    assert shown(read(tmp_path, mbrola, "a.pho").phones) == [
        (0.051, 0.125, "HH"),
        (0.125, 0.176, "AH"),
        (0.176, 0.24, "L"),
        (0.24, 0.432, "OW"),
    ]


@pytest.mark.parametrize(
    ("unit", "note"),
    [
        (1, ()),
        (1e-7, ("times were taken for units of 100 ns",)),
        (1 / 16_000, ("times were taken for samples at 16 kHz",)),
    ],
)
def test_label_files_of_audacity_htk_and_timit(tmp_path, unit, note):
    spans = [(0.0, 0.31, "sil"), (0.31, 0.41, "m"), (0.41, 0.66, "ae")]
    lines = [(a / unit, b / unit, text) for a, b, text in spans]
    text = "".join(
        f"{a if unit == 1 else round(a)} {b if unit == 1 else round(b)} {c}\n" for a, b, c in lines
    )
    times = read(tmp_path, text, "a.lab")
    assert shown(times.phones) == [(0.31, 0.41, "M"), (0.41, 0.66, "AE")] and times.notes == note


def test_words_of_grid_and_lrs(tmp_path):
    grid = "0 14750 sil\n14750 20250 bin\n20250 38000 blue\n38000 47000 now\n47000 74500 sil\n"
    times = read(tmp_path, grid, "a.align")
    assert shown(times.words) == [(0.59, 0.81, "bin"), (0.81, 1.52, "blue"), (1.52, 1.88, "now")]
    assert "as GRID has them" in times.notes[0]
    head = "Text:  WE ARE\r\nConf:  4\r\n\r\n\r\nWORD START END ASDSCORE\r\n"
    lrs = read(tmp_path, f"{head}WE 0.20 0.50 -7.2\r\nARE 0.50 0.80 6.0\r\n", "a.txt")
    assert lrs.words == ((0.2, 0.5, "WE"), (0.5, 0.8, "ARE")) and not lrs.phones


@pytest.mark.parametrize(
    ("record", "says"),
    [
        ([{"FrameIndex": 0, "BlendShapes": [[0.0] * 55]}], "blend shapes, which are curves"),
        ({"facsNames": ["jawOpen"], "weightMat": [[0]]}, "blend shapes, which are curves"),
        ({"words": ["a"], "wtimes": [1, 2], "wdurations": [1]}, "1 words, 2 wtimes"),
        ("<svg><mouthCue/></svg>", "time of a mouth cue"),
        ("<svg/>", "<svg>; allowed: mouth cues in Rhubarb's XML"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "XML: declarations"),
        ({"a": {"b": [{"c": 1}]}}, "records of a"),
        ([[1, 2, 3]], "JSON of a list"),
        ([["x", 2], [1, True]], "JSON of a list"),
    ],
)
def test_what_holds_no_times_is_refused_in_one_line(tmp_path, record, says):
    with pytest.raises(InputError, match=says) as caught:
        read(tmp_path, record)
    assert "\n" not in str(caught.value)


def test_words_without_times_lie_between_their_neighbours(tmp_path):
    """WhisperX has no time for what holds no letters that it knows."""
    words = timed("start", "end", "word")
    words[1] |= {"start": 1.2, "end": 1.5}
    unknown = [{"word": "20"}, {"word": "?"}, {"word": "£3."}]
    segment = {"start": 0.0, "end": 2.0, "words": [words[0], *unknown, words[1], {"word": "7"}]}
    times = read(tmp_path, {"segments": [segment]})
    assert shown(times.words) == [
        *((0.05, 0.4, "hello"), (0.4, 0.8, "20"), (0.8, 1.2, "£3.")),
        *((1.2, 1.5, "bob"), (1.5, 2.0, "7")),
    ]
    told = "words without times, {} ({}), are {}"
    assert times.notes == (told.format(3, "20, £3., 7", "looked for in between"),)
    del segment["end"]
    left_out = read(tmp_path, {"segments": [segment]}).notes[1]
    assert left_out == told.format(1, "7", "left out")
    first, last = ({"word": word, "case": "not-found-in-audio"} for word in ("10", "20"))
    times = read(tmp_path, {"words": [first, words[0], last]})
    assert shown(times.words) == [(0, 0.05, "10"), (0.05, 0.4, "hello")]
    assert times.notes[1] == told.format(1, "20", "left out")


def test_the_last_chunk_of_transformers_may_be_open(tmp_path):
    chunks = [{"text": text, "timestamp": [a, b]} for a, b, text in HELLO_BOB]
    chunks[1]["timestamp"] = [0.4, None]
    times = read(tmp_path, {"chunks": chunks})
    assert shown(times.words) == [(0.05, 0.4, "hello"), (0.4, 0.7, "bob")]
    assert times.notes == ("the end of the last word is open: taken as 0.3 s later",)


def test_letters_whose_times_collapse_are_told(tmp_path):
    """ElevenLabs's dialogue gives one time to all that comes late."""
    letters = list("hi bob.")
    record = {
        "characters": letters,
        "character_start_times_seconds": [0, 0.1, *[0.2] * 5],
        "character_end_times_seconds": [0.1, 0.2, *[0.2] * 5],
    }
    times = read(tmp_path, {"alignment": record})
    assert shown(times.words) == [(0, 0.2, "hi")]
    assert times.notes == ("words without length, 1 ('bob.'), are left out",)
    with pytest.raises(InputError, match="words: no length"):
        read(tmp_path, {"alignment": {key: each[2:] for key, each in record.items()}})


@pytest.mark.parametrize(("unit", "told"), [(1e7, ""), (1e3, "milliseconds"), (1, "seconds")])
def test_offsets_of_azure_s_visemes_that_were_divided_already(tmp_path, unit, told):
    rows = [(0.05, 21), (0.15, 2), (0.3, 18), (0.5, 0)]
    times = read(tmp_path, [{"audioOffset": at * unit, "visemeId": each} for at, each in rows])
    assert shown(times.phones) == [(0.05, 0.15, "P"), (0.15, 0.3, "AA"), (0.3, 0.5, "F")]
    says = f"offsets were taken for {told}: too small for ticks of 100 ns"
    assert times.notes == ((says,) if told else ())


def test_marks_of_two_answers_in_one_file_are_refused(tmp_path):
    rows = [(20, "p"), (90, "a"), (900, "sil"), (6, "f"), (80, "a")]
    marks = [{"time": at, "type": "viseme", "value": each} for at, each in rows]
    with pytest.raises(InputError, match=r"'f': 0.006 s, behind one at 0.900 s; allowed: the ev"):
        read(tmp_path, marks)
    marks[3:] = [{**mark, "time": mark["time"] + 1000} for mark in marks[3:]]
    assert len(read(tmp_path, marks).phones) == 4


PHONES = [("m", 0.1, 0.08), ("ae", 0.18, 0.12)]
AZURE_PHONES = [
    {"Phoneme": p, "Offset": round(a * 1e7), "Duration": round(b * 1e7)} for p, a, b in PHONES
]
AZURE_WORD = {"Word": "ma", "Offset": 1_000_000, "Duration": 2_000_000, "Phonemes": AZURE_PHONES}
OMITTED = {"Word": "not", "PronunciationAssessment": {"ErrorType": "Omission"}}


@pytest.mark.parametrize(
    "record",
    [
        pytest.param([AZURE_WORD, OMITTED], id="words"),
        pytest.param({"Display": "Ma.", "Words": [AZURE_WORD, OMITTED]}, id="best guess"),
        pytest.param([{"NBest": [{"Words": [AZURE_WORD, OMITTED]}]}], id="several results"),
    ],
)
def test_azure_s_words_wherever_its_assessment_was_cut_out(tmp_path, record):
    times = read(tmp_path, record)
    assert shown(times.phones) == [(0.1, 0.18, "M"), (0.18, 0.3, "AE")]
    assert shown(times.words) == [(0.1, 0.3, "ma")]
    assert times.notes == ("1 words without times are left out",)


def test_marks_of_google_are_the_words_behind_them(tmp_path):
    points = [{"markName": text, "timeSeconds": at} for at, _, text in HELLO_BOB]
    times = read(tmp_path, {"audioContent": "UklGRg==", "timepoints": points})
    assert shown(times.words) == [(0.05, 0.4, "hello"), (0.4, 0.55, "bob")]
    assert times.notes == ("names of marks were taken for words",)
    numbered = [{**point, "markName": f"w{place}"} for place, point in enumerate(points)]
    with pytest.raises(InputError, match=r'marks: w0, w1; allowed: .*<mark name="hello"/>hello'):
        read(tmp_path, {"timepoints": numbered})


def test_words_letters_and_phones_of_inworld(tmp_path):
    columns = {
        "words": ["hello", " ", "bob"],
        "wordStartTimeSeconds": [0.05, 0.4, 0.4],
        "wordEndTimeSeconds": [0.4, 0.4, 0.8],
    }
    info = {"timestampInfo": {"wordAlignment": columns}}
    assert shown(read(tmp_path, {"audioContent": "", **info}).words) == HELLO_BOB
    assert shown(read(tmp_path, {"result": info}).words) == HELLO_BOB
    phones = [
        {"phoneSymbol": p, "startTimeSeconds": a, "durationSeconds": b, "visemeSymbol": "x"}
        for p, a, b in [("m", 0.1, 0.08), ("æ", 0.18, 0.12)]
    ]
    columns["phoneticDetails"] = [{"wordIndex": 0, "phones": phones}]
    assert shown(read(tmp_path, info).phones) == [(0.1, 0.18, "M"), (0.18, 0.3, "AE")]
    keys = ("characters", "characterStartTimeSeconds", "characterEndTimeSeconds")
    parts = [
        {"result": {"timestampInfo": {"characterAlignment": dict(zip(keys, row, strict=True))}}}
        for row in ([["h", "i", " "], [0, 0.1, 0.2], [0.1, 0.2, 0.3]], [["u"], [0.3], [0.5]])
    ]
    assert shown(read(tmp_path, parts).words) == [(0, 0.2, "hi"), (0.3, 0.5, "u")]


PGO = """lipsync version 1
map.wav
24
48
1
\tVoice 1
\tMy map.
\t1
\t\tMy map.
\t\t2
\t\t23
\t\t2
\t\t\tMy 3 8 2
\t\t\t\t3 MBP
\t\t\t\t6 AI
\t\t\tmap. 12 23 2
\t\t\t\t12 MBP
\t\t\t\t15 AI
"""


def test_projects_of_papagayo(tmp_path):
    times = read(tmp_path, PGO, "map.pgo")
    assert shown(times.phones) == [
        *((0.125, 0.25, "P"), (0.25, 0.375, "AA")),
        *((0.5, 0.625, "P"), (0.625, 1.0, "AA")),
    ]
    assert shown(times.words) == [(0.125, 0.375, "My"), (0.5, 1.0, "map.")]
    head, voice = PGO.replace("48\n1", "48\n3").split("\tVoice 1", 1)
    more = read(tmp_path, f"{head}\tVoice 0\n\n\t0\n\tVoice 1{voice}\tVoice 2{voice}", "map.pgo")
    assert more.phones == times.phones
    assert more.notes == ("of several voices the first is taken",)
    for broken in (PGO[:-20], PGO.replace("24", "0"), PGO.replace("3 8 2", "3 8 two")):
        with pytest.raises(InputError, match="Papagayo's project: others"):
            read(tmp_path, broken, "map.pgo")


@pytest.mark.parametrize(
    "text",
    [
        "0:00:00.050 0:00:00.400 hello\n00:00:00.400 00:00:00.800 bob\n",
        "00:00.050\t00:00.400\thello\n00:00.400\t00:00.800\tbob\n",
        "[00:00.050 --> 00:00.400]  hello\n[00:00.400 --> 00:00.800]  bob\n",
        "0:00:00.050,0:00:00.400,hello\n0:00:00.400,0:00:00.800,bob\n",
        "start,end,text\n0:00:00.050,0:00:00.400,hello\n00:00.400,00:00.800,bob\n",
        "start;end;text\n00:00:00,050;00:00:00,400;hello\n00:00:00,400;00:00:00,800;bob\n",
        "0,05;0,4;hello\n0,4;0,8;bob\n",
        "0,05\t0,4\thello\n0,4\t0,8\tbob\n",
        [{"start": f"0:00:0{a}", "end": f"00:0{b}", "text": t} for a, b, t in HELLO_BOB],
    ],
)
def test_times_in_minutes_and_with_decimal_commas(tmp_path, text):
    assert shown(read(tmp_path, text).words) == HELLO_BOB


def test_visemes_in_lists_of_lists_and_of_events(tmp_path):
    wanted = [(0.1, 0.18, "P"), (0.18, 0.3, "AA")]
    rows = [["PP", 0.1, 0.18], ["viseme_aa", 0.18, 0.3]]
    assert shown(read(tmp_path, {"visemes": rows}).phones) == wanted
    assert shown(read(tmp_path, {"visemes": [[100, 21], [180, 2], [300, 0]]}).phones) == wanted
    events = [{"audioOffset": round(at * 1e7), "visemeId": viseme} for at, viseme in AZURE]
    assert shown(read(tmp_path, {"visemes": events}).phones) == MAP
    with pytest.raises(InputError, match=r"visemes: \[0.1, 'PP'\]; allowed: \[\"PP\", 0.1, 0.2\]"):
        read(tmp_path, {"visemes": [[0.1, "PP"]]})
    with pytest.raises(InputError, match="1 visemes, 0 vtimes and 0 vdurations"):
        read(tmp_path, {"visemes": ["PP"]})


DEEPGRAM_WHOLE = {
    "results": {
        "channels": [
            {
                "alternatives": [
                    {
                        "words": timed("start", "end", "word"),
                        "paragraphs": {
                            "paragraphs": [
                                {"sentences": [{"text": "hello bob", "start": 0.05, "end": 0.8}]}
                            ]
                        },
                    }
                ]
            }
        ],
        "utterances": [{"start": 0.05, "end": 0.8, "words": timed("start", "end", "word")}],
    }
}
SPEECHMATICS_ENTITY = {
    "alternatives": [{"content": "hello-bob"}],
    "start_time": 0.05,
    "end_time": 0.8,
    "written_form": [
        {"alternatives": [{"content": "hello-bob"}], "start_time": 0.05, "end_time": 0.8}
    ],
    "spoken_form": [
        {"alternatives": [{"content": text}], "start_time": a, "end_time": b}
        for a, b, text in HELLO_BOB
    ],
}
WATSON = {
    "word_alternatives": [
        {"start_time": 0.05, "end_time": 0.4, "alternatives": [{"word": "hello"}]},
    ],
    "alternatives": [{"timestamps": [[text, a, b] for a, b, text in HELLO_BOB]}],
}


@pytest.mark.parametrize(
    "record",
    [
        pytest.param(DEEPGRAM_WHOLE, id="Deepgram: sentences and utterances too"),
        pytest.param({"results": [SPEECHMATICS_ENTITY]}, id="Speechmatics: written and spoken"),
        pytest.param({"results": [WATSON]}, id="Watson: alternatives of words"),
        pytest.param(
            {"results": [{"alternatives": [{"words": GOOGLE}]}] * 2},
            id="Google: all words again with their speakers",
        ),
        pytest.param(
            {
                "transcripts": [
                    {"words": timed("start", "end", "word")},
                    {"words": timed("a", "b", "c")},
                ]
            },
            id="DeepSpeech: other transcripts",
        ),
    ],
)
def test_words_that_an_answer_holds_twice_are_said_once(tmp_path, record):
    assert shown(read(tmp_path, record).words) == HELLO_BOB


ANN, BOB = [(0.0, 0.4, "good"), (0.5, 0.9, "morning")], [(1.2, 1.5, "hello"), (1.6, 2.0, "ann")]


def dialogue(key: str, *names: object) -> list[dict[str, object]]:
    """Words of Ann, then of Bob, each with who says it."""
    said = zip(names, (ANN, BOB), strict=True)
    return [
        {"start": a, "end": b, "word": word, "text": word, key: name}
        for name, words in said
        for a, b, word in words
    ]


DIALOGUES = {
    "Deepgram": (
        {
            "metadata": {"duration": 2.1},
            "results": {
                "channels": [{"alternatives": [{"words": dialogue("speaker", 0, 1)}]}],
                "utterances": [
                    {"speaker": 0, "start": 0, "end": 0.9, "transcript": "good morning"},
                    {"speaker": 1, "start": 1.2, "end": 2.0, "transcript": "hello ann"},
                ],
            },
        },
        "1",
    ),
    "AssemblyAI": ({"words": dialogue("speaker", "A", "B"), "audio_duration": 2.1}, "b"),
    "ElevenLabs": (
        {
            "words": [
                {**word, "type": "word"}
                for word in dialogue("speaker_id", "speaker_0", "speaker_1")
            ]
        },
        "speaker_1",
    ),
    "WhisperX": (
        {
            "segments": [
                {"start": 0, "end": 0.9, "text": "good morning", "speaker": "SPEAKER_00"}
                | {"words": dialogue("speaker", "SPEAKER_00", "SPEAKER_01")[:2], "tokens": [1, 2]},
                {"start": 1.2, "end": 2.0, "text": "hello ann", "speaker": "SPEAKER_01"}
                | {"words": [{"start": a, "end": b, "word": word} for a, b, word in BOB]},
            ]
        },
        "SPEAKER_01",
    ),
    "AWS": (
        {
            "results": {
                "items": [
                    {
                        "type": "pronunciation",
                        "start_time": str(a),
                        "end_time": str(b),
                        "alternatives": [{"content": word}],
                        "speaker_label": name,
                    }
                    for name, words in (("spk_0", ANN), ("spk_1", BOB))
                    for a, b, word in words
                ]
            }
        },
        "spk_1",
    ),
}


@pytest.mark.parametrize("engine", DIALOGUES)
def test_of_several_speakers_one_is_named(tmp_path, engine):
    record, bob = DIALOGUES[engine]
    with pytest.raises(InputError, match=r"speakers: .*; allowed: one in a file; name one"):
        read(tmp_path, record)
    assert shown(read_speech_times(tmp_path / "times.json", speaker=bob).words) == BOB
    with pytest.raises(InputError, match=r"`speaker` .eve.: .*; allowed: one of these"):
        read_speech_times(tmp_path / "times.json", speaker="eve")


@pytest.mark.parametrize(
    "record",
    [
        pytest.param(
            [
                {
                    "startTime": {"seconds": "0", "nanos": round(a * 1e9)},
                    "endTime": {"nanos": round(b * 1e9)},
                    "word": text,
                }
                for a, b, text in HELLO_BOB
            ],
            id="Google's library",
        ),
        pytest.param(
            {
                "recognizedPhrases": [
                    {
                        "nBest": [
                            {
                                "words": [
                                    {
                                        "word": text,
                                        "offset": f"PT{a}S",
                                        "duration": f"PT{b - a:.2f}S",
                                        "offsetInTicks": a * 1e7,
                                    }
                                    for a, b, text in HELLO_BOB
                                ]
                            }
                        ]
                    }
                ]
            },
            id="Azure batch",
        ),
        pytest.param(
            {
                "chunks": [
                    {"start": at, "end": at + 5, "value": text, "type": "word"}
                    | {"start_time": 1000 * a, "end_time": 1000 * b}
                    for at, (a, b, text) in zip((0, 6), HELLO_BOB, strict=True)
                ]
            },
            id="Speechify, letters beside times",
        ),
        pytest.param(
            [
                {"type": "WordBoundary", "offset": a * 1e7, "duration": (b - a) * 1e7, "text": text}
                for a, b, text in HELLO_BOB
            ],
            id="edge-tts",
        ),
        pytest.param(
            {
                "fragments": [
                    {"begin": str(a), "end": str(b), "lines": [text], "children": []}
                    for a, b, text in HELLO_BOB
                ]
            },
            id="aeneas",
        ),
    ],
)
def test_times_of_engines_in_other_writings(tmp_path, record):
    assert shown(read(tmp_path, record).words) == HELLO_BOB


def test_google_leaves_out_a_start_at_zero(tmp_path):
    first = {"endOffset": "0.400s", "word": "hello"}
    second = {"startOffset": "0.400s", "endOffset": "0.800s", "word": "bob"}
    assert read(tmp_path, [first, second]).words == ((0.0, 0.4, "hello"), (0.4, 0.8, "bob"))


def test_offsets_in_letters_and_frames_are_no_times(tmp_path):
    missed = {"case": "not-found-in-audio", "word": "x", "startOffset": 6, "endOffset": 7}
    gentle = read(tmp_path, {"words": [*timed("start", "end", "word", startOffset=0), missed]})
    assert shown(gentle.words) == HELLO_BOB
    assert gentle.notes == ("words without times, 1 (x), are left out",)
    with pytest.raises(InputError, match="records of word"):
        read(tmp_path, [{"word": "hello", "start_offset": 2, "end_offset": 16}])


def test_pieces_of_words_are_joined(tmp_path):
    pieces = [(100, 400, " Hel"), (400, 600, "lo"), (600, 900, " Bob"), (900, 950, ".")]
    record = [{"offsets": {"from": a, "to": b}, "text": text} for a, b, text in pieces]
    assert read(tmp_path, {"transcription": record}).words == (
        (0.1, 0.6, "Hello"),
        (0.6, 0.9, "Bob."),
    )
    words = [(0.1, 0.4, " twenty"), (0.4, 0.8, "-five")]
    timed_words = [{"word": text, "start": a, "end": b} for a, b, text in words]
    whisper = {"segments": [{"start": 0, "end": 1, "words": timed_words}]}
    assert read(tmp_path, whisper).words == ((0.1, 0.8, "twenty-five"),)


@pytest.mark.parametrize(
    "text",
    [
        "nfields 1\n#\n 0.1 125 pau\n 0.2 125 b\n 0.3 125 aa\n 0.4 125 b\n",
        "type 0\n#\n 0.1  122 {B_TRANS}\n 0.2  122 b; b\n 0.3  122 aa\n 0.4  122 b\n",
        "0 1000000 x^x-sil+b=aa@x_x/A:0\n1000000 2000000 x^sil-b+aa=b@1_3/A:0\n"
        "2000000 3000000 sil^b-aa+b=x@2_2/A:0\n3000000 4000000 b^aa-b+x=x@3_1/A:0\n",
    ],
    ids=["Festival", "Buckeye", "HTS"],
)
def test_labels_of_synthesisers_and_corpora(tmp_path, text):
    times = read(tmp_path, text, "one.lab")
    assert shown(times.phones) == [(0.1, 0.2, "B"), (0.2, 0.3, "AA"), (0.3, 0.4, "B")]


def test_labels_of_audacity_with_frequencies(tmp_path):
    rows = "".join(f"{a}\t{b}\t{text}\n\\\t100.0\t4000.0\n" for a, b, text in HELLO_BOB)
    assert shown(read(tmp_path, rows, "labels.txt").words) == HELLO_BOB


@pytest.mark.parametrize(
    ("written", "word"),
    [
        ("می\u200cخواهم", "می\u200cخواهم"),
        ("docu\u00admentation", "documentation"),
        ("\u200ehello\u200f", "hello"),
    ],
    ids=["Persian", "a hyphen of a line's end", "marks of direction"],
)
def test_letters_that_nobody_sees(tmp_path, written, word):
    times = read(tmp_path, f"1\n00:00:00,100 --> 00:00:01,000\n{written}\n", "times.srt")
    assert times.words == ((0.1, 1.0, word),)


def test_phrases_are_read_as_scripts_are(tmp_path):
    phrases = ["[SPEAKER_00]: hello", "BOB: [ Silence ]", "*sighs* bob", "(wind blowing)"]
    segments = [{"start": n, "end": n + 0.8, "text": f" {text}"} for n, text in enumerate(phrases)]
    times = read(tmp_path, {"segments": segments})
    assert times.words == ((0, 0.8, "hello"), (2, 2.8, "bob"))
    assert times.notes[1].startswith("not taken for speech: '[SPEAKER_00]', 'BOB:'")


def test_names_of_sounds_may_be_words(tmp_path):
    said = ["a", "pause", "of", "silence", "[noise]", "(laughs)", "!SIL", "++BREATH++"]
    said += ["%HESITATION", "sil", "bob(2)"]
    words = [{"word": word, "start": n, "end": n + 1} for n, word in enumerate(said)]
    times = read(tmp_path, {"words": words})
    assert [word for _, _, word in times.words] == ["a", "pause", "of", "silence", "bob"]
    assert times.notes == (
        "'pause', 'silence': taken for words that are said; for a sound, write [laughter]",
    )


def test_sounds_between_phrases_are_no_part_of_words(tmp_path):
    parts = [" Hello", "[Music]", "(laughs)", " Bob"]
    record = [
        {"offsets": {"from": 100 * n, "to": 100 * n + 100}, "text": parts[n]} for n in range(4)
    ]
    times = read(tmp_path, {"transcription": record})
    assert [word for _, _, word in times.words] == ["Hello", "Bob"]


def test_segments_that_whisperx_could_not_align_keep_their_words(tmp_path):
    segments = [
        {"start": 0.0, "end": 1.0, "text": " Hello there.", "words": []},
        {"start": 1.0, "end": 2.0, "text": " Bob", "words": timed("start", "end", "word")[1:]},
        {"start": 2.0, "end": 3.0, "text": " 2014.", "words": [{"word": "2014."}]},
    ]
    times = read(tmp_path, {"segments": segments})
    assert shown(times.words) == [
        *((0.0, 1.0, "Hello"), (0.0, 1.0, "there")),
        *((0.4, 0.8, "bob"), (2.0, 3.0, "2014.")),
    ]
    assert times.notes == ("words are looked for within the times of their segments",)


def test_answers_that_follow_each_other_in_a_file(tmp_path):
    """As Vosk prints them, over several lines each."""
    parts = [{"result": [word], "text": "x"} for word in timed("start", "end", "word")]
    text = "\n".join(json.dumps(part, indent=2) for part in parts)
    assert shown(read(tmp_path, text).words) == HELLO_BOB


def test_tiers_of_praatio(tmp_path):
    tier = {"class": "IntervalTier", "name": "words", "entries": [[*each] for each in HELLO_BOB]}
    assert shown(read(tmp_path, {"tiers": [tier]}).words) == HELLO_BOB


@pytest.mark.parametrize(
    "text",
    [
        "Name\tStart\tDuration\nhello\t0:00.050\t0:00.350\nbob\t0:00.400\t0:00.400\n",
        "#,Name,Start,End\nR1,hello,0:00.050,0:00.400\nR2,bob,0:00.400,0:00.800\n",
        "onset,offset,word\n0.05,0.4,hello\n0.4,0.8,bob\n",
    ],
    ids=["Audition", "Reaper", "onset and offset"],
)
def test_tables_of_markers(tmp_path, text):
    assert shown(read(tmp_path, text).words) == HELLO_BOB


def test_words_of_which_some_have_phones(tmp_path):
    hello, bob = timed("start", "end", "word")
    phones = [("HH", 0.05, 0.1), ("AH0", 0.1, 0.2), ("L", 0.2, 0.3), ("OW1", 0.3, 0.4)]
    hello["phonemes"] = [{"phoneme": name, "start": a, "end": b} for name, a, b in phones]
    times = read(tmp_path, {"words": [hello, bob]})
    assert [phone for _, _, phone in times.phones] == ["HH", "AH", "L", "OW"]
    assert times.unknown == ((0.4, 0.8),)
