#!/usr/bin/env python3
"""Bridges the feel that Chalumeau sends as OSC to libmapper signals.

    python libmapper_bridge.py --interface wlan0                          signals only, map them as you like
    python libmapper_bridge.py --interface wlan0 --map TorqueTuner_001    also drives a TorqueTuner

When the plugin's parameter Feel OSC port is 9001, Chalumeau sends each field of a feel as a float to
/chalumeau/feel/<field>, all in one bundle, on change and once a second. This program makes every field the output
signal feel/<field> of the libmapper device `chalumeau`, with its unit and range. Needs libmapper and python-osc.

--map makes maps to the signals of TorqueTuner's upstream firmware (the reed firmware has none):

    feel/scale    mNm         Scale    counts              x counts_per_nm / 1000
    feel/stretch              Stretch                      x 1
    feel/offset   degrees     Offset   0.1 degrees         x 10
    feel/damping  mNm s/rad   Damping  counts per rpm      x counts_per_nm / 1000 x 2 pi / 60

NOT TRIED ON HARDWARE; all of this was read from public sources. For the moteus board 208 counts are 1 N m, and its
firmware clips torque at 0.1 N m (20.8 counts). For the Mechaduino board 208 counts are 1.8 A; the torque is not
documented. The firmware has no reed law: Scale and Stretch act on the curve of the current mode, and Offset only when a
mode begins. In its mode Free, Scale is a constant torque that spins the knob: choose the mode before you start this
program. That firmware has no watchdog and no torque limit. This program therefore sends no scale, friction or detent above
--ceiling; raises Scale from 0 by at most 400 mNm a second once the map is made; and sets every field that makes torque to 0
when Chalumeau says so (it sends a feel only while Arm is on), when no feel has arrived for 3 seconds, and at the end of this
program (Ctrl-C, a closed terminal, an error). The wall and the slap region are stiffnesses: if you map them to a firmware of
your own, that firmware must limit their torque. If this program is killed, or its machine or the network fails, the knob keeps the last torque: keep its power switch
at hand. A knob that comes back is mapped again; one that vanished without logging off only after libmapper has dropped
it, which takes half a minute.

A datagram with a value outside its range is refused as a whole, with the reason. Exit code 0: ended by the user; 2: the
request cannot be met, and the message says why.
"""

import argparse
import logging
import math
import select
import signal
import socket
import struct
import sys
import time

try:
    import libmapper
    from pythonosc.osc_message import OscMessage, ParseError
except ImportError as reason:
    sys.exit(f"libmapper_bridge: {reason}; install it: python -m pip install libmapper python-osc")

# python-osc logs a line for every bad packet; a flood of packets would flood the log.
logging.disable(logging.WARNING)

PREFIX = "/chalumeau/feel/"
# Unit and range of each field, as in docs/protocol.md (friction and detent in mNm here).
FIELDS = {
    "law": ("", 0, 2),
    "morph_ms": ("ms", 20, 1000),
    "H": ("", 0.5, 10),
    "k": ("", 0.01, 20),
    "scale": ("mNm", 0, 450),
    "stretch": ("", 0.1, 30),
    "offset": ("degrees", -360, 360),
    "a_on": ("degrees", 0, 3600),
    "a_off": ("degrees", 0, 36_000),
    "a_beat": ("degrees", 0, 3600),
    "wall": ("degrees", 10, 36_000),
    "wall_mnm_per_deg": ("mNm/degree", 0, 100),
    "slap_mnm_per_deg": ("mNm/degree", 0, 20),
    "damping": ("mNm s/rad", 0, 20),
    "friction": ("mNm", 0, 100),
    "detent": ("mNm", 0, 100),
}
# Fields that make torque by themselves; they go to 0 when no feel arrives.
TORQUE = ("scale", "wall_mnm_per_deg", "slap_mnm_per_deg", "damping", "friction", "detent")
# TorqueTuner's signals: name, field, factor, and range.
RPM_PER_RAD_S = 60 / (2 * math.pi)
COUNTS_PER_NM = 208.0


def torquetuner(counts_per_nm):
    per_mnm = counts_per_nm / 1000
    return {
        "Scale": ("scale", per_mnm, -230, 230),
        "Stretch": ("stretch", 1.0, 0, 30),
        "Offset": ("offset", 10.0, -1800, 1800),
        "Damping": ("damping", per_mnm / RPM_PER_RAD_S, -1, 1),
    }


