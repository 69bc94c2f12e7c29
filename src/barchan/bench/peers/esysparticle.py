"""ESyS-Particle, from Debian. A master and its workers are ranks of MPI, which wait inside MPI and spin: while it idles, it would
take a core from the code that is timed."""

from barchan.bench.peers.peer import of_debian


def find(threads, ranks):
    """One row."""
    return [of_debian("esysparticle", "esys-particle")._replace(name="esysparticle")]
