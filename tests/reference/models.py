"""The models beside Phong's, from their papers, as weights that multiply colors: pi f_r N.L.

Nothing here is how shade/brdf.c does it: angles are angles, Fresnel's equations are complex, and the
energy of Phong's lobe is an integral.
"""

import math

import numpy as np

METALS = {  # n, k; see scene/metals.c
    "gold": ([0.1431189557, 0.3749570432, 1.4424785571], [3.9831604247, 2.3857207478, 1.6032152899]),
    "copper": ([0.2004376970, 0.9240334304, 1.1022119527],
               [3.9129485033, 2.4528477015, 2.1421879552]),
}


def dot(a, b):
    return (a * b).sum(axis=1)


def lobe_energy(angle, n, nodes=600):
    """The integral of (R.V)+^n (N.V)+ over all V above the horizon, R being `angle` [points] away from
    N: by circles around R, of which a closed form tells how much each is above the horizon."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    total = np.zeros(len(angle))
    kink = math.pi / 2 - angle  # from here on circles go below the horizon
    steep = np.minimum(np.full_like(angle, 12 / math.sqrt(n + 1)), math.pi / 2)
    edges = np.sort(np.stack([np.zeros_like(angle), np.minimum(kink, steep), steep,
                              np.minimum(np.maximum(kink, steep), math.pi / 2),
                              np.full_like(angle, math.pi / 2)]), axis=0)
    for low, high in zip(edges[:-1], edges[1:]):
        # A root of the distance from the kink, where the integrand has one.
        t = low[:, None] + (high - low)[:, None] * ((x + 1) / 2) ** 2
        step = (high - low)[:, None] * (x + 1) / 2 * w
        p = np.cos(angle)[:, None] * np.cos(t)
        q = np.sin(angle)[:, None] * np.sin(t)
        with np.errstate(divide="ignore", invalid="ignore"):
            half = np.arccos(np.clip(np.where(q > 0, -p / q, -1), -1, 1))
        circle = 2 * (p * half + q * np.sin(half))
        total += (step * np.cos(t) ** n * np.sin(t) * circle).sum(axis=1)
    return total


def fresnel(n, k, angle):
    """Of unpolarized light: Fresnel's two amplitudes with a complex index."""
    index = n + 1j * k
    inside = np.sqrt(1 - (np.sin(angle) / index) ** 2)
    c = np.cos(angle)
    across = (c - index * inside) / (c + index * inside)
    along = (index * c - inside) / (index * c + inside)
    return (abs(across) ** 2 + abs(along) ** 2) / 2


def oren_nayar(sigma, n, l, v):
    nl, nv = dot(n, l), np.maximum(dot(n, v), 0)
    light, view = np.arccos(np.clip(nl, 0, 1)), np.arccos(np.clip(nv, 0, 1))
    tangent_l, tangent_v = l - nl[:, None] * n, v - dot(n, v)[:, None] * n
    size = np.linalg.norm(tangent_l, axis=1) * np.linalg.norm(tangent_v, axis=1)
    across = np.where(size > 0, dot(tangent_l, tangent_v) / np.where(size > 0, size, 1), 0)
    a = 1 - 0.5 * sigma ** 2 / (sigma ** 2 + 0.33)
    b = 0.45 * sigma ** 2 / (sigma ** 2 + 0.09)
    rough = np.maximum(0, across) * np.sin(np.maximum(light, view)) * np.tan(np.minimum(light, view))
    # An interpolated normal may be turned away from V: then N.V counts as 0, also in L.V - N.L N.V.
    behind = dot(n, v) < 0
    rough = np.where(behind, np.maximum(0, dot(l, v)) / np.where(nl > 0, nl, 1), rough)
    return nl * (a + b * rough)


def cook_torrance(material, slope, n, l, v):
    """[points, 3]"""
    h = l + v
    h = h / np.linalg.norm(h, axis=1, keepdims=True)
    nl, nv, nh, vh = dot(n, l), dot(n, v), dot(n, h), dot(v, h)
    seen = (nv > 0) & (nh > 0) & (vh > 0)
    nv, nh, vh = (np.where(seen, x, 1) for x in (nv, nh, vh))
    bent = np.arccos(np.clip(nh, -1, 1))
    # Facets' slopes are normal: their area's share by solid angle times pi.
    d = np.exp(-(np.tan(bent) / slope) ** 2) / (slope ** 2 * np.cos(bent) ** 4)
    g = np.minimum(1, np.minimum(2 * nh * nv / vh, 2 * nh * nl / vh))
    angle = np.arccos(np.clip(vh, -1, 1))
    f = np.stack([fresnel(material.index[c], material.absorption[c], angle) for c in range(3)], axis=1)
    return np.where(seen[:, None], f * (d * g / (4 * nv))[:, None], 0)


def weigh(material, n, l, v):
    """Where N.L > 0: the weight of the diffuse term [points], and of each lobe [points] or
    [points, 3]."""
    nl = np.clip(dot(n, l), 0, 1)
    diffuse = oren_nayar(material.sigma, n, l, v) if material.model == "oren-nayar" else nl
    lobes = []
    for _, sharpness in material.lobes:
        if material.model == "cook-torrance":
            lobes.append(cook_torrance(material, sharpness, n, l, v))
        elif material.model == "blinn-phong":
            h = l + v
            h = h / np.linalg.norm(h, axis=1, keepdims=True)
            nh = dot(n, h)
            lobes.append(np.where(nh > 0, np.maximum(nh, 0) ** sharpness, 0))
        else:
            rv = dot(2 * dot(n, l)[:, None] * n - l, v)
            lobe = np.where(rv > 0, np.maximum(rv, 0) ** sharpness, 0)
            if material.model == "phong-normalized":
                lobe = lobe * math.pi * nl / lobe_energy(np.arccos(nl), sharpness)
            lobes.append(lobe)
    return diffuse, lobes
