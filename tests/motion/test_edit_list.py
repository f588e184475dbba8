"""Edit lists: what they may hold, what is said of mistakes, and each kind of edit on a motion."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute.errors import MotionError
from elocute.head.builtin import load_builtin_head
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.edits import (
    looped,
    read_edits,
    retimed,
    sealed_frames,
    with_amplitude,
    with_blinks,
    with_edits,
    with_gaze,
    with_lips_closed,
    with_mouth_offset,
    with_pose,
    with_shape,
    without_blinks,
)
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.quaternions import to_axis_angle

FPS = 50.0


@pytest.fixture(scope="module")
def talk() -> Motion:
    """Three seconds of a jaw that opens twice and lips that meet between, with a turning head."""
    times = np.arange(150) / FPS
    jaw = 0.4 * np.sin(np.pi * times / 1.5) ** 2
    sealed = np.clip(1.5 - np.abs(times - 1.5) / 0.1, 0, 1)
    jaw = np.maximum(jaw, 0.1 * sealed)
    curves = {
        "jawOpen": jaw,
        "mouthClose": sealed * jaw,
        "mouthUpperUpLeft": 0.3 * jaw * (1 - sealed),
        "mouthSmileLeft": np.full(150, 0.2),
        "browInnerUp": np.full(150, 0.3),
    }
    table = np.stack(list(curves.values()), axis=1).astype(np.float32)
    motion = motion_from_curves(load_builtin_head(), Curves(table, tuple(curves), FPS))
    return with_blinks(with_pose(motion, "head", [(0.0, (0, 0, 0)), (3.0, (0, 20, 0))]), [0.7])


def listed(*edits: Any) -> dict[str, Any]:
    return {"elocute": "edits", "version": 1, "edits": list(edits)}


def column(motion: Motion, name: str) -> np.ndarray:
    return motion.weights[:, motion.names.index(name)]


def openings_mm(motion: Motion) -> np.ndarray:
    return measure_mouth(motion)["opening_mm"]


MISTAKES = [
    ([1], "JSON of a list|a JSON object"),
    ({"elocute": "motion", "version": 1, "edits": []}, 'elocute: .*allowed: "edits"'),
    ({"elocute": "edits", "version": 2, "edits": []}, "version: 2; allowed: 1"),
    ({"elocute": "edits", "version": True, "edits": []}, "version: True"),
    ({"elocute": "edits", "version": 1}, "edits: nothing; allowed: a list"),
    ({"elocute": "edits", "version": 1, "edits": [], "edit": 1}, "key 'edit'.*'edits'"),
    (listed(3), r"edits\[0\]: 3"),
    (listed({}), r"edits\[0\].edit: nothing"),
    (listed({"edit": "amplitudde"}), r"edits\[0\].edit.*did you mean 'amplitude'"),
    (listed({"edit": "loop", "blendd": 1}), r"edits\[0\]: key 'blendd'.*did you mean 'blend'"),
    (listed({"edit": "amplitude", "regions": {"jaww": 1}}), r"\[0\].regions: .*did you mean 'jaw'"),
    (listed({"edit": "amplitude", "regions": {}}), "no region; allowed: jaw, lips"),
    (
        listed({"edit": "amplitude", "regions": {"jaw": "1"}}),
        r"regions.jaw: '1'; allowed: a number",
    ),
    (listed({"edit": "amplitude", "regions": {"jaw": 4}}), "allowed: a number, 0 to 3"),
    (listed({"edit": "closed", "from": 1}), r"\[0\].to: nothing; allowed: seconds"),
    (listed({"edit": "closed", "from": 2, "to": 1}), "2 to 1; allowed: a time after `from`"),
    (listed({"edit": "closed", "from": -1, "to": 1}), r"from: -1; allowed: seconds from 0"),
    (listed({"edit": "closed", "from": 0, "to": "end+1"}), "allowed: seconds"),
    (listed({"edit": "loop", "blend": 99}), "allowed: a number, 0.02 to 10"),
    (listed({"edit": "curve", "curve": "jawOpen", "keys": []}), "keys: no keys"),
    (listed({"edit": "curve", "curve": "jawOpen", "keys": [[0, 1], [0, 1]]}), "rising times"),
    (listed({"edit": "curve", "curve": "jawOpen", "keys": [["end", 1], [0, 1]]}), "rising times"),
    (listed({"edit": "curve", "curve": "jawOpen", "keys": [[0]]}), r"keys\[0\]: .*\[time, value\]"),
    (listed({"edit": "curve", "keys": [[0, 1]]}), "curve: nothing; allowed: a text"),
    (
        listed({"edit": "curve", "curve": "a", "keys": [[0, 1]], "mode": "ad"}),
        "mode: 'ad'; allowed: replace, add; did you mean 'add'",
    ),
    (listed({"edit": "head", "keys": [[0, [1, 2]]]}), r"keys\[0\].*\[time, x\]\[y\]\[z\]|\[time"),
    (listed({"edit": "blinks"}), "nothing; allowed: any of add, remove"),
    (listed({"edit": "face", "keys": [[0, "me.json"]]}), "a face's name or a seed"),
    (listed({"edit": "retime", "times": [[0, 1]]}), "one pair; allowed: two or more"),
    (listed({"edit": "offset", "seconds": 5}), "-2 to 2"),
]


@pytest.mark.parametrize(("record", "told"), MISTAKES)
def test_a_mistake_is_told_in_one_line_with_its_place(tmp_path: Path, record: Any, told: str):
    file = tmp_path / "take.json"
    file.write_text(json.dumps(record))
    with pytest.raises(MotionError, match=told) as refused:
        read_edits(file)
    assert "take.json" in str(refused.value) and "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ["", "{", '{"version": NaN}', "[[[[", '{"a": 1e999}'])
def test_what_is_no_json_is_refused(tmp_path: Path, text: str):
    file = tmp_path / "take.json"
    file.write_text(text)
    with pytest.raises(MotionError, match="no JSON"):
        read_edits(file)


@pytest.mark.parametrize(
    ("edit", "told"),
    [
        ({"edit": "curve", "curve": "jawOpn", "keys": [[0, 1]]}, "no such shape"),
        ({"edit": "closed", "from": 1, "to": 9}, "9 s; allowed: 0 to 3 s"),
        ({"edit": "amplitude", "regions": {"jaw": 2}, "from": "end-9"}, "-6 s; allowed"),
        ({"edit": "amplitude", "regions": {"jaw": 2}, "from": 2, "to": "end-2"}, "from 2 to 1 s"),
        ({"edit": "blinks", "remove": [2.5]}, "none at 2.5 s; allowed: within 0.15 s of: 0.7"),
        ({"edit": "face", "keys": [[0, "nobody"]]}, "nobody"),
        ({"edit": "gaze", "keys": [[0, [0, 90]]]}, "90 degrees"),
        ({"edit": "loop", "blend": 2}, "longer than two blends"),
        ({"edit": "retime", "times": [[0, 0], [1, 900]]}, "900 times as long"),
        ({"edit": "mood", "mood": "happy"}, "made already.*animate"),
        ({"edit": "style", "style": "calm"}, "made already.*animate"),
    ],
)
def test_an_edit_that_does_not_fit_names_itself(talk: Motion, edit: dict, told: str):
    with pytest.raises(MotionError, match=told) as refused:
        with_edits(talk, listed({"edit": "offset", "seconds": 0}, edit))
    assert str(refused.value).startswith("edits: edits[1]: ")


def test_an_empty_list_changes_nothing(talk: Motion):
    edited = with_edits(talk, listed())
    assert np.array_equal(edited.weights, talk.weights)


def test_a_list_does_what_the_functions_do(talk: Motion):
    keys = [(0.5, 0.0), (1.0, 0.6)]
    edited = with_edits(
        talk,
        listed(
            {"edit": "curve", "curve": "browInnerUp", "keys": keys},
            {"edit": "gaze", "keys": [[0, [5, 10]]]},
            {"edit": "blinks", "add": [2.0]},
        ),
    )
    wanted = with_blinks(with_gaze(with_shape(talk, "browInnerUp", keys), (5, 10)), [2.0])
    np.testing.assert_allclose(edited.weights, wanted.weights, atol=1e-6)


def test_kinds_are_applied_in_one_order_whatever_the_list(talk: Motion):
    edits = [
        {"edit": "loop", "blend": 0.2},
        {"edit": "retime", "times": [[0, 0], ["end", 4]]},
        {"edit": "closed", "from": 0.5, "to": 0.9},
        {"edit": "amplitude", "regions": {"jaw": 1.5}},
        {"edit": "offset", "seconds": 0.1},
    ]
    one, other = with_edits(talk, listed(*edits)), with_edits(talk, listed(*edits[::-1]))
    assert one.frame_count == 200 and np.array_equal(one.weights, other.weights)
    start, stop = round(0.5 * 4 / 3 * FPS) + 1, round(0.9 * 4 / 3 * FPS) - 1
    assert openings_mm(one)[start:stop].max() <= 0.1


@pytest.mark.parametrize(
    "regions", [{"jaw": 0.0}, {"jaw": 1.8}, {"lips": 2.5}, {"lips": 0}, {"jaw": 0.3, "lips": 3}]
)
def test_amplitude_moves_its_region_and_leaves_seals(talk: Motion, regions: dict[str, float]):
    edited = with_amplitude(talk, regions)
    sealed = sealed_frames(talk)
    assert sealed[73:78].all() and (openings_mm(edited)[sealed] <= 0.1).all()
    if "jaw" in regions:
        middle = slice(30, 45)
        wanted = np.clip(column(talk, "jawOpen")[middle] * regions["jaw"], 0, 1)
        np.testing.assert_allclose(column(edited, "jawOpen")[middle], wanted, atol=1e-6)
    assert np.array_equal(column(edited, "browInnerUp"), column(talk, "browInnerUp"))
    assert np.array_equal(column(edited, "eyeBlinkLeft"), column(talk, "eyeBlinkLeft"))


def test_amplitude_of_the_head_scales_its_turns(talk: Motion):
    edited = with_amplitude(talk, {"head": 0.5})
    assert talk.rotations is not None and edited.rotations is not None
    np.testing.assert_allclose(
        to_axis_angle(edited.rotations), 0.5 * to_axis_angle(talk.rotations), atol=1e-6
    )


def test_an_edit_comes_and_goes_within_its_window(talk: Motion):
    edit = {"edit": "amplitude", "regions": {"brows": 2}, "from": 1, "to": 2, "blend": 0.2}
    raised = column(with_edits(talk, listed(edit)), "browInnerUp")
    outside = np.r_[0:51, 100:150]
    np.testing.assert_allclose(raised[outside], 0.3, atol=1e-6)
    np.testing.assert_allclose(raised[60:90], 0.6, atol=1e-6)
    assert (np.diff(raised[50:61]) >= -1e-6).all() and np.abs(np.diff(raised)).max() < 0.06


def test_keys_of_the_mouth_keep_contacts_unless_they_are_free(talk: Motion):
    edit = {"edit": "curve", "curve": "jawOpen", "keys": [[0, 0.5]]}
    kept, free = (
        with_edits(talk, listed(edit)),
        with_edits(talk, listed({**edit, "contacts": "free"})),
    )
    sealed = sealed_frames(talk)
    assert openings_mm(kept)[sealed].max() <= 0.1 < openings_mm(free)[sealed].max()
    np.testing.assert_allclose(column(kept, "jawOpen")[20:60], 0.5, atol=1e-6)


def test_linear_and_smooth_keys_and_added_ones(talk: Motion):
    edit = {"edit": "curve", "curve": "browInnerUp", "keys": [[0, 0], [2, 0.8]]}
    linear = column(with_edits(talk, listed({**edit, "between": "linear"})), "browInnerUp")
    np.testing.assert_allclose(linear[:100], 0.4 * np.arange(100) / FPS, atol=1e-5)
    smooth = column(with_edits(talk, listed(edit)), "browInnerUp")
    assert smooth[5] < linear[5] and np.isclose(smooth[50], 0.4, atol=1e-3)
    added = column(with_edits(talk, listed({**edit, "mode": "add"})), "browInnerUp")
    np.testing.assert_allclose(added, np.minimum(1, smooth + 0.3), atol=1e-5)


def test_lips_are_held_closed_whatever_is_said(talk: Motion):
    closed = with_lips_closed(talk, 0.5, 1.0)
    assert openings_mm(talk)[25:51].min() > 2 and openings_mm(closed)[25:51].max() <= 0.1
    assert np.array_equal(closed.weights[:20], talk.weights[:20])
    assert np.array_equal(closed.weights[56:], talk.weights[56:])


def test_the_mouth_is_moved_by_whole_frames_and_nothing_else(talk: Motion):
    later = with_mouth_offset(talk, 0.1)
    assert np.array_equal(column(later, "jawOpen")[5:], column(talk, "jawOpen")[:-5])
    assert np.array_equal(column(later, "eyeBlinkLeft"), column(talk, "eyeBlinkLeft"))
    sooner = with_mouth_offset(later, -0.1)
    assert np.array_equal(sooner.weights[5:-5], talk.weights[5:-5])
    with pytest.raises(MotionError, match="-2 to 2 s"):
        with_mouth_offset(talk, 3)


def test_new_times_take_moments_along(talk: Motion):
    slow = retimed(talk, [(0, 0), (1.5, 3.0), (3.0, 4.5)])
    assert slow.frame_count == 225 and sealed_frames(slow)[146:154].all()
    np.testing.assert_allclose(slow.weights[:150:2], talk.weights[:75], atol=1e-6)
    part = retimed(talk, [(1.0, 7.0), (2.0, 8.0)])
    np.testing.assert_allclose(part.weights, talk.weights[50:100], atol=1e-6)
    for wrong in ([(0, 0)], [(0, 1), (1, 0)], [(0, 0), (9, 9)]):
        with pytest.raises(MotionError, match="new times"):
            retimed(talk, wrong)


def test_a_loop_ends_as_it_begins_in_value_and_speed(talk: Motion):
    loop = looped(talk, blend_s=0.3)
    assert loop.rotations is not None
    for values in (loop.weights, loop.rotations):
        np.testing.assert_allclose(values[-1], values[0], atol=1e-6)
        np.testing.assert_allclose(values[-1] - values[-2], values[1] - values[0], atol=1e-6)
    assert np.array_equal(loop.weights[17:-17], talk.weights[17:-17])
    assert np.abs(np.diff(loop.weights, axis=0)).max() < 0.5


def test_turns_of_the_head_are_added_or_replaced_within_a_window(talk: Motion):
    edit = {"edit": "head", "keys": [[0, [10, 0, 0]]]}
    replaced = with_edits(talk, listed({**edit, "mode": "replace", "from": 1, "to": 2}))
    assert talk.rotations is not None and replaced.rotations is not None
    assert np.allclose(replaced.rotations[:50], talk.rotations[:50], atol=1e-6)
    turns = np.degrees(to_axis_angle(replaced.rotations[75]))
    np.testing.assert_allclose(turns[:2], [[4, 0, 0], [6, 0, 0]], atol=1e-4)
    added = with_edits(talk, listed(edit))
    assert added.rotations is not None
    assert np.degrees(to_axis_angle(added.rotations[75]))[1, 1] > 8


def test_blinks_are_taken_out_where_they_are(talk: Motion):
    two = with_blinks(talk, [2.0])
    lids = column(without_blinks(two, [0.75]), "eyeBlinkLeft")
    assert lids[:60].max() < 1e-4 and np.array_equal(lids[60:], column(two, "eyeBlinkLeft")[60:])
    assert column(without_blinks(two), "eyeBlinkRight").max() == 0
    edited = with_edits(talk, listed({"edit": "blinks", "remove": "all", "add": [1.5]}))
    lids = column(edited, "eyeBlinkLeft")
    assert lids[35] < 1e-4 and lids[75] > 0.9


def test_faces_follow_each_other(talk: Motion):
    edited = with_edits(talk, listed({"edit": "face", "keys": [[0, "ada"], ["end", "7"]]}))
    assert any(name.startswith("identity") for name in edited.names)


def test_what_is_no_edit_list_is_refused(talk: Motion):
    for wrong in (3, [1], None):
        with pytest.raises(MotionError):
            with_edits(talk, wrong)  # pyright: ignore[reportArgumentType]
