// Web MIDI: every input plays. The core decodes the messages; here notes are followed, because hands share them, and what a
// device leaves behind that is unplugged.
//
// Of several pages in one browser the one that was looked at last plays: each would play every note.

const [NOTE_OFF, NOTE_ON, KEY_PRESSURE, CONTROLLER, PRESSURE] = [0x80, 0x90, 0xa0, 0xb0, 0xd0];
const [BREATH, EXPRESSION, PEDAL, SOUND_OFF, EASE_CONTROLLERS, NOTES_OFF] = [2, 11, 64, 120, 121, 123];
/** What may blow, as the picture's origins have it. */
const NAMES = { [BREATH]: 'CC2', [EXPRESSION]: 'CC11' };

const ofKey = (channel, key) => `the note ${channel} ${key}`;
const idOf = (input) => input.id ?? input.name;

export class Midi {
  /**
   * `on` gets { inputs: names } when devices come and go, { message: status }, which a page that sounds needs, and { gone: true }
   * after a device has gone with the breath that it gave.
   */
  constructor(hands, send, on) {
    /** By input: the channels that it has used. */
    this.inputs = new Map();
    /** The latest message of each source of breath on each channel, by the source's name, and whose it is. */
    this.blown = new Map();
    Object.assign(this, { hands, send, on, plays: true });
    this.others = globalThis.BroadcastChannel ? new BroadcastChannel('chalumeau-midi') : null;
    if (this.others) this.others.onmessage = () => this.cede();
    addEventListener('focus', () => this.claim());
    document.addEventListener('visibilitychange', () => document.hidden || this.claim());
  }

  static get isHere() {
    return 'requestMIDIAccess' in navigator;
  }

  /** A second opening waits for the first: two would play every note twice. */
  open() {
    this.opening ??= this.openOnce().finally(() => (this.opening = null));
    return this.opening;
  }

  async openOnce() {
    this.access ??= await navigator.requestMIDIAccess();
    this.access.onstatechange = () => this.listen();
    if (!document.hidden) this.claim();
    this.listen();
  }

  /** No device plays any more. */
  close() {
    [...this.inputs.keys()].forEach((input) => this.leave(input));
    this.inputs.clear();
    if (!this.access) return;
    this.access.onstatechange = null;
    for (const input of this.access.inputs.values()) {
      input.onmidimessage = null;
      // Other programs may want it.
      input.close?.();
    }
    this.access = null;
  }

  /** This page plays, and no other. */
  claim() {
    this.plays = true;
    if (this.access) this.others?.postMessage('mine');
  }

  cede() {
    if (!this.plays) return;
    this.plays = false;
    [...this.inputs.keys()].forEach((input) => this.leave(input));
  }

  listen() {
    const inputs = [...this.access.inputs.values()].filter((input) => input.state !== 'disconnected');
    const here = new Set(inputs.map(idOf));
    [...this.inputs.keys()].filter((id) => !here.has(id)).forEach((id) => {
      this.leave(id);
      this.inputs.delete(id);
    });
    for (const input of inputs) {
      const id = idOf(input);
      if (!this.inputs.has(id)) this.inputs.set(id, new Set());
      input.onmidimessage = ({ data }) => this.plays && this.hear(data, id);
    }
    this.on({ inputs: inputs.map((input) => input.name ?? 'MIDI') });
  }

  /** A device that was unplugged does not tell that its keys, pedal and wheels have come to rest, nor that nobody blows. */
  leave(input) {
    this.hands.releaseAll(input);
    for (const channel of this.inputs.get(input) ?? []) {
      this.send({ midi: [CONTROLLER | channel, PEDAL, 0] });
      this.send({ midi: [CONTROLLER | channel, EASE_CONTROLLERS, 0] });
    }
    this.inputs.get(input)?.clear();
    const own = [...this.blown].filter(([, last]) => last.input === input);
    own.forEach(([source]) => this.blown.delete(source));
    if (own.length === 0) return;
    this.isTaken = true;
    this.on({ gone: true });
  }

  hear([status, first, second], input) {
    const [kind, channel] = [status & 0xf0, status & 0x0f];
    if (status < 0x80 || status >= 0xf0 || first === undefined) return;
    this.inputs.get(input)?.add(channel);
    this.on({ message: status });
    if (kind === NOTE_ON && second > 0) {
      this.giveBack();
      this.hands.press(first, second, input, channel);
      return;
    }
    if (kind === NOTE_OFF || kind === NOTE_ON) {
      this.blown.delete(ofKey(channel, first));
      this.hands.release(first, input, channel);
      return;
    }
    const message = [status, first, second ?? 0];
    const name = kind === PRESSURE ? 'channel pressure' : kind === CONTROLLER && NAMES[first];
    if (name) {
      this.blown.set(`${name} ${channel}`, { name, message, value: kind === PRESSURE ? first : second, input });
      this.isTaken = false;
    }
    // A key's own breath ends with the key.
    if (kind === KEY_PRESSURE) {
      this.blown.set(ofKey(channel, first), { name: 'the note', message, value: second, input });
      this.isTaken = false;
    }
    if (kind === CONTROLLER && (first === SOUND_OFF || first === NOTES_OFF)) this.hands.forget();
    this.send({ midi: message });
  }

  /** Whether nobody blows at a source of breath that has been found. */
  rests(name) {
    return [...this.blown.values()].every((last) => last.name !== name || last.value === 0);
  }

  /** The computer's keys take the breath from a source at rest. Its next message takes it back, or its next note. */
  take() {
    this.isTaken = true;
    this.send({ breath: null });
  }

  giveBack() {
    if (!this.isTaken) return;
    this.isTaken = false;
    this.blown.forEach(({ message }) => this.send({ midi: message }));
  }
}
