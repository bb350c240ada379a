"""Links to whole scenes: GET /v1/scene/..., PUT /v1/scenes and GET /v1/scenes/..."""

import base64
import gzip
import hashlib
import hmac
import io
import json
import random
import subprocess
import time
import unittest
import zlib

from PIL import Image

from e2e.cache_test import HIT, STORED, status
from e2e.daemon import BUILD, JSON, SMALL, SOURCE, Daemon, environment
from e2e.daemon_test import Folder
from e2e.queue_test import encoded

MEDIA = {"png": "image/png", "jpg": "image/jpeg", "webp": "image/webp"}
SHADE = str(BUILD / "shade")
KEY = "0123456789abcdef0123456789abcdef"


def deflated(text):
    coder = zlib.compressobj(9, zlib.DEFLATED, -15)
    return coder.compress(text) + coder.flush()


def link_to(data, suffix="png"):
    return f"/v1/scene/{base64.urlsafe_b64encode(data).decode().rstrip('=')}.{suffix}"


def link_of(scene, suffix="png"):
    return link_to(deflated(json.dumps(scene, separators=(",", ":")).encode()), suffix)


def condensed(scene):
    """As JSON.stringify writes it."""
    return json.dumps(scene, separators=(",", ":"), ensure_ascii=False).encode()


def lit(count):
    """A scene that does not compress well."""
    numbers = random.Random(1)
    return {**SMALL, "lights": [{"type": "point", "position": [numbers.random() + 2 for _ in range(3)]}
                                for _ in range(count)]}


class Test(Folder):
    def refused(self, answer, code, kind, *words):
        self.assertEqual((answer.status, answer.headers["Content-Type"], answer.headers["Cache-Control"]),
                         (code, "application/problem+json", "no-store"), answer.body[:300])
        problem = json.loads(answer.body)
        self.assertEqual(problem["type"], f"urn:shaded:problem:{kind}")
        for word in words:
            self.assertIn(word, problem["detail"])
        return problem

    def picture(self, daemon, path, **headers):
        answer = daemon.get(path, headers)
        suffix = path.partition("?")[0].rpartition(".")[2]
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, MEDIA[suffix]),
                         answer.body[:300])
        return answer

    def put(self, daemon, text, **headers):
        return daemon.call("PUT", "/v1/scenes", text, {**JSON, **headers})

    def keep(self, daemon, scene, code=201):
        answer = self.put(daemon, json.dumps(scene))
        self.assertEqual(answer.status, code, answer.body)
        return answer.headers["Location"]


