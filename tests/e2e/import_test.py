"""`shade import`: what files of other programs hold stands in the scene, and hostile ones harm nobody."""

import base64
import hashlib
import io
import json
import math
import os
import random
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from PIL import Image

SHADE = Path(os.environ["SHADED_BUILD"]) / "shade"
SANITIZED = bool(os.environ.get("SHADED_SANITIZE"))
SQUARE = [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0]

MTL = """
newmtl red
Ka 0.1 0.2 0.3
Kd 0.8 0.1 0.05
Ks 0.5 0.25 0.125
Ke 0.01 0.02 0.03
Ns 40
d 0.5
illum 2
map_Kd wood.png
newmtl glow
Kd 0.2 0.3 0.4
illum 0
newmtl matt
Kd 0.2 0.3 0.4
Ks 1 1 1
illum 1
newmtl mirror
Kd 0 0 0
Ks 0.75 0.75 0.75
Ns 10
illum 3
newmtl glass
Kd 0 0 0
Ks 0.25 0.25 0.25
Tf 1 0.5 0.5
Ni 1.25
Ns 10
illum 7
"""
OBJ = "mtllib model.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n" + "".join(
    f"o {name}\nusemtl {name}\nf 1//1 2//1 3//1 4//1\n" for name in ("red", "glow", "matt", "mirror", "glass"))


