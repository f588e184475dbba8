"""The whole of `elocute propagate` on real voices: what comes out, what is killed, what is bad."""

from __future__ import annotations

import csv
import json
import os
import re
import shutil
import signal
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import soundfile

from elocute.corpus.corpus_store import open_corpus
from elocute.corpus.shards import Shards, open_shards
from tests.support.commands import one_line, python, run_here, run_python

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
WORDS = ("one", "three", "two", "zero")


def command(wild: Path, output: Path, *more: str) -> list[str]:
    return [
        "propagate",
        str(wild / "captured"),
        str(wild / "recordings"),
        "-o",
        str(output),
        "--words",
        str(wild / "captured_words"),
        "--root",
        str(wild),
        "--method",
        "dtw",
        "--json",
        *more,
    ]


def call(wild: Path, output: Path, *more: str, exits: int = 0) -> dict:
    result = run_here(*command(wild, output, *more))
    assert result.returncode == exits, result
    return json.loads(result.stdout.splitlines()[0])


def rows_once(output: Path, wild: Path) -> Shards:
    """The shards, every recording and every captured word in them exactly once."""
    shards = open_shards(output, wild)
    names = [clip.clip for clip in shards.clips()]
    audio = [clip.audio for clip in shards.clips() if clip.audio.startswith("recordings/")]
    there = [p.relative_to(wild).as_posix() for p in sorted(wild.glob("recordings/*/*/*.wav"))]
    assert len(set(names)) == len(names) and sorted(audio) == there and not shards.broken
    return shards


@pytest.fixture(scope="module")
def whole(wild: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    output = tmp_path_factory.mktemp("shards") / "out"
    told = call(wild, output)
    assert (told["words"], told["captured"], told["rejected"], told["failed"]) == (4, 12, 0, [])
    return output


def test_shards_hold_what_was_captured_and_what_was_carried_over(wild: Path, whole: Path):
    shards, corpus = rows_once(whole, wild), open_corpus(wild / "captured")
    assert (whole / "rejects.csv").read_text() == "word,audio,reason\n"
    clips = {clip.clip: clip for clip in shards.clips()}
    for clip in clips.values():
        heard = shards.sound(clip)
        assert abs(len(clip) / clip.fps - heard.duration_s) <= 0.5 / clip.fps + 1e-3
        assert clip.source in ("calm", "crisp", "pouting")
    carried_from = {clip.source for clip in clips.values() if clip.speaker != clip.source}
    assert carried_from and "pouting" not in carried_from, (
        "a test speaker's motion was carried over"
    )
    truth = clips["crisp.r000.000"]
    frames = np.arange(len(truth)) + truth.start_s * corpus.fps
    shapes = shards.basis.head.expression_basis.reshape(shards.components, -1)
    moved = corpus.displacements("crisp.r000").reshape(-1, shapes.shape[1])
    near = moved[np.round(frames).astype(int)]
    error = np.abs(truth.parameters @ shapes - near).mean()
    assert error < 0.25 * np.abs(near).mean()


def test_carried_motion_is_that_of_the_word(wild: Path, whole: Path):
    """Over its length, a recording moves as its source does in that word, not in another."""
    shards = open_shards(whole, wild)
    shapes = shards.basis.head.expression_basis.reshape(shards.components, -1)
    scale = np.linalg.norm(shapes, axis=1)

    def course(clip) -> np.ndarray:
        places = np.linspace(0, len(clip) - 1, 12).round().astype(int)
        return clip.parameters[places] * scale

    clips = list(shards.clips())
    captured = {(c.speaker, c.word): course(c) for c in clips if c.speaker == c.source}
    right = [
        min(WORDS, key=lambda w: np.linalg.norm(course(c) - captured[c.source, w])) == c.word
        for c in clips
        if c.speaker != c.source
    ]
    assert np.mean(right) > 0.8


def test_ceilings_fall_from_a_second_take_to_another_person(wild: Path, tmp_path: Path):
    call(wild, tmp_path / "one", "--source", "crisp")
    asked = ("benchmarks.propagation_ceilings", wild, tmp_path / "one", "--method", "dtw")
    told = run_python("-m", *asked, check=True, cwd=ROOT).stdout
    rows = re.findall(r"(\w+), 4 clips: mean of \d+ (\S+) .*, weighted (\S+), c1 … .*\n", told)
    assert [name for name, _, _ in rows] == ["source", "participant", "carried", "sentences"], told
    mean = {name: float(value) for name, value, _ in rows}
    weighted = {name: float(value) for name, _, value in rows}
    assert weighted["source"] > 0.9 > weighted["carried"] > 0.2
    assert mean["source"] > max(mean["participant"], mean["sentences"])
    assert [p.name for p in wild.glob("recordings/*/test/pouting*")] == []


def test_other_readers_read_them(whole: Path):
    duckdb, pandas = pytest.importorskip("duckdb"), pytest.importorskip("pandas")
    where = str(whole / "*.parquet")
    count = duckdb.sql(f"select count(*), count(distinct clip) from '{where}'").fetchall()[0]
    frame = pandas.read_parquet(whole / "one.parquet")
    assert count[0] == count[1] > 30 and set(frame["word"]) == {"one"}


def same(one: Path, other: Path) -> None:
    for word in WORDS:
        name = f"{word}.parquet"
        assert (one / name).read_bytes() == (other / name).read_bytes(), word
    assert (one / "manifest.json").read_bytes() == (other / "manifest.json").read_bytes()


def start(arguments: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        python("-m", "elocute", *arguments),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def children(process: int) -> list[int]:
    """Workers of a driver."""
    path = Path(f"/proc/{process}/task/{process}/children")
    found = [int(each) for each in path.read_text().split()] if path.exists() else []
    return [p for p in found if b"spawn_main" in Path(f"/proc/{p}/cmdline").read_bytes()]


def wait_for(what, seconds: float = 120.0):
    until = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < until, "nothing happened"
        time.sleep(0.02)
    return found


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="needs Linux's /proc")
def test_a_killed_driver_goes_on_with_every_clip_once(wild: Path, whole: Path, tmp_path: Path):
    output = tmp_path / "out"
    driver = start(command(wild, output, "--jobs", "2"))
    wait_for(lambda: list((output / "records").glob("*.json")) or driver.poll() is not None)
    workers = children(driver.pid)
    driver.send_signal(signal.SIGKILL)
    driver.communicate()
    wait_for(lambda: not any(Path(f"/proc/{worker}/exe").exists() for worker in workers))
    assert not (output / "manifest.json").exists()
    one_line(run_here(*command(wild, output)), "--resume")
    told = call(wild, output, "--resume")
    assert told["kept"] >= 1 and told["words"] == 4
    rows_once(output, wild)
    same(whole, output)


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="needs Linux's /proc")
def test_a_killed_worker_is_replaced(wild: Path, whole: Path, tmp_path: Path):
    output = tmp_path / "out"
    driver = start(command(wild, output, "--jobs", "2"))
    os.kill(wait_for(lambda: children(driver.pid))[0], signal.SIGKILL)
    told, errors = driver.communicate(timeout=300)
    assert driver.returncode == 0, errors
    assert json.loads(told)["failed"] == []
    rows_once(output, wild)
    same(whole, output)


