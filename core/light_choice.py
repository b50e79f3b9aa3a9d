"""Choosing one of many emitters by what it can bring to a point: power, distance and orientation.

A binary tree over the emitters. Those of its nodes that are small as seen from the point are found first, one of them
is chosen in proportion to a bound on what it can bring, and then the way down from it, fork by fork, likewise (Conty
and Kulla 2018; Pharr, Jakob and Humphreys 2023, section 12.6.3; a cut through the tree as Yuksel 2019 has it). Emitters
are put in the order of a Morton curve through space and halved, which takes no search and makes the tree a plain array:
the root is node 1, and below node k are 2 k and 2 k + 1.

What is left of the number that chooses an emitter is even in [0, 1) again, and can choose the point on it: even points
stay even over all emitters at once. It has 24 bits less those that the choice took: 14 among a thousand emitters.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .batch import ACTIVE, LAST, LOBE_COUNT, POINT, POSITION, SHADING_NORMAL, Batch, Y, Z
from .jit import device, subroutine
from .warps import BELOW_ONE, ONE, ZERO

#: Columns of `LightTree.nodes`: centre (3) and squared radius of the sphere around the emitters; the axis (3) of the
#: cone of their normals, cosine and sine of half its angle, the cosine of how far off its normal an emitter shines,
#: whether it shines to both sides, and the power.
CENTER, RADIUS, AXIS, CONE_COSINE, CONE_SINE, FALLOFF_COSINE, TWO_SIDED, POWER = 0, 3, 4, 7, 8, 9, 10, 11
_COLUMNS = 12

#: A node is looked into before the choice where the squared distance is less than so many squares of its radius. More
#: costs more time, less more noise: of 1, 2, 4 and 16 this had the least product of both among 1,000 and 100,000 lamps.
NEAR = np.float32(2)
#: Bounds are widened by so much that rounding makes none of them too tight.
_SLACK = np.float32(1e-3)


class LightTree(NamedTuple):
    """The tree for kernels, over N emitters and as many leaves as the next power of two."""

    nodes: np.ndarray  # (2 × leaves, 12) float32
    emitter: np.ndarray  # (leaves,) int64
    leaf: np.ndarray  # (N,) int64


class Emitters(NamedTuple):
    """What the tree wants to know of N emitters, float64."""

    low: np.ndarray  # (N, 3), of the box around each
    high: np.ndarray  # (N, 3)
    axis: np.ndarray  # (N, 3), unit: the middle of its normals
    cone: np.ndarray  # (N,) radians: how far its normals are off the axis; π for a sphere
    falloff: np.ndarray  # (N,) radians: how far off a normal it shines; π/2 for a surface
    two_sided: np.ndarray  # (N,) bool
    power: np.ndarray  # (N,), in any unit


def build_light_tree(emitters: Emitters) -> LightTree:
    """Build the tree, level by level from the leaves up."""
    count = len(emitters.power)
    leaves = 1 << max(count - 1, 0).bit_length()
    order = np.argsort(_morton_code((emitters.low + emitters.high) / 2), kind="stable")
    levels = [_pad(Emitters(*(field[order] for field in emitters)), leaves)]
    while len(levels[-1].power) > 1:
        levels.append(_merge_pairs(levels[-1]))
    nodes = np.zeros((2 * leaves, _COLUMNS), np.float32)
    for level in levels:
        nodes[len(level.power) : 2 * len(level.power)] = _rows(level)
    emitter = np.zeros(leaves, np.int64)
    emitter[:count] = order
    leaf = np.zeros(count, np.int64)
    leaf[order] = np.arange(count)
    return LightTree(nodes, emitter, leaf)


def _morton_code(points: np.ndarray) -> np.ndarray:
    """(N,) uint64: the places of points (N, 3) on a Z-curve through the box around them."""
    low = points.min(axis=0, initial=np.inf)
    size = max(float((points.max(axis=0, initial=-np.inf) - low).max()), 1e-30)
    code = np.zeros(len(points), np.uint64)
    cell = ((points - low) / size * 0x1FFFFF).astype(np.uint64)
    for bit in range(21):
        for axis in range(3):
            code |= (cell[:, axis] >> np.uint64(bit) & np.uint64(1)) << np.uint64(3 * bit + axis)
    return code


def _pad(emitters: Emitters, leaves: int) -> Emitters:
    """Fill up to `leaves` emitters with dark ones."""
    missing = leaves - len(emitters.power)
    return Emitters(
        *(np.concatenate([field, np.zeros((missing, *field.shape[1:]), field.dtype)]) for field in emitters)
    )


def _merge_pairs(level: Emitters) -> Emitters:
    """Each two neighbours as one emitter that bounds both; of a dark one nothing is kept."""
    a, b = (Emitters(*(field[start::2] for field in level)) for start in (0, 1))
    a_only, b_only = b.power == 0, a.power == 0
    two_sided = a.two_sided | b.two_sided
    # Of what shines to both sides, the normal may as well be the other one.
    flip = np.where(two_sided & (np.sum(a.axis * b.axis, axis=1) < 0), -1, 1)[:, None]
    axis, cone = _merge_cones(a.axis, a.cone, b.axis * flip, b.cone)
    both = Emitters(
        np.minimum(a.low, b.low),
        np.maximum(a.high, b.high),
        axis,
        cone,
        np.maximum(a.falloff, b.falloff),
        two_sided,
        a.power + b.power,
    )

    def choose(of_both: np.ndarray, of_a: np.ndarray, of_b: np.ndarray) -> np.ndarray:
        conditions = (condition.reshape(-1, *[1] * (of_a.ndim - 1)) for condition in (a_only, b_only))
        return np.select(list(conditions), [of_a, of_b], of_both)

    return Emitters(*map(choose, both, a, b))


def _merge_cones(
    axis_a: np.ndarray, angle_a: np.ndarray, axis_b: np.ndarray, angle_b: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """A cone around each two cones, its axis in the middle between theirs."""
    axis = axis_a + axis_b
    length = np.linalg.norm(axis, axis=1)
    opposite = length < 1e-6
    axis = np.where(opposite[:, None], axis_a, axis / np.where(opposite, 1, length)[:, None])

    def reach(other: np.ndarray, angle: np.ndarray) -> np.ndarray:
        return np.arccos(np.clip(np.sum(axis * other, axis=1), -1, 1)) + angle

    return axis, np.minimum(np.maximum(reach(axis_a, angle_a), reach(axis_b, angle_b)), np.pi)


def _rows(level: Emitters) -> np.ndarray:
    radius = np.linalg.norm(level.high - level.low, axis=1) / 2
    return np.column_stack(
        [
            (level.low + level.high) / 2,
            (radius * (1 + 1e-6)) ** 2,
            level.axis,
            np.cos(level.cone),
            np.sin(level.cone),
            np.cos(np.minimum(level.falloff, np.pi)),
            level.two_sided,
            level.power,
        ]
    )


@subroutine
def choose_emitter(
    tree: LightTree, x: float, y: float, z: float, nx: float, ny: float, nz: float, u: float
) -> tuple[int, float, float]:
    """Choose an emitter for the point (x, y, z) by u in [0, 1): (emitter, its probability, what is left of u).

    Light is only wanted from before the unit normal n, or with n = 0 from all around. A probability of 0: no light.
    """
    nodes, leaves = tree.nodes, len(tree.emitter)
    chosen, importance, total, node = 0, ZERO, ZERO, 1
    # All nodes that are far enough off, or leaves, from left to right; one of them is kept (Chao 1982).
    while node > 0:
        if node < leaves and _is_near(nodes, node, x, y, z):
            node = 2 * node
            continue
        weight = _importance(nodes, node, x, y, z, nx, ny, nz)
        total += weight
        if weight > ZERO:
            share = weight / total
            if u < share:
                chosen, importance = node, weight
                u = min(u / share, BELOW_ONE)
            else:
                u = min((u - share) / (ONE - share), BELOW_ONE)
        node = _next(node)
    if chosen == 0:
        return 0, ZERO, u
    chance = importance / total
    while chosen < leaves:
        left = _left_share(nodes, 2 * chosen, x, y, z, nx, ny, nz)
        if left < ZERO:
            return 0, ZERO, u
        goes_left = u < left
        share = left if goes_left else ONE - left
        u = min((u if goes_left else u - left) / share, BELOW_ONE)
        chance *= share
        chosen = 2 * chosen if goes_left else 2 * chosen + 1
    return tree.emitter[chosen - leaves], chance, u


@device
def choose_for_surface(batch: Batch, tree: LightTree, i: int) -> tuple[int, float, float]:
    """`choose_emitter` for the surface of lane i, by the first number of the point looked up last.

    A probability of 0 also where no light is wanted: the path has ended, or only what it meets still counts.
    """
    f = batch.floats
    if (f[i + ACTIVE] == ZERO) | (f[i + LAST] > ZERO):
        return 0, ZERO, ZERO
    x, y, z = f[i + POSITION], f[i + POSITION + Y], f[i + POSITION + Z]
    # A surface that is more than Lambertian may be lit from behind.
    facing = ONE if batch.bits[i + LOBE_COUNT] == np.uint32(0) else ZERO
    nx, ny, nz = f[i + SHADING_NORMAL], f[i + SHADING_NORMAL + Y], f[i + SHADING_NORMAL + Z]
    return choose_emitter(tree, x, y, z, facing * nx, facing * ny, facing * nz, f[i + POINT])


@subroutine
def emitter_probability(
    tree: LightTree, emitter: int, x: float, y: float, z: float, nx: float, ny: float, nz: float
) -> float:
    """The probability with which `choose_emitter` chooses this emitter."""
    nodes, leaves = tree.nodes, len(tree.emitter)
    leaf = leaves + tree.leaf[emitter]
    chosen, importance, total, node = leaf, ZERO, ZERO, 1
    while node > 0:
        if node < leaves and _is_near(nodes, node, x, y, z):
            node = 2 * node
            continue
        weight = _importance(nodes, node, x, y, z, nx, ny, nz)
        total += weight
        if _is_above(node, leaf):
            chosen, importance = node, weight
        node = _next(node)
    if importance == ZERO:
        return ZERO
    chance = importance / total
    while chosen < leaves:
        left = _left_share(nodes, 2 * chosen, x, y, z, nx, ny, nz)
        if left < ZERO:
            return ZERO
        goes_left = _is_above(2 * chosen, leaf)
        chance *= left if goes_left else ONE - left
        chosen = 2 * chosen if goes_left else 2 * chosen + 1
    return chance


@subroutine
def next_on_ray(
    tree: LightTree, node: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float
) -> tuple[int, int]:
    """The first leaf from `node` on that the ray from o along d, unit, may meet: (emitter, the node to go on from).

    Start at node 1. Node 0: there was none, or none is left.
    """
    nodes, leaves = tree.nodes, len(tree.emitter)
    while node > 0:
        if not _is_met(nodes, node, ox, oy, oz, dx, dy, dz):
            node = _next(node)
        elif node < leaves:
            node = 2 * node
        else:
            return tree.emitter[node - leaves], _next(node)
    return -1, 0


@device
def _is_met(nodes: np.ndarray, k: int, ox: float, oy: float, oz: float, dx: float, dy: float, dz: float) -> bool:
    """Whether the ray may meet the sphere around node k."""
    radius = nodes[k, RADIUS] * (ONE + _SLACK)
    cx, cy, cz = nodes[k, CENTER] - ox, nodes[k, CENTER + 1] - oy, nodes[k, CENTER + 2] - oz
    along, square = cx * dx + cy * dy + cz * dz, cx * cx + cy * cy + cz * cz
    px, py, pz = cx - along * dx, cy - along * dy, cz - along * dz
    aside = px * px + py * py + pz * pz
    return nodes[k, POWER] > ZERO and aside <= radius and (along >= ZERO or square <= radius)


@device
def _is_near(nodes: np.ndarray, k: int, x: float, y: float, z: float) -> bool:
    """Whether node k fills so much of what the point sees that one bound for all of it would say little."""
    dx, dy, dz = x - nodes[k, CENTER], y - nodes[k, CENTER + 1], z - nodes[k, CENTER + 2]
    return dx * dx + dy * dy + dz * dz < NEAR * nodes[k, RADIUS] and nodes[k, POWER] > ZERO


@device
def _next(node: int) -> int:
    """The node to the right of what lies below this one, 0 after the last."""
    while node & 1:
        node >>= 1
    return node + 1 if node > 0 else 0


@device
def _is_above(node: int, leaf: int) -> bool:
    """Whether `leaf` is `node` or lies below it."""
    while leaf > node:
        leaf >>= 1
    return leaf == node


@device
def _left_share(nodes: np.ndarray, left: int, x: float, y: float, z: float, nx: float, ny: float, nz: float) -> float:
    """The probability of node `left` rather than the next one; -1 where neither can bring light."""
    a = _importance(nodes, left, x, y, z, nx, ny, nz)
    b = _importance(nodes, left + 1, x, y, z, nx, ny, nz)
    return a / (a + b) if a + b > ZERO else -ONE


@device
def _importance(nodes: np.ndarray, k: int, x: float, y: float, z: float, nx: float, ny: float, nz: float) -> float:
    """A bound on the light that node k can bring: power × cosine at the emitter × cosine at the point / distance²."""
    power, radius = nodes[k, POWER], nodes[k, RADIUS]
    dx, dy, dz = x - nodes[k, CENTER], y - nodes[k, CENTER + 1], z - nodes[k, CENTER + 2]
    square = dx * dx + dy * dy + dz * dz
    if power <= ZERO or square <= radius:
        # Inside of what the emitters fill every direction is possible.
        return power / max(radius, np.float32(1e-30)) if power > ZERO else ZERO
    scale = ONE / np.sqrt(square)
    dx, dy, dz = dx * scale, dy * scale, dz * scale
    # Half the angle that the node fills, seen from the point.
    wide_sine = np.sqrt(radius / square)
    wide_cosine = np.sqrt(max(ONE - radius / square, ZERO))
    cosine = dx * nodes[k, AXIS] + dy * nodes[k, AXIS + 1] + dz * nodes[k, AXIS + 2]
    cosine = abs(cosine) if nodes[k, TWO_SIDED] > ZERO else cosine
    # What is left of the angle to the axis after the node's width, and after the cone of normals.
    closer, closer_sine = _less(cosine, _sine(cosine), wide_cosine, wide_sine)
    closest, _ = _less(closer, closer_sine, nodes[k, CONE_COSINE], nodes[k, CONE_SINE])
    if closest < nodes[k, FALLOFF_COSINE] - _SLACK:
        return ZERO
    importance = power * max(closest, _SLACK) / square
    if nx * nx + ny * ny + nz * nz > ZERO:
        received = -(dx * nx + dy * ny + dz * nz)
        nearest, _ = _less(received, _sine(received), wide_cosine, wide_sine)
        if nearest < -_SLACK:
            return ZERO
        importance *= max(nearest, _SLACK)
    return importance


@device
def _sine(cosine: float) -> float:
    return np.sqrt(max(ONE - cosine * cosine, ZERO))


@device
def _less(cosine: float, sine: float, less_cosine: float, less_sine: float) -> tuple[float, float]:
    """(cosine, sine) of an angle less another, both 0 to π, or of 0 where it is smaller than that."""
    if cosine >= less_cosine:
        return ONE, ZERO
    return cosine * less_cosine + sine * less_sine, max(sine * less_cosine - cosine * less_sine, ZERO)
