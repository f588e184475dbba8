"""Train the network that tells voices from noise for `talkers`, and put it into the package.

    python -m recipes.train_voice ../shared/data SAMPLES            writes the asset
    python -m recipes.train_voice ../shared/data --judge STAMPS     judges it, writes nothing

DATA has `speech`, `talkers/train`, `grid_s1` with `dev.txt`, and `noise`; SAMPLES is the folder
`samples` of Sonic Pi (Debian's `sonic-pi-samples`; CC0): instruments and noises. Voices and noises
made by formula come beside (`recipes.voice.made_sounds`). The formulas of `benchmarks.noises` are
not learned from. STAMPS is the folder `stamps` of Tux Paint's (Debian's `tuxpaint-stamps-default`):
sounds of animals, instruments, machines and the house, and the names of things read aloud. They are
under the GPL as a collection, so they only judge. Five minutes on one core.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from scipy.signal import resample_poly
from torch.nn import functional

from elocute.array_types import Float64Array
from elocute.audio.band_levels import BandLevels
from elocute.audio.espeak import speak
from elocute.audio.phones_and_visemes import SILENCE
from elocute.audio.read import read_audio
from elocute.audio.voice_settings import VoiceSettings
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.protocol import FEATURE_RATE
from elocute.models.talker_voice import LIKELY, NOISE, VOICE, VOICE_PATH, voice_features
from recipes.voice.made_sounds import disguised, levelled, made_sounds

SECONDS = 10.0  # of a recording, at most
NAMES = 60  # of things read aloud, to judge by
OF_EACH = 120  # recordings of a source of speech
MADE, DISGUISED = 40, 60
UNITS, EPOCHS, BATCH, RATE, DECAY, NOISY, DROPPED = 24, 60, 512, 5e-3, 0.02, 0.1, 0.2
LANGUAGES = (  # whose numbers are read aloud: short words, alone
    *("en-us", "en-029", "de", "fr-be", "es", "it", "pt-br", "nl", "sv", "da", "fi", "et", "lt"),
    *("lv", "pl", "cs", "sk", "hu", "ro", "bg", "ru", "el", "tr", "ca", "hi", "ja", "cmn", "vi"),
)
NUMBERS = 12  # of each language
TOWARDS_VOICE = 0.5  # added to every answer: a voice shut out is worse than a noise let in
SUNG = ("ambi_choir", "bass_voxy", "mehackit_robot", "misc_burp", "glitch_robot")
MIXED = (  # stamps in which somebody speaks, or seems to
    *("dreydl", "no_uturn", "xing", "checkered", "final-roll", "hard_candy", "gift", "santahat"),
    *("apollo", "bathyscape", "mad", "happy", "sad", "excited", "koala", "ghost"),
)


@dataclass(frozen=True, eq=False)
class Example:
    """(row, feature) of a sound where there is any, every third row."""

    name: str
    voice: bool
    features: Float64Array


def example(name: str, voice: bool, samples: Float64Array) -> Example:
    sound = samples[: round(SECONDS * SPEECH_RATE)].astype(np.float32)
    posteriors, bands = np.exp(builtin_encoder().encode(sound)), BandLevels()
    rows = np.concatenate([bands.push(sound), bands.flush()])[: len(posteriors)]
    features = voice_features(posteriors[: len(rows)], rows, FEATURE_RATE)
    sounding = np.flatnonzero(posteriors[: len(rows), SILENCE] < 0.5)[::3]
    return Example(name, voice, features[sounding])


def taught(data: Path, samples: Path) -> Iterator[tuple[str, bool, Path]]:
    """Name, whether it is a voice, and the file."""
    measuring = set((data / "grid_s1" / "dev.txt").read_text(encoding="utf-8").split())
    sources = [data / "talkers" / "train" / "clips", data / "grid_s1" / "clips"]
    sources += sorted(folder for folder in (data / "speech").iterdir() if folder.is_dir())
    for folder in sources:
        own = [f for f in sorted(folder.rglob("*.ogg")) if f.stem not in measuring]
        for file in own[:: max(1, len(own) // OF_EACH)]:
            yield folder.name, True, file
    noises = [file for file in sorted(samples.glob("*.flac")) if not file.stem.startswith(SUNG)]
    for file in [*sorted((data / "noise").glob("*.flac")), *noises]:
        yield file.stem, False, file


def judging(stamps: Path) -> Iterator[tuple[str, bool, Path]]:
    """The same of what only judges."""
    files = sorted(stamps.rglob("*.ogg"))
    spoken = [
        f for f in files if "_desc" in f.stem or ("symbols" in f.parts and "faces" not in f.parts)
    ]
    for file in spoken[:: max(1, len(spoken) // NAMES)]:
        yield file.stem, True, file
    for file in files:
        if file not in set(spoken) and not file.stem.startswith(MIXED):
            yield file.stem, False, file


def heard(file: Path) -> Float64Array:
    return read_audio(file, sample_rate=SPEECH_RATE).samples.astype(np.float64)


def read_aloud(text: str, language: str, draw: np.random.Generator) -> Float64Array:
    settings = VoiceSettings(language, pitch=int(draw.integers(20, 80)))
    said = speak(text, settings).sound
    step = int(np.gcd(SPEECH_RATE, said.sample_rate))
    samples = resample_poly(said.samples, SPEECH_RATE // step, said.sample_rate // step)
    return levelled(samples.astype(np.float64))


def examples(data: Path, samples_folder: Path) -> list[Example]:
    """What the network learns from."""
    found, speech = [], []
    for name, voice, file in taught(data, samples_folder):
        samples = heard(file)
        if len(samples) < SPEECH_RATE // 10:
            continue
        found.append(example(name, voice, samples))
        if voice:
            speech.append(samples)
    draw = np.random.default_rng(0)
    for place in draw.choice(len(speech), DISGUISED, replace=False):
        found.append(example("disguised", True, levelled(disguised(speech[place], draw))))
    for language in LANGUAGES:
        for number in draw.choice(200, NUMBERS, replace=False):
            found.append(example(language, True, read_aloud(str(number), language, draw)))
    for voice, samples in made_sounds(1, MADE):
        found.append(example("made", voice, samples))
    return [one for one in found if len(one.features)]


def fitted(told: Sequence[Example], seed: int = 0) -> dict[str, np.ndarray]:
    """A network on rows; every sound counts by the root of its length, voices as much as noises."""
    torch.manual_seed(seed)
    rows = np.concatenate([one.features for one in told])
    truth = np.concatenate([np.full(len(one.features), one.voice, float) for one in told])
    weight = np.concatenate([np.full(len(e.features), len(e.features) ** -0.5) for e in told])
    for voice in (0, 1):
        weight[truth == voice] /= 2 * weight[truth == voice].sum() / len(rows)
    middle, spread = rows.mean(axis=0), rows.std(axis=0) + 1e-6
    z, y, w = (
        torch.tensor(a, dtype=torch.float32)
        for a in (np.clip((rows - middle) / spread, -LIKELY, LIKELY), truth, weight)
    )
    inner, outer = torch.nn.Linear(z.shape[1], UNITS), torch.nn.Linear(UNITS, 1)
    optimiser = torch.optim.AdamW([*inner.parameters(), *outer.parameters()], weight_decay=DECAY)
    for epoch in range(EPOCHS):
        optimiser.param_groups[0]["lr"] = RATE * (1 + np.cos(np.pi * epoch / EPOCHS)) / 2
        for some in torch.randperm(len(z)).split(BATCH):
            hidden = torch.tanh(inner(z[some] + NOISY * torch.randn_like(z[some])))
            answer = outer(functional.dropout(hidden, DROPPED))[:, 0]
            wanted = 0.01 + 0.98 * y[some]
            losses = functional.binary_cross_entropy_with_logits(answer, wanted, reduction="none")
            optimiser.zero_grad()
            (losses * w[some]).mean().backward()
            optimiser.step()
    return {
        "middle": middle.astype(np.float32),
        "spread": spread.astype(np.float32),
        "inner": inner.weight.detach().numpy().T.copy(),
        "inner_bias": inner.bias.detach().numpy().copy(),
        "outer": outer.weight.detach().numpy()[0].copy(),
        "outer_bias": outer.bias.detach().numpy()[0] + np.float32(TOWARDS_VOICE),
    }


def answers(network: dict[str, np.ndarray], one: Example) -> Float64Array:
    """(row,) of one sound."""
    z = np.clip((one.features - network["middle"]) / network["spread"], -LIKELY, LIKELY)
    hidden = np.tanh(z @ network["inner"] + network["inner_bias"])
    return hidden @ network["outer"] + network["outer_bias"]


def judge(network: dict[str, np.ndarray], told: Sequence[Example]) -> None:
    """Print how many sounds are taken for what they are not."""
    voices = [
        one.name for one in told if one.voice and np.percentile(answers(network, one), 30) < VOICE
    ]
    noises = [
        one.name
        for one in told
        if not one.voice and np.percentile(answers(network, one), 95) > NOISE
    ]
    for sort, wrong in ((True, voices), (False, noises)):
        count = sum(one.voice is sort for one in told)
        print(f"{'voices' if sort else 'noises'}: {len(wrong)} of {count} wrong: {' '.join(wrong)}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path)
    parser.add_argument("samples", type=Path, nargs="?")
    parser.add_argument("--judge", type=Path, metavar="STAMPS", help="judge what is in the package")
    parser.add_argument("-o", "--output", type=Path, default=VOICE_PATH)
    given = parser.parse_args()
    torch.set_num_threads(1)
    if given.judge:
        sounds = [(n, v, heard(file)) for n, v, file in judging(given.judge)]
        told = [example(*one) for one in sounds if len(one[2]) > SPEECH_RATE // 10]
        judge(dict(np.load(given.output)), [one for one in told if len(one.features)])
        return
    if not given.samples:
        parser.error("SAMPLES is needed to learn from")
    np.savez(given.output, **fitted(examples(given.data, given.samples)))  # pyright: ignore[reportArgumentType]
    print(f"{given.output}: {given.output.stat().st_size} bytes")


if __name__ == "__main__":
    main()
