"""GGX facets: their distribution, what Smith's model hides of them, and sampling those that the viewer sees.

Integrals run over the hemisphere of stretched normals, on which facets are spread evenly: (x, y, z) there is the facet
(alpha x, alpha y, z), normalised, so that one rule serves every alpha.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from core import microfacet
from core.jit import kernel
from tests.lobe_helpers import chi_square, direction, facets_at, rule

F = np.float32
ALPHAS = (2e-5, 1e-3, 0.0025, 0.04, 0.25, 0.6, 1.0)
#: Cosines of the viewer, from along the surface to head on.
VIEWS = (1e-4, 0.02, 0.2, 0.6, 0.95, 1.0)


@kernel
def _densities(alpha, facets, out):
    zero, one = F(0), F(1)
    for i in range(len(facets)):
        out[i] = microfacet.ggx_density(alpha, zero, zero, one, facets[i, 0], facets[i, 1], facets[i, 2])


@kernel
def _sample(points, alpha, view, out):
    for i in range(len(points)):
        out[i, 0], out[i, 1], out[i, 2] = microfacet.square_to_visible_facet(
            points[i, 0], points[i, 1], alpha, view[0], view[1], view[2]
        )


def density(alpha: float, facets: np.ndarray) -> np.ndarray:
    """D of facets (..., 3)."""
    out = np.empty(facets.shape[:-1], F)
    _densities(F(alpha), facets.astype(F).reshape(-1, 3), out.reshape(-1))
    return out.astype(float)


def sample(points: np.ndarray, alpha: float, view: np.ndarray) -> np.ndarray:
    out = np.empty((len(points), 3), F)
    _sample(points.astype(F), F(alpha), view.astype(F), out)
    return out.astype(float)


def over_facets(alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """All facets (n, 3) and the steradians that each stands for."""
    z, dz = rule(0, 1, 30)
    azimuth, dazimuth = rule(-np.pi, np.pi, 60)
    facets, stretch = facets_at(z.reshape(-1, 1), azimuth.reshape(1, -1), alpha)
    return facets.reshape(-1, 3), (stretch * dz.reshape(-1, 1) * dazimuth.reshape(1, -1)).ravel()


@pytest.mark.parametrize("alpha", ALPHAS)
def test_facets_cover_the_surface(alpha):
    """Projected onto it they fill it once: ∫ D cosine = 1."""
    facets, steradians = over_facets(alpha)
    assert (density(alpha, facets) * facets[:, 2] * steradians).sum() == pytest.approx(1, rel=1e-5)


@pytest.mark.parametrize("cosine", VIEWS)
@pytest.mark.parametrize("alpha", ALPHAS)
def test_facets_that_are_seen_fill_the_view(alpha, cosine):
    """∫ D G₁ / cos v × (v·h) = 1: what is left of all facets' projection is that of the surface (Heitz 2014)."""
    facets, steradians = over_facets(alpha)
    seen = np.maximum(facets @ direction(cosine), 0)
    share = float(microfacet.visible_share(F(alpha), F(cosine)))
    assert (density(alpha, facets) * share * seen * steradians).sum() == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("alpha", ALPHAS)
def test_densities_keep_their_digits(alpha):
    """Within 1e-5 of D in float64 of the same facet, head on as far as far out in the tail."""
    for slope in (0, 0.1, 1, 10):
        facet = np.array([alpha * slope, 0, 1], F)
        cosine_squared = 1 / (1 + float(facet[0]) ** 2)
        exact = float(F(alpha)) ** 2 / np.pi / (1 + cosine_squared * (float(F(alpha)) ** 2 - 1)) ** 2
        if alpha * slope > 1e-3 or slope == 0:
            assert density(alpha, facet) == pytest.approx(exact, rel=1e-5)
        stretched = (float(facet[0]) ** 2 + float(F(alpha)) ** 2) * cosine_squared
        assert density(alpha, facet) == pytest.approx(float(F(alpha)) ** 2 / np.pi / stretched**2, rel=1e-5)


