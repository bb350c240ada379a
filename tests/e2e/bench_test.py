"""The programs and the report of `./dev bench` still work; no time is looked at."""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path
from xml.etree import ElementTree

from daemon import BUILD, SOURCE, Daemon, environment

sys.path.insert(0, str(SOURCE / "tests/bench"))
import chart  # noqa: E402
import errors  # noqa: E402
import report  # noqa: E402
import scenes  # noqa: E402

STAGES = {"parse", "plan", "visibility", "shade", "color", "encode"}


def run(name, arguments, jobs):
    lines = "".join(json.dumps(job) + "\n" for job in jobs)
    return subprocess.run([BUILD / f"tests/bench_{name}", *arguments], input=lines.encode(),
                          capture_output=True, env=environment(), timeout=500, check=False)


def small(**more):
    return scenes.text(scenes.scene(scenes.lights(2, scenes.FADING), size=16, **more))


class BenchTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def answers(self, done):
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        return json.loads(done.stdout)

    def test_library_times_and_compares(self):
        picture = self.folder / "picture"
        timed, portable, compared = self.answers(run("library", ["2"], [
            {"text": small(), "save": str(picture)},
            {"text": small(), "kernel": "portable", "threads": 2, "format": "jpeg", "again": True},
            {"text": small(), "compare": True}]))
        for samples in (timed, portable):
            for name in STAGES | {"wall", "cpu", "tiles"}:
                self.assertEqual(len(samples[name]), 2, name)
            self.assertLessEqual(max(samples["tiles"]), max(samples["wall"]))
        self.assertEqual(picture.stat().st_size, timed["bytes"])
        self.assertEqual([tier["tier"] for tier in compared["compare"]["tiers"]],
                         ["draft", "standard", "exact"])

    def test_library_says_what_is_wrong(self):
        done = run("library", ["1"], [{"text": '{"objects": [{"type": "cube"}]}'}])
        self.assertEqual(done.returncode, 1)
        self.assertIn(b"/objects/0/type", done.stderr)

    def test_client_times_requests(self):
        with Daemon() as daemon:
            host, port = daemon.address
            first, again = self.answers(run("client", [host, str(port), "2"], [
                {"text": small(output={"format": "jpeg"})},
                {"text": small(material=scenes.REPAINTED), "again": True,
                 "save": str(self.folder / "picture")}]))
            for samples in (first, again):
                for name in STAGES | {"wall", "queue"}:
                    self.assertEqual(len(samples[name]), 2, name)
            data = (self.folder / "picture").read_bytes()
            self.assertTrue(data.startswith(b"\x89PNG"))
            self.assertEqual(len(data), again["bytes"])

    def test_every_request_is_new_unless_it_is_the_same_again(self):
        paths = [self.folder / str(i) for i in range(3)]
        document = scenes.scene(scenes.lights(1), size=64,
                                output={"format": "exr", "bitDepth": "float"})
        text = scenes.text(document).replace('"ambient": 0.1,', '"ambient": 0.@@@@@@,')
        jobs = [{"text": text, "save": str(path), "again": i == 2}
                for i, path in enumerate(paths)]
        self.answers(run("library", ["1"], jobs))
        one, other, same = (path.read_bytes() for path in paths)
        self.assertNotEqual(one, other)
        self.assertEqual(other, same)

    def test_errors_are_in_their_metrics(self):
        black, white = paths = [self.folder / name for name in ("black", "white")]
        self.answers(run("library", ["1"], [
            {"text": json.dumps({"objects": [], "background": value, "image": {"width": 2, "height": 2}, "output": {"bitDepth": 16}}),
             "save": str(path)} for value, path in enumerate(paths)]))
        self.assertEqual(errors.between(black, white, "code"), 65535)
        self.assertAlmostEqual(errors.between(black, white, "deltaE2000"), 100, places=3)
        self.assertEqual(errors.between(white, white, "deltaE2000"), 0)

    def test_the_pages_are_made_of_the_results(self):
        docs = SOURCE / "docs"
        reports = report.read(docs)
        self.assertTrue(reports)
        self.assertEqual(report.overview(reports), (docs / "speed-and-error.md").read_text())
        for one in reports:
            self.assertFalse(one.result["quick"])
            self.assertEqual(one.page(), (docs / "bench" / f"{one.slug}.md").read_text())
            if "front" in one.result:
                self.assertEqual(one.front_chart(),
                                 (docs / "bench" / f"{one.slug}-front.svg").read_text())

    def test_the_chart_places_time_error_and_names(self):
        def entry(seen, mean, plan, **asked):
            return {"seen": seen, "codes": {"mean": mean}, "plan_line": f"tier={plan}; x", **asked}

        front = [entry(4, 0, "exact", tier="exact", kernel="avx2"),
                 entry(2, 1e-5, "standard", tier="standard", kernel="avx2"),
                 entry(2, 1e-5, "standard", tier="draft", kernel="avx2"),
                 entry(1.5, 1e-3, "standard", metric="linear", most=0.01)]
        root = ElementTree.fromstring(chart.draw("<this>", front, [("that", 60, 0.1)]))
        svg = "{http://www.w3.org/2000/svg}"
        self.assertIn("<this>", root.find(f"{svg}title").text)
        self.assertIn("prefers-color-scheme: dark", root.find(f"{svg}style").text)
        words = [text.text for text in root.iter(f"{svg}text")]
        for word in ("exact", "standard, which draft renders as", "that", "maxError 0.01, linear"):
            self.assertIn(word, words)
        places = {}
        for path in root.iter(f"{svg}path"):
            if path.find(f"{svg}title") is not None:
                name = path.find(f"{svg}title").text.split(",")[0].split(":")[0]
                places[name] = [float(v) for v in path.get("transform")[10:-1].split()]
        order = ("maxError 0.01 linear", "standard", "exact", "that")
        self.assertEqual(sorted(places, key=lambda n: places[n][0]), list(order))
        self.assertEqual(sorted(places, key=lambda n: places[n][1]),
                         ["that", "maxError 0.01 linear", "standard", "exact"])


if __name__ == "__main__":
    unittest.main()
