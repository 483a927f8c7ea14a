// What hands do: keys of a computer, of the screen and of MIDI instruments come together here, and go on as MIDI.
//
// While the microphone is open a key only fingers: its note stays when the key comes up, as on a clarinet, and the breath
// plays it.

/** Written G4: no finger down. */
const OPEN_WRITTEN = 67;
const VELOCITY = 80;

export class Hands {
  constructor(send) {
    this.send = send;
    /** Held keys by channel and note, the oldest first: one note may be held on two channels. Each ends with the last who holds it. */
    this.held = new Map();
    /** The note that stays under the fingers while the microphone blows, and its channel. */
    this.fingered = null;
    this.isBlown = false;
  }

  /** `who` holds the key: a letter, a pointer, a MIDI input. */
  press(note, velocity, who, channel = 0) {
    const key = keyOf(note, channel);
    const before = this.held.get(key);
    const holders = before?.holders ?? new Set();
    holders.add(who);
    this.held.delete(key);
    this.held.set(key, { note, channel, holders });
    const { fingered } = this;
    this.fingered = null;
    // The instrument counts how often a key goes down and comes up.
    if (before) this.end({ note, channel });
    const isFingered = fingered !== null && keyOf(fingered.note, fingered.channel) === key;
    if (!isFingered) this.send({ midi: [0x90 | channel, note, velocity] });
    if (fingered && !isFingered) this.end(fingered);
  }

  release(note, who, channel = 0) {
    const held = this.held.get(keyOf(note, channel));
    if (!held?.holders.delete(who) || held.holders.size > 0) return;
    this.held.delete(keyOf(note, channel));
    if (this.isBlown && this.held.size === 0) this.fingered = { note, channel };
    else this.end({ note, channel });
  }

  /** Everything that one of them holds, or all hold. */
  releaseAll(who) {
    for (const { note, channel, holders } of [...this.held.values()]) {
      [...holders].filter((holder) => who === undefined || holder === who).forEach((holder) => this.release(note, holder, channel));
    }
  }

  end({ note, channel }) {
    this.send({ midi: [0x80 | channel, note, 0] });
  }

  /** Whether a key is down, or a note stays under the fingers. */
  get hasNote() {
    return this.held.size > 0 || this.fingered !== null;
  }

  /** The microphone blows, or blows no more. */
  blow(on, transposition) {
    this.isBlown = on;
    if (on && !this.hasNote) this.finger(this.last ?? OPEN_WRITTEN - transposition);
    if (!on && this.fingered !== null) {
      this.last = this.fingered.note;
      this.end(this.fingered);
      this.fingered = null;
    }
  }

  /** Another instrument: what is fingered, or was last, becomes the note that `fit` gives for it. */
  refinger(fit) {
    if (this.last !== undefined) this.last = fit(this.last);
    const { fingered } = this;
    if (fingered === null || fit(fingered.note) === fingered.note) return;
    this.finger(fit(fingered.note), fingered.channel);
    this.end(fingered);
  }

  finger(note, channel = 0) {
    this.fingered = { note, channel };
    this.send({ midi: [0x90 | channel, note, VELOCITY] });
  }

  /** All notes have been cut; who still holds a key has no note any more. */
  forget() {
    this.held.clear();
    this.fingered = null;
  }

  silence() {
    this.forget();
    this.send({ silence: true });
    this.send({ breath: null });
  }
}

function keyOf(note, channel) {
  return (channel << 7) | note;
}
