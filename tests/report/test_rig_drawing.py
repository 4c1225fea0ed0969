"""The drawing of the rig: a name stands at what it names."""

import re

import jinja2
import pytest


@pytest.mark.parametrize("single_cable", [False, True])
@pytest.mark.parametrize("pulley", ["drive pulley", "load pulley"])
def test_the_name_of_a_pulley_stands_below_it(pulley, single_cable):
    template = jinja2.Environment(loader=jinja2.PackageLoader("ccmodel", ".")).get_template("report/rig.svg.j2")
    drawing = str(template.module.rig([], "the rig", single_cable))
    name = re.search(rf'<text x="(\d+)" y="(\d+)"[^>]*>{pulley}<', drawing)
    circle = re.search(rf'part" cx="{name[1]}" cy="(\d+)" r="(\d+)"', drawing)
    assert circle, f"'{pulley}' is at x = {name[1]}, where no pulley is"
    bottom = int(circle[1]) + int(circle[2])
    assert bottom < int(name[2]) < bottom + 25
