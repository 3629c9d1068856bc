"""Shocks, release and spall in copper (mie_grueneisen, damage) against the Hugoniot curve and the
isentrope."""

import numpy as np

from run_scene import run
from checks import check, finish, require
from runs import energy, snapshots

RHO, C0, S, GAMMA = 8930.0, 3940.0, 1.489, 1.99
LAW = (
    f"&material name='copper', model='mie_grueneisen', density={RHO:g}, sound_speed={C0:g}, "
    f"hugoniot_slope={S}, grueneisen={GAMMA}%s /\n"
)
STRENGTH = ", strength='j2', young=124e9, poisson=0.34, yield_stress=100e6"
CELL = 0.1e-3
GRID = (
    "&grid lower=0,0,0, upper=%g,%g,%%g, cell_size=%g, "
    "boundary='symmetry','symmetry','symmetry','symmetry','%%s','free' /\n"
    "&bulk_viscosity linear=0.3 /\n&time safety=0.3 /\n" % (CELL, CELL, CELL)
)


def hugoniot(speed):
    """Shock speed and pressure behind a shock with this particle speed."""
    return C0 + S * speed, RHO * (C0 + S * speed) * speed


def cold(eta):
    return RHO * C0**2 * eta * (1 - GAMMA * eta / 2) / (1 - S * eta) ** 2 if eta > 0 else RHO * C0**2 * eta


def release_speed(speed):
    """What material gains when it comes from behind a shock to no pressure: the integral of dp/(rho c) along
    the isentrope."""
    shock, pressure = hugoniot(speed)
    eta, e, u, n = speed / shock, speed**2 / 2, 0.0, 20000
    last = pressure
    step = 1.3 * eta / n
    while last > 0:  # de = -p dv = p d(eta)/rho0, then du^2 = dp dv
        new = eta - step
        middle = last
        for _ in range(3):
            p = cold(new) + GAMMA * RHO * (e - 0.5 * (last + middle) * step / RHO)
            middle = p
        e -= 0.5 * (last + p) * step / RHO
        share = min(1.0, last / (last - p))
        u += share * np.sqrt((last - p) * step / RHO)
        last, eta = p, new
    return u


def sorted_snapshot(one):
    order = np.argsort(one.fields["position"][:, 2])
    z = one.fields["position"][order, 2]
    pressure = -one.fields["stress"][order, :3].mean(axis=1)
    return z, pressure, one.fields["velocity"][order, 2]


def front(z, pressure, level):
    """Where the pressure falls through a level, seen from above."""
    first = np.max(np.nonzero(pressure > level)[0])
    last = first + 1
    return z[first] + (z[last] - z[first]) * (pressure[first] - level) / (pressure[first] - pressure[last])


def hits_a_wall(speed, strength=""):
    """A plate that hits a rigid wall: the shock that goes back into it, then its release at the free face."""
    name = f"wall_{speed:g}{'_strength' if strength else ''}"
    length, (shock, pressure) = 8e-3, hugoniot(speed)
    there = length / shock
    run(
        f"&scene title='plate', end_time={1.35 * there!r} /\n"
        + GRID % (11e-3, "symmetry")
        + LAW % strength
        + f"&body material='copper', shape='box', lower=0,0,0, upper={CELL},{CELL},{length}, "
        f"velocity=0,0,{-speed}, particles_per_cell=1 /\n"
        + f"&output directory='{name}', every={0.45 * there!r} /\n",
        1,
    )
    early, late, last = snapshots(name)[1:4]
    fronts = []
    for one in (early, late):
        z, p, _ = sorted_snapshot(one)
        fronts.append(front(z, p, pressure / 2))
    check(
        f"{name}: shock speed over the exact one, less 1",
        ((fronts[1] - fronts[0]) / (late.time - early.time) + speed) / shock - 1,
        0.01,
    )
    z, p, v = sorted_snapshot(late)
    behind = (z > 1.2e-3) & (z < fronts[1] - 1.2e-3)  # the wall's own overshoot stays next to it
    yields = 2 / 3 * 100e6 if strength else 0
    check(f"{name}: Hugoniot pressure, the same", p[behind].mean() / pressure - 1, 0.01)
    check(
        f"{name}: speed behind the shock over that before",
        v[behind].mean() / speed,
        0.003 if not strength else 0.01,
    )
    z, p, v = sorted_snapshot(last)
    free = z > z.max() - 0.8e-3
    gained = release_speed(speed)
    require("release gains more than the shock, a little", speed < gained < 1.04 * speed)
    check(
        f"{name}: speed of the free face over that of the isentrope, less 1",
        (v[free].mean() - yields / (RHO * C0)) / gained - 1,
        0.015,
    )
    check(
        f"{name}: balance of energy over the largest energy",
        np.abs(energy(name)["balance_error"]).max(),
        0.03,
    )


