"""Embree through our kernels finds what embreex's own, slower call finds: same triangles, same distances."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene as Embreex

from core.batch import (
    ACTIVE,
    DIRECTION,
    GEOMETRY,
    HIT_NORMAL,
    HIT_V,
    HIT_W,
    INSTANCE,
    INVALID,
    LANES,
    LIGHT_WEIGHT,
    MASK,
    ORIGIN,
    PACKET,
    PRIMITIVE,
    SHADOW,
    T_FAR,
    T_NEAR,
    Batch,
    new_batch,
)
from core.embree import (
    EmbreeScene,
    PlacedTriangles,
    build_scene,
    intersect_coherent,
    intersect_incoherent,
    library_path,
    load_library,
    occluded_coherent,
)
from core.errors import RooksError
from core.packing import affine
from tests.scenes import rotation, scaling, sphere, translation

PACKETS = 64
RAYS = PACKETS * LANES
ALL = 0xFFFFFFFF


def rows(batch: Batch, row: int, count: int = 1, bits: bool = False) -> np.ndarray:
    """A view of `count` components of all samples: (packets, count, 16)."""
    memory = (batch.bits if bits else batch.floats).reshape(-1, PACKET)
    return memory[:, row : row + count * LANES].reshape(-1, count, LANES)


def put(batch: Batch, row: int, values: np.ndarray, bits: bool = False) -> None:
    values = np.asarray(values, np.uint32 if bits else np.float32).reshape(len(values), -1)
    rows(batch, row, values.shape[1], bits)[:] = values.reshape(-1, LANES, values.shape[1]).transpose(0, 2, 1)


def get(batch: Batch, row: int, count: int = 1, bits: bool = False) -> np.ndarray:
    values = rows(batch, row, count, bits).transpose(0, 2, 1).reshape(-1, count).copy()
    return values if count > 1 else values[:, 0]


def soup(count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Small triangles at random in the cube [-1, 1]³, with a spare vertex as Embree's shared buffers want it."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-1, 1, (count, 1, 3))
    vertices = (middle + rng.normal(0, 0.15, (count, 3, 3))).reshape(-1, 3).astype(np.float32)
    return vertices, np.arange(3 * count, dtype=np.uint32).reshape(-1, 3)


def placed(vertices: np.ndarray, triangles: np.ndarray, matrix: np.ndarray | None = None, mask: int = ALL):
    padded = np.concatenate([vertices, np.zeros((1, 3), np.float32)])[:-1]
    rows_ = None if matrix is None else np.ascontiguousarray(affine(matrix), np.float32)
    return PlacedTriangles(padded, triangles, rows_, mask)


@contextmanager
def structure(*entries: PlacedTriangles) -> Iterator:
    scene = build_scene(entries, 1)
    try:
        yield scene
    finally:
        scene.close()


def random_rays(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a sphere of radius 3 towards the cube, and now and then past it."""
    rng = np.random.default_rng(seed)
    origins = rng.normal(size=(RAYS, 3))
    origins *= 3 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-1.5, 1.5, (RAYS, 3)) - origins
    return origins.astype(np.float32), directions.astype(np.float32)


def batch_of(origins: np.ndarray, directions: np.ndarray) -> Batch:
    batch = new_batch(PACKETS)
    put(batch, ORIGIN, origins)
    put(batch, DIRECTION, directions)
    put(batch, T_NEAR, np.zeros(RAYS))
    put(batch, T_FAR, np.full(RAYS, np.inf))
    put(batch, ACTIVE, np.ones(RAYS))
    put(batch, MASK, np.full(RAYS, ALL), bits=True)
    return batch


def shadow_batch(origins: np.ndarray, directions: np.ndarray, reach: float = np.inf) -> Batch:
    batch = new_batch(PACKETS)
    put(batch, SHADOW + ORIGIN, origins)
    put(batch, SHADOW + DIRECTION, directions)
    put(batch, SHADOW + T_NEAR, np.zeros(RAYS))
    put(batch, SHADOW + T_FAR, np.full(RAYS, reach))
    put(batch, LIGHT_WEIGHT, np.ones(RAYS))
    return batch


