"""`elocute words`: when each word of a recording is said, checked by a person and read back."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from elocute.cli import options
from elocute.cli.command_group import CommandGroup
from elocute.cli.known_speech_options import (
    TEXT_MAX_BYTES,
    KnownSpeechOptions,
    options_of_known_speech,
)
from elocute.cli.outputs import check_file_suffix, nothing_to_do
from elocute.errors import AlignmentError, InputError, printable
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.speech.text.word_times import TimedWords

app = CommandGroup("Find when each word of a recording is said, and check it.")

Output = typer.Option(..., "-o", "--output", help="Word times to write (.json or .TextGrid).")


@app.command("segment")
def segment_command(
    sound: Path = typer.Argument(..., help="Sound file: English read aloud where a text is given."),
    text: str | None = typer.Option(None, help="The text that is read."),
    text_file: Path | None = typer.Option(None, help="Text file that holds what is read."),
    recognised: KnownSpeechOptions = options_of_known_speech(
        without=("phones", "phone_set", "tier", "speaker", "text", "text_file")
    ),
    output: Path = Output,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Find when each word of a text is said, by forced alignment; or of what is recognised."""
    from elocute.audio.read import read_audio
    from elocute.speech.text.forced_alignment import segment_words
    from elocute.speech.text.word_times import write_words
    from elocute.speech.timed_phones import find_words

    known = replace(recognised, text=text, text_file=text_file)
    known.check(single=True)
    if known.language != "auto" and not known.transcribe:
        raise InputError.about(
            "--language", found="no --transcribe", allowed="English, where a text is given"
        )
    spoken = None if known.transcribe else _text(text, text_file)
    plan = OutputPlan(known.files)
    plan.add(output, sound)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    if spoken is None:
        words = find_words(sound, language=known.language, **known.recognised)
    else:
        words = segment_words(read_audio(sound), spoken)
    with plan.writing(output):
        write_words(words, output)
    _tell(words, output, as_json)


@app.command("check")
def check_command(
    words: Path = typer.Argument(
        ..., help="Word times that `words segment` wrote (.json), or a .TextGrid."
    ),
    sound: Path = typer.Argument(..., help="Sound file that they belong to."),
    output: Path = typer.Option(..., "-o", "--output", help="Page to write (.html)."),
    textgrid: Path | None = typer.Option(
        None, help="Also write a .TextGrid, for editing in Praat."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Draw waveform, spectrogram and word boundaries on a page, with doubtful words marked."""
    from elocute.audio.read import read_audio
    from elocute.speech.text.word_review_page import check_length, review_reason, write_word_page
    from elocute.speech.text.word_times import read_words, write_words

    check_file_suffix(textgrid, ".TextGrid")
    plan = OutputPlan()
    for path in (output, textgrid):
        if path is not None:
            plan.add(path, words, sound)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    timed, heard = read_words(words), read_audio(sound)
    check_length(timed, heard)
    if textgrid is not None and plan.wants(textgrid):
        with plan.writing(textgrid):
            write_words(timed, textgrid)
    marked = sum(bool(review_reason(word)) for word in timed.words)
    if plan.wants(output):
        with plan.writing(output):
            marked = write_word_page(timed, heard, output, title=f"{words.name}, {sound.name}")
    record = {"output": str(output), "words": len(timed.words), "marked": marked}
    print(json.dumps(record) if as_json else f"{output}: {marked} of {len(timed.words)} marked")


@app.command("take")
def take_command(
    edited: Path = typer.Argument(
        ..., help="Word times that a person edited (.TextGrid or .json)."
    ),
    output: Path = Output,
    before: Path | None = typer.Option(
        None, help="The word times before; words that were not changed keep their confidence."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Check word times that a person edited, and write them as words with confidence."""
    from elocute.speech.text.word_times import merge_edits, read_words, write_words

    plan = OutputPlan([before] if before else [])
    plan.add(output, edited)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    words = merge_edits(read_words(edited), None if before is None else read_words(before))
    with plan.writing(output):
        write_words(words, output)
    _tell(words, output, as_json)


def _text(text: str | None, file: Path | None) -> str:
    if (text is None) == (file is None):
        raise InputError.about(
            "words",
            found="neither --text nor --text-file" if text is None else "--text and --text-file",
            allowed="one of them",
        )
    if text is not None:
        return text
    assert file is not None
    from elocute.speech.text.script_text import read_transcript
    from elocute.speech.times.captions import said_text

    written = read_transcript(file, max_bytes=TEXT_MAX_BYTES, error=AlignmentError)
    said, notes = said_text(written)
    for note in notes:
        print(f"elocute: {printable(f'{file}: {note}')}", file=sys.stderr)
    return said


def _tell(words: TimedWords, output: Path, as_json: bool) -> None:
    from elocute.speech.text.word_review_page import review_reason

    doubtful = [w.text for w in words.words if review_reason(w)]
    if as_json:
        record = {"output": str(output), "words": len(words.words), "doubtful": doubtful}
        print(json.dumps(record))
        return
    for word in words.words:
        why = review_reason(word)
        remark = f"  check it: {why}" if why else ""
        print(f"{word.start_s:8.3f} {word.end_s:8.3f}  {word.text}{remark}")
    print(output)
