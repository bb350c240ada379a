"""Work that waits: what is rendered once for several, for nobody any more, between large pictures."""

import json
import math
import re
import select
import unittest

from e2e.daemon import SANITIZED, SLOW, SMALL, Daemon, another
from e2e.daemon_test import (ENDLESS, Background, Client, occupied, wait_until, wait_until_busy,
                             wait_until_read)

SIDE = 220 if SANITIZED else 350
BUSY = {**SLOW, "image": {"width": SIDE, "height": SIDE, "samples": 9}}


def encoded(daemon):
    """How many pictures were made."""
    return daemon.metrics()['shaded_stage_duration_seconds_count{stage="encode"}']


def new_daemon(*flags):
    """One that renders everything anew."""
    return Daemon("--reuse", "0", "--response-cache", "0", *flags)


def wait_until_joined(daemon, count):
    wait_until(lambda: daemon.metrics()["shaded_joined_total"] == count)


class TogetherTest(unittest.TestCase):
    def assert_same(self, requests):
        answers = [request.result() for request in requests]
        self.assertEqual({answer.status for answer in answers}, {200})
        self.assertEqual(len({answer.body for answer in answers}), 1)
        self.assertEqual(len({answer.headers["ETag"] for answer in answers}), 1)
        ids = {answer.headers["X-Request-Id"] for answer in answers}
        self.assertEqual(len(ids), len(answers))
        for answer in answers:
            self.assertRegex(answer.headers["Server-Timing"], "^queue;dur=[0-9.]+, parse;dur=")

    def test_equal_requests_in_flight_are_rendered_once(self):
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            first = occupied(daemon)
            equal = [Background(daemon, BUSY) for _ in range(12)]
            wait_until_joined(daemon, 11)
            first.leave()
            self.assert_same(equal)
            self.assertEqual(encoded(daemon), 1)
            # Nothing is kept: this is no cache.
            self.assertEqual(daemon.render(SMALL).body, daemon.render(SMALL).body)
            self.assertEqual(encoded(daemon), 3)

    def test_what_is_written_differently_may_be_equal(self):
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            first = occupied(daemon)
            texts = [json.dumps(BUSY, indent=i) for i in (None, 1, 2, 3)]
            texts.append(json.dumps(dict(reversed(BUSY.items()))))
            equal = [Background(daemon, text) for text in texts]
            wait_until_joined(daemon, 4)
            first.leave()
            self.assert_same(equal)
            self.assertEqual(encoded(daemon), 1)

    def test_other_formats_are_other_pictures(self):
        with new_daemon("--timeout", "300") as daemon:
            both = [Background(daemon, {**BUSY, "output": {"format": name}})
                    for name in ("png", "jpeg")]
            self.assertEqual(len({request.result().body for request in both}), 2)
            self.assertEqual(encoded(daemon), 2)

    def test_equal_requests_take_one_place_in_the_queue(self):
        with new_daemon("--threads", "1", "--queue", "1", "--timeout", "300") as daemon:
            first = occupied(daemon)
            equal = [Background(daemon, BUSY) for _ in range(8)]
            wait_until_joined(daemon, 7)
            wait_until_read(daemon, 1)
            self.assertEqual(daemon.render(another(BUSY, 2)).status, 429)
            first.leave()
            self.assert_same(equal)

    def test_equal_mistakes_are_each_answered(self):
        with new_daemon("--threads", "1") as daemon:
            wrong = [Background(daemon, {**BUSY, "lights": 7}) for _ in range(8)]
            self.assertEqual({request.result().status for request in wrong}, {422})

    def test_each_has_its_own_condition(self):
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            tag = daemon.render(BUSY).headers["ETag"]
            first = occupied(daemon)
            waiting = Background(daemon, BUSY)
            wait_until_busy(daemon, queued=1)
            again = daemon.render(json.dumps(BUSY, indent=1), {"If-None-Match": tag})
            self.assertEqual((again.status, again.body), (304, b""))
            self.assertIsNone(waiting.answer)
            first.leave()
            again = daemon.render(BUSY, {"If-None-Match": tag})
            self.assertEqual((again.status, again.body), (304, b""))
            self.assertEqual(waiting.result().status, 200)

    def test_who_comes_once_it_was_read_is_told_at_once_that_it_is_known(self):
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            tags = {"If-None-Match": daemon.render(BUSY).headers["ETag"]}
            first = occupied(daemon)
            waiting = Client(daemon, BUSY)
            wait_until_read(daemon, 1)
            again = daemon.render(BUSY, tags)
            self.assertEqual((again.status, again.headers["ETag"]), (304, tags["If-None-Match"]))
            # Another tag than that, and it waits like everybody.
            joined = daemon.metrics()["shaded_joined_total"]
            others = [Client(daemon, BUSY, headers={"If-None-Match": tag})
                      for tag in ('"other"', "*")]
            wait_until_joined(daemon, joined + 2)
            for client in (waiting, *others):
                client.leave()
            first.leave()

    def test_comparisons_are_measured_each(self):
        with new_daemon() as daemon:
            both = [Background(daemon, SMALL, "/v1/compare") for _ in range(4)]
            self.assertEqual({request.result().status for request in both}, {200})
            self.assertEqual(daemon.metrics()["shaded_joined_total"], 0)


