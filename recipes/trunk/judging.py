"""What a trunk hears of people it did not learn from."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from elocute.array_types import Float32Array
from elocute.numerics.correlation import pearson
from recipes.encoder import evaluate
from recipes.trunk.mouths import FIELDS, ROW_RATE, ROW_SAMPLES, MouthClip, by_talker
from recipes.trunk.network import CONTEXT, LIVE_AHEAD, Trunk
from recipes.trunk.spectrum import BatchLogMel

LAGS_S = np.arange(-0.12, 0.121, 0.02)
FRONT_END = BatchLogMel(0)


@torch.no_grad()
def answers(trunk: Trunk, samples: Float32Array, ahead: int) -> tuple[Float32Array, Float32Array]:
    """(row, 7) of the mouth and (row, 40) log-posteriors of a sound at 16 kHz."""
    trunk.eval()
    waves = torch.from_numpy(np.pad(samples, (0, -len(samples) % ROW_SAMPLES)))[None]
    with torch.autocast("cpu", torch.bfloat16):
        mouth, last = trunk.rows(FRONT_END(waves, CONTEXT), ahead)
    phones = torch.log_softmax(trunk.phones(last), -1)
    told = trunk.told(mouth, last, live=ahead == LIVE_AHEAD)
    return told[0].numpy(), phones[0].numpy()


def mouth_correlations(
    trunk: Trunk, clips: Sequence[MouthClip], ahead: int
) -> dict[str, dict[str, float]]:
    """For each talker the mean over clips of r of each field, at the best lag of the clip."""
    found = {}
    for talker, own in by_talker(clips).items():
        rows = []
        for clip in own:
            told, _ = answers(trunk, clip.samples, ahead)
            times = np.arange(len(told)) / ROW_RATE
            rows.append(
                [
                    max(
                        pearson(
                            np.interp(clip.times_s - lag, times, told[:, k]), clip.tracked[:, k]
                        )
                        for lag in LAGS_S
                    )
                    for k in range(len(FIELDS))
                ]
            )
        found[talker] = dict(zip(FIELDS, np.mean(rows, axis=0).round(3).tolist(), strict=True))
    return found


def phone_figures(
    trunk: Trunk, spoken: Sequence[evaluate.Utterance], ahead: int
) -> tuple[float, float, float]:
    """Viseme accuracy, and F1 of p, b, m and of f, v."""
    heard = evaluate.listen(spoken, lambda samples: answers(trunk, samples, ahead)[1])
    return (
        round(evaluate.viseme_accuracy(heard), 4),
        round(evaluate.tuned_f1(heard, evaluate.BILABIAL)[0], 4),
        round(evaluate.tuned_f1(heard, evaluate.LABIODENTAL)[0], 4),
    )
