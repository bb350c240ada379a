"""Mixed requests for as long as SHADED_SOAK says, in seconds: what the daemon holds does not grow.

The daemon is looked at once a second. The first quarter is for warming up (caches, spare memory,
the modules of formats); the rest is halved, and the halves are compared.

    ./dev soak 600
"""

import itertools
import json
import os
import random
import socket
import threading
import time
import unittest
from pathlib import Path

from e2e.daemon import JSON, PATIENCE, SANITIZED, SMALL, SOURCE, Daemon

SECONDS = float(os.environ.get("SHADED_SOAK") or (10 if SANITIZED else 30))
CLIENTS = 4
FORMATS = ("png", "jpeg", "webp", "tiff", "exr", "hdr")
EXAMPLES = [json.loads(path.read_text())
            for path in sorted((SOURCE / "api/examples").glob("*.json"))]
# The same work in both halves, but for a color, so that the caches have something to forget.
SIZE = {"width": 48, "height": 32, "samples": 1} if SANITIZED else {"width": 96, "height": 64, "samples": 2}
LEFT = {**SMALL, "image": {"width": 1200, "height": 1200, "samples": 16},
        "accuracy": {"tier": "exact"}}


class Client(threading.Thread):
    """Sends one kind of request after the other, in an order of its own."""

    def __init__(self, daemon, seed, end):
        super().__init__()
        self.daemon_under_test, self.end = daemon, end
        self.random = random.Random(seed)
        self.answers, self.failures = 0, []

    def run(self):
        kinds = [self.picture, self.example, self.unchanged, self.mistake, self.list, self.leave,
                 self.tell, self.cut_off]
        for count in itertools.count():
            if time.monotonic() > self.end:
                return
            kind = self.random.choice(kinds)
            try:
                kind(count)
                self.answers += 1
            except Exception as error:  # pylint: disable=broad-except
                self.failures.append(f"{kind.__name__}: {error!r}")
                return

    def expect(self, answer, *statuses):
        if answer.status not in statuses:
            raise AssertionError(f"{answer.status}, not {statuses}: {answer.body[:300]}")

    def new_scene(self):
        return {**SMALL, "image": SIZE, "ambient": self.random.random()}

    def picture(self, count):
        scene = {**self.new_scene(), "output": {"format": FORMATS[count % len(FORMATS)]}}
        self.expect(self.daemon_under_test.render(scene), 200)

    def example(self, _):
        scene = {**self.random.choice(EXAMPLES), "image": SIZE, "ambient": self.random.random()}
        self.expect(self.daemon_under_test.render(scene), 200)

    def unchanged(self, _):
        scene = self.new_scene()
        answer = self.daemon_under_test.render(scene)
        self.expect(answer, 200)
        same = self.daemon_under_test.render(scene)
        self.expect(same, 200)
        if same.body != answer.body:
            raise AssertionError("the same request has other bytes")
        again = self.daemon_under_test.render(scene, {"If-None-Match": answer.headers["ETag"]})
        self.expect(again, 304)

    def mistake(self, count):
        body, status = ((b"{", 400), (b'{"objects":[{"type":"sphere","radius":-1}]}', 422),
                        (json.dumps({**SMALL, "image": {"width": 60000, "height": 60000}}), 422),
                        )[count % 3]
        self.expect(self.daemon_under_test.render(body), status)
        self.expect(self.daemon_under_test.render(SMALL, {"Accept": "text/html"}), 406)
        self.expect(self.daemon_under_test.get("/none"), 404)

    def list(self, count):
        path = ("/v1/materials", "/v1/colorspaces", "/v1/version", "/openapi.yaml")[count % 4]
        self.expect(self.daemon_under_test.get(path), 200)

    def tell(self, count):
        path = ("/v1/explain", "/v1/compare")[count % 2]
        self.expect(self.daemon_under_test.post(path, self.new_scene()), 200)

    def leave(self, _):
        """In the middle of a picture that takes longer than this client has time."""
        body = json.dumps({**LEFT, "ambient": self.random.random()}).encode()
        self.send(b"Content-Length: %d\r\n\r\n%s" % (len(body), body), 0.1)

    def cut_off(self, _):
        """In the middle of a body."""
        self.send(b"Content-Length: 1000\r\n\r\n{\"objects\":", 0)

    def send(self, rest, wait):
        with socket.create_connection(self.daemon_under_test.address, 500) as connection:
            connection.sendall(b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: " +
                               JSON["Content-Type"].encode() + b"\r\n" + rest)
            time.sleep(wait)


