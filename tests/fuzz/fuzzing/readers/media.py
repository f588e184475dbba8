"""Sound and video."""

from __future__ import annotations

from pathlib import Path

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.readers.one_file import only


def _sound(path: Path) -> None:
    from elocute.audio.read import probe_audio, read_audio

    read_audio(path, sample_rate=16000)
    probe_audio(path)


def _video(path: Path) -> None:
    from elocute.capture.video.video_frames import Video

    with Video(path) as video:
        for _ in video.pictures():
            pass


AUDIO = ("elocute.audio.read", "elocute.audio.decoders")

READERS: tuple[Reader, ...] = (
    Reader("wav", seeds.wavs, only(_sound), {"*": "riff"}, AUDIO),
    Reader("aiff", seeds.aiffs, only(_sound), {"*": "riff"}, AUDIO),
    Reader("flac", seeds.flacs, only(_sound), {"*": "bytes"}, AUDIO),
    Reader("ogg", seeds.oggs, only(_sound), {"*": "bytes"}, AUDIO),
    Reader("mp3", seeds.mp3s, only(_sound), {"*": "bytes"}, AUDIO, short=150),
    Reader("mp4", seeds.mp4s, only(_sound), {"*": "bytes"}, AUDIO, short=150),
    Reader("mkv", seeds.mkvs, only(_sound), {"*": "bytes"}, AUDIO, short=150),
    Reader(
        "video",
        seeds.videos,
        only(_video),
        {"*": "bytes"},
        ("elocute.capture.video.video_frames", "av"),
        short=150,
    ),
    Reader("other sound", seeds.others, only(_sound), {"*": "bytes"}, AUDIO, short=150),
)
