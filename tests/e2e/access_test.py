"""Tokens, origins, and settings that change while the daemon runs."""

import hashlib
import http.client
import json
import os
import signal
import socket
import time
import unittest
from pathlib import Path

from e2e.daemon import JSON, SANITIZED, SLOW, SMALL, SOURCE, Daemon, another, run
from e2e.daemon_test import Background, Folder, occupied, wait_until, wait_until_read

FIRST, SECOND, THIRD = "first-token-0123456789", "second.token_~+/=9876543210", "third-token-abcdef"


def bearer(token):
    return {"Authorization": f"Bearer {token}"}


def line(name, token, more=""):
    return f"{name} sha256:{hashlib.sha256(token.encode()).hexdigest()}{more}\n"


def reload(daemon, good=True):
    """Sends SIGHUP: the event that tells what came of it."""
    before = len(daemon.events("reloaded")) + len(daemon.events("reload-failed"))
    daemon.signal(signal.SIGHUP)
    wait_until(lambda: len(daemon.events("reloaded")) + len(daemon.events("reload-failed")) >
               before)
    event = [event for event in daemon.events() if event["event"].startswith("reload")][-1]
    if (event["event"] == "reloaded") != good:
        raise AssertionError(event)
    return event


class TokenTest(Folder):
    def test_without_a_token_nothing_is_done(self):
        path = self.file(f"# for the studio\n\n  {FIRST}  \r\n{SECOND}\n", "tokens")
        with Daemon("--tokens", path) as daemon:
            for route in ("/v1/materials", "/v1/version"):
                answer = daemon.get(route)
                self.assertEqual(answer.status, 401)
                self.assertEqual(answer.headers["WWW-Authenticate"], 'Bearer realm="shaded"')
                self.assertEqual(answer.headers["Cache-Control"], "no-store")
                self.assertEqual(json.loads(answer.body)["type"],
                                 "urn:shaded:problem:unauthorized")
            self.assertEqual(daemon.render(SMALL).status, 401)
            self.assertEqual(daemon.metrics()["shaded_workers_busy"], 0)
            for token in (FIRST, SECOND):
                self.assertEqual(daemon.render(SMALL, bearer(token)).status, 200)
                self.assertEqual(daemon.get("/v1/version", bearer(token)).status, 200)
            self.assertEqual(
                daemon.render(SMALL, {"Authorization": f"bearer   {FIRST}"}).status, 200)
            # What tells how to ask is open, and so are the questions of browsers.
            for route in ("/", "/openapi.yaml", "/openapi.json", "/scene.schema.json"):
                self.assertEqual(daemon.get(route).status, 200)
            self.assertEqual(daemon.call("OPTIONS", "/v1/render").status, 204)
            self.assertEqual(daemon.get("/nothing").status, 404)
            self.assertEqual(daemon.get("/readyz", admin=True).status, 200)

    def test_hashes_names_and_ends(self):
        def write(seconds):
            """One token ends then, whole seconds from now, which are told."""
            ends = int(time.time()) + seconds
            end = time.strftime(" expires=%Y-%m-%dT%H:%M:%SZ", time.gmtime(ends))
            return ends, self.file(
                line("ci", FIRST) + f"{SECOND}\n" + line("ci", THIRD, end) +
                line("old", "an-old-token-0123", " expires=2020-02-29T00:00:00Z") +
                line("9.far_off-", "x" * 255, "\texpires=9999-12-31T23:59:59Z"), "tokens")

        with Daemon("--tokens", write(3600)[1]) as daemon:
            self.assertEqual(daemon.get("/v1/version", bearer(THIRD)).status, 200)
            ends, _ = write(2)
            reload(daemon)
            while daemon.get("/v1/version", bearer(THIRD)).status == 200:
                time.sleep(0.1)
            self.assertGreaterEqual(time.time(), ends - 0.1)
            digest = line("", FIRST).strip()
            for number, (token, client) in enumerate((
                    (FIRST, "token:ci"), ("x" * 255, "token:9.far_off-"),
                    (SECOND, "token:" + hashlib.sha256(SECOND.encode()).hexdigest()[:16]),
                    ("an-old-token-0123", None), (THIRD, None), (digest, None),
                    (digest[len("sha256:"):], None))):
                answer = daemon.get("/v1/version", {**bearer(token), "X-Request-Id": str(number)})
                self.assertEqual(answer.status, 200 if client else 401, token)
                event = daemon.wait_for("request", lambda e, n=number: e["id"] == str(n))
                self.assertEqual(event["client"], client or "127.0.0.1")
        digest = hashlib.sha256(b"").hexdigest()
        for bad in (f"ci sha256:{digest[1:]}", f"ci sha256:{digest}0", f"ci sha256:{digest.upper()}",
                    f"ci {digest}", "ci sha256:", f"{'a' * 33} sha256:{digest}",
                    f"a/b sha256:{digest}", f"ci sha256:{digest} expires=2026-02-29T00:00:00Z",
                    f"ci sha256:{digest} expires=2026-01-01", f"ci sha256:{digest} rate=1",
                    f"ci sha256:{digest} expires=2026-01-01T00:00:00+00:00",
                    f"ci sha256:{digest} expires=2026-01-01T24:00:00Z",
                    f"ci sha256:{digest} expires=2027-01-01T00:00:00Z x",
                    f"ci sha256:{digest} rate=1/fortnight", f"ci sha256:{digest} rate=0/day",
                    f"ci sha256:{digest} rate=1/day rate=1/day",
                    f"ci sha256:{digest} expires=2027-01-01T00:00:00Z rate=1/day "
                    "expires=2027-01-01T00:00:00Z",
                    f"sha256:{digest} expires=2027-01-01T00:00:00Z"):
            path = self.file(f"{FIRST}\n{bad}\n", "tokens")
            status, _, stderr = run("--listen", "127.0.0.1:0", "--admin", "off", "--tokens", path)
            self.assertEqual(status, 1, bad)
            self.assertIn("line 2 has ", json.loads(stderr.splitlines()[-1])["message"])
            self.assertNotIn(digest[1:], stderr)

    def test_tokens_may_have_rates(self):
        path = self.file(line("ci", FIRST, " rate=3/day") + line("free", SECOND) +
                         line("ci", THIRD, " expires=9999-12-31T23:59:59Z\trate=3/day"), "tokens")
        with Daemon("--tokens", path) as daemon:
            name = 'shaded_token_requests_total{token="ci",result="%s"}'
            self.assertEqual([daemon.metrics()[name % word] for word in ("admitted", "refused")],
                             [0, 0])
            # Whatever comes of them: those of one name together.
            began = time.monotonic()
            self.assertEqual(daemon.get("/v1/version", bearer(FIRST)).status, 200)
            self.assertEqual(daemon.render({}, bearer(THIRD)).status, 422)
            self.assertEqual(daemon.render(SMALL, bearer(FIRST)).status, 200)
            for number, token in enumerate((FIRST, THIRD)):
                answer = daemon.render(SMALL, {**bearer(token), "X-Request-Id": f"over-{number}"})
                problem = json.loads(answer.body)
                self.assertEqual((answer.status, problem["type"]), (429, "urn:shaded:problem:rate"))
                self.assertIn("the limit `rate` of the token ci is 3 a day",
                              problem["detail"])
                # A third of a day after the first of them.
                seconds = int(answer.headers["Retry-After"])
                self.assertLessEqual(seconds, 28800)
                self.assertGreaterEqual(seconds, 28800 - 1 - (time.monotonic() - began))
                self.assertIn(f"in {seconds} s", problem["detail"])
                event = daemon.wait_for("request", lambda e, n=number: e["id"] == f"over-{n}")
                self.assertEqual((event["client"], event["problem"]), ("token:ci", "rate"))
            # Others have nothing to do with it, nor has what asks for no token.
            for _ in range(9):
                self.assertEqual(daemon.get("/v1/version", bearer(SECOND)).status, 200)
            self.assertEqual(daemon.get("/v1/version").status, 401)
            self.assertEqual(daemon.get("/openapi.json", bearer(FIRST)).status, 200)
            self.assertEqual(daemon.call("OPTIONS", "/v1/render", None, bearer(FIRST)).status, 204)
            metrics = daemon.metrics()
            self.assertEqual([metrics[name % word] for word in ("admitted", "refused")], [3, 2])
            self.assertEqual(metrics['shaded_refused_total{limit="rate"}'], 2)
            self.assertNotIn('shaded_token_requests_total{token="free",result="admitted"}', metrics)

    def test_what_is_used_stays_used(self):
        def statuses(daemon, count):
            return [daemon.get("/v1/version", bearer(FIRST)).status for _ in range(count)]

        path = self.file(line("ci", FIRST, " rate=3/day"), "tokens")
        with Daemon("--tokens", path) as daemon:
            self.assertEqual(statuses(daemon, 4), [200, 200, 200, 429])
            reload(daemon)
            self.assertEqual(statuses(daemon, 1), [429])
            self.file(line("ci", FIRST, " rate=5/day"), "tokens")
            reload(daemon)
            self.assertEqual(statuses(daemon, 3), [200, 200, 429])
            self.file(line("ci", FIRST), "tokens")
            reload(daemon)
            self.assertEqual(statuses(daemon, 9), [200] * 9)
            self.file(line("ci", FIRST, " rate=2/day"), "tokens")
            reload(daemon)
            self.assertEqual(statuses(daemon, 1), [429])
            # One name, two rates: which holds?
            self.file(line("ci", FIRST, " rate=2/day") + line("ci", SECOND), "tokens")
            self.assertIn("line 2 has another rate", reload(daemon, good=False)["message"])
            self.assertEqual(statuses(daemon, 1), [429])
        status, _, stderr = run("--listen", "127.0.0.1:0", "--admin", "off", "--admin-tokens", path)
        self.assertEqual(status, 1)
        self.assertIn("line 1 has a rate", stderr)

    def test_metrics_may_ask_for_a_token(self):
        path = self.file(FIRST + "\n", "tokens")
        with Daemon("--admin-tokens", path) as daemon:
            for headers, status in (({}, 401), (bearer(SECOND), 401), (bearer(FIRST), 200)):
                answer = daemon.get("/metrics", headers, admin=True)
                self.assertEqual(answer.status, status)
                self.assertEqual("shaded_workers" in answer.body.decode(), status == 200)
                self.assertEqual(answer.headers["WWW-Authenticate"],
                                 None if status == 200 else 'Bearer realm="metrics"')
            self.assertEqual(daemon.get("/readyz", admin=True).status, 200)
            self.assertEqual(daemon.get("/healthz", admin=True).status, 200)
            self.assertEqual(daemon.get("/v1/version").status, 200)
            self.file(SECOND + "\n", "tokens")
            reload(daemon)
            self.assertEqual(daemon.get("/metrics", bearer(FIRST), admin=True).status, 401)
            self.assertEqual(daemon.get("/metrics", bearer(SECOND), admin=True).status, 200)

    def test_wrong_tokens_are_no_tokens(self):
        path = self.file(FIRST + "\n", "tokens")
        with Daemon("--tokens", path) as daemon:
            for wrong in (f"Bearer {FIRST[:-1]}", f"Bearer {FIRST}x", "Bearer", "Bearer ",
                          f"Basic {FIRST}", FIRST, f"Bearer {FIRST.upper()}", "Bearer #",
                          f"Bearer {FIRST} {FIRST}", "Bearer " + "a" * 5000,
                          f"Bearer {FIRST}, Bearer {FIRST}"):
                answer = daemon.get("/v1/version", {"Authorization": wrong})
                self.assertEqual(answer.status, 401, wrong)
                self.assertIn('error="invalid_token"', answer.headers["WWW-Authenticate"])
            twice = b"Authorization: Bearer " + FIRST.encode() + b"\r\n"
            data = daemon.raw(b"GET /v1/version HTTP/1.1\r\nHost: a\r\nConnection: close\r\n" +
                              twice * 2 + b"\r\n")
            self.assertTrue(data.startswith(b"HTTP/1.1 401 "))

    def test_tokens_are_not_told(self):
        path = self.file(FIRST + "\n", "tokens")
        with Daemon("--tokens", path) as daemon:
            daemon.render(SMALL, bearer(FIRST))
            daemon.render(SMALL, bearer(SECOND))
            self.assertNotIn(b"token-0123", daemon.render(b"x", bearer(FIRST)).body)
            self.file(FIRST + "\nbad token " + THIRD + "\n", "tokens")
            event = reload(daemon, good=False)
            self.assertIn("line 2", event["message"])
            wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)
            for secret in (FIRST, SECOND, THIRD):
                self.assertNotIn(secret, daemon.stderr())

    def test_files_that_are_none_stop_the_start(self):
        for text, word in (("", "no token"), ("# nothing\n", "no token"), ("short\n", "line 1"),
                           ("\n" + "x" * 400 + "\n", "line 2"), ("a b c d e f g h i\n", "line 1")):
            path = self.file(text, "tokens")
            status, _, stderr = run("--listen", "127.0.0.1:0", "--admin", "off", "--tokens", path)
            self.assertEqual(status, 1)
            event = json.loads(stderr.splitlines()[-1])
            self.assertEqual((event["event"], event["where"]), ("cannot-start", path))
            self.assertIn(word, event["message"])
        status, _, stderr = run("--listen", "127.0.0.1:0", "--admin", "off", "--tokens",
                                str(self.folder / "missing"))
        self.assertEqual(status, 1)
        self.assertIn("No such file", stderr)


    def test_no_end_of_a_line_becomes_a_token(self):
        """Wherever a buffer may end, and after bytes that end strings or lines elsewhere."""
        token = FIRST.encode()
        cases = [(b"#" * n + token, "line 1 is longer" if n > 1000 - len(token) else "no token")
                 for n in (254, 255, 318, 319, 320, 638, 978, 979, 1000, 1023, 4095, 65535)]
        cases += [(b"\n# " + byte + token, "line 2 holds a character")
                  for byte in (b"\0", b"\r", b"\x0b", b"\x7f", "é".encode(), b"\xff")]
        cases += [(THIRD.encode() + b"\0\n", "line 1 holds"), (b" " * 1001, "line 1 is longer")]
        for data, word in cases:
            with self.subTest(data[:8], size=len(data)):
                path = self.folder / "tokens"
                path.write_bytes(data)
                status, _, stderr = run("--listen", "127.0.0.1:0", "--admin", "off", "--tokens",
                                        str(path))
                self.assertEqual(status, 1)
                self.assertIn(word, json.loads(stderr.splitlines()[-1])["message"])


