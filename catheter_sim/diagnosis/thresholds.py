"""Every number by which a diagnosis decides, with its unit, what it decides, and why it has its value.

Each constant is followed by a text of one form: "[unit] what it decides. Why: the reason.". Where nobody
measured a reason the text says "assumed", and what makes the value plausible. "The blind bench" is the
run of 400 drawn data sets with hidden causes of docs/truth/bench.md.

No other file of `diagnosis/` holds such numbers (`tests/diagnosis/test_thresholds.py`).
"""

# ---------------------------------------------------------------- reading and parting the data

LONGEST_WAY_LENGTHS = 20.0
"""[robot lengths] A position that moves over more is refused: its column cannot be in mm. Why: assumed;
points of a robot move by two lengths at most, a wrong unit is a factor of 25 or 1000."""
MOST_TURN_DEG = 720.0
"""[deg] A measured angle beyond it is refused. Why: no joint or tip turns more than twice around."""
MOST_QUATERNION = 1.05
"""[1] A part of a measured quaternion beyond it is refused. Why: parts of a unit quaternion are at most 1;
the rest is for rounding in the file."""
HELDOUT_SHARE = 0.3
"""[share of the rows] How much is held out where the data set gives no roles. Why: assumed; enough cycles
are left to fit, and enough held out to judge a gain."""
MOST_HELDOUT_SHARE = 0.5
"""[share of the rows] The same where less would hold too few stretches to prove a gain. Why: assumed; as much
is left to fit."""
VALLEY_SHARE = 0.25
"""[share of the peaks on both sides] A valley of the pull below it ends a cycle. Why: assumed; partial
loops that end a way back keep more pull than that."""
PEAK_SHARE = 0.1
"""[share of the trial's largest pull] A peak must reach it to count. Why: below it is noise about rest."""
MOST_PRETENSION_SHARE = 0.4
"""[share of the largest pull] What a tenth of the rows do not exceed is a standing pretension up to this
size. Why: a robot whose lowest pull is higher never rests, so that no row of it is rest."""
FROZEN_SHARE = 0.15
"""[share of a trial's rows] A sensor that repeats one value over more of them is frozen. Why: assumed; a
robot that is driven changes a measured value from row to row, by its noise alone."""
FROZEN_ROWS = 8
"""[rows] The same for short trials: fewer repeats are no frozen sensor. Why: assumed; coarse sensors repeat
values over a few rows."""
FROZEN_DRIVEN_SHARE = 0.3
"""[share of an input's range] It must pass through so much of it meanwhile. Why: a sensor may well repeat
its value while the robot is held still."""

STALE_SHARE = 0.3
"""[share of the rows] That repeat all outputs of the row before while the robot is driven: from it on repeats
are old readings. Why: assumed; by noise alone no row repeats in all its digits."""
STALE_VALUES_SHARE = 0.5
"""[values per change] With fewer a sensor counts coarsely, and repeats what it measures. Why: assumed; a
reading of a fine sensor never comes again."""
STEP_BY_STEP = 1.5
"""[steps of the readings] Where no reading changes by more, the robot is slow, and not the sensor. Why: a
slow sensor leaves steps out where the robot moves fast."""

# ---------------------------------------------------------------- resolution and noise of readings

FEWEST_READINGS = 8
"""[distinct readings] Fewer show no grid. Why: assumed; a few numbers are at equal distances by chance."""
FEWEST_STEPS = 20
"""[steps] A column that moves by less shows no grid by itself. Why: assumed; a handful of levels, each set by
hand, are at equal distances too."""
MOST_STEPS = 1e5
"""[steps in the largest reading] With more, readings are continuous. Why: six digits are how many numbers are
printed, whatever measured them; what rounds them there is far below any noise."""
GRID_SHARE = 0.9
"""[share of the distinct readings] That must lie on a decimal grid. Why: of continuous readings a tenth lies
on any; cells that somebody filled in lie off it."""
GRID_MISSED_SHARE = 0.1
"""[share of a step] That readings may lie off the grid of a counting sensor, in all. Why: eight readings are
as near by chance once in a million times."""
GRID_FILLED_SHARE = 0.95
"""[share of the grid's points] From it on a grid may be a ramp of commands, followed without noise. Why:
readings of a sensor leave points out, unless many commands share each of them."""
SHARED_READINGS = 2.0
"""[commands per reading] Many commands share each reading of a sensor that counts. Why: as of
`GRID_FILLED_SHARE`; a model without noise has a reading of its own for each."""
REPEATED_TIMES = 1.3
"""[times as often as rounded noise repeats a reading] Where readings of a held command repeat more often,
each level counts once for the noise. Why: assumed; the share of repeats of a hundred rows is known to a
tenth."""
REPEATED_SHARE = 0.02
"""[share of held rows] More repeats than that besides. Why: assumed; so few move a median by less than the
noise itself is known."""
MOST_REPEATED_SHARE = 0.9
"""[share of held rows] From it on each level counts once, whatever rounds its readings. Why: assumed; nothing
is seen of the noise while a command is held."""
CLIPPED_BENDS = 3.0
"""[times the noise] Where the noise is less than a step, the squares of second differences count, up to so
many times it. Why: their median is one of a few numbers then, often zero; normal noise goes no further, jumps
do."""
DENSE_SHARE = 5e-3
"""[share of an input's range] A log in which the robot moves by less over several rows is dense: its noise
is read from rows so far apart. Why: assumed; no cause makes an error bend within half a percent of the
motion."""
DENSE_TIMES = 1.25
"""[times the noise from row to row] The noise of rows further apart counts where it is larger by this. Why:
assumed; white noise has the same at any distance, that of a filtered sensor grows."""
SMALLEST_NOISE_SHARE = 1e-6
"""[share of the spread of a unit's measurements] No noise is smaller. Why: computed data without any would be
infinitely far from every model but one."""
MOST_TIMES = 1e6
"""[times the noise] Larger errors are told as that. Why: as of `SMALLEST_NOISE_SHARE`."""

# ---------------------------------------------------------------- the tracker's frame

