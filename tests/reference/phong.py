"""The model: I = ke + ka Ia + sum_j f_j s_j Il_j ( kd (N.L_j)+ + ks g_j (R_j.V)+^ns ).

render(document) answers a Picture: linear Rec.709, premultiplied where the background is
transparent.

A pixel is a silhouette pixel where rays 1/16 pixel beside one of its samples (left, right, up,
down) do not see the same thing as the sample itself: the same object, the same smooth part of it
or the same triangle, from the same side, in the same lights (each light before or behind the
surface, inside or outside its cone). Two correct programs may differ there, as rounding decides;
everywhere else they may not.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from reference import models
from reference.program import SOURCE
from reference.scene import Scene
from reference.shapes import ANALYTIC, bound, dot, triangles

NEAR = 1 / 16  # of a pixel
IN_PLANE = 16 * 2.0 ** -52  # of lengths: a light that is no farther from a surface's plane is in it


@dataclass
class Picture:
    rgb: np.ndarray  # [h,w,3]
    alpha: np.ndarray  # [h,w], the share of samples that hit something
    silhouette: np.ndarray  # [h,w] bool
    object: np.ndarray  # [h,w] of the first sample; -1 where nothing was hit


def normalized(v):
    largest = np.abs(v).max(axis=1, keepdims=True)
    v = v / np.where(largest > 0, largest, 1)
    length = np.linalg.norm(v, axis=1, keepdims=True)
    return v / np.where(length > 0, length, 1)


def spot_factor(light, to_light):
    """And whether the point is inside the cone at all."""
    along = -to_light
    cosine = along @ light.axis
    t = np.arctan2(np.linalg.norm(np.cross(along, light.axis), axis=1), cosine)
    inside = t <= light.angle
    if light.penumbra > 0:
        outer, inner = math.cos(light.angle), math.cos(light.angle * (1 - light.penumbra))
        x = np.clip((cosine - outer) / (inner - outer), 0, 1)
        factor = x * x * (3 - 2 * x)
    else:
        factor = np.ones_like(cosine)
    if light.exponent > 0:
        factor = factor * np.maximum(cosine, 0) ** light.exponent
    return np.where(inside, factor, 0), inside


def weights(light, p, n, v, material):
    """wd = f s (N.L)+, ws for each lobe = f s g (R.V)+^ns, and the light's case (see above). Other
    models have other weights."""
    lobes = material.lobes
    if light.kind == "ambient":
        zero = np.zeros(len(p))
        return zero, [zero for _ in lobes], zero.astype(np.int64)
    lit = np.ones(len(p), dtype=bool)
    if light.kind == "directional":
        to_light = np.broadcast_to(light.toward, p.shape)
        f = np.ones(len(p))
    else:
        way = light.position - p
        distance = np.linalg.norm(way, axis=1)
        lit = distance > 0
        to_light = way / np.where(lit, distance, 1)[:, None]
        a, b, c = light.attenuation
        d = np.maximum(distance, light.min_distance)
        with np.errstate(divide="ignore"):
            f = 1 / (a + b * d + c * d * d)
    case = np.zeros(len(p), dtype=np.int64)
    if light.kind == "spot":
        s, inside = spot_factor(light, to_light)
        f = f * s
        case += 2 * inside
    nl = dot(n, to_light)
    if light.kind == "directional":
        height, lengths = nl, 1
    else:
        height = dot(n, way)
        lengths = np.linalg.norm(light.position) + np.linalg.norm(p, axis=1)
    nl = np.where(np.abs(height) <= IN_PLANE * lengths, 0, nl)
    before = nl > 0
    case += before
    r = 2 * nl[:, None] * n - to_light
    rv = dot(r, v)
    f = np.where(lit, f, 0)
    if material.model != "phong":
        kd, ks = np.zeros(len(p)), [np.zeros((len(p), 3)) for _ in lobes]
        shone = before & lit
        if shone.any():
            diffuse, lobes = models.weigh(material, n[shone], to_light[shone], v[shone])
            kd[shone] = f[shone] * diffuse
            for to, lobe in zip(ks, lobes):
                to[shone] = f[shone][:, None] * (lobe if lobe.ndim == 2 else lobe[:, None])
        return kd, ks, case
    wd = f * np.maximum(nl, 0)
    ws = [np.where(before & (rv > 0), f * np.maximum(rv, 0) ** shininess, 0)
          for _, shininess in lobes]
    return wd, ws, case


def evaluate(scene, material, p, n, geometric=None):
    """The model at points p with unit normals n; which side is seen, the geometric normals tell,
    which are n where none are given. Answers colors [n,3] and the case of each point: the side it
    is seen from and the case of every light, as one number."""
    v = scene.camera.toward(p)
    away = dot(n if geometric is None else geometric, v) < 0
    case = away.astype(np.int64)
    if not material.front_only:
        n = np.where(away[:, None], -n, n)
    total = np.broadcast_to(material.emissive + material.ambient * scene.ambient, p.shape).copy()
    for light in scene.lights:
        wd, ws, light_case = weights(light, p, n, v, material)
        case = (case * 4 + light_case) % (2 ** 61 - 1)
        total += wd[:, None] * material.diffuse * light.color
        for w, (specular, _) in zip(ws, material.lobes):
            total += (w if w.ndim == 2 else w[:, None]) * specular * light.color
    return total, case


def corners_of(item):
    indices = np.array(item["indices"], dtype=np.int64).reshape(-1, 3)
    return np.array(item["positions"], dtype=np.float64).reshape(-1, 3)[indices], indices


class Thing:
    """One object, ready to be cast and lit."""

    def __init__(self, scene, item, matrix, material, interpolation):
        self.scene, self.item, self.material = scene, item, material
        self.matrix, self.inverse = matrix, np.linalg.inv(matrix)
        self.normal_map = self.inverse[:3, :3]  # rows times it: the inverse transposed
        self.mesh = item["type"] == "mesh"
        self.colors = None
        if interpolation == "flat" and item["type"] == "box":
            self.prepare_box()
        elif interpolation != "phong" and not self.mesh:
            raise ValueError("the reference interpolates meshes, and is flat on boxes")
        if self.mesh:
            self.prepare_mesh(interpolation)

    def prepare_box(self):
        """One evaluation a face, in the order of shapes.box."""
        normals = np.repeat(np.eye(3), 2, axis=0) * np.tile([-1, 1], 3)[:, None]
        centres = normals * np.array(self.item.get("size", [1, 1, 1])) / 2
        self.colors, _ = evaluate(self.scene, self.material,
                                  centres @ self.matrix[:3, :3].T + self.matrix[:3, 3],
                                  normalized(normals @ self.normal_map))

    def prepare_mesh(self, interpolation):
        corners, indices = corners_of(self.item)
        face = normalized(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
        normals = self.item.get("normals")
        if normals is None:
            self.normals = np.repeat(face[:, None, :], 3, axis=1)
        else:
            self.normals = np.array(normals, dtype=np.float64).reshape(-1, 3)[indices]
        self.smooth = normals is not None and interpolation == "phong"
        self.face = face @ self.normal_map
        self.corners = corners @ self.matrix[:3, :3].T + self.matrix[:3, 3]
        if interpolation == "flat":
            color, _ = evaluate(self.scene, self.material, self.corners.mean(axis=1),
                                normalized(face @ self.normal_map))
            self.colors = np.repeat(color[:, None, :], 3, axis=1)
        elif interpolation == "gouraud":
            self.colors = np.stack(
                [evaluate(self.scene, self.material, self.corners[:, k],
                          normalized(self.normals[:, k] @ self.normal_map), self.face)[0]
                 for k in range(3)],
                axis=1)

    def cast(self, o, d):
        """t, part, and a function of row numbers that answers their colors and cases."""
        if self.mesh:
            t, part, bary = triangles(self.corners, o, d)

            def light(rows):
                if self.colors is not None:
                    color = np.einsum("ij,ijk->ik", bary[rows], self.colors[part[rows]])
                    return color, part[rows]
                n = np.einsum("ij,ijk->ik", bary[rows], normalized(
                    self.normals.reshape(-1, 3)).reshape(self.normals.shape)[part[rows]])
                color, case = evaluate(self.scene, self.material, (o + t[:, None] * d)[rows],
                                       normalized(n @ self.normal_map), self.face[part[rows]])
                return color, case if self.smooth else case * 65536 + part[rows]

            return t, light
        oo = o @ self.inverse[:3, :3].T + self.inverse[:3, 3]
        dd = d @ self.inverse[:3, :3].T
        # begin just before the shape, so that a far eye costs no digits
        start = (-dot(oo, dd) / np.linalg.norm(dd, axis=1) - bound(self.item))
        start = np.maximum(start, 0) / np.linalg.norm(dd, axis=1)
        t, part, normal = ANALYTIC[self.item["type"]](self.item, oo + start[:, None] * dd, dd)
        t = t + start

        def light(rows):
            if self.colors is not None:
                return self.colors[part[rows]], part[rows]
            n = normalized(normal[rows] @ self.normal_map)
            p = o[rows] + t[rows][:, None] * d[rows]
            color, case = evaluate(self.scene, self.material, p, n)
            return color, case * 8 + part[rows]

        return t, light


def trace(scene, things, x, y):
    """Colors, coverage, object number and what is seen (a number a case) at picture points."""
    o, d = scene.camera.rays(x, y, scene.width, scene.height)
    nearest, which, lights = np.full(len(x), np.inf), np.full(len(x), -1), []
    for number, thing in enumerate(things):
        t, light = thing.cast(o, d)
        lights.append(light)
        closer = t < nearest
        nearest, which = np.where(closer, t, nearest), np.where(closer, number, which)
    rgb = np.broadcast_to(scene.background, (len(x), 3)).copy()
    seen = np.full(len(x), -1, dtype=np.int64)
    for number, light in enumerate(lights):
        rows = np.flatnonzero(which == number)
        if len(rows):
            rgb[rows], case = light(rows)
            seen[rows] = case * 64 + number
    return rgb, which, seen


def sample_pattern(n):
    """Where samples lie in a pixel: each in a column and a row of its own, by the table."""
    table = Path(SOURCE, "src", "base", "pattern_rows.inc").read_text().partition("*/")[2]
    rows = "".join(re.findall('"(.*)"', table)).replace("\\\\", "\\")
    begin = n * (n - 1) // 2
    return [((i + 0.5) / n, (ord(row) - ord("0") + 0.5) / n)
            for i, row in enumerate(rows[begin:begin + n])]


def render(document, mask=True):
    scene = Scene(document)
    things = [Thing(scene, *entry) for entry in scene.objects]
    rows, columns = np.divmod(np.arange(scene.width * scene.height), scene.width)
    rgb, alpha = np.zeros((len(rows), 3)), np.zeros(len(rows))
    edge, first = np.zeros(len(rows), dtype=bool), None
    for dx, dy in sample_pattern(scene.samples):
        x, y = columns + dx, rows + dy
        color, which, seen = trace(scene, things, x, y)
        rgb += color / scene.samples
        alpha += (which >= 0) / scene.samples
        first = which if first is None else first
        for sx, sy in [(-NEAR, 0), (NEAR, 0), (0, -NEAR), (0, NEAR)] if mask else []:
            edge |= trace(scene, things, x + sx, y + sy)[2] != seen
    shape = (scene.height, scene.width)
    return Picture(rgb.reshape(*shape, 3), alpha.reshape(shape), edge.reshape(shape),
                   first.reshape(shape))
