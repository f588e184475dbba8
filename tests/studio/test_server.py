"""A studio from upload to export, as its page asks for it."""

from __future__ import annotations

import asyncio
import io
import json
import os
import shutil
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

from elocute.motion.store import load_motion
from elocute.studio import open_project
from elocute.studio.jobs import CANCELLED, DONE, FAILED
from elocute.studio.session import keep_latest
from elocute.studio.work import Task
from tests.studio.conftest import JSON, PORT, TOKEN, Page, a_page
from tests.support.browser import eventually
from tests.support.commands import run_here
from tests.support.gltf_files import arkit, glb, parts_of_glb, record


def hum(seconds: float = 1.0, kind: str = "WAV") -> bytes:
    times = np.arange(round(16000 * seconds)) / 16000
    file = io.BytesIO()
    soundfile.write(file, 0.2 * np.sin(2 * np.pi * 140 * times), 16000, format=kind)
    return file.getvalue()


def project_of(page: Page, name: str) -> tuple[dict[str, Any], str]:
    answer = page.get(f"/api/projects/{name}")
    assert answer.status == 200
    return answer.json, answer.fields["etag"]


def saved(page: Page, name: str, record: dict[str, Any], tag: str) -> Any:
    body = json.dumps(record).encode()
    return page.ask("PUT", f"/api/projects/{name}", body, JSON, ("if-match", tag))


def left(page: Page) -> list[str]:
    """What lies in the folder, and what came in and was not taken."""
    room = page.studio.cache
    uploads = [f"cache/{each.name}" for each in room.glob("upload-*")]
    return sorted(e.name for e in page.folder.iterdir() if not e.name.startswith(".")) + uploads


def test_a_take_is_what_the_command_line_renders(page: Page, tmp_path: Path):
    record, tag = project_of(page, "line")
    record["settings"] = {"fps": 30, "style": "broad"}
    record["edits"] = [{"edit": "closed", "from": 1.0, "to": 1.4}]
    assert saved(page, "line", record, tag).status == 200
    done = page.done(page.post("/api/projects/line/take"))
    assert done["state"] == DONE, done
    take = page.get("/api/projects/line/take").json
    assert take == page.get(f"/api/takes/{done['result']['take']}").json
    weights = np.frombuffer(page.get(take["weights_url"]).data, "<f4")
    joints = np.frombuffer(page.get("/api/projects/line/joints").data, "<f4")
    result = run_here("render", page.folder / "line.elocute.json", "-o", tmp_path / "a.npz")
    assert result.returncode == 0
    motion = load_motion(tmp_path / "a.npz")
    assert (take["fps"], take["frames"]) == (30, motion.frame_count)
    assert tuple(take["shapes"]) == motion.names
    # The worker's processor may add in another order than this process.
    shown = weights.reshape(motion.frame_count, -1)
    np.testing.assert_allclose(shown, motion.weights, atol=1e-4)
    assert motion.rotations is not None
    assert joints.reshape(motion.frame_count, -1, 4)[0] == pytest.approx(
        motion.rotations[0][:, [1, 2, 3, 0]], abs=1e-4
    )
    assert any(start <= 1.1 and end >= 1.35 for start, end in take["contacts"])
    assert take["phones"] and all(len(each) == 3 for each in take["phones"])


def test_the_head_of_a_take_and_its_light(page: Page):
    page.done(page.post("/api/projects/line/take"))
    take = page.get("/api/projects/line/take").json
    head = page.get(take["head_url"])
    assert head.data[:4] == b"glTF" and "immutable" in head.fields["cache-control"]
    size = int.from_bytes(head.data[12:16], "little")
    told = json.loads(head.data[20 : 20 + size])
    assert told["meshes"][0]["extras"]["targetNames"] == take["shapes"]
    names = [told["nodes"][each]["name"] for each in told["skins"][0]["joints"]]
    assert len(names) == len(take["joints"])
    lights = [page.get(f"/api/heads/{take['head_key']}{each}.json").json for each in ("", ".day")]
    assert {"stage", "views", "field_deg", "joints"} == set(lights[0])
    assert lights[0]["stage"]["ground"] != lights[1]["stage"]["ground"]
    assert page.get(f"/api/heads/{take['head_key']}.moon.json").status == 404
    assert page.get(f"/api/heads/{'0' * 24}.json").status == 404


