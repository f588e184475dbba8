"""Characters opened: what of theirs is moved by what, and which files are refused."""

import copy
import json
from typing import Any

import numpy as np
import pytest

from elocute.adoption.characters.open_character import open_character
from elocute.adoption.characters.report import character_record, report_lines
from elocute.adoption.characters.shape_sets import VRM
from elocute.adoption.registry import open_speaking_head
from elocute.errors import HeadError
from elocute.motion.curves import ARKIT_NAMES
from tests.adoption.characters.conftest import shares
from tests.support.gltf_files import OCULUS, arkit, glb, inline, record


def test_arkits_shapes_take_the_curves_as_they_are(opened):
    found = opened(arkit())
    assert found.mapping.mouth == "direct"
    taken = shares(found)
    assert list(taken) == list(ARKIT_NAMES)
    assert taken["jawOpen"] == {"jawOpen": 1} and taken["eyeBlinkLeft"] == {"eyeBlinkLeft": 1}
    assert taken["mouthRollLower"] == {"mouthRollLower": 1, "mouthLabiodental": 0.55}


def test_visemes_rest_beside_arkits_shapes(opened):
    found = opened(record(("Wolf3D_Head", [*ARKIT_NAMES, *OCULUS, "mouthSmile"])))
    assert found.mapping.mouth == "direct"
    assert set(found.mapping.idle) == {*OCULUS, "mouthSmile"}


def test_visemes_are_fitted_and_the_rest_of_the_face_is_not(opened):
    found = opened(record(("Head", [*OCULUS, "eyesClosed", "browInnerUp", "cape"])))
    assert found.mapping.mouth == "fitted"
    taken = shares(found)
    assert taken["eyesClosed"] == {"eyeBlinkLeft": 0.5, "eyeBlinkRight": 0.5}
    assert taken["browInnerUp"] == {"browInnerUp": 1}
    assert all(taken[name] == {} for name in OCULUS[1:]) and "viseme_sil" not in taken
    assert found.mapping.unknown == {"cape": ""}


def test_a_mouth_with_a_shape_missing_is_fitted(opened):
    found = opened(record(("Head", [n for n in ARKIT_NAMES if n != "mouthClose"])))
    assert found.mapping.mouth == "fitted"
    assert shares(found)["eyeBlinkLeft"] == {"eyeBlinkLeft": 1}
    assert shares(found)["jawOpen"] == {}


def test_halves_make_up_a_shape_together(opened):
    names = [n for n in ARKIT_NAMES if n not in ("mouthPucker", "browInnerUp")]
    halves = [f"Mouth_Pucker_{end}_{side}" for end in ("Up", "Down") for side in "LR"]
    found = opened(record(("CC_Base_Body", [*names, *halves, "browInnerUp_L", "browInnerUp_R"])))
    assert found.mapping.mouth == "direct"
    binds = {c.name: len(c.binds) for c in found.character.controls if len(c.binds) > 1}
    assert binds == {" + ".join(halves): 4, "browInnerUp_L + browInnerUp_R": 2}


def test_parts_of_a_head_move_together(opened):
    given = record(("Head", list(ARKIT_NAMES)), ("Teeth", ["jaw_open", "tongueOut"]))
    given["nodes"][1]["translation"] = [0.02, 0, 0]
    found = opened(given)
    binds = {control.name: control.binds for control in found.character.controls}
    assert binds["jawOpen"] == ((0, ARKIT_NAMES.index("jawOpen"), 1.0), (1, 0, 1.0))
    assert found.character.nodes == (0, 1)


def test_of_several_heads_one_is_named(opened):
    given = record(("Anna", list(ARKIT_NAMES)), ("Ben", list(ARKIT_NAMES)))
    with pytest.raises(HeadError, match=r"2 heads \(Anna; Ben\); allowed: one; `mesh` Anna"):
        opened(given)
    assert opened(given, mesh="Ben").character.nodes == (1,)
    assert opened(given, mesh="Anna node").character.nodes == (0,)
    with pytest.raises(HeadError, match=r"no mesh called 'Carl'; allowed: Anna, Ben"):
        opened(given, mesh="Carl")
    twins = record(("Anna", list(ARKIT_NAMES)), ("Anna", list(ARKIT_NAMES)))
    with pytest.raises(HeadError, match="2 meshes called 'Anna'"):
        opened(twins, mesh="Anna")


