// How hard the player blows, in a musician's words: from where the note speaks to fortissimo.

/** Part of the column below the threshold. */
const BELOW = 0.07;
/** Mouth pressure at the top, over the closing pressure. */
const TOP_GAMMA = 1.2;
/** Least mouth pressure that is shown, kPa. */
const LEAST_KPA = 0.02;

export class Meter {
  /**
   * `dynamics` are names and places between pianissimo, 0, and fortissimo, 1; `struck` are the `dynamic` of a key that is struck
   * with 0 and with 1, and its `gamma` where breath is pressure: mouth pressure over the closing pressure.
   */
  constructor(dynamics, struck) {
    const get = (id) => document.getElementById(id);
    [this.air, this.marks, this.words, this.set] = ['air', 'dynamics', 'breathing', 'set'].map(get);
    [this.dynamics, this.struck] = [dynamics, struck];
    this.setPhysical(false);
  }

  /** Whether breath is pressure, as with a blowing machine: then marks say where the reed speaks and closes. */
  setPhysical(isPhysical) {
    this.isPhysical = isPhysical;
    const marks = isPhysical ? [[0.33, 'speaks'], [0.83, 'closes']] : this.dynamics.map(([name, at]) => [BELOW + (0.95 - BELOW) * at, name]);
    this.items = marks.map(([at, name]) => {
      const item = Object.assign(document.createElement('li'), { textContent: name });
      item.style.bottom = `${100 * at}%`;
      if (isPhysical) item.className = 'onset';
      item.at = at;
      return item;
    });
    this.marks.replaceChildren(...this.items);
    document.querySelector('.speaks').style.bottom = `${isPhysical ? 33 : 100 * BELOW}%`;
    if (this.velocity !== undefined) this.mark(this.velocity);
  }

  /** Marks how loud the next key will be that is struck with this velocity, 0..1. */
  mark(velocity) {
    this.velocity = velocity;
    const [soft, loud] = this.isPhysical ? this.struck.gamma.map((gamma) => gamma / TOP_GAMMA) : this.struck.dynamic.map((dynamic) => BELOW + (0.95 - BELOW) * dynamic);
    this.set.style.bottom = `${(100 * (soft + (loud - soft) * velocity)).toFixed(1)}%`;
    this.set.hidden = false;
  }

  /** Dynamic 0..1, or below 0 where there is none; mouth pressure over the closing pressure, and in kPa. */
  follow(dynamic, gamma, kpa) {
    let height = 0;
    if (kpa > LEAST_KPA) height = this.isPhysical || dynamic < 0 ? gamma / TOP_GAMMA : BELOW + (0.95 - BELOW) * dynamic;
    this.air.style.transform = `translateY(${(100 * (1 - Math.min(1, height))).toFixed(1)}%)`;
    const nearest = (item) => Math.abs(item.at - height);
    const now = height > 0 ? this.items.reduce((a, b) => (nearest(b) < nearest(a) ? b : a)) : null;
    this.items.forEach((item) => item.classList.toggle('now', item === now));
  }

  say(text) {
    if (this.words.textContent !== text) this.words.textContent = text;
  }
}
