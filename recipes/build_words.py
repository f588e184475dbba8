"""Build an LRW-like corpus: captured readings of words, and the same words by other people.

    python -m recipes.build_words build/words [--words 500] [--natural ../shared/data] [--seed 1]

    build/words/captured/         a Corpus: four simulated speakers, 30 frames a second
    build/words/captured_words/   SUBJECT.SENTENCE.json: when each word is said, exactly
    build/words/recordings/       WORD/{train,val,test}/SPEAKER__TAKE.wav
    build/words/split.json        words held out, and who is in which part

Motion is simulated by the articulation driver from the exact phone times of the synthesisers: it
is nobody's recording. The other speakers are other synthetic voices, each take with a tempo, a
pitch and a noise of its own, and, with --natural, words that forced alignment cuts from natural
speech. Parts share no speaker. The same seed gives the same bytes.

Debian: espeak-ng flite festival festvox-us-slt-hts festvox-kallpc16k festvox-kdlpc16k.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.split import Split
from elocute.files.atomic import write_folder_atomically
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from recipes.build_corpus import simulate
from recipes.corpus.speech import voices_missing
from recipes.words.readings import readings
from recipes.words.takes import cut_natural, speak_takes
from recipes.words.texts import WORDS, held_out
from recipes.words.voices import CAPTURED, CAPTURED_TEST, PARTS, Voices, speaker_name

FPS = 30.0
TAKES = {"train": 4, "val": 1, "test": 1}  # speakers that say each word
NOTE = (
    "Simulated by Elocute: synthetic voices (espeak-ng, flite), faces of the built-in head, motion "
    "of the articulation driver; words read one after another. CC0 1.0."
)


def write_captured(
    folder: Path, voices: Voices, words: Sequence[str], speakers: int, seed: int
) -> None:
    """folder/captured and folder/captured_words; the last speaker is the test part."""
    head = load_builtin_head()
    subjects = CAPTURED[-speakers:]
    templates = {
        s.style: head.identity_template(resolve_identity(str(s.identity))).astype(np.float32)
        for s in subjects
    }
    (folder / "captured_words").mkdir()
    with corpus_writer(
        folder / "captured",
        templates,
        fps=FPS,
        basis=head.expression_basis,
        components=head.expression_names,
        faces=head.quads,
        topology=head.name,
        note=NOTE,
    ) as writer:
        for subject in subjects:
            room = folder / "captured_words"
            for clip in readings(voices, subject, words, simulate, FPS, room, seed):
                writer.add(clip)
            print(f"captured: {subject.style}", flush=True)
        names = [(entry.name, entry.subject) for entry in writer.entries]
        writer.splits["default"] = Split(
            tuple(name for name, subject in names if subject != CAPTURED_TEST),
            (),
            tuple(name for name, subject in names if subject == CAPTURED_TEST),
        )


def write_recordings(
    folder: Path, voices: Voices, words: Sequence[str], choice: argparse.Namespace
) -> int:
    takes = TAKES | {"train": choice.takes}
    count = _told(speak_takes(voices, folder, words, takes, choice.seed), "synthetic")
    if choice.natural:
        count += _told(cut_natural(choice.natural, folder, words, choice.natural_limit), "natural")
    return count


def _told(paths: Iterator[Path], kind: str) -> int:
    count = 0
    for count, _ in enumerate(paths, 1):
        if count % 500 == 0:
            print(f"{kind}: {count}", flush=True)
    print(f"{kind}: {count} recordings", flush=True)
    return count


def write_split(folder: Path, voices: Voices, words: Sequence[str]) -> None:
    """Which words the experiment on unseen words keeps back, and the speakers of each part."""
    phones = {word: [p for _, _, p in voices.say_as(CAPTURED[2], word)[1]] for word in words}
    away = held_out(phones)
    record = {
        "words": {"train": [w for w in words if w not in away], "held_out": list(away)},
        "speakers": {part: [speaker_name(*each) for each in PARTS[part]] for part in PARTS},
    }
    (folder / "split.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--words", type=int, default=len(WORDS), help="how many, for trials")
    parser.add_argument("--speakers", type=int, default=4, help="captured ones, 2 to 4")
    parser.add_argument("--takes", type=int, default=TAKES["train"], help="training voices a word")
    parser.add_argument("--natural", type=Path, help="data folder: adds words of natural speech")
    parser.add_argument("--natural-limit", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    choice = parser.parse_args()
    missing = voices_missing()
    if missing:
        sys.exit(f"missing: {', '.join(missing)}; apt-get install {' '.join(missing)}")
    if not (1 <= choice.words <= len(WORDS) and 2 <= choice.speakers <= len(CAPTURED)):
        sys.exit(f"allowed: 1 to {len(WORDS)} words, 2 to {len(CAPTURED)} captured speakers")
    words, voices = WORDS[: choice.words], Voices()
    with write_folder_atomically(choice.folder) as draft:
        write_captured(draft, voices, words, choice.speakers, choice.seed)
        write_recordings(draft / "recordings", voices, words, choice)
        write_split(draft, voices, words)


if __name__ == "__main__":
    main()
