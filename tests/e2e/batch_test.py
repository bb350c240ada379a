"""POST /v1/batch: many variants of a scene in one answer."""

import contextlib
import http.client
import json
import socket
import time
import unittest

from e2e.daemon import SANITIZED, SMALL, Daemon, another
from e2e.daemon_test import ENDLESS, Folder, occupied, wait_until
from e2e.queue_test import encoded
from e2e.render_test import parts

PLAIN = {"image": {"width": 24, "height": 16, "samples": 1}, "objects": [{"type": "sphere"}]}
# A picture that is not compressed: of some 720 KB.
LARGE = {"image": {"width": 400, "height": 300, "samples": 1},
         "output": {"bitDepth": 16, "compression": "fast"}, "objects": [{"type": "sphere"}]}
# Many more small pictures than a queue and a system's buffers hold.
COUNT = 500 if SANITIZED else 2000


def shades(count, start=0.0):
    return [{"background": start + i / 1024} for i in range(count)]


class Test(Folder):
    def batch(self, daemon, scene, headers=None, **members):
        answer = daemon.post("/v1/batch", {"scene": scene, **members}, headers)
        self.assertEqual(answer.status, 200, answer.body[:500])
        found = parts(answer)
        self.assertEqual([part.get_param("name", header="content-disposition") for part in found],
                         [str(i) for i in range(len(found))])
        return found

    def pictures(self, *arguments, **members):
        found = self.batch(*arguments, **members)
        self.assertEqual({part.get_content_type() for part in found}, {"image/png"})
        return [part.get_payload(decode=True) for part in found]

    def problem(self, part, status, kind):
        self.assertEqual(part.get_content_type(), "application/problem+json")
        problem = json.loads(part.get_payload(decode=True))
        self.assertEqual((problem["status"], problem["type"]), (status, f"urn:shaded:problem:{kind}"))
        return problem


