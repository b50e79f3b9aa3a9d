"""Lights: at the limits of size, distance, angle and power, and where sampling them by area fails."""

from __future__ import annotations

import math

import numpy as np

from core import AreaLight, Instance, Material, PointLight, Scene, SpotLight, SunLight
from core.scene import VISIBLE_TO_ALL, VISIBLE_TO_CAMERA, Light
from core.shaders import Glossy
from tests.scenes import WHITE, Estimate, camera_down, emitter, floor, irradiance, picture, quad

from .case import Record, case

#: Of a lamp above the floor, in m.
HEIGHTS = (1.0, 0.7, 0.5, 0.3, 0.2, 0.1, 1e-2, 1e-4)
#: Below a lamp's middle, 0.1 or 0.2 m above, where it is not yet half of all directions.
MOST_DEVIATION = 0.3
#: Where all samples of a lamp count the same, this is left of their deviation by rounding.
ROUNDING = 1e-5


def square_lamp(
    size: float, height: float, shape: str = "rectangle", power: float = 1.0, at: tuple[float, float] = (0.0, 0.0)
) -> AreaLight:
    """A square or a disk that looks down from above the origin, or another point of the floor."""
    return AreaLight((*at, height), (size, 0.0, 0.0), (0.0, size, 0.0), (power,) * 3, shape)


def below_square(half: float, height: float) -> float:
    """The irradiance below the middle of a square of radiance 1 (Lambert 1760)."""
    slant = math.hypot(half, height)
    return 4 * half / slant * math.atan(half / slant)


def off(found: Estimate, expected: float) -> float:
    """The relative error of a mean, less three standard errors of it."""
    return max(abs(float(found.mean) - expected) - 3 * float(found.error), 0) / expected


def deviation(scene: Scene, samples: int = 16) -> float:
    """The relative standard deviation of single random samples, from the spread of the pixels of an even picture."""
    values = picture(scene, samples=samples, sampler="random", threads=0)
    return float(values.std() / values.mean() * math.sqrt(samples))


def glowing_panel(height: float, size: float = 1.0) -> Instance:
    """A square of radiance 1 above the origin, which the camera does not see."""
    square = quad((0, 0, height), (size, 0, 0), (0, size, 0))
    return Instance(square, materials=(emitter(1.0),), visibility=VISIBLE_TO_ALL & ~VISIBLE_TO_CAMERA)


def even_floor(lights: tuple = (), instances: tuple[Instance, ...] = (), material: Material = WHITE) -> Scene:
    """A spot of floor below the origin so small that all its pixels have the same brightness."""
    return Scene(camera_down(1e-6, (64, 64)), (Instance(floor(0.01), materials=(material,)), *instances), lights)


@case(
    "A sun of no and of any angle",
    happens="The sun's disk is a point, or half the sky.",
    why="1 − cos θ loses all digits in float32 at a small angle; the radiance of a disk without size is infinite.",
    rooks="Samples the disk by its solid angle, computed as s²/(1 + c); a sun of angle 0 is a direction.",
)
def sun_of_any_angle(record: Record) -> None:
    """The irradiance that a sun's strength means is that of its middle, cos θ, at every angle below the horizon's."""
    for degrees in (0.0, 1e-4, 0.01, 0.526, 30.0, 180.0):
        sun = SunLight((0.0, 0.0, 1.0), (1.0, 1.0, 1.0), math.radians(degrees))
        record.claim(f"relative error at {degrees:g}°", off(irradiance([sun], samples=64, seeds=8), 1.0), at_most=1e-4)


@case(
    "An area light of almost no and of enormous size",
    happens="The light is 10⁻⁶ m or 10⁶ m wide.",
    why="Areas are squares: 10⁻¹² and 10¹² m² leave little of float32's range, and of 10¹² m² that are sampled evenly "
    "no point falls where the light is near.",
    rooks="Samples a light by its solid angle from within its diagonal (Peters 2021).",
)
def area_light_of_any_size(record: Record) -> None:
    for size in (1e-6, 1e-3, 1.0, 1e3, 1e6):
        expected = below_square(size / 2, 1.0) / size**2 / math.pi
        found = irradiance([square_lamp(size, 1.0)], samples=64, seeds=8)
        record.claim(f"relative error at {size:g} m", off(found, expected), at_most=1e-4)


