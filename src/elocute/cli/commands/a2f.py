"""`elocute a2f`: the service of Audio2Face-3D, for programs that were made for NVIDIA's."""

from __future__ import annotations

import contextlib
import sys
import time

import typer

from elocute.cli import options


def a2f_command(
    port: int = typer.Option(52000, min=1, max=65535, help="Port to listen on."),
    lookahead: float = typer.Option(0.25, help="Sound that a frame waits for in s (0.21 to 10)."),
    fps: float = options.take_option("fps", 30.0),
    style: str = options.take_option("style"),
    strength: float = options.take_option("strength"),
    life: str = options.take_option("life"),
    mood: str = options.take_option("mood"),
    seed: int = options.take_option("seed"),
    identity: str = options.take_option("identity"),
    allow_remote: bool = typer.Option(
        False, "--allow-remote", help="Let other machines in, unencrypted, who know the token."
    ),
) -> None:
    """Answer programs made for NVIDIA's Audio2Face-3D: sound in, ARKit's weights out, over gRPC.

    It ends when it is interrupted. Other machines need --allow-remote and send the token of
    ELOCUTE_LIVE_TOKEN, else one is made, as "authorization: Bearer TOKEN".
    """
    from elocute.errors import Interrupted
    from elocute.live.a2f import A2FService, serving
    from elocute.models.streaming import Stream, stream
    from elocute.serving.gate import access_token

    settings = {"style": style, "strength": strength, "life": life, "mood": mood, "seed": seed}

    def open_stream(rate: int) -> Stream:
        return stream(rate, fps=fps, lookahead=lookahead, identity=identity, **settings)

    open_stream(48000)  # what cannot be is told now, and the first client does not wait
    token = access_token(allow_remote=allow_remote)
    host = "0.0.0.0" if allow_remote else "127.0.0.1"
    with serving(A2FService(open_stream, token=token), host, port) as opened:
        known = f", token {token}" if token else ""
        print(f"elocute: Audio2Face-3D at {host}:{opened}{known}", file=sys.stderr, flush=True)
        with contextlib.suppress(KeyboardInterrupt, Interrupted):  # the usual end
            while True:
                time.sleep(3600)
