#!/usr/bin/env python3
"""Time the program on benchmark scenes and set it beside what the machine can do: the tables of
doc/user/performance.md.

usage: bench.py WORK GIMP3D TOOLS [--repeats N] [--only TABLE ...] [--build TEXT] [--before GIMP3D]
[--coarrays FOLDER]

TOOLS is the folder of the programs probe, barrier, ranks, halo and laws. TABLE is one of before, tips, block,
contact, compliance, pairs, growth, large, levels, model, ranks, checkpoint, guard, laws, taichi, halo,
section (all when none is named).
before   scenes as users run them (users.py), beside the program that --before names, in user time
tips     a tip of 4224, 10^5 and 10^6 triangles beside the same tip as a cone: what contact takes
block    an elastic block of 32 x 32 x 32 cells in motion: moved along (ordered), deforming as it hits a wall
         (impact) or tumbling (disordered), 1 and 8 particles a cell, affine and plain transfer, 1 and 2 ranks
contact  E2 and E3, over the run and over the last tenth of their depth
compliance  E2 on 2 ranks: what the compliance of contact points does to the time for contact, to the load and
to the overlap
pairs    2 ranks against two independent copies of 1 rank run side by side, and against one
growth   10^5 to 4 x 10^6 particles, 1 rank: disordered; metal that flows, on one grid and on two to four
         levels
large    16 million particles, a few steps, 2 ranks
levels   E4 on three nested levels: 1 and 2 ranks measured, 4, 6, 9 as messages, bytes and balance of a rank,
and a model
model    what 1 to 512 ranks would give: the program's own placement and message lists (ranks.f90), a measured
         time an update, and an assumed network; the counts are checked against runs on 2, 4 and 8 ranks
ranks    E1 with its pressure: time a step on 1 and 2 ranks, and by that model up to 64
guard    what the guard costs: its row of cost.dat, and runs with copies and looks 20 times as often and
         without them, in turn; with --before, a program built before there was a guard, runs of that in turn
         too: they tell what the looks in every step cost
laws     material laws by themselves: nanoseconds a particle (laws.f90)
taichi   neo_hookean beside a bare MLS-MPM step in taichi, where that is installed (taichi_mpm.py)
section  a quarter model over its section, processor time at the same cells: demo, indenter, B1, Taylor,
         quasi-static cone
halo     an exchange of ghost nodes by MPI and, where FOLDER has a program halo built with coarrays, by these:
         bytes, messages, time (halo.f90)
checkpoint  what one costs, beside a plain write of as many bytes A probe of multiply-adds and of a memory
copy runs before and after each scene. An update is one particle through one whole step, everything included.
Floors: 1.6 kFLOP and 390 bytes an update. Figures are medians of the repeats."""

import argparse
import math
import os
import pathlib
import platform
import re
import statistics
import subprocess
import sys
import time

import users
from gimp3d.run_data import History
from gimp3d.run_log import numbers_of

ROOT = pathlib.Path(__file__).resolve().parents[2]
PHASES = [
    'lists',
    'P2G',
    'exchange',
    'nodes',
    'contact',
    'G2P',
    'stress',
    'migration',
    'control',
    'balance',
    'output',
    'guard',
    'indicators',
    'the rest',
]
# a run: its start and end, and here the stress error, which is estimated at its end
ONCE = ['indicators', 'the rest']
KERNELS = ['P2G', 'G2P', 'stress']
FLOPS, BYTES = 1600.0, 390.0  # an update
STEP = 3.19e-12  # s, of the block scenes
LATENCY, BANDWIDTH = 2e-6, 5e9  # s a message, B/s a rank: an assumed network


def block_scene(cells, per_cell, motion, transfer, steps, out):
    """An elastic cube of `cells` cells an edge: in free flight; tumbling (disordered), its edges at a tenth
    of the wave speed; or against a wall at a tenth of the wave speed (impact)."""
    h, margin = 64e-9, 8
    size = (cells + 2 * margin + 7) // 8 * 8
    spin = 4e8 * 32 / cells
    low = 0 if motion == 'impact' else margin
    side = (
        ', boundary=\'free\',\'free\',\'free\',\'free\',\'symmetry\',\'free\'' if motion == 'impact' else ''
    )
    velocity = '0,0,-600' if motion == 'impact' else '100,50,20'
    turning = f', angular_velocity={spin / 2!r},{spin / 4!r},{spin!r}' if motion == 'disordered' else ''
    return f"""&scene title='bench', end_time={steps * STEP!r} /
&grid lower=0,0,0, upper={size * h!r},{size * h!r},{size * h!r}, cell_size={h!r}{side} /
&time time_step={STEP!r}, transfer='{transfer}' /
&material name='aluminium', model='elastic', density=2710, young=70e9, poisson=0.33 /
&body material='aluminium', shape='box', lower={margin * h!r},{margin * h!r},{low * h!r},
      upper={(margin + cells) * h!r},{(margin + cells) * h!r},{(low + cells) * h!r}, particles_per_cell={per_cell},
      velocity={velocity}{turning} /
&output directory='{out}', formats='none', history_every=1 /
"""


def shipped_scene(name, out, share=1.0, history=True):
    """A scene of input/, up to a share of its time, without snapshots."""
    text = (ROOT / 'input' / f'{name}.nml').read_text()
    text = re.sub(r'end_time=(\S+)', lambda m: f'end_time={float(m[1]) * share!r}', text)
    return re.sub(
        r'&output.*/',
        f"&output directory='{out}', formats='none'{'' if history else ', history_every=1'} /",
        text,
    )


def directory_of(scene):
    return pathlib.Path(re.search(r"directory='([^']*)'", scene)[1])


