#!/usr/bin/env python3
"""What the looks of the guard in every step cost: user-space instructions a particle-step, counted by
valgrind, of a program beside one that was built before there was a guard. Both of the build avx2 (valgrind
knows no AVX-512).

usage: guard.py GIMP3D BEFORE

A free block, ordered and disordered, without copies; the figure is the difference of a longer and a shorter
run, over the difference of their particle-steps. What copies and looks at all fields cost stands in cost.dat,
row guard (make bench BENCH=guard)."""

import pathlib
import re
import subprocess
import sys
import tempfile

from bench import block_scene, head, row
from gimp3d.run_log import facts_of

NO_COPIES = '&guard memory=0, energy_limit=0, save_every=100000000 /\n'


def count(program, scene, work):
    done = subprocess.run(
        ['valgrind', '--tool=callgrind', f'--callgrind-out-file={work}/callgrind.out', program],
        input=scene,
        capture_output=True,
        text=True,
        check=True,
    )
    return (
        int(re.search(r'Collected : (\d+)', done.stderr)[1]),
        int(facts_of(f'{work}/out/cost.dat')['particle_steps']),
    )


def each(program, motion, more, work):
    """Instructions a particle-step."""
    (few, steps), (many, more_steps) = (
        count(program, block_scene(12, 8, motion, 'affine', n, f'{work}/out') + more, work) for n in (10, 30)
    )
    return (many - few) / (more_steps - steps)


def main():
    program, before = (str(pathlib.Path(path).resolve()) for path in sys.argv[1:3])
    head(['block', 'instructions a particle-step', 'before', 'more [%]'])
    with tempfile.TemporaryDirectory() as work:
        for motion in 'ordered', 'disordered':
            now, then = each(program, motion, NO_COPIES, work), each(before, motion, '', work)
            row([motion, f'{now:.1f}', f'{then:.1f}', f'{100 * (now / then - 1):.2f}'])


if __name__ == '__main__':
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main()
