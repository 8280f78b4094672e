"""The report of runs: one HTML page with scorecard, plots to zoom into, metrics, parameters; it works offline.

The plots are drawn in the browser by uPlot (https://github.com/leeoniya/uPlot, MIT), of which a copy is in
`activesteer/pages/templates`.
"""

from activesteer.analysis.report.groups import open_all
from activesteer.analysis.report.run_page import report_page, write_report

__all__ = ["open_all", "report_page", "write_report"]
