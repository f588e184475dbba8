"""`study new`: alike in size, length and loudness, made once, and only of what is in the folder."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import OutputError, StudyError
from elocute.study.design.design_file import read_design
from elocute.study.stimuli.manifest import open_study
from elocute.study.stimuli.sources import inside, named_file, with_found_sounds
from elocute.study.stimuli.stimuli import make_stimuli
from elocute.study.stimuli.stimulus_sound import RATE, heard, voice_noise
from tests.study.studies import FLASHES_S, FPS, HEAD, QUICK, SECONDS, VIDEOS, flashing


def pictures(path: Path) -> np.ndarray:
    """(frame, height, width, 3) of a video."""
    with av.open(str(path)) as file:
        return np.stack([each.to_ndarray(format="rgb24") for each in file.decode(video=0)])


def level_of(samples: np.ndarray) -> float:
    """Root mean square, dB of full scale."""
    return float(10 * np.log10(np.mean(np.square(samples, dtype=np.float64)) + 1e-12))


@pytest.fixture
def folders(videos, tmp_path) -> Path:
    """Copies of the two folders of videos."""
    for name in ("ours", "theirs"):
        shutil.copytree(videos / name, tmp_path / name)
    (tmp_path / "study.toml").write_text(HEAD + VIDEOS + QUICK)
    return tmp_path


def test_two_folders_of_videos_become_pairs_of_one_size_and_length(flashes):
    study = open_study(flashes)
    study.check_videos()
    names = {each.name for each in study.design.stimuli.sounds}
    assert names == {"one", "two", "three"}
    pair = study.manifest.videos["ours+theirs/one.mean.front"]
    seen = pictures(flashes / pair.file)
    assert seen.shape == (round(SECONDS * FPS), 64, 128, 3)
    assert seen[2, 32, 32, 2] > 150 > seen[2, 32, 96, 2]  # ours is the blue one, on the left
    for at in FLASHES_S:
        first = round(at * FPS)
        assert seen[first].min() > 230 and seen[first - 1].max() < 230  # both, in one picture


def test_the_sound_is_at_the_level_of_the_study_and_in_its_place(flashes):
    sound = read_audio(flashes / "pairs/ours+theirs/one.mean.front.mp4")
    loud = np.abs(sound.samples) > 0.5 * np.abs(sound.samples).max()
    begins = np.flatnonzero(np.diff(loud.astype(int)) > 0)
    assert begins[0] / sound.sample_rate == pytest.approx(FLASHES_S[0], abs=0.002)
    assert level_of(sound.samples) == pytest.approx(-23, abs=0.3)


def test_a_mismatched_video_has_its_own_sound_and_the_pictures_of_another(flashes):
    one = pictures(flashes / "videos/mismatched/one.mean.front.mp4")[2].mean((0, 1))
    own = pictures(flashes / "videos/ours/one.mean.front.mp4")[2].mean((0, 1))
    assert abs(one[1] - own[1]) > 5  # the green of another sentence


def test_what_is_made_is_not_made_again(folders):
    made = make_stimuli(folders / "study.toml", folders / "study")
    assert (made.rendered > 6, made.kept) == (True, 0)
    again = make_stimuli(folders / "study.toml", folders / "study")
    assert (again.rendered, again.kept) == (0, made.rendered)
    flashing(folders / "theirs" / "two.mp4", (10, 20, 30))  # another video of the same name
    third = make_stimuli(folders / "study.toml", folders / "study")
    assert third.rendered == 2  # the clip, and the pair that it is in


def test_what_was_tampered_with_is_found_and_made_again(folders):
    make_stimuli(folders / "study.toml", folders / "study")
    study = open_study(folders / "study")
    video = folders / "study/videos/ours/one.mean.front.mp4"
    video.write_bytes(video.read_bytes()[:-1] + b"x")
    (folders / "study/pairs/ours+theirs/two.mean.front.mp4").unlink()
    assert make_stimuli(folders / "study.toml", folders / "study").rendered == 2
    study.check_videos()


def test_a_run_that_was_cut_off_goes_on(folders, monkeypatch):
    from elocute.study.stimuli import stimuli

    make, count = stimuli._make_clip, 0

    def cut_off(task):
        nonlocal count
        count += 1
        if count == 3:
            raise KeyboardInterrupt
        return make(task)

    monkeypatch.setattr(stimuli, "_make_clip", cut_off)
    with pytest.raises(KeyboardInterrupt):
        make_stimuli(folders / "study.toml", folders / "study")
    monkeypatch.setattr(stimuli, "_make_clip", make)
    assert make_stimuli(folders / "study.toml", folders / "study").kept == 2


def test_a_study_with_answers_keeps_its_videos(folders):
    make_stimuli(folders / "study.toml", folders / "study")
    (folders / "study/answers.db").write_bytes(b"")
    make_stimuli(folders / "study.toml", folders / "study")
    text = (folders / "study.toml").read_text().replace("Flashes", "Other")
    (folders / "study.toml").write_text(text)
    with pytest.raises(StudyError, match="answers to another study"):
        make_stimuli(folders / "study.toml", folders / "study")


@pytest.fixture
def made(flashes, tmp_path) -> Path:
    """A copy of the folder of a study."""
    return Path(shutil.copytree(flashes, tmp_path / "study"))


def test_a_changed_file_beside_the_videos_is_refused(made):
    with (made / "study.toml").open("a") as file:
        file.write("\n# a remark\n")
    with pytest.raises(StudyError, match="another study"):
        open_study(made)


@pytest.mark.parametrize("file", ["../../x.mp4", "/etc/passwd", "videos/../../a/b.mp4", "pairs/x"])
def test_a_manifest_names_only_its_own_videos(made, file):
    path = made / "manifest.json"
    record = json.loads(path.read_text())
    record["videos"][0]["file"] = file
    path.write_text(json.dumps(record))
    with pytest.raises(StudyError, match="manifest"):
        open_study(made)


def test_a_folder_with_other_files_is_left_alone(folders):
    (folders / "full").mkdir()
    (folders / "full/thesis.txt").write_text("x")
    with pytest.raises(OutputError, match="other files"):
        make_stimuli(folders / "study.toml", folders / "full")


def test_a_video_that_is_too_short_is_told(folders):
    flashing(folders / "theirs/two.mp4", (10, 20, 30), seconds=0.6)
    with pytest.raises(StudyError, match=r"two.*0\.60 s of pictures; allowed: 1\.2"):
        make_stimuli(folders / "study.toml", folders / "study")


def test_a_missing_video_is_told_before_any_is_made(folders):
    (folders / "theirs/two.mp4").unlink()
    with pytest.raises(StudyError, match=r"`videos`: no two in .*theirs"):
        make_stimuli(folders / "study.toml", folders / "study")
    assert not (folders / "study/videos").exists()


def test_brightness_that_differs_is_told(folders):
    for name in ("one", "two", "three"):
        flashing(folders / f"theirs/{name}.mp4", (5, 5, 5))
    made = make_stimuli(folders / "study.toml", folders / "study")
    told = [each for each in made.manifest.notes if "theirs" in each]
    assert len(told) == 3 and "brightness" in told[0]


OUT = ["../x", "/etc/passwd", "a/../../x", "", "link/x", "\0"]


@pytest.mark.parametrize("name", OUT)
def test_names_stay_in_the_folder(tmp_path, name):
    (tmp_path / "in").mkdir()
    (tmp_path / "in/link").symlink_to(tmp_path)
    with pytest.raises(StudyError):
        inside(tmp_path / "in", name, "sounds")


def test_an_offset_moves_the_picture_and_leaves_the_sound(folders):
    text = (HEAD + VIDEOS + QUICK).replace('name = "theirs"', 'name = "theirs"\noffset_ms = 120')
    (folders / "study.toml").write_text(text)
    make_stimuli(folders / "study.toml", folders / "study")
    seen = pictures(folders / "study/pairs/ours+theirs/one.mean.front.mp4")
    pad = round(0.12 * FPS)
    assert len(seen) == round((SECONDS + 0.24) * FPS)
    flash = [np.flatnonzero(side.mean((1, 2, 3)) > 230)[0] for side in np.split(seen, 2, axis=2)]
    assert flash == [round(FLASHES_S[0] * FPS) + pad, round(FLASHES_S[0] * FPS)]


def test_noise_and_silence(folders):
    text = (HEAD + VIDEOS + QUICK).replace("binary", "intelligibility")
    words = 'word = "one", choices = ["one", "two", "three", "four"]'
    text = text.replace('["ours/*.mp4"]', f'[{{file = "ours/*.mp4", {words}}}]')
    text = text.replace('name = "theirs"', 'name = "theirs"\nsnr_db = -10')
    text = text.replace(
        "[stimuli]", '[[conditions]]\nname = "mute"\nvideos = "ours"\nsilent = true\n[stimuli]'
    )
    (folders / "study.toml").write_text(text)
    make_stimuli(folders / "study.toml", folders / "study")
    clean, noisy = (
        read_audio(folders / f"study/videos/{name}/one.mean.front.mp4")
        for name in ("ours", "theirs")
    )
    quiet = slice(round(0.1 * RATE), round(0.3 * RATE))  # before the first beep
    assert level_of(clean.samples[quiet]) < -60 < -40 < level_of(noisy.samples[quiet])
    with av.open(str(folders / "study/videos/mute/one.mean.front.mp4")) as file:
        assert not file.streams.audio


def test_noise_has_the_spectrum_of_the_voice_and_its_ratio():
    rng = np.random.default_rng(0)
    voice = Waveform(rng.normal(0, 0.1, RATE).astype(np.float32), RATE)
    noise = voice_noise(voice, 1)
    spectra = [np.abs(np.fft.rfft(each)) for each in (voice.samples, noise)]
    assert np.allclose(*(each[1:-1] for each in spectra), rtol=1e-2, atol=1e-1)
    mixed = heard(voice, level_db=-23, snr_db=6, seconds=1.0)
    share = (mixed @ voice.samples) / (voice.samples @ voice.samples)
    clean = (voice.samples * share).astype(np.float32)
    assert level_of(clean) - level_of(mixed - clean) == pytest.approx(6, abs=1)
    assert level_of(mixed) == pytest.approx(-23, abs=0.1)


def test_a_model_is_drawn_on_the_face_that_is_named(tmp_path):
    (tmp_path / "study.toml").write_text(
        HEAD
        + """
