"""A page on which the landmarks of a scan are set by hand: one file that works offline."""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import CaptureError, OutputError, printable
from elocute.export.html import page_asset, page_script
from elocute.files.atomic import write_atomically
from elocute.files.html_page import filled_page, script_bytes, script_json
from elocute.head.builtin import load_builtin_head
from elocute.registration.landmarks import GOOD_MIN
from elocute.registration.scan import Scan


def _jaw() -> Iterator[str]:
    for step in range(8, 0, -1):
        yield f"right side of the jaw, {step} of 8; 8 lies before the ear, 1 beside the chin"
    yield "chin; its lowest point, in the middle"
    for step in range(1, 9):
        yield f"left side of the jaw, {step} of 8; 8 lies before the ear, 1 beside the chin"


def _brows() -> Iterator[str]:
    places = ("outer end", "outer quarter", "middle", "inner quarter", "inner end")
    yield from (f"right eyebrow, {place}" for place in places)
    yield from (f"left eyebrow, {place}" for place in reversed(places))


def _nose() -> Iterator[str]:
    yield "bridge of the nose, top; between the eyes, where it is deepest"
    yield "bridge of the nose, a third down"
    yield "bridge of the nose, two thirds down"
    yield "tip of the nose; where it stands out most"
    yield "right nostril, outer; where the wing meets the lip"
    yield "right nostril, inner; under the middle of the opening"
    yield "under the nose; where the middle wall meets the lip"
    yield "left nostril, inner; under the middle of the opening"
    yield "left nostril, outer; where the wing meets the lip"


def _eyes() -> Iterator[str]:
    corners = ("outer corner", "inner corner")
    upper, lower = "; on the lid's edge, above the iris's", "; on the lid's edge, below the iris's"
    yield f"right eye, {corners[0]}"
    yield f"right eye, upper lid, outer{upper} outer rim"
    yield f"right eye, upper lid, inner{upper} inner rim"
    yield f"right eye, {corners[1]}"
    yield f"right eye, lower lid, inner{lower} inner rim"
    yield f"right eye, lower lid, outer{lower} outer rim"
    yield f"left eye, {corners[1]}"
    yield f"left eye, upper lid, inner{upper} inner rim"
    yield f"left eye, upper lid, outer{upper} outer rim"
    yield f"left eye, {corners[0]}"
    yield f"left eye, lower lid, outer{lower} outer rim"
    yield f"left eye, lower lid, inner{lower} inner rim"


def _mouth() -> Iterator[str]:
    yield "right corner of the mouth, outer; where the lips' colour ends"
    yield "upper lip, right third; on the upper border of its colour"
    yield "upper lip, right peak; beside the middle, on the upper border of its colour"
    yield "upper lip, middle; in the dip, on the upper border of its colour"
    yield "upper lip, left peak; beside the middle, on the upper border of its colour"
    yield "upper lip, left third; on the upper border of its colour"
    yield "left corner of the mouth, outer; where the lips' colour ends"
    yield "lower lip, left third; on the lower border of its colour"
    yield "lower lip, left of the middle; on the lower border of its colour"
    yield "lower lip, middle; on the lower border of its colour"
    yield "lower lip, right of the middle; on the lower border of its colour"
    yield "lower lip, right third; on the lower border of its colour"
    yield "right corner of the mouth, inner; where the lips part"
    yield "upper lip's inner edge, right; where it meets the lower lip"
    yield "upper lip's inner edge, middle; where it meets the lower lip"
    yield "upper lip's inner edge, left; where it meets the lower lip"
    yield "left corner of the mouth, inner; where the lips part"
    yield "lower lip's inner edge, left; where it meets the upper lip"
    yield "lower lip's inner edge, middle; where it meets the upper lip"
    yield "lower lip's inner edge, right; where it meets the upper lip"


LANDMARK_NAMES = (*_jaw(), *_brows(), *_nose(), *_eyes(), *_mouth())
"""Name of each and, behind a semicolon, where it lies."""

KEY_LANDMARKS = (
    *(36, 45, 30, 8, 39, 42, 48, 54),
    *(27, 31, 33, 35, 51, 57, 62, 66),
    *(37, 38, 40, 41, 43, 44, 46, 47),
    *(50, 52, 60, 64, 56, 58),
)
"""Those that a registration lives on; the first four tell how the face lies."""


