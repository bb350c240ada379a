"""A scene document (a dict) as plain values, with the contract's defaults filled in.

Documents are taken to be valid: checking them is the product's work.
"""

import math

import numpy as np

from reference import color, models


def unit(v):
    v = np.asarray(v, dtype=np.float64)
    return v / np.linalg.norm(v)


class Camera:
    """right, up and back (toward the viewer) are unit and perpendicular."""

    def __init__(self, document):
        self.orthographic = document.get("type", "perspective") == "orthographic"
        self.position = np.array(document.get("position", [0, 0, 4]), dtype=np.float64)
        target = np.array(document.get("target", [0, 0, 0]), dtype=np.float64)
        self.back = unit(self.position - target)
        self.right = unit(np.cross(document.get("up", [0, 1, 0]), self.back))
        self.up = np.cross(self.back, self.right)
        self.fov = math.radians(document.get("fov", 40))
        self.height = document.get("height")

    def rays(self, x, y, width, height):
        """Origins and directions through picture points; (0,0) is the top left corner."""
        half = self.height / 2 if self.orthographic else math.tan(self.fov / 2)
        u = ((2 * x / width - 1) * half * width / height)[:, None]
        v = ((1 - 2 * y / height) * half)[:, None]
        offset = u * self.right + v * self.up
        if self.orthographic:
            return self.position + offset, np.broadcast_to(-self.back, offset.shape)
        direction = offset - self.back
        return np.broadcast_to(self.position, direction.shape), direction

    def toward(self, points):
        """V: unit vectors from points to the eye."""
        if self.orthographic:
            return np.broadcast_to(self.back, points.shape)
        v = self.position - points
        return v / np.linalg.norm(v, axis=1, keepdims=True)

    def to_world(self, v, is_point):
        world = v[0] * self.right + v[1] * self.up + v[2] * self.back
        return world + self.position if is_point else world


class Light:
    """In the world frame. `toward` is the unit way to a light at infinity."""

    def __init__(self, document, camera, space):
        position = document.get("position")
        kind = document.get("type")
        toward = None
        if position is not None and len(position) == 4:
            *p, w = (float(c) for c in position)
            kind = kind or ("directional" if w == 0 else "point")
            if w == 0:
                toward, position = np.array(p), None
            else:
                position = np.array(p) / w
        elif position is not None:
            position = np.array(position, dtype=np.float64)
        axis = document.get("direction")
        if axis is not None:
            axis = np.array(axis, dtype=np.float64)
        if kind == "directional" and toward is None:
            toward = -(axis if axis is not None else np.array([0.0, 0.0, -1.0]))
        if document.get("frame", "world") == "camera":
            position = camera.to_world(position, True) if position is not None else None
            axis = camera.to_world(axis, False) if axis is not None else None
            toward = camera.to_world(toward, False) if toward is not None else None
        self.kind = kind
        self.position = position
        self.axis = unit(axis) if axis is not None else None
        self.toward = unit(toward) if toward is not None else None
        self.color = color.parse(document.get("color", 1), space) * document.get("intensity", 1)
        self.ambient = color.parse(document.get("ambient", 0), space)
        if kind == "ambient":
            self.ambient = self.ambient + self.color
        self.attenuation = document.get("attenuation", [1, 0, 0])
        self.min_distance = document.get("minDistance", 0)
        self.angle = math.radians(document.get("angle", 30))
        self.penumbra = document.get("penumbra", 0.2)
        self.exponent = document.get("exponent", 0)


class Material:
    def __init__(self, document, space):
        def of(name, default):
            return color.parse(document.get(name, default), space)

        self.emissive = of("emissive", 0)
        self.diffuse = of("diffuse", 0.8)
        self.ambient = of("ambient", document.get("diffuse", 0.8))
        self.model = document.get("model", "phong")
        self.sigma = math.radians(document.get("sigma", 0))
        if self.model == "cook-torrance":
            fresnel = document.get("fresnel", {"n": 1.5})
            if "f0" in fresnel:
                root = np.sqrt(color.parse(fresnel["f0"], space))
                fresnel = {"n": (1 + root) / (1 - root)}
            metal = models.METALS.get(fresnel["n"]) if isinstance(fresnel["n"], str) else None
            self.index, self.absorption = metal or (
                np.broadcast_to(np.float64(fresnel["n"]), 3),
                np.broadcast_to(np.float64(fresnel.get("k", 0)), 3))
            self.lobes = [(np.full(3, lobe.get("weight", 1)), lobe["roughness"])
                          for lobe in document.get("lobes", [{"roughness": 0.2}])]
            self.front_only = document.get("side", "both") == "front"
            return
        self.lobes = [(of("specular", 0), document.get("shininess", 32))]
        for lobe in document.get("lobes", []):
            self.lobes.append((color.parse(lobe.get("specular", 0), space),
                               lobe.get("shininess", 32)))
        self.front_only = document.get("side", "both") == "front"


def matrix_of(transform):
    """Object to world, 4 by 4, for column vectors: scale, rotate x, y, z, then translate."""
    if "matrix" in transform:
        return np.array(transform["matrix"], dtype=np.float64).reshape(4, 4).T
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(np.broadcast_to(np.float64(transform.get("scale", 1)), 3))
    for axis, degrees in enumerate(transform.get("rotate", [0, 0, 0])):
        a, b = [(1, 2), (2, 0), (0, 1)][axis]
        c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        turn = np.eye(4)
        turn[a, a], turn[a, b], turn[b, a], turn[b, b] = c, -s, s, c
        matrix = turn @ matrix
    matrix[:3, 3] = transform.get("translate", [0, 0, 0])
    return matrix


class Scene:
    def __init__(self, document):
        space = document.get("colorSpace", "lin_rec709")
        image = document.get("image", {})
        self.width = image.get("width", 512)
        self.height = image.get("height", 512)
        self.samples = image.get("samples", 4)
        self.camera = Camera(document.get("camera", {}))
        self.background = document.get("background", [0, 0, 0])
        self.transparent = self.background is None
        self.background = np.zeros(3) if self.transparent else color.parse(self.background, space)

        lights = document.get("lights")
        if lights is None:  # the default light shines along the view
            lights = [{"type": "directional", "direction": [0, 0, -1], "frame": "camera"}]
        self.lights = [Light(light, self.camera, space) for light in lights]
        self.ambient = color.parse(document.get("ambient", 0), space)
        for light in self.lights:
            self.ambient = self.ambient + light.ambient

        named = document.get("materials", {})
        self.objects = []
        for item in document["objects"]:
            material = item.get("material", {})
            if isinstance(material, str):
                material = named[material]
            self.objects.append((item, matrix_of(item.get("transform", {})),
                                 Material(material, space),
                                 item.get("interpolation", document.get("interpolation", "phong"))))
