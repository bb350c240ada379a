"""Documents that differ in all that a document can say: what `./dev same` and answers_test.py ask about.

They are the examples, the scenes of tests/golden and random ones of them, small, with the members
of the lists below in turn. The same ones in every run.
"""

import copy
import json
import os
import random
import sys
from pathlib import Path

SOURCE = Path(os.environ.get("SHADED_SOURCE", Path(__file__).resolve().parents[2]))
sys.path[:0] = [str(SOURCE / "tests"), str(SOURCE / "tests" / "golden")]
import reference_scenes  # noqa: E402
from conformance import mistakes  # noqa: E402

MOST_PIXELS = 40 * 30
SAMPLES = [1, 4, 1, 2, 8, 1, 4, 16, 3]
# Of a prime number each, so that they meet in all ways.
OUTPUTS = [
    {}, {"bitDepth": 16}, {"display": "Rec.1886", "view": "Standard"},
    {"display": "Display P3", "view": "ACES 1.0 - SDR Video"}, {"colorSpace": "YIQ"}, {"colorSpace": "HSV"},
    {"colorSpace": "ACEScg", "bitDepth": 16}, {"colorSpace": "lin_rec709"}, {"channel": "G"},
    {"colorSpace": "YIQ", "channel": "Q"}, {"display": "sRGB", "view": "Raw", "bitDepth": 16}]
ACCURACIES = [
    {"tier": "standard"}, {"tier": "exact"}, {"maxError": 0.5}, {"maxError": 0.02, "metric": "linear"},
    {"maxError": 2, "metric": "code"}, {"tier": "draft"}, {"maxError": 3e-4, "metric": "linear"}]
REST = [{}, {"workingSpace": "ACEScg"}, {"background": None}, {"interpolation": "gouraud"},
        {"colorSpace": "sRGB"}]
LAYERS = ["beauty", "emissive", "ambient", "diffuse", "specular", "light.0", "normal", "position",
          "depth", "object"]


def westin():
    for name, micro in (("grooves", {"angle": 50}), ("weave", {"warp": 0.3}), ("heightfield", {})):
        yield f"westin {name}", {
            "image": {"width": 24, "height": 20, "samples": 4},
            "lights": [{"type": "point", "position": [2, 3, 2]},
                       {"type": "directional", "direction": [1, -1, -2], "color": [0.2, 0.3, 0.5]}],
            "objects": [{"type": "sphere",
                         "material": {"model": "westin", "diffuse": [0.9, 0.5, 0.2],
                                      "microgeometry": {"type": name, **micro}}}]}


def models():
    for name, document in reference_scenes.further_models():
        yield f"reference {name}", smaller(document)
    shiny = {"lobes": [{"specular": 0}, {"specular": [0.1, 0.3, 0.2], "shininess": 200}]}
    facets = {"lobes": [{"roughness": 0.1, "weight": 0.5}, {"roughness": 0.4, "weight": 0.5}]}
    for model, members in (("phong", shiny), ("blinn-phong", shiny), ("phong-normalized", shiny),
                           ("cook-torrance", facets)):
        yield f"lobes of {model}", {
            "image": {"width": 32, "height": 24},
            "objects": [{"type": "torus", "material": {"model": model, **members}},
                        {"type": "sphere", "radius": 0.5, "material": {"specular": 0.5}}],
            "output": {"format": "exr", "bitDepth": "float", "layers": [
                "beauty", "specular", "lobe.0", "lobe.1", *(["lobe.2"] if members is shiny else [])]}}


def smaller(document):
    """With as many pixels as a test has time for."""
    image = {"width": 512, "height": 512, "samples": 4, **document.get("image", {})}
    most = MOST_PIXELS
    if any(light.get("type") == "environment" for light in document.get("lights", [])):
        most, image["samples"] = 100, 1  # the exact tier takes half a millisecond a term
    by = (most / (image["width"] * image["height"])) ** 0.5
    if by < 1:
        image.update(width=max(1, round(image["width"] * by)),
                     height=max(1, round(image["height"] * by)))
        image.pop("region", None)
    return {**document, "image": image}


# What comes last, so that others keep their numbers.
AROUND = ("sky", "studio", "finishes")


def examples():
    for path in sorted((SOURCE / "api" / "examples").glob("*.json")):
        if path.stem not in AROUND:
            yield f"example {path.stem}", smaller(json.loads(path.read_text()))


