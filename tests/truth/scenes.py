"""The path tracer against Mitsuba 3, on scenes written as glTF for the one and built for the other.

    pip install mitsuba numpy
    cargo build --release --example viewer
    python3 tests/truth/scenes.py PATH/TO/viewer FOLDER [paths [scene..]]

Prints mean ratio and relative RMSE on 8x8-pixel means of the whole picture, and of it without the blocks
that see a lamp.
"""

import json
import pathlib
import struct
import subprocess
import sys

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")
from mitsuba import ScalarTransform4f as T

WIDTH, HEIGHT = 256, 144
# With this exposure a nit of emission is seen as a nit, which it is for Mitsuba anyway.
EV100 = -0.263034405833794


class Scene:
    """Boxes and quads with materials, lights, a camera."""

    def __init__(self, name, eye, look, fov, sky=0.0):
        self.name, self.eye, self.look, self.fov, self.sky = name, eye, look, fov, sky
        self.faces = []
        self.lights = []

    def box(self, low, high, material):
        low, high = np.array(low, float), np.array(high, float)
        for axis in range(3):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            for side in (0, 1):
                corner = low.copy()
                corner[axis] = (low, high)[side][axis]
                du, dv = np.zeros(3), np.zeros(3)
                du[u], dv[v] = (high - low)[u], (high - low)[v]
                quad = [corner, corner + du, corner + du + dv, corner + dv]
                self.faces.append((quad if side else quad[::-1], material))

    def room(self, low, high, wall, material):
        low, high = np.array(low, float), np.array(high, float)
        for axis in range(3):
            below, above = high + wall, low - wall
            below[axis], above[axis] = low[axis], high[axis]
            self.box(low - wall, below, material)
            self.box(above, high + wall, material)

    def quad(self, corners, material):
        self.faces.append(([np.array(c, float) for c in corners], material))

    def point(self, position, candela):
        self.lights.append(("point", position, candela))


def diffuse(r, g, b):
    return {"color": (r, g, b)}


def metal(r, g, b, roughness):
    return {"color": (r, g, b), "roughness": roughness}


def lamp(nits):
    return {"color": (0, 0, 0), "nits": nits}


def cornell(patch):
    s = Scene("cornell_patch" if patch else "cornell_point", (0, 2.74, 10.4), (0, 2.74, 0), 38.5)
    white = diffuse(0.73, 0.73, 0.73)
    w, h = 2.764, 5.488
    s.box((-w - 0.3, -0.3, -3.1), (w + 0.3, 0, 2.8), white)
    s.box((-w - 0.3, h, -3.1), (w + 0.3, h + 0.3, 2.8), white)
    s.box((-w - 0.3, 0, -3.1), (w + 0.3, h, -2.8), white)
    s.box((-w - 0.3, 0, -2.8), (-w, h, 2.8), diffuse(0.63, 0.065, 0.05))
    s.box((w, 0, -2.8), (w + 0.3, h, 2.8), diffuse(0.14, 0.45, 0.091))
    s.box((-1.8, 0, -1.6), (-0.1, 3.3, 0.1), white)
    s.box((0.1, 0, 0.3), (1.7, 1.65, 1.9), white)
    if patch:
        y = h - 0.01
        s.quad([(-0.65, y, -0.5), (0.65, y, -0.5), (0.65, y, 0.5), (-0.65, y, 0.5)], lamp(300.0))
    else:
        s.point((0, 4.9, 0), 800.0)
    return s


def two_rooms():
    s = Scene("two_rooms", (4.2, 1.6, -1.9), (-0.6, 1.1, 0.8), 60)
    white = diffuse(0.7, 0.68, 0.6)
    s.room((-5, 0, -2.6), (5, 2.8, 2.6), 0.3, white)
    s.box((-0.1, 0, -2.6), (0.1, 2.8, 0.3), white)
    s.box((-0.1, 0, 1.6), (0.1, 2.8, 2.6), white)
    s.box((-0.1, 2.1, 0.3), (0.1, 2.8, 1.6), white)
    s.box((1.6, 0, 1.0), (2.6, 0.8, 1.9), diffuse(0.6, 0.2, 0.1))
    s.point((-2.6, 2.3, 0.2), 450.0)
    return s


