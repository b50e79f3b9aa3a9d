"""Images arrive as Cycles sees them: their encoding, their rows, their opacity."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.images import Images  # noqa: E402
from tests.addon_helpers import empty_scene, image, material  # noqa: E402

RED, GREEN, BLUE, WHITE = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def test_bytes_stay_as_they_are_bottom_row_first():
    pixels = Images().colors(image())
    assert pixels.dtype == np.uint8
    np.testing.assert_array_equal(pixels / 255, [[RED, GREEN], [BLUE, WHITE]])


@pytest.mark.parametrize("options", [{"float_buffer": True}, {"is_data": True}])
def test_float_images_and_data_are_linear(options):
    source = image(**options)
    source.pixels.foreach_set(np.tile(np.array([0.2, 0.2, 0.2, 1], np.float32), 4))
    pixels = Images().colors(source)
    assert pixels.dtype == np.float32
    np.testing.assert_allclose(pixels, 0.2, atol=0.5 / 255)


def test_an_image_is_read_once():
    images, source = Images(), image(opacity=0.5)
    assert images.colors(source) is images.colors(source)
    assert images.opacity(source) is images.opacity(source)
    assert images.colors(source) is not images.colors(image("Other"))


def test_packed_images_are_read(tmp_path):
    source = image()
    source.filepath_raw, source.file_format = str(tmp_path / "tiles.png"), "PNG"
    source.save()
    packed = bpy.data.images.load(source.filepath_raw)
    packed.pack()
    (tmp_path / "tiles.png").unlink()
    np.testing.assert_array_equal(Images().colors(packed)[0, 0], [255, 0, 0])


def test_gray_images_have_three_equal_channels(tmp_path):
    pil = pytest.importorskip("PIL.Image")
    pil.new("L", (2, 1), 100).save(tmp_path / "gray.png")
    pixels = Images().colors(bpy.data.images.load(str(tmp_path / "gray.png")))
    np.testing.assert_array_equal(pixels, np.full((1, 2, 3), 100))


def test_a_missing_image_is_magenta_and_named(tmp_path):
    lost = bpy.data.images.new("Lost", 1, 1)
    lost.source, lost.filepath = "FILE", str(tmp_path / "lost.png")
    np.testing.assert_array_equal(Images().colors(lost), [[[1, 0, 1]]])
    assert Images().problem_of(lost) == 'image "Lost" cannot be loaded'
    np.testing.assert_array_equal(Images().colors(None), [[[1, 0, 1]]])
    assert Images().problem_of(None) == "no image is chosen"
    assert Images().opacity(lost) is Images().opacity(None) is None


def test_a_colour_space_that_is_not_known_is_named():
    source = image()
    assert Images().problem_of(source) is None
    source.colorspace_settings.name = "ACEScg"
    assert "has the colour space ACEScg" in Images().problem_of(source)


# Sequences


def sequence(folder, count: int = 4) -> tuple[bpy.types.Image, bpy.types.ImageUser]:
    """Images of 1 × 1 pixels of the brightnesses 1, 2, … and a texture of theirs that shows number 2 at frame 10."""
    for number in range(1, count + 1):
        single = bpy.data.images.new("Single", 1, 1)
        single.pixels.foreach_set([number / 255] * 3 + [1])
        single.filepath_raw, single.file_format = str(folder / f"v2_{number:03d}.png"), "PNG"
        single.save()
    found = bpy.data.images.load(str(folder / "v2_001.png"))
    found.source = "SEQUENCE"
    _paint, tree, _output = material()
    user = tree.nodes.new("ShaderNodeTexImage").image_user
    user.frame_start, user.frame_duration, user.frame_offset = 10, 2, 1
    return found, user


@pytest.mark.parametrize(
    ("frame", "is_cyclic", "number"),
    [(10, False, 2), (11, False, 3), (12, False, 3), (5, False, 2), (12, True, 2), (9, True, 3)],
)
def test_of_a_sequence_the_file_of_the_frame_is_read(tmp_path, frame, is_cyclic, number):
    film, user = sequence(tmp_path)
    user.use_cyclic = is_cyclic
    before = len(bpy.data.images)
    np.testing.assert_array_equal(Images(frame).colors(film, user), [[[number] * 3]])
    assert Images(frame).problem_of(film, user) is None
    assert len(bpy.data.images) == before


def test_a_file_of_a_sequence_that_is_missing_is_named(tmp_path):
    film, user = sequence(tmp_path, count=2)
    np.testing.assert_array_equal(Images(11).colors(film, user), [[[1, 0, 1]]])
    assert Images(11).problem_of(film, user) == 'image "v2_001.png" cannot be loaded'


def test_sequences_are_only_read_in_the_main_thread(tmp_path):
    film, user = sequence(tmp_path)
    with ThreadPoolExecutor(1) as pool:
        problem = pool.submit(Images(10).problem_of, film, user).result()
        pixels = pool.submit(Images(10).colors, film, user).result()
    assert problem == 'image "v2_001.png" is a sequence, which is only read in renders from the command line'
    np.testing.assert_array_equal(pixels, [[[1, 0, 1]]])


def test_a_movie_is_named():
    film = image("Film")
    film.source = "MOVIE"
    text = 'image "Film" is a movie, which is not read: save it as a sequence of images'
    assert Images().problem_of(film) == text
    np.testing.assert_array_equal(Images().colors(film), [[[1, 0, 1]]])


# Opacity: three quarters, so that a byte holds 191


def colors(straight: bool, mode: str = "STRAIGHT", **options) -> np.ndarray:
    source = image(opacity=0.75, **options)
    source.alpha_mode = mode
    return Images().colors(source, straight=straight)[0, 0]


def test_bytes_are_multiplied_by_their_opacity_as_they_are_encoded():
    np.testing.assert_array_equal(colors(straight=False), (191, 0, 0))
    np.testing.assert_array_equal(colors(straight=True), (255, 0, 0))


def test_blender_has_multiplied_the_colours_of_float_images():
    np.testing.assert_allclose(colors(straight=False, float_buffer=True), (1, 0, 0))
    np.testing.assert_allclose(colors(straight=True, float_buffer=True), (1 / 0.75, 0, 0), rtol=1e-6)


@pytest.mark.parametrize(("mode", "options"), [("NONE", {}), ("CHANNEL_PACKED", {}), ("STRAIGHT", {"is_data": True})])
def test_colours_that_do_not_belong_to_their_opacity_stay(mode, options):
    scale = 1 if options else 255
    np.testing.assert_allclose(colors(straight=False, mode=mode, **options), (scale, 0, 0))


def test_opacity():
    pixels = Images().opacity(image(opacity=0.75))
    assert (pixels.dtype, pixels.shape) == (np.float32, (2, 2, 3))
    np.testing.assert_allclose(pixels, 191 / 255)


def test_opacity_that_is_1_or_not_used_is_none():
    source = image(opacity=0.75)
    source.alpha_mode = "NONE"
    assert Images().opacity(source) is None
    assert Images().opacity(image("Opaque")) is None


def test_an_image_of_many_rows_is_read_whole():
    empty_scene()
    gradient = bpy.data.images.new("Gradient", 2, 150)
    rows = np.repeat((np.arange(150) / 255).astype(np.float32)[:, None], 2, axis=1)
    pixels = np.stack([rows, rows, rows, np.ones_like(rows)], axis=-1)
    gradient.pixels.foreach_set(pixels.ravel())
    colors = Images().colors(gradient)
    assert colors.dtype == np.uint8
    assert (colors[..., 0] == np.arange(150)[:, None]).all()
