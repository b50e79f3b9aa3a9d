"""Every shader that Rooks knows, and every way in which light reaches it, against Cycles: the same small scene in both.

A ball, a tilted tile and a floor under an area lamp, a point lamp and an environment with a bright spot. Both engines
do all that they can: lamps can be met by chance, caustics stay, nothing is clamped or blurred.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from tests.addon_helpers import add, empty_scene, feed, image, lamp, material, quad, shader  # noqa: E402
from tests.cycles_helpers import assert_alike, pictures  # noqa: E402

pytestmark = pytest.mark.slow

SIZE = 48
SAMPLES, SEEDS = 128, 2
REGION = 8


@pytest.fixture(autouse=True)
def scene():
    """The scene without the material under test: the ball and the tile have none."""
    scene = empty_scene(SIZE, SIZE)
    set_up_engines(scene)
    scene.camera.location, scene.camera.rotation_euler = (0, -6, 2.5), (math.radians(72), 0, 0)
    scene.camera.data.lens = 60
    environment(scene)
    chalk, _ = shader("ShaderNodeBsdfDiffuse", "Chalk", Color=(0.6, 0.5, 0.4, 1))
    quad("Floor", 40).data.materials.append(chalk)
    ball((-0.65, 0, 0.9), 0.85)
    quad("Tile", 1.5, location=(0.85, 0.4, 0.9), rotation_euler=(math.radians(60), 0, math.radians(-25)))
    area = lamp("AREA", 120, (-2, -1, 3.5), "Area", shape="RECTANGLE", size=1.2, size_y=0.6, color=(1, 0.9, 0.8))
    area.rotation_euler = (math.radians(15), math.radians(-30), 0)
    lamp("POINT", 60, (2.2, -1.5, 2.0), "Point", shadow_soft_size=0.25, color=(0.7, 0.8, 1))
    for obj in scene.objects:
        obj.visible_camera = obj.type != "LIGHT"
    return scene


def set_up_engines(scene: bpy.types.Scene) -> None:
    """Equal limits for paths in both, and Cycles without what it does to keep noise down."""
    cycles = scene.cycles
    scene.render.image_settings.color_mode = "RGB"
    cycles.pixel_filter_type, scene.rooks.pixel_filter = "BOX", "BOX"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    scene.rooks.sampler = "MULTI_JITTERED"
    for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        limit(scene, name, 6)
    limit(scene, "transparent_bounces", 8)


def limit(scene: bpy.types.Scene, name: str, bounces: int) -> None:
    """One of the limits of `scene.rooks`, in both engines."""
    setattr(scene.rooks, name, bounces)
    setattr(scene.cycles, name if name != "transparent_bounces" else "transparent_max_bounces", bounces)


def environment(scene: bpy.types.Scene, spot: tuple[slice, slice, float] = (slice(22, 25), slice(40, 44), 20)) -> None:
    """A gradient of blue with a brighter spot (rows, columns, radiance), as an image of 64 × 32 pixels."""
    height, width = 32, 64
    y = np.mgrid[:height, :width][0]
    radiance = np.stack([0.1 + 0.2 * y / height, 0.15 + 0.2 * y / height, np.full((height, width), 0.4)], axis=-1)
    rows, columns, bright = spot
    radiance[rows, columns] += bright * np.array((1, 0.9, 0.6))
    image = bpy.data.images.new("Environment", width, height, float_buffer=True)
    image.pixels.foreach_set(np.concatenate([radiance, np.ones((height, width, 1))], 2).astype(np.float32).ravel())
    image.pack()
    world = bpy.data.worlds.new("World")
    world.use_nodes = True
    tree = world.node_tree
    texture = tree.nodes.new("ShaderNodeTexEnvironment")
    texture.image = image
    tree.links.new(texture.outputs["Color"], tree.nodes["Background"].inputs["Color"])
    # Cycles would take its time over an importance map of 1024 pixels and more.
    world.cycles.sampling_method, world.cycles.sample_map_resolution = "MANUAL", 64
    scene.world = world


def ball(location, radius: float) -> bpy.types.Object:
    """A smooth ball of 32 × 16 faces with a UV map and a colour at each vertex."""
    steps, rings = 32, 16
    polar = np.pi * np.arange(rings + 1) / rings
    around = 2 * np.pi * np.arange(steps) / steps
    points = [(0.0, 0.0, radius)]
    for angle in polar[1:-1]:
        points += [
            (radius * math.sin(angle) * math.cos(a), radius * math.sin(angle) * math.sin(a), radius * math.cos(angle))
            for a in around
        ]
    points.append((0.0, 0.0, -radius))
    last = len(points) - 1
    faces, uv = [], []

    def corner(ring: int, step: int) -> int:
        return 0 if ring == 0 else last if ring == rings else 1 + (ring - 1) * steps + step % steps

    for ring in range(rings):
        for step in range(steps):
            corners = [(ring, step), (ring + 1, step), (ring + 1, step + 1), (ring, step + 1)]
            if ring == 0:
                del corners[3]
            elif ring == rings - 1:
                del corners[2]
            faces.append([corner(*place) for place in corners])
            uv += [(s / steps, 1 - r / rings) for r, s in corners]
    mesh = bpy.data.meshes.new("Ball")
    mesh.from_pydata(points, [], faces)
    mesh.polygons.foreach_set("use_smooth", [True] * len(faces))
    mesh.uv_layers.new(name="UVMap").uv.foreach_set("vector", np.array(uv, np.float32).ravel())
    colors = np.hstack([0.5 + 0.5 * np.array(points) / radius, np.ones((len(points), 1))])
    mesh.color_attributes.new("Paint", "FLOAT_COLOR", "POINT").data.foreach_set(
        "color", colors.astype(np.float32).ravel()
    )
    return add("Ball", mesh, location=location)


def put_on(paint: bpy.types.Material) -> None:
    """Give the ball and the tile a material."""
    for name in ("Ball", "Tile"):
        bpy.data.objects[name].data.materials.append(paint)


def check(scene: bpy.types.Scene, folder, samples: int = SAMPLES, rel: float = 0.01) -> None:
    assert_alike(pictures(scene, folder, samples, SEEDS), REGION, rel=rel)


def principled(**inputs):
    return lambda: shader("ShaderNodeBsdfPrincipled", **inputs)[0]


def of_node(kind: str, settings=(), **inputs):
    """A material of one shader node, with some of the node's own settings."""

    def make():
        paint, node = shader(f"ShaderNodeBsdf{kind}", **inputs)
        for name, value in dict(settings).items():
            setattr(node, name, value)
        return paint

    return make


