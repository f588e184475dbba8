"""Build the built-in corpus: simulated speakers, shaped like VOCASET.

    python -m recipes.build_corpus build/corpus [--seed 1] [--faces rich]

Twelve subjects (six female, six male faces of the head's identity space, each with a voice and a
speaking style of its own) say forty sentences each, 255 different ones, at 60 frames a second.
Motion is simulated by the articulation driver from the exact phone times of the synthesisers;
it is smooth and plausible, and it is not a recording of anybody. Faces of a rig move by the
built-in head's shapes alone, as the shipped models learned them; rich faces have shapes, flesh and
habits of their own and are stored as vertices (about 9 GB).

    python -m recipes.build_corpus build/corpus --natural build/trunk --grid DATA/grid_s1

adds what the shipped default learns from: natural speech as `train_trunk.py align` and
`realign` left it, simulated in every style, and the real talker as a further subject.
The same seed gives the same bytes.

Debian: espeak-ng flite festival festvox-us-slt-hts festvox-kallpc16k festvox-kdlpc16k.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import CorpusWriter, corpus_writer
from elocute.corpus.split import split_by_subject
from elocute.head.builtin import load_builtin_head
from recipes.corpus import natural, subjects
from recipes.corpus.faces import KINDS, Faces, open_faces, writer_options
from recipes.corpus.sentences import phonetically_rich
from recipes.corpus.sharing import share_sentences
from recipes.corpus.speech import Speaker, voices_missing
from recipes.encoder.store import RATE

FPS = 60.0
NOTE = (
    "Simulated by Elocute: synthetic voices (espeak-ng, flite, festival), faces of the built-in "
    "head{}, motion of the articulation driver. Subjects are called by their style. CC0 1.0."
)


def write_simulated(writer: CorpusWriter, faces: Faces, seed: int, limit: int) -> None:
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
            sound, name = Waveform(samples, RATE), f"s{number:03}"
            frames = faces.frames(phones, sound, subject.style, name, FPS)
            writer.add(Clip(subject.style, name, texts[number], sound, frames))
        print(f"{subject.style}: {index + 1} of {len(subjects.SUBJECTS)}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--limit", type=int, default=40, help="sentences a subject, for trials")
    parser.add_argument(
        "--natural", type=Path, help="work folder of train_trunk.py: adds natural speech"
    )
    parser.add_argument("--faces", choices=KINDS, default="rig", help="rich: of flesh, as vertices")
    parser.add_argument("--grid", type=Path, help="grid_s1: adds the real talker")
    choice = parser.parse_args()
    missing = voices_missing()
    if missing:
        sys.exit(f"missing: {', '.join(missing)}; apt-get install {' '.join(missing)}")
    faces = open_faces(choice.faces, subjects.SUBJECTS)
    if choice.grid:
        faces.templates["grid"] = load_builtin_head().template
    with corpus_writer(
        choice.folder,
        faces.templates,
        fps=FPS,
        note=NOTE.format(", of flesh" if choice.faces != "rig" else ""),
        **writer_options(faces),
    ) as writer:
        write_simulated(writer, faces, choice.seed, choice.limit)
        if choice.natural:
            natural.write_natural(writer, choice.natural, faces, FPS)
        if choice.grid:
            natural.write_grid(writer, choice.grid, faces)
        writer.splits["default"] = split_by_subject(
            writer.entries, subjects.VALIDATION, subjects.TEST
        )
        if choice.grid:
            whole = writer.splits["default"]
            others = tuple(name for name in whole.train if not name.startswith("grid."))
            writer.splits["without_grid"] = replace(whole, train=others)


if __name__ == "__main__":
    main()
