//! The criteria: default, unit, reason.

use serde::{Deserialize, Serialize};

use super::{Criterion, Number, Reason, criteria};

criteria! {
    /// What a recording must have before anything is fitted to it.
    log: LogCriteria {
        /// Shortest time with something moving.
        motion_s: f64 = 2.0 "s", Judgement: "ten time constants of 0.2 s";
        /// Shortest run of which at least one is needed.
        run_s: f64 = 1.0 "s", Judgement: "a shorter free run is mostly its initial state";
        /// A sensor that has something new so many sampling periods apart repeats itself in between.
        repeats_periods: f64 = 1.5 "periods", Derived: "half-way between something new at every sample and at every other";
        /// Share of the inputs in a combination of them, below which the part of the plant that it shows does not show.
        unshown: f64 = 0.1 "1", Derived: "ten volts then leave one for that part: the dry friction of a drivetrain, which hides it";
    }

    /// Whether a model can be simulated from its inputs alone, or needs an observer.
    free_run: FreeRunCriteria {
        /// How many times its own deviation an error of the state may become, in deviations of what is measured.
        growth: f64 = 10.0 "1", Judgement: "an error that large hides every effect";
        /// Growth over the whole horizon beyond which a model counts as unstable and not as integrating.
        exponential: f64 = 3.0 "1", Derived: "about e: one time constant";
        /// Part at the end of a run in which errors must still be large; before, they were a transient.
        late_share: f64 = 0.1 "1", Judgement: "transients are over by then";
        /// Share of the starting instants from which errors must grow.
        starts_share: f64 = 0.5 "1", Judgement: "a majority";
    }

    /// From where a fit begins, and whether it arrived.
    start: StartCriteria {
        /// Share of a signal's deviation that a model is commonly wrong by: what a start is known to is weighed against it.
        wrong: f64 = 0.1 "1", Judgement: "a model worth to be improved leaves about a tenth";
        /// Most that the first sample of a run may count, in samples.
        most: f64 = 100.0 "1", Judgement: "beyond it a start is as good as given";
        /// How late a measurement may be, s: a start is known no better than the signal moves in that time.
        late_s: f64 = 0.15 "s", Judgement: "the latest measurement of a real machine that was seen is 0.135 s late";
        /// Error of a fit above which other starts are tried as well.
        poor: f64 = 0.1 "1", Judgement: "a fit that leaves less has arrived, whatever is missing";
        /// Error above which seeded random starts are among them.
        lost: f64 = 0.3 "1", Judgement: "missing physics leaves seldom more of a fit that arrived";
        /// Ratio of errors below which another start led further.
        further: f64 = 0.98 "1", Judgement: "two per cent: less is another way to the same place";
        /// Error below which a fit without an observer says that none is needed.
        stands: f64 = 0.6 "1", Judgement: "more than half of the signal is followed from its inputs alone";
        /// Error from which nothing was fitted: the model leaves as much as a constant would.
        hopeless: f64 = 1.0 "1", Derived: "the mean of the signal leaves 1";
    }

    /// What is said of a fitted parameter.
    parameters: ParameterCriteria {
        /// Quantile of the intervals.
        quantile: f64 = 0.975 "1", Convention: "two-sided intervals of 95 %";
        /// A change by its scale that moves the weighted outputs by less is no influence: the parameter is dead.
        dead: f64 = 1e-9 "1", Derived: "rounding over a simulation";
        /// Singular value of the column-normalised Jacobian below which a direction is flat.
        flat: f64 = 1e-6 "1", Derived: "the root of the rounding of its square";
        /// Share of a flat direction from which a parameter is part of it.
        part_of_flat: f64 = 0.1 "1", Judgement: "smaller shares are those of rounding and noise";
        /// Distance from the end of its range at which a parameter rests on it, in its scale.
        at_bound: f64 = 1e-4 "1", Judgement: "far below any standard error";
        /// Half an interval over the value from which a parameter is not pinned.
        not_pinned: f64 = 1.0 "1", Convention: "the interval holds zero";
        /// Rows of a Jacobian beyond this multiple of the median row are cut to it.
        steep: f64 = 100.0 "1", Judgement: "only a shaft about to break loose is steeper";
        /// Moving-average coefficient below which residuals are those of rounded counts.
        rounded: f64 = -0.8 "1", Derived: "differenced rounding has -1, and other noise in it brings it nearer to 0";
        /// Autoregressive coefficient up to which they may be so.
        rounded_slow: f64 = 0.3 "1", Judgement: "a slower part is an error of the model";
    }

    /// Samples that no fit sees, and which judge it.
    holdout: HoldoutCriteria {
        /// Shortest block of them.
        shortest_s: f64 = 0.5 "s", Judgement: "shorter than most levels of an input last";
        /// Longest block of them.
        longest_s: f64 = 2.5 "s", Judgement: "of a level that no fit saw, a block says how a model extrapolates";
        /// Blocks that a run is divided into where their length allows.
        blocks: usize = 16 "1", Judgement: "four judging blocks in each run";
        /// Every so many blocks one judges.
        every: usize = 4 "1", Convention: "a quarter for validation";
    }

    /// Autocovariances that are added up to a standard error, weighted by Bartlett's window.
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

    /// Which candidates are looked at, and which are fitted to the end.
    search: SearchCriteria {
        /// Starts of all candidates that promise most and are looked at.
        looks: usize = 36 "1", Judgement: "time: each costs a short fit";
        /// Starts of one candidate among them.
        looks_each: usize = 2 "1", Judgement: "an effect with many starts must not crowd the others out";
        /// Candidates that are fitted to the end.
        finalists: usize = 9 "1", Judgement: "time: each costs a full fit or two";
        /// Finalists that there are in any case, however far behind.
        finalists_at_least: usize = 4 "1", Judgement: "a first look is a rough one";
        /// Channels of one effect among the finalists.
        finalists_each: usize = 2 "1", Judgement: "all channels alike and the best one";
        /// Error over the best at a first look, beyond which a candidate is no finalist.
        behind: f64 = 3.0 "1", Judgement: "a first look is rough, but not as rough";
        /// Error over the least, beyond which a candidate is not made larger.
        worth_growing: f64 = 2.0 "1", Judgement: "what it leaves is not what a larger one adds";
        /// Starts of a larger candidate, beyond which it is not started from where the smaller one ended.
        grown_starts: usize = 3 "1", Judgement: "time";
        /// Error over that of the same effect at another channel, beyond which it is there and not here.
        elsewhere: f64 = 1.1 "1", Judgement: "a tenth is more than chance gives";
        /// Share of its noticeable size below which an effect that was fitted does nothing.
        does_nothing: f64 = 0.01 "1", Judgement: "3 mV of friction, 0.1 ms of delay: nobody can measure it";
        /// Share of the plain error below which an effect is also tried with parameters of its own at each channel.
        worth_dividing: f64 = 0.8 "1", Judgement: "less was another effect's";
        /// Share of the cost that a regression at measured positions must promise to go below.
        promising: f64 = 0.99 "1", Judgement: "one per cent";
        /// Share of the plain cost below which measured positions explain everything already.
        told: f64 = 0.1 "1", Judgement: "the position is what is measured";
        /// Width over which a sign is smoothed at first, as a share of the flow.
        sign_width: f64 = 0.02 "flow", Judgement: "wide enough for a fit to find its way";
        /// The sharpest width of a final fit, as a share of the flow.
        sharpest: f64 = 0.004 "flow", Judgement: "what sticks, sticks";
        /// The next one, where that is too sharp for the integrator.
        sharp: f64 = 0.01 "flow", Judgement: "half the first width";
        /// Steepest row of a Jacobian over the median one, beyond which a sign is too sharp for the integrator.
        wild: f64 = 1e4 "1", Judgement: "derivatives run away beyond it";
        /// A speed of an effect below so many widths of a smoothed sign is none of its own.
        clear_of_sign: f64 = 3.0 "widths", Derived: "tanh(3) is 0.995";
    }

    /// Which explanation comes first, and what cannot be told from it.
    choice: ChoiceCriteria {
        /// Difference of losses below which two explanations are not told apart.
        same: f64 = 2.0 "standard errors", Convention: "95 %";
        /// Ratio of errors below which they are the same for all that can be done with them.
        close: f64 = 1.01 "1", Judgement: "one per cent of an error is nobody's concern";
        /// Share of what the best leaves above the floor by which a simpler explanation may be worse.
        blur: f64 = 0.3 "1", Judgement: "while much is missing, small differences are those of what else is missing";
        /// Ratio of errors beyond which two explanations are never the same, whatever the statistics.
        never_same: f64 = 1.5 "1", Judgement: "in one transient statistics have little to go by";
    }

    /// Whether an effect is missing.
    missing: MissingCriteria {
        /// By how much an explanation must beat the plain model on data that neither saw.
        beats: f64 = 3.7 "standard errors", Derived: "a chance of 1e-4 for each of a hundred candidates is one of 1 % for all";
        /// How far it must be from doing nothing.
        significant: f64 = 4.0 "standard errors", Judgement: "as sure as on unseen data, with one more parameter";
        /// With so much significance it need only be no worse on unseen data.
        certain: f64 = 5.0 "standard errors", Convention: "five sigma: an effect that shows in transients alone leaves few samples to judge by";
        /// Unseen error over that of the plain model up to which an effect that shows in the starts of the runs is accepted.
        no_worse: f64 = 1.05 "1", Judgement: "what is judged holds few samples of what the effect does, and the chance of as many";
        /// What it explains, over the floor, to matter.
        matters: f64 = 0.2 "floors", Judgement: "less is lost in the noise of any use";
        /// Error over the floor below which an explanation explains everything.
        complete: f64 = 1.2 "floors", Judgement: "the floor itself is an estimate";
        /// Least share of the standard deviation that it must explain.
        least_share: f64 = 0.004 "1", Judgement: "below it a library finds something for every imperfection of a sensor";
        /// Standard error over the value beyond which the log says nothing of a parameter.
        undetermined: f64 = 1.0 "1", Judgement: "not even its sign is known";
        /// Share of the squared error that a quantity of the model predicts on blocks that did not choose it, beyond which it is no noise.
        predicted: f64 = 0.1 "1", Judgement: "of noise a quantity predicts less than nothing, and a model is never quite the machine";
        /// Share of what a constant leaves, to which an effect must bring a model that leaves as much, to be believed.
        rescued: f64 = 0.5 "1", Judgement: "half of the signal is followed then";
        /// Error over the floor below which a log explains itself.
        explained: f64 = 1.3 "floors", Judgement: "between complete and above_floor";
        /// Error over the floor above which something must be missing.
        above_floor: f64 = 1.5 "floors", Judgement: "the floor itself is an estimate, and a model is never quite the machine";
    }

    /// What is kept while effects are added one after the other.
    improve: ImproveCriteria {
        /// Share of the first error that a further effect must explain.
        worth: f64 = 0.04 "1", Judgement: "beyond it a library finds something for every wiggle";
        /// Most effects that are added.
        most: usize = 6 "1", Judgement: "beyond it a library fits and does not explain";
        /// Ratio of errors up to which a simpler effect takes the place of one that contains it.
        simpler: f64 = 1.02 "1", Judgement: "two per cent are worth a parameter less";
        /// Ratio of errors below which another effect takes the place of one that it could not be told from.
        better: f64 = 0.9 "1", Judgement: "less may be what else is missing";
        /// Ratio of errors below which a sign is smoothed over half the width.
        sharper: f64 = 0.99 "1", Judgement: "one per cent";
    }

    /// What is said of where a model fails.
    fails: FailsCriteria {
        /// How long after a change of direction its effect is looked for.
        after_change_s: f64 = 0.1 "s", Judgement: "what acts on a change of direction acts at once";
        /// Share of the error over share of the samples from which a statement is made.
        telling: f64 = 1.5 "1", Judgement: "half as much again";
        /// Fewest samples of a direction of motion.
        fewest: usize = 10 "1", Convention: "a mean of fewer says little";
        /// Share of the error that the means of the two directions must explain.
        directions: f64 = 0.05 "1", Judgement: "a twentieth is worth a sentence";
        /// Share of the error that a dependence on a quantity must explain.
        depends: f64 = 0.1 "1", Judgement: "a tenth is worth a sentence";
        /// Share of the error that lies in one run.
        run: f64 = 0.3 "1", Judgement: "of a few runs";
        /// Share of a speed's root mean square below which it counts as rest.
        rest: f64 = 0.05 "1", Judgement: "noise around rest is no motion";
    }

    /// Whether a residual force is written down, and of which terms it is made.
    force: ForceCriteria {
        /// Squares of the innovations over those of noise alone.
        seen: f64 = 5.0 "standard deviations", Convention: "five sigma";
        /// Distance of a coefficient from zero.
        sure: f64 = 3.0 "standard errors", Convention: "three sigma";
        /// Gain of a term on blocks that it was not fitted to.
        certain: f64 = 4.0 "standard errors", Derived: "there are hundreds of terms to choose from";
        /// Share that a term must explain of what noise does not.
        worth: f64 = 0.03 "1", Judgement: "fewer terms are read more easily";
        /// Most terms.
        most: usize = 4 "1", Judgement: "more is a table, not a law";
        /// Share of the best beyond which the simplest is taken.
        as_good: f64 = 0.97 "1", Judgement: "three per cent are worth a simpler law";
        /// Share of the variance from which a dependence is named.
        telling: f64 = 0.05 "1", Judgement: "a twentieth is worth a word";
        /// Fewest samples of a bin.
        fewest: usize = 15 "1", Convention: "a mean of fewer says little";
    }

    /// What an experiment promises.
    experiment: ExperimentCriteria {
        /// Distance of two effects at which they count as separated.
        separated: f64 = 20.0 "standard deviations", Judgement: "four times a single test: a recording must also say what the noise is";
        /// Value over standard error at which a parameter counts as pinned.
        pinned: f64 = 100.0 "1", Convention: "one per cent";
        /// Excess over that up to which a plan still promises it.
        pinned_about: f64 = 1.1 "1", Judgement: "a prediction is no better than that";
        /// Share of an effect's own distance below which a rival is the same.
        same: f64 = 0.02 "1", Judgement: "no robot is its model to that precision";
        /// Root mean square over noise from which a signal moves.
        moves: f64 = 5.0 "1", Convention: "five sigma";
        /// Length beyond which nothing is separated.
        hopeless_s: f64 = 1e5 "s", Judgement: "a day";
        /// Shortest experiment.
        shortest_s: f64 = 5.0 "s", Judgement: "ramps and rests take as long";
        /// Longest experiment.
        longest_s: f64 = 600.0 "s", Judgement: "ten minutes: batteries and patience";
        /// Eigenvalue of the normalised information below which a combination is not determined.
        flat: f64 = 1e-10 "1", Derived: "rounding over a simulation, squared";
        /// Noise of a sensor that says nothing of it, as a share of its signal.
        noise: f64 = 0.01 "1", Judgement: "one per cent where nothing is known";
    }
}
