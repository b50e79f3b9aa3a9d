"""Shader nodes as the renderer's shaders (`core.shaders`), with the values that feed them.

Shaders that are not known are replaced by the nearest that is: the first shader that they are made from, else a
diffuse surface of their colour.
"""

from __future__ import annotations

from collections.abc import Callable

from bpy.app.translations import pgettext_rpt as rpt_

from ._core import core
from .losses import Losses
from .nodes import Source, find_input, trace
from .values import Value, ValueReader

shaders = core.shaders
Shader = core.shaders.Shader

#: The fields of `core.shaders.Principled`, and the inputs that they come from.
PRINCIPLED = {
    "base_color": "Base Color",
    "metallic": "Metallic",
    "roughness": "Roughness",
    "ior": "IOR",
    "alpha": "Alpha",
    "diffuse_roughness": "Diffuse Roughness",
    "specular_level": "Specular IOR Level",
    "specular_tint": "Specular Tint",
    "transmission": "Transmission Weight",
    "coat": "Coat Weight",
    "coat_roughness": "Coat Roughness",
    "coat_ior": "Coat IOR",
    "coat_tint": "Coat Tint",
    "emission_color": "Emission Color",
    "emission_strength": "Emission Strength",
}
#: What inputs that are numbers are kept to, as in Cycles but for the largest index.
SHARE = (0.0, 1.0)
LIMITS = {
    "IOR": (core.limits.LEAST_INDEX, core.limits.LARGEST_INDEX),
    "Coat IOR": (1.0, core.limits.LARGEST_INDEX),
    "Alpha": SHARE,
    "Coat Roughness": SHARE,
    "Diffuse Roughness": SHARE,
    "Fac": SHARE,
    "Metallic": SHARE,
    "Roughness": SHARE,
    "Transmission Weight": SHARE,
}
#: Inputs of shaders that are not modelled. Unless they are 0, they change what is seen.
NOT_MODELLED = ("Subsurface Weight", "Sheen Weight", "Thin Film Thickness", "Anisotropic", "Anisotropy", "Thin Wall")

DISTRIBUTIONS = {"GGX": "ggx", "MULTI_GGX": "multiscatter_ggx"}


