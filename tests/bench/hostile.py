#!/usr/bin/env python3
"""`./dev hostile`: what files of pictures that mean harm cost until they are refused, into
docs/hostile.md. Each is given to shaded-decode as the library gives it (src/decode/wire.h)."""

import os
import socket
import struct
import subprocess
import sys
import tempfile
from pathlib import Path

BUILD, SOURCE = Path(os.environ["SHADED_BUILD"]), Path(os.environ["SHADED_SOURCE"])
TOLD = struct.Struct("<Q7i256si")
BYTES = {1: 1, 2: 2, 8: 4}
MB = 1 << 20
QUIET = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1", "OPENIMAGEIO_THREADS": "1", "MALLOC_ARENA_MAX": "1"}
PAGE = """# Hostile pictures

Made by `./dev hostile` on {machine}, Debian 12: files that `PUT /v1/assets/{{sha256}}`, or a folder of `--assets`, may bring,
given to `shaded-decode` as the daemon does with its usual limits. Large pictures are of 4096 x 4096 pixels, the limit of
`--max-pixels`; what is small and stands for much stands for a gigabyte. `tests/e2e/hostile.py` makes them.

Milliseconds are of a processor, from the start of the process to its answer, less what a small good file of the format
takes ({loads}), most of which OpenImageIO takes to load. So is memory: the most that is resident, less {rests};
up to 31 MB more are told where the measuring program held that much when it started the process.

| format | the file | long, kB | the answer | ms | MB |
| --- | --- | --- | --- | --- | --- |
{rows}

- What ends early is told by the lengths in the file, before anything is decoded: chunks of PNG and their checksums, markers of
  JPEG, strips and tiles of TIFF, blocks of OpenEXR, rows of HDR; of WebP by its library.
- What is spoilt within is found before it is decoded where zlib has packed it: OpenEXR's ZIP and ZIPS, TIFF's deflate. Each
  block is unpacked once and its sum looked at, which takes a twentieth of what decoding does, of good pictures, too. That a
  block of OpenEXR's is not where its rows are is found in the same way. PNG has sums, and HDR is walked through. Blocks that
  share a file's bytes are looked at until as many were read as it has: one bomb, named a hundred thousand times, is one.
- Else it is found where decoding comes to it, and takes as long as that, up to a good picture's time: in JPEG, WebP, what
  OpenEXR packs in other ways (PIZ, DWA, PXR24, B44), and TIFF's LZW, or what it packs into pieces of more than 64 MB.
  TIFF has no other sums, nor has JPEG: bytes that are others there may be another picture. To unpack codes alone, without
  making pixels of them, would find it in a third of that in JPEG, in a quarter in WebP, and in all of it where a JPEG is
  progressive; every good picture would pay as much. A good one takes the same time to decode as a spoilt one may.
- What promises more than `--max-pixels` allows is refused by its head. The rest is held by limits of the process: 64 MB beside
  the file until the head is known, then 160 MB and four times the samples, 30 seconds, no files, and
  [21 system calls](operating.md#pictures-of-clients-and-yours).
"""


def make(folder):
    """The files, and a list of them: by a process of its own, whose memory a child would begin with."""
    from e2e import hostile  # pylint: disable=import-outside-toplevel
    row, line = hostile.deflated(64 * 3 * 16), hostile.deflated(64 * 12)
    good = {"png": hostile.photo(64, "PNG"), "jpeg": hostile.photo(64, "JPEG"), "webp": hostile.photo(64, "WEBP"),
            "tiff": hostile.tiff(64, 64, row, rows=16), "exr": hostile.exr(64, 64, line),
            "hdr": hostile.hdr(64, 64, hostile.rows_of_hdr(64, 64))}
    files = [(kind, "", body) for kind, body in good.items()] + list(hostile.make(4096, 1 << 30))
    for i, (kind, what, body) in enumerate(files):
        (Path(folder) / f"{i:03}").write_bytes(body)
        print(f"{kind}\t{what}")


def converse(ours, body):
    """(status, sentence) of the answer, as src/assets/decoder.c asks for it."""
    def hear():
        told = ours.recv(TOLD.size, socket.MSG_WAITALL)
        return TOLD.unpack(told) if len(told) == TOLD.size else (0, -1) + 6 * (0,) + (b"it gave up", 0)

    ours.sendall(struct.pack("<4Q", TOLD.size, len(body), 1 << 24, len(body) + 64 * MB) + body)
    told = hear()
    if told[1] == 0:
        width, height, count, _, _, depth = told[2:8]
        samples = width * height * count * BYTES[depth]
        ours.sendall(struct.pack("<Q", len(body) + 160 * MB + 4 * samples))
        told = hear()
    return told[1], told[8].rstrip(b"\0").decode()


def measure(body):
    """(status, sentence, milliseconds of a processor, MB)"""
    ours, its = socket.socketpair()
    program = str(BUILD / "shaded-decode")
    pid = os.posix_spawn(program, [program], QUIET, file_actions=[(os.POSIX_SPAWN_DUP2, its.fileno(), 0)])
    its.close()
    try:
        status, text = converse(ours, body)
    except ConnectionError:
        status, text = -1, "it gave up"
    ours.close()
    usage = os.wait4(pid, 0)[2]
    return status, text, 1e3 * (usage.ru_utime + usage.ru_stime), usage.ru_maxrss / 1024


def best(body):
    """The least time of three."""
    return min((measure(body) for _ in range(3)), key=lambda one: one[2])


def main():
    cpu = next(line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines()
               if line.startswith(("model name", "Model")))
    good, rows = {}, []
    with tempfile.TemporaryDirectory() as folder:
        listed = subprocess.run([sys.executable, "-B", __file__, "make", folder], check=True, capture_output=True,
                                text=True).stdout.splitlines()
        for path, line in zip(sorted(Path(folder).iterdir()), listed):
            kind, what = line.split("\t")
            body = path.read_bytes()
            status, text, time, memory = best(body)
            if not what:
                if status:
                    raise SystemExit(f"{kind}: {text}")
                good[kind] = time, memory
                continue
            basis = good[kind.split(" in ")[0].split()[-1]]
            answer = {0: "it is read", 5: "decoding it takes more memory than there is for it"}.get(status, text)
            rows.append(f"| {kind} | {what} | {len(body) / 1000:.0f} | {answer} | {max(0, time - basis[0]):.0f} | "
                        f"{max(0, memory - basis[1]):.0f} |")
    own, other = ("png", "jpeg", "webp"), ("tiff", "exr", "hdr")
    told = [f"{max(good[k][i] for k in own):.0f} {unit}, and {max(good[k][i] for k in other):.0f} of TIFF, EXR and HDR"
            for i, unit in ((0, "ms"), (1, "MB"))]
    page = PAGE.format(machine=cpu, loads=told[0], rests=told[1], rows="\n".join(rows))
    Path(sys.argv[1] if sys.argv[1:] else SOURCE / "docs/hostile.md").write_text(page)


if __name__ == "__main__":
    sys.exit(make(sys.argv[2]) if sys.argv[1:2] == ["make"] else main())
