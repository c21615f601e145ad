"""What every test starts from: signals as in a terminal, and a folder for states of its own."""

from __future__ import annotations

import os
import signal
import tempfile

# Shells start what runs in the background with Ctrl-C ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ.setdefault("NACRE_STATE", tempfile.mkdtemp(prefix="nacre-state-"))
# As many processes as cores run tests: more threads would wait for one another.
os.environ.setdefault("OMP_NUM_THREADS", "1")
