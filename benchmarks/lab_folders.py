"""Folders as labs would send them: ``python -m benchmarks.lab_folders [LAB ...] --out results/lab-folders``, a minute.

The virtual rig records one batch with a concealed effect (``lab_folders.yaml``). Each lab converts it to what its data
acquisition writes: a format, names, units, signs and sampling rates of its own, and a README.txt with what the lab
knows of its rig. The importer's tests share nothing with this script, so that its folders are unseen by the importer.
The concealed effect is in answer.json, outside the labs' folders. All recordings are simulated.
"""

import argparse
import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray

CAMPAIGN = Path(__file__).with_suffix(".yaml")
BATCH = "lab"
N_PER_KGF = 9.80665
# Bags have absolute times, ns since 1970.
STARTED_NS = 1_760_000_000_000_000_000
# The load's logger of the lab with two clocks: time that it shows at the drive's zero, s.
LOAD_CLOCK_AHEAD_S = 0.120


@dataclass(frozen=True)
class Run:
    """One recording before a lab converts it, in SI units; every array has the shape (n,).

    Attributes
    ----------
    id : str
    pretension_N, bend_rad : float
    motion : str
        The excitation in words.
    time_s, counts_in, counts_out, current_in_A, current_out_A, cell_drive_V, cell_load_V : ndarray
        The columns of the virtual rig's log.
    rig : mapping
        ``rig`` of the batch's batch.yaml.
    """

    id: str
    pretension_N: float
    bend_rad: float
    motion: str
    time_s: NDArray
    counts_in: NDArray
    counts_out: NDArray
    current_in_A: NDArray
    current_out_A: NDArray
    cell_drive_V: NDArray
    cell_load_V: NDArray
    rig: Mapping

    @property
    def angles_deg(self) -> tuple[NDArray, NDArray]:
        """Angles of drive and load, degrees."""
        counts = self.rig["drive"]["encoder_counts_per_rev"]
        return 360 / counts * self.counts_in, 360 / counts * self.counts_out

    @property
    def torques_Nm(self) -> tuple[NDArray, NDArray]:
        """Torques of drive and load, N m."""
        constant = self.rig["drive"]["torque_constant_Nm_per_A"]
        return constant * self.current_in_A, constant * self.current_out_A

    @property
    def sums_N(self) -> tuple[NDArray, NDArray]:
        """Sums of the cable tensions at drive and load, N."""
        cell = self.rig["drive"]["load_cell"]
        return tuple((v - cell["zero_V"]) / cell["sensitivity_V_per_N"] for v in (self.cell_drive_V, self.cell_load_V))

    @property
    def tensions_N(self) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """T1 to T4, N."""
        radius = self.rig["drive"]["pulley_radius_m"]
        (drive, load), (tau_in, tau_out) = self.sums_N, self.torques_Nm
        return tuple((s + sign * t / radius) / 2 for sign in (1, -1) for s, t in ((drive, tau_in), (load, tau_out)))

    def every(self, n: int, first: int = 0) -> "Run":
        """The same run sampled at one n-th of the rate."""
        arrays = {name: value[first::n] for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        return replace(self, **arrays)


@dataclass(frozen=True)
class Lab:
    """A lab: how it writes a recording, and what its README says of the columns."""

    write: Callable[[Run, Path], None]
    file: str
    channels: str


def read_runs(batch: Path) -> list[Run]:
    """The recordings of a batch of the virtual rig."""
    stated = yaml.safe_load((batch / "batch.yaml").read_text())
    runs = []
    for entry in stated["recordings"]:
        log = pd.read_csv(batch / entry["file"])
        columns = ("time_s", "drive_encoder_counts", "load_encoder_counts", "drive_current_A", "load_current_A")
        logged = [log[c].to_numpy() for c in (*columns, "drive_load_cell_V", "load_load_cell_V")]
        bend = sum(piece["bend_rad"] for piece in entry["conduit"])
        motion = ", ".join(f"{key} {value}" for key, value in entry["excitation"].items())
        runs.append(Run(entry["id"], entry["pretension_N"], bend, motion, *logged, stated["rig"]))
    return runs


def write_lab(name: str, runs: list[Run], out: Path) -> Path:
    """Write the folder of a lab."""
    folder = out / name
    folder.mkdir(parents=True)
    lab = LABS[name]
    rows = []
    for number, run in enumerate(runs, start=1):
        file = lab.file.format(number=number, id=run.id)
        lab.write(run, folder / file)
        bend = f"{np.degrees(run.bend_rad):.0f} deg"
        rows.append(f"{file:32s} {run.pretension_N:4g} N    {bend:8s}  {run.motion}")
    (folder / "README.txt").write_text(readme(name, lab, runs[0].rig, rows), encoding="utf-8")
    return folder


def readme(name: str, lab: Lab, rig: Mapping, rows: list[str]) -> str:
    """What a lab tells of its rig and its files."""
    side, cable, accuracy = rig["drive"], rig["cable"], rig["accuracy"]
    spring = rig["load"]["spring_stiffness_Nm_per_rad"]
    lines = "\n".join(rows)
    return f"""Cable rig, lab "{name}". The recordings are simulated (virtualrig), not measured.

RIG
Two cables (A and B) run from a drive pulley through conduits to a load pulley. Both pulleys have a diameter of
{2e3 * side["pulley_radius_m"]:g} mm. A torsion spring of {spring:g} N m/rad holds the load pulley. Each conduit is
{cable["length_m"]:g} m long with a uniform bend. From data sheets and earlier tests: a cable of this length has a
stiffness of {cable["stiffness_N_per_m"] / 1000:g} N/mm, and its friction coefficient in the conduit is about
{cable["friction_coefficient"]:g}.

SENSORS
Both encoders have {side["encoder_counts_per_rev"]:g} counts per revolution and are good to one count.
Torques are good to {1e3 * accuracy["torque_Nm"]:g} mN m, forces to {accuracy["load_cell_N"]:g} N.

CHANNELS
{lab.channels.strip()}

RECORDINGS (pretension of each cable, bend of the conduit, motion of the drive)
{lines}
Every recording starts with 0.6 s of rest.
"""


def write_csv_semicolon(run: Run, file: Path) -> None:
    """Semicolons, decimal commas, German names, units in a second line, cp1252; 500 Hz."""
    run = run.every(2)
    columns = {"Zeit": 1000 * run.time_s, "Winkel Antrieb": run.angles_deg[0], "Winkel Abtrieb": run.angles_deg[1]}
    columns |= {"Strom Antrieb": run.current_in_A, "Strom Abtrieb": run.current_out_A}
    columns |= {"Seilkräfte Antrieb": run.sums_N[0], "Seilkräfte Abtrieb": run.sums_N[1]}
    units = ["ms", "°", "°", "A", "A", "N", "N"]
    rows = [";".join(f"{value:.5f}".replace(".", ",") for value in row) for row in zip(*columns.values(), strict=True)]
    text = "\r\n".join([";".join(columns), ";".join(units), *rows]) + "\r\n"
    file.write_bytes(text.encode("cp1252"))


def write_txt_tabs(run: Run, file: Path) -> None:
    """Tabs below lines of text, moments with the sign of the load's own torque, kilogram-force; 250 Hz."""
    run = run.every(4)
    head = ["CableBench 2.3", f"Experiment:\t{run.id}", "Operator:\tM. K.", "Rate [Hz]:\t250", "Averages:\t1", ""]
    names = ["t [s]", "phi1 [deg]", "phi2 [deg]", "M1 [mNm]", "M2 [mNm]", "S1 [kgf]", "S2 [kgf]"]
    columns = [run.time_s, *run.angles_deg, 1e3 * run.torques_Nm[0], -1e3 * run.torques_Nm[1]]
    columns += [force / N_PER_KGF for force in run.sums_N]
    rows = ["\t".join(f"{value:.6f}" for value in row) for row in zip(*columns, strict=True)]
    file.write_text("\n".join([*head, "\t".join(names), *rows]) + "\n", encoding="utf-8")


def write_mat5(run: Run, file: Path) -> None:
    """A nested MATLAB struct of raw readings; the load's encoder counts the other way; 500 Hz."""
    from scipy.io import savemat

    run = run.every(2)
    drive = {"enc": run.counts_in.astype(float), "i": run.current_in_A, "cell": run.cell_drive_V}
    load = {"enc": -run.counts_out.astype(float), "i": run.current_out_A, "cell": run.cell_load_V}
    rec = {"t": run.time_s, "drive": drive, "load": load, "operator": "jl"}
    savemat(file, {"rec": rec}, oned_as="column", do_compression=True)


def write_mat73(run: Run, file: Path) -> None:
    """A MATLAB 7.3 struct with a force sensor in each cable end, in place of torques; 500 Hz."""
    import h5py

    run = run.every(2)
    radians = [np.radians(angle) for angle in run.angles_deg]
    values = dict(zip(("t", "q_drive", "q_load"), (run.time_s, *radians), strict=True))
    values |= dict(zip(("fA_drive", "fA_load", "fB_drive", "fB_load"), run.tensions_N, strict=True))
    with h5py.File(file, "w", userblock_size=512) as f:
        group = f.create_group("log")
        group.attrs["MATLAB_class"] = np.bytes_("struct")
        for name, value in values.items():
            # A column of MATLAB is a row of HDF5.
            dataset = group.create_dataset(name, data=value[None, :])
            dataset.attrs["MATLAB_class"] = np.bytes_("double")
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Mon Oct 13 09:12:44 2025 HDF5 schema 1.00 ."
    with file.open("r+b") as f:
        f.write(head.ljust(116) + bytes(8) + b"\x00\x02IM")


def write_mdf4(run: Run, file: Path) -> None:
    """Signals with units in one channel group; 1 kHz."""
    from asammdf import MDF, Signal

    values = dict(zip(("DrvAng", "LdAng"), run.angles_deg, strict=True))
    values |= {name: 1e3 * torque for name, torque in zip(("DrvTrq", "LdTrq"), run.torques_Nm, strict=True)}
    values |= dict(zip(("DrvForceSum", "LdForceSum"), run.sums_N, strict=True))
    units = {"Ang": "deg", "Trq": "mNm", "Sum": "N"}
    with MDF(version="4.10") as mdf:
        mdf.append([Signal(v, run.time_s, unit=units[name[-3:]], name=name) for name, v in values.items()])
        mdf.save(file, overwrite=True, compression=2)


def write_tdms(run: Run, file: Path) -> None:
    """LabVIEW waveforms without a time channel; the drive's motor is wired the other way; 500 Hz."""
    from nptdms import ChannelObject, TdmsWriter

    run = run.every(2)
    waveform = {"wf_increment": float(np.median(np.diff(run.time_s))), "wf_start_offset": 0.0}
    angles = run.angles_deg
    channels = [
        ("Drive", "Position", angles[0], "deg"),
        ("Drive", "Motor current", -run.current_in_A, "A"),
        ("Drive", "Load cell", run.cell_drive_V, "V"),
        ("Load", "Position", angles[1], "deg"),
        ("Load", "Motor current", run.current_out_A, "A"),
        ("Load", "Load cell", run.cell_load_V, "V"),
    ]
    with TdmsWriter(file) as writer:
        objects = [ChannelObject(g, n, v, waveform | {"unit_string": unit}) for g, n, v, unit in channels]
        writer.write_segment(objects)


def write_parquet(run: Run, file: Path) -> None:
    """Units at the end of the columns' names, time in whole microseconds, torques in N mm; 250 Hz."""
    run = run.every(4)
    columns = {"t_us": np.round(1e6 * run.time_s).astype(np.int64)}
    columns |= dict(zip(("motor_angle_deg", "joint_angle_deg"), run.angles_deg, strict=True))
    names = ("motor_torque_Nmm", "joint_torque_Nmm")
    columns |= {name: 1e3 * torque for name, torque in zip(names, run.torques_Nm, strict=True)}
    columns |= dict(zip(("motor_side_force_N", "joint_side_force_N"), run.sums_N, strict=True))
    pd.DataFrame(columns).to_parquet(file)


def write_hdf5(run: Run, file: Path) -> None:
    """Groups with units as attributes; the load's frame is mirrored; 500 Hz."""
    import h5py

    run = run.every(2)
    with h5py.File(file, "w") as f:
        f.attrs["experiment"] = run.id

        def add(name, values, unit):
            f.create_dataset(name, data=values, compression="gzip").attrs["units"] = unit

        add("time", run.time_s, "s")
        for k, (group, sign) in enumerate((("actuator", 1.0), ("tip", -1.0))):
            add(f"{group}/angle", sign * np.radians(run.angles_deg[k]), "rad")
            add(f"{group}/torque", sign * run.torques_Nm[k], "N*m")
            add(f"{group}/cable_force", run.sums_N[k], "N")


def write_ros1(run: Run, file: Path) -> None:
    """JointState, and forces without a stamp of their own; 250 Hz."""
    from rosbags.rosbag1 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC)
    types, run = store.types, run.every(4)
    names = {"/joint_states": "sensor_msgs/msg/JointState"}
    names |= dict.fromkeys(("/drive/force", "/load/force"), "std_msgs/msg/Float64")
    with Writer(file) as writer:
        topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in names.items()}
        for k, ns in enumerate(_stamps(run)):
            stamp = types["builtin_interfaces/msg/Time"](*divmod(ns, 10**9))
            header = types["std_msgs/msg/Header"](k, stamp, "")
            messages = {"/joint_states": _joint_state(types, header, run, k)}
            forces = zip(("/drive/force", "/load/force"), run.sums_N, strict=True)
            messages |= {topic: types["std_msgs/msg/Float64"](float(force[k])) for topic, force in forces}
            for topic, message in messages.items():
                writer.write(topics[topic], ns, store.serialize_ros1(message, names[topic]))


