"""The trunk's front end in torch, for whole batches, with microphones and gaps in between."""

from __future__ import annotations

import random

import torch
from torch import Tensor

from elocute.audio import whisper_mel
from elocute.audio.waveform import SPEECH_RATE

EQUAL_DB, TILT_DB = 7.0, 5.0
TELEPHONE, LOW_PASS = 0.12, 0.27  # shares of sounds; the second counts from the first
MASKED_BANDS, MASKED_ROWS = 10, 12


class BatchLogMel:
    """(batch, sample) waveforms to (batch, frame, 80) bands, `CONTEXT` frames more at both ends."""

    def __init__(self, seed: int) -> None:
        self.draw = random.Random(seed)
        self.window = torch.hann_window(whisper_mel.WINDOW)
        self.mel = torch.from_numpy(whisper_mel.mel_weights())
        self.hz = torch.linspace(0, SPEECH_RATE / 2, whisper_mel.WINDOW // 2 + 1)

    def __call__(self, waves: Tensor, context: int, augment: bool = False) -> Tensor:
        half, hop = whisper_mel.WINDOW // 2, whisper_mel.HOP
        frames = waves.shape[1] // hop + 2 * context - 1
        padded = torch.nn.functional.pad(waves, (half + context * hop, half + context * hop))
        views = padded.unfold(-1, whisper_mel.WINDOW, hop)[:, :frames]
        power = torch.view_as_real(torch.fft.rfft(views * self.window)).square().sum(-1)
        if augment:
            power = torch.stack([one * self._microphone() for one in power])
        decades = torch.log10((power @ self.mel).clamp(min=whisper_mel.FLOOR))
        peaks = decades.amax(-1, keepdim=True).cummax(1).values.clamp(min=whisper_mel.QUIET)
        bands = (torch.maximum(decades, peaks - whisper_mel.RANGE) + 4) / 4
        if augment:
            for one in bands:
                self._mask(one)
        return bands

    def _microphone(self) -> Tensor:
        """(bin,) a smooth equalisation, and sometimes a narrow band."""
        gain_db = self.draw.uniform(-TILT_DB, TILT_DB) * (self.hz / 8000)
        for _ in range(3):
            middle, width = self.draw.uniform(0, 8000), self.draw.uniform(300, 2500)
            bump = torch.exp(-(((self.hz - middle) / width) ** 2))
            gain_db = gain_db + self.draw.uniform(-EQUAL_DB, EQUAL_DB) * bump
        gain, kind = 10 ** (gain_db / 10), self.draw.random()
        if kind < TELEPHONE:
            return gain * ((self.hz > 250) & (self.hz < 3500))
        return gain * (self.hz < self.draw.uniform(3000, 7500)) if kind < LOW_PASS else gain

    def _mask(self, bands: Tensor) -> None:
        """Hide some bands, and a moment."""
        low = bands.min()
        if self.draw.random() < 0.3:
            first = self.draw.randrange(whisper_mel.BANDS - MASKED_BANDS)
            bands[:, first : first + self.draw.randint(1, MASKED_BANDS)] = low
        if self.draw.random() < 0.2:
            first = self.draw.randrange(len(bands) - MASKED_ROWS)
            bands[first : first + self.draw.randint(1, MASKED_ROWS)] = low
