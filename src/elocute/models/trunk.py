"""A mouth straight from the sound: the model of many talkers that a trunk drives.

The trunk hears what people's mouths do (`encoders.trunk`), and which phones are said. From there on
it is as with `talkers`: the rules of articulation say which shapes the phones want, the mouth that
was heard says how far they open, spread and lower the jaw, contacts are decoded over a phrase.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.articulation.coarticulation import DIPHTHONG_S, REACH_S
from elocute.articulation.driver import FRAME_S, LOOKAHEAD_S
from elocute.articulation.phone_targets import curve_names
from elocute.audio.phones_and_visemes import PHONES, SILENCE
from elocute.audio.resampling_stream import RESAMPLING_S, ResamplingStream
from elocute.audio.waveform import SPEECH_RATE
from elocute.audio.whisper_mel import QUIET
from elocute.encoders.protocol import FEATURE_RATE
from elocute.encoders.trunk import (
    KIND,
    MOUTH_FIELDS,
    TrunkNetwork,
    TrunkRows,
    TrunkStream,
    trunk_lookahead_s,
)
from elocute.errors import ModelError
from elocute.models.protocol import FeatureStreams, SoundLevel, SpeechFeatures
from elocute.models.talkers import MARGIN, TalkerRecord, TalkersModel
from elocute.motion.mouth_measures import MEASURES
from elocute.motion.mouth_response import builtin_response

SILENT_DECADES = 4.5
"""45 dB below the loudest so far nobody speaks: what is heard there is the room, or the street."""
UNHEARD = (0.5, 0.9)  # of silence in the sound, beside which known phones move as the rules say


class TrunkModel(TalkersModel):
    """A trunk from a file, as a SpeechModel.

    Parameters
    ----------
    path : str or Path
        An .onnx that `recipes.train_trunk` wrote.
    session : onnxruntime.InferenceSession, optional
        Of the same file, where it was opened before.

    Raises
    ------
    ModelError
        For a file that is missing or too large; when the network is first used, for one that is no
        trunk.
    """

    kind = KIND
    decoder_lookahead_s = max(LOOKAHEAD_S, FRAME_S + REACH_S + DIPHTHONG_S + MARGIN / FEATURE_RATE)

    @cached_property
    def network(self) -> TrunkNetwork:
        """Of the file."""
        return TrunkNetwork(self.path, self._opened)

    @cached_property
    def record(self) -> TalkerRecord:
        return self._read_record(self.network.record)

    @property
    def lookahead_s(self) -> float:
        return RESAMPLING_S + trunk_lookahead_s(self.network) + self.decoder_lookahead_s

    def feature_streams(
        self, sample_rate: int, *, contacts: bool = True, level: SoundLevel | None = None
    ) -> FeatureStreams:
        hearing = Hearing(self.network, sample_rate)
        return FeatureStreams(HeardMouth(hearing), hearing.phones)

    def _voice(self, speech: SpeechFeatures, posteriors: Float32Array) -> Float64Array:
        """What is no voice is silence in the trunk's phones."""
        return np.ones(len(posteriors))

    def _told(self, speech: SpeechFeatures, rules: Float32Array, begin: int) -> Float32Array:
        """(row, measure) deviations from a person's mean, for rows from `begin` on.

        Where phones are known and the sound has none, those of the rules.
        """
        phones, sound = speech.phones, speech.features
        if phones is None or sound.encoder != HeardMouth.name:
            raise ModelError.about(
                self.path,
                found=f"features of {sound.encoder} alone",
                allowed="the mouth and phones, as its feature streams give them",
            )
        rows = np.minimum(np.arange(begin, begin + len(rules)) - sound.first, len(sound.values) - 1)
        heard = sound.values[rows]
        told = heard[:, : len(MEASURES)]
        if not speech.known:
            return told
        low, high = UNHEARD
        unheard = np.clip((heard[:, len(MOUTH_FIELDS)] - low) / (high - low), 0, 1)[:, None]
        measured = builtin_response(curve_names()).measures(rules)
        ruled = (measured - self.record.middle_mm) / self.record.spread_mm
        return (told + unheard * (ruled - told)).astype(np.float32)


class Hearing:
    """One pass of a trunk over a sound, and its phones as a stream.

    What is far below the loudest so far is silence.
    """

    def __init__(self, network: TrunkNetwork, sample_rate: int) -> None:
        self._resampled = ResamplingStream(sample_rate, SPEECH_RATE)
        self._trunk = TrunkStream(network)
        self._loudest = np.float32(QUIET)
        self.phones = HeardPhones()

    def push(self, samples: Float32Array) -> Float32Array:
        """Take a block of sound; the (row, 8) of `HeardMouth` that are certain now."""
        return self._answered(self._trunk.push(self._resampled.push(samples)))

    def flush(self) -> Float32Array:
        """End the sound: the rows that were waiting for more of it."""
        rest = self._resampled.push(np.zeros(0, np.float32), last=True)
        before = self._answered(self._trunk.push(rest))
        return np.concatenate([before, self._answered(self._trunk.flush())])

    def _answered(self, rows: TrunkRows) -> Float32Array:
        loudest = np.maximum.accumulate(np.append(self._loudest, rows.peaks))
        self._loudest = loudest[-1]
        quiet = rows.peaks < loudest[1:] - SILENT_DECADES
        phones = np.where(quiet[:, None], _SILENCE, rows.phones)
        self.phones.take(phones)
        return np.concatenate([rows.mouth, np.exp(phones[:, SILENCE, None])], axis=1)


_SILENCE = np.log(np.where(np.arange(len(PHONES)) == SILENCE, 1.0, 1e-6)).astype(np.float32)


class HeardPhones:
    """Log-posteriors (row, 40) that a `Hearing` heard in the blocks it was pushed before."""

    name, rate = "phones", FEATURE_RATE

    def __init__(self) -> None:
        self._rows: list[Float32Array] = []

    def take(self, rows: Float32Array) -> None:
        """Keep rows until they are asked for."""
        self._rows.append(rows)

    def push(self, samples: Float32Array) -> Float32Array:
        """What was heard since the last call; the samples themselves are not heard again."""
        return self.flush()

    def flush(self) -> Float32Array:
        rows = np.concatenate([np.zeros((0, len(PHONES)), np.float32), *self._rows])
        self._rows.clear()
        return rows


class HeardMouth:
    """(row, 8): the mouth's fields as a `Hearing` tells them, and how surely nobody speaks."""

    name, rate = "mouth", FEATURE_RATE

    def __init__(self, hearing: Hearing) -> None:
        self._hearing = hearing

    def push(self, samples: Float32Array) -> Float32Array:
        return self._hearing.push(samples)

    def flush(self) -> Float32Array:
        return self._hearing.flush()