@given(st.sampled_from(ALPHAS), st.floats(1e-3, 1), st.floats(1e-3, 1))
def test_what_is_hidden_is_what_smith_hides(alpha, cosine_v, cosine_l):
    """G₁ = 1 / (1 + Λ) and G₂ = 1 / (1 + Λ(v) + Λ(l)), with Λ as Heitz 2014, eqs. 72 and 99, has it."""

    def hidden(cosine):
        return (np.sqrt(1 + alpha**2 * (1 / cosine**2 - 1)) - 1) / 2

    one = 1 / (1 + hidden(cosine_v)) / cosine_v
    both = 1 / (1 + hidden(cosine_v) + hidden(cosine_l)) / cosine_v
    assert microfacet.visible_share(F(alpha), F(cosine_v)) == pytest.approx(one, rel=1e-5)
    ours = microfacet.visible_and_lit_share(F(alpha), F(cosine_v), F(cosine_l))
    assert ours == pytest.approx(both, rel=1e-5)
    assert ours <= microfacet.visible_share(F(alpha), F(cosine_v)) * (1 + 1e-6)


@pytest.mark.parametrize("cosine", VIEWS)
@pytest.mark.parametrize("alpha", ALPHAS)
def test_facets_are_sampled_as_they_are_seen(alpha, cosine):
    """χ² over cells of the stretched hemisphere, each at the level 1e-4 / number of tests (Šidák)."""
    view, count = direction(cosine, 0.4), 40_000
    facets = sample(np.random.default_rng(3).random((count, 2)), alpha, view)
    np.testing.assert_allclose(np.linalg.norm(facets, axis=1), 1, atol=1e-6)
    assert (facets @ view >= -1e-6).all()
    stretched = facets / [alpha, alpha, 1]
    stretched /= np.linalg.norm(stretched, axis=1, keepdims=True)
    places = np.stack((stretched[:, 2], np.arctan2(stretched[:, 1], stretched[:, 0])), 1)
    observed = np.histogram2d(*places.T, bins=(10, 14), range=((0, 1), (-np.pi, np.pi)))[0].ravel()
    assert observed.sum() == count
    (z, dz), (azimuth, dazimuth) = rule(0, 1, 10, 12), rule(-np.pi, np.pi, 14, 12)
    nodes, stretch = facets_at(z[:, :, None, None], azimuth, alpha)
    share = float(microfacet.visible_share(F(alpha), F(cosine)))
    densities = density(alpha, nodes) * share * np.maximum(nodes @ view, 0) * stretch
    expected = count * np.einsum("aibj,ai,bj->ab", densities, dz, dazimuth).ravel()
    assert expected.sum() == pytest.approx(count, rel=2e-3)
    assert chi_square(observed, expected) > 1 - (1 - 1e-4) ** (1 / (len(ALPHAS) * len(VIEWS)))


def test_the_corners_of_the_square_make_facets_too():
    edge = F(1 - 2**-24)
    points = np.array([(u, v) for u in (0, 0.5, edge) for v in (0, 0.5, edge)])
    for alpha in ALPHAS:
        for cosine in (1e-30, 1e-8, *VIEWS):
            facets = sample(points, alpha, direction(cosine, 2.0))
            assert (facets[:, 2] >= 0).all()
            np.testing.assert_allclose(np.linalg.norm(facets, axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("cosine", [0.0, 1e-40, 1e-30])
def test_a_view_along_the_surface_divides_nothing_by_zero(cosine):
    for alpha in ALPHAS:
        assert np.isfinite(microfacet.visible_share(F(alpha), F(cosine)))
        for other in (F(cosine), F(1)):
            assert 0 <= microfacet.visible_and_lit_share(F(alpha), F(cosine), other) < 3 / alpha
            assert 0 <= microfacet.visible_and_lit_share(F(alpha), other, F(cosine)) < 3 / alpha


def test_surfaces_are_smooth_as_in_cycles():
    assert microfacet.is_smooth(F(0))
    assert microfacet.is_smooth(F(1.414e-5))
    assert not microfacet.is_smooth(F(1.415e-5))
    assert microfacet.bends_nothing(F(1))
    assert microfacet.bends_nothing(F(1.00009))
    assert not microfacet.bends_nothing(F(0.9998))
