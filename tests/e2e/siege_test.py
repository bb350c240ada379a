"""Ten ordinary clients beside many that mean it: whatever those do, every ordinary request is answered.

    ./dev siege [SECONDS]

For SHADED_SIEGE seconds, twenty without it: a quarter of it without the attackers, for comparison.
SHADED_SIEGE_PAGE is where the results go. Times are judged only then, and all of the siege goes
before what else the machine does, if that is permitted."""

# ctest: serial

import gzip
import http.client
import json
import multiprocessing
import os
import random
import socket
import threading
import time
import unittest
from collections import Counter
from pathlib import Path

from bench.priority import raise_priority
from e2e.daemon import JSON, SMALL, SOURCE, Daemon
from e2e.daemon_test import ENDLESS, wait_until
from e2e.http_test import post
from e2e.slow_test import MANY_BYTES

SECONDS = float(os.environ.get("SHADED_SIEGE") or 20)
PAGE = os.environ.get("SHADED_SIEGE_PAGE")
ORDINARY, MEMORY, SLOWER, HEALTHY = 10, 512, 5, 0.1  # clients; MB; times; seconds
SCENE = {"objects": [{"type": "sphere", "material": {"specular": 0.5}}],
         "lights": [{"position": [3, 3, 3, 1]}]}
# 15 MB of white space and numbers, each document another one.
GIANT = ('{"objects": [{"type": "mesh", "positions": [0,0,0, 1,0,0, 0,1,0], "indices": [%s]}],'
         ' "camera": {"fov": %f}}')


def scene_of(number, side):
    """Like no other: no answer is known, and nothing is shared."""
    return {**SCENE, "camera": {"fov": 30 + number % 6e7 * 1e-6},
            "image": {"width": side, "height": side, "samples": 4}}


# ---- Attackers: each kind is a process of its own, with addresses of its own ----

class Attack:
    """Connections of one kind, from addresses 127.0.KIND.1 on; `step` is called for each in turn."""

    count, addresses, pause = 1, 1, 0.05

    def __init__(self, target, kind, done):
        self.target, self.kind, self.done = target, kind, done
        self.answers = Counter()
        self.number = 0

    def open(self, index, receive=0):
        connection = socket.socket()
        if receive:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive)
        connection.bind((f"127.0.{self.kind}.{1 + index % self.addresses}", 0))
        connection.settimeout(5)
        connection.connect(self.target)
        connection.setblocking(False)
        self.answers["connections"] += 1
        return connection

    def render(self, scene):
        self.answers["requests"] += 1
        body = scene if isinstance(scene, str) else json.dumps(scene)
        return post(body=body.encode())

    def hear(self, connection):
        """True: an answer, or its beginning, is there. OSError: the connection has ended."""
        try:
            data = connection.recv(65536)
        except BlockingIOError:
            return False
        if not data:
            raise ConnectionError
        if data.startswith(b"HTTP/1.1 "):
            self.answers[data[9:12].decode()] += 1
        return True

    def run(self):
        os.nice(19)  # they have no machine of their own, as they would
        states = [None] * self.count
        while not self.done.is_set():
            for index, state in enumerate(states):
                try:
                    if state is None:
                        states[index] = state = self.begin(index)
                    self.step(state)
                except OSError:
                    if state:
                        state["connection"].close()
                    states[index] = None
            self.done.wait(self.pause)
        for state in states:
            if state:
                state["connection"].close()
        return self.answers


class NeverReading(Attack):
    """Ask for 15 MB each, and take none of it."""
    count, addresses = 12, 3

    def begin(self, index):
        self.number += 1
        connection = self.open(index, 4096)
        connection.send(self.render({**MANY_BYTES, "camera": {"position": [0, 1, 3],
                                                              "fov": 30 + self.number * 1e-3}}))
        return {"connection": connection}

    def step(self, state):
        state["connection"].send(b"")
        if state["connection"].getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            raise ConnectionError


class Dripping(Attack):
    """A byte of a head, or of a body, now and then."""
    count, addresses, pause = 240, 3, 0.3
    heads = (b"POST /v1/render HTTP/1.1\r\nHost: a\r\nX-Drip: " + b"a" * 10000,
             post(b"Content-Length: 10000", length=False, body=b" " * 9000))

    def begin(self, index):
        return {"connection": self.open(index), "message": self.heads[index % 2], "sent": 0}

    def step(self, state):
        at = state["sent"]
        state["sent"] += state["connection"].send(state["message"][at:at + 1])
        self.hear(state["connection"])


