"""What fails around the daemon: the disk that its log goes to, clients that cut their connections,
color configurations, OpenImageIO in want of memory, the wall clock."""

import fcntl
import json
import os
import resource
import select
import signal
import socket
import struct
import subprocess
import tempfile
import time
import unittest
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

from e2e.daemon import (SHADED, SLOW, SMALL, SOURCE, Daemon, another, environment,
                        receive_all)
from e2e.daemon_test import Background, wait_until
from e2e.http_test import post
from e2e.slow_test import MANY_BYTES
from fault.control import DAY, Control

# Allocations that are refused to a writer of OpenImageIO, of those of one picture.
MOST = 10**9 if os.environ.get("FAULT_SECONDS") == "all" else 60


def descriptors(daemon):
    return len(os.listdir(f"/proc/{daemon.pid}/fd"))


class LogTest(unittest.TestCase):
    """Its log is not written to a pipe here, so its ports are chosen by the test."""

    @contextmanager
    def running(self, log, **options):
        """The process, and what asks it for a picture."""
        with socket.create_server(("127.0.0.1", 0)) as probe:
            port = probe.getsockname()[1]
        process = subprocess.Popen([SHADED, "--listen", f"127.0.0.1:{port}", "--admin", "off"],
                                   stderr=log, env=environment(), **options)
        try:
            def request():
                with socket.create_connection(("127.0.0.1", port), 30) as connection:
                    connection.sendall(post(b"Connection: close"))
                    return connection.recv(100).startswith(b"HTTP/1.1 200 ")

            def answers():
                try:
                    return request()
                except ConnectionError:
                    return False

            wait_until(answers)
            yield process, request
        finally:
            process.terminate()
        self.assertEqual(process.wait(60), 0)

    def serve(self, log, **options):
        with self.running(log, **options) as (process, request):
            for _ in range(50):
                self.assertTrue(request())
            process.send_signal(signal.SIGHUP)
            for _ in range(20):
                self.assertTrue(request())

    def test_a_full_disk_stops_the_log_and_nothing_else(self):
        with open("/dev/full", "wb") as full:
            self.serve(full)

    def test_a_log_that_may_not_grow_stops_nothing_else(self):
        with tempfile.TemporaryFile() as log:
            # More than this and the system sends SIGXFSZ, which ends those who do not mind it.
            self.serve(log, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE,
                                                                  (500, 500)))
            self.assertEqual(log.seek(0, os.SEEK_END), 500)

    def test_a_log_that_nobody_reads_any_more_stops_nothing_else(self):
        reader, writer = os.pipe()
        os.close(reader)
        with os.fdopen(writer, "wb") as pipe:
            self.serve(pipe)

    def test_a_log_whose_reader_is_stuck_stops_nothing_else(self):
        reader, writer = os.pipe()
        fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, 4096)
        with os.fdopen(reader, "rb") as log, os.fdopen(writer, "wb") as pipe:
            with self.running(pipe) as (_, request):
                for _ in range(50):
                    self.assertTrue(request())
                begin = log.read1(4096)
                self.assertTrue(request())
                wait_until(lambda: select.select([log], [], [], 0)[0])
                again = json.loads(log.readline())
        self.assertIn(b"machine", begin)
        self.assertEqual((again["event"], again["level"]), ("log-lost", "warning"))
        self.assertGreater(again["lines"], 30)


class CutTest(unittest.TestCase):
    """Connections are cut, with a reset too, wherever they are."""

    def cut(self, daemon, message, reset, answered):
        with socket.socket() as connection:
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.settimeout(500)
            connection.connect(daemon.address)
            connection.sendall(message)
            if answered:
                self.assertTrue(connection.recv(1000).startswith(b"HTTP/1.1 200 "))
            if reset:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))

    def test_whatever_is_cut_the_next_is_served_and_nothing_is_left(self):
        many = post(body=json.dumps(MANY_BYTES).encode())
        chunked = post(b"Transfer-Encoding: chunked", length=False, body=b"20\r\n{\"objects\"")
        with Daemon("--log-requests", "off") as daemon:
            self.assertEqual(daemon.render(MANY_BYTES).status, 200)
            wait_until(lambda: not any(daemon.metrics()[f'shaded_connections{{at="{at}"}}']
                                       for at in ("rest", "head", "body", "work", "answer")))
            before = descriptors(daemon)
            for reset in (False, True):
                for message, answered in ((b"", False), (post()[:20], False), (post()[:-20], False),
                                          (chunked, False), (post(), False), (many, True)):
                    for _ in range(1 if answered else 5):
                        self.cut(daemon, message, reset, answered)
                    self.assertEqual(daemon.render(another(SMALL)).status, 200)
            # What asked for the metrics may still have been among those before.
            wait_until(lambda: descriptors(daemon) <= before)


class ColorTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.config = Path(folder.name) / "config.ocio"
        self.good = (SOURCE / "config" / "shaded.ocio").read_text()

    def test_a_transform_that_cannot_be_made_keeps_the_old_ones(self):
        # It can be read; what throws is the making of the processor.
        missing = "from_scene_reference: !<FileTransform> {src: missing.cube}"
        bad = self.good.replace("isdata: true", missing, 1)
        bad = bad if bad != self.good else self.good + (
            "\n  - !<ColorSpace>\n    name: broken\n    " + missing + "\n")
        self.config.write_text(bad)
        run = subprocess.run([SHADED, "--listen", "127.0.0.1:0", "--admin", "off", "--ocio",
                              str(self.config)], env=environment(), capture_output=True,
                             timeout=500, check=False)
        self.assertEqual(run.returncode, 1, run.stderr)
        self.config.write_text(self.good)
        with Daemon("--ocio", str(self.config)) as daemon:
            first = daemon.render(SMALL)
            self.config.write_text(bad)
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reload-failed")
            again = daemon.render(SMALL)
            self.assertEqual((again.status, again.body), (200, first.body))
            self.assertEqual(daemon.get("/readyz", admin=True).status, 200)


# What OpenImageIO does where memory is refused beneath one of these, which nobody can help from
# outside: it ends the process, or writes a file without the attribute. By a name on the call stack.
CARELESS = {
    "ParamValue12init_noclear": "copies to what calloc gave without a look",
    "libtiff.so": "TIFFSetField, TIFFSetupStrips: libtiff does not look either, and its errors are "
                  "not asked for",
    "OpenEXROutput13put_parameter": "drops attributes whose copy throws",
}


