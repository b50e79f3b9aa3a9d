"""glossy.blend: from mirror to chalk, in metal and in glaze, under a painted studio.

Five vases of metal and four glazed balls grow rougher from left to right: what they reflect is the same, and blurs. A
fifth ball has a clear coat over rough metal, and a sixth is rough in every other square. The light is an area light and
an environment image: dusk behind the row, two soft boxes, and a window with the sun in a pane. On a smooth surface
it is the surface that must be sampled, on a rough one the light: the scene asks for both.
"""

import common
import numpy as np

GOLD, COPPER = np.array((1.0, 0.70, 0.28)), np.array((0.90, 0.40, 0.24))
METAL_ROUGHNESS = (0.02, 0.14, 0.28, 0.45, 0.7)
GLAZE = (0.01, 0.13, 0.17)
BALL = 0.28  # radius
GLAZE_ROUGHNESS = (0.03, 0.2, 0.4, 0.75)
VASE = [
    (0, 0), (28, 0), (28, 0), (31, 3), (29, 7), (20, 11), (19, 16), (30, 28), (43, 50), (46, 68), (41, 86), (26, 104),
    (15, 116), (12.5, 128), (15, 139), (25, 148), (25, 148), (23.5, 149), (23.5, 149), (13, 139), (10, 128), (12, 116),
    (20, 100), (0, 80),
]  # fmt: skip


# ------------------------------------------------------------------------------------------------------- environment


def studio(width=512, height=256, fine=4):
    """Linear radiance from all directions. Each pixel is the mean of `fine`² points: edges stay smooth."""
    x, y, z = np.moveaxis(common.panorama_directions(width * fine, height * fine), -1, 0)
    picture = evening(y, z)
    # The camera looks along +y: one soft box is to its right, one overhead, the window behind it to its left.
    picture += soft_box(x, y, z, (0.95, -0.35, 0.35), (0.16, 0.55))[..., None] * np.array((7.5, 8.2, 9.0))
    picture += soft_box(x, y, z, (-0.35, 0.1, 1.0), (0.55, 0.3))[..., None] * np.array((4.6, 4.7, 5.0))
    picture = window(picture, x, y, z)
    return picture.reshape(height, fine, width, fine, 3).mean(axis=(1, 3))


def evening(y, z):
    """A sky that glows along the horizon in +y, over a dim warm room in -y. The ground mirrors it, darker."""
    outdoors = (0.5 + 0.5 * y[..., None]) ** 2
    low, high = np.exp(-np.abs(z[..., None]) / 0.05), np.exp(-np.abs(z[..., None]) / 0.25)
    dusk = np.array((0.022, 0.032, 0.075)) + high * np.array((0.07, 0.055, 0.12)) + low * np.array((0.55, 0.20, 0.06))
    room = np.array((0.13, 0.095, 0.065)) * (0.5 + 0.5 * z[..., None])
    sky = outdoors * dusk + (1 - outdoors) * room
    return np.where(z[..., None] > -0.02, sky, 0.3 * sky)


def on_panel(x, y, z, towards):
    """Where the direction meets a panel that faces the viewer one unit away: across, up, and whether it is before."""
    normal = np.array(towards) / np.linalg.norm(towards)
    across = np.cross((0, 0, 1), normal)
    across /= np.linalg.norm(across)
    up = np.cross(normal, across)
    depth = x * normal[0] + y * normal[1] + z * normal[2]
    safe = np.where(depth > 1e-3, depth, 1)
    u, v = ((x * axis[0] + y * axis[1] + z * axis[2]) / safe for axis in (across, up))
    return u, v, depth > 1e-3


def soft_box(x, y, z, towards, half):
    """A rectangle of light, brighter in its middle."""
    u, v, before = on_panel(x, y, z, towards)
    u, v = u / half[0], v / half[1]
    return (before & (np.abs(u) < 1) & (np.abs(v) < 1)) * (1 - 0.35 * (u**2 + v**2))


def window(picture, x, y, z):
    """The picture with a window of three by four panes in it: a pale sky, and a low sun seen through one of them."""
    u, v, before = on_panel(x, y, z, (-0.62, -1, 0.42))
    columns, rows = 3 * (u / 0.84 + 0.5), 4 * (v / 1.04 + 0.5)
    inside = before & (columns > 0) & (columns < 3) & (rows > 0) & (rows < 4)
    pane = (np.abs(columns % 1 - 0.5) < 0.44) & (np.abs(rows % 1 - 0.5) < 0.45)
    sky = np.array((2.6, 3.3, 4.4)) * (0.55 + 0.45 * np.clip(rows / 4, 0, 1))[..., None]
    sun = np.exp(-((np.hypot(u - 0.14, v - 0.13) / 0.075) ** 6))[..., None] * np.array((40, 26, 12))
    return np.where(inside[..., None], np.where(pane[..., None], sky + sun, 0.02), picture)


