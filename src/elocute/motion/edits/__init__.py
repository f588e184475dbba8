"""Edits: pure functions from Motion to Motion, in any order and number.

VOCA's animation control (2019, section 4 and Figure 7): pose, identity and expression are
changed after the speech, since the motion is a linear face in zero pose.
"""

from elocute.motion.edits.amplitude import with_amplitude
from elocute.motion.edits.applying import with_edits
from elocute.motion.edits.blinks import with_blinks, without_blinks
from elocute.motion.edits.closures import sealed_frames, with_lips_closed
from elocute.motion.edits.edit_list import EditList, read_edits
from elocute.motion.edits.gaze import with_gaze
from elocute.motion.edits.identity import with_identity, with_identity_over_time
from elocute.motion.edits.pose import with_pose, without_pose
from elocute.motion.edits.shape import with_shape
from elocute.motion.edits.timing import cut, looped, retimed, with_mouth_offset

__all__ = [
    "EditList",
    "cut",
    "looped",
    "read_edits",
    "retimed",
    "sealed_frames",
    "with_amplitude",
    "with_blinks",
    "with_edits",
    "with_gaze",
    "with_identity",
    "with_identity_over_time",
    "with_lips_closed",
    "with_mouth_offset",
    "with_pose",
    "with_shape",
    "without_blinks",
    "without_pose",
]
