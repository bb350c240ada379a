"""Pictures that are put under their digest or have a name, and requests that name them."""

import hashlib
import io
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import unittest
import zlib
from pathlib import Path

import numpy as np
from PIL import Image

from e2e import hostile
from e2e.daemon import BUILD, SANITIZED, SHADED, SMALL, Daemon, environment
from e2e.daemon_test import Folder, wait_until

SHADE = str(BUILD / "shade")
NOISE = np.random.default_rng(7).integers(0, 256, (48, 64, 4), dtype=np.uint8)


def file_of(codes, kind="PNG", **options):
    out = io.BytesIO()
    Image.fromarray(codes).save(out, kind, **options)
    return out.getvalue()


def digest_of(body):
    return hashlib.sha256(body).hexdigest()


def name_of(body):
    return "sha256-" + digest_of(body)


def blank(width, height, rows):
    """A PNG that says it is so wide and high, and has so many rows, all black."""
    return hostile.png(width, height, hostile.deflated((3 * width + 1) * rows))


def floats(values):
    """An OpenEXR file without compression, of [height, width, 3] floats."""
    high, wide, _ = values.shape
    rows = [values[y, :, ::-1].T.astype("<f4").tobytes() for y in range(high)]
    return hostile.exr(wide, high, rows, packing=0)


def textured(name, **more):
    return {**SMALL, "objects": [{"type": "sphere", "material": {"diffuse": {"texture": name, **more}}}]}


def around(*maps, **members):
    lights = [{"type": "environment", "map": name, "visible": i == 0, **members} for i, name in enumerate(maps)]
    return {**SMALL, "lights": lights}


# Starts a program under a filter that refuses filters.
CALL = {"x86_64": 317, "aarch64": 277}.get(os.uname().machine)
LOOSE = [sys.executable, "-c", f"""
import ctypes, os, struct, sys
code = [(0x20, 0, 0, 0), (0x15, 0, 1, {CALL}), (6, 0, 0, 0x50000 | 38), (6, 0, 0, 0x7fff0000)]
filter = ctypes.create_string_buffer(b"".join(struct.pack("HBBI", *one) for one in code))
libc = ctypes.CDLL(None)
libc.prctl(38, 1, 0, 0, 0)
libc.prctl(22, 2, ctypes.create_string_buffer(struct.pack("HxxxxxxP", len(code), ctypes.addressof(filter))), 0, 0)
os.execv(sys.argv[1], sys.argv[1:])
""", SHADED] if CALL else SHADED
CAN_CONFINE = bool(CALL) and "errno" in Path("/proc/sys/kernel/seccomp/actions_avail").read_text()
OPAQUE = file_of(NOISE[:, :, :3])
CLEAR = file_of(NOISE)
ROOM = file_of(NOISE[:24, :48, :3])


class Test(Folder):
    def put(self, daemon, body, kind="image/png", digest=None, **headers):
        return daemon.call("PUT", f"/v1/assets/{digest or digest_of(body)}", body,
                           {"Content-Type": kind, **headers})

    def problem(self, answer, status, name, *words):
        self.assertEqual(answer.status, status, answer.body)
        problem = json.loads(answer.body)
        self.assertEqual(problem["type"], f"urn:shaded:problem:{name}")
        for word in words:
            self.assertIn(word, answer.body.decode())
        return problem

    def diff(self, daemon, a, b, **more):
        return daemon.post("/v1/diff", {"a": a, "b": b, **more})


