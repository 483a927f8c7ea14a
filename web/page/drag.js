// Playing on the picture of the clarinet: left and right is the note, up and down the breath. Two fingers are two keys.

import { clamp } from './names.js';
import { isMain } from './pointers.js';

const who = (pointerId) => `pointer ${pointerId} on the clarinet`;

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
    if (this.isOff || this.notes.length === 0 || !isMain(event)) return;
    event.preventDefault();
    this.element.setPointerCapture(event.pointerId);
    const touch = this.read(event);
    this.touches.set(event.pointerId, touch);
    this.breathe(touch.breath);
    this.press(touch, event.pointerId);
    this.show([...this.touches.values()]);
  }

  move(event) {
    const before = this.touches.get(event.pointerId);
    if (!before) return;
    const touch = this.read(event);
    this.touches.set(event.pointerId, touch);
    if (touch.note !== before.note) {
      this.press(touch, event.pointerId);
      this.hands.release(before.note, who(event.pointerId));
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
    this.hands.release(touch.note, who(event.pointerId));
    if (this.touches.size === 0) this.breathe(null);
    this.show([...this.touches.values()]);
  }

  press({ note, breath }, pointerId) {
    this.hands.press(note, clamp(Math.round(127 * breath), 1, 127), who(pointerId));
  }
}
