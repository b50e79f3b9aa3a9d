"""glass.blend: what glass does with the light of a window, clear and frosted, thick and thin.

Four balls of growing roughness gather the light less and less sharply; a lens throws an upside-down image of the window
on the table; a rook, a prism and a vase bend it as they please; stained glass merely tints it on its way. Behind the
solid pieces the table is lit by caustics: by paths that leave the table by chance towards the window, through glass.
The window is large enough to be found so, which makes them converge.
"""

import bpy
import common
import numpy as np

WINDOW = np.array((-0.52, 0.62, 0.76))  # its middle, metres
AIM = np.array((0.02, -0.02, 0))
DOWN_THE_LIGHT = (AIM - WINDOW) / np.linalg.norm(AIM - WINDOW)
PANE = 0.17  # side of one of its four panes
BAR = 0.03
LENS_RADIUS, LENS_HEIGHT = 0.043, 0.082
BALL = 0.038  # radius
GAP = 0.0003  # of air between the table and what stands on it

SHADES = {
    "lead": (0, 0, 0), "amber": (250, 160, 20), "ruby": (200, 14, 24), "cobalt": (18, 40, 190), "azure": (40, 120, 215),
    "sea": (10, 140, 130), "violet": (105, 40, 165), "straw": (250, 215, 110),
}  # fmt: skip


# --------------------------------------------------------------------------------------------------------------- light