class Bench:
    """Runs scenes and keeps what they cost."""

    def __init__(self, work, gimp3d, tools, repeats):
        self.work, self.gimp3d, self.tools, self.repeats = work, gimp3d, tools, repeats
        self.gflops, self.gbytes, self.runs = [], [], 0

    before = None  # a program built before there was a guard
    coarrays = None  # the program halo that fills it by coarrays

    def probe(self):
        words = subprocess.run(
            [self.tools / 'probe'], capture_output=True, text=True, check=True
        ).stdout.split()
        self.gflops.append(float(words[1]))
        self.gbytes.append(float(words[3]))

    def barrier(self, ranks):
        """By size of their work: megabytes, milliseconds of a piece of it, and the share of their pace that
        ranks keep who wait for each other after each."""
        text = subprocess.run(
            ['mpirun', '-n', str(ranks), self.tools / 'barrier'], capture_output=True, text=True, check=True
        ).stdout
        return [tuple(map(float, line.split()[1::2])) for line in text.splitlines()]

    def out(self):
        self.runs += 1
        return self.work / f'run_{self.runs}'

    def start(self, ranks, scene):
        return subprocess.Popen(
            ['mpirun', '-n', str(ranks), self.gimp3d],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        ), scene

    def finish(self, started, read=None):
        process, scene = started
        log, _ = process.communicate(scene)
        if process.returncode != 0:
            raise SystemExit(f'a run ended with status {process.returncode}:\n{log[-1500:]}')
        return (read or read_costs)(directory_of(scene))

    def run(self, ranks, scene):
        return self.finish(self.start(ranks, scene))

    def several(self, ranks, make_scene, repeats=None):
        self.probe()
        costs = [self.run(ranks, make_scene(self.out())) for _ in range(repeats or self.repeats)]
        self.probe()
        return median_costs(costs)

    def in_turn(self, ranks, makers):
        """Runs of several scenes one after the other, round after round: the costs of each, rounds first.
        Ratios within a round mean something on a machine that others slow now and then."""
        self.probe()
        rounds = [[self.run(ranks, make(self.out())) for make in makers] for _ in range(self.repeats)]
        self.probe()
        return rounds

    def side_by_side(self, copies, make_scene):
        """Seconds that the slowest of several 1-rank copies needs."""
        started = [self.start(1, make_scene(self.out())) for _ in range(copies)]
        for process, scene in started:
            process.stdin.write(scene)
            process.stdin.close()
        seconds = []
        for process, scene in started:
            log = process.stdout.read()
            process.wait()
            if process.returncode != 0:
                raise SystemExit(f'a run ended with status {process.returncode}:\n{log[-1500:]}')
            seconds.append(read_costs(directory_of(scene))['seconds'])
        return max(seconds)


def cost_of(out):
    """The head and the rows of a run's cost.dat: numbers and texts by name; for each phase seconds of the
    slowest rank, calls, nanoseconds a particle-step."""
    cost = History(out / 'cost.dat')
    rows = {
        cost.notes[f'phase_{int(number)}']: (most, int(calls), each)
        for number, most, calls, each in zip(
            cost['phase'], cost['most of the ranks'], cost['calls'], cost['all ranks per particle-step']
        )
    }
    return numbers_of(cost.notes), rows


def read_costs(out):
    """Nanoseconds a particle-step of each phase (all ranks together), updates, seconds, particles, bytes a
    particle."""
    said, rows = cost_of(out)
    costs = {name: each for name, (most, _, each) in rows.items() if most > 0}
    costs['updates'], costs['ranks'] = int(said['particle_steps']), int(said['ranks'])
    costs['steps'] = int(said['steps'])
    costs['seconds'] = costs['all'] * costs['updates'] * 1e-9 / costs['ranks']
    costs['particles'] = int(said['particles_at_start'])
    costs['bytes'] = said['memory_at_start_B'] / said['particles_at_start']
    for key, name in (
        ('contact share', 'contact_share_percent'),
        ('late contact share', 'contact_share_at_end_percent'),
        ('messages', 'messages_a_step'),
        ('sent', 'bytes_sent_a_step'),
        ('solves', 'contact_solves'),
        ('products', 'contact_products'),
        ('newton', 'newton_iterations'),
        ('static solves', 'linear_solves'),
        ('static products', 'linear_products'),
    ):
        if name in said:
            costs[key] = said[name]
    return costs


def stepping(costs):
    """Nanoseconds a particle-step that steps take: without what is done once a run, which few steps do not
    repay."""
    return costs['all'] - sum(costs.get(phase, 0.0) for phase in ONCE)


def median_costs(costs):
    return {key: statistics.median(c.get(key, 0.0) for c in costs) for key in costs[0]}


def row(cells):
    print('| ' + ' | '.join(cells) + ' |', flush=True)


def head(titles):
    print()
    row(titles)
    row(['---'] * len(titles))


def table_block(bench):
    """Affine and plain transfer in turn; the last column is the median of their ratios."""
    shown = [p for p in PHASES if p not in ('contact', 'balance', 'output', 'guard', *ONCE)]
    head(
        [
            'particles a cell',
            'motion',
            'transfer',
            'ranks',
            'million updates/s and core',
            'share of flop floor [%]',
            'share of byte floor [%]',
            *(f'{p} [ns]' for p in shown),
            'start and end [ns]',
            'all [ns]',
            'not kernels, of a step [%]',
            'B/particle',
            'over plain',
        ]
    )
    for per_cell in 8, 1:
        for motion in ('ordered', 'impact', 'disordered') if per_cell == 8 else ('ordered', 'disordered'):
            for ranks in 1, 2:
                steps = 200 if motion == 'impact' else 120
                rounds = bench.in_turn(
                    ranks,
                    [
                        lambda out, t=t: block_scene(32, per_cell, motion, t, steps, out)
                        for t in ('affine', 'plain')
                    ],
                )
                for transfer, costs in zip(('affine', 'plain'), zip(*rounds)):
                    c = median_costs(costs)
                    rest = statistics.median(
                        100 * (1 - sum(x[k] for k in KERNELS) / stepping(x)) for x in costs
                    )
                    row(
                        [
                            str(per_cell),
                            motion,
                            transfer,
                            str(ranks),
                            f'{1e3 / c["all"]:.2f}',
                            f'{100 * FLOPS / bench.gflops[-1] / c["all"]:.0f}',
                            f'{100 * BYTES / bench.gbytes[-1] / c["all"]:.0f}',
                            *(f'{c.get(p, 0):.1f}' for p in shown),
                            f'{c["all"] - stepping(c):.1f}',
                            f'{c["all"]:.1f}',
                            f'{rest:.1f}',
                            f'{c["bytes"]:.0f}',
                            f'{statistics.median(a["all"] / b["all"] for a, b in rounds):.2f}'
                            if transfer == 'affine'
                            else '',
                        ]
                    )


