"""The program benchmarks/charts.py: persistent records, and tables and pictures in documents."""

import json
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from PIL import Image

import magmotor as mm
from benchmarks import charts
from benchmarks.accuracy import points as charted
from benchmarks.harness import publish as publishing
from benchmarks.harness import records as storage
from benchmarks.harness import timing
from benchmarks.harness.records import NOT_INSTALLED, Case, Record, Store, measure

CONFTEST = Path(__file__).parents[1] / "conftest.py"


class Counted:
    """Return a case function that counts its runs and is interrupted in one of them."""

    def __init__(self, interrupted: str = ""):
        self.runs: list[str] = []
        self.interrupted = interrupted
        self.answer: Record = {}

    def case(self, key: str):
        def run():
            if key == self.interrupted:
                raise KeyboardInterrupt
            self.runs.append(key)
            return self.answer or {"value": len(key)}

        return Case(key, run)


def test_existing_records_are_not_measured_again(tmp_path):
    counted, path = Counted(), tmp_path / "folder" / "records.jsonl"
    cases = [counted.case(key) for key in ("a", "bb")]
    first = measure(cases, Store(path))
    again = measure([*cases, counted.case("ccc")], Store(path))
    assert first == {"a": {"value": 1}, "bb": {"value": 2}}
    assert again == {**first, "ccc": {"value": 3}}
    assert counted.runs == ["a", "bb", "ccc"]


def test_an_interrupted_program_resumes_where_it_stopped(tmp_path):
    path = tmp_path / "records.jsonl"
    stopped, resumed = Counted(interrupted="bb"), Counted()
    cases, store = [stopped.case(key) for key in ("a", "bb", "ccc")], Store(path)
    with pytest.raises(KeyboardInterrupt):
        measure(cases, store)
    assert [store.find(case) for case in cases] == [{"value": 1}, None, None]
    records = measure([resumed.case(key) for key in ("a", "bb", "ccc")], Store(path))
    assert (stopped.runs, resumed.runs) == (["a"], ["bb", "ccc"])
    assert [*records] == ["a", "bb", "ccc"]


def test_what_lacked_other_software_is_measured_again(tmp_path):
    path, left_out = tmp_path / "records.jsonl", {"failed": f"{NOT_INSTALLED}diffrax"}
    assert measure([Case("a", lambda: left_out)], Store(path)) == {"a": left_out}
    assert measure([Counted().case("a")], Store(path)) == {"a": {"value": 1}}


def test_a_torn_last_line_is_measured_again(tmp_path):
    counted, path = Counted(), tmp_path / "records.jsonl"
    cases = [counted.case(key) for key in ("a", "bb")]
    measure(cases, Store(path))
    path.write_bytes(path.read_bytes()[:-5])
    measure(cases, Store(path))
    assert counted.runs == ["a", "bb", "bb"]
    assert [json.loads(line)["key"] for line in path.read_text().splitlines()] == ["a", "bb"]


@pytest.mark.parametrize("of", ["machine", "versions", "package_checksum", "_source"])
def test_records_of_another_machine_version_or_code_are_not_reused(tmp_path, monkeypatch, of):
    counted, path = Counted(), tmp_path / "records.jsonl"
    measure([counted.case("a")], Store(path))
    other = {"machine": "abacus", "versions": {"mujoco": "0"}, "package_checksum": 0}
    monkeypatch.setattr(storage, of, lambda *_: other.get(of, CONFTEST))
    measure([counted.case("a")], Store(path))
    assert counted.runs == ["a", "a"]


def test_a_mistake_in_a_case_names_it(tmp_path):
    def run():
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError) as caught:
        measure([Case("this/one", run)], Store(tmp_path / "records.jsonl"))
    assert caught.value.__notes__ == ["in the case this/one"]


def test_two_cases_with_one_key_are_refused(tmp_path):
    counted = Counted()
    with pytest.raises(ValueError, match="same key"):
        measure([counted.case("a"), counted.case("a")], Store(tmp_path / "records.jsonl"))


