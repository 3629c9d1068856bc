"""A block that flies and spins through a level: nearly all of its parts merge behind it, mass and momentum
stay, and the run is the same on any number of ranks. usage: merging.py (in an empty directory; GIMP3D is the
program)"""

from run_scene import run
from checks import check, finish, require
from runs import energy, same_bits, vector

SCENE = """&scene title='block through a level', end_time=0.35 /
&grid lower=0,0,0, upper=28,24,20, cell_size=1, boundary=6*'free' /
&time domain='{domain}' /
&level lower=8,6,6, upper=16,16,14 /
&material name='m', model='{model}', density=1, young=1e4, poisson=0.3 /
&body material='m', shape='box', lower=3,3,3.5, upper=7,7,7.5, particles_per_cell=8, velocity=50,40,20,
      angular_velocity={spin} /
&output directory='{name}', formats='hdf5', every=0.35 /
"""


def fly(name, ranks=1, domain="corners", model="neo_hookean", spin="2,3,5"):
    """Particles made by splitting, those made of eight, particles at the end."""
    figures = run(SCENE.format(name=name, domain=domain, model=model, spin=spin), ranks).figures
    return [int(figures[number]) for number in ("splits", "merges", "particles_at_end")]


for domain, model, spin in (
    ("fixed", "elastic", "2,3,5"),
    ("stretch", "elastic", "0,0,0"),
    ("corners", "neo_hookean", "2,3,5"),
):
    split, merged, left = fly(domain, 1, domain, model, spin)
    print(f"   {domain}: {split} made by splitting, {merged} by merging, {left} of 512 at the end")
    require(f"{domain}: nearly all have merged", merged > 440 and left < 900)
    rows = energy(domain)
    check(f"{domain}: mass", rows["mass"] / rows["mass"][0] - 1, 1e-13)
    momentum = vector(rows, "momentum")
    check(f"{domain}: momentum", (momentum - momentum[0]) / momentum[0].max(), 1e-12)
for ranks in (2, 4):
    fly(f"ranks_{ranks}", ranks)
    same_bits("corners", f"ranks_{ranks}")
finish()
