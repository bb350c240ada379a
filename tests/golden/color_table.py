"""Every space and view of the built-in configuration x format x depth: what another program reads from
our files, beside what ocioconvert makes of the scene's light. `./dev color` writes docs/color.md."""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenImageIO as oiio
from PIL import Image

SOURCE = pathlib.Path(os.environ.get("SHADED_SOURCE", "."))
CONFIG = SOURCE / "config" / "shaded.ocio"
PAGE = SOURCE / "docs" / "color.md"

# By column: the output, and who reads it.
COLUMNS = {
    "PNG 8": ({"format": "png"}, "Pillow"), "PNG 16": ({"format": "png", "bitDepth": 16}, "OpenImageIO"),
    "WebP": ({"format": "webp", "quality": 100}, "Pillow"),
    "TIFF 8": ({"format": "tiff", "bitDepth": 8}, "Pillow"),
    "TIFF 16": ({"format": "tiff", "bitDepth": 16}, "OpenImageIO"),
    "TIFF half": ({"format": "tiff", "bitDepth": "half"}, "OpenImageIO"),
    "TIFF float": ({"format": "tiff", "bitDepth": "float"}, "OpenImageIO"),
    "EXR half": ({"format": "exr", "bitDepth": "half"}, "OpenImageIO"),
    "EXR float": ({"format": "exr", "bitDepth": "float"}, "OpenImageIO"),
    "HDR": ({"format": "hdr"}, "OpenImageIO"), "JPEG": ({"format": "jpeg", "quality": 95}, "Pillow"),
    "WebP 90": ({"format": "webp", "quality": 90}, "Pillow"),
}
LOSSY = ("JPEG", "WebP 90")

