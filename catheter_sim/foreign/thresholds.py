"""Constants of the diagnosis of foreign models, each with its reason."""

from __future__ import annotations

LEAST_ROWS = 20  # of a trial: fewer do not show their noise
NOISE_SHARE = 2e-4  # of a column's range: the least noise that is believed, where data are smoother than that
FAR_LESS_NOISE = 0.5  # of the noise that outputs show, below which that of the model's errors is taken
DRY = 1.25  # times the noise: a model that errs by no more is not contradicted
EXPLAINED_NOISE = 2.0  # times the noise: a model that errs by no more explains the data
EXPLAINED_SHARE = 0.25  # of the error before: neither does one that leaves more than that: real play rattles
LEAST_GAIN = 0.3  # of the error before that a cause must take away from held-out data
STEP_NOISE = 0.5  # times the noise: a step is halved until what is simulated changes by less
OWN_STEP_SHARE = 0.7  # of what a finer step leaves, at most, where the file's own step is taken instead
HALVINGS = 4  # of a step, at most
BLOCK_S = 0.5  # rows closer than this err together, and count as one
SECOND_GAIN = 0.15  # of the error after the first cause that a second one must take away,
SECOND_SHARE = 0.03  # and of the error before: small differences of any model are taken up by some cause
NATS = 5.0  # by which evidence must grow for a second cause; two causes within it are alike
FITTED = 2  # variants of a cause that are fitted, best first by what a straight line promises
FAR_WORSE = 4.0  # times the error that the best variant promises: what promises more is not fitted, but of
LEAST_CAUSES = 3  # so many causes
START_SIZES = (0.3, 1.0, 3.0)  # of what a straight line promises, at which a fit may start
START_FAR = 3.0  # times a number's start, for numbers that do nothing alone
STEPS = 6  # of a fit, of its Jacobian; those of the one that is chosen
LAST_STEPS = 20
SHOWN = 12  # sets of causes in a report's ranking
ESTABLISHED = 0.5  # probability of a cause, or of a group, to be named
LARGEST_GROUP = 3  # causes that the data cannot tell apart and that are one answer, at most
LEAST_MEMBER_SHARE = 0.15  # of a group's probability: with less a cause is no member
EQUAL_ERROR = 1.1  # of the held-out errors of two causes that are told apart by neither
MOST_SURE = 0.99  # none is told above it
HARM_SHARE, HARM_NOISE = (
    0.05,
    1.3,
)  # by which an output's held-out error must rise to be worse, and above which
