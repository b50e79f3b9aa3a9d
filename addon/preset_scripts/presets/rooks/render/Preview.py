import bpy

rooks = bpy.context.scene.rooks

rooks.samples = 4
rooks.preview_samples = 4
rooks.sampler = "CORRELATED_MULTI_JITTERED"
rooks.use_separate_samplers = False
rooks.max_bounces = 4
rooks.diffuse_bounces = 1
rooks.glossy_bounces = 2
rooks.transmission_bounces = 4
rooks.transparent_bounces = 8
rooks.clamp_indirect = 0.0
rooks.pixel_filter = "BOX"
