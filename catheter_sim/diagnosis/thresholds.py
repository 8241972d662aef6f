"""Numbers by which several files of a diagnosis decide, with their units, what they decide, and why.

A number that one file needs stands there. Each is followed by a text of one form: "[unit] what it decides.
Why: the reason.". Where nobody measured a reason the text says "assumed", and what makes the value plausible.
"The blind bench" is the run of 400 drawn data sets with hidden causes of docs/truth/bench.md. All of them are
listed in docs/reference/thresholds.md.
"""

# ---------------------------------------------------------------- reading and parting the data

HELDOUT_SHARE = 0.3
"""[share of the rows] This much is held out where the data set gives no roles. Why: assumed. Enough cycles
are left to fit, and enough are held out to judge a gain."""

STEP_BY_STEP = 1.5
"""[steps of the readings] If no reading changes by more, the robot is slow, and not the sensor. Why: a slow
sensor leaves steps out where the robot moves fast."""

# ---------------------------------------------------------------- the tracker's frame

ROUNDING_SHARE = 1e-6
"""[share of the points' spread] An error below it is rounding. Why: assumed. Positions in files have about
six digits."""

# ---------------------------------------------------------------- faults of the data

FEWEST_VALUES = 60
"""[measured values] With fewer in the training trials, nothing is concluded. Why: assumed. A hypothesis of
eight causes has that many numbers, and a cross-validation has eight folds."""
GROSS_SHARE = 0.3
"""[model's error over the measurements' spread] From here on, mistakes in the data are looked for. Why:
assumed. Causes of the list stay below it unless they are large, and mistakes exceed it."""
MISTAKE_SOLVED_SHARE = 0.5
"""[error over the measurements' spread] With the mistake put right, less than this must remain. Why: the
model then works, perhaps with a cause beneath. A model that is wrong anyway says nothing about the data."""
PULL_BEYOND = (3.0, 10.0)
"""[times the displacement of a tendon that bends the robot fully] A displacement beyond the first number is
reported. Beyond the second, no such robot was pulled. Why: assumed. A displacement is geometry, and stretch
takes up no more than as much again."""
STILL_SHARE = 0.1
"""[share of the computed motion] Below it an output hardly moves. Why: assumed. No cause of the list takes
nine tenths of a motion."""
LATE_ROWS = (1, 2, 4, 8)
"""[rows] An output may come late by these and still follow. Why: the cause `rate` must not look like a loose
tracker."""
BUMP_ROWS = 5
"""[rows] This many are needed before and after a bump, and as many pairs with the same inputs. Why: assumed.
With fewer, one odd row looks like a bump."""
BUMP_SAME_INPUTS = 0.1
"""[share of the inputs' ranges] Rows before and after a bump are compared if their inputs differ by less.
Why: assumed. Closer pairs are rare in short trials."""

STANDS_SHARE = 1e-3
"""[share of an input's range] An input that changes by less from row to row stands still. Why: assumed. The
noise of an input's sensor is of this size, and a step of a motion is ten times larger."""
STEP_STRETCH_ROWS = 12
"""[rows] A shift is looked for on at least this many. Why: fewer hold no motion to compare."""
LATE_NOISE = 4.0
"""[times the noise] A smaller error, or motion, does not show whether rows come late. Why: assumed. A
sixteenth of it or more is then noise."""
ANOTHER_FORM = 2.0
"""[times as much] If a cause's simplest form leaves at most this, its other forms are worth trying. Why: a
drive's lag leaves twice the noise where the tracker lags."""

# ---------------------------------------------------------------- fitting

FOLDS = 8
"""[folds] The cross-validation has this many. A fold is a stretch of whole cycles. Why: assumed. Each fit
keeps seven eighths of the data."""
NO_EQUILIBRIUM_ERROR = 1e3
"""[weights] The residual of a robot that finds no equilibrium is at least this. Why: it must lose against any
robot that stands still. Twice the largest measured value counts where that is more."""
DERIVATIVE_STEP = 0.05
"""[scales of the parameter] Step of the derivative by differences. Why: assumed. It is small beside a change
that matters (one scale), and large beside what a solver leaves."""
MOST_FIT_STEPS = 24
"""[steps] A fit makes at most this many. Why: assumed. It bounds the time."""
TRUSTED_SHARE = 0.1
"""[share of the residuals] An unknown error of the model may do this much. Why: no model of these robots is
known to stay below it. With it, true values lay in their intervals in 647 of 666 cases of the blind bench."""

