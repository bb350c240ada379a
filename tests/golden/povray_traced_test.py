"""Shadows, mirrors, glass and opacity against POV-Ray, which traces the same rays.

POV-Ray adds `reflection` times what a mirrored ray meets to the light model's, as ours does. A
pigment's `transmit T` leaves 1 - T of the diffuse term and adds T of the refracted ray, so that our
diffuse is P (1 - T) and our transmission T, or our opacity 1 - T if nothing bends. What cannot be
refracted is mirrored in both. Its shadows let `transmit` through at each surface, as ours do with
1 - opacity; ours of transmitting objects are full, so that the scene with glass has lights without
shadows in both, which make no highlights in POV-Ray. That scene has balls of glass alone, in which
nothing is mirrored totally: traced_test.py has that.

Pixels count in sRGB codes of 8 bits. Next to an edge of the picture the two programs' rays, which
POV-Ray keeps in other roundings, may be on either side of it: pixels are left out around which the
picture varies by more than EDGE codes.
"""

import os
import subprocess
import tempfile
import unittest

import numpy as np

import povray_test
from povray_test import POVRAY, light_source, rgb, vector
from reference import program

EDGE = 16
IMAGE = {"width": 160, "height": 120, "samples": 1}
CAMERA = {"position": [1, 2.2, 6], "target": [0, 0.7, 0], "fov": 38}
LAMP = {"type": "point", "position": [-3, 5, 4], "color": [0.7, 0.75, 0.8]}
SUN = {"type": "directional", "direction": [-1, -1.2, -0.7], "color": [0.35, 0.33, 0.3]}
FLOOR = {"type": "plane", "material": {"diffuse": [0.6, 0.55, 0.5]}}


def ball(place, material, radius=1):
    return {"type": "sphere", "radius": radius, "material": material, "transform": {"translate": place}}


def box(place, material, turn=0):
    return {"type": "box", "material": material,
            "transform": {"rotate": [0, turn, 0], "translate": place}}


def scene(objects, lights, trace, **more):
    return {"image": IMAGE, "camera": CAMERA, "ambient": 0.15, "background": [0.2, 0.3, 0.45],
            "lights": lights, "trace": trace, "objects": objects, **more}


CLAY = {"diffuse": [0.7, 0.35, 0.2], "specular": 0.3, "shininess": 30}
MIRROR = {"diffuse": 0.1, "specular": 0.5, "shininess": 80, "reflection": [0.7, 0.65, 0.5]}
GLASS = {"diffuse": 0.05, "transmission": 0.85, "ior": 1.5}
VEIL = {"diffuse": [0.3, 0.6, 0.4], "opacity": 0.6}
ALL = {"shadows": True, "depth": 12, "minContribution": 0}
SCENES = {
    "shadows": scene([FLOOR, ball([-0.8, 1, 0], CLAY), box([1.2, 0.5, 0.6], {"diffuse": 0.6}, 30)],
                     [LAMP, SUN], {"shadows": True}),
    "mirrors": scene([{**FLOOR, "material": {**FLOOR["material"], "reflection": 0.2}},
                      ball([-0.9, 1, 0], MIRROR), ball([1, 0.6, 0.7], CLAY, 0.6),
                      box([1.3, 0.5, -1], {"diffuse": [0.2, 0.3, 0.7], "reflection": 0.3}, 20)],
                     [LAMP, SUN], ALL),
    "glass": scene([FLOOR, ball([-0.7, 1, 0.3], GLASS), ball([1.1, 0.7, 0.9], {**GLASS, "ior": 1.3}, 0.7),
                    ball([0.5, 0.7, -1.6], {"diffuse": CLAY["diffuse"]}, 0.7),
                    box([-2.4, 0.5, -1], {"diffuse": [0.2, 0.5, 0.3]}, 25)],
                   [LAMP, SUN], {"depth": 16, "minContribution": 0}),
    "opacity": scene([FLOOR, ball([-0.7, 1, 0.3], VEIL), box([1.2, 0.501, 0.6], VEIL, 25),
                      ball([0.4, 0.7, -1.6], CLAY, 0.7)], [LAMP, SUN], ALL),
}