def test_heads_that_are_called_alike_are_told_by_what_names_them(opened):
    given = arkit()  # one mesh that hangs twice
    given["nodes"] = [
        {"name": "left", "mesh": 0},
        {"name": "right", "mesh": 0, "translation": [1, 0, 0]},
    ]
    given["scenes"] = [{"nodes": [0, 1]}]
    with pytest.raises(HeadError, match=r"2 heads \(left; right\).*`mesh` left chooses"):
        opened(given)
    assert opened(given, mesh="right").character.nodes == (1,)
    with pytest.raises(HeadError, match="2 meshes called 'Face'; allowed: left, right"):
        opened(given, mesh="Face")
    for node in given["nodes"]:
        node["name"] = "same"
    with pytest.raises(HeadError, match=r"2 heads \(node 0; node 1\).*`mesh` node 0 chooses"):
        opened(given)
    assert opened(given, mesh="node 0").character.nodes == (0,)


@pytest.mark.parametrize("shown", [0, 1])
def test_a_head_that_is_in_no_scene_is_not_seen(opened, shown):
    given = record(("Anna", list(ARKIT_NAMES)), ("Ben", list(ARKIT_NAMES)))
    given["scenes"] = [{"nodes": [shown]}]
    assert opened(given).character.nodes == (shown,)
    del given["scenes"]
    with pytest.raises(HeadError, match=r"2 heads \(Anna; Ben\)"):
        opened(given)


def test_primitives_without_targets_stay_as_they_are(opened):
    given = arkit()
    speaks = given["meshes"][0]["primitives"][0]
    still = {"attributes": {"POSITION": 0}}
    given["meshes"][0] |= {"primitives": [still, speaks], "weights": [0.0] * 52}
    found = opened(given)
    assert found.mapping.mouth == "direct" and found.character.target_count(0) == 52
    given["meshes"][0]["primitives"] = [speaks, still | {"targets": speaks["targets"][:3]}]
    says = r"meshes\[0\].primitives\[1\] with 3 morph targets beside 52; allowed: .*; split"
    with pytest.raises(HeadError, match=says):
        opened(given)


def test_two_skeletons_are_two_heads_wherever_they_stand(opened):
    given = record(
        ("Anna", list(ARKIT_NAMES)), ("Ben", list(ARKIT_NAMES)), ("Lash", ["eyeBlink_L"])
    )
    for number, skin in ((0, 0), (1, 1), (2, 1)):
        given["nodes"][number] |= {"skin": skin, "translation": [0, 0, 0]}
    given["nodes"] += [{"name": "Head"}, {"name": "Head"}]
    given["skins"] = [{"joints": [3]}, {"joints": [4]}]
    assert opened(given, mesh="Ben").character.nodes == (1, 2)
    assert [turn.node for turn in opened(given, mesh="Ben").character.turns] == [4]


def test_duplicates_and_shapes_that_move_nothing(opened):
    given = record(("Head", [*ARKIT_NAMES, "jawOpen", "Jaw_Open", "tongueUp"]))
    given["accessors"].append(given["accessors"][1] | {"min": [0, 0, 0], "max": [0, 0, 0]})
    targets = given["meshes"][0]["primitives"][0]["targets"]
    first, last = ARKIT_NAMES.index("jawOpen"), len(targets) - 1
    targets[first] = targets[last] = {"POSITION": 2}
    found = opened(given)
    binds = {control.name: control.binds for control in found.character.controls}
    assert binds["jawOpen"] == ((0, 52, 1.0),)  # the first that moves something
    assert found.mapping.idle["Jaw_Open"] == "jawOpen does it"
    assert found.mapping.idle["tongueUp"] == "moves nothing"


