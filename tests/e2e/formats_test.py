"""An installation without OpenImageIO: what it cannot write is refused as the client's to change."""

import json
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from e2e.daemon import BUILD, SHADED, SMALL, Daemon, environment

MISSING = ("tiff", "exr", "hdr")


class WithoutOpenImageIO(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        # The module is looked for beside the programs: away from it there is none.
        cls.folder = tempfile.TemporaryDirectory()
        programs = [shutil.copy(program, cls.folder.name) for program in (SHADED, BUILD / "shade")]
        cls.shade = str(programs[1])
        cls.daemon = Daemon(program=str(programs[0]))

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()
        cls.folder.cleanup()

    def assert_refused(self, answer, status, detail):
        self.assertEqual(answer.status, status, answer.body[:300])
        problem = json.loads(answer.body)
        self.assertIn("OpenImageIO is not installed", problem["detail"])
        self.assertRegex(problem["detail"], detail)
        return problem

    def test_named_formats_are_refused_where_they_are_named(self):
        for name in MISSING:
            scene = {**SMALL, "output": {"format": name}}
            for path in ("/v1/render", "/v1/explain", "/v1/compare"):
                problem = self.assert_refused(self.daemon.post(path, scene), 422, name)
                self.assertEqual([e["pointer"] for e in problem["errors"]], ["/output/format"])
            outputs = [{"name": "a"}, {"name": "b", "format": name}]
            answer = self.daemon.render({**SMALL, "outputs": outputs})
            problem = self.assert_refused(answer, 422, name)
            self.assertEqual([e["pointer"] for e in problem["errors"]], ["/outputs/1/format"])
            link = self.daemon.get(f"/v1/preview/brass?size=16&format={name}")
            self.assert_refused(link, 400, "format")

    def test_accept_chooses_from_the_others(self):
        for accept, chosen in (("*/*", "image/png"), ("image/*", "image/png"),
                               ("image/x-exr, image/webp;q=0.1", "image/webp"),
                               ("image/tiff, */*;q=0.1", "image/png")):
            answer = self.daemon.render(SMALL, {"Accept": accept})
            self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, chosen))
        for accept in ("image/tiff", "image/exr", "image/x-exr, image/vnd.radiance"):
            self.assert_refused(self.daemon.render(SMALL, {"Accept": accept}), 406,
                                "image/png, image/jpeg, image/webp ")

    def test_the_version_lists_what_there_is(self):
        version = json.loads(self.daemon.get("/v1/version").body)
        self.assertEqual(version["formats"], ["png", "jpeg", "webp"])
        with Daemon() as whole:
            version = json.loads(whole.get("/v1/version").body)
            self.assertEqual(version["formats"], ["png", "jpeg", "webp", *MISSING])

    def test_the_command_line_says_the_same(self):
        scene = Path(self.folder.name, "scene.json")
        scene.write_text(json.dumps(SMALL))
        for name in MISSING:
            out = Path(self.folder.name, "out." + name)
            done = subprocess.run([self.shade, "render", str(scene), "-o", str(out)], text=True,
                                  capture_output=True, env=environment(), check=False, timeout=60)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(f"no {name} pictures are made here: OpenImageIO is not installed",
                          done.stderr)
            self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main()
