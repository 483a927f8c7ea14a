// The main controls: what most players need, with the names of the plugin's window.

import { clamp } from './names.js';
import { hasMoved, isMain, leaveAfterPointer } from './pointers.js';

/** Id of the parameter, name, and what its ends mean. */
const NAMES = {
  lip: ['Lip', 'firm to loose'],
  stren: ['Reed', 'soft to hard'],
  tongue: ['Tongue', 'hard to soft'],
  lay: ['Facing', 'bright to mellow'],
  noise: ['Noise', 'none to much'],
  vib: ['Vibrato', 'none to deep'],
  growl: ['Growl', 'none to rough'],
  subt: ['Subtone', 'open to covered'],
  room: ['Room', 'dry to far'],
};
/** Angle from one end to the other, degrees; pixels of a hand's way. */
const [SWEEP, WAY] = [270, 180];
/** A notch of a wheel, in pixels and in lines. */
const [WHEEL_PIXELS, WHEEL_LINES] = [100, 3];

const svg = (name, attributes) => {
  const element = document.createElementNS('http://www.w3.org/2000/svg', name);
  Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
  return element;
};

const point = (share, radius) => {
  const angle = ((share - 0.5) * SWEEP * Math.PI) / 180;
  return [50 + radius * Math.sin(angle), 50 - radius * Math.cos(angle)].map((x) => x.toFixed(2));
};

const arc = (from, to, radius) => `M ${point(from, radius)} A ${radius} ${radius} 0 ${(to - from) * SWEEP > 180 ? 1 : 0} 1 ${point(to, radius)}`;

export class Control {
  /** `of` is from data.json; `set` gets every new value. */
  constructor(of, set) {
    Object.assign(this, { of, set, value: of.default });
    const [name, ends] = NAMES[of.id];
    const element = document.createElement('div');
    this.element = element;
    element.className = 'knob';
    element.id = `control-${of.id}`;
    element.tabIndex = 0;
    element.title = `${of.meaning}. ${of.sound}`;
    Object.entries({ role: 'slider', 'aria-label': name, 'aria-valuemin': of.min, 'aria-valuemax': of.max }).forEach(([key, value]) => element.setAttribute(key, value));
    const picture = svg('svg', { viewBox: '0 0 100 100', 'aria-hidden': 'true' });
    const rest = this.share(of.default);
    this.arc = svg('path', { class: 'value' });
    this.hand = svg('line', { class: 'hand' });
    const [x1, y1] = point(rest, 42);
    const [x2, y2] = point(rest, 49);
    picture.append(
      svg('path', { class: 'track', d: arc(0, 1, 42) }),
      this.arc,
      svg('line', { class: 'rest', x1, y1, x2, y2 }),
      svg('circle', { class: 'cap', cx: 50, cy: 50, r: 29 }),
      this.hand,
    );
    this.says = Object.assign(document.createElement('small'), { textContent: ends });
    this.ends = ends;
    element.append(picture, Object.assign(document.createElement('b'), { textContent: name }), this.says);
    element.addEventListener('pointerdown', (event) => this.grab(event));
    element.addEventListener('dblclick', () => this.change(of.default));
    element.addEventListener('keydown', (event) => this.key(event));
    element.addEventListener('wheel', (event) => {
      // A pinch zooms, a sideways swipe is none of this, and a page that scrolls is scrolled.
      const root = document.documentElement;
      if (event.ctrlKey || event.deltaY === 0 || root.scrollHeight > root.clientHeight) return;
      event.preventDefault();
      const lines = event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? event.deltaY / WHEEL_PIXELS : event.deltaY / WHEEL_LINES;
      this.nudge(-0.02 * clamp(lines, -1, 1));
    }, { passive: false });
    this.show();
  }

  /** Name and meaning, for a list of terms. */
  explained() {
    const part = (kind, textContent) => Object.assign(document.createElement(kind), { textContent });
    return [part('dt', this.element.getAttribute('aria-label')), part('dd', this.element.title)];
  }

  share(value) {
    return (value - this.of.min) / (this.of.max - this.of.min);
  }

  get text() {
    return `${(this.value * this.of.scale).toFixed(Math.min(this.of.digits, this.of.scale === 100 ? 0 : 2))}${this.of.unit}`;
  }

  grab(event) {
    if (!isMain(event) || this.isHeld) return;
    const element = this.element;
    const { value } = this;
    let begin = null;
    const move = (now) => {
      if (now.pointerId !== event.pointerId) return;
      // On a phone sideways scrolls.
      const isMouse = now.pointerType === 'mouse';
      if (!begin) {
        if (!hasMoved(now, { clientX: isMouse ? event.clientX : now.clientX, clientY: event.clientY })) return;
        begin = { x: now.clientX, y: now.clientY, share: this.share(value) };
      }
      const way = begin.y - now.clientY + (isMouse ? now.clientX - begin.x : 0);
      this.change(this.of.min + clamp(begin.share + way / WAY, 0, 1) * (this.of.max - this.of.min));
    };
    const end = (now) => {
      if (now.pointerId !== event.pointerId) return;
      ending.abort();
      this.isHeld = false;
      // The browser scrolls instead.
      if (begin && now.type === 'pointercancel') this.change(value);
      this.says.textContent = this.ends;
      leaveAfterPointer(element);
    };
    this.isHeld = true;
    element.setPointerCapture(event.pointerId);
    const ending = new AbortController();
    element.addEventListener('pointermove', move, { signal: ending.signal });
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) element.addEventListener(type, end, { signal: ending.signal });
    this.says.textContent = this.text;
  }

  key(event) {
    // Back and forward, for example.
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const steps = { ArrowUp: 0.02, ArrowRight: 0.02, ArrowDown: -0.02, ArrowLeft: -0.02, PageUp: 0.1, PageDown: -0.1 };
    if (event.key in steps) this.nudge(steps[event.key]);
    else if (event.key === 'Home') this.change(this.of.min);
    else if (event.key === 'End') this.change(this.of.max);
    else if (event.key === 'Delete' || event.key === 'Backspace') this.change(this.of.default);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  nudge(step) {
    this.change(this.of.min + clamp(this.share(this.value) + step, 0, 1) * (this.of.max - this.of.min));
  }

  change(value) {
    this.show(value);
    this.says.textContent = this.text;
    clearTimeout(this.later);
    this.later = setTimeout(() => (this.says.textContent = this.ends), 1500);
    this.set(this.of.place, this.value);
  }

  /** Shows a value that was set elsewhere. */
  show(value = this.value) {
    this.value = value;
    const [at, rest] = [clamp(this.share(value), 0, 1), this.share(this.of.default)];
    // What is set, from where it rests: at its default a control is quiet.
    this.arc.setAttribute('d', Math.abs(at - rest) < 0.004 ? '' : arc(Math.min(at, rest), Math.max(at, rest), 42));
    const [[x1, y1], [x2, y2]] = [point(at, 12), point(at, 26)];
    Object.entries({ x1, y1, x2, y2 }).forEach(([key, place]) => this.hand.setAttribute(key, place));
    this.element.setAttribute('aria-valuenow', value.toPrecision(4));
    this.element.setAttribute('aria-valuetext', this.text);
  }
}
