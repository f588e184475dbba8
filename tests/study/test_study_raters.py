"""Raters who look (recipes/study_raters): what they see is what is there."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elocute.audio.waveform import Waveform
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.study.design.design import MISMATCHED
from recipes.study_raters.raters import Weights, blames, strength, timing_loss, watch_study
from recipes.study_raters.seen_faces import see
from recipes.study_raters.seen_mouths import HeardSound, SeenMouth, hear, look, people_seen
from tests.study.studies import HEAD

FPS = 25.0
PHONES = tuple(
    (0.5 + 0.25 * place, 0.75 + 0.25 * place, phone)
    for place, phone in enumerate(("B", "AA", "M", "IY", "P", "EY", "V", "AY", "B", "AE"))
)
SECONDS = 3.5
CONDITIONS = """
[[conditions]]
name = "rules"
model = "articulation"

[[conditions]]
name = "faint"
model = "articulation"
strength = 0.2

[[conditions]]
name = "late"
model = "articulation"
offset_ms = 300
"""
STIMULI = """
[stimuli]
sounds = [
    {file = "example:example.flac", name = "first", start_s = 0.5, end_s = 2.0},
    {file = "example:example.flac", name = "second", start_s = 6.6, end_s = 8.4},
]
size = [64, 64]
fps = 25
"""


@pytest.fixture(scope="module")
def heard() -> HeardSound:
    rng = np.random.default_rng(0)
    loud = np.zeros(round(SECONDS * 16000))
    loud[8000:48000] = 0.1
    return hear(Waveform((loud * rng.normal(size=len(loud))).astype(np.float32), 16000), PHONES)


@pytest.fixture(scope="module")
def own(heard) -> SeenMouth:
    """A mouth that does what people do, and closes on p, b and m."""
    times = np.arange(round(SECONDS * FPS)) / FPS
    opening = np.maximum(heard.expected_at(times), 0.0) * 1.6
    for start, end, phone in PHONES:
        if phone in "PBM":
            opening[round(start * FPS) + 1 : round(end * FPS) - 1] = 0
    return SeenMouth(opening, FPS)


@pytest.fixture(scope="module")
def study(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("watched") / "study.toml"
    path.write_text(HEAD + CONDITIONS + STIMULI)
    return path


def test_a_mouth_that_does_as_people_do_is_in_time(own, heard):
    seen = look(own, heard)
    assert seen.fit > 0.8 and abs(seen.late_s) <= 0.04 and timing_loss(seen, people_seen()) < 0.02
    assert seen.missed_seals == 0 and seen.false_seals == 0


@pytest.mark.parametrize("late_s", [-0.2, 0.2])
def test_a_delay_is_seen_for_what_it_is(own, heard, late_s):
    moved = look(replace(own, start_s=-late_s), heard)
    assert moved.late_s == pytest.approx(late_s, abs=0.045)
    assert timing_loss(moved, people_seen()) > 0.05


def test_the_further_a_sound_is_off_the_less_it_is_liked(own, heard):
    for sign in (-1, 1):
        made = [look(replace(own, start_s=-sign * at), heard) for at in (0, 0.1, 0.16, 0.22)]
        strengths = [-timing_loss(each, people_seen()) for each in made]
        assert strengths == sorted(strengths, reverse=True)


def test_a_sound_that_is_a_little_late_costs_nothing_and_early_does(own, heard):
    none, late, early = (
        timing_loss(look(replace(own, start_s=-at), heard), people_seen())
        for at in (0, 0.06, -0.06)
    )
    assert late <= none + 0.01 and early > late + 0.02


@pytest.mark.parametrize(
    ("name", "reason"),
    [("open", "missed seals"), ("wide", "opening"), ("frozen", "timing"), ("shaking", "jerk")],
)
def test_what_is_wrong_is_blamed_by_its_name(own, heard, name, reason):
    shaking = np.random.default_rng(0).normal(0, 3, len(own.opening_mm))
    opening = {
        "open": np.maximum(own.opening_mm, 2.0),
        "wide": own.opening_mm * 6,
        "frozen": np.full_like(own.opening_mm, 3.0),
        "shaking": np.abs(own.opening_mm + shaking),
    }[name]
    told, usual = (
        blames(look(replace(own, opening_mm=each), heard), Weights(), people_seen())
        for each in (opening, own.opening_mm)
    )
    assert told[reason] > usual[reason] + 0.5 and all(value >= 0 for value in told.values())
    without = replace(Weights(), timing=0.0, missed_seals=0.0, unusual=0.0)
    assert strength(look(own, heard), without) == 0


def test_without_sound_there_is_nothing_to_be_in_time_with(own):
    seen = look(own, None)
    assert np.isnan(seen.fit) and np.isnan(seen.missed_seals)
    assert "timing" not in {k for k, v in blames(seen, Weights(), people_seen()).items() if v}


def test_a_head_is_seen_as_it_is_turned_and_its_eyes_as_they_shut():
    head = load_builtin_head()
    weights = np.zeros((30, len(head.expression_names)), np.float32)
    for side in ("Left", "Right"):
        weights[10:14, head.expression_index(f"eyeBlink{side}")] = 1
    angle = np.radians(5 * np.sin(np.arange(30) / 4))
    rotations = np.zeros((30, len(head.joint_names), 4), np.float32)
    rotations[..., 0] = 1
    place = head.joint_names.index("head")
    rotations[:, place, 0], rotations[:, place, 2] = np.cos(angle / 2), np.sin(angle / 2)
    face = see(Motion(head, weights, 30.0, rotations), 0.0)
    turns = face.turns_deg
    assert turns is not None and face.lids is not None
    assert np.allclose(np.abs(turns[:, 1]), np.abs(np.degrees(angle)), atol=0.3)
    assert np.abs(turns[:, [0, 2]]).max() < 0.3
    assert face.lids[12] < 0.5 < 0.95 < face.lids[0]
    lying = see(Motion(head, weights[:5], 30.0), 0.0)
    assert lying.turns_deg is not None and np.abs(lying.turns_deg).max() < 0.01


def test_models_are_looked_at_as_they_are_shown(study):
    table = watch_study(study)
    assert set(table) == {"rules", "faint", "late", MISMATCHED}
    assert table["rules"]["fit"] > 0.5
    assert table["faint"]["opening_mm"] < 0.5 * table["rules"]["opening_mm"]
    # Sound 300 ms late, as a viewer of the video meets it.
    assert table["late"]["late_s"] == pytest.approx(table["rules"]["late_s"] + 0.3, abs=0.07)
    strengths = {name: row["strength"] for name, row in table.items()}
    assert strengths["rules"] > max(strengths[each] for each in ("faint", "late", MISMATCHED))