def around():
    for name in AROUND:
        yield f"example {name}", smaller(json.loads((SOURCE / "api" / "examples" / f"{name}.json").read_text()))


def made():
    scenes = [*((name, document) for name, document in reference_scenes.by_hand()
                if not name.startswith("light_in_plane") or name.endswith("_0")),
              *((f"seed {seed}", reference_scenes.by_seed(seed)) for seed in range(24))]
    for i, (name, document) in enumerate(scenes):
        document = smaller({**document, "image": {"width": 36, "height": 30},
                            "accuracy": ACCURACIES[i % len(ACCURACIES)],
                            "output": OUTPUTS[i % len(OUTPUTS)], **REST[i % len(REST)]})
        document["image"]["samples"] = SAMPLES[i % len(SAMPLES)]
        if i % 13 == 0:
            document["image"]["region"] = [3, 5, 17, 19]
        yield f"{name} ({i})", document


def many_lights():
    """Lights that matter to some, that touch, that are far; and materials of several lobes."""
    for i, attenuation in enumerate(([1, 0, 0], [0, 0, 1], [0.1, 0.3, 0.2])):
        lights = [{"type": ["point", "spot", "point"][k % 3], "attenuation": attenuation,
                   "position": [4 * (k % 7 - 3), 1.2 + k % 5, 3 * (k % 4 - 1)],
                   "color": [0.1 + 0.1 * (k % 3), 0.2, 0.05 * (k % 8)], "intensity": 0.1 * 1.3 ** -k,
                   **({"direction": [0.2 * (k % 3 - 1), -1, 0.1], "angle": 10 + k, "penumbra": 0.1 * (k % 4)}
                      if k % 3 == 1 else {})} for k in range(40)]
        objects = [{"type": "sphere", "radius": 0.4, "material": {
            "diffuse": [0.1 * (k % 9), 0.3, 0.5], "specular": 0.05 * (k % 4), "shininess": 3 ** (k % 7),
            "lobes": [{"specular": [0.1, 0.02 * k, 0], "shininess": 2 + k}] if k % 5 == 0 else []},
            "transform": {"translate": [k % 6 - 2.5, k // 6 * 0.5 - 1, -0.3 * (k % 4)]}}
            for k in range(24)]
        for k, accuracy in enumerate(ACCURACIES):
            # A budget that nothing meets is a refusal, and an answer, too.
            yield f"lamps {i} {k}", {
                "image": {"width": 40, "height": 30, "samples": SAMPLES[(i + k) % len(SAMPLES)]},
                "lights": lights, "objects": objects, "accuracy": accuracy, "ambient": [0.1, 0, 0.05 * i],
                "output": OUTPUTS[(3 * i + k) % len(OUTPUTS)]}


def corners():
    """What plans reason about: lights behind, beside and on what is seen, and what is not lit."""
    shiny = {"diffuse": 0.5, "specular": 0.4, "shininess": 12}
    disc = {"type": "disc", "radius": 0.8, "material": shiny}
    out_of_sight = [[0, 0, 3], [9, 0, -4], [0, 9, -4], [-9, 0.5, -3]]
    for kind, more in (("orthographic", {"height": 3}), ("perspective", {"fov": 50})):
        camera = {"type": kind, "position": [0, 0, 0], "target": [0, 0, -1], **more}
        for number, accuracy in enumerate(ACCURACIES[:4]):
            # The brightest pieces are out of sight.
            yield f"{kind} amid things {number}", {
                "camera": camera, "image": {"width": 40, "height": 30}, "accuracy": accuracy,
                "lights": [{"type": "point", "position": [x, y, z + 0.3], "attenuation": [0, 0, 1],
                            "color": [0.02, 0.1, 0.3]} for x, y, z in out_of_sight],
                "objects": [{**disc, "transform": {"rotate": [90, 0, 0], "translate": at}}
                            for at in [*out_of_sight, [0, 0, -4]]]}
            yield f"{kind} and lamps on things {number}", {
                "camera": {**camera, "position": [0.1, 0.2, 3]}, "accuracy": accuracy,
                "image": {"width": 24 + number, "height": 18, "samples": SAMPLES[number]},
                "lights": [{"type": "point", "position": [0.3, -0.2, 0], "intensity": 1e-4,
                            "attenuation": [0, 0, 1]},
                           {"type": "point", "position": [0, 0.31, 0.0001], "intensity": 0.01,
                            "attenuation": [0, 1, 0], "minDistance": 0.001 * number}],
                "objects": [{**disc, "radius": 1.4, "transform": {"rotate": [90, 0, 0]}}]}
    yield "black beside lit", {
        "image": {"width": 40, "height": 30}, "lights": [{"type": "point", "position": [2, 3, 4]}],
        "objects": [{"type": "sphere", "radius": 0.5, "material": {
            "diffuse": 0, "emissive": [0.2, 0.1, 0]}, "transform": {"translate": [-1, 0, 0]}},
                    {"type": "sphere", "radius": 0.5, "transform": {"translate": [1, 0, 0]}}]}
    shiniest = "50% of the \u00e4ltest, \"brass\""
    yield "warnings", {"image": {"width": 8, "height": 8},
                       "materials": {shiniest: {"shininess": 5000, "diffuse": -0.1}},
                       "objects": [{"type": "sphere", "material": shiniest}]}
    # Each shape by itself, with lights all around: which of them are behind what is seen?
    for seed in range(28):
        r = random.Random(seed)
        name = ["cone", "cylinder", "box", "disc", "torus", "sphere", "cone"][seed % 7]

        def place(size, r=r):
            return [r.uniform(-size, size) for _ in range(3)]

        camera = {"position": [4 * r.uniform(-1, 1), 4 * r.uniform(-1, 1), 3]}
        if seed % 4 == 1:
            camera = {**camera, "type": "orthographic", "height": 4}
        yield f"{name} among lights {seed}", {
            "image": {"width": 32, "height": 24}, "camera": camera,
            "lights": [{"type": ["point", "directional"][k % 2], "intensity": 0.2,
                        ["position", "direction"][k % 2]: place(3)} for k in range(12)],
            "objects": [{**reference_scenes.shape(name, {
                "rotate": place(180), "scale": [r.uniform(0.5, 1.5) for _ in range(3)]}),
                "material": {**shiny, "side": ["both", "front"][seed % 3 == 0]}}]}


def spectral():
    """Spectra of all kinds, in channels and without them."""
    bumps = {"wavelengths": [400, 450.5, 520, 610, 690], "values": [0.1, 0.5, 0.2, 0.8, 0.3]}
    materials = [{"diffuse": {"spectrum": "TCS03"}, "specular": bumps, "shininess": 9},
                 {"diffuse": bumps, "emissive": {"spectrum": "F4", "scale": 0.1}, "specular": [0.1, 0.3, 0.2],
                  "lobes": [{"specular": {"spectrum": "TCS11"}, "shininess": 60}]},
                 {"model": "cook-torrance", "fresnel": {"n": "copper"}, "diffuse": [0.1, 0.1, 0.3]},
                 {"model": "oren-nayar", "sigma": 20, "diffuse": {"spectrum": "TCS13"}}]
    lights = [{"type": "point", "position": [2, 3, 4], "color": {"spectrum": "A"}, "intensity": 0.7,
               "ambient": {"spectrum": "F11", "scale": 0.1}},
              {"type": "directional", "direction": [1, -0.2, -1], "color": {**bumps, "scale": 0.4}},
              {"type": "ambient", "color": [0.1, 0.2, 0.1]}]
    for i, of in enumerate([True, {"channels": 33}, {"channels": 20, "from": 365.5, "to": 800}, False]):
        yield f"spectra {i}", {
            "spectral": of, "image": {"width": 40, "height": 30, "samples": SAMPLES[i]}, "lights": lights,
            "ambient": {"spectrum": "D50", "scale": 0.2}, "output": OUTPUTS[i], **REST[i],
            "objects": [{"type": "sphere", "radius": 0.5, "material": material,
                         "transform": {"translate": [k - 1.5, 0.3 * (k % 2), 0]}}
                        for k, material in enumerate(materials)]}


def layered():
    for name, document in reference_scenes.by_hand():
        if name in ("lobes", "spot", "colors", "mesh_gouraud", "sixty_lights", "samples_5"):
            yield f"layers of {name}", {**smaller(document), "output": {
                "format": "exr", "bitDepth": "float", "layers": LAYERS}}


def traced():
    """Shadows, mirrors, glass and opacity, on everything that has a surface."""
    kinds = ["sphere", "disc", "box", "cylinder", "cone", "torus"]
    materials = [{"diffuse": [0.6, 0.3, 0.2, 0.5]}, {"reflection": [0.5, 0.3, 0.1], "specular": 0.3},
                 {"transmission": 0.7, "ior": 1.4, "diffuse": 0.1}, {"opacity": [0, 0.5, 1]}, {}]
    for i, trace in enumerate(({"shadows": True}, {"depth": 3}, {"shadows": True, "depth": 5, "minContribution": 0},
                               {"shadows": True, "depth": 16, "minContribution": 0.05})):
        for k, interpolation in enumerate(("phong", "flat", "gouraud")):
            objects = [{"type": kind, "material": materials[(i + n) % 5],
                        **({"tube": 0.4} if kind == "torus" else {}),
                        "transform": {"rotate": [20 * n, 30, 10 * i], "translate": [1.3 * (n % 3) - 1.3, n // 3 - 0.3, -n % 4]}}
                       for n, kind in enumerate(kinds)]
            floor = {"type": "plane", "interpolation": "phong", "transform": {"translate": [0, -1.5, 0]}}
            yield f"traced {i} {interpolation}", {
                "image": {"width": 36, "height": 27, "samples": SAMPLES[(3 * i + k) % 9]}, "trace": trace,
                "camera": {"position": [1, 2, 6]}, "interpolation": interpolation,
                "background": None if k == 2 else [0.1, 0.2, 0.3],
                "lights": [{"type": "point", "position": [2, 4, 3]},
                           {"type": "spot", "position": [-2, 4, 1], "direction": [0.4, -1, 0], "intensity": 0.5},
                           {"type": "directional", "color": [0.2, 0.2, 0.4]}],
                "objects": [floor, *objects]}


def shaped():
    """Lights with a shape, alone and together, near, far, cut by horizons, seen and not."""
    lights = {"rect": {"type": "rect", "position": [1, 2, 1], "direction": [-1, -2, -1],
                       "size": [1.2, 0.4]},
              "disc": {"type": "disc", "position": [-1, 1.5, 1], "direction": [1, -1, -1]},
              "sphere": {"type": "sphere", "position": [1.4, -0.6, 0.6], "radius": 0.5}}
    objects = [{"type": "sphere", "material": {"specular": 0.5, "shininess": 40.5}},
               {"type": "plane", "transform": {"translate": [0, -1, 0]},
                "material": {"specular": 0.5, "shininess": 12}}]
    small = {"image": {"width": 24, "height": 18}}
    for name, light in lights.items():
        yield f"{name} light", {**small, "lights": [light], "objects": objects}
        yield f"{name} light, seen", {**small, "objects": objects,
                                      "lights": [{**light, "visible": True}]}
        far = {**light, "position": [2e6, 3e6, 1e6], "direction": [-2, -3, -1], "intensity": 1e13}
        if name == "sphere":
            del far["direction"]
        yield f"{name} light, far", {**small, "lights": [far], "objects": objects}
    yield "lights of all shapes", {**small, "lights": list(lights.values()), "objects": objects}


def seen_through():
    for number, output in enumerate(({}, {"format": "exr", "layers": LAYERS}, {"format": "tiff", "bitDepth": 16},
                                     {"format": "hdr", "matte": "#48c"})):
        yield f"a background with an alpha {number}", {
            "image": {"width": 40, "height": 30, "samples": [1, 4, 3, 4][number]}, "accuracy": ACCURACIES[number],
            "background": "oklch(60% 0.1 200 / 40%)", "lights": [{"type": "point", "position": [2, 3, 4]}],
            "objects": [{"type": "sphere", "material": {"diffuse": "tomato", "specular": "rgb(20% 20% 30%)"}}],
            "output": output}


def good():
    for make in (corners, examples, made, many_lights, layered, westin, traced, shaped, seen_through, spectral, models, around):
        yield from make()


def bad():
    """Documents with one mistake."""
    for document, written in ((mistakes.FIRST, mistakes.OF_FIRST),
                              (mistakes.SECOND, mistakes.OF_SECOND)):
        for mistake in mistakes.catalogue(document, written):
            broken = copy.deepcopy(document)
            for edit in mistake.edits:
                edit(broken)
            yield mistake.name, broken
