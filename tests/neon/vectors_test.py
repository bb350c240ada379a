"""What the compiler has made of the kernels for 64-bit ARM: vectors, and no sums fused that the
source does not fuse, which would round otherwise than on other machines."""

import os
import re
import subprocess
import unittest
from collections import Counter
from pathlib import Path

KERNELS = Path(os.environ["SHADED_BUILD"], "CMakeFiles", "kernels_portable.dir", "src")
ARITHMETIC = re.compile(r"f(add|sub|mul|div|sqrt|nmul|abd|ml[as]|n?m(add|sub))$")
FUSED = re.compile(r"f(ml[as]|n?m(add|sub))$")

# The least share of vectors in the arithmetic of kernels. The first two are written in vectors; what
# is the same in all lanes, the second finds once: in each of four places where a lobe is cut, and how
# near to the horizon a directional light rounds (12 of 1,159), and it adds lanes of the reference.
# Others are loops that GCC makes vectors of, the torus's only where they have no break.
SHARES = {"shade/fast": 1, "shade/wide": 0.98, "sight/cast": 0.8,
          "sight/ball": 0.6, "sight/shapes": 0.6, "sight/torus": 0.4}
FUSING = {"shade/fast"}


def operations(kernel):
    """(mnemonic, whether on vectors) of each instruction of floating-point arithmetic."""
    listing = subprocess.run(
        ["aarch64-linux-gnu-objdump", "-d", "--no-show-raw-insn", KERNELS / f"{kernel}.simd.c.o"],
        capture_output=True, text=True, check=True).stdout
    for name, operands in re.findall(r"^\s+[0-9a-f]+:\t(\S+)\t?(.*)$", listing, re.MULTILINE):
        if ARITHMETIC.match(name):
            yield name, bool(re.match(r"v\d+\.(4s|2d|2s)", operands))


class Vectors(unittest.TestCase):
    def test_kernels_compute_in_vectors(self):
        for kernel, least in SHARES.items():
            with self.subTest(kernel):
                count = Counter(wide for _, wide in operations(kernel))
                print(f"{kernel}: {count[True]} of {count.total()} in vectors")
                self.assertGreater(count[True], 50)
                self.assertGreaterEqual(count[True] / count.total(), least)

    def test_only_what_the_source_fuses_is_fused(self):
        for kernel in SHARES:
            with self.subTest(kernel):
                fused = [name for name, _ in operations(kernel) if FUSED.match(name)]
                self.assertEqual(bool(fused), kernel in FUSING)


if __name__ == "__main__":
    unittest.main()