def window(scene):
    """Four panes that shine, with a cross of darkness between them, square to the light's direction."""
    panes = []
    for s in (-1, 1):
        for t in (-1, 1):
            x, y = s * (PANE + BAR) / 2, t * (PANE + BAR) / 2
            panes.append([(x + a * PANE / 2, y + b * PANE / 2, 0) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    vertices = [corner for pane in panes for corner in pane]
    faces = [range(4 * i, 4 * i + 4) for i in range(4)]
    object_ = common.mesh(scene, "Window", vertices, faces, [common.emission("Daylight", (1, 0.9, 0.76), 33)], WINDOW)
    common.aim(object_, AIM)


# -------------------------------------------------------------------------------------------------------------- pieces


def lens(scene, location):
    """A lens of equal radii on both sides, in a brass ring on a stand, square to the light.

    Its distance from the table, along the light, and its distance from the window give its focal length by the thin
    lens equation, and that the radii by the lensmaker's, for an index of 1.5.
    """
    location = np.array((*location, LENS_HEIGHT))
    image_distance = LENS_HEIGHT / -DOWN_THE_LIGHT[2]
    focal_length = 1 / (1 / image_distance + 1 / np.linalg.norm(location - WINDOW))
    radius = 2 * (1.5 - 1) * focal_length
    half_angle = np.arcsin(LENS_RADIUS / radius)
    arc = np.linspace(0, half_angle, 33)
    face = np.stack([radius * np.sin(arc), radius * (np.cos(half_angle) - np.cos(arc)) - 0.001], axis=1)
    profile = np.concatenate([face, face[::-1] * (1, -1)])

    brass = common.principled("Brass", {"Base Color": (0.85, 0.55, 0.20), "Metallic": 1, "Roughness": 0.25})
    middle, thick, turns = LENS_RADIUS + 0.002, 0.0028, np.linspace(0, 2 * np.pi, 33)
    ring = np.stack([middle + thick * np.cos(turns), thick * np.sin(turns)], axis=1)
    for name, outline, material in (("Lens", profile, common.glass("Lens")), ("Ring", ring, brass)):
        object_ = common.lathe(scene, name, outline, material, location, steps=128)
        object_.rotation_euler = bpy.data.objects["Window"].rotation_euler
    stand = [(0, 0), (0.022, 0), (0.022, 0), (0.022, 0.003), (0.006, 0.006), (0.003, 0.012), (0.003, 0.012)]
    steepest = np.array((0, 0, -1)) + DOWN_THE_LIGHT[2] * DOWN_THE_LIGHT
    x, y, stem = location + middle * steepest / np.linalg.norm(steepest)
    common.lathe(scene, "Stand", [*common.rounded(stand), (0.003, stem), (0, stem)], brass, (x, y, 0))


def prism(scene, location, turn):
    """A column with an equilateral cross-section."""
    height, side = 0.10, 0.052
    section = [(-side / 2, -side / np.sqrt(12)), (side / 2, -side / np.sqrt(12)), (0, side / np.sqrt(3))]
    vertices = [(x, y, z) for z in (0, height) for x, y in section]
    faces = [(2, 1, 0), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)]
    object_ = common.mesh(scene, "Prism", vertices, faces, [common.glass("Prism")], (*location, GAP), (0, 0, turn))
    bevel = object_.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.001, 2


def stained_glass(width=256, height=352, fine=3):
    """A rook in amber before panes of blue, sRGB: panes with leads between them, in a border of squares."""
    y, x = np.mgrid[0 : height * fine, 0 : width * fine] / fine
    border = 22
    inside = (np.minimum(x, width - x) > border) & (np.minimum(y, height - y) > border)

    profile = common.rounded(common.ROOK[:21])  # without the hollow of its top
    scale = (height - 2 * border - 50) / 54
    rook_height = (y - border - 22) / scale
    half = np.interp(rook_height, profile[:, 1], profile[:, 0], left=0, right=0)
    across = np.abs(x - width / 2) / scale
    notch = (rook_height > 48.5) & (np.abs(across - 5.5) < 2)
    rook = (across < half) & (rook_height < 54) & ~notch
    storey = np.digitize(rook_height, (7, 22, 37, 41))

    diamond = np.floor((x + y) / 46) * 7 + np.floor((x - y) / 46)
    square = np.floor(np.where(np.minimum(x, width - x) <= border, y, x) / 44) + 100
    label = np.where(inside, np.where(rook, 200 + storey, diamond), square)

    names = list(SHADES)
    blues = [names.index(name) for name in ("cobalt", "azure", "sea", "cobalt", "violet", "azure")]
    shade = np.take(blues, diamond.astype(int) % len(blues))
    shade = np.where(rook, np.where(storey % 2 == 0, names.index("amber"), names.index("straw")), shade)
    shade = np.where(inside, shade, np.where(square % 2 == 0, names.index("ruby"), names.index("amber")))

    # Lead runs along every edge between two panes, and around all.
    lead = np.minimum.reduce([x, width - x, y, height - y]) < 4
    for reach in range(1, int(1.7 * fine)):
        for axis in (0, 1):
            for shift in (-reach, reach):
                lead |= np.roll(label, shift, axis) != label
    picture = np.array(list(SHADES.values()))[np.where(lead, 0, shade)] / 255
    return picture.reshape(height, fine, width, fine, 3).mean(axis=(1, 3))


def stained(tree):
    """Glass that tints what goes through it straight on and reflects a little; black lead where the image is dark."""
    place = common.add_node(tree, "ShaderNodeUVMap").outputs["UV"]
    image = common.packed_image("Stained glass", stained_glass())
    colour = common.add_node(tree, "ShaderNodeTexImage", {"Vector": place}, image=image).outputs["Color"]
    through = common.add_node(tree, "ShaderNodeBsdfTransparent", {"Color": colour}).outputs[0]
    shine = common.add_node(tree, "ShaderNodeBsdfGlossy", {"Color": (1, 1, 1), "Roughness": 0.12}).outputs[0]
    facing = common.add_node(tree, "ShaderNodeFresnel", {"IOR": 1.5}).outputs[0]
    pane = common.add_node(tree, "ShaderNodeMixShader", {0: facing, 1: through, 2: shine}).outputs[0]
    came = common.add_node(tree, "ShaderNodeBsdfDiffuse", {"Color": (0.04, 0.04, 0.045)}).outputs[0]
    brightest = common.add_node(tree, "ShaderNodeSeparateColor", {0: colour}, mode="HSV").outputs[2]
    is_lead = common.math(tree, "LESS_THAN", brightest, 0.12)
    return common.add_node(tree, "ShaderNodeMixShader", {0: is_lead, 1: pane, 2: came}).outputs[0]


def vase(scene, location):
    """A heavy vase of blue glass: Principled, wholly transmissive."""
    outline = [
        (0, 0), (24, 0), (24, 0), (27, 4), (34, 22), (35, 40), (26, 62), (12, 80), (11, 90), (19, 103), (19, 103),
        (17.5, 104), (17.5, 104), (8, 91), (8.5, 79), (21, 62), (28, 40), (24, 24), (0, 17),
    ]  # fmt: skip
    inputs = {"Base Color": (0.30, 0.52, 0.95), "Roughness": 0, "IOR": 1.5, "Transmission Weight": 1}
    material = common.principled("Blue glass", inputs)
    common.lathe(scene, "Vase", common.rounded(outline) * 1.25 / 1000, material, (*location, GAP), steps=128)


def main():
    scene = common.new_scene("glass", (800, 500))
    common.world(scene, (0.05, 0.065, 0.10))
    window(scene)
    cloth = common.checker("Table", colour1=(0.65, 0.59, 0.53), colour2=(0.78, 0.74, 0.68), scale=1)
    common.rectangle(scene, "Table", (6, 6), cloth, uv=(150, 150))

    for i, roughness in enumerate((0, 0.15, 0.3, 0.5)):
        frosted = common.glass(f"Glass {roughness}", roughness=roughness)
        centre = (-0.30 + 0.104 * i, -0.085 - 0.037 * i, BALL + GAP)
        common.sphere(scene, f"Ball {roughness}", BALL, frosted, centre)

    rook = common.rook(scene, "Rook", common.glass("Crown glass", (0.93, 1.0, 0.96)), (-0.12, 0.09, GAP))
    rook.scale = (2.3, 2.3, 2.3)
    vase(scene, (-0.27, 0.13))
    lens(scene, (0.105, -0.06))
    prism(scene, (0.285, -0.06), np.radians(40))

    turn = np.arctan2(DOWN_THE_LIGHT[1], DOWN_THE_LIGHT[0]) + np.pi / 2
    material = common.node_material("Stained glass", stained)
    common.rectangle(scene, "Stained glass", (0.16, 0.22), material, (0.07, 0.225, 0.111), (np.pi / 2, 0, turn))

    common.camera(scene, (0.02, -0.98, 0.50), (0.02, 0.0, 0.045), lens=49)
    common.use_rooks(scene, samples=64)
    common.use_bounces(scene, 12, diffuse=4, glossy=8, transmission=12, transparent=8)
    common.save(scene)


if __name__ == "__main__":
    main()
