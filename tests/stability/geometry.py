"""Geometry: meshes as importers and modifiers leave them, surfaces in the same place, and rays along surfaces."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from core import Camera, Instance, Mesh, PointLight, RenderSettings, Scene, SceneError, SunLight, render
from tests.scenes import (
    WHITE,
    box,
    camera_down,
    camera_forward,
    floor,
    lambertian,
    picture,
    pixel_centers,
    polygon,
    quad,
    rotation,
    scaling,
    sphere,
    translation,
)

from .case import Record, case

OVERHEAD = SunLight((0.0, 0.0, 1.0), (np.pi,) * 3)


@case(
    "Two surfaces in the same place",
    happens="Speckles of black: each surface shadows the other. Or the picture changes from render to render.",
    why="The hits on the two round differently, and either may be the nearer one.",
    rooks="Steps off by more than both round, so neither shadows the other. Which of them is seen may change from "
    "place to place, but not from render to render: the first of two equal meshes, or a pattern.",
)
def surfaces_in_one_place(record: Record) -> None:
    """A square of albedo 0.25 in one of 0.75, level and turned: each sample has one of both, whatever the threads."""
    for label, turn in (("level", np.eye(4)), ("turned", rotation(0, 0.4) @ rotation(1, -0.7))):
        normal = turn[:3, 2]
        pair = tuple(
            Instance(floor(size, (0.3, 0.2, 0.7)), turn, (lambertian(albedo),))
            for size, albedo in ((4, 0.75), (3, 0.25))
        )
        sun = SunLight(tuple(normal), (np.pi,) * 3)
        scene = Scene(camera_down(1.5, (32, 32), height=5), pair, (sun,))
        seen = [
            picture(scene, samples=1, sampler="regular", threads=threads, tile_size=size)
            for threads, size in ((1, 64), (2, 16))
        ]
        other = np.minimum(np.abs(seen[0] - 0.75), np.abs(seen[0] - 0.25))
        record.claim(f"{label}: farthest from both", other.max(), at_most=1e-5)
        record.claim(f"{label}: pixels that differ between 1 and 2 threads", (seen[0] != seen[1]).sum(), at_most=0)
    mesh = sphere(1.0)
    once, twice = (
        picture(Scene(camera_down(2.2, (48, 48), height=3), (Instance(mesh, materials=(WHITE,)),) * n, (OVERHEAD,)))
        for n in (1, 2)
    )
    record.claim("a ball twice in one place: largest difference to one", np.abs(once - twice).max(), at_most=1e-4)


@case(
    "Triangles without area, needles, and one of 10⁷ m",
    happens="Black dots and stripes, NaN, or a hole.",
    why="The normal of a triangle is a cross product, of which rounding leaves nothing where the triangle is narrow.",
    rooks="Embree drops the triangles that have no area, which no ray can hit; steps grow with the triangle.",
)
def narrow_triangles(record: Record) -> None:
    """A white ground of a fan of needles, between triangles of no area, in a white sky and under the sun."""
    angles = np.linspace(0, 2 * np.pi, 20_001)[:-1]
    rim = np.column_stack([5 * np.cos(angles), 5 * np.sin(angles), np.zeros(len(angles))])
    vertices = np.concatenate([[(0, 0, 0)], rim, [(0.1, 0.1, 0.5)] * 2]).astype(np.float32)
    k = np.arange(len(angles))
    needles = np.column_stack([np.zeros_like(k), k + 1, (k + 1) % len(k) + 1])
    nothing = [(len(k) + 1, len(k) + 2, len(k) + 2), (0, 0, 5), (0, len(k) + 1, len(k) + 2)]
    fan = Mesh("fan", vertices, np.concatenate([needles, nothing]).astype(np.int32))
    long = polygon([(-1e7, -1, 0), (1e7, -1, 0), (0, 1e7, 0)])
    tiny = sphere(1e-3, rings=150)  # its triangles at the poles are smaller than a micrometre
    for label, mesh, width in (("20,000 needles", fan, 3.0), ("one of 10⁷ m", long, 1.5)):
        ground = Instance(mesh, materials=(WHITE,))
        sky = Scene(camera_down(width, (32, 32)), (ground,), world=(1.0,) * 3)
        lit = replace(sky, lights=(OVERHEAD,), world=(0.0,) * 3)
        record.claim(f"{label}, in a white sky: error", np.abs(picture(sky) - 1).max(), at_most=1e-5)
        record.claim(f"{label}, in the sun: error", np.abs(picture(lit) - 1).max(), at_most=1e-5)
    for distance in (0.0, 1e3):
        place = translation(distance, 0, 0)
        ball = Instance(tiny, place, (WHITE,))
        scene = Scene(camera_down(1e-3, (16, 16), (distance, 0, 0)), (ball,), world=(1.0,) * 3)
        record.claim(f"a ball of 1 mm at {distance:g} m: error", np.abs(picture(scene) - 1).max(), at_most=1e-5)


@case(
    "Vertices and normals that are no numbers",
    happens="A traceback, a black object, or black dots that spread through a blur.",
    why="A failed import or modifier leaves NaN; one is enough to make every sum NaN that it gets into.",
    rooks="Names the object and counts its bad vertices; takes a triangle's own normal for corner normals that are "
    "none; counts samples that come out as NaN, and tells.",
)
def no_numbers(record: Record) -> None:
    ground, camera = floor(4), camera_down(1.0, (16, 16))
    for wrong in (np.nan, np.inf):
        vertices = ground.vertices.copy()
        vertices[1, 2] = wrong
        message = _error_of(Scene(camera, (Instance(replace(ground, name="Plane.001", vertices=vertices)),)))
        record.claim(f"errors that name the mesh of a vertex at {wrong:g}", "'Plane.001': 1 of" in message, at_least=1)
        record.claim("lines of the error", len(message.splitlines()), at_least=1, at_most=1)
    for wrong in (np.nan, np.inf, 0.0, -1.0):
        normals = np.tile(np.array([0, 0, 1], np.float32), (2, 3, 1))
        normals[0] = wrong * np.array([0, 0, 1]) if np.isfinite(wrong) else wrong
        scene = Scene(camera, (Instance(replace(ground, corner_normals=normals), materials=(WHITE,)),), (OVERHEAD,))
        film = render(scene, RenderSettings(samples=4, threads=1, max_bounces=1))
        record.claim(f"dropped samples with normals times {wrong:g}", film.dropped_samples, at_most=0)
        if wrong != -1:
            error = np.abs(film.passes["Combined"] - 1).max()
            record.claim(f"error with normals times {wrong:g}", error, at_most=1e-5)


def _error_of(scene: Scene) -> str:
    try:
        picture(scene)
    except SceneError as error:
        return str(error)
    return ""


@case(
    "Triangles that face inwards, and meshes that do not close",
    happens="Black where the inside is seen.",
    why="Shading only the front, or telling inside from outside by the first triangle.",
    rooks="Every surface has two sides; light counts on the side that it is on.",
)
def inward_triangles(record: Record) -> None:
    """A ball with all, or every other, triangle turned; and a leaf, lit and seen from either side."""
    mesh, camera = sphere(1.0), camera_down(2.2, (48, 48), height=3)
    sun = SunLight((0.5, 0.2, 1), (1.0,) * 3)
    expected = picture(Scene(camera, (Instance(mesh),), (sun,)))
    every_other = mesh.triangles.copy()
    every_other[::2] = every_other[::2, ::-1]
    for label, triangles in (("all", mesh.triangles[:, ::-1]), ("every other", every_other)):
        turned = Instance(replace(mesh, triangles=np.ascontiguousarray(triangles)))
        found = picture(Scene(camera, (turned,), (sun,)))
        record.claim(f"{label} turned: largest difference", np.abs(found - expected).max(), at_most=1e-4)
    for label, flip in (("front", scaling(1, 1, 1)), ("back", rotation(0, np.pi))):
        leaf = Instance(floor(4), flip, (WHITE,))
        lit = picture(Scene(camera_down(1), (leaf,), (OVERHEAD,)))
        below = picture(Scene(camera_down(1), (leaf,), (SunLight((0.0, 0.0, -1.0), (np.pi,) * 3),)))
        record.claim(f"a leaf's {label}, lit: error", np.abs(lit - 1).max(), at_most=1e-5)
        record.claim(f"a leaf's {label}, lit from beyond", below.max(), at_most=0)


@case(
    "Edges of three faces, and corners that two bodies share",
    happens="Dark seams where the faces meet, or light inside of a body.",
    why="What takes a mesh for the border of a body has no inside, or no neighbour, to go by there.",
    rooks="Looks at triangles one by one: the picture is that of the parts as meshes by themselves, to the bit. "
    "Regular points meet the edges themselves, where either neighbour may be found.",
)
def meshes_that_are_no_manifolds(record: Record) -> None:
    """Three leaves on one edge, and two pyramids tip to tip, under a sun."""
    edge = [(0.0, -1.0, 0.0), (0.0, 1.0, 0.0)]
    tips = [(math.cos(a), y, math.sin(a)) for a in (0.3, 2.4, 4.5) for y in (-1.0, 1.0)]
    leaves = [[(0, 2 * k + 2, 2 * k + 3), (0, 2 * k + 3, 1)] for k in range(3)]
    tip = [(0.0, 0.0, 0.0)]
    bases = [(x, y, z) for z in (0.8, -0.8) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    cones = [[(0, 1 + k + i, 1 + k + (i + 1) % 4) for i in range(4)] for k in (0, 4)]
    sun = SunLight((0.5, 0.2, 1), (1.0,) * 3)
    for label, vertices, parts in (("leaves", edge + tips, leaves), ("pyramids", tip + bases, cones)):
        corners = np.array(vertices, np.float32)
        whole = Mesh("", corners, np.array([triangle for part in parts for triangle in part], np.int32))
        apart = [Mesh("", corners, np.array(part, np.int32)) for part in parts]
        camera = camera_down(2.4, (48, 48), height=3)
        pictures = [
            picture(Scene(camera, tuple(Instance(mesh) for mesh in meshes), (sun,))) for meshes in ([whole], apart)
        ]
        record.claim(f"{label}: pixels that differ", (pictures[0] != pictures[1]).any(axis=-1).sum(), at_most=0)
        record.claim(f"{label}: mean of the picture", pictures[0].mean(), at_least=0.02)


@case(
    "Rays along a surface",
    happens="A ground that is black, or speckled, towards the horizon or at sunset.",
    why="A ray at 10⁻⁶ rad to the ground stays within a rounding error of it for metres.",
    rooks="Starts beside the ground by more than the error, and hits nothing of it.",
)
def rays_along_a_surface(record: Record) -> None:
    """A level and a turned ground, the sun or the camera's rays at an angle above it: sin(angle) / π."""
    camera = camera_down(1.0, (16, 16), height=2)
    for label, turn in (("level", np.eye(4)), ("turned", rotation(0, 0.4) @ rotation(1, -0.7))):
        ground = Instance(floor(20), turn, (WHITE,))
        for angle in (1e-2, 1e-4, 1e-6):
            direction = turn[:3, :3] @ (math.cos(angle), 0, math.sin(angle))
            seen = picture(Scene(camera, (ground,), (SunLight(tuple(direction), (np.pi,) * 3),)), samples=4)
            # The normal's own rounding, 2^-23, is a share of so small a cosine.
            bound = 1e-5 + 2.0**-23 / angle
            error = np.abs(seen / math.sin(angle) - 1).max()
            record.claim(f"{label}, sun at {angle:g} rad: relative error", error, at_most=bound)
            record.claim(f"{label}, sun at {angle:g} rad: black pixels", (seen == 0).sum(), at_most=0)
        for angle in (1e-2, 1e-4, 1e-6):
            # Looks along +x, down by the angle, from where the middle ray hits the ground 2 m ahead.
            look = turn @ translation(-2 * math.cos(angle), 0, 2 * math.sin(angle)) @ rotation(1, angle)
            matrix = look @ np.array([[0, 0, -1, 0], [-1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1.0]])
            width = 0.1 * angle
            flat = Camera(matrix, (16, 16), (-width, width, -width, width), clip_start=0.0, clip_end=1e9)
            sun = SunLight(tuple(turn[:3, 2]), (np.pi,) * 3)
            seen = picture(Scene(flat, (ground,), (sun,)), samples=4)
            record.claim(f"{label}, seen at {angle:g} rad: error", np.abs(seen - 1).max(), at_most=1e-4)


