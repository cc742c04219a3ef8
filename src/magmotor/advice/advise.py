"""`advise`: which integrator and timestep of MuJoCo reach an error at the least cost."""

import math
import time
from collections.abc import Collection
from functools import partial
from typing import Annotated

import mujoco
from tqdm import tqdm

from magmotor.advice.advice import Advice
from magmotor.advice.choice import Choice
from magmotor.advice.measure import Measurement
from magmotor.advice.measured_quantities import POSITIONS, Function, read_quantity
from magmotor.advice.paths import INTEGRATORS, OutOfTime, Runs
from magmotor.advice.points import reaching
from magmotor.advice.recommendation import percent
from magmotor.advice.statistics_errors import certain
from magmotor.advice.survey import Survey
from magmotor.advice.thermal import Thermal
from magmotor.common import style
from magmotor.common.arguments import checked
from magmotor.common.exceptions import ArgumentError
from magmotor.common.hints import Picture, fraction, number
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations.marks import UNMARKED
from magmotor.mjcf.describe import describe, elsewhere
from magmotor.mjcf.magnetism import is_open
from magmotor.mjcf.unit_system import own_units

LEAST, USUAL, MOST = 48, 1.0, 10**8
"""Smallest duration in timesteps of the model, the usual one in s, and the largest in timesteps."""


@checked
def advise(  # noqa: PLR0913 (options)
    model: mujoco.MjModel,
    data: mujoco.MjData | None = None,
    *,
    quantity: str | Function = POSITIONS,
    duration: Annotated[float, number(above=0)] | None = None,
    error: Annotated[float, fraction(at_least=1e-8, below=0.5)] = 0.01,
    every_element: bool = True,
    budget: Annotated[float, number(at_least=1)] = 60.0,
    detail: bool = False,
    kT: Annotated[float, number(above=0)] | None = None,
    picture: Picture | None = None,
) -> Advice:
    """Measure which integrator and timestep of MuJoCo reach an error of a model at the least cost.

    The model runs from one state with every integrator, at the model's timestep and at longer and
    shorter ones. Errors are those of a quantity along the path, of the whole and of each element
    over its own range, against a reference that proves itself by halving its timestep. Costs are
    measured in interleaved rounds.
    Magnetism acts if the model has the plugin, or inside a block of `magnetism`.

    Parameters
    ----------
    model : mujoco.MjModel
        It is copied, and not changed.
    data : mujoco.MjData, optional
        The initial state, with its controls and applied forces, which stay constant unless a
        callback changes them; by default that of the model.
    quantity : str or callable
        What must be accurate: "positions" of all matter (distances are root mean squares over the
        mass), "energy", or an element: "body NAME", "site NAME", "joint NAME", "tendon NAME" or
        "sensor NAME"; or a function of a model and its data, after `mj_forward`, that returns
        numbers.
    duration : float, optional
        Duration of the paths in s, at least 48 timesteps of the model; by default 1 s, or 48
        timesteps if that is longer. It is rounded to a multiple of the interval between records.
    error : float
        Admissible error, relative to the range of the quantity or, of the energy, to the largest
        kinetic energy if that is larger.
    every_element : bool
        Whether the error of each element must be admissible, relative to its own range, or only
        that of the whole. The elements of "positions" are the angle or coordinate of each joint,
        and x, y, z and the three axes of what moves or turns freely; those of other quantities are
        their components. Both errors are reported.
    budget : float
        Wall time in s that the measurement may take, approximately.
    detail : bool
        Whether to switch MuJoCo's features off one by one, too: what each costs, what it changes,
        and what can go, alone and all of it together, so that the promised error and these changes
        add up to the error asked for at most.
    kT : float, optional
        Temperature in J. Then the splittings of `Langevin` are compared, by the statistics of eight
        replicas with the model's own friction. Compiling these is not part of the budget.
    picture : str or Path, optional
        File to which the errors are drawn, over cost and over timestep, if any were measured.

    Returns
    -------
    Advice
        Its text, for `print`, has tables and the advice. After Ctrl-C, it contains what is known
        so far.

    Raises
    ------
    ValueError
        There is no such quantity, it does not change along the path, the model is at rest or has
        no degrees of freedom, or a number is out of bounds.

    Notes
    -----
    A range is the largest minus the smallest value along the path, or, of several components, the
    diagonal of the box that contains the path. It depends on the duration: what did not come back
    within it is named. An element that moves by less than a thousandth of what moves most, in rad
    or in mean sizes of the bodies, is not judged, and is named, too.

    The reference is the path of RK4 or of implicitfast that its halved timestep changes least, or
    an extrapolation to timestep 0. Contacts may leave it uncertain, which limits the error that can
    be promised. Where a perturbation grows a thousandfold, the motion is chaotic: errors along the
    path then count up to the time at which the reference is lost, and means over time of runs from
    perturbed starts are compared, with standard errors. Their reference, at a quarter of the
    model's timestep, proves itself by halving, too, and its doubt is part of the verdict.

    A model is at rest if nothing moves by more than 1e-6 rad or a millionth of the mean size of its
    bodies, `model.stat.meansize`: settled contacts jitter by less, and what creeps moves by more.
    Then there is no motion whose error could be measured.

    The stability limit is the first timestep at which a push at rest grows. Where no constraint
    acts at rest, the limit by theory is the first timestep at which the matrix of one step, found
    by differences, has a spectral radius above 1.002.

    Examples
    --------
    >>> import magmotor as mm
    >>> import mujoco
    >>> model = mujoco.MjModel.from_xml_path("robot.xml")  # doctest: +SKIP
    >>> advice = mm.advise(model, error=0.01, picture="advice.png")  # doctest: +SKIP
    >>> print(advice)  # doctest: +SKIP
    >>> model.opt.timestep = advice.timestep  # doctest: +SKIP
    """
    if picture is not None:
        style.check_matplotlib()
    advice = survey(
        model, data, quantity=quantity, duration=duration, error=error, budget=budget,
        detail=detail, kT=kT, every_element=every_element,
    )  # fmt: skip
    if picture is not None and advice.points:
        advice.draw(picture)
    return advice


