"""Integrands over the unit square whose integral is known in closed form, and how fast each sampler's error falls.

Two are smooth: a Gaussian about any point of the square, and e^x, which one axis decides alone and which is not
periodic. Three are steps, as a pixel sees the edges of things: a disk, a half-plane at any angle, and an edge parallel
to an axis. Each trial places its integrand anew, at random, so that sets without chance in them (regular, Hammersley)
are averaged over shifts of the integrand.

`EXPECTED_SLOPES` says how the root-mean-square error goes with the number of points n, as the power of n. Theory, where
there is one: -1/2 for independent points, whatever is integrated; one point in each cell of a grid: -1 for smooth
integrands (Haber 1966) and -3/4 across an edge, which only ~√n of the n cells see (Mitchell 1996); Latin hypercubes
integrate what depends on one axis with -3/2, or -1 across a step, and the rest no better than random points (Stein
1987); scrambled nets have -3/2 for smooth integrands (Owen 1997), short of a power of log n. Lattices and regular grids
have -1 where the integrand is not periodic. The numbers are measured: 1000 trials at each n = 16, 64 … 4096.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..samplers import Sampler

_erf = np.vectorize(math.erf, otypes=[float])


@dataclass(frozen=True)
class Integrand:
    """A family of functions on [0, 1)², one for each place that `place` draws.

    `place(trials, rng)` returns (trials, k) numbers that say where the function is in each trial. `value(points,
    places)` is the function at points (trials, n, 2): (trials, n). `integral(places)` is what its mean ought to be:
    (trials,).
    """

    name: str
    label: str
    place: Callable[[int, np.random.Generator], np.ndarray]
    value: Callable[[np.ndarray, np.ndarray], np.ndarray]
    integral: Callable[[np.ndarray], np.ndarray]


# Gauss: exp(-4 r²) about a centre anywhere in the square


def _gauss_place(trials: int, rng: np.random.Generator) -> np.ndarray:
    return rng.random((trials, 2))


def _gauss_value(points: np.ndarray, center: np.ndarray) -> np.ndarray:
    return np.exp(-4 * _squared_distance(points, center))


def _gauss_integral(center: np.ndarray) -> np.ndarray:
    along_each_axis = math.sqrt(math.pi) / 4 * (_erf(2 * (1 - center)) + _erf(2 * center))
    return along_each_axis.prod(axis=1)


# Disk: inside the square, its radius 0.2 to 0.4


def _disk_place(trials: int, rng: np.random.Generator) -> np.ndarray:
    radius = rng.uniform(0.2, 0.4, (trials, 1))
    return np.hstack((rng.uniform(radius, 1 - radius, (trials, 2)), radius))


def _disk_value(points: np.ndarray, disk: np.ndarray) -> np.ndarray:
    return (_squared_distance(points, disk[:, :2]) < disk[:, 2:] ** 2).astype(float)


def _disk_integral(disk: np.ndarray) -> np.ndarray:
    return math.pi * disk[:, 2] ** 2


# Half-plane: a (x - ½) + b (y - ½) < offset, at any angle and up to ¼ from the middle


def _half_plane_place(trials: int, rng: np.random.Generator) -> np.ndarray:
    angle, offset = rng.uniform(0, 2 * np.pi, trials), rng.uniform(-0.25, 0.25, trials)
    return np.stack((np.cos(angle), np.sin(angle), offset), axis=1)


def _half_plane_value(points: np.ndarray, plane: np.ndarray) -> np.ndarray:
    a, b, offset = plane.T[:, :, None]
    return (a * (points[..., 0] - 0.5) + b * (points[..., 1] - 0.5) < offset).astype(float)


def _half_plane_integral(plane: np.ndarray) -> np.ndarray:
    """The area that is cut off the square: the second difference of the step's second integral."""
    a, b = np.abs(plane[:, 0]), np.abs(plane[:, 1])
    d = plane[:, 2] + (a + b) / 2  # from the corner that is covered first
    ramps = [np.maximum(d - gone, 0) ** 2 / 2 for gone in (0, a, b, a + b)]
    return (ramps[0] - ramps[1] - ramps[2] + ramps[3]) / (a * b)


# Axis step: an edge parallel to the y axis


