"""Three replicas behind the proxies of deploy/: one is lost under load, and no client notices."""

# ctest: serial

import contextlib
import http.client
import json
import os
import re
import signal
import socket
import ssl
import subprocess
import tempfile
import threading
import time
import unittest
import warnings
from pathlib import Path

from deploy.tools import DEPLOY, environment, find
from e2e.daemon import JSON, PATIENCE, SMALL, Daemon, receive_all
from e2e.daemon_test import ENDLESS
from e2e.slow_test import MANY_BYTES

REPLICAS = 3


def scene(number):
    return {**SMALL, "image": {"width": 64, "height": 48, "samples": 4},
            "objects": [{"type": "sphere", "radius": 1 + number / 1000}]}


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return probe.getsockname()[1]


def ask(port, body, path="/v1/render", headers=None):
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    try:
        connection.request("POST", path, body, {**JSON, **(headers or {})})
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()
    finally:
        connection.close()


def wait_until(true, timeout=PATIENCE):
    end = time.monotonic() + timeout
    while not true():
        if time.monotonic() > end:
            raise AssertionError("it did not happen in time")
        time.sleep(0.05)


def rendered(daemon):
    return daemon.metrics().get('shaded_requests_total{route="/v1/render",status="200"}', 0)


class Load:
    """Clients that render until they are stopped; what went wrong is counted."""

    def __init__(self, port, clients=6):
        self.port, self.over = port, threading.Event()
        self.answers, self.failures = 0, []
        self.lock = threading.Lock()
        self.threads = [threading.Thread(target=self._work, args=(client,))
                        for client in range(clients)]

    def _work(self, client):
        number = client
        while not self.over.is_set():
            number += len(self.threads)
            try:
                status, _, body = ask(self.port, json.dumps(scene(number)))
                failure = None if status == 200 and body[:4] == b"\x89PNG" else (status, body[:200])
            except (OSError, http.client.HTTPException) as error:
                failure = repr(error)
            with self.lock:
                self.answers += 1
                if failure:
                    self.failures.append(failure)

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        for thread in self.threads:
            thread.join()


