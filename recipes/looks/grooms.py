"""The styles that are grown: which way hair is combed, how long it is, how high it lies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from recipes.looks.draping import Drape
from recipes.looks.groom import LAYERS, SHORT_LAYERS, Groom, Layer, OfPlaces
from recipes.looks.scalp import Places, depth_mm, grows, ramp
from recipes.looks.strand_lanes import AIRY, DENSE, FULL, LOOSE

CROWN = np.array([9.0, 92.0, -158.0])
"""Where the whorl of the hair is."""
WHORL, WHORL_MM = 2.0, 26.0
"""How much more hair turns round it there, and how far from it."""
PART_SOFT_MM, PART_ALONG = 3.5, 0.5
"""Hair so near a parting runs partly along it, and covers it."""
PARTS_TO_MM = (-158.0, -125.0)
"""Between these distances behind the tip of the nose, before the crown, a parting ends."""
ROUND_MM = (90.0, 5.0)
"""Between these distances from its middle the top of falling hair comes to its height: level up to
its sides it has corners."""
PART_MM = 27.0
"""How far aside hair is parted that is not parted in the middle."""


def top(places: Places) -> np.ndarray:
    """(n,) 1 on top of the head, 0 at its sides and back."""
    return ramp(places[:, 1], 38, 74) * ramp(places[:, 2], -190, -150)


def front(places: Places) -> np.ndarray:
    """(n,) 1 at the hairline of the forehead, 0 from the middle of the head on."""
    return ramp(places[:, 2], -85, -42) * ramp(places[:, 1], 40, 58)


def forehead(places: Places) -> np.ndarray:
    """(n, 1) 1 at the hairline over the brows, down to its corners, 0 at the temples."""
    return (ramp(places[:, 2], -88, -60) * ramp(places[:, 1], 24, 42))[:, None]


def from_the_crown(places: Places, turn: float | np.ndarray) -> np.ndarray:
    """Directions away from the whorl, turned about the head's own axis."""
    away = places - CROWN
    far = np.linalg.norm(away, axis=1, keepdims=True)
    away = away / np.maximum(far, 1e-6)
    turn = turn + WHORL * np.exp(-((far / WHORL_MM) ** 2))
    return away + turn * np.cross(np.array([0, 1.0, 0]), away)


def crop() -> Groom:
    """Short sides, a longer top brushed forward and aside."""

    def comb(places: Places) -> np.ndarray:
        out = from_the_crown(places, 0.3) + front(places)[:, None] * np.array([0.9, 0.25, 0.0])
        return out + np.array([0, -0.5, 0.15]) * (1 - top(places))[:, None]

    def length(places: Places) -> np.ndarray:
        return 0.017 + 0.026 * top(places)

    def volume(places: Places) -> np.ndarray:
        return 0.0050 + (0.010 + 0.006 * front(places)) * top(places)

    return Groom(
        comb, length, volume,
        rise_m=0.010, upright=0.4, weight=0.45, steps=5, near=1.25, edge=1.7, layers=SHORT_LAYERS,
    )  # fmt: skip


def swept() -> Groom:
    """Parted at one side, the front brushed up and over."""

    def comb(places: Places) -> np.ndarray:
        over = np.tanh((places[:, 0] + PART_MM) / 8)[:, None] * np.array([1.0, 0.0, 0.0])
        up = over + np.array([0, 0.15, -0.85]) + front(places)[:, None] * np.array([0, 0.9, 0.35])
        side = from_the_crown(places, 0.0) + np.array([0, -0.9, -0.5])
        side = side + forehead(places) * (np.array([0, 0.6, -0.9]) - side)
        share = top(places)[:, None]
        lifted = front(places)[:, None] * np.array([0, 0.8, -0.9])
        return up * share + side * (1 - share) + lifted

    def length(places: Places) -> np.ndarray:
        return 0.018 + 0.050 * top(places)

    def volume(places: Places) -> np.ndarray:
        return 0.0045 + (0.008 + 0.010 * front(places)) * top(places)

    return Groom(
        comb, length, volume,
        rise_m=0.012, upright=0.6, weight=0.15, stiff=0.55, steps=6, near=1.2, layers=SHORT_LAYERS,
    )  # fmt: skip