def write_ros2(run: Run, file: Path) -> None:
    """JointState, and forces along z of a WrenchStamped; 250 Hz."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    types, run = store.types, run.every(4)
    names = {"/joint_states": "sensor_msgs/msg/JointState"}
    names |= dict.fromkeys(("/drive/wrench", "/load/wrench"), "geometry_msgs/msg/WrenchStamped")
    vector = types["geometry_msgs/msg/Vector3"]
    with Writer(file, version=9) as writer:
        topics = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind in names.items()}
        for k, ns in enumerate(_stamps(run)):
            header = types["std_msgs/msg/Header"](types["builtin_interfaces/msg/Time"](*divmod(ns, 10**9)), "")
            messages = {"/joint_states": _joint_state(types, header, run, k)}
            for topic, force in zip(("/drive/wrench", "/load/wrench"), run.sums_N, strict=True):
                wrench = types["geometry_msgs/msg/Wrench"](vector(0.0, 0.0, float(force[k])), vector(0.0, 0.0, 0.0))
                messages[topic] = types["geometry_msgs/msg/WrenchStamped"](header, wrench)
            for topic, message in messages.items():
                writer.write(topics[topic], ns, store.serialize_cdr(message, names[topic]))


def _stamps(run: Run) -> list[int]:
    """Absolute times, ns."""
    return [STARTED_NS + int(ns) for ns in np.round(1e9 * run.time_s)]


def _joint_state(types, header, run: Run, k: int):
    position, effort = (np.array([one[k] for one in of]) for of in (np.radians(run.angles_deg), run.torques_Nm))
    return types["sensor_msgs/msg/JointState"](header, ["drive", "load"], position, np.zeros(0), effort)


def write_two_clocks(run: Run, file: Path) -> None:
    """A file of the drive at 1 kHz and one of the load at 500 Hz, whose clock was started earlier."""
    sides = {"drive": (run, 0, 0.0), "load": (run.every(2, first=1), 1, LOAD_CLOCK_AHEAD_S)}
    file.mkdir()
    for name, (own, k, ahead) in sides.items():
        columns = {"time_s": own.time_s + ahead, "angle_deg": own.angles_deg[k], "torque_mNm": 1e3 * own.torques_Nm[k]}
        columns |= {"force_N": own.sums_N[k]}
        pd.DataFrame(columns).to_csv(file / f"{name}.csv", index=False, float_format="%.6f")


LABS = {
    "csv-semicolon": Lab(
        write_csv_semicolon,
        "Messung_{number:02d}.csv",
        """