def oracle(vertices: np.ndarray, triangles: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> dict:
    """embreex's hits; it normalises nothing, and leaves stale numbers where it misses."""
    scene = Embreex(robust=True)
    TriangleMesh(scene, vertices, triangles.astype(np.int32))
    return scene.run(origins, directions, output=1)


MESHES = {
    "soup": soup(500, 1),
    "sphere": (lambda mesh: (mesh.vertices, mesh.triangles.astype(np.uint32)))(sphere(1.2)),
}
every_mesh = pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES.keys())
every_trace = pytest.mark.parametrize("trace", [intersect_coherent, intersect_incoherent], ids=["packets", "single"])


@every_mesh
@every_trace
def test_the_nearest_hits_are_those_of_embreex(mesh, trace):
    origins, directions = random_rays(2)
    batch = batch_of(origins, directions)
    with structure(placed(*mesh)) as scene:
        trace(batch, scene.traversal, PACKETS)
    expected = oracle(*mesh, origins, directions)
    hit = expected["primID"] >= 0
    assert 0.2 < hit.mean() < 0.98
    primitive = get(batch, PRIMITIVE, bits=True)
    assert np.array_equal(primitive != INVALID, hit)
    assert np.isinf(get(batch, T_FAR)[~hit]).all()
    # Packets and single rays round differently: where two triangles meet, either may be the nearer one.
    same = primitive[hit] == expected["primID"][hit]
    assert same.mean() > 0.99
    assert np.allclose(get(batch, T_FAR)[hit], expected["tfar"][hit], rtol=1e-5)
    assert np.allclose(get(batch, HIT_V)[hit][same], expected["u"][hit][same], atol=1e-3)
    assert np.allclose(get(batch, HIT_W)[hit][same], expected["v"][hit][same], atol=1e-3)
    assert np.allclose(get(batch, HIT_NORMAL, 3)[hit][same], expected["Ng"][hit][same], rtol=1e-3, atol=1e-6)
    assert (get(batch, GEOMETRY, bits=True)[hit] == 0).all()
    assert (get(batch, INSTANCE, bits=True) == INVALID).all()


@every_mesh
@pytest.mark.parametrize("reach", [np.inf, 0.7])
def test_a_ray_is_blocked_where_embreex_hits_before_its_end(mesh, reach):
    origins, directions = random_rays(3)
    batch = shadow_batch(origins, directions, reach)
    with structure(placed(*mesh)) as scene:
        occluded_coherent(batch, scene.traversal, ALL, PACKETS)
    expected = oracle(*mesh, origins, directions)
    blocked = (expected["primID"] >= 0) & (expected["tfar"] < reach)
    assert 0.1 < blocked.mean() < 0.98
    assert np.array_equal(get(batch, SHADOW + T_FAR) < 0, blocked)
    assert (get(batch, SHADOW + T_FAR)[~blocked] == np.float32(reach)).all()


def test_without_native_packets_the_answers_are_the_same():
    origins, directions = random_rays(4)
    results = []
    with structure(placed(*MESHES["soup"])) as scene:
        for packets in (True, False):
            batch, shadows = batch_of(origins, directions), shadow_batch(origins, directions)
            traversal = scene.traversal._replace(packets=packets)
            intersect_coherent(batch, traversal, PACKETS)
            occluded_coherent(shadows, traversal, ALL, PACKETS)
            results.append((get(batch, T_FAR), get(shadows, SHADOW + T_FAR)))
    (far, shadow_far), (single_far, single_shadow_far) = results
    assert np.allclose(far, single_far, rtol=1e-5)
    assert np.array_equal(shadow_far, single_shadow_far)


class OnProcessor:
    """Embree as if the processor could do no more than an instruction set."""

    def __init__(self, isa: str) -> None:
        self.isa = isa

    def __getattr__(self, name: str):
        return getattr(load_library(), name)

    def rtcNewDevice(self, options: bytes) -> int:  # noqa: N802 - Embree's name
        return load_library().rtcNewDevice(options + f",max_isa={self.isa}".encode())


