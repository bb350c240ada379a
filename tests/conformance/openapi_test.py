"""api/openapi.yaml against itself and against the running daemon: every answer that it documents
is brought about, and is as it says. Debian has no validator of OpenAPI 3.1: what its rules say
about this document is checked here."""

import hashlib
import json
import re
import runpy
import tempfile
import unittest

import jsonschema
import yaml

from e2e.daemon import JSON, SMALL, SOURCE, Daemon, another
from e2e.daemon_test import ENDLESS, Client, occupied, wait_until, wait_until_read
from e2e.links_test import link_of
from e2e.render_test import parts

DOCUMENT = yaml.safe_load((SOURCE / "api/openapi.yaml").read_text())
BASE = "http://localhost/"
RESOLVER = jsonschema.RefResolver(BASE + "openapi.yaml", DOCUMENT)
METHODS = ["get", "head", "post", "put", "delete", "options", "patch", "trace"]

# Header fields that HTTP itself defines for every message.
GENERAL = {"date", "content-length", "content-type", "connection", "transfer-encoding"}
# Nothing from outside makes the server fail.
SCENE_PATHS = ("/v1/render", "/v1/explain", "/v1/compare", "/v1/analyze", "/v1/brdf")
UNPROVOKED = {"urn:shaded:problem:internal", "urn:shaded:problem:memory"}
PREVIEW = "/v1/preview/{material}"
MESHES, ASSETS = "/v1/meshes/{sha256}", "/v1/assets/{sha256}"
LINK, SCENES = "/v1/scene/{document}.{format}", "/v1/scenes"
KEPT, BATCH = "/v1/scenes/{digest}.{format}", "/v1/batch"
DIFF, FIT = "/v1/diff", "/v1/fit"
STUDIO, DOCS, PAGE = "/studio/{file}", "/docs", "/docs/{page}"
# Nothing fails, and what is made in milliseconds does not pass a deadline of a second.
UNREACHABLE = {*((path, "post", "500") for path in SCENE_PATHS), ("/v1/explain", "post", "504"),
               (BATCH, "post", "500"), (BATCH, "post", "504"), (DIFF, "post", "500"), (FIT, "post", "500"),
               *((path, method, "503") for path in (DOCS, PAGE) for method in ("get", "head")),
               *((path, "put", status) for path in (MESHES, ASSETS, SCENES) for status in ("500", "504")),
               *((path, method, "500") for path in (LINK, KEPT) for method in ("get", "head")),
               *((PREVIEW, method, status) for method in ("get", "head")
                 for status in ("500", "504"))}


def resolve(value):
    """The object itself where it is a reference."""
    while isinstance(value, dict) and set(value) == {"$ref"}:
        _, value = RESOLVER.resolve(value["$ref"])
    return value


def validate(value, schema):
    validator = jsonschema.Draft202012Validator(schema, resolver=RESOLVER)
    errors = [f"{list(error.path)}: {error.message}" for error in validator.iter_errors(value)]
    assert not errors, errors


def walk(value, place="#"):
    yield place, value
    items = value.items() if isinstance(value, dict) else \
        enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from walk(item, f"{place}/{str(key).replace('~', '~0').replace('/', '~1')}")


def operations():
    for path, item in DOCUMENT["paths"].items():
        for method in METHODS:
            if method in item:
                yield path, method, item[method]


