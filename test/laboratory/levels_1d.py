#!/usr/bin/env python3
"""Grid levels in one dimension: ways to couple them, tried on an elastic GIMP bar (doc/developer/theory.md,
Levels). Needs numpy.

pulse    a velocity pulse crosses from the coarse level into the fine one
ring     a free bar rings, the fine level over its middle third: is its energy bounded? STEPS coarse steps, 10
000 if not given
move     bars that ring while they travel: through the fine level, and out of it with a free end; particles
split and merge
levels3  ring and move with three levels
order    how fast displacements of the ringing bar converge to the exact ones
modes    the fastest growth of any motion of a bar of 16 cells, fine over six of them, in steps of frozen
weights (eigenvalues)
still    a bar under uniform stress at rest: what moves far from its ends after 50 steps

Level l has the cell 1/2^l and takes 2^l steps while level 0 takes one. Coupling:

coarse, fine   one level: the two bounds
thesis         coarse particles everywhere; those in the fine region and in a fringe of two coarse cells
               around it have two children each. In the fringe, children are made anew from their parents
               before a coarse step; in the region, parents take their children's mean after it
register       thesis, with the momentum that passes the edge counted on both levels and the difference given
to the coarse particles there
composite      a particle lives once; fine nodes at the edge follow the coarse ones and hand them what they
               get. Velocities stand in the middle of their steps (eq. time-levels) where flip is 1
uneven         composite, the velocity gradients of affine transfer are those that particles moved with (eq.
lag left out)
unlabelled     composite, all velocities as if they stood at one time; the same where flip is not 1
lasting        composite, what stress has grown by counts from the start, not from when a particle comes to
the edge
lockstep       composite, one time step for all levels
centre         composite, a particle lives where its centre is instead of where its domain reaches

E = rho = c = coarse cell = 1, two particles a cell. "affine" is the transfer (0: plain), "flip" the share of
FLIP in the velocity."""

import argparse

import numpy as np

ORIGIN = -4.0
FIELDS = [(name, float) for name in ("x", "half", "v", "m", "V", "stress", "grown", "L")] + [
    ("family", np.int64)
]


def bar(start, length, h):
    """Particles of a bar at rest. family: halves of p are 2p and 2p + 1."""
    p = np.zeros(round(2 * length / h), FIELDS)
    p["x"] = start + h / 2 * np.arange(p.size) + h / 4
    p["half"], p["m"], p["V"], p["family"] = h / 4, h / 2, h / 2, 2**20 + np.arange(p.size)
    return p


def halves(p):
    """Every particle in two, side by side."""
    kids, side = np.repeat(p, 2), np.tile([-0.5, 0.5], p.size)
    kids["x"] += side * kids["half"]
    kids["v"] += side * kids["half"] * kids["L"]
    kids["family"] = 2 * kids["family"] + (side > 0)
    for name in ("half", "m", "V"):
        kids[name] /= 2
    return kids


def united(a, b):
    """Pairs of halves in one."""
    p = a.copy()
    for name in ("half", "m", "V"):
        p[name] = a[name] + b[name]
    for name, weight in (("x", "m"), ("v", "m"), ("stress", "V"), ("grown", "V"), ("L", "V")):
        p[name] = (a[weight] * a[name] + b[weight] * b[name]) / p[weight]
    p["family"] //= 2
    return p


def start(p, v, wave):
    """wave: 0 no stress, 1 that of a wave to the right."""
    p["v"] = v(p["x"])
    p["stress"] = -wave * p["v"]


def energy(p, speed=0.0):
    return (0.5 * p["m"] * (p["v"] - speed) ** 2 + p["half"] * p["stress"] ** 2).sum()


def over(q, m):
    return np.divide(q, m, out=np.zeros(m.size), where=m > 0)