def survey(  # noqa: PLR0913 (those of advise)
    model: mujoco.MjModel, data: mujoco.MjData | None, *, quantity: str | Function, error: float,
    budget: float, duration: float | None = None, detail: bool = False, kT: float | None = None,
    among: Collection[str] = (*INTEGRATORS,), tune: bool = True, every_element: bool = True,
) -> Advice:  # fmt: skip
    """Do what `advise` does; only some integrators may be recommended.

    Parameters
    ----------
    model, data, quantity, error, budget, duration, detail, kT, every_element
        As for `advise`.
    among : collection of str
        Integrators that may be recommended; all of them are measured.
    tune : bool
        Whether other settings of the solver may be recommended, too.
    """
    if detail and kT is not None:
        raise ArgumentError("detail", detail, "must be False at a temperature")
    if not model.nv:
        raise ArgumentError(
            "nv of the model", model.nv, "must be at least 1: nothing moves without joints"
        )
    runs = Runs(model, data)
    least = LEAST * runs.timestep
    duration = max(USUAL, least) if duration is None else duration
    if duration < least:
        bound = f"must be at least {least:g} s, {LEAST} timesteps of the model"
        raise ArgumentError("duration", duration, bound)
    if duration > MOST * runs.timestep:
        bound = f"must be at most {MOST * runs.timestep:g} s, {MOST} timesteps of the model"
        raise ArgumentError("duration", duration, bound)
    read = read_quantity(runs.model, runs.workspace(), quantity)
    advice = Advice(
        quantity=read.name, error=error, duration=duration, every_element=every_element,
        notes=own_units(model),
    )  # fmt: skip
    if kT is None and not is_open() and acting_forces(model) & ~UNMARKED:
        advice.notes += tuple(f"not acting: {reason}" for reason in elsewhere(describe(model)))
    with tqdm(total=round(budget), unit="s", leave=False, disable=None) as bar:
        show = partial(_show, bar, time.perf_counter())
        measurement = Measurement(runs, read, duration, every_element=every_element)
        if kT is not None:
            study = Thermal(runs, read, kT, duration, advice, budget=budget, show=show)
        else:
            choice = Choice(advice, measurement, among=among, tune=tune)
            study = Survey(measurement, advice, choice, budget=budget, detail=detail, show=show)
        try:
            study.run()
        except OutOfTime:
            advice.notes += ("the budget was too small",)
        except KeyboardInterrupt:
            advice.notes += ("interrupted: this is what is known so far",)
    if advice.statistics:
        advice.for_statistics = next(iter(reaching(certain(advice.statistics), error)), None)
        doubt = max(row.unproven for row in advice.statistics)
        advice.notes += (
            f"the reference of the statistics is uncertain by {percent(doubt)}, which counts"
            if math.isfinite(doubt)
            else "the reference of the statistics is uncertain: no halved timestep confirms it",
        )
    study.conclude()
    return advice


def _show(bar: tqdm, began: float, what: str) -> None:
    bar.set_description_str(what)
    bar.update(round(time.perf_counter() - began) - bar.n)