def sky_court():
    s = Scene("sky_court", (4.6, 1.7, 4.2), (-2.6, 1.5, -3.0), 60, sky=3000.0)
    stone = diffuse(0.6, 0.55, 0.45)
    s.box((-6, -0.4, -6), (6, 0, 6), diffuse(0.4, 0.38, 0.35))
    for low, high in [
        ((-6, 0, -6), (6, 4.2, -5.5)),
        ((-6, 0, 5.5), (6, 4.2, 6)),
        ((-6, 0, -5.5), (-5.5, 4.2, 5.5)),
        ((5.5, 0, -5.5), (6, 4.2, 5.5)),
        ((-5.5, 2.7, -5.5), (5.5, 3.0, -3.3)),
    ]:
        s.box(low, high, stone)
    for x in (-3.5, -1, 1.5, 4):
        s.box((x - 0.2, 0, -3.8), (x + 0.2, 2.7, -3.4), stone)
    s.box((0, 0, -1), (1.8, 0.5, -0.5), diffuse(0.55, 0.12, 0.08))
    return s


def glossy_floor():
    s = Scene("glossy_floor", (0.3, 1.5, 4.2), (0, 0.75, -1), 52)
    s.room((-3.5, 0, -3.5), (3.5, 3.2, 5), 0.3, diffuse(0.7, 0.68, 0.64))
    s.box((-3.5, 0, -3.5), (3.5, 0.06, 5), metal(0.5, 0.48, 0.45, 0.35))
    s.box((-3.5, 0.06, -3.5), (3.5, 3.2, -3.42), diffuse(0.55, 0.12, 0.08))
    s.box((1.0, 0.06, -1.8), (2.0, 1.5, -0.8), diffuse(0.1, 0.22, 0.55))
    s.box((-2.0, 0.06, -1.6), (-1.2, 2.2, -0.8), diffuse(0.8, 0.8, 0.78))
    s.point((0.6, 2.8, 1.0), 700.0)
    return s


def write_gltf(scene, path):
    """One mesh of two triangles a face; lights as KHR_lights_punctual, their light along -z."""
    data, views, accessors, materials, meshes, nodes = bytearray(), [], [], [], [], []

    def accessor(array, kind, component):
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        entry = {"bufferView": len(views) - 1, "componentType": component, "count": len(array), "type": kind}
        if kind == "VEC3":
            entry["min"], entry["max"] = array.min(0).tolist(), array.max(0).tolist()
        accessors.append(entry)
        data.extend(array.tobytes())
        data.extend(b"\0" * (-len(data) % 4))
        return len(accessors) - 1

    for quad, m in scene.faces:
        positions = np.array(quad, np.float32)
        normal = np.cross(positions[1] - positions[0], positions[2] - positions[0])
        normals = np.tile(normal / np.linalg.norm(normal), (4, 1)).astype(np.float32)
        is_metal = "roughness" in m
        material = {
            "pbrMetallicRoughness": {
                "baseColorFactor": [*m["color"], 1.0],
                "metallicFactor": 1.0 if is_metal else 0.0,
                # Without effect on diffuse faces: the path tracer is told to take Lambert's lobe.
                "roughnessFactor": m.get("roughness", 1.0),
            }
        }
        if not is_metal:
            material["extensions"] = {"KHR_materials_specular": {"specularFactor": 0.0}}
        if "nits" in m:
            material["emissiveFactor"] = [1.0, 1.0, 1.0]
            material["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": m["nits"]}
        materials.append(material)
        attributes = {"POSITION": accessor(positions, "VEC3", 5126), "NORMAL": accessor(normals, "VEC3", 5126)}
        indices = accessor(np.array([0, 1, 2, 0, 2, 3], np.uint16), "SCALAR", 5123)
        primitive = {"attributes": attributes, "indices": indices, "material": len(materials) - 1}
        meshes.append({"primitives": [primitive]})
        nodes.append({"mesh": len(meshes) - 1})
    lights = []
    for kind, position, candela in scene.lights:
        lights.append({"type": kind, "intensity": candela, "color": [1, 1, 1]})
        light = {"KHR_lights_punctual": {"light": len(lights) - 1}}
        nodes.append({"translation": position, "extensions": light})
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_specular", "KHR_materials_emissive_strength"],
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    if lights:
        document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)


