"""Speech for TalkingHead's avatars: pieces of sound, each with the curves that belong to it."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator
from typing import Any, Unpack

from elocute.export.arkit_csv import COLUMNS
from elocute.live.live_frame import LiveFrame
from elocute.live.sound_of_frames import SoundOfFrames
from elocute.models.streaming import Frame, stream
from elocute.models.take_settings import StreamOptions

ITS_OWN = ("eyeLook", "eyeBlink")
"""Curves that are left out, since such an avatar looks and blinks by itself."""


def talkinghead_parts(
    chunks: Iterable[bytes],
    rate: int = 24000,
    *,
    fps: float = 30.0,
    lookahead: float = 0.25,
    **settings: Unpack[StreamOptions],
) -> Iterator[dict[str, Any]]:
    """What a page gives to TalkingHead's `streamAudio` while one thing is said.

    Parameters
    ----------
    chunks : iterable of bytes
        Mono samples of 16 bits, little-endian, as a voice gives them, of any length.
    rate : int
        Their sample rate, Hz.
    fps : float
        Frames per second.
    lookahead : float
        How much sound a piece waits for, s, as `elocute.stream` takes it.
    **settings
        Style, strength, life, mood, identity and seed, as `elocute.stream` takes them.

    Yields
    ------
    dict
        `{"audio": sound in base64, "anims": [{"name", "delay", "dt", "vs"}]}`: curves by ARKit's
        names, without those of eyes and lids, which such an avatar moves by itself. Times are ms
        from the beginning of the speech.

    Raises
    ------
    InputError
        For settings out of range; AudioError for the rate.
    """
    live = stream(rate, fps=fps, lookahead=lookahead, **settings)
    sound = SoundOfFrames(rate, live.fps)
    for chunk in chunks:
        sound.add(chunk)
        if frames := list(live.push(chunk)):
            yield _part(frames, live.fps, b"".join(sound.next_frame()[1] for _ in frames))
    if frames := list(live.flush()):
        pieces = [sound.next_frame(is_last=frame is frames[-1])[1] for frame in frames]
        yield _part(frames, live.fps, b"".join(pieces))


def _part(frames: list[Frame], fps: float, pcm: bytes) -> dict[str, Any]:
    shown = [LiveFrame(0, fps, frame).arkit for frame in frames]
    names = [name for name in COLUMNS if not name.startswith(ITS_OWN)]
    step_ms = 1000 / fps
    anim = {
        "name": "elocute",
        # A value is reached at the end of its step.
        "delay": round(1000 * frames[0].time_s - step_ms, 2),
        "dt": [round(step_ms, 3)] * len(frames),
        "vs": {name: [round(values[name], 3) for values in shown] for name in names},
    }
    return {"audio": base64.b64encode(pcm).decode(), "anims": [anim]}
