"""depth_of_field.blend: chess pieces in a row through the plane of focus, before lamps that show the shape of the lens.

A 50 mm lens at f/1.8 is focused on the second rook. Nearer and farther edges blur, and each lamp, a dot in truth,
becomes a hexagon: the picture of the aperture's six blades, and, at few samples, of the points chosen on the lens.
"""

import common
import numpy as np

SQUARE = 0.05  # metres
PIECES = 7
IN_FOCUS = 2
LAMPS = 12, 3  # columns, rows
COLOURS = {"Amber": (1, 0.42, 0.1), "Rose": (1, 0.16, 0.22), "Ice": (0.25, 0.6, 1), "Cream": (1, 0.75, 0.45)}


def lamps(scene):
    """Discs that face the camera, one in each cell of a grid, jittered, far behind the board."""
    rng = np.random.default_rng(7)
    materials = [common.emission(f"Lamp {name}", colour, 14) for name, colour in COLOURS.items()]
    turns = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    vertices, faces, slots = [], [], []
    for row in range(LAMPS[1]):
        for column in range(LAMPS[0]):
            s, t = (np.array((column, row)) + rng.uniform(0.1, 0.9, 2)) / LAMPS
            centre = np.array((-1.3 + 2.8 * s, 2.6 + 0.5 * rng.random(), 0.02 + 0.46 * t))
            radius = rng.uniform(0.013, 0.018)
            faces.append(range(len(vertices), len(vertices) + len(turns)))
            vertices += [centre + radius * np.array((np.cos(a), 0, np.sin(a))) for a in turns]
            slots.append(rng.integers(len(materials)))
    object_ = common.mesh(scene, "Lamps", vertices, faces, materials)
    object_.data.polygons.foreach_set("material_index", slots)
    common.lamp_for_show(object_)


def main():
    scene = common.new_scene("depth_of_field", (640, 400))
    common.world(scene, (0.02, 0.024, 0.042))

    squares = common.checker("Squares", colour1=(0.08, 0.05, 0.045), colour2=(0.72, 0.6, 0.44), scale=1)
    columns, rows = 16, 32
    common.rectangle(
        scene, "Board", (columns * SQUARE, rows * SQUARE), squares, (0, 0.3, 0), uv=(columns, rows), cells=(4, 8)
    )

    paints = [common.diffuse("Ivory", (0.85, 0.78, 0.62)), common.diffuse("Crimson", (0.62, 0.06, 0.05))]
    for i in range(PIECES):
        place = ((-1.5 + i) * SQUARE, (-1.5 + 2 * i) * SQUARE, 0)
        if i % 2:
            common.lathe(scene, f"Pawn {i + 1}", common.chess_profile(common.PAWN), paints[1], place)
        else:
            common.rook(scene, f"Rook {i + 1}", paints[0], place)

    lamps(scene)
    common.light(
        scene, "Key", "AREA", (-0.65, -0.4, 0.75), (0.05, 0.1, 0), 11, (1, 0.86, 0.68), shape="DISK", size=0.25
    )
    common.light(scene, "Rim", "AREA", (0.9, 0.9, 0.6), (0, 0.2, 0), 7, (0.5, 0.68, 1), shape="SQUARE", size=0.3)
    focus = scene.objects[f"Rook {IN_FOCUS + 1}"]
    common.camera(scene, (-0.045, -0.37, 0.115), (0.005, 0.1, 0.055), 50, fstop=1.8, focus=focus, blades=6)
    common.use_rooks(scene, samples=64)
    common.save(scene)


if __name__ == "__main__":
    main()
