"""kills.py KILLS [RANKS]: a run that is killed at random moments, with kill -9, and goes on each time. Where RANKS are given every
fifth start is on that many."""
import random
from restarts import *

kills = int(sys.argv[1])
most = int(sys.argv[2]) if len(sys.argv) > 2 else 1
chance = random.Random(20240607)
text, end = (LEVELS, 0.11) if kills <= 20 else (PLASTIC, 2.0)
run(1, scene(text, "straight", end=end, every=end / 10))
made = scene(text, "killed", "every_steps=3", end=end, every=end / 10)
done, starts, empty, steps = 0, 0, 0, []
finished = False
while not finished and starts < 5 * kills:
    ranks = most if most > 1 and starts % 5 == 4 else 1
    going_on = len(checkpoints("killed")) > 0
    before = newest_step("killed") if going_on else 0
    process = start(ranks, None if going_on else made, "killed" if going_on else None)
    starts += 1
    if done < kills:
        # somewhere between the start and the checkpoints, also while one is being written; late enough to get on in the end
        target = before + chance.choice([0, 0, 3])
        wait_for(lambda: newest_step("killed") > target, process, 20)
        try:
            process.wait(chance.uniform(0.0, 0.05))
        except subprocess.TimeoutExpired:
            pass
        if process.poll() is None:
            for pid in ranks_of(process, ranks):
                try:
                    os.kill(pid, signal.SIGKILL)
                except ProcessLookupError:
                    pass
            done += 1
    output = process.communicate()[0]
    if process.returncode == 0:
        finished = done >= kills or process.poll() == 0
    elif "gimp3d: cannot" in output or "gimp3d: step" in output:
        require(f"start {starts}: {said(output)}", False)
        break
    steps.append(newest_step("killed"))
print(f"   {done} kills, {starts} starts, newest checkpoints at {steps[:40]}")
require("killed often enough", done >= 0.7 * kills)
require("came to its end", finished)
same(f"after {done} kills", "straight", "killed")
require("no parts are left", not list(Path("killed").glob("*.part")))
finish()
