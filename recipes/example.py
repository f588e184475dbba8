"""Speak the shipped example, src/elocute/assets/example.flac, with Festival.

    python -m recipes.example            # prints when lips close and when the lip meets the teeth

Debian: festival festvox-us-slt-hts. The voice is HTS's slt (Carnegie Mellon University, free to
use); its output is ours.
"""

from __future__ import annotations

import subprocess
import tempfile
from pathlib import Path

import numpy as np
import soundfile

TARGET = Path(__file__).parents[1] / "src" / "elocute" / "assets" / "example.flac"
SENTENCES = (
    "Hello.",
    "Give me any voice, and I will give it a face.",
    "My mouth closes on p, b and m.",
    "Five wolves move through the blue fog.",
    "Now I rest.",
)
BEFORE_S, BETWEEN_S, AFTER_S = 0.5, 0.1, 0.7
LOUDNESS = 0.085  # root mean square
SHOWN = ("p", "b", "m", "f", "v")
SCHEME = """
(voice_cmu_us_slt_arctic_hts)
(set! u (utt.synth (Utterance Text "{text}")))
(utt.save.wave u "{wave}")
(mapcar (lambda (s) (format t "%s %s\\n" (item.name s) (item.feat s "end")))
        (utt.relation.items u (quote Segment)))
"""


def speak(text: str) -> tuple[np.ndarray, int, list[tuple[str, float, float]]]:
    """(sample,), rate, and phones with their beginning and end in seconds."""
    with tempfile.TemporaryDirectory() as room:
        wave, script = Path(room) / "say.wav", Path(room) / "say.scm"
        script.write_text(SCHEME.format(text=text, wave=wave), encoding="utf-8")
        done = subprocess.run(
            ["festival", "-b", str(script)], capture_output=True, text=True, check=True
        )
        samples, rate = soundfile.read(wave, dtype="float32")
    phones, at = [], 0.0
    for line in done.stdout.splitlines():
        name, end = line.split()
        phones.append((name, at, float(end)))
        at = float(end)
    return samples, rate, phones


def main() -> None:
    parts, at, rate = [], BEFORE_S, 32000
    parts.append(np.zeros(round(BEFORE_S * rate), np.float32))
    for sentence in SENTENCES:
        samples, found, phones = speak(sentence)
        assert found == rate, f"Festival speaks at {found} Hz, not {rate}"
        for name, begin, end in phones:
            if name in SHOWN:
                print(f"{sentence[:24]:24} {name} {at + (begin + end) / 2:.2f} s")
        parts += [samples, np.zeros(round(BETWEEN_S * rate), np.float32)]
        at += len(samples) / rate + BETWEEN_S
    parts[-1] = np.zeros(round(AFTER_S * rate), np.float32)
    whole = np.concatenate(parts)
    whole *= LOUDNESS / np.sqrt(np.mean(whole**2))
    soundfile.write(TARGET, whole, rate, subtype="PCM_16")
    print(TARGET, f"{len(whole) / rate:.2f} s")


if __name__ == "__main__":
    main()
