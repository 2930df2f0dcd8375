"""A report: one self-contained HTML file that works anywhere."""

from real_bench.report.page import Chart, Report, Table, write_report
from real_bench.report.parts import Played, Tested, read_played, read_tested
from real_bench.report.pictures import data_uri

__all__ = [
    "Chart",
    "Played",
    "Report",
    "Table",
    "Tested",
    "data_uri",
    "read_played",
    "read_tested",
    "write_report",
]
