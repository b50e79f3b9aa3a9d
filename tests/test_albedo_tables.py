"""The albedo tables against integrals made another way, and what interpolation costs."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from core import albedo_tables, make_albedo_tables
from core.albedo_tables import NO_TABLES, AlbedoTables, load_tables
from core.jit import kernel
from tests.lobe_helpers import F, direction, rule

EXAMPLES = [(roughness, cosine) for roughness in (0.1, 0.3, 0.6, 1.0) for cosine in (0.05, 0.3, 0.7, 1.0)]


@kernel
def _look_up(tables, roughness, cosine, eta, out):
    for i in range(len(roughness)):
        out[i, 0], out[i, 1] = albedo_tables.mirrors_albedo(tables, roughness[i], cosine[i])
        out[i, 2], out[i, 3] = albedo_tables.glass_albedo(tables, roughness[i], cosine[i], eta[i])
        out[i, 4] = albedo_tables.dielectric_share(tables, roughness[i], cosine[i], eta[i])
        out[i, 5] = albedo_tables.schlick_share(tables, roughness[i], cosine[i])


def look_up(roughness, cosine, eta) -> np.ndarray:
    """(n, 6): albedo and mean of mirrors, albedo and mean of glass, shares of Fresnel's and of Schlick's curve."""
    inputs = [np.array(values, F) for values in np.broadcast_arrays(*np.atleast_1d(roughness, cosine, eta))]
    out = np.zeros((len(inputs[0]), 6), F)
    _look_up(load_tables(), *inputs, out)
    return out.astype(float)


def all_facets(alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """Facets (n, 3), and the area that each stands for per area of the plane below.

    The stretched surface is a hemisphere. Seen from above, its facets fill the plane evenly: 2 z dz dφ / 2π of it.
    """
    (z, dz), (azimuth, dazimuth) = rule(0, 1, 60), rule(0, np.pi, 60)
    z, azimuth = z.reshape(-1, 1), azimuth.reshape(1, -1)
    facets = direction(z, azimuth) * [alpha, alpha, 1]
    facets /= np.linalg.norm(facets, axis=-1, keepdims=True)
    area = 2 * z * dz.reshape(-1, 1) * (dazimuth.reshape(1, -1) / np.pi) / facets[..., 2]
    return facets.reshape(-1, 3), area.ravel()


def shadowing(alpha: float, v: float, to: np.ndarray) -> np.ndarray:
    """Smith's G₂ / (4 v to), heights correlated, as Heitz 2014 writes it out: without Λ."""
    v_reach, to_reach = (np.sqrt(alpha**2 + (1 - alpha**2) * cosine**2) for cosine in (v, to))
    return np.where(to > 0, 0.5 / np.maximum(v * to_reach + to * v_reach, 1e-30), 0)


def one_bounce(alpha: float, cosine: float, eta: float | None) -> float:
    """The light that is left, as an integral of G₂ over all facets, seen or not; `eta` None mirrors everything."""
    v = direction(cosine)
    facets, area = all_facets(alpha)
    to_viewer = facets @ v
    mirrored = 2 * to_viewer * facets[:, 2] - cosine
    visible = np.where(to_viewer > 0, area * to_viewer / cosine, 0)
    shares = 4 * cosine * mirrored * shadowing(alpha, cosine, mirrored)
    if eta is None:
        return float(np.sum(visible * shares))
    squared = 1 - (1 - to_viewer**2) / eta**2
    far = np.sqrt(np.maximum(squared, 0))
    across, within = (
        (to_viewer - eta * far) / (to_viewer + eta * far),
        (eta * to_viewer - far) / (eta * to_viewer + far),
    )
    reflectance = np.where(squared > 0, (across**2 + within**2) / 2, 1)
    depth = (far - to_viewer / eta) * facets[:, 2] + cosine / eta
    through = 4 * cosine * depth * shadowing(alpha, cosine, depth)
    return float(np.sum(visible * (reflectance * shares + (1 - reflectance) * through)))


@pytest.mark.parametrize(("roughness", "cosine"), EXAMPLES)
def test_mirrors_leave_what_all_facets_together_reflect(roughness, cosine):
    expected = one_bounce(roughness**2, cosine, None)
    assert make_albedo_tables.reflected(roughness**2, cosine) == pytest.approx(expected, rel=1e-3)
    assert look_up(roughness, cosine, 1.5)[0, 0] == pytest.approx(expected, rel=5e-3)


@pytest.mark.parametrize("eta", [1.1, 1.5, 2.5, 1 / 1.1, 1 / 1.5, 1 / 2.5])
@pytest.mark.parametrize(("roughness", "cosine"), EXAMPLES)
def test_glass_leaves_what_all_facets_together_reflect_and_transmit(roughness, cosine, eta):
    expected = one_bounce(roughness**2, cosine, eta)
    assert make_albedo_tables.reflected_or_refracted(roughness**2, cosine, eta=eta) == pytest.approx(expected, rel=3e-3)
    assert look_up(roughness, cosine, eta)[0, 2] == pytest.approx(expected, rel=8e-3)


