"""`shade verify`: the right picture passes, whatever its format, and what is not the scene's is found where it is."""

import json
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
from PIL import Image

from e2e.daemon import Daemon

SHADE = Path(os.environ["SHADED_BUILD"]) / "shade"
SCENE = {"image": {"width": 72, "height": 54, "samples": 4}, "background": [0.02, 0.03, 0.05],
         "lights": [{"position": [3, 3, 3, 1]}, {"type": "directional", "direction": [1, -1, -2], "intensity": 0.4}],
         "objects": [{"type": "torus", "material": {"preset": "brass"}, "transform": {"rotate": [50, 0, 20]}},
                     {"type": "sphere", "radius": 0.4, "material": {"diffuse": "#e52", "specular": 0.4}}]}
PIXELS = 72 * 54


class VerifyTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.stop)

    def setUp(self):
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))

    def shade(self, *words):
        return subprocess.run([SHADE, *map(str, words)], capture_output=True, text=True, timeout=600, check=False)

    def write(self, scene, name="scene.json"):
        path = self.folder / name
        path.write_text(json.dumps(scene))
        return path

    def render(self, scene, suffix):
        """By one daemon, which need not load OpenImageIO for each."""
        path, picture = self.write(scene), self.folder / f"picture.{suffix}"
        output = {**scene.get("output", {}), "format": {"tif": "tiff", "jpg": "jpeg"}.get(suffix, suffix)}
        answer = self.daemon.render({**scene, "output": output})
        self.assertEqual(answer.status, 200, answer.body[:1000])
        picture.write_bytes(answer.body)
        return picture, path

    def verify(self, picture, scene, *words, status=0):
        done = self.shade("verify", picture, scene, *words)
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return json.loads(done.stdout)

    def test_right_pictures_of_drafts(self):
        ball = {"image": {"width": 128, "height": 128}, "lights": [{"position": [-3, 2, 4, 1]}], "output": {"bitDepth": 16},
                "objects": [{"type": "sphere", "material": {"specular": 0.4}}]}
        for accuracy in {"tier": "draft"}, {"maxError": 0.5}:
            told = self.verify(*self.render({**ball, "accuracy": accuracy}, "png"), "--pixels", 128 * 128)
            self.assertTrue(told["verified"])
            self.assertIn("tier=draft;", told["plan"])

    def test_right_pictures_of_all_formats(self):
        mirror = {**SCENE, "trace": {"depth": 3, "shadows": True},
                  "objects": [*SCENE["objects"], {"type": "plane", "material": {"reflection": 0.4, "diffuse": 0.3},
                                                  "transform": {"translate": [0, -1, 0]}}]}
        scenes = {"plain": SCENE, "transparent": {**SCENE, "background": None}, "traced": mirror,
                  "half seen through": {**SCENE, "background": [0.4, 0.4, 0.4, 0.3]},
                  "exact": {**SCENE, "accuracy": {"tier": "exact"}},
                  "budget": {**SCENE, "accuracy": {"maxError": 0.02, "metric": "linear"}},
                  "matte": {**SCENE, "background": None, "output": {"matte": [0.1, 0.5, 0.2]}}}
        outputs = [("png", {}), ("png", {"bitDepth": 16}), ("png", {"channel": "G"}), ("png", {"dither": True}),
                   ("png", {"colorSpace": "YIQ"}), ("png", {"exposure": 1.5, "gamma": 1.2}), ("png", {"channel": "A"}),
                   ("tif", {}), ("tif", {"bitDepth": 16}), ("tif", {"bitDepth": "float", "colorSpace": "ACEScg"}),
                   ("exr", {}), ("exr", {"bitDepth": "float"}), ("exr", {"layers": ["diffuse", "depth"],
                                                                        "colorSpace": "lin_rec709"}),
                   ("hdr", {}), ("jpg", {}), ("jpg", {"quality": 60}), ("webp", {}), ("webp", {"quality": 100})]
        # To load OpenImageIO takes a while, so that not all meet all.
        # Bright edges clip before their alpha multiplies them.
        chosen = {"plain": outputs, "transparent": [("png", {}), ("tif", {"bitDepth": 8, "exposure": 6}), ("exr", {}),
                                                    ("webp", {}), ("webp", {"quality": 100})]}
        some = [("exr", {"bitDepth": "float"}), ("webp", {"quality": 100}), ("jpg", {})]
        for name, scene in scenes.items():
            for suffix, output in chosen.get(name, some):
                if name == "budget" and suffix in ("jpg", "webp") and output.get("quality") != 100:
                    continue
                if name == "matte" and suffix == "exr":
                    continue
                with self.subTest(scene=name, suffix=suffix, output=output):
                    picture, path = self.render({**scene, "output": {**scene.get("output", {}), **output}}, suffix)
                    told = self.verify(picture, path, "--pixels", PIXELS)
                    self.assertTrue(told["verified"])
                    self.assertEqual((told["checked"], told["failed"], told["unbounded"]), (PIXELS, 0, 0))

    def test_a_pixel_that_is_off_by_two_codes(self):
        for suffix in "png", "tif", "webp":
            output = {"quality": 100} if suffix == "webp" else {}
            for x, y in [(30, 20), (3, 50)] if suffix == "webp" else [(30, 20)]:
                picture, path = self.render({**SCENE, "output": output}, suffix)
                pixels = np.asarray(Image.open(picture).convert("RGB")).copy()
                was = int(pixels[y, x, 1])
                pixels[y, x, 1] = was + (2 if was < 128 else -2)
                Image.fromarray(pixels).save(picture, **({"lossless": True, "exact": True} if output else {}))
                told = self.verify(picture, path, "--pixels", PIXELS, status=1)
                self.assertEqual(told["failed"], 1)
                failure = told["failures"][0]
                self.assertEqual((failure["x"], failure["y"], failure["channel"]), (x, y, "G"))
                self.assertEqual(failure["value"], pixels[y, x, 1])
                self.assertTrue(failure["least"] <= was <= failure["most"])
                self.verify(picture, path, "--pixels", PIXELS, "--tolerance", 2)

    def test_a_scene_without_bounds_tells_nothing(self):
        scene = {**SCENE, "objects": [{"type": "box", "size": [4, 4, 4], "material": {"diffuse": 1e30}}],
                 "lights": [{"position": [1, 1, 1, 0], "intensity": 1e30}]}
        picture, path = self.render(scene, "png")
        done = self.shade("verify", picture, path)
        told = json.loads(done.stdout)
        self.assertEqual((done.returncode, told["checked"], told["unbounded"]), (1, 0, 400))
        self.assertIn("may be the picture", done.stderr)

    def test_a_dithered_picture_that_is_a_code_brighter(self):
        picture, path = self.render({**SCENE, "output": {"dither": True}}, "png")
        Image.fromarray(np.asarray(Image.open(picture)) + np.uint8(1)).save(picture)
        self.assertGreater(self.verify(picture, path, status=1)["failed"], 390)

    def test_light_that_is_off_by_little(self):
        import OpenImageIO as oiio
        picture, path = self.render({**SCENE, "output": {"bitDepth": "float"}}, "exr")
        image = oiio.ImageInput.open(str(picture))
        spec = oiio.ImageSpec(image.spec().width, image.spec().height, 3, oiio.FLOAT)
        pixels = np.array(image.read_image(0, 0, 0, 3, oiio.FLOAT)).reshape(54, 72, 3)
        image.close()
        pixels[21, 31, 0] *= 1 + 1e-3
        out = oiio.ImageOutput.create(str(picture))
        out.open(str(picture), spec)
        out.write_image(pixels.astype(np.float32))
        out.close()
        told = self.verify(picture, path, "--pixels", PIXELS, status=1)
        self.assertEqual([(one["x"], one["y"], one["channel"]) for one in told["failures"]], [(31, 21, "R")])

    def test_a_block_of_a_jpeg(self):
        picture, path = self.render({**SCENE, "output": {"quality": 95}}, "jpg")
        image = Image.open(picture).convert("RGB")
        image.paste((255, 255, 255), (16, 16, 24, 24))
        image.save(picture, quality=98, subsampling=0)
        told = self.verify(picture, path, "--pixels", PIXELS, status=1)
        places = {(one["x"], one["y"]) for one in told["failures"]}
        self.assertTrue(places and all(8 <= x < 32 and 8 <= y < 32 for x, y in places), places)

    def test_the_picture_of_a_budget_that_found_its_quality(self):
        scene = {**SCENE, "accuracy": {"maxError": 30, "metric": "code"}}
        picture, path = self.render(scene, "jpg")
        self.assertEqual(self.verify(picture, path)["tolerance"], 30)
        picture, path = self.render({**scene, "accuracy": {"maxError": 12}}, "jpg")
        done = self.shade("verify", picture, path)
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("tolerance", done.stderr)
        self.verify(picture, path, "--tolerance", 40)

    def test_another_scene(self):
        picture, _ = self.render({**SCENE, "output": {"quality": 100}}, "webp")
        other = self.write({**SCENE, "output": {"quality": 100}, "lights": [{**SCENE["lights"][0], "intensity": 0.97}, SCENE["lights"][1]]}, "other")
        told = self.verify(picture, other, status=1)
        self.assertGreater(told["failed"], 20)
        self.assertEqual(told["checked"], 400)
        self.assertLessEqual(len(told["failures"]), 64)

    def test_seeds_choose_pixels(self):
        picture, path = self.render(SCENE, "jpg")
        other = self.write({**SCENE, "background": 1}, "other")
        places = [[(one["x"], one["y"]) for one in
                   self.verify(picture, other, "--pixels", 15, "--seed", seed, status=1)["failures"]]
                  for seed in (1, 1, 2)]
        self.assertEqual(places[0], places[1])
        self.assertNotEqual(places[0], places[2])

    def test_what_is_no_such_picture(self):
        picture, path = self.render(SCENE, "png")
        small = self.write({**SCENE, "image": {"width": 20, "height": 20}}, "small")
        deep = self.write({**SCENE, "output": {"bitDepth": 16}}, "deep")
        alpha = self.write({**SCENE, "background": None}, "alpha")
        tiff = self.write({**SCENE, "output": {"format": "tiff"}}, "tiff")
        scope = self.write({**SCENE, "output": {"scope": "histogram"}}, "scope")
        broken = self.folder / "broken.png"
        broken.write_bytes(picture.read_bytes()[:200])
        for words, why in (((picture, small), "72 x 54"), ((picture, deep), "depth"), ((picture, alpha), "channels"),
                           ((picture, tiff), "no png"), ((picture, scope), "scope"),
                           ((broken, path), "PNG: the file ends early"), ((self.folder / "none.png", path), "none.png"),
                           ((self.folder / "none.webp", path), "none.webp"),
                           ((picture, self.folder / "none"), "none")):
            with self.subTest(why=why):
                done = self.shade("verify", *words)
                self.assertEqual((done.returncode, done.stdout), (1, ""), done.stderr)
                self.assertIn(why, done.stderr)

    def test_usage(self):
        for words in (("verify",), ("verify", "a.png"), ("verify", "a.gif", "b"), ("verify", "a.png", "b", "c"),
                      ("verify", "a.png", "b", "-o", "c"), ("verify", "a.png", "b", "--pixels", "0"),
                      ("verify", "a.png", "b", "--seed", "x"), ("verify", "a.png", "b", "--tolerance", "-1"),
                      ("check", "b", "--pixels", "3")):
            with self.subTest(words=words):
                done = self.shade(*words)
                self.assertEqual((done.returncode, done.stdout), (2, ""), done.stderr)


if __name__ == "__main__":
    unittest.main()
