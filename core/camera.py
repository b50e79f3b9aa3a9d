"""From sample points to camera rays.

A ray's direction is not normalised: its component along the view axis is 1, so that t is the depth that Blender's
clipping and Depth pass speak of.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .batch import (
    ACTIVE,
    DIRECTION,
    LANES,
    MASK,
    ORIGIN,
    PACKET,
    POINT,
    T_FAR,
    T_NEAR,
    TIME,
    Batch,
    Y,
    Z,
)
from .errors import SceneError
from .jit import device, kernel
from .packing import affine
from .scene import VISIBLE_TO_CAMERA, Camera
from .warps import square_to_disk, square_to_polygon

#: The size of the smallest pixel that float32 can hold samples in, as a share of its distance from the window's origin:
#: 16 steps.
FINEST_PIXEL = 16 * 2.0**-23
#: The nearest that a lens can focus, in its radius: float32 holds the squares of the slopes of its rays.
NEAREST_FOCUS = 1e-12
#: Squares of the camera's numbers, and what they are multiplied by, have to fit into float32.
LARGEST = 1e18


class CameraArrays(NamedTuple):
    """A camera for kernels. `window` is (left, bottom, step per pixel in x, in y) in float64."""

    window: np.ndarray
    rotation: np.ndarray  # (3, 3) float32
    position: np.ndarray  # (3,) float32, re-centred
    orthographic: bool
    clip_start: np.float32
    clip_end: np.float32
    lens_radius: np.float32
    focus_distance: np.float32
    blades: int
    blade_rotation: np.float32
    squeeze: np.float32
    filter_offsets: np.ndarray


def check_camera(camera: Camera) -> None:
    """Raise a SceneError if the camera's numbers make no picture."""
    width, height = camera.resolution
    if width < 1 or height < 1:
        raise SceneError(f"the picture has no pixels: its size is {width} × {height}")
    name = f"the camera {camera.name!r}" if camera.name else "the camera"
    numbers = (camera.matrix, camera.window, camera.lens_radius, camera.aperture_rotation)
    if not all((np.abs(number) < LARGEST).all() for number in numbers):
        raise SceneError(f"{name} has a position, a window or a lens of numbers that are not finite, or too large")
    _check_window(camera, name)
    if not 0 <= camera.clip_start < camera.clip_end:
        raise SceneError(
            f"{name} has the clip start {camera.clip_start:g} m and the clip end {camera.clip_end:g} m: "
            "move the start below the end"
        )
    if camera.lens_radius < 0:
        raise SceneError(f"{name} has a lens of the radius {camera.lens_radius:g} m: make it 0 or more")
    if camera.lens_radius > 0 and not camera.focus_distance > NEAREST_FOCUS * camera.lens_radius:
        raise SceneError(f"{name} focuses at {camera.focus_distance:g} m: move the plane in focus in front of it")
    if not 0 < camera.aperture_ratio < np.inf:
        raise SceneError(f"{name} has the aperture ratio {camera.aperture_ratio:g}: make it more than 0")


def _check_window(camera: Camera, name: str) -> None:
    left, right, bottom, top = camera.window
    pixel = min((right - left) / camera.resolution[0], (top - bottom) / camera.resolution[1])
    if not pixel > FINEST_PIXEL * max(map(abs, camera.window)):
        size = "orthographic scale" if camera.orthographic else "sensor"
        raise SceneError(f"{name} has pixels too small to be told apart: make its {size} larger or its shift smaller")


def pack_camera(camera: Camera, center: np.ndarray, filter_offsets: np.ndarray) -> CameraArrays:
    """Turn a camera that has been checked into what kernels read."""
    width, height = camera.resolution
    left, right, bottom, top = camera.window
    rows = affine(camera.matrix, center)
    return CameraArrays(
        window=np.array([left, bottom, (right - left) / width, (top - bottom) / height]),
        rotation=rows[:, :3].astype(np.float32, order="C"),
        position=rows[:, 3].astype(np.float32),
        orthographic=camera.orthographic,
        clip_start=np.float32(camera.clip_start),
        clip_end=np.float32(camera.clip_end),
        lens_radius=np.float32(camera.lens_radius),
        focus_distance=np.float32(camera.focus_distance if camera.lens_radius > 0 else 1),  # a pinhole's means nothing
        blades=camera.aperture_blades if camera.aperture_blades >= 3 else 0,
        blade_rotation=np.float32(camera.aperture_rotation),
        squeeze=np.float32(1 / camera.aperture_ratio),
        filter_offsets=filter_offsets,
    )


