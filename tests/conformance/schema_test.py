"""api/scene.schema.json and the reader accept and refuse the same documents.

Where the reader knows more than a schema can say, the rule is in beyond_schema.json, with a document
that the schema accepts and the reader refuses: nothing else may differ."""

import copy
import glob
import itertools
import json
import os
import random
import re
import subprocess
import unittest

import jsonschema

from conformance.mistakes import FIRST, SECOND, at

SOURCE = os.environ["SHADED_SOURCE"]
BUILD = os.environ["SHADED_BUILD"]
SEED = 20240229
MUTANTS = 1500

with open(os.path.join(SOURCE, "api", "scene.schema.json"), encoding="utf-8") as file:
    SCHEMA = json.load(file)


def one_of(validator, alternatives, instance, _):
    """As jsonschema's own, which collects the mistakes of every alternative, in half the time."""
    count = sum(validator.evolve(schema=each).is_valid(instance) for each in alternatives)
    if count != 1:
        yield jsonschema.ValidationError(f"{count} alternatives are met")


VALIDATOR = jsonschema.validators.extend(jsonschema.Draft202012Validator, {"oneOf": one_of})(SCHEMA)


def read(documents):
    """The reader's answers: {"status", "errors": [[pointer, detail]], "warnings"} for each."""
    lines = "".join(json.dumps(document) + "\n" for document in documents)
    done = subprocess.run([os.path.join(BUILD, "tests", "check_many")], input=lines, text=True,
                          capture_output=True, check=False)
    if done.returncode:
        raise AssertionError(f"check_many failed: {done.stderr}")
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(answers) == len(documents)
    return answers


def scene(*objects, **members):
    return {"objects": list(objects or [{"type": "sphere"}]), **members}


# Together they hold every member that there is.
RICH = [
    FIRST,
    SECOND,
    scene(camera={"type": "orthographic", "height": 3}, background="#000",
          accuracy={"maxError": 0.5, "metric": "code"},
          output={"format": "exr", "colorSpace": "wide", "bitDepth": "half",
                  "layers": ["beauty", "light.0", "depth"]}),
    scene({"type": "sphere", "material": {
        "diffuse": {"wavelengths": [400, 500.5, 700], "values": [0.1, 0.9, 0]}, "ambient": {"spectrum": "TCS01"},
        "emissive": {"spectrum": "F2", "scale": 0.5}, "specular": {"wavelengths": [550], "values": [0.2], "scale": 2},
        "lobes": [{"specular": {"spectrum": "TCS14"}}]}},
        spectral={"channels": 20, "from": 370, "to": 740.5}, ambient={"spectrum": "E"},
        lights=[{"type": "point", "color": {"spectrum": "A"}, "ambient": {"spectrum": "D50", "scale": 0}}]),
    scene(spectral=True), scene(spectral=False),
    scene({"type": "mesh", "positions": [0, 0, 0, 1, 0, 0, 0, 1, 0], "normals": None},
          outputs=[{"name": "one", "format": "jpeg", "bitDepth": 8},
                   {"name": "two", "colorSpace": "YIQ", "channel": "I"},
                   {"name": "three", "format": "hdr", "bitDepth": "float"}]),
]

# What the reader refuses and a schema cannot: the reader's words, and an example.
with open(os.path.join(SOURCE, "tests", "conformance", "beyond_schema.json"),
          encoding="utf-8") as file:
    RULES = json.load(file)
RULES += [
    (r"the limit `pixels`", scene(image={"width": 65535, "height": 65535})),
    (r"the limit `lights`", scene(lights=[{"type": "point"}] * 2000)),
    (r"the limit `triangles`", scene(*[{"type": "torus", "interpolation": "flat",
                                        "segments": 1024}] * 3)),
]


def beyond_schema(answer):
    return all(any(re.search(rule, detail) for rule, _ in RULES) for _, detail in answer["errors"])


# ---- Mutants ----

VALUES = [None, True, False, 0, -1, 1, 0.5, 2, 181, 1e30, "", "zzz", "phong", "#12345", [], {},
          [1, 2], [0, 0, 0], [1, 2, 3], ["x", 1, 2], [1, 1, 1, 1], {"zzz": 1}]


def places(value, path=()):
    yield path
    items = value.items() if isinstance(value, dict) else (
        enumerate(value) if isinstance(value, list) else ())
    for key, item in items:
        yield from places(item, path + (key,))


def mutations(document):
    """(path, change) for every place: replace, add, remove, repeat."""
    for path in places(document):
        value = at(document, path)
        if path:
            yield from ((path, ("set", other)) for other in VALUES if other != value)
            yield path, ("remove", None)
        if isinstance(value, dict):
            yield path, ("add", ("zzz", 1))
            yield path, ("add", ("type", "mesh"))
        if isinstance(value, list) and value:
            yield path, ("repeat", None)
    for kind in ("sphere", "plane", "disc", "box", "cylinder", "cone", "torus", "mesh"):
        for i in range(len(document["objects"])):
            yield ("objects", i, "type"), ("set", kind)
    for kind in ("ambient", "directional", "point", "spot"):
        for i in range(len(document.get("lights", []))):
            yield ("lights", i, "type"), ("set", kind)
    for name, member in (("png", "format"), ("exr", "format"), (8, "bitDepth"),
                         ("half", "bitDepth"), ("float", "bitDepth"), ("sRGB", "colorSpace"),
                         ("A", "channel"), (["beauty"], "layers"), ("name", "name")):
        if "output" in document:
            yield ("output", member), ("set", name)
        for i in range(len(document.get("outputs", []))):
            yield ("outputs", i, member), ("set", name)
    for path in [p for p in places(document) if p and p[-1] == "transform"]:
        yield path + ("matrix",), ("set", [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1])