@pytest.mark.parametrize("isa", ["sse2", "avx2"])
def test_a_processor_without_avx512_finds_the_same(isa):
    vertices, triangles = MESHES["soup"]
    origins, directions = random_rays(4)
    batch = batch_of(origins, directions)
    scene = EmbreeScene(OnProcessor(isa), [placed(vertices, triangles)], 1)
    assert not scene.traversal.packets
    intersect_coherent(batch, scene.traversal, PACKETS)
    scene.close()
    expected = oracle(vertices, triangles, origins, directions)
    hit = expected["primID"] >= 0
    assert np.array_equal(get(batch, PRIMITIVE, bits=True) != INVALID, hit)
    assert np.allclose(get(batch, T_FAR)[hit], expected["tfar"][hit], rtol=1e-5)


def test_a_processor_on_which_embree_does_not_start_is_said():
    lib = SimpleNamespace(rtcNewDevice=lambda _options: None, rtcGetDeviceError=lambda _device: 5)
    with pytest.raises(RooksError, match="cannot start on this processor"):
        EmbreeScene(lib, [], 1)


PLACES = {
    "rotated": rotation(0, 0.7) @ rotation(2, -2.0),
    "scaled": scaling(0.5, 1.5, 0.8),
    "mirrored": scaling(-1, 1, 1) @ rotation(1, 0.4),
    "moved": translation(0.3, -0.2, 0.5) @ scaling(0.7, 0.7, 0.7),
}


@every_trace
def test_instances_are_hit_where_baked_copies_are(trace):
    vertices, triangles = soup(60, 5)
    shared = placed(vertices, triangles)
    instances = [
        PlacedTriangles(shared.vertices, shared.triangles, placed(vertices, triangles, matrix).matrix, ALL)
        for matrix in PLACES.values()
    ]
    origins, directions = random_rays(6)
    batch = batch_of(origins, directions)
    with structure(*instances) as scene:
        trace(batch, scene.traversal, PACKETS)
    baked = np.concatenate([vertices @ m[:3, :3].T + m[:3, 3] for m in PLACES.values()]).astype(np.float32)
    offsets = [triangles + i * len(vertices) for i in range(len(PLACES))]
    expected = oracle(baked, np.concatenate(offsets), origins, directions)
    hit = expected["primID"] >= 0
    primitive, instance = get(batch, PRIMITIVE, bits=True), get(batch, INSTANCE, bits=True)
    # A ray along the very edge of a triangle may pass the copy and hit the instance.
    assert ((primitive != INVALID) == hit).mean() > 0.997
    both = hit & (primitive != INVALID)
    assert set(instance[both]) == set(range(len(PLACES)))
    named = instance[both].astype(int) * len(triangles) + primitive[both]
    same = named == expected["primID"][both]
    assert same.mean() > 0.99
    assert np.allclose(get(batch, T_FAR)[both][same], expected["tfar"][both][same], rtol=1e-4)


@pytest.mark.parametrize("instanced", [False, True])
@pytest.mark.parametrize("mask", [1, 2, 4])
def test_a_ray_sees_only_what_its_mask_shows(instanced, mask):
    vertices, triangles = MESHES["sphere"]
    shared = placed(vertices, triangles)
    origins, _ = random_rays(7)
    towards = -origins  # all hit the sphere
    place = affine(np.eye(4)).astype(np.float32) if instanced else None
    for visibility in (1, 2, 4, 7, 3):
        entry = shared._replace(matrix=place, mask=visibility)
        packet, single, shadow = batch_of(origins, towards), batch_of(origins, towards), shadow_batch(origins, towards)
        with structure(entry) as scene:
            for batch in (packet, single):
                put(batch, MASK, np.full(RAYS, mask), bits=True)
            intersect_coherent(packet, scene.traversal, PACKETS)
            intersect_incoherent(single, scene.traversal, PACKETS)
            occluded_coherent(shadow, scene.traversal, mask, PACKETS)
        visible = bool(mask & visibility)
        assert ((get(packet, PRIMITIVE, bits=True) != INVALID) == visible).all()
        assert ((get(single, PRIMITIVE, bits=True) != INVALID) == visible).all()
        assert ((get(shadow, SHADOW + T_FAR) < 0) == visible).all()