class Grid:
    """The nodes of one level and its transfers."""

    def __init__(self, h, cells):
        self.h, self.n = h, round(cells / h) + 1
        self.x = ORIGIN + h * np.arange(self.n)

    def to_nodes(self, p, affine):
        """Mass, momentum and force of the nodes; keeps the weights."""
        h, l = self.h, p["half"][:, None]
        first = np.floor((p["x"] - ORIGIN) / h - 0.5).astype(int)
        self.nodes = first[:, None] + np.arange(3)
        d = p["x"][:, None] - self.x[self.nodes]
        a, t = np.abs(d), np.maximum(0, h + l - np.abs(d))
        near, far = a < l, a > h - l
        self.S = np.where(near, 1 - (d**2 + l**2) / (2 * h * l), np.where(far, t**2 / (4 * h * l), 1 - a / h))
        self.G = np.where(near, -d / (h * l), -np.sign(d) * np.where(far, t / (2 * h * l), 1 / h))
        m = self.S * p["m"][:, None]
        q = m * (p["v"][:, None] - affine * p["L"][:, None] * d)
        return np.array([self.sum(m), self.sum(q), self.force(p, "stress")])

    def force(self, p, stress):
        return self.sum(-self.G * (p[stress] * p["V"])[:, None])

    def sum(self, z):
        return np.bincount(self.nodes.ravel(), z.ravel(), self.n).astype(float)

    def to_particles(self, p, v, a, dt, flip):
        v_grid, p["L"] = (self.S * v[self.nodes]).sum(1), (self.G * v[self.nodes]).sum(1)
        p["x"] += dt * v_grid
        p["v"] = flip * (p["v"] + dt * (self.S * a[self.nodes]).sum(1)) + (1 - flip) * v_grid
        p["stress"] += dt * p["L"]
        p["V"] *= 1 + dt * p["L"]

    def solve(self, p, dt, affine):
        """Nodes of particles that see no other level: mass, velocity at the end of the step, acceleration."""
        m, q, f = self.to_nodes(p, affine)
        return m, over(q, m) + dt * over(f, m), over(f, m)


class Level(Grid):
    def __init__(self, h, cells, region, finer):
        super().__init__(h, cells)
        self.lower, self.upper = region
        self.inner = self.inside(*region)  # the others are slaves
        self.covered = self.inside(*finer)  # no unknowns
        k = np.arange(self.n)
        self.left, self.right = k // 2, (k + 1) // 2  # coarse nodes of a slave, 1/2 each

    def inside(self, lower, upper):
        return (self.x > lower + 1e-9) & (self.x < upper - 1e-9)

    def overlaps(self, x, reach):
        return (x + reach > self.lower) & (x - reach < self.upper)

    def hand_up(self, z, change=0):
        """What slaves have to the coarse nodes; change: from a slave to the next node."""
        n = (self.n + 1) // 2
        low, high = np.where(self.inner, 0, z - change), np.where(self.inner, 0, z + change)
        return 0.5 * (np.bincount(self.left, low, n) + np.bincount(self.right, high, n))

    def change_of_momentum(self, m, q):
        """Of a slave's mass from it to the next node, by the mean slope on both sides (eq. affine-edge)."""
        step = np.where(
            np.minimum(m[1:], m[:-1]) > 1e-9 * np.maximum(m[1:], m[:-1]), np.diff(over(q, m)), np.nan
        )
        sides = np.array([np.append(np.nan, step), np.append(step, np.nan)])
        found = (~np.isnan(sides)).sum(0)
        return np.where(self.left < self.right, m * np.nansum(sides, 0) / np.maximum(found, 1), 0)

    def interpolate(self, coarse):
        return 0.5 * (coarse[self.left] + coarse[self.right])


