"""What one clip of a study is made from: which files move it, what is heard, and when."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.study.design.design import MISMATCHED, Design
from elocute.study.design.trials import Clip, other_stimulus
from elocute.study.stimuli.sources import own_sound, sound_file
from elocute.study.stimuli.stimulus_pictures import PictureSource
from elocute.study.stimuli.stimulus_sound import read_part


def pad_s(design: Design) -> float:
    """Rest before and after every clip, s, so that a sound that is moved stays whole."""
    return max(abs(each.offset_ms) for each in design.conditions) / 1000


class ClipMaking:
    """What one clip is made from."""

    def __init__(self, design: Design, data: Path, clip: Clip) -> None:
        name, self.face, self.view = clip.stimulus.split(".")
        self.design, self.data, self.clip = design, data, clip
        named = design.obvious if clip.condition == MISMATCHED else clip.condition
        self.condition = design.condition(named)
        sounds = {each.name: each for each in design.stimuli.sounds}
        self.sound = sounds[name]
        self.mismatched = clip.condition == MISMATCHED or self.condition.mismatched
        other = other_stimulus(design, clip.stimulus).partition(".")[0]
        self.moving = sounds[other] if self.mismatched else self.sound
        own = own_sound(data, self.condition, self.sound)
        self.own = own is not None
        self.heard_file = own or sound_file(data, self.sound.file)
        if self.mismatched:
            self.seen_file = sound_file(data, self.moving.seen or self.moving.file)
        elif self.sound.seen:
            self.seen_file = sound_file(data, self.sound.seen)
        else:
            self.seen_file = self.heard_file

    @property
    def source(self) -> PictureSource:
        """What its pictures are made from, its voice not read yet."""
        moving = self.moving
        if moving.seen and not self.mismatched:
            moving = replace(moving, file=moving.seen, name=self.sound.name)
        none = Waveform(np.zeros(2, np.float32), 16_000)
        return PictureSource(
            self.condition, self.design.stimuli, moving, none, self.face, self.view, self.data
        )

    def voice(self) -> Waveform:
        """What is heard."""
        sound = self.sound
        part = (0.0, 0.0) if self.own else (sound.start_s, sound.end_s)
        return read_part(self.heard_file, *part)

    def moving_voice(self, voice: Waveform) -> Waveform:
        """What the face moves to."""
        if self.seen_file == self.heard_file and self.moving is self.sound:
            return voice
        whole = bool(self.moving.seen)
        part = (0.0, 0.0) if whole else (self.moving.start_s, self.moving.end_s)
        return read_part(self.seen_file, *part)

    def times(self, seconds: float) -> Float64Array:
        """The moment of the motion in each frame, s."""
        fps = self.design.stimuli.fps
        # To the nearest frame: coders lengthen a sound by some milliseconds of silence.
        frames = np.arange(max(1, round(seconds * fps))) / fps
        # A sound that is later than its picture is a picture that is ahead of its sound.
        moments = frames - pad_s(self.design) + self.condition.offset_ms / 1000
        return np.asarray(moments, np.float64)
