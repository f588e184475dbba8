"""A study's server under load, and killed under load.

    python -m benchmarks.study_load STUDY                200 people at once
    python -m benchmarks.study_load STUDY --kills 200    kill -9 at random moments, 200 times

STUDY is a folder that `elocute study new` made, of short clips, with `[watching] share` small:
people here answer as soon as the server lets them. Reported: times of answers that the server
acknowledged, and whether each of them is in the table, once and as it was sent.
"""

from __future__ import annotations

import argparse
import http.client
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from elocute.study.design.design_file import read_design
from elocute.study.serving.store import Store
from elocute.study.stimuli.manifest import open_study


@dataclass
class Found:
    """What a run found.

    Attributes
    ----------
    acknowledged : int
        Answers that the server said to have stored.
    lost, twice, changed : int
        Of these, not in the table; there more than once; there as another answer.
    times_s : list of float
        From sending an answer to its acknowledgement.
    seconds : float
        The whole run.
    """

    acknowledged: int = 0
    lost: int = 0
    twice: int = 0
    changed: int = 0
    times_s: list[float] = field(default_factory=list)
    seconds: float = 0.0


class _Person(threading.Thread):
    """Answers trial after trial, thinking for a random while, until stopped or done."""

    def __init__(self, host: str, seed: int, think_s: float, stop: threading.Event) -> None:
        super().__init__(daemon=True)
        self.host, self.think_s, self.stop = host, think_s, stop
        self.random = random.Random(seed)
        self.token = ""
        self.sent: dict[int, str] = {}
        """Acknowledged answers, by order."""
        self.times_s: list[float] = []
        self.failed = ""

    def ask(self, connection: http.client.HTTPConnection, path: str, body: Any) -> tuple[int, Any]:
        fields = {"Content-Type": "application/json", "Authorization": f"Bearer {self.token}"}
        connection.request("POST", path, json.dumps(body), fields)
        answer = connection.getresponse()
        return answer.status, json.loads(answer.read())

    def run(self) -> None:
        connection = http.client.HTTPConnection(self.host, timeout=60)
        try:
            self.take_part(connection)
        except (OSError, http.client.HTTPException, ValueError) as error:
            self.failed = f"{type(error).__name__}: {error}"
        finally:
            connection.close()

    def take_part(self, connection: http.client.HTTPConnection) -> None:
        status, joined = self.ask(connection, "/api/join", {"language": "en"})
        if status != 201:
            self.failed = str(joined)
            return
        self.token = joined["token"]
        _, step = self.ask(connection, "/api/checks", {"width": 1000})
        while step["state"] == "trial" and not self.stop.is_set():
            self.stop.wait(self.random.uniform(0.5, 1.5) * self.think_s)
            trial = step["trial"]
            side = self.random.choice(("left", "right"))
            body = {"order": trial["order"], "answer": side, "seconds": 0.1, "replays": 0}
            begun = time.perf_counter()
            status, answer = self.ask(connection, "/api/answer", body)
            if status == 200:
                self.times_s.append(time.perf_counter() - begun)
                self.sent[trial["order"]] = side
                step = answer
            elif status not in (425, 429):
                self.failed = f"{status} {answer}"
                return


def _server(study: Path, database: Path, port: int = 0) -> tuple[subprocess.Popen[str], str]:
    known = {k: v for k, v in os.environ.items() if not k.startswith("COVERAGE_")}
    running = subprocess.Popen(
        [
            *(sys.executable, "-m", "elocute", "study", "serve", str(study)),
            *("--port", str(port), "--database", f"sqlite:///{database}", "--joins", "100000"),
        ],
        stdout=subprocess.PIPE,
        text=True,
        env=known | {"OMP_NUM_THREADS": "1"},
    )
    assert running.stdout is not None
    line = running.stdout.readline()
    if "http://" not in line:
        raise SystemExit(f"no server: {line}")
    return running, line.split("http://")[1].split("/")[0]


