"""The table of what a model declares: against a plain reading, and as models change or go."""

import copy
import doctest
import functools
import pickle
import threading
from types import SimpleNamespace

import mujoco
import numpy as np
import pytest
from messages import declarations
from mujoco import rollout
from refusals import misdeclared

import magmotor as mm
from magmotor.mjcf import declared
from magmotor.mjcf.callbacks import acting_forces
from magmotor.mjcf.declarations import table as of_table
from magmotor.mjcf.declarations import valid_indices
from magmotor.mjcf.declarations.marks import UNREADABLE

MODEL = """
<mujoco>
  <extension>
    <plugin plugin="magmotor.forces"><instance name="forces"/></plugin>
    <plugin plugin="magmotor.magnetometer"><instance name="sensors"/></plugin>
  </extension>
  <option gravity="0 0 0" timestep="1e-3"/>
  <custom>
    <text name="magmotor" data="dipoles couplings fields coils iron magnets"/>
    <text name="other" data="words"/>
    <numeric name="soft" data="100 1e6"/>
    <numeric name="field of the room" data="0.01 0 0.02"/>
    <numeric name="field_turned" data="1e-3 0 0 0.1 0 0 0.2 0"/>
    <numeric name="magnetic_tolerance" data="0.01"/>
    <tuple name="coupling">
      <element objtype="body" objname="needle" prm="2"/>
      <element objtype="body" objname="ball" prm="2"/>
    </tuple>
    <tuple name="coil of the needle">
      <element objtype="actuator" objname="current" prm="3"/>
      <element objtype="site" objname="second"/>
    </tuple>
    <tuple name="coil of the ring">
      <element objtype="actuator" objname="opposed"/>
      <element objtype="body" objname="ring"/>
    </tuple>
    <tuple name="field">
      <element objtype="numeric" objname="field_turned"/>
      <element objtype="site" objname="frame"/>
      <element objtype="actuator" objname="opposed" prm="1"/>
    </tuple>
    <tuple name="iron">
      <element objtype="geom" objname="pole"/>
      <element objtype="numeric" objname="soft"/>
      <element objtype="geom" objname="floor"/>
    </tuple>
    <numeric name="metal" data="3.5e7 0.003"/>
    <tuple name="conductor of the room">
      <element objtype="numeric" objname="metal"/><element objtype="geom" objname="floor"/>
    </tuple>
    <tuple name="unrelated"><element objtype="body" objname="ball"/></tuple>
  </custom>
  <worldbody>
    <geom name="floor" type="plane" size="1 1 0.1" contype="0" conaffinity="0"/>
    <site name="frame" pos="0 0 0.5" euler="0 30 0"/>
    <geom name="pole" size="0.01 0.02 0.03" pos="0 0.4 0.2" contype="0" conaffinity="0"/>
    <body name="needle" pos="0 0 0.3">
      <joint axis="0 1 0" damping="1e-3"/>
      <geom type="capsule" size="0.005 0.05" contype="0" conaffinity="0"/>
      <site name="first" user="0.5" pos="0 0 0.02"/>
      <site name="second" user="0.4"/>
      <site name="probe" pos="0 0 0.06"/>
      <body name="tip" pos="0.02 0 0">
        <site name="third" user="0.1"/><geom size="0.001" user="0 0 1"/>
      </body>
    </body>
    <body name="ball" pos="0.2 0 0.3">
      <freejoint/><geom size="0.02" contype="0" conaffinity="0"/><site name="fourth" user="1"/>
    </body>
    <body name="ring" pos="-0.2 0 0.3">
      <joint axis="0 0 1" damping="1e-3"/>
      <geom size="0.02" contype="0" conaffinity="0"/>
      <site name="fifth" user="1" euler="90 0 0" pos="0.01 0 0"/><site name="sixth" user="0"/>
    </body>
  </worldbody>
  <actuator>
    <general name="current" site="first" gainprm="0" ctrlrange="-1 1"/>
    <general name="opposed" site="first" gainprm="0" ctrlrange="-1 1"/>
  </actuator>
  <sensor>
    <plugin instance="sensors" objtype="site" objname="probe"/>
  </sensor>
</mujoco>
"""


