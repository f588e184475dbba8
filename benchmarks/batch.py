"""Many lines in one run, killed on the way: how fast, and whether any is missing or made twice.

    python -m benchmarks.batch --lines 10000 --jobs 2

Lines are short cuts of the example, in several styles and moods, every tenth with an edit list.
The run is killed (SIGKILL, the driver and all its workers) when a third and when two thirds of the
files are there, and then run to its end. A file counts as made twice if it is another file (inode
or time) than at the kill before. A sample of the files is compared with those of a run of these
lines alone.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import soundfile

from elocute.audio.read import read_audio

RATE = 16000
LENGTHS_S = (0.5, 0.8)
CUTS = 400
STYLES, MOODS = ("", "calm", "broad", "mumble"), ("", "happy:0.5", "sad:0.4")
SAMPLE = 50
EDITS = {
    "elocute": "edits",
    "version": 1,
    "edits": [
        {"edit": "amplitude", "regions": {"jaw": 1.2, "brows": 0.5}},
        {"edit": "closed", "from": 0.2, "to": 0.3},
    ],
}


def main() -> None:
    """Make the lines, run them with two kills, and print what was found as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lines", type=int, default=10_000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--ray", help="local, or HOST:PORT")
    parser.add_argument("--sound", type=Path, default=Path("src/elocute/assets/example.flac"))
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        os.environ["ELOCUTE_STATE"] = str(folder / "state")
        table = make_lines(folder, given.sound, given.lines)
        command = [*("--jobs", str(given.jobs)), *(["--ray", given.ray] if given.ray else [])]
        print(json.dumps(measure(folder, table, given.lines, command), indent=1))


def make_lines(folder: Path, sound: Path, count: int) -> Path:
    """A table of `count` lines, and the sounds and the edit list that it names."""
    samples = read_audio(sound, sample_rate=RATE).samples
    drawn = np.random.default_rng(0)
    for number in range(min(CUTS, count)):
        length = int(drawn.uniform(*LENGTHS_S) * RATE)
        start = int(drawn.integers(0, len(samples) - length))
        soundfile.write(folder / f"{number}.wav", samples[start : start + length], RATE)
    (folder / "edits.json").write_text(json.dumps(EDITS))
    table = folder / "lines.csv"
    with table.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["id", "audio", "style", "mood", "edits"])
        for number in range(count):
            style, mood = STYLES[number % len(STYLES)], MOODS[number % len(MOODS)]
            edits = "edits.json" if number % 10 == 0 else ""
            rows.writerow([f"line{number:05d}", f"{number % CUTS}.wav", style, mood, edits])
    return table


def measure(folder: Path, table: Path, count: int, options: list[str]) -> dict[str, object]:
    """Run, kill, run, kill, run to the end, run again."""
    made = folder / "made"
    seen: dict[str, tuple[int, int]] = {}
    twice, kills, seconds = 0, [], 0.0
    for share in (1 / 3, 2 / 3, 2.0):
        started = time.perf_counter()
        code, told = run(table, made, options, stop_at=int(share * count))
        seconds += time.perf_counter() - started
        now = state_of(made)
        twice += sum(now.get(name) != facts for name, facts in seen.items())
        seen = now
        if code == -signal.SIGKILL:
            kills.append(len(now))
    started = time.perf_counter()
    _, again = run(table, made, options, stop_at=2 * count)
    again_s = time.perf_counter() - started
    now = state_of(made)
    twice += sum(now.get(name) != facts for name, facts in seen.items())
    wanted = {f"line{number:05d}.csv" for number in range(count)}
    return {
        "lines": count,
        "options": " ".join(options),
        "killed_at_files": kills,
        "exit": code,
        "missing": len(wanted - set(seen)),
        "strange": sorted(set(seen) - wanted)[:5],
        "made_twice": twice,
        "differing_of_sample": differing(folder, table, made, count),
        "left_over": sorted(p.name for p in made.iterdir() if not p.name.endswith(".csv"))[:5],
        "seconds": round(seconds, 1),
        "lines_per_s": round(count / seconds, 1),
        "again_s": round(again_s, 1),
        "told": told[-200:],
        "told_again": again[-200:],
    }


def run(table: Path, made: Path, options: list[str], *, stop_at: int) -> tuple[int, str]:
    """Run the table; killed once so many files are there. The exit code, and the last words."""
    words = [*("animate", "--table", str(table), "--format", "csv", "--fps", "30")]
    command = [sys.executable, "-m", "elocute", *words, "-o", str(made), *options]
    with tempfile.TemporaryFile("w+") as said:
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=said, start_new_session=True
        )
        while process.poll() is None:
            time.sleep(0.2)
            if len(state_of(made)) >= stop_at:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        time.sleep(1.0)  # workers of a cluster end after their driver
        said.seek(0)
        return process.returncode, said.read().strip()


def state_of(made: Path) -> dict[str, tuple[int, int]]:
    """Inode and time of each file that is there."""
    if not made.is_dir():
        return {}
    found = {}
    with os.scandir(made) as entries:
        for entry in entries:
            if entry.name.endswith(".csv") and not entry.name.startswith("."):
                facts = entry.stat()
                found[entry.name] = facts.st_ino, facts.st_mtime_ns
    return found


def differing(folder: Path, table: Path, made: Path, count: int) -> int:
    """How many of a sample are not, byte for byte, what a run of them alone makes."""
    rows = table.read_text().splitlines()
    chosen = range(0, count, max(1, count // SAMPLE))
    sample = folder / "sample.csv"
    sample.write_text("\n".join([rows[0], *(rows[1 + number] for number in chosen)]) + "\n")
    run(sample, folder / "alone", [], stop_at=2 * count)
    names = [f"line{number:05d}.csv" for number in chosen]
    return sum((folder / "alone" / n).read_bytes() != (made / n).read_bytes() for n in names)


if __name__ == "__main__":
    main()
