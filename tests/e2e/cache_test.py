"""The response cache: the same answer without the work, as far as room and settings allow."""

import http.client
import json
import signal
import socket
import threading
import unittest

from e2e.daemon import SMALL, SOURCE, Answer, Daemon
from e2e.daemon_test import Background, Folder, wait_until
from e2e.queue_test import BUSY, encoded

HIT, STORED, MISS = "shaded; hit", "shaded; fwd=miss; stored", "shaded; fwd=miss"
# What tells about one request rather than about its picture.
OWN = {"Date", "X-Request-Id", "Server-Timing", "Cache-Status"}


def status(answer):
    return answer.headers["Cache-Status"]


def scene(number):
    return {**SMALL, "ambient": number / 1000}


def large(number):
    """A picture of about 60 KiB."""
    return {**scene(number), "image": {"width": 200, "height": 200, "samples": 1},
            "output": {"format": "tiff", "bitDepth": "float"}}


def receive(stream):
    """One of several answers that come on a connection."""
    line, headers = stream.readline(), http.client.parse_headers(stream)
    return Answer(int(line.split()[1]), headers, stream.read(int(headers["Content-Length"])))


class Test(Folder):
    def assert_same(self, answer, fresh):
        self.assertEqual((answer.status, answer.body), (fresh.status, fresh.body))
        for own, other in ((answer, fresh), (fresh, answer)):
            kept = [(name, value) for name, value in own.headers.items() if name not in OWN]
            self.assertTrue(kept)
            for name, _ in kept:
                self.assertEqual(own.headers.get_all(name), other.headers.get_all(name))


