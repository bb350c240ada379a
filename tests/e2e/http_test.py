"""HTTP itself: paths, methods, media types, bodies, framing, connections."""

import gzip
import http.client
import json
import socket
import threading
import unittest
from urllib.parse import quote

from e2e.daemon import JSON, SMALL, Daemon, receive_all

READ = ["/", "/v1/materials", "/v1/shapes", "/v1/colorspaces", "/v1/version", "/openapi.yaml",
        "/openapi.json", "/scene.schema.json"]
BODY = json.dumps(SMALL).encode()


def post(*fields, body=BODY, path=b"/v1/render", length=True):
    head = [b"POST " + path + b" HTTP/1.1", b"Host: localhost",
            b"Content-Type: application/json", *fields]
    if length:
        head.append(b"Content-Length: %d" % len(body))
    return b"\r\n".join(head) + b"\r\n\r\n" + body


class HttpTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--max-body", "100000")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def assert_problem(self, answer, status, name, *words):
        self.assertEqual(answer.status, status, answer.body)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        self.assertEqual(answer.headers["Cache-Control"], "no-store")
        self.assertRegex(answer.headers["X-Request-Id"], "^[A-Za-z0-9._-]{1,64}$")
        problem = json.loads(answer.body)
        self.assertEqual(problem["type"], f"urn:shaded:problem:{name}")
        self.assertEqual(problem["status"], status)
        self.assertTrue(problem["title"])
        for word in words:
            self.assertIn(word, problem["detail"])
        return problem

    def assert_raw_problem(self, data, status, name):
        head, _, body = data.partition(b"\r\n\r\n")
        self.assertTrue(head.startswith(b"HTTP/1.1 %d " % status), data)
        self.assertIn(b"\r\nContent-Type: application/problem+json", head)
        self.assertIn(b"\r\nConnection: close", head)
        self.assertIn(b"\r\nX-Request-Id: ", head)
        self.assertRegex(head, rb"\r\nDate: \w{3}, \d\d \w{3} \d{4} \d\d:\d\d:\d\d GMT\r\n")
        self.assertEqual(json.loads(body)["type"], f"urn:shaded:problem:{name}")

    # ---- Paths and methods ----

    def test_documents_have_tags_and_are_revalidated(self):
        for path in READ:
            with self.subTest(path):
                answer = self.daemon.get(path)
                self.assertEqual(answer.status, 200)
                self.assertRegex(answer.headers["ETag"], '^"[0-9a-f]{16}"$')
                self.assertEqual(answer.headers["Cache-Control"], "no-cache")
                tag = answer.headers["ETag"]
                for condition in (tag, "W/" + tag, '"other", ' + tag, "*"):
                    again = self.daemon.get(path, {"If-None-Match": condition})
                    self.assertEqual((again.status, again.body), (304, b""), condition)
                    self.assertEqual(again.headers["ETag"], tag)
                for condition in ('"other"', tag[1:-1], "W/", '""'):
                    again = self.daemon.get(path, {"If-None-Match": condition})
                    self.assertEqual(again.body, answer.body, condition)

    def test_documents_are_compressed_where_asked_for(self):
        coded = ("gzip", "GZip", "x-gzip", "deflate, gzip;q=0.5", "*", "gzip;q=0.5, identity;q=0.5",
                 "br;q=1.0, gzip;q=0.8, *;q=0.1", "identity;q=0, *;q=0.001")
        plain = (None, "", "identity", "br, deflate", "gzip;q=0", "*, gzip;q=0", "gzip;q=0, *;q=0.5",
                 "gzip;q=0.4, identity;q=0.5", "gzipx", "identity, *;q=0.5")
        for path in READ:
            tags = set()
            for accepted in coded + plain:
                with self.subTest(path, accepted=accepted):
                    fields = {} if accepted is None else {"Accept-Encoding": accepted}
                    answer = self.daemon.get(path, fields)
                    self.assertEqual(answer.headers["Vary"],
                                     "Accept, Accept-Encoding" if path == "/" else "Accept-Encoding")
                    self.assertEqual(answer.headers["Content-Encoding"],
                                     "gzip" if accepted in coded else None)
                    text = gzip.decompress(answer.body) if accepted in coded else answer.body
                    self.assertEqual(text, self.daemon.get(path).body)
                    head = self.daemon.call("HEAD", path, None, fields)
                    for name in ("Content-Length", "Content-Encoding", "ETag", "Vary"):
                        self.assertEqual(head.headers[name], answer.headers[name], name)
                    tags.add(answer.headers["ETag"])
                    known = self.daemon.get(path, {**fields, "If-None-Match": answer.headers["ETag"]})
                    self.assertEqual(known.status, 304)
                    self.assertEqual(known.headers["Content-Length"], str(len(answer.body)))
            self.assertEqual(len(tags), 2)
        two = self.daemon.raw(b"GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n"
                              b"Accept-Encoding: br\r\nAccept-Encoding: gzip\r\n\r\n")
        self.assertIn(b"\r\nContent-Encoding: gzip\r\n", two)

    def test_answers_in_json_are_compressed_where_asked_for(self):
        for path in ("/v1/explain", "/v1/compare"):
            for accepted, coding in (("gzip", "gzip"), ("gzip;q=0", None), (None, None)):
                fields = {"Accept-Encoding": accepted} if accepted else {}
                answer = self.daemon.post(path, SMALL, fields)
                self.assertEqual(answer.status, 200)
                self.assertEqual((answer.headers["Content-Encoding"], answer.headers["Vary"]),
                                 (coding, "Accept-Encoding"))
                text = gzip.decompress(answer.body) if coding else answer.body
                self.assertIsInstance(json.loads(text), dict)
                self.assertEqual(int(answer.headers["Content-Length"]), len(answer.body))

    def test_304_has_the_length_of_the_picture_or_none(self):
        picture = self.daemon.render(BODY)
        tag = picture.headers["ETag"].encode()
        again = b"GET /v1/version HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"
        # The response cache has it: its length is known, and the connection goes on.
        data = self.daemon.raw(post(b"If-None-Match: " + tag), again)
        self.assertTrue(data.startswith(b"HTTP/1.1 304 "), data)
        self.assertIn(b"\r\nContent-Length: %d\r\n" % len(picture.body), data)
        self.assertIn(b"\r\n\r\nHTTP/1.1 200 ", data)
        with Daemon("--response-cache", "0") as daemon:
            data = daemon.raw(post(b"If-None-Match: " + tag))
            self.assertTrue(data.startswith(b"HTTP/1.1 304 "), data)
            self.assertTrue(data.endswith(b"\r\n\r\n"), data)
            for field in (b"content-length", b"transfer-encoding"):
                self.assertNotIn(field, data.lower())

    def test_head_is_get_without_a_body(self):
        for path in READ:
            with self.subTest(path):
                get, head = self.daemon.get(path), self.daemon.call("HEAD", path)
                self.assertEqual((head.status, head.body), (200, b""))
                for name in ("Content-Type", "Content-Length", "ETag", "Cache-Control"):
                    self.assertEqual(get.headers[name], head.headers[name])

    def test_options_names_the_methods(self):
        for path in READ + ["*"]:
            answer = self.daemon.call("OPTIONS", path)
            self.assertEqual((answer.status, answer.body), (204, b""))
            wanted = "GET, HEAD, POST, PUT, OPTIONS" if path == "*" else "GET, HEAD, OPTIONS"
            self.assertEqual(answer.headers["Allow"], wanted)
            self.assertFalse([name for name in answer.headers if name.startswith("Access-")])
        for path in ("/v1/render", "/v1/compare"):
            answer = self.daemon.call("OPTIONS", path)
            self.assertEqual((answer.status, answer.headers["Allow"]), (204, "POST, OPTIONS"))

    def test_wrong_methods_name_the_right_ones(self):
        for method in ("GET", "HEAD", "PUT", "DELETE", "PATCH", "TRACE", "BREW"):
            answer = self.daemon.call(method, "/v1/render")
            self.assertEqual(answer.headers["Allow"], "POST, OPTIONS")
            if method == "HEAD":
                self.assertEqual((answer.status, answer.body), (405, b""))
            else:
                self.assert_problem(answer, 405, "method")
        for path in READ:
            for method in ("POST", "PUT", "DELETE"):
                answer = self.daemon.call(method, path, b"{}", JSON)
                self.assert_problem(answer, 405, "method")
                self.assertEqual(answer.headers["Allow"], "GET, HEAD, OPTIONS")

    def test_unknown_paths(self):
        for path in ("/v1", "/v1/", "/v1/render/", "//", "/V1/version", "/%", "/..",
                     "/healthz", "/metrics", "/" + "a" * 2000, "/v1/versio%6", "*"):
            self.assert_problem(self.daemon.get(path), 404, "not-found")
        self.assert_problem(self.daemon.call("POST", "/nothing", BODY, JSON), 404, "not-found")
        data = self.daemon.raw(b"GET /%\t0 HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n")
        self.assertTrue(data.startswith(b"HTTP/1.1 404 "), data)

    def test_paths_that_hide_their_ends_are_refused(self):
        for path in ("/v1/version%00", "/v1%2Fversion", "/v1/%2fversion", "%2Fv1/version",
                     "/v1/preview%2Fbrass", "/v1/preview/brass%2F", "/%00", "/a%2F../v1/version"):
            self.assert_problem(self.daemon.get(path), 400, "request")
        self.assertEqual(self.daemon.get("/v1/version?a=%2F%00").status, 200)

    def test_lines_that_others_read_differently_are_refused(self):
        line, field = b"GET /v1/version HTTP/1.1\r\n", b"Host: a\r\n"
        good = line + field + b"Empty:\r\nX:   a b  \r\nConnection: close\r\n\r\n"
        self.assertTrue(self.daemon.raw(b"\r\n" + good).startswith(b"HTTP/1.1 200 "))
        self.assertTrue(self.daemon.raw(b"GET / HTTP/1.0\r\n\r\n").startswith(b"HTTP/1.1 200 "))
        many = b"".join(b"X-%d: %s\r\n" % (i, b"x" * 300) for i in range(60))
        self.assertTrue(self.daemon.raw(line + many, field + b"Connection: close\r\n\r\n")
                        .startswith(b"HTTP/1.1 200 "))
        for bad in (line[:-2] + b"\n" + field + b"\r\n", line + b"Host: a\n\r\n",
                    line + field + b"\n", line + field + b"X: a\nY: b\r\n\r\n",
                    line + field + b"X:  a\n\r\n", line + field + b"X: a\0b\r\n\r\n",
                    line + field + b"X: a\0\r\n\r\n", line + field + b"X: \0\r\n\r\n",
                    line + b"Host: a\0b\nX: b\r\n\r\n", line + field + b"X: a\0\0\n\r\n",
                    b"GET /v1/version\0 HTTP/1.1\r\n" + field + b"\r\n",
                    b"GET /v1/version\0?a HTTP/1.1\r\n" + field + b"\r\n",
                    line + field + b"X: a\r\n b\r\n\r\n", line + b"Host: a\r\n\tb\r\n\r\n",
                    line + field + many + b"X: a\nY: b\r\n\r\n"):
            for pieces in (bad,), (bad[:20], bad[20:]), tuple(bad[i:i + 1] for i in range(len(bad))):
                if len(pieces) < 2000:
                    with self.subTest(bad[-40:], pieces=len(pieces)):
                        self.assert_raw_problem(self.daemon.raw(*pieces), 400, "request")
        # Before there is a field.
        self.assertTrue(self.daemon.raw(line + b"Ho\0st: a\r\n\r\n").startswith(b"HTTP/1.1 400 "))

    def test_other_spellings_of_a_path(self):
        for target in ("/v1/version?", "/v1/version?a=b/c", "/v1/%76ersion",
                       "http://localhost/v1/version", "http://other.example/v1/version?x"):
            self.assertEqual(self.daemon.get(target).status, 200, target)
        self.assertEqual(self.daemon.get("http://localhost").status, 200)

    # ---- Media types ----

    def test_json_paths_answer_json_or_406(self):
        self.assertEqual(READ[0], "/")
        for path in READ[1:5]:
            for accept in ("application/json", "application/*", "*/*", "text/html, */*;q=0.1",
                           "Application/JSON;q=0.001", "application/json; charset=utf-8"):
                answer = self.daemon.get(path, {"Accept": accept})
                self.assertEqual(answer.status, 200, accept)
                self.assertEqual(answer.headers["Content-Type"], "application/json")
            for accept in ("text/html", "application/json;q=0", "*/*, application/json;q=0.0",
                           "application/jsonx", "nonsense"):
                self.assert_problem(self.daemon.get(path, {"Accept": accept}), 406,
                                    "not-acceptable")

    def test_the_page_is_for_who_likes_html_better_than_json(self):
        """As browsers do; what asks for anything gets the list of paths, as ever."""
        kinds = {}
        for accept in (None, "*/*", "application/json", "application/json, text/html", "text/html;q=0.4, */*;q=0.5",
                       "text/html, application/xhtml+xml, */*;q=0.8", "text/html", "text/*, application/json;q=0.9"):
            answer = self.daemon.get("/", {"Accept": accept} if accept else {})
            kinds[accept] = answer.headers["Content-Type"].split(";")[0]
            page = kinds[accept] == "text/html"
            self.assertEqual(answer.body.startswith(b"<!doctype html>"), page)
            self.assertEqual("default-src 'none'" in (answer.headers["Content-Security-Policy"] or ""), page)
            self.assertEqual(answer.headers["X-Content-Type-Options"], "nosniff" if page else None)
            self.assertEqual(answer.headers["Vary"], "Accept, Accept-Encoding")
        self.assertEqual(list(kinds.values()), ["application/json"] * 5 + ["text/html"] * 3)
        for accept in ("application/json;q=0", "application/jsonx", "nonsense"):
            self.assert_problem(self.daemon.get("/", {"Accept": accept}), 406, "not-acceptable")

    def test_bodies_must_be_json(self):
        def status(content_type):
            headers = {"Content-Type": content_type} if content_type else {}
            return self.daemon.call("POST", "/v1/render", BODY, headers)

        for good in ("application/json", "Application/JSON ; charset=utf-8",
                     "application/vnd.shaded+json", "model/x+JSON;a=b"):
            self.assertEqual(status(good).status, 200, good)
        for bad in ("text/plain", "application/jsonx", "application/x-www-form-urlencoded", "json",
                    "multipart/form-data; boundary=x", "+json", "/+json", "application/+json"):
            answer = status(bad)
            self.assert_problem(answer, 415, "media-type", "application/json")
            self.assertEqual(answer.headers["Accept-Post"], "application/json")
        self.assert_problem(status(None), 415, "media-type", "no Content-Type")

    # ---- Request ids ----

    def test_sane_request_ids_are_echoed(self):
        for good in ("a", "A-b_c.9", "x" * 64):
            answer = self.daemon.get("/", {"X-Request-Id": good})
            self.assertEqual(answer.headers["X-Request-Id"], good)
            self.daemon.wait_for("request", lambda event, id=good: event["id"] == id)
        seen = set()
        for bad in ("", "x" * 65, "a b", "a\"b", "\u00e9", "a;b"):
            answer = self.daemon.get("/", {"X-Request-Id": bad})
            self.assertRegex(answer.headers["X-Request-Id"], "^[0-9a-f]{8}-[0-9a-f]{8}$")
            seen.add(answer.headers["X-Request-Id"])
        self.assertEqual(len(seen), 6)

    # ---- Bodies ----

    def test_a_body_over_the_limit_is_refused_from_its_length(self):
        answer = self.daemon.render(b"x" * 100001)
        self.assert_problem(answer, 413, "body-too-large", "100001", "100000")
        self.assertEqual(answer.headers["Connection"], "close")
        # Only the head is sent: the answer cannot have waited for the body.
        data = self.daemon.raw(post(b"Content-Length: 99999999999999999999", length=False)[:-1])
        self.assertTrue(data.startswith(b"HTTP/1.1 4"), data)
        data = self.daemon.raw(b"POST /v1/render HTTP/1.1\r\nHost: a\r\n"
                               b"Content-Type: application/json\r\n"
                               b"Content-Length: 1000000\r\n\r\n")
        self.assert_raw_problem(data, 413, "body-too-large")

    def test_a_client_that_sends_100_megabytes_can_read_the_refusal(self):
        for chunked in (False, True):
            with self.subTest(chunked=chunked):
                connection = http.client.HTTPConnection(*self.daemon.address, timeout=500)
                piece = b"[" * (1 << 20)
                body = iter([piece] * 100) if chunked else piece * 100
                connection.request("POST", "/v1/render", body, JSON, encode_chunked=chunked)
                answer = connection.getresponse()
                self.assertEqual(answer.status, 413)
                self.assertEqual(json.loads(answer.read())["status"], 413)
                connection.close()

    def test_chunked_bodies(self):
        connection = http.client.HTTPConnection(*self.daemon.address, timeout=500)
        for _ in range(2):  # and the connection lives on
            pieces = iter([BODY[:1], BODY[1:7], BODY[7:]])
            connection.request("POST", "/v1/render", pieces, JSON, encode_chunked=True)
            answer = connection.getresponse()
            self.assertEqual(answer.status, 200)
            self.assertTrue(answer.read().startswith(b"\x89PNG"))
        connection.close()

    def test_expect_is_answered_at_once(self):
        go_on = post(b"Expect: 100-continue")[:-len(BODY)]
        with socket.create_connection(self.daemon.address, 500) as connection:
            connection.sendall(go_on)
            self.assertTrue(connection.recv(1000).startswith(b"HTTP/1.1 100 "))
            connection.sendall(BODY)
            self.assertTrue(connection.recv(1000).startswith(b"HTTP/1.1 200 "))
        refused = go_on.replace(b"application/json", b"text/plain")
        self.assert_raw_problem(self.daemon.raw(refused), 415, "media-type")
        missing = go_on.replace(b"/v1/render", b"/nothing")
        self.assert_raw_problem(self.daemon.raw(missing), 404, "not-found")

    def test_refused_bodies_keep_the_connection(self):
        connection = http.client.HTTPConnection(*self.daemon.address, timeout=500)
        connection.connect()
        first = connection.sock
        for method, path, kind, status in (
                ("POST", "/v1/render", "text/plain", 415), ("POST", "/", "application/json", 405),
                ("PUT", "/none", "application/json", 404),
                ("POST", "/v1/render", "application/json", 200), ("GET", "/", "text/plain", 200)):
            connection.request(method, path, BODY, {"Content-Type": kind})
            answer = connection.getresponse()
            answer.read()
            self.assertEqual(answer.status, status)
            self.assertIs(connection.sock, first)
        connection.close()

    def test_pipelined_requests_are_answered_in_order(self):
        get = b"GET /v1/version HTTP/1.1\r\nHost: a\r\nX-Request-Id: %s\r\n\r\n"
        last = get.replace(b"Host: a", b"Host: a\r\nConnection: close") % b"last"
        data = self.daemon.raw(get % b"one" + post(b"X-Request-Id: two") + get % b"three" + last)
        places = [data.find(b"X-Request-Id: " + name) for name in (b"one", b"two", b"three",
                                                                   b"last")]
        self.assertEqual(places, sorted(places))
        self.assertNotIn(-1, places)

    def test_bytewise_requests(self):
        message = post(b"Connection: close")
        data = self.daemon.raw(*(message[i:i + 1] for i in range(len(message))))
        self.assertTrue(data.startswith(b"HTTP/1.1 200 "), data[:100])

    def test_clients_that_leave_do_no_harm(self):
        message = post()
        for cut in range(1, len(message), 7):
            with socket.create_connection(self.daemon.address, 500) as connection:
                connection.sendall(message[:cut])
        for _ in range(10):  # gone while the picture is made
            with socket.create_connection(self.daemon.address, 500) as connection:
                connection.sendall(message)
        self.assertEqual(self.daemon.render(BODY).status, 200)

    # ---- Framing ----

    def test_ambiguous_heads_are_refused(self):
        smuggled = b"0\r\n\r\nGET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n"
        for name, message in {
                "twice": post(b"Content-Length: 5"),
                "same twice": post(b"Content-Length: %d" % len(BODY)),
                "both": post(b"Transfer-Encoding: chunked", body=smuggled),
                "coding": post(b"Transfer-Encoding: gzip, chunked", body=smuggled, length=False),
                "codings": post(b"Transfer-Encoding: chunked", b"Transfer-Encoding: chunked",
                                body=smuggled, length=False),
                "no host": post().replace(b"Host: localhost\r\n", b""),
                "blank name": post(b"Content-Length : 5", length=False),
                "blank in a name": post(b"Transfer-Encoding\t: chunked", length=False),
                "two types": post(b"Content-Type: text/plain"),
                "two hosts": post(b"Host: other")}.items():
            with self.subTest(name):
                data = self.daemon.raw(message)
                self.assert_raw_problem(data, 400, "request")
                self.assertEqual(data.count(b"HTTP/1.1 "), 1)

    def chunked(self, size_end=b"\r\n", data_end=b"\r\n", last_end=b"\r\n", trailers=b"",
                end=b"\r\n"):
        return (post(b"Transfer-Encoding: chunked", length=False, body=b"%x" % len(BODY)) + size_end
                + BODY + data_end + b"0" + last_end + trailers + end)

    def test_fields_after_a_body_are_refused(self):
        """However their lines end, and nothing after them is taken for a request."""
        hidden = b"GET /v1/version HTTP/1.1\r\nHost: a\r\n\r\n"
        for trailers in (b"X: a\r\n", b"X: a\n", b"X:\r\n", b"X: a\r\nY: b\n", b"X: a\n b\r\n",
                         b"Content-Length: 5\r\n"):
            for end in (b"\r\n", b"\n"):
                message = self.chunked(trailers=trailers, end=end) + hidden
                for pieces in (message,), (message[:-60], message[-60:]), \
                        (message[:-len(hidden) - 1], message[-len(hidden) - 1:]):
                    with self.subTest(trailers, end=end, pieces=len(pieces)):
                        data = self.daemon.raw(*pieces)
                        self.assert_raw_problem(data, 400, "request")
                        self.assertEqual(data.count(b"HTTP/1.1 "), 1)

    def test_ends_of_lines_between_chunks_are_not_seen(self):
        """What SECURITY.md says: where a release of libmicrohttpd refuses them, its page can."""
        last = b"GET /v1/version HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"
        for lax in ({}, {"size_end": b"\n"}, {"size_end": b";a\n"}, {"size_end": b";a=\0\r\n"},
                    {"data_end": b"\n"}, {"last_end": b"\n"}, {"end": b"\n"},
                    {"trailers": b"\0X: a\r\n"}):
            with self.subTest(lax):
                data = self.daemon.raw(self.chunked(**lax) + last)
                self.assertEqual(data.count(b"HTTP/1.1 200 "), 2)

    def test_http_1_0(self):
        data = self.daemon.raw(b"GET /v1/version HTTP/1.0\r\n\r\n")
        self.assertRegex(data, b"^HTTP/1.[01] 200 ")

    def test_junk_does_no_harm(self):
        junks = [b"\0" * 100, b"\r\n" * 50 + b"x", b"GET\r\n\r\n", b"\x16\x03\x01\x02\x00",
                 b"GET / HTTP/9.9\r\n\r\n", b"GET / HTTP/1.1\r\nHost" + b"t" * 100000,
                 b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Length: -1\r\n\r\n",
                 b"POST /v1/render HTTP/1.1\r\nHost: a\r\nContent-Length: 1x\r\n\r\n",
                 post(b"Transfer-Encoding: chunked", body=b"zz\r\n", length=False)]
        for junk in junks:
            try:
                with socket.create_connection(self.daemon.address, 500) as connection:
                    connection.sendall(junk)
                    connection.shutdown(socket.SHUT_WR)
                    data = receive_all(connection)
            except OSError:
                data = b""
            self.assertFalse(data.startswith(b"HTTP/1.1 2"), junk)
        self.assertEqual(self.daemon.get("/").status, 200)

    def test_half_closed_clients_are_not_left_waiting(self):
        # libmicrohttpd, like nginx, takes the end of a client's half for its leave where it sees
        # it before the answer: then there is none.
        for message in (post(), post() * 3, post(b"Connection: close")):
            with socket.create_connection(self.daemon.address, 500) as connection:
                connection.sendall(message)
                connection.shutdown(socket.SHUT_WR)
                try:
                    data = receive_all(connection)
                except ConnectionError:
                    data = b""
                self.assertEqual(data.count(b"HTTP/1.1 "), data.count(b"HTTP/1.1 200 "))

    def test_clients_that_left_in_mid_request_free_their_place(self):
        with Daemon("--idle-timeout", "300", "--max-connections", "20") as daemon:
            for cut in range(40):
                with socket.create_connection(daemon.address, 500) as connection:
                    connection.sendall(post()[:-1 - 5 * cut])
            self.assertEqual(daemon.get("/").status, 200)

    def test_the_log_cannot_be_forged(self):
        self.daemon.get("/%0a%7b%22event%22:%22forged%22%7d%1b%5b31m")
        event = self.daemon.wait_for("request", lambda event: "forged" in event["path"])
        self.assertEqual(event["path"], '/\n{"event":"forged"}\x1b[31m')
        self.assertFalse(self.daemon.events("forged"))
        self.assertTrue(self.daemon.stderr().isascii())

    def test_the_log_has_characters_as_they_are_and_other_bytes_as_text(self):
        whole = "/\u00e9\u20ac\U0001f600\x80\u202e\\"
        broken = (b"/\xff-\xc3-\xe2\x82-\xed\xa0\x80-\xc0\xaf-\xf4\x90\x80\x80",
                  "/\\xff-\\xc3-\\xe2\\x82-\\xed\\xa0\\x80-\\xc0\\xaf-\\xf4\\x90\\x80\\x80")
        for path, logged in (whole.encode(), whole), broken:
            self.daemon.get(quote(path))
            self.daemon.wait_for("request", lambda event, path=logged: event["path"] == path)
        self.assertTrue(self.daemon.stderr().isascii())

    def test_many_connections_at_once(self):
        failures = []

        def work():
            connection = http.client.HTTPConnection(*self.daemon.address, timeout=500)
            for _ in range(20):
                connection.request("GET", "/v1/version")
                answer = connection.getresponse()
                if answer.status != 200 or not answer.read():
                    failures.append(answer.status)
            connection.close()

        threads = [threading.Thread(target=work) for _ in range(50)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(failures, [])


if __name__ == "__main__":
    unittest.main()
