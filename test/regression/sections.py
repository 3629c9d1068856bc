"""Names that ASSOCIATE binds to what need not be contiguous, given as a whole to a dummy argument that must
be: gfortran (11 to 14) makes no copy there, and the procedure reads wrong elements without a word."""

import re

HEADER = re.compile(
    r"^\s*(?:(?:pure|elemental|recursive|impure|module|(?:logical|integer|real|type|class|character|complex)"
    r"(?:\([^()]*(?:\([^()]*\)[^()]*)*\))?)\s+)*(?:function|subroutine)\s+(\w+)\s*(?:\(([^()]*)\))?"
)


def parts(text):
    """A list split at its commas, those within brackets left."""
    depth, part, found = 0, "", []
    for letter in text:
        depth += (letter in "([") - (letter in ")]")
        if letter == "," and depth == 0:
            found.append(part.strip())
            part = ""
        else:
            part += letter
    return [*found, part.strip()] if part.strip() else found


def bracket(text, start):
    """What stands in the bracket that opens at a place, and the place behind it."""
    depth = 0
    for at in range(start, len(text)):
        depth += (text[at] in "([") - (text[at] in ")]")
        if depth == 0:
            return text[start + 1 : at], at + 1
    return text[start + 1 :], len(text)


def declared(line):
    """Names, dimensions and attributes of a declaration."""
    head, _, names = line.partition("::")
    shape = re.search(r"\bdimension\s*\(", head)
    common = bracket(head, shape.end() - 1)[0] if shape else ""
    for entry in parts(names):
        name = re.match(r"\s*(\w+)", entry)
        if name:
            at = entry.find("(")
            yield name[1], bracket(entry, at)[0] if at >= 0 else common, head


class Procedure:
    def __init__(self, name, arguments, outer):
        self.name, self.outer = name, outer
        self.arguments = [word.strip() for word in (arguments or "").split(",") if word.strip()]
        self.declared = {}  # by name: dimensions, attributes
        self.lines = []

    def needs_contiguous(self, position):
        shape, head = self.declared.get(self.arguments[position], ("", ""))
        return bool(shape) and (":" not in shape or "contiguous" in head)

    def may_be_strided(self, name):
        """A dummy argument of assumed shape, of this procedure or of one around it, or a pointer."""
        if name in self.declared:
            shape, head = self.declared[name]
            return (
                ":" in shape
                and "contiguous" not in head
                and "allocatable" not in head
                and (name in self.arguments or "pointer" in head)
            )
        return self.outer.may_be_strided(name) if self.outer else False


def procedures(code):
    inside, found = [], []
    for number, line in enumerate(code.splitlines(), 1):
        if re.match(r"\s*end\s*(function|subroutine|procedure)\b", line):
            if inside:
                found.append(inside.pop())
        elif (header := HEADER.match(line)) and not re.match(r"\s*end\b", line):
            inside.append(Procedure(header[1], header[2], inside[-1] if inside else None))
        elif inside:
            if "::" in line:
                for name, shape, head in declared(line):
                    inside[-1].declared.setdefault(name, (shape, head))
            inside[-1].lines.append(line)
    return found


def is_strided(subscripts):
    """Of an array that is contiguous: more than the last of the running subscripts is a part of its range."""
    running = [k for k, part in enumerate(subscripts) if ":" in part]
    if not running:
        return False
    if any(part.count(":") > 1 for part in subscripts):
        return True
    return running != list(range(len(running))) or any(subscripts[k] != ":" for k in running[:-1])


def is_doubtful(expression, procedure, bound):
    """Whether a selector need not be contiguous."""
    base = re.match(r"\w+", expression)
    if not base or re.search(r"[^\w%(),:\s+*/'-]|\bmerge\b", expression):
        return False
    rest, at = expression, base.end()
    last = None
    while at < len(rest):
        if rest[at] == "(":
            last, at = bracket(rest, at)
        elif rest[at] == "%":
            last = None
            at += re.match(r"%\s*\w*", rest[at:]).end()
        elif rest[at] == " ":
            at += 1
        else:
            return False  # an expression: a value of its own
    whole = last is None and base[0] == expression.strip()
    if base[0] in bound:
        return bound[base[0]] and (whole or last is not None)
    alone = "%" not in expression
    if alone and procedure.may_be_strided(base[0]) and (whole or ":" in (last or "")):
        return True
    return last is not None and is_strided(parts(last))


def faults(codes):
    """Path and sentence of each, of sources without comments and texts whose lines are joined."""
    found = {path: procedures(code.lower()) for path, code in codes.items()}
    by_name, bindings = {}, {}
    for path, code in codes.items():
        for procedure in found[path]:
            by_name.setdefault(procedure.name, []).append(procedure)
        for name, target in re.findall(r"(\w+)\s*=>\s*(\w+)", code.lower()):
            bindings.setdefault(name, set()).add(target)
        for name, targets in re.findall(
            r"^\s*interface (\w+)\s*\n\s*module procedure\s*:{0,2}\s*(.*)$", code.lower(), re.M
        ):
            bindings.setdefault(name, set()).update(re.findall(r"\w+", targets))
    for path, list_ in found.items():
        for procedure in list_:
            for name, callee in calls(procedure, by_name, bindings):
                yield path, f"{procedure.name}: {name} of ASSOCIATE may have gaps, {callee} takes none"


def calls(procedure, by_name, bindings):
    """Name and callee of each doubtful argument."""
    scopes = []  # of ASSOCIATE: doubtful or not, by name
    for line in procedure.lines:
        opened = re.match(r"\s*associate\s*\(", line)
        if opened:
            bound = {name: doubt for scope in scopes for name, doubt in scope.items()}
            inner = {}
            for part in parts(bracket(line, opened.end() - 1)[0]):
                name, _, expression = part.partition("=>")
                inner[name.strip()] = is_doubtful(expression.strip(), procedure, bound)
            scopes.append(inner)
            continue
        if re.match(r"\s*end associate", line):
            scopes.pop()
            continue
        names = {name: doubt for scope in scopes for name, doubt in scope.items()}
        names = [name for name, doubt in names.items() if doubt]
        if not names:
            continue
        for use in re.finditer(r"(%?)\b(\w+)\s*\(", line):
            given = parts(bracket(line, use.end() - 1)[0])
            for position, argument in enumerate(given):
                keyword, _, word = re.fullmatch(r"(?:(\w+)\s*(=)(?!=|>))?\s*(.*)", argument).groups()
                if word not in names:
                    continue
                for target in sorted({use[2], *bindings.get(use[2], ())}):
                    for callee in by_name.get(target, ()):
                        at = place_of(callee, keyword, position + bool(use[1]))
                        if at < len(callee.arguments) and callee.needs_contiguous(at):
                            yield word, callee.name
                            break


def place_of(callee, keyword, position):
    return callee.arguments.index(keyword) if keyword in callee.arguments else position
