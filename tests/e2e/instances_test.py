"""One mesh many times: the same bytes as once, the memory of one, and a limit of triangles that counts it once."""

import json
import math
import unittest

from daemon import Daemon

TEAPOT = 25760  # triangles
SIZE = {"width": 96, "height": 72, "samples": 4}


def teapot(x, z, **more):
    return {"type": "teapot", "material": "clay",
            "transform": {"scale": 0.5, "rotate": [0, 37 * x + 11 * z, 0], "translate": [x, 0, z]}, **more}


def scene(objects, **more):
    return {"image": SIZE, "camera": {"position": [0, 2, 4], "target": [0, 0, 0]}, "ambient": 0.1,
            "materials": {"clay": {"diffuse": [0.6, 0.3, 0.2], "specular": 0.4, "shininess": 30}},
            "lights": [{"type": "directional", "direction": [-1, -2, -1]}, {"type": "point", "position": [3, 3, 3]}], "objects": objects, **more}


class InstancesTest(unittest.TestCase):
    def setUp(self):
        # 1,000 views of the teapot's vertices alone would take 600 MB.
        self.daemon = self.enterContext(Daemon("--max-memory", "48M", "--reuse", "0", "--response-cache", "0"))

    def render(self, document):
        reply = self.daemon.render(document)
        self.assertEqual(reply.status, 200, reply.body[:500])
        return reply

    def test_the_last_of_many_is_what_it_is_alone(self):
        """So many are behind the camera that the vertices of what is seen are found for each triangle."""
        hidden = [teapot(0, 10 + 3 * i) for i in range(120)]
        seen = [teapot(-0.6, 0), teapot(0.7, -0.5)]
        for more in ({}, {"accuracy": {"tier": "exact"}}, {"camera": {"type": "orthographic", "height": 3, "position": [0, 2, 4]}},
                     {"trace": {"shadows": True}}):
            with self.subTest(more=more):
                alone, many = self.render(scene(seen, **more)), self.render(scene(hidden + seen, **more))
                self.assertEqual(alone.body, many.body)
        mirrored = {**seen[0], "transform": {"scale": [-0.5, 0.7, 0.5], "translate": [-0.5, 0, 0]}}
        self.assertEqual(self.render(scene([mirrored])).body, self.render(scene([*hidden, mirrored])).body)

    def test_a_thousand_take_the_memory_of_one(self):
        side = math.isqrt(1000) + 1
        many = [teapot(i % side - side / 2, -(i // side)) for i in range(1000)]
        reply = self.render(scene(many))
        self.assertRegex(reply.headers["Shaded-Plan"], "error<=")
        shadowed = scene(many[:200], trace={"shadows": True}, image={"width": 24, "height": 18, "samples": 1})
        self.assertRegex(self.render(shadowed).headers["Shaded-Plan"], "error<=")

    def test_triangles_count_once(self):
        with Daemon("--max-triangles", str(2 * TEAPOT)) as daemon:
            self.assertEqual(daemon.render(scene([teapot(i, 0) for i in range(5)])).status, 200)
            two = [teapot(0, 0), {"type": "ball", "material": "clay"}]
            self.assertEqual(daemon.render(scene(two)).status, 200)
            faceted = [teapot(i, 0, interpolation="flat") for i in range(3)]
            reply = daemon.render(scene(faceted))
            self.assertEqual(reply.status, 422)
            self.assertIn(f"the scene asks for {3 * TEAPOT} triangles; the limit `triangles` is {2 * TEAPOT}",
                          json.loads(reply.body)["detail"])


if __name__ == "__main__":
    unittest.main()