def slick() -> Groom:
    """Combed back."""

    def comb(places: Places) -> np.ndarray:
        down = (1 - top(places))[:, None] * (1 - forehead(places))
        lifted = forehead(places) * (1 - top(places))[:, None]
        back = np.array([0, 0.1, -1.0]) + np.array([0, 0.6, 0.0]) * lifted
        return back + np.array([0, -0.9, -0.1]) * down

    def length(places: Places) -> np.ndarray:
        return 0.020 + 0.060 * top(places)

    def volume(places: Places) -> np.ndarray:
        return 0.0038 + 0.0065 * top(places)

    return Groom(
        comb, length, volume, rise_m=0.010, weight=0.1, stiff=0.5, steps=6, layers=SHORT_LAYERS
    )


def _parted(places: Places, part_mm: float, tuck: float, swept: float) -> np.ndarray:
    """Directions away from a parting, which ends at the crown, then down, off the face, and tips
    towards the neck by `tuck`; `swept` is how far hair goes aside over the forehead rather than
    back."""
    parted = ramp(places[:, 2], -175, -120) * ramp(places[:, 1], 25, 56)
    beside = places[:, 0] - part_mm * parted
    aside = np.tanh(beside / PART_SOFT_MM) * parted
    along = PART_ALONG * np.exp(-((beside / PART_SOFT_MM) ** 2)) * parted
    temple = ramp(places[:, 2], -95, -55) * ramp(places[:, 1], 8, 36)
    # What grows at the forehead stands back from it before it falls aside.
    lifted = LIFTED * front(places) * (1 - grows(places, LIFTED_MM))
    back = 0.15 + (0.5 * front(places) + lifted) * (1 - swept) + along
    back = back * ramp(places[:, 1], 5, 50) + 0.45 * temple * (1 - swept)
    inward = -0.12 * np.tanh(places[:, 0] / 40) * ramp(places[:, 1], 10, -40)
    # On the back it hangs straight.
    on_back = ramp(places[:, 2], -SHOULDER_MM, -SHOULDER_MM - 30) * ramp(places[:, 1], -70, -120)
    inward = inward * (1 - on_back)
    # Most of it hangs behind the shoulders, not on them.
    hangs = ramp(np.abs(places[:, 0]), *BESIDE_MM) * ramp(places[:, 1], *BEHIND_MM)
    around = -BACKSTEP * hangs * ramp(places[:, 2], *GOES_BACK_MM) * ramp(places[:, 2], *BACK_MM)
    across = (aside + inward)[:, None] * np.array([1.0, 0.0, 0.0])
    down = (1 - 0.6 * parted)[:, None] * np.array([0, -1.0, 0])
    tips = (NECK_MM - places) * np.array([1.0, 0, 1.0])
    tips = tuck * ramp(places[:, 1], *TUCKED_MM)[:, None] * tips / 60
    return across + (around - back)[:, None] * np.array([0, 0, 1.0]) + down + tips


NECK_MM, TUCKED_MM = np.array([0.0, 0.0, -120.0]), (-25.0, -70.0)
"""The middle of the neck, and the heights over the eyes between which tips turn towards it."""


