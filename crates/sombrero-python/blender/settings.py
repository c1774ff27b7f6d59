# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the artist chooses. It is kept with the scene; secrets are not, only where they lie."""

import bpy
from bpy.props import EnumProperty, StringProperty


class Settings(bpy.types.PropertyGroup):
    owner: StringProperty(name="Owner", description="Whose mark it is; it becomes part of the mark")
    recipient: StringProperty(name="For", description="Whose copy it is; may be empty")
    what: EnumProperty(
        name="Export",
        items=(
            ("SELECTED", "Selected", "The selected objects"),
            ("SCENE", "Scene", "All objects that are seen"),
        ),
        default="SELECTED",
    )
    preset: EnumProperty(
        name="Mark",
        items=(
            ("faithful", "Faithful", "Nobody sees it"),
            ("robust", "Robust", "Survives more, and is seen on flat faces"),
        ),
        default="faithful",
    )
    secrets: StringProperty(
        name="Secrets",
        description="Folder for originals and keys. Empty: a folder beside the copy",
        subtype="DIR_PATH",
    )
    buyers: StringProperty(
        name="Buyers",
        description="A CSV file whose first line has the column `recipient`; each further line is a buyer",
        subtype="FILE_PATH",
    )
    original: StringProperty(
        name="Original",
        description="The file that was marked, in the secret folder",
        subtype="FILE_PATH",
    )
    key: StringProperty(
        name="Key", description="Its key. Empty: the one beside the original", subtype="FILE_PATH"
    )
    keys: StringProperty(name="Keys", description="The folder with the buyers' keys", subtype="DIR_PATH")
    suspect_is: EnumProperty(
        name="Suspect",
        items=(
            ("SELECTED", "Selected", "The selected objects"),
            ("FILE", "File", "A mesh file on the disk"),
        ),
        default="SELECTED",
    )
    suspect: StringProperty(name="File", description="The mesh file to look at", subtype="FILE_PATH")
    report: StringProperty(
        name="Report", description="The page that the last check wrote", subtype="FILE_PATH", options={"HIDDEN"}
    )


CLASSES = (Settings,)
