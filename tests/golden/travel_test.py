"""The examples look the same, within one code, under other houses' configurations: numbers are
linear Rec.709, `#rrggbb` is sRGB, and YIQ and HSV are there.

configs/ has the ACES CG and studio configurations v1.0.0 for OpenColorIO 2.1, as OpenColorIO's
sources have them (src/OpenColorIO/builtinconfigs/configs; BSD-3-Clause, Copyright Contributors to
the OpenColorIO Project). elsewhere.ocio is a small one of our own."""

import io
import json
import os
import subprocess
import unittest
from pathlib import Path

import numpy as np
from PIL import Image, ImageCms

from e2e.daemon import Daemon
from e2e.render_test import parts
from reference import program

EXAMPLES = Path(program.SOURCE, "api", "examples")
ELSEWHERE = Path(__file__).with_name("elsewhere.ocio")
CONFIGURATIONS = [ELSEWHERE, *sorted(Path(__file__).with_name("configs").glob("*.ocio"))]
SPACES = ("srgb_tx", "YIQ", "HSV")


def read(picture):
    return np.asarray(Image.open(io.BytesIO(picture)), dtype=int)


class Daemons(unittest.TestCase):
    """A daemon for each configuration, which takes long to read, and one for the built-in one (None)."""

    @classmethod
    def setUpClass(cls):
        cls.daemons = {None: cls.start()}

    @classmethod
    def start(cls, *options):
        daemon = Daemon("--log-requests", "off", *options)
        cls.addClassCleanup(daemon.stop)
        return daemon

    def daemon(self, configuration):
        if configuration not in self.daemons:
            self.daemons[configuration] = self.start("--ocio", str(configuration))
        return self.daemons[configuration]

    def render(self, document, configuration=None):
        answer = self.daemon(configuration).render(document)
        self.assertEqual(answer.status, 200, answer.body[:1000])
        return answer

    def pictures(self, document, color_spaces, configuration=None):
        """A small picture in each space."""
        outputs = [{"name": str(i), "format": "png", **space} for i, space in enumerate(color_spaces)]
        answer = self.render({**document, "outputs": outputs}, configuration)
        return [read(part.get_payload(decode=True)) for part in parts(answer)]


class Travel(Daemons):
    def same(self, document, spaces, elsewhere, hue=False):
        document = {name: value for name, value in document.items()
                    if name not in ("output", "outputs")}
        document["workingSpace"] = "lin_rec709"
        document["image"] = {**document.get("image", {}), "width": 96, "height": 64, "samples": 1}
        here = self.pictures(document, spaces)
        for configuration in CONFIGURATIONS:
            there = self.pictures(document, elsewhere, configuration)
            for space, one, other in zip(spaces, here, there):
                away = np.abs(one - other)
                if space.get("colorSpace") == "HSV":
                    # A hue turns by rounding where there is next to none, and wraps at red.
                    away[..., 0] = np.minimum(away[..., 0], 255 - away[..., 0])
                    away[..., 0] *= one[..., 1] * one[..., 2] > 16 * 255
                self.assertLessEqual(away.max(), 1, (configuration.name, space))

    def test_examples(self):
        spaces = [{"colorSpace": space} for space in SPACES]
        view = {"display": "sRGB", "view": "Standard"}
        plain = {"display": "sRGB - Display", "view": "Un-tone-mapped"}
        for path in sorted(EXAMPLES.glob("*.json")):
            with self.subTest(path.stem):
                self.same(json.loads(path.read_text()), [*spaces, view], [*spaces, plain])


class Polar(Daemons):
    """LCh and OKLCh, which no configuration has, are there under each, for pictures and for colors."""

    def test_everywhere(self):
        for configuration in (None, *CONFIGURATIONS):
            for written, space, value in (("oklch(0.7 0.1 200)", "OKLCh", [0.7, 0.1, 200]),
                                          ("lch(60 40 330)", "lch", [60, 40, 330]),
                                          ("lch(60 0 0)", "LCh D65", [60, 0, 77])):
                scene = {"image": {"width": 4, "height": 4, "samples": 1}, "objects": [],
                         "workingSpace": "lin_rec709"}
                with self.subTest(configuration=configuration, space=space):
                    shown = [{"colorSpace": "srgb_tx"}, {"colorSpace": space, "bitDepth": 8}]
                    one, codes = self.pictures({**scene, "background": written}, shown, configuration)
                    other, _ = self.pictures({**scene, "background": {"space": space, "value": value}}, shown,
                                             configuration)
                    self.assertLessEqual(np.abs(one - other).max(), 1)
                    scale = (255, 127 / 0.4, 255 / 360) if space == "OKLCh" else (2.55, 1, 255 / 360)
                    wanted = np.array(value) * scale * (1, 1, value[1] > 0)
                    self.assertLessEqual(np.abs(codes[..., :3] - wanted).max(), 0.6)


