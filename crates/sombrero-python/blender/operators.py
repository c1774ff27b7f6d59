# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be done. Each exports in Blender's thread, lets the engine work on another, and says what came of it."""

import shutil
import webbrowser
from pathlib import Path

import bpy
from bpy.props import BoolProperty, StringProperty

from . import export, places, words, work
from .places import Unusable

#: Lines that say what the last work came to, for the panel.
said = []


def engine():
    """The engine, which the extension's wheel holds."""
    try:
        import sombrero
    except ImportError as error:
        raise Unusable(
            f"Sombrero's engine cannot be loaded ({error}); install the extension that was made for this system"
        ) from None
    return sombrero


def path_of(text, what):
    """A path that the artist chose."""
    if not text.strip():
        raise Unusable(f"{what} is not chosen; choose it in the panel")
    path = Path(bpy.path.abspath(text))
    if not path.exists():
        raise Unusable(f"{path}: there is no such file or folder; choose {what[0].lower()}{what[1:]} anew")
    return path


def optional(text):
    """A folder that the artist may have chosen."""
    return bpy.path.abspath(text) if text.strip() else ""


class Working:
    """An operator whose work takes time: ``prepare`` gives the work, and ``told`` the lines for its result."""

    wait: BoolProperty(
        name="Wait", description="Return when it is done, for scripts", default=False, options={"HIDDEN", "SKIP_SAVE"}
    )

    def execute(self, context):
        if work.current is not None:
            self.report({"ERROR"}, "Sombrero is at work; wait for it or cancel it")
            return {"CANCELLED"}
        said.clear()
        self.exported = None
        try:
            begun = self.prepare(context, engine())
        except (Unusable, OSError) as error:
            return self.failed(error)
        work.begin(begun)
        if self.wait or bpy.app.background or context.window is None:
            return self.waited(context)
        self.timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Sombrero is at work. Esc: cancel")
        return {"RUNNING_MODAL"}

    def waited(self, context):
        begun = work.current
        context.window_manager.progress_begin(0, 100)
        try:
            while not begun.is_over(0.1):
                _, done, of = begun.progress
                context.window_manager.progress_update(100 * words.share(done, of))
        except KeyboardInterrupt:
            begun.cancel()
            begun.is_over(None)
        finally:
            context.window_manager.progress_end()
        return self.over(context)

    def modal(self, context, event):
        if work.current is None:
            return self.left(context)
        if event.type == "ESC" and event.value == "PRESS":
            work.current.cancel()
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        redraw(context)
        if not work.current.is_over():
            return {"PASS_THROUGH"}
        self.leave(context)
        return self.over(context)

    def cancel(self, context):
        """Blender ends the operator, because another file is loaded or it quits itself."""
        work.end()
        self.leave(context)

    def left(self, context):
        self.leave(context)
        return {"CANCELLED"}

    def leave(self, context):
        context.window_manager.event_timer_remove(self.timer)
        context.workspace.status_text_set(None)
        redraw(context)

    def over(self, context):
        done = work.current
        work.forget()
        try:
            lines = self.told(context, done.result())
        except work.Cancelled:
            said[:] = ["Cancelled"]
            self.report({"WARNING"}, "Sombrero: cancelled")
            return {"CANCELLED"}
        except Exception as error:
            return self.failed(error)
        said[:] = lines
        self.report({"INFO"}, lines[0])
        return {"FINISHED"}

    def failed(self, error):
        text = words.error(error, self.exported)
        said[:] = [text]
        self.report({"ERROR"}, text)
        return {"CANCELLED"}


class ToFile(Working):
    """An operator that asks for the name of a marked copy."""

    filepath: StringProperty(name="File", subtype="FILE_PATH")
    check_existing: BoolProperty(default=True, options={"HIDDEN"})
    filter_glob: StringProperty(default="*.glb;*.obj;*.stl;*.ply", options={"HIDDEN"})

    def invoke(self, context, event):
        if not self.filepath:
            name = Path(bpy.data.filepath).with_suffix("") if bpy.data.filepath else Path("model")
            self.filepath = f"{name}.glb"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def draw(self, context):
        choices(self.layout, context.scene.sombrero)

    def exported_to(self, context, copy, settings):
        """The original, exported into a new secret folder, which is taken away if that fails."""
        objects = export.chosen(context, settings.what)
        folder = places.secret_folder(copy, optional(settings.secrets))
        self.exported = folder / (copy.stem + copy.suffix.lower())
        try:
            export.export(context, objects, self.exported)
        except BaseException:
            places.remove_unless(False, folder)
            raise
        return self.exported


def choices(layout, settings):
    """What is asked in the panel and beside the file's name."""
    layout.prop(settings, "owner")
    layout.row().prop(settings, "what", expand=True)
    layout.prop(settings, "preset")
    layout.prop(settings, "secrets")


class SOMBRERO_OT_mark(ToFile, bpy.types.Operator):
    """Export a marked copy; the original and the key go to a secret folder"""

    bl_idname = "sombrero.mark"
    bl_label = "Export Marked Copy"

    def prepare(self, context, sombrero):
        settings = context.scene.sombrero
        self.published = places.copy_named(bpy.path.abspath(self.filepath))
        original = self.exported_to(context, self.published, settings)
        self.key = original.with_suffix(".key")
        copy, key = self.published, self.key
        names = {"owner": settings.owner, "recipient": settings.recipient, "preset": settings.preset}

        def task(progress):
            answer = sombrero.embed(original, copy, key, force=True, progress=progress, **names)
            for file in places.beside(original):
                shutil.copy2(file, copy.parent)
            return answer

        return work.Work(task, lambda: places.remove_unless(key.is_file(), original.parent))

    def told(self, context, answer):
        settings = context.scene.sombrero
        settings.original, settings.key = str(self.exported), str(self.key)
        return words.marked(answer, self.published, self.exported.parent)


