"""Leaks: rays through edges and corners, light through walls, and shadows that do not reach what casts them."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from core import Camera, Instance, Mesh, PointLight, Scene, SunLight
from core.batch import (
    ACTIVE,
    DIRECTION,
    INVALID,
    LANES,
    MASK,
    ORIGIN,
    PACKET,
    POINT,
    PRIMITIVE,
    T_FAR,
    T_NEAR,
    Batch,
    Y,
    new_batch,
)
from core.embree import Traversal, intersect_coherent, intersect_incoherent, occluded_incoherent
from core.jit import device, kernel
from core.packing import SceneArrays, pack_scene
from core.scattering import scatter_diffusely
from core.scene import VISIBLE_TO_CAMERA
from core.surface import find_surfaces
from tests.scenes import (
    WHITE,
    box,
    camera_down,
    floor,
    lambertian,
    picture,
    pixel_centers,
    rotation,
    scaling,
    sphere,
    translation,
)

from .case import Record, case

PACKETS = 64
RAYS = PACKETS * LANES
#: What rays are aimed at: an edge, but for its ends, to within rounding; up to half of BESIDE past it; a corner; or
#: nothing at all.
EDGE, BESIDE_EDGE, CORNER, ANYWHERE = range(4)
BESIDE = np.float32(4e-6)
PACKETS_OF_16, ONE_BY_ONE, SHADOW_RAYS, SCATTERED = range(4)

TURNED = rotation(0, 0.3) @ rotation(2, 0.7)
SHEARED = np.array([[1.0, 0.4, 0.0, 0.0], [0.0, 1.0, -0.3, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
TETRAHEDRON = Mesh(
    "tetrahedron",
    np.array([(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)], np.float32),
    np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)], np.int32),
)
AIMED = "None has a part in it: the rays are aimed, in place of sampled."
#: Closed bodies about the origin of their own space: the mesh, where it stands, and how often.
BODIES = {
    "box": (box(2), np.eye(4), 1),
    "box, moved and turned": (box(2), translation(3.3, 7.1, -1.7) @ TURNED, 1),
    "box, instanced, sheared and scaled": (box(2), TURNED @ SHEARED @ scaling(1.5, 0.2, 40), 2),
    "box at 1 km": (box(2), translation(1000, -300, 400) @ TURNED, 2),
    "tetrahedron": (TETRAHEDRON, TURNED, 1),
    "sphere of 80,000 triangles": (sphere(1.0, rings=200), TURNED, 1),
}


@device
def _random(state: np.ndarray) -> float:
    """A number in [0, 1) of a linear congruential generator (Knuth's MMIX), 24 bits."""
    state[0] = state[0] * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
    return np.float32(state[0] >> np.uint64(40)) * np.float32(2.0**-24)


@kernel
def _aim(
    batch: Batch, origins: np.ndarray, edges: np.ndarray, targets: np.ndarray, state: np.ndarray, packets: int
) -> None:
    """Rays from inside a body at each of `targets` (EDGE, ...) alike often.

    `origins` (N, 3) and the ends of the edges (E, 2, 3) are float32 in the space that rays are traced in.
    """
    f, bits = batch.floats, batch.bits
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            edge, start = int(_random(state) * len(edges)), int(_random(state) * len(origins))
            kind = targets[int(_random(state) * len(targets))]
            t = np.float32(0) if kind == CORNER else np.float32(0.02) + np.float32(0.96) * _random(state)
            for row in range(3):
                target = edges[edge, 0, row] + t * (edges[edge, 1, row] - edges[edge, 0, row])
                direction = target - origins[start, row]
                if kind == BESIDE_EDGE:
                    direction += BESIDE * (_random(state) - np.float32(0.5))
                elif kind == ANYWHERE:
                    direction = _random(state) - np.float32(0.5)
                f[i + ORIGIN + row * LANES] = origins[start, row]
                f[i + DIRECTION + row * LANES] = direction
            f[i + T_NEAR] = np.float32(0)
            f[i + T_FAR] = np.float32(np.inf)
            f[i + ACTIVE] = np.float32(1)
            bits[i + MASK] = np.uint32(VISIBLE_TO_CAMERA)
            f[i + POINT], f[i + POINT + Y] = _random(state), _random(state)


@kernel
def _trace(
    batch: Batch,
    traversal: Traversal,
    scene: SceneArrays,
    way: int,
    origins: np.ndarray,
    edges: np.ndarray,
    targets: np.ndarray,
    state: np.ndarray,
    rounds: int,
    packets: int,
) -> int:
    """How many of `rounds` batches of rays from inside a closed body hit nothing; of SCATTERED ones, the next rays."""
    f, bits = batch.floats, batch.bits
    missed = 0
    for _ in range(rounds):
        _aim(batch, origins, edges, targets, state, packets)
        if way == PACKETS_OF_16:
            intersect_coherent(batch, traversal, packets)
        elif way == SHADOW_RAYS:
            occluded_incoherent(batch, traversal, packets)
        else:
            intersect_incoherent(batch, traversal, packets)
        if way == SCATTERED:
            find_surfaces(batch, scene, packets)
            scatter_diffusely(batch, False, packets)
            intersect_incoherent(batch, traversal, packets)
        for p in range(packets):
            for i in range(p * PACKET, p * PACKET + LANES):
                is_hit = f[i + T_FAR] < np.float32(0) if way == SHADOW_RAYS else bits[i + PRIMITIVE] != INVALID
                missed += 0 if is_hit | (f[i + ACTIVE] == np.float32(0)) else 1
    return missed


def _missed(body: str, way: int, targets: Sequence[int], rounds: int, *behind: Instance) -> int:
    """`_trace` for rays from within a tetrahedron in the body, on two threads with half of the rounds each.

    `behind` is what else is there for rays to meet.
    """
    mesh, matrix, copies = BODIES[body]
    aside = tuple(Instance(mesh, translation(500, 0, 0) @ matrix) for _ in range(1, copies))
    packed = pack_scene(Scene(camera_down(1), (Instance(mesh, matrix), *aside, *behind)), 1)

    def place(points: np.ndarray) -> np.ndarray:
        return (points @ matrix[:3, :3].T + matrix[:3, 3] - packed.center).astype(np.float32)

    mixture = np.random.default_rng(1).dirichlet(np.ones(4), 4096)
    origins = place(mixture @ (0.5 * TETRAHEDRON.vertices.astype(np.float64)))
    ends = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    edges = place(mesh.vertices.astype(np.float64)[ends])

    def run(seed: int) -> int:
        batch, state = new_batch(PACKETS), np.array([seed], np.uint64)
        at = np.array(targets, np.int64)
        return _trace(batch, packed.traversal, packed.arrays, way, origins, edges, at, state, rounds // 2, PACKETS)

    try:
        with ThreadPoolExecutor(2) as pool:
            return sum(pool.map(run, (1, 2)))
    finally:
        packed.structure.let_go()


def _count_misses(record: Record, rays: dict[int, int], in_box: int = 1) -> None:
    """Trace so many rays in each way in each body, and `in_box` times as many in the first.

    Only the corners of few and large triangles are safe.
    """
    total = 0
    for body, (mesh, _, _) in BODIES.items():
        targets = [EDGE, BESIDE_EDGE, ANYWHERE, *[CORNER] * (len(mesh.triangles) < 100)]
        missed, times = 0, 1 if total else in_box
        for way, count in rays.items():
            rounds = 2 * -(-times * count // (2 * RAYS))
            missed += _missed(body, way, targets, rounds)
            total += rounds * RAYS
        record.claim(f"rays out of the {body}", missed, at_most=0)
    record.claim("rays", total, at_least=(len(BODIES) - 1 + in_box) * sum(rays.values()))


_EDGES = {
    "happens": "A ray that passes exactly between two triangles goes through a closed wall: sparks in the dark.",
    "why": "Each triangle rounds its own test of the ray; where they share an edge both can say no.",
    "rooks": "Embree's robust test (after Woop, Benthin and Wald 2013) rounds a shared edge alike for both triangles.",
    "samplers": AIMED,
}


@case("Rays at the edges of closed bodies", **_EDGES)
def rays_at_edges(record: Record) -> None:
    """As the renderer traces them: packets, single rays and shadow rays."""
    _count_misses(record, {PACKETS_OF_16: 400_000, ONE_BY_ONE: 100_000, SHADOW_RAYS: 400_000})


@case("A billion rays at the edges of closed bodies", **_EDGES, is_slow=True)
def billion_rays_at_edges(record: Record) -> None:
    _count_misses(record, {PACKETS_OF_16: 14_000_000, ONE_BY_ONE: 3_400_000, SHADOW_RAYS: 16_000_000}, in_box=30)


@case(
    "Rays exactly at the corners of small triangles",
    happens="A few of the rays that meet a corner of a fine mesh to the last bit go through it.",
    why="A corner is in none of its triangles when each edge about it has rounded the other way: the error grows with "
    "the distance, Embree's tolerance with the triangle. Its own program loses the same rays.",
    rooks="As Embree. A ray at random meets one of 40,000 corners as exactly as that once in 10¹⁰ times; those through "
    "edges are safe.",
    instead="Where it has to be dark to the last ray: a second wall a little behind the first, turned or of other "
    "triangles, so that no corner lies behind a corner; or walls of few large triangles.",
    samplers=AIMED,
)
def rays_at_corners(record: Record) -> None:
    rays, body = 200 * RAYS, "sphere of 80,000 triangles"
    at_corners, at_edges = (_missed(body, ONE_BY_ONE, [target], 200) for target in (CORNER, EDGE))
    record.claim(f"of {rays} rays exactly at corners go through", at_corners, at_least=1, at_most=0.1 * rays)
    record.claim("of as many at edges", at_edges, at_most=0)
    mesh, matrix, _ = BODIES[body]
    behind = Instance(mesh, matrix @ rotation(2, 0.01) @ rotation(0, 0.01) @ scaling(1.01, 1.01, 1.01))
    record.claim(
        "of as many at corners, with a second ball around", _missed(body, ONE_BY_ONE, [CORNER], 200, behind), at_most=0
    )
    record.claim(
        "of as many at corners of a box", _missed("box, moved and turned", ONE_BY_ONE, [CORNER], 200), at_most=0
    )


@case(
    "Light that scatters off an edge inside a closed body",
    happens="Sparks along the edges of a dark room: light from outside.",
    why="A hit on the edge of a wall rounds to either side of the wall that it meets there, and the step off the "
    "surface goes along its own normal, not away from the other wall.",
    rooks="Moves a hit that is nearer to an edge of its triangle than points can round inside of it.",
    samplers=AIMED,
)
def scattered_off_edges(record: Record) -> None:
    for body in BODIES:
        missed = _missed(body, SCATTERED, [EDGE, BESIDE_EDGE, ANYWHERE], 100)
        record.claim(f"rays out of the {body}", missed, at_most=0)


@case(
    "A closed room in bright light, seen from inside",
    happens="Light leaks in along edges, and through thin walls.",
    why="Rays start beside the surface that they leave; the step can cross a wall that is thinner than it.",
    rooks="Steps off by a bound on what has been rounded, and always to the side that the light is on.",
)
def dark_room(record: Record) -> None:
    """Views of a whole room and of an edge within 10⁻⁶ rad, with bounces; walls of no and of little thickness."""
    sky = (SunLight((0.3, 0.2, 1), (1e4,) * 3, 0.5), SunLight((-1, -0.4, -0.2), (1e4,) * 3))
    edge = rotation(1, -np.pi / 4)  # looks along (1, 0, -1), where two walls meet
    rooms = (
        ("of 2 m", 2.0, 0.0),
        ("of 20 m, walls of 0.1 mm", 20.0, 1e-4),
        ("of 2 km, walls of 1 mm", 2e3, 1e-3),
    )
    for label, size, thickness in rooms:
        walls = (box(size),) if thickness == 0 else (box(size), box(size + 2 * thickness))
        room = tuple(Instance(mesh, materials=(lambertian(0.9),)) for mesh in walls)
        lamp = PointLight((0, 0, size), (1e6 * size**2,) * 3, 0.1 * size)
        found = 0.0
        for matrix, width in ((TURNED, 1.5), (edge, 1e-6)):
            camera = Camera(matrix, (16, 16), (-width, width, -width, width), clip_start=0.0, clip_end=1e9)
            scene = Scene(camera, room, (*sky, lamp), (1e3,) * 3)
            found = max(found, picture(scene, samples=64, max_bounces=3).max())
        record.claim(f"radiance in a room {label}", found, at_most=0)


@case(
    "The shadow of a box that stands on the ground",
    happens="A line of light between a thing and its shadow: it seems to float.",
    why="A shadow ray that starts too far off the ground passes beneath what stands on it.",
    rooks="The step off the ground is a millionth of its coordinates along its normal: none for a level ground at "
    "height 0, and below a millimetre at a kilometre.",
)
def contact_shadow(record: Record) -> None:
    """The sun at 45° behind a box: the ground is black from its foot on, for as long as the box is high."""
    sun = SunLight((-1, 0, 1), (1.0,) * 3)
    far_below = Instance(box(), translation(9, 9, 0))  # keeps the middle of the world at height 0
    for height, sizes in ((0.0, (1e-2, 1.0, 1e2)), (1000.0, (0.1, 1.0, 1e2))):
        for size in sizes:
            ground = Instance(floor(50 * size, (0, 0, height)), materials=(WHITE,))
            block = Instance(box(size, (-size / 2, 0, height + size / 2)), materials=(WHITE,))
            # The step off a ground 1 km up, and how far the shadow lies from its box, is at most 2 mm × tan 45°.
            step = 2.0**-19 * height
            width = max(1e-3 * size, 4 * step)
            camera = camera_down(width, (32, 32), (width / 2, 0, height), height=0.5 * size)
            seen = picture(Scene(camera, (ground, block, far_below), (sun,)), samples=16)
            x = pixel_centers(camera)[0] + width / 2
            in_shadow = np.broadcast_to((x > 2 * step + width / 32) & (x < size - width / 32), seen.shape)
            record.claim(f"light at the foot of a box of {size:g} m, {height:g} m up", seen[in_shadow].max(), at_most=0)
