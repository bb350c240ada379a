"""Every example renders without a word, to the picture that the gallery shows of it."""

import json
import os
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from PIL import Image

from reference import program

EXAMPLES = Path(program.SOURCE, "api", "examples")
GALLERY = Path(program.SOURCE, "docs", "gallery")


def shown(document):
    """The scene as its first picture, as PNG."""
    output = document.pop("outputs", [document.get("output", {})])[0]
    if output.get("format", "png") != "png":
        output = {}
    output = {key: value for key, value in output.items() if key != "name"}
    return {**document, "output": {"format": "png", **output}}


class Gallery(unittest.TestCase):
    def test_every_example_is_shown_as_it_renders(self):
        scenes = sorted(EXAMPLES.glob("*.json"))
        self.assertGreaterEqual(len(scenes), 14)
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as workers:
            def render(path):
                out = os.path.join(folder, path.stem + ".png")
                run = subprocess.run(
                    [os.path.join(program.BUILD, "shade"), "render", "-", "-o", out],
                    input=json.dumps(shown(json.loads(path.read_text(encoding="utf-8")))),
                    capture_output=True, text=True, check=False, timeout=300)
                return out, run

            for path, (out, run) in zip(scenes, workers.map(render, scenes)):
                with self.subTest(example=path.stem):
                    self.assertEqual((run.returncode, run.stderr), (0, ""))
                    new, old = (np.asarray(Image.open(picture), dtype=int)
                                for picture in (out, GALLERY / f"{path.stem}.png"))
                    self.assertEqual(new.shape, old.shape)
                    # rounding may differ by processor: a code, or the hue of a pixel of an edge
                    self.assertLess(np.mean(np.abs(new - old) > 1), 1e-3,
                                    "docs/gallery/make renders the gallery again")

    def test_the_page_shows_every_picture(self):
        page = (GALLERY / "README.md").read_text(encoding="utf-8")
        for path in GALLERY.glob("*.png"):
            self.assertIn(f"]({path.name})", page)


if __name__ == "__main__":
    unittest.main()
