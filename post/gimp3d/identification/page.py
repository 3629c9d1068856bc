"""The HTML page of an identification: curve and fit, parameters, stress-strain curve, identifiability, model
error, command."""

import numpy as np

from .. import report_page as html
from ..report_pictures import picture, plt
from . import forward, words
from .fit import LEVEL, STRAINS

SHOWN = 300  # draws behind a band


def parameters(answer):
    """Of the law: name of each, title, scale and unit."""
    rows = [("modulus", "E*", 1e-9, "GPa"), ("yield_stress", "yield stress", 1e-6, "MPa")]
    rows += [
        (n, title, *scale) for n, title, scale in zip(answer.law.names, answer.law.titles, answer.law.scales)
    ]
    return rows[: len(answer.law.parameters)]


def style(axes, x, y):
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.grid(color="0.9")
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)


def model_curve(features, depth, reference):
    """Depth (m) and load (N) of a curve to a depth from ln C, ln recovery, 1/m, and of a tip with a length
    its loading about the depth `reference` (m)."""
    h = np.linspace(0, depth, 80)
    load = np.exp(features[0]) * h**2
    if len(features) > 3:
        way = np.log(np.maximum(h / reference, 1e-3))
        load *= np.exp((features[3] - 2) * way + features[4] * way**2)
    share = np.linspace(1, 0, 60)
    recovered = forward.full_recovery(np.exp(features[1]), features[2])
    back = depth * (1 - recovered * (1 - share ** features[2]))
    return np.concatenate([h, back]), np.concatenate([load, load[-1] * share])


def curve_picture(problem, answer):
    """Measured curves and the fit with its band, a panel a tip; of derived numbers the fitted curve alone."""
    count = len(problem.observed)
    figure, axes = plt.subplots(1, count, figsize=(5.2 * count, 4.0), layout="constrained", squeeze=False)
    p = np.array([*np.log(answer.best[:2]), *answer.best[2:]])
    rng = np.random.default_rng(1)
    some = answer.draws[rng.choice(len(answer.draws), SHOWN, p=answer.weights)]
    for number, (one, ax) in enumerate(zip(problem.observed, axes[0])):
        depth = one.depth or 1e-6
        reference = one.tip.model(depth)[1]
        curves = [model_curve(f, depth, reference) for f in problem.features(number, some)]
        loads = np.array([load for _, load in curves])
        depths = np.array([h for h, _ in curves])
        edge = [5, 95]
        ax.fill_betweenx(
            1e3 * np.median(loads[:, 80:], axis=0), *(1e9 * np.percentile(depths[:, 80:], edge, axis=0)),
            color="#0b62b8", alpha=0.25, lw=0,
        )  # fmt: skip
        ax.fill_between(
            1e9 * depths[0, :80], *(1e3 * np.percentile(loads[:, :80], edge, axis=0)),
            color="#0b62b8", alpha=0.25, lw=0,
        )  # fmt: skip
        for _, h, load, _ in one.rows:
            ax.plot(1e9 * h, 1e3 * load, ".", color="0.35", ms=2, label="measured")
        h, load = model_curve(problem.features(number, p), depth, reference)
        ax.plot(1e9 * h, 1e3 * load, color="#d0530a", lw=1.2, label="fit")
        ax.set_title(one.tip.title, fontsize=10)
        style(ax, "depth [nm]", "load [mN]")
        handles = dict(zip(*reversed(ax.get_legend_handles_labels())))
        ax.legend(handles.values(), handles.keys(), frameon=False, loc="upper left")
    return picture(
        figure, "curve", "load over depth", "Load over depth: measured, fit, and the fit's 90 % band."
    )


def corner_of(answer):
    """The corner plot of an answer's draws, in the units of the field."""
    draws, law = answer.draws, answer.law
    columns = [np.exp(draws[:, k]) for k in range(2 if law.flows else 1)]
    if law.flows:
        columns += list(law.constants(columns[1], tuple(draws[:, 2:].T)))
    rows = parameters(answer)
    values = np.stack([scale * column for (*_, scale, _), column in zip(rows, columns)], axis=1)
    titles = [title + (f" [{unit}]" if unit else "") for _, title, _, unit in rows]
    return corner_picture(values, answer.weights, titles)


def corner_picture(values, weights, titles):
    """Each parameter's marginal and each pair's cloud, of draws (number, parameter)."""
    rng = np.random.default_rng(2)
    some = values[rng.choice(len(values), 3000, p=weights)]
    size = len(titles)
    figure, axes = plt.subplots(
        size, size, figsize=(1.4 + 2.0 * size, 0.6 + 2.0 * size), layout="constrained", squeeze=False
    )
    for i in range(size):
        for j in range(size):
            ax = axes[i, j]
            if j > i:
                ax.axis("off")
            elif i == j:
                ax.hist(values[:, i], bins=40, weights=weights, color="#4c86c6")
                ax.set_yticks([])
                style(ax, titles[i], "")
            else:
                ax.plot(some[:, j], some[:, i], ".", ms=1.5, alpha=0.3, color="#0b62b8")
                style(ax, titles[j], titles[i])
    return picture(
        figure, "corner", "corner plot", "Marginal and pairwise distributions of the parameters (3000 draws)."
    )


