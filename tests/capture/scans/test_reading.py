"""Scans, landmarks and sequences from files: what is read, and what is refused with which words."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elocute.capture.scans.scan_sequence import find_sequences, open_sequence
from elocute.errors import CaptureError
from elocute.registration.landmarks import Landmarks, read_landmarks, write_landmarks
from elocute.registration.scan import Scan, checked_scan
from elocute.registration.scan_file import read_scan, write_scan


def test_ply_round_trip_keeps_points_triangles_and_colours(tmp_path: Path, scans: list[Scan]):
    path = tmp_path / "0.ply"
    write_scan(path, scans[0].points, scans[0].triangles, scans[0].colors)
    found = read_scan(path)
    assert np.allclose(found.points, scans[0].points, atol=1e-7)
    assert (found.triangles == scans[0].triangles).all()
    assert found.colors is not None and (found.colors == scans[0].colors).all()


def test_textured_obj_is_welded_and_coloured(tmp_path: Path):
    from PIL import Image

    Image.new("RGB", (4, 4), (200, 30, 10)).save(tmp_path / "skin.png")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd skin.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n"
        "vt 0 0\nvt 1 0\nvt 0 1\nvt 0.5 0.5\nusemtl m\nf 1/1 2/2 3/3\nf 2/4 4/2 3/1\n"
    )
    found = read_scan(tmp_path / "a.obj", "cm")
    assert len(found.points) == 4  # the seam doubled two of them
    assert np.ptp(found.points[:, 0]) == pytest.approx(0.01)
    assert found.colors is not None and tuple(found.colors[0]) == (200, 30, 10)


@pytest.mark.parametrize("text", [b"", b"junk", b"ply\nformat binary_little_endian 1.0\n"])
def test_broken_files_are_refused(tmp_path: Path, text: bytes):
    path = tmp_path / "1.ply"
    path.write_bytes(text)
    with pytest.raises(CaptureError, match=r"1\.ply: no mesh|0 points"):
        read_scan(path)


def test_header_that_promises_more_than_the_file_takes_no_memory(tmp_path: Path):
    path = tmp_path / "1.ply"
    path.write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\nproperty float x\n"
        b"property float y\nproperty float z\nelement face 1\n"
        b"property list uchar int vertex_indices\nend_header\n"
    )
    with pytest.raises(CaptureError, match="shorter than its header says"):
        read_scan(path)


def test_wrong_unit_names_the_right_one(scans: list[Scan]):
    with pytest.raises(CaptureError, match="it looks like mm: say `unit` mm"):
        checked_scan(replace(scans[0], points=1000 * scans[0].points))
    with pytest.raises(CaptureError, match="it looks like m: say `unit` m"):
        checked_scan(replace(scans[0], points=scans[0].points / 1000, unit_m=0.001))


def test_nan_points_and_stray_parts_go_and_are_told(scans: list[Scan]):
    points = scans[0].points.copy()
    points[5] = np.nan
    far = np.array([[1.0, 1, 1], [1.001, 1, 1], [1, 1.001, 1]])
    corners = np.arange(3, dtype=np.int32)[None] + len(points)
    dirty = Scan("x", np.vstack([points, far]), np.vstack([scans[0].triangles, corners]))
    found, notes = checked_scan(dirty)
    assert np.isfinite(found.points).all() and found.points.max() < 0.9
    assert any("not finite" in note for note in notes) and any("stray" in note for note in notes)


def test_triangles_that_share_no_points_are_joined_and_told(scans: list[Scan]):
    """As programs write them that list the points of every triangle anew."""
    whole = checked_scan(scans[0])[0]
    corners = whole.triangles.ravel()
    apart = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    colors = None if whole.colors is None else whole.colors[corners]
    found, notes = checked_scan(Scan("x", whole.points[corners], apart, colors))
    assert len(found.points) == len(whole.points) and found.boundary.sum() == whole.boundary.sum()
    assert notes == ("points of its triangles were apart, and were joined",)


def test_empty_and_flat_scans_are_refused(scans: list[Scan]):
    with pytest.raises(CaptureError, match="usable points"):
        checked_scan(replace(scans[0], triangles=scans[0].triangles[:10]))
    with pytest.raises(CaptureError, match="flat"):
        checked_scan(replace(scans[0], points=scans[0].points * [1, 1, 0]))


def test_boundary_is_the_rim_of_the_mesh():
    points = np.array([[x, y, 0.0] for y in range(3) for x in range(3)])
    cells = [(0, 1, 3), (1, 4, 3), (1, 2, 4), (2, 5, 4), (3, 4, 6), (4, 7, 6), (4, 5, 7), (5, 8, 7)]
    scan = Scan("grid", points, np.array(cells, np.int32))
    assert (~scan.boundary).nonzero()[0].tolist() == [4]


def test_landmark_files(tmp_path: Path):
    points = np.random.default_rng(0).random((68, 3))
    marks = Landmarks(np.where(np.arange(68)[:, None] == 3, np.nan, points), np.full(68, 0.8))
    write_landmarks(tmp_path / "a.json", marks)
    found = read_landmarks(tmp_path / "a.json")
    assert np.allclose(found.points[4:], points[4:], atol=1e-6)
    assert found.confidence[3] == 0 and found.confidence[4] == 0.8
    rows = points.tolist()
    ljson = {"version": 2, "labels": [], "landmarks": {"points": rows, "connectivity": []}}
    (tmp_path / "a.ljson").write_text(json.dumps(ljson))
    lines = "\n".join(" ".join(map(str, row)) for row in rows)
    (tmp_path / "a.pts").write_text(f"version: 1\nn_points: 68\n{{\n{lines}\n}}\n")
    for name in ("a.ljson", "a.pts"):
        assert np.allclose(read_landmarks(tmp_path / name, 0.001).points, points / 1000)
    (tmp_path / "b.json").write_text(json.dumps({"points": rows[:60]}))
    with pytest.raises(CaptureError, match="68 points"):
        read_landmarks(tmp_path / "b.json")


def test_sequence_tells_what_is_missing(tmp_path: Path, scans: list[Scan]):
    for number in (3, 4, 7):
        write_scan(tmp_path / f"frame_{number:03d}.ply", scans[0].points, scans[0].triangles)
    with pytest.raises(CaptureError, match=r"no capture\.json"):
        open_sequence(tmp_path)
    sequence = open_sequence(tmp_path, fps=30, unit="m")
    assert sequence.missing == (5, 6) and sequence.frame_count == 5 and sequence.neutral == 3
    assert find_sequences(tmp_path) == [tmp_path]
    write_scan(tmp_path / "again_04.ply", scans[0].points, scans[0].triangles)
    with pytest.raises(CaptureError, match="number 4"):
        open_sequence(tmp_path, fps=30)


@pytest.mark.parametrize(
    "metadata",
    [{"fps": 0}, {"fps": "x"}, {"unit": "furlong"}, {"sound": "../x.wav"}, {"neutral": 9}],
)
def test_wrong_metadata_are_refused(
    tmp_path: Path, sequence_folder: Path, metadata: dict[str, object]
):
    known = json.loads((sequence_folder / "capture.json").read_text())
    (tmp_path / "00000.ply").write_bytes(b"x")
    (tmp_path / "capture.json").write_text(json.dumps(known | {"sound": ""} | metadata))
    with pytest.raises(CaptureError):
        open_sequence(tmp_path)
