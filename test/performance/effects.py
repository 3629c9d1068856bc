#!/usr/bin/env python3
"""What effects cost scenes that do not call for them: the table of doc/user/performance.md, section "Absent
effects".

usage: effects.py WORK [--only SCENE ...]

For each scene of input/: the effects that are on, bytes a particle, the rows of cost.dat entered with their
calls a step, and the user-space instructions a particle-step on one rank, beside those of a bare build: a
copy of the tree in which the list of effects is empty, their files are gone, and so is everything in the step
that asks for them (`strip`). Instructions are counted by perf where the machine lets it (then of the build
opt), else by callgrind (of the build avx2: it knows no AVX-512). Start and end of a run drop out: the figure
is the difference of a longer and a shorter run, over the difference of their particle-steps. A scene that
calls for an effect cannot run on the bare build: only the full one is measured. Exits 1 when a scene without
effects costs more than 1 % more; or less: then the bare build does something else."""

import argparse
import os
import pathlib
import re
import shutil
import subprocess
import time

from bench import ROOT, head, row, shipped_scene
from gimp3d.run_log import facts_of

ALLOWED = 1.0  # % more instructions
PREFIXES = {'': 1.0, 'm': 1e-3, 'u': 1e-6, 'n': 1e-9, 'p': 1e-12, 'f': 1e-15}


def statements(text):
    """Source lines, those that go on with & together with what follows."""
    together, found = '', []
    for line in text.splitlines(keepends=True):
        together += line
        if not line.split('!')[0].rstrip().endswith('&'):
            found.append(together)
            together = ''
    return found


def drop(path, pattern):
    """Take statements out of a source file that match, a block `if` with its body and end; at least one must
    be there."""
    kept, depth, dropped = [], 0, 0
    for statement in statements(path.read_text()):
        code = statement.strip()
        if depth > 0:
            depth += bool(re.match(r'if .*\bthen$', code)) - code.startswith('end if')
        elif re.search(pattern, statement) and not code.startswith(('use ', '!')):
            dropped += 1
            depth = int(code.startswith('if ') and code.endswith(' then'))
        else:
            kept.append(statement)
    if dropped == 0:
        raise SystemExit(f'{path}: nothing matches {pattern}: the bare build must learn what has changed')
    path.write_text(''.join(kept))


def replace(path, old, new):
    text = path.read_text()
    if not re.search(old, text):
        raise SystemExit(f'{path}: nothing matches {old}: the bare build must learn what has changed')
    path.write_text(re.sub(old, new, text))


def effect_groups(source):
    """Names of the groups that call for effects."""
    found = re.findall(r"^ *block; .*call add\('(\w+)'", (source / 'effects/effects.f90').read_text(), re.M)
    if not found:
        raise SystemExit('effects/effects.f90 has no list')
    return found


def called_for(name, groups):
    """Whether a scene of input/ calls for an effect."""
    return bool(
        set(groups) & set(re.findall(r'^\s*&(\w+)', (ROOT / 'input' / f'{name}.nml').read_text(), re.M))
    )