class DocumentTest(unittest.TestCase):
    def test_names_are_strings(self):
        """YAML reads some words as booleans, and numbers as numbers."""
        for place, value in walk(DOCUMENT):
            if isinstance(value, dict):
                self.assertEqual([name for name in value if not isinstance(name, str)], [], place)

    def test_it_has_the_members_of_openapi_3_1(self):
        self.assertRegex(DOCUMENT["openapi"], r"^3\.1\.\d+$")
        self.assertLessEqual({"title", "version"}, set(DOCUMENT["info"]))
        self.assertLessEqual(set(DOCUMENT), {"openapi", "info", "servers", "tags", "paths",
                                             "components", "security", "externalDocs"})
        self.assertLessEqual(set(DOCUMENT["components"]),
                             {"schemas", "responses", "parameters", "examples", "requestBodies",
                              "headers", "securitySchemes", "links", "callbacks", "pathItems"})
        for kind, entries in DOCUMENT["components"].items():
            for name in entries:
                self.assertRegex(name, r"^[a-zA-Z0-9._-]+$", kind)

    def test_operations_are_complete(self):
        tags = {tag["name"] for tag in DOCUMENT["tags"]}
        ids = [operation["operationId"] for _, _, operation in operations()]
        self.assertEqual(len(ids), len(set(ids)))
        for path, method, operation in operations():
            self.assertTrue(path.startswith("/"))
            self.assertLessEqual(set(operation), {
                "operationId", "tags", "summary", "description", "parameters", "requestBody",
                "responses", "deprecated", "security"}, (path, method))
            self.assertTrue(operation["summary"])
            self.assertLessEqual(set(operation["tags"]), tags)
            for parameter in map(resolve, operation.get("parameters", [])):
                self.assertIn(parameter["in"], ("query", "header", "path", "cookie"))
                self.assertTrue(parameter["name"] and parameter["schema"])
            self.assertTrue(operation["responses"])
            for status, response in operation["responses"].items():
                self.assertRegex(status, r"^[1-5]\d\d$")
                response = resolve(response)
                self.assertTrue(response["description"])
                self.assertLessEqual(set(response), {"description", "headers", "content"})
                for header in map(resolve, response.get("headers", {}).values()):
                    self.assertLessEqual(set(header), {"description", "required", "schema",
                                                       "example"})

    def test_derived_files_are_up_to_date(self):
        for name, text in runpy.run_path(str(SOURCE / "api/derive.py"))["texts"]().items():
            self.assertEqual((SOURCE / "api" / name).read_text(), text, "run `./dev api`")

    def test_examples_of_the_reference_are_valid(self):
        text = (SOURCE / "docs/reference.md").read_text()
        examples = re.findall(r"^### (\w+)\n(?:(?!^###).*\n)*?```json\n((?:.*\n)*?)```", text, re.M)
        self.assertEqual(len(examples), len(re.findall("^### ", text, re.M)))
        for name, lines in examples:
            for line in lines.splitlines():
                with self.subTest(name):
                    validate(json.loads(line), DOCUMENT["components"]["schemas"][name])

    def test_references_resolve_and_components_are_used(self):
        used = set()
        for place, value in walk(DOCUMENT):
            if isinstance(value, dict) and "$ref" in value:
                self.assertTrue(RESOLVER.resolve(value["$ref"])[1], place)
                used.add(value["$ref"])
        for kind, entries in DOCUMENT["components"].items():
            for name in entries:
                if kind == "securitySchemes":
                    self.assertIn({name: []}, DOCUMENT["security"])
                    continue
                self.assertIn(f"#/components/{kind}/{name}", used)

    def test_schemas_are_json_schema_2020_12(self):
        for place, value in walk(DOCUMENT):
            if place.endswith("/schema") or re.fullmatch("#/components/schemas/[^/]*", place):
                jsonschema.Draft202012Validator.check_schema(value)

    def test_examples_are_valid(self):
        count = 0
        for place, value in walk(DOCUMENT):
            if not isinstance(value, dict) or "schema" not in value:
                continue
            examples = [example["value"] for example in value.get("examples", {}).values()]
            examples += [value["example"]] if "example" in value else []
            for example in examples:
                with self.subTest(place):
                    validate(example, value["schema"])
                    count += 1
        self.assertGreater(count, 3)


