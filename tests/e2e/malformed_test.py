"""Bodies that are no scenes: each is answered by a problem document that names the place, and the
daemon goes on."""

import json
import re
import unittest

from e2e.daemon import SMALL, Daemon

# The contract's own example, with everything in it.
FULL = {
    "camera": {"type": "perspective", "position": [0, 0, 4], "target": [0, 0, 0],
               "up": [0, 1, 0], "fov": 40},
    "image": {"width": 16, "height": 12, "samples": 1},
    "ambient": [0.1, 0.1, 0.1],
    "background": [0, 0, 0],
    "lights": [
        {"type": "point", "position": [3, 3, 3], "color": [1, 1, 1], "intensity": 1,
         "attenuation": [1, 0, 0]},
        {"type": "directional", "direction": [0, -1, -1], "color": "#ffeedd"},
        {"type": "spot", "position": [0, 4, 0], "direction": [0, -1, 0], "angle": 30,
         "penumbra": 0.2, "exponent": 0, "frame": "camera"},
        {"position": [1, 1, 1, 0]}],
    "materials": {"brass": {"emissive": 0, "ambient": [0.33, 0.22, 0.03],
                            "diffuse": [0.78, 0.57, 0.11], "specular": [0.99, 0.94, 0.81],
                            "shininess": 27.9}},
    "objects": [
        {"type": "sphere", "radius": 1, "material": "brass",
         "transform": {"translate": [0, 0, 0], "rotate": [0, 0, 0], "scale": 1}},
        {"type": "mesh", "positions": [0, 0, 0, 1, 0, 0, 0, 1, 0], "indices": [0, 1, 2],
         "normals": None, "material": {"diffuse": "#808080"}}],
    "interpolation": "phong",
    "accuracy": {"tier": "standard"},
    "output": {"format": "png", "display": "sRGB", "view": "Standard", "bitDepth": 8},
}
TEXT = json.dumps(FULL).encode()
SCENE = b'{"objects":[{"type":"sphere"%s}]%s}'


def pointers(value, place=""):
    """Every place of a document."""
    yield place
    items = value.items() if isinstance(value, dict) else \
        enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield from pointers(item, f"{place}/{key}")


def replaced(document, pointer, value):
    """A copy of the document with another value at the place."""
    if not pointer:
        return value
    copy = json.loads(json.dumps(document))
    at = copy
    *way, last = pointer.split("/")[1:]
    for key in way:
        at = at[int(key) if isinstance(at, list) else key]
    at[int(last) if isinstance(at, list) else last] = value
    return copy


def syntax_cases():
    """(name, body): not JSON."""
    for cut in range(0, len(TEXT), 15):
        yield f"truncated at {cut}", TEXT[:cut]
    for value in (b"NaN", b"Infinity", b"-Infinity", b"nan", b"1e999", b"-1e999", b"01", b"+1",
                  b".5", b"1.", b"0x10", b"1e", b"'a'", b"undefined", b"True", b"\xff", b"",
                  b'"\xc3\x28"', b'"\xed\xa0\x80"', b'"\xf5\x80\x80\x80"', b'"\xc0\x80"',
                  b'"\x01"', b'"\n"', b'"\\x41"', b'"\\ud800"', b'"\\u12"', b"[1,]", b"{,}",
                  b"1 2", b"/**/1", b"1e" + b"9" * 1000, b"-"):
        yield f"value {value[:20]}", SCENE % (b',"radius":' + value, b"")
    yield "duplicate key", SCENE % (b',"radius":1,"radius":1', b"")
    yield "duplicate escaped key", SCENE % (b',"radius":1,"r\\u0061dius":1', b"")
    yield "trailing text", SCENE % (b"", b"") + b"x"
    yield "two documents", (SCENE % (b"", b"")) * 2
    yield "trailing NUL", SCENE % (b"", b"") + b"\0"
    yield "NUL", b"\0"
    yield "NUL inside", SCENE % (b',"\0":1', b"")
    yield "NUL escaped in a key", SCENE % (b',"a\\u0000":1', b"")
    yield "BOM", b"\xef\xbb\xbf" + SCENE % (b"", b"")
    yield "UTF-16", TEXT.decode().encode("utf-16")
    yield "blanks", b" \n\t" * 100
    yield "100,000 arrays", b"[" * 100000
    yield "100,000 closed arrays", b"[" * 100000 + b"]" * 100000
    yield "100,000 objects", b'{"a":' * 100000
    yield "nested value", SCENE % (b',"radius":' + b"[" * 100000 + b"]" * 100000, b"")
    yield "random bytes", bytes((i * 7919 + i * i) % 256 for i in range(10000))
    yield "form", b"objects=sphere&radius=1"
    yield "XML", b"<scene/>"
    yield "a long unfinished string", b'{"objects":"' + b"x" * 1000000


