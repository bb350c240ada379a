"""A background with an alpha: what it leaves of the picture, of its layers and of formats without alpha."""

import json
import os
import subprocess
import tempfile
import unittest

import numpy as np
import OpenImageIO as oiio

from reference import color, program

BACK, ALPHA = np.array([0.3, 0.05, 1.5]), 0.4
SCENE = {"image": {"width": 75, "height": 66, "samples": 5}, "lights": [{"type": "directional", "direction": [-1, -1, -2]}],
         "objects": [{"type": "sphere", "material": {"diffuse": [0.8, 0.3, 0.05], "specular": 0.4}},
                     {"type": "box", "transform": {"translate": [1, 0.8, -1], "rotate": [20, 30, 0]}}]}
SEEN = {**SCENE, "background": [*BACK, ALPHA]}
OUTPUTS = ({"format": "png"}, {"format": "tiff", "bitDepth": 16}, {"format": "exr", "bitDepth": "float"}, {"format": "jpeg"},
           {"format": "webp", "quality": 100}, {"format": "hdr"}, {"channel": "A"})


def shade(document, *outputs):
    """The files of a scene's outputs, by their names."""
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([os.path.join(program.BUILD, "shade"), "render", "-", "-o", folder + "/"],
                       input=json.dumps({**document, "outputs": list(outputs)}).encode(), capture_output=True,
                       check=True, timeout=500)
        files = {}
        for name in os.listdir(folder):
            with open(os.path.join(folder, name), "rb") as file:
                files[name.partition(".")[0]] = file.read()
        return files


def straight_codes(png):
    """OpenImageIO multiplies what it reads, unless it is asked not to."""
    asked = oiio.ImageSpec()
    asked.attribute("oiio:UnassociatedAlpha", 1)
    with tempfile.NamedTemporaryFile(suffix=".png") as file:
        file.write(png)
        file.flush()
        picture = oiio.ImageInput.open(file.name, asked)
        kind = {"uint8": oiio.UINT8, "uint16": oiio.UINT16}[str(picture.spec().format)]
        return np.asarray(picture.read_image(0, 0, 0, 4, kind), dtype=float)


