"""The daemon as operators meet it: options, ports, signals, limits in time, metrics, logs."""

import contextlib
import fcntl
import http.client
import json
import os
import re
import signal
import socket
import stat
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

from e2e.daemon import (JSON, PATIENCE, SANITIZED, SHADED, SLOW, SMALL, SOURCE, Daemon, another,
                        connect,                        environment, run)

# Nobody waits for its end.
ENDLESS = {**SLOW, "image": {"width": 4096, "height": 4096, "samples": 16}}


class Background:
    """A request on a thread of its own."""

    def __init__(self, daemon, scene, path="/v1/render"):
        self.answer = None
        self.thread = threading.Thread(target=self._work, args=(daemon, scene, path))
        self.thread.start()

    def _work(self, daemon, scene, path):
        self.answer = daemon.post(path, scene)

    def result(self):
        self.thread.join()
        return self.answer


def wait_until(true, timeout=PATIENCE):
    end = time.monotonic() + timeout
    while not true():
        if time.monotonic() > end:
            raise AssertionError("it did not happen in time")
        time.sleep(0.02)


def wait_until_busy(daemon, busy=1, queued=0):
    def reached():
        metrics = daemon.metrics()
        return metrics["shaded_workers_busy"] >= busy and metrics["shaded_queue_depth"] >= queued

    wait_until(reached)


class Client:
    """A request that may be left alone."""

    def __init__(self, daemon, scene, path="/v1/render", headers=None):
        self.connection = http.client.HTTPConnection(*daemon.address, timeout=PATIENCE)
        self.connection.request("POST", path, json.dumps(scene), {**JSON, **(headers or {})})

    def leave(self):
        self.connection.close()

    def reset(self):
        """Leaves with an RST instead of a FIN."""
        self.connection.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER,
                                        b"\1\0\0\0\0\0\0\0")
        self.connection.close()


def wait_until_read(daemon, count, begun=1):
    """So many large pictures wait behind those that were begun, all of them were read, and nothing
    else waits: while one is read, there is a place for another one."""
    def reached():
        metrics = daemon.metrics()
        return (metrics["shaded_large_begun"] == begun and metrics["shaded_queue_depth"] == count
                and metrics["shaded_queue_large"] == count)

    wait_until(reached)


def occupied(daemon):
    """A client that keeps the daemon's only worker until it leaves; others wait meanwhile, however
    slow the machine is, and are read between two tiles."""
    # What was answered may not have ended yet, and would be taken for it.
    wait_until(lambda: daemon.metrics()["shaded_large_begun"] == 0)
    client = Client(daemon, ENDLESS)
    wait_until_read(daemon, 0)
    return client


def has_ipv6():
    try:
        with socket.socket(socket.AF_INET6) as probe:
            probe.bind(("::1", 0))
        return True
    except OSError:
        return False


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def file(self, text, name="shaded.conf"):
        path = self.folder / name
        path.write_text(text)
        return str(path)