def table_contact(bench):
    head(
        [
            'scene',
            'transfer',
            'ranks',
            'contact over the run [%]',
            'over the last tenth [%]',
            'products a solve',
            'contact [ns an update]',
            'all else [ns an update]',
            'million updates/s and core',
        ]
    )
    for name, transfer, ranks in (
        ('cone', 'affine', 1),
        ('cone', 'affine', 2),
        ('cone', 'plain', 2),
        ('deep_sphere', 'affine', 1),
        ('deep_sphere', 'affine', 2),
    ):
        c = bench.several(
            ranks,
            lambda out: shipped_scene(name, out).replace('&time', f"&time transfer='{transfer}',"),
            repeats=3,
        )
        row(
            [
                name,
                transfer,
                str(ranks),
                f'{c["contact share"]:.0f}',
                f'{c["late contact share"]:.0f}',
                f'{c["products"]:.0f}',
                f'{c["contact"]:.0f}',
                f'{c["all"] - c["contact"]:.0f}',
                f'{1e3 / c["all"]:.2f}',
            ]
        )


def table_compliance(bench):
    """Loads are compared row by row of the tool's history, which all runs have at the same times."""
    head(
        [
            'compliance',
            'products a solve',
            'contact [s]',
            'of the run [%]',
            'load, largest change over the second half, of the largest load [%]',
            'mean change [%]',
            'largest overlap [cells]',
        ]
    )
    first = None
    for compliance in (0.0005, 0.002, 0.005, 0.01, 0.02, 0.05):
        out = bench.out()
        scene = shipped_scene('cone', out) + f'&contact compliance={compliance} /\n'
        c = bench.finish(bench.start(2, scene))
        overlap = cost_of(out)[0]['largest_overlap_cells']
        load = list(History(out / 'tool_cone.dat')['load_z'])
        first = first or load
        change = [100 * (new - old) / max(first) for new, old in zip(load, first, strict=True)][
            len(load) // 2 :
        ]
        row(
            [
                f'{compliance}',
                f'{c["products"]:.1f}',
                f'{c["contact"] * c["updates"] * 1e-9 / c["ranks"]:.1f}',
                f'{c["contact share"]:.0f}',
                f'{max(map(abs, change)):.3f}',
                f'{statistics.mean(change):+.4f}',
                f'{overlap:.4f}',
            ]
        )
    print('\nOne run each, to 571 nm. Changes against the first row.')


def table_pairs(bench):
    head(
        [
            'scene',
            '1 rank [s]',
            '2 ranks [s]',
            'two 1-rank copies side by side [s]',
            '2 ranks over the two copies',
            '2 ranks over 1',
        ]
    )
    scenes = {
        'E1': lambda out: shipped_scene('scaling', out, 0.2, history=False),
        'E2, first half': lambda out: shipped_scene('cone', out, 0.5),
        'E4 on three levels, first quarter': lambda out: shipped_scene('cone_levels', out, 0.25),
        'cone in metal on five levels, first sixth': lambda out: shipped_scene('indenter', out, 0.17),
    }
    for name, make in scenes.items():
        rounds = [
            (
                bench.run(1, make(bench.out()))['seconds'],
                bench.run(2, make(bench.out()))['seconds'],
                bench.side_by_side(2, make),
            )
            for _ in range(bench.repeats)
        ]
        row(
            [
                name,
                *(f'{statistics.median(column):.2f}' for column in zip(*rounds)),
                f'{statistics.median(both / 2 / two for _, two, both in rounds):.2f}',
                f'{statistics.median(one / two for one, two, _ in rounds):.2f}',
            ]
        )
    print('\nIn turn; ratios are medians of those of each round.')
    for tries in zip(*(bench.barrier(2) for _ in range(bench.repeats))):
        size, ms, pace = (statistics.median(column) for column in zip(*tries))
        print(
            f'Two ranks that do nothing but arithmetic on {size:.0f} MB each and wait for each other every '
            f'{ms:.1f} ms keep {pace:.2f} of '
            f'their pace (median; {min(t[2] for t in tries):.2f} to {max(t[2] for t in tries):.2f}).'
        )


def table_before(bench):
    """Scenes of users.py by the program of --before and by this one, in turn."""
    if not bench.before:
        print('left out: no program to compare with (BEFORE=a commit or a program)')
        return
    head(['scene', 'before [s]', 'now [s]', 'times faster', 'least to most'])
    for name, scene in users.scenes().items():
        out = bench.out()
        rounds = [
            [users.user_time(program, scene, out) for program in (bench.before, bench.gimp3d)]
            for _ in range(bench.repeats)
        ]
        ratios = [a / b for a, b in rounds]
        row(
            [
                name,
                *(f'{statistics.median(column):.2f}' for column in zip(*rounds)),
                f'{statistics.median(ratios):.2f}',
                f'{min(ratios):.2f} to {max(ratios):.2f}',
            ]
        )
    print(f'\nUser time of the processor, 1 rank, medians of {bench.repeats} rounds in turn.')


