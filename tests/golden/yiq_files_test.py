"""Integer files of YIQ are what OpenColorIO's own tools take for it: ocioconvert and OpenImageIO
read them as the spaces `YIQ file`, and write the same codes."""

import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from reference import program

CONFIG = Path(program.SOURCE, "config", "shaded.ocio")
SPACES = ("YIQ", "YIQ linear", "YIQ FCC 1953", "YIQ SMPTE 170M")
LEVELS = (0, 0.002, 0.05, 0.2140411, 0.7, 1)
SIDE = 36  # 6^3 colors, each a square of the corners, edges and inside of the RGB cube


def chart():
    """Boxes that face the camera and emit, one a pixel."""
    colors = [(r, g, b) for r in LEVELS for g in LEVELS for b in LEVELS]
    boxes = [{"type": "box", "material": {"emissive": list(rgb), "diffuse": 0},
              "transform": {"translate": [i % SIDE - (SIDE - 1) / 2, i // SIDE - 2.5, 0]}}
             for i, rgb in enumerate(colors)]
    return {"image": {"width": SIDE, "height": 6, "samples": 1}, "lights": [], "objects": boxes,
            "camera": {"type": "orthographic", "position": [0, 0, 9], "height": 6}}


class YiqFiles(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp()
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.document = chart()

    def ours(self, name, suffix, **output):
        path = os.path.join(self.folder, f"{name}.{suffix}")
        Path(path).write_bytes(program.shade({**self.document, "output": {"format": suffix, **output}}))
        return path

    def codes(self, path):
        samples, _ = program.read(Path(path).read_bytes(), Path(path).suffix[1:])
        return samples[..., :3]

    def ocioconvert(self, path, source, target, suffix="png"):
        out = os.path.join(self.folder, f"{len(os.listdir(self.folder))}.{suffix}")
        subprocess.run(["ocioconvert", path, source, out, target], check=True, capture_output=True,
                       env={**os.environ, "OCIO": str(CONFIG)}, timeout=500)
        return self.codes(out)

    def pictures(self):
        """Of each space with an inverse that 8 bits do not coarsen: linear light bands in the dark."""
        for bits in 8, 16:
            rgb = self.codes(self.ours(f"rgb{bits}", "png", bitDepth=bits, colorSpace="sRGB"))
            for space in SPACES:
                name = f"{space}{bits}".replace(" ", "")
                yiq = self.ours(name, "png", bitDepth=bits, colorSpace=space)
                with self.subTest(space=space, bits=bits):
                    yield bits, space, yiq, rgb if space != "YIQ linear" else None

    @unittest.skipUnless(shutil.which("ocioconvert"), "opencolorio-tools is not installed")
    def test_ocioconvert_reads_and_writes_the_same_codes(self):
        light = self.ours("light", "exr", bitDepth="float", colorSpace="lin_rec709")
        for bits, space, yiq, rgb in self.pictures():
            there = self.ocioconvert(light, "lin_rec709", f"{space} file", "exr") * (2 ** bits - 1)
            self.assertLessEqual(np.abs(there - self.codes(yiq)).max(), 0.5 + 0.02 * (bits // 8))
            self.assertGreaterEqual(self.codes(yiq)[..., 1:].min(), 1)
            if rgb is None:
                continue
            # Half a code of each channel, by an inverse matrix whose rows sum up to 2.8.
            back = self.ocioconvert(yiq, f"{space} file", "sRGB")
            self.assertLessEqual(np.abs(back - rgb).max(), 2)
            grey = (rgb == rgb[..., :1]).all(-1)
            self.assertGreater(grey.sum(), 5)
            self.assertEqual({*self.codes(yiq)[grey, 1:].ravel()}, {128 if bits == 8 else 32896})
            np.testing.assert_array_equal(back[grey], rgb[grey])

    def test_openimageio_reads_and_writes_the_same_codes(self):
        light = oiio.ImageBuf(self.ours("light", "exr", bitDepth="float", colorSpace="lin_rec709"))

        def convert(picture, source, target):
            done = oiio.ImageBufAlgo.colorconvert(picture, source, target, unpremult=False,
                                                  context_key="", context_value="",
                                                  colorconfig=str(CONFIG))
            self.assertFalse(done.has_error, done.geterror())
            return done.get_pixels(oiio.FLOAT)[..., :3].astype(np.float64)

        for bits, space, yiq, rgb in self.pictures():
            top = 2 ** bits - 1
            there = convert(light, "lin_rec709", f"{space} file") * top
            self.assertLessEqual(np.abs(there - self.codes(yiq)).max(), 0.5 + 0.02 * (bits // 8))
            if rgb is not None:
                back = convert(oiio.ImageBuf(yiq), f"{space} file", "sRGB") * top
                self.assertLessEqual(np.abs(back - rgb).max(), 2.5)

    def test_one_number_is_grey(self):
        for space in SPACES:
            scene = {"image": {"width": 2, "height": 2, "samples": 1}, "objects": [],
                     "background": 0.2, "colorSpace": f"{space} file"}
            codes = program.codes(scene)
            self.assertEqual({*codes.ravel()}, {124 if space == "YIQ linear" else 51}, space)


if __name__ == "__main__":
    unittest.main()
