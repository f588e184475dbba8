"""An hour of sound takes no more memory than a minute."""

import sys

import numpy as np
import pytest
import soundfile

from tests.support.commands import run_python

COUNT = """
import resource, sys
from elocute.audio import resampled_blocks

def peak_mb():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024

list(resampled_blocks(sys.argv[1], 16000))  # loads the libraries
before = peak_mb()
samples = sum(len(block) for block in resampled_blocks(sys.argv[2], 16000))
print(samples, peak_mb() - before)
"""


def write_noise(path, seconds: int) -> None:
    noise = np.random.default_rng(0).normal(0, 3000, 8000 * 60).astype(np.int16)
    with soundfile.SoundFile(path, "w", 8000, 1, "PCM_16") as file:
        for _ in range(seconds // 60):
            file.write(noise)


@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss counts otherwise elsewhere")
@pytest.mark.parametrize("name", ["a.wav", "a.flac"])
def test_an_hour_is_streamed_in_bounded_memory(tmp_path, name):
    write_noise(tmp_path / f"minute_{name}", 60)
    write_noise(tmp_path / name, 3600)
    out = run_python("-c", COUNT, tmp_path / f"minute_{name}", tmp_path / name, check=True)
    samples, more_mb = out.stdout.split()
    assert int(samples) == 3600 * 16000
    assert float(more_mb) < 20  # the hour itself is 230 MB
