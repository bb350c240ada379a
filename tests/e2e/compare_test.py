"""POST /v1/compare and `shade compare` from outside: answers, refusals, files."""

import json
import os
import signal
import subprocess
import unittest

from e2e.daemon import BUILD, SMALL, SOURCE, Daemon, wait_until_at_work
from e2e.daemon_test import Folder, wait_until
from e2e.queue_test import Client, occupied, wait_until_read

SHADE = str(BUILD / "shade")
TIERS = ["draft", "standard", "exact"]
LONG = {"objects": [{"type": "torus"}], "image": {"width": 4096, "height": 4096, "samples": 16},
        "lights": [{"type": "point", "position": [3, i, 3]} for i in range(32)]}
BAD = [b"{", b"", b"[1,]", b"{}", b'{"objects":[{"type":"sphere","radius":-1,"colour":1}]}',
       b'{"objects":[{"type":"none"}],"image":{"samples":0}}',
       b'{"objects":[],"image":{"width":100000,"height":100000}}',
       b'{"objects":[],"accuracy":{"tier":"none"}}', b'{"objects":[],"outputs":[]}',
       b'{"objects":[],"output":{"display":"none"}}',
       b'{"objects":[],"image":{"width":70000,"height":1},"output":{"format":"jpeg"}}']


def errors(answer):
    """The figures, which are those of any run; times are not."""
    return [tier["error"] for tier in answer["tiers"]]


