"""What the sample scenes share: an empty scene, materials, lathes, lights, cameras, and how to save.

Lengths are metres, light powers watts, colours linear Rec. 709, as everywhere in Blender. The materials are made only
of nodes that Rooks and Cycles render alike.
"""

import sys
from pathlib import Path

import bpy
import numpy as np
from mathutils import Vector

FOLDER = Path(__file__).resolve().parent


# ---------------------------------------------------------------------------------------------------------- scene


def new_scene(name, resolution):
    """An empty file with one scene, set up so that Rooks and Cycles compute the same picture of it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.name = name
    scene.render.resolution_x, scene.render.resolution_y = resolution
    scene.render.resolution_percentage = 100
    scene.render.filepath = f"//{name}"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    scene.view_settings.view_transform = "Standard"
    set_up_cycles(scene)
    return scene


def set_up_cycles(scene, samples=64):
    """Cycles as the reference: direct light only, box filter, nothing clamped, denoised or decided on the way."""
    cycles = scene.cycles
    cycles.samples = samples
    cycles.seed = 0
    cycles.pixel_filter_type = "BOX"
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.sample_clamp_direct = 0
    cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    for kind in ("max", "diffuse", "glossy", "transmission", "volume", "transparent_max"):
        setattr(cycles, f"{kind}_bounces", 0)


def use_rooks(scene, samples, sampler="MULTI_JITTERED"):
    """Make Rooks the scene's engine. Registers the add-on of this checkout, which defines `scene.rooks`."""
    sys.path.insert(0, str(FOLDER.parent))
    import addon

    addon.register()
    scene.render.engine = "ROOKS"
    scene.rooks.sampler = sampler
    scene.rooks.samples = samples
    scene.rooks.seed = 0
    scene.rooks.max_bounces = 0


def use_bounces(scene, total, diffuse=0, glossy=0, transmission=0, transparent=0):
    """Let light go from surface to surface in both engines, each kind as often as said here. Call after `use_rooks`.

    Everything that Cycles leaves out or softens by default to keep noise down stays in: caustics are light too.
    """
    for engine in (scene.rooks, scene.cycles):
        engine.max_bounces = total
        engine.diffuse_bounces, engine.glossy_bounces, engine.transmission_bounces = diffuse, glossy, transmission
    scene.rooks.transparent_bounces = scene.cycles.transparent_max_bounces = transparent
    scene.rooks.clamp_indirect = 0
    scene.cycles.caustics_reflective = scene.cycles.caustics_refractive = True
    scene.cycles.blur_glossy = 0


def save(scene):
    """Write the scene to NAME.blend beside its script, free of the paths of the machine that made it."""
    for screen in bpy.data.screens:
        for space in (area.spaces.active for area in screen.areas):
            if space.type == "FILE_BROWSER" and space.params:
                space.params.directory = b"//"
            elif space.type == "VIEW_3D":
                space.region_3d.view_perspective = "CAMERA"
    path = FOLDER / f"{scene.name}.blend"
    bpy.context.preferences.filepaths.save_version = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(path), compress=True)
    print(f"{path.name}: {path.stat().st_size / 1024:.0f} KiB")


def world(scene, colour, strength=1.0):
    """A constant background."""
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*colour, 1)
    background.inputs["Strength"].default_value = strength


def panorama(scene, pixels, turn=0.0, strength=1.0):
    """An environment image: linear radiance (height, width, 3), as `panorama_directions` has it, turned about Z."""
    image = packed_image("Panorama", pixels, linear=True)
    scene.world = bpy.data.worlds.new("World")
    scene.world.use_nodes = True
    tree = scene.world.node_tree
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = strength
    looked_in = add_node(tree, "ShaderNodeTexCoord").outputs["Generated"]
    turned = add_node(tree, "ShaderNodeMapping", {"Vector": looked_in, "Rotation": (0, 0, turn)}).outputs["Vector"]
    texture = add_node(tree, "ShaderNodeTexEnvironment", {"Vector": turned}, image=image)
    tree.links.new(texture.outputs["Color"], background.inputs["Color"])
    arrange(tree)


def panorama_directions(width, height):
    """The world direction in which Blender's equirectangular mapping sees each pixel: (height, width, 3), bottom up."""
    azimuth = np.pi * (1 - 2 * (np.arange(width) + 0.5) / width)
    elevation = np.pi * ((np.arange(height) + 0.5) / height - 0.5)
    azimuth, elevation = np.meshgrid(azimuth, elevation)
    return np.stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], axis=-1
    )


def link(scene, name, data, location=(0, 0, 0), rotation=(0, 0, 0)):
    """A new object for `data`, in the scene's own collection."""
    object_ = bpy.data.objects.new(name, data)
    object_.location, object_.rotation_euler = location, rotation
    scene.collection.objects.link(object_)
    return object_


