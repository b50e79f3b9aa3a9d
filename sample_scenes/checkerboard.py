"""checkerboard.blend: a plane of black and white checks that runs to the horizon.

After Figures 5.19 to 5.21 of K. Suffern, Ray Tracing from the Ground Up (2007), where one and 256 samples a pixel of
each technique are compared on such a plane. Near the camera a check is many pixels wide; at the horizon hundreds of
checks fall into one pixel, whose right colour is their mean: what a technique makes of that is seen at a glance.
"""

import common

SIZE = 4000  # metres, and checks: the camera stands over the middle, so the horizon is 2 km away
EYE_HEIGHT = 2.2


def main():
    scene = common.new_scene("checkerboard", (400, 400))
    common.world(scene, (0.66, 0.78, 0.92))
    board = common.checker("Checks", colour1=(0.05, 0.05, 0.05), colour2=(0.9, 0.9, 0.9), scale=1)
    # One quad would do. Smaller ones keep the texture coordinates exact to a fraction of a millimetre near the camera.
    common.rectangle(scene, "Plane", (SIZE, SIZE), board, uv=(SIZE, SIZE), cells=(40, 40))
    common.light(scene, "Sun", "SUN", (0, 0, 10), (4, 6, 0), 0.7, (1, 0.93, 0.8), angle=0.01)
    common.camera(scene, (0.3, 0, EYE_HEIGHT), (1.1, 8, EYE_HEIGHT - 1.9), lens=32)
    common.use_rooks(scene, samples=64)
    common.save(scene)


if __name__ == "__main__":
    main()
