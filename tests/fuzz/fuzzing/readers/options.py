"""Texts of options, as a shell hands them over."""

from __future__ import annotations

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.readers.one_file import text


def _size(given: str) -> None:
    from elocute.cli.format_options import parse_size

    parse_size(given)


def _style_text(given: str) -> None:
    from elocute.articulation.style import resolve_style

    resolve_style(given)


def _life_text(given: str) -> None:
    from elocute.life import resolve_life

    resolve_life(given)


def _mood_text(given: str) -> None:
    from elocute.life import resolve_mood

    resolve_mood(given)


def _identity_text(given: str) -> None:
    from elocute.head.identity import resolve_identity

    resolve_identity(given)


def _keyframes(given: str) -> None:
    from elocute.cli.keyframes import parse_numbers

    parse_numbers("--pose", given, 3)


def _numbers(given: str) -> None:
    from elocute.cli.keyframes import parse_list

    parse_list("--blinks", given)


def _identities(given: str) -> None:
    from elocute.cli.keyframes import split_keyframes
    from elocute.head.identity import resolve_identity

    for _, who in split_keyframes("--identity", given):
        resolve_identity(who)


def _encoder_text(given: str) -> None:
    from elocute.encoders.registry import resolve_encoder

    resolve_encoder(given)


def _read_text(given: str) -> None:
    from elocute.speech.text.forced_alignment import words_in

    words_in(given)


READERS: tuple[Reader, ...] = (
    *(
        Reader(f"option {name}", seeds.options(name), text(read), {"text": "text"}, modules)
        for name, read, modules in (
            ("size", _size, ("elocute.cli.options",)),
            ("mix", _style_text, ("elocute.articulation.style",)),
            ("life", _life_text, ("elocute.life.settings",)),
            ("mood", _mood_text, ("elocute.life.moods",)),
            ("identity", _identity_text, ("elocute.head.identity",)),
            ("keyframes", _keyframes, ("elocute.cli.keyframes",)),
            ("numbers", _numbers, ("elocute.cli.keyframes",)),
            ("identities", _identities, ("elocute.cli.keyframes",)),
            ("text", _read_text, ("elocute.speech.text.forced_alignment",)),
            ("encoder", _encoder_text, ("elocute.encoders.registry",)),
        )
    ),
)