@case(
    "Disks, spheres, spots and glowing meshes of almost no and of enormous size",
    happens="As for area lights: black, or infinitely bright.",
    why="A sphere's cone has 1 − cos = 10⁻¹² or a sine that rounds to 1; float32 has steps of 6 cm at 10⁶ m.",
    rooks="Sines come from squares of lengths, 1 − cos from sines, and both keep their digits at either end.",
)
def lamps_of_any_size(record: Record) -> None:
    """So wide, 1 m above the floor: a sphere's lower end, the others' middle. And in a sphere, half its radius off."""
    for size in (1e-6, 1e-3, 1.0, 1e3, 1e6):
        radius, power = size / 2, (1.0, 1.0, 1.0)
        middle = radius + 1
        # A lamp that shows a disk of this radius has the radiance P / (π² r²), a sphere and a soft lamp 1/4 of that.
        of_lamp = 1 / (2 * math.pi * radius) ** 2
        square_of_sine = radius**2 / (radius**2 + 1)
        lamps: dict[str, tuple[Light, float]] = {
            "disk": (square_lamp(size, 1.0, "ellipse"), 4 * of_lamp * math.pi * square_of_sine),
            "sphere": (PointLight((0, 0, middle), power, radius), 1 / (4 * math.pi * middle**2)),
            "soft lamp": (PointLight((0, 0, 1), power, radius, True), of_lamp * math.pi * square_of_sine),
            # Light comes from within 45° of the spot's axis only, however wide it is.
            "soft spot of 90°": (
                SpotLight((0, 0, 1), power, radius, True, spot_size=math.pi / 2, blend=0.0),
                of_lamp * math.pi * min(square_of_sine, 0.5),
            ),
        }
        if size >= 1e-3:  # the floor that is looked at is 0.1 mm wide
            lamps["inside of a sphere"] = (PointLight((0, 0, radius / 2), power, radius), of_lamp * math.pi)
        for name, (lamp, expected) in lamps.items():
            found = irradiance([lamp], samples=256, seeds=8)
            record.claim(f"{name}, relative error at {size:g} m", off(found, expected), at_most=1e-4)
        found = irradiance([], instances=(glowing_panel(1.0, size),), samples=256, seeds=8)
        record.claim(f"mesh, relative error at {size:g} m", off(found, below_square(radius, 1.0)), at_most=1e-4)


@case(
    "An area light just above the surface",
    happens="Sparks around a lamp that lies on a table, and a dark table between them.",
    why="Points that are even over the lamp are far from even as seen from the surface: those close by are rare and "
    "count as 1/distance².",
    rooks="Samples by solid angle from within the lamp's diagonal, and on diffuse surfaces by the cosine where it "
    "fills almost half of all directions (Veach 1997, one-sample model). A disk is sampled by the square around it, "
    "drawn in where that is nearly even.",
)
def area_light_at_the_surface(record: Record) -> None:
    brightness = {"rectangle": 1.0, "ellipse": 4 / math.pi}
    for shape in brightness:
        distant, *others = (deviation(even_floor((square_lamp(1.0, height, shape),))) for height in (1.5, *HEIGHTS))
        near = dict(zip(HEIGHTS, others, strict=True))
        for height, found in near.items():
            record.claim(f"{shape} at {height:g} m, deviation over that at 1.5 m", found / distant, at_most=5)
        far = deviation(even_floor((square_lamp(1.0, 10.0, shape),)))
        record.claim(f"{shape} at 0.0001 m, deviation over that at 10 m", near[1e-4] / far, at_most=5)
        record.claim(f"largest deviation of a sample, {shape} at any height", max(others), at_most=MOST_DEVIATION)
        # There a disk is seen edge-on past the corner of the square around it: dark, so that the lamp is the measure.
        aside = square_lamp(1.0, 1e-3, shape, at=(0.44, 0.44))
        spread = deviation(even_floor((aside,))) * irradiance([aside], samples=64, seeds=8).mean
        what = f"deviation below a corner, {shape} at 0.001 m, over the brightness of the lamp"
        record.claim(what, spread / brightness[shape], at_most=0.5)
    # Points of the rectangle around a long ellipse must not be drawn in from here, on the way past the floor's point.
    long = AreaLight((-0.78, -0.039, 0.02), (2.0, 0.0, 0.0), (0.0, 0.1, 0.0), (1.0, 1.0, 1.0), "ellipse")
    record.claim("deviation beside an ellipse 20 times as long as wide", deviation(even_floor((long,))), at_most=2)
    for height in (0.1, 1e-4):
        found = irradiance([square_lamp(1.0, height)], samples=64, seeds=8)
        record.claim(f"relative error at {height:g} m", off(found, below_square(0.5, height) / math.pi), at_most=1e-4)
    for height in (1.3, 0.7):  # Hammersley's points have one at (0, 0) in every set
        values = picture(even_floor((square_lamp(1.0, height),)), samples=1, sampler="hammersley")
        record.claim(f"samples of Hammersley that miss a lamp at {height:g} m", (values == 0).sum(), at_most=0)