FEWEST_POINTS = 8
"""[points] With fewer measured points the tracker's frame is not looked for. Why: assumed; a rigid motion
has six numbers, and a model that errs needs more points than that."""
TURN_CONVINCING = 0.35
"""[error with a turn over the error without] Below it the turn is taken. Why: assumed; a turn must take
most of the error."""
TURN_LIKELIER = 0.75
"""[the same] Below it an exchange of axes is taken where no turn would leave the points farther off than a
slight shift. Why: measured on a model that errs by half its motion, beside which exchanged axes must still
show."""
TURN_EQUAL = 1.05
"""[times the least error] Turns within it do as well; the least turn is taken. Why: points on a line leave
the turn about it open, and only rounding and noise part such turns."""
SLIGHT_DEG = 30.0
"""[deg beyond an exchange of axes] A turn up to it is left to the cause `measurement_frame`. Why: assumed; a
tracker that somebody set up in the base frame is turned by less."""
SLIGHT_SHIFT_MM = 50.0
"""[mm] A shift up to it is left to the cause `measurement_frame`. Why: it is the bound of that cause."""
UNSHIFTED_SHARE = 0.05
"""[share of the points] So many may be off by less than a slight shift where the whole tracker is shifted.
Why: assumed; single outliers must not decide."""
METRES_SPREAD = (250.0, 4000.0)
"""[computed spread over measured] Between the two the positions are taken for metres. Why: 1000 within a
factor of four, by which a model may err."""
METRES_LEFT_SHARE = 0.5
"""[share of the computed spread] The error that must remain below it with the positions taken as metres.
Why: assumed; a model that errs by more says nothing about units."""
LEAST_TURN_WEIGHT = 1e-9
"""[share of the points' product] How much no turn weighs beside the points. Why: it decides only what the
points leave open, and stays above rounding."""
ROUNDING_SHARE = 1e-6
"""[share of the points' spread] An error below it is rounding. Why: assumed; positions in files have about
six digits."""
FLAT_SHARE = 0.02
"""[second extent of the points over the first] Below it the points lie on a line, about which the turn
cannot be told. Why: assumed; noise of a tracker is about a hundredth of the motion."""

# ---------------------------------------------------------------- faults of the data

FEWEST_VALUES = 60
"""[measured values] With fewer in the training trials nothing is concluded. Why: assumed; a hypothesis of
eight causes has that many numbers, and a cross-validation has eight folds."""
NOISE_ROWS = 3
"""[values of one series] With fewer its noise is not told. Why: it is told from second differences
(`diagnosis.noise.white_noise`)."""
GROSS_SHARE = 0.3
"""[model's error over the measurements' spread] From it on mistakes in the data are looked for. Why:
assumed; causes of the list stay below it unless they are large, mistakes exceed it."""
MISTAKE_CONVINCING = 0.5
"""[error with a mistake put right over the error with it] Below it the mistake is believed. Why: nothing else
halves an error; causes turn no sign, exchange nothing, and scale by less than the factors between units."""
MISTAKE_SOLVED_SHARE = 0.5
"""[error over the measurements' spread] What remains with the mistake put right must be below it. Why: a
mistake that is put right leaves a model that works, be it with a cause beneath; one that is wrong anyway says
nothing about the data."""
MISTAKE_SURER = 0.85
"""[error with a mistake put right over that with the tracker moved] Below it the mistake is believed and
nothing is moved. Why: assumed; both explain inches for mm, and the simpler one must do better."""
HARDLY_MOVED_SHARE = 0.002
"""[robot lengths] A robot that nowhere moves by more, measured and computed, is taken for one in other
units. Why: assumed; nobody records a robot of 100 mm that moves by 0.2 mm, and m for mm is far below."""
PULL_BEYOND = (3.0, 10.0)
"""[times the way of a tendon that bends the robot fully] A longer way is said; beyond the second number no
such robot was pulled. Why: assumed; a way is geometry, and stretch takes up no more than as much again."""
TENSION_BEYOND = (10.0, 100.0)
"""[times the tension that bends the robot fully, without friction] The same of tensions. Why: assumed;
friction asks for several times as much, mN for N is 1000."""
MOTION_BEYOND = (2.2, 5.0)
"""[robot lengths] The same of a measured point's motion along an axis. Why: a tip that turns all round moves
by two; cm for mm and the like are ten."""
TURN_BEYOND = (2.0, 5.0)
"""[turns] The same of a measured angle. Why: a joint turns by less than one."""
OUTER_SHARE = 0.05
"""[of the values at either end] So many are left out of these. Why: few wrong rows are another fault."""
FOLLOWS_SHARE = 0.2
"""[share of an output's variance] Less of it in the inputs and the model says that the output does not
follow them. Why: assumed; noise alone has none, and causes of the list change an output without undoing
it."""
FOLLOWS_OF_EXPECTED = 0.4
"""[share of what a right model would explain] The same where noise is large; the smaller of the two counts.
Why: assumed."""
STILL_FOLLOWS_SHARE = 0.6
"""[share of an output's variance] The same for an output that hardly moves. Why: what moves by a tenth of
what is expected must at least move with the inputs."""
STILL_SHARE = 0.1
"""[share of the computed motion] Below it an output hardly moves. Why: assumed; no cause of the list takes
nine tenths of a motion."""
MOVES_SHARE = 0.2
"""[share of the largest computed motion of its unit] An output with less is not expected to move. Why: what
the model moves little is decided by its error."""
TELLING_SHARE = 0.1
"""[share of the variance] So much must be motion if the model is right, to say that none is there. Why:
below it noise hides the motion."""
TELLING_SPREADS = 5.0
"""[standard deviations of what chance explains] The same for few rows. Why: five of them are no chance."""
LATE_ROWS = (1, 2, 4, 8)
"""[rows] By so many an output may come late and still follow. Why: the cause `rate` must not look like a
loose tracker."""
BUMP_ROWS = 5
"""[rows] So many before and after a bump, and so many pairs with the same inputs. Why: assumed; fewer let
one odd row look like a bump."""
BUMP_NOISE = 8.0
"""[times the noise] A jump below it is no bump. Why: assumed; of a thousand rows of noise none reaches
it."""
BUMP_ALONE = 3.0
"""[times the next largest change of the error in that trial] A jump below it is no bump. Why: a wrong model
jumps again where the inputs come back."""
BUMP_BEYOND_SHARE = 0.02
"""[share of an input's range] Inputs that go beyond all earlier rows by more explain a jump. Why: what
gives way there for good is the robot's."""
BUMP_SAME_INPUTS = 0.1
"""[share of the inputs' ranges] Rows within it are compared before and after a bump. Why: assumed; closer
pairs are rare in short trials."""
BUMP_ALIKE_SHARE = 0.35
"""[share of the bump] By so much what is off afterwards may differ from it. Why: assumed; hysteresis
changes the error of such pairs."""
OUTLYING_FACTOR = 4.0
"""[times the noise, and the largest of the other trials'] A trial that errs by more is odd. Why: assumed;
specimens and set-ups differ by more than trials of one do."""
OTHERS_NEAR_NOISE = 2.0
"""[times the noise] The other trials must err by less. Why: only then would there be no discrepancy without
the odd trial."""

