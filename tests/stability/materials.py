"""Materials: values at and beyond the limits of what a surface can be."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from core import Camera, Film, Instance, Material, RenderSettings, Scene, SunLight, render
from core.scene import VISIBLE_TO_CAMERA
from core.shaders import (
    AddShader,
    Diffuse,
    Emission,
    Glass,
    Glossy,
    Metallic,
    MixShader,
    Principled,
    Refraction,
    Shader,
)
from core.values import OBJECT, Affine, Bump, Component, Math, Mix, NormalMap
from tests.scenes import (
    box,
    camera_down,
    emitter,
    estimate,
    floor,
    lambertian,
    picture,
    quad,
    rotation,
    translation,
)

from .case import Record, case


def furnace(shaders: Sequence[Shader], degrees: float, front: bool = True, **settings) -> tuple[np.ndarray, Film]:
    """What squares of these shaders show, (n, 3), each alone in a white world and seen from so many degrees."""
    side = math.ceil(math.sqrt(len(shaders)))
    long = 1 / math.cos(math.radians(degrees))
    square = quad((0, 0, 0), (1, 0, 0), (0, long if front else -long, 0))
    turn = rotation(0, math.radians(degrees))
    squares = tuple(
        Instance(
            square,
            translation(k % side + 0.5, k // side + 0.5, 0) @ turn,
            (Material(f"{k}", shader),),
            VISIBLE_TO_CAMERA,
        )
        for k, shader in enumerate(shaders)
    )
    camera = camera_down(side, (2 * side, 2 * side), (side / 2, side / 2, 0), height=100.0)
    settings = {"samples": 256, "sampler": "sobol_owen", "max_bounces": 2} | settings
    film = render(Scene(camera, squares, world=(1.0, 1.0, 1.0)), RenderSettings(**settings))
    seen = film.passes["Combined"][..., :3].astype(np.float64).reshape(side, 2, side, 2, 3).mean(axis=(1, 3))
    return seen.reshape(-1, 3)[: len(shaders)], film


def worst_furnace(shaders: Sequence[Shader]) -> tuple[float, int]:
    """(the largest error of a white surface's light from 0 and 60 degrees, samples that were no numbers)."""
    seen, films = zip(*(furnace(shaders, degrees, samples=4096) for degrees in (0, 60)), strict=True)
    return float(np.abs(np.array(seen) - 1).max()), sum(film.dropped_samples for film in films)


def floor_seen(shader: Shader, lights: tuple = (SunLight((0, 0, 1), (1, 1, 1)),), **settings) -> Film:
    """A floor of a metre from above, under a sun in the zenith."""
    scene = Scene(
        camera_down(1.0, (16, 16), height=3.0), (Instance(floor(2.0), materials=(Material("", shader),)),), lights
    )
    return render(scene, RenderSettings(**({"samples": 16} | settings)))


def irradiance_of(film: Film) -> np.ndarray:
    """Of a white floor."""
    return film.passes["Combined"][..., 0].astype(np.float64) * np.pi


# Of what a surface is made


@case(
    "Roughness of 0, next to it, and out of range",
    happens="A surface that is almost smooth makes light, loses light, or is another than the smooth one.",
    why="The density of its directions grows like 1 / roughness⁴, to more than float32 can tell apart.",
    rooks="Takes an α² of 2·10⁻¹⁰ and less for a mirror, as Cycles does, and writes GGX without differences of "
    "cosines. Roughness below 0 is 0, above 1 it is 1.",
)
def roughness_next_to_nothing(record: Record) -> None:
    for roughness in (0.0, 1e-4, 3.7e-3, 3.8e-3, 0.01, 0.1, 1.0, 2.0, -1.0):
        white = (
            Glossy(1.0, roughness), Metallic(1.0, 1.0, False, roughness), Glass(1.0, roughness),
            Principled(1.0, 0.0, roughness), Diffuse(1.0, roughness),
        )  # fmt: skip
        error, dropped = worst_furnace(white)
        record.claim(
            f"roughness {roughness:g}: largest error of white surfaces in a white furnace", error, at_most=0.01
        )
        record.claim(f"roughness {roughness:g}: samples that are no numbers", dropped, at_most=0)
    mirror = _reflected_edge(0.0)
    same = np.abs(_reflected_edge(1e-4) - mirror).max()
    record.claim("roughness 10⁻⁴: largest difference from the mirror", same, at_most=0)
    blurs = [np.abs(_reflected_edge(roughness) - mirror).sum() for roughness in (0.05, 0.1)]
    record.claim("blur of a mirrored edge: at roughness 0.05 over 0.1, α being roughness²", blurs[0] / blurs[1],
                 at_least=0.22, at_most=0.28)  # fmt: skip


def _reflected_edge(roughness: float) -> np.ndarray:
    """A mirrored edge of light, in a row of pixels across it."""
    camera = Camera(translation(0, 0, 1), (64, 4), (-0.2, 0.2, -0.0125, 0.0125), orthographic=True, clip_start=0.0)
    sky = Instance(
        quad((50, 0, 2), (0, 100, 0), (100, 0, 0)), materials=(emitter(),), visibility=~VISIBLE_TO_CAMERA & 31
    )
    ground = Instance(floor(1.0), materials=(Material("", Glossy(1.0, roughness)),))
    return picture(Scene(camera, (ground, sky)), samples=1024, sampler="sobol_owen", max_bounces=1)


@case(
    "Indices of refraction of 1, of 0, below 0 and of 10³⁰",
    happens="Glass that bends nothing is visible; an index out of range turns the picture black, or into no numbers.",
    why="Reflectance divides by 1 − ((η−1) / (η+1))², which float32 rounds to 0 from an index of 10⁷ on.",
    rooks="Lets light through glass of index 1 straight on, however rough. Takes indices for 10⁻⁵ to 10⁵.",
)
def index_of_refraction(record: Record) -> None:
    glow = Affine(OBJECT, np.array([(1.0, 0.5, 0, 2)] * 3))
    ground = Instance(floor(4.0), materials=(Material("", Emission(glow)),))
    camera = camera_down(2.0, (32, 32), height=3.0)
    nothing = picture(Scene(camera, (ground,)), sampler="regular", max_bounces=4)
    for roughness in (0.0, 0.5):
        glass = Instance(box(1.0, (0, 0, 1)), materials=(Material("", Glass(1.0, roughness, 1.0)),))
        seen = picture(Scene(camera, (ground, glass)), sampler="regular", max_bounces=4)
        error = np.abs(seen / nothing - 1).max()
        record.claim(f"index 1, roughness {roughness}: largest relative error of what is behind", error, at_most=1e-4)
    for index in (-1.0, 0.0, 0.5, 1.5, 100.0, 1e8, 1e30):
        white = [shader for roughness in (0.0, 0.5) for shader in (
            Glass(1.0, roughness, index), Principled(1.0, 0.0, roughness, index),
            Principled(1.0, 0.0, roughness, index, transmission=1.0), Principled(1.0, coat=1.0, coat_ior=index),
        )]  # fmt: skip
        error, dropped = worst_furnace(white)
        record.claim(f"index {index:g}: largest error of glass and plastic in a white furnace", error, at_most=0.02)
        record.claim(f"index {index:g}: samples that are no numbers", dropped, at_most=0)
        _, film = furnace([Refraction(1.0, 0.5, index)], 30)
        record.claim(f"Refraction of index {index:g}: samples that are no numbers", film.dropped_samples, at_most=0)


@case(
    "Every corner of the Principled BSDF",
    happens="A combination of extreme inputs gives back more light than it gets.",
    why="Layers estimate what those above them take; a wrong estimate counts the difference twice.",
    rooks="Stays below the light that it gets, at all corners of the inputs, with indices below 1 and tinted glass "
    "(there Cycles gives back up to 2.2 times of it).",
    samplers="Tried with Sobol, whose error is the least here; the two rows above try white surfaces with all of them.",
    is_slow=True,
)
def principled_corners(record: Record) -> None:
    """White surfaces in a white furnace, and of those the brightest again: to a standard error of 0.002.

    Not from straight on, where an index of 0 goes from total reflection to none within a hundredth of a degree.
    """
    corners = [
        Principled(1.0, metallic, roughness, ior, 1.0, None, diffuse, level, tint, transmission, coat, coat_roughness)
        for metallic, roughness, ior, diffuse, level, tint, transmission, coat, coat_roughness in itertools.product(
            (0.0, 1.0), (0.0, 0.5, 1.0), (0.0, 0.7, 1.0, 1.5, 100.0), (0.0, 1.0), (0.0, 0.5, 1.0), (0.0, 1.0),
            (0.0, 1.0), (0.0, 1.0), (0.0, 1.0)
        )
    ]  # fmt: skip
    for degrees, front in ((5, True), (60, True), (60, False), (85, True)):
        seen, film = furnace(corners, degrees, front, samples=64)
        brightest = [corners[k] for k in np.argsort(-seen[:, 0])[:100]]
        most = float(furnace(brightest, degrees, front, samples=4096)[0].max())
        view = f"{len(corners)} corners from {degrees}°, {'front' if front else 'back'}"
        record.claim(f"{view}: the most light of a square", most, at_most=1.02)
        record.claim(f"{view}: samples that are no numbers", film.dropped_samples, at_most=0)


@case(
    "An albedo of 1 and more",
    happens="Light never ends: at ρ = 1 a closed room has infinitely much of it, above 1 each bounce adds some.",
    why="A closed room of albedo ρ and radiance 1 has 1 / (1 − ρ); the sum has no limit from ρ = 1 on.",
    rooks="Adds up the bounces that Max Bounces allow, exactly: Σ ρᵏ. Russian roulette never raises a path's weight "
    "above its own. What grows out of float32 is dropped, counted and told.",
)
def albedo_of_one_and_more(record: Record) -> None:
    for albedo, bounces in ((0.5, 63), (0.99, 63), (1.0, 63), (1.5, 63), (10.0, 30)):
        found = _closed_room(albedo, bounces)
        closed = math.fsum(albedo**k for k in range(bounces + 2))
        what = f"albedo {albedo:g}, {bounces} bounces: standard errors off Σ ρᵏ = {closed:.4g}"
        record.claim(what, abs(found.mean - closed) / max(found.error, 1e-5 * closed), at_most=6)
    film = render(_room(1e6), RenderSettings(samples=4, max_bounces=63, diffuse_bounces=63))
    record.claim(
        "albedo 10⁶: share of the samples that are counted as dropped", film.dropped_samples / (16 * 4), at_least=1
    )


def _room(albedo: float) -> Scene:
    """The inside of a cube whose sides glow, looked up by nothing but the paths themselves."""
    sides = Material("", AddShader(Emission(1.0), Diffuse(albedo)), sample_as_light=False)
    camera = Camera(np.eye(4), (4, 4), (-0.5, 0.5, -0.5, 0.5), clip_start=0.0)
    return Scene(camera, (Instance(box(2.0), materials=(sides,)),))


def _closed_room(albedo: float, bounces: int):
    limits = {"max_bounces": bounces, "diffuse_bounces": bounces}
    return estimate(lambda seed: picture(_room(albedo), samples=64, seed=seed, **limits).mean(), seeds=8)


@case(
    "Emission below 0",
    happens="A surface or a world that takes light away: pixels below 0, or a lamp that is never chosen.",
    why="A light is chosen by its power, which is no share any more if it can be negative.",
    rooks="Chooses by the power's size and takes the light away. Pixels that end below 0 are black; they are "
    "counted and told.",
)
def emission_below_nothing(record: Record) -> None:
    """Two squares above a floor: with strengths p and −n its light is that of p less that of n."""
    both, plus, minus = (_lit_by(strengths) for strengths in ((3.0, -1.0), (3.0, 0.0), (0.0, 1.0)))
    error = math.hypot(both.error, plus.error, minus.error)
    record.claim("standard errors off the difference", abs(both.mean - (plus.mean - minus.mean)) / error, at_most=6)
    film = floor_seen(Emission(-1.0))
    record.claim("pixels of a surface of emission −1 that are black", int((film.passes["Combined"][..., 0] == 0).sum()),
                 at_least=256)  # fmt: skip
    record.claim("pixels counted as negative, of 256", film.negative_pixels, at_least=256)


def _lit_by(strengths: tuple[float, float]):
    lamps = tuple(
        Instance(
            quad((x, 0, 1), (0, 0.5, 0), (0.5, 0, 0)),
            materials=(Material("", Emission(1.0, strength)),),
            visibility=~VISIBLE_TO_CAMERA & 31,
        )
        for x, strength in zip((-0.5, 0.5), strengths, strict=True)
    )
    scene = Scene(camera_down(0.1, (4, 4), height=3.0), (Instance(floor(), materials=(lambertian(1.0),)), *lamps))
    return estimate(lambda seed: picture(scene, samples=256, seed=seed).mean(), seeds=8)


# What varies over a surface


@case(
    "Bumps without end",
    happens="A height that jumps, or that is out of all proportion, makes the surface black or a hole.",
    why="The slope, or its product with the distance, is infinite, and a normal of infinite length has no direction.",
    rooks="Takes slopes of more than 10¹⁵ for vertical. A height that is no number drops the samples, and is told.",
)
def bumps_without_end(record: Record) -> None:
    """A plane tilted to the slope s shows the cosine 1 / √(1 + s²) to a sun in the zenith."""
    across = Component(OBJECT, 0)
    for slope in (1.0, 1e3, 1e10, 1e20, 1e30, 3e38):
        film = floor_seen(Diffuse(1.0, 0.0, Bump(Math("multiply", across, slope))))
        error = np.abs(irradiance_of(film) - 1 / math.hypot(1, slope)).max()
        record.claim(f"slope {slope:g}: largest error", error, at_most=2e-5)
        record.claim(f"slope {slope:g}: samples that are no numbers", film.dropped_samples, at_most=0)
    film = floor_seen(Diffuse(1.0, 0.0, Bump(across, distance=3e38)))
    record.claim("distance 3e38 m: largest error", irradiance_of(film).max(), at_most=1e-12)


@case(
    "Normal maps that say nothing",
    happens="A map of mean grey, (½, ½, ½), is no direction at all: walls turn to the sky.",
    why="A vector of length 0 cannot be made one long, and whatever stands in for it is a direction in the world.",
    rooks="Leaves the surface's own normal, as Cycles does, in every space and also half way (Strength ½).",
)
def normal_maps_of_nothing(record: Record) -> None:
    """A wall that faces a sun from +x sees all of it."""
    wall = quad((0, 0, 0), (0, 1, 0), (0, 0, 1))
    facing = np.array([(0, 0, 1, 3), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1.0)])
    camera = Camera(facing, (4, 4), (-0.2, 0.2, -0.2, 0.2), orthographic=True, clip_start=0.0)
    for space, strength in itertools.product(("tangent", "object", "world"), (0.0, 0.5, 1.0, 10.0)):
        mapped = Diffuse(1.0, 0.0, NormalMap((0.5, 0.5, 0.5), strength, space))
        scene = Scene(camera, (Instance(wall, materials=(Material("", mapped),)),), (SunLight((1, 0, 0), (1, 1, 1)),))
        error = np.abs(picture(scene) * np.pi - 1).max()
        record.claim(f"{space} space, strength {strength:g}: largest error", error, at_most=1e-5)


