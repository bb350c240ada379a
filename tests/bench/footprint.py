#!/usr/bin/env python3
"""`./dev footprint`: what the daemon takes of memory and processors, into docs/footprint.md, by which
deploy/ asks for both."""

import json
import os
import sys
from pathlib import Path

from e2e.daemon import SOURCE, Daemon

MB = 1 << 20
FORMATS = {"png": ["png", "jpeg", "webp"], "exr": ["tiff", "exr", "hdr"]}
PAGE = """# What it takes

Made by `./dev footprint` on {machine}, Debian 12, with `--threads 1 --memory 768M`, which is what a limit
of 1 GiB leaves, and other options at their defaults. Memory is `VmRSS` of `/proc/PID/status`, the most of it `VmHWM`, of which files are `RssFile`: the program and its
libraries, whose pages the system may take back. Counted is `shaded_memory_used_bytes`. An eighth of `reuse` is
mapped at the start, and gives way like all that is kept. Of the last row it is counted afterwards.

| when | resident, MB | of which files | counted |
| --- | --- | --- | --- |
{memory}

Time of a processor is `process_cpu_seconds_total`, of twenty pictures in a row that share nothing.

| a sphere as PNG, 4 samples a pixel | milliseconds of a processor |
| --- | --- |
{time}

What is kept has filled up after 40 pictures of 512 x 512 pixels that share nothing.

So the manifests of `deploy/` ask for what all that is kept takes, and allow the largest picture beside
the program in three quarters of their limit; where memory is short what is kept gives way. Of
processors they ask for one: {each} pictures of 512 x 512 pixels a second.
"""


def scene(side, n=0, name="png"):
    return {"objects": [{"type": "sphere", "material": {"specular": 0.5}}], "camera": {"fov": 40 + n / 64},
            "image": {"width": side, "height": side},
            "output": {"format": name}}


class Measured:
    def __init__(self):
        self.rows = []

    def note(self, what, daemon, line="VmRSS"):
        status = dict(text.split(":\t", 1) for text in
                      Path(f"/proc/{daemon.pid}/status").read_text().splitlines() if ":\t" in text)
        told = [int(status[name].split()[0]) / 1024 for name in (line, "RssFile")]
        told.append(daemon.metrics()["shaded_memory_used_bytes"] / MB)
        self.rows.append(f"| {what} | " + " | ".join(f"{value:.0f}" for value in told) + " |")


def render(daemon, document):
    answer = daemon.render(document)
    if answer.status != 200:
        raise SystemExit(f"{json.dumps(document)[:200]}: {answer.body[:300]}")


def measure_memory():
    measured = Measured()
    with Daemon("--threads", "1", "--memory", "768M", "--reuse", "0") as daemon:
        measured.note("just started, with `--reuse 0`", daemon)
    with Daemon("--threads", "1", "--memory", "768M") as daemon:
        measured.note("just started", daemon)
        for name in FORMATS["png"]:
            render(daemon, scene(64, name=name))
        measured.note("a small picture each of PNG, JPEG and WebP", daemon)
        for name in FORMATS["exr"]:
            render(daemon, scene(64, name=name))
        measured.note("and each of TIFF, EXR and HDR", daemon)
        for n in range(40):
            render(daemon, scene(512, n))
        measured.note("what is kept has filled up", daemon)
    with Daemon("--threads", "1", "--memory", "768M") as daemon:
        render(daemon, scene(4096))
        measured.note("the largest picture, while it is made", daemon, "VmHWM")
    return measured.rows


def measure_time():
    """Milliseconds of a processor, by the picture's side."""
    told = {}
    with Daemon("--threads", "1", "--reuse", "0", "--response-cache", "0") as daemon:
        for side in (128, 512, 1024):
            render(daemon, scene(side))
            before = daemon.metrics()["process_cpu_seconds_total"]
            for n in range(20):
                render(daemon, scene(side, n + 1))
            told[side] = (daemon.metrics()["process_cpu_seconds_total"] - before) * 50
    return told


def main():
    cpu = next(line.split(":")[1].strip() for line in Path("/proc/cpuinfo").read_text().splitlines()
               if line.startswith(("model name", "Model")))
    times = measure_time()
    page = PAGE.format(machine=cpu, memory="\n".join(measure_memory()), each=int(1000 / times[512]),
                       time="\n".join(f"| {side} x {side} | {told:.1f} |" for side, told in times.items()))
    Path(sys.argv[1] if sys.argv[1:] else SOURCE / "docs/footprint.md").write_text(page)


if __name__ == "__main__":
    sys.exit(main())
