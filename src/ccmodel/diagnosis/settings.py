"""Every number that decides something in a diagnosis, in the order of its stages.

Each entry gives meaning and unit, and why it has this value. Three kinds of reason occur. *Stated*: the log format says
so. *Practice*: set by hand from the leave-one-out mean squares of correct and wrong models on some seventy practice
cases of the virtual rig and 49 cases of an earlier proof; the present proof's cases have other seeds. `make
diagnosis-settings` computes the same figures on new practice cases. *Chosen*: a convention, or a compromise between
time and completeness, without a measurement.
"""

import numpy as np

# --- Observations: the samples that are compared

# Least time between compared samples, s, and most samples of a recording. Chosen: an eighth of the shortest event of
# such rigs, a reversal's presliding at 1 Hz; further samples cost time and are correlated.
STEP_S, MOST_SAMPLES = 0.008, 2000
# Most recordings that are compared. Chosen: a candidate's fit of 100 takes some 1,500 of the runs that a diagnosis has,
# and their whitened errors some 2 GB.
MOST_RECORDINGS = 100

# --- Calibration: the paper's model fitted to the batch

# Bounds of the cable stiffness (N/m), the friction coefficient and the load's spring (N m/rad); an estimate further out
# widens them tenfold beyond itself. Chosen: from elastic bands to ropes, from PTFE in oil to dry rubber.
STIFFNESS_N_PER_M, FRICTION, LOAD_NM_PER_RAD = (1e2, 1e7), (0.005, 1.5), (1e-4, 10.0)
# Bounds of the initial tension over the stated pretension, where it is not observed at rest. Chosen.
PRETENSION_SHARE = (0.01, 100.0)
# Bounds of the load pulley's radius over its estimate, where the initial tension is not observed. Chosen.
RADIUS_RATIO = (0.3, 3.0)
# Start and highest value of a spring parallel to a measured load torque, over the drive's torque range per radian.
# Chosen.
PARALLEL_SPRING = (0.1, 10.0)
# Evaluations and tolerance of the first fit, which only gives a point about which to whiten. Chosen.
FIRST_FIT_EVALUATIONS, FIRST_FIT_TOLERANCE = 20, 1e-4

# --- Whitening: the covariance of the errors

# Standard deviation of the friction coefficient from run to run, over its mean. Stated: recordings of one
# condition repeat to about 1 % in friction (docs/rig-log-format.md).
FRICTION_SPREAD = 0.01
# Range of a recording's friction over the model's about which its errors are linearised. Chosen: four stated spreads. A
# model that needs more is wrong, and linearised there the errors of the right one would be wrong too.
OWN_FRICTION = (0.96, 1.04)
# Standard deviation of the initial tension from run to run, over its mean, where it is not observed. Stated, likewise.
PRETENSION_SPREAD = 0.01
# Weight of a stated spread beside the spread that recordings show, as degrees of freedom (nu0). Chosen: a stated spread
# may be wrong by a factor of two; with 4, a spread of more than 2.4 times the stated one has a probability of 1 %.
SPREAD_FREEDOM = 4
# Distance of two motions over the stroke, and of their durations, within which they are repeats. Chosen.
SAME_MOTION = 0.01
# The same of a measured load torque or motion that is the model's input. Chosen: what a brake or a hand repeats to.
SAME_LOAD = 0.05
# Fewest recordings whose scatter or trend is looked at, and the largest spread that their scatter, without repeats, may
# give, over the stated one. Chosen: what differs from run to run by more is to be found, not to be allowed for.
FEWEST_FOR_SCATTER, MOST_SCATTER = 4, 2.0
# Log Bayes factor below which friction differs between recordings otherwise than from run to run. Chosen: odds of five
# (p = 0.018).
FRICTION_SCATTERS = -1.6
# Where it does: significance level, corrected for the number of recordings, at which the friction of one deviates from
# that of the others, and the largest share of the recordings that may. Chosen: with more, it is not clear which ones
# the others are.
FRICTION_DEVIATES, MOST_DEVIATING = 0.01, 0.25
# Significance level of a trend of friction, about which scatter then counts. Chosen: a drift by 15 % over seven or more
# recordings always has one.
TREND_LEVEL = 0.002
# Standard deviation of a batch's friction over the rig's; it adds to `FRICTION_SPREAD`, that from run to run. Chosen:
# twice the latter; between two days the cable settles anew in its conduit, and its temperature differs.
FRICTION_BETWEEN = 0.02
# Standard deviation of a batch's initial tension over its stated one, relative to that of the rig, where it is not
# observed at rest. Chosen: what a scale or a mark on a tensioner repeats to.
PRETENSION_BETWEEN = 0.05
# Bounds of both ratios, and of a recording's friction over the mean in the first fit. Chosen: far outside.
BETWEEN_BOUNDS = (0.2, 5.0)
# Standard deviation of the curvature of a cable's initial tension between its ends, over the largest that friction can
# hold. Chosen: earlier motions leave a profile that the rest shows at the ends only.
CURVATURE_SPREAD = 0.15
# Largest curvature about which a recording's errors are linearised, in these standard deviations. Chosen: two; where a
# cable goes slack or slips late, its effect is far from linear.
OWN_CURVATURE = 2.0
# Standard deviation of the part of a state's posterior mean that lies beyond its range. Chosen: the mean is linear in
# the errors, so that it may leave the range by a little.
BEYOND_STATE = 0.1
# Length over which friction builds up at a contact that counts as rigid, m, as a standard deviation. Chosen: a fifth of
# the shortest one that is presliding. The tension after a reversal rises with the square root of the travel, so that
# recordings at 125 Hz show a length of 0.3 um.
BUILD_UP_M = 1e-6
# Standard deviation of the load's position in its gap: uniform from -1 to 1.
GAP_SPREAD = 1 / np.sqrt(3)
# Positions in the gap about which the covariance is linearised, the first where nothing speaks for another. Chosen.
GAP_POSITIONS = (0.0, -1.0, 1.0)

