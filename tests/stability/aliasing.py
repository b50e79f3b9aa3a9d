"""Aliasing: detail finer than the pixels, met by points of each sampler."""

from __future__ import annotations

import math

import numpy as np

from core import SAMPLERS, Instance, Material, RenderSettings, Scene, render
from core.lab.figure_moire import band
from core.lab.figure_shots import regularity, regularity_of_noise
from core.lab.scenes import checkerboard
from core.lab.spectrum import periodograms
from core.shaders import Emission
from core.values import OBJECT, Affine, ImageTexture, Math, Value
from tests.scenes import camera_down, floor, picture

from .case import Record, case
from .counts import ALIKE, CHANCE, largest_by_chance


@case(
    "A checkerboard to the horizon",
    happens="Waves of large checks where the small ones are finer than the pixels: moiré.",
    why="Points at equal steps cannot tell a fine pattern from a coarse one (Shannon 1949). Chance in their places "
    "turns it into noise (Cook 1986).",
    rooks="Shows what the sampler sees. The default, multi-jittered, makes noise of it.",
    instead="Any sampler but Regular and Hammersley; more samples push their waves towards the horizon",
)
def checks_to_the_horizon(record: Record) -> None:
    """The share of the error's energy in each row's strongest frequency, with 4 samples per pixel."""
    truth = _far_checks("sobol_owen", 2048, seed=50)
    white, shares, errors = regularity_of_noise(truth.shape[1]), {}, {}
    for name in SAMPLERS:
        errors[name] = [_far_checks(name, 4, seed) - truth for seed in range(3)]
        shares[name] = float(np.mean([regularity(error) for error in errors[name]]))
        record.samplers[name] = f"{shares[name]:.2f} of the error is waves (white noise: {white:.2f})"
    record.claim("lower share of Regular and Hammersley", min(shares[name] for name in ALIKE), at_least=1.5 * white)
    highest = _share_by_chance(errors["random"])
    record.claim("largest share of the others", max(shares[name] for name in CHANCE), at_most=highest)
    for name in ("regular", "hammersley", "multi_jittered"):
        record.show(SAMPLERS[name].label, np.kron(errors[name][0] + truth, np.ones((3, 3, 1))))


def _share_by_chance(errors: list[np.ndarray]) -> float:
    """What white noise with the rows' deviations of `errors` exceeds once in 100,000: 4.3 deviations."""
    rng = np.random.default_rng(9)
    rows = np.mean([error[..., :1].std(axis=1, keepdims=True) for error in errors], axis=0)
    noise = [
        np.mean([regularity(rows * rng.standard_normal(errors[0][..., :1].shape)) for _ in errors]) for _ in range(300)
    ]
    return float(np.mean(noise) + 4.3 * np.std(noise))


def _far_checks(sampler: str, samples: int, seed: int) -> np.ndarray:
    """The far checks' part of the picture, (h, w, 3)."""
    scene = checkerboard((128, 128))
    rows, columns = band(scene.camera.resolution)
    border = columns.start, rows.start, columns.stop, rows.stop
    settings = RenderSettings(samples=samples, sampler=sampler, seed=seed, border=border)
    return render(scene, settings).passes["Combined"][..., :3].astype(float)


#: Pixels, samples, and the waves per pixel by which a fence's bars are off the points' own frequency.
SIDE, COUNT, BEAT = 32, 16, 1 / 16


