"""What a run said: run.log, taken apart."""

import re

numbers = re.compile(r"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
alarms = re.compile(r"(WARNING: |warning  |range  |retry \d+: |run\.lock  )")
head = "gimp3d: "


class RunLog:
    """A log. A run that went on from a checkpoint in place has an introduction for each start: facts are
    those of the last, alarms those of all.

    verdict   the sentence that says how it ended; empty where nothing says so
    state     finished, stopped (wall limit, signal), fault, or open: still going on, or killed
    alarms    lines that warn, in their order, each once
    starts    numbers of times that the program was started
    """

    def __init__(self, text):
        self.lines = text.splitlines()
        begins = [
            n
            for n, line in enumerate(self.lines)
            if line.startswith(head)
            and n + 1 < len(self.lines)
            and re.match(r"(program|grid)  ", self.lines[n + 1])
        ]
        self.starts = len(begins)
        self.last = self.lines[begins[-1] :] if begins else self.lines
        self.alarms = list(dict.fromkeys(line for line in self.lines if alarms.match(line)))
        self.verdict, self.reached = self._end()
        self.state = (
            "open"
            if not self.verdict
            else (
                "finished"
                if self.verdict.startswith("finished: ")
                else "fault"
                if self.verdict.startswith("stopped: ")
                else "stopped"
            )
        )

    def _end(self):
        """The verdict and the line below it: steps, time reached, time it took."""
        for before, line in zip(self.last, self.last[1:]):
            if before and re.fullmatch(r"\d+ steps to .+ in .+", line):
                return before, line
        return "", ""

    def said(self, word):
        """What the introduction says behind a word (`grid`, `particles`, ...); empty where it does not."""
        found = next((line for line in self.last if re.match(rf"{word}  ", line)), "")
        return found[len(word) :].strip()

    def find(self, pattern):
        """The first line of the last start in which this is found, as a match; None where there is none."""
        return next(filter(None, (re.search(pattern, line) for line in self.last)), None)

    @property
    def title(self):
        return self.last[0][len(head) :] if self.last and self.last[0].startswith(head) else ""

    @property
    def ranks(self):
        found = self.find(r"^particles +\d+ on (\d+) rank")
        return int(found[1]) if found else None

    @property
    def progress(self):
        """The last line of progress."""
        return next((line for line in reversed(self.last) if re.match(r"step \d+ ", line)), "")
