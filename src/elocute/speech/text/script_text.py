"""Extracts what is said from scripts, SSML and subtitles."""

from __future__ import annotations

import html
import re
from collections import Counter
from collections.abc import Collection, Mapping
from pathlib import Path

from elocute.errors import InputError
from elocute.files.reading import FileKind, decoded_text, read_bytes
from elocute.speech.times.labels import CLOCK

ALLOWED = "a text in UTF-8 or UTF-16"
NAMED_MAX = 4
TIMED_SHARE = 3
"""Times are not spoken where at least one line in three, and more than one line, has a time."""
NEAR = 40
"""How many letters before and after an aside are looked at for the ends of sentences."""
ENDS = '.!?…:"”'
_SSML = re.compile(r"\s*(?:<\?xml[^>]*>\s*)?(?:<!DOCTYPE[^>]*>\s*)?<speak[\s>]")
# Of SSML, and of pages, where no <speak> is around it.
_TAG = re.compile(
    r"</?(?:[\w-]{1,20}:)?(break|p|s|br|div|voice|bookmark|mark|emphasis|prosody|phoneme|say-as|sub|"
    r"audio|lang|w|b|i|u|em|strong|span|font|express-as|speak|effect)(?:\s[^<>]{0,500})?/?>",
    re.IGNORECASE,
)
_ALIAS = re.compile(r"<sub\s+alias=(?:\"([^\"<>]*)\"|'([^'<>]*)')\s*>[^<>]*</sub>", re.IGNORECASE)
_PREFIX = re.compile(r"(</?)[\w.-]{1,40}:")
_MARKUP = re.compile(
    r"\s*(?:<\?xml|<tt\b|<!doctype|<html\b|<sami\b|\{\d+\}\{\d+\}|\[script info\](?!.*^dialogue:))",
    re.IGNORECASE | re.MULTILINE | re.DOTALL,
)
_TIMES = re.compile(r'\s*(?:File type = "ooText|\[?\s*\{\s*"\w+"\s*:)')
_NOT_SAID = ("desc", "metadata", "lexicon", "meta")
_PARTED = ("p", "s", "break", "voice", "paragraph", "sentence", "br", "div")
# `BOB:`, `BOB (whispers):`, `Bob:`, `Speaker 2:` at the start of a line.
_NAME = re.compile(
    r"^(?P<marks>[ \t>*-]*)(?P<name>[^\W\d_][\w.'’-]*(?: [\w.'’#&-]+){0,3})[ \t]*"
    r"(?:\([^()\n]*\)[ \t]*)?(?::[ \t]+|：[ \t]*)",
    re.MULTILINE,
)
_COUNTED = re.compile(
    r"(?:first|second|third|next|then|finally|last|step|part|rule|tip|note|question|answer)\b",
    re.IGNORECASE,
)
"""Begins an entry of a list; before a colon it is said, and no name."""
DUET_LINES = 3
"""Of so short a script nobody speaks twice."""
SHORT_NAME = 3
"""Letters of a name in a script without capitals, such as Chinese."""
# When a line is said: 0:03 of YouTube, [00:03] Bob, before it or alone; `Bob  0:03` of Otter and
# `Bob (00:03):` of Rev above it.
_TIMED_LINE = re.compile(
    rf"^[ \t]*(?:(?:[^\W\d_][\w.'’-]*(?: [\w.'’#&-]+){{0,3}})(?:[ \t]{{2,9}}|[ \t]?(?=[(\[]))"
    rf"[(\[]?{CLOCK}[)\]]?:?[ \t]*$"
    rf"|[(\[]?{CLOCK}(?: ?(?:-->|[-–]) ?{CLOCK})?[)\]]?(?:[ \t]?[-–:])?(?:[ \t]+|$))",
    re.MULTILINE,
)
_LINK = re.compile(r"!?\[([^\[\]]*)\]\((?:\w{2,9}:|[/#.])[^()\s]*\)")
_HEADING = re.compile(r"^#{1,6}[ \t]+", re.MULTILINE)
_SCENE = re.compile(r"^[ \t]*(?:INT|EXT|EST|I/E)[./ ][^a-z\n]*$", re.MULTILINE)
# A screenplay has the name in a line of its own, after an empty one and before what is said.
_CUE_LINE = re.compile(
    r"(?:\A|(?<=\n\n))[ \t]*([^\W\da-z_][^\Wa-z_]*(?:[ .'’-]{1,2}[^\Wa-z_]+){0,3})[ \t]*"
    r"(\([^()\n]*\))?[ \t]*\n(?=[ \t]*\S)"
)
_BRACKETS = re.compile(r"\[[^\[\]]*\]|【[^【】]*】")
_ASIDE = re.compile(r"[(（]([^()（）]{1,80})[)）]")
_STARRED = re.compile(r"\*([^*\n]{1,80})\*")
_DIRECTIONS = re.compile(
    r"(?:\w+ly )?(?:sighs?|laughs?|laughing|laughter|chuckles?|giggles?|coughs?|gasps?|whispers?|"
    r"whispering|shouts?|shouting|sobs?|crying|cries|groans?|clears (?:his|her|their)? ?throat|"
    r"pauses?|beat|silence|applause|music|cheering|inaudible|crosstalk|breathes?|sniffs?|sings?|"
    r"singing|smiles?|nods?|v\.?o\.?|o\.?s\.?|cont'?d\.?|off)\b",
    re.IGNORECASE,
)
# LRS2 and LRS3: below what is said, a confidence, a reference, and boxes or times.
_LRS = re.compile(r"Text:[ \t]+(\S[^\r\n]*)\r?\n(?:Conf|Ref):")
_KINDS = (
    (b"PK\x03\x04", "a Word document or another ZIP file"),
    (b"{\\rtf", "a document in Rich Text Format"),
    (b"\xd0\xcf\x11\xe0", "an old Word document"),
    (b"%PDF", "a PDF"),
    (b"@UTF8", "a CHAT transcript"),
)