def aim(object_, target):
    """Turn a light or a camera, both of which look along their -Z, towards a point."""
    direction = Vector(target) - object_.location
    object_.rotation_euler = direction.to_track_quat("-Z", "Y").to_euler()


def camera(scene, location, target, lens, fstop=None, focus=None, blades=0):
    """The scene's camera: a pinhole, or with an f-stop a thin lens that is focused on an object or a point."""
    data = bpy.data.cameras.new("Camera")
    data.lens, data.clip_start, data.clip_end = lens, 0.01, 10_000
    object_ = link(scene, "Camera", data, location)
    aim(object_, target)
    if fstop:
        data.dof.use_dof = True
        data.dof.aperture_fstop, data.dof.aperture_blades = fstop, blades
        if isinstance(focus, bpy.types.Object):
            data.dof.focus_object = focus
        else:
            bpy.context.view_layer.update()
            data.dof.focus_distance = -(object_.matrix_world.inverted() @ Vector(focus)).z
    scene.camera = object_
    return object_


def light(scene, name, kind, location, target, energy, colour=(1, 1, 1), **settings):
    """A light of kind AREA, POINT, SPOT or SUN that points at `target`; `settings` are the light's own properties."""
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, colour
    for setting, value in settings.items():
        setattr(data, setting, value)
    object_ = link(scene, name, data, location)
    aim(object_, target)
    return object_


# ------------------------------------------------------------------------------------------------------ materials


def _material(name, shader):
    """A material of one shader; returns it with that shader's colour socket and its node tree."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(shader), tree.nodes.new("ShaderNodeOutputMaterial")
    node.location, output.location = (0, 0), (220, 0)
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    return material, node.inputs["Color"], tree


def _uv(tree, socket):
    """Feed a texture node's vector from the mesh's UV map."""
    uv = tree.nodes.new("ShaderNodeUVMap")
    uv.location = (-480, 0)
    tree.links.new(uv.outputs["UV"], socket)


def diffuse(name, colour):
    """A Lambertian surface of one colour."""
    material, socket, _ = _material(name, "ShaderNodeBsdfDiffuse")
    socket.default_value = material.diffuse_color = (*colour, 1)
    return material


def checker(name, colour1, colour2, scale=1.0):
    """A Lambertian chequered surface: `scale` checks per unit of the UV map. The check at its origin has `colour2`."""
    material, socket, tree = _material(name, "ShaderNodeBsdfDiffuse")
    texture = tree.nodes.new("ShaderNodeTexChecker")
    texture.location = (-240, 0)
    texture.inputs["Color1"].default_value = (*colour1, 1)
    texture.inputs["Color2"].default_value = (*colour2, 1)
    texture.inputs["Scale"].default_value = scale
    _uv(tree, texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], socket)
    return material


def packed_image(name, pixels, linear=False):
    """A packed image from (height, width, 3): 8 bits of sRGB, or linear and of half precision, which packs well."""
    if linear:
        pixels = pixels.astype(np.float16)
    height, width, _ = pixels.shape
    image = bpy.data.images.new(name, width, height, float_buffer=linear)
    opaque = np.concatenate([pixels, np.ones((height, width, 1))], axis=2)
    image.pixels.foreach_set(opaque.astype(np.float32).ravel())
    image.pack()
    return image


def textured(name, pixels):
    """A Lambertian surface with an image from the UV map: `pixels` are sRGB values in [0, 1], (height, width, 3)."""
    image = packed_image(name, pixels)
    material, socket, tree = _material(name, "ShaderNodeBsdfDiffuse")
    texture = tree.nodes.new("ShaderNodeTexImage")
    texture.location, texture.image = (-280, 0), image
    _uv(tree, texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], socket)
    return material


def emission(name, colour, strength):
    """A surface that shines, seen by the camera; `lamp_for_show` keeps it from lighting anything else."""
    material, socket, tree = _material(name, "ShaderNodeEmission")
    socket.default_value = material.diffuse_color = (*colour, 1)
    tree.nodes["Emission"].inputs["Strength"].default_value = strength
    return material


def lamp_for_show(object_):
    """Let a shining mesh be seen but light nothing: the scenes' light is to come from their lights and world only."""
    object_.visible_diffuse = False
    for material in object_.data.materials:
        material.cycles.emission_sampling = "NONE"


# ----------------------------------------------------------------------------------------------------------- nodes