class LeaveTest(unittest.TestCase):
    def assert_idle(self, daemon):
        wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)
        wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)
        self.assertEqual(daemon.metrics()["shaded_queue_depth"], 0)

    def test_a_picture_whose_client_has_gone_is_not_finished(self):
        with new_daemon("--timeout", "300", "--drain-time", "300") as daemon:
            for leave in (Client.leave, Client.reset):
                client = Client(daemon, ENDLESS)
                wait_until_busy(daemon)
                leave(client)
                self.assert_idle(daemon)
            self.assertEqual(daemon.metrics()["shaded_left_total"], 2)
            self.assertEqual(daemon.metrics()["shaded_aborted_total"], 2)
            event = daemon.wait_for("request")
            self.assertEqual((event["status"], event["aborted"]), (0, True))
            client = Client(daemon, ENDLESS, "/v1/compare")
            wait_until_busy(daemon)
            client.leave()
            self.assert_idle(daemon)
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_a_picture_whose_client_has_gone_costs_no_more_than_the_tiles_in_hand(self):
        """One for each thread at most, of 16384: none is begun once it is known that nobody waits."""
        made, unwanted = ('shaded_tiles_total{result="%s"}' % one for one in ("made", "unwanted"))
        with new_daemon("--threads", "2", "--timeout", "300") as daemon:
            for times in range(1, 4):
                before = daemon.metrics()
                client = Client(daemon, another(ENDLESS, times))
                wait_until(lambda: daemon.metrics()[made] > before[made])
                client.leave()
                self.assert_idle(daemon)
                after = daemon.metrics()
                self.assertEqual(after["shaded_left_total"], times)
                self.assertLessEqual(after[unwanted], 2 * times)
                self.assertLess(after[made] - before[made], 8192)
            self.assertEqual(daemon.render(SMALL).status, 200)
            last = daemon.metrics()
            self.assertEqual(last[unwanted], after[unwanted])
            tiles = [-(-SMALL["image"][side] // 32) for side in ("width", "height")]
            self.assertEqual(last[made] - after[made], tiles[0] * tiles[1])

    def test_waiting_requests_whose_client_has_gone_leave_the_queue(self):
        with new_daemon("--threads", "1", "--queue", "2", "--timeout", "300") as daemon:
            running = occupied(daemon)
            waiting = [Client(daemon, another(ENDLESS, i)) for i in (1, 2)]
            wait_until_read(daemon, 2)
            for client in waiting:
                client.leave()
            wait_until(lambda: daemon.metrics()["shaded_queue_depth"] == 0)
            self.assertEqual(daemon.metrics()["shaded_workers_busy"], 1)
            running.leave()
            self.assert_idle(daemon)

    def test_who_leaves_takes_nothing_from_those_who_wait_for_the_same(self):
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            running = occupied(daemon)
            first = Client(daemon, BUSY)
            wait_until_read(daemon, 1)
            second = Background(daemon, BUSY)
            third = Background(daemon, json.dumps(BUSY, indent=1))
            wait_until_joined(daemon, 2)
            first.leave()
            wait_until(lambda: daemon.metrics()["shaded_left_total"] == 1)
            running.leave()
            self.assertEqual((second.result().status, third.result().status), (200, 200))
            self.assertEqual(encoded(daemon), 1)

    def test_a_cancelled_picture_is_not_joined(self):
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            for _ in range(5):
                made = encoded(daemon)
                client = Client(daemon, BUSY)
                wait_until(lambda made=made: daemon.metrics()["shaded_workers_busy"] or
                           encoded(daemon) > made)
                client.leave()
            self.assertEqual(daemon.render(BUSY).status, 200)

    def test_deadlines_are_answered_when_they_come(self):
        with new_daemon("--threads", "1", "--timeout", "1") as daemon:
            requests = [Background(daemon, another(ENDLESS, i)) for i in range(4)]
            for request in requests:
                self.assertEqual(request.result().status, 504)
            self.assert_idle(daemon)


class TurnsTest(unittest.TestCase):
    def test_small_pictures_pass_between_the_tiles_of_large_ones(self):
        with new_daemon("--threads", "1", "--timeout", "300", "--drain-time", "0") as daemon:
            large = [Client(daemon, another(ENDLESS, i)) for i in range(5)]
            wait_until_read(daemon, 4)
            for i in range(20):
                self.assertEqual(daemon.render(another(SMALL, i)).status, 200)
            self.assertGreaterEqual(daemon.metrics()["shaded_lent_total"], 20)
            self.assertEqual(daemon.metrics()["shaded_queue_depth"], 4)
            for client in large:
                client.leave()

    def test_large_pictures_leave_a_worker_to_what_is_new(self):
        """Which would wait, if all of them read a document or planned."""
        with new_daemon("--threads", "2", "--timeout", "300", "--drain-time", "0") as daemon:
            large = [Client(daemon, another(ENDLESS, i)) for i in range(5)]
            wait_until_read(daemon, 4)
            for i in range(20):
                self.assertEqual(daemon.render(another(SMALL, i)).status, 200)
                self.assertEqual(daemon.metrics()["shaded_queue_depth"], 4)
            for left in (3, 2, 1, 0):
                large.pop(0).leave()
                wait_until(lambda left=left: daemon.metrics()["shaded_queue_depth"] == left)
            wait_until_busy(daemon)
            large.pop().leave()
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)

    def test_large_pictures_come_to_their_turn(self):
        with new_daemon("--threads", "1", "--queue", "1000", "--timeout", "300") as daemon:
            large = Background(daemon, BUSY)
            count = 0
            while large.answer is None:
                self.assertEqual(daemon.render(another(SMALL, count % 60)).status, 200)
                count += 1
            self.assertEqual(large.result().status, 200)

    def test_large_documents_are_read_when_their_turn_comes(self):
        large = {**SMALL, "materials": {str(i): {} for i in range(10000)}, "odd": 0}
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            first = occupied(daemon)
            client = Client(daemon, large)
            wait_until_busy(daemon, queued=1)
            # What is small passes it, and nobody knows yet that it has a mistake.
            self.assertEqual(daemon.render(SMALL).status, 200)
            self.assertFalse(select.select([client.connection.sock], [], [], 0)[0])
            first.leave()
            self.assertEqual(client.connection.getresponse().status, 422)
            client.leave()

    def test_retry_after_follows_from_what_jobs_take(self):
        with new_daemon("--threads", "1", "--queue", "3", "--timeout", "300") as daemon:
            timing = daemon.render(BUSY).headers["Server-Timing"]
            took = sum(map(float, re.findall(r"(?:visibility|shade|color|encode);dur=([0-9.]+)",
                                             timing))) / 1e3
            waiting = [occupied(daemon)]
            waiting += [Client(daemon, another(BUSY, i)) for i in range(2, 5)]
            wait_until_read(daemon, 3)
            refused = daemon.render(SMALL)
            self.assertEqual(refused.status, 429)
            seconds = int(refused.headers["Retry-After"])
            self.assertGreaterEqual(seconds, min(300, math.floor(4 * took)))
            self.assertTrue(1 <= seconds <= 300)
            for client in waiting:
                client.leave()


if __name__ == "__main__":
    unittest.main()