class OriginTest(unittest.TestCase):
    def test_configured_origins_may_ask_and_read(self):
        good = {"Origin": "https://studio.example"}
        with Daemon("--cors-origins", "https://studio.example http://localhost:3000") as daemon:
            asked = {**good, "Access-Control-Request-Method": "POST",
                     "Access-Control-Request-Headers": "content-type,authorization"}
            answer = daemon.call("OPTIONS", "/v1/render", None, asked)
            self.assertEqual(answer.status, 204)
            self.assertEqual(answer.headers["Access-Control-Allow-Origin"], good["Origin"])
            self.assertIn("POST", answer.headers["Access-Control-Allow-Methods"])
            self.assertIn("Content-Type", answer.headers["Access-Control-Allow-Headers"])
            self.assertIn("Authorization", answer.headers["Access-Control-Allow-Headers"])
            self.assertTrue(int(answer.headers["Access-Control-Max-Age"]))
            for answer in (daemon.render(SMALL, good), daemon.render(b"{", good),
                           daemon.render(SMALL, {**good, "If-None-Match": "*"}),
                           daemon.get("/nothing", good), daemon.get("/v1/version", good)):
                self.assertEqual(answer.headers["Access-Control-Allow-Origin"], good["Origin"])
                self.assertIn("ETag", answer.headers["Access-Control-Expose-Headers"])
                self.assertIsNone(answer.headers["Access-Control-Allow-Methods"])
                self.assertIn("Origin", answer.headers.get_all("Vary"))
                self.assert_embeddable(answer, "https://studio.example, http://localhost:3000")
            self.assertEqual(daemon.get("/", {"Origin": "http://localhost:3000"})
                             .headers["Access-Control-Allow-Origin"], "http://localhost:3000")
            for other in ({}, {"Origin": "https://evil.example"}, {"Origin": "null"},
                          {"Origin": "https://studio.example.evil"}, {"Origin": "*"},
                          {"Origin": "https://studio.exampl"}, {"Origin": ""}):
                answer = daemon.render(SMALL, other)
                self.assertEqual(answer.status, 200)
                self.assertFalse([name for name in answer.headers if name.startswith("Access-")])
                self.assertIn("Origin", answer.headers.get_all("Vary"))
                self.assert_embeddable(answer, "https://studio.example, http://localhost:3000")

    def assert_embeddable(self, answer, origins):
        """As far as a page may measure it, and show it where it isolates itself."""
        self.assertEqual(answer.headers["Timing-Allow-Origin"], origins)
        self.assertEqual(answer.headers["Cross-Origin-Resource-Policy"], "cross-origin")

    def test_without_origins_nothing_is_said(self):
        with Daemon() as daemon:
            answer = daemon.render(SMALL, {"Origin": "https://any.example"})
            for name in ("Timing-Allow-Origin", "Cross-Origin-Resource-Policy",
                         "Access-Control-Allow-Origin"):
                self.assertIsNone(answer.headers[name])

    def test_anybody(self):
        with Daemon("--cors-origins", "*") as daemon:
            # What an <img> leaves in a browser's cache is good for a script of any origin.
            plain = daemon.get("/v1/preview/brass?size=16")
            self.assertEqual(plain.headers["Access-Control-Allow-Origin"], "*")
            answer = daemon.render(SMALL, {"Origin": "https://any.example"})
            self.assertEqual(answer.headers["Access-Control-Allow-Origin"], "*")
            self.assertEqual(answer.headers.get_all("Vary"), ["Accept"])
            self.assert_embeddable(answer, "*")
            self.assert_embeddable(daemon.get("/v1/preview/brass?size=16"), "*")

    def test_origins_must_be_origins(self):
        for wrong in ("example.com", "https://", "https://a.example/", "HTTPS://a.example",
                      "https://a.example b"):
            status, _, stderr = run("--listen", "127.0.0.1:0", "--admin", "off",
                                    "--cors-origins", wrong)
            self.assertEqual(status, 1, wrong)
            self.assertIn("cors-origins", stderr)


