"""Cases run and judged in processes of their own, so that nothing they do ends the fuzzing.

A server imports what readers need once, and forks a process for every batch of cases. A case is

    escape   an exception outside the tree of `elocute.errors`
    hang     more than 10 s of processor time, or 40 s of waiting
    memory   more than 1 GB of it
    crash    the end of the process by a signal
    left     files left behind by a reader that raised
    lines    an error whose message is not one line of at most 2,000 characters
    warning  a warning of Python's on a user's screen
"""

from __future__ import annotations

import contextlib
import faulthandler
import importlib
import json
import mmap
import os
import resource
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.fuzz.fuzzing.cases import Files, Reader, Seed, case, load_seeds

VERDICTS = ("escape", "hang", "memory", "crash", "left", "lines", "warning")
FATAL = ("escape", "hang", "memory", "crash", "left", "lines")
PROCESSOR_S, WAITING_S = 10, 40
MEMORY_BYTES = 1_000_000_000
ADDRESSES_BYTES = 3 * 2**30
LINE_MAX = 2000
KEPT = 400  # findings of a batch that are told in full
_COUNTS = ("at", "done", "read", "refused", *VERDICTS)


class Server:
    """A process that runs batches: `Server(work).run("identity", 0, 1000)`.

    work  a folder for seeds, and for cases that were found
    """

    def __init__(self, work: Path) -> None:
        work.mkdir(parents=True, exist_ok=True)
        root = Path(__file__).resolve().parents[3]
        paths = [str(root), str(root / "src"), os.environ.get("PYTHONPATH", "")]
        env = os.environ | {
            "PYTHONPATH": os.pathsep.join(filter(None, paths)),
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
            "PYTHONDONTWRITEBYTECODE": "1",
        }
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.fuzz.fuzzing.worker", str(work)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=env,
            text=True,
        )

    def run(
        self, reader: str, start: int, stop: int, seconds: float = 1e9, keep: str = ""
    ) -> dict[str, Any]:
        """Cases start to stop - 1, as far as the seconds reach. Counts by name, and `findings`.

        keep  a folder into which the files of every case that fails are written
        """
        return self._ask("run", reader, start, stop, seconds, keep)

    def check(self, reader: str) -> list[str]:
        """What is wrong with unchanged seeds: nothing, if they are any use."""
        return self._ask("check", reader)["problems"]

    def shrink(self, reader: str, number: int) -> dict[str, Any]:
        """The case cut down as far as it does the same: {"files": {name: hex}, "was": …}."""
        return self._ask("shrink", reader, number)

    def judge(self, reader: str, files: Files) -> dict[str, Any]:
        """What reading these files does: {"verdict": …, "type": …, "message": …}."""
        return self._ask("judge", reader, {name: data.hex() for name, data in files.items()})

    def close(self) -> None:
        assert self._process.stdin and self._process.stdout
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.close()
        self._process.wait(60)
        self._process.stdout.close()

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self, *request: Any) -> dict[str, Any]:
        assert self._process.stdin and self._process.stdout
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        answer = self._process.stdout.readline()
        if not answer:
            raise RuntimeError(f"the server of cases ended at {request[:4]}")
        answer = json.loads(answer)
        if "problem" in answer:
            raise RuntimeError(answer["problem"])
        return answer


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
        _forked(lambda: reader.seeds(draft))
        folder.parent.mkdir(exist_ok=True)
        draft.rename(folder)
    return folder


def _forked(job: Callable[[], object]) -> None:
    child = os.fork()
    if not child:
        try:
            job()
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
    if os.waitpid(child, 0)[1]:
        raise RuntimeError("a process of its own failed; its traceback is above")


class _Tally:
    """Numbers that a process shares with the one that forked it: how far it is, and what it saw."""

    def __init__(self) -> None:
        self._shared = mmap.mmap(-1, 8 * len(_COUNTS))

    def __getitem__(self, name: str) -> int:
        return struct.unpack_from("<q", self._shared, 8 * _COUNTS.index(name))[0]

    def __setitem__(self, name: str, value: int) -> None:
        struct.pack_into("<q", self._shared, 8 * _COUNTS.index(name), value)


def _run(
    reader: Reader, folder: Path, start: int, stop: int, seconds: float, keep: str
) -> dict[str, Any]:
    seeds = load_seeds(reader, folder)
    tally, findings = _Tally(), []
    deadline = time.monotonic() + seconds
    at = start
    while at < stop and time.monotonic() < deadline:
        died = _batch(reader, seeds, range(at, stop), deadline, tally, findings, keep)
        if died is None:
            break
        number, finding = died
        alone = _batch(reader, seeds, range(number, number + 1), deadline + 60, _Tally(), [], "")
        first = number if alone else _first(reader, seeds, at, number)
        finding |= {"alone": alone is not None, "first": first}
        tally[finding["verdict"]] += 1
        tally["done"] += 1
        findings.append(finding)
        if keep:
            _keep(Path(keep), reader, seeds, finding)
        at = number + 1
    return {
        **{name: tally[name] for name in _COUNTS[1:]},
        "findings": findings[:KEPT],
        "next": tally["at"] + 1 if tally["done"] else start,
    }


def _first(reader: Reader, seeds: list[Seed], start: int, number: int) -> int:
    """The case from which a process must come to end at `number`; found by halving."""
    width = 1
    while number - width > start:
        width *= 2
        begin = max(start, number - width)
        if _batch(
            reader, seeds, range(begin, number + 1), time.monotonic() + 120, _Tally(), [], ""
        ):
            return begin
    return start