def test_the_sound_of_a_take_is_played_from_anywhere_in_it(page: Page):
    page.done(page.post("/api/projects/line/take"))
    take = page.get("/api/projects/line/take").json
    whole = page.get(take["sound_url"])
    assert whole.fields["content-type"] == "audio/wav"
    samples, rate = soundfile.read(io.BytesIO(whole.data))
    assert len(samples) / rate == pytest.approx(take["duration_s"], abs=0.05)
    part = page.ask("GET", "/api/projects/line/sound", b"", ("range", "bytes=100-199"))
    assert (part.status, part.data) == (206, whole.data[100:200])
    peaks = page.get(take["peaks_url"]).json
    assert max(peaks["max"]) == pytest.approx(samples.max(), abs=0.05)
    assert len(peaks["max"]) == pytest.approx(take["duration_s"] * peaks["per_second"], abs=2)


def test_a_take_of_what_is_not_saved_leaves_the_project_alone(page: Page):
    """Two models or edits, one beside the other."""
    before = (page.folder / "line.elocute.json").read_bytes()
    first = page.done(page.post("/api/projects/line/take"))["result"]["take"]
    other = json.loads(before) | {"settings": {"fps": 30, "model": "articulation"}}
    second = page.done(page.post("/api/projects/line/take", json.dumps(other).encode()))
    assert second["result"]["take"] != first
    one, two = (
        page.get(f"/api/takes/{each}/weights") for each in (first, second["result"]["take"])
    )
    assert one.data != two.data and one.status == two.status == 200
    assert (page.folder / "line.elocute.json").read_bytes() == before


def test_what_was_computed_is_there_at_once(page: Page):
    """Undo, and the other side of a comparison; what the page keeps changes nothing."""
    record, _ = project_of(page, "line")
    first = page.done(page.post("/api/projects/line/take"))
    path = page.studio.cache / "takes" / first["result"]["take"] / "weights.f32"
    before = path.stat().st_mtime_ns
    other = record | {"locks": {"zoom": 2}, "options": {"light": "day"}}
    again = page.done(page.post("/api/projects/line/take", json.dumps(other).encode()))
    assert again["result"] == first["result"] and path.stat().st_mtime_ns == before
    path.with_name("take.json").unlink()
    made = page.done(page.post("/api/projects/line/take"))
    assert made["result"] == first["result"] and path.stat().st_mtime_ns > before


def test_the_cache_keeps_the_latest(tmp_path: Path):
    for age, name in enumerate(("old", "wanted", "young", "younger")):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (age, age))
    keep_latest(tmp_path, 2, {"wanted"})
    assert {each.name for each in tmp_path.iterdir()} == {"wanted", "young", "younger"}


def test_two_pages_lose_no_edit_of_each_other(page: Page):
    record, tag = project_of(page, "line")
    assert saved(page, "line", record | {"text": None, "locks": {"a": 1}}, tag).status == 200
    late = saved(page, "line", record | {"locks": {"b": 2}}, tag)
    assert late.status == 409 and "changed elsewhere" in late.json["error"]
    assert project_of(page, "line")[0]["locks"] == {"a": 1}
    assert saved(page, "line", record, "").status == 428
    # Somebody edits the file by hand.
    _, tag = project_of(page, "line")
    path = page.folder / "line.elocute.json"
    path.write_text(path.read_text() + "\n")
    assert saved(page, "line", record, tag).status == 409


def test_sounds_come_in_and_never_over_another(page: Page):
    added = page.ask("POST", "/api/projects?name=Gr%C3%B6%C3%9Fe%201.wav", hum())
    assert (added.status, added.json["name"]) == (201, "Größe 1")
    assert open_project(page.folder / "Größe 1.elocute.json").sound == "Größe 1.wav"
    before = left(page)
    again = page.ask("POST", "/api/projects?name=Gr%C3%B6%C3%9Fe%201.wav", hum(2.0))
    assert again.status == 409 and "exists already" in again.json["error"]
    # A sound of another kind would be a second project of the same name.
    assert page.ask("POST", "/api/projects?name=Gr%C3%B6%C3%9Fe%201.flac", hum()).status == 409
    assert left(page) == before
    listed = {each["name"]: each for each in page.get("/api/projects").json}
    assert listed["Größe 1"]["duration_s"] == pytest.approx(1.0)
    assert page.get("/api/projects/Gr%C3%B6%C3%9Fe%201").status == 200


