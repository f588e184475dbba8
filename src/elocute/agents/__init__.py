"""Faces for voice agents: their speech goes through, and curves come out beside it.

pipecat     a processor for Pipecat's pipelines
livekit     a generator for LiveKit's avatar runner
talkinghead parts of speech for TalkingHead's avatars
paced_face  a face at the pace of a clock, and the speech that is held back for it
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.agents.livekit import FaceGenerator as FaceGenerator
    from elocute.agents.pipecat import FaceProcessor as FaceProcessor
    from elocute.agents.talkinghead import talkinghead_parts as talkinghead_parts

__getattr__, __dir__ = lazy(__name__, __file__)