def node_material(name, build):
    """A material of several nodes: `build(tree)` adds them to an empty tree and returns the shader's output."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    add_node(tree, "ShaderNodeOutputMaterial", {"Surface": build(tree)})
    arrange(tree)
    return material


def principled(name, inputs):
    """A Principled BSDF whose inputs are constants; those that are not named keep Blender's defaults."""
    material = node_material(name, lambda tree: add_node(tree, "ShaderNodeBsdfPrincipled", inputs).outputs[0])
    material.diffuse_color = (*inputs["Base Color"], 1)
    return material


def glass(name, colour=(1, 1, 1), roughness=0.0, ior=1.5):
    """A dielectric that reflects and refracts, each in the share that Fresnel gives it."""
    inputs = {"Color": colour, "Roughness": roughness, "IOR": ior}
    return node_material(name, lambda tree: add_node(tree, "ShaderNodeBsdfGlass", inputs).outputs[0])


def add_node(tree, kind, inputs=(), **settings):
    """A new node; `inputs` maps names or numbers of its sockets to values or to the outputs that feed them."""
    node = tree.nodes.new(kind)
    for setting, value in settings.items():
        setattr(node, setting, value)
    for key, value in dict(inputs).items():
        socket = node.inputs[key]
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        elif socket.type == "RGBA":
            socket.default_value = (*value, 1)
        else:
            socket.default_value = value
    return node


def math(tree, operation, *operands):
    """The output of a Math node."""
    return add_node(tree, "ShaderNodeMath", dict(enumerate(operands)), operation=operation).outputs[0]


def mix(tree, factor, a, b):
    """The output of a Mix node between two colours."""
    node = add_node(tree, "ShaderNodeMix", data_type="RGBA")
    for identifier, value in (("Factor_Float", factor), ("A_Color", a), ("B_Color", b)):
        socket = next(socket for socket in node.inputs if socket.identifier == identifier)
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = (*value, 1) if socket.type == "RGBA" else value
    return next(socket for socket in node.outputs if socket.identifier == "Result_Color")


def color_ramp(tree, factor, stops):
    """The colour output of a Color Ramp with (position, colour) stops."""
    node = add_node(tree, "ShaderNodeValToRGB", {"Fac": factor})
    elements = node.color_ramp.elements
    while len(elements) < len(stops):
        elements.new(1)
    for element, (position, colour) in zip(elements, stops, strict=True):
        element.position, element.color = position, (*colour, 1)
    return node.outputs["Color"]


def arrange(tree):
    """Lay a node tree out from right to left: each node to the left of all that it feeds."""
    columns = {}

    def place(node, column):
        columns[node] = max(column, columns.get(node, 0))
        for socket in node.inputs:
            for link_ in socket.links:
                place(link_.from_node, column + 1)

    for node in tree.nodes:
        if not any(socket.is_linked for socket in node.outputs):
            place(node, 0)
    for column in set(columns.values()):
        members = [node for node in tree.nodes if columns[node] == column]
        for row, node in enumerate(members):
            node.location = -240 * column, -340 * row


# ---------------------------------------------------------------------------------------------------------- meshes


def mesh(scene, name, vertices, faces, materials, location=(0, 0, 0), rotation=(0, 0, 0), smooth=False, edges=()):
    """A mesh object from lists of vertices, of faces and of materials (one slot each)."""
    data = bpy.data.meshes.new(name)
    data.from_pydata(vertices, edges, faces)
    for material in materials:
        data.materials.append(material)
    data.polygons.foreach_set("use_smooth", [smooth] * len(data.polygons))
    return link(scene, name, data, location, rotation)


def set_uv(object_, corner_uv):
    """Give a mesh object a UV map: one (u, v) per face corner, in the order of the faces."""
    layer = object_.data.uv_layers.new(name="UVMap")
    layer.data.foreach_set("uv", np.asarray(corner_uv, np.float32).ravel())


def rectangle(scene, name, size, material, location=(0, 0, 0), rotation=(0, 0, 0), uv=(1, 1), cells=(1, 1)):
    """A rectangle in the XY plane, of some cells; its UV map runs from (0, 0) to `uv`."""
    columns, rows = cells
    grid = [(i / columns, j / rows) for j in range(rows + 1) for i in range(columns + 1)]
    vertices = [((s - 0.5) * size[0], (t - 0.5) * size[1], 0) for s, t in grid]
    corners = [j * (columns + 1) + i for j in range(rows) for i in range(columns)]
    faces = [(k, k + 1, k + columns + 2, k + columns + 1) for k in corners]
    object_ = mesh(scene, name, vertices, faces, [material], location, rotation)
    set_uv(object_, [(grid[k][0] * uv[0], grid[k][1] * uv[1]) for face in faces for k in face])
    return object_


