"""Meshes without shapes that speak on their own vertices."""

from __future__ import annotations

import io
import json

import numpy as np
import pytest

pytest.importorskip("scipy", reason="needs the extra `capture`")

from PIL import Image
from scipy.spatial import KDTree

import elocute
from elocute.adoption.mesh_without_shapes import joined, open_mesh_head
from elocute.adoption.registry import open_speaking_head
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import ElocuteWarning, HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.store import load_head, save_head
from elocute.motion.curves import motion_from_curves
from elocute.motion.mouth_measures import measure_mouth
from elocute.registration.landmarks import read_landmarks
from recipes.example import TARGET
from tests.support.commands import one_line, run_here
from tests.support.stranger import Stranger, write_stranger

RED = (200, 40, 30)


@pytest.fixture(scope="module")
def stranger(tmp_path_factory) -> Stranger:
    return write_stranger(tmp_path_factory.mktemp("stranger") / "hero.glb", RED)


@pytest.fixture(scope="module")
def adoption(stranger):
    return open_mesh_head(stranger.file, stranger.landmarks)


@pytest.fixture(scope="module")
def speech():
    """Curves of the first seconds of the example."""
    sound = read_audio(TARGET, sample_rate=16000)
    return elocute.animate(Waveform(sound.samples[: 4 * 16000], 16000), fps=30).curves


def test_lips_move_and_seal_as_the_built_in_heads(adoption, speech):
    theirs = measure_mouth(motion_from_curves(load_builtin_head(), speech))["opening_mm"]
    ours = measure_mouth(motion_from_curves(adoption.head, speech))["opening_mm"]
    assert np.corrcoef(theirs, ours)[0, 1] > 0.99
    assert ours[theirs < 0.05].max() < 0.1 and (theirs < 0.05).sum() > 2


def test_it_keeps_its_vertices_and_materials(adoption, stranger, tmp_path):
    head = adoption.head
    skin = head.material_names.index("skin")
    on_skin = np.unique(head.quads[head.material == skin])
    there = stranger.points[np.unique(stranger.triangles)] / 100
    away = KDTree(there).query(head.template[on_skin])[0]
    assert len(on_skin) == len(there) and np.quantile(away, 0.9) < 1e-6
    save_head(tmp_path / "hero.npz", head)
    back = load_head(tmp_path / "hero.npz")
    shown = np.asarray(Image.open(io.BytesIO(back.surfaces["skin"].color)))
    assert np.abs(shown.astype(int) - RED).max() < 8
    assert set(back.material_names) == {"skin", "teeth"} and back.surfaces["teeth"].color == b""


def test_lower_teeth_open_with_the_jaw_and_stay_teeth(adoption):
    head = adoption.head
    teeth = np.unique(head.quads[head.material == head.material_names.index("teeth")])
    moved = head.expression_basis[head.expression_index("jawOpen"), teeth]
    own = load_builtin_head()
    theirs = own.expression_basis[own.expression_index("jawOpen"), own.regions["teeth_lower"]]
    assert np.abs(moved.mean(axis=0) - theirs.mean(axis=0)).max() < 0.002
    rest = np.linalg.norm(np.diff(head.template[teeth], axis=0), axis=1)
    opened = np.linalg.norm(np.diff(head.template[teeth] + moved, axis=0), axis=1)
    assert np.abs(opened - rest).max() < 0.002
    still = head.expression_basis[head.expression_index("browInnerUp"), teeth]
    assert np.abs(still).max() < 0.001


def test_landmarks_without_the_jaw_give_nearly_the_same(adoption, stranger, tmp_path):
    """51 points, as people pick them in MeshLab: the jaw line is taken from the built-in face."""
    known = read_landmarks(stranger.landmarks).points[17:]
    rows = (f'<point name="{n}" x="{x}" y="{y}" z="{z}"/>' for n, (x, y, z) in enumerate(known))
    (tmp_path / "face.pp").write_text(f"<PickedPoints>{''.join(rows)}</PickedPoints>")
    with pytest.warns(ElocuteWarning, match="17 landmarks of the jaw are not given"):
        found = open_mesh_head(stranger.file, tmp_path / "face.pp")
    one, other = (head.expression_basis for head in (adoption.head, found.head))
    opened = found.head.expression_index("jawOpen")
    apart = np.linalg.norm(one[opened] - other[opened], axis=1)
    assert np.linalg.norm(one[opened], axis=1).max() > 0.02
    assert np.quantile(apart, 0.95) < 0.003


