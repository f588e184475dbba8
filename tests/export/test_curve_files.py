"""Curves that come back in, as different programs write them."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from elocute.adoption.motion_files import open_motion
from elocute.errors import MotionError
from elocute.export.arkit_csv import arkit_curves, head_poses, write_csv
from elocute.export.curve_files import AZURE, read_curves
from elocute.export.curves_json import write_json
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import from_axis_angle

WEIGHTS = np.round(np.random.default_rng(3).random((7, 52)), 3)


@pytest.fixture
def given(tmp_path):
    def write(content, name="take.json"):
        path = tmp_path / name
        if isinstance(content, np.ndarray):
            np.save(path, content)
        else:
            path.write_text(content if isinstance(content, str) else json.dumps(content))
        return path

    return write


def by_name(row):
    return dict(zip(ARKIT_NAMES, row.tolist(), strict=True))


AUDIO2FACE = {
    "exportFps": 30.0,
    "numPoses": 52,
    "facsNames": list(ARKIT_NAMES),
    "weightMat": WEIGHTS.tolist(),
}
BEAT = {
    "names": list(ARKIT_NAMES),
    "frames": [
        {"weights": row.tolist(), "time": f / 30, "rotation": []} for f, row in enumerate(WEIGHTS)
    ],
}
MEDIAPIPE = [
    {
        "timestamp_ms": 0,
        "timestamp": 40 * frame,
        "faceBlendshapes": [
            {"index": 0, "categoryName": "_neutral", "score": 1e-6},
            *({"categoryName": name, "score": each} for name, each in by_name(row).items()),
        ],
    }
    for frame, row in enumerate(WEIGHTS)
]
CATEGORIES = [
    [{"index": 0, "score": each, "categoryName": name} for name, each in by_name(row).items()]
    for row in WEIGHTS
]
JAVASCRIPT = [
    {
        "faceLandmarks": [[{"x": 0.5, "y": 0.5, "z": 0}]] * 2,
        "faceBlendshapes": [
            {"categories": face, "headIndex": -1, "headName": ""} for face in (first, [])
        ],
        "timestamp_ms": 20 * frame,
    }
    for frame, first in enumerate(CATEGORIES)
]
PYTHON = [
    {"face_landmarks": [[{}]], "face_blendshapes": [first], "time": frame / 30}
    for frame, first in enumerate(CATEGORIES)
]
FORMS = {
    "Audio2Face": (AUDIO2FACE, 30),
    "BEAT": (BEAT, 30),
    "MediaPipe": (MEDIAPIPE, 25),
    "MediaPipe's results in JavaScript": (JAVASCRIPT, 50),
    "MediaPipe's results in Python": (PYTHON, 30),
    "rows": (WEIGHTS.tolist(), 60),
    "rows under a name": ({"fps": 24, "blendShapes": WEIGHTS.tolist()}, 24),
    "names beside rows": ({"blendShapes": list(ARKIT_NAMES), "frames": WEIGHTS.tolist()}, 60),
    "weights by name": ([by_name(row) for row in WEIGHTS], 60),
    "weights by Unreal's names": (
        [{f"{n[0].upper()}{n[1:]}": each for n, each in by_name(row).items()} for row in WEIGHTS],
        60,
    ),
    "weights by name and time": (
        {"frames": [{"t": f / 50, "blendshapes": by_name(r)} for f, r in enumerate(WEIGHTS)]},
        50,
    ),
    "hundredths with sides as letters": (
        [
            {n.replace("Left", "_L").replace("Right", "_R"): 100 * w for n, w in by_name(r).items()}
            for r in np.maximum(WEIGHTS, 0.02)
        ],
        60,
    ),
    "an array": (WEIGHTS.astype(np.float32), 60),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_same_weights_in_every_form(given, form):
    content, fps = FORMS[form]
    found = read_curves(given(content, "take.npy" if form == "an array" else "take.json"))
    assert found.curves.fps == fps
    wanted = np.maximum(WEIGHTS, 0.02) if "hundredths" in form else WEIGHTS
    assert np.allclose(found.curves.select(ARKIT_NAMES).values, wanted, atol=1e-6)
    assumed = form in ("rows", "an array", "names beside rows") or form.startswith(
        ("weights by", "h")
    )
    assert any("no frame rate" in n for n in found.notes) == (assumed and "time" not in form)
    assert any("ARKit's order" in note for note in found.notes) == (
        form in ("rows", "an array") or "under" in form
    )


def test_a_frame_rate_can_be_given(given):
    assert read_curves(given(WEIGHTS.tolist()), 30000 / 1001).curves.fps == 30000 / 1001
    with pytest.raises(MotionError, match="frame rate: 0"):
        read_curves(given(WEIGHTS.tolist()), 0)


def azure(first, rows):
    return {"FrameIndex": first, "BlendShapes": [[*row, 0.1, 0.2, 0.3] for row in rows.tolist()]}


@pytest.mark.parametrize("form", ["a list", "a line each", "texts"])
def test_azures_chunks_stand_where_their_numbers_say(given, form):
    chunks = [azure(3, WEIGHTS[3:]), azure(0, WEIGHTS[:3])]
    name, content = "take.json", chunks
    if form == "a line each":
        name, content = "take.jsonl", "\n".join(map(json.dumps, chunks))
    elif form == "texts":
        content = [json.dumps(each) for each in chunks]
    found = read_curves(given(content, name))
    assert len(AZURE) == 55 and found.curves.fps == 60 and found.notes == ()
    assert np.allclose(found.curves.select(ARKIT_NAMES).values, WEIGHTS)


def test_what_azure_left_out_is_filled_in_and_told(given):
    found = read_curves(given([azure(0, WEIGHTS[:3]), azure(5, WEIGHTS[5:])]))
    values = found.curves["jawOpen"]
    column = ARKIT_NAMES.index("jawOpen")
    assert len(values) == 7 and np.allclose(values[[0, 2, 5, 6]], WEIGHTS[[0, 2, 5, 6], column])
    assert values[3] == pytest.approx((2 * WEIGHTS[2, column] + WEIGHTS[5, column]) / 3, abs=1e-6)
    assert any("frames are missing" in note for note in found.notes)


@pytest.mark.parametrize("fps", [24, 25, 30, 60, 30000 / 1001, 24000 / 1001, 120])
def test_our_csv_comes_back_with_its_rate_and_the_turns_of_the_head(motion, tmp_path, fps):
    turns = np.tile(
        np.array([1, 0, 0, 0], np.float32), (motion.frame_count, len(motion.head.joint_names), 1)
    )
    place = motion.head.joint_names.index("head")
    angles = np.random.default_rng(1).normal(0, 0.2, (motion.frame_count, 3))
    turns[:, place] = from_axis_angle(angles)
    taken = Motion(motion.head, motion.weights, fps, turns)
    write_csv(taken, tmp_path / "talk.csv")
    found = read_curves(tmp_path / "talk.csv")
    assert found.curves.fps == fps and found.notes == ()
    assert np.allclose(found.curves.values, arkit_curves(taken).values, atol=1e-6)
    again = replace(taken, rotations=found.rotations(taken.head))
    shown, wanted = head_poses(again), head_poses(taken)
    assert shown is not None and wanted is not None
    assert np.allclose(shown, wanted, atol=2e-6)


def live_link(codes, names=ARKIT_NAMES, mark=","):
    """What the app writes: fewer columns in old versions."""
    header = mark.join(["Timecode", "BlendshapeCount", *(f"{n[0].upper()}{n[1:]}" for n in names)])
    rows = [
        mark.join([code, "61", *map(str, WEIGHTS[i % 7, : len(names)])])
        for i, code in enumerate(codes)
    ]
    return "\n".join([header, *rows]) + "\n"


def test_recordings_say_their_rate_by_their_timecodes(given):
    at_60 = [f"12:00:{f // 60:02}:{f % 60:02}.123" for f in range(150)]
    assert read_curves(given(live_link(at_60), "a.csv")).curves.fps == 60
    at_30 = [f"12:00:{f // 30:02}:{f % 30:02}.123" for f in range(100)]
    assert read_curves(given(live_link(at_30), "a.csv")).curves.fps == 30
    over_midnight = [f"23:59:59:{f:02}.000" for f in range(60)] + ["00:00:00:00.000"]
    assert read_curves(given(live_link(over_midnight), "a.csv")).curves.fps == 60
    lost = [code for f, code in enumerate(at_60) if f not in (40, 41, 42)]
    found = read_curves(given(live_link(lost), "a.csv"))
    assert len(found.curves.values) == 150 and "frames are missing" in found.notes[0]


def test_a_short_take_says_its_rate_where_a_second_ends(given):
    at_30 = [f"12:00:{f // 30:02}:{f % 30:02}.000" for f in range(20, 50)]
    assert read_curves(given(live_link(at_30), "a.csv")).curves.fps == 30
    five = [f"00:00:{f // 5:02}:{f % 5 * 12:02}.000" for f in range(20)]
    assert read_curves(given(live_link(five), "a.csv")).curves.fps == 5


def test_frames_in_which_the_app_saw_no_face_are_filled_in(given):
    rows = live_link([f"12:00:00:{f:02}.000" for f in range(7)]).splitlines()
    rows[4] = "12:00:00:03.000,0" + "," * 52
    rows[5] = "12:00:00:04.000,0"
    found = read_curves(given("\n".join(rows), "a.csv"))
    between = (2 * WEIGHTS[2] + WEIGHTS[5]) / 3
    assert np.allclose(found.curves.select(ARKIT_NAMES).values[3], between, atol=1e-6)
    assert len(found.curves.values) == 7
    assert found.notes == ("a.csv: frames without values, 2, are filled in",)
    seen = [{"categoryName": "jawOpen", "score": 0.5}]
    for nothing in ([], {}, None, [[]], [{"categories": []}]):
        frames = [
            {"timestamp": 40 * n, "faceBlendshapes": nothing if n == 2 else seen} for n in range(5)
        ]
        found = read_curves(given(frames))
        assert found.curves["jawOpen"].tolist() == [0.5] * 5 and found.curves.fps == 25
        assert found.notes == ("take.json: frames without values, 1, are filled in",)
    with pytest.raises(MotionError, match="no frames"):
        read_curves(given([{"faceBlendshapes": []}] * 3))


def test_what_is_missing_is_filled_in_where_a_rate_is_named_too(given):
    codes = [f"12:00:{f // 30:02}:{f % 30:02}.000" for f in range(40) if f not in (12, 13)]
    path = given(live_link(codes), "a.csv")
    as_told = read_curves(path).curves
    for named, fps in ((30000 / 1001, 30000 / 1001), (60, 60)):
        curves = read_curves(path, named).curves
        assert len(curves.values) == len(as_told.values) == 40 and curves.fps == fps
        assert np.allclose(curves.values, as_told.values, atol=0.05)


def test_tables_with_other_columns_and_marks(given):
    some = ARKIT_NAMES[:20]
    codes = [f"00:00:00:{f:02}.000" for f in range(7)]
    found = read_curves(given(live_link(codes, some, ";"), "a.csv"))
    assert np.allclose(found.curves.select(some).values, WEIGHTS[:, :20])
    assert not found.curves["tongueOut"].any()
    comma = live_link(codes, some, ";").replace("0.", "0,")
    assert np.allclose(read_curves(given(comma, "a.csv")).curves.values, found.curves.values)
    rows = [["timeCode", "blendShapes.JawOpen", "blendShapes.MouthClose", "emotion.joy"]]
    rows += [[f / 30, 0.5, 0.25, 1] for f in range(60)]
    path = given("", "a2f.csv")
    with path.open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    found = read_curves(path)
    assert found.curves.fps == 30 and (found.curves["jawOpen"] == 0.5).all()
    assert "left out emotion.joy" in found.notes[0]


def test_our_own_json_comes_back_whole(motion, tmp_path):
    write_json(motion, tmp_path / "talk.json")
    found = read_curves(tmp_path / "talk.json")
    assert np.allclose(found.curves.values, motion.weights, atol=1e-6)
    assert found.rotations(motion.head) is None


@pytest.mark.parametrize(
    ("content", "name", "says"),
    [
        ({"a": 1}, "x.json", r"no curve that is known \(a\)"),
        ([[1, 2, 3]], "x.json", r"frame 0: no weights by name; allowed: 51, 52, 55 or 61"),
        ([], "x.json", "no frames"),
        ({"facsNames": ["jawOpen"], "weightMat": [[0.1, 0.2]]}, "x.json", "frame 0: 2 values"),
        ({"facsNames": ["jawOpen"], "weightMat": [["a"]]}, "x.json", "frame 0: 1 values"),
        ([{"jawOpen": 0.1, "JawOpen": 0.2}], "x.json", "a curve twice"),
        ([{"FrameIndex": -1, "BlendShapes": []}], "x.json", "FrameIndex without"),
        (np.zeros((3, 7)), "x.npy", r"float64 of shape \(3, 7\)"),
        (np.full((3, 52), np.nan), "x.npy", "NaN"),
        ("a,b\n1,2\n", "x.csv", r"no column of a curve \(a, b\)"),
        ("jawOpen\nx\n", "x.csv", "row 2: values that are not numbers"),
        ("jawOpen\nnan\n", "x.csv", "row 2: NaN"),
        ("jawOpen\n", "x.csv", "no frames"),
    ],
)
def test_what_is_none_is_refused_in_a_line(given, content, name, says):
    with pytest.raises(MotionError, match=says) as told:
        read_curves(given(content, name))
    assert "\n" not in str(told.value)


def test_azures_numbers_that_begin_again_go_on(given):
    """The chunks of several requests in one file."""
    found = read_curves(
        given([azure(0, WEIGHTS[:3]), azure(0, WEIGHTS[3:5]), azure(2, WEIGHTS[5:])])
    )
    assert np.allclose(found.curves.select(ARKIT_NAMES).values, WEIGHTS, atol=1e-6)
    assert found.notes == ("take.json: FrameIndex begins again: taken to go on at frame 3",)
    twice = read_curves(given([azure(0, WEIGHTS[:3]), azure(0, WEIGHTS[:3])]))
    assert len(twice.curves.values) == 3 and twice.notes == ()


def test_a_clock_that_stands_now_and_then_is_one(given):
    codes = [f"12:00:{f // 30:02}:{f % 30:02}.000" for f in (0, *range(60), *range(75, 90))]
    found = read_curves(given(live_link(codes), "a.csv"))
    assert found.curves.fps == 30 and len(found.curves.values) == 90
    assert found.notes[0] == "a.csv: 1 frames whose time comes again are left out"
    twice = [f"12:00:00:{f // 2:02}.000" for f in range(60)]
    assert "no frame rate" in read_curves(given(live_link(twice), "a.csv")).notes[0]


def test_hundredths_may_be_a_little_below_zero(given):
    frames = [{"jawOpen": -0.2, "mouthSmileLeft": 50}, {"jawOpen": 30, "mouthSmileLeft": 90}]
    found = read_curves(given({"fps": 30, "frames": frames}))
    assert found.curves["jawOpen"].tolist() == pytest.approx([-0.002, 0.3])
    assert "up to 90 are taken for hundredths" in found.notes[0]


def test_weights_beyond_what_a_shape_has_are_told_with_their_column(given):
    names, shown = ["jawOpen", "mouthPucker"], np.abs(np.sin(np.arange(60)))[:, None] * [0.8, 0.5]
    for scale, high, told in (
        (1, 1.4, ["jawOpen reaches 1.4 at frame 7"]),
        (1, 6, ["jawOpen reaches 6 at frame 7"]),
        (100, 130, ["weights up to 130 are taken for hundredths", "jawOpen reaches 1.3 at frame"]),
        (1, 1.02, []),
        (100, 100, ["weights up to 100 are taken for hundredths"]),
    ):
        rows = scale * shown
        rows[7, 0] = high
        lines = [",".join(map(repr, row)) for row in rows.tolist()]
        path = given("\n".join([",".join(names), *lines]), "take.csv")
        found = read_curves(path, 30)
        assert found.curves["jawOpen"].max() == pytest.approx(high / scale)
        assert len(found.notes) == len(told)
        assert all(each in note for each, note in zip(told, found.notes, strict=True))


def test_curves_that_go_where_no_face_is_are_refused(given):
    path = given({"fps": 30, "frames": [{"jawOpen": 0.5}, {"jawOpen": -900_000}]})
    with pytest.raises(
        MotionError, match=r"take.json: motion: a vertex .* m .*in frame 1; allowed"
    ):
        open_motion(path)
