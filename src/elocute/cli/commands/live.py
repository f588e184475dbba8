"""`elocute live`: speech animated while it is spoken, sent to programs that show it."""

from __future__ import annotations

import contextlib
import json
import sys
from typing import Any

import typer

from elocute.cli import options
from elocute.cli.pipes import PIPE
from elocute.live.targets import TARGETS

MICROPHONE, CONNECTIONS = "mic", "ws"


def live_command(
    source: str = typer.Argument(
        ..., help="A sound file, played at its own pace; - for samples of 16 bits; mic; ws."
    ),
    to: list[str] = typer.Option(
        [CONNECTIONS],
        "--to",
        help="Where frames go: NAME, NAME=HOST or NAME=HOST:PORT, of "
        + ", ".join(f"{name} ({target.about})" for name, target in TARGETS.items())
        + ". Can be repeated.",
    ),
    rate: int = typer.Option(48000, help="Sample rate of standard input or microphone in Hz."),
    lookahead: float = typer.Option(0.25, help="Delay of a frame in s (0.21 to 10)."),
    fps: float = options.take_option("fps"),
    style: str = options.take_option("style"),
    strength: float = options.take_option("strength"),
    life: str = options.take_option("life"),
    mood: str = options.take_option("mood"),
    seed: int = options.take_option("seed"),
    identity: str = options.take_option("identity"),
    origin: list[str] = typer.Option(
        [], help="A web page that may connect, http://localhost:5173. Can be repeated."
    ),
    allow_remote: bool = typer.Option(
        False, "--allow-remote", help="Also send to other machines, and let them in, unencrypted."
    ),
    as_json: bool = options.Json,
) -> None:
    """Animate speech while it is spoken, and send each frame to programs that show it.

    With ws sound comes from those who connect. It ends with the sound, or when it is interrupted.
    Other machines need --allow-remote and the token of ELOCUTE_LIVE_TOKEN, else one is made.
    """
    import numpy as np

    from elocute.live.targets import Access, open_outputs
    from elocute.models.streaming import stream
    from elocute.serving.gate import access_token

    settings = {"style": style, "strength": strength, "life": life, "mood": mood, "seed": seed}

    def open_stream(rate: int) -> Any:
        return stream(rate, fps=fps, lookahead=lookahead, identity=identity, **settings)

    live = open_stream(rate)
    open_stream(rate).push(np.zeros(rate // 2, np.float32))  # opens the network before any sound
    blocks = None if source == CONNECTIONS else _blocks(source, rate)
    token = access_token(allow_remote=allow_remote)
    outputs = open_outputs(to, Access(allow_remote, token, tuple(origin)))
    names = ", ".join(each.address for each in outputs)
    print(f"elocute: sending to {names}, {live.lookahead_s:g} s late", file=sys.stderr)
    try:
        sent = _sent(blocks, live, outputs, open_stream)
    finally:
        for output in outputs:
            output.close()
    record: dict[str, Any] = {
        "sent": sent.sent,
        "dropped": sent.dropped,
        "refused": sum(output.failures for output in outputs),
        "late_most_s": round(sent.late_most_s, 4),
    }
    print(
        json.dumps(record)
        if as_json
        else f"{record['sent']} frames sent, {record['dropped']} dropped"
    )


def _sent(blocks: Any, live: Any, outputs: Any, open_stream: Any) -> Any:
    """Send what is heard, or what connections bring, until it ends."""
    import time

    from elocute.errors import InputError, Interrupted
    from elocute.live.sender import send_live

    if blocks is not None:
        return send_live(blocks, live, outputs)
    from elocute.live.ws_server import LiveServer

    servers = [output for output in outputs if isinstance(output, LiveServer)]
    if not servers:
        raise InputError.about("`to`", found="no ws", allowed="ws, which brings the sound")
    servers[0].hear(open_stream, outputs)
    with contextlib.suppress(KeyboardInterrupt, Interrupted):
        while True:
            time.sleep(3600)
    return servers[0].main.sent


def _blocks(source: str, rate: int) -> Any:
    """Blocks of the sound that was named. Raises InputError, AudioError."""
    from pathlib import Path

    from elocute.audio.read import probe_audio
    from elocute.live.sources import file_blocks, microphone_blocks, pcm_blocks

    if source == MICROPHONE:
        return microphone_blocks(rate)
    if source == str(PIPE):
        return pcm_blocks(rate)
    probe_audio(Path(source))
    return file_blocks(Path(source), rate)
