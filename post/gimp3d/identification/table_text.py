"""Text tables of instruments: names, units and rows.

Encodings: UTF-8, UTF-16 with its mark; what is none of them is read as Latin-1. Tabs separate columns, else
semicolons, else commas, else blanks. Decimal commas follow the rule of the program (find_decimal_comma):
words between blanks, tabs and semicolons that have one comma each, between digits, and more words than
one."""

import csv
import re

import numpy as np

from ..run_data import Unreadable

MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}
MICRO = str.maketrans({"\u00b5": "u", "\u03bc": "u"})
COMMENTS = "#!%"
BLANKS = " \r\0\x1a\ufeff"  # a tab at the beginning is a column without a value
UNITS = {  # dimension: unit: factor; m and M are apart
    "length": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9},
    "load": {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9, "kN": 1e3, "MN": 1e6},
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "pressure": {"Pa": 1.0, "mPa": 1e-3, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9},
    "stiffness": {
        "N/m": 1.0, "kN/m": 1e3, "MN/m": 1e6, "mN/nm": 1e6, "uN/nm": 1e3, "N/mm": 1e3, "mN/um": 1e3,
    },
    "area": {"m2": 1.0, "mm2": 1e-6, "um2": 1e-12, "nm2": 1e-18},
    "ratio": {"": 1.0, "1": 1.0, "-": 1.0, "%": 0.01},
}  # fmt: skip
EVERY = {unit: (kind, factor) for kind, some in UNITS.items() for unit, factor in some.items()}


def found_unit(text):
    """Dimension and factor of a unit; None of what is none. Its case counts where it tells two units apart
    (mN, MN): else not."""
    text = text.translate(MICRO)
    if text in EVERY:
        return EVERY[text]
    alike = [unit for unit in EVERY if unit.lower() == text.lower()]
    return EVERY[alike[0]] if len(alike) == 1 else None


def in_si(path, name, unit, values, kinds):
    """Values of a column in SI, whose unit must be one of some dimensions."""
    found = found_unit(unit)
    if found and found[0] in kinds:
        return np.asarray(values) * found[1]
    if not unit:
        raise Unreadable(f"{path}: column {name} has no unit; give it as in `depth [nm], load [mN]`")
    allowed = ", ".join(one for kind in kinds for one in UNITS[kind] if one)
    raise Unreadable(f"{path}: column {name} has the unit {unit!r}; allowed are {allowed}")


def decoded(path):
    """The text of a file. Raises Unreadable."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise Unreadable(f"{path}: {error.strerror}")
    mark = next((code for begin, code in MARKS.items() if data.startswith(begin)), None)
    if mark is None and b"\0" in data.rstrip(b"\0\x1a"):
        raise Unreadable(f"{path}: no text (byte {data.index(0)} is 0)")
    try:
        return data.decode(mark or "utf-8")
    except UnicodeDecodeError as error:
        if mark:
            raise Unreadable(f"{path}: no text (byte {error.start} is none of {mark.upper()})")
        return data.decode("latin-1")  # which every byte is a letter of


def split_name(word):
    """`depth [nm]`, `Disp_nm`, `load(mN)`, `depth/nm`, `Depth, nm` -> bare name in small letters, unit as it
    is. A unit of one letter (m, N, s) counts behind a slash, or behind a name of more than one letter."""
    word = word.strip().strip("\"'").strip()
    found = re.fullmatch(r"(.*?)\s*[\[({]\s*([^\])}]*?)\s*[\])}]", word)
    if found:
        return found[1].strip().lower(), found[2]
    for mark in re.finditer(r"[/_,\s]", word):
        bare, tail = word[: mark.start()].strip(" ,/_"), word[mark.end() :].strip()
        plain = tail.translate(MICRO)
        if not bare or plain in ("", "1", "-") or not found_unit(tail):
            continue
        if len(tail) > 1 or plain in EVERY and (mark[0] == "/" or len(bare) > 1):
            return bare.lower(), tail
    return word.lower(), ""


def has_decimal_comma(line):
    """Whether commas are decimal ones, by the program's rule."""
    words = re.split(r"[ \t;]+", line.strip(" \t;"))
    some = [word for word in words if "," in word]
    single = all(word.count(",") == 1 and word[0] != "," and word[-1] != "," for word in some)
    return len(words) > 1 and single and any(re.search(r"\d,\d", word) for word in some)


