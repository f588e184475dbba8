"""Containers open with every PyAV that is allowed, and lead nowhere else."""

from __future__ import annotations

import av.error
import numpy as np
import pytest
import soundfile

from elocute.audio.read import read_audio
from elocute.files.media import open_media


@pytest.fixture
def tone(tmp_path):
    path = tmp_path / "tone.mp3"
    samples = 0.1 * np.sin(2 * np.pi * 220 * np.arange(16000) / 16000)
    soundfile.write(path, samples, 16000, format="MP3")
    return path


def test_a_title_in_no_known_alphabet_does_no_harm(tone):
    text = b"\0" + b"title \xff\xfe\x80"
    title = b"TPE1" + len(text).to_bytes(4, "big") + b"\0\0" + text
    size = bytes([0, 0, len(title) >> 7, len(title) & 127])
    tone.write_bytes(b"ID3\3\0\0" + size + title + tone.read_bytes())
    with open_media(tone) as file:
        assert len(file.streams.audio) == 1
    assert read_audio(tone).duration_s == pytest.approx(1.0, abs=0.05)


def test_a_playlist_leads_nowhere(tone, tmp_path):
    ways = {
        "list.m3u8": f"#EXTM3U\n#EXTINF:1,\n{tone}\n#EXT-X-ENDLIST\n",
        "list.ffconcat": f"ffconcat version 1.0\nfile {tone}\n",
        "list.mp3": f"#EXTM3U\n#EXTINF:1,\nfile://{tone}\n",
    }
    for name, text in ways.items():
        (tmp_path / name).write_text(text)
        with pytest.raises((av.error.FFmpegError, OSError, ValueError)):
            open_media(tmp_path / name)


def test_an_address_is_the_name_of_a_file():
    with pytest.raises(FileNotFoundError):
        open_media("http://127.0.0.1:9/a.mp3")
