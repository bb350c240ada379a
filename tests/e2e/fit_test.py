"""shade fit and POST /v1/fit: what a picture of a scene tells of a material."""

import hashlib
import json
import subprocess
import unittest

from e2e.daemon import BUILD, Daemon, environment
from e2e.daemon_test import Folder

SHADE = str(BUILD / "shade")
BALL = {"ambient": 0.2, "image": {"width": 64, "height": 48},
        "lights": [{"type": "point", "position": [3, 3, 3], "color": [1, 0.9, 0.8]}],
        "objects": [{"type": "sphere", "name": "ball",
                     "material": {"ambient": 0.3, "diffuse": [0.6, 0.3, 0.15], "specular": 0.25, "shininess": 20}}]}


def shade(*words):
    return subprocess.run([SHADE, *map(str, words)], capture_output=True, check=False, env=environment())


class CommandTest(Folder):
    def scene(self, name, scene):
        return self.file(json.dumps(scene), name)

    def test_the_material_of_a_photo_can_be_pasted(self):
        scene, photo = self.scene("ball.json", BALL), self.folder / "ball.png"
        self.assertEqual(shade("render", scene, "-o", photo).returncode, 0)
        done = shade("fit", photo, scene, "--object", "ball")
        self.assertEqual(done.returncode, 0, done.stderr)
        told = json.loads(done.stdout)
        self.assertEqual((told["object"], told["model"], told["space"]), ("ball", "phong", "lin_rec709"))
        self.assertEqual(told["notIdentifiable"], [])
        self.assertGreater(told["pixels"]["used"], 800)
        for found, known in zip(told["diffuse"]["value"], (0.6, 0.3, 0.15)):
            self.assertAlmostEqual(found, known, delta=1e-3)
        # The same picture, but for a code here and there in the dark.
        fitted = {**BALL, "objects": [{"type": "sphere", "material": told["material"]}]}
        done = shade("diff", scene, self.scene("fitted.json", fitted), "--fail-above", "deltaE2000.p99=1")
        self.assertEqual(done.returncode, 0, done.stderr)

    def fit_own_picture(self, scene):
        path, photo = self.scene("own.json", scene), self.folder / "own.png"
        self.assertEqual(shade("render", path, "-o", photo).returncode, 0)
        done = shade("fit", photo, path)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def test_small_pictures_tell_how_well_a_highlight_is_known(self):
        """A highlight on a few pixels of 8 bits is known to its deviation, which is near 1e-3, and no better."""
        material = {**BALL["objects"][0]["material"], "shininess": 75}
        told = self.fit_own_picture({**BALL, "image": {"width": 96, "height": 72},
                                     "objects": [{"type": "sphere", "material": material}]})
        self.assertEqual(told["notIdentifiable"], [])
        for found, deviation in zip(told["specular"]["value"], told["specular"]["deviation"]):
            self.assertLess(abs(found - 0.25), 4 * deviation)
            self.assertLess(deviation, 2e-3)

    def test_without_a_light_the_sum_of_what_is_left_is_known(self):
        told = self.fit_own_picture({**BALL, "lights": []})
        self.assertEqual({doubt["term"] for doubt in told["notIdentifiable"]}, {"diffuse", "specular", "shininess"})
        for found, deviation in zip(told["constant"]["value"], told["constant"]["deviation"]):
            self.assertLess(abs(found - 0.06), 4 * deviation)
            self.assertLess(deviation, 1e-3)  # half a code of 8 bits is 0.001 of light there

    def test_a_shadow_on_most_of_it_spoils_nothing(self):
        told = self.fit_own_picture({**BALL, "lights": [{"type": "point", "position": [-4, 0, -1]}]})
        self.assertNotIn("diffuse", {doubt["term"] for doubt in told["notIdentifiable"]})
        for found, known, deviation in zip(told["diffuse"]["value"], (0.6, 0.3, 0.15), told["diffuse"]["deviation"]):
            self.assertLess(abs(found - known), 4 * deviation)
            self.assertLess(deviation, 3e-3)

    def test_messages_say_what_they_are_about(self):
        scene, photo = self.scene("ball.json", {**BALL, "image": {"width": 8, "height": 8}}), self.folder / "ball.webp"
        self.assertEqual(shade("render", scene, "-o", photo).returncode, 0)
        mirror = {**BALL, "image": {"width": 8, "height": 8}, "trace": {"depth": 1},
                  "objects": [{"type": "sphere", "material": {"reflection": 0.1}}]}
        checks = {"pattern": "checker", "colors": [[0, 0, 0], [1, 1, 1]]}
        around = {**mirror, "trace": {}, "lights": [{"type": "environment", "map": "sky"}],
                  "objects": [{"type": "sphere"}]}
        patterned = {**mirror, "trace": {}, "objects": [{"type": "sphere", "material": {"diffuse": checks}}]}
        for words, status, message in (
                ((photo, self.scene("large.json", BALL)), 1, f"{photo}: the picture has 8 x 8 pixels, not 64 x 48"),
                ((photo, scene, "--object", "bal"), 1,
                 '--object: no object has this name or number: did you mean "ball"?'),
                ((photo, self.scene("mirror.json", mirror)), 1, "--object: its material mirrors or lets light through"),
                ((photo, self.scene("patterned.json", patterned)), 1, "--object: its material has a pattern"),
                ((photo, self.scene("around.json", around)), 1, "/lights: light 0 is an environment"),
                ((self.folder / "no.webp", scene), 1, "no.webp: the file cannot be read"),
                ((self.folder / "ball.gif", scene), 2, "unknown suffix"),
                ((photo,), 2, "fit wants a photo and a scene, not 1"),
                ((photo, scene, "-o", "x"), 2, "fit writes to stdout")):
            done = shade("fit", *words)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertIn(message, done.stderr.decode())
        done = shade("check", scene, "--object", "ball")
        self.assertEqual((done.returncode, "--object is for fit" in done.stderr.decode()), (2, True))


