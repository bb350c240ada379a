"""Every example renders to the picture that the gallery shows of it, with no unknown warnings."""

import importlib.machinery
import importlib.util
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from PIL import Image

from reference import program

sys.dont_write_bytecode = True

# What examples are warned of. Published pearl sends on more light than arrives.
WARNINGS = {"library": r"warning: stdin: /objects/17/material: it sends on 1\.011 times .*\n"}

EXAMPLES = Path(program.SOURCE, "api", "examples")
GALLERY = Path(program.SOURCE, "docs", "gallery")


def load_make():
    """docs/gallery/make, as a module."""
    loader = importlib.machinery.SourceFileLoader("make", str(GALLERY / "make"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("make", loader))
    loader.exec_module(module)
    return module


MAKE = load_make()


def render(document, out):
    return subprocess.run(
        [os.path.join(program.BUILD, "shade"), "render", "-", "-o", out],
        input=json.dumps(document),
        capture_output=True, text=True, check=False, timeout=500)


class Gallery(unittest.TestCase):
    def assert_same_picture(self, out, shown, advice):
        new, old = (np.asarray(Image.open(picture), dtype=int) for picture in (out, shown))
        self.assertEqual(new.shape, old.shape)
        # rounding may differ by processor: a code, or the hue of a pixel of an edge
        self.assertLess(np.mean(np.abs(new - old) > 1), 1e-3, advice)

    def test_every_example_is_shown_as_it_renders(self):
        scenes = sorted(EXAMPLES.glob("*.json"))
        self.assertGreaterEqual(len(scenes), 14)
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as workers:
            def render_example(path):
                _, document = MAKE.shown(path.stem, MAKE.read(path.stem))[0]
                out = os.path.join(folder, path.stem + ".png")
                return out, render(document, out)

            for path, (out, run) in zip(scenes, workers.map(render_example, scenes)):
                with self.subTest(example=path.stem):
                    self.assertEqual(run.returncode, 0)
                    self.assertRegex(run.stderr, f"^{WARNINGS.get(path.stem, '')}$")
                    self.assert_same_picture(out, GALLERY / f"{path.stem}.png",
                                             "docs/gallery/make renders the gallery again")

    def test_the_request_of_the_readme_makes_its_picture(self):
        text = Path(program.SOURCE, "README.md").read_text(encoding="utf-8")
        document = json.loads(re.search(r"curl -o picture.png .*?-d '(.*?)'", text, re.S).group(1))
        shown = re.search(r'<img src="(.*?)"', text).group(1)
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "picture.png")
            self.assertEqual(render(document, out).returncode, 0)
            self.assert_same_picture(out, Path(program.SOURCE, shown),
                                     "the request's picture belongs there")

    def test_the_contact_sheet_shows_the_library(self):
        with tempfile.TemporaryDirectory() as folder:
            out = os.path.join(folder, "sheet.png")
            self.assertEqual(render(MAKE.every_material(), out).returncode, 0)
            self.assert_same_picture(out, GALLERY / "every-material.png",
                                     "docs/gallery/make every-material renders it again")

    def test_the_page_is_made_of_the_list(self):
        page = (GALLERY / "README.md").read_text(encoding="utf-8")
        self.assertEqual(page, MAKE.page(), "docs/gallery/make writes the page again")
        for path in GALLERY.glob("*.png"):
            self.assertIn(f"]({path.name})", page)

    def test_every_example_is_in_the_list(self):
        examples = {path.stem for path in EXAMPLES.glob("*.json")}
        self.assertEqual(examples | MAKE.MADE, set(MAKE.captions()))


if __name__ == "__main__":
    unittest.main()
