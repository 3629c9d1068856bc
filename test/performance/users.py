"""Scenes as users run them, timed beside an earlier program: user time of the processor, in turn, so that a
busy machine slows both alike. bench.py makes a table of it (`make bench BENCH=before BEFORE=...`)."""

import math
import pathlib
import re
import resource
import statistics
import struct
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]

METAL = "model='j2', density=2700, young=70e9, poisson=0.33, yield_stress=200e6, hardening_modulus=500e6"
RUBBER = "model='neo_hookean', density=2700, young=70e9, poisson=0.33"
STEP = 3.19e-12  # s, as of the block scenes


def block(cells, material, motion, steps, output=''):
    """A cube of 64 nm cells with all defaults of its law: against a wall at a tenth of the wave speed
    (flowing), or tumbling, its edges at a tenth of the wave speed."""
    h, margin = 64e-9, 8
    n = (cells + 2 * margin + 7) // 8 * 8
    low = 0 if motion == 'flowing' else margin
    side = (
        "'free','free','free','free','symmetry','free'" if motion == 'flowing' else ','.join(["'free'"] * 6)
    )
    spin = 4e8 * 32 / cells
    moves = {'flowing': 'velocity=0,0,-600', 'tumbling': f'angular_velocity={spin / 2},{spin / 4},{spin}'}[
        motion
    ]
    return f"""&scene title='block', end_time={steps * STEP!r} /
&grid lower=0,0,0, upper={n * h!r},{n * h!r},{n * h!r}, cell_size={h!r},
      boundary={side} /
&time time_step={STEP!r} /
&material name='m', {material} /
&body material='m', shape='box', lower={margin * h!r},{margin * h!r},{low * h!r},
      upper={(margin + cells) * h!r},{(margin + cells) * h!r},{(low + cells) * h!r}, particles_per_cell=8,
      {moves} /
&output directory='OUT', {output or "formats='none', history_every=1"} /
"""


def bar(length, steps):
    """A bar of 16 x 16 cells at rest, all defaults of a plastic law, that a plate hits at its end."""
    h = 64e-9
    return f"""&scene title='bar', end_time={steps * STEP!r} /
&grid lower=0,0,0, upper={32 * h!r},{32 * h!r},{(length + 24) * h!r}, cell_size={h!r} /
&time time_step={STEP!r} /
&material name='m', {METAL} /
&body material='m', shape='box', lower={8 * h!r},{8 * h!r},{8 * h!r},
      upper={24 * h!r},{24 * h!r},{(8 + length) * h!r} /
&body material='m', shape='box', lower={8 * h!r},{8 * h!r},{(9 + length) * h!r},
      upper={24 * h!r},{24 * h!r},{(11 + length) * h!r}, velocity=0,0,-600 /
&output directory='OUT', formats='none', history_every=1 /
"""


def cone_file(path, triangles, half_angle=70.3, height=3e-6):
    """A closed cone as binary STL, its tip at the origin, looking down: so many triangles, about."""
    around = max(8, round(math.sqrt(triangles * 2) / 1.4))
    rings = max(1, round((triangles / around - 1) / 2))
    turn = [2 * math.pi * i / around for i in range(around)]
    # the sides of the polygon touch the cone on average
    wide = math.tan(math.radians(half_angle)) / math.sqrt(
        math.sin(2 * math.pi / around) * around / 2 / math.pi
    )

    def at(ring, i):
        z = height * ring / rings
        return (wide * z * math.cos(turn[i % around]), wide * z * math.sin(turn[i % around]), z)

    found = []
    for i in range(around):
        found.append((at(0, 0), at(1, i + 1), at(1, i)))
        for ring in range(1, rings):
            a, b, c, d = at(ring, i), at(ring, i + 1), at(ring + 1, i), at(ring + 1, i + 1)
            found += [(a, d, c), (a, b, d)]
        found.append((at(rings, i), at(rings, i + 1), (0.0, 0.0, height)))
    with open(path, 'wb') as file:
        file.write(bytes(80) + struct.pack('<I', len(found)))
        for corners in found:
            file.write(struct.pack('<12fH', 0, 0, 0, *(x for corner in corners for x in corner), 0))
    return len(found)


def tip(levels, shape, share=1.0):
    """A tip that is 60 nm deep from the start pressed on into metal, on one grid or three nested levels."""
    h = 0.06e-6 * 2 ** (levels - 1)
    size = {1: (0.96e-6, 0.96e-6), 3: (1.92e-6, 1.92e-6)}[levels]
    nested = {
        1: '',
        3: '&level lower=0,0,1.2e-6, upper=0.96e-6,0.96e-6,2.4e-6 /\n'
        '&level lower=0,0,1.56e-6, upper=0.72e-6,0.72e-6,2.16e-6 /\n',
    }[levels]
    wide, high = size
    return f"""&scene title='tip', end_time={share * 6e-9!r} /
&grid lower=0,0,0, upper={wide!r},{wide!r},{high + 0.48e-6!r}, cell_size={h!r},
      boundary='symmetry','free','symmetry','free','roller','free' /
{nested}&material name='m', model='j2', density=2700, young=70e9, poisson=0.3, yield_stress=700e6 /
&body material='m', shape='box', lower=0,0,0, upper={wide!r},{wide!r},{high!r}, particles_per_cell=8 /
&tool name='tip', {shape}, tip=0,0,{high!r}, times=0, speeds=25, penetration_factor=0.5 /
&output directory='OUT', formats='none' /
"""


