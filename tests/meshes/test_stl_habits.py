"""STL, binary and text, whatever its first words are."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from elocute.errors import CaptureError
from elocute.registration.scan_file import read_scan
from tests.meshes.test_obj_habits import POINTS

CORNERS = np.array(POINTS, np.float32)[[[0, 1, 2], [0, 2, 3]]]


def binary(start: bytes = b"made by a scanner", count: int = 2) -> bytes:
    rows = [struct.pack("<12fH", 0, 0, 1, *triangle.ravel(), 7) for triangle in CORNERS]
    return start.ljust(80) + struct.pack("<I", count) + b"".join(rows)


def text(name: str = "solid face", case=str.lower) -> bytes:
    lines = [name]
    for triangle in CORNERS:
        corners = [f"    vertex {x:e} {y:e} {z:e}" for x, y, z in triangle]
        lines += ["  facet normal 0 0 1", "   outer loop", *corners, "   endloop", "  endfacet"]
    return case("\r\n".join([*lines, "endsolid face"])).encode()


@pytest.mark.parametrize(
    "data",
    [
        binary(),
        binary(b"solid called so though it is binary"),
        binary() + bytes(9),
        text(),
        text(case=str.upper),
        text("\n solid"),
    ],
)
def test_triangles_share_their_points(tmp_path: Path, data: bytes):
    (tmp_path / "a.stl").write_bytes(data)
    scan = read_scan(tmp_path / "a.stl", "mm")
    assert np.allclose(scan.points, np.array(POINTS) / 1000)
    assert scan.triangles.tolist() == [[0, 1, 2], [0, 2, 3]] and scan.colors is None


@pytest.mark.parametrize(
    ("data", "told"),
    [
        (b"", "no .stl, or one cut short"),
        (binary()[:-1], "no .stl, or one cut short"),
        (binary(count=4_000_000_000), "no .stl, or one cut short"),
        (b"solid nothing\nendsolid", "no .stl"),
        (text().replace(b"2.000000e+00", b"two"), "words that are no numbers"),
        (binary(count=0)[:84], "no vertices"),
    ],
)
def test_what_is_none(tmp_path: Path, data: bytes, told: str):
    (tmp_path / "a.stl").write_bytes(data)
    with pytest.raises(CaptureError, match=told):
        read_scan(tmp_path / "a.stl")