class AnswerTest(Test):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--cache-control", "public, max-age=60, immutable")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def answers(self, result):
        return self.daemon.metrics()[f'shaded_response_cache_answers_total{{result="{result}"}}']

    def test_a_hit_is_the_same_answer_without_the_work(self):
        before, hits, misses = encoded(self.daemon), self.answers("hit"), self.answers("miss")
        fresh = self.daemon.render(scene(1))
        self.assertEqual(status(fresh), STORED)
        self.assertEqual(fresh.headers["Cache-Control"], "public, max-age=60, immutable")
        parse = 'shaded_stage_duration_seconds_count{stage="parse"}'
        parsed = self.daemon.metrics()[parse]
        again = self.daemon.render(scene(1))
        self.assertEqual(status(again), HIT)
        self.assert_same(again, fresh)
        # By the document's bytes: it is not even read. In other words it is.
        self.assertRegex(again.headers["Server-Timing"], "^queue;dur=0.000, parse;dur=0.000, ")
        reworded = self.daemon.render(json.dumps(scene(1), indent=2))
        self.assertEqual(status(reworded), HIT)
        self.assert_same(reworded, fresh)
        for answer in (again, reworded):
            self.assertRegex(answer.headers["Server-Timing"],
                             ", shade;dur=0.000, .*, reuse;desc=picture$")
            self.assertNotEqual(answer.headers["X-Request-Id"], fresh.headers["X-Request-Id"])
        self.assertEqual(self.daemon.metrics()[parse], parsed)
        self.assertEqual(encoded(self.daemon), before + 1)
        self.assertEqual((self.answers("hit"), self.answers("miss")), (hits + 2, misses + 1))

    def test_headers_of_the_document_come_along(self):
        # The same meaning, but warnings in the order of the words.
        materials = {"one": {"diffuse": 1.5}, "two": {"diffuse": 1.25}}
        wide = {**SMALL, "output": {"format": "exr", "bitDepth": "half"}, "materials": materials,
                "objects": [{"type": "sphere", "material": {"emissive": 1e30}},
                            *({"type": "sphere", "material": name} for name in materials)]}
        fresh, again = self.daemon.render(wide), self.daemon.render(wide)
        self.assertEqual((status(fresh), status(again)), (STORED, HIT))
        self.assert_same(again, fresh)
        self.assertEqual(len(fresh.headers.get_all("Shaded-Warning")), 2)
        self.assertTrue(fresh.headers["Shaded-Saturated"])
        turned = {**wide, "materials": dict(reversed(materials.items()))}
        again = self.daemon.render(turned)
        self.assertEqual(status(again), HIT)
        self.assertEqual(again.headers["ETag"], fresh.headers["ETag"])
        self.assertEqual(sorted(again.headers.get_all("Shaded-Warning")),
                         sorted(fresh.headers.get_all("Shaded-Warning")))

    def test_accept_is_part_of_the_question(self):
        bodies = {}
        for turn in (STORED, HIT):
            for accept in ("image/png", "image/jpeg", "image/webp"):
                answer = self.daemon.render(scene(2), {"Accept": accept})
                self.assertEqual((status(answer), answer.headers["Content-Type"]), (turn, accept))
                self.assertEqual(bodies.setdefault(accept, answer.body), answer.body)
        self.assertEqual(status(self.daemon.render(scene(2))), HIT)
        for accept in ("text/html", "multipart/form-data"):
            answer = self.daemon.render(scene(2), {"Accept": accept})
            self.assertEqual((answer.status, status(answer)), (406, None))

    def test_several_outputs_are_one_answer(self):
        outputs = {**scene(3), "outputs": [{"name": "a"}, {"name": "b", "format": "jpeg"}]}
        fresh, again = self.daemon.render(outputs), self.daemon.render(outputs)
        self.assertEqual((status(fresh), status(again)), (STORED, HIT))
        self.assert_same(again, fresh)
        self.assertEqual(status(self.daemon.render(scene(3))), STORED)

    def test_a_known_tag_is_304_before_everything(self):
        fresh = self.daemon.render(scene(4))
        tag, hits = fresh.headers["ETag"], self.answers("hit")
        for body in (scene(4), json.dumps(scene(4), indent=1)):
            for condition in (tag, f'"x", W/{tag}', f'*, {tag}'):
                answer = self.daemon.render(body, {"If-None-Match": condition})
                self.assertEqual((answer.status, answer.body, status(answer)), (304, b"", None))
                self.assertEqual(answer.headers["ETag"], tag)
                self.assertEqual(answer.headers["Cache-Control"], fresh.headers["Cache-Control"])
                self.assertEqual(answer.headers["Vary"], "Accept")
                self.assertEqual(answer.headers["Content-Length"], str(len(fresh.body)))
        self.assertEqual(self.answers("hit"), hits)
        other = self.daemon.render(scene(4), {"If-None-Match": '"other"'})
        self.assertEqual((other.status, status(other)), (200, HIT))
        self.assert_same(other, fresh)

    def test_mistakes_are_neither_kept_nor_storable(self):
        entries = self.daemon.metrics()["shaded_response_cache_entries"]
        for body, code in ((b"{", 400), (b"", 400), ({**SMALL, "ambient": "much"}, 422),
                           ({**SMALL, "image": {"width": 60000, "height": 60000}}, 422)):
            for _ in range(2):
                answer = self.daemon.render(body)
                self.assertEqual((answer.status, status(answer)), (code, None))
                self.assertEqual(answer.headers["Cache-Control"], "no-store")
        self.assertEqual(self.daemon.metrics()["shaded_response_cache_entries"], entries)

    def test_only_pictures_are_kept(self):
        for path in ("/v1/explain", "/v1/compare"):
            for _ in range(2):
                answer = self.daemon.post(path, scene(5))
                self.assertEqual((answer.status, status(answer)), (200, None))
        self.assertEqual(status(self.daemon.render(scene(5))), STORED)


