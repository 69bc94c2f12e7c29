"""Puts rows of fields into messages."""

from barchan.kernels.compiler import kernel


@kernel()
def pack_rows(field, rows, begin, message):
    """Write the ``rows`` of ``field`` (n, width) into the columns of ``message`` from ``begin`` on."""
    for q in range(rows.shape[0]):
        for c in range(field.shape[1]):
            message[q, begin + c] = field[rows[q], c]