# --- Candidate fits

# Relative tolerance of the cost and of the unknowns. Chosen: a hundredth of the smallest difference that matters.
FIT_TOLERANCE = 1e-4
# Step of derivatives, as a share of an unknown's size. Chosen larger than in fits of the paper's model, since runs with
# velocity-weakening friction are not smooth on a smaller scale.
FIT_DIFFERENCE = 3e-4
FIT_EVALUATIONS = 25
# Times that the effects of mechanisms' states, which are proportional to their strength, are linearised again about the
# values of a fit, at most, and the relative change of the cost below which they are not. Chosen.
STATE_PASSES, STATE_TOLERANCE = 6, 0.005
# Step of derivatives, as `FIT_DIFFERENCE`, for a search that stalls: friction that falls with speed lets cables jump,
# and the cost is rough. Practice: of 3e-4, 3e-3 and 1e-2 this one led to the least cost.
ROUGH_DIFFERENCE = 3e-3
# Tolerances and most evaluations of the last search, which has these differences too. On two batches (data/raw/radius
# and loops), nine of ten searches from other starts then ended within 3e-4 of the cost of the minimum nearby, before
# within 0.04.
LAST_TOLERANCE, LAST_EVALUATIONS = 1e-6, 60
# Factor by which an unknown is lowered at each step of a continuation (`Parameter.continuation`), and share of the cost
# without the mechanism below which a short search must come for one. Chosen; practice: the loads of two rigs that ring
# came to 4 and 6 %, where the mechanism was not there the search came to 88 %, and took half of the diagnosis's time.
CONTINUATION_FACTOR, PROMISING = 4.0, 0.7
# Shares of the pretension from which a fit starts where the initial tension is not observed, and the evaluations after
# which the better start is taken: the cost has a minimum with both cables taut and one with a cable slack. Chosen.
PRETENSION_STARTS, START_EVALUATIONS = (1.0, 0.2), 8
# Moving average before the load's equation is regressed, s, and how often it is applied. Chosen: it keeps a ringing
# below 10 Hz.
FILTER_S, FILTER_PASSES = 0.05, 4
# Relative difference of an inertia from the regressed one above which a fit also starts from that. Chosen: half of the
# screening's step.
ALIKE_INERTIA = 0.1
# Standard deviations above the regressed inertia beyond which none is screened, and the least number of recordings for
# that. Chosen; on 20 batches without a load with mass, which is plausible from 1e-5 kg m^2, these reach to 8e-6 at most
# on 18, to 1e-5 on one with backlash at the load, and to 2e-4 on one more.
INERTIA_REACH, INERTIA_RECORDINGS = 5.0, 5
# Speed above which dry friction has its full torque in that regression, rad/s. Chosen: slower than any stroke.
SLIDING_RAD_PER_S = 0.01
# How far a fit may leave a parameter's plausible range, as a factor. Chosen: far enough to recognise that it would.
BEYOND_RANGE = 3.0
# Factor by which a strength may exceed its plausible range in an accepted model. Chosen: ranges are rough.
RANGE_SLACK = 1.5

