#!/usr/bin/env python3
"""The bytes of all that a build answers, as digests, one a line: equal builds write equal files.

    tests/same/answers.py BUILD FILE

Pictures with what their headers say of them, in both tiers; plans explained; tiers compared; the
problems of bad documents and what is known of materials, shapes and color spaces: of the documents
of scenes.py, with each kernel that this machine has. Left out is what may differ where nothing
changed: times, versions, and entity tags, which depend on the version.
"""

import hashlib
import json
import os
import re
import sys
from pathlib import Path

SOURCE = Path(os.environ.setdefault("SHADED_SOURCE", str(Path(__file__).resolve().parents[2])))
if __name__ == "__main__":
    os.environ["SHADED_BUILD"] = str(Path(sys.argv[1]).resolve())
sys.path[:0] = [str(SOURCE / "tests"), str(Path(__file__).parent)]
import scenes  # noqa: E402
from e2e.daemon import Daemon  # noqa: E402

OPTIONS = ("--reuse", "0", "--response-cache", "0", "--log-requests", "off", "--timeout", "600")
KERNELS = ("portable", "avx2", "avx512", "neon")
HEADERS = ("Content-Type", "Shaded-Plan", "Shaded-Warning", "Shaded-Saturated", "Shaded-Clipped", "Shaded-Rays", "Shaded-Codec",
           "Allow")
TIMES = {"milliseconds", "seconds", "times", "version", "versions"}
FORMATS = ("png", "jpeg", "webp", "tiff", "exr", "hdr")


def without_times(value):
    """JSON without what was measured. What explain estimates is not, and stays."""
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if k not in TIMES}
    return [without_times(v) for v in value] if isinstance(value, list) else value


def told(answer, measured=False):
    """What there is to compare of an answer, as bytes."""
    kind = answer.headers.get("Content-Type", "")
    body = answer.body
    if measured:
        body = json.dumps(without_times(json.loads(body)), sort_keys=True).encode()
    boundary = re.search(r"boundary=(\S+)", kind)
    if boundary:
        body = body.replace(boundary[1].encode(), b"")
        kind = kind.replace(boundary[1], "")
    if "problem+json" in kind:
        body = re.sub(rb'"instance": *"[^"]*"', b"", body)
    headers = [f"{name}: {value}" for name in HEADERS if name != "Content-Type"
               for value in answer.headers.get_all(name, [])]
    return "\n".join([str(answer.status), kind, *headers, ""]).encode() + body


def asked(daemon, some):
    """(what, its bytes) of all answers; of less where `some`: what depends on no kernel."""
    for number, (name, document) in enumerate(scenes.good()):
        for tier in ("standard", "exact"):
            picture = {**document, "accuracy": {"tier": tier}}
            yield f"{name}, {tier}", told(daemon.render(picture))
        yield f"{name}, as it is", told(daemon.render(document))
        yield f"{name}, explained", told(daemon.post("/v1/explain", document))
        if number % 3 == 0:
            yield f"{name}, compared", told(daemon.post("/v1/compare", document), measured=True)
        output = {k: v for k, v in document.get("output", {}).items() if k in ("display", "view")}
        kind = FORMATS[number % len(FORMATS)]
        if "outputs" not in document:
            yield f"{name}, {kind}", told(daemon.render({**document, "output": {
                **output, "format": kind}}))
    if some:
        return
    for number, (name, document) in enumerate(scenes.bad()):
        yield f"mistake {number}: {name}", told(daemon.render(document))
    for path in ("/v1/materials", "/v1/shapes", "/v1/colorspaces"):
        yield path, told(daemon.get(path))
    for material in json.loads(daemon.get("/v1/materials").body)["materials"]:
        path = f"/v1/preview/{material['name']}?width=32&height=32"
        yield path, told(daemon.get(path))


def main():
    with open(sys.argv[2], "w", encoding="utf-8") as out:
        for some, kernel in enumerate(KERNELS):
            try:
                daemon = Daemon("--kernel", kernel, *OPTIONS)
            except AssertionError:
                continue  # this machine lacks it
            with daemon:
                for what, answer in asked(daemon, bool(some)):
                    digest = hashlib.sha256(answer).hexdigest()[:32]
                    out.write(f"{digest}  {kernel}: {what}\n")


if __name__ == "__main__":
    main()