@pytest.mark.parametrize("basis", ["Basis", "Key.Neutral", "base_mesh", "基型"])
def test_the_mesh_itself_may_be_named_before_its_targets(opened, basis):
    given = arkit()
    given["meshes"][0]["extras"]["targetNames"].insert(0, basis)
    found = opened(given)
    binds = {control.name: control.binds for control in found.character.controls}
    assert binds["jawOpen"] == ((0, ARKIT_NAMES.index("jawOpen"), 1.0),)
    assert found.character.notes == ()


def test_a_list_of_names_that_is_too_short_is_told(opened):
    given = record(("Face", list(ARKIT_NAMES)))
    given["meshes"][0]["extras"]["targetNames"] = ["jawOpen", "mouthPucker"]
    found = opened(given)
    assert [control.binds for control in found.character.controls] == [((0, 0, 1),), ((0, 1, 1),)]
    assert found.character.notes == (
        "face.glb: Face has 2 names for 52 morph targets, the last of which are taken as without "
        "names",
    )


@pytest.mark.parametrize("names", [["cape", *ARKIT_NAMES], ["Basis", "Key", *ARKIT_NAMES]])
def test_a_list_of_names_that_is_too_long_is_told_and_left(opened, names):
    given = record(("Face", list(ARKIT_NAMES)), ("Jaw", ["jawOpen"]))
    given["meshes"][0]["extras"]["targetNames"] = names
    says = f"{len(names)} names for 52 morph targets, which are taken as without names"
    found = opened(given)
    assert [control.binds for control in found.character.controls] == [((1, 0, 1.0),)]
    assert found.character.notes == (f"face.glb: Face has {says}",)
    del given["nodes"][1]["mesh"]
    with pytest.raises(HeadError, match=rf"none known among its morph targets \({says}\)"):
        opened(given)


def test_targets_of_one_name_move_together_where_they_move_something_else(opened):
    given = record(("Head and teeth", [*ARKIT_NAMES, "jawOpen", "jawOpen", "jawOpen"]))
    first = given["accessors"][1]
    given["accessors"] += [first | {"max": [0, 0, 0]}, first | {"min": [0] * 3, "max": [0] * 3}]
    targets = given["meshes"][0]["primitives"][0]["targets"]
    targets[52], targets[54] = {"POSITION": 2}, {"POSITION": 3}  # teeth; the same again; nothing
    found = opened(given)
    binds = {control.name: control.binds for control in found.character.controls}
    jaw = ARKIT_NAMES.index("jawOpen")
    assert binds["jawOpen"] == ((0, jaw, 1.0), (0, 52, 1.0))
    assert found.character.notes == (
        "face.glb: shapes of one name that move the same (jawOpen): the first of each is moved",
    )
    assert found.mapping.idle == {}


@pytest.mark.parametrize("where", ["primitive", "target", "accessor"])
def test_names_wherever_writers_put_them(opened, where):
    given = arkit()
    mesh = given["meshes"][0]
    names, targets = mesh.pop("extras")["targetNames"], mesh["primitives"][0]["targets"]
    if where == "primitive":
        mesh["primitives"][0]["extras"] = {"targetNames": names}
    for number, name in enumerate(names):
        if where == "target":
            targets[number] = {"POSITION": 1, "extras": {"name": name}}
        elif where == "accessor":
            given["accessors"].append(given["accessors"][1] | {"name": name})
            targets[number] = {"POSITION": number + 2}
    assert opened(given).mapping.mouth == "direct"


def joints_of(opened):
    return {"+".join(turn.joints): turn.node for turn in opened.character.turns}