COPY_ROWS = 12
"""[rows] So many rows in a row that agree to the last digit are a copy. Why: assumed; noise of a few steps
of the last digit repeats in one row of ten at most, so that twelve of them are no chance."""
COPY_STEPS = 2.0
"""[steps of the last digit] A column less noisy tells nothing about copies. Why: a coarse sensor gives the
same readings whenever a robot repeats a motion."""
COPY_PROBES = 16
"""[rows] Of a trial that are looked for in another one. Why: a copied part of an eighth of a trial holds two
of them."""
FILLED_SHARE = 0.5
"""[share of the rows] On straight lines between others from which outputs are taken for filled in. Why:
assumed; half of the rows then were not measured."""
FILLED_KINKS = 8
"""[rows] At which the lines must bend where nothing of the inputs bends. Why: a smooth motion without noise
bends where its inputs do."""
FILLED_SLOPES_SHARE = 0.25
"""[slopes per bend] With fewer a sensor counts coarsely. Why: assumed; lines between measured rows have a
slope each, steps of a counter have few."""
STANDS_SHARE = 1e-3
"""[share of an input's range] An input that changes by less from row to row stands still. Why: assumed; noise
of a sensor of the inputs is of this size, a step of a motion is ten times larger."""
UNDRIVEN_ROWS = 6
"""[rows] Over which inputs stand still while outputs go out and come back. Why: assumed; with fewer an
outlier or two look like that."""
UNDRIVEN_NOISE = 12.0
"""[times the noise] How far they must go. Why: far beyond what a median of three rows lets pass."""
UNDRIVEN_BACK_SHARE = 0.5
"""[share of the way out] From where they started they may end by it. Why: what lags or creeps goes one way,
and ends where it has gone."""
UNDRIVEN_STRETCHES = 2
"""[stretches] In which that must happen. Why: once may be a hand that touched the robot."""
EXCHANGED_ROWS = 3
"""[rows] In which two points lie where the model has the other. Why: assumed; one row may be an outlier."""
EXCHANGED_SHARE = 0.3
"""[share of their distance from their own places] Within it they must then lie. Why: as of mistakes
(`MISTAKE_CONVINCING`)."""
AWAY_STEPS = 2.5
"""[times the largest computed step nearby] A leap below it is a motion. Why: a robot that lags may catch up
by twice the step that the model makes."""
AWAY_STEPS_NEAR = 10
"""[rows] How far nearby reaches. Why: assumed; a lag of ten rows is a long one."""
AWAY_NOISE = 12.0
"""[times the noise] That a leap must exceed besides. Why: outliers of trackers reach it, in single rows."""
AWAY_REACH_SHARE = 0.5
"""[share of a point's whole motion] That a leap must exceed besides. Why: a tendon that slips lets a robot
leap back by a part of its motion; a tracker that takes something else for its marker knows no such bound."""
AWAY_BACK_SHARE = 0.35
"""[share of the leap] From where it was before a point may be off when it is back. Why: as of bumps
(`BUMP_ALIKE_SHARE`)."""
AWAY_LONGEST_SHARE = 0.6
"""[share of a trial's rows] That a point may stay away. Why: what stays longer is a bump, or the rest is."""
AWAY_ROWS = 5
"""[rows] Away in all, at least, and in stretches of two or more. Why: assumed; few rows move no fit."""
ZERO_CONVINCING = 0.35
"""[error with the zero of one trial's inputs put right over that with it] Below it the zero is off. Why: a
number is fitted here, which takes a part of any error."""
ZERO_TIMES = 1.8
"""[times the largest error of the other trials] From it on one trial's zero is asked for. Why: zeros that
differ from trial to trial are a cause; of 123 sound sets, none had a trial that stood out so."""
MOVED_NOISE = 6.0
"""[times the noise] By which points must lie elsewhere for a tracker that was moved between trials. Why:
assumed; less is hardly more than a row's noise, and no cause is made of it."""
MOVED_LEFT_SHARE = 0.15
"""[share of that] Left of it when the trials are moved back as one body. Why: assumed; a robot that changed
moves its tip, and not its base."""
MOVED_FIRST_NOISE = 3.0
"""[times the noise] By which the first rows must lie elsewhere, too. Why: five standard errors of their
mean."""
MOVED_FIRST_ROWS = 3
"""[rows] At a trial's start whose mean is its first place. Why: assumed; few trials rest for longer."""
MOVED_ROWS = 300
"""[rows] Of each trial that are compared. Why: more rows of the same motion say nothing new."""
ONE_TRIAL_TIMES = 1.5
"""[times the error of the middle trial] From it on a mistake is looked for in one trial. Why: assumed; a
cause is at work in all of them, more in some than in others."""
ZEROS_TRIED = (0.05, 0.1, 0.15, 0.2, 0.25)
"""[share of the largest input] By which the zero of one trial's inputs may be off. Why: the nearest of them
takes three quarters of any error in between; less than a twentieth is a small one."""
STEP_ROWS = 12
"""[rows] By which two logs may be shifted against one another. Why: assumed; more is another trial."""
STEP_STRETCH_ROWS = 12
"""[rows] On which a shift is looked for, at least. Why: fewer hold no motion to compare."""
STEP_ONE_WAY_ROWS = 5
"""[rows] Out, and home, on which a shift must hold, at least. Why: of a stretch that only goes one way a bend
that stays back by a constant looks shifted."""
STEP_LEFT_SHARE = 0.3
"""[share of the squared error] Left once the logs are put right. Why: assumed; a wrong model errs at any
shift."""
STEP_USUAL_TIMES = 3.0
"""[times the squared error of the middle trial] Left once the logs are put right, at most. Why: the trial is
then about as well explained as the others are."""
LATE_NOISE = 4.0
"""[times the noise] An error, or a motion, below it says nothing about rows in time. Why: assumed; it is then
noise by a sixteenth and more."""
LATE_OTHERS = 2.0
"""[times the squared error] By which other trials would err more with the delay of a late one. Why: a robot
that is late is late in all of them."""
DRIVEN_SHARE = 0.5
"""[share of a late trial's drive of an input] By which another trial drives it, at least, to say that it is
not late. Why: assumed; a lag, or a dead-band, of one channel shows only where that channel is driven."""
LONE_FOLLOWS_SHARE = 0.5
"""[share of a trial's variance] Less of it in what the model says, now or earlier, and it follows nothing.
Why: assumed; with causes of the list a trial followed by less in 3 of 123 sound data sets, but not alone."""
OTHERS_FOLLOW_SHARE = 0.97
"""[the same] More of it in every other trial. Why: in sound data sets with such a trial another one followed
by 0.94 at most."""
LONE_MOTION_SHARE = 0.5
"""[share of the middle trial's motion] A trial that should move less is not asked. Why: a play or a friction
may take most of a small motion."""
OUTSTANDING_SHARE = 0.25
"""[share of the motion] An error below it is nothing outstanding. Why: assumed; near the noise trials differ
by chance."""
OUTSTANDING_TIMES = 2.5
"""[times the largest error of the other trials] Beyond it a trial is outstanding. Why: of 123 sound sets,
most with causes, one trial erred 1.4 times as much as any other; in one set two erred 2.1 times."""
ACQUITTING = 3
"""[single causes] The best ones are asked whether they account for trials that look wrong. Why: assumed; what
one of the first three does not explain is no single cause."""
ACQUITTED_SHARE = 1.1
"""[error of a trial over the one without the cause] What accounts for one trial makes no other worse by more.
Why: by a tenth errors differ by chance; a cause that halves one trial's mistake puts half on the others."""
ACQUITTED_NOISE = 1.5
"""[noise] What accounts for a jump in a trial leaves no trial a larger error. Why: outliers make it 1.4 times
the noise; of a bump that no cause makes, and that is seen, several times the noise stay."""
ANOTHER_FORM = 2.0
"""[times as much] What its simplest form leaves is worth trying a cause's other forms. Why: a drive's lag
leaves twice the noise where the tracker lags."""
CLIPPED_ROWS = 5
"""[rows] That stand at exactly an output's end. Why: assumed; a measured value comes twice by rounding."""
CLIPPED_TIMES = 4.0
"""[times as often as any other value] The same for sensors that count coarsely. Why: their ends come about as
often as other values."""
CLIPPED_BEYOND_SHARE = 0.1
"""[share of the computed range] By which the model must move there. Why: a robot at rest stands at an end,
too."""

