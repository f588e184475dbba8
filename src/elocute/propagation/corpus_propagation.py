"""Propagation of captured motion to all recordings; an interrupted run can be resumed.

    FOLDER/WORD.parquet        whole, or not there
    FOLDER/records/WORD.json   written after it: the result, a digest of the task, its checksum
    FOLDER/basis.npz           what the parameters weigh
    FOLDER/rejects.csv         recordings left out and why
    FOLDER/manifest.json       last of all

With several sources all of that is in FOLDER/SUBJECT, for each apart. A word counts as done when
its result belongs to the very task that would be run, and the shard has the checksum in it. Every
other word is run again.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from elocute.alignment.methods import resolve_method
from elocute.capture.blendshapes.blendshape_learning import learn_blendshapes, sweep_shapes
from elocute.corpus.corpus_store import Corpus, open_corpus
from elocute.corpus.shards import BASIS, ShardEntry, write_manifest
from elocute.encoders.registry import resolve_encoder
from elocute.errors import CorpusError, OutputError
from elocute.files.atomic import write_atomically
from elocute.files.reading import file_sha256
from elocute.files.work_folder import prepare_folder, prepare_work
from elocute.jobs.pool import FailedTask, Pool, one_after_another
from elocute.motion.store import load_motion, save_motion
from elocute.propagation.captured_words import (
    CapturedCorpus,
    CapturedWord,
    captured_words,
    words_of_source,
)
from elocute.propagation.settings import PropagateConfig, PropagationSettings
from elocute.propagation.word_job import (
    RECORDS,
    WordResult,
    WordTask,
    load_word_result,
    reject_lines,
    run_word,
)
from elocute.propagation.word_recordings import WordRecordings, find_recordings

HEADER = "word,audio,reason\n"
REJECTS = "rejects.csv"
WRITTEN = (BASIS, "manifest.json", REJECTS, "*.parquet")
DEEP = ("dctw", "cca-soft", "dcaw")  # their sums depend on the number of threads: workers have one


@dataclass
class PropagationSummary:
    """Counts of a run.

    Parameters
    ----------
    words : int
        Words with recordings.
    kept : int
        Those of them that an earlier run had finished.
    aligned : int
        Recordings that parameters were carried over to.
    captured : int
        Captured words that became clips themselves.
    rejected : int
        Recordings whose alignment was too doubtful.
    pairs : int
        Alignments made.
    failed : list of (str, str)
        Word and reason.
    unheard : list of str
        Captured words without a recording.
    """

    words: int = 0
    kept: int = 0
    aligned: int = 0
    captured: int = 0
    rejected: int = 0
    pairs: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)
    unheard: list[str] = field(default_factory=list)

    def __add__(self, other: PropagationSummary) -> PropagationSummary:
        """Of both runs."""
        return PropagationSummary(
            self.words + other.words,
            self.kept + other.kept,
            self.aligned + other.aligned,
            self.captured + other.captured,
            self.rejected + other.rejected,
            self.pairs + other.pairs,
            self.failed + other.failed,
            list(dict.fromkeys(self.unheard + other.unheard)),
        )


def propagate_corpus(
    corpus: Path,
    recordings: Path,
    folder: Path,
    config: PropagateConfig | None = None,
    *,
    words: Path | None = None,
    basis: Path | None = None,
    root: Path | None = None,
    split: str = "default",
    sources: Sequence[str] = (),
    jobs: int = 1,
    ray: str | None = None,
    resume: bool = False,
    progress: Callable[[float], None] | None = None,
) -> PropagationSummary:
    """Carry the parameters of a corpus's captured speakers over to recordings; leave shards.

    A recording receives the motion of the speaker who fits it best, which a network cannot hear.
    The paper has one participant: `sources` names one, or several to be carried over each apart.

    Parameters
    ----------
    corpus : Path
        Folder of the captured speakers.
    recordings : Path
        Folder of the recordings, as `find_recordings` reads it.
    folder : Path
        Where the shards go.
    config : PropagateConfig, optional
        Settings; the defaults without it.
    words : Path, optional
        Folder of SUBJECT.SENTENCE.json: words of the captured clips, with times.
    basis : Path, optional
        Speech blendshapes (.npz); learned from the training clips without it.
    root : Path, optional
        Folder to which the paths of sounds in the shards are relative; `recordings` without it.
    split : str
        Split of the corpus whose training part is carried over.
    sources : sequence of str
        Subjects of the training part whose motion alone is carried over; without any, the
        recordings are shared out among all. Several have shards of their own, in FOLDER/SUBJECT,
        with the same blendshapes. The rest of the training part is left out.
    jobs : int
        Processes, 0 for all processors; with `ray` the number of actors.
    ray : str, optional
        HOST:PORT of a Ray cluster, or "local".
    resume : bool
        Resume in a folder that an earlier run left unfinished.
    progress : callable, optional
        Called with the share that is done, 0 to 1.

    Returns
    -------
    PropagationSummary

    Raises
    ------
    InputError
        For anything that cannot be used; nothing is written then.
    MachineError
        For a package that is missing.

    References
    ----------
    Tzirakis et al. 2019, section 4.2.
    """
    config = config or PropagateConfig()
    resolve_method(config.method)
    resolve_encoder(config.encoder)
    opened, recorded = open_corpus(corpus), find_recordings(recordings)
    captured = captured_words(opened, words, split)
    spoken = {
        folder / source if len(sources) > 1 else folder: words_of_source(captured, source)
        for source in sources
    } or {folder: captured}
    top = (root or recordings).resolve()
    if not recorded.folder.resolve().is_relative_to(top):
        raise CorpusError.about(recordings, found="not below `root`", allowed=f"a folder in {top}")
    pool = chosen_pool(config.method, jobs, ray)
    if len(sources) > 1:
        prepare_folder(folder, resume)
    for place in spoken:
        prepare_work(place, resume, RECORDS, WRITTEN)
    summaries: list[PropagationSummary] = []
    for place, taken in spoken.items():
        (place / RECORDS).mkdir(exist_ok=True)  # tells the folder for ours from the start
        settings = PropagationSettings(
            **asdict(config),
            corpus=str(corpus.resolve()),
            basis=str(basis := provide_basis(opened, place, basis, split)),
            recordings=str(recordings.resolve()),
            root=str(top),
            folder=str(place.resolve()),
            truth=corpus.resolve().is_relative_to(top),
        )
        told = _share_of(progress, len(summaries), len(spoken))
        summaries.append(propagate(settings, taken, recorded, pool, told))
    return sum(summaries[1:], summaries[0])


def _share_of(
    progress: Callable[[float], None] | None, done: int, count: int
) -> Callable[[float], None] | None:
    """Progress of one of several runs, of which some are done."""
    return progress and (lambda share: progress((done + share) / count))


def chosen_pool(method: str, jobs: int, address: str | None = None) -> Pool:
    """Where the words are worked on. Raises InputError, and MachineError without Ray."""
    if address is not None:
        from elocute.jobs.ray_cluster import ray_pool

        return ray_pool(address, jobs)
    if jobs == 1 and method not in DEEP:
        return one_after_another
    from elocute.jobs.process_pool import local_pool

    return local_pool(jobs)


def propagate(
    settings: PropagationSettings,
    captured: dict[str, list[CapturedWord]],
    recordings: WordRecordings,
    pool: Pool = one_after_another,
    progress: Callable[[float], None] | None = None,
) -> PropagationSummary:
    """Transfer the parameters of captured words to every recording of the same words.

    Words that an earlier run in the same folder finished are kept.

    Parameters
    ----------
    settings
        Folders, method of alignment, and what decides which recordings are rejected.
    captured
        Words of the captured speakers (`captured_words`).
    recordings
        Recordings of many speakers (`find_recordings`).
    pool
        Where words are run: in this process, in several, or on a Ray cluster.
    progress
        Called with the share of the words that is done.

    Returns
    -------
    PropagationSummary

    Raises
    ------
    CorpusError
        Where the two sides share no word, or no recording could be used.
    OutputError
        Where another run is at work in the folder.

    References
    ----------
    Tzirakis et al. 2019, section 4.2.
    """
    folder = Path(settings.folder)
    if not set(captured) & set(recordings.words):
        raise CorpusError.about(
            recordings.folder,
            found=f"none of the captured words ({_some(captured)})",
            allowed="recordings of words that a captured speaker says",
        )
    digests = (
        file_sha256(Path(settings.corpus) / "corpus.json", CorpusError),
        file_sha256(Path(settings.basis), CorpusError),
    )
    settings = replace(settings, inputs=" ".join(digests))
    (folder / RECORDS).mkdir(exist_ok=True)
    with _locked(folder):
        summary = _run(settings, captured, recordings, pool, progress)
        _finish(settings, captured, recordings, summary)
    return summary


def all_tasks(
    settings: PropagationSettings,
    captured: dict[str, list[CapturedWord]],
    recordings: WordRecordings,
) -> Iterator[WordTask]:
    """A task for each word, captured or recorded; its recordings are listed only when it is due."""
    for word in sorted({*captured, *recordings.words}):
        listed, skipped = recordings.of(word) if word in recordings.words else ([], [])
        if not listed and not skipped and not settings.truth:
            continue
        yield WordTask(word, tuple(captured.get(word, ())), tuple(listed), tuple(skipped), settings)


def _run(
    settings: PropagationSettings,
    captured: dict[str, list[CapturedWord]],
    recordings: WordRecordings,
    pool: Pool,
    progress: Callable[[float], None] | None,
) -> PropagationSummary:
    summary = PropagationSummary(unheard=sorted(set(captured) - set(recordings.words)))
    total = len({*captured, *recordings.words})

    def left() -> Iterator[WordTask]:
        for task in all_tasks(settings, captured, recordings):
            if finished(task) is None:
                yield task
            else:
                summary.kept += 1

    for done, (task, outcome) in enumerate(pool(run_word, left()), 1):
        if isinstance(outcome, FailedTask):
            summary.failed.append((task.word, outcome.reason))
        if progress:
            progress(min(1.0, (done + summary.kept) / total))
    return summary


def finished(task: WordTask) -> WordResult | None:
    """The result of a task that is done and whose shard is whole, or None."""
    folder = Path(task.settings.folder)
    record = load_word_result(folder / RECORDS / f"{task.name}.json")
    if record is None or record.digest != task.digest:
        return None
    shard = record.shard
    if shard is not None:
        path = folder / shard.name
        if not path.is_file() or file_sha256(path, CorpusError) != shard.sha256:
            return None
    return record


def _finish(
    settings: PropagationSettings,
    captured: dict[str, list[CapturedWord]],
    recordings: WordRecordings,
    summary: PropagationSummary,
) -> None:
    """Gather the results, one in memory at a time, into rejects.csv and manifest.json."""
    folder = Path(settings.folder)
    entries: list[ShardEntry] = []
    with write_atomically(folder / REJECTS) as draft, draft.open("w", encoding="utf-8") as file:
        file.write(HEADER)
        for task in all_tasks(settings, captured, recordings):
            record = load_word_result(folder / RECORDS / f"{task.name}.json")
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
            found=f"no recording that parameters could be transferred to ({reason})",
            allowed="recordings of words that a captured speaker says",
        )
    note = f"parameters transferred by {settings.method}, seed {settings.seed}"
    write_manifest(folder, entries, load_motion(settings.basis), note)


@contextlib.contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """A lock on the folder, which ends with its process."""
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


def provide_basis(
    corpus: Corpus, folder: Path, given: Path | None = None, split: str = "default"
) -> Path:
    """Absolute path of the speech blendshapes in the output folder (Tzirakis et al. 2019, 3.3).

    given: a basis (.npz) to copy there; without one, what an earlier run left is kept, or one is
    learned from the training clips of `split`, all clips where the corpus lacks it. Raises
    CorpusError where the basis is of another mesh, or the split has no training clip.
    """
    path = (folder / BASIS).resolve()
    if given is not None:
        motion = load_motion(given)
        CapturedCorpus(corpus, motion)  # refuses another mesh
        save_motion(motion, path)
    elif not path.is_file():
        names = corpus.split(split).train if split in corpus.splits else tuple(corpus.by_name)
        if not names:
            raise CorpusError.about(corpus.folder, found=f"no clip in train of split {split}")
        save_motion(sweep_shapes(learn_blendshapes(corpus, names).head), path)
    return path