class BatchTest(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--threads", "2", "--cors-origins", "https://a.example")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def render(self, scene):
        answer = self.daemon.render(scene)
        self.assertEqual(answer.status, 200, answer.body[:500])
        return answer.body

    def test_variants_are_the_pictures_of_their_documents(self):
        changes = [{"background": i / 40} for i in range(40)]
        got = self.pictures(self.daemon, PLAIN, variants=changes)
        self.assertEqual(got, [self.render({**PLAIN, **change}) for change in changes])
        self.assertEqual(len(set(got)), len(got))
        patches = [{}, {"image": {"width": 30}}, {"objects": None}, {"image": None},
                   {"output": {"format": "jpeg"}}, {"output": {"format": "exr"}}]
        found = self.batch(self.daemon, PLAIN, variants=patches)
        self.assertEqual(found[1].get_payload(decode=True),
                         self.render({**PLAIN, "image": {**PLAIN["image"], "width": 30}}))
        self.assertIn("objects", self.problem(found[2], 422, "scene")["detail"])
        self.assertEqual(found[3].get_payload(decode=True), self.render({"objects": PLAIN["objects"]}))
        self.assertEqual([(part.get_content_type(), part.get_filename()) for part in found[4:]],
                         [("image/jpeg", "4.jpeg"), ("image/x-exr", "5.exr")])
        whole = [{"objects": PLAIN["objects"], "image": {"width": 9, "height": 9}}]
        self.assertEqual(self.pictures(self.daemon, {}, variants=whole), [self.render(whole[0])])

    def test_a_sweep_takes_all_combinations(self):
        sweep = {"/objects/0/material/shininess": [5, 50], "/camera/fov": [30, 40, 50]}
        got = self.pictures(self.daemon, PLAIN, sweep=sweep)
        expected = [self.render({**PLAIN, "camera": {"fov": fov}, "objects": [
            {"type": "sphere", "material": {"shininess": shininess}}]})
            for shininess in (5, 50) for fov in (30, 40, 50)]
        self.assertEqual(got, expected)
        shown = self.pictures(self.daemon, PLAIN, sweep={"/background": [None, [0, 0, 0, 0], 1]})
        self.assertEqual(shown[0], shown[1])

    def test_the_same_request_gets_the_same_bytes(self):
        answers = [self.daemon.post("/v1/batch", {"scene": PLAIN, "variants": shades(5, 0.5)})
                   for _ in range(2)]
        self.assertEqual(answers[0].body, answers[1].body)
        self.assertEqual(answers[0].headers["Content-Type"], answers[1].headers["Content-Type"])
        self.assertEqual(answers[0].headers["Cache-Control"], "no-store")

    def test_a_variant_that_fails_is_a_problem_and_the_others_go_on(self):
        changes = [{}, {"objects": [{"type": "spere"}]}, {"outputs": [{"name": "a"}]},
                   {"objects": [{"type": "mesh", "data": "sha256-" + "0" * 64}]},
                   {"image": {"width": 60000, "height": 60000}}, {"accuracy": {"maxError": -1}}, {}]
        found = self.batch(self.daemon, PLAIN, variants=changes)
        self.assertEqual(self.problem(found[1], 422, "scene")["errors"][0]["pointer"], "/objects/0/type")
        self.assertEqual(self.problem(found[2], 422, "scene")["errors"][0]["pointer"], "/outputs")
        self.problem(found[3], 409, "unknown-data")
        self.problem(found[4], 422, "limit")
        self.problem(found[5], 422, "scene")
        self.assertEqual(found[1].get_filename(), "1.json")
        for i in (0, 6):
            self.assertEqual(found[i].get_payload(decode=True), self.render(PLAIN))
        lists = self.batch(self.daemon, PLAIN, sweep={"/objects": [[{"type": "sphere"}], []],
                                                      "/objects/0/radius": [1]})
        self.assertEqual(lists[0].get_content_type(), "image/png")
        self.assertIn("list of 0", self.problem(lists[1], 422, "scene")["detail"])

    def test_a_scene_alone_is_itself(self):
        found = self.batch(self.daemon, PLAIN, name="plain")
        self.assertEqual([part.get_payload(decode=True) for part in found], [self.render(PLAIN)])

    def test_mistakes_in_the_batch_itself(self):
        for batch, pointer in (({}, ""), ({"scene": 1, "variants": [{}]}, "/scene"),
                               ({"scene": PLAIN, "variants": [{}], "sweep": {"/background": [1]}}, ""),
                               ({"scene": PLAIN, "variants": [{}] * 10001}, "/variants"),
                               ({"scene": PLAIN, "sweep": {"/background": list(range(101)),
                                                           "/ambient": list(range(100))}}, "/sweep"),
                               ({"scene": PLAIN, "sweep": {"/objects/1/type": ["box"]}}, "/sweep"),
                               ({"scene": PLAIN, "varants": [{}]}, "/varants")):
            answer = self.daemon.post("/v1/batch", batch)
            self.assertEqual(answer.status, 422, answer.body[:200])
            self.assertIn(pointer, [error["pointer"] for error in json.loads(answer.body)["errors"]])
        self.assertEqual(self.daemon.post("/v1/batch", b"{").status, 400)
        answer = self.daemon.post("/v1/batch", {"scene": PLAIN, "variants": [{}]}, {"Accept": "image/png"})
        self.assertEqual(answer.status, 406)
        self.assertEqual(self.daemon.get("/v1/batch").headers["Allow"], "POST, OPTIONS")
        answer = self.daemon.post("/v1/batch", {"scene": PLAIN, "variants": [{}]},
                                  {"Origin": "https://a.example", "If-None-Match": "*"})
        self.assertEqual((answer.status, answer.headers["Access-Control-Allow-Origin"]),
                         (200, "https://a.example"))

    def test_ten_thousand(self):
        """A sanitizer sees a thousand: that as many may be is no matter of memory or threads."""
        tiny = {**PLAIN, "image": {"width": 1, "height": 1, "samples": 1}}
        rows = 10 if SANITIZED else 100
        got = self.batch(self.daemon, tiny, sweep={"/background": [i / 100 for i in range(rows)],
                                                   "/ambient": [i / 100 for i in range(100)]})
        self.assertEqual(len(got), rows * 100)

    def test_a_scene_that_is_a_long_document(self):
        many = {**PLAIN, "lights": [{"type": "point", "position": [i / 7, 3, 4]} for i in range(3000)]}
        got = self.pictures(self.daemon, many, variants=shades(3))
        self.assertEqual(got[2], self.render({**many, "background": 2 / 1024}))

    def test_it_is_told_in_metrics_and_log(self):
        answer = self.daemon.post("/v1/batch", {"scene": PLAIN, "variants": shades(3)},
                                  {"X-Request-Id": "batched"})
        event = self.daemon.wait_for("request", lambda event: event["id"] == "batched")
        self.assertEqual((event["status"], event["bytes"]), (200, len(answer.body)))
        self.assertGreater(self.daemon.metrics()['shaded_requests_total{route="/v1/batch",status="200"}'], 0)

    def test_http_1_0_gets_it_too(self):
        body = json.dumps({"scene": PLAIN, "variants": shades(3)}).encode()
        data = self.daemon.raw(b"POST /v1/batch HTTP/1.0\r\nContent-Type: application/json\r\n"
                               b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
        head, _, rest = data.partition(b"\r\n\r\n")
        self.assertNotIn(b"chunked", head)
        self.assertEqual(rest.count(b"\x89PNG"), 3)
        self.assertTrue(rest.endswith(b"--\r\n"))


class Reader:
    """A client that reads as much as it likes."""

    def __init__(self, daemon, batch):
        self.socket = socket.socket()
        self.socket.settimeout(500)
        # The system would keep up to tens of megabytes for who does not read.
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 16)
        self.socket.connect(daemon.address)
        body = json.dumps(batch).encode()
        self.socket.sendall(b"POST /v1/batch HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n"
                            b"Content-Length: %d\r\n\r\n%s" % (len(body), body))

    def response(self):
        response = http.client.HTTPResponse(self.socket)
        response.begin()
        return response

    def close(self):
        """A response that somebody still has would keep the connection, if that were only closed."""
        with contextlib.suppress(OSError):
            self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()


class StreamTest(Test):
    def test_parts_come_as_they_are_done(self):
        with Daemon("--threads", "1", "--timeout", "300") as daemon:
            reader = Reader(daemon, {"scene": PLAIN, "variants": [{}, {}, ENDLESS]})
            response = reader.response()
            got = b""
            while got.count(b"\x89PNG") < 2:
                got += response.read1()
            reader.close()
            # The endless one ends with its client.
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)
            wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)

    def test_the_deadline_is_each_variants(self):
        variants = [{}, ENDLESS, {"background": 1}, another(ENDLESS), {}]
        for seconds in (1, 4, 16, 64):  # until it is enough for small pictures
            with Daemon("--threads", "2", "--timeout", str(seconds)) as daemon:
                found = self.batch(daemon, PLAIN, variants=variants)
                for i in (1, 3):
                    self.assertIn("timeout", self.problem(found[i], 504, "deadline")["detail"])
            kinds = [found[i].get_content_type() for i in (0, 2, 4)]
            if kinds == ["image/png"] * 3:
                return
        self.fail(kinds)

    def test_who_does_not_read_holds_up_little(self):
        with Daemon("--threads", "2", "--response-cache", "0", "--reuse", "0") as daemon:
            reader = Reader(daemon, {"scene": LARGE, "variants": shades(60)})
            wait_until(lambda: encoded(daemon) > 1)
            last, rested = -1, 0
            while rested < 10:  # until nothing more is made, however slowly pictures are
                is_same = encoded(daemon) == last and not daemon.metrics()["shaded_workers_busy"]
                rested = rested + 1 if is_same else 0
                last = encoded(daemon)
                time.sleep(0.1)
            self.assertLess(last, 30)  # the system's buffer to send has megabytes of them
            self.assertEqual(daemon.render(PLAIN).status, 200)
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)
            # Then it reads all.
            response = reader.response()
            self.assertEqual(response.read().count(b"\x89PNG"), 60)
            reader.close()

    def test_who_leaves_ends_it(self):
        with Daemon("--threads", "2") as daemon:
            for wait in (0, 0.05, 0.2):
                reader = Reader(daemon, {"scene": LARGE, "variants": shades(2000, wait)})
                time.sleep(wait)
                reader.close()
            wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)
            self.assertEqual(daemon.metrics()["shaded_queue_depth"], 0)

    def test_others_have_their_turns(self):
        """The batch waits in the queue with a few requests, not with all of them."""
        with Daemon("--threads", "1", "--queue", "2", "--timeout", "300") as daemon:
            reader = Reader(daemon, {"scene": SMALL, "variants": shades(COUNT)})
            response = reader.response()
            self.assertEqual(daemon.render(PLAIN).status, 200)
            body = response.read()
            self.assertEqual(body.count(b"Content-Disposition"), COUNT)
            self.assertEqual(body.count(b"\x89PNG"), COUNT)
            reader.close()

    def test_it_waits_behind_large_work(self):
        with Daemon("--threads", "1", "--queue", "3", "--timeout", "300") as daemon:
            running = occupied(daemon)
            got = self.pictures(daemon, PLAIN, variants=shades(20))
            self.assertEqual(len(got), 20)
            running.leave()

    def test_a_server_that_stops_ends_it(self):
        daemon = Daemon("--threads", "1", "--timeout", "300", "--drain-time", "3")
        readers = [Reader(daemon, {"scene": PLAIN, "variants": [ENDLESS] * 10}),
                   Reader(daemon, {"scene": LARGE, "variants": shades(1000)})]
        wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 1)
        daemon.signal()
        self.assertEqual(daemon.wait(), 0, daemon.stderr())
        for reader in readers:
            reader.close()
        # What is short is finished first.
        daemon = Daemon("--threads", "1", "--drain-time", "300")
        reader = Reader(daemon, {"scene": SMALL, "variants": shades(COUNT)})
        response = reader.response()
        daemon.signal()
        self.assertEqual(response.read().count(b"\x89PNG"), COUNT)
        reader.close()
        self.assertEqual(daemon.wait(), 0, daemon.stderr())


if __name__ == "__main__":
    unittest.main()
