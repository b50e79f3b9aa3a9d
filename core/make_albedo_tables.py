"""Makes `ggx_albedo.npz`, the numbers of `albedo_tables`, from GGX's definition: `python -m core.make_albedo_tables`.

Every entry is an integral over the facets that a viewer sees, in the parametrisation by which they are sampled (Heitz
2018; Dupuy and Benyoub 2023): there the integrand is what a sample would be worth, bounded, and smooth but for a kink.
Its mean over a Fibonacci lattice is good to 1e-4. Takes about a minute.
"""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable

import numpy as np

from .albedo_tables import FILE, AlbedoTables

#: Entries along the axes. All multiples of 0.05 among the roughnesses have their own. The way out of glass, where total
#: reflection makes kinks, has more indices of refraction.
ROUGHNESSES, DIRECTIONS, INDICES_IN, INDICES_OUT = 41, 32, 16, 48
#: Along the axis that has the critical angle in its middle.
TURNS = 33
#: Points of a lattice, which is a Fibonacci number, and the one before it: for an entry, and for one that is averaged
#: over so many cosines.
LATTICE, MEAN_LATTICE, MEAN_COSINES = (10946, 6765), (1597, 987), 48
#: The limits of the axes: entries on them stand for what happens on the way there.
LEAST_ROUGHNESS, LEAST_COSINE, LARGEST_AMPLITUDE, LEAST_INDEX = 1e-2, 1e-6, 0.98, 1.0001


def make_tables() -> AlbedoTables:
    """Integrate all tables."""
    into = [functools.partial(reflected_or_refracted, eta=index) for index in indices(INDICES_IN)]
    out = [functools.partial(reflected_or_refracted, eta=1 / index) for index in indices(INDICES_OUT)]
    shares = [functools.partial(dielectric_share, eta=index) for index in indices(INDICES_IN)]
    below_one = 1 / np.maximum(indices(INDICES_OUT), LEAST_INDEX)
    shares_out = [functools.partial(dielectric_share, eta=index) for index in below_one]
    turns = [functools.partial(turned, eta=index) for index in below_one]
    return AlbedoTables(
        mirrors=_by_direction(reflected, cosine_at),
        mirrors_mean=_by_roughness(reflected),
        glass_in=np.array([_by_direction(integral, cosine_at) for integral in into]),
        glass_in_mean=np.array([_by_roughness(integral) for integral in into]),
        glass_out=np.array([_by_direction(integral, cosine_at) for integral in out]),
        glass_out_mean=np.array([_by_roughness(integral) for integral in out]),
        dielectric_share=np.array([_by_direction(integral, square) for integral in shares]),
        dielectric_share_out=np.array(
            [_by_direction(integral, turn, TURNS) for integral, turn in zip(shares_out, turns, strict=True)]
        ),
        schlick_share=_by_direction(schlick_share, square),
    )


def _by_direction(integral: Callable, cosine: Callable, directions: int = DIRECTIONS) -> np.ndarray:
    """A table (roughness, direction); `cosine` turns the place on the axis of directions into a cosine."""
    table = np.zeros((ROUGHNESSES, directions), np.float32)
    for row, alpha in zip(table, alphas(), strict=True):
        row[:] = [integral(alpha, max(cosine(place, alpha), LEAST_COSINE)) for place in np.linspace(0, 1, directions)]
    return table


def _by_roughness(integral: Callable) -> np.ndarray:
    """A table (roughness) of an integral's mean over the hemisphere, weighted with 2 cosine."""
    return np.array([mean_over_cosines(integral, alpha) for alpha in alphas()], np.float32)


# The axes of the tables: the inverses of what `albedo_tables` looks up by.


def alphas() -> np.ndarray:
    """Along the axis of roughness."""
    return np.maximum(np.linspace(0, 1, ROUGHNESSES), LEAST_ROUGHNESS) ** 2


def indices(count: int) -> np.ndarray:
    """Along the axis of indices of refraction, 1 and more."""
    amplitudes = np.minimum(np.linspace(0, 1, count) ** 2, LARGEST_AMPLITUDE)
    return (1 + amplitudes) / (1 - amplitudes)


def square(place: float, alpha: float) -> float:
    """The cosine at a place on the axis of the tables of shares."""
    return place * place


def turned(place: float, alpha: float, *, eta: float) -> float:
    """The cosine at a place on the axis whose middle is where total reflection ends."""
    critical = np.sqrt((1 - eta) * (1 + eta))
    off = (2 * place - 1) ** 2
    return critical * (1 - off) if place <= 0.5 else critical + (1 - critical) * off