class RoomTest(Test):
    def test_the_least_recently_used_is_forgotten(self):
        with Daemon("--response-cache", "1M") as daemon:
            first = daemon.render(large(0))
            size = len(first.body)
            self.assertLess(50000, size)
            self.assertLess(size, 100000)
            count = (1 << 20) // size + 3
            for number in range(1, count):
                self.assertEqual(status(daemon.render(large(number))), STORED)
                self.assertEqual(status(daemon.render(large(0))), HIT)
                self.assertLessEqual(daemon.metrics()["shaded_response_cache_bytes"], 1 << 20)
            metrics = daemon.metrics()
            self.assertGreater(metrics["shaded_response_cache_evictions_total"], 0)
            self.assertEqual(metrics["shaded_response_cache_entries"],
                             count - metrics["shaded_response_cache_evictions_total"])
            self.assertEqual(status(daemon.render(large(1))), STORED)
            self.assert_same(daemon.render(large(0)), first)

    def test_a_picture_above_an_eighth_of_the_cap_is_not_kept(self):
        with Daemon("--response-cache", "256K") as daemon:
            for _ in range(2):
                self.assertEqual(status(daemon.render(large(0))), MISS)
            self.assertEqual(status(daemon.render(SMALL)), STORED)
            self.assertEqual(status(daemon.render(SMALL)), HIT)
            self.assertEqual(daemon.metrics()["shaded_response_cache_entries"], 1)

    def test_0_turns_it_off(self):
        with Daemon("--response-cache", "0") as daemon:
            one, two = daemon.render(SMALL), daemon.render(SMALL)
            self.assertEqual((status(one), status(two)), (None, None))
            self.assertEqual(one.body, two.body)
            self.assertEqual(encoded(daemon), 2)
            metrics = daemon.metrics()
            self.assertEqual(sum(value for name, value in metrics.items()
                                 if name.startswith("shaded_response_cache_")), 0)

    def test_what_is_forgotten_is_still_sent(self):
        """To a client that is slow to take it."""
        def long(number):
            return {**scene(number), "objects": [{"type": "plane"}],
                    "image": {"width": 256, "height": 256, "samples": 1},
                    "camera": {"position": [0, 1, 3]}, "lights": [{"position": [1, 2, 3, 1]}],
                    "output": {"format": "tiff", "bitDepth": "float",
                               "colorSpace": "lin_rec709"}}

        with Daemon("--response-cache", "1500K") as daemon, socket.socket() as connection:
            fresh = daemon.render(long(0))
            self.assertEqual(status(fresh), STORED)
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            connection.settimeout(500)
            connection.connect(daemon.address)
            body = json.dumps(long(0)).encode()
            # As often as it takes for an answer to be longer than what the system's buffers hold.
            count = 2 + (12 << 20) // len(fresh.body)
            message = (b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n"
                       b"Content-Length: %d\r\n\r\n%s" % (len(body), body))
            connection.sendall(message * count)
            looks = []

            def stuck():
                metrics = daemon.metrics()
                looks.append((metrics['shaded_connections{at="answer"}'],
                              metrics['shaded_response_cache_answers_total{result="hit"}']))
                return looks[-1][0] == 1 and len(looks) > 10 and len(set(looks[-10:])) == 1

            wait_until(stuck)
            self.assertLess(looks[-1][1], count)
            number = 0
            while daemon.metrics()["shaded_response_cache_evictions_total"] < 2:
                number += 1
                self.assertEqual(status(daemon.render(long(number))), STORED)
            # The last one may be just leaving.
            wait_until(lambda: daemon.metrics()['shaded_connections{at="answer"}'] == 1)
            found = []
            with connection.makefile("rb") as stream:
                for _ in range(count):
                    slow = receive(stream)
                    self.assert_same(slow, fresh)
                    found.append(status(slow))
            # Those that were behind the one that was being sent find it gone.
            self.assertEqual(found[0], HIT)
            self.assertEqual(found.count(STORED), 1, found)

    def test_equal_requests_still_wait_for_one_picture(self):
        with Daemon("--threads", "1", "--timeout", "300") as daemon:
            first = Background(daemon, BUSY)
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] or first.answer)
            together = [first, *(Background(daemon, BUSY) for _ in range(5))]
            answers = [request.result() for request in together]
            self.assertEqual({answer.status for answer in answers}, {200})
            self.assertEqual(len({answer.body for answer in answers}), 1)
            self.assertEqual(status(answers[0]), STORED)
            metrics = daemon.metrics()
            self.assertEqual(encoded(daemon), 1)
            # Who came late found it finished.
            found = metrics['shaded_response_cache_answers_total{result="hit"}']
            self.assertEqual(metrics["shaded_joined_total"] + found, 5)
            self.assertEqual(status(daemon.render(BUSY)), HIT)
            self.assertEqual(encoded(daemon), 1)

    def test_many_clients_and_little_room(self):
        """What one client is sent is forgotten for another one meanwhile."""
        with Daemon("--response-cache", "800K", "--queue", "1000") as daemon:
            wanted = [daemon.render(large(number)).body for number in range(16)]
            wrong = []

            def work(seed):
                for turn in range(24):
                    number = (seed * 5 + turn * 3) % 16
                    answer = daemon.render(large(number))
                    if (answer.status, answer.body) != (200, wanted[number]) or \
                            status(answer) not in (HIT, STORED):
                        wrong.append((seed, turn, answer.status, status(answer)))

            threads = [threading.Thread(target=work, args=(seed,)) for seed in range(6)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            self.assertEqual(wrong, [])
            metrics = daemon.metrics()
            self.assertGreater(metrics["shaded_response_cache_evictions_total"], 0)
            self.assertLessEqual(metrics["shaded_response_cache_bytes"], 800 << 10)


class ReloadTest(Test):
    def reload(self, daemon, count):
        daemon.signal(signal.SIGHUP)
        daemon.wait_for("reloaded", lambda _: len(daemon.events("reloaded")) == count)

    def test_a_limit_holds_for_what_is_kept(self):
        path = self.file("max-pixels = 1000\n")
        with Daemon("--config", path) as daemon:
            tag = daemon.render(SMALL).headers["ETag"]
            self.assertEqual(status(daemon.render(SMALL)), HIT)
            self.file("max-pixels = 100\ncache-control = no-cache\n")
            self.reload(daemon, 1)
            answer = daemon.render(SMALL)
            self.assertEqual((answer.status, status(answer)), (422, None))
            self.assertEqual(daemon.render(SMALL, {"If-None-Match": tag}).status, 422)
            self.file("max-pixels = 1000\ncache-control = no-cache\n")
            self.reload(daemon, 2)
            # The picture is still there, and found by its bytes again once it was read.
            for parsed in (True, False):
                answer = daemon.render(SMALL)
                self.assertEqual((answer.status, status(answer)), (200, HIT))
                self.assertEqual(answer.headers["Cache-Control"], "no-cache")
                self.assertEqual("parse;dur=0.000" not in answer.headers["Server-Timing"], parsed)

    def test_other_colors_are_other_pictures(self):
        good = (SOURCE / "config/shaded.ocio").read_text()
        path = self.file(good, "colors.ocio")
        with Daemon("--ocio", path) as daemon:
            first = daemon.render(SMALL)
            self.assertEqual(status(daemon.render(SMALL)), HIT)
            self.file(good + "\n# another word\n", "colors.ocio")
            self.reload(daemon, 1)
            other = daemon.render(SMALL, {"If-None-Match": first.headers["ETag"]})
            self.assertEqual((other.status, status(other)), (200, STORED))
            self.assertNotEqual(other.headers["ETag"], first.headers["ETag"])
            # As it was before, the pictures of before are found.
            self.file(good, "colors.ocio")
            self.reload(daemon, 2)
            again = daemon.render(SMALL)
            self.assertEqual(status(again), HIT)
            self.assert_same(again, first)

    def test_other_materials_are_other_pictures(self):
        def write(diffuse):
            return self.file(json.dumps({"materials": {"house": {
                "group": "house", "source": "ours", "material": {"diffuse": diffuse}}}}), "house.json")
        scene = json.dumps({"objects": [{"type": "sphere", "material": "house"}], "image": {"width": 16, "height": 16}})
        with Daemon("--materials", write(0.25)) as daemon:
            first = daemon.render(scene)
            self.assertEqual(status(daemon.render(scene)), HIT)
            write(0.75)
            self.reload(daemon, 1)
            other = daemon.render(scene, {"If-None-Match": first.headers["ETag"]})
            self.assertEqual(other.status, 200)
            self.assertNotEqual((other.headers["ETag"], other.body), (first.headers["ETag"], first.body))


if __name__ == "__main__":
    unittest.main()
