"""Synthetic speech with exact phone times from espeak-ng, flite and festival."""

# ruff: noqa: SIM905 - voices read better as text
from __future__ import annotations

import random
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import soundfile
import soxr

from elocute.speech.voices.espeak_library import EspeakLibrary, EspeakSpeech
from recipes.encoder.store import HOP, RATE, ShardWriter, labels_from_times
from recipes.encoder.symbols import from_festival, from_ipa
from recipes.encoder.texts import sentence, words_of

WORDS_PER_MINUTE = 165  # of espeak-ng at tempo 1
Phones = list[tuple[float, float, str]]

ESPEAK_MINUTES = {
    "en-us": 28,
    "en": 18,
    "en-gb-scotland": 7,
    "en-gb-x-rp": 7,
    "en-029": 5,
    "en-gb-x-gbclan": 5,
    "de": 22,
    "nl": 14,
    "fr": 12,
    "es": 10,
    "it": 10,
    "pl": 8,
    "sv": 8,
    "pt-br": 8,
    "ru": 10,
    "ja": 10,
    "cmn": 8,
}
ESPEAK_VARIANTS = (
    "Alex Alicia Andrea Andy Annie Denis Gene Gene2 Henrique Hugo Jacky Lee Marco Mario Michael "
    "Mike adam anika antonio aunty belinda benjamin boris caleb david ed edward edward2 f1 f2 f3 "
    "f4 f5 grandma grandpa gustave iven iven2 iven3 iven4 john linda m1 m2 m3 m4 m5 m6 m7 m8 "
    "marcelo max michel miguel norbert pablo paul pedro quincy rob robert sandro shelby steph "
    "steph2 steph3 travis victor zac"
).split()
FLITE_VOICES = ("slt", "rms", "awb", "kal16")
FESTIVAL_VOICES = ("cmu_us_slt_arctic_hts", "kal_diphone", "ked_diphone")


class Espeak:
    """espeak-ng's C library; phone events give exact sample positions."""

    def __init__(self) -> None:
        self.library = EspeakLibrary()

    def speak(
        self, text: str, voice: str, words_per_minute: int, pitch: int, pitch_range: int
    ) -> tuple[np.ndarray, Phones]:
        """Float samples at 16 kHz and phones with times; raises LookupError for no such voice."""
        self.said = said = self.library.speak(text, voice, words_per_minute, pitch, pitch_range)
        samples = np.frombuffer(said.samples, np.int16).astype(np.float32) / 32768
        if not len(samples):
            return samples, []
        phones = self._phones(said, voice[:2], len(samples))
        return soxr.resample(samples, said.sample_rate, RATE), phones

    def _phones(self, said: EspeakSpeech, language: str, total: int) -> Phones:
        phones: Phones = []
        starts = [sample for sample, _ in said.phones] + [total]
        for index, (start, name) in enumerate(said.phones):
            phone = from_ipa(name, language)
            begin_s, end_s = start / said.sample_rate, starts[index + 1] / said.sample_rate
            if phone is None and phones:  # a sign that prolongs the phone before
                phones[-1] = (phones[-1][0], end_s, phones[-1][2])
            else:
                phones.append((begin_s, end_s, phone or "SIL"))
        return phones


def _pad(samples: np.ndarray, phones: Phones, draw: random.Random) -> tuple[np.ndarray, Phones]:
    """Silence around an utterance, so that rests are heard too."""
    lead = round(draw.uniform(0.05, 0.6) * 100) * HOP
    tail = round(draw.uniform(0.05, 0.6) * 100) * HOP
    shift = lead / RATE
    padded = np.concatenate([np.zeros(lead), samples, np.zeros(tail)]).astype(np.float32)
    return padded, [(a + shift, b + shift, p) for a, b, p in phones]


