"""shade diff and POST /v1/diff, against numpy."""

import io
import json
import os
import subprocess
import unittest

import numpy as np
from PIL import Image

from e2e.daemon import BUILD, JSON, SMALL, Daemon, environment
from e2e.daemon_test import Folder
from reference import flip

SHADE = str(BUILD / "shade")
SPHERE = {"objects": [{"type": "sphere", "material": {"diffuse": [0.8, 0.3, 0.2], "specular": 0.5}}],
          "image": {"width": 45, "height": 37, "samples": 4}}
GREEN = {**SPHERE, "objects": [{"type": "sphere", "material": {"diffuse": [0.2, 0.7, 0.3]}}]}


def diff(*words, text=None):
    done = subprocess.run([SHADE, "diff", *map(str, words)], capture_output=True, check=False, env=environment(),
                          input=None if text is None else text.encode())
    return done.returncode, done.stdout, done.stderr.decode()


class Test(Folder):
    def save(self, name, codes):
        path = self.folder / name
        Image.fromarray(np.round(codes * 255).astype(np.uint8)).save(path)
        return path

    def scene(self, name, scene):
        return self.file(json.dumps(scene), name)

    def tell(self, *words, status=0, text=None):
        code, told, stderr = diff(*words, text=text)
        self.assertEqual(code, status, stderr)
        return json.loads(told)

    def near(self, told, expected, by):
        for name, value in expected.items():
            self.assertAlmostEqual(told[name], value, delta=by, msg=name)

    def assert_as_numpy(self, told, a, b, density=flip.DENSITY):
        """Filters are sums of floats here: errors of 1e-6 in light, whose distance goes through a power of 0.7 and
        whose features through one of 0.5, as they are near 0."""
        errors, colors = flip.flip(a, b, density), flip.delta_e(a, b)
        self.near(told["flip"], flip.figures(errors), 1e-3)
        self.assertAlmostEqual(told["flip"]["mean"], errors.mean(), delta=2e-4)
        # The matrices' digits differ by 1e-4.
        self.near(told["deltaE2000"], flip.figures(colors), 5e-3)
        self.assertEqual(told["differing"], int((a != b).any(axis=-1).sum()))
        x, y = told["flip"]["at"]
        self.assertAlmostEqual(errors[y, x], errors.max(), delta=1e-3)