def shock_temperature(speed, start, heat):
    """Behind a shock (K), along the Hugoniot curve: T ds = (eta dp - p d eta)/(2 rho0), dT = Gamma0 T d eta
    + T ds/c."""
    eta = np.linspace(0, speed / hugoniot(speed)[0], 20001)
    p = RHO * C0**2 * eta / (1 - S * eta) ** 2
    middle, change = 0.5 * (eta[1:] + eta[:-1]), np.diff(eta)
    gained = 0.5 * (middle * np.diff(p) - 0.5 * (p[1:] + p[:-1]) * change) / RHO
    temperature = start
    for turn, d_eta in zip(gained, change):
        half = 0.5 * GAMMA * d_eta
        temperature = temperature * (1 + half) / (1 - half) + turn / heat
    return temperature


def heats(speed):
    """A plate with hardly any strength that hits a rigid wall: the temperature behind the shock. That of
    plastic work alone stayed at room temperature."""
    start, heat, length = 294.0, 383.0, 6e-3
    there = length / hugoniot(speed)[0]
    run(
        f"&scene title='hot plate', end_time={0.8 * there!r} /\n"
        + GRID % (9e-3, "symmetry")
        + LAW
        % (
            ", strength='johnson_cook', young=124e9, poisson=0.34, yield_stress=1e3, hardening_modulus=0, "
            f"hardening_exponent=1, rate_coefficient=0, thermal_exponent=1, room_temperature={start}, "
            f"melting_temperature=1356, specific_heat={heat}"
        )
        + f"&body material='copper', shape='box', lower=0,0,0, upper={CELL},{CELL},{length}, "
        f"velocity=0,0,{-speed}, particles_per_cell=1 /\n"
        f"&output directory='hot_{speed:g}' /\n",
        1,
    )
    last = snapshots(f"hot_{speed:g}")[-1]
    z, p, _ = sorted_snapshot(last)
    temperature = last.fields["temperature"].ravel()[np.argsort(last.fields["position"][:, 2])]
    behind = (z > 1.2e-3) & (z < front(z, p, hugoniot(speed)[1] / 2) - 1e-3)
    exact = shock_temperature(speed, start, heat)
    off = temperature[behind].mean() / exact - 1
    check(f"{speed:g} m/s: {exact:.1f} K behind the shock, off", off, 0.03)


def fluid(effect):
    """A cube without strength, pressed slowly to 0.8 of its height: the pressure of the isentrope everywhere.
    With one rate of volume a cell its particles bore 40 to 71 GPa: no shear stress resists what they do
    within a cell."""
    name = f"fluid_{len(effect)}"
    run(
        "&scene title='fluid', end_time=100e-6 /\n"
        "&grid lower=0,0,0, upper=4e-3,4e-3,6e-3, cell_size=1e-3, "
        "boundary='symmetry','symmetry','symmetry','symmetry','symmetry','free' /\n"
        + LAW % ""
        + "&body material='copper', shape='box', lower=0,0,0, upper=4e-3,4e-3,4e-3, particles_per_cell=8 /\n"
        "&tool name='lid', shape='flat', radius=20e-3, tip=0,0,4e-3, times=0, speeds=8 /\n"
        + effect
        + f"&output directory='{name}' /\n",
        1,
    )
    stress = snapshots(name)[-1].fields["stress"]
    eta, e, n = 0.2, 0.0, 20000
    for k in range(n):  # de/d eta = p/rho0
        middle = e + 0.5 * eta / n * (cold(k * eta / n) / RHO + GAMMA * e)
        e += eta / n * (cold((k + 0.5) * eta / n) / RHO + GAMMA * middle)
    exact = cold(eta) + GAMMA * RHO * e
    check(f"{name}: {exact / 1e9:.2f} GPa everywhere, off", -stress[:, :3].mean(axis=1) / exact - 1, 5e-3)


