"""Images on surfaces: their sizes, what is missing of them, and the coordinates that look them up."""

from __future__ import annotations

import itertools
import math

import numpy as np

from core import Instance, Material, Mesh, RenderSettings, Scene, SunLight, render
from core.shaders import Diffuse
from core.values import EXTENSIONS, UV, Affine, ImageTexture
from tests.scenes import camera_down, floor

from .case import Record, case

FLOOR = floor(1.0)
#: Shows a white floor as 1.
SUN = SunLight((0, 0, 1), (math.pi,) * 3)


def seen(mesh: Mesh, texture: ImageTexture):
    """A film of a floor that shows its texture under an even sun, one sample in the middle of each of 256 pixels."""
    scene = Scene(camera_down(1.0), (Instance(mesh, materials=(Material("", Diffuse(texture)),)),), (SUN,))
    return render(scene, RenderSettings(samples=1, sampler="regular"))


def floor_with(uvs: np.ndarray) -> Mesh:
    """The floor, its (4, 2) corners having these coordinates."""
    return Mesh("floor", FLOOR.vertices, FLOOR.triangles, uvs=np.asarray(uvs, np.float32)[FLOOR.triangles])


UNIT = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float64)


@case(
    "Images of 1 and of 16384 × 16384 pixels",
    happens="A single pixel has no neighbours; a huge image fills the memory, or float32 misses its pixels.",
    why="A coordinate times 16384 leaves 10 of float32's 24 bits to say where in a pixel it lies.",
    rooks="Finds each of 268 million pixels, and keeps a single image once (3 bytes a pixel as bytes, 12 as floats).",
    samplers="Regular, whose one sample is in the middle of the pixel, so that it is known what has to be found there.",
)
def images_of_any_size(record: Record) -> None:
    for extension in ("repeat", "mirror", "extend"):
        for interpolation in ("linear", "closest"):
            one = ImageTexture(np.full((1, 1, 3), 0.25, np.float32), extension, interpolation)
            error = np.abs(seen(floor_with(UNIT * 7 - 3), one).passes["Combined"][..., 0] - 0.25).max()
            record.claim(f"1 × 1, {extension}, {interpolation}: largest error", error, at_most=1e-7)
    size = 16384
    rows = np.arange(size)
    image = np.empty((size, size, 3), np.uint8)
    image[..., 0], image[..., 1] = (rows % 251).astype(np.uint8), (rows % 241).astype(np.uint8)[:, None]
    image[..., 2] = np.add.outer((rows // 128).astype(np.uint8), (rows // 128).astype(np.uint8))
    for interpolation in ("closest", "linear"):
        wrong = 0
        for left, below in ((0, 0), (8183, 5000), (size - 16, size - 16), (12345, 16000)):
            film = seen(floor_with((UNIT * 16 + (left, below)) / size), ImageTexture(image, "extend", interpolation))
            expected = _linear(image[below : below + 16, left : left + 16])
            # Between pixels float32 knows the place to 2^-10 of a pixel, and neighbours differ by all there is.
            wrong += int((np.abs(film.passes["Combined"][..., :3] - expected) > 4e-3).any(axis=2).sum())
        record.claim(f"16384 × 16384, {interpolation}: pixels of 1024 that are not the image's", wrong, at_most=0)
    record.claim("memory of the render over the image's own", film.memory / image.nbytes, at_most=1.05)


def _linear(colors: np.ndarray) -> np.ndarray:
    """sRGB's transfer function, IEC 61966-2-1."""
    shares = colors / 255.0
    return np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)


@case(
    "Coordinates of a million, of 10³⁰, and of none",
    happens="Coordinates from a broken unwrap or a huge Mapping read beside the image, crash, or turn pixels black.",
    why="What is larger than an integer is none when it is converted; from 10⁷ on, float32 steps over whole images.",
    rooks="Repeats, mirrors, extends and clips at any coordinate that float32 holds. Coordinates of a mesh that are no "
    "numbers are taken for 0, with a warning; computed ones drop their samples, which is told.",
)
def coordinates_without_bounds(record: Record) -> None:
    image = np.random.default_rng(1).random((4, 4, 3)).astype(np.float32)
    low, high = image[..., 0].min(), image[..., 0].max()
    for place in (1e6, 1e10, 1e20, 1e30):
        off = light = 0.0
        for interpolation, (sign, edge) in itertools.product(
            ("closest", "linear"), ((1, image[3, 3, 0]), (-1, image[0, 0, 0]))
        ):
            red = {
                extension: _red(np.full((4, 2), sign * place), ImageTexture(image, extension, interpolation))
                for extension in EXTENSIONS
            }
            off = max(off, np.abs(red["extend"] - edge).max())
            light = max(light, red["clip"].max())
            for extension in ("repeat", "mirror"):  # NaN is not between
                inside = ((red[extension] > low - 1e-6) & (red[extension] < high + 1e-6)).all()
                off = max(off, 0.0 if inside else 1.0)
        record.claim(f"±{place:g}: largest error of extend, repeat and mirror", off, at_most=1e-6)
        record.claim(f"±{place:g}: light of clip", light, at_most=0)
    off = np.abs(_red(np.full((4, 2), np.nan), ImageTexture(image, "extend", "closest")) - image[0, 0, 0]).max()
    record.claim("NaN in the mesh: off the pixel at 0", off, at_most=1e-6)
    infinite = Affine(UV, np.array([(3e38, 0, 0, 3e38)] * 3))
    film = seen(floor_with(UNIT + 1), ImageTexture(image, "extend", "closest", infinite))
    record.claim("∞ computed: samples that are dropped, of 256", film.dropped_samples, at_least=256)


def _red(uvs: np.ndarray, texture: ImageTexture) -> np.ndarray:
    return seen(floor_with(uvs), texture).passes["Combined"][..., 0]


@case(
    "Texture coordinates without an area under a normal map",
    happens="A surface that is not unwrapped, or to a point or a line, is black or speckled under its normal map.",
    why="The direction in which u grows is the quotient of an edge and an area of 0.",
    rooks="Takes the object's X for it, as Blender and Cycles do, and Y turned round for v; with NaN likewise.",
)
def uvs_without_an_area(record: Record) -> None:
    """A square that shines in the colour of its mapped normal, which leans by X and -Y."""
    from tests.addon_helpers import empty_scene, export, feed, quad, shader

    color = np.array((0.7, 0.4, 0.9))
    leaning = (2 * color - 1) * (1, -1, 1)
    expected = leaning / np.linalg.norm(leaning)
    to_a_line = np.outer((0, 0, 1, 1), (0, 1))
    for label, uvs in (("a point", np.zeros((4, 2))), ("a line", to_a_line), ("NaN", np.full((4, 2), np.nan))):
        empty_scene(8, 8)
        paint, glow = shader("ShaderNodeEmission")
        feed(glow.inputs["Color"], "ShaderNodeNormalMap").inputs["Color"].default_value = (*color, 1)
        square = quad(size=20.0)
        square.data.materials.append(paint)
        square.data.uv_layers[0].uv.foreach_set("vector", uvs.astype(np.float32).ravel())
        scene, warnings = export()
        film = render(scene, RenderSettings(samples=1))
        error = np.abs(film.passes["Combined"][..., :3] - expected).max()
        record.claim(f"{label}: largest error of the normal", error, at_most=1e-5)
        record.claim(f"{label}: samples that are dropped", film.dropped_samples, at_most=0)
        record.claim(f"{label}: warnings", len(warnings), at_least=label == "NaN", at_most=label == "NaN")


@case(
    "Images that are missing",
    happens="A texture without its file shows as black, or as nothing, without a word.",
    why="Blender keeps the node, and its image of no size.",
    rooks="Shows magenta, as Blender and Cycles do, and names the node in a warning.",
)
def images_that_are_missing(record: Record) -> None:
    import bpy

    from tests.addon_helpers import empty_scene, export, feed, quad, shader

    for label in ("no image", "a file that is gone"):
        empty_scene(8, 8)
        paint, glow = shader("ShaderNodeEmission")
        node = feed(glow.inputs["Color"], "ShaderNodeTexImage")
        if label != "no image":
            node.image = bpy.data.images.new("Gone", 8, 8)
            node.image.source, node.image.filepath = "FILE", "/nowhere/gone.png"
        quad(size=20.0).data.materials.append(paint)
        scene, warnings = export()
        shown = render(scene, RenderSettings(samples=1)).passes["Combined"][..., :3]
        record.claim(f"{label}: largest difference from magenta", np.abs(shown - (1, 0, 1)).max(), at_most=1e-6)
        told = [text for text in warnings if 'node "Image Texture"' in text and "Paint" in text]
        record.claim(f"{label}: warnings that name the node and the material", len(told), at_least=1, at_most=1)