class LinkTest(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--cache-control", "public, max-age=77", "--cors-origins", "https://a.example")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def test_a_link_is_answered_as_its_document(self):
        for suffix, media_type in MEDIA.items():
            posted = self.daemon.render(SMALL, {"Accept": media_type})
            linked = self.picture(self.daemon, link_of(SMALL, suffix))
            self.assertEqual(linked.body, posted.body)
            for name in ("ETag", "Shaded-Plan", "Vary", "Cache-Control"):
                self.assertEqual(linked.headers[name], posted.headers[name])
            self.assertEqual(linked.headers["Cache-Control"], "public, max-age=77")
            self.assertEqual(status(linked), HIT)
            named = {**SMALL, "output": {"format": "jpeg" if suffix == "jpg" else suffix}}
            self.assertEqual(self.picture(self.daemon, link_of(named, suffix)).body, posted.body)
        for path in sorted((SOURCE / "api/examples").glob("*.json")):
            scene = json.loads(path.read_text())
            scene["image"] = {"width": 24, "height": 18, "samples": 1}
            target = link_of(scene)
            if "outputs" in scene or scene.get("output", {}).get("format", "png") != "png" or \
                    len(target) > 8000:
                continue
            linked = self.daemon.get(target)
            self.assertEqual(linked.status, 200, path)
            self.assertEqual(linked.body, self.daemon.render(scene).body, path)

    def test_the_picture_is_made_once(self):
        scene = {**SMALL, "background": 0.125}
        target = link_of(scene)
        first = self.picture(self.daemon, target)
        self.assertEqual(status(first), STORED)
        made = encoded(self.daemon)
        self.assertEqual(status(self.picture(self.daemon, target)), HIT)
        self.assertEqual(status(self.picture(self.daemon, link_to(deflated(json.dumps(scene, indent=3).encode())))), HIT)
        for tag in (first.headers["ETag"], "*"):
            known = self.daemon.get(target, {"If-None-Match": tag})
            self.assertEqual((known.status, known.body), (304, b""))
        head = self.daemon.call("HEAD", target)
        self.assertEqual((head.status, head.body, head.headers["ETag"]), (200, b"", first.headers["ETag"]))
        self.assertEqual(int(head.headers["Content-Length"]), len(first.body))
        self.assertEqual(encoded(self.daemon), made)

    def test_what_an_img_sends_is_taken(self):
        accept = "image/avif,image/webp,image/apng,image/svg+xml,image/*,*/*;q=0.8"
        self.assertEqual(self.picture(self.daemon, link_of(SMALL), Accept=accept).headers["Content-Type"], "image/png")
        answer = self.daemon.get(link_of(SMALL), {"Accept": "image/webp"})
        self.refused(answer, 406, "not-acceptable", "image/png")
        asked = self.daemon.get(link_of(SMALL), {"Origin": "https://a.example"})
        self.assertEqual(asked.headers["Access-Control-Allow-Origin"], "https://a.example")
        self.assertIn("Location", asked.headers["Access-Control-Expose-Headers"])
        allowed = self.daemon.call("OPTIONS", link_of(SMALL))
        self.assertEqual((allowed.status, allowed.headers["Allow"]), (204, "GET, HEAD, OPTIONS"))
        self.assertEqual(self.daemon.call("POST", link_of(SMALL), b"{}", JSON).status, 405)

    def test_percent_encoded_links_are_the_same(self):
        target = link_of(SMALL)
        first = self.picture(self.daemon, target)
        middle = len(target) // 2
        for path in (target[:middle] + f"%{ord(target[middle]):02X}" + target[middle + 1:],
                     target.replace("/v1/scene/", "/v1/%73cene/"), target.replace(".png", "%2epng")):
            self.assertEqual(self.daemon.get(path).body, first.body, path)

    def test_long_links(self):
        """Longer than what the log keeps of a path, and up to the bound of a target."""
        numbers, last = 1, ""
        while len(link_of(lit(numbers))) <= 8000:
            last = link_of(lit(numbers))
            numbers += 1
        self.assertGreater(len(last), 7900)
        self.picture(self.daemon, last)
        problem = self.refused(self.daemon.get(link_of(lit(numbers))), 414, "target-too-long", "8000")
        self.assertIn("PUT /v1/scenes", problem["detail"])
        self.refused(self.daemon.get(last[:-4] + "/x.png"), 400, "query", "base64url")
        self.refused(self.daemon.get("/v1/preview/" + "A" * 600), 404, "not-found")
        self.picture(self.daemon, self.keep(self.daemon, lit(numbers)))

    def test_the_suffix_and_the_scene_agree(self):
        for suffix, kind in (("png", "jpeg"), ("jpg", "png"), ("webp", "exr")):
            words = (kind,) if kind == "exr" else ("." + suffix, "jpg" if kind == "jpeg" else kind)
            problem = self.refused(self.daemon.get(link_of({**SMALL, "output": {"format": kind}}, suffix)),
                                   422, "scene", *words)
            self.assertEqual(problem["errors"][0]["pointer"], "/output/format")
        many = {**SMALL, "outputs": [{"name": "a"}]}
        self.assertEqual(self.daemon.render(many).status, 200)  # what is cached of it is no answer
        self.assertEqual(self.refused(self.daemon.get(link_of(many)), 422, "scene")["errors"][0]["pointer"],
                         "/outputs")
        for path in ("/v1/scene/", "/v1/scene/AA", "/v1/scene/.png", "/v1/scene/AA.gif", "/v1/scene/AA.jpeg",
                     "/v1/scene/AA.PNG", "/v1/scene/png"):
            self.refused(self.daemon.get(path), 404, "not-found")

    def test_mistakes_in_links_are_told(self):
        whole = deflated(json.dumps(SMALL).encode())
        for data, word in ((whole[:-3], "end before"), (whole + b"x", "bytes follow its end"),
                           (b"\x07" + whole, "invalid block type"), (zlib.compress(b"{}"), "not sound deflate"),
                           (gzip.compress(b"{}"), "not sound deflate")):
            problem = self.refused(self.daemon.get(link_to(data)), 400, "query", word)
            self.assertEqual([error["parameter"] for error in problem["errors"]], ["document"])
        right = link_to(whole)[:-4]
        for text in (right + "=", right[:-1] + "+", right[:-1] + "%20", right[:-1] + "%00", "/v1/scene/A"):
            self.assertEqual(self.daemon.get(text + ".png").status, 400, text)
        # Bits that no byte takes: the same bytes have one link.
        self.refused(self.daemon.get("/v1/scene/AB.png"), 400, "query", "base64url")
        self.refused(self.daemon.get(link_to(deflated(b"{"))), 400, "syntax")
        self.refused(self.daemon.get(link_of({})), 422, "scene", "objects")
        self.refused(self.daemon.get(link_of(SMALL) + "?size=3"), 400, "query", "size")
        for query in ("expires=soon", "expires=", "expires=1&expires=2", "expires=1x", "expires=" + "9" * 16):
            self.refused(self.daemon.get(link_of(SMALL) + "?" + query), 400, "query", "expires")
        self.picture(self.daemon, link_of(SMALL) + "?")

    def test_inflation_is_capped(self):
        with Daemon("--max-body", "100K") as daemon:
            blanks = json.dumps(SMALL).encode()
            self.picture(daemon, link_to(deflated(blanks + b" " * (100 * 1024 - len(blanks)))))
            answer = daemon.get(link_to(deflated(blanks + b" " * (100 * 1024 - len(blanks) + 1))))
            problem = self.refused(answer, 422, "limit", "the limit `body`", "102400")
            self.assertEqual(problem["errors"][0]["parameter"], "document")
        bomb = link_to(deflated(b" " * 5_000_000))
        self.assertLess(len(bomb), 8000)
        self.refused(self.daemon.get(bomb), 400, "syntax")

    def test_metrics_tell_the_routes_apart(self):
        self.daemon.get(self.keep(self.daemon, {**SMALL, "background": 0.5}))
        metrics = self.daemon.metrics()
        for label in ("/v1/scene", "/v1/scenes", "/v1/scenes/"):
            self.assertIn(f'shaded_requests_total{{route="{label}",status="200"}}', metrics)


class CommandTest(Test):
    def test_the_command_line_prints_links(self):
        def link(scene, *flags):
            return subprocess.run([SHADE, "link", "-", *flags], input=json.dumps(scene, indent=2).encode(),
                                  env=environment(), capture_output=True, check=False)

        with Daemon() as daemon:
            for kind, suffix in (("png", "png"), ("jpeg", "jpg"), ("webp", "webp")):
                scene = {**SMALL, "output": {"format": kind}}
                made = link(scene)
                self.assertEqual((made.returncode, made.stderr), (0, b""))
                path = made.stdout.decode().rstrip("\n")
                self.assertEqual(self.picture(daemon, path).body, daemon.render(scene).body)
                coded = path[len("/v1/scene/"):-len(suffix) - 1]
                data = zlib.decompress(base64.urlsafe_b64decode(coded + "=" * (-len(coded) % 4)), -15)
                self.assertEqual(data, condensed(scene))
        for scene, code, word in (({}, 1, b"objects"), (lit(900), 1, b"8000"),
                                  ({**SMALL, "outputs": [{"name": "a"}]}, 1, b"/outputs")):
            made = link(scene)
            self.assertEqual((made.returncode, made.stdout), (code, b""))
            self.assertIn(word, made.stderr)
        self.assertEqual(link(SMALL, "-o", "x").returncode, 2)
        self.assertEqual(link(SMALL, "more").returncode, 2)


class KeptTest(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def test_the_digest_is_of_the_bytes_without_blanks(self):
        scene = {**SMALL, "camera": {"fov": 41}}
        digest = hashlib.sha256(condensed(scene)).hexdigest()
        for text, code in ((json.dumps(scene, indent=4), 201), (condensed(scene), 200),
                           (json.dumps(scene).replace(" ", "\r\n\t "), 200)):
            answer = self.put(self.daemon, text)
            self.assertEqual((answer.status, answer.headers["Location"]), (code, f"/v1/scenes/{digest}.png"))
            self.assertEqual(json.loads(answer.body), {"digest": digest, "path": f"/v1/scenes/{digest}.png"})
            self.assertEqual(answer.headers["Cache-Control"], "no-store")
        # Blanks in strings stay, as do quotes and backslashes before them.
        named = {"objects": [{"type": "sphere", "material": "a \" \\"}], "materials": {"a \" \\": {}}}
        answer = self.put(self.daemon, json.dumps(named, indent=1))
        self.assertIn(hashlib.sha256(condensed(named)).hexdigest(), answer.headers["Location"])
        answer = self.put(self.daemon, gzip.compress(condensed(scene)), **{"Content-Encoding": "gzip"})
        self.assertEqual((answer.status, answer.headers["Location"]), (200, f"/v1/scenes/{digest}.png"))

    def test_a_kept_scene_is_answered_as_the_document(self):
        scene = {**SMALL, "camera": {"fov": 42}}
        path = self.keep(self.daemon, scene)
        posted = self.daemon.render(scene)
        for suffix, kind in MEDIA.items():
            answer = self.picture(self.daemon, path.replace("png", suffix))
            self.assertEqual(answer.body, self.daemon.render(scene, {"Accept": kind}).body)
        first = self.picture(self.daemon, path)
        self.assertEqual((first.headers["ETag"], status(first)), (posted.headers["ETag"], HIT))
        self.assertEqual(self.daemon.get(path, {"If-None-Match": posted.headers["ETag"]}).status, 304)
        head = self.daemon.call("HEAD", path)
        self.assertEqual((head.status, head.headers["ETag"]), (200, posted.headers["ETag"]))
        for kind, suffix in (("webp", "webp"), ("jpeg", "jpg")):
            path = self.keep(self.daemon, {**scene, "output": {"format": kind}})
            self.assertTrue(path.endswith("." + suffix))
            self.picture(self.daemon, path)
            self.refused(self.daemon.get(path.replace(suffix, "png")), 422, "scene", suffix)

    def test_what_no_link_shows_is_not_kept(self):
        for scene, pointer in (({**SMALL, "outputs": [{"name": "a"}]}, "/outputs"),
                               ({**SMALL, "output": {"format": "exr"}}, "/output/format"), ({}, "")):
            answer = self.put(self.daemon, json.dumps(scene))
            self.assertEqual(self.refused(answer, 422, "scene")["errors"][0]["pointer"], pointer)
        self.refused(self.put(self.daemon, b"{"), 400, "syntax")
        for method in ("GET", "HEAD", "POST", "DELETE"):
            answer = self.daemon.call(method, "/v1/scenes", b"{}" if method == "POST" else None, JSON)
            self.assertEqual((answer.status, answer.headers["Allow"]), (405, "PUT, OPTIONS"))

    def test_an_unknown_digest_says_how_to_put_it(self):
        self.refused(self.daemon.get("/v1/scenes/" + "0" * 64 + ".png"), 404, "not-found", "PUT", "/v1/scenes")
        for name in ("0" * 63 + ".png", "0" * 65 + ".png", "A" * 64 + ".png", "0" * 64 + ".gif", "0" * 64, ".png"):
            self.refused(self.daemon.get("/v1/scenes/" + name), 404, "not-found")

    def test_meshes_and_scenes_are_told_apart(self):
        """The digest of one names nothing where the other is asked for."""
        path = self.keep(self.daemon, {**SMALL, "camera": {"fov": 43}})
        digest = path[len("/v1/scenes/"):-len(".png")]
        answer = self.daemon.render({**SMALL, "objects": [{"type": "mesh", "data": f"sha256-{digest}"}]})
        self.refused(answer, 409, "unknown-data", digest)
        mesh = b'{"positions":[0,0,0,1,0,0,0,1,0]}'
        digest = hashlib.sha256(mesh).hexdigest()
        self.assertLess(self.daemon.call("PUT", f"/v1/meshes/{digest}", mesh, JSON).status, 300)
        self.refused(self.daemon.get(f"/v1/scenes/{digest}.png"), 404, "not-found")

    def test_the_store_has_a_cap(self):
        with Daemon("--mesh-store", "64K", "--reuse", "0", "--response-cache", "0") as daemon:
            paths = [self.keep(daemon, {**lit(40), "background": i / 64}) for i in range(40)]
            self.assertEqual(daemon.get(paths[0]).status, 404)
            self.assertEqual(daemon.get(paths[-1]).status, 200)
            self.assertLessEqual(daemon.metrics()["shaded_mesh_store_bytes"], 64 << 10)
            self.refused(self.put(daemon, json.dumps(lit(900))), 422, "limit", "mesh-store")
            first = {**lit(40), "background": 0.0}
            self.assertEqual(self.keep(daemon, first), paths[0])
            self.picture(daemon, paths[0])
        with Daemon("--mesh-store", "0") as daemon:
            self.refused(self.put(daemon, json.dumps(SMALL)), 422, "limit", "mesh-store")


class AccessTest(Test):
    def signed(self, path, **parameters):
        target = path + "".join(("?" if not i else "&") + f"{name}={value}"
                                for i, (name, value) in enumerate(parameters.items()))
        digest = hmac.new(KEY.encode(), target.encode(), hashlib.sha256).digest()
        text = base64.urlsafe_b64encode(digest).decode().rstrip("=")
        return f"{target}{'&' if parameters else '?'}signature={text}"

    def test_links_are_signed_as_previews_are(self):
        keys = self.file(KEY + "\n", "keys")
        tokens = self.file("0123456789abcdef\n", "tokens")
        bearer = {"Authorization": "Bearer 0123456789abcdef"}
        with Daemon("--preview-keys", keys, "--tokens", tokens, "--cache-control", "public, max-age=3600") as daemon:
            self.refused(self.put(daemon, json.dumps(SMALL)), 401, "unauthorized")
            kept = self.put(daemon, json.dumps(SMALL), **bearer).headers["Location"]
            for path in (link_of(SMALL), kept, link_of(lit(100))):
                self.refused(daemon.get(path), 401, "unauthorized")
                self.assertEqual(daemon.get(path, bearer).status, 200)
                self.assertEqual(self.picture(daemon, self.signed(path)).headers["Cache-Control"],
                                 "public, max-age=3600")
                soon = int(time.time()) + 1000
                answer = self.picture(daemon, self.signed(path, expires=soon))
                self.assertRegex(answer.headers["Cache-Control"], "^private, max-age=[0-9]{1,4}, must-revalidate$")
                self.refused(daemon.get(self.signed(path, expires=int(time.time()) - 1)), 403, "signature")
                wrong = self.signed(path)[:-1] + ("A" if self.signed(path)[-1] != "A" else "B")
                self.refused(daemon.get(wrong), 403, "signature")
                self.refused(daemon.get(self.signed(path).replace(".png?", ".jpg?")), 403, "signature")
        with Daemon("--preview-keys", keys) as daemon:
            kept = self.keep(daemon, SMALL)
            for path in (link_of(SMALL), kept):
                self.refused(daemon.get(path), 403, "signature")
                self.picture(daemon, self.signed(path))


if __name__ == "__main__":
    unittest.main()
