"""What a surface does with light: Blender's shader nodes, as trees whose inputs are `values.Value`s.

A material's tree is flattened into *lobes* (`lobes`), the summands of its BSDF, each with a weight. `normal` None is
the surface's own shading normal. Colours are shares of light, 0 to 1; emitted radiance is in W/(m² sr).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from .values import Expression, Value

#: The microfacet distributions: GGX (Walter et al. 2007), GGX made brighter by what single scattering loses, and the
#: cosine-power lobe about the mirror direction (Phong 1975; Suffern 2007, ch. 25).
Distribution = Literal["ggx", "multiscatter_ggx"]
GlossyDistribution = Literal["ggx", "multiscatter_ggx", "cosine_power"]


@dataclass(frozen=True, eq=False)
class Shader:
    """Base of everything that can be a material's surface."""


@dataclass(frozen=True, eq=False)
class Diffuse(Shader):
    """Lambert's reflection, or with a roughness Oren and Nayar's."""

    color: Value = (0.8, 0.8, 0.8)
    roughness: Value = 0.0
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class Glossy(Shader):
    """Reflection by rough mirrors without Fresnel: Blender's Glossy BSDF."""

    color: Value = (0.8, 0.8, 0.8)
    roughness: Value = 0.5
    distribution: GlossyDistribution = "multiscatter_ggx"
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class Metallic(Shader):
    """A conductor: Blender's Metallic BSDF. F82 tint (`base`, `edge_tint`), or Fresnel's equations for a complex ior.

    With `physical`, `base` and `edge_tint` are the index of refraction n and the extinction k, per channel.
    """

    base: Value = (0.617, 0.577, 0.540)
    edge_tint: Value = (0.695, 0.726, 0.770)
    physical: bool = False
    roughness: Value = 0.5
    distribution: Distribution = "multiscatter_ggx"
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class Glass(Shader):
    """Reflection and refraction at a dielectric's surface, shared out by Fresnel."""

    color: Value = (1.0, 1.0, 1.0)
    roughness: Value = 0.0
    ior: Value = 1.5
    distribution: Distribution = "multiscatter_ggx"
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class Refraction(Shader):
    """Refraction alone, without Fresnel."""

    color: Value = (1.0, 1.0, 1.0)
    roughness: Value = 0.0
    ior: Value = 1.45
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class Transparent(Shader):
    """Light goes straight on, tinted."""

    color: Value = (1.0, 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Translucent(Shader):
    """Lambert's lobe on the other side."""

    color: Value = (0.8, 0.8, 0.8)
    normal: Expression | None = None


@dataclass(frozen=True, eq=False)
class Emission(Shader):
    """Radiance `color` × `strength`, W/(m² sr), from both sides."""

    color: Value = (1.0, 1.0, 1.0)
    strength: Value = 1.0


@dataclass(frozen=True, eq=False)
class Principled(Shader):
    """Blender's Principled BSDF without subsurface, sheen, thin film and anisotropy."""

    base_color: Value = (0.8, 0.8, 0.8)
    metallic: Value = 0.0
    roughness: Value = 0.5
    ior: Value = 1.5
    alpha: Value = 1.0
    normal: Expression | None = None
    diffuse_roughness: Value = 0.0
    specular_level: Value = 0.5
    specular_tint: Value = (1.0, 1.0, 1.0)
    transmission: Value = 0.0
    coat: Value = 0.0
    coat_roughness: Value = 0.03
    coat_ior: Value = 1.5
    coat_tint: Value = (1.0, 1.0, 1.0)
    coat_normal: Expression | None = None
    emission_color: Value = (1.0, 1.0, 1.0)
    emission_strength: Value = 0.0
    distribution: Distribution = "multiscatter_ggx"


@dataclass(frozen=True, eq=False)
class MixShader(Shader):
    """`a` and `b` in the shares 1 - factor and factor; None is a shader that does nothing."""

    factor: Value
    a: Shader | None
    b: Shader | None


@dataclass(frozen=True, eq=False)
class AddShader(Shader):
    """The sum of two shaders."""

    a: Shader | None
    b: Shader | None
