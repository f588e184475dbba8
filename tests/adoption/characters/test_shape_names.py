"""What morph targets do, by their names, in the spellings that characters come with."""

import pytest

from elocute.adoption.characters.mapping import joint_of
from elocute.adoption.characters.shape_names import (
    like_a_mouth,
    meanings_of,
    nearest_name,
    vrm_meaning,
)
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
        ("BrowsU_C", {"browInnerUp": 1}),
        ("BrowsU_L", {"browOuterUpLeft": 1}),
        ("EyeIn_R", {"eyeLookInRight": 1}),
        ("LipsUpperUp_L", {"mouthUpperUpLeft": 1}),
        ("LipsLowerClose", {"mouthRollLower": 1}),
        ("ChinUpperRaise", {"mouthShrugUpper": 1}),
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
    assert looks("Vowel_I", *(f"Vowel_{each}" for each in "AUEO")) == VISEME_SHAPES["ih"]


def test_ee_is_that_of_see_but_in_vrm():
    adobe = ["Aa", "D", "F", "L", "M", "Oh", "R", "S", "Uh", "W-Oo"]
    assert looks("Ee", *adobe) == VISEME_SHAPES["ih"]
    assert looks("ee", "aa", "ih", "ou", "oh") == VISEME_SHAPES["E"]


