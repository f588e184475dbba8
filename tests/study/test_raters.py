"""Raters who look: what they see is what is there, and they answer every kind of study by it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elocute.audio.waveform import Waveform
from elocute.errors import StudyError
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.study.design.design import MISMATCHED
from elocute.study.design.trials import test_trials as trials_of
from elocute.study.raters.crowd import Crowd, Truth, crowd_answers, seats_of
from elocute.study.raters.raters import Raters, Weights, blames, strength, timing_loss, watch_study
from elocute.study.raters.seen_faces import see
from elocute.study.raters.seen_mouths import HeardSound, SeenMouth, hear, look, people_seen
from tests.study.designs import design_of
from tests.study.studies import HEAD
from tests.support.commands import run_here

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


@pytest.fixture(scope="module")
def watched(study) -> Raters:
    return watch_study(study)


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
    turns = face.mouth.turns_deg
    assert turns is not None and face.mouth.lids is not None
    assert np.allclose(np.abs(turns[:, 1]), np.abs(np.degrees(angle)), atol=0.3)
    assert np.abs(turns[:, [0, 2]]).max() < 0.3
    assert face.mouth.lids[12] < 0.5 < 0.95 < face.mouth.lids[0]
    lying = see(Motion(head, weights[:5], 30.0), 0.0)
    assert lying.mouth.turns_deg is not None and np.abs(lying.mouth.turns_deg).max() < 0.01
    assert np.allclose(lying.manner, 0)


def test_models_are_looked_at_as_they_are_shown(watched):
    table = watched.table()
    assert set(table) == {"rules", "faint", "late", MISMATCHED}
    assert table["rules"]["fit"] > 0.5
    assert table["faint"]["opening_mm"] < 0.5 * table["rules"]["opening_mm"]
    # Sound 300 ms late, as a viewer of the video meets it.
    assert table["late"]["late_s"] == pytest.approx(table["rules"]["late_s"] + 0.3, abs=0.07)
    strengths = {name: row["strength"] for name, row in table.items()}
    assert strengths["rules"] > max(strengths[each] for each in ("faint", "late", MISMATCHED))


def test_a_crowd_answers_by_what_raters_see(watched):
    crowd = Crowd(lapses=0.0, people_sd=0.0, stimuli_sd=0.0)
    answers = crowd_answers(watched.design, crowd, seats_of(watched.design, 40), 1, watched)
    assert all(each.participant.startswith("simulated-") for each in answers)
    tests = [each for each in answers if each.role == "test" and "late" in (each.left, each.right)]
    chosen = np.mean([each.answer != "late" for each in tests])
    assert chosen > 0.7
    obvious = [each for each in answers if each.role == "qualification"]
    assert np.mean([each.answer == each.correct for each in obvious]) > 0.8


def test_ratings_are_points_and_a_face_without_blame_is_good(watched):
    rating = replace(watched.design, study=replace(watched.design.study, kind="rating"))
    raters = Raters(rating, watched.sights, {"faint": 12.0}, watched.weights)
    points = raters.strength("rules", "first.mean.front")
    assert 15 < points <= 75 and raters.strength("faint", "first.mean.front") == 12
    assert raters.strength("late", "first.mean.front") < points


def test_a_manner_is_recognised_by_the_nearer_face(tmp_path):
    conditions = "".join(
        f'\n[[conditions]]\nname = "{name}"\nmodel = "articulation"\nstyle = "{style}"\n{more}\n'
        for name, style, more in (
            ("smiling", "smiling", ""),
            ("mumble", "mumble", ""),
            ("shown", "smiling", 'strength = 0.9\nreference_for = "smiling"'),
            ("other", "mumble", 'strength = 0.9\nreference_for = "mumble"'),
        )
    )
    (tmp_path / "study.toml").write_text(HEAD.replace("binary", "style") + conditions + STIMULI)
    raters = watch_study(tmp_path / "study.toml")
    trials = [trial for row in trials_of(raters.design) for trial in row]
    assert min(raters.recognised(each) for each in trials) > 0.3


def test_delays_are_told_by_the_sound_and_the_mouth(watched):
    design = design_of("sync", sounds=2)
    sights = {
        (each.name, f"s{k}.mean"): watched.sights["rules", "first.mean"]
        for each in design.conditions
        for k in range(2)
    }
    raters = Raters(design, sights, {}, Weights())
    own_ms = raters.late_ms("by0")
    assert raters.late_ms("by200") == own_ms + 200 and abs(own_ms) < 80
    answers = crowd_answers(design, Crowd(lapses=0.0), seats_of(design, 60), 1, raters)
    share = {
        name: np.mean([each.answer == "together" for each in answers if each.left == name])
        for name in ("bym400", "by0", "by400")
    }
    assert share["by0"] > 0.4 and max(share["bym400"], share["by400"]) < 0.1


def test_a_crowd_without_raters_is_as_before():
    design = design_of()
    crowd = Crowd({"voca": 1.0})
    seats = seats_of(design, 5)
    assert crowd_answers(design, crowd, seats, 3) == crowd_answers(
        design, crowd, seats, 3, Truth(design, crowd)
    )


@pytest.mark.parametrize(
    ("kind", "conditions", "told"),
    [
        ("binary", '[[conditions]]\nname = "filmed"\nvideos = "filmed"\n', "condition filmed"),
        ("intelligibility", CONDITIONS, "read no words"),
    ],
)
def test_what_raters_cannot_judge_is_told_by_its_name(tmp_path, kind, conditions, told):
    more = CONDITIONS if kind == "binary" else ""
    stimuli = STIMULI.replace('"first"', '"first", choices = ["a", "b"], word = "a"').replace(
        '"second"', '"second", choices = ["a", "b"], word = "b"'
    )
    (tmp_path / "study.toml").write_text(HEAD.replace("binary", kind) + conditions + more + stimuli)
    with pytest.raises(StudyError, match=told) as error:
        watch_study(tmp_path / "study.toml")
    assert "\n" not in str(error.value) and "level" in str(error.value)


def test_videos_with_a_level_are_not_looked_at(flashes):
    raters = watch_study(flashes, levels={"ours": 0.5, "theirs": 0.0})
    assert not raters.sights and raters.strength("ours", "one.mean.front") == 0.5
    answers = crowd_answers(raters.design, Crowd(), seats_of(raters.design, 6), 1, raters)
    assert {each.stimulus for each in answers} == {
        f"{n}.mean.front" for n in ("one", "two", "three")
    }


def test_raters_on_the_command_line(study, tmp_path):
    made = tmp_path / "answers.csv"
    words = [
        "study",
        "simulate",
        study,
        "-o",
        made,
        "--people",
        3,
        "--raters",
        "--level",
        "late=-4",
    ]
    done = run_here(*words)
    assert done.returncode == 0 and "seals missed" in done.stdout and "\nlate" not in done.stdout
    assert made.read_text().count("simulated-") > 3
    alone = run_here("study", "simulate", study, "-o", made, "--data", tmp_path)
    assert alone.returncode == 2 and "--raters" in alone.stderr