GOLD = (1.0, 0.7, 0.3, 1)
RED = (0.7, 0.1, 0.05, 1)
GGX, MULTI = {"distribution": "GGX"}, {"distribution": "MULTI_GGX"}

MATERIALS = {
    "principled": principled(Base_Color=RED),
    **{f"principled-roughness-{r}": principled(Base_Color=RED, Roughness=r) for r in (0.0, 0.05, 0.3, 1.0)},
    **{f"principled-metal-{r}": principled(Base_Color=GOLD, Metallic=1.0, Roughness=r) for r in (0.0, 0.05, 0.3, 1.0)},
    "principled-half-metal": principled(Base_Color=GOLD, Metallic=0.5, Roughness=0.3),
    "principled-metal-tint": principled(Base_Color=GOLD, Metallic=1.0, Roughness=0.3, Specular_Tint=(0.2, 0.5, 1, 1)),
    "principled-ggx": of_node("Principled", GGX, Base_Color=GOLD, Metallic=1.0, Roughness=0.7),
    **{
        f"principled-glass-{r}": principled(Base_Color=(0.6, 0.9, 0.7, 1), Transmission_Weight=1.0, Roughness=r)
        for r in (0.0, 0.05, 0.3, 1.0)
    },
    "principled-half-glass": principled(Base_Color=RED, Transmission_Weight=0.5, Roughness=0.2),
    "principled-ior-1": principled(Base_Color=RED, IOR=1.0),
    "principled-ior-2.4": principled(Base_Color=RED, IOR=2.4, Roughness=0.2),
    "principled-specular-0": principled(Base_Color=RED, Specular_IOR_Level=0.0),
    "principled-specular-1": principled(Base_Color=RED, Specular_IOR_Level=1.0, Specular_Tint=(0.2, 0.5, 1, 1)),
    "principled-coat": principled(Base_Color=RED, Coat_Weight=1.0, Coat_Roughness=0.05, Roughness=0.6),
    "principled-coat-tint": principled(
        Base_Color=GOLD, Coat_Weight=0.7, Coat_Roughness=0.3, Coat_Tint=(0.2, 0.6, 0.9, 1), Metallic=0.6
    ),
    "principled-alpha": principled(Base_Color=RED, Alpha=0.4),
    "principled-emission": principled(Base_Color=RED, Emission_Color=(0.3, 1, 0.5, 1), Emission_Strength=2.0),
    "principled-diffuse-roughness": principled(Base_Color=GOLD, Diffuse_Roughness=1.0),
    "diffuse": of_node("Diffuse", Color=RED),
    "oren-nayar": of_node("Diffuse", Color=GOLD, Roughness=1.0),
    **{f"glossy-ggx-{r}": of_node("Glossy", GGX, Color=GOLD, Roughness=r) for r in (0.0, 0.1, 0.7)},
    **{f"glossy-multi-{r}": of_node("Glossy", MULTI, Color=GOLD, Roughness=r) for r in (0.3, 1.0)},
    "metallic-f82": of_node("Metallic", {**MULTI, "fresnel_type": "F82"}, Base_Color=GOLD, Roughness=0.3),
    "metallic-physical": of_node("Metallic", {**MULTI, "fresnel_type": "PHYSICAL_CONDUCTOR"}, Roughness=0.3),
    "metallic-physical-ggx": of_node("Metallic", {**GGX, "fresnel_type": "PHYSICAL_CONDUCTOR"}, Roughness=0.5),
    **{f"glass-ggx-{r}": of_node("Glass", GGX, Roughness=r, IOR=1.45) for r in (0.0, 0.2, 0.6)},
    **{
        f"glass-multi-{r}": of_node("Glass", MULTI, Color=(0.6, 0.9, 0.7, 1), Roughness=r, IOR=1.5)
        for r in (0.3, 0.6, 1.0)
    },
    "glass-ior-below-1": of_node("Glass", GGX, Roughness=0.1, IOR=0.8),
    **{f"refraction-{r}": of_node("Refraction", GGX, Roughness=r, IOR=1.3) for r in (0.0, 0.3)},
    "transparent": of_node("Transparent", Color=(0.3, 0.8, 0.5, 1)),
    "translucent": of_node("Translucent", Color=GOLD),
}


