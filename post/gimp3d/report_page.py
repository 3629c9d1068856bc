"""Pieces of a page: every text that goes in is escaped here; the page needs nothing from outside itself."""

import html
import json
from pathlib import Path

import numpy as np

from . import plots

here = Path(__file__).resolve().parent

# Nothing may be loaded: what would come from a network is refused by the browser too.
policy = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'"


def si(value, unit, digits=4, error=None):
    """With the prefix that suits, areas with that of a length: 13.2 um2; with an uncertainty: 13.2 +- 0.4
    um2."""
    if not np.isfinite(value):
        return f"{value}"
    most = max(abs(value), abs(error or 0.0))
    if unit == "m2":
        factor, name = plots.scaled("m", [np.sqrt(most)])
        factor, name = factor**2, f"{name}\N{SUPERSCRIPT TWO}"
    elif unit in ("m", "s", "Pa", "N", "J", "m/s", "N/m", "B"):
        factor, name = plots.scaled(unit, [most])
    else:
        factor, name = 1.0, "" if unit == "1" else unit
    number = f"{value / factor:.{digits}g}"
    if error is not None:
        number += f" \N{PLUS-MINUS SIGN} {error / factor:.2g}"
    return f"{number} {name}".rstrip()


class Markup(str):
    """Text that is HTML already."""


def text(value):
    """Anything as HTML: a Markup as it is, else escaped."""
    return value if isinstance(value, Markup) else Markup(html.escape(str(value), quote=True))


def tag(name, /, *content, **attributes):
    """An element; `class_` and `data_label` stand for class and data-label."""
    words = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{text(value)}"'
        for key, value in attributes.items()
        if value is not None
    )
    inside = "".join(text(part) for part in content)
    return Markup(
        f"<{name}{words}>" if name in ("img", "meta", "link") else f"<{name}{words}>{inside}</{name}>"
    )


def join(parts, between=""):
    return Markup(text(between).join(text(part) for part in parts))


def section(name, heading, *content):
    return tag("section", tag("h2", heading), *content, id=name)


def badge(words, kind):
    """kind: good, look, bad or info."""
    return tag("span", words, class_=f"badge {kind}")


def table(caption, columns, rows, **attributes):
    """columns: titles, or (title, class); rows: cells, the first a heading; a cell is a text or Markup."""
    columns = [column if isinstance(column, tuple) else (column, None) for column in columns]
    head = tag("tr", *(tag("th", title, scope="col", class_=kind) for title, kind in columns))
    body = [
        tag(
            "tr",
            tag("th", row[0], scope="row"),
            *(
                tag("td", cell, class_=kind, data_label=title)
                for cell, (title, kind) in zip(row[1:], columns[1:])
            ),
        )
        for row in rows
    ]
    return tag(
        "div",
        tag("table", tag("caption", caption), tag("thead", head), tag("tbody", *body), **attributes),
        class_="wide",
    )


def image(picture):
    """A picture with its caption."""
    width, height = picture.size
    return tag(
        "figure",
        tag("img", src=picture.uri, alt=picture.alt, width=width, height=height),
        tag("figcaption", picture.caption),
        id=picture.name,
    )


def embedded(data):
    """Data as JSON in a script element, in which no tag can begin."""
    written = json.dumps(data, allow_nan=False, separators=(",", ":"))
    return Markup(
        f'<script type="application/json" id="data">{written.replace("<", chr(92) + "u003c")}</script>'
    )


def whole(title, body, scripts=()):
    """The page. scripts: names of files beside this one."""
    head = join(
        [
            Markup('<meta charset="utf-8">'),
            tag("meta", name="viewport", content="width=device-width, initial-scale=1"),
            Markup(f'<meta http-equiv="Content-Security-Policy" content="{policy}">'),
            Markup('<link rel="icon" href="data:,">'),
            tag("title", title),
            Markup(f"<style>\n{(here / 'report.css').read_text()}</style>"),
        ],
        "\n",
    )
    tail = "".join(f"<script>\n{(here / name).read_text()}</script>\n" for name in scripts)
    head, body = f"<head>\n{head}\n</head>", f"<body>\n{text(body)}\n{tail}</body>"
    return f'<!DOCTYPE html>\n<html lang="en">\n{head}\n{body}\n</html>\n'
