"""config/shaded.ocio as OpenColorIO's own tools see it."""

import os
import pathlib
import shutil
import subprocess
import unittest

CONFIG = pathlib.Path(os.environ["SHADED_SOURCE"]) / "config" / "shaded.ocio"


class Config(unittest.TestCase):
    @unittest.skipUnless(shutil.which("ociocheck"), "ociocheck (opencolorio-tools) is not installed")
    def test_ociocheck_has_nothing_to_say(self):
        done = subprocess.run(["ociocheck", "--iconfig", CONFIG], capture_output=True, text=True,
                              timeout=60, env={"PATH": os.environ["PATH"]})
        said = done.stdout + done.stderr
        self.assertEqual(done.returncode, 0, said)
        for word in ("warning", "error", "not defined"):
            self.assertNotIn(word, said.lower())

    def test_needs_no_other_file(self):
        text = CONFIG.read_text()
        self.assertNotIn("!<FileTransform>", text)
        self.assertIn("environment:\n  {}\n", text)


if __name__ == "__main__":
    unittest.main()
