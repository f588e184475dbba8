"""Propagates one word: fits a network to its recordings, aligns each, writes one shard (4.2)."""

from __future__ import annotations

import csv
import hashlib
import io
import json
import time
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.alignment.aligner import Aligner
from elocute.alignment.methods import fit_aligner
from elocute.alignment.sound_views import speech_view
from elocute.array_types import Float32Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.corpus.corpus_store import open_corpus
from elocute.corpus.shards import (
    SHARD_NAME_PATTERN as SHARD_NAME,
    ShardEntry,
    WordClip,
    write_shard,
)
from elocute.encoders.protocol import FEATURE_RATE
from elocute.errors import AlignmentError, InputError, printable
from elocute.files.atomic import write_atomically
from elocute.files.json_records import read_record
from elocute.files.reading import FileKind
from elocute.motion.store import load_motion
from elocute.numerics.resampling import frame_places, read_rows
from elocute.one_line_repr import one_line
from elocute.propagation.captured_words import MARGIN_S, CapturedCorpus, CapturedWord, cut_sound
from elocute.propagation.settings import PropagationSettings
from elocute.propagation.word_recordings import WordRecording, word_span

SHORTEST_FRAMES = 4  # of a view: 80 ms; nothing shorter is a word
LONGEST_S = 10.0
SOURCES_MAX = 8  # captured takes that a recording is compared with
RECORDS = "records"
RECORD_FILE = FileKind("a record of a word", 100_000_000)


@dataclass(frozen=True)
class WordTask:
    """One word: its captured takes and its recordings; skipped are (file, reason)."""

    word: str
    captured: tuple[CapturedWord, ...]
    recordings: tuple[WordRecording, ...]
    skipped: tuple[tuple[str, str], ...]
    settings: PropagationSettings

    @property
    def name(self) -> str:
        """Of the word's files: plain ASCII, whatever the word's letters."""
        plain = "".join(c if c.isascii() and c.isalnum() else "_" for c in self.word)
        return plain if plain == self.word else f"{plain}-{zlib.crc32(self.word.encode()):08x}"

    @property
    def digest(self) -> str:
        """Of everything that the result depends on, which the output folder is not."""
        record = asdict(self)
        record["settings"].pop("folder")
        record["settings"].pop("basis")
        return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()


@dataclass(frozen=True)
class RejectedRecording:
    """A recording that was left out, and why."""

    word: str
    audio: str
    reason: str


@dataclass(frozen=True)
class WordResult:
    """What became of a word; stored beside its shard, it says that the shard is whole."""

    word: str
    digest: str
    shard: ShardEntry | None
    aligned: int
    captured: int
    pairs: int
    rejects: tuple[RejectedRecording, ...]
    seconds: float


@dataclass(frozen=True, eq=False)
class SourceWord:
    """A captured word to align with: view (frame, feature), parameters (frame, parameter)."""

    word: CapturedWord
    view: Float32Array
    parameters: Float32Array

    __repr__ = one_line


def run_word(task: WordTask) -> WordResult:
    """Fit a method to one word, align its recordings, write its shard and, last, its result.

    The same task gives the same shard, byte for byte; each file appears whole or not at all.
    """
    started = time.monotonic()
    capture = _capture(task.settings.corpus, task.settings.basis)
    rejects = [RejectedRecording(task.word, audio, why) for audio, why in task.skipped]
    clips = list(_captured_clips(task, capture))
    own = len(clips)
    sources = _sources(task, capture, rejects)
    pairs = 0
    if sources:
        aligner = _fitted(task, sources)
        for recording in task.recordings:
            try:
                if aligner is None:
                    raise AlignmentError("no recording of this word can be used")
                clips.append(_aligned(task, recording, sources, aligner))
                pairs += len(sources)
            except InputError as error:
                rejects.append(RejectedRecording(task.word, recording.audio, str(error)))
    else:
        why = "no captured speaker of the training part says this word"
        rejects += [
            RejectedRecording(task.word, recording.audio, why) for recording in task.recordings
        ]
    shard = _write(task, clips, len(capture.basis.names)) if clips else None
    result = WordResult(
        word=task.word,
        digest=task.digest,
        shard=shard,
        aligned=len(clips) - own,
        captured=own,
        pairs=pairs,
        rejects=tuple(rejects),
        seconds=time.monotonic() - started,
    )
    save_word_result(result, Path(task.settings.folder) / RECORDS / f"{task.name}.json")
    return result


