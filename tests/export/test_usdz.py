"""USD packages, opened and judged by Pixar's own library."""

import errno
import io
import os
import zipfile
from importlib import import_module
from typing import Any

import numpy as np
import pytest
import soundfile
from PIL import Image

from elocute.animation import animate
from elocute.errors import OutputError
from elocute.export.options import ShapeOptions
from elocute.export.usdz import write_usdz
from elocute.head.normals import linear_colors
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.motion import Motion


def pxr(name: str) -> Any:
    """A module of theirs, which says nothing of its types, where it is needed: 80 MB."""
    return import_module(f"pxr.{name}")


@pytest.fixture(scope="module")
def motion(speech_wav):
    """Two seconds of speech with a turning head."""
    whole = animate(speech_wav, fps=10, identity="esi").motion
    turned = None if whole.rotations is None else whole.rotations[15:35]
    return Motion(whole.head, whole.weights[15:35], 10, rotations=turned)


@pytest.fixture(scope="module")
def package(motion, speech_wav, tmp_path_factory):
    path = tmp_path_factory.mktemp("usd") / "talk.usdz"
    write_usdz(motion, path, sound=speech_wav, options=ShapeOptions(profile="elocute"))
    return path


@pytest.fixture(scope="module")
def stage(package):
    return pxr("Usd").Stage.Open(str(package))


def complaints(path):
    context = pxr("UsdValidation").ValidationContext(
        pxr("UsdValidation").ValidationRegistry().GetOrLoadAllValidators()
    )
    return [error.GetMessage() for error in context.Validate(pxr("Usd").Stage.Open(str(path)))]


def test_its_validators_find_nothing(package):
    assert complaints(package) == []


def test_its_validators_find_what_is_wrong(package, tmp_path):
    with zipfile.ZipFile(package) as good, zipfile.ZipFile(tmp_path / "bad.usdz", "w") as bad:
        for name in good.namelist():
            bad.writestr(name, good.read(name), zipfile.ZIP_STORED)
    assert complaints(tmp_path / "bad.usdz")


def test_vertices_are_those_of_the_motion(motion, package):
    """Shapes and joints, computed by UsdSkel."""
    stage = pxr("Usd").Stage.Open(pxr("Usd").Stage.Open(str(package)).Flatten())
    assert pxr("UsdSkel").BakeSkinning(
        pxr("UsdSkel").Root(stage.GetDefaultPrim()), pxr("Gf").Interval(0, 19)
    )
    points = pxr("UsdGeom").Mesh(stage.GetPrimAtPath("/Head/Face")).GetPointsAttr()
    wanted = motion.dressed().vertices()
    assert np.ptp(wanted, axis=0).max() > 0.005
    for frame in (0, 7, 19):
        apart = np.linalg.norm(np.array(points.Get(frame)) - wanted[frame], axis=1)
        assert apart.max() < 2e-5  # m; joints beyond the fourth are left out


def test_normals_follow_the_shapes(motion, stage):
    shape = pxr("UsdSkel").BlendShape(stage.GetPrimAtPath("/Head/Face/jawOpen"))
    rows = np.array(shape.GetPointIndicesAttr().Get())
    offsets = np.array(shape.GetOffsetsAttr().Get())
    assert len(rows) == len(offsets) == len(shape.GetNormalOffsetsAttr().Get())
    head = motion.dressed().head
    basis = head.expression_basis[head.expression_index("jawOpen")]
    assert np.abs(basis[rows] - offsets).max() < 1e-6


