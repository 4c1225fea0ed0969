"""The page of a run, results/index.html: one file with all that it shows, in which every section has a module here."""

from ccmodel.report.page.writing import left_out_of, write_page, write_report

__all__ = ["left_out_of", "write_page", "write_report"]