class Proxied(unittest.TestCase):
    def setUp(self):
        self.stack = contextlib.ExitStack()
        self.addCleanup(self.stack.close)
        self.folder = Path(self.stack.enter_context(tempfile.TemporaryDirectory()))

    def start(self, name, configuration, *flags):
        path = self.folder / Path(name).name
        path.write_text(configuration)
        log = self.stack.enter_context(open(self.folder / "log", "w", encoding="utf-8"))
        process = subprocess.Popen([find(name), *flags, str(path)], env=environment(),
                                   stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.stack.callback(process.wait)
        self.stack.callback(process.terminate)
        return process

    def wait_for(self, port):
        def answers():
            try:
                return ask(port, json.dumps(SMALL))[0] == 200
            except (OSError, http.client.HTTPException):
                return False

        try:
            wait_until(answers)
        except AssertionError as error:
            raise AssertionError((self.folder / "log").read_text()) from error

    def replicas(self, *flags):
        return [self.stack.enter_context(Daemon("--threads", "1", "--log-requests", "off", *flags))
                for _ in range(REPLICAS)]

    def pass_a_deadline(self, proxy):
        """One replica has worked for it in vain: that is enough."""
        def late():
            name = 'shaded_requests_total{route="/v1/render",status="504"}'
            return sum(daemon.metrics().get(name, 0) for daemon in replicas)

        replicas = self.replicas("--timeout", "2")
        port = proxy(replicas)
        before = late()
        status, headers, body = ask(port, json.dumps(ENDLESS))
        self.assertEqual((status, headers["Retry-After"]), (504, None))
        self.assertEqual(json.loads(body)["type"], "urn:shaded:problem:deadline")
        wait_until(lambda: late() > before)
        self.assertEqual(late(), before + 1)

    def certificate(self):
        """For localhost, of its own authority; a proxy's TLS lines are switched on by replacing."""
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt",
                        "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj",
                        "/CN=localhost", "-addext", "subjectAltName=DNS:localhost", "-keyout",
                        self.folder / "tls.key", "-out", self.folder / "tls.crt"],
                       check=True, capture_output=True)
        (self.folder / "tls.pem").write_text((self.folder / "tls.crt").read_text() +
                                             (self.folder / "tls.key").read_text())

    def with_tls(self, text):
        self.tls = free_port()
        text = text.replace("#tls ", "").replace("/etc/shaded/tls", f"{self.folder}/tls")
        return re.sub(r"(bind |listen ):?8443", rf"\g<1>127.0.0.1:{self.tls}", text)

    def speaks_tls(self, port):
        trusted = ssl.create_default_context(cafile=self.folder / "tls.crt")

        def asked():
            connection = http.client.HTTPSConnection("localhost", self.tls, timeout=PATIENCE,
                                                     context=trusted)
            try:
                connection.request("POST", "/v1/render", json.dumps(SMALL), JSON)
                answer = connection.getresponse()
                return answer if answer.status == 200 and answer.read()[:4] == b"\x89PNG" else None
            finally:
                connection.close()

        answer = asked()
        self.assertIn("max-age=", answer.headers["Strict-Transport-Security"])
        plain = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
        self.addCleanup(plain.close)
        plain.request("GET", "/v1/version", headers={"Host": "shop.example"})
        answer = plain.getresponse()
        self.assertIn(answer.status, (301, 302, 307, 308))
        self.assertEqual(answer.headers["Location"], "https://shop.example/v1/version")
        old = ssl.create_default_context(cafile=self.folder / "tls.crt")
        old.set_ciphers("ALL:@SECLEVEL=0")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            old.minimum_version = old.maximum_version = ssl.TLSVersion.TLSv1_1
        with socket.create_connection(("127.0.0.1", self.tls), PATIENCE) as connection:
            with self.assertRaises((ssl.SSLError, ConnectionError)):
                old.wrap_socket(connection, server_hostname="localhost")

    def logs_no_secret(self, proxy):
        """What a request is let in by, and scenes in links, are in no log: not the proxy's, not the
        daemon's, of what is served, refused, unknown or malformed."""
        secret, link = "hushhushhushhush", "eJyrVspPykpNLlGyiq6FAAAUuQNl" * 9
        tokens = self.folder / "tokens"
        tokens.write_text(f"{secret}\n")
        daemon = self.stack.enter_context(Daemon("--tokens", str(tokens)))
        port = proxy([daemon], wait=False)
        query = f"?size=16&expires=9999999999&signature={secret}"
        let_in = {"Authorization": f"Bearer {secret}"}

        def get(path, headers):
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
            try:
                connection.request("GET", path, headers=headers)
                answer = connection.getresponse()
                answer.read()
                return answer.status
            except OSError:
                return 0
            finally:
                connection.close()

        wait_until(lambda: get("/v1/version", let_in) == 200)
        for path in ("/v1/preview/brass", "/v1/version", "/nowhere", f"/v1/scene/{link}.png",
                     f"/v1/meshes/sha256-{'a' * 64}"):
            for headers in let_in, {"Authorization": f"Bearer {secret}x"}, {}, \
                    {"Cookie": secret, "Referer": f"http://a/?{secret}"}:
                self.assertIn(get(path + query, headers), (200, 400, 401, 404, 405), path)
        for line in (f"GET /v1/%zz{query} HTTP/1.1", f"GET /x{query} HTTP/9.9", f"\x01 /x{query}"):
            with socket.create_connection(("127.0.0.1", port), PATIENCE) as connection:
                connection.sendall(f"{line}\r\nHost: a\r\nAuthorization: {secret}\r\n\r\n".encode())
                connection.recv(100)
        self.assertEqual(get("/v1/shapes", let_in), 200)
        daemon.wait_for("request", lambda event: event["path"] == "/v1/shapes")
        log = self.folder / "log"
        wait_until(lambda: "/v1/shapes" in log.read_text())
        for text in log.read_text(), daemon.stderr():
            self.assertIn("/v1/preview/brass", text)
            self.assertIn(f"/v1/scene/{link[:8]}...", text)
            self.assertIn(f"/v1/meshes/sha256-{'a' * 64}", text)
            self.assertNotIn("hush", text)
            self.assertNotIn(link[:40], text)

    def told(self, path):
        connection = http.client.HTTPConnection("127.0.0.1", self.admin, timeout=PATIENCE)
        try:
            connection.request("GET", path)
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        except OSError:
            return 0, ""
        finally:
            connection.close()

    def haproxy(self, replicas, change=lambda text: text, wait=True):
        find("haproxy")
        port, text = free_port(), change((DEPLOY / "haproxy/haproxy.cfg").read_text())
        self.admin = free_port()
        text = text.replace("bind :8080", f"bind 127.0.0.1:{port}")
        text = text.replace("bind :8404", f"bind 127.0.0.1:{self.admin}")
        for number, daemon in enumerate(replicas, 1):
            there = "%s:%d" % daemon.address
            text = re.sub(f"shaded-{number}:8080$", f"{there} port {daemon.admin[1]}", text,
                          flags=re.MULTILINE)
        self.start("haproxy", text, "-f")
        if wait:
            self.wait_for(port)
        return port

    def nginx(self, replicas, change=lambda text: text, wait=True):
        port, text = free_port(), (DEPLOY / "nginx/nginx.conf").read_text()
        self.admin = free_port()
        text = text.replace("listen 8080", f"listen 127.0.0.1:{port}")
        text = text.replace("listen 8404", f"listen 127.0.0.1:{self.admin}")
        (server,) = re.findall(r"^ *server shaded:8080.*;$", text, re.MULTILINE)
        text = text.replace(server, "\n".join(server.replace("shaded:8080", "%s:%d" % one.address)
                                              for one in replicas))
        (server,) = re.findall(r"^ *server shaded:9090.*;$", text, re.MULTILINE)
        text = text.replace(server, "\n".join(server.replace("shaded:9090", "%s:%d" % one.admin)
                                              for one in replicas))
        # Root's nginx would work as nobody, who may not enter the folder.
        user = ["-g", "user root;"] if os.geteuid() == 0 else []
        self.proxy = self.start("nginx", change(text.replace("/tmp/", f"{self.folder}/")),
                                *user, "-c")
        if wait:
            self.wait_for(port)
        return port

    def lose(self, port, victim, number):
        with Load(port) as load:
            wait_until(lambda: load.answers > 30)
            victim.process.send_signal(number)
            before, end = load.answers, time.monotonic() + 3
            wait_until(lambda: load.answers > before + 30 and time.monotonic() > end)
        self.assertEqual(load.failures, [], f"of {load.answers}")
        victim.process.wait()