# Shortest time between two updates of the signals: Chalumeau sends at most 100 feels a second.
TURN_S = 0.01
# Most datagrams read in one turn; in a flood, the system drops the rest.
MOST_DATAGRAMS = 256
# A feel is about 500 bytes.
MOST_BYTES = 4096
MOST_DEPTH = 4
# Three repetitions missed.
SILENCE_S = 3.0
# From 0 to the default ceiling in 250 ms, the time in which a knob arms.
RISE_MNM_S = 400.0
# A turn counts as no longer than this: a program that was suspended does not make up for it.
LONGEST_TURN_S = 0.05
# libmapper looks for a free name for about a second.
READY_S = 15.0
CEILING_MNM = (100.0, 250.0)


class Refused(Exception):
    """A refused datagram; the text says why."""


def elements(datagram, depth=0):
    """The OSC messages of a datagram. Raises Refused.

    Bundles are parsed here, because python-osc 1.10 never returns from a bundle with an element of negative length.
    """
    if not datagram.startswith(b"#bundle\0"):
        yield datagram
        return
    if depth == MOST_DEPTH:
        raise Refused(f"bundles in bundles, more than {MOST_DEPTH} deep")
    # The time tag is ignored: a feel is valid at once.
    at = 16
    while at < len(datagram):
        if at + 4 > len(datagram):
            raise Refused("a bundle that ends within a length")
        (length,) = struct.unpack_from(">I", datagram, at)
        at += 4
        if length > len(datagram) - at:
            raise Refused("a bundle whose element is longer than the bundle")
        yield from elements(datagram[at : at + length], depth + 1)
        at += length


def feel_of(datagram, limits):
    """The fields of a datagram by name, without unknown addresses. Raises Refused."""
    if len(datagram) > MOST_BYTES:
        raise Refused(f"more than {MOST_BYTES} bytes")
    feel = {}
    for element in elements(datagram):
        try:
            message = OscMessage(element)
        except (ParseError, ValueError, IndexError, struct.error) as reason:
            raise Refused(f"no OSC: {reason}") from reason
        name = message.address.removeprefix(PREFIX)
        if name == message.address or name not in FIELDS:
            continue
        value = message.params[0] if len(message.params) == 1 else None
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise Refused(f"{name} must be one number, got {message.params}")
        low, high, why = limits[name]
        # NaN is outside every range.
        if not low <= value <= high:
            unit = f" {FIELDS[name][0]}" if FIELDS[name][0] else ""
            raise Refused(f"{name} must lie in {low:g}..{high:g}{unit}{why}, got {value:g}")
        feel[name] = float(value)
    return feel


def limits_for(ceiling_mnm, targets):
    """Range of each field, with the reason if it is narrower than the range in the protocol."""
    limits = {name: (low, high, "") for name, (_, low, high) in FIELDS.items()}
    for signal_name, (field, factor, low, high) in targets.items():
        least, most, _ = limits[field]
        if low / factor > least or high / factor < most:
            why = f" ({signal_name} takes {low:g}..{high:g})"
            limits[field] = (max(least, low / factor), min(most, high / factor), why)
    for name in ("scale", "friction", "detent"):
        low, most, _ = limits[name]
        if ceiling_mnm < most:
            limits[name] = (low, ceiling_mnm, " (--ceiling)")
    return limits


class Signals:
    """The libmapper device and its signals."""

    def __init__(self, name, interface):
        self.graph = libmapper.Graph()
        if interface:
            self.graph.set_interface(interface)
            if self.graph.interface != interface:
                raise SystemExit(
                    f"libmapper_bridge: --interface {interface}: libmapper cannot use it, it took "
                    f"{self.graph.interface}; give one that is up and carries multicast"
                )
        self.device = libmapper.Device(name, self.graph)
        outgoing, kind = libmapper.Signal.Direction.OUTGOING, libmapper.Type.FLOAT
        self.signals = {
            field: self.device.add_signal(outgoing, f"feel/{field}", 1, kind, unit, float(low), float(high))
            for field, (unit, low, high) in FIELDS.items()
        }
        began = time.monotonic()
        while not self.device.ready:
            self.device.poll(50)
            if time.monotonic() - began > READY_S:
                raise SystemExit(
                    f"libmapper_bridge: libmapper got no place on {self.graph.interface} within {READY_S:.0f} s; "
                    "give a network that carries multicast with --interface"
                )

    def name(self):
        return self.device[libmapper.Property.NAME]

    def send(self, values):
        for field, value in values.items():
            self.signals[field].set_value(value)
        self.device.poll(0)

    def free(self):
        # Long enough to send the last values.
        for _ in range(20):
            self.device.poll(10)
        self.device.free()


