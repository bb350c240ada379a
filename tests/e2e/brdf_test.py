"""POST /v1/brdf and `shade brdf` from outside: figures against closed forms, forms, refusals."""

import json
import math
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as xml
from pathlib import Path

from e2e.daemon import BUILD, Daemon

SHADE = str(BUILD / "shade")


def scene(*materials):
    return {"objects": [{"type": "sphere", "material": material} for material in materials]}


class Http(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def told(self, *materials):
        answer = self.daemon.post("/v1/brdf", scene(*materials))
        self.assertEqual(answer.status, 200, answer.body)
        return json.loads(answer.body)["materials"]

    def test_lambert_is_kd_over_pi_everywhere(self):
        told, = self.told({"diffuse": [0.5, 0.25, 0]})
        for one in told["samples"]:
            for value in one["values"]:
                self.assertAlmostEqual(value[0], 0.5 / math.pi, 11)
        for value in told["albedo"]["values"]:
            self.assertAlmostEqual(value[0], 0.5, 10)
            self.assertAlmostEqual(value[1], 0.25, 10)
            self.assertEqual(value[2], 0)
        self.assertIn("is reciprocal", told["verdict"])
        self.assertIsNone(told["gainsEnergyAbove"])
        self.assertFalse(told["unbounded"])

    def test_phong_has_its_closed_form_and_no_limit(self):
        n, ks = 20, 0.5
        told, = self.told({"diffuse": 0, "specular": ks, "shininess": n})
        # From straight above f_r is ks (N.V)^n / pi: its albedo is 2 ks / (n + 2).
        self.assertAlmostEqual(told["albedo"]["values"][0][0], 2 * ks / (n + 2), 10)
        at = {one["light"]: dict(zip(one["views"], one["values"])) for one in told["samples"]}
        for light in (30, 60):
            for view in (0, 20, 60):
                rv = math.cos(math.radians(view - light))
                expected = ks * rv ** n / math.pi / math.cos(math.radians(light))
                self.assertAlmostEqual(at[light][view][0], expected, 11)
        self.assertTrue(told["unbounded"])
        self.assertGreater(told["reciprocity"]["residual"], 0.5)

    def test_phong_gains_energy_above_an_angle(self):
        told, = self.told({"diffuse": 0.5, "specular": 0.9, "shininess": 5})
        above = told["gainsEnergyAbove"]
        angles, values = told["albedo"]["angles"], told["albedo"]["values"]
        self.assertTrue(all((value[0] > 1) == (angle > above) for angle, value in zip(angles, values)))
        self.assertRegex(told["verdict"][0], f"^gains energy above {above:.4g} degrees")

    def test_normalized_phong_sends_on_its_specular_from_any_angle(self):
        for told in self.told(*({"model": "phong-normalized", "diffuse": 0, "specular": 0.7, "shininess": n}
                                for n in (0, 3.5, 200))):
            for value in told["albedo"]["values"]:
                self.assertAlmostEqual(value[0], 0.7, 8)

    def test_a_spectral_scene_has_the_colors_of_rgb_under_d65(self):
        """Lifted colors make the round trip, in every term: lobes have reflectances of their own."""
        for material in ({"diffuse": [0.2, 0.1, 0.05], "specular": [0.5, 0.1, 0.1], "shininess": 5,
                          "lobes": [{"specular": [0.05, 0.1, 0.4], "shininess": 9}]},
                         {"model": "cook-torrance", "diffuse": [0.1, 0.3, 0.2], "fresnel": {"n": 1.6},
                          "lobes": [{"roughness": 0.2, "weight": 0.3}, {"roughness": 0.5, "weight": 0.6}]}):
            told = []
            for spectral in (False, True):
                scene = {"spectral": spectral, "objects": [{"type": "sphere", "material": material}]}
                told.append(json.loads(self.daemon.post("/v1/brdf", scene).body)["materials"][0])
            for plain, lifted in zip(told[0]["albedo"]["values"], told[1]["albedo"]["values"]):
                for a, b in zip(plain, lifted):
                    self.assertAlmostEqual(a, b, delta=1e-9)

    def test_every_material_is_told_once(self):
        told = self.told("brass", "gold", "brass", {"preset": "measured-gold"})
        self.assertEqual([one["material"] for one in told], ["brass", "gold", ""])
        self.assertEqual([one["model"] for one in told], ["phong", "phong", "cook-torrance"])

    def test_accept_chooses_the_form(self):
        for accept, kind in ((None, "application/json"), ("*/*", "application/json"),
                             ("image/*", "image/svg+xml"), ("image/png", "image/png"),
                             ("image/svg+xml;q=0.5, image/png", "image/png")):
            answer = self.daemon.post("/v1/brdf", scene("brass"), {"Accept": accept} if accept else None)
            self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, kind))
        self.assertTrue(answer.body.startswith(b"\x89PNG"))
        answer = self.daemon.post("/v1/brdf", scene("brass"), {"Accept": "image/svg+xml"})
        self.assertTrue(xml.fromstring(answer.body).tag.endswith("svg"))
        self.assertEqual(self.daemon.post("/v1/brdf", scene("brass"), {"Accept": "text/html"}).status, 406)

    def test_mistakes_have_their_pointers(self):
        answer = self.daemon.post("/v1/brdf", scene({"model": "oren-nayar", "sigma": 100}))
        self.assertEqual(answer.status, 422)
        self.assertEqual(json.loads(answer.body)["errors"][0]["pointer"], "/objects/0/material/sigma")


class Command(unittest.TestCase):
    def shade(self, *arguments, text=None):
        return subprocess.run([SHADE, "brdf", "-", *arguments], input=text or json.dumps(scene("gold")),
                              capture_output=True, text=True, check=False)

    def test_the_suffix_is_the_form(self):
        with tempfile.TemporaryDirectory() as folder:
            for suffix, begin in (("svg", b"<"), ("png", b"\x89PNG"), ("json", b"{")):
                path = Path(folder, "lobe." + suffix)
                done = self.shade("-o", str(path))
                self.assertEqual((done.returncode, done.stderr), (0, ""))
                self.assertTrue(path.read_bytes().startswith(begin))
        self.assertEqual(json.loads(self.shade().stdout)["materials"][0]["material"], "gold")

    def test_a_wrong_scene_is_refused(self):
        done = self.shade(text="{}")
        self.assertEqual(done.returncode, 1)
        self.assertIn("objects", done.stderr)


if __name__ == "__main__":
    unittest.main()
