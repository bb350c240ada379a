"""Clients that are slow, or mean it: everybody else is served, and the admin port answers."""

import itertools
import json
import resource
import select
import selectors
import socket
import threading
import time
import unittest

from e2e.daemon import PATIENCE, SANITIZED, SMALL, Daemon, another, receive_all
from e2e.daemon_test import wait_until
from e2e.http_test import post

BODY = json.dumps(SMALL).encode()
# 15 MB: several times what sockets hold, made in a few seconds even where that is sanitized.
MANY_BYTES = {"objects": [{"type": "plane"}], "image": {"width": 800, "height": 800, "samples": 1},
              "camera": {"position": [0, 1, 3]}, "lights": [{"position": [1, 2, 3, 1]}],
              "outputs": [{"name": str(i), "format": "tiff", "bitDepth": "float",
                           "colorSpace": "lin_rec709"} for i in range(16)]}


class Drippers:
    """Connections that send a byte now and then, on a thread of their own."""

    def __init__(self, address, count, message, pause=0.5):
        self.address, self.message, self.pause = address, message, pause
        self.sockets, self.ended, self.stopping = [], 0, False
        for _ in range(count):
            self.open()
        self.thread = threading.Thread(target=self.drip)
        self.thread.start()

    def open(self):
        connection = socket.create_connection(self.address, PATIENCE)
        connection.setblocking(False)
        self.sockets.append([connection, 0])

    def drip(self):
        while not self.stopping:
            for entry in list(self.sockets):
                connection, sent = entry
                try:
                    connection.send(self.message[sent:sent + 1])
                    entry[1] += 1
                except BlockingIOError:
                    continue
                except OSError:
                    self.ended += 1
                    connection.close()
                    self.sockets.remove(entry)
                    self.open()  # they are persistent
            time.sleep(self.pause)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stopping = True
        self.thread.join()
        for connection, _ in self.sockets:
            connection.close()


def drip(connection, message, pause=0.2):
    """Sends byte after byte until the other side ends the connection."""
    readable = selectors.DefaultSelector()
    readable.register(connection, selectors.EVENT_READ)
    for byte in itertools.cycle(message):
        try:
            connection.send(bytes([byte]))
            if readable.select(pause) and not connection.recv(1000):
                break
        except OSError:
            break


def ended(daemon, reason):
    return daemon.metrics()[f'shaded_connections_ended_total{{reason="{reason}"}}']


class TimeTest(unittest.TestCase):
    def test_a_head_has_a_total_time(self):
        for start in (b"", b"POST /v1/render HTTP/1.1\r\nHost: a\r\n"):
            with Daemon("--head-time", "1", "--idle-timeout", "300") as daemon:
                began = time.monotonic()
                with socket.create_connection(daemon.address, 500) as connection:
                    connection.sendall(start)
                    drip(connection, b"X-Drip: aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa")
                self.assertGreater(time.monotonic() - began, 0.9)
                self.assertEqual(ended(daemon, "time"), 1)

    def test_a_body_has_a_total_time(self):
        for chunked in (False, True):
            head = post(b"Transfer-Encoding: chunked", length=False, body=b"") if chunked \
                else post(b"Content-Length: 1000", length=False, body=b"")
            with Daemon("--body-time", "1", "--idle-timeout", "300") as daemon:
                began = time.monotonic()
                with socket.create_connection(daemon.address, 500) as connection:
                    connection.sendall(head)
                    drip(connection, b"1\r\n \r\n" if chunked else b" ")
                self.assertGreater(time.monotonic() - began, 0.9)
                event = daemon.wait_for("request")
                self.assertEqual((event["status"], event["aborted"]), (0, True))

    def test_an_answer_has_a_total_time(self):
        with Daemon("--send-time", "1", "--idle-timeout", "300", "--timeout", "600") as daemon:
            with socket.socket() as connection:
                connection.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                connection.settimeout(500)
                connection.connect(daemon.address)
                connection.sendall(post(body=json.dumps(MANY_BYTES).encode()))

                def read_a_little():
                    try:
                        connection.recv(1000)  # nothing, once the daemon has closed it
                    except ConnectionResetError:
                        pass
                    return ended(daemon, "time") == 1

                wait_until(read_a_little)
                event = daemon.wait_for("request")
                self.assertTrue(event["aborted"])
                self.assertGreater(event["ms"], 900)

    def test_connections_may_rest_for_longer_than_a_head_may_take(self):
        with Daemon("--head-time", "2", "--idle-timeout", "300") as daemon:
            with socket.create_connection(daemon.address, 500) as connection:
                for rest in (3, 0):
                    connection.sendall(post())
                    self.assertTrue(connection.recv(100000).startswith(b"HTTP/1.1 200 "))
                    time.sleep(rest)
                # But the next head has its time, too.
                began = time.monotonic()
                drip(connection, b"GET /aaaaaaaaaaaaaaaaaaaa")
                self.assertGreater(time.monotonic() - began, 0.9)

    def test_whoever_keeps_moving_is_left_alone(self):
        message = post(b"Connection: close")
        with Daemon("--head-time", "600", "--body-time", "600", "--idle-timeout", "600") as daemon:
            pieces = (message[i:i + 8] for i in range(0, len(message), 8))
            data = daemon.raw(*pieces)
            self.assertTrue(data.startswith(b"HTTP/1.1 200 "))


