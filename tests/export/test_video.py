"""Video and contact sheets, looked at with other tools."""

import av
import numpy as np
import pytest
from av.audio.stream import AudioStream
from av.video.stream import VideoStream
from PIL import Image

from elocute.audio.read import read_audio
from elocute.motion.motion import Motion

SMALL = {"size": (128, 128), "backend": "embreex"}


@pytest.fixture(scope="module")
def video(take, tmp_path_factory):
    path = tmp_path_factory.mktemp("video") / "talk.mp4"
    take.write(path, **SMALL)
    return path


def length_s(stream: VideoStream | AudioStream) -> float:
    assert stream.duration is not None and stream.time_base is not None
    return float(stream.duration * stream.time_base)


def test_it_is_h264_and_aac_of_the_right_length(video, take):
    with av.open(str(video)) as file:
        picture, sound = file.streams.video[0], file.streams.audio[0]
        assert (picture.codec_context.name, sound.codec_context.name) == ("h264", "aac")
        assert picture.codec_context.pix_fmt == "yuv420p"
        assert picture.frames == take.motion.frame_count
        assert picture.average_rate == take.motion.fps
        seconds, heard = length_s(picture), length_s(sound)
        assert abs(seconds - heard) < 1 / take.motion.fps + 0.03


def test_the_sound_is_in_step_to_ten_milliseconds(video, speech_wav):
    source = read_audio(speech_wav, sample_rate=16000).samples
    decoded = read_audio(video, sample_rate=16000).samples
    count = min(len(source), len(decoded))
    spectrum = np.fft.rfft(source[:count], 2 * count) * np.conj(
        np.fft.rfft(decoded[:count], 2 * count)
    )
    lag = int(np.argmax(np.fft.irfft(spectrum)))
    lag = lag - 2 * count if lag > count else lag
    assert abs(lag) / 16000 < 0.010


def test_the_picture_moves_when_the_mouth_does(video, take):
    with av.open(str(video)) as file:
        frames = [f.to_ndarray(format="rgb24").astype(int) for f in file.decode(video=0)]
    jaw = take.curves["jawOpen"]
    rest, wide = frames[0], frames[int(jaw.argmax())]
    assert np.abs(wide - rest)[64:100, 40:90].mean() > 2


def test_odd_sizes_are_made_even_and_no_sound_is_fine(motion, tmp_path):
    from elocute.export.mp4 import write_mp4
    from elocute.export.options import PictureOptions

    short = Motion(motion.head, motion.weights[:5], motion.fps)
    write_mp4(short, tmp_path / "a.mp4", options=PictureOptions(size=(131, 97), backend="embreex"))
    with av.open(str(tmp_path / "a.mp4")) as file:
        context = file.streams.video[0].codec_context
        assert (context.width, context.height) == (130, 96)
        assert not file.streams.audio


def test_an_interrupted_video_leaves_nothing(take, tmp_path):
    def stop(share):
        if share > 0.02:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        take.write(tmp_path / "talk.mp4", progress=stop, **SMALL)
    assert list(tmp_path.iterdir()) == []


def test_a_contact_sheet_shows_twenty_moments(take, tmp_path):
    take.write(tmp_path / "talk.png", size=(200, 200), backend="embreex")
    with Image.open(tmp_path / "talk.png") as sheet:
        assert sheet.size == (400, 320)
        assert np.asarray(sheet).std() > 20
