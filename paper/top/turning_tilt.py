"""A tilt that turns: how the ball follows it, where it loses it, and its spin meanwhile."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.integrate import solve_ivp

from magmotor import theory
from magmotor.common import style
from magmotor.common.arrays import Array
from magmotor.devices.ball.landscape import effective_potential, valley
from magmotor.devices.top.observables import SPIN
from magmotor.devices.top.scene import Top
from magmotor.run.simulate import simulate
from paper.figure import OURS, Claim, Figure, judged

METHOD = "mujoco/rk4"

SHOWN = {120: style.BLUE, 60: style.GREEN, 30: style.ORANGE, 15: style.PURPLE}
"""Times of a turn (s) whose runs are drawn, and their colors."""

TURNS = 120, 60, 45, 40, 30, 15
MORE = 90, 80, 70, 55, 50, 37, 35, 33, 27, 25, 22, 20, 18, 12
"""Times of a turn (s), those at reduced size first."""

AFTERWARD = 60.0
"""Time (s) that a run lasts after the tilt has come to rest."""

FASTEST = 1.875 * 2 * math.pi
"""Largest rate of a turn between two waypoints, times its duration."""


def compute(quick: bool) -> dict[str, xr.Dataset]:
    """Simulate one turn of the tilt for each time of a turn."""
    return {f"{seconds} s": _run(seconds) for seconds in TURNS + (() if quick else MORE)}


@cache
def _run(seconds: int) -> xr.Dataset:
    return simulate(
        Top.turning(seconds), method=METHOD, timestep=0.025, duration=seconds + AFTERWARD,
        record_interval=8,
    )  # fmt: skip


def azimuths(run: xr.Dataset, seconds: int) -> tuple[Array, Array]:
    """Return the azimuths of the low side of the ring and, unwrapped, of the ball, in rad."""
    x, y, _ = run.position.values.T
    scene = Top.turning(seconds)
    tilt = np.array([scene.tilt_direction(time) for time in run.time.values.tolist()])
    return tilt, np.unwrap(np.arctan2(y, x))


def largest_lag(tilt: Array, ball: Array) -> float:
    """Return the largest angle between tilt and ball, in rad."""
    return float(np.abs(tilt - ball).max())


@cache
def rolling() -> tuple[float, float]:
    """Return a ball's inertia (kg m^2) and spin per rate of its azimuth, if it does not slip.

    The axis at the angle theta from the vertical turns with the azimuth phi. Without slip the spin
    is omega . xi_3 = phi' (rho/(r sin theta) + cos theta); K phi'^2/2 with the inertia K is the
    kinetic energy of center, axis and spin.
    """
    scene = Top()
    (x, y, _), axis = theory.resting_ball(scene)
    distance, level = math.hypot(x, y), math.hypot(*axis[:2])
    across, _, axial = scene.inertia
    spin = distance / (scene.ball_radius * level) + float(axis[2])
    return scene.ball_mass * distance**2 + across * level**2 + axial * spin**2, spin


@cache
def _valley_radii() -> tuple[Array, Array]:
    """Return angles from the low side of the ring, in rad, and the valley's radii in m."""
    angles = np.linspace(-math.pi, math.pi, 73)
    return angles, np.linalg.norm(valley(Top(), angles), axis=1)


@cache
def predicted_lag(seconds: float) -> float:
    """Return the largest angle (rad) between the tilt and a ball that rolls without slip.

    K phi'' = -dV_e/dphi along the bottom of the valley, which turns with the tilt. The slope is a
    difference over twice 1e-4 rad.
    """
    scene, (inertia, _) = Top.turning(seconds), rolling()

    def rate(time: float, state: Array) -> list[float]:
        behind = (state[0] - scene.tilt_direction(time) + math.pi) % (2 * math.pi) - math.pi
        around = state[0] + np.array([-1e-4, 1e-4])
        points = np.interp(behind, *_valley_radii()) * np.stack([np.cos(around), np.sin(around)])
        before, after = effective_potential(scene, points.T, time).tolist()
        return [state[1], (before - after) / 2e-4 / inertia]

    times = np.linspace(0.0, seconds + AFTERWARD, 300)
    found = solve_ivp(rate, times[[0, -1]], [0.0, 0.0], t_eval=times, rtol=1e-5, atol=1e-6)
    tilt = np.array([scene.tilt_direction(time) for time in times.tolist()])
    return largest_lag(tilt, found.y[0])


