"""Lips as rings and columns: sealing, moving and rolling them."""

from __future__ import annotations

import numpy as np

from recipes.head.anatomy import CONTACT_RING, CORNERS, Anatomy
from recipes.head.topology import SmoothSpread

PAIRS = tuple(
    [
        (upper, lower)
        for upper, lower in zip((27, 28, 30, 32, 34, 36), range(25, 19, -1), strict=True)
    ]
    + [(0, 19)]
    + [(upper, lower) for upper, lower in zip((2, 4, 6, 8, 10, 11), range(18, 12, -1), strict=True)]
)
"""Columns (upper, lower) that meet, by increasing x. The upper lip has twice the columns."""
BETWEEN = (29, 31, 33, 35, 37, 1, 3, 5, 7, 9)
"""Upper columns that meet the lower lip between two of its columns."""
FOLLOW = np.array([0.58, 0.66, 0.74, 0.82, 0.90, 0.96, 1.0, 1.0, 0.97, 0.8])
"""How far each ring follows a small displacement of the contact ring."""
OVERLAP_M = 0.0002
UPPER_HEIGHT, LOWER_HEIGHT = 0.70, 0.745
"""Share of MakeHuman's lips that is left: on the mean face 7.5 and 9.5 mm, as people's are."""
UPPER_DEPTH, LOWER_DEPTH = 0.74, 0.90
"""The same of how far the red lip stands out before the line where lips meet."""
CORNER_HEIGHT, NEAR_CORNER = 0.35, 0.7
"""The same of heights at the corners, where lips hang over each other and sulk; from where on."""
ACROSS = (0, 0.11, 0.24, 0.36, 0.47, 0.57, 0.68, 0.78, 0.86, 0.92, 0.96, 0.986, 1)
"""Shares of the way from the middle of the mouth to its corners, of the following."""
UPPER_BORDER_MM = (-0.2, 0.2, 0.4, 0.1, -0.6, -1.3, -2.0, -2.5, -1.9, -1.4, -1.1, -0.9, -0.7)
MEETING_MM = (0, 0.05, 0.35, 0.45, 0.4, 0.25, 0.0, -0.25, -0.45, -0.65, -0.75, -0.75, -0.7)
LOWER_BORDER_MM = (0.4, 0.2, 0.0, 0.0, 0.1, 0.3, 0.8, 0.6, 0.2, -0.1, -0.4, -0.6, -0.7)
"""How much higher than MakeHuman's, which has bars for lips: a bow above that falls to the corners,
the line where lips meet in three arcs, a round edge below."""
CORNER_V_MM, V_COLUMNS = 0.35, (1.0, 0.75, 0.4)
"""How far the red of each lip is moved away from the other beside the corners, and by which share
in the columns from there on: lips that lie over each other end in a black line."""
BEHIND = np.array([0.4, 0.0])[:, None, None]
"""How much of that the rings behind the line follow: teeth are there."""
RING_COUNT, COLUMN_COUNT = 10, 38
EVENINGS = 8