#: Cycles gives rough refraction too much of the light that it samples: see docs/cycles.md.
ROUGH_GLASS = [
    *(f"principled-glass-{r}" for r in (0.3, 1.0)),
    *(f"glass-ggx-{r}" for r in (0.2, 0.6)),
    *(f"glass-multi-{r}" for r in (0.3, 0.6, 1.0)),
    "refraction-0.3",
]


@pytest.mark.parametrize("name", [name for name in MATERIALS if name not in ROUGH_GLASS])
def test_a_material_looks_as_in_cycles(name, scene, tmp_path):
    put_on(MATERIALS[name]())
    check(scene, tmp_path)


@pytest.mark.parametrize("name", ROUGH_GLASS)
def test_rough_glass_looks_as_in_cycles_where_that_samples_no_lights(name, scene, tmp_path):
    for obj in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(obj)
    environment(scene, (slice(18, 30), slice(34, 50), 4.0))
    scene.world.cycles.sampling_method = "NONE"
    put_on(MATERIALS[name]())
    check(scene, tmp_path)


# ---------------------------------------------------------------------------------------------------- mixes and graphs


def mixture(kind: str, factor, first, second):
    """Two shaders mixed or added; `factor` is a number or fills the factor's socket."""

    def make():
        paint, tree, output = material()
        node = tree.nodes.new(kind)
        tree.links.new(node.outputs[0], output.inputs["Surface"])
        shaders = [socket for socket in node.inputs if socket.type == "SHADER"]
        for socket, (shader_kind, inputs) in zip(shaders, (first, second), strict=True):
            part = feed(socket, shader_kind)
            for name, value in inputs.items():
                part.inputs[name].default_value = value
        if callable(factor):
            factor(node.inputs["Fac"])
        elif factor is not None:
            node.inputs["Fac"].default_value = factor
        return paint

    return make