def strain_picture(low, middle, high, best=None):
    """Stress (Pa) over plastic strain at STRAINS with its band; `best`: the strain where it is known best."""
    figure, ax = plt.subplots(figsize=(6.2, 4.0), layout="constrained")
    ax.fill_between(100 * STRAINS, 1e-6 * low, 1e-6 * high, color="#0b62b8", alpha=0.25, lw=0)
    ax.plot(100 * STRAINS, 1e-6 * middle, color="#0b62b8")
    if best is not None:
        ax.axvline(100 * best, color="0.6", lw=0.8, ls="--")
    style(ax, "plastic strain [%]", "stress [MPa]")
    return picture(
        figure, "stress", "stress over plastic strain",
        f"Stress over plastic strain with its {100 * LEVEL:.0f} % band"
        + ("." if best is None else "; dashed line: strain at which it is best determined."),
    )  # fmt: skip


def shown_interval(interval, scale, unit):
    low, middle, high = (scale * value for value in interval)
    return f"{middle:.4g} {unit}".strip(), f"{low:.4g} to {high:.4g} {unit}".strip()


def parameter_rows(answer, poisson, tip_compliance):
    young = [(1 - poisson**2) / (1 / value - tip_compliance) for value in answer.intervals["modulus"]]
    rows = [
        ("E*", *shown_interval(answer.intervals["modulus"], 1e-9, "GPa")),
        (f"E (Poisson's ratio {poisson:g})", *shown_interval(young, 1e-9, "GPa")),
    ]
    if not answer.law.flows:
        return rows
    rows += [
        (title, *shown_interval(answer.intervals[name], scale, unit))
        for name, title, scale, unit in parameters(answer)[1:]
    ]
    rows += [
        ("stress at 3.3 % plastic strain", *shown_interval(answer.intervals["stress_0.033"], 1e-6, "MPa")),
        (
            f"stress at {100 * answer.strain:.2g} % plastic strain (best known)",
            *shown_interval(answer.intervals["stress_best"], 1e-6, "MPa"),
        ),
    ]
    return rows


def write(path, job, problem, answer, said, repeat):
    """The page; `job` has title, poisson, tip_compliance, notes."""
    yielding = "determined" if words.determined(answer) else "not determined"
    what = "yield stress" if answer.law.flows else "E*"
    parts = [
        html.tag("header", html.tag("h1", job.title), html.tag("p", *[html.badge(
            f"{what} {yielding}", "good" if yielding == "determined" else "look")])),
        html.tag(
            "main",
            html.section("answer", "The material", html.table(
                f"Medians and {100 * LEVEL:.0f} % intervals", ["", "value", "interval"],
                parameter_rows(answer, job.poisson, job.tip_compliance)),
                *(html.tag("p", sentence) for sentence in said)),
            html.section("fit", "Curve and fit", html.image(curve_picture(problem, answer))),
            *([html.section("strain", "Stress over strain", html.image(
                  strain_picture(*np.array(answer.band).T, answer.strain)))]
              if answer.law.flows else []),
            html.section("parameters", "Joint distribution of the parameters", html.image(corner_of(answer))),
            html.section("determined", "Identifiability", directions_table(answer)),
            html.section("model", "Error of the model", model_table(problem, answer),
                         *(html.tag("p", note) for note in job.notes)),
            html.section("repeat", "Command", html.tag("pre", repeat)),
        ),
    ]  # fmt: skip
    path.write_text(html.whole(job.title, html.join(parts)))


def directions_table(answer):
    rows = []
    for one in words.directions(answer):
        known = "determined" if one.sigma <= words.DIRECTIONS else "not determined"
        rows.append(
            (words.describe(one, answer.law), f"{1 / one.sigma:.3g}", words.percent(one.sigma), known)
        )
    return html.table(
        "Directions in parameter space, by the singular values of the whitened sensitivities",
        ["direction", "singular value", "standard deviation", ""],
        rows,
    )


def model_table(problem, answer):
    rows, law = [], answer.law
    columns = ("E*", "yield stress", *words.COORDINATES[law.name])[: len(answer.covariance)]
    for name, words_ in (
        ("data", "noise of the data"),
        ("polynomials", "interpolation between the runs"),
        ("cells", "cell size and speed"),
        ("pyramid", "cone for a pyramid"),
    ):
        if name in answer.parts:
            part = answer.parts[name]
            rows.append((words_, *map(words.percent, part[:2]), *(f"{value:.2g}" for value in part[2:])))
    table = html.table("Standard deviation of each parameter, by source", ["source", *columns], rows)
    p = np.array([*np.log(answer.best[:2]), *answer.best[2:]])
    middle = problem.ratio(p), problem.material(p)[2]
    lines = [
        (words.candidate_title(model.tip), str(len(model.cases)),
         *(f"{fit.scatter:.2g}" for fit in model.fits[:3]),
         *(f"{value:.2g}" for value in model.shared(*middle)[:3]))
        for model in problem.surrogates
    ]  # fmt: skip
    return html.join(
        [
            table,
            html.table(
                "The forward model: runs, scatter about the polynomials, uncertainty due to cells and speed",
                [
                    "tip",
                    "runs",
                    "ln C",
                    "ln recovery",
                    "1/m",
                    "ln C, cells",
                    "ln recovery, cells",
                    "1/m, cells",
                ],
                lines,
            ),
        ]
    )
