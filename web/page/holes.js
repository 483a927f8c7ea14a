// Moving tone holes: drag one along the bore, or give its place and width. The instrument keeps its tuning, so that what a moved
// hole does is heard. Heard at once as the grid of the bore has it, and exactly when the fit is done.

import { clamp } from './names.js';
import { hasMoved, isMain, leaveAfterPointer } from './pointers.js';
import { NotLoaded } from './workshop.js';

/** Steps that can be undone. */
const KEPT = 100;
/** Nothing has moved for so long: the fit begins, ms. */
const REST_MS = 350;
/** Time between two instruments while a hole is dragged: each costs the audio thread some 20 ms, ms. */
const EACH_MS = 200;
/** How much wider a hole becomes where the pointer goes up by a pixel with Shift held, m of the radius. */
const WIDER_M = 0.05e-3;
/** The pointer takes a hole that is so near, pixels. */
const NEAR = 26;
const HINT = matchMedia('(hover: none)').matches
  ? 'Drag a hole along the bore. Its width is the second number.'
  : 'Drag a hole along the bore. With Shift, up makes it wider.';
/** What has failed stays to be read for so long, unless the user acts, ms. */
const TOLD_MS = 6000;
/** Half of the last digit of place and width in the panel, m. */
const SAME = 5e-5;
const get = (id) => document.getElementById(id);
/** What is wrong with a file, without the excerpt that a parser shows. */
const inShort = (reason) => reason.replace(/TOML parse error at line (\d+)[^]*/, 'Line $1 is not understood.');
const bytes = (text) => new TextEncoder().encode(text);

export class Holes {
  /** `limits` of holes are the core's, from data.json. `on` gets { isOpen }, and { opened: instrument } when a file has been opened. */
  constructor(engine, workshop, drawing, drag, limits, say, on) {
    Object.assign(this, { engine, workshop, drawing, drag, limits, say, on, moved: [], undo: [], chosen: null, held: null, version: 0 });
    this.canvas = get('clarinet');
    get('holes').onclick = () => this.show(!this.isOpen);
    get('hole-done').onclick = () => this.leave();
    get('hole-panel').addEventListener('keydown', ({ key }) => key === 'Escape' && this.leave());
    // The computer's keys are for playing again after a choice by the mouse, and after a number.
    get('hole').onchange = () => {
      this.choose(Number(get('hole').value));
      leaveAfterPointer(get('hole'));
    };
    for (const id of ['hole-place', 'hole-width']) {
      get(id).onchange = () => this.read();
      // No handler that is a property: what it returns could keep the key from the field.
      get(id).addEventListener('keydown', ({ key, target }) => key === 'Enter' && target.blur());
    }
    get('hole-undo').onclick = () => this.undo.length > 0 && this.put(this.undo.pop());
    get('hole-back').onclick = () => this.change([]);
    get('hole-save').onclick = () => this.save();
    get('hole-open').onclick = () => get('hole-file').click();
    get('hole-file').onchange = () => {
      const [file] = get('hole-file').files;
      get('hole-file').value = '';
      if (file) this.open(file);
    };
    // What is dropped beside would replace the page.
    addEventListener('dragover', (event) => event.preventDefault());
    addEventListener('drop', (event) => this.drop(event));
    this.canvas.addEventListener('pointerdown', (event) => this.isOpen && this.down(event));
    this.canvas.addEventListener('pointermove', (event) => this.move(event));
    for (const type of ['pointerup', 'pointercancel', 'lostpointercapture']) this.canvas.addEventListener(type, (event) => this.up(event));
  }

  /** Another instrument: `built` is what the page knows of it, `base` what a question to the workshop names it by. */
  setInstrument(built, base) {
    Object.assign(this, { built, base, moved: [], undo: [], chosen: null, held: null, version: this.version + 1, file: null });
    clearTimeout(this.fitting);
    this.workshop.long?.end();
    get('hole').replaceChildren(...built.holes.map(({ name, says }, at) => new Option(says || name.replaceAll('_', ' '), at)));
    this.state(HINT);
    this.choose(this.isOpen ? this.usual : null);
  }

  /** The hole whose numbers are shown before one is chosen. */
  get usual() {
    const { holes } = this.built;
    return holes.length > 0 ? Math.max(0, holes.findIndex(({ kind }) => kind === 'finger')) : null;
  }

  /** What the sound depends on, for other questions. */
  question() {
    return { rate: this.engine.sampleRate, ...this.base, moved: this.moved };
  }

  get holes() {
    return this.built.holes.map((hole) => {
      const moved = this.moved.find(({ name }) => name === hole.name);
      return moved ? { ...hole, x: moved.x_m, r: moved.radius_m } : hole;
    });
  }

  show(isOpen) {
    this.isOpen = isOpen;
    this.drag.isOff = isOpen;
    get('holes').setAttribute('aria-pressed', isOpen);
    get('hole-panel').hidden = !isOpen;
    if (isOpen && this.chosen === null) this.choose(this.usual);
    this.draw();
    this.on({ isOpen });
  }

