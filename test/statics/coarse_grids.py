"""&quasi_static preconditioner='bpx' (the default): the answers of the diagonal, with products whose number
does not grow with the cells; on levels, with friction, for nearly incompressible bodies, on 2 ranks
(theory.md, eq. coarse-grids). usage: coarse_grids.py short|long (in an empty directory; GIMP3D is the
program)"""

import sys

from multigrid import ball
from static_scenes import check, counts, finish, require, run, tool


def solve(name, preconditioner, ranks=1, **scene):
    """Products a step and a linear problem, and the load."""
    name = f"{name}_{preconditioner}_{ranks}"
    log = run(ball(name, preconditioner, **scene), ranks)
    _, _, solves, products, _ = counts(log)
    return products, products / solves, tool(name, "ball")["load_z"][-1]


def both(name, ranks=1, **scene):
    """Products a step with the diagonal and with the grids, and a linear problem; the load is the same."""
    many, each_many, expected = solve(name, "jacobi", **scene)
    few, each_few, load = solve(name, "bpx", ranks, **scene)
    print(f"   {name}: {many} products a step with the diagonal, {few} with coarser grids")
    check(f"{name}: load, coarser grids against the diagonal, relative", load / expected - 1, 1e-5)
    return many, few, each_many, each_few


def short():
    many, few, *_ = both("ball", cell=1)
    require(f"ball: fewer products ({few} of {many})", few < 0.85 * many)
    on_two = solve("ball", "bpx", ranks=2, cell=1)[0]
    check("ball: products on 2 ranks against 1, relative", on_two / few - 1, 0.05)
    many, few, *_ = both("levels", ranks=2, cell=1, more="&level lower=0,0,3, upper=5,5,9 /\n")
    require(f"levels: fewer products ({few} of {many})", few < 0.7 * many)
    many, few, *_ = both("stiff", cell=1, poisson=0.49)
    require(f"stiff: fewer products ({few} of {many})", few < 0.6 * many)


def long():
    coarse, fine, finer = (
        both(name, cell=cell)[2:] for name, cell in (("coarse", 1), ("fine", 0.5), ("finer", 0.25))
    )
    require("products a linear problem grow with the diagonal", finer[0] > 1.5 * coarse[0])
    require("they do not with coarser grids, 229 376 particles over 3584", finer[1] < 1.1 * coarse[1])
    check("products at 28 672 particles, over those with the diagonal", fine[1] / fine[0], 0.5)
    check("the same at 229 376", finer[1] / finer[0], 0.33)
    both("rubs", cell=0.5, motion="times=0, speeds=0.5, friction=0.3")
    both("metal", cell=0.5, law="model='j2', yield_stress=0.01, hardening_modulus=0.02")
    both("pushed", cell=1, motion="times=0,0.5, loads=0,0.1, mass=1")


if __name__ == "__main__":
    if sys.argv[1] == "long":
        long()
    else:
        short()
    finish()
