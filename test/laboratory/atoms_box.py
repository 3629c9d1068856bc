#!/usr/bin/env python3
"""Bonds across the faces, edges and corners of a box of atoms, against the stress of the continuum around it.

A lattice is deformed homogeneously. Inside a box its atoms are real; outside they are pads that stand for the
continuum. Each bond pushes the continuum where it crosses the box: one between a real atom and a pad once, one
between two pads that cuts an edge or a corner where it enters and where it leaves. Nodes of a grid of hat
functions take these forces; what they take of the continuum's stress, -int sigma grad N over the outside, must
balance them.

Printed are, relative to the traction on a face of a cell: the largest force left on a node of faces (that
reaches no edge), of edges, of corners; the sum of all; and the torque, relative to traction times box. The last
column is the largest force without the bonds between two pads. To spread a force over a cell of the lattice
around the crossing, in the face, was tried: edges are pushed three times as much then.

   python3 test/laboratory/atoms_box.py           some minutes
"""

import numpy as np
from scipy.spatial import cKDTree

CUT, NEAR = 5.0, 2.55  # angstrom, of an invented metal


def fade(r):
    return np.maximum(0.0, 1 - r / CUT) ** 4


def fade_slope(r):
    return -4 / CUT * np.maximum(0.0, 1 - r / CUT) ** 3


def phi_slope(r):
    return 2.1 * np.exp(-3.0 * (r - NEAR)) * (fade_slope(r) - 3.0 * fade(r))


def rho(r):
    return np.exp(-(r - NEAR)) * fade(r)


def rho_slope(r):
    return np.exp(-(r - NEAR)) * (fade_slope(r) - fade(r))


def crystal_stress(a, f, turn):
    """Cauchy's stress of the lattice under f, and its tension per bond as a function of length."""
    n = np.arange(-3, 4)
    cells = np.array(np.meshgrid(n, n, n)).reshape(3, -1).T
    basis = np.array([[0, 0, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0]])
    x = a * (cells[:, None, :] + basis).reshape(-1, 3) @ turn.T @ f.T
    r = np.linalg.norm(x, axis=1)
    x, r = x[(r > 0.1) & (r < CUT)], r[(r > 0.1) & (r < CUT)]
    slope = -1.5 / np.sqrt(rho(r).sum())  # of F(rho) = -3 sqrt(rho)
    tension = phi_slope(r) + 2 * slope * rho_slope(r)
    volume = a**3 / 4 * np.linalg.det(f)
    return np.einsum("n,ni,nj->ij", 0.5 * tension / r, x, x) / volume, slope


def hats(points, h, n, force):
    """Sum of forces over the nodes of a grid of n^3 nodes."""
    out = np.zeros((n, n, n, 3))
    i = np.floor(points / h).astype(int)
    t = points / h - i
    for corner in np.ndindex(2, 2, 2):
        w = np.prod(np.where(np.array(corner) == 1, t, 1 - t), axis=1)
        for axis in range(3):
            at = np.ravel_multi_index((i + corner).T, (n, n, n))
            out[..., axis] += np.bincount(at, w * force[:, axis], n**3).reshape(n, n, n)
    return out


