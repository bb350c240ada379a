"""What would take long is refused before it is begun, and the limit is named."""

import json
import unittest

from e2e.daemon import SMALL, Daemon

LIGHTS = [{"type": "point", "position": [3, i, 3]} for i in range(5)]
SHINY = {"type": "sphere", "material": {"lobes": [{"specular": 0.1, "shininess": 5}]}}


class LimitsTest(unittest.TestCase):
    def assert_refused(self, daemon, scene, limit, pointer):
        answer = daemon.render(scene)
        problem = json.loads(answer.body)
        self.assertEqual((answer.status, problem["type"]), (422, "urn:shaded:problem:limit"))
        self.assertEqual([error["pointer"] for error in problem["errors"]], [pointer])
        self.assertIn(f"the limit `{limit}` is ", problem["errors"][0]["detail"])
        self.assertEqual(daemon.metrics()[f'shaded_refused_total{{limit="{limit}"}}'], 1)

    def test_samples_times_lights_times_terms(self):
        scene = {**SMALL, "lights": LIGHTS, "objects": [SHINY]}
        terms = 16 * 12 * 5 * 3  # diffuse light, `specular` and a lobe
        with Daemon("--max-light-samples", str(terms)) as daemon:
            self.assertEqual(daemon.render(scene).status, 200)
            self.assert_refused(daemon, {**scene, "image": {**SMALL["image"], "width": 17}},
                                "light-samples", "/lights")

    def test_objects_times_lights(self):
        scene = {**SMALL, "lights": LIGHTS, "objects": [{"type": "sphere"}] * 4}
        with Daemon("--max-object-lights", "20") as daemon:
            self.assertEqual(daemon.render(scene).status, 200)
            self.assert_refused(daemon, {**scene, "objects": [{"type": "sphere"}] * 5},
                                "object-lights", "/lights")

    def test_expected_work(self):
        image = {"width": 4096, "height": 4096, "samples": 16}
        with Daemon("--max-work", "1") as daemon:
            self.assertEqual(daemon.render(SMALL).status, 200)
            self.assert_refused(daemon, {**SMALL, "lights": 20 * LIGHTS, "image": image}, "work", "")

    def test_by_default_what_takes_minutes(self):
        image = {"width": 32, "height": 32, "samples": 64}
        lobes = [{"specular": 0.01, "shininess": 2 + i} for i in range(64)]
        shiny = {"type": "sphere", "material": {"specular": 0.1, "lobes": lobes}}
        with Daemon() as daemon:
            self.assert_refused(daemon, {"image": {**image, "width": 512, "height": 512},
                                         "lights": 2000 * LIGHTS, "objects": [shiny]},
                                "light-samples", "/lights")
            self.assert_refused(daemon, {"image": image, "lights": 2000 * LIGHTS,
                                         "objects": 2000 * [{"type": "box"}]},
                                "object-lights", "/lights")


if __name__ == "__main__":
    unittest.main()
