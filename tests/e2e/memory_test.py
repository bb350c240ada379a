"""The memory of the process has an end: whatever clients do, the daemon stays within `--memory`, drops
answers that nobody takes before it refuses work, says what it cannot do, and gives back what it does
not use. Resident memory is the system's count, of builds without a sanitizer."""

import json
import os
import random
import socket
import threading
import time
import unittest
from pathlib import Path

from e2e.coding_test import PACKERS, coded
from e2e.daemon import PATIENCE, SANITIZED, SMALL, SLOW, Daemon, run
from e2e.fair_test import render_from

MB = 1 << 20


def rough(side):
    """A square of side x side points whose normals are of no order: its pictures do not compress."""
    numbers = random.Random(1)
    points = [(x, y) for y in range(side) for x in range(side)]
    return {"type": "mesh",
            "positions": [c for x, y in points
                          for c in (2 * x / (side - 1) - 1, 2 * y / (side - 1) - 1, 0)],
            "normals": [c for _ in points
                        for c in (round(numbers.uniform(-1, 1), 2), round(numbers.uniform(-1, 1), 2), 1)],
            "indices": [i for x, y in points if x + 1 < side and y + 1 < side
                        for at in [y * side + x]
                        for i in (at, at + 1, at + side, at + 1, at + side + 1, at + side)]}


ROUGH = rough(40)


def large(n, side=700, outputs=6, name="hdr"):
    """A picture of `outputs` files, of 1.5 MB each where there are 700 x 700 pixels; no two `n` have
    anything in common."""
    files = [{"name": f"o{i}", "format": name} for i in range(outputs)]
    return {"objects": [ROUGH],
            "lights": [{"type": "directional", "direction": [-1, -1, -1]}],
            "camera": {"type": "orthographic", "position": [0, 0, 3], "height": 1.9 - n / 1000},
            "image": {"width": side, "height": side, "samples": 1}, "outputs": files}


def resident(daemon, line="VmHWM"):
    """Bytes that the daemon has, or has had at most."""
    for text in Path(f"/proc/{daemon.pid}/status").read_text().splitlines():
        if text.startswith(line + ":"):
            return int(text.split()[1]) * 1024
    raise AssertionError(line)


def wait_until(true):
    end = time.monotonic() + PATIENCE
    while not true():
        if time.monotonic() > end:
            raise AssertionError("it does not happen")
        time.sleep(0.05)


def asking(daemon, scene, length=None):
    """A connection that has sent a request, of whose body `length` bytes, and reads nothing. Little
    waits in the system's buffers."""
    body = json.dumps(scene).encode() if not isinstance(scene, bytes) else scene
    connection = socket.socket()
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    connection.settimeout(PATIENCE)
    connection.connect(daemon.address)
    connection.sendall(b"POST /v1/render HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
                       b"Content-Length: %d\r\n\r\n" % len(body))
    connection.sendall(body[:length])
    return connection


class Ordinary:
    """A client that asks for a small picture again and again, until the end of the block, and at
    least four times."""

    def __init__(self, daemon):
        self.daemon, self.answers, self.over = daemon, [], threading.Event()
        self.thread = threading.Thread(target=self._ask)

    def _ask(self):
        while not self.over.is_set():
            n = len(self.answers)
            scene = {**SMALL, "camera": {"fov": 30 + n / 64 % 60}}
            answer = self.daemon.render(scene)
            self.answers.append(200 if answer.status == 200 else answer.body)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *exception):
        wait_until(lambda: len(self.answers) > 3 or not self.thread.is_alive())
        self.over.set()
        self.thread.join()


def dropped(daemon):
    return daemon.metrics()['shaded_connections_ended_total{reason="memory"}']


