"""`elocute cues`: pictures of a mouth for drawn characters, and captions."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.known_speech_options import KnownSpeechOptions, options_of_known_speech
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.errors import InputError
from elocute.files.output_plan import OutputPlan
from elocute.numerics.frame_rates import frame_rate

FPS = (1.0, 240.0)


def cues_command(
    sound: Path = options.Sound,
    output: list[Path] = typer.Option(
        ...,
        "-o",
        "--output",
        help="File to write: .tsv, .xml or .json as Rhubarb has them, .dat for Moho, .srt or .vtt "
        "with captions. Can be repeated.",
    ),
    basic: bool = typer.Option(
        False, "--basic", help="Use shapes A to F alone, for characters without G, H and X."
    ),
    fps: float = typer.Option(
        24.0, help="Frames per second of a .dat.", parser=frame_rate, metavar="RATE"
    ),
    known: KnownSpeechOptions = options_of_known_speech(),
    channel: int | None = options.Channel,
    track: int | None = options.Track,
    partial: bool = options.Partial,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Say which picture of a mouth is shown when, for drawn characters; or write captions."""
    from elocute.speech.cues.files import WRITERS, CueSheet, write_cues
    from elocute.speech.cues.mouth_cues import mouth_cues

    if not FPS[0] <= fps <= FPS[1]:
        raise InputError.about("--fps", found=f"{fps:g}", allowed=f"{FPS[0]:g} to {FPS[1]:g}")
    known.check(single=True)
    plan = OutputPlan(known.files)
    for path in output:
        check_file_suffix(path, *WRITERS)
        plan.add(path, sound)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    speech = known.find_phones(sound, channel=channel, track=track, partial=partial)
    sheet = CueSheet(mouth_cues(speech, basic=basic), speech.words, speech.text, sound.name, fps)
    written = plan.wanted(output)
    for path in written:
        with plan.writing(path):
            write_cues(sheet, path)
    if as_json:
        print(json.dumps({"outputs": [str(path) for path in written], "cues": len(sheet.cues)}))
    else:
        print(*written, sep="\n")
