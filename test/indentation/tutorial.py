"""The commands of a tutorial, taken from the document itself.

usage: tutorial.py list DOCUMENT             every command, one a line tutorial.py check ROOT DOCUMENT
       no run is made: names, options and files of every command; cheap commands are done tutorial.py run
       DOCUMENT [LIMIT]      every command in order, in the current directory; what it prints beside the
       document

A command is a line of a block ```sh (a line that ends with a backslash goes on; a comment is none). What a
block prints is the block ```text that follows, if one does: a line `...` in it stands for any lines. Words
must be equal. Numbers must be within 5 %, or within half a unit of their last digit; not compared, but to be
there, are uncertainties and shares (after +-, before %), and the times of machines (before s, min). `run`
fails where a command's status is not 0, or what it printed is not what the document has."""

import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

TOLERANCE = 0.05
number = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
faults = []


def blocks(text):
    """(language, content) of all fenced blocks, in order."""
    return re.findall(r"^```(\w*)\n(.*?)^```$", text, re.M | re.S)


def steps(document):
    """(commands of a block, what they print together or None), in order."""
    found = []
    parts = blocks(Path(document).read_text())
    for i, (language, content) in enumerate(parts):
        if language != "sh":
            continue
        lines = [line.strip() for line in content.replace("\\\n", " ").splitlines()]
        expected = parts[i + 1][1] if i + 1 < len(parts) and parts[i + 1][0] == "text" else None
        found.append(([line for line in lines if line and not line.startswith("#")], expected))
    return found


def fault(sentence):
    faults.append(sentence)
    print(f"FAILED  {sentence}")


# ---- what is printed ----


def pieces(line):
    """The words of a line, each with the one before it and the one after it."""
    words = ["", *line.split(), ""]
    return [(words[i], words[i - 1], words[i + 1]) for i in range(1, len(words) - 1)]


def alike(wanted, line):
    """Whether a printed line is that of the document."""
    here, there = pieces(wanted), pieces(line)
    if len(here) != len(there):
        return False
    return all(word_alike(*one, other[0]) for one, other in zip(here, there))


def word_alike(word, before, after, other):
    numbers, others = number.findall(word), number.findall(other)
    if number.sub("#", word) != number.sub("#", other) or len(numbers) != len(others):
        return False
    bare = after.strip(".,;:)")
    if before in ("+-", "+/-") or bare in ("%", "s", "min", "steps/s") or word.endswith("%"):
        return True
    return all(close(a, b) for a, b in zip(numbers, others))


def close(text, other):
    mantissa, _, exponent = text.lower().partition("e")
    digit = 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))
    a, b = float(text), float(other)
    return abs(a - b) <= max(TOLERANCE * abs(a), 0.5 * digit)


def difference(expected, printed):
    """The first line of the document that was not printed where it should be, or None."""
    lines, at, anywhere = [line for line in printed.splitlines() if line.strip()], 0, False
    for wanted in expected.splitlines():
        if not wanted.strip():
            continue
        if wanted.strip() == "...":
            anywhere = True
            continue
        if anywhere:
            at = next((i for i in range(at, len(lines)) if alike(wanted, lines[i])), len(lines))
        if at >= len(lines) or not alike(wanted, lines[at]):
            return wanted, lines[at] if at < len(lines) else "(nothing)"
        at, anywhere = at + 1, False
    return None


# ---- run ----


def run(document, limit):
    began = time.monotonic()
    for commands, expected in steps(document):
        printed = ""
        for command in commands:
            start = time.monotonic()
            done = subprocess.run(
                ["bash", "-c", command],
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                stdin=subprocess.DEVNULL,
            )
            print(f"{time.monotonic() - start:7.1f} s  {command}", flush=True)
            if done.returncode:
                print(done.stdout[-2000:])
                fault(f"status {done.returncode}: {command}")
                return
            printed += done.stdout
        off = difference(expected, printed) if expected is not None else None
        if off:
            print(printed)
            fault(f"{commands[-1]}\n   the document has: {off[0]}\n   printed was:      {off[1]}")
    total = time.monotonic() - began
    print(f"{total:7.1f} s in all")
    if limit and total > limit:
        fault(f"{total:.0f} s in all, more than {limit:.0f}")


