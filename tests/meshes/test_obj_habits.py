"""What programs write into .obj and .mtl files is read as they mean it, or what is not is told.

Each case is one square, its corners red, green, blue and grey, in the habit of some program.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elocute.errors import ElocuteWarning, HeadError
from elocute.meshes.mesh_file import read_mesh_file
from elocute.meshes.parts import read_mesh_parts
from elocute.registration.scan_file import read_scan

POINTS = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]
COLORS = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [102, 102, 102]]
VERTICES = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\n"
PLACES = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
TRIANGLES = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"

SHAPES = {
    "quad": VERTICES + "f 1 2 3 4\n",
    "tabs and spaces": VERTICES.replace(" ", "\t") + "f\t1  2 3\t\nf 1 3 4 \n",
    "Windows": (VERTICES + "f 1 2 3 4\n").replace("\n", "\r\n"),
    "old Macintosh": (VERTICES + "f 1 2 3 4\n").replace("\n", "\r"),
    "byte-order mark": "\ufeff" + VERTICES + "f 1 2 3 4\n",
    "back from the end": VERTICES + "f -4 -3 -2 -1\n",
    "back from the end, and forth": VERTICES + "f -4 2 -2 4\n",
    "each after its points": "v 0 0 0\nv 2 0 0\nv 2 2 0\nf -3 -2 -1\nv 0 2 0\nf -4 -2 -1\n",
    "faces first": "f 1 2 3 4\n" + VERTICES,
    "normals": VERTICES + "vn 0 0 1\nf 1//1 2//1 3//1 4//1\n",
    "all three": VERTICES + PLACES + "vn 0 0 1\nf 1/1/1 2/2/1 3/3/1 4/4/1\n",
    "empty places": VERTICES + "f 1/ 2/ 3/ 4/\n",
    "places that are not there": VERTICES + "f 1/1/1 2/2/1 3/3/1 4/4/1\n",
    "places back from nothing": VERTICES + "f 1/-4 2/-3 3/-2 4/-1\n",
    "groups": "o head\ng skin\n" + VERTICES + "s 1\nf 1 2 3\ng rest\ns off\nf 1 3 4\n",
    "lines and points": VERTICES + "p 1 2\nl 1 2 3\nf 1 2 3 4\n",
    "comments": "# by hand\n" + VERTICES.replace("\n", " # a corner\n") + "f 1 2 3 4 # a face\n",
    "continued": VERTICES + "f 1 2 \\\n3 4\n",
    "continued on Windows": (VERTICES + "f 1 2 \\\n3 4\n").replace("\n", "\r\n"),
    "weights": VERTICES.replace("0\n", "0 1.0\n") + "f 1 2 3 4\n",
    "exponents": VERTICES.replace("2", "2.0e+000") + "f 1 2 3 4\n",
    "curves": VERTICES + "vp 0.1 0.2\ncstype bezier\nf 1 2 3 4\nend\n",
}


@pytest.mark.parametrize("text", SHAPES.values(), ids=SHAPES.keys())
def test_shapes(tmp_path: Path, text: str):
    path = tmp_path / "square.OBJ"
    path.write_bytes(text.encode())
    mesh = read_mesh_file(path, max_bytes=10_000, error=HeadError)
    assert mesh.vertices.tolist() == POINTS
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.quads().tolist() in ([[0, 1, 2, 3]], [[0, 1, 2, 2], [0, 2, 3, 3]])


def test_triangles_written_one_after_the_other_keep_their_points(tmp_path: Path):
    """Every point is written again for each triangle, and counted back from there."""
    corners = np.array(POINTS)[[0, 1, 2, 0, 2, 3]]
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    lines = [*lines[:3], "f -3 -2 -1", *lines[3:], "f -3 -2 -1"]
    (tmp_path / "a.obj").write_text("\n".join(lines))
    scan = read_scan(tmp_path / "a.obj")
    assert np.array_equal(scan.points, corners)
    assert scan.triangles.tolist() == [[0, 1, 2], [3, 4, 5]]


def lines_with(colors) -> str:
    rows = zip(POINTS, colors, strict=True)
    return "".join(f"v {x} {y} {z} {c}\n" for (x, y, z), c in rows) + "f 1 2 3 4\n"


BYTES = [" ".join(map(str, color)) for color in COLORS]
SHARES = [" ".join(f"{band / 255:.4f}" for band in color) for color in COLORS]
TINTS = {
    "shares": lines_with(SHARES),
    "bytes": lines_with(BYTES),
    "bytes with points": lines_with([color.replace(" ", ".0 ") for color in BYTES]),
    "alpha": lines_with([f"{color} 1.0" for color in SHARES]),
    "ZBrush": VERTICES + "f 1 2 3 4\n#MRGB ffff0000ff00ff00FF0000FFff666666\n",
    "ZBrush, two lines": VERTICES + "#MRGB ffff0000ff00ff00\n#MRGB FF0000FFff666666\nf 1 2 3 4\n",
    "with a grey material": "mtllib a.mtl\nusemtl grey\n" + lines_with(SHARES),
}


@pytest.mark.parametrize("text", TINTS.values(), ids=TINTS.keys())
def test_colours_of_points(tmp_path: Path, text: str):
    (tmp_path / "a.mtl").write_text("newmtl grey\nKd 0.75 0.75 0.75\n")
    (tmp_path / "a.obj").write_text(text)
    scan = read_scan(tmp_path / "a.obj")
    assert scan.colors is not None and scan.colors.tolist() == COLORS


def picture(path: Path, left: tuple[int, int, int], right: tuple[int, int, int]) -> None:
    """A picture of two colours beside each other."""
    made = Image.new("RGB", (32, 32), left)
    made.paste(right, (16, 0, 32, 32))
    made.save(path)


MATERIALS = {
    "plain": "newmtl skin\nmap_Kd skin.png\n",
    "scale": "newmtl skin\nmap_Kd -s 1 1 1 skin.png\n",
    "shift by a whole picture": "newmtl skin\nmap_Kd -o 1 0 0 skin.png\n",
    "bump and switches": "newmtl skin\nmap_Kd -blendu on -cc off -bm 0.5 -mm 0 1 skin.png\n",
    "many": "newmtl skin\nmap_Kd -clamp on -s 1.0 1.0 -o 0 -texres 512 -imfchan l skin.png\n",
    "case": "newmtl skin\nmap_Kd SKIN.PNG\n",
    "keys in capitals": "newmtl skin\nMAP_KD skin.png\n",
    "of Windows": "newmtl skin\r\nmap_Kd C:\\scans\\skin.png\r\n",
    "tabs": "newmtl\tskin\n\tKd 0 0 0\n\tmap_Kd\tskin.png \n",
    "quotes": 'newmtl skin\nmap_Kd "skin.png"\n',
    "ambient": "newmtl skin\nmap_Ka skin.png\n",
    "ambient beside diffuse": "newmtl skin\nmap_Ka other.png\nmap_Kd skin.png\nmap_Ka other.png\n",
    "bump beside": "newmtl skin\nmap_Kd skin.png\nmap_Bump -bm 1 bump.png\nbump bump.png\n",
    "name in other case": "newmtl Skin\nmap_Kd skin.png\n",
    "among others": "newmtl cloth\nKd 1 0 0\nnewmtl skin\nmap_Kd skin.png\n",
}


@pytest.mark.parametrize("text", MATERIALS.values(), ids=MATERIALS.keys())
def test_pictures(tmp_path: Path, text: str):
    picture(tmp_path / "skin.png", (255, 0, 0), (0, 0, 255))
    (tmp_path / "a.mtl").write_text(text)
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{VERTICES}{PLACES}usemtl skin\n{TRIANGLES}")
    assert edges(tmp_path / "a.obj") == ([255, 0, 0], [0, 0, 255])


def edges(path: Path) -> tuple[list[int], list[int]]:
    """The colours of a square's left and right edge, each the same all along."""
    scan = read_scan(path)
    assert scan.colors is not None
    found = []
    for x in (0, 2):
        there = np.unique(scan.colors[scan.points[:, 0] == x], axis=0)
        assert len(there) == 1
        found.append(there[0].tolist())
    return found[0], found[1]


