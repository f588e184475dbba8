"""The same speech on many faces: each by its own lips, and faces spoilt on purpose are found."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import HeadError, InputError
from elocute.evaluation.face_study import (
    FaceScore,
    face_score_spread,
    face_scores,
    faces_of,
    heard_closures,
    own_closures,
    random_faces,
)
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth

SOUND = 2  # seed of three faces without a fault


@pytest.fixture(scope="module")
def words(speech_wav: Path) -> Waveform:
    """Four seconds of speech with three words that begin with m."""
    speech = read_audio(speech_wav).resample(16000)
    return Waveform(speech.samples[16000:80000], 16000)


@pytest.fixture(scope="module")
def motion(words: Waveform) -> Motion:
    return animate(words, fps=30).motion


@pytest.fixture(scope="module")
def closures(words: Waveform) -> list[tuple[float, float]]:
    return heard_closures(words)


def spoilt(face: HeadModel, vertices: Any, offset_mm: tuple[float, float, float]) -> HeadModel:
    template = face.template.copy()
    template[vertices] += np.array(offset_mm, np.float32) / 1000
    return replace(face, template=template)


def mouth_width(face: HeadModel) -> float:
    left, right = face.template[face.inner_corners]
    return float(np.linalg.norm(left - right))


def test_closures_are_heard_where_the_rules_close(
    motion: Motion, closures: list[tuple[float, float]]
) -> None:
    assert 2 <= len(closures) <= 8
    assert all(0 <= start < end <= motion.duration_s + 0.1 for start, end in closures)
    opening = measure_mouth(motion)["opening_mm"]
    shut = [opening[round(a * 30) : round(b * 30) + 1].min() < 0.5 for a, b in closures]
    assert all(shut)


def test_sound_faces_have_no_fault(motion: Motion, closures: list[tuple[float, float]]) -> None:
    faces = list(random_faces(motion, 3, seed=SOUND))
    scores = face_scores(motion, faces, closures)
    own = measure_mouth(motion)
    for face, score in zip(faces, scores, strict=True):
        wider = mouth_width(face) / mouth_width(motion.head)  # round lips come from further away
        assert score.faults == () and score.severity <= 1
        assert score.sealed == score.closures == len(closures)
        assert score.widest_gap_mm <= 0.1
        assert score.peak_opening_mm == pytest.approx(own["opening_mm"].max(), abs=0.01)
        assert score.mean_opening_mm == pytest.approx(own["opening_mm"].mean(), abs=0.01)
        assert score.width_range_mm == pytest.approx(wider * np.ptp(own["width_mm"]), rel=0.05)
    depths = {round(score.lip_depth_mm, 6) for score in scores}
    assert len(depths) == 3  # each by its own lips
    assert len({score.tooth_depth_mm for score in scores}) > 1  # and teeth
    again = face_scores(motion, random_faces(motion, 2, seed=SOUND), closures)
    assert again == scores[:2]


def test_twenty_faces_seal_and_go_no_deeper_than_measured(
    motion: Motion, closures: list[tuple[float, float]]
) -> None:
    """Some faces go too deep (docs/measurements/voca.md): no deeper than is known."""
    scores = face_scores(motion, random_faces(motion, 20, seed=0), closures)
    assert all(score.sealed == score.closures for score in scores)
    assert max(score.widest_gap_mm for score in scores) < 0.1
    assert max(score.tooth_depth_mm for score in scores) < 1.5
    assert max(score.lip_depth_mm for score in scores) < 4
    assert sum(bool(score.faults) for score in scores) <= 6


@pytest.mark.parametrize(
    ("part", "offset_mm", "told"),
    [
        ("upper", (0, 2, 0), "open at p, b, m"),
        ("side", (0, 3, 0), "open at p, b, m"),
        ("lower", (0, 4, 0), "lip in lip"),
        ("teeth_upper", (0, -2, 5), "lip in tooth"),
        ("teeth_lower", (0, 4, 7), "lip in tooth"),
    ],
)
def test_a_face_spoilt_on_purpose_is_found_among_others(
    motion: Motion,
    closures: list[tuple[float, float]],
    part: str,
    offset_mm: tuple[float, float, float],
    told: str,
) -> None:
    first, second, third = random_faces(motion, 3, seed=SOUND)
    rings = first.lip_rings
    places = {
        "upper": rings[:, [*range(27, 38), *range(12)]].ravel(),
        "side": rings[:, 5:10].ravel(),
        "lower": rings[:, 13:26].ravel(),
    }
    vertices = places[part] if part in places else first.regions[part]
    scores = face_scores(motion, [first, spoilt(second, vertices, offset_mm), third], closures)
    assert [score.faults for score in scores][::2] == [(), ()]
    assert told in scores[1].faults
    assert scores[1].severity > 1 > scores[0].severity


def test_a_mouth_held_open_seals_nowhere(
    motion: Motion, closures: list[tuple[float, float]]
) -> None:
    weights = np.zeros_like(motion.weights)
    weights[:, motion.names.index("jawOpen")] = 0.5
    (score,) = face_scores(
        replace(motion, weights=weights), random_faces(motion, 1, seed=0), closures
    )
    assert (score.sealed, score.faults) == (0, ("open at p, b, m",))
    assert score.widest_gap_mm > score.mean_opening_mm > 5


def test_a_stored_motion_closes_where_its_own_lips_do(motion: Motion) -> None:
    closures = own_closures(motion)
    assert closures
    (score,) = face_scores(motion, random_faces(motion, 1, seed=3), closures)
    assert score.sealed == len(closures)


def test_a_decoder_moves_faces_by_its_own_shapes(
    motion: Motion, closures: list[tuple[float, float]]
) -> None:
    """As a trained model does: the same shapes, doubled, under names of their own."""
    head = motion.head
    names = tuple(f"voca{index:03d}" for index in range(len(head.expression_names)))
    doubled = replace(head, expression_names=names, expression_basis=2 * head.expression_basis)
    again = Motion(doubled, motion.weights / np.float32(2), motion.fps)
    (face,) = random_faces(motion, 1, seed=4)
    # Round lips are fitted to a face by their names, which a decoder's shapes do not have.
    face = replace(face, expression_basis=head.expression_basis)
    (one,) = face_scores(motion, [face], closures)
    (two,) = face_scores(again, random_faces(again, 1, seed=4), closures)
    assert vars(one) == pytest.approx(vars(two), abs=1e-3)
    with pytest.raises(HeadError, match="other shapes"):
        face_scores(again, random_faces(motion, 1, seed=4), closures)


def test_faces_that_are_not_there_are_refused(motion: Motion) -> None:
    for count, seed, told in ((0, 0, "count"), (1, -1, "seed")):
        with pytest.raises(HeadError, match=told):
            random_faces(motion, count, seed)


def test_another_topology_has_no_faces(python2: Any, tmp_path: Path) -> None:
    from elocute.head.registry import open_head

    (tmp_path / "flame.pkl").write_bytes(python2.dumps(python2.flame()))
    head = open_head(tmp_path / "flame.pkl")
    frozen = Motion(head, np.zeros((3, len(head.expression_names)), np.float32), 30)
    with pytest.raises(InputError, match="no identity space; allowed: a motion of the built-in"):
        faces_of(frozen, [np.zeros(50, np.float32)])
    with pytest.raises(HeadError, match="lips"):
        face_scores(frozen, [head], [])


def test_identities_are_those_asked_for(motion: Motion) -> None:
    one = np.zeros(50, np.float32)
    one[0] = 2
    (face,) = faces_of(motion, [one])
    np.testing.assert_array_equal(face.template, load_builtin_head().with_identity(one).template)


def test_the_spread_is_over_faces(motion: Motion, closures: list[tuple[float, float]]) -> None:
    scores = face_scores(motion, random_faces(motion, 3, seed=SOUND), closures)
    depths = [score.tooth_depth_mm for score in scores]
    assert face_score_spread(scores)["tooth_depth_mm"] == pytest.approx(
        {
            "mean": np.mean(depths),
            "deviation": np.std(depths),
            "least": min(depths),
            "greatest": max(depths),
        }
    )
    assert set(face_score_spread(scores)) == set(FaceScore.__dataclass_fields__)
