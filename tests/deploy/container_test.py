"""The image of deploy/container, built and run as it is meant to be: as nobody, on a read-only file
system, without capabilities. Its tools are heavy and it takes minutes: `./dev container` and .ci/run
do it. Where no container can be made it is skipped, and says why."""

import functools
import http.client
import json
import os
import posixpath
import re
import shutil
import socket
import subprocess
import sys
import tarfile
import time
import unittest
from pathlib import Path

from deploy.tools import BARE, BARE_FILE, DEPLOY, SOURCE
from e2e.cgroup_test import CHOSEN, MB, kills_and_peak
from e2e.worst import demand_all

TOOLS = ["buildah", "podman", "runc", "mmdebstrap"]
STATE = SOURCE / "build/container"
BASE, NAME = "localhost/debian:bookworm-slim", "shaded-test"
IMAGE, SLIM = "localhost/shaded:test", "localhost/shaded:slim-test"
PATIENCE = 1200  # seconds for any one command, on the slowest machine

# Nobody, on a read-only file system, without capabilities.
CONFINED = ["--read-only", "--tmpfs", "/tmp", "--user", "65532:65532", "--cap-drop", "ALL",
            "--security-opt", "no-new-privileges", "--pids-limit", "128"]
LIMITS = ["--memory", "1g", "--memory-swap", "1g"]

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
            (f"podman image exists {BASE} || {{ {BARE} {BARE_FILE} && podman import --quiet {BARE_FILE} {BASE}; }}",
             "no base image can be made"),
            (run.format(" ".join(CONFINED + LIMITS), "true"), "containers do not run here"),
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


@functools.cache
def build(tag, *arguments):
    # With what ./dev test has compiled, and not where that was another machine's choice.
    kept = os.environ.get("CCACHE_DIR")
    if kept:
        arguments = ["--build-arg", "LAUNCHER=ccache", "--build-arg", f"SOURCE={SOURCE}", "--volume", f"{kept}:/ccache",
                     *arguments]
    subprocess.run(["buildah", "bud", "--isolation", "chroot", "--network", "host", "--layers",
                    "--format", "docker", "--build-arg", f"BASE={BASE}", *arguments, "-t", tag,
                    "-f", str(DEPLOY / "container/Containerfile"), str(SOURCE)],
                   stdin=subprocess.DEVNULL, stdout=sys.stderr, check=True, timeout=3 * PATIENCE)  # it compiles


class Container:
    """One of an image, with default options but for its ports; for a with block."""

    def __init__(self, image, *flags):
        self.public, self.admin = free_port(), free_port()
        podman("rm", "--force", "--ignore", NAME)
        podman("run", "--detach", "--name", NAME, "--pull", "never", "--network", "host",
               *CONFINED, "--security-opt", f"seccomp={DEPLOY / 'seccomp/shaded.json'}", *flags,
               "--env", f"SHADED_LISTEN=127.0.0.1:{self.public}",
               "--env", f"SHADED_ADMIN=127.0.0.1:{self.admin}", image)

    def __enter__(self):
        while self.state("Running") == "true":
            try:
                if ask(self.admin, "GET", "/readyz")[0] == 200:
                    return self
            except OSError:
                time.sleep(0.1)
        raise AssertionError(f"it ends: {podman('logs', NAME)}")

    def __exit__(self, *exception):
        podman("rm", "--force", "--ignore", NAME)

    @staticmethod
    def state(name):
        return podman("inspect", "--format", f"{{{{.State.{name}}}}}", NAME).strip()

    @staticmethod
    def run(*command, flags=(), **options):
        return subprocess.run(["podman", "exec", "--interactive", *flags, NAME, *command],
                              capture_output=True, check=False, timeout=PATIENCE, **options)

    def render(self, name):
        scene = {"objects": [{"type": "sphere"}], "output": {"format": name}}
        return ask(self.public, "POST", "/v1/render", json.dumps(scene))

    @staticmethod
    def told(event):
        """Of the log, the first line of that event."""
        done = subprocess.run(["podman", "logs", NAME], stdout=subprocess.PIPE, text=True,
                              stderr=subprocess.STDOUT, check=True, timeout=PATIENCE)
        lines = [json.loads(line) for line in done.stdout.splitlines() if line.startswith("{")]
        return next(line for line in lines if line["event"] == event)


