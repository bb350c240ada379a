"""Rays against the shapes, brute force, in the object's own frame.

A cast answers, for each ray o + t d: the nearest t > 0 (inf: a miss), which smooth part of the
surface it is (caps, sides and faces differ), and the outward normal there. d need not be unit.
"""

import numpy as np


def dot(a, b):
    return np.einsum("ij,ij->i", a, b)


def quadratic(a, half_b, c):
    """Both roots of a t^2 + 2 half_b t + c, inf where there are none; a may be 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(half_b * half_b - a * c)  # NaN: none
        q = -(half_b + np.where(half_b < 0, -root, root))
        first, second = q / a, c / q
    return [np.where(np.isfinite(t), t, np.inf) for t in (first, second)]


def nearest(candidates, count):
    """Of [(t, part)], the smallest positive t a ray."""
    t, part = np.full(count, np.inf), np.full(count, -1)
    for candidate, number in candidates:
        closer = (candidate > 0) & (candidate < t)
        t = np.where(closer, candidate, t)
        part = np.where(closer, number, part)
    return t, part


def at(o, d, t):
    return o + np.where(np.isfinite(t), t, 0)[:, None] * d


def sphere(item, o, d):
    radius = item.get("radius", 1)
    dd = dot(d, d)
    middle = -dot(o, d) / dd  # the roots lie around the point nearest to the centre
    foot = o + middle[:, None] * d
    with np.errstate(invalid="ignore"):
        half = np.sqrt((radius - np.linalg.norm(foot, axis=1)) *
                       (radius + np.linalg.norm(foot, axis=1)) / dd)
    roots = [np.where(np.isnan(half), np.inf, middle + s * half) for s in (-1, 1)]
    t, part = nearest([(root, 0) for root in roots], len(o))
    return t, part, at(o, d, t)


def level(o, d, y):
    """t where rays cross the plane y."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (y - o[:, 1]) / d[:, 1]
    return np.where(np.isfinite(t), t, np.inf)


def within(o, d, t, radius):
    p = at(o, d, t)
    return np.where(p[:, 0] ** 2 + p[:, 2] ** 2 <= radius ** 2, t, np.inf)


def plane(item, o, d):
    t, part = nearest([(level(o, d, 0.0), 0)], len(o))
    return t, part, np.broadcast_to([0.0, 1.0, 0.0], o.shape)


def disc(item, o, d):
    t = within(o, d, level(o, d, 0.0), item.get("radius", 1))
    t, part = nearest([(t, 0)], len(o))
    return t, part, np.broadcast_to([0.0, 1.0, 0.0], o.shape)


