"""Frames as the iFacialMocap app sends them (text over UDP, port 49983)."""

from __future__ import annotations

from elocute.live.live_frame import LiveFrame

SIDES = {"Left": "_L", "Right": "_R"}


class IFacialMocap:
    """Packets of curves from 0 to 100 and angles in degrees."""

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """One packet. Eyes turn by curves alone."""
        curves = [f"{_name(name)}-{round(100 * value)}" for name, value in frame.arkit.items()]
        yaw, pitch, roll = 180 * frame.head_turns
        head = f"=head#{pitch:.3f},{yaw:.3f},{roll:.3f},0,0,0"
        parts = [*curves, head, "rightEye#0,0,0", "leftEye#0,0,0", ""]
        return ["|".join(parts).encode()]


def _name(curve: str) -> str:
    """eyeBlinkLeft as eyeBlink_L."""
    for side, short in SIDES.items():
        if curve.endswith(side) and curve not in ("jawLeft", "jawRight", "mouthLeft", "mouthRight"):
            return curve.removesuffix(side) + short
    return curve
