"""Frames as JSON, one object a packet, for programs of one's own."""

from __future__ import annotations

import json

from elocute.live.live_frame import LiveFrame


class JsonLines:
    """Packets of ARKit's curves that are not zero, and the head's angles in degrees."""

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """One packet, which ends with a line feed."""
        yaw, pitch, roll = (round(float(180 * turn), 2) for turn in frame.head_turns)
        record = {
            "version": 1,
            "frame": frame.number,
            "time_s": round(frame.frame.time_s, 4),
            "head_deg": {"yaw": yaw, "pitch": pitch, "roll": roll},
            "curves": {name: round(value, 4) for name, value in frame.arkit.items() if value > 0},
        }
        return [json.dumps(record, separators=(",", ":")).encode() + b"\n"]