def _compared(study: Path, database: Path, people: list[_Person]) -> Found:
    """What was acknowledged, against the table."""
    store = Store(open_study(study).design, database)
    try:
        rows = store.answers()
        tokens = {each.token: store.person(each.token) for each in people if each.token}
    finally:
        store.close()
    found = Found()
    stored: dict[tuple[str, int], list[str]] = {}
    for row in rows:
        side = "left" if row.answer == row.left else "right"
        stored.setdefault((row.participant, row.order), []).append(side)
    for each in people:
        found.times_s += each.times_s
        person = tokens.get(each.token)
        for order, side in each.sent.items():
            found.acknowledged += 1
            there = stored.get((person.id, order), []) if person else []
            found.lost += not there
            found.twice += len(there) > 1
            found.changed += bool(there) and there[0] != side
    return found


def under_load(study: Path, database: Path, people: int, think_s: float) -> Found:
    """Many people at once, from beginning to end.

    Parameters
    ----------
    study, database : Path
        The study's folder, and a file for its answers.
    people : int
        How many.
    think_s : float
        Between an answer and the next, on average.

    Returns
    -------
    Found
    """
    running, host = _server(study, database)
    stop = threading.Event()
    crowd = [_Person(host, seed, think_s, stop) for seed in range(people)]
    begun = time.perf_counter()
    try:
        for each in crowd:
            each.start()
        for each in crowd:
            each.join()
    finally:
        running.send_signal(signal.SIGTERM)
        running.communicate(timeout=30)
    failed = [each.failed for each in crowd if each.failed]
    if failed:
        raise SystemExit(f"{len(failed)} failed: {failed[0]}")
    seconds = time.perf_counter() - begun
    found = _compared(study, database, crowd)
    found.seconds = seconds
    return found


def kill_under_load(
    study: Path, database: Path, *, people: int, after_s: float, seed: int
) -> Found:
    """Kill the server while people answer, and look what is in the table.

    Parameters
    ----------
    study, database : Path
        The study's folder, and a file for its answers.
    people : int
        How many.
    after_s : float
        When, after they began.
    seed : int
        Of what they answer.

    Returns
    -------
    Found
    """
    running, host = _server(study, database)
    stop = threading.Event()
    crowd = [_Person(host, seed * 10_000 + n, 0.01, stop) for n in range(people)]
    try:
        for each in crowd:
            each.start()
        deadline = time.monotonic() + 30
        while not any(each.sent for each in crowd) and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(after_s)
    finally:
        running.kill()
        running.communicate(timeout=30)
        stop.set()
        for each in crowd:
            each.join(timeout=30)
    return _compared(study, database, crowd)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("study", type=Path)
    parser.add_argument("--people", type=int, default=200)
    parser.add_argument("--think", type=float, default=5.0, help="seconds from answer to answer")
    parser.add_argument("--kills", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    choice = parser.parse_args()
    kind = read_design(choice.study).study.kind
    if kind != "binary":
        parser.error(f"a study of kind {kind}; binary is needed")
    with tempfile.TemporaryDirectory() as folder:
        if choice.kills:
            _kill_often(choice.study, Path(folder), choice.kills, choice.seed)
            return
        found = under_load(choice.study, Path(folder) / "answers.db", choice.people, choice.think)
    times = sorted(found.times_s)
    shares = {share: times[int(share * (len(times) - 1))] * 1000 for share in (0.5, 0.95, 0.99, 1)}
    rate = found.acknowledged / found.seconds
    print(f"{choice.people} people, {found.acknowledged} answers, {rate:.0f} a second")
    print("ms", {f"p{share * 100:g}": round(value, 1) for share, value in shares.items()})
    print(f"lost {found.lost}, twice {found.twice}, changed {found.changed}")


def _kill_often(study: Path, folder: Path, kills: int, seed: int) -> None:
    rng = random.Random(seed)
    total = Found()
    for number in range(kills):
        database = folder / f"{number}.db"
        found = kill_under_load(
            study, database, people=20, after_s=rng.uniform(0, 1.0), seed=seed + number
        )
        for name in ("acknowledged", "lost", "twice", "changed"):
            setattr(total, name, getattr(total, name) + getattr(found, name))
        for path in folder.glob(f"{number}.db*"):
            path.unlink()
        if (number + 1) % 10 == 0:
            print(
                f"{number + 1} kills: {total.acknowledged} acknowledged, lost {total.lost}",
                flush=True,
            )
    print(
        f"{kills} kills, {total.acknowledged} answers acknowledged: lost {total.lost}, "
        f"twice {total.twice}, changed {total.changed}"
    )


if __name__ == "__main__":
    main()
