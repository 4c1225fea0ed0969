"""The studies: recordings against the model, one folder for each.

A study is a folder with

1. ``settings.py``: its keys of the configuration, a class on `ccmodel.studies.settings.StudySettings` that also states
   the runs that the study needs, the tables and figures that it makes and what the figures show,
2. ``study.py``: ``SETTINGS``, that class, and ``judge(settings, runs, measuring)``, the computation, which returns an
   `ccmodel.studies.run.Outcome`,
3. ``figure.py``: its figures, if there is more to it than the figures; a figure with recordings says in its title
   which batches were measured and which simulated (`ccmodel.studies.variables.batches_by_origin`), and
   `ccmodel.studies.run.run_study` stamps and saves it,
4. ``part.html.j2``: its part of the page; `ccmodel.report.page.write_page` gives it ``parts``, and takes the figures
   to which it refers by their paths in the results folder into the page,

and a field of `ccmodel.config.Config`. The rule in ``workflow/rules/studies.smk`` and the page take it from there.

`diagnosis` belongs to one batch and has a rule and a page of its own; `table_one` has settings, a command and no part
of the page.
"""
