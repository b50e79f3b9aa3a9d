"""The stages are plain Python: without the JIT they compute what the compiled ones do.

NUMBA_DISABLE_JIT=1 works only in a process that starts with it. There all stages run on tiny inputs, and then all
together render tiny pictures; the same code runs compiled here, and the numbers are compared.
"""

from __future__ import annotations

import ctypes
import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from numba import config

from core import (
    AreaLight,
    Camera,
    Instance,
    Material,
    Mesh,
    PointLight,
    Scene,
    SpotLight,
    SunLight,
    embree,
    render,
)
from core.batch import (
    ACTIVE,
    ALBEDO,
    DIRECTION,
    GEOMETRIC_NORMAL,
    LANES,
    LIGHT_WEIGHT,
    OFFSET,
    ORIGIN,
    PACKET,
    POINT,
    POSITION,
    RADIANCE,
    SHADING_NORMAL,
    SHADOW,
    T_FAR,
    THROUGHPUT,
    Batch,
    Y,
    new_batch,
)
from core.camera import aim_through_lens, pack_camera, start_rays
from core.direct_light import Clamp, add_light, reflect_diffusely
from core.domains import Run, hash32, look_up_points, make_table, set_of_pixel
from core.film import add_samples, develop, new_tile_sums
from core.filters import offset_table
from core.light_arrays import pack_lights
from core.lights import narrow_to_cone, sample_light
from core.packing import pack_scene
from core.settings import RenderSettings
from core.shaders import AddShader, Diffuse, Emission, Glossy, Metallic, MixShader, Translucent, Transparent
from core.textures import image_color
from core.values import ImageTexture
from core.warps import square_to_cap, square_to_cosine_hemisphere, square_to_disk, square_to_polygon, square_to_sphere
from tests.scenes import box, camera_down, floor, translation
from tests.test_integrator import everything

SAMPLES, BLOCKS = 5, np.array([(8, 4)], np.int64)
COUNT = 16 * SAMPLES
SETTINGS = RenderSettings(samples=SAMPLES, sampler="random", pixel_filter="blackman_harris")
RUN = Run(0, SETTINGS.sample_count)
POWER = (10.0, 20.0, 30.0)
LIGHTS = (
    AreaLight((0, 0, 2), (1, 0, 0), (0, 1, 0), POWER),
    AreaLight((1, 0, 2), (1, 0, 0), (0, 1, 0.2), POWER, "ellipse"),
    PointLight((0, 1, 2), POWER),
    PointLight((0, 1, 2), POWER, 0.3),
    PointLight((0, 1, 2), POWER, 0.3, soft_falloff=True),
    SpotLight((0, 0, 2), POWER, 0.1, matrix=translation(0, 0, 2), spot_size=1.5, blend=0.5),
    SunLight((1, 0, 2), POWER, 0.1),
)


def lanes(batch: Batch, row: int, components: int) -> np.ndarray:
    memory = batch.floats.reshape(-1, PACKET)
    return memory[:, row : row + components * LANES].reshape(-1, components, LANES)


def domains() -> np.ndarray:
    table = make_table("light", SETTINGS, 3, 16)
    sets = [set_of_pixel(table, x, y, d) for x in range(3) for y in range(3) for d in range(3)]
    hashes = [hash32(a, b, c) for a in (0, 1, 2**31, 2**32 - 1) for b in (0, 77) for c in (5, 2**32 - 1)]
    batch = new_batch(SAMPLES)
    look_up_points(batch, POINT, table, 2, BLOCKS, RUN, 0, COUNT)
    return np.concatenate([sets, hashes, lanes(batch, POINT, 2).ravel()])


def warps() -> np.ndarray:
    points = np.random.default_rng(1).random((20, 2), dtype=np.float32)
    number = np.float32
    return np.array(
        [
            [
                *square_to_disk(u, v),
                *square_to_cap(u, v, number(0.3)),
                *square_to_sphere(u, v),
                *square_to_cosine_hemisphere(u, v),
                *square_to_polygon(u, v, 5, number(0.4)),
            ]
            for u, v in points
        ]
    )