def test_a_sound_that_lies_there_becomes_a_project(page: Page):
    (page.folder / "there.wav").write_bytes(hum())
    assert "there.wav" in page.get("/api/state").json["sounds"]
    assert page.ask("POST", "/api/projects?file=there.wav").status == 201
    assert "there.wav" not in page.get("/api/state").json["sounds"]
    assert page.ask("POST", "/api/projects?file=there.wav").status == 409
    assert (page.folder / "there.wav").read_bytes() == hum()


def test_the_sound_of_a_video_is_taken(page: Page, tmp_path: Path):
    from tests.study.studies import flashing

    flashing(tmp_path / "a.mp4", (9, 9, 9))
    data = (tmp_path / "a.mp4").read_bytes()
    added = page.ask("POST", "/api/projects?name=film.mp4", data)
    assert added.status == 201
    done = page.done(page.post("/api/projects/film/take"))
    assert done["state"] == DONE
    take = page.get("/api/projects/film/take").json
    assert take["duration_s"] == pytest.approx(1.2, abs=0.1)


def test_a_text_is_spoken(page: Page):
    if not page.get("/api/state").json["extras"]["speech"]:
        pytest.skip("needs the extra `tts`")
    added = page.ask("POST", "/api/projects?name=said.txt", b"Bob, my map!")
    assert added.status == 201, added
    record, _tag = project_of(page, "said")
    assert (record["text"], record["sound"]) == ("Bob, my map!", "said.wav")
    assert [each[2] for each in record["words"]] == ["Bob", "my", "map"]
    assert page.done(page.post("/api/projects/said/take"))["state"] == DONE
    take = page.get("/api/projects/said/take").json
    assert take["phones"] == record["phones"] and take["words"] == record["words"]
    bob = record["words"][0]
    assert any(bob[0] <= start < bob[1] for start, _ in take["contacts"])


def test_what_is_said_is_found_by_itself(whisper: Path, speech_wav: Path, tmp_path: Path):
    """Where a recogniser is there; what somebody has saved meanwhile stays."""
    with a_page(tmp_path, recogniser=str(whisper)) as page:
        assert page.get("/api/state").json["extras"]["transcribe"]
        data = speech_wav.read_bytes()
        for name in ("left", "edited"):
            assert page.ask("POST", f"/api/projects?name={name}.flac", data).status == 201
        record, tag = project_of(page, "edited")
        assert saved(page, "edited", record | {"text": ""}, tag).status == 200
        for job in page.get("/api/jobs").json:
            found = page.studio.jobs.find(job["id"])
            assert found is not None and found.ended.result(300).state == DONE
        assert eventually(lambda: project_of(page, "left")[0]["text"])
        text = project_of(page, "left")[0]["text"]
        assert len(text.split()) > 5 and project_of(page, "edited")[0]["text"] == ""
        assert page.done(page.post("/api/projects/left/take"))["state"] == DONE
        words = page.get("/api/projects/left/take").json["words"]
        assert len(words) == pytest.approx(len(text.split()), abs=3)


def bomb() -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a", bytes(5_000_000))
    return file.getvalue()