@pytest.fixture
def program(tmp_path, monkeypatch):
    """Return the program with one topic, whose second case is interrupted the first time."""
    counted = Counted(interrupted="bb")
    topic = SimpleNamespace(
        cases=lambda quick: [counted.case(key) for key in (["a", "bb"] if quick else ["a"])],
        draw=lambda records, folder: (folder / "picture.png").write_text(str(records)),
        tables=lambda records: {"values": str(records["a"]["value"])},
        front=lambda records: {"points": []},
    )
    monkeypatch.setitem(sys.modules, "made.up", topic)
    monkeypatch.setattr(charts, "TOPICS", {"accuracy": "made.up"})
    monkeypatch.setattr(charts, "ROOT", tmp_path)
    return charts.main, counted


def test_the_program_resumes_and_says_how(tmp_path, program, capsys):
    main, counted = program
    folder = tmp_path / "out" / "charts-quick"
    assert main(["--quick"]) == 130
    assert capsys.readouterr().out == "stopped: 1 of 2 records are kept; the same command resumes\n"
    assert not (folder / "picture.png").exists()
    counted.interrupted = ""
    assert main(["--quick"]) == 0
    assert counted.runs == ["a", "bb"]
    assert "out/charts-quick/picture.png" in capsys.readouterr().out.splitlines()
    assert (folder / "tables.md").read_text() == "## values\n\n1\n"


def test_what_cannot_be_published_is_reported_in_one_line(program, capsys):
    main, _ = program
    assert main([]) == 2  # there are no documents
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_nothing_is_published_without_other_software(tmp_path, program, capsys):
    main, counted = program
    counted.answer = {"failed": f"{NOT_INSTALLED}robosuite", "value": 0}
    assert main([]) == 2
    error = "charts.py: not published, since not installed: robosuite\n"
    assert capsys.readouterr().err == error
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_one_topic_publishes_nothing(tmp_path, program):
    main, _ = program
    assert main(["--only", "accuracy"]) == 0
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


MARKED = "before\n<!-- charts: speeds -->\nold\nlines\n<!-- end of charts -->\nafter\n"


def test_tables_replace_the_text_between_their_markers():
    new = publishing.with_tables(MARKED + MARKED, {"speeds": "| a |\n| --- |"}, "README.md")
    assert "old" not in new
    assert new.count("| a |") == 2
    assert new.startswith("before\n<!-- charts: speeds -->\n")
    assert new.endswith("<!-- end of charts -->\nafter\n")
    assert publishing.with_tables(new, {"speeds": "| a |\n| --- |"}, "README.md") == new


def test_a_table_may_contain_regular_expression_characters():
    assert r"\1 \g<2>" in publishing.with_tables(MARKED, {"speeds": r"\1 \g<2>"}, "README.md")


def test_a_document_that_requests_an_unknown_table_is_named():
    with pytest.raises(
        ValueError, match=r"README.md requests the unknown table speeds; known are \['a'\]"
    ):
        publishing.with_tables(MARKED, {"a": ""}, "README.md")


def test_publishing_writes_tables_shown_pictures_and_the_front(tmp_path):
    root, drawn = tmp_path / "root", tmp_path / "drawn"
    kept = root / publishing.FRONT
    for folder in (drawn, root / "docs", kept.parent):
        folder.mkdir(parents=True)
    colors = {"shown": (7, 8, 9), "below": (1, 2, 3), "hidden": (4, 5, 6)}
    for name, color in colors.items():
        Image.new("RGB", (4, 3), color).save(drawn / f"{name}.png")
    (root / "README.md").write_text("![a chart](docs/shown.png) ![else](docs/else.png)\n" + MARKED)
    (root / "docs" / "methods.md").write_text("![another](below.png)\n")
    (root / "docs" / "advice.md").write_text("")
    points = [{"method": "one"}, {"method": "two"}]
    front = {"machine": "abacus", "points": points}
    written = publishing.publish({"speeds": "new"}, front, drawn, root)
    names = {str(path.relative_to(root)) for path in written}
    assert names == {"README.md", "docs/shown.png", "docs/below.png", publishing.FRONT}
    with Image.open(root / "docs" / "below.png") as copy:
        assert (copy.size, copy.convert("RGB").getpixel((1, 1))) == ((4, 3), colors["below"])
    assert "new" in (root / "README.md").read_text()
    assert json.loads(kept.read_text()) == front


