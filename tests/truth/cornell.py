"""Indirect light of the Cornell box of `tools/shared/src/scenes/cornell.rs`, path-traced.

    pip install mitsuba numpy
    python3 tests/truth/cornell.py cornell.exr [samples]

Writes the mean of 8x8-pixel blocks of a 320x184 picture, nits, as EXR.
"""

import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
from mitsuba import ScalarTransform4f as T

WIDTH, HEIGHT = 320, 184
HALF = (2.764, 2.744, 2.796)
WALL = 0.3
CANDELA = 800.0


def diffuse(r, g, b):
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": [r, g, b]}}


WHITE, RED, GREEN = diffuse(0.73, 0.73, 0.73), diffuse(0.63, 0.065, 0.05), diffuse(0.14, 0.45, 0.091)


def cuboid(center, half, bsdf, degrees=0.0):
    transform = T().translate(list(center)) @ T().rotate([0, 1, 0], degrees) @ T().scale(list(half))
    return {"type": "cube", "to_world": transform, "bsdf": bsdf}


def scene():
    hx, hy, hz = HALF
    w = WALL / 2
    ox, oz = hx + WALL, hz + WALL
    return {
        "type": "scene",
        "floor": cuboid((0, -w, 0), (ox, w, oz), WHITE),
        "ceiling": cuboid((0, 2 * hy + w, 0), (ox, w, oz), WHITE),
        "back": cuboid((0, hy, -hz - w), (ox, hy, w), WHITE),
        "left": cuboid((-hx - w, hy, 0), (w, hy, hz), RED),
        "right": cuboid((hx + w, hy, 0), (w, hy, hz), GREEN),
        "short": cuboid((0.909, 0.825, 1.106), (0.835, 0.825, 0.835), WHITE, -17.0),
        "tall": cuboid((-0.921, 1.65, -0.717), (0.83, 1.65, 0.83), WHITE, 17.2),
        "light": {
            "type": "point",
            "position": [0.0, 4.9, 0.0],
            "intensity": {"type": "rgb", "value": CANDELA},
        },
        "camera": {
            "type": "perspective",
            "fov": 38.5,
            "fov_axis": "y",
            "to_world": T().look_at(origin=[0, 2.74, 10.8], target=[0, 2.74, 0], up=[0, 1, 0]),
            "film": {
                "type": "hdrfilm",
                "width": WIDTH,
                "height": HEIGHT,
                "rfilter": {"type": "box"},
                "pixel_format": "rgb",
            },
        },
    }


def main():
    samples = int(sys.argv[2]) if len(sys.argv) > 2 else 512
    world = mi.load_dict(scene())
    render = lambda depth: np.array(
        mi.render(world, integrator=mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 64}), spp=samples)
    )
    indirect = np.maximum(render(24) - render(2), 0.0)
    blocks = indirect.reshape(HEIGHT // 8, 8, WIDTH // 8, 8, 3).mean(axis=(1, 3))
    mi.Bitmap(blocks.astype(np.float32)).write(sys.argv[1])
    print("mean indirect luminance, nits:", (blocks @ [0.2126, 0.7152, 0.0722]).mean())


if __name__ == "__main__":
    main()