def test_scale_and_shift_move_a_picture(tmp_path: Path):
    picture(tmp_path / "skin.png", (255, 0, 0), (0, 0, 255))
    (tmp_path / "a.mtl").write_text("newmtl skin\nmap_Kd -s 0.25 1 -o 0.625 0 skin.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{VERTICES}{PLACES}usemtl skin\n{TRIANGLES}")
    (part,) = read_mesh_parts(tmp_path / "a.obj", max_bytes=10_000, error=HeadError)
    assert part.uv is not None
    assert part.uv.tolist() == [[0.625, 0], [0.875, 0], [0.875, 1], [0.625, 1]]
    assert edges(tmp_path / "a.obj") == ([0, 0, 255], [0, 0, 255])


@pytest.mark.parametrize("mask", ["lash_alpha.png", "lash.png"])
def test_a_picture_that_says_where_another_is_solid(tmp_path: Path, mask: str):
    """As lashes have one; where both are one file its own alpha counts."""
    picture(tmp_path / "lash.png", (20, 10, 0), (20, 10, 0))
    if mask == "lash.png":
        both = Image.open(tmp_path / mask)
        both.putalpha(Image.new("L", both.size, 0))
        both.save(tmp_path / mask)
    else:
        Image.new("L", (8, 8), 0).save(tmp_path / mask)
    (tmp_path / "a.mtl").write_text(f"newmtl lash\nmap_Kd lash.png\nmap_d {mask}\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{VERTICES}{PLACES}usemtl lash\n{TRIANGLES}")
    (part,) = read_mesh_parts(tmp_path / "a.obj", max_bytes=10_000, error=HeadError)
    assert part.opacity == "cutout" and part.picture.getpixel((3, 3)) == (20, 10, 0, 0)


