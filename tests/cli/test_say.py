"""`elocute say`, and what `animate` does with a text or known times."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

import elocute
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.speech.voices import espeak
from tests.support.commands import run_bytes, run_here
from tests.support.espeak import has_espeak

SPOKEN = (
    "Hello. Give me any voice, and I will give it a face. My mouth closes on p, b and m. "
    "Five wolves move through the blue fog. Now I rest."
)
STRANGE = "seven elephants crossed an angry river because tomorrow nobody will remember"


@pytest.fixture(scope="module", autouse=True)
def _needs_espeak(need):
    need(has_espeak(), "espeak-ng")


def refused(*arguments: object) -> str:
    done = run_here(*arguments)
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1
    return done.stderr


def test_a_text_becomes_a_talking_head_with_its_sound_beside(tmp_path):
    done = run_here(
        "say", "Mum, pop by.", "-o", tmp_path / "t.glb", "-o", tmp_path / "t.npz", "--json"
    )
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    sound = elocute.read_audio(tmp_path / "t.wav")
    assert abs(record["duration_s"] - sound.duration_s) < 0.05
    again = run_here("say", "Mum, pop by.", "-o", tmp_path / "t.glb")
    assert again.returncode == 0, "the same command runs again"
    assert "not the text" in refused("say", "Mum, pop up.", "-o", tmp_path / "t.glb")


def test_lips_close_where_the_text_has_p_b_and_m():
    spoken = espeak.speak("A happy baby came up.")
    take = elocute.say("A happy baby came up.", style="plain")
    closed = elocute.measure_mouth(take.motion)["opening_mm"] < CLOSED_MM
    for start, end, phone in spoken.phones:
        inside = closed[int(np.ceil(start * 60)) : int(end * 60) + 1]
        if phone in ("P", "B", "M"):
            assert inside.any(), (start, end, phone)
        elif phone in ("AE", "EY", "IY", "AH"):
            assert not inside.all(), (start, end, phone)


def test_standard_input_and_output(tmp_path):
    done = run_bytes("say", "-", "-o", "-", "--format", "csv", input=b"Hello, Bob.")
    assert done.returncode == 0 and done.stdout.startswith(b"Timecode,")
    (tmp_path / "words.txt").write_text("Hello, Bob.", encoding="utf-8")
    done = run_here("say", "--file", tmp_path / "words.txt", "-o", tmp_path / "t.npz")
    assert done.returncode == 0, done.stderr


def test_what_say_refuses(tmp_path):
    out = ("-o", tmp_path / "t.npz")
    assert "no text; allowed" in refused("say", *out)
    assert "a text and --file" in refused("say", "hi", "--file", "x.txt", *out)
    assert "suffix '.wav'" in refused("say", "hi", "-o", tmp_path / "t.wav")
    assert "--rate: 9; allowed: 80 to 450" in refused("say", "hi", "--rate", 9, *out)
    assert "--language xx: unknown" in refused("say", "hi", "--language", "xx", *out)
    assert not list(tmp_path.iterdir())
    assert run_here("say", *out, "--", "-x").returncode == 0, "a text may look like an option"


@pytest.fixture
def table(tmp_path, speech_wav) -> Path:
    (tmp_path / "rec").mkdir()
    (tmp_path / "rec" / "one.flac").write_bytes(speech_wav.read_bytes())
    (tmp_path / "outside.flac").symlink_to(speech_wav)
    rows = [
        "id,text,audio,voice,style,language,rate",
        'greet,"Hello, Bob. My map!",,f2,calm,,140',
        "../evil,hi,,,,,",
        "=cmd|' /C calc'!A0,hi,,,,,",
        "con.x,hi,,,,,",
        "GREET,again,,,,,",
        "de,Mein Papa mag Bananen.,,,broad,de,",
        f'read,"{SPOKEN}",rec/one.flac,,,,',
        f"wrong,{STRANGE},rec/one.flac,,,,",
        "up,,../../etc/passwd,,,,",
        "link,,outside.flac,,,,",
        "style,hi,,,/etc/passwd.json,,",
        "none,,,,,,",
        "bad,hi\x01,,,,,",
    ]
    path = tmp_path / "lines.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def test_a_table_gives_a_folder_of_takes_the_good_ones(table, tmp_path):
    command = ("say", "--table", table, "-o", tmp_path / "takes", "--format", "csv", "--fps", 25)
    done = run_here(*command)
    assert done.returncode == 1
    made = {path.name for path in (tmp_path / "takes").iterdir()}
    assert made == {"greet.csv", "de.csv", "read.csv"}
    for name in ("../evil", "con.x", "GREET", "wrong", "up", "link", "style", "none", "bad"):
        assert re.search(rf"^elocute: {re.escape(name)}: ", done.stderr, re.M), name
    assert "id of row 2 too" in done.stderr and "10 of 13 failed" in done.stderr

    (tmp_path / "takes" / "de.csv").unlink()
    before = (tmp_path / "takes" / "greet.csv").stat().st_mtime_ns
    again = run_here(*command, "--jobs", 2, "--json")
    records = [json.loads(line) for line in again.stdout.splitlines()]
    made = {each["id"]: each for each in records if "outputs" in each}
    assert [name for name, each in made.items() if each["outputs"]] == ["de"]
    assert (tmp_path / "takes" / "greet.csv").stat().st_mtime_ns == before


def test_a_changed_line_is_made_again_only_where_that_is_said(tmp_path):
    table, out = tmp_path / "lines.csv", tmp_path / "takes"
    table.write_text("id,text\na,Hello Bob.\n")
    command = ("say", "--table", table, "-o", out, "--format", "csv", "--fps", 25)
    assert run_here(*command).returncode == 0
    table.write_text("id,text\na,Hello Pam.\n")
    done = run_here(*command)
    assert done.returncode == 1 and "--overwrite replaces it" in done.stderr
    assert run_here(*command, "--overwrite").returncode == 0


def test_a_take_never_replaces_the_table(tmp_path):
    table = tmp_path / "lines.csv"
    table.write_text("id,text\nlines,Hello Bob.\n")
    done = run_here("say", "--table", table, "-o", tmp_path, "--format", "csv", "--overwrite")
    assert done.returncode == 1 and "an input of this run" in done.stderr
    assert table.read_text() == "id,text\nlines,Hello Bob.\n"


def test_a_table_of_excel_with_columns_of_its_owner(tmp_path):
    table, out = tmp_path / "lines.csv", tmp_path / "takes"
    table.write_text('\ufeffid;speaker;text;strength;notes\ngreet;BOB;"Hi; Bob.";0,8;loud\n')
    done = run_here("say", "--table", table, "-o", out, "--format", "csv")
    assert done.returncode == 0 and (out / "greet.csv").is_file()
    table.write_text("id\ttext\tpitch\ta\nb\tHi.\thigh\tc\n")
    done = run_here("say", "--table", table, "-o", out, "--format", "csv")
    assert done.returncode == 1 and "row 2: pitch: 'high'" in done.stderr


def test_what_a_table_refuses_as_a_whole(tmp_path):
    table, out = tmp_path / "lines.csv", ("-o", tmp_path / "takes")
    for text, says in (
        ("", "columns missing"),
        ("id,text,languages\n", "column 'languages'"),
        ("id,text,text\n", "column 'text' twice"),
        ("id,text\n", "no rows"),
        ('id,text\na,"' + "x" * 200_000 + '"\n', "not a CSV"),
    ):
        table.write_text(text)
        assert says in refused("say", "--table", table, *out)
    table.write_text("id,text\n" + "a,b\n" * 100_001)
    assert "too many rows" in refused("say", "--table", table, *out)
    table.write_text("id,text\na,b\n")
    assert "no single folder" in refused("say", "--table", table, "-o", tmp_path / "t.glb")
    assert "a text too" in refused("say", "hi", "--table", table, *out)
    assert not (tmp_path / "takes").exists()


def test_a_transcript_sharpens_and_a_wrong_one_is_refused(speech_wav, tmp_path):
    out = ("-o", tmp_path / "t.npz", "--fps", 25)
    assert run_here("animate", speech_wav, "--text", SPOKEN, *out).returncode == 0
    told = refused("animate", speech_wav, "--text", STRANGE, "-o", tmp_path / "u.npz")
    assert "words that do not match the sound" in told and not (tmp_path / "u.npz").exists()
    half = SPOKEN.replace("Five wolves", "Five zebras and rhinoceroses")
    done = run_here("animate", speech_wav, "--text", half, *out)
    assert done.returncode == 0 and "left to the encoder: " in done.stderr


def test_options_of_known_speech_exclude_each_other(speech_wav, tmp_path):
    out = ("-o", tmp_path / "t.npz")
    assert "--text too" in refused("animate", speech_wav, "--text", "hi", "--phones", "p.csv", *out)
    told = refused(
        "animate", speech_wav, speech_wav, "--text", "hi", "-o", tmp_path, "--format", "npz"
    )
    assert "several recordings" in told


def test_a_model_that_takes_no_phones_says_so(speech_wav, tmp_path):
    times = tmp_path / "p.csv"
    times.write_text("start_s,end_s,phone\n0.5,0.7,M\n0.7,1.2,AA1\n")
    out = ("-o", tmp_path / "t.npz", "--fps", 25, "--phones", times)
    done = run_here("animate", speech_wav, "--model", "crnn", *out)
    assert done.returncode == 0 and "phones move its contacts alone" in done.stderr
    told = refused("animate", speech_wav, "--model", "crnn", "--contacts", "off", *out)
    assert "a model that takes phones" in told
    assert run_here("animate", speech_wav, "--model", "voca", *out).stderr == ""
