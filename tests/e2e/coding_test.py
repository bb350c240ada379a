"""Bodies in gzip and zstd: the same as without, within the same limits, and held against the same
client."""

import ctypes
import gzip
import hashlib
import http.client
import json
import random
import select
import string
import unittest

from e2e.daemon import JSON, PATIENCE, SMALL, Daemon, another
from e2e.daemon_test import occupied, wait_until, wait_until_read

LIBRARY = ctypes.CDLL("libzstd.so.1")
LIBRARY.ZSTD_compress.restype = LIBRARY.ZSTD_compressBound.restype = ctypes.c_size_t
LIBRARY.ZSTD_compressBound.argtypes = [ctypes.c_size_t]
LIBRARY.ZSTD_compress.argtypes = [ctypes.c_char_p, ctypes.c_size_t, ctypes.c_char_p,
                                  ctypes.c_size_t, ctypes.c_int]

BODY = json.dumps(SMALL).encode()
MESH = json.dumps({"positions": [-1, -1, 0, 1, -1, 0, 0, 1, 0]}).encode()
MEBI = 1 << 20


def zstd(data):
    room = ctypes.create_string_buffer(LIBRARY.ZSTD_compressBound(len(data)))
    size = LIBRARY.ZSTD_compress(room, len(room), data, len(data), 3)
    return room.raw[:size]


def coded(name):
    return {"Content-Encoding": name}


PACKERS = {"gzip": gzip.compress, "zstd": zstd}
# A gigabyte of zeros each.
BOMBS = {"gzip": gzip.compress(bytes(MEBI)) * 1024,
         "zstd": b"\x28\xb5\x2f\xfd\0\x68" + b"\2\0\x10\0" * 8191 + b"\3\0\x10\0"}


