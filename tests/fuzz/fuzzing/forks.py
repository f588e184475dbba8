"""Processes of their own, with limits, so that nothing a case does ends the fuzzing."""

from __future__ import annotations

import faulthandler
import json
import mmap
import os
import resource
import signal
import struct
import tempfile
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

ADDRESSES_BYTES = 3 * 2**30
VERDICTS = ("escape", "hang", "memory", "crash", "left", "lines", "warning")
FATAL = VERDICTS[:-1]
COUNTS = ("at", "done", "read", "refused", *VERDICTS)


def forked(job: Callable[[], object]) -> None:
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


class Tally:
    """Numbers that a process shares with the one that forked it: how far it is, and what it saw."""

    def __init__(self) -> None:
        self._shared = mmap.mmap(-1, 8 * len(COUNTS))

    def __getitem__(self, name: str) -> int:
        return struct.unpack_from("<q", self._shared, 8 * COUNTS.index(name))[0]

    def __setitem__(self, name: str, value: int) -> None:
        struct.pack_into("<q", self._shared, 8 * COUNTS.index(name), value)


def fast_folder() -> str | None:
    """Memory where it is a folder: cases are written and read by the thousand."""
    shared = Path("/dev/shm")
    return str(shared) if os.access(shared, os.W_OK) else None


def limit_process(trace: Path) -> None:
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


def where_of_dump(text: str) -> str:
    """The innermost line of ours in what faulthandler wrote."""
    for line in text.splitlines():
        if "/elocute/" in line and "line " in line:
            name, _, rest = line.rpartition("/elocute/")[2].partition('", line ')
            return f"{name}:{rest.split(' ')[0]}"
    return ""


def in_fork(job: Callable[[Path], dict[str, Any]]) -> dict[str, Any]:
    """What a job returns that runs under the limits of a case."""
    with tempfile.TemporaryDirectory(prefix="fuzz-", dir=fast_folder()) as place:
        answer, trace = Path(place) / "answer", Path(place) / "trace"
        child = os.fork()
        if not child:
            status = 1
            try:
                limit_process(trace)
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
                "where": where_of_dump(text),
                "message": "",
            }
        return json.loads(answer.read_text())
