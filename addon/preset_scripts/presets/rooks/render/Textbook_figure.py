import bpy

rooks = bpy.context.scene.rooks

rooks.samples = 16
rooks.preview_samples = 16
rooks.sampler = "MULTI_JITTERED"
rooks.use_separate_samplers = False
rooks.max_bounces = 0
rooks.diffuse_bounces = 4
rooks.glossy_bounces = 4
rooks.transmission_bounces = 12
rooks.transparent_bounces = 8
rooks.clamp_indirect = 0.0
rooks.pixel_filter = "BOX"
