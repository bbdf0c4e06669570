"""Deforms the selected object by Flexel: an add-on for Blender 3.4 or later.

Install it by Edit > Preferences > Add-ons > Install, with the program flexel on the PATH. The panel is in the sidebar of the 3D
view (N), tab "Flexel". Put what is held and what is pushed into a vertex group each, name both there, and press Deform. The
result is the shape key "Flexel" of the object, whose value goes from 0, at rest, to 1, bent; the mesh itself stays.

Lengths are those of the scene (its unit scale), forces are in newtons along the world's axes. Modifiers are not taken along.
"""

import os
import subprocess
import tempfile
from typing import NamedTuple

import bpy
from mathutils import Matrix, Vector

bl_info = {"name": "Flexel", "author": "The developers of Flexel", "version": (1, 0, 0), "blender": (3, 4, 0),
           "location": "View3D > Sidebar > Flexel", "description": "Deforms the selected object as its material would be",
           "category": "Object"}
KEY = "Flexel"


class FlexelError(Exception):
    """What is wrong, in a line for the user."""


class FlexelSettings(bpy.types.PropertyGroup):
    held: bpy.props.StringProperty(name="Held", description="Vertex group of the faces that are held")
    pushed: bpy.props.StringProperty(name="Pushed", description="Vertex group of the faces that are pushed")
    force: bpy.props.FloatVectorProperty(name="Force [N]", default=(0, 0, -10), subtype="XYZ")
    material: bpy.props.StringProperty(name="Material", default="PLA", description="As `flexel materials` lists them")
    size: bpy.props.StringProperty(name="Cells", description='Their size ("2 mm"); empty: Flexel chooses')


def metres(scene):
    """Of a unit of length."""
    return scene.unit_settings.scale_length


def polygons_of(mesh, group):
    """Numbers of the polygons whose vertices are all in the vertex group."""
    inside = {v.index for v in mesh.vertices if any(each.group == group.index and each.weight > 0.5 for each in v.groups)}
    return {p.index for p in mesh.polygons if inside.issuperset(p.vertices)}


def group_of(thing, name, what):
    group = thing.vertex_groups.get(name)
    if group is None:
        raise FlexelError(f"{what}: the object has no vertex group \"{name}\"")
    found = polygons_of(thing.data, group)
    if not found:
        raise FlexelError(f"{what}: vertex group \"{name}\" holds no whole face")
    return found


def at_rest(mesh):
    """Positions of the basis, whatever shape keys show."""
    keys = mesh.shape_keys
    return [point.co.copy() for point in (keys.reference_key.data if keys else mesh.vertices)]


class Begun(NamedTuple):
    """The object as its part is written: it may be moved, and edited, while Flexel runs."""

    world: Matrix
    unit: float  # m
    points: list  # at_rest()


def begun_of(thing, scene):
    return Begun(thing.matrix_world.copy(), metres(scene), at_rest(thing.data))


def write_part(mesh, begun, held, pushed, path):
    """The mesh in world axes and metres as OBJ, its polygons grouped as held, pushed and free."""
    mirrored = begun.world.determinant() < 0
    with open(path, "w", encoding="ascii") as file:
        for point in begun.points:
            file.write("v " + " ".join(repr(begun.unit * each) for each in begun.world @ point) + "\n")
        for name, chosen in (("held", held), ("pushed", pushed - held), ("free", None)):
            file.write(f"g {name}\n")
            for polygon in mesh.polygons:
                if polygon.index in chosen if chosen is not None else polygon.index not in held | pushed:
                    corners = reversed(polygon.vertices) if mirrored else polygon.vertices
                    file.write("f " + " ".join(str(each + 1) for each in corners) + "\n")


def command_of(thing, scene, begun, folder):
    """Writes the part, and gives the command that bends it."""
    settings = scene.flexel
    held = group_of(thing, settings.held, "Held")
    pushed = group_of(thing, settings.pushed, "Pushed")
    if not pushed - held:
        raise FlexelError("Pushed: all of its faces are held")
    write_part(thing.data, begun, held, pushed, os.path.join(folder, "part.obj"))
    command = ["flexel", "deform", "part.obj", "--unit", "m", "--fix", "held", "--push",
               "pushed: {:.9g} {:.9g} {:.9g} N".format(*settings.force), "--material", settings.material, "--keep-vertices",
               "-o", "bent.obj"]
    return command + (["--size", settings.size] if settings.size else [])