@lru_cache(1)
def _capture(corpus: str, basis: str) -> CapturedCorpus:
    """Kept by a worker from word to word."""
    return CapturedCorpus(open_corpus(corpus), load_motion(basis))


def _sources(
    task: WordTask, capture: CapturedCorpus, rejects: list[RejectedRecording]
) -> list[SourceWord]:
    sources: list[SourceWord] = []
    training = [word for word in task.captured if word.split == "train"]
    for word in _spread(training)[:SOURCES_MAX]:
        try:
            view = _view(capture.sound(word), task.settings.encoder)
        except InputError as error:
            rejects.append(RejectedRecording(task.word, f"captured clip {word.clip}", str(error)))
            continue
        times = word.start_s + np.arange(len(view)) / FEATURE_RATE
        sources.append(SourceWord(word, view, capture.parameters(word, times)))
    return sources


def _spread(words: list[CapturedWord]) -> list[CapturedWord]:
    """One take of each speaker, then a second: no speaker crowds out another."""
    seen: dict[str, int] = {}
    ranked = []
    for word in words:
        ranked.append((seen.get(word.subject, 0), len(ranked), word))
        seen[word.subject] = seen.get(word.subject, 0) + 1
    return [word for _, _, word in sorted(ranked, key=lambda each: each[:2])]


def _fitted(task: WordTask, sources: list[SourceWord]) -> Aligner | None:
    """The word's network; None where no recording can be read."""
    settings = task.settings
    seed = zlib.crc32(f"{settings.seed} {task.word}".encode())
    order = np.random.default_rng(seed).permutation(len(task.recordings))
    pairs: list[tuple[Float32Array, Float32Array]] = []
    for place in order:
        if len(pairs) >= settings.fit_pairs:
            break
        try:
            sound, _ = _sound_of(task, task.recordings[int(place)])
            target = _view(sound, settings.encoder)
        except InputError:
            continue  # rejected, with the reason, when it is aligned
        pairs.append((sources[len(pairs) % len(sources)].view, target))
    return fit_aligner(pairs, settings.method, seed=seed) if pairs else None


def _aligned(
    task: WordTask, recording: WordRecording, sources: list[SourceWord], aligner: Aligner
) -> WordClip:
    """The recording with parameters of the take that fits it best. Raises InputError."""
    settings = task.settings
    sound, start = _sound_of(task, recording)
    target = _view(sound, settings.encoder)
    alignments = [aligner.align(source.view, target) for source in sources]
    best = int(np.argmax([alignment.score for alignment in alignments]))
    score = alignments[best].score
    if score < settings.confidence:
        raise AlignmentError.about(
            "confidence", found=f"{score:.2f}", allowed=f"{settings.confidence:g} or more"
        )
    values = transfer_parameters(sources[best].parameters, alignments[best].path, len(target))
    frames = max(1, round(sound.duration_s * settings.fps))
    return WordClip(
        clip=recording.clip,
        word=task.word,
        speaker=recording.speaker,
        source=sources[best].word.subject,
        split=recording.split,
        audio=_from_root(settings, Path(settings.recordings) / recording.audio),
        start_s=start,
        end_s=start + sound.duration_s,
        fps=settings.fps,
        parameters=read_rows(values, frame_places(0, frames, FEATURE_RATE, settings.fps)),
        confidence=score,
    )


def _sound_of(task: WordTask, recording: WordRecording) -> tuple[Waveform, float]:
    """The word in its recording, a margin around it, and where that starts in s."""
    folder = Path(task.settings.recordings)
    path = folder / recording.audio
    if not path.resolve().is_relative_to(Path(task.settings.root).resolve()):
        raise AlignmentError("a link out of the folder of sounds")
    whole = read_audio(path)
    if whole.duration_s > LONGEST_S:
        raise AlignmentError.about(
            "sound", found=f"{whole.duration_s:.1f} s", allowed=f"one word, up to {LONGEST_S:g} s"
        )
    start, end = word_span(folder, recording, whole.duration_s)
    start = max(0.0, start - MARGIN_S)
    return cut_sound(whole, start, min(end + MARGIN_S, whole.duration_s)), start


def _view(sound: Waveform, encoder: str) -> Float32Array:
    view = speech_view(sound, encoder)
    if len(view) < SHORTEST_FRAMES:
        raise AlignmentError.about(
            "sound",
            found=f"{sound.duration_s * 1000:.0f} ms",
            allowed=f"{1000 * SHORTEST_FRAMES / FEATURE_RATE:.0f} ms or more",
        )
    return view


