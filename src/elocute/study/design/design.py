"""What a study is: conditions, stimuli, comparisons, people, and how its answers are to be judged.

All of it is fixed before the first answer; `design_file.read_design` reads it from study.toml.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from elocute.errors import StudyError
from elocute.settings import SEED_MAX, check_settings, described, setting

KINDS = ("binary", "style", "rating", "intelligibility", "sync")
"""What a study asks: which of two, whose style, how good, which word, together or not."""
LANGUAGES = ("en", "de")
"""Languages that the page has by itself; others are named with a file of `texts`."""
SCALES = ("mos", "mushra")
CONTENTS = ("same", "different", "both")
CORRECTIONS = ("holm", "bonferroni", "benjamini-hochberg", "none")
SYNC_ANSWERS = ("early", "together", "late")
"""Of a sound against its picture: it comes early, together with it, or late."""
MISMATCHED = "mismatched"
"""The condition of items with an obvious answer: it moves to the sound of another sentence."""
NAME = re.compile(r"[a-z0-9_-]{1,64}")
ITEMS_MAX = 1_000
TEXT_MAX = 4_000
WORD_MAX = 60
SECONDS_MAX = 36_000.0
PANEL_ADDRESS = re.compile(
    r"https?://[\w.:\[\]-]+([/?](?:[!-z|~]|\{(?:code|id|study|session)\})*)?", re.ASCII
)
PANEL_CODE = re.compile(r"[A-Za-z0-9_-]{0,64}")
PANEL_PARAMETER = re.compile(r"[A-Za-z0-9_.-]{1,64}")


def check_name(name: object, about: str) -> str:
    """The name that was given for `about`; raises StudyError for what is no name."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        raise StudyError.about(
            about, found=repr(name)[:WORD_MAX], allowed="1 to 64 of a to z, 0 to 9, _ and -"
        )
    return name


def checked_text(given: object, about: str, longest: int = TEXT_MAX) -> dict[str, str]:
    """A text by language, or one that holds for every language ("").

    Raises StudyError for anything else, and for more than `longest` characters.
    """
    texts = {"": given} if isinstance(given, str) else given
    if isinstance(texts, Mapping):
        fit = {
            str(language): text
            for language, text in texts.items()
            if isinstance(text, str)
            and len(text) <= longest
            and re.fullmatch(r"[a-z]{0,3}", str(language))
        }
        if len(fit) == len(texts):
            return {language: text for language, text in fit.items() if text.strip()}
    raise StudyError.about(
        about,
        found=repr(given)[:WORD_MAX],
        allowed=f'a text of up to {longest} characters, or {{en = "…", de = "…"}}',
    )


class Checked:
    """Base of settings: a value of another type or outside its range raises StudyError."""

    def __post_init__(self) -> None:
        check_settings(self, StudyError)