class ReloadTest(Folder):
    def test_new_requests_have_new_settings(self):
        tokens = self.file(FIRST + "\n", "tokens")
        path = self.file(f"max-pixels = 1000\ntokens = {tokens}\n")
        with Daemon("--config", path) as daemon:
            self.assertEqual(daemon.render(SMALL, bearer(FIRST)).status, 200)
            self.file(SECOND + "\n", "tokens")
            self.file(f"max-pixels = 100\ntokens = {tokens}\ncache-control = private\n")
            self.assertEqual(daemon.render(SMALL, bearer(FIRST)).status, 200)
            reload(daemon)
            self.assertEqual(daemon.render(SMALL, bearer(FIRST)).status, 401)
            refused = daemon.render(SMALL, bearer(SECOND))
            self.assertEqual(refused.status, 422)
            self.assertIn("the limit `pixels` is 100", json.loads(refused.body)["detail"])
            self.file("max-pixels = 100000\ncache-control = private\n")
            reload(daemon)
            answer = daemon.render(SMALL)
            self.assertEqual((answer.status, answer.headers["Cache-Control"]), (200, "private"))
            self.assertEqual(daemon.metrics()['shaded_reloads_total{result="done"}'], 2)

    def test_what_is_bad_leaves_everything_as_it_was(self):
        tokens = self.file(FIRST + "\n", "tokens")
        good = f"max-pixels = 1000\ntokens = {tokens}\n"
        path = self.file(good)
        with Daemon("--config", path) as daemon:
            for text, word in ((good + "max-pixels = many\n", "shaded.conf:3"),
                               ("max-pixels = 9\ntokens = /nonexistent\n", "/nonexistent"),
                               ("max-pixels = 9\nocio = /nonexistent\n", "/nonexistent"),
                               ("max-pixels = 9\ncors-origins = x\n", "cors-origins"),
                               ("nonsense\n", "shaded.conf:1")):
                self.file(text)
                self.assertIn(word, reload(daemon, good=False)["message"])
                self.assertEqual(daemon.render(SMALL).status, 401)
                self.assertEqual(daemon.render(SMALL, bearer(FIRST)).status, 200)
            self.assertEqual(daemon.metrics()['shaded_reloads_total{result="failed"}'], 5)

    def test_what_hangs_who_opens_it_is_refused(self):
        """A FIFO that nobody writes to."""
        tokens = self.folder / "tokens"
        tokens.write_text(FIRST + "\n")
        path = self.file(f"tokens = {tokens}\n")
        with Daemon("--config", path) as daemon:
            for file in tokens, Path(path):
                text = file.read_text()
                file.unlink()
                os.mkfifo(file)
                message = reload(daemon, good=False)["message"]
                self.assertEqual(message, f"{file}: not a regular file")
                self.assertEqual(daemon.render(SMALL, bearer(FIRST)).status, 200)
                file.unlink()
                file.write_text(text)
            reload(daemon)

    def test_the_color_configuration_is_read_again(self):
        text = (SOURCE / "config/shaded.ocio").read_text()
        ocio = self.file(text, "studio.ocio")
        with Daemon("--ocio", ocio) as daemon:
            tag = daemon.render(SMALL).headers["ETag"]
            before = json.loads(daemon.get("/v1/version").body)["colorConfig"]
            self.file(text + "\n# another one\n", "studio.ocio")
            reload(daemon)
            self.assertNotEqual(daemon.render(SMALL).headers["ETag"], tag)
            self.assertNotEqual(json.loads(daemon.get("/v1/version").body)["colorConfig"], before)
            self.file("nonsense: [", "studio.ocio")
            reload(daemon, good=False)
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_accepted_requests_keep_what_they_came_with(self):
        path = self.file("timeout = 300\ncache-control = old\n")
        with Daemon("--config", path, "--threads", "1") as daemon:
            running = occupied(daemon)
            waiting = Background(daemon, SLOW)
            wait_until_read(daemon, 1)
            self.file("timeout = 200\nmax-pixels = 1\ncache-control = new\n")
            reload(daemon)
            self.assertEqual(daemon.render(SMALL).status, 422)
            running.leave()
            answer = waiting.result()
            self.assertEqual((answer.status, answer.headers["Cache-Control"]), (200, "old"))

    def test_what_needs_a_restart_is_named(self):
        path = self.file("queue = 5\n")
        with Daemon("--config", path) as daemon:
            self.file("queue = 6\nthreads = 1\nmax-pixels = 10\n")
            self.assertEqual(reload(daemon)["needs-restart"], "threads, queue")
            self.assertEqual(daemon.render(SMALL).status, 422)

    def test_reloads_under_load(self):
        ocio = self.file((SOURCE / "config/shaded.ocio").read_text(), "studio.ocio")
        with Daemon("--ocio", ocio, "--log-requests", "off", "--timeout", "300") as daemon:
            work = [Background(daemon, another(SLOW, i)) for i in range(3)]
            for i in range(10 if SANITIZED else 30):
                daemon.signal(signal.SIGHUP)
                self.assertEqual(daemon.render(another(SMALL, i)).status, 200)
            for request in work:
                self.assertEqual(request.result().status, 200)


