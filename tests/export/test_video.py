"""Video and contact sheets, looked at with other tools."""

import av
import numpy as np
import pytest
import soundfile
from av.audio.stream import AudioStream
from av.video.stream import VideoStream
from PIL import Image

from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.errors import OutputError
from elocute.export.registry import write
from elocute.motion.motion import Motion

SMALL = {"size": (128, 128), "backend": "embreex"}


@pytest.fixture(scope="module")
def sentence(speech_wav, tmp_path_factory):
    """Three seconds of the example."""
    path = tmp_path_factory.mktemp("speech") / "three_seconds.wav"
    speech = read_audio(speech_wav)
    samples = speech.samples[: 3 * speech.sample_rate]
    soundfile.write(path, samples, speech.sample_rate, "PCM_16")
    return path


@pytest.fixture(scope="module")
def film(sentence):
    """At 12 fps: a picture takes a tenth of a second here."""
    return animate(sentence, fps=12, life=0, look="none")


@pytest.fixture(scope="module")
def video(film, tmp_path_factory):
    path = tmp_path_factory.mktemp("video") / "talk.mp4"
    film.write(path, **SMALL)
    return path


def length_s(stream: VideoStream | AudioStream) -> float:
    assert stream.duration is not None and stream.time_base is not None
    return float(stream.duration * stream.time_base)


def test_it_is_h264_and_aac_of_the_right_length(video, film):
    with av.open(str(video)) as file:
        picture, sound = file.streams.video[0], file.streams.audio[0]
        assert (picture.codec_context.name, sound.codec_context.name) == ("h264", "aac")
        assert picture.codec_context.pix_fmt == "yuv420p"
        assert picture.frames == film.motion.frame_count
        assert picture.average_rate == film.motion.fps
        seconds, heard = length_s(picture), length_s(sound)
        assert abs(seconds - heard) < 1 / film.motion.fps + 0.03


def test_the_sound_is_in_step_to_ten_milliseconds(video, sentence):
    source = read_audio(sentence, sample_rate=16000).samples
    decoded = read_audio(video, sample_rate=16000).samples
    count = min(len(source), len(decoded))
    spectrum = np.fft.rfft(source[:count], 2 * count) * np.conj(
        np.fft.rfft(decoded[:count], 2 * count)
    )
    lag = int(np.argmax(np.fft.irfft(spectrum)))
    lag = lag - 2 * count if lag > count else lag
    assert abs(lag) / 16000 < 0.010


def test_the_picture_moves_when_the_mouth_does(video, film):
    with av.open(str(video)) as file:
        frames = [f.to_ndarray(format="rgb24").astype(int) for f in file.decode(video=0)]
    jaw = film.curves["jawOpen"]
    rest, wide = frames[0], frames[int(jaw.argmax())]
    assert np.abs(wide - rest)[64:100, 40:90].mean() > 2


def test_odd_sizes_are_made_even_and_no_sound_is_fine(motion, tmp_path):
    from elocute.export.options import PictureOptions
    from elocute.export.video import write_video

    short = Motion(motion.head, motion.weights[:5], motion.fps)
    write_video(
        short, tmp_path / "a.mp4", options=PictureOptions(size=(131, 97), backend="embreex")
    )
    with av.open(str(tmp_path / "a.mp4")) as file:
        context = file.streams.video[0].codec_context
        assert (context.width, context.height) == (130, 96)
        assert not file.streams.audio


@pytest.fixture(scope="module")
def short(film):
    """Eight pictures from the middle."""
    motion = film.motion
    return Motion(motion.head, motion.weights[16:24], motion.fps)


def decoded(path, codec):
    """The pictures of a video, by a decoder that is named: FFmpeg's own of VP9 drops alpha."""
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        context = av.CodecContext.create(codec, "r")
        context.extradata = stream.codec_context.extradata
        context.codec_tag = stream.codec_context.codec_tag
        assert isinstance(context, av.VideoCodecContext)
        context.width, context.height = stream.width, stream.height
        frames = [frame for packet in file.demux(stream) for frame in context.decode(packet)]
    return [frame.reformat(format="rgba").to_ndarray() for frame in frames]


VIDEOS = [(".webm", "libvpx-vp9", "vp9", "opus"), (".mov", "prores", "prores", "pcm_s16le")]


@pytest.mark.parametrize(("suffix", "decoder", "picture", "sound"), VIDEOS)
def test_a_transparent_video_is_laid_over_anything(
    short, speech_wav, tmp_path, suffix, decoder, picture, sound
):
    path = tmp_path / f"talk{suffix}"
    write(short, path, sound=speech_wav, background="transparent", **SMALL)
    with av.open(str(path)) as file:
        assert file.streams.video[0].codec_context.name.endswith(picture)
        assert file.streams.audio[0].codec_context.name == sound
    frames = decoded(path, decoder)
    assert len(frames) == 8
    alpha = frames[4][..., 3]
    assert alpha[:20, :20].max() < 3 and alpha[50:70, 50:70].min() > 252
    assert 0.2 < (alpha > 128).mean() < 0.7
    # The edge has the colours of the head: no dark seam where it is laid over something light.
    edge, inside = (alpha > 100) & (alpha < 220), alpha == 255
    brightness = frames[4][..., :3].mean(axis=2)
    assert brightness[edge].min() > np.percentile(brightness[inside], 1) - 12


@pytest.mark.parametrize(("suffix", "decoder"), [v[:2] for v in VIDEOS])
def test_other_videos_show_what_the_mp4_shows(video, short, tmp_path, suffix, decoder):
    write(short, tmp_path / f"talk{suffix}", **SMALL)
    ours, theirs = decoded(tmp_path / f"talk{suffix}", decoder), decoded(video, "h264")[16:24]
    assert len(ours) == len(theirs) == 8
    assert np.abs(ours[4].astype(int) - theirs[4])[..., :3].mean() < 3


def test_mp4_has_no_alpha(film, tmp_path):
    with pytest.raises(OutputError, match=r"transparent background in .mp4; allowed: one in .webm"):
        film.write(tmp_path / "talk.mp4", background="transparent")


def test_an_interrupted_video_leaves_nothing(film, tmp_path):
    def stop(share):
        if share > 0.02:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        film.write(tmp_path / "talk.mp4", progress=stop, **SMALL)
    assert list(tmp_path.iterdir()) == []


def test_a_contact_sheet_shows_twenty_moments(film, tmp_path):
    film.write(tmp_path / "talk.png", size=(200, 200), backend="embreex")
    with Image.open(tmp_path / "talk.png") as sheet:
        assert sheet.size == (400, 320)
        assert np.asarray(sheet).std() > 20


def test_a_transparent_contact_sheet(film, tmp_path):
    film.write(tmp_path / "talk.png", size=(200, 200), backend="embreex", background="transparent")
    with Image.open(tmp_path / "talk.png") as sheet:
        alpha = np.asarray(sheet)[..., 3]
    assert sheet.mode == "RGBA" and alpha[40, 40] == 255 and alpha[20, 75] == 0