def test_one_picture_for_each_material(tmp_path: Path):
    picture(tmp_path / "one.png", (200, 0, 0), (200, 0, 0))
    picture(tmp_path / "two.JPG", (0, 0, 200), (0, 0, 200))
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd one.png\nnewmtl b\nmap_Kd two.jpg\n")
    (tmp_path / "b.mtl").write_text("newmtl c\nKd 0.8 0.2 0.2\n")
    (tmp_path / "a.obj").write_text(
        f"mtllib a.mtl b.mtl\n{VERTICES}v 4 0 0\n{PLACES}usemtl a\nf 1/1 2/2 3/3\n"
        "usemtl b\nf 1/1 3/3 4/4\nusemtl c\nf 2 5 3\n"
    )
    one, two, three = read_mesh_parts(tmp_path / "a.obj", max_bytes=10_000, error=HeadError)
    assert [one.name, two.name, three.name] == ["a", "b", "c"]
    assert one.picture.getpixel((3, 3)) == (200, 0, 0)
    assert two.picture.getpixel((3, 3))[2] > 190 > 10 > two.picture.getpixel((3, 3))[0]
    assert three.picture is None and three.colors.tolist() == [[204, 51, 51]] * 3
    assert three.vertices.tolist() == [POINTS[1], POINTS[2], [4, 0, 0]]


def test_materials_that_alternate_each_show(tmp_path: Path):
    """Every other triangle has a picture, the rest a colour; they share all their points."""
    picture(tmp_path / "blue.png", (0, 0, 200), (0, 0, 200))
    (tmp_path / "a.mtl").write_text("newmtl a\nmap_Kd blue.png\nnewmtl b\nKd 0.8 0.2 0.2\n")
    side = range(12)
    lines = [f"v {x} {y} 0\nvt {x / 11} {y / 11}" for y in side for x in side]
    first = [1 + x + 12 * y for y in side[:-1] for x in side[:-1]]
    lines += ["usemtl a", *(f"f {n}/{n} {n + 1}/{n + 1} {n + 13}/{n + 13}" for n in first)]
    lines += ["usemtl b", *(f"f {n} {n + 13} {n + 12}" for n in first)]
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + "\n".join(lines))
    scan = read_scan(tmp_path / "a.obj")
    assert scan.colors is not None
    x, y, _ = (scan.points % 1).T
    inside = (x > 0) & (y > 0) & (x != y)
    assert inside.sum() == 3 * 2 * 11 * 11  # of each triangle; the others are on edges, and mixed
    assert (scan.colors[inside & (y > x)] == [204, 51, 51]).all()
    assert (scan.colors[inside & (y < x)] == [0, 0, 200]).all()
    assert scan.boundary.sum() == 4 * 11 * 4


def test_a_picture_in_a_folder_beside(tmp_path: Path):
    (tmp_path / "Textures").mkdir()
    (tmp_path / "textures").mkdir(exist_ok=True)
    picture(tmp_path / "textures" / "skin.png", (255, 0, 0), (0, 0, 255))
    (tmp_path / "a.mtl").write_text("newmtl skin\nmap_Kd textures/skin.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib ./a.mtl\n{VERTICES}{PLACES}usemtl skin\n{TRIANGLES}")
    assert edges(tmp_path / "a.obj") == ([255, 0, 0], [0, 0, 255])


def test_a_only_material_that_no_face_names_is_meant(tmp_path: Path):
    picture(tmp_path / "skin.png", (255, 0, 0), (0, 0, 255))
    (tmp_path / "my face.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib my face.mtl\n{VERTICES}{PLACES}{TRIANGLES}")
    assert edges(tmp_path / "a.obj") == ([255, 0, 0], [0, 0, 255])