def strip(source):
    """Leave all optional effects out of a copy of src/."""
    listed = source / 'effects/effects.f90'
    modules = re.findall(r'^ *block; use m_(\w+), only', listed.read_text(), re.M)
    drop(listed, r'^ *block; use m_')
    for module in modules:
        (source / f'effects/{module}.f90').unlink()
    # what only scenes with one of them ask for: a box of atoms, a report on grains
    for path in [source / 'io/atoms_output.f90', *(source / 'atoms').glob('*.f90')]:
        if path.stem != 'embedded_model':
            path.unlink()
    filling, introduction = source / 'model/model_filling.f90', source / 'app/introduction.f90'
    drop(filling, 'build_atoms')
    replace(filling, r' *use m_coupling, .*\n', '')
    recorder = source / 'io/recorder.f90'
    replace(recorder, r'(?m)^ *if \(self%atoms > 0\) &\n.*atoms_header.*\n', '')
    drop(recorder, 'call write_atoms')
    replace(recorder, r' *use m_atoms_output, .*\n', '')
    (source / 'app/grain_report.f90').unlink()
    drop(introduction, 'introduce_grains')
    replace(introduction, r' *use m_grain_report, .*\n', '')
    grid, schedule, g2p, stress, cells = (
        source / f'explicit/{name}.f90'
        for name in ('grid_stages', 'schedule', 'g2p_stage', 'stress_stage', 'cells_stage')
    )
    kernel = source / 'kernels/p2g_boxes.f90'
    replace(grid, r'= model%effect_step\(l\)%acts_on_nodes', '= .false.')
    replace(g2p, r' \.and\. \.not\. model%effect_step\(l\)%acts_at_rest', '')
    # means over cells, and the loop over blocks that waits for them
    replace(
        g2p,
        r'(?s)         if \(size\(model%effect_step\(l\)%on_cells\) == 0\) return\n.*?(?=      end '
        r'associate\n   end subroutine g2p_block)',
        '',
    )
    drop(schedule, 'call sum_cells|call measure_work|call wake')
    for path in grid, schedule, g2p, stress, cells:
        drop(path, r'effect_step\(l\)%')
    drop(cells, 'viscous_pressure|pressure_shift')
    drop(kernel, 'viscous_pressure|pressure_shift')
    replace(
        kernel,
        r'(?s)\n(   !>[^\n]*\n)+   pure subroutine add_pressure\(.*?end subroutine add_pressure\n',
        '\n',
    )
    replace(
        source / 'model/model.f90',
        r'(?s)( *wave_speed = self%bounds%wave_speed\n) *do e = .*?end do\n',
        r'\1',
    )
    replace(source / 'model/model.f90', r' *integer :: e\n( *wave_speed = )', r'\1')
    replace(source / 'model/energy.f90', r'(?s) *do m = 1, size\(model%effects\)\n.*?end do\n', '')
    drop(source / 'model/model.f90', r'effect_step\(l\)%reduce_accumulated')
    for path in (grid, schedule, g2p, stress, cells, kernel):
        if re.search('effect_step\\(l|viscous|pressure_shift', path.read_text()):
            raise SystemExit(f'{path} still knows of effects')


def make(tree, build):
    environment = {key: value for key, value in os.environ.items() if not key.startswith(('MAKE', 'MFLAGS'))}
    begun = time.monotonic()
    done = subprocess.run(
        ['make', f'-j{os.cpu_count()}', '-C', tree, f'BUILD={build}', f'build/{build}/gimp3d'],
        env=environment,
        capture_output=True,
        text=True,
    )
    if done.returncode != 0:
        raise SystemExit(f'{tree} does not build:\n{(done.stdout + done.stderr)[-3000:]}')
    print(
        f'{tree.name}: {done.stdout.count("  compile  ")} files compiled in {time.monotonic() - begun:.0f} s'
    )
    return tree / f'build/{build}/gimp3d'


def bare_tree(work, build):
    """A copy of the tree without effects, and of what is built already, with its times: only what differs is
    compiled."""
    tree = work / 'bare'
    shutil.rmtree(tree, ignore_errors=True)
    tree.mkdir(parents=True)
    for name in ('src', 'tools', 'mk', f'build/{build}/obj/src', f'build/{build}/mod'):
        shutil.copytree(ROOT / name, tree / name)
    for name in ('Makefile', 'config.mk', f'build/{build}/flags', f'build/{build}/depends.mk'):
        if (ROOT / name).exists():
            shutil.copy2(ROOT / name, tree / name)
    strip(tree / 'src')
    return tree


class Counter:
    """Instructions in user space of one run."""

    def __init__(self, work):
        self.work = work
        said = (
            subprocess.run(
                ['perf', 'stat', '-x', ',', '-e', 'instructions:u', 'true'], capture_output=True, text=True
            ).stderr
            if shutil.which('perf')
            else ''
        )
        self.perf = bool(re.match(r'\d+,', said))
        if not self.perf and not shutil.which('valgrind'):
            raise SystemExit('neither perf with instructions:u nor valgrind is here')
        self.build = 'opt' if self.perf else 'avx2'
        self.name = 'perf stat -e instructions:u' if self.perf else 'valgrind --tool=callgrind'

    def run(self, program, scene):
        """What the run said, and its instructions."""
        report = self.work / 'count'
        command = (
            ['perf', 'stat', '-x', ',', '-e', 'instructions:u', '-o', report]
            if self.perf
            else ['valgrind', '--tool=callgrind', '--callgrind-out-file=/dev/null', f'--log-file={report}']
        )
        done = subprocess.run([*command, program], input=scene, capture_output=True, text=True)
        if done.returncode != 0:
            raise SystemExit(
                f'{program} ended with status {done.returncode}:\n{(done.stdout + done.stderr)[-1500:]}'
            )
        found = re.search(r'^(\d+),', report.read_text(), re.M) or re.search(
            r'Collected : (\d+)', report.read_text()
        )
        return done.stdout, int(found[1])