@case(
    "A glowing mesh just above the surface",
    happens="Sparks around a glowing panel that lies on a table.",
    why="As for an area light.",
    rooks="Rays that scatter find the panel, too, and each way counts by its density (Veach 1997, power heuristic).",
)
def mesh_light_at_the_surface(record: Record) -> None:
    distant = deviation(even_floor(instances=(glowing_panel(1.5),)))
    for height in (1e-1, 1e-2, 1e-4):
        near = deviation(even_floor(instances=(glowing_panel(height),)))
        record.claim(f"at {height:g} m, deviation over that at 1.5 m", near / distant, at_most=5)
    found = irradiance([], instances=(glowing_panel(1e-3),), samples=64, seeds=8)
    record.claim("relative error at 0.001 m", off(found, below_square(0.5, 1e-3)), at_most=1e-4)


@case(
    "A light that stands on the surface",
    happens="Sparks or a dark line where a lamp touches the floor.",
    why="At the edge the lamp is at no distance, and fills a quarter of all directions.",
    rooks="Samples by solid angle, whose formulas keep their precision however near the edge is.",
)
def light_that_stands_on_the_surface(record: Record) -> None:
    """A square of 1 m that stands on the floor, seen from the middle of its lower edge, so far before it."""
    for distance in (1.0, 1e-1, 1e-2, 1e-3, 1e-4):
        lamp = AreaLight((0.0, -distance, 0.5), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0))
        found = irradiance([lamp], samples=256, seeds=8)
        expected = before_standing_strip(distance) / math.pi
        record.claim(f"relative error at {distance:g} m", off(found, expected), at_most=2e-4)


def before_standing_strip(distance: float, low: float = 0.0, high: float = 1.0) -> float:
    """The irradiance of a standing strip of radiance 1, 1 m wide, between two heights, so far before its middle.

    Lambert's formula for the rectangle with a corner opposite of the point, twice.
    """

    def above(height: float) -> float:
        slant = math.hypot(distance, height)
        return distance / slant * math.atan(0.5 / slant)

    return above(low) - above(high)


@case(
    "A light that crosses the surface",
    happens="A lamp stuck in the floor lights it from below, or not at all.",
    why="The half below the floor has a negative cosine; a surface in a lamp's plane sees it edge-on.",
    rooks="Counts what lies above the surface only, at any distance.",
)
def light_that_crosses_the_surface(record: Record) -> None:
    half_sunk = AreaLight((0.0, -0.1, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 2.0), (2.0, 2.0, 2.0))
    found = irradiance([half_sunk], samples=256, seeds=8)
    record.claim("relative error, half sunk", off(found, before_standing_strip(0.1) / math.pi), at_most=2e-4)
    in_plane = AreaLight((0.0, -1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 1.0, 1.0))
    record.claim("irradiance in its plane", float(irradiance([in_plane]).mean), at_most=0)
    behind = AreaLight((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 1.0, 1.0))
    record.claim("irradiance behind it", float(irradiance([behind]).mean), at_most=0)
    below = square_lamp(1.0, -1.0)
    record.claim("irradiance from below the floor", float(irradiance([below]).mean), at_most=0)
    for name, is_soft in (("sphere", False), ("soft lamp", True)):
        lamp = PointLight((0.0, 1.0, 0.0), (4 * math.pi**2 * 0.5**2,) * 3, 0.5, is_soft)
        angle = math.atan(0.5) if is_soft else math.asin(0.5)
        # The upper half of a cone of this angle, whose axis lies in the surface, of radiance 1.
        expected = angle - math.sin(angle) * math.cos(angle)
        found = irradiance([lamp], samples=256, seeds=8)
        record.claim(f"relative error, half sunk {name}", off(found, expected), at_most=2e-4)