def to_mitsuba(scene, folder):
    world = {"type": "scene"}
    for i, (quad, m) in enumerate(scene.faces):
        mesh = mi.Mesh(f"face{i}", vertex_count=4, face_count=2)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = np.array(quad, np.float32).ravel()
        parameters["faces"] = np.array([0, 1, 2, 0, 2, 3], np.uint32)
        parameters.update()
        path = folder / f"{scene.name}_{i}.ply"
        mesh.write_ply(str(path))
        color = {"type": "rgb", "value": list(m["color"])}
        if "roughness" in m:
            bsdf = {"type": "principled", "base_color": color, "metallic": 1.0, "roughness": m["roughness"]}
        else:
            bsdf = {"type": "diffuse", "reflectance": color}
        shape = {"type": "ply", "filename": str(path), "face_normals": True, "bsdf": bsdf}
        if "nits" in m:
            shape["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": m["nits"]}}
        world[f"face{i}"] = shape
    for i, (kind, position, candela) in enumerate(scene.lights):
        intensity = {"type": "rgb", "value": candela}
        world[f"light{i}"] = {"type": kind, "position": list(position), "intensity": intensity}
    if scene.sky:
        world["sky"] = {"type": "constant", "radiance": {"type": "rgb", "value": scene.sky}}
    world["camera"] = {
        "type": "perspective",
        "fov": scene.fov,
        "fov_axis": "y",
        "near_clip": 0.05,
        "to_world": T().look_at(origin=list(scene.eye), target=list(scene.look), up=[0, 1, 0]),
        "film": {
            "type": "hdrfilm",
            "width": WIDTH,
            "height": HEIGHT,
            "rfilter": {"type": "box"},
            "pixel_format": "rgb",
        },
    }
    return mi.load_dict(world)


def blocks(picture):
    return picture.reshape(HEIGHT // 8, 8, WIDTH // 8, 8, 3).mean(axis=(1, 3))


def main():
    viewer, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    paths = int(sys.argv[3]) if len(sys.argv) > 3 else 1024
    folder.mkdir(parents=True, exist_ok=True)
    for scene in [cornell(False), cornell(True), two_rooms(), sky_court(), glossy_floor()]:
        if len(sys.argv) > 4 and scene.name not in sys.argv[4:]:
            continue
        gltf, exr = folder / f"{scene.name}.glb", folder / f"{scene.name}.exr"
        write_gltf(scene, gltf)
        command = [viewer, gltf, "--headless", "--technique", "reference", "--frames", str(paths)]
        command += ["--size", f"{WIDTH}x{HEIGHT}", "--fov", str(scene.fov), "--ev100", str(EV100)]
        command += ["--eye", ",".join(map(str, scene.eye)), "--look", ",".join(map(str, scene.look))]
        command += ["--set", "ReferenceSettings.diffuse=Lambert", "--set", "GiSettings.emissive_units=Nits"]
        command += ["--set", "ReferenceSettings.specular=SingleScattering"]
        if scene.sky:
            command += ["--sky", str(scene.sky)]
        subprocess.run([*map(str, command), "--out", str(exr)], check=True, stdout=subprocess.DEVNULL)
        ours = blocks(np.array(mi.Bitmap(str(exr)))[:, :, :3].astype(float))
        integrator = mi.load_dict({"type": "path", "max_depth": 66, "rr_depth": 5})
        halves = []
        for seed in (1, 2):
            picture = mi.render(to_mitsuba(scene, folder), integrator=integrator, spp=paths // 2, seed=seed)
            halves.append(blocks(np.array(picture).astype(float)))
        theirs = (halves[0] + halves[1]) / 2
        noise = np.sqrt(((halves[0] - theirs) ** 2).mean()) / theirs.mean()
        # A block that is brighter than 30 times the mean sees a lamp, whose edge decides about its mean.
        lit = theirs.mean(axis=2) < 30 * theirs.mean()
        for what, mask in [("all", np.ones_like(lit)), ("without lamps", lit)]:
            a, b = ours[mask], theirs[mask]
            ratio, rmse = a.mean() / b.mean(), np.sqrt(((a - b) ** 2).mean()) / b.mean()
            print(f"{scene.name:14} {what:14} mean {ratio:.4f}  relative RMSE {rmse:.4f}  noise {noise:.4f}", flush=True)


if __name__ == "__main__":
    main()
