"""A rigid frictionless indenter on layers: exact loads of small, axisymmetric contacts.

An elastic film of thickness 1 is bonded to an elastic half-space, to a rigid base, or to an elastic layer
that is itself bonded to a rigid base; or it slides on them without friction and stays on them. Hankel
transforms of the bonded layers, and Abel's of the contact, leave a Fredholm equation of the second kind for
one function on the radius of the contact (Lebedev & Ufliand, PMM 22 (1958) 320; Dhaliwal, Int. J. Engng Sci.
8 (1970) 273), which Gauss's rule solves. Small strains; the surface moves along the axis only where it
touches.

Units: the film's thickness and its plane modulus E/(1 - nu^2) are 1; profiles are those of `Layers.press`.
"""

import math

import numpy as np


def _film(depth, x, height):
    """Rows F, F', F'', F''' of Love's function of one layer at a depth, for its four constants; x is wave
    number, and the two rising exponentials are counted from the layer's lower side, so that none is large."""
    a, b = math.exp(-x * depth), math.exp(-x * (height - depth))
    z = depth
    return np.array(
        [
            [a, z * a, b, z * b],
            [-x * a, (1 - x * z) * a, x * b, (1 + x * z) * b],
            [x * x * a, (x * x * z - 2 * x) * a, x * x * b, (2 * x + x * x * z) * b],
            [-(x**3) * a, (3 * x * x - x**3 * z) * a, x**3 * b, (3 * x * x + x**3 * z) * b],
        ]
    )


def _physical(rows, x, poisson, shear):
    """Normal and shear stress, radial and normal displacement, from the rows of Love's function."""
    f0, f1, f2, f3 = rows
    return np.array(
        [
            -x * x * f0,
            x * f1,
            ((1 - poisson) * f2 + poisson * x * x * f0) / (2 * shear * x),
            ((1 - poisson) * f3 - (2 - poisson) * x * x * f1) / (2 * shear * x * x),
        ]
    )


def compliance(x, poisson, ratio=0.0, base_poisson=0.3, base_height=math.inf, slides=False):
    """How much further the surface gives way under a pressure of wave number x (over the film's thickness)
    than that of a half-space of the film's material: 1 without layers. `ratio` is plane modulus of film over
    base (0: a rigid base), `base_height` the base's thickness, below which all is rigid. A film that `slides`
    bears no shear below; it does not lift off."""
    x = max(x, 1e-9)  # of smaller ones the columns are the same but for rounding
    shear = 0.5 * (1 - poisson)  # plane modulus 1
    top = _physical(_film(0.0, x, 1.0), x, poisson, shear)
    foot = _physical(_film(1.0, x, 1.0), x, poisson, shear)
    if ratio == 0:
        matrix = np.array([top[0], top[1], foot[1] if slides else foot[2], foot[3]])
    else:
        base_shear = 0.5 * (1 - base_poisson) / ratio
        if math.isinf(base_height):
            rows = np.array([[1, 0], [-x, 1], [x * x, -2 * x], [-(x**3), 3 * x * x]], dtype=float)
            head, floor = _physical(rows, x, base_poisson, base_shear), np.empty((4, 2))
        else:
            head = _physical(_film(0.0, x, base_height), x, base_poisson, base_shear)
            floor = _physical(_film(base_height, x, base_height), x, base_poisson, base_shear)
        size = 4 + head.shape[1]
        matrix = np.zeros((size, size))
        matrix[0, :4], matrix[1, :4] = top[0], top[1]
        matrix[2:6, :4], matrix[2:6, 4:] = foot, -head
        if slides:  # no shear on either side, in place of equal shear and equal motion along the interface
            matrix[3, 4:], matrix[4, :4], matrix[4, 4:] = 0, 0, head[1]
        if size == 8:
            matrix[6, 4:], matrix[7, 4:] = floor[2], floor[3]
    right = np.zeros(len(matrix))
    right[0] = -1.0
    rows = np.max(np.abs(matrix), axis=1)
    matrix, right = matrix / rows[:, None], right / rows
    columns = np.max(np.abs(matrix), axis=0)
    constants = np.linalg.solve(matrix / columns, right) / columns
    return float(top[3] @ constants[:4]) * x / 2


class Layers:
    """A film on its base, pressed by punches, spheres and cones."""

    def __init__(
        self, poisson, ratio=0.0, base_poisson=0.3, base_height=math.inf, points=240, reach=40.0, slides=False
    ):
        nodes, weights = np.polynomial.legendre.leggauss(points)
        # crowded near 0, and more so for a deep base, whose wave numbers are small
        power = 2 if math.isinf(base_height) else 4
        half = (nodes + 1) / 2
        self.x = reach * half**power
        self.weights = weights / 2 * reach * power * half ** (power - 1)
        self.lost = np.array(
            [1 - compliance(x, poisson, ratio, base_poisson, base_height, slides) for x in self.x]
        )

    def press(self, radius, shape, points=48):
        """Load and depth of a contact of this radius (units of the film: thickness 1, plane modulus 1). A
        flat punch has depth 1. The sphere has the profile r^2, a radius of curvature of 1/2 (and so load and
        depth of a sphere of radius R are these over 2 R). The cone has the slope 1."""
        nodes, weights = np.polynomial.legendre.leggauss(points)
        t, w = (nodes + 1) * radius / 2, weights * radius / 2
        waves = np.cos(np.outer(t, self.x))
        weighed = self.lost * self.weights
        kernel = (waves * weighed) @ waves.T
        matrix = np.eye(points) - 2 / math.pi * kernel * w
        ones = np.linalg.solve(matrix, np.ones(points))
        if shape == "flat":
            return 2 * float(w @ ones), 1.0
        # what the profile asks of the half-space: 2 r^2 for r^2, pi r / 2 for r
        wanted = (lambda r: 2 * r * r) if shape == "sphere" else (lambda r: math.pi / 2 * r)
        form = np.linalg.solve(matrix, wanted(t))
        at_edge = (np.cos(radius * self.x) * weighed) @ waves.T * w
        depth = (wanted(radius) + 2 / math.pi * float(at_edge @ form)) / (
            1 + 2 / math.pi * float(at_edge @ ones)
        )
        return 2 * float(w @ (depth * ones - form)), depth


def half_space_load(radius_or_depth, shape):
    """The same units on a half-space: the load at a depth of sphere or cone, or of a punch of this radius at
    depth 1."""
    if shape == "flat":
        return 2 * radius_or_depth
    if shape == "sphere":  # Hertz: 4/3 sqrt(R) h^1.5 with R = 1/2
        return 4 / 3 * math.sqrt(0.5) * radius_or_depth**1.5
    return 2 / math.pi * radius_or_depth**2  # Love: 2/pi h^2 over the slope 1


def stiffening(layers, radius, shape):
    """Load over that on a half-space, at the same depth."""
    load, depth = layers.press(radius, shape)
    return load / half_space_load(radius if shape == "flat" else depth, shape)


def base_compliance(poisson):
    """q of the depth q P / (E' t) by which a small contact on a layer of thickness t, bonded to a rigid base,
    goes in less than on a half-space. Of P / E' only: far from the contact nothing else is felt."""
    layers = Layers(poisson)
    return float(layers.lost @ layers.weights) / math.pi