@case(
    "A camera in a wall, and rays from a corner",
    happens="Half of the picture is missing, or flickers.",
    why="A ray that starts on a surface hits it or not as rounding will have it.",
    rooks="A camera's ray sees what lies beyond its clip start, and a mesh from inside like from outside.",
)
def camera_in_a_wall(record: Record) -> None:
    """A camera at the face and at a corner of a box and inside of it: behind its clip start is the far wall, white."""
    lamp = PointLight((0, 0, 0), (100.0,) * 3)
    room = Instance(box(2), materials=(WHITE,))
    for label, at in (("face", (0, 0, 1)), ("corner", (1, 1, 1)), ("inside", (0.1, 0.2, 0.9))):
        looks_in = rotation(2, 0.75 * np.pi) @ rotation(0, 0.9) if label == "corner" else np.eye(4)
        camera = replace(camera_forward(0.3), matrix=translation(*at) @ looks_in, clip_start=1e-4)
        film = render(Scene(camera, (room,), (lamp,)), RenderSettings(samples=4, threads=1))
        depth = film.passes["Depth"]
        record.claim(f"{label}: nearest depth", depth.min(), at_least=0.5)
        record.claim(f"{label}: farthest depth", depth.max(), at_most=4)
        record.claim(f"{label}: least radiance", film.passes["Combined"][..., 0].min(), at_least=0.1)
    fan = quad((0, 0, -1), (2, 0, 0), (0, 2, 0))
    hits = render(
        Scene(replace(camera_forward(1e-4), clip_start=0.0), (Instance(fan, translation(1, 1, 0)),)),
        RenderSettings(samples=16, sampler="regular", threads=1),
    ).passes["Depth"]
    record.claim("error of a quarter of a window of 10⁻⁴ m about a corner", abs((hits < 2).mean() - 0.25), at_most=1e-6)


