"""Budgets hold where tiles leave lights out: their share of a light that falls off counts as what is
left of it."""

import math
import unittest

import numpy as np

from reference import program


def lit_from_afar(far, weak, accuracy):
    """A sphere under one lamp of radiance 1, which falls off, and many that hardly count."""
    lamp = {"type": "point", "position": [0, 0, far], "intensity": far ** 2, "attenuation": [0, 0, 1]}
    return {"image": {"width": 64, "height": 48, "samples": 1}, "accuracy": accuracy,
            "objects": [{"type": "sphere", "material": {"diffuse": 0.6}}],
            "lights": [lamp] + [
                {"type": "point", "position": [6 * math.sin(i), 6 * math.cos(i), 4],
                 "intensity": weak * (1 + 0.01 * i)} for i in range(60)]}


def picture(document):
    """Its linear samples, and the bound that is told of it."""
    output = {"format": "exr", "bitDepth": "float", "colorSpace": "lin_rec709"}
    answer = program._daemon().render({**document, "output": output})
    samples, names = program.read(answer.body, "exr")
    bound = answer.headers["Shaded-Plan"].partition("error<=")[2].partition(" linear")[0]
    return np.stack([samples[..., names.index(c)] for c in "RGB"], -1), float(bound)


class LeftOut(unittest.TestCase):
    def test_what_tiles_leave_out_is_within_what_is_told(self):
        for far in (10, 40):
            for weak in (0.02, 0.003, 0.0005):
                exact, _ = picture(lit_from_afar(far, weak, {"tier": "exact"}))
                all_of_it, _ = picture(lit_from_afar(far, weak, {"tier": "standard"}))
                errors = []
                for budget in (0.5, 2, 6):
                    with self.subTest(far=far, weak=weak, budget=budget):
                        told, bound = picture(lit_from_afar(far, weak, {"maxError": budget}))
                        errors.append(np.abs(told - exact).max())
                        self.assertLessEqual(errors[-1], bound)
                # Something is left out, or there was nothing to test.
                if weak < 0.01:
                    self.assertGreater(max(errors), 10 * np.abs(all_of_it - exact).max())


if __name__ == "__main__":
    unittest.main()
