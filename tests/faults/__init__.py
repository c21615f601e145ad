"""Faults in the middle of long commands: kills, stops, full disks, changed sources, lost workers.

`python -m tests.faults` tries all of them on every command of :data:`tests.faults.commands.LONG`.
"""
