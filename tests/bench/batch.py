"""Measures what a batch saves: batch.py FOLDER

Writes FOLDER/batch.md: the time of 1,000 variants of a scene as one batch, and as as many requests,
one after the other, on one connection that is kept open. `./dev bench --batch` builds what this
needs and runs it. The client writes and reads plain bytes, and has all requests ready before."""

import json
import socket
import statistics
import sys
import time
from pathlib import Path

import programs
from priority import raise_priority

ROUNDS = 7
COUNT = 1000
SIZES = (64, 128, 256)
THREADS = (1, 2)
PLACES = {"/materials/m/shininess": lambda i: 10 + i / 4, "/materials/m/diffuse": lambda i: [0.8, i / 1000, 0.2]}
END = b"--\r\n\r\n0\r\n\r\n"  # of the last part, and of the chunks


def scene(size, turn):
    """Each round's differs, so that nothing of the one before it is of use."""
    return {"image": {"width": size, "height": size, "samples": 1}, "ambient": 0.1 + turn / 1e6,
            "lights": [{"type": "point", "position": [2, 3, 4]}, {"type": "directional", "direction": [1, -1, -1]}],
            "materials": {"m": {"diffuse": [0.8, 0.3, 0.2], "specular": 0.4, "shininess": 30}},
            "objects": [{"type": "sphere", "radius": 1.4, "material": "m"}]}


def request(path, document):
    body = json.dumps(document, separators=(",", ":")).encode()
    return (f"POST {path} HTTP/1.1\r\nHost: bench\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(body)}\r\n\r\n").encode() + body


def singles(size, place, turn):
    requests = []
    for i in range(COUNT):
        document = scene(size, turn)
        document["materials"]["m"][place.rsplit("/", 1)[1]] = PLACES[place](i)
        requests.append(request("/v1/render", document))
    return requests


def read_one(connection):
    data = b""
    while b"\r\n\r\n" not in data:
        data += connection.recv(1 << 20)
    head, _, body = data.partition(b"\r\n\r\n")
    if not head.startswith(b"HTTP/1.1 200"):
        sys.exit(f"bench: {data[:500]}")
    rest = int(head.lower().split(b"content-length:")[1].split(b"\r\n")[0]) - len(body)
    while rest > 0:
        rest -= len(connection.recv(1 << 20))


def time_singles(connection, requests):
    began = time.perf_counter()
    for one in requests:
        connection.sendall(one)
        read_one(connection)
    return time.perf_counter() - began


def time_batch(connection, one):
    began = time.perf_counter()
    connection.sendall(one)
    chunks = [b""]
    while not b"".join(chunks[-2:]).endswith(END):
        chunks.append(connection.recv(1 << 20))
        if not chunks[-1]:
            sys.exit("bench: the batch ends early")
    took = time.perf_counter() - began
    parts = b"".join(chunks).lower().count(b"\r\ncontent-type: image/png")
    if parts != COUNT:
        sys.exit(f"bench: {parts} pictures of {COUNT}")
    return took


def measure():
    """Ratios of neighbors in time: {(threads, size, place): [(batch, singles)]}."""
    found = {}
    for threads in THREADS:
        with programs.Daemon(core=None, threads=threads) as daemon, \
                socket.create_connection((daemon.address, int(daemon.port))) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            for turn in range(ROUNDS):
                for size in SIZES:
                    for place, value in PLACES.items():
                        alone = singles(size, place, 2 * turn)
                        batch = request("/v1/batch", {"scene": scene(size, 2 * turn + 1),
                                                      "sweep": {place: [value(i) for i in range(COUNT)]}})
                        found.setdefault((threads, size, place), []).append(
                            (time_batch(connection, batch), time_singles(connection, alone)))
    return found


def report(found, machine):
    lines = [
        "# What a batch saves", "",
        f"What `./dev bench --batch` has measured: {COUNT:,} variants of a sphere with two lights, as one",
        "`POST /v1/batch` and as as many `POST /v1/render`, one after the other, on one connection.",
        f"Milliseconds on the wall, medians of {ROUNDS} rounds in turns; the ratio is the median of each",
        "round's, beside the least. The daemon's cache of answers is off.", "",
        f"On {machine['processor']}, {machine['system']}, {len(programs.CORES)} processors, which the client shares.",
        "", "| rendering threads | pixels | sweep of | batch | requests | times faster | at least |",
        "| --- | --- | --- | --- | --- | --- | --- |"]
    for (threads, size, place), pairs in found.items():
        ratios = [alone / batch for batch, alone in pairs]
        batch, alone = (1e3 * statistics.median(side) for side in zip(*pairs))
        lines.append(f"| {threads} | {size}x{size} | `{place}` | {batch:.0f} | {alone:.0f} | "
                     f"{statistics.median(ratios):.2f} | {min(ratios):.2f} |")
    pairs = found[THREADS[0], SIZES[0], "/materials/m/shininess"]
    saved = 1e6 / COUNT * statistics.median(alone - batch for batch, alone in pairs)
    lines += ["", f"A batch saves what is around pictures: reading requests, answering them and waiting for the client, {saved:.0f} us of",
              f"each of {SIZES[0]}x{SIZES[0]} pixels. On one thread it can save no more, for that one has work all the time: making and",
              "compressing the same pictures. On several threads pictures are made side by side, each of which alone is too",
              "small to be shared."]
    return "\n".join(lines) + "\n"


def main():
    folder = Path(sys.argv[-1])
    raise_priority()
    page = report(measure(), programs.machine())
    (folder / "batch.md").write_text(page, encoding="utf-8")
    print(page)


if __name__ == "__main__":
    main()