def textures() -> np.ndarray:
    rng = np.random.default_rng(2)
    pixels = rng.random((3, 4, 3), dtype=np.float32)
    looks = []
    for extension in ("repeat", "mirror", "extend", "clip"):
        looks.append(ImageTexture(pixels, extension, "linear"))
        looks.append(ImageTexture((pixels * 255).astype(np.uint8), extension, "closest"))
    mesh = floor()
    mesh = Mesh("floor", mesh.vertices, mesh.triangles, uvs=np.zeros((2, 3, 2), np.float32))
    materials = tuple(Material(str(k), Diffuse(look)) for k, look in enumerate(looks))
    packed = pack_scene(Scene(camera(), (Instance(mesh, materials=materials),)), 1)
    places, images = rng.uniform(-2, 2, (6, 2)).astype(np.float32), packed.arrays.materials.textures
    colors = [image_color(images, k, x, y) for k in range(len(looks)) for x, y in places]
    packed.structure.let_go()
    return np.array(colors)


def camera() -> Camera:
    return Camera(translation(1, 2, 3), (16, 8), (-1, 1, -0.5, 0.5), lens_radius=0.2, aperture_blades=6)


def camera_rays() -> np.ndarray:
    packed = pack_camera(camera(), np.zeros(3), offset_table(SETTINGS))
    batch = new_batch(SAMPLES)
    look_up_points(batch, POINT, make_table("pixel", SETTINGS, 1, 16), 0, BLOCKS, RUN, 0, COUNT)
    start_rays(batch, packed, BLOCKS, 0, SAMPLES, COUNT)
    look_up_points(batch, POINT, make_table("lens", SETTINGS, 1, 16), 0, BLOCKS, RUN, 0, COUNT)
    aim_through_lens(batch, packed, SAMPLES)
    return np.concatenate([lanes(batch, ORIGIN, 3), lanes(batch, DIRECTION, 3)], axis=1)


def lights() -> np.ndarray:
    packed = pack_lights(LIGHTS, np.zeros(3))
    batch = new_batch(SAMPLES)
    rng = np.random.default_rng(3)
    lanes(batch, POSITION, 3)[:] = rng.uniform(-1, 1, (SAMPLES, 3, LANES))
    for row in (GEOMETRIC_NORMAL, SHADING_NORMAL):
        lanes(batch, row, 3)[:, 2] = 1
    lanes(batch, ACTIVE, 1)[:] = rng.random((SAMPLES, 1, LANES)) < 0.9
    lanes(batch, OFFSET, 1)[:] = 1e-5
    lanes(batch, ALBEDO, 3)[:] = lanes(batch, THROUGHPUT, 3)[:] = 0.5
    lanes(batch, POINT, 2)[:] = rng.random((SAMPLES, 2, LANES))
    results = []
    for light in range(len(LIGHTS)):
        sample_light(batch, packed, light, SAMPLES)
        if packed.spot[light]:
            narrow_to_cone(batch, packed, light, SAMPLES)
        reflect_diffusely(batch, SAMPLES)
        results += [lanes(batch, LIGHT_WEIGHT, 1).copy(), lanes(batch, SHADOW + DIRECTION, 3).copy()]
        add_light(batch, packed, light, Clamp(np.float32(np.inf), np.float32(0)), SAMPLES)
    results += [lanes(batch, RADIANCE, 3), lanes(batch, SHADOW + T_FAR, 1)]
    return np.concatenate(results, axis=1)


def film() -> np.ndarray:
    batch = new_batch(SAMPLES)
    lanes(batch, RADIANCE, 3)[:] = np.random.default_rng(4).random((SAMPLES, 3, LANES))
    batch.floats[RADIANCE + Y + 2] = np.nan
    batch.floats[RADIANCE + 7] = np.inf
    sums = new_tile_sums(16)
    add_samples(sums, batch, True, 0, SAMPLES, COUNT)
    return np.concatenate([sums.count[:, None], *develop(sums, SAMPLES).values()], axis=1)