# --- Screening: the score test of every mechanism

# Values at which a mechanism is tried, as shares of its range on the scale of its parameter, for strengths and for
# other parameters; the ratio at which a ratio is tried. Chosen: one value in each part of the range.
SCREENED_STRENGTHS, SCREENED_SHAPES, SCREENED_RATIO = (0.25, 0.6), (0.2, 0.5, 0.8), 1.15
# Relative change at which a parameter of a frozen baseline is tried. Chosen.
SCREENED_CHANGE = 0.05
# Limits of the relative change at which a fit then starts. Chosen: no value changes its sign, and none becomes more
# than eleven times as large.
CHANGE_LIMITS = (-0.9, 10.0)
# Trials of one mechanism above which they are first tried on a few recordings, how many these are, and how many trials
# are kept. Chosen for time: the inertias of a load took half of a screening.
MOST_TRIALS, FEW_RECORDINGS, LEADING_TRIALS = 16, 3, 5
# Limits of the linear extrapolation from a trial value to the start of a fit, as factors of it. Chosen.
EXTRAPOLATION = (0.1, 4.0)
# Sets of trials of each size that are extended by a further trial, and share of a direction outside of others' below
# which these imitate it. Chosen.
BEAM, IMITATED = 40, 1e-3
# Least share of the mean square that a mechanism must take off, to first order, to be fitted. Chosen.
WORTH_FITTING = 0.01
# Most mechanisms that are fitted, and how many at least if the calibrated model is inadequate: screening is linear, and
# a ringing load or backlash is not. Chosen.
MOST_FITTED, FEWEST_FITTED = 6, 3
# Where the initial tension is not observed, friction of a bearing and of the cables are confounded with it. The cost
# has several minima, and the screening is linear about one of them: on 50 trials of a da Vinci grasper, the mechanism
# that takes off 60 % of the mean square has the ninth score, 2 %. Chosen.
MOST_FITTED_IF_UNOBSERVED = 10

# --- Model discrepancy: a Gaussian process on the residuals

# Random Fourier features of the Gaussian process (Rahimi and Recht 2007), the mean number of inputs to each, and its
# length scales in standard deviations of the inputs. Chosen.
FEATURES, INPUTS_PER_FEATURE, LENGTH_SCALES = 64, 3.0, (0.5, 1.2, 3.0)
FEATURES_SEED = 0
# Of inputs that matter near zero: share of the highest speed and of the longest travel since a reversal beyond which
# they saturate, and longest time since a reversal, s. Chosen.
SATURATING_SPEED, SATURATING_TRAVEL, SINCE_REVERSAL_S = 0.1, 0.2, 3.0
# Modes of the features below this share of the strongest one are rounding errors. Chosen.
WEAKEST_MODE = 1e-9
# Mean squares of a discrepancy (1: noise) that are tried, all equally probable. Chosen: factors of three.
DISCREPANCIES = (0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0, 1e3, 3e3, 1e4)
# Those that sensors with a noise that is not quite white have too. Chosen: up to 3 % of the noise's variance.
NOT_WHITE = 0.03
# Smallest discrepancy of something that is missing, and the largest over the excess of the calibrated model. Chosen.
SMALLEST_MISSING, LARGEST_MISSING = 0.1, 3.0
# Difference of log evidence from which a size is clearly worse than another. Chosen: odds of 20.
CLEARLY_WORSE = 3.0

# --- Comparison: posterior probabilities

