"""The report of runs: one HTML page with scorecard, plots to zoom into, metrics and parameters.

It works offline.

uPlot (https://github.com/leeoniya/uPlot, MIT) draws the plots in the browser; a copy of it is in
`activesteer/pages/templates`.

In: recordings.
Out: one HTML page.
"""

from activesteer.analysis.report.groups import open_all
from activesteer.analysis.report.run_page import report_page, write_report

__all__ = ["open_all", "report_page", "write_report"]
