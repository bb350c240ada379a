"""Who a request is from, and what each client has of the service: nobody takes another's part."""

import http.client
import json
import unittest

from e2e.daemon import JSON, PATIENCE, SMALL, Answer, Daemon


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


if __name__ == "__main__":
    unittest.main()
