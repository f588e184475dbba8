"""JSON, text and CSV, and the texts of options."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.fuzzing.seeds.making import place, small_head, small_motion
from tests.fuzz.fuzzing.seeds.media import encoded, write_wav


def identities(folder: Path) -> None:
    numbers = [round(0.1 * i - 2, 2) for i in range(50)]
    (place(folder, "one") / "face.json").write_text(json.dumps({"identity": numbers}))


def styles(folder: Path) -> None:
    (place(folder, "fields") / "style.json").write_text('{"amplitude": 1.2, "hold_s": 0.1}')
    (place(folder, "mix") / "style.json").write_text('{"mix": {"calm": 0.7, "broad": 0.3}}')


def mixes(folder: Path) -> None:
    (place(folder, "mix") / "mix.json").write_text('{"mix": {"anna": 0.7, "bob": 0.3}, "n": 1}')


SHORT_GRID = """File type = "ooTextFile"
Object class = "TextGrid"

0
1.5
<exists>
2
"IntervalTier"
"words"
0
1.5
3
0
0.4
""
0.4
0.9
"hello"
0.9
1.5
"world"
"TextTier"
"points"
0
1.5
1
0.7
"here"
"""


def words(folder: Path) -> None:
    from elocute.speech.text.word_times import TimedWord, TimedWords, write_words

    said = TimedWords((TimedWord("she", 0.1, 0.4, 0.9), TimedWord("had", 0.5, 0.9, 0.8)), 1.5)
    write_words(said, place(folder, "json") / "words.json")
    write_words(said, place(folder, "long") / "words.TextGrid")
    (place(folder, "short") / "words.TextGrid").write_text(SHORT_GRID)
    (place(folder, "utf16") / "words.TextGrid").write_bytes(SHORT_GRID.encode("utf-16"))


def parts(folder: Path) -> None:
    record = {"phones": [[0, 0.1, "S"], [0.1, 0.3, "IY"]], "word": [0.0, 0.3]}
    (place(folder, "one") / "parts.json").write_text(json.dumps(record))


def phones(folder: Path) -> None:
    text = "start_s,end_s,phone\n0,0.1,SIL\n0.1,0.22,HH\n0.22,0.4,AH0\n0.4,0.6,L\n"
    (place(folder, "one") / "phones.csv").write_text(text)
    table = "Begin,End,Label,Type,Speaker\n0.1,0.4,hello,words,ann\n0.1,0.2,HH,phones,ann\n"
    (place(folder, "mfa") / "phones.csv").write_text(table)
    (place(folder, "ctm") / "phones.ctm").write_text("a 1 0.1 0.1 HH_B\na 1 0.2 0.1 AH0_E\n")
    (place(folder, "grid") / "phones.TextGrid").write_text(SHORT_GRID)
    marks = '{"time":6,"type":"word","start":0,"end":2,"value":"My"}\n'
    marks += '{"time":6,"type":"viseme","value":"p"}\n{"time":90,"type":"viseme","value":"a"}\n'
    (place(folder, "polly") / "phones.marks").write_text(marks)
    word = {"word": "hi", "start": 0.1, "end": 0.4, "phones": [{"phone": "hh_B", "duration": 0.1}]}
    inner = [{"Phoneme": "hh", "Offset": 1000000, "Duration": 900000}]
    ticks = {"Word": "hi", "Offset": 1000000, "Duration": 900000, "Phonemes": inner}
    tiers = {"phones": {"type": "interval", "entries": [[0.1, 0.2, "h"], [0.2, 0.4, "aɪ"]]}}
    letters = {"characters": ["h", "i"], "character_start_times_seconds": [0.1, 0.2]}
    records = {
        "azure": [{"audio_offset": 500000, "viseme_id": 19}, {"AudioOffset": 1, "VisemeId": 2}],
        "bounds": [{"Text": "hi", "AudioOffset": 1000000, "Duration": 900000}],
        "nbest": {"NBest": [{"Words": [ticks]}]},
        "gentle": {"words": [word]},
        "whisper": {"segments": [{"words": [word]}]},
        "tiers": {"start": 0, "end": 1, "tiers": tiers},
        "letters": letters | {"character_end_times_seconds": [0.2, 0.4]},
        "pairs": [[50, 0], [150, 19]],
        "columns": {"words": ["hi"], "wtimes": [50], "wdurations": [90]},
        "nested": {"results": [{"alternatives": [{"words": [word]}]}]},
        "moras": {"accent_phrases": [{"moras": [{"vowel": "a", "vowel_length": 0.1}]}]},
        "marks": {"timepoints": [{"markName": "hi", "timeSeconds": 0.1}]},
        "inworld": {
            "timestampInfo": {
                "wordAlignment": {
                    "words": ["hi"],
                    "wordStartTimeSeconds": [0.1],
                    "wordEndTimeSeconds": [0.4],
                }
            }
        },
        "visemes": {"visemes": [["PP", 0.1, 0.2]]},
        "stream": {"wordTimestamps": {"words": ["hi"], "start": [0.1], "end": [0.4]}},
    }
    plain = {
        "a.srt": "1\n00:00:00,100 --> 00:00:00,400\nBOB: <i>hi</i> (sighs)\n",
        "a.pho": "_ 51\nh 74\n@ 51 0 100\n",
        "a.lab": "0 3100000 sil\n3100000 4100000 m\n",
        "a.tsv": "0.00\tX\n0.10\tA\n0.20\tX\n",
        "a.dat": "MohoSwitch1\n1 rest\n3 MBP\n",
        "a.eaf": '<ANNOTATION_DOCUMENT><TIME_SLOT TIME_SLOT_ID="a" TIME_VALUE="10"/>'
        '<TIME_SLOT TIME_SLOT_ID="b" TIME_VALUE="90"/><TIER TIER_ID="words"><ALIGNABLE_ANNOTATION '
        'TIME_SLOT_REF1="a" TIME_SLOT_REF2="b"><ANNOTATION_VALUE>hi</ANNOTATION_VALUE>'
        "</ALIGNABLE_ANNOTATION></TIER></ANNOTATION_DOCUMENT>",
        "a.xml": '<rhubarbResult><mouthCue start="0" end="0.2">A</mouthCue></rhubarbResult>',
        "a.lrc": "[offset:+50]\n[00:01.00]Hi <00:01.50>you\n",
        "a.pgo": "lipsync version 1\na\n24\n9\n1\nv\nhi\n1\nhi\n1\n8\n1\nhi 1 8 1\n1 AI\n",
        "b.csv": "sep=;\ntmin;tier;text;tmax\n0,1;phones;M;0,2\n",
    }
    for name, text in plain.items():
        (place(folder, name.replace(".", "_")) / name).write_text(text)
    for name, record in records.items():
        (place(folder, name) / "phones.json").write_text(json.dumps(record))


def scripts(folder: Path) -> None:
    texts = {
        "a.srt": "1\n00:00:00,100 --> 00:00:00,400\nBOB: <i>hi</i> (sighs)\n\n2\n",
        "a.vtt": "WEBVTT\n\n00:00.100 --> 00:00.400\nhi<00:00.200><c> you</c>\n\n"
        "00:00.400 --> 00:00.800\nhi you\nand\n",
        "a.ass": "[Script Info]\n[Events]\nFormat: Start, End, Text\n"
        "Dialogue: 0:00:01.00,0:00:02.00,{\\k20}hi {\\p1}m 0 0{\\p0}you\\Ntoo\n",
        "a.txt": "BOB (whispers): (sighs) Hi [laughs] there.\nBob: You. (Yes)\n",
        "a.ssml": '<speak>Hi <sub alias="you">u</sub> &amp; <mark name="a"/><!-- b --></speak>',
    }
    for name, text in texts.items():
        (place(folder, name.replace(".", "_")) / name).write_text(text)


def lines(folder: Path) -> None:
    rows = "id,text,audio,voice,style,rate\na,Hello Bob,,f2,calm,140\nb,,rec/b.flac,,,\n"
    (place(folder, "one") / "lines.csv").write_text(rows)


def texts(folder: Path) -> None:
    (place(folder, "tsv") / "texts.tsv").write_text("anna\tsentence01\tShe had.\nbob\te02\tHi\n")
    record = {"anna": {"sentence01": "She had."}, "bob": {"e02": "Hi"}}
    (place(folder, "json") / "texts.json").write_text(json.dumps(record))


def landmarks(folder: Path) -> None:
    points = small_head().template[:68].astype(float)
    given = {"points": points.tolist(), "confidence": [0.9] * 68}
    given["points"][4] = None
    (place(folder, "json") / "00000.json").write_text(json.dumps(given))
    grouped = {"version": 2, "labels": [], "landmarks": {"points": points.tolist()}}
    (place(folder, "ljson2") / "00000.ljson").write_text(json.dumps(grouped))
    groups = {"version": 3, "groups": {"LJSON": {"landmarks": {"points": points.tolist()}}}}
    (place(folder, "ljson3") / "00000.ljson").write_text(json.dumps(groups))
    rows = "\n".join(" ".join(f"{x:.4f}" for x in row) for row in points)
    (place(folder, "pts") / "00000.pts").write_text(f"version: 1\nn_points: 68\n{{\n{rows}\n}}\n")
    (place(folder, "txt") / "00000.txt").write_text(rows)
    np.save(place(folder, "npy") / "00000.npy", points[17:])
    picked = "".join(
        f'<point name="{n}" x="{x}" y="{y}" z="{z}"/>\n' for n, (x, y, z) in enumerate(points)
    )
    (place(folder, "pp") / "00000.pp").write_text(f"<PickedPoints>\n{picked}</PickedPoints>")


def capture_folders(folder: Path) -> None:
    from elocute.capture.scans.scan_sequence import SequenceMetadata, write_metadata
    from elocute.registration.scan_file import write_scan

    head, inner = small_head(), place(folder, "one")
    metadata = SequenceMetadata(subject="anna", sentence="ah", text="ah", sound="ah.wav", neutral=0)
    write_metadata(inner, metadata)
    for number in range(2):
        write_scan(inner / f"{number:05}.ply", head.template, head.triangles)
    write_wav(inner / "ah.wav")


def word_records(folder: Path) -> None:
    from elocute.corpus.shards import ShardEntry
    from elocute.propagation.word_job import RejectedRecording, WordResult, save_word_result

    shard = ShardEntry("hello.parquet", 3, "0" * 64)
    record = WordResult(
        "hello", "d" * 64, shard, 2, 1, 4, (RejectedRecording("hello", "a.wav", "no"),), 1.5
    )
    save_word_result(record, place(folder, "one") / "hello.json")


def curves(folder: Path) -> None:
    from elocute.export.arkit_csv import POSE_COLUMNS
    from elocute.head.builtin import load_builtin_head

    names = [name[:1].upper() + name[1:] for name in load_builtin_head().expression_names]
    rows = [",".join(["Timecode", "BlendShapeCount", *names, *POSE_COLUMNS])]
    zeros = ",".join(["0.000000"] * len(POSE_COLUMNS))
    for frame in range(3):
        values = ",".join(f"{0.01 * (frame + i):.6f}" for i in range(len(names)))
        rows.append(f"00:00:00:{frame:06.3f},61,{values},{zeros}")
    (place(folder, "one") / "take.csv").write_text("\n".join(rows) + "\n")


def curves_json(folder: Path) -> None:
    from elocute.export.curves_json import write_json

    write_json(small_motion(turning=False), place(folder, "one") / "talk.json")


def edit_lists(folder: Path) -> None:
    """A list of each kind of edit, and one of all that a small motion takes."""
    span = {"from": 0.05, "to": "end-0.05", "blend": [0.02, 0.03]}
    keys = [[0, 0.1], [0.1, 0.5], ["end", 0]]
    edits = [
        {"edit": "style", "style": "calm", **span},
        {"edit": "mood", "mood": "sad:0.4"},
        {"edit": "offset", "seconds": -0.04},
        {"edit": "amplitude", "regions": {"jaw": 1.2, "head": 0.5}, **span},
        {"edit": "curve", "curve": "jawOpen", "keys": keys, "mode": "add", "between": "linear"},
        {"edit": "closed", "from": 0.05, "to": 0.1},
        {"edit": "head", "keys": [[0, [1, 2, 3]]], "mode": "replace"},
        {"edit": "gaze", "keys": [["end-0.1", [1, 2]]]},
        {"edit": "blinks", "add": [0.1], "remove": [0.1], "per_minute": 20, "seed": 3},
        {"edit": "face", "keys": [[0, "ada"], [0.1, 7]]},
        {"edit": "retime", "times": [[0, 0], ["end", 0.5]]},
        {"edit": "loop", "blend": 0.02},
    ]
    for edit in edits:
        record = {"elocute": "edits", "version": 1, "edits": [edit]}
        (place(folder, edit["edit"]) / "take.json").write_text(json.dumps(record))
    record = {"elocute": "edits", "version": 1, "edits": edits}
    (place(folder, "all") / "take.json").write_text(json.dumps(record))


def projects(folder: Path) -> None:
    """The least that a project may be, and one of all that it may hold."""
    least: dict[str, Any] = {"elocute_project": 1, "sound": "line.wav"}
    whole = {
        "text": "Hm.",
        "language": "en-us",
        "phones": [[0.1, 0.2, "HH"], [0.2, 0.4, "M"]],
        "words": [[0.1, 0.4, "Hm."]],
        "edits": [{"edit": "closed", "from": 0.05, "to": 0.1}],
        "settings": {"style": "calm:0.7,broad:0.3", "mood": "happy", "fps": 30, "life": 0.5},
        "options": {"light": "day", "size": [64, 64]},
        "locks": {"zoom": 2},
    }
    for name, record in (("least", least), ("whole", least | whole)):
        (place(folder, name) / "line.elocute.json").write_text(json.dumps(record))


def names(folder: Path) -> None:
    (place(folder, "one") / "names.txt").write_text("anna.ahanna\nbob.ahbob\n\ncy.ahcy\n")


def output_histories(folder: Path) -> None:
    """The file that remembers outputs, with two rows."""
    import sqlite3

    from elocute.files.output_history import _TABLE, DATABASE_NAME

    inner = place(folder, "one")
    (inner / "talk.wav").write_bytes(b"sound")
    with contextlib.closing(sqlite3.connect(inner / DATABASE_NAME)) as table, table:
        table.execute(_TABLE)
        for path in (b"/talk.glb", b"/face.csv"):
            row = path, b"talk.wav", b"5 1700000000"
            table.execute("INSERT INTO outputs (path, source, state) VALUES (?, ?, ?)", row)


def lrw(folder: Path) -> None:
    inner = place(folder, "one") / "lipread_mp4" / "ABOUT" / "train"
    inner.mkdir(parents=True)
    encoded(inner / "ABOUT_00001.mp4", "aac", 0.4)
    text = "Disk reference: 12345\nChannel: ANY\nDuration: 0.30 seconds\n"
    (inner / "ABOUT_00001.txt").write_text(text)


OPTIONS = {
    "size": ("800", "1280x720", "4k"),
    "mix": ("calm:0.7,broad:0.3", "plain"),
    "life": ("0.6", "0,head=1", "brows=0.5,blinks=0"),
    "mood": ("happy:0.6", "sad:0.5,tender:0.3"),
    "identity": ("mean", "17"),
    "keyframes": ("0:0,0,0; 1.5:0,20,0",),
    "numbers": ("1,2.5,-3",),
    "encoder": ("phones", "fbank"),
    "identities": ("0:mean; 2:5",),
    "text": ("She had your dark suit",),
}


def options(which: str):
    """Seeds of one option's texts."""

    def write(folder: Path) -> None:
        for number, text in enumerate(OPTIONS[which]):
            (place(folder, str(number)) / "text").write_text(text)

    return write