def facts(program, scene):
    """Particles and time step (s) of a scene, from its first lines; the run goes no further."""
    with subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        process.stdin.write(scene)
        process.stdin.close()
        said = ''
        while 'in steps of' not in said:
            line = process.stdout.readline()
            if line == '':
                raise SystemExit(f'{program} said only:\n{said}')
            said += line
        process.kill()
    size = re.search(r'^particles +(\d+) on', said, re.M)
    step = re.search(r'in steps of ([\d.eE+-]+) ([munpf]?)s,', said)
    return int(size[1]), float(step[1]) * PREFIXES[step[2]]


def rows_entered(path, steps):
    """Rows of cost.dat that were entered, with their calls a step."""
    text = path.read_text()
    names = dict(re.findall(r'^AUXDATA phase_(\d+)="(.*)"$', text, re.M))
    table = [line.split() for line in text.splitlines() if re.match(r' *\d', line)]
    return ', '.join(
        f'{names[str(int(float(r[0])))]} {float(r[4]) / steps:.3g}' for r in table if float(r[4]) > 0
    )


def count_scene(counter, programs, name, work):
    """Instructions a particle-step of each program, what the longest run of the first said, and its rows."""
    end = float(re.search(r'end_time=(\S+)', (ROOT / 'input' / f'{name}.nml').read_text())[1].rstrip(','))
    out = work / name
    particles, step = facts(programs[0], shipped_scene(name, out, history=False))
    thin = particles > 1000000 and not counter.perf

    def scene(share):
        text = shipped_scene(name, out, share, history=False)
        return text.replace('particles_per_cell=8', 'particles_per_cell=1') if thin else text

    updates = 2e6 if counter.perf else 4e5  # worth waiting for
    longer = 2 if thin else 1 + max(1, min(20, int(updates / particles)))
    figures, taken = [], set()
    for program in programs:
        runs = []
        for steps in (1, longer):
            said, instructions = counter.run(program, scene((steps - 0.5) * step / end))
            cost = facts_of(out / 'cost.dat')
            runs.append((int(cost['particle_steps']), instructions, int(cost['steps'])))
            if program == programs[0]:
                spoken, rows = said, rows_entered(out / 'cost.dat', int(cost['steps']))
        taken.add((runs[0][2], runs[1][2]))  # where waves become faster, some more than asked for
        figures.append((runs[1][1] - runs[0][1]) / (runs[1][0] - runs[0][0]))
    few, many = taken.pop()
    if taken or not 1 <= few < many:
        raise SystemExit(f'{name}: {few} and {many} steps on one program, {taken} on the other')
    return figures, spoken, rows, f'{many - few}{" *" if thin else ""}'


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('work', type=pathlib.Path)
    parser.add_argument('--only', nargs='+')
    options = parser.parse_args()
    work = options.work.resolve()
    work.mkdir(parents=True, exist_ok=True)
    os.environ.setdefault('OMPI_MCA_ess_singleton_isolated', '1')  # a run without mpirun starts no daemon
    counter = Counter(work)
    full = make(ROOT, counter.build)
    bare = make(bare_tree(work, counter.build), counter.build)
    groups = effect_groups(ROOT / 'src')
    head(
        [
            'scene',
            'effects on (B a particle)',
            'fields [B a particle]',
            'rows entered, calls a step',
            'steps counted',
            'instructions a particle-step',
            'bare build',
            'more [%]',
        ]
    )
    shares = {}
    for name in options.only or sorted(path.stem for path in (ROOT / 'input').glob('*.nml')):
        calls = called_for(name, groups)
        figures, said, rows, steps = count_scene(counter, [full] if calls else [full, bare], name, work)
        effects = re.search(r'^effects +(.*?)(?:; left out: .*)?$', said, re.M)[1].replace(
            ' B a particle', ''
        )
        more = 100 * (figures[0] / figures[1] - 1) if not calls else None
        if more is not None:
            shares[name] = more
        row(
            [
                name,
                effects,
                re.search(r'together (\d+) B', said)[1],
                rows,
                steps,
                f'{figures[0]:.1f}',
                f'{figures[1]:.1f}' if more is not None else '',
                f'{more:.2f}' if more is not None else '',
            ]
        )
    print(
        f'\nOne rank, build {counter.build}, counted by {counter.name}. '
        '* with one particle a cell: eight take the counter too long.'
    )
    wrong = {name: f'{more:.2f} %' for name, more in shares.items() if abs(more) > ALLOWED}
    if wrong:
        raise SystemExit(
            f'FAILED: scenes without effects cost that much more than on the bare build, allowed {ALLOWED} % '
            f'either way: {wrong}'
        )


if __name__ == '__main__':
    main()