class RunTest(unittest.TestCase):
    """As it is meant to be run."""

    @classmethod
    def setUpClass(cls):
        build(IMAGE)

    def setUp(self):
        self.container = Container(IMAGE, *LIMITS)
        self.addCleanup(self.container.__exit__)
        self.container.__enter__()

    def test_it_renders_every_format(self):
        for name in "png", "jpeg", "webp", "tiff", "exr", "hdr":
            with self.subTest(name):
                status, body = self.container.render(name)
                self.assertEqual(status, 200, body[:300])

    def test_it_is_nobody_and_may_nothing(self):
        pid = self.container.state("Pid")
        state = dict(line.split(":\t", 1) for line in Path(f"/proc/{pid}/status").read_text()
                     .splitlines() if ":\t" in line)
        self.assertEqual(state["Uid"].split(), ["65532"] * 4)
        self.assertEqual(state["NoNewPrivs"], "1")
        self.assertEqual(state["Seccomp"], "2")
        for kind in "CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb":
            self.assertEqual(int(state[kind], 16), 0, kind)
        scene = json.dumps({"objects": [{"type": "sphere"}]})
        mounts = Path(f"/proc/{pid}/mounts").read_text()
        self.assertRegex(mounts, r"(?m)^\S+ / \S+ ro,")
        done = self.container.run("shade", "render", "-", "-o", "-", input=scene.encode())
        self.assertEqual(done.stdout[:4], b"\x89PNG", done.stderr)

    def test_it_tells_whether_it_is_well(self):
        (image,) = json.loads(podman("image", "inspect", IMAGE))
        check = image["Healthcheck"]["Test"]
        self.assertEqual(check, ["CMD", "/usr/bin/shaded", "--ready"])
        self.assertEqual(self.container.run(*check[1:]).returncode, 0)
        done = self.container.run("shaded", "--ready", flags=["--env", "SHADED_ADMIN=127.0.0.1:1"])
        self.assertEqual(done.returncode, 1, done.stderr)

    def test_it_stops_when_it_is_told(self):
        podman("stop", "--time", "300", NAME)  # then it would be killed: 137
        self.assertEqual(self.container.state("ExitCode"), "0")


