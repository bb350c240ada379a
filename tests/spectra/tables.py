"""Makes src/base/spectrum_tables.c of the CIE's tables:

    python3 tests/spectra/tables.py /usr/share/colord | clang-format > src/base/spectrum_tables.c

The folder is what Debian's package colord-data 1.4.6-2.2 installs. Those figures are the CIE's: the observer and
the illuminants of CIE 15, the components of daylight of CIE 15 (2.4), the test color samples of CIE 13.3.
"""

import sys
from pathlib import Path

import numpy as np
import primaries  # beside this file

FLUORESCENT = [f"F{i}" for i in range(1, 13)]
SAMPLES = [f"TCS{i:02}" for i in range(1, 15)]


def read(path):
    """(first wavelength, last one, [row])"""
    fields, rows, inside = {}, [], False
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["END_DATA"]:
            inside = False
        elif inside and words:
            rows.append(words[1:] if words[0].startswith("TCS") else words)
        elif words[:1] == ["BEGIN_DATA"]:
            inside = True
        elif len(words) == 2:
            fields[words[0]] = words[1]
    return float(fields["SPECTRAL_START_NM"]), float(fields["SPECTRAL_END_NM"]), rows


def cut(path, low, high):
    first, last, rows = read(path)
    step = round((last - first) / (len(rows[0]) - 1))
    assert step == 5
    return [row[int((low - first) / 5):int((high - first) / 5) + 1] for row in rows]


def daylight(components, kelvin):
    """CIE 15:2004 (3.1 to 3.4); M1 and M2 are rounded to three decimals, as there."""
    t = kelvin * 1.4388 / 1.4380
    if t <= 7000:
        x = ((-4.6070e9 / t + 2.9678e6) / t + 0.09911e3) / t + 0.244063
    else:
        x = ((-2.0064e9 / t + 1.9018e6) / t + 0.24748e3) / t + 0.237040
    y = (-3 * x + 2.870) * x - 0.275
    m = 0.0241 + 0.2562 * x - 0.7341 * y
    m1, m2 = round((-1.3515 - 1.7703 * x + 5.9114 * y) / m, 3), round((0.03 - 31.4424 * x + 30.0717 * y) / m, 3)
    s0, s1, s2 = np.array(components, float)
    return [f"{v:.6g}" for v in s0 + m1 * s1 + m2 * s2]


def write(name, rows, about):
    print(f"\n/* {about} */")
    if len(rows) == 1:
        print(f"const double {name}[{len(rows[0])}] = {{{', '.join(number(v) for v in rows[0])}}};")
        return
    body = ", ".join("{" + ", ".join(number(v) for v in row) + "}" for row in rows)
    print(f"const double {name}[{len(rows)}][{len(rows[0])}] = {{{body}}};")


def number(text):
    value = text if len(text) == 12 else repr(float(text))
    return value[:-2] if value.endswith(".0") else value


def rounded(curves):
    """To ten decimals, so that they still add up to 1."""
    red, green, blue = (np.round(row, 10) + 0.0 for row in curves)
    red = np.where(blue == 0, np.round(1 - green, 10), red)
    return [[f"{v:.10f}" for v in row] for row in (red, green, np.round(1 - red - green, 10) + 0.0)]


def main(folder):
    colord = Path(folder)
    observer = cut(colord / "cmf" / "CIE1931-2deg-XYZ.cmf", 360, 830)
    d65 = cut(colord / "illuminant" / "CIE-D65.sp", 360, 830)[0]
    components = cut(colord / "ref" / "CIE-1986-daylight-SPD.cmf", 360, 830)
    curves = primaries.solve(primaries.table(360, 5, observer), primaries.table(360, 5, d65))
    print('/* Made by tests/spectra/tables.py of the tables that Debian\'s colord-data 1.4.6-2.2 has. */')
    print('#include "base/spectrum_tables.h"')
    write("shd_observer", observer, "CIE 1931 standard observer, 2 degrees: x, y, z. CIE 15.")
    write("shd_illuminant_d65", [d65], "CIE standard illuminant D65, 1 at 560 nm. CIE 15.")
    for kelvin in (5000, 5500, 7500):
        write(f"shd_illuminant_d{kelvin // 100}", [daylight(components, kelvin)],
              f"CIE illuminant D{kelvin // 100}, 100 at 560 nm: CIE 15's sum of components of daylight.")
    lamps = [cut(colord / "illuminant" / f"CIE-{name}.sp", 380, 780)[0] for name in FLUORESCENT]
    write("shd_illuminants_f", lamps, "CIE illuminants F1 to F12 (FL1 to FL12). CIE 15.")
    samples = cut(colord / "ref" / "CIE-TCS.sp", 380, 780)[:len(SAMPLES)]
    write("shd_test_samples", samples, "CIE test color samples 1 to 14, most to two decimals. CIE 13.3.")
    write("shd_primary_curves", rounded(curves), "The primaries of tests/spectra/primaries.py.")


if __name__ == "__main__":
    main(sys.argv[1])
