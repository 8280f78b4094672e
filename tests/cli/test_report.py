"""`activesteer report`: a page of the user's runs."""

from __future__ import annotations

SHORT = ("--set", "settle_s=0", "--set", "duration_s=0.5")


def test_report_is_made_of_files_and_says_where_it_is(call, tmp_path):
    assert call("run", "straight_line", "-c", "none", "-c", "ars", *SHORT).status == 0
    told = call("report", "runs/straight_line-none.mcap", "runs/straight_line-ars.mcap")
    assert (told.status, told.out, told.err) == (0, "report: report.html\n", "")
    page = (tmp_path / "report.html").read_text()
    assert "2 runs of 1 manoeuvre" in page
    assert "duration 0.5 s (duration_s)" in page  # what was changed
    again = call("report", "runs/straight_line-none.mcap", "-o", "one.html")
    assert again.out == "report: one.html\n"


def test_what_cannot_be_reported_is_answered(call, tmp_path):
    told = call("report", "nothing.mcap")
    assert told.status == 1
    assert told.err.startswith("activesteer: cannot read nothing.mcap: No such file")
    (tmp_path / "text.mcap").write_text("not a recording")
    told = call("report", "text.mcap")
    assert told.status == 1
    assert "text.mcap is not an MCAP file" in told.err
    assert not (tmp_path / "report.html").exists()
