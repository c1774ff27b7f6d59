# SPDX-FileCopyrightText: 2026 The sombrero developers
# SPDX-License-Identifier: GPL-3.0-or-later
"""Objects to a file, by Blender's own exporters.

The file is what gets marked, not arrays of vertices: names, hierarchy, instances, materials and pictures are then the
exporter's business, and the engine changes no byte of them. An instance stays an instance of one stored mesh, which is
marked once. And detection needs the original to the byte, which is a file in any case.
"""

from contextlib import contextmanager

import bpy

from .places import Unusable

#: Blender's exporter for each ending, with what is not its default.
_EXPORTERS = {
    ".glb": (
        "export_scene.gltf",
        {
            "export_format": "GLB",
            "use_selection": True,
            "export_apply": True,
            "export_gn_mesh": True,
            "export_draco_mesh_compression_enable": False,
        },
    ),
    ".obj": ("wm.obj_export", {"export_selected_objects": True, "apply_modifiers": True, "path_mode": "COPY"}),
    ".stl": ("wm.stl_export", {"export_selected_objects": True, "apply_modifiers": True}),
    ".ply": ("wm.ply_export", {"export_selected_objects": True, "apply_modifiers": True}),
}


def chosen(context, what):
    """The objects that are selected, or all that are seen."""
    if what == "SELECTED":
        objects = [one for one in context.view_layer.objects if one.select_get()]
        if not objects:
            raise Unusable("Nothing is selected; select the objects, or choose Scene")
    else:
        objects = [one for one in context.view_layer.objects if one.visible_get()]
        if not objects:
            raise Unusable("Nothing in the scene is seen; show the objects")
    return objects


def export(context, objects, path):
    """Writes the objects to a file, modifiers applied. Selection and mode are afterwards what they were."""
    name, options = _EXPORTERS[path.suffix.lower()]
    group, operator = name.split(".")
    operator = getattr(getattr(bpy.ops, group), operator)
    try:
        known = operator.get_rna_type().properties.keys()
    except KeyError:
        raise Unusable(
            f"Blender's exporter for {path.suffix} is switched off; switch it on in Preferences, Add-ons"
        ) from None
    options = {option: value for option, value in options.items() if option in known}
    with _selected(context, objects):
        try:
            done = operator(filepath=str(path), check_existing=False, **options)
        except RuntimeError as error:
            raise Unusable(f"Blender cannot export this: {' '.join(str(error).split())}") from None
    if "FINISHED" not in done or not path.is_file():
        raise Unusable("Blender exported nothing; see its console for why")


@contextmanager
def _selected(context, objects):
    layer = context.view_layer
    active = layer.objects.active
    mode = active.mode if active is not None else "OBJECT"
    before = {one for one in layer.objects if one.select_get()}
    if mode != "OBJECT":
        # What is being edited reaches the mesh only then.
        bpy.ops.object.mode_set(mode="OBJECT")
    try:
        for one in before:
            one.select_set(False)
        for one in objects:
            one.select_set(True)
        yield
    finally:
        for one in layer.objects:
            one.select_set(one in before)
        layer.objects.active = active
        if mode != "OBJECT":
            bpy.ops.object.mode_set(mode=mode)