class CrowdTest(unittest.TestCase):
    def serve_in_crowd(self, daemon, crowd):
        """Requests and looks at the admin port while a crowd drips."""
        for i in range(30):
            self.assertEqual(daemon.render(another(SMALL, i)).status, 200)
            for path in ("/healthz", "/metrics"):
                self.assertEqual(daemon.get(path, admin=True).status, 200)
            time.sleep(0.05)
        self.assertGreater(len(crowd.sockets), 100)

    def test_a_thousand_dripping_connections_hold_nobody_up(self):
        count = 200 if SANITIZED else 1000
        needed = 2 * count + 200
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        if soft < needed:
            if hard != resource.RLIM_INFINITY and hard < needed:
                self.skipTest(f"the limit of open files is {hard}")
            resource.setrlimit(resource.RLIMIT_NOFILE, (needed, hard))
        for message in (b"POST /v1/render HTTP/1.1\r\nHost: a\r\nX-Drip: " + b"a" * 10000,
                        post(b"Content-Length: 10000", length=False, body=b" " * 9000)):
            with Daemon("--max-connections", str(count), "--max-connections-each", "0",
                        "--log-requests", "off") as daemon, \
                    Drippers(daemon.address, count, message) as crowd:
                self.serve_in_crowd(daemon, crowd)
                wait_until(lambda daemon=daemon: ended(daemon, "room") > 0)

    def test_clients_that_rest_go_first(self):
        with Daemon("--max-connections", "16", "--idle-timeout", "300") as daemon:
            resting = [socket.create_connection(daemon.address, 500) for _ in range(14)]
            for connection in resting:
                connection.sendall(b"GET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n")
                self.assertTrue(connection.recv(10000))
            slow = socket.create_connection(daemon.address, 500)
            slow.sendall(post()[:-5])
            time.sleep(1)
            for i in range(30):
                self.assertEqual(daemon.render(another(SMALL, i)).status, 200)
            slow.sendall(post()[-5:])
            self.assertTrue(slow.recv(10000).startswith(b"HTTP/1.1 200 "))
            for connection in [slow, *resting]:
                connection.close()

    def test_clients_that_take_nothing_give_way(self):
        with Daemon("--max-connections", "16", "--send-time", "300", "--idle-timeout", "300",
                    "--timeout", "600") as daemon:
            takers = []
            for _ in range(16):
                # Three of four connections may wait for their answers at a time.
                wait_until(lambda: daemon.metrics()['shaded_connections{at="work"}'] < 12)
                taker = socket.socket()
                taker.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                taker.connect(daemon.address)
                taker.sendall(post(body=json.dumps(MANY_BYTES).encode()))
                takers.append(taker)
            self.assertEqual(daemon.render(SMALL).status, 200)
            # Whoever has just come does not go before them, even if its head takes a moment.
            for _ in range(5):
                with socket.create_connection(daemon.address, 500) as connection:
                    time.sleep(0.1)
                    connection.sendall(post())
                    self.assertTrue(connection.recv(10000).startswith(b"HTTP/1.1 200 "))
            for taker in takers:
                taker.close()

    def test_one_address_may_have_a_share_only(self):
        with Daemon("--max-connections-each", "5") as daemon:
            crowd = [socket.create_connection(daemon.address, 500) for _ in range(5)]
            wait_until(lambda: daemon.metrics()['shaded_connections{at="head"}'] == 5)
            self.assertEqual(daemon.get("/").status, 429)
            crowd.pop().close()
            wait_until(lambda: daemon.get("/").status == 200)
            for connection in crowd:
                connection.close()