def table_tips(bench):
    """Seconds of user time for contact: its share of the elapsed time, of the user time without the start."""
    head(['levels', 'tip', 'contact [s]', 'over the cone', 'all of the run [s]', 'MB'])
    kinds = {'cone': "shape='cone', half_angle=70.3"}
    for triangles in (4224, 100000, 1000000):
        path = bench.work / f'tip_{triangles}.stl'
        kinds[f'{users.cone_file(path, triangles)} triangles'] = f"shape='surface', file='{path}'"

    def read(out):
        costs = read_costs(out)
        memory = cost_of(out)[0]['memory_B'] / 1e6
        once = sum(costs.get(phase, 0.0) for phase in ONCE)
        return costs['contact'] / costs['all'], once / costs['all'], memory

    for levels in (1, 3):
        rounds = [
            [
                users.user_time(bench.gimp3d, users.tip(levels, kind), bench.out(), read)
                for kind in kinds.values()
            ]
            for _ in range(bench.repeats)
        ]
        spent = [[seconds * shares[0] for seconds, shares in runs] for runs in rounds]
        for n, name in enumerate(kinds):
            row(
                [
                    str(levels),
                    name,
                    f'{statistics.median(s[n] for s in spent):.2f}',
                    f'{statistics.median(s[n] / s[0] for s in spent):.1f}',
                    f'{statistics.median(runs[n][0] for runs in rounds):.1f}',
                    f'{rounds[0][n][1][2]:.0f}',
                ]
            )


def table_growth(bench):
    head(['scene', 'particles', 'steps', 'ns an update', 'of the smallest', 'B/particle'])
    steps = 60  # of all: a body that tumbles longer is in greater disorder
    growing = {
        'elastic, tumbling': [
            lambda out, n=n: block_scene(n, 8, 'disordered', 'affine', steps, out) for n in (24, 32, 50, 79)
        ],
        'j2, flowing': [
            lambda out, n=n: users.block(n, users.METAL, 'flowing', steps).replace('OUT', str(out))
            for n in (24, 50, 79)
        ],
        **{
            f'j2, flowing, {levels} levels': [
                lambda out, n=n, levels=levels: users.nested_block(levels, n).replace('OUT', str(out))
                for n in ((24, 48, 72) if levels == 2 else (16, 32, 56))
            ]
            for levels in (2, 3, 4)
        },
    }
    for name, makers in growing.items():
        rounds = bench.in_turn(1, makers)
        steps_only = [[stepping(c) for c in costs] for costs in rounds]
        for i, c in enumerate(rounds[0]):
            row(
                [
                    name,
                    f'{c["particles"]:.0f}',
                    str(c['steps']),
                    f'{statistics.median(s[i] for s in steps_only):.1f}',
                    f'{statistics.median(s[i] / s[0] for s in steps_only):.2f}',
                    f'{c["bytes"]:.0f}',
                ]
            )
    print(
        '\nIn turn; ratios are medians of those of each round. Without start and end of the run, which few '
        'steps do not repay.'
    )


def table_large(bench):
    head(['particles', 'ranks', 'million updates/s and core', 'GB in all', 'B/particle'])
    c = bench.run(2, block_scene(126, 8, 'disordered', 'affine', 6, bench.out()))
    row(
        [
            f'{c["particles"]}',
            '2',
            f'{1e3 / stepping(c):.2f}',
            f'{c["bytes"] * c["particles"] / 1e9:.2f}',
            f'{c["bytes"]}',
        ]
    )


def placements(bench, scene, ranks):
    """What the most loaded of so many ranks holds and sends, a dictionary for each number of ranks."""
    text = subprocess.run(
        [bench.tools / 'ranks', *map(str, ranks)], input=scene, capture_output=True, text=True, check=True
    ).stdout
    titles, *lines = (line.split() for line in text.splitlines())
    return [dict(zip(titles, map(int, line))) for line in lines]


def table_model(bench):
    scenes = {
        'E1': lambda out: shipped_scene('scaling', out, 0.02, history=False),
        '16 million': lambda out: block_scene(126, 8, 'ordered', 'affine', 1, out),
    }
    # steps enough to repay the start
    update = bench.several(2, lambda out: shipped_scene('scaling', out, 0.4, history=False), repeats=3)
    update = stepping(update) * 1e-9
    head(
        [
            'scene',
            'ranks',
            'particles a rank, mean',
            'most',
            'blocks, most',
            'neighbours, most',
            'MB sent in a step, most',
            'work [ms a step]',
            'messages [ms a step]',
            'million updates/s and core',
            'share of 1 rank',
        ]
    )
    for name, make in scenes.items():
        first = None
        for p in placements(bench, make(bench.out()), (1, 2, 4, 8, 64, 512)):
            work = p['work_most'] * update
            # node sums and migration: one message a neighbour each; one sum over all ranks
            network = (
                2 * p['messages_most'] * LATENCY
                + p['bytes_most'] / BANDWIDTH
                + 2 * math.log2(p['ranks']) * LATENCY
            )
            rate = p['work_mean'] / (work + network) * 1e-6
            first = first or rate
            row(
                [
                    name,
                    str(p['ranks']),
                    str(p['particles_mean']),
                    str(p['work_most']),
                    str(p['blocks_most']),
                    str(p['neighbours_most']),
                    f'{p["bytes_most"] * 1e-6:.2f}',
                    f'{1e3 * work:.3f}',
                    f'{1e3 * network:.3f}',
                    f'{rate:.2f}',
                    f'{rate / first:.2f}',
                ]
            )
    print(
        f'\nMeasured: {update * 1e9:.0f} ns an update on 2 ranks. Assumed: {LATENCY * 1e6:.0f} us a message, '
        f'{BANDWIDTH * 1e-9:.0f} GB/s '
        'a rank, nothing overlapped, ranks that do not slow each other. No contact.'
    )
    head(['ranks (E1, run)', 'messages a step, most', 'by the model', 'bytes a step, most', 'by the model'])
    for p in placements(bench, scenes['E1'](bench.out()), (2, 4, 8)):
        c = bench.run(p['ranks'], scenes['E1'](bench.out()))
        row(
            [
                str(p['ranks']),
                f'{c["messages"]:.0f}',
                str(p['messages_most']),
                f'{c["sent"]:.0f}',
                str(p['bytes_most']),
            ]
        )
        if (c['messages'], c['sent']) != (p['messages_most'], p['bytes_most']):
            raise SystemExit('the model counts other messages than the run')


