"""documents.py ROOT: what is wrong with the documents of a tree, a line each; exit status 1 if anything
is."""

import ast
import re
import sys
from pathlib import Path

from sections import faults

COLUMNS = 110
root = Path(sys.argv[1])
wrong = []


def say(path, what):
    wrong.append(f"{path.relative_to(root)}: {what}")


def prose(text):
    """Number and text of the lines that are neither table, code, heading, displayed mathematics nor html."""
    inside = None
    before = ""
    for number, line in enumerate(text.splitlines(), 1):
        stripped = line.strip()
        if inside:
            if stripped.startswith("```") if inside == "```" else stripped.endswith("$$"):
                inside = None
        elif stripped.startswith("```"):
            inside = "```"
        elif stripped.startswith("$$"):
            inside = None if len(stripped) > 4 and stripped.endswith("$$") else "$$"
        elif not stripped.startswith(("|", "#", "<")) and not (
            line.startswith("    ") and not before.strip()
        ):
            yield number, line
        before = line if not (line.startswith("    ") and not before.strip()) else ""


def anchors(text):
    return {
        re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")
        for heading in re.findall(r"^#+ (.*)$", text, re.M)
    }


pages = [root / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")] + sorted(
    root.glob("doc/**/*.md")
)
tags = set(re.findall(r"\\tag\{([\w-]+)\}", (root / "doc/developer/theory.md").read_text()))
for page in pages:
    text = page.read_text()
    for number, line in prose(text):
        if len(line.rstrip()) > COLUMNS:
            say(page, f"line {number} has {len(line.rstrip())} columns, more than {COLUMNS}")
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith("http"):
            continue
        name, _, anchor = target.partition("#")
        other = page.parent / name if name else page
        if not other.exists():
            say(page, f"[...]({target}): no such file")
        elif anchor and anchor not in anchors(other.read_text()):
            say(page, f"[...]({target}): no such heading")

# The notebook and the changelog may name what is gone, and a worked example what is to be made.
to_be_made = {
    "src/laws/kelvin_voigt.f90",
    "src/effects/shaking.f90",
    "src/geometry/torus.f90",
    "src/friction/cohesive.f90",
    "src/io/csv_snapshot.f90",
}
texts = [
    path
    for folder in ("src", "test", "post", "input", "tools")
    for path in sorted(root.glob(f"{folder}/**/*"))
    if path.suffix in (".f90", ".F90", ".py", ".sh", ".nml", ".toml") and "documents" not in path.name
]
for path in [root / "Makefile", *root.glob("mk/*.mk")] + pages + texts:
    if "notebook" in path.parts or path.name == "CHANGELOG.md":
        continue
    text = path.read_text()
    for names in re.findall(
        r"theory\.md, eqs?\.? ([a-z][\w-]*\w(?![\w*-])(?:(?:, | and )[a-z]+-[\w-]*[a-z])*)", text
    ):
        for name in re.split(", | and ", names):
            if name not in tags:
                say(path, f"theory.md, eq. {name}: no such equation")
    for name in set(re.findall(r"\bdoc/[\w/.]+\.(?:md|png)\b", text)):
        if not (root / name).exists():
            say(path, f"{name}: no such file")
    if path in pages:
        for name in (
            set(re.findall(r"`((?:src|test|post|input|tools)/[a-z0-9_/.]+\.\w+)`", text)) - to_be_made
        ):
            if not (root / name).exists():
                say(path, f"{name}: no such file")

scene = re.search(r"^```fortran\n(.*?)^```", (root / "README.md").read_text(), re.M | re.S)[1]
shipped = "".join(
    line for line in (root / "input/hertz.nml").read_text().splitlines(True) if not line.startswith("!")
)
if scene != shipped:
    wrong.append("the README's scene is not that of input/hertz.nml")

# design.md's list of folders: their order, which modules each has, and no source file that it leaves out.
FOLDER_FILES = 28
design = root / "doc/developer/design.md"
listed = re.split(
    r"^\*\*(\w+)\*\*", design.read_text().split("## Floors")[1].split("## Five ideas")[0], flags=re.M
)
floors = listed[1::2]
sources = sorted(path for path in root.glob("src/**/*") if path.suffix in (".f90", ".F90"))
module_of = {name: path for path in sources for name in re.findall(r"^module (\w+)", path.read_text(), re.M)}
for folder, entry in zip(floors, listed[2::2]):
    there = {path.stem for path in sources if path.parent.name == folder}
    if len(there) > FOLDER_FILES:
        say(design, f"{folder} has {len(there)} files, more than {FOLDER_FILES}")
    for name in sorted(there - set(re.findall(r"`(\w+)`", entry))):
        say(design, f"{folder} does not name {name}")
for name in sorted(set(re.findall(r"`(\w+/\w+\.[fF]90)`", design.read_text()))):
    if not (root / "src" / name).exists():
        say(design, f"src/{name}: no such file")