class BackgroundAlpha(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        clear = program.linear({**SCENE, "background": None}, layers=["beauty", "diffuse", "depth"])
        cls.clear, cls.share = clear, clear["A"]
        cls.seen = program.linear(SEEN, layers=["beauty", "diffuse", "depth"])
        cls.premultiplied = program.rgb(clear) + ((1 - cls.share) * ALPHA)[..., None] * BACK
        cls.alpha = cls.share + (1 - cls.share) * ALPHA

    def test_it_is_laid_under_what_is_seen(self):
        """Porter and Duff's "over". Two f32 roundings of either side, and those of the file's product."""
        partly = (self.share > 0) & (self.share < 1)
        self.assertGreater(partly.sum(), 50)
        np.testing.assert_allclose(self.seen["A"], self.alpha, rtol=2e-7)
        np.testing.assert_allclose(program.rgb(self.seen), self.premultiplied, rtol=1e-6)
        nothing = self.share == 0
        self.assertGreater(nothing.sum(), 100)
        self.assertEqual(set(self.seen["A"][nothing]), {float(np.float32(ALPHA))})

    def test_layers_have_no_background(self):
        for name, values in self.clear.items():
            if name.startswith(("diffuse", "depth")):
                np.testing.assert_array_equal(self.seen[name], values, name)
            elif name.startswith("beauty"):
                np.testing.assert_allclose(self.seen[name], self.seen[name[-1]], rtol=3e-7)

    def test_png_is_straight(self):
        straight = self.premultiplied / self.alpha[..., None]
        for bits in (8, 16):
            top = 2 ** bits - 1
            got = straight_codes(program.shade({**SEEN, "output": {"format": "png", "bitDepth": bits}}))
            wanted = np.concatenate([np.clip(color.srgb_encode(straight), 0, 1), self.alpha[..., None]], -1) * top
            self.assertLessEqual(abs(got - wanted).max(), 0.5 + 0.02 * (bits == 16))

    def test_tiff_is_premultiplied(self):
        got, _ = program.read(program.shade({**SEEN, "output": {"format": "tiff", "bitDepth": 16}}), "tiff")
        wanted = np.clip(color.srgb_encode(self.premultiplied / self.alpha[..., None]), 0, 1) * self.alpha[..., None]
        self.assertLessEqual(abs(got[..., :3] - 65535 * wanted).max(), 1.5)
        self.assertLessEqual(abs(got[..., 3] - 65535 * self.alpha).max(), 0.5)

    def test_it_lies_over_the_matte_where_there_is_no_alpha(self):
        matte = np.array([0.1, 0.6, 0.9])
        over = list(ALPHA * BACK + (1 - ALPHA) * matte)
        for output in ({"format": "jpeg", "quality": 100}, {"format": "hdr"}):
            self.assertEqual(program.shade({**SEEN, "output": {**output, "matte": list(matte)}}),
                             program.shade({**SCENE, "background": over, "output": output}))
            self.assertEqual(program.shade({**SEEN, "output": output}),
                             program.shade({**SCENE, "background": list(ALPHA * BACK), "output": output}))
        # Beside an output that has alpha. Radiance has 8 bits of mantissa.
        files = shade(SEEN, {"name": "over", "format": "hdr", "matte": list(matte)}, {"name": "alpha", "format": "png"})
        got, _ = program.read(files["over"], "hdr")
        wanted = self.premultiplied + (1 - self.alpha)[..., None] * matte
        self.assertLess(abs(got - wanted).max(), wanted.max() / 128)
        self.assertEqual(files["alpha"], program.shade({**SEEN, "output": {"format": "png"}}))

    def test_regions_threads_and_neighbors_change_nothing(self):
        for samples in (1, 5):
            document = {**SEEN, "image": {**SEEN["image"], "samples": samples}}
            whole = program.rgb(program.linear(document))
            part = {**document, "image": {**document["image"], "region": [9, 5, 41, 47]}}
            np.testing.assert_array_equal(program.rgb(program.linear(part)), whole[5:52, 9:50])
            wanted = np.float32(BACK) * np.float32(ALPHA)
            np.testing.assert_array_equal(whole[0, 0], wanted)
            empty = program.rgb(program.linear({**document, "objects": []}))
            self.assertTrue((empty == wanted).all())

    def test_an_alpha_of_0_or_1_is_none(self):
        for output in OUTPUTS:
            for plain, others in ((None, ([1, 2, 3, 0], "transparent", "rgb(1 2 3 / 0)", "#12345600")),
                                  ([1, 0, 0], ([1, 0, 0, 1], "red", "#ff0000ff", "hsl(0 100% 50% / 1)"))):
                wanted = program.shade({**SCENE, "background": plain, "output": output})
                for other in others:
                    self.assertEqual(program.shade({**SCENE, "background": other, "output": output}), wanted, other)

    def test_alpha_in_css(self):
        self.assertEqual(program.shade({**SCENE, "background": "rgb(100% 0% 0% / 40%)"}),
                         program.shade({**SCENE, "background": [1, 0, 0, 0.4]}))
        # In another working space, and out of its gamut. OpenColorIO converts in f32.
        seen = program.linear({**SCENE, "objects": [], "background": "color(rec2020 0 1 0 / 0.25)", "workingSpace": "ACEScg"})
        wanted = [-0.5876411, 1.1328999, -0.1005789]  # Rec.2020's green in Rec.709, ITU-R BT.2087
        np.testing.assert_allclose(program.rgb(seen)[3, 3], 0.25 * np.array(wanted), atol=1e-4)
        self.assertEqual(seen["A"][3, 3], 0.25)

    def test_bounds_hold(self):
        for tier in ("draft", "standard"):
            for output in OUTPUTS[:3]:
                document = {**SEEN, "accuracy": {"tier": tier}, "output": output}
                told = json.loads(subprocess.run([os.path.join(program.BUILD, "shade"), "compare", "-"],
                                                 input=json.dumps(document).encode(), capture_output=True, check=True,
                                                 timeout=500).stdout)
                for entry in told["tiers"]:
                    self.assertLessEqual(entry["error"]["linear"]["max"], entry["bound"]["linear"], entry)
                    self.assertLessEqual(entry["error"]["code"]["max"], entry["bound"]["code"], entry)


if __name__ == "__main__":
    unittest.main()
