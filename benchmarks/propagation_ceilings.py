"""What a network that learns from one captured speaker can reach, row by row.

    elocute propagate build/words/captured build/words/recordings -o build/shards
            --words build/words/captured_words --root build/words --source crisp
    python -m benchmarks.propagation_ceilings build/words build/shards
            [--held-out build/words/split.json] [--method softdtw]

`elocute evaluate wild` compares a network with captured motion. Here the speaker whose motion was
carried over says the very phones of those clips at their exact times, as only a simulator can:

    source        her own words: her second take, as no two are alike
    participant   another captured speaker's words; `carried` is her motion carried over to them
    sentences     of somebody else

`, held out` rows have the words alone that the training `word` leaves out.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import soundfile

from elocute.array_types import Float32Array
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.shards import Shards, open_shards
from elocute.evaluation.concordance import score_concordance
from elocute.evaluation.wild_parts import read_held_out
from elocute.evaluation.wild_scores import variance_shares
from elocute.numerics.resampling import read_rows
from elocute.propagation.captured_words import CapturedCorpus, CapturedWord, captured_words
from elocute.propagation.corpus_propagation import propagate_corpus
from elocute.propagation.settings import PropagateConfig
from recipes.exact_shards import exact_parameters

Pairs = dict[CapturedWord, tuple[Float32Array, Float32Array]]  # reached and true (frame, parameter)


def said_by(
    words: Path, shards: Shards, source: str, capture: CapturedCorpus, spoken: list[CapturedWord]
) -> Pairs:
    """The source's motion at the phones of captured words, and what was captured."""
    phones, exact = exact_parameters(words, shards)
    corpus, found = capture.corpus, {}
    for clip in dict.fromkeys(word.clip for word in spoken):
        said = phones[f"{corpus.folder.name}/{clip}"]
        whole = exact.at(said, corpus.sound(clip), source, f"{clip} again", corpus.fps)
        for word in (word for word in spoken if word.clip == clip):
            true = _captured(capture, word)
            places = word.start_s * corpus.fps + np.arange(len(true))
            found[word] = read_rows(whole, np.minimum(places, len(whole) - 1)), true
    return found


def _captured(capture: CapturedCorpus, word: CapturedWord) -> Float32Array:
    fps = capture.corpus.fps
    frames = max(1, round((word.end_s - word.start_s) * fps))
    return capture.parameters(word, word.start_s + np.arange(frames) / fps)


def whole_clips(corpus: Corpus) -> Iterator[CapturedWord]:
    """Clips as words that last from their beginning to their end."""
    for each in corpus.entries:
        end = each.frames / corpus.fps
        yield CapturedWord(each.name, each.text, each.subject, "test", each.name, 0.0, end)


def carried(
    words: Path, shards: Shards, source: str, capture: CapturedCorpus, method: str
) -> Pairs:
    """The source's motion carried over to the words of captured speakers of the test part.

    A method that needs no fitting is the default, as each word has one recording here.
    """
    listed = captured_words(capture.corpus, words / "captured_words")
    tested = [word for each in listed.values() for word in each if word.split == "test"]
    held = {(word.word, word.subject): word for word in tested}
    found: Pairs = {}
    with tempfile.TemporaryDirectory() as room:
        recordings, folder = Path(room, "recordings"), Path(room, "shards")
        for word in held.values():
            sound = capture.sound(word)
            path = recordings / word.word / "test" / f"{word.subject}__0.wav"
            path.parent.mkdir(parents=True, exist_ok=True)
            soundfile.write(path, sound.samples, sound.sample_rate, subtype="PCM_16")
        propagate_corpus(
            capture.corpus.folder,
            recordings,
            folder,
            PropagateConfig(method=method, confidence=0.0),
            words=words / "captured_words",
            basis=shards.folder / "basis.npz",
            root=recordings,
            sources=(source,),
        )
        for clip in open_shards(folder, recordings).clips():
            word = held[clip.word, clip.speaker]
            true = _captured(capture, word)
            count = min(len(true), len(clip))
            found[word] = clip.parameters[:count], true[:count]
    return found


def tell(name: str, pairs: Iterable[tuple[Float32Array, Float32Array]], shards: Shards) -> None:
    reached, true = zip(*pairs, strict=True)
    score = score_concordance(reached, true, variance_shares(shards))
    first = " ".join(f"{each.value:.2f}" for each in score.first)
    print(
        f"{name}, {score.clips} clips: mean of {shards.components} {score.mean.value:.3f} "
        f"[{score.mean.low:.3f}, {score.mean.high:.3f}], weighted {score.weighted.value:.3f}, "
        f"c1 … c5 {first}",
        flush=True,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("words", type=Path, help="folder that recipes.build_words made")
    parser.add_argument("shards", type=Path, help="what `elocute propagate --source` made of it")
    parser.add_argument("--held-out", type=Path, help="words, as `elocute evaluate wild` takes it")
    parser.add_argument("--method", default="softdtw", help="of the row `carried`")
    choice = parser.parse_args()
    shards = open_shards(choice.shards, choice.words)
    sources = {clip.source for clip in shards.clips("train") if clip.source != clip.speaker}
    if len(sources) != 1:
        parser.error(f"{choice.shards}: motion of {len(sources)} speakers; allowed: of one")
    source = sources.pop()
    held = read_held_out(choice.held_out) if choice.held_out else ()
    capture = CapturedCorpus(open_corpus(choice.words / "captured"), shards.basis)
    listed = captured_words(capture.corpus, choice.words / "captured_words")
    spoken = [word for words in listed.values() for word in words]
    own = [word for word in spoken if word.subject == source]
    other = [word for word in spoken if word.split == "test"]
    rows: dict[str, Callable[[], Pairs]] = {
        "source": lambda: said_by(choice.words, shards, source, capture, own),
        "participant": lambda: said_by(choice.words, shards, source, capture, other),
        "carried": lambda: carried(choice.words, shards, source, capture, choice.method),
    }
    for name, measure in rows.items():
        pairs = measure()
        tell(name, pairs.values(), shards)
        if held:
            tell(f"{name}, held out", [pairs[word] for word in pairs if word.word in held], shards)
    room = CapturedCorpus(open_corpus(choice.words / "sentences"), shards.basis)
    clips = list(whole_clips(room.corpus))
    tell("sentences", said_by(choice.words, shards, source, room, clips).values(), shards)


if __name__ == "__main__":
    main()
