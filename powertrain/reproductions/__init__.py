"""The tables and figures of the four papers, printed beside computed.

Nothing here knows a result of a paper but as the text it is compared with: what is computed comes from the library's models.
"""

from __future__ import annotations

from powertrain.reproductions.papers import PAPERS, Paper, Picture, paper
from powertrain.reproductions.report import write_report
from powertrain.reproductions.table import Row, Table, Tally

__all__ = ["PAPERS", "Paper", "Picture", "Row", "Table", "Tally", "paper", "write_report"]