class SOMBRERO_OT_copies(ToFile, bpy.types.Operator):
    """Export a marked copy and a key for each buyer of a list; a list that has grown goes on where it was"""

    bl_idname = "sombrero.copies"
    bl_label = "Export Copies for Buyers"

    def prepare(self, context, sombrero):
        settings = context.scene.sombrero
        buyers = path_of(settings.buyers, "The list of buyers")
        copy = places.copy_named(bpy.path.abspath(self.filepath))
        original = self.exported_to(context, copy, settings)
        before = places.same_as_before(original, optional(settings.secrets), copy)
        if before is not None:
            places.remove_unless(False, original.parent)
            original = self.exported = before
        self.folder = folder = places.copies_folder(copy, original)
        had = set(folder.glob("keys/*.key"))
        options = [f"--recipients={buyers}", f"--out-dir={folder}", f"--preset={settings.preset}"]
        options.append(f"--owner={settings.owner}")

        def task(progress):
            [answer] = sombrero.command("embed", str(original), *options, progress=progress)
            if answer.failed and not answer.written + answer.kept:
                raise Unusable(words.failures(answer)[0])
            for file in places.beside(original):
                shutil.copy2(file, folder)
            return answer

        def tidy():
            is_needed = before is not None or set(folder.glob("keys/*.key")) != had
            places.remove_unless(is_needed, original.parent)

        return work.Work(task, tidy)

    def told(self, context, answer):
        settings = context.scene.sombrero
        settings.original, settings.key, settings.keys = str(self.exported), "", str(self.folder / "keys")
        return words.copied(answer, self.folder, self.exported)


class Looking(Working):
    """An operator that looks at a suspect."""

    def suspect(self, context, settings, stem):
        """The suspect: a file, or the selected objects as one; in the second case it is ours."""
        if settings.suspect_is == "FILE":
            return path_of(settings.suspect, "The suspect"), False
        objects = export.chosen(context, "SELECTED")
        self.exported = path = stem.with_name(stem.name + ".glb")
        export.export(context, objects, path)
        return path, True


def name_of(context, settings):
    """What to call a suspect."""
    if settings.suspect_is == "FILE":
        return Path(settings.suspect).name
    active = context.view_layer.objects.active
    return active.name if active is not None and active.select_get() else "the selection"


class SOMBRERO_OT_check(Looking, bpy.types.Operator):
    """Look for the mark of the original in the suspect, and write a report"""

    bl_idname = "sombrero.check"
    bl_label = "Check"

    def prepare(self, context, sombrero):
        settings = context.scene.sombrero
        self.original = original = path_of(settings.original, "The original")
        key = path_of(settings.key, "The key") if settings.key.strip() else places.key_of(original)
        self.called = name_of(context, settings)
        folder = original.parent / "checks"
        folder.mkdir(exist_ok=True)
        stem = places.fresh_file(folder, Path(self.called).stem, (".glb", ".html"))
        suspect, is_ours = self.suspect(context, settings, stem)
        self.page = page = stem.with_name(stem.name + ".html")

        def tidy():
            page.unlink(missing_ok=True)
            if is_ours:
                suspect.unlink(missing_ok=True)

        return work.Work(
            lambda progress: sombrero.detect(suspect, original, key, report=page, progress=progress), tidy
        )

    def told(self, context, answer):
        context.scene.sombrero.report = str(self.page)
        return words.checked(answer, self.called, self.original)


class SOMBRERO_OT_trace(Looking, bpy.types.Operator):
    """Find out whose copy the suspect is"""

    bl_idname = "sombrero.trace"
    bl_label = "Trace"

    def prepare(self, context, sombrero):
        settings = context.scene.sombrero
        original = path_of(settings.original, "The original")
        keys = path_of(settings.keys, "The folder of keys")
        self.called = name_of(context, settings)
        folder = original.parent / "checks"
        folder.mkdir(exist_ok=True)
        stem = places.fresh_file(folder, Path(self.called).stem, (".glb",))
        suspect, is_ours = self.suspect(context, settings, stem)

        def task(progress):
            try:
                return sombrero.trace(suspect, original, keys, progress=progress)
            finally:
                # There is no report that speaks of it.
                if is_ours:
                    suspect.unlink(missing_ok=True)

        return work.Work(task)

    def told(self, context, answer):
        return words.traced(answer, self.called)


class SOMBRERO_OT_open_report(bpy.types.Operator):
    """Open the report of the last check in the browser"""

    bl_idname = "sombrero.open_report"
    bl_label = "Open Report"

    def execute(self, context):
        try:
            webbrowser.open(path_of(context.scene.sombrero.report, "The report").as_uri())
        except Unusable as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        return {"FINISHED"}


class SOMBRERO_OT_cancel(bpy.types.Operator):
    """End what Sombrero is doing; nothing half-made is left"""

    bl_idname = "sombrero.cancel"
    bl_label = "Cancel"

    @classmethod
    def poll(cls, context):
        return work.current is not None

    def execute(self, context):
        work.current.cancel()
        return {"FINISHED"}


def redraw(context):
    """Has the sidebars drawn anew."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                area.tag_redraw()


CLASSES = (
    SOMBRERO_OT_mark,
    SOMBRERO_OT_copies,
    SOMBRERO_OT_check,
    SOMBRERO_OT_trace,
    SOMBRERO_OT_open_report,
    SOMBRERO_OT_cancel,
)
