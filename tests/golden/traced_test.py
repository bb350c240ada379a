"""Shadows, mirrors, glass and opacity whose values a formula gives.

EXACT is what a float sample holds of a value near 1, with room for the last operations. Pixels whose
ray passes a rim nearer than RIM may be on either side of it: both sides compute it in f64.
"""

import math
import unittest

import numpy as np

from reference import program

EXACT = 3e-7
RIM = 1e-9
FRONT = {"type": "orthographic", "position": [0, 0, 4], "height": 2}


def channels(objects, lights, trace, layers=None, size=(33, 25), **more):
    document = {"image": {"width": size[0], "height": size[1], "samples": 1}, "camera": FRONT,
                "lights": lights, "objects": objects, "trace": trace, **more}
    return program.linear(document, layers=layers)


def picture(objects, lights, trace, **more):
    return program.rgb(channels(objects, lights, trace, **more))


def through_pixels(size, height):
    """x and y of an orthographic camera's rays."""
    w, h = size
    x = ((np.arange(w) + 0.5) / w - 0.5) * height * w / h
    y = (0.5 - (np.arange(h) + 0.5) / h) * height
    return np.meshgrid(x, y)


def snell(direction, normal, eta):
    """Behind a surface whose normal faces the ray."""
    along = -np.dot(direction, normal)
    return eta * direction + (eta * along - math.sqrt(1 - eta * eta * (1 - along * along))) * normal


class Shadows(unittest.TestCase):
    def test_a_sphere_shadows_a_plane(self):
        """Seen from above: the ray from the plane to the lamp passes the center at less than 1."""
        size, lamp, center = (91, 71), np.array([1.5, 6, -0.7]), np.array([0.2, 1.3, 0.1])
        camera = {"type": "orthographic", "position": [0, 9, 0], "target": [0, 0, 0], "up": [0, 0, -1],
                  "height": 7}
        rgb = picture([{"type": "plane", "material": {"diffuse": 0.5, "ambient": 1}},
                       {"type": "sphere", "material": {"diffuse": 0, "ambient": 0},
                        "transform": {"translate": center.tolist()}}],
                      [{"type": "point", "position": lamp.tolist()}], {"shadows": True},
                      size=size, camera=camera, ambient=0.25)[..., 0]
        x, up = through_pixels(size, 7)
        place = np.stack([x, np.zeros_like(x), -up], -1)
        way = lamp - place
        distance = np.linalg.norm(way, axis=-1)
        toward = way / distance[..., None]
        off = np.linalg.norm(np.cross(center - place, toward), axis=-1)
        seen = np.hypot(x - center[0], -up - center[2]) > 1 + RIM
        near = np.abs(off - 1) < RIM
        expected = 0.25 + np.where(off < 1, 0, 0.5 * toward[..., 1])
        self.assertGreater(np.sum(seen & (off < 1)), 200)
        np.testing.assert_allclose(rgb[seen & ~near], expected[seen & ~near], rtol=0, atol=EXACT)

    def test_a_surface_that_is_seen_through_dims_light_twice(self):
        """From one side into the ball and out of the other."""
        rgb = picture([{"type": "plane", "transform": {"rotate": [90, 0, 0], "translate": [0, 0, -3]},
                        "material": {"diffuse": 1}},
                       {"type": "sphere", "material": {"opacity": [0.25, 0.5, 1], "diffuse": 0},
                        "transform": {"translate": [5, 0, 0]}}],
                      [{"type": "directional", "direction": [-5, 0, -3]}], {"shadows": True}, size=(1, 1))
        np.testing.assert_allclose(rgb[0, 0], 3 / math.hypot(3, 5) * np.array([0.75 ** 2, 0.5 ** 2, 0]),
                                   atol=EXACT)

    def test_a_lamp_on_a_ball_lights_its_side_alone(self):
        wall = {"type": "plane", "transform": {"rotate": [90, 0, 0], "translate": [0, 0, -1.5]},
                "material": {"diffuse": 1}}
        ball = {"type": "sphere", "material": {"diffuse": 0}, "transform": {"translate": [9, 0, 0]}}
        for lamp, lit in (([8, 0, 0], True), ([10, 0, 0], False), ([9, 0, 0], False), ([9, 0, -1], True)):
            rgb = picture([wall, ball], [{"type": "point", "position": lamp}], {"shadows": True}, size=(1, 1))
            expected = (lamp[2] + 1.5) / math.hypot(lamp[0], lamp[2] + 1.5) if lit else 0
            np.testing.assert_allclose(rgb[0, 0], expected, atol=EXACT, err_msg=str(lamp))

    def test_the_layer_tells_the_share(self):
        two = [{"type": "point", "position": [0, 5, 0]}, {"type": "directional", "direction": [0, -1, 0]}]
        c = channels([{"type": "plane", "transform": {"rotate": [20, 0, 0]}},
                      {"type": "disc", "radius": 0.4, "transform": {"translate": [0, 3, 0]}}],
                     two, {"shadows": True}, layers=["beauty", "shadow"])
        self.assertEqual(set(np.unique(c["shadow.R"])) - {0, 0.5, 1}, set())
        self.assertGreater(len(np.unique(c["shadow.R"])), 1)


