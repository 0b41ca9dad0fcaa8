"""The thresholds of all checks, each with its unit and what it stands for.

They are told by drives whose faults are known (tests/twin/checks): sound ones pass, and a fault is
named from the size on that a fit would notice.
"""

# The low-pass at which signals are compared

BLOCK = 1e-3  # s: what is faster is noise to an identification of friction
WINDOW = 20e-3  # s, full length; shorter, the noise of usual encoders hides the acceleration
FEWEST_BLOCKS = 8  # in a window, so that its shape is smooth at any rate

# An axis in motion, and what its command is explained by

IMPOSSIBLE = 4.0  # times the acceleration that 99 % of the samples stay below
JUMP_NOISE = 10.0  # times the rms of noise
SLOW_SPEED = 0.02  # times the highest speed: below, Coulomb friction is not yet full
COVERED = 15.0  # rms of noise; of 3 million samples white noise covers 10
MOVING = 5.0  # speed, in units of its noise
MOST_HELD = 20  # samples of one value; a slower channel is told by its lag
PHASE = 0.95  # of the changes fall on one of every m samples where a signal is held
FEWEST_CHANGES = 50  # of which that part is told
PASSED_IN = 4  # samples in which a count is passed
FEWEST_COUNTS = 5  # that tell one
ONE_COUNT = (0.5, 0.25, 0.1)  # parts of the ways that may be less, as text far from 0 is coarser
WHOLE_WAY = 0.05  # of a count: how far a way may be off a whole one
OF_WHOLE_WAYS = 0.9  # least part of the ways that are whole ones
FULL_FRICTION = 0.95  # of Coulomb friction: a low-pass with less of it holds a standstill
SAME_LAG = 0.3  # largest difference of a lag with and without a memory, as a part of it
PRESLIDING = (0.003, 0.01, 0.03, 0.1, 0.3)  # of the way covered, over which friction may build up
FALLS_SHORT = 0.8  # of the setpoint's spread, up to which a position falls short of it
SPRING = 0.3  # largest part of a command that a spring to the setpoint leaves
AS_GOOD_GAINS = 1.5  # times what is left with two gains, that one may leave
WELL = 0.03  # or that part of the command
LEAST_MOTION = 0.3  # s; a loop that is closed at rest settles within half of that

# A rough model of the axis, and lags

TRIMMED = 0.05  # share of the samples that a fit leaves out
ROUNDS = 4  # of such a fit, after which the samples left out stay the same
LEVERAGE = 3.0  # times the acceleration that 99 % of the samples stay below
EXPLAINED = 0.3  # residual as a part of the command
NOTICED = 0.3  # share of mass x acceleration in the command
LONGEST_LAG = 0.25  # s, searched both ways
MOTION_OVER_LAG = 20  # least length of the log over the longest lag, so that it holds several moves
CLEAR_LAG = 0.5  # largest residual at the best lag, as a part of the signal
WRONG_LAG = 0.03  # least residual without a lag, as a part of the signal
BETTER_LAG = 0.6  # largest residual at the best lag, as a part of that without a lag
LAG_PARTS = 8  # of a log, each with a lag of its own
FEWEST_LAG_PARTS = 5  # lively ones, of which a median is worth the name
KEPT_PART = 0.2  # of a part, that moves for it to tell a lag; of moves with pauses half is rest
LIVELY_PART = 0.04  # least range of a part, of that of the whole
REPEATS = 0.7  # least correlation of a signal with itself a period later
OF_A_PERIOD = 0.125  # lags beyond that part of a period are told from none by the harmonics alone
AS_GOOD_LAG = 1.5  # times the least residual: lags up to it count as equally good

# Breaks of the position, and outliers

