"""still_life.blend: a chess board with eight rooks, one in each row and each column, and what else Blender can make.

n-rooks sampling (Shirley, 1991) as a table-top: no rook threatens another, so the eight project evenly onto both sides
of the board. Beside them 64 beads lie in a tray at the points of Hammersley (1960), and on the wall hangs a zone plate,
the classical test of aliasing. The scene holds a bit of everything that a renderer must take from Blender: lathes,
Boolean, Bevel, Array, Subdivision Surface and Solidify modifiers, text, a bevelled curve, metaballs, instances of a
collection and of geometry nodes, images, UV maps, several materials on one mesh, and every kind of light.
"""

import bpy
import common
import numpy as np

SQUARE = 0.05  # metres
ROOKS_COLUMN = (3, 6, 2, 7, 1, 4, 0, 5)  # of the rook in each row: a solution of the eight queens, fair in 2D as well
BOARD_TOP = 0.022


# ---------------------------------------------------------------------------------------------------------- images


def wood(size=512, seed=3):
    """Boards of wood, sRGB: growth rings along x, bent by a few slow waves, each board cut from another log."""
    rng = np.random.default_rng(seed)
    v, u = np.meshgrid(np.linspace(0, 1, size, endpoint=False), np.linspace(0, 1, size, endpoint=False), indexing="ij")
    board = np.floor(v * 4)
    bend = np.zeros((size, size))
    for frequency in (1, 2, 3):
        wave = 2 * np.pi * (frequency * u + rng.random()) + board * rng.uniform(1, 9)
        bend += rng.uniform(0.2, 0.5) * np.sin(wave)
    rings = v * 26 + board * 7.3 + bend
    tone = 0.5 + 0.5 * np.sin(2 * np.pi * rings) * (0.6 + 0.4 * np.sin(rings))
    gap = np.abs(v * 4 - np.round(v * 4)) < 0.012
    shade = np.array((0.92, 1.05, 0.98, 1.1))[board.astype(int)]
    dark, light = np.array((0.40, 0.255, 0.155)), np.array((0.56, 0.385, 0.245))
    colour = (dark + (light - dark) * tone[..., None]) * shade[..., None]
    return np.where(gap[..., None], 0.5 * colour, colour)


def zone_plate(size=256):
    """Rings whose frequency grows with their radius, to a period of six of the image's pixels at its sides."""
    x = np.linspace(-1, 1, size)
    rings = 0.5 + 0.42 * np.cos(np.pi * size / 12 * (x[None, :] ** 2 + x[:, None] ** 2))
    ink, paper = np.array((0.16, 0.22, 0.38)), np.array((0.95, 0.93, 0.87))
    return ink + (paper - ink) * rings[..., None]


# ---------------------------------------------------------------------------------------------------------- objects


def framed(scene, name, panel, rim, height, depth, materials, location=(0, 0, 0), rotation=(0, 0, 0)):
    """A bevelled square slab: material slot 1 is a panel of its top, sunk by `depth`, slot 0 all the rest."""
    corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)]) / 2
    outer, inner = corners * (panel + 2 * rim), corners * panel
    vertices = [(*p, 0) for p in outer] + [(*p, height) for p in outer] + [(*p, height - depth) for p in inner]
    sides = [(i, (i + 1) % 4) for i in range(4)]
    faces = [(8, 9, 10, 11), (3, 2, 1, 0)]
    faces += [(i, j, 4 + j, 4 + i) for i, j in sides] + [(4 + i, 4 + j, 8 + j, 8 + i) for i, j in sides]
    object_ = common.mesh(scene, name, vertices, faces, materials, location, rotation)
    common.set_uv(object_, [(0, 0), (1, 0), (1, 1), (0, 1)] * len(faces))
    object_.data.polygons[0].material_index = 1
    bevel = object_.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments, bevel.limit_method = 0.003, 3, "ANGLE"
    return object_


def board(scene, parent):
    """The chess board."""
    walnut = common.diffuse("Walnut", (0.24, 0.085, 0.04))
    squares = common.checker("Squares", colour1=(0.80, 0.68, 0.48), colour2=(0.10, 0.055, 0.05), scale=8)
    framed(scene, "Board", 8 * SQUARE, 0.022, BOARD_TOP, 0, [walnut, squares]).parent = parent


def rooks(scene, parent):
    """Eight instances of a collection that holds one rook: one in each row and in each column."""
    ivory = common.diffuse("Ivory", (0.86, 0.79, 0.63))
    piece = bpy.data.collections.new("Rook")
    one = common.rook(scene, "Rook", ivory)
    for object_ in (one, *one.children):
        scene.collection.objects.unlink(object_)
        piece.objects.link(object_)
    for row, column in enumerate(ROOKS_COLUMN):
        place = ((column - 3.5) * SQUARE, (row - 3.5) * SQUARE, BOARD_TOP)
        instance = common.link(scene, f"Rook {'abcdefgh'[column]}{row + 1}", None, place, (0, 0, row))
        instance.instance_type, instance.instance_collection = "COLLECTION", piece
        instance.scale, instance.empty_display_size = (1.2, 1.2, 1.2), 0.02
        instance.parent = parent


