"""Spectral scenes against an integration of their own, in numpy, of the same tables.

Tolerances: FILM is what a float sample holds (half an ulp of 1 is 6e-8) and twice that; wavelengths are integrated
by four points of Gauss between all samples, which is exact as the program's Simpson is, but for illuminant A
(a formula), of which both are within 1e-9.
"""

import json
import os
import re
import unittest
from pathlib import Path

import numpy as np

from reference import program
from spectra import primaries

SOURCE = Path(os.environ["SHADED_SOURCE"])
FILM = 2e-7
WALL = {"type": "disc", "radius": 50, "transform": {"rotate": [90, 0, 0]}}  # normal +z
CAMERA = {"type": "orthographic", "position": [0, 0, 4], "height": 2}
SUN = {"type": "directional", "direction": [0, 0, -1]}


def tables():
    text = (SOURCE / "src" / "base" / "spectrum_tables.c").read_text(encoding="utf-8")
    found = re.findall(r"const double (\w+)((?:\[\d+\])+) = (\{.*?\});", text, re.DOTALL)
    return {name: np.array(json.loads(re.sub(r"\{", "[", body).replace("}", "]")))
            for name, _, body in found}


TABLES = tables()
OBSERVER = primaries.table(360, 5, TABLES["shd_observer"])
D65 = primaries.table(360, 5, TABLES["shd_illuminant_d65"])
PRIMARIES = [primaries.table(380, 10, row) for row in TABLES["shd_primary_curves"]]
GRID = np.arange(360, 831, 5.0)


def illuminant_a(nm):
    """CIE 15: relative to 560 nm."""
    return (560 / nm) ** 5 * np.expm1(1.435e7 / (2848 * 560)) / np.expm1(1.435e7 / (2848 * nm))


def curve(of):
    """(function, its samples' wavelengths) of a spectrum as documents have it."""
    if "spectrum" not in of:
        at = np.array(of["wavelengths"], float)
        return lambda nm: of.get("scale", 1) * np.interp(nm, at, of["values"]), at
    name = of["spectrum"]
    known = {"A": illuminant_a, "D65": D65, "E": np.ones_like,
             "D50": primaries.table(360, 5, TABLES["shd_illuminant_d50"])}
    if name in known:
        found = known[name]
    elif name[0] == "F":
        found = primaries.table(380, 5, TABLES["shd_illuminants_f"][int(name[1:]) - 1])
    else:
        found = primaries.table(380, 5, TABLES["shd_test_samples"][int(name[3:]) - 1])
    return lambda nm: of.get("scale", 1) * found(nm), GRID


class Channels:
    """docs/model.md, Spectrum: to linear Rec.709."""

    def __init__(self, channels=16, low=380, high=730):
        self.edges = low + (high - low) * np.arange(channels + 1) / channels
        self.p = np.array([self.means(p, GRID) for p in PRIMARIES])  # [3][bins]
        self.d65 = self.seen(D65, GRID)
        self.d65 /= self.d65[1].sum()
        self.to_rgb = np.linalg.inv(self.d65 @ self.p.T)

    def bins(self, functions, at):
        for low, high in zip(self.edges, self.edges[1:]):
            knots = np.concatenate([[low, high], at[(at > low) & (at < high)],
                                    GRID[(GRID > low) & (GRID < high)]])
            yield primaries.integrate(functions, knots)

    def means(self, function, at):
        return np.array(list(self.bins([function], at))) / np.diff(self.edges)

    def seen(self, light, at):
        return np.array(list(self.bins([OBSERVER, light], at))).T

    def light(self, given):
        """[3][bins]: RGB of each bin on white."""
        if isinstance(given, dict):
            xyz = self.seen(*curve(given))
            return self.to_rgb @ xyz / xyz[1].sum()
        return self.to_rgb @ (self.d65 * (np.broadcast_to(given, 3) @ self.p))

    def surface(self, given):
        if isinstance(given, dict):
            return self.means(*curve(given))
        return np.broadcast_to(given, 3) @ self.p