def solid_of(item):
    material = item["material"]
    bent, clear = material.get("transmission", 0), 1 - material.get("opacity", 1)
    body = {"sphere": f"sphere {{ 0, {item.get('radius', 1)}",
            "box": "box { <-0.5, -0.5, -0.5>, <0.5, 0.5, 0.5>",
            "plane": "plane { y, 0"}[item["type"]]
    pigment = np.broadcast_to(np.float64(material["diffuse"]), 3) / (1 - bent)
    # transmit leaves 1 - T of ambient and diffuse alike
    finish = (f"ambient 1 diffuse 1 phong {material.get('specular', 0)!r}"
              f" phong_size {material.get('shininess', 1)!r} reflection {rgb(material.get('reflection', 0))}")
    interior = f" interior {{ ior {material['ior']!r} }}" if bent else ""
    place = item.get("transform", {})
    turn = place.get("rotate", [0, 0, 0])[1]
    return (f"{body} texture {{ pigment {{ {rgb(pigment)} transmit {bent + clear!r} }} finish {{ {finish} }} }}"
            f"{interior} rotate <0, {-turn}, 0> translate {vector(place.get('translate', [0, 0, 0]))} }}")


def sdl(document):
    lights = [light_source(light) for light in document["lights"]]
    if not document["trace"].get("shadows"):
        lights = [text[:-1] + " shadowless }" for text in lights]
    empty = povray_test.sdl({**document, "lights": [], "objects": []})
    empty = empty.replace("background { rgb 0 }", f"background {{ {rgb(document['background'])} }}")
    empty = empty.replace("global_settings {", "global_settings { max_trace_level 24 adc_bailout 0 ")
    return "\n".join([empty, *lights, *map(solid_of, document["objects"])])


def povray(document):
    image = document["image"]
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "scene.pov"), "w", encoding="ascii") as file:
            file.write(sdl(document))
        run = subprocess.run(
            [POVRAY, "+Iscene.pov", "+Oscene.png", "+FN16", f"+W{image['width']}", f"+H{image['height']}",
             "-D", "-A", "-GA", "+WT1", "File_Gamma=1.0"],
            cwd=folder, capture_output=True, check=False, timeout=500, env={**os.environ, "HOME": folder})
        if run.returncode:
            raise AssertionError(run.stderr.decode()[-1000:])
        with open(os.path.join(folder, "scene.png"), "rb") as file:
            return program.read(file.read(), "png")[0][..., :3] / 65535


def codes(linear):
    linear = np.clip(linear, 0, 1)
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return 255 * encoded


def calm(picture):
    """Where the eight pixels around differ little."""
    wide = np.pad(picture, ((1, 1), (1, 1), (0, 0)), mode="edge")
    h, w, _ = picture.shape
    around = np.stack([wide[y:y + h, x:x + w] for y in range(3) for x in range(3)])
    return (around.max(0) - around.min(0)).max(-1) <= EDGE


@unittest.skipUnless(POVRAY, "povray is not installed")
class Traced(unittest.TestCase):
    def check(self, name):
        document = SCENES[name]
        own, other = codes(program.rgb(program.linear(document))), codes(povray(document))
        counts = calm(own)
        difference = np.abs(own - other).max(-1)[counts]
        print(f"{name}: {counts.mean():.1%} of the pixels; median {np.median(difference):.2g}, "
              f"99 % {np.quantile(difference, 0.99):.2g}, worst {difference.max():.3g} codes")
        self.assertGreater(counts.mean(), 0.7)
        self.assertLessEqual(np.quantile(difference, 0.99), 2)
        self.assertLessEqual(np.median(difference), 0.1)

    def test_rays_show(self):
        """Without them, the pictures are others."""
        for name, document in SCENES.items():
            plain = codes(program.rgb(program.linear({**document, "trace": {}})))
            traced = codes(program.rgb(program.linear(document)))
            self.assertGreater(np.mean(np.abs(plain - traced).max(-1) > 10), 0.05, name)


def claim(name):
    return lambda self: self.check(name)


for scene_name in SCENES:
    setattr(Traced, f"test_{scene_name}", claim(scene_name))


if __name__ == "__main__":
    unittest.main()
