"""The reflectance spectra of the primaries of linear Rec.709, after Mallett and Yuksel, "Spectral Primary
Decomposition for Rendering with sRGB Reflectance" (EGSR 2019, section 3).

Three curves of 36 samples from 380 to 730 nm, linear between them, which have the least sum of squared
slopes of all that are nowhere negative, add up to 1 everywhere and have under D65 the colors of the three
primaries. That is a convex quadratic program, which solve() solves exactly: by an active set, whose
conditions of Karush, Kuhn and Tucker residual() checks. The figures are our own, not the paper's
supplement: its integrals are sums over 36 samples, ours are exact for tables that are linear between 5 nm.
"""

import numpy as np

START, STEP, COUNT, END = 380.0, 10.0, 36, 730.0
REC709 = ((0.640, 0.330), (0.300, 0.600), (0.150, 0.060))
GAUSS = np.polynomial.legendre.leggauss(4)  # exact for polynomials up to degree 7


def integrate(functions, knots):
    """The integral of the product of piecewise smooth functions between the knots; each gives [..., n]."""
    knots = np.unique(knots)
    middle, half = (knots[1:] + knots[:-1]) / 2, (knots[1:] - knots[:-1]) / 2
    at = (middle[:, None] + half[:, None] * GAUSS[0]).ravel()
    product = (half[:, None] * GAUSS[1]).ravel()
    for function in functions:
        product = product * function(at)
    return product.sum(axis=-1)


def table(start, step, values):
    values = np.asarray(values, float)
    at = start + step * np.arange(values.shape[-1])
    if values.ndim == 1:
        return lambda nm: np.interp(nm, at, values)
    return lambda nm: np.array([np.interp(nm, at, row) for row in values])


def constraints(observer, d65):
    """Integrals of hats with D65 and the observer, [3][36], and XYZ of the primaries, [3][primary]: both for a
    white of Y = 1."""
    at = START + STEP * np.arange(COUNT)
    knots = np.arange(START, END + 1, 5)
    hats = [integrate([d65, observer, lambda nm, i=i: np.interp(nm, at, np.eye(COUNT)[i])], knots)
            for i in range(COUNT)]
    hats = np.array(hats).T
    white = hats.sum(axis=1)
    hats, white = hats / white[1], white / white[1]
    xyz = np.array([[x, y, 1 - x - y] for x, y in REC709]).T
    return hats, xyz * np.linalg.solve(xyz, white)


def program(observer, d65):
    """Minimize x'Hx with Ax = b and x >= 0, x being red, green and blue one after the other. What blue must be
    follows from the others."""
    slope = np.diff(np.eye(COUNT), axis=0)
    h = np.kron(np.eye(3), slope.T @ slope)
    hats, xyz = constraints(observer, d65)
    none = np.zeros_like(hats)
    a = np.vstack([np.kron(np.ones((1, 3)), np.eye(COUNT)), np.hstack([hats, none, none]),
                   np.hstack([none, hats, none])])
    return h, a, np.concatenate([np.ones(COUNT), xyz[:, 0], xyz[:, 1]])


def solve(observer, d65):
    h, a, b = program(observer, d65)
    n, zero = len(h), set()
    for _ in range(1000):
        held = np.eye(n)[sorted(zero)]
        rows = np.vstack([a, held])
        system = np.block([[2 * h, rows.T], [rows, np.zeros((len(rows),) * 2)]])
        answer = np.linalg.lstsq(system, np.concatenate([np.zeros(n), b, np.zeros(len(zero))]), rcond=1e-13)[0]
        x, force = answer[:n], -answer[n + len(a):]
        if x.min() < -1e-12:
            zero |= {int(i) for i in np.flatnonzero(x < min(-1e-12, x.min() / 2))}
        elif len(zero) and force.min() < -1e-10:
            zero.discard(sorted(zero)[int(force.argmin())])
        else:
            x[sorted(zero)] = 0
            return x.reshape(3, COUNT)
    raise ArithmeticError("the active set does not settle")


def residual(primaries, observer, d65):
    """How far the curves are from satisfying the program, and from being its least: (constraints, slopes)."""
    h, a, b = program(observer, d65)
    x = np.asarray(primaries).ravel()
    broken = max(np.abs(a @ x - b).max(), -x.min())
    free = x > 1e-9
    # The slope's gradient is a combination of the constraints where x is free, and not below it elsewhere.
    gradient = 2 * h @ x
    multipliers = np.linalg.lstsq(a[:, free].T, gradient[free], rcond=1e-13)[0]
    rest = gradient - a.T @ multipliers
    return broken, max(np.abs(rest[free]).max(), -rest[~free].min(initial=0))
