"""A rigid frictionless indenter of any form on an elastic half-space, small strains.

Boussinesq's integral over the contact: a pressure p on the surface of a half-space of plane modulus E' = E/(1
- nu^2) moves it along the axis by

    w(x) = 1/(pi E') int p(y) / |x - y| dA,      w = h - f(x) where p > 0,  w >= h - f(x) elsewhere, p >= 0

for a tool of profile f at depth h. The pressure is constant over squares (Love, Phil. Trans. R. Soc. A 228
(1929) 377), the integral a convolution (FFT without images), the pressures those of conjugate gradients
within the contact (Polonsky and Keer, Wear 231 (1999) 206). The surface does not move sideways here, as in
all small-strain solutions: loads of pyramids and cones go with the tangent of their half angle, and E' h^2.

    half_space.py [POINTS]     of a cone (exact 2/pi), a three- and a four-sided pyramid on such grids: number
                               of faces (0: a cone), points, load over E' h^2 tan(half angle), area of contact
                               over (h tan(half angle))^2, stiffness over E' sqrt(area), and that of a flat
                               punch whose outline is the tool's section (exact 2/sqrt(pi) for a cone)"""

import math
import sys

import numpy as np


def influence(points, edge):
    """Fourier transform of the displacement (m) that a unit of pressure over E' on one square of an edge (m)
    makes at all others."""
    middle = np.arange(-points, points) * edge
    x, y = np.meshgrid(middle, middle, indexing="ij")

    def corner(a, b):  # the integral of 1/r from the middle to here; no square's corner lies on an axis
        return a * np.arcsinh(b / np.abs(a)) + b * np.arcsinh(a / np.abs(b))

    total = 0.0
    for i in (0.5, -0.5):
        for k in (0.5, -0.5):
            total = total + 4 * i * k * corner(x + i * edge, y + k * edge)
    return np.fft.rfft2(np.fft.ifftshift(total / math.pi))


def press(profile, edge, depth, tolerance=1e-9, most=2000):
    """Pressure over E' on squares of an edge (m) under a rigid tool whose surface lies at `profile` (m,
    square array) above its tip, at a depth (m). The contact must lie inside the array."""
    n = len(profile)
    kernel = influence(n, edge)

    def displacement(p):
        padded = np.zeros((2 * n, 2 * n))
        padded[:n, :n] = p
        return np.fft.irfft2(np.fft.rfft2(padded) * kernel, s=(2 * n, 2 * n))[:n, :n]

    wanted = depth - profile
    p = np.where(wanted > 0, wanted / edge / n, 0.0)
    way = np.zeros_like(p)
    before, fresh = 1.0, True
    for _ in range(most):
        gap = displacement(p) - wanted  # 0 where there is contact
        touching = p > 0
        now = float(np.sum(gap[touching] ** 2))
        way = np.where(touching, gap + (0.0 if fresh else now / before) * way, 0.0)
        before, fresh = now, False
        step = float(np.sum(gap[touching] * way[touching])) / float(
            np.sum(displacement(way)[touching] * way[touching])
        )
        last = p
        p = np.maximum(np.where(touching, p - step * way, p), 0.0)
        reached = (p == 0) & (gap < 0)
        if np.any(reached):
            p = np.where(reached, p - step * gap, p)
            fresh = True
        if np.sum(np.abs(p - last)) < tolerance * np.sum(p) and not fresh:
            return p
    raise ArithmeticError(f"the contact is not solved in {most} iterations")


def pyramid(faces, x, y):
    """Height above the tip, over the cotangent of the half angle between axis and faces; 0 faces: a cone."""
    if faces == 0:
        return np.hypot(x, y)
    turns = 2 * math.pi * np.arange(faces) / faces
    return np.max([math.cos(t) * x + math.sin(t) * y for t in turns], axis=0)


def curvature(faces, points):
    """P / (E' h^2 tan(half angle)) and the contact's area over (h tan(half angle))^2, of one grid."""
    wide = 1.7 if faces == 3 else 1.05
    edge = 2 * wide / points
    at = (np.arange(points) + 0.5) * edge - wide
    x, y = np.meshgrid(at, at, indexing="ij")
    p = press(pyramid(faces, x, y), edge, 1.0)
    rim = np.concatenate([p[0], p[-1], p[:, 0], p[:, -1]])
    if np.any(rim > 0):
        raise ArithmeticError("the contact reaches the rim of the array")
    return float(p.sum()) * edge**2, float(np.count_nonzero(p)) * edge**2


def punch_stiffness(faces, points):
    """Stiffness over E' sqrt(area) of a flat punch whose outline is the section of a pyramid; 0 faces: a
    circle."""
    wide = 2.1 if faces == 3 else 1.5
    edge = 2 * wide / points
    at = (np.arange(points) + 0.5) * edge - wide
    inside = pyramid(faces, *np.meshgrid(at, at, indexing="ij")) < 1
    p = press(np.where(inside, 0.0, 2.0), edge, 1.0)  # the surface beside it sinks in by less than 1
    return float(p.sum()) * edge / math.sqrt(np.count_nonzero(inside))


if __name__ == "__main__":
    for faces in (0, 3, 4):
        for points in [int(word) for word in sys.argv[1:]] or [256]:
            load, area = curvature(faces, points)
            # the load goes with the square of the depth
            print(faces, points, load, area, 2 * load / math.sqrt(area), punch_stiffness(faces, points))
