#!/usr/bin/env python3
"""An elastic sphere hits a rigid frictionless plane, which is half of two equal spheres head on: axisymmetric
finite elements, explicit. Nothing of gimp3d is in it.

usage: sphere.py [ELEMENTS...]    on so many elements along an eighth of the circle (6 12 24): writes
sphere.csv

Bilinear quadrilaterals, 2 x 2 Gauss points, total Lagrangian, first Piola-Kirchhoff stress of the neo-Hookean
solid U = mu/2 (tr(F^T F) J^(-2/3) - 3) + K/2 (J - 1)^2, lumped mass, central differences. A node that would
pass the plane ends on it (its impulse is the contact force); none is held back. R = density = Young's modulus
= 1, so that speeds are in sqrt(E/density)."""

import csv
import math
import sys
from pathlib import Path

import numpy as np

YOUNG, POISSON, DENSITY = 1.0, 0.3, 1.0
SPEEDS = (0.005, 0.01, 0.02)  # of the sphere: half of the closing speed of two
SHEAR, BULK = YOUNG / (2 * (1 + POISSON)), YOUNG / (3 * (1 - 2 * POISSON))


def graded(count, last):
    """0 .. 1 in `count` parts in geometric progression, the last `last` times as long as the first."""
    parts = last ** (np.arange(count) / (count - 1))
    return np.concatenate([[0], np.cumsum(parts)]) / parts.sum()


def mesh(count):
    """Nodes (n, 2: r and z, the plane is z = 0), quadrilaterals (m, 4), nodes of the side that may touch: a
    half square in the middle, and between each of its sides and the circle a part of its own. Elements are
    smallest where the pole touches."""
    half, grade = 0.5, 4.0
    across, along, out = (
        graded(count, grade),
        -1 + 2 * graded(2 * count, grade),
        1 - graded(count, grade)[::-1],
    )
    sides = [  # from the axis round to the axis: points of the square, and of the circle
        (np.stack([half * across, np.full(count + 1, -half)], axis=1), across),
        (np.stack([np.full(2 * count + 1, half), half * along], axis=1), along),
        (np.stack([half * across, np.full(count + 1, half)], axis=1)[::-1], across[::-1]),
    ]
    parts = [np.stack(np.broadcast_arrays(half * across[None, :], half * along[:, None]), axis=-1)]
    for number, (inner, share) in enumerate(sides):
        angle = math.pi / 4 * (share if number != 2 else -share) + (-math.pi / 2, 0, math.pi / 2)[number]
        circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        parts.append((inner + out[:, None, None] * (circle - inner))[::-1])
    points = np.concatenate([part.reshape(-1, 2) for part in parts])
    _, first, number = np.unique(points.round(9) + 0.0, axis=0, return_index=True, return_inverse=True)
    quads, begin, rim = [], 0, None
    for part in parts:
        at = number.ravel()[begin : begin + part.shape[0] * part.shape[1]].reshape(part.shape[:2])
        begin += at.size
        quads.append(np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4))
        if len(quads) == 2:
            rim = at[0]
    return points[first] + (0, 1), np.concatenate(quads), rim


