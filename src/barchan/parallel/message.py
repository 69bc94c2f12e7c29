"""Rows of several arrays in one message: one contiguous run of bytes per destination, however many fields."""

import numpy as np


def pack(arrays):
    """Arrays one after another as bytes, shape (bytes,)."""
    return (
        np.concatenate([np.ascontiguousarray(a).reshape(-1).view(np.uint8) for a in arrays]) if arrays else np.empty(0, np.uint8)
    )


class Reader:
    """Takes arrays out of a message in the order in which they were packed."""

    def __init__(self, message):
        self.message, self.at = message, 0

    def take(self, dtype, shape):
        """The next array."""
        size = int(np.prod(shape)) * np.dtype(dtype).itemsize
        part = self.message[self.at : self.at + size]
        self.at += size
        return (
            part.view(dtype).reshape(shape)
            if part.flags.aligned and part.ctypes.data % 8 == 0
            else np.frombuffer(part.tobytes(), dtype).reshape(shape)
        )
