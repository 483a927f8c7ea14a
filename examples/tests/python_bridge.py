"""examples/libmapper_bridge.py between OSC and a second libmapper device on loopback. Run by python_examples.py."""

import itertools
import math
import pathlib
import random
import re
import signal
import socket
import struct
import subprocess
import sys
import threading
import time

from pythonosc.osc_bundle_builder import IMMEDIATELY, OscBundleBuilder
from pythonosc.osc_message_builder import OscMessageBuilder

ROOT = pathlib.Path(__file__).resolve().parents[2]
BRIDGE = ROOT / "examples/libmapper_bridge.py"
sys.path.insert(0, str(BRIDGE.parent))
import libmapper_bridge  # noqa: E402

# Generous: two slow cores may have other work.
PATIENCE_S = 60.0


def loopback():
    return next(name for _, name in socket.if_nameindex() if name in ("lo", "lo0"))


def bundle(**fields):
    builder = OscBundleBuilder(IMMEDIATELY)
    for name, value in fields.items():
        message = OscMessageBuilder(f"/chalumeau/feel/{name}")
        message.add_arg(value, "f")
        builder.add_content(message.build())
    return builder.build().dgram


# A libmapper device as TorqueTuner's upstream firmware declares it, wrong ranges included: its name and network are the
# arguments, what it receives goes to standard output. A process of its own, as libmapper 2.6.1 may crash when a device
# is freed whose peer has just left.
KNOB = """
import signal, sys
import libmapper

graph = libmapper.Graph()
graph.set_interface(sys.argv[2])
device = libmapper.Device(sys.argv[1], graph)

def heard(its, event, instance, value, when):
    if value is not None:
        print(its[libmapper.Property.NAME], value, flush=True)

kept = [
    device.add_signal(
        libmapper.Signal.Direction.INCOMING, name, 1, libmapper.Type.FLOAT, "", -most, most, None, heard
    )
    for name, most in (("Scale", 230.0), ("Stretch", 30.0), ("Offset", 1800.0), ("Damping", 1800.0))
]
stop = []
signal.signal(signal.SIGTERM, lambda *_: stop.append(True))
while not stop:
    device.poll(10)
device.free()
"""


class Knob:
    """The device, and what it has received."""

    def __init__(self, name):
        self.process = subprocess.Popen(
            [sys.executable, "-u", "-c", KNOB, name, loopback()], stdout=subprocess.PIPE, text=True
        )
        self.got = []
        self.thread = threading.Thread(target=self.read)
        self.thread.start()

    def read(self):
        for line in self.process.stdout:
            name, value = line.split()
            self.got.append((name, float(value)))

    def last(self, name):
        return next((value for found, value in reversed(list(self.got)) if found == name), None)

    def close(self):
        self.process.terminate()
        self.process.wait(PATIENCE_S)
        self.thread.join()


