"""Build an LRW-like corpus: captured readings of words, and the same words by other people.

    python -m recipes.build_words build/words [--words 500] [--natural ../shared/data] [--seed 1]
                                              [--faces people|rich|rig]

    build/words/captured/         a Corpus: four simulated speakers, 30 frames a second
    build/words/captured_words/   SUBJECT.SENTENCE.json: when each word is said, exactly
    build/words/recordings/       WORD/{train,val,test}/SPEAKER__TAKE.wav
    build/words/split.json        words held out, and who is in which part
    build/words/phones.json       what is said in each synthetic recording and clip, and when
    build/words/sentences/        a Corpus: fifty sentences of a fifth simulated speaker

Motion is simulated from the exact phone times of the synthesisers: it is nobody's recording. Faces
are of flesh, with habits of their own (vertices, about 5 GB for 500 words): `people` differ as
tracked talkers do, `rich` ones have a speaking style of their own besides. They pause once in a
reading, to swallow and breathe. With --faces rig the articulation driver moves the built-in head's
shapes. The other speakers are other synthetic voices, each take with a tempo, a
pitch and a noise of its own, and, with --natural, words that forced alignment cuts from natural
speech. Parts share no speaker. The same seed gives the same bytes.

Debian: espeak-ng flite festival festvox-us-slt-hts festvox-kallpc16k festvox-kdlpc16k.
"""

from __future__ import annotations

import argparse
import json
import random
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import CorpusWriter, corpus_writer
from elocute.corpus.split import Split
from elocute.files.atomic import write_folder_atomically
from recipes.corpus.faces import KINDS, Faces, open_faces, writer_options
from recipes.corpus.sentences import candidate
from recipes.corpus.speech import Speaker, voices_missing
from recipes.encoder.store import RATE
from recipes.encoder.synthesise import Phones
from recipes.words.readings import readings
from recipes.words.takes import cut_natural, speak_takes
from recipes.words.texts import WORDS, held_out
from recipes.words.voices import (
    CAPTURED,
    CAPTURED_TEST,
    PARTS,
    SENTENCES,
    Voices,
    speaker_name,
)

FPS = 30.0
TAKES = {"train": 4, "val": 1, "test": 1}  # speakers that say each word
SENTENCES_MAX = 50
PAUSE_S = {"rich": 0.9, "people": 0.9, "rig": 0.0}  # longer, once in a reading
NOTE = (
    "Simulated by Elocute: synthetic voices (espeak-ng, flite), faces of the built-in head ({}), "
    "motion of the articulation driver; words read one after another. CC0 1.0."
)


def words_writer(folder: Path, faces: Faces, kind: str) -> AbstractContextManager[CorpusWriter]:
    """A corpus of these faces."""
    note = NOTE.format(kind)
    return corpus_writer(folder, faces.templates, fps=FPS, note=note, **writer_options(faces))


def write_captured(
    folder: Path,
    voices: Voices,
    words: Sequence[str],
    speakers: int,
    seed: int,
    kind: str,
    spoken: dict[str, Phones],
) -> None:
    """folder/captured and folder/captured_words; the last speaker is the test part."""
    subjects = CAPTURED[-speakers:]
    faces = open_faces(kind, subjects)
    (folder / "captured_words").mkdir()
    with words_writer(folder / "captured", faces, kind) as writer:
        for subject in subjects:
            room = folder / "captured_words"
            for clip in readings(
                voices, subject, words, faces.frames, FPS, room, seed, spoken, PAUSE_S[kind]
            ):
                writer.add(clip)
            print(f"captured: {subject.style}", flush=True)
        names = [(entry.name, entry.subject) for entry in writer.entries]
        writer.splits["default"] = Split(
            tuple(name for name, subject in names if subject != CAPTURED_TEST),
            (),
            tuple(name for name, subject in names if subject == CAPTURED_TEST),
        )


def write_sentences(
    folder: Path, count: int, seed: int, kind: str, spoken: dict[str, Phones]
) -> None:
    """folder/sentences: somebody of whom no word is captured (section 6.4)."""
    subject, speaker, draw = SENTENCES, Speaker(), random.Random(seed)
    faces = open_faces(kind, [subject])
    with words_writer(folder / "sentences", faces, kind) as writer:
        for number in range(count):
            text = candidate(draw)
            samples, phones = speaker.say(subject, text, seed + number)
            sound, name = Waveform(samples, RATE), f"s{number:03}"
            spoken[f"sentences/{subject.style}.{name}"] = phones
            frames = faces.frames(phones, sound, subject.style, f"{seed}.{name}", FPS)
            writer.add(Clip(subject.style, name, text, sound, frames))
    print(f"sentences: {subject.style}", flush=True)


def write_recordings(
    folder: Path,
    voices: Voices,
    words: Sequence[str],
    held: Sequence[str],
    choice: argparse.Namespace,
    spoken: dict[str, Phones],
) -> int:
    """folder/recordings."""
    takes = TAKES | {"train": choice.takes}
    (folder / "recordings").mkdir()
    made = speak_takes(
        voices, folder / "recordings", words, takes, choice.seed, held=held, spoken=spoken
    )
    count = _told(made, "synthetic")
    folder = folder / "recordings"
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


def write_split(folder: Path, voices: Voices, words: Sequence[str], kind: str) -> tuple[str, ...]:
    """Which words the experiment on unseen words keeps back, the speakers of each part, the faces.

    Every phone of these words is also in others, as far as the words allow.
    """
    phones = {word: [p for _, _, p in voices.say_as(CAPTURED[2], word)[1]] for word in words}
    away = held_out(phones)
    record = {
        "words": {"train": [w for w in words if w not in away], "held_out": list(away)},
        "faces": kind,
        "speakers": {part: [speaker_name(*each) for each in PARTS[part]] for part in PARTS},
    }
    (folder / "split.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return away


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--words", type=int, default=len(WORDS), help="how many, for trials")
    parser.add_argument("--speakers", type=int, default=4, help="captured ones, 2 to 4")
    parser.add_argument("--takes", type=int, default=TAKES["train"], help="training voices a word")
    parser.add_argument("--natural", type=Path, help="data folder: adds words of natural speech")
    parser.add_argument("--natural-limit", type=int, default=2000)
    parser.add_argument("--faces", choices=KINDS, default="people", help="of captured speakers")
    parser.add_argument("--seed", type=int, default=1)
    choice = parser.parse_args()
    missing = voices_missing()
    if missing:
        sys.exit(f"missing: {', '.join(missing)}; apt-get install {' '.join(missing)}")
    if not (1 <= choice.words <= len(WORDS) and 2 <= choice.speakers <= len(CAPTURED)):
        sys.exit(f"allowed: 1 to {len(WORDS)} words, 2 to {len(CAPTURED)} captured speakers")
    words, voices, kind = WORDS[: choice.words], Voices(), choice.faces
    spoken: dict[str, Phones] = {}
    with write_folder_atomically(choice.folder) as draft:
        write_captured(draft, voices, words, choice.speakers, choice.seed, kind, spoken)
        held = write_split(draft, voices, words, kind)
        write_recordings(draft, voices, words, held, choice, spoken)
        write_sentences(draft, min(SENTENCES_MAX, choice.words), choice.seed, kind, spoken)
        (draft / "phones.json").write_text(json.dumps(spoken) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
