"""How shirts go round the neck: their bands and collars in section."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Cut:
    """How a shirt goes round the neck.

    Parameters
    ----------
    edge_m : (3,) tuple of float
        Height of the band's upper edge over the plane of the head's cut: front, side, back.
    band : tuple of (float, float)
        Section of the band: how far down it lies, and how far off the skin, m.
    lip : (2,) tuple of int
        First and last ring of the section, counted from 0, that hang unevenly.
    starts_m : float
        Where the cloth of the body begins, down from the upper edge.
    band_share : float
        Of the picture's height; the body's cloth lies below it.
    knitted : bool
        Ribs on the band; otherwise woven, with a collar folded over the band.
    """

    edge_m: tuple[float, float, float]
    band: tuple[tuple[float, float], ...]
    lip: tuple[int, int] = (0, 0)
    starts_m: float = 0.020
    band_share: float = 0.16
    knitted: bool = True


CUTS = {
    "crew": Cut(
        (0.001, 0.013, 0.010),
        (
            (0.0000, -0.0015),
            (0.0000, 0.0016),
            (0.0006, 0.0027),
            (0.0020, 0.0033),
            (0.0050, 0.0038),
            (0.0090, 0.0040),
            (0.0130, 0.0039),
            (0.0150, 0.0034),
            (0.0158, 0.0028),
            (0.0166, 0.0033),
        ),
    ),
    "roll": Cut(
        (0.034, 0.046, 0.046),
        (
            (0.0000, -0.0015),
            (0.0000, 0.0018),
            (0.0002, 0.0042),
            (0.0014, 0.0060),
            (0.0040, 0.0072),
            (0.0110, 0.0084),
            (0.0190, 0.0094),
            (0.0265, 0.0104),
            (0.0305, 0.0103),
            (0.0326, 0.0093),
            (0.0333, 0.0076),
            (0.0326, 0.0056),
            (0.0290, 0.0038),
            (0.0360, 0.0034),
            (0.0440, 0.0034),
            (0.0490, 0.0036),
        ),
        lip=(6, 13),
        starts_m=0.054,
        band_share=0.32,
    ),
    "collar": Cut(
        (0.018, 0.034, 0.038),
        (
            (0.0020, -0.0015),
            (0.0004, 0.0014),
            (0.0000, 0.0030),
            (0.0004, 0.0044),
            (0.0110, 0.0044),
            (0.0200, 0.0038),
            (0.0320, 0.0038),
            (0.0420, 0.0038),
        ),
        starts_m=0.046,
        band_share=0.34,
        knitted=False,
    ),
}
"""The shirts by their names. A collar lies between the fourth and the fifth ring of its band."""