SPARED_M = 0.18
"""So long it comes to the shoulders."""
LIFTED, LIFTED_MM = 1.5, 13.0
"""How much hair at the forehead is combed back, and how deep behind the hairline that ends."""
SHOULDER_MM, BACKSTEP = 116.0, 0.22
"""How far behind the tip of the nose the shoulders begin, and how fast hair beside the neck goes
back as it falls towards them."""
BESIDE_MM, BEHIND_MM = (35.0, 65.0), (-40.0, -130.0)
"""Distances from the middle and heights over the eyes between which that begins."""
GOES_BACK_MM = (-85.0, -150.0)
"""Distances behind the tip of the nose between which it does: hair before them hangs in front."""
NAPE_MM = (10.0, -25.0)
"""The heights between which hair leaves the back of the head and hangs."""
BACK_MM = (-200.0, -165.0)
"""Between these hair goes no further back: it hangs on the back, it does not stand off it."""
FACE_MM = ((-200, -66), (-60, -60), (0, -56), (25, -48), (48, -24), (60, 10))
"""Heights over the eyes, and how far behind the tip of the nose hair begins that frames a face."""
FRAME_MM = (-22.0, 30.0)
"""Hair that would hang between these distances behind and before that line is pushed together
behind it: a curtain thins out, a wall does not."""
EDGE_MM, EDGE_MOST = 7.0, (-2.5, 0.8)
"""How far the line differs from ribbon to ribbon: one line for all would be a curtain's edge; and
how often as far at most: what stands alone before the others is a wire."""
FRAMING = Layer(0.0048, 0.0085, DENSE[1:] + FULL, 1.1, (0.2, 0.9), 0.20, 0.97, where="temples")
FRAMING_AHEAD_MM, FRAMING_FORWARD = 5.0, 0.20
"""Fine ribbons of all lengths that fall beside the face, this far before the others."""
FRAMING_BLUNT = (0.75, 0.95)
"""Their lengths where the others end on one line."""
FRAMING_EDGE = 0.25
"""How deep the hairline is where these are open, by that of others: they would be a net."""
BARE_TEMPLE_MM = 30.0
"""Below which height over the eyes they grow where no fringe lies over their roots."""
FRAMING_WAVE_M, FRAMING_PAIRS = 0.003, 19
"""They wave at least so far: straight ones are wires. One sees each alone, and every bend of it."""
LONG_PAIRS, BOB_PAIRS, WAVED_PAIRS = 16, 16, 20
"""Fewer, and the outline of a head has corners; a wave is five of them long."""
AROUND = 0.30
"""Hair at the sides of the back is longer by this share of what hangs below the shoulders: its way
is longer, and all would end in a point."""
STIFF, SWEPT_STIFF = 0.6, 0.15
"""Of hair that falls, and how much stiffer it is where it is swept aside: it bends from there down
the temple in an arc, not at a corner."""
WAVE_M = 0.100
FALLING_WIDTH, FALLING_APART, FALLING_EDGE = 1.3, 1.06, 0.78
"""Long hair needs fewer and wider ribbons, and fewer at its edge and parting."""
FALLING_OPEN = 0.65
"""How deep its hairline is where locks are open, by that of short hair: single long hairs on a
forehead are wires."""


def off_the_face(places: Places, ahead_mm: float = 0.0) -> Places:
    """Rows are ribbons, in their order from step to step: each keeps a line of its own."""
    y = places[:, 1]
    own = EDGE_MM * np.clip(np.random.default_rng(29).normal(size=len(places)), *EDGE_MOST)
    limit = np.interp(y, *np.array(FACE_MM).T) + ahead_mm + own
    limit = limit + 5 * np.sin(y / 28 + own)
    behind, before = FRAME_MM
    over = np.clip((places[:, 2] - limit - behind) / (before - behind), 0, 1)
    pushed = limit + behind - behind * np.sqrt(over)
    kept = np.where(over > 0, np.minimum(places[:, 2], pushed), places[:, 2])
    return np.column_stack([places[:, :2], kept])


