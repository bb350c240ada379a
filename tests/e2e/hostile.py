"""Files of pictures that mean harm, each of a format that is read: which end early, promise more than
there is, or stand for far more than they are long. For assets_test.py, and tests/bench/hostile.py."""

import functools
import io
import struct
import zlib

import numpy as np
from PIL import Image


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, pixels, *more):
    """Of 8 bits and three channels; `pixels` is what is deflated."""
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + b"".join(chunk(*one) for one in more) +
            chunk(b"IDAT", pixels) + chunk(b"IEND", b""))


@functools.cache
def deflated(size, of=bytes(1)):
    """So many bytes of zero, or of that."""
    packer = zlib.compressobj(9)
    block = of * ((1 << 20) // len(of))
    parts = [packer.compress(block[:min(len(block), size - at)]) for at in range(0, size, len(block))]
    return b"".join(parts) + packer.flush()


def tiff(width, height, strip, packing=8, rows=None, **tags):
    """Of 8 bits and three channels, of strips that are all alike; 8 is deflate, 1 is none. `_324=[8]` is
    the tag of that number."""
    rows = rows or height
    count = min(-(-height // rows), 1 << 13)
    entries = {256: [width], 257: [height], 258: [8, 8, 8], 259: [packing], 262: [2], 277: [3], 278: [rows],
               284: [1], 273: [0] * count, 279: [len(strip)] * count, **{int(k[1:]): v for k, v in tags.items()}}
    lists = 8 + 2 + 12 * len(entries) + 4
    data = lists + 4 * sum(len(values) for values in entries.values() if len(values) > 1)
    entries[273] = [data + i * len(strip) for i in range(count)]
    ifd, extra = struct.pack("<H", len(entries)), b""
    for key, values in sorted(entries.items()):
        ifd += struct.pack("<HHII", key, 4, len(values), values[0] if len(values) == 1 else lists + len(extra))
        extra += struct.pack(f"<{len(values)}I", *values) if len(values) > 1 else b""
    return b"II*\0" + struct.pack("<I", 8) + ifd + bytes(4) + extra + count * strip


def exr(width, height, packed, packing=2, rows=1, tile=None, channels=(b"B", b"G", b"R")):
    """Of floats, whose blocks of rows are a list, or all the same one; 2 is ZIP of one row, 3 of 16, 0 is
    none."""
    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(data)) + data

    listed = b"".join(name + b"\0" + struct.pack("<iB3xii", 2, 0, 1, 1) for name in channels)
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = (struct.pack("<II", 20000630, 2 | (0x200 if tile else 0)) +
            attribute(b"channels", b"chlist", listed + b"\0") +
            attribute(b"compression", b"compression", bytes([packing])) +
            attribute(b"dataWindow", b"box2i", window) + attribute(b"displayWindow", b"box2i", window) +
            attribute(b"lineOrder", b"lineOrder", b"\0") +
            attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)) +
            attribute(b"screenWindowCenter", b"v2f", bytes(8)) +
            attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) +
            (attribute(b"tiles", b"tiledesc", struct.pack("<IIB", *tile, 0)) if tile else b"") + b"\0")
    blocks = min(-(-height // rows), 1 << 16)
    packed = packed if isinstance(packed, list) else [packed] * blocks
    size = 8 + len(packed[0])
    starts = [len(head) + 8 * blocks + i * size for i in range(blocks)]
    body = b"".join(struct.pack("<ii", i * rows, len(block)) + block for i, block in enumerate(packed))
    return head + struct.pack(f"<{blocks}Q", *starts) + body


def hdr(width, height, body):
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + body


def rows_of_hdr(width, height):
    """Grey, each channel of each row in runs of 127."""
    runs = b"".join(bytes([128 + min(127, width - x), 128]) for x in range(0, width, 127))
    return (b"\2\2" + struct.pack(">H", width) + 4 * runs) * height


def photo(side, kind, **options):
    """A smooth picture with some noise."""
    x, y = np.meshgrid(np.arange(side), np.arange(side))
    noise = np.random.default_rng(1).integers(0, 8, (side, side))
    codes = np.stack([x * 240 // side + noise, y * 240 // side + noise, (x + y) * 120 // side], -1)
    out = io.BytesIO()
    Image.fromarray(codes.astype(np.uint8)).save(out, kind, **options)
    return out.getvalue()


def scans(side, count):
    """A progressive JPEG, grey, of so many scans, each of a few bytes and of all of the picture: bands
    of coefficients, one at a time, made finer bit by bit."""
    def segment(mark, data):
        return b"\xff" + bytes([mark]) + struct.pack(">H", 2 + len(data)) + data

    def table(kind, symbol):
        return segment(0xc4, bytes([kind, 1] + 15 * [0] + [symbol]))

    blocks = (side // 8) ** 2
    out = (b"\xff\xd8" + segment(0xdb, bytes([0] + 64 * [1])) +
           segment(0xc2, struct.pack(">BHHBBBB", 8, side, side, 1, 1, 0x11, 0)) + table(0, 0) + table(0x10, 0xe0))
    out += segment(0xda, bytes([1, 1, 0, 0, 0, 0])) + bytes(-(-blocks // 8))
    # An end-of-band run of 14 bits: a 0 for its symbol, and 14 bits of its length over 16384.
    left, bits = blocks, ""
    while left >= 16384:
        run = min(left, 32767)
        bits += "0" + format(run - 16384, "014b")
        left -= run
    bits += "1" * (-len(bits) % 8)
    body = bytes(int(bits[i:i + 8], 2) for i in range(0, len(bits), 8)).replace(b"\xff", b"\xff\0")
    made = 0
    for band in range(1, 64):
        for bit in range(13, -1, -1):
            if made == count:
                return out + b"\xff\xd9"
            out += segment(0xda, bytes([1, 1, 0, band, band, (0 if bit == 13 else (bit + 1) << 4) | bit])) + body
            made += 1
    return out + b"\xff\xd9"


def cut(body, part=0.97):
    return body[:int(part * len(body))]


def spoilt(body, part=0.97):
    """With a few bytes that are others."""
    at = int(part * len(body))
    return body[:at] + bytes(byte ^ 0x55 for byte in body[at:at + 16]) + body[at + 16:]


def make(side, bomb):
    """(format, what is wrong, file) of each, where `side` is that of large pictures, a multiple of 128,
    and `bomb` bytes are what something small stands for."""
    row, huge = 3 * side + 1, 100000
    blank = deflated(row * side)
    pattern = bytes(range(256))
    strip, line = deflated(3 * side * 16, pattern), deflated(12 * side, pattern)
    files = {"png": png(side, side, blank), "jpeg": photo(side, "JPEG", quality=90),
             "progressive jpeg": photo(side, "JPEG", quality=90, progressive=True),
             "webp": photo(side, "WEBP", quality=80), "tiff": tiff(side, side, strip, rows=16),
             "tiff in one strip": tiff(side, side, deflated(3 * side * side, pattern)),
             "exr": exr(side, side, line), "hdr": hdr(side, side, rows_of_hdr(side, side))}
    for name, body in files.items():
        yield name, "ends early", cut(body)
        yield name, "is spoilt", spoilt(body)
        yield name, "is its first 64 bytes", body[:64]
    yield "png", "promises 100,000 x 100,000", png(huge, huge, blank)
    yield "png", "promises many times what it has", png(side, side, deflated(row))
    yield "png", "has one row of them", png(side, side, deflated(row, bytes(range(251))))
    yield "png", "goes on in many zeros", png(64, 64, deflated(bomb))
    yield "png", "has a large profile", png(8, 8, deflated(25 * 8), (b"iCCP", b"x\0\0" + deflated(bomb)))
    texts = [(b"zTXt", b"x\0\0" + deflated(1 << 23))] * 256
    yield "png", "has 256 texts of 8 MB, packed", png(8, 8, deflated(25 * 8), *texts)
    yield "png", "has many chunks", png(8, 8, deflated(25 * 8), *[(b"tEXt", b"x\0y")] * (bomb // 1000))
    jpeg = files["jpeg"]
    at = jpeg.index(b"\xff\xc0") + 5
    yield "jpeg", "promises 65,500 x 65,500", jpeg[:at] + struct.pack(">HH", 65500, 65500) + jpeg[at + 4:]
    yield "jpeg", "has 800 scans", scans(side, 800)
    webp = files["webp"]
    at = webp.index(b"\x9d\x01\x2a") + 3
    yield "webp", "promises 16,383 x 16,383", webp[:at] + struct.pack("<HH", 16383, 16383) + webp[at + 4:]
    yield "tiff", "promises 100,000 x 100,000", tiff(huge, huge, strip, rows=16)
    yield "tiff", "has one strip of them", tiff(side, side, deflated(3 * side))
    yield "tiff", "has a strip of many zeros", tiff(64, 64, deflated(bomb))
    yield "tiff", "has 65,535 channels", tiff(64, 64, strip, _277=[65535])
    yield "tiff", "has a tag of 2^30 values", tiff(64, 64, strip, rows=16).replace(
        struct.pack("<HHI", 279, 4, 4), struct.pack("<HHI", 279, 4, 1 << 30))
    wide = tiff(64, 64, strip, _322=[1 << 20], _323=[1 << 20], _324=[8], _325=[64])
    yield "tiff", "has tiles of 2^20 x 2^20", wide
    yield "exr", "promises 100,000 x 100,000", exr(huge, huge, line)
    yield "exr", "promises 4 x 2,000,000,000", exr(4, 2000000000, line)
    yield "exr", "has rows of many zeros", exr(64, 4, deflated(bomb))
    yield "exr", "has tiles of 2^20 x 2^20", exr(64, 64, line, tile=(1 << 20, 1 << 20))
    yield "exr", "has 4,000 channels", exr(side, side, line, channels=[b"%05d" % i for i in range(4000)])
    yield "hdr", "promises 100,000 x 100,000", hdr(huge, huge, b"")
    yield "hdr", "promises many times what it has", hdr(side, side, rows_of_hdr(side, 1))
    yield "hdr", "promises endless rows of nothing", hdr(0, (1 << 64) - 1, bytes(8))
    yield "hdr", "has a head of 30 MB", hdr(8, 8, bytes(256)).replace(b"FORMAT", b"A=1\n" * 7500000 + b"FORMAT")
