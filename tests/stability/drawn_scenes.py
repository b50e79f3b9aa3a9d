"""Scenes and settings as hypothesis draws them: every kind of thing that the core knows, with numbers at their limits.

Most numbers are ones that a scene could have, so that something is seen; one in a few is the largest, the smallest,
negative, or no number at all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np
from hypothesis import strategies as st

from core import (
    AreaLight,
    Camera,
    Instance,
    Material,
    Mesh,
    PointLight,
    RenderSettings,
    Scene,
    SpotLight,
    SunLight,
    shaders,
    values,
)
from core.samplers import SAMPLERS

_LARGEST = float(np.finfo(np.float32).max)
_FINITE = np.float32(
    (0.0, -0.0, 1e-45, 1e-30, 1e-12, 1e-6, 1e6, 1e12, 1e30, _LARGEST, -1.0, -1e-6, -1e6, -1e30, -_LARGEST)
).tolist()
_ANY = (*_FINITE, float("nan"), float("inf"), float("-inf"))

_Strategy = st.SearchStrategy


def _mostly(usual: _Strategy, rare: _Strategy, one_in: int = 12) -> _Strategy:
    return st.integers(1, one_in).flatmap(lambda number: rare if number == one_in else usual)


def _arrays(*shape: int, low: float = 0.0, high: float = 1.0, extremes: Sequence[float] = _ANY) -> _Strategy:
    """float32 arrays of even numbers, every fiftieth an extreme: by one number, as drawing each takes long."""

    def fill(seed: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        even = rng.uniform(low, high, shape).astype(np.float32)
        return np.where(rng.random(shape) < 0.02, rng.choice(np.float32(extremes), shape), even)

    return _SEEDS.map(fill)


_SEEDS = st.integers(0, 2**32 - 1)
_EXTREME = st.sampled_from(_FINITE)
_SHARE = _mostly(st.floats(0, 1, width=32), _EXTREME)
_LENGTH = _mostly(st.floats(-2, 2, width=32), _EXTREME, 30)
_ANGLE = _mostly(st.floats(0, 3, width=32), _EXTREME)
_STRENGTH = _mostly(st.floats(0, 100, width=32), _EXTREME)
#: Constants that are not finite are refused, as a rule: they are rare, or nothing else would be tried.
_NUMBER = _mostly(_SHARE, st.sampled_from(_ANY), 40)
_COLOR = st.tuples(_NUMBER, _NUMBER, _NUMBER)
_POINT = st.tuples(_LENGTH, _LENGTH, _LENGTH)
_FLAG = st.booleans()
_VISIBILITY = _mostly(st.just(31), st.integers(0, 31), 5)


# Values and shaders: a random tree of each, no deeper than a few nodes


_PIXELS = st.tuples(st.integers(1, 5), st.integers(1, 5)).flatmap(
    lambda size: _arrays(*size, 3) | _arrays(*size, 3, high=255, extremes=(0, 255)).map(np.uint8)
)
_COORDINATES = st.sampled_from((values.UV, values.GENERATED, values.OBJECT, values.WORLD))
_NAMES = {
    "operation": values.MATHS,
    "space": values.NORMAL_SPACES,
    "extension": values.EXTENSIONS,
    "kind": values.LAYER_WEIGHTS,
    "distribution": ("ggx", "multiscatter_ggx"),
    "name": ("Col", "missing"),
}
_OF_FIELD = {
    **{name: st.sampled_from(names) for name, names in _NAMES.items()},
    **dict.fromkeys(("clamp", "clamp_factor", "clamp_result", "invert", "smooth", "physical"), _FLAG),
    "pixels": _PIXELS,
    "index": st.integers(0, 2),
    "matrix": _arrays(3, 4, low=-1),
    "table": st.integers(1, 5).flatmap(lambda count: _arrays(count, 3)),
}


def _build(kind: type, inner: _Strategy, normals: _Strategy, **own) -> _Strategy:
    """A node of a class, each field drawn by its name; what has none of its own is an input."""

    def of(name: str) -> _Strategy:
        if kind is values.Mix and name == "blend":
            return st.sampled_from(values.BLENDS)
        if name == "interpolation":
            return st.sampled_from(values.INTERPOLATIONS if kind is values.MapRange else values.TEXTURE_INTERPOLATIONS)
        return known.get(name, normals if name.endswith("normal") else inner)

    known = _OF_FIELD | own
    return st.builds(kind, **{field.name: of(field.name) for field in fields(kind)})


_NODES = (
    values.Affine, values.Normalized, values.Checker, values.ImageTexture, values.EnvironmentTexture, values.ColorRamp,
    values.Mix, values.Math, values.MapRange, values.Gray, values.Average, values.Component, values.Combine,
)  # fmt: skip
_VIEW_NODES = (values.Fresnel, values.LayerWeight)
_NORMAL_NODES = (values.NormalMap, values.Bump)


def _nodes(inner: _Strategy) -> _Strategy:
    normals = st.none() | st.one_of(*(_build(kind, inner, st.none()) for kind in _NORMAL_NODES))
    return st.one_of(*(_build(kind, inner, normals) for kind in (*_NODES, *_VIEW_NODES)))


def _surfaceless(inner: _Strategy) -> _Strategy:
    return st.one_of(*(_build(kind, inner, st.none()) for kind in _NODES))


_ATTRIBUTE = st.builds(values.Attribute, _OF_FIELD["name"])
VALUES = st.recursive(_NUMBER | _COLOR | _COORDINATES | _ATTRIBUTE, _nodes, max_leaves=6)
_NORMALS = st.none() | st.one_of(*(_build(kind, VALUES, st.none()) for kind in _NORMAL_NODES))
_INPUT = _mostly(_NUMBER | _COLOR, VALUES, 3)
#: In the world there is no surface to read from: what asks for one is refused.
WORLDS = st.recursive(_NUMBER | _COLOR | _COORDINATES, _surfaceless, max_leaves=6)
_SHADERS = (
    shaders.Diffuse, shaders.Glossy, shaders.Metallic, shaders.Glass, shaders.Refraction, shaders.Transparent,
    shaders.Translucent, shaders.Emission, shaders.Principled,
)  # fmt: skip
_GLOSSY = st.sampled_from(("ggx", "multiscatter_ggx", "cosine_power"))
_LEAVES = st.one_of(
    *(
        _build(kind, _INPUT, _NORMALS, **({"distribution": _GLOSSY} if kind is shaders.Glossy else {}))
        for kind in _SHADERS
    )
)


def _mixes(inner: _Strategy) -> _Strategy:
    part = st.none() | inner
    return st.builds(shaders.MixShader, _INPUT, part, part) | st.builds(shaders.AddShader, part, part)


SURFACES = st.none() | st.recursive(_LEAVES, _mixes, max_leaves=4)
MATERIALS = st.builds(Material, st.just("drawn"), SURFACES, _FLAG)


# Meshes and where they stand

_OF_MESHES = {"corner_normals": (3, 3), "uvs": (3, 2), "tangents": (3, 4)}


@st.composite
def _meshes(draw: st.DrawFn) -> Mesh:
    """Triangles of a few points: some of them without area, or twice the same."""
    points, count = draw(st.integers(3, 6)), draw(st.integers(0, 8))
    rng = np.random.default_rng(draw(_SEEDS))
    more = {name: draw(_arrays(count, *shape, low=-1)) for name, shape in _OF_MESHES.items() if draw(_FLAG)}
    if draw(_FLAG):
        more["material_slots"] = rng.integers(0, 3, count, np.int16)
    if draw(_FLAG):
        more["attributes"] = {"Col": draw(_arrays(count, 3, 3))}
    corners = draw(_arrays(points, 3, low=-2, high=2, extremes=_ANY if draw(st.integers(1, 30)) == 1 else _FINITE))
    triangles = rng.integers(0, points, (count, 3), np.int32)
    return Mesh("drawn", corners, triangles, texture_space=draw(st.tuples(_POINT, _POINT)), **more)


@st.composite
def _matrices(draw: st.DrawFn) -> np.ndarray:
    """Mostly small turns and shears; some that flatten, mirror, or make huge."""
    matrix = np.eye(4)
    if draw(_FLAG):
        matrix[:3, :3] += draw(_arrays(3, 3, low=-0.3, high=0.3, extremes=(0.0,)))
        matrix[:3, :3] *= draw(st.tuples(*[_mostly(st.floats(-2, 2), _EXTREME, 20)] * 3))
        matrix[:3, 3] = draw(_POINT)
    if draw(st.integers(1, 60)) == 1:
        matrix[draw(st.integers(0, 2)), draw(st.integers(0, 3))] = draw(st.sampled_from(_ANY))
    return matrix


def _instances(meshes: list[Mesh]) -> _Strategy:
    return st.builds(
        Instance,
        st.sampled_from(meshes),
        _matrices(),
        st.lists(MATERIALS, max_size=2).map(tuple),
        _VISIBILITY,
    )


# Lights


_POWER = st.tuples(_STRENGTH, _STRENGTH, _STRENGTH)
_LAMP = {"cast_shadow": _mostly(st.just(True), st.just(False), 5), "visibility": _VISIBILITY}
_ROUND = {"position": _POINT, "power": _POWER, "radius": _STRENGTH, "soft_falloff": _FLAG, **_LAMP}
LIGHTS = st.one_of(
    st.builds(
        AreaLight,
        center=_POINT,
        axis_u=_POINT,
        axis_v=_POINT,
        power=_POWER,
        shape=st.sampled_from(("rectangle", "ellipse")),
        **_LAMP,
    ),
    st.builds(PointLight, **_ROUND),
    st.builds(SpotLight, **_ROUND, matrix=_matrices(), spot_size=_ANGLE, blend=_SHARE),
    st.builds(SunLight, direction=_POINT, irradiance=_POWER, angle=_ANGLE, **_LAMP),
)


# Cameras, scenes, settings


@st.composite
def _cameras(draw: st.DrawFn) -> Camera:
    """Mostly above the scene, looking down on it."""
    matrix = draw(_matrices())
    matrix[2, 3] += 4
    window = draw(_mostly(st.just((-0.5, 0.5, -0.5, 0.5)), st.tuples(*[_NUMBER] * 4)))
    return Camera(
        matrix,
        (draw(st.integers(1, 6)), draw(st.integers(1, 6))),
        window,
        draw(_FLAG),
        clip_start=draw(_mostly(st.just(0.0), _STRENGTH)),
        clip_end=draw(_mostly(st.just(1e3), _STRENGTH)),
        lens_radius=draw(_mostly(st.sampled_from((0.0, 0.1)), _EXTREME)),
        focus_distance=draw(_mostly(st.just(4.0), _STRENGTH)),
        aperture_blades=draw(st.integers(0, 7)),
        aperture_rotation=draw(_STRENGTH),
        aperture_ratio=draw(_mostly(st.just(1.0), _STRENGTH)),
    )


@st.composite
def _scenes(draw: st.DrawFn) -> Scene:
    meshes = draw(st.lists(_meshes(), min_size=1, max_size=3))
    instances = draw(st.lists(_instances(meshes), min_size=draw(st.integers(0, 2)), max_size=4))
    lights = draw(st.lists(LIGHTS, max_size=3))
    if draw(st.integers(1, 10)) == 1:
        lights *= 6  # so many that they are chosen from
    return Scene(draw(_cameras()), tuple(instances), tuple(lights), draw(_mostly(_COLOR, WORLDS, 3)))


@st.composite
def _settings(draw: st.DrawFn, resolution: tuple[int, int]) -> RenderSettings:
    width, height = resolution
    left, bottom = draw(st.integers(0, width - 1)), draw(st.integers(0, height - 1))
    border = left, bottom, draw(st.integers(left + 1, width)), draw(st.integers(bottom + 1, height))
    domains = {f"{domain}_sampler": draw(st.none() | st.sampled_from(list(SAMPLERS))) for domain in _DOMAINS}
    bounces = {f"{kind}_bounces": draw(st.integers(0, 5)) for kind in _KINDS}
    return RenderSettings(
        samples=draw(st.integers(1, 9)),
        sampler=draw(st.sampled_from(list(SAMPLERS))),
        **domains,
        **bounces,
        seed=draw(st.integers(0, 2**31 - 1)),
        clamp_indirect=draw(st.sampled_from((0.0, 0.0, 1.0, 1e-30, 1e30))),
        pixel_filter=draw(st.sampled_from(("box", "blackman_harris"))),
        filter_width=draw(st.sampled_from((0.01, 1.5, 10.0))),
        film_transparent=draw(_FLAG),
        border=draw(st.sampled_from((None, border))),
        threads=1,
        batch_packets=draw(st.sampled_from((1, 3, 32))),
    )


@st.composite
def scenes_with_settings(draw: st.DrawFn) -> tuple[Scene, RenderSettings]:
    scene = draw(_scenes())
    return scene, draw(_settings(scene.camera.resolution))


_DOMAINS = ("pixel", "lens", "light", "bsdf")
_KINDS = ("max", "diffuse", "glossy", "transmission", "transparent")
