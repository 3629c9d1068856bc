"""kills.py KILLS [RANKS]: a run that is killed at random moments, with kill -9, and goes on each time. Where
RANKS are given every fifth start is on that many. kills.csv is the table of the moments and of what came of
them."""

import random
import shutil
from restarts import *

kills = int(sys.argv[1])
most = int(sys.argv[2]) if len(sys.argv) > 2 else 1
chance = random.Random(20240607)
text, end = (LEVELS, 0.11) if kills <= 20 else (PLASTIC, 2.0)
run(1, scene(text, "straight", end=end, every=end / 10))
made = scene(text, "killed", "every_steps=3", end=end, every=end / 10)
done, starts, steps, moments = 0, 0, [], []
finished = False


def writing():
    return bool(list(Path("killed").glob("checkpoint_*.part")))


while not finished and starts < 5 * kills:
    ranks = most if most > 1 and starts % 5 == 4 else 1
    going_on = len(checkpoints("killed")) > 0
    before = newest_step("killed") if going_on else 0
    begun, before_start = time.monotonic(), len(moments)
    process = start(ranks, None if going_on else made, "killed" if going_on else None)
    starts += 1
    if done < kills:
        # somewhere between the start and the checkpoints, also while one is being written; late enough to get
        # on in the end
        target = before + chance.choice([0, 0, 3])
        wait_for(lambda: newest_step("killed") > target, process, 20)
        if chance.random() < 0.4:
            wait_for(writing, process, 20)
        try:
            process.wait(chance.choice([0.0, chance.uniform(0.0, 0.05)]))
        except subprocess.TimeoutExpired:
            pass
        if process.poll() is None:
            moment = [
                done + 1,
                ranks,
                f"{time.monotonic() - begun:.3f}",
                newest_step("killed"),
                "yes" if writing() else "no",
            ]
            pids = ranks_of(process, ranks)
            if ranks > 1 and chance.random() < 0.5:
                pids = pids[-1:]  # mpirun ends the others
            moment.insert(2, len(pids))
            for pid in pids:
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    pass
            done += 1
            moments.append(moment)
    output = process.communicate()[0]
    for moment in moments[:before_start]:
        if len(moment) == 6:  # what this start made of it
            found = re.search(r"goes on    from \S+, step (\d+)", output)
            moment.append(
                f"goes on from step {found[1]}"
                if found
                else "begins anew"
                if not going_on
                else "killed before it said so"
            )
    if process.returncode == 0:
        finished = done >= kills
        if not finished:  # it came to its end before it was killed so often: it begins anew
            same(f"after {done} kills", "straight", "killed")
            shutil.rmtree("killed")
    elif len(moments) == before_start:  # it ended by itself
        require(f"start {starts}: status {process.returncode}: {said(output) or output[-300:]}", False)
        break
    steps.append(newest_step("killed"))
with open("kills.csv", "w") as table:
    print("kill,ranks,killed,after [s],newest checkpoint [step],one being written,next start", file=table)
    for moment in moments:
        print(*moment, sep=",", file=table)
outcomes = sum(moment[-1].startswith("goes on") for moment in moments)
print(
    f"   {sum(moment[5] == 'yes' for moment in moments)} kills while a checkpoint was being written; "
    f"{outcomes} times the next start went on (kills.csv)"
)
print(f"   {done} kills, {starts} starts, newest checkpoints at {steps[:40]}")
require("killed often enough", done == kills)
require("came to its end", finished)
same(f"after {done} kills", "straight", "killed")
require("no parts are left", not list(Path("killed").glob("*.part")))
finish()
