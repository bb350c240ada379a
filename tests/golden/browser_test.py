"""What Chromium shows of our PNGs: it reads cICP, so that HDR and wide gamuts look as sRGB does."""

import base64
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
import zlib

import numpy as np

from reference import program

COLORS = [[1, 1, 1], [0.5, 0.5, 0.5], [0.6, 0.2, 0.05], [0.1, 0.4, 0.3], [0.02, 0.03, 0.2]]
PAGE = """%s<pre></pre><script>onload = () => {
    const out = [];
    for (const image of document.images) {
        const context = document.createElement('canvas').getContext('2d');
        context.drawImage(image, 0, 0);
        out.push([...context.getImageData(3, 3, 1, 1).data]);
    }
    document.querySelector('pre').textContent = JSON.stringify(out);
}</script>"""


def png(color, **output):
    scene = {"image": {"width": 8, "height": 8, "samples": 1}, "objects": [], "background": color,
             "output": {"format": "png", **output}}
    return subprocess.run([os.path.join(program.BUILD, "shade"), "render", "-", "-o", "-"],
                          input=json.dumps(scene).encode(), capture_output=True, check=True, timeout=500).stdout


def without(chunk, data):
    at = data.index(chunk) - 4
    size = 12 + int.from_bytes(data[at:at + 4], "big")
    assert zlib.crc32(data[at + 4:at + size - 4]) == int.from_bytes(data[at + size - 4:at + size], "big")
    return data[:at] + data[at + size:]


def shown(pictures):
    """The middle of each picture as codes of sRGB, in a canvas."""
    images = "".join(f'<img src="data:image/png;base64,{base64.b64encode(data).decode()}">' for data in pictures)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "page.html")
        with open(path, "w", encoding="ascii") as file:
            file.write(PAGE % images)
        run = subprocess.run(["chromium", "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={folder}/user",
                              "--virtual-time-budget=10000", "--dump-dom", f"file://{path}"],
                             capture_output=True, text=True, timeout=500, check=False)
    found = re.search(r"<pre>(\[.*?\]\])</pre>", run.stdout)
    if not found:
        raise AssertionError(run.stdout[-300:] + run.stderr[-300:])
    return np.array(json.loads(found.group(1)), dtype=float)[:, :3]


def light(codes):
    v = codes / 255
    return np.where(v <= 0.04045, v / 12.92, ((v + 0.055) / 1.055) ** 2.4)


def srgb(v):
    return 255 * np.where(v <= 0.0031308, 12.92 * v, 1.055 * np.abs(v) ** (1 / 2.4) - 0.055)


@unittest.skipUnless(shutil.which("chromium"), "chromium is not installed")
class Browser(unittest.TestCase):
    def test_pictures_look_as_srgb_does(self):
        """Chromium takes 8 bits of each sample before it converts: 2 codes. On a canvas of standard range
        it scales all of HDR's light by one factor, which is white's."""
        standard = ({}, {"display": "Display P3"}, {"display": "Rec.2020", "bitDepth": 16},
                    {"display": "P3-D65", "bitDepth": 16}, {"colorSpace": "Gamma 2.2", "bitDepth": 16})
        high = [{"display": display, "bitDepth": 16} for display in ("Rec.2100-PQ", "Rec.2100-HLG", "ST2084-P3-D65")]
        pictures = [png(color, **output) for output in (*standard, *high) for color in COLORS]
        hdr = pictures[len(standard) * len(COLORS):]
        profiles = [without(b"cICP", data) for data in hdr]
        bare = [without(b"iCCP", data) for data in profiles]
        got = shown(pictures + profiles + bare).reshape(-1, len(COLORS), 3)
        for output, seen in zip(standard, got):
            self.assertLessEqual(abs(seen - srgb(np.array(COLORS))).max(), 2, output)
        for i, output in enumerate(high):
            seen = got[len(standard) + i]
            factor = light(seen[0]).mean()
            self.assertTrue(0.4 < factor < 1.05, factor)
            self.assertLessEqual(abs(seen - srgb(factor * np.array(COLORS))).max(), 2, output)
            # The profile's own cicp tag says the same; only these two say so.
            self.assertLessEqual(abs(got[len(standard) + len(high) + i] - seen).max(), 1, output)
            self.assertGreater(abs(got[len(standard) + 2 * len(high) + i] - seen).max(), 20, output)


if __name__ == "__main__":
    unittest.main()
