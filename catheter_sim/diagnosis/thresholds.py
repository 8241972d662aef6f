"""Numbers by which several files of a diagnosis decide, with their units, what they decide, and why.

A number that one file needs stands there. Each is followed by a text of one form: "[unit] what it decides.
Why: the reason.". Where nobody measured a reason the text says "assumed", and what makes the value plausible.
"The blind bench" is the run of 400 drawn data sets with hidden causes of docs/truth/bench.md. All of them are
listed in docs/reference/thresholds.md.
"""

# ---------------------------------------------------------------- reading and parting the data

HELDOUT_SHARE = 0.3
"""[share of the rows] How much is held out where the data set gives no roles. Why: assumed; enough cycles
are left to fit, and enough held out to judge a gain."""

STEP_BY_STEP = 1.5
"""[steps of the readings] Where no reading changes by more, the robot is slow, and not the sensor. Why: a
slow sensor leaves steps out where the robot moves fast."""

# ---------------------------------------------------------------- the tracker's frame

ROUNDING_SHARE = 1e-6
"""[share of the points' spread] An error below it is rounding. Why: assumed; positions in files have about
six digits."""

# ---------------------------------------------------------------- faults of the data

FEWEST_VALUES = 60
"""[measured values] With fewer in the training trials nothing is concluded. Why: assumed; a hypothesis of
eight causes has that many numbers, and a cross-validation has eight folds."""
GROSS_SHARE = 0.3
"""[model's error over the measurements' spread] From it on mistakes in the data are looked for. Why:
assumed; causes of the list stay below it unless they are large, mistakes exceed it."""
MISTAKE_SOLVED_SHARE = 0.5
"""[error over the measurements' spread] What remains with the mistake put right must be below it. Why: a
mistake that is put right leaves a model that works, be it with a cause beneath; one that is wrong anyway says
nothing about the data."""
PULL_BEYOND = (3.0, 10.0)
"""[times the way of a tendon that bends the robot fully] A longer way is said; beyond the second number no
such robot was pulled. Why: assumed; a way is geometry, and stretch takes up no more than as much again."""
STILL_SHARE = 0.1
"""[share of the computed motion] Below it an output hardly moves. Why: assumed; no cause of the list takes
nine tenths of a motion."""
LATE_ROWS = (1, 2, 4, 8)
"""[rows] By so many an output may come late and still follow. Why: the cause `rate` must not look like a
loose tracker."""
BUMP_ROWS = 5
"""[rows] So many before and after a bump, and so many pairs with the same inputs. Why: assumed; fewer let
one odd row look like a bump."""
BUMP_SAME_INPUTS = 0.1
"""[share of the inputs' ranges] Rows within it are compared before and after a bump. Why: assumed; closer
pairs are rare in short trials."""

STANDS_SHARE = 1e-3
"""[share of an input's range] An input that changes by less from row to row stands still. Why: assumed; noise
of a sensor of the inputs is of this size, a step of a motion is ten times larger."""
STEP_STRETCH_ROWS = 12
"""[rows] On which a shift is looked for, at least. Why: fewer hold no motion to compare."""
LATE_NOISE = 4.0
"""[times the noise] An error, or a motion, below it says nothing about rows in time. Why: assumed; it is then
noise by a sixteenth and more."""
ANOTHER_FORM = 2.0
"""[times as much] What its simplest form leaves is worth trying a cause's other forms. Why: a drive's lag
leaves twice the noise where the tracker lags."""

# ---------------------------------------------------------------- fitting

FOLDS = 8
"""[folds] Of the cross-validation; a fold is a stretch of whole cycles. Why: assumed; each fit keeps seven
eighths of the data."""
NO_EQUILIBRIUM_ERROR = 1e3
"""[weights] The residual of a robot that finds no equilibrium, at least. Why: it must lose against any
robot that stands still; twice the largest measured value counts where that is more."""
DERIVATIVE_STEP = 0.05
"""[scales of the parameter] Step of the derivative by differences. Why: assumed; small beside a change that
matters (one scale), large beside what a solver leaves."""
MOST_FIT_STEPS = 24
"""[steps] Of a fit. Why: assumed; it bounds the time."""
TRUSTED_SHARE = 0.1
"""[share of the residuals] What an unknown error of the model may do. Why: no model of these robots is
known to stay below it; with it true values lay in their intervals in 647 of 666 cases of the blind
bench."""

