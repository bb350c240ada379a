"""The catalogue of violations_test.py: two valid documents, and what breaks them in one way each."""

import copy
import json

MATRIX = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
TRIANGLE = [0, 0, 0, 1, 0, 0, 0, 1, 0]

# Together they hold every member that there is.
FIRST = {
    "$schema": "scene.schema.json",
    "workingSpace": "lin_rec709",
    "colorSpace": "wide",
    "camera": {"type": "perspective", "position": [0, 1, 4], "target": [0, 0, 0],
               "up": [0, 1, 0], "fov": 40},
    "image": {"width": 64, "height": 48, "samples": 4, "region": [1, 2, 30, 40]},
    "ambient": [0.1, 0.2, 0.3],
    "background": {"space": "sRGB", "value": [0.1, 0.2, 0.3]},
    "lights": [
        {"type": "ambient", "name": "sky", "color": 0.5, "intensity": 2},
        {"type": "directional", "direction": [0, -1, -1], "color": "#ffeedd", "intensity": 1,
         "ambient": 0.1, "frame": "world"},
        {"type": "point", "position": [3, 3, 3], "color": [1, 1, 1], "intensity": 1,
         "ambient": "#123", "attenuation": [1, 0, 0.5], "minDistance": 0.1, "frame": "camera"},
        {"type": "spot", "position": [0, 4, 0, 2], "direction": [0, -1, 0], "angle": 30,
         "penumbra": 0.2, "exponent": 1, "color": {"space": "sRGB", "value": [1, 0.5, 0]},
         "intensity": 3, "ambient": 0, "attenuation": [0, 0, 1], "minDistance": 0,
         "frame": "world"},
        {"position": [1, 1, 1, 0], "name": "", "color": 1, "intensity": 1, "ambient": 0, "frame": "world",
         "attenuation": [1, 0, 0], "minDistance": 0},
        {"type": "directional", "position": [1, 1, 1, 0]},
        {"type": "rect", "name": "window", "position": [0, 4, 0], "direction": [0, -1, 0],
         "up": [0, 0, 1], "size": [2, 1], "visible": True, "color": 1, "intensity": 1,
         "ambient": 0, "frame": "world"},
        {"type": "disc", "position": [0, 4, 0, 1], "direction": [0, -1, 0], "radius": 0.5,
         "visible": False, "color": 1, "intensity": 1, "ambient": 0, "frame": "world"},
        {"type": "sphere", "position": [3, 3, 3], "radius": 0.5, "visible": True, "color": 1,
         "intensity": 1, "ambient": 0, "frame": "camera"},
    ],
    "interpolation": "phong",
    "materials": {
        "clay": {"model": "phong", "preset": "jade", "emissive": 0, "ambient": 0.1,
                 "diffuse": [0.5, 0.4, 0.3], "specular": 0.2, "shininess": 20,
                 "lobes": [{"specular": 0.1, "shininess": 200}], "side": "front", "specularAntialiasing": True,
                 "reflection": [0.1, 0.1, 0.2], "transmission": 0.2, "ior": 1.3},
        "plaster": {"model": "oren-nayar", "emissive": 0, "ambient": 0.1, "diffuse": 0.7,
                    "sigma": 20, "side": "both"},
        "coin": {"model": "cook-torrance", "preset": "measured-gold", "emissive": 0, "ambient": 0.1,
                 "diffuse": 0.1, "fresnel": {"n": "gold", "k": [3, 2.4, 1.6]}, "side": "both",
                 "lobes": [{"roughness": 0.3, "weight": 0.5}, {"roughness": 0.1}], "specularAntialiasing": False},
        "lacquer": {"model": "cook-torrance", "fresnel": {"f0": [0.04, 0.04, 0.05]}},
        "worn": {"model": "cook-torrance",
                 "fresnel": {"f0": {"pattern": "grid", "colors": [0.04, 0.4], "width": 0.2}}},
        "pane": {"diffuse": 0.2, "opacity": [0.5, 0.5, 0.5]},
        "veil": {"diffuse": [0.5, 0.4, 0.3, 0.5]},
        "cloth": {"model": "westin", "diffuse": 0.4, "side": "both",
                  "microgeometry": {"type": "weave", "warp": 0.4, "weft": 0.3}},
        "wood": {"model": "westin", "diffuse": [0.4, 0.3, 0.2], "microgeometry": {"type": "grooves", "angle": 30}},
        "sand": {"model": "westin", "diffuse": "#444", "microgeometry": {"type": "heightfield", "slope": 0.5}},
    },
    "objects": [
        {"type": "sphere", "radius": 1, "material": "clay", "interpolation": "gouraud",
         "segments": 16,
         "transform": {"translate": [0, 0, 0], "rotate": [0, 10, 0], "scale": 2}},
        {"type": "plane", "interpolation": "phong", "material": "brass",
         "transform": {"translate": [0, -1, 0], "scale": [1, 2, 1]}},
        {"type": "disc", "radius": 2, "segments": 8, "material": {"diffuse": "#808080"}},
        {"type": "box", "size": [1, 2, 3], "transform": {"matrix": MATRIX}},
        {"type": "cone", "name": "hat", "radius": 1, "height": 2},
        {"type": "torus", "radius": 1, "tube": 0.5, "interpolation": "flat", "segments": 8},
        {"type": "mesh", "positions": TRIANGLE, "indices": [0, 1, 2],
         "normals": [0, 0, 1, 0, 0, 1, 0, 1, 1]},
        {"type": "mesh", "positions": TRIANGLE, "normals": None},
        {"type": "plane"},
        {"type": "mesh", "mesh": "wedge"},
    ],
    "meshes": {"wedge": {"positions": TRIANGLE, "indices": [0, 2, 1],
                         "normals": [0, 0, -1, 0, 0, -1, 0, 0, -1]}},
    "trace": {"shadows": True, "shadowSamples": 4, "depth": 2, "minContribution": 0.01},
    "accuracy": {"tier": "exact"},
    "outputs": [
        {"name": "a", "format": "png", "display": "sRGB", "view": "Standard", "bitDepth": 16,
         "quality": 80, "effort": 6, "channel": "G"},
        {"name": "b", "format": "exr", "colorSpace": "wide", "bitDepth": "half",
         "layers": ["beauty", "light.0", "depth"]},
        {"name": "c", "colorSpace": "YIQ", "channel": "I"},
        {"name": "d", "format": "jpeg"},
        {"name": "e", "format": "exr", "layers": ["beauty"]},
    ],
}