def _step_place(trials: int, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform(0.1, 0.9, (trials, 1))


def _step_value(points: np.ndarray, edge: np.ndarray) -> np.ndarray:
    return (points[..., 0] < edge).astype(float)


def _step_integral(edge: np.ndarray) -> np.ndarray:
    return edge[:, 0]


# 1-D smooth: e^x, nothing to place


def _exponential_place(trials: int, rng: np.random.Generator) -> np.ndarray:
    return np.empty((trials, 0))


def _exponential_value(points: np.ndarray, _: np.ndarray) -> np.ndarray:
    return np.exp(points[..., 0])


def _exponential_integral(nothing: np.ndarray) -> np.ndarray:
    return np.full(len(nothing), math.e - 1)


def _squared_distance(points: np.ndarray, center: np.ndarray) -> np.ndarray:
    return ((points - center[:, None, :]) ** 2).sum(axis=2)


INTEGRANDS: dict[str, Integrand] = {
    integrand.name: integrand
    for integrand in (
        Integrand("gauss", "Gaussian", _gauss_place, _gauss_value, _gauss_integral),
        Integrand("disk", "Disk", _disk_place, _disk_value, _disk_integral),
        Integrand("half_plane", "Half-plane", _half_plane_place, _half_plane_value, _half_plane_integral),
        Integrand("step", "Axis-parallel step", _step_place, _step_value, _step_integral),
        Integrand("smooth_1d", "Smooth along one axis", _exponential_place, _exponential_value, _exponential_integral),
    )
}

#: By sampler, in the order of INTEGRANDS.
_SLOPES = {
    "regular": (-1.00, -0.76, -0.75, -0.51, -1.00),
    "random": (-0.50, -0.50, -0.50, -0.50, -0.50),
    "jittered": (-1.00, -0.75, -0.75, -0.75, -1.00),
    "n_rooks": (-0.51, -0.51, -0.51, -1.00, -1.50),
    "multi_jittered": (-1.04, -0.73, -0.73, -1.00, -1.50),
    "hammersley": (-0.88, -0.75, -0.80, -1.00, -1.00),
    "sobol_owen": (-1.41, -0.77, -0.75, -1.00, -1.50),
    "correlated_multi_jittered": (-0.77, -0.77, -0.76, -1.00, -1.50),
    "z_sobol": (-1.41, -0.77, -0.75, -1.00, -1.50),  # each of its sets is a scrambled net as those above
    "fibonacci": (-0.91, -0.76, -0.80, -1.00, -1.00),
}
#: EXPECTED_SLOPES[integrand][sampler]; a sampler that nobody has measured yet is missing.
EXPECTED_SLOPES: dict[str, dict[str, float]] = {
    name: {sampler: slopes[i] for sampler, slopes in _SLOPES.items()} for i, name in enumerate(INTEGRANDS)
}


#: Points that are made and evaluated in one call where that is timed.
TIMED_POINTS = 1 << 16


@dataclass(frozen=True)
class Trials:
    """The signed errors of a sampler on an integrand, (2, trials), and the time that an estimate took.

    Both rows have the same places but sets made apart: the mean of their product is the bias squared, free of bias.
    """

    errors: np.ndarray
    setup_seconds: float
    seconds: float


def measure(sampler: Sampler, count: int, trials: int, seed: int) -> dict[str, Trials]:
    """Estimate every integrand `trials` times with sets of `count` points, which the sampler must be able to make.

    The places depend on the seed and the count alone: they are the same for all samplers.
    `setup_seconds` is what making one set takes, `seconds` what evaluating the integrand at its points does: both of
    TIMED_POINTS in one call, however many trials there are, so that no more of numpy's own overhead is in them than in
    the tables of a render.
    """
    rng = np.random.default_rng([seed, count, sampler.number])
    points = np.stack([sampler(trials, count, rng) for _ in range(2)]).astype(float)
    sets = max(TIMED_POINTS // count, 1)
    start = time.perf_counter()
    timed = sampler(sets, count, rng)
    setup_seconds = (time.perf_counter() - start) / sets
    place_rng = np.random.default_rng([seed, count])
    measured = {}
    for name, integrand in INTEGRANDS.items():
        places = integrand.place(trials, place_rng)
        integral = integrand.integral(places)
        means = np.stack([integrand.value(p, places).mean(axis=1) for p in points])
        everywhere = integrand.place(sets, np.random.default_rng(seed))
        start = time.perf_counter()
        integrand.value(timed, everywhere).mean(axis=1)
        measured[name] = Trials(means - integral, setup_seconds, (time.perf_counter() - start) / sets)
    return measured