# ---------------------------------------------------------------- fitting

SMALLEST_WEIGHT_SHARE = 1e-3
"""[share of the spread of a unit's measurements] A unit's weight is at least so much. Why: noiseless data
of a test would have none."""
ROWS_TO_CHOOSE_BY = 600
"""[rows] About so many are compared to choose between hypotheses. Why: more rows of the same cycles cost
time and say nothing new; the chosen one is fitted to all."""
MOST_SINGLES = 8
"""[hypotheses] Of a single cause, fitted where the robot moved: the best probed. Why: each is simulated, at
some hundred times what an analytic twin costs; a cause that does much alone is among the first."""
SECONDS_TO_CHOOSE_BY = 10.0
"""[s] The same of data taken in motion, of the trials' beginnings together. Why: a simulated second costs
time, not a row; a few seconds of each trial hold several swings of a robot."""
SECONDS_BESIDE_SWINGS = 36.0
"""[s] The same of two recordings whose difference is mostly what no command tells. Why: of a real trunk's,
10 s told a weight from a gain by chance, 36 s told 100 g from it by a tenth of the error."""
LONGER_STEPS = (2, 4)
"""[times the robot's own step in motion] Tried for fits, in this order. Why: each halves the time; four times
half a millisecond still is a hundredth of the period of a fast swing."""
STEP_SHARE = 0.1
"""[share of the noise, root mean square] By which longer steps may change an output. Why: assumed; a tenth
of the noise moves fitted numbers by a tenth of their intervals or less."""
SECONDS_TO_STEP_BY = 6.0
"""[s] Of the trials' beginnings together, on which steps are compared. Why: assumed; it costs no more than
two robots of a choice do."""
LEAST_BLOCK_S = 1.0
"""[s] Stretches of rows that count as one, at least, in motion. Why: rows a hundredth of a second apart are
no independent values; a robot's swing lasts some tenths of a second."""
CLOCK_ROUNDING = 1e-6
"""[share of a stretch] That a clock's digits may lack of it. Why: fifty steps of 0.1 s add up to 2e-15 s less
than 5 s; epoch seconds have seven digits behind the point."""
FOLDS = 8
"""[folds] Of the cross-validation; a fold is a stretch of whole cycles. Why: assumed; each fit keeps seven
eighths of the data."""
GROSS_ERROR = 1e3
"""[weights] From it on a residual counts by its size and no longer by its square (Huber 1964). Why: what is
wrong so grossly draws a fit in one direction, but does not outweigh all the rest of the data."""
NO_EQUILIBRIUM_ERROR = 1e3
"""[weights] The residual of a robot that finds no equilibrium, at least. Why: it must lose against any
robot that stands still; twice the largest measured value counts where that is more."""
DERIVATIVE_STEP = 0.05
"""[scales of the parameter] Step of the derivative by differences. Why: assumed; small beside a change that
matters (one scale), large beside what a solver leaves."""
MOST_FIT_STEPS = 24
"""[steps] Of a fit. Why: assumed; it bounds the time."""
MOST_ROUGH_STEPS = 4
"""[steps] Of a fit that only says which sets of two are worth fitting well. Why: the first steps take most of
what there is to take."""
FIRST_DAMPING = 1e-4
"""[share of the curvature] With which a fit starts. Why: assumed; the first step is nearly a whole one."""
LARGER_DAMPINGS = (10.0, 100.0, 1e3, 1e5)
"""[times the damping] Tried side by side where a step fails. Why: assumed; the last leaves only the steepest
way, a little."""
FAIR_GAIN = 0.25
"""[share of the gain promised] A step with less has its derivative worked out anew. Why: the usual bound
below which a trust region shrinks."""
FIT_CONVERGED = 2e-4
"""[relative fall of the sum of squares] A smaller one is not worth another step. Why: far below what
decides between hypotheses (`PAYS_SHARE`)."""
FOLD_CONVERGED = 1e-3
"""[the same] Of a fit without a fold. Why: its rows are predicted, no numbers are reported of it."""
FOLD_FIRST_ORDER = 0.1
"""[share of the error of the rows left out] The change by which these rows may be predicted to first order.
Why: what bends on so short a way changes their error by a hundredth or so, a third of what pays."""
MOST_FOLD_STEPS = 12
"""[steps] Of a fit without a fold. Why: it starts at the fit to all rows."""
NO_INFLUENCE = 1e-2
"""[weights, root mean square, per scale] A number that changes the residuals by less is left alone. Why: a
hundredth of the noise."""
NEAR_BOUND = 1e-3
"""[scales of the parameter] A number so near to its bound is at it. Why: no such change matters."""
MOST_VALLEY_TRIALS = 100
"""[trials] Of the thorough search for the bottom of a valley. Why: assumed; it bounds the time."""
FOLD_STEP_PARTS = (1.0, 0.3, 0.1)
"""[share of the step] Tried in this order, until the error on the rows kept falls. Why: a whole step may
leave the range in which the model is nearly linear."""
NO_DAMPING = 1e-9
"""[share of the normal matrix's diagonal] Of the step that leaves a fold out. Why: next to none; it keeps the
matrix regular where numbers do the same."""
ROWS_TO_SCAN_BY = 100
"""[rows] Of whole trials, for a scan. Why: a scan tells minima apart that lie a twelfth of a range from one
another, which a hundred rows show."""
GRID_VALUES = (12, 6)
"""[values per number] Of the scan of one number, and of two. Why: a delay of nine seconds has a lesser
minimum nearby; twelve values of its range step over that."""
FIRST_IN_ALL_FORMS = 2
"""[single causes] The best ones are tried in all their forms before sets of two. Why: a hidden law of the
fifth power comes first or second as one of the third."""
SCANNED_SIZES = (-12.0, -4.0, -1.0, 1.0, 4.0, 12.0)
"""[scales of the parameter] Where more than two numbers are scanned, one at a time. Why: both signs, as the
zero of a slack tendon's drive does nothing on one side; the sizes of most causes that matter."""
LONGEST_STEP = 20.0
"""[scales of the parameter] Of one iteration. Why: assumed; beyond it the derivative says nothing."""
LEAST_SQUARE_SHARE = 1e-12
"""[share of a trial's largest sum of squared errors] Less counts as so much. Why: a model without any error
has a gain too, whose logarithm must be finite."""
SIGN_DRAWS = 4096
"""[draws] Of the signs of stretches, in place of all of them where there are more. Why: a chance of 2.3 %
is known to a quarter of a percent."""
TRUSTED_SHARE = 0.1
"""[share of the residuals] What an unknown error of the model may do. Why: no model of these robots is
known to stay below it; with it true values lay in their intervals in 647 of 666 cases of the blind
bench."""
INTERVAL_TOLERANCE = 0.05
"""[share of the way between two values that enclose an interval's end] How exactly the end is found. Why:
an interval's end is told by two digits."""
WHITE_CORRELATION = 0.3
"""[correlation of neighbouring rows] Residuals with less show no structure from row to row. Why: assumed; a
hundred rows of noise stay below it for sure."""

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
HOPELESS_FACTOR = 1.2
"""[times the cross-validated error of the set beside] A set that errs by more on what it was fitted to is not
cross-validated well. Why: what is left out it tells worse still, and sets are equal within `EQUAL_FACTOR`."""
SETTLED_FACTOR = 1.1
"""[times the error's white part] An error within it is settled: nothing more is looked for than one step
finds, and of a robot in motion nothing more. Why: what is white from row to row has no cause."""
WILD_ERROR = 3.0
"""[times the error's white part] A row's error beyond it counts as so much there. Why: one row in a hundred
at ten times the noise makes the whole error 1.4 times as large, and has no cause."""
BEAM = 3
"""[sets of causes] To which another cause is added. Why: the best set of two need not hold the best single
cause; `tests/diagnosis/test_select.py` has pairs that a smaller one misses."""
PATIENCE = 1
"""[steps] That need not pay, if the next one does. Why: two causes may pay where neither does alone;
`tests/diagnosis/test_select.py` has such a pair."""
MOST_CAUSES = 8
"""[causes] In a set, at most. Why: the OpenCR robot's training file wants as many."""
CHOICE_ROUNDS = 3
"""[rounds] Of choosing, if something better stands in a cause's place in the end. Why: assumed; it ends the
exchange of two causes for one another."""
FINALISTS = 3
"""[hypotheses] Fitted in one step; as many of few numbers, and as many beside the best set. Why: a probe is
one step of a fit, which ranks well but not surely."""
PAIRS = 24
"""[sets of two causes] Fitted roughly where those beside the best single causes leave structure. Why: one
step from a single cause tells little of a set whose numbers are both far from it."""
PAIRS_IN_MOTION = 6
"""[sets of two causes] The same where the robot moved. Why: assumed; twice the `FINALISTS`, as each robot is
simulated."""
PROBE_DAMPINGS = (1e-3, 0.3, 10.0)
"""[share of the normal matrix's diagonal] Of the steps of a probe. Why: a whole step, one half as long, and a
short one where the derivative misleads."""
PROBE_HALVINGS = 2
"""[halvings] Of a probe's step that makes things worse, at most. Why: the play of a robot in motion started
four times too wide (draw 4 of the bench in motion, seed 12), and was not among those fitted: 25 minutes
instead of one."""
SHORTLIST = 3
"""[hypotheses] Beyond those to be fitted, of which the first step is computed with the full model. Why: their
derivatives rank them well but not surely."""
RIVALS = 2
"""[hypotheses] Fitted in the place of each chosen cause. Why: assumed; what does as well ranks first among
the probes."""
NEAR_TERMS = 10
"""[variants of causes] The best probed ones, of which two at a time are tried in the place of one or two
chosen causes. Why: assumed; of ten there are forty-five pairs, each ranked in a millisecond."""
NEAR_SETS = 4
"""[hypotheses] Of each size, near the set at which a search ends, that are fitted. Why: assumed; ten or so in
all cost as much as one more step of the search."""
MOST_FORMS = 8
"""[hypotheses] Other variants of a set's causes, fitted where the search would end. Why: assumed; it bounds
the time."""

