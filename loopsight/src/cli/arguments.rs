//! What can be typed.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

/// Adaptive control you can see into.
#[derive(Debug, Parser)]
#[command(
    name = "loopsight",
    version,
    about = "Adaptive control you can see into: compose a control loop from TOML, compare its model with measurements, fit it, run it.",
    after_help = "Exit status: 0 done, 1 the work failed, 2 the request or a file is wrong.",
    propagate_version = true
)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Make a folder of files for a robot, or a crate with parts of your own.
    New(NewArguments),
    /// Check model, loop and experiment files, and logs.
    Check(CheckArguments),
    /// Show what is in a log of any program, and write a model file for it.
    Inspect(InspectArguments),
    /// Write the signals that a model has in a log, in SI units, as CSV, MCAP or Parquet.
    Convert(ConvertArguments),
    /// List the known plants, effects, estimators, controllers and drivers.
    List(ListArguments),
    /// Explain a plant, an effect or another part: equation, parameters, example.
    Explain(ExplainArguments),
    /// Drive a simulated robot with an experiment and write its log.
    Simulate(SimulateArguments),
    /// Compare a model with a log: free run and one-step prediction.
    Compare(CompareArguments),
    /// Find the parameters of a model from a log, with intervals.
    Fit(FitArguments),
    /// Find out which physical effect a model lacks.
    Diagnose(DiagnoseArguments),
    /// Plan the experiment that separates two effects or pins a parameter.
    Experiment(ExperimentArguments),
    /// Add an effect to a model file, with neutral parameters.
    Add(AddArguments),
    /// Add what a diagnosis finds and refit, until nothing more is missing.
    Improve(ImproveArguments),
    /// Check step by step, wheels in the air, that a robot is wired as the files say.
    Bringup(BringupArguments),
    /// Run a control loop.
    Run(RunArguments),
    /// Send the model, effects and law of a loop file to a robot, waiting or driving.
    Send(SendArguments),
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

