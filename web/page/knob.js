// A TorqueTuner at a serial port (Web Serial). The session, and whether torque is allowed, are the module's, on the audio thread;
// here are the port, the buttons, and the signs of life that keep a knob armed.
//
// What ends torque never waits for another thread: the two frames that do it were made when the port was opened, and are written
// from here at once. If this thread stands still nothing is written at all, and the knob's own watchdog ends it.

/** Time between two signs of life, ms; the session lets go after 500 without one. */
const BEAT_MS = 100;
/** The audio thread tells of the knob ten times a second; after this long without it the torque is ended from here, ms. */
const DEAF_MS = 500;
/** Speeds of the line, baud; the session asks for the slower one where the first is not answered. */
const BAUD = 921600;
/** Frames that wait to be written before more are dropped: what is late is worth nothing. */
const MOST_WAITING = 8;
/** Time in which a board that starts anew when its port is opened has answered, ms. */
const ANSWER_MS = 5000;
/** Reasons of the page, by the module's numbers. */
export const [STOPPED, HIDDEN, LEFT] = [0, 1, 2];
export const WHERE = 'A knob needs Web Serial, which Chrome, Edge and Opera have on a computer. Firefox and Safari do not; there, use the plugin or the command line.';

export class Knob {
  /** `send` goes to the worklet; `on` gets the status, see `hear`. */
  constructor(send, on) {
    Object.assign(this, { send, on, port: null, decoder: new TextDecoder(), opened: 0, limits: '', isWanted: false, isWarned: false });
    document.addEventListener('visibilitychange', () => document.hidden && this.free(HIDDEN));
    addEventListener('pagehide', () => this.leave());
    addEventListener('beforeunload', () => this.leave());
    // A knob that is plugged in again is found again, not armed.
    globalThis.navigator.serial?.addEventListener?.('connect', ({ target }) => {
      if (this.wanted && !this.port && this.isOurs(target)) this.open(target).then(() => (this.isBack = true)).catch(() => {});
    });
  }

  static get isHere() {
    return 'serial' in navigator;
  }

  isOurs(port) {
    const same = (a, b) => a.usbVendorId === b.usbVendorId && a.usbProductId === b.usbProductId;
    return port === this.wanted || same(port.getInfo?.() ?? {}, this.wanted.getInfo?.() ?? {});
  }

  /** Asks the user for a port: in a gesture. */
  async connect() {
    await this.open(await navigator.serial.requestPort());
  }

  async open(port) {
    this.opened += 1;
    await this.openAt(port, BAUD);
    this.wanted = this.port = port;
    this.openedAt = this.heardAt = performance.now();
    const [number] = crypto.getRandomValues(new Uint32Array(1));
    this.send({ knob: ['open', number] });
    this.beating = setInterval(() => this.beat(), BEAT_MS);
    this.read(port, this.opened);
    this.on({ connected: true });
  }

  async openAt(port, baudRate) {
    try {
      await port.open({ baudRate, bufferSize: 4096 });
    } catch (error) {
      throw new Error(`the port does not open: ${error.message} Does another program use the knob?`);
    }
    // Boards without the lines, and ports that only look like some, need no signals.
    await port.setSignals?.({ dataTerminalReady: true, requestToSend: true }).catch(() => {});
    this.writer = port.writable.getWriter();
  }

  async read(port, opened) {
    let [last, trouble] = [null, ''];
    // After a damaged byte, as where a board starts anew, the port goes on with another stream. Unplugged it has none.
    while (port.readable && port.readable !== last) {
      last = port.readable;
      const reader = (this.reader = last.getReader());
      try {
        for (;;) {
          const { value, done } = await reader.read();
          if (done) return;
          this.send({ knobBytes: value, at: Date.now() });
        }
      } catch (error) {
        trouble = error.message;
      } finally {
        reader.releaseLock();
      }
    }
    if (opened === this.opened) this.lose(`the knob was unplugged (${trouble})`);
  }