def test_joints_by_name_and_what_they_do(opened):
    given = arkit()
    given["nodes"][0]["skin"] = 0
    names = ("Hips", "mixamorig:Neck", "mixamorig:Head", "Jaw", "LeftEye", "RightEye", "HeadTop")
    given["nodes"] += [
        {"name": name, "children": [number + 2] if number < 3 else []}
        for number, name in enumerate(names)
    ]
    given["nodes"][3]["children"] = [4, 5, 6, 7]
    given["skins"] = [{"joints": [1, 2, 3, 4, 5, 6]}]
    found = opened(given)
    assert joints_of(found) == {"neck": 2, "head": 3, "jaw": 4, "eyeLeft": 5, "eyeRight": 6}
    assert not any(turn.controls for turn in found.character.turns)
    # Without shapes for it the jaw's joint opens the mouth, and the eyes' turn them.
    bare = copy.deepcopy(given)
    bare["meshes"][0]["extras"]["targetNames"] = [
        "other" if name == "jawOpen" or name.startswith("eyeLook") else name for name in ARKIT_NAMES
    ]
    found = opened(bare)
    assert found.mapping.mouth == "direct"
    turns = {turn.joints[0]: turn.controls for turn in found.character.turns}
    assert turns["jaw"] == {"joint: jawOpen": (20.0, 0.0)}
    assert turns["eyeLeft"]["joint: eyeLookOutLeft"] == (0.0, 32.0)
    assert turns["eyeRight"]["joint: eyeLookOutRight"] == (0.0, -32.0)
    assert turns["eyeRight"]["joint: eyeLookDownRight"] == (27.0, 0.0)


def test_a_head_without_a_neck_takes_both_turns(opened):
    given = arkit()
    given["nodes"][0]["skin"] = 0
    given["nodes"].append({"name": "head"})
    given["skins"] = [{"joints": [1]}]
    assert joints_of(opened(given)) == {"neck+head": 1}
    given["nodes"][1]["matrix"] = [1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]  # sheared
    assert joints_of(opened(given)) == {}


def vrm(version):
    """Five vowels and a blink over shapes whose names say nothing; eyes by joints."""
    given = record(("Face", [f"m{number}" for number in range(7)]))
    given["nodes"] += [{"name": "Kopf"}, {"name": "Auge L"}, {"name": "Auge R"}]
    presets = {"aa": 0, "ih": 1, "ou": 2, "ee": 3, "oh": 4, "blink": 5, "happy": 6}
    if version == 1:
        preset: dict[str, Any] = {
            name: {"morphTargetBinds": [{"node": 0, "index": index, "weight": 0.8}]}
            for name, index in presets.items()
        }
        preset["blink"]["isBinary"] = True
        preset["aa"]["morphTargetBinds"] += [{"node": 9, "index": 0}, {"node": 0, "index": 99}]
        ranges = {
            f"rangeMap{way}": {"inputMaxValue": 90, "outputScale": 9}
            for way in ("HorizontalInner", "HorizontalOuter", "VerticalDown", "VerticalUp")
        }
        bones = {"head": {"node": 1}, "leftEye": {"node": 2}, "rightEye": {"node": 3}}
        given["extensions"] = {
            "VRMC_vrm": {
                "expressions": {"preset": preset},
                "humanoid": {"humanBones": bones},
                "lookAt": {"type": "bone", **ranges},
            }
        }
        return given
    old = {"ih": "i", "ou": "u", "ee": "e", "oh": "o", "aa": "a", "happy": "joy"}
    groups = [
        {
            "name": name,
            "presetName": old.get(name, name),
            "binds": [{"mesh": 0, "index": index, "weight": 80}],
            "isBinary": name == "blink",
        }
        for name, index in presets.items()
    ]
    ways = ("HorizontalInner", "HorizontalOuter", "VerticalDown", "VerticalUp")
    bones = [{"bone": "head", "node": 1}, {"bone": "leftEye", "node": 2}]
    given["extensions"] = {
        "VRM": {
            "blendShapeMaster": {"blendShapeGroups": groups},
            "humanoid": {"humanBones": [*bones, {"bone": "rightEye", "node": 3}]},
            "firstPerson": {
                "lookAtTypeName": "Bone",
                **{f"lookAt{way}": {"xRange": 90, "yRange": 9} for way in ways},
            },
        }
    }
    return given


