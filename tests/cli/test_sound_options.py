"""Tracks, cut files, silence and frame rates on the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest
import soundfile

from elocute.audio.read import read_audio
from elocute.motion.store import load_motion
from tests.support.commands import run_here


@pytest.fixture
def film(tmp_path, speech_wav):
    """Two tracks, of which the first is silent."""
    import av

    sound = read_audio(speech_wav, sample_rate=16000).samples[:32000]
    path = tmp_path / "film.mkv"
    with av.open(str(path), "w") as file:
        streams = [file.add_stream("pcm_s16le", rate=16000, layout="mono") for _ in range(2)]
        for stream, heard in zip(streams, (0 * sound, sound), strict=True):
            samples = np.round(heard[None] * 32767).astype(np.int16)
            frame = av.AudioFrame.from_ndarray(samples, format="s16", layout="mono")
            frame.sample_rate, frame.pts = 16000, 0
            file.mux(stream.encode(frame))
            file.mux(stream.encode(None))
    return path


def told(*words):
    """What a command that succeeds tells on standard error."""
    done = run_here(*words)
    assert done.returncode == 0, done.stderr
    return done.stderr


def jaw(path):
    motion = load_motion(path)
    return motion.weights[:, motion.names.index("jawOpen")]


def test_silence_is_told_and_a_track_chosen(cli, refused, film, tmp_path):
    out = tmp_path / "talk.npz"
    said = told("animate", film, "-o", out)
    assert "no speech heard" in said
    assert "of 2 audio tracks the first is taken: --track takes another" in said
    assert jaw(out).max() < 0.02
    cli("animate", film, "--track", 1, "-o", out, "-o", tmp_path / "talk.glb", "--overwrite")
    assert jaw(out).max() > 0.1
    assert np.abs(read_audio(tmp_path / "talk.wav").samples).max() > 0.1  # what is heard beside it
    assert "1: pcm_s16le, 16000 Hz, 1 channel" in cli("info", film).stdout
    assert len(json.loads(cli("info", film, "--json").stdout)["tracks"]) == 2
    refused("animate", film, "--track", 2, "-o", tmp_path / "x.npz", says="allowed: 0 to 1")
    cli("phones", film, "--track", 1, "-o", tmp_path / "phones.csv")
    assert "no speech heard" in told("phones", film, "-o", tmp_path / "none.csv")


def test_a_sound_that_was_cut_off(cli, refused, speech_wav, tmp_path):
    cut = tmp_path / "cut.wav"
    soundfile.write(cut, read_audio(speech_wav).samples[:40000], 16000)
    cut.write_bytes(cut.read_bytes()[:60000])
    refused("animate", cut, "-o", tmp_path / "a.npz", says="take what is there with --partial")
    said = told("animate", cut, "--partial", "-o", tmp_path / "a.npz")
    assert "cut off: 1.87 of 2.50 s are there" in said
    assert jaw(tmp_path / "a.npz").max() > 0.05


def test_channels_that_cancel_are_told(speech_wav, tmp_path):
    sound = read_audio(speech_wav).samples[:40000]
    path = tmp_path / "inverted.wav"
    soundfile.write(path, np.stack([sound, -sound], axis=1), 16000)
    said = told("animate", path, "-o", tmp_path / "a.npz")
    assert "its channels cancel each other" in said and "--channel chooses another" in said
    assert jaw(tmp_path / "a.npz").max() > 0.1


@pytest.mark.parametrize(
    ("written", "rate"), [("30000/1001", 30000 / 1001), ("23.976", 24000 / 1001)]
)
def test_frame_rates_are_exact(cli, refused, speech_wav, tmp_path, written, rate):
    cli("animate", speech_wav, "--fps", written, "-o", tmp_path / "a.npz")
    assert load_motion(tmp_path / "a.npz").fps == rate
    cli("render", tmp_path / "a.npz", "--fps", 25, "-o", tmp_path / "b.npz")
    cli("edit", tmp_path / "b.npz", "--fps", written, "-o", tmp_path / "c.npz")
    assert load_motion(tmp_path / "c.npz").fps == rate
    refused("animate", speech_wav, "--fps", "fast", "-o", tmp_path / "d.npz", says="a fraction")
    refused("animate", speech_wav, "--fps", "900", "-o", tmp_path / "d.npz", says="240")
