"""The command line from outside: exit status, messages, files, pipes, a terminal."""

import errno
import json
import os
import pty
import re
import resource
import select
import signal
import struct
import subprocess
import tempfile
import unittest
from pathlib import Path

from daemon import BUILD, PATIENCE, SANITIZED, SMALL, Daemon, wait_until_at_work

SHADE = str(BUILD / "shade")

# Is given up long before its end.
LONG = {"objects": [{"type": "torus"}], "accuracy": {"tier": "exact"},
        "lights": [{"type": "point", "position": [3, i, 3]} for i in range(32)],
        "image": {"width": 4096, "height": 4096, "samples": 16}}


def sized(side):
    return dict(LONG, image={"width": side, "height": side, "samples": 16})


SIGNATURES = {"png": b"\x89PNG\r\n", "jpg": b"\xff\xd8\xff", "jpeg": b"\xff\xd8\xff",
              "webp": b"RIFF", "tif": b"II*\0", "tiff": b"II*\0", "exr": b"v/1\x01",
              "hdr": b"#?RADIANCE"}


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def scene(self, document, name="scene.json"):
        text = document if isinstance(document, str) else json.dumps(document)
        (self.folder / name).write_text(text)
        return name

    def shade(self, *arguments, **options):
        options.setdefault("timeout", PATIENCE)
        return subprocess.run([SHADE, *arguments], cwd=self.folder, capture_output=True,
                              check=False, **options)

    def assert_fails(self, run, status, *words):
        message = run.stderr.decode()
        self.assertEqual(run.returncode, status, message)
        for word in words:
            self.assertIn(word, message)

    def files(self):
        return sorted(p.name for p in self.folder.iterdir() if p.suffix != ".json")


class Check(Case):
    def test_good_scene_is_silent(self):
        run = self.shade("check", self.scene(SMALL))
        self.assertEqual((run.returncode, run.stdout, run.stderr), (0, b"", b""))

    def test_syntax_error_names_line_and_column(self):
        run = self.shade("check", self.scene('{\n  "objects": [}\n'))
        self.assertEqual(run.returncode, 1)
        self.assertRegex(run.stderr.decode(), r"\Ascene\.json:2:\d+: (?!line ).+\n\Z")

    def test_every_problem_is_a_line_with_its_pointer(self):
        bad = dict(SMALL, objects=[{"type": "sphere", "radius": -1}, {"type": "sfere"}])
        run = self.shade("check", self.scene(bad))
        lines = run.stderr.decode().splitlines()
        self.assertEqual(run.returncode, 1)
        self.assertEqual(len(lines), 2)
        self.assertTrue(lines[0].startswith("scene.json: /objects/0/radius: "), lines)
        self.assertTrue(lines[1].startswith("scene.json: /objects/1/type: "), lines)

    def test_control_characters_of_names_are_escaped(self):
        run = self.shade("check", self.scene(dict(SMALL, **{"a\n\x1b[31mb": 1})))
        self.assertEqual(run.returncode, 1)
        self.assertNotIn(b"\x1b", run.stderr)
        self.assertEqual(run.stderr.count(b"\n"), 1, run.stderr)

    def test_warnings_are_marked_and_do_not_fail(self):
        material = {"diffuse": 0.9, "specular": 0.9, "shininess": 2}
        run = self.shade("check", self.scene(dict(SMALL, objects=[
            {"type": "sphere", "material": material}])))
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertRegex(run.stderr.decode(), r"(?m)\Awarning: scene\.json: /objects/0/material")

    def test_several_scenes_fail_together(self):
        good, bad = self.scene(SMALL, "good.json"), self.scene("{}", "bad.json")
        self.assert_fails(self.shade("check", good, bad, good), 1, "bad.json: ")

    def test_scene_from_stdin(self):
        run = self.shade("check", "-", input=b"[")
        self.assert_fails(run, 1, "stdin:1:")

    def test_missing_file(self):
        self.assert_fails(self.shade("check", "nowhere.json"), 1, "nowhere.json", "No such file")

    def test_messages_are_those_of_http(self):
        document = json.dumps({"objects": [{"type": "sphere", "radius": -1, "colour": 1}],
                               "camera": {"fov": 180}, "lights": [{"type": "spot", "angle": 0}]})
        run = self.shade("check", self.scene(document))
        local = [line.removeprefix("scene.json: ") for line in run.stderr.decode().splitlines()]
        with Daemon() as daemon:
            problem = json.loads(daemon.render(document).body)
        remote = [f"{e['pointer']}: {e['detail']}" for e in problem["errors"]]
        self.assertGreaterEqual(len(local), 4)
        self.assertEqual(local, remote)


