"""Tangents are those of Blender's own implementation, on the triangles that are rendered, and of faces it refuses."""

from __future__ import annotations

import numpy as np
import pytest

bpy = pytest.importorskip("bpy")

from addon.tangents import corner_tangents  # noqa: E402
from tests.addon_helpers import empty_scene, quad  # noqa: E402


@pytest.fixture(autouse=True)
def _scene():
    empty_scene()


def triangulated(kind: str, smooth: bool, mirrored: bool) -> bpy.types.Mesh:
    """One of Blender's meshes, dented, with its own texture coordinates; those with u over 1/2 mirrored if wished."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")()
    obj = bpy.context.object
    obj.modifiers.new("Triangles", "TRIANGULATE")
    bpy.ops.object.modifier_apply(modifier="Triangles")
    mesh = obj.data
    points = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", points)
    mesh.vertices.foreach_set("co", points + np.random.default_rng(1).uniform(-0.02, 0.02, len(points)))
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(mesh.polygons))
    if mirrored:
        uvs = np.empty(2 * len(mesh.loops), np.float32)
        mesh.uv_layers.active.uv.foreach_get("vector", uvs)
        uvs[::2] = np.abs(uvs[::2] - 0.5)
        mesh.uv_layers.active.uv.foreach_set("vector", uvs)
    return mesh


def blenders(mesh) -> tuple[np.ndarray, np.ndarray]:
    """(T, 3, 4) by Blender, and our own of the same triangles."""
    mesh.calc_tangents()
    count = len(mesh.loops)
    parts = {}
    for name, width in (("tangent", 3), ("normal", 3), ("bitangent_sign", 1)):
        parts[name] = np.empty((count, width), np.float32)
        mesh.loops.foreach_get(name, parts[name].ravel() if width == 1 else parts[name].reshape(-1))
    uvs = np.empty((count, 2), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", uvs.reshape(-1))
    positions = np.array([mesh.vertices[loop.vertex_index].co for loop in mesh.loops], np.float32)
    theirs = np.hstack([parts["tangent"], parts["bitangent_sign"]]).reshape(-1, 3, 4)
    ours = corner_tangents(*(part.reshape(count // 3, 3, -1) for part in (positions, parts["normal"], uvs)))
    return theirs, ours


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("smooth", [False, True])
@pytest.mark.parametrize("kind", ["ico_sphere", "uv_sphere", "torus"])
def test_tangents_are_blenders(kind, smooth, mirrored):
    theirs, ours = blenders(triangulated(kind, smooth, mirrored))
    assert (ours.dtype, ours.shape) == (np.float32, theirs.shape)
    assert set(ours[..., 3].ravel()) == ({-1.0, 1.0} if mirrored else {1.0})
    np.testing.assert_array_equal(ours[..., 3], theirs[..., 3])
    np.testing.assert_allclose(ours[..., :3], theirs[..., :3], atol=1e-4)


def test_tangents_are_unit_vectors_across_their_normals():
    mesh = triangulated("torus", True, False)
    normals = np.array([loop.normal for loop in mesh.loops]).reshape(-1, 3, 3)
    tangents = blenders(mesh)[1][..., :3]
    np.testing.assert_allclose(np.linalg.norm(tangents, axis=-1), 1, rtol=1e-5)
    np.testing.assert_allclose((tangents * normals).sum(axis=-1), 0, atol=1e-5)


def test_texture_coordinates_without_an_area_have_the_direction_that_blender_gives_them():
    mesh = triangulated("ico_sphere", smooth=True, mirrored=False)
    mesh.uv_layers.active.uv.foreach_set("vector", np.zeros(2 * len(mesh.loops), np.float32))
    theirs, ours = blenders(mesh)
    np.testing.assert_array_equal(ours, theirs)


def test_texture_coordinates_without_an_area_have_a_direction():
    obj = quad()
    positions = np.array([[v.co for v in obj.data.vertices[:3]]], np.float32)
    up = np.tile(np.array((0, 0, 1), np.float32), (1, 3, 1))
    tangents = corner_tangents(positions, up, np.zeros((1, 3, 2), np.float32))
    np.testing.assert_array_equal(tangents, np.tile((1, 0, 0, -1), (1, 3, 1)))


def test_a_triangle_without_a_direction_takes_that_of_its_neighbours():
    positions = np.array([[(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0, 0), (0, 1, 0), (-1, 0, 0)]], np.float32)
    uvs = np.array([[(0, 0), (1, 0), (0, 1)], [(0, 0), (0, 1), (0, 2)]], np.float32)
    up = np.tile(np.array((0, 0, 1), np.float32), (2, 3, 1))
    tangents = corner_tangents(positions, up, uvs)[..., :3]
    np.testing.assert_allclose(tangents[1, :2], np.tile((1, 0, 0), (2, 1)), atol=1e-6)
