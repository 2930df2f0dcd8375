"""A report: one self-contained HTML file that works anywhere."""

from real_bench.report.page import Chart, Report, Table, write_report
from real_bench.report.parts import RecordingEntry, ResultEntry, read_played, read_tested
from real_bench.report.pictures import data_uri

__all__ = [
    "Chart",
    "RecordingEntry",
    "Report",
    "ResultEntry",
    "Table",
    "data_uri",
    "read_played",
    "read_tested",
    "write_report",
]