@kernel
def start_rays(batch: Batch, camera: CameraArrays, blocks: np.ndarray, first: int, samples: int, count: int) -> None:
    """Turn the pixel's sample points into positions in the camera's window: x and y of the ray's direction.

    `first`, `samples`, `count` and `blocks` number the samples as in `domains.look_up_points`.
    """
    left, bottom, step_x, step_y = camera.window
    filtered = len(camera.filter_offsets) > 2
    done = 0
    while done < count:
        pixel, number = divmod(first + done, samples)
        run = min(samples - number, count - done)
        # float64 up to the pixel's corner, so that a wide picture's pixels do not lose the digits of their samples.
        corner_x = np.float32(left + (blocks[pixel >> 4, 0] + (pixel & 3)) * step_x)
        corner_y = np.float32(bottom + (blocks[pixel >> 4, 1] + ((pixel >> 2) & 3)) * step_y)
        for j in range(done, done + run):
            i = j // LANES * PACKET + j % LANES
            u, v = batch.floats[i + POINT], batch.floats[i + POINT + Y]
            if filtered:
                u, v = _filtered(camera.filter_offsets, u), _filtered(camera.filter_offsets, v)
            batch.floats[i + DIRECTION] = corner_x + u * np.float32(step_x)
            batch.floats[i + DIRECTION + Y] = corner_y + v * np.float32(step_y)
        done += run


@device
def _filtered(offsets: np.ndarray, u: float) -> float:
    position = u * np.float32(len(offsets) - 1)
    low = int(position)
    return offsets[low] + (position - np.float32(low)) * (offsets[low + 1] - offsets[low])


@kernel
def aim_through_pinhole(batch: Batch, camera: CameraArrays, packets: int) -> None:
    """Make world-space rays of the window positions, through a pinhole or parallel."""
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            _aim(batch.floats, camera, i, np.float32(0), np.float32(0))
            batch.bits[i + MASK] = np.uint32(VISIBLE_TO_CAMERA)


@kernel
def aim_through_lens(batch: Batch, camera: CameraArrays, packets: int) -> None:
    """Make world-space rays of the window positions, through the lens points looked up last."""
    f = batch.floats
    for p in range(packets):
        for i in range(p * PACKET, p * PACKET + LANES):
            if camera.blades > 0:
                x, y = square_to_polygon(f[i + POINT], f[i + POINT + Y], camera.blades, camera.blade_rotation)
            else:
                x, y = square_to_disk(f[i + POINT], f[i + POINT + Y])
            _aim(f, camera, i, x * camera.lens_radius * camera.squeeze, y * camera.lens_radius)
            batch.bits[i + MASK] = np.uint32(VISIBLE_TO_CAMERA)


@device
def _aim(f: np.ndarray, camera: CameraArrays, i: int, lens_x: float, lens_y: float) -> None:
    """Send the ray of window position (x, y) through (lens_x, lens_y): all those of one position meet in the focus."""
    r, o = camera.rotation, camera.position
    x, y = f[i + DIRECTION], f[i + DIRECTION + Y]
    dx, dy = -lens_x / camera.focus_distance, -lens_y / camera.focus_distance
    if camera.orthographic:
        lens_x, lens_y = lens_x + x, lens_y + y
    else:
        dx, dy = dx + x, dy + y
    f[i + ORIGIN] = o[0] + r[0, 0] * lens_x + r[0, 1] * lens_y
    f[i + ORIGIN + Y] = o[1] + r[1, 0] * lens_x + r[1, 1] * lens_y
    f[i + ORIGIN + Z] = o[2] + r[2, 0] * lens_x + r[2, 1] * lens_y
    f[i + DIRECTION] = r[0, 0] * dx + r[0, 1] * dy - r[0, 2]
    f[i + DIRECTION + Y] = r[1, 0] * dx + r[1, 1] * dy - r[1, 2]
    f[i + DIRECTION + Z] = r[2, 0] * dx + r[2, 1] * dy - r[2, 2]
    f[i + T_NEAR] = camera.clip_start
    f[i + T_FAR] = camera.clip_end
    f[i + TIME] = np.float32(0)
    f[i + ACTIVE] = np.float32(1)
