// What hands do: keys of a computer, of the screen and of MIDI instruments come together here, and go on as MIDI.
//
// While the microphone is open a key only fingers: its note stays when the key comes up, as on a clarinet, and the breath
// plays it.

/** Sounding G4 of a B flat clarinet with no finger down: written G4. */
const OPEN_WRITTEN = 67;

export class Hands {
  constructor(send) {
    this.send = send;
    /** Held notes with their channels, the oldest first. */
    this.held = new Map();
    this.fingered = null;
    this.isBlown = false;
  }

  press(note, velocity, channel = 0) {
    this.held.delete(note);
    this.held.set(note, channel);
    this.send({ midi: [0x90 | channel, note, velocity] });
    if (this.fingered !== null && this.fingered !== note) this.send({ midi: [0x80, this.fingered, 0] });
    this.fingered = null;
  }

  release(note, channel = 0) {
    if (!this.held.delete(note)) return;
    if (this.isBlown && this.held.size === 0) this.fingered = note;
    else this.send({ midi: [0x80 | channel, note, 0] });
  }

  releaseAll() {
    [...this.held].forEach(([note, channel]) => this.release(note, channel));
  }

  /** The microphone blows, or blows no more. */
  blow(on, transposition) {
    this.isBlown = on;
    if (on && this.held.size === 0 && this.fingered === null) {
      const note = this.last ?? OPEN_WRITTEN - transposition;
      this.fingered = note;
      this.send({ midi: [0x90, note, 80] });
    }
    if (!on && this.fingered !== null) {
      this.last = this.fingered;
      this.send({ midi: [0x80, this.fingered, 0] });
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