def table_ranks(bench):
    """E1 with its pressure and 8 particles a cell, as in the thesis, whose figure 17 this is: milliseconds a
    step, the mean of 100, measured in turn on 1 and 2 ranks, and by the model, which knows the pace of one
    rank alone. Writes time_per_step.csv, which `make plots` draws for E1 when it stands in test/references."""
    scene = lambda out: shipped_scene('scaling_pressure', out, 0.361, history=False).replace(
        'particles_per_cell=1 ', 'particles_per_cell=8 '
    )
    rounds = [[bench.run(ranks, scene(bench.out())) for ranks in (1, 2)] for _ in range(bench.repeats)]
    of_step = lambda c: stepping(c) * 1e-6 * c['updates'] / c['ranks'] / c['steps']  # ms
    measured = {ranks: statistics.median(of_step(both[ranks - 1]) for both in rounds) for ranks in (1, 2)}
    ratio = statistics.median(of_step(one) / of_step(two) for one, two in rounds)
    particles = rounds[0][0]['particles']
    head(['ranks', 'measured [ms a step]', 'model [ms a step]', 'model off [%]', 'speed-up by the model'])
    lines = []
    for p in placements(bench, scene(bench.out()), (1, 2, 3, 4, 6, 9, 16, 32, 64)):
        work = p['work_most'] * measured[1] / particles
        network = (
            2 * p['messages_most'] * LATENCY
            + p['bytes_most'] / BANDWIDTH
            + 2 * math.log2(p['ranks']) * LATENCY
        )
        model, seen = work + 1e3 * network, measured.get(p['ranks'])
        lines.append(f'{p["ranks"]},{particles},{seen or "nan"},{model:.6g}')
        row(
            [
                str(p['ranks']),
                f'{seen:.2f}' if seen else '',
                f'{model:.2f}',
                f'{100 * (model / seen - 1):+.1f}' if seen else '',
                f'{measured[1] / model:.2f}',
            ]
        )
    (bench.work / 'time_per_step.csv').write_text(
        'ranks,particles,measured_ms,model_ms\n' + '\n'.join(lines) + '\n'
    )
    print(
        f'\n{rounds[0][0]["steps"]} steps, {particles} particles; 2 ranks: {ratio:.2f} times as fast as one '
        f'(median of {bench.repeats} rounds in turn). Assumed: {LATENCY * 1e6:.0f} us a message, '
        f'{BANDWIDTH * 1e-9:.0f} GB/s a rank, nothing overlapped.'
    )


def table_levels(bench):
    """E4 on three levels, its first steps: measured on 1 and 2 ranks; messages, bytes, balance and a model
    for more."""
    share = 0.06
    scene = lambda out: shipped_scene('cone_levels', out, share, history=False)
    one, two = bench.several(1, scene), bench.several(2, scene)
    update = stepping(two) * 1e-9
    steps = one['steps']
    head(
        [
            'ranks',
            'measured [ms a step]',
            'speed-up',
            'work a rank, mean [particle-steps]',
            'most over mean',
            'messages a step, most',
            'MB a step, most',
            'model: work [ms]',
            'model: messages [ms]',
            'model: speed-up',
        ]
    )
    first = None
    for p in placements(bench, scene(bench.out()), (1, 2, 4, 6, 9)):
        work = p['work_most'] * update
        # 14 sums over all ranks
        network = (
            p['messages_most'] * LATENCY
            + p['bytes_most'] / BANDWIDTH
            + 14 * 2 * math.log2(p['ranks']) * LATENCY
        )
        measured = {1: one, 2: two}.get(p['ranks'])
        spent = measured['seconds'] / steps if measured else 0.0
        first = first or (spent, work + network)
        row(
            [
                str(p['ranks']),
                f'{1e3 * spent:.1f}' if measured else '',
                f'{first[0] / spent:.2f}' if measured else '',
                str(p['work_mean']),
                f'{p["work_most"] / p["work_mean"]:.2f}',
                str(p['messages_most']),
                f'{p["bytes_most"] * 1e-6:.2f}',
                f'{1e3 * work:.1f}',
                f'{1e3 * network:.2f}',
                f'{first[1] / (work + network):.2f}',
            ]
        )
    print(
        f'\nMeasured: {update * 1e9:.0f} ns a particle-step on 2 ranks. Assumed: {LATENCY * 1e6:.0f} us a '
        f'message, {BANDWIDTH * 1e-9:.0f} GB/s '
        'a rank, nothing overlapped, ranks that do not slow each other. A step is one of the coarsest level; '
        'contact has not begun.'
    )
    head(['ranks (run)', 'messages a step, most', 'by the model', 'bytes a step, most', 'by the model'])
    for p in placements(bench, scene(bench.out()), (2, 4, 6)):
        c = bench.run(p['ranks'], scene(bench.out()))
        row(
            [
                str(p['ranks']),
                f'{c["messages"]:.0f}',
                str(p['messages_most']),
                f'{c["sent"]:.0f}',
                str(p['bytes_most']),
            ]
        )
        if (c['messages'], c['sent']) != (p['messages_most'], p['bytes_most']):
            raise SystemExit('the model counts other messages than the run')


