"""Numbers: scenes of every size, far from the origin and far from the camera, within the 24 bits of float32."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from core import AreaLight, Camera, Instance, Material, Mesh, PointLight, Scene, SceneError, SunLight
from core.scene import VISIBLE_TO_CAMERA
from core.shaders import Glossy
from tests.scenes import (
    box,
    camera_down,
    emitter,
    floor,
    lambertian,
    picture,
    quad,
    rotation,
    scaling,
    sphere,
    translation,
)

from .case import Record, case

MIRROR = Material("mirror", Glossy((0.9, 0.9, 0.9), 0.2))


def still_life(scale: float = 1.0, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Scene:
    """Balls and a box on a floor under a lamp of each kind and a glowing mesh, scaled, then moved to `at`.

    Lamps have their power scaled with the square, so that all look alike.
    """
    place = translation(*at) @ scaling(scale, scale, scale)
    power = 60 * scale**2

    def point(*local: float) -> tuple[float, float, float]:
        return tuple(place[:3, :3] @ local + place[:3, 3])

    things = (
        (floor(8), np.eye(4), lambertian(0.6)),
        (box(), translation(0, 0, 0.5) @ rotation(2, 0.5), lambertian(0.7)),
        (sphere(0.5, smooth=True), translation(1.3, 0.2, 0.5), MIRROR),
        (sphere(0.3), translation(-1.2, -0.4, 0.3), lambertian(0.5)),
        (quad((0, 0, 0), (1, 0, 0), (0, 1, 0)), translation(0, 1.5, 2) @ rotation(0, 2.0), emitter(5.0)),
    )
    lamps = (
        AreaLight(point(-2, -1, 3), (scale, 0, 0), (0, scale, 0), (power,) * 3),
        PointLight(point(2, -2, 2), (power,) * 3, 0.1 * scale),
        PointLight(point(-2, 2, 2), (power,) * 3),
        SunLight((0.5, 0.2, 1), (1.0,) * 3, 0.02),
    )
    matrix = translation(*point(0, -5, 2.5)) @ rotation(0, 1.15)
    camera = Camera(matrix, (64, 64), (-0.4, 0.4, -0.4, 0.4), clip_start=0.01 * scale, clip_end=1e3 * scale)
    instances = tuple(Instance(mesh, place @ local, (material,)) for mesh, local, material in things)
    return Scene(camera, instances, lamps, (0.1, 0.1, 0.1))


def _seen(scene: Scene, samples: int = 16) -> np.ndarray:
    return picture(scene, channel=None, samples=samples, max_bounces=2)[..., :3]


def _show(record: Record, label: str, scene: Scene) -> None:
    record.show(label, _seen(replace(scene, camera=replace(scene.camera, resolution=(128, 128))), samples=36))


def _off(found: np.ndarray, expected: np.ndarray) -> float:
    """The mean difference of two pictures, as a share of the second's mean."""
    return float(np.abs(found - expected).mean() / expected.mean())


#: What rounding may do to a picture: each number is off by some 2^-22, and so is the share of samples that an edge
#: loses to its neighbour, for each of the some ten edges, of things and of shadows, that a row of pixels crosses.
ROUNDING = 1e-5


@case(
    "A scene of every size",
    happens="A thing modelled in tenths of a millimetre, or in kilometres, is black, speckled, or without shadows.",
    why="Fixed offsets and thresholds in metres are right for one size; squares and cubes of lengths leave float32.",
    rooks="Has none: steps are shares of coordinates. Scaled by powers of two, the picture is the same to the bit, but "
    "for the last digit of a pixel among the samplers' pictures.",
)
def scene_of_every_size(record: Record) -> None:
    reference = still_life()
    expected = _seen(reference)
    for exponent in (-20, -13, 10, 20, 30):
        wrong = int((_seen(still_life(2.0**exponent)) != expected).any(axis=2).sum())
        record.claim(f"pixels that differ at 2^{exponent}", wrong, at_most=0)
    for scale in (1e-4, 1e-2, 1e3, 1e6, 1e10):
        record.claim(f"mean difference at {scale:g}", _off(_seen(still_life(scale)), expected), at_most=ROUNDING)
    for scale in (1e-4, 1.0, 1e6):
        _show(record, f"{scale:g} m", still_life(scale))


