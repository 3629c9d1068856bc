"""post/gimp3d/identify.py: readers, the numbers of a curve, materials that are found again, what is not
determined, bad input. usage: identify.py ROOT GIMP3D"""

import contextlib
import io
import json
import sys
import tomllib
from pathlib import Path

import numpy as np

ROOT, GIMP3D = Path(sys.argv[1]), sys.argv[2]
from gimp3d import identify, instrument_file
from gimp3d.identification import fit, forward, general, measured, observed, surrogate, words
from gimp3d.identification.cache import Cache, key_of
from gimp3d.identification.laws import power_law
from gimp3d.identification.tips import BadTip, Tip, read_tip
from gimp3d.run_data import Unreadable
from page import Page

faults = []


def check(what, holds):
    print(("ok      " if holds else "FAILED  ") + what)
    if not holds:
        faults.append(what)


def curve(features, depth, noise=0.0, seed=0, compliance=0.0, zero=0.0):
    """Depth (m) and load (N) of a conical indentation, with white noise of the load over its largest."""
    h = np.linspace(0, depth, 300)
    load = np.exp(features[0]) * h**2
    share = np.linspace(1, 0, 150)[1:]
    recovered = forward.full_recovery(np.exp(features[1]), features[2])
    h = np.concatenate([h, depth * (1 - recovered * (1 - share ** features[2]))])
    load = np.concatenate([load, load[-1] * share])
    h = h + compliance * load + zero
    return h, load + noise * load.max() * np.random.default_rng(seed).standard_normal(load.size)


def write_csv(path, depth, load):
    rows = "".join(f"{1e9 * h:.4f}, {1e3 * p:.8f}\n" for h, p in zip(depth, load))
    Path(path).write_text("depth [nm], load [mN]\n" + rows)


# ---- readers: one curve in three forms; units; what is refused ----

truth = np.array([np.log(27e9), np.log(0.03), 0.75])
depth, load = curve(truth, 300e-9)
write_csv("a.csv", depth, load)
tool = {"shape": ["cone"], "half_angle": [70.3]}
Path("a.hld").write_text(instrument_file.hld_text(np.arange(depth.size) * 0.1, depth, load, tool, "made up"))
Path("a.txt").write_text(
    "Time_s Disp_nm Force_uN\n"
    + "".join(f"{i} {1e9 * h:.9e} {1e6 * p:.9e}\n" for i, (h, p) in enumerate(zip(depth, load)))
)
for name in ("a.csv", "a.hld", "a.txt"):
    found = measured.read_curve(name)
    check(
        f"{name}: nm and mN or uN as m and N",
        np.allclose(found.depth, depth, atol=1e-12) and np.allclose(found.load, load, atol=1e-8),
    )
Path("numbers.csv").write_text("C [GPa], S [N/m], Wp/Wt, hmax [um]\n27.408, 5146364, 0.9016, 10.407\n")
row = measured.read_curve("numbers.csv")[0]
check(
    "numbers.csv: C, S, Wp/Wt, hmax",
    np.allclose(list(row.values.values()), [27.408e9, 5146364, 0.9016, 10.407e-6]),
)
for text, word in (
    ("depth, load\n1, 2\n", "says no unit"),
    ("depth [inch], load [mN]\n1, 2\n", "unit 'inch'"),
    ("load [mN], time [s]\n" + "1, 2\n" * 30, "needs a column depth"),
    ("depth [nm], load [mN]\n1, x\n2, 3\n", "head"),
    ("depth [nm], load [mN]\n" + "1, nan\n" * 30, "finite"),
    ("", "no rows"),
):
    Path("bad.csv").write_text(text)
    try:
        measured.read_curve("bad.csv")
        check(f"{text[:30]!r} is refused", word == "head")
    except Unreadable as error:
        check(f"{text[:30]!r} is refused: {error}", word in str(error) or word == "head")
for text in ("cone", "cone:10", "sphere:-1", "ball:3", "cone:x"):
    try:
        read_tip(text)
        check(f"TIP={text} is refused", False)
    except BadTip:
        check(f"TIP={text} is refused", True)

# ---- the numbers of a curve: noise, frame, zero; intervals hold the truth as often as they say ----