class SizeTest(unittest.TestCase):
    """With its defaults, and as much of a machine as small pods have, it knows its limits."""

    @classmethod
    def setUpClass(cls):
        build(IMAGE)

    def check(self, memory, processors):
        with Container(IMAGE, "--memory", f"{memory}m", "--memory-swap", f"{memory}m", "--cpus",
                       str(processors)) as container:
            machine = container.told("machine")
            self.assertEqual(machine["memory"], memory * MB)
            self.assertEqual(machine["cpu-quota"], f"{processors:.2f}")
            self.assertEqual(container.told("memory")["budget"], memory * MB // 4 * 3)
            most = min(len(os.sched_getaffinity(0)), -(-processors // 1))
            self.assertEqual(container.told("listening")["threads"], most)
            pid = container.state("Pid")
            answers = demand_all(("127.0.0.1", container.public))
            kills, peak = kills_and_peak(pid)
            print(f"{memory} MB, {processors} processors: {peak / MB:.0f} MB at most, {kills} killed, "
                  f"{answers}", file=sys.stderr)
            self.assertEqual(kills, 0)
            self.assertEqual((container.state("Pid"), container.state("OOMKilled")), (pid, "false"))
            self.assertEqual(container.render("png")[0], 200)

    def test_every_size(self):
        why = what_fails(f"podman run --rm --pull never --network host --memory 128m --memory-swap 128m "
                         f"--cpus 0.5 {BASE} true")
        if why:
            self.skipTest(f"memory and processors cannot be limited here: {why}")
        for memory, processors in CHOSEN:
            with self.subTest(f"{memory} MB, {processors} processors"):
                self.check(memory, processors)


class ContentsTest(unittest.TestCase):
    """Both images: the programs, what they load, and what tells of it."""

    OWN = {"usr/bin/shade", "usr/bin/shaded", "usr/lib/shaded/shaded-decode", "usr/share/doc/shaded/LICENSE",
           "usr/share/doc/shaded/shaded.conf", "usr/share/shaded/sbom.cdx.json", "etc/passwd",
           "etc/group", "etc/nsswitch.conf"}
    MODULE = "usr/lib/shaded/shaded_oiio.so"

    @classmethod
    def setUpClass(cls):
        build(IMAGE)
        build(SLIM, "--build-arg", "OPENIMAGEIO=no")
        cls.contents = {image: cls.read(image) for image in (IMAGE, SLIM)}

    @staticmethod
    def read(image):
        """{name: (TarInfo, bytes of small files)} of all that is in it."""
        podman("rm", "--force", "--ignore", NAME)
        podman("create", "--name", NAME, "--pull", "never", "--network", "host", image)
        found = {}
        with subprocess.Popen(["podman", "export", NAME], stdout=subprocess.PIPE) as exported:
            with tarfile.open(fileobj=exported.stdout, mode="r|") as files:
                for file in files:
                    small = file.isfile() and not file.name.endswith(".so") and file.size < MB
                    found[file.name.rstrip("/")] = file, files.extractfile(file).read() if small else b""
        assert exported.returncode == 0
        podman("rm", "--force", "--ignore", NAME)
        return found

    def each(self):
        for image, contents in self.contents.items():
            with self.subTest(image):
                own = self.OWN | ({self.MODULE} if image == IMAGE else set())
                yield image, contents, own

    def test_every_file_is_ours_or_of_a_package_that_is_told(self):
        """And every package that is told has a file, by what dpkg says of the same Debian here."""
        for _, contents, own in self.each():
            told = json.loads(contents["usr/share/shaded/sbom.cdx.json"][1])["components"]
            names = {part["name"] for part in told}
            places = {place["location"][1:]: part["name"] for part in told
                      for place in part["evidence"]["occurrences"]}
            about = {f"{folder}/{name}{end}" for name in names for folder, end in (
                ("usr/share/doc", "/copyright"), ("var/lib/dpkg/status.d", ""))}
            files = {name for name, (file, _) in contents.items() if file.isfile()}
            # What podman itself puts into a container.
            files = {name for name in files if not name.startswith(("dev/", "proc/", "sys/", "run/"))
                     and name not in ("etc/hosts", "etc/hostname", "etc/resolv.conf")}
            self.assertEqual(files, own | set(places) | about)
            self.assertEqual(set(places.values()), names)
            for place, name in places.items():
                done = [subprocess.run(["dpkg-query", "-S", path], capture_output=True, text=True,
                                       check=False).stdout
                        for path in (f"/{place}", "/" + place.removeprefix("usr/"))]
                self.assertRegex("\n".join(done), rf"(?m)^{re.escape(name)}[:,]", place)

    def test_only_the_two_are_programs_and_none_gives_rights(self):
        for _, contents, _ in self.each():
            files = {name: file for name, (file, _) in contents.items() if file.isfile()}
            self.assertEqual({name for name in files if "bin/" in name},
                             {"usr/bin/shade", "usr/bin/shaded"})
            self.assertEqual([name for name, file in files.items() if file.mode & 0o6000], [])
            for name, (link, _) in contents.items():
                if link.issym() and name.startswith(("usr/", "lib", "etc/os")):
                    target = posixpath.normpath(posixpath.join("/", posixpath.dirname(name),
                                                               link.linkname))
                    self.assertIn(target[1:], contents, name)

    def test_it_has_a_user_and_labels(self):
        version = re.search(r"^project\(shaded VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text(),
                            re.MULTILINE)[1]
        for image, contents, _ in self.each():
            self.assertIn(b":65532:65532:", contents["etc/passwd"][1])
            (told,) = json.loads(podman("image", "inspect", image))
            labels = told["Config"]["Labels"]
            self.assertEqual(labels["org.opencontainers.image.title"], "shaded")
            self.assertEqual(labels["org.opencontainers.image.version"], version)
            self.assertEqual(labels["shaded.openimageio"], "yes" if image == IMAGE else "no")
            print(f"{image}: {told['Size'] / 1e6:.0f} MB", file=sys.stderr)

    def test_the_slim_one_refuses_what_it_lacks(self):
        with Container(SLIM, *LIMITS) as container:
            for name in "png", "jpeg", "webp":
                self.assertEqual(container.render(name)[0], 200, name)
            for name in "tiff", "exr", "hdr":
                self.assertEqual(container.render(name)[0], 422, name)


if __name__ == "__main__":
    reason = prepare()
    if reason:
        print(f"SKIPPED: {reason}")
        sys.exit(77)
    unittest.main()