  /** What the worklet tells of the knob. */
  hear(message) {
    if (message.knobFarewell) this.farewell = message.knobFarewell;
    if (message.knobSend) this.write(message.knobSend);
    if (message.knobBaud) this.changeSpeed(message.knobBaud);
    if (message.knobStatus && this.port) {
      this.heardAt = performance.now();
      const [live, armed, ceiling, angle, torque, feel, most, stiffness, push, who, alarm, restriction, refusal, notice, arming, stray] = this.decoder.decode(message.knobStatus).split('\n');
      this.isLive = live === '1';
      this.isArmed = armed === '1';
      // A status that was made before the act says nothing of it.
      if (arming === '1') this.isSeen = true;
      if (this.isArmed || (arming !== '1' && (this.isSeen || performance.now() - this.wantedAt > DEAF_MS))) this.isWanted = false;
      this.strayDeg = stray ? Number(stray) : null;
      this.isWarned &&= this.isLive && this.strayDeg !== null;
      if (this.isArmed) this.isBack = false;
      const back = this.isBack ? 'the knob is back; if it has restarted, its zero is where it stood then: press Rest here' : '';
      const silent = !this.isLive && performance.now() - this.openedAt > ANSWER_MS;
      const name = silent && who === 'waiting for an answer' ? 'Nothing answers at this port. Is it a TorqueTuner with the firmware of firmware/?' : who;
      const limits = Number(most) > 0 ? { most: Number(most), stiffness: Number(stiffness), push: Number(push) } : null;
      this.on({ live: this.isLive, armed: this.isArmed, wanted: this.isWanted, ceiling: Number(ceiling), angle: Number(angle), torque: Number(torque), feel: Number(feel), limits, who: name, alarm, restriction, refusal, notice: notice || back });
    }
  }

  beat() {
    // Nobody obeys a user who does not see the page.
    if (!document.hidden) this.send({ knob: ['beat', 0] });
    if (this.mayTurn && performance.now() - this.heardAt > DEAF_MS) {
      Object.assign(this, { isArmed: false, isWanted: false });
      this.write(this.farewell, true);
      this.on({ live: false, armed: false, who: 'disarmed: the audio thread has stood still', notice: '' });
    }
  }

  /** Writes whole frames, or drops them where the port cannot take more. */
  write(bytes, always = false) {
    if (!this.port || !this.writer || !bytes) return;
    if (!always && (this.waiting ?? 0) >= MOST_WAITING) return;
    this.waiting = (this.waiting ?? 0) + 1;
    this.writer.write(bytes).catch(() => {}).finally(() => (this.waiting -= 1));
  }

  /** Torque is there, or may come at any moment. */
  get mayTurn() {
    return this.isWanted || Boolean(this.isArmed);
  }

  /** An act of the user, and nothing else, arms. Returns why not, where the user is to be asked again. */
  arm(event, ceiling) {
    if (!event.isTrusted || !this.port || document.hidden) return '';
    if (this.strayDeg !== null && this.strayDeg !== undefined && !this.isWarned) {
      this.isWarned = true;
      return `not armed: the knob stands ${this.strayDeg.toFixed(0)} degrees from its zero, and may turn back there by itself. Let go of it and press Rest here, or press Arm again`;
    }
    Object.assign(this, { isWanted: true, isSeen: false, wantedAt: performance.now() });
    this.send({ knob: ['arm', ceiling] });
    return '';
  }

  lower(ceiling) {
    this.send({ knob: ['lower', ceiling] });
  }

  zero() {
    this.isBack = false;
    this.send({ knob: ['zero', 0] });
  }

  /** Torque off, now. */
  free(reason) {
    if (!this.port) return;
    this.isWanted = false;
    // The first of the farewell's two frames; the session says it too, and why.
    this.write(this.farewell?.subarray(0, this.farewell.indexOf(0, 1) + 1), true);
    this.send({ knob: ['free', reason] });
  }

  leave() {
    if (!this.port) return;
    this.send({ knob: ['free', LEFT] });
    this.write(this.farewell, true);
  }

  async changeSpeed(baudRate) {
    const { port } = this;
    if (!port || this.changing) return;
    const opened = (this.opened += 1);
    this.changing = this.shut().then(() => this.openAt(port, baudRate));
    try {
      await this.changing;
      // Who disconnects meanwhile waits, and shuts the port.
      if (opened === this.opened) this.read(port, opened);
    } catch (error) {
      if (opened === this.opened) this.lose(error.message);
    } finally {
      this.changing = null;
    }
  }

  async shut() {
    const { port, reader, writer } = this;
    this.writer = null;
    await reader?.cancel().catch(() => {});
    await writer?.close?.().catch(() => {});
    writer?.releaseLock();
    await port?.close().catch(() => {});
  }

  /** The port is gone. */
  lose(why) {
    const { port, writer } = this;
    this.end();
    // Otherwise it could not be opened again.
    writer?.releaseLock();
    port?.close().catch(() => {});
    this.on({ connected: false, who: why });
  }

  end() {
    clearInterval(this.beating);
    this.send({ knob: ['close', 0] });
    Object.assign(this, { port: null, writer: null, isLive: false, isArmed: false, isWanted: false, isWarned: false, isBack: false, strayDeg: null, farewell: null });
  }

  /** The user has enough of it. */
  async disconnect() {
    this.wanted = null;
    this.opened += 1;
    this.free(STOPPED);
    this.write(this.farewell, true);
    // While its speed changes the port is neither open nor shut.
    await this.changing?.catch(() => {});
    await this.shut();
    this.lose('');
  }
}
