"""What a scene does not use costs nothing: no library is loaded for it, and no instruction of it is
executed, as valgrind's callgrind counts them."""

import hashlib
import json
import os
import re
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from daemon import BUILD, Daemon

SHADE = str(BUILD / "shade")
HWY_TIMER = str(BUILD / "tests/hwy_timer.so")
PICTURE = {"width": 16, "height": 16, "samples": 1}
SPHERE = {"image": PICTURE, "objects": [{"type": "sphere"}]}
MESH = {"image": PICTURE, "objects": [{"type": "mesh", "positions": [-1, -1, 0, 1, -1, 0, 0, 1, 0]}]}
LAMP = {"type": "point", "position": [2, 3, 4]}
SPOT = {"type": "spot", "position": [2, 3, 4], "direction": [-2, -3, -4]}


def of(**material):
    return {"type": "sphere", "material": material}


def side_by_side(*objects):
    """None hides another."""
    return [{**one, "transform": {"translate": [i % 3 - 1, i // 3 - 0.5, 0], "scale": [0.4, 0.4, 0.4]}}
            for i, one in enumerate(objects)]


# Scenes, and the features that each of them uses, with expressions of functions that are for a feature
# alone, as their names begin. Each must be executed for that scene, and not for any of SIMPLE. A scene
# has as many features as get on with each other: valgrind takes seconds for each, whatever is in it.
# Kernels that sum lights are functions each: sum_POINTS CHANNELS LOBES, of positions in two parts, of one
# channel or three, of no lobe, one or several.
USES = [
    ({"image": PICTURE, "ambient": 0.2,
      "objects": side_by_side({"type": "torus"}, {"type": "box"}, MESH["objects"][0], of(specular=0.5),
                              of(specular=0.5, lobes=[{"specular": 0.2, "shininess": 4}]),
                              of(diffuse={"pattern": "checker", "colors": [0, 1]})),
      "lights": [{**LAMP, "attenuation": [0, 0, 1]}, SPOT, {**LAMP, "color": [1, 0.5, 0]}]},
     {"meshes": ["shd_mesh_tree_new", "shd_mesh_view_make", "shd_find_mesh", "shd_place_mesh"],
      "tori": ["shd_find_torus", "shd_place_torus"],
      "shapes": ["shd_find_surfaces", "shd_place_surfaces"],
      "points of light": ["read_position", "shd_least_distance"],
      "attenuation": ["read_attenuation"],
      "spots": ["shd_outside_cone", "shd_spot_error"],
      "colored lights": ["sum_[01]3[012]"],
      "highlights": ["sum_[01][13]1", "shd_pack_lobe", "shd_lobe_sum", "shd_shine_most"],
      "several highlights": ["sum_[01][13]2", "read_lobes"],
      "patterns": ["shd_textured_weigh", "shd_textured_sums", "shd_pattern_mean", "shd_chart_footprint"],
      "ambient light": ["shd_read_color"]}),
    ({**SPHERE, "interpolation": "flat"}, {"faces": ["shd_tessellate", "light_block"]}),
    ({**SPHERE, "interpolation": "gouraud"}, {"gouraud": ["shd_tessellate", "light_block"]}),
    ({**SPHERE, "image": {"width": 64, "height": 64, "samples": 4}, "accuracy": {"tier": "draft"}},
     {"draft": ["shd_mean_is_central", "shd_sight_bend", "shd_spread_of", "shd_sketch_prepare",
                "shd_sketch_block"]}),
    ({**SPHERE, "accuracy": {"tier": "exact"}},
     {"the exact tier": ["shd_light_sums64", "shd_mix_exact", "shd_sums64"]}),
    ({"image": PICTURE, "objects": [{"type": "torus"}], "accuracy": {"maxError": 0.5}, "lights": [
        {**LAMP, "position": [i, 3, 4], "intensity": 10 ** -i} for i in range(12)]},
     {"budgets": ["shd_plan_rank_tiers"], "many lights": ["find_room", "shd_plan_cull"]}),
    ({**SPHERE, "outputs": [{"name": "a", "bitDepth": 16}, {"name": "b", "colorSpace": "YIQ"},
                            {"name": "c", "format": "jpeg"}, {"name": "d", "format": "webp"},
                            {"name": "e", "scope": "waveform"}]},
     {"several outputs": ["shd_read_outputs"],
      "16 bits": ["read_depth"],
      "spaces": ["shd_read_space"],
      "jpeg": ["shd_encode_jpeg"],
      "webp": ["shd_encode_webp"],
      "scopes": ["shd_scope_make", "shd_displayed_make"]}),
    ({**SPHERE, "outputs": [{"name": "a", "format": "exr", "layers": ["beauty", "normal", "light.0"]},
                            {"name": "b", "format": "tiff"}, {"name": "c", "format": "hdr"}]},
     {"layers": ["store_data"], "exr, tiff and hdr": ["shd_encode_oiio", "shd_oiio_load"]}),
]
COMMANDS = {
    "compare": ["shd_request_compare", "shd_delta_e_2000", "shd_film_measure"],
    "analyze": ["shd_request_analyze", "shd_displayed_make", "shd_figures_find"],
    "explain": ["shd_request_explain", "shd_tell_bound"],
}
SIMPLE = {"a sphere": SPHERE, "a sphere without lights": {**SPHERE, "lights": []}}
# None of these is loaded for pictures in PNG, JPEG or WebP.
LIBRARIES = re.compile(r"embree|libtbb|OpenImageIO|OpenEXR|opencv", re.I)


class Unused(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def shade(self, scene, *before, command="render", **environment):
        folder = Path(tempfile.mkdtemp(dir=self.folder))
        (folder / "scene.json").write_text(json.dumps(scene))
        suffix = scene.get("output", {}).get("format", "png")
        out = "" if "outputs" in scene or command != "render" else f"out.{suffix}"
        to = f"{folder}/out/" if "outputs" in scene else str(folder / (out or "out.json"))
        subprocess.run([*before, SHADE, command, str(folder / "scene.json"), "-o", to],
                       check=True, capture_output=True, env={**os.environ, **environment})
        return folder

    def executed(self, scene, command="render"):
        """The names of all functions of which an instruction was executed."""
        counts = tempfile.mktemp(dir=self.folder)
        self.shade(scene, "valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}",
                   command=command, LD_PRELOAD=HWY_TIMER)
        text = Path(counts).read_text(errors="replace")
        return set(re.findall(r"^c?fn=\(\d+\) (\S+)", text, re.M))

    def test_no_instruction_of_unused_features_is_executed(self):
        with ThreadPoolExecutor(2) as workers:
            alone = {name: workers.submit(self.executed, scene) for name, scene in SIMPLE.items()}
            runs = [workers.submit(self.executed, scene) for scene, _ in USES]
            uses = {name: workers.submit(self.executed, SPHERE, name) for name in COMMANDS}
        functions = dict(COMMANDS)
        for run, (_, features) in zip(runs, USES):
            functions |= features
            uses |= dict.fromkeys(features, run)
        self.assertTrue(any(name.startswith("shd_show_ball") for name in alone["a sphere"].result()),
                        "it sees a sphere")
        for feature, starts in functions.items():
            for start in starts:
                with self.subTest(feature=feature, function=start):
                    # A name that is nowhere any more would prove nothing.
                    self.assertTrue([n for n in uses[feature].result() if re.match(start, n)])
                    for simple in alone.values():
                        self.assertEqual([n for n in simple.result() if re.match(start, n)], [])

    def test_no_library_of_unused_features_is_loaded(self):
        def loaded(scene):
            for old in self.folder.glob("loaded*"):
                old.unlink()
            self.shade(scene, LD_DEBUG="files", LD_DEBUG_OUTPUT=str(self.folder / "loaded"))
            text = "".join(path.read_text() for path in self.folder.glob("loaded*"))
            return set(re.findall(r"calling init: (\S+)", text))

        tiff = loaded({**SPHERE, "output": {"format": "tiff"}})
        self.assertTrue(any("OpenImageIO" in name for name in tiff), "what is loaded is listed")
        for scene in (SPHERE, *(scene for scene, features in USES if "layers" not in features)):
            with self.subTest(scene=scene):
                names = loaded(scene)
                self.assertTrue(names)
                self.assertEqual([name for name in names if LIBRARIES.search(name)], [])

    @staticmethod
    def mapped(daemon):
        maps = Path(f"/proc/{daemon.pid}/maps").read_text()
        return set(re.findall(r"[^/\s]+\.so[.0-9]*$", maps, re.M))

    def test_the_daemon_maps_what_decodes_bodies_for_those_alone(self):
        body = json.dumps(SPHERE).encode()
        with Daemon() as daemon:
            self.assertEqual(daemon.post("/v1/render", body).status, 200)
            before = self.mapped(daemon)
            self.assertFalse([name for name in before if re.search(r"^lib(z|zstd)\.", name)])
            for coding, library in ("gzip", r"libz\.so"), ("zstd", r"libzstd\.so"):
                answer = daemon.post("/v1/render", body, {"Content-Encoding": coding})
                self.assertEqual(answer.status, 400)
                new = self.mapped(daemon) - before
                self.assertEqual(len(new), 1, new)
                self.assertRegex(new.pop(), library)
                before = self.mapped(daemon)

    def test_the_daemon_maps_no_other_library_for_meshes_and_pictures(self):
        with Daemon() as daemon:
            answers = []
            for scene in (SPHERE, MESH):
                answers.append(daemon.post("/v1/render", json.dumps(scene).encode()))
                if scene is SPHERE:
                    before = self.mapped(daemon)
            self.assertEqual([answer.status for answer in answers], [200, 200])
            # A process of its own decodes it.
            body = answers[0].body
            put = daemon.call("PUT", "/v1/assets/" + hashlib.sha256(body).hexdigest(), body,
                              {"Content-Type": "image/png"})
            self.assertEqual(put.status, 201, put.body)
            self.assertEqual(self.mapped(daemon) - before, set())
            self.assertFalse([name for name in before if re.search("embree|libtbb", name)])


if __name__ == "__main__":
    unittest.main(verbosity=2)