def falling(
    length_m: float,
    part_mm: float,
    wave_m: float,
    free: OfPlaces,
    drape: Drape,
    steps: int = 10,
    near: float = 1.6,
    cut: float = 1.0,
    tuck: float = 0.0,
    even: float = 0.0,
    swept: float = 0.0,
) -> Groom:
    """Hair that falls from a parting; `even` is how far its tips end on one line, 0 to 1, `tuck`
    and `swept` as for `_parted`."""

    def length(places: Places) -> np.ndarray:
        """Ends lie about equally low: what grows higher is longer."""
        whole = length_m + places[:, 1] / 1000 * 0.9 - 0.02 * front(places)
        aside = ramp(np.abs(places[:, 0]), 10, 65) * ramp(places[:, 2], -SHOULDER_MM, -150)
        past = max(length_m - SPARED_M, 0)
        return whole + past * AROUND * aside

    def volume(places: Places) -> np.ndarray:
        # It is flat along the parting, not where that ends: the crown has no furrow.
        flat = ramp(np.abs(places[:, 0] - part_mm), 45, 0) * ramp(places[:, 2], *PARTS_TO_MM)
        return (
            0.0045
            + 0.0085 * top(places) * (1 - flat) * ramp(np.abs(places[:, 0]), *ROUND_MM)
            + 0.004 * ramp(places[:, 2], -120, -180)
        )

    def parting(places: Places) -> np.ndarray:
        on_top = ramp(places[:, 1], 46, 58) * ramp(places[:, 2], *PARTS_TO_MM)
        return ramp(np.abs(places[:, 0] - part_mm), 11, 1) * on_top

    layers = tuple(
        replace(
            layer,
            stray=0.3 * layer.stray,
            length=(_towards_one(layer.length[0], even), _towards_one(layer.length[1], even)),
            width_m=FALLING_WIDTH * layer.width_m,
            apart_m=layer.apart_m * (FALLING_APART if layer.where == "all" else FALLING_EDGE),
        )
        for layer in LAYERS
        if layer.lanes != AIRY  # its single hairs would be wires before the face
    )
    return Groom(
        lambda places: _parted(places, part_mm, tuck, swept), length, volume,
        rise_m=0.026, upright=0.2, weight=1.6, stiff=STIFF + SWEPT_STIFF * swept,
        wave_m=wave_m, wave_length_m=WAVE_M, steps=steps, near=near, cut=cut, edge=FALLING_OPEN,
        falls=True, parting=parting, hangs=_hangs, free=free, drape=drape, layers=layers,
    )  # fmt: skip


def _hangs(places: Places) -> np.ndarray:
    return ramp(places[:, 1], *NAPE_MM) * ramp(places[:, 2], -140, -170)


def _towards_one(share: float, even: float) -> float:
    return share + even * (1 - share)


def ahead_of_the_face(ahead_mm: float) -> OfPlaces:
    return lambda places: off_the_face(places, ahead_mm)


def framing(whole: Groom, fringed: bool) -> Groom:
    """What falls beside the face before the rest of a style: without it, hair ends in an edge; one
    sees where it begins, but under a fringe."""

    def comb(places: Places) -> np.ndarray:
        temple = ramp(places[:, 2], -115, -75) * ramp(places[:, 1], -10, 20)
        return whole.comb(places) + FRAMING_FORWARD * temple[:, None] * np.array([0, -0.3, 1.0])

    free = ahead_of_the_face(FRAMING_AHEAD_MM)
    wave_m = max(whole.wave_m, FRAMING_WAVE_M)
    layer = FRAMING if whole.cut == 1 else replace(FRAMING, length=FRAMING_BLUNT)
    return replace(
        whole, comb=comb, free=free, layers=(layer,),
        steps=11, pairs=FRAMING_PAIRS, near=1.2, wave_m=wave_m, edge=FRAMING_EDGE,
        temple_mm=whole.temple_mm if fringed else BARE_TEMPLE_MM,
    )  # fmt: skip


