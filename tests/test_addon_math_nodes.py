"""Nodes that compute become the core's expressions, or compositions of them that compute the same."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from core.values import (  # noqa: E402
    BLENDS,
    MATHS,
    Checker,
    Combine,
    Component,
    Gray,
    MapRange,
    Math,
    Mix,
)
from tests.addon_helpers import empty_scene, fed, feed, plain, value_of  # noqa: E402

CHECKS = Checker((0.8,) * 3, (0.2,) * 3, 5.0)
VECTOR = (0.25, 0.5, 0.75)


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def becomes(paint, expected, lost: str | None = None) -> None:
    value, warnings = value_of(paint)
    assert plain(value) == plain(expected)
    assert [lost in warning for warning in warnings] == ([] if lost is None else [True])


def test_rgb_and_value():
    node, paint = fed("ShaderNodeRGB")
    node.outputs[0].default_value = (*VECTOR, 1)
    becomes(paint, VECTOR)
    node, paint = fed("ShaderNodeValue")
    node.outputs[0].default_value = 0.25
    becomes(paint, 0.25)


# Mix


@pytest.mark.parametrize(("clamp_factor", "clamp_result"), [(True, False), (False, True)])
def test_mixed_colours(clamp_factor, clamp_result):
    node, paint = fed("ShaderNodeMix", "Result", data_type="RGBA", blend_type="SOFT_LIGHT")
    node.clamp_factor, node.clamp_result = clamp_factor, clamp_result
    a, b = (socket for socket in node.inputs if socket.enabled and socket.type == "RGBA")
    a.default_value, b.default_value = (*VECTOR, 1), (1, 1, 1, 1)
    node.inputs["Factor"].default_value = 0.125
    becomes(paint, Mix(0.125, VECTOR, (1.0, 1.0, 1.0), "soft_light", clamp_factor, clamp_result))


def test_every_blend_mode_is_known():
    modes = bpy.types.ShaderNodeMix.bl_rna.properties["blend_type"].enum_items
    assert {mode.identifier.lower() for mode in modes} == set(BLENDS)


def test_mixed_numbers():
    node, paint = fed("ShaderNodeMix", "Result", clamp_factor=False)
    numbers = [socket for socket in node.inputs if socket.enabled]
    for socket, number in zip(numbers, (0.125, 2, 3), strict=True):
        socket.default_value = number
    becomes(paint, Mix(0.125, 2.0, 3.0, clamp_factor=False))


def mixed_vectors(mode: str):
    node, paint = fed("ShaderNodeMix", "Result", data_type="VECTOR", factor_mode=mode)
    a, b = [socket for socket in node.inputs if socket.enabled and socket.type == "VECTOR"][-2:]
    a.default_value, b.default_value = VECTOR, (1, 2, 3)
    return node, paint


def test_mixed_vectors():
    node, paint = mixed_vectors("UNIFORM")
    node.inputs["Factor"].default_value = 0.5
    becomes(paint, Mix(0.5, VECTOR, (1.0, 2.0, 3.0)))


def test_vectors_mixed_by_a_vector_are_mixed_by_component():
    node, paint = mixed_vectors("NON_UNIFORM")
    node.inputs["Factor"].default_value = (0, 0.5, 1)
    parts = [Mix(Component((0.0, 0.5, 1.0), i), Component(VECTOR, i), Component((1.0, 2.0, 3.0), i)) for i in range(3)]
    becomes(paint, Combine(*parts))


def test_the_older_mix_of_colours():
    node, paint = fed("ShaderNodeMixRGB", blend_type="BURN", use_clamp=True)
    node.inputs["Color1"].default_value = (*VECTOR, 1)
    becomes(paint, Mix(0.5, VECTOR, (0.5, 0.5, 0.5), "burn", clamp_result=True))


# Math


def test_every_operation_is_known():
    operations = bpy.types.ShaderNodeMath.bl_rna.properties["operation"].enum_items
    assert {operation.identifier.lower() for operation in operations} == set(MATHS)


@pytest.mark.parametrize("operation", ["ADD", "MULTIPLY_ADD", "SQRT"])
@pytest.mark.parametrize("clamp", [True, False])
def test_math(operation, clamp):
    node, paint = fed("ShaderNodeMath", operation=operation, use_clamp=clamp)
    for socket, number in zip(node.inputs, (2, 3, 4), strict=True):
        socket.default_value = number
    becomes(paint, Math(operation.lower(), 2.0, 3.0, 4.0, clamp))


def test_math_of_a_colour_is_of_its_luminance():
    node, paint = fed("ShaderNodeMath", operation="SQRT")
    feed(node.inputs[0], "ShaderNodeTexChecker")
    becomes(paint, Math("sqrt", Gray(CHECKS), 0.5, 0.5))


# Map Range


def ranged(kind: str, interpolation: str, clamp: bool):
    node, paint = fed("ShaderNodeMapRange", 1 if kind == "FLOAT_VECTOR" else 0)
    node.data_type, node.interpolation_type, node.clamp = kind, interpolation, clamp
    return node, paint


@pytest.mark.parametrize("clamp", [True, False])
@pytest.mark.parametrize("interpolation", ["LINEAR", "SMOOTHSTEP", "SMOOTHERSTEP"])
def test_map_range(interpolation, clamp):
    node, paint = ranged("FLOAT", interpolation, clamp)
    for socket, number in zip(node.inputs[:5], (0.25, 1, 2, 3, 4), strict=True):
        socket.default_value = number
    becomes(paint, MapRange(0.25, 1.0, 2.0, 3.0, 4.0, interpolation.lower(), clamp))


def test_steps_are_named():
    _node, paint = ranged("FLOAT", "STEPPED", True)
    becomes(paint, MapRange(1.0), "its steps are rendered as an even slope")


def test_a_vector_is_mapped_by_component():
    node, paint = ranged("FLOAT_VECTOR", "LINEAR", False)
    node.inputs["Vector"].default_value = VECTOR
    ranges = [(0.0,) * 3, (1.0,) * 3, (0.0,) * 3, (1.0,) * 3]
    parts = [MapRange(*(Component(part, i) for part in (VECTOR, *ranges)), clamp=False) for i in range(3)]
    becomes(paint, Combine(*parts))


# Clamp


def test_clamp():
    node, paint = fed("ShaderNodeClamp")
    for socket, number in zip(node.inputs, (5, 2, 1), strict=True):
        socket.default_value = number
    becomes(paint, Math("minimum", Math("maximum", 5.0, 2.0), 1.0))
    node.clamp_type = "RANGE"
    low, high = Math("minimum", 2.0, 1.0), Math("maximum", 2.0, 1.0)
    becomes(paint, Math("minimum", Math("maximum", 5.0, low), high))


# Separate and Combine

LEGACY = ["ShaderNodeSeparateRGB"] if hasattr(bpy.types, "ShaderNodeSeparateRGB") else []


@pytest.mark.parametrize("index", range(3))
@pytest.mark.parametrize("kind", ["ShaderNodeSeparateColor", "ShaderNodeSeparateXYZ", *LEGACY])
def test_separate(kind, index):
    node, paint = fed(kind, index)
    feed(node.inputs[0], "ShaderNodeTexChecker")
    becomes(paint, Component(CHECKS, index))


@pytest.mark.parametrize(
    "kind",
    ["ShaderNodeCombineColor", "ShaderNodeCombineXYZ", *(name.replace("Separate", "Combine") for name in LEGACY)],
)
def test_combine(kind):
    node, paint = fed(kind)
    for socket, number in zip(node.inputs, VECTOR, strict=True):
        socket.default_value = number
    becomes(paint, Combine(*VECTOR))


@pytest.mark.parametrize("mode", ["HSV", "HSL"])
def test_other_models_of_colour_are_named(mode):
    separate, paint = fed("ShaderNodeSeparateColor", mode=mode)
    becomes(paint, Component((0.8,) * 3, 0), f'node "Separate Color": its {mode} components are taken for RGB')
    feed(separate.inputs[0], "ShaderNodeCombineColor", mode=mode)
    becomes(paint, Component(Combine(0.0, 0.0, 0.0), 0), f'node "Combine Color": its {mode} components')


# What is composed of others


def with_color(kind: str, **inputs):
    node, paint = fed(kind)
    node.inputs["Color"].default_value = (*VECTOR, 1)
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return node, paint


def test_rgb_to_bw():
    becomes(with_color("ShaderNodeRGBToBW")[1], Gray(VECTOR))


def test_invert():
    node, paint = with_color("ShaderNodeInvert")
    node.inputs[0].default_value = 0.75
    becomes(paint, Mix(0.75, VECTOR, Mix(1.0, 1.0, VECTOR, "subtract"), clamp_factor=False))


def test_gamma():
    _node, paint = with_color("ShaderNodeGamma", Gamma=2)
    becomes(paint, Combine(*(Math("power", Component(VECTOR, i), 2.0) for i in range(3))))


def test_brightness_and_contrast_are_a_line():
    node, paint = with_color("ShaderNodeBrightContrast", Contrast=0.5)
    node.inputs[1].default_value = 0.25
    offset, slope = Math("multiply_add", 0.5, -0.5, 0.25), Math("add", 1.0, 0.5)
    line = Mix(1.0, Mix(1.0, VECTOR, slope, "multiply"), offset, "add")
    becomes(paint, Mix(1.0, line, 0.0, "lighten"))


def test_the_value_of_a_colour_is_changed_and_its_hue_is_named():
    node, paint = with_color("ShaderNodeHueSaturation", Value=2)
    becomes(paint, Mix(1.0, VECTOR, tuple(np.multiply(VECTOR, 2.0).tolist()), clamp_factor=False))
    node.inputs["Hue"].default_value = 0.25
    becomes(paint, Mix(1.0, VECTOR, (0.5, 1.0, 1.5), clamp_factor=False), node.name)
