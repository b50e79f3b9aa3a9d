"""Small scenes for figures and charts, each of which leaves one domain of sampling to chance: pixel, lens, light, BSDF.

What a domain adds to a picture's variance is measured with one random sample per pixel (Sobol 1993): its share is the
variance of the mean over all other domains, divided by the whole variance. What several domains share is nobody's.

`checkerboard`, `sharp_edge` and `defocus` need no chance in their lighting. Their surfaces are lit by a sun of no size
that casts no shadows and are all turned to it alike, so that what a surface sends to the camera is its albedo.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ..scene import (
    VISIBLE_TO_SHADOWS,
    VISIBLE_TO_SURFACES,
    AreaLight,
    Camera,
    Instance,
    Material,
    Mesh,
    Scene,
    SunLight,
)
from ..shaders import Diffuse, Emission, Glossy, Shader
from ..values import UV, Checker
from .chess_rook import chess_rook

#: The radiance of what is dark and of what is light.
DARK, LIGHT = 0.05, 0.9
SKY = (0.45, 0.62, 0.85)

#: `checkerboard`: where the camera stands, what it looks at, and how many metres it sees one metre ahead.
EYE, TARGET, VIEW = (0.0, 0.0, 2.2), (0.8, 8.0, 0.3), 1.125

#: The sharp edge's angle to the vertical, in radians: as steep as in the book's figure, and at no simple slope.
EDGE_ANGLE = math.radians(23)
#: The radius of the lens of `defocus`, in metres.
DEFOCUS_RADIUS = 0.9


def checkerboard(resolution: tuple[int, int] = (256, 256)) -> Scene:
    """A plane of dark and light checks to the horizon (Suffern 2007, figures 5.19 to 5.21). Varies: the pixel alone.

    A check is one metre wide. Towards the horizon, 71 % up a square picture, hundreds of checks fall into one pixel,
    whose right colour is the mean of DARK and LIGHT. All variance is the pixel's.
    """
    size = 8000.0
    floor = _rectangle("floor", (0.3, 0, 0), (size, 0, 0), (0, size, 0))
    sky = _rectangle("sky", (0, size / 2, 0), (4 * size, 0, 0), (0, 0, 4 * size))
    checks = Checker((LIGHT,) * 3, (DARK,) * 3, 1.0, UV)
    return Scene(
        _camera(EYE, TARGET, resolution, VIEW, clip_end=1e6),
        (
            Instance(floor, materials=(Material("checks", Diffuse(checks)),)),
            Instance(sky, materials=(Material("sky", Diffuse(SKY)),)),
        ),
        (_even_sun((0, -1, 1)),),
    )


def horizon(resolution: tuple[int, int]) -> float:
    """The height of the checkerboard's horizon above the picture's lower edge, in pixels."""
    down = (EYE[2] - TARGET[2]) / math.dist(EYE[:2], TARGET[:2])
    return resolution[1] / 2 + down * resolution[0] / VIEW


def sharp_edge(resolution: tuple[int, int] = (7, 5)) -> Scene:
    """A dark half-plane right of a slanted edge, on a light ground (Suffern 2007, figure 4.1). Varies: the pixel alone.

    The edge leans over to the right by EDGE_ANGLE and passes through the middle of the picture. All variance is the
    pixel's, and a pixel's mean is LIGHT + (DARK - LIGHT) × its `edge_coverage`.
    """
    aspect = resolution[1] / resolution[0]
    camera = Camera(np.eye(4), resolution, (-0.5, 0.5, -aspect / 2, aspect / 2), orthographic=True, clip_start=0.0)
    return Scene(camera, _half_plane(depth=1.0, angle=EDGE_ANGLE), (_even_sun((0, 0, 1)),))


def edge_coverage(resolution: tuple[int, int] = (7, 5)) -> np.ndarray:
    """The share of each pixel of `sharp_edge` that the dark half-plane covers, exactly: (h, w), bottom row first."""
    width, height = resolution
    a, b = math.cos(EDGE_ANGLE), math.sin(EDGE_ANGLE)
    # In pixels from the middle; dark is where a x - b y > 0.
    x = np.arange(width)[None, :] - width / 2
    y = np.arange(height)[:, None] - height / 2

    def ramp(d: np.ndarray) -> np.ndarray:
        return np.maximum(d, 0) ** 2 / 2

    # The integral of a step over a square is the second difference of the step's own second integral.
    d = a * x - b * y
    share = (ramp(d + a) - ramp(d) - ramp(d + a - b) + ramp(d - b)) / (a * b)
    return np.where(d - b >= 0, 1.0, share)  # without the rounding where all of the pixel is dark


def defocus(resolution: tuple[int, int] = (128, 128)) -> Scene:
    """A sharp edge far out of focus, its blur nearly as wide as the picture. Varies: the lens.

    The camera focuses at 1 m and sees 1 m of that plane; the edge of a dark half-plane, 2 m away, passes through the
    middle and leans over to the right by EDGE_ANGLE. On the plane in focus its blur is DEFOCUS_RADIUS wide: at a
    distance of t × DEFOCUS_RADIUS / 2 to the light side the light's share is ½ + (asin t + t√(1 − t²))/π. At
    64 × 64 the lens has 98 % of the variance; the pixel alone has nothing, and what they share shrinks as pixels do.
    """
    aspect = resolution[1] / resolution[0]
    camera = Camera(
        np.eye(4),
        resolution,
        (-0.5, 0.5, -aspect / 2, aspect / 2),
        clip_start=0.0,
        lens_radius=DEFOCUS_RADIUS,
        focus_distance=1.0,
    )
    return Scene(camera, _half_plane(depth=2.0, angle=EDGE_ANGLE), (_even_sun((0, 0, 1)),))


#: `penumbra`: the light's edges and height, the height of the blocker, in metres, and the light's radiance.
LIGHT_SIDE, LIGHT_HEIGHT, BLOCKER_HEIGHT, LIGHT_RADIANCE = 1.0, 2.0, 1.0, 13.0


def penumbra(resolution: tuple[int, int] = (128, 128)) -> Scene:
    """The soft edge of a half-plane's shadow on a white floor, as wide as the picture. Varies: the light.

    The camera looks straight down on 1.2 m of floor. A square light, LIGHT_SIDE wide, shines down from LIGHT_HEIGHT
    above the middle; half-way up a half-plane that the camera does not see hides it from the right of an edge that
    leans over to the right by EDGE_ANGLE. At 64 × 64 the light has 98 % of the variance; the pixel alone has nothing,
    and what they share shrinks as pixels do.
    """
    width = 1.2
    height = width * resolution[1] / resolution[0]
    camera = Camera(
        _translation(0, 0, 0.5), resolution, (-width / 2, width / 2, -height / 2, height / 2), True, clip_start=0.0
    )
    floor = _rectangle("floor", (0, 0, 0), (8, 0, 0), (0, 8, 0))
    blocker, _ = _half_plane(depth=-BLOCKER_HEIGHT, angle=EDGE_ANGLE)
    light = AreaLight(
        (0, 0, LIGHT_HEIGHT),
        (LIGHT_SIDE, 0, 0),
        (0, LIGHT_SIDE, 0),
        (math.pi * LIGHT_SIDE**2 * LIGHT_RADIANCE,) * 3,
    )
    hidden = Instance(blocker.mesh, blocker.matrix, blocker.materials, VISIBLE_TO_SHADOWS)
    return Scene(camera, (Instance(floor, materials=(Material("white", Diffuse((1.0, 1.0, 1.0))),)), hidden), (light,))


def hemisphere(resolution: tuple[int, int] = (128, 128)) -> Scene:
    """The same shadow, its light found by chance: all directions above a matt floor are tried. Varies: the BSDF."""
    return _found_by_chance(resolution, Diffuse((1.0, 1.0, 1.0)))


def lobe(resolution: tuple[int, int] = (128, 128)) -> Scene:
    """The same on a floor of rough metal: the directions of a GGX lobe of roughness 0.3 are tried. Varies: the BSDF."""
    return _found_by_chance(resolution, Glossy((1.0, 1.0, 1.0), 0.3, "ggx"))


def _found_by_chance(resolution: tuple[int, int], surface: Shader) -> Scene:
    """`penumbra` with a glowing panel in place of the light, which only rays off the floor find."""
    shadow = penumbra(resolution)
    panel = _rectangle("panel", (0, 0, LIGHT_HEIGHT), (LIGHT_SIDE, 0, 0), (0, LIGHT_SIDE, 0))
    glow = Material("glow", Emission((1.0, 1.0, 1.0), LIGHT_RADIANCE), sample_as_light=False)
    floor, blocker = shadow.instances
    return Scene(
        shadow.camera,
        (
            Instance(floor.mesh, materials=(Material("floor", surface),)),
            Instance(blocker.mesh, blocker.matrix, (Material("black", None),), VISIBLE_TO_SURFACES),
            Instance(panel, materials=(glow,), visibility=VISIBLE_TO_SURFACES),
        ),
    )


def box(resolution: tuple[int, int] = (128, 128)) -> Scene:
    """A closed room, 2 m wide, one wall red and one green, with a block in it and a lamp under its ceiling.

    Varies: the light and the BSDF at every bounce, as many as are allowed; the more there are, the more dimensions a
    path has.
    """
    aspect = resolution[1] / resolution[0]
    camera = Camera(_translation(0, 0, 0.98), resolution, (-0.8, 0.8, -0.8 * aspect, 0.8 * aspect), clip_start=0.0)
    white, red, green = (
        Material(name, Diffuse(color))
        for name, color in (("white", (0.75,) * 3), ("red", (0.6, 0.08, 0.06)), ("green", (0.1, 0.45, 0.12)))
    )
    walls = (
        (_rectangle("back", (0, 0, -1), (2, 0, 0), (0, 2, 0)), white),
        (_rectangle("front", (0, 0, 1), (2, 0, 0), (0, 2, 0)), white),
        (_rectangle("floor", (0, -1, 0), (2, 0, 0), (0, 0, 2)), white),
        (_rectangle("ceiling", (0, 1, 0), (2, 0, 0), (0, 0, 2)), white),
        (_rectangle("left", (-1, 0, 0), (0, 2, 0), (0, 0, 2)), red),
        (_rectangle("right", (1, 0, 0), (0, 2, 0), (0, 0, 2)), green),
        (_rectangle("top of the block", (0.35, -0.4, -0.4), (0.6, 0, 0.2), (-0.2, 0, 0.6)), white),
        (_rectangle("side of the block", (0.25, -0.7, -0.1), (0.6, 0, 0.2), (0, 0.6, 0)), white),
        (_rectangle("other side of the block", (0.05, -0.7, -0.5), (-0.2, 0, 0.6), (0, 0.6, 0)), white),
    )
    lamp = AreaLight((0, 0.98, -0.1), (0.5, 0, 0), (0, 0, -0.5), (12.0, 11.0, 9.0))
    return Scene(camera, tuple(Instance(mesh, materials=(material,)) for mesh, material in walls), (lamp,))


def everything(resolution: tuple[int, int] = (384, 256)) -> Scene:
    """Chess rooks on a board under two area lights and a dim sky, the one in the middle in focus. Varies: every domain.

    At 384 × 256 the pixel has 5 % of the variance, the lens 35 %, the lights 31 %, the sky (BSDF) 5 %, and what they
    share 24 %. The pixel's share grows as the pixels do.
    """
    board = _rectangle("board", (0, 0, 0), (40, 0, 0), (0, 40, 0))
    checks = Material("checks", Diffuse(Checker((0.75, 0.68, 0.55), (0.1, 0.06, 0.04), 1.0, UV)))
    ivory, ebony = Material("ivory", Diffuse((0.85, 0.78, 0.65))), Material("ebony", Diffuse((0.09, 0.07, 0.06)))
    piece = chess_rook()
    places = [
        ((-1.5, -1.5), ivory),
        ((0.5, -0.5), ebony),
        ((-0.5, 1.5), ivory),
        ((2.5, 2.5), ivory),
        ((-2.5, 4.5), ebony),
    ]
    pieces = tuple(Instance(piece, _translation(x, y, 0), (material,)) for (x, y), material in places)
    camera = _camera((1.0, -6.5, 2.6), (0.1, 0, 0.55), resolution, 0.8, lens_radius=0.09, focus_distance=6.3)
    lights = (
        AreaLight((-3, -1, 5), (1.4, 0, 1.2), (0, 1.8, 0), (560.0, 490.0, 400.0), name="key"),
        AreaLight((4, 3, 4), (1.0, 0, -1.0), (0, 1.0, 0), (90.0, 120.0, 170.0), name="rim"),
    )
    return Scene(camera, (Instance(board, materials=(checks,)), *pieces), lights, (0.2, 0.25, 0.33))


def _camera(eye: Sequence[float], target: Sequence[float], resolution: tuple[int, int], width: float, **lens) -> Camera:
    """A perspective camera at `eye` that looks at `target` and sees `width` metres one metre in front."""
    back = np.subtract(eye, target)
    back /= np.linalg.norm(back)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3] = np.column_stack((right, np.cross(back, right), back, eye))
    height = width * resolution[1] / resolution[0]
    return Camera(matrix, resolution, (-width / 2, width / 2, -height / 2, height / 2), **lens)


def _even_sun(direction: Sequence[float]) -> SunLight:
    """A sun that makes a white surface's radiance 1 if it faces up (or -y, where y of `direction` is -z)."""
    towards = np.array(direction) / np.linalg.norm(direction)
    cosine = towards[2]
    return SunLight(tuple(map(float, towards)), (math.pi / cosine,) * 3, cast_shadow=False)


