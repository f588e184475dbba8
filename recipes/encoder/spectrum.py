"""The run-time front end again in torch, for whole batches, with augmentation in between."""

from __future__ import annotations

import random

import numpy as np
import torch
from torch import Tensor

from elocute.audio import front_end as fe
from elocute.audio.waveform import SPEECH_RATE
from elocute.numerics.mel import mel_points
from elocute.numerics.windows import hann

WARPS = np.linspace(0.82, 1.22, 17)


def warped_mel(warp: float) -> Tensor:
    """(257, 64) filters whose corners are moved as another vocal tract length moves formants."""
    hz = mel_points(fe.LOWEST_HZ, fe.HIGHEST_HZ, fe.BANDS + 2)
    knee, top = 4800 * min(warp, 1) / warp, SPEECH_RATE / 2
    bent = top - (top - knee * warp) / (top - knee) * (top - hz)
    return torch.from_numpy(fe.unit_triangles(np.where(hz <= knee, hz * warp, bent)))


class BatchFrontEnd:
    """(batch, sample) waveforms to (batch, frame, 64) features."""

    def __init__(self, frames: int, seed: int) -> None:
        self.draw = random.Random(seed)
        self.window = torch.from_numpy(hann(fe.WINDOW).astype(np.float32))
        self.plain = torch.from_numpy(fe.mel_weights())
        self.mels = [warped_mel(warp) for warp in WARPS]
        self.hz = torch.linspace(0, SPEECH_RATE / 2, fe.FFT // 2 + 1)
        decay = np.exp(-fe.HOP / SPEECH_RATE / fe.MEAN_S)
        steps = np.arange(frames)
        self.powers = torch.from_numpy((decay ** (steps + 1)).astype(np.float32))
        lower = np.tril(decay ** np.maximum(steps[:, None] - steps, 0)).astype(np.float32)
        self.lower, self.lower_sum = torch.from_numpy(lower), torch.from_numpy(lower.sum(axis=1))
        self.prior = fe.PRIOR_S * SPEECH_RATE / fe.HOP
        self.full = 1 / (1 - decay)

    def __call__(self, waves: Tensor, augment: bool) -> Tensor:
        half = fe.WINDOW // 2
        padded = torch.nn.functional.pad(waves, (half, half))
        views = padded.unfold(-1, fe.WINDOW, fe.HOP)[:, : waves.shape[1] // fe.HOP]
        spectrum = torch.view_as_real(torch.fft.rfft(views * self.window, fe.FFT))
        power = spectrum.square().sum(dim=-1) * fe.power_scale()
        if not augment:
            return self._normalise(power @ self.plain, warm=False)
        bands = torch.stack([self._colour(one) @ self.draw.choice(self.mels) for one in power])
        features = self._normalise(bands, warm=True)
        for one in features:
            self._mask(one)
        return features

    def _colour(self, power: Tensor) -> Tensor:
        """A random microphone: smooth equalisation, and sometimes a narrow band."""
        gain_db = self.draw.uniform(-5, 5) * (self.hz / 8000)
        for _ in range(3):
            middle, width = self.draw.uniform(0, 8000), self.draw.uniform(300, 2500)
            bump = torch.exp(-(((self.hz - middle) / width) ** 2))
            gain_db = gain_db + self.draw.uniform(-7, 7) * bump
        gain = 10 ** (gain_db / 10)
        kind = self.draw.random()
        if kind < 0.12:
            gain = gain * ((self.hz > 250) & (self.hz < 3500))
        elif kind < 0.27:
            gain = gain * (self.hz < self.draw.uniform(3000, 7500))
        return power * gain

    def _normalise(self, bands: Tensor, warm: bool) -> Tensor:
        weight = torch.full((len(bands), 1, 1), self.prior)
        start = torch.full_like(bands[:, :1], fe.PRIOR) * weight
        if warm:  # as if the recording had been going on for a while
            for index in range(len(bands)):
                if self.draw.random() < 0.6:
                    weight[index] = self.draw.uniform(0.1, 1.0) * self.full
                    shift = 10 ** (self.draw.gauss(0, 3) / 10)
                    start[index] = bands[index].mean(dim=0) * shift * weight[index]
        mean = self.powers[None, :, None] * start + self.lower @ bands
        total = self.powers[None, :, None] * weight + self.lower_sum[None, :, None]
        level = torch.log(bands + fe.FLOOR) - torch.log(mean / total + fe.FLOOR)
        return (level * fe.SCALE).clamp(-fe.LIMIT, fe.LIMIT)

    def _mask(self, features: Tensor) -> None:
        """SpecAugment: hide some bands and some moments."""
        if self.draw.random() < 0.3:
            low = self.draw.randrange(fe.BANDS - 8)
            features[:, low : low + self.draw.randint(1, 8)] = 0
        for _ in range(2):
            if self.draw.random() < 0.3:
                at = self.draw.randrange(len(features) - 20)
                features[at : at + self.draw.randint(2, 12)] = 0
