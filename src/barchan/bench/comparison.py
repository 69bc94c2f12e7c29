"""The measurement: every code's best skin, a check of the work, then timings in turns."""

from contextlib import ExitStack
from math import ceil
from tempfile import TemporaryDirectory

import numpy as np

from barchan.bench.observed import count_contacts, kinetic_energy
from barchan.bench.process import TIMEOUT, Code
from barchan.errors import RunError

#: Rebuilds that every timing must hold, and how often the steps are doubled to reach them.
REBUILDS, DOUBLINGS = 5, 3

#: Steps from the common start after which the work is compared: long enough for all terms of the law to act, too short for
#: rounding to grow into another flow.
CHECKED_STEPS = 100

#: Largest relative difference of the number of contacts, and of the kinetic energy where the law is the same, at that moment.
SAME_CONTACTS, SAME_ENERGY = 0.01, 0.001


class Entry:
    """A code in a comparison, and what was measured of it.

    Args:
        peer: a ``Peer``.
        leads: True for the code that others are compared with; without it there is no comparison.

    Attributes:
        reason: why it was not run, or not to the end; None if it was.
        scan, pace: skin -> seconds and rebuilds of a step.
        skin: the best one, relative to the largest diameter.
        trials: seconds that a rebuild took with each ``Division``, time after time. division: the best of them; None if there was
            no choice.
        ghosts: on the first rank, at the end: grains of other ranks, each once; None without ranks.
        contacts, energy: after ``CHECKED_STEPS`` steps.
        idle, resident: memory before it had any work, and at the end [bytes].
        timings: (seconds of a step or of a rebuild, rebuilds) of each round.
    """

    def __init__(self, peer, leads=False):
        self.peer, self.leads, self.reason, self.code = peer, leads, peer.missing, None
        self.version = self.skin = self.contacts = self.energy = self.idle = self.resident = self.ghosts = None
        self.scan, self.pace, self.timings, self.trials, self.division = {}, {}, [], {}, None

    def start(self, code):
        """Take up a running code, and let it load what does not grow with the grains."""
        self.code = code
        self.version = code.ask("start")["version"]
        self.idle = code.resident()

    def choose_skin(self, case, journal):
        """Time each skin from the start; say which is best."""
        for skin in case.skins:
            self.code.ask("set_up", skin=skin)
            answer = self.code.ask("run", steps=case.scan_steps, forced=False)
            self.scan[skin], self.pace[skin] = answer["seconds"] / case.scan_steps, answer["rebuilds"] / case.scan_steps
        self.skin = min(self.scan, key=self.scan.get)
        tried = ", ".join(f"{skin:g}: {1e3 * seconds:.3g} ms" for skin, seconds in self.scan.items())
        border = "; the border of what was tried" if self.at_border else ""
        journal.say(f"{self.peer.name}: a step at each skin [largest diameters]: {tried}; best {self.skin:g}{border}")

    def choose_division(self, case, journal):
        """Time each division into size classes, where there is a choice; say which is best."""
        for division in case.divisions(self.peer):
            self.code.ask("divide", **division._asdict())
            self.code.ask("run", steps=1, forced=True)  # it finds out how much room it needs
            self.trials[division] = [self._timing(case, case.scan_steps)[0] for _ in range(case.scans)]
        if self.trials:
            self.division = min(self.trials, key=lambda division: min(self.trials[division]))
            tried = "; ".join(f"{division}: {1e3 * min(seconds):.3g} ms" for division, seconds in self.trials.items())
            journal.say(f"{self.peer.name}: a {case.of} with each division: {tried}; best {self.division}")

    def begin(self, case):
        """Start anew at the best skin and division, and note what is computed in the first steps."""
        self.code.ask("set_up", skin=self.skin)
        if self.division is not None:
            self.code.ask("divide", **self.division._asdict())
        self.code.ask("run", steps=CHECKED_STEPS, forced=False)
        seen = self.code.observe()
        if not all(np.isfinite(values).all() for values in seen.values()):
            raise RunError(f"has grains that are nowhere, or infinitely fast, after {CHECKED_STEPS} steps")
        self.contacts, self.energy = count_contacts(case, seen), kinetic_energy(case, seen)

    def time(self, case, steps):
        """One timing."""
        self.timings.append(self._timing(case, steps))

    def _timing(self, case, steps):
        """Seconds of a step or a rebuild, and how many rebuilds there were."""
        answer = self.code.ask("run", steps=steps, forced=case.forced)
        seconds, rebuilds = answer["seconds"], answer["rebuilds"]
        if case.forced:
            without = self.code.ask("run", steps=steps, forced=False)
            seconds -= without["seconds"]
            if (rebuilds, without["rebuilds"]) != (steps, 0):
                raise RunError(f"rebuilt {rebuilds} times in {steps} steps that force it, {without['rebuilds']} in others")
        return seconds / steps, rebuilds

    def end(self):
        """Note the memory with all grains, and the ghosts."""
        self.resident = self.code.resident()
        self.ghosts = self.code.ask("ghosts")["ghosts"] if self.peer.ranks > 1 else None

    def drop(self, reason):
        """Out of the comparison."""
        self.reason = reason
        if self.code is not None:
            self.code.close(politely=False)

    @property
    def at_border(self):
        """True if the best skin is the smallest or the largest of several that were tried."""
        return len(self.scan) > 1 and self.skin in (min(self.scan), max(self.scan))

    def does_the_work_of(self, ours):
        """True if both codes had the same contacts, and the same kinetic energy where the law is the same."""
        same = abs(self.contacts - ours.contacts) <= SAME_CONTACTS * ours.contacts
        return same and (not self.peer.same_law or abs(self.energy - ours.energy) <= SAME_ENERGY * ours.energy)

    def ratios(self, ours):
        """Its time over ours, round by round, (rounds,)."""
        return np.array([theirs[0] / mine[0] for theirs, mine in zip(self.timings, ours.timings)])


