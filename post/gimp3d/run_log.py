"""A run's log, and what cost.dat says of how it ended.

The log is for people: lines that begin with a word (`grid`, `WARNING`, `retry 1`), which are shown as they are.
Numbers are read from the AUXDATA of cost.dat, which is written where a run ends by itself."""

import re
import time
from pathlib import Path

alarms = re.compile(r"(WARNING: |warning  |range  |retry \d+: |run\.lock  )")
head = "gimp3d: "


class RunLog:
    """A log. A run that went on from a checkpoint in place has an introduction for each start: facts are
    those of the last, alarms those of all.

    facts     of cost.dat (name -> text); empty where it is not there
    verdict   the sentence that says how it ended; empty where nothing says so
    state     finished, stopped (wall limit, signal), fault, or open: still going on, or killed
    alarms    lines that warn, in their order, each once
    starts    numbers of times that the program was started
    began     when it was started last (s since 1970); None where the log does not say
    """

    def __init__(self, text, facts=None):
        self.facts = facts or {}
        self.lines = text.splitlines()
        begins = [
            n
            for n, line in enumerate(self.lines)
            if line.startswith(head)
            and n + 1 < len(self.lines)
            and self.lines[n + 1].startswith(("program  ", "grid  "))
        ]
        self.starts = len(begins)
        self.last = self.lines[begins[-1] :] if begins else self.lines
        self.alarms = list(dict.fromkeys(line for line in self.lines if alarms.match(line)))
        self.verdict, self.reached = self._end()
        ends = {
            "finished: ": "finished",
            "stopped: ": "fault",
        }  # of runs before 0.3.0, whose cost.dat does not say
        before = next((state for start, state in ends.items() if self.verdict.startswith(start)), "stopped")
        self.state = self.facts.get("outcome", before) if self.verdict else "open"

    def _end(self):
        """The closing summary's first two lines, behind an empty one: the verdict; steps, time reached, time
        it took."""
        for n, line in enumerate(self.last):
            if not line and len(self.last) > n + 2 and self.last[n + 2].split(" ")[1:3] == ["steps", "to"]:
                return self.last[n + 1], self.last[n + 2]
        return "", ""

    def said(self, word):
        """What the introduction says behind a word (`grid`, `particles`, ...); empty where it does not."""
        found = next((line for line in self.last if line.startswith(f"{word}  ")), "")
        return found[len(word) :].strip()

    @property
    def began(self):
        found = re.search(r", began (\d+-\d+-\d+ \d+:\d+:\d+)", self.said("program"))
        return time.mktime(time.strptime(found[1], "%Y-%m-%d %H:%M:%S")) if found else None

    @property
    def title(self):
        return self.last[0][len(head) :] if self.last and self.last[0].startswith(head) else ""

    @property
    def ranks(self):
        return int(self.facts["ranks"]) if "ranks" in self.facts else None

    @property
    def progress(self):
        """The last line of progress."""
        return next((line for line in reversed(self.last) if line.startswith("step ")), "")


def log_of(directory):
    """The log of a run's directory; empty where there is none."""
    path, cost = Path(directory) / "run.log", Path(directory) / "cost.dat"
    text = path.read_text(errors="replace") if path.is_file() else ""
    return RunLog(text, facts_of(cost) if cost.is_file() else None)


def numbers_of(facts):
    """Those of the facts that are numbers."""
    found = {}
    for name, text in facts.items():
        try:
            found[name] = float(text)
        except ValueError:
            pass
    return found


def facts_of(path):
    """What the head of a table says: `AUXDATA name="value"`, as texts."""
    return dict(re.findall(r'^AUXDATA (\w+)="(.*)"$', Path(path).read_text(), re.M))
