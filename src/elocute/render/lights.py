"""Presets of light: a studio, a window, a sky.

Every light stands still in the head's own space (+Y up, +Z out of the face), so turning the camera
walks round a lit face. The first lamp is the key: it alone casts shadows.
"""

from __future__ import annotations

from dataclasses import dataclass

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Lamp:
    """A soft light far away."""

    towards: Triple  # direction to it; of any length
    color: Triple  # linear; what white paper that faces it sends back
    size: float  # how much it widens a highlight: 0 is a point, 0.3 a large soft box
    wrap: float  # how far it reaches round an edge, 0 to 1
    # share of its highlight: less for lamps behind the head, which nothing casts shadows for
    shine: float = 1.0


@dataclass(frozen=True)
class Rig:
    """Lamps, what surrounds them, and the ground behind the head."""

    lamps: tuple[Lamp, ...]  # the key first
    sky: Triple  # linear light from above and from below
    ground: Triple
    exposure: float  # factor of all light before the tone curve
    middle: Triple  # sRGB colours of what lies behind the head, in its middle and far from it
    margin: Triple
    shadow: float  # how dark the key's shadow is, 0 to 1


RIGS: dict[str, Rig] = {
    "studio": Rig(
        lamps=(
            Lamp((-0.50, 0.62, 0.95), (1.10, 1.02, 0.935), 0.22, 0.10),
            Lamp((0.90, 0.12, 0.70), (0.20, 0.22, 0.255), 0.40, 0.45),
            Lamp((0.55, 0.55, -0.75), (0.42, 0.43, 0.47), 0.25, 0.02, 0.0),
            Lamp((-0.85, 0.25, -0.60), (0.20, 0.21, 0.25), 0.30, 0.02, 0.0),
        ),
        sky=(0.33, 0.345, 0.375),
        ground=(0.140, 0.120, 0.110),
        exposure=1.0,
        middle=(0.50, 0.53, 0.56),
        margin=(0.22, 0.24, 0.26),
        shadow=0.92,
    ),
    # A large window and white walls: even skin, hardly a shadow.
    "soft": Rig(
        lamps=(
            Lamp((-0.25, 0.45, 1.0), (0.78, 0.76, 0.735), 0.45, 0.45, 0.7),
            Lamp((0.80, 0.20, 0.80), (0.34, 0.345, 0.36), 0.50, 0.50, 0.6),
            Lamp((0.0, 0.75, -0.70), (0.30, 0.30, 0.31), 0.40, 0.05, 0.0),
        ),
        sky=(0.46, 0.465, 0.475),
        ground=(0.27, 0.255, 0.245),
        exposure=1.0,
        middle=(0.86, 0.86, 0.85),
        margin=(0.70, 0.71, 0.72),
        shadow=0.55,
    ),
    # One lamp from the side in a dark room, and a cold edge from behind.
    "dramatic": Rig(
        lamps=(
            Lamp((-0.95, 0.50, 0.50), (1.55, 1.36, 1.14), 0.14, 0.04),
            Lamp((0.85, 0.30, -0.60), (0.50, 0.62, 0.82), 0.22, 0.05, 0.0),
            Lamp((0.80, 0.05, 0.75), (0.045, 0.055, 0.075), 0.40, 0.45),
        ),
        sky=(0.085, 0.095, 0.120),
        ground=(0.045, 0.040, 0.040),
        exposure=1.0,
        middle=(0.13, 0.14, 0.165),
        margin=(0.035, 0.04, 0.05),
        shadow=1.0,
    ),
    # Sun above one shoulder, a blue sky, and grass.
    "day": Rig(
        lamps=(
            Lamp((0.55, 0.95, 0.75), (1.30, 1.19, 1.00), 0.08, 0.05),
            Lamp((-0.75, 0.25, 0.75), (0.20, 0.235, 0.29), 0.55, 0.50),
            Lamp((-0.45, 0.65, -0.75), (0.34, 0.38, 0.44), 0.30, 0.02, 0.0),
        ),
        sky=(0.36, 0.42, 0.52),
        ground=(0.165, 0.175, 0.115),
        exposure=1.0,
        middle=(0.74, 0.84, 0.93),
        margin=(0.44, 0.62, 0.82),
        shadow=0.85,
    ),
    # For colours that hold the light already, such as a scan's: enough from ahead to show a shape.
    "even": Rig(
        lamps=(Lamp((0.0, 0.1, 1.0), (0.45, 0.45, 0.45), 0.4, 0.5, 0.0),),
        sky=(0.55, 0.55, 0.55),
        ground=(0.55, 0.55, 0.55),
        exposure=0.6,
        middle=(0.45, 0.45, 0.45),
        margin=(0.45, 0.45, 0.45),
        shadow=0.0,
    ),
}
"""The lights by their name."""
