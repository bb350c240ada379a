"""The test's side of shim.c: runs programs whose allocations fail where the test says."""

import mmap
import struct
import tempfile

from e2e.daemon import BUILD

# As in shim.c.
WORDS = ("armed", "seen", "first", "last", "failed", "hashes_most", "clock_offset", "accept_pause",
         "live", "hold", "where_length")
WHERE, HASHES = 8000, 1 << 20
HEAD = 8 * len(WORDS)
DAY = 86400


class Control:
    """The memory that the shim maps; its words are attributes."""

    def __init__(self):
        self.__dict__["file"] = tempfile.NamedTemporaryFile(prefix="fault-")
        self.file.truncate(HEAD + WHERE + 8 * HASHES)
        self.__dict__["memory"] = mmap.mmap(self.file.fileno(), 0)

    def __getattr__(self, name):
        if name not in WORDS:
            raise AttributeError(name)
        return struct.unpack_from("<q", self.memory, 8 * WORDS.index(name))[0]

    def __setattr__(self, name, value):
        struct.pack_into("<q", self.memory, 8 * WORDS.index(name), value)

    def close(self):
        self.memory.close()
        self.file.close()

    def set(self, first=0, last=None, hashes=0):
        """What happens once it is armed."""
        self.armed = 0
        self.seen = self.failed = self.where_length = 0
        self.first, self.last = first, first if last is None else last
        self.hashes_most = hashes

    def where(self):
        """The call stack of the allocation that failed, from malloc outwards."""
        text = self.memory[HEAD:HEAD + min(self.where_length, WHERE)]
        return text.decode("utf-8", "replace").splitlines()

    def places(self):
        """Numbers of allocations, one for each call stack that was written down."""
        count = min(self.seen, self.hashes_most, HASHES)
        hashes = struct.unpack_from(f"<{count}Q", self.memory, HEAD + WHERE)
        first = {}
        for number, value in enumerate(hashes, 1):
            first.setdefault(value, number)
        return sorted(first.values())

    def environment(self, at_main=False):
        more = {"LD_PRELOAD": str(BUILD / "tests" / "fault_shim.so"),
                "FAULT_CONTROL": self.file.name}
        return {**more, "FAULT_MAIN": "1"} if at_main else more
