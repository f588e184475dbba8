"""Finds the materials of an .obj or a .ply: material files and pictures beside it.

A file may name them with folders of another machine. Only the bare name counts: it is looked for in
the mesh's own folder and in folders there that are commonly called so, in any case of its letters,
as a regular file of limited size. What is not there is told.
"""

from __future__ import annotations

import os
import unicodedata
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from elocute.errors import ElocuteWarning, InputError
from elocute.files.reading import FileKind, bytes_text, read_bytes
from elocute.files.unpacked_size import unpacked_limit
from elocute.meshes.mesh_file import check_picture, opened_picture
from elocute.meshes.obj_mesh import line_name, text_lines
from elocute.meshes.polygon_mesh import PolygonMesh, color_bytes

MATERIAL_MAX_BYTES = 1_000_000
PICTURE_MAX_BYTES = 200_000_000
PICTURES_MAX = 16
PICTURES_MIN_BYTES = 4 * 8192 * 8192
"""All pictures of a mesh may unpack to this much, however small their files are."""
FOLDERS = ("", "textures", "texture", "tex", "maps", "images", "materials")
SWITCHES = {"-blendu": 1, "-blendv": 1, "-boost": 1, "-mm": 2, "-texres": 1, "-clamp": 1}
SWITCHES |= {"-bm": 1, "-imfchan": 1, "-cc": 1, "-type": 1, "-colorspace": 1}
"""Options of a picture in a material file, and how many words follow each."""
SHIFTS = ("-s", "-o", "-t")
"""Those that one to three numbers follow."""


@dataclass(frozen=True, eq=False)
class Look:
    """How a material looks."""

    name: str  # of the material, or the file
    color: Any = None  # (3,) sRGB, 0 to 255; None where nothing says one
    picture: Any = None  # in RGB or RGBA
    scale: tuple[float, float] = (1.0, 1.0)  # a place in the picture is `scale · uv + offset`
    offset: tuple[float, float] = (0.0, 0.0)
    opacity: str = "opaque"  # as for `MeshPart`


@dataclass(frozen=True)
class _Material:
    """A material as its file describes it."""

    color: tuple[float, ...] | None = None
    picture: str = ""
    mask: str = ""  # a picture of where it is solid
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)


def mesh_looks(
    mesh: PolygonMesh, used: Iterable[int], placed: bool, path: Path, error: type[InputError]
) -> dict[int, Look]:
    """How the materials of a mesh look.

    used: rows of its `material_names`, -1 for faces without a material; placed: whether any face
    has places in a picture. Raises an `error` for material files and pictures that are no regular
    files, damaged, or unpack to far more than their size; warns for each that is named but not
    there.
    """
    beside = _Beside(path, error)
    placed = placed and bool(np.ptp(mesh.uv, axis=0).any())  # some programs write zeros only
    looks = {}
    for number, described in _described(mesh, sorted(used), beside, placed):
        name = mesh.material_names[number] if number >= 0 else path.stem
        look = Look(name, described.color, scale=described.scale, offset=described.offset)
        if described.picture and placed:
            picture, opacity = beside.picture(described.picture)
            if picture is not None and described.mask not in ("", described.picture):
                mask, _ = beside.picture(described.mask)
                if mask is not None:
                    picture, opacity = _cut_out(picture, mask), "cutout"
            # The colour of a material is white or none beside its picture.
            color = None if picture is None else look.color
            look = replace(look, color=color, picture=picture, opacity=opacity)
        elif described.picture:
            beside.tell(f"no places in its picture {described.picture!r}; it is left out")
            look = replace(look, color=None)
        looks[number] = look
    return looks


def _described(
    mesh: PolygonMesh, used: list[int], beside: _Beside, placed: bool
) -> Iterator[tuple[int, _Material]]:
    if not mesh.libraries:  # of a .ply, whose materials are pictures; or nothing is said
        ply = beside.path.suffix.lower() == ".ply"
        if mesh.colors is None and not (ply and mesh.material_names) and placed:
            beside.tell("places in a picture, but none is named; it has no colours")
        for number in used:
            picture = mesh.material_names[number] if ply and number >= 0 else ""
            yield number, _Material(picture=picture)
        return
    known = beside.materials(mesh.libraries)
    folded = {_folded(name): material for name, material in known.items()}
    for number in used:
        name = mesh.material_names[number] if number >= 0 else ""
        described = known.get(name) or folded.get(_folded(name))
        described = described or folded.get(_folded(name.partition(" #")[0]))
        if described is None and len(known) == 1:
            described = next(iter(known.values()))
            if number >= 0:
                beside.tell(f"no material {name!r}; the only one, {next(iter(known))!r}, is taken")
        elif described is None and known:
            what = f"no material {name!r}" if number >= 0 else "faces without a material"
            beside.tell(f"{what}; their colours are left out")
        yield number, described or _Material()


