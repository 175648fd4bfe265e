"""Renders GLB files as an artist does, with Blender's Cycles, and looks for faces that come out black:
    blender -b --factory-startup --python Tests/Acceptance/blender.py -- OUT_FOLDER FILE.glb...

Writes NAME.png, the picture in sun and sky, and NAME.facing.png: green where normals and the winding of triangles agree;
red (one-sided: wood) and blue (two-sided: leaves) where they do not. There Cycles turns the normal away from the light,
and the face comes out black.
Prints a line a file, then "N files, F failed". Exit: 0 all good, 1 a file failed, 2 no file given.
"""

import json
import math
import os
import struct
import sys

import numpy

for name, kind in (("bool", bool), ("int", int), ("float", float), ("object", object)):
    if name not in numpy.__dict__:
        setattr(numpy, name, kind)  # Blender 3.4's importer asks for names that NumPy 1.24 no longer has.

import bpy
from mathutils import Matrix, Vector

WIDTH, HEIGHT = 320, 400
SAMPLES = 32
MOST_BLACK = 0.002  # of the plant; 0.0004 at most in what we bake, in crotches of welded wood
MOST_DARK = 0.25  # of the plant's pixels; 0.42 where all faces are black
DARK = 0.1  # as the picture's file has it, of white
LEAST_SEEN = 0.02  # of the picture
FIELD_OF_VIEW = math.radians(30)  # across the picture's height
TOWARDS_CAMERA = Vector((0.75, -1, 0.3)).normalized()
TOWARDS_SUN = Vector((-0.2, -1, 1)).normalized()


def require(condition, message):
    if not condition:
        raise RuntimeError(message)


def triangles_told(path):
    """What the document says that its scene shows."""
    with open(path, "rb") as file:
        length = struct.unpack_from("<I", file.read(20), 12)[0]
        document = json.loads(file.read(length))
    found = 0
    open_nodes = list(document["scenes"][document.get("scene", 0)]["nodes"])
    while open_nodes:
        node = document["nodes"][open_nodes.pop()]
        open_nodes += node.get("children", [])
        if "mesh" in node:
            primitives = document["meshes"][node["mesh"]]["primitives"]
            found += sum(document["accessors"][primitive["indices"]]["count"] // 3 for primitive in primitives)
    return found


def corners(objects):
    """Where the vertices stand, joints and all."""
    graph = bpy.context.evaluated_depsgraph_get()
    found = []
    for shape in objects:
        evaluated = shape.evaluated_get(graph)
        mesh = evaluated.to_mesh()
        points = numpy.empty(len(mesh.vertices) * 3)
        mesh.vertices.foreach_get("co", points)
        matrix = numpy.array(evaluated.matrix_world)
        found.append(points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3])
        evaluated.to_mesh_clear()
    return numpy.concatenate(found)


def add_camera(points):
    """As near as all points allow."""
    back = TOWARDS_CAMERA
    right = Vector((0, 0, 1)).cross(back).normalized()
    up = back.cross(right)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    away = points - middle
    slope = math.tan(FIELD_OF_VIEW / 2) * 0.95
    needed = numpy.maximum(
        numpy.abs(away @ numpy.array(right)) / (slope * WIDTH / HEIGHT), numpy.abs(away @ numpy.array(up)) / slope
    )
    distance = float((needed + away @ numpy.array(back)).max())
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = FIELD_OF_VIEW
    camera.clip_end = 10 * distance
    stand = bpy.data.objects.new("camera", camera)
    turn = Matrix((right, up, back)).transposed().to_4x4()
    stand.matrix_world = Matrix.Translation(Vector(middle) + distance * back) @ turn
    bpy.context.scene.collection.objects.link(stand)
    bpy.context.scene.camera = stand


def add_light():
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = 3
    sun.angle = math.radians(1)
    stand = bpy.data.objects.new("sun", sun)
    stand.rotation_euler = TOWARDS_SUN.to_track_quat("Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(stand)
    sky = bpy.data.worlds.new("sky")
    sky.use_nodes = True
    sky.node_tree.nodes["Background"].inputs["Color"].default_value = (0.8, 0.9, 1, 1)
    bpy.context.scene.world = sky


def add_ground(points):
    size = 200 * float((points.max(axis=0) - points.min(axis=0)).max())
    bpy.ops.mesh.primitive_plane_add(size=size)
    ground = bpy.context.object
    material = bpy.data.materials.new("ground")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.25, 0.25, 0.22, 1)
    ground.data.materials.append(material)
    return ground