@case(
    "A fence whose bars meet the points' spacing",
    happens="A few broad bars in place of many narrow ones, as strong as these; or grain as with one sample.",
    why="Each lattice has frequencies at which all of its points agree. The same in every pixel they show a wave, "
    "shifted at random in each pixel they show noise, as of one sample.",
    rooks="Shows what the sampler sees. Here each meets the fence that is worst for it: the strongest frequency of its "
    "own 16 points.",
    instead="Jittered, Multi-Jittered or Sobol, whose points agree at no frequency",
)
def fence(record: Record) -> None:
    """Bars of radiance ½ ± ½, of which a pixel ought to see hardly anything; the grain is the root of n × the peak."""
    waves, grains = {}, {}
    for name, sampler in SAMPLERS.items():
        x, y = _strongest_frequency(name)
        seen = picture(_bars(x + BEAT, y), samples=COUNT, sampler=name)
        waves[name], grains[name] = _wave_and_grain(seen)
        record.samplers[name] = f"({x}, {y}) bars per pixel: wave {waves[name]:.2f}, grain {grains[name]:.2f}"
        if name in ("regular", "hammersley", "fibonacci", "multi_jittered"):
            record.show(f"{sampler.label}, ({x}, {y})", np.repeat(np.kron(seen, np.ones((4, 4)))[..., None], 3, axis=2))
    lattices = ("fibonacci", "correlated_multi_jittered")
    leak = math.sin(math.pi * BEAT) / math.pi  # what the box filter leaves of bars that are one pixel wide and narrower
    chance = 1 + 4.5 / math.sqrt(2 * SIDE**2)
    record.claim("lower wave of Regular and Hammersley", min(waves[name] for name in ALIKE), at_least=0.9)
    record.claim("largest wave of the others", max(waves[name] for name in CHANCE), at_most=leak + 0.1)
    record.claim("grain of Fibonacci, over that of one sample", grains["fibonacci"], at_least=0.9)
    # The highest peaks of docs/sampling.md, 0.25 and 0.09, are shares of the energy.
    record.claim("of CMJ", grains["correlated_multi_jittered"], at_most=0.5 * chance)
    others = max(grains[name] for name in CHANCE if name not in lattices)
    record.claim("largest of the others", others, at_most=0.3 * chance)


def _strongest_frequency(name: str) -> tuple[int, int]:
    """Where the mean power of 64 sets is largest, in waves per pixel along x and y."""
    power = periodograms(SAMPLERS[name](64, COUNT, np.random.default_rng(2)), COUNT).mean(axis=0)
    y, x = np.mgrid[-COUNT : COUNT + 1, -COUNT : COUNT + 1]
    power -= 1e-4 * (x**2 + y**2)  # the widest bars, of those that are equally bad
    power[:, : COUNT + 1] = 0  # one of each pair of opposite frequencies, and bars that are not level
    place = np.unravel_index(power.argmax(), power.shape)
    return int(x[place]), int(y[place])


def _bars(x: float, y: float) -> Scene:
    """A glowing plane whose radiance is a wave between 0 and 1, of so many wave lengths per pixel."""
    phase = Affine(OBJECT, np.tile([2 * math.pi * x, 2 * math.pi * y, 0, 0], (3, 1)))
    return _glowing(Math("multiply_add", Math("sine", phase), 0.5, 0.5))


def _glowing(radiance: Value) -> Scene:
    """A plane on which a pixel is one metre wide, the origin in the middle of the picture."""
    glow = Material("glow", Emission(radiance), sample_as_light=False)
    return Scene(camera_down(SIDE, (SIDE, SIDE)), (Instance(floor(SIDE), materials=(glow,)),))


def _wave_and_grain(seen: np.ndarray) -> tuple[float, float]:
    """The height of the wave of BEAT along x, over the bars' own, and what is left over what one sample leaves."""
    x = np.arange(SIDE)[None, :] * BEAT
    waves = np.exp(2j * np.pi * x)
    height = (seen * waves.conj()).mean()
    rest = seen - seen.mean() - 2 * (height * waves).real
    return float(abs(height) * 4), float(rest.std() * math.sqrt(8))


@case(
    "Hammersley's own bias",
    happens="The picture is shifted up and to the right, with one sample by half a pixel; a seed changes nothing.",
    why="Its points are (i/n, Φ₂(i)): the first lies in the pixel's corner, and the mean of all is ½ − 1/2n.",
    rooks="Makes Hammersley's points as they are; docs/sampling.md says so.",
    instead="Sobol, Owen-Scrambled: as even, unbiased, and another set in each pixel",
)
def hammersley_shift(record: Record) -> None:
    """A ramp of radiance tells where the samples of a pixel are on average."""
    ramp = _glowing(Affine(OBJECT, np.tile([1.0 / SIDE, 0, 0, 0.5], (3, 1))))
    right = (np.arange(SIDE) + 0.5)[None, :] / SIDE
    largest = 0.0
    for name in SAMPLERS:
        shifts = {count: picture(ramp, samples=count, sampler=name) - right for count in (1, 4, 16)}
        record.samplers[name] = "pixels: " + ", ".join(f"{s.mean() * SIDE:+.3f} at {n}" for n, s in shifts.items())
        if name == "hammersley":
            for count, shift in shifts.items():
                off = float(np.abs(shift * SIDE + 1 / (2 * count)).max())
                record.claim(f"distance from the expected shift at {count}", off, at_most=1e-4)
        else:
            # The mean of random points' x has a deviation of 1/√12n; all others are as good at least.
            largest = max(largest, *(abs(s.mean()) * SIDE * math.sqrt(12 * n) * SIDE for n, s in shifts.items()))
    record.claim("largest |z| of the others' shift", largest, at_most=largest_by_chance(3 * len(SAMPLERS)))
    again = picture(ramp, sampler="hammersley", seed=1) - picture(ramp, sampler="hammersley", seed=0)
    record.claim("difference that a seed makes", float(np.abs(again).max()), at_most=0)


