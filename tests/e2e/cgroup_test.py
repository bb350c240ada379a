"""The daemon with its defaults in control groups of 128, 256 and 512 MB, with a half, one and two
processors: it finds its limits, and no client has it killed. Wants root and control groups that can be
written to (version 1, or 2 with both controllers passed on), else it is skipped."""

import json
import os
import sys
import tempfile
import unittest
from pathlib import Path

from e2e.daemon import SANITIZED, SHADED, SMALL, Daemon
from e2e.memory_test import MB, asking, large

ROOT = Path("/sys/fs/cgroup")
NAME = f"shaded-test-{os.getpid()}"


class Group:
    """A control group of its own for a with block; `enter` is a prefix of commands to run in it."""

    def __init__(self, memory, processors):
        quota = int(processors * 100000)
        if (ROOT / "cgroup.controllers").exists():
            self.limits = {ROOT / NAME: {"memory.max": memory, "memory.swap.max": 0,
                                         "cpu.max": f"{quota} 100000"}}
            self.peak = ROOT / NAME / "memory.peak"
        else:
            self.limits = {ROOT / "memory" / NAME: {"memory.limit_in_bytes": memory},
                           ROOT / "cpu" / NAME: {"cpu.cfs_period_us": 100000,
                                                 "cpu.cfs_quota_us": quota}}
            self.peak = ROOT / "memory" / NAME / "memory.max_usage_in_bytes"

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

            statuses = set()
            for n in range(30):
                scene = {**SMALL, "camera": {"fov": 40 + n / 64},
                         "image": {"width": 512, "height": 512, "samples": 4}}
                statuses.add(daemon.render(scene).status)
            self.assertEqual(statuses, {200})
            # Whatever is asked for at a time is answered, or refused by its memory.
            name = "png" if memory < 256 else "hdr"
            ignored = [asking(daemon, large(n, 700, 8, name)) for n in range(8)]
            for n in range(3):
                answer = daemon.render(large(100 + n, 1100, 6, name))
                self.assertIn(answer.status, (200, 422, 429, 504), answer.body[:200])
                if answer.status in (422, 429):
                    self.assertIn("memory", json.loads(answer.body)["detail"])
            self.assertEqual(daemon.render(SMALL).status, 200)
            self.assertIsNone(daemon.process.poll())
            print(f"{memory} MB, {processors}: {group.peak.read_text().strip()} bytes at most, "
                  f"{daemon.metrics()['shaded_memory_used_bytes']:.0f} counted", file=sys.stderr)
            for connection in ignored:
                connection.close()

    def test_every_size(self):
        for memory, processors in ((128, 0.5), (256, 1), (512, 2)):
            with self.subTest(f"{memory} MB, {processors} processors"):
                self.check(memory, processors)


if __name__ == "__main__":
    reason = why_not()
    if reason:
        print(f"SKIPPED: {reason}")
        sys.exit(77)
    unittest.main()
