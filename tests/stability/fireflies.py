"""Fireflies: pixels that are far too bright, where they come from, and what clamping them costs."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg

from core import SAMPLERS, Instance, Material, PointLight, Scene
from core.lab import style
from core.lab.scenes import LIGHT_RADIANCE, box, hemisphere
from core.scene import VISIBLE_TO_SHADOWS, VISIBLE_TO_SURFACES
from core.shaders import Emission, Glass, Glossy, MixShader, Shader, Transparent
from core.values import Fresnel
from tests.scenes import WHITE, Estimate, camera_down, floor, irradiance, picture, quad, sphere

from .case import Record, case

#: The metres of a lamp above a floor, the thickness of a pane of glass between them, and its index of refraction.
HEIGHT, THICKNESS, IOR = 2.0, 0.02, 1.5
#: As many bounces as light needs through glass, and one off the floor.
PATHS = {"max_bounces": 12, "glossy_bounces": 12, "diffuse_bounces": 1}


@case(
    "A small lamp behind glass",
    happens="What is behind glass is black, or the glass's caustic is a few pixels that are far too bright.",
    why="Glass bends light, so that a light sample ends there and sees a shadow. Only rays that scatter off the floor, "
    "go through the glass and happen to meet the lamp bring light. They never meet a point, and a lamp that fills the "
    "share p of the sky once in 1/p rays, each as bright as 1/p.",
    rooks="Shows the light of lamps that have a size, right on average. That of points and of suns without size is not "
    "there.",
    instead="A larger lamp; for panes a mix of Transparent and Glossy by Fresnel, through which light samples pass",
)
def lamp_behind_glass(record: Record) -> None:
    """Light straight through a pane: 2n/(n² + 1) of it with all reflections inside, (1 - F)² without."""
    record.claim("light of a point through Glass", float(_under_pane(Glass(ior=IOR), 0.0, **PATHS).mean), at_most=0)
    # Through the pane the lamp looks nearer by its thickness × (1 - 1/n).
    near = (HEIGHT / (HEIGHT - THICKNESS * (1 - 1 / IOR))) ** 2
    found = _under_pane(Glass(ior=IOR), 0.6, **PATHS)
    expected = near * 2 * IOR / (IOR**2 + 1)
    off = abs(float(found.mean) - expected)
    record.claim("light of a ball of 0.6 m through Glass, off by", off, at_most=4 * float(found.error) + 1e-3)
    window = MixShader(Fresnel(IOR), Transparent(), Glossy(roughness=0.0))
    off = abs(float(_under_pane(window, 0.0).mean) - (1 - ((IOR - 1) / (IOR + 1)) ** 2) ** 2)
    record.claim("light of a point through the mix, off by", off, at_most=1e-3)
    for radius in (0.0, 0.1, 0.3):
        record.show(f"a glass ball, lamp of {radius:g} m", _caustic(radius))


def _under_pane(surface: Shader, radius: float, **settings) -> Estimate:
    """The irradiance straight below a lamp, a pane half-way up, over that without the pane."""
    material = (Material("pane", surface),)
    panes = (
        Instance(quad((0, 0, z), (4, 0, 0), (0, turn * 4, 0)), materials=material, visibility=_NOT_TO_CAMERA)
        for z, turn in ((1.0 + THICKNESS, 1), (1.0, -1))
    )
    lamp = PointLight((0, 0, HEIGHT), (4 * math.pi * HEIGHT**2,) * 3, radius)
    return irradiance([lamp], instances=tuple(panes), **settings)


_NOT_TO_CAMERA = VISIBLE_TO_SURFACES | VISIBLE_TO_SHADOWS


def _caustic(radius: float, samples: int = 64, **settings) -> np.ndarray:
    """A glass ball's caustic on a floor, seen from above through the ball: (80, 80, 3)."""
    glass = (Material("glass", Glass(ior=IOR)),)
    ball = Instance(sphere(0.5, (0, 0, 0.8), rings=32, smooth=True), materials=glass, visibility=_NOT_TO_CAMERA)
    lamp = PointLight((0.8, 0, 3), (150.0,) * 3, radius)
    camera = camera_down(2.4, (80, 80), (-0.2, 0, 0), 0.2)
    scene = Scene(camera, (Instance(floor(), materials=(WHITE,)), ball), (lamp,))
    return picture(scene, channel=None, **{"samples": samples} | PATHS | settings)[..., :3]