def run(name, a, cells, h, f, turn=np.eye(3), offset=0.0, at_pads=False, shrunk=1.0):
    """A box of `cells` cells of edge h on each side, its lower corner on a node plane but for `offset`; it is
    smaller before the strain where `shrunk` is below 1."""
    middle = np.full(3, (4 + offset + cells / 2) * h)
    low, high = middle - shrunk * cells * h / 2, middle + shrunk * cells * h / 2
    sigma, slope = crystal_stress(a, f, turn)
    reach = 1.1 * CUT
    m = int(np.ceil((np.linalg.norm(high - low) / 2 + 2 * reach) / a)) + 1
    n = np.arange(-m, m + 1)
    lattice = np.array(np.meshgrid(n, n, n)).reshape(3, -1).T
    basis = np.array([[0, 0, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0]]) + 0.25
    # planes of atoms lie a quarter of a constant inside
    start = low if np.allclose(turn, np.eye(3)) else middle
    x0 = (a * (lattice[:, None, :] + basis).reshape(-1, 3)) @ turn.T + start
    x0 = x0[((x0 > low - reach) & (x0 < high + reach)).all(1)]

    def to_now(p):
        return (p - middle) @ f.T + middle

    x = to_now(x0)
    pairs = cKDTree(x).query_pairs(CUT, output_type="ndarray")
    d = x[pairs[:, 1]] - x[pairs[:, 0]]
    r = np.linalg.norm(d, axis=1)
    tension = phi_slope(r) + 2 * slope * rho_slope(r)  # every atom has its whole surroundings
    pull = tension[:, None] * d / r[:, None]  # on the first of the two
    p, q = x0[pairs[:, 0]], x0[pairs[:, 1]]
    with np.errstate(divide="ignore", invalid="ignore"):
        one, two = (low - p) / (q - p), (high - p) / (q - p)
    first, last = np.minimum(one, two).max(1), np.maximum(one, two).min(1)
    inside = ((x0 > low) & (x0 < high)).all(1)
    pin, qin = inside[pairs[:, 0]], inside[pairs[:, 1]]
    cuts = (first < last) & (last > 0) & (first < 1)
    number = 9 + cells
    places, forces, of_pads = [], [], []
    for which, s, sign, pad in ((cuts & ~pin, first, 1, p), (cuts & ~qin, last, -1, q)):
        k = np.nonzero(which)[0]
        places.append(pad[k] if at_pads else p[k] + s[k, None] * (q[k] - p[k]))
        forces.append(sign * pull[k])
        of_pads.append((cuts & ~pin & ~qin)[k])
    places, forces, of_pads = map(np.concatenate, (places, forces, of_pads))
    mean = np.abs(sigma).max() * h * h

    def on_nodes(keep):
        return hats(to_now(places[keep]), h, number, forces[keep])

    base = continuum(low, high, h, number, sigma, f, to_now)
    left = base + on_nodes(np.ones(len(places), bool))
    without = base + on_nodes(~of_pads)
    grid = np.stack(np.meshgrid(*[np.arange(number) * h] * 3, indexing="ij"), -1)
    near = np.minimum(np.abs(grid - low), np.abs(grid - high)) < 0.999 * h
    within = ((grid > low - 1.01 * h) & (grid < high + 1.01 * h)).all(-1)
    worst = [np.abs(left[within & (near.sum(-1) == k)]).max(initial=0.0) / mean for k in (1, 2, 3)]
    total = np.abs(left.sum((0, 1, 2))).max() / mean
    torque = np.abs(np.cross(grid - middle, left).sum((0, 1, 2))).max() / (mean * cells * h)
    print(
        f"{name:42s} {len(places):7d} {worst[0]:9.1e} {worst[1]:9.1e} {worst[2]:9.1e}"
        f" {total:9.1e} {torque:9.1e} {np.abs(without[within]).max() / mean:9.1e}",
        flush=True,
    )


def continuum(low, high, h, number, sigma, f, to_now):
    """What nodes take of the stress outside the box: sigma n N over its faces, by midpoints."""
    out = np.zeros((number, number, number, 3))
    fine = 96 * round((high[0] - low[0]) / h)
    t = (np.arange(fine) + 0.5) / fine
    u, v = np.meshgrid(t, t)
    cofactor = np.linalg.det(f) * np.linalg.inv(f).T
    for axis in range(3):
        for side in (0, 1):
            at = np.empty((fine * fine, 3))
            at[:, axis] = side
            at[:, (axis + 1) % 3], at[:, (axis + 2) % 3] = u.ravel(), v.ravel()
            area = (2 * side - 1) * cofactor[:, axis] * ((high[0] - low[0]) / fine) ** 2
            out += hats(to_now(low + at * (high - low)), h, number, np.tile(sigma @ area, (len(at), 1)))
    return out


def main():
    a = 3.604407
    one = np.eye(3)
    strains = 0.01 * np.array([[1, 0.3, -0.4], [0.3, -0.6, 0.5], [-0.4, 0.5, 0.8]])
    c, s = np.cos(np.radians(20)), np.sin(np.radians(20))
    turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    c, s = np.cos(np.radians(30)), np.sin(np.radians(30))
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    print(" " * 41 + "crossings    faces     edges   corners       sum    torque  no pads")
    run("stretched by 1 % to fit cells of 4", a, 4, 4.04 * a, 1.01 * one, shrunk=1 / 1.01)
    run("cells of 4, six strains", a, 4, 4 * a, one + strains)
    run("cells of 2, six strains", a, 4, 2 * a, one + strains)
    run("cells of 3.5, box of 14, six strains", a, 4, 3.5 * a, one + strains)
    run("cells of 3.7: no whole box, six strains", a, 4, 3.7 * a, one + strains)
    run("cells of 4, box .3 cells off the nodes", a, 4, 4 * a, one + strains, offset=0.3)
    run("lattice turned by 20 degrees", a, 4, 4 * a, one + strains, turned)
    run("all turned by 30 degrees", a, 4, 4 * a, turn @ (one + strains))
    run("control: reactions at the pads", a, 4, 4 * a, one + strains, at_pads=True)


if __name__ == "__main__":
    main()