# ---------------------------------------------------------------- the verdict

ESTABLISHED = 0.5
"""[probability] Of a cause, or of a group that the data cannot tell apart, to be named. Why: a named cause is
to be more probable than not."""

NEAR_NOISE = 1.5
"""[times the noise floor] An error within it is no discrepancy; what several causes leave is small. Why:
the floor is what is white in the error, and a right model leaves at most 1.3 times as much (blind bench:
1.02 to 1.04)."""
ROUGH_NOISE = 3.0
"""[times the noise floor] The same where the error shows no structure from row to row. Why: assumed; an
error without structure shows no cause."""
REMAINDER_NOISE = 2.0
"""[times the noise floor] What one cause leaves is small within it; beyond, it must have no structure. Why:
one cause imitates less than several do, for which `NEAR_NOISE` counts."""
REMAINDER_SHARE = 0.07
"""[share of the error before] What is left is small within it. Why: the causes are then right but for their
form."""
REMAINDER_HANGS_PERCENT = 25.0
"""[% of the squares left] Depending on one thing, they speak against the causes. Why: assumed; with it
causes outside the list ended as `unexplained` in 58 of 60 draws of the blind bench."""
MUCH_LEFT_NOISE = 5.0
"""[times the noise floor] So much of an error left says that something else is wrong besides. Why: learned
from an eccentric pulley that was taken for stiffness, with 7 and 12 times left."""
LEAST_TAKEN_SHARE = 0.5
"""[share of the error before] Causes that leave so much must take it. Why: as of `MUCH_LEFT_NOISE`: 31 and
41 % were taken there."""
GAIN_CHANCE = 0.05
"""[probability] Of the held-out gain by chance, at most. Why: the usual level of a test."""
LARGE_GAIN_PERCENT = 15.0
"""[% of the error before] A gain of so much needs no interval above zero. Why: no accident of a few trials;
the interval of few trials is wide however much is gained in all of them."""
LEAST_GAIN_PERCENT = 0.5
"""[% of the error before] A cause with less on held-out data is not named. Why: assumed; less is no cause
that anybody would mend."""
NO_GAIN_PERCENT = 0.1
"""[% of the error before] The same once other causes were left out. Why: then small shares move about, and
only what has none goes too."""
DOUBT_NOISE = 3.0
"""[times the noise floor] An error left beyond it is told as a doubt. Why: assumed; it doubles
`NEAR_NOISE`."""

