"""A reproduced paper as a page: Markdown with tables of printed and computed values, and its figures as PNG files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from powertrain.reproductions.papers import Paper, Picture, paper
from powertrain.reproductions.table import Row, Table, Tally

VERDICTS = {
    "agrees": "✓",
    "corrected": "✓ corrected",
    "given": "given",
    "computed only": "",
    "not reproducible": "not reproducible",
    "differs": "differs",
    "DIFFERS": "**differs**",
}
HEAD = ("quantity", "unit", "source", "printed", "computed", "agreement", "remark")


def write_report(which: str | Paper, folder: str | Path, *, progress: bool = False, dpi: int = 120) -> Path:
    """Compute the tables and figures of a paper and write them.

    Parameters
    ----------
    which : str or Paper
        A name in ``PAPERS``, or a paper.
    folder : path
        Where the page <name>.md and its pictures <name>-<picture>.png go; it is made.
    progress : bool
        A progress bar.
    dpi : int
        Resolution of the pictures.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    ParameterError
        For a name that is not in ``PAPERS``.
    """
    from tqdm.auto import tqdm

    about = paper(which) if isinstance(which, str) else which
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    with tqdm(total=len(about.tables) + len(about.pictures), desc=about.name, disable=not progress) as bar:
        tables = []
        for compute in about.tables:
            tables.append(compute())
            bar.update()
        for picture in about.pictures:
            _save(picture, target / file_name(about, picture), dpi)
            bar.update()
    page = target / f"{about.name}.md"
    page.write_text(markdown(about, tables), encoding="utf-8")
    return page


def markdown(about: Paper, tables: Sequence[Table]) -> str:
    """The page's text."""
    parts = [f"# {about.title}", about.citation, about.summary, f"Of the rows below, {Tally(list(tables))}."]
    for table in tables:
        parts += [f"## {table.title}", *([table.note] if table.note else []), markdown_table(table.rows)]
    if about.pictures:
        parts.append("## Figures")
    parts += [f"![{p.caption}]({file_name(about, p)})\n\n{p.caption}" for p in about.pictures]
    return "\n\n".join(parts) + "\n"


def markdown_table(rows: Sequence[Row]) -> str:
    """Rows as a Markdown table; the column of remarks only where there are some."""
    remarks = any(row.remark or row.right or row.differs for row in rows)
    head = HEAD if remarks else HEAD[:-1]
    lines = [head, tuple("---:" if name in ("printed", "computed") else "---" for name in head)]
    for row in rows:
        cells = (row.quantity, row.unit, row.source, row.printed, row.shown, VERDICTS[row.verdict], _remark(row))
        lines.append(cells[: len(head)])
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines)


def file_name(about: Paper, picture: Picture) -> str:
    """A picture's file, next to the page."""
    return f"{about.name}-{picture.name}.png"


def _remark(row: Row) -> str:
    right = f"should be {row.right}" if row.right is not None else ""
    why = row.differs if row.verdict == "differs" else ""
    return "; ".join(part for part in (right, row.remark, why) if part)


def _save(picture: Picture, path: Path, dpi: int) -> None:
    import matplotlib.pyplot as plt

    figure = picture.draw()
    figure.savefig(path, dpi=dpi)
    plt.close(figure)