#: `clamped`: the radiance of what a path can meet, and the values that it is clamped to.
RADIANCE, CLAMPS = 8.0, (0.0, 16.0, 8.0, 4.0, 2.0, 1.0)


@case(
    "What clamping costs",
    happens="The picture is darker than it should be, at any number of samples, where light is hard to find.",
    why="Clamping cuts off what bright samples are above it: a bias. Of light that a path meets rarely, of a radiance "
    "L, the clamp c leaves c/L, and c/L of its noise.",
    rooks="Clamps bounced light only, and only if Clamp Indirect is set; 0, the default, is off.",
    instead="More samples; a larger lamp; light that is sampled in place of found by chance",
)
def clamped(record: Record) -> None:
    """A mirror shows a ceiling that is lit by a panel which only rays off the ceiling find: all light is bounced."""
    pictures = {clamp: _panel_by_chance(clamp_indirect=clamp) for clamp in CLAMPS}
    free = pictures[0.0]
    record.claim("light without a clamp", float(free.mean()), at_least=0.1)
    off = []
    for clamp in CLAMPS[1:]:
        kept = min(clamp / RADIANCE, 1.0)
        darker = 1 - float(pictures[clamp].mean() / free.mean())
        off.append(abs(float(pictures[clamp].std() / free.std()) - kept))
        what = f"darker by, clamped to {clamp / RADIANCE:g} of the radiance"
        record.claim(what, darker, at_least=1 - kept - 1e-4, at_most=1 - kept + 1e-4)
    record.claim("noise that is left, off from c/L by", max(off), at_most=1e-4)


def _panel_by_chance(**settings) -> np.ndarray:
    mirror = Material("mirror", Glossy((1.0, 1.0, 1.0), 0.0))
    glow = Material("glow", Emission((1.0, 1.0, 1.0), RADIANCE), sample_as_light=False)
    instances = (
        Instance(quad((0, 0, 0), (0.2, 0, 0), (0, 0.2, 0)), materials=(mirror,)),
        Instance(quad((0, 0, 1), (9, 0, 0), (0, -9, 0)), materials=(WHITE,)),
        Instance(quad((1, 0, 0), (1, 0, 0), (0, 1, 0)), materials=(glow,)),
    )
    scene = Scene(camera_down(0.1, (32, 32), height=0.5), instances)
    return picture(scene, max_bounces=2, sampler="random", **settings)