@case(
    "A scene far from the world's origin",
    happens="Things jitter, surfaces become steps, shadows tear.",
    why="float32 has steps of 8 mm at 100 km and of 6 cm at 1000 km.",
    rooks="Moves the world in float64 so that the scene lies about the origin. What a mesh's own float32 coordinates "
    "have lost before is lost: keep the distance in the object's location.",
)
def far_from_the_origin(record: Record) -> None:
    expected = _seen(still_life())
    for distance in (1e4, 1e5, 1e6):
        found = _seen(still_life(at=(distance, -distance, distance)))
        record.claim(f"mean difference at {distance:g} m", _off(found, expected), at_most=ROUNDING)
    far = still_life(at=(1e4, 1e4, 1e4))
    baked = [_baked(instance) for instance in far.instances]
    back = [replace(instance, matrix=translation(-1e4, -1e4, -1e4)) for instance in baked]
    near = replace(still_life(), instances=tuple(back))
    difference = _off(_seen(replace(far, instances=tuple(baked))), _seen(near))
    record.claim("the same where the vertices lie at 10⁴ m, against these moved back", difference, at_most=ROUNDING)


def _baked(instance: Instance) -> Instance:
    """As Blender's Apply does it: the place is in the vertices, in float32."""
    mesh, matrix = instance.mesh, instance.matrix
    vertices = (mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
    return replace(instance, mesh=replace(mesh, vertices=vertices), matrix=np.eye(4))


@case(
    "A moon beside a still life",
    happens="One thing far away, and all that is near is coarse and speckled.",
    why="A scene that is centred on the middle of everything is centred between the moon and the table.",
    rooks="Moves the world only as far as nothing comes to lie farther from the centre than it was from the origin.",
)
def moon_beside_a_still_life(record: Record) -> None:
    scene = still_life()
    expected = _seen(scene)
    for distance in (1e4, 1e5, 1e6, 1e7):
        place = translation(distance, distance / 3, distance)
        moon = Instance(sphere(distance / 10), place, visibility=VISIBLE_TO_CAMERA)
        found = _seen(replace(scene, instances=(*scene.instances, moon)))
        record.claim(f"mean difference with a moon at {distance:g} m", _off(found, expected), at_most=ROUNDING)


@case(
    "Ground planes of 10⁷ m",
    happens="Shadows on a huge ground are shifted by up to a metre, or torn, even near the origin.",
    why="A hit is most exact as a mixture of its triangle's corners, but not if these are kilometres away: float32 has "
    "steps of half a metre at 5000 km.",
    rooks="Of a triangle that reaches farther than the ray, takes the plane from the corners and the place in it from "
    "the ray. The step off is the error along the normal, nothing for a level ground.",
)
def ground_of_ten_million_metres(record: Record) -> None:
    """Direct light on a ball, a box and a ground of 8 m and of 10⁷ m, in its middle and near its corner."""
    still = still_life()
    scene = replace(
        still,
        camera=replace(still.camera, matrix=translation(0, -2, 3) @ rotation(0, 0.5)),
        instances=(still.instances[0], still.instances[1], still.instances[3]),
        world=(0.0, 0.0, 0.0),
    )
    expected = _direct(scene)
    for label, ground in (("in the middle", floor(1e7)), ("near a corner", floor(1e7, (4.9e6, 4.9e6, 0)))):
        huge = replace(scene, instances=(replace(scene.instances[0], mesh=ground), *scene.instances[1:]))
        record.claim(f"mean difference {label}", _off(_direct(huge), expected), at_most=ROUNDING)
        _show(record, label, huge)


def _direct(scene: Scene) -> np.ndarray:
    return picture(scene, channel=None, samples=64)[..., :3]


@case(
    "A camera far from what it looks at",
    happens="Edges fray, and small things flicker, in a view through a telescope or of an orthographic camera far off.",
    why="A ray that comes from 1000 km away starts on float32's steps of 6 cm there.",
    rooks="As any renderer in float32: moves each ray by up to half a step of its distance, without bias.",
    instead="the same view from nearer by: of an orthographic camera the distance does not count",
)
def camera_far_away(record: Record) -> None:
    """A ball on a floor from above, orthographic: what the camera's height changes."""
    things = (Instance(sphere(0.4, smooth=True)), Instance(floor(3, (0, 0, -0.4))))
    sun = (SunLight((0.5, 0.2, 1), (1.0,) * 3),)
    near, farther, far = (
        picture(Scene(camera_down(1.2, (64, 64), height=height), things, sun), samples=64) for height in (1.0, 1e3, 1e6)
    )
    # A row of 1.2 m crosses some two edges, past which rays move by 2^-24 of the distance.
    bound = 2 * 2.0**-24 * 1e3 / 1.2
    record.claim("mean difference at 1 km", _off(farther, near), at_most=bound)
    record.claim("mean difference at 1000 km", _off(far, near), at_least=bound, at_most=1000 * bound)


@case(
    "Matrices that mirror, shear, flatten, shrink and blow up",
    happens="Inside out, black or missing objects; a traceback.",
    why="An inverse that does not exist, or squares and cubes of a scale that float32 does not hold.",
    rooks="Takes normals from cofactors, which every matrix has, without their scale; names the object that reaches "
    "farther than rays do.",
)
def matrices(record: Record) -> None:
    scene = still_life()
    shear = np.eye(4)
    shear[0, 1], shear[1, 2] = 0.7, -0.4
    places = {"mirrored": scaling(-1, 1, 1), "sheared": shear, "both": shear @ scaling(1, 1, -2) @ rotation(0, 1)}
    for label, place in places.items():
        thing = Instance(sphere(0.4, smooth=True), translation(0.5, -1.5, 0.6) @ place, (lambertian(0.5),))
        copy = replace(thing, matrix=translation(0, 50, 0) @ thing.matrix)
        once, twice = (_seen(replace(scene, instances=(*scene.instances, thing, *more))) for more in ((), (copy,)))
        record.claim(f"{label}: mean difference of an instance to a mesh by itself", _off(twice, once), at_most=1e-3)
    thing = Instance(sphere(0.4, smooth=True), translation(0.5, -1.5, 0.6))
    small = replace(thing.mesh, vertices=thing.mesh.vertices * np.float32(1e-20))
    scaled_up = replace(thing, mesh=small, matrix=thing.matrix @ scaling(1e20, 1e20, 1e20))
    usual, blown_up = (_seen(replace(scene, instances=(*scene.instances, ball))) for ball in (thing, scaled_up))
    record.claim("mean difference with a ball of 10⁻²⁰ m scaled up", _off(blown_up, usual), at_most=ROUNDING)
    expected = _seen(scene)
    for scale in (1e-30, 0.0):
        speck = tuple(Instance(box(), translation(0, -2, 1 + i) @ scaling(scale, scale, scale)) for i in range(2))
        difference = _off(_seen(replace(scene, instances=(*scene.instances, *speck))), expected)
        record.claim(f"mean difference with cubes of {scale:g} m", difference, at_most=0)
    record.claim("errors that name an object of 1e30 m", _is_named(scene, scaling(1e30, 1e30, 1e30)), at_least=1)


def _is_named(scene: Scene, matrix: np.ndarray) -> bool:
    huge = Instance(Mesh("Cube", box().vertices, box().triangles), matrix, name="Cube.007")
    try:
        _seen(replace(scene, instances=(*scene.instances, huge)))
    except SceneError as error:
        return "object 'Cube.007'" in str(error) and "\n" not in str(error)
    return False
