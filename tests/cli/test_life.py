"""`--life` and `--mood`, and the turns of the head in text formats."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

import elocute
from elocute.animation import animate
from elocute.export.arkit_csv import head_poses
from elocute.head.builtin import load_builtin_head


@pytest.fixture(scope="module")
def alive(speech_wav):
    return animate(speech_wav, fps=30)


def test_on_the_command_line(speech_wav, tmp_path, cli, refused):
    take = tmp_path / "talk.npz"
    said = ["animate", speech_wav, "-o", take, "--fps", "30"]
    cli(*said, "--life", "head=0.5,brows=0", "--mood", "sad:0.6")
    motion = elocute.load_motion(take)
    assert motion.rotations is not None
    wanted = animate(speech_wav, fps=30, life="head=0.5,brows=0", mood="sad:0.6").motion
    assert np.array_equal(motion.rotations, np.asarray(wanted.rotations))
    assert np.array_equal(motion.weights, wanted.weights)
    refused(*said, "--overwrite", "--life", "ears=1", says="head, brows")
    refused(*said, "--overwrite", "--mood", "grumpy", says="neutral, happy")


def test_another_take_and_a_listener_on_the_command_line(speech_wav, tmp_path, cli, refused):
    said = ["animate", speech_wav, "--fps", "30", "-o"]
    cli(*said, tmp_path / "second.npz", "--seed", "2")
    second = elocute.load_motion(tmp_path / "second.npz")
    assert np.array_equal(second.weights, animate(speech_wav, fps=30, seed=2).motion.weights)
    cli(*said, tmp_path / "listener.npz", "--listen", "--seed", "2")
    listener = elocute.load_motion(tmp_path / "listener.npz")
    jaw = listener.head.expression_names.index("jawOpen")
    assert listener.weights[:, jaw].max() == 0 < second.weights[:, jaw].max()
    assert np.ptp(listener.weights, axis=0).max() > 0.4  # it blinks
    refused(*said, tmp_path / "x.npz", "--listen", "--text", "hello", says="--listen")
    refused(*said, tmp_path / "x.npz", "--seed", "-1", says="--seed")


def test_csv_and_json_hold_the_turns_of_the_head(alive, tmp_path, cli, refused):
    alive.write(tmp_path / "talk.csv").write(tmp_path / "talk.json")
    with (tmp_path / "talk.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    yaw = 180 * np.array([float(row["HeadYaw"]) for row in rows])
    assert 1 < np.abs(yaw).max() < 10
    assert np.abs(yaw / 180 - np.asarray(head_poses(alive.motion))[:, 0]).max() < 1e-5
    record = json.loads((tmp_path / "talk.json").read_text())
    assert record["joints"] == list(load_builtin_head().joint_names)
    cli("render", tmp_path / "talk.json", "-o", tmp_path / "back.npz")
    back = elocute.load_motion(tmp_path / "back.npz")
    assert np.abs(back.rotations - alive.motion.rotations).max() < 1e-5
    record["rotations"][3][0] = [1, 1, 0, 0]
    (tmp_path / "bad.json").write_text(json.dumps(record))
    refused("render", tmp_path / "bad.json", "-o", tmp_path / "x.npz", says="quaternion")


def test_lines_of_a_table_have_moods_of_their_own(speech_wav, tmp_path, cli):
    (tmp_path / "one.flac").write_bytes(speech_wav.read_bytes())
    rows = ["id,audio,life,mood", "glad,one.flac,,happy:0.6", "still,one.flac,0,"]
    (tmp_path / "lines.csv").write_text("\n".join(rows) + "\n")
    cli("say", "--table", tmp_path / "lines.csv", "-o", tmp_path / "takes", "--fps", "30")
    glad, still = (elocute.load_motion(tmp_path / "takes" / f"{n}.npz") for n in ("glad", "still"))
    wanted = animate(speech_wav, fps=30, mood="happy:0.6").motion
    assert np.array_equal(glad.weights, wanted.weights)
    assert still.rotations is None
