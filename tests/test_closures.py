"""Closures: nothing is lost where nothing should be, chances follow the light, and Cycles finds the same."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import closures, fresnel
from core.albedo_tables import load_tables
from core.jit import kernel
from core.lobe_record import (
    ALPHA,
    CHANCE,
    COSINE_POWER,
    ETA,
    GGX_REFLECTION,
    KIND,
    LAMBERT,
    NORMAL,
    OREN_NAYAR,
    REFLECTION_TINT,
    TRANSLUCENT,
    TRANSPARENT,
    WEIGHT,
)
from tests.closure_helpers import albedo, cycles_albedos, cycles_node, lobes_of, vector, view_at
from tests.lobe_helpers import UP, F, direction, evaluate, rule

ONE = F(1)
WHITE, GOLD, EDGE = vector((1, 1, 1)), vector((0.9, 0.6, 0.2)), vector((0.5, 0.7, 1))
SILVER_N, SILVER_K = vector((0.2, 0.9, 1.5)), vector((3.9, 2.4, 1.8))
N = vector(UP)
ROUGHNESSES = (0.05, 0.1, 0.2, 0.4, 0.7, 1.0)
DEGREES = (0, 30, 60, 75, 85, 89)


@kernel
def diffuse(lobes, weight, c, roughness, n):
    return closures.append_diffuse(lobes, 0, weight, c[0], c[1], c[2], roughness, n[0], n[1], n[2])


@kernel
def translucent(lobes, weight, c, n, view):
    return closures.append_translucent(lobes, 0, weight, c[0], c[1], c[2], n[0], n[1], n[2], view)


@kernel
def transparent(lobes, weight, c):
    return closures.append_transparent(lobes, 0, weight, c[0], c[1], c[2])


@kernel
def glossy(lobes, weight, c, roughness, multi, n, view, tables):
    return closures.append_glossy(lobes, 0, weight, c[0], c[1], c[2], roughness, multi, n[0], n[1], n[2], view, tables)


@kernel
def phong(lobes, weight, c, roughness, n, view):
    return closures.append_cosine_power(lobes, 0, weight, c[0], c[1], c[2], roughness, n[0], n[1], n[2], view)


@kernel
def metal(lobes, weight, c, e, roughness, multi, n, view, tables):
    return closures.append_tinted_metal(
        lobes, 0, weight, c[0], c[1], c[2], e[0], e[1], e[2], roughness, multi, n[0], n[1], n[2], view, tables
    )


@kernel
def conductor(lobes, weight, c, k, roughness, multi, n, view, tables):
    return closures.append_conductor(
        lobes, 0, weight, c[0], c[1], c[2], k[0], k[1], k[2], roughness, multi, n[0], n[1], n[2], view, tables
    )


@kernel
def glass(lobes, weight, c, roughness, ior, multi, n, view, tables):
    return closures.append_glass(
        lobes, 0, weight, c[0], c[1], c[2], roughness, ior, multi, n[0], n[1], n[2], view, tables
    )


@kernel
def refraction(lobes, weight, c, roughness, ior, n, view):
    return closures.append_refraction(lobes, 0, weight, c[0], c[1], c[2], roughness, ior, n[0], n[1], n[2], view)


@kernel
def _bend(view, n, out):
    out[0], out[1], out[2] = closures.specular_normal(view, n[0], n[1], n[2])


@kernel
def _means(dielectric, n, k, f0, dip, out):
    out[0] = closures.mean_dielectric_reflectance(dielectric)
    out[1] = closures.mean_conductor_reflectance(n, k)
    out[2] = closures.mean_f82_reflectance(f0, dip)


@kernel
def _reflectances(cosine, eta, n, k, f0, dip, out):
    for i in range(len(cosine)):
        out[i, 0] = fresnel.dielectric_reflectance(cosine[i], eta)
        out[i, 1] = fresnel.conductor_reflectance(cosine[i], n, k)
        out[i, 2] = fresnel.f82_reflectance(cosine[i], f0, dip)


TABLES = load_tables()


# What is lost


@pytest.mark.parametrize("roughness", ROUGHNESSES)
@pytest.mark.parametrize("degrees", DEGREES)
def test_white_mirrors_lose_nothing_with_multiple_scattering(roughness, degrees):
    view = view_at(degrees)
    lobes = lobes_of(glossy, ONE, WHITE, F(roughness), True, N, view, TABLES)
    assert albedo(lobes, view) == pytest.approx(1, abs=5e-3)


@pytest.mark.parametrize(("ior", "front"), [(1.1, True), (1.5, True), (2.5, True), (1.1, False), (1.5, False)])
@pytest.mark.parametrize("roughness", ROUGHNESSES)
@pytest.mark.parametrize("degrees", DEGREES)
def test_clear_glass_loses_nothing_with_multiple_scattering(roughness, degrees, ior, front):
    view = view_at(degrees, front)
    lobes = lobes_of(glass, ONE, WHITE, F(roughness), F(ior), True, N, view, TABLES)
    assert albedo(lobes, view) == pytest.approx(1, abs=5e-3)


@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("degrees", [0, 60, 85])
def test_single_scattering_loses_what_multiple_scattering_gives_back(roughness, degrees):
    view = view_at(degrees)
    (single,), (multiple,) = (
        lobes_of(glossy, ONE, WHITE, F(roughness), multi, N, view, TABLES) for multi in (False, True)
    )
    assert (single[WEIGHT : WEIGHT + 3] == 1).all()
    left = albedo([single], view)
    assert (left < 1 - 5e-3).all()
    assert left * multiple[WEIGHT : WEIGHT + 3] == pytest.approx(1, abs=5e-3)


def test_what_is_given_back_is_tinted_once_more_by_each_bounce():
    view = view_at(40)
    found = albedo(lobes_of(glossy, ONE, GOLD, F(1), True, N, view, TABLES), view)
    single = albedo(lobes_of(glossy, ONE, WHITE, F(1), False, N, view, TABLES), view)[0]
    # The n-th bounce leaves a share of what the one before lost, the same share from the second on.
    (mean,) = (2 * c * w @ np.array([_mirrors(c_) for c_ in c.ravel()]) for c, w in [_flat_rule()])
    bounces = np.arange(1, 60)
    lost = (1 - single) * (1 - mean) ** (bounces - 1) * mean
    expected = single * GOLD + [float(np.sum(lost * color ** (bounces + 1))) for color in GOLD.astype(float)]
    assert found == pytest.approx(expected, abs=3e-3)


def _flat_rule() -> tuple[np.ndarray, np.ndarray]:
    nodes, weights = rule(0, 1, 5)
    return nodes.ravel(), weights.ravel()


def _mirrors(cosine: float) -> float:
    view = view_at(np.degrees(np.arccos(cosine)))
    return albedo(lobes_of(glossy, ONE, WHITE, F(1), False, N, view, TABLES), view)[0]


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.5, 1.0])
@pytest.mark.parametrize("degrees", DEGREES)
def test_no_closure_makes_light(roughness, degrees):
    view = view_at(degrees)
    r = F(roughness)
    for lobes in (
        lobes_of(diffuse, ONE, WHITE, r, N),
        lobes_of(phong, ONE, WHITE, r, N, view),
        lobes_of(metal, ONE, WHITE, EDGE, r, True, N, view, TABLES),
        lobes_of(conductor, ONE, SILVER_N, SILVER_K, r, True, N, view, TABLES),
        lobes_of(refraction, ONE, WHITE, r, F(1.5), N, view),
    ):
        assert (albedo(lobes, view) <= 1 + 5e-3).all()


# What is put down


@pytest.mark.parametrize("weight", [0.0, -1.0, 1e-6, np.nan, np.inf])
def test_what_has_no_weight_leaves_no_lobe(weight):
    view, w, r, ior = view_at(30), F(weight), F(0.5), F(1.5)
    with np.errstate(invalid="ignore"):
        for append, *inputs in (
            (diffuse, w, WHITE, r, N),
            (translucent, w, WHITE, N, view),
            (transparent, w, WHITE),
            (glossy, w, WHITE, r, True, N, view, TABLES),
            (phong, w, WHITE, r, N, view),
            (metal, w, WHITE, EDGE, r, True, N, view, TABLES),
            (conductor, w, SILVER_N, SILVER_K, r, True, N, view, TABLES),
            (glass, w, WHITE, r, ior, True, N, view, TABLES),
            (refraction, w, WHITE, r, ior, N, view),
        ):
            assert lobes_of(append, *inputs) == []


def test_negative_colours_are_black():
    (lobe,) = lobes_of(diffuse, ONE, vector((0.5, -1, 0.1)), F(0), N)
    assert lobe[WEIGHT : WEIGHT + 3] == pytest.approx((0.5, 0, 0.1))


def test_matt_surfaces_are_lamberts_or_rough():
    (smooth,), (rough,) = (lobes_of(diffuse, F(0.5), GOLD, F(roughness), N) for roughness in (0, 0.5))
    assert smooth[KIND] == LAMBERT
    assert (rough[KIND], rough[ALPHA]) == (OREN_NAYAR, 0.5)
    assert (rough[WEIGHT : WEIGHT + 3] == GOLD / 2).all()
    # Light between the facets is tinted by the colour, however small the share of the shader is.
    assert (rough[REFLECTION_TINT : REFLECTION_TINT + 3] == GOLD).all()


def test_plain_lobes_have_the_weight_of_their_share():
    (through,) = lobes_of(transparent, F(0.5), GOLD)
    (behind,) = lobes_of(translucent, F(0.5), GOLD, N, view_at(10))
    assert (through[KIND], behind[KIND]) == (TRANSPARENT, TRANSLUCENT)
    for lobe in (through, behind):
        assert (lobe[WEIGHT : WEIGHT + 3] == GOLD / 2).all()
        assert lobe[CHANCE] == pytest.approx(GOLD.mean() / 2)


def test_half_of_a_glossy_mix_is_half_of_glossy():
    view = view_at(50)
    (whole,), (half,) = (lobes_of(glossy, F(w), GOLD, F(0.8), True, N, view, TABLES) for w in (1, 0.5))
    assert half[WEIGHT : WEIGHT + 3] == pytest.approx(whole[WEIGHT : WEIGHT + 3] / 2)


def test_the_way_out_of_glass_has_the_inverse_index():
    for front, eta in ((True, 1.5), (False, 1 / 1.5)):
        for append, inputs in ((glass, (True, N)), (refraction, (N,))):
            tables = (TABLES,) if append is glass else ()
            (lobe,) = lobes_of(append, ONE, WHITE, F(0.3), F(1.5), *inputs, view_at(20, front), *tables)
            assert lobe[ETA] == pytest.approx(eta)


@pytest.mark.parametrize("roughness", [0.05, 0.2, 0.5])
def test_cosine_power_is_as_wide_as_facets_of_that_roughness(roughness):
    (lobe,) = lobes_of(phong, ONE, WHITE, F(roughness), N, view_at(0))
    assert lobe[KIND] == COSINE_POWER
    # Where Beckmann's density exp(-tan² / alpha²) / cos⁴ of facets has half of its height, mirrored.
    half = 2 * np.arctan(roughness**2 * np.sqrt(np.log(2)))
    values, _ = evaluate([lobe], UP, direction(np.cos([0.0, half])))
    assert values[1, 0] / values[0, 0] == pytest.approx(0.5, abs=0.06)


def test_sharp_cosine_power_is_a_mirror_and_blunt_is_finite():
    (sharp,), (blunt,) = (lobes_of(phong, ONE, WHITE, F(roughness), N, view_at(0)) for roughness in (0.001, 1))
    assert (sharp[KIND], sharp[ALPHA]) == (GGX_REFLECTION, 0)
    assert (blunt[KIND], blunt[ALPHA]) == (COSINE_POWER, 0)


@pytest.mark.parametrize("degrees", [0, 30, 60, 75, 85])
def test_sharp_cosine_power_reflects_the_cosine_and_a_mirror_all(degrees):
    """The textbook's form leaves in the cosine of the light's direction: for a sharp lobe that of the viewer's."""
    view = view_at(degrees)
    sharp, mirror = (lobes_of(phong, ONE, WHITE, F(roughness), N, view) for roughness in (0.05, 0.0))
    assert albedo(sharp, view) == pytest.approx(np.cos(np.radians(degrees)), rel=2e-3, abs=2e-4)
    assert albedo(mirror, view) == pytest.approx(1)


