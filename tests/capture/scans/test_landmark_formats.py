"""Landmarks in Menpo's .ljson, in any order, come out in iBUG's, by their labels."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.cli import options
from elocute.errors import CaptureError
from elocute.registration.landmarks import LANDMARK_SUFFIXES, read_landmarks

POINTS = np.random.default_rng(0).random((68, 3)).round(6)
PARTS = {
    "jaw": range(17),
    "left_eyebrow": range(17, 22),
    "right_eyebrow": range(22, 27),
    "nose": range(27, 36),
    "left_eye": range(36, 42),
    "right_eye": range(42, 48),
    "mouth": range(48, 68),
}
# As landmarker.io stores them: parts in the order of its template, here that of their names.
ORDER = tuple(sorted(PARTS))


def second_version(order: tuple[str, ...] = ORDER) -> dict[str, Any]:
    """Points part after part, and the masks that say which is which."""
    points: list[Any] = []
    labels = []
    for name in order:
        rows = [POINTS[place].tolist() for place in PARTS[name]]
        labels.append({"label": name, "mask": list(range(len(points), len(points) + len(rows)))})
        points += rows
    marks = {"points": points, "connectivity": [[0, 1], [1, 2]]}
    return {"version": 2, "labels": labels, "landmarks": marks}


def first_version() -> dict[str, Any]:
    groups = [
        {
            "label": name,
            "connectivity": [[0, 1]],
            "landmarks": [{"point": POINTS[place].tolist()} for place in PARTS[name]],
        }
        for name in ORDER
    ]
    return {"version": 1, "groups": groups}


def third_version(**groups: dict[str, Any]) -> dict[str, Any]:
    return {"version": 3, "groups": groups}


def read(folder: Path, record: dict[str, Any], name: str = "a.ljson"):
    (folder / name).write_text(json.dumps(record))
    return read_landmarks(folder / name)


@pytest.mark.parametrize(
    "record",
    [
        first_version(),
        second_version(),
        third_version(PTS=second_version()),
        third_version(eyes={"landmarks": {"points": [[0, 0, 1]]}}, ibug68=second_version()),
    ],
    ids=["1", "2", "3", "3 with others"],
)
def test_every_version_is_put_in_order(tmp_path: Path, record: dict[str, Any]) -> None:
    found = read(tmp_path, record)
    assert np.allclose(found.points, POINTS) and (found.confidence == 1).all()


def test_names_of_parts_vary(tmp_path: Path) -> None:
    record = second_version()
    names = {"jaw": "Chin", "left_eye": "left-eye", "right_eyebrow": "right eyebrow"}
    for label in record["labels"]:
        label["label"] = names.get(label["label"], label["label"])
    assert np.allclose(read(tmp_path, record).points, POINTS)
    halves = second_version(("mouth",))
    mask = halves["labels"][0]["mask"]
    halves["labels"] = [
        {"label": "outer_mouth", "mask": mask[:12]},
        {"label": "inner_mouth", "mask": mask[12:]},
    ]
    found = read(tmp_path, halves)
    assert np.allclose(found.points[48:], POINTS[48:]) and not found.good[:48].any()


def test_points_that_are_not_seen_are_null(tmp_path: Path) -> None:
    record = second_version()
    record["landmarks"]["points"][0] = [None, None, None]  # the jaw comes first
    record["landmarks"]["points"][1] = None
    found = read(tmp_path, record)
    assert np.isnan(found.points[:2]).all() and found.good.sum() == 66
    first = first_version()
    first["groups"][0]["landmarks"][0]["point"] = [None, None, None]
    assert read(tmp_path, first).good.sum() == 67


def test_without_known_labels_the_order_is_ibugs(tmp_path: Path) -> None:
    plain = {"landmarks": {"points": POINTS.tolist()}, "labels": [{"label": "all", "mask": []}]}
    for record in (plain, third_version(PTS=plain), plain | {"version": 2}):
        assert np.allclose(read(tmp_path, record).points, POINTS)
    assert np.allclose(read(tmp_path, second_version(), "a.json").points, POINTS)


def test_a_pts_may_miss_points_too(tmp_path: Path) -> None:
    lines = [" ".join(map(str, row)) for row in POINTS]
    lines[5] = "nan nan nan"
    (tmp_path / "a.pts").write_text("version: 1\nn_points:  68\n{\n" + "\n".join(lines) + "\n}\n")
    found = read_landmarks(tmp_path / "a.pts", 0.001)
    assert np.allclose(found.points[6:], POINTS[6:] / 1000) and found.confidence[5] == 0


@pytest.mark.parametrize(
    ("record", "told"),
    [
        ([], "JSON of a list"),
        ({}, "no points"),
        ({"groups": {}}, "groups none"),
        (
            third_version(a=second_version(("jaw",)), b=second_version(("nose",))),
            r"groups a \(17 points\), b \(9 points\)",
        ),
        ({"landmarks": {"points": [[1, 2]] * 68}}, "a point of 2 numbers"),
        ({"landmarks": {"points": [[1, 2, "x"]] * 68}}, "a point of"),
        ({"landmarks": {"points": [[0, 0, 1]] * 60}}, "60 points"),
        (
            {
                "landmarks": {"points": [[0, 0, 1]] * 5},
                "labels": [{"label": "jaw", "mask": [0, 5]}],
            },
            "mask is no list",
        ),
        (
            {
                "landmarks": {"points": [[0, 0, 1]] * 5},
                "labels": [{"label": "jaw", "mask": [0, 4]}],
            },
            "2 points of jaw, which has 17",
        ),
        ({"groups": [{"label": "jaw"}]}, "without landmarks"),
    ],
)
def test_what_is_none_is_one_line(tmp_path: Path, record: Any, told: str) -> None:
    with pytest.raises(CaptureError, match=told) as caught:
        read(tmp_path, record)
    assert "a.ljson" in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("{\n0 0 1\n}", "1 points"),
        ("n_points: 2\n{\n0 0 1\n}", "1 points where n_points says 2"),
        ("{\n0 zero 1\n}", "no numbers"),
        ("0 0 1", "no { … }"),
    ],
)
def test_a_pts_that_is_none_is_one_line(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "a.pts").write_text(text)
    with pytest.raises(CaptureError, match=told):
        read_landmarks(tmp_path / "a.pts")


def picked(points: np.ndarray, first: int = 0, quote: str = '"') -> str:
    rows = [
        f"<point active={quote}1{quote} name={quote}{n}{quote} x={quote}{x:.7f}{quote} "
        f"y={quote}{y:.7f}{quote} z={quote}{z:.7f}{quote}/>"
        for n, (x, y, z) in enumerate(points, first)
    ]
    data = '<DocumentData><DataFileName name="face.ply"/></DocumentData>'
    return (
        f"<!DOCTYPE PickedPoints>\n<PickedPoints>\n {data}\n "
        + "\n ".join(rows)
        + "</PickedPoints>"
    )


@pytest.mark.parametrize("suffix", [".pp", ".npy", ".txt", ".json", ".pts"])
@pytest.mark.parametrize("count", [68, 51])
def test_all_points_or_those_without_the_jaw(tmp_path: Path, suffix: str, count: int):
    """51 are what FLAME's embedding has, and what its users pick in MeshLab: iBUG's 18 to 68."""
    points = np.random.default_rng(0).uniform(-0.1, 0.1, (count, 3))
    path = tmp_path / f"face{suffix}"
    lines = "\n".join(" ".join(f"{value:.7f}" for value in row) for row in points)
    if suffix == ".npy":
        np.save(path, points)
    elif suffix == ".pts":
        path.write_text(f"version: 1\nn_points: {count}\n{{\n{lines}\n}}")
    else:
        written = {".pp": picked(points), ".txt": lines, ".json": json.dumps(points.tolist())}
        text = written[suffix]
        path.write_text(f'{{"points": {text}}}' if suffix == ".json" else text)
    found = read_landmarks(path, 2.0)
    assert np.allclose(found.points[-count:], 2 * points, atol=1e-6)
    assert np.isnan(found.points[:-count]).all() and (found.confidence[:-count] == 0).all()
    assert (found.confidence[-count:] == 1).all() and found.enough


def test_picked_points_go_by_their_numbers(tmp_path: Path):
    points = np.random.default_rng(1).uniform(-0.1, 0.1, (51, 3))
    rows = picked(points, 1, "'").split("\n ")
    order = [rows[0], rows[1], *rows[:1:-1]]
    text = "\n ".join(order).replace("</PickedPoints>", "") + "</PickedPoints>"
    (tmp_path / "a.pp").write_text(text)
    assert np.allclose(read_landmarks(tmp_path / "a.pp").points[17:], points, atol=1e-6)
    taken_back = picked(points).replace('active="1" name="3"', 'active="0" name="3"')
    (tmp_path / "a.pp").write_text(taken_back)
    found = read_landmarks(tmp_path / "a.pp")
    assert np.isnan(found.points[20]).all() and np.isfinite(found.points[21]).all()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no picked points"),
        (picked(np.zeros((5, 3))), r"5 points\); allowed: 68 points .* or 51 without the jaw"),
        ('<point name="1" x="0" y="0"/>', "point 0 without x, y, z"),
        ('<point x="nan" y="0" z="0"/>', "point 0 without x, y, z"),
    ],
)
def test_picked_points_that_are_none(tmp_path: Path, text: str, told: str):
    (tmp_path / "a.pp").write_text(text)
    with pytest.raises(CaptureError, match=told):
        read_landmarks(tmp_path / "a.pp")


def test_the_option_names_every_suffix_that_is_read() -> None:
    assert all(suffix in options.Landmarks.help for suffix in LANDMARK_SUFFIXES)