class OptionsTest(Folder):
    def body_limit(self, *flags, env=None):
        """The value of max-body that a daemon with these options has."""
        with Daemon(*flags, env=env) as daemon:
            detail = json.loads(daemon.render(b"x" * 2000).body)["detail"]
        found = re.search(r"the limit `body` is (\d+)", detail)
        return int(found.group(1)) if found else None

    def test_flags_win_over_environment_over_file_over_defaults(self):
        path = self.file("max-body = 1000\n")
        self.assertIsNone(self.body_limit())
        self.assertEqual(self.body_limit("--config", path), 1000)
        self.assertEqual(self.body_limit(env={"SHADED_CONFIG": path}), 1000)
        env = {"SHADED_MAX_BODY": "1K", "SHADED_CONFIG": path}
        self.assertEqual(self.body_limit(env=env), 1024)
        self.assertEqual(self.body_limit("--max-body", "1500", env=env), 1500)
        self.assertEqual(self.body_limit("--max-body=1501", env=env), 1501)
        self.assertEqual(self.body_limit(env={**env, "SHADED_MAX_BODY": ""}), 1000)

    def test_the_file_may_be_commented_and_indented(self):
        path = self.file("# a comment\n; another\n\n  max-body = 900 ; inline\n\tqueue=3\r\n"
                         "threads : 1\n")
        self.assertEqual(self.body_limit("--config", path), 900)

    def test_unknown_variables_are_somebody_elses(self):
        self.assertIsNone(self.body_limit(env={"SHADED_PORT": "tcp://10.0.0.1:80"}))

    def test_help_lists_every_option_and_the_sample_shows_its_default(self):
        status, text, _ = run("--help")
        self.assertEqual(status, 0)
        listed = dict(re.findall(r"^  --([a-z-]+) (?:[^\[\n]|\[::1\])*(?:\[([^\]\n]*)\])?$", text,
                                 re.MULTILINE))
        for no_option in "config", "ready":
            listed.pop(no_option)
        sample = (SOURCE / "config/shaded.conf").read_text()
        shown = dict(re.findall(r"^([a-z-]+) = (.*)$", sample, re.MULTILINE))
        without = ("ocio", "materials", "tokens", "admin-tokens", "preview-keys", "cors-origins",
                   "trusted-proxies", "scenes-folder", "assets")
        for name in without:
            self.assertIn(f"\n; {name} = ", sample)
        self.assertEqual({**shown, **dict.fromkeys(without, "")}, listed)
        for name in listed:
            self.assertLess(len(name), 40)
        with Daemon("--config", str(SOURCE / "config/shaded.conf")) as daemon:
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_version(self):
        status, text, _ = run("--version")
        self.assertEqual(status, 0)
        self.assertRegex(text, r"^shaded \d+\.\d+\.\d+\n$")

    def assert_refused(self, done, status, *words):
        self.assertEqual(done[0], status, done[2])
        self.assertEqual(done[1], "")
        self.assertEqual(done[2].count("\n"), 1, done[2])
        for word in words:
            self.assertIn(word, done[2])

    def test_bad_flags_exit_2_and_are_named(self):
        for flags in (["--queue", "x"], ["--queue", "0"], ["--queue", "-1"], ["--queue", ""],
                      ["--queue", "1K"], ["--queue", "99999999999999999999"],
                      ["--threads", "1025"], ["--max-body", "1T"], ["--max-body", "1KK"],
                      ["--max-body", "99999999999G"], ["--timeout", "1.5"],
                      ["--log-requests", "yes"], ["--cache-control", "a\nb"],
                      ["--cache-control", ""], ["--cache-control", " "], ["--kernel", ""],
                      ["--ocio", "x" * 5000], ["--nothing", "1"], ["--queue"]):
            self.assert_refused(run(*flags), 2, flags[0])
        self.assert_refused(run("-z"), 2, "-z")
        self.assert_refused(run("extra"), 2, "extra")

    def test_bad_variables_exit_1_and_are_named(self):
        self.assert_refused(run(env={"SHADED_QUEUE": "many"}), 1, "SHADED_QUEUE", "many")

    def test_bad_files_exit_1_and_the_line_is_named(self):
        for text, place, *words in (
                ("\nqueue = many\n", ":2:", "queue", "many"),
                ("queue = 1\nquue = 1\n", ":2:", "quue"), ("nonsense\n", ":1:"),
                ("queue = 1\n[server]\nthreads = 1\n", ":3:", "[server]"),
                ("#\n#\nocio = " + "x" * 300 + "\n", ":3:", "longer"),
                ("config = x\n", ":1:", "config")):
            path = self.file(text)
            self.assert_refused(run("--config", path), 1, path + place, *words)
        missing = str(self.folder / "missing.conf")
        self.assert_refused(run("--config", missing), 1, missing, "No such file")
        self.assert_refused(run("--config", str(self.folder)), 1, str(self.folder))


