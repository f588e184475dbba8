"""A case read in this process, and judged. It is

escape   an exception outside the tree of `elocute.errors`
hang     more than 10 s of processor time, or 300 s of waiting, as a busy machine may make it
memory   more than 1 GB of it
crash    the end of the process by a signal
left     files left behind by a reader that raised
lines    an error whose message is not one line of at most 2,000 characters
warning  a warning of Python's on a user's screen
"""

from __future__ import annotations

import contextlib
import json
import resource
import shutil
import signal
import traceback
import warnings
from pathlib import Path
from typing import Any

from tests.fuzz.fuzzing.cases import Files, Reader, Seed, case
from tests.fuzz.fuzzing.forks import Tally

PROCESSOR_S, WAITING_S = 10, 300
MEMORY_BYTES = 1_000_000_000

LINE_MAX = 2000


class Desk:
    """Reads cases in this process and says what each did."""

    def __init__(self, reader: Reader, seeds: list[Seed], place: Path) -> None:
        self.reader, self.seeds, self.place = reader, seeds, place
        self.scratch = place / "out"
        self.folders: dict[int, Path] = {}
        self.warned: list[str] = []

    def judged(self, number: int, tally: Tally) -> list[dict[str, Any]]:
        """Findings of a case; its files are put back afterwards."""
        at, changed = case(self.reader, self.seeds, number)
        found = self.judged_files(at, changed)
        tally["read" if found[0] == "read" else "refused"] += 1
        findings = []
        for finding in found[1]:
            tally[finding["verdict"]] += 1
            size = sum(map(len, changed.values()))
            findings.append(
                {"reader": self.reader.name, "number": number, "bytes": size, **finding}
            )
        return findings

    def judged_files(self, at: int, changed: Files) -> tuple[str, list[dict[str, Any]]]:
        """ "read" or "refused", and what is wrong with it, for seed `at` with changed files."""
        from elocute.errors import ElocuteError

        folder = self.folder(at)
        for name, data in changed.items():
            (folder / name).write_bytes(data)
        self.scratch.mkdir()
        self.warned.clear()
        findings: list[dict[str, Any]] = []
        outcome, before, peak = "read", _resident(), _peak()
        signal.setitimer(signal.ITIMER_PROF, PROCESSOR_S)
        signal.setitimer(signal.ITIMER_REAL, WAITING_S)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("always")
                warnings.showwarning = self._warn
                self.reader.read(folder, self.scratch)
        except ElocuteError as error:
            outcome = "refused"
            message = str(error)
            if "\n" in message or "\r" in message or not message or len(message) > LINE_MAX:
                findings.append(_finding("lines", error, message[:500]))
            if _from_memory(error):
                findings.append(_finding("memory", error, message))
            if any(self.scratch.iterdir()):
                left = ", ".join(sorted(each.name for each in self.scratch.iterdir()))
                findings.append(_finding("left", error, f"{left} ({message})"))
        except BaseException as error:
            outcome = "refused"
            verdict = "memory" if _from_memory(error) else "escape"
            findings.append(_finding(verdict, error, str(error)[:500]))
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
            signal.setitimer(signal.ITIMER_REAL, 0)
        if _peak() > peak and _peak() - before > MEMORY_BYTES and not findings:
            grown = f"{(_peak() - before) / 1e9:.2f} GB"
            findings.append(
                {"verdict": "memory", "type": "peak", "where": "", "message": grown, "trace": ""}
            )
        for text in self.warned[:1]:
            findings.append(
                {
                    "verdict": "warning",
                    "type": "Warning",
                    "where": text.partition(" ")[0],
                    "message": text,
                    "trace": "",
                }
            )
        shutil.rmtree(self.scratch, ignore_errors=True)
        for name in changed:
            if name in self.seeds[at].files:
                (folder / name).write_bytes(self.seeds[at].files[name])
            else:
                (folder / name).unlink()
        return outcome, findings

    def folder(self, at: int) -> Path:
        if at not in self.folders:
            folder = self.folders[at] = self.place / f"seed{at}"
            for name, data in self.seeds[at].files.items():
                (folder / name).parent.mkdir(parents=True, exist_ok=True)
                (folder / name).write_bytes(data)
        return self.folders[at]

    def _warn(self, message: Any, category: Any, filename: str, lineno: int, *_: Any) -> None:
        where = "/".join(Path(filename).parts[-3:])
        self.warned.append(f"{where}:{lineno} {category.__name__}: {message}")


def _finding(verdict: str, error: BaseException, message: str) -> dict[str, Any]:
    frames = traceback.extract_tb(error.__traceback__)
    ours = [f for f in frames if "/elocute/" in f.filename] or frames
    where = f"{ours[-1].filename.rpartition('/elocute/')[2]}:{ours[-1].lineno}" if ours else ""
    trace = "".join(traceback.format_exception(error))
    return {
        "verdict": verdict,
        "type": type(error).__name__,
        "where": where,
        "message": message,
        "trace": trace[-4000:],
    }


def _from_memory(error: BaseException | None) -> bool:
    """Whether memory was refused somewhere behind an error: elsewhere it would have been taken."""
    for _ in range(20):
        if isinstance(error, MemoryError):
            frames = traceback.extract_tb(error.__traceback__)
            # Python's parser says so, too, where brackets are nested too deeply; and
            # FFmpeg says so of boxes whose size is none. Neither has taken any.
            named = type(error).__module__.startswith("av.")
            return not named and not (frames and frames[-1].filename.endswith("ast.py"))
        if error is None:
            return False
        error = error.__cause__ or error.__context__
    return False


def _resident() -> int:
    with open("/proc/self/statm") as file:  # noqa: PTH123, once a case
        return int(file.read().split()[1]) * resource.getpagesize()


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def keep_case(folder: Path, reader: Reader, seeds: list[Seed], finding: dict[str, Any]) -> None:
    """Write the case's files and what happened; of cases that fail alike, the smallest stays."""
    if finding["verdict"] == "warning":
        return
    alike = f"{finding['verdict']}-{finding['type']}-{finding['where'].replace('/', '.')}"
    place = folder / reader.name / alike.replace(":", "-")
    at, changed = case(reader, seeds, finding["number"])
    size = sum(map(len, changed.values()))
    with contextlib.suppress(OSError, ValueError, KeyError):
        if json.loads((place / "finding.json").read_text())["bytes"] <= size:
            return
    shutil.rmtree(place, ignore_errors=True)
    for name, data in (seeds[at].files | changed).items():
        (place / "files" / name).parent.mkdir(parents=True, exist_ok=True)
        (place / "files" / name).write_bytes(data)
    record = finding | {"bytes": size, "changed": sorted(changed), "seed": seeds[at].name}
    (place / "finding.json").write_text(json.dumps(record, indent=1))
