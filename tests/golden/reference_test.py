"""Pictures against the independent evaluation of the model (tests/reference).

Each scene is rendered as linear float EXR and compared sample by sample:
  exact tier:    error <= 1e-6 of the picture's largest value,
  standard tier: error <= 1e-5 of it, for shininess <= 1000,
away from silhouette pixels as reference/phong.py defines them; a scene whose silhouette pixels
are more than their share allows fails too, so that nothing hides there.

SHADED_SEED changes the random scenes; a failure names the seed.
"""

import os
import unittest
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import reference_scenes
from reference import phong, program

EXACT, STANDARD = 1e-6, 1e-5
MOST_SILHOUETTE = 0.06  # of all pixels, for one sample a pixel; measured: 0.03 at most
RANDOM_SCENES = 14
SEED = int(os.environ.get("SHADED_SEED", "1975"))


def scenes():
    yield from reference_scenes.by_hand()
    yield from reference_scenes.beyond_vectors()
    yield from reference_scenes.further_models()
    for i in range(RANDOM_SCENES):
        yield f"seed_{SEED + i}", reference_scenes.by_seed(SEED + i)


def tiers(name):
    """Mirrored shapes differ in what is seen, which the tiers share."""
    exact_only = name == "shininess_extreme" or name.startswith(("mirrored_", "model_"))
    return ["exact"] if exact_only else ["exact", "standard"]


SCENES = dict(scenes())
WORKERS = ThreadPoolExecutor(2)
RENDERED = {}
WORST = {}


def setUpModule():
    for name, document in SCENES.items():
        for tier in tiers(name):
            RENDERED[name, tier] = WORKERS.submit(program.linear, document, tier)


def tearDownModule():
    WORKERS.shutdown()
    for tier, (error, name) in sorted(WORST.items()):
        print(f"largest error of the {tier} tier: {error:.2e} of the maximum ({name})")


class Reference(unittest.TestCase):
    def check(self, name):
        document = SCENES[name]
        expected = phong.render(document)
        inside = ~expected.silhouette
        share = MOST_SILHOUETTE * document["image"]["samples"]
        self.assertLessEqual(expected.silhouette.mean(), share)
        largest = np.abs(expected.rgb).max()
        for tier in tiers(name):
            channels = RENDERED[name, tier].result()
            error = np.abs(program.rgb(channels) - expected.rgb).max(-1) / (largest or 1)
            error = np.where(inside, np.nan_to_num(error, nan=np.inf), 0)
            row, column = np.unravel_index(error.argmax(), error.shape)
            WORST[tier] = max(WORST.get(tier, (0, "")), (error.max(), name))
            with self.subTest(tier=tier):
                self.assertLessEqual(
                    error.max(), EXACT if tier == "exact" else STANDARD,
                    f"at pixel ({column}, {row}): "
                    f"{[channels[c][row, column] for c in 'RGB']} instead of "
                    f"{expected.rgb[row, column].tolist()}; {np.sum(error > EXACT)} pixels "
                    f"differ by more than {EXACT}")
                alpha = channels.get("A", np.ones(expected.alpha.shape))
                wanted = expected.alpha if document.get("background", 0) is None else 1
                np.testing.assert_allclose(np.where(inside, alpha - wanted, 0), 0, atol=1e-6)


def claim(name):
    return lambda self: self.check(name)


for scene_name in SCENES:
    setattr(Reference, f"test_{scene_name}", claim(scene_name))


if __name__ == "__main__":
    unittest.main()
