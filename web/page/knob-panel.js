// The knob's line on the page: what it is, its torque, and the large button that ends it.

import { Knob, STOPPED, WHERE } from './knob.js';

/** Time in which settings that move are gathered before the feel is computed again, ms. */
const GATHER_MS = 60;
/** Said before anything else has happened. */
const BEFORE = 'never tested on hardware: before you arm, clamp it and have the switch of its motor within reach (firmware/SAFETY.md)';
const get = (id) => document.getElementById(id);

export class KnobPanel {
  /**
   * `engine` plays; `workshop` computes the feel; `question` gives what it depends on; `say` tells what has happened; `on` is
   * called with true while the knob blows.
   */
  constructor(engine, workshop, question, say, on) {
    Object.assign(this, { engine, workshop, question, say, on, plays: false, asked: '' });
    this.knob = new Knob((message) => engine.send(message), (status) => this.show(status));
    get('knob').onclick = () => this.toggle();
    get('knob-arm').onclick = (event) => {
      this.warned = this.knob.arm(event, this.ceiling);
      if (this.warned) get('knob-who').textContent = this.warned;
      this.become(this.knob.isLive, this.knob.isArmed, this.knob.isWanted);
    };
    get('knob-stop').onclick = () => this.stop();
    // Pressed counts, not let go: nobody waits for a click.
    get('knob-stop').onpointerdown = () => this.stop();
    get('knob-zero').onclick = () => this.knob.zero();
    get('knob-ceiling').onchange = () => {
      this.knob.lower(this.ceiling);
      this.update();
    };
    addEventListener('keydown', (event) => {
      // An arming knob, too: the status tells of its torque only ten times a second.
      if (!this.knob.port || !this.knob.mayTurn || !['Escape', 'Space'].includes(event.code)) return;
      // Space must not press the button that has the focus.
      event.preventDefault();
      this.stop();
    }, { capture: true });
  }

  get ceiling() {
    return Number(get('knob-ceiling').value);
  }

  get isConnected() {
    return Boolean(this.knob.port);
  }

  hear(message) {
    this.knob.hear(message);
  }

  stop() {
    this.knob.free(STOPPED);
  }

  async toggle() {
    if (this.isConnected) return this.knob.disconnect();
    if (!Knob.isHere) return this.say(WHERE);
    try {
      await this.engine.start();
      await this.knob.connect();
    } catch (error) {
      // Who closes the browser's list has chosen none.
      this.say(error.name === 'NotFoundError' ? 'No knob chosen.' : `No knob: ${error.message}`);
    }
  }

  show(status) {
    if ('connected' in status) {
      get('knob').setAttribute('aria-pressed', status.connected);
      get('knob-panel').hidden = !status.connected;
      document.body.classList.toggle('with-knob', status.connected);
      this.asked = '';
      this.warned = '';
      if (!status.connected) this.become(false, false, false);
      if (status.who) this.say(`Knob: ${status.who}.`);
      if (status.connected) get('knob-who').textContent = 'Waiting for an answer …';
      return;
    }
    this.become(status.live, status.armed, status.wanted);
    const warning = status.alarm || status.restriction || '';
    if (status.armed || status.wanted || !this.knob.isWarned) this.warned = '';
    const said = [status.who, warning, this.warned, status.refusal, this.refused, status.notice].filter(Boolean);
    if (status.live && !status.armed && said.length === 1) said.push(BEFORE);
    get('knob-who').textContent = said.join(' · ');
    get('knob-who').classList.toggle('failed', Boolean(status.alarm));
    if (status.live) get('knob-numbers').textContent = `${status.angle.toFixed(0)}° · ${Math.abs(status.torque)} mNm`;
    if (status.limits) this.limits = status.limits;
    this.update();
  }

  become(live, armed, wanted) {
    get('knob').classList.toggle('blowing', Boolean(armed));
    get('knob-panel').classList.toggle('armed', Boolean(armed));
    get('knob-arm').disabled = !live || armed || wanted;
    get('knob-zero').disabled = !live || armed || wanted;
  }

  /** Whether the knob makes the breath, as the sound's picture has it. */
  follow(plays) {
    if (plays === this.plays) return;
    this.plays = plays;
    this.on(plays);
  }

  /** Computes the feel anew if what it depends on has changed. */
  update() {
    if (!this.isConnected || !this.limits || this.gathering) return;
    this.gathering = setTimeout(async () => {
      this.gathering = null;
      const { most, stiffness, push } = this.limits;
      const question = { do: 'feel', ...this.question(), ceiling: Math.min(this.ceiling, most), stiffness, push };
      const text = JSON.stringify(question);
      if (text === this.asked) return;
      this.asked = text;
      try {
        const feel = await this.workshop.ask(question);
        if (this.asked === text) this.engine.send({ knob: ['feel', feel] });
        this.refused = '';
      } catch (error) {
        this.refused = `the feel stays as it was: ${error.message}`;
      }
    }, GATHER_MS);
  }
}
