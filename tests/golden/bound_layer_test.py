"""The layer `bound` of EXR: no pixel is farther from the model than it says, and none of it is above
the bound that Shaded-Plan tells of the whole picture.

The model is that of tests/reference, in f64 and apart from our sources, away from silhouettes. Its
own rounding is allowed for with REFERENCE of the picture's largest value.
"""

import re
import unittest

import numpy as np

import reference_scenes
from reference import phong, program

REFERENCE = 1e-12
ROUNDED = 1 + 1e-6  # the layer holds f32, rounded up
# Rays between mirrors spread what rounding does to them, beyond f32's last digit after some steps.
MIRRORS = {"image": {"width": 120, "height": 90, "samples": 2}, "background": [0.1, 0.2, 0.3],
           "trace": {"depth": 14, "minContribution": 1e-9},
           "lights": [{"position": [3, 4, 5, 1]}],
           "objects": [*({"type": "sphere", "radius": 0.62, "transform": {"translate": at},
                          "material": {"reflection": 0.97, "diffuse": 0.2, "specular": 0.5}}
                         for at in ([0.75, 0.125, 0.25], [-0.75, -0.25, 0.125], [0, 1.25, -0.25], [0, 0.25, -1.25])),
                       {"type": "plane", "material": {"diffuse": 0.4}, "transform": {"translate": [0, -1, 0]}}]}


def bounded(document, accuracy):
    """The linear picture, its bounds, and what the plan tells."""
    output = {"format": "exr", "bitDepth": "float", "colorSpace": "lin_rec709", "layers": ["beauty", "bound"]}
    answer = program._daemon().render({**document, "accuracy": accuracy, "output": output})
    if answer.status != 200:
        raise AssertionError(answer.body.decode()[:1000])
    samples, names = program.read(answer.body, "exr")
    told = re.search("error<=([0-9.e+-]+) linear", answer.headers["Shaded-Plan"])
    picture = samples[..., [names.index(c) for c in "RGB"]]
    return picture, samples[..., names.index("bound.error")], float(told[1]) if told else np.inf


class BoundLayer(unittest.TestCase):
    def check(self, errors, bounds, told, seen):
        self.assertTrue((errors.max(-1) <= bounds)[seen].all(), (errors.max(-1) - bounds)[seen].max())
        self.assertLessEqual(bounds.max(), told * ROUNDED)
        self.assertTrue((bounds >= 0).all())

    def test_against_an_independent_evaluation(self):
        scenes = [(name, document) for name, document in reference_scenes.by_hand()
                  if name != "shininess_extreme"]
        scenes += [(f"seed {seed}", reference_scenes.by_seed(seed)) for seed in (11, 12, 13)]
        tighter = 0
        for name, document in scenes:
            document = {k: v for k, v in document.items() if k not in ("accuracy", "output")}
            reference = phong.render(document)
            for tier in "exact", "standard":
                with self.subTest(scene=name, tier=tier):
                    picture, bounds, told = bounded(document, {"tier": tier})
                    slack = REFERENCE * np.abs(reference.rgb).max()
                    self.check(np.abs(picture - reference.rgb) - slack, bounds, told, ~reference.silhouette)
                    tighter += np.median(bounds) < 0.5 * told
        self.assertGreater(tighter, len(scenes) / 2)

    def test_lights_that_a_budget_leaves_out_count(self):
        lights = [{"position": [5 * np.cos(i), 5 * np.sin(i), 4, 1], "intensity": 0.03, "attenuation": [1, 0, 1]}
                  for i in range(40)]
        document = {"image": {"width": 64, "height": 48, "samples": 1},
                    "lights": [{"position": [2, 3, 4, 1]}, *lights],
                    "objects": [{"type": "torus", "material": {"specular": 0.3}}]}
        exact, rest, _ = bounded(document, {"tier": "exact"})
        for budget in {"maxError": 0.01, "metric": "linear"}, {"maxError": 0.5}:
            picture, bounds, told = bounded(document, budget)
            self.check(np.abs(picture - exact), bounds + rest, told + rest.max(), np.ones_like(rest, bool))
            self.assertGreater(np.abs(picture - exact).max(), 0)

    def test_nothing_is_exact(self):
        picture, bounds, _ = bounded({"objects": [{"type": "sphere"}], "image": {"width": 32, "height": 32}}, {"tier": "standard"})
        self.assertEqual(bounds[0, 0], 0)
        self.assertGreater(bounds[16, 16], 0)

    def test_each_path_has_its_own(self):
        picture, bounds, told = bounded(MIRRORS, {"tier": "exact"})
        self.assertLessEqual(bounds.max(), told * ROUNDED)
        self.assertLess(np.quantile(bounds, 0.9), 1e-3 * told)
        # The same far away, at coordinates that f64 has: rounding is larger there, and the model is the same.
        by = np.array([2.0 ** 22, -2.0 ** 21, 2.0 ** 22])
        lamp = [*(np.array(MIRRORS["lights"][0]["position"][:3]) + by), 1]
        objects = [{**one, "transform": {"translate": list(by + one.get("transform", {}).get("translate", [0, 0, 0]))}}
                   for one in MIRRORS["objects"]]
        moved = {**MIRRORS, "objects": objects, "lights": [{"position": lamp}],
                 "camera": {"position": list(by + [0, 0, 4]), "target": list(by)}}
        other, others, _ = bounded(moved, {"tier": "exact"})
        errors = np.abs(picture - other).max(-1)
        self.assertGreater(errors.max(), 0)
        self.assertTrue((errors <= bounds + others).all(), (errors - bounds - others).max())


if __name__ == "__main__":
    unittest.main()
