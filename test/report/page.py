"""A page of a report or gallery, taken apart without a browser: what must stand in it, and what must not."""

import base64
import binascii
import json
import re
import struct
import zlib
from html.parser import HTMLParser
from pathlib import Path

void = {"meta", "link", "img", "br", "input", "hr"}


class Page(HTMLParser):
    """elements: (tag, attributes, its text) in order; faults: sentences."""

    def __init__(self, path):
        super().__init__(convert_charrefs=True)
        self.path, self.elements, self.faults, self.open = Path(path), [], [], []
        self.feed(self.path.read_text(encoding="utf-8"))
        self.close()
        if self.open:
            self.faults.append(f"never closed: {[name for name, *_ in self.open]}")
        self.look()

    def handle_starttag(self, tag, attributes):
        element = [tag, dict(attributes), ""]
        self.elements.append(element)
        if tag not in void:
            self.open.append(element)

    def handle_endtag(self, tag):
        if not self.open or self.open[-1][0] != tag:
            self.faults.append(f"</{tag}> closes {self.open[-1][0] if self.open else 'nothing'}")
        else:
            self.open.pop()

    def handle_data(self, data):
        for element in self.open:
            element[2] += data

    def all(self, tag, **attributes):
        return [
            element
            for element in self.elements
            if element[0] == tag
            and all(element[1].get(key.rstrip("_")) == value for key, value in attributes.items())
        ]

    def by_id(self, name):
        return next((element for element in self.elements if element[1].get("id") == name), None)

    @property
    def ids(self):
        return [attributes["id"] for _, attributes, _ in self.elements if "id" in attributes]

    @property
    def charts(self):
        data = self.by_id("data")
        return {one["id"]: one for one in json.loads(data[2])["charts"]} if data else {}

    def look(self):
        twice = {name for name in self.ids if self.ids.count(name) > 1}
        if twice:
            self.faults.append(f"ids that stand twice: {twice}")
        for tag, attributes, text in self.elements:
            for key in ("src", "href", "data", "action", "srcset", "poster"):
                self.look_at_link(tag, key, attributes.get(key))
            if any(key.startswith("on") for key in attributes):
                self.faults.append(f"<{tag}> has a handler: {attributes}")
            if tag == "style" and re.search(r"url\(|@import", text):
                self.faults.append("a style loads something")
        for _, attributes, _ in self.all("img"):
            self.look_at_image(attributes)
        for name, chart in self.charts.items():
            if not self.by_id(name):
                self.faults.append(f"the chart {name} has no place")
            rows = len(chart["axes"][0]["values"])
            if any(len(axis["values"]) != rows for axis in chart["axes"]):
                self.faults.append(f"the axes of {name} differ in length")
            for view in chart["views"]:
                for series in view["series"]:
                    if (
                        len(series["y"]) != len(series.get("x", chart["axes"][0]["values"]))
                        or not series["y"]
                    ):
                        self.faults.append(
                            f"{name}, {series['name']}: x and y differ in length, or are empty"
                        )
        if len(self.all("h1")) != 1 or len(self.all("title")) != 1 or len(self.all("main")) != 1:
            self.faults.append("not one h1, one title and one main")

    def look_at_link(self, tag, key, target):
        if target is None or target.startswith("data:"):
            return
        if tag == "a" and target.startswith("#"):
            if target[1:] not in self.ids:
                self.faults.append(f"the link {target} leads nowhere")
        elif tag == "a" and not re.match(r"\w+:|//", target):
            if not (self.path.parent / target).is_file():
                self.faults.append(f"the link {target} leads to no file")
        else:
            self.faults.append(f"<{tag} {key}={target[:60]}> needs something from outside")

    def look_at_image(self, attributes):
        name = attributes.get("alt", "")
        if not name.strip():
            self.faults.append("a picture has no alt text")
        try:
            kind, _, data = attributes["src"].partition(",")
            if kind != "data:image/png;base64":
                raise ValueError(f"it is {kind[:40]}")
            size = png_size(base64.b64decode(data, validate=True))
            if size != (int(attributes["width"]), int(attributes["height"])):
                raise ValueError(f"it is of {size} pixels")
        except (KeyError, ValueError, binascii.Error, struct.error, zlib.error) as error:
            self.faults.append(f"the picture '{name}' is none: {error}")


def png_size(data):
    """Width and height of a PNG, all of whose rows are there."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("no PNG")
    at, packed = 8, b""
    while at < len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        kind, body, sum_ = (
            data[at + 4 : at + 8],
            data[at + 8 : at + 8 + length],
            data[at + 8 + length : at + 12 + length],
        )
        if zlib.crc32(kind + body) != struct.unpack(">I", sum_)[0]:
            raise ValueError("a wrong checksum")
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", body[:10])
        if kind == b"IDAT":
            packed += body
        at += 12 + length
    bytes_a_pixel = depth // 8 * {0: 1, 2: 3, 6: 4}[colour]
    if len(zlib.decompress(packed)) != height * (1 + width * bytes_a_pixel):
        raise ValueError("rows are missing")
    return width, height