def start(command, folder):
    with open(os.path.join(folder, "said"), "wb") as said:
        try:
            return subprocess.Popen(command, cwd=folder, stdin=subprocess.DEVNULL, stdout=said, stderr=said)
        except FileNotFoundError:
            raise FlexelError("the program flexel is not on the PATH") from None


def take_result(thing, begun, folder, code):
    """Adds the shape key; returns what the program said of the result."""
    with open(os.path.join(folder, "said"), encoding="utf-8", errors="replace") as file:
        said = file.read().strip().splitlines()
    if code != 0:
        raise FlexelError(said[-1] if said else f"flexel ended with exit code {code}")
    with open(os.path.join(folder, "bent.obj"), encoding="ascii") as file:
        bent = [Vector(map(float, line.split()[1:4])) for line in file if line.startswith("v ")]
    if at_rest(thing.data) != begun.points or len(bent) != len(begun.points):
        raise FlexelError("the mesh has changed meanwhile: press Deform again")
    if not thing.data.shape_keys:
        thing.shape_key_add(name="Basis", from_mix=False)
    old = thing.data.shape_keys.key_blocks.get(KEY)
    if old is not None:
        thing.shape_key_remove(old)
    key = thing.shape_key_add(name=KEY, from_mix=False)
    back = begun.world.inverted()
    for point, place in zip(key.data, bent):
        point.co = back @ (place / begun.unit)
    key.value = 1
    return [line.removeprefix("flexel: ") for line in said]


class OBJECT_OT_flexel_deform(bpy.types.Operator):
    """Bends the active mesh; Esc stops the run"""

    bl_idname = "object.flexel_deform"
    bl_label = "Deform by Flexel"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        return context.object is not None and context.object.type == "MESH"

    def begin(self, context):
        self.thing, self.folder = context.object, tempfile.TemporaryDirectory(prefix="flexel-")
        self.take_edits()
        self.begun = begun_of(self.thing, context.scene)
        self.run = start(command_of(self.thing, context.scene, self.begun, self.folder.name), self.folder.name)

    def take_edits(self):
        if self.thing.mode == "EDIT":
            self.thing.update_from_editmode()

    def end(self, context):
        self.take_edits()
        for line in take_result(self.thing, self.begun, self.folder.name, self.run.wait()):
            self.report({"INFO"}, line)

    def guarded(self, step, context):
        """Whether it worked; what is wrong is reported."""
        try:
            step(context)
            return True
        except FlexelError as error:
            self.report({"ERROR"}, str(error))
            return False

    def execute(self, context):
        done = self.guarded(self.begin, context) and self.guarded(self.end, context)
        return {"FINISHED"} if done else {"CANCELLED"}

    def invoke(self, context, event):
        if not self.guarded(self.begin, context):
            return {"CANCELLED"}
        self.timer = context.window_manager.event_timer_add(0.1, window=context.window)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Flexel runs; Esc stops it")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type == "ESC":
            self.run.terminate()
            self.run.wait()
        elif self.run.poll() is None:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        context.workspace.status_text_set(None)
        done = event.type != "ESC" and self.guarded(self.end, context)
        return {"FINISHED"} if done else {"CANCELLED"}


class VIEW3D_PT_flexel(bpy.types.Panel):
    bl_label = bl_category = "Flexel"
    bl_space_type, bl_region_type = "VIEW_3D", "UI"

    def draw(self, context):
        settings, thing = context.scene.flexel, context.object
        if thing is not None and thing.type == "MESH":
            self.layout.prop_search(settings, "held", thing, "vertex_groups")
            self.layout.prop_search(settings, "pushed", thing, "vertex_groups")
        for name in ("force", "material", "size"):
            self.layout.prop(settings, name)
        self.layout.operator(OBJECT_OT_flexel_deform.bl_idname)


CLASSES = (FlexelSettings, OBJECT_OT_flexel_deform, VIEW3D_PT_flexel)


def register():
    for each in CLASSES:
        bpy.utils.register_class(each)
    bpy.types.Scene.flexel = bpy.props.PointerProperty(type=FlexelSettings)


def unregister():
    del bpy.types.Scene.flexel
    for each in reversed(CLASSES):
        bpy.utils.unregister_class(each)


if __name__ == "__main__":
    register()