tip = Tip("cone", 70.3)
inside, count = np.zeros(3), 24
for seed in range(count):
    made = measured.Curve("made", *curve(truth, 300e-9, noise=0.01, seed=seed))
    seen = observed.from_curves(tip, [made])
    inside += np.abs(seen.values - truth) < 1.645 * np.sqrt(np.diag(seen.covariance))
check(f"C, recovery, 1/m within 90 % intervals in {inside} of {count}", np.all(inside >= 0.7 * count))
stiff = np.exp(truth[0]) * 300e-9
for name, given in (("zero", {"zero": 4e-9}), ("compliance", {"compliance": 0.03 / stiff})):
    made = [measured.Curve(str(h), *curve(truth, h, noise=0.001, seed=3, **given)) for h in (300e-9, 600e-9)]
    seen = observed.from_curves(tip, made, [name])
    value, sigma = seen.corrections[name][0]
    wanted = list(given.values())[0]
    check(
        f"{name} found: {value:.3g} +- {sigma:.2g} of {wanted:.3g}",
        abs(value - wanted) < 3 * sigma and sigma < 0.3 * wanted,
    )
    plain = observed.from_curves(tip, made)
    check(
        f"without FREE={name} the numbers are off",
        np.any(np.abs(plain.values - truth) > 5 * np.sqrt(np.diag(plain.covariance))),
    )

# ---- the runs that come with the package: the same today, and the same as finite elements ----

cache = Cache("cache")
built = surrogate.build(cache, [Tip("cone", 70.3), Tip("cone", 60.0)])
models = {tip.half_angle: model for tip, model in built.items()}
check(
    "the shipped runs go by their scenes",
    all(key_of(case) == key for key, (case, _) in zip(cache.records, cache.cases())),
)
check(
    "every case of the design is shipped",
    all(case in cache for angle in models for case in surrogate.design(Tip("cone", angle))),
)
case = forward.Case(Tip("cone", 70.3), 60, 0.12)
shipped = surrogate.features(case, cache[case]["kept"])
again = Cache("anew", shipped=None)
again.run([case], cores=1, program=GIMP3D)
today = surrogate.features(case, again[case]["kept"])
check(f"one of them run again: {today - shipped} apart", np.all(np.abs(today - shipped) < [0.01, 0.04, 0.1]))
elements = tomllib.loads((ROOT / "test/references/indentation.toml").read_text())["cone"]["rows"]
apart = []
for ratio, exponent, curvature, _, work_ratio in elements:
    f = models[70.3].predict(float(ratio), exponent)
    over = np.exp(f[0]) * ratio / surrogate.flow_ratio(ratio, exponent)
    apart.append([over / curvature - 1, np.exp(f[1]) * over / ratio * 3 / (1 - work_ratio) - 1])
apart = np.array(apart)
rms = np.sqrt(np.mean(apart**2, axis=0))
check(
    f"C and elastic work beside {len(apart)} finite-element runs: {100 * rms} % rms",
    rms[0] < 0.025 and rms[1] < 0.06,
)

# ---- materials found again; one cone does not tell yield stress and exponent, two do ----


def problem(young, yielding, exponent, angles, seed=0, swapped=False):
    p = np.array([np.log(young / 0.91), np.log(yielding), exponent])
    covariance = np.diag([0.002, 0.004, 0.01]) ** 2
    rng = np.random.default_rng(seed)
    seen = [
        observed.Observed(Tip("cone", a), ["C", "w", "1/m"], np.zeros(3), covariance, lambda f: f)
        for a in angles
    ]
    one = fit.Problem(seen, [models[a] for a in angles])
    values = one.predict(p)
    if swapped:
        values = np.concatenate([values[3:], values[:3]])
    for number, part in enumerate(seen):
        part.values = values[3 * number : 3 * number + 3] + rng.multivariate_normal(np.zeros(3), covariance)
    return fit.Problem(seen, [models[a] for a in angles])


