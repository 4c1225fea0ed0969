"""Limits of the consistency checks.

A limit lies beyond what the listed mechanisms do to a relation at the ends of their plausible ranges, and beyond the
error of the estimate itself. `benchmarks/input_mistakes.py` counts the mistakes that are found and the false alarms.
"""

# Share of its greatest speed from which an end counts as moving; window, s, over which the speed is averaged.
MOVING, SPEED_WINDOW_S = 0.3, 0.05
# Share of the pretension, plus a force in N, from which a cable counts as taut.
TAUT_SHARE, TAUT_N = 0.25, 0.3
# Share of both cables' samples that must be taut, so that they show the stiffness.
MOSTLY_TAUT = 0.5
# Share of the variance of the mean tension that the stretch must account for, so that the stiffness is determined.
# Measured: 0.64 or more in the recordings of data/raw/rich, below 0.4 in most of them if the drive's sensors come late
# by 80 ms.
LEAST_OF_STRETCH = 0.3
# Delay of one end's sensors that may turn the relation of tension and stretch, s: the largest plausible `time-skew`.
LATE_S = 0.05
# Stated mu phi from which the friction can be compared: below it noise decides.
LEAST_CAPSTAN = 0.05
# The cable that is pulled carries this many times the tension of the other: its ratio of tensions is then determined.
PULLED = 1.25
# Fewest samples of an estimate, and of one of a sensor's noise.
FEWEST_SAMPLES, NOISE_SAMPLES = 20, 100
# Noise in motion over noise at rest above which the cables stick and slip, so that the rest shows the sensor's noise.
CHATTER = 3.0

# Correlation or share of work below which a sign is wrong. With the right sign it was 0.15 or more.
WRONG_SIGN = -0.1
# The same for the energy that is lost between the ends: 0.2 or more. Without friction it is 0.
WRONG_LOSS = -0.15
# Energy that a spring seems to give over a cycle, as a share of what it exchanges, from which the encoders are
# exchanged and do not only come late. Measured, as a median over a batch: 0.00, and 0.05 or more with exchanged
# encoders; of single recordings 0.03 at most, and 0.03 or more.
SPRING_GIVES = 0.02
# Net work of the drive over the work that it exchanges, above which its torque is no load's. Measured: 0.9 or more, and
# 0.1 or less with the torque of a spring.
WORK_OF_DRIVE = 0.5
# Least area of the loop of the load angle over the drive angle that tells which end comes first. Measured: 0.03 or more
# on the rigs of data/raw, 0.02 at most where friction is so small that a filter of the drive's current turns energies.
LEAST_LAG = 0.03
# Share of the recordings that must show a wrong sign, so that the batch file is named and not the recordings.
MOST_RECORDINGS = 0.7
# Shares of a torque's largest readings (95 % quantile): below the first it is at zero, above the second it has left it.
# Noise of a torque that is read is a hundredth or less.
AT_ZERO = (0.05, 0.15)
# Fewest times that a torque comes to zero, so that its sign can be judged: a cycle has two reversals.
FEWEST_ZEROS = 2
# Rise of the share of work, or of the correlation with the angle, from which a torque has lost its sign. Magnitudes of
# the torques of data/raw gained 0.4 or more, but for holds of one step.
BETTER_WITH_SIGN = 0.3
# Quantiles of a torque, the smaller over the larger, from which it turns a pulley both ways: bearings of a single cable
# that is let go turn it by less.
BOTH_WAYS = 0.5
# Torque over radius as a share of the sum of tensions from which one cable carries all. That of a pair is zero at rest.
WHOLE_SUM = 0.7
# Units to which the times of starts are noted, s, the coarsest first: noted so, two of them may seem too near by one.
# The last is what clocks and the ends of logs are uncertain by.
NOTED_TO_S = (60.0, 1.0, 0.02)
# Correlation of the noise of two sensors above which it is that of one.
SAME_NOISE = 0.99
# Correlation of the two angles below which they are not of one run. Small strokes in much friction reach 0.7.
SAME_RUN = 0.4

