"""From a scene to what the kernels share: arrays, Embree's structure, tables of points, and which stages are run.

A window prepares a scene again at each change. Then the preparation before lends what is still true: the structure
where nothing has moved, and the tables where the same points are asked for.
"""

from __future__ import annotations

import threading
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

import numpy as np

from .batch import Batch, new_batch
from .camera import pack_camera
from .direct_light import Clamp
from .domains import NO_POINTS, PointTable, Run, make_table
from .environment import NO_ENVIRONMENT
from .film import new_tile_sums
from .filters import offset_table
from .integrator import Frame, Limits, Points, Ways, render_blocks
from .light_arrays import LightArrays, pack_lights
from .materials import fill_constants
from .mesh_lights import find_mesh_lights
from .packing import PackedScene, pack_scene
from .programs import NONE
from .scattering import ROULETTE_FROM
from .scene import VISIBLE_TO_DIFFUSE, VISIBLE_TO_SURFACES, Camera, Scene
from .settings import RenderSettings
from .world_light import picture_world

#: A domain's table, behind what it was made for.
KnownTable = tuple[tuple, PointTable]


@dataclass
class Prepared:
    """A scene ready to be rendered with `settings`, until `let_go` is called."""

    settings: RenderSettings
    packed: PackedScene
    frame: Frame
    registers: np.ndarray
    tables: dict[str, KnownTable]
    _memory: threading.local = field(default_factory=threading.local)

    def seen_by(self, camera: Camera) -> Frame:
        """The frame as another camera sees the scene."""
        frame = self.frame._replace(camera=pack_camera(camera, self.packed.center, offset_table(self.settings)))
        if camera.lens_radius > 0 and frame.points.lens is NO_POINTS:
            self.tables["lens"] = _table("lens", self.settings, 1, camera, self.tables)
            frame = frame._replace(points=frame.points._replace(lens=self.tables["lens"][1]))
        return frame

    def workspace(self) -> tuple[Batch, Batch]:
        """The calling thread's working memory: the paths, and points beside them where the scene has use for it."""
        if not hasattr(self._memory, "workspace"):
            self._memory.workspace = self._new_workspace(self.settings.batch_packets)
        return self._memory.workspace

    def _new_workspace(self, packets: int) -> tuple[Batch, Batch]:
        lobes, ways = self.frame.scene.materials.largest_lobe_count, self.frame.ways
        looks_aside = ways.emitters_vary or ways.has_environment or ways.can_pass
        beside = new_batch(packets if looks_aside else 0, lobes, self.registers)
        return new_batch(packets, lobes, self.registers), beside

    @property
    def memory(self) -> int:
        """Bytes that the render needs beside its film: the scene, the structure, the tables, the threads' batches."""
        of_a_thread = sum(map(_bytes, self._new_workspace(self.settings.batch_packets)))
        return _bytes(self.frame) + self.packed.memory + of_a_thread * self.settings.thread_count

    def load_kernels(self) -> Future:
        """Compile the kernels, or load them from the cache, in a thread of its own, by calling them for no blocks.

        Compiling takes many seconds and cannot be stopped: whoever does not wait for it leaves it to the next render.
        """
        batch, side = self._new_workspace(1)
        no_blocks, sums, stop = np.zeros((0, 2), np.int64), new_tile_sums(1), np.zeros(1, np.uint8)
        pool = ThreadPoolExecutor(1, "rooks-compile")
        loading = pool.submit(render_blocks, batch, side, self.frame, no_blocks, Run(0, 1), sums, stop)
        pool.shutdown(wait=False)
        return loading

    def let_go(self) -> None:
        """This preparation is not rendered any more; the structure goes when nobody uses it."""
        self.packed.structure.let_go()


def prepare(scene: Scene, settings: RenderSettings, before: Prepared | None = None) -> Prepared:
    """Prepare `scene`, with the help of an earlier preparation that has not been let go of.

    Raises:
        SceneError: the scene cannot be rendered; the text says what to mend.
        SettingsError: the settings do not fit the scene.
    """
    packed = pack_scene(scene, settings.thread_count, before.packed if before else None)
    try:
        return _prepare(scene, settings, packed, before)
    except BaseException:
        packed.structure.let_go()
        raise


