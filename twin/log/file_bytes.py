"""The bytes of a file, which need not fit into memory."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from typing import BinaryIO

from twin.errors import InputError

SMALLEST_WINDOW, LARGEST_WINDOW = 1 << 16, 1 << 22


class FileBytes:
    """The bytes of an open file by their place; raises InputError where the disk refuses them."""

    def __init__(self, stream: BinaryIO, size: int) -> None:
        self._stream = stream
        self._size = size

    def __len__(self) -> int:
        return self._size

    def part(self, start: int, stop: int) -> bytes:
        """The bytes from ``start`` to before ``stop``, or as many as there are."""
        try:
            self._stream.seek(start)
            return self._stream.read(max(0, min(stop, self._size) - start))
        except OSError as error:
            raise InputError(f"cannot be read: {error.strerror or error}") from error

    def windows(self, start: int, stop: int, beyond: int) -> Iterator[tuple[int, int, bytes]]:
        """Place, length and bytes of windows side by side, each with ``beyond`` bytes of the next.

        They grow, as what is searched for is mostly near.
        """
        length = SMALLEST_WINDOW
        while start < stop:
            own = min(length, stop - start)
            yield start, own, self.part(start, start + own + beyond)
            start, length = start + own, min(2 * length, LARGEST_WINDOW)

    def checksum(self, start: int, stop: int) -> int:
        """CRC-32 of the bytes from ``start`` to before ``stop``."""
        crc = 0
        for _, _, data in self.windows(start, stop, 0):
            crc = zlib.crc32(data, crc)
        return crc

    def last(self, text: bytes, stop: int) -> int | None:
        """Where ``text`` begins for the last time, all of it before ``stop``."""
        found = None
        while found is None and stop >= len(text):
            start = max(0, stop - LARGEST_WINDOW)
            place = self.part(start, stop).rfind(text)
            found = start + place if place >= 0 else None
            stop = start + len(text) - 1 if start else 0
        return found