def spall():
    """A plate of 2 mm hits one of 4 mm: their releases meet 2 mm under the free face."""
    limit, flyer = 1.5e9, 100.0
    text = (
        "&scene title='spall', end_time=2.6e-6 /\n"
        + GRID % (9e-3, "free")
        + LAW % ""
        + f"&body material='copper', shape='box', lower=0,0,1e-3, upper={CELL},{CELL},3e-3, "
        f"velocity=0,0,{flyer}, particles_per_cell=1 /\n"
        f"&body material='copper', shape='box', lower=0,0,3e-3, upper={CELL},{CELL},7e-3, "
        "particles_per_cell=1 /\n"
        f"%s&output directory='%s', every=0.1e-6 /\n"
    )
    log = run(text % (f"&damage tension_limit={limit} /\n", "spall"), 1)
    run(text % ("", "whole"), 1)
    held = snapshots("spall")
    failed = held[-1].fields["damage"].ravel() >= 1
    print(f"   failed: {failed.sum()} of {failed.size}")
    require("some particles have failed, not all", 0 < failed.sum() < 0.4 * failed.size)
    require("the summary counts them", f"damage: {failed.sum()} particles have failed" in log)
    tension = [
        max(one.fields["stress"][:, :3].mean(axis=1).max() for one in snapshots(name))
        for name in ("spall", "whole")
    ]
    print(f"   largest tension with and without the limit: {tension[0]:.3g}, {tension[1]:.3g} Pa")
    require("without a limit tension goes far beyond it", tension[1] > 1.1 * limit)
    check("with it tension ends there: largest over the limit, less 1", tension[0] / limit - 1, 0.2)
    # where: by the mass below, from the first snapshot on
    ids, first = held[0].ids, held[0].fields["position"][:, 2]
    where = dict(zip(ids, first))
    broke = np.array([where[i] for i in held[-1].ids[failed] if i in where])
    check("middle of what has failed from 5 mm, mm", 1e3 * np.median(broke) - 5, 0.3)
    stress = held[-1].fields["stress"][failed]
    check("what has failed bears no shear, Pa", np.abs(stress[:, 3:]).max(), 0)
    require("and no tension", (stress[:, :3] <= 0).all())
    rows = energy("spall")
    check("balance of energy over the flyer's", np.abs(rows["balance_error"]).max(), 0.03)
    mass = np.array(rows["mass"])
    check("mass", np.abs(mass / mass[0] - 1).max(), 1e-13)
    check(
        "momentum over the flyer's",
        np.abs(np.array(rows["momentum_z"]) / rows["momentum_z"][0] - 1).max(),
        1e-10,
    )
    v = held[-1].fields["velocity"][:, 2]
    top = held[-1].fields["position"][:, 2]
    # taken out instead: the mass goes, its energy is booked
    log = run(text % (f"&damage tension_limit={limit}, erode=.true. /\n", "eroded"), 1)
    rows = energy("eroded")
    last = snapshots("eroded")[-1]
    share = 1 - last.fields["mass"].sum() / held[0].fields["mass"].sum()
    require("some mass is gone, not much", 0.01 < share < 0.2)
    require("the summary says so", "g of failed material removed" in log)
    check("mass of energy.dat and of the particles", rows["mass"][-1] / rows["mass"][0] - (1 - share), 1e-12)
    require("nothing that has failed is left", last.fields["damage"].max() < 1)
    check("balance of energy over the flyer's", np.abs(rows["balance_error"]).max(), 0.03)
    require("the two parts fly apart", v[top > top.max() - 1e-3].mean() > 1.3 * v[top < 5e-3].mean())


hits_a_wall(500)
hits_a_wall(1000)
hits_a_wall(500, STRENGTH)
heats(500)
heats(1000)
fluid("")
fluid("&anti_locking /\n")
spall()
finish()
