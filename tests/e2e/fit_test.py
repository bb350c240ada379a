"""shade fit: what a picture of a scene tells of a material."""

import json
import subprocess
import unittest

from e2e.daemon import BUILD, environment
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

    def test_messages_say_what_they_are_about(self):
        scene, photo = self.scene("ball.json", {**BALL, "image": {"width": 8, "height": 8}}), self.folder / "ball.webp"
        self.assertEqual(shade("render", scene, "-o", photo).returncode, 0)
        mirror = {**BALL, "image": {"width": 8, "height": 8}, "trace": {"depth": 1},
                  "objects": [{"type": "sphere", "material": {"reflection": 0.1}}]}
        for words, status, message in (
                ((photo, self.scene("large.json", BALL)), 1, f"{photo}: the picture has 8 x 8 pixels, not 64 x 48"),
                ((photo, scene, "--object", "bal"), 1, '--object: no object has this name or number: did you mean "ball"?'),
                ((photo, self.scene("mirror.json", mirror)), 1, "--object: its material mirrors or lets light through"),
                ((self.folder / "no.webp", scene), 1, "no.webp: the picture cannot be read as webp"),
                ((self.folder / "ball.gif", scene), 2, "unknown suffix"),
                ((photo,), 2, "fit wants a photo and a scene, not 1"),
                ((photo, scene, "-o", "x"), 2, "fit writes to stdout")):
            done = shade("fit", *words)
            self.assertEqual(done.returncode, status, done.stderr)
            self.assertIn(message, done.stderr.decode())
        done = shade("check", scene, "--object", "ball")
        self.assertEqual((done.returncode, "--object is for fit" in done.stderr.decode()), (2, True))


if __name__ == "__main__":
    unittest.main()