class Joining(Attack):
    """The same endless picture, asked for by a crowd that asks again."""
    count, addresses, pause = 160, 2, 0.2

    def scene(self):
        return ENDLESS

    def begin(self, index):
        connection = self.open(index)
        connection.send(self.render(self.scene()))
        return {"connection": connection}

    def step(self, state):
        if self.hear(state["connection"]):
            state["connection"].send(self.render(self.scene()))


class Poisoning(Joining):
    """Endless pictures, each another one, that run into the deadline."""
    count, addresses, pause = 80, 2, 0.1

    def scene(self):
        self.number += 1
        return {**ENDLESS, "camera": {"fov": 30 + self.number * 1e-3}}


class Flooding(Joining):
    """Small pictures, as many as there are answers."""
    count, addresses, pause = 60, 3, 0.005

    def scene(self):
        self.number += 1
        return scene_of(self.kind * 1e7 + self.number, 200)


class Giant(Attack):
    """Documents of 15 MB, which take longer to read than the pictures to make."""
    count, addresses, pause = 6, 2, 0.01

    def begin(self, index):
        self.number += 1
        document = GIANT % (",".join(["0,1,2"] * 2400000), 30 + self.number * 1e-3)
        return {"connection": self.open(index), "message": self.render(document), "sent": 0}

    def step(self, state):
        at = state["sent"]
        try:
            state["sent"] += state["connection"].send(state["message"][at:at + 262144])
        except BlockingIOError:
            pass
        if self.hear(state["connection"]):
            raise ConnectionError  # another one


class Inflating(Joining):
    """The same documents in gzip: 20 KB each."""
    count, addresses, pause = 24, 3, 0.05
    head, _, tail = (GIANT % (",".join(["0,1,2"] * 2400000), 0)).rpartition("]}]")
    head = gzip.compress(head.encode())

    def render(self, _):
        self.answers["requests"] += 1
        self.number += 1
        tail = ']}], "camera": {"fov": %f}}' % (30 + self.number * 1e-3)
        return post(b"Content-Encoding: gzip", body=self.head + gzip.compress(tail.encode()))


ATTACKS = (NeverReading, Dripping, Joining, Poisoning, Flooding, Giant, Inflating)


def attack(kind, target, number, done, results):
    results.put((kind.__name__, dict(kind(target, number, done).run())))


# ---- The others ----

class Ordinary:
    """A client that asks for a picture, looks at it, and asks for another one."""

    def __init__(self, daemon, index):
        self.address, self.index = daemon.address, index
        self.times, self.wrong = [], []
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.work)
        self.thread.start()

    def ask(self, number):
        connection = http.client.HTTPConnection(*self.address, timeout=500,
                                                source_address=(f"127.0.1.{1 + self.index}", 0))
        began = time.monotonic()
        try:
            connection.request("POST", "/v1/render",
                               json.dumps(scene_of(number, 128 + 64 * (number % 3))), JSON)
            answer = connection.getresponse()
            body = answer.read()
            if answer.status != 200 or body[1:4] != b"PNG":
                self.wrong.append((answer.status, body[:300]))
        except OSError as error:
            self.wrong.append((0, repr(error)))
        finally:
            connection.close()
        self.times.append(time.monotonic() - began)

    def work(self):
        number = self.index * 1000000
        while not self.stop.wait(random.uniform(0.05, 0.25)):
            number += 1
            self.ask(number)


class Watch:
    """Looks at /healthz and at the memory, ten times a second."""

    def __init__(self, daemon):
        self.daemon, self.times, self.wrong, self.memory = daemon, [], [], 0
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.work)
        self.thread.start()

    def work(self):
        while not self.stop.wait(0.1):
            began = time.monotonic()
            status = self.daemon.get("/healthz", admin=True).status
            self.times.append(time.monotonic() - began)
            if status != 200:
                self.wrong.append(status)
            status = Path(f"/proc/{self.daemon.pid}/status").read_text()
            pages = next(line for line in status.splitlines() if line.startswith("VmRSS:"))
            self.memory = max(self.memory, int(pages.split()[1]) / 1024)


def share(times, part):
    return sorted(times)[min(len(times) - 1, int(part * len(times)))]


def end(threads):
    for thread in threads:
        thread.stop.set()
    for thread in threads:
        thread.thread.join()


