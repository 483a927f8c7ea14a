// Web MIDI: every input plays. The core decodes the messages; here only notes are followed, because hands share them.

export class Midi {
  /** `on` gets { inputs: names } when devices come and go, and { message: bytes } for the lamp. */
  constructor(hands, send, on) {
    Object.assign(this, { hands, send, on, count: 0 });
  }

  static get isHere() {
    return 'requestMIDIAccess' in navigator;
  }

  async open() {
    this.access = await navigator.requestMIDIAccess();
    this.access.onstatechange = () => this.listen();
    this.listen();
  }

  listen() {
    const inputs = [...this.access.inputs.values()].filter((input) => input.state !== 'disconnected');
    inputs.forEach((input) => (input.onmidimessage = ({ data }) => this.hear(data)));
    // A device that was unplugged does not tell that its keys have come up.
    if (inputs.length < this.count) this.hands.releaseAll();
    this.count = inputs.length;
    this.on({ inputs: inputs.map((input) => input.name ?? 'MIDI') });
  }

  hear([status, first, second]) {
    const [kind, channel] = [status & 0xf0, status & 0x0f];
    if (status < 0x80 || status >= 0xf0 || first === undefined) return;
    this.on({ message: status });
    if (kind === 0x90 && second > 0) this.hands.press(first, second, channel);
    else if (kind === 0x80 || kind === 0x90) this.hands.release(first, channel);
    else this.send({ midi: [status, first, second ?? 0] });
  }
}