#: Where the light is that a ball of glass gathers in its own shadow, and the values that it is clamped to.
CAUSTIC, CAUSTIC_CLAMPS = (28, 24, 60, 56), (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


@case(
    "Clamping a caustic",
    happens="Fireflies go, and so does the light that they are.",
    why="As above. With few samples the bias can be less than the noise that it saves; with many it is what is left.",
    rooks="Clamps only when told to, and the setting's tooltip says that it is a bias.",
    samplers="Tried with the default, Multi-Jittered; the next row has the caustic's brightest pixel with each.",
    instead="More samples, or a larger lamp",
    is_slow=True,
)
def clamped_caustic(record: Record) -> None:
    """How much darker a caustic gets by the clamp's value, and how its error changes with few and many samples."""
    truth = _caustic(0.3, 4096, sampler="sobol_owen", seed=9, border=CAUSTIC)
    few, many = (
        [_caustic(0.3, samples, clamp_indirect=clamp, border=CAUSTIC) for clamp in (*CAUSTIC_CLAMPS, 0.0)]
        for samples in (16, 256)
    )
    brighter = sum(int((less > more + 1e-5).sum()) for less, more in pairwise(many))
    record.claim("pixels that a smaller clamp makes brighter", brighter, at_most=0)
    darker = [1 - float(seen.mean() / many[-1].mean()) for seen in many]
    record.claim(f"darker by, at {CAUSTIC_CLAMPS[0]:g}", darker[0], at_least=0.5)
    record.claim("smallest step of that to the next clamp", min(a - b for a, b in pairwise(darker)), at_least=-1e-6)
    for clamp, share in zip(CAUSTIC_CLAMPS[1:], darker[1:], strict=False):
        record.claim(f"darker by, at {clamp:g}", share, at_least=-1e-6, at_most=darker[0])
    errors = [np.array([_rmse(seen, truth) for seen in series]) for series in (few, many)]
    relative = [series / series[-1] for series in errors]
    record.claim(
        "error at 16 samples with the best clamp, over that without", float(relative[0][:-1].min()), at_most=0.95
    )
    record.claim("error at 256 samples with the smallest", float(relative[1][0]), at_least=1.1)
    record.show("no clamp", np.kron(few[-1] / 8, np.ones((4, 4, 1))))
    record.show("clamped to 8", np.kron(few[3] / 8, np.ones((4, 4, 1))))
    record.show("by the clamp's value", _chart(darker[:-1], *(series[:-1] for series in relative)))


def _rmse(seen: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(((seen - truth) ** 2).mean()))


def _chart(darker: list[float], few: np.ndarray, many: np.ndarray) -> np.ndarray:
    """What a clamp takes of the light, and the error that it leaves, as a linear picture."""
    with style.drawing():
        figure = style.figure(8.5, 5)
        axes = figure.subplots()
        axes.semilogx(CAUSTIC_CLAMPS, darker, "-s", color=style.INK, label="light that is lost")
        axes.semilogx(CAUSTIC_CLAMPS, few, "--o", color=style.COLORS[2], label="error, 16 samples")
        axes.semilogx(CAUSTIC_CLAMPS, many, "-.^", color=style.COLORS[6], label="error, 256 samples")
        axes.set(xlabel="clamp", ylabel="over no clamp's", xticks=CAUSTIC_CLAMPS, xticklabels=CAUSTIC_CLAMPS, ylim=0)
        axes.minorticks_off()
        axes.legend()
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        shown = np.asarray(canvas.buffer_rgba())[::-1, :, :3] / 255
    return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


@case(
    "The brightest pixel",
    happens="Single pixels far brighter than all about them.",
    why="A sample's value is the light that it finds over the chance of finding it. It has no bound where that chance "
    "can be small and the light is not: small lamps behind glass.",
    rooks="Samples every lamp, glowing mesh and the world, and the directions by the BSDF, so that light off matt "
    "surfaces has a bound. Which sampler is chosen matters little to fireflies: they are rare.",
    instead="A larger lamp, or Clamp Indirect, at its price",
)
def brightest_pixel(record: Record) -> None:
    """The largest pixel over the mean at 16 samples: a panel met by chance, a room with bounces, a glass ball."""
    samples, radius = 16, 0.1
    one_hit = 150.0 / (4 * math.pi**2 * radius**2) / samples
    largest, least = {"panel": 0.0, "room": 0.0}, math.inf
    for name in SAMPLERS:
        panel = picture(hemisphere((48, 48)), samples=samples, sampler=name)
        room = picture(box((48, 48)), samples=samples, sampler=name, max_bounces=4)
        caustic = _caustic(radius, samples, sampler=name)[..., 0]
        largest["panel"] = max(largest["panel"], float(panel.max()) / LIGHT_RADIANCE)
        largest["room"] = max(largest["room"], float(room.max()) / ROOM_BOUND)
        least = min(least, float(caustic.max()) / one_hit)
        ratios = (
            f"{what} {seen.max() / seen.mean():.1f}"
            for what, seen in (("panel", panel), ("room", room), ("glass ball", caustic))
        )
        record.samplers[name] = ", ".join(ratios)
    record.claim("largest pixel of the panel's light, over the bound", largest["panel"], at_most=1 + 1e-5)
    record.claim("of the room, over the bound", largest["room"], at_most=1)
    record.claim("smallest largest pixel of the glass ball, over one ray that meets the lamp", least, at_least=0.99)


#: In `scenes.box` nothing lit is closer to the lamp, ½ m square of radiance 12/(π ¼), than its walls, 0.65 m: a light
#: sample brings at most L A/(π d²), and a path with 4 bounces off walls of albedo ¾ five of them.
ROOM_BOUND = 12 / (math.pi * 0.25) * 0.25 / (math.pi * 0.65**2) * sum(0.75**k for k in range(1, 6))