# Prior probabilities: that nothing is missing; that a further effect is missing if one is; and that a missing effect is
# a listed mechanism. Chosen: even odds, one rig in four, and two effects in three. The last is below `DECIDED`, so that
# no mechanism is identified as long as nothing but the calibrated model and the list competes with it.
PRIOR_AGREES, PRIOR_FURTHER, PRIOR_LISTED = 0.5, 0.25, 2 / 3
# Prior probability that an effect on no list is one of the laws that are tried. Practice: a law of the true slot was
# learned for 28 of 34 effects on no list or taken off it, most of them larger than those that it decides, and for 15 of
# 17 small ones (docs/further-validation.md). Chosen: three in four.
PRIOR_LAW = 0.75
# Prior probability that an unlisted effect shows in nothing but the friction of whole recordings. Chosen: even odds.
IN_FRICTION = 0.5
# Prior probability that an effect's law is that of the mechanism, and shares of its effect that the mechanism's
# equation leaves otherwise, log-uniform between these. Practice (`make form-errors`): 17 published laws of 9 effects
# leave 0 to 49 %, half of them below 1.3 %.
SAME_LAW, LEFT_BY_LAW = 0.5, (1e-4, 0.5)
# Share that the best imitation leaves of another mechanism's model-form error: the exponent of its density, and the
# part of the probability that is uniform. Chosen: half of the imitations leave more than 86 %.
IMITATION_POWER, UNIFORM_PART = 4, 0.05
# Scatter of a batch's mean square without any discrepancy; and the largest excess of the best candidate that counts as
# noise larger than stated. Practice: of 71 clean batches one in twenty has more than 1.1.
SCATTER, MISSTATED_NOISE = 0.1, 0.1

# --- Forward selection

# Most mechanisms of a candidate, as the format says.
MOST_MECHANISMS = 4
# Candidates to which a further mechanism is added, by the size of the set; further ones that are fitted with each; and
# sets of the first screening that are fitted. Chosen for time.
FIRSTS, PARTNERS, LINEAR_SETS = {2: 2, 3: 1, 4: 1}, 3, 2
# Share of its earlier mean square below which a set that is fitted again has come to another minimum. Chosen.
FAR_LOWER = 0.8
# Runs of the model, each on one recording, after which no further candidate is fitted. Chosen: they take two cores that
# do nothing else about two minutes. (On one core, a run and all that a diagnosis does with it took 4.2 ms in
# data/raw/rich, with recordings of 1,251 samples, and 2.9 ms in data/raw/da-vinci, with 215.)
RUN_LIMIT = 50_000
# Time after which no further candidate is fitted, s, for slower machines. Chosen: the verdict and its report take some
# 20 s more, and the whole three minutes.
TIME_LIMIT_S = 160.0
# Candidates of which none is complete that are fitted again about the best of them. Chosen for time.
CONTENDERS = 4
# Excess mean square over that of the best candidate above which a rival is not fitted again about it. Chosen for time:
# a covariance changes mean squares by a factor of two or three.
HOPELESS = 20.0
# Excess mean square that counts as none in this comparison. Chosen.
NEAR_NOISE = 0.2
# Natural logarithm of the weight of the leading candidate over that of another one, above which the latter keeps its
# values about the former. Chosen for time: it stays excluded if another covariance makes its mean square three times
# lower.
FAR_BEHIND = 100.0
# Bayes factor from which evidence against a candidate is strong: Kass and Raftery 1995, Journal of the American
# Statistical Association 90(430), 773-795, doi:10.1080/01621459.1995.10476572.
STRONG_EVIDENCE = 20.0

# --- Laws that no list holds

# A priori standard deviations of a law's values that are tried, and the one at which its sensitivities are computed:
# shares of the unit of each form of law (`ccmodel.diagnosis.laws._unit_of`). Chosen: factors of three.
LAW_SCALES = 0.003, 0.01, 0.03, 0.1, 0.3
LAW_STEP = 0.01
# That unit for the compliance of a cable's end, over the compliance of the cable. Chosen: with the largest of
# `LAW_SCALES`, an end yields about as much as its cable.
LAW_CABLES = 3.0
# The same for the delay of a side, s. Chosen: ten times the longest step of usual recordings, 0.01 s.
LAW_DELAY_S = 0.1
# Laws that are fitted, the leading ones to first order; and of these, how many are also fitted with more knots. Chosen
# for time.
LAWS_FITTED, LAWS_REFINED = 8, 2
# Log of the odds, to first order, by which a law is behind a listed candidate and is not fitted, where the calibrated
# model's own fit is good. Chosen for time: at odds of 20,000 it has no share in the comparison, also if they are wrong
# by a factor of a hundred.
LAW_FAR_BEHIND = 10.0
# Share of the knots of a learned law at which a formula must lie in its band. Chosen.
IN_BAND = 0.9
# Starts, of a listed law's constants, from which the best ones are searched. Chosen: a sine has a few minima.
LISTED_STARTS = 3
# Share of the learned laws that are a listed one which are said to be it.
RECOGNISED = 0.95
# Laws are also learned beside the best single listed mechanism if its excess mean square is below this share of the
# calibrated model's, it leaves something, and no law leads that leaves nothing. Chosen.
MOSTLY_LISTED = 0.5
# Share of both limits after which no further set is fitted before laws are learned. Chosen: laws take some 40 s.
SETS_SHARE = 0.6
# Limits of a diagnosis with its report, over those of the selection, at which isolation of faults is given up. Chosen:
# of ten recordings it takes 2,600 runs, of a hundred ten times as many.
REPORT_SHARE = 1.2
# Ratio of a larger set's `unexplained_mean_square` to that of smaller ones up to which still larger sets come before
# laws, and up to which a larger set outdoes a candidate without a good fit (`is_outdone`). Chosen.
LEADING_ON = 0.5

