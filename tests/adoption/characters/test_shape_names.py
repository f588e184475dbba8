"""What morph targets do, by their names, in the spellings that characters come with."""

import pytest

from elocute.adoption.characters.joint_names import joint_of
from elocute.adoption.characters.shape_names import meanings_of, nearest_name, vrm_meaning
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.curves import ARKIT_NAMES


def looks(name, *others):
    meaning = meanings_of([name, *others])[0]
    return None if meaning is None else meaning.looks


def _snake(name):
    return "".join(f"_{letter.lower()}" if letter.isupper() else letter for letter in name)


SPELLINGS = {
    "as Apple does": lambda name: name,
    "capital": lambda name: name[0].upper() + name[1:],
    "snake": _snake,
    "spaces": lambda name: _snake(name).replace("_", " "),
    "dashes": lambda name: _snake(name).replace("_", "-"),
    "upper": lambda name: _snake(name).upper(),
    "run together": str.lower,
    "letter for the side": lambda name: name.replace("Left", "_L").replace("Right", "_R"),
    "dot and letter": lambda name: name.replace("Left", ".L").replace("Right", ".R"),
    "Maya's node": lambda name: f"head_blendshape.{name}",
    "mesh": lambda name: f"Wolf3D_Head.{name}",
    "path": lambda name: f"Face/{name}",
    "numbered": lambda name: f"A{ARKIT_NAMES.index(name):02}_{name}",
    "common word": lambda name: f"BS_{name}",
    "common words": lambda name: f"CTRL_expressions_{name}",
}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_arkits_names_in_every_spelling(spelling):
    written = [SPELLINGS[spelling](name) for name in ARKIT_NAMES]
    assert [meaning and meaning.looks for meaning in meanings_of(written)] == [
        {name: 1.0} for name in ARKIT_NAMES
    ]


@pytest.mark.parametrize(
    ("name", "curves"),
    [
        ("eyeBlink", {"eyeBlinkLeft": 1, "eyeBlinkRight": 1}),
        ("L_eyeBlink", {"eyeBlinkLeft": 1}),
        ("browInnerUp_R", {"browInnerUp": 1}),
        ("Eye_L_Look_R", {"eyeLookInLeft": 1}),
        ("Eye_R_Look_R", {"eyeLookOutRight": 1}),
        ("Mouth_Funnel_Down_R", {"mouthFunnel": 1}),
        ("Brow_Drop_L", {"browDownLeft": 1}),
        ("Jaw_L", {"jawLeft": 1}),
        ("AU12_R", {"mouthSmileRight": 1}),
        ("AU04", {"browDownLeft": 1, "browDownRight": 1}),
        ("JawDrop", {"jawOpen": 1}),
        ("LipCornerPuller_L", {"mouthSmileLeft": 1}),
        ("mouthOpen", {"jawOpen": 1}),
        ("eyesClosed", {"eyeBlinkLeft": 1, "eyeBlinkRight": 1}),
        ("viseme_PP", VISEME_SHAPES["PP"]),
        ("viseme_I", VISEME_SHAPES["ih"]),
        ("V_Explosive", VISEME_SHAPES["PP"]),
        ("T_L_D_N", VISEME_SHAPES["DD"]),
        ("viseme_sil", {}),
        ("あ", VISEME_SHAPES["aa"]),
        ("まばたき", {"eyeBlinkLeft": 1, "eyeBlinkRight": 1}),
        ("Fcl_EYE_Close_R", {"eyeBlinkRight": 1}),
    ],
)
def test_other_names(name, curves):
    assert looks(name) == curves


@pytest.mark.parametrize(
    "name", ["", "fat", "E", "Hair_Left", "not a shape", "中", "_", "L", "...."]
)
def test_what_is_no_name_of_a_face(name):
    assert looks(name) is None


def test_letters_are_visemes_among_others():
    names = ["Fcl_MTH_A", "Fcl_MTH_I", "Fcl_MTH_U", "Fcl_MTH_E", "Fcl_MTH_O", "Fcl_ALL_Joy"]
    own = [VISEME_SHAPES[each] for each in ("aa", "ih", "ou", "E", "oh")]
    assert [each and each.looks for each in meanings_of(names)] == [*own, None]
    assert looks("E", "aa", "oh", "PP") == VISEME_SHAPES["E"]


def test_presets_of_both_versions_of_vrm():
    for old, new, own in (("a", "aa", "aa"), ("i", "ih", "ih"), ("e", "ee", "E")):
        for preset in (old, new, old.upper()):
            meaning = vrm_meaning(preset)
            assert meaning is not None and meaning.looks == VISEME_SHAPES[own]
    assert vrm_meaning("happy") is None
    for preset in ("blink_l", "blinkLeft"):
        meaning = vrm_meaning(preset)
        assert meaning is not None and meaning.looks == {"eyeBlinkLeft": 1}


def test_the_nearest_name_is_found():
    assert nearest_name("jawOpne") == "jawOpen"
    assert nearest_name("head.mouth_smle_left") == "mouthSmileLeft"
    assert nearest_name("cape") is None


@pytest.mark.parametrize(
    ("name", "joint"),
    [
        ("Head", "head"),
        ("mixamorig:Neck", "neck"),
        ("mixamorig12:Head", "head"),
        ("CC_Base_NeckTwist01", "neck"),
        ("CC_Base_JawRoot", "jaw"),
        ("CC_Base_L_Eye", "eyeLeft"),
        ("J_Bip_C_Head", "head"),
        ("J_Adj_R_FaceEye", "eyeRight"),
        ("FACIAL_C_Jaw", "jaw"),
        ("neck_01", "neck"),
        ("eye_r", "eyeRight"),
        ("Bip001 Head", "head"),
        ("ValveBiped.Bip01_Head1", "head"),
        ("DEF-jaw", "jaw"),
        ("mixamorig:HeadTop_End", None),
        ("eyeTarget_L", None),
        ("Eye", None),
        ("LeftHead", None),
        ("", None),
    ],
)
def test_joints_by_the_names_of_rigs(name, joint):
    assert joint_of(name) == joint
