"""Oren and Nayar's model: its energy, its symmetry, and Fujii's and OpenPBR's formulae written out in float64."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import diffuse
from core.jit import kernel

F = np.float32
ROUGHNESSES = (1e-4, 0.01, 0.3, 0.7, 1.0)
VIEWS = (0.0, 0.02, 0.3, 0.7, 1.0)

#: Gauss's rule over half of the azimuths, which is all by symmetry, and over the cosine.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(64)
AZIMUTHS, COSINES = (NODES + 1) * np.pi / 2, ((NODES + 1) / 2) ** 2
SOLID_ANGLES = np.outer(WEIGHTS * (NODES + 1) / 2, WEIGHTS * np.pi)


@kernel
def _fill(roughness, cosine_v, cosines_l, v_dot_l, once, more):
    for i in range(len(cosines_l)):
        once[i], more[i] = diffuse.oren_nayar(roughness, cosine_v, cosines_l[i], v_dot_l[i])


def oren_nayar(roughness: float, cosine_v: float, cosines_l: np.ndarray, v_dot_l: np.ndarray):
    once, more = np.empty((2, cosines_l.size), F)
    _fill(F(roughness), F(cosine_v), cosines_l.astype(F).ravel(), v_dot_l.astype(F).ravel(), once, more)
    return once.reshape(cosines_l.shape).astype(float), more.reshape(cosines_l.shape).astype(float)


def over_the_hemisphere(cosine_v: float) -> tuple[np.ndarray, np.ndarray]:
    cosines, azimuths = np.broadcast_arrays(COSINES[:, None], AZIMUTHS)
    sines = np.sqrt((1 - cosines**2) * (1 - cosine_v**2))
    return cosines, cosines * cosine_v + sines * np.cos(azimuths)


@pytest.mark.parametrize("cosine_v", VIEWS)
@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_white_stays_white(roughness, cosine_v):
    cosines, v_dot_l = over_the_hemisphere(cosine_v)
    once, more = oren_nayar(roughness, cosine_v, cosines, v_dot_l)
    tint = diffuse.oren_nayar_tint(F(roughness), F(1))
    assert ((once + tint * more) * cosines * SOLID_ANGLES).sum() == pytest.approx(1, abs=2e-4)


@pytest.mark.parametrize("roughness", ROUGHNESSES)
def test_one_bounce_alone_loses_what_fujiis_albedo_says(roughness):
    for cosine_v in VIEWS:
        cosines, v_dot_l = over_the_hemisphere(cosine_v)
        once, _ = oren_nayar(roughness, cosine_v, cosines, v_dot_l)
        a = 1 / (np.pi + roughness * (np.pi / 2 - 2 / 3))
        albedo = np.pi * a + roughness * a * float(diffuse._shaded_share(F(cosine_v)))
        assert (once * cosines * SOLID_ANGLES).sum() == pytest.approx(albedo, abs=2e-4)


def test_the_mean_share_is_the_mean():
    shares = [float(diffuse._shaded_share(F(c))) for c in COSINES]
    assert np.dot(shares, 2 * COSINES * WEIGHTS * (NODES + 1) / 2) == pytest.approx(diffuse.MEAN_SHARE, abs=1e-6)


def test_without_roughness_it_is_lamberts():
    cosines, v_dot_l = over_the_hemisphere(0.5)
    once, more = oren_nayar(0, 0.5, cosines, v_dot_l)
    np.testing.assert_allclose(once, 1 / np.pi, rtol=1e-6)
    assert not more.any()


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 1), st.floats(0, np.pi))
def test_viewer_and_light_may_change_places(roughness, cosine_v, cosine_l, azimuth):
    v_dot_l = F(cosine_v * cosine_l + np.sqrt((1 - cosine_v**2) * (1 - cosine_l**2)) * np.cos(azimuth))
    there = diffuse.oren_nayar(F(roughness), F(cosine_v), F(cosine_l), v_dot_l)
    back = diffuse.oren_nayar(F(roughness), F(cosine_l), F(cosine_v), v_dot_l)
    assert there == pytest.approx(back, rel=1e-4, abs=1e-7)
    assert min(there) >= 0


@given(st.floats(0.01, 1), st.floats(0.05, 1), st.floats(0.05, 1), st.floats(0, np.pi), st.floats(0, 1))
def test_the_formulae_as_published(sigma, cosine_v, cosine_l, azimuth, albedo):
    """Fujii 2012, eqs. for A, B and s/t; the energy compensation of OpenPBR 1.1, section "Base substrate"."""

    def directional(c):
        s, theta = np.sqrt(1 - c * c), np.arccos(c)
        return a * np.pi + b * (s * (theta - s * c - 2 / 3) + 2 / 3 * s / c * (1 - s**3))

    a = 1 / (np.pi + (np.pi / 2 - 2 / 3) * sigma)
    b = sigma * a
    v_dot_l = cosine_v * cosine_l + np.sqrt((1 - cosine_v**2) * (1 - cosine_l**2)) * np.cos(azimuth)
    s = v_dot_l - cosine_v * cosine_l
    once = a + b * (s / max(cosine_v, cosine_l) if s > 0 else s)
    mean = a * np.pi + (2 * np.pi - 5.6) / 3 * b
    series = albedo**2 * mean / (1 - mean) / (1 - albedo * (1 - mean)) / np.pi
    more = series * (1 - directional(cosine_v)) * (1 - directional(cosine_l))
    ours_once, ours_more = diffuse.oren_nayar(F(sigma), F(cosine_v), F(cosine_l), F(v_dot_l))
    assert ours_once == pytest.approx(once, rel=1e-5)
    assert ours_more * diffuse.oren_nayar_tint(F(sigma), F(albedo)) == pytest.approx(more, rel=1e-3, abs=1e-6)
