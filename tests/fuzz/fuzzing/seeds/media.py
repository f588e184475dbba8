"""Sound and video."""

from __future__ import annotations

import io
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.fuzzing.seeds.making import RATE, place, tone

SAME_BYTES = {"fflags": "+bitexact"}
"""No serial numbers drawn at random, no dates."""

OTHERS = {
    "avi": "pcm_s16le",
    "flv": "aac",
    "asf": "mp2",
    "ts": "aac",
    "mpg": "mp2",
    "aac": "aac",
    "ac3": "ac3",
    "eac3": "eac3",
    "caf": "pcm_s16le",
    "au": "pcm_s16be",
    "w64": "pcm_s16le",
    "wv": "wavpack",
    "tta": "tta",
    "mov": "alac",
}
"""Containers that FFmpeg may open besides the usual ones, and a codec for each."""


def write_wav(path: Path, seconds: float = 0.2, subtype: str = "PCM_16") -> None:
    import soundfile

    soundfile.write(path, tone(seconds), RATE, subtype=subtype)
    data = path.read_bytes()
    at = data.find(b"PEAK")
    if at > 0:  # libsndfile notes when it wrote the loudest sample; seeds are always the same
        path.write_bytes(data[: at + 12] + bytes(4) + data[at + 16 :])


def wavs(folder: Path) -> None:
    import soundfile

    samples = tone()
    for subtype in ("PCM_16", "PCM_U8", "PCM_24", "FLOAT", "ULAW", "IMA_ADPCM"):
        write_wav(place(folder, subtype) / "talk.wav", subtype=subtype)
    two = np.stack([samples, samples], axis=1)
    soundfile.write(place(folder, "extensible") / "talk.wav", two, RATE, format="WAVEX")
    soundfile.write(place(folder, "rf64") / "talk.wav", samples, RATE, format="RF64")


def flacs(folder: Path) -> None:
    import soundfile

    soundfile.write(place(folder, "flac") / "talk.flac", tone(), RATE)


def aiffs(folder: Path) -> None:
    import soundfile

    soundfile.write(place(folder, "aiff") / "talk.aiff", tone(), RATE)


def oggs(folder: Path) -> None:

    vorbis(place(folder, "vorbis") / "talk.ogg", 0.2)
    encoded(place(folder, "opus") / "talk.opus", "libopus", 0.3, 48000)


def encoded(path: Path, codec: str, seconds: float = 0.3, rate: int = RATE) -> None:
    """A sound in whatever container the suffix means."""
    import av

    with av.open(str(path), "w", options=SAME_BYTES) as file:
        stream: Any = file.add_stream(codec, rate=rate, layout="mono")
        frame = av.AudioFrame.from_ndarray(tone(seconds, rate)[None], format="fltp", layout="mono")
        frame.sample_rate, frame.time_base, frame.pts = rate, Fraction(1, rate), 0
        context = stream.codec_context
        packer = av.AudioResampler(
            context.format.name, "mono", rate, frame_size=context.frame_size or 1024
        )
        for piece in [*packer.resample(frame), *packer.resample(None)]:
            file.mux(stream.encode(piece))
        file.mux(stream.encode(None))


def vorbis(path: Path, seconds: float) -> None:
    """Encoded by libsndfile and packed again, as it draws serial numbers at random."""
    import av
    import soundfile

    packed = io.BytesIO()
    soundfile.write(packed, tone(seconds), RATE, format="OGG")
    packed.seek(0)
    given: Any = av.open(packed)
    with given, av.open(str(path), "w", options=SAME_BYTES) as file:
        stream = file.add_stream_from_template(given.streams.audio[0])
        for packet in given.demux():
            if packet.dts is not None:
                packet.stream = stream
                file.mux(packet)


def mp3s(folder: Path) -> None:
    encoded(place(folder, "mp3") / "talk.mp3", "mp3")


def mp4s(folder: Path) -> None:
    encoded(place(folder, "m4a") / "talk.m4a", "aac")
    encoded(place(folder, "mp4") / "talk.mp4", "aac")


def mkvs(folder: Path) -> None:
    encoded(place(folder, "mkv") / "talk.mkv", "aac")
    encoded(place(folder, "webm") / "talk.webm", "libopus", 0.3, 48000)


def videos(folder: Path) -> None:
    import av

    for name, codec in (("talk.mp4", "libx264"), ("talk.mkv", "mpeg4")):
        with av.open(str(place(folder, codec) / name), "w", options=SAME_BYTES) as file:
            film: Any = file.add_stream(codec, rate=25)
            film.width, film.height, film.pix_fmt = 48, 32, "yuv420p"
            for number in range(4):
                picture = np.full((32, 48, 3), 40 * number, np.uint8)
                frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
                frame.pts = number
                file.mux(film.encode(frame))
            file.mux(film.encode(None))


def others(folder: Path) -> None:
    """Sound in the rarer containers."""
    for suffix, codec in OTHERS.items():
        encoded(place(folder, suffix) / f"talk.{suffix}", codec, 0.2, 48000)
