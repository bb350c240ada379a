"""The system calls that deploy/seccomp allows are enough for the daemon, and others do not exist."""

import hashlib
import json
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from deploy.tools import DEPLOY
from e2e.daemon import JSON, SHADED, SMALL, Daemon

try:
    import seccomp
except ImportError:
    seccomp = None

PROFILE = DEPLOY / "seccomp/shaded.json"
FORMATS = ["png", "jpeg", "webp", "tiff", "exr", "hdr"]


def confine():
    """Puts this process under the profile, as a container runtime does."""
    profile = json.loads(PROFILE.read_text())
    rules = seccomp.SyscallFilter(seccomp.ERRNO(profile["defaultErrnoRet"]))
    operators = {"SCMP_CMP_EQ": seccomp.EQ, "SCMP_CMP_MASKED_EQ": seccomp.MASKED_EQ}
    for rule in profile["syscalls"]:
        args = []
        for arg in rule.get("args", []):
            values = [arg["value"]] + ([arg["valueTwo"]] if "valueTwo" in arg else [])
            args.append(seccomp.Arg(arg["index"], operators[arg["op"]], *values))
        for name in rule["names"]:
            try:
                rules.add_rule(seccomp.ALLOW, name, *args)
            except RuntimeError:
                pass  # of another architecture
    rules.load()


class SeccompTest(unittest.TestCase):
    def test_the_profile_is_a_list_of_what_is_allowed(self):
        profile = json.loads(PROFILE.read_text())
        self.assertEqual(profile["defaultAction"], "SCMP_ACT_ERRNO")
        names = []
        for rule in profile["syscalls"]:
            self.assertEqual(rule["action"], "SCMP_ACT_ALLOW")
            self.assertEqual(rule["names"], sorted(rule["names"]))
            if "args" not in rule:
                names += rule["names"]
        self.assertEqual(len(names), len(set(names)))
        forbidden = {"bpf", "clone", "clone3", "init_module", "io_uring_setup", "keyctl", "mount",
                     "open_by_handle_at", "perf_event_open", "process_vm_writev", "ptrace",
                     "setns", "socket", "unshare", "userfaultfd"}
        self.assertFalse(forbidden & set(names))

    @unittest.skipUnless(seccomp, "there is no python3-seccomp")
    def test_the_daemon_serves_under_it(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        confined = Path(folder.name) / "confined"
        confined.write_text(f'#!/bin/sh\nexec {sys.executable} {__file__} confine {SHADED} "$@"\n')
        confined.chmod(0o700)
        with Daemon("--scenes-folder", folder.name, program=str(confined)) as daemon:
            for name in FORMATS:
                with self.subTest(name):
                    answer = daemon.render({**SMALL, "output": {"format": name}})
                    self.assertEqual(answer.status, 200, answer.body)
                    if name not in ("png", "exr"):
                        continue
                    path = "/v1/assets/" + hashlib.sha256(answer.body).hexdigest()
                    put = daemon.call("PUT", path, answer.body, {"Content-Type": f"image/{name}"})
                    self.assertEqual(put.status, 201, put.body)
            mesh = {"type": "mesh", "positions": [0, 0, 0, 1, 0, 0, 0, 1, 0],
                    "indices": [0, 1, 2]}
            self.assertEqual(daemon.render({**SMALL, "objects": [mesh]}).status, 200)
            kept = daemon.call("PUT", "/v1/scenes", json.dumps(SMALL), JSON)
            self.assertEqual(kept.status, 201, kept.body)
            self.assertFalse(daemon.events("decoder-loose"))
            self.assertFalse(daemon.events("scenes-folder-unwritable"))
            self.assertEqual(daemon.get("/readyz", admin=True).status, 200)
            self.assertEqual(daemon.get("/metrics", admin=True).status, 200)

    @unittest.skipUnless(seccomp, "there is no python3-seccomp")
    def test_other_calls_do_not_exist_under_it(self):
        script = ("import os, socket\n"
                  "for call in (lambda: os.chmod('/nonexistent', 0),\n"
                  "             lambda: os.mkdir('/tmp/x'),\n"
                  "             lambda: socket.socket(socket.AF_NETLINK, socket.SOCK_RAW)):\n"
                  "    try: call(); print('done')\n"
                  "    except OSError as error: print(error.errno)\n")
        done = subprocess.run([sys.executable, __file__, "confine", sys.executable, "-c", script],
                              capture_output=True, text=True, timeout=500, check=False)
        self.assertEqual(done.stdout.split(), ["38", "38", "38"], done.stderr)


if __name__ == "__main__":
    if sys.argv[1:2] == ["confine"]:
        confine()
        os.execv(sys.argv[2], sys.argv[2:])
    unittest.main()
