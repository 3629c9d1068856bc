"""The page of the general form: measured columns and fit, parameters, what is determined."""

import numpy as np

from .. import report_page as html
from ..report_pictures import picture, plt
from .page import style


def write(path, model, found, said, repeat):
    pictures, at = [], 0
    for number, experiment in enumerate(model.experiments):
        count = len(experiment.values)
        figure, axes = plt.subplots(1, count, figsize=(5.4 * count, 3.8), layout="constrained", squeeze=False)
        for ax, value, title in zip(axes[0], experiment.values, experiment.titles[1:]):
            rows = slice(at, at + len(value))
            at += len(value)
            ax.plot(experiment.over, value, ".", color="0.35", ms=3, label="measured")
            ax.plot(experiment.over, found.fitted[rows], color="#d0530a", lw=1.2, label="fit")
            style(ax, experiment.titles[0] + " (SI)", title + " (SI)")
            ax.legend(frameon=False)
        pictures.append(
            html.image(
                picture(figure, f"curve{number}", experiment.name, f"{experiment.name}: measured and fit")
            )
        )
    whole = found.covariance + found.model
    deviation = np.sqrt(np.diag(whole))
    rows = []
    for k, parameter in enumerate(model.parameters):
        low, middle, high = (parameter.outer(found.x[k] + 1.645 * s * deviation[k]) for s in (-1, 0, 1))
        rows.append((
            parameter.name, f"{middle:.5g}", f"{low:.5g} to {high:.5g}",
            f"{np.sqrt(found.covariance[k, k]):.2g}", f"{np.sqrt(found.model[k, k]):.2g}",
        ))  # fmt: skip
    names = [p.name for p in model.parameters]
    correlations = whole / np.outer(deviation, deviation)
    title = "Parameters of " + ", ".join(e.name for e in model.experiments)
    parts = [
        html.tag("header", html.tag("h1", title)),
        html.tag(
            "main",
            html.section("answer", "The parameters", html.table(
                "Values, 90 % intervals, and one sigma (of logarithms where the range is above 0)",
                ["", "value", "interval", "from the data", "from the model (CHECK)"], rows),
                *(html.tag("p", sentence) for sentence in said)),
            html.section("fit", "Curves and fit", *pictures),
            html.section("together", "Correlations", html.table(
                "Correlation of the parameters", ["", *names],
                [(name, *(f"{c:.2f}" for c in row)) for name, row in zip(names, correlations)])),
            html.section("repeat", "How to repeat it", html.tag("pre", repeat)),
        ),
    ]  # fmt: skip
    path.write_text(html.whole(title, html.join(parts)))