class AttackTest(unittest.TestCase):
    """--memory 192M, of which 21 MB are the program's and 64 OpenImageIO's, once it is there."""

    def setUp(self):
        self.daemon = Daemon("--memory", "192M", "--threads", "2", "--send-time", "600",
                             "--idle-timeout", "600", "--timeout", "600", "--queue", "1000",
                             "--log-requests", "off").__enter__()
        self.addCleanup(lambda: self.daemon.__exit__(None, None, None))
        self.open = []
        self.addCleanup(lambda: [connection.close() for connection in self.open])

    def check(self, ordinary):
        self.assertGreater(len(ordinary.answers), 3)
        self.assertEqual(set(ordinary.answers), {200})
        metrics = self.daemon.metrics()
        self.assertLessEqual(metrics["shaded_memory_used_bytes"], 192 * MB)
        if not SANITIZED:
            # Pages of programs and libraries are no part of it: they are read again when memory is
            # short. How many are there at once is the kernel's affair.
            most = resident(self.daemon) - resident(self.daemon, "RssFile")
            self.assertLess(most, 192 * MB)

    def test_answers_that_nobody_takes_are_dropped(self):
        """Some 9 MB each: 220 MB, in what 107 MB are left for."""
        with Ordinary(self.daemon) as ordinary:
            for n in range(12 if SANITIZED else 25):
                self.open.append(asking(self.daemon, large(n)))
                wait_until(lambda: self.daemon.metrics()["shaded_queue_depth"] < 2)
            wait_until(lambda: dropped(self.daemon) > 0 and
                       not self.daemon.metrics()["shaded_workers_busy"])
        self.check(ordinary)
        self.daemon.wait_for("answers-dropped")

    def test_answers_that_are_taken_in_part(self):
        with Ordinary(self.daemon) as ordinary:
            for n in range(12 if SANITIZED else 20):
                connection = asking(self.daemon, large(n))
                self.open.append(connection)
                self.assertTrue(connection.recv(1000))
        self.check(ordinary)
        self.assertGreater(dropped(self.daemon), 0)

    def test_requests_in_a_row_on_one_connection(self):
        """An answer that is not taken is followed by none."""
        scene = json.dumps(large(0, 300)).encode()
        connection = asking(self.daemon, scene)
        self.open.append(connection)
        with Ordinary(self.daemon) as ordinary:
            head = b"POST /v1/render HTTP/1.1\r\nHost: x\r\nContent-Type: application/json\r\n"
            connection.settimeout(1)
            try:
                for _ in range(10000):
                    connection.sendall(head + b"Content-Length: %d\r\n\r\n" % len(scene) + scene)
            except TimeoutError:
                pass
        self.check(ordinary)

    def test_bodies_that_do_not_end(self):
        """12 MB of 16 each, of 30 clients; who is refused is told so, or cut off amid sending."""
        with Ordinary(self.daemon) as ordinary:
            for _ in range(30):
                try:
                    self.open.append(asking(self.daemon, b" " * 16 * MB, 12 * MB))
                except OSError:
                    pass
        self.check(ordinary)
        self.assertGreater(self.daemon.metrics()["shaded_memory_refused_total"], 0)


class RefusalTest(unittest.TestCase):
    def test_what_never_fits_is_422_and_names_the_limit(self):
        with Daemon("--memory", "128M") as daemon:
            for scene in (large(0, 3000, 2), {"objects": [], "output": {"format": "hdr"}}):
                answer = daemon.render(scene)
                self.assertEqual(answer.status, 422, answer.body)
                self.assertIn("limit `memory`", json.loads(answer.body)["detail"])
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_what_does_not_fit_beside_its_body_never_fits(self):
        """A document is copied to be read: in 75 MB one of 24 has room, and one of 31 has none,
        though nobody else has any of it. In 27 a body of 30 has none, however it comes."""
        scene = json.dumps(SMALL).encode()
        packers = [({}, bytes)] + [(coded(name), pack) for name, pack in PACKERS.items()]
        with Daemon("--memory", "96M", "--threads", "1", "--reuse", "0") as daemon:
            self.assertEqual(daemon.render(scene + b" " * 24 * MB).status, 200)
            for name, pack in packers:
                answer = daemon.render(pack(scene + b" " * 31 * MB), name)
                problem = json.loads(answer.body)
                self.assertEqual((answer.status, problem["type"]),
                                 (422, "urn:shaded:problem:limit"), (name, problem))
                self.assertIn("limit `memory`", problem["detail"])
            self.assertEqual(daemon.render(SMALL).status, 200)
            self.assertEqual(daemon.metrics()["shaded_memory_refused_total"], 0)
        with Daemon("--memory", "48M", "--threads", "1", "--reuse", "0") as daemon:
            for name, pack in packers:
                answer = daemon.render(pack(scene + b" " * 30 * MB),
                                       {**name, "X-Request-Id": pack.__name__})
                problem = json.loads(answer.body)
                self.assertEqual((answer.status, problem["type"]),
                                 (413, "urn:shaded:problem:body-too-large"), (name, problem))
                self.assertIn("limit `memory`", problem["detail"])
                event = daemon.wait_for("request", lambda event: event["id"] == pack.__name__)
                self.assertEqual(event["limit"], "memory")
                wait_until(lambda: not daemon.metrics()["shaded_requests_in_flight"])
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_what_does_not_fit_just_now_is_429(self):
        with Daemon("--memory", "256M", "--threads", "2", "--timeout", "600") as daemon:
            slow = {**SLOW, "image": {"width": 2400, "height": 2400, "samples": 16},
                    "outputs": [{"name": "a", "format": "png"}, {"name": "b", "format": "png"}]}
            connection = asking(daemon, slow)
            wait_until(lambda: daemon.metrics()["shaded_memory_used_bytes"] > 120 * MB)
            # Of another client: it has its turn between two tiles.
            answer = render_from(daemon, "127.0.0.2", large(0, 1900, 2))
            connection.close()
            self.assertEqual(answer.status, 429, answer.body[:300])
            self.assertGreaterEqual(int(answer.headers["Retry-After"]), 1)
            self.assertIn("memory", json.loads(answer.body)["detail"])
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_too_little_to_begin_with_ends_the_start(self):
        status, _, text = run("--memory", "16M", "--listen", "127.0.0.1:0")
        self.assertEqual(status, 1)
        self.assertIn("16777216 bytes are too few", json.loads(text)["message"])


