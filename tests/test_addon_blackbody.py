"""What glows with heat has the colour that Cycles gives it, and light of its own white."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.blackbody import COLDEST, blackbody  # noqa: E402
from tests.addon_helpers import empty_scene, export, fed, feed, quad, render_with_cycles, shader, value_of  # noqa: E402


@pytest.fixture(autouse=True)
def _scene():
    empty_scene(4, 4)


@pytest.mark.parametrize("kelvin", [2000, 3000, 5000, 9000])
def test_the_colour_is_that_of_cycles(kelvin, tmp_path):
    paint, emission = shader("ShaderNodeEmission")
    feed(emission.inputs["Color"], "ShaderNodeBlackbody").inputs["Temperature"].default_value = kelvin
    quad(size=20).data.materials.append(paint)
    (instance,) = export()[0].instances
    theirs = render_with_cycles(tmp_path / "glow.exr")[2, 2]
    np.testing.assert_allclose(instance.materials[0].surface.color, theirs, rtol=0.02, atol=0.01)


@pytest.mark.parametrize("kelvin", [3000, 6500, 12000])
def test_its_luminance_is_1(kelvin):
    assert np.dot(blackbody(kelvin), (0.2126729, 0.7151522, 0.0721750)) == pytest.approx(1, rel=1e-3)


def test_daylight_is_nearly_white():
    assert blackbody(6500) == pytest.approx((1, 1, 1), abs=0.06)


def test_what_is_colder_than_glowing_has_the_coldest_colour():
    assert blackbody(-5) == blackbody(COLDEST)


def test_a_temperature_that_varies_is_named():
    node, paint = fed("ShaderNodeBlackbody", name="Fire")
    node.inputs["Temperature"].default_value = 3000
    feed(node.inputs["Temperature"], "ShaderNodeTexChecker")
    assert value_of(paint) == (
        blackbody(3000),
        ['material "Paint": Rooks does not use the Temperature of the node "Fire"'],
    )
