"""The daemon with its defaults in control groups of 128, 256 and 512 MB, with a half, one and two
processors: it finds its limits, and no client has it killed. Wants root and control groups that can be
written to (version 1, or 2 with both controllers passed on), else it is skipped. Three of the nine pairs,
each size and each share once; all nine with SHADED_CGROUPS=all, as `./dev container` has them on the image."""

import os
import re
import sys
import tempfile
import unittest
from pathlib import Path

from e2e.daemon import SANITIZED, SHADED, SMALL, Daemon
from e2e.memory_test import MB
from e2e.worst import demand_all

ROOT = Path("/sys/fs/cgroup")
NAME = f"shaded-test-{os.getpid()}"
SIZES = [(memory, processors) for memory in (128, 256, 512) for processors in (0.5, 1, 2)]
CHOSEN = SIZES if os.environ.get("SHADED_CGROUPS") == "all" else SIZES[::4]


def kills_and_peak(pid):
    """Of the control group that bounds this process' memory: how many processes were killed for lack
    of it, and the most bytes that were taken."""
    lines = Path(f"/proc/{pid}/cgroup").read_text().splitlines()
    groups = {name: path for _, names, path in (line.split(":", 2) for line in lines)
              for name in names.split(",")}
    if "memory" in groups:
        folder = Path(f"{ROOT}/memory{groups['memory']}")
        events, peak = "memory.oom_control", "memory.max_usage_in_bytes"
    else:
        folder, events, peak = Path(f"{ROOT}{groups['']}"), "memory.events", "memory.peak"
    kills = re.search(r"^oom_kill (\d+)$", (folder / events).read_text(), re.MULTILINE)
    return int(kills[1]), int((folder / peak).read_text())


class Group:
    """A control group of its own for a with block; `enter` is a prefix of commands to run in it."""

    def __init__(self, memory, processors):
        quota = int(processors * 100000)
        if (ROOT / "cgroup.controllers").exists():
            self.limits = {ROOT / NAME: {"memory.max": memory, "memory.swap.max": 0,
                                         "cpu.max": f"{quota} 100000"}}
        else:
            self.limits = {ROOT / "memory" / NAME: {"memory.limit_in_bytes": memory},
                           ROOT / "cpu" / NAME: {"cpu.cfs_period_us": 100000,
                                                 "cpu.cfs_quota_us": quota}}

    def __enter__(self):
        for folder, values in self.limits.items():
            folder.mkdir()
            for name, value in values.items():
                (folder / name).write_text(str(value))
        return self

    def __exit__(self, *exception):
        for folder in self.limits:
            folder.rmdir()

    def program(self, folder):
        """Of the daemon, as a script that enters first."""
        script = Path(folder) / "shaded"
        enter = "".join(f'echo $$ > "{group}/cgroup.procs"\n' for group in self.limits)
        script.write_text(f'#!/bin/sh\nset -e\n{enter}exec "{SHADED}" "$@"\n')
        script.chmod(0o755)
        return str(script)


def why_not():
    if SANITIZED:
        return "a sanitizer's memory is its own"
    try:
        with Group(128 * MB, 1):
            return None
    except OSError as error:
        return f"no control group can be made here: {error}"


class GroupTest(unittest.TestCase):
    def check(self, memory, processors):
        with tempfile.TemporaryDirectory() as folder, Group(memory * MB, processors) as group, \
                Daemon(program=group.program(folder)) as daemon:
            machine, shares = daemon.wait_for("machine"), daemon.wait_for("memory")
            self.assertEqual(machine["memory"], memory * MB)
            self.assertEqual(machine["cpu-quota"], f"{processors:.2f}")
            self.assertEqual(shares["budget"], memory * MB // 4 * 3)
            most = min(len(os.sched_getaffinity(0)), -(-processors // 1))
            self.assertEqual(daemon.wait_for("listening")["threads"], most)

            answers = demand_all(daemon.address)
            self.assertEqual(daemon.render(SMALL).status, 200)
            self.assertIsNone(daemon.process.poll())
            kills, peak = kills_and_peak(daemon.pid)
            self.assertEqual(kills, 0)
            print(f"{memory} MB, {processors}: {peak / MB:.0f} MB at most, "
                  f"{daemon.metrics()['shaded_memory_used_bytes'] / MB:.0f} counted; {answers}",
                  file=sys.stderr)

    def test_every_size(self):
        for memory, processors in CHOSEN:
            with self.subTest(f"{memory} MB, {processors} processors"):
                self.check(memory, processors)


if __name__ == "__main__":
    reason = why_not()
    if reason:
        print(f"SKIPPED: {reason}")
        sys.exit(77)
    unittest.main()
