"""An iris lies behind its cornea: aslant it is seen where the cornea bends the view to."""

import io
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from elocute.errors import HeadError
from elocute.export.gltf import glb_bytes
from elocute.export.sunk_irises import sunk
from elocute.head.builtin import load_builtin_head
from elocute.head.looks import PEOPLE, dress
from elocute.head.normals import vertex_normals
from elocute.head.surface import surface_arrays, surfaces_of_arrays
from elocute.motion.motion import Motion
from elocute.render import Camera, Stage, available_backends, open_renderer

SIZE = (300, 200)
FIELD_DEG, AWAY_M = 6.0, 0.25
MM_OF_PX = 2000 * AWAY_M * np.tan(np.radians(FIELD_DEG / 2)) / SIZE[1]
BACKENDS = [
    pytest.param("moderngl", marks=pytest.mark.system),
    pytest.param("embreex", marks=pytest.mark.slow),
]


@pytest.fixture(scope="module")
def head():
    return dress(load_builtin_head(), replace(PEOPLE["ben"], lashes=0.0))


def pupil_px(head, backend, aside_deg):
    """The middle of the left pupil along a row of the picture."""
    eye = head.template[head.regions["eye_left"]]
    middle = np.array([*eye.mean(0)[:2], eye[:, 2].max()])
    aside = np.radians(aside_deg)
    away = AWAY_M * np.array([np.sin(aside), 0, np.cos(aside)])
    camera = Camera((middle + away).astype("f4"), middle.astype("f4"), FIELD_DEG)
    stage = Stage(quality="high")
    with open_renderer(head, SIZE, backend=backend, camera=camera, stage=stage) as renderer:
        picture = renderer.frame(head.template).astype(int)
    down, across = SIZE[1] // 2, SIZE[0] // 2
    shown = picture[down - 30 : down + 50, across - 70 : across + 70].max(axis=2)
    dark = np.nonzero(shown < 55)
    assert len(dark[1]) > 150, "no pupil"
    return np.median(dark[1])


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_pupil_seen_aslant_lies_further_back(head, backend, need):
    if backend == "moderngl":
        need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
    painted = replace(head.surfaces["eyeball"], iris_depth=0.0)
    flat = replace(head, surfaces={**head.surfaces, "eyeball": painted})
    assert abs(pupil_px(head, backend, 0) - pupil_px(flat, backend, 0)) <= 1
    # Half a right angle aside the view goes on at 32 degrees inside, 1.0 mm further over an iris
    # 1.6 mm deep: 0.7 mm in the picture.
    moved = pupil_px(head, backend, 45) - pupil_px(flat, backend, 45)
    assert 0.5 < moved * MM_OF_PX < 0.9


@pytest.mark.parametrize("profile", ["for_viewer", "elsewhere"])
def test_a_glb_sinks_the_iris_for_programs_without_corneas(head, profile):
    """By a millimetre, and only there; highlights stay on the cornea: its normals are kept."""
    motion = Motion(head, np.zeros((1, len(head.expression_names)), np.float32), 30.0)
    data = glb_bytes(motion, for_viewer=profile == "for_viewer")
    scene = trimesh.load_scene(io.BytesIO(data), file_type="glb", process=False)
    (eyes,) = (m for m in scene.geometry.values() if m.visual.material.name == "eyeball")
    own = np.unique(head.triangles[head.triangle_material == head.material_names.index("eyeball")])
    normals = vertex_normals(head.template, head.triangles)[own]
    assert len(eyes.vertices) == len(own)
    sunk_mm = 1000 * np.linalg.norm(eyes.vertices - head.template[own], axis=1)
    assert np.abs(eyes.vertex_normals - normals).max() < 0.002
    if profile == "for_viewer":
        assert sunk_mm.max() == 0
    else:
        assert 0.9 < sunk_mm.max() < 1.4
        assert (sunk_mm == 0).mean() > 0.2


def test_a_sunk_iris_turns_with_its_eye(head):
    """Places and shapes shrink together: a turned iris is as far from the middle of the eye."""
    basis = head.expression_basis
    places, shapes = sunk(head, basis)
    moved = np.flatnonzero((places != head.template).any(axis=1))
    middle = head.joint_positions[head.joint_names.index("eyeLeft")]
    own = moved[head.template[moved, 0] > 0]
    share = np.linalg.norm(places - middle, axis=1) / np.linalg.norm(head.template - middle, axis=1)
    look = head.expression_names.index("eyeLookOutLeft")
    assert np.abs(basis[look, own]).max() > 0.001
    turned, whole = places + shapes[look] - middle, head.template + basis[look] - middle
    np.testing.assert_allclose(turned[own], share[own, None] * whole[own], atol=1e-6)


def test_files_keep_the_iris_and_refuse_an_impossible_one(head):
    eye = head.surfaces["eyeball"]
    assert surfaces_of_arrays(surface_arrays({"eyeball": eye})) == {"eyeball": eye}
    for wrong in ({"eye_rad": 0.0}, {"iris_rad": -0.4}, {"iris_depth": 9.0}):
        stored = surface_arrays({"eyeball": replace(eye, **wrong)})
        with pytest.raises(HeadError, match="iris"):
            surfaces_of_arrays(stored)