# ---- check ----


def options_of(root):
    """All options --name that the scripts of post/ know."""
    return {
        name
        for path in (root / "post/gimp3d").glob("*.py")
        for name in re.findall(r'add_argument\(\s*"(--[\w-]+)"', path.read_text())
    }


def check(root, document):
    """Every command but those that take time is done in the current directory; of the others everything is
    looked at that can be wrong."""
    makefile = "".join(path.read_text() for path in [root / "Makefile", *root.glob("mk/*.mk")])
    targets = set(re.findall(r"^###? (\w+) ", makefile, re.M))
    variables, known = set(re.findall(r"\$\((\w+)[):]", makefile)), options_of(root)
    runs, scenes = set(), []
    commands = [command for block, _ in steps(document) for command in block]
    for command in commands:
        words = shlex.split(command)
        if words[0] == "make":
            for word in words[1:]:
                name, sign, value = word.partition("=")
                if not sign:
                    if word not in targets:
                        fault(f"there is no target {word}: {command}")
                elif name not in variables:
                    fault(f"the Makefile has no {name}: {command}")
                elif name in ("RUN", "RUNS"):
                    for directory in value.split():
                        if directory not in runs:
                            fault(f"no command before makes {directory}: {command}")
                elif name == "SCENE" and not Path(value).is_file():
                    fault(f"{value} is not there: {command}")
                for option in re.findall(r"(?<!\S)--[\w-]+", value):
                    if option not in known:
                        fault(f"no script has the option {option}: {command}")
        elif words[0] in ("sed", "cp") or words[:2] == ["./gimp3d", "--section"]:
            made = re.search(r">\s*(\S+)$", command)
            if made:
                Path(made[1]).parent.mkdir(parents=True, exist_ok=True)
            if subprocess.run(["bash", "-c", command]).returncode:
                fault(f"status not 0: {command}")
        elif "gimp3d" in command:
            scene = re.search(r"<\s*(\S+)", command)
            if not scene or not Path(scene[1]).is_file():
                fault(f"the scene is not there: {command}")
                continue
            if any(
                word not in ("mpirun", "-n", "./gimp3d", "<", scene[1]) and not word.isdigit()
                for word in words
            ):
                fault(f"what is more than a scene here: {command}")
            text = Path(scene[1]).read_text()
            runs.add(re.search(r"directory='([^']*)'", text)[1])
            scenes.append(scene[1])
        else:
            for word in (word.rstrip(";") for word in words):
                if word.startswith("out/") and not any(f"{word}/".startswith(f"{made}/") for made in runs):
                    fault(f"no command before makes {word}: {command}")
    distinct = {re.sub(r"directory='[^']*'", "", Path(scene).read_text()) for scene in scenes}
    if len(distinct) != len(set(scenes)):
        fault("two scenes differ in nothing but their directory: a `sed` has changed nothing")
    for scene in dict.fromkeys(scenes):
        text = re.sub(r"end_time=\S+", "end_time=1e-15", Path(scene).read_text())
        done = subprocess.run(["./gimp3d"], input=text, capture_output=True, text=True)
        if done.returncode:
            fault(f"{scene}: {done.stderr.strip()}")
        else:
            print(f"ok      {scene}: {re.search(r'^particles .* rank', done.stdout, re.M)[0]}")
    print(f"        {Path(document).name}: {len(commands)} commands, {len(scenes)} runs")


what = sys.argv[1]
if what == "list":
    print("\n".join(command for block, _ in steps(sys.argv[2]) for command in block))
elif what == "check":
    check(Path(sys.argv[2]), sys.argv[3])
else:
    run(sys.argv[2], float(sys.argv[3]) if len(sys.argv) > 3 else 0.0)
sys.exit(bool(faults))