def _add(
    writer: ShardWriter, samples: np.ndarray, phones: Phones, draw: random.Random, **about: str
) -> float:
    samples, phones = _pad(samples, phones, draw)
    writer.add(samples, labels_from_times(phones, len(samples) // HOP), **about)
    return len(samples) / RATE


def espeak_shard(folder: Path, minutes: Mapping[str, float], seed: int = 1) -> None:
    """Many accents, languages and voice variants."""
    engine, writer, draw = Espeak(), ShardWriter(), random.Random(seed)
    for voice, wanted in minutes.items():
        language = voice[:2]
        words, done = words_of(language), 0.0
        while done < wanted * 60:
            text = sentence(language, words, draw)
            variant = draw.choice(ESPEAK_VARIANTS)
            samples, phones = engine.speak(
                text,
                f"{voice}+{variant}",
                draw.randint(120, 240),
                draw.randint(15, 85),
                draw.randint(25, 80),
            )
            if len(samples) < RATE // 4:
                continue
            done += _add(
                writer,
                samples,
                phones,
                draw,
                speaker=f"espeak-{voice}+{variant}",
                source="espeak",
                language=language,
                text=text,
            )
    writer.save(folder, "espeak")


def flite_shard(folder: Path, minutes: float, seed: int = 2) -> None:
    """flite's voices; `-psdur` prints each phone with its end time."""
    writer, draw, words, done = ShardWriter(), random.Random(seed), words_of("en"), 0.0
    with tempfile.TemporaryDirectory() as room:
        while done < minutes * 60:
            voice, text = draw.choice(FLITE_VOICES), sentence("en", words, draw)
            slower, pitch = draw.uniform(0.75, 1.3), draw.uniform(80, 240)
            samples, phones = flite_utterance(voice, text, slower, Path(room), pitch)
            done += _add(
                writer,
                samples,
                phones,
                draw,
                speaker=f"flite-{voice}",
                source="flite",
                language="en",
                text=text,
            )
    writer.save(folder, "flite")


def flite_utterance(
    voice: str, text: str, slower: float, room: Path, pitch: float | None = None
) -> tuple[np.ndarray, Phones]:
    """Samples at 16 kHz and phones; `slower` stretches durations, `pitch` is in Hz."""
    wav = room / "speech.wav"
    command = ["flite", "-voice", voice, "-psdur", "--setf", f"duration_stretch={slower:.2f}"]
    if pitch is not None:
        command += ["--setf", f"int_f0_target_mean={pitch:.0f}"]
    command += ["-t", text, "-o", str(wav)]
    output = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    ends = [part.rsplit(":", 1) for part in output.split() if ":" in part]
    return _read(wav), _from_ends([(phone, float(end)) for phone, end in ends])


def festival_utterance(
    voice: str, text: str, slower: float, room: Path
) -> tuple[np.ndarray, Phones]:
    """The same of festival. Raises LookupError where it says nothing."""
    for _, samples, phones in _festival(voice, [text], room, lambda _low, _high: slower):
        return samples, phones
    raise LookupError(f"festival said nothing: {voice}")


def utterance(
    espeak: Espeak, engine: str, voice: str, text: str, tempo: float = 1.0, pitch: int = 50
) -> tuple[np.ndarray, Phones]:
    """By espeak, flite or festival; tempo 1 is the voice's own, pitch counts for espeak alone."""
    if engine == "espeak":
        return espeak.speak(text, voice, round(WORDS_PER_MINUTE * tempo), pitch, 50)
    speak = flite_utterance if engine == "flite" else festival_utterance
    with tempfile.TemporaryDirectory() as room:
        return speak(voice, text, 1 / tempo, Path(room))


def festival_shard(folder: Path, minutes: float, seed: int = 3) -> None:
    """festival's voices; segment files give each phone with its end time."""
    writer, draw, words = ShardWriter(), random.Random(seed), words_of("en")
    for voice in FESTIVAL_VOICES:
        done = 0.0
        while done < minutes * 60 / len(FESTIVAL_VOICES):
            with tempfile.TemporaryDirectory() as room:
                texts = [sentence("en", words, draw) for _ in range(40)]
                for text, samples, phones in _festival(voice, texts, Path(room), draw.uniform):
                    done += _add(
                        writer,
                        samples,
                        phones,
                        draw,
                        speaker=f"festival-{voice}",
                        source="festival",
                        language="en",
                        text=text,
                    )
    writer.save(folder, "festival")


def _festival(voice: str, texts: list[str], room: Path, uniform: Callable[[float, float], float]):
    lines = [f"(voice_{voice})"]
    for index, text in enumerate(texts):
        lines.append(
            f"(Parameter.set 'Duration_Stretch {uniform(0.75, 1.3):.2f})"
            f'(set! u (utt.synth (Utterance Text "{text}")))'
            f'(utt.save.wave u "{room}/{index}.wav" \'riff)(utt.save.segs u "{room}/{index}.lab")'
        )
    script = room / "speak.scm"
    script.write_text("\n".join(lines), encoding="utf-8")
    subprocess.run(["festival", "-b", str(script)], capture_output=True, check=False)
    for index, text in enumerate(texts):
        wav, lab = room / f"{index}.wav", room / f"{index}.lab"
        if not (wav.exists() and lab.exists()):
            continue
        rows = [line.split() for line in lab.read_text(encoding="utf-8").splitlines()]
        ends = [(row[2], float(row[0])) for row in rows if len(row) == 3 and row[0] != "#"]
        yield text, _read(wav), _from_ends(ends)


def _read(wav: Path) -> np.ndarray:
    samples, rate = soundfile.read(wav, dtype="float32")
    return soxr.resample(samples, rate, RATE) if rate != RATE else samples


def _from_ends(ends: list[tuple[str, float]]) -> Phones:
    starts = [0.0, *(end for _, end in ends)]
    return [(start, end, from_festival(p)) for start, (p, end) in zip(starts, ends, strict=False)]
