"""POST /v1/batch with a sheet: all variants in one picture."""

import gzip
import io
import json
import os
from pathlib import Path
import unittest

import numpy
from PIL import Image

from e2e.batch_test import Reader
from e2e.daemon import Daemon
from e2e.daemon_test import ENDLESS, wait_until

SCENE = {"image": {"width": 60, "height": 40, "samples": 1}, "objects": [{"type": "sphere", "material": "m"}],
         "materials": {"m": {"diffuse": [0.6, 0.3, 0.1], "specular": 0.5}}}
LONG = {**ENDLESS, "image": {"width": 2000, "height": 2000, "samples": 16}}
SHININESS = "/materials/m/shininess"
SWEEP = {SHININESS: [10, 30, 90, 270]}
GROUND = 0x26
GAP = 4  # of cells of this size


def pixels(data, kind="RGBA"):
    return numpy.array(Image.open(io.BytesIO(data)).convert(kind))


def swept(value, scene=SCENE):
    return {**scene, "materials": {"m": {**scene["materials"]["m"], "shininess": value}}}


class SheetTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--threads", "2", "--max-pixels", "100000", "--max-samples", "200000")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def sheet(self, headers=None, **batch):
        answer = self.daemon.post("/v1/batch", {"scene": SCENE, **batch}, headers)
        self.assertEqual(answer.status, 200, answer.body[:500])
        return answer

    def render(self, scene):
        answer = self.daemon.render(scene)
        self.assertEqual(answer.status, 200, answer.body[:500])
        return answer.body

    def cells(self, sheet, count, columns, label=0, width=60, height=40):
        """The pictures of a sheet, and the rest of it with these blacked out."""
        rest = sheet.copy()
        found = []
        for i in range(count):
            x = GAP + i % columns * (width + GAP)
            y = GAP + i // columns * (height + label + GAP)
            found.append(sheet[y:y + height, x:x + width])
            rest[y:y + height, x:x + width] = 0
        return found, rest

    def test_cells_are_the_pictures_of_their_variants(self):
        answer = self.sheet(sweep=SWEEP, sheet={"columns": 3, "labels": False})
        self.assertEqual(answer.headers["Content-Type"], "image/png")
        got = pixels(answer.body)
        self.assertEqual(got.shape, (GAP + 2 * (40 + GAP), GAP + 3 * (60 + GAP), 4))
        found, rest = self.cells(got, 4, 3)
        for cell, value in zip(found, SWEEP[SHININESS]):
            numpy.testing.assert_array_equal(cell, pixels(self.render(swept(value))))
        self.assertEqual(set(numpy.unique(rest[..., :3])), {0, GROUND})
        blank = rest[GAP + 44:GAP + 84, GAP + 64:]  # there are but four
        self.assertEqual(set(numpy.unique(blank[..., :3])), {GROUND})
        patched = self.sheet(variants=[{"materials": {"m": {"shininess": v}}} for v in SWEEP[SHININESS]],
                             sheet={"columns": 3, "labels": False})
        self.assertEqual(patched.body, answer.body)

    def test_formats_and_depths(self):
        for output, kind in (({"format": "webp", "quality": 100}, "webp"), ({"format": "tiff"}, "tiff"),
                             ({"bitDepth": 16}, "png"), ({"format": "jpeg"}, "jpeg"), ({"channel": "G"}, "png")):
            scene = {**SCENE, "output": output}
            answer = self.sheet(scene=scene, sweep=SWEEP, sheet={"columns": 2, "labels": False})
            self.assertEqual(answer.headers["Content-Type"], f"image/{kind}")
            got = pixels(answer.body).astype(int)
            cell = self.cells(got, 4, 2)[0][2]
            alone = pixels(self.render(swept(90, scene))).astype(int)
            # JPEG's blocks are others where a cell begins elsewhere.
            self.assertLessEqual(numpy.abs(cell - alone).mean(), 4 if kind == "jpeg" else 0, output)
        answer = self.sheet({"Accept": "image/webp"}, sheet={})
        self.assertEqual(answer.headers["Content-Type"], "image/webp")

    def test_transparent_cells_stay_so_among_opaque_ones(self):
        answer = self.sheet(sweep={"/background": [[0, 0, 0, 0], 0.5]}, sheet={"columns": 2, "labels": False})
        found, rest = self.cells(pixels(answer.body), 2, 2)
        self.assertEqual(found[0][0, 0, 3], 0)
        self.assertEqual((found[1][..., 3].min(), rest[0, 0].tolist()), (255, [GROUND] * 3 + [255]))
        for cell, background in zip(found, ([0, 0, 0, 0], 0.5)):
            numpy.testing.assert_array_equal(cell, pixels(self.render({**SCENE, "background": background})))

    def test_channels(self):
        scene = {**SCENE, "background": [0, 0, 0, 0]}
        for channels in (["R", "B"], ["A"], ["G"]):
            answer = self.sheet(scene=scene, sweep={"/output/channel": channels}, sheet={"columns": 2, "labels": False})
            found, _ = self.cells(pixels(answer.body), len(channels), 2)
            for cell, channel in zip(found, channels):
                alone = pixels(self.render({**scene, "output": {"channel": channel}}))
                numpy.testing.assert_array_equal(cell, alone, channel)
        for channels in (["A", "R"], ["R", "A"]):
            self.refused("/sweep/~1output~1channel/1", "alpha", scene=scene, sweep={"/output/channel": channels})

    def test_labels_are_below_their_cells(self):
        plain = pixels(self.sheet(sweep=SWEEP, sheet={"columns": 2, "labels": False}).body)
        made = self.sheet(sweep=SWEEP, sheet={"columns": 2}).body
        got = pixels(made)
        label = (got.shape[0] - plain.shape[0]) // 2
        self.assertGreater(label, 10)
        for one, other in zip(self.cells(got, 4, 2, label)[0], self.cells(plain, 4, 2)[0]):
            numpy.testing.assert_array_equal(one, other)
        rest = self.cells(got, 4, 2, label)[1]
        for row in (0, 1):  # something is written, and nothing beside it
            strip = rest[GAP + 40 + row * (44 + label):][:label, GAP:GAP + 60, 0]
            self.assertGreater((strip > 100).sum(), 20)
        between = numpy.concatenate([rest[:, x:x + GAP, 0] for x in (0, 60 + GAP, 2 * (60 + GAP))])
        self.assertEqual(set(numpy.unique(between)), {GROUND})
        given = [f"shininess {value}" for value in SWEEP[SHININESS]]
        self.assertEqual(self.sheet(sweep=SWEEP, sheet={"columns": 2, "labels": given}).body, made)
        self.assertNotEqual(self.sheet(sweep=SWEEP, sheet={"columns": 2, "labels": ["a", "b", "c", "d"]}).body, made)
        self.assertEqual(pixels(self.sheet(sweep=SWEEP, sheet={"labels": [""] * 4}).body).shape, plain.shape)

    def test_without_columns_it_is_about_square(self):
        for count, columns in ((1, 1), (2, 2), (4, 2), (9, 3), (12, 3)):
            answer = self.sheet(sweep={"/ambient": [i / 16 for i in range(count)]}, sheet={"labels": False})
            self.assertEqual(pixels(answer.body).shape[1], GAP + columns * (60 + GAP), count)

    def test_it_is_known_by_its_tag_and_kept(self):
        batch = {"sweep": {"/ambient": [0.11, 0.12]}, "sheet": {}}
        answer = self.sheet(**batch)
        tag = answer.headers["ETag"]
        self.assertIn("stored", answer.headers["Cache-Status"])
        self.assertRegex(answer.headers["Server-Timing"], "^queue;dur=.*, encode;dur=")
        self.assertRegex(answer.headers["Shaded-Plan"], "^tier=standard; sheet=2; error<=.* linear.*, worst of 2$")
        known = self.daemon.post("/v1/batch", {"scene": SCENE, **batch}, {"If-None-Match": tag})
        self.assertEqual((known.status, known.body, known.headers["ETag"]), (304, b"", tag))
        again = self.sheet(**batch)
        self.assertEqual((again.body, again.headers["ETag"]), (answer.body, tag))
        self.assertIn("hit", again.headers["Cache-Status"])
        tags = {tag} | {self.sheet(**{**batch, **change}).headers["ETag"] for change in (
            {"sheet": {"columns": 1}}, {"sheet": {"labels": False}}, {"sheet": {"labels": ["a", "b"]}},
            {"sweep": {"/ambient": [0.12, 0.11]}})}
        self.assertEqual(len(tags), 5)
        # The same bytes are no scene.
        self.assertEqual(self.daemon.render({"scene": SCENE, **batch}).status, 422)

    def test_the_bound_is_the_worst(self):
        def told(plan):
            return float(plan.split("error<=")[1].split()[0])
        values = SWEEP[SHININESS]
        alone = [told(self.daemon.render(swept(v)).headers["Shaded-Plan"]) for v in values]
        self.assertGreater(len(set(alone)), 1)
        self.assertEqual(told(self.sheet(sweep=SWEEP, sheet={"columns": 4}).headers["Shaded-Plan"]), max(alone))

    def refused(self, pointer, word, status=422, **batch):
        answer = self.daemon.post("/v1/batch", {"scene": SCENE, "sheet": {}, **batch})
        self.assertEqual(answer.status, status, answer.body[:500])
        errors = {error["pointer"]: error["detail"] for error in json.loads(answer.body)["errors"]}
        self.assertIn(pointer, errors)
        self.assertIn(word, errors[pointer])
        return json.loads(answer.body)

    def test_nothing_is_answered_by_halves(self):
        bad = {"materials": {"m": {"shininess": -5}}}
        self.refused("/variants/1", "/materials/m/shininess: ", variants=[{}, bad, {}])
        both = self.refused("/variants/2", "", variants=[{}, bad, {"objects": 3}])
        self.assertIn("/variants/1", [error["pointer"] for error in both["errors"]])
        self.refused("/sweep/~1materials~1m~1shininess/1", "", sweep={"/ambient": [0, 1], SHININESS: [5, -5]})
        self.refused("/scene/camera/fov", "", scene={**SCENE, "camera": {"fov": 900}}, sweep={"/ambient": [0, 1]})
        self.refused("/variants/1", "size", variants=[{}, {"image": {"width": 61}}])
        self.refused("/sweep/~1image~1height/1", "size", sweep={"/image/height": [30, 31]})
        self.refused("/sweep/~1output~1format/1", "format", sweep={"/output/format": ["png", "jpeg"]})
        self.refused("/variants/1", "depth", variants=[{}, {"output": {"bitDepth": 16}}])
        self.refused("/variants/0", "16 bits", variants=[{"output": {"format": "exr"}}])
        self.refused("/variants/0", "one picture", variants=[{"outputs": [{"name": "a"}]}])
        budget = {"accuracy": {"maxError": 4, "metric": "code"}}
        self.refused("/variants/1", "budget", variants=[{}, budget], scene={**SCENE, "output": {"format": "jpeg"}})
        self.assertEqual(self.sheet(variants=[{}, budget], sheet={}).status, 200)

    def test_mistakes_in_the_sheet_itself(self):
        self.refused("/sheet/colums", "columns", sheet={"colums": 2})
        self.refused("/sheet/columns", "1 to 1000", sheet={"columns": 0})
        self.refused("/sheet/labels", "each variant", sheet={"labels": ["a"]}, sweep=SWEEP)
        self.refused("/sheet/labels", "texts", sheet={"labels": "yes"})
        self.refused("/sheet/labels/0", "64", sheet={"labels": ["a" * 65]})
        self.refused("/sheet", "1000", sweep={"/ambient": [i / 2000 for i in range(1001)]})
        self.refused("/sheet", "", sheet=True)

    def test_limits_are_those_of_one_picture(self):
        problem = self.refused("/sheet", "`pixels`", sweep={"/ambient": [i / 64 for i in range(40)]})
        self.assertEqual(problem["type"], "urn:shaded:problem:limit")
        many = {**SCENE, "image": {"width": 60, "height": 40, "samples": 16}}
        self.refused("/sheet", "`samples`", scene=many, sweep={"/ambient": [i / 64 for i in range(8)]})

    def test_the_contact_sheet_of_the_examples(self):
        batch = json.loads((Path(os.environ["SHADED_SOURCE"]) / "api/batches/contact-sheet.json").read_text())
        batch["scene"]["image"] = {"width": 60, "height": 40, "samples": 1}
        found, _ = self.cells(pixels(self.sheet(**batch).body), 12, 4, 18)
        self.assertEqual(len({cell.tobytes() for cell in found}), 12)

    def test_many_long_documents_have_a_turn_of_their_own(self):
        many = {**SCENE, "lights": [{"type": "point", "position": [i / 7, 3, 4]} for i in range(300)]}
        batch = {"scene": many, "sweep": {"/ambient": [i / 16 for i in range(8)]}, "sheet": {"labels": False}}
        plain = self.sheet(**batch)
        body = gzip.compress(json.dumps(batch).encode())
        self.assertLess(len(json.dumps(batch)), 64 << 10)
        with Daemon("--threads", "1", "--response-cache", "0") as daemon:
            for coding in ({}, {"Content-Encoding": "gzip"}):
                got = daemon.post("/v1/batch", body if coding else batch, coding)
                self.assertEqual((got.status, got.body), (200, plain.body))
        expected = pixels(self.render({**many, "ambient": 7 / 16}))
        numpy.testing.assert_array_equal(self.cells(pixels(plain.body), 8, 3)[0][7], expected)

    def test_accept_has_a_say(self):
        for accept, status in (("image/png", 200), ("multipart/form-data", 406), ("text/css", 406), ("*/*", 200)):
            answer = self.daemon.post("/v1/batch", {"scene": SCENE, "sheet": {}}, {"Accept": accept})
            self.assertEqual(answer.status, status, accept)

    def test_who_leaves_ends_it(self):
        batch = {"scene": LONG, "sweep": {"/ambient": [0.1, 0.2]}, "sheet": {}}
        with Daemon("--threads", "1", "--timeout", "300") as daemon:
            reader = Reader(daemon, batch)
            wait_until(lambda: daemon.metrics()["shaded_large_begun"] == 1)
            reader.close()
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)

    def test_it_has_one_deadline(self):
        batch = {"scene": LONG, "sweep": {"/ambient": [0.1, 0.2]}, "sheet": {}}
        with Daemon("--threads", "1", "--timeout", "1") as daemon:
            self.assertEqual(daemon.post("/v1/batch", batch).status, 504)
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)


if __name__ == "__main__":
    unittest.main()