Names are in the first line, units in the second. "Antrieb" is the drive, "Abtrieb" the load. "Strom" is the current of
the motor: torque = 0.0234 N m/A x current. "Seilkräfte" is the sum of the two cable tensions at that end. A positive
angle of the drive pulls cable A; the load follows with the same sign; a positive torque pulls cable A.
""",
    ),
    "txt-tabs": Lab(
        write_txt_tabs,
        "{id}.txt",
        """
1 is the drive, 2 the load. phi: angle, positive pulls cable A. M1: torque of the drive on the cables. M2: torque of
the load on its pulley, so it is opposite to the torque of the cables on the load. S: both cable tensions of that end
together.
""",
    ),
    "mat-v5": Lab(
        write_mat5,
        "rec_{number:02d}.mat",
        """
Struct `rec`. t: time in s. drive and load each hold enc (counts), i (motor current, A, torque constant 0.0234 N m/A)
and cell (load cell, V: 0.1 V/N and 0.25 V without load; it measures both cable tensions of that end together). The load
encoder is mounted the other way round: it counts down when the drive pulls cable A. Currents are positive where the
torque pulls cable A (drive) or is the torque of cable A on the load (load).
""",
    ),
    "mat-v73": Lab(
        write_mat73,
        "{id}.mat",
        """
