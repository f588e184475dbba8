"""What programs write into .ply files is read as they mean it, or what is not is told.

Each case is one square, its corners red, green, blue and grey, in the habit of some program.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from elocute.errors import CaptureError, ElocuteWarning, HeadError
from elocute.meshes.mesh_file import read_mesh_file
from elocute.meshes.parts import read_mesh_parts
from elocute.registration.scan_file import read_scan
from tests.meshes.test_obj_habits import COLORS, POINTS, edges, picture

XYZ = (("float", "x"), ("float", "y"), ("float", "z"))
RGB = tuple(("uchar", name) for name in ("red", "green", "blue"))
CODES = {
    "char": "b",
    "uchar": "B",
    "uint8": "B",
    "short": "h",
    "ushort": "H",
    "int": "i",
    "int32": "i",
    "uint": "I",
    "float": "f",
    "float32": "f",
    "double": "d",
    "float64": "d",
}
FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


def ply(
    kind: str,
    elements: Sequence[tuple[str, Sequence[tuple[str, ...]], Sequence[Sequence[object]]]],
    *,
    notes: str = "",
    newline: str = "\n",
) -> bytes:
    """A .ply: of each element its name, its properties and its records; lists are of kind
    (type of the count, type of the numbers, name)."""
    lines = ["ply", f"format {kind} 1.0", *notes.splitlines()]
    body = b""
    for name, properties, records in elements:
        lines.append(f"element {name} {len(records)}")
        lines += [f"property {'list ' if len(p) == 3 else ''}{' '.join(p)}" for p in properties]
        for record in records:
            body += written(kind, properties, record)
    return (newline.join([*lines, "end_header"]) + newline).encode() + body


def written(kind: str, properties: Sequence[tuple[str, ...]], record: Sequence[object]) -> bytes:
    words, packed = list[str](), b""
    for one, value in zip(properties, record, strict=True):
        values = list(value) if isinstance(value, list | tuple) else [value]
        if len(one) == 3:
            words.append(str(len(values)))
            packed += (
                struct.pack(FORMATS[kind] + CODES[one[0]], len(values)) if kind != "ascii" else b""
            )
        words += map(str, values)
        if kind != "ascii":
            packed += struct.pack(f"{FORMATS[kind]}{len(values)}{CODES[one[-2]]}", *values)
    return packed if kind != "ascii" else " ".join(words).encode() + b"\n"


def vertices(colors: Sequence[Sequence[float]] | None = None):
    rows = [tuple(map(float, point)) for point in POINTS]
    if colors is None:
        return rows
    return [(*row, *color) for row, color in zip(rows, colors, strict=True)]


CORNERS = ("uchar", "int", "vertex_indices")
QUAD = ("face", [CORNERS], [([0, 1, 2, 3],)])
PLAIN = ("vertex", XYZ, vertices())
MIXED = ("face", [CORNERS], [([0, 1, 2],), ([0, 1, 2, 3],), ([2, 3, 0],)])


def read(path: Path, data: bytes):
    path.write_bytes(data)
    return read_mesh_file(path, max_bytes=100_000, error=HeadError)


SHAPES = {
    "quad": [PLAIN, QUAD],
    "vertex_index": [PLAIN, ("face", [("uchar", "int", "vertex_index")], [([0, 1, 2, 3],)])],
    "count of int": [PLAIN, ("face", [("int", "uint", "vertex_indices")], [([0, 1, 2, 3],)])],
    "corners of ushort": [PLAIN, ("face", [("uint", "ushort", "vertex_index")], [([0, 1, 2, 3],)])],
    "corners of uchar": [
        PLAIN,
        ("face", [("uint8", "uint8", "vertex_indices")], [([0, 1, 2, 3],)]),
    ],
    "a list by another name": [PLAIN, ("face", [("uchar", "int", "indices")], [([0, 1, 2, 3],)])],
    "flags before and after": [
        PLAIN,
        ("face", [("uchar", "flags"), CORNERS, ("float", "quality")], [(1, [0, 1, 2, 3], 0.5)]),
    ],
    "an element between": [
        PLAIN,
        ("camera", [("float", "fov"), ("int", "width")], [(0.5, 640)]),
        ("edge", [("int", "vertex1"), ("int", "vertex2")], [(0, 1), (1, 2)]),
        QUAD,
    ],
    "faces first": [QUAD, PLAIN],
    "doubles and normals": [
        (
            "vertex",
            [(kind.replace("float", "double"), name) for kind, name in XYZ]
            + [("float", name) for name in ("nx", "ny", "nz")],
            [(*row, 0.0, 0.0, 1.0) for row in vertices()],
        ),
        QUAD,
    ],
    "an empty element": [PLAIN, ("edge", [("int", "vertex1"), CORNERS], []), QUAD],
    "a face of two corners": [PLAIN, ("face", [CORNERS], [([0, 1],), ([0, 1, 2, 3],), ([],)])],
    "strip": [PLAIN, ("tristrips", [("int", "int", "vertex_indices")], [([0, 1, 3, 2],)])],
}


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("elements", SHAPES.values(), ids=SHAPES.keys())
def test_shapes(tmp_path: Path, kind: str, elements):
    mesh = read(tmp_path / "a.PLY", ply(kind, elements))
    assert mesh.vertices.tolist() == POINTS
    found = [sorted(row) for row in mesh.triangles.tolist()]
    assert found in ([[0, 1, 2], [0, 2, 3]], [[0, 1, 3], [1, 2, 3]])
    a, b, c = (mesh.vertices[mesh.triangles[:, corner]] for corner in range(3))
    assert np.cross(b - a, c - a).tolist() == [[0, 0, 4]] * 2  # none is turned


@pytest.mark.parametrize("kind", FORMATS)
def test_triangles_mixed_with_quads(tmp_path: Path, kind: str):
    mesh = read(tmp_path / "a.ply", ply(kind, [PLAIN, MIXED]))
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 1, 2], [0, 2, 3], [2, 3, 0]]
    assert mesh.quads().tolist() == [[0, 1, 2, 2], [0, 1, 2, 3], [2, 3, 0, 0]]


@pytest.mark.parametrize("kind", FORMATS)
def test_strips_in_one_list_are_parted_by_minus_one(tmp_path: Path, kind: str):
    line = [0, 1, 3, 2, -1, 3, 0, 2, -1, 1, 1, 2, 3]
    strips = ("tristrips", [("int", "int", "vertex_indices")], [(line,), ([0, 1, 2],)])
    mesh = read(tmp_path / "a.ply", ply(kind, [PLAIN, strips]))
    assert mesh.triangles.tolist() == [[0, 1, 3], [3, 1, 2], [3, 0, 2], [2, 1, 3], [0, 1, 2]]


@pytest.mark.parametrize("newline", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("kind", FORMATS)
def test_lines_of_any_system(tmp_path: Path, newline: str, kind: str):
    """The first number of a binary file may look like the end of a line."""
    points = np.array(POINTS, np.float32)
    points[0, 0] = struct.unpack("<f", b"\n\r\n\0")[0]
    rows = [tuple(map(float, row)) for row in points]
    notes = "comment Created by Blender 4.2 - www.blender.org\nobj_info num_cols 512"
    data = ply(kind, [("vertex", XYZ, rows), QUAD], notes=notes, newline=newline)
    assert np.array_equal(read(tmp_path / "a.ply", data).vertices, points.astype(np.float64))


SHARES = [[band / 255 for band in color] for color in COLORS]
TINTS = {
    "uchar": (RGB, COLORS),
    "float to 1": ([("float", name) for _, name in RGB], SHARES),
    "float to 255": ([("float", name) for _, name in RGB], np.array(COLORS, float).tolist()),
    "double to 1": ([("double", name) for _, name in RGB], SHARES),
    "double to 255": ([("double", name) for _, name in RGB], np.array(COLORS, float).tolist()),
    "ushort": ([("ushort", n) for _, n in RGB], (257 * np.array(COLORS)).tolist()),
    "ushort to 255": ([("ushort", n) for _, n in RGB], COLORS),
    "int": ([("int", n) for _, n in RGB], COLORS),
    "diffuse": ([("uchar", f"diffuse_{n}") for _, n in RGB], COLORS),
    "letters": ([("uint8", n[0]) for _, n in RGB], COLORS),
    "capitals": ([("uchar", n.capitalize()) for _, n in RGB], COLORS),
    "alpha": ([*RGB, ("uchar", "alpha")], [[*color, 255] for color in COLORS]),
    "quality before": ([("float", "quality"), *RGB], [[0.5, *color] for color in COLORS]),
}


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize(("properties", "colors"), TINTS.values(), ids=TINTS.keys())
def test_colours_of_points(tmp_path: Path, kind: str, properties, colors):
    elements = [("vertex", [*XYZ, *properties], vertices(colors)), QUAD]
    (tmp_path / "a.ply").write_bytes(ply(kind, elements))
    found = read_scan(tmp_path / "a.ply").colors
    assert found is not None and found.tolist() == COLORS


def test_shares_in_a_text_that_declares_bytes(tmp_path: Path):
    data = ply("ascii", [("vertex", [*XYZ, *RGB], vertices(SHARES)), QUAD])
    (tmp_path / "a.ply").write_bytes(data)
    found = read_scan(tmp_path / "a.ply").colors
    assert found is not None and found.tolist() == COLORS


@pytest.mark.parametrize("kind", FORMATS)
def test_colours_of_faces_are_spread_over_their_points(tmp_path: Path, kind: str):
    faces = [([0, 1, 2], 200, 100, 0), ([0, 2, 3], 0, 100, 50)]
    (tmp_path / "a.ply").write_bytes(ply(kind, [PLAIN, ("face", [CORNERS, *RGB], faces)]))
    found = read_scan(tmp_path / "a.ply").colors
    assert found is not None
    assert found.tolist() == [[100, 100, 25], [200, 100, 0], [100, 100, 25], [0, 100, 50]]


PLACES = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
TEXTURED = {
    f"{u} {v}": [
        ("vertex", [*XYZ, ("float", u), ("float", v)], vertices(PLACES)),
        QUAD,
    ]
    for u, v in (("s", "t"), ("u", "v"), ("texture_u", "texture_v"))
} | {
    "of faces": [
        PLAIN,
        (
            "face",
            [CORNERS, ("uchar", "float", "texcoord"), ("int", "texnumber")],
            [([0, 1, 2], [0, 0, 1, 0, 1, 1], 0), ([0, 2, 3], [0, 0, 1, 1, 0, 1], 0)],
        ),
    ],
    "of a table": [
        PLAIN,
        ("face", [CORNERS], [([0, 1, 2],), ([0, 2, 3],)]),
        (
            "multi_texture_vertex",
            [("uchar", "tx"), ("float", "u"), ("float", "v")],
            [(0, *place) for place in PLACES],
        ),
        (
            "multi_texture_face",
            [("uchar", "tx"), ("uint", "tn"), ("uchar", "int", "texture_vertex_indices")],
            [(0, 0, [0, 1, 2]), (0, 0, [0, 2, 3])],
        ),
    ],
}


@pytest.mark.parametrize("kind", FORMATS)
@pytest.mark.parametrize("elements", TEXTURED.values(), ids=TEXTURED.keys())
def test_pictures(tmp_path: Path, kind: str, elements):
    """Named by a comment, as MeshLab, Agisoft and RealityCapture do."""
    picture(tmp_path / "skin one.jpg", (255, 0, 0), (0, 0, 255))
    data = ply(kind, elements, notes="comment TextureFile Skin one.JPG")
    (tmp_path / "a.ply").write_bytes(data)
    left, right = edges(tmp_path / "a.ply")
    assert np.abs(np.array([left, right]) - [[255, 0, 0], [0, 0, 255]]).max() < 10  # JPEG's


def test_a_face_without_places_is_a_part_of_its_own(tmp_path: Path):
    picture(tmp_path / "one.png", (255, 0, 0), (0, 0, 255))
    faces = [([0, 1, 2], [0, 0, 1, 0, 1, 1], 0), ([0, 2, 3], [], -1)]
    properties = [CORNERS, ("uchar", "float", "texcoord"), ("int", "texnumber")]
    data = ply("binary_little_endian", [PLAIN, ("face", properties, faces)])
    data = data.replace(b"ply\n", b"ply\ncomment TextureFile one.png\n", 1)
    (tmp_path / "a.ply").write_bytes(data)
    plain, dressed = read_mesh_parts(tmp_path / "a.ply", max_bytes=10_000, error=HeadError)
    assert plain.picture is None and dressed.picture is not None and dressed.uv is not None
    assert dressed.uv.tolist() == [[0, 0], [1, 0], [1, 1]]


def test_places_without_a_picture_are_told(tmp_path: Path):
    """As trimesh writes them."""
    (tmp_path / "a.ply").write_bytes(ply("ascii", TEXTURED["s t"]))
    with pytest.warns(ElocuteWarning, match="places in a picture, but none is named"):
        assert read_scan(tmp_path / "a.ply").colors is None


def test_a_picture_that_is_not_there_is_told(tmp_path: Path):
    data = ply("ascii", TEXTURED["s t"], notes="comment TextureFile /scans/absent.jpg")
    (tmp_path / "a.ply").write_bytes(data)
    with pytest.warns(ElocuteWarning, match=r"its picture 'absent\.jpg' is not there"):
        assert read_scan(tmp_path / "a.ply").colors is None


@pytest.mark.parametrize("kind", FORMATS)
def test_a_cloud_is_said_to_be_one(tmp_path: Path, kind: str):
    for elements in ([PLAIN], [PLAIN, ("face", [CORNERS], [])]):
        (tmp_path / "a.ply").write_bytes(ply(kind, elements))
        with pytest.raises(CaptureError, match="4 points without triangles"):
            read_scan(tmp_path / "a.ply")


def test_microsofts_words_for_nan(tmp_path: Path):
    rows = [*vertices(), (float("nan"),) * 3]
    data = ply("ascii", [("vertex", XYZ, rows), QUAD]).replace(
        b"nan nan nan", b"-1.#IND nan -nan(ind)"
    )
    assert np.isnan(read(tmp_path / "a.ply", data).vertices[4]).all()


LITTLE = "binary_little_endian"
BROKEN = {
    "cut short": (ply(LITTLE, [PLAIN, QUAD])[:-3], "shorter than its header says"),
    "a list cut short": (ply(LITTLE, [PLAIN, MIXED])[:-3], "shorter than its header says"),
    "text cut short": (ply("ascii", [PLAIN, QUAD])[:-3], "shorter than its header says"),
    "more columns than named": (
        ply("ascii", [PLAIN, QUAD]).replace(b"0.0\n", b"0.0 0 0 1\n"),
        "14 numbers more than its header says",
    ),
    "words": (ply("ascii", [PLAIN, QUAD]).replace(b"2.0", b"two"), "words that are no numbers"),
    "past the vertices": (
        ply(LITTLE, [PLAIN, ("face", [CORNERS], [([0, 1, 9],)])]),
        "point past 4 vertices",
    ),
    "before the first": (
        ply(LITTLE, [PLAIN, ("face", [CORNERS], [([0, 1, -2],)])]),
        "point past 4 vertices",
    ),
    "half corners": (
        ply("ascii", [PLAIN, ("face", [CORNERS], [([0, 1.5, 2],)])]),
        "no whole numbers",
    ),
    "less than nothing": (
        ply("ascii", [PLAIN, QUAD]).replace(b"\n4 0 1", b"\n-4 0 1"),
        "a list of -4",
    ),
    "no places": (ply(LITTLE, [("vertex", XYZ[:2], []), QUAD]), "no x, y, z"),
    "unknown format": (ply("ascii", [PLAIN, QUAD]).replace(b"ascii", b"utf9"), "format utf9"),
    "unknown type": (
        ply("ascii", [PLAIN, QUAD]).replace(b"float y", b"half y"),
        "numbers of type 'half'",
    ),
    "two thousand million": (
        ply(LITTLE, [PLAIN, QUAD]).replace(b"vertex 4", b"vertex 2000000000"),
        "shorter than its header says",
    ),
    "a huge list": (
        ply(LITTLE, [PLAIN, ("face", [("uint", "int", "vertex_indices")], [([0, 1, 2],)])])[:-16]
        + b"\xff\xff\xff\xff",
        "shorter than its header says",
    ),
}


@pytest.mark.parametrize(("data", "told"), BROKEN.values(), ids=BROKEN.keys())
def test_what_cannot_be_read_is_told(tmp_path: Path, data: bytes, told: str):
    with pytest.raises(HeadError, match=told) as caught:
        read(tmp_path / "a.ply", data)
    assert "\n" not in str(caught.value) and "a.ply" in str(caught.value)


def test_bytes_beyond_the_header_are_told(tmp_path: Path):
    with pytest.warns(ElocuteWarning, match="40 bytes more than its header says"):
        assert len(read(tmp_path / "a.ply", ply(LITTLE, [PLAIN, QUAD]) + bytes(40)).triangles) == 2
    read(tmp_path / "a.ply", ply(LITTLE, [PLAIN, QUAD]) + b"\n")
