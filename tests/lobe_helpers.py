"""What the tests of lobes and microfacets share: records, arrays in and out of the code under test, integrals, χ²."""

from __future__ import annotations

import numpy as np
from scipy import stats

from core import lobe_record as record
from core.jit import kernel
from core.lobes import evaluate_lobes, sample_lobes

F = np.float32
UP = np.array([0.0, 0.0, 1.0])


def lobe(
    kind: int,
    weight=(1.0, 1.0, 1.0),
    chance: float = 1.0,
    alpha: float = 0.25,
    eta: float = 1.5,
    fresnel: int = record.NO_FRESNEL,
    f0=(0.04, 0.04, 0.04),
    f90=(1.0, 1.0, 1.0),
    reflection_tint=(1.0, 1.0, 1.0),
    transmission_tint=(1.0, 1.0, 1.0),
    exponent: float = -1.0,
    normal=UP,
) -> np.ndarray:
    """One record, float32 (LOBE_SIZE,)."""
    fields = np.zeros(record.LOBE_SIZE, F)
    fields[record.KIND], fields[record.CHANCE], fields[record.FRESNEL] = kind, chance, fresnel
    fields[record.ALPHA], fields[record.ETA], fields[record.EXPONENT] = alpha, eta, exponent
    for at, color in (
        (record.WEIGHT, weight),
        (record.F0, f0),
        (record.F90, f90),
        (record.REFLECTION_TINT, reflection_tint),
        (record.TRANSMISSION_TINT, transmission_tint),
        (record.NORMAL, normal),
    ):
        fields[at : at + 3] = color
    if kind in (record.LAMBERT, record.OREN_NAYAR):
        fields[record.TILT] = 0  # no bump
    return fields


@kernel
def _evaluate(lobes, count, v, to, g, out):
    for i in range(len(v)):
        vx, vy, vz, x, y, z = v[i, 0], v[i, 1], v[i, 2], to[i, 0], to[i, 1], to[i, 2]
        values = evaluate_lobes(lobes, np.int64(0), count, vx, vy, vz, x, y, z, g[0], g[1], g[2])
        for k in range(8):
            out[i, k] = values[k]


@kernel
def _sample(lobes, count, v, g, points, out, events):
    for i in range(len(points)):
        x, y, z, red, green, blue, density, events[i] = sample_lobes(
            lobes, np.int64(0), count, v[0], v[1], v[2], g[0], g[1], g[2], points[i, 0], points[i, 1], points[i, 2]
        )
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4], out[i, 5] = x, y, z, red, green, blue
        out[i, 6] = density


def evaluate(lobes: list, views, lights, g=UP) -> tuple[np.ndarray, np.ndarray]:
    """(colours (..., 3), densities (...)) of all lobes for views and lights (..., 3), which broadcast."""
    (diffuse, density), (other, other_density) = evaluate_apart(lobes, views, lights, g)
    return diffuse + other, density + other_density


def evaluate_apart(lobes: list, views, lights, g=UP) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """The same of the diffuse lobes, and of all others."""
    views, lights = (np.array(a, F) for a in np.broadcast_arrays(views, lights))
    shape, out = views.shape[:-1], np.empty((views.size // 3, 8), F)
    views, lights = views.reshape(-1, 3), lights.reshape(-1, 3)
    _evaluate(np.concatenate(lobes), len(lobes), views, lights, np.asarray(g, F), out)
    out = out.reshape(*shape, 8).astype(float)
    return (out[..., :3], out[..., 3]), (out[..., 4:7], out[..., 7])


def sample(lobes: list, view, points: np.ndarray, g=UP) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """(directions (n, 3), colours (n, 3), densities (n,), events (n,)) for points (n, 3): choice, u, v."""
    out, events = np.empty((len(points), 7), F), np.empty(len(points), np.int64)
    _sample(np.concatenate(lobes), len(lobes), np.asarray(view, F), np.asarray(g, F), points.astype(F), out, events)
    return out[:, :3].astype(float), out[:, 3:6].astype(float), out[:, 6].astype(float), events


def uniform(count: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).random((count, 3), dtype=F)


def direction(cosine, azimuth=0.0) -> np.ndarray:
    """(..., 3) unit vectors about +z."""
    sine = np.sqrt(np.maximum(1 - np.square(cosine), 0))
    return np.stack(np.broadcast_arrays(sine * np.cos(azimuth), sine * np.sin(azimuth), cosine), -1)


def facets_at(z, azimuth, alpha: float) -> tuple[np.ndarray, np.ndarray]:
    """(facets, steradians of facets for each of stretched normals) where the stretched normal has these coordinates."""
    facets = direction(z, azimuth) * [alpha, alpha, 1]
    length = np.linalg.norm(facets, axis=-1)
    return facets / length[..., None], alpha**2 / length**3


def rule(low: float, high: float, cells: int, order: int = 6) -> tuple[np.ndarray, np.ndarray]:
    """Gauss's rule in each of some equal cells: nodes and weights (cells, order)."""
    nodes, weights = np.polynomial.legendre.leggauss(order)
    width = (high - low) / cells
    nodes = low + width * (np.arange(cells)[:, None] + (nodes + 1) / 2)
    return nodes, np.broadcast_to(width / 2 * weights, (cells, order))


def chi_square(observed: np.ndarray, expected: np.ndarray) -> float:
    """The p-value of Pearson's test; cells that expect fewer than 5 are one, or part of another."""
    observed, expected = observed.ravel().astype(float), expected.ravel()
    rare = expected < 5
    kept, wanted = observed[~rare], expected[~rare]
    left, due = observed[rare].sum(), expected[rare].sum()
    if due >= 5:
        kept, wanted = np.append(kept, left), np.append(wanted, due)
    else:
        kept[-1], wanted[-1] = kept[-1] + left, wanted[-1] + due
    if len(kept) == 1:
        return 1.0
    return stats.chisquare(kept, wanted * (kept.sum() / wanted.sum())).pvalue