def compare(case, peers, journal, timeout=TIMEOUT):
    """Run a case with every code that can run.

    Args:
        case: a ``Case``.
        peers: list of ``Peer``; the first is the one that the others are compared with.
        journal: told what is going on.
        timeout: seconds after which a code that does not answer is left out.

    Returns:
        ([``Entry``, ...], steps of each timing).

    Raises:
        RunError: the first code failed. Any other that fails is left out, with its reason.
    """
    entries = [Entry(peer, leads=peer is peers[0]) for peer in peers]
    with TemporaryDirectory(prefix="barchan-bench-") as folder, ExitStack() as stack:
        case.save(folder)
        journal.say("starting the codes")
        _each(entries, lambda entry: entry.start(stack.enter_context(Code(entry.peer, folder, timeout))), journal)
        _each(entries, lambda entry: entry.choose_skin(case, journal), journal)
        _each(entries, lambda entry: entry.choose_division(case, journal), journal)
        _each(entries, lambda entry: entry.begin(case), journal)
        steps = _take_turns(entries, case, journal)
        _each(entries, lambda entry: entry.end(), journal)
    return entries, steps


def _each(entries, act, journal):
    """Let every code that is still there act, one after another. One that fails is out."""
    for entry in entries:
        if entry.reason is None:
            try:
                act(entry)
            except (RunError, OSError) as error:
                entry.drop(str(error))
                if entry.leads:
                    raise RunError(f"{entry.peer.name}: {entry.reason}") from None
                journal.say(f"{entry.peer.name}: {entry.reason}")


def _take_turns(entries, case, journal):
    """All rounds; with more steps, if a timing holds too few rebuilds. Returns the steps."""
    if case.forced:
        _rounds(entries, case, case.steps, 0, journal)
        return case.steps
    steps = _enough(entries, case.steps)
    for least in (*[REBUILDS] * DOUBLINGS, 0):
        if _rounds(entries, case, steps, least, journal):
            return steps
        steps *= 2
        journal.say(f"a timing held fewer than {REBUILDS} rebuilds: now {steps:,} steps")


def _enough(entries, steps):
    """Steps that hold enough rebuilds for every code, by what its choice of skin showed; at most ten times those of the case."""
    paces = [entry.pace[entry.skin] for entry in entries if entry.reason is None]
    return min(max([steps, *(ceil(1.2 * REBUILDS / pace) for pace in paces if pace)]), 10 * steps)


def _rounds(entries, case, steps, least, journal):
    """Time the codes in turns, in one order and then the other; False, and ended early, if one rebuilds less than wanted."""
    for entry in entries:
        entry.timings = []
    for number in range(case.rounds):
        journal.say(f"round {number + 1} of {case.rounds}: {steps:,} steps with each code", passing=True)
        _each(entries[:: -1 if number % 2 else 1], lambda entry: entry.time(case, steps), journal)
        if any(entry.timings[-1][1] < least for entry in entries if entry.reason is None):
            return False
    return True