def shipped(name, share):
    text = (ROOT / 'input' / f'{name}.nml').read_text()
    text = re.sub(r'end_time=([\d.eE+-]+)', lambda m: f'end_time={float(m[1]) * share!r}', text)
    return re.sub(r"directory='[^']*'", "directory='OUT', formats='none'", text)


def scenes():
    """Name, and the scene."""
    rows = f"formats='none', history_every={STEP!r}"
    return {
        'j2 block, flowing': block(24, METAL, 'flowing', 120),
        'j2 block, tumbling': block(24, METAL, 'tumbling', 120),
        'neo-Hookean block, tumbling': block(24, RUBBER, 'tumbling', 120),
        'j2 bar, four fifths at rest': bar(240, 40),
        'j2 block, flowing, a row a step': block(24, METAL, 'flowing', 120, rows),
        'nested cone in metal, before contact': nested_cone(0.01),
        'nested cone in metal, to 4 % of its way': nested_cone(0.04),
        'tip of 4224 triangles, three levels': tip(3, "shape='surface', file='TIP'", 0.25),
        '`slide.nml`, half': shipped('slide', 0.5),
        '`spheres.nml`, half': shipped('spheres', 0.5),
        '`crystal.nml`, a twentieth': shipped('crystal', 0.05),
        '`polycrystal.nml`, half': shipped('polycrystal', 0.5),
        '`static_cone.nml`, a third': shipped('static_cone', 0.33),
    }


def nested_block(levels, cells):
    """A metal block that flows as it hits a wall, `cells` cells an edge on each of its levels."""
    h = 64e-9
    side = cells * h
    boxes = ''.join(
        f'&level lower=0,0,0, upper={side / 2**n!r},{side / 2**n!r},{side / 2**n!r} /\n'
        for n in range(1, levels)
    )
    wide = (cells + 15) // 8 * 8 * h
    edges = "'symmetry','free','symmetry','free','symmetry','free'"
    return f"""&scene title='nested block', end_time={8 * STEP * 2 ** (levels > 1)!r} /
&grid lower=0,0,0, upper={wide!r},{wide!r},{wide!r}, cell_size={h!r}, boundary={edges} /
{boxes}&material name='m', {METAL} /
&body material='m', shape='box', lower=0,0,0, upper={side!r},{side!r},{side!r}, particles_per_cell=8,
      velocity=0,0,-600 /
&output directory='OUT', formats='none', history_every=1 /
"""


def nested_cone(share):
    """A cone into a plastic block on four levels."""
    return f"""&scene title='nested cone', end_time={80e-9 * share!r} /
&grid lower=0,0,0, upper=11.52e-6,11.52e-6,13.44e-6, cell_size=0.48e-6,
      boundary='symmetry','free','symmetry','free','roller','free' /
&level lower=0,0,7.2e-6, upper=4.8e-6,4.8e-6,13.44e-6 /
&level lower=0,0,9.12e-6, upper=2.4e-6,2.4e-6,12.48e-6 /
&level lower=0,0,10.32e-6, upper=1.2e-6,1.2e-6,12.0e-6 /
&material name='m', model='j2', density=2700, young=10e9, poisson=0.3, yield_stress=100e6 /
&body material='m', shape='box', lower=0,0,0, upper=11.52e-6,11.52e-6,11.52e-6, particles_per_cell=8 /
&tool name='cone', shape='cone', half_angle=70.3, tip=0,0,11.52e-6, times=0,2e-9,49e-9,
      speeds=0,4.1667,4.1667, penetration_factor=0.5 /
&output directory='OUT', formats='none' /
"""


def user_time(program, scene, out, read=None):
    """Seconds of user time that a run on one rank takes; and what a function reads of what it says."""
    out.mkdir(parents=True, exist_ok=True)
    if "'TIP'" in scene:
        cone_file(out / 'tip.stl', 4224)
        scene = scene.replace('TIP', str(out / 'tip.stl'))
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(
        [program], input=scene.replace('OUT', str(out)), capture_output=True, text=True, cwd=out
    )
    if done.returncode != 0:
        raise SystemExit(
            f'a run ended with status {done.returncode}:\n{done.stdout[-800:]}{done.stderr[-800:]}'
        )
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    return (seconds, read(done.stdout)) if read else seconds


def in_turn(runs, repeats):
    """Medians of the user times of several runs (functions), one after the other, round after round; and the
    median of the first over each."""
    rounds = [[run() for run in runs] for _ in range(repeats)]
    times = list(zip(*rounds))
    return [statistics.median(t) for t in times], [
        statistics.median(a / b for a, b in zip(times[0], t)) for t in times
    ]
