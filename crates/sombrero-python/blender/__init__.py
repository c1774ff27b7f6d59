# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sombrero for Blender: mark what is exported, and find the mark again."""

import bpy

from . import operators, panel, settings, work

_CLASSES = (*settings.CLASSES, *operators.CLASSES, *panel.CLASSES)


def register():
    for one in _CLASSES:
        bpy.utils.register_class(one)
    bpy.types.Scene.sombrero = bpy.props.PointerProperty(type=settings.Settings)
    bpy.types.TOPBAR_MT_file_export.append(panel.in_export_menu)


def unregister():
    # Blender does so too when it ends: the engine must not go on while Python is taken down.
    work.end()
    bpy.types.TOPBAR_MT_file_export.remove(panel.in_export_menu)
    del bpy.types.Scene.sombrero
    for one in reversed(_CLASSES):
        bpy.utils.unregister_class(one)
