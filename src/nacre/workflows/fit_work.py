"""Fits of materials as work for a cluster: a measured file is read from a path, or sent."""

from __future__ import annotations

import hashlib
import tempfile
from dataclasses import dataclass
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import numpy.typing as npt

from nacre.errors import FormatError
from nacre.io.files import digest
from nacre.workflows.executor import Job
from nacre.workflows.fitting import Fitting
from nacre.workflows.material import Fit, explain, fit_file
from nacre.workflows.worker import Here, Unread, Work


@dataclass(frozen=True)
class Fits(Work[Job, Fit]):
    """See :class:`nacre.workflows.worker.Work`; an item is an absolute path and a SHA-256."""

    fitting: Fitting

    verb = "fit"
    kept = "finished fits are kept, run again to continue"

    @property
    def digest(self) -> str:
        return self.fitting.digest

    def code(self) -> str | None:
        return self.fitting.code()

    def check(self) -> None:
        self.fitting.check()

    def pack(self, job: Job, *, send: bool) -> tuple[Any, npt.NDArray[Any] | None]:
        content = np.fromfile(job.path, np.uint8) if send else None
        sent = b"" if content is None else content.data
        sha256 = hashlib.sha256(sent).hexdigest() if send else digest(job.path)
        return (str(job.path.absolute()), sha256), content

    def do(self, item: Any, content: npt.NDArray[Any] | None, here: Here) -> Fit | Unread:
        path, sha256 = Path(item[0]), item[1]
        if content is None:
            try:
                found = digest(path)
            except FormatError as error:
                return Unread(f"on worker {here.address}: {explain(error, path)}")
            if found != sha256:
                return Unread(f"on worker {here.address}: is another file, with SHA-256 {found}")
            return fit_file(path, self.fitting, here.report)
        with tempfile.TemporaryDirectory(dir=here.folder, ignore_cleanup_errors=True) as folder:
            path = Path(folder) / PurePath(path).name
            content.tofile(path)
            return fit_file(path, self.fitting, here.report)

    def failed(self, job: Job, error: Exception) -> Fit:
        return Fit(error=explain(error, job.path))