@every_trace
def test_lanes_that_have_ended_are_not_traced(trace):
    origins, _ = random_rays(8)
    batch = batch_of(origins, -origins)
    active = np.arange(RAYS) % 3 == 0
    active[:LANES] = False  # a packet with none
    put(batch, ACTIVE, active)
    put(batch, HIT_V, np.full(RAYS, 7.0))
    with structure(placed(*MESHES["sphere"])) as scene:
        trace(batch, scene.traversal, PACKETS)
    assert np.isfinite(get(batch, T_FAR)[active]).all()
    assert np.isinf(get(batch, T_FAR)[~active]).all()
    assert (get(batch, HIT_V)[~active] == 7).all()
    assert (get(batch, PRIMITIVE, bits=True)[~active] == INVALID).all()


def test_shadow_rays_without_light_are_not_traced():
    origins, _ = random_rays(9)
    batch = shadow_batch(origins, -origins)
    lit = np.arange(RAYS) % 5 == 0
    lit[:LANES] = False
    put(batch, LIGHT_WEIGHT, lit)
    with structure(placed(*MESHES["sphere"])) as scene:
        occluded_coherent(batch, scene.traversal, ALL, PACKETS)
    assert (get(batch, SHADOW + T_FAR)[lit] < 0).all()
    assert np.isinf(get(batch, SHADOW + T_FAR)[~lit]).all()
    assert (get(batch, SHADOW + T_FAR)[~lit] > 0).all()


def test_an_empty_structure_is_missed():
    origins, directions = random_rays(10)
    batch, shadows = batch_of(origins, directions), shadow_batch(origins, directions)
    with structure() as scene:
        intersect_coherent(batch, scene.traversal, PACKETS)
        occluded_coherent(shadows, scene.traversal, ALL, PACKETS)
    assert (get(batch, PRIMITIVE, bits=True) == INVALID).all()
    assert (get(shadows, SHADOW + T_FAR) > 0).all()


def test_without_embrees_c_functions_the_answers_are_the_same():
    """All of this file again in a process that cannot find the library, so that embreex's own call does the tracing."""
    code = (
        "import sys, pytest, core.embree\n"
        "core.embree.library_path = lambda: None\n"
        "sys.exit(pytest.main(['-q', '-x', '-p', 'no:cacheprovider', '-k', sys.argv[1], sys.argv[2]]))"
    )
    command = [sys.executable, "-c", code, "not c_functions and not processor and not wheel", str(Path(__file__))]
    run = subprocess.run(command, cwd=Path(__file__).parent.parent, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout
    assert "passed" in run.stdout
    assert "Exception ignored" not in run.stdout + run.stderr, run.stdout


@pytest.mark.parametrize(
    ("platform", "library"),
    [
        ("linux", "embreex.libs/libembree4-4aef3270.so.4"),
        ("win32", "embreex.libs/embree4.dll"),
        ("darwin", "embreex/.dylibs/libembree4.4.dylib"),
    ],
)
def test_the_library_is_found_where_each_platforms_wheel_has_it(tmp_path, monkeypatch, platform, library):
    for name in ("embreex/__init__.py", "embreex.libs/tbb12.dll", "embreex/.dylibs/libtbb.12.11.dylib", library):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    spec = importlib.util.spec_from_file_location("embreex", tmp_path / "embreex/__init__.py")
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: spec)
    monkeypatch.setattr(sys, "platform", platform)
    assert library_path() == tmp_path / library


def test_a_library_that_does_not_load_is_as_good_as_none(tmp_path):
    (tmp_path / "libembree4.so").write_text("not a library")
    code = (
        "import sys, pathlib, core.embree\n"
        "core.embree.library_path = lambda: pathlib.Path(sys.argv[1])\n"
        "assert core.embree.load_library() is None"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "libembree4.so")]
    subprocess.run(command, cwd=Path(__file__).parent.parent, check=True)
