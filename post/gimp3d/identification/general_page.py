"""The HTML page of the general form: measured columns and fit with its band, parameters, stress-strain curve
if a hardening law is fitted."""

import numpy as np

from .. import report_page as html
from ..report_pictures import picture, plt
from .fit import STRAINS
from .laws import LAWS
from .page import corner_picture, strain_picture, style

DRAWS = 4000
LEVELS = [5, 50, 95]


def draws_of(model, found):
    """Draws of the parameters from their covariance, as they are in the scenes."""
    whole = found.covariance + found.model
    inner = np.random.default_rng(3).multivariate_normal(found.x, whole, DRAWS, check_valid="ignore")
    return np.stack([p.outer(column) for p, column in zip(model.parameters, inner.T)], axis=1)


def strain_section(model, draws):
    """Stress over plastic strain of the law that @hardening@ stands for; nothing where no scene has it."""
    if not any("@hardening@" in experiment.text for experiment in model.experiments):
        return []
    function, names = LAWS[model.law]
    columns = {p.name: draws[:, k] for k, p in enumerate(model.parameters)} | model.fixed
    given = [np.broadcast_to(columns[name], DRAWS) for name in names]
    band = np.array([np.percentile(function(*given, strain), LEVELS) for strain in STRAINS])
    return [html.section("strain", "Stress over strain", html.image(strain_picture(*band.T)))]


def write(path, model, found, said, repeat):
    whole = found.covariance + found.model
    deviation = np.sqrt(np.diag(whole))
    pictures, at = [], 0
    for number, experiment in enumerate(model.experiments):
        count = len(experiment.values)
        figure, axes = plt.subplots(1, count, figsize=(5.4 * count, 3.8), layout="constrained", squeeze=False)
        for ax, value, title in zip(axes[0], experiment.values, experiment.titles[1:]):
            rows = slice(at, at + len(value))
            at += len(value)
            half = 1.645 * np.sqrt(np.einsum("ij,jk,ik->i", found.slope[rows], whole, found.slope[rows]))
            order = np.argsort(experiment.over)
            over, fitted = experiment.over[order], found.fitted[rows][order]
            ax.plot(experiment.over, value, ".", color="0.35", ms=3, label="measured")
            ax.fill_between(
                over, fitted - half[order], fitted + half[order], color="#0b62b8", alpha=0.25, lw=0
            )
            ax.plot(over, fitted, color="#d0530a", lw=1.2, label="fit")
            style(ax, experiment.titles[0] + " (SI)", title + " (SI)")
            ax.legend(frameon=False)
        caption = f"{experiment.name}: measured, fit, and the fit's 90 % band"
        pictures.append(html.image(picture(figure, f"curve{number}", experiment.name, caption)))
    rows = []
    for k, parameter in enumerate(model.parameters):
        low, middle, high = (parameter.outer(found.x[k] + 1.645 * s * deviation[k]) for s in (-1, 0, 1))
        rows.append((
            parameter.name, f"{middle:.5g}", f"{low:.5g} to {high:.5g}",
            f"{np.sqrt(found.covariance[k, k]):.2g}", f"{np.sqrt(found.model[k, k]):.2g}",
        ))  # fmt: skip
    names, draws = [p.name for p in model.parameters], draws_of(model, found)
    correlations = whole / np.outer(deviation, deviation)
    title = "Parameters of " + ", ".join(e.name for e in model.experiments)
    parts = [
        html.tag("header", html.tag("h1", title)),
        html.tag(
            "main",
            html.section("answer", "The parameters", html.table(
                "Values, 90 % intervals, and standard deviations (of logarithms if the range is above 0)",
                ["", "value", "interval", "from the data", "from the model (CHECK)"], rows),
                *(html.tag("p", sentence) for sentence in said)),
            html.section("fit", "Curves and fit", *pictures),
            *strain_section(model, draws),
            html.section(
                "together", "Joint distribution of the parameters",
                html.image(corner_picture(draws, np.full(DRAWS, 1 / DRAWS), names)),
                html.table("Correlation of the parameters", ["", *names],
                           [(name, *(f"{c:.2f}" for c in row)) for name, row in zip(names, correlations)])),
            html.section("repeat", "Command", html.tag("pre", repeat)),
        ),
    ]  # fmt: skip
    path.write_text(html.whole(title, html.join(parts)))
