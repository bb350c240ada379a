"""Memory is refused at every place where it is asked for: what comes is the right answer or a plain
error, the daemon serves on, and nothing is left behind.

A place is a call stack. Where there are more than there is time for, every so-manieth is tried, and
the output says so; FAULT_SECONDS is the time of each case, and with FAULT_SECONDS=all (./dev fault)
every place is tried."""

import gzip
import http.client
import json
import os
import re
import resource
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from e2e.coding_test import zstd
from e2e.daemon import BUILD, SOURCE, Daemon, another, environment
from e2e.daemon_test import wait_until
from e2e.links_test import link_of
from fault.control import Control

SECONDS = os.environ.get("FAULT_SECONDS", "0.25")
SHADE = str(BUILD / "shade")
# Allocations of a program's own work, after those of its start, which are tried first.
LAST = 150

SCENE = {"objects": [{"type": "sphere", "material": {"specular": 0.5}}],
         "lights": [{"position": [3, 3, 3, 1]}], "image": {"width": 40, "height": 30, "samples": 1}}
SCENES = {
    "png": SCENE,
    "jpeg": {**SCENE, "output": {"format": "jpeg"}},
    "webp": {**SCENE, "output": {"format": "webp"}},
    "samples": {**SCENE, "image": {"width": 40, "height": 30, "samples": 16}},
    "layers": {**SCENE, "interpolation": "gouraud",
               "accuracy": {"maxError": 200, "metric": "code"},
               "outputs": [{"name": "a", "format": "png", "channel": "G"},
                           {"name": "b", "format": "jpeg", "colorSpace": "YIQ"}]},
    "mesh": {**SCENE, "objects": [{"type": "mesh", "indices": [0, 1, 2],
                                   "positions": [-1, -1, 0, 1, -1, 0, 0, 1, 0]}]},
}

# What ends the process by design of a library: std::terminate, which nobody can catch. Each with the
# library whose frame is on the stack, and the reason.
ABORTS = {"libOpenColorIO": "it asks for memory in functions that are declared noexcept while it "
                            "reads a configuration, at the start and for SIGHUP"}

# What is not tried is the loading of OpenImageIO: some of its libraries allocate in static constructors,
# where nobody can catch what is thrown. src/image/load.c asks before whether there is room.

# libmicrohttpd forgets three allocations where it has no memory for a connection's pool.
MHD_LEFT = 3


def another_batch(batch, n):
    return {**batch, "scene": another(batch["scene"], n)}


