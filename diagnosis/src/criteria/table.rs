//! The criteria: default, unit, reason.

use serde::{Deserialize, Serialize};

use super::{Criterion, Number, Reason, criteria};

criteria! {
    /// What a recording must have before anything is fitted to it.
    log: LogCriteria {
        /// Shortest time with something moving.
        motion_s: f64 = 2.0 "s", Judgement: "ten time constants of 0.2 s";
        /// Rate of samples above which times of motion are as many samples as at this rate.
        fast_hz: f64 = 1e3 "Hz", Judgement: "controllers of robots run at up to 1 kHz, and what is sampled faster is seldom one";
        /// How long the slowest measured signal of a robot takes to change by as much as it varies. Where one takes as long, the machine is no faster than a robot, however fast it is sampled.
        changes_s: f64 = 0.1 "s", Judgement: "with a time constant of 0.2 s a speed is another one after half of it";
        /// Shortest run of which at least one is needed.
        run_s: f64 = 1.0 "s", Judgement: "a shorter free run is mostly its initial state";
        /// A sensor whose value changes only after this many sampling periods repeats itself in between.
        repeats_periods: f64 = 1.5 "periods", Derived: "half-way between a new value at every sample and at every other";
        /// Step of a measured signal, over its standard deviation, from which the log has too few levels to tell a motion.
        coarse: f64 = 1.0 "1", Derived: "rounding then makes a twelfth of the variance, and most of the motion is within one step";
        /// Where a combination of the inputs is below this share of them, the part of the plant that it shows counts as not shown.
        unshown: f64 = 0.1 "1", Derived: "of ten volts one is then left for that part, and the dry friction of a drivetrain hides it";
    }

    /// Whether a model can be simulated from its inputs alone, or needs an observer.
    free_run: FreeRunCriteria {
        /// How large an error of the state may become in the measured signals, in their standard deviations, when it starts at one deviation of the state.
        growth: f64 = 10.0 "1", Judgement: "an error that large hides every effect";
        /// Growth over the whole horizon beyond which a model counts as unstable and not as integrating.
        exponential: f64 = 3.0 "1", Derived: "about e: one time constant";
        /// Last share of a run in which errors must still be large; earlier ones are transients.
        late_share: f64 = 0.1 "1", Judgement: "transients are over by then";
        /// Share of the starting instants from which errors must grow.
        starts_share: f64 = 0.5 "1", Judgement: "a majority";
    }

    /// Starting points of a fit, and whether it converged.
    start: StartCriteria {
        /// Share of a signal's deviation that a model is commonly wrong by. It is compared with how exactly the start is measured.
        wrong: f64 = 0.1 "1", Judgement: "a model worth improving leaves about a tenth";
        /// Largest weight of the first sample of a run, in samples.
        most: f64 = 100.0 "1", Judgement: "beyond it the start is as good as given";
        /// How late a measurement may be. A start is known no better than the signal moves in that time.
        late_s: f64 = 0.15 "s", Judgement: "the latest measurement seen on a real machine was 0.135 s late";
        /// Share of the largest value of an input below which it does not act.
        idle: f64 = 0.01 "1", Judgement: "a ramp from zero is at one per cent before dry friction lets go";
        /// How far a signal at rest may be from its first sample.
        still: f64 = 6.0 "standard deviations", Derived: "the difference of two samples is beyond it once in 45 000 by chance, and a start has some tens";
        /// How long a machine that rests has not moved, also if an input acts before.
        rest_s: f64 = 0.05 "s", Judgement: "several samples of a controller; one that moved before changes its speed by more than noise in that time";
        /// Error of a fit above which other starts are tried as well.
        poor: f64 = 0.1 "1", Judgement: "a fit that leaves less has converged, whatever is missing";
        /// Error above which scattered starts are tried too.
        lost: f64 = 0.3 "1", Judgement: "missing physics seldom leaves more after a fit that converged";
        /// Another start counts as better below this ratio of errors.
        further: f64 = 0.98 "1", Judgement: "two per cent: a smaller gain is the same minimum reached another way";
        /// Error of a fit without an observer below which none is needed, and of one with an observer above which its horizon is too long.
        stands: f64 = 0.6 "1", Judgement: "the inputs then explain more than half of the signal";
        /// Error from which the model counts as not fitted: it leaves as much as a constant would.
        hopeless: f64 = 0.99 "1", Derived: "the mean of the signal leaves 1, and one per cent of an error does not matter";
    }

    /// Verdicts on fitted parameters.
    parameters: ParameterCriteria {
        /// Quantile of the intervals.
        quantile: f64 = 0.975 "1", Convention: "two-sided intervals of 95 %";
        /// A parameter is dead if a change by its scale moves the weighted outputs by less than this.
        dead: f64 = 1e-9 "1", Derived: "rounding errors of a simulation";
        /// Singular value of the column-normalised Jacobian below which a direction is flat.
        flat: f64 = 1e-6 "1", Derived: "the root of the rounding error of its square";
        /// Share of a flat direction from which a parameter belongs to it.
        part_of_flat: f64 = 0.1 "1", Judgement: "smaller shares come from rounding and noise";
        /// Distance from the end of its range at which a parameter counts as being there, in its scale.
        at_bound: f64 = 1e-4 "1", Judgement: "far below any standard error";
        /// Standard deviation of a shift of the whole response in time, where the log cannot tell it better; that of a parameter that is a time is no less.
        clock: f64 = 0.05 "periods", Judgement: "a model knows to a tenth of a period when something acted: windings and filters take that long";
        /// Half the interval over the value, from which a parameter counts as not determined.
        not_pinned: f64 = 1.0 "1", Convention: "the interval contains zero";
        /// Rows of a Jacobian beyond this multiple of the median row are reduced to it.
        steep: f64 = 100.0 "1", Judgement: "only a shaft about to break loose is steeper";
        /// Moving-average coefficient below which residuals count as those of rounded counts.
        rounded: f64 = -0.8 "1", Derived: "differenced rounding has -1; other noise moves it towards 0";
        /// Largest autoregressive coefficient of residuals of rounded counts.
        rounded_slow: f64 = 0.3 "1", Judgement: "slower residuals come from errors of the model";
    }

    /// Blocks of a run that are held out of the fits for validation.
    holdout: HoldoutCriteria {
        /// Shortest block.
        shortest_s: f64 = 0.5 "s", Judgement: "most levels of an input last longer";
        /// Longest block.
        longest_s: f64 = 2.5 "s", Judgement: "longer blocks may hold out a whole level of an input, and then test extrapolation";
        /// Least number of samples in a block, where a log is slow and its length allows it.
        samples: usize = 25 "1", Judgement: "fewer are told by their neighbours; ten samples in a second have them in the longest block";
        /// Blocks that a run is divided into where their length allows.
        blocks: usize = 16 "1", Judgement: "four validation blocks in each run";
        /// One block in this many is held out.
        every: usize = 4 "1", Convention: "a quarter for validation";
    }

    /// Lags of the autocovariances in a standard error, weighted by Bartlett's window.
    window: WindowCriteria {
        /// Lags of a comparison of two losses, in roots of the number of samples.
        advantage_lags: f64 = 1.0 "√samples", Convention: "Diebold and Mariano's test with Newey and West's window";
        /// Most lags of such a comparison.
        advantage_most: usize = 100 "1", Judgement: "one second of common sampling rates";
        /// Lags over which the losses of a model count as dependent, in roots of the number of samples.
        independence_lags: f64 = 2.0 "√samples", Judgement: "losses of a wrong model last longer than differences of two";
        /// Lags of the scores behind a standard error, in roots of the number of samples.
        error_lags: f64 = 1.3 "√samples", Convention: "Newey and West";
        /// Most lags of those.
        error_most: usize = 50 "1", Judgement: "half a second of common sampling rates";
    }

    /// Which candidates get a short fit, and which of these a full one.
    search: SearchCriteria {
        /// Most promising starts of all candidates that get a short fit.
        looks: usize = 40 "1", Judgement: "time: each costs a short fit";
        /// Most starts of one candidate among them.
        looks_each: usize = 2 "1", Judgement: "an effect with many starts must not crowd the others out";
        /// Candidates that get a full fit.
        finalists: usize = 10 "1", Judgement: "time: each costs a full fit or two";
        /// Least number of these, however far behind they are.
        finalists_at_least: usize = 4 "1", Judgement: "a short fit is only roughly right";
        /// Most sets of channels of one effect among these.
        finalists_each: usize = 2 "1", Judgement: "one for all channels together, and one for the best channel";
        /// Candidates beyond this multiple of the least error after a short fit get no full fit. A short fit that cannot come below it is given up.
        behind: f64 = 3.0 "1", Judgement: "a short fit is only roughly right, but no worse than this";
        /// Where a candidate explains the log, no other is tried that explains less than this share of what that one does. Beyond the first few, no full fit is made that promises less of what the best does. Where nothing is missing, none that promises less of what would matter.
        beside: f64 = 0.1 "1", Derived: "half of the least that any of 142 candidates promised which then came within a twentieth of the best; of 474 full fits, the least that one promised which came to 0.7 is 0.28";
        /// A candidate beyond this multiple of the least error is not extended to a larger one.
        worth_growing: f64 = 2.0 "1", Judgement: "a larger one would not make up for that";
        /// Where no candidate comes below this share of the plain error, the plain fit may have gone astray.
        astray: f64 = 0.5 "1", Judgement: "an effect that is missing alone explains more; of two, the larger one does";
        /// A larger candidate with more starts than this does not start from where the smaller one ended.
        grown_starts: usize = 3 "1", Judgement: "time";
        /// A candidate is dropped beyond this multiple of the error of the same effect at another channel.
        elsewhere: f64 = 1.1 "1", Judgement: "chance gives less than a tenth";
        /// Share of its noticeable size below which a fitted effect counts as nothing.
        does_nothing: f64 = 0.01 "1", Judgement: "3 mV of friction or 0.1 ms of delay cannot be measured";
        /// Difference of two directions, as a share of the larger one, below which an effect has no direction.
        alike: f64 = 0.02 "1", Judgement: "two wheels of one make differ by as much, and nobody would call that a direction";
        /// Share of the plain error below which an effect is also tried with separate parameters at each channel.
        worth_dividing: f64 = 0.8 "1", Judgement: "otherwise it stands in for another effect";
        /// Share of the cost below which a regression at measured positions must come.
        promising: f64 = 0.99 "1", Judgement: "one per cent";
        /// Share of the plain cost below which the measured positions alone explain everything.
        told: f64 = 0.1 "1", Judgement: "positions are measured, so they are then no test";
        /// Variances of the noise below which measured positions tell nothing: each sample begins at a reading and ends at one.
        differences: f64 = 2.2 "1", Derived: "the difference of two readings has twice the variance of one; a tenth more may be the plain model's";
        /// Smoothing width of a sign at first, as a share of the flow.
        sign_width: f64 = 0.02 "flow", Judgement: "wide enough for a fit to converge";
        /// Smoothing width of the sharpest sign in a full fit, as a share of the flow.
        sharpest: f64 = 0.004 "flow", Judgement: "sharp enough for stiction to hold a shaft at rest";
        /// The next width, where that is too sharp for the integrator.
        sharp: f64 = 0.01 "flow", Judgement: "half the first width";
        /// Root mean square of what a signal has below zero, over its own, up to which its sensor may give the magnitude only.
        negative: f64 = 0.05 "1", Judgement: "noise about zero";
        /// Time at zero of an input that was not zero before, from which an effect at command zero is tried.
        rests_s: f64 = 0.2 "s", Judgement: "in less a machine hardly slows down";
        /// Share of the range of a position within which it is at its end.
        end: f64 = 0.05 "1", Judgement: "a stop gives a little";
        /// The same within which it is on its way there.
        end_region: f64 = 0.3 "1", Convention: "several times that";
        /// What is beyond its stops on more of its way has no stops.
        end_beyond: f64 = 0.34 "1", Judgement: "rubber that catches an arm takes a third; what stood in for a spring took half";
        /// Share of the time there, or of the times that it came there, which it must be at its end, so that a stop is tried.
        stays_at_end: f64 = 0.25 "1", Judgement: "a motion that passes or turns anywhere is there a sixth of the time";
        /// Share of the time near its end that a single excursion must be on the last quarter of the way, so that a stop is tried.
        cut_off: f64 = 0.75 "1", Derived: "half way between a smooth turn, x = vt - at²/2, which is half the time on the last quarter, and one that is cut off, which is all of it";
        /// Steepest row of a Jacobian over the median one, beyond which a sign is too sharp for the integrator.
        wild: f64 = 1e4 "1", Judgement: "the derivatives are then useless";
        /// A speed of an effect below this many widths of a smoothed sign cannot be told from the smoothing.
        clear_of_sign: f64 = 3.0 "widths", Derived: "tanh(3) is 0.995";
    }

    /// Which explanation comes first, and which cannot be told from it.
    choice: ChoiceCriteria {
        /// Difference of losses below which two explanations are not told apart.
        same: f64 = 2.0 "standard errors", Convention: "95 %";
        /// Ratio of errors below which two explanations are the same in practice.
        close: f64 = 1.01 "1", Judgement: "one per cent of an error does not matter in use";
        /// A simpler explanation may be worse by this share of what the best one leaves above the floor.
        blur: f64 = 0.3 "1", Judgement: "while much is missing, small differences may come from what else is missing";
        /// Ratio of errors up to which a simpler effect takes the place of one that contains it, for each parameter less.
        simpler: f64 = 1.02 "1", Judgement: "one parameter less is worth two per cent";
        /// Ratio of errors beyond which two explanations are never the same, whatever their significance.
        never_same: f64 = 1.5 "1", Judgement: "one transient has too few samples for a test of significance";
    }

    /// Whether an effect is missing.
    missing: MissingCriteria {
        /// By how much an explanation must beat the plain model on the validation data.
        beats: f64 = 3.7 "standard errors", Derived: "a chance of 1e-4 for each of a hundred candidates makes 1 % for all";
        /// How far its parameters must be from no influence.
        significant: f64 = 4.0 "standard errors", Judgement: "as sure as on the validation data, with one more parameter";
        /// With this significance it need only be no worse on the validation data.
        certain: f64 = 5.0 "standard errors", Convention: "five sigma; an effect that shows only in transients has few validation samples";
        /// Largest ratio of its validation error to that of the plain model, where the effect shows in the starts of the runs.
        no_worse: f64 = 1.05 "1", Judgement: "few validation samples show the effect, and chance makes a difference of this size";
        /// How much of the error it must explain to matter, over the floor.
        matters: f64 = 0.2 "floors", Judgement: "less is lost in noise";
        /// Error over the floor below which an explanation is complete.
        complete: f64 = 1.2 "floors", Judgement: "the floor itself is an estimate";
        /// Least share of the standard deviation that it must explain.
        least_share: f64 = 0.004 "1", Judgement: "below it some effect of the library fits every imperfection of a sensor";
        /// What leaves no more than this share of the error need not explain as much, and is named beside something late; what leaves its square need not be a part of the first error of an improvement, nor have a size that the log determines.
        most_left: f64 = 0.5 "1", Judgement: "three quarters of the squared error are no coincidence";
        /// Standard error over the value beyond which the log does not determine a parameter.
        undetermined: f64 = 1.0 "1", Judgement: "not even its sign is known";
        /// The residuals are more than noise if a quantity of the model predicts this share of their square on held-out blocks.
        predicted: f64 = 0.2 "1", Judgement: "twice the most in 60 clean recordings; held-out noise cannot be predicted, and a model is never exactly the machine";
        /// Where the plain model leaves as much as a constant would, an effect must reduce that to this share.
        rescued: f64 = 0.5 "1", Judgement: "it then explains half of the signal";
        /// Error over the floor below which the model explains the log.
        explained: f64 = 1.3 "floors", Judgement: "between complete and above_floor";
        /// Error over the floor above which something must be missing.
        above_floor: f64 = 1.5 "floors", Judgement: "the floor itself is an estimate, and a model is never exactly the machine";
    }

    /// Two effects at once, where none explains the error alone.
    pairs: PairCriteria {
        /// Most effects that are taken for granted, one after the other.
        firsts: usize = 2 "1", Judgement: "each costs as much as the diagnosis";
        /// The same, beside effects that an improvement added.
        later: usize = 1 "1", Judgement: "most of the error is explained by then";
        /// How far the parameters of such an effect must be from no influence.
        significant: f64 = 2.0 "standard errors", Convention: "95 %; the second effect must then be as sure as any";
    }

    /// Which effects stay while effects are added one after the other.
    improve: ImproveCriteria {
        /// Share of the first error that a further effect must explain.
        worth: f64 = 0.04 "1", Judgement: "below it some effect of the library fits every detail of the residuals";
        /// Most effects that are added.
        most: usize = 6 "1", Judgement: "more would fit the log without explaining it";
        /// Ratio of errors below which another effect takes the place of one that it could not be told from.
        better: f64 = 0.9 "1", Judgement: "a smaller gain may come from what else is missing";
        /// While more is missing, an added effect goes if a parameter of an earlier one has this multiple of its standard error with it.
        blurs: f64 = 2.0 "1", Judgement: "three quarters of what the log said of it are gone";
        /// Ratio of errors below which it stays all the same.
        worth_blurring: f64 = 0.7 "1", Judgement: "a third of the error cannot come from trading one effect for another";
        /// The smoothing width of a sign is halved if the ratio of errors is below this.
        sharper: f64 = 0.99 "1", Judgement: "one per cent";
    }

    /// Statements about where a model fails.
    fails: FailsCriteria {
        /// How long after a change of direction an error counts as caused by it.
        after_change_s: f64 = 0.1 "s", Judgement: "friction and backlash act at once";
        /// Share of the error over share of the samples, from which a statement is made.
        telling: f64 = 1.5 "1", Judgement: "half as much again";
        /// Fewest samples of a direction of motion.
        fewest: usize = 10 "1", Convention: "a mean of fewer says little";
        /// Share of the error that the means of the two directions must explain.
        directions: f64 = 0.05 "1", Judgement: "a twentieth is worth mentioning";
        /// Share of the error that a dependence on a quantity must explain.
        depends: f64 = 0.1 "1", Judgement: "a tenth is worth mentioning";
        /// Share of the error in one run, from which a statement is made.
        run: f64 = 0.3 "1", Judgement: "logs often have only a few runs";
        /// Share of a speed's root mean square below which it counts as rest.
        rest: f64 = 0.05 "1", Judgement: "noise around rest is no motion";
    }

    /// Whether a residual force gets an expression, and with which terms.
    force: ForceCriteria {
        /// Excess of the squared innovations over those of noise alone.
        seen: f64 = 5.0 "standard deviations", Convention: "five sigma";
        /// Distance of a coefficient from zero.
        sure: f64 = 3.0 "standard errors", Convention: "three sigma";
        /// Gain of a term on held-out blocks.
        certain: f64 = 4.0 "standard errors", Derived: "there are hundreds of terms to choose from";
        /// Share of the error above the noise that a term must explain.
        worth: f64 = 0.03 "1", Judgement: "an expression with fewer terms is easier to read";
        /// Most terms.
        most: usize = 4 "1", Judgement: "with more it is a table, not a law";
        /// The simplest force that explains this share of the best one is taken.
        as_good: f64 = 0.97 "1", Judgement: "a simpler law is worth three per cent";
        /// Share of the variance from which a dependence is named.
        telling: f64 = 0.05 "1", Judgement: "a twentieth is worth mentioning";
        /// Fewest samples in a bin.
        fewest: usize = 15 "1", Convention: "a mean of fewer says little";
    }

    /// What an experiment promises.
    experiment: ExperimentCriteria {
        /// Distance at which two effects count as separated.
        separated: f64 = 20.0 "standard deviations", Judgement: "four times a single test: the recording must also tell its noise";
        /// Value over standard error at which a parameter counts as determined.
        pinned: f64 = 100.0 "1", Convention: "one per cent";
        /// A plan is still promised if the standard error is this multiple of what is asked for.
        pinned_about: f64 = 1.1 "1", Judgement: "a prediction is no more exact";
        /// Share of an effect's own distance below which a rival counts as the same.
        same: f64 = 0.02 "1", Judgement: "no machine follows its model more exactly";
        /// Root mean square over noise from which a signal counts as moving.
        moves: f64 = 5.0 "1", Convention: "five sigma";
        /// Length beyond which two effects count as inseparable.
        hopeless_s: f64 = 1e5 "s", Judgement: "about a day";
        /// Shortest experiment.
        shortest_s: f64 = 5.0 "s", Judgement: "ramps and pauses need that long";
        /// Longest experiment.
        longest_s: f64 = 600.0 "s", Judgement: "ten minutes: batteries run down";
        /// Eigenvalue of the normalised information below which a combination is not determined.
        flat: f64 = 1e-10 "1", Derived: "rounding errors of a simulation, squared";
        /// Noise of a sensor that declares none, as a share of its signal.
        noise: f64 = 0.01 "1", Judgement: "one per cent where it is not known";
    }
}
