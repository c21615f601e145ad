"""The registry of file formats, and load() and save() over it."""
