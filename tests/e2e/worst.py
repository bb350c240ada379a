"""What takes most memory of all that the daemon's defaults admit, asked for at a time: for tests in
small containers."""

import http.client
import json
import threading
from collections import namedtuple

from e2e.daemon import JSON, PATIENCE, SMALL
from e2e.memory_test import ROUGH, asking, large

LAYERS = ["beauty", "emissive", "ambient", "diffuse", "specular", "normal", "position", "depth",
          "object"]
Place = namedtuple("Place", "address")


def image(side, samples=1):
    return {"width": side, "height": side, "samples": samples}


def long_mesh(side=700):
    """A document of 24 MB, of the 32 that may be: side x side points."""
    points = ",".join(f"{x},{y},{(x * y) % 7}" for y in range(side) for x in range(side))
    corners = ",".join(f"{at},{at + 1},{at + side},{at + 1},{at + side + 1},{at + side}"
                       for y in range(side - 1) for at in range(y * side, y * side + side - 1))
    return (f'{{"objects": [{{"type": "mesh", "positions": [{points}], "indices": [{corners}]}}], '
            f'"image": {json.dumps(image(16))}}}')


def documents():
    """(name, path, document), of which each may be the first to need the most."""
    lamps = [{"type": "point", "position": [3, i, 3]} for i in range(12)]
    spheres = [{"type": "sphere", "radius": 0.01, "material": {"diffuse": [i / 10000, 0.5, 0.5]},
                "transform": {"translate": [i % 100 / 50 - 1, i / 5000 - 1, 0]}} for i in range(10000)]
    return [
        ("most pixels", "/v1/render", {"objects": [ROUGH], "image": image(4096)}),
        ("most samples", "/v1/render", {"objects": [ROUGH], "image": image(300, 64)}),
        ("16 bits", "/v1/render", {"objects": [ROUGH], "image": image(2800),
                                   "output": {"format": "png", "bitDepth": 16}}),
        ("eight files", "/v1/render", large(0, 1400, 8, "hdr")),
        ("many files", "/v1/render", large(1, 700, 16, "png")),
        ("many transforms", "/v1/render", {"objects": [ROUGH], "image": image(64), "outputs": [
            {"name": f"o{i}", "format": "png", "bitDepth": 16, "display": "Rec.2100-PQ", "exposure": i / 16,
             "view": "ACES 1.1 - HDR Video (1000 nits & Rec.2020 lim)"} for i in range(16)]}),
        ("layers", "/v1/render", {"objects": [ROUGH], "lights": lamps, "image": image(1000), "output": {
            "format": "exr", "bitDepth": "float",
            "layers": LAYERS + [f"light.{i}" for i in range(12)]}}),
        ("long body", "/v1/render", LONG),
        ("most objects", "/v1/render", {"objects": spheres, "image": image(64)}),
        ("faces", "/v1/render", {"objects": [{"type": "sphere", "segments": 512,
                                              "interpolation": "flat"}] * 2, "image": image(64)}),
        ("analysis", "/v1/analyze", {"objects": [ROUGH], "image": image(1200)}),
        ("comparison", "/v1/compare", {"objects": [ROUGH], "image": image(1200)}),
        ("difference", "/v1/diff", {side: {"objects": [ROUGH], "image": image(900)} for side in "ab"}),
    ]


LONG = long_mesh()
DOCUMENTS = [(name, path, document if isinstance(document, str) else json.dumps(document))
             for name, path, document in documents()]


DROPPED = 429, b"dropped for its memory"


def ask(address, path, body):
    """(status, body), or DROPPED: on a slow machine the daemon may take a client that reads an answer for
    one that does not."""
    connection = http.client.HTTPConnection(*address, timeout=PATIENCE)
    try:
        connection.request("POST", path, body, JSON)
        answer = connection.getresponse()
        return answer.status, answer.read()
    except (ConnectionResetError, BrokenPipeError, http.client.IncompleteRead):
        return DROPPED
    finally:
        connection.close()


def demand_all(address, clients=4, small=100):
    """Asks for all documents, by several clients at a time, beside whom eight take no answer and one
    asks for small pictures; then once more, alone, for what was refused for lack of room or time. Returns
    {name: status}, of small pictures the set of theirs. An AssertionError where an answer is none of a
    daemon that knows its limits."""
    answers, small_ones, lock = {}, set(), threading.Lock()
    left = list(DOCUMENTS)

    def ask_for_large_ones():
        while True:
            with lock:
                if not left:
                    return
                name, path, body = left.pop()
            answer = ask(address, path, body)
            with lock:
                answers[name] = answer

    def ask_for_small_ones():
        for n in range(small):
            scene = {**SMALL, "camera": {"fov": 40 + n / 64}}
            small_ones.add(ask(address, "/v1/render", json.dumps(scene))[0])

    threads = [threading.Thread(target=ask_for_large_ones) for _ in range(clients)]
    threads.append(threading.Thread(target=ask_for_small_ones))
    ignored = [asking(Place(address), large(100 + n, 700, 8, "png" if n % 2 else "hdr"))
               for n in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for connection in ignored:
        connection.close()
    for name, path, body in DOCUMENTS:
        if answers[name][0] in (429, 504):
            answers[name] = ask(address, path, body)
    for name, (status, body) in answers.items():
        assert (status, body) != DROPPED, name
        assert status in (200, 422, 429, 504), (name, status, body[:300])
        assert status not in (422, 429) or b"memory" in body, (name, body[:300])
    assert small_ones <= {200, 429, 504}, small_ones
    return {**{name: status for name, (status, _) in answers.items()}, "small": small_ones}
