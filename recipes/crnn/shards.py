"""Shards with true parameters: synthetic voices, exact phone times, simulated motion.

Every voice says words and sentences; motion is the articulation driver's at 30 frames a second,
in the style that its speaker has; 28 speech blendshapes are learned from a captured part and all
motion is projected onto them. Nothing is carried over, so parameters are true.
"""

from __future__ import annotations

import random
from pathlib import Path

import numpy as np
import soundfile

from elocute.audio.waveform import Waveform
from elocute.capture.blendshapes.blendshape_learning import learn_blendshapes, sweep_shapes
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_store import open_corpus
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.shards import WordClip, shard_writer
from elocute.corpus.word_clip import SENTENCE
from elocute.head.builtin import load_builtin_head
from elocute.models.model_shapes import to_shapes
from elocute.motion.motion import Motion
from recipes.corpus import sentences
from recipes.crnn.natural import add_natural
from recipes.crnn.simulation import FPS, simulate
from recipes.crnn.voices import LEAD_S, TAIL_S, Speaker, Voice, voices
from recipes.encoder.store import RATE

CONTEXT_S = 0.1  # of rest that a word keeps at both ends
WORDS = tuple(
    sorted(
        {
            w.lower()
            for pool in (
                sentences.ADJECTIVES,
                sentences.NOUNS,
                sentences.PLACES,
                sentences.VERBS,
                sentences.PEOPLE,
            )
            for w in pool
        }
    )
)


def learn_basis(folder: Path, speaker: Speaker, seed: int, clips: int = 40) -> Motion:
    """28 speech blendshapes of one simulated reader; the corpus of it is left in `folder`."""
    head, draw = load_builtin_head(), random.Random(seed)
    with corpus_writer(
        folder,
        {"reader": head.template},
        fps=FPS,
        basis=head.expression_basis,
        components=head.expression_names,
        topology=head.name,
    ) as writer:
        for number in range(clips):
            text = sentences.candidate(draw)
            style = ("plain", "broad", "smiling", "rounded")[number % 4]
            samples, phones = speaker.say(Voice("espeak", "en-us"), text, seed + number)
            weights = simulate(phones, len(samples) / RATE, style)
            writer.add(Clip("reader", f"s{number:03}", text, Waveform(samples, RATE), weights))
    corpus = open_corpus(folder)
    return sweep_shapes(learn_blendshapes(corpus, [e.name for e in corpus.entries]).head)


def build(
    folder: Path,
    sounds: Path,
    work: Path,
    *,
    speakers: int,
    words_each: int,
    sentences_each: int,
    styles: tuple[str, ...] = ("plain",),
    natural: Path | None = None,
    seed: int = 1,
) -> None:
    """Write sounds, then shards; the basis is learned first.

    Without `speakers`, of natural speech alone. `natural` is the work folder of train_trunk.py,
    whose training speakers are added.
    """
    speaker = Speaker()
    basis = learn_basis(work / "reader", speaker, seed)
    draw = random.Random(seed)
    number = 0
    with shard_writer(folder, basis, note=NOTE) as writer:
        for part, some in (voices(speakers, seed) if speakers else {}).items():
            for index, voice in enumerate(some):
                style = styles[index % len(styles)]
                said = draw.sample(WORDS, min(words_each, len(WORDS)))
                said += [sentences.candidate(draw) for _ in range(sentences_each)]
                for text in said:
                    number += 1
                    clip = _clip(speaker, voice, text, part, style, basis, sounds, number)
                    if clip:
                        writer.add(clip)
            print(f"{part}: {len(some)} voices", flush=True)
        if natural:
            add_natural(writer, basis, sounds, natural)


NOTE = (
    "Simulated by Elocute: synthetic voices (espeak-ng, flite, festival), motion of the "
    "articulation driver on the built-in head. CC0 1.0."
)


def _clip(
    speaker: Speaker,
    voice: Voice,
    text: str,
    part: str,
    style: str,
    basis: Motion,
    sounds: Path,
    number: int,
) -> WordClip | None:
    """One utterance, its sound written as FLAC; None where the voice says nothing."""
    samples, phones = speaker.say(voice, text, number)
    if len(samples) < RATE * (LEAD_S + TAIL_S + 0.15):
        return None
    weights = simulate(phones, len(samples) / RATE, style)
    names = load_builtin_head().expression_names
    parameters = to_shapes(weights, names, basis.head.expression_basis)
    word = " " not in text
    first = round((LEAD_S - CONTEXT_S) * FPS) if word else 0
    last = len(parameters) - (round((TAIL_S - CONTEXT_S) * FPS) if word else 0)
    name = f"{voice.speaker}/{number:06}.flac"
    (sounds / voice.speaker).mkdir(parents=True, exist_ok=True)
    soundfile.write(sounds / name, np.clip(samples, -1, 1), RATE, subtype="PCM_16")
    return WordClip(
        f"c{number:06}",
        text if word else SENTENCE,
        voice.speaker,
        voice.speaker,
        part,
        name,
        first / FPS,
        last / FPS,
        FPS,
        parameters[first:last],
        1.0,
    )
