// The piano keyboard: sounding pitch, with the letters of the computer's keys. A key that is slid over slurs; upwards is louder.

import { clamp, isBlack, noteName } from './names.js';
import { isMain } from './pointers.js';

/** Narrowest white key of the whole keyboard, and of a part of it, pixels. */
const [NARROWEST, NARROWEST_OF_PART] = [26, 37];
/** Height that a hand moves from pianissimo to fortissimo, pixels. */
const HEIGHT = 260;
/** Who has moved the keyboard looks for a note; so long it does not follow what sounds, ms. */
const LOOKED_MS = 5000;
/** Breath of a touch before it moves. */
const TOUCH = 0.62;

const who = (pointerId) => `pointer ${pointerId} on the piano`;

export class Keyboard {
  /** `hands` plays; `breathe` gets the breath of a touch, or null when the last touch ends; `see` whether there is more below and above. */
  constructor(element, hands, breathe, see) {
    Object.assign(this, { element, hands, breathe, see, keys: new Map(), touches: new Map(), letters: new Map() });
    this.from = null;
    new ResizeObserver(() => this.build()).observe(element);
    element.addEventListener('pointerdown', (event) => this.down(event));
    element.addEventListener('pointermove', (event) => this.move(event));
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) element.addEventListener(type, (event) => this.up(event));
  }

  /** Notes that sound, first and last, and those between that do not. */
  setRange(first, last, silent) {
    Object.assign(this, { first, last, silent });
    this.build();
  }

  setLetters(letters) {
    this.letters = letters;
    this.build();
  }

  /** Moves the part that is seen, so that `note` is in it. */
  show(note) {
    if (note < this.shown?.[0] || note > this.shown?.[1]) this.shift(note < this.shown[0] ? -1 : 1);
  }

  shift(octaves) {
    this.shifted = performance.now();
    this.from = (this.from ?? this.first) + 12 * octaves;
    this.build();
  }

  build() {
    if (this.first === undefined || this.element.clientWidth < 10) return;
    const whites = (from, to) => Array.from({ length: to - from + 1 }, (_, n) => from + n).filter((note) => !isBlack(note));
    // A keyboard begins and ends with white keys.
    const [first, last] = [this.first - Number(isBlack(this.first)), this.last + Number(isBlack(this.last))];
    const all = whites(first, last);
    const pixels = this.element.clientWidth;
    const isPart = all.length * NARROWEST > pixels;
    const room = Math.max(7, Math.floor(pixels / NARROWEST_OF_PART));
    this.element.parentElement.classList.toggle('part', isPart);
    let seen = all;
    if (isPart) {
      // At first from the lowest C but for the last notes below it.
      const start = all.findIndex((note) => note >= (this.from ?? 12 * Math.ceil((first + 4) / 12)));
      const at = clamp(start < 0 ? all.length : start, 0, Math.max(0, all.length - room));
      seen = all.slice(at, at + room);
      this.from = seen[0];
    }
    this.shown = [seen[0], seen.at(-1)];
    this.see([seen[0] > first, seen.at(-1) < last]);
    const width = 100 / seen.length;
    this.keys.clear();
    const place = (note) => {
      const key = document.createElement('div');
      const black = isBlack(note);
      const left = width * seen.filter((white) => white < note).length;
      key.className = `key ${black ? 'black' : 'white'}`;
      // The whole is one element with a name of its own.
      key.setAttribute('aria-hidden', 'true');
      key.style.left = `${black ? left - 0.3 * width : left}%`;
      key.style.width = `${black ? 0.6 * width : width}%`;
      key.classList.toggle('silent', this.silent.has(note) || note < this.first || note > this.last);
      const letter = this.letters.get(note);
      if (letter) key.append(Object.assign(document.createElement('kbd'), { textContent: letter }));
      // A C has the name that every keyboard gives it, as in the plugin's window.
      const name = note % 12 === 0 ? noteName(note) : '';
      if (!black) key.append(Object.assign(document.createElement('i'), { textContent: name }));
      this.keys.set(note, key);
      return key;
    };
    const notes = Array.from({ length: this.shown[1] - this.shown[0] + 1 }, (_, n) => this.shown[0] + n);
    this.element.replaceChildren(...notes.map(place));
    this.mark(this.sounding);
  }

  /** The key that sounds. */
  mark(note) {
    this.keys.get(this.sounding)?.classList.remove('down');
    const isNew = note !== this.sounding;
    this.sounding = note;
    const isLookedFor = performance.now() - (this.shifted ?? -Infinity) < LOOKED_MS;
    if (isNew && note !== undefined && this.touches.size === 0 && !isLookedFor && !this.keys.has(note)) {
      // What sounds from elsewhere is seen, too.
      this.from = note - 5;
      this.build();
      return;
    }
    this.keys.get(note)?.classList.add('down');
  }

  noteAt(event) {
    const box = this.element.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const hit = (black) => [...this.keys].find(([note, key]) => isBlack(note) === black && x >= key.offsetLeft && x < key.offsetLeft + key.offsetWidth);
    const found = (y < 0.6 * box.height && hit(true)) || hit(false);
    return found && !found[1].classList.contains('silent') ? found[0] : null;
  }

  down(event) {
    const note = this.noteAt(event);
    if (note === null || !isMain(event)) return;
    event.preventDefault();
    this.element.setPointerCapture(event.pointerId);
    this.touches.set(event.pointerId, { note, y: event.clientY });
    this.breathe(TOUCH);
    this.hands.press(note, Math.round(127 * TOUCH), who(event.pointerId));
  }

  move(event) {
    const touch = this.touches.get(event.pointerId);
    if (!touch) return;
    const note = this.noteAt(event);
    if (note !== null && note !== touch.note) {
      const before = touch.note;
      touch.note = note;
      this.hands.press(note, Math.round(127 * TOUCH), who(event.pointerId));
      this.hands.release(before, who(event.pointerId));
    }
    this.breathe(clamp(TOUCH + (touch.y - event.clientY) / HEIGHT, 0.04, 1));
  }

  /** Ends every touch: what the pointers do next is not told. */
  end() {
    [...this.touches.keys()].forEach((pointerId) => this.up({ pointerId }));
  }

  up(event) {
    const touch = this.touches.get(event.pointerId);
    if (!touch) return;
    this.touches.delete(event.pointerId);
    this.hands.release(touch.note, who(event.pointerId));
    if (this.touches.size === 0) this.breathe(null);
  }
}