class ServerTest(unittest.TestCase):
    """Each documented answer, from the daemon."""

    @classmethod
    def setUpClass(cls):
        cls.seen = set()
        cls.types = set()
        cls.daemon = Daemon("--max-body", "100000")

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def check(self, answer, path, method, status):
        """The answer is the documented one."""
        with self.subTest(path=path, method=method, status=status):
            self.assertEqual(answer.status, int(status), answer.body[:500])
            response = resolve(DOCUMENT["paths"][path][method]["responses"][status])
            self.check_headers(answer, response)
            self.check_body(answer, response, method)
            self.seen.add((path, method, status))

    def check_headers(self, answer, response):
        documented = {name.lower(): resolve(header)
                      for name, header in response.get("headers", {}).items()}
        for name, header in documented.items():
            if header.get("required"):
                self.assertIn(name, answer.headers)
        for name, value in answer.headers.items():
            if name.lower() in documented:
                validate(value, documented[name.lower()]["schema"])
            else:
                self.assertIn(name.lower(), GENERAL, "is not documented")

    def check_body(self, answer, response, method):
        content = response.get("content")
        if method == "head" or not content:
            self.assertEqual(answer.body, b"")
            return
        media_type = answer.headers["Content-Type"].split(";")[0]
        self.assertIn(media_type, content)
        schema = content[media_type].get("schema")
        if not schema or not media_type.endswith("json"):
            self.assertTrue(answer.body)
            return
        value = json.loads(answer.body)
        validate(value, schema)
        if media_type == "application/problem+json":
            self.assertEqual(value["status"], answer.status)
            self.types.add(value["type"])

    def test_paths_and_methods_are_those_of_the_daemon(self):
        index = json.loads(self.daemon.get("/").body)
        real = {route["path"]: set(route["methods"]) for route in index["routes"]}
        documented = {path: {method.upper() for method in item if method in METHODS}
                      for path, item in DOCUMENT["paths"].items()}
        self.assertEqual(documented, real)
        self.assertEqual(index["version"], DOCUMENT["info"]["version"])

    def test_the_documents_are_served(self):
        for path in ("/openapi.yaml", "/openapi.json", "/scene.schema.json"):
            self.assertEqual(self.daemon.get(path).body,
                             (SOURCE / "api" / path[1:]).read_bytes())

    def test_every_documented_answer(self):
        for path, item in DOCUMENT["paths"].items():
            if "get" in item and path not in (PREVIEW, LINK, KEPT):
                self.read_path(path, item)
            self.check(self.daemon.call("OPTIONS", path), path, "options", "204")
            for method in item:
                answer = self.daemon.call(method.upper(), path + "?" + "a" * 8000)
                self.check(answer, path, method, "414")
        self.studio_paths()
        self.render_path()
        self.preview_path()
        self.explain_path()
        self.compare_path()
        self.analyze_path()
        self.brdf_path()
        self.diff_path()
        self.fit_path()
        self.mesh_path()
        self.asset_path()
        self.link_paths()
        self.scenes_path()
        self.batch_path()
        self.busy()
        self.deadline()
        self.draining()
        self.unauthorized()
        self.over_rate()
        for target in ("/nothing", "/?" + "a" * 8000):
            lost = json.loads(self.daemon.get(target).body)
            validate(lost, DOCUMENT["components"]["schemas"]["Problem"])
            self.types.add(lost["type"])

        documented = {(path, method, status) for path, method, operation in operations()
                      for status in operation["responses"]}
        self.assertEqual(self.seen, documented - UNREACHABLE)
        types = DOCUMENT["components"]["schemas"]["Problem"]["properties"]["type"]["enum"]
        self.assertEqual(self.types | UNPROVOKED, set(types))

    def read_path(self, path, item):
        target = path.replace("{file}", "main.js").replace("{page}", "requests")
        for method in ("get", "head"):
            answer = self.daemon.call(method.upper(), target)
            self.check(answer, path, method, "200")
            tag = answer.headers["ETag"]
            self.check(self.daemon.call(method.upper(), target, None, {"If-None-Match": tag}),
                       path, method, "304")
            if "406" in item[method]["responses"]:
                self.check(self.daemon.call(method.upper(), target, None, {"Accept": "text/css"}),
                           path, method, "406")
        self.check(self.daemon.call("POST", target, b"{}", JSON), path, "get", "405")

    def studio_paths(self):
        for method in ("get", "head"):
            page = self.daemon.call(method.upper(), "/", None, {"Accept": "text/html,*/*;q=0.8"})
            self.check(page, "/", method, "200")
            self.assertEqual(page.headers["Content-Type"], "text/html; charset=utf-8")
            self.assertIn("default-src 'none'", page.headers["Content-Security-Policy"])
            tag = {"Accept": "text/html", "If-None-Match": page.headers["ETag"]}
            self.check(self.daemon.call(method.upper(), "/", None, tag), "/", method, "304")
            for name in ("nothing.js", "index.html", "shaded-preview.js"):
                self.check(self.daemon.call(method.upper(), "/studio/" + name), STUDIO, method, "404")
            self.check(self.daemon.call(method.upper(), "/docs/nothing"), PAGE, method, "404")
        for file in sorted((SOURCE / "src/studio/studio").iterdir()):
            answer = self.daemon.get("/studio/" + file.name)
            self.check(answer, STUDIO, "get", "200")
            self.assertEqual(answer.body, file.read_bytes())
        self.assertEqual(self.daemon.get("/shaded-preview.js").body,
                         (SOURCE / "src/studio/shaded-preview.js").read_bytes())

    def render_path(self):
        def check(answer, status):
            self.check(answer, "/v1/render", "post", status)

        content = DOCUMENT["paths"]["/v1/render"]["post"]["responses"]["200"]["content"]
        for media_type in content:
            outputs = {"outputs": [{"name": "a"}, {"name": "b"}]} if "form" in media_type else {}
            answer = self.daemon.render({**SMALL, **outputs}, {"Accept": media_type})
            check(answer, "200")
            self.assertEqual(answer.headers["Content-Type"].split(";")[0], media_type)
            if outputs:
                self.assertEqual(len(parts(answer)), 2)
        body = DOCUMENT["paths"]["/v1/render"]["post"]["requestBody"]["content"]
        for example in body["application/json"]["examples"].values():
            check(self.daemon.render(example["value"]), "200")
        warned = {**SMALL, "output": {"format": "exr", "bitDepth": "half"},
                  "objects": [{"type": "sphere", "material": {"emissive": 1e30, "shininess": 2000}}]}
        answer = self.daemon.render(warned)
        check(answer, "200")
        self.assertTrue(answer.headers["Shaded-Saturated"] and answer.headers["Shaded-Warning"])
        check(self.daemon.render(SMALL, {"If-None-Match": answer.headers["ETag"]}), "200")
        tag = self.daemon.render(SMALL).headers["ETag"]
        check(self.daemon.render(SMALL, {"If-None-Match": tag}), "304")
        self.refusals("/v1/render")
        data = self.daemon.raw(b"POST /v1/render HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n")
        self.assertTrue(data.startswith(b"HTTP/1.1 400 "))
        problem = json.loads(data.partition(b"\r\n\r\n")[2])
        validate(problem, DOCUMENT["components"]["schemas"]["Problem"])
        self.types.add(problem["type"])

    def preview(self, daemon, method, status, query="?size=16", headers=None):
        answer = daemon.call(method.upper(), f"/v1/preview/brass{query}", None, headers)
        self.check(answer, PREVIEW, method, status)
        return answer

    def preview_path(self):
        content = DOCUMENT["paths"][PREVIEW]["get"]["responses"]["200"]["content"]
        for method in ("get", "head"):
            for media_type in content:
                answer = self.preview(self.daemon, method, "200", headers={"Accept": media_type})
                self.assertEqual(answer.headers["Content-Type"], media_type)
            tag = {"If-None-Match": answer.headers["ETag"], "Accept": media_type}
            self.preview(self.daemon, method, "304", headers=tag)
            self.preview(self.daemon, method, "400", "?size=0&sice=9")
            self.preview(self.daemon, method, "400", "?size=0")
            self.preview(self.daemon, method, "406", headers={"Accept": "text/css"})
            self.preview(self.daemon, method, "422", "?size=9000")
            self.check(self.daemon.call(method.upper(), "/v1/preview/bras"), PREVIEW, method,
                       "404")
        self.preview(self.daemon, "get", "200", "?size=16&format=exr&colorSpace=ACEScg&shape=cone")
        self.check(self.daemon.call("POST", "/v1/preview/brass", b"{}"), PREVIEW, "get", "405")
        with tempfile.NamedTemporaryFile("w", encoding="ascii") as file:
            file.write("0123456789abcdef0123456789abcdef\n")
            file.flush()
            with Daemon("--preview-keys", file.name) as daemon:
                for method in ("get", "head"):
                    self.preview(daemon, method, "403")

    def keep(self, daemon, status, scene, **headers):
        answer = daemon.call("PUT", SCENES, json.dumps(scene), {**JSON, **headers})
        self.check(answer, SCENES, "put", status)
        return answer

    def link_paths(self):
        example = DOCUMENT["components"]["parameters"]["LinkDocument"]["example"]
        missing = {"objects": [{"type": "mesh", "data": "sha256-" + "0" * 64}]}
        warned = {**SMALL, "objects": [{"type": "sphere", "material": {"shininess": 2000}}]}
        kept = self.keep(self.daemon, "201", warned).headers["Location"]
        for path, right, none in ((LINK, link_of(warned), "/v1/scene/A.gif"),
                                  (KEPT, kept, "/v1/scenes/" + "0" * 64 + ".png")):
            for method in ("get", "head"):
                def check(target, status, daemon=self.daemon, **headers):
                    answer = daemon.call(method.upper(), target, None, headers)
                    self.check(answer, path, method, status)
                    return answer

                answer = check(right, "200")
                self.assertTrue(answer.headers["Shaded-Warning"])
                for suffix, kind in (("jpg", "image/jpeg"), ("webp", "image/webp")):
                    answer = check(right.replace("png", suffix), "200", Accept=kind)
                    self.assertEqual(answer.headers["Content-Type"], kind)
                check(right.replace("png", suffix), "304", **{"If-None-Match": answer.headers["ETag"]})
                check(right + "?size=9", "400")
                check(right, "406", Accept="text/css")
                check(none, "404")
            self.check(self.daemon.call("POST", right, b"{}", JSON), path, "get", "405")
        for method in ("get", "head"):
            check = lambda target, status: self.check(self.daemon.call(method.upper(), target), LINK,
                                                      method, status)
            check(f"/v1/scene/{example}.png", "200")
            check("/v1/scene/AA.png", "400")
            check(link_of(missing), "409")
            check(link_of({}), "422")
        with Daemon("--max-pixels", "100") as daemon:
            mesh = b'{"positions": [0,0,0, 1,0,0, 0,1,0]}'
            digest = hashlib.sha256(mesh).hexdigest()
            self.assertEqual(daemon.call("PUT", f"/v1/meshes/{digest}", mesh, JSON).status, 201)
            small = {"image": {"width": 3, "height": 2}, "objects": [
                {"type": "mesh", "data": f"sha256-{digest}"}]}
            kept = self.keep(daemon, "201", small).headers["Location"]
            for method in ("get", "head"):
                self.check(daemon.call(method.upper(), kept.replace("png", "jpg")), KEPT, method, "200")
        with Daemon() as daemon:
            kept = self.keep(daemon, "201", {**SMALL, "output": {"format": "png"}}).headers["Location"]
            for method in ("get", "head"):
                self.check(daemon.call(method.upper(), kept.replace("png", "jpg")), KEPT, method, "422")
        self.forgotten_mesh()
        with tempfile.TemporaryDirectory() as folder:
            daemon = Daemon("--scenes-folder", folder)
        with daemon:  # it has lost its folder
            self.keep(daemon, "507", SMALL)
        with tempfile.NamedTemporaryFile("w", encoding="ascii") as file:
            file.write("0123456789abcdef0123456789abcdef\n")
            file.flush()
            with Daemon("--preview-keys", file.name) as daemon:
                for path, target in ((LINK, link_of(SMALL)), (KEPT, kept)):
                    for method in ("get", "head"):
                        self.check(daemon.call(method.upper(), target), path, method, "403")

    def forgotten_mesh(self):
        """A kept scene whose mesh is not kept any more."""
        def mesh(size):
            return json.dumps({"positions": [size, 0, 0, 1, 0, 0, 0, 1, 0] * 400}).encode()

        first = hashlib.sha256(mesh(2)).hexdigest()
        with Daemon("--mesh-store", "512K") as daemon:
            self.put(daemon, "201", mesh(2))
            scene = {**SMALL, "objects": [{"type": "mesh", "data": f"sha256-{first}"}]}
            kept = self.keep(daemon, "201", scene).headers["Location"]
            for size in range(3, 40):
                self.put(daemon, "201", mesh(size))
                self.assertNotEqual(daemon.get(kept + "?").status, 404)  # it stays the last used
            for method in ("get", "head"):
                self.check(daemon.call(method.upper(), kept.replace("png", "jpg")), KEPT, method, "409")

    def batch(self, daemon, status, batch=None, **headers):
        batch = {"scene": SMALL, "variants": [{}]} if batch is None else batch
        answer = daemon.post(BATCH, batch, headers)
        self.check(answer, BATCH, "post", status)
        return answer

    def batch_path(self):
        content = DOCUMENT["paths"][BATCH]["post"]["requestBody"]["content"]
        examples = {name: example["value"] for name, example in content["application/json"]["examples"].items()}
        sheets = {name: examples.pop(name) for name in list(examples) if {"sheet", "turntable"} & set(examples[name])}
        counts = [len(parts(self.batch(self.daemon, "200", value))) for value in examples.values()]
        self.assertEqual(counts, [2, 8])
        for value in sheets.values():
            tag = self.batch(self.daemon, "200", value).headers["ETag"]
            self.batch(self.daemon, "304", value, **{"If-None-Match": tag})
        unknown = {**SMALL, "objects": [{"type": "mesh", "data": "sha256-" + "0" * 64}]}
        self.batch(self.daemon, "409", {"scene": unknown, "sheet": {}})
        self.batch(self.daemon, "400", b"{")
        self.check(self.daemon.call("PUT", BATCH, b"{}", JSON), BATCH, "post", "405")
        self.batch(self.daemon, "406", Accept="image/png")
        self.batch(self.daemon, "413", b"x" * 100001)
        self.batch(self.daemon, "415", **{"Content-Type": "text/css"})
        self.batch(self.daemon, "422", {})

    def scenes_path(self):
        examples = DOCUMENT["paths"][SCENES]["put"]["requestBody"]["content"]["application/json"]
        for example in examples["examples"].values():
            self.keep(self.daemon, "201", example["value"])
            self.keep(self.daemon, "200", example["value"])
        self.keep(self.daemon, "406", SMALL, Accept="image/png")
        self.keep(self.daemon, "409", {"objects": [{"type": "mesh", "data": "sha256-" + "0" * 64}]})
        self.keep(self.daemon, "413", {"x": "x" * 100001})
        self.keep(self.daemon, "415", SMALL, **{"Content-Type": "text/css"})
        self.keep(self.daemon, "415", SMALL, **{"Content-Encoding": "br"})
        self.keep(self.daemon, "422", {})
        self.check(self.daemon.call("PUT", SCENES, b"{", JSON), SCENES, "put", "400")
        self.check(self.daemon.call("POST", SCENES, b"{}", JSON), SCENES, "put", "405")

    def explain_path(self):
        path = "/v1/explain"
        body = DOCUMENT["paths"][path]["post"]["requestBody"]["content"]
        for example in body["application/json"]["examples"].values():
            self.check(self.daemon.post(path, example["value"]), path, "post", "200")
        warned = {"objects": [{"type": "sphere", "material": {"shininess": 2000}}]}
        answer = self.daemon.post(path, warned, {"Accept": "application/json"})
        self.check(answer, path, "post", "200")
        self.assertTrue(answer.headers["Shaded-Warning"])
        self.refusals(path)

    def compare_path(self):
        path = "/v1/compare"
        body = DOCUMENT["paths"][path]["post"]["requestBody"]["content"]
        for example in body["application/json"]["examples"].values():
            self.check(self.daemon.post(path, example["value"]), path, "post", "200")
        warned = {**SMALL, "objects": [{"type": "sphere", "material": {"shininess": 2000}}]}
        answer = self.daemon.post(path, warned, {"Accept": "application/json"})
        self.check(answer, path, "post", "200")
        self.assertTrue(answer.headers["Shaded-Warning"])
        black = {"objects": [], "image": {"width": 3, "height": 2}}
        self.check(self.daemon.post(path, black), path, "post", "200")
        self.refusals(path)

    def analyze_path(self):
        path = "/v1/analyze"
        body = DOCUMENT["paths"][path]["post"]["requestBody"]["content"]
        for example in body["application/json"]["examples"].values():
            self.check(self.daemon.post(path, example["value"]), path, "post", "200")
        warned = {**SMALL, "objects": [{"type": "sphere", "material": {"shininess": 2000}}]}
        answer = self.daemon.post(path, warned, {"Accept": "application/json"})
        self.check(answer, path, "post", "200")
        self.assertTrue(answer.headers["Shaded-Warning"])
        nothing = {"objects": [], "image": {"width": 3, "height": 2}, "background": None}
        self.check(self.daemon.post(path, nothing), path, "post", "200")
        self.refusals(path)

    def brdf_path(self):
        path = "/v1/brdf"
        operation = DOCUMENT["paths"][path]["post"]
        for example in operation["requestBody"]["content"]["application/json"]["examples"].values():
            for media_type in operation["responses"]["200"]["content"]:
                answer = self.daemon.post(path, example["value"], {"Accept": media_type})
                self.check(answer, path, "post", "200")
                self.assertEqual(answer.headers["Content-Type"], media_type)
        warned = {"objects": [{"type": "sphere", "material": {"shininess": 2000}}]}
        answer = self.daemon.post(path, warned)
        self.check(answer, path, "post", "200")
        self.assertTrue(answer.headers["Shaded-Warning"])
        self.refusals(path)

    def diff_path(self):
        operation = DOCUMENT["paths"][DIFF]["post"]

        def check(status, document, headers=None):
            answer = self.daemon.post(DIFF, document, headers)
            self.check(answer, DIFF, "post", status)
            return answer

        def pair(scene):
            return {"a": SMALL, "b": scene}

        for example in operation["requestBody"]["content"]["application/json"]["examples"].values():
            for media_type in operation["responses"]["200"]["content"]:
                answer = check("200", example["value"], {"Accept": media_type})
                self.assertEqual(answer.headers["Content-Type"], media_type)
        warned = check("200", pair({**SMALL, "objects": [{"type": "sphere", "material": {"shininess": 2000}}]}))
        self.assertTrue(warned.headers["Shaded-Warning"])
        check("400", b"{")
        self.check(self.daemon.call("PUT", DIFF, b"{}", JSON), DIFF, "post", "405")
        check("406", pair(SMALL), {"Accept": "image/svg+xml"})
        check("409", pair({"objects": [{"type": "mesh", "data": "sha256-" + "0" * 64}]}))
        check("413", b"x" * 100001)
        check("415", pair(SMALL), {"Content-Type": "text/css"})
        for scene in ({}, {"objects": [{"type": "sphere"}]}, {**SMALL, "output": {"channel": "R"}},
                      {**SMALL, "image": {"width": 8192, "height": 8192}}, {**SMALL, "outputs": [{"name": "a"}]}):
            check("422", pair(scene))
        for document in ({"a": SMALL}, {**pair(SMALL), "c": 1}, {**pair(SMALL), "pixelsPerDegree": 9}, []):
            check("422", document)

    def fit_path(self):
        def check(status, document, headers=None):
            answer = self.daemon.post(FIT, document, headers)
            self.check(answer, FIT, "post", status)
            return answer

        examples = DOCUMENT["paths"][FIT]["post"]["requestBody"]["content"]["application/json"]["examples"]
        ball = examples["ball"]["value"]
        photo = self.daemon.render({**ball["scene"], "output": {"format": "webp", "quality": 100}}).body
        known = {**ball, "photo": "sha256-" + hashlib.sha256(photo).hexdigest()}
        check("409", known)
        self.put_asset(self.daemon, "201", photo)
        check("200", known)
        scene = {**ball["scene"], "objects": [{"type": "sphere", "material": {"shininess": 2000}}]}
        warned = check("200", {"scene": scene, "photo": known["photo"]})
        self.assertTrue(warned.headers["Shaded-Warning"])
        check("400", b"{")
        self.check(self.daemon.call("PUT", FIT, b"{}", JSON), FIT, "post", "405")
        check("406", known, {"Accept": "image/png"})
        check("413", b"x" * 100001)
        check("415", known, {"Content-Type": "text/css"})
        for document in ({"scene": SMALL}, {"photo": known["photo"]}, {**known, "object": "bull"}, {**known, "a": 1},
                         {**known, "scene": SMALL}, {**known, "photo": "none.png"}, []):
            check("422", document)

    def put(self, daemon, status, body=b'{"positions": [0,0,0, 1,0,0, 0,1,0]}', digest=None,
            media_type="application/json"):
        path = "/v1/meshes/" + (digest or hashlib.sha256(body).hexdigest())
        answer = daemon.call("PUT", path, body, {"Content-Type": media_type})
        self.check(answer, MESHES, "put", status)
        return answer

    def mesh_path(self):
        body = DOCUMENT["paths"][MESHES]["put"]["requestBody"]["content"]
        for example in body["application/json"]["examples"].values():
            self.put(self.daemon, "201", json.dumps(example["value"]).encode())
        self.put(self.daemon, "201")
        self.put(self.daemon, "204")
        inverted = b'{"positions": [0,0,0, 1,0,0, 0,1,0], "normals": [0,0,-1, 0,0,-1, 0,0,-1]}'
        self.assertTrue(self.put(self.daemon, "201", inverted).headers["Shaded-Warning"])
        self.put(self.daemon, "400", b"{")
        self.put(self.daemon, "404", digest="A" * 64)
        self.put(self.daemon, "413", b"x" * 100001)
        self.put(self.daemon, "415", media_type="text/css")
        self.put(self.daemon, "422", digest="0" * 64)
        self.put(self.daemon, "422", b"{}")
        self.put(self.daemon, "422", b"\0" * 13, media_type="application/octet-stream")
        self.check(self.daemon.call("POST", "/v1/meshes/" + "0" * 64, b"{}", JSON), MESHES, "put",
                   "405")
        with Daemon("--mesh-store", "1K") as daemon:
            self.put(daemon, "422")

    def put_asset(self, daemon, status, body, media_type="image/png", digest=None, **headers):
        path = "/v1/assets/" + (digest or hashlib.sha256(body).hexdigest())
        answer = daemon.call("PUT", path, body, {"Content-Type": media_type, **headers})
        self.check(answer, ASSETS, "put", status)

    def asset_path(self):
        picture = self.daemon.render(SMALL).body
        name = "sha256-" + hashlib.sha256(picture).hexdigest()
        self.check(self.daemon.post(DIFF, {"a": name, "b": SMALL}), DIFF, "post", "409")
        self.put_asset(self.daemon, "201", picture)
        self.put_asset(self.daemon, "204", picture, "application/octet-stream")
        for sides in (name, name), (name, SMALL), (SMALL, name):
            self.check(self.daemon.post(DIFF, dict(zip("ab", sides))), DIFF, "post", "200")
        self.check(self.daemon.post(DIFF, {"a": name, "b": "no name"}), DIFF, "post", "422")
        self.put_asset(self.daemon, "400", b"{", **{"Content-Encoding": "gzip"})
        self.put_asset(self.daemon, "404", picture, digest="A" * 64)
        self.put_asset(self.daemon, "413", b"x" * 100001)
        self.put_asset(self.daemon, "415", picture, "text/css")
        self.put_asset(self.daemon, "415", picture, **{"Content-Encoding": "br"})
        self.put_asset(self.daemon, "422", picture, digest="0" * 64)
        self.put_asset(self.daemon, "422", picture[:-20])
        self.check(self.daemon.call("POST", "/v1/assets/" + "0" * 64, b"{}", JSON), ASSETS, "put", "405")

    def refusals(self, path):
        """What every path that takes a scene refuses alike."""
        def check(answer, status):
            self.check(answer, path, "post", status)

        post = self.daemon.post
        check(post(path, b"{"), "400")
        check(post(path, b"{", {"Content-Encoding": "gzip"}), "400")
        check(self.daemon.call("PUT", path, b"{}", JSON), "405")
        check(post(path, SMALL, {"Accept": "text/css"}), "406")
        check(post(path, {"objects": [{"type": "mesh", "data": "sha256-" + "0" * 64}]}), "409")
        check(post(path, b"x" * 100001), "413")
        check(post(path, SMALL, {"Content-Type": "text/css"}), "415")
        check(post(path, SMALL, {"Content-Encoding": "br"}), "415")
        check(post(path, {}), "422")
        check(post(path, {**SMALL, **{f"x{i}": 0 for i in range(100)}}), "422")
        check(post(path, {**SMALL, "image": {"width": 8192, "height": 8192}}), "422")

    def links(self, daemon, status, kept, scene=SMALL):
        for path, target in ((LINK, link_of(scene)), (KEPT, kept)):
            for method in ("get", "head"):
                self.check(daemon.call(method.upper(), target), path, method, status)

    def busy(self):
        with Daemon("--threads", "1", "--queue", "1", "--timeout", "300") as daemon:
            kept = self.keep(daemon, "201", another(SMALL)).headers["Location"]
            waiting = [occupied(daemon), Client(daemon, another(ENDLESS))]
            wait_until_read(daemon, 1)
            for path in SCENE_PATHS:
                self.check(daemon.post(path, SMALL), path, "post", "429")
            self.put(daemon, "429")
            self.put_asset(daemon, "429", b"")
            self.check(daemon.post(DIFF, {"a": SMALL, "b": SMALL}), DIFF, "post", "429")
            self.check(daemon.post(FIT, {"scene": SMALL, "photo": "a"}), FIT, "post", "429")
            self.keep(daemon, "429", SMALL)
            self.batch(daemon, "429")
            self.links(daemon, "429", kept)
            for method in ("get", "head"):
                self.preview(daemon, method, "429")
            for request in waiting:
                request.leave()

    def unauthorized(self):
        with tempfile.NamedTemporaryFile("w", encoding="ascii") as file:
            file.write("0123456789abcdef\n")
            file.flush()
            with Daemon("--tokens", file.name) as daemon:
                for path, method, operation in operations():
                    if "401" in operation["responses"]:
                        self.check(daemon.call(method.upper(), path), path, method, "401")

    def over_rate(self):
        token = "0123456789abcdef"
        digest = hashlib.sha256(token.encode()).hexdigest()
        with tempfile.NamedTemporaryFile("w", encoding="ascii") as file:
            file.write(f"ci sha256:{digest} rate=1/day\n")
            file.flush()
            with Daemon("--tokens", file.name) as daemon:
                bearer = {"Authorization": f"Bearer {token}"}
                self.assertEqual(daemon.get("/v1/version", bearer).status, 200)
                for path, method, operation in operations():
                    if "401" in operation["responses"]:
                        self.check(daemon.call(method.upper(), path, None, bearer), path, method,
                                   "429")

    def deadline(self):
        with Daemon("--timeout", "1") as daemon:
            for path in ("/v1/render", "/v1/compare", "/v1/analyze"):
                self.check(daemon.post(path, ENDLESS), path, "post", "504")
            kept = self.keep(daemon, "201", ENDLESS).headers["Location"]
            self.links(daemon, "504", kept, ENDLESS)
            many = {"objects": [{"type": "sphere", "material": {
                "model": "phong-normalized", "specular": 0.5, "shininess": i}} for i in range(300)]}
            self.check(daemon.post("/v1/brdf", many), "/v1/brdf", "post", "504")
            self.check(daemon.post(DIFF, {"a": ENDLESS, "b": ENDLESS}), DIFF, "post", "504")
            large = {"image": {"width": 1024, "height": 1024, "samples": 16}, "objects": [{"type": "sphere"}]}
            photo = self.daemon.render({**large, "objects": [], "output": {"format": "webp", "quality": 100}}).body
            self.put_asset(daemon, "201", photo)
            name = "sha256-" + hashlib.sha256(photo).hexdigest()
            self.check(daemon.post(FIT, {"scene": large, "photo": name}), FIT, "post", "504")

    def draining(self):
        daemon = Daemon("--threads", "1", "--timeout", "300", "--drain-time", "300")
        kept = self.keep(daemon, "201", SMALL).headers["Location"]
        running = occupied(daemon)
        daemon.signal()
        wait_until(lambda: daemon.get("/readyz", admin=True).status == 503)
        for path in SCENE_PATHS:
            self.check(daemon.post(path, SMALL), path, "post", "503")
        self.put(daemon, "503")
        self.put_asset(daemon, "503", b"")
        self.check(daemon.post(DIFF, {"a": SMALL, "b": SMALL}), DIFF, "post", "503")
        self.check(daemon.post(FIT, {"scene": SMALL, "photo": "a"}), FIT, "post", "503")
        self.keep(daemon, "503", SMALL)
        self.batch(daemon, "503")
        self.links(daemon, "503", kept)
        for method in ("get", "head"):
            self.preview(daemon, method, "503")
        running.leave()
        self.assertEqual(daemon.wait(), 0, daemon.stderr())


if __name__ == "__main__":
    unittest.main()
