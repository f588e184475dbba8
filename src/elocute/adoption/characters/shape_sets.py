"""Sets of shapes by name (ARKit, visemes, Daz, MetaHuman, …) as weights of the built-in curves.

ARKit's, and those that say the same otherwise: Character Creator, MetaHuman, Unified Expressions,
Meta's and Ekman's action units, faceshift, Daz, Mixamo, MB-Lab, VRoid; and visemes: Oculus's,
Microsoft's 22, Character Creator's, Daz's, Preston Blair's chart, Rhubarb's letters, phones and
vowels.

A line of a table has what shapes do, and after a colon how they are spelled. They do `jawOpen`,
`0.5 jawOpen + …`, `eyeBlink*` on both sides, or what a viseme of the built-in head does: `=aa`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from elocute.head.preset_shapes import VRM_GAZE, VRM_LIDS, VRM_MOUTH
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.curves import ARKIT_NAMES

SIDES = ("Left", "Right")
Looks = dict[str, float]
Row = tuple[str, str, Looks, bool]
"""A spelling, whose it is, what it does, and whether it is one of several that do it together."""


def _looks(text: str) -> Looks:
    """What a line of a table says that shapes do."""
    looks: Looks = {}
    for part in text.split(" + ") if text else ():
        weight, _, name = part.rpartition(" ")
        if name.startswith("="):
            own = VISEME_SHAPES[name[1:]]
        else:
            sides = SIDES if name.endswith("*") else ("",)
            own = {f"{name.removesuffix('*')}{side}": 1.0 for side in sides}
        for curve, share in own.items():
            looks[curve] = round(looks.get(curve, 0.0) + float(weight or 1) * share, 4)
    return looks


def _spellings(table: str) -> Iterator[tuple[str, Looks]]:
    """All spellings of a table, and what each does."""
    for line in table.strip().splitlines():
        looks, names = line.split(":")
        for name in names.split():
            yield name, _looks(looks.strip())


_VOWELS = """
=aa: a aa ai aah bigaah
=ih: i ih iy
=ou: u ou uw oo ooh oohq
=E: e ee eee eh ey
=oh: o oh ao
0.7 =aa + 0.35 =E: ae
0.55 =aa + 0.1 =E: ah
0.6 =aa + 0.4 =ou: aw
0.6 =aa + 0.4 =ih: ay
0.75 =RR: er
0.6 =oh + 0.4 =ou: ow
0.6 =oh + 0.4 =ih: oy
0.5 =ou + 0.45 =oh: uh
"""
_CONSONANTS = """
=PP: pp p b m mbp pbm bmp mpb mm
=FF: ff f v fv
=TH: th dh thdh
=DD: dd d t dst
=kk: kk k g ng h hh
=CH: ch sh zh jh j chj chjsh
=SS: ss s z
=nn: nn n l ld
=RR: rr r
=W: w q wq woo
0.75 =ih: y
0.5 =SS + 0.5 =DD: etc cdgknrsthyz cdgknrsyz
: sil rest
"""
BARE_VOWELS = frozenset(name for name, _ in _spellings(_VOWELS))
BARE: Mapping[str, Looks] = dict(_spellings(_CONSONANTS + _VOWELS.lstrip()))
"""Visemes whose name is a letter or a few: they are ones only among others, with a vowel."""
RHUBARB: Mapping[str, Looks] = dict(
    _spellings("=PP: a\n=SS: b\n=E: c\n=aa: d\n=oh: e\n=ou: f\n=FF: g\n=nn: h\n: x")
)
"""The letters of Rhubarb Lip Sync, which say something else where there are those from A to F."""
_OCULUS = """
=sil: viseme_sil
=PP: viseme_PP
=FF: viseme_FF
=TH: viseme_TH
=DD: viseme_DD
=kk: viseme_kk
=CH: viseme_CH
=SS: viseme_SS
=nn: viseme_nn
=RR: viseme_RR
=aa: viseme_aa
=E: viseme_E
=ih: viseme_I viseme_ih
=oh: viseme_O viseme_oh
=ou: viseme_U viseme_ou
"""
_MICROSOFT = """
: sil
0.6 =aa + 0.2 =E: ae_ax_ah aa_ah_ax
=aa: aa
=oh: ao
=E: ey_eh_uh
0.75 =RR: er
=ih: y_iy_ih_ix
=ou: w_uw
0.6 =oh + 0.4 =ou: ow
0.6 =aa + 0.4 =ou: aw
0.6 =oh + 0.4 =ih: oy
0.6 =aa + 0.4 =ih: ay
0.8 =kk + 0.15 =aa: h
=RR: r
=nn: l
=SS: s_z
=CH: sh_ch_jh_zh
=TH: th_dh
=FF: f_v
=DD: d_t_n
=kk: k_g_ng
=PP: p_b_m
"""
"""By its number, which is that of its line: a viseme, and what its phones are called."""
NUMBERED = tuple(_looks(line.split(":")[0].strip()) for line in _MICROSOFT.strip().splitlines())
VRM: dict[str, Looks] = {
    **{name.lower(): looks for name, looks in (VRM_MOUTH | VRM_LIDS | VRM_GAZE).items()},
    "a": VRM_MOUTH["aa"],
    "i": VRM_MOUTH["ih"],
    "u": VRM_MOUTH["ou"],
    "e": VRM_MOUTH["ee"],
    "o": VRM_MOUTH["oh"],
    "blinkl": VRM_LIDS["blinkLeft"],
    "blinkr": VRM_LIDS["blinkRight"],
}
_ARKIT_HALVES = """
browInnerUp: browInnerUp{}
cheekPuff: cheekPuff{}
mouthClose: mouthClose{}
mouthFunnel: mouthFunnel{}
mouthPucker: mouthPucker{}
mouthRollLower: mouthRollLower{}
mouthRollUpper: mouthRollUpper{}
mouthShrugLower: mouthShrugLower{}
mouthShrugUpper: mouthShrugUpper{}
"""
"""ARKit's shapes that others split in a left and a right half."""
# What has two sides; {} is a side.
_SIDED = """
browDown{}: Brow_Drop_{} BrowLowerer{} BrowsDown_{} browSqueeze{}_max BrowsD_{}
browOuterUp{}: Brow_Raise_Outer_{} browRaiseOuter{} BrowUp{} BrowsUp_{} browOutVert{}_max BrowsU_{}
eyeBlink{}: EyeClosed{} eyeClosed{}_max
eyeWide{}: eyeWiden{} EyesWide{} eyeClosed{}_min EyeOpen_{}
eyeSquint{}: eyeSquintInner{} Squint_{}
eyeLookUp{}: Eye_{}_Look_Up EyesLookUp{} EyeUp_{}
eyeLookDown{}: Eye_{}_Look_Down EyesLookDown{} EyeDown_{}
eyeLookIn{}: EyeIn_{}
eyeLookOut{}: EyeOut_{}
cheekSquint{}: Cheek_Raise_{} eyeCheekRaise{}
noseSneer{}: noseWrinkle{} NoseScrunch_{} cheekSneer{}_max Sneer_{}
mouthUpperUp{}: Mouth_Up_Upper_{} Mouth_Upper_Up_{} mouthUpperLipRaise{} UpperLipUp_{}
mouthUpperUp{}: LipsUpperUp_{}
mouthLowerDown{}: Mouth_Down_Lower_{} Mouth_Lower_Down_{} mouthLowerLipDepress{} LowerLipDown_{}
mouthLowerDown{}: LipsLowerDown_{}
mouthSmile{}: smile{}
mouthFrown{}: mouthCornerDepress{} MouthSad{} Frown_{}
mouthPress{}: mouthLipsPress{}
mouthStretch{}: LipsStretch_{}
jaw{}: Jaw_{}
mouth{}: Mouth_{}
"""
# {0} is a side, {1} where to, and {2} whether that is in or out.
_GAZE = "eyeLook{2}{0}: Eye_{0}_Look_{1} eyeLook{1}{0} EyesLook{1}{0}"
_GAZE_WAYS = ("Left Left Out", "Left Right In", "Right Left In", "Right Right Out")
# What several do together: halves, of which {} is a side; quarters; and others.
_HALVES = """
browInnerUp: Brow_Raise_Inner_{} browRaiseIn{} InnerBrowRaiser{}
cheekPuff: mouthCheekBlow{}
mouthRollUpper: Mouth_Roll_In_Upper_{} LipSuckUpper{} mouthUpperLipRollIn{}
mouthRollLower: Mouth_Roll_In_Lower_{} LipSuckLower{} mouthLowerLipRollIn{}
mouthFunnel: Mouth_Funnel_Up_{} Mouth_Funnel_Down_{} LipFunnelUpper{} LipFunnelLower{}
mouthPucker: Mouth_Pucker_Up_{} Mouth_Pucker_Down_{} LipPuckerUpper{} LipPuckerLower{} LipPucker{}
mouthPucker: MouthNarrow_{}
mouthLabiodental: mouthLowerLipBite{}
"""
_QUARTERS = """
mouthFunnel: mouthFunnel{} mouthLipsFunnel{} LipFunneler{}
mouthPucker: mouthLipsPurse{}
mouthClose: mouthLipsTogether{}
"""
_MORE_PARTS = """
mouthFunnel: LipFunnelUpper LipFunnelLower MouthFunnelUpper MouthFunnelLower
mouthPucker: LipPuckerUpper LipPuckerLower MouthPuckerUpper MouthPuckerLower
mouthRollUpper: LipSuckLT LipSuckRT
mouthRollLower: LipSuckLB LipSuckRB
mouthShrugUpper: jawChinRaiseUL jawChinRaiseUR
mouthShrugLower: jawChinRaiseDL jawChinRaiseDR
mouthPressLeft: mouthPressUL mouthPressDL
mouthPressRight: mouthPressUR mouthPressDR
mouthSmileLeft: mouthCornerPullL MouthCornerSlantL
mouthSmileRight: mouthCornerPullR MouthCornerSlantR
mouthLeft: MouthUpperLeft MouthLowerLeft
mouthRight: MouthUpperRight MouthLowerRight
"""
# A jaw ajar makes a viseme a whole mouth, which shares a weight with others.
_CC_VISEMES = """
0.6 jawOpen: V_Open
=PP: V_Explosive Explosive B_M_P
=FF: V_Dental_Lip Dental_Lip F_V
=ou: V_Tight_O Tight_O
=W: V_Tight W_OO
0.02 jawOpen + mouthStretch*: V_Wide
=CH: V_Affricate Affricate Ch_J
0.02 jawOpen + 0.5 mouthLowerDown* + 0.5 mouthUpperUp*: V_Lip_Open Lip_Open
=kk: K_G_H_NG
=SS: S_Z
=DD: T_L_D_N
"""
AMONG_OTHERS: Mapping[str, Looks] = dict(
    _spellings("0.6 jawOpen: open\n=W: tight\n0.02 jawOpen + mouthStretch*: wide")
)
"""Character Creator's visemes without their V, which say nothing alone."""
# Action units by number and by Ekman's names, of both sides or of one: {0} and {1}.
_FACS_SIDED = """
browOuterUp{0}: AU2{1} AU02{1} OuterBrowRaiser{1}
browDown{0}: AU4{1} AU04{1} BrowLowerer{1}
eyeWide{0}: AU5{1} AU05{1} UpperLidRaiser{1}
cheekSquint{0}: AU6{1} AU06{1} CheekRaiser{1}
eyeSquint{0}: AU7{1} AU07{1} LidTightener{1}
noseSneer{0}: AU9{1} AU09{1} NoseWrinkler{1}
mouthUpperUp{0}: AU10{1} UpperLipRaiser{1}
mouthSmile{0}: AU12{1} LipCornerPuller{1}
mouthDimple{0}: AU14{1} Dimpler{1}
mouthFrown{0}: AU15{1} LipCornerDepressor{1}
mouthLowerDown{0}: AU16{1} LowerLipDepressor{1}
mouthStretch{0}: AU20{1} LipStretcher{1}
mouthPress{0}: AU24{1} LipPressor{1} LipPresser{1}
eyeBlink{0}: AU43{1} EyesClosed{1} AU45{1} Blink{1} AU46{1} Wink{1}
"""
# AU25 to 27 part the lips ever wider.
_FACS = """
browInnerUp: AU1 AU01 InnerBrowRaiser
mouthShrugLower: AU17 ChinRaiser ChinRaiserB
mouthShrugUpper: ChinRaiserT ChinRaiserUpperLip
mouthPucker: AU18 LipPucker LipPuckerer
mouthFunnel: AU22 LipFunneler Funneler
0.5 mouthLowerDown* + 0.5 mouthUpperUp*: AU25 LipsPart
jawOpen: AU26 JawDrop AU27 MouthStretch
mouthRollLower + mouthRollUpper: AU28 LipSuck
jawForward: AU29 JawThrust
cheekPuff: AU34 CheekPuff
"""
_OTHER = """
jawOpen: mouthOpen openMouth jawDown lowerJawDown
0.5 jawOpen: mouthOpenHalf_max
mouthClose: MouthClosed LipsToward LipsTogether MouthApeShape
jawForward: jawFwd jawOut_max
jawLeft: JawSidewaysLeft JawSlideLeft
jawRight: JawSidewaysRight JawSlideRight
mouthRollUpper: LipSuckUpper UpperLipIn UpperLipSuck LipsUpperClose MouthUpperInside
mouthRollLower: LipSuckLower LowerLipIn LowerLipSuck LipsLowerClose MouthLowerInside
mouthShrugUpper: MouthRaiserUpper ChinUpperRaise
mouthShrugLower: MouthRaiserLower mouthLowerOut_max ChinLowerRaise
cheekPuff: mouthInflated_max Puff
browInnerUp: browsMidVert_max BrowsU_C
eyeBlink*: eyesClosed eyesClose eyeClosed blinkBoth blinks
eyeLookUp*: eyesLookUp lookUp
eyeLookDown*: eyesLookDown lookDown
eyeLookOutLeft + eyeLookInRight: eyesLookLeft lookLeft
eyeLookInLeft + eyeLookOutRight: eyesLookRight lookRight
mouthSmile*: smile
mouthFrown*: frown MouthSad mouthSmile_min
mouthPucker: pucker lipsPucker kiss MouthPout
mouthFunnel: funnel lipsFunnel LipFunnel
tongueTipUp: tongueUp tongueTipUp TongueTipAlveolar
tongueDental: TongueTipInterdental
eyeBlink*: FclEyeClose まばたき
eyeBlinkLeft: FclEyeCloseL
eyeBlinkRight: FclEyeCloseR
=PP: FclMthClose mouthClosed_max ん
=FF: mouthBite_max
=oh: mouthOpenO_max お
=SS: mouthOpenTeethClosed_max
=aa: あ
=ih: い
=ou: う
=E: え
"""
_CORNERS = ("UL", "UR", "DL", "DR", "LT", "RT", "LB", "RB")
_TABLES: tuple[tuple[str, bool, str, tuple[str, ...]], ...] = (
    ("arkit", True, _ARKIT_HALVES, SIDES),
    ("viseme", False, _OCULUS, ("",)),
    ("cc", False, _SIDED, SIDES),
    ("cc", False, _GAZE, _GAZE_WAYS),
    ("cc", True, _HALVES, SIDES),
    ("cc", True, _QUARTERS, _CORNERS),
    ("cc", True, _MORE_PARTS, ("",)),
    ("viseme", False, _CC_VISEMES, ("",)),
    ("facs", False, _FACS_SIDED, ("* ", "Left Left", "Right Right")),
    ("facs", False, _FACS, ("",)),
    ("other", False, _OTHER, ("",)),
)
"""Whose shapes a table has, whether several do it together, and what stands for its brackets."""


def known_names() -> Iterator[Row]:
    """Every spelling that is known; of two with the same words the first counts."""
    for name in ARKIT_NAMES:
        yield name, "arkit", {name: 1.0}, False
    for name in ARKIT_NAMES:
        if name.endswith("Left") and name not in ("jawLeft", "mouthLeft"):
            whole = name.removesuffix("Left")
            yield whole, "arkit", _looks(f"{whole}*"), False
    for family, is_part, table, places in _TABLES:
        for place in places:
            filled = table.replace("{}", "{0}").format(*place.split(" "))
            for name, looks in _spellings(filled):
                yield name, family, looks, is_part
    for number, line in enumerate(_MICROSOFT.strip().splitlines()):
        for name, looks in _spellings(line):
            yield f"{name}_{number:02}", "viseme", looks, False
            if "_" in name:
                yield name, "viseme", looks, False
