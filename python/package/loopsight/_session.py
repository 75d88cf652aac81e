"""A model and the logs of one machine."""

from __future__ import annotations

from os import PathLike, fspath
from typing import Any

from . import _engine
from ._error import Error
from ._log import Log
from ._model import Model
from ._progress import Early, Progress, hearing, reporting
from ._results import Comparison, Diagnosis, Fit, Improvement, Result, Run

#: A model, the path of a model file, or ``None`` for a log that describes itself (SysId).
ModelLike = Model | str | PathLike[str] | None
#: A log, the path of one, or a frame.
LogLike = Any


def model_of(model: ModelLike) -> Model | None:
    if model is None or isinstance(model, Model):
        return model
    return Model.from_file(model)


def log_of(log: LogLike) -> Log:
    if isinstance(log, Log):
        return log
    if isinstance(log, (str, PathLike)):
        return Log.read(log)
    return Log.from_frame(log)


class Session:
    """A model and the logs of one machine, and what can be done with them.

    Parameters
    ----------
    model : Model or path or None
        The model; ``None`` where the log describes its machine itself (SysId JSON).
    log : Log or path or frame, optional
        What was applied and measured. A frame is read by `Log.from_frame`.
    also : list of logs
        Further logs of the same machine to fit to.
    test : log, optional
        A log of the same machine for validation: nothing is fitted to it.
    report : log, optional
        A log of the same machine that neither a fit nor a choice sees: `improve` says the error there.

    Raises
    ------
    Error
        A column that the model needs is missing, has another unit, or no usable value.

    Examples
    --------
    >>> import loopsight as ls
    >>> found = ls.Session("model.toml", "log.csv").diagnose()      # doctest: +SKIP
    >>> print(found)                                                # doctest: +SKIP
    """

    def __init__(
        self,
        model: ModelLike,
        log: LogLike | None = None,
        *,
        also: LogLike | list[LogLike] = (),
        test: LogLike | None = None,
        report: LogLike | None = None,
    ) -> None:
        more = list(also) if isinstance(also, (list, tuple)) else [also]
        read_model = model_of(model)
        read_log = None if log is None else log_of(log)
        self._engine = _engine.Session(
            None if read_model is None else read_model._engine,
            None if read_log is None else read_log._engine,
            [log_of(one)._engine for one in more],
            None if test is None else log_of(test)._engine,
            None if report is None else log_of(report)._engine,
        )
        self._about = ", ".join(_text(one) for one in (model, log) if one is not None)

    @property
    def model(self) -> Model:
        """The model."""
        return Model(self._engine.model)

    @property
    def faults(self) -> list[tuple[str, str]]:
        """What is wrong with the logs, the worst first: how much it matters, and what was seen."""
        return self._engine.faults()

    def _call(self, name: str) -> str:
        return f"loopsight.{name}({self._about})"

    def compare(self, *, series: bool = False, progress: Progress = False) -> Comparison:
        """How far is the model from the machine, and where does it fail? Free run and one-step prediction.

        Parameters
        ----------
        series : bool
            Whether the JSON has the series of numbers, too. `SeriesResult.series` has them in any case.
        progress : bool or callable
            ``True`` shows a bar (tqdm); a callable gets stage, done and total. Ctrl-C ends the work at once.
        """
        with reporting(progress) as report:
            return Comparison(self._engine.compare(series, report), self._call("compare"))

    def fit(
        self,
        *,
        method: str = "output-error",
        regression: str | None = None,
        max_iterations: int | None = None,
        series: bool = False,
        progress: Progress = False,
    ) -> Fit:
        """The parameters of the model, with intervals of 95 % and what the data do not determine.

        Parameters
        ----------
        method : {"output-error", "rls"}
            Least squares on the error of the free run, or recursive least squares on a regression.
        regression : {"integrated", "euler"}, optional
            The regression that recursive least squares is fed with.
        max_iterations : int, optional
            Most iterations of ``output-error``: 100 by default.
        series, progress
            As for `compare`.
        """
        with reporting(progress) as report:
            answer = self._engine.fit(method, regression, max_iterations, series, report)
        return Fit(answer, self._call("fit"))

    def diagnose(self, *, series: bool = False, progress: Progress = False, early: Early = None) -> Diagnosis:
        """Which effect is missing? Every effect of the library is tried at every channel, and judged on
        validation data. ``early`` is called with each result that is known before the end. Other arguments as for
        `compare`."""
        with reporting(progress) as report:
            return Diagnosis(self._engine.diagnose(series, report, hearing(early)), self._call("diagnose"))

    def improve(
        self, *, discover: bool = False, series: bool = False, progress: Progress = False, early: Early = None
    ) -> Improvement:
        """Adds what is missing and refits, until nothing more is. `Result.model` is the model that came of
        it. With ``discover`` an expression for the missing force is added where no effect of the library explains
        the rest. Other arguments as for `diagnose`."""
        with reporting(progress) as report:
            return Improvement(self._engine.improve(discover, series, report, hearing(early)), self._call("improve"))

    def experiment(
        self,
        *,
        pin: str | None = None,
        separate: tuple[str, str] | None = None,
        is_there: str | None = None,
        limit: float | None = None,
        period_s: float = 0.01,
        duration_s: float | None = None,
        progress: Progress = False,
    ) -> Result:
        """Plans the inputs that tell what a log could not. `Result.log` has them over time.

        Parameters
        ----------
        pin : str, optional
            The parameter to find to 1 %, by its name in the model.
        separate : pair of str, optional
            Which of two effects is it? Each as ``effect`` or ``effect@channel``.
        is_there : str, optional
            Is this effect there at all?
        limit : float, optional
            Largest magnitude of every input, in its SI unit.
        period_s : float
            Sampling period of the robot's log, s.
        duration_s : float, optional
            Length of the experiment, s; by default as long as the question needs.
        progress
            As for `compare`.
        """
        with reporting(progress) as report:
            answer = self._engine.experiment(
                pin, separate, is_there, limit, period_s, duration_s, report
            )
        return Result(answer, self._call("experiment"))

    def simulate(
        self, experiment: str | PathLike[str] | None = None, *, toml: str | None = None
    ) -> Result:
        """Drives a simulated robot, which is the model. `Result.log` is its log.

        Parameters
        ----------
        experiment : path, optional
            The experiment file: what the robot is driven with and how it is measured.
        toml : str, optional
            The text of one, in place of a file.
        """
        if (experiment is None) == (toml is None):
            raise Error("an experiment is a file, or a text given as `toml=`")
        return Result(self._engine.simulate(experiment, toml), self._call("simulate"))


