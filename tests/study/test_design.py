"""study.toml: every section and field checked, and errors that say where."""

from pathlib import Path

import pytest

from elocute.errors import StudyError
from elocute.study.design.design_file import read_design
from tests.study.studies import HEAD, VIDEOS

ROOT = Path(__file__).parents[2]


def written(folder: Path, text: str) -> Path:
    path = folder / "study.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_what_is_left_out_has_a_value(tmp_path):
    design = read_design(written(tmp_path, HEAD + VIDEOS))
    assert design.pairs == (("ours", "theirs"),)
    assert (design.obvious, design.study.languages) == ("ours", ("en", "de"))
    assert design.exclusions.qualification and design.analysis.correction == "holm"
    assert len(design.sha256) == 64
    assert read_design(tmp_path) == design  # the folder stands for its file


WRONG = {
    "fps = 25": ("fps = 300", "[stimuli] `fps`: 300; allowed: 10 to 60"),
    'title = "Flashes"': ('title = ""', "[study] `title`"),
    'kind = "binary"': ('kind = "tertiary"', "[study] `kind`: 'tertiary'; allowed: binary, style"),
    'contact = "A person, a@example.org"': ("", "[study]: no `contact`"),
    'name = "theirs"': ('name = "../theirs"', "[[conditions]] `name`: '../theirs'"),
    'videos = "theirs"': ("", "nothing that moves it; allowed: one of model, motion and videos"),
    "[stimuli]": ("[stimulants]", "[stimulants]: unknown; allowed: study, stimuli"),
    "size = [64, 64]": ("size = [64]", "[stimuli] `size`"),
    'sounds = ["ours/*.mp4"]': ("sounds = [1]", "[stimuli] `sounds`: 1"),
}


@pytest.mark.parametrize(("good", "bad", "said"), [(k, *v) for k, v in WRONG.items()])
def test_an_error_names_line_section_and_field(tmp_path, good, bad, said):
    text = HEAD + VIDEOS
    assert good in text
    with pytest.raises(StudyError) as error:
        read_design(written(tmp_path, text.replace(good, bad)))
    assert said in str(error.value) and "\n" not in str(error.value)
    begin = text[: text.index(good)].count("\n") + 1
    line = int(str(error.value).partition(" line ")[2].partition(":")[0])
    assert abs(line - begin) <= 3


MORE = {
    "[assignment]\ntrials = -3": "[assignment] `trials`: -3",
    "[assignment]\ntrials = 3\nblocks = 2": "[assignment]: trials and blocks",
    "[qualification]\nitems = 2\nright = 3": "[qualification] `right`: 3",
    '[qualification]\ncondition = "rules"': "allowed: ours, theirs",
    '[analysis]\nbaseline = "rules"': "allowed: ours, theirs",
    "[analysis]\nmargin = 0.7": "0 to 0.5",
    "[exclusions]\none_side = 0.1": "0.5 to 1",
    '[comparisons]\npairs = [["ours", "ours"]]': "ours with itself",
    '[comparisons]\npairs = [["ours"]]': "[comparisons] `pairs`",
    "[catch]\nevery = true": "[catch] `every`",
    "[watching]\nshare = nan": "[watching] `share`",
    "[study]": "cannot declare",
    "[watching": "Expected",
}


@pytest.mark.parametrize("text", MORE)
def test_sections_that_do_not_fit_are_refused(tmp_path, text):
    with pytest.raises(StudyError) as error:
        read_design(written(tmp_path, f"{HEAD}{VIDEOS}\n{text}\n"))
    assert MORE[text].lower() in str(error.value).lower()


KINDS = {
    "intelligibility": "without choices",
    "style": "no other clips of ours",
}


@pytest.mark.parametrize("kind", KINDS)
def test_what_a_kind_needs_is_asked_for(tmp_path, kind):
    text = (HEAD + VIDEOS).replace('"binary"', f'"{kind}"')
    with pytest.raises(StudyError, match=KINDS[kind]):
        read_design(written(tmp_path, text))


def test_two_that_are_seen_at_once_are_heard_at_once(tmp_path):
    text = (HEAD + VIDEOS).replace('name = "theirs"', 'name = "theirs"\nsilent = true')
    with pytest.raises(StudyError, match="different sounds"):
        read_design(written(tmp_path, text))


def test_bytes_that_are_no_text_are_refused(tmp_path):
    path = tmp_path / "study.toml"
    path.write_bytes(b"\xff\xfe[study]")
    with pytest.raises(StudyError, match=r"study\.toml"):
        read_design(path)


@pytest.mark.parametrize("path", sorted((ROOT / "studies").glob("*.toml")), ids=lambda p: p.stem)
def test_every_study_that_comes_along_can_be_read(path):
    assert read_design(path).analysis.baseline


def test_the_remedy_for_one_sound_works(tmp_path):
    """What the error proposes, `items = 0` and `every = 0`, is enough: `right` follows."""
    one = HEAD + VIDEOS.replace("ours/*.mp4", "ours/one.mp4")
    with pytest.raises(StudyError, match=r"or \[qualification\] items = 0 and \[catch\] every = 0"):
        read_design(written(tmp_path, one))
    remedied = one + "[qualification]\nitems = 0\n[catch]\nevery = 0\n"
    design = read_design(written(tmp_path, remedied))
    assert (design.qualification.items, design.qualification.needed) == (0, 0)


@pytest.mark.parametrize(
    "line",
    [
        'return_to = "javascript:alert(1)"',
        'return_to = "https://a.example/{secret}"',
        'return_to = "https://{id}.example/"',
        'done_code = "a b"',
        'parameter = "a&b"',
    ],
)
def test_what_no_panel_can_take_is_refused(tmp_path, line):
    with pytest.raises(StudyError, match=r"line \d+: \[panel\] `"):
        read_design(written(tmp_path, HEAD + VIDEOS + f"[panel]\n{line}\n"))