@case(
    "The shadow terminator of a coarse smooth ball",
    happens="The border of light on a smooth ball follows its triangles, in steps.",
    why="The interpolated normal still sees the light where the flat triangle has its back to it, or where its "
    "neighbour shadows it: the shading ends at a cosine well above 0.",
    rooks="Starts shadow rays at grazing light where the smooth surface would be, as Cycles does, by the object's "
    "Geometry Offset; with 0 the triangles shadow each other as they stand.",
)
def shadow_terminator(record: Record) -> None:
    """A ball of 8 rings in the sun: the steps along the border, against cos θ / π of its own smooth normals."""
    mesh = sphere(1.0, rings=8, smooth=True)
    direction = np.array([math.cos(0.2), 0.0, math.sin(0.2)])
    sun = SunLight(tuple(direction), (np.pi,) * 3)
    camera = camera_down(2.2, (128, 128), height=3)
    settings = RenderSettings(samples=1, sampler="regular", threads=1)
    for below in (0.0, 0.1):
        ball = Instance(mesh, materials=(WHITE,), lift_shadows_below=below)
        passes = render(Scene(camera, (ball,), (sun,)), settings).passes
        seen, cosine = passes["Combined"][..., 0], passes["Normal"] @ direction.astype(np.float32)
        wrong = np.abs(seen - np.maximum(cosine, 0)).max()
        record.show(f"Geometry Offset {below:g}", passes["Combined"][..., :3])
        if below == 0:
            record.claim("largest step with a Geometry Offset of 0", wrong, at_least=0.05)
        else:
            record.claim("largest error with 0.1, Blender's default", wrong, at_most=1e-5)


