"""Points picked on a mesh in MeshLab, as it saves them (.pp)."""

from __future__ import annotations

import re
from pathlib import Path

from elocute.errors import InputError
from elocute.files.json_records import finite_number

PICKED_SUFFIX = ".pp"
_POINT = re.compile(r"<point\b([^<>]*)>")
_VALUE = re.compile(r"""\b(\w+)\s*=\s*(?:"([^"<>]*)"|'([^'<>]*)')""")


def picked_points(
    text: str, path: Path, error: type[InputError] = InputError
) -> list[list[float] | None]:
    """The points (x, y, z) of a .pp's text in the mesh's unit; None for one that was taken back.

    They stand by their names where these are numbers, else as they come. Raises `error`, about the
    file's path, without points, and for points without numbers.
    """
    points: dict[str, list[float] | None] = {}
    for number, match in enumerate(_POINT.finditer(text)):
        values = {name: one or other for name, one, other in _VALUE.findall(match[1])}
        place = [_number(values.get(axis, "")) for axis in "xyz"]
        if None in place:
            raise error.about(
                path, found=f"point {number} without x, y, z", allowed="a .pp of MeshLab"
            )
        name = values.get("name", "")
        name = name if name not in points else f"{name} {number}"
        points[name] = None if values.get("active") == "0" else [v for v in place if v is not None]
    if not points:
        raise error.about(path, found="no picked points", allowed="a .pp of MeshLab")
    if all(name.isascii() and name.isdigit() and len(name) < 10 for name in points):
        return [points[name] for name in sorted(points, key=int)]
    return list(points.values())


def _number(text: str) -> float | None:
    try:
        return finite_number(float(text))
    except ValueError:
        return None