for path in sources:
    here = path.parent.name
    if here not in floors:
        say(path, f"{here} is no folder of doc/developer/design.md, Floors")
        continue
    for name in re.findall(r"^[^!\n]*\buse (m_\w+)", path.read_text(), re.M):
        there = module_of[name].parent.name
        if there in floors and floors.index(there) < floors.index(here):
            say(
                path,
                f"uses {name} of {there}, which is further up than {here} (doc/developer/design.md, Floors)",
            )

MODULE_LINES, PROCEDURE_LINES, COLUMNS = 450, 60, 110
opening = re.compile(
    r"^\s*(?:(?:pure|elemental|recursive|impure|module|logical|integer|real|type|character|complex)"
    r"(?:\([^)]*\))?\s+)*(?:function|subroutine)\s+(\w+)|^\s*module procedure\s+(\w+)\s*$"
)


def procedures(lines):
    """Name and lines of each procedure with a body, the procedures that it contains left out."""
    inside = []
    for line in lines:
        code = line.split("!")[0]
        if re.match(r"\s*end (function|subroutine|procedure)", code):
            name, length = inside.pop()
            yield name, length + 1
        elif found := opening.match(code):
            inside.append((found[1] or found[2], 1))
        elif inside:
            inside[-1] = inside[-1][0], inside[-1][1] + 1


def names_used(code):
    """What the `only` lists of a source's code name."""
    for names in re.findall(r"(?mi)^\s*use\b[^:\n]*(?:::\s*\w+\s*)?,\s*only\s*:(.*)$", code):
        yield from (name.split("=>")[0].strip() for name in names.split(",") if "(" not in name)


for path in sources + sorted(path for path in root.glob("test/**/*") if path.suffix in (".f90", ".F90")):
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if len(line) > COLUMNS:
            say(path, f"line {number} has {len(line)} columns, more than {COLUMNS}")

# Texts of several lines, such as scenes, are left as they are.
for path in sorted(path for folder in ("post", "test", "tools") for path in root.glob(f"{folder}/**/*.py")):
    within = set()
    for node in ast.walk(ast.parse(path.read_text())):
        text = isinstance(node, ast.JoinedStr) or isinstance(getattr(node, "value", None), str)
        if text and node.end_lineno > node.lineno:
            within.update(range(node.lineno, node.end_lineno + 1))
    for number, line in enumerate(path.read_text().splitlines(), 1):
        if len(line) > COLUMNS and number not in within:
            say(path, f"line {number} has {len(line)} columns, more than {COLUMNS}")

codes = {}
for path in sources:
    lines = path.read_text().splitlines()
    if len(lines) > MODULE_LINES:
        say(path, f"{len(lines)} lines, more than {MODULE_LINES}")
    for name, length in procedures(lines):
        if length > PROCEDURE_LINES:
            say(path, f"{name} has {length} lines, more than {PROCEDURE_LINES}")
    bare = "\n".join(re.sub(r"'[^']*'|\"[^\"]*\"", "''", line).split("!")[0] for line in lines)
    codes[path] = re.sub(r"&\s*\n\s*&?", "", bare)
for path, code in codes.items():
    parent = re.search(r"^module (\w+)", code, re.M)
    parts = [other for other in codes.values() if parent and f"submodule ({parent[1]})" in other]
    body = re.sub(r"(?mi)^\s*use\b.*$", "", "\n".join([code] + parts))
    for name in names_used(code):
        if not re.search(rf"(?i)(?:\b|_){re.escape(name)}\b", body):
            say(path, f"imports {name} and does not use it")

# gfortran 14 makes wrong code of these with AVX-512 (findings/gfortran14_avx512_logical_or.sh): instead
# where (b) a = .true.
arrays = {
    name
    for code in codes.values()
    for names in re.findall(r"(?mi)^\s*logical\b[^:\n]*::(.*)$", code)
    for name in re.findall(r"(\w+)\s*\((?:[^()]|\([^()]*\))*\)", names)
}
for path, code in codes.items():
    scalars = {
        name
        for names in re.findall(r"(?mi)^\s*logical\b[^:\n]*::(.*)$", code)
        for name in re.findall(r"(\w+)(?=\s*(?:,|=|$))", re.sub(r"\([^()]*\)", "()", names))
    }
    scalars.update(re.findall(r"(?mi)^[^\n]*\bfunction\b[^\n]*\bresult\s*\((\w+)\)", code))
    for whole, name in re.findall(r"(?mi)^\s*((?:\w+%)*(\w+)) = \1 \.or\. ", code):
        if name in arrays and name not in scalars:
            say(path, f"{whole} = {whole} .or. ...: an array of logicals; write where (...) {whole} = .true.")

for path, what in faults(codes):
    say(path, what)

print(
    "\n".join(wrong) if wrong else f"   {len(pages)} pages, {len(tags)} equations, {len(module_of)} modules"
)
sys.exit(bool(wrong))
