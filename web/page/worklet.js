// The audio thread: the WebAssembly module, which hears the microphone too.
//
// Messages in: { midi: [status, a, b] }, { breath: 0..1 or null }, { values: [..] }, { set: [place, value] },
// { instrument: n }, { wheel: n }, { bend: semitones }, { breathFrom: n }, { silence: true },
// { microphone: true or false, calibrate: true }, { score: messages } with the sample of each first, { times: true },
// { prepared: { file, prepared } } in UTF-8, { knob: [what, number] } and { knobBytes, at } as knob.js sends them.
// Messages out: { picture: [..], microphone: .. } 30 times a second, { blowing: true or false }, { times: .. }, { failed: text },
// { taken: true or false } of a prepared instrument, { knobSend: bytes }, { knobBaud: n }, { knobFarewell: bytes }, { knobStatus: bytes }.

/** Time between two pictures, s. */
const PICTURE_S = 1 / 30;
/** Pictures between two statuses of the knob. */
const STATUS_EVERY = 3;
/** Blocks of which the times are kept: eleven seconds. */
const TIMES = 4096;

// Most browsers give this scope no clock but that of milliseconds; their mean over many blocks is finer.
const now = () => globalThis.performance?.now() ?? Date.now();

class Chalumeau extends AudioWorkletProcessor {
  constructor({ processorOptions: { module, instrument, score, prepared } }) {
    super();
    this.module = new WebAssembly.Instance(module, {}).exports;
    this.until = 0;
    this.times = new Float32Array(TIMES);
    this.blocks = 0;
    this.listening = false;
    this.wasOpen = false;
    this.following = null;
    this.waiting = [];
    this.score = null;
    this.hasKnob = false;
    this.pictures = 0;
    this.guarded(() => {
      if (!this.module.chalumeau_begin(sampleRate, instrument)) throw new Error(`no instrument at ${sampleRate} Hz`);
    });
    if (prepared) this.guarded(() => this.begin(prepared));
    if (score) this.guarded(() => this.take(score));
    this.port.onmessage = ({ data }) => this.guarded(() => this.take(data));
  }

  /** What fails is told once, and silent from then on. */
  guarded(work) {
    if (this.failed) return;
    try {
      work();
    } catch (error) {
      this.failed = true;
      this.port.postMessage({ failed: String(error) });
    }
  }

  take(message) {
    const module = this.module;
    // What is said after another instrument is for that one. A knob waits for nothing.
    if (this.following && !message.knob && !message.knobBytes) {
      this.waiting.push(message);
      return;
    }
    if (message.midi) module.chalumeau_midi(...message.midi);
    if ('breath' in message) module.chalumeau_breath(message.breath ?? -1);
    if (message.values) {
      message.values.forEach((value, place) => module.chalumeau_set(place, value));
      module.chalumeau_settle();
    }
    if (message.set) {
      module.chalumeau_set(...message.set);
      module.chalumeau_settle();
    }
    if ('instrument' in message || message.prepared) {
      this.following = message;
      module.chalumeau_leave();
      if (module.chalumeau_has_left() === 1) this.follow();
    }
    if (message.knob) this.turn(...message.knob);
    if (message.knobBytes && this.hasKnob) {
      this.give(message.knobBytes);
      module.chalumeau_knob_receive(message.at);
    }
    if ('wheel' in message) module.chalumeau_wheel(message.wheel);
    if ('bend' in message) module.chalumeau_bend_range(message.bend);
    if ('breathFrom' in message) module.chalumeau_breath_from(message.breathFrom);
    if (message.silence) module.chalumeau_silence();
    if ('microphone' in message) this.listen(message.microphone);
    if (message.calibrate) module.chalumeau_calibrate();
    if (message.score) this.score = { messages: message.score, at: 0, next: 0 };
    if (message.times) this.tellTimes();
  }

  /** Writes bytes for the module's next call. */
  give(...parts) {
    const length = parts.reduce((sum, part) => sum + part.length, 0);
    // It may grow, and then its memory lies elsewhere.
    const place = this.module.chalumeau_inbox(length);
    if (place === 0) throw new Error(`a message of ${length} bytes`);
    const inbox = new Uint8Array(this.module.memory.buffer, place, length);
    parts.reduce((at, part) => (inbox.set(part, at), at + part.length), 0);
  }

  /** A copy of the bytes that the module has given. */
  given(length) {
    return Uint8Array.from(new Uint8Array(this.module.memory.buffer, this.module.chalumeau_outbox(), length));
  }

  /** Another instrument, once the one before is silent. */
  follow() {
    const { instrument, prepared } = this.following;
    this.following = null;
    if (prepared) this.begin(prepared);
    else this.module.chalumeau_begin(sampleRate, instrument);
    // It lies elsewhere now.
    this.views = this.input = null;
    this.waiting.splice(0).forEach((message) => this.take(message));
  }

  /** An instrument that a worker has prepared. */
  begin({ file, prepared }) {
    this.give(file, prepared);
    const taken = this.module.chalumeau_begin_prepared(sampleRate, file.length) === 1;
    this.port.postMessage({ taken });
  }