class SiegeTest(unittest.TestCase):
    def ordinary(self, daemon, seconds):
        """All times of ten ordinary clients for so long; each of their requests is answered."""
        clients = [Ordinary(daemon, i) for i in range(ORDINARY)]
        time.sleep(seconds)
        end(clients)
        self.assertEqual([wrong for client in clients for wrong in client.wrong], [])
        for client in clients:
            self.assertTrue(client.times)
        return [taken for client in clients for taken in client.times]

    def besiege(self, daemon, seconds):
        """The same among attackers, what those had for answers, and what was watched."""
        done, results = multiprocessing.Event(), multiprocessing.Queue()
        attackers = [multiprocessing.Process(target=attack, args=(kind, daemon.address, 2 + i, done,
                                                                  results))
                     for i, kind in enumerate(ATTACKS)]
        for attacker in attackers:
            attacker.start()
        watch = Watch(daemon)
        try:
            # Once all of them are at it.
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] > 0
                       and daemon.metrics()["shaded_joined_total"] > 0)
            besieged = self.ordinary(daemon, seconds)
            done.set()
            return besieged, dict(results.get() for _ in attackers), watch
        finally:
            done.set()
            end([watch])
            for attacker in attackers:
                attacker.join()

    def test_ordinary_clients_are_served_in_a_siege(self):
        first = bool(PAGE) and raise_priority()
        # Three quarters, which is what it takes by itself in a container of that size.
        with Daemon("--memory", f"{MEMORY * 3 // 4}M", "--log-requests", "off", "--drain-time",
                    "1") as daemon:
            self.assertEqual(daemon.render(SMALL).status, 200)
            busy = os.getloadavg()[0]
            alone = self.ordinary(daemon, SECONDS / 4)
            besieged, attacks, watch = self.besiege(daemon, SECONDS * 3 / 4)
            self.assertEqual(watch.wrong, [])
            for name, answers in attacks.items():
                print(f"{name}: {answers}", flush=True)
            ratio = share(besieged, 0.99) / share(alone, 0.99)
            print(f"alone: {len(alone)} p50 {share(alone, 0.5):.4f} p99 {share(alone, 0.99):.4f}; "
                  f"besieged: {len(besieged)} p50 {share(besieged, 0.5):.4f} "
                  f"p99 {share(besieged, 0.99):.4f} max {max(besieged):.4f}; ratio {ratio:.1f}; "
                  f"healthz p99 {share(watch.times, 0.99):.4f} max {max(watch.times):.4f}; "
                  f"memory {watch.memory:.0f} MB", flush=True)
            self.assertLess(watch.memory, MEMORY)
            # It was a siege.
            self.assertGreater(attacks["Flooding"].get("200", 0), 0)
            for kind in ATTACKS:
                self.assertGreaterEqual(attacks[kind.__name__]["connections"], kind.count)
            if PAGE:
                self.write(busy, first, alone, besieged, attacks, watch)
                self.assertLessEqual(ratio, SLOWER)
                self.assertLess(max(watch.times), HEALTHY)

    @staticmethod
    def write(busy, first, alone, besieged, attacks, watch):
        text = (SOURCE / "docs/siege.md").read_text()
        head = text[:text.index("## Results")]
        ratio = share(besieged, 0.99) / share(alone, 0.99)
        rows = "\n".join(
            f"| {name} | {kind.addresses} | {kind.count} | {answers.get('requests', 0):,} | "
            + ", ".join(f"{count:,} times {status}" for status, count in sorted(answers.items())
                        if status.isdigit()) + " |"
            for kind, (name, answers) in ((next(k for k in ATTACKS if k.__name__ == item[0]), item)
                                          for item in sorted(attacks.items())))
        Path(PAGE).write_text(f"""{head}## Results

`./dev siege {SECONDS:.0f}` on {os.cpu_count()} cores, which the attackers share. When it began, other programs
had {busy:.1f} threads at work there (load average){"; all of the siege went before them (`nice -19`)" * first}.

| ordinary clients | alone | besieged |
| --- | ---: | ---: |
| requests, all answered 200 | {len(alone):,} | {len(besieged):,} |
| median, ms | {1000 * share(alone, 0.5):.0f} | {1000 * share(besieged, 0.5):.0f} |
| 99 %, ms | {1000 * share(alone, 0.99):.0f} | {1000 * share(besieged, 0.99):.0f} |
| longest, ms | {1000 * max(alone):.0f} | {1000 * max(besieged):.0f} |

| | |
| --- | ---: |
| 99 % besieged, of that alone | {ratio:.1f} times{', **not reached**' * (ratio > SLOWER)} |
| `/healthz`: 99 %, longest, ms | {1000 * share(watch.times, 0.99):.0f}, {1000 * max(watch.times):.0f} |
| resident memory at most, MB | {watch.memory:.0f} |

| attackers | addresses | connections | requests | answers |
| --- | ---: | ---: | ---: | --- |
{rows}
""")


if __name__ == "__main__":
    unittest.main()