def pawns(scene, location, rotation):
    """Taken pawns in a line: one lathe, repeated by an Array modifier."""
    crimson = common.diffuse("Crimson", (0.58, 0.05, 0.045))
    pawn = common.lathe(scene, "Pawns", common.chess_profile(common.PAWN), crimson, location, steps=64)
    pawn.rotation_euler = rotation
    array = pawn.modifiers.new("Line", "ARRAY")
    array.count, array.use_relative_offset, array.use_constant_offset = 4, False, True
    array.constant_offset_displace = (0, 0.047, 0)


def letters(scene, location, rotation):
    """ROOKS, standing."""
    text = bpy.data.curves.new("Letters", "FONT")
    text.body, text.size, text.extrude = "ROOKS", 0.17, 0.011
    text.bevel_depth, text.bevel_resolution, text.space_character = 0.0022, 2, 1.08
    text.align_x = "CENTER"
    text.materials.append(common.diffuse("Mustard", (0.80, 0.46, 0.06)))
    object_ = common.link(scene, "Letters", text, location, rotation)
    object_.modifiers.new("Hard edges", "EDGE_SPLIT").split_angle = np.radians(25)


def tray(scene, location, rotation):
    """64 beads at Hammersley points in a tray: instances on points, by geometry nodes."""
    side, count = 0.15, 64
    i = np.arange(count)
    bits = (i[:, None] >> np.arange(6)) & 1
    points = np.stack([(i + 0.5) / count, bits @ 0.5 ** np.arange(1, 7) + 0.5 / count], axis=1)
    spots = [((x - 0.5) * side, (y - 0.5) * side, 0.0115) for x, y in points]

    slate = common.diffuse("Slate", (0.07, 0.10, 0.13))
    base = common.box(scene, "Tray", (side + 0.02, side + 0.02, 0.016), [slate], location, rotation)
    hollow = common.box(scene, "Tray's hollow", (side + 0.008, side + 0.008, 0.02), [slate], (0, 0, 0.006))
    hollow.parent = base
    common.hide(hollow)
    cut = base.modifiers.new("Hollow", "BOOLEAN")
    cut.operation, cut.solver, cut.object = "DIFFERENCE", "EXACT", hollow
    bevel = base.modifiers.new("Bevel", "BEVEL")
    bevel.width, bevel.segments = 0.0015, 2

    pearl = common.diffuse("Pearl", (0.80, 0.84, 0.86))
    arc = np.linspace(0, np.pi, 33)
    bead = common.lathe(scene, "Bead", np.stack([np.sin(arc), -np.cos(arc)], axis=1) * 0.0055, pearl, steps=48)
    bead.parent = base
    common.hide(bead)

    beads = common.mesh(scene, "Beads", spots, [], [])
    beads.parent = base
    beads.modifiers.new("Bead on every point", "NODES").node_group = instance_on_points(bead)


def instance_on_points(object_):
    """A geometry-nodes tree that puts an instance of an object on each point of the mesh it is given."""
    tree = bpy.data.node_groups.new("Instance on points", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    info, put = tree.nodes.new("GeometryNodeObjectInfo"), tree.nodes.new("GeometryNodeInstanceOnPoints")
    start.location, info.location, put.location, end.location = (-400, 100), (-400, -100), (-150, 0), (100, 0)
    info.inputs["Object"].default_value = object_
    info.inputs["As Instance"].default_value = True
    tree.links.new(start.outputs[0], put.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], put.inputs["Instance"])
    tree.links.new(put.outputs["Instances"], end.inputs[0])
    return tree


def cord(scene, points):
    """A cord that lies on the table: a Bézier curve with a round bevel."""
    curve = bpy.data.curves.new("Cord", "CURVE")
    curve.dimensions, curve.bevel_depth, curve.bevel_resolution, curve.resolution_u = "3D", 0.004, 6, 24
    curve.use_fill_caps = True
    spline = curve.splines.new("BEZIER")
    spline.bezier_points.add(len(points) - 1)
    for knot, (x, y) in zip(spline.bezier_points, points, strict=True):
        knot.co = x, y, 0.004
        knot.handle_left_type = knot.handle_right_type = "AUTO"
    curve.materials.append(common.diffuse("Indigo", (0.10, 0.13, 0.42)))
    common.link(scene, "Cord", curve)


