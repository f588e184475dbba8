"""How much real talkers differ from one another, fitted by `python -m recipes.talker_spread`."""

from __future__ import annotations

# Typical value, and standard deviation between talkers of its logarithm. Deviations over time and
# means, in distances of the outer eye corners: 31 news talkers and one of GRID, tracked in video.
REAL_TALKERS: dict[str, tuple[float, float]] = {
    "opening": (0.0407, 0.279),
    "width": (0.0285, 0.243),
    "jaw": (0.0253, 0.175),
    "tilt": (0.0074, 0.141),
    "sideways": (0.0058, 0.093),
    "opening_mean": (0.0589, 0.329),
    "opening_least": (0.0138, 0.373),
    "width_mean": (0.5511, 0.057),
    "openings_per_s": (3.295, 0.125),
}
JAW, LIPS = REAL_TALKERS["jaw"][1], REAL_TALKERS["opening"][1]
WIDTH = REAL_TALKERS["width"][1]
