"""Growth of motion about a bar under uniform uniaxial strain (doc/developer/theory.md, Splitting):
eigenvalues of the derivative of the nodal accelerations by the nodal displacements, where positions,
deformation gradients and domains of particles follow the nodes. Neo-Hookean law, Poisson's ratio 0.3,
periodic in all directions, worst of several offsets of the particles from the grid. Lengths in cells. usage:
tension.py (numpy; some minutes)"""

import itertools

import numpy as np

SHEAR, BULK = 1 / 2.6, 1 / 1.2
MODULUS = BULK + 4 / 3 * SHEAR
AXES = np.eye(3)


def hat(s):
    return np.maximum(0, 1 - np.abs(s))


def hat_integral(s):
    s = np.clip(s, -1, 1)
    return np.where(s < 0, 0.5 * (1 + s) ** 2, 1 - 0.5 * (1 - s) ** 2)


def images(function, x, cells):
    """A function of the distance to every node and its periodic images: (particles, nodes)."""
    distance = x[:, None] - np.arange(cells)
    return sum(function(distance + k * cells) for k in range(-3, 4))


def outer(a, b, c):
    return np.einsum("pi,pj,pk->pijk", a, b, c).reshape(len(a), -1)


def box_weights(x, edges, cells):
    """Eq. weights; `edges` (particles, 3, 3), half edges as columns."""
    weight, slope = [], []
    for a in range(3):
        half = np.minimum(edges[:, a, a], 0.5)[:, None]
        weight.append(
            images(
                lambda d: (hat_integral(d + half) - hat_integral(d - half)) / (2 * half), x[:, a], cells[a]
            )
        )
        slope.append(images(lambda d: (hat(d + half) - hat(d - half)) / (2 * half), x[:, a], cells[a]))
    gradient = [outer(*(slope[b] if a == b else weight[b] for b in range(3))) for a in range(3)]
    return outer(*weight), np.stack(gradient, axis=2)


def corner_weights(x, edges, cells):
    """Eqs corners and fit."""
    edges = edges * np.minimum(1, 0.5 / np.abs(edges).sum(axis=2).max(axis=1))[:, None, None]
    rows = np.linalg.inv(edges)
    weight, gradient = 0, 0
    for signs in itertools.product((-1.0, 1.0), repeat=3):
        corner = x + edges @ np.array(signs)
        part = outer(*(images(hat, corner[:, a], cells[a]) for a in range(3))) / 8
        weight = weight + part
        gradient = gradient + part[:, :, None] * np.einsum("pki,k->pi", rows, np.array(signs))[:, None, :]
    return weight, gradient


def stress(deformation):
    """Eq. neo-hookean."""
    volume = np.linalg.det(deformation)[:, None, None]
    b = deformation @ np.swapaxes(deformation, 1, 2)
    return (
        SHEAR * volume ** (-5 / 3) * (b - np.trace(b, axis1=1, axis2=2)[:, None, None] / 3 * AXES)
        + BULK * (volume - 1) * AXES
    )


def growth(domain, cells, particles, stretch, offsets=4):
    """Fastest growth, over sqrt(modulus/density)/h, for `particles` along each axis of a box of `cells` of
    stretched material."""
    cells, particles = np.array(cells), np.array(particles)
    weights = corner_weights if domain == "corners" else box_weights
    half = cells / (2 * particles)
    lattice = np.stack(
        np.meshgrid(*((np.arange(n) + 0.5) * c / n for n, c in zip(particles, cells)), indexing="ij"), -1
    ).reshape(-1, 3)
    deformation = np.tile(np.diag([1.0, 1.0, stretch]), (len(lattice), 1, 1))
    edges, volume = np.tile(np.diag(half), (len(lattice), 1, 1)), np.full(len(lattice), np.prod(2 * half))
    moving = [a for a in range(3 * cells.prod()) if cells[a % 3] > 1]
    chance, worst = np.random.default_rng(0), 0.0
    for n in range(offsets):
        x = lattice + (chance.random(3) if n else 0) * (cells > 1)
        weight, gradient = weights(x, edges, cells)

        def force(u):
            change = np.eye(3) + np.einsum("ni,pnj->pij", u, gradient)
            follow = (
                change @ edges if domain == "corners" else edges * np.einsum("paa->pa", change)[:, :, None]
            )
            later = weights(x + weight @ u, follow, cells)[1]
            return -np.einsum(
                "p,pij,pnj->ni", volume * np.linalg.det(change), stress(change @ deformation), later
            )

        mass, step = weight.T @ volume, 1e-6
        jacobian = []
        for a in moving:
            u = np.zeros((cells.prod(), 3))
            u.flat[a] = step
            jacobian.append(((force(u) - force(-u)) / (2 * step) / mass[:, None]).ravel()[moving])
        worst = max(
            worst,
            np.abs(np.sqrt(np.linalg.eigvals(np.array(jacobian).T).astype(complex) / MODULUS).real).max(),
        )
    return worst


print("stretch, along the axis: half sizes", *(f"{6 / n:.3f}" for n in (12, 13, 14, 15)))
for stretch in (0.9, 1.02, 1.5, 2, 5):
    print(
        f"{stretch:5}",
        *(f"{growth('stretch', (1, 1, 12), (1, 1, n), stretch):7.3f}" for n in (12, 13, 14, 15)),
        flush=True,
    )
print("corners, across the axis, 0.3 along it: half edges", *(f"{2 / n:.3f}" for n in (4, 5, 6, 8)))
for stretch in (1.02, 1.5, 2, 4):
    print(
        f"{stretch:5}",
        *(f"{growth('corners', (4, 1, 6), (n, 1, 10), stretch, offsets=3):7.3f}" for n in (4, 5, 6, 8)),
        flush=True,
    )