def table_checkpoint(bench):
    """Checkpoints of a block and of E2 beside a plain write of as many bytes; the share is that of a run with
    the default interval."""
    interval = 600.0  # s of wall-clock time, where &checkpoint says nothing
    head(
        [
            'scene',
            'ranks',
            'MB',
            'a checkpoint [s]',
            'MB/s',
            'plain write [MB/s]',
            'share at one in 600 s [%]',
        ]
    )
    scenes = {
        'block': lambda out: block_scene(52, 8, 'ordered', 'affine', 9, out),
        'E2': lambda out: shipped_scene('cone', out, 0.005, history=False),
    }
    for name, make in scenes.items():
        for ranks in 1, 2:
            found = []
            for _ in range(bench.repeats):
                out = bench.out()
                bench.finish(bench.start(ranks, make(out) + '&checkpoint every_steps=3 /\n'))
                most, calls, _ = cost_of(out)[1]['checkpoint']
                seconds = most / calls
                size = max(path.stat().st_size for path in out.glob('checkpoint_*.h5'))
                begun = time.monotonic()
                with open(out / 'plain', 'wb') as file:
                    file.write(bytes(size))
                    file.flush()
                    os.fsync(file.fileno())
                plain = time.monotonic() - begun
                found.append((size, seconds, size / seconds, size / plain))
                for path in (*out.glob('checkpoint_*.h5'), out / 'plain'):
                    path.unlink()
            size, seconds, pace, plain = (statistics.median(column) for column in zip(*found))
            row(
                [
                    name,
                    str(ranks),
                    f'{size * 1e-6:.0f}',
                    f'{seconds:.3f}',
                    f'{pace * 1e-6:.0f}',
                    f'{plain * 1e-6:.0f}',
                    f'{100 * seconds / interval:.3f}',
                ]
            )


def table_halo(bench):
    """Rounds in turn. The least time of all rounds is what an exchange costs; their median tells how busy the
    machine was."""
    ways = {'MPI': bench.tools / 'halo'}
    if bench.coarrays and bench.coarrays.exists():
        ways['coarrays'] = bench.coarrays
    else:
        print(
            '\nCoarrays left out: OpenCoarrays for Open MPI is not there (apt-get install '
            'libcoarrays-openmpi-dev)'
        )
    head(
        [
            'scene',
            'ranks',
            'messages, all',
            'bytes, all',
            *(f'{way}, {what} [us]' for way in ways for what in ('least', 'median')),
            *(['coarrays over MPI, least'] if 'coarrays' in ways else []),
        ]
    )
    scenes = {
        'block, 1 a cell': lambda out: block_scene(32, 1, 'ordered', 'affine', 1, out),
        'E2': lambda out: shipped_scene('cone', out, 0.01),
    }
    for name, make in scenes.items():
        for ranks in 2, 4:
            tried = {way: [] for way in ways}
            for _ in range(bench.repeats):
                for way, program in ways.items():
                    said = subprocess.run(
                        ['mpirun', '-n', str(ranks), program],
                        input=make(bench.out()),
                        capture_output=True,
                        text=True,
                        check=True,
                        env={'OMPI_MCA_osc': 'pt2pt', **os.environ},
                    ).stdout
                    tried[way].append(list(map(int, said.split())))
            least = {way: min(t[3] for t in rows) for way, rows in tried.items()}
            row(
                [
                    name,
                    str(ranks),
                    str(tried['MPI'][0][1]),
                    str(tried['MPI'][0][2]),
                    *(
                        f'{ns * 1e-3:.0f}'
                        for way, rows in tried.items()
                        for ns in (least[way], statistics.median(t[4] for t in rows))
                    ),
                    *([f'{least["coarrays"] / least["MPI"]:.1f}'] if 'coarrays' in ways else []),
                ]
            )


def table_laws(bench):
    """Laws by themselves (laws.f90): the least of all repeats, for other jobs only slow a law."""
    head(
        [
            'law',
            'update below yield [ns]',
            'the same over elastic',
            'update while it flows [ns]',
            'strain energy [ns]',
        ]
    )
    tried = []
    for _ in range(bench.repeats):
        said = subprocess.run([bench.tools / 'laws'], capture_output=True, text=True, check=True).stdout
        tried.append(
            [(line.split('"')[1], *map(float, line.split('"')[2].split())) for line in said.splitlines()]
        )
    for rows in zip(*tried):
        name, below, beyond, energy = rows[0][0], *(min(row[c] for row in rows) for c in (1, 2, 3))
        elastic = min(row[0][1] for row in tried)
        row([name, f'{below:.1f}', f'{below / elastic:.1f}', f'{beyond:.1f}', f'{energy:.1f}'])


def table_taichi(bench):
    """The block in free flight and tumbling with a law of large strains, beside a bare MLS-MPM step in taichi
    (taichi_mpm.py), in turn on one core. TAICHI_PYTHON names a Python that has taichi; without it the one
    that runs this. Ratios within a round."""
    python = os.environ.get('TAICHI_PYTHON', sys.executable)
    if subprocess.run([python, '-c', 'import taichi'], capture_output=True).returncode:
        print(
            f'left out: taichi, for {python} has no taichi (pip install taichi; TAICHI_PYTHON names another '
            'Python)'
        )
        return
    cells, steps = 30, 120
    rounds = []
    for _ in range(bench.repeats):
        tumbling = block_scene(cells, 8, 'disordered', 'affine', steps, bench.out()).replace(
            "model='elastic'", "model='neo_hookean'"
        )
        ours = [
            stepping(bench.run(1, tumbling.replace("transfer='affine'", how)))
            for how in ("transfer='affine', domain='fixed'", "transfer='affine'")
        ]
        said = [
            subprocess.run(
                [python, ROOT / 'test/performance/taichi_mpm.py', str(cells), str(steps), *how],
                capture_output=True,
                text=True,
                check=True,
            ).stdout
            for how in ([], ['atomic'])
        ]
        rounds.append([*ours, *(float(re.search(r'([\d.]+) ns an update', text)[1]) for text in said)])
    head(['program', 'update [ns]', 'million updates/s and core', 'over fixed domains', 'over the default'])
    for n, name in enumerate(
        (
            "gimp3d, neo_hookean, domain='fixed'",
            'gimp3d, neo_hookean, by default (corners)',
            'taichi, MLS-MPM, the same law',
            'the same, sums as several cores need them',
        )
    ):
        time_of = statistics.median(r[n] for r in rounds)
        row(
            [
                name,
                f'{time_of:.0f}',
                f'{1e3 / time_of:.2f}',
                *(f'{statistics.median(r[n] / r[k] for r in rounds):.2f}' for k in (0, 1)),
            ]
        )