@case(
    "A light of no area",
    happens="A lamp scaled to a line or to a point is infinitely bright, or NaN.",
    why="Radiance is power over area.",
    rooks="A lamp without area sends no light; the add-on names it in a warning.",
)
def light_without_area(record: Record) -> None:
    for name, u, v in (("line", (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)), ("point", (0.0,) * 3, (0.0,) * 3)):
        found = irradiance([AreaLight((0.0, 0.0, 1.0), u, v, (1.0, 1.0, 1.0))], seeds=2)
        record.claim(f"irradiance of a {name}", float(found.mean), at_least=0, at_most=0)


@case(
    "Inside a sphere light",
    happens="A surface inside a lamp is black, or NaN.",
    why="The cone that a sphere fills has a sine of radius/distance, which is above 1 inside.",
    rooks="From inside, all directions above the surface are sampled: the irradiance is π times the lamp's radiance "
    "everywhere.",
)
def inside_a_sphere_light(record: Record) -> None:
    for height in (0.0, 0.5, 0.999):
        lamp = PointLight((0.0, 0.0, height), (1.0, 1.0, 1.0), 1.0)
        found = irradiance([lamp], samples=256, seeds=8)
        # Radiance P / (4 π² r²).
        record.claim(f"relative error {height:g} radii off", off(found, 0.25 / math.pi), at_most=2e-4)
        record.claim(f"deviation of a sample {height:g} radii off", deviation(even_floor((lamp,))), at_most=ROUNDING)
    lamp = PointLight((0.0, 0.0, 1.001), (1.0, 1.0, 1.0), 1.0)
    expected = 0.25 / math.pi / 1.001**2
    record.claim("relative error just outside", off(irradiance([lamp], samples=256, seeds=8), expected), at_most=2e-4)


@case(
    "A sphere or a soft lamp just above the surface",
    happens="Noise, though no sparks, around a lamp that touches something.",
    why="Directions that are even over a lamp of almost half of all directions differ by the surface's cosine: a "
    "relative deviation of √(1/3) of each sample, against 3·10⁻⁴ at 10 m.",
    rooks="Within four radii, diffuse surfaces sample a lamp that is all above them by the cosine: the disk that "
    "bounds its cone, seen along the normal, is an ellipse (Nusselt's analogue). All samples then count the same.",
)
def sphere_just_above_the_surface(record: Record) -> None:
    """The lower end of the lamp is so far above the floor; and the same seen from 0.1 m aside."""
    for name, is_soft in (("sphere", False), ("soft lamp", True)):
        far = PointLight((0.0, 0.0, 10.5), (1.0, 1.0, 1.0), 0.5, is_soft)
        distant = deviation(even_floor((far,)))
        for height, aside in ((1.0, 0.0), (0.1, 0.0), (1e-2, 0.0), (1e-4, 0.0), (1e-4, 0.1)):
            lamp = PointLight((aside, 0.0, height + 0.5), (1.0, 1.0, 1.0), 0.5, is_soft)
            where = f"{name} at {height:g} m" + f", {aside:g} m aside" * (aside > 0)
            near = deviation(even_floor((lamp,)))
            record.claim(f"{where}: deviation over that at 10 m", near / distant, at_most=5)
            square = (height + 0.5) ** 2 + aside**2
            # The cosine to the middle, of a disk or a sphere of radiance P / (4 π² r²).
            expected = (height + 0.5) / math.sqrt(square) / (4 * math.pi * (square + 0.25 * is_soft))
            found = irradiance([lamp], samples=64, seeds=8)
            record.claim(f"{where}: relative error", off(found, expected), at_most=1e-4)


