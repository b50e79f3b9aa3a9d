"""What a picture is made from: a camera, meshes placed in the world, materials and lights, as plain numpy arrays.

Conventions are Blender's: metres, Z up, right-handed, watts for lights, linear Rec.709 colour. A camera and a lamp look
along their own negative Z axis with Y up. Matrices are float64 (4, 4), column vectors: `world = matrix @ local`.

Meshes, materials and textures are shared by reference: two instances that hold the same `Mesh` object store it once.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from .shaders import Diffuse, Shader
from .values import Color, Value

#: Bits of `Instance.visibility` and of a light's: the kinds of ray that can hit it. A ray that leaves a surface is of
#: the kind of the lobe that it was sampled from.
VISIBLE_TO_CAMERA, VISIBLE_TO_DIFFUSE, VISIBLE_TO_GLOSSY, VISIBLE_TO_TRANSMISSION, VISIBLE_TO_SHADOWS = 1, 2, 4, 8, 16
VISIBLE_TO_SURFACES = VISIBLE_TO_DIFFUSE | VISIBLE_TO_GLOSSY | VISIBLE_TO_TRANSMISSION
VISIBLE_TO_ALL = VISIBLE_TO_CAMERA | VISIBLE_TO_SURFACES | VISIBLE_TO_SHADOWS

#: A mesh without a material: Blender's default grey.
DEFAULT_GREY: Color = (0.8, 0.8, 0.8)
DEFAULT_SURFACE = Diffuse(DEFAULT_GREY)


@dataclass(frozen=True)
class Camera:
    """A perspective or orthographic camera with a thin lens.

    `window` is what the full frame sees, (left, right, bottom, top): on the plane one metre in front of a perspective
    camera, or in metres across an orthographic one. Sensor, shift and pixel aspect are already in it.
    `clip_start` and `clip_end` are depths along the view axis, in metres.
    `lens_radius` 0 is a pinhole. The lens is a disk, or a regular polygon of `aperture_blades` (3 and more) inscribed
    in it and turned by `aperture_rotation` radians, squeezed along x by `aperture_ratio` (anamorphic, width divided by
    the ratio). `focus_distance` is the depth of the plane in focus.
    """

    matrix: np.ndarray
    resolution: tuple[int, int]
    window: tuple[float, float, float, float]
    orthographic: bool = False
    clip_start: float = 0.1
    clip_end: float = 1000.0
    lens_radius: float = 0.0
    focus_distance: float = 10.0
    aperture_blades: int = 0
    aperture_rotation: float = 0.0
    aperture_ratio: float = 1.0
    name: str = ""


@dataclass(frozen=True, eq=False)
class Material:
    """What a surface does with light, the same from both sides; `surface` None is black.

    Without `sample_as_light` what it emits is only found by the rays that hit it.
    """

    name: str = "default"
    surface: Shader | None = DEFAULT_SURFACE
    sample_as_light: bool = True


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles in the mesh's own space.

    `vertices` (V, 3) float32; `triangles` (T, 3) int32, counter-clockwise seen from outside.
    `corner_normals` (T, 3, 3) float32 unit vectors, or None for a mesh that is flat-shaded throughout.
    `uvs` (T, 3, 2) float32, one per corner, or None where no texture asks for them.
    `material_slots` (T,) integers into `Instance.materials`, or None where every triangle has slot 0.
    `texture_space` (location, size), each of 3 floats: generated coordinates are (p - location) / (2 size) + 1/2.
    `tangents` (T, 3, 4) float32, where a normal map in tangent space asks for them: per corner the unit direction of
    growing u, and the sign of the bitangent. `attributes` maps names to (T, 3, 3) float32, one colour per corner.
    """

    name: str
    vertices: np.ndarray
    triangles: np.ndarray
    corner_normals: np.ndarray | None = None
    uvs: np.ndarray | None = None
    material_slots: np.ndarray | None = None
    texture_space: tuple[tuple[float, float, float], tuple[float, float, float]] = ((0, 0, 0), (1, 1, 1))
    tangents: np.ndarray | None = None
    attributes: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Instance:
    """A mesh placed in the world, with a material for each of its slots (none: the default grey).

    `lift_shadows_below` is a cosine, Blender's geometry offset of the shadow terminator: shadow rays that leave a
    smooth surface at a lower one start where it would be if it were as round as its normals say. 0: none do.
    """

    mesh: Mesh
    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))
    materials: tuple[Material, ...] = ()
    visibility: int = VISIBLE_TO_ALL
    name: str = ""
    lift_shadows_below: float = 0.0


@dataclass(frozen=True)
class AreaLight:
    """A flat one-sided light: it shines to the side of `axis_v` × `axis_u`, that is, a lamp's own -Z.

    `center` and the two *full* edges (of a rectangle) or *full* axes (of an ellipse) `axis_u`, `axis_v` are in world
    space, metres. `power` is in watts per channel: the radiance is power / (π area).
    """

    center: tuple[float, float, float]
    axis_u: tuple[float, float, float]
    axis_v: tuple[float, float, float]
    power: Color
    shape: Literal["rectangle", "ellipse"] = "rectangle"
    cast_shadow: bool = True
    name: str = ""
    visibility: int = VISIBLE_TO_SURFACES


@dataclass(frozen=True)
class PointLight:
    """A sphere of `radius` metres (0: a point) that sends `power` watts per channel in all directions.

    The radiant intensity is power / (4π). With `soft_falloff` the sphere is replaced by a disk that always faces the
    lit point, which is Blender's light of that name: it stays finite inside the radius.
    """

    position: tuple[float, float, float]
    power: Color
    radius: float = 0.0
    soft_falloff: bool = False
    cast_shadow: bool = True
    name: str = ""
    visibility: int = VISIBLE_TO_SURFACES


@dataclass(frozen=True)
class SpotLight(PointLight):
    """A point light behind a cone.

    `matrix` is the lamp's (4, 4) object-to-world matrix; the cone is circular in the lamp's own space, so a stretched
    lamp has an elliptic one. `spot_size` is the full angle of the cone in radians; `blend`, 0 to 1, the share of it
    over which the light fades.
    """

    matrix: np.ndarray = field(default_factory=lambda: np.eye(4))
    spot_size: float = np.pi / 4
    blend: float = 0.15


@dataclass(frozen=True)
class SunLight:
    """A disk of `angle` radians (the full angle) infinitely far away.

    `direction` is the unit vector *towards* the sun; `irradiance`, in W/m² per channel, falls on a surface that
    faces it, whatever the angle.
    """

    direction: tuple[float, float, float]
    irradiance: Color
    angle: float = 0.0
    cast_shadow: bool = True
    name: str = ""
    visibility: int = VISIBLE_TO_SURFACES


Light = AreaLight | PointLight | SpotLight | SunLight


@dataclass(frozen=True)
class Scene:
    """Everything that a picture needs. `world` is the radiance of the background, in W/(m² sr), by direction."""

    camera: Camera
    instances: tuple[Instance, ...] = ()
    lights: tuple[Light, ...] = ()
    world: Value = (0.0, 0.0, 0.0)