def box(item, o, d):
    half = np.array(item.get("size", [1, 1, 1]), dtype=np.float64) / 2
    candidates = []
    for axis in range(3):
        others = [a for a in range(3) if a != axis]
        for side in (-1, 1):
            with np.errstate(divide="ignore", invalid="ignore"):
                t = (side * half[axis] - o[:, axis]) / d[:, axis]
            t = np.where(np.isfinite(t), t, np.inf)
            inside = np.all(np.abs(at(o, d, t)[:, others]) <= half[others], axis=1)
            candidates.append((np.where(inside, t, np.inf), 2 * axis + (side > 0)))
    t, part = nearest(candidates, len(o))
    normals = np.zeros((6, 3))
    for number in range(6):
        normals[number, number // 2] = 1 if number % 2 else -1
    return t, part, normals[np.maximum(part, 0)]


def cylinder(item, o, d):
    radius, height = item.get("radius", 1), item.get("height", 2)
    flat = np.array([1.0, 0.0, 1.0])
    side = quadratic(dot(d * flat, d), dot(o * flat, d), dot(o * flat, o) - radius ** 2)
    side = [np.where(np.abs(at(o, d, t)[:, 1]) <= height / 2, t, np.inf) for t in side]
    caps = [within(o, d, level(o, d, y), radius) for y in (-height / 2, height / 2)]
    t, part = nearest([(side[0], 0), (side[1], 0), (caps[0], 1), (caps[1], 2)], len(o))
    normal = at(o, d, t) * flat
    normal[part == 1], normal[part == 2] = [0, -1, 0], [0, 1, 0]
    return t, part, normal


def cone(item, o, d):
    """x^2 + z^2 = (k (h/2 - y))^2: radius at y = -h/2, apex at y = +h/2."""
    radius, height = item.get("radius", 1), item.get("height", 2)
    k = radius / height
    form = np.array([1.0, -k * k, 1.0])
    from_apex = o - [0, height / 2, 0]
    side = quadratic(dot(d * form, d), dot(from_apex * form, d), dot(from_apex * form, from_apex))
    side = [np.where(np.abs(at(o, d, t)[:, 1]) <= height / 2, t, np.inf) for t in side]
    cap = within(o, d, level(o, d, -height / 2), radius)
    t, part = nearest([(side[0], 0), (side[1], 0), (cap, 1)], len(o))
    normal = (at(o, d, t) - [0, height / 2, 0]) * form
    normal[part == 1] = [0, -1, 0]
    return t, part, normal


def torus(item, o, d):
    """(|p|^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + z^2): roots as eigenvalues, polished by Newton."""
    ring, tube = item.get("radius", 1), item.get("tube", 0.25)
    length = np.linalg.norm(d, axis=1)
    u = d / length[:, None]
    start = -dot(o, u)  # from the foot point, where the coefficients are tame
    foot = o + start[:, None] * u
    reach = dot(foot, foot) < (ring + tube) ** 2
    best, part = np.full(len(o), np.inf), np.full(len(o), -1)
    rows = np.flatnonzero(reach)
    if len(rows):
        f, w = foot[rows], u[rows]
        flat = np.array([1.0, 0.0, 1.0])
        k = dot(f, f) + ring ** 2 - tube ** 2  # |p|^2 + R^2 - r^2 = t^2 + k, since f.w = 0
        q2, q1, q0 = (4 * ring ** 2 * x for x in
                      (dot(w * flat, w), 2 * dot(f * flat, w), dot(f * flat, f)))
        c2, c1, c0 = 2 * k - q2, -q1, k * k - q0
        companion = np.zeros((len(rows), 4, 4))
        companion[:, 1, 0] = companion[:, 2, 1] = companion[:, 3, 2] = 1
        companion[:, 0, 3], companion[:, 1, 3], companion[:, 2, 3] = -c0, -c1, -c2
        roots = np.linalg.eigvals(companion)
        scale = ring + tube
        t = np.where(np.abs(roots.imag) < 1e-6 * scale, roots.real, np.nan)
        for _ in range(4):
            value = ((t * t + c2[:, None]) * t + c1[:, None]) * t + c0[:, None]
            slope = (4 * t * t + 2 * c2[:, None]) * t + c1[:, None]
            with np.errstate(divide="ignore", invalid="ignore"):
                step = value / slope
            t = t - np.where(np.abs(step) < 1e-3 * scale, step, 0)
        t = (t + start[rows][:, None]) / length[rows][:, None]
        t = np.where(t > 0, t, np.inf).min(axis=1)
        best[rows], part[rows] = t, np.where(np.isfinite(t), 0, -1)
    p = at(o, d, best)
    across = np.hypot(p[:, 0], p[:, 2])
    across = np.where(across > 0, across, 1)
    normal = p - ring * np.stack([p[:, 0] / across, 0 * across, p[:, 2] / across], 1)
    return best, part, normal


def triangles(corners, o, d, chunk=512):
    """Rays against triangles [m,3,3] by the signs of three volumes. Answers t, the triangle's
    number (-1: none) and barycentric weights [n,3]."""
    n = len(o)
    best, number, weights = np.full(n, np.inf), np.full(n, -1), np.zeros((n, 3))
    edge1, edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(edge1, edge2)
    # only rays that come near the ball around all corners
    centre = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
    radius = np.sqrt(((corners - centre) ** 2).sum(axis=2).max()) * 1.01
    way = centre - o
    passing = way - (dot(way, d) / dot(d, d))[:, None] * d
    near = np.flatnonzero(dot(passing, passing) <= radius ** 2)
    for first in range(0, len(near), chunk):
        rows = near[first:first + chunk]
        oo, dd = o[rows], d[rows]
        to = oo[:, None, :] - corners[None, :, 0, :]
        det = -dd @ normal.T
        turned = np.cross(to, dd[:, None, :])
        with np.errstate(divide="ignore", invalid="ignore"):
            t = np.einsum("rmi,mi->rm", to, normal) / det
            v = np.einsum("rmi,mi->rm", turned, edge2) / det
            w = -np.einsum("rmi,mi->rm", turned, edge1) / det
        hit = (v >= 0) & (w >= 0) & (v + w <= 1) & (t > 0)
        t = np.where(hit, t, np.inf)
        which = np.argmin(t, axis=1)
        ray = np.arange(len(oo))
        found = np.isfinite(t[ray, which])
        best[rows] = t[ray, which]
        number[rows] = np.where(found, which, -1)
        v, w = v[ray, which], w[ray, which]
        weights[rows] = np.where(found[:, None], np.stack([1 - v - w, v, w], 1), 0)
    return best, number, weights


def bound(item):
    """The radius of a sphere around the origin that holds the shape; the plane has none."""
    kind = item["type"]
    if kind == "box":
        return float(np.linalg.norm(item.get("size", [1, 1, 1]))) / 2 * 1.01
    if kind == "torus":
        return (item.get("radius", 1) + item.get("tube", 0.25)) * 1.01
    if kind in ("cylinder", "cone"):
        return float(np.hypot(item.get("radius", 1), item.get("height", 2) / 2)) * 1.01
    return np.inf if kind == "plane" else item.get("radius", 1) * 1.01


ANALYTIC = {"sphere": sphere, "plane": plane, "disc": disc, "box": box, "cylinder": cylinder,
            "cone": cone, "torus": torus}
