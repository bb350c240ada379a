"""Pictures whose values a formula on a line gives.

Tolerances: EXACT is what a float sample can hold of a value near 1 (half an ulp is 6e-8), with
room for the last operations; the shape of a lobe at ns = 1e6 magnifies the rounding of a
direction (1e-16) far less than that.
"""

import math
import unittest

import numpy as np

from reference import color, program

EXACT = 2e-7
STANDARD = 1e-5

FRONT = {"type": "orthographic", "position": [0, 0, 4], "height": 2}
WALL = {"type": "disc", "radius": 50, "transform": {"rotate": [90, 0, 0]}}  # normal +z
TOWARD_THE_WALL = {"type": "directional", "direction": [0, 0, -1]}


def picture(objects, lights, size=(9, 9), camera=None, tier="exact", **rest):
    """Linear RGB of a scene, one sample a pixel; the middle pixel of an odd size is the axis."""
    document = {"image": {"width": size[0], "height": size[1], "samples": 1},
                "camera": camera or FRONT, "lights": lights, "objects": objects, **rest}
    return program.rgb(program.linear(document, tier))


def centre(rgb):
    return rgb[rgb.shape[0] // 2, rgb.shape[1] // 2]


def wall(**material):
    return [{**WALL, "material": material}]


def pixel_centres(n, height):
    """Coordinates across a square orthographic picture, left to right."""
    return ((np.arange(n) + 0.5) / n - 0.5) * height


class ClosedForms(unittest.TestCase):
    def near(self, measured, expected, tolerance=EXACT):
        np.testing.assert_allclose(measured, expected, rtol=0, atol=tolerance)

    def test_normal_incidence_adds_every_coefficient(self):
        ke, ka, kd, ks, ia, il = 0.01, 0.2, 0.3, 0.4, 0.5, 0.6
        for tier in ("exact", "standard"):
            rgb = picture(wall(emissive=ke, ambient=ka, diffuse=kd, specular=ks, shininess=50),
                          [{**TOWARD_THE_WALL, "intensity": il}], ambient=ia, tier=tier)
            self.near(centre(rgb), ke + ka * ia + il * (kd + ks))

    def test_ambient_only_is_the_same_everywhere(self):
        rgb = picture([{"type": "sphere", "radius": 5, "material": {"ambient": [0.2, 0.4, 0.8]}}],
                      [], ambient=[0.5, 0.25, 1])
        self.near(rgb, np.broadcast_to([0.1, 0.1, 0.8], rgb.shape))

    def test_emissive_needs_no_light(self):
        rgb = picture(wall(emissive=[0.7, 0.5, 3], diffuse=0), [])
        self.near(rgb, np.broadcast_to([0.7, 0.5, 3], rgb.shape), 4e-7)

    def test_lambert_sphere_lit_from_the_eye(self):
        # N.L = sqrt(1 - rho^2), rho the distance from the disc's centre
        n = 64
        x, y = np.meshgrid(pixel_centres(n, 2), pixel_centres(n, 2))
        inside = 1 - x * x - y * y
        expected = 0.8 * np.sqrt(np.maximum(inside, 0))
        for tier, tolerance in (("exact", EXACT), ("standard", STANDARD)):
            rgb = picture([{"type": "sphere", "material": {"diffuse": 0.8}}], [TOWARD_THE_WALL],
                          (n, n), tier=tier)
            self.near(np.where(np.abs(inside) > 1e-3, rgb[..., 1] - expected, 0), 0, tolerance)

    def test_lambert_sphere_has_a_terminator(self):
        # light from +x: N.L = x where x > 0
        n = 64
        x, y = np.meshgrid(pixel_centres(n, 2), pixel_centres(n, 2))
        rgb = picture([{"type": "sphere", "material": {"diffuse": 1}}],
                      [{"type": "directional", "direction": [-1, 0, 0]}], (n, n))
        inside = x * x + y * y < 0.999
        self.near(rgb[inside, 0], np.maximum(x[inside], 0))

    def test_mirror_direction_is_one(self):
        # the eye at 45 degrees on one side of the normal, the light at 45 on the other
        camera = {"type": "orthographic", "position": [4, 0, 4], "height": 2}
        for shininess in (0, 1, 10, 1e3, 1e6):
            rgb = picture(wall(diffuse=0, specular=1, shininess=shininess),
                          [{"type": "directional", "direction": [1, 0, -1]}], camera=camera)
            self.near(centre(rgb), 1, 1e-6)
            self.assertLessEqual(rgb.max(), 1)

    def test_lobe_is_a_power_of_the_cosine(self):
        for shininess, degrees in ((1, 60), (10, 20), (100, 8), (1e4, 0.7), (1e6, 0.05)):
            turn = math.radians(degrees)
            rgb = picture(wall(diffuse=0, specular=1, shininess=shininess),
                          [{"type": "directional",
                            "direction": [math.sin(turn), 0, -math.cos(turn)]}])
            self.near(centre(rgb), math.exp(shininess * math.log(math.cos(turn))), 1e-6)

    def test_shininess_zero_is_one_in_front_and_zero_behind(self):
        material = {"diffuse": 0, "specular": 1, "shininess": 0}
        for direction, expected in (([0.9, 0, -0.5], 1), ([1, 0, 0.1], 0)):
            rgb = picture(wall(**material), [{"type": "directional", "direction": direction}])
            self.near(centre(rgb), expected)

    def test_light_behind_makes_no_highlight(self):
        # N.L = -0.1, yet R.V would be 0.89 for the eye at the mirror direction's side
        n_l = -0.1
        across = math.sqrt(1 - n_l * n_l)
        camera = {"type": "orthographic", "position": [4 * across, 0, 1.8], "height": 2}
        rgb = picture(wall(diffuse=1, specular=1, shininess=1),
                      [{"type": "directional", "direction": [across, 0, -n_l]}], camera=camera)
        self.near(centre(rgb), 0, 0)

    def test_attenuation_is_the_inverse_of_its_polynomial(self):
        for a, b, c in ((1, 0, 0), (0, 1, 0), (0, 0, 1), (0.5, 0.25, 0.125)):
            for d in (0.5, 64):
                rgb = picture(wall(diffuse=0.1), [
                    {"type": "point", "position": [0, 0, d], "attenuation": [a, b, c]}])
                expected = 0.1 / (a + b * d + c * d * d)
                self.near(centre(rgb) / expected, 1)

    def test_minimum_distance_stops_the_growth(self):
        light = {"type": "point", "position": [0, 0, 0.1], "attenuation": [0, 0, 1]}
        self.near(centre(picture(wall(diffuse=0.5), [{**light, "minDistance": 2}])), 0.125)

    def test_light_in_the_surface_adds_its_ambient_share_only(self):
        light = {"type": "point", "position": [0, 0, 0], "attenuation": [0, 0, 1], "ambient": 0.25}
        rgb = picture(wall(ambient=1, diffuse=0.5, specular=0.5), [light, TOWARD_THE_WALL])
        self.near(centre(rgb), 0.25 + 1)
        self.assertTrue(np.isfinite(rgb).all())

    def test_two_lights_add(self):
        both = [{**TOWARD_THE_WALL, "color": [1, 0, 0.5]},
                {"type": "point", "position": [1, 2, 3], "color": [0, 1, 0.5]}]
        material = {"diffuse": 0.3, "specular": 0.4, "shininess": 5}
        self.near(picture(wall(**material), both),
                  picture(wall(**material), both[:1]) + picture(wall(**material), both[1:]))

    def test_spot_ends_at_its_angle(self):
        # a spot at height 3 over the wall, half-angle 20 degrees: a disc of radius 3 tan 20
        n, height, far = 81, 3.0, 3 * math.tan(math.radians(20))
        x, y = np.meshgrid(pixel_centres(n, 4), pixel_centres(n, 4))
        rho = np.hypot(x, y)
        n_l = height / np.hypot(height, rho)
        rgb = picture(wall(diffuse=1), [{"type": "spot", "position": [0, 0, height],
                                         "direction": [0, 0, -1], "angle": 20, "penumbra": 0}],
                      (n, n), {**FRONT, "height": 4})
        self.near(rgb[..., 0], np.where(rho <= far, n_l, 0))

    def test_a_rim_without_penumbra_parts_pixels_that_are_next_to_it(self):
        # a cone through the centre of a pixel, widened or narrowed by a part in 1e11
        n, height = 64, 0.9
        x, y = np.meshgrid(pixel_centres(n, 2), pixel_centres(n, 2))
        away = np.hypot(x, y)
        for at in (40, 45), (50, 33), (35, 60), (41, 44), (62, 34):
            for side in 1e-11, -1e-11:
                angle = math.atan2(away[at] * (1 + side), height)
                expected = np.where(away < away[at] * (1 + side),
                                    np.cos(np.arctan2(away, height)), 0)
                for tier, tolerance in (("exact", EXACT), ("standard", STANDARD)):
                    rgb = picture(wall(diffuse=1),
                                  [{"type": "spot", "position": [0, 0, height], "penumbra": 0,
                                    "direction": [0, 0, -1], "angle": math.degrees(angle)}],
                                  (n, n), tier=tier)
                    self.near(rgb[..., 1], expected, tolerance)

    def test_spot_fades_by_a_smoothstep_of_the_cosine(self):
        n, height, angle, penumbra, exponent = 81, 3.0, math.radians(30), 0.4, 7
        x, y = np.meshgrid(pixel_centres(n, 4), pixel_centres(n, 4))
        n_l = height / np.sqrt(height ** 2 + x * x + y * y)  # also the cosine to the axis
        outer, inner = math.cos(angle), math.cos(angle * (1 - penumbra))
        s = np.clip((n_l - outer) / (inner - outer), 0, 1)
        expected = s * s * (3 - 2 * s) * n_l ** exponent * n_l
        light = {"type": "spot", "position": [0, 0, height], "direction": [0, 0, -1],
                 "angle": 30, "penumbra": penumbra, "exponent": exponent}
        for tier, tolerance in (("exact", EXACT), ("standard", STANDARD)):
            rgb = picture(wall(diffuse=1), [light], (n, n), {**FRONT, "height": 4}, tier)
            self.near(rgb[..., 0], expected, tolerance)

    def test_squashed_sphere_has_the_ellipsoids_normals(self):
        # x^2 + y^2 + (z/k)^2 = 1 seen from +z: N ~ (x, y, z/k^2), lit along the view
        n, k = 64, 0.1
        x, y = np.meshgrid(pixel_centres(n, 2), pixel_centres(n, 2))
        inside = 1 - x * x - y * y
        z = k * np.sqrt(np.maximum(inside, 1e-3))
        expected = (z / k ** 2) / np.sqrt(x * x + y * y + (z / k ** 2) ** 2)
        rgb = picture([{"type": "sphere", "transform": {"scale": [1, 1, k]},
                        "material": {"diffuse": 1}}], [TOWARD_THE_WALL], (n, n))
        self.near(np.where(inside > 1e-3, rgb[..., 0] - expected, 0), 0)

    def test_background_and_alpha(self):
        document = {"image": {"width": 8, "height": 8, "samples": 4}, "camera": FRONT,
                    "lights": [], "objects": [{"type": "sphere", "radius": 0.01}],
                    "background": None}
        channels = program.linear(document)
        self.assertEqual(channels["A"][0, 0], 0)
        self.assertEqual(channels["R"][0, 0], 0)
        document["background"] = [0.25, 0.5, 2]
        self.near(program.rgb(program.linear(document))[0, 0], [0.25, 0.5, 2])


class Interpolation(unittest.TestCase):
    """What flat and Gouraud shading must do, whatever way a shape is cut into faces."""

    def test_gouraud_misses_a_highlight_inside_a_face_and_phong_has_it(self):
        material = {"diffuse": 0, "specular": 1, "shininess": 50}
        face = {"type": "mesh", "positions": [-9, -9, 0, 9, -9, 0, 0, 9, 0],
                "indices": [0, 1, 2], "material": material}
        lamp = {"type": "point", "position": [0, 0, 2]}
        camera = {"type": "perspective", "position": [0, 0, 2], "fov": 30}
        for interpolation, expected in (("phong", 1), ("gouraud", 0)):
            rgb = picture([{**face, "interpolation": interpolation}], [lamp], camera=camera)
            self.assertAlmostEqual(centre(rgb)[0], expected, delta=1e-6)

    def test_a_flat_face_has_one_color(self):
        for shape, visible in (("box", 3), ("sphere", 60)):
            rgb = picture([{"type": shape, "segments": 12, "interpolation": "flat"}],
                          [{"type": "point", "position": [3, 2, 4], "attenuation": [0, 0, 9]}],
                          (64, 64), {"position": [2, 1.7, 3]})
            self.assertLessEqual(len(np.unique(rgb[..., 0])), visible + 1)

    def test_many_small_faces_look_like_the_smooth_shape(self):
        for shape in ({"type": "sphere"}, {"type": "torus", "radius": 0.7, "tube": 0.3},
                      {"type": "cylinder", "height": 1.2, "transform": {"rotate": [40, 0, 20]}},
                      {"type": "cone", "transform": {"rotate": [-30, 0, 20]}}):
            material = {"diffuse": 0.5, "specular": 0.3, "shininess": 10, "side": "front"}
            pictures = [picture([{**shape, "segments": 100, "material": material,
                                  "interpolation": interpolation}],
                                [{"type": "directional", "direction": [-3, -2, -4]}], (48, 48))
                        for interpolation in ("phong", "gouraud", "flat")]
            for other in pictures[1:]:
                away = np.sort(np.abs(other - pictures[0]).max(-1).ravel())
                # but for the 4 % of pixels at outlines and rims
                self.assertLess(away[int(0.96 * len(away))], 0.02, shape["type"])


PRIMARIES = {  # linear = encoded here; Y, I, Q and H, S, V by hand
    (1, 0, 0): ((0.30, 0.60, 0.21), (0, 1, 1)),
    (0, 1, 0): ((0.59, -0.28, -0.52), (1 / 3, 1, 1)),
    (0, 0, 1): ((0.11, -0.32, 0.31), (2 / 3, 1, 1)),
    (1, 1, 0): ((0.89, 0.32, -0.31), (1 / 6, 1, 1)),
    (0, 1, 1): ((0.70, -0.60, -0.21), (1 / 2, 1, 1)),
    (1, 0, 1): ((0.41, 0.28, 0.52), (5 / 6, 1, 1)),
    (1, 1, 1): ((1, 0, 0), (0, 0, 1)),
    (0, 0, 0): ((0, 0, 0), (0, 0, 0)),
}


def swatches(colors):
    """A picture with a row of flat colors, 4 pixels each, and the columns of their middles."""
    n = len(colors)
    objects = [{"type": "box", "size": [1, 1, 1],
                "transform": {"translate": [i - (n - 1) / 2, 0, 0]},
                "material": {"emissive": list(c), "diffuse": 0}} for i, c in enumerate(colors)]
    return {"image": {"width": 4 * n, "height": 4, "samples": 1},
            "camera": {"type": "orthographic", "position": [0, 0, 4], "height": 1},
            "lights": [], "objects": objects}, [4 * i + 2 for i in range(n)]


class Primaries(unittest.TestCase):
    def test_codes(self):
        document, columns = swatches(PRIMARIES)
        for space in ("YIQ", "YIQ linear", "HSV", "HSV linear"):
            measured = program.codes(document, colorSpace=space)[2, columns, :3]
            for row, (rgb, (yiq, hsv)) in zip(measured, PRIMARIES.items()):
                expected = (color.yiq_codes(np.array(yiq, dtype=float)) if "YIQ" in space
                            else color.codes(np.array(hsv, dtype=float)))
                self.assertLessEqual(np.abs(row - expected).max(), 1, f"{space} of {rgb}")

    def test_floats(self):
        document, columns = swatches(PRIMARIES)
        for space in ("YIQ", "YIQ linear", "HSV", "HSV linear"):
            output = {"format": "exr", "bitDepth": "float", "colorSpace": space}
            samples, names = program.read(program.shade({**document, "output": output}), "exr")
            measured = samples[2, columns][:, [names.index(c) for c in "RGB"]]
            expected = [values["HSV" in space] for values in PRIMARIES.values()]
            np.testing.assert_allclose(measured, expected, atol=2e-6, err_msg=space)

    def test_greys_are_exact(self):
        greys = [i / 16 for i in range(17)]
        document, columns = swatches([(g, g, g) for g in greys])
        encoded = color.codes(color.srgb_encode(np.array(greys)))
        y, i, q = program.codes(document, colorSpace="YIQ")[2, columns, :3].T
        np.testing.assert_array_equal(y, encoded)
        self.assertEqual({*i, *q}, {128})
        h, s, v = program.codes(document, colorSpace="HSV")[2, columns, :3].T
        np.testing.assert_array_equal(v, encoded)
        self.assertEqual({*h, *s}, {0})
        wide = program.codes(document, colorSpace="YIQ", bitDepth=16)[2, columns, 1:3]
        self.assertEqual({*wide.ravel()}, {32896})


if __name__ == "__main__":
    unittest.main()