COURSE = 10  # samples on either side from which the course is told
CLUSTER = 3  # samples between two bends of one break
STUCK = 5e-3  # s of one value
STUCK_SAMPLES = 5  # at least, where so long is fewer
SURE_BREAK = 6.0  # times the bend that motion allows
ALIKE_SPEEDS = 0.3  # difference of two speeds, as a part of the larger
WHOLE_TRAVEL = 0.8  # of the travel; a counter that wraps goes back by nearly all of it
LONGEST_GAP = 2.0  # s of missing samples
SHORT_GAP = 0.05  # s, over which the speed may change, and which makes two breaks one
A_SAMPLE = 2.0  # times the motion of a sample
MANY_BENDS = 12  # places from which on it is not this and that, but the clock
EVERYWHERE = 1.0  # bends a second at least, where the clock is uneven
BURSTS_APART = 0.05  # s without an outlier ends a burst
UNUSUAL = 5.0  # times the level that 99 % of the samples stay below
CONTRADICTION = 0.1  # least contradiction, as a part of the command
ROUGH = 0.1  # least roughness, as a part of the command
ROUGH_SPAN = 10e-3  # s, in which half of the samples are rough; a commanded step is only a few
FEWEST_ROUGH = 5  # samples, where so long is fewer

# The command

NOISY = 0.03  # averaged noise of the command, as a part of it; 1 % of its rating leaves 0.02
HIDES = 0.4  # averaged noise, as a part of what the motion leaves unexplained
SINGLE_SAMPLE = 60.0  # times what 99 % of the samples are off their neighbours
LARGE_SAMPLE = 0.3  # of the command
NOISE_BURST = 21  # samples
MOST_TOGETHER = 3  # in so many; more are a burst, and no single ones
EXTREME = 5e-3  # s at one value exactly
EXTREME_SAMPLES = 5  # at least, where so long is fewer
LEVEL = 20e-3  # s at one value but for noise, after the low-pass
LEVEL_BLOCKS = 10  # at least, where so long is fewer
NEAR_LEVEL = 10.0  # times the noise
WIDE_LEVEL = 40.0  # the same for the edges beside the level
EDGE_BLOCKS = 3  # a limited command leaves its level at once, a smooth one slowly
LIVELY_COMMAND = 200.0  # least range of a command, times the noise

# Lags, units and swapped axes

ALLOWED = 3e-3  # s of lag, which a filter or a bus makes
ALLOWED_SAMPLES = 2.0  # at least, where so long is fewer
PHYSICAL = 10e-3  # s, what a slow drive may account for
STEADY = 0.25e-3  # s, what friction that the check does not know may account for
STEADY_SAMPLES = 1.5  # at least, where so long is fewer
SURE_LAG = 5.0  # times its error, that a lag or a drift must be
# What they take off, as a multiple of what is left beside the noise
TAKEN_BY_LAG = 2.0  # ripple, backlash and vibration are answered by a loop: a lag takes off 1.7
TAKEN_BY_DRIFT = 1.0  # of the same a drift takes off 0.2
DRIFT = 60e-6  # s/s; two quartz clocks differ by less
FOLLOWING = 30e-3  # s, what a slow position loop may account for
LONGEST_TRAVEL = 10.0  # m; farther, the unit is wrong
# Allowed ratios, from and to, of two signals that state the same
FOLLOWS = (0.5, 2.0)  # a position and its setpoint; off by more, no controller follows at all
SAME_RATE = (0.95, 1.05)  # a velocity and the rate of a position, which the low-pass rounds alike
SAME_SECOND_RATE = (0.9, 1.1)  # an acceleration and the second rate, whose noise is larger
SAME_FORCE = (0.98, 1.02)  # a force and its current: one scale, with no filter between
LOOKS_LIKE = 0.3  # of the logarithm: how near to a known slip of units a ratio is named so
RELATED = 0.9  # correlation of two signals that state the same
WORSE = 1.2  # times what the motion of the other axis leaves of a force, its own leaves
EXPLAINED_CROSSED = 0.6  # largest part that the motion of the other axis leaves
ROWS_OF_A_GLANCE = 4000  # of a force, enough to tell which of many motions explains it best
ALIKE_SETPOINT = 0.98  # correlation of a position and the setpoint that it follows

# What a fit needs

SLOWEST = 10.0  # Hz; no motion of an axis shows at fewer samples
SHORTEST = 0.5  # s, least duration for identification
COARSE = 0.3  # acceleration noise as a part of the acceleration
ROUNDED = 0.05  # the same, where it is the rounding: that is no noise and does not average out
ROUNDING = 1.0  # noise of rounding is at most its step
CREEP = 0.02  # of the highest speed; slower motion counts as standstill
ONE_WAY = 0.02  # share of the moving time
INERTIAL = 0.005  # share of the force, below which friction that the check does not know hides it
SAME_SPEED = 0.05  # spread of the speeds as a part of their median
