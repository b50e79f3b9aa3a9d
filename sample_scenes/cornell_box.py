"""cornell_box.blend: the Cornell box, as measured, with its tall block and with a sphere in place of its short one.

The box is the one that a photograph was once compared with (Goral, Torrance, Greenberg and Battaile, Modeling the
Interaction of Light Between Diffuse Surfaces, 1984; Cohen and Greenberg, The Hemi-Cube, 1985). Its geometry, camera,
reflectances and lamp are those that Cornell's Program of Computer Graphics publishes as "Cornell Box Data". Every
surface is diffuse. Light from the walls colours what they face, and the ceiling has no other light than that.
"""

import common

# The published spectra of the paints under daylight (CIE D65): summed with the colour matching functions of 1931 (as
# fitted by Wyman, Sloan and Shirley, 2013) over their 76 wavelengths, as linear Rec. 709.
WHITE = (0.738, 0.736, 0.739)
RED = (0.490, 0.050, 0.051)
GREEN = (0.069, 0.398, 0.087)
# The published lamp grows steadily from blue to red and looks orange. A photographer would balance most of that away.
LAMP = (1, 0.82, 0.62)
RADIANCE = 38  # W/(m² sr), red; not published

FLOOR = [(552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)]
CEILING = [(556.0, 548.8, 0), (556.0, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0)]
LIGHT = [(343, 548.8, 227), (343, 548.8, 332), (213, 548.8, 332), (213, 548.8, 227)]
BLOCK = [(423, 330, 247), (265, 330, 296), (314, 330, 456), (472, 330, 406)]  # its top
SPHERE = (185.5, 82.5, 168.5)  # where the short block's middle is; as high as it
EYE = (278, 273, -800)
FOCAL_LENGTH, FILM = 35, 25  # millimetres


def place(x, y, z):
    """Cornell's axes (left, up, away from the camera; millimetres) as Blender's metres, the camera's axis at x = 0."""
    return (EYE[0] - x) / 1000, z / 1000, y / 1000


def polygons(scene, name, faces, material):
    """A mesh of polygons, each given by its own corners in Cornell's axes."""
    vertices, indices = [], []
    for face in faces:
        indices.append(range(len(vertices), len(vertices) + len(face)))
        vertices += [place(*corner) for corner in face]
    return common.mesh(scene, name, vertices, indices, [material])


def main():
    scene = common.new_scene("cornell_box", (512, 512))
    common.world(scene, (0, 0, 0))

    white = common.diffuse("White", WHITE)
    back = [FLOOR[3], FLOOR[2], CEILING[2], CEILING[1]]
    # The lamp lies in the ceiling's plane, so the ceiling is a frame around it.
    frame = [[CEILING[i], CEILING[(i + 1) % 4], LIGHT[(i + 1) % 4], LIGHT[i]] for i in range(4)]
    polygons(scene, "Floor, back and ceiling", [FLOOR, back, *frame], white)
    polygons(scene, "Left wall", [[FLOOR[0], FLOOR[3], CEILING[1], CEILING[0]]], common.diffuse("Red", RED))
    polygons(scene, "Right wall", [[FLOOR[2], FLOOR[1], CEILING[3], CEILING[2]]], common.diffuse("Green", GREEN))
    polygons(scene, "Lamp", [LIGHT], common.emission("Lamp", LAMP, RADIANCE))

    foot = [(x, 0, z) for x, _, z in BLOCK]
    sides = [[foot[i], foot[(i + 1) % 4], BLOCK[(i + 1) % 4], BLOCK[i]] for i in range(4)]
    polygons(scene, "Tall block", [BLOCK, *sides], white)
    common.sphere(scene, "Sphere", SPHERE[1] / 1000, white, place(*SPHERE))

    eye = common.camera(scene, place(*EYE), place(*EYE[:2], 0), FOCAL_LENGTH)
    eye.data.sensor_width = FILM
    common.use_rooks(scene, samples=64)
    common.use_bounces(scene, 4, diffuse=4)
    common.save(scene)


if __name__ == "__main__":
    main()