def box(scene, name, size, materials, location=(0, 0, 0), rotation=(0, 0, 0), top_slot=0):
    """A box standing on the XY plane of `location`. Every side has the full UV square; `top_slot` is the top's slot."""
    w, d, h = size[0] / 2, size[1] / 2, size[2]
    vertices = [(x, y, z) for z in (0, h) for x, y in ((-w, -d), (w, -d), (w, d), (-w, d))]
    faces = [(4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (0, 3, 2, 1)]
    object_ = mesh(scene, name, vertices, faces, materials, location, rotation)
    set_uv(object_, [(0, 0), (1, 0), (1, 1), (0, 1)] * 6)
    object_.data.polygons[0].material_index = top_slot
    return object_


def rounded(profile, times=3):
    """Round a polyline by cutting its corners at 1/4 and 3/4 (Chaikin, 1974). A point given twice stays a corner."""
    points = np.asarray(profile, float)
    for _ in range(times):
        start, end = points[:-1], points[1:]
        cut = np.stack([0.75 * start + 0.25 * end, 0.25 * start + 0.75 * end], axis=1).reshape(-1, 2)
        points = np.concatenate([points[:1], cut, points[-1:]])
    distinct = np.r_[True, np.any(np.abs(np.diff(points, axis=0)) > 1e-7, axis=1)]
    return points[distinct]


def lathe(scene, name, profile, material, location=(0, 0, 0), steps=96):
    """Turn a profile of (radius, height) about Z with a Screw modifier."""
    points = [(radius, 0, height) for radius, height in profile]
    edges = [(i, i + 1) for i in range(len(points) - 1)]
    object_ = mesh(scene, name, points, [], [material], location, edges=edges)
    screw = object_.modifiers.new("Lathe", "SCREW")
    screw.steps = screw.render_steps = steps
    screw.use_merge_vertices = True
    screw.merge_threshold = 1e-6
    screw.use_smooth_shade = True
    screw.use_normal_calculate = True
    return object_


def sphere(scene, name, radius, material, centre, steps=128):
    """A sphere, as a lathe of half a circle."""
    arc = np.linspace(0, np.pi, steps // 2 + 1)
    return lathe(scene, name, radius * np.stack([np.sin(arc), -np.cos(arc)], axis=1), material, centre, steps=steps)


# ------------------------------------------------------------------------------------------------------ chess pieces

PAWN = [
    (0, 0), (17, 0), (17, 0), (17.5, 2), (17.5, 4), (15, 6), (15, 6), (15, 7), (11, 9), (7.5, 14), (6, 22),
    (5.8, 26), (5.8, 26), (10, 27), (10, 29.5), (6, 30.5), (6, 30.5), (10.5, 33), (11.5, 39), (9, 45), (4, 47), (0, 47),
]  # fmt: skip
ROOK = [
    (0, 0), (18, 0), (18, 0), (18.5, 2), (18.5, 5), (16, 7), (16, 7), (16, 8.5), (12, 11), (10, 18), (9.3, 28),
    (9.8, 36), (9.8, 36), (13, 37), (13, 39.5), (11, 40.5), (11, 40.5), (14.3, 43), (14.3, 43), (14.3, 54),
    (14.3, 54), (9.8, 54), (9.8, 54), (9.8, 48), (9.8, 48), (0, 48),
]  # fmt: skip


def chess_profile(millimetres):
    """One of the profiles above, rounded, in metres."""
    return rounded(millimetres) / 1000


def rook(scene, name, material, location=(0, 0, 0)):
    """A chess rook: a lathe, six notches cut in its wall by a Boolean modifier, and hard edges where that cut."""
    cutter = notch_cutter(scene)
    object_ = lathe(scene, name, chess_profile(ROOK), material, location)
    cut = object_.modifiers.new("Notches", "BOOLEAN")
    cut.operation, cut.solver, cut.object = "DIFFERENCE", "EXACT", cutter
    cutter.parent = object_
    split = object_.modifiers.new("Hard edges", "EDGE_SPLIT")
    split.split_angle = np.radians(35)
    return object_


def notch_cutter(scene):
    """Three crossing bars at the height of the rook's wall, not rendered themselves."""
    vertices, faces = [], []
    for turn in np.radians((0, 60, 120)):
        along, across = np.array((np.cos(turn), np.sin(turn))), np.array((-np.sin(turn), np.cos(turn)))
        first = len(vertices)
        for z in (0.0495, 0.06):
            for s, t in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                vertices.append((*(0.02 * s * along + 0.0022 * t * across), z))
        quads = [(4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (0, 3, 2, 1)]
        faces += [tuple(first + k for k in quad) for quad in quads]
    cutter = mesh(scene, "Rook's notches", vertices, faces, [])
    hide(cutter)
    return cutter


def hide(object_):
    """Hide an object that others are made from, in renders and in the viewport: a cutter, a bead."""
    object_.hide_render = object_.hide_viewport = True
