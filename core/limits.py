"""The bounds of the settings, for those who only want to know them: this module imports nothing."""

#: More samples per pixel than this need tables larger than the memory of a common machine.
MAX_SAMPLES = 1 << 20
MAX_BOUNCES = 64
#: A path that only passes through is cheap, and leaves of a tree stand in its way by the hundred.
MAX_TRANSPARENT_BOUNCES = 256
MAX_SEED = 2**31 - 1