Struct `log`, saved with -v7.3. t in s, q in rad (positive pulls cable A, the load follows), f in N: a force sensor in
each cable at each end. fA_drive is the tension of cable A at the drive, and so on. There are no torque sensors.
""",
    ),
    "mdf4": Lab(
        write_mdf4,
        "{id}.mf4",
        """
Drv is the drive, Ld the load. Ang: angle of the pulley, positive pulls cable A, the load follows. Trq: torque, positive
where cable A is pulled harder than cable B. ForceSum: both cable tensions of that end together.
""",
    ),
    "tdms": Lab(
        write_tdms,
        "run{number:02d}.tdms",
        """
Groups Drive and Load. Position in degrees (positive pulls cable A, the load follows). Motor current in A, torque
constant 0.0234 N m/A; the drive's motor is wired the other way round, so its current is negative where it pulls cable
A. Load cell in V: 0.1 V/N and 0.25 V without load; it measures both cable tensions of that end together.
""",
    ),
    "parquet": Lab(
        write_parquet,
        "{id}.parquet",
        """
Units are in the names. motor is the drive, joint the load. Angles and torques are positive where cable A is pulled; the
joint follows the motor. The forces are both cable tensions of that side together.
""",
    ),
    "hdf5": Lab(
        write_hdf5,
        "{id}.h5",
        """