[[conditions]]
name = "rules"
model = "articulation"

[[conditions]]
name = "still"
model = "articulation"
still = true

[stimuli]
sounds = [{file = "example:example.flac", name = "short", start_s = 0.6, end_s = 1.1}]
identities = ["esi"]
size = [64, 64]
fps = 10

[qualification]
items = 0
right = 0

[catch]
every = 0
"""
    )
    make_stimuli(tmp_path / "study.toml", tmp_path / "study")
    seen = pictures(tmp_path / "study/pairs/rules+still/short.esi.front.mp4").astype(int)
    assert seen.shape == (5, 64, 128, 3)
    moved = np.abs(np.diff(seen, axis=0)).mean((0, 1, 3))
    assert moved[:64].mean() > 3 * moved[64:].mean()


def test_a_pattern_gives_each_sound_once(folders):
    shutil.copy(folders / "ours/one.mp4", folders / "ours/one.esi.mp4")
    design = with_found_sounds(read_design(folders / "study.toml"), folders)
    assert [each.name for each in design.stimuli.sounds] == ["one", "three", "two"]
    changed = replace(design.stimuli.sounds[0], file="nothing/*.mp4")
    empty = replace(design, stimuli=replace(design.stimuli, sounds=(changed,)))
    with pytest.raises(StudyError, match="no such sound"):
        with_found_sounds(empty, folders)


def test_a_plan_counts_what_a_pattern_finds(folders, capsys):
    from tests.support.commands import run_here

    study = folders / "study.toml"
    told = run_here("study", "plan", study, "--simulations", "100", "--json")
    assert json.loads(told.stdout)["plan"]["stimuli"] == 3
    (folders / "moved").mkdir()
    moved = shutil.copy(study, folders / "moved")
    told = run_here("study", "plan", moved, "--data", folders, "--simulations", "100", "--json")
    assert json.loads(told.stdout)["plan"]["stimuli"] == 3
    assert run_here("study", "plan", moved).returncode == 2  # nothing fits the pattern there


def test_a_crowd_answers_what_a_pattern_finds(folders):
    from elocute.study.report.answers import read_answers
    from tests.support.commands import run_here

    made = folders / "answers.csv"
    run_here("study", "simulate", folders / "study.toml", "-o", made, "--people", "5")
    seen = {each.stimulus for each in read_answers(made)}
    assert seen == {f"{name}.mean.front" for name in ("one", "two", "three")}


OUTSIDE = ("/private.png", "../private.png", "../private.JSON", "..\\private.onnx", "/private")
FIELDS = ("model", "style", "mood", "life", "mesh", "background", "light", "look")


@pytest.mark.parametrize("name", OUTSIDE)
def test_every_path_of_a_study_stays_in_its_folder(tmp_path, name):
    """One rule for whatever holds a path: it is refused before anything is made."""
    for field in FIELDS:
        condition = {"model": "articulation"}
        stimuli = {} if field in FIELDS[:5] else {field: name}
        condition |= {} if stimuli else {field: name}
        told = "".join(f"{key} = {json.dumps(value)}\n" for key, value in condition.items())
        more = "".join(f"{key} = {json.dumps(value)}\n" for key, value in stimuli.items())
        (tmp_path / "study.toml").write_text(
            HEAD
            + f"[[conditions]]\nname = 'a'\n{told}[[conditions]]\nname = 'b'\n{told}"
            + f"[stimuli]\nsounds = ['example:example.flac']\n{more}"
            + "[qualification]\nitems = 0\n[catch]\nevery = 0\n"
        )
        with pytest.raises(StudyError, match=rf"`{field}`: .*inside"):
            make_stimuli(tmp_path / "study.toml", tmp_path / "study")


@pytest.mark.parametrize(
    "name", ["voca", "happy:0.6", "calm:0.7,broad:.3", "0.5", "#8a8f98", "studio", "auto", "1"]
)
def test_a_plain_name_is_no_path(tmp_path, name):
    assert named_file(tmp_path, name, "`style`") is None


def test_a_picture_in_the_folder_is_the_background(tmp_path):
    """Of the corner of every video; a changed picture makes other videos."""
    from PIL import Image

    Image.new("RGB", (64, 64), (255, 0, 0)).save(tmp_path / "red.png")
    (tmp_path / "study.toml").write_text(
        HEAD
        + """
[[conditions]]
name = "rules"
model = "articulation"
[[conditions]]
name = "half"
model = "articulation"
strength = 0.5
[stimuli]
sounds = [{file = "example:example.flac", start_s = 0.5, end_s = 0.7}]
size = [64, 64]
fps = 10
background = "red.png"
look = "none"
[qualification]
items = 0
[catch]
every = 0
"""
    )
    made = make_stimuli(tmp_path / "study.toml", tmp_path / "study")
    assert made.rendered == 3
    seen = pictures(next((tmp_path / "study/videos").rglob("*.mp4")))[0, 1, 1]
    assert seen[0] > 200 and seen[1] < 60 and seen[2] < 60
    Image.new("RGB", (64, 64), (0, 0, 255)).save(tmp_path / "red.png")
    assert make_stimuli(tmp_path / "study.toml", tmp_path / "study").rendered == 3