@case(
    "Factors outside of 0 to 1, and numbers that are none",
    happens="A mix by a factor of 2 takes more than there is of one part; NaN spreads over the picture.",
    why="Math nodes have no bounds, and what is not a number passes every comparison as if it were in range.",
    rooks="Clamps the factor of Mix Shader, and of Mix where Clamp Factor is on. A value that is no number drops its "
    "samples, which are counted and told.",
)
def factors_out_of_range(record: Record) -> None:
    infinite = Math("multiply", 3e38, 3e38)
    nothing = Math("subtract", infinite, infinite)
    for factor, expected in ((-1.0, 0.2), (0.25, 0.3), (2.0, 0.6), (infinite, 0.6)):
        for mixed in (MixShader(factor, Diffuse(0.2), Diffuse(0.6)), Diffuse(Mix(factor, 0.2, 0.6))):
            error = np.abs(irradiance_of(floor_seen(mixed)) / expected - 1).max()
            name = f"{factor:g}" if isinstance(factor, float) else "∞"
            record.claim(f"{type(mixed).__name__} by {name}: largest relative error", error, at_most=1e-5)
    unclamped = irradiance_of(floor_seen(Diffuse(Mix(1.5, 0.2, 0.6, clamp_factor=False))))
    record.claim("Mix by 1.5 without clamping: largest relative error", np.abs(unclamped / 0.8 - 1).max(), at_most=1e-5)
    for shader in (
        Glossy(0.5, nothing), Diffuse(0.5, nothing), Diffuse(nothing), Glass(1.0, nothing), Glass(1.0, 0.0, nothing),
        Principled(0.5, 0.0, nothing), Principled(0.5, nothing), Emission(nothing),
        MixShader(nothing, None, Emission(1.0)),
    ):  # fmt: skip
        dropped = floor_seen(shader).dropped_samples / (256 * 16)
        record.claim(f"{type(shader).__name__} with a NaN: share of the samples that are dropped", dropped, at_least=1)
