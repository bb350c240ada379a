"""Meshes that are put under their digest, and scenes that name them."""

import hashlib
import json
import math
import re
import socket
import struct
import subprocess
import tempfile
import threading
import unittest
from pathlib import Path

from e2e.daemon import BUILD, JSON, SMALL, SOURCE, Daemon
from e2e.daemon_test import Folder

BINARY = {"Content-Type": "application/octet-stream"}


def ball(rows, size=1.0):
    """A ball of 2 rows^2 triangles, of numbers that floats hold."""
    def near(value):
        return struct.unpack("<f", struct.pack("<f", value))[0]

    positions, indices = [], []
    for row in range(rows + 1):
        for column in range(rows + 1):
            down, around = math.pi * row / rows, 2 * math.pi * column / rows
            positions += [near(size * math.sin(down) * math.sin(around)), near(size * math.cos(down)),
                          near(size * math.sin(down) * math.cos(around))]
    for row in range(rows):
        for column in range(rows):
            i = row * (rows + 1) + column
            indices += [i, i + rows + 1, i + rows + 2, i, i + rows + 2, i + 1]
    return {"positions": positions, "indices": indices}


def plain(mesh):
    positions, indices = mesh["positions"], mesh["indices"]
    return struct.pack(f"<3I{len(positions)}f{len(indices)}I", len(positions) // 3, len(indices), 0,
                       *positions, *indices)


def digest_of(body):
    return hashlib.sha256(body).hexdigest()


def named(*digests, **more):
    return {**SMALL, "objects": [{"type": "mesh", "data": f"sha256-{digest}"} for digest in digests],
            **more}


BALL = ball(12)
BODY = plain(BALL)
DIGEST = digest_of(BODY)


class Test(Folder):
    def put(self, daemon, body, headers=None, digest=None):
        return daemon.call("PUT", f"/v1/meshes/{digest or digest_of(body)}", body, headers or BINARY)

    def assert_problem(self, answer, status, name, *words):
        self.assertEqual(answer.status, status, answer.body)
        problem = json.loads(answer.body)
        self.assertEqual(problem["type"], f"urn:shaded:problem:{name}")
        for word in words:
            self.assertIn(word, problem["detail"])
        return problem