def descriptors(daemon):
    return len(os.listdir(f"/proc/{daemon.pid}/fd"))


class Look:
    """What the daemon holds now."""

    def __init__(self, daemon):
        # Before the question for the metrics, which is a descriptor too.
        self.descriptors = descriptors(daemon)
        metrics = daemon.metrics()
        status = Path(f"/proc/{daemon.pid}/statm").read_text().split()
        self.rss = int(status[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
        self.arena = metrics["shaded_request_memory_high_water_bytes"] / 2**20
        self.reuse = metrics["shaded_reuse_bytes"] / 2**20
        self.responses = metrics["shaded_response_cache_bytes"] / 2**20


class SoakTest(unittest.TestCase):
    def test_what_the_daemon_holds_does_not_grow(self):
        with Daemon("--log-requests", "off", "--reuse", "16M", "--response-cache", "2M",
                    "--queue", "1000", "--timeout", "300") as daemon:
            self.warm(daemon)
            before = Look(daemon)
            clients = [Client(daemon, seed, time.monotonic() + SECONDS) for seed in range(CLIENTS)]
            for client in clients:
                client.start()
            looks = []
            while len(looks) < 8 or any(client.is_alive() for client in clients):
                time.sleep(min(1, SECONDS / 30))
                looks.append(Look(daemon))
            for client in clients:
                client.join()
                self.assertEqual(client.failures, [])
            self.compare(looks[len(looks) // 4:], before)
            print(f"{sum(client.answers for client in clients)} requests in {SECONDS:.0f} s")
            self.settle(daemon, before)

    def warm(self, daemon):
        """Every example, and a picture that others leave: the most that one request can take. A sanitizer's memory is
        not compared, so that it only gets what has formats of its own."""
        client = Client(daemon, CLIENTS, 0)
        for example in EXAMPLES:
            if SANITIZED and not {"output", "outputs"} & set(example):
                continue
            client.expect(daemon.render({**example, "image": SIZE}), 200)
        if not SANITIZED:
            client.expect(daemon.render(LEFT), 200)

    def compare(self, looks, before):
        first, second = looks[:len(looks) // 2], looks[len(looks) // 2:]
        # A sanitizer keeps freed memory, and is so slow that the largest requests may come late.
        for name, slack in (("rss", None if SANITIZED else 32), ("descriptors", 2 * CLIENTS + 8),
                            ("arena", None if SANITIZED else 1), ("reuse", 1), ("responses", 1)):
            most = [max(getattr(look, name) for look in half) for half in (first, second)]
            print(f"{name}: {getattr(before, name):.1f} at the start, at most {most[0]:.1f} in the "
                  f"first half, {most[1]:.1f} in the second")
            if slack is not None:
                # A tenth, as peaks of two halves differ by which requests meet.
                self.assertLessEqual(most[1], most[0] * 1.1 + slack, name)

    def settle(self, daemon, before):
        """With the last client its descriptors go too, within the time that a close may linger."""
        end = time.monotonic() + PATIENCE
        while descriptors(daemon) > before.descriptors and time.monotonic() < end:
            time.sleep(0.2)
        self.assertLessEqual(descriptors(daemon), before.descriptors)


if __name__ == "__main__":
    unittest.main()
