"""How fast parameters are carried over, on one core, and how much memory that takes.

    python -m recipes.build_words build/words --words 20
    python -m benchmarks.propagation build/words [--methods dtw,cca-soft]
    python -m benchmarks.propagation build/words --workers 1,2      on a machine that is idle

Times are CPU seconds of one thread, network and files included. `align` is what a further
recording of a known word costs; `fit` what a word costs once, and with every recording eight times.
Memory is the peak of a whole run over all words in one process, with so many copies of every
recording. --workers runs the whole job by cca-soft with so many processes: seconds of the clock.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

from elocute.capture.blendshapes.blendshape_learning import learn_blendshapes, sweep_shapes
from elocute.corpus.corpus_store import open_corpus
from elocute.motion.store import save_motion
from elocute.propagation import word_job
from elocute.propagation.captured_words import captured_words
from elocute.propagation.corpus_propagation import all_tasks, propagate
from elocute.propagation.settings import PropagationSettings
from elocute.propagation.word_recordings import WordRecordings, find_recordings

COPIES = (1, 8)


def settings_of(folder: Path, recordings: Path, room: Path, method: str) -> PropagationSettings:
    return PropagationSettings(
        corpus=str(folder / "captured"),
        basis=str(room / "basis.npz"),
        recordings=str(recordings),
        root=str(recordings.parent),
        folder=str(room),
        method=method,
        truth=False,
    )


def speed(folder: Path, room: Path, method: str, words: int) -> dict[str, float]:
    """Of the first words: seconds to fit one, and pairs aligned in a second."""
    captured = captured_words(open_corpus(folder / "captured"), folder / "captured_words")
    recordings = find_recordings(folder / "recordings")
    settings = settings_of(folder, folder / "recordings", room, method)
    (room / word_job.RECORDS).mkdir(exist_ok=True)
    capture = word_job._capture(settings.corpus, settings.basis)
    fitted = many = aligned = pairs = clips = 0.0
    for number, task in enumerate(all_tasks(settings, captured, recordings)):
        if number > words:
            break
        sources = word_job._sources(task, capture, [])
        started = time.process_time()
        aligner = word_job._fitted(task, sources)
        middle = time.process_time()
        assert aligner is not None
        for recording in task.recordings:
            word_job._aligned(task, recording, sources, aligner)
        done = time.process_time()
        word_job._fitted(replace(task, recordings=task.recordings * COPIES[-1]), sources)
        if number:  # the first word loads and compiles
            fitted += middle - started
            aligned += done - middle
            many += time.process_time() - done
            pairs += len(task.recordings) * len(sources)
            clips += len(task.recordings)
    return {
        "fit_s_per_word": round(fitted / words, 3),
        "fit_recordings": round(clips / words, 1),
        "fit_s_per_word_of_8_times_as_many": round(many / words, 3),
        "pairs_per_s": round(pairs / aligned, 1),
        "clips_per_s": round(clips / aligned, 1),
    }


def copied(folder: Path, room: Path, copies: int) -> WordRecordings:
    """Every recording so many times, as links, by speakers of other names."""
    for path in sorted((folder / "recordings").glob("*/*/*.wav")):
        place = room / path.parent.relative_to(folder / "recordings")
        place.mkdir(parents=True, exist_ok=True)
        for copy in range(copies):
            os.link(path, place / f"c{copy}-{path.name}")
    return find_recordings(room)


def run_once(folder: Path, room: Path) -> None:
    """In a process of its own: carry over and print its peak memory."""
    import resource

    captured = captured_words(open_corpus(folder / "captured"), folder / "captured_words")
    recordings = find_recordings(room / "recordings")
    summary = propagate(
        settings_of(folder, room / "recordings", room / "out", "dtw"), captured, recordings
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(json.dumps({"recordings": summary.aligned + summary.rejected, "peak_mb": round(peak, 1)}))


def memory(folder: Path, basis: Path) -> list[dict[str, float]]:
    found = []
    for copies in COPIES:
        with tempfile.TemporaryDirectory(dir=folder) as name:
            room = Path(name)
            copied(folder, room / "recordings", copies)
            (room / "out").mkdir()
            (room / "out" / "basis.npz").write_bytes(basis.read_bytes())
            call = [sys.executable, "-m", "benchmarks.propagation", str(folder)]
            call += ["--once", str(room)]
            done = subprocess.run(call, check=True, capture_output=True, text=True)
            found.append(json.loads(done.stdout.splitlines()[-1]))
    return found


def workers(folder: Path, basis: Path, counts: list[int]) -> dict[str, float]:
    """Seconds of the clock that the whole job takes by so many processes."""
    from elocute.jobs.process_pool import local_pool

    captured = captured_words(open_corpus(folder / "captured"), folder / "captured_words")
    found = {}
    for count in counts:
        with tempfile.TemporaryDirectory(dir=folder) as name:
            room = Path(name)
            (room / "basis.npz").write_bytes(basis.read_bytes())
            recordings = find_recordings(folder / "recordings")
            settings = settings_of(folder, folder / "recordings", room, "cca-soft")
            started = time.perf_counter()
            propagate(settings, captured, recordings, local_pool(count))
            found[str(count)] = round(time.perf_counter() - started, 1)
            print(json.dumps({"workers": found}), file=sys.stderr, flush=True)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path, help="what recipes.build_words made")
    parser.add_argument("--methods", default="dtw,cca-soft")
    parser.add_argument("--words", type=int, default=3, help="to measure speed on")
    parser.add_argument("--workers", help="numbers of processes, commas between: only that")
    parser.add_argument("--once", type=Path, help=argparse.SUPPRESS)
    choice = parser.parse_args()
    folder = choice.folder.resolve()
    if choice.once:
        run_once(folder, choice.once)
        return
    with tempfile.TemporaryDirectory() as name:
        room = Path(name)
        corpus = open_corpus(folder / "captured")
        learned = learn_blendshapes(corpus, corpus.split().train)
        save_motion(sweep_shapes(learned.head), room / "basis.npz")
        if choice.workers:
            print(workers(folder, room / "basis.npz", [int(n) for n in choice.workers.split(",")]))
            return
        record: dict[str, object] = {"components": len(learned.head.expression_names)}
        for method in choice.methods.split(","):
            record[method] = speed(folder, room, method, choice.words)
            print(json.dumps({method: record[method]}), file=sys.stderr, flush=True)
        record["memory"] = memory(folder, room / "basis.npz")
    print(json.dumps(record))


if __name__ == "__main__":
    main()
