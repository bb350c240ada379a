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


class Config(unittest.TestCase):
    @unittest.skipUnless(shutil.which("ociocheck"), "ociocheck (opencolorio-tools) is not installed")
    def test_ociocheck_has_nothing_to_say(self):
        done = subprocess.run(["ociocheck", "--iconfig", CONFIG], capture_output=True, text=True,
                              timeout=60, env={"PATH": os.environ["PATH"]})
        said = done.stdout + done.stderr
        self.assertEqual(done.returncode, 0, said)
        for word in ("warning", "error", "not defined"):
            self.assertNotIn(word, said.lower())

    def test_file_rules_ignore_case(self):
        rules = re.findall(r'!<Rule> {name: \w+, colorspace: ([^,]+), regex: "(.*)"}', CONFIG.read_text())
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
            for display in ("sRGB", "Rec.1886", "Display P3"):
                got = []
                for space in (f"{display} - Display", display):
                    back = os.path.join(folder, space + ".exr")
                    subprocess.run(["ocioconvert", there, "lin_rec709", back, space], check=True,
                                   env={**os.environ, "OCIO": str(CONFIG)}, capture_output=True,
                                   timeout=60)
                    got.append(oiio.ImageBuf(back).get_pixels(oiio.FLOAT)[..., :3])
                np.testing.assert_allclose(*got, atol=1e-5, err_msg=display)

    def test_needs_no_other_file(self):
        text = CONFIG.read_text()
        self.assertNotIn("!<FileTransform>", text)
        self.assertIn("environment:\n  {}\n", text)


if __name__ == "__main__":
    unittest.main()
