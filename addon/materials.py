"""Blender's materials as the renderer's `Material`: a Lambertian reflectance and an emission.

Known surfaces are Principled BSDF (base colour and emission), Diffuse BSDF, Emission, and an Add Shader of a reflecting
and an emitting one. Their colours may be constant or come from a Checker or Image Texture, looked up by UV, generated
or object coordinates. Everything else is replaced by the nearest of these, and each material says so in one warning
that names its nodes.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy
import numpy as np

from . import images, versions
from ._core import core
from .nodes import Color, Source, constant_color, constant_number, find_input, label, surface_of, trace

BLACK: Color = (0.0, 0.0, 0.0)
GREY: Color = core.scene.DEFAULT_GREY

#: Inputs of a Principled BSDF that change what a Lambertian surface can show, and the value at which they do not.
PRINCIPLED_IGNORED = {
    "Metallic": 0.0,
    "Alpha": 1.0,
    "Transmission Weight": 0.0,
    "Subsurface Weight": 0.0,
    "Coat Weight": 0.0,
    "Sheen Weight": 0.0,
}

COORDINATES = {"UV": "uv", "Generated": "generated", "Object": "object"}
EXTENSIONS = {"REPEAT": "repeat", "MIRROR": "mirror", "EXTEND": "extend", "CLIP": "clip"}


@dataclass(frozen=True)
class ExportedMaterial:
    """A material, and the UV map that its textures look up: a name, "" for the mesh's own choice, None for none."""

    material: core.scene.Material
    uv_map: str | None = None


@dataclass(frozen=True)
class Surface:
    """The part of a shader that is known. None: the shader has nothing of the kind."""

    albedo: Color | core.scene.Texture | None = None
    emission: Color | core.scene.Texture | None = None
    strength: float = 1.0


class MaterialExporter:
    """Turns materials into the renderer's, each material and each image once. Warnings gather in `warnings`."""

    def __init__(self) -> None:
        self.warnings: list[str] = []
        self._materials: dict[int, ExportedMaterial] = {}
        self._images: dict[int, tuple[np.ndarray, str | None]] = {}
        self._default = ExportedMaterial(core.scene.Material())

    def export(self, material: bpy.types.Material | None) -> ExportedMaterial:
        """The renderer's material; None, an empty slot, is Blender's default grey."""
        if material is None:
            return self._default
        key = material.as_pointer()
        if key not in self._materials:
            self._materials[key] = self._read(material)
        return self._materials[key]

    def _read(self, material: bpy.types.Material) -> ExportedMaterial:
        if not versions.uses_nodes(material):
            return ExportedMaterial(core.scene.Material(material.name, tuple(material.diffuse_color)[:3]))
        reader = _TreeReader(self._image)
        surface = reader.tree(material.node_tree)
        if (text := reader.warning()) is not None:
            self.warnings.append(f'material "{material.name}": {text}')
        exported = core.scene.Material(
            material.name,
            BLACK if surface.albedo is None else surface.albedo,
            BLACK if surface.emission is None else surface.emission,
            surface.strength,
        )
        return ExportedMaterial(exported, reader.uv_map)

    def _image(self, image: bpy.types.Image | None) -> tuple[np.ndarray, str | None]:
        key = 0 if image is None else image.as_pointer()
        if key not in self._images:
            self._images[key] = images.read_image(image)
        return self._images[key]


