"""The process that runs cases, asked by lines of JSON."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.fuzz.fuzzing.cases import Files


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
        self._process.wait(300)
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
