"""The programs that deploy/ is written for, as they check it: from the system, or from where `./dev
test` unpacked them."""

import os
import shutil
import subprocess
import unittest
from pathlib import Path

SOURCE = Path(os.environ["SHADED_SOURCE"])
DEPLOY = SOURCE / "deploy"
UNPACKED = SOURCE / "build/tools"
# What makes a bare Debian, once for all tests that begin with one, and where it is then.
BARE, BARE_FILE = SOURCE / "tests/deploy/bare", SOURCE / "build/bare.tar"
PLACES = os.pathsep.join([os.environ.get("PATH", ""), "/usr/sbin", "/usr/bin",
                          str(UNPACKED / "usr/sbin"), str(UNPACKED / "usr/bin")])


def find(name):
    """The path of a program; without it the test is skipped."""
    path = shutil.which(name, path=PLACES)
    if not path:
        raise unittest.SkipTest(f"there is no {name}: ./dev test fetches it")
    return path


def environment():
    """haproxy's libraries come with it."""
    libraries = ":".join(map(str, UNPACKED.glob("usr/lib/*-linux-gnu*")))
    return {**os.environ, "LD_LIBRARY_PATH": libraries}


def run(*command, cwd=None, **variables):
    """What it printed; an AssertionError with that where it failed."""
    done = subprocess.run([find(command[0]), *map(str, command[1:])], cwd=cwd,
                          env={**environment(), **variables},
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=500, check=False)
    if done.returncode:
        raise AssertionError(f"{' '.join(map(str, command))}: exit {done.returncode}\n{done.stdout}")
    return done.stdout