class Lips:
    """Displacement fields of the skin that move the lips of one neutral face."""

    def __init__(self, anatomy: Anatomy, skin: np.ndarray) -> None:
        self.rings = anatomy.lip_rings
        self.count = anatomy.skin_count
        self.handles = np.unique(self.rings)
        self.centre = skin[self.rings[0]].mean(0)
        self.spread = self.spreading(anatomy, skin, radius_m=0.055)
        self.wide_spread = self.spreading(anatomy, skin, radius_m=0.080)
        contact = skin[self.rings[CONTACT_RING], 0]
        self.fractions = {
            column: _fraction(contact, column, *_beside(column)) for column in BETWEEN
        }
        half_width = np.abs(contact[list(CORNERS)]).mean()
        self.across = np.clip(contact / half_width, -1, 1)  # (column,) -1 and 1 at the corners
        self.rest = skin

    def spreading(self, anatomy: Anatomy, skin: np.ndarray, radius_m: float) -> SmoothSpread:
        """Smooth falloff from the lips to `radius_m`, stopping at the nose."""
        away = skin - self.centre
        near = np.linalg.norm(away * [1, 1, 0.6], axis=1) < radius_m
        nose = (away[:, 1] > 0.022) & (away[:, 2] > -0.022)
        return SmoothSpread(
            anatomy.skin_quads, self.count, self.handles, np.flatnonzero(near & ~nose), alpha=0.01
        )

    def field(self, moves: np.ndarray, wide: bool = False) -> np.ndarray:
        """(vertex, 3) of the skin from moves (ring, column, 3) of the lip vertices."""
        displacement = np.zeros((self.count, 3))
        displacement[self.rings.ravel()] = moves.reshape(-1, 3)
        spread = self.wide_spread if wide else self.spread
        return spread(displacement[self.handles])

    def evened_corners(self, displacement: np.ndarray) -> np.ndarray:
        """A displacement (vertex, 3) in which the red of the very corners goes where that beside it
        does; else the corner is drawn over its lips, and folds."""
        moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
        own = displacement[self.rings]
        for corner in CORNERS:
            beside = (own[:, corner - 1] + own[:, corner + 1]) / 2
            moves[1:CONTACT_RING, corner] = (beside - own[:, corner])[1:CONTACT_RING]
        evened = displacement.copy()
        evened[self.rings] += moves
        return evened

    def thinned(self, skin: np.ndarray) -> np.ndarray:
        """Displacement that draws the red of both lips towards the line where they meet.

        Corners stay, so the mouth keeps its width. A linear map of `skin`.
        """
        offset = skin[self.rings] - skin[self.rings[CONTACT_RING]]
        offset[CONTACT_RING + 1 :] = 0
        middle = 1 - np.abs(self.across) ** 4
        lower = np.zeros(COLUMN_COUNT, bool)
        lower[CORNERS[0] + 1 : CORNERS[1]] = True
        less = np.where(
            lower[:, None],
            [0, 1 - LOWER_HEIGHT, 1 - LOWER_DEPTH],
            [0, 1 - UPPER_HEIGHT, 1 - UPPER_DEPTH],
        )
        less *= middle[:, None]
        near_corner = np.clip((np.abs(self.across) - NEAR_CORNER) / (1 - NEAR_CORNER), 0, 1)
        less[:, 1] = np.maximum(less[:, 1], (1 - CORNER_HEIGHT) * near_corner)
        return self.field(-offset * less)

    def bowed(self) -> np.ndarray:
        """Displacement of any face that draws lips as people's are, `ACROSS` their width."""
        return self.field(self.bow())

    def bow(self) -> np.ndarray:
        """(ring, column, 3) m: the same of the lips themselves."""
        across = np.abs(self.across)
        lower = np.zeros(COLUMN_COUNT, bool)
        lower[CORNERS[0] + 1 : CORNERS[1]] = True
        border = np.where(
            lower,
            np.interp(across, ACROSS, LOWER_BORDER_MM),
            np.interp(across, ACROSS, UPPER_BORDER_MM),
        )
        # The rings next to the line go with it: they would else lie in the other lip.
        inwards = 1 - np.clip(1 - np.arange(RING_COUNT) / CONTACT_RING, 0, 1)[:, None] ** 2
        moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
        met = np.interp(across, ACROSS, MEETING_MM)
        moves[:, :, 1] = (1 - inwards) * border + inwards * met
        red = np.sin(np.pi * np.arange(CONTACT_RING + 1) / CONTACT_RING)
        for corner, out in zip(CORNERS, (1, -1), strict=True):
            for away, share in enumerate(V_COLUMNS, 1):
                apart = CORNER_V_MM * share * red
                moves[: CONTACT_RING + 1, corner - out * away, 1] += apart
                moves[: CONTACT_RING + 1, corner + out * away, 1] -= apart
        moves[CONTACT_RING + 1 :] *= BEHIND
        return moves / 1000

    def seal(
        self,
        skin: np.ndarray,
        overlap_m: float | np.ndarray = OVERLAP_M,
        upper_share: float = 0.5,
        follow: np.ndarray = FOLLOW,
    ) -> np.ndarray:
        """Displacement that brings the contact lines of both lips together.

        Afterwards each pair of columns differs by its overlap alone, straight up, and the
        upper columns between lie on the lower lip's edges: an affine map of `skin`, so any
        mixture of sealed faces is sealed.
        """
        contact = skin[self.rings[CONTACT_RING]]
        wanted = contact.copy()
        overlaps = np.broadcast_to(overlap_m, len(PAIRS))
        for (upper, lower), overlap in zip(PAIRS, overlaps, strict=True):
            sink = np.array([0, overlap / 2, 0])
            meeting = (1 - upper_share) * contact[upper] + upper_share * contact[lower]
            wanted[upper], wanted[lower] = meeting - sink, meeting + sink
        for column in BETWEEN:
            first, second = _beside(column)
            t = self.fractions[column]
            wanted[column] = (1 - t) * wanted[first] + t * wanted[second]
        return self.field(follow[:, None, None] * (wanted - contact))

    def gaps(self, skin: np.ndarray) -> np.ndarray:
        """(pair,) m: upper minus lower contact height, by increasing x; negative = overlap."""
        contact = skin[..., self.rings[CONTACT_RING], :]
        upper, lower = np.array(PAIRS).T
        return contact[..., upper, 1] - contact[..., lower, 1]

    def roll(self, upper_rings: float, lower_rings: float, beyond: float = 1.15) -> np.ndarray:
        """Slide each lip along its own profile into the mouth, by that many rings in its middle
        and none at a distance of `beyond` half widths of the mouth."""
        moves = np.zeros((RING_COUNT, COLUMN_COUNT, 3))
        half_width = np.abs(self.rest[self.rings[CONTACT_RING][list(CORNERS)], 0]).mean() * beyond
        for column in range(COLUMN_COUNT):
            amount = lower_rings if CORNERS[0] < column < CORNERS[1] else upper_rings
            profile = self.rest[self.rings[:, column]]
            reach = np.clip(1 - (profile[CONTACT_RING, 0] / half_width) ** 2, 0, 1) ** 0.7
            lengths = np.r_[0, np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))]
            ease = np.sin(np.pi / 2 * np.clip((np.arange(RING_COUNT) + 0.6) / 3, 0, 1))
            target = lengths + amount * ease * reach * lengths[8] / 9
            target[9] = lengths[9]
            slid = [np.interp(target, lengths, profile[:, k]) for k in range(3)]
            moves[:, column] = np.stack(slid, 1) - profile
        return self.field(_evened(moves))


def _evened(moves: np.ndarray) -> np.ndarray:
    """Moves (ring, column, 3) evened out along each lip; columns differ in their profiles."""
    sides = np.arange(COLUMN_COUNT)
    inner = np.setdiff1d(sides, CORNERS)
    evened = moves.copy()
    for _ in range(EVENINGS):
        beside = (np.roll(evened, 1, axis=1) + np.roll(evened, -1, axis=1)) / 2
        evened[:, inner] = ((evened + beside) / 2)[:, inner]
    return evened


def _beside(column: int) -> tuple[int, int]:
    return (column - 1) % COLUMN_COUNT, (column + 1) % COLUMN_COUNT


def _fraction(contact_x: np.ndarray, column: int, first: int, second: int) -> float:
    return float((contact_x[column] - contact_x[first]) / (contact_x[second] - contact_x[first]))
