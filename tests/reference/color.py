"""Color conversions, each from its published definition."""

import numpy as np

# NTSC, with the coefficients of the model (two digits).
YIQ = np.array([[0.30, 0.59, 0.11], [0.60, -0.28, -0.32], [0.21, -0.52, 0.31]])


def srgb_encode(linear):
    """IEC 61966-2-1; negative values mirror."""
    a = np.abs(linear)
    return np.sign(linear) * np.where(a <= 0.0031308, 12.92 * a,
                                      1.055 * np.power(np.maximum(a, 1e-300), 1 / 2.4) - 0.055)


def srgb_decode(encoded):
    a = np.abs(encoded)
    return np.sign(encoded) * np.where(a <= 0.04045, a / 12.92, ((a + 0.055) / 1.055) ** 2.4)


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
    """Y as it is; I and Q scaled by their spans around the code 128 (or 32768)."""
    middle = 2 ** (bits - 1) / (2 ** bits - 1)
    return codes(np.stack([signals[..., 0], signals[..., 1] / 1.2 + middle,
                           signals[..., 2] / 1.04 + middle], -1), bits)
