"""How much two pictures differ, in the metrics of error budgets."""

import os
import sys

import numpy as np

import programs

os.environ.setdefault("SHADED_BUILD", str(programs.BUILD))
sys.path.insert(0, str(programs.SOURCE / "tests"))
from reference import color, program  # noqa: E402


def between(one, other, metric):
    """The largest difference: of linear components, of codes, or CIEDE2000 of sRGB pictures."""
    kind = "exr" if metric == "linear" else "png"
    a, b = (program.read(path.read_bytes(), kind)[0][..., :3] for path in (one, other))
    if metric == "deltaE2000":
        a, b = (color.lab(color.srgb_decode(picture / 65535)) for picture in (a, b))
        return float(color.delta_e_2000(a, b).max())
    return float(np.abs(a - b).max())
