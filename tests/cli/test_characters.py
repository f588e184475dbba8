"""Characters on the command line: described, adopted, animated, or refused in a line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elocute.motion.curves import ARKIT_NAMES
from tests.support import strange_heads
from tests.support.gltf_files import OCULUS, arkit, glb, record
from tests.support.strange_heads import UNLIT, painted


@pytest.fixture
def hero(tmp_path):
    path = tmp_path / "hero.glb"
    path.write_bytes(glb(arkit()))
    return path


@pytest.fixture
def pair(tmp_path):
    path = tmp_path / "pair.vrm"
    names = list(ARKIT_NAMES)
    path.write_bytes(glb(record(("Anna", names), ("Ben", names))))
    return path


def animation(path):
    data = path.read_bytes()
    length = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + length])["animations"][-1]


def test_info_tells_what_moves(cli, tmp_path):
    path = tmp_path / "girl.gltf"
    path.write_text(json.dumps(record(("Head", [*OCULUS, "blnk_left", "hat"]))))
    shown = cli("info", path).stdout
    assert "fitted to the built-in head's mouth" in shown
    assert "unknown      blnk_left (near BlinkLeft), hat" in shown
    told = json.loads(cli("info", path, "--json").stdout)
    assert told["kind"] == "character" and told["unknown"]["blnk_left"] == "BlinkLeft"
    assert told["mapped"]["viseme_FF"].startswith("fitted, as 0.04 jawOpen + mouthLabiodental")


def test_animate_writes_into_the_users_file(cli, hero, speech_wav, tmp_path):
    out = tmp_path / "hero_speaks.glb"
    common = "--head", hero, "--fps", 24, "--style", "calm", "--mood", "happy", "--life", "0.5"
    cli("animate", speech_wav, *common, "-o", out, "-o", tmp_path / "talk.csv")
    assert animation(out)["extras"]["elocute"]["fps"] == 24
    assert (tmp_path / "hero_speaks.wav").is_file() and (tmp_path / "talk.csv").is_file()
    assert hero.read_bytes() == glb(arkit())


def test_a_take_is_seen_on_the_character_itself(cli, speech_wav, tmp_path):
    shapes = strange_heads.arkit_shapes()
    named = {name: shapes[name] for name in ("jawOpen", "mouthClose", "mouthPucker")}
    hero = tmp_path / "hero.glb"
    hero.write_bytes(painted((*strange_heads.face(), named), [0.1, 0.9, 0.1, 1], **UNLIT))
    outputs = [tmp_path / f"take.{suffix}" for suffix in ("png", "mp4", "html")]
    words = [word for each in outputs for word in ("-o", each)]
    drawing = "--fps", 5, "--size", 64, "--backend", "embreex", "--quality", "fast"
    cli("animate", speech_wav, "--head", hero, *drawing, *words)
    assert all(map(Path.is_file, outputs))
    with Image.open(outputs[0]) as sheet:
        green = np.array(sheet.convert("RGB")).astype(int)
    alike = np.abs(green - [89, 243, 89]).max(axis=2) <= 2
    assert alike.mean() > 0.15, "the sheet shows another head"


def test_an_adopted_character_needs_its_file_no_more(cli, hero, speech_wav, tmp_path):
    direct, later, rendered = (tmp_path / f"{name}.glb" for name in ("one", "two", "three"))
    cli("animate", speech_wav, "--head", hero, "-o", direct)
    assert "52: eyeBlinkLeft" in cli("head", "adopt", hero, "-o", tmp_path / "hero.npz").stdout
    hero.unlink()
    head = "--head", tmp_path / "hero.npz"
    cli("animate", speech_wav, *head, "-o", later, "-o", tmp_path / "talk.npz")
    cli("render", tmp_path / "talk.npz", "--audio", speech_wav, "-o", rendered)
    assert direct.read_bytes() == later.read_bytes() == rendered.read_bytes()
    edited = tmp_path / "edited.glb"
    cli("edit", tmp_path / "talk.npz", "--shape", "jawOpen=0", "--audio", speech_wav, "-o", edited)
    assert edited.read_bytes() != direct.read_bytes()
    cli("head", "show", tmp_path / "hero.npz")


def test_which_of_two_heads(cli, refused, pair, speech_wav, tmp_path):
    out = tmp_path / "out.glb"
    refused("info", pair, says="2 heads (Anna; Ben); allowed: one; --mesh Anna chooses")
    refused("animate", speech_wav, "--head", pair, "-o", out, says="--mesh Anna chooses")
    cli("animate", speech_wav, "--head", pair, "--mesh", "Ben", "-o", out)
    assert {each["target"]["node"] for each in animation(out)["channels"]} == {1}
    refused("info", speech_wav, "--mesh", "Ben", says="for .glb")
    refused("animate", speech_wav, "--mesh", "Ben", "-o", out, says="--mesh: 'Ben'; allowed:")
    cli("head", "adopt", pair, "--mesh", "Ben", "-o", tmp_path / "ben.npz")


@pytest.mark.parametrize(
    ("suffix", "says"),
    [
        ("obj", "whose mesh stays in its own file; allowed: .npz .glb .vrm .vrma .mp4 .webm .mov"),
        ("png", "hero.glb: meshes of no size"),
        ("html", "hero.glb: meshes of no size"),
    ],
)
def test_what_cannot_be_is_refused_before_any_work(
    refused, hero, speech_wav, tmp_path, suffix, says
):
    out = tmp_path / f"talk.{suffix}"
    refused("animate", speech_wav, "--head", hero, "-o", tmp_path / "a.glb", "-o", out, says=says)
    assert not out.exists() and not (tmp_path / "a.glb").exists()
    refused("say", "hello", "--head", hero, "-o", out, says=says)


def test_other_things_that_make_no_sense(refused, hero, speech_wav, tmp_path):
    out = tmp_path / "talk.glb"
    animate = "animate", speech_wav, "--head", hero, "-o", out
    refused(*animate, "--visemes", says="--visemes: a head with shapes of its own (hero.glb)")
    refused(*animate, "--identity", "hana", says="an identity for head 'hero.glb', which has none")
    refused(*animate, "--look", "otto", says="look of the built-in head")
    refused("animate", speech_wav, "--head", hero, "-o", hero, says="hero.glb")
    refused("head", "show", hero, says="a character's file, whose mesh stays in it")
    refused("head", "sample", "--head", hero, "-o", tmp_path / "x.png", says="a character's file")
    for name in ("gone.glb", "gone.vrm"):
        refused("info", tmp_path / name, says="no such file")
    assert not out.exists()
