"""All words of a corpus: each once, whatever is killed in between.

    FOLDER/WORD.parquet        whole, or not there
    FOLDER/records/WORD.json   written after it: what came of the word, of which task, its checksum
    FOLDER/basis.npz           what the parameters weigh
    FOLDER/rejects.csv         recordings left out and why
    FOLDER/manifest.json       last of all

A word counts as done when its record is of the very task that would be run, and its shard is as
the record says. Everything else is made again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

from elocute.corpus.shard_file import sha256_of
from elocute.corpus.shards import ShardEntry, write_manifest
from elocute.errors import CorpusError, OutputError
from elocute.files.atomic import write_atomically
from elocute.jobs.pool import Failed, Pool, one_after_another
from elocute.motion.store import load_motion
from elocute.propagation.captured_words import CapturedWord
from elocute.propagation.settings import JobSettings
from elocute.propagation.word_job import (
    RECORDS,
    WordRecord,
    WordTask,
    load_record,
    reject_lines,
    run_word,
)
from elocute.propagation.word_recordings import Recordings

HEADER = "word,audio,reason\n"
REJECTS = "rejects.csv"


@dataclass
class Summary:
    """What a run came to; words that failed are named with the reason."""

    words: int = 0
    kept: int = 0
    aligned: int = 0
    captured: int = 0
    rejected: int = 0
    pairs: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)
    unheard: list[str] = field(default_factory=list)


def propagate(
    settings: JobSettings,
    captured: dict[str, list[CapturedWord]],
    recordings: Recordings,
    pool: Pool = one_after_another,
    progress: Callable[[float], None] | None = None,
) -> Summary:
    """Carry parameters over to every recording; what an earlier run left whole is kept.

    Raises CorpusError where the two sides share no word or nothing could be carried over,
    OutputError where another run works in the folder.
    """
    folder = Path(settings.folder)
    if not set(captured) & set(recordings.words):
        raise CorpusError.about(
            recordings.folder,
            found=f"none of the captured words ({_some(captured)})",
            allowed="recordings of words that a captured speaker says",
        )
    digests = sha256_of(Path(settings.corpus) / "corpus.json"), sha256_of(Path(settings.basis))
    settings = replace(settings, inputs=" ".join(digests))
    (folder / RECORDS).mkdir(exist_ok=True)
    with _alone(folder):
        summary = _run(settings, captured, recordings, pool, progress)
        _finish(settings, captured, recordings, summary)
    return summary


def all_tasks(
    settings: JobSettings, captured: dict[str, list[CapturedWord]], recordings: Recordings
) -> Iterator[WordTask]:
    """One for each word of either side, listed when it is asked for."""
    for word in sorted({*captured, *recordings.words}):
        found, skipped = recordings.of(word) if word in recordings.words else ([], [])
        if not found and not skipped and not settings.truth:
            continue
        yield WordTask(word, tuple(captured.get(word, ())), tuple(found), tuple(skipped), settings)


def _run(
    settings: JobSettings,
    captured: dict[str, list[CapturedWord]],
    recordings: Recordings,
    pool: Pool,
    progress: Callable[[float], None] | None,
) -> Summary:
    summary = Summary(unheard=sorted(set(captured) - set(recordings.words)))
    total = len({*captured, *recordings.words})

    def left() -> Iterator[WordTask]:
        for task in all_tasks(settings, captured, recordings):
            if finished(task) is None:
                yield task
            else:
                summary.kept += 1

    for done, (task, outcome) in enumerate(pool(run_word, left()), 1):
        if isinstance(outcome, Failed):
            summary.failed.append((task.word, outcome.reason))
        if progress:
            progress(min(1.0, (done + summary.kept) / total))
    return summary


def finished(task: WordTask) -> WordRecord | None:
    """The record of a task that was done, its shard whole; else None."""
    folder = Path(task.settings.folder)
    record = load_record(folder / RECORDS / f"{task.name}.json")
    if record is None or record.digest != task.digest:
        return None
    shard = record.shard
    if shard is not None:
        path = folder / shard.name
        if not path.is_file() or sha256_of(path) != shard.sha256:
            return None
    return record


def _finish(
    settings: JobSettings,
    captured: dict[str, list[CapturedWord]],
    recordings: Recordings,
    summary: Summary,
) -> None:
    """Gather the records, one in memory at a time, into rejects and manifest."""
    folder = Path(settings.folder)
    entries: list[ShardEntry] = []
    with write_atomically(folder / REJECTS) as draft, draft.open("w", encoding="utf-8") as file:
        file.write(HEADER)
        for task in all_tasks(settings, captured, recordings):
            record = load_record(folder / RECORDS / f"{task.name}.json")
            if record is None or record.digest != task.digest:
                continue
            file.write(reject_lines(record.rejects))
            summary.words += 1
            summary.aligned += record.aligned
            summary.captured += record.captured
            summary.rejected += len(record.rejects)
            summary.pairs += record.pairs
            if record.shard is not None:
                entries.append(record.shard)
    if not summary.aligned:
        reason = summary.failed[0][1] if summary.failed else f"see {folder / REJECTS}"
        raise CorpusError.about(
            recordings.folder,
            found=f"no recording that parameters could be carried to ({reason})",
            allowed="recordings of words that a captured speaker says",
        )
    note = f"parameters carried over by {settings.method}, seed {settings.seed}"
    write_manifest(folder, entries, load_motion(settings.basis), note)


@contextlib.contextmanager
def _alone(folder: Path) -> Iterator[None]:
    """Nobody else works here meanwhile; a lock that dies with its process."""
    with (folder / ".lock").open("w") as file:
        try:
            import fcntl

            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except ImportError:
            pass  # no such locks on this system
        except OSError as error:
            raise OutputError.about(
                folder, found="another run at work in it", allowed="one at a time"
            ) from error
        yield


def _some(words: Iterable[str]) -> str:
    names = sorted(words)
    return ", ".join(names[:5]) + (" …" if len(names) > 5 else "")
