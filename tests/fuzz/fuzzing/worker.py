"""Cases run and judged in processes of their own, so that nothing they do ends the fuzzing.

A server imports what readers need once, and forks a process for every batch of cases.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.fuzz.fuzzing.cases import Files, Reader, Seed, case, load_seeds
from tests.fuzz.fuzzing.forks import (
    COUNTS,
    Tally,
    fast_folder,
    forked,
    in_fork,
    limit_process,
    where_of_dump,
)
from tests.fuzz.fuzzing.judging import Desk, keep_case

KEPT = 400  # findings of a batch that are told in full


def serve(work: Path) -> None:
    """Answer requests until there are no more. The readers are imported here, once."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    handlers: dict[str, Callable[..., Any]] = {
        "run": _run,
        "check": _check,
        "shrink": _shrink,
        "judge": _judge_files,
    }
    from tests.fuzz.fuzzing.commands import COMMANDS
    from tests.fuzz.fuzzing.readers import READERS

    by_name = {reader.name: reader for reader in (*READERS, *COMMANDS)}
    for line in sys.stdin:
        what, name, *rest = json.loads(line)
        try:
            reader = by_name[name]
            for module in reader.modules:
                importlib.import_module(module)
            answer = handlers[what](reader, _seeds_folder(reader, work), *rest)
        except Exception:
            answer = {"problem": traceback.format_exc()}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


def _seeds_folder(reader: Reader, work: Path) -> Path:
    """Where the seeds of a reader are; made in a process of its own, as encoders start threads."""
    folder = work / "seeds" / reader.name
    if not folder.is_dir():
        draft = Path(tempfile.mkdtemp(dir=work, prefix="seeds-"))
        forked(lambda: reader.seeds(draft))
        folder.parent.mkdir(exist_ok=True)
        draft.rename(folder)
    return folder


def _run(
    reader: Reader, folder: Path, start: int, stop: int, seconds: float, keep: str
) -> dict[str, Any]:
    seeds = load_seeds(reader, folder)
    tally, findings = Tally(), []
    deadline = time.monotonic() + seconds
    at = start
    while at < stop and time.monotonic() < deadline:
        died = _batch(reader, seeds, range(at, stop), deadline, tally, findings, keep)
        if died is None:
            break
        number, finding = died
        alone = _batch(reader, seeds, range(number, number + 1), deadline + 60, Tally(), [], "")
        first = number if alone else _first(reader, seeds, at, number)
        finding |= {"alone": alone is not None, "first": first}
        tally[finding["verdict"]] += 1
        tally["done"] += 1
        findings.append(finding)
        if keep:
            keep_case(Path(keep), reader, seeds, finding)
        at = number + 1
    return {
        **{name: tally[name] for name in COUNTS[1:]},
        "findings": findings[:KEPT],
        "next": tally["at"] + 1 if tally["done"] else start,
    }


def _first(reader: Reader, seeds: list[Seed], start: int, number: int) -> int:
    """The case from which a process must come to end at `number`; found by halving."""
    width = 1
    while number - width > start:
        width *= 2
        begin = max(start, number - width)
        if _batch(reader, seeds, range(begin, number + 1), time.monotonic() + 120, Tally(), [], ""):
            return begin
    return start


def _batch(
    reader: Reader,
    seeds: list[Seed],
    numbers: range,
    deadline: float,
    tally: Tally,
    findings: list[dict[str, Any]],
    keep: str,
) -> tuple[int, dict[str, Any]] | None:
    """Run cases in a fork; None, or the case at which it died and as what that counts."""
    with tempfile.TemporaryDirectory(prefix="fuzz-", dir=fast_folder()) as place:
        told, trace = Path(place) / "told", Path(place) / "trace"
        told.touch()
        child = os.fork()
        if not child:
            status = 1
            try:
                limit_process(trace)
                desk = Desk(reader, seeds, Path(place))
                with told.open("w") as out:
                    for number in numbers:
                        if time.monotonic() > deadline:
                            break
                        tally["at"] = number
                        for finding in desk.judged(number, tally):
                            out.write(json.dumps(finding) + "\n")
                            out.flush()
                            if keep:
                                keep_case(Path(keep), reader, seeds, finding)
                        tally["done"] += 1
                status = 0
            except BaseException:
                trace.write_text(traceback.format_exc())
            finally:
                os._exit(status)
        status = os.waitpid(child, 0)[1]
        findings += map(json.loads, told.read_text().splitlines())
        if not status:
            return None
        text = trace.read_text(errors="replace") if trace.is_file() else ""
        if os.WIFEXITED(status):
            raise RuntimeError(f"{reader.name} case {tally['at']}: the worker failed\n{text}")
        ended = signal.Signals(os.WTERMSIG(status)).name
        verdict = {"SIGPROF": "hang", "SIGALRM": "hang", "SIGKILL": "memory"}.get(ended, "crash")
        return tally["at"], {
            "reader": reader.name,
            "number": tally["at"],
            "verdict": verdict,
            "type": ended,
            "where": where_of_dump(text),
            "message": "",
            "trace": text[-6000:],
        }


def _check(reader: Reader, folder: Path) -> dict[str, Any]:
    """Every seed as it is must be read without a word."""
    seeds = load_seeds(reader, folder)

    def job(place: Path) -> dict[str, Any]:
        desk, problems = Desk(reader, seeds, place), []
        for at, seed in enumerate(seeds):
            outcome, findings = desk.judged_files(at, {})
            if outcome != "read" or findings:
                why = findings[0] if findings else "refused"
                problems.append(f"seed {seed.name}: {why}")
                if outcome == "refused" and not findings:
                    with contextlib.suppress(Exception):
                        reader.read(desk.folder(at), place)
        return {"problems": problems}

    return in_fork(job)


def _judge_files(reader: Reader, folder: Path, files: dict[str, str]) -> dict[str, Any]:
    """Files given in full, each over the first seed that has one of that name."""
    changed = {name: bytes.fromhex(data) for name, data in files.items()}
    seeds = load_seeds(reader, folder)
    at = next((i for i, s in enumerate(seeds) if set(changed) <= set(s.files)), 0)

    def job(place: Path) -> dict[str, Any]:
        outcome, findings = Desk(reader, seeds, place).judged_files(at, changed)
        return findings[0] if findings else {"verdict": outcome, "type": "", "message": ""}

    return in_fork(job)


def _shrink(reader: Reader, folder: Path, number: int) -> dict[str, Any]:
    """Pieces of the changed files are left out as long as the case fails as before."""
    seeds = load_seeds(reader, folder)
    at, changed = case(reader, seeds, number)

    def job(place: Path) -> dict[str, Any]:
        desk = Desk(reader, seeds, place)

        def fails(files: Files) -> tuple[str, ...]:
            findings = desk.judged_files(at, files)[1]
            return (
                tuple(findings[0][key] for key in ("verdict", "type", "where")) if findings else ()
            )

        wanted, best, deadline = fails(changed), dict(changed), time.monotonic() + 8
        for name in list(best):
            less = {other: data for other, data in best.items() if other != name}
            if less and fails(less) == wanted:
                best = less
        for name in best:
            width = len(best[name]) // 2
            while width and wanted:
                start = 0
                while start < len(best[name]) and time.monotonic() < deadline:
                    signal.setitimer(signal.ITIMER_PROF, 0)
                    shorter = best[name][:start] + best[name][start + width :]
                    if fails(best | {name: shorter}) == wanted:
                        best[name] = shorter
                    else:
                        start += width
                width //= 2
        return {"files": {name: data.hex() for name, data in best.items()}, "was": list(wanted)}

    return in_fork(job)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
