"""What light passes through: layers of glass in each other, thin sheets, and stacks of transparent surfaces."""

from __future__ import annotations

import math

import numpy as np

from core import Camera, Film, Instance, Material, Mesh, RenderSettings, Scene, SunLight, render
from core.shaders import Emission, Glass, Principled, Shader, Transparent
from core.values import OBJECT, Component, Math, Value
from tests.scenes import box, camera_down, floor, lambertian, picture, rotation, sphere, translation

from .case import Record, case


@case(
    "A hundred transparent surfaces",
    happens="Foliage or hair of transparent cards turns black somewhere inside, without a word.",
    why="The number of surfaces that a path may pass straight through is limited, in Cycles as well.",
    rooks="Passes as many as Transparent in Light Paths says, up to 256, camera rays and shadows alike, exactly. "
    "Behind them it is black, as in Cycles; the samples that see that are counted, and a warning says what to raise.",
)
def hundred_transparent_surfaces(record: Record) -> None:
    for count, limit in ((100, 100), (256, 256), (8, 8)):
        film = _through(count, Transparent(0.9), limit)
        error = abs(film.passes["Combined"][..., 0].astype(np.float64) / 0.9**count - 1).max()
        record.claim(
            f"{count} surfaces that let 0.9 pass, limit {limit}: relative error of the light", error, at_most=1e-5
        )
        record.claim(f"{count} surfaces, limit {limit}: samples told as blocked", film.blocked_samples, at_most=0)
    for label, shader in (("Transparent", Transparent(1.0)), ("Principled", Principled(alpha=0.0))):
        film = _through(100, shader, 100)
        light = film.passes["Combined"][..., 0]
        record.claim(f"100 surfaces of {label}, alpha 0: error of the light", np.abs(light - 1).max(), at_most=0)
    for limit in (8, 64):
        film = _through(100, Transparent(1.0), limit)
        share = film.blocked_samples / (16 * 4)
        record.claim(f"100 surfaces, limit {limit}: light", film.passes["Combined"][..., 0].max(), at_most=0)
        record.claim(f"100 surfaces, limit {limit}: share of the samples that are told as blocked", share, at_least=1)
    sheets = _sheets(50, Transparent(0.9))
    ground = Instance(floor(), materials=(lambertian(1.0),))
    below = camera_down(0.1, (4, 4), height=0.005)
    sun = SunLight((0, 0, 1), (1, 1, 1))
    lit = picture(Scene(below, (ground, *sheets), (sun,)), transparent_bounces=64) * np.pi
    record.claim("sun through 50 surfaces: relative error", np.abs(lit / 0.9**50 - 1).max(), at_most=1e-5)


def _sheets(count: int, shader: Shader) -> tuple[Instance, ...]:
    """A stack of sheets, a centimetre from each other, the lowest at a height of one."""
    clear = (Material("", shader),)
    return tuple(Instance(floor(10.0, (0, 0, 0.01 * (k + 1))), materials=clear) for k in range(count))


def _through(count: int, shader: Shader, limit: int) -> Film:
    """A glowing floor, seen through a stack."""
    ground = Instance(floor(), materials=(Material("", Emission(1.0), sample_as_light=False),))
    scene = Scene(camera_down(0.1, (4, 4), height=4.0), (ground, *_sheets(count, shader)))
    return render(scene, RenderSettings(samples=4, transparent_bounces=limit))


def slab(low: float, high: float, index: float) -> Instance:
    """A plate of clear glass between two heights."""
    cube = box(1.0)
    corners = cube.vertices * (20, 20, 0) + np.where(cube.vertices[:, 2:] > 0, high, low) * (0, 0, 1)
    return Instance(
        Mesh("slab", corners.astype(np.float32), cube.triangles), materials=(Material("", Glass(1.0, 0.0, index)),)
    )


def look_aslant(instances: tuple[Instance, ...], height: float = 0.0, glow: Value = 1.0, **settings) -> np.ndarray:
    """What an orthographic camera sees at 45 degrees of a glowing floor, a metre below `height`."""
    ground = Instance(floor(50.0, (0, 0, height - 1)), materials=(Material("", Emission(glow), sample_as_light=False),))
    place = translation(0, -5, height + 5) @ rotation(0, math.pi / 4)
    camera = Camera(place, (8, 8), (-0.2, 0.2, -0.2, 0.2), orthographic=True, clip_start=0.0)
    return picture(Scene(camera, (ground, *instances)), **settings)


