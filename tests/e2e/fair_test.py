"""Who a request is from, and what each client has of the service: nobody takes another's part."""

import http.client
import json
import select
import socket
import time
import unittest

from e2e.daemon import JSON, PATIENCE, SMALL, Answer, Daemon, another
from e2e.daemon_test import ENDLESS, wait_until, wait_until_busy, wait_until_read
from e2e.queue_test import BUSY, encoded, new_daemon, wait_until_joined


def render_from(daemon, address, scene, headers=None):
    """The answer to who connects from another address of this machine, such as 127.0.0.2."""
    connection = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE,
                                            source_address=(address, 0))
    try:
        connection.request("POST", "/v1/render", json.dumps(scene), {**JSON, **(headers or {})})
        answer = connection.getresponse()
        return Answer(answer.status, answer.headers, answer.read())
    finally:
        connection.close()


class Waiting:
    """A request from an address, whose answer is fetched later."""

    def __init__(self, daemon, address, scene, headers=None):
        self.connection = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE,
                                                     source_address=(address, 0))
        self.connection.request("POST", "/v1/render", json.dumps(scene), {**JSON, **(headers or {})})

    def result(self):
        answer = self.connection.getresponse()
        try:
            return Answer(answer.status, answer.headers, answer.read())
        finally:
            self.connection.close()

    def leave(self):
        self.connection.close()


def queued(daemon):
    return daemon.metrics()["shaded_queue_depth"]


def refused(daemon):
    return daemon.metrics()['shaded_requests_total{route="/v1/render",status="429"}']


class ClientTest(unittest.TestCase):
    def client_of(self, daemon, address, headers):
        answer = render_from(daemon, address, SMALL, headers)
        name = answer.headers["X-Request-Id"]
        return daemon.wait_for("request", lambda event: event["id"] == name)["client"]

    def test_only_named_proxies_are_believed(self):
        forwarded = {"X-Forwarded-For": "192.0.2.99, 198.51.100.7"}
        with Daemon("--trusted-proxies", "127.0.0.9, 192.168.0.0/16") as daemon:
            self.assertEqual(self.client_of(daemon, "127.0.0.9", forwarded), "198.51.100.7")
            self.assertEqual(self.client_of(daemon, "127.0.0.9", {}), "127.0.0.9")
            self.assertEqual(self.client_of(daemon, "127.0.0.8", forwarded), "127.0.0.8")

    def test_what_is_no_network_is_told_at_the_start(self):
        with self.assertRaisesRegex(AssertionError, "trusted-proxies.*'proxy.example'"):
            Daemon("--trusted-proxies", "127.0.0.1 proxy.example")


