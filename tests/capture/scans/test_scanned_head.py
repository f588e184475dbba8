"""A head that speaks, made of one scan."""

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import KDTree

from elocute.animation import animate
from elocute.capture.scanned_head import joined_lips, scanned_head
from elocute.errors import CaptureError
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.head.store import load_head, save_head
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.store import load_motion, save_motion
from elocute.registration.landmarks import Landmarks, no_landmarks, write_landmarks
from elocute.registration.scan_file import write_scan
from tests.support.commands import one_line, run_here


@pytest.fixture(scope="module")
def made(scans, stage):
    return scanned_head(scans[0], stage.frame(0).landmarks)


@pytest.fixture(scope="module")
def stored(made, tmp_path_factory):
    path = tmp_path_factory.mktemp("person") / "person.npz"
    save_head(path, made.head)
    return path


def test_lips_meet_where_the_built_in_head_s_do(stored, speech_wav):
    """Over speech, at every frame in which the built-in head seals."""
    own = measure_mouth(animate(speech_wav, fps=30, life=0, head=stored).motion)
    built_in = measure_mouth(animate(speech_wav, fps=30, life=0).motion)
    sealed = built_in["opening_mm"] < CLOSED_MM / 10
    assert sealed.sum() > 20
    assert own["opening_mm"][sealed].max() < 0.1
    assert np.corrcoef(own["opening_mm"], built_in["opening_mm"])[0, 1] > 0.99


def test_its_skin_has_the_scan_s_colours(made, scans):
    scan = scans[0]
    picture = np.asarray(Image.open(picture_of(made.head)).convert("RGB"), float)
    face = made.head.regions["face"]
    skin = made.head.material == made.head.material_names.index("skin")
    inside = skin & np.isin(made.head.quads, face).all(axis=1)
    uv = made.head.uv[made.head.uv_quads[inside, 0]]
    rows = ((1 - uv[:, 1]) * len(picture)).astype(int)
    shown = picture[rows, (uv[:, 0] * len(picture)).astype(int)]
    places = made.registration.vertices[made.head.quads[inside, 0]]
    away, nearest = KDTree(scan.points).query(places)
    apart = np.abs(shown - scan.colors[nearest])[away < 0.002]
    assert np.median(apart) < 12


def picture_of(head):
    return io.BytesIO(head.surfaces["skin"].color)


def test_it_is_stored_with_its_pictures(made, stored, speech_wav, tmp_path):
    back = load_head(stored)
    assert back.surfaces == made.head.surfaces
    save_motion(animate(speech_wav, fps=5, head=stored).motion, tmp_path / "talk.npz")
    assert load_motion(tmp_path / "talk.npz").head.surfaces == made.head.surfaces


def test_lips_that_are_joined_already_stay(head):
    points = head.template.astype(float)
    assert np.abs(joined_lips(head, points) - points).max() < 1e-9


@pytest.mark.slow
def test_a_scan_without_a_face_is_told(scans):
    ball = scans[0]
    round_points = ball.points / np.linalg.norm(ball.points, axis=1, keepdims=True) * 0.1
    with pytest.raises(CaptureError):
        scanned_head(replace(ball, points=round_points), no_landmarks())


NOT_HEADS = {
    "huge": lambda ball: 1e7 * ball,
    "not numbers": lambda ball: np.full_like(ball, np.nan),
    "flat": lambda ball: ball * [1, 1, 0],
    "without a face": lambda ball: ball,
}


@pytest.mark.parametrize("kind", NOT_HEADS)
def test_what_is_no_scan_of_a_face_is_refused_in_a_line(kind, tmp_path):
    some = np.random.default_rng(0).normal(size=(900, 3))
    ball = 0.1 * some / np.linalg.norm(some, axis=1, keepdims=True)
    corners = np.random.default_rng(1).integers(0, 900, (2000, 3))
    file, output = tmp_path / "thing.ply", tmp_path / "person.npz"
    write_scan(file, NOT_HEADS[kind](ball), corners)
    one_line(run_here("head", "adopt", file, "-o", output), "thing.ply")
    assert not output.exists()


def test_the_unit_is_guessed_or_told(scans, stage, tmp_path):
    file, marks, output = tmp_path / "face.ply", tmp_path / "face.json", tmp_path / "person.npz"
    write_scan(file, 1000 * scans[0].points, scans[0].triangles, scans[0].colors)
    known = stage.frame(0).landmarks
    write_landmarks(marks, Landmarks(1000 * known.points, known.confidence))
    arguments = ("head", "adopt", file, "--landmarks", marks, "-o", output, "--json")
    record = json.loads(run_here(*arguments).stdout)
    assert record["surface_mm"]["face_median"] < 0.5
    one_line(run_here("head", "adopt", file, "--unit", "mile", "-o", output, "--overwrite"), "mile")
    one_line(
        run_here("head", "adopt", file, "--unit", "m", "-o", output, "--overwrite"), "face.ply"
    )


def test_a_unit_is_for_meshes(tmp_path):
    said = run_here("head", "adopt", "builtin", "--unit", "mm", "-o", tmp_path / "person.npz")
    one_line(said, "--unit", "a mesh without shapes")
