"""Every example as PNG, of each depth and compression, is sound for pngcheck, and the same picture
for libpng (Pillow) and libspng, which share no code with what wrote it but zlib."""

import ctypes
import ctypes.util
import json
import os
import shutil
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy
from PIL import Image

from reference import program

EXAMPLES = Path(program.SOURCE, "api", "examples")
# One way a picture, in turns, so that each comes with many pictures.
WAYS = [{}, {"compression": "small"}, {"compression": "fast"}, {"bitDepth": 16},
        {"channel": "G"}, {"compression": "default"}]
RGBA8, RGBA16 = 1, 2  # SPNG_FMT of spng.h


def read_spng(data, width, height, deep):
    """The picture as libspng reads it, checksums of chunks and of the stream included."""
    spng = ctypes.CDLL(ctypes.util.find_library("spng"))
    spng.spng_ctx_new.restype = ctypes.c_void_p
    context = ctypes.c_void_p(spng.spng_ctx_new(0))
    out = numpy.zeros((height, width, 4), numpy.uint16 if deep else numpy.uint8)
    try:
        spng.spng_set_crc_action(context, 0, 0)  # SPNG_CRC_ERROR, also for ancillary chunks
        assert spng.spng_set_png_buffer(context, data, ctypes.c_size_t(len(data))) == 0
        status = spng.spng_decode_image(context, out.ctypes.data_as(ctypes.c_void_p),
                                        ctypes.c_size_t(out.nbytes), RGBA16 if deep else RGBA8, 0)
        assert status == 0, f"libspng: error {status}"
    finally:
        spng.spng_ctx_free(context)
    return out


def without_code_points(data):
    """pngcheck 3.0.3 takes cICP, which the third edition of the standard added, for a mistake."""
    at = 8
    while at < len(data):
        end = at + 12 + int.from_bytes(data[at:at + 4], "big")
        if data[at + 4:at + 8] == b"cICP":
            return data[:at] + data[end:]
        at = end
    return data


def render(path, way, out):
    document = json.loads(path.read_text())
    document.pop("outputs", None)
    shown = {name: value for name, value in document.get("output", {}).items()
             if name in ("display", "view", "colorSpace", "scope", "exposure")}
    if "colorSpace" not in shown and "scope" not in shown or "channel" not in way:
        shown.update(way)
    document["output"] = {**shown, "format": "png"}
    subprocess.run([os.path.join(program.BUILD, "shade"), "render", "-", "-o", out],
                   input=json.dumps(document), capture_output=True, text=True, check=True,
                   timeout=500)


class Readers(unittest.TestCase):
    def check(self, path):
        data = Path(path).read_bytes()
        plain = Path(path + ".plain")
        plain.write_bytes(without_code_points(data))
        checked = subprocess.run(["pngcheck", "-q", str(plain)], capture_output=True, text=True,
                                 check=False, timeout=500)
        self.assertEqual((checked.returncode, checked.stdout + checked.stderr), (0, ""), path)
        picture = Image.open(path)
        deep = data[24] == 16
        spng = read_spng(data, *picture.size, deep)
        if deep:  # Pillow keeps the high byte
            spng = (spng >> 8).astype(numpy.uint8)
        numpy.testing.assert_array_equal(numpy.asarray(picture.convert("RGBA")), spng, path)

    def test_every_example_is_the_same_picture_for_all(self):
        if not shutil.which("pngcheck") or not ctypes.util.find_library("spng"):
            self.skipTest("pngcheck or libspng is not installed")
        scenes = sorted(EXAMPLES.glob("*.json"))
        self.assertGreater(len(scenes), 2 * len(WAYS))
        with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as workers:
            def try_one(job):
                index, scene = job
                out = os.path.join(folder, f"{scene.stem}.png")
                render(scene, WAYS[index % len(WAYS)], out)
                self.check(out)

            list(workers.map(try_one, enumerate(scenes)))


if __name__ == "__main__":
    unittest.main()