def separated(line, decimal_comma=False):
    """The words of a line, without the empty ones at its end."""
    marks = "\t;" if decimal_comma else "\t;,"
    mark = next((one for one in marks if one in line), None)
    words = next(csv.reader([line], delimiter=mark, skipinitialspace=True)) if mark else line.split()
    words = [word.strip() for word in words]
    while words and not words[-1]:
        words.pop()
    return words


def numbers_of(words):
    """Number of each word, None where it is none."""
    found = []
    for word in words:
        try:
            found.append(float(word))
        except ValueError:
            found.append(None)
    return found


def head_of(line, last):
    """Names of a line without numbers; `last`: those of the line before, which it may have the units of."""
    line = line.lstrip("# ")
    head = separated(line)
    if len(head) == 1 or not re.search(r"[;,\t]", line):
        head = re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", line)
    units = [word.strip(" []()") for word in head]
    if last and len(last) == len(head) and 2 * sum(1 for one in units if found_unit(one)) > len(units):
        return [f"{name} [{unit}]" for name, unit in zip(last, units)]
    return head


def read_table(path, known=()):
    """Names, units and rows of a text table: the last line without numbers before the first row is its head,
    a comment only if it has one of the `known` names. Columns of text are filled with NaN."""
    head, rows, decimal = None, [], set()
    for number, line in enumerate(decoded(path).split("\n"), 1):
        line = line.strip(BLANKS)
        if not line.strip() or (line[0] in COMMENTS and (rows or line[0] != "#")):
            continue
        comma = has_decimal_comma(line)
        words = separated(line, comma)
        values = numbers_of([word.replace(",", ".") for word in words] if comma else words)
        if not is_row(values, words, head, 0 if rows else 1):
            if rows:
                raise Unreadable(f"{path}:{number}: not a row of numbers: {line[:60]}")
            if line[0] != "#" or any(split_name(word)[0] in known for word in separated(line[1:])):
                head = head_of(line, head)
            continue
        written = "".join(word for word, value in zip(words, values) if value is not None)
        kinds = decimal | {mark for mark in ",." if mark in written}
        if len(kinds) > 1:
            raise Unreadable(f"{path}:{number}: decimal commas and decimal points; allowed: one of them")
        decimal = kinds
        if head and len(values) != len(head):
            raise Unreadable(f"{path}:{number}: {len(values)} values for {len(head)} columns")
        rows.append((number, words, values))
    if not rows:
        raise Unreadable(f"{path}: no rows of numbers")
    if not head:
        raise Unreadable(f"{path}: no header line with names and units, as `depth [nm], load [mN]`")
    return *map(list, zip(*(split_name(word) for word in head))), table(path, head, rows)


def is_row(values, words, head, more_than):
    """Whether a line is a row: all its words are numbers, or there are more than some numbers, as many words
    as names, and a name has a unit."""
    some = sum(value is not None for value in values)
    missing = sum(not word for word in words)
    if some and some + missing == len(values):
        return True
    named = bool(head) and any(split_name(word)[1] for word in head)
    return named and len(head) == len(values) and some > more_than


def table(path, head, rows):
    """The numbers (rows, columns); NaN for what is empty, and for columns of text."""
    columns = []
    for k, name in enumerate(head):
        text = [(number, words[k]) for number, words, values in rows if values[k] is None and words[k]]
        if text and any(values[k] is not None for _, _, values in rows):
            number, word = text[0]
            raise Unreadable(f"{path}:{number}: column {name}: {word!r} is not a number")
        columns.append([np.nan if values[k] is None else values[k] for _, _, values in rows])
    return np.array(columns).T
