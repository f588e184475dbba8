"""A project is a take: the same for the page, for Python and for the command line."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from elocute import animate
from elocute.errors import InputError, MotionError
from elocute.motion.edits.closures import sealed_frames
from elocute.motion.store import load_motion
from elocute.studio import Project, open_project
from tests.support.commands import run_here

SECONDS, FPS = 2.0, 30.0


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with two seconds of a hum, and files that are and are not beside a project."""
    import soundfile

    folder = tmp_path_factory.mktemp("room")
    times = np.arange(round(16000 * SECONDS)) / 16000
    soundfile.write(folder / "hum.wav", 0.2 * np.sin(2 * np.pi * 140 * times), 16000)
    (folder / "mine.json").write_text(json.dumps({"mix": {"broad": 1.0}}))
    (folder.parent / "beyond.json").write_text(json.dumps({"mix": {"calm": 1.0}}))
    (folder / "linked.json").symlink_to(folder.parent / "beyond.json")
    return folder


def said(*closed: tuple[float, float]) -> list[tuple[float, float, str]]:
    """An open vowel with a P in it, or several."""
    phones, at = [], 0.2
    for start, end in closed:
        phones += [(at, start, "AA"), (start, end, "P")]
        at = end
    return [*phones, (at, 1.8, "AA")]


def sealed_at(project: Project, *moments: float) -> list[bool]:
    motion = project.animate().motion
    sealed = sealed_frames(motion)
    return [bool(sealed[round(moment * motion.fps)]) for moment in moments]


def test_what_is_saved_is_read_again(room: Path):
    project = Project(
        room,
        "hum.wav",
        text="Hm — „ja“",
        language="de",
        phones=said((0.9, 1.0)),
        words=[(0.2, 1.8, "hm")],
        edits=[{"edit": "blinks", "add": [0.5]}],
        settings={"style": "mine.json", "fps": FPS, "life": 0.5},
        options={"light": "day", "size": [640, 480]},
        locks={"P": True},
    )
    project.save(room / "all.elocute.json")
    read = open_project(room / "all.elocute.json")
    assert read == project and read.phones == tuple(said((0.9, 1.0)))
    assert read.options_of(Path("a.mp4")) == {"light": "day", "size": (640, 480)}
    assert read.options_of(Path("a.html")) == {"light": "day"}


def test_a_phone_that_is_moved_takes_its_closure_along(room: Path):
    quiet: dict[str, Any] = {"settings": {"fps": FPS, "life": 0.0}}
    first = Project(room, "hum.wav", phones=said((0.60, 0.72)), **quiet)
    moved = Project(room, "hum.wav", phones=said((1.20, 1.32)), **quiet)
    assert sealed_at(first, 0.63, 1.23) == [True, False]
    assert sealed_at(moved, 0.63, 1.23) == [False, True]
    changed = [
        (start, end, "K" if phone == "P" else phone) for start, end, phone in said((0.60, 0.72))
    ]
    assert sealed_at(Project(room, "hum.wav", phones=changed, **quiet), 0.63) == [False]


def test_edits_of_a_project_are_those_of_an_edit_list(room: Path):
    held = [{"edit": "closed", "from": 1.0, "to": 1.3}]
    project = Project(room, "hum.wav", phones=said(), edits=held, settings={"fps": FPS})
    assert sealed_at(project, 0.8, 1.15) == [False, True]


def test_python_and_the_command_line_give_the_frames_of_the_project(room: Path, tmp_path: Path):
    settings: Any = {"fps": FPS, "style": "broad", "mood": "happy", "seed": 3}
    edits = [{"edit": "amplitude", "regions": {"jaw": 1.3}}]
    project = Project(room, "hum.wav", edits=edits, settings=settings)
    project.save(room / "same.elocute.json")
    whole = {"elocute": "edits", "version": 1, "edits": edits}
    plain = animate(room / "hum.wav", edits=whole, **settings)
    shown = open_project(room / "same.elocute.json").animate()
    result = run_here("render", room / "same.elocute.json", "-o", tmp_path / "a.npz")
    assert (result.returncode, result.stdout) == (0, f"{tmp_path / 'a.npz'}\n"), result
    for motion in (shown.motion, load_motion(tmp_path / "a.npz")):
        np.testing.assert_array_equal(motion.weights, plain.motion.weights)
        np.testing.assert_array_equal(motion.rotations, plain.motion.rotations)


def test_files_lie_beside_the_project(room: Path, tmp_path: Path):
    """The folder is moved as it is; nothing is looked for where the command runs."""
    moved = tmp_path / "moved"
    shutil.copytree(room, moved, symlinks=True)
    by_file = Project(moved, "hum.wav", phones=said(), settings={"style": "mine.json"})
    by_name = Project(moved, "hum.wav", phones=said(), settings={"style": "broad"})
    np.testing.assert_array_equal(
        by_file.animate().motion.weights, by_name.animate().motion.weights
    )