for young, yielding, exponent in ((70e9, 0.284e9, 0.08), (200e9, 1e9, 0.3)):
    for angles in ((70.3,), (70.3, 60.0)):
        one = problem(young, yielding, exponent, angles)
        answer = one.answer()
        inside = answer.intervals
        stress = power_law(young, yielding, exponent, answer.strain)
        name = f"{young / 1e9:g} GPa, {yielding / 1e6:g} MPa, n {exponent}, {len(angles)} tips"
        holds = [low <= value <= high for (low, _, high), value in (
            (inside["modulus"], young / 0.91),
            (inside["yield_stress"], yielding),
            (inside["exponent"], exponent),
        )]  # fmt: skip
        check(f"{name}: intervals hold the truth {holds}", all(holds))
        check(
            f"{name}: stress at {answer.strain:.3f} within 3 %",
            abs(inside["stress_best"][1] / stress - 1) < 0.03,
        )
        said = " ".join(words.sentences(answer, [Tip("cone", a) for a in angles]))
        if len(angles) == 1:
            check(
                f"{name}: not determined, and said", not words.determined(answer) and "not determined" in said
            )
            best = words.next_experiments(one, answer, lambda tip: models.get(tip.half_angle))[0]
            check(
                f"{name}: a second angle would help most",
                best.tip.half_angle == 60.0 and best.after < 0.5 * best.before,
            )
wrong = problem(70e9, 0.284e9, 0.08, (70.3, 60.0), swapped=True).answer()
check(f"tips taken one for the other do not fit: chi2 {wrong.chi2:.3g}", wrong.chi2 > 30)

# ---- the command, from the shipped runs ----

features = problem(70e9, 0.4e9, 0.1, (70.3,)).values
write_csv("cone.csv", *curve(features, 250e-9, noise=0.01, seed=5))


def command(*words_):
    """Status, what it prints, its sentence."""
    out, err = io.StringIO(), io.StringIO()
    sys.argv = ["gimp3d-post identify", *words_]
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        status = identify.main()
    return status, out.getvalue(), err.getvalue().strip()


status, out, err = command("DATA=cone.csv", "TIP=cone:70.3", "REFINE=no", "OUT=out")
check(f"the command {err}", status == 0 and "Plan: no runs" in out)
answer = json.loads(Path("out/answer.json").read_text())
low, high = (answer["intervals_90"]["stress_best"][k] for k in ("low", "high"))
check(
    "its stress interval holds the truth",
    low <= power_law(70e9, 0.4e9, 0.1, answer["strain_known_best"]) <= high,
)
found = Page("out/identification.html")
check(f"its page: {found.faults}", not found.faults and sum(tag == "img" for tag, *_ in found.elements) == 3)
for words_, part in (
    (["DATA=cone.csv"], "needs a TIP"),
    (["DATA=none.csv", "TIP=berkovich"], "none.csv"),
    (["DATA=cone.csv", "TIP=spoon"], "allowed are"),
    (["DATA=cone.csv", "TIP=sphere:1e-6"], "general form"),
    (["DATA=cone.csv", "TIP=cone:70.3", "FREE=luck"], "allowed are zero"),
    (["TIP=berkovich"], "stands behind its DATA"),
    (["DATE=cone.csv"], "the keys are"),
    (["DATA=cone.csv", "TIP=cone:70.3", "FIX=colour=3"], "allowed are young"),
):
    status, _, err = command(*words_, "OUT=none")
    one_line = len(err.splitlines()) == 1
    check(
        f"{' '.join(words_)}: {err[:90]}",
        status == 2 and part in err and one_line and not Path("none").exists(),
    )

# ---- the general form: rounds on a made-up model, and on a scene ----


class MadeUp:
    """y = a exp(-b t), of which `bias` is what CHECK changes."""

    def __init__(self, words_, formula, bias=0.0):
        self.parameters, self.formula, self.bias = general.read_parameters(words_), formula, bias
        time = np.linspace(0, 3, 40)
        values = formula(time, *TRUE) + 0.01 * np.random.default_rng(4).standard_normal(40)
        self.experiments = [general.Experiment("", "made up", [], time, [values], [0.01])]

    def curves(self, points, changes=()):
        time = self.experiments[0].over
        numbers = [[p.outer(v) for p, v in zip(self.parameters, x)] for x in points]
        return [self.formula(time, *n) * (1 + (self.bias if changes else 0)) for n in numbers]


