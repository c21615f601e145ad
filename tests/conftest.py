"""Ctrl-C as in a terminal: shells start what runs in the background with it ignored."""

from __future__ import annotations

import signal

signal.signal(signal.SIGINT, signal.default_int_handler)