class Usage(Case):
    def test_wrong_command_lines(self):
        scene = self.scene(SMALL)
        for arguments in ([], ["paint"], ["render"], ["render", scene], ["check"],
                          ["render", scene, scene, "-o", "a.png"], ["render", scene, "-o", ""],
                          ["render", scene, "-o", "a.png", "-o", "b.png"],
                          ["render", scene, "-o", "a.bmp"], ["check", scene, "-o", "a.png"],
                          ["render", scene, "-o"], ["check", scene, "--wrong"],
                          ["check", scene, "--threads", "0"],
                          ["check", scene, "--threads", "-1"],
                          ["check", scene, "--threads", "2x"]):
            with self.subTest(arguments=arguments):
                run = self.shade(*arguments)
                self.assert_fails(run, 2, "shade: ", "--help")
                self.assertEqual(self.files(), [])

    def test_help_and_version(self):
        run = self.shade("--help")
        self.assertEqual((run.returncode, run.stderr), (0, b""))
        for word in (b"render", b"compare", b"check", b"--threads", b"--kernel", b"--ocio", b"Exit status"):
            self.assertIn(word, run.stdout)
        run = self.shade("--version")
        self.assertRegex(run.stdout.decode(), r"\Ashade \d+\.\d+\.\d+\n\Z")

    def test_options_may_stand_anywhere(self):
        scene = self.scene(SMALL)
        environment = dict(os.environ, POSIXLY_CORRECT="1")
        for arguments in (["--threads", "1", "render", scene, "-oa.png"],
                          ["render", "--output=a.png", scene], ["render", "-o", "a.png", "--", scene]):
            with self.subTest(arguments=arguments):
                run = self.shade(*arguments, env=environment)
                self.assertEqual(run.returncode, 0, run.stderr)
                (self.folder / "a.png").unlink()

    def test_bad_color_configuration(self):
        (self.folder / "bad.ocio").write_text("ocio_profile_version: 9\n")
        run = self.shade("check", self.scene(SMALL), "--ocio", "bad.ocio")
        self.assert_fails(run, 1, "bad.ocio")

    def test_files_of_materials(self):
        entry = {"group": "house", "source": "ours", "material": {"diffuse": 0.5}}
        for name, material in (("a", entry), ("b", entry), ("bad", {**entry, "group": 1})):
            (self.folder / f"{name}.json").write_text(json.dumps({"materials": {name: material}}))
        scene = self.scene(json.dumps({"objects": [{"type": "sphere", "material": "a"},
                                                   {"type": "sphere", "material": "b"}]}))
        self.assert_fails(self.shade("check", scene, "--materials", "a.json"), 1, "no material")
        self.assertEqual(self.shade("check", scene, "--materials", "a.json", "--materials", "b.json").returncode, 0)
        self.assert_fails(self.shade("check", scene, "--materials", "bad.json"), 1, "bad.json: /materials/bad/group")


