"""Tables have every number of a dataset, one column for each component, and keep their bits."""

import json
import sys

import mujoco
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from brief_runs import BRIEF
from refusals import refused

import magmotor as mm
from magmotor.common.optional import MissingExtra
from magmotor.run.to_table import write_table

CHAIN = mujoco.MjModel.from_xml_string(
    "<mujoco><worldbody><body><joint type='hinge' axis='0 1 0' damping='0.1'/>"
    "<geom size='0.05' pos='0 0 -1' mass='1'/></body></worldbody></mujoco>"
)


@pytest.fixture(scope="module")
def top():
    return mm.simulate(mm.Top(), method="variational/euler", timestep=0.01, duration=0.3)


@pytest.fixture(scope="module")
def motors():
    numbers = {"method": "variational/baoab", "timestep": 0.05}
    return mm.simulate(mm.Motor(), duration=0.5, replicas=3, **numbers)


def test_a_run_has_a_row_per_record_and_a_column_per_component(top):
    table = mm.to_table(top)
    assert len(table) == top.sizes["time"]
    np.testing.assert_array_equal(table.time, top.time)
    np.testing.assert_array_equal(table.step, top.step)
    for axis in "xyz":
        np.testing.assert_array_equal(table[f"position_{axis}"], top.position.sel(space=axis))
    for k, name in enumerate("wxyz"):
        column = table[f"orientation_{name}"]
        np.testing.assert_array_equal(column, top.orientation.isel(component=k))
    assert table.attrs["left_out"] == []
    numbers = sum(values.size for values in [*top.values(), top.time, top.step])
    assert table.size == numbers


def test_each_column_has_its_unit(top, motors):
    for run in (top, motors):
        units = mm.to_table(run).attrs["units"]
        assert [*units] == mm.to_table(run).columns.to_list()
        assert (units["time"], units["step"], units["velocity_y"]) == ("s", "1", "m/s")
        assert units["axis_z"] == "1"


def test_replicas_follow_each_other(motors):
    table = mm.to_table(motors)
    assert len(table) == 3 * motors.sizes["time"]
    second = table[table.replica == 1]
    np.testing.assert_array_equal(second.time, motors.time)
    np.testing.assert_array_equal(second.position_y, motors.position.sel(replica=1, space="y"))


def test_a_single_record_is_one_row(top, motors):
    pd.testing.assert_frame_equal(mm.to_table(top.isel(time=0)), mm.to_table(top.isel(time=[0])))
    one = mm.to_table(motors.isel(time=-1, replica=2))
    assert one.shape == (1, mm.to_table(motors).shape[1])
    assert one.replica.item() == 2


def test_other_rows_on_demand(motors):
    by_time = mm.to_table(motors, rows=["time", "replica"])
    np.testing.assert_array_equal(by_time.energy, motors.energy.values.T.ravel())
    last = mm.to_table(motors.isel(time=-1))
    assert (len(last), last.time.unique()) == (3, [0.5])


def test_an_ensemble_has_statistics_by_quantity():
    many = mm.ensemble(
        mm.Disk(), method="variational/baoab", timestep=0.05, duration=10.0, replicas=4
    )
    table = mm.to_table(many)
    assert len(table) == many.sizes["time"]
    np.testing.assert_array_equal(table.mean_square_omega, many.mean_square.sel(quantity="omega"))
    assert {"x", "density_x", "mean_square_increment_error"} <= {*table.attrs["left_out"]}
    finals = mm.to_table(many, rows=["replica"])
    assert finals.replica.to_list() == [0, 1, 2, 3]
    np.testing.assert_array_equal(finals.theta, many.theta)
    assert "mean" in finals.attrs["left_out"]


def test_a_sweep_has_a_row_per_case_and_the_fields_as_columns():
    values = np.arange(12.0).reshape(2, 3, 2)
    data = xr.Dataset(
        {"max_spin": (("sample", "tilt", "seed"), values, {"units": "rad/s"})},
        {
            "friction": ("sample", [0.1, 0.2], {"units": "kg/s"}),
            "tilt": ("tilt", [0.0, 0.1, 0.2], {"units": "rad"}),
            "seed": ("seed", [7, 8]),
        },
    )
    table = mm.to_table(data)
    assert table.columns.to_list() == ["sample", "tilt", "seed", "friction", "max_spin"]
    assert table.iloc[9].to_list() == [1.0, 0.1, 8.0, 0.2, 9.0]
    assert table.attrs["units"]["friction"] == "kg/s"


@BRIEF
def test_samples_of_any_model_have_columns_by_coordinate_and_bath():
    run = mm.Langevin(CHAIN, kT=0.5).sample(20 * CHAIN.opt.timestep, replicas=2, record_interval=5)
    table = mm.to_table(run)
    assert table.columns.to_list() == ["replica", "time", "qpos_0", "qvel_0", "heat_kT", "work"]
    np.testing.assert_array_equal(table.qpos_0, run.qpos.values.ravel())


def test_numbers_keep_their_bits_in_csv(tmp_path, motors):
    table = mm.to_table(motors)
    table.loc[0, "energy"], table.loc[1, "energy"] = 5e-324, -0.0
    table.loc[2, "energy"], table.loc[3, "energy"] = np.nan, -np.inf
    write_table(table, tmp_path / "run.csv")
    read = pd.read_csv(tmp_path / "run.csv", comment="#")
    pd.testing.assert_frame_equal(read, table, check_exact=True)
    assert np.signbit(read.energy[1])
    first, second, *_ = (tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()
    assert json.loads(first.removeprefix("# units: ")) == table.attrs["units"]
    assert second.split(",") == table.columns.to_list()


def test_numbers_and_units_are_kept_in_parquet(tmp_path, motors):
    pytest.importorskip("pyarrow", reason="Parquet needs pyarrow")
    table = mm.to_table(motors)
    write_table(table, tmp_path / "run.parquet")
    read = pd.read_parquet(tmp_path / "run.parquet")
    pd.testing.assert_frame_equal(read, table, check_exact=True)
    assert read.attrs == table.attrs


def test_what_cannot_be_written_leaves_no_file(tmp_path, top, monkeypatch):
    with refused("path"):
        write_table(mm.to_table(top), tmp_path / "run.txt")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MissingExtra):
        write_table(mm.to_table(top), tmp_path / "run.parquet")
    assert not [*tmp_path.iterdir()]
