"""A trained network of Karras et al. 2017 at run time: half a second of sound to a face.

All but the network is as for VOCA: styles and their mixes, shapes, contacts and rests after the
network. A style is an emotion vector: the mean of those learned for a speaker's clips, or the
mined `neutral`. The paper blends vectors, which is a mix of styles at the input (`mix="input"`);
by default outputs are mixed, as for VOCA.
"""

from __future__ import annotations

import math

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.articulation.driver import LOOKAHEAD_S
from elocute.audio.autocorrelation import (
    COEFFICIENTS,
    HOP,
    ROW_RATE,
    STRETCH,
    WINDOW_ROWS,
    autocorrelation,
    rows_in,
)
from elocute.audio.features import Features
from elocute.audio.resampling_stream import RESAMPLING_S, ResamplingStream
from elocute.audio.sound_level import sound_level
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.trunk import trunk_lookahead_s
from elocute.errors import ModelError
from elocute.models.feature_extraction import (
    PhonePosteriorStream,
)
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
from elocute.models.style_mixes import MixedStyle
from elocute.models.voca import VocaModel
from elocute.numerics.resampling import frame_places, read_rows

KIND = "karras"
ENCODER = "autocorrelation"
LEAST_PEAK = 1e-3  # of a live sound of unknown level: no silence is taken for speech
BLOCK_OUTPUTS = 15_000  # two minutes in one run of the network: memory stays bounded
BEFORE = WINDOW_ROWS // 2 - 1  # rows of a window before the one before its middle
BETWEEN = 0.5  # a window's middle lies between two rows


class KarrasModel(VocaModel):
    """A trained network of Karras et al. 2017 from an .onnx, as a SpeechModel.

    The network gives a face every 8 ms, and frames are read between them. A session may be given
    where the file was opened before.

    Raises
    ------
    ModelError
        For a file that is missing or too large; when the network is first used, for one that is
        not such a network of Elocute.
    """

    kind = KIND
    least_rows = WINDOW_ROWS
    needs_sound_level = True

    @property
    def decoder_lookahead_s(self) -> float:
        window_s = (WINDOW_ROWS / 2 + 1) / ROW_RATE
        return max(window_s, LOOKAHEAD_S) if self.makes_contacts else window_s

    @property
    def lookahead_s(self) -> float:
        row_s = (STRETCH / 2 + HOP) / SPEECH_RATE
        if self.makes_contacts:
            row_s = max(row_s, trunk_lookahead_s())
        return RESAMPLING_S + row_s + self.decoder_lookahead_s

    def feature_streams(
        self,
        sample_rate: int,
        *,
        contacts: bool = True,
        level: SoundLevel | None = None,
        within_s: float | None = None,
    ) -> FeatureStreams:
        return FeatureStreams(
            AutocorrelationStream(sample_rate, level),
            PhonePosteriorStream(sample_rate) if contacts and self.makes_contacts else None,
        )

    def sound_level(self, sound: Waveform) -> SoundLevel:
        """Mean and peak of the sound at 16 kHz."""
        return sound_level(sound, SPEECH_RATE)

    def _weights_of_each(
        self, speech: SpeechFeatures, style: MixedStyle, span: FrameSpan
    ) -> Float32Array:
        """(input, frame, component)"""
        features = speech.features
        if features.values.shape[1] != COEFFICIENTS or features.rate != ROW_RATE:
            raise ModelError.about(
                self.path,
                found=f"{features.values.shape[1]} features from {features.encoder}",
                allowed=f"{COEFFICIENTS} ({ENCODER})",
            )
        places = frame_places(span.first, span.count, ROW_RATE, span.fps) - BETWEEN
        first = max(0, math.floor(places[0]))
        last = math.floor(places[-1]) + 2
        blocks = []
        for at in range(first, last, BLOCK_OUTPUTS):
            window = _rows_of_windows(features, at, min(last, at + BLOCK_OUTPUTS))
            blocks.append(np.stack([self._answer(window, each) for each in style.inputs]))
        outputs = np.concatenate(blocks, axis=1)
        return np.stack([read_rows(rows, places - first) for rows in outputs])

    def _frames_of(self, rows: int) -> int:
        return rows - WINDOW_ROWS + 1


def _rows_of_windows(features: Features, first: int, last: int) -> Float32Array:
    """(row, 32) that the windows of outputs `first` … `last` - 1 reach into.

    Rows that are not there are silence: those before the sound and after it.
    """
    begin = first - BEFORE - features.first
    end = last + WINDOW_ROWS - 1 - BEFORE - features.first
    known = features.values[max(begin, 0) : max(end, 0)]
    before = min(max(-begin, 0), end - begin)
    return np.pad(known, ((before, end - begin - before - len(known)), (0, 0)))


class AutocorrelationStream:
    """Rows (row, 32) of autocorrelation, each as soon as its sound is there.

    Sound is divided by the peak of the whole where that is known, else by the loudest sample so
    far; either way, how it is cut into blocks makes no difference.
    """

    name, rate = ENCODER, ROW_RATE

    def __init__(self, sample_rate: int, level: SoundLevel | None = None) -> None:
        self._resampled = ResamplingStream(sample_rate, SPEECH_RATE)
        self._level = level
        self._loudest = LEAST_PEAK
        self._samples = np.zeros(0, np.float32)
        self._offset = 0  # of the first sample kept
        self._rows = 0  # given so far

    def push(self, samples: Float32Array) -> Float32Array:
        self._samples = np.concatenate([self._samples, self._resampled.push(samples)])
        heard = self._offset + len(self._samples)
        return self._until((heard - STRETCH // 2) // HOP + 1)

    def flush(self) -> Float32Array:
        rest = self._resampled.push(np.zeros(0, np.float32), last=True)
        self._samples = np.concatenate([self._samples, rest])
        return self._until(rows_in(self._offset + len(self._samples)))

    def _until(self, end: int) -> Float32Array:
        """The rows up to `end` that were not given yet."""
        first, count = self._rows, max(0, end - self._rows)
        peaks = self._peaks(first, count)
        # Sound before what is kept was heard by earlier rows only; so the offset is whole rows.
        values = autocorrelation(self._samples, first - self._offset // HOP, count)
        self._rows += count
        drop = min(max(0, self._rows * HOP - HOP - self._offset), len(self._samples))
        drop -= drop % HOP
        self._samples, self._offset = self._samples[drop:], self._offset + drop
        return (values / np.square(peaks)[:, None]).astype(np.float32)

    def _peaks(self, first: int, count: int) -> Float64Array:
        """(row,) what the sound of each row is divided by."""
        if self._level is not None:
            return np.full(count, self._level[1], np.float64)
        ends = (first + np.arange(count)) * HOP + STRETCH // 2 - self._offset
        loud = np.maximum.accumulate(np.abs(self._samples, dtype=np.float64))
        known = np.concatenate([[self._loudest], np.maximum(loud, self._loudest)])
        peaks = known[np.clip(ends, 0, len(self._samples))]
        self._loudest = float(peaks[-1]) if count else self._loudest
        return peaks