def show_facing(material):
    """Instead of the material: whether normals and winding agree, in the colours said above; as clear as it was."""
    tree = material.node_tree
    shader = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    output = next(node for node in tree.nodes if node.type == "OUTPUT_MATERIAL")
    geometry = tree.nodes.new("ShaderNodeNewGeometry")
    along = tree.nodes.new("ShaderNodeVectorMath")
    along.operation = "DOT_PRODUCT"
    tree.links.new(geometry.outputs["True Normal"], along.inputs[0])
    tree.links.new(geometry.outputs["Normal"], along.inputs[1])
    agree = tree.nodes.new("ShaderNodeMath")
    agree.operation = "GREATER_THAN"
    agree.inputs[1].default_value = 0
    tree.links.new(along.outputs["Value"], agree.inputs[0])
    colour = tree.nodes.new("ShaderNodeMixRGB")
    colour.inputs["Color1"].default_value = (1, 0, 0, 1) if material.use_backface_culling else (0, 0, 1, 1)
    colour.inputs["Color2"].default_value = (0, 1, 0, 1)
    tree.links.new(agree.outputs["Value"], colour.inputs["Fac"])
    glow = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(colour.outputs["Color"], glow.inputs["Color"])
    clear = tree.nodes.new("ShaderNodeBsdfTransparent")
    mix = tree.nodes.new("ShaderNodeMixShader")
    mix.inputs["Fac"].default_value = shader.inputs["Alpha"].default_value
    for link in shader.inputs["Alpha"].links:
        tree.links.new(link.from_socket, mix.inputs["Fac"])
    tree.links.new(clear.outputs["BSDF"], mix.inputs[1])
    tree.links.new(glow.outputs["Emission"], mix.inputs[2])
    tree.links.new(mix.outputs["Shader"], output.inputs["Surface"])


def render(path):
    bpy.context.scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path)
    image.alpha_mode = "CHANNEL_PACKED"
    image.colorspace_settings.name = "Non-Color"  # as the file has it
    pixels = numpy.empty(WIDTH * HEIGHT * 4, dtype=numpy.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(-1, 4)


def look_at(path, out):
    """Renders both pictures, and says what was found."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    bpy.ops.import_scene.gltf(filepath=path)
    shapes = [shape for shape in scene.objects if shape.type == "MESH"]
    triangles = sum(len(shape.data.polygons) for shape in shapes)
    told = triangles_told(path)
    require(triangles == told and triangles > 0, f"{triangles} triangles were imported of {told}")

    points = corners(shapes)
    add_camera(points)
    add_light()
    ground = add_ground(points)
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = SAMPLES
    scene.cycles.use_denoising = False
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.transparent_max_bounces = 64  # leaf behind leaf: with 8 their clear corners come out black
    scene.render.resolution_x = WIDTH
    scene.render.resolution_y = HEIGHT
    scene.view_settings.view_transform = "Standard"
    scene.render.image_settings.color_mode = "RGB"
    picture = render(out + ".png")

    for material in {slot.material for shape in shapes for slot in shape.material_slots if slot.material}:
        show_facing(material)
    ground.hide_render = True
    scene.render.film_transparent = True
    scene.view_settings.view_transform = "Raw"
    scene.render.dither_intensity = 0
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.image_settings.color_depth = "16"  # what shows through leaves is stored divided by its cover
    facing = render(out + ".facing.png")

    cover = facing[:, 3]
    seen = float(cover.mean())
    require(seen >= LEAST_SEEN, f"the plant covers only {100 * seen:.1f} % of the picture")
    dark = float((picture[cover > 0.99, :3].max(axis=1) < DARK).mean())
    wood, leaves = (float((facing[:, channel] * cover).sum() / cover.sum()) for channel in (0, 2))
    told = (
        f"{triangles} triangles, the plant covers {100 * seen:.1f} % of the picture; of that {100 * dark:.1f} % are dark, "
        f"{100 * wood:.2f} % black faces of wood, {100 * leaves:.2f} % of leaves"
    )
    require(wood + leaves <= MOST_BLACK and dark <= MOST_DARK, told)
    return told


def look_at_all(out_folder, files):
    os.makedirs(out_folder, exist_ok=True)
    failed = 0
    for path in files:
        name = os.path.splitext(os.path.basename(path))[0]
        try:
            print(f"{path}: {look_at(path, os.path.join(os.path.abspath(out_folder), name))}", flush=True)
        except Exception as error:  # whatever a file does to the importer, the next has its turn
            failed += 1
            print(f"{path}: FAILED: {error}", flush=True)
    print(f"{len(files)} files, {failed} failed", flush=True)
    return 2 if not files else 1 if failed else 0


arguments = sys.argv[sys.argv.index("--") + 1 :]
sys.exit(look_at_all(arguments[0], arguments[1:]))
