"""What an operator does while the daemon has all that it can take: nobody else notices."""

# ctest: serial

import json
import signal
import subprocess
import tempfile
import threading
import time
import unittest

from deploy.tools import environment, find
from e2e.daemon import Daemon
from e2e.daemon_test import wait_until
from e2e.overload_test import SCENE, Wrk, check
from e2e.queue_test import encoded


class LoadTest(unittest.TestCase):
    def test_reloads_under_load_disturb_nobody(self):
        find("wrk")
        with Daemon("--log-requests", "off", "--timeout", "600") as daemon:
            wrk = Wrk(daemon, 3, 16, 0.001, 2e6)
            reloads = 0
            while wrk.process.poll() is None:
                daemon.signal(signal.SIGHUP)
                reloads += 1
                time.sleep(0.2)
            check(self, wrk.result())
            self.assertGreater(reloads, 0)

    def test_sigterm_at_full_load_fails_nothing_that_was_accepted(self):
        daemon = Daemon("--queue", "16", "--timeout", "600", "--drain-time", "600")
        answers, lock, over = [], threading.Lock(), threading.Event()

        def work(client):
            for count in range(1000000):
                if over.is_set():
                    return
                scene = {**json.loads(SCENE.replace("FOV", f"{40 + client + count * 1e-6:.6f}"))}
                try:
                    status = daemon.render(scene).status
                except OSError:
                    status = 0
                with lock:
                    answers.append(status)

        clients = [threading.Thread(target=work, args=(client,)) for client in range(32)]
        for client in clients:
            client.start()
        wait_until(lambda: answers.count(200) > 20)
        daemon.signal()
        self.assertEqual(daemon.wait(), 0, daemon.stderr()[-2000:])
        over.set()
        for client in clients:
            client.join()
        self.assertLessEqual(set(answers), {200, 429, 503, 0})
        # Who came too late got no answer (0), or was told so (503), perhaps by half: the end does not
        # wait for those. Of the others each one has its answer.
        told = [event for event in daemon.events("request") if event["status"] != 503]
        self.assertEqual([event for event in told if event.get("aborted")], [])
        for status in (200, 429):
            self.assertEqual(answers.count(status),
                             sum(event["status"] == status for event in told), status)

    def test_a_crowd_that_wants_the_same_costs_what_one_costs(self):
        """h2load's clients, each of which sends several requests before it reads an answer."""
        requests, clients = 2000, 100
        with tempfile.NamedTemporaryFile("w") as scene, \
                Daemon("--log-requests", "off", "--queue", "2", "--timeout", "600") as daemon:
            scene.write(SCENE.replace("FOV", "45"))
            scene.flush()
            done = subprocess.run(
                [find("h2load"), "--h1", "-n", str(requests), "-c", str(clients), "-m", "4",
                 "-d", scene.name, "-H", "Content-Type: application/json",
                 "http://{}:{}/v1/render".format(*daemon.address)], env=environment(),
                capture_output=True, text=True, timeout=500, check=True)
            self.assertIn(f"{requests} succeeded, 0 failed, 0 errored, 0 timeout", done.stdout)
            self.assertIn(f"status codes: {requests} 2xx", done.stdout)
            # Not those that found it kept, nor those that waited with another one.
            self.assertLess(encoded(daemon), requests / 20)


if __name__ == "__main__":
    unittest.main()
