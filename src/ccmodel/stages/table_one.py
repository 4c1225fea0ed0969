"""Settings of the study of Table I -> its tables and figure."""

from collections.abc import Callable
from pathlib import Path

from ccmodel import provenance
from ccmodel.compare.table_one.rank import rankings, room_for_torque
from ccmodel.compare.table_one.settings import TableOne
from ccmodel.compare.table_one.study import run_study
from ccmodel.report.figures import save_figure
from ccmodel.report.table_one import table_one_figure
from ccmodel.stages.files import write_json
from ccmodel.typed import load_yaml_model


def table_one(
    settings: Path, out: Path, figure: Path, cores: int = 1, tell: Callable[[str], None] = lambda text: None
) -> str:
    """Run the study; one line on what was tried.

    Writes cases.csv, pairs.csv, failed.csv, ranking.csv and summary.json into `out`, and the figure.

    Raises
    ------
    InputError
        If the settings cannot be used.
    """
    study = load_yaml_model(settings, TableOne)
    found = run_study(study, cores, tell)
    ranked = rankings(found.singles, found.pairs, study)
    out.mkdir(parents=True, exist_ok=True)
    tables = {"cases": found.singles, "pairs": found.pairs, "failed": found.failed, "ranking": ranked}
    for name, table in tables.items():
        table.to_csv(out / f"{name}.csv", index=False, float_format="%.6g")
    summary = {
        "cases": len(found.singles),
        "pairs": len(found.pairs),
        "failed": len(found.failed),
        "conditions_left_out": found.left_out,
        "room_for_tau_in_percent": room_for_torque(found.singles, study),
        "provenance": provenance.of_inputs([settings], settings.parent),
    }
    write_json(out / "summary.json", summary)
    figure.parent.mkdir(parents=True, exist_ok=True)
    save_figure(table_one_figure(ranked, found.singles, study), figure)
    return (
        f"{len(found.singles)} cases of one effect and {len(found.pairs)} of two; {len(found.failed)} could not be "
        f"run, {found.left_out} conditions are beyond the sensors' ranges: {out / 'ranking.csv'}, {figure}"
    )