def test_its_axes_make_no_difference(adoption, stranger):
    """A mesh with z up, in millimetres, in a format without materials."""
    import trimesh

    turn = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    points = 10 * stranger.points @ turn.T
    lying = stranger.file.parent / "lying.stl"
    trimesh.Trimesh(points, stranger.triangles, process=False).export(lying)
    marks = stranger.file.parent / "lying.json"
    marks.write_text(json.dumps({"points": (10 * stranger.marks @ turn.T).tolist()}))
    head = open_mesh_head(lying, marks).head
    opened = head.expression_basis[head.expression_index("jawOpen")]
    own = adoption.head
    skin = np.unique(own.quads[own.material == own.material_names.index("skin")])
    upright = own.expression_basis[own.expression_index("jawOpen"), skin]
    assert opened[:, 1].min() == pytest.approx(upright[:, 1].min(), abs=5e-4)


def test_from_the_command_line(stranger, tmp_path):
    output = tmp_path / "hero.npz"
    arguments = ("head", "adopt", stranger.file, "--keep-mesh", "-o", output, "--json")
    said = run_here(*arguments, "--landmarks", stranger.landmarks)
    assert json.loads(said.stdout)["lips"] is True
    assert len(open_speaking_head(output).expression_names) > 50


@pytest.mark.slow
def test_without_shapes_or_the_flag_it_is_a_scan(stranger, tmp_path):
    said = run_here(
        *("head", "adopt", stranger.file, "--landmarks", stranger.landmarks),
        *("-o", tmp_path / "hero.npz", "--json"),
    )
    assert json.loads(said.stdout)["surface_mm"]["face_median"] < 1
    head = load_head(tmp_path / "hero.npz")
    assert head.vertex_count == load_builtin_head().vertex_count


def test_landmarks_may_be_a_little_off(stranger, speech):
    """Though teeth may then be nearer than lips: all go to the same part."""
    off = np.random.default_rng(1).normal(0, 0.1, (68, 3))
    head = open_mesh_head(stranger.file, _with(stranger, "off", lambda marks: marks + off)).head
    theirs = measure_mouth(motion_from_curves(load_builtin_head(), speech))["opening_mm"]
    ours = measure_mouth(motion_from_curves(head, speech))["opening_mm"]
    assert np.corrcoef(theirs, ours)[0, 1] > 0.99
    assert ours[theirs < 0.05].max() < 0.3


def _with(stranger, name, change):
    file = stranger.file.parent / f"{name}.json"
    file.write_text(json.dumps({"points": change(stranger.marks.copy()).tolist()}))
    return file


WRONG_MARKS = {
    "mirrored": lambda marks: marks * [-1, 1, 1],
    "elsewhere": lambda marks: marks + np.array([0, 0, 5]),
    "one place": lambda marks: np.tile(marks[30], (68, 1)),
    "shuffled": lambda marks: np.random.default_rng(0).permutation(marks),
}


@pytest.mark.parametrize("kind", WRONG_MARKS)
def test_landmarks_that_are_no_face_s_are_refused(stranger, kind, tmp_path):
    marks = _with(stranger, kind, WRONG_MARKS[kind])
    output = tmp_path / "hero.npz"
    said = run_here(
        *("head", "adopt", stranger.file, "--keep-mesh"), *("--landmarks", marks, "-o", output)
    )
    one_line(said, "landmarks")
    assert not output.exists()


def test_meshes_that_cannot_are_refused(stranger, tmp_path):
    import trimesh

    inside_out = tmp_path / "inside_out.stl"
    trimesh.Trimesh(stranger.points, stranger.triangles[:, ::-1], process=False).export(inside_out)
    with pytest.raises(HeadError, match="inside out"):
        open_mesh_head(inside_out, stranger.landmarks)
    huge = tmp_path / "huge.stl"
    trimesh.Trimesh(1e5 * stranger.points, stranger.triangles, process=False).export(huge)
    with pytest.raises(HeadError, match="size"):
        open_mesh_head(huge, stranger.landmarks)
    with pytest.raises(HeadError, match="68 landmarks"):
        some = _with(stranger, "some", lambda marks: marks)
        record = json.loads(some.read_text())
        record["points"][3] = None
        some.write_text(json.dumps(record))
        open_mesh_head(stranger.file, some)


def test_lips_that_touch_stay_two():
    """Three squares at one place: two that face the same way become one, the third does not."""
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]])
    points = np.concatenate([square, square, square])
    up, seam, down = [[0, 2, 1], [0, 3, 2]], [[4, 6, 5], [4, 7, 6]], [[8, 9, 10], [8, 10, 11]]
    triangles = np.array([*up, *seam, *down])
    first, place = joined(points, triangles)
    assert len(first) == 8
    assert place[0] == place[4] and place[0] != place[8]
