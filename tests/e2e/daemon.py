"""Starts the built daemon on free ports, talks to it, and stops it as an operator would."""

import http.client
import json
import os
import re
import signal
import socket
import subprocess
import threading
import time
from collections import namedtuple
from pathlib import Path

BUILD = Path(os.environ["SHADED_BUILD"])
SOURCE = Path(os.environ["SHADED_SOURCE"])
SANITIZED = bool(os.environ.get("SHADED_SANITIZE"))
SHADED = str(BUILD / "shaded")

# Seconds until a test gives up, on the slowest machine. Nothing is held to be fast or slow.
PATIENCE = 500
# The daemon's own limits that a slow machine might run into; a test that is about one says it itself.
PATIENT = {"timeout": "600", "body-time": "600", "send-time": "600"}
JSON = {"Content-Type": "application/json"}
SMALL = {"objects": [{"type": "sphere"}], "image": {"width": 16, "height": 12, "samples": 1}}
# Some work, sanitized or not: a second of it, or a hundredth.
SLOW = {"objects": [{"type": "torus", "radius": 2, "tube": 1.5, "material": {"specular": 0.5}}],
        "accuracy": {"tier": "exact"},
        "lights": [{"type": "point", "position": [3, i, 3]} for i in range(32)],
        "image": {"width": 260 if SANITIZED else 900, "height": 260 if SANITIZED else 900,
                  "samples": 9}}


def another(scene, n=1):
    """As slow, but another view, which shares nothing with it."""
    return {**scene, "camera": {"fov": 40 + n / 64}}


Answer = namedtuple("Answer", "status headers body")


def environment(**more):
    """Ours, without anything that the daemon would take for an option."""
    kept = {"SHADED_BUILD", "SHADED_SOURCE", "SHADED_SANITIZE"}
    clean = {k: v for k, v in os.environ.items() if not k.startswith("SHADED_") or k in kept}
    return {**clean, **more}


def patient(flags, env):
    """PATIENT as variables. Flags win over these, but a test's file would not."""
    file = flags[flags.index("--config") + 1] if "--config" in flags else env.get("SHADED_CONFIG")
    text = Path(file).read_text(errors="replace") if file and Path(file).is_file() else ""
    return {"SHADED_" + name.upper().replace("-", "_"): value for name, value in PATIENT.items()
            if not re.search(rf"^\s*{name}\s*=", text, re.MULTILINE)}


class UnixConnection(http.client.HTTPConnection):
    def connect(self):
        self.sock = socket.socket(socket.AF_UNIX)
        self.sock.settimeout(self.timeout)
        self.sock.connect(self.host)


def connect(address, timeout=PATIENCE):
    """To (host, port), or the path of a unix socket."""
    if isinstance(address, str):
        connection = UnixConnection("localhost", timeout=timeout)
        connection.host = address
        return connection
    return http.client.HTTPConnection(*address, timeout=timeout)