def dragged_lag(seconds: float) -> float:
    """Return the lag (rad) at which the valley's slope balances c V for a ball that only slips.

    The lag is c rho^2 psi'/k with the curvature k of V_e, about that of a cosine between minimum
    and saddle.
    """
    angles, radii = _valley_radii()
    points = radii[:, np.newaxis] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    curvature = np.ptp(effective_potential(Top(), points)) / 2
    return Top().friction * radii[len(radii) // 2] ** 2 * FASTEST / seconds / curvature


def _needed_spin(run: xr.Dataset, ball: Array) -> float:
    """Return the largest spin (rad/s) of a ball that rolls as fast as this one moves around."""
    return rolling()[1] * float(np.abs(np.gradient(ball, run.time.values)).max())


def claims(runs: dict[str, xr.Dataset]) -> list[Claim]:
    """Return our claims: following, what limits it, where it fails, and the spin."""
    turns = [int(name.split()[0]) for name in runs]
    both = {
        seconds: azimuths(run, seconds) for seconds, run in zip(turns, runs.values(), strict=True)
    }
    lags = {seconds: largest_lag(*pair) for seconds, pair in both.items()}
    end = float(both[120][1][-1]) / (2 * math.pi)
    slow = [seconds for seconds in turns if seconds >= 45]
    off = max(abs(predicted_lag(seconds) / lags[seconds] - 1) for seconds in slow)
    kept = min(seconds for seconds in turns if lags[seconds] < math.pi)
    lost = max(seconds for seconds in turns if lags[seconds] >= math.pi)
    same = all((lags[each] < math.pi) == (predicted_lag(each) < math.pi) for each in turns)
    spins = {each: float(np.abs(SPIN(runs[f"{each} s"], Top())).max()) for each in turns}
    needed = {each: _needed_spin(runs[f"{each} s"], both[each][1]) for each in turns}
    slip = max(abs(spins[each] / needed[each] - 1) for each in turns)
    return [
        judged(
            f"{OURS}the ball follows a tilt that turns once around in two minutes",
            f"up to {lags[120]:.2f} rad apart; in the end it has gone around {end:.2f} times",
            lags[120] < 0.5 and abs(end - 1) < 0.05,
        ),
        judged(
            f"{OURS}it is inertia that holds the ball back, not friction, since the ball rolls",
            f"rolling without slip predicts the largest lags within {100 * off:.0f} % for turns of"
            f" {min(slow)} s and more; friction on a ball that only slips would make it lag by"
            f" {dragged_lag(120):.1f} rad already for turns of 120 s",
            off < 0.15 and dragged_lag(120) > 3 * lags[120],
        ),
        judged(
            f"{OURS}if the tilt turns around in {lost} s or less, it loses the ball",
            f"the ball is at most {lags[kept]:.2f} rad away for turns of {kept} s, and at some time"
            f" on the other side for all that are faster; rolling without slip predicts the same"
            f" {'in all' if same else 'not in all'} {len(turns)} runs",
            kept > lost and same,
        ),
        judged(
            f"{OURS}meanwhile the top spins as it must to roll, φ' (ρ/(r sin θ) + cos θ)",
            f"the largest spins are {min(spins.values()):.1f} to {max(spins.values()):.1f} rad/s,"
            f" within {100 * slip:.0f} % of those of rolling",
            slip < 0.15,
        ),
        judged(
            f"{OURS}a tilt that turns around in 30 s makes the top spin faster than one at rest",
            f"{spins[30]:.1f} rad/s, against 7.2 rad/s in the paper's fourth case",
            spins[30] > 7.2,
        ),
    ]


def draw(runs: dict[str, xr.Dataset], path: Path) -> None:
    """Draw the azimuths and the spin over time, and the largest lag over the time of a turn."""
    with style.figure(12.0, 4.4) as figure:
        left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.05))
        for seconds, color in SHOWN.items():
            run = runs[f"{seconds} s"]
            tilt, ball = azimuths(run, seconds)
            left.plot(run.time, ball / (2 * math.pi), color=color, label=f"{seconds} s")
            left.plot(run.time, tilt / (2 * math.pi), "--", color=color, lw=1)
            middle.plot(run.time, SPIN(run, Top()), color=color)
        left.plot([], [], "--", color=style.INK, lw=1, label="low side of the ring")
        left.legend(title="one turn of the tilt in")
        left.set(xlabel="t (s)", ylabel="azimuth (turns)", title="Ball, and low side of the ring")
        middle.set(xlabel="t (s)", ylabel="spin J/I₃ (rad/s)", title="Spin of the ball")
        turns = sorted(int(name.split()[0]) for name in runs)
        lags = [largest_lag(*azimuths(runs[f"{seconds} s"], seconds)) for seconds in turns]
        line = np.geomspace(turns[0], turns[-1], 8 if len(turns) < 10 else 80)
        right.plot(turns, lags, "o", color=style.BLUE, ms=5, label="simulated", zorder=3)
        right.plot(
            line,
            [predicted_lag(float(each)) for each in line],
            color=style.ORANGE,
            label="rolling without slip",
        )
        right.plot(
            line,
            [dragged_lag(float(each)) for each in line],
            ":",
            color=style.GRAY,
            label="friction on a ball that only slips",
        )
        right.axhline(math.pi, color=style.INK, lw=0.8, ls="--")
        right.set(
            xscale="log", yscale="log", xlabel="time of one turn (s)",
            ylabel="largest angle between ball and low side (rad)", title="How far the ball lags",
        )  # fmt: skip
        ticks = [15, 30, 60, 120]
        right.set_xticks(ticks, [str(tick) for tick in ticks])
        right.set_xticks([], minor=True)
        right.legend()
        style.save(figure, path, dpi=75)


FIGURE = Figure(
    "turning_tilt",
    "A tilt that turns",
    "The ring is tilted by π/64; its low side turns once around in the time given, from rest to"
    " rest. The ball starts at rest on the low side; c = 0.3 kg/s, `Top.turning(seconds)`. Left"
    " and middle: azimuths and spin. Right: the largest angle between the ball and the low side"
    " until 60 s after the turn, and the same angle for a ball that rolls along the valley of"
    " V_e without slip, whose inertia acts against the slope of V_e. Above the dashed line, π,"
    " the tilt has lost the ball.",
    compute,
    claims,
    draw,
    methods=(METHOD,),
)