# Factor by which stated and found stiffness, friction or spring may differ.
STATED_FACTOR = 3.0
# What both fastenings of a cable may yield, m/N: twice the largest plausible `termination-compliance`. It makes a
# cable of 15 kN/m look five times as soft.
END_COMPLIANCE_M_PER_N = 300e-6
# The same of a fitted stiffness. A model that lacks some physics may be off; of six batches it was 0.5 to 1.1 of the
# stated one. Units differ by more.
FITTED_FACTOR = 10.0
# Factor between the slowest and the fastest motion of the load, as mean square speed over mean square angle, from which
# recordings tell a spring from an inertia.
UNLIKE_MOTIONS = 2.0
# Frequency of the motion over the noted one. A note is no measurement, but no rig runs a third as fast as it is asked.
FREQUENCY_FACTOR = 3.0
# Travel of the load over that of the drive, both at the cable, in the recording of the greatest stroke. Friction and
# stretch only lose travel: at least 0.74 remained, and 1 / 0.74 where the ends are exchanged.
LEAST_TRAVEL, MOST_TRAVEL = 0.35, 1.6
# Travel that errors of the stated radii may seem to add: a twentieth, as of calipers on a grooved pulley of 6 mm.
MOST_TRAVEL_OF_RADII = 1.05
# Travel below the first or above the second may be that of an angle which is half or twice what it is, if another
# relation says so too: half of the most that remained (0.93), and an eighth for what is not seen; twice the least that
# usually remains (0.7).
LEAST_OF_TWICE, MOST_OF_TWICE = 0.55, 1.4
# Relative deviation within which a relation is off by just a factor.
JUST = 0.15
# Factor of the noted amplitude that points at the encoders. Alone it is no contradiction: a note is no measurement.
AMPLITUDE_FACTOR = 2.5
# Factor between the sum of tensions at rest and twice the pretension.
PRETENSION_FACTOR = 2.0
# Factor between these sums at the two ends below which what is wrong is common to both.
BOTH_ENDS_ALIKE = 1.3
# Torque over radius and sum at the load; above 1 a cable would push.
MOST_TORQUE = 1.5
# The same at the drive, where friction of the pulley's bearing and the drive train add to the cables' torque.
MOST_DRIVE_TORQUE = 5.0
# Radii of pulleys, m.
SMALLEST_RADIUS_M, LARGEST_RADIUS_M = 3e-4, 0.25
# Longest and shortest conduit or cable, m, and stated accuracy as a share of the largest range that its sensors show.
LONGEST_PATH_M, SHORTEST_PATH_M, COARSEST_ACCURACY = 100.0, 5e-3, 0.5
# Largest bend of a conduit, rad: more than nine loops. A quarter of a turn in degrees is 90.
LARGEST_BEND_RAD = 60.0
# Bend below which a conduit counts as straight, rad, and logarithm of the ratio of tensions that a straight one lacks.
STRAIGHT_RAD, STRAIGHT_LOG_RATIO = 0.3, 0.2

# Friction for each radian of stated bend, over that of every other recording with the same or a lower pretension.
FORGOTTEN_BEND = 1.75
# Scatter of a relation between recordings of one rig (standard deviation of its logarithm) where amplitude, speed and
# tension do not explain it: about twice the largest that was seen, or what labs repeat to. And the distance, in such
# deviations, from which a recording is another rig's.
SCATTER = {
    "spring": 0.06, "friction": 0.12, "stiffness": 0.15, "travel": 0.08, "pretension": 0.06, "amplitude": 0.1,
    "frequency": 0.05, "noise": 0.3,
}  # fmt: skip
OTHER_RIG = 4.0
# Factor of stroke, tension and frequency within which recordings count as alike.
ALIKE = 1.1

# Offsets (N) and drifts (N/s) of a load cell, the same in all recordings, that may make one of them seem foreign: they
# span the plausible ranges of both mechanisms. The largest error, over the lowest pretension.
CELL_OFFSETS_N, CELL_DRIFTS_N_PER_S = (-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0), (-0.15, 0.0, 0.15)
MOST_CELL_ERROR = 1.0

# Rate at which the load's lag changes from cycle to cycle, s/s, and its change over the recording, s.
DRIFT_RATE, DRIFT_S = 0.004, 0.02
# Probability with which lags that only scatter may seem to drift.
DRIFT_BY_CHANCE = 0.001
# Relative deviation of amplitude and period up to which cycles count as equal, and fewest crossings of the middle.
EQUAL_CYCLES, FEWEST_CROSSINGS = 0.05, 4

# Share of equal changes from which a channel is a copy: sensors with noise, and angles, whose counts agree by chance.
COPIED_NOISE, COPIED_ANGLE = 0.5, 0.98
# Distance of two drives' angles, in counts, up to which they may have moved alike: each is off by up to half a count.
ALIKE_STEPS = 1.01
# Changes by which pairs of recordings are compared first, and the share of them from which all are compared.
COMPARED_CHANGES, MAYBE_COPIED = 400, 0.25
# White noise over the stated accuracy, which includes it, that contradicts the accuracy: it was 1.1 at most. And the
# standard deviation of an even error of one step, as of an encoder, over the step.
NOISE_BEYOND_ACCURACY, ROUNDING = 10.0, 12**-0.5
# Fewest samples in a cycle of the motion from which the noise from sample to sample is that of a sensor. With 20 the
# motion itself is found, with 25 it is not.
NOISE_CYCLE_SAMPLES = 40
# White noise over the stated accuracy above which a channel has noise, and not only digits.
NOISE_OVER_ACCURACY = 0.1