PP, FF, AA, OU = (VISEME_SHAPES[each] for each in ("PP", "FF", "aa", "ou"))
MICROSOFT = [
    "sil",
    "ae_ax_ah",
    "aa",
    "ao",
    "ey_eh_uh",
    "er",
    "y_iy_ih_ix",
    "w_uw",
    "ow",
    "aw",
    "oy",
    "ay",
    "h",
    "r",
    "l",
    "s_z",
    "sh_ch_jh_zh",
    "th_dh",
    "f_v",
    "d_t_n",
    "k_g_ng",
    "p_b_m",
]
DAZ = [
    "AA",
    "EE",
    "EH",
    "ER",
    "F",
    "IH",
    "IY",
    "K",
    "L",
    "M",
    "OW",
    "S",
    "SH",
    "T",
    "TH",
    "UW",
    "W",
]
QUARTERS = ("UL", "UR", "DL", "DR")
META = [
    *(
        f"{each}{side}"
        for each in ("CheekPuff", "Dimpler", "LipPressor", "LipPucker")
        for side in "LR"
    ),
    *(
        f"{each}{side}"
        for each in ("LipCornerPuller", "LipStretcher", "EyesClosed")
        for side in "LR"
    ),
    *(f"{each}{side}" for each in ("LowerLipDepressor", "UpperLipRaiser") for side in "LR"),
    *(
        f"{each}{place}"
        for each in ("LipFunneler", "LipSuck")
        for place in ("LB", "LT", "RB", "RT")
    ),
    *("JawDrop", "JawThrust", "LipsToward", "ChinRaiserB", "ChinRaiserT"),
    *("TongueTipInterdental", "TongueTipAlveolar", "TongueOut"),
]
UNIFIED = [
    *("JawOpen", "MouthClosed", "MouthRaiserUpper", "MouthRaiserLower", "TongueOut"),
    *(f"LipFunnel{each}{side}" for each in ("Upper", "Lower") for side in ("Left", "Right")),
    *(f"LipPucker{each}{side}" for each in ("Upper", "Lower") for side in ("Left", "Right")),
    *(f"LipSuck{each}{side}" for each in ("Upper", "Lower") for side in ("Left", "Right")),
    *(
        f"Mouth{each}{side}"
        for each in ("Press", "CornerPull", "Stretch")
        for side in ("Left", "Right")
    ),
    *(f"Mouth{each}{side}" for each in ("LowerDown", "UpperUp") for side in ("Left", "Right")),
    *("EyeClosedLeft", "EyeClosedRight"),
]
METAHUMAN = [
    *("jawOpen", "jawFwd", "tongueOut", "eyeBlinkL", "eyeWidenR"),
    *(
        f"mouth{each}{q}"
        for each in ("Funnel", "LipsPurse", "LipsTogether", "Press")
        for q in QUARTERS
    ),
    *(f"mouth{each}{side}" for each in ("CornerPull", "Stretch", "UpperLipRaise") for side in "LR"),
    *(f"mouth{each}{side}" for each in ("LowerLipDepress", "LowerLipRollIn") for side in "LR"),
    *("mouthUpperLipRollInL", "mouthUpperLipRollInR", "jawChinRaiseDL", "jawChinRaiseUR"),
]
SETS = {
    "Microsoft": [f"{name}_{number:02}" for number, name in enumerate(MICROSOFT)],
    "Microsoft by number": [f"viseme_{number}" for number in range(22)],
    "Preston Blair": ["AI", "E", "etc", "FV", "L", "MBP", "O", "rest", "U", "WQ"],
    "Preston Blair's mouths": [
        f"mouth_{name}" for name in ("AI", "L", "MBP", "O", "U", "WQ", "FV")
    ],
    "Rhubarb": [f"mouth_{letter}" for letter in "ABCDEFGHX"],
    "Daz 8": [f"Genesis8Female__eCTRLv{name}" for name in DAZ],
    "Daz 3": [f"head__CTRLVSM{name}" for name in DAZ],
    "Daz 9": ["facs_jnt_JawOpen", "facs_bs_MouthFunnel_div2", "facs_bs_MouthClose_div2"],
    "MetaHuman": [f"CTRL_expressions_{name}" for name in METAHUMAN],
    "Unified Expressions": UNIFIED,
    "Meta": META,
    "MB-Lab": [
        f"Expressions_{name}_max"
        for name in (
            "mouthOpen",
            "mouthClosed",
            "mouthSmileL",
            "mouthOpenO",
            "eyeClosedL",
            "jawOut",
        )
    ],
    "Character Creator 3": [
        "Open",
        "Explosive",
        "Dental_Lip",
        "Tight-O",
        "Tight",
        "Wide",
        "Affricate",
    ],
    "Rocketbox": [
        f"AA_VI_{n:02}_{each}" for n, each in enumerate(("Sil", "PP", "FF", "aa", "E", "O"))
    ],
    "VRChat": [f"vrc.v_{each}" for each in ("sil", "pp", "ff", "th", "aa", "e", "ih", "oh", "ou")],
    "phones": [
        f"Phoneme_{each}"
        for each in [
            "AA",
            "AE",
            "B",
            "CH",
            "EH",
            "F",
            "IH",
            "L",
            "M",
            "R",
            "S",
            "SH",
            "UW",
            "W",
            "Z",
        ]
    ],
    "FaceGen": [
        f"Phoneme {each}"
        for each in (
            *("Aah", "B,M,P", "big aah", "ch,J,sh", "D,S,T", "ee", "eh", "F,V", "i", "K", "N"),
            *("oh", "ooh,q", "R", "th", "W"),
        )
    ],
    "Skyrim": [
        *("Aah", "BigAah", "BMP", "ChJSh", "DST", "Eee", "Eh", "FV", "I", "K", "N", "Oh", "OohQ"),
        *("R", "Th", "W"),
    ],
    "Roblox": [
        *("JawDrop", "Pucker", "Funneler", "LipPresser", "LowerLipSuck", "UpperLipSuck"),
        *("LipsTogether", "ChinRaiser", "ChinRaiserUpperLip", "LeftLipCornerPuller"),
    ],
    "SRanipal": [
        *("Jaw_Open", "Mouth_Ape_Shape", "Mouth_Pout", "Mouth_Upper_Inside", "Mouth_Lower_Inside"),
        *("Mouth_Upper_UpRight", "Mouth_Lower_DownLeft"),
    ],
    "VRoid 0, she": [f"Face.M_F00_000_00_Fcl_MTH_{each}" for each in "AIUEO"],
    "VRoid 0, he": [f"Face.M_M00_001_00_Fcl_MTH_{each}" for each in "AIUEO"],
}


