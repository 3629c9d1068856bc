#!/usr/bin/env python3
"""What mode='plan' says of the scenes of input/ beside what they take: the table of doc/user/performance.md,
section "Plans".

usage: plans.py WORK [--ranks N] [--only SCENE ...] [--share SCENE=SHARE ...]

Each scene is planned, run, and planned once more, one after the other on the same ranks: the planned time is
the mean of the two, for machines that are shared change their pace. `--share cone=0.5` cuts its end_time, for
the plan as well as for the run (the table says so). Kept in WORK/plans.json scene by scene, so that the table
can be made in several goes.

`pace` says how fast the machine was: what the kernels of the step (to nodes, to particles, stress) took a
particle-step in the run over what they took in the plans. Where it is not near 1 the machine was doing
something else too, and `at one pace` says how far off the plan is without that."""

import argparse
import json
import pathlib
import re
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]


def scene_text(name, share):
    """A scene of input/, its end_time cut to a share."""
    text = (ROOT / 'input' / f'{name}.nml').read_text()
    if share == 1:
        return text
    return re.sub(r'end_time=([0-9.eE+-]+)', lambda found: f'end_time={float(found[1]) * share:.9g}', text)


def run(ranks, text, folder, *arguments):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / 'scene.nml').write_text(text)
    done = subprocess.run(
        ['mpirun', '-n', str(ranks), str(ROOT / 'gimp3d'), *arguments],
        input=text,
        capture_output=True,
        text=True,
        cwd=folder,
    )
    (folder / 'log').write_text(done.stdout + done.stderr)
    if done.returncode != 0:
        raise SystemExit(f'{folder}: status {done.returncode}: {done.stderr[-500:]}')
    return done.stdout


def kernels(said):
    """Seconds of all ranks a particle-step in the kernels, of which no scene does without and no step has
    more than another."""
    rows = re.findall(r'^(P2G|G2P|stress) +(?:[0-9.]+ +){3}\d+ +([0-9.]+)', said, re.M)
    if len(rows) != 3:
        raise SystemExit(f'no rows of the kernels: {rows}')
    return sum(float(nanoseconds) for _, nanoseconds in rows)


def measure(name, share, ranks, work):
    """Figures of one scene: planned and real time, memory, steps; what the run expected at its beginning."""
    text = scene_text(name, share)
    options = ('--plan', '--json', 'plan.json')
    plan = run(ranks, text, work / 'plan' / name, *options)
    taken = run(ranks, text, work / 'run' / name)
    again = run(ranks, text, work / 'again' / name, *options)
    plans = [json.loads((work / kind / name / 'plan.json').read_text()) for kind in ('plan', 'again')]
    planned = [one['time_s'] for one in plans]
    cost = next((work / 'run' / name / 'out').glob('*/cost.dat')).read_text()
    facts = dict(re.findall(r'^AUXDATA (\w+)="(.*)"', cost, re.M))
    if 'expected_elapsed_s' not in facts:
        raise SystemExit(f'{name}: the run is too short to expect anything of itself')
    return {
        'ranks': ranks,
        'share': share,
        'pace': 2 * kernels(taken) / (kernels(plan) + kernels(again)),
        'planned_s': sum(planned) / 2,
        'plans_s': planned,
        'took_s': float(facts['elapsed_s']),
        'planned_MB': 1e-6 * plans[0]['memory_B'],
        'took_MB': 1e-6 * float(facts['memory_B']),
        'planned_steps': plans[0]['steps'],
        'steps': int(facts['steps']),
        'expected_s': float(facts['expected_elapsed_s']),
        'expected_MB': 1e-6 * float(facts['expected_memory_B']),
    }


def percent(predicted, real):
    return f'{100 * (predicted / real - 1):+.0f}'


def main():
    options = argparse.ArgumentParser()
    options.add_argument('work', type=pathlib.Path)
    options.add_argument('--ranks', type=int, default=1)
    options.add_argument('--only', nargs='*')
    options.add_argument('--share', nargs='*', default=[])
    options = options.parse_args()
    shares = {name: float(share) for name, share in (given.split('=') for given in options.share)}
    kept = options.work / 'plans.json'
    options.work.mkdir(parents=True, exist_ok=True)
    table = json.loads(kept.read_text()) if kept.exists() else {}
    names = sorted(path.stem for path in (ROOT / 'input').glob('*.nml'))
    for name in names if options.only is None else options.only:
        table[name] = measure(name, shares.get(name, 1), options.ranks, options.work.resolve())
        kept.write_text(json.dumps(table, indent=1))
    print(
        '| scene | ranks | steps planned | done | time planned [s] | took [s] | off [%] | pace | off at one '
        'pace [%] | memory planned [MB] | took [MB] | off [%] | a run of its own [s] | off [%] |'
    )
    print('|---' * 14 + '|')
    for name, row in sorted(table.items()):
        title = name if row['share'] == 1 else f"{name}, first {100 * row['share']:g} %"
        print(
            f"| {title} | {row['ranks']} | {row['planned_steps']} | {row['steps']} | {row['planned_s']:.4g} "
            f"| {row['took_s']:.4g} | {percent(row['planned_s'], row['took_s'])} | {row['pace']:.2f} "
            f"| {percent(row['planned_s'] * row['pace'], row['took_s'])} | {row['planned_MB']:.4g} | "
            f"{row['took_MB']:.4g} | {percent(row['planned_MB'], row['took_MB'])} | {row['expected_s']:.4g} "
            f"| {percent(row['expected_s'], row['took_s'])} |"
        )


if __name__ == '__main__':
    main()
