"""Frames as parameters of VTube Studio, over its own WebSocket (port 8001; public API 1.0).

The user allows it once, in VTube Studio; the token that it then gives is kept in the state folder.
"""

from __future__ import annotations

import contextlib
import itertools
import json
import sys
import threading
from collections.abc import Mapping
from typing import Any

from elocute.errors import ElocuteError, needs_extra, printable
from elocute.files.json_records import as_record, parse_json, read_record, write_record
from elocute.files.output_history import state_folder
from elocute.files.reading import FileKind
from elocute.live.live_frame import LiveFrame
from elocute.live.targets import Access
from elocute.motion.curves import ARKIT_NAMES

with needs_extra("VTube Studio", "live"):
    from websockets.exceptions import WebSocketException
    from websockets.sync.client import ClientConnection, connect

PLUGIN = {"pluginName": "Elocute", "pluginDeveloper": "Elocute"}
API = {"apiName": "VTubeStudioPublicAPI", "apiVersion": "1.0"}
TOKEN_NAME = "vtube-studio.json"
TOKEN_FILE = FileKind("VTube Studio token", 10_000)
ANSWER_S, ALLOWED_S, AGAIN_S = 5.0, 300.0, 2.0
"""How long an answer, and the user's own, is waited for; when a connection is tried again."""
KEEP_S = 0.5
"""A parameter that is not sent for a second is lost."""
ANSWER_MAX_BYTES = 1 << 20
DENIED = 50
VOWELS = ("aa", "ih", "ou", "ee", "oh")


class RefusedError(ElocuteError):
    """What VTube Studio refuses, with its number."""

    def __init__(self, text: str, number: int) -> None:
        super().__init__(text)
        self.number = number


class VTubeStudio:
    """Sends the newest frame, from a thread of its own, which connects again where it must."""

    has_clock = False

    def __init__(self, place: tuple[str, int], access: Access) -> None:
        host = f"[{place[0]}]" if ":" in place[0] else place[0]
        self.address = f"ws://{host}:{place[1]}"
        self.failures = 0
        self._frame: LiveFrame | None = None
        self._there, self._ended = threading.Event(), threading.Event()
        self._numbers = itertools.count()
        self._said: set[str] = set()
        self._connection: ClientConnection | None = None
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()

    def send(self, frame: LiveFrame) -> None:
        """Let a frame be the next; one that was not sent yet is lost, and counted."""
        self.failures += self._there.is_set()
        self._frame = frame
        self._there.set()

    def close(self) -> None:
        """End the connection."""
        self._ended.set()
        self._there.set()
        if self._connection is not None:
            self._connection.close()
        self._thread.join(ANSWER_S)

    def _work(self) -> None:
        while not self._ended.is_set():
            try:
                with connect(
                    self.address, proxy=None, open_timeout=ANSWER_S, max_size=ANSWER_MAX_BYTES
                ) as connection:
                    self._connection = connection
                    self._authenticate(connection)
                    self._send_all(connection, self._parameters(connection))
            except RefusedError as error:
                self._say(str(error))
                if error.number == DENIED:  # another question would be a nuisance
                    return
            except (OSError, EOFError, WebSocketException, ElocuteError) as error:
                self._say(f"VTube Studio at {self.address}: {str(error) or type(error).__name__}")
            self._ended.wait(AGAIN_S)

    def _say(self, text: str) -> None:
        """Tell what is the matter, once until frames are sent."""
        line = printable(" ".join(text.split()))[:200]
        if line not in self._said and not self._ended.is_set():
            print(f"elocute: {line}", file=sys.stderr, flush=True)
        self._said.add(line)

    def _authenticate(self, connection: ClientConnection) -> None:
        token = _kept_token()
        if token and self._knows(connection, token):
            return
        self._say("allow Elocute in VTube Studio")
        given = self._ask(connection, "AuthenticationTokenRequest", PLUGIN, within_s=ALLOWED_S)
        token = given.get("authenticationToken")
        if not isinstance(token, str) or not self._knows(connection, token):
            raise RefusedError("VTube Studio knows its own token no more", 0)
        _keep_token(token)

    def _knows(self, connection: ClientConnection, token: str) -> bool:
        asked = {**PLUGIN, "authenticationToken": token}
        return self._ask(connection, "AuthenticationRequest", asked).get("authenticated") is True

    def _parameters(self, connection: ClientConnection) -> set[str]:
        """Names of the parameters that there are, once ours are created."""
        for name in ARKIT_NAMES:
            asked = {
                "parameterName": _own(name),
                "explanation": f"ARKit's {name}, from speech",
                "min": 0,
                "max": 1,
                "defaultValue": 0,
            }
            self._ask(connection, "ParameterCreationRequest", asked)
        given = self._ask(connection, "InputParameterListRequest", {})
        lists = [given.get("defaultParameters"), given.get("customParameters")]
        listed = [each for part in lists if isinstance(part, list) for each in part]
        return {str(each.get("name")) for each in listed if isinstance(each, dict)}

    def _send_all(self, connection: ClientConnection, known: set[str]) -> None:
        self._said.clear()
        while not self._ended.is_set():
            self._there.wait(KEEP_S)
            self._there.clear()
            if (frame := self._frame) is not None:
                values = [
                    {"id": name, "value": round(value, 4)}
                    for name, value in parameters(frame).items()
                    if name in known
                ]
                asked = {"faceFound": True, "mode": "set", "parameterValues": values}
                self._ask(connection, "InjectParameterDataRequest", asked)

    def _ask(
        self,
        connection: ClientConnection,
        kind: str,
        data: Mapping[str, Any],
        within_s: float = ANSWER_S,
    ) -> dict[str, Any]:
        """What is answered to a request. Raises RefusedError."""
        number = f"elocute{next(self._numbers)}"
        request = {**API, "requestID": number, "messageType": kind, "data": data}
        connection.send(json.dumps(request))
        while True:
            text = connection.recv(timeout=within_s)
            answer = as_record(
                parse_json(text, "VTube Studio", allowed="JSON"), "answer", "a record"
            )
            if answer.get("requestID") == number:  # others are events
                break
        given = as_record(answer.get("data", {}), "answer", "a record")
        if answer.get("messageType") == "APIError":
            fault = given.get("errorID")
            text = f"VTube Studio refuses {kind}: {str(given.get('message'))[:120]}"
            raise RefusedError(text, fault if isinstance(fault, int) else 0)
        return given


