"""Makes the examples of a metameric pair: two reflectances that look alike under D65 and not under A.

    python3 tests/spectra/metamers.py /usr/share/colord

One is a smooth curve plus a metameric black, the other the same curve minus it: a sum of a few cosines that is
orthogonal to D65 times the observer, both as an integral and as 16 channels see it, and that A times the observer
sees the most of. The folder is as for tables.py.
"""

import json
import sys
from pathlib import Path

import numpy as np

import primaries
import tables

COSINES = 13
ROOT = Path(__file__).resolve().parents[2]


def seen_by_channels(functions, observer, light):
    """XYZ of functions [m] in `light`, as 16 equal bins from 380 to 730 nm see it: [3][m]."""
    edges, grid = np.linspace(380, 730, 17), np.arange(360, 831, 5.0)
    total = 0
    for low, high in zip(edges, edges[1:]):
        knots = np.concatenate([[low, high], grid[(grid > low) & (grid < high)]])
        white = primaries.integrate([observer, light], knots)
        total = total + np.outer(white, [primaries.integrate([f], knots) / (high - low) for f in functions])
    return total


def pair(observer, d65, a):
    at = np.arange(380, 731, 10)
    t = (at - 380) / 350
    rows = np.cos(np.pi * np.arange(COSINES)[:, None] * t)
    functions = [lambda nm, row=row: np.interp(nm, at, row) for row in rows]
    knots = np.arange(380, 731, 5.0)

    def whole(light):
        return np.array([primaries.integrate([observer, light, f], knots) for f in functions]).T

    alike = np.vstack([whole(d65), seen_by_channels(functions, observer, d65)])
    alike /= np.abs(alike).max(axis=1, keepdims=True)
    free = np.linalg.svd(alike)[2][6:]
    black = (np.linalg.svd(whole(a) @ free.T)[2][0] @ free) @ rows
    base = 0.34 + 0.12 * np.cos(np.pi * (t - 0.62))
    size = 0.95 * min(((base - 0.02) / np.abs(black)).min(), ((0.95 - base) / np.abs(black)).min())
    return at, base + size * black, base - size * black


def illuminant_a(nm):
    return (560 / nm) ** 5 * np.expm1(1.435e7 / (2848 * 560)) / np.expm1(1.435e7 / (2848 * nm))


def example(at, first, second, illuminant):
    def material(values):
        return {"diffuse": {"wavelengths": at.tolist(), "values": [round(v, 5) for v in values.tolist()]},
                "specular": 0.04, "shininess": 60}

    return {"spectral": True,
            "camera": {"position": [0, 0, 7], "fov": 20}, "image": {"width": 640, "height": 320, "samples": 16},
            "background": "#202020", "ambient": {"spectrum": illuminant, "scale": 0.25},
            "lights": [{"type": "directional", "direction": [0.4, -0.7, -1], "color": {"spectrum": illuminant}}],
            "materials": {"left": material(first), "right": material(second)},
            "objects": [{"type": "sphere", "material": "left", "transform": {"translate": [-1.1, 0, 0]}},
                        {"type": "sphere", "material": "right", "transform": {"translate": [1.1, 0, 0]}}]}


def write(path, document):
    """As the other examples are laid out: a line a member, and a line an item."""
    def line(value):
        return json.dumps(value)

    def block(value, indent):
        pad = " " * indent
        if isinstance(value, dict):
            return "{\n" + ",\n".join(f"{pad}  {line(k)}: {line(v)}" for k, v in value.items()) + f"\n{pad}}}"
        return "[\n" + ",\n".join(f"{pad}  {line(v)}" for v in value) + f"\n{pad}]"

    members = [f"  {line(key)}: " + (block(value, 2) if key in ("lights", "materials", "objects") else line(value))
               for key, value in document.items()]
    path.write_text("{\n" + ",\n".join(members) + "\n}\n", encoding="utf-8")


def main(folder):
    colord = Path(folder)
    observer = primaries.table(360, 5, tables.cut(colord / "cmf" / "CIE1931-2deg-XYZ.cmf", 360, 830))
    d65 = primaries.table(360, 5, tables.cut(colord / "illuminant" / "CIE-D65.sp", 360, 830)[0])
    at, first, second = pair(observer, d65, illuminant_a)
    for illuminant in ("D65", "A"):
        write(ROOT / "api" / "examples" / f"metamers-{illuminant.lower()}.json", example(at, first, second, illuminant))


if __name__ == "__main__":
    main(sys.argv[1])