class Wiring:
    """Makes the maps to a device whenever the device is present."""

    def __init__(self, ours, wanted, targets):
        self.ours, self.wanted, self.targets = ours, wanted, targets
        self.said = None

    def say(self, text):
        if text != self.said:
            print(text, flush=True)
            self.said = text

    def matches(self, name):
        # libmapper appends a number: TorqueTuner_001 becomes TorqueTuner_001.1.
        return name == self.wanted or name.rpartition(".")[0] == self.wanted

    def is_felt(self):
        """Whether a map of the scale is ready: what is sent makes torque."""
        return any(one.ready for one in self.ours.signals["scale"].maps())

    def look(self):
        """Looks for the device and makes missing maps; call it about once a second. Whether Scale is mapped."""
        prop = libmapper.Property
        # A device that has gone may stay listed for a while, without signals.
        devices = {}
        for theirs in self.ours.graph.signals():
            device, name = theirs.device()[prop.NAME], theirs[prop.NAME]
            is_input = theirs[prop.DIRECTION] == libmapper.Signal.Direction.INCOMING
            if self.matches(device) and is_input and name in self.targets:
                devices.setdefault(device, {})[name] = theirs
        names = sorted(devices)
        if not names:
            self.say(f"waiting for {self.wanted} and its {', '.join(self.targets)}")
            return False
        if len(names) > 1:
            self.say(f"--map {self.wanted} may be {' or '.join(names)}: nothing new is mapped; name one of them")
            return self.is_felt()
        found = devices[names[0]]
        mapped = {
            theirs[prop.NAME]
            for own in self.ours.signals.values()
            for one in own.maps()
            for theirs in one.signals(libmapper.Map.Location.DESTINATION)
            if theirs.device()[prop.NAME] == names[0] and one.ready
        }
        for name, (field, factor, _, _) in self.targets.items():
            if name in found and name not in mapped:
                # The factor is explicit: the ranges a device declares are no guide (upstream's Damping declares +-1800).
                libmapper.Map(f"%y=%x*{factor:.9g}", found[name], self.ours.signals[field]).push()
        missing = [name for name in self.targets if name not in found]
        done = [name for name in self.targets if name in mapped]
        lacks = f"; it has no {', '.join(missing)}" if missing else ""
        self.say(f"mapped to {names[0]}: {', '.join(done) or 'nothing yet'}{lacks}")
        return self.is_felt()


class Bridge:
    """The last values received, and those still to be sent."""

    def __init__(self, limits):
        self.limits = limits
        self.fresh = {}
        self.scale = {"wanted": 0.0, "sent": 0.0}
        # Without a map nobody feels what is sent: it stays 0, so that the torque rises slowly once there is one.
        self.is_felt = True
        self.heard_at = None
        self.taken = self.ignored = self.refused = 0
        self.said_at = -math.inf

    def take(self, datagram, now_s):
        try:
            feel = feel_of(datagram, self.limits)
        except Refused as refusal:
            self.refused += 1
            # A flood of packets must not fill the terminal.
            if now_s - self.said_at >= 1.0:
                print(f"refused: {refusal}", flush=True)
                self.said_at = now_s
            return
        if not feel:
            self.ignored += 1
            return
        self.taken += 1
        self.heard_at = now_s
        self.scale["wanted"] = feel.pop("scale", self.scale["wanted"])
        # Repeated values are sent again: a TorqueTuner forgets its values when its mode changes.
        self.fresh |= feel | {"scale": None}

    def due(self, now_s, dt_s):
        """Values to send now."""
        if self.heard_at is not None and now_s - self.heard_at > SILENCE_S:
            print(f"no feel for {SILENCE_S:.0f} s: torque off until it comes back", flush=True)
            return self.off()
        rising = self.scale["wanted"] > self.scale["sent"]
        values, self.fresh = self.fresh, {}
        if "scale" in values or rising:
            sent = min(self.scale["wanted"], self.scale["sent"] + RISE_MNM_S * min(dt_s, LONGEST_TURN_S)) if self.is_felt else 0.0
            self.scale["sent"] = values["scale"] = sent
        return values

    def off(self):
        self.scale = {"wanted": 0.0, "sent": 0.0}
        self.heard_at, self.fresh = None, {}
        return dict.fromkeys(TORQUE, 0.0)


