"""A mismatch found, for docs/diagnosis.md: ``python benchmarks/seeded_fault.py``, two minutes on two cores.

The virtual rig records two batches with backlash at the load pulley (``seeded_fault.yaml``): one is diagnosed, the
other one is predicted with the calibrated model and with the model that the diagnosis found. All recordings are
simulated. Writes results/seeded-fault and docs/figures/seeded-fault.png.
"""

import json
import subprocess
import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

ROOT = Path(__file__).parents[1]
OUT = ROOT / "results" / "seeded-fault"
RAW, DIAGNOSIS = OUT / "raw", OUT / "diagnosis"
FIGURE = ROOT / "docs" / "figures" / "seeded-fault.png"
CAMPAIGN = Path(__file__).with_suffix(".yaml")
DIAGNOSED, HELD_OUT = "seeded-fault", "held-out"
RECORDED, CALIBRATED, FOUND = "#9a9a9a", "#0072B2", "#D55E00"
SYMBOL = {"theta_out": "θ_out", "tau_in": "τ_in", "tau_out": "τ_out", "F_drive": "F_drive", "F_load": "F_load"}
LAST_CYCLE_S = 2.5
STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e6e6e6",
    "legend.frameon": False,
    "figure.constrained_layout.use": True,
}


def command(name: str, *arguments) -> None:
    """Run a command of this environment's own; its failure is this script's."""
    subprocess.run([Path(sys.executable).with_name(name), *map(str, arguments)], check=True)


def measured_torque() -> np.ndarray:
    """Load torque (mN m) of the held-out recording's last cycle, from its log."""
    (log,) = (RAW / HELD_OUT).glob("*.csv.gz")
    recorded = pd.read_csv(log)
    # The motor current stands for the torque: 23.4 mN m/A (`torque_constant_Nm_per_A` of the campaign).
    torque = 23.4 * recorded["load_current_A"].to_numpy()
    return torque[recorded["time_s"] >= recorded["time_s"].iloc[-1] - LAST_CYCLE_S]


def predicted(model: str) -> pd.DataFrame:
    """Channels of the held-out recording's last cycle as a model of the diagnosis predicts them."""
    out = OUT / f"predicted-{model}"
    command("ccmodel", "predict", RAW / HELD_OUT, "--model", DIAGNOSIS / f"{model}.json", "--out", out)
    (file,) = out.glob("*.csv")
    table = pd.read_csv(file)
    return table[table["time_s"] >= table["time_s"].iloc[-1] - LAST_CYCLE_S]


def draw(diagnosis: dict) -> None:
    """The held-out torque loop, and the cross-validated errors of the diagnosed batch by channel."""
    (found,) = diagnosis["mechanisms"]
    (gap,) = found["parameters"]
    calibrated, extended = predicted("calibrated"), predicted("model")
    with plt.rc_context(STYLE):
        figure, (loop, bars) = plt.subplots(1, 2, figsize=(9, 3.8), width_ratios=(3, 2))
        angle = calibrated["theta_in_rad"]
        loop.plot(angle, measured_torque(), color=RECORDED, lw=2.4, label="recording (virtual rig, simulated)")
        loop.plot(angle, 1e3 * calibrated["tau_out_Nm"], "--", color=CALIBRATED, lw=1.2, label="calibrated model")
        loop.plot(angle, 1e3 * extended["tau_out_Nm"], color=FOUND, lw=1.2, label=f"with {found['name']}")
        loop.set_xlabel("drive angle θ_in (rad)")
        loop.set_ylabel("load torque τ_out (mN·m)")
        loop.set_title("held-out recording: another motion, pretension and bend", loc="left", fontsize=9)
        error = diagnosis["fit"]["error"]
        y = np.arange(len(error))
        for k, (stage, colour) in enumerate((("before", CALIBRATED), ("after", FOUND))):
            bars.barh(y + 0.36 * (k - 0.5), [e[stage] / e["noise"] for e in error.values()], 0.34, color=colour)
        bars.axvline(1.0, color="black", lw=0.8)
        bars.set_yticks(y, [SYMBOL[c] for c in error])
        bars.invert_yaxis()
        bars.set_xlabel("rms error over the noise floor, cross-validated")
        bars.set_title("diagnosed batch", loc="left", fontsize=9)
        text = f"{diagnosis['verdict']}: {found['name']} at the {found['place']}, half gap "
        text += f"{1e3 * gap['value']:.1f} mrad (90 % interval {1e3 * gap['low']:.1f} to {1e3 * gap['high']:.1f})"
        figure.suptitle(f"{text}; seeded: 30.0 mrad", fontsize=10)
        handles, labels = loop.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=3)
        figure.savefig(FIGURE, dpi=130)


def main() -> None:
    """Record, diagnose, predict and draw."""
    command("virtualrig", "record", CAMPAIGN, "--out", RAW, "--jobs", 2)
    command("ccmodel", "diagnose", RAW / DIAGNOSED, "--out", DIAGNOSIS)
    draw(json.loads((DIAGNOSIS / "diagnosis.json").read_text()))


if __name__ == "__main__":
    main()