SECOND = {
    "camera": {"type": "orthographic", "position": [0, 0, 4], "height": 3},
    "image": {"width": 64, "height": 48},
    "background": None,
    "lights": [{"type": "point", "color": 1, "intensity": 1},
               {"type": "environment", "name": "room", "map": "studio", "rotate": 30, "visible": False,
                "intensity": 1}],
    "materials": {"grey": {"diffuse": 0.5}},
    "objects": [{"type": "cylinder", "radius": 1, "height": 2, "material": "grey"}],
    "accuracy": {"maxError": 0.5, "metric": "code"},
    "output": {"format": "webp", "colorSpace": "sRGB", "bitDepth": 8, "channel": "R"},
}

# No list is there twice: an edit is of one place.
FIRST, SECOND = json.loads(json.dumps([FIRST, SECOND]))

# ---- Edits ----


def keys(pointer):
    return tuple(int(key) if key.isdigit() else key.replace("~1", "/")
                 for key in pointer.split("/")[1:])


def at(document, path):
    for key in path:
        document = document[key]
    return document


def put(pointer, value):
    """Sets a member or an item."""
    def edit(document):
        at(document, keys(pointer)[:-1])[keys(pointer)[-1]] = copy.deepcopy(value)
    return edit, {keys(pointer)}


def drop(pointer):
    """Removes a member."""
    def edit(document):
        del at(document, keys(pointer)[:-1])[keys(pointer)[-1]]
    return edit, {keys(pointer)}


def push(pointer, *values):
    """Makes an array longer."""
    def edit(document):
        at(document, keys(pointer)).extend(copy.deepcopy(list(values)))
    return edit, {keys(pointer) + ("length",)}