@pytest.mark.parametrize("version", [0, 1])
def test_a_vrm_by_its_expressions(opened, version):
    found = opened(vrm(version), name="face.vrm")
    assert found.mapping.mouth == "fitted"
    controls = {control.name: control for control in found.character.controls}
    assert set(controls) - {n for n in controls if n.startswith("joint: ")} == (
        {"aa", "ih", "ou", "ee", "oh", "blink"} if version else {"a", "i", "u", "e", "o", "blink"}
    )
    assert controls["aa" if version else "a"].binds == ((0, 0, 0.8),)
    assert controls["blink"].switch
    assert joints_of(found) == {"neck+head": 1, "eyeLeft": 2, "eyeRight": 3}
    look = next(turn for turn in found.character.turns if turn.joints == ("eyeLeft",))
    assert look.controls["joint: eyeLookInLeft"] == pytest.approx((0, -3.2))
    assert found.character.facing_deg == (180 if version == 0 else 0)


@pytest.mark.parametrize("preset", ["unknown", "", None])
def test_expressions_without_a_preset_are_those_that_they_are_called_as(opened, preset):
    given = vrm(0)
    groups = given["extensions"]["VRM"]["blendShapeMaster"]["blendShapeGroups"]
    for group, name in zip(groups, ("A", "I", "U", "E", "O", "Blink", "Joy"), strict=True):
        group |= {"name": name, "presetName": preset}
    groups.insert(0, groups[0] | {"name": "aa", "binds": [{"mesh": 0, "index": 6, "weight": 100}]})
    groups[1] |= {"presetName": "a"}  # a preset goes before what is only called so
    found = opened(given, name="face.vrm")
    looks = {control.name: control.looks for control in found.character.controls}
    assert looks["a"] == VRM["a"] and looks["U"] == VRM["ou"]
    assert looks["Blink"] == {"eyeBlinkLeft": 1, "eyeBlinkRight": 1}
    assert not {"aa", "Joy"} & set(looks)


def test_expressions_say_what_they_take_away(opened):
    given = vrm(1)
    preset = given["extensions"]["VRMC_vrm"]["expressions"]["preset"]
    preset["aa"] |= {"overrideBlink": "block", "overrideMouth": "none", "overrideLookAt": 3}
    preset["blink"] |= {"overrideLookAt": "blend"}
    controls = {each.name: each.overrides for each in opened(given).character.controls}
    assert controls["aa"] == {"blink": "block"} and controls["blink"] == {"lookAt": "blend"}
    assert controls["oh"] == {}


def test_shapes_that_look_like_a_mouth_and_are_not_known_are_told(opened):
    names = ["AI", "E", "O", "MBP", "mouthQuirk", "XQ", "cape sleeve"]
    found = opened(record(("Head", names)))
    (note,) = found.character.notes
    assert note.startswith(
        "face.glb: 2 shapes look like a mouth's and are not known (mouthQuirk, XQ)"
    )
    assert opened(record(("Head", names[:4]))).character.notes == ()
    whole = opened(record(("Head", [*ARKIT_NAMES, "mouthQuirk"])))  # the mouth is whole without it
    assert whole.character.notes == ()