class PlacesTest(unittest.TestCase):
    def test_a_crowd_of_large_pictures_locks_nobody_out(self):
        """66 of them at the default `queue`: who is small passes, of this client and of others."""
        with new_daemon("--threads", "2", "--timeout", "300", "--drain-time", "0") as daemon:
            crowd = [Waiting(daemon, "127.0.0.2", another(ENDLESS, i)) for i in range(66)]
            wait_until(lambda: queued(daemon) == 48 and refused(daemon) == 66 - 48 - 1)
            for i in range(5):
                for address in ("127.0.0.2", "127.0.0.3"):
                    self.assertEqual(render_from(daemon, address, another(SMALL, i)).status, 200)
            # And another client's large picture has a place, which one of theirs gives up.
            self.assertEqual(render_from(daemon, "127.0.0.3", another(BUSY, 1)).status, 200)
            wait_until(lambda: refused(daemon) == 66 - 48)
            self.assertEqual(queued(daemon), 47)
            for client in crowd:
                client.leave()

    def test_who_gives_way_is_told_so(self):
        with new_daemon("--threads", "1", "--queue", "2", "--timeout", "300",
                        "--drain-time", "0") as daemon:
            crowd = [Waiting(daemon, "127.0.0.2", another(ENDLESS, 0))]
            wait_until_busy(daemon)
            for i in (1, 2):
                crowd.append(Waiting(daemon, "127.0.0.2", another(ENDLESS, i)))
                wait_until_read(daemon, i)
            late = Waiting(daemon, "127.0.0.3", another(ENDLESS, 9))
            answer = crowd[2].result()
            self.assertEqual(answer.status, 429)
            problem = json.loads(answer.body)
            self.assertEqual(problem["type"], "urn:shaded:problem:busy")
            self.assertIn("gave way to another client's: the limit `queue` is 2", problem["detail"])
            self.assertTrue(1 <= int(answer.headers["Retry-After"]) <= 300)
            # One and one: neither takes the other's.
            wait_until_read(daemon, 2)
            for address in ("127.0.0.2", "127.0.0.3"):
                self.assertEqual(render_from(daemon, address, another(ENDLESS, 8)).status, 429)
            for client in (late, *crowd):
                client.leave()

    def test_who_is_refused_is_told_to_wait_for_what_is_ahead(self):
        # Large by its document: it waits with the large ones from the start.
        scene = {**another(ENDLESS, 70), "materials": {str(i): {} for i in range(10000)}}
        with new_daemon("--threads", "1", "--timeout", "300", "--drain-time", "0") as daemon:
            self.assertEqual(daemon.render(BUSY).status, 200)
            crowd = [Waiting(daemon, "127.0.0.2", another(ENDLESS, 0))]
            wait_until_busy(daemon)
            crowd += [Waiting(daemon, "127.0.0.2", another(ENDLESS, i)) for i in range(1, 49)]
            wait_until_read(daemon, 48)
            answer = render_from(daemon, "127.0.0.2", scene)
            self.assertEqual((answer.status, answer.headers["Retry-After"]), (429, "300"))
            for client in crowd:
                client.leave()

    def test_clients_of_a_proxy_are_told_apart(self):
        with new_daemon("--threads", "1", "--queue", "2", "--timeout", "300", "--drain-time", "0",
                        "--trusted-proxies", "127.0.0.1") as daemon:
            def ask(client, number):
                return Waiting(daemon, "127.0.0.1", another(ENDLESS, number),
                               {"X-Forwarded-For": client})

            crowd = [ask("192.0.2.1", 0)]
            wait_until_busy(daemon)
            for i in (1, 2):
                crowd.append(ask("192.0.2.1", i))
                wait_until_read(daemon, i)
            late = ask("192.0.2.2", 9)
            self.assertEqual(crowd[2].result().status, 429)
            for client in (late, *crowd):
                client.leave()

    def test_what_one_forwards_without_being_named_takes_no_place(self):
        with new_daemon("--threads", "1", "--queue", "2", "--timeout", "300", "--drain-time",
                        "0") as daemon:
            crowd = [Waiting(daemon, "127.0.0.1", another(ENDLESS, 0))]
            wait_until_busy(daemon)
            for i in (1, 2):
                crowd.append(Waiting(daemon, "127.0.0.1", another(ENDLESS, i)))
                wait_until_read(daemon, i)
            for i in range(5):
                answer = render_from(daemon, "127.0.0.1", another(ENDLESS, 10 + i),
                                     {"X-Forwarded-For": f"192.0.2.{i}"})
                self.assertEqual(answer.status, 429)
            for client in crowd:
                client.leave()


