// How hard the player blows, in a musician's words: from where the note speaks to fortissimo.

/** Part of the column below the threshold. */
const BELOW = 0.07;
/** Least mouth pressure that is shown, kPa. */
const LEAST_KPA = 0.02;

export class Meter {
  /** `dynamics` are names and places between pianissimo, 0, and fortissimo, 1. */
  constructor(dynamics) {
    const get = (id) => document.getElementById(id);
    [this.air, this.marks, this.words] = ['air', 'dynamics', 'breathing'].map(get);
    this.dynamics = dynamics;
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
  }

  /** Dynamic 0..1, or below 0 where there is none; mouth pressure over the closing pressure, and in kPa. */
  follow(dynamic, gamma, kpa) {
    let height = 0;
    if (kpa > LEAST_KPA) height = this.isPhysical || dynamic < 0 ? gamma / 1.2 : BELOW + (0.95 - BELOW) * dynamic;
    this.air.style.transform = `translateY(${(100 * (1 - Math.min(1, height))).toFixed(1)}%)`;
    const nearest = (item) => Math.abs(item.at - height);
    const now = height > 0 ? this.items.reduce((a, b) => (nearest(b) < nearest(a) ? b : a)) : null;
    this.items.forEach((item) => item.classList.toggle('now', item === now));
  }

  say(text) {
    if (this.words.textContent !== text) this.words.textContent = text;
  }
}
