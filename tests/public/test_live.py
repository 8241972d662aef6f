"""A robot behind a server: real time, sliders, play, what was driven; and who gets an answer."""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import catheter_sim as cs
from catheter_sim.catalogue import ROBOTS, load_robot
from catheter_sim.cli.main import main
from catheter_sim.diagnosis.recording import recording_of
from catheter_sim.errors import InputError
from catheter_sim.public.live import (
    FRAME_S,
    LiveRobot,
    LiveServer,
    live_robot,
    page_of,
    reach_mm,
    sliders_of,
)

SECTION = "neuroendoscope_section"


@pytest.fixture
def server() -> Iterator[LiveServer]:
    found = LiveServer(live_robot(load_robot(SECTION), (0.0, 0.0, 0.0)))
    found.begin()
    yield found
    found.end()


def answer(
    server: LiveServer, method: str, path: str, body: str | None = None, **headers: str
) -> tuple[int, str, dict[str, str]]:
    line = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    line.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
    found = line.getresponse()
    text = found.read().decode()
    line.close()
    return found.status, text, dict(found.getheaders())


@pytest.mark.parametrize("name", ROBOTS)
def test_every_channel_has_a_slider_that_holds_rest(name: str) -> None:
    """Zero lies within, and both ends are inputs that the robot takes."""
    robot = load_robot(name)
    sliders = {item.name: item for item in sliders_of(robot, robot.actuation)}
    for column in cs.input_channels(robot) if hasattr(cs, "input_channels") else ():
        assert column in sliders
    for item in sliders.values():
        assert item.least <= 0.0 <= item.most
        assert item.least < item.most
        assert item.name.endswith(item.unit)
    live = LiveRobot(robot)
    live.ask({"set": {item.name: item.most for item in sliders.values() if "gravity" not in item.name}})
    live.advance()
    live.ask({"set": {item.name: item.least for item in sliders.values() if "gravity" not in item.name}})
    live.advance()


def test_a_slider_moves_the_tip_as_the_simulation_does() -> None:
    """After two seconds the robot stands where a held row leaves it."""
    live = live_robot(load_robot(SECTION), (0.0, 0.0, 0.0))
    live.ask({"set": {"tension_right_N": 0.3}})
    for _ in range(60):
        live.advance()
    run = cs.simulate(SECTION, {"time_s": [0.0, 1.0], "tension_right_N": [0.0, 0.3]})
    tip = run.to_table().columns
    expected = [tip[f"tip_{axis}_mm"][-1] for axis in "xyz"]
    np.testing.assert_allclose(live.state["shape_mm"][-1], expected, atol=0.2)
    live.ask({"reset": True})
    live.advance()
    np.testing.assert_allclose(live.state["shape_mm"][-1], [0.0, 0.0, 60.0], atol=0.05)


def test_what_was_driven_is_a_file_of_inputs(tmp_path: Path) -> None:
    live = live_robot(load_robot(SECTION), (0.0, 0.0, 0.0))
    for k in range(45):
        live.ask({"set": {"tension_left_N": 0.005 * k}})
        live.advance()
    (tmp_path / "driven.csv").write_text(live.table())
    inputs = cs.read_inputs(SECTION, tmp_path / "driven.csv")
    assert 12 <= len(inputs) <= 16
    assert inputs.tendon[-1, 1] == pytest.approx(0.22, abs=0.02)
    assert not inputs.tendon[:, 0].any()


def test_a_trial_is_played_with_its_measured_points(tmp_path: Path) -> None:
    given = tmp_path / "in.csv"
    given.write_text("time_s,tension_right_N,tip_x_mm,tip_z_mm\n0,0,0,60\n1,0.2,20,50\n2,0.4,,\n")
    robot = load_robot(SECTION)
    live = live_robot(robot, (0.0, 0.0, 0.0), recording_of(robot, given), "in.csv")
    live.advance()
    assert live.state["measured_mm"] is None
    live.ask({"play": {"at_s": 0.5, "running": False}})
    live.advance()
    assert live.state["values"]["tension_right_N"] == pytest.approx(0.1)
    assert live.state["measured_mm"] == [[10.0, 0.0, 55.0]]
    live.ask({"play": {"running": True, "speed": 20.0}})
    for _ in range(4):
        live.advance()
    assert live.state["values"]["tension_right_N"] == pytest.approx(0.4)
    assert live.state["running"] is False
    assert live.state["measured_mm"] == [[None, 0.0, None]]
    live.ask({"set": {"tension_right_N": 0.0}})
    live.advance()
    assert live.state["measured_mm"] is None
    assert live.state["values"]["tension_right_N"] == 0.0


def test_play_goes_on_from_where_it_was_and_again_from_the_end(tmp_path: Path) -> None:
    """A slider or a reset pauses it; at the end it begins anew."""
    given = tmp_path / "in.csv"
    given.write_text("time_s,tension_right_N\n0,0\n1,0.2\n2,0.4\n")
    robot = load_robot(SECTION)
    live = live_robot(robot, (0.0, 0.0, 0.0), recording_of(robot, given), "in.csv")
    live.ask({"play": {"at_s": 1.0, "running": True}})
    live.advance()
    live.ask({"set": {"tension_left_N": 0.1}})
    live.advance()
    assert live.state["running"] is False
    assert live.state["play_s"] == pytest.approx(1.0 + FRAME_S)
    live.ask({"play": {"running": True}})
    live.advance()
    assert live.state["play_s"] == pytest.approx(1.0 + 2.0 * FRAME_S)
    live.ask({"play": {"at_s": 2.0}})
    live.ask({"play": {"running": True}})
    live.advance()
    assert live.state["play_s"] == pytest.approx(FRAME_S)
    live.ask({"reset": True})
    live.advance()
    assert (live.state["play_s"], live.state["running"]) == (0.0, False)


def test_what_acts_on_inputs_and_bodies_is_on_a_file_that_is_played(tmp_path: Path) -> None:
    """Where it is played slowly the robot stands where `simulate` has it: dead-band, load on an element."""
    given = tmp_path / "in.csv"
    given.write_text(
        "time_s,displacement_right_mm,displacement_left_mm,force_body_15_x_N\n"
        "0,0,0,0\n1,1,-1,-0.01\n2,0.8,-0.8,-0.01\n"
    )
    robot = load_robot(SECTION, {"effects.backlash.width_mm": 0.4})
    live = live_robot(robot, (0.0, 0.0, 0.0), recording_of(robot, given), "in.csv")
    assert live.outside == ("backlash",)
    for at_s in (*np.linspace(0.0, 2.0, 60), *[2.0] * 60):
        live.ask({"play": {"at_s": float(at_s), "running": False}})
        live.advance()
    tip = cs.simulate(robot, given).to_table().columns
    expected = [tip[f"tip_{axis}_mm"][-1] for axis in "xyz"]
    np.testing.assert_allclose(live.state["shape_mm"][-1], expected, atol=0.3)
    page = json.loads(page_of(live).partition('id="about">')[2].partition("</script>")[0])
    assert page["outside"] == ["backlash"]


@pytest.mark.parametrize(
    ("message", "said"),
    [
        ({"set": {"tension_up_N": 0.1}}, "'tension_up_N': choices: tension_right_N"),
        ({"set": {"tension_right_N": "much"}}, "tension_right_N: a finite number is needed"),
        ({"set": {"tension_right_N": float("nan")}}, "tension_right_N: a finite number is needed"),
        ({"open": "/etc/passwd"}, "choices: set, reset, play"),
        ({"play": {"at_s": 1.0}}, "play: no file of inputs was given"),
    ],
)
def test_a_bad_message_changes_nothing(message: dict, said: str) -> None:
    live = live_robot(load_robot(SECTION), (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match=said):
        live.ask(message)
    assert live.values == live.rest


def test_the_page_loads_nothing_from_elsewhere(server: LiveServer) -> None:
    status, text, headers = answer(server, "GET", f"/{server.token}/")
    assert status == 200
    assert "http://" not in text.replace("http://www.w3.org", "")
    assert "https://" not in text
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    about = json.loads(text.partition('id="about">')[2].partition("</script>")[0])
    assert about["robot"] == SECTION
    assert [item["name"] for item in about["sliders"][:2]] == ["tension_right_N", "tension_left_N"]


def about(view: cs.LiveView) -> dict:
    text = view._server.page
    return json.loads(text.partition('id="about">')[2].partition("</script>")[0])


def test_the_page_knows_how_a_command_names_its_robot(tmp_path: Path) -> None:
    """An id, a file as a shell needs it, a value that is an id's; of another value the file to write."""
    robot = cs.load_robot(SECTION, ["friction.mu=0.02"])
    file = tmp_path / "my robot.toml"
    cs.save_robot(robot, file)
    for given, name in (
        (SECTION, SECTION),
        (file, f"'{file}'"),
        (cs.load_robot(SECTION), SECTION),
        (robot, f"{SECTION}.toml"),
    ):
        with cs.view(given) as shown:
            assert about(shown)["command"] == name


def test_each_element_has_its_radius() -> None:
    """Of a catheter whose tube is thinner than its joint; one for each place of the shape."""
    with cs.view("mitral_transseptal") as shown:
        radii, live = about(shown)["radii_mm"], shown._server.live
    assert len(radii) == len(live.state["shape_mm"])
    segments = {round(1e3 * segment.outer_radius_m, 3) for segment in live.robot.segments}
    assert set(radii) == segments


def test_the_robot_is_driven_through_the_server(server: LiveServer) -> None:
    """States come as they are made; what was asked for is seen in them."""
    body = json.dumps({"set": {"tension_right_N": 0.2}})
    assert answer(server, "POST", f"/{server.token}/ask", body)[0] == 200
    line = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    line.request("GET", f"/{server.token}/states")
    stream = line.getresponse()
    numbers = []
    while len(numbers) < 5:
        text = stream.readline().decode().strip()
        if text.startswith("data: "):
            state = json.loads(text.removeprefix("data: "))
            numbers.append(state["number"])
    line.close()
    assert numbers == sorted(set(numbers))
    assert state["values"]["tension_right_N"] == 0.2
    assert len(state["shape_mm"]) == 31
    assert answer(server, "GET", f"/{server.token}/driven.csv")[1].startswith("time_s,tension_right_N\n")


def test_only_who_knows_the_token_gets_an_answer(server: LiveServer) -> None:
    """Wrong token, foreign host, foreign origin: refused; nothing else can be read or sent."""
    own = f"127.0.0.1:{server.server_port}"
    good = f"/{server.token}/"
    for path in ("/", "/wrong/", "/wrong/states", f"/{server.token[:-1]}/"):
        assert answer(server, "GET", path)[0] == 403
    for headers in (
        {"Host": "evil.example"},
        {"Host": f"evil.example:{server.server_port}"},
        {"Origin": "http://evil.example"},
        {"Origin": "null"},
        {"Origin": own},
        {"Host": f"192.0.2.2:{server.server_port}"},
        {"Origin": f"http://{own}.evil.example"},
    ):
        assert answer(server, "GET", good, **headers)[0] == 403
        assert answer(server, "POST", good + "ask", '{"reset": true}', **headers)[0] == 403
    assert answer(server, "GET", good, Origin=f"http://{own}")[0] == 200
    for path in ("../../etc/passwd", "scene.js", "%2e%2e/pyproject.toml", "ask"):
        assert answer(server, "GET", good + path)[0] == 404
    for method in ("PUT", "DELETE"):
        assert answer(server, method, good + "ask", "{}")[0] == 501
    assert answer(server, "POST", good + "upload", "x")[0] == 404
    assert answer(server, "POST", good + "ask", "x" * 70_000)[0] == 413
    assert answer(server, "POST", good + "ask", "[1]")[0] == 400
    assert answer(server, "POST", good + "ask", "[" * 60_000)[0] == 400
    assert answer(server, "POST", good + "ask", "{}", Content_Length="\u00b2")[0] == 413


def test_a_server_for_others_knows_its_addresses_in_numbers_and_no_other_name() -> None:
    """A name may be led to any machine by who owns it, a number may not."""
    found = LiveServer(live_robot(load_robot(SECTION), (0.0, 0.0, 0.0)), "0.0.0.0")
    found.begin()
    try:
        good, port = f"/{found.token}/", found.server_port
        assert found.address.startswith(f"http://{socket.gethostname()}:{port}/")
        for host in ("192.0.2.2", "127.0.0.1", socket.gethostname()):
            assert answer(found, "GET", good, Host=f"{host}:{port}")[0] == 200
        for host in (f"evil.example:{port}", "192.0.2.2:1", "192.0.2.2"):
            assert answer(found, "GET", good, Host=host)[0] == 403
    finally:
        found.end()


def test_the_first_view_holds_the_whole_robot() -> None:
    """Of robots that stand higher than their segments are long, too; a slider holds the gravity given."""
    live = live_robot(load_robot("notched_wrist"), (0.0, 0.0, -30.0))
    assert reach_mm(live.state["shape_mm"]) == pytest.approx(live.state["shape_mm"][-1][2])
    assert live.sliders["gravity_z_mps2"].least <= -30.0


def test_it_listens_on_this_machine_alone_and_frees_its_port() -> None:
    found = LiveServer(live_robot(load_robot(SECTION), (0.0, 0.0, 0.0)))
    found.begin()
    host, port = found.server_address[:2]
    assert host == "127.0.0.1"
    with pytest.raises(InputError, match=f"port {port}"):
        LiveServer(found.live, port=port)
    found.end()
    with socket.socket() as again:
        again.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        again.bind(("127.0.0.1", port))


def test_a_simulation_that_diverges_waits_for_a_reset(monkeypatch: pytest.MonkeyPatch) -> None:
    live = live_robot(load_robot(SECTION), (0.0, 0.0, 0.0))
    stop = threading.Event()

    def fail() -> None:
        stop.set()
        raise cs.SimulationDiverged("the robot left the finite numbers")

    monkeypatch.setattr(live, "advance", fail)
    live.run(stop)
    assert live.state["failure"] == "the robot left the finite numbers"
    live.ask({"reset": True})
    assert live.failure == ""


def test_a_reports_folder_is_opened(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "report.html").write_text("<p>a report</p>")
    assert main(["view", str(tmp_path), "--no-browser"]) == 0
    assert str(tmp_path / "report.html") in capsys.readouterr().out
    assert main(["view", str(tmp_path / "report.html"), "--no-browser"]) == 0
    assert main(["view", str(tmp_path), "--inputs", "x.csv"]) == 2
    assert "a report plays no inputs" in capsys.readouterr().err
    assert main(["view", str(tmp_path.parent / "nothing")]) == 2
    (tmp_path / "report.html").unlink()
    assert main(["view", str(tmp_path)]) == 2
    assert "no report.html" in capsys.readouterr().err


def test_gravity_and_a_shared_channel_act_as_in_a_simulation() -> None:
    """Hung in gravity; a channel that pulls two tendons gives each its half."""
    live = live_robot(load_robot("neuroendoscope"), (0.0, 0.0, -9.81))
    live.advance()
    assert live.simulator.model.opt.gravity.tolist() == [0.0, 0.0, -9.81]
    shared = next(drive for drive in live.drives if len(drive.tendons) > 1)
    live.ask({"set": {shared.column: 0.2}})
    np.testing.assert_allclose(live._tendon()[list(shared.tendons)], 0.2 * np.array(shared.parts))
    live.ask({"set": {"gravity_z_mps2": 0.0}})
    live.advance()
    assert live.simulator.model.opt.gravity.tolist() == [0.0, 0.0, 0.0]
