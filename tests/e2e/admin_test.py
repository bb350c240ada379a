"""The operators' port answers whatever clients do, on the public port or on itself."""

import resource
import socket
import subprocess
import tempfile
import unittest

from e2e.daemon import PATIENCE, SHADED, SMALL, Daemon, environment, run
from e2e.daemon_test import ENDLESS, wait_until
from e2e.memory_test import asking
from e2e.slow_test import Drippers


def limited(most):
    """A program for Daemon, under a limit of open files."""
    return ["prlimit", f"--nofile={most}", SHADED]


class AdminTest(unittest.TestCase):
    def answers(self, daemon):
        for path in ("/healthz", "/readyz", "/metrics"):
            self.assertEqual(daemon.get(path, admin=True).status, 200)

    def test_dripping_connections_hold_nobody_up(self):
        for head in (b"GET /healthz HTTP/1.1\r\nHost: a\r\nX-Drip: " + b"a" * 10000,
                     b"POST /healthz HTTP/1.1\r\nHost: a\r\nContent-Length: 9999\r\n\r\n" + b"a" * 9999):
            with Daemon() as daemon, Drippers(daemon.admin, 64, head, pause=0.1) as crowd:
                for _ in range(20):
                    self.answers(daemon)
                wait_until(lambda crowd=crowd: crowd.ended > 0)
                self.answers(daemon)

    def test_connections_leave_descriptors_for_it(self):
        with Daemon(program=limited(256)) as daemon:
            told = daemon.wait_for("fewer-connections")
            self.assertEqual((told["level"], told["max-connections"]), ("warning", 256 - 192))
            crowd = [socket.create_connection(daemon.address, PATIENCE, (f"127.0.0.{2 + i % 9}", 0))
                     for i in range(300)]
            wait_until(lambda: sum(daemon.metrics()[f'shaded_connections{{at="{at}"}}']
                                   for at in ("rest", "head")) >= 50)
            for _ in range(20):
                self.answers(daemon)
            self.assertEqual(daemon.render(SMALL).status, 200)
            for connection in crowd:
                connection.close()

    def test_a_limit_with_no_room_at_all_is_told_at_the_start(self):
        done = subprocess.run([*limited(192), "--listen", "127.0.0.1:0", "--admin", "off"],
                              capture_output=True, env=environment(), timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"the limit of open files is 192: more than 192 are needed", done.stderr)

    def test_the_soft_limit_is_raised_as_far_as_is_needed(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        if hard != resource.RLIM_INFINITY and hard < 1300:
            self.skipTest(f"the limit of open files is {hard}")
        with Daemon("--max-connections", "1000", program=limited("300:1300")) as daemon:
            self.assertEqual(resource.prlimit(daemon.pid, resource.RLIMIT_NOFILE), (1192, 1300))
            self.assertEqual(daemon.events("fewer-connections"), [])


class ReadyTest(unittest.TestCase):
    """`shaded --ready` asks the daemon of the same options, as a health check without a shell."""

    def ask(self, place, **variables):
        status, out, text = run("--ready", *(["--admin", place] if place else []), env=variables)
        self.assertEqual(out, "")
        return status, text

    def test_it_finds_the_daemon_wherever_it_answers(self):
        with tempfile.TemporaryDirectory() as folder:
            for place in "127.0.0.1:0", "0.0.0.0:0", ":0", "[::1]:0", f"unix:{folder}/admin":
                with self.subTest(place), Daemon(admin=place) as daemon:
                    bound = daemon.wait_for("listening")["admin"]
                    self.assertEqual(self.ask(bound), (0, ""))
                    self.assertEqual(self.ask(None, SHADED_ADMIN=bound), (0, ""))

    def test_a_daemon_that_is_not_ready_is_told(self):
        with Daemon("--threads", "1", "--timeout", "600", "--drain-time", "600") as daemon:
            connection = asking(daemon, ENDLESS)
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"])
            daemon.signal()
            daemon.wait_for("stopping")
            place = "%s:%d" % daemon.admin
            self.assertEqual(self.ask(place), (1, f"shaded: {place}: /readyz: 503\n"))
            connection.close()  # nobody waits for it any more
            self.assertEqual(daemon.wait(), 0)

    def test_no_daemon_and_no_answer_are_told(self):
        with socket.create_server(("127.0.0.1", 0)) as silent:
            place = "127.0.0.1:%d" % silent.getsockname()[1]
            self.assertEqual(self.ask(place), (1, f"shaded: {place}: /readyz: no answer\n"))
        self.assertEqual(self.ask(place), (1, f"shaded: {place}: Connection refused\n"))
        self.assertEqual(self.ask("off"),
                         (1, "shaded: --ready asks the admin port, which is off\n"))
        self.assertEqual(self.ask("nowhere")[0], 1)
        self.assertEqual(run("--ready", "--unknown")[0], 2)


if __name__ == "__main__":
    unittest.main()