HARM_SHARE = 0.05
"""[share of the error before] By which an error must rise to count as worse. Why: assumed; a cause that helps
elsewhere may cost a twentieth where its form is not quite right."""
HARM_NOISE = 1.3
"""[times the noise floor] An error within it is not worse. Why: a right model leaves at most 1.3 times the
floor (`NEAR_NOISE`)."""
HARM_CHANCE = 0.01
"""[probability] Of such a rise by chance, at most, shared among all that is looked at. Why: one diagnosis in
a hundred may see harm where none is done."""

# ---------------------------------------------------------------- two recordings of one robot

PAIR_SHARE = 0.005
"""[share of an input's range] By which the inputs of paired rows may differ. Why: assumed; a servo's
command comes back within a few thousandths; half a percent of the reach moves a tip by about its noise."""
SAME_WAY_SHARE = 0.15
"""[share of an input's range] By which the inputs of one programme may differ at any row when a moving robot
plays it twice. Why: a real trunk's motors, measured while they carried other weights, came within 0.14; the
model is told of the difference, and errs by little more over it."""
STRETCH_SHARE = 0.1
"""[share of an input's range] From row to row, up to which errors are taken to be linear between two rows.
Why: assumed; a side of a loop in ten steps is nearly straight in each, a longer step may hide a turn."""
MOSTLY_PAIRED = 0.9
"""[share of the rows] From it on the earlier recording need not be explained. Why: what both share then
cancels at nearly all rows, whatever it is."""
MODEL_SHARE = 0.35
"""[share of the error before] So much of a change may be left, beside the noise, by a model that does not
explain the earlier recording either. Why: such a model is wrong about how much a change does, too: on a real
trunk with known weights by 0.21 and 0.28; more causes would only mend the model."""
MOST_MODEL_SHARE = 0.8
"""[share of the change] The same of a robot in motion, where nothing that follows from the commands tells the
rest, at most. Why: learned from a real trunk, whose swings differ by as much as 100 g move it (0.79 left);
a third of the squares must be told. Wrong names that it lets through have not been counted."""
MOST_CHANGES = 4
"""[causes] That may have changed, at most. Why: assumed; nobody changes more at once."""
EARLIER_CAUSES = 6
"""[causes] By which an earlier recording is explained, at most. Why: half of a real trunk's rows explains the
rest with five and more, not with four; more soak up what is unknown, err elsewhere and take minutes."""
LIKELY = 0.75
"""[probability] Of each change that a further way of telling names, at least. Why: assumed, three to one;
each way is one more chance to name what is not there."""
ONE_ROBOT_TIMES = 1.25
"""[times the error] That one robot, or a simpler telling, leaves of both recordings, at most, if it is as
good. Why: learned on tuning draws: 1.6 to 18 of 17 told changes that were there, 0.96 of the one
that was not."""
COMPARING_BUDGET_S = 300.0
"""[s] For the search of a comparison, where none is given. Why: of 200 judged interventions 172 end within
a minute on one core, 194 within five; the others would go on for many more."""
BASELINE_BUDGET = 0.4
"""[share of the budget] For explaining the earlier recording. Why: assumed; the later one's search is the
longer one where the earlier robot fits."""
COURSE_SURER = 3.84
"""[chi squared] By which one course of a number over recordings must miss by less than another to be told.
Why: beyond it lie 5 % of the squares of one normal deviate."""
COURSE_MISSED = 0.01
"""[probability] Of as large a miss of the best course, below which the number went in another way. Why: one
in a hundred right courses is called irregular."""
COMMON_SHARE = 0.5
"""[share of a variance] Of a change since the first recording that is that recording's own, common to all.
Why: assumed; it scatters as the others do."""

