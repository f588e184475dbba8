"""The suffix chooses the writer; what cannot be written says so at once."""

import pytest

from elocute.errors import OutputError
from elocute.export.registry import WRITERS, check_suffix, write


@pytest.mark.parametrize("name", ["talk.avi", "talk", "talk.wav", ".glb"])
def test_an_unknown_suffix_names_those_there_are(name):
    with pytest.raises(OutputError, match=r"\.glb") as caught:
        check_suffix(name)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("suffix", sorted(WRITERS))
def test_a_missing_folder_is_refused_and_nothing_is_made(motion, tmp_path, suffix):
    with pytest.raises(OutputError, match="mkdir"):
        write(motion, tmp_path / "none" / f"talk{suffix}")
    assert list(tmp_path.iterdir()) == []


def test_suffixes_may_be_upper_case():
    assert check_suffix("TALK.GLB") == ".glb"
