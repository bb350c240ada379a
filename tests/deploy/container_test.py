"""The image of deploy/container, built and run as it is meant to be: as nobody, on a read-only file
system, without capabilities. Its tools are heavy and it takes minutes: `./dev container` and .ci/run
do it. Where no container can be made it is skipped, and says why."""

import http.client
import json
import os
import shutil
import socket
import subprocess
import sys
import tarfile
import time
import unittest
from pathlib import Path

from deploy.tools import DEPLOY, SOURCE

TOOLS = ["buildah", "podman", "runc", "mmdebstrap"]
STATE = SOURCE / "build/container"
BASE, IMAGE, NAME = "localhost/debian:bookworm-slim", "localhost/shaded:test", "shaded-test"
PATIENCE = 1200  # seconds for any one command, on the slowest machine

# Nobody, on a read-only file system, without capabilities.
CONFINED = ["--read-only", "--tmpfs", "/tmp", "--user", "65532:65532", "--cap-drop", "ALL",
            "--security-opt", "no-new-privileges", "--memory", "1g", "--pids-limit", "128"]

# Rootless and nested machines have neither systemd nor cgroups of version 2 to give.
FILES = {
    "containers.conf": """[containers]
netns = "host"
cgroupns = "host"
default_ulimits = ["nofile=20000:20000", "nproc=32768:32768"]
[engine]
runtime = "runc"
cgroup_manager = "cgroupfs"
events_logger = "file"
""",
    "registries.conf": 'unqualified-search-registries = ["localhost"]\n',
    "storage.conf": f"""[storage]
driver = "overlay"
graphroot = "{STATE}/root"
runroot = "{STATE}/run"
""",
}


def prepare():
    """Why it cannot be done here, or None."""
    if "SHADED_CONTAINER" not in os.environ:
        return "building the image takes minutes: ./dev container does it, and tries it"
    missing = [tool for tool in TOOLS if not shutil.which(tool)]
    if missing:
        return f"there is no {', '.join(missing)}"
    if os.geteuid() != 0:
        return "this test wants root: sudo ./dev container"
    STATE.mkdir(parents=True, exist_ok=True)
    for name, text in FILES.items():
        (STATE / name).write_text(text)
    os.environ["CONTAINERS_CONF"] = str(STATE / "containers.conf")
    os.environ["CONTAINERS_REGISTRIES_CONF"] = str(STATE / "registries.conf")
    os.environ["CONTAINERS_STORAGE_CONF"] = str(STATE / "storage.conf")
    run = f"podman run --rm --pull never --network host {{}} {BASE} {{}}"
    update = "apt-get -q -o APT::Update::Error-Mode=any update"
    for command, failure in (
            (f"podman image exists {BASE} || mmdebstrap --quiet --variant=minbase bookworm - | "
             f"podman import --quiet - {BASE}", "no base image can be made"),
            (run.format(" ".join(CONFINED), "true"), "containers do not run here"),
            (run.format("", update), "a container cannot fetch Debian's packages")):
        why = what_fails(command)
        if why:
            what_fails(f"podman image rm --force {BASE}")
            return f"{failure}: {why}"
    return None


def what_fails(command):
    """The last words of a command that fails, or None."""
    try:
        done = subprocess.run(["bash", "-o", "pipefail", "-c", command], timeout=PATIENCE,
                              stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, check=False)
    except subprocess.TimeoutExpired:
        return f"no end after {PATIENCE} seconds"
    words = " ".join(done.stdout.split())[-300:] or f"exit {done.returncode}"
    return words if done.returncode else None


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return probe.getsockname()[1]


def podman(*command):
    done = subprocess.run(["podman", *command], capture_output=True, text=True, timeout=PATIENCE,
                          check=False)
    if done.returncode:
        raise AssertionError(f"podman {' '.join(command)}: {done.stderr}")
    return done.stdout


def ask(port, method, path, body=None):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    try:
        connection.request(method, path, body, {"Content-Type": "application/json"})
        answer = connection.getresponse()
        return answer.status, answer.read()
    finally:
        connection.close()


class ContainerTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        subprocess.run(["buildah", "bud", "--isolation", "chroot", "--network", "host", "--layers",
                        "--format", "docker", "--build-arg", f"BASE={BASE}", "-t", IMAGE,
                        "-f", str(DEPLOY / "container/Containerfile"), str(SOURCE)],
                       stdin=subprocess.DEVNULL, stdout=sys.stderr, check=True, timeout=PATIENCE)

    def setUp(self):
        subprocess.run(["podman", "rm", "--force", "--ignore", NAME], capture_output=True,
                       check=False)
        self.addCleanup(podman, "rm", "--force", "--ignore", NAME)
        self.public, admin = free_port(), free_port()
        podman("run", "--detach", "--name", NAME, "--pull", "never", "--network", "host",
               *CONFINED, "--security-opt", f"seccomp={DEPLOY / 'seccomp/shaded.json'}",
               "--env", f"SHADED_LISTEN=127.0.0.1:{self.public}",
               "--env", f"SHADED_ADMIN=127.0.0.1:{admin}", IMAGE)
        while podman("inspect", "--format", "{{.State.Running}}", NAME).strip() == "true":
            try:
                if ask(admin, "GET", "/readyz")[0] == 200:
                    return
            except OSError:
                time.sleep(0.1)
        self.fail(f"it ends: {podman('logs', NAME)}")

    def test_it_renders_every_format(self):
        for name in "png", "jpeg", "webp", "tiff", "exr", "hdr":
            with self.subTest(name):
                scene = {"objects": [{"type": "sphere"}], "output": {"format": name}}
                status, body = ask(self.public, "POST", "/v1/render", json.dumps(scene))
                self.assertEqual(status, 200, body[:300])

    def test_it_is_nobody_and_may_nothing(self):
        pid = podman("inspect", "--format", "{{.State.Pid}}", NAME).strip()
        state = dict(line.split(":\t", 1) for line in Path(f"/proc/{pid}/status").read_text()
                     .splitlines() if ":\t" in line)
        self.assertEqual(state["Uid"].split(), ["65532"] * 4)
        self.assertEqual(state["NoNewPrivs"], "1")
        self.assertEqual(state["Seccomp"], "2")
        for kind in "CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb":
            self.assertEqual(int(state[kind], 16), 0, kind)
        done = subprocess.run(["podman", "exec", NAME, "bash", "-c", "echo x >/usr/x"],
                              capture_output=True, text=True, check=False)
        self.assertIn("Read-only file system", done.stderr)

    def test_it_tells_whether_it_is_well(self):
        podman("exec", NAME, "shaded-healthy")
        done = subprocess.run(["podman", "exec", "--env", "SHADED_ADMIN=127.0.0.1:1", NAME,
                               "shaded-healthy"], capture_output=True, check=False)
        self.assertNotEqual(done.returncode, 0)

    def test_it_stops_when_it_is_told(self):
        podman("stop", "--time", "300", NAME)  # then it would be killed: 137
        self.assertEqual(podman("inspect", "--format", "{{.State.ExitCode}}", NAME).strip(), "0")

    def test_no_file_gives_rights(self):
        with subprocess.Popen(["podman", "export", NAME], stdout=subprocess.PIPE) as exported:
            with tarfile.open(fileobj=exported.stdout, mode="r|") as files:
                modes = {file.name: file.mode for file in files if file.isfile()}
        self.assertEqual(exported.returncode, 0)
        self.assertIn("usr/bin/shaded", modes)
        self.assertEqual([name for name, mode in modes.items() if mode & 0o6000], [])

    def test_it_has_a_bill_of_materials(self):
        told = json.loads(podman("exec", NAME, "cat", "/usr/share/shaded/sbom.cdx.json"))
        listed = podman("exec", NAME, "cat", "/usr/share/shaded/packages.txt").split()
        self.assertEqual(sorted(f"{part['name']}={part['version']}"
                                for part in told["components"]), listed)

    def test_it_tells_its_packages(self):
        listed = podman("exec", NAME, "cat", "/usr/share/shaded/packages.txt").splitlines()
        self.assertEqual(listed, sorted(listed))
        for name in "libopencolorio2.1", "libopenimageio2.4", "libc6":
            self.assertTrue([line for line in listed if line.startswith(name + "=")], name)
        # What OpenImageIO depends on in Debian's eyes and does not load.
        self.assertFalse([line for line in listed if line.startswith("libllvm")])


if __name__ == "__main__":
    reason = prepare()
    if reason:
        print(f"SKIPPED: {reason}")
        sys.exit(77)
    unittest.main()