HOSTILE = {
    "empty.wav": b"",
    "zeros.wav": bytes(100_000),
    "noise.mp3": bytes(range(256)) * 400,
    "playlist.m3u8": b"#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n",
    "playlist.mp4": b"#EXTM3U\n#EXTINF:1,\nfile:///etc/passwd\n",
    "concat.wav": b"ffconcat version 1.0\nfile /etc/passwd\n",
    "page.wav": b"<script>alert(1)</script>",
    "bomb.wav": bomb(),
    "long.wav": b"RIFF\xff\xff\xff\xffWAVEfmt \x10\0\0\0\1\0\1\0"
    + b"\x80\x3e\0\0" * 2
    + b"\2\0\x10\0",
    "video.mkv": b"\x1a\x45\xdf\xa3" + bytes(1000),
    "text.txt": b"\xff\xff\xfe\0" * 100,
    "large.txt": b"a" * 200_001,
    "silent.txt": b" \n ",
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_sound_leaves_nothing(page: Page, name: str):
    before = left(page)
    answer = page.ask("POST", f"/api/projects?name={name}", HOSTILE[name])
    assert answer.status in (413, 422), answer
    error = answer.json["error"]
    assert "\n" not in error and str(page.folder) not in error and "root:x" not in error
    assert left(page) == before


GLB = b"glTF\x02\0\0\0"


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("a.glb", b""),
        ("a.glb", GLB),
        ("a.glb", GLB + b"\xff" * 1000),
        ("a.vrm", bytes(5000)),
        ("a.gltf", b'{"asset": {"version": "2.0"}, "buffers": [{"uri": "file:///etc/passwd"}]}'),
        ("a.gltf", b"[" * 100_000),
        ("a.obj", b"mtllib /etc/passwd\nv 0 0 0\n"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 4000000000\nend_header\n"),
        ("a.fbx", b"Kaydara FBX Binary  \0" + bytes(100)),
        ("a.pkl", b"cos\nsystem\n(S'touch /tmp/x'\ntR."),
        ("a.exe", b"MZ"),
    ],
)
def test_what_is_no_character_leaves_nothing(page: Page, name: str, data: bytes):
    before = left(page)
    answer = page.ask("POST", f"/api/characters?name={name}", data)
    assert answer.status == 422, answer
    assert "\n" not in answer.json["error"] and str(page.studio.cache) not in answer.json["error"]
    assert left(page) == before


@pytest.mark.shared_data
@pytest.mark.parametrize(
    "name", ["zeros_40M.glb", pytest.param("skin_90000x1000.glb", marks=pytest.mark.slow)]
)
def test_the_hostile_files_that_were_found_once(page: Page, shared_data: Path, name: str):
    case = shared_data.parent / "cases" / "attack" / name
    if not case.is_file():
        pytest.skip("needs the cases of attacks")
    before = left(page)
    answer = page.ask("POST", f"/api/characters?name={name}", case.read_bytes())
    assert answer.status == 422 and set(answer.json) == {"error"}, answer
    assert left(page) == before


def test_an_upload_that_is_cut_off_leaves_nothing(page: Page):
    before = left(page)

    async def half() -> int:
        status = []
        waiting = [{"type": "http.request", "body": hum()[:900], "more_body": True}]

        async def receive() -> dict[str, Any]:
            return waiting.pop() if waiting else {"type": "http.disconnect"}

        async def send(message: dict[str, Any]) -> None:
            status.append(message.get("status"))

        path = "/api/projects"
        fields = {"host": f"localhost:{PORT}", "authorization": f"Bearer {TOKEN}"}
        scope = {
            "type": "http",
            "http_version": "1.1",
            "method": "POST",
            "scheme": "http",
            "path": path,
            "raw_path": path.encode(),
            "query_string": b"name=half.wav",
            "headers": [(name.encode(), value.encode()) for name, value in fields.items()],
            "client": ("127.0.0.1", 1),
        }
        await page.app(scope, receive, send)
        return status[0]

    assert asyncio.run(half()) == 422
    assert left(page) == before and page.studio.uploads == 0


