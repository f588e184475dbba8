"""What the 68 landmarks of iBUG's scheme are called; right and left are the person's own."""

from __future__ import annotations

from collections.abc import Iterator


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
