"""What commands do about files that are there already, and about two outputs for one name."""

import json

import numpy as np
import pytest
import soundfile


@pytest.fixture
def say(tmp_path, speech_wav):
    """say("a/take.flac") puts half a second of speech there."""
    samples, rate = soundfile.read(speech_wav, frames=16000)

    def make(name):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True, parents=True)
        soundfile.write(path, samples, rate)
        return path

    return make


@pytest.fixture
def talk(say, tmp_path, cli):
    cli("animate", say("speech.wav"), "-o", tmp_path / "talk.npz")
    return tmp_path / "talk.npz"


def test_the_same_command_runs_twice(say, tmp_path, cli):
    speech = say("x.flac")
    for _ in range(2):
        cli("animate", speech, "-o", tmp_path / "take.glb", "-o", tmp_path / "take.obj")
    assert (tmp_path / "take.wav").is_file() and (tmp_path / "take.obj" / "00000.obj").is_file()
    assert not list((tmp_path / "take.obj").glob("*.npz"))  # it is the take, no folder of takes


def test_a_face_among_keyframes_is_an_input(tmp_path, talk, refused):
    face = tmp_path / "face.json"
    face.write_text("[0.5]")
    keys = f"0:{face}; 1:ada"
    refused("edit", talk, "--identity-over-time", keys, "-o", face, "--overwrite", says="input")
    assert face.read_text() == "[0.5]"


def test_a_recording_beside_the_glb_is_not_replaced(say, tmp_path, refused):
    """`animate x.flac -o take.glb` once replaced an unrelated take.wav."""
    speech, mine = say("x.flac"), tmp_path / "take.wav"
    mine.write_bytes(b"my recording")
    refused(
        "animate",
        speech,
        "-o",
        tmp_path / "take.glb",
        says="take.wav: exists already: a file where the sound",
    )
    assert mine.read_bytes() == b"my recording" and not (tmp_path / "take.glb").exists()


def test_no_clobber_leaves_it_and_writes_the_rest(say, tmp_path, run):
    speech, mine = say("x.flac"), tmp_path / "take.wav"
    mine.write_bytes(b"my recording")
    done = run("animate", speech, "-o", tmp_path / "take.glb", "--no-clobber")
    assert done.returncode == 0 and "take.wav: exists already; left as it is" in done.stderr
    assert mine.read_bytes() == b"my recording" and (tmp_path / "take.glb").is_file()
    again = run("animate", speech, "-o", tmp_path / "take.glb", "--no-clobber", "--json")
    assert json.loads(again.stdout)["kept"][0] == str(tmp_path / "take.glb")


def test_overwrite_replaces_it(say, tmp_path, cli):
    (tmp_path / "take.wav").write_bytes(b"my recording")
    cli("animate", say("x.flac"), "-o", tmp_path / "take.glb", "--overwrite")
    assert (tmp_path / "take.wav").read_bytes()[:4] == b"RIFF"


def test_an_input_is_not_destroyed_by_the_sound_beside_a_glb(say, tmp_path, talk, refused):
    """The part of take.wav that is kept would have gone to take.wav."""
    sound = say("take.wav")
    before = sound.read_bytes()
    target = tmp_path / "take.glb"
    for more in ([], ["--overwrite"]):
        refused(
            "edit",
            talk,
            "-o",
            target,
            "--sound",
            sound,
            "--from",
            "0.1",
            *more,
            says="take.wav: an input of this run",
        )
    assert sound.read_bytes() == before and not target.exists()


def test_a_sound_that_already_lies_beside_the_glb_stays(say, tmp_path, cli):
    sound = say("take.wav")
    before = sound.read_bytes()
    cli("animate", sound, "-o", tmp_path / "take.glb")
    assert sound.read_bytes() == before


def test_two_sounds_of_one_name_are_told_apart(say, tmp_path, refused):
    """Once one of the two was lost without a word."""
    say("clips/a.flac")
    say("clips/a.wav")
    out = tmp_path / "out"
    out.mkdir()
    refused("animate", tmp_path / "clips", "-o", out, says="clips/a.flac and")
    refused("animate", say("a/t.wav"), say("b/t.flac"), "-o", out, says="a/t.wav and")
    assert list(out.iterdir()) == []


def test_subfolders_are_mirrored_or_said_to_be_left_out(say, tmp_path, run):
    say("clips/one.wav")
    say("clips/deep/er/one.wav")
    done = run("animate", tmp_path / "clips", "-o", tmp_path / "out", "--format", "csv")
    assert done.returncode == 0 and "1 subfolder with sound left out" in done.stderr
    assert [p.name for p in (tmp_path / "out").rglob("*.csv")] == ["one.csv"]
    done = run("animate", tmp_path / "clips", "-o", tmp_path / "out", "-r", "--format", "csv")
    assert done.returncode == 0 and "left out" not in done.stderr
    assert (tmp_path / "out" / "deep" / "er" / "one.csv").is_file()


def test_a_stored_motion_is_no_output_of_itself(talk, tmp_path, refused):
    refused("edit", talk, "-o", talk, "--overwrite", says="talk.npz: an input of this run")
    refused("render", talk, "-o", talk, says="talk.npz: an input of this run")
    (tmp_path / "alias.npz").symlink_to(talk)
    refused("solve", talk, "-o", tmp_path / "alias.npz", says="an input of this run")


