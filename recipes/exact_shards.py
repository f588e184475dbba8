"""Shards with the exact parameters of recordings to which captured motion was carried over.

    elocute propagate build/words/captured build/words/recordings -o build/shards
            --words build/words/captured_words --root build/words
    python -m recipes.exact_shards build/words build/shards -o build/exact

`elocute propagate` gives a recording the motion of a captured speaker, warped in time. Here the
same speaker's simulated face says the very phones of that recording, at their exact times, and its
motion is projected onto the same blendshapes: what propagation should have given. Only a simulator
can tell. Natural recordings have no known phones and are left out; so is the training part, unless
--train asks for it. `elocute evaluate wild --exact` measures against these shards.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.corpus.shards import Shards, WordClip, open_shards, shard_writer
from elocute.head.builtin import load_builtin_head
from elocute.numerics.resampling import read_rows
from elocute.numerics.ridge import ridge_projection
from recipes.corpus.faces import Faces, open_faces
from recipes.encoder.synthesise import Phones
from recipes.words.voices import CAPTURED

NOTE = "Exact motion of simulated speakers at the phone times of each recording. CC0 1.0."


class ExactParameters:
    """What a captured speaker's face does while it says the phones of a recording."""

    def __init__(self, faces: Faces, shards: Shards) -> None:
        self.faces, self.shards = faces, shards
        basis = shards.basis.head.expression_basis
        self.onto = ridge_projection(basis.reshape(len(basis), -1).astype(np.float64))
        self.onto = self.onto.astype(np.float32)

    def at(self, phones: Phones, sound: Waveform, source: str, name: str, fps: float) -> np.ndarray:
        """(frame, parameter) of a whole sound; `name` makes takes differ."""
        made = self.faces.frames(phones, sound, source, name, fps)
        if self.faces.basis is None:
            moved = made - self.faces.templates[source]
        else:
            moved = np.tensordot(made, load_builtin_head().expression_basis, 1)
        return moved.reshape(len(moved), -1).astype(np.float32) @ self.onto

    def of(self, clip: WordClip, phones: Phones) -> np.ndarray:
        """(frame, parameter) at the clip's frames."""
        sound = read_audio(self.shards.sound_root / clip.audio)
        values = self.at(phones, sound, clip.source, clip.clip, clip.fps)
        places = clip.start_s * clip.fps + np.arange(len(clip))
        return read_rows(values, np.minimum(places, len(values) - 1))


def exact_parameters(words: Path, shards: Shards) -> tuple[dict[str, Phones], ExactParameters]:
    """What is said in a folder of recipes.build_words, and the faces of its captured speakers."""
    kind = json.loads((words / "split.json").read_text(encoding="utf-8"))["faces"]
    spoken = json.loads((words / "phones.json").read_text(encoding="utf-8"))
    phones = {
        name: [(float(a), float(b), str(phone)) for a, b, phone in said]
        for name, said in spoken.items()
    }
    return phones, ExactParameters(open_faces(kind, CAPTURED), shards)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("words", type=Path, help="folder that recipes.build_words made")
    parser.add_argument("shards", type=Path, help="what `elocute propagate` made of it")
    parser.add_argument("-o", "--output", type=Path, required=True, help="a new folder of shards")
    parser.add_argument("--train", action="store_true", help="the training part too")
    choice = parser.parse_args()
    shards = open_shards(choice.shards, choice.words)
    phones, exact = exact_parameters(choice.words, shards)
    parts, count = ("validation", "test", *(("train",) if choice.train else ())), 0
    with shard_writer(choice.output, shards.basis, note=NOTE) as writer:
        for clip in shards.clips():
            if clip.split not in parts or clip.audio not in phones or clip.speaker == clip.source:
                continue
            values = exact.of(clip, phones[clip.audio])
            writer.add(
                WordClip(
                    clip.clip,
                    clip.word,
                    clip.speaker,
                    clip.source,
                    clip.split,
                    clip.audio,
                    clip.start_s,
                    clip.end_s,
                    clip.fps,
                    values,
                )
            )
            count += 1
            if count % 500 == 0:
                print(f"exact: {count}", flush=True)
    if not count:
        sys.exit(f"no recording with known phones; propagate with --root {choice.words}")
    print(f"exact: {count} recordings", flush=True)


if __name__ == "__main__":
    main()