TRUE = (2.0, 0.7)
quiet = lambda *words_, **options: None
falls = lambda t, a, b: a * np.exp(-b * t)
model = MadeUp("a=0.5:5,b=0.1:3", falls)
found = general.fit(model, say=quiet)
apart = np.abs(found.x - np.log(TRUE)) / np.sqrt(np.diag(found.covariance))
check(
    f"a exp(-b t): {np.exp(found.x)}, {apart} sigmas off",
    np.all(apart < 3) and np.all(np.diag(found.covariance) < 1e-3),
)
said = " ".join(general.sentences(model, found))
check("no CHECK: that is said", "model's own error is not" in said)
biased = general.fit(
    MadeUp("a=0.5:5,b=0.1:3", falls, bias=0.05), changes=[("grid", None, "cell_size", 1.0)], say=quiet
)
check("CHECK that changes all by 5 % is 5 % of a", abs(np.sqrt(biased.model[0, 0]) - 0.05) < 0.005)
product = MadeUp("a=0.5:5,b=0.1:3", lambda t, a, b: a * b * t)
said = " ".join(general.sentences(product, general.fit(product, say=quiet)))
check("a b t: a and b are not told apart, and that is said", "Not determined: a with b" in said)
for law, numbers in (
    ("ludwik", {"hardening_factor": 4e8, "hardening_exponent": 0.4}),
    ("voce", {"hardening_rise": 4e8, "hardening_rate": 12.0}),
):
    values = {"young": 2e11, "yield_stress": 3e8, **numbers}
    text = general.filled("&material @hardening@ /", values, law)
    strain, stress = (
        np.array(part.split("=")[1].strip(", /\n").split(","), float)
        for part in text.replace("&material ", "").split("\n")
    )
    wanted = {"ludwik": 3e8 + 4e8 * strain**0.4, "voce": 3e8 + 4e8 * (1 - np.exp(-12 * strain))}[law]
    check(
        f"@hardening@ of {law}",
        np.allclose(stress, wanted, rtol=1e-6) and strain[0] == 0 and np.all(np.diff(strain) > 0),
    )
x = np.linspace(0, 1, 2001)
ripple = x**2 + 0.1 * np.random.default_rng(5).standard_normal(2001)
places = np.linspace(0.1, 0.9, 40)
mean = np.std(general.at_places(places, x, ripple) - places**2)
check(f"a rippled history: {mean:.3f} off, single rows 0.1", mean < 0.03)
check(
    "few rows: between them",
    np.allclose(
        general.at_places(places, x[::100], (x**2)[::100]), np.interp(places, x[::100], (x**2)[::100])
    ),
)
for words_, part in (("a=1", "LOW:HIGH"), ("a=3:1", "LOW:HIGH"), ("", "no NAME")):
    try:
        general.read_parameters(words_)
        check(f"PARAMETERS={words_} is refused", False)
    except Unreadable as error:
        check(f"PARAMETERS={words_} is refused: {error}", part in str(error))
here = ROOT / "input/identification"
given = [
    f"SCENE={here}/relaxation.nml", f"DATA={here}/relaxation.csv", f"PROGRAM={GIMP3D}", "ROUNDS=1",
    "OUT=relaxation",
    "COLUMNS=tool_ball.time:time,tool_ball.load_z:load", "CORES=1",
]  # fmt: skip
status, out, err = command(*given, "PARAMETERS=young=2e9:4e9", "FIX=g1=0.3,g2=0.4,t1=1,t2=20")
check(f"a scene {err}", status == 0 and "Plan: 3 runs in 1 rounds" in out)
young = json.loads(Path("relaxation/answer.json").read_text())["parameters"]["young"]
check(f"its modulus: {young / 1e9:.3f} GPa of 3", abs(young / 3e9 - 1) < 0.03)
check(
    f"its page: {Page('relaxation/identification.html').faults}",
    not Page("relaxation/identification.html").faults,
)
for words_, part in (
    (["PARAMETERS=young=2e9:4e9"], "@t1@"),
    (["PARAMETERS=young=2e9:4e9", "FIX=g1=0.3,g2=0.4,t1=1,t2=zwanzig"], "FIX"),
    (
        ["PARAMETERS=young=2e9:4e9", "FIX=g1=0.3,g2=0.4,t1=1,t2=20", "CHECK=grid.cell_size=0.7e-6"],
        "cell_size",
    ),
):
    status, _, err = command(*given, *words_)
    check(f"{' '.join(words_)}: {err[:80]}", status == 2 and part in err and len(err.splitlines()) == 1)

sys.exit(f"{len(faults)} failed" if faults else 0)