class Bounces(unittest.TestCase):
    def test_a_box_of_mirrors_is_a_geometric_series(self):
        box = [{"type": "box", "size": [3, 4, 20], "transform": {"rotate": [0, 0, 10]}, "material": {
            "emissive": [0.1, 0.2, 0.3], "diffuse": 0, "reflection": [0.9, 0.5, 0.2]}}]
        e, r = np.array([0.1, 0.2, 0.3]), np.array([0.9, 0.5, 0.2])
        camera = {"position": [0.2, 0.1, 4], "target": [1, 0.3, 3], "fov": 70}
        for depth in (0, 1, 2, 7, 16):
            rgb = picture(box, [], {"depth": depth, "minContribution": 0}, camera=camera)
            series = e * sum(r ** k for k in range(depth + 1))
            np.testing.assert_allclose(rgb, np.broadcast_to(series, rgb.shape), atol=EXACT)
        rgb = picture(box, [], {"depth": 16, "minContribution": 0.5}, camera=camera)
        steps = sum(0.9 ** k >= 0.5 for k in range(17))  # the largest channel's
        series = e * sum(r ** k for k in range(steps))
        np.testing.assert_allclose(rgb, np.broadcast_to(series, rgb.shape), atol=EXACT)

    def test_a_slab_shifts_what_is_behind_it(self):
        size, angle, thick, ior, lamp = (41, 31), 35, 0.8, 1.45, np.array([0.4, 0.3, -1.5])
        rgb = picture([{"type": "box", "size": [20, 20, thick], "transform": {"rotate": [0, angle, 0]},
                        "material": {"diffuse": 0, "transmission": 0.9, "ior": ior}},
                       {"type": "plane", "transform": {"rotate": [90, 0, 0], "translate": [0, 0, -3]},
                        "material": {"diffuse": 0.8}}],
                      [{"type": "point", "position": lamp.tolist()}], {"depth": 2, "minContribution": 0},
                      size=size, camera={**FRONT, "position": [0, 0, 9]})[..., 0]
        x, y = through_pixels(size, 2)
        turn = math.radians(angle)
        normal = np.array([math.sin(turn), 0, math.cos(turn)])
        ray = np.array([0, 0, -1.0])
        inside = snell(ray, normal, 1 / ior)
        enter = np.stack([x, y, (thick / 2 - x * normal[0]) / normal[2]], -1)
        leave = enter + inside * (thick / -np.dot(inside, normal))
        way = lamp - np.stack([leave[..., 0], leave[..., 1], np.full_like(x, -3)], -1)
        expected = 0.9 ** 2 * 0.8 * way[..., 2] / np.linalg.norm(way, axis=-1)
        self.assertGreater(np.abs(leave - enter)[..., 0].min(), 0.15)
        np.testing.assert_allclose(rgb, expected, atol=EXACT)

    def test_what_cannot_be_refracted_is_mirrored(self):
        """From below, in what is behind the plane: sin(angle) ior > 1 or not."""
        ground = {"type": "disc", "radius": 900, "transform": {"translate": [0, -2, 0]},
                  "material": {"emissive": [0.3, 0.6, 0.9], "diffuse": 0}}
        water = {"type": "plane", "material": {"diffuse": 0, "reflection": 0.125, "transmission": 0.75,
                                               "ior": 1.333}}
        sky, bottom = np.array([0.5, 0.25, 0.125]), np.array([0.3, 0.6, 0.9])
        for angle in (10, 40, 48, 49.2, 70):
            way = [math.sin(math.radians(angle)), math.cos(math.radians(angle)), 0]
            rgb = picture([ground, water], [], {"depth": 3, "minContribution": 0}, size=(1, 1),
                          background=sky.tolist(), camera={"position": [0, -1, 0], "target": [way[0], way[1] - 1, 0],
                                                           "up": [0, 0, 1], "fov": 1})
            total = math.sin(math.radians(angle)) * 1.333 > 1
            # What is mirrored comes down to the ground, which is no mirror.
            expected = 0.875 * bottom if total else 0.125 * bottom + 0.75 * sky
            np.testing.assert_allclose(rgb[0, 0], expected, atol=EXACT, err_msg=str(angle))

    def test_alpha_is_what_no_surface_leaves(self):
        rings = [{"type": "sphere", "radius": 0.8, "material": {"emissive": 0.5, "diffuse": [0, 0, 0, 0.3]}},
                 {"type": "disc", "radius": 0.4, "transform": {"rotate": [90, 0, 0], "translate": [0, 0, -2]},
                  "material": {"emissive": 0.25, "diffuse": 0}}]
        size = (33, 33)
        c = channels(rings, [], {"depth": 4, "minContribution": 0}, background=None, size=size)
        x, y = through_pixels(size, 2)
        far = np.hypot(x, y)
        thin = 1 - 0.7 ** 2
        np.testing.assert_allclose(c["A"], np.where(far < 0.4, 1, np.where(far < 0.8, thin, 0)), atol=EXACT)
        beauty = np.where(far < 0.4, thin * 0.5 + 0.49 * 0.25, np.where(far < 0.8, thin * 0.5, 0))
        np.testing.assert_allclose(c["R"], beauty, atol=EXACT)  # EXR is premultiplied
        over = picture(rings, [], {"depth": 4, "minContribution": 0}, background=0.125, size=size)[..., 0]
        np.testing.assert_allclose(over, beauty + 0.125 * (1 - c["A"]), atol=EXACT)

    def test_several_samples_mix_as_their_pictures(self):
        rings = [{"type": "sphere", "radius": 0.8, "material": {"emissive": 0.5, "diffuse": [0, 0, 0, 0.3]}}]
        for background in (None, 0.125):
            c = channels(rings, [], {"depth": 4, "minContribution": 0}, background=background, size=(9, 9))
            big = {"image": {"width": 9, "height": 9, "samples": 16}, "camera": FRONT, "lights": [],
                   "objects": rings, "trace": {"depth": 4, "minContribution": 0}, "background": background}
            many = program.linear(big)
            inside = np.hypot(*through_pixels((9, 9), 2)) < 0.6
            for name in many:
                np.testing.assert_allclose(many[name][inside], c[name][inside], atol=EXACT)

    def test_layers_add_up_to_the_beauty(self):
        glass = {"diffuse": 0.3, "ambient": 0.2, "emissive": 0.05, "specular": 0.4, "opacity": 0.7,
                 "reflection": 0.2, "transmission": 0.3}
        parts = ["emissive", "ambient", "diffuse", "specular", "bounce"]
        c = channels([{"type": "sphere", "radius": 0.7, "material": glass},
                      {"type": "plane", "transform": {"rotate": [80, 0, 0], "translate": [0, 0, -2]}}],
                     [{"type": "point", "position": [3, 3, 3]}], {"shadows": True, "depth": 4}, ambient=0.4,
                     layers=["beauty", *parts])
        for k in "RGB":
            np.testing.assert_allclose(sum(c[f"{part}.{k}"] for part in parts), c[f"beauty.{k}"], atol=2e-6)
        self.assertGreater(np.abs(c["bounce.R"]).max(), 0.1)

    def test_a_region_is_a_crop(self):
        document = {"image": {"width": 70, "height": 50, "samples": 4},
                    "camera": {"position": [0, 1.5, 5], "target": [0, 0.5, 0]},
                    "lights": [{"type": "point", "position": [3, 4, 3]}],
                    "trace": {"shadows": True, "depth": 5},
                    "objects": [{"type": "plane", "material": {"diffuse": 0.5, "reflection": 0.3}},
                                {"type": "torus", "material": {"diffuse": 0.1, "transmission": 0.8},
                                 "transform": {"rotate": [60, 20, 0], "translate": [0, 1, 0]}},
                                {"type": "sphere", "interpolation": "gouraud", "transform": {"translate": [1, 0.7, -1]},
                                 "material": {"diffuse": [0.7, 0.3, 0.2, 0.6]}}]}
        whole = program.rgb(program.linear(document))
        part = program.rgb(program.linear(
            {**document, "image": {**document["image"], "region": [13, 7, 41, 37]}}))
        np.testing.assert_array_equal(part, whole[7:44, 13:54])

    def test_a_mirror_sees_the_front_of_a_light_whose_back_the_camera_sees(self):
        light = {"type": "rect", "position": [1, 0, 2], "direction": [0, 0, -1], "size": [0.5, 0.5],
                 "color": [1, 0.5, 0.25], "visible": True}
        mirror = {"type": "disc", "radius": 3, "transform": {"rotate": [90, 0, 0]},
                  "material": {"diffuse": 0, "ambient": 0, "reflection": 0.5}}
        document = {"image": {"width": 9, "height": 9, "samples": 1}, "lights": [light],
                    "camera": {"position": [-1, 0, 3], "target": [0.2, 0, 0], "fov": 1},
                    "objects": [mirror], "trace": {"depth": 1}}
        seen = program.rgb(program.linear(document))[4, 4]
        np.testing.assert_allclose(seen, 0.5 * math.pi / 0.25 * np.array([1, 0.5, 0.25]), rtol=EXACT)
        document["camera"]["target"] = [1, 0, 2]
        np.testing.assert_array_equal(program.rgb(program.linear(document))[4, 4], 0)


if __name__ == "__main__":
    unittest.main()
