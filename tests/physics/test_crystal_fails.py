"""A face-centred cubic crystal that is crushed along [001] fails at sigma1/sigma3 = 2 (1 + mu)/(1 - mu).

Contacts across the axis have opened by then, and the others, at 45 degrees, slide all at once: 4 (N + mu N) along the axis
against 2 (N - mu N) across. Source: Thornton, Geotechnique 29, 441 (1979).
"""

import numpy as np
import pytest
from crystals import DIAMETER, crystal

import barchan as bc
from barchan.measure import stress

PRESSURE, RATE = 150e3, 2.0

#: How far it is crushed, in the strain that the overlaps at the start would undo, and looks on the way.
CRUSHED, LOOKS = 6.0, 100


@pytest.mark.parametrize("friction", [0.1, 0.25, 0.4])
def test_it_fails_at_the_ratio_of_stresses_of_thornton(friction):
    """32 grains in a periodic box, the stress across held by servos: within 1 %, and never above."""
    sim, contact = crystal("FCC [100]", (2, 2, 2), PRESSURE, friction)
    sim.deformation = bc.Deformation(*(bc.StressServo(PRESSURE, max_rate=50.0) for _ in range(2)), z=-RATE)
    steps, seen = round(CRUSHED * contact.overlap / DIAMETER / (RATE * sim.dt)), []
    for _ in range(LOOKS):
        sim.run(steps // LOOKS)
        seen.append(np.diag(stress(sim).total))
    across, along = np.mean(np.array(seen)[:, :2], axis=1), np.array(seen)[:, 2]
    ratio, expected = along / across, 2.0 * (1.0 + friction) / (1.0 - friction)
    failed = int(np.argmax(ratio))
    assert 0.99 * expected < ratio[failed] < 1.001 * expected
    assert sim.touching == 4 * sim.n_grains, "those across the axis have opened"
    np.testing.assert_allclose(across[failed], PRESSURE, rtol=0.02)
    assert failed < LOOKS - 20 and ratio[-1] < ratio[failed]