class Render(Case):
    def test_suffix_chooses_the_format(self):
        scene = self.scene(SMALL)
        for suffix, signature in SIGNATURES.items():
            for spelled in (suffix, suffix.upper()):
                with self.subTest(suffix=spelled):
                    run = self.shade("render", scene, "-o", f"out.{spelled}")
                    self.assertEqual((run.returncode, run.stderr), (0, b""))
                    data = (self.folder / f"out.{spelled}").read_bytes()
                    self.assertTrue(data.startswith(signature), data[:10])

    def test_named_format_must_agree_with_suffix(self):
        scene = self.scene(dict(SMALL, output={"format": "jpeg"}))
        self.assertEqual(self.shade("render", scene, "-o", "a.jpg").returncode, 0)
        # Told before the work is done, not after it.
        scene = self.scene(dict(LONG, output={"format": "jpeg"}))
        self.assert_fails(self.shade("render", scene, "-o", "b.png"), 2, "jpeg", "b.png")
        self.assertEqual(self.files(), ["a.jpg"])

    def test_name_without_suffix_leaves_the_format_to_the_scene(self):
        self.shade("render", self.scene(SMALL), "-o", "plain")
        self.assertTrue((self.folder / "plain").read_bytes().startswith(SIGNATURES["png"]))
        self.shade("render", self.scene(dict(SMALL, output={"format": "jpeg"})), "-o", "plain")
        self.assertTrue((self.folder / "plain").read_bytes().startswith(SIGNATURES["jpg"]))

    def test_stdin_to_stdout(self):
        run = self.shade("render", "-", "-o", "-", input=json.dumps(SMALL).encode())
        self.assertEqual((run.returncode, run.stderr), (0, b""))
        self.assertTrue(run.stdout.startswith(SIGNATURES["png"]))
        self.assertEqual(struct.unpack(">II", run.stdout[16:24]), (16, 12))

    def test_any_number_of_threads_gives_the_same_bytes(self):
        scene = self.scene(dict(SMALL, image={"width": 200, "height": 150}))
        pictures = {self.shade("render", scene, "-o", "-", "--threads", n).stdout
                    for n in ("1", "2", "7")}
        self.assertEqual(len(pictures), 1)

    def test_any_kernel_gives_the_same_bytes(self):
        scene = self.scene(dict(SMALL, image={"width": 60, "height": 50},
                                accuracy={"tier": "exact"}))
        pictures = {self.shade("render", scene, "-o", "-", "--kernel", name).stdout
                    for name in ("auto", "portable")}
        self.assertEqual(len(pictures), 1)
        run = self.shade("render", scene, "-o", "-", "--kernel", "avx3")
        self.assert_fails(run, 1, "avx3")

    def test_bad_scene_writes_nothing(self):
        run = self.shade("render", self.scene({"objects": [{"type": "cube"}]}), "-o", "a.png")
        self.assert_fails(run, 1, "scene.json: /objects/0/type: ")
        self.assertEqual(self.files(), [])

    def test_outputs_fill_a_directory(self):
        scene = self.scene(dict(SMALL, outputs=[{"name": "first", "format": "png"},
                                                {"name": "second", "format": "exr"}]))
        run = self.shade("render", scene, "-o", "new/")
        self.assertEqual((run.returncode, run.stderr), (0, b""))
        self.assertEqual(sorted(p.name for p in (self.folder / "new").iterdir()),
                         ["first.png", "second.exr"])
        self.assertEqual(self.shade("render", scene, "-o", "new").returncode, 0)
        for target in ("file.png", "-"):
            self.assert_fails(self.shade("render", scene, "-o", target), 2, "directory")
        self.assert_fails(self.shade("render", self.scene(SMALL), "-o", "new"), 2, "directory")


class Files(Case):
    def setUp(self):
        super().setUp()
        self.picture = self.folder / "a.png"

    def test_replaced_file_keeps_its_rights_and_its_links(self):
        self.picture.write_text("old")
        self.picture.chmod(0o640)
        (self.folder / "link.png").symlink_to("a.png")
        run = self.shade("render", self.scene(SMALL), "-o", "link.png")
        self.assertEqual(run.returncode, 0, run.stderr)
        self.assertTrue((self.folder / "link.png").is_symlink())
        self.assertTrue(self.picture.read_bytes().startswith(SIGNATURES["png"]))
        self.assertEqual(self.picture.stat().st_mode & 0o777, 0o640)

    def test_failed_write_leaves_the_old_file_and_nothing_else(self):
        self.picture.write_text("old")

        def allow_small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (50, 50))

        run = self.shade("render", self.scene(SMALL), "-o", "a.png",
                         preexec_fn=allow_small_files)
        self.assert_fails(run, 1, "cannot write 'a.png'", os.strerror(errno.EFBIG))
        self.assertEqual(self.picture.read_text(), "old")
        self.assertEqual(self.files(), ["a.png"])

    def test_failed_output_leaves_the_others_unwritten(self):
        scene = self.scene(dict(SMALL, image={"width": 64, "height": 48}, outputs=[
            {"name": "small", "format": "jpeg", "quality": 10},
            {"name": "large", "format": "tiff", "bitDepth": "float"}]))

        def allow_small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))

        run = self.shade("render", scene, "-o", "new/", preexec_fn=allow_small_files)
        self.assert_fails(run, 1, "large.tiff")
        self.assertEqual(list((self.folder / "new").iterdir()), [])

    def test_full_disk_is_an_error(self):
        scene = self.scene(SMALL)
        self.assert_fails(self.shade("render", scene, "-o", "/dev/full"), 1, "No space left")
        with open("/dev/full", "wb") as full:
            run = subprocess.run([SHADE, "render", scene, "-o", "-"], cwd=self.folder,
                                 stdout=full, stderr=subprocess.PIPE, check=False)
        self.assert_fails(run, 1, "stdout", "No space left")
        with open("/dev/full", "wb") as full:
            run = subprocess.run([SHADE, "--help"], stdout=full, stderr=subprocess.PIPE,
                                 check=False)
        self.assert_fails(run, 1, "stdout")

    def test_closed_stdout_is_an_error(self):
        scene = self.scene(SMALL)
        run = subprocess.run(["/bin/sh", "-c", 'exec "$0" render "$1" -o - >&-', SHADE, scene],
                             cwd=self.folder, stderr=subprocess.PIPE, check=False)
        self.assert_fails(run, 1, "stdout")

    def test_reader_that_went_away_is_an_error(self):
        reading, writing = os.pipe()
        os.close(reading)
        run = subprocess.run([SHADE, "render", self.scene(SMALL), "-o", "-"], cwd=self.folder,
                             stdout=writing, stderr=subprocess.PIPE, check=False)
        os.close(writing)
        self.assert_fails(run, 1, "stdout", "Broken pipe")

    def test_missing_folder_is_told(self):
        run = self.shade("render", self.scene(LONG), "-o", "nowhere/a.png")
        self.assert_fails(run, 1, "nowhere/a.png", "No such file")

    def test_interrupt_leaves_nothing(self):
        process = subprocess.Popen([SHADE, "render", self.scene(LONG), "-o", "a.png"],
                                   cwd=self.folder, stderr=subprocess.PIPE)
        wait_until_at_work(process)
        process.send_signal(signal.SIGINT)
        process.communicate(timeout=500)
        self.assertEqual(process.returncode, -signal.SIGINT)
        self.assertEqual(self.files(), [])


