"""What `cmake --install` puts somewhere works there: the programs, the library with its headers, manuals,
completions and the service; and nothing of the tests is among it."""

import gzip
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from deploy.tools import SOURCE, find, run
from e2e.daemon import BUILD, Daemon, environment

PREFIX = "opt/pictures"  # below DESTDIR
PROGRAM = r"""
#include <shaded.h>
#include <stdio.h>
#include <string.h>
int main(int argc, char **argv) {
    shd_engine *engine;
    shd_request *request;
    shd_error error;
    shd_engine_options options = shd_engine_defaults();
    if (argc != 3 || shd_engine_new(&options, &engine, &error)) return 1;
    if (shd_request_new(engine, &request, &error)) return 2;
    shd_format format;
    if (!shd_format_find(argv[2], &format)) return 3;
    if (shd_request_read(request, argv[1], strlen(argv[1]), format)) return 4;
    if (shd_request_render(request, NULL, &error)) return fprintf(stderr, "%s\n", error.text), 5;
    size_t count;
    const shd_picture *pictures = shd_request_pictures(request, &count);
    fwrite(pictures[0].data, 1, pictures[0].size, stdout);
    shd_request_drop(request);
    shd_engine_drop(engine);
    return 0;
}
"""
SCENE = json.dumps({"objects": [{"type": "sphere"}], "image": {"width": 16, "height": 16}})


def plain(roff):
    """The text of a manual page, as far as its words go."""
    return re.sub(r"\\f[BIRP]|\\&", "", roff).replace("\\-", "-").replace("\\e", "\\")


def help_of(program):
    return subprocess.run([BUILD / program, "--help"], capture_output=True, text=True,
                          check=True).stdout


def flags_of(program):
    """Those that the help lists at the beginning of a line."""
    lines = re.findall(r"^ {2,6}(-.*?)(?:  |$)", help_of(program), re.MULTILINE)
    return re.findall(r"(?<![\w-])--?[a-zA-Z][a-z-]*", " ".join(lines))


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        subprocess.run(["cmake", "--install", BUILD, "--prefix", f"/{PREFIX}"], check=True,
                       env={**os.environ, "DESTDIR": folder.name}, capture_output=True)
        cls.prefix = cls.folder / PREFIX
        cls.files = {str(path.relative_to(cls.prefix)) for path in cls.prefix.rglob("*")
                     if not path.is_dir()}