  /** Closes the panel; who used it by keys is where they came from. */
  leave() {
    // A number that was not entered does not count.
    this.draw(true);
    this.show(false);
    get('holes').focus();
  }

  choose(hole) {
    this.chosen = hole;
    if (hole !== null) get('hole').value = hole;
    this.draw();
  }

  /** `all` also writes the field that has the focus. */
  draw(all = false) {
    this.drawing.setHoles(this.holes, this.isOpen ? this.chosen : null);
    const hole = this.holes[this.chosen];
    if (hole && (all || document.activeElement !== get('hole-place'))) get('hole-place').value = (1e3 * hole.x).toFixed(1);
    if (hole && (all || document.activeElement !== get('hole-width'))) get('hole-width').value = (2e3 * hole.r).toFixed(1);
    const built = this.built?.holes[this.chosen];
    if (built) {
      get('hole-place').title = `As built: ${(1e3 * built.x).toFixed(1)} mm`;
      get('hole-width').title = `As built: ${(2e3 * built.r).toFixed(1)} mm`;
    }
    get('hole-undo').disabled = this.undo.length === 0;
    get('hole-back').disabled = this.moved.length === 0;
    get('hole-save').disabled = !this.file;
  }

  down(event) {
    const box = this.canvas.getBoundingClientRect();
    const hole = this.drawing.holeAt(event.clientX - box.left, event.clientY - box.top, NEAR);
    if (hole === null || this.held || !isMain(event)) return;
    event.preventDefault();
    this.canvas.setPointerCapture(event.pointerId);
    this.choose(hole);
    this.held = { x: event.clientX, y: event.clientY, hole: this.holes[hole], pointerId: event.pointerId, isMoving: false };
  }

  move(event) {
    if (this.held?.pointerId !== event.pointerId) return;
    const { x, y, hole, isMoving } = this.held;
    if (!isMoving) {
      // Who chooses a hole does not move it.
      if (!hasMoved(event, { clientX: x, clientY: y })) return;
      this.held.isMoving = true;
      this.remember();
    }
    const wide = event.shiftKey;
    this.set(hole.x + (wide ? 0 : (event.clientX - x) / this.drawing.scale), hole.r + (wide ? WIDER_M * (y - event.clientY) : 0));
  }

  up({ pointerId, type }) {
    if (this.held?.pointerId !== pointerId) return;
    const { isMoving } = this.held;
    this.held = null;
    if (isMoving && type === 'pointercancel') this.put(this.undo.pop());
  }

  read() {
    const [place, width] = ['hole-place', 'hole-width'].map((id) => Number(get(id).value));
    if (this.chosen === null) return;
    const said = this.outside('place', place, this.room()) ?? this.outside('width', width, this.widths(place / 1e3));
    if (said) {
      this.draw(true);
      this.state(said, true);
      return;
    }
    this.remember();
    // Full precision stays where the number was not touched.
    const { x, r } = this.holes[this.chosen];
    this.set(Math.abs(1e3 * x - place) < 0.051 ? x : place / 1e3, Math.abs(2e3 * r - width) < 0.051 ? r : width / 2e3);
  }

  /** Between which places the chosen hole can be, m. */
  room() {
    const { holes } = this;
    const [above, here, below] = [-1, 0, 1].map((by) => holes[this.chosen + by]?.x);
    const { least_x, gap } = this.limits;
    // Where neighbours were built closer together, the hole stays between them.
    return [Math.min(here, above === undefined ? least_x : above + gap), Math.max(here, (below ?? this.built.length) - gap)];
  }

  /** Least and greatest radius at a place: not wider than the bore, m. */
  radii(x) {
    const [least, most] = this.limits.radius;
    return [least, Math.max(least, Math.min(most, this.drawing.boreRadius(x)))];
  }

  widths(x) {
    return this.radii(x).map((radius) => 2 * radius);
  }

  /** What to say where a number, mm, is not in a range, m. */
  outside(what, number, range) {
    const [least, most] = [Math.ceil(1e4 * range[0] - 1e-6) / 10, Math.floor(1e4 * range[1] + 1e-6) / 10];
    if (number >= least && number <= most) return undefined;
    return `The ${what} must lie between ${least.toFixed(1)} and ${most.toFixed(1)} mm.`;
  }

  remember() {
    this.undo.push(this.moved);
    if (this.undo.length > KEPT) this.undo.shift();
  }

  change(moved) {
    this.remember();
    this.put(moved);
  }