class DivisionTest(unittest.TestCase):
    """Of large pictures, too, each client has its part: they are left between two tiles."""

    def test_a_crowd_of_endless_pictures_keeps_nobody_elses_waiting(self):
        for threads, begun in ("1", 1), ("2", 1), ("4", 3):
            with new_daemon("--threads", threads, "--timeout", "300", "--drain-time",
                            "0") as daemon:
                pictures = [another(BUSY, i) for i in range(3)]
                alone = [daemon.render(picture).body for picture in pictures]
                crowd = [Waiting(daemon, "127.0.0.2", another(ENDLESS, i))
                         for i in range(begun + 4)]
                wait_until_read(daemon, 4, begun)
                for picture, body in zip(pictures, alone):
                    answer = render_from(daemon, "127.0.0.3", picture)
                    self.assertEqual((answer.status, answer.body), (200, body))
                    # The first ones go on, and the others still wait for them.
                    wait_until_read(daemon, 4, begun)
                self.assertEqual(encoded(daemon), 6)
                self.assertEqual(daemon.metrics()["shaded_left_total"], 0)
                for client in crowd:
                    client.leave()

    def test_long_documents_go_first_where_their_pictures_would(self):
        """Though it is known only once they are read what they ask for."""
        def long(scene):
            return {**scene, "materials": {str(i): {} for i in range(10000)}}

        with new_daemon("--threads", "1", "--timeout", "300", "--drain-time", "0") as daemon:
            alone = daemon.render(long(BUSY)).body
            crowd = [Waiting(daemon, "127.0.0.2", ENDLESS)]
            wait_until_read(daemon, 0)
            # As much as the first, and not before it: once it was read it waits.
            crowd.append(Waiting(daemon, "127.0.0.3", long(another(ENDLESS))))
            wait_until_read(daemon, 1)
            answer = render_from(daemon, "127.0.0.4", long(BUSY))
            self.assertEqual((answer.status, answer.body), (200, alone))
            wait_until_read(daemon, 1)
            for client in crowd:
                client.leave()

    def test_who_gives_way_has_as_much_in_the_end(self):
        """A picture of the work of four ends before a sixth that is asked for one by one."""
        side = BUSY["image"]["width"]
        large = {**BUSY, "image": {**BUSY["image"], "height": 4 * side}}
        with new_daemon("--threads", "1", "--timeout", "300") as daemon:
            alone = daemon.render(large).body
            wait_until(lambda: daemon.metrics()["shaded_large_begun"] == 0)
            first = Waiting(daemon, "127.0.0.2", large)
            wait_until(lambda: daemon.metrics()["shaded_large_begun"] or encoded(daemon) > 1)
            made = 0
            while not select.select([first.connection.sock], [], [], 0)[0]:
                answer = render_from(daemon, "127.0.0.3", another(BUSY, made))
                self.assertEqual(answer.status, 200)
                made += 1
            answer = first.result()
            self.assertEqual((answer.status, answer.body), (200, alone))
            self.assertLessEqual(made, 6)

    def test_a_few_are_set_aside_for_others(self):
        """Each on top of a larger one, and the next one waits; who leaves is let go in its turn."""
        base = {**ENDLESS, "lights": 4 * ENDLESS["lights"]}
        with new_daemon("--threads", "1", "--timeout", "300", "--drain-time", "0") as daemon:
            clients = []
            for i in range(5):
                image = {"width": 1024, "height": 1024, "samples": 64 >> i}
                clients.append(Waiting(daemon, f"127.0.0.{2 + i}", {**base, "image": image}))
                wait_until_read(daemon, int(i == 4), begun=min(i + 1, 4))
            first, second, third, fourth, fifth = clients
            first.leave()
            second.leave()
            wait_until(lambda: daemon.metrics()["shaded_left_total"] == 2)
            time.sleep(1.5)
            # Beneath others they cannot notice, and hold no worker.
            self.assertEqual(daemon.get("/readyz", admin=True).status, 200)
            self.assertEqual(daemon.metrics()["shaded_large_begun"], 4)
            self.assertEqual(render_from(daemon, "127.0.0.9", SMALL).status, 200)
            fourth.leave()
            wait_until_read(daemon, 0, begun=4)  # the fifth goes on top of the third
            third.leave()
            fifth.leave()
            wait_until(lambda: daemon.metrics()["shaded_large_begun"] == 0)
            self.assertEqual(render_from(daemon, "127.0.0.9", BUSY).status, 200)

    def test_who_joins_what_waits_behind_a_crowd_need_not_wait_for_it(self):
        with new_daemon("--threads", "1", "--timeout", "300", "--drain-time", "0") as daemon:
            crowd = [Waiting(daemon, "127.0.0.2", ENDLESS)]
            for i in range(1, 9):
                crowd.append(Waiting(daemon, "127.0.0.2", another(BUSY, i)))
                wait_until_read(daemon, i)
            joined = Waiting(daemon, "127.0.0.3", another(BUSY, 8))
            self.assertEqual(joined.result().status, 200)
            self.assertEqual(crowd.pop().result().status, 200)
            wait_until_read(daemon, 7)
            self.assertEqual(encoded(daemon), 1)
            for client in crowd:
                client.leave()


