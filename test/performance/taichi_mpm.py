#!/usr/bin/env python3
"""A bare MLS-MPM step (Hu et al. 2018) in taichi: what a kernel without contact, levels, output or guard
takes on one core.

usage: taichi_mpm.py CELLS STEPS [atomic]

A neo-Hookean cube of CELLS cells an edge, 8 particles a cell in the order of the lattice, moves and turns in
free flight: quadratic B-splines, affine transfer, double precision, the law of gimp3d's neo_hookean. With
`atomic` sums on nodes are as they must be to run on several cores; without, as one core may make them. Prints
nanoseconds an update, without compiling and without the first tenth of the steps; and how far momentum is
off."""

import sys
import time

import numpy as np
import taichi as ti

cells, steps, atomic = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:] == ["atomic"]
ti.init(arch=ti.cpu, default_fp=ti.f64, cpu_max_num_threads=1, fast_math=True, log_level=ti.ERROR)
margin = 8
size = cells + 2 * margin
count = 8 * cells**3
h, dt = 64e-9, 3.19e-12  # m, s
density, young, poisson = 2710.0, 70e9, 0.33
mu, lame = young / (2 * (1 + poisson)), young * poisson / ((1 + poisson) * (1 - 2 * poisson))
volume = h**3 / 8
mass = density * volume
position, velocity = ti.Vector.field(3, float, count), ti.Vector.field(3, float, count)
affine, deformation = ti.Matrix.field(3, 3, float, count), ti.Matrix.field(3, 3, float, count)
grid = ti.Vector.field(4, float, (size, size, size))  # momentum, mass

axis = (np.arange(2 * cells) + 0.5) * h / 2 + margin * h
places = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
spin = 4e8 * 32 / cells * np.array([0.5, 0.25, 1.0])
position.from_numpy(places)
velocity.from_numpy(np.array([100.0, 50.0, 20.0]) + np.cross(spin, places - places.mean(0)))
turn = np.array([[0, -spin[2], spin[1]], [spin[2], 0, -spin[0]], [-spin[1], spin[0], 0]])
affine.from_numpy(np.broadcast_to(turn, (count, 3, 3)).copy())
deformation.from_numpy(np.broadcast_to(np.eye(3), (count, 3, 3)).copy())


@ti.kernel
def step():
    for node in ti.grouped(grid):
        grid[node] = ti.Vector([0.0, 0.0, 0.0, 0.0])
    ti.loop_config(serialize=not atomic)
    for p in range(count):
        base = int(position[p] / h - 0.5)
        x = position[p] / h - base
        w = [0.5 * (1.5 - x) ** 2, 0.75 - (x - 1) ** 2, 0.5 * (x - 0.5) ** 2]
        f = (ti.Matrix.identity(float, 3) + dt * affine[p]) @ deformation[p]
        deformation[p] = f
        j = f.determinant()
        kirchhoff = mu * (f @ f.transpose()) + ti.Matrix.identity(float, 3) * (lame * ti.log(j) - mu)
        q = mass * affine[p] - (dt * volume * 4 / h**2) * kirchhoff
        for i, k, l in ti.static(ti.ndrange(3, 3, 3)):
            way = (ti.Vector([i, k, l]) - x) * h
            weight = w[i][0] * w[k][1] * w[l][2]
            momentum = weight * (mass * velocity[p] + q @ way)
            node = base + ti.Vector([i, k, l])
            given = ti.Vector([momentum[0], momentum[1], momentum[2], weight * mass])
            if ti.static(atomic):
                grid[node] += given
            else:
                grid[node] = grid[node] + given
    for node in ti.grouped(grid):
        m = grid[node][3]
        if m > 0:
            grid[node] /= m
    ti.loop_config(serialize=True)
    for p in range(count):
        base = int(position[p] / h - 0.5)
        x = position[p] / h - base
        w = [0.5 * (1.5 - x) ** 2, 0.75 - (x - 1) ** 2, 0.5 * (x - 0.5) ** 2]
        new, slope = ti.Vector.zero(float, 3), ti.Matrix.zero(float, 3, 3)
        for i, k, l in ti.static(ti.ndrange(3, 3, 3)):
            way = (ti.Vector([i, k, l]) - x) * h
            weight = w[i][0] * w[k][1] * w[l][2]
            node = grid[base + ti.Vector([i, k, l])]
            there = ti.Vector([node[0], node[1], node[2]])
            new += weight * there
            slope += (4 * weight / h**2) * there.outer_product(way)
        velocity[p] = new
        affine[p] = slope
        position[p] += dt * new


before = velocity.to_numpy().sum(0)
for _ in range(max(1, steps // 10)):
    step()
ti.sync()
start = time.perf_counter()
for _ in range(steps):
    step()
ti.sync()
seconds = time.perf_counter() - start
off = np.abs(velocity.to_numpy().sum(0) - before).max() / np.abs(before).max()
print(f"{1e9 * seconds / (steps * count):.1f} ns an update, momentum off by {off:.1e}")