class CodingTest(unittest.TestCase):
    def assert_problem(self, answer, status, kind, *words):
        self.assertEqual(answer.status, status, answer.body)
        problem = json.loads(answer.body)
        self.assertEqual(problem["type"], f"urn:shaded:problem:{kind}")
        self.assertEqual(answer.headers["Accept-Encoding"], "gzip, zstd" if status == 415 else None)
        for word in words:
            self.assertIn(word, problem["detail"])

    def test_every_route_takes_them(self):
        digest = hashlib.sha256(MESH).hexdigest()
        scene = json.dumps({**SMALL, "objects": [{"type": "mesh", "data": f"sha256-{digest}"}]})
        with Daemon("--response-cache", "0") as daemon:
            plain = daemon.render(BODY)
            plan = json.loads(daemon.post("/v1/explain", BODY).body)
            for name, pack in PACKERS.items():
                answer = daemon.render(pack(BODY), coded(name))
                self.assertEqual((answer.status, answer.headers["ETag"], answer.body),
                                 (200, plain.headers["ETag"], plain.body))
                known = {**coded(name), "If-None-Match": plain.headers["ETag"]}
                self.assertEqual(daemon.render(pack(BODY), known).status, 304)
                answer = daemon.post("/v1/explain", pack(BODY), coded(name))
                self.assertEqual(json.loads(answer.body)["tier"], plan["tier"])
                self.assertEqual(daemon.post("/v1/compare", pack(BODY), coded(name)).status, 200)
                self.assertEqual(daemon.render(pack(b""), coded(name)).status, 400)
                # Its digest is that of what the body stands for.
                put = daemon.call("PUT", f"/v1/meshes/{digest}", pack(MESH),
                                  {**JSON, **coded(name)})
                self.assertEqual(put.status, 201 if name == "gzip" else 204, put.body)
                self.assertEqual(daemon.render(pack(scene.encode()), coded(name)).status, 200)
                wrong = hashlib.sha256(pack(MESH)).hexdigest()
                put = daemon.call("PUT", f"/v1/meshes/{wrong}", pack(MESH), {**JSON, **coded(name)})
                self.assert_problem(put, 422, "mesh", f"{len(MESH)} bytes", digest)

    def test_what_is_kept_is_found_however_it_comes(self):
        with Daemon() as daemon:
            statuses = []
            for name, body in ((None, BODY), ("gzip", gzip.compress(BODY)), ("zstd", zstd(BODY)),
                               ("x-gzip", gzip.compress(BODY, 0)), ("zstd", zstd(BODY))):
                answer = daemon.render(body, coded(name) if name else {})
                statuses.append(answer.headers["Cache-Status"])
            self.assertEqual(statuses, ["shaded; fwd=miss; stored"] + 4 * ["shaded; hit"])
            self.assertEqual(
                daemon.metrics()['shaded_stage_duration_seconds_count{stage="encode"}'], 1)
            # The same bytes mean something else without their coding.
            self.assertEqual(daemon.render(zstd(BODY)).status, 400)
            self.assert_problem(daemon.render(zstd(BODY), coded("gzip")), 400, "coding")

    def test_codings_that_are_not_taken(self):
        with Daemon() as daemon:
            for name in ("br", "deflate", "gzip, zstd", "gzip, gzip", "zstd;q=1", "\"gzip\""):
                self.assert_problem(daemon.render(BODY, coded(name)), 415, "media-type", name)
            for name in ("identity", "", "identity, identity"):
                self.assertEqual(daemon.render(BODY, coded(name)).status, 200)
            body = gzip.compress(BODY)
            head = (b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n"
                    b"Content-Length: %d\r\nConnection: close\r\nContent-Encoding: identity\r\n"
                    b"Content-Encoding: %s\r\n\r\n%s")
            for name, status in (b"gzip", b"200"), (b"br", b"415"):
                answer = daemon.raw(head % (len(body), name, body))
                self.assertEqual(answer.split(b" ", 2)[1], status)
            # A media type that is wrong says nothing of codings (RFC 9110, section 12.5.3).
            answer = daemon.call("POST", "/v1/render", body,
                                 {"Content-Type": "text/plain", **coded("gzip")})
            self.assertEqual((answer.status, answer.headers["Accept-Encoding"]), (415, None))
            # Of what has no body nobody asks.
            self.assertEqual(daemon.get("/v1/version", coded("br")).status, 200)
        with Daemon("--cors-origins", "*") as daemon:
            asked = {"Origin": "https://a.example", "Access-Control-Request-Method": "POST"}
            answer = daemon.call("OPTIONS", "/v1/render", headers=asked)
            self.assertIn("Content-Encoding", answer.headers["Access-Control-Allow-Headers"])

    def test_what_is_spoilt_is_told(self):
        with Daemon() as daemon:
            for name, pack in PACKERS.items():
                whole = pack(BODY)
                for body, word in ((whole[:-1], "end before their"), (whole[:1], "end before"),
                                   (b"", "end before"), (BODY, "is not sound"),
                                   (whole + bytes(12), "is not sound"),
                                   (whole[:20] + bytes(20) + whole[40:], "is not sound")):
                    self.assert_problem(daemon.render(body, coded(name)), 400, "coding", name, word)
                halves = pack(BODY[:30]) + pack(BODY[30:])
                self.assertEqual(daemon.render(halves, coded(name)).status, 200)

    def test_limits_hold_for_what_they_stand_for(self):
        with Daemon("--max-body", "100000") as daemon:
            for name, pack in PACKERS.items():
                for size, status in (100000, 200), (100001, 413):
                    body = BODY + b" " * (size - len(BODY))
                    self.assertEqual(daemon.render(pack(body), coded(name)).status, status)
            for name, pack in PACKERS.items():
                self.assert_problem(daemon.render(pack(bytes(MEBI)), coded(name)), 413,
                                    "body-too-large", "100000 bytes", "the limit `body`", name)
            self.assertEqual(daemon.metrics()['shaded_refused_total{limit="body"}'], 4)

    def test_a_beginning_may_lie(self):
        """What is long is decoded whole in its turn, however dense its beginning was."""
        noise = "".join(random.Random(1).choices(string.ascii_letters, k=100000))
        scene = json.dumps({**SMALL, "objects": [{"type": "sphere", "name": noise}]}).encode()
        with Daemon("--max-body", "1M", "--response-cache", "0") as daemon:
            for name, pack in PACKERS.items():
                for parts in ((scene, b" " * (MEBI - len(scene))),
                              (b" " * (MEBI - len(scene)), scene),
                              [scene] + 900 * [b" " * 1000]):
                    body = b"".join(pack(part) for part in parts)
                    answer = daemon.render(body, coded(name))
                    self.assertEqual(answer.status, 200, answer.body[:300])
                    self.assert_problem(daemon.render(body + pack(b" " * 200000), coded(name)), 413,
                                        "body-too-large", "1048576 bytes", "the limit `body`", name)
                    self.assert_problem(daemon.render(body + b"x", coded(name)), 400, "coding", name)
                    self.assertEqual(daemon.render(body[:-1], coded(name)).status, 400)

    def test_refusals_tell_their_limit(self):
        with Daemon("--max-body", "100000") as daemon:
            for name, pack in PACKERS.items():
                for body, status, problem, limit in (
                        (pack(bytes(MEBI)), 413, "body-too-large", "body"),
                        (pack(BODY)[:-1], 400, "coding", None)):
                    answer = daemon.render(body, {**coded(name), "X-Request-Id": name + problem})
                    self.assertEqual(answer.status, status)
                    event = daemon.wait_for("request",
                                            lambda event: event["id"] == name + problem)
                    self.assertEqual((event["problem"], event.get("limit")), (problem, limit))

    def test_bombs_take_nothing(self):
        with Daemon("--threads", "2", "--memory", "96M", "--reuse", "0") as daemon:
            high = []
            for turn in range(2):
                for name, body in 10 * list(BOMBS.items()):
                    self.assert_problem(daemon.render(body, coded(name)), 413, "body-too-large")
                self.assertEqual(daemon.render(another(SMALL, turn)).status, 200)
                # What has ended gives its memory back before its answer is sent, or at once after.
                wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)
                high.append(daemon.metrics()["shaded_memory_used_bytes"])
            self.assertLess(high[1] - high[0], MEBI)

    def test_they_come_in_pieces_or_not_at_all(self):
        with Daemon() as daemon:
            for name, pack in PACKERS.items():
                body = pack(BODY)
                connection = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE)
                connection.putrequest("POST", "/v1/render")
                connection.putheader("Transfer-Encoding", "chunked")
                for field in {**JSON, **coded(name)}.items():
                    connection.putheader(*field)
                connection.endheaders()
                for byte in body:
                    connection.send(b"1\r\n%c\r\n" % byte)
                connection.send(b"0\r\n\r\n")
                self.assertEqual(connection.getresponse().status, 200)
                connection.close()
                # Who leaves amid it leaves nothing.
                connection = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE)
                connection.putrequest("POST", "/v1/render")
                connection.putheader("Content-Length", str(len(body)))
                for field in {**JSON, **coded(name)}.items():
                    connection.putheader(*field)
                connection.endheaders(body[:-5])
                wait_until(lambda: daemon.metrics()['shaded_connections{at="body"}'] == 1)
                connection.close()
                wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)