def test_interpolation_costs_little():
    rng = np.random.default_rng(1)
    roughness, eta = rng.uniform(0.05, 1, 300), np.exp(rng.uniform(0.05, 1, 300) * rng.choice((-1, 1), 300))
    # Half of them are near grazing angles.
    degrees = np.where(rng.random(300) < 0.5, rng.uniform(0, 80, 300), rng.uniform(80, 89, 300))
    cosine = np.cos(np.radians(degrees))
    found = look_up(roughness, cosine, eta)[:, (0, 2, 4, 5)]

    exact = np.array(
        [
            (
                make_albedo_tables.reflected(alpha, c),
                make_albedo_tables.reflected_or_refracted(alpha, c, eta=e),
                make_albedo_tables.dielectric_share(alpha, c, eta=e),
                make_albedo_tables.schlick_share(alpha, c),
            )
            for alpha, c, e in zip(roughness**2, cosine, eta, strict=True)
        ]
    )
    # Albedos are divided by; shares are added to something.
    error = found - exact
    error[:, :2] /= exact[:, :2]
    assert (abs(error).max(0) < [1 / 150, 1 / 150, 1 / 100, 1 / 100]).all()
    assert (np.median(abs(error), axis=0) < 1e-3).all()


@pytest.mark.parametrize("roughness", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("eta", [1.3, 1 / 1.3])
def test_means_are_those_of_the_albedos(roughness, eta):
    cosine, weight = rule(0, 1, 50)
    values = look_up(roughness, cosine.ravel(), eta)
    means = (2 * cosine.ravel() * weight.ravel()) @ values[:, (0, 2)]
    assert values[0, (1, 3)] == pytest.approx(means, rel=3e-3)


def test_schlicks_share_of_a_smooth_surface_is_his_formula():
    cosine = np.linspace(0.2, 1, 9)
    assert look_up(0.0, cosine, 1.5)[:, 5] == pytest.approx((1 - cosine) ** 5, abs=5e-3)


def test_where_nothing_is_lost_nothing_is_to_be_given_back():
    assert (look_up(0.0, [0.01, 0.5, 1.0], 1.5)[:, :4] == 1).all()
    assert (look_up([0.1, 1.0], 0.5, 1.0)[:, 2:4] == 1).all()


def test_inputs_out_of_range_are_those_at_its_end():
    assert look_up(1.0, 1.0, 1e6) == pytest.approx(look_up(1.0, 1.0, 1e4), abs=1e-3)
    assert np.isfinite(look_up([0.0, 0.0, 1.0, 1.0], [0.0, 1.0, 0.0, 1.0], 1.5)).all()


def test_what_is_no_number_is_at_the_lower_end():
    """Not at an entry that there is not: what comes of it is reported elsewhere."""
    assert getattr(albedo_tables._cell, "py_func", albedo_tables._cell)(F(np.nan), 16) == (0, 0)
    nan = look_up([np.nan, 0.5, np.nan], [0.5, np.nan, np.nan], [1.5, 1.5, np.nan])
    assert ((nan[:, 4:] >= 0) & (nan[:, 4:] <= 1)).all()


def test_the_file_is_what_the_script_makes():
    tables = load_tables()
    alpha = make_albedo_tables.alphas()[9]
    cosine = make_albedo_tables.cosine_at(15 / (make_albedo_tables.DIRECTIONS - 1), alpha)
    indices_in, indices_out = (
        make_albedo_tables.indices(count) for count in (make_albedo_tables.INDICES_IN, make_albedo_tables.INDICES_OUT)
    )
    root = (15 / (make_albedo_tables.DIRECTIONS - 1)) ** 2
    refracted = make_albedo_tables.reflected_or_refracted
    assert tables.mirrors[9, 15] == pytest.approx(make_albedo_tables.reflected(alpha, cosine), abs=1e-6)
    assert tables.glass_in[6, 9, 15] == pytest.approx(refracted(alpha, cosine, eta=indices_in[6]), abs=1e-6)
    assert tables.glass_out[13, 9, 15] == pytest.approx(refracted(alpha, cosine, eta=1 / indices_out[13]), abs=1e-6)
    share = make_albedo_tables.dielectric_share(alpha, root, eta=indices_in[6])
    assert tables.dielectric_share[6, 9, 15] == pytest.approx(share, abs=1e-6)
    turn = make_albedo_tables.turned(20 / (make_albedo_tables.TURNS - 1), alpha, eta=1 / indices_out[13])
    share = make_albedo_tables.dielectric_share(alpha, turn, eta=1 / indices_out[13])
    assert tables.dielectric_share_out[13, 9, 20] == pytest.approx(share, abs=1e-6)
    assert tables.schlick_share[9, 15] == pytest.approx(make_albedo_tables.schlick_share(alpha, root), abs=1e-6)


def test_tables_are_shares_of_light():
    for table in load_tables():
        assert table.dtype == F
        assert ((table >= 0) & (table <= 1 + 1e-6)).all()


def test_scenes_without_tables_use_the_same_kernels():
    assert numba.typeof(NO_TABLES) == numba.typeof(load_tables())
    assert isinstance(NO_TABLES, AlbedoTables)
    assert sum(table.size for table in NO_TABLES) == len(NO_TABLES)