def mutate(document, path, change):
    document = copy.deepcopy(document)
    kind, value = change
    if kind == "add":
        at(document, path)[value[0]] = value[1]
    elif kind == "repeat":
        target = at(document, path)
        target.append(copy.deepcopy(target[-1]))
    elif kind == "set":
        at(document, path[:-1])[path[-1]] = copy.deepcopy(value)
    else:
        del at(document, path[:-1])[path[-1]]
    return document


def pointer(path):
    return "".join("/" + str(key).replace("~", "~0").replace("/", "~1") for key in path)


def mutants():
    pool = [(document, path, change) for document in RICH
            for path, change in mutations(document)]
    chosen = random.Random(SEED).sample(pool, min(MUTANTS, len(pool)))
    return [(path, change, mutate(document, path, change)) for document, path, change in chosen]


def examples():
    return sorted(glob.glob(os.path.join(SOURCE, "api", "examples", "*.json")))


class Schema(unittest.TestCase):
    def test_schema_is_a_schema(self):
        jsonschema.Draft202012Validator.check_schema(SCHEMA)

    def test_no_member_has_a_default_of_its_own(self):
        """Generators of clients would make it required."""
        for name, part in {"": SCHEMA, **SCHEMA["$defs"]}.items():
            for key, member in part.get("properties", {}).items():
                self.assertNotIn("default", member, f"{name}.{key}")

    def test_examples_are_accepted_by_both(self):
        self.assertGreaterEqual(len(examples()), 14)
        for name in examples():
            with self.subTest(os.path.basename(name)):
                with open(name, encoding="utf-8") as example:
                    VALIDATOR.validate(json.load(example))
        done = subprocess.run([os.path.join(BUILD, "shade"), "check", *examples()], text=True,
                              capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_rich_documents_are_accepted_by_both(self):
        for document, answer in zip(RICH, read(RICH)):
            VALIDATOR.validate(document)
            self.assertEqual(answer["errors"], [])

    def test_rules_beyond_the_schema_are_needed(self):
        answers = read([document for _, document in RULES])
        for (rule, document), answer in zip(RULES, answers):
            with self.subTest(rule):
                VALIDATOR.validate(document)
                self.assertTrue(any(re.search(rule, detail) for _, detail in answer["errors"]),
                                answer)

    def test_mutants_are_refused_identically(self):
        cases = mutants()
        answers = read([document for _, _, document in cases])
        refused = 0
        for (path, change, document), answer in zip(cases, answers):
            with self.subTest(pointer(path), change=change):
                valid = VALIDATOR.is_valid(document)
                accepted = answer["status"] == 0
                if valid and not accepted:
                    self.assertTrue(beyond_schema(answer), f"only the reader: {answer['errors']}")
                else:
                    self.assertEqual(accepted, valid, f"schema {valid}, reader {answer}")
                if not accepted:
                    refused += 1
                    self.assert_near(path, answer)
        self.assertGreater(refused, len(cases) // 2)

    def assert_near(self, path, answer):
        """Some error is about the thing that was changed, or about what holds it."""
        # What these hold is missed elsewhere when it is gone.
        if path[:1] and path[0] in ("materials", "lights", "interpolation", "colorSpace", "workingSpace"):
            return
        around = pointer(path[:1] if path[:1] == ("camera",) else path[:-1])
        self.assertTrue(any(place.startswith(around) or around.startswith(place)
                            for place, _ in answer["errors"]), answer)

    def test_defaults_of_the_schema_are_accepted(self):
        """Written out, the defaults of every kind of thing make a scene."""
        defs = SCHEMA["$defs"]

        def defaults(name):
            """Of the members that refer to a schema which has one."""
            members = {key: defs[member["$ref"].rsplit("/", 1)[1]]
                       for key, member in defs[name]["properties"].items() if "$ref" in member}
            return {key: member["default"] for key, member in members.items()
                    if "default" in member}

        def typed(name):
            kind = defs[name]["properties"]["type"]["const"]
            return {"type": kind, **defaults(name)}

        shapes = ("Sphere", "Plane", "Disc", "Box", "Cylinder", "Cone", "Torus")
        materials = [
            {**defaults("PhongMaterial"), "lobes": [defaults("Lobe")]},
            {"model": "oren-nayar", **defaults("OrenNayarMaterial")},
            {"model": "cook-torrance", **defaults("CookTorranceMaterial"),
             "lobes": [{"roughness": 0.2, **defaults("FacetLobe")}]}]
        document = scene(
            *({**typed(shape), "transform": defaults("TransformSteps"),
               "material": material}
              for shape, material in zip(shapes, itertools.cycle(materials))),
            camera=typed("PerspectiveCamera"), image=defaults("Image"),
            accuracy=defaults("AccuracyTier"), output=defaults("OutputMembers"),
            lights=[typed(f"{kind}Light") for kind in ("Ambient", "Directional", "Point", "Spot")])
        for key, member in SCHEMA["properties"].items():
            target = defs.get(member.get("$ref", "").rsplit("/", 1)[-1], {})
            if "default" in target:
                document[key] = target["default"]
        self.assertLessEqual({"ambient", "background", "interpolation"}, set(document))
        VALIDATOR.validate(document)
        self.assertEqual(read([document])[0]["errors"], [])


if __name__ == "__main__":
    unittest.main()