def scene(lights, material, **rest):
    return {"spectral": True, "image": {"width": 3, "height": 3, "samples": 1}, "camera": CAMERA, "lights": lights,
            "objects": [{**WALL, "material": {"ambient": 0, "diffuse": 0, **material}}], **rest}


def centre(document):
    return program.rgb(program.linear(document))[1, 1]


BUMPS = {"wavelengths": [390, 431.5, 475, 512.3, 560, 620, 700], "values": [0.1, 0.6, 0.2, 0.5, 0.35, 0.8, 0.4]}


class Pictures(unittest.TestCase):
    def near(self, measured, expected, tolerance=FILM):
        np.testing.assert_allclose(measured, expected, rtol=0, atol=tolerance * max(1, np.abs(expected).max()))

    def test_tables_of_primaries_solve_their_program(self):
        broken, slope = primaries.residual(TABLES["shd_primary_curves"], OBSERVER, D65)
        # Ten decimals, of 36 samples.
        self.assertLess(broken, 1e-9)
        self.assertLess(slope, 1e-8)
        np.testing.assert_allclose(primaries.solve(OBSERVER, D65), TABLES["shd_primary_curves"], rtol=0, atol=1e-9)

    def test_illuminants_have_the_cies_chromaticities(self):
        """The chromaticities that CIE 15 has for the illuminants, which are sums in steps of 5 nm."""
        wanted = {"D65": (0.3127, 0.3290), "A": (0.4476, 0.4074), "D50": (0.3457, 0.3585), "F2": (0.3721, 0.3751),
                  "F7": (0.3129, 0.3292), "F11": (0.3805, 0.3769), "E": (1 / 3, 1 / 3)}
        for name, xy in wanted.items():
            at = np.arange(380, 781, 5)
            xyz = (OBSERVER(at) * curve({"spectrum": name})[0](at)).sum(axis=1)
            np.testing.assert_allclose(xyz[:2] / xyz.sum(), xy, atol=1.5e-4, err_msg=name)

    def test_every_pair_of_light_and_surface(self):
        lights = [1, [1, 0.5, 0.2], {"spectrum": "A"}, {"spectrum": "F2"}, {"spectrum": "F11"}, {"spectrum": "D65"},
                  {"spectrum": "E"}, {"wavelengths": [555], "values": [7]}, BUMPS]
        surfaces = [1, [0.2, 0.5, 0.9], {"spectrum": "TCS03"}, {**BUMPS, "scale": 0.5},
                    {"wavelengths": [600], "values": [0.25]}]
        for spectral, channels in ((True, Channels()), ({"channels": 41, "from": 360, "to": 800}, Channels(41, 360, 800))):
            for light in lights:
                for surface in surfaces:
                    with self.subTest(light=light, surface=surface, spectral=spectral):
                        wanted = 1.5 * channels.light(light) @ channels.surface(surface)
                        self.near(centre(scene([{**SUN, "color": light, "intensity": 1.5}], {"diffuse": surface},
                                               spectral=spectral)), wanted)

    def test_all_terms_of_a_sphere(self):
        """Weights of the model times one color for each term and light, pixel by pixel."""
        material = {"emissive": {"spectrum": "F2", "scale": 0.1}, "ambient": {"spectrum": "TCS05"},
                    "diffuse": BUMPS, "specular": [0.2, 0.3, 0.1], "shininess": 12,
                    "lobes": [{"specular": {"spectrum": "TCS09"}, "shininess": 80}]}
        lamps = [{"type": "point", "position": [2, 3, 4], "color": {"spectrum": "A"}, "intensity": 0.8},
                 {"type": "point", "position": [-3, 1, 2], "color": [0.3, 0.6, 1]},
                 {"type": "ambient", "color": {"spectrum": "F11"}, "intensity": 0.3}]
        document = {"spectral": {"channels": 24}, "image": {"width": 40, "height": 30, "samples": 1},
                    "ambient": [0.1, 0.2, 0.05], "lights": lamps,
                    "objects": [{"type": "sphere", "material": material}]}
        shown = program.rgb(program.linear(document))

        def weights(light, **term):
            gray = {"ambient": 0, "diffuse": 0, "specular": 0, **term}
            alone = {**document, "spectral": False, "ambient": 0, "lights": [{**light, "color": 1, "intensity": 1}],
                     "objects": [{"type": "sphere", "material": gray}]}
            return program.rgb(program.linear(alone))

        c = Channels(24)
        terms = [({"diffuse": 1}, c.surface(BUMPS)), ({"specular": 1, "shininess": 12}, c.surface([0.2, 0.3, 0.1])),
                 ({"specular": 1, "shininess": 80}, c.surface({"spectrum": "TCS09"}))]
        seen = program.linear({**document, "spectral": False, "lights": [], "ambient": 0, "background": None,
                               "objects": [{"type": "sphere"}]})["A"]
        ambient = c.light([0.1, 0.2, 0.05]) + 0.3 * c.light({"spectrum": "F11"})
        wanted = seen[..., None] * (0.1 * c.light({"spectrum": "F2"}).sum(axis=1) + ambient @ c.surface({"spectrum": "TCS05"}))
        for light, of in ((lamps[0], 0.8 * c.light({"spectrum": "A"})), (lamps[1], c.light([0.3, 0.6, 1]))):
            for term, surface in terms:
                wanted = wanted + weights(light, **term) * (of @ surface)
        self.near(shown, wanted, 1e-6)  # each weight comes from a float film of its own

    def test_rgb_makes_the_round_trip(self):
        """To what the film holds; tests/unit/base_spectrum.c asks for 1e-12."""
        for rgb in ([0, 0, 0.5], [1, 1, 1], [0.3, 0.9, 0.1], [1.5, -0.2, 0.4]):
            for channels in (16, 17, 100, 256):
                spectral = {"channels": channels}
                self.near(centre(scene([SUN], {"diffuse": rgb}, spectral=spectral)), rgb)
                self.near(centre(scene([{**SUN, "color": rgb}], {"diffuse": 1}, spectral=spectral)), rgb)

    def test_fresnel_is_lifted_at_each_direction(self):
        """A lobe of facets: RGB weights of the model, lifted, and looked at in the light."""
        gold = {"model": "cook-torrance", "diffuse": 0, "ambient": 0, "lobes": [{"roughness": 0.3, "weight": 0.7}],
                "fresnel": {"n": [0.143, 0.375, 1.442], "k": [3.983, 2.386, 1.603]}}
        document = {"spectral": True, "image": {"width": 24, "height": 24, "samples": 1},
                    "lights": [{"type": "point", "position": [3, 2, 3], "color": {"spectrum": "A"}}],
                    "objects": [{"type": "sphere", "material": gold}]}
        plain = {**document, "spectral": False, "lights": [{**document["lights"][0], "color": 1}]}
        weights = program.rgb(program.linear(plain))
        c = Channels()
        wanted = (weights @ c.p) @ c.light({"spectrum": "A"}).T
        self.near(program.rgb(program.linear(document)), wanted, 1e-6)
        self.assertGreater(np.ptp(weights[12, 12]), 0.01)

    def test_an_index_over_wavelengths(self):
        """A wall of facets in the sun: Fresnel's equations in each channel, by complex numbers."""
        n = {"wavelengths": [400, 500, 550, 600, 700], "values": [1.5, 1.1, 0.4, 0.2, 0.15]}
        k = {"wavelengths": [380, 520, 730], "values": [1.9, 2.1, 4.3], "scale": 1.25}
        f0 = {"wavelengths": [400, 700], "values": [0.2, 0.9]}
        light = np.array([3.0, 1.0, 2.0]) / np.sqrt(14)
        cosine = np.sqrt((1 + light[2]) / 2)  # V.H

        def wall(fresnel, spectral):
            sun = {**SUN, "direction": list(-light), "color": {"spectrum": "A"} if spectral else 1}
            material = {"model": "cook-torrance", "fresnel": fresnel, "lobes": [{"roughness": 0.6, "weight": 0.7}]}
            return centre(scene([sun], material, spectral=spectral))

        def reflectance(index):
            inside = np.sqrt(1 - (1 - cosine ** 2) / index ** 2)
            across = (cosine - index * inside) / (cosine + index * inside)
            along = (index * cosine - inside) / (index * cosine + inside)
            return (abs(across) ** 2 + abs(along) ** 2) / 2

        weight = wall({"f0": 1}, False)
        self.assertGreater(weight[0], 0.05)
        for channels in (16, 41):
            c, spectral = Channels(channels), {"channels": channels}
            metal = reflectance(c.surface(n) + 1j * c.surface(k))
            glass = (1 + np.sqrt(c.surface(f0))) / (1 - np.sqrt(c.surface(f0)))
            mixed = reflectance(c.surface(n) + 1j * (np.array([1, 2, 3]) @ c.p))
            for fresnel, share in (({"n": n, "k": k}, metal), ({"f0": f0}, reflectance(glass)),
                                   ({"n": n, "k": [1, 2, 3]}, mixed)):
                self.near(wall(fresnel, spectral), weight * (c.light({"spectrum": "A"}) @ share), 1e-6)

        # Without `spectral`: means over what the primaries stand for.
        def means(of):
            function, at = curve(of)
            knots = np.unique(np.concatenate([GRID[(GRID >= 380) & (GRID <= 730)], at[(at > 380) & (at < 730)]]))
            return [float(primaries.integrate([function, p, D65], knots) / primaries.integrate([p, D65], knots))
                    for p in PRIMARIES]

        self.near(wall({"n": n, "k": k}, False), wall({"n": means(n), "k": means(k)}, False))

    def test_an_index_that_is_the_same_at_every_wavelength(self):
        """As in RGB, by lights of every shape, in mirrors, and in each layer."""
        constant = {"wavelengths": [500], "values": [1.8]}
        lights = [{"type": "point", "position": [3, 2, 3]},
                  {"type": "rect", "position": [-2, 2, 2], "direction": [1, -1, -1], "size": [1, 2]},
                  {"type": "sphere", "position": [0, 3, 1], "radius": 0.4}]

        def shown(n, spectral):
            material = {"model": "cook-torrance", "diffuse": 0.2, "fresnel": {"n": n}, "reflection": 0.2,
                        "lobes": [{"roughness": 0.2, "weight": 0.5}, {"roughness": 0.5, "weight": 0.4}]}
            return program.rgb(program.linear({
                "spectral": spectral, "image": {"width": 20, "height": 20, "samples": 1}, "lights": lights,
                "trace": {"shadows": True, "depth": 2},
                "objects": [{"type": "sphere", "material": material}, {"type": "plane", "transform": {"translate": [0, -1, 0]}}]}))

        for channels in (16, 17, 18):
            self.near(shown(constant, {"channels": channels}), shown(1.8, False), 1e-6)

    def test_named_metals_have_curves_in_spectra(self):
        def wall(fresnel, spectral):
            material = {"model": "cook-torrance", "fresnel": fresnel, "lobes": [{"roughness": 0.6, "weight": 1}]}
            return centre(scene([SUN], material, spectral=spectral))

        # P. B. Johnson and R. W. Christy, Phys. Rev. B 6, 4370 (1972): silver.
        at = [354.2, 367.9, 381.5, 397.4, 413.3, 430.5, 450.9, 471.4, 495.9, 520.9, 548.6, 582.1, 616.8, 659.5, 704.5, 756]
        n = [0.10, 0.07, 0.05, 0.05, 0.05, 0.04, 0.04, 0.05, 0.05, 0.05, 0.06, 0.05, 0.06, 0.05, 0.04, 0.03]
        k = [1.419, 1.657, 1.864, 2.070, 2.275, 2.462, 2.657, 2.869, 3.093, 3.324, 3.586, 3.858, 4.152, 4.483, 4.838, 5.242]
        silver = {"n": {"wavelengths": at, "values": n}, "k": {"wavelengths": at, "values": k}}
        np.testing.assert_array_equal(wall(silver, True), wall({"n": "silver"}, True))
        mirror = wall({"f0": 1}, True)
        for metal in ("gold", "silver", "copper", "brass", "aluminium"):
            # Other people's measurements of other samples: within 0.08 of what RGB has.
            np.testing.assert_allclose(wall({"n": metal}, True) / mirror, wall({"n": metal}, False) / mirror, rtol=0, atol=0.08)

    def test_greys_are_those_of_rgb_in_every_model(self):
        """What surfaces send each other in a microgeometry depends on their own reflectance, too."""
        for model in ({"model": "westin", "microgeometry": {"type": "grooves"}}, {"model": "oren-nayar", "sigma": 30},
                      {"model": "blinn-phong", "specular": 0.3}, {"model": "phong-normalized", "specular": 0.3},
                      {"model": "cook-torrance", "fresnel": {"n": 1.8}}):
            document = {"image": {"width": 16, "height": 16, "samples": 1}, "ambient": 0.2,
                        "objects": [{"type": "sphere", "material": {"diffuse": 0.5, **model}}]}
            with self.subTest(**model):
                self.near(program.rgb(program.linear({**document, "spectral": True})),
                          program.rgb(program.linear(document)))

    def test_metamers_part_under_a_and_only_in_spectra(self):
        """The two spheres of the examples, pixel by pixel in codes: the right one is where the left one is, shifted."""
        def apart(name, **change):
            document = json.loads((SOURCE / "api" / "examples" / f"metamers-{name}.json").read_text(encoding="utf-8"))
            document.update(change, image={"width": 120, "height": 60, "samples": 4},
                            camera={"type": "orthographic", "position": [0, 0, 7], "height": 2.2})
            codes = program.codes(document)[..., :3]
            # 1.1 units are 30 pixels: each half has its sphere in the middle.
            return np.abs(codes[:, :60] - codes[:, 60:]).max()

        self.assertLessEqual(apart("d65"), 1)  # of rounding
        self.assertLessEqual(apart("d65", spectral=False), 1)
        self.assertLessEqual(apart("a", spectral=False), 1)
        self.assertGreater(apart("a"), 15)

    def test_other_working_spaces_show_the_same(self):
        """To what the conversion to the working space keeps, f32."""
        lamp = {**SUN, "color": {"spectrum": "A"}}
        for material in ({"diffuse": {"spectrum": "TCS01"}}, {"diffuse": [0.2, 0.5, 0.9]}):
            plain, wide = (centre(scene([lamp], material, workingSpace=space)) for space in ("lin_rec709", "ACEScg"))
            self.near(plain, wide, 3e-6)

    def test_mirrors_and_glass_are_in_bins(self):
        """The eye looks down on a colored mirror at 45 degrees, which shows a lit wall, or a lamp; and through panes."""
        c, sun = Channels(), {**SUN, "direction": [1, 0, 0], "color": {"spectrum": "F11"}}
        mirror = {"diffuse": 0, "ambient": 0, "reflection": [0.9, 0.3, 0.1]}
        tilted = {"rotate": [90, 45, 0]}  # normal (1, 0, 1) / sqrt(2)
        far = {"rotate": [0, 0, 90], "translate": [9, 0, 0]}  # normal (-1, 0, 0)

        def seen(wall, lights, mirrors, background=None, **more):
            return centre({**scene(lights, {}), "trace": {"depth": 4, "minContribution": 0}, "background": background,
                           "objects": [{"type": "disc", "radius": 2, "transform": tilted, "material": mirrors},
                                       {"type": "disc", "radius": 3, "transform": far, "material": {"ambient": 0, **wall}}],
                           **more})

        r, lamp = c.surface(mirror["reflection"]), c.light({"spectrum": "F11"})
        paint, f2 = c.surface(BUMPS), c.light({"spectrum": "F2"})
        shines = {"diffuse": 0, "emissive": {"spectrum": "F2"}}
        self.near(seen(shines, [], mirror), f2 @ r)
        self.near(seen({"diffuse": BUMPS}, [sun], mirror), lamp @ (r * paint))
        # Without bins the product would be another color, by far more than what is asked for.
        self.assertGreater(np.abs(lamp @ (r * paint) - (lamp @ paint) * mirror["reflection"]).max(), 0.01)
        # Straight through, and by a mirror in a mirror: the background is lifted as light.
        self.near(seen(shines, [], {**mirror, "transmission": [0, 0.4, 0.5], "ior": 1}, [0.2, 0.7, 0.4]),
                  f2 @ r + c.light([0.2, 0.7, 0.4]) @ c.surface([0, 0.4, 0.5]))
        gone = {"diffuse": 0, "reflection": [0.2, 0.8, 0.5]}
        self.near(seen(gone, [], mirror, [0.2, 0.7, 0.4]), c.light([0.2, 0.7, 0.4]) @ (r * c.surface(gone["reflection"]) * r))

    def test_spectra_of_mirrors_and_glass(self):
        """A pane of one spectrum before a mirror of another, in which a lamp of a third is seen."""
        for spectral, c in ((True, Channels()), ({"channels": 41, "from": 360, "to": 800}, Channels(41, 360, 800))):
            for mirror in ({"spectrum": "TCS04", "scale": 0.9}, {"wavelengths": [555, 556], "values": [0.2, 0.8]}):
                for opacity in (0, 0.25, BUMPS):
                    pane = {"diffuse": 0, "ambient": 0, "opacity": opacity, "transmission": {"spectrum": "TCS10"}, "ior": 1}
                    document = {**scene([], {}), "spectral": spectral, "trace": {"depth": 4, "minContribution": 0}, "objects": [
                        {"type": "disc", "radius": 2, "transform": {"rotate": [90, 0, 0], "translate": [0, 0, 3]}, "material": pane},
                        {"type": "disc", "radius": 2, "transform": {"rotate": [90, 45, 0]},
                         "material": {"diffuse": 0, "ambient": 0, "reflection": mirror}},
                        {"type": "disc", "radius": 3, "transform": {"rotate": [0, 0, 90], "translate": [9, 0, 0]},
                         "material": {"diffuse": 0, "ambient": 0, "emissive": {"spectrum": "A"}}}]}
                    o = c.surface(opacity) if opacity else 0
                    wanted = c.light({"spectrum": "A"}) @ ((1 - o + o * c.surface({"spectrum": "TCS10"})) * c.surface(mirror))
                    with self.subTest(mirror=mirror, opacity=opacity, spectral=spectral):
                        shown = centre(document)
                        self.near(shown, wanted)
                        told = json.loads(program.ask("/v1/explain", {**document, "accuracy": {"tier": "exact"}}))
                        bound = told["bound"]["linear"]["most"]
                        self.assertLess(np.abs(shown - wanted).max(), bound)
                        self.assertLess(bound, 1e-4)

    def panes(self, layers=None, **more):
        pane = {"type": "disc", "radius": 9, "material": {"opacity": [0.1, 0.5, 0.8], "ambient": 0, "diffuse": [0.3, 0.6, 0.2]}}
        up = {"rotate": [90, 0, 0]}
        document = {**scene([{**SUN, "color": {"spectrum": "A"}}], {}), "trace": {"depth": 4, "shadows": True},
                    "objects": [{**pane, "transform": {**up, "translate": [0, 0, 1]}},
                                {**pane, "transform": {**up, "translate": [0, 0, 2]}},
                                {**WALL, "material": {"ambient": 0, "diffuse": {"spectrum": "TCS03"}}}], **more}
        return program.linear(document, layers=layers)

    def test_opacity_and_shadows_are_in_bins(self):
        """Two panes before a wall: light goes through them on its way there, and again to the eye."""
        c = Channels()
        o, paint, wall = c.surface([0.1, 0.5, 0.8]), c.surface([0.3, 0.6, 0.2]), c.surface({"spectrum": "TCS03"})
        lamp, through = c.light({"spectrum": "A"}), 1 - c.surface([0.1, 0.5, 0.8])
        first, second = o * paint, through * o * paint * through
        beyond = second + through ** 4 * wall
        shown = self.panes(layers=["beauty", "diffuse", "light.0", "bounce", "shadow"])
        self.near(program.rgb(shown)[1, 1], lamp @ (first + beyond))

        def layer(name):
            return np.array([shown[f"{name}.{channel}"][1, 1] for channel in "RGB"])

        self.near(layer("diffuse"), lamp @ first)
        self.near(layer("light.0"), lamp @ first)
        self.near(layer("bounce"), lamp @ beyond)
        self.near(layer("shadow"), [1, 1, 1])
        aside = {"type": "disc", "radius": 1, "material": {"opacity": [0.1, 0.5, 0.8]},
                 "transform": {"rotate": [90, 0, 0], "translate": [3, 0, 3]}}
        for lamp_of in (SUN, {"type": "point", "position": [6, 0, 6], "attenuation": [0, 0, 1]}):
            for trace in ({"shadows": True}, {"shadows": True, "depth": 1}):
                document = {**scene([{**lamp_of, "direction": [-1, 0, -1], "color": {"spectrum": "A"}}
                                     if lamp_of is SUN else {**lamp_of, "color": {"spectrum": "A"}}], {}), "trace": trace,
                            "objects": [aside, {**WALL, "material": {"ambient": 0, "diffuse": {"spectrum": "TCS03"}}}]}
                fall = 1 if lamp_of is SUN else 1 / 72
                shown = program.linear(document, layers=["beauty", "shadow"])
                self.near(program.rgb(shown)[1, 1], np.sqrt(0.5) * fall * lamp @ (through * wall))
                self.near([shown[f"shadow.{channel}"][1, 1] for channel in "RGB"], [0.9, 0.5, 0.2])

    def test_a_pane_alone_has_the_alpha_of_its_colors(self):
        shown = program.linear({**scene([], {}), "trace": {"depth": 2}, "background": None,
                                "objects": [{**WALL, "material": {"opacity": [0.1, 0.5, 0.8]}}]})
        self.near(shown["A"][1, 1], 1.4 / 3)

    def test_without_spectral_a_spectrum_is_its_color(self):
        many = Channels(350)
        for given in (BUMPS, {"spectrum": "TCS12"}, {"wavelengths": [1], "values": [0.5]}):
            # 350 channels are near to the integral over all wavelengths: 1 nm is nothing to a reflectance.
            self.near(centre(scene([SUN], {"diffuse": given}, spectral=False)), many.light(1) @ many.surface(given), 2e-5)
        for given in ({"spectrum": "A"}, {"spectrum": "F11"}, {**BUMPS, "scale": 9}):
            self.near(centre(scene([{**SUN, "color": given}], {"diffuse": 1}, spectral=False)),
                      given.get("scale", 1) * many.light(given).sum(axis=1), 2e-5)


if __name__ == "__main__":
    unittest.main()