class BodiesTest(unittest.TestCase):
    def test_many_large_bodies_at_a_time_take_the_memory_of_a_few(self):
        size = 1 << 20
        with Daemon("--threads", "2", "--queue", "4", "--max-body", "1M", "--body-time", "600",
                    "--idle-timeout", "600") as daemon:
            crowd = []
            for _ in range(40):
                connection = socket.create_connection(daemon.address, 500)
                connection.sendall(post(b"Content-Length: %d" % size, length=False,
                                        body=b" " * (size - 1)))
                crowd.append(connection)
            # Six are waited for; the others are told, and small ones are served.
            wait_until(lambda: daemon.metrics()['shaded_refused_total{limit="queue"}'] == 34)
            self.assertEqual(daemon.render(SMALL).status, 200)
            wait_until(lambda: len(select.select(crowd, [], [], 0)[0]) == 34)
            answered = select.select(crowd, [], [], 0)[0]
            for connection in crowd:
                if connection not in answered:
                    connection.sendall(b" ")
                answer = connection.recv(65536)
                status = b"429" if connection in answered else b"400"
                self.assertTrue(answer.startswith(b"HTTP/1.1 " + status), answer)
                self.assertEqual(b"\r\nRetry-After: " in answer, status == b"429")
                connection.close()
            # And their memory is given back.
            for _ in range(12):
                self.assertEqual(daemon.render(b" " * size).status, 400)


class HostileTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--max-body", "100000", "--log-requests", "off")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def tearDown(self):
        self.assertEqual(self.daemon.render(SMALL).status, 200)

    def statuses(self, message, half_close=False):
        """Those of the answers until the daemon closes. Where it is not to, since it waits for more
        or serves on, it is told that nothing comes: it may then leave off at once."""
        try:
            with socket.create_connection(self.daemon.address, 500) as connection:
                connection.sendall(message)
                if half_close:
                    connection.shutdown(socket.SHUT_WR)
                data = receive_all(connection)
        except ConnectionError:
            return []
        return [int(part[:3]) for part in data.split(b"HTTP/1.1 ")[1:]]

    def test_a_thousand_pipelined_requests(self):
        get = b"GET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n"
        last = b"GET /v1/version HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"
        data = self.daemon.raw(get * 999 + last)
        self.assertEqual(data.count(b"HTTP/1.1 200 "), 1000)

    def test_floods_of_fields_and_targets_are_refused(self):
        """And read to their end, so that the client can send it and sees the answer."""
        start = b"GET / HTTP/1.1\r\nHost: a\r\n"
        for size in (100000, 10000000):
            for message, status in (
                    (start + b"a: b\r\n" * (size // 6) + b"\r\n", 431),
                    (start + b"X: " + b"a" * size + b"\r\n\r\n", 431),
                    (b"GET /" + b"a" * size + b" HTTP/1.1\r\nHost: a\r\n\r\n", 414),
                    (b"GET /?" + b"a=b&" * (size // 4) + b" HTTP/1.1\r\nHost: a\r\n\r\n", 414)):
                with self.subTest(message[:20], size=size):
                    self.assertEqual(self.statuses(message), [status])

    def test_long_targets_are_refused_before_libmicrohttpd_runs_short(self):
        """It has no memory for a thousand parameters, and then neither answers nor closes."""
        last = b" HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"
        for query in (b"a=b&" * 250, b"&" * 1000, b"a=b&" * 9000, b"a" * 8000):
            with self.subTest(query[:4], size=len(query)):
                head, _, body = self.daemon.raw(b"GET /v1/version?" + query + last).partition(
                    b"\r\n\r\n")
                self.assertTrue(head.startswith(b"HTTP/1.1 414 "), head)
                self.assertEqual(json.loads(body)["type"], "urn:shaded:problem:target-too-long")
        self.assertTrue(self.daemon.raw(b"GET /v1/version?" + b"a=b&" * 249 + last)
                        .startswith(b"HTTP/1.1 200 "))
        wait_until(lambda: not self.daemon.metrics()["shaded_requests_in_flight"])

    def test_what_libmicrohttpd_cannot_read_it_refuses_as_the_contract_says(self):
        get = b"GET / HTTP/1.1\r\nHost: a\r\n"
        chunks = post(b"Transfer-Encoding: chunked", length=False, body=b"")
        more = b"a" * 5000000
        told, before = {}, self.daemon.metrics()
        for message, status in (
                (b"GET /\r\n\r\n", b"400"), (get + b"colonless\r\n\r\n", b"400"),
                (post(b"Content-Length: x", length=False, body=b""), b"400"),
                (post(b"Content-Length: " + b"9" * 30, length=False, body=b""), b"413"),
                (chunks + b"zz\r\n", b"400"), (chunks + b"f" * 20 + b"\r\n", b"413"),
                (chunks + b"2\r\n{}!!", b"400"),
                (chunks + b"2;" + b"a" * 100000, b"500"), (b"GET / HTTP/2.0\r\n\r\n", b"505"),
                (b"GET / HTTP/0.9\r\n\r\n", b"505"), (b"hello\r\n\r\n", b""),
                (b"\x16\x03\x01\x02\0\x01\0\r\n", b"")):
            for rest in (b"", more):
                with self.subTest(message[-40:], rest=len(rest)):
                    data = self.daemon.raw(message, rest)
                    self.assertEqual(data[9:12], status)
                    if status:
                        self.assertIn(b"\r\nConnection: close\r\n", data)
                        self.assertTrue(data.endswith(b"</html>"))
                        told[status.decode()] = told.get(status.decode(), 0) + 1
        # Each of them is counted.
        wait_until(lambda: told == {
            status: number - before[name] for status in told
            for name, number in self.daemon.metrics().items()
            if name == f'shaded_unreadable_total{{status="{status}"}}'})

    def test_what_libmicrohttpd_refuses_is_logged(self):
        with Daemon() as daemon:
            for message, status, event in (
                    (b"GET / HTTP/2.0\r\n\r\n", 505, None),
                    (b"GET / HTTP/1.1\r\nHost: a\r\nnonsense\r\n\r\n", 400, "/"),
                    (post(b"Content-Length: x", length=False, body=b""), 400, "/v1/render"),
                    (post(b"Transfer-Encoding: chunked", length=False, body=b"zz\r\n"), 400,
                     "/v1/render")):
                seen = len(daemon.events("unreadable")), len(daemon.events("request"))
                self.assertTrue(daemon.raw(message).startswith(b"HTTP/1.1 %d " % status))
                wait_until(lambda: len(daemon.events("unreadable")) > seen[0])
                self.assertEqual(daemon.events("unreadable")[-1]["status"], status)
                if event:
                    wait_until(lambda: len(daemon.events("request")) > seen[1])
                    line = daemon.events("request")[-1]
                    self.assertEqual((line["status"], line["path"], line["client"]),
                                     (status, event, "127.0.0.1"))
                    self.assertNotIn("aborted", line)

    def test_odd_targets_name_nothing(self):
        for target, status in ((b"http://", 200), (b"http:///", 200), (b"://", 404), (b"a", 404),
                               (b"//v1/version", 404), (b"/v1/../v1/version", 404),
                               (b"/v1/version#a", 404), (b"/%2e%2e/etc/passwd", 404),
                               (b"example.com:443", 404), (b"/\xff\xfe", 404)):
            with self.subTest(target):
                data = self.daemon.raw(b"GET " + target + b" HTTP/1.1\r\nHost: a\r\n"
                                       b"Connection: close\r\n\r\n")
                self.assertTrue(data.startswith(b"HTTP/1.1 %d " % status), data[:200])

    def test_chunks_beyond_the_limit_are_refused_in_mid_body(self):
        head = post(b"Transfer-Encoding: chunked", length=False, body=b"")
        for size in (1, 1000, 60000):
            chunk = b"%x\r\n" % size + b" " * size + b"\r\n"
            self.assertEqual(self.statuses(head + chunk * (100001 // size + 1)), [413], size)
        self.assertEqual(self.statuses(head + b"7fffffff\r\n", half_close=True), [])
        self.assertEqual(self.statuses(head + b"-1\r\n"), [400])

    def test_lengths_that_disagree_are_refused(self):
        for fields in ([b"Content-Length: 5", b"Content-Length: 6"],
                       [b"Content-Length: 5, 5"], [b"Content-Length: +5"],
                       [b"Content-Length: 0x5"], [b"Content-Length: 5 5"],
                       [b"Content-Length: 5", b"Transfer-Encoding: chunked"],
                       [b"Transfer-Encoding: chunked, chunked"],
                       [b"Transfer-Encoding: identity"]):
            with self.subTest(fields):
                # libmicrohttpd writes the head of its own refusals twice.
                self.assertEqual(set(self.statuses(post(*fields, length=False))), {400})

    def test_junk_between_requests(self):
        get = b"GET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n"
        last = b"GET /v1/version HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"
        self.assertEqual(self.statuses(b"\r\n" + last), [200])
        self.assertIn(self.statuses(get + b"\0\1\2\3 \r\n\r\n", half_close=True),
                      ([200, 400], [200], [400], []))

    def test_nothing_is_taken_for_a_request_after_a_head_that_was_refused(self):
        hidden = b"GET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n"
        for field in (b"Content-Length: 5, 5", b"Content-Length: +5", b"Content-Length: x"):
            got = self.statuses(post(field, length=False, body=hidden * 3))
            self.assertEqual(set(got), {400})


if __name__ == "__main__":
    unittest.main()