#[derive(Debug, Args)]
#[command(group(clap::ArgGroup::new("kind").required(true).args(["plant", "rust"])))]
pub(crate) struct NewArguments {
    /// The folder to make; it must not exist yet.
    pub(crate) folder: PathBuf,
    /// Files for a robot of this plant: model, experiment, loop; `loopsight list plants` shows them.
    #[arg(long, value_name = "PLANT")]
    pub(crate) plant: Option<String>,
    /// A Rust crate with a plant and an effect of its own, and a command that has them.
    #[arg(long)]
    pub(crate) rust: bool,
    /// The checkout of loopsight that the crate is built with; by default the one that this command
    /// was built from.
    #[arg(long, value_name = "PATH", conflicts_with = "plant")]
    pub(crate) loopsight: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct CheckArguments {
    /// Model, loop or experiment files (TOML), or logs (CSV, SysId JSON).
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct InspectArguments {
    /// The log: CSV, SysId JSON, WPILOG, ULog, MCAP, the folder of a ROS 2 bag, MATLAB, NumPy, …; `-`: standard
    /// input.
    #[arg(value_name = "LOG")]
    pub(crate) log: PathBuf,
    /// Write a model file for it.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// The plant; by default the one that fits the channels best.
    #[arg(long, value_name = "PLANT")]
    pub(crate) plant: Option<String>,
    /// The channel of an input; without ID that of the first one.
    #[arg(long = "input", value_name = "[ID=]CHANNEL")]
    pub(crate) inputs: Vec<String>,
    /// The channel of a measured signal; without ID that of the first state.
    #[arg(long = "measure", value_name = "[ID=]CHANNEL")]
    pub(crate) measured: Vec<String>,
    /// The unit of a channel, of the time as well, where the log does not say it: `u=V`, `t=ms`.
    #[arg(long = "unit", value_name = "CHANNEL=UNIT")]
    pub(crate) units: Vec<String>,
    /// Time from one row to the next, s, of a log without time stamps.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) period: Option<f64>,
    /// Write a page with a small picture of each channel (HTML).
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(override_usage = "loopsight convert [OPTIONS] [MODEL] <LOG> --output <FILE>")]
pub(crate) struct ConvertArguments {
    /// Model file and log; without a model file the channels get the meaning that `inspect` finds.
    #[arg(required = true, num_args = 1..=2, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// The file to write: CSV, MCAP or Parquet, as its name ends in `.csv`, `.mcap` or `.parquet`.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: PathBuf,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct ListArguments {
    /// Only these: plants, effects, estimators, controllers or drivers.
    #[arg(value_enum)]
    pub(crate) role: Option<RoleName>,
    /// Only the effects that fit this plant, each with the channels it can act on.
    #[arg(long = "for", value_name = "PLANT")]
    pub(crate) plant: Option<String>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum RoleName {
    Plants,
    Effects,
    Estimators,
    Controllers,
    Drivers,
}

#[derive(Debug, Args)]
pub(crate) struct ExplainArguments {
    /// Id of a plant, effect, estimator, controller or driver; or `log`, `fit`, `simulation` for that table of
    /// a model file.
    pub(crate) id: String,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct SimulateArguments {
    /// Model file of the robot.
    pub(crate) model: PathBuf,
    /// Experiment file: inputs, duration, period, sensors' noise.
    pub(crate) experiment: PathBuf,
    /// The log to write (CSV).
    #[arg(short, long, value_name = "LOG")]
    pub(crate) output: PathBuf,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(override_usage = "loopsight compare [OPTIONS] [MODEL] <LOG>")]
pub(crate) struct CompareArguments {
    /// Model file and log; a log that describes itself (SysId JSON) needs no model file.
    #[arg(required = true, num_args = 1..=2, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Leave this run of the log out, by its name; may be given again.
    #[arg(long, value_name = "RUN")]
    pub(crate) without: Vec<String>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// With --json, the series too: time, measured, model and residual of each run and signal.
    #[arg(long, requires = "json")]
    pub(crate) series: bool,
    /// Write a page with pictures; opens offline in any browser.
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(override_usage = "loopsight fit [OPTIONS] [MODEL] <LOG>")]
pub(crate) struct FitArguments {
    /// Model file and log; a log that describes itself (SysId JSON) needs no model file.
    #[arg(required = true, num_args = 1..=2, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Another recording of the same machine to fit to, beside LOG; may be given again.
    #[arg(long, value_name = "LOG3")]
    pub(crate) also: Vec<PathBuf>,
    /// Leave this run of the log out, by its name; may be given again.
    #[arg(long, value_name = "RUN")]
    pub(crate) without: Vec<String>,
    /// Validate the fitted model on this log, which it is not fitted to.
    #[arg(long, value_name = "LOG2")]
    pub(crate) test: Option<PathBuf>,
    /// How the parameters are found.
    #[arg(long, value_enum, default_value_t = MethodName::OutputError)]
    pub(crate) method: MethodName,
    /// The regression for recursive least squares.
    #[arg(long, value_enum, default_value_t = SchemeName::Integrated)]
    pub(crate) regression: SchemeName,
    /// Write the fitted model here: the model file with its comments, the values replaced.
    #[arg(short, long, value_name = "FITTED")]
    pub(crate) output: Option<PathBuf>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// With --json, the series too: time, measured, model and residual of each run and signal.
    #[arg(long, requires = "json")]
    pub(crate) series: bool,
    /// Write a page with pictures; opens offline in any browser.
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum MethodName {
    /// Recursive least squares, the paper's way.
    Rls,
    /// Least squares on the error of the free run.
    OutputError,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum SchemeName {
    /// Euler's, the paper's (40)(41): biased on a continuous robot.
    Euler,
    /// Integrated over the sampling period.
    Integrated,
}

#[derive(Debug, Args)]
#[command(override_usage = "loopsight diagnose [OPTIONS] [MODEL] <LOG>")]
pub(crate) struct DiagnoseArguments {
    /// Model file and log; a log that describes itself (SysId JSON) needs no model file.
    #[arg(required = true, num_args = 1..=2, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Another recording of the same machine to fit to, beside LOG; may be given again.
    #[arg(long, value_name = "LOG3")]
    pub(crate) also: Vec<PathBuf>,
    /// Leave this run of the log out, by its name; may be given again.
    #[arg(long, value_name = "RUN")]
    pub(crate) without: Vec<String>,
    /// Validate on this log; without it, on parts of LOG that are held out of the fits.
    #[arg(long, value_name = "LOG2")]
    pub(crate) test: Option<PathBuf>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// With --json, the series too: time, measured, model and residual of each run and signal.
    #[arg(long, requires = "json")]
    pub(crate) series: bool,
    /// Write a page with pictures; opens offline in any browser.
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct ExperimentArguments {
    /// Model file, with values: the experiment is planned around them.
    pub(crate) model: PathBuf,
    /// Two effects to tell apart, each as `EFFECT` or `EFFECT@CHANNEL+CHANNEL`; `nothing` as the
    /// second asks whether the first is there at all.
    #[arg(long, num_args = 2, value_names = ["EFFECT_A", "EFFECT_B"])]
    pub(crate) separate: Vec<String>,
    /// A parameter to find to 1 %, by its name in the model; without it and without --separate,
    /// all parameters that a fit estimates.
    #[arg(long, value_name = "PARAMETER", conflicts_with = "separate")]
    pub(crate) pin: Option<String>,
    /// Length of the experiment; by default as long as the question needs, 5 s to 600 s.
    #[arg(long, value_name = "SECONDS")]
    pub(crate) duration: Option<f64>,
    /// Largest magnitude of every input, in its SI unit; by default 9, or the limit of an
    /// `input_saturation` of the model where that is less.
    #[arg(long, value_name = "VOLTS")]
    pub(crate) limit: Option<f64>,
    /// Sampling period of the robot's log.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.01)]
    pub(crate) period: f64,
    /// The input sequence to write (CSV); a key `inputs_from` of an experiment file replays it.
    #[arg(short, long, value_name = "PLAN")]
    pub(crate) output: PathBuf,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct AddArguments {
    /// Model file.
    pub(crate) model: PathBuf,
    /// Id of the effect; `loopsight list effects` shows them.
    pub(crate) effect: String,
    /// Channels it acts on; by default all of the first kind it fits.
    #[arg(long, value_name = "CHANNEL", num_args = 1..)]
    pub(crate) at: Vec<String>,
    /// The model file to write.
    #[arg(short, long, value_name = "NEW")]
    pub(crate) output: PathBuf,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
#[command(override_usage = "loopsight improve [OPTIONS] [MODEL] <LOG>")]
pub(crate) struct ImproveArguments {
    /// Model file and log; a log that describes itself (SysId JSON) needs no model file.
    #[arg(required = true, num_args = 1..=2, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Another recording of the same machine to fit to, beside LOG; may be given again.
    #[arg(long, value_name = "LOG3")]
    pub(crate) also: Vec<PathBuf>,
    /// Leave this run of the log out, by its name; may be given again.
    #[arg(long, value_name = "RUN")]
    pub(crate) without: Vec<String>,
    /// Validate on this log; without it, on parts of LOG that are held out of the fits.
    #[arg(long, value_name = "LOG2")]
    pub(crate) test: Option<PathBuf>,
    /// Say the error of the best model on this log, too, which neither a fit nor the choice among effects sees.
    #[arg(long, value_name = "LOG4")]
    pub(crate) report: Option<PathBuf>,
    /// Where no effect of the library explains the rest, add an expression for the missing force, fit it and go on.
    #[arg(long)]
    pub(crate) discover: bool,
    /// Write the best model here: the model file with the effects added and all values fitted.
    #[arg(short, long, value_name = "BEST")]
    pub(crate) output: Option<PathBuf>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// With --json, the series too: time, measured, model and residual of each run and signal.
    #[arg(long, requires = "json")]
    pub(crate) series: bool,
    /// Write a page with pictures; opens offline in any browser.
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct RunArguments {
    /// Loop file.
    #[arg(value_name = "LOOP")]
    pub(crate) file: PathBuf,
    /// The log to write, MCAP where its name ends in `.mcap`, else CSV; by default what the loop file
    /// says.
    #[arg(short, long, value_name = "LOG")]
    pub(crate) output: Option<PathBuf>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
    /// With --json, the series too: time, references, signals, inputs and parameters, tick by tick.
    #[arg(long, requires = "json")]
    pub(crate) series: bool,
    /// Write a page with pictures; opens offline in any browser.
    #[arg(long, value_name = "FILE")]
    pub(crate) html: Option<PathBuf>,
    /// Write a picture (SVG) for a document.
    #[arg(long, value_name = "FILE")]
    pub(crate) svg: Option<PathBuf>,
}

#[derive(Debug, Args)]
pub(crate) struct SendArguments {
    /// Loop file, its law in [controller.aboard].
    #[arg(value_name = "LOOP")]
    pub(crate) file: PathBuf,
    /// Serial port or unix socket of the robot, or the `door` of a run; by default what the loop file says,
    /// its `door` first.
    #[arg(long, value_name = "LINE")]
    pub(crate) line: Option<String>,
    /// JSON on standard output.
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct BringupArguments {
    /// Loop file; its [limits] must give a maximum for each input.
    #[arg(value_name = "LOOP")]
    pub(crate) file: PathBuf,
    /// Input of the first motions, in the unit of the inputs; by default a quarter of the smallest
    /// limit.
    #[arg(long, value_name = "VOLTS")]
    pub(crate) volts: Option<f64>,
    /// How long a motor is driven at a time.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.6)]
    pub(crate) seconds: f64,
}