def scene_cases():
    """(name, body, the place, or None for any): JSON, but no scenes."""
    for value in (b"null", b"true", b"1", b'"x"', b"[]", b"{}", b"[{}]", b'""', b"1e300"):
        yield f"document {value}", value, ""
    for place in pointers(FULL):
        yield f"true at {place}", json.dumps(replaced(FULL, place, True)).encode(), place
    for place in pointers(FULL):
        wrong = {"unheard": {"of": []}}
        if place == "/materials":
            continue  # there, it is a material by that name
        body = json.dumps(replaced(FULL, place, wrong)).encode()
        yield f"an object at {place}", body, None
    for member, place in ((b'"radius":0', "radius"), (b'"radius":-1', "radius"),
                          (b'"radius":"1"', "radius"), (b'"radius":null', "radius"),
                          (b'"radius":[1]', "radius"), (b'"radiu":1', "radiu"),
                          (b'"RADIUS":1', "RADIUS"), (b'"":1', ""), (b'"a/b~c":1', "a~1b~0c"),
                          (b'"\xc3\xa9":1', "\u00e9"), (b'"material":"none"', "material"),
                          (b'"material":{"preset":"none"}', "material/preset"),
                          (b'"material":{"shininess":-1}', "material/shininess"),
                          (b'"material":{"diffuse":"#12"}', "material/diffuse"),
                          (b'"material":{"diffuse":[1,2]}', "material/diffuse"),
                          (b'"transform":{"scale":0}', "transform/scale"),
                          (b'"transform":{"matrix":[1]}', "transform/matrix")):
        yield member.decode(), SCENE % (b"," + member, b""), "/objects/0/" + place
    for member, place in ((b'"image":{"width":0}', "/image/width"),
                          (b'"image":{"width":1.5}', "/image/width"),
                          (b'"image":{"width":1e30}', "/image/width"),
                          (b'"image":{"width":99999999999999999999999}', "/image/width"),
                          (b'"image":{"samples":65}', "/image/samples"),
                          (b'"image":{"width":100000,"height":100000}', None),
                          (b'"camera":{"fov":180}', "/camera/fov"),
                          (b'"camera":{"up":[0,0,0]}', "/camera/up"),
                          (b'"output":{"format":"gif"}', "/output/format"),
                          (b'"output":{"bitDepth":7}', "/output/bitDepth"),
                          (b'"output":{"display":"none"}', "/output/display"),
                          (b'"output":{},"outputs":[]', None),
                          (b'"outputs":[{}]', None),
                          (b'"interpolation":"none"', "/interpolation"),
                          (b'"lights":[{"type":"none"}]', "/lights/0/type"),
                          (b'"accuracy":{"tier":"none"}', "/accuracy/tier"),
                          (b'"colorSpace":"none"', "/colorSpace"),
                          (b'"workingSpace":"YIQ"', "/workingSpace")):
        yield member.decode(), SCENE % (b"", b"," + member), place
    yield "no objects", b'{"lights":[]}', ""
    yield "an unknown object", b'{"objects":[{"type":"none"}]}', "/objects/0/type"
    yield "no type", b'{"objects":[{}]}', None
    yield "a mesh without vertices", b'{"objects":[{"type":"mesh"}]}', None
    yield "an index out of range", (b'{"objects":[{"type":"mesh","positions":[0,0,0,1,0,0,0,1,0],'
                                    b'"indices":[0,1,3]}]}'), "/objects/0/indices/2"
    yield "100,000 unknown members", json.dumps(
        {**SMALL, **{f"x{i}": i for i in range(100000)}}).encode(), "/x0"
    yield "a long member", SCENE % (b',"' + b"x" * 100000 + b'":1', b""), None
    yield "a long name", SCENE % (b',"material":"' + b"\xc3\xa9" * 100000 + b'"', b""), None
    yield "deep, but within JSON's limit", SCENE % (
        b',"radius":' + b"[" * 1500 + b"]" * 1500, b""), None


class MalformedTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon("--log-requests", "off", "--timeout", "300")
        cls.count = 0

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def assert_problem(self, body, statuses, names):
        answer = self.daemon.render(body)
        type(self).count += 1
        self.assertIn(answer.status, statuses, answer.body[:500])
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        self.assertEqual(answer.headers["Cache-Control"], "no-store")
        problem = json.loads(answer.body)
        self.assertEqual(problem["status"], answer.status)
        self.assertIn(problem["type"], [f"urn:shaded:problem:{name}" for name in names])
        self.assertTrue(problem["detail"])
        self.assertTrue(problem["errors"])
        for error in problem["errors"]:
            self.assertRegex(error["pointer"], r"\A(/([^~/]|~[01])*)*\Z")
            self.assertTrue(error["detail"])
        self.assertLess(len(answer.body), 200000)
        return problem

    def test_syntax_errors_have_line_and_column(self):
        for name, body in syntax_cases():
            with self.subTest(name):
                problem = self.assert_problem(body, {400}, ["syntax"])
                self.assertGreaterEqual(problem["line"], 1)
                self.assertGreaterEqual(problem["column"], 0)
                self.assertRegex(problem["detail"], r"line \d+, column \d+")

    def test_the_line_and_column_are_right(self):
        problem = self.assert_problem(b'{\n  "objects": [\n    {"type": sphere}]}', {400},
                                      ["syntax"])
        self.assertEqual(problem["line"], 3)
        self.assertIn(problem["column"], range(13, 20))

    def test_scene_errors_have_pointers(self):
        for name, body, place in scene_cases():
            with self.subTest(name):
                problem = self.assert_problem(body, {422}, ["scene", "limit"])
                found = [error["pointer"] for error in problem["errors"]]
                if place is not None:
                    self.assertIn(place, found)
                self.assertNotIn("line", problem)

    def test_all_errors_come_in_one_answer(self):
        body = json.dumps({"objects": [{"type": "sphere", "radius": -1, "colour": 1}],
                           "image": {"widht": 4, "samples": 0}, "lights": 7}).encode()
        problem = self.assert_problem(body, {422}, ["scene"])
        self.assertEqual({error["pointer"] for error in problem["errors"]},
                         {"/objects/0/radius", "/objects/0/colour", "/image/widht",
                          "/image/samples", "/lights"})
        self.assertIn("width", next(error["detail"] for error in problem["errors"]
                                    if error["pointer"] == "/image/widht"))
        self.assertRegex(problem["detail"], r"\(and 4 more\)")

    def test_more_errors_than_are_told_are_counted(self):
        body = json.dumps({**SMALL, **{f"x{i}": i for i in range(200)}}).encode()
        problem = self.assert_problem(body, {422}, ["scene"])
        self.assertEqual((len(problem["errors"]), problem["errorCount"]), (64, 200))

    def test_limits_are_named(self):
        for change, word in (({"image": {"width": 8192, "height": 8192}}, "pixels"),
                             ({"image": {"width": 4096, "height": 4096, "samples": 17}},
                              "samples"),
                             ({"image": {"width": 4096, "height": 4096, "samples": 1},
                               "lights": [{"position": [1, 1, 1, 0]}] * 9,
                               "output": {"format": "exr", "layers": [
                                   "diffuse", "specular", "normal", "position",
                                   *(f"light.{i}" for i in range(9))]}}, "memory"),
                             ({"lights": [{"position": [1, 1, 1, 0]}] * 10001}, "lights"),
                             ({"objects": [{"type": "sphere"}] * 10001}, "objects")):
            problem = self.assert_problem(json.dumps({**SMALL, **change}).encode(), {422},
                                          ["limit"])
            self.assertRegex(problem["detail"], re.escape(f"`{word}`"))

    def test_there_are_enough_cases(self):
        names = [case[0] for case in syntax_cases()] + [case[0] for case in scene_cases()]
        self.assertGreaterEqual(len(set(names)), 300)

    def tearDown(self):
        answer = self.daemon.render(SMALL)
        self.assertEqual(answer.status, 200)


if __name__ == "__main__":
    unittest.main()
