"""The scenes that are measured, as documents and as what the peers take."""

import json
import math

SIZE, FOV, EYE = 512, 40, 4
# Digits that differ in every request, see jobs.h: 1e-5 of the sphere's radius at most.
RADIUS = "1.00000@@@@@@"
TINTS = ([1, 0.9, 0.8], [0.8, 0.9, 1], [1, 0.8, 0.9], [0.9, 1, 0.8])
MATERIAL = {"ambient": [0.5, 0.3, 0.1], "diffuse": [0.5, 0.3, 0.1], "specular": 0.4,
            "shininess": 50}
REPAINTED = {**MATERIAL, "diffuse": [0.1, 0.4, 0.6], "ambient": [0.1, 0.4, 0.6]}
# 1 at a distance of 4, and what POV-Ray's fade_distance 4, fade_power 2 is.
FADING = [0.5, 0, 0.5 / 16]
HALF = math.radians(FOV / 2)
# Points of the sphere that are seen: its silhouette is a circle of this radius.
COVERED = math.pi * (SIZE / 2 * math.tan(math.asin(1 / EYE)) / math.tan(HALF)) ** 2


def lights(count, attenuation=None):
    """Points on a spiral over the half of a sphere (radius 5) that faces the camera."""
    result = []
    for i in range(count):
        z = (i + 0.5) / count
        angle = i * math.pi * (3 - math.sqrt(5))
        across = math.sqrt(1 - z * z)
        place = [5 * across * math.cos(angle), 5 * across * math.sin(angle), 5 * z]
        result.append({"type": "point", "position": [round(p, 4) for p in place],
                       "color": TINTS[i % 4], "intensity": round(1.2 / count, 6),
                       **({"attenuation": attenuation} if attenuation else {})})
    return result


def lamps(count):
    """Evenly spread over a disc in front of the sphere: the more there are, the wider it is. They
    fade with the square of the distance, so that most of many are far and weak."""
    result = []
    for i in range(count):
        radius, angle = math.sqrt(i + 0.5), i * math.pi * (3 - math.sqrt(5))
        place = [radius * math.cos(angle), radius * math.sin(angle), 3]
        result.append({"type": "point", "position": [round(p, 4) for p in place],
                       "color": TINTS[i % 4], "intensity": 1, "attenuation": [0, 0, 1]})
    return result


def scene(lamp_list, *, size=SIZE, samples=1, tier="standard", material=None, accuracy=None,
          **more):
    """The document of one sphere."""
    return {"image": {"width": size, "height": size, **({"samples": samples} if samples else {})},
            "camera": {"position": [0, 0, EYE], "target": [0, 0, 0], "fov": FOV},
            "ambient": 0.1, "accuracy": accuracy or {"tier": tier}, "lights": lamp_list,
            "objects": [{"type": "sphere", "radius": "RADIUS", "material": material or MATERIAL}],
            **more}


def ball(around=32, down=16):
    """A mesh of 960 triangles with normals, on a sphere of radius 1."""
    points = [[math.sin(t) * math.cos(p), math.cos(t), math.sin(t) * math.sin(p)]
              for t in (math.pi * j / down for j in range(down + 1))
              for p in (2 * math.pi * i / around for i in range(around))]
    places = [c for point in points for c in point]
    corners = []
    for j in range(down):
        for i in range(around):
            a, b = j * around + i, j * around + (i + 1) % around
            corners += [a, b, b + around] if j > 0 else []
            corners += [a, b + around, a + around] if j < down - 1 else []
    return {"type": "mesh", "positions": places, "normals": places, "indices": corners}


def objects():
    """One object each, turned, in place of the sphere; 4 samples."""
    for name, shape in (("sphere", {"type": "sphere"}), ("torus", {"type": "torus"}),
                        ("ball", ball())):
        turned = {"rotate": [40, 20, 0], "scale": "RADIUS"}
        yield name, scene(lights(4, FADING), samples=4, objects=[
            {**shape, "material": MATERIAL, "transform": turned}])


def text(document):
    return json.dumps(document).replace('"RADIUS"', RADIUS)


def plain(document):
    """The document with the radius 1."""
    return json.loads(json.dumps(document).replace('"RADIUS"', "1"))


def glsl(document, folded=False):
    """(What goes before phong.glsl, {name: values}): as uniforms, or as constants that the compiler
    can fold into the program."""
    sources, material = document["lights"], document["objects"][0]["material"]
    values = {
        "POSITION": [light["position"] for light in sources],
        "COLOR": [[c * light["intensity"] for c in light["color"]] for light in sources],
        "ATTENUATION": [sources[0]["attenuation"]],
        "AMBIENT": [[c * document["ambient"] for c in material["ambient"]]],
        "DIFFUSE": [material["diffuse"]],
        "SPECULAR": [[material["specular"]] * 3],
        "SHININESS": [material["shininess"]],
    }
    return declared(values, folded), values


def declared(values, folded):
    lines = [f"#define LIGHTS {len(values['POSITION'])}"] if "POSITION" in values else []
    for name, elements in values.items():
        kind = "vec3" if isinstance(elements[0], list) else "float"
        array = name in ("POSITION", "COLOR")
        count = f"[{len(elements)}]" if array else ""
        if folded:
            spelled = [f"vec3({', '.join(map(repr, map(float, e)))})" if kind == "vec3"
                       else repr(float(e)) for e in elements]
            value = f"{kind}{count}({', '.join(spelled)})" if array else spelled[0]
            lines.append(f"const {kind} {name}{count} = {value};")
        else:
            lines.append(f"uniform {kind} {name}{count};")
    return "\n".join(lines) + "\n"