class Relay:
    """In a replica's place: passes on what comes for it, and keeps that."""

    def __init__(self, daemon):
        self.target, self.admin, self.received = daemon.address, daemon.admin, b""
        self.server = socket.create_server(("127.0.0.1", 0))
        self.address = self.server.getsockname()
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self):
        while True:
            here, there = self.server.accept()[0], socket.create_connection(self.target)
            for ends in (here, there, True), (there, here, False):
                threading.Thread(target=self._pass_on, args=ends, daemon=True).start()

    def _pass_on(self, source, sink, keeps):
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                if keeps:
                    self.received += data
                sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)


class FramingTest(Proxied):
    def test_bodies_are_written_anew(self):
        """What the daemon cannot see, how lines between chunks end, is not as the client had it."""
        # No proxy was asked for it before, and knows the answer.
        body = json.dumps(scene(-1)).encode()
        lax = (b"POST /v1/render HTTP/1.1\r\nHost: a\r\nConnection: close\r\n"
               b"Content-Type: application/json\r\nTransfer-Encoding: chunked\r\n\r\n"
               b"%x;a\n%s\n0\n\n" % (len(body), body))
        for proxy in (self.haproxy, self.nginx):
            relay = Relay(self.stack.enter_context(Daemon("--threads", "1")))
            port = proxy([relay])
            before = len(relay.received)
            with socket.create_connection(("127.0.0.1", port), PATIENCE) as connection:
                connection.sendall(lax)
                self.assertTrue(receive_all(connection).startswith(b"HTTP/1.1 200 "))
            received = relay.received[before:]
            self.assertIn(body, received)
            self.assertNotIn(b"\n", received.replace(b"\r\n", b""))
            self.assertNotIn(b";a", received)


