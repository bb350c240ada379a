"""An installation without OpenImageIO: what it cannot write is refused as the client's to change."""

import json
import os
import re
import resource
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from e2e.daemon import BUILD, SANITIZED, SHADED, SMALL, Daemon, environment
from e2e.daemon_test import wait_until

MISSING = ("tiff", "exr", "hdr")


def descriptors(daemon):
    return {int(name) for name in os.listdir(f"/proc/{daemon.pid}/fd")}


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
                                  capture_output=True, env=environment(), check=False, timeout=500)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(f"no {name} pictures are made here: OpenImageIO is not installed",
                          done.stderr)
            self.assertFalse(out.exists())


class WithoutItsLibraries(unittest.TestCase):
    """The module is there, but OpenImageIO itself is not: known once a picture asks for it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.install_programs()
        module = (BUILD / "shaded_oiio.so").read_bytes()
        self.assertIn(b"\0libOpenImageIO.so", module)
        (self.folder / "shaded_oiio.so").write_bytes(
            module.replace(b"\0libOpenImageIO.so", b"\0libOpenImageXX.so"))

    def install_programs(self):
        for program in (SHADED, BUILD / "shade"):
            shutil.copy(program, self.folder)

    def test_a_module_that_is_none_is_told_by_what_it_is_and_not_by_its_folders_name(self):
        self.folder = self.folder / "Cannot allocate memory"
        self.folder.mkdir()
        self.install_programs()
        (self.folder / "shaded_oiio.so").write_text("no module at all")
        with Daemon(program=str(self.folder / "shaded")) as daemon:
            for _ in range(2):
                answer = daemon.render({**SMALL, "output": {"format": "exr"}})
                self.assertEqual(answer.status, 422, answer.body)
                self.assertIn("OpenImageIO is not installed", json.loads(answer.body)["detail"])
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_is_as_without_the_module(self):
        with Daemon(program=str(self.folder / "shaded")) as daemon:
            outputs = {"outputs": [{"name": "a"}, {"name": "b", "format": "exr"}]}
            for scene, pointer in (({"output": {"format": "tiff"}}, "/output/format"),
                                   (outputs, "/outputs/1/format"), (outputs, "/outputs/1/format")):
                answer = daemon.render({**SMALL, **scene})
                self.assertEqual(answer.status, 422, answer.body)
                problem = json.loads(answer.body)
                self.assertIn("OpenImageIO is not installed", problem["detail"])
                self.assertEqual([e["pointer"] for e in problem["errors"]], [pointer])
            self.assertEqual(daemon.render(SMALL, {"Accept": "image/x-exr"}).status, 406)
            answer = daemon.render(SMALL, {"Accept": "image/tiff, */*;q=0.1"})
            self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/png"))

    def test_the_command_line_names_what_is_missing(self):
        (self.folder / "scene.json").write_text(json.dumps(SMALL))
        done = subprocess.run([self.folder / "shade", "render", "scene.json", "-o", "out.exr"],
                              cwd=self.folder, capture_output=True, env=environment(), text=True,
                              check=False, timeout=500)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("OpenImageIO is not installed: libOpenImageXX.so", done.stderr)
        self.assertFalse((self.folder / "out.exr").exists())


@unittest.skipIf(SANITIZED, "sanitizers take all addresses and descriptors of their own")
class NotNow(unittest.TestCase):
    """OpenImageIO cannot be loaded for want of something that there is again later."""

    EXR = {**SMALL, "output": {"format": "exr"}}

    def check_limit(self, kind, limit_of):
        with Daemon("--threads", "1") as daemon:
            before = descriptors(daemon)
            self.assertEqual(daemon.render(SMALL).status, 200)
            wait_until(lambda: descriptors(daemon) == before)
            usual = resource.prlimit(daemon.pid, kind)
            resource.prlimit(daemon.pid, kind, (limit_of(daemon), usual[1]))
            for _ in range(3):
                wait_until(lambda: descriptors(daemon) == before)
                refused = daemon.render(self.EXR)
                self.assertEqual(refused.status, 503, refused.body)
                self.assertEqual(json.loads(refused.body)["type"], "urn:shaded:problem:memory")
                self.assertIn("Retry-After", refused.headers)
            resource.prlimit(daemon.pid, kind, usual)
            self.assertEqual(daemon.render(self.EXR).status, 200)

    def test_for_want_of_memory_a_picture_is_refused_and_the_next_one_made(self):
        for room in (50, 300, 400):  # MB; loading takes 460
            self.check_limit(resource.RLIMIT_AS, lambda daemon, room=room: (room << 20) + int(
                re.search(r"VmSize:\s+(\d+)", Path(f"/proc/{daemon.pid}/status").read_text())[1]
            ) * 1024)

    def test_for_want_of_descriptors_a_picture_is_refused_and_the_next_one_made(self):
        def room_for_a_connection(daemon):
            return [n for n in range(1000) if n not in descriptors(daemon)][1]

        self.check_limit(resource.RLIMIT_NOFILE, room_for_a_connection)


if __name__ == "__main__":
    unittest.main()
