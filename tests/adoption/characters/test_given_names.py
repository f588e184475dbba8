"""What shapes do whose names are not known: `face.names.json` beside `face.glb` says it."""

import json
from pathlib import Path
from typing import Any

import pytest

from elocute.adoption.characters.open_character import UnknownShapesError
from elocute.adoption.characters.report import character_record, report_lines
from elocute.adoption.registry import open_speaking_head
from elocute.errors import HeadError
from elocute.motion.curves import ARKIT_NAMES
from tests.adoption.characters.conftest import shares
from tests.support.gltf_files import arkit, record


def given(tmp_path: Path, record: Any) -> None:
    text = record if isinstance(record, str) else json.dumps(record)
    (tmp_path / "face.names.json").write_text(text, encoding="utf-8")


def test_a_character_of_unknown_names_speaks(opened, tmp_path):
    file = record(("Kopf", ["Mund_auf", "Kussmund", "Lid_zu", "Ohr"]))
    with pytest.raises(UnknownShapesError, match=r"say what they do in face\.names\.json") as told:
        opened(file)
    assert told.value.names == ("Mund_auf", "Kussmund", "Lid_zu", "Ohr")
    kiss = {"mouthPucker": 0.8, "mouthFunnel": 0.3}
    given(tmp_path, {"Mund_auf": "jawOpen", "Kussmund": kiss, "Lid_zu": "blink"})
    found = opened(file)
    assert found.mapping.mouth == "fitted" and found.mapping.unknown == {"Ohr": ""}
    looks = {control.name: control.looks for control in found.character.controls}
    assert looks["Mund_auf"] == {"jawOpen": 1} and looks["Kussmund"] == kiss
    assert shares(found)["Lid_zu"] == {"eyeBlinkLeft": 0.5, "eyeBlinkRight": 0.5}
    assert "given        Mund_auf, Kussmund, Lid_zu" in list(report_lines(character_record(found)))


def test_it_holds_before_what_a_name_says(opened, tmp_path):
    given(tmp_path, {"jawOpen": None, "Kiefer": "jawOpen"})
    found = opened(arkit() | record(("Face", [*ARKIT_NAMES, "Kiefer"])))
    assert found.mapping.mouth == "direct" and shares(found)["Kiefer"] == {"jawOpen": 1}
    assert found.mapping.idle == {"jawOpen": "left alone"}


def test_names_that_are_not_there_are_told(opened, tmp_path):
    given(tmp_path, {"Mund": "jawOpen"})
    (note,) = opened(arkit()).character.notes
    assert note == "face.names.json: no shapes of face.glb: Mund"


def test_a_change_of_the_names_is_seen(opened, tmp_path):
    opened(arkit() | record(("Face", [*ARKIT_NAMES, "Kiefer"])))
    before = open_speaking_head(tmp_path / "face.glb").character
    assert before is not None
    given(tmp_path, {"jawOpen": None, "Kiefer": "jawOpen"})
    after = open_speaking_head(tmp_path / "face.glb").character
    assert after is not None
    assert "jawOpen" in {c.name for c in before.controls} - {c.name for c in after.controls}


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ('{"Mund": "jawOpem"}', "'jawOpem' for 'Mund'; allowed: a known name"),
        (
            '{"Mund": {"jawOpen": 2}}',
            "for 'Mund'; allowed: a known name, weights of ARKit's curves",
        ),
        ('{"Mund": {"jaw": 0.5}}', "for 'Mund'; allowed: a known name, weights of ARKit's curves"),
        ('{"Mund": {}}', "for 'Mund'; allowed: a known name, weights of ARKit's curves"),
        ('{"Mund": [1]}', "for 'Mund'; allowed: a known name, weights of ARKit's curves"),
        ('{"Mund": NaN}', "no JSON"),
        ("[]", "JSON of a list; allowed: a JSON object of names of shapes"),
    ],
)
def test_what_cannot_be_meant_is_one_line(opened, tmp_path, content, told):
    given(tmp_path, content)
    with pytest.raises(HeadError) as error:
        opened(arkit())
    assert "face.names.json: " in str(error.value) and told in str(error.value)
    assert "\n" not in str(error.value)


def test_of_a_character_without_a_mouth_only_the_unknown_are_asked_for(opened):
    with pytest.raises(UnknownShapesError, match="no shape that moves a mouth") as told:
        opened(record(("Kopf", ["eyeBlinkLeft", "eyeBlinkRight", "Mund_auf"])))
    assert told.value.names == ("Mund_auf",)