def parameters(frame: LiveFrame) -> dict[str, float]:
    """Values of VTube Studio's own parameters, and of ours, by name.

    Angles in degrees, to the right and up on the screen, as Live2D has them; 1 is an open eye, and
    a half a mouth and brows at rest.
    """
    curves, vowels = frame.arkit, frame.vrm
    yaw, pitch, roll = (180 * frame.head_turns).tolist()
    smile = _both(curves, "mouthSmile") + _both(curves, "mouthDimple") / 2
    frown = _both(curves, "mouthFrown") + curves["mouthPucker"] / 2
    values = {
        "FaceAngleX": yaw,
        "FaceAngleY": -pitch,
        "FaceAngleZ": -roll,
        "MouthOpen": max(0.0, curves["jawOpen"] - curves["mouthClose"]),
        "MouthSmile": min(1.0, max(0.0, (1 + smile - frown) / 2)),
        "MouthX": curves["mouthLeft"] - curves["mouthRight"],
        "TongueOut": curves["tongueOut"],
        "CheekPuff": curves["cheekPuff"],
        **{f"Voice{name}": vowels[of] for name, of in zip("AIUEO", VOWELS, strict=True)},
    }
    for side in ("Left", "Right"):
        brow = curves[f"browOuterUp{side}"] + curves["browInnerUp"] - curves[f"browDown{side}"]
        values[f"Brow{side}Y"] = min(1.0, max(0.0, 0.5 + brow / 2))
        values[f"EyeOpen{side}"] = 1 - curves[f"eyeBlink{side}"]
        to_left, to_right = ("Out", "In") if side == "Left" else ("In", "Out")
        values[f"Eye{side}X"] = (
            curves[f"eyeLook{to_left}{side}"] - curves[f"eyeLook{to_right}{side}"]
        )
        values[f"Eye{side}Y"] = curves[f"eyeLookUp{side}"] - curves[f"eyeLookDown{side}"]
    values["Brows"] = (values["BrowLeftY"] + values["BrowRightY"]) / 2
    return values | {_own(name): curves[name] for name in ARKIT_NAMES}


def _both(curves: dict[str, float], name: str) -> float:
    return (curves[f"{name}Left"] + curves[f"{name}Right"]) / 2


def _own(curve: str) -> str:
    """A parameter of ours: ElocuteJawOpen."""
    return f"Elocute{curve[0].upper()}{curve[1:]}"


def _kept_token() -> str:
    with contextlib.suppress(ElocuteError, OSError):
        token = read_record(state_folder() / TOKEN_NAME, TOKEN_FILE).get("token")
        return token if isinstance(token, str) else ""
    return ""


def _keep_token(token: str) -> None:
    """Remember a token; where that fails, the user is asked again the next time."""
    with contextlib.suppress(ElocuteError, OSError):
        state_folder().mkdir(parents=True, exist_ok=True)
        write_record(state_folder() / TOKEN_NAME, {"token": token})
        (state_folder() / TOKEN_NAME).chmod(0o600)
