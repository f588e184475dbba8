"""VTube Studio's side, as its public API 1.0 is described: what it gets, and what it may refuse."""

from __future__ import annotations

import contextlib
import json
import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("websockets")

from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

import elocute
from elocute.live import vtube_studio
from elocute.live.live_frame import LiveFrame
from elocute.live.targets import Access, open_outputs
from elocute.live.vtube_studio import VTubeStudio, parameters
from elocute.numerics.quaternions import from_axis_angle
from tests.support.browser import eventually

OWN = ("FaceAngleX", "FaceAngleY", "FaceAngleZ", "MouthOpen", "MouthSmile", "VoiceA", "Brows")


class Studio:
    """A server that knows the requests which are sent here, and refuses the others."""

    def __init__(self, answer: Callable[[str], Any] = lambda kind: None) -> None:
        self.allows, self.asked, self.tokens = True, 0, {"old"}
        self.created: dict[str, dict] = {}
        self.injected: list[dict[str, float]] = []
        self.kinds: list[str] = []
        self._answer = answer
        self._open: set[ServerConnection] = set()
        self.port = 0
        self.start()

    def start(self) -> None:
        self._server = serve(self._talk, "127.0.0.1", self.port)
        self.port = self._server.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    def stop(self) -> None:
        self._server.shutdown()
        for connection in self._open:
            connection.close()
        self._thread.join()

    def _talk(self, connection: ServerConnection) -> None:
        self._open.add(connection)
        with contextlib.suppress(ConnectionClosed):
            self._answer_all(connection)

    def _answer_all(self, connection: ServerConnection) -> None:
        authenticated = False
        for text in connection:
            request = json.loads(text)
            kind, data = request["messageType"], request.get("data", {})
            assert request["apiName"] == "VTubeStudioPublicAPI" and request["apiVersion"] == "1.0"
            assert 0 < len(request["requestID"]) <= 64
            self.kinds.append(kind)
            if (other := self._answer(kind)) is not None:
                connection.send(other)
                continue
            given: dict[str, Any] = {}
            if kind == "AuthenticationTokenRequest":
                self.asked += 1
                self.tokens.add("new")
                given = {"authenticationToken": "new"}
                if not self.allows:
                    given = {"errorID": 50, "message": "User has denied API access."}
            elif kind == "AuthenticationRequest":
                assert 3 <= len(data["pluginName"]) <= 32
                authenticated = data["authenticationToken"] in self.tokens
                given = {"authenticated": authenticated, "reason": ""}
            elif not authenticated:
                given = {"errorID": 8, "message": "Not authenticated."}
            elif kind == "ParameterCreationRequest":
                assert data["parameterName"].isalnum() and 4 <= len(data["parameterName"]) <= 32
                self.created[data["parameterName"]] = data
            elif kind == "InputParameterListRequest":
                given = {
                    "defaultParameters": [{"name": name} for name in OWN],
                    "customParameters": [{"name": name} for name in self.created],
                }
            elif kind == "InjectParameterDataRequest":
                values = {each["id"]: each["value"] for each in data["parameterValues"]}
                assert data["faceFound"] is True and data["mode"] == "set"
                assert set(values) <= {*OWN, *self.created}
                self.injected.append(values)
            name = "APIError" if "errorID" in given else kind.replace("Request", "Response")
            answer = {**request, "messageType": name, "data": given, "timestamp": 0}
            connection.send(json.dumps({**answer, "requestID": "an event"}))  # not ours
            connection.send(json.dumps(answer))


