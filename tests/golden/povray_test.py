"""The exact tier against POV-Ray, a renderer with a history of its own.

POV-Ray's finish { diffuse phong phong_size } is the same model: phong adds (R.V)^size of the
light, not weighed by N.L, and its `fade_distance D fade_power 2` is 2 / (1 + (d/D)^2), our
attenuation [1/2, 0, 1/(2 D^2)]. A spotlight with `radius` and `falloff` fades by the same
smoothstep of cosines, and `tightness` is our exponent. It casts shadows, which the model does
not have: every scene is one convex solid, whose own shadow begins where N.L = 0. POV-Ray's frame
is left-handed, so z changes sign on the way there.

Both write linear light, POV-Ray as 16-bit PNG: TOLERANCE is half a code of that (7.6e-6) and the
single precision of its colors. Silhouette pixels (reference/phong.py) are left out.
"""

import math
import os
import shutil
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from reference import phong, program

TOLERANCE = 1e-5
POVRAY = shutil.which("povray")

BALL = {"ambient": [0.6, 0.9, 0.3], "diffuse": [0.5, 0.2, 0.1], "specular": 0.3, "shininess": 20}
SUN = {"type": "directional", "direction": [1, -1.5, -2], "color": [0.9, 0.8, 0.7]}
LAMP = {"type": "point", "position": [-3, 4, 5], "color": [0.7, 0.8, 0.9]}


def scene(thing, *lights, **camera):
    return {"image": {"width": 128, "height": 96, "samples": 1},
            "camera": {"position": [1, 1.5, 4], "target": [0, 0, 0], "fov": 38, **camera},
            "ambient": 0.2, "lights": list(lights), "objects": [thing]}


def solid(kind, material=None, **more):
    return {"type": kind, "material": material or BALL, **more}


TURNED = {"scale": [1.3, 0.7, 0.9], "rotate": [30, 40, -20], "translate": [0.1, -0.1, 0.2]}
SCENES = {
    "directional": scene(solid("sphere"), SUN),
    "point": scene(solid("sphere"), LAMP),
    "fading": scene(solid("sphere"), {**LAMP, "attenuation": [0.5, 0, 0.5 / 16]}),
    "sharp_highlight": scene(solid("sphere", {**BALL, "shininess": 270}), LAMP),
    "broad_highlight": scene(solid("sphere", {**BALL, "shininess": 1}), LAMP),
    "light_behind": scene(solid("sphere"), {**LAMP, "position": [3, 1, -4]}),
    "three_lights": scene(solid("sphere"), *[
        {**light, "intensity": 0.4} for light in
        (SUN, LAMP, {"type": "point", "position": [4, -1, 2], "color": [1, 0.3, 0.2]})]),
    "ellipsoid": scene(solid("sphere", transform=TURNED), SUN, {**LAMP, "intensity": 0.3}),
    "box": scene(solid("box", size=[1.2, 1.6, 1], transform=TURNED), LAMP),
    "cylinder": scene(solid("cylinder", radius=0.8, height=1.5, transform=TURNED), LAMP),
    "cone": scene(solid("cone", radius=0.9, height=1.8, transform=TURNED), LAMP),
    "spot": scene(solid("sphere", {**BALL, "specular": 0.6}), {
        "type": "spot", "position": [-1, 2, 4], "direction": [1, -1.8, -4], "angle": 12,
        "penumbra": 0.5, "intensity": 0.8}),
    "spot_with_exponent": scene(solid("sphere"), {
        "type": "spot", "position": [-1, 2, 4], "direction": [1, -2, -4], "angle": 40,
        "penumbra": 1, "exponent": 30}),
    "rolled_camera": scene(solid("box", size=[1.2, 1.6, 1]), LAMP, up=[0.5, 1, 0.2],
                           target=[0.3, 0.2, -0.1], fov=55),
}


def vector(v):
    """In POV-Ray's left-handed frame."""
    return f"<{v[0]!r}, {v[1]!r}, {-v[2]!r}>"


def rgb(value):
    r, g, b = np.broadcast_to(np.float64(value), 3).tolist()
    return f"rgb <{r!r}, {g!r}, {b!r}>"


def light_source(light):
    color = rgb(np.float64(light["color"]) * light.get("intensity", 1)) if "color" in light \
        else rgb(light.get("intensity", 1))
    if light["type"] == "directional":
        away = [-1000 * c for c in light["direction"]]
        return f"light_source {{ {vector(away)} {color} parallel point_at <0, 0, 0> }}"
    more = ""
    if "attenuation" in light:
        _, _, c = light["attenuation"]
        more = f" fade_distance {math.sqrt(0.5 / c)!r} fade_power 2"
    if light["type"] == "spot":
        aim = [p + d for p, d in zip(light["position"], light["direction"])]
        inner = light["angle"] * (1 - light["penumbra"])
        more += (f" spotlight point_at {vector(aim)} radius {inner!r} falloff {light['angle']!r}"
                 f" tightness {light.get('exponent', 0)!r}")
    return f"light_source {{ {vector(light['position'])} {color}{more} }}"