class ShaderReader:
    """Reads one material's shaders. `glossy_lobe` is the material's choice of what its Glossy BSDF nodes are."""

    def __init__(self, values: ValueReader, losses: Losses, glossy_lobe: str) -> None:
        self._values = values
        self._losses = losses
        self._glossy_lobe = glossy_lobe

    def shader(self, source: Source | None) -> Shader | None:
        """What feeds a shader socket; None where nothing does."""
        if source is None or source.is_constant:
            return None
        if source.types[0] != "SHADER":  # a colour or a number that is linked to a shader is emitted
            return shaders.Emission(self._values.value(source), 1.0)
        return _READERS.get(source.node.type, ShaderReader._unknown)(self, source)

    def _principled(self, source: Source) -> Shader:
        self._warn_of_inputs(source)
        fields = {field: name for field, name in PRINCIPLED.items() if source.input(name) is not None}
        return shaders.Principled(
            **{field: self._value(source, name) for field, name in fields.items()},
            normal=self._values.normal(source),
            coat_normal=self._values.normal(source, "Coat Normal"),
            distribution=DISTRIBUTIONS[source.node.distribution],
        )

    def _diffuse(self, source: Source) -> Shader:
        return shaders.Diffuse(
            self._value(source, "Color"), self._value(source, "Roughness"), self._values.normal(source)
        )

    def _glossy(self, source: Source) -> Shader:
        self._warn_of_inputs(source)
        color, roughness = self._value(source, "Color"), self._value(source, "Roughness")
        distribution = "cosine_power" if self._glossy_lobe == "COSINE_POWER" else self._distribution(source, roughness)
        return shaders.Glossy(color, roughness, distribution, self._values.normal(source))

    def _metallic(self, source: Source) -> Shader:
        self._warn_of_inputs(source)
        physical = source.node.fresnel_type == "PHYSICAL_CONDUCTOR"
        names = ("IOR", "Extinction") if physical else ("Base Color", "Edge Tint")
        base, edge_tint = (self._value(source, name) for name in names)
        roughness = self._value(source, "Roughness")
        distribution = self._distribution(source, roughness)
        return shaders.Metallic(base, edge_tint, physical, roughness, distribution, self._values.normal(source))

    def _glass(self, source: Source) -> Shader:
        self._warn_of_inputs(source)
        color, roughness, ior = (self._value(source, name) for name in ("Color", "Roughness", "IOR"))
        distribution = self._distribution(source, roughness)
        return shaders.Glass(color, roughness, ior, distribution, self._values.normal(source))

    def _refraction(self, source: Source) -> Shader:
        color, roughness, ior = (self._value(source, name) for name in ("Color", "Roughness", "IOR"))
        self._distribution(source, roughness)
        return shaders.Refraction(color, roughness, ior, self._values.normal(source))

    def _transparent(self, source: Source) -> Shader:
        return shaders.Transparent(self._value(source, "Color"))

    def _translucent(self, source: Source) -> Shader:
        return shaders.Translucent(self._value(source, "Color"), self._values.normal(source))

    def _emission(self, source: Source) -> Shader:
        return shaders.Emission(self._value(source, "Color"), self._value(source, "Strength"))

    def _mix(self, source: Source) -> Shader:
        first, second = self._shader_inputs(source)
        return shaders.MixShader(self._value(source, "Fac"), self.shader(first), self.shader(second))

    def _add(self, source: Source) -> Shader:
        first, second = self._shader_inputs(source)
        return shaders.AddShader(self.shader(first), self.shader(second))

    def _unknown(self, source: Source) -> Shader | None:
        self._losses.replace(source.node)
        linked = next((feed for feed in self._shader_inputs(source) if not feed.is_constant), None)
        if linked is not None:
            return self.shader(linked)
        color = next((socket for socket in source.node.inputs if socket.type == "RGBA" and socket.enabled), None)
        if color is None:
            return shaders.Diffuse(core.scene.DEFAULT_GREY)
        return shaders.Diffuse(self._value(source, color.identifier))

    def _value(self, source: Source, identifier: str) -> Value:
        socket = find_input(source.node, identifier)
        if identifier in LIMITS and socket is not None and socket.type == "VALUE":  # the IOR of a metal is a vector
            return self._values.limited(source, identifier, *LIMITS[identifier])
        return self._values.input(source, identifier)

    def _shader_inputs(self, source: Source) -> list[Source]:
        return [trace(socket, source.groups) for socket in source.node.inputs if socket.type == "SHADER"]

    def _distribution(self, source: Source, roughness: Value) -> str:
        """The node's microfacet distribution, or GGX for one that is not known. A smooth surface has none."""
        chosen = source.node.distribution
        if chosen not in DISTRIBUTIONS and roughness != 0.0:
            name = chosen.replace("_", "-").title()
            problem = rpt_("its {name} distribution is rendered as GGX").format(name=name)
            self._losses.add_for(source.node, problem)
        return DISTRIBUTIONS.get(chosen, "ggx")

    def _warn_of_inputs(self, source: Source) -> None:
        for name in NOT_MODELLED:
            if self._values.input(source, name) != 0.0:
                self._losses.ignore(name, source.node)


_READERS: dict[str, Callable[[ShaderReader, Source], Shader | None]] = {
    "BSDF_PRINCIPLED": ShaderReader._principled,
    "BSDF_DIFFUSE": ShaderReader._diffuse,
    "BSDF_GLOSSY": ShaderReader._glossy,
    "BSDF_METALLIC": ShaderReader._metallic,
    "BSDF_GLASS": ShaderReader._glass,
    "BSDF_REFRACTION": ShaderReader._refraction,
    "BSDF_TRANSPARENT": ShaderReader._transparent,
    "BSDF_TRANSLUCENT": ShaderReader._translucent,
    "EMISSION": ShaderReader._emission,
    "MIX_SHADER": ShaderReader._mix,
    "ADD_SHADER": ShaderReader._add,
}