# ---------------------------------------------------------------- how probable a cause is

DISCREPANCY_PRICES = (1e-4, 1e-3, 1e-2, 0.1, 1.0, 10.0)
"""[share of the rows] Prices of a smooth error's coefficients, of which the one is taken that predicts best.
Why: from next to free to next to none, a factor of ten apart; finer steps change the prediction by little."""
DISCREPANCY_SURE = 2.0
"""[standard deviations of chance] By which a smooth error must do better than none, on stretches left out, to
be believed. Why: two of them, as for a cause (`PAYS_CHANCE`); of noise alone it then predicts nothing."""
MOST_CROSSED_INPUTS = 4
"""[inputs] Whose products a smooth error may depend on. Why: assumed; of eight inputs there are twenty-eight
products, more than a short data set can price."""
IMPLAUSIBLE_BELIEVED = 0.15
"""[share of its probability] What a settled cause keeps whose numbers are not plausible; the rest goes to
"outside". Why: of six such causes on data that other code had made one was at work, and the cause was
outside the list of the five others."""
MOST_SURE = 0.99
"""[probability] None is told above it, and none below the rest to one. Why: a few hundred draws are known;
they say nothing of one error in a thousand."""
LEAST_SHOWN_PROBABILITY = 0.05
"""[probability] A cause below it is not in the report's table. Why: it holds what a reader may act on;
diagnosis.json has all."""
LARGEST_GROUP = 3
"""[causes] That the data cannot tell apart and that are one answer, at most. Why: of four names a reader has
no answer."""
MENDING_NUMBERS = 1
"""[numbers] Of a model that is known to be wrong, a set with more numbers more than a chosen one says nothing
against it. Why: measured on a trunk with a hung weight, where a gain and a coupling of twelve and six numbers
mend the bending better than a force of three tells it; assumed that one more is a direction beside a size."""
MEMBER_WEIGHT = 0.7
"""[1/standard deviation] By which the share of a group's member falls with how surely another does better.
Why: assumed; in three draws of the independent bench just one of two was at work, which says little."""
LEAST_MEMBER_SHARE = 0.15
"""[share of a group's probability] With less a cause is no member. Why: assumed; a reader looks at what may
be one in seven."""
MOST_RATIO = 1.5
"""[natural logarithm] Of the ratio of two errors, beyond which more says no more. Why: a cause without which
the error is four times as large is needed, whatever else is wrong."""
MOST_NUMBERS = 6
"""[fitted numbers] By which one hypothesis has more than another, beyond which more says no more. Why:
assumed; a tracker's frame has six."""
FEWEST_UNLISTED = 3
"""[corrections] From so many on, one cause in a form that is not listed is asked about. Why: data with one
hidden cause in a foreign form ended with three to six."""
UNLISTED_NOISE = 1.2
"""[times the noise] The same; with less left the corrections explain the data. Why: right models leave 1.02
to 1.04 (`NEAR_NOISE`)."""
UNLISTED_SINGLES = 6
"""[single causes] The best ones are tried with a smooth error beside them. Why: assumed; what explains little
alone leaves the smooth error to explain the rest."""
LOG_ODDS_OF_NAMED = (-0.61, 0.17, 2.62, 0.2, 0.1, -0.36, -1.09, -0.43, -0.55, 0.64)
"""[1, 1/standard deviation, 1/log, 1/number, 1/standard deviation, 1/log, 1/log, 1, 1, 1/log] Weights of the
evidence of a cause or group of the hypothesis (`probabilities.features_of_named`). Why: what was believed
before, changed by 98 draws (`scripts/calibrate_probabilities.py`): of the independent bench (tuning seed 51),
of the first bench (seed 61), of interventions (tuning seed 62), and six loads of a real joint
(`tests/diagnosis/test_wrist_changes.py`); 109 answers, 70 right."""
LOG_ODDS_OF_RIVALS = (-3.8, 0.2, 0.51, -0.12)
"""[1, 1/standard deviation, 1/log, 1/number] The same of a cause that could stand in another's place
(`features_of_rival`). Why: from the same draws: 1124 answers, 11 right."""
LOG_ODDS_OF_OTHERS = (-5.33,)
"""[1] Of a cause that no good hypothesis has. Why: of 205 in the same draws none was at work (one of each
kind added)."""
LOG_ODDS_OF_OUTSIDE = (-4.56, 2.67, 0.45, 0.15, 0.47, 0.52)
"""[1, 1/log, 1/standard deviation, 1, 1, 1] Of something outside the list (`features_of_outside`). Why:
from the same draws: 83 answers, 8 right."""
LOG_ODDS_OF_NONE = (4.29, -3.87, -1.24)
"""[1, 1/log, 1/standard deviation] Of no cause (`features_of_none`). Why: from the same draws: 98
answers, 23 right."""

# ---------------------------------------------------------------- what residuals depend on

BINS = 8
"""[groups of rows] Along a coordinate. Why: assumed; a loop or a wave shows in eight."""
FINE_BINS = 24
"""[groups of rows] Of an input in fine steps. Why: of waves over an input eight groups would each hold
one."""
ROWS_IN_BIN = 5
"""[rows] In a group, at least. Why: assumed; a mean of fewer is noise."""
FEWEST_BLOCKS = 4
"""[cycles] With fewer, equal stretches of rows stand in. Why: signs of three cycles can be turned in eight
ways only, which allows no small p-value."""
REVERSAL_SHARE = 0.02
"""[share of an output's range] Smaller moves back are no turning point. Why: noise of the inputs."""
STRUCTURE_DRAWS = 999
"""[draws] Of the cycles' signs. Why: p-values down to a thousandth, a tenth of `SIGNIFICANT_P`."""
SIGNIFICANT_P = 0.01
"""[p-value] Of a test of residuals. Why: eight tests are made, so that one in twelve right models shows
any."""
NEAR_AXIS_SHARE = 0.1
"""[share of the largest distance from the axis] Within it there is no bending plane. Why: noise turns it
about there."""

# ---------------------------------------------------------------- simulation and the next experiment