class ServiceManagerTest(Folder):
    def notifications(self):
        manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(manager.close)
        path = str(self.folder / "notify")
        manager.bind(path)
        manager.settimeout(500)
        return manager, path

    def test_states_are_told(self):
        manager, path = self.notifications()
        with Daemon(env={"NOTIFY_SOCKET": path, "WATCHDOG_USEC": "400000"}) as daemon:
            self.assertEqual(manager.recv(1000), b"READY=1")
            for _ in range(3):
                self.assertEqual(manager.recv(1000), b"WATCHDOG=1")
            daemon.signal(signal.SIGHUP)
            told = []
            while b"READY=1" not in told:
                told.append(manager.recv(1000))
            self.assertRegex([word for word in told if word != b"WATCHDOG=1"][0],
                             rb"^RELOADING=1\nMONOTONIC_USEC=\d+$")
            daemon.stop()
            while (word := manager.recv(1000)) == b"WATCHDOG=1":
                pass
            self.assertEqual(word, b"STOPPING=1")

    def test_without_a_manager_or_with_a_bad_one_it_runs(self):
        for path in ("", "/nonexistent/socket", "relative", "/" + "x" * 200):
            with Daemon(env={"NOTIFY_SOCKET": path}) as daemon:
                self.assertEqual(daemon.render(SMALL).status, 200)

    def test_a_manager_that_reads_nothing_keeps_it_from_nothing(self):
        manager, path = self.notifications()
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as stuffer:
            stuffer.setblocking(False)
            with self.assertRaises(BlockingIOError):
                while True:
                    stuffer.sendto(b"X=1", path)
        with Daemon(env={"NOTIFY_SOCKET": path}) as daemon:
            daemon.signal(signal.SIGHUP)
            daemon.wait_for("reloaded")
            self.assertEqual(daemon.render(SMALL).status, 200)
        manager.close()

    def start_with_sockets(self, sockets, names, *flags):
        """As systemd does it: descriptors from 3 on, and LISTEN_PID the daemon's own."""
        for place, listener in enumerate(sockets):
            os.dup2(listener.fileno(), 100 + place, inheritable=True)
        script = "; ".join(f"exec {3 + i}<&{100 + i} {100 + i}<&-" for i in range(len(sockets)))
        wrapper = self.file(f'#!/bin/bash\n{script}\nexport LISTEN_PID=$$ '
                            f'LISTEN_FDS={len(sockets)} LISTEN_FDNAMES={names}\n'
                            f'exec "$SHADED_BUILD/shaded" "$@"\n', "wrapper")
        os.chmod(wrapper, 0o755)
        return Daemon(*flags, program=wrapper,
                      pass_fds=tuple(100 + i for i in range(len(sockets))))

    def test_sockets_are_taken_over(self):
        with socket.create_server(("127.0.0.1", 0)) as public, \
                socket.create_server(("127.0.0.1", 0)) as admin:
            # A request that comes before the daemon waits for it.
            early = socket.create_connection(public.getsockname())
            early.sendall(b"GET /v1/version HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
            with self.start_with_sockets([admin, public], "admin:http") as daemon:
                self.assertEqual(daemon.address, public.getsockname())
                self.assertEqual(daemon.admin, admin.getsockname())
                self.assertTrue(early.recv(1000).startswith(b"HTTP/1.1 200 "))
                early.close()
                self.assertEqual(daemon.render(SMALL).status, 200)
                self.assertEqual(daemon.get("/readyz", admin=True).status, 200)
                maps = os.listdir(f"/proc/{daemon.pid}/fd")
                self.assertNotIn("100", maps)

    def test_a_head_has_a_total_time_on_unix_sockets_too(self):
        path = str(self.folder / "socket")
        with socket.socket(socket.AF_UNIX) as public:
            public.bind(path)
            public.listen()
            with self.start_with_sockets([public], "http", "--head-time", "1",
                                         "--idle-timeout", "300") as daemon:
                for answers in 0, 2:
                    with socket.socket(socket.AF_UNIX) as client:
                        client.settimeout(500)
                        client.connect(path)
                        for _ in range(answers):
                            client.sendall(b"GET / HTTP/1.1\r\nHost: a\r\n\r\n")
                            self.assertTrue(client.recv(100000).startswith(b"HTTP/1.1 200 "))
                        with self.assertRaises(OSError):
                            while True:
                                client.sendall(b"G")
                                time.sleep(0.1)
                self.assertEqual(daemon.metrics()[
                    'shaded_connections_ended_total{reason="time"}'], 2)

    def test_who_waits_at_a_socket_of_the_manager_is_served_by_the_next_daemon(self):
        with socket.create_server(("127.0.0.1", 0), backlog=100) as public:
            daemon = self.start_with_sockets([public], "http")
            daemon.signal(signal.SIGSTOP)
            clients = [http.client.HTTPConnection(*daemon.address, timeout=500)
                       for _ in range(40)]
            for client in clients:
                client.request("POST", "/v1/render", json.dumps(SMALL), JSON)
            daemon.signal()
            daemon.signal(signal.SIGCONT)
            self.assertEqual(daemon.wait(), 0, daemon.stderr())
            with self.start_with_sockets([public], "http"):
                answers = [client.getresponse().status for client in clients]
                for client in clients:
                    client.close()
            self.assertLessEqual(set(answers), {200, 503})


if __name__ == "__main__":
    unittest.main()