POINTS_MAX = 1_000_000
"""More than a browser turns smoothly."""
GREY = (176, 170, 165)
EYES, MOUTH, INNER = (range(36, 42), range(42, 48)), range(48, 68), range(60, 68)
EYES_LARGER, MOUTH_HIGHER, LIPS_APART_MM = 1.35, 1.9, 2.5
LINES = (
    *(range(17), range(17, 22), range(22, 27), range(27, 31), range(31, 36)),
    *((*range(36, 42), 36), (*range(42, 48), 42), (*range(48, 60), 48), (*range(60, 68), 60)),
)


def write_landmark_page(path: str | Path, scan: Scan) -> None:
    """Write a page (.html) on which a person sets the landmarks of a scan, and saves them.

    It asks for `KEY_LANDMARKS`, shows where each is to be expected once four are set, and gives a
    .json that `read_landmarks` reads, named as the page. The scan is in the unit in which landmarks
    are wanted: that of its file. Raises CaptureError for a scan of more than 1,000,000 points, or
    with numbers that are not finite; OutputError for another suffix, and where the page cannot be
    written; MachineError where the page was not built.
    """
    path = Path(path)
    if path.suffix.lower() != ".html":
        raise OutputError.about(path, found=f"suffix {path.suffix!r}", allowed=".html")
    if len(scan.points) > POINTS_MAX:
        raise CaptureError.about(
            scan.name,
            found=f"{len(scan.points)} points",
            allowed=f"up to {POINTS_MAX} in a page",
            remedy="thin it out; landmarks of the thinner mesh fit the finer one",
        )
    if not np.isfinite(scan.points).all():
        raise CaptureError.about(scan.name, found="numbers that are not finite", allowed="a mesh")
    colors = (
        np.tile(np.array(GREY, np.uint8), (len(scan.points), 1))
        if scan.colors is None
        else scan.colors
    )
    average = _average_face()
    take: dict[str, Any] = {
        "file": path.with_suffix(".json").name,
        "names": LANDMARK_NAMES,
        "order": KEY_LANDMARKS,
        "enough": GOOD_MIN,
        "average": np.round(average, 5).tolist(),
        "drawing": np.round(_drawing(average), 2).tolist(),
        "lines": [list(line) for line in LINES],
    }
    parts = {
        "@TITLE@": html.escape(printable(f"Landmarks of {Path(scan.name).name}")),
        "@TAKE@": script_json(take),
        "@POINTS@": script_bytes(scan.points.astype("<f4").tobytes()),
        "@TRIANGLES@": script_bytes(scan.triangles.astype("<u4").tobytes()),
        "@COLORS@": script_bytes(np.ascontiguousarray(colors, np.uint8).tobytes()),
        "@SCRIPT@": page_script("landmarks.js"),
    }
    pieces = filled_page(page_asset("landmarks.html"), parts)
    with write_atomically(path) as draft, draft.open("w", encoding="utf-8") as file:
        for piece in pieces:
            file.write(piece)


def _average_face() -> Float64Array:
    """(68, 3) m of the built-in head."""
    head = load_builtin_head()
    return head.template[head.landmarks].astype(np.float64)


def _drawing(average: Float64Array) -> Float64Array:
    """(68, 2) per cent of the drawing's width: the face from the front, crowded places larger."""
    flat = 1000 * average[:, :2]
    for eye in EYES:
        flat[eye] = flat[eye].mean(axis=0) + EYES_LARGER * (flat[eye] - flat[eye].mean(axis=0))
    middle = flat[MOUTH].mean(axis=0)
    flat[MOUTH] = middle + np.array([1.25, MOUTH_HIGHER]) * (flat[MOUTH] - middle) - [0, 9]
    flat[61:64, 1] += LIPS_APART_MM
    flat[65:68, 1] -= LIPS_APART_MM
    flat[5:12, 1] -= 16 * np.sin(np.pi * np.arange(1, 8) / 8)
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = 92 / (high[0] - low[0])
    return np.stack([4 + scale * (flat[:, 0] - low[0]), 4 + scale * (high[1] - flat[:, 1])], axis=1)
