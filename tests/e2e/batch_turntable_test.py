"""POST /v1/batch with a turntable: an animation whose camera goes around."""

import io
import json
import math
import struct
import unittest
import zlib

import numpy
from PIL import Image

from e2e.batch_test import Reader
from e2e.daemon import Daemon
from e2e.daemon_test import ENDLESS, wait_until

CAMERA = {"position": [1, 2, 4], "target": [0.25, 0, -0.5], "up": [0.2, 1, 0]}
SCENE = {"image": {"width": 48, "height": 32, "samples": 4}, "camera": CAMERA,
         "lights": [{"type": "directional", "direction": [-1, -1, -1]}],
         "objects": [{"type": "box", "material": {"preset": "brass"}}]}
LONG = {**ENDLESS, "image": {"width": 2000, "height": 2000, "samples": 16}}


def turned(scene, share):
    """The scene with its camera after a share of the turn: O. Rodrigues' formula, in the daemon's order, so that
    the last digits are its own."""
    if not share:
        return scene
    camera = {"position": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], **scene.get("camera", {})}

    def dot(a, b):
        return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]

    largest = max(map(abs, camera["up"]))
    up = [x / largest for x in camera["up"]]
    up = [x * (1 / math.sqrt(dot(up, up))) for x in up]
    d = [p - t for p, t in zip(camera["position"], camera["target"])]
    beside = [up[1] * d[2] - up[2] * d[1], up[2] * d[0] - up[0] * d[2], up[0] * d[1] - up[1] * d[0]]
    c, s = math.cos(2 * math.pi * share), math.sin(2 * math.pi * share)
    along = dot(up, d) * (1 - c)
    position = [t + (x * c + y * s + z * along) for t, x, y, z in zip(camera["target"], d, beside, up)]
    return {**scene, "camera": {**camera, "position": position}}


def frames_of(data):
    """Of Pillow: each frame as RGBA, and how long it is shown."""
    image = Image.open(io.BytesIO(data))
    found, durations = [], set()
    for i in range(image.n_frames):
        image.seek(i)
        found.append(numpy.array(image.convert("RGBA")).astype(int))
        durations.add(image.info["duration"])
    return image, found, durations


def chunks(data):
    """Of a PNG file, whose checksums are right."""
    at = 8
    while at < len(data):
        size, = struct.unpack(">I", data[at:at + 4])
        body = data[at + 4:at + 8 + size]
        assert struct.unpack(">I", data[at + 8 + size:at + 12 + size])[0] == zlib.crc32(body)
        yield body[:4].decode(), body[4:]
        at += 12 + size


class TurntableTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--threads", "2", "--max-pixels", "100000", "--max-samples", "200000")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def turn(self, scene=SCENE, headers=None, **turntable):
        answer = self.daemon.post("/v1/batch", {"scene": scene, "turntable": {"frames": 5, **turntable}}, headers)
        self.assertEqual(answer.status, 200, answer.body[:500])
        return answer

    def alone(self, scene, share, **output):
        answer = self.daemon.render({**turned(scene, share), "output": output})
        self.assertEqual(answer.status, 200, answer.body[:500])
        return numpy.array(Image.open(io.BytesIO(answer.body)).convert("RGBA")).astype(int)

    def test_frames_are_the_pictures_of_the_turned_camera(self):
        for kind, output in (("apng", {}), ("webp", {"quality": 100})):
            for background in (0.1, [0, 0, 0, 0]):
                scene = {**SCENE, "background": background, "output": output}
                answer = self.turn(scene, format=kind, duration=70)
                self.assertEqual(answer.headers["Content-Type"], f"image/{kind}")
                image, found, durations = frames_of(answer.body)
                self.assertEqual((image.size, image.info["loop"], durations), ((48, 32), 0, {70}))
                self.assertEqual(len(found), 5)
                png = {"format": "png"}
                numpy.testing.assert_array_equal(found[0], self.alone(scene, 0, **png))
                for i, frame in enumerate(found):
                    numpy.testing.assert_array_equal(frame, self.alone(scene, i / 5, **png))
                self.assertEqual(len({frame.tobytes() for frame in found}), 5)

    def test_a_quarter_of_a_turn_without_a_camera(self):
        scene = {"image": {"width": 40, "height": 40, "samples": 1}, "background": 0.2,
                 "objects": [{"type": "box", "size": [1, 2, 3]}]}
        found = frames_of(self.turn(scene, frames=4, format="apng").body)[1]
        for i, position in enumerate(([0, 0, 4], [4, 0, 0], [0, 0, -4], [-4, 0, 0])):
            answer = self.daemon.render({**scene, "camera": {"position": position}})
            expected = numpy.array(Image.open(io.BytesIO(answer.body)).convert("RGBA")).astype(int)
            # The sine of pi is not quite 0: an edge may go through another sample.
            self.assertLess((found[i] != expected).mean(), 0.01)

    def test_apng_is_a_png_whose_picture_is_the_first_frame(self):
        data = self.turn(format="apng", frames=7).body
        found = list(chunks(data))
        names = [name for name, _ in found]
        self.assertEqual((names[0], names[-1], names.count("acTL"), names.count("fcTL")), ("IHDR", "IEND", 1, 7))
        self.assertLess(names.index("acTL"), names.index("IDAT"))
        self.assertEqual(dict(found)["acTL"], struct.pack(">II", 7, 0))
        numbers = [struct.unpack(">I", body[:4])[0] for name, body in found if name in ("fcTL", "fdAT")]
        self.assertEqual(numbers, list(range(len(numbers))))
        plain = list(chunks(self.daemon.render(SCENE).body))
        self.assertEqual([chunk for chunk in found if chunk[0] not in ("acTL", "fcTL", "fdAT")], plain)

    def test_webp_is_what_it_is_by_default(self):
        answer = self.turn()
        self.assertEqual(answer.headers["Content-Type"], "image/webp")
        _, found, durations = frames_of(answer.body)
        self.assertEqual((len(found), durations), (5, {50}))
        numpy.testing.assert_array_equal(found[0], self.alone(SCENE, 0, format="webp"))

    def test_16_bits(self):
        data = self.turn({**SCENE, "output": {"bitDepth": 16}}, format="apng").body
        self.assertEqual(dict(chunks(data))["IHDR"][8], 16)

    def test_it_is_known_by_its_tag(self):
        answer = self.turn(frames=3)
        tag = answer.headers["ETag"]
        self.assertRegex(answer.headers["Shaded-Plan"], "^tier=standard; frames=3; error<=.*, worst of 3$")
        batch = {"scene": SCENE, "turntable": {"frames": 3}}
        self.assertEqual(self.daemon.post("/v1/batch", batch, {"If-None-Match": tag}).status, 304)
        self.assertEqual(self.turn(frames=3).body, answer.body)
        tags = {tag} | {self.turn(**change).headers["ETag"]
                        for change in ({"frames": 4}, {"frames": 3, "duration": 60}, {"frames": 3, "format": "apng"})}
        self.assertEqual(len(tags), 4)

    def refused(self, pointer, word, scene=SCENE, **members):
        answer = self.daemon.post("/v1/batch", {"scene": scene, **members})
        self.assertEqual(answer.status, 422, answer.body[:500])
        errors = json.loads(answer.body)["errors"]
        self.assertTrue([e for e in errors if e["pointer"] == pointer and word in e["detail"]], errors)

    def test_mistakes(self):
        self.refused("/turntable", "frames", turntable={})
        self.refused("/turntable/frames", "2 to 360", turntable={"frames": 361})
        self.refused("/turntable/format", "apng", turntable={"frames": 3, "format": "gif"})
        self.refused("/turntable/duration", "10 to", turntable={"frames": 3, "duration": 1})
        self.refused("/turntable/fps", "duration", turntable={"frames": 3, "fps": 1})
        self.refused("", "one scene", turntable={"frames": 3}, sheet={})
        self.refused("", "one scene", turntable={"frames": 3}, variants=[{}])
        self.refused("/scene/camera/position", "", {**SCENE, "camera": {"position": [1]}}, turntable={"frames": 3})
        self.refused("/scene/output/bitDepth", "", {**SCENE, "output": {"bitDepth": 16}}, turntable={"frames": 3})
        self.refused("/turntable", "`pixels`", turntable={"frames": 100})
        self.refused("/turntable", "`samples`", turntable={"frames": 40})

    def test_who_leaves_ends_it(self):
        with Daemon("--threads", "1", "--timeout", "300") as daemon:
            reader = Reader(daemon, {"scene": LONG, "turntable": {"frames": 2}})
            wait_until(lambda: daemon.metrics()["shaded_large_begun"] == 1)
            reader.close()
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)

    def test_it_has_one_deadline(self):
        with Daemon("--threads", "1", "--timeout", "1") as daemon:
            answer = daemon.post("/v1/batch", {"scene": LONG, "turntable": {"frames": 2}})
            self.assertEqual(answer.status, 504)
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)


if __name__ == "__main__":
    unittest.main()