@case(
    "An image texture far away",
    happens="Thousands of texels in a pixel shine and flicker, with any sampler, and it takes thousands of samples.",
    why="Rooks has no mip maps (Williams 1983). A sample looks up four texels of thousands: where these have nothing "
    "in common, no arrangement of points helps, and the error falls with 1/√n.",
    rooks="Is unbiased: the pixel's mean is that of its texels.",
    instead="An image scaled down to a few texels per pixel",
)
def far_texture(record: Record) -> None:
    """Black and white texels at random, 32 × 32 in each pixel: the error is that of independent samples, always."""
    texels = 32
    rng = np.random.default_rng(3)
    image = rng.integers(2, size=(SIDE * texels, SIDE * texels, 1), dtype=np.uint8).repeat(3, axis=2) * 255
    truth = _blocks(image, texels)[..., 0]
    ratios = {
        name: [_texture_error(image, truth, name, count) * 2 * math.sqrt(count) for count in (1, 4, 16)]
        for name in SAMPLERS
    }
    for name, of_counts in ratios.items():
        record.samplers[name] = "/".join(f"{ratio:.2f}" for ratio in of_counts) + " of independent samples' error"
    every = [ratio for of_counts in ratios.values() for ratio in of_counts]
    # Points in strata of 64 texels miss 1/64 of the variance; with 1,024 pixels a deviation has an error of 2.2 %.
    record.claim("smallest error, over 1/(2√n)", min(every), at_least=1 - 5 / math.sqrt(2 * SIDE**2) - 1 / 64)
    record.claim("largest error, over 1/(2√n)", max(every), at_most=1 + 5 / math.sqrt(2 * SIDE**2))
    scaled = _blocks(image, texels // 4)
    gain = _texture_error(image, truth, "random", 16) / _texture_error(scaled, truth, "random", 16)
    # The means of 8 × 8 texels deviate by 1/8 of what the texels do; the ratio has an error of 3.1 %.
    what = "times less error of Random with 4 × 4 texels in a pixel"
    record.claim(what, gain, at_least=8 * (1 - 5 / SIDE), at_most=8 * (1 + 5 / SIDE))
    exact = _texture_error(scaled, truth, "multi_jittered", 16)
    record.claim("error of multi-jittered there, with one of 16 points in each texel", exact, at_most=1e-6)
    for label, shown in (("16 samples", image), ("16 samples, scaled down", scaled)):
        seen = picture(_textured(shown), samples=16)
        record.show(label, np.repeat(np.kron(seen, np.ones((4, 4)))[..., None], 3, axis=2))


def _textured(image: np.ndarray) -> Scene:
    return _glowing(ImageTexture(image, interpolation="closest", vector=Affine(OBJECT, _TO_UNIT)))


#: From metres about the middle of the picture to 0 … 1 across it.
_TO_UNIT = np.array([[1 / SIDE, 0, 0, 0.5], [0, 1 / SIDE, 0, 0.5], [0, 0, 0, 0]])


def _texture_error(image: np.ndarray, truth: np.ndarray, sampler: str, samples: int) -> float:
    count = SAMPLERS[sampler].actual_count(samples)
    seen = picture(_textured(image), samples=count, sampler=sampler, seed=4)
    return float(np.sqrt(((seen - truth) ** 2).mean()))


def _blocks(image: np.ndarray, size: int) -> np.ndarray:
    """The means of blocks of `size` × `size` texels of black and white bytes, linear float32."""
    height, width, channels = image.shape
    return image.reshape(height // size, size, width // size, size, channels).mean(axis=(1, 3), dtype=np.float32) / 255
