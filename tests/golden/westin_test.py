"""Grooved spheres against the radiosity of V-grooves, computed here.

Tolerance: what docs/model.md states of tables against radiosity, noise and splines together: 0.03
of pi f_r at most; pixels are near enough to the middle that directions are not level."""

import unittest

import numpy as np

from reference import program

STRIPS = 400
ANGLE = 50
KD = np.array([0.8, 0.5, 0.2])
TOLERANCE = 0.03


def unit(v):
    return np.asarray(v, float) / np.linalg.norm(v)


class Grooves:
    """Both sides of a groove from -1 to 1, its valley at 0, as strips that are endless along it."""

    def __init__(self, degrees):
        angle = np.radians(degrees)
        self.sine, self.cosine, self.tangent = np.sin(angle), np.cos(angle), np.tan(angle)
        u = self.u = (np.arange(STRIPS) + 0.5) / STRIPS
        across = u[:, None] + u[None, :]
        up = (u[None, :] - u[:, None]) * self.tangent
        r = np.hypot(across, up)
        between = ((self.sine * across + self.cosine * up) * (self.sine * across - self.cosine * up)
                   / (2 * r ** 3) / (STRIPS * self.cosine))
        zero = np.zeros_like(between)
        self.between = np.block([[zero, between], [between, zero]])

    def sees(self, d):
        """(n.d)+ of all strips, those of the side of positive y first, or 0 if a ridge is before d."""
        sides = []
        for side in (1, -1):
            facing = -side * self.sine * d[1] + self.cosine * d[2]
            ridge = 1 - np.sign(d[1]) * side * self.u
            free = self.u * self.tangent + d[2] / abs(d[1]) * ridge >= self.tangent
            sides.append(np.where(free, max(facing, 0), 0))
        return np.concatenate(sides)

    def reflect(self, light, view, kd):
        """pi f_r; directions are along the groove, across it and out of the surface."""
        sent = np.linalg.solve(np.eye(2 * STRIPS) - kd * self.between, self.sees(light))
        return kd * (self.sees(view) @ sent) / (2 * STRIPS * self.cosine * light[2] * view[2])


class Westin(unittest.TestCase):
    def test_a_grooved_sphere_shows_its_radiosity(self):
        n, light = 9, unit([0.5, 0.7, 1])
        document = {"image": {"width": n, "height": n, "samples": 1},
                    "camera": {"type": "orthographic", "position": [0, 0, 4], "height": 2},
                    "lights": [{"type": "directional", "direction": list(-light)}],
                    "objects": [{"type": "sphere", "material": {
                        "model": "westin", "diffuse": list(KD), "ambient": 0,
                        "microgeometry": {"type": "grooves", "angle": ANGLE}}}]}
        rgb = program.rgb(program.linear(document, "exact"))
        grooves = Grooves(ANGLE)
        compared = 0
        for row in range(n):
            for column in range(n):
                x, y = ((column + 0.5) / n - 0.5) * 2, (0.5 - (row + 0.5) / n) * 2
                if x * x + y * y > 0.5:
                    continue
                normal = np.array([x, y, np.sqrt(1 - x * x - y * y)])
                if normal @ light < 0.3:
                    continue
                tangent = unit([normal[2], 0, -normal[0]])
                frame = np.array([tangent, np.cross(normal, tangent), normal])
                local, view = frame @ light, frame @ np.array([0, 1e-9, 1])
                expected = [grooves.reflect(local, view, kd) * local[2] for kd in KD]
                np.testing.assert_allclose(rgb[row, column], expected, rtol=0, atol=TOLERANCE)
                compared += 1
        self.assertGreater(compared, 20)

    def test_flat_grooves_are_lambertian(self):
        def picture(material):
            document = {"image": {"width": 16, "height": 16, "samples": 1},
                        "lights": [{"type": "point", "position": [1, 2, 3]}],
                        "objects": [{"type": "torus", "material": {"diffuse": list(KD), **material}}]}
            return program.rgb(program.linear(document, "exact"))
        flat = picture({"model": "westin", "microgeometry": {"type": "grooves", "angle": 0}})
        # the table's entries are sums of 4096 floats
        np.testing.assert_allclose(flat, picture({}), rtol=0, atol=1e-5)


if __name__ == "__main__":
    unittest.main()