def _half_plane(depth: float, angle: float) -> tuple[Instance, Instance]:
    """A dark half-plane `depth` below the origin, to the right of an edge, and the light ground behind it.

    The edge passes the z axis and leans over to the right by `angle` from y.
    """
    size = 100.0
    half = _rectangle("half-plane", (size / 2, 0, 0), (size, 0, 0), (0, size, 0))
    turn = _translation(0, 0, -depth)
    turn[:2, :2] = [[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]]
    ground = _rectangle("ground", (0, 0, -depth - 1), (size, 0, 0), (0, size, 0))
    return (
        Instance(half, turn, (Material("dark", Diffuse((DARK,) * 3)),)),
        Instance(ground, materials=(Material("light", Diffuse((LIGHT,) * 3)),)),
    )


def _rectangle(name: str, center: Sequence[float], edge_u: Sequence[float], edge_v: Sequence[float]) -> Mesh:
    """A rectangle about `center` whose UVs are metres along its edges."""
    c, u, v = (np.array(vector, np.float64) for vector in (center, edge_u, edge_v))
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)
    vertices = c + (corners[:, :1] - 0.5) * u + (corners[:, 1:] - 0.5) * v
    triangles = np.array([[0, 1, 2], [0, 2, 3]], np.int32)
    uvs = corners * (np.linalg.norm(u), np.linalg.norm(v))
    return Mesh(name, vertices.astype(np.float32), triangles, uvs=uvs[triangles].astype(np.float32))


def _translation(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix
