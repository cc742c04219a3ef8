"""The live view in a browser: `magmotor view --web` and `mm.live.web`, in a headless Chromium."""

import io
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from contextlib import nullcontext

import mujoco
import numpy as np
import pytest
from browser import PHONE
from PIL import Image
from refusals import refused

import magmotor as mm
from magmotor.live import LiveSimulation, Loop, WebView, live_scene
from magmotor.live.page import LAST_PORT, _exponent, _scaled
from magmotor.live.painted import painted_spheres

SMALL = 500, 400
"""Size of a page whose picture is drawn fast enough by software."""

WAIT = 120.0
"""Longest wall time (s) to wait for something on the page, while other tests run."""

NEEDLE = """
<mujoco>
  <custom><text name="magmotor" data="dipoles"/></custom>
  <worldbody>
    <site name="north" pos="0 0.1 0" zaxis="0 1 0" user="5"/>
    <body name="needle">
      <joint name="hinge" type="hinge" axis="0 0 1" damping="1e-4"/>
      <geom type="capsule" fromto="-0.03 0 0 0.03 0 0" size="0.003"/>
      <site name="needle" zaxis="1 0 0" user="0.2"/>
    </body>
  </worldbody>
</mujoco>
"""


NOTE_TEXTS = """
const { clearRect, fillText } = CanvasRenderingContext2D.prototype;
CanvasRenderingContext2D.prototype.clearRect = function (...place) {
  this.canvas.texts = [];
  clearRect.apply(this, place);
};
CanvasRenderingContext2D.prototype.fillText = function (text, x, y, ...more) {
  this.canvas.texts?.push([text, y]);
  fillText.call(this, text, x, y, ...more);
};
"""
"""Keeps the texts that a canvas shows, and how far down they are."""

CURVE = """
canvas => {
  const { width, height, texts = [] } = canvas;
  if (width === 0 || texts.length === 0) return { end: 0, drawn: 0 };
  const lowest = Math.max(...texts.map(([_, y]) => y));
  const times = texts.filter(([_, y]) => y === lowest).map(([text]) => Number(text));
  const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
  const columns = new Set();
  for (let i = 0; i < data.length; i += 4) {
    const color = data.slice(i, i + 3);
    if (Math.max(...color) - Math.min(...color) > 60) columns.add((i / 4) % width);
  }
  return { end: Math.max(...times), drawn: columns.size / width };
}
"""
"""The last time on the axis of a curve, and the part of the canvas's width that has colors."""


@pytest.fixture
def shown(request):
    """Return a function that shows a scene or a model to browsers, by default on any free port."""

    def show(scene, port=0, **options):
        view = mm.live.web(scene, port=port, **options)
        request.addfinalizer(view.stop)
        return view

    return show


def until(condition, what):
    end = time.monotonic() + WAIT
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.05)


def rests(simulation):
    """Whether no step is taken for half a second."""
    before = simulation.data.time
    time.sleep(0.5)
    return simulation.data.time == before


def slider(view, name):
    """The control of a slider of the page, by the beginning of its label."""
    controls = view._page._controls
    return next(c.handle for c in controls if c.handle.label.startswith(name))


def check_first_curve_grows(page):
    """Check that the page draws it, and later draws it to a later time."""
    canvas, ends = page.locator(".uplot canvas").first, []

    def grown():
        curve = canvas.evaluate(CURVE)
        if curve["drawn"] > 0.5 and curve["end"] > 0:  # not while its axis is laid out anew
            ends.append(curve["end"])
        return len(ends) > 1 and ends[-1] > ends[0]

    until(grown, "the curve on the page does not grow")


@pytest.mark.slow
def test_a_page_shows_the_top_and_its_controls_act(shown, open_page):
    view = shown(mm.Top())
    simulation = view._loop.simulation
    assert simulation.data.time == 0  # no browser is connected
    page = open_page(view.url, SMALL, NOTE_TEXTS)
    page.set_default_timeout(1000 * WAIT)
    page.get_by_text("Pause").wait_for()
    until(lambda: simulation.data.time > 0.3, "the simulation does not run")
    page.get_by_text("J (10⁻⁶ kg m²/s)").wait_for()
    assert page.locator(".uplot canvas").count() == 4
    check_first_curve_grows(page)

    before = simulation.data.mocap_quat[0].copy()
    page.get_by_role("slider").first.press("ArrowRight")
    until(lambda: slider(view, "tilt").value > 0.05, "the slider does not move")
    until(lambda: not np.array_equal(simulation.data.mocap_quat[0], before), "the ring rests")
    tilt = simulation.data.actuator("tilt (rad)").ctrl[0]
    expected = live_scene(mm.Top(tilt=tilt), timestep=0.01).data.mocap_quat[0]
    np.testing.assert_allclose(simulation.data.mocap_quat[0], expected, rtol=0, atol=1e-15)  # 0

    for label, speed in (("faster", 2.0), ("slower", 1.0)):
        page.get_by_text(label).dispatch_event("click")
        until(lambda speed=speed: view._loop.pace.speed == speed, f"{label} does nothing")

    page.get_by_text("Pause").dispatch_event("click")
    page.get_by_text("Continue").wait_for()
    until(lambda: rests(simulation), "the simulation does not pause")  # after the last frame
    page.get_by_role("button", name="Reset", exact=True).dispatch_event("click")
    until(lambda: simulation.data.time == 0, "the button does not reset")
    until(lambda: abs(slider(view, "tilt").value - mm.Top().tilt) < 1e-4, "the slider stays")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scene", "names"),
    [
        (mm.Motor(), ["J", "spin", "azimuth", "temperature"]),
        (mm.Disk(), ["x", "d", "temperature"]),
    ],
    ids=["motor", "disk"],
)
def test_a_page_shows_the_readouts_and_curves_of(scene, names, shown, open_page):
    page = open_page(shown(scene).url, SMALL, NOTE_TEXTS)
    check_first_curve_grows(page)
    first_words = "texts => texts.map(one => one.textContent.split(' (')[0])"
    assert page.locator(".u-title").evaluate_all(first_words) == names
    rows = page.locator("td:first-child").evaluate_all(first_words)
    assert rows == ["time", "speed", *names]


@pytest.mark.slow
def test_a_phone_shows_a_model_without_a_sideways_scroll(shown, open_page):
    view = shown(mujoco.MjModel.from_xml_string(NEEDLE))
    page = open_page(view.url, PHONE)
    page.set_default_timeout(1000 * WAIT)
    page.get_by_text("kinetic energy").first.wait_for()
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    until(lambda: "moments" in view._page._arrows, "there are no arrows")
    assert len(view._page._arrows["moments"].points) == 2
    assert "field" not in view._page._arrows


def test_without_a_browser_the_simulation_waits(shown):
    view = shown(mm.Disk())
    with urllib.request.urlopen(view.url) as page:
        assert page.status == 200
    time.sleep(0.3)
    assert view._loop.simulation.data.time == 0
    assert view._repr_html_().startswith(f'<iframe src="{view.url}"')


def test_a_slider_out_of_bounds_moves_back_and_the_page_says_why():
    loop = Loop(live_scene(mm.Top(), timestep=0.01), 1.0)
    view = WebView(loop, port=0)
    page = view._page
    try:
        for name, value in (("height", 0.1), ("tilt", 0.4)):
            slider(view, name).value = value
            page.read()
            loop.simulation.apply_input()
            page.show()
        assert slider(view, "height").value == 0.1
        assert slider(view, "tilt").value == pytest.approx(mm.Top().tilt, abs=1e-4)  # 1e-5
        assert page._notice.visible
        assert "tilt = 0.4: must be less than" in page._notice.value
    finally:
        view.stop()


def test_sliders_and_curves_of_small_numbers_count_in_powers_of_ten():
    spec = mujoco.MjSpec.from_string(NEEDLE)
    torque = spec.add_actuator(name="torque", ctrlrange=[0, 2e-4], ctrllimited=True)
    torque.trntype, torque.target = mujoco.mjtTrn.mjTRN_JOINT, "hinge"
    loop = Loop(LiveSimulation(spec.compile()), 1.0)
    view = WebView(loop, port=0)
    page, data = view._page, loop.simulation.data
    try:
        handle = slider(view, "torque")
        assert (handle.label, handle.min, handle.max) == ("torque (10⁻⁶)", 0, 200)
        handle.value = 150.0
        page.read()
        assert data.ctrl[0] == pytest.approx(1.5e-4, rel=1e-15)  # 0
        data.qvel[0], data.time = 1e-2, 1.0
        for _ in range(10):
            loop.readouts.update()
        page._show_numbers()
        curve = page._curves["kinetic energy"]
        energy = 0.5 * loop.simulation.model.dof_M0[0] * 1e-4
        assert "10⁻¹² J" in curve.title
        assert curve.data[1].max() == pytest.approx(1e12 * energy, rel=4e-15)  # 0
    finally:
        view.stop()


@pytest.mark.parametrize("speed", ["nan", "1e308"])
def test_numbers_that_cannot_be_drawn_are_left_out(speed):
    spec = mujoco.MjSpec.from_string(NEEDLE)
    spec.add_key(qvel=[float(speed)])
    for name, ends in {"wide": [-1e308, 1e308], "endless": [-np.inf, np.inf]}.items():
        torque = spec.add_actuator(name=name, ctrlrange=ends, ctrllimited=True)
        torque.trntype, torque.target = mujoco.mjtTrn.mjTRN_JOINT, "hinge"
    view = WebView(Loop(LiveSimulation(spec.compile()), 1.0), port=0)
    try:
        view._page._show_numbers()
        curve = view._page._curves["kinetic energy"]
        assert (curve.title, len(curve.data[0])) == ("kinetic energy (J)", 0)
        for name in ("wide", "endless"):
            handle = slider(view, name)
            assert (handle.min, handle.max) == (-1, 1)
    finally:
        view.stop()


def test_switches_of_the_page_act():
    loop = Loop(live_scene(mm.Disk(), timestep=0.01), 1.0)
    view = WebView(loop, port=0)
    try:
        for on in (False, True):
            slider(view, "noise").value = on
            view._page.read()
            assert loop.simulation.on["noise"] == on
    finally:
        view.stop()


def test_a_page_is_never_shared_through_another_server(shown, monkeypatch):
    from viser import ViserServer

    def share(*_, **__):
        raise AssertionError("it asks for a tunnel")

    monkeypatch.setattr(ViserServer, "request_share_url", share)
    assert shown(mm.Disk())._page._server.request_share_url() is None


@pytest.fixture
def connect(request):
    """Return a function that connects to a view as a browser does, with other headers if given."""
    viser, client = pytest.importorskip("viser"), pytest.importorskip("websockets.sync.client")

    def connection(view, **headers):
        address = view.url.replace("http", "ws")
        headers = {"Host": address[5:], "Origin": view.url} | headers
        host = headers.pop("Host")
        protocol = [f"viser-v{viser.__version__}"]
        sock = socket.create_connection(("127.0.0.1", int(view.url.rpartition(":")[2])))
        request.addfinalizer(sock.close)
        options = {"subprotocols": protocol, "compression": None, "max_size": None}
        return client.connect(f"ws://{host}", sock=sock, origin=headers.pop("Origin"), **options)

    return connection


CAMERA = {
    "type": "ViewerCameraMessage", "wxyz": [1, 0, 0, 0], "position": [0, 0, 1], "fov": 1.0,
    "near": 0.1, "far": 10.0, "image_height": 1, "image_width": 1, "look_at": [0, 0, 0],
    "up_direction": [0, 0, 1],
}  # fmt: skip


def test_a_page_ignores_what_it_does_not_send(shown, connect, capsys):
    """Each of the messages would end the view, fill the memory or change the page for good."""
    msgspec = pytest.importorskip("msgspec")
    view = shown(mm.Top())
    pause, tilt = view._page._pause, slider(view, "tilt")
    arrows = next(c.handle for c in view._page._controls if c.handle.label == "arrows")
    update = lambda handle, **new: {  # noqa: E731
        "type": "GuiUpdateMessage", "uuid": handle._impl.uuid, "updates": new
    }  # fmt: skip
    hostile = [
        update(arrows, value="everything"),
        update(arrows, options=["everything"], value="everything"),
        update(tilt, value="much"),
        update(tilt, value=float("nan")),
        update(tilt, value=1e9),
        update(tilt, value=[0.1]),
        update(tilt, min=-1e9),
        update(tilt, removed=True),
        update(pause, label=7),
        update(pause, value="x"),
        update(view._page._notice, value="hacked"),
        {"type": "FileTransferStartUpload", "source_component_uuid": tilt._impl.uuid,
         "transfer_uuid": "x", "filename": "x", "mime_type": "x", "part_count": 9999,
         "size_bytes": 1 << 29},
        {"type": "ShareUrlRequest"},
        {"type": "RunJavascriptMessage", "source": "x"},
        {"type": "NoSuchMessage"},
        CAMERA | {"position": [0, 0, float("inf")]},
        CAMERA | {"position": [1e308, 0, 1]},
        CAMERA | {"image_height": 0},
        CAMERA | {"wxyz": [1, 0, 0]},
        CAMERA | {"owner": "x"},
        ["GuiUpdateMessage"],
    ]  # fmt: skip
    before = arrows.options, arrows.value, tilt.value, tilt.min, pause.label
    with connect(view) as browser:
        for message in hostile:
            browser.send(msgspec.msgpack.encode(message))
        browser.send(b"\xff\x00 no message")
        browser.send(b"\x91" * 60_000)  # lists in lists
        browser.send("text")
        browser.send(msgspec.msgpack.encode(CAMERA))
        browser.send(msgspec.msgpack.encode(update(tilt, value=0.1)))
        until(lambda: tilt.value == 0.1, "the slider does not move")
        until(lambda: view._loop.simulation.data.time > 0, "the simulation does not run")
    assert (arrows.options, arrows.value, tilt.min, pause.label) == (*before[:2], *before[3:])
    assert view._thread.is_alive()
    assert capsys.readouterr().err.count("ignores a message") == 1


def test_a_page_closes_the_connection_at_a_message_of_a_megabyte(shown, connect):
    from websockets.exceptions import ConnectionClosed

    view = shown(mm.Disk())
    browser = connect(view)
    with pytest.raises(ConnectionClosed):  # noqa: PT012
        browser.send(bytes(1 << 20))
        while True:
            browser.recv(timeout=10)
    assert view._thread.is_alive()


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": "http://[evil"},
        {"Host": "evil.example:8080", "Origin": "http://evil.example:8080"},
        {"Host": "127.0.0.1.evil.example", "Origin": "http://127.0.0.1.evil.example"},
    ],
)
def test_pages_of_other_sites_cannot_connect(headers, shown, connect):
    """The last two are sites whose name leads to this computer (DNS rebinding)."""
    from websockets.exceptions import InvalidStatus

    with pytest.raises(InvalidStatus) as refused:
        connect(shown(mm.Disk()), **headers)
    assert refused.value.response.status_code == 403


def test_pages_are_served_to_addresses_and_names_of_this_computer(shown, connect):
    view = shown(mm.Disk(), host="0.0.0.0")
    port = view.url.rpartition(":")[2]
    for name in ("127.0.0.1", "[::1]", "192.0.2.1", "localhost", socket.gethostname()):
        connect(view, Host=f"{name}:{port}", Origin=f"http://{name}:{port}").close()
    connect(view, Origin=None).close()  # no browser
    request = urllib.request.Request(f"http://127.0.0.1:{port}", headers={"Host": "evil.example"})
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(request)
    assert refused.value.code == 403
    refused.value.close()


def test_a_page_runs_at_the_speed_asked_for(shown):
    assert shown(mm.Disk(), speed=3.0)._loop.pace.speed == 3.0


def test_a_view_runs_once():
    view = mm.live.web(mujoco.MjModel.from_xml_string(NEEDLE), port=0)
    for call in (view.start, view.run):
        with pytest.raises(RuntimeError, match="it runs already; make another one"):
            call()
    view.stop()
    for call in (view.start, view.run):
        with pytest.raises(RuntimeError, match="it has been stopped; make another one"):
            call()


