"""Names of the shapes: Apple's, then what speech needs beyond."""

from elocute.motion.curves import ARKIT_NAMES

SPEECH_NAMES = ("mouthLabiodental", "tongueTipUp", "tongueDental")
NAMES = (*ARKIT_NAMES, *SPEECH_NAMES)
