"""&quasi_static preconditioner='gamg': the answers of the diagonal with fewer products, whose number does not
grow with the cells (theory.md, Multigrid). usage: multigrid.py short|long (in an empty directory; GIMP3D is
the program)"""

import sys

from newmark import bar, swing
from static_scenes import check, counts, finish, require, run, tool

PRECONDITIONERS = "jacobi", "gamg"


def ball(
    name,
    preconditioner,
    cell,
    poisson=0.3,
    motion="times=0, speeds=0.5",
    more="",
    law="model='neo_hookean'",
    section=False,
):
    text = (
        f"&scene title='{name}', end_time=0.5 /\n&grid lower=0,0,0, upper=11,11,9, cell_size={cell}, "
        "boundary='symmetry','free','symmetry','free','roller','free' /\n"
        f"&material name='soft', {law}, density=1, young=1, poisson={poisson} /\n"
        "&body material='soft', shape='box', lower=0,0,0, upper=8,8,7 /\n"
        f"&tool name='ball', shape='sphere', radius=5, tip=0,0,7, {motion} /\n&time domain='stretch' /\n"
        f"&quasi_static step=0.25, max_step=0.25, preconditioner='{preconditioner}' /\n{more}"
        f"&output directory='{name}', formats='none' /\n"
    )
    if section:
        text = text.replace("upper=11,11,9", "geometry='axisymmetric', upper=11,9").replace(
            "lower=0,0,0", "lower=0,0", 1
        )
        text = text.replace("'symmetry','free','symmetry','free',", "'symmetry','free',")
    return text


def both(name, ranks=1, **scene):
    """Products a step with the diagonal and with multigrid; the load is the same."""
    products, loads = [], []
    for preconditioner in PRECONDITIONERS:
        log = run(ball(f"{name}_{preconditioner}", preconditioner, **scene), ranks)
        products.append(counts(log)[3])
        loads.append(tool(f"{name}_{preconditioner}", "ball")["load_z"][-1])
    print(f"   {name}: {products[0]} products a step with the diagonal, {products[1]} with multigrid")
    check(
        f"{name}: load with multigrid against that with the diagonal, relative", loads[1] / loads[0] - 1, 1e-5
    )
    return products, loads


def short():
    (coarse, few), loads = both("ball", cell=1)
    (fine, more), _ = both("fine", cell=0.5)
    require("products with the diagonal grow", fine / coarse > 1.35)
    check("products with multigrid grow by", more / few - 1, 0.15)
    (coarse, few), _ = both("ring", cell=0.5, section=True)
    (fine, more), _ = both("fine_ring", cell=0.25, section=True)
    require("in a section: products with the diagonal grow", fine / coarse > 1.35)
    check("in a section: products with multigrid grow by", more / few - 1, 0.25)
    _, on_two = both("two", ranks=2, cell=1)
    check("the same on 2 ranks, relative", on_two[1] / loads[1] - 1, 1e-6)
    (many, less), _ = both("stiff", cell=1, poisson=0.49)
    check("a Poisson's ratio of 0.49: products with multigrid over those with the diagonal", less / many, 0.6)
    both(
        "metal",
        cell=1,
        law="model='j2', yield_stress=0.01, hardening_modulus=0.02",
        more="&anti_locking kind='none' /\n",
    )
    both("rubs", cell=1, motion="times=0, speeds=0.5, friction=0.3")
    both("pushed", cell=1, motion="times=0,0.5, loads=0,0.1, mass=1")
    run(bar("bar", 20, "mode='newmark', preconditioner='gamg'"), 2)
    run(bar("bar_jacobi", 20), 2)
    check("a bar that vibrates: period, relative", swing("bar")[0] / swing("bar_jacobi")[0] - 1, 1e-6)
    text = ball("stalls", "gamg", 1, more="&anti_locking /\n")
    require("refused: anti-locking", "not with preconditioner='gamg'" in run(text, 1, allowed=(2,)))
    words = "gamg does not support &level"
    text = ball("refused", "gamg", 1, more="&level lower=0,0,3, upper=5,5,9 /\n")
    require(f"refused: {words}", words in run(text, 1, allowed=(2,)))


def long():
    """Cells of a quarter, 229 376 particles: products grow by less than half of what they do with the
    diagonal."""
    (coarse, few), _ = both("coarse", cell=1)
    (fine, more), _ = both("quarter", cell=0.25)
    require("products with the diagonal grow", fine / coarse > 2)
    check(
        "growth of products with multigrid over that with the diagonal",
        (more / few - 1) / (fine / coarse - 1),
        0.5,
    )


if __name__ == "__main__":
    if sys.argv[1] == "long":
        long()
    else:
        short()
    finish()
