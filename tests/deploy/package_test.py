"""The Debian packages, as they go into a bare Debian and out of it: `./dev package` and .ci/run make
them and try them, which takes minutes. Where that cannot be it is skipped, and says why."""

import os
import shutil
import subprocess
import unittest

from deploy.tools import BARE, BARE_FILE, SOURCE, run
from e2e.daemon import Daemon

FOLDER = SOURCE / "build/package"
ROOT = FOLDER / "root"
SCENE = {"objects": [{"type": "sphere"}], "image": {"width": 16, "height": 16}}
NAMES = ("shaded", "shaded-import", "shaded-openimageio", "libshaded0", "libshaded-dev")
UNITS = {"shaded.service", "shaded.socket", "shaded-admin.socket"}
PATIENCE = 1200  # seconds for any one command, on the slowest machine


def command(*words, **options):
    """(exit status, what it printed)."""
    done = subprocess.run([str(word) for word in words], stdin=subprocess.DEVNULL, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE,
                          check=False, **options)
    return done.returncode, done.stdout


def within(*words):
    status, text = command(SOURCE / "tests/deploy/within", ROOT, "env", "-i", "PATH=/usr/sbin:/usr/bin",
                           "LC_ALL=C", "DEBIAN_FRONTEND=noninteractive", *words)
    if status:
        raise AssertionError(f"{words}: exit {status}\n{text[-4000:]}")
    return text


def packages():
    return {path.name.split("_")[0]: path for path in FOLDER.glob("*.deb")}


def prepare():
    """Why it cannot be done here, or None."""
    if "SHADED_CONTAINER" not in os.environ:
        return "making packages takes minutes: ./dev package does it, and tries them"
    tools = ("mmdebstrap", "dpkg-shlibdeps", "file", "cpack", "unshare")
    missing = [tool for tool in tools if not shutil.which(tool)]
    if missing:
        return f"there is no {', '.join(missing)}"
    if os.geteuid() != 0:
        return "a bare Debian wants root"
    status, text = command("bash", SOURCE / "deploy/package/make")
    if status:
        raise AssertionError(text[-4000:])
    shutil.rmtree(ROOT, ignore_errors=True)
    status, text = command(BARE, BARE_FILE)
    if status:
        return f"no bare Debian can be made: {text[-300:]}"
    ROOT.mkdir()
    run("tar", "--extract", "--numeric-owner", "--file", BARE_FILE, "--directory", ROOT)
    return None


class PackageTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        why = prepare()
        if why:
            raise unittest.SkipTest(why)
        cls.addClassCleanup(shutil.rmtree, ROOT, ignore_errors=True)
        (ROOT / "debs").mkdir()
        for path in packages().values():
            shutil.copy(path, ROOT / "debs")
        within("apt-get", "update", "-q")

    def install(self, *names):
        within("apt-get", "install", "-y", "-q", "--no-install-recommends", *(
            f"/debs/{packages()[name].name}" for name in names))

    def test_1_there_are_five(self):
        self.assertEqual(sorted(packages()), sorted(NAMES))
        for name, path in packages().items():
            text = run("dpkg-deb", "--info", path)
            self.assertIn(f"Package: {name}\n", text)
            self.assertIn("Maintainer: shaded <packages@shaded.invalid>", text)
            self.assertNotRegex(run("dpkg-deb", "--contents", path), r"test|\.a$")

    def test_2_lintian_finds_no_error(self):
        if not shutil.which("lintian"):
            self.skipTest("there is no lintian")
        status, text = command("lintian", "--fail-on", "error", "--tag-display-limit", "0", "--allow-root",
                               *packages().values())
        self.assertEqual(status, 0, text)

    def test_3_the_daemon_is_installed_and_draws(self):
        self.install("shaded")
        self.assertRegex((ROOT / "etc/passwd").read_text(), r"(?m)^shaded:x:\d+:\d+:")
        wanted = {path.name for path in (ROOT / "etc/systemd/system").glob("*.wants/*")}
        self.assertLessEqual(UNITS, wanted)
        self.assertEqual(within("dpkg", "--verify", "shaded"), "")
        self.assertEqual(self.draw("image/png"), (200, b"\x89PNG"))
        self.assertEqual(self.draw("image/x-exr")[0], 406)

    def test_4_the_module_adds_its_formats(self):
        self.install("shaded-openimageio")
        self.assertEqual(self.draw("image/x-exr"), (200, b"v/1\x01"))

    def test_5_the_library_needs_nothing_more(self):
        self.install("libshaded0", "libshaded-dev")
        library = next((ROOT / "usr/lib").rglob("libshaded.so"))
        text = within("ldd", f"/{library.relative_to(ROOT)}")
        self.assertNotIn("not found", text)
        self.assertIn("libshaded.so.0", within("/usr/sbin/ldconfig", "-p"))

    def test_6_configuration_of_an_operator_stays(self):
        path = ROOT / "etc/shaded/shaded.conf"
        changed = path.read_text().replace("queue = 64", "queue = 65")
        path.write_text(changed)
        self.install("shaded")
        self.assertEqual(path.read_text(), changed)

    def test_7_nothing_is_left_of_it(self):
        within("apt-get", "purge", "-y", "-q", *NAMES)
        left = [path for folder in ("usr", "etc", "var/lib/systemd") for path in (ROOT / folder).rglob("*shade[d.]*")
                if path.is_file() or path.is_symlink()]
        self.assertEqual(left, [])

    def draw(self, kind):
        """(status, first bytes) of a picture by the installed daemon, as its user."""
        start = [str(SOURCE / "tests/deploy/within"), str(ROOT), "setpriv", "--reuid=shaded",
                 "--regid=shaded", "--clear-groups", "/usr/bin/shaded", "--config",
                 "/etc/shaded/shaded.conf"]
        with Daemon(program=start) as daemon:
            answer = daemon.render(SCENE, {"Accept": kind})
            return answer.status, answer.body[:4]


if __name__ == "__main__":
    unittest.main()
