# SPDX-FileCopyrightText: 2026 Elocute contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Elocute in Blender: pick a sound and a mesh, and its shape keys speak.

The installed program `elocute` does the work; this add-on exports the mesh to it and keys what
comes back.
"""

import shutil
import tempfile
from pathlib import Path
from typing import Any

import bpy
from bpy.props import (
    BoolProperty,
    CollectionProperty,
    FloatProperty,
    IntProperty,
    PointerProperty,
    StringProperty,
)

from . import scene as blender
from .program import (
    Run,
    Wishes,
    animate_command,
    find_program,
    mapping_command,
    mapping_rows,
    phone_marks,
    phones_command,
)
from .take_file import read_take

POLL_S = 0.2
ICONS = {"moved": "CHECKMARK", "fitted": "MOD_SMOOTH", "idle": "REMOVE", "unknown": "QUESTION"}


class ElocutePreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(
        name="elocute",
        description="The installed program; its name where it is on the path",
        subtype="FILE_PATH",
        default="elocute",
    )

    def draw(self, context: Any) -> None:
        self.layout.prop(self, "program")


class ElocuteRow(bpy.types.PropertyGroup):
    """A row of the mapping; its name is the shape."""

    state: StringProperty()
    what: StringProperty()


class ElocuteSettings(bpy.types.PropertyGroup):
    sound: StringProperty(
        name="Sound", description="Speech: a sound or a video", subtype="FILE_PATH"
    )
    face: PointerProperty(
        name="Mesh",
        description="The mesh whose shape keys are to speak",
        type=bpy.types.Object,
        poll=lambda self, each: each.type == "MESH" and each.data.shape_keys is not None,
    )
    take: StringProperty(
        name="Take", description="Name of the action; by default that of the sound"
    )
    text: StringProperty(name="Text", description="What is said, where it is known")
    mood: StringProperty(name="Mood", description="As `elocute animate --mood` takes it")
    style: StringProperty(name="Style", description="As `elocute animate --style` takes it")
    phones: BoolProperty(name="Phones as markers", default=True)
    strip: BoolProperty(name="As NLA strip", description="Push the action down", default=False)
    start: IntProperty(name="Start", description="Frame at which the sound begins", default=1)
    tolerance: FloatProperty(
        name="Tolerance",
        description="How far a cleaned curve may be off",
        default=0.01,
        min=0,
        max=1,
    )
    rows: CollectionProperty(type=ElocuteRow)
    row: IntProperty()


def _frame_rate(scene: Any) -> float:
    return scene.render.fps / scene.render.fps_base


def _wishes(scene: Any) -> Wishes:
    settings = scene.elocute
    sound = bpy.path.abspath(settings.sound)
    if not settings.sound or not Path(sound).is_file():
        raise RuntimeError("pick a sound")
    name = settings.take.strip() or Path(sound).stem
    wanted = (settings.text, settings.mood, settings.style)
    return Wishes(sound, _frame_rate(scene), name, *wanted)


def _program(context: Any) -> str:
    chosen = context.preferences.addons.get(__package__)
    return find_program(chosen.preferences.program if chosen else "elocute")


class _Waits(bpy.types.Operator):
    """Runs the program beside Blender, which stays awake; without a window it waits."""

    def begin(self, context: Any) -> Run:
        raise NotImplementedError

    def end(self, context: Any, run: Run) -> None:
        raise NotImplementedError

    def execute(self, context: Any) -> set[str]:
        self.room = Path(tempfile.mkdtemp(prefix="elocute-"))
        try:
            self.run = self.begin(context)
        except (OSError, RuntimeError) as problem:
            return self._over(context, str(problem))
        if bpy.app.background or context.window is None:
            self.run.wait()
            return self._done(context)
        self.timer = context.window_manager.event_timer_add(POLL_S, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.window.cursor_set("WAIT")
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        if event.type == "ESC":
            self.run.stop()
            self._awake(context)
            return self._over(context, "stopped", {"WARNING"})
        if event.type != "TIMER" or not self.run.poll():
            return {"PASS_THROUGH"}
        self._awake(context)
        return self._done(context)

    def _awake(self, context: Any) -> None:
        context.window_manager.event_timer_remove(self.timer)
        context.window.cursor_set("DEFAULT")

    def _done(self, context: Any) -> set[str]:
        if self.run.error:
            return self._over(context, self.run.error)
        try:
            self.end(context, self.run)
        except (OSError, RuntimeError, ValueError, KeyError, TypeError) as problem:
            return self._over(context, str(problem))
        for note in self.run.notes:
            self.report({"INFO"}, note)
        shutil.rmtree(self.room, ignore_errors=True)
        return {"FINISHED"}

    def _over(self, context: Any, why: str, kind: set[str] | None = None) -> set[str]:
        shutil.rmtree(self.room, ignore_errors=True)
        self.report(kind or {"ERROR"}, why)
        return {"CANCELLED"}


class ELOCUTE_OT_mapping(_Waits):
    """Show which shape keys speech moves"""

    bl_idname = "elocute.mapping"
    bl_label = "Show Mapping"

    def begin(self, context: Any) -> Run:
        program, character = _program(context), self.room / "character.glb"
        blender.export_character(context.scene.elocute.face, character)
        return Run([mapping_command(program, character)])

    def end(self, context: Any, run: Run) -> None:
        rows = context.scene.elocute.rows
        rows.clear()
        for shape, state, what in mapping_rows(run.output):
            row = rows.add()
            row.name, row.state, row.what = shape, state, what


class ELOCUTE_OT_speak(_Waits):
    """Key the mesh's shape keys and joints so that it says the sound"""

    bl_idname = "elocute.speak"
    bl_label = "Speak"
    bl_options = {"REGISTER", "UNDO"}

    def begin(self, context: Any) -> Run:
        program, character = _program(context), self.room / "character.glb"
        self.wishes = _wishes(context.scene)
        blender.export_character(context.scene.elocute.face, character)
        take = self.room / "take.glb"
        commands = [animate_command(program, self.wishes, character, take)]
        if context.scene.elocute.phones:
            commands.append(phones_command(program, self.wishes, self.room / "phones.json"))
        return Run(commands)

    def end(self, context: Any, run: Run) -> None:
        settings, wishes = context.scene.elocute, self.wishes
        take = read_take((self.room / "take.glb").read_bytes(), wishes.name)
        actions = blender.write_keys(settings.face, take, wishes.name, settings.start)
        if settings.strip:
            blender.push_down(settings.face, actions)
        if settings.phones:
            told = (self.room / "phones.json").read_text(encoding="utf-8")
            blender.set_marks(phone_marks(told), wishes.fps, settings.start)
        blender.add_sound(wishes.sound, settings.start)
        last = settings.start + len(take.times_s) - 1
        context.scene.frame_end = max(context.scene.frame_end, last)


