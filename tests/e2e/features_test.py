"""`features` of /v1/version: what is named there works, and the contract says what the names stand for."""

import base64
import hashlib
import json
import re
import unittest
import zlib

import yaml

from e2e.daemon import SOURCE, Daemon

SMALL = {"objects": [{"type": "sphere"}], "image": {"width": 8, "height": 8, "samples": 1}}


def packed(scene):
    deflate = zlib.compressobj(wbits=-15)
    data = deflate.compress(json.dumps(scene).encode()) + deflate.flush()
    return base64.urlsafe_b64encode(data).rstrip(b"=").decode()


def with_material(**members):
    return {**SMALL, "objects": [{"type": "sphere", "material": members}]}


def with_output(**members):
    return {**SMALL, "output": members}


class Features(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()
        cls.addClassCleanup(cls.daemon.stop)
        cls.version = json.loads(cls.daemon.get("/v1/version").body)
        cls.features = cls.version["features"]

    def group(self, name):
        return [feature.split(".", 1)[1] for feature in self.features if feature.startswith(name + ".")]

    def put_mesh(self):
        mesh = json.dumps({"positions": [0, 0, 0, 1, 0, 0, 0, 1, 0]}).encode()
        return self.daemon.call("PUT", f"/v1/meshes/{hashlib.sha256(mesh).hexdigest()}", mesh,
                                {"Content-Type": "application/json"})

    def put_asset(self):
        picture = self.daemon.render(SMALL).body
        return self.daemon.call("PUT", f"/v1/assets/{hashlib.sha256(picture).hexdigest()}", picture,
                                {"Content-Type": "image/png"})

    def fit(self):
        scene = with_output(format="webp", quality=100)
        photo = self.daemon.render(scene).body
        digest = hashlib.sha256(photo).hexdigest()
        self.daemon.call("PUT", f"/v1/assets/{digest}", photo, {"Content-Type": "image/webp"})
        return self.daemon.post("/v1/fit", {"scene": scene, "photo": "sha256-" + digest})

    def texture(self, member="diffuse"):
        picture = self.daemon.render(SMALL).body
        digest = hashlib.sha256(picture).hexdigest()
        self.daemon.call("PUT", f"/v1/assets/{digest}", picture, {"Content-Type": "image/png"})
        return self.daemon.render(with_material(**{member: {"texture": "sha256-" + digest}}))

    def put_scene(self):
        return self.daemon.call("PUT", "/v1/scenes", json.dumps(SMALL), {"Content-Type": "application/json"})

    def requests(self):
        """Of each name of one part, a request that needs it."""
        post, render = self.daemon.post, self.daemon.render
        return {
            "analyze": lambda: post("/v1/analyze", SMALL),
            "assets": self.put_asset,
            "batch": lambda: post("/v1/batch", {"scene": SMALL, "variants": [{}]}),
            "bound-layer": lambda: render(with_output(format="exr", colorSpace="lin_rec709", layers=["bound"])),
            "brdf": lambda: post("/v1/brdf", SMALL),
            "budget": lambda: render({**SMALL, "accuracy": {"maxError": 1}}),
            "codec-budget": lambda: render({**SMALL, "accuracy": {"maxError": 90, "metric": "code"},
                                            "output": {"format": "jpeg"}}),
            "compare": lambda: post("/v1/compare", SMALL),
            "css-colors": lambda: render(with_material(diffuse="rebeccapurple")),
            "fit": self.fit,
            "diff": lambda: post("/v1/diff", {"a": SMALL, "b": SMALL}),
            "explain": lambda: post("/v1/explain", SMALL),
            "specular-antialiasing": lambda: render(with_material(specular=0.5, specularAntialiasing=True)),
            "layers": lambda: render(with_output(format="exr", layers=["depth"])),
            "links": lambda: self.daemon.get(f"/v1/scene/{packed(SMALL)}.png"),
            "meshes": self.put_mesh,
            "opacity": lambda: render(with_material(opacity=0.5)),
            "outputs": lambda: render({**SMALL, "outputs": [{"name": "a"}, {"name": "b"}]}),
            "patterns": lambda: render(with_material(diffuse={"pattern": "checker", "colors": [0, 1]})),
            "preview": lambda: self.daemon.get("/v1/preview/brass?size=8"),
            "region": lambda: render({**SMALL, "image": {**SMALL["image"], "region": [0, 0, 4, 4]}}),
            "scenes": self.put_scene,
            "shared-meshes": lambda: render({
                **SMALL, "meshes": {"a": {"positions": [0, 0, 0, 1, 0, 0, 0, 1, 0]}},
                "objects": [{"type": "mesh", "mesh": "a"}]}),
            "spectral": lambda: render({**SMALL, "spectral": {}}),
            "sheet": lambda: post("/v1/batch", {"scene": SMALL, "sheet": {"labels": False}}),
            "turntable": lambda: post("/v1/batch", {"scene": SMALL, "turntable": {"frames": 2}}),
            "sweep": lambda: post("/v1/batch", {"scene": with_material(shininess=3),
                                                "sweep": {"/objects/0/material/shininess": [3, 9]}}),
            "textures": self.texture,
            "gloss-patterns": lambda: render(with_material(
                specular=0.5, shininess={"pattern": "checker", "values": [8, 200]})),
            "normal-maps": lambda: self.texture("normal"),
            "normal-patterns": lambda: render(with_material(
                normal={"pattern": "checker", "colors": ["#8080ff", [0.6, 0.5, 0.9]]})),
            "fresnel-patterns": lambda: render(with_material(
                model="cook-torrance",
                fresnel={"f0": {"pattern": "checker", "colors": [0.04, [1, 0.8, 0.3]]}})),
            "trace": lambda: render({**SMALL, "trace": {"shadows": True}}),
        }

    def test_each_name_stands_for_what_works(self):
        requests = self.requests()
        self.assertEqual(sorted(name for name in self.features if "." not in name), sorted(requests))
        for name, ask in requests.items():
            with self.subTest(name):
                answer = ask()
                self.assertIn(answer.status, (200, 201, 204), answer.body[:500])

    def test_the_contract_has_each(self):
        document = yaml.safe_load((SOURCE / "api/openapi.yaml").read_text())
        feature = document["components"]["schemas"]["Version"]["properties"]["features"]
        told = set(re.findall("`([a-z0-9.-]+)`", feature["description"]))
        self.assertEqual({name for name in self.features if "." not in name} - told, set())
        groups = {name.split(".")[0] for name in self.features if "." in name}
        self.assertEqual(groups - {name.split(".")[0] for name in told if "." in name}, set())
        for name in self.features:
            self.assertRegex(name, feature["items"]["pattern"])
        self.assertEqual(len(self.features), len(set(self.features)))

    def test_groups_are_what_scenes_may_name(self):
        self.assertEqual(self.group("format"), self.version["formats"])
        # Some models have required members, which materials of the library have.
        presets = {preset["model"]: preset["name"]
                   for preset in json.loads(self.daemon.get("/v1/materials").body)["materials"]}
        for name in self.group("model"):
            material = {"preset": presets[name]} if name in presets else {"model": name}
            self.assertEqual(self.daemon.render(with_material(**material)).status, 200, name)
        for name in self.group("scope"):
            self.assertEqual(self.daemon.render(with_output(scope=name)).status, 200, name)
        schemas = yaml.safe_load((SOURCE / "api/openapi.yaml").read_text())["components"]["schemas"]
        kinds = set(schemas["TypedLight"]["discriminator"]["mapping"])
        self.assertEqual(set(self.group("light")), kinds)

    def test_kernels_are_those_that_may_be_named(self):
        self.assertIn(self.version["kernel"], self.group("kernel"))
        for name in self.group("kernel"):
            with Daemon("--kernel", name) as daemon:
                self.assertEqual(json.loads(daemon.get("/v1/version").body)["kernel"], name)

    def test_ocio_is_the_library_of_this_build(self):
        version = self.version["libraries"]["OpenColorIO"]
        self.assertEqual(self.group("ocio"), [".".join(version.split(".")[:2])])


if __name__ == "__main__":
    unittest.main()