class Terminal(Case):
    def on_terminal(self, *arguments):
        """Runs shade with stderr on a terminal of its own; exit status and what it showed."""
        outer, inner = pty.openpty()
        process = subprocess.Popen([SHADE, *arguments], cwd=self.folder, stderr=inner,
                                   stdout=subprocess.DEVNULL)
        os.close(inner)
        shown = b""
        while select.select([outer], [], [], PATIENCE)[0]:
            try:
                chunk = os.read(outer, 4096)
            except OSError:  # the other end is closed
                break
            if not chunk:
                break
            shown += chunk
        os.close(outer)
        return process.wait(PATIENCE), shown.decode()

    def test_long_picture_shows_one_line_and_wipes_it(self):
        # Whatever the machine's speed, one of these is long.
        for side in (512, 1024, 2048, 4096):
            status, shown = self.on_terminal("render", self.scene(sized(side)), "-o", "a.png")
            self.assertEqual(status, 0, shown)
            if shown.count("%") > 3:
                break
        self.assertRegex(shown, r"\r\[#* *\] +\d+ %")
        self.assertNotIn("\n", shown)
        self.assertTrue(shown.endswith("\r\x1b[K"), repr(shown[-20:]))
        shares = [int(n) for n in re.findall(r"(\d+) %", shown)]
        self.assertEqual(shares, sorted(shares))

    def test_short_picture_shows_nothing(self):
        if SANITIZED:
            self.skipTest("sanitizers make no picture short")
        for _ in range(9):  # on a busy machine not each is short
            status, shown = self.on_terminal("render", self.scene(SMALL), "-o", "a.png")
            self.assertEqual(status, 0, shown)
            if not shown:
                return
        self.fail(shown)

    def test_no_bar_without_terminal(self):
        run = self.shade("render", self.scene(sized(1500)), "-o", "a.png")
        self.assertEqual((run.returncode, run.stderr), (0, b""))


class Libraries(Case):
    def loaded(self, *arguments):
        """What the dynamic linker says that it loads."""
        run = self.shade(*arguments, env=dict(os.environ, LD_DEBUG="libs"))
        self.assertEqual(run.returncode, 0)
        return run.stderr.decode(errors="replace")

    def test_openimageio_stays_away(self):
        scene = self.scene(SMALL)
        for arguments in (["check", scene], ["render", scene, "-o", "a.png"],
                          ["render", scene, "-o", "a.jpg"]):
            with self.subTest(arguments=arguments):
                libraries = self.loaded(*arguments)
                self.assertIn("libOpenColorIO", libraries)
                self.assertNotIn("OpenImageIO", libraries)
                self.assertNotIn("shaded_oiio", libraries)
                self.assertNotIn("assimp", libraries)

    def test_openimageio_comes_for_exr(self):
        self.assertIn("libOpenImageIO", self.loaded("render", self.scene(SMALL), "-o", "a.exr"))


if __name__ == "__main__":
    unittest.main()
