"""Lights with a shape, summed point by point over all of the shape: slow, and without any formula
of boundaries.

A light of intensity Il and projected area A has the radiance v = pi Il / A, and its element dA sends
v cos(t') / d^2 dA, which counts as a directional light of 1/pi of that: Il cos(t') / (A d^2) dA.
"""

import numpy as np


def unit(v):
    v = np.asarray(v, float)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def gauss(n, low, high):
    """Points and weights of an integral from low to high."""
    x, w = np.polynomial.legendre.leggauss(n)
    return low + (high - low) * (x + 1) / 2, w * (high - low) / 2


def frame(direction, up=None):
    direction = unit(direction)
    if up is None:
        vertical = abs(direction[0]) < 1e-9 and abs(direction[2]) < 1e-9
        up = [0, 0, -1] if vertical else [0, 1, 0]
    across = unit(np.cross(up, direction))
    return across, np.cross(direction, across), direction


def elements(light, n):
    """Of flat lights: places and shares of the area, and the way that they face."""
    across, up, direction = frame(light["direction"], light.get("up"))
    if light["type"] == "rect":
        w, h = light["size"]
        x, wx = gauss(n, -w / 2, w / 2)
        y, wy = gauss(n, -h / 2, h / 2)
        x, y = (g.ravel() for g in np.meshgrid(x, y, indexing="ij"))
        share = np.outer(wx, wy).ravel() / (w * h)
    else:
        r, wr = gauss(n, 0, light["radius"])
        turn = 2 * np.pi * (np.arange(2 * n) + 0.5) / (2 * n)
        x, y = (np.outer(r, f(turn)).ravel() for f in (np.cos, np.sin))
        share = np.outer(wr * r, np.full(2 * n, np.pi / n)).ravel()
        share /= np.pi * light["radius"] ** 2
    return np.asarray(light["position"], float) + np.outer(x, across) + np.outer(y, up), share, direction


def directions(light, point, n):
    """Directions to what of the shape shines at a point, and the light that each counts as, of
    Il."""
    if light["type"] != "sphere":
        places, share, direction = elements(light, n)
        path = places - point
        distance = np.linalg.norm(path, axis=1)
        toward = path / distance[:, None]
        return toward, share * np.maximum(0, -toward @ direction) / distance ** 2
    path = np.asarray(light["position"], float) - point
    distance = np.linalg.norm(path)
    if distance <= light["radius"]:
        return np.zeros((1, 3)), np.zeros(1)
    axis = path / distance
    a = unit(np.cross(axis, [1, 0, 0] if abs(axis[0]) < 0.5 else [0, 1, 0]))
    b = np.cross(axis, a)
    angle, w = gauss(n, 0, np.arcsin(light["radius"] / distance))
    turn = 2 * np.pi * (np.arange(2 * n) + 0.5) / (2 * n)
    ring = np.outer(np.cos(turn), a) + np.outer(np.sin(turn), b)
    toward = np.cos(angle)[:, None, None] * axis + np.sin(angle)[:, None, None] * ring
    solid = np.outer(w * np.sin(angle), np.full(2 * n, np.pi / n)).ravel()
    return toward.reshape(-1, 3), solid / (np.pi * light["radius"] ** 2)


def weights(light, point, normal, view, exponents, n):
    """Of the diffuse term and of each lobe, at one point."""
    toward, sent = directions(light, point, n)
    facing = toward @ normal
    mirror = 2 * (normal @ view) * normal - view
    z = toward @ mirror
    before = facing > 0
    out = [np.sum(sent * np.where(before, facing, 0))]
    for exponent in exponents:
        lobe = np.where(z > 0, np.maximum(z, 1e-300) ** exponent, 0)
        out.append(np.sum(sent * np.where(before, lobe, 0)))
    return out