class ShareTest(unittest.TestCase):
    def test_the_default_is_three_quarters_and_told(self):
        with Daemon() as daemon:
            found = daemon.wait_for("machine")["memory"]
            memory = daemon.wait_for("memory")
            self.assertEqual(memory["budget"], found // 4 * 3)
            self.assertEqual(daemon.metrics()["shaded_memory_budget_bytes"], memory["budget"])

    def test_parts_are_within_the_whole(self):
        with Daemon("--memory", "128M", "--max-connections", "100000") as daemon:
            memory = daemon.wait_for("memory")
            left = 128 * MB - memory["program"]
            self.assertEqual(memory["request"], left)
            self.assertLessEqual(memory["reuse"] + memory["response-cache"], left // 2)
            self.assertLessEqual(memory["connections"], left // 4)
            daemon.signal(1)  # SIGHUP reads the same again: nothing needs a restart
            self.assertNotIn("needs-restart", daemon.wait_for("reloaded"))

    def test_threads_are_as_many_as_affinity_allows(self):
        allowed = os.sched_getaffinity(0)
        os.sched_setaffinity(0, {min(allowed)})
        try:
            with Daemon() as daemon:
                self.assertEqual(daemon.wait_for("listening")["threads"], 1)
                self.assertEqual(daemon.wait_for("machine")["processors"], 1)
        finally:
            os.sched_setaffinity(0, allowed)


class IdleTest(unittest.TestCase):
    @unittest.skipIf(SANITIZED, "a sanitizer has memory of its own")
    def test_what_nobody_asked_for_is_not_made(self):
        """Tables of all the displays would be 26 MB, and those of 40 exposures of one 60. What is kept of
        them is a sixteenth of 107 MB, and counted."""
        with Daemon("--reuse", "0", "--threads", "1", "--memory", "128M", "--response-cache",
                    "0") as daemon:
            self.assertLess(resident(daemon, "RssAnon"), 16 * MB)
            before = daemon.metrics()["shaded_memory_used_bytes"]
            for n in range(40):
                answer = daemon.render({**SMALL, "output": {
                    "display": "Rec.2100-PQ", "exposure": n / 100, "format": "png",
                    "view": "ACES 1.1 - HDR Video (1000 nits & Rec.2020 lim)"}})
                self.assertEqual(answer.status, 200, answer.body)
            self.assertLess(resident(daemon, "RssAnon"), 28 * MB)
            kept = daemon.metrics()["shaded_memory_used_bytes"] - before
            self.assertTrue(MB < kept < 9 * MB, kept)

    @unittest.skipIf(SANITIZED, "a sanitizer keeps what is freed")
    def test_memory_goes_back(self):
        """What is left of pictures of 90 MB is what a small one wants next."""
        with Daemon("--memory", "1G", "--threads", "2", "--reuse", "0", "--response-cache",
                    "0") as daemon:
            for n in range(3):
                self.assertEqual(daemon.render(large(n, 2000, 2, "png")).status, 200)
            self.assertGreater(resident(daemon), 100 * MB)
            wait_until(lambda: resident(daemon, "VmRSS") < 48 * MB)


if __name__ == "__main__":
    unittest.main()