def graph(build, kind: str = "Principled", **inputs):
    """A material of one shader with a graph that `build(node)` attaches to it."""

    def make():
        paint, node = shader(f"ShaderNodeBsdf{kind}", **inputs)
        build(node)
        return paint

    return make


def tiles(socket, kind: str = "ShaderNodeTexImage", scale: float = 4.0) -> None:
    """An image of 2 × 2 pixels, `scale` times over the UV map."""
    texture = feed(socket, kind, image=image())
    mapping = feed(texture.inputs["Vector"], "ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (scale, scale, scale)
    feed(mapping.inputs["Vector"], "ShaderNodeTexCoord", "UV")


def image_color(node) -> None:
    tiles(node.inputs["Base Color"])


def ramp_of_generated(node) -> None:
    """Roughness by the height: a ramp over Generated's third component."""
    ramp = feed(node.inputs["Roughness"], "ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color, ramp.color_ramp.elements[1].color = (0.1, 0.1, 0.1, 1), (0.6, 0.6, 0.6, 1)
    parts = feed(ramp.inputs["Fac"], "ShaderNodeSeparateXYZ", "Z")
    feed(parts.inputs["Vector"], "ShaderNodeTexCoord", "Generated")


def checker_metal(node) -> None:
    checker = feed(node.inputs["Metallic"], "ShaderNodeTexChecker", "Fac")
    checker.inputs["Scale"].default_value = 3.0
    feed(checker.inputs["Vector"], "ShaderNodeTexCoord", "Object")


def mixed_color(node) -> None:
    mix = feed(node.inputs["Color"], "ShaderNodeMix", "Result", data_type="RGBA", blend_type="MULTIPLY")
    sockets = {socket.identifier: socket for socket in mix.inputs}
    sockets["Factor_Float"].default_value = 0.7
    tiles(sockets["A_Color"])
    feed(sockets["B_Color"], "ShaderNodeVertexColor", "Color", layer_name="Paint")


def color_attribute(node) -> None:
    feed(node.inputs["Color"], "ShaderNodeVertexColor", "Color", layer_name="Paint")


def normal_map(node) -> None:
    mapped = feed(node.inputs["Normal"], "ShaderNodeNormalMap", "Normal", uv_map="UVMap")
    mapped.inputs["Strength"].default_value = 0.5
    blue = image("Normals")
    blue.colorspace_settings.name = "Non-Color"  # first: it makes the pixels black
    waves = np.array([(0.7, 0.5, 1), (0.3, 0.5, 1), (0.5, 0.7, 1), (0.5, 0.3, 1)], np.float32)
    blue.pixels.foreach_set(np.hstack([waves, np.ones((4, 1))]).astype(np.float32).ravel())
    feed(mapped.inputs["Color"], "ShaderNodeTexImage", image=blue)


def normal_map_of_a_lost_uv_map(node) -> None:
    feed(node.inputs["Normal"], "ShaderNodeNormalMap", uv_map="Lost").inputs["Color"].default_value = (0.7, 0.6, 0.9, 1)


def normal_as_color(node) -> None:
    feed(node.inputs["Color"], "ShaderNodeNewGeometry", "Normal")


def bump(node) -> None:
    bumped = feed(node.inputs["Normal"], "ShaderNodeBump", "Normal")
    bumped.inputs["Strength"].default_value, bumped.inputs["Distance"].default_value = 0.5, 0.05
    sine = feed(bumped.inputs["Height"], "ShaderNodeMath", operation="SINE")
    times = feed(sine.inputs[0], "ShaderNodeMath", operation="MULTIPLY")
    times.inputs[1].default_value = 12.0
    parts = feed(times.inputs[0], "ShaderNodeSeparateXYZ", "X")
    feed(parts.inputs["Vector"], "ShaderNodeTexCoord", "Object")


def fresnel(socket) -> None:
    feed(socket, "ShaderNodeFresnel").inputs["IOR"].default_value = 1.6


def layer_weight(output: str):
    return lambda socket: (
        feed(socket, "ShaderNodeLayerWeight", output).inputs["Blend"].__setattr__("default_value", 0.4)
    )


DIFFUSE, MIRROR = ("ShaderNodeBsdfDiffuse", {"Color": RED}), ("ShaderNodeBsdfGlossy", {"Roughness": 0.1})
CLEAR, GLOW = ("ShaderNodeBsdfTransparent", {}), ("ShaderNodeEmission", {"Color": RED, "Strength": 0.5})
MIX, ADD = "ShaderNodeMixShader", "ShaderNodeAddShader"

GRAPHS = {
    "mix": mixture(MIX, 0.3, DIFFUSE, MIRROR),
    "mix-transparent": mixture(MIX, 0.6, DIFFUSE, CLEAR),
    "mix-by-fresnel": mixture(MIX, fresnel, DIFFUSE, MIRROR),
    "mix-by-layer-weight-fresnel": mixture(MIX, layer_weight("Fresnel"), DIFFUSE, MIRROR),
    "mix-by-layer-weight-facing": mixture(MIX, layer_weight("Facing"), DIFFUSE, MIRROR),
    "mix-by-image": mixture(MIX, tiles, DIFFUSE, CLEAR),
    "add": mixture(ADD, None, DIFFUSE, GLOW),
    "image-color": graph(image_color, Roughness=0.4),
    "ramp-roughness": graph(ramp_of_generated, Base_Color=GOLD, Metallic=1.0),
    "checker-metal": graph(checker_metal, Base_Color=GOLD, Roughness=0.3),
    "mixed-color": graph(mixed_color, "Diffuse"),
    "color-attribute": graph(color_attribute, "Diffuse"),
    "normal-map": graph(normal_map, Base_Color=RED, Roughness=0.3),
    "normal-map-diffuse": graph(normal_map, "Diffuse", Color=RED),
    "normal-map-of-a-lost-uv-map": graph(normal_map_of_a_lost_uv_map, "Diffuse", Color=RED),
    "normal-of-the-geometry": graph(normal_as_color, "Diffuse"),
    "bump": graph(bump, Base_Color=RED, Roughness=0.3),
    "bump-diffuse": graph(bump, "Diffuse", Color=RED),
    "bump-glass": graph(bump, "Glass", Color=RED, Roughness=0.1),
}


@pytest.mark.parametrize("name", GRAPHS)
def test_a_graph_of_nodes_looks_as_in_cycles(name, scene, tmp_path):
    put_on(GRAPHS[name]())
    check(scene, tmp_path)


def test_a_normal_map_on_uvs_without_an_area_looks_as_in_cycles(scene, tmp_path):
    put_on(graph(normal_map, "Diffuse", Color=RED)())
    for name in ("Ball", "Tile"):
        mesh = bpy.data.objects[name].data
        mesh.uv_layers[0].uv.foreach_set("vector", np.full(2 * len(mesh.loops), 0.3, np.float32))
    check(scene, tmp_path)


def test_a_deformed_mesh_has_the_generated_coordinates_that_it_has_in_cycles(scene, tmp_path):
    put_on(GRAPHS["ramp-roughness"]())
    push = bpy.data.objects["Ball"].modifiers.new("Push", "SIMPLE_DEFORM")
    push.deform_method, push.deform_axis, push.angle = "BEND", "X", 1.5
    check(scene, tmp_path)


def test_a_mirrored_area_lamp_shines_as_in_cycles(scene, tmp_path):
    bpy.data.objects["Area"].scale = (-1.5, 1, 1)
    check(scene, tmp_path)


# ------------------------------------------------------------------------------------------ lamps, visibility, limits

#: kind, energy, the lamp's settings, the object's
LAMPS = {
    "rectangle": ("AREA", 120, {"shape": "RECTANGLE", "size": 1.5, "size_y": 0.8}, {}),
    "disk": ("AREA", 120, {"shape": "DISK", "size": 1.5}, {}),
    "stretched-ellipse": ("AREA", 120, {"shape": "ELLIPSE", "size": 1.5, "size_y": 0.5}, {"scale": (1, 2, 1)}),
    "point": ("POINT", 120, {"shadow_soft_size": 0.5, "use_soft_falloff": False}, {}),
    "point-soft": ("POINT", 120, {"shadow_soft_size": 0.5, "use_soft_falloff": True}, {}),
    "spot": (
        "SPOT",
        200,
        {"shadow_soft_size": 0.3, "spot_size": 1.2, "spot_blend": 0.5, "use_soft_falloff": False},
        {},
    ),
    "spot-soft": ("SPOT", 200, {"shadow_soft_size": 0.3, "spot_size": 1.2, "use_soft_falloff": True}, {}),
    "sun": ("SUN", 2, {"angle": 0.3}, {}),
}


def lamp_alone(scene: bpy.types.Scene, name: str) -> bpy.types.Object:
    """Leave one lamp, above and behind the ball, and the environment."""
    for obj in [obj for obj in scene.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(obj)
    kind, energy, settings, placed = LAMPS[name]
    only = lamp(kind, energy, (0.4, 1.5, 3.0), "Only", **settings)
    only.rotation_euler = (math.radians(-28), math.radians(5), 0)
    only.visible_camera = False
    for key, value in placed.items():
        setattr(only, key, value)
    return only


@pytest.mark.parametrize("name", LAMPS)
def test_a_mirror_sees_a_lamp_as_in_cycles(name, scene, tmp_path):
    lamp_alone(scene, name)
    put_on(of_node("Glossy", GGX, Roughness=0.0)())
    check(scene, tmp_path)


@pytest.mark.parametrize("name", LAMPS)
def test_a_lamp_lights_rough_metal_as_in_cycles(name, scene, tmp_path):
    lamp_alone(scene, name)
    put_on(of_node("Glossy", GGX, Roughness=0.3)())
    check(scene, tmp_path)


KINDS = ("diffuse", "glossy", "transmission")


def plastic_and_glass(scene: bpy.types.Scene) -> None:
    """Rays of every kind: a ball of glass, a tile of plastic."""
    bpy.data.objects["Ball"].data.materials.append(of_node("Glass", GGX, Roughness=0.0, IOR=1.4)())
    bpy.data.objects["Tile"].data.materials.append(principled(Base_Color=RED, Roughness=0.2)())


@pytest.mark.parametrize("kinds", [("diffuse",), ("glossy",), ("transmission",), ("camera",), KINDS], ids="-".join)
@pytest.mark.parametrize("name", ["Tile", "Ball"])
def test_an_object_is_hidden_from_rays_of_a_kind_as_in_cycles(kinds, name, scene, tmp_path):
    plastic_and_glass(scene)
    for kind in kinds:
        setattr(bpy.data.objects[name], f"visible_{kind}", False)
    # What blocks light samples but not the rays that scatter at the same place, or the reverse, shows how an engine
    # weights the two.
    bpy.data.objects[name].visible_shadow = not {"diffuse", "glossy"} & {*kinds}
    check(scene, tmp_path)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["Area", "Point"])
def test_a_lamp_is_hidden_from_rays_of_a_kind_as_in_cycles(kind, name, scene, tmp_path):
    # Cycles hides a lamp that is hidden from glossy rays behind glass, too: see docs/cycles.md.
    if kind == "transmission":
        plastic_and_glass(scene)
    else:
        put_on(principled(Base_Color=RED, Roughness=0.2)())
    setattr(bpy.data.objects[name], f"visible_{kind}", False)
    check(scene, tmp_path)


@pytest.mark.parametrize("bounces", [0, 1, 2])
@pytest.mark.parametrize("kind", ["max", *KINDS])
def test_bounces_of_a_kind_are_limited_as_in_cycles(kind, bounces, scene, tmp_path):
    plastic_and_glass(scene)
    limit(scene, f"{kind}_bounces", bounces)
    check(scene, tmp_path)


@pytest.mark.parametrize("bounces", [0, 2, 4])
def test_transparent_bounces_are_limited_as_in_cycles(bounces, scene, tmp_path):
    # Lamps alone, which no ray meets: in Cycles a ray may pass one surface more than a light sample.
    scene.world = None
    for light in bpy.data.lights:
        light.cycles.use_multiple_importance_sampling = False
    put_on(GRAPHS["mix-transparent"]())
    limit(scene, "transparent_bounces", bounces)
    check(scene, tmp_path)


@pytest.mark.parametrize("name", ["mix-transparent", "principled-alpha", "glass-ggx-0.0"])
def test_a_transparent_film_is_as_opaque_as_in_cycles(name, scene, tmp_path):
    scene.render.film_transparent = True
    scene.render.image_settings.color_mode = "RGBA"
    bpy.data.objects["Floor"].visible_camera = False
    # A dim, even light: the film is what is looked at here, and it shows nothing beside the ball and the tile.
    for name_of_lamp in ("Area", "Point"):
        bpy.data.objects.remove(bpy.data.objects[name_of_lamp])
    environment(scene, (slice(18, 30), slice(34, 50), 1.0))
    put_on((MATERIALS | GRAPHS)[name]())
    check(scene, tmp_path)


TERMINATORS = {
    "diffuse": (of_node("Diffuse", Color=GOLD), 0.1),
    "diffuse-0": (of_node("Diffuse", Color=GOLD), 0.0),
    "diffuse-0.6": (of_node("Diffuse", Color=GOLD), 0.6),
    "glossy": (of_node("Glossy", GGX, Color=GOLD, Roughness=0.6), 0.1),
    "translucent": (of_node("Translucent", Color=GOLD), 0.1),
}


@pytest.mark.parametrize("name", TERMINATORS)
def test_the_shadow_terminator_of_a_coarse_ball_is_that_of_cycles(name, scene, tmp_path):
    """A smooth ball of 12 × 6 faces under a sun that grazes what the camera sees of it."""
    make, offset = TERMINATORS[name]
    for obj in list(scene.objects):
        if obj.type in ("MESH", "LIGHT"):
            bpy.data.objects.remove(obj)
    scene.world = None
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=6, radius=0.9, location=(0, 0, 0.9))
    coarse = bpy.context.object
    bpy.ops.object.shade_smooth()
    coarse.data.materials.append(make())
    coarse.shadow_terminator_geometry_offset = offset
    sun = lamp("SUN", 3, (0, 0, 5), "Sun", angle=0.02)
    sun.rotation_euler = (math.radians(-15), math.radians(80), 0)
    # In the dark around the ball a small region has a single pixel of its outline, too few to know the variance by.
    assert_alike(pictures(scene, tmp_path, SAMPLES, SEEDS), 2 * REGION)
