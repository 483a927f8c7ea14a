// What hands do: keys of a computer, of the screen and of MIDI instruments come together here, and go on as MIDI.
//
// While the microphone is open a key only fingers: its note stays when the key comes up, as on a clarinet, and the breath
// plays it.

/** Sounding G4 of a B flat clarinet with no finger down: written G4. */
const OPEN_WRITTEN = 67;

export class Hands {
  constructor(send) {
    this.send = send;
    /** Held keys by channel and note, the oldest first: one note may be held on two channels. */
    this.held = new Map();
    /** The note that stays under the fingers while the microphone blows, and its channel. */
    this.fingered = null;
    this.isBlown = false;
  }

  press(note, velocity, channel = 0) {
    const key = keyOf(note, channel);
    this.held.delete(key);
    this.held.set(key, { note, channel });
    this.send({ midi: [0x90 | channel, note, velocity] });
    const { fingered } = this;
    this.fingered = null;
    if (fingered && keyOf(fingered.note, fingered.channel) !== key) this.end(fingered);
  }

  release(note, channel = 0) {
    if (!this.held.delete(keyOf(note, channel))) return;
    if (this.isBlown && this.held.size === 0) this.fingered = { note, channel };
    else this.end({ note, channel });
  }

  releaseAll() {
    [...this.held.values()].forEach(({ note, channel }) => this.release(note, channel));
  }

  end({ note, channel }) {
    this.send({ midi: [0x80 | channel, note, 0] });
  }

  /** The microphone blows, or blows no more. */
  blow(on, transposition) {
    this.isBlown = on;
    if (on && this.held.size === 0 && this.fingered === null) {
      const note = this.last ?? OPEN_WRITTEN - transposition;
      this.fingered = { note, channel: 0 };
      this.send({ midi: [0x90, note, 80] });
    }
    if (!on && this.fingered !== null) {
      this.last = this.fingered.note;
      this.end(this.fingered);
      this.fingered = null;
    }
  }

  silence() {
    this.held.clear();
    this.fingered = null;
    this.send({ silence: true });
    this.send({ breath: null });
  }
}

function keyOf(note, channel) {
  return (channel << 7) | note;
}
