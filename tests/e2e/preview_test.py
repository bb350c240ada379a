"""GET /v1/preview/{material}: pictures to link to, and links that are signed."""

import base64
import hashlib
import hmac
import io
import json
import re
import signal
import subprocess
import time
import unittest
from urllib.parse import quote, urlencode

from PIL import Image, ImageChops

from e2e.cache_test import HIT, STORED, status
from e2e.daemon import SMALL, SOURCE, Daemon
from e2e.daemon_test import Folder
from e2e.queue_test import encoded
from e2e.render_test import NAMES

SHAPES = ("sphere", "plane", "disc", "box", "cylinder", "cone", "torus", "teapot", "ball")
# What Chromium sends for <img>.
IMG = "image/avif,image/webp,image/apng,image/svg+xml,image/*,*/*;q=0.8"


def link(material="brass", **parameters):
    return f"/v1/preview/{quote(material)}" + ("?" + urlencode(parameters) if parameters else "")


class PictureTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--cache-control", "public, max-age=77", "--max-pixels", "1000000")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def picture(self, path, media_type="image/png", **headers):
        answer = self.daemon.get(path, headers)
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, media_type),
                         answer.body[:500])
        return answer

    def test_every_library_material_has_one(self):
        materials = json.loads(self.daemon.get("/v1/materials").body)["materials"]
        self.assertGreater(len(materials), 20)
        bodies = {self.picture(link(material["name"], size=32)).body for material in materials}
        self.assertEqual(len(bodies), len(materials))

    def test_every_shape_shows_in_the_middle_of_the_picture(self):
        bodies = set()
        for shape in SHAPES:
            answer = self.picture(link(shape=shape, size=48))
            bodies.add(answer.body)
            picture = Image.open(io.BytesIO(answer.body)).convert("RGB")
            self.assertEqual(picture.size, (48, 48))
            if shape != "plane":  # it has no end
                left, top, right, bottom = self.frame(picture)
                for size in (right - left, *([] if shape == "teapot" else [bottom - top])):  # alike; a teapot is wide
                    self.assertTrue(48 * 0.54 < size < 48 * 0.8, (shape, size))
                self.assertLess(abs(left + right - 48), 6, shape)
                self.assertLess(abs(top + bottom - 48), 6, shape)
            red, _, blue = picture.getpixel((24, 35 if shape == "torus" else 26))
            self.assertGreater(red, 1.5 * blue, shape)
        self.assertEqual(len(bodies), len(SHAPES))
        self.assertEqual(self.picture(link(size=48)).body,
                         self.picture(link(size=48, shape="sphere")).body)

    @staticmethod
    def frame(picture):
        """The box around what differs from the background."""
        background = Image.new("RGB", picture.size, picture.getpixel((0, 0)))
        return ImageChops.difference(picture, background).getbbox()

    def test_every_shape_stands_on_the_ground(self):
        """The ground is at the height of the lowest row of a picture from the side, in steps of 3 / 768."""
        text = (SOURCE / "src/server/jobs/preview.c").read_text()
        table = re.findall(r'\{"(\w+)",\s*("(?:[^"\\]|\\.)*"),\s*(-[\d.]+)\}', text)
        self.assertEqual({row[0] for row in table}, set(SHAPES) - {"plane"})
        for shape, members, bottom in table:
            seen = self.daemon.post("/v1/render", {
                "camera": {"type": "orthographic", "position": [0, 0, 9], "height": 3}, "background": 0,
                "image": {"width": 768, "height": 768}, "objects": [
                    {"type": shape, **json.loads(json.loads(members)), "material": {"emissive": 1}}]})
            self.assertEqual(seen.status, 200, seen.body)
            lowest = Image.open(io.BytesIO(seen.body)).convert("L").point(lambda v: 255 * (v > 100)).getbbox()[3]
            self.assertLess(abs(1.5 - 3 * lowest / 768 - float(bottom)), 3 / 768, shape)

    def test_the_ground_is_there_if_it_is_asked_for(self):
        plain = self.picture(link(size=64, shape="teapot"))
        self.assertEqual(self.picture(link(size=64, shape="teapot", ground="false")).body, plain.body)
        stands = Image.open(io.BytesIO(self.picture(link(size=64, shape="teapot", ground="true")).body)).convert("L")
        floor = stands.getpixel((2, 60))
        self.assertGreater(floor, Image.open(io.BytesIO(plain.body)).convert("L").getpixel((2, 60)) + 30)
        shadow = [stands.getpixel((x, 36)) for x in range(56, 64)]
        self.assertLess(min(shadow), 0.75 * floor)

    def test_black_rubber_is_seen_in_every_shape(self):
        for shape in SHAPES:
            answer = self.picture(link("black-rubber", shape=shape, size=96))
            picture = Image.open(io.BytesIO(answer.body)).convert("L")
            background = picture.getpixel((0, 0))
            shades = [picture.getpixel((x, y)) for y in range(96) for x in range(96)]
            if shape == "plane":
                self.assertGreater(max(shades) - min(shades), 40)
                continue
            shown = [shade for shade in shades if abs(shade - background) > 8]
            self.assertGreater(len(shown), 96 * 96 / 6, shape)  # it stands out
            self.assertGreater(max(shown) - min(shown), 40, shape)  # and light is seen on it

    def test_gold_is_no_beige(self):
        """Its published diffuse color, where the lamp shines straight: (192, 155, 58)."""
        answer = self.picture(link("gold", shape="box", size=96))
        red, green, blue = Image.open(io.BytesIO(answer.body)).convert("RGB").getpixel((32, 55))
        self.assertTrue(1.1 < red / green < 1.5 and red / blue > 2.5, (red, green, blue))

    def test_size_view_color_space_and_format(self):
        self.assertEqual(Image.open(io.BytesIO(self.picture(link()).body)).size, (256, 256))
        plain = self.picture(link(size=20)).body
        for change in ({"view": "Raw"}, {"view": "ACES 1.0 - SDR Video"}, {"colorSpace": "HSV"},
                       {"colorSpace": "YIQ linear"}):
            self.assertNotEqual(self.picture(link(size=20, **change)).body, plain)
        # "YIQ linear": as forms write it, and as encodeURIComponent does.
        self.assertEqual(self.picture("/v1/preview/brass?size=20&colorSpace=YIQ+linear").body,
                         self.picture("/v1/preview/brass?colorSpace=YIQ%20linear&&size=20&").body)
        for name, media_type in NAMES.items():
            self.picture(link(size=20, format=name), media_type)

    def test_width_height_background_and_samples(self):
        def pixels(**parameters):
            return Image.open(io.BytesIO(self.picture(link(**parameters)).body))

        self.assertEqual(pixels(size=20, width=30).size, (30, 20))
        self.assertEqual(pixels(width=30, height=24).size, (30, 24))
        self.assertEqual(pixels(size=20, background="transparent").getpixel((0, 0))[3], 0)
        self.assertEqual(pixels(size=20, background="#102030").getpixel((0, 0))[:3], (16, 32, 48))
        self.assertEqual(pixels(size=20, background="0,1,0").getpixel((0, 0))[:3], (0, 255, 0))
        self.assertEqual(pixels(size=20, background="Teal").getpixel((0, 0))[:3], (0, 128, 128))
        self.assertEqual(pixels(size=20, background="hsl(0 100% 50% / 20%)").getpixel((0, 0)), (255, 0, 0, 51))
        self.assertEqual(pixels(size=20, background="0,0,1,0.6").getpixel((0, 0)), (0, 0, 255, 153))
        self.assertEqual(pixels(size=20, background=1).getpixel((0, 0))[:3], (255, 255, 255))
        self.assertEqual(self.picture(link(size=20, samples=9)).body, self.picture(link(size=20)).body)

    def test_coefficients_of_the_material_may_be_others(self):
        plain = self.picture(link("planet", size=20)).body
        for change in ({"diffuse": "0.8,0.1,0.1"}, {"diffuse": "#cc2233"}, {"ambient": 0.5},
                       {"emissive": 0.1}, {"specular": 0.5}, {"display": "Rec.1886"},
                       {"samples": 1}):
            self.assertNotEqual(self.picture(link("planet", size=20, **change)).body, plain, change)
        shiny = self.picture(link(size=20, shininess=1.5)).body
        self.assertNotEqual(shiny, self.picture(link(size=20)).body)
        jpeg = [len(self.picture(link(size=64, format="jpeg", quality=quality), "image/jpeg").body)
                for quality in (10, 95)]
        self.assertLess(*jpeg)
        scene = {"objects": [{"type": "sphere"}], "output": {"format": "webp", "quality": 80},
                 "image": {"width": 96, "height": 96, "samples": 1}}
        for quality in (80, 100):
            sizes = []
            for effort in (0, 6):
                output = {"format": "webp", "quality": quality, "effort": effort}
                sizes.append(len(self.daemon.render({**scene, "output": output}).body))
            self.assertGreater(*sizes)

    def test_accept_chooses_where_the_link_does_not(self):
        answer = self.picture(link(size=20), "image/png", Accept=IMG)
        self.assertEqual(answer.headers["Vary"], "Accept")
        self.picture(link(size=20), "image/webp", Accept="image/webp,image/*;q=0.8")
        self.picture(link(size=20, format="jpeg"), "image/jpeg", Accept="image/webp")
        for accept in ("text/html", "multipart/form-data"):
            answer = self.daemon.get(link(size=20), {"Accept": accept})
            self.assertEqual(answer.status, 406)

    def test_it_is_the_picture_of_a_document(self):
        """With its tag, its headers, its place in the cache, and known by it."""
        first = self.picture(link(size=24, shape="cone"))
        self.assertEqual(status(first), STORED)
        self.assertEqual(first.headers["Cache-Control"], "public, max-age=77")
        self.assertIn("tier=standard", first.headers["Shaded-Plan"])
        for path in (link(size=24, shape="cone"), link(shape="cone", size=24)):
            again = self.picture(path)
            self.assertEqual((status(again), again.body), (HIT, first.body))
            known = self.daemon.get(path, {"If-None-Match": first.headers["ETag"]})
            self.assertEqual((known.status, known.body), (304, b""))
        made = encoded(self.daemon)
        head = self.daemon.call("HEAD", link(size=24, shape="cone"))
        self.assertEqual((head.status, head.body, status(head)), (200, b"", HIT))
        self.assertEqual(int(head.headers["Content-Length"]), len(first.body))
        self.assertEqual(head.headers["ETag"], first.headers["ETag"])
        self.assertEqual(encoded(self.daemon), made)
        new = self.daemon.call("HEAD", link(size=25))
        self.assertEqual((new.status, new.body, status(new)), (200, b"", STORED))
        routes = {name for name in self.daemon.metrics()
                  if name.startswith('shaded_requests_total{route="/v1/preview"')}
        self.assertIn('shaded_requests_total{route="/v1/preview",status="200"}', routes)

    # ---- Mistakes ----

    def refused(self, path, code, kind):
        answer = self.daemon.get(path)
        self.assertEqual((answer.status, answer.headers["Content-Type"]),
                         (code, "application/problem+json"), path)
        self.assertEqual(answer.headers["Cache-Control"], "no-store")
        problem = json.loads(answer.body)
        self.assertEqual(problem["type"], f"urn:shaded:problem:{kind}")
        return problem

    def test_each_wrong_parameter_is_named(self):
        for query, parameter, word in (
                ("shape=tors", "shape", 'did you mean "torus"'), ("shape=", "shape", "sphere"),
                ("ground=1", "ground", "true or false"), ("shape=plane&ground=true", "ground", "no end"),
                ("shape=mesh", "shape", "no preview"), ("shape=%00", "shape", "UTF-8"),
                ("shape=%ff", "shape", "UTF-8"), ("shape=sphere%00", "shape", "UTF-8"),
                ("size=0", "size", "from 1"), ("size=65536", "size", "65535"),
                ("size=-1", "size", "integer"), ("size=1.5", "size", "integer"),
                ("size=1e2", "size", "integer"), ("size=", "size", "integer"),
                ("size=9999999999999999999", "size", "integer"), ("size", "size", "integer"),
                ("view=Standerd", "view", 'did you mean "Standard"'),
                ("colorSpace=lin", "colorSpace", "lin_rec709"),
                ("view=Raw&colorSpace=raw", "colorSpace", "not both"),
                ("format=pgn", "format", 'did you mean "png"'),
                ("expires=soon", "expires", "integer"),
                ("size=9&size=9", "size", "more than once"),
                ("width=0", "width", "from 1 to 65535"), ("height=70000", "height", "from 1"),
                ("size=9&width=0", "width", "from 1"), ("width=x", "width", "integer"),
                ("samples=65", "samples", "1 to 64"), ("samples=x", "samples", "integer"),
                ("quality=0", "quality", "1 to 100"), ("background=rde", "background", 'did you mean "red"'),
                ("background=null", "background", "#rrggbb"), ("background=", "background", "3"),
                ("background=1,2", "background", "3"), ("diffuse=1],[2", "diffuse", "#rrggbb"),
                ("diffuse=%230ff00", "diffuse", "#rrggbb"), ("specular=1e999", "specular", "#rrggbb"),
                ("ambient=nan", "ambient", "no color"), ("emissive=1,1,1,.5", "emissive", "#rrggbb"),
                ("emissive=1,1,1,0.5", "emissive", "alpha"), ("ambient=transparent", "ambient", "alpha"),
                ("specular=rgb(1+2)", "specular", "three components"),
                ("background=1,1,1,2", "background", "0 to 1"),
                ("shininess=-1", "shininess", "0 or more"), ("shininess=x", "shininess", "number"),
                ("shininess=1,2,3", "shininess", "number"),
                ("display=sRBG", "display", 'did you mean "sRGB"'),
                ("sizes=9", "sizes", "shape, size, ground, width, height, samples, background, display, view"),
                ("s%69ze=9", "s%69ze", "not known"), ("=1", "", "not known")):
            problem = self.refused(f"/v1/preview/brass?{query}", 400, "query")
            self.assertEqual([error["parameter"] for error in problem["errors"]], [parameter],
                             query)
            self.assertIn(word, problem["errors"][0]["detail"])
            self.assertTrue(problem["detail"].startswith(f"{parameter}: " if parameter else ""))
            self.assertIn(word, problem["detail"])

    def test_all_mistakes_come_together(self):
        problem = self.refused(link(shape="tors", size=0, format="pgn", view="x"), 400, "query")
        self.assertEqual({error["parameter"] for error in problem["errors"]},
                         {"shape", "size", "format", "view"})
        self.assertIn("(and 3 more)", problem["detail"])
        many = "&".join(f"x{i}" for i in range(200))
        problem = self.refused(f"/v1/preview/brass?{many}", 400, "query")
        self.assertEqual(len(problem["errors"]), 64)

    def test_a_limit_is_named(self):
        problem = self.refused(link(size=2000), 422, "limit")
        self.assertEqual(problem["errors"][0]["parameter"], "size")
        self.assertIn("`pixels` is 1000000", problem["detail"])

    def test_paths_that_lead_nowhere(self):
        problem = self.refused(link("bras"), 404, "not-found")
        self.assertEqual(problem["errors"][0]["parameter"], "material")
        self.assertIn('did you mean "brass"', problem["detail"])
        self.refused(link("br\u00e4ss"), 404, "not-found")
        for path in ("/v1/preview", "/v1/preview/", "/v1/preview/brass/", "/v1/preview/a/b",
                     "/v1/preview/%ff", "/v1/preview/%2e%2e"):
            self.refused(path, 404, "not-found")
        for path in "/v1/preview/brass%00", "/v1/preview/%2e%2e%2f", "/v1/preview/a%2Fb":
            self.refused(path, 400, "request")

    def test_methods(self):
        for path in (link(), link("bras"), link(size="x")):
            answer = self.daemon.call("OPTIONS", path)
            self.assertEqual((answer.status, answer.headers["Allow"]), (204, "GET, HEAD, OPTIONS"))
        for method in ("POST", "PUT", "DELETE"):
            answer = self.daemon.call(method, link(), b"{}")
            self.assertEqual((answer.status, answer.headers["Allow"]), (405, "GET, HEAD, OPTIONS"))
        body = self.daemon.call("GET", link(size=24), b"a body that means nothing")
        self.assertEqual(body.status, 200)


