"""A notebook is a test: its cells run one after the other, without an error, in a process of its own.

Not in a Jupyter kernel, which takes seconds to import what a test run has imported already, and whose ports another
process may be faster to take.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.chain import as_notebook
from tests.processes import new_server

_LONGEST_S = 900


def pytest_collect_file(file_path: Path, parent: pytest.Collector) -> pytest.Collector | None:
    """Notebooks are files of tests."""
    return Notebook.from_parent(parent, path=file_path) if file_path.suffix == ".ipynb" else None


class Notebook(pytest.File):
    """A file of one test."""

    def collect(self) -> Iterator[pytest.Item]:
        """That one."""
        yield Cells.from_parent(self, name="cells")


class Cells(pytest.Item):
    """All cells of a notebook."""

    def runtest(self) -> None:
        """Runs them."""
        with tempfile.TemporaryDirectory() as folder:
            output = Path(folder) / "output"
            process = new_server().Process(target=as_notebook, args=(self.path, output))
            process.start()
            process.join(_LONGEST_S)
            if process.exitcode is None:
                process.kill()
            if process.exitcode != 0:
                raise CellFailed(output.read_text(errors="replace") if output.exists() else "it did not begin")

    def repr_failure(self, excinfo: pytest.ExceptionInfo[BaseException]) -> object:
        """What the cells printed, with the traceback of the one that failed."""
        return str(excinfo.value) if isinstance(excinfo.value, CellFailed) else super().repr_failure(excinfo)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The notebook."""
        return self.path, None, self.path.name


class CellFailed(Exception):
    """A cell ended with an error, or the notebook not at all."""
