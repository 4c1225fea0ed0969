"""The comparison of licence texts with the table of licences."""

import pytest

from benchmarks.licence_texts import has_wording, rows
from benchmarks.sbom import PAGE

MIT = "copyright (c) somebody permission is hereby granted, free of charge, to any person"


@pytest.mark.parametrize(
    ("licence", "agrees"),
    [("MIT", True), ("MIT License", True), ("BSD-3-Clause", False), ("MIT AND BSD-3-Clause", False), ("", False)],
)
def test_a_text_has_the_wording_of_every_licence_that_is_named(licence, agrees):
    assert has_wording(licence, MIT) == agrees


def test_the_table_is_read_row_by_row():
    found = rows(PAGE.read_text(encoding="utf-8"))
    assert len(found) > 150
    assert all(name and version and licence for name, version, licence in found)
