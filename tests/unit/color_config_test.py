"""config/shaded.ocio as OpenColorIO's own tools see it."""

import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy as np
import OpenImageIO as oiio

CONFIG = pathlib.Path(os.environ["SHADED_SOURCE"]) / "config" / "shaded.ocio"


D65, D50 = (0.3127, 0.3290), np.array([0xF6D6, 65536, 0xD32D]) / 65536  # xy; XYZ as ICC has it
PRIMARIES = {"709": ((.640, .330), (.300, .600), (.150, .060)),
             "P3": ((.680, .320), (.265, .690), (.150, .060)),
             "2020": ((.708, .292), (.170, .797), (.131, .046))}


def xyz_of(xy):
    return np.array([xy[0] / xy[1], 1, (1 - xy[0] - xy[1]) / xy[1]])


def to_xyz(name):
    """SMPTE RP 177."""
    columns = np.array([xyz_of(xy) for xy in PRIMARIES[name]]).T
    return columns * np.linalg.solve(columns, xyz_of(D65))


def power(gamma):
    return lambda v: np.copysign(abs(v) ** (1 / gamma), v)


def pq(nits):
    """ITU-R BT.2100 table 4. There are no negatives."""
    m = (np.maximum(nits, 0) / 10000) ** (2610 / 16384)
    return ((3424 / 4096 + 2413 / 128 * m) / (1 + 2392 / 128 * m)) ** (2523 / 32)


def hlg(nits):
    """ITU-R BT.2100 table 5, from the light of a display of 1000 cd/m2, whose gamma is 1.2. OpenColorIO
    holds its gain below a luminance of 0.1 cd/m2."""
    nits = np.clip(nits, 0, None) / 1000
    luminance = nits @ to_xyz("2020")[1]
    scene = np.clip(nits * np.maximum(luminance[..., None], 1e-4) ** (1 / 1.2 - 1), 0, None)
    a, b, c = 0.17883277, 0.28466892, 0.55991073
    return np.where(scene <= 1 / 12, np.sqrt(3 * scene), a * np.log(np.maximum(12 * scene - b, 1e-9)) + c)


def cielab(xyz, white):
    """CIE 15:2004, 8.2.1.1. Below 0 the line goes on."""
    t = xyz / white
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def bradford(xyz, white):
    m = np.array([[.8951, .2664, -.1614], [-.7502, 1.7135, .0367], [.0389, -.0685, 1.0296]])
    return xyz @ (np.linalg.inv(m) @ np.diag(m @ white / (m @ xyz_of(D65))) @ m).T


def oklab(rgb):
    """https://bottosson.github.io/posts/oklab"""
    lms = rgb @ np.array([[.4122214708, .5363325363, .0514459929], [.2119034982, .6806995451, .1073969566],
                          [.0883024619, .2817188376, .6299787005]]).T
    return np.cbrt(lms) @ np.array([[.2104542553, .7936177850, -.0040720468],
                                    [1.9779984951, -2.4285922050, .4505937099],
                                    [.0259040371, .7827717662, -.8086757660]]).T


def acescct(rgb):
    """S-2016-001; AP1 by Bradford from D65."""
    ap1 = rgb @ np.array([[.6130974024, .3395231462, .0473794514], [.0701937225, .9163538791, .0134523985],
                          [.0206155929, .1095697729, .8698146342]]).T
    return np.where(ap1 > 0.0078125, (np.log2(np.maximum(ap1, 1e-9)) + 9.72) / 17.52,
                    10.5402377416545 * ap1 + 0.0729055341958355)


def definitions(rgb):
    """{space: (what linear Rec.709 light is there, how far a float may be off)}"""
    xyz = rgb @ to_xyz("709").T
    wide = {name: xyz @ np.linalg.inv(to_xyz(name)).T for name in ("P3", "2020")}
    d50, d65, ok = cielab(bradford(xyz, D50), D50), cielab(xyz, xyz_of(D65)), oklab(rgb)
    spans, at = np.array([100, 255, 255]), np.array([0, 128, 128]) / 255
    return {
        "Linear P3-D65": (wide["P3"], 1e-6), "Linear Rec.2020": (wide["2020"], 1e-6),
        "CIE-XYZ-D65": (xyz, 2e-6), "ACEScct": (acescct(rgb), 2e-6),
        "Gamma 2.2": (power(2.2)(rgb), 1e-6), "Rec.2020": (power(2.4)(wide["2020"]), 2e-6),
        "P3-D65": (power(2.6)(wide["P3"]), 2e-6),
        "Rec.2100-PQ": (pq(203 * wide["2020"]), 1e-6), "ST2084-P3-D65": (pq(203 * wide["P3"]), 1e-6),
        "Rec.2100-HLG": (hlg(203 * wide["2020"]), 1e-5),
        "CIELAB D50": (d50, 2e-4), "CIELAB D65": (d65, 2e-4), "OKLab": (ok, 2e-6),
        "CIELAB D50 file": (d50 / spans + at, 2e-6), "CIELAB D65 file": (d65 / spans + at, 2e-6),
        "OKLab file": (ok * [1, 127 / 102, 127 / 102] + at, 2e-6)}


