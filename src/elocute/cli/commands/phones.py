"""`elocute phones`: when each phone of a recording is said."""

from __future__ import annotations

import json
from pathlib import Path

import typer

from elocute.cli import options
from elocute.cli.known_speech_options import KnownSpeechOptions, options_of_known_speech
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.files.output_plan import OutputPlan


def phones_command(
    sound: Path = options.Sound,
    output: list[Path] = typer.Option(
        ...,
        "-o",
        "--output",
        help="File to write: .TextGrid, .ctm, .csv or .json. Can be repeated.",
    ),
    known: KnownSpeechOptions = options_of_known_speech(),
    channel: int | None = options.Channel,
    track: int | None = options.Track,
    partial: bool = options.Partial,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Find when each phone is said, and each word where a text is given or recognised."""
    from elocute.speech.times.write import WRITERS, write_speech_times

    known.check(single=True)
    plan = OutputPlan(known.files)
    for path in output:
        check_file_suffix(path, *WRITERS)
        plan.add(path, sound)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    speech = known.find_phones(sound, channel=channel, track=track, partial=partial)
    written = plan.wanted(output)
    for path in written:
        with plan.writing(path):
            write_speech_times(speech, path)
    if as_json:
        record = {"phones": len(speech.phones), "words": len(speech.words)}
        print(json.dumps({"outputs": [str(path) for path in written], **record}))
    else:
        print(*written, sep="\n")