# Dark and bright, grey and saturated, some beyond [0,1].
COLORS = ["#fff", "#f00", "#0f0", "#00f", "#0ff", "#f0f", "#ff0", "#777", 0.02, [0.8, 0.4, 0.1], [2, 1.5, 1]]
SCENE = {
    "camera": {"type": "orthographic", "position": [0, 0, 9], "height": 8}, "background": [0.05, 0.06, 0.09],
    "image": {"width": 64, "height": 64},
    "lights": [{"type": "directional", "direction": [-0.4, -0.6, -1]}],
    "objects": [{"type": "sphere", "material": {"diffuse": color, "specular": 0.1, "ambient": 0},
                 "transform": {"translate": [2 * (i % 4) - 3, 2 * (i // 4) - 2, 0]}}
                for i, color in enumerate(COLORS)]}


def shade(outputs, folder):
    subprocess.run([os.path.join(os.environ.get("SHADED_BUILD", "build"), "shade"), "render", "-", "-o", folder + "/"],
                   input=json.dumps({**SCENE, "outputs": outputs}).encode(), check=True, timeout=500,
                   capture_output=True)


def read(path, reader):
    """[y, x, channel], integers as codes."""
    if reader == "Pillow":
        return np.asarray(Image.open(path).convert("RGB"), dtype=float)
    buffer = oiio.ImageBuf(path)
    return np.asarray(buffer.get_pixels(oiio.UINT16 if str(buffer.spec().format) == "uint16" else oiio.FLOAT),
                      dtype=float)[..., :3]


def converted(light, target, folder):
    """What ocioconvert makes of light in the file `light`."""
    if target[0].removesuffix(" file") in POLAR:
        return polar(light, target[0], folder)
    there = os.path.join(folder, "theirs.exr")
    how = ["--view", light, "lin_rec709", there, *target] if len(target) == 2 else \
        [light, "lin_rec709", there, *target]
    subprocess.run(["ocioconvert", *how], check=True, timeout=500, capture_output=True,
                   env={**os.environ, "OCIO": str(CONFIG)})
    return read(there, "OpenImageIO")


# Spaces that OpenColorIO has no operator for, as (base, scales of L, C and h in files): the last step is
# done by numpy here.
POLAR = {"LCh D50": ("CIELAB D50", (1 / 100, 1 / 255, 1 / 360)), "LCh D65": ("CIELAB D65", (1 / 100, 1 / 255, 1 / 360)),
         "OKLCh": ("OKLab", (1, 127 / 102, 1 / 360))}


def polar(light, name, folder):
    kind = name.removesuffix(" file")
    base, scales = POLAR[kind]
    lightness, a, b = np.moveaxis(converted(light, (base,), folder), -1, 0)
    chroma = np.hypot(a, b)
    chroma[chroma < 3e-6 / scales[0]] = 0  # of greys, as docs/model.md has it
    hue = np.degrees(np.arctan2(b, a)) % 360 * (chroma > 0)
    return np.stack([lightness, chroma, hue], -1) * (scales if name.endswith("file") else 1)


def channels_apart(got, wanted, target, most=0):
    """A hue turns by rounding where there is next to none, and wraps at red. most: the largest code."""
    away = abs(got - wanted)
    if target[0].startswith("HSV"):
        hue, strength, turn, least = 0, 1, most or 1, (most or 1) / 16
    elif "LCh" in target[0]:
        hue, strength, turn, least = 2, 1, most or (1 if target[0].endswith("file") else 360), wanted[..., 1].max() / 16
    else:
        return away
    away[..., hue] = np.minimum(away[..., hue], turn - away[..., hue]) * (wanted[..., strength] > least)
    return away


def apart(column, got, wanted, target):
    """The largest difference in codes, of floats over the larger of 1 and the value, in ulps of halfs,
    and of HDR over a pixel's largest channel. Of lossy formats the mean, in codes."""
    if column.endswith("16"):
        return channels_apart(got, 65535 * np.clip(wanted, 0, 1), target, 65535).max()
    if column.endswith("half"):
        ulp = np.spacing(np.maximum(abs(wanted), 2.0 ** -14).astype(np.float16)).astype(float)
        return (abs(got - wanted) / ulp * (channels_apart(got, wanted, target) > 0)).max()
    if column.endswith("float"):
        return (channels_apart(got, wanted, target) / np.maximum(1, abs(wanted))).max()
    if column == "HDR":
        wanted = np.maximum(wanted, 0)
        return (channels_apart(got, wanted, target) / np.maximum(wanted.max(-1, keepdims=True), 1e-6)).max()
    away = channels_apart(got, 255 * np.clip(wanted, 0, 1), target, 255)
    return away.mean() if column in LOSSY else away.max()


def row(target):
    """{column: difference} of a space (name,) or a view (display, view)."""
    color = {"display": target[0], "view": target[1]} if len(target) == 2 else {"colorSpace": target[0]}
    with tempfile.TemporaryDirectory() as folder:
        names = {column: column.replace(" ", "-") for column in COLUMNS}
        shade([{"name": names[c], **output, **color} for c, (output, _) in COLUMNS.items()] +
              [{"name": "light", "format": "exr", "bitDepth": "float"}], folder)
        light = os.path.join(folder, "light.exr")
        wanted = coded = converted(light, target, folder)
        if len(target) == 1 and target[0] + " file" in SPACES:
            (pathlib.Path(folder) / "file").mkdir()
            coded = converted(light, (target[0] + " file",), os.path.join(folder, "file"))
        out = {}
        for column, (output, reader) in COLUMNS.items():
            path = os.path.join(folder, f"{names[column]}.{output['format'].replace('jpeg', 'jpg')}")
            if not os.path.exists(path):
                path = os.path.join(folder, f"{names[column]}.{output['format']}")
            integers = output.get("bitDepth", 8 if output["format"] != "hdr" else "float") in (8, 16)
            out[column] = apart(column, read(path, reader), coded if integers else wanted, target)
        return out


def catalog():
    text = subprocess.run(["ociocheck", "--iconfig", CONFIG], check=True, capture_output=True, text=True,
                          env={"PATH": os.environ["PATH"]}).stdout
    spaces = [line for line in text.split("** ColorSpaces **\n")[1].split("\n\n")[0].splitlines() if line]
    views, display = [], None
    for line in CONFIG.read_text().split("\ndisplays:\n")[1].split("\n\n")[0].splitlines():
        if line.startswith("    "):
            views.append((display, line.split("name: ")[1].split(",")[0]))
        else:
            display = line.strip(" :")
    return spaces, views


SPACES, VIEWS = catalog()
SPACES += [name + more for name in POLAR for more in ("", " file")]
LIMITS = {**{column: 1 for column in COLUMNS}, "TIFF float": 1e-5, "EXR float": 1e-5, "TIFF half": 0.52,
          "EXR half": 0.52, "HDR": 1 / 127, "JPEG": 4, "WebP 90": 8}

HEAD = """# Color in files, beside other programs

`./dev color` measures all of this and writes it. A picture of eleven spheres (64 x 64, saturated and grey, dark
and up to 2) is rendered to every space and view of the built-in configuration, in every format and depth. Another
program reads the file: Pillow of 8 bits, OpenImageIO the rest. What it should hold is what `ocioconvert` of
OpenColorIO makes of the scene's light, in floats.

Integers: the largest difference in codes from the exact value, so that rounding alone gives 0.5. Float: the largest
difference, over the value if that exceeds 1. Half: in units of the last place, rounding alone gives 0.5. HDR: over a
pixel's largest channel, which has 8 bits (OpenImageIO cuts the rest off: up to 1/128 = 0.0078), negatives counting
as 0. JPEG of quality 95 and WebP of 90: the mean in codes. Hues count if the saturation exceeds 1/16 (LCh: the chroma
1/16 of the picture's largest). Integers of a space NAME are compared with `NAME file`, where there is one. The last
step to LCh and OKLCh, for which OpenColorIO has no operator, is numpy's.

"""


def page(rows):
    lines = ["| space or view | " + " | ".join(COLUMNS) + " |", "| --- |" + " ---: |" * len(COLUMNS)]
    for target, figures in rows.items():
        cells = [f"{v:.1e}" if c.endswith("float") or c == "HDR" else f"{v:.2f}" for c, v in figures.items()]
        lines.append(f"| {' / '.join(target)} | " + " | ".join(cells) + " |")
    worst = [f"{c} {max(figures[c] for figures in rows.values()):.3g}" for c in COLUMNS]
    return HEAD + "The largest of each: " + ", ".join(worst) + ".\n\n" + "\n".join(lines) + "\n"


def main():
    rows = {}
    for target in [(space,) for space in SPACES] + VIEWS:
        rows[target] = row(target)
        bad = [f"{c} {v:.3g}" for c, v in rows[target].items() if not v <= LIMITS[c]]
        print(" / ".join(target), *bad, file=sys.stderr, flush=True)
    PAGE.write_text(page(rows))


if __name__ == "__main__":
    main()
