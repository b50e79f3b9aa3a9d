"""Fresnel's equations against their complex form, and the laws and limits of what stands in for them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import fresnel

F = np.float32
COSINES = np.linspace(0.01, 1, 100, dtype=F)
#: Some roundings of float32 in a number of about 1.
ROUNDING = 4e-7

cosine = st.floats(0, 1, width=32).map(F)
eta = st.floats(F(0.1), 10, width=32).map(F)
share = st.floats(0, 1, width=32).map(F)


def smooth_reflectance(cosine: float, index: complex) -> float:
    """Fresnel's amplitudes as textbooks have them, in complex numbers of float64."""
    cosine = float(cosine)
    far = np.sqrt(1 - (1 - cosine**2) / np.complex128(index) ** 2)
    across = (cosine - index * far) / (cosine + index * far)
    within = (index * cosine - far) / (index * cosine + far)
    return (abs(across) ** 2 + abs(within) ** 2) / 2


@pytest.mark.parametrize("index", [1.5, 1 / 1.5, 1.01, 1 / 1.01, 1.33, 2.42, 1 / 2.42, 30, 1 / 30])
def test_dielectrics_reflect_what_the_complex_equations_say(index):
    exact = [smooth_reflectance(c, complex(F(index))) for c in COSINES]
    ours = [fresnel.dielectric_reflectance(c, F(index)) for c in COSINES]
    # Near the critical angle, and for an index near 1, the rounding of the input alone moves the result by as much.
    np.testing.assert_allclose(ours, exact, atol=2e-6)


@pytest.mark.parametrize(
    "index",
    [2.757 + 3.867j, 0.18 + 3.42j, 0.05 + 2j, 1.5, 1 / 1.5, 1.0, 1.5 + 1e-3j, 1e-3 + 1e-3j, 100 + 1j, 1 + 400j],
    ids=str,
)
def test_conductors_reflect_what_the_complex_equations_say(index):
    n, k = F(complex(index).real), F(complex(index).imag)
    exact = [smooth_reflectance(c, complex(n, k)) for c in COSINES]
    np.testing.assert_allclose([fresnel.conductor_reflectance(c, n, k) for c in COSINES], exact, atol=ROUNDING)


def test_a_medium_in_itself_reflects_nothing():
    assert max(fresnel.dielectric_reflectance(c, F(1)) for c in COSINES) < 1e-12
    assert max(fresnel.conductor_reflectance(c, F(1), F(0)) for c in COSINES) < 1e-8


def test_glass_reflects_four_percent_head_on():
    assert fresnel.f0_from_ior(F(1.5)) == pytest.approx(0.04, rel=1e-6)
    assert fresnel.dielectric_reflectance(F(1), F(1.5)) == pytest.approx(0.04, rel=1e-5)


def test_all_is_reflected_beyond_the_critical_angle_and_nothing_less_than_all():
    """At the angle whose sine is eta; exactly, so that nothing goes on as a refracted ray."""
    critical = np.sqrt(1 - (1 / 1.5) ** 2)
    for c in np.linspace(0, critical - 1e-4, 50, dtype=F):
        assert fresnel.transmitted_cosine(c, F(1 / 1.5)) == 0
        assert fresnel.dielectric_reflectance(c, F(1 / 1.5)) == 1
        assert fresnel.schlick_share(c, F(1 / 1.5), F(5)) == fresnel.schlick_share(c, F(1 / 1.5), F(-1)) == 1
    assert fresnel.dielectric_reflectance(F(critical + 1e-3), F(1 / 1.5)) < 0.9


@given(cosine, eta)
def test_refracted_rays_obey_snells_law(c, index):
    far = fresnel.transmitted_cosine(c, index)
    sine = np.sqrt(1 - float(c) ** 2) / float(index)
    expected = np.sqrt(1 - sine**2) if sine < 1 else 0
    # The cosine of a grazing ray is the root of a difference.
    assert float(far) ** 2 == pytest.approx(expected**2, abs=ROUNDING * max(1, 1 / float(index) ** 2))


@given(st.floats(F(0.2), 1, width=32).map(F), st.floats(1, 4, width=32).map(F))
def test_a_surface_reflects_as_much_from_either_side(c, index):
    inside = fresnel.transmitted_cosine(c, index)
    back = fresnel.dielectric_reflectance(inside, F(1) / index)
    assert back == pytest.approx(fresnel.dielectric_reflectance(c, index), abs=1e-5)


@given(st.floats(0, F(0.99), width=32).map(F))
def test_the_index_and_the_reflectance_head_on_are_one_and_the_same(f0):
    assert fresnel.f0_from_ior(fresnel.ior_from_f0(f0)) == pytest.approx(f0, abs=1e-5)


def test_an_index_stays_finite_for_a_perfect_mirror():
    assert fresnel.ior_from_f0(F(1)) == fresnel.ior_from_f0(fresnel.LARGEST_F0) == pytest.approx(398, rel=1e-2)
    assert fresnel.ior_from_f0(F(0)) == fresnel.ior_from_f0(F(-1)) == 1


@given(cosine, st.floats(1, 3, width=32).map(F))
def test_schlicks_share_is_the_fifth_power_outside(c, index):
    assert fresnel.schlick_share(c, index, F(5)) == pytest.approx((1 - float(c)) ** 5, abs=ROUNDING)


def test_schlick_is_near_fresnel_from_inside_too():
    """Within 0.04 for glass, if the cosine is that of the refracted ray."""
    f0 = float(fresnel.f0_from_ior(F(1.5)))
    for index in (F(1.5), F(1 / 1.5)):
        schlick = np.array([f0 + (1 - f0) * float(fresnel.schlick_share(c, index, F(5))) for c in COSINES])
        exact = np.array([fresnel.dielectric_reflectance(c, index) for c in COSINES])
        assert abs(schlick - exact).max() < 0.04


@given(cosine, eta)
def test_a_negative_exponent_follows_the_dielectric(c, index):
    """As long as that is not less than head on, as it can be for an index above 3.7."""
    f0 = fresnel.f0_from_ior(index)
    remapped = f0 + (F(1) - f0) * fresnel.schlick_share(c, index, F(-1))
    assert remapped == pytest.approx(max(fresnel.dielectric_reflectance(c, index), f0), abs=ROUNDING)


@given(share, share)
def test_f82_tints_schlicks_reflectance_near_82_degrees(f0, tint):
    coefficient = fresnel.f82_coefficient(f0, tint)
    schlick = f0 + (1 - f0) * (6 / 7) ** 5
    assert fresnel.f82_reflectance(F(1 / 7), f0, coefficient) == pytest.approx(tint * schlick, abs=1e-6)
    assert fresnel.f82_reflectance(F(1), f0, coefficient) == f0
    assert fresnel.f82_reflectance(F(0), f0, coefficient) == pytest.approx(1, abs=ROUNDING)


@given(cosine, st.floats(F(1e-5), F(1e5), width=32).map(F), st.floats(-2, 20, width=32).map(F))
def test_dielectrics_reflect_a_share(c, index, exponent):
    assert 0 <= fresnel.dielectric_reflectance(c, index) <= 1
    assert 0 <= fresnel.schlick_share(c, index, exponent) <= 1


@given(cosine, st.floats(0, 1000, width=32).map(F), st.floats(0, 1000, width=32).map(F), share, share)
def test_metals_reflect_a_share(c, n, k, f0, tint):
    assert 0 <= fresnel.conductor_reflectance(c, n, k) <= 1 + ROUNDING
    assert 0 <= fresnel.f82_reflectance(c, f0, fresnel.f82_coefficient(f0, tint)) <= 1
