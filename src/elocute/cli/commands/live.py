"""`elocute live`: speech animated while it is spoken, sent to programs that show it."""

from __future__ import annotations

import json
import sys
from typing import Any

import typer

from elocute.cli import options
from elocute.cli.pipes import PIPE
from elocute.live.targets import TARGETS

MICROPHONE = "mic"


def live_command(
    source: str = typer.Argument(
        ..., help="A sound file, played at its own pace; - for samples of 16 bits; mic."
    ),
    to: list[str] = typer.Option(
        ...,
        "--to",
        help="Where frames go: NAME, NAME=HOST or NAME=HOST:PORT, of "
        + ", ".join(f"{name} ({target.about})" for name, target in TARGETS.items())
        + ". Can be repeated.",
    ),
    rate: int = typer.Option(48000, help="Sample rate of standard input or microphone in Hz."),
    lookahead: float = typer.Option(0.3, help="Delay of a frame in s (0.3 to 10)."),
    fps: float = options.take_option("fps"),
    style: str = options.take_option("style"),
    strength: float = options.take_option("strength"),
    life: str = options.take_option("life"),
    mood: str = options.take_option("mood"),
    seed: int = options.take_option("seed"),
    identity: str = options.take_option("identity"),
    allow_remote: bool = typer.Option(
        False, "--allow-remote", help="Also send to other machines, unencrypted."
    ),
    as_json: bool = options.Json,
) -> None:
    """Animate speech while it is spoken, and send each frame over UDP.

    It ends with the sound, or when it is interrupted. No port is opened.
    """
    from elocute.live.sender import send_live
    from elocute.live.targets import open_outputs
    from elocute.models.streaming import stream

    settings = {"style": style, "strength": strength, "life": life, "mood": mood, "seed": seed}
    live = stream(rate, fps=fps, lookahead=lookahead, identity=identity, **settings)
    blocks = _blocks(source, rate)
    outputs = open_outputs(to, allow_remote=allow_remote)
    names = ", ".join(f"{host}:{port}" for host, port in (each.address for each in outputs))
    print(f"elocute: sending to {names}, {live.lookahead_s:g} s late", file=sys.stderr)
    try:
        sent = send_live(blocks, live, outputs)
    finally:
        for output in outputs:
            output.close()
    record: dict[str, Any] = {
        "sent": len(sent.late_s),
        "dropped": len(sent.dropped_s),
        "refused": sum(output.failures for output in outputs),
        "late_most_s": round(max(sent.late_s, default=0.0), 4),
    }
    print(
        json.dumps(record)
        if as_json
        else f"{record['sent']} frames sent, {record['dropped']} dropped"
    )


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
