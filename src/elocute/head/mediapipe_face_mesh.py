"""MediaPipe's face mesh: which of its 478 points lie where.

Points 0 to 467 are the face mesh's, 468 to 477 the irises' (centre first, then the rim).
Right and left are the person's own; a picture shows a person's right side on its left.
"""

from __future__ import annotations

POINT_COUNT = 478
IRIS = 468

# The lips, from the right mouth corner to the left one.
OUTER_UPPER = (61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291)
OUTER_LOWER = (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291)
INNER_UPPER = (78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308)
INNER_LOWER = (78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308)
LIP_CONTOURS = (OUTER_UPPER, OUTER_LOWER, INNER_UPPER, INNER_LOWER)
LIPS = tuple(sorted({point for contour in LIP_CONTOURS for point in contour}))
# Middle pairs of the inner lips, upper and lower: their mean distance is the lips' gap.
GAP_PAIRS = tuple(zip(INNER_UPPER[3:8], INNER_LOWER[3:8], strict=True))
UNDER_NOSE = 2  # where the nose meets the upper lip

# The outer ones, right and left: their distance is the unit of length in pictures.
EYE_CORNERS = (33, 263)
# From the outer corner to the inner one.
LIDS = {
    "upper_right": (33, 246, 161, 160, 159, 158, 157, 173, 133),
    "lower_right": (33, 7, 163, 144, 145, 153, 154, 155, 133),
    "upper_left": (263, 466, 388, 387, 386, 385, 384, 398, 362),
    "lower_left": (263, 249, 390, 373, 374, 380, 381, 382, 362),
}
# The rim of the face as a picture shows it: it slides over the skin as the head turns.
RIM = (
    10,
    338,
    297,
    332,
    284,
    251,
    389,
    356,
    454,
    323,
    361,
    288,
    397,
    365,
    379,
    378,
    400,
    377,
    152,
    148,
    176,
    149,
    150,
    136,
    172,
    58,
    132,
    93,
    234,
    127,
    162,
    21,
    54,
    103,
    67,
    109,
)
CHIN = (152, 175, 199, 200, 148, 377, 171, 396, 208, 428)  # shows how far the jaw drops