@pytest.mark.parametrize("which", SETS)
@pytest.mark.parametrize("after", ["", ".001", ".001.002"])
def test_sets_are_known_whole(which, after):
    names = [f"{name}{after}" for name in SETS[which]]
    assert [n for n, each in zip(names, meanings_of(names), strict=True) if each is None] == []


@pytest.mark.parametrize(
    ("which", "name", "curves"),
    [
        ("Microsoft", "p_b_m_21", PP),
        ("Microsoft", "l_14", VISEME_SHAPES["nn"]),
        ("Microsoft by number", "viseme_18", FF),
        ("Preston Blair", "MBP", PP),
        ("Preston Blair", "AI", AA),
        ("Preston Blair", "L", VISEME_SHAPES["nn"]),
        ("Preston Blair's mouths", "mouth_L", VISEME_SHAPES["nn"]),
        ("Rhubarb", "mouth_A", PP),
        ("Rhubarb", "mouth_D", AA),
        ("Daz 8", "Genesis8Female__eCTRLvM", PP),
        ("Daz 3", "head__CTRLVSMUW", OU),
        ("Daz 9", "facs_bs_MouthClose_div2", {"mouthClose": 1}),
        ("MetaHuman", "CTRL_expressions_mouthLipsTogetherUL", {"mouthClose": 1}),
        ("MetaHuman", "CTRL_expressions_mouthPressDR", {"mouthPressRight": 1}),
        ("MetaHuman", "CTRL_expressions_mouthLipsPurseUR", {"mouthPucker": 1}),
        ("Unified Expressions", "MouthClosed", {"mouthClose": 1}),
        ("Unified Expressions", "LipSuckLowerLeft", {"mouthRollLower": 1}),
        ("Meta", "LipFunnelerLB", {"mouthFunnel": 1}),
        ("Meta", "LipsToward", {"mouthClose": 1}),
        ("Meta", "LipSuckRT", {"mouthRollUpper": 1}),
        ("MB-Lab", "Expressions_mouthClosed_max", PP),
        ("MB-Lab", "Expressions_eyeClosedL_max", {"eyeBlinkLeft": 1}),
        ("Character Creator 3", "Explosive", PP),
        ("Character Creator 3", "Open", {"jawOpen": 0.6}),
        ("Rocketbox", "AA_VI_03_aa", AA),
        ("VRoid 0, she", "Face.M_F00_000_00_Fcl_MTH_A", AA),
        ("phones", "Phoneme_F", FF),
    ],
)
def test_what_a_name_of_a_set_says(which, name, curves):
    meaning = meanings_of(SETS[which])[SETS[which].index(name)]
    assert meaning is not None and meaning.looks == curves


def test_rocketboxs_numbers_stand_before_arkits_names():
    names = [f"AK_{n:02}_{each[0].upper()}{each[1:]}" for n, each in enumerate(ARKIT_NAMES, 1)]
    assert [each and each.looks for each in meanings_of(names)] == [{n: 1.0} for n in ARKIT_NAMES]
    assert looks("AU_26_JawDrop") == {"jawOpen": 1}


@pytest.mark.parametrize("name", ["mouthOpen_min", "Expressions_mouthOpen_min", "Open", "Wide"])
def test_names_that_say_something_else_alone(name):
    assert looks(name) is None


def test_sizes_of_a_shirt_are_no_visemes():
    assert meanings_of(["S", "M", "L", "XL"]) == [None] * 4


def test_which_unknown_names_look_like_a_mouth():
    for name in (
        "mouth_weird",
        "lipCurl",
        "JawTwist",
        "Viseme_Q1",
        "CTRL_expressions_mouthStickyUC",
    ):
        assert like_a_mouth(name, visemes=False)
    for name in ("eclipse", "cape", "Fcl_MTH_Angry", "browZ", "BIG"):
        assert not like_a_mouth(name, visemes=False)
    assert like_a_mouth("XQ", visemes=True) and not like_a_mouth("sleeves", visemes=True)


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