@case(
    "A soft lamp at and inside its radius",
    happens="Sparks where a lamp with soft falloff touches something.",
    why="Blender's soft lamp is a disk that faces each point: as an area light, it has close points and far ones, and "
    "beside its foot the surface cuts it.",
    rooks="Samples the cone that the disk fills: by the cosine where it is whole, evenly where the surface cuts it.",
)
def soft_lamp_at_the_surface(record: Record) -> None:
    distant = deviation(even_floor((PointLight((0.0, 0.0, 10.0), (1.0, 1.0, 1.0), 0.5, soft_falloff=True),)))
    for height in (1.5, 0.5, 1e-1, 1e-2):
        lamp = PointLight((0.0, 0.0, height), (1.0, 1.0, 1.0), 0.5, soft_falloff=True)
        near = deviation(even_floor((lamp,)))
        record.claim(f"deviation at {height:g} m over that at 10 m", near / distant, at_most=5)
        # A disk of radiance P / (4 π² r²).
        expected = 1 / (4 * math.pi * (0.25 + height**2))
        record.claim(f"relative error at {height:g} m", off(irradiance([lamp], seeds=8), expected), at_most=2e-4)


#: Of a roughness, how many times as much its samples may deviate just below a lamp as below one at 10 m.
FAR_METAL = {0.2: 5, 0.3: 12, 0.5: 120}


@case(
    "Rough metal just below a lamp",
    happens="Sparks in the gloss of a table around a lamp that lies on it.",
    why="As for diffuse surfaces; and neither light samples nor scattered rays alone fit both a narrow gloss and a "
    "wide one.",
    rooks="Counts light samples by solid angle and scattered rays by their densities (Veach 1997, power heuristic). "
    "What is left are their own deviations, at most 0.5 together: noise, but no sparks. Below a lamp at 10 m there is "
    "the less of it the rougher the metal is, so that just below one it is 8 times as much at a roughness of 0.3, and "
    "85 times at 0.5.",
    instead="More samples: 16 leave an eighth of the brightness even where they are independent",
)
def rough_metal_just_below_a_lamp(record: Record) -> None:
    """White metal seen straight on: below a lamp that fills half of all directions it is as bright as the lamp."""
    makes = {
        "rectangle": lambda height: square_lamp(1.0, height),
        "disk": lambda height: square_lamp(1.0, height, "ellipse"),
        "sphere": lambda height: PointLight((0, 0, height + 0.5), (1.0, 1.0, 1.0), 0.5),
    }
    for roughness in (0.2, 0.3, 0.5):
        metal = Material("metal", Glossy(1.0, roughness))
        for name, make in makes.items():
            scenes = {height: even_floor((make(height),), material=metal) for height in (10, 1.5, 0.1, 1e-4)}
            spread = {height: deviation(scene) for height, scene in scenes.items()}
            what = f"{name}, roughness {roughness:g}"
            record.claim(f"{what}: deviation at 0.0001 m over that at 1.5 m", spread[1e-4] / spread[1.5], at_most=5)
            record.claim(f"{what}: over that at 10 m", spread[1e-4] / spread[10], at_most=FAR_METAL[roughness])
            record.claim(f"{what}: largest at any height", max(spread.values()), at_most=0.6)
        bright = picture(even_floor((square_lamp(1.0, 1e-4),), material=metal), samples=256, threads=0).mean() * math.pi
        record.claim(f"relative error below a rectangle, roughness {roughness:g}", abs(bright - 1), at_most=0.01)