SMOOTH_RAMP_S = 0.1
"""[s of simulated time] From row to row of a robot without friction. Why: measured on 60 rows of eight
robots, it moves the outputs by at most 0.004 mm from where a whole second leads."""
DRY_RAMP_S = 0.5
"""[s of simulated time] The same with friction, which remembers an overshoot. Why: measured likewise, 0.002
mm; with half of it 0.016 mm."""
SMOOTH_STRIDE = 20
"""[time steps] That a replay makes in one, of a robot without friction to which tensions are given. Why:
measured on 40 to 60 rows of five robots, it moves the outputs by at most 0.001 mm; tendons that are drawn
would not come to rest."""
SMOOTH_DRIVEN_STRIDE = 2
"""[time steps] The same of a robot without friction that is driven by displacements. Why: measured on 40 to
60 rows of three robots, 1e-5 mm; with four, catheters do not come to rest."""
DRY_STRIDE = 4
"""[time steps] The same with friction, where tensions are given. Why: measured on 60 rows of four robots,
0.01 mm; with 20, a rolling robot diverges."""
TELLS_APART_NOISE = 2.0
"""[times the noise, root mean square] Inputs that part two causes by it tell them apart. Why: assumed; over
hundreds of rows that is far beyond chance."""
ENOUGH_APART_NOISE = 10.0
"""[times the noise] More does not matter. Why: inputs that part several rivals well win over those that
part one extremely well."""
PROGRAMME_ROW_S = 2.0
"""[s] From row to row of proposed inputs. Why: slow enough to be quasi-static."""
PROGRAMME_STEPS = 8
"""[rows] Of a ramp over the whole reach. Why: assumed; a loop's shape shows in them."""
STANDING_SHARE = 0.3
"""[share of its reach] At which a channel stands while others move. Why: taut, and far from its reach."""
HOLD_S = 240.0
"""[s] A rest out and at home. Why: drift goes on over minutes."""
HOLD_ROWS = 6
"""[rows] Of such a rest. Why: assumed; a course in time shows in them."""
PACES = (0.25, 4.0)
"""[times the time from row to row of what was measured] Why: a lag's loop changes its width with the speed;
a factor of four each way shows that."""
MOVING_ROW_S = 0.02
"""[s] From row to row of inputs proposed for motion. Why: assumed; a servo takes commands at 50 Hz."""
LET_GO_S = 0.1
"""[s] In which a channel is pulled, or let go, to make a robot swing. Why: assumed; short beside most swings,
and within what a servo can do."""
SWING_S = 2.0
"""[s] For which it then swings. Why: assumed; several swings of a robot of some Hz."""
SLOW_LOOP_S = 4.0
"""[s] Of a slow loop out and home, in motion. Why: assumed; slow beside a swing: friction shows alone."""
SWEEP_S = 6.0
"""[s] Of a sweep of frequencies. Why: assumed; some ten periods."""
SWEEP_HZ = (0.2, 3.0)
"""[Hz] From where to where it goes. Why: assumed; from quasi-static to beyond most robots' first swing."""
FORCE_SHARE = 0.2
"""[share of the force that bends the robot by a radian] A known force across the tip. Why: it bends well
beyond the noise and harms nothing."""
ALIVE_BELIEF = 0.05
"""[probability] A hypothesis below it is not asked about by the best next experiment. Why: a report shows
none below it either (`LEAST_SHOWN_PROBABILITY`)."""
IDLE_BELIEF = 0.02
"""[probability] Of a cause that nothing speaks for, where fewer than two hypotheses are alive. Why: what was
measured may never have shown it, as single pulls show no play; one in fifteen causes or so is at work."""
SURE_BELIEF = 0.95
"""[probability] At which a closed loop takes a cause for found. Why: one answer in twenty may be wrong."""
NATS_PER_MINUTE = 0.05
"""[nat/minute] Price of an experiment's duration, played once. Why: every programme was played on 21 robots
whose first data could not tell. What this price chose settled 17, in 3.5 minutes of four plays on average,
what a tenth of it chose 15, in 7.7, and what four times it chose 15, in 2.4: beyond some length a programme
tells no more, while what the model cannot follow still grows."""
ROWS_AS_ONE = 4.0
"""[rows] That count as one where information is worked out. Why: rows of one stretch err together, by what no
hypothesis knows; assumed."""
MOST_OF_STRETCH = 0.3
"""[nat] That one stretch of an experiment may tell. Why: ten must agree before two equals are told apart with
`SURE_BELIEF`. A diagnosis turns the signs of stretches (`PAYS_CHANCE`), and cuts one cycle in several."""
INFORMATION_DRAWS = 200
"""[draws] Of data of each hypothesis. Why: the information is then known to 0.03 nat."""
REFITTED_PROGRAMMES = 6
"""[programmes] Of which, at most, every hypothesis is fitted anew to what every other one says. Why: assumed;
fits cost a hundred times what a derivative does; mostly the first by derivatives stays the first."""
PULL_LEVELS = (0.35, 0.7, 1.0)
"""[share of the range] At which a staircase of holds rests. Why: assumed; low, middle, end."""
SHORT_HOLD_S = 30.0
"""[s] Of a rest of such a staircase. Why: assumed; shorter than a creep, longer than a lag."""
RANGE_SHARE = 0.95
"""[share of the range] That proposed inputs use. Why: an end is where stops and slack tendons are."""
SENSOR_WORTH = 0.1
"""[nat] That one more sensor must tell beyond the proposed inputs to be worth a word. Why: assumed; a seventh
of what settles between two causes."""
MARKER_NOISE = {"mm": 0.2, "deg": 0.3, "N": 0.02}
"""[mm, deg, N] Of a further sensor, where no output of its unit is measured. Why: assumed; trackers and load
cells of the papers' benches."""

# ---------------------------------------------------------------- pictures

SHOWN_MOTION_SHARE = 0.02
"""[share of the output that moves most] An output that moves less is not drawn. Why: it shows nothing."""
LEAP_SHARE = 0.2
"""[share of a path's range, from row to row] Beyond it rows are drawn as places that no line joins. Why: two
postures in random order lie a third of the range apart and more, two of a path of twenty rows a tenth."""
PAUSE_FACTOR = 5.0
"""[times the median step] A longer pause breaks a line. Why: no line may cross rows that were left out."""