def call_embree_without_the_jit() -> None:
    """Let plain Python call Embree's C functions, which kernels otherwise find through LLVM."""
    library = embree.load_library()
    for kind in ("Intersect", "Occluded"):
        for width, arguments in ((1, 3), (16, 4)):
            signature = ctypes.CFUNCTYPE(None, *[ctypes.c_size_t] * arguments)
            function = ctypes.cast(getattr(library, f"rtc{kind}{width}"), signature)
            setattr(embree, f"_{kind.lower()}{width}", function)


def picture_of(scene: Scene, **changes) -> np.ndarray:
    """(pixels, channels): all passes of a picture of a few pixels."""
    if config.DISABLE_JIT:
        call_embree_without_the_jit()
    settings = RenderSettings(**{"samples": 2, "seed": 1, "threads": 1, "batch_packets": 1} | changes)
    film_ = render(scene, settings)
    assert film_.dropped_samples == 0
    return np.concatenate([values.reshape(-1, values.shape[-1]) for values in film_.passes.values()], axis=1)


def diffuse_paths() -> np.ndarray:
    """Lambertian surfaces without programs: lamps, a glowing mesh and a grey world."""
    instances = (
        Instance(floor(4), materials=(Material("matte", Diffuse(0.6)),)),
        Instance(floor(1.0, (0.6, 0, 0.8)), materials=(Material("glow", Emission(2.0)),)),
    )
    scene = Scene(camera_down(3.0, (4, 4), height=2), instances, LIGHTS, (0.1, 0.2, 0.3))
    return picture_of(scene, max_bounces=4, denoising_albedo=True)


def light_on_everything() -> np.ndarray:
    """Programs, lobes of each kind, panes, a textured mesh light, and a world that is a picture.

    Not beyond the first bounce: round and bumpy surfaces magnify what the two ways round differently.
    """
    return picture_of(everything((8, 4)), max_bounces=0, denoising_albedo=True)


def paths_between_walls() -> np.ndarray:
    """Lobes and a pane in a glowing box, up to where Russian roulette ends paths."""
    mixed = MixShader(0.4, Diffuse((0.8, 0.5, 0.2), 1.0), MixShader(0.5, Glossy(0.7, 0.5), Metallic(roughness=0.6)))
    walls = Instance(box(4), materials=(Material("walls", AddShader(mixed, Emission((0.3, 0.2, 0.1)))),))
    pane = Instance(
        floor(3, (0, 0, -1)), materials=(Material("pane", MixShader(0.3, Transparent(0.6), Translucent())),)
    )
    scene = Scene(camera_down(2.0, (4, 4), height=0.5), (walls, pane), LIGHTS[:1])
    return picture_of(scene, max_bounces=5)


STAGES = {
    f.__name__: f
    for f in (
        domains,
        warps,
        textures,
        camera_rays,
        lights,
        film,
        diffuse_paths,
        light_on_everything,
        paths_between_walls,
    )
}


@pytest.fixture(scope="module")
def interpreted() -> dict[str, np.ndarray]:
    """The stages' results from a Python without the JIT."""
    root = Path(__file__).parent.parent
    code = (
        "import io, sys, numpy as np, numba; assert numba.config.DISABLE_JIT\n"
        "from tests.test_without_jit import STAGES\n"
        "out = io.BytesIO(); np.savez(out, **{name: stage() for name, stage in STAGES.items()})\n"
        "sys.stdout.buffer.write(out.getvalue())"
    )
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=root,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr.decode()
    return dict(np.load(io.BytesIO(run.stdout)))


@pytest.mark.parametrize("name", STAGES)
def test_without_the_jit_the_numbers_are_the_same(name, interpreted):
    compiled = STAGES[name]()
    assert compiled.shape == interpreted[name].shape
    if name == "domains":
        assert np.array_equal(compiled, interpreted[name])
    else:
        assert np.allclose(compiled, interpreted[name], rtol=2e-4, atol=2e-6)


def test_samples_that_are_no_numbers_are_left_out_of_the_mean():
    """Two of the first packet's: pixel 0 lost sample 2, pixel 1 sample 7 - 5."""
    count = film()[:, 0]
    assert count.tolist() == [4, 4, *[5] * 14]
    assert np.isfinite(film()).all()