class CrowdTest(unittest.TestCase):
    def test_equal_requests_do_not_take_all_connections(self):
        """Three quarters may wait, and of those the client that has most gives up the newest."""
        with new_daemon("--threads", "1", "--max-connections", "40", "--max-connections-each", "0",
                        "--timeout", "300", "--drain-time", "0") as daemon:
            crowd = [Waiting(daemon, "127.0.0.2", ENDLESS) for _ in range(29)]
            wait_until_joined(daemon, 28)
            crowd.append(Waiting(daemon, "127.0.0.2", ENDLESS))
            wait_until_joined(daemon, 29)
            answer = Waiting(daemon, "127.0.0.2", ENDLESS).result()
            self.assertEqual(answer.status, 429)
            self.assertIn("too many", json.loads(answer.body)["detail"])
            self.assertIn("Retry-After", answer.headers)
            self.assertEqual(render_from(daemon, "127.0.0.3", SMALL).status, 200)
            wait_until(lambda: refused(daemon) == 2)
            # What was given up for it is the newest one's alone: the others wait on.
            self.assertEqual(crowd[29].result().status, 429)
            self.assertEqual(daemon.metrics()["shaded_workers_busy"], 1)
            for client in crowd:
                client.leave()

    def test_one_address_has_some_connections_and_a_few_more_are_told(self):
        with Daemon("--max-connections-each", "4") as daemon:
            crowd = [socket.create_connection(daemon.address, PATIENCE, ("127.0.0.2", 0))
                     for _ in range(4)]
            wait_until(lambda: daemon.metrics()['shaded_connections{at="head"}'] == 4)
            answer = render_from(daemon, "127.0.0.2", SMALL)
            self.assertEqual((answer.status, answer.headers["Connection"]), (429, "close"))
            self.assertIn("`connections-each` is 4", json.loads(answer.body)["detail"])
            self.assertEqual(render_from(daemon, "127.0.0.3", SMALL).status, 200)
            self.assertEqual(daemon.metrics()['shaded_refused_total{limit="connections-each"}'], 1)
            # Far too many are closed at once.
            crowd += [socket.create_connection(daemon.address, PATIENCE, ("127.0.0.2", 0))
                      for _ in range(40)]
            wait_until(lambda: daemon.metrics()['shaded_connections{at="head"}'] == 4 + 16 or
                       daemon.metrics()['shaded_connections_ended_total{reason="time"}'] > 0)
            for connection in crowd:
                connection.close()

    def test_named_proxies_have_any_number(self):
        with Daemon("--max-connections-each", "4", "--trusted-proxies", "127.0.0.2") as daemon:
            crowd = [socket.create_connection(daemon.address, PATIENCE, ("127.0.0.2", 0))
                     for _ in range(40)]
            wait_until(lambda: daemon.metrics()['shaded_connections{at="head"}'] == 40)
            self.assertEqual(render_from(daemon, "127.0.0.2", SMALL).status, 200)
            for connection in crowd:
                connection.close()


class DeadlineTest(unittest.TestCase):
    def test_joining_keeps_nothing_alive(self):
        """Whoever comes in its first half shares its end; who comes later has work of their own."""
        with new_daemon("--threads", "1", "--timeout", "4", "--drain-time", "0") as daemon:
            first = Waiting(daemon, "127.0.0.2", ENDLESS)
            wait_until_busy(daemon)
            joined = Waiting(daemon, "127.0.0.3", ENDLESS)
            wait_until(lambda: daemon.metrics()["shaded_joined_total"] == 1 or
                       queued(daemon) == 1)  # on a machine that took 2 s for this
            at_first = daemon.metrics()["shaded_joined_total"]
            answers, later = [], []
            while not answers:
                later.append(Waiting(daemon, "127.0.0.4", ENDLESS))
                if first.connection.sock in select.select([first.connection.sock], [], [], 0.25)[0]:
                    answers = [first.result()]
            if at_first:
                answers.append(joined.result())
            for answer in answers:
                self.assertEqual(answer.status, 504)
                self.assertIn("the limit `timeout` is 4", json.loads(answer.body)["detail"])
            # It ends with them, though some wait for what is equal.
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 1)
            for client in later:
                self.assertEqual(client.result().status, 504)
            wait_until(lambda: daemon.metrics()["shaded_workers_busy"] == 0)


if __name__ == "__main__":
    unittest.main()
