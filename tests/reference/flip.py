"""LDR-FLIP and CIEDE2000 again, by numpy: whole kernels in two dimensions, everything in f64.

P. Andersson et al., "FLIP: A Difference Evaluator for Alternating Images", 2020: sections 4.1 to 4.3, with the
matrices of its supplement. G. Sharma et al., "The CIEDE2000 Color-Difference Formula", 2005."""

import numpy as np

DENSITY = 0.7 * 3840 / 0.7 * np.pi / 180
TO_XYZ = np.array([[10135552 / 24577794, 8788810 / 24577794, 4435075 / 24577794],
                   [2613072 / 12288897, 8788810 / 12288897, 887015 / 12288897],
                   [1425312 / 73733382, 8788810 / 73733382, 70074185 / 73733382]])
WHITE = TO_XYZ @ np.ones(3)


def linear(codes):
    return np.where(codes > 0.04045, ((codes + 0.055) / 1.055) ** 2.4, codes / 12.92)


def opponent(rgb):
    x, y, z = np.moveaxis(rgb @ TO_XYZ.T / WHITE, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def from_opponent(value):
    y = (value[..., 0] + 16) / 116
    xyz = np.stack([y + value[..., 1] / 500, y, y - value[..., 2] / 200], -1)
    return xyz * WHITE @ np.linalg.inv(TO_XYZ).T


def lab(rgb):
    xyz = rgb @ TO_XYZ.T / WHITE
    f = np.where(xyz > (6 / 29) ** 3, np.cbrt(xyz), xyz / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])], -1)


def hunt(rgb):
    value = lab(rgb)
    value[..., 1:] *= 0.01 * value[..., :1]
    return value


def convolve(plane, kernel):
    """Correlation, as the paper's programs do it; the nearest pixel goes on beyond the edge."""
    reach = kernel.shape[0] // 2
    wide = np.pad(plane, reach, mode="edge")
    out = np.zeros_like(plane)
    for j in range(kernel.shape[0]):
        for i in range(kernel.shape[1]):
            out += kernel[j, i] * wide[j:j + plane.shape[0], i:i + plane.shape[1]]
    return out


def contrast(density, gaussians):
    reach = int(np.ceil(3 * np.sqrt(0.04 / (2 * np.pi ** 2)) * density))
    x, y = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    square = (x / density) ** 2 + (y / density) ** 2
    kernel = sum(a * np.sqrt(np.pi / b) * np.exp(-np.pi ** 2 * square / b) for a, b in gaussians)
    return kernel / kernel.sum()


def features(plane, density, kind):
    deviation = 0.5 * 0.082 * density
    reach = int(np.ceil(3 * deviation))
    x, y = np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1))
    bell = np.exp(-(x ** 2 + y ** 2) / (2 * deviation ** 2))
    kernel = -x * bell if kind == "edge" else (x ** 2 / deviation ** 2 - 1) * bell
    kernel = np.where(kernel < 0, kernel / -kernel[kernel < 0].sum(), kernel / kernel[kernel > 0].sum())
    return np.hypot(convolve(plane, kernel), convolve(plane, kernel.T))


def flip(a, b, density=DENSITY):
    """Of codes in [0,1], [height, width, 3]."""
    def distance(one, other):
        return (np.abs(one[..., 0] - other[..., 0]) + np.linalg.norm((one - other)[..., 1:], axis=-1)) ** 0.7

    channels = [[(1, 0.0047)], [(1, 0.0053)], [(34.1, 0.04), (13.5, 0.025)]]
    colors, edges, points = [], [], []
    for picture in a, b:
        value = opponent(linear(picture))
        seen = np.stack([convolve(value[..., c], contrast(density, channels[c])) for c in range(3)], -1)
        colors.append(hunt(np.clip(from_opponent(seen), 0, 1)))
        luma = (value[..., 0] + 16) / 116
        edges.append(features(luma, density, "edge"))
        points.append(features(luma, density, "point"))
    most = distance(hunt(np.array([0., 1, 0])), hunt(np.array([0., 0, 1])))
    apart, knee = distance(*colors), 0.4 * most
    color = np.where(apart < knee, 0.95 / knee * apart, 0.95 + (apart - knee) / (most - knee) * 0.05)
    feature = np.maximum(abs(edges[0] - edges[1]), abs(points[0] - points[1])) / np.sqrt(2)
    return color ** (1 - np.sqrt(feature))


def delta_e(a, b):
    """CIEDE2000 of codes in [0,1]."""
    one, other = lab(linear(a)), lab(linear(b))

    def strength(chroma):
        return np.sqrt(chroma ** 7 / (chroma ** 7 + 25.0 ** 7))

    mean = (np.hypot(one[..., 1], one[..., 2]) + np.hypot(other[..., 1], other[..., 2])) / 2
    stretch = 1.5 - 0.5 * strength(mean)
    a1, a2 = stretch * one[..., 1], stretch * other[..., 1]
    c1, c2 = np.hypot(a1, one[..., 2]), np.hypot(a2, other[..., 2])
    h1, h2 = (np.degrees(np.arctan2(v, u)) % 360 for u, v in ((a1, one[..., 2]), (a2, other[..., 2])))
    grey, turn = c1 * c2 == 0, h2 - h1
    turn = np.where(grey, 0, np.where(turn > 180, turn - 360, np.where(turn < -180, turn + 360, turn)))
    hue = h1 + h2
    hue = np.where(grey, hue, np.where(abs(h1 - h2) <= 180, hue, np.where(hue < 360, hue + 360, hue - 360)) / 2)
    light, chroma = (one[..., 0] + other[..., 0]) / 2, (c1 + c2) / 2

    def cosine(angle):
        return np.cos(np.radians(angle))

    t = 1 - 0.17 * cosine(hue - 30) + 0.24 * cosine(2 * hue) + 0.32 * cosine(3 * hue + 6) - 0.2 * cosine(4 * hue - 63)
    sl = 1 + 0.015 * (light - 50) ** 2 / np.sqrt(20 + (light - 50) ** 2)
    x = (other[..., 0] - one[..., 0]) / sl
    y = (c2 - c1) / (1 + 0.045 * chroma)
    z = 2 * np.sqrt(c1 * c2) * np.sin(np.radians(turn / 2)) / (1 + 0.015 * chroma * t)
    rotation = -np.sin(np.radians(60 * np.exp(-((hue - 275) / 25) ** 2))) * 2 * strength(chroma)
    return np.sqrt(np.maximum(x ** 2 + y ** 2 + z ** 2 + rotation * y * z, 0))


def figures(errors):
    """As `shade diff` tells them: percentiles are of the nearest rank."""
    order = np.sort(errors.ravel())
    ranks = {f"p{p}": order[int(np.ceil(p * order.size / 100)) - 1] for p in (50, 95, 99)}
    return {"mean": order.mean(), **ranks, "max": order[-1]}
