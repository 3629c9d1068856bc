"""scenes.py SCENES [FIRST]: scenes that were changed at random, given to the program itself.

Each must end within 10 s with status 0, or with 2 or 4 and one sentence; one that is still a scene, only a
longer one, must obey when it is asked to stop (5). What is refused writes nothing, and nothing is written
outside the directory that the scene names. FIRST is the number of the first scene: scene N is always the
same."""

import os
import random
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import restarts

GIMP3D = os.environ["GIMP3D"]
PATIENCE = 10.0 * float(os.environ.get("SLOWNESS", "1"))  # s
SCENES = [
    re.sub(r"velocity=6,3,2", "velocity=0.6,0.3,0.2", text.format(end=0.002))
    + more
    + "&output directory='out/run', every=0.001, history_every=0 /\n&checkpoint every_steps=20 /\n"
    for text in (restarts.LEVELS, restarts.SPLITTING, restarts.PLASTIC, restarts.CONTACT, restarts.FOLLOWING)
    for more in ("", "&contact tolerance=1e-7, max_iterations=300 /\n")
    if not more or "&tool" in text
]
NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:[eEdD][-+]?\d+)?")
VALUES = [
    "0",
    "-1",
    "1",
    "2",
    "1e300",
    "1e-300",
    "-0.5",
    "nan",
    "inf",
    "1e999",
    "0.1",
    "0.05",
    "3",
    "7",
    "8",
    "27",
    "1000000000000",
    "",
    "''",
    "'x'",
    ".true.",
    "1,2,3",
    "3*0.5",
    "1e-9",
    "0.3",
    "90",
    "1_8",
    "0x10",
    "1.2.3",
    "--4",
    "*",
    "100*",
    "1d0",
    "+.5",
]
WORDS = re.compile(r"[a-z_]+")


def one_byte(chance, text):
    at = chance.randrange(len(text))
    new = chance.choice([chr(chance.randrange(256)), chance.choice("&/=,'\"!() \n\t*.-+0123456789"), ""])
    return text[:at] + new + text[at + chance.choice([0, 1, 1]) :]


def one_number(chance, text):
    found = list(NUMBER.finditer(text))
    if not found:
        return one_byte(chance, text)
    spot = chance.choice(found)
    new = chance.choice(VALUES)
    if chance.random() < 0.4:
        new = repr(
            float(spot[0].lower().replace("d", "e")) * chance.choice([2.0, 0.5, -1.0, 10.0, 0.1, 1.0000001])
        )
    return text[: spot.start()] + new + text[spot.end() :]


def one_word(chance, text):
    found = list(WORDS.finditer(text))
    if not found:
        return one_byte(chance, text)
    spot, other = chance.choice(found), chance.choice(found)
    return text[: spot.start()] + other[0] + text[spot.end() :]


def lines_moved(chance, text):
    lines = text.split("\n")
    at, to = chance.randrange(len(lines)), chance.randrange(len(lines))
    how = chance.randrange(3)
    if how == 0:
        lines.insert(to, lines.pop(at))
    elif how == 1:
        lines.insert(to, lines[at])
    else:
        lines.pop(at)
    return "\n".join(lines)


def cut(chance, text):
    return text[: chance.randrange(len(text))]


def spliced(chance, text):
    other = chance.choice(SCENES)
    return text[: chance.randrange(len(text))] + other[chance.randrange(len(other)) :]


def mutated(number):
    chance = random.Random(number)
    text = chance.choice(SCENES)
    for _ in range(chance.choice([1, 1, 1, 2, 3, 8])):
        text = (
            chance.choice(
                [one_byte, one_byte, one_number, one_number, one_number, one_word, lines_moved, cut, spliced]
            )(chance, text)
            or " "
        )
    return text


def entries(place):
    return {str(path) for path in Path(place).rglob("*")}


def top():
    return {str(path) for place in ("/", Path.home(), "..") for path in Path(place).iterdir()}


def try_scene(number, ranks):
    """What is wrong with how the program took a scene, or nothing; and its status."""
    text = mutated(number)
    shutil.rmtree("here", ignore_errors=True)
    Path("here").mkdir()
    around = top()
    process = subprocess.Popen(
        restarts.command(ranks),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd="here",
    )
    asked = False
    try:
        out, err = process.communicate(text.encode("latin-1"), timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        asked = True
        for pid in restarts.ranks_of(process, ranks):
            os.kill(pid, signal.SIGTERM)
        try:
            out, err = process.communicate(timeout=PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            out, err = process.communicate()
            return "hangs", process.returncode
    status = process.returncode
    sentences = [line for line in err.decode("latin-1").splitlines() if line.startswith("gimp3d: ")]
    made = entries("here")
    homes = {str(Path(path).parent) for path in made if Path(path).name == "case.nml"}
    if status not in ((5,) if asked else (0, 2, 4)):
        return f"status {status}: {err.decode('latin-1')[-300:]}", status
    if status != 0 and len(sentences) != 1:
        return f"status {status} with {len(sentences)} sentences: {err.decode('latin-1')[-300:]}", status
    if status == 2 and made:
        return f"was refused and wrote {sorted(made)[:3]}", status
    if len(homes) > 1 or any(
        not any(path.startswith(home) or home.startswith(path) for home in homes) for path in made
    ):
        return f"wrote {sorted(made)[:5]}", status
    if top() - around:
        return f"wrote {top() - around}", status
    return "", status


def main():
    Path("inside").mkdir()
    os.chdir("inside")  # what is beside it is watched, and must be nothing of other tests
    count = int(sys.argv[1])
    first = int(sys.argv[2]) if len(sys.argv) > 2 else 0
    statuses, wrong = {}, 0
    for number in range(first, first + count):
        fault, status = try_scene(number, 2 if number % 25 == 24 else 1)
        statuses[status] = statuses.get(status, 0) + 1
        if fault:
            wrong += 1
            Path(f"scene_{number}.nml").write_bytes(mutated(number).encode("latin-1"))
            print(f"FAILED: scene {number}: {fault}", flush=True)
    print(f"   {count} scenes, by exit status: {dict(sorted(statuses.items()))}")
    # that a fault would be seen: both kinds must be among them
    if count >= 20 and not (statuses.get(0) and statuses.get(2)):
        wrong += 1
        print("FAILED: none was accepted, or none refused")
    sys.exit(1 if wrong else 0)


main()