# ---------------------------------------------------------------- choosing causes

PAYS_CHANCE = 0.023
"""[probability] Of a gain by chance, at most, for a cause to pay. Why: two standard errors of a normal
distribution; no cause was named for nothing in 60 draws of the blind bench."""
PAYS_SHARE = 0.03
"""[share of the root mean square] By which a cause must lower the error. Why: assumed; less is no cause
that anybody would mend."""
EQUAL_FACTOR = 1.1
"""[times the error of the best] A set within it may be taken in its place for its fewer numbers. Why:
assumed; the set must do as well to within chance besides."""
MOST_CAUSES = 8
"""[causes] In a set, at most. Why: the OpenCR robot's training file wants as many."""

# ---------------------------------------------------------------- the verdict

ESTABLISHED = 0.5
"""[probability] Of a cause, or of a group that the data cannot tell apart, to be named. Why: a named cause is
to be more probable than not."""

NEAR_NOISE = 1.5
"""[times the noise floor] An error within it is no discrepancy; what several causes leave is small. Why:
the floor is what is white in the error, and a right model leaves at most 1.3 times as much (blind bench:
1.02 to 1.04)."""
GAIN_CHANCE = 0.05
"""[probability] Of the held-out gain by chance, at most. Why: the usual level of a test."""
LARGE_GAIN_PERCENT = 15.0
"""[% of the error before] A gain of so much needs no interval above zero. Why: no accident of a few trials;
the interval of few trials is wide however much is gained in all of them."""


# ---------------------------------------------------------------- two recordings of one robot

MOSTLY_PAIRED = 0.9
"""[share of the rows] From it on the earlier recording need not be explained. Why: what both share then
cancels at nearly all rows, whatever it is."""
EARLIER_CAUSES = 6
"""[causes] By which an earlier recording is explained, at most. Why: half of a real trunk's rows explains the
rest with five and more, not with four; more soak up what is unknown, err elsewhere and take minutes."""
COMPARING_BUDGET_S = 300.0
"""[s] For the search of a comparison, where none is given. Why: of 200 judged interventions 172 end within
a minute on one core, 194 within five; the others would go on for many more."""

# ---------------------------------------------------------------- how probable a cause is

DISCREPANCY_SURE = 2.0
"""[standard deviations of chance] By which a smooth error must do better than none, on stretches left out, to
be believed. Why: two of them, as for a cause (`PAYS_CHANCE`); of noise alone it then predicts nothing."""
MOST_SURE = 0.99
"""[probability] None is told above it, and none below the rest to one. Why: a few hundred draws are known;
they say nothing of one error in a thousand."""
LEAST_SHOWN_PROBABILITY = 0.05
"""[probability] A cause below it is not in the report's table. Why: it holds what a reader may act on;
diagnosis.json has all."""
LARGEST_GROUP = 3
"""[causes] That the data cannot tell apart and that are one answer, at most. Why: of four names a reader has
no answer."""
LEAST_MEMBER_SHARE = 0.15
"""[share of a group's probability] With less a cause is no member. Why: assumed; a reader looks at what may
be one in seven."""

# ---------------------------------------------------------------- what residuals depend on

SIGNIFICANT_P = 0.01
"""[p-value] Of a test of residuals. Why: eight tests are made, so that one in twelve right models shows
any."""

# ---------------------------------------------------------------- simulation and the next experiment

SURE_BELIEF = 0.95
"""[probability] At which a closed loop takes a cause for found. Why: one answer in twenty may be wrong."""
NATS_PER_MINUTE = 0.05
"""[nat/minute] Price of an experiment's duration, played once. Why: every programme was played on 21 robots
whose first data could not tell. What this price chose settled 17, in 3.5 minutes of four plays on average,
what a tenth of it chose 15, in 7.7, and what four times it chose 15, in 2.4: beyond some length a programme
tells no more, while what the model cannot follow still grows."""