def point(name, timestep, error, seconds, floor=0.0):
    """Return a point of a method, given by a letter, at a step in units of 0.01 s."""
    method = dict(zip("abcd", mm.methods(mm.Top.paper(4)), strict=False))[name]
    return charted.Point(
        method, timestep / 100, seconds, error, scene="top", quantity="momentum_map", floor=floor
    )


def test_points_join_errors_with_costs_and_keep_failures():
    settings = {"scene": "top", "method": "a/b", "quantities": ["position"]}
    records = {
        "cost": {"scene": "top", "seconds_a_step": {"a/b": 1e-6}},
        "good": {**settings, "timestep": 0.1, "errors": {"position": [0.01, 0.0]}},
        "bad": {**settings, "timestep": 0.5, "failed": "a value is not finite"},
    }
    good, bad = charted.points_of(records)
    assert (good.error, good.seconds) == (0.01, pytest.approx(1e-5, rel=1e-15, abs=0))  # 0
    assert (bad.error, bad.seconds) == (float("inf"), pytest.approx(2e-6, rel=1e-15, abs=0))  # 0


def test_the_front_has_points_that_nothing_cheaper_surpasses():
    points = [point("a", 4, 0.5, 1), point("a", 2, 0.1, 2), point("b", 1, 0.2, 3)]
    points += [point("b", 0.5, 0.01, 4), point("c", 8, float("inf"), 0.1)]
    points += [point("d", 2, 0.1 * (1 - 1e-12), 2.5)]  # the same but for rounding
    points += [point("d", 20, 0.4, 0.5)]  # beyond the limit, and good by chance
    assert charted.front(points) == [points[0], points[1], points[3]]


def test_the_cheapest_step_is_not_one_that_is_good_by_chance():
    lucky = [point("a", 1, 0.001, 1), point("a", 0.5, 0.1, 2), point("a", 0.25, 0.005, 4)]
    assert charted.cheapest(lucky, 0.01) == lucky[2]
    assert charted.cheapest(lucky, 0.2) == lucky[0]
    assert charted.cheapest(lucky, 1e-4) is None
    assert charted.cheapest([point("a", 20, 0.001, 1)], 0.01) is None


def test_an_error_below_its_sampling_floor_counts_as_the_floor():
    points = [point("a", 1, 0.001, 1, floor=0.02), point("a", 0.5, 0.0, 2, floor=0.005)]
    assert charted.cheapest(points, 0.01) == points[1]
    assert charted.cheapest(points, 0.03) == points[0]


def test_the_cost_of_a_step_excludes_setup_and_disturbances():
    disturbances = iter([5.0, 9.0, 0.0, 0.0] * 2)

    def seconds(steps):
        return 1.0 + 2e-6 * steps + next(disturbances, 0.0)

    assert timing.seconds_a_step({"a": seconds}, {"a": 400_000}, 2) == {
        "a": pytest.approx(2e-6, rel=1e-15, abs=0)  # 0
    }


def test_the_cost_of_a_step_is_measured_until_it_is_positive():
    short = iter([0.0, 9.0, 9.0, 1.0])

    def seconds(steps):
        return next(short) if steps == timing.SHORT else 3.0

    found = timing.seconds_a_step({"a": seconds}, {"a": timing.SHORT + 100}, 1)
    assert found == {"a": pytest.approx(0.02, rel=1e-15, abs=0)}  # 0