def pop(pointer, last):
    """Makes an array shorter; `last` is the index of its last item."""
    def edit(document):
        at(document, keys(pointer)).pop()
    return edit, {keys(pointer) + ("length",), keys(pointer) + (last,)}


def meet(a, b):
    """Whether two mistakes are made at one place, or one inside of the other."""
    return any(p[:len(q)] == q or q[:len(p)] == p for p in a.slots for q in b.slots)


class Mistake:
    def __init__(self, name, *edits):
        self.name = name
        self.edits = [edit for edit, _ in edits]
        self.slots = set().union(*(slots for _, slots in edits))
        self.errors = None

    def make(self, document):
        for edit in self.edits:
            edit(document)


# ---- The catalogue ----

LONG = "x" * 70
SPHERE = {"type": "sphere"}

# What one document breaks in one way. The pointers of the edits are the names.
OF_FIRST = [
    [put("/workingSpace", "nowhere")],
    [put("/workingSpace", "sRGB")],
    [put("/colorSpace", "nowhere")],
    [put("/colorSpace", "raw")],
    # Camera and image
    [put("/camera/type", "fisheye")],
    [put("/camera/height", 2)],
    [put("/camera/fov", 180)],
    [put("/camera/position", [0, 0, 0])],
    [put("/camera/up", [0, 0, 0])],
    [put("/camera/up", [0, 1, 4])],
    [push("/camera/position", 1)],
    [pop("/camera/target", 2)],
    [pop("/camera/up", 2)],
    [put("/image/width", 0)],
    [put("/image/width", 64.5)],
    [put("/image/height", 65536)],
    [put("/image/height", -0.5)],
    [put("/image/samples", 65)],
    [put("/image/region/0", -1)],
    [put("/image/region/1", 48.5)],
    [put("/image/region/2", 100000)],
    [put("/image/region/3", 0)],
    [put("/image/region/3", 47)],
    [push("/image/region", 1)],
    [pop("/image/region", 3)],
    [put("/image/width", 60000), put("/image/height", 60000),
     put("/image/region", [0, 0, 60000, 60000])],
    # Colors
    [push("/ambient", 0.5)],
    [pop("/ambient", 2)],
    [put("/ambient", "reed")],
    [put("/ambient", {"space": "raw", "value": [1, 1, 1]})],
    [put("/ambient", {"value": [1, 1, 1]})],
    [put("/ambient/0", 1e300)],
    [put("/background/space", "nowhere")],
    [drop("/background/value")],
    [push("/background/value", 1)],
    [put("/background/value/1", 1e300)],
    # Lights
    [push("/lights", *[{"type": "point"}] * 95)],
    [put("/lights", {})],
    [put("/lights/0/type", "lamp")],
    [put("/lights/0/position", [1, 1, 1])],
    [put("/lights/0/color", 1e38), put("/lights/0/intensity", 1e308)],
    [put("/lights/1/direction", [0, 0, 0])],
    [put("/lights/1/position", [1, 1, 1, 0])],
    [put("/lights/1/frame", "eye")],
    [put("/lights/1/ambient", "#12345")],
    [put("/lights/1/intensity", 1e308), put("/lights/1/color", 1e38)],
    [put("/lights/1/attenuation", [1, 0, 0])],
    [put("/lights/2/type", "lamp")],
    [drop("/lights/2/type")],
    [put("/lights/2/position", [1, 1, 1, 0])],
    [put("/lights/2/position", [1e300, 1, 1, 1e-300])],
    [put("/lights/2/color", [1e38, 1, 1]), put("/lights/2/intensity", 1e308)],
    [put("/lights/2/color/1", None)],
    [pop("/lights/2/color", 2)],
    [put("/lights/2/attenuation", [0, 0, 0])],
    [put("/lights/2/attenuation/1", -1)],
    [push("/lights/2/attenuation", 1)],
    [put("/lights/2/minDistance", -1)],
    [put("/lights/2/angle", 20)],
    [put("/lights/3/position/3", 0)],
    [push("/lights/3/position", 1)],
    [put("/lights/3/position/2", "x")],
    [put("/lights/3/direction", [0, 0, 0])],
    [put("/lights/3/angle", 181)],
    [put("/lights/3/penumbra", 2)],
    [put("/lights/3/exponent", -1)],
    [put("/lights/3/color/space", "nowhere")],
    [put("/lights/3/color/value", [1e38, 1, 1]), put("/lights/3/intensity", 1e308)],
    [put("/lights/4/position", [0, 0, 0, 0])],
    [drop("/lights/4/position")],
    [put("/lights/4/direction", [0, 1, 0])],
    [put("/lights/4/color", "reed")],
    [put("/lights/4/color", "rgb(1 2)")],
    [put("/lights/4/color", [1, 1, 1, 0.5])],
    [put("/background", [1, 1, 1, 2])],
    [put("/lights/5/position/3", 1)],
    [put("/lights/5/position", [0, 0, 0, 0])],
    [put("/lights/5/direction", [0, 1, 0])],
    [put("/camera/position", [1.7e308, 1, 4]), put("/lights/2/position", [1.7e308, 0, 1.7e308])],
    # Materials
    [put("/materials/" + LONG, {})],
    [put("/lights/6/size", [1, 0])],
    [push("/lights/6/size", 1)],
    [put("/lights/6/up", [0, 2, 0])],
    [put("/lights/6/direction/0", "x")],
    [put("/lights/6/radius", 1)],
    [put("/lights/6/attenuation", [0, 0, 1])],
    [put("/lights/7/radius", 0)],
    [put("/lights/7/up", [0, 1, 0])],
    [put("/lights/7/position", [1, 1, 1, 0])],
    [put("/lights/8/direction", [0, 1, 0])],
    [put("/lights/8/minDistance", 1)],
    [put("/materials/tin", {"diffuse": "rde"})],
    [put("/materials/clay/model", "blinn")],
    [put("/materials/clay/preset", "no such")],
    [put("/materials/clay/diffuse/0", "x")],
    [put("/materials/clay/shininess", -1)],
    [put("/materials/clay/lobes/0/shininess", -1)],
    [push("/materials/clay/lobes", *[{}] * 64)],
    [put("/materials/clay/side", "back")],
    [put("/materials/clay/specularAntialiasing", 1)],
    [put("/materials/plaster/specularAntialiasing", True)],
    [put("/materials/cloth/specularAntialiasing", True)],
    [put("/materials/plaster/model", "rough")],
    [put("/materials/plaster/sigma", 91)],
    [put("/materials/plaster/model", "lambert")],
    [put("/materials/plaster/specular", 0.5)],
    [put("/materials/coin/fresnel/n", "tin")],
    [put("/materials/coin/fresnel/n", {"pattern": "checker", "colors": [1, 2]})],
    [put("/materials/worn/fresnel/f0/colors", [0.04])],
    [put("/materials/worn/fresnel/f0/octaves", 2)],
    [put("/materials/coin/fresnel/k/1", -1)],
    [put("/materials/coin/lobes/0/roughness", 0)],
    [put("/materials/coin/shininess", 20)],
    [put("/materials/clay/ior", 0)],
    [put("/materials/clay/transmission", -0.5)],
    [put("/materials/clay/reflection/1", -0.5)],
    [put("/materials/pane/opacity/1", 1.5)],
    [put("/materials/pane/diffuse", [0.5, 0.4, 0.3, 0.5])],
    [put("/materials/veil/diffuse", [0.5, 0.4, 0.3, 2])],
    [put("/materials/veil/diffuse", [0.5, 0.4, 0.3, 0.5, 1])],
    # What is traced
    [put("/trace", 1)],
    [put("/trace/shadows", 1)],
    [put("/trace/shadowSamples", 0)],
    [put("/trace/depth", 17)],
    [put("/trace/minContribution", 2)],
    # Objects
    [put("/interpolation", "flat")],
    [push("/objects", *[SPHERE] * 95)],
    [push("/objects", *[{"type": "torus", "interpolation": "flat", "segments": 1024}] * 3)],
    [push("/objects", {"type": "mesh", "positions": TRIANGLE, "indices": [0] * 5,
                       "normals": [1] * 6 + [0] * 3})],
    [put("/objects/0/type", "shpere")],
    [put("/objects/0/radius", 0)],
    [put("/objects/0/radius", 1e-320)],
    [put("/objects/0/tube", 1)],
    [put("/objects/0/material", "no such")],
    [put("/objects/0/segments", 2)],
    [put("/objects/0/interpolation", "smooth")],
    [put("/objects/0/transform/scale", 0)],
    [put("/objects/0/transform/scale", 1e-320)],
    [push("/objects/0/transform/rotate", 1)],
    [put("/objects/0/transform/translate/1", "x")],
    [put("/objects/0/transform/matrix", MATRIX)],
    [put("/objects/0/transform/matrix", [0] * 15 + [1])],
    [put("/objects/1/interpolation", "gouraud")],
    [put("/objects/1/transform/scale/1", 0)],
    [put("/objects/1/transform/scale/0", "x")],
    [pop("/objects/1/transform/scale", 2)],
    [put("/objects/2/material/diffuse", "rgb(1 2 3 / x)")],
    [put("/objects/2/material/shininess", -1)],
    [put("/objects/3/size/1", 0)],
    [push("/objects/3/size", 1)],
    [put("/objects/3/transform/matrix/0", 0)],
    [put("/objects/3/transform/matrix/5", "x")],
    [put("/objects/3/transform/matrix/7", 1)],
    [push("/objects/3/transform/matrix", 0)],
    [put("/objects/3/transform/scale", 2)],
    [put("/objects/3/transform/scale", 1e-320)],
    [drop("/objects/4/type")],
    [put("/objects/4/height", 0)],
    [put("/objects/5/tube", -1)],
    [put("/objects/6/type", "msh")],
    [drop("/objects/6/positions")],
    [put("/objects/6/positions/4", None)],
    [push("/objects/6/positions", 0)],
    [put("/objects/6/indices/2", 9)],
    [put("/objects/6/indices/1", 0.5)],
    [put("/objects/6/indices/0", "x")],
    [push("/objects/6/indices", 9)],
    [put("/objects/6/indices", [9] * 9)],
    [put("/objects/6/normals/1", "x")],
    [put("/objects/6/normals/5", 0)],
    [push("/objects/6/normals", 1)],
    [push("/objects/6/normals", 1, 1, 1)],
    [put("/objects/6/normals", [])],
    [put("/objects/6/segments", 4)],
    [put("/objects/6/normals/4", None)],
    [push("/objects/7/positions", 0, 0, 0)],
    [put("/objects/7/positions/8", "x")],
    [put("/objects/8/type", "plain")],
    # Meshes that objects share
    [put("/meshes", [])],
    [put("/meshes/wedge", 1)],
    [drop("/meshes/wedge/positions")],
    [put("/meshes/wedge/positions/4", None)],
    [push("/meshes/wedge/positions", 0, 0, 0)],
    [put("/meshes/wedge/indices/2", 9)],
    [put("/meshes/wedge/normals/5", 0)],
    [put("/meshes/wedge/radius", 1)],
    [put("/objects/9/mesh", "wegde")],
    [put("/objects/9/mesh", 7)],
    [put("/objects/9/data", "x")],
    [put("/objects/9/positions", TRIANGLE)],
    [put("/objects/0/mesh", "wedge")],
    # Accuracy and outputs
    [put("/accuracy/tier", "best")],
    [put("/accuracy/maxError", 1)],
    [put("/accuracy/metric", "code")],
    [put("/output", {})],
    [put("/output", {"format": "gif", "layers": []})],
    [push("/outputs", *[{"name": f"x{i}"} for i in range(12)])],
    [drop("/outputs/0/name")],
    [put("/outputs/0/name", "a b")],
    [put("/outputs/0/format", "gif")],
    [put("/outputs/0/format", "jpeg")],
    [put("/outputs/0/display", "no such")],
    [put("/outputs/0/view", "no such")],
    [put("/outputs/0/colorSpace", "YIQ")],
    [put("/outputs/0/bitDepth", 12)],
    [put("/outputs/0/bitDepth", "half")],
    [put("/outputs/0/quality", 101)],
    [put("/outputs/0/quality", 0.5)],
    [put("/outputs/0/effort", 7)],
    [put("/outputs/0/channel", "no such")],
    [put("/outputs/0/channel", "Y")],
    [put("/outputs/0/layers", ["beauty"])],
    [put("/outputs/0/layers", [])],
    [put("/outputs/1/name", "a")],
    [put("/outputs/1/format", "gif")],
    [put("/outputs/1/format", "png"), drop("/outputs/1/bitDepth")],
    [put("/outputs/1/colorSpace", "no such")],
    [put("/outputs/1/colorSpace", "sRGB")],
    [put("/outputs/1/view", "Raw")],
    [put("/outputs/1/channel", "R")],
    [put("/outputs/1/bitDepth", 8)],
    [put("/outputs/1/layers/0", "no such")],
    [put("/outputs/1/layers/1", "light.99999")],
    [put("/outputs/1/layers/2", "light.x")],
    [put("/outputs/1/layers/2", "light.<i>")],
    [push("/outputs/1/layers", "beauty")],
    [put("/outputs/2/channel", "R")],
    [put("/outputs/2/scope", "waveform")],
    [put("/outputs/3/scope", "oscilloscope")],
    [put("/outputs/2/name", "a")],
    [put("/outputs/3/bitDepth", 16)],
    [put("/outputs/3/name", "b")],
    [put("/outputs/4/display", "sRGB")],
    [put("/outputs/4/channel", "Q"), drop("/outputs/4/layers")],
]

