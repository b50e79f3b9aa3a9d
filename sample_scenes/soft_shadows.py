"""soft_shadows.blend: a dense torus knot in the light of three area lights, each of another shape and colour.

A rectangle is red, a disk blue and an ellipse green: where all three are seen the floor is nearly white, and the knot
hides each from another part of it, so that shadows overlap in every mixture. Their edges are sharp where the knot
touches the floor and widen away from it. Noise in sampled lights shows best in such wide penumbrae.
"""

import common
import numpy as np

KNOT = 2, 3  # turns about the axis, turns about the ring
ALONG, AROUND = 256, 24  # faces of the tube before it is subdivided twice: 196,608 triangles after


def knot_tube(radius=0.34):
    """Vertices and faces of a tube around the (2, 3) torus knot, carried along without twist discontinuity."""
    p, q = KNOT
    t = np.linspace(0, 2 * np.pi, ALONG, endpoint=False)

    def curve(t):
        ring = 1.25 + 0.55 * np.cos(q * t)
        return np.stack([ring * np.cos(p * t), ring * np.sin(p * t), 0.62 * np.sin(q * t)], axis=-1)

    centre = curve(t)
    tangent = curve(t + 1e-4) - curve(t - 1e-4)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    # Frame from the ring's axis of symmetry: smooth, periodic, never parallel to this knot's tangent.
    core = np.stack([1.25 * np.cos(p * t), 1.25 * np.sin(p * t), 0 * t], axis=-1)
    normal = centre - core
    normal -= np.sum(normal * tangent, axis=1, keepdims=True) * tangent
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    binormal = np.cross(tangent, normal)

    angle = np.linspace(0, 2 * np.pi, AROUND, endpoint=False)[None, :, None]
    flutes = radius * (1 + 0.07 * np.cos(8 * angle + 9 * t[:, None, None]))
    points = centre[:, None] + flutes * (np.cos(angle) * normal[:, None] + np.sin(angle) * binormal[:, None])

    index = np.arange(ALONG * AROUND).reshape(ALONG, AROUND)
    along, around = np.roll(index, -1, axis=0), np.roll(index, -1, axis=1)
    faces = np.stack([index, along, np.roll(along, -1, axis=1), around], axis=-1)
    return points.reshape(-1, 3), faces.reshape(-1, 4)


def main():
    scene = common.new_scene("soft_shadows", (512, 512))
    common.world(scene, (0, 0, 0))

    common.rectangle(scene, "Floor", (60, 60), common.diffuse("Plaster", (0.8, 0.8, 0.8)))
    vertices, faces = knot_tube()
    chalk = common.diffuse("Chalk", (0.85, 0.82, 0.76))
    turned = np.radians((62, 8, 25))
    knot = common.mesh(scene, "Knot", vertices, faces.tolist(), [chalk], (0, 0, 1.68), turned, smooth=True)
    subdivide = knot.modifiers.new("Subdivide", "SUBSURF")
    subdivide.levels, subdivide.render_levels = 1, 2

    common.lathe(
        scene, "Ball", [(0.38 * np.sin(a), 0.38 - 0.38 * np.cos(a)) for a in np.linspace(0, np.pi, 65)],
        common.diffuse("Slate", (0.5, 0.5, 0.52)), (1.9, -1.5, 0), steps=128,
    )  # fmt: skip

    middle = (0, 0, 0.8)
    common.light(
        scene, "Rectangle", "AREA", (-11, -5.5, 8.2), middle, 2050, (1, 0.36, 0.16),
        shape="RECTANGLE", size=3.2, size_y=1.0,
    )  # fmt: skip
    common.light(scene, "Disk", "AREA", (11, -4.5, 9), middle, 1850, (0.16, 0.5, 1), shape="DISK", size=1.5)
    common.light(
        scene, "Ellipse", "AREA", (1, 12, 11), middle, 1000, (0.42, 1, 0.3), shape="ELLIPSE", size=3.5, size_y=1.2
    )
    common.camera(scene, (0.9, -8.6, 8.2), (0.1, -0.05, 0.75), lens=50)
    common.use_rooks(scene, samples=64)
    common.save(scene)


if __name__ == "__main__":
    main()