class StartTest(Folder):
    def assert_cannot_start(self, done, where, *words):
        status, _, stderr = done
        self.assertEqual(status, 1, stderr)
        event = json.loads(stderr.splitlines()[-1])
        self.assertEqual((event["event"], event["level"]), ("cannot-start", "error"))
        self.assertEqual(event.get("where", ""), where)
        for word in words:
            self.assertIn(word, event["message"])

    def test_kernel(self):
        self.assert_cannot_start(run("--kernel", "avx3"), "", "avx3")
        with Daemon(env={"SHADED_KERNEL": "portable"}) as daemon:
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_addresses(self):
        for address, pattern in (("localhost:0", r"(127\.0\.0\.1|\[::1\]):\d+"),
                                 ("127.0.0.1:0", r"127\.0\.0\.1:\d+"), ("[::1]:0", r"\[::1\]:\d+")):
            if "::" in address and not has_ipv6():
                continue
            with Daemon(listen=address, admin=address) as daemon:
                event = daemon.wait_for("listening")
                self.assertRegex(event["address"], f"^{pattern}$")
                self.assertNotEqual(event["address"], event["admin"])
                self.assertEqual(daemon.render(SMALL).status, 200)
                self.assertEqual(daemon.get("/readyz", admin=True).status, 200)

    def asked(self, address, path="/v1/version"):
        connection = connect(address)
        try:
            connection.request("GET", path, headers={"Host": "a"})
            return connection.getresponse().status
        finally:
            connection.close()

    def test_several_addresses_and_unix_sockets(self):
        place = f"{self.folder}/socket"
        for flags in (("--listen", f"unix:{place}"), ("--listen", f"unix:{place} 127.0.0.1:0"),
                      ("--listen", "127.0.0.1:0", "--listen", f"unix:{place}", "--listen",
                       "127.0.0.1:0,127.0.0.1:0")):
            with Daemon(*flags, listen=None) as daemon:
                self.assertIn(place, daemon.addresses)
                self.assertTrue(stat.S_ISSOCK(os.stat(place).st_mode))
                for address in daemon.addresses * 3:
                    self.assertEqual(self.asked(address), 200)
                events = daemon.events("request")
                wait_until(lambda d=daemon: {event["client"] for event in d.events("request")} >=
                           {"unix"})
                self.assertLessEqual({event["client"] for event in events}, {"unix", "127.0.0.1"})
                # Another one is told, and leaves the first one's socket alone.
                status, _, stderr = run("--listen", f"unix:{place}", "--admin", "off")
                self.assertEqual(status, 1)
                self.assertIn("Address already in use", stderr)
                self.assertEqual(self.asked(place), 200)
            self.assertFalse(os.path.exists(place))

    def test_a_unix_socket_that_was_left_is_replaced(self):
        place = f"{self.folder}/socket"
        daemon = Daemon("--listen", f"unix:{place}", listen=None)
        daemon.process.kill()
        daemon.wait()
        self.assertTrue(os.path.exists(place))
        with Daemon("--listen", f"unix:{place}", listen=None):
            self.assertEqual(self.asked(place), 200)
        # What is no socket is somebody's.
        Path(place).write_text("dear")
        status, _, stderr = run("--listen", f"unix:{place}", "--admin", "off")
        self.assertEqual((status, Path(place).read_text()), (1, "dear"))
        self.assertIn("Address already in use", stderr)
        for wrong in "unix:relative", "unix:", "unix:/" + "a" * 200, "", ",", "127.0.0.1:0," * 9:
            status, _, stderr = run("--listen", wrong, "--admin", "off")
            self.assertEqual(status, 1, wrong)

    def test_all_addresses_are_served_to_the_end(self):
        place = f"{self.folder}/socket"
        daemon = Daemon("--listen", f"127.0.0.1:0 127.0.0.1:0 unix:{place}", "--drain-time", "300",
                        listen=None)
        daemon.signal(signal.SIGSTOP)
        clients = [connect(address) for address in daemon.addresses * 10]
        for client in clients:
            client.request("POST", "/v1/render", json.dumps(SMALL), JSON)
        daemon.signal()
        daemon.signal(signal.SIGCONT)
        for client in clients:
            self.assertIn(client.getresponse().status, (200, 503))
            client.close()
        self.assertEqual(daemon.wait(), 0, daemon.stderr())
        self.assertFalse(os.path.exists(place))

    def test_bad_addresses(self):
        for address in ("", "8080", "localhost", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:65536",
                        "::1:80", "[::1]", "[::1:80", "127.0.0.1:-1", "1.2.3.4.5:80:90"):
            self.assert_cannot_start(run("--listen", address), address or "listen")
            if address:
                self.assert_cannot_start(
                    run("--listen", "127.0.0.1:0", "--admin", address), address)

    def test_an_address_in_use_is_named(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            taken = f"127.0.0.1:{other.getsockname()[1]}"
            self.assert_cannot_start(run("--listen", taken), taken, "in use")
            self.assert_cannot_start(run("--listen", "127.0.0.1:0", "--admin", taken), taken)

    def test_the_admin_port_may_be_off(self):
        with Daemon(admin="off") as daemon:
            self.assertIsNone(daemon.admin)
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_a_bad_color_configuration_stops_the_start(self):
        self.assert_cannot_start(run("--listen", "127.0.0.1:0", "--admin", "off", "--ocio",
                                     "/nonexistent.ocio"), "/nonexistent.ocio")
        good = (SOURCE / "config/shaded.ocio").read_text()
        for text in ("", "nonsense: [", "ocio_profile_version: 9\n",
                     good.replace("scene_linear:", "other_role:"), good[:len(good) // 2]):
            path = self.file(text, "bad.ocio")
            self.assert_cannot_start(
                run("--listen", "127.0.0.1:0", "--admin", "off", "--ocio", path), path)

    def test_another_color_configuration_is_used(self):
        good = (SOURCE / "config/shaded.ocio").read_text()
        path = self.file(good, "good.ocio")
        with Daemon("--ocio", path) as daemon:
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_a_bad_file_of_materials_stops_the_start(self):
        good = {"group": "house", "source": "ours", "material": {"diffuse": 0.5}}
        for files, place in (({}, "No such file"), ([], "expected an object"), ({"materials": {"brass": good}}, "/materials/brass"),
                             ({"materials": {"a": {**good, "material": {"shinines": 1}}}},
                              "/materials/a/material/shinines"),
                             ({"materials": {"a": {**good, "material": {"model": "westin"}}}}, "microgeometry"),
                             ({"materials": {"a": {**good, "material": {"preset": "gold"}}}},
                              "/materials/a/material/preset"),
                             ({"materials": {"a": {"material": {}}}}, "/materials/a"),
                             ({"materials": {"a": {**good, "encoding": "xyz"}}}, "/materials/a/encoding")):
            with self.subTest(place=place):
                path = self.file(json.dumps(files), "bad.json") if files != {} else "/nonexistent.json"
                self.assert_cannot_start(
                    run("--listen", "127.0.0.1:0", "--admin", "off", "--materials", path), path, place)

    def test_files_of_materials_are_used(self):
        entry = {"group": "house", "source": "ours", "note": "blue", "material": {"diffuse": "#00f"}}
        paths = [self.file(json.dumps({"materials": {name: entry}}), name + ".json") for name in ("a1", "a2")]
        with Daemon("--materials", paths[0], "--materials", paths[1]) as daemon:
            scene = json.dumps({"objects": [{"type": "sphere", "material": "a1"},
                                            {"type": "torus", "material": {"preset": "a2"}}]})
            self.assertEqual(daemon.render(scene).status, 200)
            told = {m["name"]: m for m in json.loads(daemon.get("/v1/materials").body)["materials"]}
            self.assertEqual([told[name]["group"] for name in ("a1", "a2")], ["house"] * 2)
            self.assertEqual((told["a1"]["diffuse"], told["a1"]["source"], told["a1"]["note"]), ([0, 0, 1], "ours", "blue"))


class StopTest(unittest.TestCase):
    def test_sigterm_and_sigint_stop_an_idle_daemon(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            daemon = Daemon()
            idle = socket.create_connection(daemon.address, PATIENCE)
            daemon.signal(number)
            self.assertEqual(daemon.wait(), 0, daemon.stderr())
            self.assertEqual([event["event"] for event in daemon.events()],
                             ["machine", "memory", "listening", "stopping", "stopped"])
            idle.close()

    def test_signals_that_mean_nothing_end_nothing(self):
        with Daemon() as daemon:
            for number in signal.SIGUSR1, signal.SIGUSR2, signal.SIGPIPE, signal.SIGXFSZ:
                daemon.signal(number)
            self.assertEqual(daemon.render(SMALL).status, 200)

    def test_closed_streams_go_to_no_client(self):
        """Else the log would be written to the first socket or file that is opened."""
        with socket.create_server(("127.0.0.1", 0)) as probe:
            port = probe.getsockname()[1]
        process = subprocess.Popen(
            ["bash", "-c", 'exec "$0" "$@" <&- >&- 2>&-', SHADED, "--listen", f"127.0.0.1:{port}",
             "--admin", "off"], env=environment())
        try:
            files = {}

            def started():
                nonlocal files
                self.assertIsNone(process.poll())
                folder = f"/proc/{process.pid}/fd"
                try:
                    files = {fd: os.readlink(f"{folder}/{fd}") for fd in os.listdir(folder)}
                except FileNotFoundError:  # one was closed between the two calls
                    return False
                return any(name.startswith("socket:") for name in files.values())

            wait_until(started)
            self.assertEqual([files[fd] for fd in "012"], ["/dev/null"] * 3)
        finally:
            process.kill()
            process.wait()

    def test_sigterm_finishes_what_is_accepted_and_refuses_more(self):
        daemon = Daemon("--threads", "1", "--queue", "4", "--timeout", "300", "--drain-time",
                        "300")
        running = occupied(daemon)
        queued = [Background(daemon, SLOW), Background(daemon, another(SLOW))]
        wait_until_read(daemon, 2)
        self.assertEqual(daemon.get("/readyz", admin=True).status, 200)

        daemon.signal()
        wait_until(lambda: daemon.get("/readyz", admin=True).status == 503)
        self.assertEqual(daemon.get("/healthz", admin=True).status, 200)
        self.assertEqual(daemon.metrics()["shaded_draining"], 1)
        refused = daemon.render(SMALL)
        self.assertEqual(refused.status, 503)
        self.assertEqual(json.loads(refused.body)["type"], "urn:shaded:problem:draining")
        self.assertEqual(refused.headers["Connection"].lower(), "close")
        self.assertRegex(refused.headers["Retry-After"], r"^\d+$")
        self.assertEqual(refused.headers["Cache-Control"], "no-store")
        read = daemon.get("/v1/version")
        self.assertEqual((read.status, read.headers["Connection"].lower()), (200, "close"))

        running.leave()
        for request in queued:
            answer = request.result()
            self.assertEqual(answer.status, 200)
            self.assertTrue(answer.body.startswith(b"\x89PNG"))
        self.assertEqual(daemon.wait(), 0, daemon.stderr())
        self.assertNotIn("Sanitizer", daemon.stderr())

    def assert_answered(self, connection):
        """With a picture where it came before the signal."""
        with connection.getresponse() as answer:
            body = answer.read()
            if answer.status == 200:
                self.assertTrue(body.startswith(b"\x89PNG"))
                return
            self.assertEqual(answer.status, 503)
            self.assertEqual(answer.headers["Connection"].lower(), "close")
            self.assertEqual(json.loads(body)["type"], "urn:shaded:problem:draining")

    def test_what_has_reached_its_sockets_is_answered_before_it_ends(self):
        daemon = Daemon("--drain-time", "300", "--max-connections-each", "1000")
        connections = [http.client.HTTPConnection(*daemon.address, timeout=500)
                       for _ in range(300)]
        for connection in connections[:10]:  # these rest between two requests, others are new
            connection.request("GET", "/v1/version")
            connection.getresponse().read()
        daemon.signal(signal.SIGSTOP)
        for connection in connections:
            connection.request("POST", "/v1/render", json.dumps(SMALL), JSON)
        daemon.signal()
        daemon.signal(signal.SIGCONT)
        for connection in connections:
            self.assert_answered(connection)
            connection.close()
        self.assertEqual(daemon.wait(), 0, daemon.stderr())
        self.assertEqual(daemon.events()[-1]["message"], "all requests are answered")

    def test_who_is_connected_may_still_ask(self):
        def attempt():
            daemon = Daemon()
            with contextlib.closing(http.client.HTTPConnection(*daemon.address)) as connection:
                connection.connect()
                began = time.monotonic()
                daemon.signal()
                daemon.wait_for("stopping")
                time.sleep(0.1)
                try:
                    connection.request("POST", "/v1/render", json.dumps(SMALL), JSON)
                    self.assert_answered(connection)
                except OSError:
                    # It waits for a second, which a busy machine may let pass.
                    self.assertGreater(time.monotonic() - began, 1)
                finally:
                    self.assertEqual(daemon.wait(), 0, daemon.stderr())

        for _ in range(3):
            attempt()

    def test_over_the_drain_time_requests_are_cancelled_and_answered(self):
        daemon = Daemon("--threads", "1", "--drain-time", "1", "--timeout", "300")
        requests = [Background(daemon, ENDLESS), Background(daemon, another(ENDLESS))]
        wait_until_read(daemon, 1)
        daemon.signal()
        self.assertEqual(daemon.wait(), 0, daemon.stderr())
        for request in requests:
            answer = request.result()
            self.assertEqual(answer.status, 503)
            self.assertEqual(json.loads(answer.body)["type"], "urn:shaded:problem:draining")
        self.assertNotIn("Sanitizer", daemon.stderr())

    def test_clients_that_still_send_are_not_waited_for_long(self):
        daemon = Daemon("--drain-time", "300", "--idle-timeout", "300")
        with socket.create_connection(daemon.address, 500) as slow:
            slow.sendall(b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Type: application/json"
                         b"\r\nContent-Length: 100\r\n\r\n{")
            wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 1)
            daemon.signal()
            self.assertEqual(daemon.wait(), 0, daemon.stderr())
            self.assertEqual(daemon.events()[-1]["message"], "requests that are not answered: 1")

    def test_a_second_signal_exits_at_once(self):
        daemon = Daemon("--drain-time", "300", "--timeout", "300")
        request = Background(daemon, ENDLESS)
        wait_until_busy(daemon)
        daemon.signal()
        daemon.wait_for("stopping")
        daemon.signal(signal.SIGINT)
        self.assertEqual(daemon.wait(), 1)
        request.thread.join()
        self.assertIsNone(request.answer)

    def setUp(self):
        # A background request whose daemon exits dies with its connection: that is the test.
        previous = threading.excepthook
        threading.excepthook = lambda args: None
        self.addCleanup(setattr, threading, "excepthook", previous)


class LoadTest(unittest.TestCase):
    def test_a_full_queue_is_429(self):
        with Daemon("--threads", "1", "--queue", "1", "--timeout", "300") as daemon:
            running = occupied(daemon)
            queued = Client(daemon, another(ENDLESS))
            wait_until_read(daemon, 1)
            refused = daemon.render(SMALL)
            self.assertEqual(refused.status, 429)
            self.assertEqual(json.loads(refused.body)["type"], "urn:shaded:problem:busy")
            self.assertIn("`queue`", json.loads(refused.body)["detail"])
            self.assertRegex(refused.headers["Retry-After"], r"^\d+$")
            self.assertEqual(refused.headers["Cache-Control"], "no-store")
            # What needs no worker is not held up.
            self.assertEqual(daemon.get("/v1/version").status, 200)
            self.assertEqual(daemon.get("/healthz", admin=True).status, 200)
            running.leave()
            queued.leave()
            wait_until(lambda: daemon.render(SMALL).status == 200)
            refused = 'shaded_requests_total{route="/v1/render",status="429"}'
            wait_until(lambda: daemon.metrics().get(refused, 0) >= 1)

    def test_a_request_that_takes_too_long_is_504(self):
        with Daemon("--threads", "1", "--timeout", "1") as daemon:
            began = time.monotonic()
            late = Background(daemon, ENDLESS)
            waiting = Background(daemon, SMALL)
            for request in (late, waiting):
                answer = request.result()
                if request is waiting and answer.status == 200:
                    continue  # it came late enough to be in time
                self.assertEqual(answer.status, 504)
                self.assertEqual(json.loads(answer.body)["type"], "urn:shaded:problem:deadline")
                self.assertIn("`timeout`", json.loads(answer.body)["detail"])
                self.assertIsNone(answer.headers["Retry-After"])
                self.assertEqual(answer.headers["Cache-Control"], "no-store")
            self.assertGreater(time.monotonic() - began, 0.9)
            wait_until(lambda: daemon.render(SMALL).status == 200)

    def test_idle_connections_are_closed(self):
        with Daemon("--idle-timeout", "1") as daemon:
            self.assertEqual(daemon.raw(b"POST /v1/render HTTP/1.1\r\nHost: a\r\n"), b"")

    def test_descriptors_are_given_back(self):
        with Daemon() as daemon:
            def descriptors():
                return len(list(Path(f"/proc/{daemon.pid}/fd").iterdir()))

            daemon.render(SMALL)
            daemon.metrics()
            wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)
            before = descriptors()
            for _ in range(30):
                daemon.render(SMALL)
                daemon.render(b"x")
                daemon.call("POST", "/v1/render", b"x" * 100, {**JSON, "Expect": "100-continue",
                                                               "Accept": "text/plain"})
            wait_until(lambda: descriptors() <= before)


class InsideTest(unittest.TestCase):
    def test_openimageio_is_loaded_when_a_format_needs_it(self):
        with Daemon() as daemon:
            def maps():
                return Path(f"/proc/{daemon.pid}/maps").read_text()

            for name in ("png", "jpeg"):
                self.assertEqual(
                    daemon.render({**SMALL, "output": {"format": name}}).status, 200)
            self.assertNotIn("OpenImageIO", maps())
            self.assertEqual(daemon.render({**SMALL, "output": {"format": "exr"}}).status, 200)
            self.assertIn("OpenImageIO", maps())

    def test_metrics_count_requests_and_stages(self):
        with Daemon() as daemon:
            for number in range(3):
                daemon.render({**SMALL, "ambient": number / 3})
            daemon.render(b"{}")
            daemon.get("/nothing")
            daemon.get("/v1/version")
            daemon.call("HEAD", "/v1/version")
            wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)
            answer = daemon.get("/metrics", admin=True)
            self.assertEqual(answer.headers["Content-Type"], "text/plain; version=0.0.4")
            metrics = daemon.metrics()
        requests = {name: value for name, value in metrics.items()
                    if name.startswith("shaded_requests_total")}
        # Of the others there are lines, too, for what begins with 1 has not increased.
        self.assertEqual(requests['shaded_requests_total{route="/v1/render",status="500"}'], 0)
        self.assertEqual({name: value for name, value in requests.items() if value}, {
            'shaded_requests_total{route="/v1/render",status="200"}': 3,
            'shaded_requests_total{route="/v1/render",status="422"}': 1,
            'shaded_requests_total{route="/v1/version",status="200"}': 2,
            'shaded_requests_total{route="other",status="404"}': 1})
        duration = 'shaded_request_duration_seconds_%s{route="/v1/render"%s}'
        self.assertEqual(metrics[duration % ("count", "")], 4)
        self.assertEqual(metrics[duration % ("bucket", ',le="+Inf"')], 4)
        self.assertGreaterEqual(metrics[duration % ("sum", "")], 0)
        for stage in ("parse", "plan", "visibility", "shade", "color", "encode"):
            name = f'shaded_stage_duration_seconds_%s{{stage="{stage}"}}'
            self.assertEqual(metrics[name % "count"], 3)
        self.assertEqual(metrics['shaded_stage_duration_seconds_count{stage="queue"}'], 4)
        self.assertGreater(metrics["shaded_response_bytes_total"], 0)
        self.assertEqual(metrics["shaded_queue_depth"], 0)
        self.assertGreaterEqual(metrics["shaded_workers"], 1)
        self.assert_text_format(answer.body.decode())

    def assert_text_format(self, text):
        """Every sample belongs to a family that was announced, buckets only grow."""
        kinds, last = {}, None
        for line in text.splitlines():
            if line.startswith("# TYPE "):
                _, _, name, kind = line.split(" ")
                self.assertNotIn(name, kinds)
                kinds[name] = kind
            if line.startswith("#"):
                continue
            self.assertRegex(line, r'^[a-z_]+(\{[a-z]+="[^"]*"(,[a-z]+="[^"]*")*\})? [0-9.]+$')
            name = re.split(r"[{ ]", line)[0]
            family = re.sub("_(bucket|sum|count)$", "", name)
            kind = kinds.get(name) or kinds[family]
            if kind == "counter":
                self.assertTrue(name.endswith("_total"))
            if name.endswith("_bucket"):
                series, value = line.split(',le="')[0], float(line.split(" ")[-1])
                if last and last[0] == series:
                    self.assertGreaterEqual(value, last[1])
                last = (series, value)

    def test_the_version_tells_the_kernel(self):
        with Daemon("--kernel", "portable") as daemon:
            version = json.loads(daemon.get("/v1/version").body)
            self.assertIn(version["kernel"], ("portable", "neon"))
            self.assertIn(version["build"], ("release", "debug"))

    def test_refusals_are_counted_by_their_limit(self):
        with Daemon("--max-body", "5000", "--max-pixels", "300", "--max-lights", "1",
                    "--max-samples", "1000") as daemon:
            for scene in ({**SMALL, "image": {"width": 301, "height": 1, "samples": 1}},
                          {**SMALL, "image": {"width": 300, "height": 1, "samples": 4}},
                          {**SMALL, "lights": [{"type": "point"}] * 2}, b" " * 5001, b" " * 5001):
                self.assertIn(daemon.render(scene).status, (413, 422))
            # A client's text is no limit.
            daemon.render({**SMALL, "objects": [{"type": "the limit `queue`"}]})
            self.assertEqual(daemon.render(SMALL).status, 200)
            metrics = daemon.metrics()
            counts = {name.split('"')[1]: int(value) for name, value in metrics.items()
                      if name.startswith("shaded_refused_total")}
            self.assertEqual({name: count for name, count in counts.items() if count},
                             {"pixels": 1, "samples": 1, "lights": 1, "body": 2})
            most = metrics["shaded_request_memory_high_water_bytes"]
            self.assertGreater(most, 50000)
            self.assertLess(most, 1 << 30)

    def test_the_admin_port_answers_what_it_has(self):
        with Daemon() as daemon:
            for path, body in (("/healthz", b"ok\n"), ("/readyz", b"ready\n")):
                answer = daemon.get(path, admin=True)
                self.assertEqual((answer.status, answer.body), (200, body))
                self.assertEqual(answer.headers["Cache-Control"], "no-store")
                self.assertEqual(daemon.call("HEAD", path, admin=True).status, 200)
                wrong = daemon.call("POST", path, b"x", admin=True)
                self.assertEqual((wrong.status, wrong.headers["Allow"]), (405, "GET, HEAD"))
            self.assertEqual(daemon.get("/v1/render", admin=True).status, 404)

    def test_requests_are_logged_without_their_bodies(self):
        with Daemon() as daemon:
            daemon.render(b'{"hush": "secret-in-the-body"}', {"X-Request-Id": "logged"})
            event = daemon.wait_for("request", lambda event: event["id"] == "logged")
            event = dict(event)
            self.assertRegex(event.pop("time"), r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
            self.assertGreaterEqual(event.pop("ms"), 0)
            self.assertGreater(event.pop("bytes"), 100)
            self.assertEqual(event, {"level": "info", "event": "request", "id": "logged",
                                     "client": "127.0.0.1",
                                     "method": "POST", "path": "/v1/render", "status": 422,
                                     "problem": "scene"})
            daemon.get("/v1/version?token=secret-in-the-query")
            daemon.wait_for("request", lambda event: event["path"] == "/v1/version")
            self.assertNotIn("secret", daemon.stderr())

    def test_lines_that_nobody_reads_are_counted(self):
        reads, writes = os.pipe()
        fcntl.fcntl(writes, fcntl.F_SETPIPE_SZ, 16384)
        with subprocess.Popen([SHADED, "--listen", "127.0.0.1:0", "--admin", "off"],
                              stdin=subprocess.DEVNULL, stderr=writes,
                              env=environment()) as process, open(reads, "rb") as log:
            os.close(writes)
            started = json.loads(log.readline())
            while started["event"] != "listening":
                started = json.loads(log.readline())
            host, port = started["address"].rsplit(":", 1)

            def ask():
                connection = http.client.HTTPConnection(host, int(port), timeout=PATIENCE)
                connection.request("GET", "/v1/shapes")
                connection.getresponse().read()
                connection.close()

            for _ in range(200):  # the pipe holds half of these
                ask()
            # A pipe takes more when one of its pages was read.
            lines = [json.loads(log.readline()) for _ in range(60)]
            ask()
            process.terminate()
            lines += map(json.loads, log.read().splitlines())
            self.assertEqual(process.wait(PATIENCE), 0)
        lost = sum(line["lines"] for line in lines if line["event"] == "log-lost")
        written = sum(line["event"] == "request" for line in lines)
        self.assertGreater(lost, 0)
        self.assertEqual(written + lost, 201)

    def test_requests_are_logged_with_what_came_of_them(self):
        with Daemon("--threads", "1", "--timeout", "300") as daemon:
            def logged(scene, **headers):
                answer = daemon.render(scene, headers)
                name = answer.headers["X-Request-Id"]
                return answer, daemon.wait_for("request", lambda event: event["id"] == name)

            answer, miss = logged(SMALL)
            self.assertEqual(miss["cache"], "miss")
            for stage, dur in re.findall(r"(\w+);dur=([\d.]+)", answer.headers["Server-Timing"]):
                self.assertEqual(miss[stage + "_ms"], float(dur))
            self.assertLess({"queue_ms", "parse_ms", "visibility_ms", "shade_ms", "encode_ms"},
                            set(miss))
            self.assertEqual(logged(SMALL)[1]["cache"], "hit")
            other = {**SMALL, "output": {"format": "jpeg"}}
            self.assertEqual(logged(other)[1]["cache"], "reuse")
            known = logged(SMALL, **{"If-None-Match": answer.headers["ETag"]})[1]
            self.assertEqual((known["status"], known["cache"]), (304, "304"))
            running = occupied(daemon)
            # The oldest has waited since before now.
            wait_until(lambda: daemon.metrics()["shaded_oldest_request_seconds"] > 0)
            together = [Background(daemon, SLOW), Background(daemon, SLOW)]
            wait_until(lambda: daemon.metrics()["shaded_joined_total"] == 1)
            running.leave()
            for request in together:
                self.assertEqual(request.result().status, 200)
            wait_until(lambda: sorted(event["cache"] for event in daemon.events("request")
                                      if event["status"] == 200)
                       == ["hit", "join", "miss", "miss", "reuse"])
            self.assertEqual(logged(b"{")[1]["problem"], "syntax")

    def test_traces_go_to_the_log(self):
        trace, parent = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"
        good = (f"00-{trace}-{parent}-01", f"00-{trace}-{parent}-00", f"cc-{trace}-{parent}-01",
                f"cc-{trace}-{parent}-01-what-the-future-holds", f"00-{trace}-{parent}-ff")
        bad = (f"ff-{trace}-{parent}-01", f"00-{trace}-{parent}-01-x", f"00-{trace}-{parent}",
               f"00-{'0' * 32}-{parent}-01", f"00-{trace}-{'0' * 16}-01", "", "00", "-" * 55,
               f"00-{trace.upper()}-{parent}-01", f"00-{trace[1:]}-{parent}-01x",
               f"0x-{trace}-{parent}-01",
               f"00-{trace}-{parent}-0g", f"cc-{trace}-{parent}-011", f"00_{trace}-{parent}-01",
               f"00-{trace}_{parent}-01", f"00-{trace[:31]}g-{parent}-01")
        with Daemon() as daemon:
            for number, field in enumerate(good + bad):
                daemon.get("/", {"traceparent": field, "X-Request-Id": str(number)})
                event = daemon.wait_for("request", lambda event, n=number: event["id"] == str(n))
                told = (trace, parent) if field in good else (None, None)
                self.assertEqual((event.get("trace"), event.get("parent")), told, field)
            twice = f"traceparent: {good[0]}\r\n".encode() * 2
            daemon.raw(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\nX-Request-Id: twice\r\n"
                       + twice + b"\r\n")
            self.assertNotIn("trace", daemon.wait_for("request", lambda e: e["id"] == "twice"))

    def test_metrics_tell_of_the_process(self):
        with Daemon() as daemon:
            tick = os.sysconf("SC_CLK_TCK")
            metrics = daemon.metrics()
            stat = Path(f"/proc/{daemon.pid}/stat").read_text().rpartition(")")[2].split()
            self.assertLessEqual(metrics["process_cpu_seconds_total"],
                                 (int(stat[11]) + int(stat[12])) / tick)
            self.assertEqual(metrics["process_threads"], int(stat[17]))
            with open("/proc/stat", encoding="ascii") as file:
                boot = int(re.search(r"^btime (\d+)$", file.read(), re.MULTILINE)[1])
            started = boot + int(stat[19]) / tick
            self.assertLess(abs(metrics["process_start_time_seconds"] - started), 5)
            self.assertGreater(metrics["process_resident_memory_bytes"], 1 << 20)
            self.assertGreater(metrics["process_virtual_memory_bytes"],
                               metrics["process_resident_memory_bytes"])
            # The connection that asks is one of them.
            here = len(os.listdir(f"/proc/{daemon.pid}/fd"))
            self.assertIn(metrics["process_open_fds"], (here, here + 1))
            limits = Path(f"/proc/{daemon.pid}/limits").read_text()
            most = re.search(r"^Max open files +(\d+)", limits, re.MULTILINE)[1]
            self.assertEqual(metrics["process_max_fds"], int(most))

    def test_answers_that_are_not_taken_are_told(self):
        large = {"objects": [{"type": "plane"}], "camera": {"position": [0, 1, 3]},
                 "lights": [{"position": [1, 2, 3, 1]}],
                 "image": {"width": 800, "height": 800, "samples": 1},
                 "outputs": [{"name": str(i), "format": "tiff", "bitDepth": "float",
                              "colorSpace": "lin_rec709"} for i in range(8)]}
        with Daemon("--timeout", "600", "--send-time", "600") as daemon:
            with socket.socket() as client:
                client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
                client.connect(daemon.address)
                body = json.dumps(large).encode()
                client.sendall(b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Length: %d\r\n"
                               b"Content-Type: application/json\r\n\r\n%s" % (len(body), body))
                wait_until(lambda: daemon.metrics()["shaded_unsent_bytes"] > 5_000_000)
            wait_until(lambda: daemon.metrics()["shaded_unsent_bytes"] == 0)

    def test_request_logs_may_be_off(self):
        with Daemon("--log-requests", "off") as daemon:
            daemon.render(SMALL)
            wait_until(lambda: daemon.metrics()["shaded_requests_in_flight"] == 0)
            self.assertEqual(daemon.events("request"), [])


if __name__ == "__main__":
    unittest.main()