def choose(places):
    """Of numbers of allocations, those that there is time for: an iterator, and what to say."""
    if SECONDS == "all":
        return places
    own, start = places[-LAST:], places[:-LAST]
    order = []
    stride = 64
    taken = set()
    while stride:  # coarse first, then finer
        for offset in range(0, len(start), stride):
            if offset not in taken:
                taken.add(offset)
                order.append(start[offset])
        stride //= 2
    return own[::2] + order[:len(order) // 8] + own[1::2] + order[len(order) // 8:]


class Tally:
    """Goes through places as long as there is time, and says what came of them."""

    def __init__(self, name, places):
        self.name, self.total, self.counts = name, len(places), {}
        self.chosen = choose(places)
        self.end = time.monotonic() + (1e9 if SECONDS == "all" else float(SECONDS))

    def __iter__(self):
        tried = 0
        for number in self.chosen:
            if time.monotonic() > self.end:
                break
            tried += 1
            yield number
        told = ", ".join(f"{count} {name}" for name, count in sorted(self.counts.items()))
        print(f"{self.name}: {tried} of {self.total} places tried: {told}", flush=True)

    def count(self, name):
        self.counts[name] = self.counts.get(name, 0) + 1


class Case(unittest.TestCase):
    def setUp(self):
        self.control = Control()
        self.addCleanup(self.control.close)

    def fail_at(self, number, why):
        self.fail(f"allocation {number} refused: {why}\n" + "\n".join(self.control.where()))

    def reason_to_abort(self):
        return next((name for name in ABORTS
                     if any(line.startswith(name) for line in self.control.where())), None)


class CommandTest(Case):
    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def shade(self, *arguments):
        env = environment(**self.control.environment(at_main=True))
        return subprocess.run([SHADE, *arguments], cwd=self.folder, capture_output=True, env=env,
                              timeout=500, check=False)

    def look(self, number, run, good, tally):
        made = {path.name: path.read_bytes() for path in self.folder.glob("out/*")}
        for name in made:
            os.unlink(self.folder / "out" / name)
        if run.returncode == 0 and made == good:
            tally.count("good")
        elif run.returncode == 1 and run.stderr and not made:
            tally.count("refused")
        elif run.returncode == -signal.SIGABRT and not made and self.reason_to_abort():
            tally.count(f"ended by {self.reason_to_abort()}")
        else:
            self.fail_at(number, f"exit {run.returncode}, files {list(made)}: "
                                 f"{run.stderr.decode()[-3000:]}")

    def try_places(self, name, *arguments):
        (self.folder / "out").mkdir(exist_ok=True)
        self.control.set(hashes=1 << 20)
        run = self.shade(*arguments)
        self.assertEqual(run.returncode, 0, run.stderr)
        good = {path.name: path.read_bytes() for path in self.folder.glob("out/*")}
        for made in good:
            os.unlink(self.folder / "out" / made)
        tally = Tally(name, self.control.places())
        for number in tally:
            self.control.set(number)
            self.look(number, self.shade(*arguments), good, tally)

    def test_shade_renders_or_says_why_not(self):
        for name in ("png", "samples", "mesh"):
            (self.folder / "scene.json").write_text(json.dumps(SCENES[name]))
            self.try_places(f"shade render {name}", "render", "scene.json", "-o", "out/a.png")

    def test_shade_checks_or_says_why_not(self):
        (self.folder / "scene.json").write_text(json.dumps(SCENES["layers"]))
        self.try_places("shade check", "check", "scene.json")


class DaemonTest(Case):
    """One worker, so that the same request asks for memory in the same order."""

    def start(self, *flags):
        daemon = Daemon("--threads", "1", "--log-requests", "off", *flags,
                        env=self.control.environment())
        self.control.armed = 0
        return daemon

    def ask(self, daemon, path, scene, headers=None):
        """(status, bytes, what matters of the head); None where the connection ended without an
        answer. What came of the answer's body in part is an error of http.client."""
        try:
            answer = daemon.post(path, scene, headers) if scene is not None \
                else daemon.get(path, headers)
        except ConnectionError:
            return None
        except http.client.IncompleteRead as error:  # of a stream
            return 200, error.partial, ()
        head = tuple(answer.headers.get(name) for name in
                     ("Content-Type", "Content-Length", "ETag", "Cache-Control", "Vary",
                      "Shaded-Plan"))
        return answer.status, answer.body, head

    def is_plain_error(self, answer):
        status, body, head = answer
        if status not in (500, 503) or head[0] != "application/problem+json":
            return False
        problem = json.loads(body)
        return problem["status"] == status and problem["type"].endswith((":memory", ":internal"))

    def look(self, daemon, number, got, good, tally):
        if daemon.process.poll() is not None:
            self.fail_at(number, f"the daemon ended, {daemon.process.returncode}: "
                                 f"{daemon.stderr()[-3000:]}")
        if got is None:
            # libmicrohttpd's own, before there is a request to answer.
            frames = [line for line in self.control.where() if not line.startswith("fault_shim")]
            if not frames[0].startswith("libmicrohttpd"):
                self.fail_at(number, "no answer")
            tally.count("closed by libmicrohttpd")
        elif good(got):
            tally.count("good")
        elif self.is_plain_error(got):
            tally.count("refused")
        else:
            self.fail_at(number, str(got)[:1000])

    def refuse_each(self, name, daemon, path, scenes, good, left=MHD_LEFT, headers=None):
        """`scenes` gives another one for each number; `left` is how many allocations may be left
        behind by all of it, None: any number, since answers are kept."""
        self.assertTrue(good(scenes(0), self.ask(daemon, path, scenes(0), headers)))
        wait_until(lambda: self.descriptors(daemon) == self.before)
        self.control.set(hashes=1 << 20)
        self.control.armed = 1
        answer = self.ask(daemon, path, scenes(1), headers)
        self.control.armed = 0
        self.assertTrue(good(scenes(1), answer), answer)
        total = self.control.seen
        for number in (total // 4, total // 2, total - total // 4):  # what errors make once
            self.control.set(number)
            self.control.armed = 1
            self.ask(daemon, path, scenes(1), headers)
            self.control.armed = 0
        wait_until(lambda: self.descriptors(daemon) == self.before)
        time.sleep(0.1)
        live = self.control.live
        tally = Tally(name, list(range(1, total + 20)))
        for number in tally:
            scene = scenes(number + 1)
            self.control.set(number)
            self.control.armed = 1
            got = self.ask(daemon, path, scene, headers)
            self.control.armed = 0
            self.look(daemon, number, got, lambda answer, s=scene: good(s, answer), tally)
            again = self.ask(daemon, path, scene, headers)
            if not again or not good(scene, again):
                self.fail_at(number, f"after {str(got)[:300]} the next request: {str(again)[:300]}; "
                                     f"exit {daemon.process.poll()} {daemon.stderr()[-1000:]}")
        wait_until(lambda: self.descriptors(daemon) == self.before)
        time.sleep(0.1)
        if left is not None:
            self.assertLessEqual(self.control.live - live, left, "allocations are left behind")

    @staticmethod
    def descriptors(daemon):
        return len(os.listdir(f"/proc/{daemon.pid}/fd"))

    def try_pictures(self, keeps, *flags):
        with Daemon("--reuse", "0", "--response-cache", "0", "--log-requests", "off") as calm, \
                self.start(*flags) as daemon:
            self.before = self.descriptors(daemon)
            for name, scene in SCENES.items():
                def right(scene, answer):
                    return answer[0] == 200 and answer == self.ask(calm, "/v1/render", scene)

                left = None if keeps else MHD_LEFT
                self.refuse_each(f"POST /v1/render {name} {' '.join(flags)}", daemon, "/v1/render",
                                 lambda n, scene=scene: another(scene, n), right, left)

    def test_pictures_are_right_or_refused(self):
        self.try_pictures(False, "--reuse", "0", "--response-cache", "0")

    def test_batches_are_right_but_for_some_parts(self):
        """Or cut short: a stream that has begun cannot say more."""
        batch = {"scene": SCENE, "sweep": {"/background": [0, 0.5, 1], "/ambient": [0, 0.5]}}

        def whole(body):
            return body.count(b"Content-Type: image/png") == 6

        def right(_, answer):
            status, body, head = answer
            if status == 200 and not whole(body):
                self.odd.append(body)
            return status == 200

        with self.start("--reuse", "0", "--response-cache", "0") as daemon:
            self.odd, self.before = [], self.descriptors(daemon)
            self.refuse_each("POST /v1/batch", daemon, "/v1/batch", lambda n: another_batch(batch, n), right)
            for body in self.odd:
                self.assertTrue(b"urn:shaded:problem:" in body or not body.endswith(b"--\r\n"), body)
            self.assertTrue(whole(self.ask(daemon, "/v1/batch", batch)[1]))

    def test_sheets_and_turntables_are_right_or_refused(self):
        batches = {"sheet": {"scene": SCENE, "sweep": {"/background": [0, 0.5]}, "sheet": {}},
                   "webp": {"scene": SCENE, "turntable": {"frames": 2}},
                   "apng": {"scene": SCENE, "turntable": {"frames": 2, "format": "apng"}}}
        flags = ("--reuse", "0", "--response-cache", "0")
        with Daemon(*flags, "--log-requests", "off") as calm, self.start(*flags) as daemon:
            self.before = self.descriptors(daemon)
            for name, batch in batches.items():
                def right(batch, answer):
                    return answer[0] == 200 and answer == self.ask(calm, "/v1/batch", batch)

                self.refuse_each(f"POST /v1/batch {name}", daemon, "/v1/batch",
                                 lambda n, batch=batch: another_batch(batch, n), right)

    def test_what_is_kept_stays_right(self):
        self.try_pictures(True, "--reuse", "1M", "--response-cache", "64K")

    def test_other_answers_are_right_or_refused(self):
        def keys(value):
            """What a document has, whatever times it tells."""
            if isinstance(value, dict):
                return {key: keys(item) for key, item in value.items()}
            return [keys(item) for item in value] if isinstance(value, list) else None

        with Daemon("--threads", "1", "--log-requests", "off") as calm, \
                self.start("--reuse", "0", "--response-cache", "0") as daemon:
            self.before = self.descriptors(daemon)
            for path in ("/v1/explain", "/v1/compare"):
                shape = keys(json.loads(self.ask(calm, path, SCENE)[1]))

                def right(_, answer, shape=shape):
                    return answer[0] == 200 and keys(json.loads(answer[1])) == shape

                self.refuse_each(f"POST {path}", daemon, path, lambda n: another(SCENE, n), right)
            # What opens the libraries that decode is none of these places.
            for coding, body in ("gzip", gzip.compress), ("zstd", zstd):
                expected = self.ask(calm, "/v1/render", SCENE)
                self.refuse_each(f"POST /v1/render {coding}", daemon, "/v1/render",
                                 lambda n, body=body: body(json.dumps(SCENE).encode()),
                                 lambda _, answer, expected=expected: answer == expected,
                                 headers={"Content-Encoding": coding})
            for path in ("/v1/version", "/v1/nothing", "/v1/preview/gold?size=32&shape=disc",
                         "/v1/preview/gold?size=x", link_of(SCENE), link_of({}), "/v1/scene/A.png"):
                expected = self.ask(calm, path, None)
                self.refuse_each(f"GET {path}", daemon, path, lambda n: None,
                                 lambda _, answer, expected=expected: answer == expected)

    def reload(self, daemon):
        """What SIGHUP has come to, None where it was the end."""
        def told():
            return [event for event in daemon.events() if event["event"].startswith("reload")]

        before = len(told())
        daemon.signal(signal.SIGHUP)
        wait_until(lambda: daemon.process.poll() is not None or len(told()) > before)
        return told()[-1] if len(told()) > before else None

    def refuse_each_reload(self, name, config, broken):
        """`broken`: text that the configuration has by then, of which the daemon says that it is bad;
        None: it is as it was."""
        path = Path(self.folder, "config.ocio")

        def start():
            path.write_text(config)
            daemon = self.start("--ocio", str(path))
            path.write_text(broken or config)
            return daemon

        daemon = start()
        self.control.set(hashes=1 << 20)
        self.control.armed = 1
        event = self.reload(daemon)
        self.control.armed = 0
        self.assertEqual(event["event"], "reload-failed" if broken else "reloaded")
        good = self.ask(daemon, "/v1/render", SCENE)
        tally = Tally(name, self.control.places())
        for number in tally:
            self.control.set(number)
            self.control.armed = 1
            event = self.reload(daemon)
            self.control.armed = 0
            if event:
                self.assertEqual(self.ask(daemon, "/v1/render", SCENE), good, event)
                tally.count(event["event"])
                continue
            if not self.reason_to_abort():
                self.fail_at(number, f"the daemon ended, {daemon.process.returncode}: "
                                     f"{daemon.stderr()[-3000:]}")
            tally.count(f"ended by {self.reason_to_abort()}")
            daemon.wait()
            daemon = start()
        daemon.stop()

    def test_reloads_are_whole_or_leave_what_was(self):
        with tempfile.TemporaryDirectory() as self.folder:
            config = (SOURCE / "config/shaded.ocio").read_text()
            self.refuse_each_reload("SIGHUP", config, None)
            self.refuse_each_reload("SIGHUP, bad colors", config,
                                    config.replace("scene_linear:", "other_role:"))

    def test_a_reload_without_memory_leaves_what_was(self):
        with Daemon("--threads", "1") as daemon:
            good = self.ask(daemon, "/v1/render", SCENE)
            size = re.search(r"VmData:\s+(\d+)", Path(f"/proc/{daemon.pid}/status").read_text())
            usual = resource.prlimit(daemon.pid, resource.RLIMIT_DATA)
            resource.prlimit(daemon.pid, resource.RLIMIT_DATA, (int(size[1]) * 1024, usual[1]))
            for _ in range(20):
                event = self.reload(daemon)
                self.assertEqual((event["event"], event["message"]),
                                 ("reload-failed", "out of memory"))
            resource.prlimit(daemon.pid, resource.RLIMIT_DATA, usual)
            self.assertEqual(self.reload(daemon)["event"], "reloaded")
            self.assertEqual(self.ask(daemon, "/v1/render", SCENE), good)

    def test_when_all_memory_is_gone_the_daemon_waits_for_better_times(self):
        with self.start() as daemon:
            self.before = self.descriptors(daemon)
            good = self.ask(daemon, "/v1/render", SCENE)
            for number in range(1, 300, 7):
                self.control.set(number, 1 << 40)
                self.control.armed = 1
                got = self.ask(daemon, "/v1/render", another(SCENE, number))
                self.control.armed = 0
                self.assertIsNone(daemon.process.poll(), daemon.stderr())
                if got and got[0] != 200 and not self.is_plain_error(got):
                    self.fail_at(number, str(got)[:1000])
                self.assertEqual(self.ask(daemon, "/v1/render", SCENE), good)
            wait_until(lambda: self.descriptors(daemon) == self.before)


if __name__ == "__main__":
    unittest.main()