class WriterTest(unittest.TestCase):
    """Memory is refused to OpenImageIO's writers: std::bad_alloc comes out of them."""

    def setUp(self):
        self.control = Control()
        self.addCleanup(self.control.close)
        self.daemon = None
        self.addCleanup(lambda: self.daemon.process.kill())

    def start(self, scene):
        self.daemon = Daemon("--threads", "1", "--reuse", "0", "--response-cache", "0",
                             "--log-requests", "off", env=self.control.environment())
        return self.daemon.render(scene).body

    def ask(self, scene, number):
        self.control.set(number)
        self.control.armed = 1
        try:
            return self.daemon.render(scene)
        except ConnectionError:
            return None  # libmicrohttpd had no memory for the connection, or it is the end
        finally:
            self.control.armed = 0

    def look(self, scene, good, answer, where):
        """What came of it; for want of a better one, who was careless."""
        careless = next((name for name in CARELESS if name in where), None)
        if answer is None and careless:
            wait_until(lambda: self.daemon.process.poll() is not None)
            self.daemon.wait()
            self.start(scene)
            return careless
        self.assertIsNone(self.daemon.process.poll(), where)
        again = self.daemon.render(scene)
        self.assertEqual((again.status, again.body), (200, good), where)
        if answer is None:
            return "closed"
        if answer.status != 200:
            self.assertIn(answer.status, (500, 503), where)
            return "refused"
        if answer.body == good:
            return "good"
        self.assertIsNotNone(careless, where)
        return careless

    def try_format(self, format):
        scene = {**SMALL, "output": {"format": format}}
        good = self.start(scene)
        self.assertEqual(self.ask(scene, 1 << 40).body, good)
        total, counts, refused = self.control.seen, Counter(), 0
        for number in range(1, total + 1, 1 + total // MOST):
            answer = self.ask(scene, number)
            where = "\n".join(self.control.where())
            came = self.look(scene, good, answer, where)
            counts[came] += 1
            refused += came == "refused" and "libOpenImageIO" in where
        print(f"{format}: {sum(counts.values())} of {total} allocations refused: {dict(counts)}",
              flush=True)
        self.assertGreater(refused, 0)
        self.daemon.stop()

    def test_what_openimageio_throws_is_answered_and_the_next_picture_is_right(self):
        for format in ("tiff", "exr", "hdr"):
            self.try_format(format)


class ClockTest(unittest.TestCase):
    """Only the wall clock jumps, by a day: durations are measured by the other one."""

    def setUp(self):
        self.control = Control()
        self.addCleanup(self.control.close)

    def test_the_log_has_the_wall_clock_and_nothing_else_has(self):
        with Daemon("--timeout", "60", "--idle-timeout", "60", "--head-time", "60", "--body-time",
                    "60", env=self.control.environment()) as daemon, \
                socket.create_connection(daemon.address, 500) as resting, \
                socket.create_connection(daemon.address, 500) as sending:
            resting.sendall(post())
            self.assertTrue(resting.recv(100000).startswith(b"HTTP/1.1 200 "))
            sending.sendall(post()[:-5])
            began = time.monotonic()
            for number, days in enumerate((1, -1, 0)):
                work = Background(daemon, another(SLOW, number))
                wait_until(lambda: daemon.metrics()["shaded_workers_busy"] or work.answer)
                self.control.clock_offset = days * DAY
                answer = work.result()
                self.assertEqual(answer.status, 200)
                logged = daemon.wait_for(
                    "request", lambda event, id=answer.headers["X-Request-Id"]: event["id"] == id)
                self.assertLess(logged["ms"], 3600e3)
                today = time.strftime("%Y-%m-%d", time.gmtime(time.time() + days * DAY))
                near = time.strftime("%Y-%m-%d", time.gmtime(time.time() + days * DAY - 120))
                self.assertIn(logged["time"][:10], (today, near))
                self.assertEqual(daemon.render(SMALL).status, 200)
            if time.monotonic() - began < 50:  # else they may have been ended, and rightly
                for connection, rest in ((resting, post()), (sending, post()[-5:])):
                    connection.sendall(rest)
                    self.assertTrue(connection.recv(100000).startswith(b"HTTP/1.1 200 "))

    def test_deadlines_come_in_time_though_the_clock_is_set_back(self):
        with Daemon("--timeout", "2", "--head-time", "1", env=self.control.environment()) as daemon, \
                socket.create_connection(daemon.address, 500) as late:
            late.sendall(b"GET")
            slow = {**SLOW, "image": {"width": 4096, "height": 4096, "samples": 16}}
            work = Background(daemon, slow)
            self.control.clock_offset = -DAY
            self.assertEqual(work.result().status, 504)
            self.assertEqual(late.recv(100), b"")


class StopTest(unittest.TestCase):
    """The I/O thread is held up where it takes connections, as on a machine that is busy."""

    def setUp(self):
        self.control = Control()
        self.addCleanup(self.control.close)

    def stop_before_a_crowd(self, count, pause):
        self.control.accept_pause = pause
        daemon = Daemon(env=self.control.environment())
        daemon.signal(signal.SIGSTOP)
        crowd = [socket.create_connection(daemon.address, 500) for _ in range(count)]
        for connection in crowd:
            connection.sendall(post())
        daemon.signal()
        daemon.signal(signal.SIGCONT)
        for connection in crowd:
            with connection:
                self.assertRegex(receive_all(connection), rb"^HTTP/1.1 (200|503) ")
        self.assertEqual(daemon.wait(), 0, daemon.stderr())
        self.assertEqual(daemon.events()[-1]["message"], "all requests are answered")

    def test_who_is_being_let_in_is_answered(self):
        self.stop_before_a_crowd(1, 300000)

    def test_who_waits_to_be_let_in_is_answered(self):
        self.stop_before_a_crowd(12, 200000)


if __name__ == "__main__":
    unittest.main()
