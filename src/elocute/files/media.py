"""The one way to open a container of sound and pictures: FFmpeg's libraries through PyAV."""

from __future__ import annotations

from pathlib import Path
from typing import Any

# Only sound and video: FFmpeg would also follow playlists, which name other files.
DEMUXERS = (
    "mov,mp4,m4a,3gp,3g2,mj2,matroska,webm,ogg,mp3,aac,ac3,eac3,amr,wav,w64,aiff,flac,avi,flv,asf,"
    "mpegts,mpeg,caf,au,wv,ape,tta,mxf,gsm,mpegvideo"
)

SOUND_SUFFIXES = (
    ".wav",
    ".flac",
    ".mp3",
    ".ogg",
    ".oga",
    ".opus",
    ".m4a",
    ".aac",
    ".mp4",
    ".mov",
    ".mkv",
    ".webm",
    ".aif",
    ".aiff",
)
"""What files of sound and video are called, where a folder is looked through."""


def open_media(path: str | Path, *, pixels_max: int | None = None) -> Any:
    """Open a local file of sound or video: an av.container.InputContainer, for the caller to close.

    Playlists and addresses are never followed. Titles and other text that is not UTF-8 do no harm.
    Pictures of more than `pixels_max` pixels are not decoded, not even to find out what they are.
    Raises av.error.FFmpegError where it is none of `DEMUXERS`; also OSError or ValueError, as PyAV
    raises them.
    """
    import av

    options = {"format_whitelist": DEMUXERS, "protocol_whitelist": "file"}
    if pixels_max is not None:
        options["max_pixels"] = str(pixels_max)
    if int(av.__version__.split(".")[0]) >= 19:  # text is decoded without errors there
        return av.open(f"file:{path}", options=options)
    return av.open(f"file:{path}", options=options, metadata_errors="ignore")
