"""What is measured goes before what else the machine does."""

import atexit
import os
from pathlib import Path


def raise_priority():
    """Of this process, and of all that it starts. False: not permitted. Linux weighs sessions first,
    then what runs in them."""
    try:
        os.nice(-19)
        group = Path("/proc/self/autogroup")
        if group.exists():
            group.write_text("-19")
            atexit.register(group.write_text, "0")
    except OSError:
        return False
    return True
