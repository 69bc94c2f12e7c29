"""A code that computes nothing, for the machinery: python fake_code.py MISCHIEF SECONDS_A_STEP FOLDER.

MISCHIEF: "none", "hang", "die", "raise" (in its second timing), "other" (does other work), "nan", "lazy" (rebuilds rarely),
"compile" (takes a second if there is no cache). Like a code with its own Python it finds only the folder of ``barchan.bench``.
"""

import os
import sys
import time
from pathlib import Path


class Engine:
    rank, version = 0, "fake 1"

    def __init__(self, mischief, pace):
        self.mischief, self.pace, self.runs, self.slower = mischief, pace, 0, 1.0

    def set_up(self, case, skin):
        self.case, self.skin = case, skin
        if self.mischief == "compile" and not os.path.exists(os.environ["BARCHAN_CACHE_DIR"]):
            time.sleep(1.0)
            os.mkdir(os.environ["BARCHAN_CACHE_DIR"])

    def divide(self, ends, cells):
        """The best is 0.3 with cells of 1."""
        self.slower = 1.0 + abs(ends[0] - 0.3) + abs((1.0 if cells is None else cells) - 1.0)

    def ghosts(self):
        return 17

    def run(self, steps, forced):
        """The best skin is 0.1; without counting, time passes as it should."""
        self.runs += 1
        late = self.runs > 6  # two grains, three skins, the check, one timing; now the second, in the other order
        if late and self.mischief == "hang":
            time.sleep(1e6)
        if late and self.mischief == "die":
            os._exit(7)
        if late and self.mischief == "raise":
            raise ValueError("no more grains")
        rebuilds = steps if forced else steps // (50 if self.mischief == "lazy" else 5)
        return self.slower * self.pace * (1.0 + abs(self.skin - 0.1)) * steps * (2.0 if forced else 1.0), rebuilds

    def observe(self):
        factor = {"other": 0.9, "nan": float("nan")}.get(self.mischief, 1.0)
        grains = self.case.grains
        return {"position": factor * grains.position, "velocity": grains.velocity, "omega": grains.omega}


if __name__ == "__main__":
    from case import Case
    from serving import serve

    mischief, pace, folder = sys.argv[1:]
    assert not any(name.startswith(("barchan", "numba")) for name in sys.modules)
    serve(Engine(mischief, float(pace)), folder, lambda: Case.load(Path(folder).parent))