@described
@dataclass(frozen=True)
class Study(Checked):
    """What people are told and asked."""

    title: str = setting(help="Shown on the page and in the report.")
    kind: str = setting(choices=KINDS, help="Question of each trial.")
    contact: str = setting(help="Contact for questions and deletion: a name and an address.")
    seed: int = setting(1, low=0, high=SEED_MAX, help="Seed of every order, side and assignment.")
    question: dict[str, str] = field(default_factory=dict, hash=False)
    """Asked in each trial, by language; {} is the page's own question for the kind."""
    about: dict[str, str] = field(default_factory=dict, hash=False)
    """What people read before they agree, by language, beside what the page says itself."""
    languages: tuple[str, ...] = LANGUAGES
    """Of the page, the first by default."""
    scale: str = setting(
        "mos",
        choices=SCALES,
        help="Scale of ratings: five words (mos), or 0 to 100 by a reference.",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, longest in (("title", 200), ("contact", 400)):
            if not 0 < len(getattr(self, name).strip()) <= longest:
                raise StudyError.about(
                    f"`{name}`",
                    found=repr(getattr(self, name))[:WORD_MAX],
                    allowed=f"1 to {longest} characters",
                )
        object.__setattr__(self, "question", checked_text(self.question, "`question`"))
        object.__setattr__(self, "about", checked_text(self.about, "`about`"))
        if not self.languages or not all(
            isinstance(each, str) and re.fullmatch(r"[a-z]{2,3}", each) for each in self.languages
        ):
            raise StudyError.about(
                "`languages`", found=repr(self.languages)[:WORD_MAX], allowed='["en", "de"]'
            )


@described
@dataclass(frozen=True)
class Condition(Checked):
    """What makes a video move: a model, stored motion, or videos made elsewhere.

    Raises
    ------
    StudyError
        For a value of another type or outside its range, and where not exactly one of `model`,
        `motion` and `videos` is given.
    """

    name: str = setting(help="In tables and plots; people never see it.")
    model: str = setting("", help="A model by name, or a trained one (.onnx).")
    motion: str = setting("", help="A folder of SOUND.npz or SOUND.IDENTITY.npz, or vertices .npy.")
    videos: str = setting(
        "", help="A folder of SOUND.mp4, SOUND.IDENTITY.mp4 or SOUND.IDENTITY.VIEW.mp4."
    )
    mesh: str = setting("", help="The mesh (.obj, .ply) whose vertices .npy files move.")
    fps: float | None = setting(
        None,
        unit="frames/s",
        above=0,
        high=1000,
        help="Frame rate of .npy files, which do not say it.",
    )
    speaker: str = setting(
        "", help="In a corpus, whose clips of the sentence are references, with their sound."
    )
    style: str = setting("", help="Style of the model; by default its own.")
    mood: str = setting("neutral", help="Mood, with an intensity or without: happy:0.6.")
    contacts: str = setting(
        "auto", choices=("auto", "off"), help="Whether lip contacts are laid over."
    )
    life: str = setting("1", help="Amount of motion beside the mouth, 0 to 1.")
    strength: float = setting(1.0, low=0.0, high=2.0, help="How far the mouth moves.")
    still: bool = setting(False, help="Whether the face rests: an anchor, or the sound alone.")
    mismatched: bool = setting(False, help="Whether it moves to the sound of another sentence.")
    silent: bool = setting(False, help="Whether it is shown without sound, for lip reading.")
    snr_db: float | None = setting(
        None, unit="dB", low=-40, high=60, help="Ratio of the voice to noise of its own spectrum."
    )
    offset_ms: float = setting(
        0.0, unit="ms", low=-1000, high=1000, help="Delay of the sound behind the picture."
    )
    reference_for: str = setting(
        "", help="In style studies, the condition whose manner this one's clips show."
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        check_name(self.name, "`name`")
        if self.name == MISMATCHED:
            raise StudyError.about(
                "`name`", found=repr(self.name), allowed="another; this one names obvious items"
            )
        given = [name for name in ("model", "motion", "videos") if getattr(self, name)]
        if len(given) != 1:
            raise StudyError.about(
                f"condition {self.name}",
                found=" and ".join(given) or "nothing that moves it",
                allowed="one of model, motion and videos",
            )


@dataclass(frozen=True)
class StimulusSound:
    """A sentence or a word that all conditions say."""

    name: str  # from the file's name
    file: str  # the sound, relative to study.toml
    seen: str = ""  # the sound that faces move by, where it is another (McGurk); else ""
    word: str = ""  # what is said, where people are asked for it; "" where no answer is right
    choices: tuple[str, ...] = ()  # the words that are offered
    # The part of the file, s; an end of 0 is the file's.
    start_s: float = 0.0
    end_s: float = 0.0

    def __post_init__(self) -> None:
        if not 0 <= self.start_s < SECONDS_MAX or not (
            self.end_s == 0 or self.start_s < self.end_s <= SECONDS_MAX
        ):
            raise StudyError.about(
                f"sound {self.name}",
                found=f"from {self.start_s:g} to {self.end_s:g} s",
                allowed="a start_s before its end_s, in seconds",
            )
        check_name(self.name, f"sound {self.file!r}: name")
        words = (*self.choices, self.word)
        if any(not isinstance(each, str) or len(each) > WORD_MAX for each in words):
            raise StudyError.about(
                f"sound {self.name}", found="a long word", allowed=f"up to {WORD_MAX} characters"
            )
        if self.choices and (
            not 2 <= len(set(self.choices)) == len(self.choices) <= 12
            or not all(each.strip() for each in self.choices)
        ):
            raise StudyError.about(
                f"sound {self.name}", found=f"choices {list(self.choices)}", allowed="2 to 12 words"
            )
        if self.word and self.word not in self.choices:
            raise StudyError.about(
                f"sound {self.name}", found=f"word {self.word!r}", allowed="one of its choices"
            )


@described
@dataclass(frozen=True)
class Stimuli(Checked):
    """What is said, by which faces, seen from where."""

    sounds: tuple[StimulusSound, ...] = ()
    """In their order; no two of one name."""
    identities: tuple[str, ...] = ("mean",)
    """Faces of the built-in head; names of others' videos."""
    views: tuple[str, ...] = ("front",)
    """Camera position."""
    size: tuple[int, int] = setting(
        (512, 512), unit="pixels", low=64, high=2048, help="Width and height of every video."
    )
    fps: float = setting(30.0, unit="frames/s", low=10, high=60, help="Frame rate of every video.")
    light: str = setting("studio", help="Light on the head.")
    background: str = setting("#8a8f98", help="Behind the head: plain, so that videos are alike.")
    look: str = setting("auto", help="Look of the built-in head.")
    loudness_db: float = setting(
        -23.0, unit="dB", low=-60, high=-6, help="Level of speech in every video, below full scale."
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, given in (("identities", self.identities), ("views", self.views)):
            for each in given:
                check_name(each, f"`{name}`")
        named = [each.name for each in self.sounds]
        for name, given in (
            ("sounds", named),
            ("identities", self.identities),
            ("views", self.views),
        ):
            if not 0 < len(given) <= ITEMS_MAX:
                raise StudyError.about(
                    f"`{name}`", found=f"{len(given)}", allowed=f"1 to {ITEMS_MAX}"
                )
            doubled = sorted({each for each in given if list(given).count(each) > 1})
            if doubled:
                raise StudyError.about(
                    f"`{name}`", found=f"{doubled[0]} twice", allowed="each once"
                )

    @property
    def names(self) -> tuple[str, ...]:
        """SOUND.IDENTITY.VIEW of every stimulus."""
        return tuple(
            f"{sound.name}.{face}.{view}"
            for sound in self.sounds
            for face in self.identities
            for view in self.views
        )


@described
@dataclass(frozen=True)
class Comparisons(Checked):
    """Which conditions are shown against each other."""

    pairs: tuple[tuple[str, str], ...] = ()
    """Two names each; () is every pair, or every one against `against`."""
    against: str = setting("", help="The condition that all others are compared with.")
    reference: str = setting(
        "", help="In ratings by mushra, the condition shown beside every one that is rated."
    )
    content: str = setting(
        "both",
        choices=CONTENTS,
        help="In style studies, whether the reference says the same sentence.",
    )


@described
@dataclass(frozen=True)
class Assignment(Checked):
    """Who sees what."""

    trials: int = setting(
        0, low=0, high=2_000, help="Comparisons for each person; 0 for a block, or all."
    )
    blocks: int = setting(
        0,
        low=0,
        high=1_000,
        help="Parts of the trials, one for a person; 0 for as many as trials need.",
    )
    repeats: int = setting(
        0, low=0, high=200, help="Trials that each person sees again, with sides exchanged."
    )
    participants: int = setting(
        0, low=0, high=100_000, help="Number of people who may finish; 0 for any number."
    )


@described
@dataclass(frozen=True)
class Qualification(Checked):
    """Comparisons with an obvious answer, before the test begins."""

    items: int = setting(3, low=0, high=50, help="Number of obvious comparisons.")
    right: int | None = setting(
        None, low=0, high=50, help="Number that must be right; by default all of them."
    )
    condition: str = setting(
        "", help="The condition with its own sound; by default the baseline, or the first."
    )
    failed: str = setting(
        "stop", choices=("stop", "mark"), help="Whether who fails is told and stops, or is marked."
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.needed > self.items:
            raise StudyError.about(
                "`right`", found=str(self.right), allowed=f"0 to {self.items}, the items"
            )

    @property
    def needed(self) -> int:
        """How many must be right."""
        return self.items if self.right is None else self.right


@described
@dataclass(frozen=True)
class Catch(Checked):
    """Obvious items among the test's own."""

    every: int = setting(
        10, low=0, high=1_000, help="One obvious item in about so many trials; 0 for none."
    )


@described
@dataclass(frozen=True)
class Watching(Checked):
    """How people watch."""

    share: float = setting(
        1.0,
        low=0.0,
        high=1.0,
        help="Share of the clip that must be seen before an answer is taken.",
    )
    replays: int = setting(20, low=0, high=1_000, help="Number of times it may be played again.")
    practice: int = setting(1, low=0, high=10, help="Trials before all others that do not count.")
    break_every: int = setting(25, low=0, high=1_000, help="Trials between breaks; 0 for none.")
    headphones: bool = setting(True, help="Whether headphones are asked for, and checked by ear.")
    width: int = setting(
        300, unit="pixels", low=0, high=4096, help="Least width of a screen that may take part."
    )


@described
@dataclass(frozen=True)
class Exclusions(Checked):
    """Whose answers, and which, are left out of the report; it says how many and why."""

    qualification: bool = setting(True, help="Whether who failed the qualification is left out.")
    catches_missed: int = setting(
        1, low=0, high=1_000, help="Catch trials that a person may miss and stay."
    )
    answered: float = setting(
        1.0, low=0.0, high=1.0, help="Least share of the sequence that a person answered."
    )
    one_side: float = setting(
        0.95, low=0.5, high=1.0, help="Greatest share of test answers on one side; 1 is any."
    )
    seconds_min: float = setting(
        0.0, unit="s", low=0.0, high=600.0, help="Answers that came sooner are left out."
    )
    seconds_max: float = setting(
        600.0, unit="s", low=1.0, high=86_400.0, help="Answers that came later are left out."
    )
    repeats_agree: float = setting(
        0.0, low=0.0, high=1.0, help="Least share of repeated trials answered alike."
    )


@described
@dataclass(frozen=True)
class Analysis(Checked):
    """What the report tests."""

    baseline: str = setting("", help="The condition that others are tested against.")
    margin: float = setting(
        0.1,
        low=0.0,
        high=0.5,
        help="Equivalence: how far a preference may be from a half, or a rating from another in "
        "parts of its scale.",
    )
    correction: str = setting(
        "holm", choices=CORRECTIONS, help="Correction of p-values for many comparisons."
    )
    confidence: float = setting(0.95, low=0.5, high=0.999, help="Confidence of every interval.")


@described
@dataclass(frozen=True)
class Panel(Checked):
    """Where people come from and go back to: Prolific, Mechanical Turk, a university's pool.

    In `return_to`, {code} is the completion code, and {id}, {study} and {session}
    are what the link brought.
    """

    parameter: str = setting(
        "", help="Parameter of the link that holds a person's id; by default the panels' own names."
    )
    required: bool = setting(False, help="Whether only people with such an id are let in.")
    return_to: str = setting(
        "", help="Address to go back to in the end: https://panel.example/done?cc={code}."
    )
    done_code: str = setting("", help="Completion code of all; by default one for each person.")
    stopped_code: str = setting("", help="Code of who did not pass the qualification.")
    full_code: str = setting("", help="Code of who comes when all places are taken.")

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.return_to and not PANEL_ADDRESS.fullmatch(self.return_to):
            raise StudyError.about(
                "`return_to`",
                found=repr(self.return_to)[:WORD_MAX],
                allowed="an address https://… that may hold {code}, {id}, {study} and {session}",
            )
        for name in ("done_code", "stopped_code", "full_code"):
            if not PANEL_CODE.fullmatch(getattr(self, name)):
                raise StudyError.about(
                    f"`{name}`",
                    found=repr(getattr(self, name))[:WORD_MAX],
                    allowed="up to 64 letters, digits, _ and -",
                )
        if self.parameter and not PANEL_PARAMETER.fullmatch(self.parameter):
            raise StudyError.about(
                "`parameter`", found=repr(self.parameter)[:WORD_MAX], allowed="such as PROLIFIC_PID"
            )


@dataclass(frozen=True)
class Design:
    """A study as its file says it.

    Attributes
    ----------
    study : Study
        Title, kind and question.
    conditions : tuple of Condition
        In the file's order.
    stimuli, comparisons, assignment, qualification, catch, watching, exclusions, analysis, panel
        The sections of these names.
    path : Path
        The file; what it names is relative to it.
    sha256 : str
        Of the file, hexadecimal; "" for a design made in Python.

    Raises
    ------
    StudyError
        For sections that do not fit each other.
    """

    study: Study
    conditions: tuple[Condition, ...]
    stimuli: Stimuli
    comparisons: Comparisons = Comparisons()
    assignment: Assignment = Assignment()
    qualification: Qualification = Qualification()
    catch: Catch = Catch()
    watching: Watching = Watching()
    exclusions: Exclusions = Exclusions()
    analysis: Analysis = Analysis()
    panel: Panel = Panel()
    path: Path = Path("study.toml")
    sha256: str = ""

    def __post_init__(self) -> None:
        check_fit(self)

    def condition(self, name: str) -> Condition:
        """The condition of a name. Raises KeyError."""
        return next(each for each in self.conditions if each.name == name)

    @property
    def judged(self) -> tuple[Condition, ...]:
        """Conditions that are compared or rated: all but the references of style studies."""
        return tuple(each for each in self.conditions if not each.reference_for)

    @property
    def pairs(self) -> tuple[tuple[str, str], ...]:
        """Names of conditions that are compared, by the file or all of them."""
        named = [each.name for each in self.judged]
        if self.comparisons.pairs:
            return self.comparisons.pairs
        if self.comparisons.against:
            return tuple(
                (self.comparisons.against, name)
                for name in named
                if name != self.comparisons.against
            )
        return tuple(combinations(named, 2))

    @property
    def obvious(self) -> str:
        """The condition of qualification and catch items that is right."""
        return self.qualification.condition or self.analysis.baseline or self.judged[0].name


def check_fit(design: Design) -> None:
    """Raise StudyError for sections that do not fit each other."""
    names = [each.name for each in design.conditions]
    for name in names:
        if names.count(name) > 1:
            raise StudyError.about("[[conditions]]", found=f"{name} twice", allowed="each once")
    if not design.judged:
        raise StudyError.about("[[conditions]]", found="none", allowed="one or more")
    judged = [each.name for each in design.judged]
    _known(design.comparisons.against, judged, "[comparisons] `against`")
    _known(design.comparisons.reference, judged, "[comparisons] `reference`")
    _known(design.qualification.condition, judged, "[qualification] `condition`")
    _known(design.analysis.baseline, judged, "[analysis] `baseline`")
    for pair in design.comparisons.pairs:
        for name in pair:
            _known(name, judged, "[comparisons] `pairs`")
        if pair[0] == pair[1]:
            raise StudyError.about(
                "[comparisons] `pairs`", found=f"{pair[0]} with itself", allowed="two conditions"
            )
    for each in design.conditions:
        _known(each.reference_for, judged, f"condition {each.name} `reference_for`")
    _check_kind(design, judged)
    _check_assignment(design)


def _check_kind(design: Design, judged: list[str]) -> None:
    kind = design.study.kind
    if kind in ("binary", "style") and len(judged) < 2:
        raise StudyError.about("[[conditions]]", found="one", allowed=f"two or more for {kind}")
    if kind == "intelligibility":
        without = [each.name for each in design.stimuli.sounds if not each.choices]
        if without:
            raise StudyError.about(
                "[stimuli] `sounds`",
                found=f"{without[0]} without choices",
                allowed='{file = "bat.wav", word = "bat", choices = ["bat", "mat", "pat", "cat"]}',
            )
    if kind == "rating" and design.study.scale == "mushra" and not design.comparisons.reference:
        raise StudyError.about(
            "[comparisons] `reference`", found="none", allowed="a condition, for scale mushra"
        )
    several = len(design.stimuli.sounds) > 1 or any("*" in s.file for s in design.stimuli.sounds)
    _check_sounds_of_pairs(design)
    if kind == "style" and design.comparisons.content != "different":
        shown = {each.reference_for for each in design.conditions}
        lacking = sorted({name for pair in design.pairs for name in pair} - shown)
        if lacking:
            raise StudyError.about(
                "[comparisons] `content`",
                found=f"{design.comparisons.content}, and no other clips of {lacking[0]}",
                allowed=f'different, or a condition with reference_for = "{lacking[0]}"',
                remedy="the reference would be one of the two clips",
            )
    if kind == "style" and design.comparisons.content != "same" and not several:
        raise StudyError.about(
            "[stimuli] `sounds`", found="one", allowed="two or more for references that differ"
        )
    obvious = design.qualification.items or design.catch.every
    if (obvious or any(each.mismatched for each in design.conditions)) and not several:
        raise StudyError.about(
            "[stimuli] `sounds`",
            found="one",
            allowed="two or more, since obvious items move to the sound of another",
            remedy="or [qualification] items = 0 and [catch] every = 0",
        )


def _check_sounds_of_pairs(design: Design) -> None:
    """Two that are seen at once are heard at once: one sound."""
    pairs = list(design.pairs) if design.study.kind in ("binary", "style") else []
    if design.comparisons.reference:
        pairs += [(design.comparisons.reference, each.name) for each in design.judged]
    for names in pairs:
        one, other = map(design.condition, names)
        if (one.silent, one.snr_db) != (other.silent, other.snr_db):
            raise StudyError.about(
                "[comparisons] `pairs`",
                found=f"{one.name} and {other.name} with different sounds",
                allowed="the same `silent` and `snr_db`, as they are seen at once",
            )
    obvious = design.condition(design.obvious)
    if (design.qualification.items or design.catch.every) and (
        obvious.silent or obvious.still or obvious.mismatched
    ):
        raise StudyError.about(
            "[qualification] `condition`",
            found=f"{obvious.name}, which is no example of speech",
            allowed="a condition with its sound, that moves to it",
        )


def _check_assignment(design: Design) -> None:
    assignment = design.assignment
    if assignment.trials and assignment.blocks:
        raise StudyError.about(
            "[assignment]", found="trials and blocks", allowed="one of them; the other follows"
        )


def _known(name: str, names: Iterable[str], about: str) -> None:
    if name and name not in names:
        raise StudyError.about(about, found=repr(name)[:WORD_MAX], allowed=", ".join(names))
