"""Frames as JSON, one object a packet, for programs of one's own."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from elocute.live.live_frame import LiveFrame


class JsonLines:
    """Packets of ARKit's curves that are not zero, and the head's angles in degrees."""

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """One packet, which ends with a line feed."""
        return [
            json.dumps(frame_record(frame, frame.arkit), separators=(",", ":")).encode() + b"\n"
        ]


def frame_record(frame: LiveFrame, values: Mapping[str, float]) -> dict[str, Any]:
    """A frame as JSON holds it, with these values of its curves."""
    yaw, pitch, roll = (round(float(180 * turn), 2) for turn in frame.head_turns)
    return {
        "version": 1,
        "frame": frame.number,
        "time_s": round(frame.frame.time_s, 4),
        "head_deg": {"yaw": yaw, "pitch": pitch, "roll": roll},
        "curves": {name: round(value, 4) for name, value in values.items() if value > 0},
    }
