"""How often `elocute style fit` finds the style that a clip was spoken in.

    python -m benchmarks.style_fit --corpus build/corpus --model out/model.onnx --resay

Held-out clips are those of a part (test unless said otherwise) whose subject the model learned.
The built-in corpus keeps whole subjects apart, so there are none; with --resay the sentences of
the part, which no training speaker says, are said again in every style that the model knows, by
the same driver that made the corpus. Prints the confusion and the rate; target: 90 %.

    python -m benchmarks.style_fit --corpus build/corpus --model voca --speak

has the synthesisers say these sentences again and moves the face by their exact phone times, as
the corpus was made; --resay hears the phones with the encoder, mistakes among them.

    python -m benchmarks.style_fit --corpus build/corpus --part all --together 3 --limit 480

asks the rules themselves (`--model articulation`): what they hear is the encoder's posteriors, what
moved in the corpus came from exact phone times.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

from elocute.articulation.style import STYLES
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.evaluation.model_predictions import recorded_motion
from elocute.head.builtin import load_builtin_head
from elocute.models.feature_extraction import extract_features
from elocute.models.protocol import FrameSpan, SpeechFeatures
from elocute.models.registry import open_model
from elocute.models.style_fit import fit_style
from elocute.models.style_targets import ObservedMotion
from elocute.motion.vertex_motion import VertexMotion
from recipes.corpus.faces import rig_weights
from recipes.corpus.speech import Speaker
from recipes.corpus.subjects import SUBJECTS
from recipes.encoder.store import RATE

Case = tuple[str, str, VertexMotion, Waveform]
"""Clip, the style it was spoken in, its motion and sound."""


def held_out(corpus: Corpus, names: list[str], styles: tuple[str, ...]) -> Iterator[Case]:
    for name in names:
        subject = corpus.entry(name).subject
        if subject in styles:
            yield name, subject, recorded_motion(corpus, name), corpus.sound(name)


def said_again(corpus: Corpus, names: list[str], styles: tuple[str, ...]) -> Iterator[Case]:
    driver, head = open_model("articulation"), load_builtin_head()
    for name in names:
        sound, entry = corpus.sound(name), corpus.entry(name)
        heard = extract_features(driver, sound)[0]
        span = FrameSpan.whole(entry.frames, corpus.fps)
        for style in styles:
            if style in STYLES:
                weights = driver.weights(heard, driver.style(style), span)
                yield (
                    name,
                    style,
                    VertexMotion(weights, head.template, corpus.fps, head.expression_basis),
                    sound,
                )


def spoken_again(corpus: Corpus, names: list[str], styles: tuple[str, ...]) -> Iterator[Case]:
    """By the synthesisers, in the voice of the clip; needs what recipes/build_corpus.py needs."""
    speaker, head = Speaker(), load_builtin_head()
    voices = {subject.style: subject for subject in SUBJECTS}
    for number, name in enumerate(names):
        entry = corpus.entry(name)
        samples, phones = speaker.say(voices[entry.subject], entry.text, number)
        sound = Waveform(samples, RATE)
        for style in styles:
            if style in STYLES:
                weights = rig_weights(phones, sound.duration_s, style, corpus.fps)
                basis = head.expression_basis
                yield name, style, VertexMotion(weights, head.template, corpus.fps, basis), sound


def grouped(cases: Iterator[Case], count: int) -> Iterator[tuple[str, list[Case]]]:
    """So many clips of a style at a time."""
    waiting: dict[str, list[Case]] = {}
    for case in cases:
        takes = waiting.setdefault(case[1], [])
        takes.append(case)
        if len(takes) == count:
            yield case[1], list(takes)
            takes.clear()


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--corpus", type=Path, required=True)
    parser.add_argument("--model", default="articulation")
    parser.add_argument("--split", default="default")
    parser.add_argument(
        "--part",
        default="test",
        choices=("train", "validation", "test", "all"),
        help="all: for a model that learned from none of it",
    )
    parser.add_argument("--names", type=Path, help="a text file of clips instead of a part")
    parser.add_argument("--resay", action="store_true", help="in every style, by the driver")
    parser.add_argument("--speak", action="store_true", help="anew, by exact phone times")
    parser.add_argument("--together", type=int, default=1, help="clips of a style at a time")
    parser.add_argument("--limit", type=int, default=1000, help="clips of the part")
    choice = parser.parse_args()
    corpus, model = open_corpus(choice.corpus), open_model(choice.model)
    names = (
        choice.names.read_text(encoding="utf-8").split()
        if choice.names
        else [entry.name for entry in corpus.entries]
        if choice.part == "all"
        else list(corpus.split(choice.split).parts()[choice.part])
    )[: choice.limit]
    styles = model.styles
    chosen = spoken_again if choice.speak else said_again if choice.resay else held_out
    cases = chosen(corpus, names, styles)
    heard: dict[str, SpeechFeatures] = {}

    def observed(case: Case) -> ObservedMotion:
        name, _, motion, sound = case
        if name not in heard:
            heard[name] = extract_features(model, sound)[0]
        return ObservedMotion(heard[name], motion)

    confusion: Counter[tuple[str, str]] = Counter()
    alone = mixed = 0
    for style, takes in grouped(cases, choice.together):
        fit = fit_style(model, [observed(case) for case in takes])
        found = next(iter(fit.mix))
        confusion[style, found] += 1
        mixed, alone = mixed + (found == style), alone + (fit.best_style == style)
    total = sum(confusion.values())
    if not total:
        sys.exit("no clip of a style that the model knows; --resay says sentences again")
    print(f"| spoken in | {' | '.join(styles)} |\n|---{'|---' * len(styles)}|")
    for style in styles:
        print(f"| {style} | {' | '.join(str(confusion[style, found]) for found in styles)} |")
    print(
        f"\n{total} times {choice.together} clips: largest share right {mixed / total:.1%}, "
        f"nearest single style right {alone / total:.1%} (target 90 %)"
    )


if __name__ == "__main__":
    main()
