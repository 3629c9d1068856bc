#!/usr/bin/env python3
"""Write what a run would, from half-space theory, for the tests of the pictures:

   fabricate_run.py DIRECTORY sphere|cone|flat SHARE [levels]

SHARE (1, 0.5, 0.25) is the modelled part of the body. The tool starts 50 nm above the surface; its load
follows the theory for the modelled part, exactly. With `levels` the particle files hold the boxes of three.
"""

import math
import sys
from pathlib import Path

import h5py
import numpy as np

young, poisson, top, gap = 70e9, 0.33, 20e-6, 50e-9
tools = {
    "sphere": ("radius=1.0e-05", lambda e, d: 4 / 3 * e * math.sqrt(10e-6) * d**1.5),
    "cone": ("half_angle=70.3", lambda e, d: 2 / math.pi * e * math.tan(math.radians(70.3)) * d**2),
    "flat": ("radius=2.0E-06", lambda e, d: 2 * 2e-6 * e * d),
}


def dat(path, columns, rows, note='model="part"'):
    names = " ".join(f'"{name}"' for name in columns)
    path.write_text(
        f'TITLE = "fabricated"\nVARIABLES = {names}\n'
        'ZONE T="history", STRANDID=1, SOLUTIONTIME=0\n'
        f'AUXDATA {note}\n' + "".join(" ".join(f"{value:.10e}" for value in row) + "\n" for row in rows)
    )


def main():
    directory, shape, share = Path(sys.argv[1]), sys.argv[2], float(sys.argv[3])
    directory.mkdir(parents=True, exist_ok=True)
    extent, load_of = tools[shape]
    low = {1.0: (-20e-6, -20e-6), 0.5: (0.0, -20e-6), 0.25: (0.0, 0.0)}[share]
    sides = ["symmetry" if x == 0 else "free" for x in low]
    (directory / "case.nml").write_text(f"""! all values used
&scene
  title = 'fabricated {shape}, it''s theory / no run', end_time = 1.0e-6
/
&grid lower={low[0]},{low[1]},0 upper=20e-6, 20e-6, 24d-6, cell_size=0.5e-6,
  boundary='{sides[0]}','free','{sides[1]}','free','roller','free' /
&MATERIAL name='other', model='elastic', density=1., young=1., poisson=0. /
&material name='aluminium', model='elastic', density=2710, young={young}, poisson={poisson} /   ! the one
&body material='aluminium', shape='cylinder', center=2*0.0,0, axis=0,0,1, radius=20e-6, height={top}, particles_per_cell=8 /
&tool name='tip', shape='{shape}', {extent}, tip=0,0,{top + gap}, axis=0,0,-1, times=0,1, speeds=1,1 /
""")
    modulus = young / (1 - poisson**2)
    time = np.linspace(0, 1e-6, 201)
    depth = 0.55 * time
    load = share * load_of(modulus, np.maximum(depth - gap, 0))
    area = share * math.pi * 10e-6 * np.maximum(depth - gap, 0)
    dat(
        directory / "tool_tip.dat",
        [
            "time [s]",
            "depth [m]",
            "load_x [N]",
            "load_y [N]",
            "load_z [N]",
            "contact_area [m2]",
            "max_gap_violation [m]",
        ],
        np.c_[time, depth, 0 * load, 0 * load, load, area, 0 * load],
        f'model_share="{share}"',
    )
    work = np.cumsum(np.r_[0, np.diff(depth) * load[1:]])
    dat(
        directory / "energy.dat",
        [
            "time [s]",
            "kinetic [J]",
            "strain [J]",
            "plastic [J]",
            "external_work [J]",
            "balance_error [1]",
            "momentum_z [kg m/s]",
            "mass [kg]",
        ],
        np.c_[time, 0.005 * work, 0.99 * work, 0 * work, work, 0.005 + 0 * work, 0 * work, 1 + 0 * work],
    )
    spacing = 0.25e-6
    axes = [
        np.arange(low[0] + spacing / 2, 20e-6, spacing),
        np.arange(low[1] + spacing / 2, 20e-6, spacing),
        np.arange(spacing / 2, top, spacing),
    ]
    axes[1] = axes[1][np.abs(axes[1]) < 2e-6]  # the section needs no more
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    points = points[np.hypot(points[:, 0], points[:, 1]) < 20e-6]
    # Boussinesq's stress under a force, softened by the contact radius
    r, z = np.hypot(points[:, 0], points[:, 1]), top - points[:, 2] + 2e-6
    decay = load[-1] / share / (2 * math.pi * (r**2 + z**2) ** 2.5)
    stress = np.zeros((len(points), 6))
    stress[:, 2], stress[:, 4] = -3 * z**3 * decay, -3 * points[:, 0] * z**2 * decay
    for step in (0, 900, 1000):
        with h5py.File(directory / f"particles_{step:08d}.hdf", "w") as file:
            file.attrs["time"] = time[-1] * step / 1000
            group = file.create_group("VTKHDF")
            group["Points"] = points
            data = {
                "id": np.arange(len(points)),
                "half_size": np.full((len(points), 1), spacing / 2),
                "stress": stress * step / 1000,
            }
            for name, values in data.items():
                group[f"PointData/{name}"] = values
            if sys.argv[4:] == ["levels"]:
                group["FieldData/level_lower"] = [[*low, 0], [low[0], low[1], 10e-6], [low[0], low[1], 16e-6]]
                group["FieldData/level_upper"] = [
                    [20e-6, 20e-6, 24e-6],
                    [10e-6, 10e-6, 24e-6],
                    [4e-6, 4e-6, 24e-6],
                ]
                group["FieldData/level_cell"] = [0.5e-6, 0.25e-6, 0.125e-6]


main()