# --- Fault isolation and location

# Largest excess mean square without a channel, or with the measured load torque, over that of the calibrated model, at
# which the fault is located there. Chosen.
ISOLATED_SHARE = 0.05
# Speed below which the drive is at rest, over its highest speed. Chosen.
REST_SPEED = 0.02
# Travel after a reversal that counts as its neighbourhood, over the drive's stroke. Chosen.
AFTER_REVERSAL = 0.25
# A channel is named if its error beyond the noise is at least this share of the worst channel's; likewise a phase.
NAMED_CHANNEL, NAMED_PHASE = 0.35, 0.7  # Chosen.

# --- Verdict

# Posterior probability from which a mechanism is identified (the decision threshold), and from which it is listed as an
# alternative. Chosen.
DECIDED, ALTERNATIVE = 0.8, 0.02
# Posterior probability from which a mechanism is not compared with the laws that may be learned, before the discount.
# Chosen: one in twenty is wrong, and laws take longer than all else in the diagnosis of a single effect.
SETTLED = 0.95
# Largest rms error of a channel, over its noise, in a good fit (`CandidateFit.is_good`). Chosen: an error of this size
# shows only if one looks for it. Above it, pages call a batch "explained in part" and add a caution.
CONSPICUOUS = 1.5
# Factor on the probability of every set of mechanisms where no recording can be held out, where the initial tension is
# not observed, and, in proportion, where a tolerance takes the place of noise. Practice: without it two of 21
# mechanisms concealed in measured recordings were identified wrongly.
DISCOUNT = 0.75
# Mean square (1: noise) up to which a fit is called good. A recording contradicts the others if only the fit without it
# is good. Chosen.
GOOD_FIT = 1.5
# No probability is reported above this: no number of samples shows that the list of mechanisms is complete. Chosen.
MOST_CONFIDENT = 0.99
# Alternatives that are reported, as the format says.
MOST_ALTERNATIVES = 4
# Relative distance within which a fitted value stands at its bound. Chosen.
AT_BOUND = 1e-3
# Fewest recordings of which one can be recognised as contradicting the others. Chosen.
FEWEST_TO_CONTRADICT = 4

# --- Reported values

# Refinement of the solver's grid and steps, to correct values for the discretisation error. Chosen for time.
REFINEMENT = 3

# --- Experiment design

# Sampling rate (Hz) and duration (s) of a proposed recording. Chosen.
EXPERIMENT_RATE_HZ, EXPERIMENT_S = 125.0, 10.0
# Rest before its motion, s. Chosen.
EXPERIMENT_REST_S = 0.4
# Candidate models that an experiment is to separate, at most. Chosen for time.
SEPARATED = 4
# Shares of the largest amplitude and the highest pretension in the batch. Chosen.
EXPERIMENT_SIZES = ((1.0, 1.0), (1.0, 0.4), (0.4, 1.0))
# Frequencies of sines (Hz), durations of holds (s), frequency of nested reversals (Hz), duration of a step (s). Chosen.
SINES_HZ, HOLDS_S, NESTED_HZ, STEP_DURATION_S = (0.1, 0.4, 1.2), (1.0, 3.0, 8.0), 0.5, 0.5
# Odds that the recordings of an experiment should give for the better of two candidates. Chosen.
WANTED_ODDS = 20.0
# Recordings of one experiment beyond which a lab is told that it is unlikely to decide. Chosen.
MANY_RECORDINGS = 10
# Experiments, of the most separating ones, for which a refit is taken into account. Chosen for time.
REFITTED = 8