class Http(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def compare(self, scene, headers=None):
        return self.daemon.post("/v1/compare", scene, headers)

    def test_the_answer_is_json_about_every_tier_and_not_to_be_stored(self):
        answer = self.compare(SMALL, {"X-Request-Id": "compared", "If-None-Match": "*"})
        self.assertEqual(answer.status, 200, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/json")
        self.assertEqual(answer.headers["Cache-Control"], "no-store")
        self.assertEqual(answer.headers["X-Request-Id"], "compared")
        self.assertIsNone(answer.headers["ETag"])
        told = json.loads(answer.body)
        self.assertEqual([tier["tier"] for tier in told["tiers"]], TIERS)
        self.assertEqual(told["image"], {"width": 16, "height": 12, "samples": 1})
        self.assertEqual(errors(told), errors(json.loads(self.compare(SMALL).body)))

    def test_json_is_all_that_it_speaks(self):
        for accept in ("application/json", "*/*", "application/*;q=0.1, text/html", None):
            headers = {"Accept": accept} if accept else {}
            self.assertEqual(self.compare(SMALL, headers).status, 200, accept)
        for accept in ("image/png", "multipart/form-data", "application/json;q=0"):
            answer = self.compare(SMALL, {"Accept": accept})
            self.assertEqual(answer.status, 406, accept)
            self.assertEqual(json.loads(answer.body)["type"], "urn:shaded:problem:not-acceptable")

    def test_bad_scenes_have_the_problems_of_render(self):
        for body in BAD:
            with self.subTest(body):
                one, other = self.daemon.render(body), self.compare(body)
                self.assertGreaterEqual(one.status, 400)
                self.assertEqual((one.status, one.body), (other.status, other.body))
                self.assertEqual(other.headers["Cache-Control"], "no-store")

    def test_warnings_are_told(self):
        scene = {**SMALL, "objects": [{"type": "sphere", "material": {"shininess": 2000}}]}
        warnings = [path(scene).headers.get_all("Shaded-Warning")
                    for path in (self.compare, self.daemon.render)]
        self.assertTrue(warnings[0])
        self.assertEqual(*warnings)

    def test_every_kind_of_output_is_compared(self):
        for change in ({"output": {"format": "exr", "layers": ["beauty", "normal", "light.0"]},
                        "lights": [{"position": [1, 1, 1, 0]}]},
                       {"outputs": [{"name": "a", "format": "jpeg"}, {"name": "b"}],
                        "background": None},
                       {"output": {"colorSpace": "HSV", "channel": "H"}},
                       {"output": {"format": "hdr"}}, {"workingSpace": "ACEScg"},
                       {"interpolation": "gouraud"}, {"background": None},
                       {"image": {"width": 40, "height": 30, "region": [3, 4, 5, 6]}}):
            with self.subTest(**change):
                answer = self.compare({**SMALL, **change})
                self.assertEqual(answer.status, 200, answer.body)
                told = json.loads(answer.body)
                self.assertLess(told["tiers"][-2]["error"]["linear"]["max"], 1e-5)
                if "region" in change.get("image", {}):
                    self.assertEqual((told["image"]["width"], told["image"]["height"]), (5, 6))

    def test_spectral_scenes_are_compared_with_rgb(self):
        """A pair of materials that look alike under D65 and not under A; RGB never tells them apart."""
        told = {}
        for name in ("a", "d65"):
            scene = json.loads((SOURCE / "api" / "examples" / f"metamers-{name}.json").read_text())
            scene["image"] = {"width": 60, "height": 30, "samples": 1}
            answer = self.compare(scene)
            self.assertEqual(answer.status, 200, answer.body)
            told[name] = json.loads(answer.body)["spectral"]
            self.assertEqual(told[name]["channels"], 16)
            illuminants = told[name]["illuminants"]
            pairs = {pair["illuminant"]: pair for pair in illuminants["each"]}
            self.assertEqual(len(pairs), 18)
            self.assertEqual(pairs["A"]["materials"], ["left", "right"])
            self.assertLess(pairs["D65"]["deltaE2000"], 0.01)
            self.assertGreater(pairs["A"]["deltaE2000"], 15)
            self.assertEqual(pairs["A"]["underD65"], pairs["D65"]["deltaE2000"])
            self.assertEqual(illuminants["worst"], max(
                illuminants["each"], key=lambda pair: pair["deltaE2000"] - pair["underD65"]))
        self.assertLess(told["d65"]["rgb"]["deltaE2000"]["max"], 0.5)
        self.assertGreater(told["a"]["rgb"]["deltaE2000"]["max"], 5)

    def test_illuminants_need_two_materials(self):
        told = json.loads(self.compare({**SMALL, "spectral": True}).body)
        self.assertIsNone(told["spectral"]["illuminants"])
        self.assertNotIn("spectral", json.loads(self.compare(SMALL).body))

    def test_it_is_counted_under_its_path(self):
        self.compare(SMALL)
        name = 'shaded_requests_total{route="/v1/compare",status="200"}'
        wait_until(lambda: self.daemon.metrics().get(name, 0) >= 1)

    def test_it_waits_its_turn(self):
        with Daemon("--threads", "1", "--queue", "1", "--timeout", "300") as daemon:
            clients = [occupied(daemon)]
            clients.append(Client(daemon, LONG))
            wait_until_read(daemon, 1)
            self.assertEqual(daemon.post("/v1/compare", SMALL).status, 429)
            for client in clients:
                client.leave()
            wait_until(lambda: daemon.metrics()["shaded_queue_depth"] == 0)
            self.assertEqual(daemon.post("/v1/compare", SMALL).status, 200)

    def test_it_ends_at_its_deadline(self):
        with Daemon("--timeout", "1") as daemon:
            answer = daemon.post("/v1/compare", LONG)
            self.assertEqual(answer.status, 504)
            self.assertIn("timeout", json.loads(answer.body)["detail"])


class Cli(Folder):
    def setUp(self):
        super().setUp()
        self.file(json.dumps(SMALL), "scene.json")

    def shade(self, *arguments, **options):
        return subprocess.run([SHADE, "compare", *arguments], cwd=self.folder, check=False,
                              capture_output=True, timeout=500, **options)

    def files(self):
        return sorted(os.listdir(self.folder))

    def test_json_goes_to_stdout_or_into_a_file(self):
        run = self.shade("scene.json")
        self.assertEqual((run.returncode, run.stderr), (0, b""))
        self.assertTrue(run.stdout.endswith(b"}\n"))
        told = json.loads(run.stdout)
        for arguments in (["-o", "-"], ["-o", "out.json"]):
            run = self.shade("-", *arguments, input=json.dumps(SMALL).encode())
            self.assertEqual((run.returncode, run.stderr), (0, b""))
            text = run.stdout or (self.folder / "out.json").read_bytes()
            self.assertEqual(errors(json.loads(text)), errors(told))
        self.assertEqual(self.files(), ["out.json", "scene.json"])

    def test_it_tells_what_http_tells(self):
        with Daemon() as daemon:
            remote = json.loads(daemon.post("/v1/compare", SMALL).body)
        local = json.loads(self.shade("scene.json").stdout)
        self.assertEqual(errors(local), errors(remote))
        self.assertEqual(set(local), set(remote))

    def test_any_number_of_threads_tells_the_same(self):
        told = [errors(json.loads(self.shade("scene.json", "--threads", n).stdout))
                for n in ("1", "3")]
        self.assertEqual(*told)

    def test_bad_scenes_are_1_and_told_as_by_check(self):
        for body in BAD:
            (self.folder / "scene.json").write_bytes(body)
            run = self.shade("scene.json", "-o", "out.json")
            check = subprocess.run([SHADE, "check", "scene.json"], cwd=self.folder, check=False,
                                   capture_output=True, timeout=500)
            self.assertEqual((run.returncode, run.stdout), (1, b""), body)
            self.assertEqual((check.returncode, check.stderr), (1, run.stderr))
        self.assertEqual(self.files(), ["scene.json"])

    def test_missing_and_unwritable_files_are_1(self):
        self.assertEqual(self.shade("nowhere.json").returncode, 1)
        run = self.shade("scene.json", "-o", "nowhere/out.json")
        self.assertEqual(run.returncode, 1)
        self.assertIn(b"nowhere/out.json", run.stderr)
        self.assertEqual(self.shade("scene.json", "-o", "/dev/full").returncode, 1)

    def test_wrong_command_lines_are_2(self):
        for arguments in ([], ["scene.json", "scene.json"], ["scene.json", "-o", ""],
                          ["scene.json", "-o", "."], ["scene.json", "-o", "new/"]):
            run = self.shade(*arguments)
            self.assertEqual(run.returncode, 2, run.stderr)
            self.assertIn(b"--help", run.stderr)

    def test_an_interrupt_ends_it(self):
        (self.folder / "scene.json").write_text(json.dumps(LONG))
        process = subprocess.Popen([SHADE, "compare", "scene.json", "-o", "out.json"],
                                   cwd=self.folder, stderr=subprocess.PIPE)
        wait_until_at_work(process)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=500)
        self.assertEqual(process.returncode, -signal.SIGINT)
        self.assertEqual(self.files(), ["scene.json"])


if __name__ == "__main__":
    unittest.main()