class _OnTake(bpy.types.Operator):
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: Any) -> bool:
        face = context.scene.elocute.face
        return face is not None and bool(blender.actions_of(face))


class ELOCUTE_OT_clean(_OnTake):
    """Remove keys that the curve does not need"""

    bl_idname = "elocute.clean"
    bl_label = "Clean Keys"

    def execute(self, context: Any) -> set[str]:
        settings = context.scene.elocute
        before, after = blender.clean(blender.actions_of(settings.face), settings.tolerance)
        self.report({"INFO"}, f"{before} keys, now {after}")
        return {"FINISHED"}


class ELOCUTE_OT_bake(_OnTake):
    """Key each frame again, as the curves run now"""

    bl_idname = "elocute.bake"
    bl_label = "Bake Keys"

    def execute(self, context: Any) -> set[str]:
        count = blender.bake(blender.actions_of(context.scene.elocute.face))
        self.report({"INFO"}, f"{count} keys")
        return {"FINISHED"}


class ELOCUTE_UL_rows(bpy.types.UIList):
    def draw_item(
        self,
        context: Any,
        layout: Any,
        data: Any,
        item: Any,
        icon: int,
        active_data: Any,
        active_property: str,
    ) -> None:
        layout.label(text=item.name, icon=ICONS.get(item.state, "NONE"))
        layout.label(text=item.what or item.state)


class ELOCUTE_PT_panel(bpy.types.Panel):
    bl_label = "Elocute"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Elocute"

    def draw(self, context: Any) -> None:
        settings, layout = context.scene.elocute, self.layout
        layout.use_property_split = True
        for name in ("sound", "face", "take", "text", "mood", "style", "start", "phones", "strip"):
            layout.prop(settings, name)
        row = layout.row(align=True)
        row.operator("elocute.mapping")
        row.operator("elocute.speak", icon="PLAY_SOUND")
        if settings.rows:
            layout.template_list("ELOCUTE_UL_rows", "", settings, "rows", settings, "row", rows=6)
        layout.prop(settings, "tolerance")
        row = layout.row(align=True)
        row.operator("elocute.clean")
        row.operator("elocute.bake")


CLASSES = (
    ElocutePreferences,
    ElocuteRow,
    ElocuteSettings,
    ELOCUTE_OT_mapping,
    ELOCUTE_OT_speak,
    ELOCUTE_OT_clean,
    ELOCUTE_OT_bake,
    ELOCUTE_UL_rows,
    ELOCUTE_PT_panel,
)


def register() -> None:
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.elocute = PointerProperty(type=ElocuteSettings)


def unregister() -> None:
    del bpy.types.Scene.elocute
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)
