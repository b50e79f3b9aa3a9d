"""The bounds of settings and of inputs, for those who only want to know them: this module imports nothing."""

#: More samples per pixel than this need tables larger than the memory of a common machine.
MAX_SAMPLES = 1 << 20
MAX_BOUNCES = 64
#: A path that only passes through is cheap, and leaves of a tree stand in its way by the hundred.
MAX_TRANSPARENT_BOUNCES = 256
#: Indices of refraction are kept between these: 0 would be divided by, and of one whose reflectance is 1 to float32
#: nothing would be left to go on with. At either end all but 1 in 25 000 is reflected head on.
LEAST_INDEX, LARGEST_INDEX = 1e-5, 1e5
MAX_SEED = 2**31 - 1
