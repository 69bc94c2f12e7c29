"""What the contacts of a law store: the text of a loop that ``generate.py`` adds for a law that tells it."""

ENERGIES = '''

@kernel(parallel=True)
def barchan_energies(overlap, radius_first, radius_second, radius_eff, pair, table, memory, energies):
    """Energy in the normal force of each contact and in its tangential springs, (2, k): written into ``energies``.

    Args:
        overlap, radius_first, radius_second, radius_eff: (k,).
        pair: (k,) column of ``table``.
        memory: (width, k)."""
    for c in prange(overlap.shape[0]):
        energies[0, c], energies[1, c] = {call}
'''