def _captured_clips(task: WordTask, capture: CapturedCorpus) -> Iterator[WordClip]:
    """Captured words as clips of their own, where the settings ask for them."""
    settings = task.settings
    if not settings.truth:
        return
    for word in task.captured:
        frames = max(1, round((word.end_s - word.start_s) * settings.fps))
        times = word.start_s + np.arange(frames) / settings.fps
        yield WordClip(
            clip=word.name,
            word=task.word,
            speaker=word.subject,
            source=word.subject,
            split=word.split,
            audio=_from_root(settings, capture.corpus.sound_path(word.clip)),
            start_s=word.start_s,
            end_s=word.end_s,
            fps=settings.fps,
            parameters=capture.parameters(word, times),
            confidence=1.0,
        )


def _from_root(settings: PropagationSettings, path: Path) -> str:
    return path.relative_to(settings.root).as_posix()


def _write(task: WordTask, clips: list[WordClip], components: int) -> ShardEntry:
    return write_shard(Path(task.settings.folder) / f"{task.name}.parquet", clips, components)


def save_word_result(result: WordResult, path: Path) -> None:
    with write_atomically(path) as draft:
        draft.write_text(json.dumps(asdict(result)) + "\n", encoding="utf-8")


def load_word_result(path: Path) -> WordResult | None:
    """What `save_word_result` wrote, or None where it is missing or broken."""
    try:
        stored = read_record(path, RECORD_FILE)
        if not _are_whole(stored, "aligned", "captured", "pairs"):
            return None
        shard = stored["shard"]
        stored["shard"] = None if shard is None else _stored_shard(shard)
        stored["rejects"] = tuple(_stored_reject(each) for each in stored["rejects"])
        return WordResult(**stored)
    except (InputError, ValueError, TypeError, KeyError):
        return None


def _stored_shard(stored: dict[str, Any]) -> ShardEntry:
    """Raises ValueError for a name that is not a shard's, since it becomes a path."""
    entry = ShardEntry(**stored)
    if not SHARD_NAME.fullmatch(entry.name) or not _are_whole(stored, "rows"):
        raise ValueError("not a shard")
    return entry


def _stored_reject(stored: Any) -> RejectedRecording:
    if not isinstance(stored, dict) or not all(isinstance(text, str) for text in stored.values()):
        raise ValueError("not a rejected recording")
    return RejectedRecording(**stored)


def _are_whole(stored: dict[str, Any], *names: str) -> bool:
    return all(type(stored[name]) is int and stored[name] >= 0 for name in names)


def reject_lines(rejects: tuple[RejectedRecording, ...]) -> str:
    """Rows of rejects.csv. A leading = + - @ would be a formula to a spreadsheet.

    Line ends in names, and bytes that are no text, are escaped.
    """
    rows = io.StringIO()
    writer = csv.writer(rows, lineterminator="\n")
    for each in rejects:
        texts = [printable(text) for text in (each.word, each.audio, each.reason)]
        writer.writerow([f"'{text}" if text[:1] in "=+-@" else text for text in texts])
    return rows.getvalue()


def transfer_parameters(values: Float32Array, path: NDArray[np.intp], targets: int) -> Float32Array:
    """(target frame, parameter): the mean over many-to-one, a copy over one-to-many (section 4.2).

    values: (source frame, parameter). path: (step, 2) source and target frames that belong
    together. Raises AlignmentError for a path that leaves one of so many target frames without a
    source, or reaches beyond the values.
    """
    if path.ndim != 2 or path.shape[1] != 2 or not len(path):
        raise AlignmentError.about("path", found=f"shape {path.shape}", allowed="(step, 2)")
    source, target = path[:, 0], path[:, 1]
    if path.min() < 0 or source.max() >= len(values) or target.max() >= targets:
        raise AlignmentError.about(
            "path",
            found=f"up to frames {source.max()}, {target.max()}",
            allowed=f"below {len(values)}, {targets}",
        )
    counts = np.bincount(target, minlength=targets)
    if not counts.all():
        raise AlignmentError.about(
            "path",
            found=f"no source for target frame {int(counts.argmin())}",
            allowed="one or more for every frame",
        )
    sums = np.zeros((targets, values.shape[1]))
    np.add.at(sums, target, values[source])
    return (sums / counts[:, None]).astype(np.float32)
