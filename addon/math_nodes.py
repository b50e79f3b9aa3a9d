"""Nodes that compute with colours, numbers and vectors: Mix, Math, Map Range, Separate, Combine and so on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bpy.app.translations import pgettext_rpt as rpt_

from ._core import core
from .arithmetic import by_component, product
from .blackbody import blackbody
from .nodes import Source, socket_value

if TYPE_CHECKING:
    from .values import ValueReader

values = core.values
Value = core.values.Value

#: The inputs of the Map Range node that hold numbers, and those that hold vectors.
RANGE = ("Value", "From Min", "From Max", "To Min", "To Max")
VECTOR_RANGE = ("Vector", "From_Min_FLOAT3", "From_Max_FLOAT3", "To_Min_FLOAT3", "To_Max_FLOAT3")
COMPONENTS = {"Red": 0, "Green": 1, "Blue": 2, "X": 0, "Y": 1, "Z": 2, "R": 0, "G": 1, "B": 2}


def read_constant(_reader: ValueReader, source: Source) -> Value:
    """RGB, Value."""
    return socket_value(source.output)


def read_mix(reader: ValueReader, source: Source) -> Value:
    """Mix of numbers, vectors or colours."""
    node = source.node
    if node.data_type == "ROTATION":
        reader.losses.add_for(node, rpt_("rotations are not mixed, and taken for 0"))
        return 0.0
    kind = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}[node.data_type]
    a, b = reader.input(source, f"A_{kind}"), reader.input(source, f"B_{kind}")
    if node.data_type == "VECTOR" and node.factor_mode == "NON_UNIFORM":
        factor = reader.input(source, "Factor_Vector")
        return by_component(lambda *part: values.Mix(*part, clamp_factor=node.clamp_factor), factor, a, b)
    factor = reader.input(source, "Factor_Float")
    if node.data_type != "RGBA":
        return values.Mix(factor, a, b, clamp_factor=node.clamp_factor)
    return values.Mix(factor, a, b, node.blend_type.lower(), node.clamp_factor, node.clamp_result)


def read_mix_color(reader: ValueReader, source: Source) -> Value:
    """Mix Color, the older node for colours alone."""
    node = source.node
    factor, a, b = (reader.input(source, name) for name in ("Fac", "Color1", "Color2"))
    return values.Mix(factor, a, b, node.blend_type.lower(), clamp_result=node.use_clamp)


def read_math(reader: ValueReader, source: Source) -> Value:
    node = source.node
    operands = (reader.input(source, name) for name in ("Value", "Value_001", "Value_002"))
    return values.Math(node.operation.lower(), *operands, clamp=node.use_clamp)


def read_map_range(reader: ValueReader, source: Source) -> Value:
    """Map Range of a number or, component by component, of a vector."""
    node = source.node
    if node.interpolation_type == "STEPPED":
        reader.losses.add_for(node, rpt_("its steps are rendered as an even slope"))
    interpolation = {"SMOOTHSTEP": "smoothstep", "SMOOTHERSTEP": "smootherstep"}.get(node.interpolation_type, "linear")

    def map_range(*part: Value) -> Value:
        return values.MapRange(*part, interpolation=interpolation, clamp=node.clamp)

    if node.data_type == "FLOAT":
        return map_range(*(reader.input(source, name) for name in RANGE))
    return by_component(map_range, *(reader.input(source, name) for name in VECTOR_RANGE))


def read_clamp(reader: ValueReader, source: Source) -> Value:
    value, low, high = (reader.input(source, name) for name in ("Value", "Min", "Max"))
    if source.node.clamp_type == "RANGE":  # the bounds may be the wrong way round
        low, high = values.Math("minimum", low, high), values.Math("maximum", low, high)
    return values.Math("minimum", values.Math("maximum", value, low), high)


def read_separate(reader: ValueReader, source: Source) -> Value:
    """Separate Color, XYZ, RGB."""
    color, index = reader.input(source, source.node.inputs[0].identifier), COMPONENTS[source.output.identifier]
    if getattr(source.node, "mode", "RGB") == "HSV" and index > 0:
        return _saturation_or_value(color, index)
    _check_mode(reader, source)
    return values.Component(color, index)


def read_combine(reader: ValueReader, source: Source) -> Value:
    """Combine Color, XYZ, RGB."""
    _check_mode(reader, source)
    return values.Combine(*(reader.input(source, socket.identifier) for socket in source.node.inputs))


def read_blackbody(reader: ValueReader, source: Source) -> Value:
    """Blackbody. Its temperature has to be constant."""
    return blackbody(reader.constant(source, "Temperature")[0])


def read_gray(reader: ValueReader, source: Source) -> Value:
    """RGB to BW."""
    return values.Gray(reader.input(source, "Color"))


def read_invert(reader: ValueReader, source: Source) -> Value:
    color = reader.input(source, "Color")
    inverse = values.Mix(1.0, 1.0, color, "subtract")
    return values.Mix(reader.input(source, "Fac"), color, inverse, clamp_factor=False)


def read_gamma(reader: ValueReader, source: Source) -> Value:
    gamma = reader.input(source, "Gamma")
    return by_component(lambda part: values.Math("power", part, gamma), reader.input(source, "Color"))


def read_brightness(reader: ValueReader, source: Source) -> Value:
    """Brightness/Contrast: (1 + contrast) × colour + brightness - contrast / 2, at least 0."""
    contrast = reader.input(source, "Contrast")
    offset = values.Math("multiply_add", contrast, -0.5, reader.input(source, "Bright"))
    scaled = product(reader.input(source, "Color"), values.Math("add", 1.0, contrast))
    return values.Mix(1.0, values.Mix(1.0, scaled, offset, "add"), 0.0, "lighten")


def read_hue_saturation(reader: ValueReader, source: Source) -> Value:
    """Hue/Saturation/Value, of which only the value is known."""
    hue, saturation = reader.input(source, "Hue"), reader.input(source, "Saturation")
    if (hue, saturation) != (0.5, 1.0):
        reader.losses.add_for(source.node, rpt_("its Hue and its Saturation are not used"))
    color = reader.input(source, "Color")
    changed = product(color, reader.input(source, "Value"))
    return values.Mix(reader.input(source, "Fac"), color, changed, clamp_factor=False)


def _saturation_or_value(color: Value, index: int) -> Value:
    """Component 1 or 2 of a colour as hue, saturation and value (Smith 1978)."""
    red, green, blue = (values.Component(color, channel) for channel in range(3))
    brightest = values.Math("maximum", values.Math("maximum", red, green), blue)
    if index == 2:
        return brightest
    darkest = values.Math("minimum", values.Math("minimum", red, green), blue)
    return values.Math("divide", values.Math("subtract", brightest, darkest), brightest)


def _check_mode(reader: ValueReader, source: Source) -> None:
    """Name a node that means other components than red, green and blue, which stand in for them."""
    mode = getattr(source.node, "mode", "RGB")
    if mode != "RGB":
        reader.losses.add_for(source.node, rpt_("its {mode} components are taken for RGB").format(mode=mode))


READERS = {
    "RGB": read_constant,
    "VALUE": read_constant,
    "MIX": read_mix,
    "MIX_RGB": read_mix_color,
    "MATH": read_math,
    "MAP_RANGE": read_map_range,
    "CLAMP": read_clamp,
    "SEPARATE_COLOR": read_separate,
    "SEPRGB": read_separate,
    "SEPXYZ": read_separate,
    "COMBINE_COLOR": read_combine,
    "COMBRGB": read_combine,
    "COMBXYZ": read_combine,
    "BLACKBODY": read_blackbody,
    "RGBTOBW": read_gray,
    "INVERT": read_invert,
    "GAMMA": read_gamma,
    "BRIGHTCONTRAST": read_brightness,
    "HUE_SAT": read_hue_saturation,
}