def address(text):
    host, _, port = text.rpartition(":")
    if not host or not port.isdigit() or int(port) > 65_535:
        raise argparse.ArgumentTypeError(f"must be ADDRESS:PORT such as 127.0.0.1:9001, got {text}")
    return host, int(port)


def within(low, high):
    def parse(text):
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"must lie in {low:g}..{high:g}, got {text}")
        return value

    return parse


def arguments():
    words, _, rest = __doc__.partition("\n")
    parser = argparse.ArgumentParser(
        description=words, epilog=rest, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--listen", type=address, default=("127.0.0.1", 9001), metavar="ADDRESS:PORT",
        help="address to receive the feel; port 0 lets the system choose [default: 127.0.0.1:9001, this machine only]",
    )
    parser.add_argument("--interface", metavar="NAME", help="network interface for libmapper [default: libmapper's choice]")
    parser.add_argument("--name", default="chalumeau", metavar="NAME", help="name of our device [default: chalumeau]")
    parser.add_argument("--map", metavar="DEVICE", help="libmapper name of the TorqueTuner to drive")
    default, most = CEILING_MNM
    parser.add_argument(
        "--ceiling", type=within(0, most), default=default, metavar="MNM",
        help=f"largest scale, friction and detent that are passed on, mNm, 0..{most:g} [default: {default:g}]",
    )
    parser.add_argument(
        "--counts-per-nm", type=within(1, 10_000), default=COUNTS_PER_NM, metavar="N",
        help=f"torque counts of the TorqueTuner for 1 N m [default: {COUNTS_PER_NM:g}, not verified]",
    )
    return parser.parse_args()


def main():
    args = arguments()
    stop = []
    # A terminal that is closed sends SIGHUP; Windows has none.
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), lambda *_: stop.append(True))
    targets = torquetuner(args.counts_per_nm) if args.map else {}
    bridge = Bridge(limits_for(args.ceiling, targets))
    family = socket.AF_INET6 if ":" in args.listen[0] else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as receiver:
        try:
            receiver.bind((args.listen[0].strip("[]"), args.listen[1]))
        except OSError as reason:
            print(f"libmapper_bridge: cannot listen on {':'.join(map(str, args.listen))}: {reason}", file=sys.stderr)
            return 2
        receiver.setblocking(False)
        try:
            signals = Signals(args.name, args.interface)
        except SystemExit as reason:
            print(reason, file=sys.stderr)
            return 2
        host, port = receiver.getsockname()[:2]
        wiring = Wiring(signals, args.map, targets) if args.map else None
        try:
            print(f"{signals.name()} on {signals.graph.interface}, feel from {host}:{port}; Ctrl-C ends", flush=True)
            serve(receiver, signals, bridge, wiring, stop)
        finally:
            # However it ends, also where the terminal is gone and printing fails.
            signals.send(bridge.off())
            signals.free()
    print(f"\n{bridge.taken} feels passed on, {bridge.refused} refused, {bridge.ignored} ignored")
    return 0


def serve(receiver, signals, bridge, wiring, stop):
    """Receives and sends until `stop` is not empty."""
    sent_at = looked_at = time.monotonic()
    bridge.is_felt = wiring is None
    while not stop:
        select.select([receiver], [], [], TURN_S)
        for _ in range(MOST_DATAGRAMS):
            try:
                datagram = receiver.recv(MOST_BYTES + 1)
            except OSError:
                # No more data, or an error that an earlier sender's machine returned.
                break
            bridge.take(datagram, time.monotonic())
        now = time.monotonic()
        if now - sent_at >= TURN_S:
            signals.send(bridge.due(now, now - sent_at))
            sent_at = now
        if wiring and now - looked_at >= 1.0:
            bridge.is_felt = wiring.look()
            looked_at = now


if __name__ == "__main__":
    sys.exit(main())
