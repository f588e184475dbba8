"""The speech encoder `phones` at run time: sound in, log-posteriors of forty phones out.

There is one way through it, the stream; a whole file is a stream fed once. The network sees the
same history whichever way the sound is cut, so both give the same numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio import front_end
from elocute.audio.features import Features
from elocute.audio.phones_and_visemes import PHONES
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.protocol import FEATURE_RATE, as_features, encoder_samples
from elocute.errors import InputError
from elocute.files.json_records import as_record, parse_json
from elocute.files.onnx_session import open_session

STRIDE = 2  # feature frames per output frame
SAMPLES_PER_OUTPUT = round(SPEECH_RATE / FEATURE_RATE)
BUILTIN_PATH = Path(__file__).parent / "assets" / "phones.onnx"
BLOCK_FRAMES = 3000  # feature frames in one run of the network: 30 s, so memory stays bounded
REST_FRAMES = 8  # outputs of silence put before and after: speech is never cut so hard in training
FILE_MAX_BYTES = 64_000_000
REACH_MAX = 1000


@dataclass(frozen=True)
class Reach:
    """Feature frames that an output sees before and after its own."""

    history: int
    lookahead: int


class PhoneEncoder:
    """An ONNX phone network and its front end.

    Raises InputError where the file is missing or not a phone encoder.
    """

    def __init__(self, path: str | Path = BUILTIN_PATH) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise InputError.about(self.path, found="missing", allowed="a phone encoder (.onnx)")
        if self.path.stat().st_size > FILE_MAX_BYTES:
            raise InputError.about(self.path, found="more than 64 MB", allowed="a phone encoder")

    @cached_property
    def _session(self) -> Any:
        return open_session(
            self.path, max_bytes=FILE_MAX_BYTES, allowed="a phone encoder", error=InputError
        )

    @cached_property
    def config(self) -> dict[str, Any]:
        """What training wrote into the file: phones, rates, reach, thresholds, version."""
        try:
            entry = self._session.get_modelmeta().custom_metadata_map.get("elocute", "{}")
        except UnicodeDecodeError:
            entry = "{}"
        config = as_record(
            parse_json(entry, self.path, allowed="a phone encoder"), self.path, "a phone encoder"
        )
        if config.get("phones") != list(PHONES):
            raise InputError.about(
                self.path, found="a network for other phones", allowed="the forty of Elocute"
            )
        for name in ("history_frames", "lookahead_frames"):
            if type(config.get(name)) is not int or not 0 <= config[name] <= REACH_MAX:
                raise InputError.about(
                    self.path, found=f"no {name}", allowed=f"0 to {REACH_MAX} feature frames"
                )
        return config

    @property
    def reach(self) -> Reach:
        return Reach(self.config["history_frames"], self.config["lookahead_frames"])

    @property
    def lookahead_s(self) -> float:
        """How much later than an output's own time the sound must be known."""
        return front_end.LOOKAHEAD_S + self.reach.lookahead / 100

    def encode(self, samples: Float32Array) -> Float32Array:
        """(sample,) at 16 kHz to (ceil(sample / 320), 40) log-posteriors at 50 Hz."""
        stream = self.stream()
        return np.concatenate([stream.push(samples), stream.flush()])

    def stream(self) -> PhoneStream:
        """The same in pieces."""
        return PhoneStream(self)

    def run(self, features: Float32Array) -> Float32Array:
        """(frame, 64) features to (ceil(frame / 2), 40) log-posteriors."""
        try:
            outputs = np.asarray(self._session.run(None, {"features": features[None]})[0])
        except Exception as error:  # onnxruntime has no common base of its own
            raise InputError.about(
                self.path, found="a network of another form", allowed="a phone encoder"
            ) from error
        if outputs.shape != (1, -(-len(features) // STRIDE), len(PHONES)):
            raise InputError.about(
                self.path, found=f"outputs of shape {outputs.shape}", allowed="a phone encoder"
            )
        return outputs[0]


@cache
def builtin_encoder() -> PhoneEncoder:
    """The shipped encoder, loaded once per process."""
    return PhoneEncoder()


@dataclass(frozen=True)
class PhonePosteriors:
    """Log-posteriors of forty phones, from the network that ships."""

    name: str = "phones"
    feature_count: int = len(PHONES)
    rate: float = FEATURE_RATE

    def __call__(self, waveform: Waveform) -> Features:
        return as_features(waveform, builtin_encoder().encode(encoder_samples(waveform)), self.name)


def _rest() -> Float32Array:
    return np.zeros(REST_FRAMES * SAMPLES_PER_OUTPUT, np.float32)


class PhoneStream:
    """Push sound, take log-posteriors as soon as their look-ahead is known; flush at the end."""

    def __init__(self, encoder: PhoneEncoder) -> None:
        self._encoder = encoder
        self._front_end = front_end.FrontEnd()
        self._reach = encoder.reach
        # Whole outputs of history: what is kept begins at an even feature frame.
        self._keep = -(-self._reach.history // STRIDE) * STRIDE
        self._features = np.zeros((0, front_end.BANDS), np.float32)
        self._origin = 0  # feature frame at which _features begins
        self._done = 0  # outputs made so far, those of the rest before included
        self._samples = 0
        self._extend(self._front_end.push(_rest()))

    def push(self, samples: Float32Array) -> Float32Array:
        """(sample,) at 16 kHz; returns the (frame, 40) that are now certain."""
        self._samples += len(samples)
        self._extend(self._front_end.push(samples))
        known = self._origin + len(self._features) - self._reach.lookahead
        return self._advance(max(0, -(-known // STRIDE)))

    def flush(self) -> Float32Array:
        """The remaining frames."""
        self._extend(self._front_end.push(_rest()))
        self._extend(self._front_end.flush())
        return self._advance(REST_FRAMES + -(-self._samples // SAMPLES_PER_OUTPUT))

    def _extend(self, features: Float32Array) -> None:
        self._features = np.concatenate([self._features, features])

    def _advance(self, until: int) -> Float32Array:
        pieces = [np.zeros((0, len(PHONES)), np.float32)]
        while self._done < until:
            stop = min(until, self._done + BLOCK_FRAMES // STRIDE)
            begin = max(self._origin, self._done * STRIDE - self._keep)
            end = min(stop * STRIDE + self._reach.lookahead, self._origin + len(self._features))
            window = self._features[begin - self._origin : end - self._origin]
            outputs = self._encoder.run(window)
            first = self._done - begin // STRIDE
            shown = max(first, REST_FRAMES - begin // STRIDE)
            pieces.append(outputs[shown : first + stop - self._done])
            self._done = stop
        cut = max(self._origin, self._done * STRIDE - self._keep)
        self._features = self._features[cut - self._origin :]
        self._origin = cut
        return np.concatenate(pieces)