@case(
    "Sheets of glass down to micrometres",
    happens="A thin pane shows the world as from within glass: its second side is not found.",
    why="A ray starts a step off the surface that it leaves, so as not to hit it again: what is thinner is skipped.",
    rooks="Steps off by 2⁻¹⁹ of the coordinates that were rounded: finds both sides of a pane of 10⁻⁵ m a metre from "
    "the scene's middle, and of 10⁻³ m at a hundred. Of a thinner one it shows light that has passed one side, or, "
    "where both are rounded to one place, none.",
    instead="Panes of at least 10⁻⁵ of their distance from the scene's middle; thinner ones as a single sheet of "
    "Transparent and Glossy mixed.",
)
def thin_sheets(record: Record) -> None:
    """At 45° a side of index 1.5 reflects R = 0.0503; a pane with all reflections inside lets (1 − R) / (1 + R) pass.

    The standard error is below 0.001.
    """
    cosine, inside = math.sqrt(0.5), math.sqrt(1 - 0.5 / 1.5**2)
    across, within = (
        (cosine - 1.5 * inside) / (cosine + 1.5 * inside),
        (1.5 * cosine - inside) / (1.5 * cosine + inside),
    )
    reflected = (across**2 + within**2) / 2
    settings = {"samples": 1024, "sampler": "sobol_owen", "max_bounces": 24, "glossy_bounces": 24,
                "transmission_bounces": 24}  # fmt: skip
    far_below = Instance(box(), translation(9, 9, 0))  # keeps the middle of the world at height 0
    for height in (0.0, 1.0, 100.0):
        for thickness in (0.01, 1e-5 * max(height, 1.0)):
            seen = look_aslant((slab(height, height + thickness, 1.5), far_below), height, **settings)
            error = abs(seen.mean() / ((1 - reflected) / (1 + reflected)) - 1)
            record.claim(f"{thickness:g} m thick at {height:g} m: relative error of what passes", error, at_most=0.005)
    for thickness, passes in ((1e-6, 1 - reflected), (1e-7, 0.0)):
        seen = look_aslant((slab(1.0, 1.0 + thickness, 1.5), far_below), 1.0, **settings)
        record.claim(f"{thickness:g} m thick at 1 m: off from what passes one side, or none", abs(seen.mean() - passes),
                     at_most=0.005)  # fmt: skip


@case(
    "Glass in glass",
    happens="A drop in a glass, or a bubble in a ball: where two media meet, light bends by the wrong index.",
    why="A surface knows its own index only, as if air were on its other side.",
    rooks="Takes the index for that of the inside over the outside, as Cycles does: with n₂ / n₁ on the inner surface "
    "rays go as Snell has it, and with 1 / n₁ a bubble is air. In a white furnace nothing is lost.",
)
def glass_in_glass(record: Record) -> None:
    """A ray that crosses plates moves along the floor by Σ thickness × (tan 45° − tan θ), sin θ = sin 45° / index."""
    straight = {"max_bounces": 12, "glossy_bounces": 0}
    place = Math("add", Component(OBJECT, 1), 1.0)
    for inner in (2.0, 1.0, 1.2):
        plates = (slab(0.0, 0.4, 1.5), slab(0.1, 0.3, inner / 1.5))
        # The same light, weighted with the place and not: its mean place, whatever share of it passes.
        weighted, light = (look_aslant(plates, glow=glow, sampler="regular", **straight) for glow in (place, 1.0))
        before = look_aslant((), glow=place, sampler="regular")
        moved = sum(t * (1 - math.tan(math.asin(math.sqrt(0.5) / n))) for t, n in ((0.2, 1.5), (0.2, inner)))
        error = abs(before.mean() - weighted.sum() / light.sum() - moved)
        record.claim(f"index {inner:g} in 1.5, moved by {moved:.4f} m: error in metres", error, at_most=2e-3)
    for depth in (1, 4):
        balls = tuple(_ball(1.0 - 0.2 * k, (1.5, 1 / 1.5)[k % 2]) for k in range(depth))
        scene = Scene(camera_down(1.0, (8, 8), height=5.0), balls, world=(1.0, 1.0, 1.0))
        white = picture(scene, samples=256, max_bounces=64, glossy_bounces=64, transmission_bounces=64)
        record.claim(f"{depth} balls in each other in a white furnace: error", abs(white.mean() - 1), at_most=0.005)


def _ball(radius: float, index: float) -> Instance:
    return Instance(sphere(radius, rings=32, smooth=True), materials=(Material("", Glass(1.0, 0.0, index)),))