class Daemon:
    """with Daemon("--queue", "1") as daemon: daemon.get("/v1/version") ..."""

    def __init__(self, *flags, env=None, listen="127.0.0.1:0", admin="127.0.0.1:0",
                 program=SHADED, pass_fds=()):
        places = (["--listen", listen] if listen else []) + (["--admin", admin] if admin else [])
        start = program if isinstance(program, list) else [program]  # with words before it
        given = env or {}
        self.process = subprocess.Popen([*start, *places, *flags], stdin=subprocess.DEVNULL,
                                        stderr=subprocess.PIPE, pass_fds=pass_fds,
                                        env=environment(**{**patient(flags, given), **given}))
        self.pid = self.process.pid
        self.lines = []
        self.parsed, self.parsed_lines = [], 0
        self.changed = threading.Condition()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        try:
            started = self.wait_for("listening")
        except AssertionError:
            self.process.kill()
            self.process.wait()
            raise
        self.addresses = [self._split(address) for address in started["address"].split()]
        self.address = self.addresses[0]
        self.admin = None if started["admin"] == "off" else self._split(started["admin"])

    @staticmethod
    def _split(address):
        if address.startswith("unix:"):
            return address[len("unix:"):]
        host, _, port = address.rpartition(":")
        return host.strip("[]"), int(port)

    def _read(self):
        for line in self.process.stderr:
            with self.changed:
                self.lines.append(line.decode("utf-8", "replace"))
                self.changed.notify_all()
        with self.changed:
            self.lines.append(None)
            self.changed.notify_all()

    def stderr(self):
        with self.changed:
            return "".join(line for line in self.lines if line)

    def events(self, name=None):
        """The log so far, as objects."""
        with self.changed:
            new = self.lines[self.parsed_lines:]
            self.parsed_lines += len(new)
            self.parsed += [json.loads(line) for line in new if line and line.startswith("{")]
            return [event for event in self.parsed if name in (None, event["event"])]

    def wait_for(self, name, matches=lambda event: True, timeout=PATIENCE):
        """The first log event of that name that matches."""
        seen, event = 0, None

        def found():
            nonlocal seen, event
            events = self.events()
            event = next((e for e in events[seen:] if e["event"] == name and matches(e)), None)
            seen = len(events)
            return event or (self.lines and self.lines[-1] is None)

        with self.changed:
            self.changed.wait_for(found, timeout)
        if not event:
            raise AssertionError(f"no {name} in the log:\n{self.stderr()}")
        return event

    # ---- Requests, each on a connection of its own ----

    def call(self, method, path, body=None, headers=None, admin=False, timeout=PATIENCE):
        connection = connect(self.admin if admin else self.address, timeout)
        try:
            connection.request(method, path, body, headers or {})
            answer = connection.getresponse()
            return Answer(answer.status, answer.headers, answer.read())
        finally:
            connection.close()

    def get(self, path, headers=None, **options):
        return self.call("GET", path, None, headers, **options)

    def post(self, path, scene, headers=None, **options):
        body = scene if isinstance(scene, (bytes, str)) else json.dumps(scene)
        return self.call("POST", path, body, {**JSON, **(headers or {})}, **options)

    def render(self, scene, headers=None, **options):
        return self.post("/v1/render", scene, headers, **options)

    def raw(self, *pieces, timeout=PATIENCE):
        """Sends bytes as they are; everything that comes back until the connection ends."""
        with socket.create_connection(self.address, timeout) as connection:
            for piece in pieces:
                connection.sendall(piece)
            return receive_all(connection)

    def metrics(self):
        """{'shaded_requests_total{...}': value}"""
        lines = self.get("/metrics", admin=True).body.decode().splitlines()
        pairs = (line.rsplit(" ", 1) for line in lines if line and not line.startswith("#"))
        return {name: float(value) for name, value in pairs}

    # ---- The end ----

    def signal(self, number=signal.SIGTERM):
        self.process.send_signal(number)

    def wait(self, timeout=PATIENCE):
        status = self.process.wait(timeout)
        self.reader.join(timeout)
        self.process.stderr.close()
        return status

    def stop(self):
        self.signal()
        status = self.wait()
        if status or "Sanitizer" in self.stderr() or "runtime error" in self.stderr():
            raise AssertionError(f"the daemon exits {status}:\n{self.stderr()[-8000:]}")

    def __enter__(self):
        return self

    def __exit__(self, kind, value, trace):
        if self.process.poll() is not None:
            if not self.process.stderr.closed:
                self.wait()
            return
        if kind:  # the test has failed already: its message counts
            self.process.kill()
            self.wait()
            return
        self.stop()


def receive_all(connection):
    received = b""
    while True:
        piece = connection.recv(65536)
        if not piece:
            return received
        received += piece


def wait_until_at_work(process):
    """For a program that has more to do than some time of a processor, which it has had then."""
    ticks = os.sysconf("SC_CLK_TCK")
    while process.poll() is None:
        fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
        if int(fields[11]) > 0.3 * ticks:
            return
        time.sleep(0.02)


def run(*flags, env=None, timeout=PATIENCE):
    """A daemon that is expected to end by itself: (exit status, stdout, stderr)."""
    done = subprocess.run([SHADED, *flags], capture_output=True, env=environment(**(env or {})),
                          timeout=timeout, check=False)
    return done.returncode, done.stdout.decode(), done.stderr.decode()
