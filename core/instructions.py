"""The instructions of material programs: an operation, the register it fills if it fills one, and what it reads.

A program is a flat list of integers: the operation; then the result's register, where there is a result; then the
registers that are read; then numbers that belong to the operation. `compile_values` and `compile_shaders` write them,
`materials` and `surface_lobes` carry them out.
"""

from __future__ import annotations

#: "There is none", where an index is expected.
NONE = -1

# Operations that fill a register. `materials` tells groups of them apart by their order.
(
    UV,
    GENERATED,
    OBJECT,
    WORLD,
    DIRECTION,
    ATTRIBUTE,
    AFFINE,
    NORMALIZE,
    CHECKER,
    IMAGE,
    PANORAMA,
    RAMP,
    MIX,
    MATH,
    MAP_RANGE,
    GRAY,
    AVERAGE,
    COMPONENT,
    COMBINE,
    FRESNEL,
    LAYER_FRESNEL,
    FACING,
    NORMAL_MAP,
    BUMP,
) = range(24)
# Operations on the surface. REQUIRE_FINITE stands before what adds lobes, for each of its registers that could hold
# something else: lobes that are no numbers would be left out, and nobody would know.
(
    END,
    ALBEDO,
    EMIT,
    REQUIRE_FINITE,
    DIFFUSE,
    TRANSLUCENT,
    TRANSPARENT,
    GLOSSY,
    COSINE_POWER,
    METAL,
    CONDUCTOR,
    GLASS,
    REFRACTION,
    PRINCIPLED,
) = range(32, 46)

#: Where a bump's height is looked up: at the hit, and a small step beside it in either direction of the surface.
HERE, ASIDE_U, ASIDE_V = 0, 1, 2
