"""The extension within Blender's module, without a display: `README.md` says how to run it."""

import importlib
import importlib.util
import json
import os
import struct
import sys
import tempfile
import threading
from pathlib import Path

import pytest

# Blender reads its folders when it is loaded.
_home = tempfile.TemporaryDirectory(prefix="sombrero-blender-")
os.environ["BLENDER_USER_RESOURCES"] = _home.name
bpy = pytest.importorskip("bpy", reason="Blender's module is not installed: the extension was not tested in Blender")

import addon_utils  # noqa: E402  (Blender's own, there once it is loaded)
from mathutils import Euler, Matrix  # noqa: E402

EXTENSION = Path(__file__).parent.parent
ZIP = os.environ.get("SOMBRERO_EXTENSION")


@pytest.fixture(scope="session")
def addon():
    """The extension, installed as a user would; or its source, with the engine of this environment."""
    addon_utils.enable("io_scene_gltf2")
    if ZIP:
        done = bpy.ops.extensions.package_install_files(
            filepath=os.path.abspath(ZIP), repo="user_default", enable_on_install=True
        )
        assert done == {"FINISHED"}
        yield importlib.import_module("bl_ext.user_default.sombrero")
    else:
        pytest.importorskip("sombrero", reason="neither SOMBRERO_EXTENSION nor the package sombrero")
        spec = importlib.util.spec_from_file_location(
            "sombrero_for_blender", EXTENSION / "__init__.py", submodule_search_locations=[str(EXTENSION)]
        )
        made = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = made
        spec.loader.exec_module(made)
        made.register()
        yield made
        made.unregister()


@pytest.fixture
def scene(addon):
    """Two objects with modifiers; one is shown by three objects, and both again by an instance of their collection."""
    empty_scene(addon)
    models = bpy.data.collections.new("Models")
    bpy.context.scene.collection.children.link(models)
    vase, bust = waves("Vase", 20, 16), waves("Büste", 16, 20)
    for one, place in ((vase, (0, 0, 0)), (bust, (4, 0, 0))):
        models.objects.link(one)
        one.location = place
    vase.modifiers.new("Smooth", "SUBSURF").levels = 1
    mirror = bust.modifiers.new("Twice", "MIRROR")
    mirror.use_axis = (False, True, False)
    mirror.use_clip = False
    bust.data.transform(Matrix.Translation((0, 2, 0)))
    plain = waves("Plain", 24, 20)
    models.objects.link(plain)
    plain.location = (8, 0, 0)
    for number in range(2):
        again = bpy.data.objects.new(f"Plain again {number}", plain.data)
        again.location = (8, 4 + 4 * number, 0)
        again.scale = (1, 1, 1 + number)
        models.objects.link(again)
    shown = bpy.data.objects.new("Shown again", None)
    shown.instance_type, shown.instance_collection, shown.location = "COLLECTION", models, (0, 0, 9)
    bpy.context.scene.collection.objects.link(shown)
    bpy.context.scene.sombrero.owner = "A. Museum"
    bpy.context.scene.sombrero.what = "SCENE"
    bpy.context.view_layer.update()
    return models


def empty_scene(addon):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    assert hasattr(bpy.context.scene, "sombrero")


def waves(name, around, along):
    """A closed surface with waves; Blender makes spheres, and the waves are ours."""
    from math import cos, sin

    bpy.ops.mesh.primitive_uv_sphere_add(segments=around, ring_count=along)
    made = bpy.context.object
    bpy.context.scene.collection.objects.unlink(made)
    made.name = made.data.name = name
    for vertex in made.data.vertices:
        x, y, z = vertex.co
        vertex.co *= 1 + 0.15 * sin(3 * z + 2 * x) + 0.08 * cos(5 * y + z)
    return made


def glb(path):
    """The JSON of a GLB."""
    content = Path(path).read_bytes()
    (length,) = struct.unpack_from("<I", content, 12)
    return json.loads(content[20 : 20 + length])


def without_positions(document):
    """All that marking must not change."""
    for mesh in document["meshes"]:
        for primitive in mesh["primitives"]:
            accessor = document["accessors"][primitive["attributes"]["POSITION"]]
            accessor.pop("min", None)
            accessor.pop("max", None)
    return document


def imported(path):
    """Selects what a GLB brings into an empty scene."""
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(path))
    bpy.ops.object.select_all(action="DESELECT")
    for one in set(bpy.data.objects) - before:
        one.select_set(True)