class _Beside:
    """The files beside a mesh."""

    def __init__(self, path: Path, error: type[InputError]) -> None:
        self.path, self._error = path, error
        self._pictures: dict[Path, tuple[Any, str]] = {}
        self._budget = 0

    def tell(self, what: str) -> None:
        """Warn of something about the mesh."""
        warnings.warn(f"{self.path}: {what}", ElocuteWarning, stacklevel=2)

    def materials(self, names: Iterable[str]) -> dict[str, _Material]:
        """The materials of all files that are named and there."""
        found: dict[str, _Material] = {}
        for name in names:
            files = [self._find(name), self._find(name.partition(" #")[0])]
            files = [file for file in files if file][:1] or [self._find(n) for n in name.split()]
            own = self._find(f"{self.path.stem}.mtl")
            if not any(files) and own:
                self.tell(f"its material file {_bare(name)!r} is not there; {own.name} is taken")
                files = [own]
            if not files or not all(files):
                self.tell(f"its material file {_bare(name)!r} is not there; colours are left out")
            for file in filter(None, files):
                data = read_bytes(
                    file, FileKind("a material file", MATERIAL_MAX_BYTES, self._error)
                )
                found |= _parsed_materials(data)
        return found

    def picture(self, name: str) -> tuple[Any, str]:
        """A picture as `drawn_picture` gives it, or None, which is told."""
        file = self._find(name)
        if file is None:
            self.tell(f"its picture {_bare(name)!r} is not there; its colours are left out")
            return None, "opaque"
        if file not in self._pictures:
            if len(self._pictures) == PICTURES_MAX:
                raise self._error.about(
                    self.path, found=f"more than {PICTURES_MAX} pictures", allowed="fewer"
                )
            self._pictures[file] = self._opened(file)
        return self._pictures[file]

    def _opened(self, file: Path) -> tuple[Any, str]:
        data = read_bytes(file, FileKind("a picture", PICTURE_MAX_BYTES, self._error))
        width, height = check_picture(data, file, self._error)
        self._budget += 4 * width * height
        limit = unpacked_limit(len(data), PICTURES_MIN_BYTES)
        if self._budget > limit:
            raise self._error.about(
                file,
                found=f"a picture of {width} × {height} pixels",
                allowed=f"pictures up to {bytes_text(limit)} unpacked",
            )
        return opened_picture(data, file, self._error)

    def _find(self, name: str) -> Path | None:
        """The file of a name whose folders do not count, its letters in any case."""
        bare = _bare(name)
        if not bare or bare in (".", ".."):
            return None
        for inner in FOLDERS:
            folder = self.path.parent / inner
            try:
                if os.path.lexists(folder / bare):
                    return folder / bare
                with os.scandir(folder) as entries:
                    alike = [each.name for each in entries if _folded(each.name) == _folded(bare)]
            except (OSError, ValueError):  # no folder, or a name that no file can have
                continue
            if alike:
                return folder / min(alike)
        return None


def _cut_out(picture: Any, mask: Any) -> Any:
    """A picture that is solid where another has alpha, or where that is bright."""
    band = mask.getchannel("A") if mask.mode == "RGBA" else mask.convert("L")
    picture = picture.convert("RGB")
    picture.putalpha(band.resize(picture.size))
    return picture


def _bare(name: str) -> str:
    return Path(name.strip().strip('"').replace("\\", "/")).name


def _folded(name: str) -> str:
    """A name as systems compare it that tell neither cases apart nor ways to write an accent."""
    return unicodedata.normalize("NFC", name).casefold()


def _parsed_materials(data: bytes) -> dict[str, _Material]:
    """The materials of a .mtl; lines that cannot be read are passed over."""
    materials: dict[str, _Material] = {}
    name = None
    for line in text_lines(data):
        words = line.split()
        kind = words[0].lower() if words else b""
        if kind == b"newmtl":
            name = line_name(line)
            materials[name] = _Material()
        elif name is not None and kind == b"kd":
            color = [number for number in map(_number, words[1:4]) if number is not None]
            if color:  # one number means grey
                row = np.array([color if len(color) == 3 else 3 * color[:1]])
                materials[name] = replace(
                    materials[name], color=tuple(color_bytes(row, "f8")[0].tolist())
                )
        elif name is not None and (
            kind == b"map_kd" or (kind == b"map_ka" and not materials[name].picture)
        ):
            picture, scale, offset = _picture(line_name(line))
            materials[name] = replace(materials[name], picture=picture, scale=scale, offset=offset)
        elif name is not None and kind == b"map_d":
            materials[name] = replace(materials[name], mask=_picture(line_name(line))[0])
    return materials


def _picture(text: str) -> tuple[str, tuple[float, float], tuple[float, float]]:
    """The name of a picture, its scale and its offset, from what follows map_Kd."""
    shifts = {"-s": [1.0, 1.0], "-o": [0.0, 0.0]}
    while text.startswith("-") and len(words := text.split()) > 1:
        option = words[0].lower()
        if option in SHIFTS:
            numbers = []
            for word in words[1:4]:
                number = _number(word.encode())
                if number is None:
                    break
                numbers.append(number)
            count = min(len(numbers), len(words) - 2)
            shift = shifts.setdefault(option, [0.0, 0.0])
            shift[: min(count, 2)] = numbers[: min(count, 2)]
        elif option in SWITCHES:
            count = SWITCHES[option]
        else:
            break
        rest = text.split(None, count + 1)
        text = rest[-1].strip() if len(rest) == count + 2 else ""
    (a, b), (c, d) = shifts["-s"], shifts["-o"]
    return text, (a, b), (c, d)


def _number(word: bytes) -> float | None:
    try:
        number = float(word)
    except ValueError:
        return None
    return number if np.isfinite(number) else None
