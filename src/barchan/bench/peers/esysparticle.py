"""ESyS-Particle, from Debian."""

from barchan.bench.peers.peer import of_debian


def find(threads, ranks):
    """One row."""
    return [of_debian("esysparticle", "esysparticle")]