@case(
    "A spot of any cone and blend",
    happens="Blend 0 divides by the blend's width; a cone of 180° has a cosine of 0.",
    why="The edge's width is (1 − cos) × blend.",
    rooks="A width of 0 is a step. Blender's smooth step in the cosine else.",
)
def spot_of_any_cone(record: Record) -> None:
    for degrees in (1.0, 60.0, 180.0):
        for blend in (0.0, 1.0):
            spot = SpotLight((0, 0, 1), (4 * math.pi**2,) * 3, spot_size=math.radians(degrees), blend=blend)
            middle = float(irradiance([spot], seeds=2).mean)
            record.claim(f"error below {degrees:g}°, blend {blend:g}", abs(middle / math.pi - 1), at_most=1e-5)
    for degrees, blend, x in ((90.0, 1.0, 0.5), (180.0, 0.0, 3.0), (180.0, 1.0, 1.0)):
        spot = SpotLight((0, 0, 1), (4 * math.pi**2,) * 3, spot_size=math.radians(degrees), blend=blend)
        cosine, edge = 1 / math.sqrt(1 + x * x), math.cos(math.radians(degrees / 2))
        step = min((cosine - edge) / ((1 - edge) * blend), 1.0) if blend else 1.0
        expected = step * step * (3 - 2 * step) * cosine**3
        found = float(irradiance([spot], at=(x, 0, 0), seeds=2).mean) / math.pi
        record.claim(f"error {x:g} m aside, {degrees:g}°, blend {blend:g}", abs(found / expected - 1), at_most=1e-4)
    spot = SpotLight((0, 0, 1), (4 * math.pi**2,) * 3, spot_size=math.pi / 2, blend=0.0)
    for x, expected in ((0.999, 1.0), (1.001, 0.0)):
        found = float(irradiance([spot], at=(x, 0, 0), seeds=2).mean) / math.pi * (1 + x * x) ** 1.5
        record.claim(f"share at {x:g} of a hard edge", found, at_least=expected - 1e-3, at_most=expected + 1e-3)


@case(
    "No power and enormous power",
    happens="Light of 10¹² W overflows; of 0 W divides 0 by 0.",
    why="float32 ends at 3·10³⁸, and sums of squares reach there from 10¹⁹ on.",
    rooks="Sums in float64. Lamps of no power are left out.",
)
def light_of_any_power(record: Record) -> None:
    expected = below_square(0.5, 1.0) / math.pi
    for power in (1e-12, 1e12, 1e24):
        found = irradiance([square_lamp(1.0, 1.0, power=power)], seeds=8)
        record.claim(f"relative error at {power:g} W", off(found, power * expected), at_most=1e-4)
    record.claim("irradiance at 0 W", float(irradiance([square_lamp(1.0, 1.0, power=0.0)]).mean), at_most=0)


@case(
    "A thousand lights of which one matters",
    happens="The picture is black but for sparks: one sample in a thousand asks the lamp that shines here.",
    why="Lamps that are chosen without looking are chosen in vain.",
    rooks="Chooses by a bound on what each can bring here: power, distance, orientation (Conty and Kulla 2018).",
)
def one_light_of_a_thousand(record: Record) -> None:
    one = square_lamp(0.5, 1.0)
    rng = np.random.default_rng(5)
    far = rng.uniform((-90, -90, 10), (90, 90, 30), (999, 3))
    turned_away = [AreaLight(tuple(place), (1.0, 0, 0), (0, -1.0, 0), (1.0,) * 3) for place in far.tolist()]
    distant = [PointLight(tuple(place), (1e-3,) * 3, 0.1) for place in far.tolist()]
    alone = deviation(even_floor((one,)))
    expected = below_square(0.25, 1.0) / 0.25 / math.pi
    for name, others in (("turned away", turned_away), ("far and faint", distant)):
        lamps = (one, *others)
        record.claim(
            f"deviation over that of the one alone, the others {name}",
            deviation(even_floor(lamps)) / alone,
            at_most=5,
        )
        if others is turned_away:
            found = irradiance(lamps, samples=64, seeds=8)
            record.claim(f"relative error, the others {name}", off(found, expected), at_most=1e-3)


@case(
    "A lamp seen edge-on",
    happens="Noise, or light where there is none, along a lamp's plane.",
    why="The solid angle of a thin sliver is the difference of large angles.",
    rooks="The solid angle comes from the volume of three unit vectors, without a difference (Van Oosterom 1983).",
)
def lamp_seen_edge_on(record: Record) -> None:
    """A floor that faces the edge of a lamp, so far off its plane."""
    for aside in (1.0, 1e-2, 1e-4):
        lamp = AreaLight((0.0, -aside, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (1.0, 1.0, 1.0))
        values = irradiance([lamp], samples=256, seeds=8)
        expected = before_standing_strip(aside, 0.5, 1.5) / math.pi
        record.claim(f"relative error {aside:g} m aside", off(values, expected), at_most=1e-3)