class RequestTest(Folder):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--max-work", "1")
        cls.addClassCleanup(cls.daemon.stop)

    def put(self, scene, suffix, media_type):
        """A photo of the scene, and what it is named by."""
        path = self.folder / ("photo." + suffix)
        self.assertEqual(shade("render", self.file(json.dumps(scene), "scene.json"), "-o", path).returncode, 0)
        data = path.read_bytes()
        digest = hashlib.sha256(data).hexdigest()
        answer = self.daemon.call("PUT", "/v1/assets/" + digest, data, {"Content-Type": media_type})
        self.assertIn(answer.status, (201, 204))
        return path, "sha256-" + digest

    def problem(self, code, **document):
        answer = self.daemon.post("/v1/fit", document)
        self.assertEqual(answer.status, code, answer.body)
        return {error["pointer"]: error["detail"] for error in json.loads(answer.body)["errors"]}

    def test_it_tells_what_the_command_line_does(self):
        path, photo = self.put(BALL, "webp", "image/webp")
        answer = self.daemon.post("/v1/fit", {"scene": BALL, "photo": photo, "object": "ball"})
        self.assertEqual(answer.status, 200, answer.body)
        done = shade("fit", path, self.folder / "scene.json", "--object", "ball")
        self.assertEqual(json.loads(answer.body), json.loads(done.stdout))

    def test_mistakes_are_told_at_their_places(self):
        photo = self.put(BALL, "png", "image/png")[1]
        missing = self.problem(409, scene=BALL, photo="sha256-" + "0" * 64)
        self.assertIn("/photo", missing)
        wrong = self.problem(422, scene={**BALL, "lights": 3}, photo="x.png")
        self.assertEqual(set(wrong), {"/scene/lights", "/photo"})
        small = {**BALL, "image": {"width": 64, "height": 47}}
        self.assertEqual(self.problem(422, scene=small, photo=photo),
                         {"/photo": "the picture has 64 x 48 pixels, not 64 x 47"})
        self.assertIn("/object", self.problem(422, scene=BALL, photo=photo, object="bell"))
        for more, place in (({"spectral": True}, "/scene/spectral"),
                            ({"output": {"channel": "R"}}, "/scene/output/channel"),
                            ({"output": {"format": "exr"}}, "/scene/output")):
            self.assertIn(place, self.problem(422, scene={**BALL, **more}, photo=photo))
        self.assertIn("", self.problem(422, scene=BALL))
        # One picture of it would be admitted, but not 18 of nine terms, whatever the kernel.
        lights = [{"type": "point", "position": [i, 3, 3], "color": 0.001} for i in range(9000)]
        crowd = {**BALL, "lights": lights, "accuracy": {"tier": "exact"},
                 "image": {"width": 64, "height": 48, "samples": 1}}
        self.assertEqual(self.daemon.render(crowd).status, 200)
        self.assertIn("`work`", " ".join(self.problem(422, scene=crowd, photo=photo).values()))


if __name__ == "__main__":
    unittest.main()
