"""The text of a scene as groups and variables with their places in it, by the rules of the program's reader
(src/namelist): comments behind !, texts in single or double quotes on one line (a quote inside is doubled),
repeat counts (3*0.0), commas or blanks between values, several groups on a line, / or &end as the end of a
group, names in any case, a byte order mark."""

import math
import re
from dataclasses import dataclass, field

ends = r" \t\r\n'\",=/!&"  # of a word
blanks = re.compile(r"(?:[ \t\r\n]+|![^\n]*)*")  # and comments
a_word = re.compile(f"[^{ends}]*")
a_name = re.compile(r"[a-z][a-z0-9_]{0,63}", re.I | re.A)
a_number = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[ed][+-]?\d+)?", re.I | re.A)
quoted = re.compile(r"'(?:[^'\n]|'')*'|\"(?:[^\"\n]|\"\")*\"")
truths = dict.fromkeys((".true.", "true", ".t.", "t"), True)
truths |= dict.fromkeys((".false.", "false", ".f.", "f"), False)
no_index = "an index is not allowed; give all values at once, as name=value,value,value"
most_repeats = 1000000  # of a value


class BadText(Exception):
    """A text is no scene; the sentence names the line, the group and the variable."""


@dataclass
class Variable:
    """A variable of a group: its values, and where its name begins, its last value ends, and the comma behind
    that is (none: -1)."""

    first: int
    last: int = 0
    comma: int = -1
    values: list = field(default_factory=list)


@dataclass
class Group:
    """A group: its name and its variables by their names, in lower case; where its & is, where something can
    be added, and where the text behind it begins."""

    name: str
    first: int
    add_at: int
    last: int = 0
    variables: dict = field(default_factory=dict)


class Reader:
    """Reads the groups of a text, one after the other."""

    def __init__(self, text):
        self.text = text
        self.at = 1 if text.startswith("\ufeff") else 0

    def fail(self, what, at):
        raise BadText(f"line {self.text.count(chr(10), 0, at) + 1}{what}")

    def skip(self):
        """Go behind blanks and comments. The character there; none at the end of the text."""
        self.at = blanks.match(self.text, self.at).end()
        return self.text[self.at : self.at + 1]

    def word(self):
        """Read up to a blank or sign; may be empty."""
        found = a_word.match(self.text, self.at)
        self.at = found.end()
        return found[0]

    def name_follows(self):
        """Whether the word here is the name of the next variable: an = follows it."""
        end = a_word.match(self.text, self.at).end()
        behind = blanks.match(self.text, end).end()
        return end > self.at and self.text.startswith("=", behind)

    def groups(self):
        """The groups of the text, in its order."""
        found = []
        while here := self.skip():
            if here != "&":
                line = self.text[self.at :].splitlines()[0]
                self.fail(f": text outside a group: {line[:60]}; allowed: comments behind !", self.at)
            found.append(self.group())
        return found

    def group(self):
        first = self.at
        self.at += 1
        name = self.word()
        if not a_name.fullmatch(name):
            self.fail(": & must be followed by the name of a group", first)
        group = Group(name.lower(), first, self.at)
        while not self.group_ends(group):
            self.variable(group)
        group.last = self.at
        return group

    def variable(self, group):
        at = self.at
        name = self.word()
        place = f", &{group.name} {name or self.text[at]}"
        if "(" in name or "%" in name:
            self.fail(f"{place}: {no_index}", at)
        if not a_name.fullmatch(name):
            self.fail(f"{place}: not the name of a variable; a group holds name=value", at)
        if self.skip() != "=":
            self.fail(f"{place}: no = follows; a group holds name=value", at)
        self.at += 1
        if name.lower() in group.variables:
            self.fail(f"{place}: given twice", at)
        group.variables[name.lower()] = variable = Variable(at)
        self.values(variable, place)
        group.add_at = variable.last

    def group_ends(self, group):
        """Whether the group ends here; goes behind its end."""
        here = self.skip()
        if here == "/":
            self.at += 1
        elif here in ("&", ""):
            self.at += 1
            if self.word().lower() != "end":
                self.fail(f", &{group.name}: does not end; a group ends with /", group.first)
        return here in ("/", "&")

    def values(self, variable, place):
        """The values behind an =, up to the next name or the end of the group."""
        wanted = True
        while (here := self.skip()) not in ("/", "&", ""):
            if here == ",":
                if wanted:
                    self.fail(f"{place}: a value is missing before a comma", self.at)
                wanted, variable.comma = True, self.at
                self.at += 1
            elif here == "=":
                self.fail(f"{place}: unexpected =", self.at)
            elif self.name_follows():
                break
            else:
                variable.values += self.value(place)
                wanted, variable.last, variable.comma = False, self.at, -1
        if not variable.values:
            self.fail(f"{place}: no value; write name=value", variable.first)

    def value(self, place):
        """A value as often as its repeat count says."""
        at = self.at
        word = self.word()
        if "(" in word or ")" in word or "%" in word:
            self.fail(f"{place}={word}: {no_index}", at)
        if not word.isascii():
            self.fail(f"{place}={word}: only plain letters may stand outside quotes", at)
        count, _, value = word.partition("*") if "*" in word else ("", "", word)
        repeats = 1
        if count:
            repeats = int(count) if re.fullmatch(r"\+?\d{1,9}", count) else 0
            if not 1 <= repeats <= most_repeats:
                self.fail(f"{place}={word}: the repeat count must be from 1 to {most_repeats}", at)
        if value:
            return [self.plain(value, place, at)] * repeats
        text = quoted.match(self.text, self.at)
        if not text:
            what = "quote not closed" if self.text[self.at] in "'\"" else "a value is missing behind *"
            self.fail(f"{place}: {what}", at)
        self.at = text.end()
        quote = text[0][0]
        return [text[0][1:-1].replace(2 * quote, quote)] * repeats

    def plain(self, word, place, at):
        """A value without quotes: a number, a truth or a word."""
        if a_number.fullmatch(word):
            number = float(re.sub("[dD]", "e", word))
        elif re.fullmatch(r"[+-]?(?:nan|inf|infinity)", word, re.I):
            number = math.nan
        else:
            return truths.get(word.lower(), word)
        if not math.isfinite(number):
            self.fail(f"{place}={word}: no finite number", at)
        return number


def groups_of(text):
    """The groups of a scene's text, in its order. Raises BadText."""
    return Reader(text).groups()