@pytest.mark.parametrize("roughness", [0.1, 0.4, 0.9])
@pytest.mark.parametrize("degrees", [0, 45, 70])
def test_chances_are_the_light_that_is_reflected(roughness, degrees):
    view, r = view_at(degrees), F(roughness)
    for multi in (True, False):
        for lobes in (
            lobes_of(metal, ONE, GOLD, WHITE, r, multi, N, view, TABLES),
            lobes_of(conductor, ONE, SILVER_N, SILVER_K, r, multi, N, view, TABLES),
            lobes_of(glass, ONE, GOLD, r, F(1.5), multi, N, view, TABLES),
            lobes_of(glossy, ONE, GOLD, r, multi, N, view, TABLES),
        ):
            # What single scattering loses is not estimated where it is not given back.
            rough = 0.03 if multi or roughness < 0.2 else np.inf
            assert lobes[0][CHANCE] == pytest.approx(albedo(lobes, view).mean(), rel=0.15, abs=rough)


# Averages over directions


@pytest.mark.parametrize("eta", [0.5, 0.8, 1.2, 1.5, 2.5])
def test_mean_reflectances_are_integrals(eta):
    cosine, weight = (part.ravel() for part in rule(0, 1, 60))
    n, k, f0, dip = F(0.4), F(2.5), F(0.6), F(1.5)
    curves, means = np.zeros((len(cosine), 3), F), np.zeros(3, F)
    _reflectances(vector(cosine), F(eta), n, k, f0, dip, curves)
    _means(F(eta), n, k, f0, dip, means)
    dielectric, conducting, f82 = (2 * cosine * weight) @ curves
    assert means[0] == pytest.approx(dielectric, abs=0.01)
    assert means[1] == pytest.approx(conducting, abs=0.01)
    assert means[2] == pytest.approx(f82, abs=1e-5)


