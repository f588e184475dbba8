"""Option texts that hold numbers of any length are told in one short line."""

import pytest

from elocute.articulation.style import parse_mix, resolve_style
from elocute.cli.format_options import parse_size
from elocute.cli.keyframes import parse_list, parse_numbers
from elocute.errors import InputError
from elocute.head.identity import resolve_identity
from tests.support.commands import run_python

LONG = "9" * 5000


@pytest.mark.parametrize(
    ("read", "text"),
    [
        (parse_size, LONG),
        (parse_size, f"{LONG}x100"),
        (parse_size, "٣٣٣x"),
        (parse_size, "٨٠٠"),
        (lambda text: parse_numbers("--jaw", text, 1), "٠.٥"),
        (lambda text: parse_numbers("--jaw", text, 1), "٠:1; 1:0"),
        (parse_mix, f"calm:{LONG}"),
        (parse_mix, "calm:1e308,broad:1e308"),
        (resolve_style, LONG),
        (resolve_identity, LONG),
        (lambda text: parse_numbers("--neck", text, 3), LONG),
        (lambda text: parse_numbers("--neck", text, 3), f"{LONG}:1,2,3; 2:1,2,3"),
        (lambda text: parse_list("--blinks", text), LONG),
    ],
)
def test_numbers_of_five_thousand_digits(read, text):
    with pytest.raises(InputError) as caught:
        read(text)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500


@pytest.mark.parametrize("seed", ["-1", LONG])
def test_seeds_that_no_generator_takes(seed, refused):
    for command in (
        ["capture", "simulate", "a.wav", "-o", "a"],
        ["align", "a.wav", "b.wav"],
        ["train", "voca", "a", "-o", "b"],
        ["train", "crnn", "a", "b", "-o", "c"],
        ["propagate", "a", "b", "-o", "c"],
    ):
        refused(*command, "--seed", seed, says="--seed")


def test_numpy_does_not_warn_beside_our_one_line(tmp_path):
    """What it warns of is checked in results; whoever asks for warnings is given them."""
    code = (
        "import atexit, numpy; atexit.register(lambda: numpy.ones(1) / numpy.zeros(1))\n"
        "from elocute.cli import main; main()"
    )
    said = {
        flags: run_python(*flags, "-c", code, "info", "none.npz", cwd=tmp_path).stderr
        for flags in ((), ("-W", "default::RuntimeWarning"))
    }
    assert said[()].count("\n") == 1 and said[()].startswith("elocute: ")
    assert "divide by zero" in said["-W", "default::RuntimeWarning"]