def _prepare(scene: Scene, settings: RenderSettings, packed: PackedScene, before: Prepared | None) -> Prepared:
    arrays, programs, materials = packed.arrays, packed.programs, packed.arrays.materials
    registers = fill_constants(arrays, programs)
    camera = pack_camera(scene.camera, packed.center, offset_table(settings))
    only_diffuse = not any(material.has_lobes for material in programs.materials)
    kinds = VISIBLE_TO_DIFFUSE if only_diffuse else VISIBLE_TO_SURFACES
    lights = pack_lights([light for light in scene.lights if light.visibility & kinds], packed.center)
    can_pass = any(material.may_pass for material in programs.materials)
    world_varies = programs.world.start != NONE
    emitters = find_mesh_lights(scene, arrays.geometry, programs)
    has_emitters = len(emitters.area) > 0
    limits = _limits(settings, only_diffuse)
    surfaces_shine = any(material.may_emit for material in programs.materials)
    chooses_lamps = lights.each < len(lights.kind)
    ways = Ways(
        only_diffuse=only_diffuse,
        has_programs=bool((materials.program[:-1] != NONE).any()),
        chooses_lamps=chooses_lamps,
        has_emitters=has_emitters,
        emitters_vary=has_emitters and bool((materials.program[np.unique(emitters.material)] != NONE).any()),
        has_environment=world_varies,
        shines=surfaces_shine or world_varies or bool(materials.emission[materials.world].any()),
        surfaces_shine=surfaces_shine,
        lamps_can_be_met=not only_diffuse and bool((lights.area > 0).any()),
        can_pass=can_pass,
        hide_world=settings.film_transparent,
        wants_albedo=settings.denoising_albedo,
        light_samples=lights.each + chooses_lamps + has_emitters + world_varies,
        steps=limits.bounces + 1 + (limits.transparent + 1 if can_pass else 0),
    )
    dimensions = _dimensions(ways, lights, camera.lens_radius > 0)
    known = before.tables if before else {}
    tables = {name: _table(name, settings, count, scene.camera, known) for name, count in dimensions.items()}
    frame = Frame(
        scene=arrays,
        traversal=packed.traversal,
        camera=camera,
        lights=lights,
        emitters=emitters,
        environment=picture_world(arrays, programs, registers) if world_varies else NO_ENVIRONMENT,
        limits=limits,
        clamp=Clamp(np.float32(settings.clamp_indirect or np.inf), np.float32(limits.bounces)),
        ways=ways,
        points=Points(**{name: table for name, (_, table) in tables.items()}),
    )
    return Prepared(settings, packed, frame, registers, tables)


def _bytes(data: object) -> int:
    """The bytes of all arrays in a tuple of tuples."""
    if isinstance(data, np.ndarray):
        return data.nbytes
    return sum(map(_bytes, data)) if isinstance(data, tuple) else 0


def _table(
    name: str, settings: RenderSettings, dimensions: int, camera: Camera, known: dict[str, KnownTable]
) -> KnownTable:
    """The table of a domain: the known one, where that was made for the same."""
    pixels = camera.resolution[0] * camera.resolution[1]
    purpose = settings.samplers[name], settings.sample_count, settings.seed, dimensions, pixels
    if name in known and known[name][0] == purpose:
        return known[name]
    return purpose, make_table(name, settings, dimensions, pixels)


def _limits(settings: RenderSettings, only_diffuse: bool) -> Limits:
    bounces = min(settings.max_bounces, settings.diffuse_bounces) if only_diffuse else settings.max_bounces
    return Limits(
        bounces,
        settings.diffuse_bounces,
        settings.glossy_bounces,
        settings.transmission_bounces,
        settings.transparent_bounces,
    )


def _dimensions(ways: Ways, lights: LightArrays, has_lens: bool) -> dict[str, int]:
    """How many point sets a path takes from each domain; 0 where the scene does not use the domain."""
    samples_lights = lights.extended.any() or ways.chooses_lamps or ways.has_emitters or ways.has_environment
    scatters = ways.steps if ways.steps > 1 or ways.shines or ways.lamps_can_be_met else 0
    # The choice of a lobe and Russian roulette take a set of their own.
    chooses = scatters > ROULETTE_FROM or not ways.only_diffuse
    return {
        "pixel": 1,
        "lens": int(has_lens),
        "light": ways.light_samples * ways.steps if samples_lights else 0,
        "bsdf": scatters * (2 if chooses else 1),
    }