class AssetsTest(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--max-pixels", "100000", "--mesh-store", "300K", "--threads", "2")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def test_kept_pictures_are_as_far_apart_as_their_files(self):
        files = {"o.png": OPAQUE, "c.png": CLEAR, "q.jpg": file_of(NOISE[:, :, :3], "JPEG", quality=80),
                 "w.webp": file_of(NOISE, "WEBP", quality=70),
                 "g.png": file_of(NOISE[:, :, 0]),
                 "d.png": file_of(NOISE[:, :, 0].astype(np.uint16) * 257)}
        for name, body in files.items():
            (self.folder / name).write_bytes(body)
            self.assertIn(self.put(self.daemon, body).status, (201, 204), name)
        names = list(files)
        for a, b in zip(names, names[1:]):
            done = subprocess.run([SHADE, "diff", self.folder / a, self.folder / b], check=True,
                                  capture_output=True, env=environment())
            answer = self.diff(self.daemon, name_of(files[a]), name_of(files[b]))
            self.assertEqual(json.loads(answer.body), json.loads(done.stdout), (a, b))

    def test_a_picture_is_held_against_a_scene(self):
        scene = {**SMALL, "image": {"width": 40, "height": 30}}
        picture = self.daemon.render(scene).body
        self.problem(self.diff(self.daemon, name_of(picture), scene), 409, "unknown-data", "/a",
                     digest_of(picture), "/v1/assets/")
        first, again = self.put(self.daemon, picture), self.put(self.daemon, picture)
        self.assertEqual((first.status, first.body, again.status), (201, b"", 204))
        for sides in (name_of(picture), scene), (scene, name_of(picture)):
            self.assertEqual(json.loads(self.diff(self.daemon, *sides).body)["differing"], 0)
        larger = {**scene, "image": {"width": 41, "height": 30}}
        self.problem(self.diff(self.daemon, name_of(picture), larger), 422, "scene", "/b/image/width")
        self.problem(self.diff(self.daemon, larger, name_of(picture)), 422, "scene", '"/b"', "41 x 30")
        self.problem(self.diff(self.daemon, 3, {}), 422, "scene", '"/a"', "a scene, or a string")
        both = self.diff(self.daemon, "sha256-" + 64 * "0", "sha256-" + 64 * "1")
        self.assertEqual([error["pointer"] for error in self.problem(both, 409, "unknown-data")["errors"]],
                         ["/a", "/b"])
        for name in ("brick.png", "../brick.png", "", "sha256-", "sha256-" + 64 * "A"):
            self.problem(self.diff(self.daemon, name, scene), 422, "scene", '"/a"')

    def test_a_picture_lights_a_scene_and_is_behind_it(self):
        room = np.zeros((32, 64, 3), np.uint8)
        room[:, :32, 0], room[:, 32:, 2] = 200, 100
        room, other = file_of(room), file_of(np.roll(room, 32, axis=1))
        scene = around(name_of(room))
        for missing in (scene, around(name_of(room), "studio")):
            told = self.problem(self.daemon.post("/v1/render", missing), 409, "unknown-data", digest_of(room))
            self.assertEqual([error["pointer"] for error in told["errors"]], ["/lights/0/map"])
        self.put(self.daemon, room)
        self.put(self.daemon, other)
        picture = self.daemon.render(scene)
        codes = np.array(Image.open(io.BytesIO(picture.body)).convert("RGB"), int)
        # To the left of -z is -x. The sphere's left side is red, too, and its right side blue.
        np.testing.assert_allclose(codes[:, 0], [[200, 0, 0]] * 12, atol=1)
        np.testing.assert_allclose(codes[:, -1], [[0, 0, 100]] * 12, atol=1)
        self.assertGreater(codes[6, 4, 0], 2 * codes[6, 4, 2])
        self.assertGreater(codes[6, 11, 2], codes[6, 11, 0])
        self.assertEqual(self.daemon.render(scene).headers["ETag"], picture.headers["ETag"])
        self.assertNotEqual(self.daemon.render(around(name_of(other))).headers["ETag"], picture.headers["ETag"])
        turned = self.daemon.render(around(name_of(other), rotate=180)).body
        np.testing.assert_allclose(np.array(Image.open(io.BytesIO(turned)).convert("RGB"), int), codes, atol=1)
        self.put(self.daemon, OPAQUE)
        for name, words in ((name_of(OPAQUE), "64 by 48 pixels"), ("room.hdr", "no assets have names here"),
                            ("../room.hdr", "no assets have names here"), ("stodio", '\\"studio\\"'),
                            ("sha256-" + 64 * "A", "in lower case")):
            self.problem(self.daemon.post("/v1/render", around(name)), 422, "scene", "/lights/0/map", words)

    def test_opacities_are_numbers_or_colors_of_a_space(self):
        grey = file_of(np.full((2, 2), 188, np.uint8))
        self.put(self.daemon, grey)

        def seen(opacity):
            scene = {**SMALL, "trace": {"depth": 1}, "objects": [{"type": "sphere", "material": {"opacity": opacity}}]}
            answer = self.daemon.render(scene)
            return np.array(Image.open(io.BytesIO(answer.body)).convert("RGB"), int)

        for members, value in (({}, 188 / 255), ({"space": "sRGB"}, ((188 / 255 + 0.055) / 1.055) ** 2.4)):
            np.testing.assert_allclose(seen({"texture": name_of(grey), **members}), seen(value), atol=1)

    def test_what_is_no_picture_is_refused(self):
        self.problem(self.put(self.daemon, OPAQUE, digest="0" * 64), 422, "asset", digest_of(OPAQUE))
        self.problem(self.put(self.daemon, OPAQUE, digest="A" * 64), 404, "not-found")
        self.problem(self.put(self.daemon, OPAQUE, "text/plain"), 415, "media-type", "image/*")
        for body, words in ((b"", "begins as no PNG"), (b"GIF89a", "begins as no PNG"),
                            (OPAQUE[:-40], "PNG: "), (OPAQUE[:30], "PNG: "),
                            (file_of(NOISE[:, :, :3], "JPEG")[:-300], "JPEG: "),
                            (file_of(NOISE, "WEBP")[:-300], "WebP: "),
                            (hostile.exr(4, 2, bytes(32), packing=0, channels=(b"G", b"R")),
                             "neither R, G and B nor Y alone")):
            self.problem(self.put(self.daemon, body), 422, "asset", words)
        packed = zlib.compress(OPAQUE, wbits=31)
        self.assertEqual(self.put(self.daemon, packed, digest=digest_of(OPAQUE),
                                  **{"Content-Encoding": "gzip"}).status // 100, 2)

    def test_what_promises_much_is_refused_by_its_head(self):
        for body in (blank(100000, 100000, 1), blank(317, 316, 1)):
            self.problem(self.put(self.daemon, body), 422, "limit", "`pixels`")
        self.problem(self.put(self.daemon, blank(310, 310, 310)), 422, "limit", "`mesh-store`")
        self.assertEqual(self.daemon.get("/readyz", admin=True).status, 200)

    def test_hostile_files_are_refused_in_a_sentence(self):
        for kind, what, body in hostile.make(256, 32 << 20):
            if kind in ("tiff", "tiff in one strip", "exr", "hdr") and what not in (
                    "has one strip of them", "has 4,000 channels"):
                continue
            answer = self.put(self.daemon, body)
            if (kind, what) == ("png", "goes on in many zeros"):  # which nobody looks at
                self.assertEqual(answer.status // 100, 2, answer.body)
                continue
            self.assertEqual(answer.status, 422, (kind, what, answer.body))
            problem = json.loads(answer.body)
            self.assertIn(problem["type"].rsplit(":", 1)[1], ("asset", "limit"), (kind, what))
            self.assertNotIn("gave up", answer.body.decode(), (kind, what))
        self.assertEqual(self.daemon.get("/readyz", admin=True).status, 200)

    def test_floats_are_kept_and_not_compared(self):
        body = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 8\n" + 64 * b"\x80\x80\x80\x81"
        self.assertEqual(self.put(self.daemon, body, "image/vnd.radiance").status, 201)
        self.problem(self.diff(self.daemon, name_of(body), name_of(body)), 422, "scene", "floats")

    def test_materials_have_pictures(self):
        at = "/objects/0/material/diffuse/texture"
        wide = file_of(np.roll(NOISE, 3, axis=1))
        missing = self.daemon.render(textured(name_of(wide)))
        problem = self.problem(missing, 409, "unknown-data", digest_of(wide), "/v1/assets/")
        self.assertEqual([error["pointer"] for error in problem["errors"]], [at])
        self.put(self.daemon, wide)
        scenes = [textured(name_of(wide)), textured(name_of(wide), tint=0.5),
                  textured(name_of(wide), channel="A"), textured(name_of(wide), space="lin_rec709")]
        answers = [self.daemon.render(scene) for scene in scenes]
        self.assertEqual([answer.status for answer in answers], [200] * 4)
        self.assertEqual(len({answer.headers["ETag"] for answer in answers}), 4)
        told = json.loads(self.daemon.post("/v1/explain", scenes[0]).body)
        told = told["materials"]["groups"][0]["patterns"][0]
        self.assertEqual([told[key] for key in ("coefficient", "texture", "width", "height", "levels")],
                         ["diffuse", name_of(wide), 64, 48, 7])
        self.problem(self.daemon.render(textured("brick.png")), 422, "scene", at)
        self.assertEqual(self.daemon.render({**scenes[0], "interpolation": "flat"}).status, 200)
        silver = {"reflection": {"texture": name_of(wide), "tint": [0.9, 0.8, 0.5]}, "transmission": {"texture": name_of(wide), "channel": "A"}}
        mirror = {**SMALL, "trace": {"depth": 1}, "objects": [{"type": "sphere", "material": silver}]}
        told = json.loads(self.daemon.post("/v1/explain", mirror).body)["materials"]["groups"][0]["patterns"]
        self.assertEqual([one["coefficient"] for one in told], ["reflection", "transmission"])
        self.assertNotEqual(self.daemon.render(mirror).headers["ETag"], self.daemon.render({**mirror, "trace": {}}).headers["ETag"])
        worn = {"specular": 0.5, "shininess": {"pattern": "checker", "values": [8, 90]}, "lobes": [
            {"specular": 0.1, "shininess": {"texture": name_of(wide), "channel": "A", "values": [60, 5]}}]}
        group = json.loads(self.daemon.post("/v1/explain", {**SMALL, "objects": [{"type": "sphere", "material": worn}]}).body)
        group = group["materials"]["groups"][0]
        self.assertEqual([one["coefficient"] for one in group["patterns"]], ["shininess", "shininess"])
        self.assertEqual([one["lobe"] for one in group["patterns"]], [0, 1])
        ranges = [one["range"] for one in group["patterns"]]
        self.assertEqual((ranges[0], group["shininess"]), ([8, 90], [most for _, most in ranges]))
        self.assertTrue(5 <= ranges[1][0] < ranges[1][1] <= 60)
        bumps = {**SMALL, "objects": [{"type": "sphere", "material": {"normal": {"texture": name_of(wide)}}}]}
        answers = [self.daemon.render({**bumps, "interpolation": how}) for how in ("phong", "gouraud", "flat")]
        self.assertEqual([answer.status for answer in answers], [200] * 3)

    def test_any_picture_is_a_texture(self):
        broken = NOISE[:5, :7, :3] / np.float32(100)
        broken[2, 3], broken[4, 0, 1], broken[1, 1, 2] = np.nan, np.inf, -1e30
        pictures = [file_of(NOISE[:1, :1, 0]), file_of(NOISE[:, :1, 0].astype(np.uint16) * 257),
                    file_of(NOISE[:1, :, :3]), file_of(NOISE[:7, :5, :3], "JPEG"), floats(broken)]
        for body in pictures:
            self.assertIn(self.put(self.daemon, body).status, (201, 204))
            answer = self.daemon.render(textured(name_of(body), uv={"scale": [3, 0.01], "rotate": 77}))
            self.assertEqual(answer.status, 200, answer.body)
            warning = answer.headers["Shaded-Warning"]
            self.assertEqual("5 samples" in (warning or ""), body is pictures[-1], warning)

    def test_they_stay_below_the_cap(self):
        for shift in range(28):
            body = file_of(np.roll(NOISE, shift, axis=0))
            self.assertIn(self.put(self.daemon, body).status, (201, 204))
            self.assertLessEqual(self.daemon.metrics()["shaded_mesh_store_bytes"], 300 << 10)
        self.assertGreater(self.daemon.metrics()["shaded_mesh_store_evictions_total"], 10)
        self.problem(self.diff(self.daemon, name_of(file_of(NOISE)), SMALL), 409, "unknown-data")
        self.assertEqual(self.diff(self.daemon, name_of(body), name_of(body)).status, 200)

    def test_no_process_is_left(self):
        self.put(self.daemon, CLEAR[:-50])
        tasks = Path(f"/proc/{self.daemon.pid}/task").glob("*/children")
        self.assertEqual([task.read_text() for task in tasks if task.read_text()], [])


class FolderTest(Test):
    def test_an_operators_pictures_have_names(self):
        assets = self.folder / "assets"
        assets.mkdir()
        (assets / "brick.png").write_bytes(OPAQUE)
        (assets / "notes.txt").write_text("none")
        (assets / f"{digest_of(CLEAR)}.png").write_bytes(CLEAR)
        (assets / f"{64 * '0'}.jpeg").write_bytes(CLEAR)
        (assets / f"{64 * '1'}.png").write_bytes(CLEAR[:-40])
        with Daemon("--assets", str(assets)) as daemon:
            same = self.diff(daemon, "brick.png", "brick.png")
            self.assertEqual(json.loads(same.body)["differing"], 0)
            called = self.diff(daemon, name_of(CLEAR), f"{digest_of(CLEAR)}.png")
            self.assertEqual(json.loads(called.body)["differing"], 0)
            self.problem(self.diff(daemon, "sha256-" + 64 * "0", "sha256-" + 64 * "1"), 409, "unknown-data",
                         "/a", "/b", f"{64 * '0'}.jpeg does not hold what it is called",
                         f"{64 * '1'}.png does not hold what it is called")  # and is not decoded
            self.problem(self.diff(daemon, "brik.png", "notes.txt"), 422, "scene", "brick.png", '"/b"')
            (assets / "room.png").write_bytes(ROOM)
            self.problem(daemon.post("/v1/render", around("room.png")), 422, "scene", "/lights/0/map", "unknown asset")
            (assets / "stone.png").write_bytes(CLEAR)
            (assets / "brick.png").write_bytes(CLEAR)
            self.problem(self.diff(daemon, "brick.png", "stone.png"), 422, "scene", "/b")
            before = daemon.render(textured("brick.png"))
            daemon.signal(signal.SIGHUP)
            wait_until(lambda: daemon.events("reloaded"))
            self.assertEqual(json.loads(self.diff(daemon, "brick.png", "stone.png").body)["differing"], 0)
            after, same = (daemon.render(textured(name)) for name in ("brick.png", "stone.png"))
            self.assertNotEqual(before.headers["ETag"], after.headers["ETag"])
            self.assertEqual(after.headers["ETag"], same.headers["ETag"])
            self.problem(daemon.post("/v1/render", around("rom.png")), 422, "scene", "room.png")
            named = daemon.render(around("room.png"))
            # The same by its digest, and on the command line.
            self.put(daemon, ROOM)
            self.assertEqual(daemon.render(around(name_of(ROOM))).headers["ETag"], named.headers["ETag"])
            drawn = subprocess.run([SHADE, "render", "--assets", assets, "-", "-o", "-"], env=environment(), check=True,
                                   input=json.dumps(around("room.png")).encode(), capture_output=True).stdout
            self.assertEqual(drawn, named.body)
            # A file that has changed is another map, when it is looked at again.
            (assets / "room.png").write_bytes(file_of(NOISE[:32, :, :3]))
            daemon.signal(signal.SIGHUP)
            wait_until(lambda: len(daemon.events("reloaded")) == 2)
            self.assertNotEqual(daemon.render(around("room.png")).headers["ETag"], named.headers["ETag"])
        (assets / "large.png").write_bytes(blank(400, 300, 300))
        (assets / "square.png").write_bytes(blank(300, 300, 300))
        (assets / "sha256-x.png").write_bytes(OPAQUE)
        with Daemon("--assets", str(assets), "--max-memory", "3M", program=LOOSE) as daemon:
            two = textured("large.png")
            two["objects"] += textured("large.png", space="ACEScg")["objects"]
            told = self.problem(daemon.post("/v1/render", two), 422, "limit", "memory")
            self.assertEqual([error["pointer"] for error in told["errors"]], ["/objects/1/material/diffuse/texture"])
            self.problem(daemon.post("/v1/render", around("square.png")), 422, "scene", "/lights/0/map", "300 by 300 pixels")
            self.put(daemon, CLEAR)
            # Files are decoded all the same, and the log says once what they are decoded without.
            loose = daemon.events("decoder-loose")
            self.assertEqual([event["level"] for event in loose], ["warning"])
            self.assertIn("no filter of system calls", loose[0]["message"])
            self.assertIn("seccomp(2)", loose[0]["message"])
            self.assertEqual(daemon.render(textured(name_of(CLEAR))).status, 200)
            told = self.problem(daemon.post("/v1/render", textured("sha256.png")), 422, "scene")
            self.assertNotIn("sha256-x", json.dumps(told))
        done = subprocess.run([BUILD / "shaded", "--listen", "127.0.0.1:0", "--admin", "off", "--assets",
                               self.folder / "none"], capture_output=True, check=False, env=environment())
        self.assertEqual(done.returncode, 1)
        self.assertIn("none", done.stderr.decode())


class ProcessTest(unittest.TestCase):
    """What the process that decodes may do, as src/decode/wire.h has it asked."""

    TOLD = struct.Struct("<Q7i256si")

    def start(self, body):
        ours, its = socket.socketpair()
        program = subprocess.Popen([BUILD / "shaded-decode"], stdin=its, env=environment())
        self.addCleanup(program.wait)
        self.addCleanup(program.kill)
        self.addCleanup(ours.close)
        its.close()
        ours.sendall(struct.pack("<4Q", self.TOLD.size, len(body), 1 << 24, 64 << 20) + body)
        return program, ours

    def hear(self, ours):
        told = self.TOLD.unpack(ours.recv(self.TOLD.size, socket.MSG_WAITALL))
        self.confined = told[9]
        return told[1], told[2:8], told[8].rstrip(b"\0").decode()

    def test_it_has_limits_and_no_files_when_it_decodes(self):
        program, ours = self.start(OPAQUE)
        self.assertEqual(self.hear(ours), (0, (64, 48, 3, 0, 0, 1), ""))
        limits = Path(f"/proc/{program.pid}/limits").read_text()
        for name, value in (("open files", 0), ("file size", 0), ("core file size", 0), ("cpu time", 30)):
            self.assertRegex(limits, rf"(?m)^Max {name} +{value} +{value} ")
        if not SANITIZED:
            self.assertRegex(limits, r"(?m)^Max data size +[0-9]{8,9} ")
        self.assertEqual(sorted(os.listdir(f"/proc/{program.pid}/fd")), ["0", "1", "2"])
        held = re.search(r"(?m)^Seccomp:\t(.)$", Path(f"/proc/{program.pid}/status").read_text())[1]
        self.assertEqual(held == "2", bool(self.confined))
        if not SANITIZED and CAN_CONFINE:
            self.assertEqual(self.confined, 1)
        ours.sendall(struct.pack("<Q", 1 << 24))
        self.assertEqual(self.hear(ours)[0], 0)
        self.assertEqual(ours.recv(48 * 64 * 3, socket.MSG_WAITALL), NOISE[:, :, :3].tobytes())
        self.assertEqual((ours.recv(1), program.wait()), (b"", 0))

    @unittest.skipIf(SANITIZED, "sanitizers map what the limit is for")
    def test_it_takes_no_more_memory_than_it_is_given(self):
        _, ours = self.start(blank(1500, 1500, 1500))
        self.assertEqual(self.hear(ours)[0], 0)
        ours.sendall(struct.pack("<Q", 1 << 20))
        status, _, text = self.hear(ours)
        self.assertEqual((status, text), (5, "out of memory"))
        self.assertEqual(ours.recv(1), b"")

    def test_it_ends_with_who_asked(self):
        program, ours = self.start(OPAQUE)
        self.hear(ours)
        ours.close()
        self.assertEqual(program.wait(), 0)


if __name__ == "__main__":
    unittest.main()
