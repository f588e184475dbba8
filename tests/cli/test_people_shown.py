"""Whatever command makes a motion of the built-in head, a person is seen, not a bust."""

from __future__ import annotations

import pytest

from elocute import load_motion
from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.head.looks import PEOPLE


@pytest.fixture(scope="module")
def take(speech_wav, tmp_path_factory):
    place = tmp_path_factory.mktemp("take") / "talk"
    speech = read_audio(speech_wav)
    word = Waveform(speech.samples[32000:64000], speech.sample_rate)
    spoken = animate(word, fps=2, identity="esi")
    for suffix in (".npz", ".json", ".npy"):
        spoken.write(place.with_suffix(suffix))
    return place


def test_curves_move_the_mean_person(take, tmp_path, cli):
    cli("render", take.with_suffix(".json"), "-o", tmp_path / "back.npz")
    assert load_motion(tmp_path / "back.npz").head.look == PEOPLE["mean"]


@pytest.mark.parametrize(
    ("given", "options", "who"),
    [
        pytest.param(".npy", ["--fps", 2, "--identity", "esi"], "esi", marks=pytest.mark.slow),
        (".npy", ["--fps", 2], "mean"),
        (".npz", [], "esi"),
        pytest.param(".npz", ["--identity", "otto"], "otto", marks=pytest.mark.slow),
    ],
)
def test_a_solved_motion_keeps_its_person(take, tmp_path, run, given, options, who):
    out = tmp_path / "solved.npz"
    result = run("solve", take.with_suffix(given), "-o", out, *options)
    assert result.returncode == 0, result.stderr
    assert load_motion(out).head.look == PEOPLE[who]