def test_names_times_and_units(motion, stage):
    assert pxr("UsdGeom").GetStageMetersPerUnit(stage) == 1
    assert pxr("UsdGeom").GetStageUpAxis(stage) == "Y"
    assert (stage.GetTimeCodesPerSecond(), stage.GetEndTimeCode()) == (10, 19)
    skeleton = pxr("UsdSkel").Skeleton(stage.GetPrimAtPath("/Head/Skeleton"))
    assert list(skeleton.GetJointsAttr().Get())[:3] == ["Neck", "Neck/Head", "Neck/Head/Jaw"]
    speech = pxr("UsdSkel").Animation(stage.GetPrimAtPath("/Head/Skeleton/Speech"))
    names = list(speech.GetBlendShapesAttr().Get())
    assert set(ARKIT_NAMES) <= set(names) and "mouthLabiodental" in names
    weights = np.array(speech.GetBlendShapeWeightsAttr().Get(7))
    jaw = motion.weights[7, motion.names.index("jawOpen")]
    assert weights[names.index("jawOpen")] == pytest.approx(jaw, abs=1e-5)


def test_every_face_has_one_material_with_its_images(motion, package, stage):
    mesh = pxr("UsdGeom").Mesh(stage.GetPrimAtPath("/Head/Face"))
    subsets = pxr("UsdShade").MaterialBindingAPI(mesh).GetMaterialBindSubsets()
    faces = np.concatenate([subset.GetIndicesAttr().Get() for subset in subsets])
    assert sorted(faces) == list(range(len(mesh.GetFaceVertexCountsAttr().Get())))
    for subset in subsets:
        bound, _ = pxr("UsdShade").MaterialBindingAPI(subset).ComputeBoundMaterial()
        assert bound and bound.ComputeSurfaceSource()[0].GetIdAttr().Get() == "UsdPreviewSurface"
    with zipfile.ZipFile(package) as opened:
        images = [name for name in opened.namelist() if name.startswith("images/")]
        assert len(images) >= 9
        for name in images:
            Image.open(io.BytesIO(opened.read(name))).verify()


def test_colours_without_images_are_linear(motion, stage):
    mesh = pxr("UsdGeom").Mesh(stage.GetPrimAtPath("/Head/Face"))
    colors = np.array(mesh.GetDisplayColorAttr().Get())
    assert colors == pytest.approx(linear_colors(motion.dressed().head), abs=1e-4)


def test_the_sound_is_inside(package, speech_wav, stage):
    assert stage.GetPrimAtPath("/Voice").GetTypeName() == "SpatialAudio"
    with zipfile.ZipFile(package) as opened:
        samples, rate = soundfile.read(io.BytesIO(opened.read("sound.wav")))
    assert len(samples) / rate == pytest.approx(soundfile.info(speech_wav).duration, abs=1e-3)


def test_by_default_the_shapes_are_arkit_s(motion, tmp_path):
    write_usdz(motion, tmp_path / "a.usdz")
    stage = pxr("Usd").Stage.Open(str(tmp_path / "a.usdz"))
    names = (
        pxr("UsdSkel").Animation(stage.GetPrimAtPath("/Head/Skeleton/Speech")).GetBlendShapesAttr()
    )
    assert set(names.Get()) == set(ARKIT_NAMES)
    assert not stage.GetPrimAtPath("/Voice")


def test_the_same_motion_gives_the_same_bytes(motion, tmp_path):
    first, second = tmp_path / "a", tmp_path / "b"
    for folder in (first, second):
        folder.mkdir()
        write_usdz(motion, folder / "talk.usdz")
    assert (first / "talk.usdz").read_bytes() == (second / "talk.usdz").read_bytes()


def test_a_folder_that_is_not_there(motion, tmp_path):
    with pytest.raises(OutputError):
        write_usdz(motion, tmp_path / "no" / "a.usdz")


def test_a_disk_that_is_full_for_the_sound_is_told_of_the_package(motion, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), "sound.wav")

    monkeypatch.setattr("elocute.export.usdz.write_wav", full)
    with pytest.raises(OutputError, match=r"talk\.usdz: cannot be written \(No space left"):
        write_usdz(motion, tmp_path / "talk.usdz", sound=tmp_path / "speech.wav")
    assert list(tmp_path.iterdir()) == []