def test_every_writing_command_refuses_a_strangers_file(talk, tmp_path, refused, say):
    """Before anything is computed."""
    mine = {name: tmp_path / name for name in ("a.csv", "a.png", "a.json", "a.html", "a.obj")}
    for path in mine.values():
        path.write_text("mine")
    scan, corpus = tmp_path / "scan.ply", tmp_path / "corpus"
    for arguments, name in (
        (["measure", talk, "-o", mine["a.csv"]], "a.csv"),
        (["measure", talk, "-o", tmp_path / "b.csv", "--plot", mine["a.png"]], "a.png"),
        (["render", talk, "-o", mine["a.html"]], "a.html"),
        (["edit", talk, "-o", mine["a.csv"]], "a.csv"),
        (["solve", talk, "-o", mine["a.csv"]], "a.csv"),
        (["head", "sample", "-o", mine["a.png"]], "a.png"),
        (["capture", "scan", scan, "-o", mine["a.obj"]], "a.obj"),
        (["capture", "landmarks", scan, "-o", mine["a.json"]], "a.json"),
        (["capture", "simulate", say("s.wav"), "-o", mine["a.json"]], "a.json"),
        (["capture", "video", scan, "-o", mine["a.csv"]], "a.csv"),
        (["corpus", "convert", corpus, "-o", mine["a.json"]], "a.json"),
        (["blendshapes", "learn", corpus, "-o", mine["a.csv"]], "a.csv"),
        (["blendshapes", "show", talk, "-o", mine["a.png"]], "a.png"),
        (["blendshapes", "compare", corpus, talk, "-o", mine["a.json"]], "a.json"),
        (["style", "fit", talk, "-o", mine["a.json"]], "a.json"),
        (["words", "segment", say("s.wav"), "--text", "hm", "-o", mine["a.json"]], "a.json"),
        (["words", "check", mine["a.json"], say("s.wav"), "-o", mine["a.html"]], "a.html"),
        (["words", "take", talk, "-o", mine["a.json"]], "a.json"),
        (["align", say("s.wav"), say("r.wav"), "--plot", mine["a.png"]], "a.png"),
        (["evaluate", "corpus", corpus, "-o", mine["a.json"]], "a.json"),
        (["evaluate", "noise", say("s.wav"), "--plot", mine["a.png"]], "a.png"),
        (["evaluate", "styles", say("s.wav"), "--plot", mine["a.png"]], "a.png"),
    ):
        refused(*arguments, says=f"{name}: exists already: a file that was not made from")
    assert all(path.read_text() == "mine" for path in mine.values())


def test_a_strangers_folder_is_never_replaced(talk, tmp_path, refused):
    (tmp_path / "talk.ply").mkdir()
    (tmp_path / "talk.ply" / "mine.txt").write_text("mine")
    for more in ([], ["--overwrite"]):
        refused("render", talk, "-o", tmp_path / "talk.ply", *more, says="a folder that was not")
    assert (tmp_path / "talk.ply" / "mine.txt").read_text() == "mine"


def test_missing_sound_is_said(talk, tmp_path, run):
    done = run("render", talk, "-o", tmp_path / "t.glb", "-o", tmp_path / "t.csv")
    assert done.returncode == 0
    assert done.stderr == "elocute: t.glb: without sound; --audio FILE adds it\n"
    done = run("edit", talk, "-o", tmp_path / "e.html", "--jaw", "2,0,0")
    assert "e.html: without sound; --audio FILE adds it" in done.stderr


def test_python_replaces_what_is_named_and_nothing_beside_it(say, tmp_path):
    import elocute
    from elocute.errors import OutputError

    take = elocute.animate(say("x.flac"))
    (tmp_path / "take.glb").write_text("named, so replaced")
    (tmp_path / "take.wav").write_text("not named, so kept")
    with pytest.raises(OutputError, match=r"take\.wav: .*overwrite=True replaces it"):
        take.write(tmp_path / "take.glb")
    assert (tmp_path / "take.wav").read_text() == "not named, so kept"
    take.write(tmp_path / "take.glb", overwrite=True)
    take.write(tmp_path / "take.glb")  # made of this very sound, so it may
    assert len(np.asarray(soundfile.read(tmp_path / "take.wav")[0])) > 10000


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--phones", ""), "--phones '': no name"),
        (("--phones=",), "--phones '': no name"),
        (("-o", ""), "--output '': no name"),
        (("--head", ""), "head '': unknown"),
    ],
)
def test_an_empty_name_is_said_to_be_one(say, tmp_path, refused, words, told):
    """As a variable of the shell that is not set gives."""
    refused("animate", say("x.wav"), "-o", tmp_path / "a.csv", *words, says=told)
    assert not (tmp_path / "a.csv").exists()


def test_a_long_number_is_not_echoed(tmp_path, run):
    for words in (
        ("head", "sample", "-o", tmp_path / "a", "--count"),
        ("head", "sample", "-o", tmp_path / "a", "--seed"),
    ):
        told = run(*words, "9" * 400)
        assert told.returncode == 2 and len(told.stderr) < 120, told.stderr
        assert words[-1] in told.stderr