class CommandTest(Test):
    def pictures(self):
        """Edges, points, noise and ramps, and what became of them."""
        numbers = np.random.default_rng(5)
        y, x = np.mgrid[0:41, 0:53]
        a = np.stack([x / 52, y / 40, (x + y) / 92], -1)
        a[10:20, 10:20] = [1, 0.9, 0.1]
        a[30, 40] = 1
        a[:, 45:] = numbers.random((41, 8, 3))
        b = a.copy()
        b[10:20, 12:22] = [0.2, 0.9, 0.6]
        b[5, 30] = 0
        b[25:35] = np.clip(b[25:35] * 1.1, 0, 1)
        return (np.round(v * 255) / 255 for v in (a, b))

    def test_files_are_as_far_apart_as_numpy_says(self):
        a, b = self.pictures()
        one, other = self.save("a.png", a), self.save("b.png", b)
        self.assert_as_numpy(self.tell(one, other), a, b)
        self.assert_as_numpy(self.tell(one, other, "--density", 20), a, b, 20)
        self.assertEqual(self.tell(other, one)["flip"]["mean"], self.tell(one, other)["flip"]["mean"])
        # The extremes: 1 for the farthest colors, in large.
        colors = [np.broadcast_to(np.array(color, float), (8, 300, 3)) for color in ([0, 1, 0], [0, 0, 1])]
        told = self.tell(self.save("g.png", colors[0]), self.save("v.png", colors[1]))
        self.near(told["flip"], dict.fromkeys(("mean", "p50", "max"), 1), 1e-5)

    def test_equal_pictures_are_0_apart(self):
        scene, picture = self.scene("a.json", SPHERE), self.folder / "a.png"
        subprocess.run([SHADE, "render", scene, "-o", picture], check=True, env=environment())
        for one, other in ((scene, picture), (picture, picture), (scene, scene)):
            told = self.tell(one, other, "--fail-above", "flip.max=0", "--fail-above", "deltaE2000.max=0")
            self.assertEqual((told["differing"], told["flip"]["max"], told["deltaE2000"]["max"]), (0, 0, 0))
            self.assertEqual((told["width"], told["height"]), (45, 37))
        self.assertEqual(self.tell("-", picture, text=json.dumps(SPHERE))["differing"], 0)
        # Other encodings of the same colors: apart by rounding to their codes.
        deep = self.scene("d.json", {**GREEN, "output": {"bitDepth": 16}})
        for output, most in (({"display": "Display P3", "bitDepth": 16}, 0.02), ({}, 2.5),
                             ({"colorSpace": "YIQ", "bitDepth": 16}, 0.02)):
            name = self.scene("o.json", {**GREEN, "output": output})
            self.assertLessEqual(self.tell(deep, name)["deltaE2000"]["max"], most, output)
        lossless = self.scene("l.json", {**SPHERE, "output": {"format": "webp", "quality": 100}})
        self.assertEqual(self.tell(scene, lossless)["differing"], 0)

    def test_scenes_are_compared_as_their_pictures(self):
        sides = []
        for name, scene in (("a", SPHERE), ("b", GREEN)):
            self.scene(name + ".json", scene)
            picture = self.folder / f"{name}.png"
            subprocess.run([SHADE, "render", self.folder / f"{name}.json", "-o", picture], check=True,
                           env=environment())
            sides.append(np.asarray(Image.open(picture)) / 255)
        told = self.tell(self.folder / "a.json", self.folder / "b.json")
        self.assert_as_numpy(told, *sides)
        self.assertEqual(told, self.tell(self.folder / "a.png", self.folder / "b.png"))

    def test_alpha_is_told_and_lies_over_black(self):
        clear, half = np.zeros((9, 9, 4)), np.zeros((9, 9, 4))
        half[...] = [1, 1, 1, 128 / 255]
        clear[..., 3] = 1
        told = self.tell(self.save("c.png", clear), self.save("h.png", half))
        self.assertAlmostEqual(told["alpha"], 127 / 255, delta=1e-6)
        grey = self.save("g.png", np.full((9, 9, 3), 128 / 255))
        self.assertLess(self.tell(self.folder / "h.png", grey)["deltaE2000"]["max"], 1e-4)

    def test_the_map_shows_errors(self):
        a, b = self.pictures()
        one, other, heat = self.save("a.png", a), self.save("b.png", b), self.folder / "map.png"
        self.tell(one, other, "-o", heat)
        image = Image.open(heat)
        self.assertEqual((image.size, image.mode), ((53, 41), "RGB"))
        codes, errors = np.asarray(image).astype(int).sum(axis=-1), flip.flip(a, b)
        # Brighter is worse.
        order = np.argsort(errors.ravel())
        self.assertTrue((np.diff(codes.ravel()[order]) >= -3).all())
        self.assertEqual(tuple(np.asarray(image)[0, 0]), (0, 0, 4))
        code, data, _ = diff(one, other, "-o", "-")
        self.assertEqual((code, data), (0, heat.read_bytes()))

    def test_too_far_is_a_failure(self):
        one, other = self.scene("a.json", SPHERE), self.scene("b.json", GREEN)
        told = self.tell(one, other)
        for name, value in (("flip", told["flip"]["mean"]), ("flip.p95", told["flip"]["p95"]),
                            ("deltaE2000.max", told["deltaE2000"]["max"])):
            code, _, stderr = diff(one, other, "--fail-above", f"{name}={value * 0.99}")
            self.assertEqual(code, 1)
            self.assertIn(f"{name} is", stderr)
            self.assertEqual(diff(one, other, "--fail-above", f"{name}={value * 1.01}")[0], 0)
        self.assertEqual(diff(one, other, "--fail-above", "alpha=0")[0], 0)

    def test_what_is_wrong_is_told(self):
        scene, small = self.scene("a.json", SPHERE), self.scene("s.json", SMALL)
        wrong = self.scene("w.json", {"objects": 1})
        many = self.scene("m.json", {**SPHERE, "outputs": [{"name": "x"}]})
        data = self.scene("d.json", {**SPHERE, "output": {"channel": "R"}})
        text = self.file("no picture", "t.png")
        cut = self.folder / "cut.tif"
        Image.fromarray(np.full((37, 45, 3), 99, np.uint8)).save(cut)
        cut.write_bytes(cut.read_bytes()[:-100])
        for words, code, word in (((scene, small), 1, "45 x 37 and 16 x 12"), ((scene, wrong), 1, "/objects"),
                                  ((scene, cut), 1, "cut.tif: OpenImageIO: "), ((scene, scene, "-o", "m.jpg"), 2, "suffix"),
                                  ((scene, many), 1, "/outputs"), ((scene, data), 1, "/output/channel"),
                                  ((scene, text), 1, "t.png"), ((scene, self.folder / "none.png"), 1, "none.png"),
                                  ((scene,), 2, "two"), ((scene, "x.gif"), 2, "suffix"), (("-", "-"), 2, "stdin"),
                                  ((scene, scene, "--fail-above", "flop=1"), 2, "flop=1"),
                                  ((scene, scene, "--fail-above", "flip"), 2, "flip"),
                                  ((scene, scene, "--density", "5"), 2, "10 to 400")):
            found, _, stderr = diff(*words)
            self.assertEqual(found, code, stderr)
            self.assertIn(word, stderr)

    def test_a_file_that_ends_early_is_told_in_one_line(self):
        scene = self.scene("a.json", SPHERE)
        for suffix, word in (("png", "PNG: the file ends early"), ("jpg", "JPEG: the file ends early"),
                             ("webp", "WebP: the picture is damaged, or not whole")):
            cut = self.folder / ("cut." + suffix)
            Image.fromarray(np.full((37, 45, 3), 99, np.uint8)).save(cut)
            data = cut.read_bytes()
            for left in (len(data) - 20, len(data) // 2):
                cut.write_bytes(data[:left])
                self.assertEqual(diff(scene, cut), (1, b"", f"{cut}: {word}\n"))


class RequestTest(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def post(self, a, b, headers=None, **more):
        return self.daemon.post("/v1/diff", {"a": a, "b": b, **more}, headers)

    def problem(self, answer, code):
        self.assertEqual(answer.status, code, answer.body)
        return {error["pointer"]: error["detail"] for error in json.loads(answer.body)["errors"]}

    def test_it_tells_what_the_command_line_does(self):
        one, other = self.scene("a.json", SPHERE), self.scene("b.json", GREEN)
        for density in ({}, {"pixelsPerDegree": 30}):
            words = ["--density", "30"] if density else []
            self.assertEqual(json.loads(self.post(SPHERE, GREEN, **density).body), self.tell(one, other, *words))
        same = json.loads(self.post(SPHERE, SPHERE).body)
        self.assertEqual((same["differing"], same["flip"]["max"]), (0, 0))

    def test_the_map_is_a_picture(self):
        answer = self.post(SPHERE, GREEN, {"Accept": "image/png"})
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/png"))
        heat = self.folder / "map.png"
        self.tell(self.scene("a.json", SPHERE), self.scene("b.json", GREEN), "-o", heat)
        self.assertEqual(Image.open(io.BytesIO(answer.body)).tobytes(), Image.open(heat).tobytes())

    def test_mistakes_are_told_at_their_places(self):
        bad = {**SPHERE, "camera": {"fov": 400}, "lights": 3}
        self.assertEqual(set(self.problem(self.post(bad, {}), 422)), {"/a/camera/fov", "/a/lights", "/b"})
        self.assertIn("45 x 37", self.problem(self.post(SPHERE, SMALL), 422)["/b/image/width"])
        for output, place in (({"channel": "R"}, "/output/channel"), ({"scope": "waveform"}, "/output/scope")):
            self.assertEqual(list(self.problem(self.post(SPHERE, {**SPHERE, "output": output}), 422)), ["/b" + place])
        self.assertEqual(list(self.problem(self.daemon.post("/v1/diff", {"a": SMALL}), 422)), [""])
        large = {**SPHERE, "image": {"width": 9000, "height": 9000}}
        self.assertEqual(set(self.problem(self.post(large, large), 422)), {"/a/image"})

    def test_memory_is_bounded(self):
        wide = {**SMALL, "image": {"width": 1000, "height": 1000, "samples": 1}}
        with Daemon("--max-memory", "64M", "--threads", "1") as daemon:
            answer = daemon.post("/v1/diff", {"a": wide, "b": wide})
            self.assertIn("`memory`", " ".join(self.problem(answer, 422).values()))
            self.assertEqual(daemon.post("/v1/diff", {"a": SMALL, "b": SMALL}).status, 200)


if __name__ == "__main__":
    unittest.main()