def compiled(xml=MODEL, **changes):
    for old, new in changes.items():
        xml = xml.replace(old, new)
    return mujoco.MjModel.from_xml_string(xml)


def forces(model):
    """Return the magnetic forces in one state of a model, and what its sensors measure."""
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.5
    mujoco.mj_forward(model, data)
    return np.concatenate([data.qfrc_passive, data.sensordata])


def table_of(model):
    """Return the address of a model's table."""
    return declared._table_of()(model._address, False)


def kinds_in(table):
    """Return the kinds in a table, whose address is given."""
    return int(declared._words(table, of_table.STARTS).view(of_table.HEADER)["kinds"][0])


def fresh(model):
    """Return a model with the same memory that no function has seen, by a file."""
    size = mujoco.mj_sizeModel(model)
    buffer = np.empty(size, np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": buffer.tobytes()})


def assigned(array, index, value):
    """Return a model whose forces were those of before, and are those of a new one with a value."""
    model = compiled()
    before = forces(model)
    getattr(model, array)[index] = value
    after = forces(model)
    assert np.array_equal(after, forces(fresh(model)))
    assert not np.array_equal(after, before)
    return model


def test_it_is_what_a_plain_reading_of_names_finds():
    model = compiled()
    number = {
        kind: lambda name, kind=kind: mujoco.mj_name2id(
            model, getattr(mujoco.mjtObj, f"mjOBJ_{kind.upper()}"), name
        )
        for kind in ("body", "site", "geom", "numeric", "tuple", "actuator", "sensor")
    }
    body, site, geom = number["body"], number["site"], number["geom"]
    first = {name: model.tuple_adr[number["tuple"](name)] for name in ("coupling", "field")}
    expected = {
        of_table.COUPLINGS: [
            (number["tuple"]("coupling"), first["coupling"], body("needle"), body("ball"))
        ],
        of_table.MAGNETS: [  # all sites of each body, the world first
            (0, 1, 0, 0, 0, 0),
            (1, 4, body("needle"), body("needle"), 1, 1),
            (4, 5, body("tip"), body("needle"), 1, 0),
            (5, 6, body("ball"), body("ball"), 6, 1),
            (6, 8, body("ring"), body("ring"), 1, 0),
        ],
        of_table.COILS: [
            (k := number["tuple"]("coil of the needle"), model.tuple_adr[k], 0),
            (k := number["tuple"]("coil of the ring"), model.tuple_adr[k], 1),
        ],
        of_table.SITES: [(-1,), (-1,), (0,), (-1,), (-1,), (-1,), (1,), (1,)],
        of_table.FIELDS: [
            (number["numeric"]("field of the room"), 0, 0, 0, 0, 0, -1, -1, -1),
            (
                number["numeric"]("field_turned"), 0, 0, 0, mujoco.mjtObj.mjOBJ_SITE,
                site("frame"), number["tuple"]("field"), first["field"] + 2, 1,
            ),
        ],
        of_table.PIECES: [(geom("pole"), number["numeric"]("soft"), 0, 0, 0)],
        of_table.PLANES: [(geom("floor"), number["numeric"]("soft"), 0, 0, 0)],
        of_table.SHAPES: [
            (k, owner, model.body_weldid[owner], model.body_dofnum[model.body_weldid[owner]], -1)
            for k, owner in enumerate(model.geom_bodyid)
        ],
        of_table.CONDUCTORS: [
            (number["tuple"]("conductor of the room"), geom("floor"), number["numeric"]("metal"))
        ],
        of_table.MEMORIES: [],  # which must not be where iron is
        of_table.MAGNETOMETERS: [(0, 1, site("probe"), 0)],
    }  # fmt: skip
    assert {*expected} == {*range(len(of_table.SECTIONS))}
    for section, rows in expected.items():
        found = [tuple(row) for row in declared.rows(model, section).tolist()]
        assert found == [tuple(map(int, row)) for row in rows], section


@pytest.mark.parametrize(
    ("array", "index", "value"),
    [
        ("site_user", (1, 0), 0.7), ("site_user", (1, 0), 0.0), ("site_user", (7, 0), 0.3),
        ("numeric_data", 0, 3.0), ("numeric_data", 0, 0.0), ("numeric_data", 2, 0.5),
        ("tuple_objprm", slice(0, 2), 0.5), ("tuple_objprm", 2, 0.1), ("geom_size", (1, 0), 0.02),
        ("actuator_ctrlrange", (0, 1), 0.25),
    ],
)  # fmt: skip
def test_numbers_are_followed(array, index, value):
    """A model whose numbers a program assigns is one that was compiled with them."""
    model = assigned(array, index, value)
    tables = [declared.rows(each, of_table.MAGNETS) for each in (model, compiled())]
    assert np.array_equal(*tables)


@pytest.mark.parametrize(
    ("array", "index", "value"),
    [("site_bodyid", 4, 4), ("tuple_objid", 3, 4), ("geom_type", 1, 5), ("tuple_size", 4, 2)],
)
def test_a_structure_that_a_program_assigns_is_read_again(array, index, value):
    assigned(array, index, value)


BAD = [
    example
    for example in doctest.DocTestParser().get_examples(declarations.TABLE)
    if not example.want or example.want.startswith("DeclarationError")
]
"""What the messages' table of declarations calls wrong, and its preparations."""


def bad_models():
    """Yield the models that the table describes, each with the sentence that it gets."""
    names = vars(declarations) | {"mm": SimpleNamespace(describe=lambda model: model)}
    for example in BAD:
        if not example.want:
            exec(example.source, names)
            continue
        model = eval(example.source, names)
        with pytest.raises(mm.DeclarationError) as caught:
            mm.describe(model)
        yield example.source, model, str(caught.value)


def test_what_is_wrong_is_said_alike_by_all_who_read_it():
    readers = [
        mm.check,
        lambda model: mm.field(model, mujoco.MjData(model), [1.0, 2.0, 3.0]),
        lambda model: mm.magnetic_energy(model, mujoco.MjData(model)),
    ]
    for source, model, sentence in bad_models():
        for read in readers:
            with pytest.raises(mm.DeclarationError) as caught:
                read(model)
            assert str(caught.value) == sentence, source
        if "act=" in source:
            with pytest.raises(mm.InputError) as of_langevin:
                mm.Langevin(model)
            assert str(of_langevin.value).startswith(sentence)


def test_what_is_wrong_is_said_by_the_callback():
    """But a field's nodes are not all read within a step: those that are used are."""
    nodes = 0
    for source, model, sentence in bad_models():
        for call in (mujoco.mj_forward, mujoco.mj_step):
            data = mujoco.MjData(model)
            with mm.magnetism(), pytest.raises(mujoco.FatalError) as caught:
                call(model, data)
            if "{GRID}" in source and "nan" in source:
                assert "a node that is not finite" in str(caught.value)
                nodes += 1
            else:
                assert str(caught.value) == sentence, source
            assert data.pstack == 0, source
    assert nodes == 2  # calls, for one declaration


def test_what_is_wrong_is_said_by_the_plugin(monkeypatch):
    """While the model is compiled, or where it is changed afterwards, for its first data."""
    count = 0
    sentences = {source: sentence for source, _, sentence in bad_models()}
    model = functools.partial(declarations.model, plugin=True)
    monkeypatch.setattr(declarations, "model", model)
    names = vars(declarations) | {"mm": SimpleNamespace(describe=mujoco.MjData)}
    for example in BAD:
        if not example.want:
            exec(example.source, names)
            continue
        with pytest.raises((ValueError, mujoco.FatalError)) as caught:
            eval(example.source, names)
        said = str(caught.value).removeprefix("Error: engine error: ")
        assert said == sentences[example.source], example.source
        count += caught.type is mujoco.FatalError
    assert count > 5


def test_an_index_that_leads_nowhere_is_seen_in_a_later_step():
    model = compiled()
    data = mujoco.MjData(model)
    for _ in range(3):
        mujoco.mj_step(model, data)
    model.tuple_objid[0] = 99
    with pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_step(model, data)
    with misdeclared("index", 0) as outside:
        acting_forces(model)
    assert str(in_a_step.value) == str(outside.value)
    assert str(outside.value).startswith("tuple_objid[0] of the model = 99: ")
    model.tuple_objid[0] = 1
    mujoco.mj_step(model, data)


@pytest.mark.parametrize("kind", ["tuple", "sensor"])
def test_the_element_after_the_last_does_not_exist(kind):
    model = compiled()
    numbers, types = getattr(model, f"{kind}_objid"), getattr(model, f"{kind}_objtype")
    for k, one in enumerate(types.tolist()):
        before, count = int(numbers[k]), getattr(model, valid_indices.OBJECTS[one])
        for numbers[k] in (count - 1, count):
            table_of(model)
            assert (declared.header(model).kinds == UNREADABLE) == (numbers[k] == count)
        numbers[k] = before


def test_models_that_are_copied_pickled_or_saved_have_the_same_forces():
    model = compiled()
    expected = forces(model)
    assert expected.any()
    for other in (copy.copy(model), copy.deepcopy(model), pickle.loads(pickle.dumps(model)),
                  fresh(model), compiled()):  # fmt: skip
        assert np.array_equal(forces(other), expected)


def test_models_at_the_address_of_one_that_was_freed_have_their_own_table():
    """Structures alternate, so that each model would have the wrong table of the one before."""
    variants = [
        MODEL,
        MODEL.replace('<site name="fourth" user="1"/>', ""),
        MODEL.replace("coil of the needle", "spool of the needle"),
        MODEL.replace("coil of the ring", "spool of the ring"),
        MODEL.replace("dipoles couplings fields", "dipoles fields"),
        MODEL.replace("iron", "wood").replace("coils wood", "coils"),
    ]
    kept = [compiled(xml) for xml in variants]
    expected = [forces(fresh(model)) for model in kept]
    assert len({each.tobytes() for each in expected}) == len(variants)
    addresses, reused = set(), 0
    for k in range(1000):
        model = compiled(variants[k % len(variants)])
        assert np.array_equal(forces(model), expected[k % len(variants)])
        reused += model._address in addresses
        addresses.add(model._address)
        del model
        if reused == 30:
            break
    assert reused == 30  # after some 40 models; later where much other memory has been freed


def test_models_whose_addresses_share_a_place_have_tables_of_their_own():
    """The reader remembers the last table for 1024 places, and here are more models at once."""
    body = '<body><freejoint/><geom size="1"/>{}</body>'
    xml = "<mujoco><worldbody>{}</worldbody></mujoco>"
    places = [("", ""), ("<site/>", ""), ("", "<site/>")]  # the last two have the same sizes
    kinds = [xml.format(body.format(first) + body.format(second)) for first, second in places]
    specs = [mujoco.MjSpec.from_string(kind) for kind in kinds]
    models = [specs[k % 3].compile() for k in range(1500)]
    expected = [table_of(model) for model in models[:3]]
    assert len({*expected}) == 3
    for _ in range(2):
        assert [table_of(model) for model in models] == expected * 500


def test_an_index_is_checked_for_each_model_and_each_structure():
    """Not only where either has not been seen yet, and without being asked to."""
    xml = '<mujoco><worldbody><site/><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    models = [mujoco.MjSpec.from_string(xml).compile() for _ in range(1100)]
    expected = table_of(models[0])
    assert {table_of(model) for model in models} == {expected}
    for model in models[1:]:  # some share a place with one that was found last
        model.name_bodyadr[1] = -1
        assert table_of(models[0]) == expected
    found = {kinds_in(table_of(model)) for model in models[1:]}
    assert UNREADABLE in found
    one, other = compiled(), compiled()
    other.site_bodyid[4] = 4
    assert table_of(one) != table_of(other)  # both structures are known
    one.site_bodyid[4] = 4
    one.name_bodyadr[1] = -1
    assert kinds_in(table_of(one)) == UNREADABLE


def test_names_that_nothing_reads_make_no_tables():
    """Also if they are next to others, and of equal length."""
    xml = """
    <mujoco>
      <custom><text name="magmotor" data="dipoles"/></custom>
      <worldbody><site user="1"/></worldbody>
      <sensor><clock name="{:06d}"/></sensor>
    </mujoco>"""
    assert len({table_of(compiled(xml.format(k))) for k in range(20)}) == 1


def test_threads_may_read_new_structures_at_the_same_time():
    """Each has models of its own, some of which are alike; every one has its own forces."""
    pattern, failed = '<body pos="{} 0 3"><freejoint/><geom size="0.01"/>{}</body>', []

    def model_of(count):
        bodies = "".join(
            pattern.format(k, '<site user="1"/>' * (1 + k % 3)) for k in range(1, count)
        )
        return compiled(MODEL.replace("</worldbody>", f"{bodies}</worldbody>"))

    expected = {count: forces(model_of(count)) for count in range(2, 12)}

    def run(seed):
        order = np.random.default_rng(seed).permutation(np.arange(2, 12))
        failed.extend(c for c in order if not np.array_equal(forces(model_of(c)), expected[c]))

    threads = [threading.Thread(target=run, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failed


STRUCTURE = {
    "body_weldid": "nbody", "body_dofnum": "nbody", "site_bodyid": "nsite", "geom_type": "ngeom",
    "geom_bodyid": "ngeom", "plugin": "nplugin", "plugin_attradr": "nplugin",
    "sensor_plugin": "nsensor", "sensor_objtype": "nsensor", "sensor_objid": "nsensor",
    "sensor_adr": "nsensor", "name_textadr": "ntext", "text_adr": "ntext",
    "name_numericadr": "nnumeric", "name_tupleadr": "ntuple", "tuple_adr": "ntuple",
    "tuple_size": "ntuple", "tuple_objtype": "ntupledata", "tuple_objid": "ntupledata",
    "numeric_adr": "nnumeric", "numeric_size": "nnumeric", "actuator_ctrladr": "nactuator",
    "actuator_ctrlnum": "nactuator", "actuator_actadr": "nactuator", "actuator_actnum": "nactuator",
}  # fmt: skip
"""Arrays that the reader looks at, and their lengths."""


def test_the_structure_is_all_that_a_table_depends_on():
    """Each change gives a table of its own, or an error; numbers do not change the table."""
    model = compiled()
    seen, unreadable = {table_of(model)}, 0
    for array, count in STRUCTURE.items():
        values = getattr(model, array).reshape(-1)
        assert len(values) == getattr(model, count) > 0, array
        for k in {0, len(values) - 1}:
            before = int(values[k])
            for value in (before + 1, before + (1 << 20), before ^ (1 << 30)):
                values[k] = before
                assert table_of(model) in seen  # else, all indices are checked
                values[k] = value
                table = table_of(model)
                kinds = kinds_in(table)
                assert table not in seen or kinds == UNREADABLE, (array, k, value)
                unreadable += kinds == UNREADABLE
                seen.add(table)
            values[k] = before
    assert table_of(model) in seen
    assert unreadable > 40  # 71
    count = len(seen)
    for array in ("site_user", "numeric_data", "tuple_objprm", "geom_size", "body_mass", "qpos0"):
        getattr(model, array).reshape(-1)[:] += 0.25
        seen.add(table_of(model))
    assert len(seen) == count


def test_an_index_that_no_table_depends_on_is_checked_at_the_start():
    """Also if the same structure has been read before, and if the model was sound at time 0."""
    model = compiled()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    model.name_bodyadr[1] = -1
    mujoco.mj_resetData(model, data)
    with pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_step(model, data)
    with misdeclared("index", 1) as outside:
        mm.describe(model)
    assert str(in_a_step.value) == str(outside.value)
    assert str(outside.value).startswith("name_bodyadr[1] of the model = -1: ")
    assert forces(compiled()).any()


def test_words_of_marks_and_names_count():
    variants = [
        MODEL,
        MODEL.replace("dipoles couplings", "dipoles"),
        MODEL.replace('<text name="other"', '<text name="othes"'),
        MODEL.replace('name="field of the room"', 'name="fjeld of the room"'),
        MODEL.replace('name="unrelated"', 'name="unrelatee"'),
        MODEL.replace("dipoles couplings fields coils iron", "all").replace(
            '<instance name="forces"/>',
            '<instance name="forces"><config key="act" value="all"/></instance>',
        ),
        *(
            MODEL.replace('<text name="magmotor"', '<text name="notes"').replace(
                '<instance name="forces"/>',
                f'<instance name="forces"><config key="act" value="dipoles {word}"/></instance>',
            )
            for word in ("coils", "noise")
        ),
    ]  # fmt: skip
    tables = [table_of(compiled(xml)) for xml in variants]
    assert len({*tables}) == len(variants)
    assert tables == [table_of(compiled(xml)) for xml in variants]
    renamed = MODEL.replace('"needle"', '"needlf"').replace('"ball"', '"balk"')
    assert table_of(compiled(renamed)) == tables[0]  # names that are not read


def test_a_malformed_declaration_that_does_not_act_is_left_out():
    xml = MODEL.replace(
        'objtype="actuator" objname="current" prm="3"', 'objtype="site" objname="first"'
    )
    with pytest.raises(ValueError):  # noqa: PT011 - MuJoCo's
        compiled(xml)
    model = compiled(xml.replace("coils iron", "iron"))
    assert [row.actuator for row in declared.rows(model, of_table.COILS)] == [1]
    assert forces(model).any()
    assert "coils" not in mm.describe(model).acting


def test_a_model_that_was_refused_once_is_refused_in_the_next_step():
    model = compiled()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    model.name_bodyadr[1] = -1
    with misdeclared("index", 1) as outside:
        acting_forces(model)
    with pytest.raises(mujoco.FatalError) as in_a_step:
        mujoco.mj_step(model, data)
    assert str(in_a_step.value) == str(outside.value)


def test_the_last_characters_count():
    """Of the names and texts of two models that are alike otherwise."""
    texts = '<text name="a" data="12345{}"/><text name="{}" data="0"/>'
    xml = f"<mujoco><custom>{texts}</custom></mujoco>"
    last = '<mujoco><custom><text name="a" data="1234{}"/></custom></mujoco>'
    models = [compiled(xml.format(*each)) for each in ("6b", "7b", "6c")]
    models += [compiled(last.format(each)) for each in "5678"]
    assert len({table_of(model) for model in models}) == len(models)


def test_user_numbers_of_sites_count():
    xml = (
        '<mujoco>{}<worldbody><site/><body><freejoint/><geom size="1"/></body></worldbody></mujoco>'
    )
    models = [compiled(xml.format(f'<size nuser_site="{count}"/>')) for count in (0, 1, 2)]
    assert len({table_of(model) for model in models}) == len(models)


def test_many_structures_are_each_found_again():
    """More than there are lists, so that some are the second of a list."""
    model = compiled()
    tables = []
    for _ in range(2):
        for k in range(1500):
            model.body_weldid[1] = 0
            model.tuple_objtype[-1] = 100 + k
            tables.append(table_of(model))
    assert tables[:1500] == tables[1500:]
    assert len({*tables}) == 1500


def test_a_magnetometer_alone_is_read():
    """In a model without tuples and numerics: the field of a dipole on its axis."""
    model = compiled(
        '<mujoco><extension><plugin plugin="magmotor.magnetometer"><instance name="sensors"/>'
        '</plugin></extension><custom><text name="magmotor" data="dipoles"/></custom><worldbody>'
        '<site user="2"/><site name="probe" pos="0 0 0.5"/></worldbody><sensor>'
        '<plugin instance="sensors" objtype="site" objname="probe"/></sensor></mujoco>'
    )
    assert len(declared.rows(model, of_table.MAGNETOMETERS)) == 1
    assert forces(model)[-1] == pytest.approx(1e-7 * 2 * 2 / 0.5**3, rel=1e-9)


def test_a_field_or_iron_on_a_welded_part_does_not_act_on_its_own_body():
    """The part belongs to the rigid body of its parent, which has the only magnet that moves."""
    xml = """
    <mujoco>
      <extension><plugin plugin="magmotor.forces"><instance name="forces"/></plugin></extension>
      <custom>
        <text name="magmotor" data="dipoles fields iron"/>
        <numeric name="soft" data="100"/>
        <tuple name="iron">
          <element objtype="numeric" objname="soft"/><element objtype="geom" objname="pole"/>
        </tuple>
        <numeric name="field" data="0.1 0 0 1 0 0 0 0"/>
        <tuple name="field">
          <element objtype="numeric" objname="field"/><element objtype="body" objname="part"/>
        </tuple>
      </custom>
      <worldbody><body name="whole"><freejoint/><geom size="0.1"/><site user="1"/>
        <body name="part" pos="0 0 0.3"><geom name="pole" size="0.02"/></body>
      </body></worldbody>
    </mujoco>"""
    with pytest.warns(UserWarning, match="all on one rigid body"):
        model = compiled(xml)
    whole = model.body("whole").id
    for section in (of_table.FIELDS, of_table.PIECES):
        rows = declared.rows(model, section)
        assert (rows["weld"].tolist(), rows["freedoms"].tolist()) == ([whole], [6])
    with pytest.warns(UserWarning, match="all on one rigid body"):
        assert not forces(model).any()


def test_tuples_that_overlap_are_refused():
    """Together they would have more rows than there is memory for."""
    model = compiled()
    model.tuple_adr[2] = model.tuple_adr[1]
    with misdeclared("index", 2) as outside:
        acting_forces(model)
    assert str(outside.value).startswith("tuple_adr[2] of the model = ")


@pytest.mark.parametrize("start", [0, -1])
def test_an_empty_range_is_not_read(start):
    model = compiled()
    soft = model.numeric("soft").id
    model.numeric_size[soft], model.numeric_adr[soft] = 0, start
    with misdeclared("material", soft):
        acting_forces(model)
    model = compiled()
    data = mujoco.MjData(model)
    data.ctrl[:] = 0.5
    model.actuator_ctrlnum[0], model.actuator_ctrladr[0] = 0, start
    mujoco.mj_forward(model, data)
    alone = compiled()
    other = mujoco.MjData(alone)
    other.ctrl[:] = 0.0, 0.5
    mujoco.mj_forward(alone, other)
    assert np.array_equal(data.qfrc_passive, other.qfrc_passive)


def test_a_magnetic_constant_counts_without_a_mark():
    unmarked = '<mujoco><custom><numeric name="magnetic_constant" data="{}"/></custom></mujoco>'
    for data in ("-1", "0", "1 2"):
        model = compiled(unmarked.format(data))
        with misdeclared("constant", 0):
            mm.field(model, mujoco.MjData(model), [[0.0, 0.0, 1.0]])
    model = compiled(unmarked.format(1))
    model.numeric_size[0], model.numeric_adr[0] = 0, -1
    with misdeclared("constant", 0):
        mm.field(model, mujoco.MjData(model), [[0.0, 0.0, 1.0]])


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_one_mjdata_serves_models_on_which_different_things_act(order):
    """In a rollout of a list of models, of the same size, each moves as it does alone."""
    bodies = "".join(
        f'<body name="b{k}" pos="{k / 10} 0 {k % 3 / 50}"><freejoint/>'
        '<geom size="0.01" contype="0" conaffinity="0"/><site user="0.1"/></body>'
        for k in range(12)
    )
    tuples = "".join(
        f'<tuple name="coupling{k}"><element objtype="body" objname="b{k}"/>'
        f'<element objtype="body" objname="b{(k + 1) % 12}"/></tuple>'
        for k in range(12)
    )
    models = [
        compiled(
            '<mujoco><extension><plugin plugin="magmotor.forces"><instance name="forces"/></plugin>'
            '</extension><option gravity="0 0 0"/><custom>'
            f'<text name="magmotor" data="{words}"/>{tuples}</custom>'
            f"<worldbody>{bodies}</worldbody></mujoco>"
        )
        for words in ("dipoles", "dipoles couplings")
    ]
    start = np.concatenate([[0.0], models[0].qpos0, np.zeros(models[0].nv)])[np.newaxis]
    none = np.zeros((1, 5, 0))
    alone = [rollout.rollout(each, mujoco.MjData(each), start, none)[0][0] for each in models]
    assert not np.array_equal(*alone)
    models, alone = [models[k] for k in order], [alone[k] for k in order]
    both, _ = rollout.rollout(
        models, mujoco.MjData(models[0]), np.repeat(start, 2, axis=0), none.repeat(2, axis=0)
    )
    assert np.array_equal(both, alone)