def table_guard(bench):
    """Runs one after the other, so that a machine that others use too slows all; medians of their ratios. A
    copy in 200 steps is too little to be seen so: it is made 20 times as often, and what the runs take
    longer, with all that copies push out of the caches, is divided by 20."""
    often = 20
    head(
        [
            'scene',
            'ranks',
            'stepping [ns an update]',
            'guard [ns an update]',
            'share [%]',
            f'more than without, {often} times as often [%]',
            f'a {often}th of it [%]',
            'with over a program without a guard',
        ]
    )
    scenes = {
        'block, disordered': (1, lambda out: block_scene(24, 8, 'disordered', 'affine', 200, out)),
        'block, ordered': (1, lambda out: block_scene(24, 8, 'ordered', 'affine', 200, out)),
        'E2, first half': (1, lambda out: shipped_scene('cone', out, 0.5, history=False)),
    }
    silent = lambda c: stepping(c) - c.get('output', 0.0)
    for name, (ranks, make) in scenes.items():
        given, many, off, before = [], [], [], []
        with_guard = bench.gimp3d
        for _ in range(bench.repeats):
            given.append(bench.run(ranks, make(bench.out())))
            many.append(bench.run(ranks, make(bench.out()) + f'&guard save_every={200 // often} /\n'))
            off.append(
                bench.run(
                    ranks, make(bench.out()) + '&guard memory=0, energy_limit=0, save_every=100000000 /\n'
                )
            )
            if bench.before:
                bench.gimp3d = bench.before
                before.append(bench.run(ranks, make(bench.out())))
                bench.gimp3d = with_guard
        c = median_costs(given)
        ratio = lambda some, others: statistics.median(silent(a) / silent(b) for a, b in zip(some, others))
        more = 100 * (ratio(many, off) - 1)
        row(
            [
                name,
                str(ranks),
                f'{silent(c):.1f}',
                f'{c["guard"]:.2f}',
                f'{100 * c["guard"] / silent(c):.2f}',
                f'{more:.1f}',
                f'{more / often:.2f}',
                f'{ratio(given, before):.4f}' if before else '',
            ]
        )


def table_crystals(bench):
    """The impact of input/polycrystal.nml with several laws in turn: what a particle-step takes, and over
    that of j2."""
    laws = {
        'j2': "model='j2', density=8960, young=124e9, poisson=0.34, yield_stress=92e6, "
        "hardening_modulus=200e6",
        'cubic': "model='cubic', density=8960, c11=170e9, c12=124e9, c44=75e9",
        'crystal': None,
    }

    def scene(name, out):
        text = shipped_scene('polycrystal', out, 0.5)
        if laws[name]:
            text = re.sub(r"model='crystal'[^/]*/", laws[name] + ' /', text)
        return re.sub(r'^&grains.*/', '', text, flags=re.M) if name == 'j2' else text

    head(['law', 'stress [ns]', 'all of a step [ns]', 'over j2'])
    rounds = bench.in_turn(1, [lambda out, name=name: scene(name, out) for name in laws])
    of = dict(zip(laws, zip(*rounds)))
    for name in laws:
        c = median_costs(of[name])
        row(
            [
                name,
                f'{c["stress"]:.0f}',
                f'{stepping(c):.0f}',
                f'{statistics.median(stepping(a) / stepping(b) for a, b in zip(of[name], of["j2"])):.2f}',
            ]
        )