class Bridge:
    """The program, its words, and a socket to it."""

    def __init__(self, *args):
        options = ["--listen", "127.0.0.1:0", "--interface", loopback(), *args]
        self.process = subprocess.Popen(
            [sys.executable, "-u", BRIDGE, *options], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        self.said = []
        self.thread = threading.Thread(target=lambda: self.said.extend(iter(self.process.stdout.readline, "")))
        self.thread.start()
        wait(lambda: any("feel from" in line for line in self.said), "the bridge to start", self)
        port = int(re.search(r"feel from .*:(\d+);", "".join(self.said)).group(1))
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.connect(("127.0.0.1", port))

    def send(self, datagram):
        self.socket.send(datagram)

    def resident_kib(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status")
        return int(re.search(r"VmRSS:\s+(\d+)", status.read_text()).group(1))

    def interrupt(self, how=signal.SIGINT):
        self.process.send_signal(how)
        code = self.process.wait(PATIENCE_S)
        self.thread.join()
        self.socket.close()
        return code

    def kill(self):
        """For the end of a test that has not come to interrupting it."""
        self.process.kill()
        self.thread.join()
        self.socket.close()

    def __str__(self):
        return "the bridge said:\n" + "".join(self.said)


def wait(condition, what, bridge, again=lambda: None):
    end = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < end, f"waited in vain for {what}; {bridge}"
        again()
        time.sleep(0.05)


def close(found, wanted):
    return found is not None and abs(found - wanted) <= 1e-4 * max(1.0, abs(wanted))


PLAYED = {"scale": 60.0, "stretch": 1.5, "offset": -12.0, "damping": 2.0, "H": 2.6, "k": 0.4}


def mapped(name):
    """A knob, a bridge mapped to it, and a feel that has arrived."""
    knob = Knob(name)
    try:
        bridge = Bridge("--map", name, "--name", f"{name}Host")
        # The plugin may have sent for a while before there is a map.
        for _ in range(10):
            bridge.send(bundle(**PLAYED))
            time.sleep(0.05)
    except BaseException:
        knob.close()
        raise
    wait(lambda: any("Scale, Stretch, Offset, Damping" in line for line in bridge.said), "the maps", bridge)
    # The scale rises, and a first value may be lost while a map is being made.
    arrived = lambda: close(knob.last("Scale"), 12.48)  # noqa: E731
    wait(arrived, "the scale", bridge, lambda: bridge.send(bundle(**PLAYED)))
    return knob, bridge


def feel_reaches_a_torquetuner_in_its_units():
    knob, bridge = mapped("ChalumeauTestA")
    try:
        # 208 counts for 1 N m: 60 mNm are 12.48; degrees in tenths; 2 mNm s/rad are 2 x 0.208 x 2 pi / 60 a rpm.
        for name, wanted in (("Stretch", 1.5), ("Offset", -120.0), ("Damping", 2 * 0.208 * 2 * math.pi / 60)):
            wait(lambda: close(knob.last(name), wanted), name, bridge)
        scales = [value for name, value in knob.got if name == "Scale"]
        assert len(scales) > 3 and scales[0] < 6, f"no jump from nothing to 60 mNm: {scales[:5]}"
        # The same feel again goes out again, for a knob whose mode has changed.
        count = len(knob.got)
        wait(lambda: len(knob.got) >= count + 4, "the repetition", bridge, lambda: bridge.send(bundle(**PLAYED)))
        # Lower comes at once.
        bridge.send(bundle(scale=20.0))
        wait(lambda: close(knob.last("Scale"), 4.16), "the lower scale", bridge)
        code = bridge.interrupt()
        wait(lambda: (knob.last("Scale"), knob.last("Damping")) == (0, 0), "torque off after Ctrl-C", bridge)
    finally:
        bridge.kill()
        knob.close()
    assert code == 0, bridge


def every_end_but_a_kill_switches_torque_off():
    ends = [signal.SIGTERM, *([signal.SIGHUP] if hasattr(signal, "SIGHUP") else [])]
    for number, how in enumerate(ends):
        knob, bridge = mapped(f"ChalumeauTestF{number}")
        try:
            code = bridge.interrupt(how)
            off = lambda: (knob.last("Scale"), knob.last("Damping")) == (0, 0)  # noqa: E731
            wait(off, f"torque off after {how.name}", bridge)
        finally:
            bridge.kill()
            knob.close()
        assert code == 0, bridge


def an_error_switches_torque_off():
    """What cannot happen, happens: the program stumbles over a datagram."""
    said = []

    class Signals:
        graph = type("Graph", (), {"interface": "none"})

        def __init__(self, *_):
            pass

        def name(self):
            return "double"

        def send(self, values):
            said.append(values)

        def free(self):
            said.append("free")

    kept = libmapper_bridge.Signals, libmapper_bridge.serve, sys.argv
    handlers = {name: signal.getsignal(getattr(signal, name)) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)}

    def stumble(*_):
        raise RuntimeError("stumbled")

    libmapper_bridge.Signals, libmapper_bridge.serve = Signals, stumble
    sys.argv = ["libmapper_bridge.py", "--listen", "127.0.0.1:0"]
    try:
        libmapper_bridge.main()
        raise AssertionError("the error is told")
    except RuntimeError:
        pass
    finally:
        libmapper_bridge.Signals, libmapper_bridge.serve, sys.argv = kept
        for name, handler in handlers.items():
            signal.signal(getattr(signal, name), handler)
    assert said == [dict.fromkeys(libmapper_bridge.TORQUE, 0.0), "free"], said


def torque_rises_by_400_mnm_a_second():
    limits = libmapper_bridge.limits_for(100.0, libmapper_bridge.torquetuner(208.0))
    bridge = libmapper_bridge.Bridge(limits)
    bridge.take(bundle(**PLAYED), 0.0)
    wanted, sent, turns = bridge.scale["wanted"], 0.0, 0
    assert wanted > 40
    while sent < wanted:
        now = bridge.due(0.01 * turns, 0.01)["scale"]
        assert sent < now <= sent + 4.0 + 1e-9 and turns < 100, (sent, now)
        sent, turns = now, turns + 1
    # A program that stood still for a second goes on as slowly.
    bridge.off()
    bridge.take(bundle(**PLAYED), 1.0)
    assert abs(bridge.due(1.0, 1.0)["scale"] - 20.0) < 1e-9


def what_chalumeau_says_at_the_end_is_passed_on_at_once():
    """The bundle that Chalumeau sends when the knob is let go, as crates/knob/src/device/feel_osc.rs makes it."""
    limits = libmapper_bridge.limits_for(100.0, libmapper_bridge.torquetuner(208.0))
    bridge = libmapper_bridge.Bridge(limits)
    bridge.take(bundle(**PLAYED), 0.0)
    bridge.due(0.01, 1.0)
    off = {"scale": 0.0, "wall_mnm_per_deg": 0.0, "slap_mnm_per_deg": 0.0, "damping": 0.0, "friction": 0.0, "detent": 0.0}
    assert set(libmapper_bridge.TORQUE) == set(off)
    bridge.take(bundle(**PLAYED | off), 0.02)
    due = bridge.due(0.03, 0.01)
    assert bridge.refused == 0 and {name: due[name] for name in off} == off, due


def silence_switches_torque_off():
    knob, bridge = mapped("ChalumeauTestB")
    try:
        wait(lambda: knob.last("Scale") == 0 and knob.last("Damping") == 0, "torque off", bridge)
        assert any("no feel for 3 s" in line for line in bridge.said), bridge
        assert close(knob.last("Stretch"), 1.5), "what makes no torque stays"
        wait(lambda: close(knob.last("Scale"), 12.48), "the feel back", bridge, lambda: bridge.send(bundle(**PLAYED)))
        code = bridge.interrupt()
    finally:
        bridge.kill()
        knob.close()
    assert code == 0, bridge


def a_knob_that_comes_back_is_mapped_again():
    knob, bridge = mapped("ChalumeauTestC")
    try:
        knob.close()
        knob = Knob("ChalumeauTestC")
        arrived = lambda: close(knob.last("Scale"), 12.48)  # noqa: E731
        wait(arrived, "the scale at the new knob", bridge, lambda: bridge.send(bundle(**PLAYED)))
        scales = [value for name, value in knob.got if name == "Scale"]
        assert scales[0] < 6, f"no jump from nothing to 60 mNm: {scales[:5]}"
        code = bridge.interrupt()
    finally:
        bridge.kill()
        knob.close()
    assert code == 0, bridge


def what_is_out_of_range_is_refused_whole():
    knob, bridge = mapped("ChalumeauTestD")
    try:
        for fields, said in (
            ({"stretch": 3.0, "scale": 160.0}, "scale must lie in 0..100 mNm (--ceiling), got 160"),
            ({"stretch": 3.0, "offset": 200.0}, "(Offset takes -1800..1800), got 200"),
            ({"stretch": 3.0, "H": math.nan}, "H must lie in 0.5..10, got nan"),
            ({"stretch": 3.0, "k": math.inf}, "k must lie in 0.01..20, got inf"),
        ):
            def again(fields=fields):
                bridge.send(bundle(**fields))

            wait(lambda: any(said in line for line in bridge.said), said, bridge, again)
        bridge.send(bundle(**PLAYED))
        wait(lambda: close(knob.last("Scale"), 12.48), "the feel", bridge, lambda: bridge.send(bundle(**PLAYED)))
        stretches = {round(value, 3) for name, value in knob.got if name == "Stretch"}
        assert stretches == {1.5}, f"nothing of a refused feel is passed on: {stretches}"
        code = bridge.interrupt()
    finally:
        bridge.kill()
        knob.close()
    assert code == 0, bridge


def hostile(random_):
    """Packets that are not feels: noise, damaged feels, lengths that lie, bundles in bundles."""
    good = bundle(**PLAYED)
    head = b"#bundle\0" + struct.pack(">Q", 1)
    nested = good
    for _ in range(60):
        nested = head + struct.pack(">I", len(nested)) + nested
    yield from (
        b"", head, head + b"\0", head + struct.pack(">i", -4) + b"/abc", head + struct.pack(">i", -1),
        head + struct.pack(">I", 0x7FFFFFFF), head + struct.pack(">I", 0) * 500, nested, good + bytes(5000),
        head + struct.pack(">I", 8) + b"/a\0\0,[[[",
        b"/chalumeau/feel/scale\0\0\0,s\0\0loud\0\0\0\0",
        b"/chalumeau/feel/scale\0\0\0,f\0\0", b"/chalumeau/feel/scale\0\0\0",
        b"/chalumeau/feel/\xff\xfe\0\0,f\0\0\0\0\0\0",
        b"/chalumeau/feel/scale\0\0\0,T\0\0", b"/chalumeau/feel/scale\0\0\0,ff\0" + bytes(8),
        b"/other\0\0,f\0\0\0\0\0\0",
    )
    while True:
        kind = random_.random()
        if kind < 0.3:
            yield random_.randbytes(random_.randrange(200))
        elif kind < 0.9:
            damaged = bytearray(good)
            for _ in range(random_.randrange(1, 6)):
                damaged[random_.randrange(len(damaged))] = random_.randrange(256)
            # What still is a feel is passed on, and rightly so; here to fields that no map follows.
            yield bytes(damaged).replace(b"/chalumeau/feel/s", b"/chalumeau/feel/H").replace(b"/d", b"/x")
        else:
            yield good[: random_.randrange(len(good))].replace(b"/feel/", b"/heel/")


def packets_of_any_kind_do_no_harm_to_the_decoder():
    limits = libmapper_bridge.limits_for(100.0, libmapper_bridge.torquetuner(208.0))
    good = bundle(scale=60.0)
    assert libmapper_bridge.feel_of(good, limits) == {"scale": 60.0}
    for lie in (-4, len(good), 0x7FFFFFFF):
        try:
            feel = libmapper_bridge.feel_of(good[:16] + struct.pack(">i", lie) + good[20:], limits)
        except libmapper_bridge.Refused:
            continue
        raise AssertionError(f"a length of {lie} is believed: {feel}")
    began, random_ = time.process_time(), random.Random(3)
    taken = refused = 0
    for packet in itertools.islice(hostile(random_), 50_000):
        try:
            feel = libmapper_bridge.feel_of(packet, limits)
        except libmapper_bridge.Refused:
            refused += 1
            continue
        taken += 1
        for name, value in feel.items():
            low, high, _ = limits[name]
            assert low <= value <= high, (name, value, packet)
    assert taken > 100 and refused > 10_000, (taken, refused)
    assert time.process_time() - began < PATIENCE_S, "no packet holds it up"


def a_flood_is_survived():
    knob, bridge = mapped("ChalumeauTestE")
    try:
        before_kib = bridge.resident_kib() if sys.platform == "linux" else 0
        calm = bundle(**PLAYED)
        random_ = random.Random(4)
        odd = list(itertools.islice(hostile(random_), 2000))
        count, lines = len(knob.got), len(bridge.said)
        began = time.monotonic()
        packets = 0
        while packets < 100_000 or time.monotonic() - began < 5.0:
            try:
                bridge.send(odd[packets % len(odd)] if packets % 2 else calm)
            except OSError:
                # Packets larger or faster than this system takes.
                pass
            packets += 1
        seconds = time.monotonic() - began
        passed_on = (len(knob.got) - count) / seconds
        low = bundle(scale=20.0)
        wait(lambda: close(knob.last("Scale"), 4.16), "a feel after it", bridge, lambda: bridge.send(low))
        print(f"    {packets} packets in {seconds:.1f} s; {passed_on:.0f} values a second passed on", flush=True)
        # A hundred feels a second at most, four of whose fields are mapped; twice that for what was on its way.
        assert passed_on < 800, passed_on
        assert len(bridge.said) - lines < 10 + 2 * (time.monotonic() - began), bridge
        if sys.platform == "linux":
            grown_kib = bridge.resident_kib() - before_kib
            assert grown_kib < 20_000, f"grew by {grown_kib} KiB"
        code = bridge.interrupt()
    finally:
        bridge.kill()
        knob.close()
    assert code == 0, bridge


def what_the_bridge_cannot_do_is_said():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        busy = f"127.0.0.1:{taken.getsockname()[1]}"
        for args, said in (
            (["--listen", busy], "cannot listen on"),
            (["--listen", "9001"], "must be ADDRESS:PORT"),
            (["--ceiling", "300"], "must lie in 0..250, got 300"),
            (["--ceiling", "nan"], "must lie in 0..250, got nan"),
            (["--listen", "127.0.0.1:0", "--interface", "nosuch0"], "--interface nosuch0"),
        ):
            told = subprocess.run(
                [sys.executable, BRIDGE, *args], capture_output=True, text=True, check=False, timeout=PATIENCE_S
            )
            assert told.returncode == 2 and said in told.stderr and "Traceback" not in told.stderr, (args, told.stderr)


def fields_are_those_that_are_sent():
    source = (ROOT / "crates/knob/src/device/feel_osc.rs").read_text()
    sent = re.findall(r'^\s*\("(\w+)", ', source, re.MULTILINE)
    assert list(libmapper_bridge.FIELDS) == sent and f'"{libmapper_bridge.PREFIX}{{name}}"' in source, sent


TESTS = [
    fields_are_those_that_are_sent,
    packets_of_any_kind_do_no_harm_to_the_decoder,
    what_the_bridge_cannot_do_is_said,
    feel_reaches_a_torquetuner_in_its_units,
    every_end_but_a_kill_switches_torque_off,
    an_error_switches_torque_off,
    torque_rises_by_400_mnm_a_second,
    what_chalumeau_says_at_the_end_is_passed_on_at_once,
    silence_switches_torque_off,
    a_knob_that_comes_back_is_mapped_again,
    what_is_out_of_range_is_refused_whole,
    a_flood_is_survived,
]