  turn(what, value) {
    const module = this.module;
    if (what === 'open') {
      this.hasKnob = true;
      this.port.postMessage({ knobFarewell: this.given(module.chalumeau_knob_open(value, Date.now())) });
    } else if (what === 'close') {
      this.hasKnob = false;
      module.chalumeau_knob_close();
    } else if (what === 'beat') module.chalumeau_knob_beat(Date.now());
    else if (what === 'arm') module.chalumeau_knob_arm(value);
    else if (what === 'lower') module.chalumeau_knob_lower(value);
    else if (what === 'free') module.chalumeau_knob_let_go(value);
    else if (what === 'zero') module.chalumeau_knob_zero();
    else if (what === 'feel') {
      this.give(value);
      module.chalumeau_knob_feel();
    }
  }

  /** The knob's session before a block. */
  tend(frames) {
    const length = this.module.chalumeau_knob_turn(Date.now(), frames);
    const bytes = length > 0 ? this.given(length) : null;
    const baud = this.module.chalumeau_knob_baud();
    if (baud > 0) this.port.postMessage({ knobBaud: baud });
    if (bytes) this.port.postMessage({ knobSend: bytes });
  }

  listen(on) {
    this.module.chalumeau_microphone(on ? 1 : 0);
    this.listening = on;
  }

  hear(input) {
    if (!this.listening) return;
    // There is none before the device is open.
    if (input) this.microphone().set(input);
    const isOpen = this.module.chalumeau_hear(input?.length ?? 0) === 1;
    if (isOpen !== this.wasOpen) {
      this.wasOpen = isOpen;
      this.port.postMessage({ blowing: isOpen });
    }
  }

  process([input], [output]) {
    const began = now();
    this.guarded(() => this.play(input[0], output));
    this.times[this.blocks % TIMES] = now() - began;
    this.blocks += 1;
    return true;
  }

  play(input, output) {
    if (this.following && this.module.chalumeau_has_left() === 1) this.follow();
    this.hear(input);
    const frames = output[0].length;
    if (this.hasKnob) this.tend(frames);
    let done = 0;
    while (done < frames) {
      const made = this.module.chalumeau_process(this.score ? this.scored(frames - done) : frames - done);
      if (made === 0) return;
      for (let at = 0; at < output.length; at += 1) output[at].set(this.samples(at, made), done);
      done += made;
      if (this.score) this.score.at += made;
    }
    if (currentTime >= this.until) {
      this.until = currentTime + PICTURE_S;
      this.tellPicture();
    }
  }

  /** Where the module takes what the microphone gives, in a view that stays. */
  microphone() {
    const { memory, chalumeau_input: place, chalumeau_most_frames: most } = this.module;
    if (this.input?.buffer !== memory.buffer) this.input = new Float32Array(memory.buffer, place(), most());
    return this.input;
  }

  /** The module's samples. Whole blocks have views that stay, so that playing leaves nothing to collect. */
  samples(channel, count) {
    const { memory, chalumeau_channel: place } = this.module;
    if (this.views?.[0].buffer !== memory.buffer) {
      this.views = [0, 1].map((at) => new Float32Array(memory.buffer, place(at), this.module.chalumeau_most_frames()));
      this.wholeBlocks = this.views.map((view) => view.subarray(0, 128));
    }
    return count === 128 ? this.wholeBlocks[channel] : this.views[channel].subarray(0, count);
  }

  /** Plays the messages of a score that are due; returns the samples until the next, or until the block ends. */
  scored(most) {
    const score = this.score;
    while (score.next < score.messages.length && score.messages[score.next][0] <= score.at) {
      const [, what, ...rest] = score.messages[score.next];
      score.next += 1;
      if (what === 'breath') this.take({ breath: rest[0] });
      else if (what === 'set') this.take({ set: rest });
      else this.take({ midi: [what, ...rest] });
    }
    const until = score.messages[score.next]?.[0] ?? Infinity;
    return Math.min(most, until - score.at);
  }

  tellPicture() {
    const picture = new Float32Array(this.module.memory.buffer, this.module.chalumeau_picture(), this.module.chalumeau_picture_numbers());
    this.port.postMessage({ picture: Array.from(picture), microphone: this.listening ? this.wind() : null });
    this.pictures += 1;
    if (this.hasKnob && this.pictures % STATUS_EVERY === 0) {
      this.port.postMessage({ knobStatus: this.given(this.module.chalumeau_knob_status()) });
    }
  }

  wind() {
    const [level, floor, breath, calibrating] = new Float32Array(this.module.memory.buffer, this.module.chalumeau_wind(), 4);
    return { level, floor, breath, calibrating: calibrating === 1 };
  }

  tellTimes() {
    const times = this.times.slice(0, Math.min(this.blocks, TIMES)).sort();
    const mean = times.reduce((sum, time) => sum + time, 0) / Math.max(1, times.length);
    const at = (share) => times[Math.floor(share * (times.length - 1))] ?? 0;
    this.port.postMessage({
      times: { blocks: times.length, deadline: (1000 * 128) / sampleRate, mean, p99: at(0.99), worst: at(1) },
    });
  }
}

registerProcessor('chalumeau', Chalumeau);