class TreeTest(Installed):
    def test_all_is_below_the_prefix_and_nothing_is_of_the_tests(self):
        self.assertEqual([path.name for path in self.folder.iterdir()], ["opt"])
        for name in self.files:
            self.assertNotRegex(name, r"test|cmocka|\.a$|bench_|fuzz_", name)

    def test_what_people_look_for_is_there(self):
        library = next(name for name in self.files if name.endswith("/libshaded.so"))[:-len("libshaded.so")]
        wanted = {"bin/shaded", "bin/shade", "lib/shaded/shaded_oiio.so", "lib/shaded/shaded_import.so", "lib/shaded/shaded-decode",
                  f"{library}libshaded.so.0",
                  f"{library}pkgconfig/shaded.pc", "include/shaded/shaded.h",
                  "share/man/man1/shaded.1.gz", "share/man/man1/shade.1.gz",
                  "share/man/man5/shaded.conf.5.gz", "share/bash-completion/completions/shaded",
                  "share/bash-completion/completions/shade", "share/zsh/site-functions/_shade",
                  "lib/systemd/system/shaded.service", "lib/systemd/system/shaded.socket",
                  "lib/systemd/system/shaded-admin.socket", "lib/sysusers.d/shaded.conf",
                  "etc/shaded/shaded.conf", "etc/default/shaded", "share/shaded/materials.json",
                  "share/doc/shaded/README.md", "share/doc/shaded/docs/operating.md"}
        self.assertEqual(wanted - self.files, set())

    def test_the_daemon_that_is_installed_draws(self):
        configuration = self.prefix / "etc/shaded/shaded.conf"
        with Daemon("--config", str(configuration), program=str(self.prefix / "bin/shaded")) as daemon:
            for kind, magic in (("png", b"\x89PNG"), ("x-exr", b"v/1\x01")):
                answer = daemon.render(SCENE, {"Accept": f"image/{kind}"})
                self.assertEqual((answer.status, answer.body[:4]), (200, magic), answer.body[:300])

    def test_the_materials_are_those_that_are_built_in(self):
        done = subprocess.run([self.prefix / "bin/shade", "check", "-"], input=SCENE, text=True,
                              capture_output=True, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual((self.prefix / "share/shaded/materials.json").read_bytes(),
                         (SOURCE / "config/materials.json").read_bytes())

    def test_the_service_names_what_is_installed(self):
        unit = (self.prefix / "lib/systemd/system/shaded.service").read_text()
        self.assertIn(f"\nExecStart=/{PREFIX}/bin/shaded\n", unit)
        self.assertIn(f"\nEnvironmentFile=-/{PREFIX}/etc/default/shaded\n", unit)
        self.assertIn(f"\nSHADED_CONFIG=/{PREFIX}/etc/shaded/shaded.conf\n",
                      (self.prefix / "etc/default/shaded").read_text())

    def test_the_service_of_usr_has_etc(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["cmake", "--install", BUILD, "--prefix", "/usr", "--component", "service"],
                           check=True, env={**os.environ, "DESTDIR": folder}, capture_output=True)
            for name in ("systemd/shaded.service", "package/default"):
                there = {"systemd/shaded.service": "usr/lib/systemd/system/shaded.service",
                         "package/default": "etc/default/shaded"}[name]
                self.assertEqual(Path(folder, there).read_text(), (SOURCE / "deploy" / name).read_text())
            self.assertTrue(Path(folder, "etc/shaded/shaded.conf").is_file())

    def test_the_user_is_made(self):
        os.makedirs(self.folder / "root/etc", exist_ok=True)
        self.addCleanup(shutil.rmtree, self.folder / "root")
        run("systemd-sysusers", f"--root={self.folder}/root",
            self.prefix / "lib/sysusers.d/shaded.conf")
        self.assertRegex((self.folder / "root/etc/passwd").read_text(), r"(?m)^shaded:x:\d+:\d+:")


class LibraryTest(Installed):
    """A program of somebody else's, made with what pkg-config tells."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.libraries = next(cls.prefix.rglob("libshaded.so")).parent

    def pkg_config(self, *words):
        return run("pkg-config", *words, "shaded",
                   PKG_CONFIG_PATH=str(self.libraries / "pkgconfig")).split()

    def test_a_program_renders_all_formats(self):
        source, program = self.folder / "five.c", self.folder / "five"
        source.write_text(PROGRAM)
        self.addCleanup(source.unlink)
        run("cc", "-std=c11", "-Wall", "-Wextra", "-Wpedantic", "-Werror", source, "-o", program,
            *self.pkg_config("--cflags", "--libs"))
        self.addCleanup(program.unlink)
        version = run(BUILD / "shaded", "--version").split()[-1]
        self.assertEqual(self.pkg_config("--modversion"), [version])
        for name, magic in (("png", b"\x89PNG"), ("exr", b"v/1\x01")):
            done = subprocess.run([program, SCENE, name], capture_output=True, check=False,
                                  env=environment(LD_LIBRARY_PATH=str(self.libraries)))
            self.assertEqual((done.returncode, done.stdout[:4]), (0, magic), done.stderr)
            expected = subprocess.run([BUILD / "shade", "render", "-", "-o", f"{self.folder}/a.{name}"],
                                      input=SCENE.encode(), capture_output=True, check=False)
            self.assertEqual(expected.returncode, 0, expected.stderr)
            picture = self.folder / f"a.{name}"
            self.assertEqual(done.stdout, picture.read_bytes())
            picture.unlink()

    def test_each_header_stands_alone(self):
        for header in sorted((self.prefix / "include/shaded").rglob("*.h")):
            with self.subTest(header.name):
                run("cc", "-std=c11", "-fsyntax-only", "-Wall", "-Wextra", "-Werror",
                    *self.pkg_config("--cflags"), "-include", header, "-x", "c", "/dev/null")

    def test_it_shows_what_the_public_headers_declare_and_nothing_else(self):
        shown = set(re.findall(r" [TRDB] (\w+)@@SHADED_0$", run("nm", "-D", "--defined-only",
                                                               self.libraries / "libshaded.so"), re.M))
        declared = {"shd_limit_names"}
        for header in ("shaded.h", "base/budget.h", "base/digest.h", "base/format.h"):
            text = re.sub(r"/\*.*?\*/", "", (self.prefix / "include/shaded" / header).read_text(),
                          flags=re.DOTALL)
            declared |= set(re.findall(r"^(?!typedef|static).*?\b(shd_\w+)\(", text, re.MULTILINE))
        self.assertEqual(shown, declared)
        self.assertGreater(len(shown), 60)


class ManualTest(Installed):
    PAGES = ("man1/shaded.1", "man1/shade.1", "man5/shaded.conf.5")

    def page(self, name):
        with gzip.open(self.prefix / "share/man" / f"{name}.gz", "rt") as file:
            return file.read()

    def test_each_flag_is_in_its_page(self):
        for program, least in (("shaded", 35), ("shade", 9)):
            headings = re.findall(r"^\.TP\n(.*)$", plain(self.page(f"man1/{program}.1")), re.MULTILINE)
            told = re.findall(r"(?<![\w-])--?[a-zA-Z][a-z-]*", " ".join(
                heading for heading in headings if heading.startswith("-")))
            self.assertEqual(told, flags_of(program))
            self.assertGreater(len(told), least)

    def test_each_command_is_in_its_page(self):
        commands = re.findall(r"^  shade (\w+) ", help_of("shade"), re.MULTILINE)
        self.assertGreater(len(commands), 5)
        for command in commands:
            self.assertIn(f"\nshade {command} ", plain(self.page("man1/shade.1")))

    def test_each_word_of_the_help_is_in_its_page(self):
        for program in ("shaded", "shade"):
            page = set(re.findall(r"[\w-]+", plain(self.page(f"man1/{program}.1"))))
            words = set(re.findall(r"[\w-]+", re.sub("^Usage.*", "", help_of(program))))
            # "Exit status: " is a heading there.
            self.assertEqual(words - page - {"Exit", "status"}, set())

    def test_each_option_of_the_file_is_in_its_page(self):
        text = (SOURCE / "config/shaded.conf").read_text()
        options = re.findall(r"^(?:; )?([a-z-]+ = .*)$", text, re.MULTILINE)
        page = plain(self.page("man5/shaded.conf.5"))
        self.assertEqual(re.findall(r"^\.T[PQ]\n(.*)$", page, re.MULTILINE), options)
        words = set(re.findall(r"[\w-]+", re.sub(r"(?m)^# ----|----$", "", text)))
        self.assertEqual(words - set(re.findall(r"[\w-]+", page)), set())

    def test_mandoc_finds_nothing(self):
        for name in self.PAGES:
            path = self.folder / "page"
            path.write_text(self.page(name))
            self.assertEqual(run("mandoc", "-T", "lint", "-W", "style", path), "")

    def test_groff_finds_nothing(self):
        for name in self.PAGES:
            path = self.folder / "page"
            path.write_text(self.page(name))
            self.assertEqual(run("groff", "-ww", "-man", "-Tutf8", "-z", path), "")


class CompletionTest(Installed):
    def complete(self, program, *words):
        """What bash offers for the last word."""
        script = """source "$1"; shift; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); compopt() { :; }
                    "_$1"; printf '%s\\n' "${COMPREPLY[@]}" """
        path = self.prefix / "share/bash-completion/completions" / program
        return run("bash", "-c", script, "bash", path, program, *words, cwd=SOURCE / "config").split()

    def test_flags(self):
        for program in ("shaded", "shade"):
            self.assertEqual(self.complete(program, "-"), flags_of(program))
        self.assertEqual(self.complete("shaded", "--max-o"), ["--max-objects", "--max-object-lights"])

    def test_commands(self):
        self.assertEqual(self.complete("shade", ""),
                         re.findall(r"^  shade (\w+) ", help_of("shade"), re.MULTILINE))

    def test_values(self):
        self.assertEqual(self.complete("shaded", "--kernel", "a"), ["avx2", "avx512", "auto"])
        self.assertEqual(self.complete("shade", "--object", "w"), [])
        self.assertEqual(self.complete("shaded", "--log-requests", "o"), ["on", "off"])
        self.assertEqual(self.complete("shaded", "--config", "shaded.c"), ["shaded.conf"])
        self.assertEqual(self.complete("shade", "render", "mat"), ["materials.json"])

    def test_zsh_accepts_its_own(self):
        find("zsh")
        for program in ("shaded", "shade"):
            path = self.prefix / "share/zsh/site-functions" / f"_{program}"
            run("zsh", "-n", path)
            text = path.read_text()
            self.assertEqual(re.findall(r"^    '(--?[a-zA-Z-]+)\[", text, re.MULTILINE), flags_of(program))


if __name__ == "__main__":
    unittest.main()
