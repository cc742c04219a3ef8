"""B: the generalized forces of the position on a kinematic tree, those at zero velocity."""

from magmotor.mjcf import binding, memory
from magmotor.mjcf.declarations.reader import table_of
from magmotor.mjcf.error_numbers import WORDS
from magmotor.mjcf.error_reports import report
from magmotor.mjcf.forces.all_forces import apply_forces
from magmotor.numerics import c_types as types
from magmotor.numerics.deferred import External, subroutine

_word, _int = types.int64, types.int32
_FUNCTIONS = {
    "mj_tendon": types.void(_word, _word),
    "mj_transmission": types.void(_word, _word),
    "mj_passive": types.void(_word, _word),
    "mj_fwdActuation": types.void(_word, _word),
    "mj_collision": types.void(_word, _word),
    "mj_makeConstraint": types.void(_word, _word),
}

(
    _update_tendons,
    _update_transmission,
    _compute_passive,
    _compute_actuation,
    _collide,
    _make_constraints,
) = (External(name, signature) for name, signature in _FUNCTIONS.items())


def bind() -> None:
    """Bind what this module calls to symbols in compiled code."""
    memory.bind_mujoco(*_FUNCTIONS)
    binding.bind()


@subroutine
def update_rows(model, data, tree):
    """Compute the Jacobians of tendons, actuators and constraints at the current position."""
    if tree.tendons:
        _update_tendons(model, data)
    if tree.actuators:
        _update_transmission(model, data)
    if tree.constraints:
        _collide(model, data)
        _make_constraints(model, data)


@subroutine(forceinline=True)
def constraint_count(data, offsets):
    """Return the number of constraints that are active."""
    return memory.integers(data + offsets.nefc, 1)[0]


@subroutine
def compute_forces(model, data, offsets, tree, wrenches, force):
    """Compute the generalized forces (nv,) at the current position.

    `wrenches` (nbody, 6) is scratch memory; see `add_own_forces` for where dipoles write.
    """
    d = memory.words(data, memory.UNBOUNDED)
    n, bodies = len(force), len(tree.parents)
    update_rows(model, data, tree)
    force[:] = 0.0
    add_own_forces(model, data, offsets, tree, wrenches, force)
    if tree.springs:
        _compute_passive(model, data)
        _add(force, memory.numbers(d[offsets.qfrc_passive // 8], 1, n)[0])
    if tree.actuators:
        _compute_actuation(model, data)
        _add(force, memory.numbers(d[offsets.qfrc_actuator // 8], 1, n)[0])
    _add(force, memory.numbers(d[offsets.qfrc_applied // 8], 1, n)[0])
    if tree.constraints:
        _add_constraint_forces(d, offsets, constraint_count(data, offsets), force)
    xfrc = memory.numbers(d[offsets.xfrc_applied // 8], bodies, 6)
    for body in range(1, bodies):
        for k in range(6):
            wrenches[body, k] = xfrc[body, k] + (tree.weights[body, k] if k < 3 else 0.0)
    _shift_wrenches(d, offsets, tree, wrenches)
    project_wrenches(d, offsets, tree, wrenches, force)


@subroutine
def add_own_forces(model, data, offsets, tree, wrenches, generalized):
    """Add the generalized forces of dipoles and potentials, which MuJoCo does not know.

    See `apply_own_forces` for where dipoles write.
    """
    apply_own_forces(model, data, offsets, tree, tree.forces, wrenches, generalized)
    if tree.own_wrenches:
        d = memory.words(data, memory.UNBOUNDED)
        _shift_wrenches(d, offsets, tree, wrenches)
        project_wrenches(d, offsets, tree, wrenches, generalized)


@subroutine(forceinline=True)
def apply_own_forces(model, data, offsets, tree, kinds, wrenches, generalized):
    """Add the generalized forces of potentials, and the wrenches of dipoles to those of bodies.

    `kinds` are the bits of those that act. The dipoles write their wrenches to `xfrc_applied`, or,
    if the model has the plugin, to the scratch memory `wrenches` (nbody, 6).
    """
    d = memory.words(data, memory.UNBOUNDED)
    for body in range(len(tree.weights)):
        for k in range(6):
            wrenches[body, k] = 0.0
    xfrc = memory.numbers(d[offsets.xfrc_applied // 8], len(tree.weights), 6)
    applied = wrenches if tree.own_wrenches else xfrc
    apply_forces_to(applied, model, data, kinds, generalized)


@subroutine(forceinline=True)
def apply_forces_to(applied, model, data, kinds, generalized):
    """Call `apply_forces`, and raise what it finds."""
    place, own, table = memory.error_on_stack(), applied.ctypes.data, table_of(model, False)
    apply_forces(model, data, table, kinds, own, generalized.ctypes.data, False, place)
    report(memory.words(place, WORDS), model, data)


@subroutine(forceinline=True)
def _add(force, other):
    for i in range(len(force)):
        force[i] += other[i]


@subroutine(forceinline=True)
def _shift_wrenches(d, offsets, tree, wrenches):
    """Apply `shift_wrench` to wrenches at the centers of mass of all bodies."""
    bodies = len(tree.parents)
    centers = memory.numbers(d[offsets.xipos // 8], bodies, 3)
    points = memory.numbers(d[offsets.subtree_com // 8], bodies, 3)
    for body in range(1, bodies):
        shift_wrench(wrenches[body], centers[body], points[tree.roots[body]])


@subroutine(forceinline=True)
def shift_wrench(wrench, center, point):
    """Change a force and torque about `center` to a torque about `point` and force, in place."""
    fx, fy, fz = wrench[0], wrench[1], wrench[2]
    x, y, z = center[0] - point[0], center[1] - point[1], center[2] - point[2]
    tx = wrench[3] + y * fz - z * fy
    ty = wrench[4] + z * fx - x * fz
    tz = wrench[5] + x * fy - y * fx
    wrench[0], wrench[1], wrench[2] = tx, ty, tz
    wrench[3], wrench[4], wrench[5] = fx, fy, fz


@subroutine(forceinline=True)
def project_wrenches(d, offsets, tree, wrenches, force):
    """Add the generalized forces of wrenches on bodies (torque, force), which this sums up.

    The torques are about the center of mass of the body's whole tree, like MuJoCo's `cdof`.
    """
    axes = memory.numbers(d[offsets.cdof // 8], len(force), 6)
    for body in range(len(tree.parents) - 1, 0, -1):
        parent = tree.parents[body]
        if parent > 0:
            for k in range(6):
                wrenches[parent, k] += wrenches[body, k]
    for i in range(len(force)):
        total = 0.0
        for k in range(6):
            total += axes[i, k] * wrenches[tree.bodies[i], k]
        force[i] += total


@subroutine(forceinline=True)
def _add_constraint_forces(d, offsets, count, force):
    """Add the forces of soft constraints at rest, D K I r on each residual r.

    MuJoCo's constraint force at zero velocity and acceleration; see its documentation, Computation.
    """
    n = len(force)
    rows = memory.numbers(d[offsets.efc_J // 8], count, n)
    position = memory.numbers(d[offsets.efc_pos // 8], 1, count)[0]
    margin = memory.numbers(d[offsets.efc_margin // 8], 1, count)[0]
    numbers = memory.numbers(d[offsets.efc_KBIP // 8], count, 4)
    weight = memory.numbers(d[offsets.efc_D // 8], 1, count)[0]
    for row in range(count):
        strength = -weight[row] * numbers[row, 0] * numbers[row, 2] * (position[row] - margin[row])
        for i in range(n):
            force[i] += strength * rows[row, i]