def solid_of(item):
    kind = item["type"]
    if kind == "sphere":
        body = "sphere { 0, 1"
    elif kind == "box":
        x, y, z = (s / 2 for s in item["size"])
        body = f"box {{ <{-x}, {-y}, {-z}>, <{x}, {y}, {z}>"
    elif kind == "cylinder":
        h = item["height"] / 2
        body = f"cylinder {{ <0, {-h}, 0>, <0, {h}, 0>, {item['radius']}"
    else:
        h = item["height"] / 2
        body = f"cone {{ <0, {-h}, 0>, {item['radius']}, <0, {h}, 0>, 0"
    m = item["material"]
    # phong adds the light's color whatever the pigment; ambient is multiplied by the pigment
    pigment = np.float64(m["diffuse"])
    finish = (f"ambient {rgb(np.float64(m['ambient']) / pigment)} diffuse 1"
              f" phong {m['specular']!r} phong_size {m['shininess']!r}")
    t = item.get("transform", {})
    place = ""
    if t:
        x, y, z = t["rotate"]
        sx, sy, sz = t["scale"]
        place = (f" scale <{sx}, {sy}, {sz}> rotate <{-x}, {-y}, {z}>"
                 f" translate {vector(t['translate'])}")
    return f"{body} texture {{ pigment {{ {rgb(pigment)} }} finish {{ {finish} }} }}{place} }}"


def sdl(document):
    image, camera = document["image"], document["camera"]
    aspect = image["width"] / image["height"]
    across = 2 * math.degrees(math.atan(math.tan(math.radians(camera["fov"]) / 2) * aspect))
    up = camera.get("up", [0, 1, 0])
    return "\n".join([
        "#version 3.7;",
        f"global_settings {{ assumed_gamma 1.0 ambient_light {rgb(document['ambient'])} }}",
        f"camera {{ perspective location {vector(camera['position'])} sky {vector(up)}"
        f" right x * {aspect!r} up y look_at {vector(camera['target'])} angle {across!r} }}",
        "background { rgb 0 }", *map(light_source, document["lights"]),
        *map(solid_of, document["objects"])])


def povray(document):
    """[h,w,3] linear."""
    image = document["image"]
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "scene.pov"), "w", encoding="ascii") as file:
            file.write(sdl(document))
        run = subprocess.run(
            [POVRAY, "+Iscene.pov", "+Oscene.png", "+FN16", f"+W{image['width']}",
             f"+H{image['height']}", "-D", "-A", "-GA", "+WT1", "File_Gamma=1.0"],
            cwd=folder, capture_output=True, check=False, timeout=500,
            env={**os.environ, "HOME": folder})
        if run.returncode:
            raise AssertionError(run.stderr.decode()[-1000:])
        with open(os.path.join(folder, "scene.png"), "rb") as file:
            return program.read(file.read(), "png")[0][..., :3] / 65535


@unittest.skipUnless(POVRAY, "povray is not installed")
class PovRay(unittest.TestCase):
    worst = 0

    @classmethod
    def setUpClass(cls):
        workers = ThreadPoolExecutor(4)  # a run is mostly POV-Ray waiting for its own threads
        cls.others = {name: workers.submit(povray, document)
                      for name, document in SCENES.items()}
        workers.shutdown(wait=False)

    @classmethod
    def tearDownClass(cls):
        print(f"largest difference from POV-Ray: {cls.worst:.1e} of white")

    def check(self, name):
        document, other = SCENES[name], self.others[name].result()
        own = program.rgb(program.linear(document, "exact"))
        silhouette = phong.render(document).silhouette
        self.assertLessEqual(silhouette.mean(), 0.02)
        self.assertLess(own.max(), 1)  # POV-Ray's PNG ends there
        self.assertGreater(np.mean(own.max(-1) > 0.01), 0.05)
        difference = np.where(silhouette[..., None], 0, np.abs(own - other))
        PovRay.worst = max(PovRay.worst, difference.max())
        self.assertLessEqual(difference.max(), TOLERANCE,
                             np.argwhere(difference > TOLERANCE)[:3].tolist())


def claim(name):
    return lambda self: self.check(name)


for scene_name in SCENES:
    setattr(PovRay, f"test_{scene_name}", claim(scene_name))


if __name__ == "__main__":
    unittest.main()