def test_a_character_is_reported_and_kept(page: Page, tmp_path: Path):
    from elocute import animate

    animate(np.zeros(1600, np.float32), rate=16000).write(tmp_path / "h.glb", embed_audio=True)
    data = (tmp_path / "h.glb").read_bytes()
    added = page.ask("POST", "/api/characters?name=hero.glb", data)
    assert added.status == 201, added
    assert "jawOpen" in added.json["mapped"] and {"fitted", "idle", "unknown"} <= set(added.json)
    assert page.get("/api/characters").json == ["hero.glb"]
    assert page.get("/api/characters/hero.glb").json["mapped"] == added.json["mapped"]
    assert page.ask("POST", "/api/characters?name=hero.glb", data).status == 409
    record, tag = project_of(page, "line")
    record |= {"character": "hero.glb", "settings": {"fps": 30}}
    assert saved(page, "line", record, tag).status == 200
    assert page.done(page.post("/api/projects/line/take"))["state"] == DONE
    take = page.get("/api/projects/line/take").json
    assert take["character"] == "hero.glb"
    # What is seen is the character: its own head, with the shapes of its own file.
    body = page.get(take["head_url"]).data
    names = parts_of_glb(body)[0]["meshes"][0]["extras"]["targetNames"]
    moves = np.frombuffer(page.get(take["moves_url"]).data, "<f4").reshape(take["frames"], -1)
    assert moves.shape[1] == len(names) and moves[:, names.index("jawOpen")].max() > 0.1
    page.done(page.post("/api/projects/line/export", b'{"format": "glb", "name": "onhero"}'))
    assert (page.folder / "onhero.glb").read_bytes()[:4] == b"glTF"
    record, tag = project_of(page, "line")
    assert saved(page, "line", record | {"character": None}, tag).status == 200


def test_shapes_whose_names_say_nothing_are_explained(page: Page):
    data = glb(record(("Kopf", ["Mund_auf", "Kussmund", "Ohr"])))
    added = page.ask("POST", "/api/characters?name=kopf.glb", data)
    assert added.status == 201 and set(added.json["unknown"]) == {"Mund_auf", "Kussmund", "Ohr"}
    project, tag = project_of(page, "line")
    asked = project | {"character": "kopf.glb", "settings": {"fps": 30}}
    assert saved(page, "line", asked, tag).status == 200
    failed = page.done(page.post("/api/projects/line/take"))
    assert failed["state"] == FAILED and "kopf.names.json" in failed["error"]

    def say(names: object) -> Any:
        return page.ask("PUT", "/api/characters/kopf.glb/names", json.dumps(names).encode(), JSON)

    said = {"Mund_auf": "jawOpen", "Kussmund": {"mouthPucker": 0.8}}
    told = say(said)
    assert told.status == 200 and told.json["unknown"] == {"Ohr": ""}
    assert told.json["names"] == said and set(told.json["fitted"]) == {"Mund_auf", "Kussmund"}
    assert page.done(page.post("/api/projects/line/take"))["state"] == DONE
    before = page.get("/api/projects/line/take").json["digest"]
    for wrong in ({"Mund_auf": "jawOpem"}, {"Mund_auf": {"jawOpen": 7}}, [1], "x"):
        answer = say(wrong)
        assert answer.status == 422 and "kopf.names.json" in answer.json["error"], answer
    kept = json.loads((page.folder / "kopf.names.json").read_text(encoding="utf-8"))
    assert kept == said and page.get("/api/characters/kopf.glb").json["names"] == said
    assert say(said | {"Ohr": None}).json["idle"] == {"Ohr": "left alone"}
    page.done(page.post("/api/projects/line/take"))
    assert page.get("/api/projects/line/take").json["digest"] != before
    again, tag = project_of(page, "line")
    assert saved(page, "line", again | {"character": None}, tag).status == 200


def test_names_that_are_a_link_are_not_read(page: Page, tmp_path: Path):
    (tmp_path / "secret.json").write_text('{"secret": "jawOpen"}')
    (page.folder / "linked.glb").write_bytes(glb(arkit()))
    (page.folder / "linked.names.json").symlink_to(tmp_path / "secret.json")
    answer = page.get("/api/characters/linked.glb")
    assert answer.status == 422 and b"secret" not in answer.data
    for name in ("linked.glb", "linked.names.json"):
        (page.folder / name).unlink()


def test_an_export_lies_beside_its_project(page: Page):
    done = page.done(page.post("/api/projects/line/export", b'{"format": "csv"}'))
    assert (done["state"], done["result"]["file"]) == (DONE, "line.csv")
    fetched = page.get(f"/api/jobs/{done['id']}/file")
    assert fetched.data == (page.folder / "line.csv").read_bytes()
    assert 'filename="line.csv"' in fetched.fields["content-disposition"]
    # Its own file is replaced; one that somebody changed is not.
    assert page.done(page.post("/api/projects/line/export", b'{"format": "csv"}'))["state"] == DONE
    (page.folder / "line.csv").write_text("mine")
    refused = page.done(page.post("/api/projects/line/export", b'{"format": "csv"}'))
    assert refused["state"] == FAILED and "was changed since it was made" in refused["error"]
    assert (page.folder / "line.csv").read_text() == "mine"


