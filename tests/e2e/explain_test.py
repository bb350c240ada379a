"""POST /v1/explain and `shade explain`: what is used, what is left out and why, in JSON and words."""

import json
import math
import os
import pty
import re
import subprocess
import unittest

from e2e.daemon import BUILD, SMALL, Daemon
from e2e.daemon_test import Folder

SHADE = BUILD / "shade"
SPHERE = {"type": "sphere", "material": {"specular": 0.5, "shininess": 50}}
SCENE = {"image": {"width": 64, "height": 48, "samples": 4}, "objects": [SPHERE], "lights": [
    {"type": "ambient"},
    {"type": "point", "intensity": 0},
    {"type": "point", "position": [0, 0, -5]},
    {"type": "spot", "position": [0, 4, 0], "direction": [0, 1, 0]},
    {"type": "point"}]}
BUDGET = {**SCENE, "lights": [{"type": "point"}, {"type": "point", "intensity": 1e-9}],
          "accuracy": {"maxError": 0.5}}
UNREACHABLE = {**SCENE, "accuracy": {"maxError": 1e-12, "metric": "linear"}}


def why(told):
    return [light["why"] for light in told["lights"]["list"]]


class Http(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon()

    @classmethod
    def tearDownClass(cls):
        cls.daemon.stop()

    def explain(self, scene, status=200):
        answer = self.daemon.post("/v1/explain", scene)
        self.assertEqual(answer.status, status, answer.body)
        return json.loads(answer.body)

    def test_compression_of_png_has_its_cost(self):
        plans = [self.explain({**SCENE, "output": {"format": "png", "compression": name}})
                 for name in ("fast", "default", "small")]
        self.assertEqual([plan["outputs"][0]["encoder"] for plan in plans], ["libdeflate", "own", "libdeflate"])
        costs = [plan["tiers"][0]["milliseconds"]["encode"] for plan in plans]
        self.assertEqual(costs, sorted(costs))
        self.assertGreater(costs[2], 5 * costs[1])

    def test_lights_that_are_left_out_have_their_reasons(self):
        told = self.explain(SCENE)
        self.assertEqual(told["lights"]["given"], 5)
        self.assertEqual(told["lights"]["used"], 1)
        self.assertEqual(why(told), ["it is part of the ambient term", "its color is black",
                                     "it is behind all that is seen",
                                     "its cone misses the objects", None])
        self.assertIn("Light 2 is left out: it is behind all that is seen.", told["words"])

    def test_numbers_that_are_patterns_are_told_with_their_range_and_as_the_reason_of_the_tier(self):
        told = self.explain({**SCENE, "objects": [{"type": "sphere", "material": {
            "specular": 0.5, "shininess": {"pattern": "checker", "values": [8, 200]}}}]})
        self.assertEqual(told["materials"]["groups"][0]["patterns"],
                         [{"pattern": "checker", "coefficient": "shininess", "lobe": 0, "range": [8, 200]}])
        self.assertIn("Tier exact: the only one for exponents and roughness that are patterns or pictures.", told["words"])

    def test_terms_are_used_or_not_and_why(self):
        told = self.explain({**SCENE, "objects": [{"type": "sphere"}]})
        used = {term["term"]: term["used"] for term in told["terms"]}
        self.assertEqual(used, {"emission": False, "ambient": True, "diffuse": True,
                                "specular": False, "attenuation": False, "spots": False})
        for term in told["terms"]:
            self.assertEqual(term["why"] is None, term["used"])

    def test_the_plan_is_that_of_the_picture(self):
        for scene in (SCENE, BUDGET, SMALL, {**SCENE, "accuracy": {"tier": "exact"}}):
            told = self.explain(scene)
            self.assertEqual(told["plan"], self.daemon.render(scene).headers["Shaded-Plan"])
            match = re.fullmatch(r"tier=(\w+); lights=(\d+)/(\d+); error<=.*", told["plan"])
            self.assertEqual(match.groups(), (told["tier"], str(told["lights"]["used"]),
                                              str(told["lights"]["given"])))

    def test_draft_takes_fewer_samples_and_says_so(self):
        told = self.explain({**SCENE, "accuracy": {"tier": "draft"}})
        self.assertEqual((told["asked"], told["tier"]), ({"tier": "draft"}, "draft"))
        self.assertEqual(told["samples"], {"pixel": 4, "pattern": "mixed"})
        left_out = told["leftOut"]["samples"]
        self.assertAlmostEqual(left_out["absolute"], 2 ** -13, 9)
        self.assertEqual(left_out["relative"], 2 ** -8)
        self.assertIn("kernels, as asked for.", told["words"][0])
        self.assertTrue(any("one at the center" in line for line in told["words"]))
        draft, standard, _ = told["tiers"]
        self.assertEqual((draft["tier"], draft["bound"]["linear"]),
                         ("draft", told["bound"]["linear"]["most"]))
        self.assertGreater(draft["bound"]["linear"], 2 ** -13)
        for stage in ("visibility", "shade"):
            self.assertLess(draft["milliseconds"][stage], standard["milliseconds"][stage])

    def test_drafts_of_one_sample_are_sketched_and_say_so(self):
        lights = [{"type": "directional", "direction": [0, -1, -1]}]
        scene = {"image": {"width": 64, "height": 48, "samples": 1}, "lights": lights,
                 "objects": [{"type": "sphere"}]}
        for accuracy, limit in (({"tier": "draft"}, 1e-4), ({"maxError": 1e-3, "metric": "linear"}, 1e-3),
                                ({"maxError": 0.5}, 1e-2)):
            told = self.explain({**scene, "accuracy": accuracy})
            self.assertEqual((told["tier"], told["samples"]["pattern"]), ("draft", "center"))
            self.assertLess(told["bound"]["linear"]["most"], limit)
            self.assertTrue(any("Sketches: " in line for line in told["words"]))
            draft, standard, _ = told["tiers"]
            for stage in ("visibility", "shade"):
                self.assertLess(draft["milliseconds"][stage], standard["milliseconds"][stage])
        for accuracy in ({"maxError": 1e-6, "metric": "linear"}, {"tier": "standard"}):
            told = self.explain({**scene, "accuracy": accuracy})
            self.assertNotEqual(told["tier"], "draft")
            self.assertFalse(any("Sketches: " in line for line in told["words"]))

    def test_values_beyond_floats_are_lit_exactly(self):
        for intensity, diffuse, tier in ((1e40, 1e-38, "exact"), (1e39, 1e-3, "exact"), (1e20, 1e18, "exact"),
                                         (1e20, 1e-20, "standard"), (1, 1e-40, "standard")):
            lights = [{"type": "point", "position": [2, 3, 4], "intensity": intensity}]
            told = self.explain({"lights": lights, "objects": [{"type": "sphere", "material": {"diffuse": diffuse}}]})
            self.assertEqual(told["tier"], tier, (intensity, diffuse))

    def test_draft_is_standard_where_it_knows_no_better_and_says_so(self):
        for change in ({"objects": [{"type": "torus"}]}, {"interpolation": "flat"},
                       {"output": {"format": "exr", "layers": ["beauty", "diffuse"]}}):
            with self.subTest(**change):
                draft, standard = ({**SCENE, **change, "accuracy": {"tier": tier}}
                                   for tier in ("draft", "standard"))
                told = self.explain(draft)
                self.assertEqual((told["asked"], told["tier"]), ({"tier": "draft"}, "standard"))
                self.assertIn("draft was asked for, which is another one only", told["words"][0])
                pictures = [self.daemon.render(scene) for scene in (draft, standard)]
                self.assertEqual(pictures[0].body, pictures[1].body)
                plans = [picture.headers["Shaded-Plan"] for picture in pictures]
                self.assertEqual(plans[0], plans[1].replace("; lights", "; asked=draft; lights"))
                self.assertEqual([tier["tier"] for tier in told["tiers"]], ["standard", "exact"])

    def test_groups_of_many_lights_are_told_under_a_budget(self):
        lamps = [{"type": "point", "position": [0.1 * i, 9, 9]} for i in range(70)]
        for accuracy, grouped in (({"maxError": 0.5}, True), ({"tier": "standard"}, False)):
            scene = {**SMALL, "lights": lamps, "accuracy": accuracy}
            told = self.explain(scene)
            groups = told["lights"].get("groups")
            self.assertEqual(groups is not None, grouped)
            if grouped:
                self.assertTrue(1 < groups <= told["lights"]["used"] / 4)
                self.assertIn(f"; groups={groups}; ", told["plan"])
            self.assertEqual(told["plan"], self.daemon.render(scene).headers["Shaded-Plan"])

    def test_estimates_count_objects_however_small_and_the_kernel(self):
        def visibility(objects, samples=16):
            return self.explain({"objects": objects, "image": {
                "width": 128, "height": 128, "samples": samples}})["milliseconds"]["visibility"]

        # Each is asked for at every ray of its blocks of pixels, not of the pixels that it covers,
        # which are a tenth of the one's.
        small = [{"type": "sphere", "radius": 0.01, "transform": {
            "translate": [math.sin(i), math.sin(2 * i), math.sin(3 * i)]}} for i in range(1000)]
        needle = {"type": "cylinder", "radius": 0.005, "height": 2}
        one = visibility([{"type": "sphere"}])
        self.assertGreater(visibility(small), 5 * one)
        self.assertGreater(visibility([needle]), one / 20)
        told = {name: json.loads(subprocess.run(
            [BUILD / "shade", "explain", "-", "--kernel", name], input=json.dumps(SCENE).encode(),
            capture_output=True, check=True).stdout) for name in ("auto", "portable")}
        costs = {each["kernel"]: each["milliseconds"]["shade"] for each in told.values()}
        if len(costs) > 1:
            self.assertGreater(costs["portable"], 1.5 * min(costs.values()))

    def test_budgets_are_met_by_leaving_out(self):
        told = self.explain(BUDGET)
        self.assertEqual(told["asked"], {"maxError": 0.5, "metric": "deltaE2000"})
        self.assertEqual(told["tier"], "draft")
        self.assertEqual(why(told), [None, "what it adds is under the budget"])
        self.assertLessEqual(told["bound"]["deltaE2000"]["most"], 0.5)
        self.assertEqual(told["samples"]["pattern"], "mixed")
        self.assertTrue(any("against the same" in line for line in told["words"]))
        self.assertGreater(told["leftOut"]["lights"], 0)

    def test_budgets_that_nothing_meets_are_refused_everywhere(self):
        for path in ("/v1/explain", "/v1/render"):
            answer = self.daemon.post(path, UNREACHABLE)
            self.assertEqual(answer.status, 422)
            error, = json.loads(answer.body)["errors"]
            self.assertEqual(error["pointer"], "/accuracy/maxError")
            self.assertRegex(error["detail"], "`exact` reaches [0-9.e-]+$")

    def test_what_is_not_known_is_null_and_why(self):
        told = self.explain({**SCENE, "output": {"colorSpace": "HSV"}})
        code = told["bound"]["code"]
        self.assertIsNone(code["most"])
        self.assertTrue(code["why"])
        self.assertIsNotNone(told["bound"]["deltaE2000"]["most"])
        self.assertNotIn("code,", told["plan"])
        self.assertEqual(told["outputs"][0]["color"], "floats")

        beyond = self.explain({"objects": [{"type": "sphere", "material": {"emissive": 1e300}}]})
        self.assertIsNone(beyond["bound"]["linear"]["most"])
        why = beyond["bound"]["linear"]["why"]
        self.assertIn("exceed what floats hold", why)
        self.assertIn(f"Error: not bounded in linear components, as {why}.", beyond["words"])

    def test_nothing_is_rendered(self):
        huge = {**SCENE, "image": {"width": 4096, "height": 4096, "samples": 1}}
        small = {**SCENE, "image": {"width": 64, "height": 64, "samples": 1}}
        total = self.explain(small)["milliseconds"]["total"]
        self.assertGreater(self.explain(huge)["milliseconds"]["total"], 10 * total)

    def test_quarters_of_blocks_are_told_where_they_are_looked_at(self):
        for samples, told in (8, True), (11, True), (12, False), (64, False):
            words = self.explain({**SCENE, "image": {**SCENE["image"], "samples": samples}})["words"]
            line = next(line for line in words if line.startswith("Samples: "))
            self.assertEqual(("8 x 8" in line, "4 x 4" in line), (told, not told), line)

    def test_tiers_with_environments_are_told_apart(self):
        scene = {"image": SCENE["image"], "lights": [{"type": "environment", "map": "studio"}],
                 "objects": [{"type": "sphere", "material": {"specular": 1, "shininess": 20}}]}
        said = "Environments are summed less closely than where the tier exact is asked for."
        for tier in "standard", "exact":
            words = self.explain({**scene, "accuracy": {"tier": tier}})["words"]
            self.assertEqual((said in words, any(line.startswith("Tier exact would take") for line in words)),
                             (tier == "standard",) * 2)

    def test_an_environment_is_summed_for_each_index_of_a_spectral_metal(self):
        scene = {"image": SCENE["image"], "spectral": {"channels": 90}, "lights": [{"type": "environment", "map": "sky"}]}
        costs = [self.explain({**scene, "objects": [{"type": "sphere", "material": {
            "model": "cook-torrance", "diffuse": 0, "ambient": 0, "fresnel": {"n": n}}}]})["milliseconds"]["shade"]
            for n in (1.5, "gold")]
        self.assertAlmostEqual(costs[1] / costs[0], 30, 0)

    def test_words_tell_the_estimates_of_the_rest(self):
        told = self.explain(SCENE)
        said = " ".join(told["words"])
        cost = told["milliseconds"]
        for text, value in ((r"Cost: about (\S+) ms", cost["total"]), (r"(\S+) to see", cost["visibility"]),
                            (r"(\S+) to shade", cost["shade"]), (r"(\S+) to encode", cost["encode"])):
            self.assertAlmostEqual(float(re.search(text, said)[1]) / value, 1, 1)
        for tier in told["tiers"]:
            if tier["tier"] != told["tier"]:
                about = re.search(rf"Tier {tier['tier']} would take about (\S+) ms", said)
                self.assertAlmostEqual(float(about[1]) / tier["milliseconds"]["total"], 1, 1)

    def test_trees_are_told(self):
        self.assertNotIn("trees", self.explain(SCENE))
        triangle = {"positions": [0, 0, 0, 1, 0, 0, 0, 1, 0]}
        twice = [{"type": "mesh", "mesh": "one"}, {"type": "mesh", "mesh": "one", "transform": {"translate": [1, 0, 0]}}]
        told = self.explain({"meshes": {"one": triangle}, "objects": [
            *twice, {"type": "mesh", **triangle}, {"type": "sphere", "interpolation": "flat", "segments": 16}]})
        trees = told["trees"]
        faces = trees["triangles"] - 2
        self.assertEqual((trees["built"], trees["reused"], trees["nodes"]), (3, 1, faces + 1))
        self.assertGreater(faces, 100)
        self.assertGreater(trees["bytes"], 64 * trees["triangles"])
        cost = told["milliseconds"]
        self.assertAlmostEqual(cost["build"] / 350e-6, trees["triangles"], 6)
        parts = [value for name, value in cost.items() if name != "total"]
        self.assertAlmostEqual(sum(parts), cost["total"], 6)
        self.assertIn(f"for trees over {trees['triangles']} triangles", " ".join(told["words"]))

    def test_estimates_know_what_is_seen(self):
        def visibility(**thing):
            told = self.explain({"objects": [thing], "image": {"samples": 16}})
            return told["milliseconds"]["visibility"]

        whole = visibility(type="box", size=[1, 1, 1])
        self.assertGreater(whole, 5 * visibility(type="box", size=[0.02, 1, 0.02]))
        sphere = visibility(type="sphere")
        flat = visibility(type="sphere", interpolation="flat")
        self.assertGreater(flat, 2 * sphere)
        self.assertGreater(visibility(type="sphere", interpolation="flat", segments=200), 2 * flat)
        self.assertGreater(visibility(type="sphere", transform={"scale": [1, 0.9, 1]}), 1.5 * sphere)
        for away in ([100, 0, 0], [0, 0, 100]):  # beside the picture; behind the camera
            self.assertLess(visibility(type="sphere", transform={"translate": away}), sphere / 5)

    def test_estimates_know_lights_that_want_f64(self):
        def shade(tier, kind, **light):
            told = self.explain({"objects": [{"type": "sphere"}], "accuracy": {"tier": tier},
                                 "lights": 4 * [{"type": kind, "position": [0, 0, 5], **light}]})
            return told["milliseconds"]["shade"]

        spot = {"kind": "spot", "direction": [0, 0, -1], "angle": 60}
        self.assertGreater(shade("exact", **spot), 1.3 * shade("exact", "point"))
        self.assertGreater(shade("standard", **spot, exponent=1e6), 1.3 * shade("standard", **spot))

    def test_compare_tells_bounds_that_hold(self):
        answer = self.daemon.post("/v1/compare", SCENE)
        tiers = json.loads(answer.body)["tiers"]
        self.assertEqual([tier["tier"] for tier in tiers], ["draft", "standard", "exact"])
        for tier in tiers:
            self.assertLessEqual(tier["error"]["linear"]["max"], tier["bound"]["linear"])
            self.assertLessEqual(tier["error"]["code"]["max"], tier["bound"]["code"])
            self.assertLessEqual(tier["error"]["deltaE2000"]["max"], tier["bound"]["deltaE2000"])


class Cli(Folder):
    def setUp(self):
        super().setUp()
        self.file(json.dumps(SCENE), "scene.json")

    def shade(self, *arguments, **options):
        return subprocess.run([SHADE, "explain", *arguments], cwd=self.folder, check=False,
                              capture_output=True, timeout=500, **options)

    def on_terminal(self, *arguments):
        """What is written to a terminal."""
        ours, theirs = pty.openpty()
        process = subprocess.Popen([SHADE, "explain", *arguments], cwd=self.folder, stdout=theirs)
        os.close(theirs)
        text = b""
        try:
            while piece := os.read(ours, 65536):
                text += piece
        except OSError:  # what a terminal says at its end
            pass
        os.close(ours)
        self.assertEqual(process.wait(timeout=500), 0)
        return text.decode().replace("\r\n", "\n")

    def test_programs_read_json_and_people_words(self):
        told = json.loads(self.shade("scene.json").stdout)
        self.assertEqual(self.on_terminal("scene.json"), "\n".join(told["words"]) + "\n")
        self.assertEqual(json.loads(self.on_terminal("scene.json", "--json")), told)
        self.assertEqual(self.shade("scene.json", "-o", "out.json").stdout, b"")
        self.assertEqual(json.loads((self.folder / "out.json").read_bytes()), told)

    def test_it_tells_what_http_tells(self):
        with Daemon() as daemon:
            remote = json.loads(daemon.post("/v1/explain", SCENE).body)
        self.assertEqual(json.loads(self.shade("scene.json").stdout), remote)

    def test_scenes_that_cannot_be_are_1(self):
        (self.folder / "scene.json").write_text(json.dumps(UNREACHABLE))
        run = self.shade("scene.json", "-o", "out.json")
        self.assertEqual((run.returncode, run.stdout), (1, b""))
        self.assertIn(b"scene.json: /accuracy/maxError: no tier stays within", run.stderr)
        self.assertFalse((self.folder / "out.json").exists())
        (self.folder / "scene.json").write_text("{}")
        self.assertEqual(self.shade("scene.json").returncode, 1)

    def test_wrong_command_lines_are_2(self):
        for arguments in ([], ["scene.json", "scene.json"], ["scene.json", "-o", ""],
                          ["scene.json", "-o", "."]):
            self.assertEqual(self.shade(*arguments).returncode, 2)
        for command in (["compare"], ["render", "-o", "out.png"]):
            run = subprocess.run([SHADE, *command, "scene.json", "--json"], cwd=self.folder,
                                 check=False, capture_output=True, timeout=500)
            self.assertEqual(run.returncode, 2, command)
            self.assertIn(b"--json is for explain", run.stderr)


if __name__ == "__main__":
    unittest.main()
