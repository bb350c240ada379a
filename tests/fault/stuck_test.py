"""A worker that does not leave what was cancelled: a library's call that does not end stands for it."""

import unittest

from e2e.daemon import SMALL, Daemon
from e2e.daemon_test import wait_until
from fault.control import Control

# libdeflate is what does not end.
PNG = {**SMALL, "output": {"compression": "small"}}
WEBP = {**SMALL, "output": {"format": "webp"}}
JPEG = {**SMALL, "output": {"format": "jpeg"}}


class StuckTest(unittest.TestCase):
    def setUp(self):
        self.control = Control()
        self.addCleanup(self.control.close)
        self.daemon = Daemon("--threads", "1", "--timeout", "1", "--drain-time", "2",
                             env=self.control.environment())
        self.addCleanup(self.end)

    def end(self):
        if self.daemon.process.poll() is None:
            self.daemon.process.kill()
        if not self.daemon.process.stderr.closed:
            self.daemon.wait()

    def ready(self):
        answer = self.daemon.call("GET", "/readyz", admin=True)
        return answer.status, answer.body.decode().strip()

    def stuck_workers(self):
        return self.daemon.metrics()["shaded_stuck_workers"]

    def hold(self):
        self.assertEqual((self.ready(), self.stuck_workers()), ((200, "ready"), 0))
        self.control.hold = 1
        answer = self.daemon.render(PNG)
        self.assertEqual(answer.status, 504)
        wait_until(lambda: self.ready() == (503, "stuck"))
        self.assertEqual(self.stuck_workers(), 1)
        told = self.daemon.wait_for("worker-stuck")
        self.assertEqual(told["request"], answer.headers["x-request-id"])

    def test_it_is_told_as_long_as_it_lasts(self):
        self.hold()
        self.control.hold = 0
        wait_until(lambda: self.ready() == (200, "ready"))
        self.assertEqual(self.stuck_workers(), 0)
        self.daemon.wait_for("worker-released")
        self.assertEqual(len(self.daemon.events("worker-stuck")), 1)
        wait_until(lambda: self.daemon.render(PNG).status == 200)
        self.daemon.signal()
        self.assertEqual(self.daemon.wait(), 0)

    def test_the_daemon_ends_without_it(self):
        self.hold()
        self.daemon.signal()
        self.assertEqual(self.daemon.wait(), 1)
        self.assertTrue(self.daemon.events("stuck"))

    def abandoned(self):
        return self.daemon.metrics()["shaded_abandoned_encodings"]

    def abandon(self):
        """As many as may be, on the one worker that there is."""
        self.control.hold = 1
        for count in (1, 2):
            self.assertEqual(self.daemon.render(WEBP).status, 504)
            wait_until(lambda: self.abandoned() == count)
            self.assertEqual(self.ready(), (200, "ready"))
        used = self.daemon.metrics()["shaded_memory_used_bytes"]
        self.assertEqual(self.daemon.render(WEBP).status, 504)
        self.assertEqual(self.abandoned(), 2)
        wait_until(lambda: self.daemon.render(JPEG).status == 200)
        return used

    def test_a_webp_is_abandoned(self):
        used = self.abandon()
        self.control.hold = 0
        wait_until(lambda: self.abandoned() == 0)
        # What was let go of may be among the spare pages of idle workers, 32 MB at most.
        spare = 32 << 20
        wait_until(lambda: self.daemon.metrics()["shaded_memory_used_bytes"] < used + spare)
        wait_until(lambda: self.daemon.render(WEBP).status == 200)
        self.assertFalse(self.daemon.events("worker-stuck"))

    def test_the_daemon_ends_without_what_is_abandoned(self):
        self.abandon()
        self.daemon.signal()
        self.assertEqual(self.daemon.wait(), 0)


if __name__ == "__main__":
    unittest.main()
