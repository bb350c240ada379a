"""More load than the daemon can take, from wrk, and slow attacks, from slowhttptest: who is refused is
told so at once, and nobody else is hurt.

    ./dev load [SECONDS]

For SHADED_LOAD seconds, a few without it; SHADED_LOAD_PAGE is where the results go."""

# ctest: serial

import json
import os
import subprocess
import time
import unittest
from pathlib import Path

from deploy.tools import environment, find
from e2e.daemon import SANITIZED, SMALL, SOURCE, Daemon, another

SECONDS = float(os.environ.get("SHADED_LOAD") or 4)
PAGE = os.environ.get("SHADED_LOAD_PAGE")
# What is offered, of what it can do; a third more is asked for, since clients wait for their answers.
TIMES = 10
# How fast it is counts for the page alone, made on a machine that does nothing else.
CONNECTIONS, QUEUE, TIMEOUT = 400, 64, 5 if PAGE else 600
SIDE = 96 if SANITIZED else 320
# Every one has another field of view: no answer is known, and nothing is shared.
SCENE = json.dumps({"objects": [{"type": "sphere", "material": {"specular": 0.5}}],
                    "lights": [{"position": [3, 3, 3, 1]}], "camera": {"fov": "FOV"},
                    "image": {"width": SIDE, "height": SIDE, "samples": 4}}).replace('"FOV"', "FOV")


def rss(daemon):
    """MiB."""
    pages = int(Path(f"/proc/{daemon.pid}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


class Wrk:
    """wrk, until it ends by itself; `pause` in milliseconds, `first` tells its scenes from others."""

    def __init__(self, daemon, seconds, connections, pause, first):
        self.process = subprocess.Popen(
            [find("wrk"), "-t", "1", "-c", str(connections), "-d", f"{max(1, round(seconds))}s",
             "--timeout", "500s", "-s", str(SOURCE / "tests/e2e/overload.lua"),
             "http://{}:{}".format(*daemon.address), "--", str(pause), SCENE, str(first)],
            stdout=subprocess.PIPE, env=environment(), text=True)

    def result(self):
        text, _ = self.process.communicate(timeout=600)
        if self.process.returncode:
            raise AssertionError(text)
        result = json.loads(text.strip().splitlines()[-1])
        result["total"] = sum(result["statuses"].values())
        return result


def check(test, result):
    test.assertLessEqual(set(result["statuses"]), {"200", "429"}, result)
    test.assertEqual(sum(result["errors"].values()), 0, result)


class OverloadTest(unittest.TestCase):
    def test_ten_times_what_it_can_do(self):
        find("wrk")
        with Daemon("--queue", str(QUEUE), "--timeout", str(TIMEOUT), "--max-connections-each", "0",
                    "--log-requests", "off") as daemon:
            self.assertEqual(daemon.render(SMALL).status, 200)
            alone = Wrk(daemon, min(SECONDS, 10) / 2, 8, 0.001, 0).result()
            check(self, alone)
            rate = max(1, alone["total"]) / alone["seconds"]
            wrk = Wrk(daemon, SECONDS, CONNECTIONS, 750 * CONNECTIONS / (TIMES * rate), 1e6)
            looks = []
            while wrk.process.poll() is None:
                looks.append(rss(daemon))
                time.sleep(min(1, SECONDS / 20))
            ended = time.monotonic()
            result = wrk.result()
            self.assertEqual(daemon.get("/readyz", admin=True).status, 200)
            self.assertEqual(daemon.render(another(SMALL)).status, 200)
            ready = time.monotonic() - ended
            check(self, result)
            # After a quarter in which caches fill.
            half = max(1, (len(looks) - len(looks) // 4) // 2)
            first, second = max(looks[-2 * half:-half] or looks), max(looks[-half:])
            self.assertLess(second, 1.1 * first + 16)
            print(f"alone {rate:.0f}/s; offered {result['total'] / result['seconds']:.0f}/s: "
                  f"{result}", flush=True)
            if PAGE:
                self.assertGreater(result["total"] / result["seconds"], TIMES / 3 * rate)
                self.assertGreater(result["statuses"].get("200", 0), 0)
                self.assertGreater(result["statuses"].get("429", 0), 0, "it was no overload")
                self.assertLess(result["p99"], TIMEOUT)
                self.assertLess(ready, 1)
                self.write(rate, result, ready, first, second)

    @staticmethod
    def write(rate, result, ready, first, second):
        accepted, refused = (result["statuses"][status] for status in ("200", "429"))
        text = (SOURCE / "docs/load.md").read_text()
        head = text[:text.index("## Results")]
        Path(PAGE).write_text(f"""{head}## Results

`./dev load {SECONDS:.0f}` on {os.cpu_count()} cores, which wrk shares; pictures of {SIDE} x {SIDE} pixels with 4 samples,
{CONNECTIONS} connections, a queue of {QUEUE}, a deadline of {TIMEOUT} s:

| | |
| --- | ---: |
| pictures a second, 8 connections alone | {rate:.0f} |
| requests a second, offered | {result['total'] / result['seconds']:.0f} |
| answered 200 | {accepted:,} ({accepted / result['seconds']:.0f} a second) |
| answered 429 | {refused:,} |
| other statuses, connections that failed | 0 |
| time of those answered 200, ms: median | {1000 * result['p50']:.0f} |
| 99 % | {1000 * result['p99']:.0f} |
| longest | {1000 * result['most']:.0f} |
| resident memory, MB: first half, second half | {first:.0f}, {second:.0f} |
| ready, and a picture rendered, after the end, ms | {1000 * ready:.0f} |
""")


class AttackTest(unittest.TestCase):
    """slowhttptest's attacks; what it says of the service is asked of the daemon itself."""

    ATTACKS = {"slow headers": ["-H"], "slow bodies": ["-B", "-s", "8192"],
               "ranges": ["-R", "-a", "0", "-b", "3000"],
               "slow reading": ["-X", "-w", "10", "-y", "20", "-n", "5", "-z", "32", "-k", "3"]}

    def test_the_others_are_served(self):
        attacker = find("slowhttptest")
        seconds = max(2, round(SECONDS / 8))
        for name, flags in self.ATTACKS.items():
            with self.subTest(name), Daemon("--max-connections", "200",
                                            "--max-connections-each", "0", "--log-requests",
                                            "off") as daemon:
                attack = subprocess.Popen(
                    [attacker, *flags, "-c", "400", "-r", "400", "-i", "1", "-p", "3", "-l",
                     str(seconds), "-u", "http://{}:{}/v1/materials".format(*daemon.address)],
                    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment())
                looks, crowd = [], 0
                while not looks or attack.poll() is None:
                    began = time.monotonic()
                    metrics = daemon.metrics()
                    looks.append(time.monotonic() - began)
                    crowd = max(crowd, sum(metrics[f'shaded_connections{{at="{at}"}}']
                                           for at in ("head", "body", "answer", "rest")))
                    self.assertEqual(daemon.render(another(SMALL, len(looks))).status, 200)
                    time.sleep(0.02)
                if PAGE:
                    # Of many looks a few may meet a busy machine.
                    self.assertLess(sorted(looks)[-1 - len(looks) // 10], 0.1)
                    if name.startswith("slow"):  # ranges are answered at once
                        self.assertGreater(crowd, 100, "it was no crowd")


if __name__ == "__main__":
    unittest.main()