def _batch(
    reader: Reader,
    seeds: list[Seed],
    numbers: range,
    deadline: float,
    tally: _Tally,
    findings: list[dict[str, Any]],
    keep: str,
) -> tuple[int, dict[str, Any]] | None:
    """Run cases in a fork; None, or the case at which it died and as what that counts."""
    with tempfile.TemporaryDirectory(prefix="fuzz-", dir=_fast_folder()) as place:
        told, trace = Path(place) / "told", Path(place) / "trace"
        told.touch()
        child = os.fork()
        if not child:
            status = 1
            try:
                _prepare(trace)
                desk = _Desk(reader, seeds, Path(place))
                with told.open("w") as out:
                    for number in numbers:
                        if time.monotonic() > deadline:
                            break
                        tally["at"] = number
                        for finding in desk.judged(number, tally):
                            out.write(json.dumps(finding) + "\n")
                            out.flush()
                            if keep:
                                _keep(Path(keep), reader, seeds, finding)
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
            "where": _where_of_dump(text),
            "message": "",
            "trace": text[-6000:],
        }


def _fast_folder() -> str | None:
    """Memory where it is a folder: cases are written and read by the thousand."""
    shared = Path("/dev/shm")
    return str(shared) if os.access(shared, os.W_OK) else None


def _prepare(trace: Path) -> None:
    """Limits of a forked process; what it prints goes nowhere."""
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (0, 1, 2):
        os.dup2(nowhere, stream)
    file = trace.open("w")
    faulthandler.enable(file)
    for number in (signal.SIGPROF, signal.SIGALRM):
        signal.signal(number, signal.SIG_DFL)
        faulthandler.register(number, file, all_threads=False, chain=True)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + ADDRESSES_BYTES
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    tempfile.tempdir = None


class _Desk:
    """Reads cases in this process and says what each did."""

    def __init__(self, reader: Reader, seeds: list[Seed], place: Path) -> None:
        self.reader, self.seeds, self.place = reader, seeds, place
        self.scratch = place / "out"
        self.folders: dict[int, Path] = {}
        self.warned: list[str] = []

    def judged(self, number: int, tally: _Tally) -> list[dict[str, Any]]:
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

        folder = self._folder(at)
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

    def _folder(self, at: int) -> Path:
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


def _where_of_dump(text: str) -> str:
    """The innermost line of ours in what faulthandler wrote."""
    for line in text.splitlines():
        if "/elocute/" in line and "line " in line:
            name, _, rest = line.rpartition("/elocute/")[2].partition('", line ')
            return f"{name}:{rest.split(' ')[0]}"
    return ""


def _resident() -> int:
    with open("/proc/self/statm") as file:  # noqa: PTH123, once a case
        return int(file.read().split()[1]) * resource.getpagesize()


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _keep(folder: Path, reader: Reader, seeds: list[Seed], finding: dict[str, Any]) -> None:
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


def _in_fork(job: Callable[[Path], dict[str, Any]]) -> dict[str, Any]:
    """What a job returns that runs under the limits of a case."""
    with tempfile.TemporaryDirectory(prefix="fuzz-", dir=_fast_folder()) as place:
        answer, trace = Path(place) / "answer", Path(place) / "trace"
        child = os.fork()
        if not child:
            status = 1
            try:
                _prepare(trace)
                answer.write_text(json.dumps(job(Path(place))))
                status = 0
            except BaseException:
                trace.write_text(traceback.format_exc())
            finally:
                os._exit(status)
        status = os.waitpid(child, 0)[1]
        if status:
            text = trace.read_text(errors="replace") if trace.is_file() else ""
            ended = signal.Signals(os.WTERMSIG(status)).name if os.WIFSIGNALED(status) else "failed"
            verdict = {"SIGPROF": "hang", "SIGALRM": "hang", "SIGKILL": "memory"}
            return {
                "verdict": verdict.get(ended, "crash"),
                "type": ended,
                "trace": text,
                "where": _where_of_dump(text),
                "message": "",
            }
        return json.loads(answer.read_text())


def _check(reader: Reader, folder: Path) -> dict[str, Any]:
    """Every seed as it is must be read without a word."""
    seeds = load_seeds(reader, folder)

    def job(place: Path) -> dict[str, Any]:
        desk, problems = _Desk(reader, seeds, place), []
        for at, seed in enumerate(seeds):
            outcome, findings = desk.judged_files(at, {})
            if outcome != "read" or findings:
                why = findings[0] if findings else "refused"
                problems.append(f"seed {seed.name}: {why}")
                if outcome == "refused" and not findings:
                    with contextlib.suppress(Exception):
                        reader.read(desk._folder(at), place)
        return {"problems": problems}

    return _in_fork(job)


def _judge_files(reader: Reader, folder: Path, files: dict[str, str]) -> dict[str, Any]:
    """Files given in full, each over the first seed that has one of that name."""
    changed = {name: bytes.fromhex(data) for name, data in files.items()}
    seeds = load_seeds(reader, folder)
    at = next((i for i, s in enumerate(seeds) if set(changed) <= set(s.files)), 0)

    def job(place: Path) -> dict[str, Any]:
        outcome, findings = _Desk(reader, seeds, place).judged_files(at, changed)
        return findings[0] if findings else {"verdict": outcome, "type": "", "message": ""}

    return _in_fork(job)


def _shrink(reader: Reader, folder: Path, number: int) -> dict[str, Any]:
    """Pieces of the changed files are left out as long as the case fails as before."""
    seeds = load_seeds(reader, folder)
    at, changed = case(reader, seeds, number)

    def job(place: Path) -> dict[str, Any]:
        desk = _Desk(reader, seeds, place)

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

    return _in_fork(job)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
