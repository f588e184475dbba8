"""Frames as VMC 3.1 (Virtual Motion Capture protocol over OSC, UDP, port 39539)."""

from __future__ import annotations

from collections.abc import Callable

from elocute.live.live_frame import LiveFrame
from elocute.live.osc import bundles, message

BONES = {"Neck": "neck", "Head": "head"}
VRM0 = {
    "aa": "A",
    "ih": "I",
    "ou": "U",
    "ee": "E",
    "oh": "O",
    "blink": "Blink",
    "blinkLeft": "Blink_L",
    "blinkRight": "Blink_R",
    "lookUp": "LookUp",
    "lookDown": "LookDown",
    "lookLeft": "LookLeft",
    "lookRight": "LookRight",
    "happy": "Joy",
    "angry": "Angry",
    "sad": "Sorrow",
    "relaxed": "Fun",
    "surprised": "Surprised",
}
"""What VRM 0 calls the expressions of VRM 1."""


class Vmc:
    """Bundles of expressions, and of neck and head as bones in Unity's axes.

    `values` gives the names and weights of a frame.
    """

    def __init__(self, values: Callable[[LiveFrame], dict[str, float]]) -> None:
        self._values = values

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """Bundles of at most 1500 bytes; the last applies the frame."""
        messages = [
            message("/VMC/Ext/OK", 1),
            message("/VMC/Ext/T", float(frame.frame.time_s)),
            *(message("/VMC/Ext/Bone/Pos", bone, *_pose(frame, of)) for bone, of in BONES.items()),
            *(message("/VMC/Ext/Blend/Val", *pair) for pair in self._values(frame).items()),
            message("/VMC/Ext/Blend/Apply"),
        ]
        return list(bundles(messages))


def vrm0() -> Vmc:
    """With the names of VRM 0."""
    return Vmc(lambda frame: {VRM0[name]: value for name, value in frame.vrm.items()})


def vrm1() -> Vmc:
    """With the names of VRM 1."""
    return Vmc(lambda frame: frame.vrm)


def arkit() -> Vmc:
    """With ARKit's curves, as avatars with "perfect sync" name them."""
    return Vmc(lambda frame: {name[0].upper() + name[1:]: v for name, v in frame.arkit.items()})


def _pose(frame: LiveFrame, joint: str) -> tuple[float, ...]:
    """A place, which stays the avatar's own, and a quaternion xyzw with Unity's x to the right."""
    w, x, y, z = frame.joint(joint).tolist()
    return 0.0, 0.0, 0.0, x, -y, -z, w