# Bent normals


def bend(n, degrees: float) -> np.ndarray:
    out = np.zeros(3, F)
    _bend(view_at(degrees), vector(n), out)
    return out.astype(float)


@given(st.floats(0, 1), st.floats(0, 2 * np.pi), st.floats(0, 89.9))
def test_bent_normals_mirror_to_above_the_triangle_and_no_higher_than_needed(cosine, azimuth, degrees):
    n, v = direction(cosine, azimuth), direction(np.cos(np.radians(degrees)))
    bent = bend(n, degrees)
    mirrored = 2 * (bent @ v) * bent - v
    least = min(0.9 * v[2], 0.01)
    assert np.linalg.norm(bent) == pytest.approx(1, abs=1e-5)
    assert abs(np.cross(n, bent) @ UP * np.hypot(*n[:2])) < 1e-4
    if (2 * (n @ v) * n - v)[2] >= least + 1e-5:
        assert bent == pytest.approx(n, abs=1e-6)
    else:
        assert mirrored[2] == pytest.approx(least, abs=2e-4)
        assert bent[2] >= n[2] - 1e-4


def test_mirrors_are_bent_and_matt_surfaces_are_not():
    n, view = vector(direction(0.3, np.pi)), view_at(45)
    for (lobe,) in (
        lobes_of(glossy, ONE, WHITE, F(0.1), True, n, view, TABLES),
        lobes_of(phong, ONE, WHITE, F(0.1), n, view),
        lobes_of(metal, ONE, WHITE, WHITE, F(0.1), True, n, view, TABLES),
        lobes_of(conductor, ONE, SILVER_N, SILVER_K, F(0.1), True, n, view, TABLES),
        lobes_of(glass, ONE, WHITE, F(0.1), F(1.5), True, n, view, TABLES),
        lobes_of(refraction, ONE, WHITE, F(0.1), F(1.5), n, view),
        lobes_of(translucent, ONE, WHITE, n, view),
    ):
        assert lobe[NORMAL : NORMAL + 3] == pytest.approx(bend(n, 45), abs=1e-6)
    (matt,) = lobes_of(diffuse, ONE, WHITE, F(0.5), n)
    assert (matt[NORMAL : NORMAL + 3] == n).all()


