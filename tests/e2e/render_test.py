"""POST /v1/render: pictures, formats, headers, several outputs, many clients."""

import email
import email.policy
import io
import json
import re
import threading
import unittest

from PIL import Image

from e2e.daemon import SANITIZED, SMALL, Daemon

SIGNATURES = {"image/png": b"\x89PNG\r\n\x1a\n", "image/jpeg": b"\xff\xd8\xff",
              "image/webp": b"RIFF", "image/tiff": b"II*\0", "image/x-exr": b"v/1\x01",
              "image/vnd.radiance": b"#?RADIANCE"}
NAMES = {"png": "image/png", "jpeg": "image/jpeg", "webp": "image/webp", "tiff": "image/tiff",
         "exr": "image/x-exr", "hdr": "image/vnd.radiance"}
STAGES = ["queue", "parse", "plan", "visibility", "shade", "color", "encode"]


def parts(answer):
    """The parts of a multipart answer, by Python's own MIME parser."""
    head = f"Content-Type: {answer.headers['Content-Type']}\r\n\r\n".encode()
    message = email.message_from_bytes(head + answer.body, policy=email.policy.HTTP)
    return list(message.iter_parts())


class RenderTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--response-cache", "0", "--cache-control", "private, max-age=7")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def render(self, scene, accept=None, **headers):
        if accept is not None:
            headers["Accept"] = accept
        return self.daemon.render(scene, headers)

    def assert_picture(self, answer, media_type):
        self.assertEqual(answer.status, 200, answer.body[:1000])
        self.assertEqual(answer.headers["Content-Type"], media_type)
        self.assertEqual(int(answer.headers["Content-Length"]), len(answer.body))
        self.assertTrue(answer.body.startswith(SIGNATURES[media_type]), answer.body[:20])

    def test_the_smallest_request_shows_a_sphere(self):
        answer = self.render('{"objects":[{"type":"sphere"}]}')
        self.assert_picture(answer, "image/png")
        picture = Image.open(io.BytesIO(answer.body))
        self.assertEqual(picture.size, (512, 512))
        self.assertGreater(picture.convert("L").getpixel((256, 256)), 100)
        self.assertEqual(picture.convert("RGB").getpixel((0, 0)), (0, 0, 0))

    def test_every_header_of_a_picture(self):
        answer = self.render(SMALL, **{"X-Request-Id": "headers"})
        self.assertRegex(answer.headers["ETag"], '^"[0-9a-f]{16,64}"$')
        self.assertEqual(answer.headers["Cache-Control"], "private, max-age=7")
        self.assertEqual(answer.headers["Vary"], "Accept")
        self.assertEqual(answer.headers["X-Request-Id"], "headers")
        self.assertIn("tier=standard", answer.headers["Shaded-Plan"])
        self.assertIsNone(answer.headers["Shaded-Warning"])
        self.assertIsNone(answer.headers["Shaded-Saturated"])
        *stages, reuse = answer.headers["Server-Timing"].split(", ")
        timing = [entry.split(";dur=") for entry in stages]
        self.assertEqual([name for name, _ in timing], STAGES)
        self.assertRegex(reuse, "^reuse;desc=(nothing|geometry|light)$")
        self.assertTrue(all(re.fullmatch(r"\d+\.\d{3}", value) for _, value in timing))

    def test_rays_from_mirrors_have_a_stage(self):
        mirror = {"type": "sphere", "radius": 0.4, "material": {"reflection": 0.5}}
        scene = {**SMALL, "objects": [mirror, {"type": "plane", "transform": {"translate": [0, -1, 0]}}], "trace": {"depth": 2}}
        timing = self.render(scene).headers["Server-Timing"]
        self.assertRegex(timing, r", shade;dur=[\d.]+, trace;dur=[\d.]+, color;dur=")
        counted = self.daemon.metrics()
        self.assertGreater(counted['shaded_stage_duration_seconds_count{stage="trace"}'], 0)
        self.render({**SMALL, "camera": {"fov": 33}})
        self.assertEqual(self.daemon.metrics()
                         ['shaded_stage_duration_seconds_count{stage="trace"}'],
                         counted['shaded_stage_duration_seconds_count{stage="trace"}'])

    def test_shadows_have_a_stage(self):
        floor = {"type": "plane", "transform": {"translate": [0, -1, 0]}}
        scene = {**SMALL, "objects": [{"type": "sphere", "radius": 0.4}, floor], "trace": {"shadows": True}}
        timing = self.render(scene).headers["Server-Timing"]
        self.assertRegex(timing, r", shade;dur=[\d.]+, shadow;dur=[\d.]+, color;dur=")
        count = 'shaded_stage_duration_seconds_count{stage="shadow"}'
        counted = self.daemon.metrics()[count]
        self.assertGreater(counted, 0)
        self.render({**SMALL, "camera": {"fov": 34}})
        self.assertEqual(self.daemon.metrics()[count], counted)
        flat = self.render({**scene, "objects": [floor]}).headers["Server-Timing"]
        self.assertRegex(flat, r", shade;dur=[\d.]+,")

    def test_a_picture_takes_from_earlier_ones_what_did_not_change(self):
        def scene(red, light, radius):
            return {**SMALL, "lights": [{"type": "point", "position": [light, 2, 3]}],
                    "objects": [{"type": "sphere", "radius": radius,
                                 "material": {"diffuse": [red, 0.5, 0.5]}}]}

        before = self.daemon.metrics()
        for step, reused in ((scene(0.6, 1, 0.77), "nothing"), (scene(0.7, 1, 0.77), "light"),
                             (scene(0.7, 2, 0.77), "geometry"), (scene(0.7, 2, 0.78), "nothing")):
            answer = self.render(step)
            self.assertIn(f"reuse;desc={reused}", answer.headers["Server-Timing"])
        after = self.daemon.metrics()

        def grown(kind, result):
            name = f'shaded_reuse_lookups_total{{kind="{kind}",result="{result}"}}'
            return after[name] - before[name]

        self.assertEqual(grown("light", "hit"), 1)
        self.assertEqual(grown("light", "miss"), 3)
        self.assertEqual(grown("geometry", "hit"), 1)
        self.assertEqual(grown("geometry", "miss"), 2)
        self.assertGreater(after["shaded_reuse_bytes"], 0)

    def test_the_same_request_gives_the_same_bytes_and_tag(self):
        one, two = self.render(SMALL), self.render(json.dumps(SMALL, indent=3))
        self.assertEqual(one.body, two.body)
        self.assertEqual(one.headers["ETag"], two.headers["ETag"])
        tags = {one.headers["ETag"]}
        for change in ({"ambient": 0.5}, {"image": {"width": 17, "height": 12, "samples": 1}},
                       {"output": {"quality": 3, "format": "jpeg"}},
                       {"output": {"view": "Raw"}}):
            tags.add(self.render({**SMALL, **change}).headers["ETag"])
        tags.add(self.render(SMALL, "image/webp").headers["ETag"])
        self.assertEqual(len(tags), 6)

    def test_a_known_tag_is_answered_without_rendering(self):
        tag = self.render(SMALL).headers["ETag"]
        before = self.daemon.metrics()
        for condition in (tag, "W/" + tag, f'"a", {tag} , "b"', f"*, {tag}"):
            answer = self.render(SMALL, **{"If-None-Match": condition})
            self.assertEqual((answer.status, answer.body), (304, b""))
            self.assertEqual(answer.headers["ETag"], tag)
            self.assertEqual(answer.headers["Cache-Control"], "private, max-age=7")
            self.assertEqual(answer.headers["Vary"], "Accept")
        after = self.daemon.metrics()
        shade = 'shaded_stage_duration_seconds_count{stage="shade"}'
        self.assertEqual(before[shade], after[shade])
        for condition in ('"other"', tag[1:-1], "*"):
            self.assertEqual(self.render(SMALL, **{"If-None-Match": condition}).status, 200)
        other = self.render(SMALL, "image/jpeg", **{"If-None-Match": tag})
        self.assertEqual(other.status, 200)
        never = {**SMALL, "ambient": 0.123}
        for condition in ("*", ' * ', '*, "other"'):
            self.assertEqual(self.render(never, **{"If-None-Match": condition}).status, 200)
        wrong = self.render({**SMALL, "ambience": 1}, **{"If-None-Match": tag})
        self.assertEqual(wrong.status, 422)

    # ---- Formats ----

    def test_accept_chooses_the_format(self):
        for accept, wanted in {
                None: "png", "": "png", "*/*": "png", "image/*": "png",
                "image/png": "png", "image/jpeg": "jpeg", "image/jpg": "jpeg",
                "image/webp": "webp", "image/tiff": "tiff", "image/tif": "tiff",
                "image/x-exr": "exr", "image/exr": "exr", "image/vnd.radiance": "hdr",
                "image/hdr": "hdr", "IMAGE/WebP": "webp",
                "image/webp;q=0.5, image/tiff;q=0.6": "tiff",
                "image/avif,image/webp,image/*;q=0.8": "webp",
                "text/html, image/jpeg;q=0.9, */*;q=0.8": "jpeg",
                "image/*, image/png;q=0": "jpeg",
                "image/*, image/png;q=0, image/jpeg;q=0": "webp",
                "image/png;q=0.1, */*;q=0.2, image/jpeg;q=0.15": "webp",
                "image/jpeg ; q=0.3 , image/png ;q=0.2": "jpeg",
                "image/jpeg;a=\"b,c;q=0\";q=1, image/png;q=0.9": "jpeg",
                "image/jpeg;q=1.000,image/png;q=0.999": "jpeg"}.items():
            with self.subTest(accept):
                self.assert_picture(self.render(SMALL, accept), NAMES[wanted])

    def test_accept_fields_add_up(self):
        body = json.dumps(SMALL).encode()
        data = self.daemon.raw(b"POST /v1/render HTTP/1.1\r\nHost: a\r\nConnection: close\r\n"
                               b"Content-Type: application/json\r\nAccept: text/html\r\n"
                               b"accept: image/webp\r\nContent-Length: %d\r\n\r\n" % len(body),
                               body)
        self.assertIn(b"\r\nContent-Type: image/webp\r\n", data)

    def test_the_scene_chooses_before_accept(self):
        for name, media_type in NAMES.items():
            answer = self.render({**SMALL, "output": {"format": name}}, "image/png, image/webp")
            self.assert_picture(answer, media_type)

    def test_unacceptable(self):
        for accept in ("text/html", "application/json", "image/png;q=0", "image/*;q=0.0, text/*",
                       "image/gif", "multipart/form-data", "*/*;q=0"):
            answer = self.render(SMALL, accept)
            self.assertEqual(answer.status, 406, accept)
            self.assertEqual(json.loads(answer.body)["type"], "urn:shaded:problem:not-acceptable")
            self.assertEqual(answer.headers["Cache-Control"], "no-store")

    def test_depths_and_channels_pass_through(self):
        sixteen = self.render({**SMALL, "output": {"format": "png", "bitDepth": 16}})
        self.assertEqual(sixteen.body[24], 16)
        grey = self.render({**SMALL, "output": {"format": "png", "channel": "R"}})
        self.assertEqual(Image.open(io.BytesIO(grey.body)).mode, "L")

    def test_alpha_is_a_channel_in_formats_that_hold_none(self):
        for output in ({"format": "jpeg", "quality": 100}, {"format": "png"}):
            answer = self.render({**SMALL, "background": None, "output": {**output, "channel": "A"}})
            self.assertNotIn("Shaded-Warning", answer.headers)
            matte = Image.open(io.BytesIO(answer.body))
            self.assertLess(matte.getpixel((0, 0)), 8)
            self.assertGreater(matte.getpixel((8, 6)), 247)
        color = self.render({**SMALL, "background": None, "output": {"format": "jpeg"}})
        self.assertIn("laid over black", color.headers["Shaded-Warning"])

    # ---- Several outputs ----

    def test_outputs_come_as_form_data(self):
        outputs = [{"name": "beauty", "format": "png"}, {"name": "small", "format": "jpeg"},
                   {"name": "light", "format": "exr"}, {"name": "auto"}]
        scene = {**SMALL, "outputs": outputs}
        answer = self.render(scene, "image/webp, multipart/form-data")
        self.assertEqual(answer.status, 200, answer.body)
        self.assertRegex(answer.headers["Content-Type"],
                         r"^multipart/form-data; boundary=[0-9A-Za-z-]{1,70}$")
        found = parts(answer)
        self.assertEqual([part.get_content_disposition() for part in found], ["form-data"] * 4)
        self.assertEqual([part["Content-Disposition"].params["name"] for part in found],
                         ["beauty", "small", "light", "auto"])
        self.assertEqual([part.get_filename() for part in found],
                         ["beauty.png", "small.jpeg", "light.exr", "auto.webp"])
        for part, name in zip(found, ("png", "jpeg", "exr", "webp")):
            self.assertEqual(part.get_content_type(), NAMES[name])
            data = part.get_payload(decode=True)
            self.assertTrue(data.startswith(SIGNATURES[NAMES[name]]))
        single = self.render({**SMALL, "output": {"format": "png"}})
        self.assertEqual(found[0].get_payload(decode=True), single.body)
        again = self.render(scene, "image/webp, multipart/form-data")
        self.assertEqual((again.body, again.headers["Content-Type"]),
                         (answer.body, answer.headers["Content-Type"]))
        known = self.render(scene, "image/webp", **{"If-None-Match": answer.headers["ETag"]})
        self.assertEqual(known.status, 304)

    def test_multipart_alone_is_acceptable_for_outputs(self):
        answer = self.render({**SMALL, "outputs": [{"name": "a"}]}, "multipart/form-data")
        self.assertEqual(answer.status, 200)
        self.assertEqual(parts(answer)[0].get_content_type(), "image/png")

    # ---- What was done, and what may not be meant ----

    def test_warnings_are_told_in_safe_headers(self):
        materials = {f"m{i}\u00e9%": {"diffuse": 1.1 + i} for i in range(12)}
        objects = [{"type": "sphere", "material": name} for name in materials]
        answer = self.render({**SMALL, "materials": materials, "objects": objects})
        self.assertEqual(answer.status, 200, answer.body)
        warnings = answer.headers.get_all("Shaded-Warning")
        self.assertEqual(len(warnings), 8)
        for i, warning in enumerate(warnings):
            self.assertTrue(warning.isascii())
            self.assertTrue(warning.endswith(f'";pointer="/materials/m{i}%C3%A9%25"'), warning)
        # Joined, as clients and proxies may, they are the members of one list.
        members = re.findall(r'"([^"]*)";pointer="([^"]*)"(?:, |$)', ", ".join(warnings))
        self.assertEqual([f'"{detail}";pointer="{pointer}"' for detail, pointer in members], warnings)
        self.assertTrue(all(", " in detail for detail, _ in members))

    def test_saturation_is_counted(self):
        scene = {**SMALL, "output": {"format": "exr", "bitDepth": "half"},
                 "objects": [{"type": "sphere", "material": {"emissive": 1e30}}]}
        answer = self.render(scene)
        self.assertEqual(answer.status, 200, answer.body[:500])
        count = int(answer.headers["Shaded-Saturated"])
        self.assertGreater(count, 0)
        self.assertGreaterEqual(self.daemon.metrics()["shaded_saturated_samples_total"], count)
        # One channel of all that is seen; beyond halves, and beyond floats.
        for red, output in ((1e30, scene["output"]), (1e39, {}), (1e39, {"bitDepth": 16})):
            wall = {"type": "disc", "radius": 1000, "transform": {"rotate": [90, 0, 0]},
                    "material": {"diffuse": 0, "emissive": [red, 0.5, 0]}}
            answer = self.render({"objects": [wall], "output": output,
                                  "image": {"width": 70, "height": 40, "samples": 1}})
            self.assertEqual(answer.headers["Shaded-Saturated"], str(70 * 40))

    def test_clipped_samples_are_counted(self):
        wall = {"type": "disc", "radius": 1000, "transform": {"rotate": [90, 0, 0]}}
        image = {"width": 70, "height": 40, "samples": 1}

        def clipped(color, **output):
            scene = {"objects": [{**wall, "material": {"diffuse": 0, "emissive": color}}],
                     "image": image, "output": output}
            answer = self.render(scene)
            self.assertEqual(answer.status, 200, answer.body[:500])
            return int(answer.headers["Shaded-Clipped"] or 0) / (70 * 40)

        before = self.daemon.metrics()["shaded_clipped_samples_total"]
        for depth in 8, 16:
            for space in "sRGB", "Display P3", "raw":
                output = {"bitDepth": depth, "colorSpace": space}
                self.assertEqual(clipped([0, 0.5, 1], **output), 0, output)
                # The nearest code is still 1.
                self.assertEqual(clipped([1 + 1e-6] * 3, **output), 0, output)
                self.assertEqual(clipped([1.5, 1.5, 1.5], **output), 3, output)
            self.assertEqual(clipped([1.5, 0.5, -0.5], bitDepth=depth), 2)
            self.assertEqual(clipped([1.5, 0.5, -0.5], bitDepth=depth, channel="G"), 0)
            self.assertEqual(clipped([1.5, 0.5, -0.5], bitDepth=depth, channel="B"), 1)
        self.assertEqual(clipped([1.5, 0.5, -0.5], format="jpeg"), 2)
        self.assertEqual(clipped([1.5, 0.5, -0.5], format="exr"), 0)
        self.assertGreater(self.daemon.metrics()["shaded_clipped_samples_total"], before)
        # A background, too, is seen.
        answer = self.render({"objects": [], "background": [2, 0, 0], "image": image})
        self.assertEqual(answer.headers["Shaded-Clipped"], str(70 * 40))

    # ---- Many at once ----

    def test_16_clients_get_identical_pictures(self):
        size = 48 if SANITIZED else 128
        scene = {"objects": [{"type": "torus", "material": {"preset": "brass"}}],
                 "image": {"width": size, "height": size}}
        wanted = self.render(scene).body
        others = [{**scene, "background": [i / 16, 0, 0]} for i in range(4)]
        other_bodies = [self.render(other).body for other in others]
        wrong = []

        def work(number):
            for turn in range(4):
                answer = self.render(scene)
                if answer.status != 200 or answer.body != wanted:
                    wrong.append((number, turn, answer.status))
                which = (number + turn) % 4
                answer = self.render(others[which])
                if answer.status != 200 or answer.body != other_bodies[which]:
                    wrong.append((number, turn, answer.status, which))

        threads = [threading.Thread(target=work, args=(i,)) for i in range(16)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(wrong, [])


if __name__ == "__main__":
    unittest.main()
