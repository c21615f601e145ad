"""The add-on: menus, a panel, and operators."""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
from bpy.props import BoolProperty, CollectionProperty, StringProperty
from bpy_extras.io_utils import ImportHelper

from nacre.targets.blender_addon.library import LIBRARY, write_library
from nacre.targets.blender_addon.nodes import PROPERTY, build
from nacre.targets.blender_addon.reading import MaterialError, one_line, read_file

bl_info = {
    "name": "nacre materials",
    "author": "The nacre authors",
    "version": (1, 0, 0),
    "blender": (4, 2, 0),
    "location": "File > Import, Properties > Material",
    "description": "Measured materials as nodes, and folders of them as asset libraries",
    "category": "Import-Export",
}


class NACRE_OT_import_materials(bpy.types.Operator, ImportHelper):
    """Add materials of nacre files to this file; none that is there is replaced."""

    bl_idname = "nacre.import_materials"
    bl_label = "Import nacre materials"
    bl_options = {"REGISTER", "UNDO"}
    filename_ext = ".json"

    filter_glob: StringProperty(default="*.json", options={"HIDDEN"})
    files: CollectionProperty(
        type=bpy.types.OperatorFileListElement, options={"HIDDEN", "SKIP_SAVE"}
    )
    directory: StringProperty(subtype="DIR_PATH", options={"HIDDEN", "SKIP_SAVE"})

    def execute(self, context: Any) -> set[str]:
        names = [each.name for each in self.files if each.name]
        paths = [Path(self.directory, name) for name in names] or [Path(self.filepath)]
        count, errors = 0, []
        if not names and not paths[0].is_file():
            self.report({"ERROR"}, "choose nacre files (.json)")
            return {"CANCELLED"}
        for path in paths:
            try:
                build(read_file(path))
                count += 1
            except MaterialError as error:
                errors.append(str(error))
        for error in errors:
            self.report({"WARNING" if count else "ERROR"}, error)
        if count:
            self.report({"INFO"}, f"{count} nacre materials added")
        return {"FINISHED" if count else "CANCELLED"}


class NACRE_OT_make_library(bpy.types.Operator):
    """Make all nacre files of a folder assets with thumbnails, in a .blend in the same folder."""

    bl_idname = "nacre.make_library"
    bl_label = "nacre folder as asset library"

    directory: StringProperty(subtype="DIR_PATH")
    filter_folder: BoolProperty(default=True, options={"HIDDEN"})
    replace: BoolProperty(
        name="Replace", description=f"Replace {LIBRARY} where the folder has one", default=False
    )
    add_to_preferences: BoolProperty(
        name="Add to Preferences",
        description="Make the folder one of the asset libraries of the preferences",
        default=False,
    )

    def invoke(self, context: Any, event: Any) -> set[str]:
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context: Any) -> set[str]:
        """Start another Blender, which leaves this session as it is."""
        self._folder = Path(bpy.path.abspath(self.directory))
        if not self.directory or not self._folder.is_dir():
            return self._failed("choose a folder")
        if (self._folder / LIBRARY).exists() and not self.replace:
            return self._failed(f"the folder has a {LIBRARY}: tick Replace, or move it")
        options = "--background", "--factory-startup", "--python-exit-code", "1", "--python"
        binary = bpy.app.binary_path  # empty where Blender is a module of Python
        words = [binary, *options, __file__] if binary else [sys.executable, __file__]
        self._printed = tempfile.TemporaryFile()  # noqa: SIM115
        self._process = subprocess.Popen(
            [*words, "--", str(self._folder)], stdout=self._printed, stderr=subprocess.STDOUT
        )
        if bpy.app.background:
            self._process.wait()
            return self._finish(context)
        manager = context.window_manager
        self._timer = manager.event_timer_add(0.5, window=context.window)
        manager.modal_handler_add(self)
        context.workspace.status_text_set(f"nacre: rendering thumbnails of {self._folder.name}")
        return {"RUNNING_MODAL"}

    def modal(self, context: Any, event: Any) -> set[str]:
        """Wait; Escape cancels."""
        stop = event.type == "ESC"
        if not stop and (event.type != "TIMER" or self._process.poll() is None):
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self._timer)
        context.workspace.status_text_set(None)
        if stop:
            self._process.terminate()
            self._process.wait()
            return self._failed("stopped")
        return self._finish(context)

    def _finish(self, context: Any) -> set[str]:
        self._printed.seek(0)
        text = self._printed.read().decode("utf-8", "replace")
        self._printed.close()
        lines = [line[len(_MARK) :] for line in text.splitlines() if line.startswith(_MARK)]
        for line in lines:
            if line.startswith("skipped "):
                self.report({"WARNING"}, line)
        if self._process.returncode:
            said = [line for line in lines if not line.startswith(("added ", "skipped "))]
            return self._failed(said[-1] if said else one_line(text[-200:]))
        if self.add_to_preferences:
            _add_library(context.preferences.filepaths.asset_libraries, self._folder)
        added = sum(line.startswith("added ") for line in lines)
        self.report({"INFO"}, f"{added} materials in {self._folder / LIBRARY}")
        return {"FINISHED"}

    def _failed(self, why: str) -> set[str]:
        self.report({"ERROR"}, f"nacre: {why}")
        return {"CANCELLED"}


class NACRE_PT_material(bpy.types.Panel):
    """Facts about an imported material."""

    bl_label = "nacre"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return bool(facts_of(context.material))

    def draw(self, context: Any) -> None:
        for label, text in facts_of(context.material).items():
            row = self.layout.split(factor=0.35)
            row.label(text=label)
            row.label(text=text)


def facts_of(material: Any) -> dict[str, str]:
    """Facts that were imported with a material, by label; users may have edited them."""
    group = material.get(PROPERTY) if material else None
    known = group.to_dict() if group is not None and hasattr(group, "to_dict") else {}
    return {str(label): str(text) for label, text in known.items()}


_MARK = "nacre: "
"""Prefix of the lines that a library's Blender prints for the one that started it."""


def _add_library(libraries: Any, folder: Path) -> None:
    """Add a folder to the asset libraries in the preferences, unless it is one."""
    paths = [Path(bpy.path.abspath(library.path)).resolve() for library in libraries]
    if folder.resolve() not in paths:
        libraries.new(name=folder.name, directory=str(folder))


def _import_menu(menu: Any, context: Any) -> None:
    menu.layout.operator(NACRE_OT_import_materials.bl_idname, text="nacre material (.json)")
    menu.layout.operator(NACRE_OT_make_library.bl_idname)


_CLASSES = NACRE_OT_import_materials, NACRE_OT_make_library, NACRE_PT_material


def register() -> None:
    for each in _CLASSES:
        bpy.utils.register_class(each)
    bpy.types.TOPBAR_MT_file_import.append(_import_menu)


def unregister() -> None:
    bpy.types.TOPBAR_MT_file_import.remove(_import_menu)
    for each in reversed(_CLASSES):
        bpy.utils.unregister_class(each)


def _main(folder: str) -> None:
    """Write the library of a folder; the exit code is 1 if that fails."""
    try:
        for line in write_library(Path(folder)):
            print(f"{_MARK}{line}", flush=True)
    except MaterialError as error:
        print(f"{_MARK}{error}", flush=True)
        # After an exception, Blender would continue and exit with code 0.
        os._exit(1)


if __name__ == "__main__":
    if "--" in sys.argv:
        _main(sys.argv[sys.argv.index("--") + 1])
    else:
        register()