class HaproxyTest(Proxied):
    def test_no_request_fails_when_a_replica_is_killed(self):
        replicas = self.replicas()
        port = self.haproxy(replicas)
        self.lose(port, replicas[0], signal.SIGKILL)
        # The others have its work.
        self.assertGreater(min(rendered(daemon) for daemon in replicas[1:]), 0)

    def test_no_request_fails_when_a_replica_is_stopped(self):
        replicas = self.replicas()
        self.lose(self.haproxy(replicas), replicas[1], signal.SIGTERM)

    def test_a_scene_goes_to_the_same_replica(self):
        replicas = self.replicas()
        port = self.haproxy(replicas)
        wait_until(lambda: sum(map(rendered, replicas)) >= 1)
        # One connection: on it a request is over for haproxy when the next one comes, which else
        # might find its replica at work for more than its share.
        connection = http.client.HTTPConnection("127.0.0.1", port, timeout=500)
        self.addCleanup(connection.close)
        for number in range(12):
            before = [rendered(daemon) for daemon in replicas]
            for _ in range(4):
                connection.request("POST", "/v1/render", json.dumps(scene(number)), JSON)
                answer = connection.getresponse()
                self.assertEqual((answer.status, answer.read()[:4]), (200, b"\x89PNG"))
            # A request is counted when its answer has gone.
            wait_until(lambda: sum(map(rendered, replicas)) >= sum(before) + 4)
            after = [rendered(daemon) for daemon in replicas]
            self.assertEqual(sorted(new - old for old, new in zip(before, after)), [0, 0, 4])
        self.assertGreater(min(rendered(daemon) for daemon in replicas), 0)

    def test_a_passed_deadline_is_not_carried_on(self):
        self.pass_a_deadline(self.haproxy)

    def test_it_logs_no_secret(self):
        self.logs_no_secret(self.haproxy)

    def test_tls(self):
        self.certificate()
        port = self.haproxy(self.replicas()[:1], self.with_tls, wait=False)
        wait_until(lambda: self.told("/readyz")[0] == 200)
        self.speaks_tls(port)

    def test_it_is_ready_while_a_replica_is(self):
        daemon = self.stack.enter_context(Daemon("--threads", "1"))
        self.haproxy([daemon])
        wait_until(lambda: self.told("/readyz")[0] == 200)
        status, metrics = self.told("/metrics")
        self.assertEqual(status, 200)
        self.assertIn('haproxy_backend_active_servers{proxy="replicas"} 1', metrics)
        self.assertEqual(self.told("/")[0], 404)
        daemon.stop()
        wait_until(lambda: self.told("/readyz")[0] == 503)


