"""Rig logs to recordings.

`batch` is the format of `batch.yaml`; `readers` has one module a log format; `log` checks the table that a reader
returns; `column_checks` compares the columns of a batch's logs with its sensors; `sensor_checks` finds faulty sensors;
`calibration` converts to SI units; `ingest` is the whole line. `mis_tool` imports the public da Vinci recordings.
"""
