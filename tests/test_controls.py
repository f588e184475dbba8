"""Edits of real speech: seals and their times stay, styles and moods change over time."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import elocute
from elocute.animation import Animation
from elocute.errors import InputError, MotionError
from elocute.motion.edits import sealed_frames, with_edits
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth


@pytest.fixture(scope="module")
def take(speech_wav: Path) -> Animation:
    return elocute.animate(speech_wav)


def listed(*edits: dict) -> dict:
    return {"elocute": "edits", "version": 1, "edits": list(edits)}


def openings_mm(motion: Motion) -> np.ndarray:
    return measure_mouth(motion)["opening_mm"]


AMPLITUDES = [
    {"jaw": 1.6},
    {"jaw": 0.0},
    {"lips": 2.0},
    {"lips": 0.0},
    {"jaw": 2.0, "lips": 0.3},
    {"jaw": 0.3, "lips": 2.0, "cheeks": 2.0, "head": 2.0, "brows": 0.0, "eyes": 0.5},
]


@pytest.mark.parametrize("regions", AMPLITUDES)
def test_amplitudes_leave_every_seal_of_speech(take: Animation, regions: dict):
    edited = with_edits(take.motion, listed({"edit": "amplitude", "regions": regions}))
    sealed = sealed_frames(take.motion)
    assert sealed.sum() > 100 and openings_mm(edited)[sealed].max() <= 0.1
    teeth = take.curves["mouthLabiodental"]
    kept = edited.weights[teeth == teeth.max()]
    wanted = take.motion.weights[teeth == teeth.max()]
    mouth = [i for i, n in enumerate(edited.names) if n.startswith(("jaw", "mouth"))]
    np.testing.assert_allclose(kept[:, mouth], wanted[:, mouth], atol=1e-6)


def test_openings_stay_in_time_with_the_sound(take: Animation):
    edited = with_edits(
        take.motion, listed({"edit": "amplitude", "regions": {"jaw": 1.4, "lips": 0.8}})
    )
    before, after = openings_mm(take.motion), openings_mm(edited)
    lags = range(-6, 7)
    alike = [np.corrcoef(before[6:-6], np.roll(after, lag)[6:-6])[0, 1] for lag in lags]
    assert lags[int(np.argmax(alike))] == 0 and max(alike) > 0.97


@pytest.mark.parametrize("mood", ["happy", "sad", "angry", "surprised", "tender"])
def test_moods_that_come_and_go_leave_the_seals(speech_wav: Path, mood: str):
    whole = elocute.animate(speech_wav, mood=mood, fps=30)
    plain = elocute.animate(speech_wav, fps=30)
    edits = listed({"edit": "mood", "mood": mood, "from": 3, "to": 7, "blend": 0.5})
    mixed = elocute.animate(speech_wav, fps=30, edits=edits)
    sealed = sealed_frames(plain.motion) & sealed_frames(whole.motion)
    assert openings_mm(mixed.motion)[sealed].max() <= 0.1
    outside = np.r_[0:90, 211:300]
    assert np.array_equal(mixed.motion.weights[outside], plain.motion.weights[outside])
    lids = [n for n in plain.motion.names if n.startswith("eye")]  # blinks are as often as before
    others = [i for i, n in enumerate(plain.motion.names) if n not in lids]
    np.testing.assert_allclose(
        mixed.motion.weights[106:195, others], whole.motion.weights[106:195, others], atol=1e-5
    )


def test_a_style_for_a_while_and_a_mood_within_it(speech_wav: Path):
    edits = listed(
        {"edit": "style", "style": "broad:0.5,calm:0.5", "from": 1, "to": "end-1"},
        {"edit": "mood", "mood": "happy:0.6", "from": 2, "to": 4},
    )
    mixed = elocute.animate(speech_wav, fps=30, edits=edits, life=0)
    styled = elocute.animate(speech_wav, fps=30, style="broad:0.5,calm:0.5", life=0)
    np.testing.assert_allclose(
        mixed.motion.weights[140:250], styled.motion.weights[140:250], atol=1e-6
    )
    assert mixed.curves["mouthSmileLeft"][90] > styled.curves["mouthSmileLeft"][90] + 0.05
    assert mixed.motion.rotations is not None


def test_edits_survive_another_model_and_stand_in_the_curves(speech_wav: Path, tmp_path: Path):
    file = tmp_path / "take.json"
    held = {"edit": "closed", "from": 1.0, "to": 1.4}
    file.write_text(json.dumps(listed(held, {"edit": "offset", "seconds": 0.1})))
    for model in ("articulation", "talkers"):
        made = elocute.animate(speech_wav, fps=30, model=model, edits=file)
        assert openings_mm(made.motion)[30:42].max() <= 0.1
        jaw = made.motion.weights[:, made.motion.names.index("jawOpen")]
        assert np.array_equal(made.curves["jawOpen"], jaw)


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        ({"edit": "style", "style": "grumpy"}, r"edits\[0\]: .*grumpy"),
        ({"edit": "style", "style": "mine.json"}, "a name or a mix, no file"),
        ({"edit": "mood", "mood": "hapy"}, r"edits\[0\]: .*hapy"),
        ({"edit": "mood", "mood": "happy", "from": 90}, r"edits\[0\]: time: 90 s"),
    ],
)
def test_a_style_or_mood_that_is_not_there_names_the_edit(speech_wav: Path, edit: dict, told: str):
    with pytest.raises(MotionError, match=told):
        elocute.animate(speech_wav, edits=listed(edit))


def test_too_many_manners_are_refused(speech_wav: Path):
    moods = [{"edit": "mood", "mood": f"happy:{n / 100}"} for n in range(70)]
    with pytest.raises(InputError, match="71 moods"):
        elocute.animate(speech_wav, edits=listed(*moods))


@pytest.mark.shared_data
def test_seals_of_a_real_talker_stay(shared_data: Path):
    """GRID's speaker s1: his sound, animated with known seals, in edits that pull at them."""
    sounds = sorted((shared_data / "grid_s1").rglob("*.mpg"))[:4]
    assert sounds
    edits = listed({"edit": "amplitude", "regions": {"jaw": 1.5, "lips": 1.5}})
    for sound in sounds:
        plain = elocute.animate(sound, life=0)
        edited = elocute.animate(sound, life=0, edits=edits)
        sealed = sealed_frames(plain.motion)
        assert sealed.any() and openings_mm(edited.motion)[sealed].max() <= 0.1