def test_a_damaged_shard_is_made_again(wild: Path, whole: Path, tmp_path: Path):
    output = tmp_path / "out"
    shutil.copytree(whole, output)
    (output / "one.parquet").write_bytes((whole / "one.parquet").read_bytes()[:-100])
    (output / "records" / "two.json").write_text("{")
    assert call(wild, output, "--resume")["kept"] == 2
    same(whole, output)


def test_what_cannot_be_used_is_listed_and_the_rest_goes_on(wild: Path, tmp_path: Path):
    room = tmp_path / "wild"
    shutil.copytree(wild, room)
    one, quiet = room / "recordings" / "one" / "train", np.zeros(16000)
    soundfile.write(one / "silent__0.wav", quiet, 16000)
    soundfile.write(one / "short__0.wav", quiet[:200] + 0.1, 16000)
    (one / "broken__0.wav").write_bytes(b"RIFF....WAVE")
    (one / "outside__0.wav").symlink_to("/etc/hostname")
    (room / "recordings" / "unsaid" / "train").mkdir(parents=True)
    soundfile.write(room / "recordings" / "unsaid" / "train" / "ann__0.wav", quiet, 16000)
    shutil.rmtree(room / "recordings" / "two")
    told = call(room, tmp_path / "out")
    with (tmp_path / "out" / "rejects.csv").open() as file:
        rejects = {row["audio"].split("/")[-1]: row["reason"] for row in csv.DictReader(file)}
    assert told["rejected"] == 5 == len(rejects) and told["unheard"] == ["two"]
    assert "nothing changes" in rejects["silent__0.wav"]
    assert "link out of the folder" in rejects["outside__0.wav"]
    assert "no captured speaker" in rejects["ann__0.wav"]
    assert {"short__0.wav", "broken__0.wav"} < set(rejects)
    left = {clip.audio.split("/")[-1] for clip in open_shards(tmp_path / "out", room).clips()}
    assert not left & set(rejects)


def test_refusals(wild: Path, whole: Path, tmp_path: Path):
    def refused(*more: str, says: str, output: Path | None = None) -> None:
        one_line(run_here(*command(wild, output or tmp_path / "new", *more)), says)
        assert not (tmp_path / "new").exists()

    refused(output=whole, says="--resume")
    refused("--method", "guess", says="dtw")
    refused("--jobs", "-2", says="--jobs")
    refused("--ray", "nowhere", says="HOST:PORT")
    refused("--root", str(wild / "captured"), says="--root")
