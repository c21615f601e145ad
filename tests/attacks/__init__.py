"""Small files made to harm whoever opens them, and what each of them tries.

The files are bytes made here, not kept: `python -m tests.attacks FOLDER` writes them.
"""
