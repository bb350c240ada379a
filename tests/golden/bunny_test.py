"""The Stanford bunny: a mesh that nobody here made.

Its package comes through npm; without npm or a registry the test is skipped and says why.
"""

import json
import os
import shutil
import subprocess
import unittest

import numpy as np

from reference import phong, program

MAKE = os.path.join(program.SOURCE, "tests", "bunny", "make")


def bunny():
    for tool in ("npm", "node"):
        if not shutil.which(tool):
            raise unittest.SkipTest(f"{tool} is not installed")
    out = os.path.join(os.path.abspath(program.BUILD), "bunny.json")
    try:
        run = subprocess.run([MAKE, out], capture_output=True, text=True, check=False, timeout=500)
    except subprocess.TimeoutExpired as late:
        raise unittest.SkipTest("npm ci did not finish in 120 s") from late
    if run.returncode:
        raise unittest.SkipTest(f"npm ci failed: {run.stderr.strip()[-300:]}")
    with open(out, encoding="ascii") as file:
        return json.load(file)


class Bunny(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        try:
            cls.scene = bunny()
        except unittest.SkipTest as reason:
            print(f"skipped: {reason}")
            raise

    def at(self, size):
        return {**self.scene, "image": {"width": size, "height": size, "samples": 1},
                "background": None}

    def test_tiers_agree_and_the_mesh_has_no_holes(self):
        exact = program.linear(self.at(256), "exact")
        standard = program.linear(self.at(256), "standard")
        covered = exact["A"] > 0
        self.assertAlmostEqual(covered.mean(), 0.508, delta=0.01)
        self.assertLess(np.mean(covered != (standard["A"] > 0)), 1e-3)
        # row by row: no uncovered pixel has covered ones on all four sides
        inner = ~covered[1:-1, 1:-1] & covered[:-2, 1:-1] & covered[2:, 1:-1] \
            & covered[1:-1, :-2] & covered[1:-1, 2:]
        self.assertEqual(inner.sum(), 0)
        difference = np.abs(program.rgb(exact) - program.rgb(standard)).max(-1)
        difference[covered != (standard["A"] > 0)] = 0
        self.assertLessEqual(difference.max(), 1e-5 * program.rgb(exact).max())

    def test_picture_is_the_models(self):
        scene = self.at(48)
        expected = phong.render(scene)
        channels = program.linear(scene, "exact")
        error = np.abs(program.rgb(channels) - expected.rgb).max(-1)
        error[expected.silhouette] = 0
        self.assertLessEqual(expected.silhouette.mean(), 0.05)
        self.assertLessEqual(error.max(), 1e-6 * expected.rgb.max())


if __name__ == "__main__":
    unittest.main()