OF_SECOND = [
    [put("/lights/1/map", "attic")],
    [put("/lights/1/map", 3)],
    [drop("/lights/1/map")],
    [put("/lights/1/rotate", "x")],
    [put("/lights/1/visible", 1)],
    [put("/lights/1/color", 1)],
    [put("/lights/1/direction", [0, 1, 0])],
    [put("/camera/fov", 40)],
    [put("/camera/height", 0)],
    [put("/camera/up", [0, 0, 1])],
    [put("/camera/target", [0, 0, 4])],
    [put("/image/width", 16384)],
    [put("/image/height", 65537)],
    [put("/image/height", 0)],
    [put("/image/samples", 1.5)],
    [put("/image/width", 8192), put("/image/height", 8192)],
    [put("/lights/0/intensity", 1e308), put("/lights/0/color", 1e38)],
    [put("/colorSpace", "nowhere")],
    [put("/materials", [])],
    [put("/objects/0/material", "no such")],
    [put("/objects/0/radius", 1e-320)],
    [put("/objects/0/transform", {"matrix": [0] * 16})],
    [drop("/accuracy/maxError")],
    [put("/accuracy/maxError", 0)],
    [put("/accuracy/tier", "draft")],
    [put("/accuracy/metric", "no such")],
    [put("/outputs", [])],
    [put("/outputs", [{"name": "a"}])],
    [put("/output/format", "gif")],
    [put("/output/format", "hdr")],
    [put("/output/display", "no such")],
    [put("/output/view", "no such")],
    [put("/output/colorSpace", "no such")],
    [put("/output/channel", "Q")],
    [put("/output/bitDepth", "float")],
    [put("/output/layers", ["no such"])],
    [put("/output/layers", ["beauty", "beauty"])],
    [put("/output/name", "a")],
]


def places(value, pointer=""):
    yield pointer, value
    items = value.items() if isinstance(value, dict) else (
        enumerate(value) if isinstance(value, list) else ())
    for key, item in items:
        yield from places(item, f"{pointer}/{key}")


def catalogue(document, written):
    """What is written above; and for every place a value of the wrong kind, an unknown member."""
    for edits in written:
        names = sorted("/".join(map(str, slot)) for _, slots in edits for slot in slots)
        yield Mistake(" & ".join(names) + f" #{written.index(edits)}", *edits)
    for pointer, value in places(document):
        if pointer:
            yield Mistake(f"kind of {pointer}", put(pointer, 0 if isinstance(value, bool) else True))
        if isinstance(value, dict):
            yield Mistake(f"unknown in {pointer}", put(pointer + "/zzz", True))