@pytest.mark.parametrize(
    "body",
    [
        b"{}",
        b'{"format": "exe"}',
        b'{"format": "../../x"}',
        b'{"format": "csv", "name": "../x"}',
        b'{"format": "csv", "name": ".x"}',
        b'{"format": 3}',
        b'{"format": "json", "name": "other.elocute"}',
        b'{"format": "mp4", "options": {"size": [99999, 1]}}',
        b'{"format": "mp4", "options": {"background": "/etc/passwd"}}',
        b'{"format": "mp4", "options": {"background": "../a.png"}}',
        b'{"format": "csv", "options": {"size": [64, 64]}}',
        b'{"format": "csv", "path": "/tmp/x"}',
    ],
)
def test_an_export_goes_nowhere_else(page: Page, body: bytes):
    before = left(page)
    answer = page.post("/api/projects/line/export", body)
    assert answer.status == 422 and set(answer.json) == {"error"}
    assert left(page) == before


def test_uploads_come_in_while_an_export_is_made(page: Page):
    started = page.post("/api/projects/line/export", b'{"format": "npz", "name": "slow"}')
    assert page.ask("POST", "/api/projects?name=while.wav", hum()).status == 201
    assert page.done(started)["state"] == DONE


def test_a_take_takes_the_place_of_the_one_before(page: Page):
    """Somebody drags on: the earlier take is of no use."""
    record, _ = project_of(page, "line")
    started = [
        page.post(
            "/api/projects/line/take", json.dumps(record | {"settings": {"seed": seed}}).encode()
        )
        for seed in range(4)
    ]
    states = [page.done(each)["state"] for each in started]
    assert states[-1] == DONE and CANCELLED in states


def test_cancelling_by_the_page(page: Page):
    started = page.post("/api/projects/line/export", b'{"format": "mp4", "name": "film2"}')
    cancelled = page.ask("DELETE", f"/api/jobs/{started.json['job']}")
    assert (cancelled.status, cancelled.json["state"]) == (200, CANCELLED)
    assert not (page.folder / "film2.mp4").exists()
    assert page.get(f"/api/jobs/{started.json['job']}/file").status == 404


def test_what_is_spelled_once_is_what_the_page_is_told(page: Page):
    from elocute.export.registry import WRITERS
    from elocute.models.take_settings import TakeSettings
    from elocute.settings import settings_of

    state = page.get("/api/state").json
    named = [each["name"] for each in state["settings"]]
    assert named == [
        f.name for f, _ in settings_of(TakeSettings) if f.name not in ("head", "edits")
    ]
    fps = next(each for each in state["settings"] if each["name"] == "fps")
    assert (fps["low"], fps["high"], fps["unit"]) == (1.0, 240.0, fps["unit"])
    assert [f".{each}" for each in state["formats"]] == list(WRITERS)
    assert "broad" in state["styles"] and "happy" in state["moods"] and "P" in state["phones"]


def test_the_folder_is_read_as_it_is_now(page: Page):
    """Projects that somebody copies in, and files that are none."""
    shutil.copy(page.folder / "line.elocute.json", page.folder / "copy.elocute.json")
    (page.folder / "broken.elocute.json").write_text("{")
    listed = {each["name"]: each for each in page.get("/api/projects").json}
    assert listed["copy"]["sound"] == "line.flac" and "no JSON" in listed["broken"]["error"]
    assert page.post("/api/projects/broken/take").status == 422
    for name in ("copy", "broken"):
        (page.folder / f"{name}.elocute.json").unlink()
    assert page.get("/api/projects/copy").status == 404


def test_an_unknown_job_is_not_there(page: Page):
    assert page.get("/api/jobs/" + "0" * 16).status == 404
    assert page.ask("DELETE", "/api/jobs/" + "0" * 16).status == 404
    assert page.studio.jobs.find("x") is None
    assert isinstance(page.get("/api/jobs").json, list)
    assert Task("about", {"recogniser": "base"}).what == "about"
