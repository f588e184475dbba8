"""Millions of mutated files through every reader: escapes, hangs, memory and crashes, counted.

    python -m benchmarks.fuzz --cases 1000000 --jobs 2 -o report.json
    python -m benchmarks.fuzz --reader motion --reader head --seconds 60 -o report.json
    python -m benchmarks.fuzz --show motion 4711     # what one case does, cut down
    python -m benchmarks.fuzz --guided motion --seconds 600     # by coverage, where Atheris is

A case is a number: the same everywhere. The report says for every reader from where the next run
goes on, so a run that was broken off, or a later one with more cases, repeats nothing. The files
of the smallest case of every kind that failed are kept in the folder beside the report.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib
import json
import queue
import sys
import tempfile
import threading
import time
from pathlib import Path
from random import Random
from typing import Any

from tests.fuzz.fuzzing.commands import COMMANDS
from tests.fuzz.fuzzing.forks import FATAL, VERDICTS
from tests.fuzz.fuzzing.readers import usable
from tests.fuzz.fuzzing.server import Server

BATCH_S = 20.0
COLUMNS = ("done", "read", "refused", *VERDICTS, "seconds")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--cases", type=int, default=10_000, help="of each reader, in all")
    parser.add_argument("--seconds", type=float, default=1e9, help="of each reader, in this run")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--reader", action="append", default=[], help="all, if none is named")
    parser.add_argument("--commands", action="store_true", help="through the command line, too")
    parser.add_argument("-o", "--output", type=Path, default=Path("fuzz.json"))
    parser.add_argument("--show", nargs=2, metavar=("READER", "CASE"))
    parser.add_argument("--guided", metavar="READER")
    given = parser.parse_args()
    work = given.output.with_suffix("")
    if given.show:
        show(work, given.show[0], int(given.show[1]))
        return
    if given.guided:
        guided(work, given.guided, given.seconds)
        return
    names = given.reader or [reader.name for reader in usable()]
    names += [reader.name for reader in COMMANDS] if given.commands else []
    report = json.loads(given.output.read_text()) if given.output.is_file() else {}
    Run(work, report, given).through(names)
    print(table(report, names))
    sys.exit(any(report[name][verdict] for name in names for verdict in FATAL))


class Run:
    """Readers one after another by each job, their rows written as they grow."""

    def __init__(self, work: Path, report: dict[str, Any], given: argparse.Namespace) -> None:
        self.work, self.report, self.given = work, report, given
        self.lock = threading.Lock()

    def through(self, names: list[str]) -> None:
        waiting: queue.SimpleQueue[str] = queue.SimpleQueue()
        for name in names:
            self.report.setdefault(name, {"next": 0, "kinds": {}, **dict.fromkeys(COLUMNS, 0)})
            waiting.put(name)
        jobs = [threading.Thread(target=self._job, args=(waiting,)) for _ in range(self.given.jobs)]
        for job in jobs:
            job.start()
        for job in jobs:
            job.join()

    def _job(self, waiting: queue.SimpleQueue[str]) -> None:
        with Server(self.work) as server:
            while True:
                try:
                    name = waiting.get_nowait()
                except queue.Empty:
                    return
                self._reader(server, name)

    def _reader(self, server: Server, name: str) -> None:
        row = self.report[name]
        started = time.monotonic()
        while row["next"] < self.given.cases:
            left = self.given.seconds - (time.monotonic() - started)
            if left <= 0:
                return
            begun = time.monotonic()
            result = server.run(
                name, row["next"], self.given.cases, min(BATCH_S, left), str(self.work / "found")
            )
            with self.lock:
                row["seconds"] = round(row["seconds"] + time.monotonic() - begun, 1)
                row["next"] = result["next"]
                for column in ("done", "read", "refused", *VERDICTS):
                    row[column] += result[column]
                for finding in result["findings"]:
                    kind = " ".join((finding["verdict"], finding["type"], finding["where"]))
                    known = row["kinds"].setdefault(kind, {"count": 0, "case": finding["number"]})
                    known["count"] += 1
                    known.setdefault("message", finding["message"][:300])
                self.given.output.write_text(json.dumps(self.report, indent=1))
            faults = sum(row[verdict] for verdict in FATAL)
            print(f"{name}: {row['next']} cases, {faults} faults", file=sys.stderr, flush=True)
            if not result["done"]:
                return


def table(report: dict[str, Any], names: list[str]) -> str:
    """Markdown: reader, cases, and what was found."""
    heads = ("reader", "cases", "refused", *VERDICTS, "cases/s")
    lines = ["| " + " | ".join(heads) + " |", "|---" + "|---:" * (len(heads) - 1) + "|"]
    rows = [(name, report[name]) for name in names]
    rows.append(("all", {c: sum(row[c] for _, row in rows) for c in COLUMNS}))
    for name, row in rows:
        rate = row["done"] / row["seconds"] if row["seconds"] else 0
        shown = [f"{row[c]:,}" for c in ("done", "refused", *VERDICTS)]
        lines.append("| " + " | ".join((name, *shown, f"{rate:,.0f}")) + " |")
    return "\n".join(lines)


def show(work: Path, name: str, number: int) -> None:
    """What a case does: its traceback, and the shortest bytes that do the same."""
    with Server(work) as server:
        result = server.run(name, number, number + 1)
        for finding in result["findings"]:
            print(finding["verdict"], finding["type"], finding["where"], finding["message"])
            print(finding["trace"])
        if not result["findings"]:
            print("read" if result["read"] else "refused, as it should be")
        elif result["findings"][0]["verdict"] not in ("hang", "crash"):
            for file, data in server.shrink(name, number).get("files", {}).items():
                print(file, repr(bytes.fromhex(data)))


def guided(work: Path, name: str, seconds: float) -> None:
    """Atheris chooses what to mutate further by the lines of ours that it reached."""
    try:
        atheris: Any = importlib.import_module("atheris")
    except ImportError:
        sys.exit("--guided needs Atheris: pip install atheris")
    with Server(work) as server:
        server.check(name)  # makes the seeds
    with atheris.instrument_imports(include=["elocute"]):
        import elocute.files.array_reading
        import elocute.files.json_records  # noqa: F401
        from tests.fuzz.fuzzing.readers import READERS
    from elocute.errors import ElocuteError
    from tests.fuzz.fuzzing.cases import load_seeds
    from tests.fuzz.fuzzing.mutations import mutate

    reader = next(reader for reader in READERS if reader.name == name)
    with atheris.instrument_imports(include=["elocute"]):
        for module in reader.modules:
            importlib.import_module(module)
    seed = load_seeds(reader, work / "seeds" / name)[0]
    file, kind = next(iter(seed.kinds.items()))
    place = Path(tempfile.mkdtemp(prefix="guided-"))
    for other, data in seed.files.items():
        (place / other).parent.mkdir(parents=True, exist_ok=True)
        (place / other).write_bytes(data)
    corpus = place.parent / f"{place.name}-corpus"
    corpus.mkdir()
    (corpus / "seed").write_bytes(seed.files[file])

    def one(data: bytes) -> None:
        (place / file).write_bytes(data)
        with tempfile.TemporaryDirectory() as out, contextlib.suppress(ElocuteError):
            reader.read(place, Path(out))

    def change(data: bytes, most: int, number: int) -> bytes:
        return mutate(Random(number), data, kind, (seed.files[file],))[:most]

    limits = [f"-max_total_time={min(int(seconds), 10**6)}", "-timeout=10", "-rss_limit_mb=3000"]
    atheris.Setup(
        [sys.argv[0], *limits, "-max_len=1000000", str(corpus)], one, custom_mutator=change
    )
    atheris.Fuzz()


if __name__ == "__main__":
    main()