# ---------------------------------------------------------------------------------------------------------- materials


def floor(tree):
    """Polished slabs, two metres long and one wide, each of another tone, with dark joints: nodes alone, no image."""
    place = common.add_node(tree, "ShaderNodeTexCoord").outputs["Object"]
    x, y, _ = common.add_node(tree, "ShaderNodeSeparateXYZ", {0: place}).outputs
    row = common.math(tree, "FLOOR", y)
    along = common.math(tree, "MULTIPLY_ADD", row, 0.5, common.math(tree, "MULTIPLY", x, 0.5))
    # A number for each slab that looks random: the fraction of a large sine.
    slab = common.math(tree, "MULTIPLY_ADD", row, 37.7, common.math(tree, "FLOOR", along))
    random = common.math(tree, "FRACT", common.math(tree, "MULTIPLY", common.math(tree, "SINE", slab), 43.7))
    tone = common.color_ramp(
        tree, random, [(0, (0.018, 0.019, 0.022)), (0.6, (0.032, 0.031, 0.032)), (1, (0.060, 0.052, 0.046))]
    )
    # Distances to the nearest joints, in metres.
    across = common.math(tree, "PINGPONG", y, 0.5)
    beside = common.math(tree, "MULTIPLY", common.math(tree, "PINGPONG", along, 0.5), 2)
    joint = common.math(tree, "LESS_THAN", common.math(tree, "MINIMUM", across, beside), 0.012)
    colour = common.mix(tree, joint, tone, (0.012, 0.011, 0.011))
    roughness = common.math(tree, "MULTIPLY_ADD", random, 0.12, 0.22)
    return common.add_node(tree, "ShaderNodeBsdfPrincipled", {"Base Color": colour, "Roughness": roughness}).outputs[0]


def chequered(tree):
    """Glaze that is polished and blasted in turn: a Checker Texture over longitude and latitude, as roughness."""
    place = common.add_node(tree, "ShaderNodeTexCoord").outputs["Object"]
    x, y, z = common.add_node(tree, "ShaderNodeSeparateXYZ", {0: place}).outputs
    longitude = common.math(tree, "ARCTAN2", y, x)
    latitude = common.math(tree, "ARCSINE", common.math(tree, "DIVIDE", z, BALL))
    globe = common.add_node(tree, "ShaderNodeCombineXYZ", {0: longitude, 1: latitude, 2: 0.1})
    checks = common.add_node(
        tree, "ShaderNodeTexChecker",
        {"Vector": globe.outputs[0], "Color1": (0.03, 0.03, 0.03), "Color2": (0.5, 0.5, 0.5), "Scale": 8 / np.pi},
    )  # fmt: skip
    inputs = {"Base Color": (0.16, 0.015, 0.012), "Roughness": checks.outputs["Color"]}
    return common.add_node(tree, "ShaderNodeBsdfPrincipled", inputs).outputs[0]


def main():
    scene = common.new_scene("glossy", (960, 400))
    common.panorama(scene, studio())

    common.rectangle(scene, "Floor", (400, 400), common.node_material("Slabs", floor))
    for i, roughness in enumerate(METAL_ROUGHNESS):
        colour = GOLD + (COPPER - GOLD) * i / 4
        metal = common.principled(f"Metal {roughness}", {"Base Color": colour, "Metallic": 1, "Roughness": roughness})
        common.lathe(scene, f"Vase {i + 1}", common.rounded(VASE) / 100, metal, ((i - 2) * 1.12, 0, 0), steps=128)

    glazes = [
        common.principled(f"Glaze {roughness}", {"Base Color": GLAZE, "Roughness": roughness})
        for roughness in GLAZE_ROUGHNESS
    ]
    glazes.append(
        common.principled(
            "Coat",
            {
                "Base Color": (0.35, 0.02, 0.03),
                "Metallic": 0.8,
                "Roughness": 0.5,
                "Coat Weight": 1,
                "Coat Roughness": 0.02,
            },
        )
    )
    glazes.append(common.node_material("Chequered glaze", chequered))
    for i, glaze in enumerate(glazes):
        common.sphere(scene, f"Ball {i + 1}", BALL, glaze, ((i - 2.5) * 0.985, -1.25, BALL))

    common.light(
        scene,
        "Key",
        "AREA",
        (-3.2, -2.2, 4.2),
        (0, 0, 0.5),
        120,
        (1, 0.93, 0.84),
        shape="RECTANGLE",
        size=1.6,
        size_y=0.9,
    )
    common.camera(scene, (0, -10.4, 1.25), (0, 0, 0.74), lens=57.5)
    common.use_rooks(scene, samples=64)
    common.use_bounces(scene, 8, diffuse=3, glossy=4, transparent=8)
    common.save(scene)


if __name__ == "__main__":
    main()
