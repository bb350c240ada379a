"""What a scene does not use costs nothing: no library is loaded for it, and no instruction of it is
executed, as valgrind's callgrind counts them."""

import json
import os
import re
import subprocess
import tempfile
import unittest
from pathlib import Path

from daemon import BUILD, Daemon

SHADE = str(BUILD / "shade")
PICTURE = {"width": 16, "height": 16, "samples": 1}
SPHERE = {"image": PICTURE, "objects": [{"type": "sphere"}]}
MESH = {"image": PICTURE, "objects": [{"type": "mesh", "positions": [-1, -1, 0, 1, -1, 0, 0, 1, 0]}]}

# Of each feature: a scene that uses it, and names that functions begin with that are for it alone.
FEATURES = {
    "meshes": (MESH, ["shd_mesh_tree_new", "shd_mesh_view_make", "shd_find_mesh", "shd_place_mesh"]),
    "faces": ({**SPHERE, "interpolation": "flat"}, ["shd_tessellate"]),
    "tori": ({"image": PICTURE, "objects": [{"type": "torus"}]}, ["shd_find_torus", "shd_place_torus"]),
    "shapes": ({"image": PICTURE, "objects": [{"type": "box"}]},
               ["shd_find_surfaces", "shd_place_surfaces"]),
    "jpeg": ({**SPHERE, "output": {"format": "jpeg"}}, ["shd_encode_jpeg"]),
    "webp": ({**SPHERE, "output": {"format": "webp"}}, ["shd_encode_webp"]),
}
# None of these is loaded for pictures in PNG, JPEG or WebP.
LIBRARIES = re.compile(r"embree|libtbb|OpenImageIO|OpenEXR|opencv", re.I)


class Unused(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def shade(self, scene, *before, **environment):
        path = self.folder / "scene.json"
        path.write_text(json.dumps(scene))
        suffix = scene.get("output", {}).get("format", "png")
        subprocess.run([*before, SHADE, "render", str(path), "-o", str(self.folder / f"out.{suffix}")],
                       check=True, capture_output=True, env={**os.environ, **environment})

    def executed(self, scene):
        """The names of all functions of which an instruction was executed."""
        counts = self.folder / "counts"
        self.shade(scene, "valgrind", "--tool=callgrind", f"--callgrind-out-file={counts}")
        return set(re.findall(r"^c?fn=\(\d+\) (\S+)", counts.read_text(errors="replace"), re.M))

    def test_no_instruction_of_unused_features_is_executed(self):
        alone = self.executed(SPHERE)
        self.assertTrue(any(name.startswith("shd_show_ball") for name in alone), "it sees a sphere")
        for feature, (scene, starts) in FEATURES.items():
            used = self.executed(scene)
            for start in starts:
                with self.subTest(feature=feature, function=start):
                    self.assertFalse([name for name in alone if name.startswith(start)])
                    self.assertTrue([name for name in used if name.startswith(start)])

    def test_no_library_of_unused_features_is_loaded(self):
        def loaded(scene):
            for old in self.folder.glob("loaded*"):
                old.unlink()
            self.shade(scene, LD_DEBUG="files", LD_DEBUG_OUTPUT=str(self.folder / "loaded"))
            text = "".join(path.read_text() for path in self.folder.glob("loaded*"))
            return set(re.findall(r"calling init: (\S+)", text))

        tiff = loaded({**SPHERE, "output": {"format": "tiff"}})
        self.assertTrue(any("OpenImageIO" in name for name in tiff), "what is loaded is listed")
        for scene in (SPHERE, *(scene for scene, _ in FEATURES.values())):
            with self.subTest(scene=scene):
                names = loaded(scene)
                self.assertTrue(names)
                self.assertEqual([name for name in names if LIBRARIES.search(name)], [])

    def test_the_daemon_maps_no_other_library_for_meshes(self):
        def mapped(daemon):
            maps = Path(f"/proc/{daemon.pid}/maps").read_text()
            return set(re.findall(r"\S+\.so[.0-9]*$", maps, re.M))

        with Daemon() as daemon:
            answers = []
            for scene in (SPHERE, MESH):
                answers.append(daemon.post("/v1/render", json.dumps(scene).encode()))
                if scene is SPHERE:
                    before = mapped(daemon)
            self.assertEqual([answer.status for answer in answers], [200, 200])
            self.assertEqual(mapped(daemon) - before, set())
            self.assertFalse([name for name in before if re.search("embree|libtbb", name)])


if __name__ == "__main__":
    unittest.main(verbosity=2)
