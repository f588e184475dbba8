"""rejects.csv: what is left out, one row each, whatever the file is called."""

from __future__ import annotations

import csv
import io
import os

from elocute.propagation.word_job import RejectedRecording, reject_lines


def test_names_that_are_no_text_and_formulas_are_escaped():
    names = [os.fsdecode(b"hello/a\xff.wav"), "hello/two\nlines.wav", "=1+1.wav"]
    rejects = tuple(RejectedRecording("hello", name, "too short") for name in names)
    lines = reject_lines(rejects)
    lines.encode("utf-8")
    rows = list(csv.reader(io.StringIO(lines)))
    assert [row[1] for row in rows] == [
        "hello/a\\udcff.wav",
        "hello/two\\nlines.wav",
        "'=1+1.wav",
    ]
