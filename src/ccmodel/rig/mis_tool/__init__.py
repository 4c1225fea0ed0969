"""Import of the public recordings of da Vinci instruments, MRDLab/mis-tool-characterization.

J. J. O'Neill, T. K. Stephens, T. M. Kowalewski, "Evaluation of Torque Measurement Surrogates as Applied to Grip
Torque and Jaw Angle Estimation of Robotic Surgical Tools", IEEE RA-L 3(4), 3027-3034, 2018,
doi 10.1109/LRA.2018.2849862; data under the Open Database License 1.0.

Every folder of trials becomes a batch. The spindle is the drive pulley, the jaw the load pulley; angle and torque were
measured at both, nothing between them. `trial` reads a file, `signs` derives the signs of the sensors, `description`
writes `batch.yaml`, the logs, licence and source, `importing` converts the whole data set or one folder of it.
"""

from ccmodel.rig.mis_tool.importing import Imported, import_batch, import_mis_tool

__all__ = ["Imported", "import_batch", "import_mis_tool"]