def read_transcript(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str = ALLOWED,
    error: type[InputError] = InputError,
) -> str:
    """Read a text that people wrote: all of it; of a transcript of LRS2 or LRS3, what is said.

    The limits are those of an `elocute.files.reading.FileKind`. Documents that are not plain text
    raise `error` too, and are named.
    """
    data = read_bytes(path, FileKind(allowed, max_bytes, error))
    for start, kind in _KINDS:
        if data.startswith(start):
            remedy = "save it as plain text (.txt), and give that"
            raise error.about(Path(path), found=kind, allowed=allowed, remedy=remedy)
    in_utf8 = FileKind(allowed, max_bytes, error, "save it in UTF-8")
    text = decoded_text(data, Path(path), in_utf8)
    if _MARKUP.match(text) and not _SSML.match(text):
        found, remedy = "markup or subtitles of another kind", "save it as text, .srt or .vtt"
        raise error.about(Path(path), found=found, allowed=allowed, remedy=remedy)
    if _TIMES.match(text):
        remedy = "give it as a file of times (`phones`)"
        raise error.about(Path(path), found="TextGrid or JSON", allowed=allowed, remedy=remedy)
    lrs = _LRS.match(text)
    return lrs[1] if lrs else text


class _SpokenText:
    """Takes an XML parser's events: the text of SSML, an alias for what it stands for."""

    def __init__(self) -> None:
        self._parts: list[str] = []
        self._hidden = 0

    def start(self, tag: str, attributes: Mapping[str, str]) -> None:
        name = tag.rpartition("}")[2]
        alias = attributes.get("alias") if name == "sub" else None
        if not self._hidden and alias is not None:
            self._parts.append(alias)
        if self._hidden or alias is not None or name in _NOT_SAID:
            self._hidden += 1
        elif name in _PARTED:
            self._parts.append(" ")

    def end(self, tag: str) -> None:
        if self._hidden:
            self._hidden -= 1
        elif tag.rpartition("}")[2] in _PARTED:
            self._parts.append(" ")

    def data(self, text: str) -> None:
        if not self._hidden:
            self._parts.append(text)

    @property
    def text(self) -> str:
        return " ".join("".join(self._parts).split())


def without_tags(text: str) -> str:
    """The text of SSML, or of a text with some of its tags; any other text as it is.

    Where it begins with <speak>, its tags are taken out; an alias takes the place of what it stands
    for. Raises InputError for SSML that is not XML, and for declarations of entities in it.
    """
    if _SSML.match(text) is None:
        plain = _TAG.sub(
            lambda tag: " " if tag[1].lower() in _PARTED else "",
            _ALIAS.sub(lambda alias: alias[1] or alias[2] or "", text),
        )
        return text if plain == text else html.unescape(plain)
    from xml.etree.ElementTree import ParseError, XMLParser

    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise InputError.about("SSML", found="declarations", allowed="tags and text")
    said = _SpokenText()
    parser = XMLParser(target=said)
    try:
        parser.feed(_PREFIX.sub(r"\1", re.sub(r"^\s*<\?xml[^>]*>", "", text)))
        parser.close()
    except (ParseError, ValueError) as error:
        raise InputError.about(
            "SSML", found=str(error), allowed="XML: & is written &amp;, tags are closed"
        ) from None
    return said.text


