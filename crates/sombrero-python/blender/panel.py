# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""What is seen: the sidebar of the 3D view, and a line in File > Export."""

import textwrap

import bpy

from . import operators, words, work

#: Letters in a line of the sidebar at its usual width.
_WIDTH = 38


class Sidebar:
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Sombrero"


class SOMBRERO_PT_now(Sidebar, bpy.types.Panel):
    bl_label = "Sombrero"

    def draw(self, context):
        layout, going_on = self.layout, work.current
        if going_on is not None:
            stage, done, of = going_on.progress
            text = "Ending" if going_on.is_cancelled else words.stage(stage)
            layout.progress(factor=words.share(done, of), text=text)
            layout.operator("sombrero.cancel", icon="CANCEL")
            return
        column = layout.column(align=True)
        for line in operators.said or ["Mark a model, or check one"]:
            for part in textwrap.wrap(line, _WIDTH):
                column.label(text=part)
        if context.scene.sombrero.report:
            layout.operator("sombrero.open_report", icon="URL")


class SOMBRERO_PT_mark(Sidebar, bpy.types.Panel):
    bl_label = "Mark"

    def draw(self, context):
        layout, settings = self.layout, context.scene.sombrero
        layout.enabled = work.current is None
        operators.choices(layout, settings)
        layout.prop(settings, "recipient")
        layout.operator("sombrero.mark", icon="EXPORT", text="Export Marked Copy...")
        layout.separator()
        layout.prop(settings, "buyers")
        layout.operator("sombrero.copies", icon="COMMUNITY", text="Export Copies for Buyers...")


class SOMBRERO_PT_check(Sidebar, bpy.types.Panel):
    bl_label = "Check"

    def draw(self, context):
        layout, settings = self.layout, context.scene.sombrero
        layout.enabled = work.current is None
        layout.row().prop(settings, "suspect_is", expand=True)
        if settings.suspect_is == "FILE":
            layout.prop(settings, "suspect")
        layout.prop(settings, "original")
        layout.prop(settings, "key")
        layout.operator("sombrero.check", icon="VIEWZOOM")
        layout.separator()
        layout.prop(settings, "keys")
        layout.operator("sombrero.trace", icon="USER")


def in_export_menu(self, context):
    self.layout.operator("sombrero.mark", text="Sombrero: Marked Copy (.glb/.obj/.stl/.ply)")


CLASSES = (SOMBRERO_PT_now, SOMBRERO_PT_mark, SOMBRERO_PT_check)