def _text(one: Any) -> str:
    if isinstance(one, (Model, Log)):
        return one.name
    return repr(fspath(one)) if isinstance(one, (str, PathLike)) else type(one).__name__


def compare(model: ModelLike, log: LogLike | None = None, **options: Any) -> Comparison:
    """How far is the model from the machine? As ``Session(model, log).compare()``.

    The options ``also`` and ``test`` go to `Session`, all others to `Session.compare`.
    """
    session, options = _session(model, log, options)
    return session.compare(**options)


def fit(model: ModelLike, log: LogLike | None = None, **options: Any) -> Fit:
    """The parameters of a model, found from a log. As ``Session(model, log).fit()``.

    The options ``also`` and ``test`` go to `Session`, all others to `Session.fit`.
    """
    session, options = _session(model, log, options)
    return session.fit(**options)


def diagnose(model: ModelLike, log: LogLike | None = None, **options: Any) -> Diagnosis:
    """Which effect does the model lack? As ``Session(model, log).diagnose()``.

    The options ``also`` and ``test`` go to `Session`, all others to `Session.diagnose`.
    """
    session, options = _session(model, log, options)
    return session.diagnose(**options)


def improve(model: ModelLike, log: LogLike | None = None, **options: Any) -> Improvement:
    """The model with what was missing. As ``Session(model, log).improve()``.

    The options ``also``, ``test`` and ``report`` go to `Session`, all others to `Session.improve`.
    """
    session, options = _session(model, log, options)
    return session.improve(**options)


def experiment(model: ModelLike, **options: Any) -> Result:
    """Plans the inputs that tell what a log could not. As ``Session(model).experiment()``."""
    return Session(model).experiment(**options)


def simulate(
    model: ModelLike, experiment: str | PathLike[str] | None = None, *, toml: str | None = None
) -> Result:
    """The log of a simulated robot. As ``Session(model).simulate()``."""
    return Session(model).simulate(experiment, toml=toml)


def run(
    loop: str | PathLike[str],
    *,
    log: str | PathLike[str] | bool = True,
    series: bool = False,
) -> Run:
    """Runs a control loop from its file. Ctrl-C stops it and releases the robot.

    Parameters
    ----------
    loop : path
        The loop file.
    log : path or bool
        Where the log goes: ``True``: where the loop file says; ``False``: nowhere.
    series : bool
        Whether the answer has the series of numbers, tick by tick.
    """
    path = None if isinstance(log, bool) else log
    answer = _engine.run(loop, path, log is False, series)
    return Run(answer, f"loopsight.run({fspath(loop)!r})")


def inspect(
    log: LogLike,
    *,
    plant: str | None = None,
    inputs: list[str] = [],
    outputs: list[str] = [],
    period_s: float | None = None,
) -> Result:
    """What is in a log, which plants could fit it, and the model file that would read it.

    Parameters
    ----------
    log : Log or path or frame
        The log.
    plant : str, optional
        Id of the plant to map the log on.
    inputs, outputs : list of str
        The channels that are inputs of the machine, and those that were measured.
    period_s : float, optional
        Time between samples of a log that has no time stamps, s.
    """
    answer = _engine.inspect(log_of(log)._engine, plant, list(inputs), list(outputs), period_s)
    return Result(answer, "")


def _session(model: ModelLike, log: LogLike | None, options: dict[str, Any]) -> tuple[Session, dict[str, Any]]:
    """The session of a call. One argument that is no model file is a log that describes itself."""
    rest = dict(options)
    also, test, report = rest.pop("also", ()), rest.pop("test", None), rest.pop("report", None)
    if log is None and not isinstance(model, Model) and not str(model).endswith(".toml"):
        model, log = None, model
    return Session(model, log, also=also, test=test, report=report), rest
