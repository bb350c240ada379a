"""exposure, looks, gamma, dither, matte and compression of outputs, beside their definitions."""

import json
import os
import subprocess
import tempfile
import unittest

import numpy as np
import OpenImageIO as oiio

from reference import color, program

SCENE = {"image": {"width": 136, "height": 128}, "background": [0.02, 0.1, 0.3],
         "lights": [{"type": "directional", "direction": [-1, -1, -2]}],
         "objects": [{"type": "sphere", "material": {"diffuse": [0.8, 0.3, 0.05], "specular": 0.4}}]}
LIGHT = {"format": "exr", "bitDepth": "float"}
EXR = ("none", "rle", "zip", "zips", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab")


def shade(*arguments, **scene):
    return subprocess.run([os.path.join(program.BUILD, "shade"), *arguments],
                          input=json.dumps({**SCENE, **scene}).encode(), capture_output=True,
                          check=True, timeout=500).stdout


def served(**scene):
    """What a daemon answers, which need not load OpenImageIO for each."""
    return program.shade({**SCENE, **scene})


class Adjust(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder, self.count = folder.name, 0

    def read(self, data, suffix):
        """Integers as codes. OpenImageIO keeps what it has read by name."""
        self.count += 1
        path = os.path.join(self.folder, f"{self.count}.{suffix}")
        with open(path, "wb") as file:
            file.write(data)
        buffer = oiio.ImageBuf(path)
        kind = {"uint8": oiio.UINT8, "uint16": oiio.UINT16}.get(str(buffer.spec().format), oiio.FLOAT)
        self.spec = buffer.spec()
        return np.asarray(buffer.get_pixels(kind), dtype=float)

    def picture(self, output, **scene):
        return self.read(served(output=output, **scene), output["format"])

    def test_exposure_multiplies_light(self):
        light = self.picture(LIGHT)
        for stops in (-3, 0.7, 2):
            there = self.picture({**LIGHT, "exposure": stops})
            np.testing.assert_allclose(there, light * 2 ** stops, rtol=4e-7)
            for bits, codes in ((8, 255), (16, 65535)):
                got = self.picture({"format": "png", "bitDepth": bits, "exposure": stops})
                v = np.clip(light * 2 ** stops, 0, 1)
                wanted = codes * np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)
                self.assertLessEqual(abs(got - wanted).max(), 0.55 if bits == 8 else 0.6)

    def test_exposure_of_layers_adds_up(self):
        layers = ["ambient", "diffuse", "specular"]
        plain = self.picture({**LIGHT, "layers": layers})
        np.testing.assert_allclose(self.picture({**LIGHT, "layers": layers, "exposure": 1}), 2 * plain,
                                   rtol=4e-7)

    def test_gamma_is_a_power_of_what_is_shown(self):
        shown = {**LIGHT, "display": "sRGB", "view": "Standard"}
        for gamma in (0.5, 2.2):
            np.testing.assert_allclose(self.picture({**shown, "gamma": gamma}),
                                       self.picture(shown) ** (1 / gamma), rtol=2e-6)

    def test_gamut_compression_is_aces_1_3(self):
        """The Academy's reference: distances from the largest channel of AP1, above thresholds, go
        through a curve that reaches 1 at the limits."""
        aces = {"workingSpace": "ACEScg", "colorSpace": "ACEScg", "lights": [], "objects": []}
        look = ["ACES 1.3 Reference Gamut Compression"]
        threshold = np.array([0.815, 0.803, 0.880])
        limit, power = np.array([1.147, 1.264, 1.312]), 1.2
        for color in ([0.8, 0.4, 0.1], [1, -0.1, 0.02], [-0.05, 0.7, 0.3], [0.3, 0.02, 2]):
            color = np.float64(np.float32(color))
            got = self.picture({**LIGHT, "colorSpace": "ACEScg", "looks": look}, background=list(color),
                               **aces)[0, 0]
            distance = (color.max() - color) / color.max()
            scale = (limit - threshold) / \
                (((1 - threshold) / (limit - threshold)) ** -power - 1) ** (1 / power)
            x = np.maximum(distance - threshold, 0) / scale
            wanted = np.where(distance < threshold, distance,
                              threshold + scale * x / (1 + x ** power) ** (1 / power))
            np.testing.assert_allclose(got, color.max() * (1 - wanted), atol=3e-6)
            plain = self.picture({**LIGHT, "colorSpace": "ACEScg", "looks": []}, background=list(color),
                                 **aces)[0, 0]
            np.testing.assert_allclose(plain, color, rtol=1e-6)

    def test_dither_is_less_than_a_code(self):
        shown = self.picture({**LIGHT, "display": "sRGB", "view": "Standard"})
        for output in ({"format": "png"}, {"format": "tiff", "bitDepth": 8}):
            got = self.picture({**output, "dither": True})
            self.assertLess(abs(got - 255 * np.clip(shown, 0, 1)).max(), 1)
            self.assertGreater(np.mean(got != np.rint(255 * shown)), 0.1)
        # A flat color that lies between codes k and k + 1 is both, in its proportions, in each 8 x 8.
        got = self.picture({"format": "png", "dither": True}, objects=[], background=0.2)
        value = 255 * (1.055 * 0.2 ** (1 / 2.4) - 0.055)
        blocks = got[:, :, 0].reshape(16, 8, 17, 8).mean((1, 3))
        self.assertLess(abs(blocks - value).max(), 1 / 64)
        self.assertTrue((got[:, :, 0] == got[:, :, 2]).all())

    def test_dither_leaves_codes(self):
        for code in (*range(0, 255, 15), 1, 2, 253, 254, 255):
            got = self.picture({"format": "png", "dither": True}, objects=[],
                               background="#" + 3 * f"{code:02x}", image={"width": 8, "height": 8})
            self.assertTrue((got == code).all(), code)

    def test_dither_knows_where_it_is(self):
        whole = self.picture({"format": "png", "dither": True})
        part = self.picture({"format": "png", "dither": True}, image={**SCENE["image"], "region": [13, 5, 50, 61]})
        self.assertTrue((part == whole[5:66, 13:63]).all())
        threads = shade("render", "-", "-o", "-", "--threads", "1", output={"format": "png", "dither": True})
        self.assertTrue((self.read(threads, "png") == whole).all())

    def test_matte_is_a_background(self):
        matte = [0.1, 0.6, 0.9]
        for output in ({"format": "jpeg", "quality": 100}, {"format": "hdr"}):
            self.assertEqual(served(background=None, output={**output, "matte": matte}),
                             served(background=matte, output=output))
        # Beside an output that has alpha.
        with tempfile.TemporaryDirectory() as folder:
            shade("render", "-", "-o", folder + "/", background=None, outputs=[
                {"name": "over", "format": "hdr", "matte": matte}, {"name": "alpha", "format": "png"}])
            over = oiio.ImageBuf(folder + "/over.hdr").get_pixels(oiio.FLOAT)
            self.assertEqual(oiio.ImageBuf(folder + "/alpha.png").spec().nchannels, 4)
        wanted = self.picture({"format": "hdr"}, background=matte)
        self.assertLess(abs(over - wanted).max(), wanted.max() / 128)  # 8 bits of mantissa

    def test_compressions_are_openexr_s(self):
        plain = self.picture(LIGHT)
        half = self.picture({"format": "exr", "bitDepth": "half"})
        for name in EXR:
            for output, wanted in ((LIGHT, plain), ({"format": "exr", "bitDepth": "half"}, half)):
                got = self.picture({**output, "compression": name})
                self.assertEqual(self.spec.getattribute("compression").split(":")[0], name)
                exact = name in EXR[:5] or (name == "pxr24" and output is not LIGHT) or \
                    (name in ("b44", "b44a") and output is LIGHT)
                self.assertLessEqual(abs(got - wanted).max(), 0 if exact else 0.1, name)

    def test_compressions_of_png_order_sizes(self):
        scenes = [{}, {"background": None}, {"objects": [
            {"type": "sphere", "radius": 0.1, "transform": {"translate": [i / 6 - 1, j / 6 - 1, 0]},
             "material": {"diffuse": [0.1 + i / 20, 0.9 - j / 20, 0.3], "specular": 0.5}}
            for i in range(13) for j in range(13)]}]
        for scene in scenes:
            for bits in (8, 16):
                files = {name: served(image={"width": 640, "height": 480}, **scene,
                                      output={"format": "png", "bitDepth": bits, "compression": name})
                         for name in ("fast", "default", "small")}
                plain = served(image={"width": 640, "height": 480}, **scene,
                               output={"format": "png", "bitDepth": bits})
                self.assertEqual(plain, files["default"])
                self.assertGreater(len(files["fast"]), len(files["default"]))
                self.assertGreater(len(files["default"]), (1.05 if bits == 8 else 1) * len(files["small"]))
                wanted = self.read(plain, "png")
                for data in files.values():
                    self.assertTrue((self.read(data, "png") == wanted).all())

    def test_bounds_hold(self):
        outputs = [{"exposure": e, **more} for e in (-4, 1.5, 6)
                   for more in ({}, {"display": "Rec.2020"}, {"colorSpace": "YIQ"}, {"gamma": 1.3},
                                {"looks": ["ACES 1.3 Reference Gamut Compression"]})]
        known = 0
        for output in outputs:
            for tier in json.loads(program.ask("/v1/compare", {**SCENE, "output": output}))["tiers"]:
                for metric in ("linear", "code", "deltaE2000"):
                    bound, error = tier["bound"][metric], tier["error"][metric]["max"]
                    if bound is not None:
                        known += metric != "linear"
                        self.assertLessEqual(error, bound, (output, tier["tier"], metric))
        self.assertGreater(known, len(outputs))

    def test_budgets_hold(self):
        lights = [{"type": "point", "position": [3 - k, 2, 3], "intensity": 0.5 ** k} for k in range(12)]
        for output in ({"exposure": 3}, {"exposure": -2, "dither": True}, {"exposure": 1, "gamma": 1.2},
                       {"looks": ["ACES 1.3 Reference Gamut Compression"]}):
            def picture(accuracy, **more):
                return self.picture({"format": "png", **output, **more}, lights=lights, accuracy=accuracy)

            budget = picture({"maxError": 3, "metric": "code"})
            self.assertLessEqual(abs(budget - picture({"tier": "exact"})).max(), 3, output)
            # What is displayed, before codes are rounded.
            shown = {"format": "exr", "bitDepth": "float", "display": "sRGB", "view": "Standard",
                     "dither": False}
            seen, exact = (color.lab(np.clip(color.srgb_decode(picture(accuracy, **shown)), 0, 1))
                           for accuracy in ({"maxError": 1, "metric": "deltaE2000"}, {"tier": "exact"}))
            self.assertLessEqual(color.delta_e_2000(seen, exact).max(), 1, output)


if __name__ == "__main__":
    unittest.main()