def write_exr(path, colors):
    colors = np.float32(colors)[None]
    out = oiio.ImageOutput.create(path)
    out.open(path, oiio.ImageSpec(colors.shape[1], 1, 3, "float"))
    out.write_image(colors)
    out.close()


def converted(path, space, folder):
    """ocioconvert's, of scene-linear Rec.709 light in `path`."""
    back = os.path.join(folder, space + ".exr")  # OpenImageIO keeps what it reads by name
    subprocess.run(["ocioconvert", path, "lin_rec709", back, space], check=True, timeout=500,
                   env={**os.environ, "OCIO": str(CONFIG)}, capture_output=True)
    return np.float64(oiio.ImageBuf(back).get_pixels(oiio.FLOAT)[0, :, :3])


class Config(unittest.TestCase):
    @unittest.skipUnless(shutil.which("ociocheck"), "ociocheck (opencolorio-tools) is not installed")
    def test_ociocheck_has_nothing_to_say(self):
        done = subprocess.run(["ociocheck", "--iconfig", CONFIG], capture_output=True, text=True,
                              timeout=500, env={"PATH": os.environ["PATH"]})
        said = done.stdout + done.stderr
        self.assertEqual(done.returncode, 0, said)
        for word in ("warning", "error", "not defined"):
            self.assertNotIn(word, said.lower())

    def test_file_rules_ignore_case(self):
        rules = re.findall(r'!<Rule> {name: \w+, colorspace: ([^,]+), regex: "(.*)"}', CONFIG.read_text())
        rules = [(space, re.sub(r"\\\\", r"\\", rule)) for space, rule in rules]  # as YAML has it
        wanted = {"sRGB": "png jpg jpeg webp avif gif bmp tga tif tiff", "Display P3": "heic heif",
                  "Rec.1886": "mov mp4", "compositing_log": "dpx", None: "exr hdr pngx mp"}
        for space, suffixes in wanted.items():
            for suffix in suffixes.split():
                for name in (f"a.{suffix}", f"/B/C.{suffix.upper()}", f"d.e.{suffix.title()}"):
                    found = next((to for to, rule in rules if re.fullmatch(rule, name)), None)
                    self.assertEqual(found, space, name)

    @unittest.skipUnless(shutil.which("ocioconvert"), "ocioconvert is not installed")
    def test_displays_keep_negative_values(self):
        with tempfile.TemporaryDirectory() as folder:
            there = os.path.join(folder, "there.exr")
            colors = np.float32([[[-0.25, 0.5, 2], [0.125, -1, -0.5]]])
            spec = oiio.ImageSpec(2, 1, 3, "float")
            out = oiio.ImageOutput.create(there)
            out.open(there, spec)
            out.write_image(colors)
            out.close()
            for display in ("sRGB", "Rec.1886", "Display P3", "Rec.2020", "P3-D65"):
                got = []
                for space in (f"{display} - Display", display):
                    back = os.path.join(folder, space + ".exr")
                    subprocess.run(["ocioconvert", there, "lin_rec709", back, space], check=True,
                                   env={**os.environ, "OCIO": str(CONFIG)}, capture_output=True,
                                   timeout=500)
                    got.append(oiio.ImageBuf(back).get_pixels(oiio.FLOAT)[..., :3])
                np.testing.assert_allclose(*got, atol=1e-5, err_msg=display)

    @unittest.skipUnless(shutil.which("ocioconvert"), "ocioconvert is not installed")
    def test_spaces_are_their_definitions(self):
        """What ocioconvert makes of them, beside the standards' equations in f64."""
        ramp = np.geomspace(1e-4, 1, 40)
        colors = np.vstack([ramp[:, None] * color for color in
                            [(1, 1, 1), (1, 0.01, 0.02), (0.02, 1, 0.03), (0.01, 0.05, 1), (0.9, 0.6, 0.1)]] +
                           [[[0, 0, 0], [4, 2, 3], [1, 0, 0], [0, 1, 0], [0, 0, 1]]])
        with tempfile.TemporaryDirectory() as folder:
            there = os.path.join(folder, "there.exr")
            write_exr(there, colors)
            for space, (wanted, tolerance) in definitions(np.float64(np.float32(colors))).items():
                np.testing.assert_allclose(converted(there, space, folder), wanted, rtol=2e-6, atol=tolerance,
                                           err_msg=space)

    def test_anchors_of_hdr(self):
        """ITU-R BT.2408: 203 cd/m2 are 58 % of PQ's signal, and 75 % of HLG's."""
        white = definitions(np.ones((1, 3)))
        self.assertAlmostEqual(white["Rec.2100-PQ"][0][0, 0], 0.58, 2)
        self.assertAlmostEqual(white["Rec.2100-HLG"][0][0, 0], 0.75, 3)

    def test_needs_no_other_file(self):
        text = CONFIG.read_text()
        self.assertNotIn("!<FileTransform>", text)
        self.assertIn("environment:\n  {}\n", text)


if __name__ == "__main__":
    unittest.main()