# ---------------------------------------------------------------- choosing causes

PAYS_CHANCE = 0.023
"""[probability] A cause pays only if its gain comes by chance with at most this probability. Why: it is two
standard errors of a normal distribution. No cause was named for nothing in 60 draws of the blind bench."""
PAYS_SHARE = 0.03
"""[share of the root mean square] A cause must lower the error by this much. Why: assumed. Nobody would mend
a cause that does less."""
EQUAL_FACTOR = 1.1
"""[times the error of the best] A set within it may take the place of the best if it has fewer numbers. Why:
assumed. The set must also do as well to within chance."""
MOST_CAUSES = 8
"""[causes] A set holds at most this many. Why: the OpenCR robot's training file wants as many."""

# ---------------------------------------------------------------- the verdict

ESTABLISHED = 0.5
"""[probability] From here on, a cause is named, or a group that the data cannot tell apart. Why: a named
cause is to be more probable than not."""

NEAR_NOISE = 1.5
"""[times the noise floor] An error within it is no discrepancy, and what several causes leave within it is
small. Why: the floor is the white part of the error. A right model leaves at most 1.3 times as much (blind
bench: 1.02 to 1.04)."""
GAIN_CHANCE = 0.05
"""[probability] The held-out gain may come by chance with at most this probability. Why: it is the usual
level of a test."""
LARGE_GAIN_PERCENT = 15.0
"""[% of the error before] A gain of this size needs no interval above zero. Why: it is no accident of a few
trials. The interval of few trials is wide, however much is gained in all of them."""


# ---------------------------------------------------------------- two recordings of one robot

MOSTLY_PAIRED = 0.9
"""[share of the rows] If at least this much is paired, the earlier recording need not be explained. Why: what
both share then cancels at nearly all rows, whatever it is."""
EARLIER_CAUSES = 6
"""[causes] At most this many explain an earlier recording. Why: half of a real trunk's rows explains the rest
with five and more, not with four. More causes soak up what is unknown, err elsewhere and take minutes."""
COMPARING_BUDGET_S = 300.0
"""[s] Time for the search of a comparison, where you give none. Why: of 200 judged interventions 172 end
within a minute on one core, 194 within five. The others would go on for many more."""

# ---------------------------------------------------------------- how probable a cause is

DISCREPANCY_SURE = 2.0
"""[standard deviations of chance] A smooth error is believed only if it does better than none by this, on
stretches left out. Why: it is two of them, as for a cause (`PAYS_CHANCE`). Of noise alone the smooth error
then predicts nothing."""
MOST_SURE = 0.99
"""[probability] No probability is reported above it, and none below one minus it. Why: a few hundred draws
are known. They say nothing of one error in a thousand."""
LEAST_SHOWN_PROBABILITY = 0.05
"""[probability] A cause below it is not in the report's table. Why: the table holds what a reader may act on,
and `diagnosis.json` has all."""
LARGEST_GROUP = 3
"""[causes] A group that the data cannot tell apart, and that is one answer, holds at most this many. Why:
four names give a reader no answer."""
LEAST_MEMBER_SHARE = 0.15
"""[share of a group's probability] With less, a cause is no member. Why: assumed. A reader looks at what may
be one in seven."""

# ---------------------------------------------------------------- what residuals depend on

SIGNIFICANT_P = 0.01
"""[p-value] A test of residuals shows structure below it. Why: eight tests are made, so one in twelve right
models shows some structure."""

# ---------------------------------------------------------------- simulation and the next experiment

SURE_BELIEF = 0.95
"""[probability] From here on, a closed loop takes a cause for found. Why: one answer in twenty may be
wrong."""
NATS_PER_MINUTE = 0.05
"""[nat/minute] Price of an experiment's duration, played once. Why: every programme was played on 21 robots
whose first data could not tell. What this price chose decided 17, in 3.5 minutes of four plays on average.
What a tenth of it chose decided 15, in 7.7 minutes. What four times it chose decided 15, in 2.4 minutes.
Beyond some length a programme tells no more, while what the model cannot follow still grows."""