def test_eyes_and_teeth_that_nothing_moves_are_named(opened):
    given = arkit()
    plain = {"primitives": [{"attributes": {"POSITION": 0}}]}
    for name in ("Teeth_Lower", "Teeth_Upper", "EyeBall_L", "Eyelashes", "Shirt", "Tongue"):
        given["meshes"].append({"name": name, **plain})
        given["nodes"].append({"name": f"{name}.001", "mesh": len(given["meshes"]) - 1})
    assert opened(given).still == ()  # in no scene, where nobody sees them
    given["scenes"] = [{"nodes": list(range(7))}]
    found = opened(given)
    assert found.still == ("Teeth_Lower.001", "EyeBall_L.001", "Tongue.001")
    assert "Teeth_Lower.001, EyeBall_L.001, Tongue.001 without shapes" in found.character.notes[0]
    assert "still        Teeth_Lower.001" in "\n".join(report_lines(character_record(found)))
    # On a jaw that turns the lower teeth and the tongue go along.
    given["meshes"][0]["extras"]["targetNames"] = [
        "other" if name == "jawOpen" else name for name in ARKIT_NAMES
    ]
    given["nodes"] += [{"name": "Jaw", "children": [1]}]
    given["scenes"] = [{"nodes": [0, *range(2, 8)]}]
    given["nodes"][0]["skin"] = given["nodes"][6]["skin"] = 0
    given["skins"] = [{"joints": [7]}]
    assert opened(given).still == ("EyeBall_L.001",)


def test_eyes_say_which_way_a_face_looks(opened):
    given = vrm(0)
    given["nodes"][2]["translation"], given["nodes"][3]["translation"] = [0, 0, -1], [0, 0, 1]
    assert opened(given).character.facing_deg == 90


def test_the_report_says_it_all(opened):
    given = record(("Head", [*ARKIT_NAMES[:-1], *OCULUS, "jawOpne", "cape"]))
    made = character_record(opened(given))
    assert made == json.loads(json.dumps(made))
    assert made["unknown"] == {"jawOpne": "jawOpen", "cape": ""}
    assert made["missing"] == ["tongueOut"] and made["meshes"] == {"Head": len(ARKIT_NAMES) + 16}
    lines = "\n".join(report_lines(made))
    assert "unknown      jawOpne (near jawOpen), cape" in lines
    assert "joints       none: the head does not turn" in lines


def test_a_head_stands_for_it_and_is_opened_once(tmp_path):
    path = tmp_path / "face.glb"
    path.write_bytes(glb(arkit()))
    head = open_speaking_head(path)
    assert head.character is not None and head.character.name == head.name == "face.glb"
    assert head.expression_names[:52] == ARKIT_NAMES or set(ARKIT_NAMES) < set(
        head.expression_names
    )
    assert open_speaking_head(path) is head
    path.write_bytes(glb(record(("Face", ["nothing"]))))
    with pytest.raises(HeadError, match="none known among its morph targets"):
        open_speaking_head(path)
    with pytest.raises(HeadError, match=r"`mesh`: 'x'; allowed: for a head in \.glb"):
        open_speaking_head("builtin", "x")


def changed(**places):
    """A character with values set at places such as nodes__0__mesh."""
    given = arkit(bufferViews=[], buffers=[inline(bytes(64))])
    given["bufferViews"] = [{"buffer": 0, "byteLength": 36}]
    for place, value in places.items():
        holder: Any = given
        steps = place.split("__")
        for step in steps[:-1]:
            holder = holder[int(step) if step.isdecimal() else step]
        holder[int(steps[-1]) if steps[-1].isdecimal() else steps[-1]] = value
    return given