KEYS = ("Jn5cR2v8yT4wZ7qL1mX9bK3dF6hG0sPa", "another/key+of-some.length_and~character=", "c" * 255)


def signed(path, key=KEYS[0]):
    digest = hmac.new(key.encode(), path.encode(), hashlib.sha256).digest()
    signature = base64.urlsafe_b64encode(digest).decode().rstrip("=")
    return f"{path}{'&' if '?' in path else '?'}signature={signature}"


class SignatureTest(Folder):
    def keys(self, *keys):
        return self.file("# links\n" + "\n".join(keys) + "\n", "keys")

    def assert_status(self, answer, code, *words):
        self.assertEqual(answer.status, code, answer.body[:500])
        if code == 403:
            problem = json.loads(answer.body)
            self.assertEqual(problem["type"], "urn:shaded:problem:signature")
            self.assertEqual(answer.headers["Cache-Control"], "no-store")
            for word in words:
                self.assertIn(word, problem["detail"])

    def test_a_link_needs_the_signature_of_all_of_it(self):
        with Daemon("--preview-keys", self.keys(*KEYS)) as daemon:
            get, now = daemon.get, int(time.time())
            path = link(size=20, shape="torus")
            for key in KEYS:
                self.assert_status(get(signed(path, key)), 200)
            self.assert_status(get(signed(link(size=20, view="ACES 1.0 - SDR Video"))), 200)
            self.assert_status(get(signed("/v1/preview/brass")), 200)
            self.assert_status(daemon.call("HEAD", signed(path)), 200)
            absolute = daemon.raw(f"GET http://a.example{signed(path)} HTTP/1.1\r\nHost: a\r\n"
                                  "Connection: close\r\n\r\n".encode())
            self.assertTrue(absolute.startswith(b"HTTP/1.1 200 "))

            good = signed(path)
            self.assert_status(get(path), 403, "needs a signature")
            for wrong in (good.replace("size=20", "size=21"), good.replace("brass", "gold"),
                          good + "&size=20", good + "=", good[:-1], good + "A",
                          good[:-1] + ("A" if good[-1] != "A" else "B"),
                          signed(path, "x" * 32), path + "&signature=", good[:-43] + good[-43:].swapcase(),
                          link(shape="torus", size=20) + good[good.index("&signature"):],
                          good.replace("&signature", "&view=Raw&signature")):
                self.assert_status(get(wrong), 403, "not that of this link")
            self.assertEqual(daemon.call("HEAD", path).status, 403)
            self.assert_status(daemon.call("OPTIONS", path), 204)

            later, past = link(size=20, expires=now + 600), link(size=20, expires=now - 1)
            self.assert_status(get(signed(later)), 200)
            self.assert_status(get(later), 403, "needs a signature")
            self.assert_status(get(signed(past)), 403, "was valid until")
            self.assert_status(get(signed(past, "x" * 32)), 403, "not that of this link")
            self.assert_status(get(signed(past).replace(f"{now - 1}", f"{now + 999}")), 403)
            self.assert_status(get(signed(past + f"&expires={now + 999}")), 403, "was valid")
            # What is signed and wrong is still wrong; what is not signed is not looked at.
            self.assert_status(get(signed(link(size=0))), 400)
            self.assert_status(get(signed(link("bras"))), 404)
            self.assert_status(get(link(size=0)), 403)
            # Other paths are as open as they were.
            self.assert_status(get("/v1/materials"), 200)
            self.assert_status(daemon.render(SMALL), 200)
            # Neither signatures nor keys are for the log.
            text = daemon.stderr()
            self.assertIn('"path":"/v1/preview/brass"', text)
            for secret in (*KEYS, "signature=", good[-43:]):
                self.assertNotIn(secret, text)

    def test_a_link_that_expires_is_good_until_then(self):
        with Daemon("--preview-keys", self.keys(KEYS[0])) as daemon:
            in_time, seconds = False, 2
            while not in_time:
                seconds *= 2
                expires = int(time.time()) + seconds
                path = signed(link(size=20, expires=expires))
                answer = daemon.get(path)
                in_time = time.time() < expires
            self.assert_status(answer, 200)
            while time.time() < expires + 1:  # clocks of whole seconds tick a little late
                time.sleep(0.1)
            self.assert_status(daemon.get(path), 403, "was valid until")

    def test_who_may_keep_a_picture(self):
        """By a token: its client alone. By a link that ends: nobody for longer than that."""
        tokens = self.file("0123456789abcdef\n", "tokens")
        token = {"Authorization": "Bearer 0123456789abcdef"}
        policy = 'public, s-maxage=9000, max-age="5000", stale-if-error=60, no-transform'
        with Daemon("--tokens", tokens, "--preview-keys", self.keys(KEYS[0]),
                    "--cache-control", policy) as daemon:
            forever = daemon.get(signed(link(size=20)))
            self.assertEqual(forever.headers["Cache-Control"], policy)
            self.assertEqual(forever.headers.get_all("Vary"), ["Accept"])
            tag = {"If-None-Match": forever.headers["ETag"]}
            for more, status in ({}, 200), (tag, 304):
                for answer in (daemon.get(link(size=20), {**token, **more}),
                               daemon.get(signed(link(size=20)), {**token, **more})):
                    self.assert_status(answer, status)
                    self.assertEqual(answer.headers["Cache-Control"],
                                     'private, max-age="5000", no-transform')
                    self.assertEqual(answer.headers.get_all("Vary"), ["Accept", "Authorization"])
                for left, most in (3000, 3000), (10**6, 5000):
                    expires = int(time.time()) + left
                    answer = daemon.get(signed(link(size=20, expires=expires)), more)
                    now = time.time()
                    self.assert_status(answer, status)
                    age = re.fullmatch("private, no-transform, max-age=(\\d+), must-revalidate",
                                       answer.headers["Cache-Control"])
                    self.assertLessEqual(int(age[1]), most)
                    self.assertGreaterEqual(int(age[1]), min(int(expires - now), most))
            listed = daemon.get("/v1/materials", token)
            self.assertEqual(listed.headers["Cache-Control"], "private, no-cache")
            self.assertEqual(listed.headers.get_all("Vary"), ["Accept-Encoding", "Authorization"])
            self.assertEqual(daemon.render({}, token).headers["Cache-Control"], "no-store")

    def test_a_signature_stands_for_a_token_here_alone(self):
        tokens = self.file("0123456789abcdef\n", "tokens")
        token = {"Authorization": "Bearer 0123456789abcdef"}
        path = link(size=20)
        with Daemon("--tokens", tokens, "--preview-keys", self.keys(KEYS[0])) as daemon:
            self.assert_status(daemon.get(signed(path)), 200)
            for allowed in (path, signed(path, "x" * 32), signed(link(size=20, expires=1))):
                self.assert_status(daemon.get(allowed, token), 200)
            unsigned = daemon.get(path)
            self.assert_status(unsigned, 401)
            self.assertIn("Bearer", unsigned.headers["WWW-Authenticate"])
            self.assert_status(daemon.get(signed(path, "x" * 32)), 403)
            self.assert_status(daemon.get(signed(link(size=20, expires=1))), 403, "was valid")
            self.assert_status(daemon.get(signed("/v1/materials")), 401)
            self.assert_status(daemon.post(signed("/v1/render"), SMALL), 401)
        with Daemon("--tokens", tokens) as daemon:
            self.assert_status(daemon.get(signed(path)), 401)
            self.assert_status(daemon.get(signed(path), token), 200)
        with Daemon() as daemon:
            self.assert_status(daemon.get(signed(path)), 200)

    def test_keys_are_rotated_by_sighup(self):
        first, second = (signed(link(size=20), key) for key in KEYS[:2])
        path = self.keys(KEYS[0])
        with Daemon("--preview-keys", path) as daemon:
            def statuses(count):
                daemon.signal(signal.SIGHUP)
                daemon.wait_for("reloaded", lambda _: len(daemon.events("reloaded")) == count)
                return [daemon.get(one).status for one in (first, second)]

            self.assertEqual([daemon.get(one).status for one in (first, second)], [200, 403])
            self.keys(KEYS[1], KEYS[0])
            self.assertEqual(statuses(1), [200, 200])
            self.keys(KEYS[1])
            self.assertEqual(statuses(2), [403, 200])
            for bad, word in (("short", "line 2 is no key: 32 to 255"), ("", "there is no key")):
                self.keys(bad)
                daemon.signal(signal.SIGHUP)
                event = daemon.wait_for("reload-failed", lambda event: word in event["message"])
                self.assertNotIn("short", event["message"])
                self.assertEqual([daemon.get(one).status for one in (first, second)], [403, 200])

    def test_the_recipe_of_the_documents_signs(self):
        lines = (SOURCE / "docs/operating.md").read_text().splitlines()
        start = next(i for i, line in enumerate(lines) if line.startswith("    key=$("))
        recipe = []
        for line in lines[start:]:
            if not line.startswith("    "):
                break
            recipe.append(line.strip())
        making = next(line.strip() for line in lines if "> preview.keys" in line)
        soon = str(int(time.time()) + 600)
        script = "\n".join([making, *recipe]).replace("$(date -d '+1 day' +%s)", soon)
        self.assertIn(soon, script)
        done = subprocess.run(["bash", "-euc", script], cwd=self.folder, capture_output=True,
                              check=True, timeout=500)
        path = done.stdout.decode().strip()
        self.assertRegex(path, r"^/v1/preview/.*&expires=\d+&signature=[A-Za-z0-9_-]{43}$")
        with Daemon("--preview-keys", str(self.folder / "preview.keys")) as daemon:
            self.assert_status(daemon.get(path), 200)
            self.assert_status(daemon.get(path.replace(soon, soon + "0")), 403)
        self.assertEqual(re.search("expires=([0-9]+)", path).group(1), soon)


if __name__ == "__main__":
    unittest.main()
