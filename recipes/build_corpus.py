"""Build the built-in corpus: simulated speakers, shaped like VOCASET.

    python -m recipes.build_corpus build/corpus [--seed 1]

Twelve subjects (six female, six male faces of the head's identity space, each with a voice and a
speaking style of its own) say forty sentences each, 255 different ones, at 60 frames a second.
Motion is simulated by the articulation driver from the exact phone times of the synthesisers;
it is smooth and plausible, and it is not a recording of anybody.

    python -m recipes.build_corpus build/corpus --natural build/encoder --grid DATA/grid_s1

adds what the shipped default learns from: natural speech as `train_encoder.py align` and
`realign` left it, simulated in every style, and the real talker as a further subject.
The same seed gives the same bytes.

Debian: espeak-ng flite festival festvox-us-slt-hts festvox-kallpc16k festvox-kdlpc16k.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from elocute.articulation.driver import articulate, posteriors_from_phones
from elocute.articulation.style import STYLES
from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import CorpusWriter, corpus_writer
from elocute.corpus.split import split_by_subject
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from recipes.corpus import natural, subjects
from recipes.corpus.sentences import phonetically_rich
from recipes.corpus.sharing import share_sentences
from recipes.corpus.speech import Speaker, voices_missing
from recipes.encoder.store import LABEL_RATE, RATE

FPS = 60.0
NOTE = (
    "Simulated by Elocute: synthetic voices (espeak-ng, flite, festival), faces of the built-in "
    "head, motion of the articulation driver. Subjects are called by their style. CC0 1.0."
)


def simulate(
    phones: list[tuple[float, float, str]], duration_s: float, style: str, fps: float = FPS
) -> np.ndarray:
    """(frame, component) weights of the built-in head for phones with known times."""
    head = load_builtin_head()
    quiet = replace(STYLES[style], blink_per_min=0.0)  # blinks cannot be heard
    curves = articulate(
        posteriors_from_phones(phones, duration_s, LABEL_RATE),
        LABEL_RATE,
        frame_count=round(duration_s * fps),
        fps=fps,
        style=quiet,
    )
    return curves.select(head.expression_names).values


def write_simulated(writer: CorpusWriter, seed: int, limit: int) -> None:
    speaker = Speaker()
    names = [subject.style for subject in subjects.SUBJECTS]
    alone = (*subjects.VALIDATION, *subjects.TEST)

    def phones_of(text: str) -> list[str]:
        _, phones = speaker.espeak.speak(text, "en-us", 170, 50, 50)
        return [phone for _, _, phone in phones]

    texts = phonetically_rich(255, phones_of, seed)
    spoken = share_sentences(names, alone, seed)
    for index, subject in enumerate(subjects.SUBJECTS):
        for number in spoken[subject.style][-limit:]:
            samples, phones = speaker.say(subject, texts[number], seed * 1_000_003 + number)
            weights = simulate(phones, len(samples) / RATE, subject.style)
            sound = Waveform(samples, RATE)
            writer.add(Clip(subject.style, f"s{number:03}", texts[number], sound, weights))
        print(f"{subject.style}: {index + 1} of {len(subjects.SUBJECTS)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=int, default=40, help="sentences a subject, for trials")
    parser.add_argument(
        "--natural", type=Path, help="work folder of train_encoder.py: adds natural speech"
    )
    parser.add_argument("--grid", type=Path, help="grid_s1: adds the real talker")
    choice = parser.parse_args()
    missing = voices_missing()
    if missing:
        sys.exit(f"missing: {', '.join(missing)}; apt-get install {' '.join(missing)}")
    head = load_builtin_head()
    templates = {
        s.style: head.identity_template(resolve_identity(str(s.identity))).astype(np.float32)
        for s in subjects.SUBJECTS
    }
    if choice.grid:
        templates["grid"] = head.template
    with corpus_writer(
        choice.folder,
        templates,
        fps=FPS,
        basis=head.expression_basis,
        components=head.expression_names,
        faces=head.quads,
        topology=head.name,
        note=NOTE,
    ) as writer:
        write_simulated(writer, choice.seed, choice.limit)
        if choice.natural:
            natural.write_natural(writer, choice.natural, simulate)
        if choice.grid:
            natural.write_grid(writer, choice.grid)
        writer.splits["default"] = split_by_subject(
            writer.entries, subjects.VALIDATION, subjects.TEST
        )
        if choice.grid:
            whole = writer.splits["default"]
            others = tuple(name for name in whole.train if not name.startswith("grid."))
            writer.splits["without_grid"] = replace(whole, train=others)


if __name__ == "__main__":
    main()