def speakers_of(text: str) -> frozenset[str]:
    """Names before colons in a script that are those of speakers, and no part of what is said.

    They stand in capitals before what does not, behind `>>`, or come again before the beginnings of
    sentences. Once one comes again and half of the lines have names, whoever speaks once is a
    speaker, too; in two or three lines that all have names, nobody needs to come again.
    """
    found = [*_NAME.finditer(text)]
    said = _NAME.sub("", text)
    seen = Counter(match["name"] for match in found)
    lines = sum(bool(line.strip()) for line in text.splitlines())
    is_loud = sum(map(str.isupper, said)) > sum(map(str.islower, said))
    # Behind `one thing:` a sentence goes on in small letters, which some write at its beginning.
    begun = Counter(m["name"] for m in found if not text[m.end() : m.end() + 1].islower())
    in_small = len(seen) > 1 and 2 * begun.total() < seen.total() and lines <= 2 * seen.total()
    turns = {name for name in seen if in_small or 2 * begun[name] > seen[name]}
    titled = {
        name
        for name in turns
        if text.islower() or not any(word[0].islower() for word in name.split())
    }
    again = {name for name in (titled if in_small else turns) if seen[name] > 1}
    is_dialogue = bool(again) and 2 * sum(seen[name] for name in turns) >= lines
    is_duet = 1 < len(titled) == seen.total() == lines <= DUET_LINES
    is_duet = is_duet and not in_small and not is_loud and all(map(_names_one, titled))
    return frozenset(
        {name for name in seen if name.isupper() and not is_loud}
        | {m["name"] for m in found if ">>" in m["marks"] and m["name"].count(" ") < 2} & turns
        | again
        | (titled if is_dialogue or is_duet else set())
    )


def _names_one(name: str) -> bool:
    """Whether what stands before a colon once may be a name by itself."""
    is_short = name.count(" ") < 2 if name.lower() != name else len(name) <= SHORT_NAME
    return is_short and not _COUNTED.match(name)


def spoken_script(text: str, speakers: Collection[str] | None = None) -> tuple[str, list[str]]:
    """As `spoken_lines`, of a text with tags of SSML, which are left out."""
    return spoken_lines(without_tags(text), speakers)


def spoken_lines(text: str, speakers: Collection[str] | None = None) -> tuple[str, list[str]]:
    """What is said of a script, in its lines, and what was left out, in order.

    Names of speakers and stage directions are left out. A name stands before a colon at the start
    of a line, as `speakers_of` finds it; or in capitals in a line of its own, as in screenplays;
    `speakers` are the names, where more than this text tells them. A
    direction stands in square brackets, or in round ones between sentences or with a word such as
    `sighs`. Times at many lines are left out, and so are the addresses of links, and marks of
    headings and scenes.
    """
    left_out: list[str] = []

    def drop(match: re.Match[str]) -> str:
        left_out.append(" ".join(match[0].split()))
        return " "

    text = _HEADING.sub("", _LINK.sub(r"\1", text))
    lines = sum(bool(line.strip()) for line in text.splitlines())
    times = sum(1 for _ in _TIMED_LINE.finditer(text))
    if times > 1 and TIMED_SHARE * times >= lines:
        text = _TIMED_LINE.sub(drop, text)
    names = speakers_of(text) if speakers is None else speakers

    def name(match: re.Match[str]) -> str:
        return drop(match) if match["name"] in names else match[0]

    def aside(match: re.Match[str]) -> str:
        before = match.string[max(match.start() - NEAR, 0) : match.start()].rstrip()
        after = match.string[match.end() : match.end() + NEAR].lstrip()
        apart = (not before or before[-1] in ENDS) and (not after or not after[0].islower())
        short = len(match[1].split()) <= 4 and match[1].rstrip()[-1:] not in ENDS
        said = not (apart and short) and not _DIRECTIONS.match(match[1].strip())
        return match[0] if said else drop(match)

    cues = list(_CUE_LINE.finditer(text))
    if len(cues) > 1 or any(cue[2] for cue in cues):
        text = _CUE_LINE.sub(drop, text)
        text = _SCENE.sub(drop, text)
    text = _NAME.sub(name, text)
    text = _ASIDE.sub(aside, _BRACKETS.sub(drop, text))
    text = _STARRED.sub(
        lambda found: drop(found) if _DIRECTIONS.match(found[1]) else found[0], text
    )
    kept = (re.sub(r"[ \t]+([,.;!?])", r"\1", " ".join(line.split())) for line in text.splitlines())
    return "\n".join(filter(None, kept)), left_out


def left_out_note(left_out: list[str]) -> list[str]:
    """What to know about a script of which something was left out; nothing otherwise."""
    different = [*dict.fromkeys(left_out)]
    if not different:
        return []
    named = ", ".join(repr(each[:40]) for each in different[:NAMED_MAX])
    more = f" and {len(different) - NAMED_MAX} more" if len(different) > NAMED_MAX else ""
    return [f"not taken for speech: {named}{more}"]
