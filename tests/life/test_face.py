"""Life on a face: what moves, and what stays as the mouth has it."""

from __future__ import annotations

import numpy as np
import pytest

import elocute
from elocute.animation import animate
from elocute.audio.waveform import Waveform
from elocute.life import MOODS
from elocute.models.registry import model_names
from elocute.motion.edits import with_pose
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.quaternions import to_axis_angle


@pytest.fixture(scope="module")
def still(speech_wav):
    return animate(speech_wav, life=0)


@pytest.fixture(scope="module")
def alive(speech_wav):
    return animate(speech_wav)


def opening(take):
    return measure_mouth(take.motion)["opening_mm"]


def _peaks(take):
    return take.curves.names, take.curves.values.max(axis=0)


def turns(motion, joint):
    """(frame, 3) degrees."""
    return np.degrees(to_axis_angle(motion.rotations[:, motion.head.joint_names.index(joint)]))


def test_without_life_only_the_mouth_moves(still):
    moved = {n for n, peak in zip(*_peaks(still), strict=True) if peak > 0}
    assert all(name.startswith(("mouth", "jaw", "tongue")) for name in moved)
    assert still.motion.rotations is None


def test_with_it_head_brows_lids_eyes_and_cheeks_do(alive):
    peak = dict(zip(alive.curves.names, alive.curves.values.max(axis=0), strict=True))
    for name in ("eyeBlinkLeft", "browInnerUp", "browOuterUpRight", "cheekSquintLeft"):
        assert peak[name] > 0.1, name
    assert peak["eyeBlinkLeft"] > 0.99
    assert max(peak[f"eyeLook{way}Left"] for way in ("Up", "Down", "In", "Out")) > 0.05
    assert 1 < np.abs(turns(alive.motion, "head")).max() < 8
    assert np.abs(turns(alive.motion, "jaw")).max() == 0


def test_stress_is_seen_above_the_mouth(alive):
    """Brows rise by two to four of their six to eight millimetres, lids and cheeks by a touch."""
    peak = dict(zip(alive.curves.names, alive.curves.values.max(axis=0), strict=True))
    assert 0.4 < peak["browInnerUp"] < 0.85 and 0.4 < peak["browOuterUpLeft"] < 0.85
    assert 0.1 < peak["eyeWideLeft"] < 0.3 and 0.1 < peak["eyeSquintLeft"] < 0.3
    assert 0.15 < peak["cheekSquintLeft"] < 0.4 and peak["browDownLeft"] < 0.25
    left, right = (alive.curves[f"browOuterUp{side}"] for side in ("Left", "Right"))
    assert 0.02 < np.abs(left - right).max() < 0.3


def test_brows_are_held_between_accents_too(alive):
    """As a head is held: they are not let go as soon as one is over."""
    raised = alive.curves["browInnerUp"]
    assert (raised > 0.01).mean() > 0.5
    assert np.median(raised[raised > 0.01]) < 0.25


def test_the_neck_takes_its_share(alive):
    neck, head = turns(alive.motion, "neck"), turns(alive.motion, "head")
    assert np.abs(neck / 0.4 - head / 0.6).max() < 0.01


def test_eyes_rest_on_what_they_look_at_while_the_head_turns(alive):
    """The eyes take a turn of the head back, as ours do."""
    curves = alive.curves
    left = 32 * (curves["eyeLookOutLeft"] - curves["eyeLookInLeft"])
    head = turns(alive.motion, "neck")[:, 1] + turns(alive.motion, "head")[:, 1]
    jumps, moved = np.diff(left), np.diff(head)
    resting = np.abs(jumps) < 0.5
    assert resting.mean() > 0.9
    assert np.corrcoef(jumps[resting], moved[resting])[0, 1] < -0.8


@pytest.mark.parametrize("mood", [*MOODS, "auto"])
def test_lips_that_meet_still_meet_in_every_mood(still, speech_wav, mood):
    """p, b and m as sealed as without life; only a resting mouth may part for a breath."""
    take = animate(speech_wav, mood=mood)
    sealed = (still.curves["mouthClose"] > 0.02) & (opening(still) < 0.05)
    assert sealed.sum() > 10
    assert opening(take)[sealed].max() < 0.1