def strike(count, speed):
    """Time, force of the plane, energy (kinetic and strain) of each step; speed of the centre of mass at the
    end over the first."""
    nodes, quads, side = mesh(count)
    corner = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    points = corner / math.sqrt(3)
    # (point, node)
    shapes = np.stack([(1 + corner[:, 0] * p[0]) * (1 + corner[:, 1] * p[1]) / 4 for p in points])
    slopes = np.stack(
        [
            np.stack(
                [corner[:, 0] * (1 + corner[:, 1] * p[1]), corner[:, 1] * (1 + corner[:, 0] * p[0])], axis=1
            )
            / 4
            # (point, node, 2)
            for p in points
        ]
    )
    # (m, node, 2)
    place = nodes[quads]
    jacobian = np.einsum("mni,gnj->mgij", place, slopes)
    # d shape/d X_i
    gradient = np.einsum("gnj,mgji->mgni", slopes, np.linalg.inv(jacobian))
    radius = np.einsum("gn,mn->mg", shapes, place[:, :, 0])
    weight = 2 * math.pi * radius * np.linalg.det(jacobian)
    assert (weight > 0).all()
    mass = np.bincount(
        quads.ravel(), np.einsum("mg,gn->mn", DENSITY * weight, shapes).ravel(), nodes.shape[0]
    )
    # (m, g, node)
    hoop = shapes[None] / radius[..., None]
    # the step: 0.4 of the time of a wave across an element's least height
    spans = weight.sum(axis=1) / (2 * math.pi * radius.mean(axis=1))
    diagonals = np.maximum(
        np.linalg.norm(place[:, 0] - place[:, 2], axis=1), np.linalg.norm(place[:, 1] - place[:, 3], axis=1)
    )
    wave = math.sqrt((BULK + 4 * SHEAR / 3) / DENSITY)
    step = 0.4 * (spans / diagonals).min() / wave
    moved, velocity = np.zeros_like(nodes), np.zeros_like(nodes)
    velocity[:, 1] = -speed
    on_axis = nodes[:, 0] < 1e-12
    times, forces, energies = [], [], []
    time = 0.0
    while True:
        local = moved[quads]
        f = np.einsum("mni,mgnj->mgij", local, gradient)  # grad u
        f[..., 0, 0] += 1
        f[..., 1, 1] += 1
        around = 1 + np.einsum("mgn,mn->mg", hoop, local[:, :, 0])
        flat = f[..., 0, 0] * f[..., 1, 1] - f[..., 0, 1] * f[..., 1, 0]
        volume = flat * around
        squares = (f**2).sum(axis=(2, 3)) + around**2
        # F^-T in the plane
        turned = np.empty_like(f)
        turned[..., 0, 0], turned[..., 1, 1] = f[..., 1, 1] / flat, f[..., 0, 0] / flat
        turned[..., 0, 1], turned[..., 1, 0] = -f[..., 1, 0] / flat, -f[..., 0, 1] / flat
        factor = SHEAR * volume ** (-2 / 3)
        pressure = BULK * (volume - 1) * volume
        stress = (
            factor[..., None, None] * (f - squares[..., None, None] / 3 * turned)
            + pressure[..., None, None] * turned
        )
        stress_around = factor * (around - squares / (3 * around)) + pressure / around
        inner = np.einsum("mg,mgij,mgnj->mni", weight, stress, gradient, optimize=True)
        inner[:, :, 0] += np.einsum("mg,mgn->mn", weight * stress_around, hoop)
        force = np.stack(
            [np.bincount(quads.ravel(), inner[:, :, i].ravel(), nodes.shape[0]) for i in (0, 1)], axis=1
        )
        strain = (
            weight * (SHEAR / 2 * (squares * volume ** (-2 / 3) - 3) + BULK / 2 * (volume - 1) ** 2)
        ).sum()
        before = velocity.copy()
        velocity -= step * force / mass[:, None]
        velocity[on_axis, 0] = 0
        least = -(nodes[side, 1] + moved[side, 1]) / step
        push = np.maximum(least - velocity[side, 1], 0)
        velocity[side, 1] += push
        forces.append((mass[side] * push).sum() / step)
        energies.append((mass[:, None] * (0.5 * (before + velocity)) ** 2).sum() / 2 + strain)
        times.append(time)
        moved += step * velocity
        time += step
        upward = (mass * velocity[:, 1]).sum() / mass.sum()
        if upward > 0 and max(forces) > 0 and not any(forces[-int(0.3 / step) :]):
            return np.array(times), np.array(forces), np.array(energies), upward / speed


def figures(time, force):
    """Peak force (the largest of a polynomial of degree 4 through what is above 0.7 of the largest) and
    duration (between 1 % and 99 % of the impulse): the same are taken of the particles."""
    high = force > 0.7 * np.sort(force)[-max(5, force.size // 200)]
    high &= (time > time[high].min()) & (time < time[high].max())
    middle, span = time[high].mean(), np.ptp(time[high])
    peak = np.polyval(
        np.polyfit((time[high] - middle) / span, force[high], 4), np.linspace(-0.5, 0.5, 201)
    ).max()
    given = np.cumsum(force * np.gradient(time))
    ends = np.interp([0.01, 0.99], given / given[-1], time)
    return peak, ends[1] - ends[0]


def hertz(speed):
    """Peak force and duration of the whole contact by Hertz's quasi-static half-spaces: two spheres that
    close at twice the speed."""
    stiffness, mass = YOUNG / (2 * (1 - POISSON**2)), DENSITY * 4 / 3 * math.pi
    approach = (15 / 16 * mass / 2 * (2 * speed) ** 2 / (stiffness * math.sqrt(0.5))) ** 0.4
    return 4 / 3 * stiffness * math.sqrt(0.5) * approach**1.5, 2.9432 * approach / (2 * speed)


def main():
    rows = []
    for count in map(int, sys.argv[1:] or (6, 12, 24)):
        for speed in SPEEDS:
            time, force, energy, restitution = strike(count, speed)
            peak, duration = figures(time, force)
            rows.append(
                {
                    "elements": count,
                    "speed": speed,
                    "peak_force": peak,
                    "duration": duration,
                    "restitution": restitution,
                }
            )
            print(
                f"{count:4d} elements, speed {speed}: peak force {peak:.6f} ({peak / hertz(speed)[0]:.4f} of "
                "Hertz), duration "
                f"{duration:.4f} ({duration / hertz(speed)[1]:.4f} of Hertz's whole), restitution "
                f"{restitution:.5f}, energy "
                f"{energy[-1] / energy[0]:.5f}, highest {energy.max() / energy[0]:.5f}, {time.size} steps",
                flush=True,
            )
    with open(Path(__file__).with_suffix(".csv"), "w", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows([{key: f"{value:.6g}" for key, value in row.items()} for row in rows])


if __name__ == "__main__":
    main()
