// Playing on the picture of the clarinet: left and right is the note, up and down the breath. Two fingers are two keys.

import { clamp } from './names.js';

export class Drag {
  /** `notes` are those that sound, upwards; `show` gets the touches to draw. */
  constructor(element, hands, breathe, show) {
    Object.assign(this, { element, hands, breathe, show, notes: [], touches: new Map() });
    element.addEventListener('pointerdown', (event) => this.down(event));
    element.addEventListener('pointermove', (event) => this.move(event));
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) element.addEventListener(type, (event) => this.up(event));
  }

  read(event) {
    const box = this.element.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const share = clamp((x / box.width - 0.03) / 0.94, 0, 0.9999);
    // The upper tenth is fortissimo, the lower tenth pianissimo.
    const breath = clamp(0.04 + (0.96 * (0.9 - y / box.height)) / 0.8, 0.04, 1);
    return { x, y, breath, note: this.notes[Math.floor(share * this.notes.length)] };
  }

  down(event) {
    if (this.isOff || this.notes.length === 0) return;
    event.preventDefault();
    this.element.setPointerCapture(event.pointerId);
    const touch = this.read(event);
    this.touches.set(event.pointerId, touch);
    this.breathe(touch.breath);
    this.hands.press(touch.note, clamp(Math.round(127 * touch.breath), 1, 127));
    this.show([...this.touches.values()]);
  }

  move(event) {
    const before = this.touches.get(event.pointerId);
    if (!before) return;
    const touch = this.read(event);
    this.touches.set(event.pointerId, touch);
    if (touch.note !== before.note) {
      this.hands.press(touch.note, clamp(Math.round(127 * touch.breath), 1, 127));
      this.letGo(before.note);
    }
    this.breathe(touch.breath);
    this.show([...this.touches.values()]);
  }

  /** Ends every touch: what the pointers do next is not told. */
  end() {
    [...this.touches.keys()].forEach((pointerId) => this.up({ pointerId }));
  }

  up(event) {
    const touch = this.touches.get(event.pointerId);
    if (!touch) return;
    this.touches.delete(event.pointerId);
    this.letGo(touch.note);
    if (this.touches.size === 0) this.breathe(null);
    this.show([...this.touches.values()]);
  }

  letGo(note) {
    if (![...this.touches.values()].some((other) => other.note === note)) this.hands.release(note);
  }
}