ACCESSOR = {"componentType": 5126, "count": 3, "type": "VEC3"}


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (changed(asset__version="1.0"), r"asset.version '1.0'; allowed: glTF 2.0"),
        (changed(buffers__0__uri="face.bin"), r"buffers\[0\] kept in another file \(face.bin\)"),
        (changed(buffers__0__uri="file:///etc/passwd"), r"kept in another file \(file:///etc"),
        (changed(images=[{"uri": "https://a.b/c.png"}]), r"images\[0\] kept in another file"),
        (changed(buffers__0__byteLength=10**9), r"1000000000 bytes, of which 6\d are there"),
        (changed(buffers__0__byteLength=-1), r"byteLength -1; allowed: a whole number"),
        (changed(buffers__0={"byteLength": 64}), r"buffers\[0\] without content"),
        (changed(bufferViews__0__byteOffset=40), r"bufferViews\[0\] that reaches beyond"),
        (changed(bufferViews__0__buffer=7), r"bufferViews\[0\].buffer 7; allowed: one of 1"),
        (changed(accessors__1=ACCESSOR | {"bufferView": 0, "count": 4}), r"reaches beyond bufferV"),
        (changed(accessors__1=ACCESSOR | {"bufferView": 0, "byteOffset": 4}), "reaches beyond"),
        (changed(accessors__1=ACCESSOR | {"count": 10**15}), r"count 1000000000000000; allowed"),
        (changed(accessors__1=ACCESSOR | {"count": 2.5}), r"accessors\[1\].count 2.5"),
        (changed(accessors__1=ACCESSOR | {"type": "VEC9"}), r"accessors\[1\].type 'VEC9'"),
        (changed(accessors__1=ACCESSOR | {"componentType": 7}), r"componentType 7"),
        (
            changed(
                accessors__1=ACCESSOR
                | {
                    "sparse": {
                        "count": 9,
                        "indices": {"bufferView": 0, "componentType": 5123},
                        "values": {"bufferView": 0},
                    }
                }
            ),
            r"accessors\[1\].sparse.count 9",
        ),
        (changed(nodes__0__mesh=5), r"nodes\[0\].mesh 5; allowed: one of 1 meshes"),
        (changed(nodes__0__children=[0]), "nodes that hold each other in a circle"),
        (changed(nodes=[{"children": [2]}, {"children": [2]}, {}]), "with two parents"),
        (changed(nodes__0__rotation=[0, 0, 1]), r"nodes\[0\].rotation that is not 4 numbers"),
        (changed(nodes__0__weights=[0.0]), r"weights that are not one number for each morph"),
        (changed(meshes__0__primitives=[]), r"meshes\[0\] of 0 primitives"),
        (changed(meshes__0__primitives__0__targets=[{"POSITION": 77}]), r"POSITION 77"),
        (changed(skins=[{"joints": [99]}]), r"skins\[0\].joints 99"),
        (changed(meshes=[{"primitives": [{"attributes": {}}]}]), "no morph targets"),
        (changed(meshes__0__extras={}), r"known among its morph targets \(which have no names\)"),
        (changed(meshes__0__extras__targetNames=["eyeBlinkLeft"]), "no shape that moves a mouth"),
        (changed(meshes__0__extras__targetNames=["a b", "cape"]), r"none known .* \(a b, cape\)"),
        (changed(nodes={}), "nodes that is no list of records"),
    ],
)
def test_what_does_not_fit_is_refused_in_a_line(opened, given, says):
    with pytest.raises(HeadError, match=says) as told:
        opened(given)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "no JSON"),
        (b"glTF", "ends early"),
        (glb(arkit())[:400], "copy it again"),
        (b"glTF" + (1).to_bytes(4, "little") + bytes(40), "glTF of version 1"),
        (glb("[1]"), "JSON of a list"),
        (glb('{"asset": {"version": "2.0"}, "x": NaN}'), "NaN is no number"),
        (glb('{"asset": {"version": "2.0"}, "nodes": [{"scale": [1e999, 1, 1]}]}'), "1e999"),
        (glb("[" * 100_000), "nested too deeply"),
        (glb(b"\xff\xfe"), "no JSON"),
        (glb(arkit()).replace(b"JSON", b"BIN\0"), "does not begin with JSON"),
    ],
    ids=str,
)
def test_damaged_files_are_refused_in_a_line(tmp_path, data, says):
    path = tmp_path / "face.glb"
    path.write_bytes(data)
    with pytest.raises(HeadError, match=says) as told:
        open_character(path)
    assert "\n" not in str(told.value)


def test_scales_beyond_any_number_turn_no_joint(opened):
    given = vrm(1)
    given["nodes"][1]["scale"] = [1e300, 1e300, 1e300]
    given["nodes"][1]["children"] = [2, 3]
    given["nodes"][2]["scale"] = [1e300, 1e-300, 0]
    assert np.isfinite(opened(given).character.facing_deg)