def static_scene(cells, preconditioner, out):
    """A ball pressed into a cube of 8 um of `cells` cells an edge at 1 m/s, and the time of the run (s): to a
    depth of a cell by quasi-static steps of half of that or, without a preconditioner, by some 40 explicit
    steps."""
    h = 8e-6 / cells
    wide = (cells + max(3, cells // 4) + 7) // 8 * 8 * h
    end, how = 40 * 0.3 * h / 6000, ''  # the wave speed is 6 km/s
    if preconditioner:
        end = h
        how = f"&quasi_static step={h / 2!r}, max_step={h / 2!r}, preconditioner='{preconditioner}' /\n"
    return (
        f"""&scene title='bench', end_time={end!r} /
&grid lower=0,0,0, upper={wide!r},{wide!r},{wide!r}, cell_size={h!r},
      boundary='symmetry','free','symmetry','free','roller','free' /
&time domain='stretch' /
&material name='metal', model='neo_hookean', density=2700, young=70e9, poisson=0.33 /
&body material='metal', shape='box', lower=0,0,0, upper=8e-6,8e-6,8e-6 /
&tool name='ball', shape='sphere', radius=5e-6, tip=0,0,8e-6, times=0, speeds=1 /
{how}&output directory='{out}', formats='none', history_every=1 /
""",
        end,
    )


def table_statics(bench):
    """Quasi-static steps of half a cell over the number of particles, and over explicit steps for the same
    way of the tool at 10 and 1 m/s."""
    head(
        [
            'particles', 'preconditioner', 'Newton', 'solves', 'products', 'step [s]',
            'ns a product and particle', 'over explicit, 10 m/s', '1 m/s',
        ]
    )  # fmt: skip
    for cells in (20, 32, 44, 58):
        scene, end = static_scene(cells, None, bench.out())
        explicit = bench.run(1, scene)
        of_run = stepping(explicit) * 1e-9 * explicit['updates']
        slow = of_run / end * 0.5 * 8e-6 / cells  # s for half a cell at 1 m/s
        for preconditioner in ('jacobi', 'gamg', 'bpx') if cells < 50 else ('gamg', 'bpx'):
            c = bench.run(1, static_scene(cells, preconditioner, bench.out())[0])
            seconds = stepping(c) * 1e-9 * c['particles']
            row(
                [
                    str(c['particles']),
                    preconditioner,
                    f'{c["newton"]:.1f}',
                    f'{c["static solves"]:.1f}',
                    f'{c["static products"]:.0f}',
                    f'{seconds:.1f}',
                    f'{seconds * 1e9 / c["static products"] / c["particles"]:.0f}',
                    f'{seconds / (slow / 10):.2f}',
                    f'{seconds / slow:.3f}',
                ]
            )


def quarter_and_section(text, out, share):
    """A quarter model of a body of revolution up to a share of its time, and the same cells as a section: its
    layer of cells, symmetry on both sides of that; a box is a ring there."""
    text = re.sub(r'^!.*\n', '', text, flags=re.M)
    text = re.sub(r'end_time=(\S+)', lambda m: f'end_time={float(m[1]) * share!r}', text)
    text = re.sub(r'&output.*/', f"&output directory='{out}', formats='none' /", text)
    cell = re.search(r'cell_size=([^,\s]+)', text)[1]
    section = re.sub(
        r"&grid +(lower=0,0,0, upper=[^,]+,)[^,]+(,[^/]*boundary='symmetry','\w+','symmetry',)'\w+'",
        rf"&grid geometry='axisymmetric', \g<1>{cell}\g<2>'symmetry'",
        text,
    )
    assert section != text
    return text, section


def table_section(bench):
    """Processor time of a quarter model over that of its section, at the same cells."""
    from gimp3d import benchmark_cases

    rows = {row.name: row for case in benchmark_cases.cases() for row in case.rows}
    static = (ROOT / 'input' / 'static_cone.nml').read_text()
    for old, new in (
        ("geometry='axisymmetric', ", ''),
        ('24e-6,1e-6,24e-6', '24e-6,24e-6,24e-6'),
        ("'symmetry','symmetry','roller'", "'symmetry','free','roller'"),
        ('8e-6,1e-6,24e-6', '8e-6,8e-6,24e-6'),
        ('20e-6,1e-6,20e-6', '20e-6,20e-6,20e-6'),
    ):
        assert old in static
        static = static.replace(old, new)
    scenes = {
        'demo': ((ROOT / 'input/demo.nml').read_text(), 0.5),
        'indenter': ((ROOT / 'input/indenter.nml').read_text(), 0.2),
        'B1, E/Y = 100, coarse': (rows['cone_100_0'].make(benchmark_cases.sharp_grids['coarse'], 'x'), 0.2),
        'taylor': (
            (ROOT / 'input/taylor.nml').read_text().replace('safety=0.3', "safety=0.3, domain='corners'"),
            0.5,
        ),
        'quasi-static cone': (static, 0.1),
    }
    head(['scene', 'particles', 'of the section', 'processor [s]', 'of the section', 'ratio'])
    for name, (text, share) in scenes.items():
        rounds = []
        for _ in range(bench.repeats):
            both = quarter_and_section(text, bench.out(), share)
            rounds.append([bench.finish(bench.start(1, scene), read_work) for scene in both])
        ratio = statistics.median(whole[0] / flat[0] for whole, flat in rounds)
        (work, many), (flat_work, few) = rounds[0]
        row([name, str(many), str(few), f'{work:.1f}', f'{flat_work:.2f}', f'{ratio:.0f}'])


def read_work(out):
    """Seconds of processors, and particles at the start."""
    said, _ = cost_of(out)
    return said['processor_share'] * said['elapsed_s'] * said['ranks'], int(said['particles_at_start'])


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument('work', type=pathlib.Path)
    parser.add_argument('gimp3d')
    parser.add_argument('tools', type=pathlib.Path)
    parser.add_argument('--repeats', type=int, default=5)
    parser.add_argument('--only', nargs='*', default=[])
    parser.add_argument('--build', default='')
    parser.add_argument('--before', type=pathlib.Path)
    parser.add_argument('--coarrays', type=pathlib.Path)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    program = pathlib.Path(args.gimp3d).resolve()  # runs have directories of their own
    bench = Bench(args.work.resolve(), str(program), args.tools.resolve(), args.repeats)
    bench.before = args.before and args.before.resolve()
    bench.coarrays = args.coarrays and args.coarrays.resolve() / 'halo'
    begun = time.time()
    tables = {
        'before': table_before,
        'tips': table_tips,
        'block': table_block,
        'contact': table_contact,
        'compliance': table_compliance,
        'pairs': table_pairs,
        'growth': table_growth,
        'large': table_large,
        'model': table_model,
        'ranks': table_ranks,
        'levels': table_levels,
        'guard': table_guard,
        'laws': table_laws,
        'taichi': table_taichi,
        'crystals': table_crystals,
        'statics': table_statics,
        'section': table_section,
        'checkpoint': table_checkpoint,
        'halo': table_halo,
    }
    for name in args.only or tables:
        tables[name](bench)
    processor = (
        next(
            (line.split(':')[1].strip() for line in open('/proc/cpuinfo') if line.startswith('model name')),
            platform.machine(),
        )
        if pathlib.Path('/proc/cpuinfo').exists()
        else platform.machine()
    )
    bench.probe()
    print(
        f'\nProcessor: {processor}. {args.build} Probes, least to most over the session: multiply-add '
        f'{min(bench.gflops):.1f} to '
        f'{max(bench.gflops):.1f} GFLOP/s a core, copy {min(bench.gbytes):.1f} to {max(bench.gbytes):.1f} '
        f'GB/s. Medians of {args.repeats} (contact: 3, large: one run); {time.time() - begun:.0f} s in all.'
    )


if __name__ == '__main__':
    main()
