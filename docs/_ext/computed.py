"""What is computed for the pages, once for a state of the library: executed pages, examples, reproduced papers.

Results lie in docs/_computed with the fingerprint of what they were computed from. ``-D recompute=0`` does not look at the library's.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import multiprocessing
import os
import pkgutil
import runpy
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parents[1]
ROOT = DOCS.parent
RESULTS = DOCS / "_computed"
EXECUTED = ("vehicles", "howto", "theory", "tutorial")
"""Folders whose pages are executed where they have Python blocks; what takes long first."""
STAMP = "fingerprint.txt"


@dataclass(frozen=True)
class Job:
    """Something to compute: a kind and a name; ``source`` is the text that tells what."""

    kind: str
    name: str
    source: Path

    @property
    def folder(self) -> Path:
        """Where its results go."""
        return RESULTS / self.kind / self.name

    def fingerprint(self, library: str) -> str:
        """Of everything that the results depend on: the library, and the source."""
        return f"{library}\n{hashlib.sha256(self.source.read_bytes()).hexdigest()}"


def jobs() -> list[Job]:
    """Everything that is computed, what takes long first."""
    from powertrain.reproductions import PAPERS

    papers = [Job("paper", name, ROOT / "powertrain" / "reproductions" / f"{PAPERS[name]}.py") for name in PAPERS]
    examples = [Job("example", path.stem, path) for path in sorted((ROOT / "examples").glob("[0-9]*.py"))]
    return [*papers[::-1], *examples[::-1], *(Job("page", name, DOCS / f"{name}.md") for name in executed_pages())]


def executed_pages() -> list[str]:
    """The names of the pages with Python blocks, in the folders of such pages."""
    pages = [path for folder in EXECUTED for path in sorted((DOCS / folder).glob("*.md"))]
    return [
        path.relative_to(DOCS).with_suffix("").as_posix()
        for path in pages
        if "\n```python\n" in path.read_text(encoding="utf-8")
    ]


def library() -> str:
    """The fingerprint of the library's files."""
    files = [
        p
        for name in ("powertrain", "components", "vehicles")
        for s in ("py", "csv")
        for p in (ROOT / name).rglob(f"*.{s}")
    ]
    whole = hashlib.sha256()
    for path in sorted({p.resolve() for p in files}):
        if "cli" not in path.parts:
            whole.update(path.read_bytes())
    return whole.hexdigest()


def compute(*, recompute: bool = True, report: Callable[[str], None] = print) -> None:
    """Compute what is missing or out of date, each job in its own process, and report the processor time of each.

    Without ``recompute`` a change of the library does not count. Errors: whatever a job raises, with its traceback.
    """
    state = library()
    wanted = [job for job in jobs() if not _is_there(job, job.fingerprint(state), recompute)]
    if not wanted:
        return
    os.environ["PYTHONPATH"] = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    # A process that has imported the library once is forked for each job: importing would take a third of the time.
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["matplotlib.backends.backend_agg", "matplotlib.pyplot", *_modules()])
    with ProcessPoolExecutor(min(os.cpu_count() or 1, 4), context, max_tasks_per_child=1) as pool:
        done = {pool.submit(perform, job): job for job in wanted}
        for finished in as_completed(done):
            job, seconds = done[finished], finished.result()
            (job.folder / STAMP).write_text(job.fingerprint(state), encoding="utf-8")
            report(f"{job.kind} {job.name}: {seconds:.1f} s")


def _modules() -> list[str]:
    """All modules of the library but the command line's."""
    import powertrain

    names = [module.name for module in pkgutil.walk_packages(powertrain.__path__, "powertrain.")]
    return [name for name in names if not name.startswith(("powertrain.cli", "powertrain.__main__"))]


def _is_there(job: Job, fingerprint: str, recompute: bool) -> bool:
    stamp = job.folder / STAMP
    if not stamp.is_file():
        return False
    there = stamp.read_text(encoding="utf-8")
    return there == fingerprint if recompute else there.splitlines()[1] == fingerprint.splitlines()[1]


def perform(job: Job) -> float:
    """Do one job, warnings being errors, in an empty folder: programs on the pages write files where they stand. Gives the seconds."""
    import matplotlib as mpl

    mpl.use("Agg")
    warnings.simplefilter("error")
    job.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch, contextlib.chdir(scratch):
        if job.kind == "page":
            from executed import run_page

            run_page(job.source, job.folder)
        elif job.kind == "paper":
            from powertrain.reproductions import write_report

            write_report(job.name, job.folder, dpi=100)
        else:
            printed = run_script(job.source, str(job.folder / "picture.png"))
            (job.folder / "printed.json").write_text(json.dumps(printed), encoding="utf-8")
    return time.process_time()


def run_script(script: Path, *arguments: str) -> str:
    """What a script prints."""
    said = io.StringIO()
    sys.argv = [str(script), *arguments]
    with contextlib.redirect_stdout(said):
        runpy.run_path(str(script), run_name="__main__")
    return said.getvalue()