@pytest.mark.parametrize(
    "elsewhere",
    ["../beyond.json", "/etc/style.json", "linked.json", "~/style.json", "a\\b.json", "none.json"],
)
def test_no_setting_and_no_edit_leads_to_another_place(room: Path, elsewhere: str):
    styled = Project(room, "hum.wav", settings={"style": elsewhere})
    with pytest.raises(InputError, match=r"allowed: a (file of that folder|plain name)"):
        styled.take_settings()
    with pytest.raises(InputError, match=r"allowed: a (file of that folder|plain name)"):
        Project(room, "hum.wav", edits=[{"edit": "style", "style": elsewhere}])


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ({"sound": "../hum.wav"}, "`sound`: '../hum.wav'"),
        ({"character": "/a.glb"}, "`character`: '/a.glb'"),
        ({"phones": [[0, 1, "XX"]]}, "phone 'XX': unknown"),
        ({"phones": [[1, 0, "P"]]}, r"`phones`\[0\]"),
        ({"phones": [[1, 2, "P"], [0, 1, "P"]]}, "rising times"),
        ({"words": [[0, 1]]}, r"`words`\[0\]"),
        ({"text": 3}, "`text`: 3"),
        ({"settings": {"styel": "broad"}}, "setting 'styel': unknown.*'style'?"),
        ({"settings": {"head": "a.glb"}}, "setting 'head': unknown"),
        ({"settings": {"fps": 0}}, "`fps`: 0"),
        ({"settings": []}, "`settings`"),
        ({"options": {"lights": "day"}}, "option 'lights': unknown.*'light'?"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line(room: Path, change: dict[str, Any], told: str):
    with pytest.raises(InputError, match=told) as caught:
        given: dict[str, Any] = {"sound": "hum.wav"} | change
        Project(room, **given)
    assert "\n" not in str(caught.value)


def test_errors_name_the_file_and_the_place_in_it(room: Path, tmp_path: Path):
    file = tmp_path / "bad.elocute.json"
    file.write_text('{"elocute_project": 1, "sound": "a.wav", "edits": [{"edit": "closd"}]}')
    with pytest.raises(MotionError, match=r"bad.elocute.json: edits: edits\[0\].edit.*'closed'"):
        open_project(file)
    result = run_here("render", file, "-o", tmp_path / "a.npz")
    assert result.returncode == 2 and "edits[0].edit" in result.stderr
    file.write_text('{"elocute_project": 9, "sound": "a.wav"}')
    with pytest.raises(InputError, match="`elocute_project` 9; allowed: 1; a newer Elocute may"):
        open_project(file)


def test_render_takes_from_a_project_what_it_says(room: Path, tmp_path: Path):
    Project(room, "hum.wav", phones=said(), settings={"fps": FPS}).save(room / "p.elocute.json")
    for flag, value in (("--head", "builtin"), ("--audio", room / "hum.wav"), ("--mesh", "a")):
        result = run_here("render", room / "p.elocute.json", "-o", tmp_path / "a.npz", flag, value)
        assert result.returncode == 2 and f"{flag}: a project" in result.stderr
    again = ("render", room / "p.elocute.json", "-o", tmp_path / "a.csv", "--fps", 24)
    for _ in range(2):  # its own files are replaced
        assert run_here(*again).returncode == 0
    written = json.loads(run_here(*again, "--json").stdout)
    assert (written["fps"], written["outputs"]) == (24, [str(tmp_path / "a.csv")])
    beyond = Project(room, "hum.wav", phones=[(2.0, 2.9, "P")])
    with pytest.raises(InputError, match=r"phones: until 2\.90 s, in a sound of 2\.00 s"):
        beyond.animate()


def test_a_correction_changes_nothing_elsewhere(speech_wav: Path, tmp_path: Path):
    """Of a person's speech, whose phones were heard: one is moved, and the face beyond a second of
    it moves as before."""
    from elocute.speech import find_phones

    shutil.copy(speech_wav, tmp_path / "line.flac")
    found = list(find_phones(speech_wav).phones)
    place = next(n for n, each in enumerate(found) if each[2] in ("M", "B", "P") and each[0] > 4)
    start, end, phone = found[place]
    moved = [*found[:place], (start, end + 0.1, phone), *found[place + 1 :]]
    as_found, corrected = (
        Project(tmp_path, "line.flac", phones=phones, settings={"fps": FPS, "life": 0.0})
        .animate()
        .motion
        for phones in (found, moved)
    )
    times = as_found.times_s
    far = np.abs(times - start) > 1.0
    np.testing.assert_allclose(corrected.weights[far], as_found.weights[far], atol=0.02)
    held = (times > start + 0.03) & (times < end + 0.05)
    assert sealed_frames(corrected)[held].all() and not sealed_frames(as_found)[held].all()