class MeshesTest(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--max-triangles", "2000", "--max-body", "200K", "--cors-origins",
                            "https://a.example")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def test_a_scene_names_what_was_put(self):
        for body, headers in ((plain(ball(9)), BINARY), (json.dumps(ball(9)).encode(), JSON)):
            self.assert_problem(self.daemon.render(named(digest_of(body))), 409, "unknown-data",
                                "/objects/0/data", digest_of(body), "PUT")
            first, again = self.put(self.daemon, body, headers), self.put(self.daemon, body, headers)
            self.assertEqual((first.status, first.body, again.status), (201, b"", 204))
            kept = self.daemon.render(named(digest_of(body)))
            inlined = self.daemon.render({**SMALL, "objects": [{"type": "mesh", **ball(9)}]})
            self.assertEqual((kept.status, kept.body), (200, inlined.body))
            self.assertNotEqual(kept.headers["ETag"], inlined.headers["ETag"])
            self.assertEqual(kept.headers["Shaded-Plan"], inlined.headers["Shaded-Plan"])
            for path in ("/v1/explain", "/v1/compare"):
                answers = [json.loads(self.daemon.post(path, scene).body) for scene in (
                    named(digest_of(body)), {**SMALL, "objects": [{"type": "mesh", **ball(9)}]})]
                for answer in answers:
                    answer.pop("cost", None)
                    for tier in answer.get("tiers", []):
                        tier.pop("seconds", None)
                self.assertEqual(answers[0].get("objects"), answers[1].get("objects"))
                self.assertEqual(answers[0].get("bound"), answers[1].get("bound"))

    def test_trees_are_built_once_for_all_requests(self):
        body = plain(ball(10))
        self.put(self.daemon, body)
        given = {"type": "mesh", **ball(10)}
        for more in ({}, {"lights": [{"type": "point"}]}, {"camera": {"fov": 31}}):
            kept, inlined = named(digest_of(body), **more), {**SMALL, "objects": [given], **more}
            self.assertNotIn("build;", self.daemon.render(kept).headers["Server-Timing"])
            self.assertRegex(self.daemon.render(inlined).headers["Server-Timing"], "plan;dur=[0-9.]+, build;dur=[0-9.]+, visibility")
            trees = [json.loads(self.daemon.post("/v1/explain", scene).body)["trees"] for scene in (kept, inlined)]
            self.assertEqual(trees[0], {"built": 0, "reused": 1, "triangles": 0, "nodes": 0, "bytes": 0})
            self.assertEqual([trees[1][name] for name in ("built", "reused", "triangles")], [1, 0, 200])

    def test_all_that_is_missing_is_named_at_once(self):
        self.put(self.daemon, BODY)
        unknown = [digest_of(bytes([i])) for i in range(3)]
        answer = self.daemon.render(named(unknown[0], DIGEST, unknown[1], unknown[0], unknown[2]))
        problem = self.assert_problem(answer, 409, "unknown-data", "and 2 more")
        self.assertEqual([error["pointer"] for error in problem["errors"]],
                         ["/objects/0/data", "/objects/2/data", "/objects/4/data"])
        for digest, error in zip(unknown, problem["errors"]):
            self.assertIn(digest, error["detail"])
        for path in ("/v1/explain", "/v1/compare"):
            self.assert_problem(self.daemon.post(path, named(unknown[0])), 409, "unknown-data")

    def test_bodies_that_are_not_what_the_path_says(self):
        for body in (b"", BODY[:-1], BODY + b"\0", b"x" * 100):
            self.assert_problem(self.put(self.daemon, body, digest=DIGEST), 422, "mesh",
                                digest_of(body), f"{len(body)} bytes")
            answer = self.put(self.daemon, body)
            self.assert_problem(answer, 422, "mesh")
        self.assert_problem(self.put(self.daemon, b"", JSON), 400, "syntax")
        self.assert_problem(self.put(self.daemon, b"{}", JSON), 422, "mesh", "positions")
        self.assert_problem(self.put(self.daemon, json.dumps(BALL).encode(), BINARY), 422, "mesh")
        self.assert_problem(self.put(self.daemon, plain(ball(5)), JSON), 400, "syntax")
        nan = BODY[:12] + struct.pack("<f", math.nan) + BODY[16:]
        problem = self.assert_problem(self.put(self.daemon, nan), 422, "mesh", "byte 12")
        self.assertEqual(problem["errors"][0]["pointer"], "/positions/0")
        far = BODY[:-4] + struct.pack("<I", 10 ** 6)
        problem = self.assert_problem(self.put(self.daemon, far), 422, "mesh", "1000000")
        self.assertRegex(problem["errors"][0]["pointer"], "^/indices/[0-9]+$")

    def test_paths_and_heads(self):
        for name in (DIGEST.upper(), DIGEST[1:], DIGEST + "0", "sha256-" + DIGEST, "g" * 64):
            self.assert_problem(self.put(self.daemon, BODY, digest=name), 404, "not-found", "64")
        for method in ("GET", "HEAD", "POST", "DELETE"):
            answer = self.daemon.call(method, f"/v1/meshes/{DIGEST}", headers=JSON)
            self.assertEqual((answer.status, answer.headers["Allow"]), (405, "PUT, OPTIONS"))
        self.assertEqual(self.daemon.call("PUT", "/v1/render", b"{}", JSON).headers["Allow"],
                         "POST, OPTIONS")
        for headers in ({}, {"Content-Type": "text/plain"}, {"Content-Type": "model/gltf+binary"}):
            answer = self.daemon.call("PUT", f"/v1/meshes/{DIGEST}", BODY, headers)
            self.assert_problem(answer, 415, "media-type")
            self.assertEqual(answer.headers["Accept"], "application/json, application/octet-stream")
        answer = self.put(self.daemon, BODY, {**BINARY, "Content-Encoding": "br"})
        self.assert_problem(answer, 415, "media-type", "br")
        asked = {"Origin": "https://a.example", "Access-Control-Request-Method": "PUT"}
        answer = self.daemon.call("OPTIONS", f"/v1/meshes/{DIGEST}", headers=asked)
        self.assertIn("PUT", answer.headers["Access-Control-Allow-Methods"])

    def test_limits(self):
        self.assert_problem(self.put(self.daemon, plain(ball(40))), 422, "limit",
                            "`triangles` is 2000")
        self.assert_problem(self.put(self.daemon, b"\0" * (200 * 1024 + 1)), 413, "body-too-large")
        # Named twice it counts once, but for its faces.
        body, other = plain(ball(25)), plain(ball(24))
        for one in (body, other):
            self.assertEqual(self.put(self.daemon, one).status, 201)
        twice = named(digest_of(body), digest_of(body))
        self.assertEqual(self.daemon.render(twice).status, 200)
        for one in twice["objects"]:
            one["interpolation"] = "flat"
        self.assert_problem(self.daemon.render(twice), 422, "limit", "2500 triangles")
        self.assert_problem(self.daemon.render(named(digest_of(body), digest_of(other))), 422, "limit",
                            "triangles; the limit `triangles` is 2000")

    def test_slow_and_chunked_bodies(self):
        body = plain(ball(7))
        head = (f"PUT /v1/meshes/{digest_of(body)} HTTP/1.1\r\nHost: a\r\nConnection: close\r\n"
                "Content-Type: application/octet-stream\r\n").encode()
        chunks = b"".join(b"%x\r\n%s\r\n" % (len(body[i:i + 777]), body[i:i + 777])
                          for i in range(0, len(body), 777))
        whole = head + b"Transfer-Encoding: chunked\r\n\r\n" + chunks + b"0\r\n\r\n"
        self.assertTrue(self.daemon.raw(whole).startswith(b"HTTP/1.1 201 "))
        head += b"Content-Length: %d\r\n" % len(body)
        pieces = [body[i:i + 99] for i in range(0, len(body), 99)]
        self.assertTrue(self.daemon.raw(head + b"\r\n", *pieces).startswith(b"HTTP/1.1 204 "))
        with socket.create_connection(self.daemon.address, 500) as connection:
            connection.sendall(head + b"Expect: 100-continue\r\n\r\n")
            self.assertTrue(connection.recv(100).startswith(b"HTTP/1.1 100 "))
            connection.sendall(body)
            self.assertTrue(connection.recv(1000).startswith(b"HTTP/1.1 204 "))
        wrong = head.replace(digest_of(body).encode(), b"A" * 64)
        with socket.create_connection(self.daemon.address, 500) as connection:
            connection.sendall(wrong + b"Expect: 100-continue\r\n\r\n")
            self.assertTrue(connection.recv(100).startswith(b"HTTP/1.1 404 "))

    def test_the_example_of_the_documents(self):
        lines = (SOURCE / "docs/requests.md").read_text().splitlines()
        begin = next(i for i, line in enumerate(lines) if "> mesh.json" in line)
        text = "\n".join(line.removeprefix("    ").removeprefix("$ ") for line in lines[begin:begin + 5])
        self.assertEqual(text.count("curl"), 2)
        text = text.replace("http://127.0.0.1:8080", "http://{}:{}".format(*self.daemon.address))
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["bash", "-euo", "pipefail", "-c", text.replace("curl", "curl -sSf")],
                           cwd=folder, check=True)
            self.assertTrue((Path(folder) / "picture.png").read_bytes().startswith(b"\x89PNG"))

    def test_imported_meshes_are_put_as_shade_says(self):
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "wedge.obj").write_text("o mesh\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
            told = subprocess.run([BUILD / "shade", "import", "wedge.obj", "-o", "scene.json", "--meshes", "kept"],
                                  cwd=folder, check=True, capture_output=True, text=True).stderr
            scene = json.loads((folder / "scene.json").read_text())
            scene["image"] = SMALL["image"]
            answer = self.daemon.render(scene)
            self.assertEqual(answer.status, 409)
            self.assertEqual(json.loads(answer.body)["errors"][0]["pointer"], "/meshes/mesh/data")
            line = told.splitlines()[-1].replace("http://127.0.0.1:8080", "http://{}:{}".format(*self.daemon.address))
            subprocess.run(["bash", "-euc", line.replace("curl", "curl -sS")], cwd=folder, check=True)
        self.assertEqual(self.daemon.render(scene).status, 200)


class StoreTest(Test):
    def values(self, daemon):
        prefix = "shaded_mesh_store_"
        return {name.removeprefix(prefix): value for name, value in daemon.metrics().items()
                if name.startswith(prefix)}

    def test_many_put_the_same_at_once(self):
        with Daemon("--threads", "2") as daemon:
            statuses, body = [], plain(ball(60))

            def work():
                statuses.append(self.put(daemon, body).status)

            threads = [threading.Thread(target=work) for _ in range(16)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(sorted(statuses), [201] + [204] * 15)
            self.assertEqual(self.values(daemon)["meshes"], 1)

    def test_without_a_store(self):
        with Daemon("--mesh-store", "0") as daemon:
            features = json.loads(daemon.get("/v1/version").body)["features"]
            self.assertFalse({"meshes", "scenes", "assets"} & set(features))
            self.assert_problem(self.put(daemon, BODY), 422, "limit", "`mesh-store` is 0")
            self.assert_problem(daemon.render(named(DIGEST)), 422, "scene", "no meshes are kept here")

    def test_who_holds_most_loses_first(self):
        """By tokens, which are clients of their own on one address."""
        tokens = self.file("modest-0123456789\ngreedy-0123456789\n", "tokens")

        def headers(name):
            return {**BINARY, "Authorization": f"Bearer {name}-0123456789"}

        with Daemon("--tokens", tokens, "--mesh-store", "400K") as daemon:
            self.assertEqual(self.put(daemon, BODY, headers("modest")).status, 201)
            greedy = [plain(ball(20, 1 + i / 8)) for i in range(12)]
            for body in greedy:
                self.assertEqual(self.put(daemon, body, headers("greedy")).status, 201)
            values = self.values(daemon)
            self.assertLessEqual(values["bytes"], 400 << 10)
            self.assertGreater(values["evictions_total"], 3)
            self.assertEqual(values["meshes"] + values["evictions_total"], 13)
            token = {"Authorization": "Bearer greedy-0123456789"}
            self.assertEqual(daemon.render(named(DIGEST), token).status, 200)
            self.assertEqual(daemon.render(named(digest_of(greedy[-1])), token).status, 200)
            self.assertEqual(daemon.render(named(digest_of(greedy[0])), token).status, 409)

    def test_meshes_go_while_pictures_are_made(self):
        """On 409 put and repeat: every picture is made in the end, and is the same."""
        with Daemon("--threads", "2", "--mesh-store", "200K", "--response-cache", "0",
                    "--reuse", "0") as daemon:
            meshes = [ball(16, 1 + i / 8) for i in range(6)]
            bodies = [plain(mesh) for mesh in meshes]
            wanted = [daemon.render({**SMALL, "objects": [{"type": "mesh", **mesh}]}).body
                      for mesh in meshes]
            failed = []

            def work(first):
                for i in range(30):
                    which = (first + i * 5) % 6
                    for _ in range(1000):
                        answer = daemon.render(named(digest_of(bodies[which])))
                        if answer.status != 409:
                            break
                        status = self.put(daemon, bodies[which]).status
                        if status not in (201, 204):
                            failed.append(status)
                    if (answer.status, answer.body) != (200, wanted[which]):
                        failed.append(answer.status)

            threads = [threading.Thread(target=work, args=(i,)) for i in range(4)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(failed, [])
            values = self.values(daemon)
            self.assertGreater(values["evictions_total"], 0)
            self.assertLessEqual(values["bytes"], 200 << 10)

    def test_changes_of_settings_keep_what_is_kept(self):
        with Daemon("--mesh-store", "1M") as daemon:
            self.put(daemon, BODY)
            daemon.signal(1)
            daemon.wait_for("reloaded")
            self.assertEqual(daemon.render(named(DIGEST)).status, 200)
            self.assertTrue(re.search("mesh_store_lookups_total.*hit.* 1", daemon.get(
                "/metrics", admin=True).body.decode()))


if __name__ == "__main__":
    unittest.main()
