"""Color conversions, each from its published definition."""

import numpy as np

# NTSC, with the coefficients of the model (two digits).
YIQ = np.array([[0.30, 0.59, 0.11], [0.60, -0.28, -0.32], [0.21, -0.52, 0.31]])


def srgb_encode(linear):
    """IEC 61966-2-1:1999; the linear piece goes on below 0."""
    return np.where(linear <= 0.0031308, 12.92 * linear,
                    1.055 * np.power(np.maximum(linear, 1e-300), 1 / 2.4) - 0.055)


def srgb_decode(encoded):
    return np.where(encoded <= 0.04045, encoded / 12.92,
                    ((np.maximum(encoded, 0) + 0.055) / 1.055) ** 2.4)


def parse(value, space="lin_rec709"):
    """A color of a scene document as linear Rec.709."""
    if isinstance(value, str):
        digits = value.lstrip("#")
        if len(digits) == 3:
            digits = "".join(c + c for c in digits)
        return srgb_decode(np.array([int(digits[i:i + 2], 16) / 255 for i in (0, 2, 4)]))
    if isinstance(value, dict):
        return parse(value["value"], value.get("space", space))
    rgb = np.broadcast_to(np.float64(value), 3).copy()
    if space == "lin_rec709":
        return rgb
    if space == "sRGB":
        return srgb_decode(rgb)
    raise ValueError(f"the reference has no color space {space}")


def yiq(rgb):
    return rgb @ YIQ.T


def hsv(rgb):
    """Hue in [0,1) by sectors of the hexcone (Smith 1978); greys have hue 0, saturation 0."""
    rgb = np.maximum(rgb, 0)
    r, g, b = rgb[..., 0], rgb[..., 1], rgb[..., 2]
    value, low = rgb.max(-1), rgb.min(-1)
    chroma = value - low
    safe = np.where(chroma > 0, chroma, 1)
    sector = np.where(r == value, (g - b) / safe % 6,
                      np.where(g == value, (b - r) / safe + 2, (r - g) / safe + 4))
    hue = np.where(chroma > 0, sector / 6, 0)
    saturation = np.where(value > 0, chroma / np.where(value > 0, value, 1), 0)
    return np.stack([hue, saturation, value], -1)


def codes(values, bits=8):
    """Integer codes of values in [0,1], rounded to nearest."""
    top = 2 ** bits - 1
    return np.floor(np.clip(values, 0, 1) * top + 0.5).astype(np.int64)


def yiq_codes(signals, bits=8):
    """Y as it is; I and Q around 128/255, their spans from 1/255 to 1."""
    return codes(np.stack([signals[..., 0], 128 / 255 + signals[..., 1] * 127 / 255 / 0.60,
                           128 / 255 + signals[..., 2] * 127 / 255 / 0.52], -1), bits)


def lab(linear):
    """CIELAB (CIE 15:2004) of linear Rec.709 [...,3] relative to its white, D65. The matrix is
    that of IEC 61966-2-1, in four digits; its rows' sums are the white."""
    matrix = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722],
                       [0.0193, 0.1192, 0.9505]])
    t = linear @ (matrix / matrix.sum(1, keepdims=True)).T
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    x, y, z = np.moveaxis(f, -1, 0)
    return np.stack([116 * y - 16, 500 * (x - y), 200 * (y - z)], -1)


def delta_e_2000(one, other):
    """CIEDE2000 of Lab [...,3] by CIE 142-2001, with vectors for hues: the mean hue is the
    direction of the sum of unit vectors, and no hue wraps."""
    def strength(chroma):
        return np.sqrt(chroma ** 7 / (chroma ** 7 + 25.0 ** 7))

    chroma = (np.hypot(one[..., 1], one[..., 2]) + np.hypot(other[..., 1], other[..., 2])) / 2
    stretch = 1 + 0.5 * (1 - strength(chroma))
    a = stretch * one[..., 1] + 1j * one[..., 2]
    b = stretch * other[..., 1] + 1j * other[..., 2]
    light, chroma = (one[..., 0] + other[..., 0]) / 2, (np.abs(a) + np.abs(b)) / 2
    hue = np.degrees(np.angle(np.exp(1j * np.angle(a)) + np.exp(1j * np.angle(b)))) % 360
    t = 1 + sum(k * np.cos(np.radians(n * hue + offset)) for k, n, offset in
                ((-0.17, 1, -30), (0.24, 2, 0), (0.32, 3, 6), (-0.20, 4, -63)))
    turned = 2 * 30 * np.exp(-((hue - 275) / 25) ** 2)
    weights = (1 + 0.015 * (light - 50) ** 2 / np.sqrt(20 + (light - 50) ** 2),
               1 + 0.045 * chroma, 1 + 0.015 * chroma * t)
    # |a - b|^2 = dC^2 + dH^2, and dH has the sign of the turn from a to b
    dc = np.abs(b) - np.abs(a)
    dh = np.sqrt(np.maximum(np.abs(a - b) ** 2 - dc ** 2, 0)) * np.sign((b * a.conj()).imag)
    dl, dc, dh = ((other[..., 0] - one[..., 0]) / weights[0], dc / weights[1], dh / weights[2])
    return np.sqrt(np.maximum(dl ** 2 + dc ** 2 + dh ** 2 - np.sin(np.radians(turned)) * 2 *
                              strength(chroma) * dc * dh, 0))
