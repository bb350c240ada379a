"""/docs: every link of every page leads somewhere, nothing comes from elsewhere, and what the pages tell a
reader to run is run, in a folder of its own, against a daemon that has just been started."""

import base64
import gzip
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
import zlib
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import urldefrag, urljoin, urlsplit

from e2e.daemon import BUILD, SOURCE, Daemon

# Links to scenes are explained, all of them; so many are drawn, too.
PICTURES = 3


class Reader(HTMLParser):
    """What a page links to, what it loads, its anchors, and what its policy would stop."""

    def __init__(self, text):
        super().__init__()
        self.links, self.loads, self.anchors, self.inline = set(), set(), [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        if "id" in found:
            self.anchors.append(found["id"])
        if tag == "a":
            self.links.add(found["href"])
        if tag in ("img", "script"):
            self.loads.add(found["src"])
        if tag == "link":
            self.loads.add(found["href"])
        if tag == "img" and not found.get("alt") and "alt" not in found:
            self.inline.append("img without alt")
        self.inline += [name for name in found if name == "style" or name.startswith("on")]
        self.inline += [tag for _ in [0] if tag == "style" or (tag == "script" and "src" not in found)]


def blocks(page, language):
    text = (SOURCE / "docs" / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.M | re.S)


class Docs(unittest.TestCase):
    def test_every_link_and_anchor_is_there(self):
        with Daemon("--timeout", "300") as daemon:
            pages, others, waiting = {}, set(), ["/docs", "/docs/"]
            while waiting:
                path = waiting.pop()
                answer = daemon.get(path, {"Accept": "text/html"})
                self.assertEqual(answer.status, 200, path)
                pages[path] = reader = Reader(answer.body.decode())
                self.assertEqual(reader.inline, [], path)
                self.assertEqual(len(reader.anchors), len(set(reader.anchors)), path)
                for link in reader.links | reader.loads:
                    target = urldefrag(urljoin(path, link))[0]
                    if urlsplit(target).netloc:
                        self.assertNotIn(link, reader.loads, f"{path} asks another host")
                    elif re.fullmatch(r"/docs(/[^.]*)?", target):
                        waiting += [] if target in pages or target in waiting else [target]
                    else:
                        others.add(target)
            self.assertGreater(len(pages), 25)
            for path, reader in pages.items():
                for link in reader.links:
                    target, anchor = urldefrag(urljoin(path, link))
                    if anchor and target in pages:
                        self.assertIn(anchor, pages[target].anchors, f"{path} links to {link}")
            drawn = sorted(other for other in others if other.startswith("/v1/scene/"))
            self.assertGreater(len(drawn), 40)
            for link in drawn:
                packed = link.removeprefix("/v1/scene/").partition(".")[0]
                scene = json.loads(zlib.decompress(base64.urlsafe_b64decode(packed + "=" * (-len(packed) % 4)), -15))
                self.assertEqual(daemon.post("/v1/explain", scene).status, 200, scene)
            for other in sorted(others - set(drawn)) + sorted(drawn, key=len)[:PICTURES]:
                self.assertEqual(daemon.get(other, {"Accept": "*/*"}).status, 200, other)

    def test_scenes_of_textures_are_taken(self):
        scenes = blocks("textures.md", "json")
        self.assertGreaterEqual(len(scenes), 8)
        for scene in scenes:
            done = subprocess.run([BUILD / "shade", "check", "-", "--assets", SOURCE / "docs" / "textures"],
                                  input=scene, capture_output=True, text=True, timeout=100, check=False)
            self.assertEqual(done.returncode, 0, scene + done.stderr)

    def test_all_documents_are_pages(self):
        with Daemon() as daemon:
            for path in (SOURCE / "docs").rglob("*.md"):
                name = path.relative_to(SOURCE / "docs").as_posix().replace("README.md", "")
                name = name.removesuffix(".md").strip("/").replace("/", "-")
                self.assertEqual(daemon.get(f"/docs/{name}").status, 200, path)

    def test_the_same_in_gzip_with_a_tag_of_its_own(self):
        with Daemon() as daemon:
            plain = daemon.get("/docs/api")
            packed = daemon.get("/docs/api", {"Accept-Encoding": "gzip"})
            self.assertEqual(gzip.decompress(packed.body), plain.body)
            self.assertNotEqual(packed.headers["ETag"], plain.headers["ETag"])
            for answer, coding in ((plain, "identity"), (packed, "gzip")):
                again = daemon.get("/docs/api", {"If-None-Match": answer.headers["ETag"], "Accept-Encoding": coding})
                self.assertEqual((again.status, again.body), (304, b""))
            self.assertIn("default-src 'none'", plain.headers["Content-Security-Policy"])

    def test_tokens_leave_the_pages_open(self):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("secret-secret-secret\n")
            file.flush()
            os.chmod(file.name, 0o600)
            with Daemon("--tokens", file.name) as daemon:
                self.assertEqual(daemon.get("/docs/requests").status, 200)


class Told(unittest.TestCase):
    """The commands of the pages."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.daemon = Daemon()
        self.addCleanup(self.daemon.stop)
        self.address = "http://{}:{}".format(*self.daemon.address)

    def run_in_folder(self, command, text):
        done = subprocess.run([*command, text], cwd=self.folder, capture_output=True, text=True,
                              env={**os.environ, "SHADED": self.address})
        self.assertEqual(done.returncode, 0, f"{text}\n{done.stdout}\n{done.stderr}")
        return done.stdout

    def size_of(self, name):
        data = (self.folder / name).read_bytes()
        self.assertTrue(data.startswith(b"\x89PNG\r\n"), name)
        return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")

    def test_five_requests(self):
        requests = [block.replace("http://127.0.0.1:8080", self.address)
                    for block in blocks("getting-started.md", "sh")]
        self.assertEqual(len(requests), 5)
        first, ring, mistake, compare, link = (self.run_in_folder(["bash", "-ec"], text) for text in requests)
        self.assertEqual(self.size_of("first.png"), (512, 512))
        self.assertEqual(self.size_of("ring.png"), (480, 360))
        told, shown = json.loads(mistake), json.loads(blocks("getting-started.md", "json")[0])
        self.assertEqual([error["pointer"] for error in told["errors"]],
                         [error["pointer"] for error in shown["errors"]])
        self.assertTrue(all(told[key] == shown[key] for key in ("type", "title", "status")))
        tiers = json.loads(compare)["tiers"]
        self.assertIn("deltaE2000", tiers[0]["error"])
        self.assertEqual((self.folder / "ring.webp").read_bytes()[8:12], b"WEBP")
        html = blocks("getting-started.md", "html")[0]
        source = re.search(r'src="([^"]*)"', html)[1].replace("&amp;", "&")
        answer = self.daemon.get(source.removeprefix("http://127.0.0.1:8080"))
        self.assertEqual(answer.status, 200)
        again = self.daemon.get(source.removeprefix("http://127.0.0.1:8080"), {"If-None-Match": answer.headers["ETag"]})
        self.assertEqual(again.status, 304)

    def test_shell(self):
        # The first block says where a daemon is: here another one is.
        text = "\n".join(blocks("pipelines.md", "sh")[1:])
        self.assertIn("unchanged", self.run_in_folder(["bash", "-euc"], text))
        self.assertEqual(self.size_of("box.png"), (96, 96))
        self.assertEqual({path.name for path in (self.folder / "swatches").iterdir()},
                         {"brass.png", "bronze.png", "copper.png", "gold.png"})

    def test_python(self):
        told = self.run_in_folder([sys.executable, "-c"], "\n".join(blocks("pipelines.md", "python")))
        self.assertIn("tier=", told)
        self.assertIn("/objects/0/radius", told)
        self.assertEqual(self.size_of("gold.png"), (96, 96))
        self.assertEqual([self.size_of(f"variant-{i}.png") for i in range(6)], [(96, 96)] * 6)


if __name__ == "__main__":
    unittest.main()