class NginxTest(Proxied):
    def test_it_logs_no_secret(self):
        self.logs_no_secret(self.nginx)

    def test_it_is_ready_while_a_replica_is(self):
        replicas = [self.stack.enter_context(Daemon("--threads", "1")) for _ in range(3)]
        self.nginx(replicas)
        self.assertEqual(self.told("/"), (404, self.told("/")[1]))
        for n, daemon in enumerate(replicas):
            if n == 1:
                daemon.process.kill()
                daemon.process.wait()
            else:
                daemon.stop()
            for _ in range(6):  # whichever is asked first
                status, text = self.told("/readyz")
                if n < 2:
                    self.assertEqual((status, text), (200, "ready\n"))
                else:
                    self.assertIn(status, (502, 503, 504))

    def test_a_replica_that_stops_is_not_ready(self):
        """One that drains says so, and is not counted."""
        daemon = self.stack.enter_context(Daemon("--threads", "1", "--timeout", "600", "--drain-time",
                                                 "600"))
        self.nginx([daemon])
        self.assertEqual(self.told("/readyz")[0], 200)
        waiting = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE)
        waiting.request("POST", "/v1/render", json.dumps(ENDLESS), JSON)
        wait_until(lambda: daemon.metrics()["shaded_workers_busy"])
        daemon.signal()
        daemon.wait_for("stopping")
        self.assertEqual(self.told("/readyz"), (503, "draining\n"))
        waiting.close()
        self.assertEqual(daemon.wait(), 0)

    def test_tls(self):
        self.certificate()
        port = self.nginx(self.replicas()[:1], self.with_tls, wait=False)

        def listens():
            try:
                socket.create_connection(("127.0.0.1", self.tls)).close()
                return True
            except OSError:
                return False

        wait_until(listens)
        self.speaks_tls(port)

    def test_a_passed_deadline_is_not_carried_on(self):
        self.pass_a_deadline(self.nginx)

    def test_no_request_fails_when_a_replica_is_killed(self):
        replicas = self.replicas()
        self.lose(self.nginx(replicas), replicas[0], signal.SIGKILL)

    def test_a_picture_is_rendered_once(self):
        replicas = self.replicas()
        port = self.nginx(replicas)
        wait_until(lambda: sum(map(rendered, replicas)) >= 1)
        before = sum(map(rendered, replicas))
        answers = [ask(port, json.dumps(scene(1))) for _ in range(5)]
        self.assertEqual({answer[0] for answer in answers}, {200})
        self.assertEqual(len({answer[2] for answer in answers}), 1)
        self.assertEqual([answer[1]["X-Cache"] for answer in answers], ["MISS"] + ["HIT"] * 4)
        self.assertEqual(len({answer[1]["X-Request-Id"] for answer in answers}), 5)
        wait_until(lambda: sum(map(rendered, replicas)) > before)
        self.assertEqual(sum(map(rendered, replicas)), before + 1)
        # What it accepts is part of the request.
        jpeg = ask(port, json.dumps(scene(1)), headers={"Accept": "image/jpeg"})
        self.assertEqual((jpeg[1]["X-Cache"], jpeg[2][:2]), ("MISS", b"\xff\xd8"))

    def test_it_answers_304(self):
        port = self.nginx(self.replicas()[:1])
        etag = ask(port, json.dumps(scene(1)))[1]["ETag"]
        status, _, body = ask(port, json.dumps(scene(1)), headers={"If-None-Match": etag})
        self.assertEqual((status, body), (304, b""))

    def test_requests_of_one_client_are_not_answered_to_another(self):
        port = self.nginx(self.replicas()[:1])
        secret = {"Authorization": "Bearer of-one"}
        answers = [ask(port, json.dumps(scene(1)), headers=secret) for _ in range(2)]
        self.assertEqual([answer[1]["X-Cache"] for answer in answers], ["BYPASS"] * 2)
        self.assertEqual(ask(port, json.dumps(scene(1)))[1]["X-Cache"], "MISS")

    def spilled(self, nginx):
        """Bytes of files that nginx has open, named or not."""
        children = Path(f"/proc/{nginx.pid}/task/{nginx.pid}/children").read_text().split()
        total = 0
        for process in children:
            for entry in Path(f"/proc/{process}/fd").iterdir():
                with contextlib.suppress(FileNotFoundError):  # closed meanwhile
                    if os.readlink(entry).startswith((f"{self.folder}/proxy", f"{self.folder}/cache")):
                        total += entry.stat().st_size
        return total

    def test_large_pictures_for_slow_clients_fill_no_disk(self):
        daemon, = self.replicas()[:1]
        port = self.nginx([daemon])
        for headers in {}, {"Authorization": "Bearer of-one"}:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
            self.addCleanup(connection.close)
            connection.request("POST", "/v1/render", json.dumps(MANY_BYTES), {**JSON, **headers})
            answer = connection.getresponse()
            self.assertEqual(answer.status, 200)
            self.assertGreater(int(answer.headers["Content-Length"]), 4_000_000)
            while answer.read(200_000):
                self.assertEqual(self.spilled(self.proxy), 0)

    def test_large_bodies_at_a_time_are_counted(self):
        port = self.nginx(self.replicas()[:1])
        head = (b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json\r\n"
                b"Content-Length: 1000000\r\n\r\n{")
        held = []
        for _ in range(20):  # whichever four of them come last are refused
            held.append(self.stack.enter_context(
                socket.create_connection(("127.0.0.1", port), PATIENCE)))
            held[-1].sendall(head)
        wait_until(lambda: self.is_refused(port, head))
        # Small ones have nothing to do with it.
        self.assertEqual(ask(port, json.dumps(scene(2)))[0], 200)
        for connection in held:
            connection.close()
        body = json.dumps(scene(3)).ljust(1_000_000)
        wait_until(lambda: ask(port, body)[0] == 200)

    def is_refused(self, port, head):
        with socket.create_connection(("127.0.0.1", port), PATIENCE) as connection:
            connection.sendall(head)
            connection.settimeout(1)
            try:
                return connection.recv(100).startswith(b"HTTP/1.1 429 ")
            except TimeoutError:
                return False

    def test_large_scenes_are_told_apart(self):
        port = self.nginx(self.replicas()[:1])
        padding = " " * 200_000
        answers = [ask(port, json.dumps(scene(number)) + padding) for number in (1, 500)]
        self.assertEqual([answer[0] for answer in answers], [200, 200])
        self.assertNotEqual(answers[0][2], answers[1][2])
        self.assertEqual(answers[0][2], ask(port, json.dumps(scene(1)))[2])


if __name__ == "__main__":
    unittest.main()