def test_blenders_own_check_accepts_the_zip():
    if not ZIP:
        pytest.skip("SOMBRERO_EXTENSION names no zip")
    import subprocess

    [tool] = Path(bpy.utils.resource_path("LOCAL"), "scripts", "addons_core", "bl_pkg", "cli").glob("blender_ext.py")
    done = subprocess.run([sys.executable, tool, "validate", ZIP], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "error" not in done.stdout.lower(), done.stdout + done.stderr


def test_a_scene_is_marked_on_export_and_found_again(addon, scene, tmp_path):
    settings = bpy.context.scene.sombrero
    assert bpy.ops.sombrero.mark(filepath=str(tmp_path / "scene.glb")) == {"FINISHED"}
    copy, original = tmp_path / "scene.glb", tmp_path / "scene-secret" / "scene.glb"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene-secret", "scene.glb"]
    assert sorted(p.name for p in original.parent.iterdir()) == ["scene.glb", "scene.key"]
    assert (settings.original, settings.key) == (str(original), str(original.with_suffix(".key")))

    document = glb(copy)
    assert without_positions(document) == without_positions(glb(original)), "names, nodes, instances, materials"
    assert copy.read_bytes() != original.read_bytes()
    names = [node["name"] for node in document["nodes"]]
    assert {"Vase", "Büste", "Plain", "Plain again 0", "Plain again 1", "Shown again"} <= set(names)
    shown = [node["mesh"] for node in document["nodes"] if "mesh" in node]
    plain = next(node["mesh"] for node in document["nodes"] if node["name"] == "Plain")
    assert shown.count(plain) == 6, "one stored mesh for three objects, and for the collection's instance of them"
    assert len(shown) == 10

    # The modifiers are in it: a subdivided sphere has four times as many faces.
    vase = next(node["mesh"] for node in document["nodes"] if node["name"] == "Vase")
    indices = document["meshes"][vase]["primitives"][0]["indices"]
    triangles = len(bpy.data.objects["Vase"].data.loop_triangles) or sum(
        len(face.vertices) - 2 for face in bpy.data.objects["Vase"].data.polygons
    )
    assert document["accessors"][indices]["count"] > 3 * 3 * triangles

    # Somebody else's scene: turned, scaled, and one part alone.
    key, kept = settings.key, settings.original
    empty_scene(addon)
    imported(copy)
    settings = bpy.context.scene.sombrero
    settings.original, settings.key = kept, key
    for one in bpy.context.selected_objects:
        if one.parent is None:
            one.location.rotate(Euler((0, 0, 0.5)))
            one.rotation_mode = "XYZ"
            one.rotation_euler.z += 0.5
    bpy.context.view_layer.update()
    assert bpy.ops.sombrero.check() == {"FINISHED"}
    assert addon.operators.said[0].startswith("Found: "), addon.operators.said
    assert Path(settings.report).read_text().startswith("<!DOCTYPE html>")
    assert Path(settings.report).with_suffix(".glb").is_file(), "what the report speaks of"


def test_what_is_not_marked_is_not_found(addon, scene, tmp_path):
    settings = bpy.context.scene.sombrero
    bpy.ops.sombrero.mark(filepath=str(tmp_path / "scene.glb"))
    settings.suspect_is, settings.suspect = "FILE", settings.original
    assert bpy.ops.sombrero.check() == {"FINISHED"}
    assert addon.operators.said[0] == "Not found: no mark of scene.glb in scene.glb"
    settings.suspect = str(tmp_path / "scene.glb")
    bpy.ops.sombrero.check()
    assert addon.operators.said[0] == "Found: scene.glb carries the mark of scene.glb"


@pytest.mark.parametrize("suffix", [".obj", ".stl", ".ply"])
def test_other_formats(addon, scene, tmp_path, suffix):
    settings = bpy.context.scene.sombrero
    material = bpy.data.materials.new("Clay")
    bpy.data.objects["Vase"].data.materials.append(material)
    copy = tmp_path / f"scene{suffix}"
    assert bpy.ops.sombrero.mark(filepath=str(copy)) == {"FINISHED"}
    settings.suspect_is, settings.suspect = "FILE", str(copy)
    bpy.ops.sombrero.check()
    assert addon.operators.said[0].startswith("Found: ")
    if suffix == ".obj":
        assert "Clay" in (tmp_path / "scene.mtl").read_text(), "materials go with the copy"


def test_selection_and_mode_stay_and_hidden_objects_are_left_out(addon, scene, tmp_path):
    vase, plain = bpy.data.objects["Vase"], bpy.data.objects["Plain"]
    bpy.data.objects["Shown again"].hide_set(True)
    plain.hide_set(True)
    bpy.ops.object.select_all(action="DESELECT")
    vase.select_set(True)
    bpy.context.view_layer.objects.active = vase
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.sombrero.mark(filepath=str(tmp_path / "scene.glb"))
    assert vase.mode == "EDIT" and bpy.context.selected_objects == [vase]
    bpy.ops.object.mode_set(mode="OBJECT")
    names = {node["name"] for node in glb(tmp_path / "scene.glb")["nodes"]}
    assert "Vase" in names and "Büste" in names and not {"Plain", "Shown again"} & names
    bpy.context.scene.sombrero.what = "SELECTED"
    bpy.ops.sombrero.mark(filepath=str(tmp_path / "vase.glb"))
    assert [node["name"] for node in glb(tmp_path / "vase.glb")["nodes"]] == ["Vase"]


def test_exported_again_it_gets_a_new_folder(addon, scene, tmp_path):
    for _ in range(2):
        bpy.ops.sombrero.mark(filepath=str(tmp_path / "scene.glb"))
    first, second = (tmp_path / name / "scene.key" for name in ("scene-secret", "scene-secret-2"))
    assert first.read_bytes() != second.read_bytes()
    assert bpy.context.scene.sombrero.key == str(second)


def test_copies_for_buyers_and_whose_one_is(addon, scene, tmp_path):
    settings = bpy.context.scene.sombrero
    buyers = tmp_path / "buyers.csv"
    buyers.write_text('recipient\nBob\n"Doe, Carol"\n')
    settings.buyers = str(buyers)
    assert bpy.ops.sombrero.copies(filepath=str(tmp_path / "scene.glb")) == {"FINISHED"}
    assert addon.operators.said[0] == "New copies in scene-copies: 2"
    first = {path: path.read_bytes() for path in (tmp_path / "scene-copies").rglob("*.*")}
    assert len(first) == 4

    # The list grows, and the scene is as it was: what there is stays, and there is no second original.
    buyers.write_text('recipient\nBob\n"Doe, Carol"\nDave\n')
    bpy.ops.sombrero.copies(filepath=str(tmp_path / "scene.glb"))
    assert addon.operators.said[0] == "New copies in scene-copies: 1, 2 from before"
    assert all(path.read_bytes() == content for path, content in first.items())
    assert [p.name for p in tmp_path.glob("*-secret*")] == ["scene-secret"]

    # Another owner is refused, as nobody can tell which of two marks a copy has.
    settings.owner = "B. Museum"
    with pytest.raises(RuntimeError, match="choose another folder or file name"):
        bpy.ops.sombrero.copies(filepath=str(tmp_path / "scene.glb"))
    settings.owner = "A. Museum"

    # Another scene has folders of its own.
    bpy.data.objects["Plain"].location.z += 1
    bpy.ops.sombrero.copies(filepath=str(tmp_path / "scene.glb"))
    assert addon.operators.said[0] == "New copies in scene-copies-2: 3"
    assert (tmp_path / "scene-secret-2" / "scene.glb").is_file()
    settings.original, settings.keys = (str(tmp_path / one) for one in ("scene-secret/scene.glb", "scene-copies/keys"))

    kept = settings.original, settings.keys
    [copy] = [path for path in (tmp_path / "scene-copies").glob("*.glb") if "bob" in path.name]
    empty_scene(addon)
    imported(copy)
    settings = bpy.context.scene.sombrero
    settings.original, settings.keys = kept
    assert bpy.ops.sombrero.trace() == {"FINISHED"}
    assert addon.operators.said[0].endswith("is the copy of Bob"), addon.operators.said
    assert list((Path(kept[0]).parent / "checks").iterdir()) == []


def cancelled_at_the_first_word(addon):
    """Presses Cancel as soon as the engine works."""

    def press():
        while addon.work.current is None or not addon.work.current.progress[0]:
            pass
        addon.work.current.cancel()

    thread = threading.Thread(target=press)
    thread.start()
    return thread


def test_cancel_leaves_nothing(addon, scene, tmp_path):
    thread = cancelled_at_the_first_word(addon)
    assert bpy.ops.sombrero.mark(filepath=str(tmp_path / "scene.glb")) == {"CANCELLED"}
    thread.join()
    assert list(tmp_path.iterdir()) == [] and addon.operators.said == ["Cancelled"]
    assert addon.work.current is None
    bpy.ops.sombrero.mark(filepath=str(tmp_path / "scene.glb"))

    settings = bpy.context.scene.sombrero
    settings.suspect_is, settings.suspect = "FILE", str(tmp_path / "scene.glb")
    thread = cancelled_at_the_first_word(addon)
    assert bpy.ops.sombrero.check() == {"CANCELLED"}
    thread.join()
    assert list((tmp_path / "scene-secret" / "checks").iterdir()) == []


def test_the_window_is_left_alone_while_the_engine_works(addon, tmp_path):
    """What Blender calls in a window, with a stand-in for it: there is none here."""

    class Window:
        windows = ()
        timers = status = None

        def event_timer_remove(self, timer):
            self.timers = timer

        def status_text_set(self, text):
            self.status = text

    class Event:
        def __init__(self, kind):
            self.type, self.value = kind, "PRESS"

    class Context:
        window_manager = workspace = Window()

    class Operator(addon.operators.Working):
        timer, exported = "the timer", None
        reports = ()

        def told(self, context, result):
            return [result]

        def report(self, kind, text):
            self.reports = (*self.reports, (*kind, text))

    going = threading.Event()
    operator = Operator()
    addon.work.begin(addon.work.Work(lambda progress: "Done" if going.wait(30) else "Never"))
    assert operator.modal(Context, Event("TIMER")) == {"PASS_THROUGH"}
    assert operator.modal(Context, Event("MOUSEMOVE")) == {"PASS_THROUGH"}
    going.set()
    addon.work.current.is_over(30)
    assert operator.modal(Context, Event("TIMER")) == {"FINISHED"}
    assert operator.reports == (("INFO", "Done"),) and Window.timers is None
    assert Context.workspace.timers == "the timer" and addon.work.current is None

    def endless(progress):
        while True:
            progress("basis", 1, 2)

    addon.work.begin(addon.work.Work(endless))
    assert operator.modal(Context, Event("ESC")) == {"RUNNING_MODAL"}
    addon.work.current.is_over(30)
    assert operator.modal(Context, Event("TIMER")) == {"CANCELLED"}
    assert addon.operators.said == ["Cancelled"]


def test_errors_are_sentences(addon, scene, tmp_path):
    settings = bpy.context.scene.sombrero

    def refused(operator, sentence, **options):
        with pytest.raises(RuntimeError, match=sentence):
            operator(**options)
        assert addon.work.current is None

    refused(bpy.ops.sombrero.mark, "There is no file name; give one", filepath="")
    refused(bpy.ops.sombrero.mark, "choose one of these endings", filepath=str(tmp_path / "a.fbx"))
    refused(bpy.ops.sombrero.check, "The original is not chosen; choose it in the panel")
    refused(bpy.ops.sombrero.copies, "The list of buyers is not chosen", filepath=str(tmp_path / "a.glb"))
    refused(bpy.ops.sombrero.open_report, "The report is not chosen")
    settings.original = str(tmp_path / "gone.glb")
    refused(bpy.ops.sombrero.check, "choose the original anew")
    settings.what = "SELECTED"
    bpy.ops.object.select_all(action="DESELECT")
    refused(bpy.ops.sombrero.mark, "Nothing is selected; select the objects", filepath=str(tmp_path / "a.glb"))
    bpy.ops.mesh.primitive_cube_add()
    refused(bpy.ops.sombrero.mark, "What was exported: .*finer mesh", filepath=str(tmp_path / "a.glb"))
    bpy.ops.object.delete()
    bpy.ops.object.camera_add()
    refused(bpy.ops.sombrero.mark, "What was exported: ", filepath=str(tmp_path / "a.glb"))
    assert list(tmp_path.iterdir()) == [], "nothing is left of what failed"


def test_the_report_opens_in_the_browser(addon, scene, tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    page = tmp_path / "a report.html"
    page.write_text("<!DOCTYPE html>")
    bpy.context.scene.sombrero.report = str(page)
    assert bpy.ops.sombrero.open_report() == {"FINISHED"}
    assert opened == [page.as_uri()]


def test_the_panel_can_be_drawn(addon, scene):
    """Each line of each panel, by a layout that notes what it is asked for."""
    asked = []

    class Layout:
        enabled = True

        def prop(self, data, name, **options):
            assert name in data.bl_rna.properties, name
            asked.append(name)

        def operator(self, name, **options):
            group, one = name.split(".")
            assert getattr(getattr(bpy.ops, group), one).get_rna_type()
            asked.append(name)

        def label(self, text):
            assert len(text) < 60
            asked.append(text)

        def progress(self, factor, text):
            assert 0 <= factor <= 1
            asked.append(text)

        def row(self, **options):
            return self

        column = row

        def separator(self):
            pass

    class Panel:
        layout = Layout()

    def draw():
        asked.clear()
        for one in addon.panel.CLASSES:
            one.draw(Panel, bpy.context)
        addon.panel.in_export_menu(Panel, bpy.context)
        return list(asked)

    addon.operators.said.clear()
    at_rest = draw()
    assert "Mark a model, or check one" in at_rest and "sombrero.open_report" not in at_rest
    assert {"sombrero.mark", "sombrero.copies", "sombrero.check", "sombrero.trace", "owner", "original"} <= set(at_rest)
    going = threading.Event()
    addon.work.begin(addon.work.Work(lambda progress: progress("basis", 1, 2) or going.wait(30)))
    while not addon.work.current.progress[0]:
        pass
    assert {"Choosing where the mark goes", "sombrero.cancel"} <= set(draw())
    going.set()
    addon.work.end()