def chunks(png):
    """{type: data} of a PNG."""
    found, at = {}, 8
    while at < len(png):
        size = int.from_bytes(png[at:at + 4], "big")
        found[png[at + 4:at + 8].decode()] = png[at + 8:at + 8 + size]
        at += 12 + size
    return found


class Tags(Daemons):
    """What files say of their color follows from what the configuration does, not from names."""

    def tags(self, *options, **output):
        scene = {"image": {"width": 8, "height": 8, "samples": 1}, "objects": [],
                 "output": {"format": "png", **output}}
        run = subprocess.run([os.path.join(program.BUILD, "shade"), "render", "-", "-o", "-", *options],
                             input=json.dumps(scene).encode(), capture_output=True, check=False,
                             timeout=500)
        self.assertEqual(run.returncode, 0, run.stderr)
        return chunks(run.stdout)

    def test_built_in(self):
        self.assertEqual(self.tags()["cICP"], bytes([1, 13, 0, 1]))
        self.assertEqual(self.tags(display="Display P3")["cICP"], bytes([12, 13, 0, 1]))
        self.assertNotIn("cICP", self.tags(display="Rec.1886"))
        self.assertIn("gAMA", self.tags(display="Rec.1886", view="ACES 1.0 - SDR Video"))
        for output in {"view": "Raw"}, {"colorSpace": "raw"}, {"colorSpace": "YIQ"}:
            self.assertFalse({"cICP", "gAMA", "cHRM", "sRGB", "iCCP"} & set(self.tags(**output)))

    def test_elsewhere(self):
        ocio = ("--ocio", str(ELSEWHERE))
        self.assertEqual(self.tags(*ocio, display="sRGB - Display")["cICP"], bytes([1, 13, 0, 1]))
        self.assertEqual(self.tags(*ocio, colorSpace="sRGB - Texture")["cICP"], bytes([1, 13, 0, 1]))
        self.assertEqual(self.tags(*ocio, display="Rec.2100-PQ - Display", bitDepth=16)["cICP"],
                         bytes([9, 16, 0, 1]))
        self.assertEqual(self.tags(*ocio, colorSpace="lin_srgb", bitDepth=16)["cICP"],
                         bytes([1, 8, 0, 1]))
        self.assertFalse({"cICP", "gAMA", "cHRM", "sRGB", "iCCP"} & set(self.tags(*ocio, view="Raw")))

    def profile(self, form, background, **output):
        """The file's ICC profile, and the picture as readers without cicp see it, in sRGB."""
        scene = {"image": {"width": 8, "height": 8, "samples": 1}, "objects": [], "background": background,
                 "output": {"format": form, "quality": 100, **output}}
        picture = Image.open(io.BytesIO(self.render(scene).body))
        icc = picture.info["icc_profile"]
        shown = ImageCms.profileToProfile(picture.convert("RGB"), io.BytesIO(icc),
                                          ImageCms.createProfile("sRGB"), outputMode="RGB",
                                          renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC)
        return icc, np.asarray(shown, dtype=int)[4, 4]

    def test_hdr_profiles(self):
        def srgb(v):
            return 255 * np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)

        codes = {"Rec.2100-PQ": (9, 16), "Rec.2100-HLG": (9, 18), "ST2084-P3-D65": (12, 16)}
        for display, (primaries, curve) in codes.items():
            for form in "jpeg", "webp", "tiff", "png":
                for light in 0.05, 0.18, 0.5, 1, 4:
                    with self.subTest(display=display, format=form, light=light):
                        icc, shown = self.profile(form, light, display=display, view="Standard")
                        self.assertEqual(int.from_bytes(icc[:4], "big"), len(icc))
                        self.assertEqual(icc[8:10], b"\x04\x40")
                        tags = {icc[at:at + 4]: icc[int.from_bytes(icc[at + 4:at + 8], "big"):][:12]
                                for at in range(132, 132 + 12 * icc[131], 12)}
                        self.assertEqual(tags[b"cicp"], b"cicp" + bytes([0, 0, 0, 0, primaries, curve, 0, 1]))
                        # Up to 0.6 as it is, then rolled off. 8 bits of PQ are 1 to 2 codes of sRGB.
                        wanted = light if light <= 0.6 else 1 - 0.4 * np.exp((0.6 - light) / 0.4)
                        self.assertLessEqual(abs(shown - srgb(wanted)).max(), 3)
        self.assertNotIn(b"cicp", self.profile("jpeg", 0.5, display="Display P3")[0])


if __name__ == "__main__":
    unittest.main()
