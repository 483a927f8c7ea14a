// The computer's keys as a piano: the row of A has the white keys, the row above the black ones. Places on the keyboard count,
// not letters, so that every layout has the same hand.

import { clamp } from './names.js';

const CODES = ['KeyA', 'KeyW', 'KeyS', 'KeyE', 'KeyD', 'KeyF', 'KeyT', 'KeyG', 'KeyY', 'KeyH', 'KeyU', 'KeyJ', 'KeyK', 'KeyO', 'KeyL', 'KeyP', 'Semicolon', 'Quote'];
/** Step of the breath, and where it begins. */
const [STEP, BEGIN] = [0.08, 0.66];

/** The C nearest to ten semitones above the lowest note: letters begin there. */
const usualBase = (first) => 12 * Math.round((first + 10) / 12);

/** A list that is open takes the letters; one that is closed only has the focus, where the browser tells them apart. */
const OPEN_LIST = CSS.supports('selector(:open)') ? 'select:open' : 'select';

export class Typing {
  /** `on` gets { letters }, { start }, { silence } and { breath }, which the arrows have set for the keys to come; `breathe` the breath that the arrows set, or null. */
  constructor(hands, breathe, on, struck) {
    Object.assign(this, { hands, breathe, on, struck, held: new Map(), learnt: new Map(), base: 60, breath: BEGIN });
    addEventListener('keydown', (event) => this.down(event));
    addEventListener('keyup', (event) => {
      // macOS tells of no key that comes up while Command is down.
      if (event.key === 'Meta') this.end();
      else this.up(event.code);
    });
    // A list that opens takes the keys that come up.
    addEventListener('pointerdown', ({ target }) => target.closest?.('select') && this.end(), { capture: true });
    addEventListener('focusin', ({ target }) => target.matches?.('select') && this.end());
    navigator.keyboard?.getLayoutMap?.().then((map) => {
      this.layout = map;
      this.tell();
    }, () => {});
  }

  /** The letters stay about where they are among the notes of the instrument. */
  setRange(first, last) {
    const base = usualBase(first) + this.base - usualBase(this.first ?? first);
    [this.first, this.last] = [first, last];
    this.moveTo(base);
  }

  moveTo(base) {
    this.base = clamp(base, 12 * Math.floor(this.first / 12), 12 * Math.floor(this.last / 12));
    this.tell();
  }

  tell() {
    const usual = { Semicolon: ';', Quote: "'" };
    const letter = (code) => (this.layout?.get(code) ?? this.learnt.get(code) ?? usual[code] ?? code.slice(3)).toUpperCase();
    const [first, last, down, up] = ['KeyA', 'Quote', 'KeyZ', 'KeyX'].map(letter);
    this.on({ letters: new Map(CODES.map((code, n) => [this.base + n, letter(code)])), base: this.base, help: { first, last, down, up } });
  }

  down(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.matches?.('input[type=search], input[type=number], dialog, dialog *')) return;
    if (event.code === 'Escape') return this.on({ silence: true });
    if (event.target.matches?.(OPEN_LIST)) return;
    const onControl = event.target.matches?.('[role=slider], input, select');
    this.learn(event);
    const place = CODES.indexOf(event.code);
    if (place >= 0) {
      event.preventDefault();
      if (event.repeat || this.held.has(event.code)) return;
      const note = this.base + place;
      if (note < this.first || note > this.last) return this.on({ outside: note });
      this.held.set(event.code, note);
      this.on({ start: true });
      this.hands.press(note, Math.round(127 * this.breath), event.code);
    } else if (event.code === 'KeyZ' || event.code === 'KeyX') {
      this.moveTo(this.base + (event.code === 'KeyX' ? 12 : -12));
    } else if (!onControl && (event.code === 'ArrowUp' || event.code === 'ArrowDown')) {
      event.preventDefault();
      this.breath = clamp(this.breath + (event.code === 'ArrowUp' ? STEP : -STEP), 0.06, 1);
      this.on({ breath: this.breath });
      // The dynamic of a key that is struck so: down and up again is where it was.
      const [soft, loud] = this.struck();
      if (this.held.size > 0) this.breathe(soft + (loud - soft) * this.breath);
    }
  }

  /** Where the browser does not tell the layout, keys tell their letters as they are pressed. */
  learn({ code, key, shiftKey }) {
    key = key.toLowerCase();
    if (this.layout || shiftKey || key.length !== 1 || this.learnt.get(code) === key || !(CODES.includes(code) || code === 'KeyZ' || code === 'KeyX')) return;
    this.learnt.set(code, key);
    this.tell();
  }

  /** Lets every key go. */
  end() {
    [...this.held.keys()].forEach((code) => this.up(code));
  }

  up(code) {
    const note = this.held.get(code);
    if (note === undefined) return;
    this.held.delete(code);
    this.hands.release(note, code);
    if (this.held.size === 0) this.breathe(null);
  }
}
