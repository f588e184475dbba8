"""JSON, CSV, TextGrid, landmarks and other texts."""

from __future__ import annotations

from pathlib import Path
from unittest import mock

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.readers.one_file import only


def _identity(path: Path) -> None:
    from elocute.head.identity import read_identity

    read_identity(path)


def _style(path: Path) -> None:
    from elocute.articulation.style import resolve_style

    resolve_style(str(path))


def _mix(path: Path) -> None:
    from elocute.models.style_mixes import read_mix

    read_mix(path)


def _words(path: Path) -> None:
    from elocute.speech.text.word_times import merge_edits, read_words

    words = read_words(path)
    merge_edits(words, words)


def _parts(path: Path) -> None:
    from elocute.evaluation.timed_recordings import read_phone_times

    read_phone_times(path)


def _phones(path: Path) -> None:
    from elocute.speech.times.read import read_speech_times

    times = read_speech_times(path)
    times.check(times.end_s)


def _scripts(path: Path) -> None:
    from elocute.speech.text.script_text import read_transcript
    from elocute.speech.times.captions import said_text, words_of_captions

    text = read_transcript(path, max_bytes=1_000_000)
    said_text(text)
    words_of_captions(text)


def _lines(path: Path) -> None:
    from elocute.cli.line_table import read_lines
    from elocute.speech.voices.settings import VoiceSettings

    read_lines(path, VoiceSettings())


def _texts(path: Path) -> None:
    from elocute.corpus.importers.vocaset import read_texts

    read_texts(path)


def _landmarks(path: Path) -> None:
    from elocute.registration.landmarks import read_landmarks

    read_landmarks(path, 0.001)


def _capture(folder: Path, _out: Path) -> None:
    from elocute.capture.scans.scan_sequence import find_sequences, open_sequence

    for inner in find_sequences(folder):
        sequence = open_sequence(inner)
        _ = sequence.missing, sequence.name, sequence.landmark_file(sequence.neutral)
        sequence.scan(sequence.neutral)


def _word_record(path: Path) -> None:
    from elocute.propagation.word_job import load_word_result

    load_word_result(path)


def _curves(path: Path) -> None:
    from elocute.export.curve_files import read_curves

    read_curves(path)


def _lrw(folder: Path, _out: Path) -> None:
    from elocute.propagation.word_recordings import find_recordings, word_span

    found = find_recordings(folder)
    for word in found.words:
        for recording in found.of(word)[0]:
            word_span(folder, recording, 0.4)


def _names(path: Path) -> None:
    from elocute.cli.name_lists import read_names

    read_names(path)


def _edits(path: Path) -> None:
    from elocute.motion.edits import read_edits

    read_edits(path)


def _project(path: Path) -> None:
    from elocute.studio import open_project

    project = open_project(path)
    project.record()
    project.check()


def _output_history(folder: Path, _out: Path) -> None:
    from elocute.files.output_history import recall_output, remember_output

    with mock.patch.dict("os.environ", ELOCUTE_STATE=str(folder)):
        recall_output(folder / "talk.wav")
        remember_output(folder / "talk.wav", ["nothing"])


_JSON = {"*.json": "json"}

READERS: tuple[Reader, ...] = (
    Reader("identity", seeds.identities, only(_identity), _JSON, ("elocute.head.identity",)),
    Reader("style", seeds.styles, only(_style), _JSON, ("elocute.articulation.style",)),
    Reader("mix", seeds.mixes, only(_mix), _JSON, ("elocute.models.style_mixes",)),
    Reader(
        "words",
        seeds.words,
        only(_words),
        {"*.json": "json", "*.TextGrid": "text"},
        ("elocute.speech.text.word_times",),
    ),
    Reader("parts", seeds.parts, only(_parts), _JSON, ("elocute.evaluation.timed_recordings",)),
    Reader(
        "phones",
        seeds.phones,
        only(_phones),
        {
            "*.csv": "text",
            "*.ctm": "text",
            "*.TextGrid": "text",
            "*.json": "json",
            "*.marks": "text",
            **dict.fromkeys(("*.srt", "*.lrc", "*.pho", "*.lab", "*.pgo"), "text"),
            **dict.fromkeys(("*.tsv", "*.dat", "*.xml", "*.eaf"), "text"),
        },
        (
            "elocute.speech.times.read",
            "elocute.speech.times.textgrid",
            "elocute.speech.times.engine_json",
            "elocute.speech.times.label_lines",
            "elocute.speech.times.csv_and_ctm",
            "elocute.speech.times.tier_choice",
        ),
    ),
    Reader(
        "scripts",
        seeds.scripts,
        only(_scripts),
        dict.fromkeys(("*.srt", "*.vtt", "*.ass", "*.txt", "*.ssml"), "text"),
        ("elocute.speech.times.captions", "elocute.speech.text.script_text"),
    ),
    Reader("lines", seeds.lines, only(_lines), {"*.csv": "text"}, ("elocute.cli.line_table",)),
    Reader(
        "texts",
        seeds.texts,
        only(_texts),
        {"*.json": "json", "*.tsv": "text"},
        ("elocute.corpus.importers.vocaset",),
    ),
    Reader(
        "landmarks",
        seeds.landmarks,
        only(_landmarks),
        {"*.json": "json", "*.ljson": "json", "*.npy": "npy", "*.*": "text"},
        ("elocute.registration.landmarks",),
    ),
    Reader(
        "capture",
        seeds.capture_folders,
        _capture,
        {"*.json": "json"},
        ("elocute.capture.scans.scan_sequence",),
    ),
    Reader(
        "word record",
        seeds.word_records,
        only(_word_record),
        _JSON,
        ("elocute.propagation.word_job",),
        needs=("pyarrow", "numba"),
    ),
    Reader("curves", seeds.curves, only(_curves), {"*.csv": "text"}, ("elocute.export.arkit_csv",)),
    Reader("lrw", seeds.lrw, _lrw, {"*.txt": "text"}, ("elocute.propagation.word_recordings",)),
    Reader(
        "curves json",
        seeds.curves_json,
        only(_curves),
        _JSON,
        ("elocute.export.curves_json",),
    ),
    Reader("edits", seeds.edit_lists, only(_edits), _JSON, ("elocute.motion.edits.edit_list",)),
    Reader("project", seeds.projects, only(_project), _JSON, ("elocute.studio.project",)),
    Reader("names", seeds.names, only(_names), {"*.txt": "text"}, ("elocute.cli.name_lists",)),
    Reader(
        "output history",
        seeds.output_histories,
        _output_history,
        {"*.sqlite3": "bytes"},
        ("elocute.files.output_history", "sqlite3"),
    ),
)
