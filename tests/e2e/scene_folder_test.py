"""Scenes that are kept in a folder: across restarts, beside other daemons, and when the disk fails."""

import hashlib
import json
import os
import shutil
import subprocess
import threading
import unittest
from pathlib import Path

from e2e.daemon import SHADED, SMALL, Daemon, environment
from e2e.daemon_test import wait_until
from e2e.links_test import Test, condensed, lit

# Root, too, may then write only where it is let.
PLAIN = ["setpriv", "--bounding-set", "-dac_override,-dac_read_search", SHADED] if os.geteuid() == 0 else SHADED


def digest_of(scene):
    return hashlib.sha256(condensed(scene)).hexdigest()


def path_of(scene):
    return f"/v1/scenes/{digest_of(scene)}.png"


def files(daemon, result):
    return daemon.metrics()[f'shaded_scene_files_total{{result="{result}"}}']


class FolderTest(Test):
    def setUp(self):
        super().setUp()
        self.scenes = Path(self.folder) / "scenes"
        self.scenes.mkdir()

    def daemon(self, *flags, **options):
        return Daemon("--scenes-folder", str(self.scenes), "--response-cache", "0", *flags, **options)

    def file_of(self, scene):
        return self.scenes / f"{digest_of(scene)}.json"

    def names(self):
        return sorted(path.name for path in self.scenes.iterdir())

    def test_a_scene_outlives_the_daemon(self):
        scene = {**SMALL, "camera": {"fov": 41}}
        with self.daemon() as daemon:
            answer = self.put(daemon, json.dumps(scene, indent=4))
            self.assertEqual((answer.status, answer.headers["Location"]), (201, path_of(scene)))
            self.assertEqual(self.file_of(scene).read_bytes(), condensed(scene))
            self.assertEqual(self.names(), [self.file_of(scene).name])
            self.assertEqual(self.file_of(scene).stat().st_mode & 0o7, 0)
            self.keep(daemon, scene, 200)
            first = self.picture(daemon, path_of(scene))
            self.assertEqual(first.body, daemon.render(scene).body)
            self.assertEqual((files(daemon, "written"), files(daemon, "known"), files(daemon, "read")), (1, 1, 0))
        with self.daemon() as daemon:
            again = self.picture(daemon, path_of(scene))
            self.assertEqual((again.body, again.headers["ETag"]), (first.body, first.headers["ETag"]))
            jpeg = self.picture(daemon, path_of(scene).replace("png", "jpg"))
            self.assertEqual(jpeg.body, daemon.render(scene, {"Accept": "image/jpeg"}).body)
            self.assertEqual(files(daemon, "read"), 1)  # then it is in memory
            known = daemon.get(path_of(scene), {"If-None-Match": first.headers["ETag"]})
            self.assertEqual(known.status, 304)
            self.keep(daemon, scene, 200)
        with Daemon() as daemon:
            self.refused(daemon.get(path_of(scene)), 404, "not-found", "PUT")

    def test_memory_may_have_no_room(self):
        long = lit(900)  # read in its turn, among the large ones
        with self.daemon("--mesh-store", "0") as daemon:
            features = json.loads(daemon.get("/v1/version").body)["features"]
            self.assertEqual({"meshes", "scenes", "assets"} & set(features), {"scenes"})
            for scene in (SMALL, long):
                self.assertEqual(self.keep(daemon, scene), path_of(scene))
                picture = self.picture(daemon, path_of(scene))
                self.assertEqual(picture.body, daemon.render(scene).body)
            self.assertEqual(files(daemon, "read"), 2)
        with self.daemon("--max-body", "1K") as daemon:
            self.refused(daemon.get(path_of(long)), 422, "limit", "the limit `body` is 1024")

    def test_a_scene_in_memory_is_put_into_the_folder_again(self):
        with self.daemon() as daemon:
            self.keep(daemon, SMALL)
            self.file_of(SMALL).unlink()
            self.picture(daemon, path_of(SMALL))
            self.keep(daemon, SMALL, 201)
            self.assertEqual(self.file_of(SMALL).read_bytes(), condensed(SMALL))

    def test_what_is_not_there_is_404(self):
        with self.daemon() as daemon:
            self.refused(daemon.get(path_of(SMALL)), 404, "not-found", "PUT", "/v1/scenes")
            (self.scenes / "x.json").write_bytes(condensed(SMALL))
            for name in ("x", "../" + digest_of(SMALL), "%2e%2e", "0" * 63):
                self.refused(daemon.get(f"/v1/scenes/{name}.png"), 404, "not-found")
            self.assertEqual(files(daemon, "missing"), 1)
            self.assertFalse(daemon.events("scene-file"))

    def test_damaged_files_are_not_drawn_and_are_mended(self):
        right = condensed(SMALL)
        other = condensed({**SMALL, "background": 0.5})
        target = Path(self.file("", "target"))
        target.write_bytes(right)
        file = self.file_of(SMALL)

        def link():
            file.symlink_to(target)

        damages = (lambda: file.write_bytes(b""), lambda: file.write_bytes(right[:-1]),
                   lambda: file.write_bytes(right + b" "), lambda: file.write_bytes(other),
                   link, lambda: os.mkfifo(file))
        with self.daemon("--mesh-store", "0") as daemon:
            for number, damage in enumerate(damages):
                file.unlink(missing_ok=True)
                damage()
                self.refused(daemon.get(path_of(SMALL)), 404, "not-found", "damaged", "PUT")
                self.assertEqual(files(daemon, "damaged"), number + 1)
                wait_until(lambda: len(daemon.events("scene-file")) == number + 1)
                self.assertEqual(daemon.events("scene-file")[-1]["file"], file.name)
                self.keep(daemon, SMALL, 201)
                self.assertEqual(file.read_bytes(), right)
                self.picture(daemon, path_of(SMALL))
            self.assertEqual(target.read_bytes(), right)
            file.unlink()
            file.mkdir()
            self.refused(daemon.get(path_of(SMALL)), 404, "not-found", "damaged")
            self.refused(self.put(daemon, json.dumps(SMALL)), 507, "storage", "cannot be written")
            self.assertEqual(self.names(), [file.name])

    def test_a_folder_that_may_not_be_written_is_read(self):
        with self.daemon() as daemon:
            self.keep(daemon, SMALL)
        self.scenes.chmod(0o555)
        self.addCleanup(self.scenes.chmod, 0o755)
        with self.daemon(program=PLAIN) as daemon:
            self.assertEqual(daemon.wait_for("scenes-folder-unwritable")["folder"], str(self.scenes))
            self.keep(daemon, SMALL, 200)
            self.picture(daemon, path_of(SMALL))
            other = {**SMALL, "background": 0.25}
            self.refused(self.put(daemon, json.dumps(other)), 507, "storage", "cannot be written")
            self.refused(daemon.get(path_of(other)), 404, "not-found")
            self.assertEqual(files(daemon, "unwritable"), 1)
            self.assertIn("ermission", daemon.wait_for("scene-file")["message"])
        self.file_of(SMALL).chmod(0)
        with self.daemon(program=PLAIN) as daemon:
            self.refused(daemon.get(path_of(SMALL)), 500, "internal", "cannot be read")
            self.assertEqual(files(daemon, "unreadable"), 1)

    def test_nothing_is_left_of_what_could_not_be_written(self):
        """Files hold one byte, as on a full disk. ThreadSanitizer does not start where they hold none."""
        with self.daemon(program=["prlimit", "--fsize=1", SHADED]) as daemon:
            self.refused(self.put(daemon, json.dumps(SMALL)), 507, "storage", "cannot be written")
            self.assertEqual(self.names(), [])
            shutil.rmtree(self.scenes)
            self.refused(self.put(daemon, json.dumps(SMALL)), 507, "storage", "cannot be written")
            self.assertEqual(files(daemon, "unwritable"), 2)
            self.assertEqual(daemon.metrics()['shaded_requests_total{route="/v1/scenes",status="507"}'], 2)

    def test_a_folder_that_is_none_ends_the_start(self):
        file = self.file("", "file")
        for path, word in ((str(self.scenes / "none"), "No such file"), (file, "Not a directory")):
            done = subprocess.run([SHADED, "--listen", "127.0.0.1:0", "--admin", "off", "--scenes-folder", path],
                                  env=environment(), capture_output=True, text=True, check=False)
            line = json.loads(done.stderr.splitlines()[-1])
            self.assertEqual((done.returncode, line["event"], line["where"]), (1, "cannot-start", path))
            self.assertIn("scenes-folder", line["message"])
            self.assertIn(word, line["message"])

    def test_daemons_share_a_folder(self):
        scenes = [{**SMALL, "background": i / 16} for i in range(8)]
        with self.daemon() as one, self.daemon("--mesh-store", "0") as two:
            answers = []

            def put(daemon, scene):
                answers.append(self.put(daemon, json.dumps(scene)))

            threads = [threading.Thread(target=put, args=(daemon, scene))
                       for scene in scenes for daemon in (one, two, one)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual({answer.status for answer in answers} - {200, 201}, set())
            self.assertGreaterEqual(sum(answer.status == 201 for answer in answers), len(scenes))
            self.assertEqual(self.names(), sorted(self.file_of(scene).name for scene in scenes))
            for scene in scenes:
                bodies = {self.picture(daemon, path_of(scene)).body for daemon in (one, two)}
                self.assertEqual(bodies, {one.render(scene).body})
            late = {**SMALL, "background": 1}
            self.refused(two.get(path_of(late)), 404, "not-found")
            self.keep(one, late)
            self.picture(two, path_of(late))


if __name__ == "__main__":
    unittest.main()