@dataclass
class _TreeReader:
    """Reads one material's nodes, and remembers what it had to replace."""

    read_image: object
    uv_map: str | None = None
    replaced: list[str] = field(default_factory=list)
    ignored: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def warning(self) -> str | None:
        """All that was lost, in one line."""
        parts = []
        if self.replaced:
            parts.append(f"Rooks does not know the nodes {_names(self.replaced)} and uses the nearest that it knows")
        if self.ignored:
            parts.append(f"Rooks does not use {', '.join(dict.fromkeys(self.ignored))}")
        parts += dict.fromkeys(self.problems)
        return "; ".join(parts) or None

    def tree(self, tree: bpy.types.NodeTree) -> Surface:
        output = tree.get_output_node("CYCLES")
        for name in ("Volume", "Displacement"):
            if output is not None and not trace(output.inputs[name]).is_constant:
                self.ignored.append(f'the {name} of the node "{label(output)}"')
        return self.shader(surface_of(tree))

    def shader(self, source: Source | None) -> Surface:
        """The known part of what feeds a shader socket."""
        if source is None or source.is_constant:
            return Surface()
        read = {
            "BSDF_PRINCIPLED": self._principled,
            "BSDF_DIFFUSE": self._diffuse,
            "EMISSION": self._emission,
            "ADD_SHADER": self._add,
        }
        return read.get(source.node.type, self._unknown_shader)(source)

    def _principled(self, source: Source) -> Surface:
        for name, neutral in PRINCIPLED_IGNORED.items():
            self._ignore_unless(source, name, neutral)
        self._ignore_normal(source)
        strength = self._number(source, "Emission Strength")
        emission = self._color(source.input("Emission Color")) if strength else None
        return Surface(self._color(source.input("Base Color")), emission, strength)

    def _diffuse(self, source: Source) -> Surface:
        self._ignore_unless(source, "Roughness", 0.0)
        self._ignore_normal(source)
        return Surface(self._color(source.input("Color")))

    def _emission(self, source: Source) -> Surface:
        return Surface(None, self._color(source.input("Color")), self._number(source, "Strength"))

    def _add(self, source: Source) -> Surface:
        first, second = (self.shader(trace(socket, source.groups)) for socket in source.node.inputs)
        if (first.albedo and second.albedo) or (first.emission and second.emission):
            self.replaced.append(label(source.node))
        lit = first if first.emission else second
        return Surface(first.albedo or second.albedo, lit.emission, lit.strength)

    def _unknown_shader(self, source: Source) -> Surface:
        """The first shader that it is made from, else a Lambertian surface of its colour."""
        self.replaced.append(label(source.node))
        shaders = (trace(socket, source.groups) for socket in source.node.inputs if socket.type == "SHADER")
        if (first := next((shader for shader in shaders if not shader.is_constant), None)) is not None:
            return self.shader(first)
        colors = (socket for socket in source.node.inputs if socket.type == "RGBA")
        if (color := next(colors, None)) is not None:
            return Surface(self._color(trace(color, source.groups)))
        return Surface(GREY)

    def _color(self, source: Source) -> Color | core.scene.Texture:
        """What feeds a colour socket: a constant or a texture."""
        constant = constant_color(source)
        if constant is not None:
            return constant
        if source.node.type == "TEX_CHECKER":
            return self._checker(source)
        if source.node.type == "TEX_IMAGE":
            return self._image_texture(source)
        return self._unknown_color(source)

    def _unknown_color(self, source: Source) -> Color | core.scene.Texture:
        """The first linked colour that it is made from, else its own colour."""
        self.replaced.append(label(source.node))
        if source.node.type == "VALTORGB":
            return tuple(source.node.color_ramp.evaluate(0.5))[:3]
        inputs = [trace(s, source.groups) for s in source.node.inputs if s.type == "RGBA" and s.enabled]
        if not inputs:
            return (0.5, 0.5, 0.5)
        return self._color(next((linked for linked in inputs if not linked.is_constant), inputs[0]))

    def _checker(self, source: Source) -> core.scene.Checker:
        scale = self._number(source, "Scale")
        coordinates = self._coordinates(source, "generated")
        if source.output.identifier == "Fac":
            return core.scene.Checker((1.0, 1.0, 1.0), BLACK, scale, coordinates)
        color1, color2 = (self._constant_of(source, name) for name in ("Color1", "Color2"))
        return core.scene.Checker(color1, color2, scale, coordinates)

    def _image_texture(self, source: Source) -> core.scene.ImageTexture:
        node = source.node
        coordinates = self._coordinates(source, "uv")
        if node.projection != "FLAT" or source.output.identifier != "Color" or node.interpolation == "Cubic":
            self.replaced.append(label(node))
        pixels, problem = self.read_image(node.image)
        if problem is not None:
            self.problems.append(f'node "{label(node)}": {problem}')
        return core.scene.ImageTexture(
            pixels,
            EXTENSIONS[node.extension],
            "closest" if node.interpolation == "Closest" else "linear",
            coordinates,
        )

    def _coordinates(self, source: Source, default: str) -> str:
        """The space that feeds a texture's Vector: uv, generated or object."""
        feed = source.input("Vector")
        while not feed.is_constant and feed.node.type == "MAPPING":
            if not _is_identity(feed):
                self.replaced.append(label(feed.node))
            feed = feed.input("Vector")
        coordinates = default
        if not feed.is_constant:
            coordinates = self._named_coordinates(feed, default)
        if coordinates == "uv" and self.uv_map is None:
            self.uv_map = ""
        return coordinates

    def _named_coordinates(self, feed: Source, default: str) -> str:
        if feed.node.type == "UVMAP" and not feed.node.from_instancer:
            if self.uv_map not in (None, feed.node.uv_map):
                self.problems.append(f'of its UV maps only "{self.uv_map}" is used')
            else:
                self.uv_map = feed.node.uv_map
            return "uv"
        known = feed.node.type == "TEX_COORD" and feed.output.name in COORDINATES
        if not known or feed.node.from_instancer or (feed.output.name == "Object" and feed.node.object is not None):
            self.replaced.append(label(feed.node))
        return COORDINATES[feed.output.name] if known else default

    def _constant_of(self, source: Source, name: str) -> Color:
        """A colour that has to be constant: where it is not, the socket's own colour."""
        feed = source.input(name)
        color = constant_color(feed)
        if color is None:
            self.replaced.append(label(feed.node))
            color = tuple(find_input(source.node, name).default_value)[:3]
        return color

    def _number(self, source: Source, name: str) -> float:
        """A number that has to be constant: where it is not, the socket's own value."""
        feed = source.input(name)
        number = constant_number(feed)
        if number is None:
            self.replaced.append(label(feed.node))
            number = find_input(source.node, name).default_value
        return number

    def _ignore_unless(self, source: Source, name: str, neutral: float) -> None:
        feed = source.input(name)
        if feed is not None and constant_number(feed) != neutral:
            self.ignored.append(f'the {name} of the node "{label(source.node)}"')

    def _ignore_normal(self, source: Source) -> None:
        feed = source.input("Normal")
        if feed is not None and not feed.is_constant:
            self.ignored.append(f'the Normal of the node "{label(source.node)}"')


def _is_identity(mapping: Source) -> bool:
    """Whether a Mapping node changes nothing."""
    if mapping.node.vector_type not in ("POINT", "TEXTURE"):
        return False
    neutral = {"Location": (0, 0, 0), "Rotation": (0, 0, 0), "Scale": (1, 1, 1)}
    feeds = ((mapping.input(name), value) for name, value in neutral.items())
    return all(feed is None or (feed.is_constant and constant_color(feed) == value) for feed, value in feeds)


def _names(nodes: list[str]) -> str:
    return ", ".join(f'"{name}"' for name in dict.fromkeys(nodes))