@case(
    "Lifted shadow rays and the shadows of other things",
    happens="Shadow rays that start above a surface pass over what lies on it.",
    why="The lift of a coarse mesh is as high as it is coarse.",
    rooks="Lifts only rays at grazing light: what stands on the lit side keeps its shadow, the far side stays dark.",
)
def lifted_shadows(record: Record) -> None:
    mesh = sphere(1.0, rings=8, smooth=True)
    sun = SunLight((1.0, 0.0, 0.0), (np.pi,) * 3)
    camera = camera_down(2.2, (64, 64), height=3)
    ball = Instance(mesh, materials=(WHITE,), lift_shadows_below=0.1)
    screen = Instance(quad((1.5, 0, 0), (0, 0, 4), (0, 4, 0)))
    x = np.broadcast_to(pixel_centers(camera)[0], (64, 64))
    lit = picture(Scene(camera, (ball,), (sun,)))
    record.claim("light beyond the smooth normals' border", lit[x < -0.05].max(), at_most=1e-5)
    record.claim("light in the shadow of a screen", picture(Scene(camera, (ball, screen), (sun,))).max(), at_most=0)
    inside = Scene(replace(camera, matrix=np.eye(4)), (ball,), (sun, SunLight((0.0, 0.0, 1.0), (np.pi,) * 3)))
    record.claim("light from outside, seen from inside", picture(inside).max(), at_most=0)