class Composite:
    """Any number of levels (one: the uniform grid), each region inside the last."""

    def __init__(
        self,
        p,
        cells,
        regions,
        affine,
        flip,
        h=1.0,
        labels=True,
        lasting=False,
        lockstep=False,
        reach=1,
        even=True,
    ):
        ends = [(-np.inf, np.inf)] + regions + [(np.inf, -np.inf)]
        self.levels = [Level(h / 2**l, cells, *ends[l : l + 2]) for l in range(len(regions) + 1)]
        self.affine, self.flip, self.lockstep, self.reach = affine, flip, lockstep, reach
        self.lasting, self.labels = lasting, labels and flip == 1 and not lockstep
        self.even = even and affine and self.labels
        self.splits, self.merges, self.lost = 0, 0, 0.0
        for level in self.levels:
            level.p = p[:0]
        self.levels[0].p = p
        for l in range(len(regions)):
            self.change_levels(l)

    def particles(self):
        return np.concatenate([level.p for level in self.levels])

    def start(self, v, wave=0):
        for level in self.levels:
            start(level.p, v, wave)

    def step(self, dt):
        self.gather(0, dt)
        self.advance(0, dt, 0.0, 0.0, 0.0)

    def gather(self, l, dt):
        """Particle-to-node pass of level l and all finer ones, the finest first. What the slaves of l hand
        up: mass, momentum, force, and the force of what stress has grown by since particles came to the
        edge."""
        level, up, level.up_grown = self.levels[l], np.zeros(3)[:, None], 0.0
        if l + 1 < len(self.levels):
            *up, grown = self.gather(l + 1, dt / 2)
            level.up_grown = grown
            if self.labels:
                up[1] -= 0.5 * (dt / 2) * grown  # so much finer particles are ahead
        # apart: these sums stay while finer ones change
        level.own = level.to_nodes(level.p, self.affine)
        level.own[:, level.covered] *= 1 - self.reach  # rounding, if anything
        level.total = m, q, f = level.own + up
        if l == 0:
            return None
        change = level.change_of_momentum(m, q) if self.affine else 0
        return np.array(
            [
                level.hand_up(m),
                level.hand_up(q, change),
                level.hand_up(f),
                level.hand_up(level.force(level.p, "grown")),
            ]
        )

    def advance(self, l, dt, slave_v, slave_a, slave_lead):
        """One step of level l with all finer ones; slave_v at the end of the step; slave_lead: eq. lag."""
        level, beta, finer = self.levels[l], 1 - self.flip, l + 1 < len(self.levels)
        m, q, f = level.total
        a = np.where(level.inner, over(f, m), slave_a)
        v = np.where(level.inner, over(q, m) + dt * a, slave_v)
        lead = np.where(level.inner, 0.0, slave_lead)
        if finer and self.lockstep:
            fine = self.levels[l + 1]
            self.advance(l + 1, dt, fine.interpolate(v), fine.interpolate(a), 0.0)
        elif finer:
            fine, k = self.levels[l + 1], dt / 2
            ahead = 0.5 * k if self.labels else 0.0  # fine velocities stand so much later
            half = v - k * a  # eq. half-steps, the first
            force, grown = f - level.own[2], level.up_grown  # of the finer level
            self.advance(
                l + 1,
                k,
                fine.interpolate(half + ahead * a),
                fine.interpolate(a),
                fine.interpolate(ahead * (over(grown, m) - a)),
            )
            m_up, q_up, f_up, _ = self.gather(l + 1, k)
            m2 = level.own[0] + m_up
            q2 = level.own[0] * half + q_up
            w = np.where(m > 0.5 * m2, half, over(q2, m2))  # hardly reached before
            a2 = over(level.own[2] + f_up + beta * (q2 - m2 * w) / k, m2)
            a2 = np.where(level.inner, a2, a)
            v = np.where(level.inner, w + k * a2 - ahead * (a2 - a), v)  # the second
            # as it will be when the next step begins
            latest = over(grown + 2 * (f_up - force), m2)
            self.advance(
                l + 1,
                k,
                fine.interpolate(v + ahead * a2),
                fine.interpolate(a2),
                fine.interpolate(ahead * (latest - a2)),
            )
            lead = np.where(level.inner, ahead * over(grown + f_up - force, m2), lead)
            a = 0.5 * (a + a2)
        level.to_particles(level.p, v, a, dt, self.flip)
        counts = self.lasting | ~level.inner[level.nodes].all(1)
        level.p["grown"] = np.where(counts, level.p["grown"] + dt * level.p["L"], 0)
        if self.even:
            level.p["L"] += (level.G * lead[level.nodes]).sum(1)
        if finer:
            self.change_levels(l)

    def change_levels(self, l):
        """Particles go to the level that they belong to, out of the finer one half a fine cell late; big ones
        split, halves that have both left, and are half a coarse cell away, unite."""
        coarse, fine = self.levels[l : l + 2]
        p, late = (
            np.concatenate([coarse.p, fine.p]),
            np.repeat([0.0, 0.5 * fine.h * self.reach], [coarse.p.size, fine.p.size]),
        )
        big = (p["half"] > 0.3 * fine.h) & (p["x"] > fine.lower) & (p["x"] < fine.upper)
        if big.any():
            p, late = (
                np.concatenate([p[~big], halves(p[big])]),
                np.concatenate([late[~big], np.repeat(late[big], 2)]),
            )
            self.splits += big.sum()
        here = fine.overlaps(p["x"], self.reach * p["half"] + late)
        fine.p, p = p[here], p[~here]
        small = np.where(p["half"] < 0.2 * coarse.h)[0]
        small = small[np.argsort(p["family"][small])]
        pair = np.where(np.diff(p["family"][small] // 2) == 0)[0]
        a, b = small[pair], small[pair + 1]
        far = ~fine.overlaps(0.5 * (p["x"][a] + p["x"][b]), p["half"][a] + p["half"][b] + 0.5 * coarse.h)
        a, b = a[far], b[far]
        if a.size:
            new = united(p[a], p[b])
            self.lost += energy(p[a]) + energy(p[b]) - energy(new)
            self.merges += a.size
            p = np.concatenate([np.delete(p, np.concatenate([a, b])), new])
        coarse.p = p


class Thesis:
    """Copy and average. `register`: with the momentum register."""

    def __init__(self, p, cells, lower, upper, affine, flip, register):
        self.c, self.register, self.affine, self.flip = p, register, affine, flip
        self.coarse, self.fine = Grid(1.0, cells), Grid(0.5, cells)
        self.covered = (p["x"] > lower) & (p["x"] < upper)
        self.parents = (p["x"] > lower - 2) & (p["x"] < upper + 2)
        self.fringe = np.repeat(~self.covered[self.parents], 2)
        self.middle = 0.5 * (lower + upper)
        self.f = halves(p[self.parents])
        self.splits = self.merges = 0
        self.lost = 0.0

    def particles(self):
        return np.concatenate([self.c[~self.covered], self.f[~self.fringe]])

    def start(self, v, wave=0):
        start(self.c, v, wave)
        start(self.f, v, wave)

    def crossing(self, p, own, grid, m, dt):
        """Momentum that the covered side gets (left and right edge), and each other particle's share of the
        edge."""
        share = over(grid.sum(grid.S * (p["m"] * own)[:, None]), m)
        gain, left = -dt * p["V"] * p["stress"] * (grid.G * share[grid.nodes]).sum(1), p["x"] < self.middle
        return np.array([gain[left].sum(), gain[~left].sum()]), (grid.S * share[grid.nodes]).sum(1) * ~own

    def step(self, dt):
        c, f = self.c, self.f
        f[self.fringe] = halves(c[self.parents])[self.fringe]
        m, v, a = self.coarse.solve(c, dt, self.affine)
        missing, edge = self.crossing(c, self.covered, self.coarse, m, dt)
        self.coarse.to_particles(c, v, a, dt, self.flip)
        for _ in range(2):
            m, v, a = self.fine.solve(f, dt / 2, self.affine)
            missing -= self.crossing(f, ~self.fringe, self.fine, m, dt / 2)[0]
            self.fine.to_particles(f, v, a, dt / 2, self.flip)
        if self.register:
            for side, here in enumerate((c["x"] < self.middle, c["x"] >= self.middle)):
                c["v"] += missing[side] * edge * here / (c["m"] * edge * here).sum()
        kids = f[~self.fringe]
        mean = united(kids[0::2], kids[1::2])
        mean["half"] = c["half"][self.covered]
        c[self.covered] = mean


def build(scheme, p, cells, regions, affine, flip):
    if scheme in ("composite", "uneven", "unlabelled", "lasting", "lockstep", "centre"):
        return Composite(
            p,
            cells,
            regions,
            affine,
            flip,
            labels=scheme != "unlabelled",
            lasting=scheme == "lasting",
            lockstep=scheme == "lockstep",
            reach=int(scheme != "centre"),
            even=scheme != "uneven",
        )
    if scheme == "coarse":
        return Composite(p, cells, [], affine, flip)
    if scheme == "fine":
        return Composite(halves(p), cells, [], affine, flip, 0.5)
    return Thesis(p, cells, *regions[0], affine, flip, scheme == "register")


def watch(sim, steps, dt, speed=0.0, marks=(1, 10, 50, 100)):
    """Run. Energy over the first one at shares of the run and the most met; the momentum's drift over sum |m
    v|; mass."""
    p = sim.particles()
    e0, q0, m0, size = energy(p, speed), (p["m"] * p["v"]).sum(), p["m"].sum(), np.abs(p["m"] * p["v"]).sum()
    seen, most, drift = [], 0.0, 0.0
    for k in range(1, steps + 1):
        sim.step(dt)
        p = sim.particles()
        e, drift = energy(p, speed) / e0, max(drift, abs((p["m"] * p["v"]).sum() - q0) / size)
        if not e < 1e3:
            return f"over 1000 after {k} steps"
        most = max(most, e)
        if k in [steps * share // 100 for share in marks]:
            seen.append(f"{e:.3f}")
    moved = f"  splits {sim.splits} merges {sim.merges} (energy {sim.lost / e0:.0e})" if sim.merges else ""
    mass = abs(p["m"].sum() / m0 - 1)
    return f"{' '.join(seen)}  most {most:.3f}  momentum {drift:.0e}  mass {mass:.0e}{moved}"


def pulse():
    print(
        "pulse of width w from the coarse side (x < 100) into the fine one; after 90 time units, over its "
        "first height:"
    )
    for width in (3, 6, 12):
        for affine in (0, 1):
            for scheme in ("coarse", "fine", "thesis", "register", "composite", "unlabelled"):
                sim = build(scheme, bar(0, 240, 1.0), 248, [(100, 200)], affine, 1.0)
                sim.start(lambda x: 1e-3 * np.exp(-(((x - 60) / width) ** 2)), wave=1)
                steps = 450 if scheme == "fine" else 225
                what = watch(sim, steps, 90 / steps, marks=(100,))
                p = sim.particles()
                v = abs(p["v"]) / 1e-3
                print(
                    f"  w {width:2}  affine {affine}  {scheme:10}  height {v[p['x'] > 100].max():.3f}  "
                    f"left behind {v[(p['x'] > 5) & (p['x'] < 85)].max():.4f}  energy {what}",
                    flush=True,
                )


def ring(
    steps,
    regions=((20, 40),),
    schemes=("coarse", "thesis", "register", "composite", "uneven", "unlabelled", "lasting", "centre"),
):
    print(
        f"free bar of 60 cells, first mode, finer over {regions}; energy over the first one at 1, 10, 50, "
        f"100 % of {steps}:"
    )
    for safety in (0.25, 0.4, 0.5):
        for affine, flip in ((0, 1.0), (1, 1.0), (1, 0.99), (1, 0.95)):
            for scheme in [
                x for x in schemes if flip == 1 or x not in ("uneven", "unlabelled", "lasting", "centre")
            ]:
                sim = build(scheme, bar(0, 60, 1.0), 68, list(regions), affine, flip)
                sim.start(lambda x: 1e-3 * np.cos(np.pi * x / 60))
                print(
                    f"  safety {safety:4}  affine {affine}  flip {flip:4}  {scheme:10}  "
                    f"{watch(sim, steps, safety)}",
                    flush=True,
                )


def move(regions=((20, 40),), schemes=("coarse", "composite", "uneven", "unlabelled", "lasting")):
    print(
        f"bars that ring and travel, finer over {regions}; energy about the travelling, over the first one, "
        "at 10, 50, 100 %:"
    )
    for left, length, speed, time in ((0, 60, 0.01, 800), (0, 60, 0.1, 500), (24, 10, 0.5, 100)):
        for safety in (0.25, 0.4, 0.5):
            for affine, flip in ((0, 1.0), (1, 1.0), (1, 0.95)):
                for scheme in schemes[: 2 if flip < 1 else None]:
                    sim = build(scheme, bar(left, length, 1.0), 200, list(regions), affine, flip)
                    sim.start(lambda x: speed + 1e-3 * np.cos(np.pi * (x - left) / length))
                    dt = safety / (1 + speed)
                    print(
                        f"  {length} cells  speed {speed:4}  safety {safety:4}  affine {affine}  flip "
                        f"{flip:4}  {scheme:10}  {watch(sim, round(time / dt), dt, speed, (10, 50, 100))}",
                        flush=True,
                    )


def levels3(steps):
    regions = ((15, 45), (22.5, 37.5))
    ring(steps, regions, ("coarse", "composite"))
    move(regions, ("coarse", "composite"))


def order():
    print(
        "free bar of N cells, first mode, finer over its middle third, at 0.8 N: L2 error of displacements "
        "over the largest one,"
    )
    print("largest errors of particle velocity and stress over the exact stress at the edge (rho c = 1):")
    for affine in (0, 1):
        for scheme in ("coarse", "fine", "composite", "uneven", "unlabelled", "lasting", "lockstep"):
            for safety in (0.2, 0.4):
                e = np.array([mode_errors(scheme, N, safety, affine) for N in (24, 48, 96)]).T
                slope = np.polyfit(np.log([24, 48, 96]), -np.log(e[0]), 1)[0]
                print(
                    f"  affine {affine}  {scheme:10}  safety {safety}  {' '.join(f'{x:.2e}' for x in e[0])}  "
                    f"order {slope:.2f}  "
                    f"v {' '.join(f'{x:.3f}' for x in e[1])}  stress {' '.join(f'{x:.3f}' for x in e[2])}",
                    flush=True,
                )


def mode_errors(scheme, N, safety, affine):
    sim = build(scheme, bar(0, N, 1.0), N + 8, [(N / 3, 2 * N / 3)], affine, 1.0)
    steps = int(np.ceil(0.8 * N / safety)) * (2 if scheme in ("fine", "lockstep") else 1)
    dt, w, A = 0.8 * N / steps, np.pi / N, 1e-6
    u, strain = np.sin(0.8 * np.pi) * A / w, np.sin(0.8 * np.pi) * A
    late = [0.5 * dt * (1 if scheme == "lockstep" else level.h / sim.levels[0].h) for level in sim.levels]
    # velocities stand half a step before displacements
    for level, k in zip(sim.levels, late):
        start(level.p, lambda x: A * np.cos(w * x) * np.cos(w * k), 0)
    x = np.sort(sim.particles()["x"])
    for _ in range(steps):
        sim.step(dt)
    for level, k in zip(sim.levels, late):
        level.p["v"] -= A * np.cos(w * level.p["x"]) * np.cos(w * (0.8 * N - k))
    p = np.sort(sim.particles(), order="x")
    off = (p["x"] - x) / u - np.cos(w * x)
    v, stress = p["v"] / strain, p["stress"] / strain + np.sin(w * p["x"])
    return np.sqrt((p["V"] * off**2).sum() / p["V"].sum()) * np.sin(0.8 * np.pi), *(
        abs(z).max() / np.sin(np.pi / 3) for z in (v, stress)
    )


def modes(regions=((5, 11),), schemes=("coarse", "unlabelled", "lockstep", "composite", "uneven", "lasting")):
    print(
        f"bar of 16 cells, finer over {regions}, steps of frozen weights: fastest growth of an amplitude in "
        "a unit of time, and its frequency:"
    )
    fields = ("v", "L", "stress", "grown")
    for affine in (0, 1):
        for scheme in schemes:
            found = []
            for safety in (0.05, 0.15, 0.3, 0.4):
                sim = build(scheme, bar(0, 16, 1.0), 24, list(regions), affine, 1.0)
                sim.change_levels = lambda l: None  # frozen, this as well
                at_rest = [level.p.copy() for level in sim.levels]
                columns = []
                for l, level in enumerate(sim.levels):
                    for name in fields:
                        for k in range(level.p.size):
                            for other, p in zip(sim.levels, at_rest):
                                other.p = p.copy()
                            sim.levels[l].p[name][k] = 1e-12  # so that places and volumes stay
                            sim.step(safety)
                            columns.append(
                                np.concatenate([other.p[f] for other in sim.levels for f in fields]) / 1e-12
                            )
                values = np.linalg.eigvals(np.array(columns).T)
                largest = values[np.argmax(np.abs(values))]
                found.append(
                    f"{max(0.0, np.abs(largest) - 1) / safety:.5f} ({np.angle(largest) / safety:.2f})"
                )
            print(
                f"  affine {affine}  {scheme:10}  safety 0.05, 0.15, 0.3, 0.4:  {'  '.join(found)}",
                flush=True,
            )


def still():
    print(
        "bar of 400 cells under a stress of 1e-3, finer over its middle; after 50 steps, 150 cells about the "
        "middle:"
    )
    for regions in ([(190, 210)], [(190, 210), (195, 205)]):
        for affine, flip in ((0, 1.0), (1, 1.0), (1, 0.95)):
            for scheme, left in (
                ("composite", 0.0),
                ("composite", 0.1),
                ("composite", 0.3),
                ("lasting", 0.1),
            ):
                sim = build(scheme, bar(left, 400, 1.0), 420, regions, affine, flip)
                for level in sim.levels:
                    level.p["stress"] = 1e-3
                for _ in range(50):
                    sim.step(0.4)
                p = sim.particles()
                p = p[abs(p["x"] - 200) < 75]
                print(
                    f"  levels {len(sim.levels)}  affine {affine}  flip {flip:4}  {scheme:9}  offset {left}  "
                    f"|v| {abs(p['v']).max():.0e}  stress off by {abs(p['stress'] - 1e-3).max():.0e}",
                    flush=True,
                )


if __name__ == "__main__":
    runs = {
        "pulse": pulse,
        "ring": lambda: ring(args.steps),
        "move": move,
        "levels3": lambda: levels3(args.steps),
        "order": order,
        "still": still,
        "modes": modes,
    }
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("run", choices=tuple(runs))
    parser.add_argument("steps", nargs="?", type=int, default=10000)
    args = parser.parse_args()
    runs[args.run]()
