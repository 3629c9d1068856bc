"""Static plane strain of a clamped beam under its weight: nine-node finite elements, small strain. The
reference of locking.py.

The pressure is summed over 2 x 2 points, all else over 3 x 3: so these elements do not lock."""

import numpy as np


def shapes(t):
    """Values and slopes of the three quadratic functions of an edge at t in [-1, 1]."""
    return np.array([t * (t - 1) / 2, 1 - t * t, t * (t + 1) / 2]), np.array([t - 0.5, -2 * t, t + 0.5])


def stiffness(lame, shear, a, b):
    """Stiffness of one element with the edges a and b, and the weight of a unit body force on each node."""
    volume = lame + 2 * shear / 3  # bulk modulus, for the mean of the strains
    laws = {
        3: shear * np.array([[4, -2, 0], [-2, 4, 0], [0, 0, 3]]) / 3,
        2: volume * np.array([[1, 1, 0], [1, 1, 0], [0, 0, 0]]),
    }
    matrix, weight = np.zeros((18, 18)), np.zeros(9)
    for order, law in laws.items():
        points, shares = np.polynomial.legendre.leggauss(order)
        for s, t, share in [
            (s, t, a * b / 4 * of_s * of_t)
            for s, of_s in zip(points, shares)
            for t, of_t in zip(points, shares)
        ]:
            (n, dn), (m, dm) = shapes(s), shapes(t)
            along_x, along_z = np.outer(m, dn).ravel() * 2 / a, np.outer(dm, n).ravel() * 2 / b
            strain = np.zeros((3, 18))
            strain[0, 0::2] = strain[2, 1::2] = along_x
            strain[1, 1::2] = strain[2, 0::2] = along_z
            matrix += share * strain.T @ law @ strain
            if order == 3:
                weight += share * np.outer(m, n).ravel()
    return matrix, weight


def cantilever(length, height, young, poisson, force, place, elements=8):
    """Deflection along z at a place (x, z) of a beam 0..length, 0..height held at x = 0 under a body force
    (N/m3) along z.

    elements: over the height; over the length as many more as keeps them square."""
    lame, shear = young * poisson / (1 + poisson) / (1 - 2 * poisson), young / 2 / (1 + poisson)
    across, along = elements, round(elements * length / height)
    a, b = length / along, height / across
    matrix, weight = stiffness(lame, shear, a, b)
    rows = 2 * across + 1
    size = 2 * rows * (2 * along + 1)
    whole, load = np.zeros((size, size)), np.zeros(size)
    corner = np.array([i * rows + k for k in range(3) for i in range(3)])
    for i in range(along):
        for k in range(across):
            nodes = corner + 2 * i * rows + 2 * k
            places = np.stack([2 * nodes, 2 * nodes + 1], axis=1).ravel()
            whole[np.ix_(places, places)] += matrix
            load[2 * nodes + 1] += weight * force
    free = slice(2 * rows, size)
    moved = np.zeros(size)
    moved[free] = np.linalg.solve(whole[free, free], load[free])
    i, k = min(int(place[0] / a), along - 1), min(int(place[1] / b), across - 1)
    values = np.outer(
        shapes(2 * (place[1] - k * b) / b - 1)[0], shapes(2 * (place[0] - i * a) / a - 1)[0]
    ).ravel()
    return values @ moved[2 * (corner + 2 * i * rows + 2 * k) + 1]


if __name__ == "__main__":
    for nu in (0.3, 0.49, 0.499):
        beam = [cantilever(6.0, 1.0, 1e6, nu, -1.0, (6.0, 0.5), elements) for elements in (2, 4, 6, 8)]
        plane, kappa = 1e6 / (1 - nu**2), 5 / 6
        theory = -(6.0**4 * 12 / 8 / plane + 6.0**2 / 2 / (kappa * 1e6 / 2 / (1 + nu)))
        print(nu, beam, theory)
