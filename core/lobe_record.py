"""How a lobe, one summand of a surface's BSDF at one hit, is stored: LOBE_SIZE numbers.

A lane's lobes are records one after the other in `Batch.lobes`: lobe k of lane j begins at (j × the scene's largest
count + k) × LOBE_SIZE. `lobes` evaluates and samples them.
"""

from __future__ import annotations

LOBE_SIZE = 24

#: Fields of a lobe, as offsets.
KIND = 0  # LAMBERT, ...
WEIGHT = 1  # (3) what the lobe is multiplied with
CHANCE = 4  # how likely it is to be sampled, relative to the other lobes of the hit: > 0
ALPHA = 5  # microfacets: roughness², up to 1; Oren-Nayar: roughness, 0 to 1; cosine power: the exponent
ETA = 6  # index of refraction of the far side over that of the viewer's
TILT = 6  # Lambert, Oren-Nayar: `diffuse.bump_alpha_squared`, 0 where the normal is the surface's own
FRESNEL = 7  # NO_FRESNEL, ...
F0 = 8  # (3) Schlick, F82: reflectance head on; conductor: n
SMOOTH_NORMAL = 8  # (3) Lambert, Oren-Nayar with a tilt: the normal that a bump tilted
F90 = 11  # (3) Schlick: at grazing angles; F82: the coefficient B; conductor: k
REFLECTION_TINT = 14  # (3) glass; Oren-Nayar: the albedo that each further bounce between its facets is tinted with
TRANSMISSION_TINT = 17  # (3) glass
EXPONENT = 20  # Schlick; negative: follow the dielectric's curve for that ior instead
NORMAL = 21  # (3) unit, world space, on the viewer's side

LAMBERT, OREN_NAYAR, TRANSLUCENT, TRANSPARENT, GGX_REFLECTION, GGX_REFRACTION, GGX_GLASS, COSINE_POWER = range(8)
NO_FRESNEL, DIELECTRIC, SCHLICK, F82_TINT, CONDUCTOR = range(5)