  /** The chosen hole at a place and with a radius, m, as far as there is room between its neighbours. */
  set(x, r) {
    const { name } = this.holes[this.chosen];
    const x_m = clamp(x, ...this.room());
    const moved = { name, x_m, radius_m: clamp(r, ...this.radii(x_m)) };
    // In their order along the bore, whichever was touched last.
    const place = (hole) => this.built.holes.findIndex((built) => built.name === hole.name);
    const others = this.moved.filter((other) => other.name !== name);
    // One that is back where it was built has not moved.
    const built = this.built.holes[this.chosen];
    const isBack = Math.abs(moved.x_m - built.x) < SAME && Math.abs(2 * (moved.radius_m - built.r)) < SAME;
    this.put((isBack ? others : [...others, moved]).sort((a, b) => place(a) - place(b)));
  }

  /** Puts all holes back where they were built, as a step that can be undone. */
  reset() {
    if (this.moved.length > 0) this.change([]);
  }

  put(moved) {
    this.moved = moved;
    this.version += 1;
    // What can be saved is the answer to this question.
    this.file = null;
    this.failedAt = -Infinity;
    this.draw();
    clearTimeout(this.fitting);
    if (moved.length === 0) {
      this.workshop.long?.end();
      this.state('As built');
      this.on({ built: true });
    } else {
      this.hearAtOnce();
      this.fitting = setTimeout(() => this.hearFitted(), REST_MS);
    }
    this.on({ moved });
  }

  /** One question at a time, and the latest wins. */
  async hearAtOnce() {
    if (this.isAsking) {
      this.isStale = true;
      return;
    }
    this.isAsking = true;
    try {
      const { version, base } = this;
      const told = await this.workshop.ask({ do: 'move', ...this.question() });
      // Heard though the hole has gone on, but not where it has been put back or the instrument is another.
      if (this.moved.length > 0 && base === this.base) this.take(told, false, version === this.version);
    } catch (error) {
      this.fail('The hole cannot be there', error);
    }
    await new Promise((later) => setTimeout(later, EACH_MS));
    this.isAsking = false;
    if (this.isStale) {
      this.isStale = false;
      this.hearAtOnce();
    }
  }

  async hearFitted() {
    const { version, base } = this;
    this.progress('Computing the exact pitch …');
    try {
      const told = await this.workshop.askLong({ do: 'move', fit: true, ...this.question() });
      if (version === this.version && base === this.base) this.take(told, true, true);
    } catch (error) {
      this.fail('The bore could not be fitted', error);
    }
  }

  fail(what, error) {
    this.state(error instanceof NotLoaded ? error.message : `${what}: ${error.message}`, true);
  }

  take({ file, prepared, holes }, isFitted, isLatest) {
    // The fit was quicker than the answer before it.
    if (!isFitted && isLatest && this.fittedVersion === this.version) return;
    if (isFitted) this.fittedVersion = this.version;
    if (isLatest) this.file = file;
    this.engine.send({ prepared: { file: bytes(file), prepared: bytes(prepared) } });
    this.on({ heard: { isFitted, file, prepared } });
    if (!isLatest) return;
    // Where there is no room for it, it stands elsewhere than asked.
    this.moved = this.moved.map((moved) => {
      const { x, r } = holes.find(({ name }) => name === moved.name);
      return { ...moved, x_m: x, radius_m: r };
    });
    this.draw();
    this.progress(isFitted ? 'Exact' : 'Pitch within about 10 cents; computing the exact pitch …');
  }

  /** What a worker has prepared does not fit the sound. */
  refuse() {
    this.state('The moved holes are not heard. Reload the page to try again.', true);
  }

  /** What a worker is at; it waits for a failure to be read. */
  progress(text) {
    clearTimeout(this.later);
    this.later = setTimeout(() => this.state(text), Math.max(0, this.failedAt + TOLD_MS - performance.now()));
  }

  /** `details` are for who points at the text. */
  state(text, hasFailed = false, details = '') {
    clearTimeout(this.later);
    this.failedAt = hasFailed ? performance.now() : -Infinity;
    Object.assign(get('hole-state'), { textContent: text, title: details });
    get('hole-state').classList.toggle('failed', hasFailed);
  }

  save() {
    if (!this.file) return;
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([this.file], { type: 'application/toml' }));
    link.download = `${this.built.id ?? 'instrument'}_holes_moved.toml`;
    link.click();
    // Some browsers read it later.
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
  }

  drop(event) {
    event.preventDefault();
    const [file] = event.dataTransfer?.files ?? [];
    if (!file) return;
    if (!this.isOpen) this.show(true);
    if (/\.toml$/i.test(file.name)) this.open(file);
    else this.state(`${file.name} is not opened. A Chalumeau instrument file ends in .toml.`, true);
  }

  async open(file) {
    const text = await file.text();
    this.state('Preparing the instrument; one of your own takes minutes …');
    try {
      const told = await this.workshop.askApart({ do: 'open', rate: this.question().rate, text });
      this.state('');
      this.on({ opened: told });
    } catch (error) {
      if (error instanceof NotLoaded) this.state(error.message, true);
      else this.state(`${file.name} is not opened. ${inShort(error.message)}`, true, error.message);
    }
  }
}