def fringe() -> Groom:
    """What falls over the forehead, and thins out above the brows."""

    def comb(places: Places) -> np.ndarray:
        aside = FRINGE_ASIDE * places[:, :1] / 40
        ahead = ramp(places[:, 1:2], 46, 62)
        return aside * np.array([1.0, 0, 0]) + [0, -0.7, -0.12] + ahead * np.array([0, 0.3, 0.9])

    def length(places: Places) -> np.ndarray:
        """The further aside, the longer: a curtain's middle is short."""
        aside = np.abs(places[:, 0]) / 40
        return (FRINGE_MM + FRINGE_LONGER_MM * aside**2 + depth_mm(places)) / 1000

    return Groom(
        comb, length, lambda places: np.full(len(places), 0.009),
        rise_m=0.010, weight=1.2, stiff=0.5, steps=6, near=1.15, layers=FRINGE,
    )  # fmt: skip


FRINGE = (
    Layer(0.0056, 0.0090, FULL, 0.80, (0.58, 0.94), 0.20, 0.90, where="forehead"),
    Layer(0.0042, 0.0074, LOOSE, 0.95, (0.66, 1.04), 0.26, 0.96, where="forehead"),
    Layer(0.0050, 0.0074, AIRY, 1.02, (0.70, 1.08), 0.30, 0.96, where="forehead"),
)
FRINGE_MM, FRINGE_LONGER_MM, FRINGE_ASIDE = 29.0, 2.5, 0.28
"""How far it falls before the hairline, how much further at its sides, how far it goes aside."""


def long(drape: Drape) -> Groom:
    """Down to the chest, from a parting in the middle."""
    straight = falling(0.31, 0.0, 0.0012, ahead_of_the_face(5.0), drape, 16, swept=0.7)
    return replace(straight, pairs=LONG_PAIRS)


def waves(drape: Drape) -> Groom:
    """Down to the chest, from a parting at one side; its waves come after it is combed."""
    straight = falling(
        0.32, PART_MM, 0.0012, ahead_of_the_face(5.0), drape, 16, near=1.4, swept=0.7
    )
    return replace(straight, pairs=WAVED_PAIRS)


def bob(drape: Drape) -> Groom:
    """Down to the chin, from a parting at one side."""
    straight = falling(
        0.125, -PART_MM, 0.0010, ahead_of_the_face(8.0), drape, 9, tuck=2.4, even=0.5,
        swept=0.8,
    )  # fmt: skip
    return replace(straight, pairs=BOB_PAIRS)


TIE_MM = np.array([0.0, 48.0, -210.0])
"""Where hair is tied."""
SKULL_MM = 210.0
"""Its width, for ways round it."""


def tied() -> Groom:
    """Combed to the tie."""

    def comb(places: Places) -> np.ndarray:
        return TIE_MM - places

    def length(places: Places) -> np.ndarray:
        straight = np.linalg.norm(TIE_MM - places, axis=1)
        return SKULL_MM * np.arcsin(np.minimum(straight / SKULL_MM, 0.99)) / 1000 - 0.004

    def volume(places: Places) -> np.ndarray:
        return 0.0032 + 0.004 * top(places)

    layers = tuple(
        replace(
            layer,
            stray=0.15 * layer.stray,
            length=(0.97, 1.03),
            width_m=1.3 * layer.width_m,
            apart_m=layer.apart_m,
        )
        for layer in LAYERS
        if layer.lanes != AIRY
    )
    return Groom(
        comb,
        length,
        volume,
        rise_m=0.010,
        weight=0,
        stiff=0.3,
        steps=8,
        inset_mm=15.0,
        layers=layers,
    )


def stubble() -> Groom:
    """What ends a shell of stubs: single hairs at its edge, each as long as the stubs."""

    def comb(places: Places) -> np.ndarray:
        return from_the_crown(places, 0.2)

    fine = Layer(0.0023, 0.0032, LOOSE, 1.0, (0.6, 1.1), 0.3, 0.80, where="hairline")
    return Groom(
        comb, lambda p: np.full(len(p), 0.0065), lambda p: np.full(len(p), 0.0022), layers=(fine,)
    )


GROOMS = {"crop": crop, "swept": swept, "slick": slick}
FALLING = {"long": long, "waves": waves, "bob": bob}
FRINGED, WAVED, HANGING = ("long",), ("waves",), ("long", "waves")
