"""A white furnace: a sphere in an environment of radiance 1, made of point lights all around it.

What sends on all light, Lambert's surface for one, cannot be told from the environment. The mean radiance of the
sphere's picture, seen in parallel, is the mean share of light that its material sends on: the pixels of its disc are
the directions of the hemisphere by their projected solid angle. ENVIRONMENT is how far sums over the lights,
which stand on Fibonacci's lattice, are off their integrals, for the widths of lobes that are used here.
"""

import json
import math
import os
import subprocess
import unittest
from pathlib import Path

import numpy as np

from reference import models, program, scene

LIGHTS, FAR, SIZE = 4000, 1e4, 48
ENVIRONMENT = 2e-3
SHADE = Path(os.environ["SHADED_BUILD"]) / "shade"


def furnace():
    turn = math.pi * (3 - math.sqrt(5))
    lights = []
    for i in range(LIGHTS):
        height = 1 - (2 * i + 1) / LIGHTS
        across = math.sqrt(1 - height * height)
        # A light of the intensity I adds pi f_r N.L I: radiance 1 from d omega = 4 pi / LIGHTS.
        lights.append({"type": "point", "intensity": 4 / LIGHTS,
                       "position": [FAR * across * math.cos(i * turn), FAR * height, FAR * across * math.sin(i * turn)]})
    return lights


ROOM = furnace()
GRID = (2 * (np.arange(SIZE) + 0.5) / SIZE - 1) * 1.05
SQUARED = GRID[:, None] ** 2 + GRID[None, :] ** 2
DISC = SQUARED < 1


def shown(material):
    """[h][w][3]"""
    document = {"image": {"width": SIZE, "height": SIZE, "samples": 1}, "lights": ROOM, "background": None,
                "camera": {"type": "orthographic", "position": [0, 0, 5], "height": 2.1},
                "objects": [{"type": "sphere", "material": {"ambient": 0, "diffuse": 0, **material}}]}
    return program.rgb(program.linear(document))


def albedo(material):
    """The mean over directions of light of what `shade brdf` tells, by cosine."""
    document = {"objects": [{"type": "sphere", "material": {"ambient": 0, "diffuse": 0, **material}}]}
    told = json.loads(subprocess.run([SHADE, "brdf", "-"], input=json.dumps(document), text=True,
                                     capture_output=True, check=True).stdout)["materials"][0]["albedo"]
    angles = np.radians([*told["angles"], 90])
    values = np.array([*told["values"], told["values"][-1]])
    fine = np.linspace(0, math.pi / 2, 20001)
    weights = 2 * np.cos(fine) * np.sin(fine)
    return np.array([np.trapz(np.interp(fine, angles, values[:, c]) * weights, fine) for c in range(3)])


class Furnace(unittest.TestCase):
    def test_lambert_cannot_be_told_from_the_furnace(self):
        """Nor can a microgeometry of such facets, which send each other's light on until all of it has left."""
        for material in ({}, *({"model": "westin", "microgeometry": {"type": kind}}
                               for kind in ("grooves", "weave", "heightfield"))):
            with self.subTest(**material):
                np.testing.assert_allclose(shown({"diffuse": 1, **material})[DISC], 1, rtol=0, atol=ENVIRONMENT)

    def test_what_sends_on_all_light_is_as_bright_as_the_furnace(self):
        """On the whole: a lobe that is not reciprocal sends it to other directions than it comes from."""
        for material in ({"model": "phong-normalized", "specular": 1, "shininess": 0},
                         {"model": "phong-normalized", "specular": 1, "shininess": 6},
                         {"model": "phong-normalized", "specular": 1, "shininess": 40},
                         {"model": "phong-normalized", "specular": 0.6, "shininess": 11.5, "diffuse": 0.4},
                         {"model": "cook-torrance", "fresnel": {"f0": 1}, "lobes": [{"roughness": 0.3, "weight": 0}], "diffuse": 1}):
            with self.subTest(**material):
                mean = shown(material)[DISC].mean(axis=0)
                # Pixels stand for directions: sums of 1,580 of them are some 1e-3 off the integral.
                np.testing.assert_allclose(mean, 1, rtol=0, atol=5e-3)

    def test_facets_lose_what_meets_two_of_them(self):
        """Cook and Torrance's facets do not light each other: the rougher, the darker, never brighter."""
        before = 1.0
        for roughness in (0.2, 0.4, 0.8):
            material = {"model": "cook-torrance", "fresnel": {"f0": 1}, "lobes": [{"roughness": roughness, "weight": 1}]}
            mean = shown(material)[DISC].mean()
            self.assertLess(mean, before)
            self.assertAlmostEqual(mean, albedo(material)[0], delta=3e-3)
            before = mean

    def test_each_direction_is_an_integral_of_its_own(self):
        """The models' papers, integrated over the hemisphere of L."""
        # With half as many nodes sums differ by 1e-5 at most.
        x, w = np.polynomial.legendre.leggauss(64)
        turn = 2 * math.pi * (np.arange(128) + 0.5) / 128
        cosine, share = np.repeat((x + 1) / 2, 128), np.repeat(w / 2, 128) * (2 * math.pi / 128)
        sine, turns = np.sqrt(1 - cosine ** 2), np.tile(turn, 64)
        l = np.stack([sine * np.cos(turns), sine * np.sin(turns), cosine], axis=1)
        n = np.broadcast_to([0.0, 0.0, 1.0], l.shape)
        for document in ({"model": "phong-normalized", "specular": 1, "shininess": 6},
                         {"model": "blinn-phong", "specular": 0.5, "shininess": 12, "diffuse": 0.3},
                         {"model": "oren-nayar", "sigma": 40, "diffuse": 1},
                         {"model": "cook-torrance", "lobes": [{"roughness": 0.5, "weight": 1}]}):
            material = scene.Scene({"objects": [{"type": "sphere", "material": {"ambient": 0, "diffuse": 0, **document}}]}
                                   ).objects[0][2]
            picture = shown(document)
            for row, column in ((SIZE // 2, SIZE // 2), (SIZE // 2, SIZE // 4), (SIZE // 4, 2 * SIZE // 3), (SIZE // 2, 4)):
                square = SQUARED[row, column]
                v = np.broadcast_to([math.sqrt(square), 0, math.sqrt(1 - square)], l.shape)
                diffuse, lobes = models.weigh(material, n, l, v)
                value = (np.asarray(material.diffuse)[None, :] * diffuse[:, None] * share[:, None]).sum(axis=0) / math.pi
                for (color, _), lobe in zip(material.lobes, lobes):
                    lobe = lobe if lobe.ndim == 2 else lobe[:, None]
                    value = value + (np.asarray(color) * lobe * share[:, None]).sum(axis=0) / math.pi
                with self.subTest(row=row, column=column, **document):
                    np.testing.assert_allclose(picture[row, column], value, rtol=0, atol=2 * ENVIRONMENT)


if __name__ == "__main__":
    unittest.main()