# Cycles


def _cycles_and_ours() -> list[tuple]:
    """(name, Cycles' material, from the front, our lobes, tolerance) by roughness and degrees."""
    cases = []
    for roughness in (0.1, 0.4, 1.0):
        for degrees in (0, 30, 60, 75):
            view, back, r = view_at(degrees), view_at(degrees, front=False), F(roughness)

            def add(name, node, front, lobes, tolerance=5e-3, at=(roughness, degrees)):
                cases.append((f"{name} {at}", node, at[1], front, lobes, tolerance))

            node = cycles_node("ShaderNodeBsdfDiffuse", Color=tuple(GOLD), Roughness=roughness)
            add("diffuse", node, True, lobes_of(diffuse, ONE, GOLD, r, N))
            inputs = {"Color": tuple(GOLD), "Roughness": roughness}
            for multi, distribution in ((True, "MULTI_GGX"), (False, "GGX")):
                chosen = {"distribution": distribution}
                node = cycles_node("ShaderNodeBsdfAnisotropic", chosen, **inputs)
                add(f"glossy {distribution}", node, True, lobes_of(glossy, ONE, GOLD, r, multi, N, view, TABLES))
                node = cycles_node("ShaderNodeBsdfGlass", chosen, IOR=1.5, **inputs)
                lobes = lobes_of(glass, ONE, GOLD, r, F(1.5), multi, N, view, TABLES)
                add(f"glass {distribution}", node, True, lobes)
                node = cycles_node(
                    "ShaderNodeBsdfMetallic",
                    {"fresnel_type": "F82", **chosen},
                    Base_Color=tuple(GOLD),
                    Edge_Tint=tuple(EDGE),
                    Roughness=roughness,
                )
                add(f"metal {distribution}", node, True, lobes_of(metal, ONE, GOLD, EDGE, r, multi, N, view, TABLES))
                node = cycles_node(
                    "ShaderNodeBsdfMetallic",
                    {"fresnel_type": "PHYSICAL_CONDUCTOR", **chosen},
                    IOR=tuple(SILVER_N),
                    Extinction=tuple(SILVER_K),
                    Roughness=roughness,
                )
                lobes = lobes_of(conductor, ONE, SILVER_N, SILVER_K, r, multi, N, view, TABLES)
                # Cycles 4.5 approximates Fresnel's equations for conductors.
                add(f"conductor {distribution}", node, True, lobes, 8e-3)
            node = cycles_node("ShaderNodeBsdfGlass", {"distribution": "GGX"}, IOR=1.5, **inputs)
            add("glass out", node, False, lobes_of(glass, ONE, GOLD, r, F(1.5), False, N, back, TABLES))
            node = cycles_node("ShaderNodeBsdfRefraction", {"distribution": "GGX"}, IOR=1.5, **inputs)
            add("refraction", node, True, lobes_of(refraction, ONE, GOLD, r, F(1.5), N, view))
            add("refraction out", node, False, lobes_of(refraction, ONE, GOLD, r, F(1.5), N, back))
    return cases


@pytest.mark.slow
def test_closures_reflect_what_they_do_in_cycles(tmp_path):
    pytest.importorskip("bpy")
    cases = _cycles_and_ours()
    theirs = cycles_albedos([(node, degrees, front) for _, node, degrees, front, _, _ in cases], tmp_path)
    ours = [albedo(lobes, view_at(degrees, front)) for _, _, degrees, front, lobes, _ in cases]
    wrong = {
        name: (found, expected)
        for (name, *_, tolerance), found, expected in zip(cases, ours, theirs, strict=True)
        if (abs(found - expected) > tolerance).any()
    }
    assert not wrong