@pytest.mark.parametrize(
    ("obj", "mtl", "told"),
    [
        ("usemtl skin", "", "places in a picture, but none is named"),
        ("mtllib none.mtl\nusemtl skin", "", r"material file 'none\.mtl' is not there"),
        ("mtllib b.mtl\nusemtl skin", "newmtl skin\nmap_Kd no.jpg\n", r"picture 'no\.jpg' is not"),
        ("mtllib b.mtl\nusemtl x", "newmtl y\nKd 1 0 0\nnewmtl z\nKd 1 0 0\n", "no material 'x'"),
        ("mtllib b.mtl", "newmtl y\nKd 1 0 0\nnewmtl z\nKd 1 0 0\n", "faces without a material"),
    ],
)
def test_what_is_missing_is_told(tmp_path: Path, obj: str, mtl: str, told: str):
    (tmp_path / "b.mtl").write_text(mtl)
    (tmp_path / "a.obj").write_text(f"{obj}\n{VERTICES}{PLACES}{TRIANGLES}")
    with pytest.warns(ElocuteWarning, match=told) as caught:
        scan = read_scan(tmp_path / "a.obj")
    assert scan.colors is None and len(caught) == 1
    assert str(tmp_path / "a.obj") in str(caught[0].message)


def test_a_material_may_have_its_colour_in_other_numbers(tmp_path: Path):
    for color, expected in (
        ("0.8 0.2 0.2", [204, 51, 51]),
        ("0.5", [128, 128, 128]),
        ("204 51 51", [204, 51, 51]),
        ("0.8 0.2 0.2 # red", [204, 51, 51]),
    ):
        (tmp_path / "a.mtl").write_text(f"newmtl skin\nKd {color}\nKs 0 0 0\n")
        (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nusemtl skin\n{VERTICES}f 1 2 3 4\n")
        found = read_scan(tmp_path / "a.obj").colors
        assert found is not None and found.tolist() == [expected] * 4


@pytest.mark.parametrize("mode", ["P", "L", "I;16", "RGBA", "CMYK"])
def test_pictures_of_any_depth(tmp_path: Path, mode: str):
    grey = np.full((32, 32), 51 << 8 if mode == "I;16" else 51, np.uint16)
    plain = Image.fromarray(grey if mode == "I;16" else grey.astype(np.uint8))
    made = plain if mode == "I;16" else plain.convert("RGB").convert(mode)
    name = "skin.jpg" if mode == "CMYK" else "skin.png"
    made.save(tmp_path / name)
    (tmp_path / "a.mtl").write_text(f"newmtl skin\nmap_Kd {name}\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\n{VERTICES}{PLACES}usemtl skin\n{TRIANGLES}")
    assert np.abs(np.array(edges(tmp_path / "a.obj")) - 51).max() < 10


def test_what_is_guessed_is_told(tmp_path: Path):
    """A mesh and its material file that were renamed together; a material by another name."""
    (tmp_path / "a.mtl").write_text("newmtl skin\nKd 0 0 1\n")
    (tmp_path / "a.obj").write_text(f"mtllib scan.mtl\nusemtl face\n{VERTICES}f 1 2 3 4\n")
    with pytest.warns(ElocuteWarning) as caught:
        scan = read_scan(tmp_path / "a.obj")
    assert scan.colors is not None and scan.colors.tolist() == [[0, 0, 255]] * 4
    told = [str(each.message) for each in caught]
    assert "'scan.mtl' is not there; a.mtl is taken" in told[0]
    assert "no material 'face'; the only one, 'skin', is taken" in told[1]
    (tmp_path / "a.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nusemtl skin\n{VERTICES}f 1 2 3 4\n")
    zeros = f"{VERTICES}vt 0 0\nf 1/1 2/1 3/1 4/1\n"
    for faces in (f"{VERTICES}f 1 2 3 4\n", zeros):
        (tmp_path / "a.obj").write_text(f"mtllib a.mtl\nusemtl skin\n{faces}")
        with pytest.warns(ElocuteWarning, match=r"no places in its picture 'skin\.png'"):
            assert read_scan(tmp_path / "a.obj").colors is None


@pytest.mark.parametrize("begin", range(6))
def test_polygons_that_turn_inwards_are_covered_by_their_triangles(tmp_path: Path, begin: int):
    dart = [(0, 0), (2, -1), (0.5, 0), (2, 1)]
    bent = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    for outline, area in ((dart, 0.5), (bent, 3.0)):
        turned = [*outline[begin:], *outline[:begin]]
        text = "".join(f"v {x} {y} 0\n" for x, y in turned) + "f"
        text += "".join(f" {n + 1}" for n in range(len(turned)))
        path = tmp_path / "polygon.obj"
        path.write_text(text)
        mesh = read_mesh_file(path, max_bytes=10_000, error=HeadError)
        a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
        signed = np.cross(b - a, c - a)[:, 2] / 2
        assert (signed > 0).all() and signed.sum() == pytest.approx(area)
        assert len(mesh.quads()) == (1 if len(turned) == 4 else 4)