def test_views_that_start_and_stop_together_give_the_output_back():
    output = sys.stdout
    model = mujoco.MjModel.from_xml_string(NEEDLE)

    def show():
        WebView(Loop(LiveSimulation(model), 1.0), port=0).stop()

    threads = [threading.Thread(target=show) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sys.stdout is output


def test_a_page_says_why_its_simulation_stopped(monkeypatch):
    view = WebView(Loop(live_scene(mm.Disk(), timestep=0.01), 1.0), port=0)

    def fail(*_):
        raise FloatingPointError("no such number")

    monkeypatch.setattr(view._loop.simulation, "apply_input", fail)
    try:
        with pytest.raises(FloatingPointError):
            view.run()
        assert view._page._notice.visible
        assert view._page._notice.value == "stopped: no such number"
    finally:
        view.stop()


@pytest.mark.skipif(sys.platform != "linux", reason="others have one loopback address")
def test_it_is_served_to_this_computer_only_unless_told_otherwise(shown):
    closed, open_ = shown(mm.Disk()), shown(mm.Disk(), host="0.0.0.0")
    for view, others in ((closed, False), (open_, True)):
        port = int(view.url.rpartition(":")[2])
        with socket.create_connection(("127.0.0.1", port), timeout=10):
            pass
        # To a server that listens on all interfaces, this is one of them.
        with socket.socket() as trial:
            assert (trial.connect_ex(("127.0.0.2", port)) == 0) == others


def test_the_next_free_port_is_used(shown):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        if port == LAST_PORT:
            pytest.skip("there is no next port")
        found = int(shown(mm.Disk(), port=port).url.rpartition(":")[2])
        assert port < found


def test_a_last_port_that_is_taken_is_a_mistake():
    try:
        taken = socket.create_server(("127.0.0.1", LAST_PORT))
    except OSError:
        taken = nullcontext()
    with taken, refused("port"):
        WebView(Loop(live_scene(mm.Disk(), timestep=0.01), 1.0), port=LAST_PORT)


def test_arrows_are_those_of_the_moments_and_the_field(shown):
    loop = Loop(live_scene(mm.Top(), timestep=0.01), 1.0)
    view = WebView(loop, port=0)
    try:
        loop.arrows = "moments and field"
        view._page.show()
        arrows, data = view._page._arrows, loop.simulation.data
        ends = arrows["moments"].points
        assert (len(ends), len(arrows["field"].points)) == (21, 121)
        error = np.abs(ends.mean(axis=1) - data.site_xpos).max()
        assert error < 1e-7  # 2e-8: single precision
        along = ends[:, 1] - ends[:, 0]
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        assert np.abs(along - data.site_xmat[:, 2::3]).max() < 3e-6  # 3e-7
        assert (arrows["moments"].colors == [204, 61, 28]).all()  # reddish brown
        blue, orange = [0, 114, 178], [230, 159, 0]
        found = arrows["field"].colors.tolist()
        assert blue in found
        assert orange in found
        loop.arrows = "none"
        view._page.show()
        assert not arrows["moments"].visible
    finally:
        view.stop()


def test_a_painted_ball_replaces_the_plain_one_and_turns_with_it():
    loop = Loop(live_scene(mm.Top(), timestep=0.01), 1.0)
    view = WebView(loop, port=0)
    model, data, page = loop.simulation.model, loop.simulation.data, view._page
    try:
        ball = model.geom("ball").id
        assert list(page._painted) == [ball]
        drawn_by_mjviser = page._scene.mj_model.geom_rgba[:, 3] > 0
        assert np.flatnonzero(~drawn_by_mjviser).tolist() == [ball]
        assert model.geom_rgba[ball, 3] == 1
        data.qpos[2:6] = 0.5, -0.5, 0.5, 0.5
        mujoco.mj_forward(model, data)
        page.show()
        matrix = np.empty(9)
        mujoco.mju_quat2Mat(matrix, page._painted[ball].batched_wxyzs[0].astype(float))
        np.testing.assert_allclose(matrix, data.geom_xmat[ball], rtol=0, atol=1e-7)  # single
        np.testing.assert_allclose(
            page._painted[ball].batched_positions[0], data.geom_xpos[ball], rtol=1e-6
        )
    finally:
        view.stop()


PAINTED = """
<mujoco>
  <visual>
    <headlight ambient="1 1 1" diffuse="0 0 0" specular="0 0 0"/>
    <map zfar="1000"/>
  </visual>
  <asset>
    <texture name="quarters" type="cube" file="quarters.png" {}/>
    <material name="quarters" texture="quarters" specular="0" rgba="1 0.5 0.8 1"/>
  </asset>
  <worldbody>
    <camera name="front" pos="30 30 30" xyaxes="-1 1 0 -1 -1 2" fovy="2"/>
    <camera name="back" pos="-30 -30 -30" xyaxes="-1 1 0 1 1 -2" fovy="2"/>
    <geom type="sphere" size="1" material="quarters"/>
  </worldbody>
</mujoco>
"""


def png(picture):
    """Return a picture, shape (height, width, 3), as the contents of a file."""
    file = io.BytesIO()
    Image.fromarray(picture).save(file, "png")
    return file.getvalue()


@pytest.mark.usefixtures("opengl")
@pytest.mark.parametrize("sides", [6, 1])
@pytest.mark.parametrize("camera", ["front", "back"])
def test_a_painted_sphere_has_the_colors_that_mujoco_draws(camera, sides):
    """A cube texture has six images, or one for all sides."""
    quarters = np.random.default_rng(1).integers(0, 256, (sides, 2, 2, 3), dtype=np.uint8)
    images = quarters.repeat(32, axis=1).repeat(32, axis=2)
    assets = {"quarters.png": png(images.reshape(-1, 64, 3))}
    grid = "" if sides == 1 else 'gridsize="6 1" gridlayout="RLUDFB"'
    model = mujoco.MjModel.from_xml_string(PAINTED.format(grid), assets)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    with mujoco.Renderer(model, 100, 100) as renderer:
        renderer.update_scene(data, camera)
        picture = renderer.render().astype(int)
    x, y = np.meshgrid(np.linspace(-0.99, 0.99, 100), np.linspace(0.99, -0.99, 100))
    x, y = np.sqrt(3) * 30 * np.tan(np.radians(1)) * np.stack([x, y])
    inside = x**2 + y**2 < 0.8
    seen = np.stack([x, y, np.sqrt(np.maximum(1 - x**2 - y**2, 0))], axis=-1)[inside]
    [sphere] = painted_spheres(model).values()
    directions = sphere.triangles_center / np.linalg.norm(sphere.triangles_center, axis=1)[:, None]
    towards = seen @ data.camera(camera).xmat.reshape(3, 3).T
    nearest = (towards @ directions.T).argmax(axis=1)
    expected = sphere.visual.face_colors[nearest, :3].astype(int)
    error = np.abs(picture[inside] - expected).max(axis=1)
    assert (error < 3).mean() > 0.85  # 0.92: the others are near edges


def test_the_first_twenty_opaque_spheres_are_painted():
    def spheres(opacity, count):
        return f'<geom type="sphere" size="1" material="quarters" rgba="1 1 1 {opacity}"/>' * count

    material = 'specular="0" rgba="1 0.5 0.8 1"'
    text = PAINTED.format("").replace(
        "</worldbody>", f"{spheres(0, 1)}{spheres(1, 21)}</worldbody>"
    )
    assets = {"quarters.png": png(np.zeros((64, 64, 3), np.uint8))}
    model = mujoco.MjModel.from_xml_string(text, assets)
    assert [*painted_spheres(model)] == [0, *range(2, 21)]
    clear = text.replace(material, 'rgba="1 1 1 0.5"')
    assert not painted_spheres(mujoco.MjModel.from_xml_string(clear, assets))


@pytest.mark.parametrize(
    ("size", "exponent"), [(0, 0), (0.01, 0), (9999, 0), (2e-5, -6), (1e-3, -3), (1e4, 3)]
)
def test_small_numbers_have_a_power_of_ten(size, exponent):
    assert _exponent(size) == exponent


def test_a_label_has_its_power_of_ten_before_the_unit():
    assert _scaled("J (kg m^2/s)", -6) == "J (10⁻⁶ kg m²/s)"
    assert _scaled("x", 3) == "x (10³)"
    assert _scaled("spin (rad/s)", 0) == "spin (rad/s)"


@pytest.mark.parametrize(
    ("options", "line"),
    [
        (("--host", "192.0.2.1"), "host = '192.0.2.1': must be an address of this computer"),
        (("--port", "70000"), "port = 70000: must be at most 65535"),
    ],
)
def test_a_wrong_address_is_one_line_and_code_2(run_script, options, line):
    code, _, error = run_script("view", "--web", *options, "disk")
    assert code == 2
    assert error.startswith(f"magmotor view: {line}")
    assert error.count("\n") == 1


@pytest.mark.slow
def test_the_command_serves_a_file_until_it_is_interrupted(tmp_path):
    """Without the word `model`, and with options first."""
    path = tmp_path / "needle.xml"
    path.write_text(NEEDLE)
    command = [sys.executable, "-m", "magmotor", "view", "--web", "--port", "0", str(path)]
    view = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert view.stdout is not None
        first, second = view.stdout.readline(), view.stdout.readline()
        assert first, view.communicate()[1]
        url = first.split()[1]
        assert url.startswith("http://127.0.0.1:")
        assert f"ssh -L {url[17:]}:127.0.0.1:{url[17:]} " in second
        with urllib.request.urlopen(url) as page:
            assert page.status == 200
        view.send_signal(signal.SIGINT)
        assert view.communicate(timeout=120)[1] == "magmotor view: interrupted\n"
    finally:
        view.kill()
    assert view.returncode == 130
