"""The second paper's chain, small: from simulated capture to a model that animates a recording.

    python -m recipes.demo_wild out/wild [--speech talk.wav] [--jobs 2]

    1  a head that speaks is scanned in software, and registered: `elocute capture scans`
    2  the words of that reading are found from its text: `elocute words segment` and `check`
    3  two more speakers read the same words. Their motion comes straight from the simulator, not
       through scans: registering takes most of a second a frame
    4  speech blendshapes of all of it: `elocute blendshapes learn`
    5  parameters carried to other voices: `elocute propagate`, by `cca-soft` instead of the
       paper's alignment (docs/measurements/alignment.md says why)
    6  a recurrent model: `elocute train crnn`
    7  it animates a recording: `elocute animate --model`

Needs what recipes.build_words needs. So little data makes a mouth that moves, not one that
speaks well: docs/measurements/recurrent-model.md says what the full corpus gives.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from elocute.audio.waveform import Waveform
from elocute.capture.scans.scan_sequence import SequenceMetadata
from elocute.capture.simulation.scan_simulator import Scanner, simulate_scans
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.split import Split
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.motion.motion import Motion
from recipes.build_words import FPS

EXAMPLE = Path(__file__).parents[1] / "src" / "elocute" / "assets" / "example.flac"
SCANNED_S = 1.2  # of a reading: about its first word
POINTS = 12_000  # of a scan
SCANNED = "scanned"


def elocute(*arguments: object) -> None:
    """Run a command and say how long it took."""
    call = ["elocute", *map(str, arguments)]
    print("\n$", " ".join(call), flush=True)
    started = time.monotonic()
    code = "from elocute.cli import main; main()"
    subprocess.run([sys.executable, "-c", code, *call[1:]], check=True)
    print(f"  {time.monotonic() - started:.0f} s", flush=True)


def scan_first_word(words: Path, room: Path) -> str:
    """Scan the beginning of a reading; the word that is said in it."""
    corpus, head = open_corpus(words / "captured"), load_builtin_head()
    entry = corpus.entries[0]
    record = json.loads((words / "captured_words" / f"{entry.name}.json").read_text())
    first, second = record["words"][:2]
    seconds = min(SCANNED_S, (first["end_s"] + second["start_s"]) / 2)
    face = head.with_identity(resolve_identity("107"))
    weights = np.array(corpus.frames(entry.name)[: round(seconds * corpus.fps)])
    sound = corpus.sound(entry.name)
    simulate_scans(
        Motion(face, weights, corpus.fps),
        room / "scans",
        scanner=Scanner(points=POINTS),
        metadata=SequenceMetadata(subject=SCANNED, sentence="r000", text=first["word"]),
        sound=sound,
    )
    return first["word"]


def joined(parts: list[Corpus], folder: Path) -> None:
    """One corpus of vertices out of several with one topology; the test part stays apart."""
    templates = {s: np.array(part.template(s)) for part in parts for s in part.subjects}
    head = load_builtin_head()
    with corpus_writer(
        folder,
        templates,
        fps=FPS,
        faces=head.quads,
        topology=head.name,
        note="partly registered from simulated scans, partly straight from the simulator",
    ) as writer:
        for clip in _clips(parts):
            writer.add(clip)
        test = parts[0].split().test
        names = tuple(entry.name for entry in writer.entries)
        writer.splits["default"] = Split(tuple(n for n in names if n not in test), (), test)


def _clips(parts: list[Corpus]) -> Iterator[Clip]:
    for part in parts:
        for entry in part.entries:
            sound: Waveform = part.sound(entry.name)
            frames = part.vertices(entry.name)
            yield Clip(entry.subject, entry.sentence, entry.text, sound, frames)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--speech", type=Path, default=EXAMPLE, help="what the model animates")
    parser.add_argument("--words", type=int, default=20)
    parser.add_argument("--epochs", type=int, default=30)
    parser.add_argument("--jobs", type=int, default=2)
    choice = parser.parse_args()
    started, folder = time.monotonic(), choice.folder
    if folder.exists():
        sys.exit(f"{folder}: exists already; allowed: a new folder")
    folder.mkdir(parents=True)
    words = folder / "words"
    build = [sys.executable, "-m", "recipes.build_words", words, "--faces", "rig"]
    subprocess.run([*build, "--words", str(choice.words), "--speakers", "3"], check=True)
    word = scan_first_word(words, folder)
    elocute(
        "capture", "scans", folder / "scans", "-o", folder / "registered", "--jobs", choice.jobs
    )
    sound = folder / "registered" / "corpus" / "sound" / f"{SCANNED}.r000.flac"
    times = words / "captured_words" / f"{SCANNED}.r000.json"
    elocute("words", "segment", sound, "--text", word, "-o", times)
    elocute("words", "check", times, sound, "-o", folder / "words.html")
    registered = open_corpus(folder / "registered" / "corpus")
    joined([open_corpus(words / "captured"), registered], words / "all")
    elocute(
        "blendshapes", "learn", words / "all", "-o", folder / "blendshapes.npz", "--part", "train"
    )
    elocute(
        "propagate",
        words / "all",
        words / "recordings",
        "-o",
        folder / "shards",
        "--words",
        words / "captured_words",
        "--root",
        words,
        "--basis",
        folder / "blendshapes.npz",
        "--jobs",
        choice.jobs,
    )
    elocute(
        "train",
        "crnn",
        folder / "shards",
        words,
        "-o",
        folder / "model",
        "--epochs",
        choice.epochs,
        "--highest-hz",
        8000,
        "--weight-power",
        0.25,
    )
    elocute(
        "animate",
        choice.speech,
        "--model",
        folder / "model" / "model.onnx",
        "-o",
        folder / "talk.npz",
        "-o",
        folder / "talk.glb",
    )
    print(f"\n{folder}: talk.glb, talk.npz; {time.monotonic() - started:.0f} s in all")


if __name__ == "__main__":
    main()
