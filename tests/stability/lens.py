"""Lenses: apertures and focus distances at their limits, and what stands in the lens's way."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from core import SAMPLERS, AreaLight, Camera, Instance, RenderSettings, Scene, SceneError, render
from tests.scenes import (
    camera_down,
    camera_forward,
    emitter,
    estimate,
    floor,
    picture,
    pixel_centers,
    polygon,
    quad,
    rotation,
    sphere,
)

from .case import Record, case

GLOW = (emitter(),)
PIXELS = 16


@case(
    "An aperture of 0",
    happens="Without an aperture there is no lens to sample; one of almost nothing has to show the same.",
    why="A pinhole is a code path of its own, and could use other points, or a focus distance that has no meaning.",
    rooks="Takes no points for a pinhole's lens. The lens's points are of a dimension of their own: all others stay.",
)
def aperture_of_nothing(record: Record) -> None:
    ball, ground = sphere(0.5, (0.1, 0.2, -2)), quad((0, -1, -3), (9, 0, 0), (0, 0, -9))
    scene = Scene(
        camera_forward(0.5, (32, 32)),
        (Instance(ball), Instance(ground)),
        (AreaLight((1, 2, -1), (1, 0, 0), (0, 1, 0), (50, 50, 50)),),
    )
    pinhole = picture(scene, channel=None)
    for radius, focus in ((0.0, 1.0), (0.0, 0.0), (0.0, math.nan), (1e-30, 2.0)):
        lens = replace(scene.camera, lens_radius=radius, focus_distance=focus)
        found = picture(replace(scene, camera=lens), channel=None)
        differ = int((found != pinhole).any(axis=2).sum())
        record.claim(
            f"aperture {2 * radius:g} m, focus {focus:g} m: pixels that are not the pinhole's", differ, at_most=0
        )


@case(
    "Blur from a millimetre to a thousand kilometres",
    happens="A spot at the depth z blurs to a disk; its size goes wrong, or its light gets lost.",
    why="What a lens of radius A focused at f does is A |1/f − 1/z|: a difference of numbers far from each other.",
    rooks="Bends the ray by A / f at the lens and keeps the pinhole's direction apart from it: no difference is taken.",
)
def blur_of_any_lens(record: Record) -> None:
    """The variance of a uniform disk of radius r along an axis is r²/4, and its light that of the spot.

    Some 75 000 hits measure either: the variance to a standard error of 0.004 or less, the light to less than that.
    """
    lenses = (
        (0.1, 3.0, 1.0), (0.001, 0.1, 1.0), (5.0, 3.0, 1.0), (25.0, 10.0, 2.0), (1.0, 1e6, 1.0), (1.0, 1e6, 1e7),
        (1.0, math.inf, 10.0), (2500.0, 1e-5, 1.0),
    )  # fmt: skip
    for lens, focus, depth in lenses:
        far_off = focus > 1e3 or lens > 1e3
        kinds = {"perspective": False} if far_off else {"perspective": False, "orthographic": True}
        for kind, orthographic in kinds.items():
            size, light = _measure_disk(lens, focus, depth, orthographic)
            what = f"{kind}, aperture {2 * lens:g} m, focus {focus:g} m, spot at {depth:g} m"
            record.claim(f"{what}: relative error of the disk", max(abs(size - 1), abs(light - 1)), at_most=0.02)


def _measure_disk(lens: float, focus: float, depth: float, orthographic: bool) -> tuple[float, float]:
    """(variance along x over r²/4, light over the spot's) of the disk that a square spot on the axis blurs to."""
    radius = lens * (abs(1 - depth / focus) if orthographic else abs(1 / focus - 1 / depth))
    more = {"lens_radius": lens, "focus_distance": focus}
    width, spot = 3.0 * radius, 0.8 * radius
    camera = (camera_down(width, (PIXELS, PIXELS), height=depth, **more) if orthographic
              else camera_forward(width / 2, (PIXELS, PIXELS), **more))  # fmt: skip
    seen = _mean_picture(Scene(camera, (_spot(camera, depth, spot * (1 if orthographic else depth)),)))
    x, _ = pixel_centers(camera)
    widened = (spot**2 + (width / PIXELS) ** 2) / 12  # by the spot itself, and by the pixels
    variance = (seen * x**2).sum() / seen.sum() - widened
    return float(variance / (radius**2 / 4)), float(seen.sum() * (width / PIXELS / spot) ** 2)


def _spot(camera: Camera, depth: float, edge: float) -> Instance:
    """A glowing square on the camera's axis."""
    place = camera.matrix[2, 3] - depth
    return Instance(quad((0, 0, place), (edge, 0, 0), (0, edge, 0)), materials=GLOW)


def _mean_picture(scene: Scene) -> np.ndarray:
    return np.mean([picture(scene, seed=seed, samples=1024, sampler="sobol_owen") for seed in range(4)], axis=0)


@case(
    "Focus from a centimetre to infinity",
    happens="What lies in focus is soft, or shifted by parts of a pixel.",
    why="All rays of a point in the window have to meet on the plane in focus, which the lens's radius divides by.",
    rooks="Keeps an edge on that plane sharp to the sample. A focus that is not in front of the camera is refused.",
)
def focus_at_its_limits(record: Record) -> None:
    for lens, focus in ((0.1, 0.01), (0.1, 1e6), (5.0, 3.0), (25.0, 1.0), (2500.0, 1e6)):
        wrong = max(_wrong_share(lens, focus, turn) for turn in (0.0, 0.3))
        record.claim(f"aperture {2 * lens:g} m, focus {focus:g} m: largest error of a pixel", wrong, at_most=0)
    stars = Scene(
        camera_forward(0.5, (8, 8), lens_radius=1.0, focus_distance=math.inf, clip_end=1e12),
        (_half_plane(camera_forward(0.5, (8, 8)), 1e9),),
    )
    sharp = np.broadcast_to(np.arange(8) < 5, (8, 8))
    record.claim("focus at infinity, edge at 10⁹ m: largest error", np.abs(picture(stars) - sharp).max(), at_most=0)
    refused = [_is_refused(focus) for focus in (0.0, -1.0, math.nan)]
    record.claim("focuses at 0, behind the camera or nowhere that are refused, of 3", sum(refused), at_least=3)


def _half_plane(camera: Camera, depth: float) -> Instance:
    """At this depth, so that it covers the left five of the eight columns of the camera's pixels."""
    local = np.array([(-2, -2, -1), (0.125, -2, -1), (0.125, 2, -1), (-2, 2, -1)]) * depth
    return Instance(polygon(local @ camera.matrix[:3, :3].T), materials=GLOW)


def _wrong_share(lens: float, focus: float, turn: float) -> float:
    """The largest error of a pixel that sees an edge in focus, which lies between two pixels."""
    camera = camera_forward(0.5, (8, 8), lens_radius=lens, focus_distance=focus)
    camera = replace(camera, matrix=rotation(1, turn) @ rotation(0, turn))
    seen = picture(Scene(camera, (_half_plane(camera, focus),)), samples=64, sampler="jittered")
    return float(np.abs(seen - (np.arange(8) < 5)).max())


def _is_refused(focus: float) -> bool:
    camera = camera_forward(0.5, (8, 8), lens_radius=0.1, focus_distance=focus)
    try:
        render(Scene(camera, (Instance(floor()),)), RenderSettings(samples=1))
    except SceneError:
        return True
    return False


@case(
    "Blades and squeezed lenses",
    happens="A polygon of blades is too dark, not evenly filled, or not the shape that was asked for.",
    why="The square of sample points has to be mapped to the polygon with its area kept.",
    rooks="Gives each blade its share of the square (`warps.square_to_polygon`), and keeps the light of a disk.",
)
def blades_of_the_aperture(record: Record) -> None:
    """The variance of a regular n-gon of circumradius r along an axis is r² (2 + cos 2π/n) / 12.

    As in `blur_of_any_lens`, the standard errors are below 0.004.
    """
    for blades, ratio in ((0, 1.0), (3, 1.0), (5, 1.0), (16, 1.0), (100, 1.0), (6, 0.01), (6, 100.0)):
        variances, light = _measure_aperture(blades, ratio)
        closed = 0.25 if blades == 0 else (2 + math.cos(2 * math.pi / blades)) / 12
        worst = max(abs(light - 1), *(abs(variance / closed - 1) for variance in variances))
        record.claim(f"{blades or 'no'} blades, ratio {ratio:g}: relative error of the shape", worst, at_most=0.02)
    for label, blades, ratio in (("disk", 0, 1.0), ("five blades", 5, 1.0), ("ratio 2", 0, 2.0)):
        camera = _lens_camera(1.1, 1.1, 120, aperture_blades=blades, aperture_ratio=ratio)
        shape = picture(Scene(camera, (_spot(camera, 2.0, 0.1),)), samples=256)
        record.show(label, np.repeat(shape[..., None] / np.percentile(shape, 99), 3, axis=2))


def _lens_camera(half_x: float, half_y: float, pixels: int, **more) -> Camera:
    """Focused at 1 m: a spot at 2 m shows the lens, of radius 1 m, in the window at half its size."""
    window = (-half_x / 2, half_x / 2, -half_y / 2, half_y / 2)
    return Camera(np.eye(4), (pixels, pixels), window, clip_start=0.0, lens_radius=1.0, focus_distance=1.0, **more)


def _measure_aperture(blades: int, ratio: float) -> tuple[tuple[float, float], float]:
    """(variances along x, unsqueezed, and y of the aperture's picture, its light over the spot's)."""
    half_x, half_y, wide, high = 1.4 / ratio, 1.4, 0.5 / ratio, 0.5
    camera = _lens_camera(half_x, half_y, PIXELS, aperture_blades=blades, aperture_ratio=ratio)
    spot = Instance(quad((0, 0, -2), (wide, 0, 0), (0, high, 0)), materials=GLOW)
    seen = _mean_picture(Scene(camera, (spot,)))
    x, y = pixel_centers(camera)
    total, widened = seen.sum(), (high**2 + (2 * half_y / PIXELS) ** 2) / 12
    variances = [float((seen * (2 * place) ** 2).sum() / total - widened) for place in (x * ratio, y)]
    return (variances[0], variances[1]), float(total * (2 * half_x / PIXELS) * (2 * half_y / PIXELS) / (wide * high))


@case(
    "A blurred spot, sampler by sampler",
    happens="A small bright spot out of focus shows as a pattern of spots, or as noise, and not as an even disk.",
    why="Each pixel of the disk finds the spot through its own small part of the lens: it needs points there.",
    rooks="Gives each pixel points of its own. Regular and Hammersley points are the same in all of them, in another "
    "order: they show copies of the spot.",
    instead="A sampler with chance in it: its noise halves with four times the samples, or in the mean of four seeds.",
)
def blurred_spot_by_sampler(record: Record) -> None:
    """The error in the middle of the disk, of which each pixel should show the same light; what of it seeds share."""
    density = (0.1 / 2) ** 2 / (math.pi / 4)
    for name, sampler in SAMPLERS.items():
        seen = [_spot_out_of_focus(name, samples=256, seed=seed, border=(48, 48, 72, 72)) for seed in range(4)]
        error = np.mean([_spread(one, density) for one in seen])
        left = float(_spread(np.mean(seen, axis=0), density) / error)
        record.samplers[name] = f"error {error:.2f} of the light, {left:.2f} of that in the mean of four seeds"
        bounds = {"at_least": 0.7} if name in ("regular", "hammersley") else {"at_least": 0.4, "at_most": 0.6}
        record.claim(f"{sampler.label}: share of the error in the mean of four seeds", left, **bounds)
        if name in ("regular", "random", "multi_jittered"):
            shown = _spot_out_of_focus(name, samples=64)
            record.show(sampler.label, np.repeat(shown[..., None] / (4 * density), 3, axis=2))


def _spot_out_of_focus(sampler: str, **settings) -> np.ndarray:
    camera = _lens_camera(1.2, 1.2, 120)
    return picture(Scene(camera, (_spot(camera, 2.0, 0.1),)), sampler=sampler, **settings)


def _spread(seen: np.ndarray, expected: float) -> float:
    """The root mean square of the relative error."""
    return float(np.sqrt(np.mean((seen / expected - 1) ** 2)))


@case(
    "A lens inside of something",
    happens="A lens of metres, or one that stands in a wall: some of its points lie inside of an object.",
    why="A ray starts on the lens, not in the middle of the camera, and sees what lies before its own start.",
    rooks="Sees the object's inside from there: each point of the lens sees what a pinhole at that point would.",
)
def lens_inside_an_object(record: Record) -> None:
    """Of a lens of radius a in the middle of a sphere of radius r, parallel rays see its inside from r²/a² of it."""
    for radius, lens in ((0.5, 1.0), (0.5, 5.0)):
        camera = camera_down(0.01, (8, 8), height=0.0, lens_radius=lens, focus_distance=1e9)
        ball = sphere(radius, rings=64)
        scene = Scene(camera, (Instance(ball, materials=GLOW),))
        share = estimate(lambda seed, s=scene: picture(s, seed=seed, samples=1024).mean(), seeds=8)
        # The ball is a polyhedron of 128 corners around, whose outline is a polygon.
        outline = 64 / math.pi * math.sin(math.pi / 64) * (radius / lens) ** 2
        # Exceeded by chance once in 2000 (Student's t with 7 degrees of freedom).
        record.claim(f"sphere of {radius} m, lens of {lens} m: standard errors off the closed form",
                     abs(share.mean - outline) / share.error, at_most=6)  # fmt: skip


@case(
    "What Blender's camera can be set to",
    happens="An f-stop of 0, a focus object behind the camera, a shift of a million: a black picture, or a traceback.",
    why="Blender keeps hardly any of these from being set; the renderer divides by most of them.",
    rooks="Takes what Cycles takes (f-stop and focus distance are at least 10⁻⁵, a focus object counts by its "
    "distance), and refuses in one line, with the camera's name, what has no picture.",
    samplers="Compared with Cycles with the default, Multi-Jittered; a blurred spot, above, is there for each of them.",
    is_slow=True,
)
def cameras_of_blender(record: Record) -> None:
    """Three glowing squares before a dim world: the means of the pictures of both engines.

    At an f-stop of 0 the lens's radius is 2.5 km, and Cycles loses most of what is in focus: there the closed form is
    the share of the picture that the square in focus has, 0.5 m at 5 m.
    """
    from core import SceneError as Refused
    from tests import addon_helpers, cycles_helpers

    for label, change in CAMERAS.items():
        scene = _squares(addon_helpers, change)
        with TemporaryDirectory() as folder:
            of = cycles_helpers.pictures(scene, Path(folder), samples=64, seeds=4)
        (ours, theirs), means = of.values(), {engine: seen.mean(axis=(1, 2, 3)) for engine, seen in of.items()}
        error = math.sqrt(sum(mean.var(ddof=1) / len(mean) for mean in means.values()))
        off = abs(ours.mean() - theirs.mean()) / max(error, 1e-5 * theirs.mean())
        # Exceeded by chance once in 700 (Student's t with 6 degrees of freedom).
        record.claim(f"{label}: standard errors between the means of Rooks and Cycles", off, at_most=5)
    _squares(addon_helpers, _blender_camera(dof_aperture_fstop=0.0))
    seen = picture(addon_helpers.export()[0], samples=1024)
    share = 0.5**2 / ((5.0 * 36 / 50) ** 2 * 24 / 32)
    record.claim("f-stop 0: relative error of the light", abs(seen.mean() / (0.1 + 4.9 * share) - 1), at_most=0.005)
    for label, change, word in REFUSED_CAMERAS:
        _squares(addon_helpers, change)
        try:
            render(addon_helpers.export()[0], RenderSettings(samples=1))
            text = ""
        except Refused as error:
            text = str(error)
        named = "'Camera'" in text and word in text and "\n" not in text
        record.claim(f"{label}: one line that names the camera and the {word}", int(named), at_least=1)


def _blender_camera(**of_lens) -> dict:
    """Properties of the camera's data, those of its depth of field with a leading dof_."""
    return {"dof_use_dof": True, "dof_focus_distance": 5.0} | of_lens


CAMERAS = {
    "f-stop 0.001": _blender_camera(dof_aperture_fstop=0.001),
    "f-stop 0.01, focus at 0": _blender_camera(dof_aperture_fstop=0.01, dof_focus_distance=0.0),
    "f-stop 0.01, focus at 10⁶ m": _blender_camera(dof_aperture_fstop=0.01, dof_focus_distance=1e6),
    "focus object 5 m behind the camera": _blender_camera(dof_aperture_fstop=0.05, dof_focus_object=(0, 0, 15)),
    "focal length 1 mm": _blender_camera(lens=1.0, dof_aperture_fstop=0.01),
    "focal length 10 m": _blender_camera(lens=1e4, dof_aperture_fstop=64.0),
    "sensor of 1 mm": _blender_camera(sensor_width=1.0, dof_aperture_fstop=0.1),
    "orthographic, f-stop 0.5, 3 blades": _blender_camera(type="ORTHO", dof_aperture_fstop=0.5, dof_aperture_blades=3),
    "ratio 100": _blender_camera(dof_aperture_fstop=0.02, dof_aperture_ratio=100.0),
    "clip start at 8 m": _blender_camera(dof_aperture_fstop=0.05, clip_start=8.0),
}
REFUSED_CAMERAS = (
    ("clip start beyond clip end", {"clip_start": 10.0, "clip_end": 1.0}, "clip start"),
    ("clip start and end at 0", {"clip_start": 0.0, "clip_end": 0.0}, "clip start"),
    ("orthographic scale 0", {"type": "ORTHO", "ortho_scale": 0.0}, "scale"),
    ("shift of a million", {"shift_x": 1e6}, "shift"),
    ("shift of 10³⁰", {"shift_x": 1e30}, "window"),
)


def _squares(addon_helpers, change: dict):
    """The scene of `cameras_of_blender`, set up for a comparison, with its camera changed."""
    import bpy

    from tests.test_materials_against_cycles import set_up_engines

    scene = addon_helpers.empty_scene(32, 24)
    set_up_engines(scene)
    scene.world = bpy.data.worlds.new("World")
    scene.world.color = (0.1, 0.1, 0.1)
    # The first square's edge is in sight however narrow the view is.
    for x, depth, size, strength in ((0.245, 5.0, 0.5, 5.0), (-1.0, 3.0, 1.0, 1.0), (2.0, 12.0, 2.0, 2.0)):
        paint, _ = addon_helpers.shader("ShaderNodeEmission", Strength=strength)
        paint.cycles.emission_sampling = "NONE"
        square = addon_helpers.quad(size=size, location=(x, 0, 10 - depth))
        square.data.materials.append(paint)
    camera = scene.camera.data
    for name, value in change.items():
        owner, name = (camera.dof, name[4:]) if name.startswith("dof_") else (camera, name)
        if name == "focus_object":
            value = addon_helpers.add("Focus", None, location=value)
        setattr(owner, name, value)
    bpy.context.view_layer.update()
    return scene