@pytest.fixture(autouse=True)
def _soon(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(vtube_studio, "AGAIN_S", 0.05)
    monkeypatch.setenv("ELOCUTE_STATE", str(tmp_path / "state"))


@pytest.fixture
def studio() -> Iterator[Studio]:
    made = Studio()
    yield made
    made.stop()


@pytest.fixture(scope="module")
def open_mouth(speech_wav) -> LiveFrame:
    """The frame whose jaw is lowest, with a head that is turned to its own left."""
    samples = elocute.read_audio(speech_wav, sample_rate=16000).samples[:24000]
    frames = elocute.stream(16000, lookahead=0.3).push(samples)
    widest = max((LiveFrame(0, 60.0, each) for each in frames), key=lambda f: f.arkit["jawOpen"])
    rotations = widest.frame.rotations.copy()
    rotations[:] = [1, 0, 0, 0]
    turn = from_axis_angle(np.array([0.0, np.radians(20), 0.0]))
    rotations[widest.motion.head.joint_names.index("head")] = turn
    return replace(widest, frame=replace(widest.frame, rotations=rotations))


def sending(studio: Studio, frame: LiveFrame) -> VTubeStudio:
    """An output that has sent a frame."""
    (output,) = open_outputs([f"vts=127.0.0.1:{studio.port}"])
    assert isinstance(output, VTubeStudio)
    before = len(studio.injected)
    output.send(frame)
    assert eventually(lambda: len(studio.injected) > before)
    return output


def test_parameters_are_created_and_set(studio, open_mouth):
    output = sending(studio, open_mouth)
    output.close()
    values, curves = studio.injected[-1], open_mouth.arkit
    assert len(studio.created) == 52 and studio.created["ElocuteJawOpen"]["max"] == 1
    assert set(values) == {*OWN, *studio.created}  # what this VTube Studio does not have is left
    assert values["ElocuteJawOpen"] == pytest.approx(curves["jawOpen"], abs=1e-4) and (
        curves["jawOpen"] > 0.1
    )
    assert values["MouthOpen"] == pytest.approx(curves["jawOpen"] - curves["mouthClose"], abs=1e-4)
    assert values["VoiceA"] == pytest.approx(open_mouth.vrm["aa"], abs=1e-4)
    # To its own left is to the right on the screen.
    assert values["FaceAngleX"] == pytest.approx(20, abs=0.01)
    assert (values["FaceAngleY"], values["FaceAngleZ"]) == pytest.approx((0, 0), abs=0.01)


def test_the_user_is_asked_once(studio, open_mouth, capfd):
    sending(studio, open_mouth).close()
    assert "elocute: allow Elocute in VTube Studio" in capfd.readouterr().err
    sending(studio, open_mouth).close()
    assert studio.asked == 1 and capfd.readouterr().err == ""
    studio.tokens.clear()  # revoked by the user
    sending(studio, open_mouth).close()
    assert studio.asked == 2


def test_who_denies_is_not_asked_again(studio, open_mouth, capfd):
    studio.allows = False
    output = VTubeStudio(("127.0.0.1", studio.port), Access())
    output.send(open_mouth)
    assert eventually(lambda: not output._thread.is_alive())
    output.close()
    assert studio.asked == 1
    assert "User has denied API access." in capfd.readouterr().err


def test_a_parameter_is_never_lost_while_nothing_new_comes(studio, open_mouth, monkeypatch):
    monkeypatch.setattr(vtube_studio, "KEEP_S", 0.05)
    output = sending(studio, open_mouth)
    assert eventually(lambda: len(studio.injected) > 4)
    output.close()
    assert studio.injected[-1] == studio.injected[0]


def test_it_connects_again(studio, open_mouth):
    output = sending(studio, open_mouth)
    studio.stop()
    output.send(open_mouth)
    before = len(studio.injected)
    studio.start()

    def sent() -> bool:
        output.send(open_mouth)
        return len(studio.injected) > before

    assert eventually(sent)
    output.close()
    assert studio.asked == 1


@pytest.mark.parametrize(
    "answer", ["nonsense", b"\xff\xfe", "[1]", '{"requestID": 1}', "[" * 9000, "x" * 2_000_000]
)
def test_strange_answers_are_one_line(answer, open_mouth, capfd, monkeypatch):
    monkeypatch.setattr(vtube_studio, "ALLOWED_S", 0.3)
    studio = Studio(lambda kind: answer)
    output = VTubeStudio(("127.0.0.1", studio.port), Access())
    output.send(open_mouth)
    assert eventually(lambda: len(studio.kinds) > 2)  # it goes on trying
    output.close()
    studio.stop()
    said = capfd.readouterr().err.splitlines()
    assert 1 <= len(said) <= 3 and all(line.startswith("elocute: ") for line in said)


def test_nobody_needs_to_be_there(open_mouth, capfd):
    output = VTubeStudio(("127.0.0.1", 1), Access())
    output.send(open_mouth)
    output.send(open_mouth)
    assert output.failures == 1
    assert eventually(lambda: "ws://127.0.0.1:1" in capfd.readouterr().err)
    output.close()


def test_brows_lids_and_eyes_are_as_live2d_has_them(open_mouth):
    names, values = open_mouth.frame.names, open_mouth.frame.values.copy()
    values[:] = 0
    for name, value in (("eyeBlinkLeft", 1), ("eyeLookOutLeft", 0.5), ("browInnerUp", 0.6)):
        values[names.index(name)] = value
    given = parameters(replace(open_mouth, frame=replace(open_mouth.frame, values=values)))
    assert (given["EyeOpenLeft"], given["EyeOpenRight"]) == (0, 1)
    assert given["EyeLeftX"] == 0.5  # to its own left, the right of the screen
    assert given["Brows"] == pytest.approx(0.8, abs=0.01) and given["MouthSmile"] == 0.5