@pytest.mark.parametrize("mood", [*MOODS, "auto"])
def test_no_mood_clips_a_shape(speech_wav, still, mood):
    """Every curve is within its range, and no mood takes a shape to its end."""
    curves = animate(speech_wav, mood=mood).curves
    assert curves.values.min() >= 0 and curves.values.max() <= 1
    spoken = still.curves.select(curves.names)
    for name in curves.names:
        if not name.startswith(("eyeBlink", "tongue")):
            assert curves[name].max() < max(0.97, spoken[name].max() + 1e-6), name


@pytest.mark.parametrize("mood", [mood for mood in MOODS if mood != "neutral"])
def test_a_mood_is_seen_at_rest(mood):
    silence = Waveform(np.zeros(16000, np.float32), 16000)
    face = animate(silence, mood=mood, life=0)
    assert np.abs(face.motion.vertices(0, 1) - face.motion.head.template).max() > 0.002
    half = animate(silence, mood=f"{mood}:0.5", life=0)
    assert 0 < half.motion.weights.max() < face.motion.weights.max()


def test_a_shut_lid_meets_the_other_and_goes_no_further(alive):
    """Lids that follow the eyes and squint give way to a blink."""
    shut = alive.curves["eyeBlinkLeft"] > 0.99
    for name in ("eyeSquintLeft", "eyeLookDownLeft", "eyeWideLeft", "eyeLookUpLeft"):
        assert alive.curves[name][shut].max() < 0.02


def test_a_pose_comes_on_top(alive):
    """The head still nods while it is turned by hand."""
    posed = with_pose(alive.motion, "head", (0, 20, 0))
    again = with_pose(posed, "head", (0, -20, 0))
    assert np.abs(again.rotations - alive.motion.rotations).max() < 1e-6
    assert np.abs(turns(posed, "head")[:, 1].mean() - 20) < 3


def test_a_stream_lives_as_the_same_person_does(speech_wav):
    sound = elocute.read_audio(speech_wav, sample_rate=16000)
    whole = animate(sound, identity="ben")
    live = elocute.stream(16000, identity="ben")
    values = np.stack([frame.values for frame in [*live.push(sound.samples), *live.flush()]])
    assert np.abs(values - whole.motion.weights).max() < 1e-5
    mean = animate(sound)
    assert np.abs(mean.motion.weights - whole.motion.weights).max() > 0.5
    mouth = ("jawOpen", "mouthClose", "mouthPucker", "mouthLowerDownLeft", "mouthStretchRight")
    assert np.array_equal(whole.curves.select(mouth).values, mean.curves.select(mouth).values)


@pytest.mark.parametrize("model", model_names())
def test_every_model_lives_and_a_stream_as_the_whole(speech_wav, model):
    sound = elocute.read_audio(speech_wav, sample_rate=16000)
    short = Waveform(sound.samples[: 4 * 16000], 16000)
    opened_level = None
    if model == "crnn":
        from elocute.models.registry import open_model

        opened_level = open_model(model).sound_level(short)
    whole = animate(short, model=model, mood="happy:0.5")
    live = elocute.stream(16000, model, mood="happy:0.5", level=opened_level)
    frames = [f for at in range(0, 64000, 700) for f in live.push(short.samples[at : at + 700])]
    frames += live.flush()
    values, rotations = (np.stack([getattr(f, n) for f in frames]) for n in ("values", "rotations"))
    assert np.abs(values - whole.motion.weights).max() < 1e-5
    assert np.abs(rotations - whole.motion.rotations).max() < 1e-5


def test_a_still_stream_has_joints_at_rest(speech_wav):
    live = elocute.stream(16000, life=0)
    samples = elocute.read_audio(speech_wav, sample_rate=16000).samples[:32000]
    frames = [*live.push(samples), *live.flush()]
    assert len(frames) == 120
    assert all(np.array_equal(f.rotations, np.tile([1, 0, 0, 0], (5, 1))) for f in frames)