class TurnsTest(unittest.TestCase):
    def test_what_is_long_decoded_waits_with_what_is_long(self):
        """Though it is short as it comes, it is not read before its turn among the large ones."""
        large = json.dumps({**SMALL, "materials": {str(i): {} for i in range(10000)}, "odd": 0})
        with Daemon("--threads", "1", "--timeout", "300", "--drain-time", "0") as daemon:
            first = occupied(daemon)
            for name, pack in PACKERS.items():
                body = pack(large.encode())
                self.assertLess(len(body), 64 << 10)
                # Another client, to whom large work gives way, but not for what was not read.
                connection = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE,
                                                        source_address=("127.0.0.2", 0))
                connection.request("POST", "/v1/render", body, {**JSON, **coded(name)})
                wait_until_read(daemon, 1)
                # What is small passes it, and nobody knows yet that it has a mistake.
                self.assertEqual(daemon.render(another(SMALL)).status, 200)
                self.assertEqual(daemon.render(pack(BODY), coded(name)).status, 200)
                self.assertFalse(select.select([connection.sock], [], [], 0)[0])
                first.leave()
                self.assertEqual(connection.getresponse().status, 422)
                connection.close()
                first = occupied(daemon)
            first.leave()

    def test_what_waits_is_as_small_as_it_came(self):
        """However many there are: but for the one whose turn it is, nobody has 16 MB."""
        with Daemon("--threads", "1", "--timeout", "300", "--drain-time", "0",
                    "--reuse", "0") as daemon:
            first = occupied(daemon)
            # Between two of its tiles: all of its memory is taken.
            self.assertEqual(daemon.render(SMALL).status, 200)
            used = daemon.metrics()["shaded_memory_used_bytes"]
            connections = []
            for name, pack in PACKERS.items():
                for i in range(5):
                    connection = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE)
                    connection.request("POST", "/v1/render", pack(b" " * (16 * MEBI + i) + BODY),
                                       {**JSON, **coded(name)})
                    connections.append(connection)
            wait_until_read(daemon, 10)
            self.assertLess(daemon.metrics()["shaded_memory_used_bytes"], used + 80 * MEBI)
            connections.pop().close()
            wait_until_read(daemon, 9)
            first.leave()
            for connection in connections:
                self.assertEqual(connection.getresponse().status, 200)
                connection.close()


if __name__ == "__main__":
    unittest.main()