def gltf(**more):
    """A square of two materials under two nodes, cameras and lights; its buffer apart."""
    data = struct.pack("<12f12f6H", *SQUARE, *[0, 0, 1] * 4, 0, 1, 2, 0, 2, 3)
    views = [(0, 48), (48, 48), (96, 12)]
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_unlit"],
        "extensions": {"KHR_lights_punctual": {"lights": [
            {"type": "point", "color": [1, 0.5, 0.25], "intensity": 20},
            {"type": "spot", "intensity": 5, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.5}},
            {"type": "directional", "intensity": 3}]}},
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 1.5, "znear": 0.1}},
                    {"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1, "znear": 0.1, "zfar": 9}}],
        "nodes": [{"name": "root", "children": [1, 2, 3, 4, 5, 6], "translation": [0, 0, 1]},
                  {"name": "large", "mesh": 0, "scale": [2, 2, 2]},
                  {"name": "turned", "mesh": 0, "rotation": [0, 0, math.sqrt(0.5), math.sqrt(0.5)]},
                  {"name": "eye", "camera": 0, "translation": [0.5, 0.5, 5]},
                  {"translation": [1, 2, 3], "extensions": {"KHR_lights_punctual": {"light": 0}}},
                  {"extensions": {"KHR_lights_punctual": {"light": 1}}},
                  {"rotation": [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)],
                   "extensions": {"KHR_lights_punctual": {"light": 2}}}],
        "meshes": [{"name": "plate", "primitives": [
            {"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2, "material": 0},
            {"attributes": {"POSITION": 0}, "indices": 2, "material": 1}]}],
        "materials": [{"name": "gold", "emissiveFactor": [0.125, 0, 0], "pbrMetallicRoughness": {
                          "baseColorFactor": [1, 0.75, 0.25, 1], "metallicFactor": 1, "roughnessFactor": 0.4}},
                      {"name": "paper", "alphaMode": "BLEND", "extensions": {"KHR_materials_unlit": {}},
                       "pbrMetallicRoughness": {"baseColorFactor": [0.25, 0.5, 1, 0.5]}}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]},
                      {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3"},
                      {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": length} for at, length in views],
        "buffers": [{"byteLength": len(data)}], **more}
    return document, data


def embedded(**more):
    document, data = gltf(**more)
    document["buffers"][0]["uri"] = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(document).encode()


def glb(**more):
    document, data = gltf(**more)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += b"\0" * (-len(data) % 4)
    body = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def picture(*rows, kind="PNG"):
    """The file of a picture, upper row first."""
    out = io.BytesIO()
    Image.fromarray(np.array(rows, np.uint8)).save(out, kind)
    return out.getvalue()


LEFT_RED = picture([[255, 0, 0], [0, 0, 255]], [[0, 255, 0], [255, 255, 255]])
HALF_METAL = picture([[0, 128, 255], [0, 128, 0]])


def textured(material=None, images=(LEFT_RED, HALF_METAL), samplers=None, uvs=(0, 1, 1, 1, 1, 0, 0, 0), **more):
    """A square whose material has pictures, upright as one looks at it from +z."""
    data = struct.pack("<12f8f6H2x", *SQUARE, *uvs, 0, 1, 2, 0, 2, 3)
    views = [(0, 48), (48, 32), (80, 12)]
    for image in images:
        views.append((len(data), len(image)))
        data += image + b"\0" * (-len(image) % 4)
    usual = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}
    return json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"name": "plate", "primitives": [
            {"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
        "materials": [material or usual],
        "textures": [{"source": i, **({"sampler": 0} if samplers else {})} for i in range(len(images))],
        "images": [{"bufferView": 3 + i, "mimeType": "image/png", "name": f"picture-{i}"} for i in range(len(images))],
        **({"samplers": samplers} if samplers else {}),
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]},
                      {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
                      {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": length} for at, length in views],
        "buffers": [{"byteLength": len(data),
                     "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}], **more})


PLY = (b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
       b"property float z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n" +
       struct.pack("<12f", *SQUARE) + struct.pack("<B3iB3i", 3, 0, 1, 2, 3, 0, 2, 3))
STL = b"\0" * 80 + struct.pack("<I", 1) + struct.pack("<12fH", 0, 0, 1, *SQUARE[:9], 0)


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def shade(self, *words):
        return subprocess.run([SHADE, *map(str, words)], capture_output=True, text=True, timeout=600,
                              cwd=self.folder, check=False)

    def load(self, name, data, *words):
        """The scene of a file, which `shade check` has nothing against, and what was said."""
        (self.folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
        done = self.shade("import", name, "-o", "scene.json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        text = (self.folder / "scene.json").read_text()
        return json.loads(text), done.stderr

    def refuse(self, name, data, *words, status=1):
        if data is not None:
            (self.folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
        done = self.shade("import", name, "-o", "scene.json", *words)
        self.assertEqual(done.returncode, status, done.stderr)
        self.assertFalse((self.folder / "scene.json").exists())
        return done.stderr


class Import(Case):
    def test_obj_and_mtl_are_taken_one_to_one(self):
        (self.folder / "model.mtl").write_text(MTL)
        scene, said = self.load("model.obj", OBJ)
        self.assertIn('its diffuse color is left out, because it cannot be read: wood.png', said)
        self.assertNotIn("deltaE", said)
        self.assertNotIn("lights", scene)  # the headlight, which is the default
        self.assertEqual(scene["trace"], {"depth": 8})
        self.assertEqual(scene["materials"], {
            "red": {"model": "blinn-phong", "diffuse": [0.8, 0.1, 0.05], "ambient": [0.1, 0.2, 0.3],
                    "emissive": [0.01, 0.02, 0.03], "specular": [0.5, 0.25, 0.125], "shininess": 40, "opacity": 0.5},
            "glow": {"model": "phong", "diffuse": [0, 0, 0], "ambient": [0, 0, 0], "emissive": [0.2, 0.3, 0.4]},
            "matt": {"model": "phong", "diffuse": [0.2, 0.3, 0.4], "ambient": [0, 0, 0]},
            "mirror": {"model": "blinn-phong", "diffuse": [0, 0, 0], "ambient": [0, 0, 0],
                       "specular": [0.75] * 3, "shininess": 10, "reflection": [0.75] * 3},
            "glass": {"model": "blinn-phong", "diffuse": [0, 0, 0], "ambient": [0, 0, 0], "specular": [0.25] * 3,
                      "shininess": 10, "reflection": [0.25] * 3, "transmission": [0.75, 0.375, 0.375], "ior": 1.25}})
        self.assertEqual([one["material"] for one in scene["objects"]], list(scene["materials"]))
        self.assertEqual(scene["meshes"]["red"]["positions"], SQUARE)
        self.assertEqual(scene["meshes"]["red"]["normals"], [0, 0, 1] * 4)
        self.assertEqual(scene["meshes"]["red"]["indices"], [0, 1, 2, 0, 2, 3])
        self.assertEqual(self.shade("check", "scene.json").returncode, 0)
        scene, said = self.load("model.obj", OBJ, "--phong")
        self.assertEqual({m["model"] for m in scene["materials"].values()}, {"phong"})
        self.assertIn("by Phong: deltaE2000", said)

    def test_the_default_camera_frames_all(self):
        self.load("model.obj", "v 10 10 10\nv 12 10 10\nv 12 13 10\nv 10 10 14\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n")
        self.assertEqual(self.shade("render", "scene.json", "-o", "out.png").returncode, 0)
        with Image.open(self.folder / "out.png") as image:
            seen = np.asarray(image.convert("L")) > 0
        rows, columns = np.nonzero(seen)
        margins = [rows.min(), 511 - rows.max(), columns.min(), 511 - columns.max()]
        self.assertGreater(min(margins), 0)
        self.assertLess(min(margins), 100)

    def check_gltf(self, name, data):
        scene, said = self.load(name, data)
        self.assertIn("deltaE2000", said)
        self.assertEqual(list(scene["meshes"]), ["plate-0", "plate-1"])
        self.assertEqual(scene["meshes"]["plate-0"], {"positions": SQUARE, "normals": [0, 0, 1] * 4,
                                                      "indices": [0, 1, 2, 0, 2, 3]})
        self.assertNotIn("normals", scene["meshes"]["plate-1"])
        objects = scene["objects"]
        self.assertEqual([(one["name"], one["mesh"], one["material"]) for one in objects],
                         [("large", "plate-0", "gold"), ("large", "plate-1", "paper"),
                          ("turned", "plate-0", "gold"), ("turned", "plate-1", "paper")])
        self.assertEqual(objects[0]["transform"]["matrix"], [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 1, 1])
        np.testing.assert_allclose(objects[2]["transform"]["matrix"],
                                   [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1], atol=1e-6)
        camera = scene["camera"]
        self.assertEqual((camera["type"], camera["position"], camera["target"], camera["up"]),
                         ("perspective", [0.5, 0.5, 6], [0.5, 0.5, 5], [0, 1, 0]))
        self.assertAlmostEqual(camera["fov"], math.degrees(0.7), 4)
        self.assertEqual(scene["image"], {"width": 512, "height": 341})
        point, spot, sun = scene["lights"]
        self.assertEqual((point["type"], point["color"], point["position"], point["attenuation"]),
                         ("point", [1, 0.5, 0.25], [1, 2, 4], [0, 0, 1]))
        self.assertAlmostEqual(point["intensity"], 20 / math.pi, 5)
        self.assertEqual((spot["type"], spot["direction"], spot["position"]), ("spot", [0, 0, -1], [0, 0, 1]))
        self.assertAlmostEqual(spot["angle"], math.degrees(0.5), 4)
        self.assertAlmostEqual(spot["penumbra"], 0.6, 5)
        np.testing.assert_allclose(sun["direction"], [0, -1, 0], atol=1e-6)
        gold, paper = scene["materials"]["gold"], scene["materials"]["paper"]
        self.assertEqual((gold["model"], gold["fresnel"], gold["emissive"]),
                         ("cook-torrance", {"f0": [1, 0.75, 0.25]}, [0.125, 0, 0]))
        self.assertEqual(paper, {"model": "phong", "diffuse": [0, 0, 0], "ambient": [0, 0, 0],
                                 "emissive": [0.25, 0.5, 1], "opacity": 0.5})
        self.assertEqual(self.shade("check", "scene.json").returncode, 0)

    def test_gltf_with_its_transforms_cameras_and_lights(self):
        self.check_gltf("model.gltf", embedded())

    def test_glb(self):
        self.check_gltf("model.glb", glb())

    def test_gltf_says_more_than_assimp_tells(self):
        strong = {"name": "lamp", "emissiveFactor": [0.5, 0.25, 1],
                  "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 8}}}
        lights = [{"type": "point", "range": 3}, {"type": "spot", "spot": {}}, {"type": "directional"}]
        more = {"extensions": {"KHR_lights_punctual": {"lights": lights}}, "extensionsUsed": ["KHR_lights_punctual"]}
        for name, make in ("model.gltf", embedded), ("model.glb", glb):
            scene, said = self.load(name, make(materials=[strong, {"name": "dark"}], **more))
            self.assertEqual(scene["materials"]["lamp"]["emissive"], [4, 2, 8])
            self.assertNotIn("emissive", scene["materials"]["dark"])
            self.assertIn("range of 1 lights", said)
        scene, said = self.load("model.glb", glb(materials=[strong, {**strong, "extensions": {}}]))
        self.assertIn("emissiveStrength is left out", said)
        self.assertEqual(scene["materials"]["lamp"]["emissive"], [0.5, 0.25, 1])

    def test_gltf_names_its_buffer_beside_it(self):
        document, data = gltf()
        (self.folder / "b.bin").write_bytes(data)
        document["buffers"][0]["uri"] = "b.bin"
        scene, _ = self.load("model.gltf", json.dumps(document))
        self.assertEqual(scene["meshes"]["plate-0"]["positions"], SQUARE)

    def test_ply_and_stl(self):
        scene, _ = self.load("model.ply", PLY)
        self.assertEqual([one["positions"] for one in scene["meshes"].values()], [SQUARE])
        self.assertEqual([one["indices"] for one in scene["meshes"].values()], [[0, 1, 2, 0, 2, 3]])
        scene, _ = self.load("model.STL", STL)
        self.assertEqual([one["positions"] for one in scene["meshes"].values()], [SQUARE[:9]])
        self.assertEqual(self.shade("check", "scene.json").returncode, 0)

    def test_meshes_go_to_a_folder_by_their_digest(self):
        scene, said = self.load("model.glb", glb(), "--meshes", "meshes")
        self.assertIn("curl -fT", said)
        names = {one["data"].removeprefix("sha256-") for one in scene["meshes"].values()}
        self.assertEqual(names, {path.name for path in (self.folder / "meshes").iterdir()})
        for name in names:
            data = (self.folder / "meshes" / name).read_bytes()
            self.assertEqual(hashlib.sha256(data).hexdigest(), name)
        first = (self.folder / "meshes" / scene["meshes"]["plate-0"]["data"][7:]).read_bytes()
        self.assertEqual(first, struct.pack("<3I24f6I", 4, 6, 1, *SQUARE, *[0, 0, 1] * 4, 0, 1, 2, 0, 2, 3))

    def test_uvs_stand_upright(self):
        flat = "mtllib model.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0.25\nvt 1 0\nvt 1 0.75\nusemtl matt\nf 1/1 2/2 3/3\n"
        (self.folder / "model.mtl").write_text(MTL)
        scene, _ = self.load("model.obj", flat)
        self.assertEqual([one["uvs"] for one in scene["meshes"].values()], [[0, 0.25, 1, 0, 1, 0.75]])
        scene, _ = self.load("model.gltf", textured())  # whose v grows downward
        self.assertEqual(scene["meshes"]["plate"]["uvs"], [0, 0, 1, 0, 1, 1, 0, 1])
        scene, _ = self.load("model.gltf", textured(), "--meshes", "meshes")
        kept = (self.folder / "meshes" / scene["meshes"]["plate"]["data"][7:]).read_bytes()
        self.assertEqual(kept, struct.pack("<3I20f6I", 4, 6, 2, *SQUARE, 0, 0, 1, 0, 1, 1, 0, 1, 0, 1, 2, 0, 2, 3))
        scene, _ = self.load("model.gltf", textured(uvs=[0, math.nan] * 4))
        self.assertNotIn("uvs", scene["meshes"]["plate"])

    def test_names_are_made_fit_and_apart(self):
        materials = [{"name": name} for name in ("a#1", "a_1", "b" * 100, "b" * 99, "c\"\\\u0007é", "")]
        primitives = [{"attributes": {"POSITION": 0}, "indices": 2, "material": i} for i in range(len(materials))]
        scene, _ = self.load("model.glb", glb(materials=materials, meshes=[{"primitives": primitives}]))
        self.assertEqual(list(scene["materials"])[:2], ["a_1", "a_1#1"])
        self.assertEqual(len(scene["materials"]), 6)
        self.assertIn("c\"\\_é", scene["materials"])
        self.assertEqual(self.shade("check", "scene.json").returncode, 0)

    def test_usage(self):
        for words in (["model.fbx", "-o", "x.json"], ["model.obj"], ["-o", "x.json"], ["a.obj", "b.obj", "-o", "x"]):
            self.assertEqual(self.shade("import", *words).returncode, 2)
        self.assertEqual(self.shade("render", "--phong", "x.json", "-o", "x.png").returncode, 2)
        self.assertEqual(self.shade("import", "none.obj", "-o", "x.json").returncode, 1)


def srgb_to_linear(code):
    return code / 255 / 12.92 if code < 11 else ((code / 255 + 0.055) / 1.055) ** 2.4


class Textures(Case):
    def test_without_a_folder_means_stand_in(self):
        scene, said = self.load("model.gltf", textured())
        self.assertIn("no --assets FOLDER for it: picture-0", said)
        mean = scene["materials"]["wood"]["ambient"]
        np.testing.assert_allclose(mean, [0.5, 0.5, 0.5], atol=1e-6)
        grey = picture([[100, 100, 100], [200, 200, 200]], kind="JPEG")
        material = {"name": "wood", "emissiveFactor": [1, 0.5, 0], "emissiveTexture": {"index": 0},
                    "pbrMetallicRoughness": {"metallicRoughnessTexture": {"index": 1}, "roughnessFactor": 0.5}}
        scene, said = self.load("model.gltf", textured(material, images=[grey, HALF_METAL]))
        self.assertIn("but for what they are in the mean: 0.50 and 0.25: picture-1", said)
        light = (srgb_to_linear(100) + srgb_to_linear(200)) / 2
        np.testing.assert_allclose(scene["materials"]["wood"]["emissive"], [light, light / 2, 0], atol=2e-2)
        self.assertEqual(scene["materials"]["wood"]["fresnel"]["f0"], [0.52] * 3)
        self.assertEqual(self.shade("check", "scene.json").returncode, 0)

    def test_black_is_a_color(self):
        red, black = picture([[255, 0, 0]] * 2), picture([[0, 0, 0]] * 2)
        dull = {"name": "wood", "emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": 1},
                "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0}}
        scene, _ = self.load("model.gltf", textured(dull, images=[red, black]))
        self.assertEqual(scene["materials"]["wood"]["ambient"], [1, 0, 0])
        self.assertEqual(scene["materials"]["wood"].get("emissive", 0), 0)
        metal = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
        scene, _ = self.load("model.gltf", textured(metal, images=[red, black]), "--assets", "assets")
        self.assertEqual(scene["materials"]["wood"]["fresnel"]["f0"]["tint"], [1, 1, 1])

    def kept(self, coefficient):
        """What a coefficient's picture is in the folder."""
        return (self.folder / "assets" / f"{coefficient['texture'].removeprefix('sha256-')}.png").read_bytes()

    def test_gltf_pictures_are_named_by_their_digest(self):
        scene, said = self.load("model.gltf", textured(), "--assets", "assets")
        self.assertIn("/v1/assets/", said)
        self.assertNotIn("left out", said)
        wood = scene["materials"]["wood"]
        self.assertEqual(wood["ambient"], {"texture": "sha256-" + hashlib.sha256(LEFT_RED).hexdigest(),
                                           "space": "sRGB", "tint": [1, 1, 1], "uv": {"wrap": "repeat"}})
        self.assertEqual({**wood["diffuse"], "tint": [1, 1, 1]}, wood["ambient"])
        self.assertTrue(0.9 < min(wood["diffuse"]["tint"]) <= max(wood["diffuse"]["tint"]) < 1)
        self.assertEqual(self.kept(wood["diffuse"]), LEFT_RED)
        material = {"name": "gold", "pbrMetallicRoughness": {"baseColorFactor": [1, 0.5, 0.25, 1],
                                                             "baseColorTexture": {"index": 0}, "roughnessFactor": 0.4}}
        scene, _ = self.load("model.gltf", textured(material), "--assets", "assets", "--phong")
        gold = scene["materials"]["gold"]
        for lobe in (gold, *gold["lobes"]):
            red, green, blue = lobe["specular"]["tint"]
            np.testing.assert_allclose([green / red, blue / red], [0.5, 0.25], rtol=1e-6)
        scene, said = self.load("model.gltf", textured(material), "--assets", "assets")
        self.assertNotIn("left out", said)
        self.assertEqual(scene["materials"]["gold"]["fresnel"]["f0"], {**wood["ambient"], "tint": [1, 0.5, 0.25]})
        self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").returncode, 0)
        scene, _ = self.load("model.gltf", textured(material))
        self.assertEqual(scene["materials"]["gold"]["fresnel"]["f0"], [0.5, 0.25, 0.125])

    def metal(self, images=(HALF_METAL,), words=("--assets", "assets"), wanted=None, **more):
        """A material whose picture of metal is the last of these, and what was said."""
        wood = {"name": "wood", "pbrMetallicRoughness": {
            "baseColorFactor": [0.8, 0.4, 0.2, 1], "metallicRoughnessTexture": {"index": len(images) - 1, **(wanted or {})},
            **({"baseColorTexture": {"index": 0}} if len(images) > 1 else {}), **more}}
        scene, said = self.load("model.gltf", textured(wood, images=images, extensionsUsed=["KHR_texture_transform"]), *words)
        return scene["materials"]["wood"], said

    def texels(self, coefficient):
        with Image.open(io.BytesIO(self.kept(coefficient))) as image:
            codes = np.asarray(image.convert("RGB"), float)
        return np.vectorize(srgb_to_linear)(codes)

    def test_metal_and_what_is_none_are_on_one_picture(self):
        split, said = self.metal()
        self.assertIn("its roughness is left out but for its mean, 0.50: picture-0", said)
        self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").stderr, "")
        f0, diffuse = self.texels(split["fresnel"]["f0"]), self.texels(split["diffuse"])
        for x, metallic in enumerate((1, 0)):
            rough = {"metallicRoughnessTexture": {"index": 0}, "roughnessFactor": 128 / 255}
            plain = {"name": "wood", "pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.4, 0.2, 1],
                                                              "metallicFactor": metallic, **rough}}
            del plain["pbrMetallicRoughness"]["metallicRoughnessTexture"]
            scene, _ = self.load("model.gltf", textured(plain, images=[]))
            wood = scene["materials"]["wood"]
            self.assertEqual(wood["lobes"], split["lobes"])
            np.testing.assert_allclose(f0[0, x], wood["fresnel"]["f0"], atol=0.005)
            np.testing.assert_allclose(diffuse[0, x], wood["diffuse"], atol=0.005)
        # Four texels of two pictures, whose factors count.
        quarter = picture([[0, 128, 128], [0, 128, 255]])
        split, _ = self.metal((LEFT_RED, quarter), metallicFactor=0.5)
        f0 = self.texels(split["fresnel"]["f0"])
        for y, x, base, metallic in ((0, 0, [0.8, 0, 0], 64 / 255), (0, 1, [0, 0, 0.2], 0.5), (1, 1, [0.8, 0.4, 0.2], 0.5)):
            np.testing.assert_allclose(f0[y, x], 0.04 + (np.array(base) - 0.04) * metallic, atol=0.005)
        self.assertEqual(self.kept(split["ambient"]), LEFT_RED)

    def test_dark_colors_are_no_darker_than_theirs(self):
        black_white = picture([[10, 10, 10]] * 15 + [[255, 255, 255]])
        wood, _ = self.metal((black_white, HALF_METAL), metallicFactor=0)
        # What a surface of 0.04 leaves of light, whatever the mean of the picture.
        np.testing.assert_allclose(wood["diffuse"]["tint"], [0.955 * c for c in (0.8, 0.4, 0.2)], rtol=2e-3)
        self.assertEqual((self.kept(wood["diffuse"]), wood["fresnel"]["f0"]), (black_white, [0.04] * 3))
        # Half metal everywhere, by a factor or a picture that is the same everywhere.
        half = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, "metallicFactor": 0.5}}
        scene, said = self.load("model.gltf", textured(half, images=[black_white]), "--assets", "assets")
        self.assertNotIn("left out", said)
        self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").stderr, "")
        by_map, _ = self.metal((black_white, picture([[0, 255, 255]])), metallicFactor=0.5, baseColorFactor=[1] * 4)
        self.assertEqual(by_map, scene["materials"]["wood"])
        f0, diffuse = self.texels(by_map["fresnel"]["f0"]), self.texels(by_map["diffuse"])
        for x, code in (0, 10), (15, 255):
            base = [srgb_to_linear(code)] * 3 + [1]
            even = {"name": "wood", "pbrMetallicRoughness": {"baseColorFactor": base, "metallicFactor": 0.5}}
            wood = self.load("model.gltf", textured(even, images=[]))[0]["materials"]["wood"]
            np.testing.assert_allclose(f0[0, x], wood["fresnel"]["f0"], rtol=0.02)
            np.testing.assert_allclose(diffuse[0, x], wood["diffuse"], rtol=0.03)

    def test_metal_that_makes_no_picture_is_its_mean(self):
        even = picture([[0, 128, 255], [0, 10, 255]])
        moved = {"extensions": {"KHR_texture_transform": {"scale": [2, 2]}}}
        for images, words, more in (((HALF_METAL,), (), {}), ((HALF_METAL,), ("--assets", "assets", "--phong"), {}),
                                    ((even,), ("--assets", "assets"), {}), ((HALF_METAL,), ("--assets", "assets"), {"metallicFactor": 0}),
                                    ((LEFT_RED, HALF_METAL), ("--assets", "assets"), {"wanted": moved})):
            split, said = self.metal(images, words, **more)
            self.assertIn("but for what they are in the mean", said)
            f0 = split.get("fresnel", {}).get("f0")
            self.assertNotIn("beneath", json.dumps(split))
            self.assertTrue(f0 is None or isinstance(f0, list) or self.kept(f0) == LEFT_RED, (images, f0))

    def test_a_picture_of_metal_is_split_eight_times(self):
        woods = [{"name": f"wood-{i}", "pbrMetallicRoughness": {
            "metallicRoughnessTexture": {"index": 0}, "metallicFactor": 0.1 + 0.05 * i}} for i in range(10)]
        plates = [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": i}]}
                  for i in range(10)]
        scene, _ = self.load("model.gltf", textured(
            images=[HALF_METAL], materials=woods, meshes=plates, nodes=[{"mesh": i} for i in range(10)],
            scenes=[{"nodes": list(range(10))}]), "--assets", "assets")
        made = [isinstance(scene["materials"][f"wood-{i}"]["fresnel"]["f0"], dict) for i in range(10)]
        self.assertEqual(made, [True] * 8 + [False] * 2)

    def test_pictures_are_seen_upright(self):
        material = {"name": "wood", "extensions": {"KHR_materials_unlit": {}}, "emissiveTexture": {"index": 1},
                    "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
        scene, _ = self.load("model.gltf", textured(material, samplers=[{"wrapS": 33071, "wrapT": 33071}]),
                             "--assets", "assets")
        scene["camera"] = {"type": "orthographic", "position": [0.5, 0.5, 4], "target": [0.5, 0.5, 0], "height": 1}
        scene["image"] = {"width": 8, "height": 8, "samples": 1}
        (self.folder / "scene.json").write_text(json.dumps(scene))
        done = self.shade("render", "scene.json", "-o", "out.png", "--assets", "assets")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        with Image.open(self.folder / "out.png") as image:
            seen = np.asarray(image.convert("RGB"))
        self.assertEqual(seen[::7, ::7].tolist(), [[[255, 0, 0], [0, 0, 255]], [[0, 255, 0], [255, 255, 255]]])

    def test_gltf_places_pictures(self):
        offset, turn, scale = [0.1, 0.2], 0.3, [2, 3]
        info = {"index": 0, "extensions": {"KHR_texture_transform": {"offset": offset, "rotation": turn, "scale": scale}}}
        material = {"name": "wood", "emissiveFactor": [1, 0.5, 0.25], "emissiveTexture": info}
        scene, _ = self.load("model.gltf", textured(material, samplers=[{"wrapS": 33648, "wrapT": 33648}],
                                                    extensionsUsed=["KHR_texture_transform"]), "--assets", "assets")
        glow = scene["materials"]["wood"]["emissive"]
        self.assertEqual((glow["tint"], glow["uv"]["wrap"]), ([1, 0.5, 0.25], "mirror"))
        ours, c, s = glow["uv"], math.cos(turn), math.sin(turn)
        turned, dx, dy = math.radians(ours["rotate"]), *ours["offset"]
        for u, v in ((0, 0), (1, 0), (0, 1), (0.3, 0.8)):
            p, q = u * scale[0], (1 - v) * scale[1]  # downward, as there: counterclockwise from u is up
            wanted = (p * c + q * s + offset[0], 1 - (-p * s + q * c + offset[1]))
            a, b = u * ours["scale"][0], v * ours["scale"][1]
            got = (a * math.cos(turned) - b * math.sin(turned) + dx, a * math.sin(turned) + b * math.cos(turned) + dy)
            np.testing.assert_allclose(got, wanted, atol=1e-6)

    def test_what_cannot_be_taken_is_told(self):
        info = {"index": 0, "texCoord": 1}
        for words, data in (
                ("in one way across", textured(samplers=[{"wrapS": 33648, "wrapT": 33071}])),
                ("other coordinates", textured({"name": "wood", "emissiveFactor": [1, 1, 1], "emissiveTexture": info})),
                ("no coordinates", textured(uvs=[math.nan] * 8)),
                ("damaged or too large", textured(images=[LEFT_RED[:-20]])),
                ("no format that is read here", textured(images=[b"GIF89a" + bytes(100)])),
                ("picture of its normals is left out, because it follows other coordinates",
                 textured({"name": "wood", "normalTexture": info}))):
            scene, said = self.load("model.gltf", data, "--assets", "assets")
            self.assertIn(words, said)
            self.assertNotIn("texture", json.dumps(scene["materials"]))
            self.assertEqual(list((self.folder / "assets").iterdir()), [])
            self.assertEqual(self.shade("check", "scene.json").returncode, 0)

    def seen(self, scene, light):
        """Codes of the middle of the square under a directional light, linear."""
        scene.update(lights=[{"type": "directional", "direction": light}], image={"width": 4, "height": 4, "samples": 1},
                     camera={"type": "orthographic", "position": [0.5, 0.5, 4], "target": [0.5, 0.5, 0], "height": 1},
                     output={"format": "png", "colorSpace": "lin_rec709"})
        (self.folder / "lit.json").write_text(json.dumps(scene))
        done = self.shade("render", "lit.json", "-o", "out.png", "--assets", "assets")
        self.assertEqual(done.returncode, 0, done.stderr)
        with Image.open(self.folder / "out.png") as image:
            return np.asarray(image.convert("RGB"), int)[2, 2].tolist()

    def test_normals_of_gltf_turn_the_surface(self):
        for code, lit, dark in (([218, 128, 218], [-1, 0, -1], [1, 0, -1]), ([128, 218, 218], [0, -1, -1], [0, 1, -1])):
            file = picture([code] * 2)
            material = {"name": "wood", "normalTexture": {"index": 0},
                        "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}
            scene, said = self.load("model.gltf", textured(material, images=[file]), "--assets", "assets")
            self.assertNotIn("left out", said)
            wood = scene["materials"]["wood"]
            self.assertEqual(wood["normal"], {"texture": "sha256-" + hashlib.sha256(file).hexdigest(),
                                              "uv": {"wrap": "repeat"}})
            self.assertEqual(self.kept(wood["normal"]), file)
            wood.update(diffuse=0.5, fresnel={"f0": 0})
            np.testing.assert_allclose(self.seen(scene, lit), 128, atol=1)
            self.assertLess(max(self.seen(scene, dark)), 3)
            wood["normal"]["scale"] = -1
            np.testing.assert_allclose(self.seen(scene, dark), 128, atol=1)

    def test_normals_have_a_scale_and_a_place(self):
        info = {"index": 0, "scale": -0.75, "extensions": {"KHR_texture_transform": {"scale": [2, 3]}}}
        for more in {}, {"extensions": {"KHR_materials_unlit": {}}}:
            scene, said = self.load("model.gltf", textured(
                {"name": "wood", "normalTexture": info, **more}, extensionsUsed=["KHR_texture_transform"],
                samplers=[{"wrapS": 33071, "wrapT": 33071}]), "--assets", "assets")
            normal = scene["materials"]["wood"].get("normal")
            if more:
                self.assertIn("its normals is left out, because no light changes its color", said)
                self.assertIsNone(normal)
                continue
            self.assertNotIn("left out", said)
            self.assertEqual((normal["scale"], normal["uv"]["wrap"], normal["uv"]["scale"]), (-0.75, "clamp", [2, 3]))
            self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").returncode, 0)
        scene, said = self.load("model.gltf", textured({"name": "wood", "normalTexture": {"index": 0}}))
        self.assertIn("picture of its normals is left out, because there is no --assets FOLDER", said)
        self.assertNotIn("normal", scene["materials"]["wood"])
        for scale, taken in (1000.5, 1000), (-1e30, -1000):
            scene, said = self.load("model.gltf", textured({"name": "wood", "normalTexture": {"index": 0, "scale": scale}}),
                                    "--assets", "assets")
            self.assertIn(f"has a scale of {scale:g}, which is taken for {taken}\n", said)
            self.assertEqual(scene["materials"]["wood"]["normal"]["scale"], taken)

    def test_normals_of_mtl(self):
        for options, file, more in (("", "wood.png", {}), ("-bm 0.5 -s 2 3 1", "2.png", {"scale": 0.5})):
            a, said = self.mtl(f"norm {options} {file}\n")
            self.assertNotIn("left out", said)
            self.assertEqual({**a["normal"], "uv": 0}, {"texture": a["normal"]["texture"], **more, "uv": 0})
            self.assertEqual(a["normal"]["uv"], {"wrap": "repeat", **({"scale": [2, 3]} if options else {})})
            self.assertEqual(self.kept(a["normal"]), LEFT_RED if file == "wood.png" else HALF_METAL)
        for number, taken in ("2000", 1000), ("nan", None):
            a, said = self.mtl(f"norm -bm {number} wood.png\n")
            self.assertIn("has a scale of " + number, said)
            self.assertEqual(a["normal"].get("scale"), taken)
        a, said = self.mtl("illum 0\nnorm wood.png\nmap_Ke 2.png\n")
        for use in "normals", "emissive color":
            self.assertRegex(said, f"picture of its {use} is left out.*, because no light changes its color")
        self.assertNotIn("normal", a)
        a, said = self.mtl("map_Kn wood.png\nbump 2.png\n")
        self.assertEqual(self.kept(a["normal"]), LEFT_RED)
        self.assertIn("picture of its heights is left out", said)

    def heights(self, codes, statement):
        """The material whose picture of heights has these codes, the slopes of its map, and what was said."""
        (self.folder / "heights.png").write_bytes(picture(*codes))
        a, said = self.mtl(statement)
        if "normal" not in a:
            return a, None, said
        with Image.open(io.BytesIO(self.kept(a["normal"]))) as image:
            normals = np.asarray(image.convert("RGB"), float) / 127.5 - 1
        return a, -a["normal"].get("scale", 1) * normals[..., :2] / normals[..., 2:], said

    def test_heights_become_normals(self):
        at = np.arange(32)
        wave = np.round(127.5 + 100 * np.sin(2 * np.pi * at / 32))
        a, slopes, said = self.heights(np.tile(wave, (4, 1)).tolist(), "map_bump -bm 2 -s 3 1 heights.png\n")
        rise = 2 * 100 / 255 * np.sin(2 * np.pi / 32) * np.cos(2 * np.pi * at / 32)
        np.testing.assert_allclose(slopes[..., 0], np.tile(rise, (4, 1)), atol=0.01)
        np.testing.assert_allclose(slopes[..., 1], 0, atol=0.002)
        self.assertEqual(a["normal"]["uv"], {"wrap": "repeat", "scale": [3, 1]})
        self.assertIn("becomes one of normals, with white 2 texels above black: heights.png\n", said)
        ramp = [[[200 - 40 * row, 0, 0]] * 3 for row in range(5)]
        for wrap, ends in ("", -1.5), ("-clamp on ", 1):
            a, slopes, said = self.heights(ramp, f"bump {wrap}-bm -5 heights.png\n")
            up = -5 * 0.2126 * 40 / 255 * np.array([ends, 1, 1, 1, ends])
            np.testing.assert_allclose(slopes[:, 1, 1], up, atol=0.004)
            np.testing.assert_allclose(slopes[:, 1, 0], 0, atol=0.002)
            self.assertEqual(a["normal"]["uv"]["wrap"], "clamp" if wrap else "repeat")

    def test_heights_turn_the_surface(self):
        codes = [[40 * k for k in range(6)]] * 2
        (self.folder / "heights.png").write_bytes(picture(*codes))
        self.mtl("bump -clamp on -bm 6.375 heights.png\n")
        scene = json.loads((self.folder / "scene.json").read_text())
        for light, code in ([1, 0, -1], 255), ([-1, 0, -1], 0), ([0, 0, -1], 255 * 0.5 ** 0.5):
            np.testing.assert_allclose(self.seen(scene, light), code, atol=2)

    def test_heights_that_are_none(self):
        a, slopes, said = self.heights([[128, 128]], "bump heights.png\n")
        self.assertNotIn("normal", a)
        self.assertIn("picture of its heights is left out, because it is flat: heights.png\n", said)
        a, slopes, said = self.heights([[[128, 128, 255], [140, 120, 250]]], "map_Bump -bm 0.5 heights.png\n")
        self.assertIn("has the colors of normals, and is taken for one of these: heights.png\n", said)
        self.assertEqual(a["normal"]["scale"], 0.5)
        self.assertEqual(self.kept(a["normal"]), (self.folder / "heights.png").read_bytes())
        a, said = self.mtl("map_bump nothing.png\n")
        self.assertIn("picture of its heights is left out, because it cannot be read: nothing.png\n", said)
        self.assertNotIn("normal", a)

    def test_alpha_of_pictures_is_opacity(self):
        clear = picture([[1, 2, 3, 255], [1, 2, 3, 0]])
        for mode, counts in ("OPAQUE", False), ("MASK", True), ("BLEND", True):
            material = {"name": "leaf", "alphaMode": mode, "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
            _, said = self.load("model.gltf", textured(material, images=[clear]))
            self.assertEqual("alpha of its base color is left out: picture-0" in said, counts)
            scene, said = self.load("model.gltf", textured(material, images=[clear]), "--assets", "assets")
            leaf = scene["materials"]["leaf"]
            cut = mode == "MASK"
            if cut:
                with Image.open(io.BytesIO(self.kept(leaf["opacity"]))) as image:
                    self.assertEqual((image.mode, np.asarray(image).tolist()[0]), ("L", [255, 0]))
                self.assertNotIn("fades", said)
            self.assertEqual(leaf.get("opacity"), {
                "texture": leaf["opacity" if cut else "diffuse"]["texture"], "channel": "R" if cut else "A",
                "uv": {"wrap": "repeat"}} if counts else None)
            self.assertEqual(scene.get("trace"), {"depth": 8} if counts else None)
            self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").returncode, 0)
        material["pbrMetallicRoughness"]["baseColorFactor"] = [1, 1, 1, 0.5]
        _, said = self.load("model.gltf", textured(material, images=[clear]), "--assets", "assets")
        self.assertIn("factor of its opacity, 0.5, is left out", said)

    def test_what_is_far_away_is_looked_at(self):
        self.load("model.gltf", textured(nodes=[{"mesh": 0, "translation": [1e9, 1e9, 1e9]}]))
        self.assertEqual(self.shade("check", "scene.json").stderr, "")

    def test_statements_of_old_files_spoil_none(self):
        (self.folder / "model.mtl").write_text(
            "newmtl a\nKa spectral a.rfl 1\nKd .5 .25 1\nKs xyz 0.1 0.2 0.3\nNs .5\nillum 2\nd -halo .75\n"
            "decal a.png\naniso 0.5\nanisor 0\nrefl -type sphere a.png\nnewmtl b\nKd 1 0 0\nd 0.5 # no -halo\n")
        scene, said = self.load("model.obj", "mtllib model.mtl\nv .5 .25 -.5 1.0\r\nv 1 \\\n.5 0\nv 0 1 .5\nvt .5 .25\n"
                                "vn .5 .0 1\nusemtl a\nf 1/1/1 2/1/1 3/1/1\nusemtl b\nf 1 2 3\n")
        a = scene["materials"]["a"]
        self.assertEqual((a["diffuse"], a["opacity"], scene["materials"]["b"]["opacity"]), ([0.5, 0.25, 1], 0.75, 0.5))
        for what in "color that is no RGB", "decal", "aniso", "anisor", "refl":
            self.assertIn(f'material "a": its {what} is left out', said)
        self.assertEqual(next(iter(scene["meshes"].values()))["positions"], [0.5, 0.25, -0.5, 1, 0.5, 0, 0, 1, 0.5])

    def test_mtl_names_files(self):
        (self.folder / "a b.png").write_bytes(LEFT_RED)
        (self.folder / "c.png").write_bytes(HALF_METAL)
        (self.folder / "model.mtl").write_text(
            "newmtl a\nKa 1 1 1\nKd 0.5 1 1\nKs 1 1 1\nKe 1 1 1\nNs 9\nillum 2\nmap_Kd -clamp on a b.png\nmap_Ks C:\\x\\c.png\n"
            "map_Ke c.png\nmap_Ka /etc/hostname\nmap_d c.png\nnewmtl b\nKd 1 1 1\nillum 0\nmap_Kd c.png\n")
        faces = "mtllib model.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
        scene, said = self.load("model.obj", faces + "usemtl a\nf 1/1 2/2 3/3\nusemtl b\nf 1/1 2/2 3/3\n",
                                "--assets", "assets")
        self.assertIn("ambient color is left out, because it cannot be read: /etc/hostname", said)
        a, b = scene["materials"]["a"], scene["materials"]["b"]
        self.assertEqual((self.kept(a["diffuse"]), a["diffuse"]["tint"]), (LEFT_RED, [0.5, 1, 1]))
        self.assertEqual((self.kept(a["specular"]), a["specular"]["tint"], a["shininess"]), (HALF_METAL, [1, 1, 1], 9))
        self.assertEqual((self.kept(a["emissive"]), a["diffuse"]["uv"]), (HALF_METAL, {"wrap": "clamp"}))
        self.assertEqual((a["ambient"], b["diffuse"], self.kept(b["emissive"])), ([1, 1, 1], [0, 0, 0], HALF_METAL))
        self.assertEqual((self.kept(a["opacity"]), a["opacity"]["channel"]), (HALF_METAL, "R"))
        self.assertEqual(len(list((self.folder / "assets").iterdir())), 2)
        self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").returncode, 0)


    def mtl(self, text, *words):
        """The material `a` of a square, and what was said."""
        (self.folder / "wood.png").write_bytes(LEFT_RED)
        (self.folder / "2.png").write_bytes(HALF_METAL)
        (self.folder / "model.mtl").write_text("newmtl a\nKa 0 0 0\nKd 1 1 1\nillum 1\n" + text)
        scene, said = self.load("model.obj", "mtllib model.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n"
                                "usemtl a\nf 1/1 2/2 3/3\n", "--assets", "assets", *words)
        return scene["materials"]["a"], said

    def test_mirrors_follow_the_picture_of_their_highlight(self):
        a, said = self.mtl("Ks 0.5 1 0.25\nNs 90\nillum 3\nmap_Ks wood.png\n")
        self.assertNotIn("left out", said)
        self.assertEqual(self.kept(a["reflection"]), LEFT_RED)
        self.assertEqual(a["reflection"], a["specular"])
        np.testing.assert_allclose(a["reflection"]["tint"], [0.5, 1, 0.25], rtol=1e-6)
        a, _ = self.mtl("Ks 0.5 1 0.25\nNs 90\nillum 7\nTf 1 1 1\nmap_Ks wood.png\n")
        self.assertTrue(all(isinstance(part, float | int) for part in a["reflection"] + a["transmission"]))

    def test_files_that_no_daemon_takes_by_default_are_told(self):
        large = LEFT_RED + bytes(32 << 20)  # behind its end, where nobody looks
        (self.folder / "large.png").write_bytes(large)
        _, said = self.mtl("map_Kd large.png\n")
        self.assertIn(f"has {len(large)} bytes: a daemon takes {32 << 20} in a request, unless its --max-body", said)
        _, said = self.mtl("map_Kd wood.png\n")
        self.assertNotIn("--max-body", said)

    def test_mtl_places_pictures(self):
        for options, file, uv in (
                ("-s 2 3 1 -o 0.5 -0.25 0", "wood.png", {"scale": [2, 3], "offset": [0.5, -0.25]}),
                ("-s 2 3", "wood.png", {"scale": [2, 3]}), ("-s 2", "2.png", {"scale": [2, 1]}),
                ("-o 0.5", "2.png", {"offset": [0.5, 0]}), ("-S 1 1 -CLAMP ON", "wood.png", {"wrap": "clamp"}),
                ("-mm 0 1 -t 0 0 0 -blendu off -texres 64", "wood.png", {})):
            a, said = self.mtl(f"map_Kd {options}  {file} \n")
            self.assertNotIn("left out", said)
            self.assertEqual(a["diffuse"]["uv"], {"wrap": "repeat", **uv}, options)
            self.assertEqual(self.kept(a["diffuse"]), LEFT_RED if file == "wood.png" else HALF_METAL)
        a, _ = self.mtl("Ke 1 1 1\nmap_Ke -clamp on -s 4 4 4 wood.png\n")
        self.assertEqual(a["emissive"]["uv"], {"wrap": "clamp", "scale": [4, 4]})

    def test_exponents_follow_their_picture(self):
        shine = "Ks 0.5 0.5 0.5\nNs 90\nillum 2\n"
        a, said = self.mtl(shine + "map_Ns -s 3 1 wood.png\n")
        self.assertNotIn("left out", said)
        self.assertEqual(self.kept(a["shininess"]), LEFT_RED)
        self.assertEqual((a["shininess"]["values"], a["shininess"]["channel"], a["shininess"]["uv"]),
                         ([1, 90], "R", {"wrap": "repeat", "scale": [3, 1]}))
        self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").returncode, 0)
        a, said = self.mtl(shine + "map_Ns nothing.png\n")
        self.assertEqual(a["shininess"], 90)
        self.assertIn("picture of its exponents is left out, because it cannot be read: nothing.png", said)
        a, said = self.mtl("Ks 1 1 1\nNs 0.5\nillum 2\nmap_Ns wood.png\n")
        self.assertIn("picture of its exponents is left out but for its mean, because its Ns is not above 1", said)
        self.assertLess(a["shininess"], 0.5)

    def test_what_mtl_has_beside_is_told(self):
        _, said = self.mtl("map_Kd -mm 0.1 2 -t 1 1 1 -imfchan r -cc on wood.png\nmap_Ns 2.png\nPr 0.4\ndisp 2.png\n"
                           "sharpness 60\n")
        for words in ("-mm of its map_Kd", "-t of its map_Kd", "-imfchan of its map_Kd", "-cc of its map_Kd",
                      'picture of its exponents is left out, because it has no highlight: 2.png',
                      "picture of its displacement", "its Pr is left out", "its sharpness"):
            self.assertEqual(said.count(words), 1, (words, said))

    def test_what_gltf_has_beside_is_told(self):
        more = {"extensionsUsed": ["KHR_materials_clearcoat", "KHR_materials_unlit", "X_\n\u001b[31m"]}
        _, said = self.load("model.gltf", textured({"name": "wood", "extensions": {"KHR_materials_clearcoat": {}}}, **more))
        for words in ("what KHR_materials_clearcoat says is left out", "what X___[31m says"):
            self.assertEqual(said.count(words), 1, (words, said))
        self.assertNotIn("KHR_materials_unlit", said)

    def test_what_is_cut_out_has_an_edge(self):
        fading = picture([[1, 2, 3, code] for code in (63, 64, 127, 128)])
        for cutoff, factor, wanted in ((0.25, 1, [0, 255, 255, 255]), (0.25, 0.5, [0, 0, 0, 255]), (0.5, 0.25, 0), (0, 0.5, 1)):
            base = {"baseColorTexture": {"index": 0}, "baseColorFactor": [1, 1, 1, factor]}
            leaf = {"name": "leaf", "alphaMode": "MASK", "alphaCutoff": cutoff, "pbrMetallicRoughness": base}
            scene, said = self.load("model.gltf", textured(leaf, images=[fading]), "--assets", "assets")
            opacity = scene["materials"]["leaf"].get("opacity", 1)
            if not isinstance(wanted, list):
                self.assertEqual(opacity, wanted)
                continue
            self.assertNotIn("opacity", said)
            with Image.open(io.BytesIO(self.kept(opacity))) as image:
                self.assertEqual(np.asarray(image).tolist(), [wanted])

    def test_a_picture_is_cut_out_at_eight_values(self):
        fading = picture([[1, 2, 3, code] for code in range(0, 256, 5)])
        base = {"baseColorTexture": {"index": 0}}
        leaves = [{"name": f"leaf-{i}", "alphaMode": "MASK", "alphaCutoff": 0.1 + 0.05 * i, "pbrMetallicRoughness": base}
                  for i in range(12)]
        plates = [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": i}]}
                  for i in range(12)]
        scene, said = self.load("model.gltf", textured(
            images=[fading], materials=leaves, meshes=plates, nodes=[{"mesh": i} for i in range(12)],
            scenes=[{"nodes": list(range(12))}]), "--assets", "assets")
        channels = [scene["materials"][f"leaf-{i}"]["opacity"]["channel"] for i in range(12)]
        self.assertEqual(channels, ["R"] * 8 + ["A"] * 4)
        self.assertEqual(said.count("fades by its alpha"), 4)

    def test_bright_pictures_send_on_no_more_than_arrives(self):
        for more in {"metallicFactor": 0}, {"metallicFactor": 0.5, "roughnessFactor": 0.6}:
            wood = {"name": "wood", "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}, **more}}
            self.load("model.gltf", textured(wood), "--assets", "assets")
            self.assertEqual(self.shade("check", "scene.json", "--assets", "assets").stderr, "")

    def test_occlusion_darkens_surroundings(self):
        dark = picture([[51, 9, 9], [255, 9, 9]])
        stone = {"name": "stone", "occlusionTexture": {"index": 0},
                 "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 1, 1], "metallicFactor": 0}}
        scene, said = self.load("model.gltf", textured(
            stone, images=[dark], samplers=[{"wrapS": 33071, "wrapT": 33071}]), "--assets", "assets")
        self.assertNotIn("occlusion", said)
        self.assertEqual(scene["materials"]["stone"]["ambient"], {
            "texture": "sha256-" + hashlib.sha256(dark).hexdigest(), "channel": "R", "space": "lin_rec709",
            "tint": [0.5, 0.25, 1], "uv": {"wrap": "clamp"}})
        scene.update(lights=[], ambient=1, image={"width": 8, "height": 8, "samples": 1}, camera={
            "type": "orthographic", "position": [0.5, 0.5, 4], "target": [0.5, 0.5, 0], "height": 1},
            output={"format": "png", "colorSpace": "lin_rec709"})
        (self.folder / "scene.json").write_text(json.dumps(scene))
        done = self.shade("render", "scene.json", "-o", "out.png", "--assets", "assets")
        self.assertEqual(done.returncode, 0, done.stderr)
        with Image.open(self.folder / "out.png") as image:
            seen = np.asarray(image.convert("RGB"), int)
        np.testing.assert_allclose(seen[4, [0, 7]], [[26, 13, 51], [128, 64, 255]], atol=1)
        half = {**stone, "occlusionTexture": {"index": 0, "strength": 0.5}}
        both = {**stone, "pbrMetallicRoughness": {"baseColorTexture": {"index": 1}, "metallicFactor": 0}}
        for material, tint, why in ((half, [0.4, 0.2, 0.8], "strength"), (both, [0.6] * 3, "follows another")):
            scene, said = self.load("model.gltf", textured(material, images=[dark, LEFT_RED]), "--assets", "assets")
            self.assertRegex(said, f"its occlusion is left out but for its mean, because its .*{why}")
            ambient = scene["materials"]["stone"]["ambient"]
            np.testing.assert_allclose(ambient["tint"] if material is both else ambient, tint, atol=1e-6)


# ---- How near the fits are ----

def srgb(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


class Fit(Case):
    """The renderer's own picture of a sphere against a direct evaluation of what the file means."""

    SIDE = 48

    def sphere(self, material):
        scene = {"camera": {"type": "orthographic", "position": [0, 0, 4], "height": 2},
                 "image": {"width": self.SIDE, "height": self.SIDE, "samples": 1},
                 "lights": [{"type": "directional", "direction": [-1, -1, -1]}],
                 "objects": [{"type": "sphere", "material": material}]}
        (self.folder / "sphere.json").write_text(json.dumps(scene))
        done = self.shade("render", "sphere.json", "-o", "sphere.png")
        self.assertEqual(done.returncode, 0, done.stderr)
        with Image.open(self.folder / "sphere.png") as image:
            return np.asarray(image.convert("RGB")) / 255

    def stand(self):
        x = (np.arange(self.SIDE) + 0.5) / self.SIDE * 2 - 1
        x, y = np.meshgrid(x, -x)
        inside = x * x + y * y < 0.98
        z = np.sqrt(np.maximum(1 - x * x - y * y, 1e-9))
        light = np.ones(3) / math.sqrt(3)
        half = light + [0, 0, 1]
        half /= np.linalg.norm(half)
        dot = lambda v: x * v[0] + y * v[1] + z * v[2]
        return inside, np.maximum(dot(light), 0), z, np.maximum(dot(half), 0), half[2]

    def test_gltf_spheres_look_alike(self):
        inside, nl, nv, nh, vh = self.stand()
        for base, metal, rough, most in (([1, 0.75, 0.25], 1, 0.4, 0.03), ([0.8, 0.1, 0.1], 0, 0.5, 0.005),
                                         ([0.5, 0.6, 0.7], 0.5, 0.8, 0.01)):
            material = {"name": "m", "pbrMetallicRoughness": {
                "baseColorFactor": [*base, 1], "metallicFactor": metal, "roughnessFactor": rough}}
            a2 = rough ** 4
            smith = lambda c: 2 * c / (c + np.sqrt(a2 + (1 - a2) * c * c))
            lobe = a2 / (nh * nh * (a2 - 1) + 1) ** 2 * smith(nl) * smith(nv) / (4 * nv) * (nl > 0)
            f0 = 0.04 + (np.array(base) - 0.04) * metal
            fresnel = f0 + (1 - f0) * (1 - vh) ** 5
            wanted = (1 - fresnel) * np.array(base) * (1 - metal) * nl[..., None] + fresnel * lobe[..., None]
            for words in ((), ("--phong",)):
                scene, said = self.load("m.glb", glb(materials=[material, material]), *words)
                got = self.sphere(scene["materials"]["m"])
                off = np.abs(got - srgb(wanted))[inside].mean()
                self.assertLess(off, most, said)
                self.assertGreater(off, 0)

    def three(self, **members):
        material = {"metadata": {"type": "Material"}, "type": "MeshPhongMaterial", "name": "t", "color": 0x8040c0,
                    "specular": 0x404040, "shininess": 30, **members}
        return json.dumps(material)

    def test_three_js_is_blinn_phong(self):
        inside, nl, _, nh, vh = self.stand()
        scene, said = self.load("t.json", self.three())
        self.assertIn("three.js's Blinn-Phong by Blinn-Phong: deltaE2000", said)
        self.assertEqual(scene["materials"]["t"]["model"], "blinn-phong")
        decode = lambda code: ((code / 255 + 0.055) / 1.055) ** 2.4
        color, specular = np.array([decode(c) for c in (0x80, 0x40, 0xc0)]), decode(0x40)
        fresnel = specular + (1 - specular) * (1 - vh) ** 5
        wanted = (color + (fresnel * 0.25 * (30 / 2 + 1) * nh ** 30)[..., None]) * nl[..., None]
        off = np.abs(self.sphere(scene["materials"]["t"]) - srgb(wanted))[inside]
        self.assertLess(off.mean(), 0.006)
        scene, said = self.load("t.json", self.three(map="x", opacity=0.5, transparent=True), "--phong")
        self.assertIn("by Phong", said)
        self.assertIn("left out: map", said)
        self.assertEqual((scene["materials"]["t"]["model"], scene["materials"]["t"]["opacity"]), ("phong", 0.5))

    def test_three_js_refusals(self):
        for text, words in (("{", "expected"), ("[]", "no object"), ("{}", "no material"),
                            ('{"type": "SpriteMaterial"}', "SpriteMaterial is not known")):
            self.assertIn(words, self.refuse("t.json", text))


class Hostile(Case):
    def test_files_that_are_none(self):
        for name in ("a.obj", "a.gltf", "a.glb", "a.ply", "a.stl"):
            said = self.refuse(name, b"\x7fELF" + bytes(range(256)))
            self.assertIn(f"shade: cannot import '{name}': ", said)

    def test_numbers_that_are_none(self):
        self.refuse("a.ply", PLY.replace(struct.pack("<f", 1), struct.pack("<f", math.nan)))
        self.refuse("a.gltf", embedded(materials=[{"pbrMetallicRoughness": {"metallicFactor": 7}}, {}]))
        scene, said = self.load("b.gltf", embedded(nodes=[{"mesh": 0, "scale": [1, 0, 1]}]))
        self.assertIn("no inverse", said)
        self.assertEqual(scene["objects"], [])

    def test_what_a_file_says_does_not_reach_the_terminal(self):
        said = self.refuse("a.obj", b"v 1 \x1b[31m\xff 2\nf 1 1 1\n")
        self.assertEqual([c for c in said[:-1] if not c.isprintable()], [])

    def test_files_beside_have_an_end(self):
        os.mkfifo(self.folder / "pipe.mtl")
        (self.folder / "zero.mtl").symlink_to("/dev/zero")
        for name in "pipe.mtl", "zero.mtl":
            scene, _ = self.load("model.obj", f"mtllib {name}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl a\nf 1 2 3\n")
            self.assertEqual(len(scene["objects"]), 1)
            (self.folder / "scene.json").unlink()
        for name in "pipe", "zero":
            buffer = {"byteLength": 108, "uri": f"{name}.mtl"}
            self.assertIn("cannot import 'model.gltf'", self.refuse("model.gltf", json.dumps(gltf(buffers=[buffer])[0])))

    def test_what_says_that_it_is_large_is_told(self):
        self.assertIn("ends before its first chunk", self.refuse("model.glb", struct.pack(
            "<4sIII4s", b"glTF", 2, 100, 0xfffffff0, b"JSON") + b"{}"))
        with (self.folder / "large.obj").open("wb") as file:
            file.truncate(1 << 42)
        self.assertIn("it has 4194304 MB; reading it may take", self.refuse("large.obj", None))
        if not SANITIZED:  # of which nothing is taken there, but by what it has
            many = PLY.replace(b"element vertex 4", b"element vertex 4000000000")
            self.assertIn("more memory than there is for it", self.refuse("model.ply", many))

    def test_a_pipe_is_no_file(self):
        os.mkfifo(self.folder / "a.obj")
        done = self.shade("import", "a.obj", "-o", "scene.json")
        self.assertEqual(done.returncode, 1)
        self.assertIn("no regular file", done.stderr)

    def test_mutants_never_crash(self):
        """A reader that crashes does so alone: an error of one line, and status 1."""
        chance = random.Random(16)
        kinds = [("a.obj", OBJ.encode()), ("a.gltf", embedded()), ("a.glb", glb()), ("a.ply", PLY), ("a.stl", STL),
                 ("b.gltf", textured().encode())]
        for round_ in range(1 if SANITIZED else 4):
            for name, data in kinds:
                mutant = bytearray(data)
                for _ in range(1 + round_):
                    at = chance.randrange(len(mutant))
                    how = chance.randrange(3)
                    if how == 0:
                        mutant[at] = chance.randrange(256)
                    elif how == 1:
                        del mutant[at:at + chance.randrange(1, 9)]
                    else:
                        mutant[at:at] = mutant[max(0, at - 40):at]
                (self.folder / name).write_bytes(mutant)
                done = self.shade("import", name, "-o", "scene.json", "--assets", "assets")
                self.assertIn(done.returncode, (0, 1), (name, round_, done.stderr))
                if done.returncode:
                    self.assertRegex(done.stderr, rf"(?m)^shade: cannot import '{name}': ")
                else:
                    checked = self.shade("check", "scene.json", "--assets", "assets")
                    self.assertEqual(checked.returncode, 0, (name, round_, checked.stderr))

    @unittest.skipIf(SANITIZED, "sanitizers have limits of their own")
    def test_deep_nodes_end_the_reader_alone(self):
        count = 60000
        nodes = [{"children": [i + 1]} for i in range(count)] + [{"mesh": 0}]
        said = self.refuse("a.gltf", embedded(nodes=nodes))
        self.assertIn("cannot import 'a.gltf'", said)


if __name__ == "__main__":
    unittest.main()
