#!/usr/bin/env python3
"""`./dev bench --png`: how long our PNG files are beside those of other encoders, into docs/bench/png.md. Nothing is
timed."""

import ctypes
import ctypes.util
import io
import json
import os
import statistics
import struct
import subprocess
import tempfile
import zlib
from pathlib import Path

from PIL import Image

BUILD, SOURCE = Path(os.environ["SHADED_BUILD"]), Path(os.environ["SHADED_SOURCE"])
NAMES = ("libdeflate 2", "zlib 6", "libpng 6")
GREY = {"colorSpace": "YIQ", "channel": "Y"}
KINDS = (("grey", GREY, False), ("grey, alpha", GREY, True), ("RGB", {}, False), ("RGB, alpha", {}, True))
PAGE = """# How long PNG files are

Made by `./dev bench --png`: the {count} pictures of 8 bits of `api/examples`, with the `compression` that is the default.
Each ratio is bytes of ours over bytes of the other one.

| beside | all together | median | at most | in |
| --- | --- | --- | --- | --- |
{rows}

- `libdeflate 2` is what the encoder was made of before, of the same filtered rows; `zlib 6` is of these rows, too.
- `libpng 6` is the picture written again, as Pillow does: with filters of its own choice, and no chunk but what is needed.

The same with 16 bits, of every example that may be so:

| samples | pictures | beside | all together | median | at most | in |
| --- | --- | --- | --- | --- | --- | --- |
{wide}
"""


def chunks(data):
    at = 8
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        yield kind, data[at + 8:at + 8 + length]
        at += 12 + length


def by_libdeflate(library, rows, level):
    """Bytes, as a zlib stream."""
    compressor = library.libdeflate_alloc_compressor(level)
    room = ctypes.create_string_buffer(len(rows) + 4096)
    size = library.libdeflate_zlib_compress(compressor, rows, len(rows), room, len(room))
    library.libdeflate_free_compressor(compressor)
    return size


def sizes(library, data):
    """(ours, the other one) for each of NAMES, the last one of 8 bits alone: Pillow has no others with colors."""
    ours = b"".join(body for kind, body in chunks(data) if kind == b"IDAT")
    rows, again = zlib.decompress(ours), io.BytesIO()
    beside = ((len(ours), by_libdeflate(library, rows, 2)), (len(ours), len(zlib.compress(rows, 6))))
    if data[24] == 16:
        return beside
    with Image.open(io.BytesIO(data)) as image:
        Image.frombytes(image.mode, image.size, image.tobytes()).save(again, "PNG", compress_level=6)
    return (*beside, (len(data), len(again.getvalue())))


def render(path, folder):
    """A picture of a scene. None: it is refused, or several."""
    out = Path(folder, "out.png")
    out.unlink(missing_ok=True)
    subprocess.run([BUILD / "shade", "render", path, "-o", out], check=False, stderr=subprocess.DEVNULL)
    return out.read_bytes() if out.exists() else None


def examples():
    return sorted((SOURCE / "api/examples").glob("*.json"))


def pictures(folder):
    """(name, file) of each example that is one picture of 8 bits."""
    for path in examples():
        data = render(path, folder)
        if data and data[24] == 8:
            yield path.stem, data


def wide_pictures(folder, output, alpha):
    """The same with 16 bits: of each example's scene, shown otherwise."""
    for path in examples():
        scene = {**json.loads(path.read_text(encoding="utf-8")), "output": {"format": "png", "bitDepth": 16, **output}}
        scene.pop("outputs", None)
        if alpha:
            scene["background"] = None
        changed = Path(folder, "scene.json")
        changed.write_text(json.dumps(scene), encoding="utf-8")
        data = render(changed, folder)
        if data:
            yield path.stem, data


def lines(found):
    """The cells of a row for each of the others."""
    for i, other in enumerate(NAMES[:len(found[0][1])]):
        ratios = [(pairs[i][0] / pairs[i][1], name) for name, pairs in found]
        whole = sum(pairs[i][0] for _, pairs in found) / sum(pairs[i][1] for _, pairs in found)
        most, name = max(ratios)
        yield f"| {other} | {whole:.3f} | {statistics.median(r for r, _ in ratios):.3f} | {most:.3f} | {name} |"


def main():
    library = ctypes.CDLL(ctypes.util.find_library("deflate"))
    library.libdeflate_alloc_compressor.restype = ctypes.c_void_p
    library.libdeflate_free_compressor.argtypes = [ctypes.c_void_p]
    library.libdeflate_zlib_compress.restype = ctypes.c_size_t
    library.libdeflate_zlib_compress.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t, ctypes.c_void_p,
                                                 ctypes.c_size_t]
    with tempfile.TemporaryDirectory() as folder:
        found = [(name, sizes(library, data)) for name, data in pictures(folder)]
        wide = []
        for kind, output, alpha in KINDS:
            others = [(name, sizes(library, data)) for name, data in wide_pictures(folder, output, alpha)]
            wide += [f"| {kind} | {len(others)} {line}" for line in lines(others)]
    page = SOURCE / "docs/bench/png.md"
    page.write_text(PAGE.format(count=len(found), rows="\n".join(lines(found)), wide="\n".join(wide)), encoding="utf-8")


if __name__ == "__main__":
    main()