def cosine_at(place: float, alpha: float) -> float:
    """The cosine at a place on the axis of the other tables, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(60):
        cosine = (low + high) / 2
        stretched = cosine / np.hypot(cosine, alpha * np.sqrt(1 - cosine * cosine))
        below = (np.sqrt(cosine) + stretched ** (2 / 3)) / 2 < place
        low, high = (cosine, high) if below else (low, cosine)
    return (low + high) / 2


# The integrals. `alpha` is roughness², `cosine` the viewer's, above 0.


def reflected(alpha: float, cosine: float, lattice: tuple[int, int] = LATTICE) -> float:
    """What one bounce off facets without Fresnel leaves of the light."""
    to_viewer, up = visible_facets(alpha, cosine, lattice)
    return float(np.mean(lit_share(alpha, cosine, 2 * to_viewer * up - cosine)))


def reflected_or_refracted(alpha: float, cosine: float, lattice: tuple[int, int] = LATTICE, *, eta: float) -> float:
    """What one bounce off or passage through a dielectric's facets leaves of the light, on both sides together."""
    to_viewer, up = visible_facets(alpha, cosine, lattice)
    reflectance, far = fresnel(to_viewer, eta)
    above = lit_share(alpha, cosine, 2 * to_viewer * up - cosine)
    below = lit_share(alpha, cosine, (cosine - to_viewer * up) / eta + far * up)
    return float(np.mean(reflectance * above + (1 - reflectance) * below))


def dielectric_share(alpha: float, cosine: float, *, eta: float) -> float:
    """The mean of how far the facets' reflectance is on the way from that head on to 1, of the light that one bounce
    leaves: so the albedo with Fresnel is that without, times the reflectance that this share stands for.

    That dense dielectrics reflect least somewhere between counts as 0. Cycles 4.5 leaves out that facets shadow the
    light, and takes those that reflect into the surface as 0: its white plastics lose 1 % near grazing angles.
    """
    head_on = ((eta - 1) / (eta + 1)) ** 2

    def share(to_viewer: np.ndarray) -> np.ndarray:
        return np.maximum((fresnel(to_viewer, eta)[0] - head_on) / (1 - head_on), 0)

    return _mean_share(alpha, cosine, share)


def schlick_share(alpha: float, cosine: float) -> float:
    """The same for Schlick's reflectance."""
    return _mean_share(alpha, cosine, lambda to_viewer: (1 - to_viewer) ** 5)


def _mean_share(alpha: float, cosine: float, share: Callable) -> float:
    to_viewer, up = visible_facets(alpha, cosine, LATTICE)
    lit = lit_share(alpha, cosine, 2 * to_viewer * up - cosine)
    return float(np.sum(lit * share(to_viewer)) / np.sum(lit))


def mean_over_cosines(integral: Callable, alpha: float) -> float:
    """The mean of an integral over the hemisphere, weighted with 2 cosine."""
    nodes, weights = np.polynomial.legendre.leggauss(MEAN_COSINES)
    # Over the root of the cosine: that has more nodes where the integral is steep.
    roots = (nodes + 1) / 2
    values = [integral(alpha, root**2, MEAN_LATTICE) for root in roots]
    return float(np.sum(weights * 2 * roots**3 * values))


def visible_facets(alpha: float, cosine: float, lattice: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """The cosines to the viewer and to the surface's normal of facets as the viewer sees them, all of one weight.

    The points are spread over one half of the cap: the other is its mirror image.
    """
    count, step = lattice
    u, v = (np.arange(count) + 0.5) / count, (np.arange(count) * step % count + 0.5) / count
    sine = np.sqrt(1 - cosine * cosine)
    x, z = np.array([alpha * sine, cosine]) / np.hypot(alpha * sine, cosine)
    cap = (1 - u) * (1 + z) - z
    radius = np.sqrt(1 - cap * cap)
    facet = np.array([alpha * (radius * np.cos(np.pi * v) + x), alpha * radius * np.sin(np.pi * v), cap + z])
    facet /= np.linalg.norm(facet, axis=0)
    return sine * facet[0] + cosine * facet[2], facet[2]


def lit_share(alpha: float, cosine_v: float, cosine_l: np.ndarray) -> np.ndarray:
    """Of what the viewer sees, the share that the light reaches (Heitz 2014); 0 where it is behind the surface."""
    seen, lit = (masking(alpha, cosine) for cosine in (cosine_v, np.maximum(cosine_l, 1e-30)))
    return np.where(cosine_l > 0, (1 + seen) / (1 + seen + lit), 0)


def masking(alpha: float, cosine: np.ndarray | float) -> np.ndarray | float:
    """Smith's Λ."""
    return (np.sqrt(1 + alpha * alpha * (1 / (cosine * cosine) - 1)) - 1) / 2


def fresnel(cosine: np.ndarray, eta: float) -> tuple[np.ndarray, np.ndarray]:
    """(reflectance, cosine of the refracted ray), 1 and 0 where all is reflected."""
    far = np.sqrt(np.maximum(eta * eta - 1 + cosine * cosine, 0)) / eta
    across, within = (cosine - eta * far) / (cosine + eta * far), (eta * cosine - far) / (eta * cosine + far)
    return np.where(far > 0, (across**2 + within**2) / 2, 1), far


if __name__ == "__main__":
    np.savez_compressed(FILE, **make_tables()._asdict())
    sys.stdout.write(f"{FILE}: {FILE.stat().st_size} bytes\n")
