"""An avatar of TalkingHead speaks in the browser, with curves made while its voice comes in.

npm install @met4citizen/talkinghead      # in this folder, once
python serve.py avatar.glb speech.wav     # then open the address that it prints

The avatar needs ARKit's shapes, Oculus's visemes and Mixamo's bones. The recording stands for the
voice of an agent: it is given in pieces, as services of speech do.
"""

import argparse
import json
import shutil
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import elocute
from elocute.agents import talkinghead_parts

CLIP = Path(elocute.__file__).parent / "assets" / "example.flac"
RATE = 24000


def voice(speech: Path, piece_s: float = 0.2) -> Iterator[bytes]:
    """The recording in pieces of samples of 16 bits."""
    pcm = (elocute.read_audio(speech, sample_rate=RATE).samples * 32767).astype("<i2").tobytes()
    size = 2 * round(RATE * piece_s)
    for start in range(0, len(pcm), size):
        yield pcm[start : start + size]


class Page(SimpleHTTPRequestHandler):
    """This folder, the avatar, and what it says: a part a line, each as soon as it is made."""

    def __init__(self, *arguments, avatar: Path, speech: Path):
        self.avatar, self.speech = avatar, speech
        super().__init__(*arguments, directory=str(Path(__file__).parent))

    def do_GET(self) -> None:
        if self.path not in ("/avatar.glb", "/speech"):
            super().do_GET()
            return
        self.send_response(200)
        self.end_headers()
        if self.path == "/avatar.glb":
            with self.avatar.open("rb") as file:
                shutil.copyfileobj(file, self.wfile)
            return
        for part in talkinghead_parts(voice(self.speech), RATE, mood="happy"):
            self.wfile.write(json.dumps(part).encode() + b"\n")

    def log_message(self, *_) -> None:
        """Nothing is printed for each request."""


def main() -> None:
    parser = argparse.ArgumentParser(description="Serve an avatar that speaks.")
    parser.add_argument("avatar", type=Path)
    parser.add_argument("speech", nargs="?", default=CLIP, type=Path)
    parser.add_argument("--port", default=8080, type=int)
    given = parser.parse_args()
    page = partial(Page, avatar=given.avatar, speech=given.speech)
    with ThreadingHTTPServer(("127.0.0.1", given.port), page) as server:
        print(f"http://127.0.0.1:{server.server_port}/", flush=True)
        server.serve_forever()


if __name__ == "__main__":
    main()