def pebble(scene, location):
    """Metaballs, run together."""
    ball = bpy.data.metaballs.new("Pebble")
    ball.resolution, ball.render_resolution, ball.threshold = 0.008, 0.003, 0.6
    for *centre, radius in (
        (0, 0, 0.03, 0.055),
        (0.045, 0.01, 0.026, 0.042),
        (0.015, -0.04, 0.02, 0.034),
        (0.01, 0.008, 0.066, 0.036),
    ):
        element = ball.elements.new()
        element.co, element.radius = centre, radius
    ball.materials.append(common.diffuse("Sage", (0.36, 0.50, 0.36)))
    common.link(scene, "Pebble", ball, location)


def bowl(scene, location):
    """A bowl of eight sides, thickened by Solidify and rounded by Subdivision Surface."""
    rings = ((0.0, 0.002), (0.040, 0.002), (0.043, 0.012), (0.075, 0.045), (0.082, 0.080))
    turns = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    vertices = [(r * np.cos(a), r * np.sin(a), z) for r, z in rings[1:] for a in turns] + [(0, 0, rings[0][1])]
    faces = [(32, k, (k + 1) % 8) for k in range(8)]
    for ring in range(0, 24, 8):
        faces += [(ring + k, ring + 8 + k, ring + 8 + (k + 1) % 8, ring + (k + 1) % 8) for k in range(8)]
    glaze = common.diffuse("Glaze", (0.12, 0.36, 0.42))
    object_ = common.mesh(scene, "Bowl", vertices, faces, [glaze], location, smooth=True)
    thick = object_.modifiers.new("Thickness", "SOLIDIFY")
    thick.thickness, thick.offset = 0.006, 0
    smooth = object_.modifiers.new("Smooth", "SUBSURF")
    smooth.levels, smooth.render_levels = 2, 4


def picture(scene, location, rotation):
    """The zone plate in a frame, leaning on the wall."""
    materials = [common.diffuse("Ebony", (0.06, 0.05, 0.05)), common.textured("Zone plate", zone_plate())]
    framed(scene, "Picture", 0.21, 0.02, 0.018, 0.005, materials, location, rotation)


def main():
    scene = common.new_scene("still_life", (960, 600))
    common.world(scene, (0.15, 0.17, 0.21))

    common.rectangle(scene, "Table", (2.4, 1.6), common.textured("Wood", wood()), (0, -0.2, 0), uv=(2, 2))
    plaster = common.diffuse("Plaster", (0.30, 0.42, 0.44))
    common.rectangle(scene, "Wall", (4, 2), plaster, (0, 0.6, 0.9), (np.pi / 2, 0, 0))

    turn = np.radians(24)
    setting = common.link(scene, "Setting", None, (0, 0, 0), (0, 0, turn))
    board(scene, setting)
    rooks(scene, setting)
    pawns(scene, (-0.415, -0.185, 0), (0, 0, np.radians(-24)))
    letters(scene, (0.14, 0.43, 0.002), (np.pi / 2, 0, np.radians(-7)))
    tray(scene, (0.37, 0.015, 0), (0, 0, np.radians(12)))
    cord(
        scene,
        [(0.43, -0.22), (0.36, -0.13), (0.29, -0.21), (0.2, -0.29), (0.06, -0.27), (-0.05, -0.33), (-0.17, -0.35)],
    )
    pebble(scene, (0.46, 0.215, 0))
    bowl(scene, (-0.30, 0.33, 0))
    picture(scene, (-0.47, 0.55, 0.122), (np.radians(80), 0, np.radians(6)))

    common.light(
        scene, "Window", "AREA", (-0.95, -0.45, 0.85), (0, 0.05, 0), 30, (1, 0.88, 0.72),
        shape="RECTANGLE", size=0.3, size_y=0.45,
    )  # fmt: skip
    common.light(scene, "Lamp", "POINT", (0.66, 0.30, 0.36), (0, 0, 0), 3.2, (1, 0.6, 0.3), shadow_soft_size=0.03)
    common.light(
        scene, "Picture light", "SPOT", (-0.36, 0.15, 0.75), (-0.46, 0.56, 0.14), 9, (1, 0.93, 0.82),
        spot_size=0.7, spot_blend=0.6, shadow_soft_size=0.02,
    )  # fmt: skip
    common.light(scene, "Moon", "SUN", (0.5, -0.5, 1), (0, 0.2, 0), 0.35, (0.6, 0.75, 1), angle=0.05)
    focus = (0.0, -0.06, BOARD_TOP + 0.03)
    common.camera(scene, (0.05, -1.08, 0.62), (0.0, 0.04, 0.055), 43, fstop=5.6, focus=focus, blades=7)
    common.use_rooks(scene, samples=64)
    common.save(scene)


if __name__ == "__main__":
    main()
