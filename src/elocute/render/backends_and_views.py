"""Names of the renderers and of the views."""

from __future__ import annotations

BACKENDS = ("auto", "moderngl", "embreex")
FRAMINGS = ("head", "face")
QUALITIES = ("auto", "draft", "fast", "high")
# name: (yaw, pitch in degrees, share of the portrait's height that is shown)
VIEWS: dict[str, tuple[float, float, float]] = {
    "front": (0.0, 2.0, 1.0),
    "three-quarter": (32.0, 2.0, 1.0),
    "side": (85.0, 0.0, 1.0),
    "mouth": (0.0, 0.0, 0.34),
}
