"""The user's settings: `scene.rooks`, `view_layer.rooks` for the passes, `material.rooks` for materials.

Lens, film, threads and resolution are Blender's own settings and stay where Blender keeps them.
"""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import comparing, versions
from ._core import core
from .progress import SAMPLERS_CONTEXT


def _tag_update(owner: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    # Blender does not notice by itself that an add-on's property changed.
    owner.id_data.update_tag()


SAMPLER_ITEMS = tuple(
    (name.upper(), sampler.label, sampler.description, sampler.number)
    for name, sampler in core.samplers.SAMPLERS.items()
)

#: The same for a choice of several, which Blender stores as bits.
SAMPLER_FLAGS = tuple((*texts, 1 << number) for *texts, number in SAMPLER_ITEMS)


def _sampler(label: str, description: str) -> EnumProperty:
    return EnumProperty(
        name=label,
        description=description,
        items=SAMPLER_ITEMS,
        default="MULTI_JITTERED",
        update=_tag_update,
        translation_context=SAMPLERS_CONTEXT,
    )


def _bounces(label: str, description: str, default: int, largest: int = core.limits.MAX_BOUNCES) -> IntProperty:
    return IntProperty(
        name=label,
        description=description,
        min=0,
        max=largest,
        default=default,
        update=_tag_update,
    )


class RooksComparisonSettings(bpy.types.PropertyGroup):
    """What *Compare Samplers* measures: `scene.rooks.comparison`. It changes no picture."""

    samplers: EnumProperty(
        name="Samplers",
        description="The samplers to compare",
        items=SAMPLER_FLAGS,
        options={"ENUM_FLAG"},
        translation_context=SAMPLERS_CONTEXT,
        default={name.upper() for name in comparing.DEFAULT_SAMPLERS},
    )
    counts: StringProperty(
        name="Samples",
        description="Numbers of samples per pixel, such as: 4 16 64. A sampler that cannot make one of them takes the "
        "next one above that it can",
        default=" ".join(map(str, comparing.DEFAULT_COUNTS)),
    )
    seeds: IntProperty(
        name="Seeds",
        description="How many noise patterns of each are measured: more make the measured error more certain",
        min=1,
        max=comparing.MAX_SEEDS,
        soft_max=50,
        default=comparing.DEFAULT_SEEDS,
    )
    size: IntProperty(
        name="Longer Side",
        description="Pictures with a longer side than this are measured at this size",
        min=4,
        max=65536,
        soft_max=4096,
        default=comparing.DEFAULT_SIZE,
        subtype="PIXEL",
    )
    folder: StringProperty(
        name="Folder",
        description="Where the sheet, the chart and the tables are saved. Empty: the folder for temporary files",
        subtype="DIR_PATH",
        options=versions.path_options(),
    )


class RooksSceneSettings(bpy.types.PropertyGroup):
    """How a scene is sampled: `scene.rooks`."""

    samples: IntProperty(
        name="Samples",
        description="Samples per pixel. A sampler that cannot make this count takes the next one above that it can. "
        "Textures finer than the pixels need more of them with any sampler",
        min=1,
        max=core.limits.MAX_SAMPLES,
        soft_max=4096,
        default=16,
        update=_tag_update,
    )
    preview_samples: IntProperty(
        name="Viewport Samples",
        description="Samples per pixel in the rendered viewport, which takes them one after the other. At the same "
        "count as for renders it ends with the same picture",
        min=1,
        max=core.limits.MAX_SAMPLES,
        soft_max=4096,
        default=16,
        update=_tag_update,
    )
    sampler: _sampler("Sampler", "The technique that places the samples of every domain")
    use_separate_samplers: BoolProperty(
        name="Separate Samplers",
        description="Choose a technique for each domain: the pixel, the lens, the lights and the surfaces",
        default=False,
        update=_tag_update,
    )
    pixel_sampler: _sampler("Pixel", "Places the camera rays on the area of a pixel: antialiasing")
    lens_sampler: _sampler("Lens", "Places the camera rays on the lens: depth of field")
    light_sampler: _sampler("Light", "Places the shadow rays on the lights: soft shadows")
    bsdf_sampler: _sampler(
        "Surface", "Places the directions in which surfaces look for the world, glowing meshes and bounced light"
    )
    seed: IntProperty(
        name="Seed",
        description="Another seed gives another, independent noise pattern",
        min=0,
        default=0,
        update=_tag_update,
    )
    use_animated_seed: BoolProperty(
        name="Animate Seed",
        description="Give each frame of an animation a noise pattern of its own",
        default=False,
        update=_tag_update,
    )
    tile_size: IntProperty(
        name="Tile Size",
        description="The side of the squares in which a picture is rendered and shown. It changes nothing in the "
        "picture: small tiles appear sooner, and keep all threads busy to the end",
        min=4,
        max=4096,
        soft_min=16,
        soft_max=512,
        default=64,
        subtype="PIXEL",
    )
    max_bounces: _bounces(
        "Max Bounces", "How often light may be reflected or let through on its way, in all. 0 is direct light only", 12
    )
    diffuse_bounces: _bounces(
        "Diffuse Bounces", "How often light may be reflected diffusely, within the total of Max Bounces", 4
    )
    glossy_bounces: _bounces(
        "Glossy Bounces", "How often light may be reflected by glossy surfaces, within the total of Max Bounces", 4
    )
    transmission_bounces: _bounces(
        "Transmission Bounces", "How often light may go through glass and the like, within the total of Max Bounces", 12
    )
    transparent_bounces: _bounces(
        "Transparent Bounces",
        "How many transparent surfaces light may pass straight on. They do not count for Max Bounces",
        8,
        core.limits.MAX_TRANSPARENT_BOUNCES,
    )
    clamp_indirect: FloatProperty(
        name="Clamp Indirect",
        description="The most that a single sample of bounced light may add; what is above it is cut off. Fewer "
        "fireflies, but a bias: the picture gets darker than it should be, whatever the number of samples. A larger "
        "lamp makes fewer without one. 0 is off",
        min=0.0,
        soft_max=100.0,
        default=0.0,
        update=_tag_update,
    )
    pixel_filter: EnumProperty(
        name="Pixel Filter",
        description="How the samples around a pixel add up to it",
        items=(
            ("BOX", "Box", "The mean over the pixel's own square", 0),
            ("BLACKMAN_HARRIS", "Blackman-Harris", "A smooth bell of the chosen width: softer, without stair steps", 1),
        ),
        default="BOX",
        update=_tag_update,
    )
    comparison: PointerProperty(
        type=RooksComparisonSettings, name="Comparison", description="What Compare Samplers measures"
    )


def _update_passes(settings: bpy.types.PropertyGroup, _context: bpy.types.Context) -> None:
    scene = settings.id_data
    view_layer = next((layer for layer in scene.view_layers if layer.rooks == settings), None)
    if view_layer is not None:
        view_layer.update_render_passes()
    scene.update_tag()


class RooksViewLayerSettings(bpy.types.PropertyGroup):
    """What a view layer renders beside the picture: `view_layer.rooks`."""

    use_pass_sampling_error: BoolProperty(
        name="Sampling Error",
        description="The standard error of each pixel's mean, estimated from its samples",
        default=False,
        update=_update_passes,  # by name: a lambda in an annotation would not find it
    )
    use_pass_denoising_data: BoolProperty(
        name="Denoising Data",
        description="Normal and albedo of what the camera sees, for the compositor's Denoise node",
        default=False,
        update=_update_passes,
    )


class RooksMaterialSettings(bpy.types.PropertyGroup):
    """What a material is beside its nodes: `material.rooks`."""

    glossy_lobe: EnumProperty(
        name="Glossy Lobe",
        description="How the material's Glossy BSDF nodes scatter light",
        items=(
            ("MICROFACET", "Microfacet", "By the distribution that each node chooses, as in Cycles", 0),
            (
                "COSINE_POWER",
                "Cosine Power",
                "Replaces the lobe of the material's Glossy BSDF nodes by the textbook's (Suffern, Ray Tracing from "
                "the Ground Up, ch. 25): a power of the cosine about the mirror direction",
                1,
            ),
        ),
        default="MICROFACET",
        update=_tag_update,
    )


CLASSES = (RooksComparisonSettings, RooksSceneSettings, RooksViewLayerSettings, RooksMaterialSettings)


def register() -> None:
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    for owner, settings, description in (
        (bpy.types.Scene, RooksSceneSettings, "How Rooks samples the scene"),
        (bpy.types.ViewLayer, RooksViewLayerSettings, "What Rooks renders beside the picture"),
        (bpy.types.Material, RooksMaterialSettings, "What a material is for Rooks beside its nodes"),
    ):
        owner.rooks = PointerProperty(type=settings, name="Rooks", description=description)


def unregister() -> None:
    del bpy.types.Material.rooks
    del bpy.types.ViewLayer.rooks
    del bpy.types.Scene.rooks
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