Units are attributes. actuator is the drive, tip the load. A positive angle and torque of the actuator pull cable A. The
frame of the tip is mirrored: its angle and torque are negative when the actuator pulls cable A. cable_force: both cable
tensions of that end together.
""",
    ),
    "ros1": Lab(
        write_ros1,
        "{id}.bag",
        """
/joint_states: drive and load, position in rad, effort in N m, positive where cable A is pulled; the load follows the
drive. /drive/force and /load/force: both cable tensions of that end together, N; recorded when they were published.
""",
    ),
    "ros2": Lab(
        write_ros2,
        "{id}",
        """
/joint_states: drive and load, position in rad, effort in N m, positive where cable A is pulled; the load follows the
drive. /drive/wrench and /load/wrench: force along z is both cable tensions of that end together, N.
""",
    ),
    "two-clocks": Lab(
        write_two_clocks,
        "{id}",
        f"""
A folder for each recording. drive.csv is logged at 1 kHz, load.csv at 500 Hz by another logger with its own clock: its
time is {LOAD_CLOCK_AHEAD_S:g} s ahead of the drive's (time of the drive = time of the load - {LOAD_CLOCK_AHEAD_S:g} s).
Angles and torques are positive where cable A is pulled; the load follows the drive. force_N: both cable tensions of
that end together.
""",
    ),
}


def main() -> None:
    """Record the batch if it is not there, and write the labs' folders."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("labs", nargs="*", metavar="LAB", help=f"of {', '.join(LABS)}; all if none is named")
    parser.add_argument("--out", type=Path, default=Path("results/lab-folders"))
    given = parser.parse_args()
    if unknown := sorted(set(given.labs) - set(LABS)):
        parser.error(f"no lab is called {', '.join(unknown)}; there are {', '.join(LABS)}")
    raw = given.out / "raw"
    if not (raw / BATCH).exists():
        command = Path(sys.executable).with_name("virtualrig")
        subprocess.run([command, "record", CAMPAIGN, "--out", raw], check=True)
    friction = yaml.safe_load(CAMPAIGN.read_text())["rig"]["effects"]["drive_pulley"]["friction"]
    answer = {"name": "pulley-friction", "place": "drive-pulley", "friction_torque_Nm": friction["torque_Nm"]}
    (given.out / "answer.json").write_text(json.dumps(answer, indent=1) + "\n")
    runs = read_runs(raw / BATCH)
    for name in given.labs or LABS:
        print(write_lab(name, runs, given.out / "labs"))


if __name__ == "__main__":
    main()
