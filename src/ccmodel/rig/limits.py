"""Limits of the faults of a log: below them it is used with a warning, above them it is refused."""

# Samples of a recording. A log that was closed as soon as it was opened has fewer.
FEWEST_SAMPLES = 10
# Share of a log from which a start-up transient that is not compared is named.
MOST_SETTLING = 0.75
# A number from which on a cell has none: calibrated or squared, it would be infinite.
LARGEST_NUMBER = 1e100
# Rows with empty cells that may be dropped. A lost sample now and then has no effect on the others; a run of them or a
# large share may hide a reversal.
BAD_CELLS_IN_A_ROW = 3
BAD_CELLS_FRACTION = 0.01
# A step of time is a gap, not jitter, from this many median steps on.
GAP_STEPS = 1.5
# If less than this share of the time in gaps is lost in the end, later samples made up for it: the log is sampled
# unevenly and lacks no samples.
UNEVEN_FRACTION = 0.5
# Longest single gap and largest share of the duration in gaps. The drive moves at a few Hz at most, so 0.1 s can be
# interpolated; a longer gap may hide a reversal, and with it a branch of the loop.
GAP_S = 0.1
GAP_FRACTION = 0.1
# Highest speed of a pulley. Commanded speeds reach 3 rad/s, a snapping jaw reached 14 rad/s. A faster change is a
# counter that was reset, wrapped or lost counts, and the angle after it has another zero.
FASTEST_RAD_PER_S = 30.0
# Share of the samples with faster changes from which they are no jumps: the angle is in another unit.
FAST_FRACTION = 0.05
# Smaller changes are noise of a counter at any speed: at high sampling rates one count is a high speed.
LOST_COUNTS = 10
# Travel of the load, in counts and as a share of its range, during which the drive encoder may stand still. The load
# may creep less; if it moves more, the drive encoder is stuck.
OTHER_END_COUNTS = 10
OTHER_END_FRACTION = 0.25
# Travel of the drive, as a share of its range, during which the load encoder may stand still: up to there it may be
# lost motion.
WHOLE_TRAVEL_FRACTION = 0.95
# Equal samples in a row at the extreme value of a noisy channel: it is clipped.
FLAT_SAMPLES = 5
# Repeated samples, as a share, below which a channel counts as noisy for that.
FLAT_NOISE_FRACTION = 0.1
# A channel that repeats more is clipped if it stays at its extreme value this many times longer than anywhere else.
FLAT_OVER_INSIDE = 4
# Share of changes that turn the readings up or down, above which a channel without a rest counts as noisy. White noise
# turns two times in three, a smooth channel hardly ever.
NOISY_TURNS = 0.3
# Duration and samples for which a noisy channel may keep one value while the drive moves; longer, it froze.
FROZEN_S = 0.5
FROZEN_SAMPLES = 20
# Repeated samples, as a share, below which a channel counts as noisy for that: a coarse converter repeats a value now
# and then (a fifth of the samples of the public recordings), but not 20 times in a row.
FROZEN_NOISE_FRACTION = 0.5
# Samples in which each reading of a converter stands that is slower than the log. Fewer are common and harmless.
HELD_SAMPLES = 4
# Fewest changes of such a channel; share of the intervals between them that must be equal to a sample; and median
# change over the least one, which is about 1 of a converter that is coarse; share of the intervals in which the drive
# moves, which is small of a drive that goes in steps.
FEWEST_HELD, HELD_EVENLY, HELD_STEPS, HELD_MOVING = 20, 0.9, 2.0, 0.5
# Time for which a reading is held from which the recording is not what the rig did: late by 10 ms on average, it reads
# as `time-skew`, whose plausible delays begin at 2 ms and typically are 10 ms.
HELD_S = 0.02
# Share of the batch's largest drive travel below which a sensor that never changes contradicts nothing: a small motion
# may stay within what the friction of the conduits takes up.
SMALL_TRAVEL_FRACTION = 0.5
# Counts by which an encoder at rest may dither.
STILL_COUNTS = 1
# Width of the noise of an angle without a step, in standard deviations: noise of a few thousand samples spans 7 to 8.
NOISE_WIDTH_SDS = 10
# Finer steps of an angle, rad, have no effect on a model: 0.1 um of cable on a pulley of 6 mm. The angle is taken as it
# is.
FINE_STEP_RAD = 2e-5
# Share of a step by which readings may differ from its multiples: a log writes them with few digits.
OFF_STEP = 0.1
# Share of the readings that may differ by more.
OFF_STEP_FRACTION = 0.01
# Travel of the load, in counts, that its torque must cause against its spring before a still encoder counts as stuck.
MOVED_GRAINS = 5
# Range of a torque, in standard deviations of its noise, that is no noise.
ABOVE_NOISE_SDS = 10
# Duration of an initial rest. Less is the time to the first count of a motion.
SHORTEST_REST_S = 0.1
# Steps of time that no log of a moving rig has, s: the times are in ms or µs, or in days.
SHORTEST_STEP_S, LONGEST_STEP_S = 5e-6, 0.2
# A change of an angle stands out if it is this factor and so many counts above all changes of the samples near it.
OUTSTANDING_FACTOR, OUTSTANDING_GRAINS, NEAR_SAMPLES = 2.5, 2.0, 12
# An impossible reading of an analog channel: it is farther from the median of so many neighbours on each side than any
# other reading is from its own by this factor, and by this share of the channel's range (between two quantiles) and so
# many of its smallest steps. Practice: of 269 logs, 102 of them measured ones, none has a factor above 2.6.
OUTLIER_NEIGHBOURS, OUTLIER_FACTOR, OUTLIER_SHARE, OUTLIER_GRAINS = 5, 4.0, 0.05, 5
OUTLIER_RANGE = (0.005, 0.995)
# At the ends of a log it is also beyond both adjacent readings by this share of that distance, or else this many ranges
# from the median of the log. Chosen: beside a spike in a steep motion the share is up to a half.
OUTLIER_SINGLE, OUTLIER_AT_ENDS = 2 / 3, 4
# Share of a sensor's stated range by which a reading at its end may lie outside.
BEYOND_RANGE = 0.01
# Share of the samples up to which frequent outliers are looked for.
MOST_OUTLIERS = 0.3
